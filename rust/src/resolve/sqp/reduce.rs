//! The Hessian of the Lagrangian in the free motion of a task: `Z' (H - sum lambda d2h) Z`.

use crate::kinematics::sized::{Jacobian, jacobian_rate};
use crate::linalg::Rows6;
use crate::linalg::vector::{Vec3, dot};
use crate::task::Directions;

/// The curvature of the task's constraints h at a posture, weighted by the forces lambda that hold the posture on its target against a gradient.
pub(crate) struct Curvature<'a, const C: usize> {
    jacobian: &'a Jacobian<C>,
    force: (Vec3, Vec3),
}

impl<'a, const C: usize> Curvature<'a, C> {
    /// From the task's directions, the pseudo-inverse of its Jacobian and the gradient: lambda is the gradient as far as the task holds it.
    #[inline(always)]
    pub fn new(jacobian: &'a Jacobian<C>, directions: &Directions, pseudo_inverse: &Rows6<C>, gradient: &[f64; C]) -> Self {
        let mut lambda = [0.0; 6];
        for i in 0..jacobian.n() {
            for c in 0..directions.dimension() {
                lambda[c] += pseudo_inverse[c][i] * gradient[i];
            }
        }
        Self { jacobian, force: directions.expand(&lambda) }
    }

    /// `f(a)_i = lambda . (dJ/dt along a)_i`: the curvature as a bilinear form, to be symmetrised, along one direction.
    #[inline(always)]
    pub fn along(&self, direction: &[f64; C]) -> [f64; C] {
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
