//! Chains of which joints follow others: kernels run on all joints of the chain, and what they answer is gathered by coordinates.
//!
//! With joints `theta = M q + o`, columns of the Jacobian, gradients and Hessians in theta become those in q by `M`. One capacity for all, and slices: no
//! size of robot has machine code of its own for this.

use super::derivatives::{bending_free, derivative_column, jacobian_rate_free, second};
use super::forward::{Jacobian, place, sweep};
use super::pullback::{pull_back_of, pull_back_second_free};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, scale};
use crate::linalg::{MAX_JOINTS, Row6};
use crate::robot::{Coupling, Follows, Robot};

type Chain = Jacobian<'static, MAX_JOINTS>;
type Square<const C: usize> = [[f64; C]; C];

/// What the derivatives of a Jacobian by coordinates need: the posture, at which the joints of the chain are looked at again.
#[derive(Debug, Clone, Copy)]
pub struct Coupled<'r, const C: usize> {
    robot: &'r Robot,
    coupling: &'r Coupling,
    q: [f64; C],
    /// Coordinates that are held, one bit each.
    held: u32,
}

/// The tool frame.
#[cold]
#[inline(never)]
pub fn forward(robot: &Robot, coupling: &Coupling, q: &[f64]) -> Frame {
    let m = robot.links().len();
    place::<MAX_JOINTS, f64>(robot.links(), coupling.joints(), robot.end(), &coupling.joints_at(q)[..m])
}

/// The tool frame and the Jacobian of the chain.
#[cold]
#[inline(never)]
fn chain(robot: &Robot, coupling: &Coupling, q: &[f64]) -> (Frame, Chain) {
    let m = robot.links().len();
    sweep::<MAX_JOINTS, f64>(robot.links(), coupling.joints(), robot.end(), &coupling.joints_at(q)[..m])
}

/// The tool frame and the Jacobian by coordinates.
#[inline(never)]
pub fn jacobian<'r, const C: usize>(robot: &'r Robot, coupling: &'r Coupling, q: &[f64]) -> (Frame, Jacobian<'r, C>) {
    let (tool, joints) = chain(robot, coupling, q);
    let mut columns = Jacobian::zero(q.len());
    gather(coupling, &joints, &mut columns.w, &mut columns.v);
    let mut at = [0.0; C];
    at[..q.len()].copy_from_slice(q);
    columns.coupled = Some(Coupled { robot, coupling, q: at, held: 0 });
    (tool, columns)
}

/// Columns by coordinates, into zeroed ones.
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

impl<const C: usize> Coupled<'_, C> {
    /// Holds a coordinate: the joints that follow it count as ones that do not move.
    pub fn hold(&mut self, coordinate: usize) {
        self.held |= 1 << coordinate;
    }

    /// The Jacobian of the chain.
    fn joints(&self) -> Chain {
        let (_, mut joints) = chain(self.robot, self.coupling, &self.q[..self.robot.n()]);
        for (i, follows) in self.coupling.follows().iter().enumerate() {
            if self.held >> follows.coordinate & 1 == 1 {
                (joints.w[i], joints.v[i]) = ([0.0; 3], [0.0; 3]);
            }
        }
        joints
    }

    /// `Y M'`: what belongs to each joint of the chain.
    fn by_joints(&self, y: &[Row6; C]) -> [Row6; MAX_JOINTS] {
        let mut out = [[0.0; 6]; MAX_JOINTS];
        for (row, follows) in out.iter_mut().zip(self.coupling.follows()) {
            *row = y[follows.coordinate].map(|x| follows.factor * x);
        }
        out
    }

    /// Adds `M' h M`.
    fn gather_square(&self, h: &Square<MAX_JOINTS>, out: &mut Square<C>) {
        let follows = self.coupling.follows();
        for (row, a) in h.iter().zip(follows) {
            for (x, b) in row.iter().zip(follows) {
                out[a.coordinate][b.coordinate] += a.factor * b.factor * x;
            }
        }
    }

    /// As [`super::pullback::pull_back`].
    #[cold]
    #[inline(never)]
    pub fn pull_back(&self, y: &[Row6; C]) -> [f64; C] {
        let by_joints = pull_back_of(&self.joints(), &self.by_joints(y));
        let mut gradient = [0.0; C];
        for (x, follows) in by_joints.iter().zip(self.coupling.follows()) {
            gradient[follows.coordinate] += follows.factor * x;
        }
        gradient
    }

    /// As [`super::pullback::pull_back_second`].
    #[cold]
    #[inline(never)]
    pub fn pull_back_second(&self, y: &[Row6; C], hessian: &mut Square<C>) {
        let mut by_joints = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        pull_back_second_free(&self.joints(), &self.by_joints(y), &mut by_joints);
        for k in 0..MAX_JOINTS {
            for l in 0..k {
                by_joints[k][l] = by_joints[l][k];
            }
        }
        self.gather_square(&by_joints, hessian);
    }

    /// The derivative of every column with respect to a coordinate.
    #[cold]
    #[inline(never)]
    pub fn derivative(&self, k: usize) -> [Row6; C] {
        let (joints, follows) = (self.joints(), self.coupling.follows());
        let mut out = [[0.0; 6]; C];
        for (moved, by) in follows.iter().enumerate().filter(|(_, by)| by.coordinate == k) {
            for (i, of) in follows.iter().enumerate() {
                let column = derivative_column(&joints, moved, i);
                for r in 0..6 {
                    out[of.coordinate][r] += by.factor * of.factor * column[r];
                }
            }
        }
        out
    }

    /// As [`super::derivatives::second_derivative`].
    #[cold]
    #[inline(never)]
    pub fn second_derivative(&self, out: &mut [f64]) {
        let (n, joints) = (self.robot.n(), self.joints());
        out.fill(0.0);
        for (i, a) in self.coupling.follows().iter().enumerate() {
            for (k, b) in self.coupling.follows().iter().enumerate() {
                for (l, c) in self.coupling.follows().iter().enumerate() {
                    let (column, factor) = (second(&joints, i, k, l), a.factor * b.factor * c.factor);
                    for r in 0..6 {
                        out[((r * n + a.coordinate) * n + b.coordinate) * n + c.coordinate] += factor * column[r];
                    }
                }
            }
        }
    }

    /// As [`super::derivatives::jacobian_rate`].
    #[cold]
    #[inline(never)]
    pub fn jacobian_rate(&self, rates: &[f64]) -> Jacobian<'static, C> {
        let rate = jacobian_rate_free(&self.joints(), &spread(self.coupling, rates));
        let mut out = Jacobian::zero(self.robot.n());
        gather(self.coupling, &rate, &mut out.w, &mut out.v);
        out
    }

    /// As [`super::derivatives::bending`].
    #[cold]
    #[inline(never)]
    pub fn bending(&self, moment: Vec3, force: Vec3) -> Square<C> {
        let mut out = [[0.0; C]; C];
        self.gather_square(&bending_free(&self.joints(), moment, force), &mut out);
        out
    }
}
