//! Damped Newton to a task, within the limits (Levenberg-Marquardt with damping by the error: Sugihara 2011).

use super::coupled::step_within;
use crate::kinematics::sized::{forward, jacobian};
use crate::linalg::damped::damped_step;
use crate::linalg::size;
use crate::linalg::vector::{Vec3, norm};
use crate::linalg::with_capacity;
use crate::robot::{Limits, Robot};
use crate::task::{Target, Task};

/// Least damping, relative to the squared size of the task's Jacobian.
const LEAST_DAMPING: f64 = 1e-14;
/// Damping relative to the squared error.
const DAMPING: f64 = 0.05;
/// Largest motion of a joint in one step [rad or m].
const LARGEST_STEP: f64 = 1.0;
/// Steps that were refused in a row before the search is given up.
const MAX_REFUSED: usize = 8;

/// Where a search for a task ended.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Larger of orientation error \[rad\] and position error over length.
    pub error: f64,
    /// Steps taken or refused.
    pub iterations: usize,
}

/// The size of a motion: the larger of the angle and the translation over `length`.
#[inline(always)]
fn size_of((w, v): (Vec3, Vec3), length: f64) -> f64 {
    norm(w).max(norm(v) / length)
}

/// The motion [w; v] that takes the tool at `q` to the target: [`Task::error`].
#[inline(never)]
pub(crate) fn error_at<const C: usize>(robot: &Robot, task: &Task, target: &Target, q: &[f64]) -> (Vec3, Vec3) {
    task.error(&forward::<C>(robot, q), target)
}

/// Moves `q` towards the target until the error is below `tolerance`, staying within position limits, if any are given; leaves it at the nearest
/// posture found.
///
/// # Panics
/// Never; `q` has to hold one number a joint, else it is left as it is and the error is infinite.
pub fn reach(
    robot: &Robot,
    limits: Option<&Limits>,
    task: &Task,
    target: &Target,
    length: f64,
    q: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
) -> Reach {
    if q.len() != robot.n() {
        return Reach { error: f64::INFINITY, iterations: 0 };
    }
    with_capacity!(q.len(), reach_sized(robot, limits, task, target, length, q, tolerance, max_iterations))
}

/// [`reach`] with the capacity at hand.
#[inline(always)]
pub(crate) fn reach_sized<const C: usize>(
    robot: &Robot,
    limits: Option<&Limits>,
    task: &Task,
    target: &Target,
    length: f64,
    q: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
) -> Reach {
    reach_holding::<C>(robot, limits, task, target, length, q, 0, tolerance, max_iterations)
}

/// The same without the joints of `held`, one bit a joint.
#[inline(never)]
pub(crate) fn reach_holding<const C: usize>(
    robot: &Robot,
    limits: Option<&Limits>,
    task: &Task,
    target: &Target,
    length: f64,
    q: &mut [f64],
    held: u32,
    tolerance: f64,
    max_iterations: usize,
) -> Reach {
    let n = size::<C>(robot.n());
    let (mut refused, mut caution) = (0, 1.0);
    let coupled = limits.is_some_and(|limits| !limits.coupled.is_empty());
    if let (Some(limits), true) = (limits, coupled) {
        // A start that cannot be moved within them stays where it is.
        limits.pull_inside(q);
    }
    let mut motion = error_at::<C>(robot, task, target, q);
    let mut error = size_of(motion, length);
    for iterations in 0..max_iterations {
        if error <= tolerance || refused >= MAX_REFUSED {
            return Reach { error, iterations };
        }
        let step = if coupled {
            coupled_step::<C>(robot, task, target, motion, length, q, held, caution)
        } else {
            step_towards::<C>(robot, limits, task, target, motion, length, q, held, caution)
        };
        let mut trial = [0.0; C];
        for i in 0..n {
            trial[i] = q[i] + step[i];
            if let Some(limits) = limits {
                trial[i] = trial[i].clamp(limits.q_min[i], limits.q_max[i]);
            }
        }
        let there = error_at::<C>(robot, task, target, &trial[..n]);
        let next = size_of(there, length);
        if next < error {
            // Steps that hardly help will not get there.
            refused = if next > 0.99 * error { refused + 1 } else { 0 };
            caution = f64::max(0.3 * caution, 1e-3);
            (motion, error) = (there, next);
            q.copy_from_slice(&trial[..n]);
        } else {
            refused += 1;
            caution *= 10.0;
        }
    }
    Reach { error, iterations: max_iterations }
}

/// One damped step along the motion [w; v] that is left; joints that stand at a limit and would cross it are held, and the others make up for them.
#[inline(always)]
fn step_towards<const C: usize>(
    robot: &Robot,
    limits: Option<&Limits>,
    task: &Task,
    target: &Target,
    (w, v): (Vec3, Vec3),
    length: f64,
    q: &[f64],
    held: u32,
    caution: f64,
) -> [f64; C] {
    let n = size::<C>(robot.n());
    let (tool, columns) = jacobian::<C>(robot, q);
    let b = task.directions(&tool, length).reduce(w, v);
    let mut rows = task.constraint(&tool, target, length).jacobian(&columns);
    for i in (0..n).filter(|i| held >> i & 1 == 1) {
        for row in &mut rows {
            row[i] = 0.0;
        }
    }
    let m = task.dimension();
    let square: f64 = b.iter().map(|x| x * x).sum();
    let scale: f64 = rows.iter().flatten().map(|x| x * x).sum();
    let damping = DAMPING * caution * square + LEAST_DAMPING * scale;
    let mut step = damped_step(&rows, &b, damping, n, m);
    let Some(limits) = limits else { return shortened(step) };
    let mut stopped = false;
    for i in 0..n {
        if (q[i] <= limits.q_min[i] && step[i] < 0.0) || (q[i] >= limits.q_max[i] && step[i] > 0.0) {
            stopped = true;
            for row in rows.iter_mut().take(m) {
                row[i] = 0.0;
            }
        }
    }
    if stopped {
        step = damped_step(&rows, &b, damping, n, m);
    }
    shortened(step)
}

/// The same where limits on combinations of joints hold.
#[cold]
#[inline(never)]
fn coupled_step<const C: usize>(
    robot: &Robot,
    task: &Task,
    target: &Target,
    motion: (Vec3, Vec3),
    length: f64,
    q: &[f64],
    held: u32,
    caution: f64,
) -> [f64; C] {
    let damping = DAMPING * caution * size_of(motion, length).powi(2);
    let step = step_within(robot, task, target, motion, length, q, held, damping);
    shortened(std::array::from_fn(|i| step.get(i).copied().unwrap_or(0.0)))
}

/// The step, no joint moving farther than [`LARGEST_STEP`].
#[inline(always)]
fn shortened<const C: usize>(step: [f64; C]) -> [f64; C] {
    let largest = step.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let shorten = if largest > LARGEST_STEP { LARGEST_STEP / largest } else { 1.0 };
    step.map(|x| shorten * x)
}
