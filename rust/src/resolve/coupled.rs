//! Limits on combinations of joints in the ticks of every method: where rates would cross one, the nearest rates that do not, the task first.

use super::bounds::{coupled_rows, speed_bounds};
use crate::inverse::least_squares;
use crate::kinematics::sized::jacobian_apart;
use crate::linalg::MAX_JOINTS;
use crate::qp::DenseRow;
use crate::resolve::StepStatus;
use crate::robot::{MAX_COMBINATIONS, Robot};
use crate::task::Task;

/// Squared size of the task's Jacobian over the damping: the task comes first, to as many digits as the programme has left.
const TASK_FIRST: f64 = 1e8;
/// A row fails when it does by more than this, relative to what it is made of.
const FAILS: f64 = 1e-12;

/// What became of rates.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Kept {
    /// Whether a limit on a combination has changed them.
    pub held: bool,
    /// Whether one is beyond its limit and comes back.
    pub returning: bool,
}

impl Kept {
    /// The status of a tick that had one before.
    pub fn over(self, status: StepStatus) -> StepStatus {
        match status {
            _ if self.returning => StepStatus::Returning,
            StepStatus::Returning => status,
            _ if self.held => StepStatus::Limited,
            _ => status,
        }
    }
}

/// Keeps rates of a tick within the limits on combinations of joints: where one would be crossed it becomes a row of a programme that changes what the
/// tool does as little as can be, and then the rates. Limits of position and speed of single joints hold. In the room for the largest robots, so that
/// no size has machine code of its own. No allocation.
#[cold]
#[inline(never)]
pub(super) fn keep_combinations(robot: &Robot, task: &Task, length: f64, q: &[f64], dt: f64, rates: &mut [f64]) -> Kept {
    let (n, limits) = (q.len(), robot.limits());
    let (mut low, mut high) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    speed_bounds(limits, q, dt, &mut low[..n], &mut high[..n]);
    let mut rows = [DenseRow::<MAX_JOINTS>::OPEN; MAX_COMBINATIONS];
    let (count, returning) = coupled_rows(limits, q, dt, &low[..n], &high[..n], &mut rows);
    let rows = &rows[..count];
    if rows.iter().all(|row| holds(row, rates)) {
        return Kept { held: false, returning };
    }
    let (tool, columns) = jacobian_apart::<MAX_JOINTS>(robot, q);
    let task_rows = task.directions(&tool, length).rows(&columns);
    let size: f64 = task_rows.iter().flatten().map(|x| x * x).sum();
    let mut made = [0.0; 6];
    for (made, row) in made.iter_mut().zip(&task_rows) {
        *made = row.iter().zip(&*rates).map(|(a, x)| a * x).sum();
    }
    let damping = if size > 0.0 { size / TASK_FIRST } else { 1.0 };
    match least_squares(n, (&task_rows, &made), (damping, rates), (&low, &high), rows) {
        Some(found) => rates.copy_from_slice(&found[..n]),
        // Limits that exclude each other on the way back: to stand still makes nothing worse.
        None => rates.fill(0.0),
    }
    Kept { held: true, returning }
}

/// Whether a row holds.
fn holds(row: &DenseRow<MAX_JOINTS>, rates: &[f64]) -> bool {
    let (value, size) = row.a.iter().zip(rates).fold((0.0, 0.0), |(value, size), (a, x)| (value + a * x, size + (a * x).abs()));
    value >= row.lower - FAILS * size && value <= row.upper + FAILS * size
}
