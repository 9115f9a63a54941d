//! Damped Newton to a task, within the limits (Levenberg-Marquardt with damping by the error: Sugihara 2011).

use crate::kinematics::{forward, jacobian};
use crate::linalg::cholesky::Cholesky;
use crate::linalg::vector::{Vec3, norm};
use crate::linalg::{Mat6, Row6, Rows6, gram, size};
use crate::robot::Robot;
use crate::task::{Target, Task};

/// Least damping, relative to the squared length of the task's columns.
const LEAST_DAMPING: f64 = 1e-14;

/// Where a search for a task ended.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Largest of position error [m] over length, and orientation error [rad].
    pub error: f64,
    /// Steps taken.
    pub iterations: usize,
}

/// `A' (A A' + damping 1)^-1 b` for the m x n matrix `rows`: bounded by |b| / (2 sqrt(damping)).
#[inline(always)]
pub fn damped_step<const C: usize>(rows: &Rows6<C>, b: &Row6, damping: f64, n: usize, m: usize) -> [f64; C] {
    let n = size::<C>(n);
    let mut a: Mat6 = gram(rows, m);
    for r in 0..m {
        a[r][r] += damping;
    }
    let mut step = [0.0; C];
    if let Some(factor) = Cholesky::new(&a, m) {
        let x = factor.solve(b);
        for i in 0..n {
            step[i] = (0..m).map(|r| rows[r][i] * x[r]).sum();
        }
    }
    step
}

/// The size of a motion: the larger of the angle and the translation over `length`.
#[inline(always)]
pub fn size_of(w: Vec3, v: Vec3, length: f64) -> f64 {
    norm(w).max(norm(v) / length)
}

/// Moves `q` towards the target until the error is below `tolerance`, staying within the limits.
#[inline(always)]
pub fn reach<const C: usize>(
    robot: &Robot,
    task: &Task,
    target: &Target,
    length: f64,
    q: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
) -> Reach {
    let n = size::<C>(robot.n());
    let limits = robot.limits();
    let mut last = f64::INFINITY;
    for iterations in 0..max_iterations {
        let (tool, columns) = jacobian::<C>(robot, q);
        let (w, v) = task.error(&tool, target);
        let error = size_of(w, v, length);
        // Far away or stuck at limits: more steps than these rarely help.
        if error <= tolerance || (iterations >= 12 && error > 0.98 * last && error > 0.1) {
            return Reach { error, iterations };
        }
        last = error;
        let directions = task.directions(&tool, length);
        let b = directions.reduce(w, v);
        let reduced = directions.rows(&columns);
        let square: f64 = b.iter().map(|x| x * x).sum();
        let scale: f64 = reduced.iter().flatten().map(|x| x * x).sum();
        let step = damped_step(&reduced, &b, 0.05 * square + LEAST_DAMPING * scale, n, task.dimension());
        let largest = step.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let shorten = if largest > 1.0 { 1.0 / largest } else { 1.0 };
        for i in 0..n {
            q[i] = (q[i] + shorten * step[i]).clamp(limits.q_min[i], limits.q_max[i]);
        }
    }
    let (w, v) = task.error(&forward::<C>(robot, q), target);
    Reach { error: size_of(w, v, length), iterations: max_iterations }
}
