//! How near a posture is to a singularity, which one it is, and what may move there.

use super::analytic::Factors;
use crate::error::{Result, check_positive, check_vector};
use crate::kinematics::jacobian_into;
use crate::kinematics::sized::jacobian;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::svd::Svd;
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::robot::{Joint, Robot};
use crate::task::Task;

/// A factor of the determinant is named where it is below this multiple of the tolerance, or is the smallest.
const NAMED: f64 = 30.0;
/// Smallest singular value, over the largest, at which a posture that a solver calls singular may have free joints.
const FREE: f64 = 1e-5;
/// Part of a unit null vector from which a joint counts as moving.
const MOVES: f64 = 1e-3;

/// A posture's singularity.
#[derive(Debug, Clone, PartialEq)]
pub struct Singularity {
    /// "regular"; which of "shoulder", "elbow" and "wrist" it is, or several with commas; "singular" where these mean nothing.
    pub kind: String,
    /// Smallest singular value of the Jacobian without units: translations over the size of the robot.
    pub value: f64,
    /// The unit twist [w; v over the size] that the tool makes least of, in the base frame, of robots of six joints or more.
    pub twist: Option<Row6>,
    /// The unit motion of the joints that moves the tool least, of robots of six joints or fewer.
    pub joints: Option<Vec<f64>>,
}

/// Columns of the Jacobian without units: linear parts over the size of the robot, sliding joints counted in sizes.
#[inline(never)]
fn columns(robot: &Robot, q: &[f64]) -> [Row6; MAX_JOINTS] {
    let (n, size, mut jacobian, mut columns) = (robot.n(), robot.size(), [0.0; 6 * MAX_JOINTS], [[0.0; 6]; MAX_JOINTS]);
    // Of as many coordinates as there are joints: never refused.
    if jacobian_into(robot, q, &mut jacobian[..6 * n]).is_ok() {
        for (i, column) in columns[..n].iter_mut().enumerate() {
            let linear = if robot.joints()[i] == Joint::Prismatic { 1.0 } else { 1.0 / size };
            *column = std::array::from_fn(|r| if r < 3 { jacobian[r * n + i] } else { linear * jacobian[r * n + i] });
        }
    }
    columns
}

/// The matrix by rows.
fn rows(columns: &[Row6; MAX_JOINTS]) -> Rows6<MAX_JOINTS> {
    std::array::from_fn(|r| std::array::from_fn(|i| columns[i][r]))
}

/// Of the transpose of some columns, at most six; and how many they are.
fn of_joints(columns: impl Iterator<Item = Row6>) -> (Svd<MAX_JOINTS>, usize) {
    let (mut rows, mut count) = ([[0.0; MAX_JOINTS]; 6], 0);
    for (row, column) in rows.iter_mut().zip(columns) {
        row[..6].copy_from_slice(&column);
        count += 1;
    }
    (Svd::new(&rows, 6, count), count)
}

/// The singularity of a posture, which is one where the smallest singular value is below `tolerance`.
pub fn singularity(robot: &Robot, q: &[f64], tolerance: f64) -> Result<Singularity> {
    let n = robot.n();
    check_vector("q", q, n)?;
    check_positive("tolerance", tolerance)?;
    let columns = columns(robot, q);
    // Left vectors are accurate where a matrix is singular, too: those of the Jacobian are twists, those of its transpose motions of the joints.
    let tool = (n >= 6).then(|| Svd::new(&rows(&columns), n, 6));
    let moved = (n <= 6).then(|| of_joints(columns[..n].iter().copied()).0);
    let least = n.min(6) - 1;
    let value = tool.as_ref().or(moved.as_ref()).map_or(0.0, |svd| svd.sigma[least]);
    Ok(Singularity {
        kind: if value < tolerance { kind(robot, q, NAMED * tolerance) } else { "regular".into() },
        value,
        twist: tool.map(|svd| svd.u[least]),
        joints: moved.map(|svd| svd.u[least][..n].to_vec()),
    })
}

/// Which of the factors vanish.
fn kind(robot: &Robot, q: &[f64], tolerance: f64) -> String {
    let Some(factors) = Factors::of(robot, q) else { return "singular".into() };
    let named = factors.named();
    let least = named.iter().fold(f64::INFINITY, |least, (_, factor)| least.min(*factor));
    named.iter().filter(|(_, factor)| *factor <= tolerance.max(least)).map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// The joints that may move while the task stays done and some joints (`held`) where they are, to first order, in a posture that a solver calls singular: one bit a joint.
pub(super) fn null_joints(robot: &Robot, task: &Task, q: &[f64], held: u32) -> u32 {
    let (tool, jacobian) = jacobian::<MAX_JOINTS>(robot, q);
    let rows = task.directions(&tool, robot.size()).rows(&jacobian);
    let moving: Vec<usize> = (0..robot.n()).filter(|i| held >> i & 1 == 0).collect();
    if moving.len() > 6 {
        return !held;
    }
    let (svd, count) = of_joints(moving.iter().map(|&i| rows.map(|row| row[i])));
    let null = |&k: &usize| svd.sigma[k] <= FREE * svd.sigma[0];
    let moves = |k: usize| moving.iter().enumerate().filter(move |(j, _)| svd.u[k][*j].abs() > MOVES).fold(0, |bits, (_, i)| bits | 1 << i);
    (0..count).filter(null).map(moves).fold(0, |bits, more| bits | more)
}

/// The unit motion of the joints of a robot of seven that leaves the tool still, without units.
pub(super) fn self_motion(robot: &Robot, q: &[f64]) -> [f64; MAX_JOINTS] {
    Orthogonal::new(&rows(&columns(robot, q)), robot.n(), 6).null_space()[0]
}
