//! From the end of a segment of a path to the start of the next: off the work, to the other posture, and down again.

use super::frames::tools;
use super::hooks::{Hooks, PlanError};
use super::part::Part;
use super::problem::{ON_PATH, PathProblem};
use super::settings::PlanSettings;
use crate::inverse::reach;
use crate::linalg::vector::{Vec3, add, scale};
use crate::task::{Target, Task};

/// How far the tool moves from posture to posture while it is lifted off \[m\].
const LIFT_STEP: f64 = 5e-3;
/// Largest motion of a joint from posture to posture where none is given [rad or m].
const STEP: f64 = 0.25;
/// Error at which a posture counts as there, and Newton steps to get there.
const REACHED: f64 = 1e-12;
const ITERATIONS: usize = 20;

/// The motion from the end of a segment to the start of the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// Point at which the tool is lifted off, and at which it is set down again.
    pub points: (usize, usize),
    /// Postures, n joints a row; the first and the last are on the path.
    pub q: Vec<f64>,
    /// How far the tool was drawn back along its axis, at either end \[m\]: less than was asked for where a limit or the robot's reach ended it.
    pub lift: (f64, f64),
    /// Whether the caller allows all of its postures.
    pub allowed: bool,
}

/// From the end of one part to the start of another.
pub(super) fn transfer(
    problem: &PathProblem,
    from: &Part,
    to: &Part,
    settings: &PlanSettings,
    hooks: &mut Hooks,
) -> Result<Transfer, PlanError> {
    let n = problem.n();
    let largest = settings.max_step.unwrap_or(STEP);
    let (mut q, up) = lifted(problem, &from.q[from.q.len() - n..], settings.lift_off, largest);
    let (mut down, drop) = lifted(problem, &to.q[..n], settings.lift_off, largest);
    down = down.chunks_exact(n).rev().flatten().copied().collect();
    let (start, end) = (q[q.len() - n..].to_vec(), &down[..n]);
    let furthest = start.iter().zip(end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let steps = ((furthest / largest).ceil() as usize).max(1);
    for i in 1..steps {
        let share = i as f64 / steps as f64;
        q.extend(start.iter().zip(end).map(|(a, b)| a + share * (b - a)));
    }
    q.extend(down);
    let allowed = hooks.all_allowed(&q, n)?;
    Ok(Transfer { points: (from.first + from.len() - 1, to.first), q, lift: (up, drop), allowed })
}

/// Postures from one on the path to where the tool is drawn back along its axis, as far as limits let it, and how far that is.
#[inline(never)]
fn lifted(problem: &PathProblem, q: &[f64], distance: f64, largest: f64) -> (Vec<f64>, f64) {
    let robot = &problem.robot;
    let task = Task::FULL.suited(robot);
    let tool = tools(robot, q)[0];
    let back: Vec3 = scale(-1.0, tool.rotate(problem.asked.spin_axis().unwrap_or([0.0, 0.0, 1.0])));
    let steps = (distance / LIFT_STEP).ceil().max(1.0);
    let (mut rows, mut now, mut lift) = (q.to_vec(), q.to_vec(), 0.0);
    for i in 1..=steps as usize {
        let far = distance * i as f64 / steps;
        let target = Target { position: add(tool.origin, scale(far, back)), axis: None, frame: tool.axes };
        let before = now.clone();
        let limits = problem.limits.then(|| robot.limits());
        let error = reach(robot, limits, &task, &target, problem.length, &mut now, REACHED, ITERATIONS).error;
        let within = !problem.limits || robot.limits().settle(&mut now);
        let calm = before.iter().zip(&now).all(|(a, b)| (a - b).abs() <= largest);
        if !(error <= ON_PATH && within && calm) || distance == 0.0 {
            break;
        }
        rows.extend(&now);
        lift = far;
    }
    (rows, lift)
}
