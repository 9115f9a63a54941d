//! Forward kinematics and the geometric Jacobian (Leger 2014, eq. 1.2).

use crate::linalg::frame::Frame;
use crate::linalg::real::Real;
use crate::linalg::vector::{Vec3, cross, sub};
use crate::linalg::{MAX_JOINTS, Row6, size};
use crate::robot::{Joint, Robot};

/// The geometric Jacobian by columns: `J_i = [w_i; v_i]`, angular part first, at the tool point, in the base frame.
/// `w_i` is the joint's axis for a revolute joint and zero for a prismatic one, whose axis is `v_i`.
#[derive(Debug, Clone, Copy)]
pub struct Jacobian<const C: usize, T = f64> {
    n: usize,
    /// Angular part of each column.
    pub w: [Vec3<T>; C],
    /// Linear part of each column.
    pub v: [Vec3<T>; C],
}

impl<const C: usize, T: Real> Jacobian<C, T> {
    /// Number of columns.
    #[inline(always)]
    pub fn n(&self) -> usize {
        size::<C>(self.n)
    }
}

impl<const C: usize> Jacobian<C> {
    /// Column `i`.
    #[inline(always)]
    pub fn column(&self, i: usize) -> Row6 {
        let (w, v) = (self.w[i], self.v[i]);
        [w[0], w[1], w[2], v[0], v[1], v[2]]
    }

    /// Writes the 6 x n matrix by rows.
    #[inline(always)]
    pub fn write(&self, out: &mut [f64]) {
        let n = self.n();
        for i in 0..n {
            for r in 0..3 {
                out[r * n + i] = self.w[i][r];
                out[(r + 3) * n + i] = self.v[i][r];
            }
        }
    }

    /// The twist J qd.
    pub fn times(&self, rates: &[f64]) -> Row6 {
        let mut twist = [0.0; 6];
        for (i, rate) in rates.iter().enumerate().take(self.n()) {
            let column = self.column(i);
            for r in 0..6 {
                twist[r] += column[r] * rate;
            }
        }
        twist
    }
}

#[inline(always)]
fn moved<T: Real>(frame: &Frame<T>, joint: Joint, q: T, sine: T, cosine: T) -> Frame<T> {
    match joint {
        Joint::Revolute => frame.turn_z(cosine, sine),
        Joint::Prismatic => {
            let z = frame.axes[2];
            Frame { axes: frame.axes, origin: std::array::from_fn(|r| frame.origin[r] + q * z[r]) }
        }
    }
}

/// The tool frame in the base frame.
#[inline(always)]
pub fn forward<const C: usize>(robot: &Robot, q: &[f64]) -> Frame {
    forward_of::<C, f64>(robot, q)
}

/// The same for one posture or for several side by side.
#[inline(always)]
pub fn forward_of<const C: usize, T: Real>(robot: &Robot, q: &[T]) -> Frame<T> {
    let n = size::<C>(robot.n());
    let (links, joints, q) = (&robot.links()[..n], &robot.joints()[..n], &q[..n]);
    let (sines, cosines) = T::sin_cos::<C>(q, n);
    let mut frame = moved(&Frame::splat(&links[0]), joints[0], q[0], sines[0], cosines[0]);
    for i in 1..n {
        frame = moved(&frame.compose(&links[i]), joints[i], q[i], sines[i], cosines[i]);
    }
    frame.compose(robot.end())
}

/// The frame of every joint after its motion, for collision geometry; entries beyond the joints are the identity.
pub fn joint_frames(robot: &Robot, q: &[f64]) -> [Frame; MAX_JOINTS] {
    let n = robot.n();
    let (sines, cosines) = <f64 as Real>::sin_cos::<MAX_JOINTS>(q, n);
    let mut frames = [Frame::IDENTITY; MAX_JOINTS];
    let mut frame = Frame::IDENTITY;
    for i in 0..n {
        frame = moved(&frame.compose(&robot.links()[i]), robot.joints()[i], q[i], sines[i], cosines[i]);
        frames[i] = frame;
    }
    frames
}

/// The same and the tool frame last, for drawings.
pub fn link_frames(robot: &Robot, q: &[f64]) -> Vec<Frame> {
    let frames = joint_frames(robot, q);
    let mut out = frames[..robot.n()].to_vec();
    out.push(frames[robot.n() - 1].compose(robot.end()));
    out
}

/// The tool frame and the Jacobian, in one sweep.
#[inline(always)]
pub fn jacobian<const C: usize>(robot: &Robot, q: &[f64]) -> (Frame, Jacobian<C>) {
    jacobian_of::<C, f64>(robot, q)
}

/// The same for one posture or for several side by side.
#[inline(always)]
pub fn jacobian_of<const C: usize, T: Real>(robot: &Robot, q: &[T]) -> (Frame<T>, Jacobian<C, T>) {
    let n = size::<C>(robot.n());
    let (links, joints) = (&robot.links()[..n], &robot.joints()[..n]);
    let q = &q[..n];
    let mut columns = Jacobian { n, w: [[T::ZERO; 3]; C], v: [[T::ZERO; 3]; C] };
    let mut origins = [[T::ZERO; 3]; C];
    let (sines, cosines) = T::sin_cos::<C>(q, n);
    let mut frame = Frame::splat(&links[0]);
    for i in 0..n {
        if i > 0 {
            frame = frame.compose(&links[i]);
        }
        columns.w[i] = frame.axes[2];
        origins[i] = frame.origin;
        frame = moved(&frame, joints[i], q[i], sines[i], cosines[i]);
    }
    let tool = frame.compose(robot.end());
    for i in 0..n {
        match joints[i] {
            Joint::Revolute => columns.v[i] = cross(columns.w[i], sub(tool.origin, origins[i])),
            Joint::Prismatic => {
                columns.v[i] = columns.w[i];
                columns.w[i] = [T::ZERO; 3];
            }
        }
    }
    (tool, columns)
}
