//! The Hessian of the Lagrangian in the free motion of a task: `Z' (H - sum lambda d2h) Z`.

use crate::kinematics::sized::{Jacobian, jacobian, jacobian_rate};
use crate::linalg::vector::{Vec3, dot};
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::robot::Robot;
use crate::task::{Constraint, Target, Task};

/// Step of central differences of the constraint's Jacobian [rad or m]: errors of the step and of rounding are of one size.
const STEP: f64 = 1e-5;

/// A target whose constraint has directions that turn with the free motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turning<'a> {
    pub robot: &'a Robot,
    pub task: &'a Task,
    pub target: &'a Target,
    pub length: f64,
    pub q: &'a [f64],
    /// Joints that stand at a limit, one bit a joint.
    pub held: u32,
}

impl Turning<'_> {
    /// `lambda . dA` along a direction, by central differences. In the room for the largest robots, so that no size has machine code of its own.
    #[cold]
    #[inline(never)]
    fn difference(&self, lambda: &Row6, direction: &[f64; MAX_JOINTS]) -> [f64; MAX_JOINTS] {
        let n = self.q.len();
        let moves = |i: &usize| self.held >> i & 1 == 0;
        let mut out = [0.0; MAX_JOINTS];
        for step in [STEP, -STEP] {
            let mut q = [0.0; MAX_JOINTS];
            q[..n].copy_from_slice(self.q);
            for i in (0..n).filter(moves) {
                q[i] += step * direction[i];
            }
            let (tool, columns) = jacobian::<MAX_JOINTS>(self.robot, &q[..n]);
            let rows = self.task.constraint(&tool, self.target, self.length).jacobian(&columns);
            for i in (0..n).filter(moves) {
                out[i] += (0..6).map(|c| lambda[c] * rows[c][i]).sum::<f64>() / (2.0 * step);
            }
        }
        out
    }
}

/// The curvature of the task's constraints h at a posture, weighted by the forces lambda that hold the posture on its target against a gradient.
pub(crate) struct Curvature<'a, const C: usize> {
    jacobian: &'a Jacobian<'a, C>,
    lambda: Row6,
    force: (Vec3, Vec3),
    turning: Option<Turning<'a>>,
}

impl<'a, const C: usize> Curvature<'a, C> {
    /// From the constraint, the pseudo-inverse of its Jacobian and the gradient: lambda is the gradient as far as the task holds it.
    #[inline(always)]
    pub fn new(
        jacobian: &'a Jacobian<'a, C>,
        constraint: &Constraint,
        turning: Option<Turning<'a>>,
        pseudo_inverse: &Rows6<C>,
        gradient: &[f64; C],
    ) -> Self {
        let mut lambda = [0.0; 6];
        for i in 0..jacobian.n() {
            for c in 0..constraint.dimension() {
                lambda[c] += pseudo_inverse[c][i] * gradient[i];
            }
        }
        Self { jacobian, lambda, force: constraint.expand(&lambda), turning }
    }

    /// `f(a)_i = lambda . (dA/dt along a)_i` with A the constraint's Jacobian: the curvature as a bilinear form, to be symmetrised, along one direction.
    #[inline(always)]
    pub fn along(&self, direction: &[f64; C]) -> [f64; C] {
        if let Some(turning) = &self.turning {
            let (mut whole, n) = ([0.0; MAX_JOINTS], turning.q.len());
            whole[..n].copy_from_slice(&direction[..n]);
            let out = turning.difference(&self.lambda, &whole);
            return std::array::from_fn(|i| out.get(i).copied().unwrap_or(0.0));
        }
        let rate = jacobian_rate(self.jacobian, direction);
        let (w, v) = self.force;
        std::array::from_fn(|i| if i < self.jacobian.n() { dot(w, rate.w[i]) + dot(v, rate.v[i]) } else { 0.0 })
    }

    /// The reduced Hessian for the first `r` directions of the free motion, and [`Curvature::along`] each of them.
    #[inline(always)]
    pub fn reduced_hessian(&self, hessian: &[[f64; C]; C], basis: &[[f64; C]; C], r: usize) -> ([[f64; C]; C], [[f64; C]; C]) {
        let n = self.jacobian.n();
        let inner = |a: &[f64; C], b: &[f64; C]| (0..n).map(|i| a[i] * b[i]).sum::<f64>();
        let (mut out, mut bent) = ([[0.0; C]; C], [[0.0; C]; C]);
        for a in 0..r {
            bent[a] = self.along(&basis[a]);
            let mut hz = [0.0; C];
            for k in 0..n {
                hz[k] = inner(&hessian[k], &basis[a]);
            }
            for b in 0..r {
                let bend = 0.5 * inner(&bent[a], &basis[b]);
                out[a][b] += inner(&hz, &basis[b]) - bend;
                out[b][a] -= bend;
            }
        }
        (out, bent)
    }
}
