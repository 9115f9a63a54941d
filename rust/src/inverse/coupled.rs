//! Least squares within limits of joints and on combinations of them: what a step towards a task, and a tick, are where these hold.

use crate::kinematics::sized::jacobian;
use crate::linalg::vector::Vec3;
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::qp::{self, ActiveSet, DenseRow, Problem, Status};
use crate::robot::{MAX_COMBINATIONS, Robot};
use crate::task::{Target, Task};

/// Least damping, relative to the squared size of the task's Jacobian: a programme needs more of it than a damped step.
const LEAST_DAMPING: f64 = 1e-12;

/// The motion x of `n` joints that minimises `|A x - b|^2 + damping |x - about|^2` within bounds and rows; `None` where they exclude each other. In the room for
/// the largest robots, so that no size has machine code of its own.
#[cold]
#[inline(never)]
pub(crate) fn least_squares(
    n: usize,
    (a, b): (&Rows6<MAX_JOINTS>, &Row6),
    (damping, about): (f64, &[f64]),
    (low, high): (&[f64; MAX_JOINTS], &[f64; MAX_JOINTS]),
    rows: &[DenseRow<MAX_JOINTS>],
) -> Option<[f64; MAX_JOINTS]> {
    let size: f64 = a.iter().flatten().map(|x| x * x).sum();
    let damping = damping.max(LEAST_DAMPING * size);
    let (mut h, mut g) = ([[0.0; MAX_JOINTS]; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for i in 0..n {
        for j in 0..n {
            h[i][j] = a.iter().map(|row| row[i] * row[j]).sum();
        }
        h[i][i] += damping;
        g[i] = -damping * about[i] - a.iter().zip(b).map(|(row, b)| row[i] * b).sum::<f64>();
    }
    let found = qp::minimise(&Problem { n, h: &h, g: &g, lower: low, upper: high, rows }, &ActiveSet::default());
    (found.status == Status::Solved).then_some(found.x)
}

/// The damped step along the motion [w; v] that is left, within all limits; `held` joints stand, one bit a joint. No motion where there is none.
#[cold]
#[inline(never)]
pub(super) fn step_within(
    robot: &Robot,
    task: &Task,
    target: &Target,
    (w, v): (Vec3, Vec3),
    length: f64,
    q: &[f64],
    held: u32,
    damping: f64,
) -> [f64; MAX_JOINTS] {
    let (n, limits) = (q.len(), robot.limits());
    let (tool, columns) = jacobian::<MAX_JOINTS>(robot, q);
    let wanted = task.directions(&tool, length).reduce(w, v);
    let task_rows = task.constraint(&tool, target, length).jacobian(&columns);
    let (mut low, mut high) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for i in (0..n).filter(|i| held >> i & 1 == 0) {
        (low[i], high[i]) = ((limits.q_min[i] - q[i]).min(0.0), (limits.q_max[i] - q[i]).max(0.0));
    }
    let mut rows = [DenseRow::<MAX_JOINTS>::OPEN; MAX_COMBINATIONS];
    for (row, it) in rows.iter_mut().zip(&limits.coupled) {
        row.a[..n].copy_from_slice(&it.row);
        (row.lower, row.upper) = it.room(q);
    }
    let rows = &rows[..limits.coupled.len()];
    least_squares(n, (&task_rows, &wanted), (damping, &[0.0; MAX_JOINTS]), (&low, &high), rows).unwrap_or([0.0; MAX_JOINTS])
}
