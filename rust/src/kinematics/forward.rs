//! Forward kinematics and the geometric Jacobian (Leger 2014, eq. 1.2).

use super::coupled::{self, Coupled};
use crate::linalg::frame::Frame;
use crate::linalg::real::Real;
use crate::linalg::vector::{Vec3, cross, sub};
use crate::linalg::{MAX_JOINTS, Row6, size};
use crate::robot::{Joint, Robot};

/// The geometric Jacobian by columns: `J_i = [w_i; v_i]`, angular part first, at the tool point, in the base frame.
/// `w_i` is the joint's axis for a revolute joint and zero for a prismatic one, whose axis is `v_i`.
/// Where joints of the chain follow others, a column belongs to a coordinate, and is the sum over the joints that it moves.
#[derive(Debug, Clone, Copy)]
pub struct Jacobian<'r, const C: usize, T = f64> {
    n: usize,
    /// What derivatives need where joints follow others.
    pub(super) coupled: Option<Coupled<'r, C>>,
    /// Angular part of each column.
    pub w: [Vec3<T>; C],
    /// Linear part of each column.
    pub v: [Vec3<T>; C],
}

impl<const C: usize, T: Real> Jacobian<'_, C, T> {
    /// `n` columns of zeros.
    #[inline(always)]
    pub(super) fn zero(n: usize) -> Self {
        Self { n, coupled: None, w: [[T::ZERO; 3]; C], v: [[T::ZERO; 3]; C] }
    }

    /// Number of columns.
    #[inline(always)]
    pub fn n(&self) -> usize {
        size::<C>(self.n)
    }
}

impl<'r, const C: usize> Jacobian<'r, C> {
    /// What derivatives need where joints of the chain follow others.
    #[inline(always)]
    pub(crate) fn coupled(&self) -> Option<&Coupled<'r, C>> {
        self.coupled.as_ref()
    }

    /// Holds a coordinate: its column, and what is derived from it, is zero.
    #[inline(always)]
    pub(crate) fn hold(&mut self, i: usize) {
        (self.w[i], self.v[i]) = ([0.0; 3], [0.0; 3]);
        if let Some(coupled) = &mut self.coupled {
            coupled.hold(i);
        }
    }

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
    match robot.coupling() {
        None => forward_of::<C, f64>(robot, q),
        Some(coupling) => coupled::forward(robot, coupling, q),
    }
}

/// The same for one posture or for several side by side, of a robot without joints that follow others.
#[inline(always)]
pub fn forward_of<const C: usize, T: Real>(robot: &Robot, q: &[T]) -> Frame<T> {
    place::<C, T>(robot.links(), robot.joints(), robot.end(), q)
}

/// The frame at the end of a chain, from its links, its joints and where these stand.
#[inline(always)]
pub(super) fn place<const C: usize, T: Real>(links: &[Frame], joints: &[Joint], end: &Frame, q: &[T]) -> Frame<T> {
    let n = size::<C>(joints.len());
    let (links, joints, q) = (&links[..n], &joints[..n], &q[..n]);
    let (sines, cosines) = T::sin_cos::<C>(q, n);
    let mut frame = moved(&Frame::splat(&links[0]), joints[0], q[0], sines[0], cosines[0]);
    for i in 1..n {
        frame = moved(&frame.compose(&links[i]), joints[i], q[i], sines[i], cosines[i]);
    }
    frame.compose(end)
}

/// The frame of every joint of the chain after its motion, for collision geometry; entries beyond the joints are the identity.
pub fn joint_frames(robot: &Robot, q: &[f64]) -> [Frame; MAX_JOINTS] {
    match robot.coupling() {
        None => frames_of(robot.links(), robot.joints(), q),
        Some(coupling) => frames_of(robot.links(), coupling.joints(), &coupling.joints_at(q)),
    }
}

#[inline(never)]
fn frames_of(links: &[Frame], joints: &[Joint], q: &[f64]) -> [Frame; MAX_JOINTS] {
    let (sines, cosines) = <f64 as Real>::sin_cos::<MAX_JOINTS>(q, joints.len());
    let mut frames = [Frame::IDENTITY; MAX_JOINTS];
    let mut frame = Frame::IDENTITY;
    for (i, joint) in joints.iter().enumerate() {
        frame = moved(&frame.compose(&links[i]), *joint, q[i], sines[i], cosines[i]);
        frames[i] = frame;
    }
    frames
}

/// The same and the tool frame last, for drawings.
pub fn link_frames(robot: &Robot, q: &[f64]) -> Vec<Frame> {
    let (frames, m) = (joint_frames(robot, q), robot.links().len());
    let mut out = frames[..m].to_vec();
    out.push(frames[m - 1].compose(robot.end()));
    out
}

/// The tool frame and the Jacobian, in one sweep.
#[inline(always)]
pub fn jacobian<'r, const C: usize>(robot: &'r Robot, q: &[f64]) -> (Frame, Jacobian<'r, C>) {
    match robot.coupling() {
        None => jacobian_of::<C, f64>(robot, q),
        Some(coupling) => coupled::jacobian(robot, coupling, q),
    }
}

/// The same apart from the caller: one copy a capacity, for what is not in a hurry.
#[inline(never)]
pub fn jacobian_apart<'r, const C: usize>(robot: &'r Robot, q: &[f64]) -> (Frame, Jacobian<'r, C>) {
    jacobian(robot, q)
}

/// The same for one posture or for several side by side, of a robot without joints that follow others.
#[inline(always)]
pub fn jacobian_of<'r, const C: usize, T: Real>(robot: &'r Robot, q: &[T]) -> (Frame<T>, Jacobian<'r, C, T>) {
    sweep(robot.links(), robot.joints(), robot.end(), q)
}

/// The frame at the end of a chain and the Jacobian of its joints.
#[inline(always)]
pub(super) fn sweep<'r, const C: usize, T: Real>(
    links: &[Frame],
    joints: &[Joint],
    end: &Frame,
    q: &[T],
) -> (Frame<T>, Jacobian<'r, C, T>) {
    let n = size::<C>(joints.len());
    let (links, joints) = (&links[..n], &joints[..n]);
    let q = &q[..n];
    let mut columns = Jacobian::zero(n);
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
    let tool = frame.compose(end);
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
