//! A step towards a task where limits on combinations of joints hold.

use crate::kinematics::sized::jacobian;
use crate::linalg::MAX_JOINTS;
use crate::linalg::vector::Vec3;
use crate::qp::{self, ActiveSet, DenseRow, Problem, Status};
use crate::robot::{MAX_COMBINATIONS, Robot};
use crate::task::{Target, Task};

/// Least damping, relative to the squared size of the task's Jacobian: a programme needs more of it than a damped step.
const LEAST_DAMPING: f64 = 1e-12;

/// The damped step along the motion [w; v] that is left, within all limits: a programme in which they are bounds and rows; `held` joints stand, one bit a
/// joint. In the room for the largest robots, so that no size has machine code of its own. No motion where there is none.
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
    let size: f64 = task_rows.iter().flatten().map(|x| x * x).sum();
    let (mut h, mut g) = ([[0.0; MAX_JOINTS]; MAX_JOINTS], [0.0; MAX_JOINTS]);
    let (mut low, mut high) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for i in 0..n {
        for j in 0..n {
            h[i][j] = task_rows.iter().map(|row| row[i] * row[j]).sum();
        }
        h[i][i] += damping.max(LEAST_DAMPING * size);
        g[i] = -task_rows.iter().zip(&wanted).map(|(row, wanted)| row[i] * wanted).sum::<f64>();
        if held >> i & 1 == 0 {
            (low[i], high[i]) = ((limits.q_min[i] - q[i]).min(0.0), (limits.q_max[i] - q[i]).max(0.0));
        }
    }
    let mut rows = [DenseRow::<MAX_JOINTS>::OPEN; MAX_COMBINATIONS];
    for (row, it) in rows.iter_mut().zip(&limits.coupled) {
        row.a[..n].copy_from_slice(&it.row);
        (row.lower, row.upper) = it.room(q);
    }
    let rows = &rows[..limits.coupled.len()];
    let found = qp::minimise(&Problem { n, h: &h, g: &g, lower: &low, upper: &high, rows }, &ActiveSet::default());
    if found.status == Status::Solved { found.x } else { [0.0; MAX_JOINTS] }
}
