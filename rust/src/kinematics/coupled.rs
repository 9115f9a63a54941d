//! Chains of which joints follow others: kernels run on all joints of the chain, and what they answer is gathered by coordinates.
//!
//! With joints `theta = M q + o`, columns of the Jacobian, gradients and Hessians in theta become those in q by `M`. One capacity for all, and slices: no
//! size of robot has machine code of its own for this.

use super::derivatives::{bending, derivative_column, jacobian_rate, second};
use super::forward::{Jacobian, sweep};
use super::pullback::{pull_back_of, pull_back_second};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, scale};
use crate::linalg::{MAX_JOINTS, Row6};
use crate::robot::{Coupling, Follows, Robot};

type Chain = Jacobian<'static, MAX_JOINTS>;

/// What the derivatives of a Jacobian by coordinates need: the posture, at which the joints of the chain are looked at again.
#[derive(Debug, Clone, Copy)]
pub struct Coupled<'r, const C: usize> {
    robot: &'r Robot,
    coupling: &'r Coupling,
    q: [f64; C],
    /// Coordinates that are held, one bit each.
    held: u32,
}

/// The tool frame and the Jacobian of the chain.
#[cold]
#[inline(never)]
fn chain(robot: &Robot, coupling: &Coupling, q: &[f64], held: u32) -> (Frame, Chain) {
    let m = robot.links().len();
    let (tool, mut joints) = sweep::<MAX_JOINTS, f64>(robot.links(), coupling.joints(), robot.end(), &coupling.joints_at(q)[..m]);
    for (i, follows) in coupling.follows().iter().enumerate() {
        if held >> follows.coordinate & 1 == 1 {
            (joints.w[i], joints.v[i]) = ([0.0; 3], [0.0; 3]);
        }
    }
    (tool, joints)
}

/// The tool frame.
#[cold]
#[inline(never)]
pub fn forward(robot: &Robot, coupling: &Coupling, q: &[f64]) -> Frame {
    chain(robot, coupling, q, 0).0
}

/// The tool frame and the Jacobian by coordinates.
#[cold]
#[inline(never)]
pub fn jacobian<'r, const C: usize>(robot: &'r Robot, coupling: &'r Coupling, q: &[f64]) -> (Frame, Jacobian<'r, C>) {
    let (tool, joints) = chain(robot, coupling, q, 0);
    let mut columns = Jacobian::zero(q.len());
    gather(coupling, &joints, &mut columns.w, &mut columns.v);
    let mut at = [0.0; C];
    at[..q.len()].copy_from_slice(q);
    columns.coupled = Some(Coupled { robot, coupling, q: at, held: 0 });
    (tool, columns)
}

/// Columns by coordinates, into zeroed ones.
#[inline(never)]
fn gather(coupling: &Coupling, joints: &Chain, w: &mut [Vec3], v: &mut [Vec3]) {
    for (i, Follows { coordinate, factor, .. }) in coupling.follows().iter().copied().enumerate() {
        w[coordinate] = add(w[coordinate], scale(factor, joints.w[i]));
        v[coordinate] = add(v[coordinate], scale(factor, joints.v[i]));
    }
}

/// Numbers of coordinates as numbers of joints: `M x`.
fn spread(coupling: &Coupling, x: &[f64]) -> [f64; MAX_JOINTS] {
    let mut joints = [0.0; MAX_JOINTS];
    for (joint, follows) in joints.iter_mut().zip(coupling.follows()) {
        *joint = follows.factor * x[follows.coordinate];
    }
    joints
}

/// `Y M'`: what belongs to each joint of the chain.
fn by_joints(coupling: &Coupling, y: &[Row6]) -> [Row6; MAX_JOINTS] {
    let mut out = [[0.0; 6]; MAX_JOINTS];
    for (row, follows) in out.iter_mut().zip(coupling.follows()) {
        *row = y[follows.coordinate].map(|x| follows.factor * x);
    }
    out
}

/// Adds `M' h M` to a matrix by rows of a given length.
fn gather_square(coupling: &Coupling, h: &[[f64; MAX_JOINTS]; MAX_JOINTS], out: &mut [f64], length: usize) {
    for (row, a) in h.iter().zip(coupling.follows()) {
        for (x, b) in row.iter().zip(coupling.follows()) {
            out[a.coordinate * length + b.coordinate] += a.factor * b.factor * x;
        }
    }
}

