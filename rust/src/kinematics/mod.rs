//! Forward kinematics, the Jacobian and its derivatives, and the sweep that pulls an index back from the Jacobian to the joints.
//!
//! Twists and the rows of Jacobians are `[omega; v]`, angular part first, at the tool point, in the base frame. Every function takes as many
//! coordinates as the robot has joints [rad or m] and refuses any other number of them.
//!
//! ```
//! use redundancy::kinematics::{forward, jacobian};
//! use redundancy::robot::{Convention, DhTable, Robot};
//!
//! let table = DhTable { convention: Convention::Standard, a: vec![0.5, 0.3], d: vec![0.0; 2], alpha: vec![0.0; 2], theta: vec![0.0; 2] };
//! let robot = Robot::from_dh("planar", table, "RR")?;
//! let q = [0.4, -0.2];
//! let (tool, columns) = jacobian(&robot, &q)?;
//! assert_eq!(tool, forward(&robot, &q)?);
//! // The first joint moves the tool about the base.
//! assert!((columns.v[0][0] + tool.origin[1]).abs() < 1e-15);
//! assert!(forward(&robot, &[0.4]).is_err());
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod coupled;
mod derivatives;
mod forward;
mod pullback;
mod rows_in_use;

use crate::error::{Result, check_length};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::with_capacity;
use crate::robot::Robot;

/// The kernels, by capacity: the caller has checked the lengths.
pub(crate) mod sized {
    pub use crate::kinematics::derivatives::{bending, derivative_column, first_derivative, jacobian_rate, second_derivative};
    pub use crate::kinematics::forward::{Jacobian, forward, forward_of, jacobian, jacobian_apart, jacobian_of, joint_frames, link_frames};
    pub use crate::kinematics::pullback::{pull_back, pull_back_of, pull_back_second};
}

/// The geometric Jacobian of a robot by columns; those beyond its joints are zero.
pub type Jacobian<'r> = sized::Jacobian<'r, MAX_JOINTS>;

/// The tool frame in the base frame.
pub fn forward(robot: &Robot, q: &[f64]) -> Result<Frame> {
    check_length("q", q, robot.n())?;
    Ok(with_capacity!(q.len(), tool(robot, q)))
}

#[inline(never)]
fn tool<const C: usize>(robot: &Robot, q: &[f64]) -> Frame {
    sized::forward::<C>(robot, q)
}

/// Writes the tool frame in the base frame as a homogeneous matrix by rows, shape (4, 4).
pub fn forward_into(robot: &Robot, q: &[f64], out: &mut [f64]) -> Result<()> {
    fn kernel<const C: usize>(robot: &Robot, q: &[f64], out: &mut [f64; 16]) {
        sized::forward_of::<C, f64>(robot, q).write_matrix(out);
    }
    check_length("q", q, robot.n())?;
    check_length("out", out, 16)?;
    if let Ok(out) = out.try_into() {
        match robot.coupling() {
            None => with_capacity!(q.len(), kernel(robot, q, out)),
            Some(coupling) => coupled::forward(robot, coupling, q).write_matrix(out),
        }
    }
    Ok(())
}

/// The tool frame and the Jacobian, in one sweep.
pub fn jacobian<'r>(robot: &'r Robot, q: &[f64]) -> Result<(Frame, Jacobian<'r>)> {
    check_length("q", q, robot.n())?;
    Ok(jacobian_at(robot, q))
}

/// The same for callers that have checked the length: one copy of it, for what is not in a hurry.
pub(crate) fn jacobian_at<'r>(robot: &'r Robot, q: &[f64]) -> (Frame, Jacobian<'r>) {
    sized::jacobian_apart(robot, q)
}

/// Writes the Jacobian by rows, shape (6, n).
pub fn jacobian_into(robot: &Robot, q: &[f64], out: &mut [f64]) -> Result<()> {
    fn kernel<const C: usize>(robot: &Robot, q: &[f64], out: &mut [f64]) {
        sized::jacobian_of::<C, f64>(robot, q).1.write(out);
    }
    check(robot, q, 1, out)?;
    match robot.coupling() {
        None => with_capacity!(q.len(), kernel(robot, q, out)),
        Some(coupling) => coupled::jacobian::<MAX_JOINTS>(robot, coupling, q).1.write(out),
    }
    Ok(())
}

/// Writes the derivative of the Jacobian, shape (6, n, n): `[r, i, k] = dJ[r, i] / dq_k`.
pub fn first_derivative(robot: &Robot, q: &[f64], out: &mut [f64]) -> Result<()> {
    fn kernel<const C: usize>(robot: &Robot, q: &[f64], out: &mut [f64]) {
        sized::first_derivative(&sized::jacobian::<C>(robot, q).1, out);
    }
    check(robot, q, 2, out)?;
    with_capacity!(q.len(), kernel(robot, q, out));
    Ok(())
}

/// Writes the second derivative of the Jacobian, shape (6, n, n, n): `[r, i, k, l] = d2J[r, i] / dq_k dq_l`.
pub fn second_derivative(robot: &Robot, q: &[f64], out: &mut [f64]) -> Result<()> {
    fn kernel<const C: usize>(robot: &Robot, q: &[f64], out: &mut [f64]) {
        sized::second_derivative(&sized::jacobian::<C>(robot, q).1, out);
    }
    check(robot, q, 3, out)?;
    with_capacity!(q.len(), kernel(robot, q, out));
    Ok(())
}

/// Writes the time derivative of the Jacobian at joint rates, shape (6, n).
pub fn jacobian_rate(robot: &Robot, q: &[f64], rates: &[f64], out: &mut [f64]) -> Result<()> {
    fn kernel<const C: usize>(robot: &Robot, q: &[f64], rates: &[f64], out: &mut [f64]) {
        sized::jacobian_rate(&sized::jacobian::<C>(robot, q).1, rates).write(out);
    }
    check(robot, q, 1, out)?;
    check_length("rates", rates, robot.n())?;
    with_capacity!(q.len(), kernel(robot, q, rates, out));
    Ok(())
}

/// The frame of every joint of the chain after its motion, those that follow others among them, and the tool frame last, in the base frame.
pub fn link_frames(robot: &Robot, q: &[f64]) -> Result<Vec<Frame>> {
    check_length("q", q, robot.n())?;
    Ok(sized::link_frames(robot, q))
}

/// Checks that there are n coordinates and room for 6 n^order numbers.
#[inline(always)]
fn check(robot: &Robot, q: &[f64], order: u32, out: &[f64]) -> Result<()> {
    let n = robot.n();
    check_length("q", q, n)?;
    check_length("out", out, 6 * n.pow(order))
}