#[inline(never)]
fn add_pulled(coupling: &Coupling, joints: &Chain, y: &[Row6], gradient: &mut [f64]) {
    let pulled = pull_back_of(joints, &by_joints(coupling, y));
    for (x, follows) in pulled.iter().zip(coupling.follows()) {
        gradient[follows.coordinate] += follows.factor * x;
    }
}

#[inline(never)]
fn add_pulled_second(coupling: &Coupling, joints: &Chain, y: &[Row6], hessian: &mut [f64], length: usize) {
    let mut pulled = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    pull_back_second(joints, &by_joints(coupling, y), &mut pulled);
    for k in 0..MAX_JOINTS {
        for l in 0..k {
            pulled[k][l] = pulled[l][k];
        }
    }
    gather_square(coupling, &pulled, hessian, length);
}

#[inline(never)]
fn add_derivative(coupling: &Coupling, joints: &Chain, k: usize, out: &mut [Row6]) {
    let follows = coupling.follows();
    for (moved, by) in follows.iter().enumerate().filter(|(_, by)| by.coordinate == k) {
        for (i, of) in follows.iter().enumerate() {
            let column = derivative_column(joints, moved, i);
            for r in 0..6 {
                out[of.coordinate][r] += by.factor * of.factor * column[r];
            }
        }
    }
}

#[inline(never)]
fn write_second(coupling: &Coupling, joints: &Chain, n: usize, out: &mut [f64]) {
    out.fill(0.0);
    for (i, a) in coupling.follows().iter().enumerate() {
        for (k, b) in coupling.follows().iter().enumerate() {
            for (l, c) in coupling.follows().iter().enumerate() {
                let (column, factor) = (second(joints, i, k, l), a.factor * b.factor * c.factor);
                for r in 0..6 {
                    out[((r * n + a.coordinate) * n + b.coordinate) * n + c.coordinate] += factor * column[r];
                }
            }
        }
    }
}

impl<const C: usize> Coupled<'_, C> {
    /// Holds a coordinate: the joints that follow it count as ones that do not move.
    pub fn hold(&mut self, coordinate: usize) {
        self.held |= 1 << coordinate;
    }

    /// The Jacobian of the chain, whose joints follow no others.
    fn joints(&self) -> Chain {
        chain(self.robot, self.coupling, &self.q[..self.robot.n()], self.held).1
    }

    /// As [`super::pullback::pull_back`].
    #[cold]
    #[inline(never)]
    pub fn pull_back(&self, y: &[Row6; C]) -> [f64; C] {
        let mut gradient = [0.0; C];
        add_pulled(self.coupling, &self.joints(), y, &mut gradient);
        gradient
    }

    /// As [`super::pullback::pull_back_second`].
    #[cold]
    #[inline(never)]
    pub fn pull_back_second(&self, y: &[Row6; C], hessian: &mut [[f64; C]; C]) {
        add_pulled_second(self.coupling, &self.joints(), y, hessian.as_flattened_mut(), C);
    }

    /// The derivative of every column with respect to a coordinate.
    #[cold]
    #[inline(never)]
    pub fn derivative(&self, k: usize) -> [Row6; C] {
        let mut out = [[0.0; 6]; C];
        add_derivative(self.coupling, &self.joints(), k, &mut out);
        out
    }

    /// As [`super::derivatives::second_derivative`].
    pub fn second_derivative(&self, out: &mut [f64]) {
        write_second(self.coupling, &self.joints(), self.robot.n(), out);
    }

    /// As [`super::derivatives::jacobian_rate`].
    #[cold]
    #[inline(never)]
    pub fn jacobian_rate(&self, rates: &[f64]) -> Jacobian<'static, C> {
        let rate = jacobian_rate(&self.joints(), &spread(self.coupling, rates));
        let mut out = Jacobian::zero(self.robot.n());
        gather(self.coupling, &rate, &mut out.w, &mut out.v);
        out
    }

    /// As [`super::derivatives::bending`].
    #[cold]
    #[inline(never)]
    pub fn bending(&self, moment: Vec3, force: Vec3) -> [[f64; C]; C] {
        let mut out = [[0.0; C]; C];
        gather_square(self.coupling, &bending(&self.joints(), moment, force), out.as_flattened_mut(), C);
        out
    }
}
