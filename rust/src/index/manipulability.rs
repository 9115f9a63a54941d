//! Manipulability, the volume of the ellipsoid (Leger 2014, eq. 1.8; Huo 2009, eq. 4.4).
//!
//! As `phi = ln w`: `d(phi) = <P', dJ>` and its second derivative is `tr(dJ_k Z Z' dJ_l' W) - tr(dJ_l P dJ_k P)`.

use super::evaluate::{Differential, JacobianIndex, Order, Status};
use super::rows::Rows;
use crate::kinematics::{Jacobian, JacobianDerivative};
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::{Rows6, product_transposed};

/// `w = sqrt(det(J_n J_n'))`, or its square: 0 at a singular posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manipulability {
    /// Rows and length.
    pub rows: Rows,
    /// Whether the value is w^2.
    pub squared: bool,
}

impl Manipulability {
    #[inline(always)]
    fn body<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        derivative: Option<&JacobianDerivative<C>>,
        m: usize,
        order: Order,
        with_length: bool,
    ) -> Differential<C> {
        let n = jacobian.n();
        let factors = Orthogonal::new(&self.rows.normalised(jacobian), n, m);
        if !factors.has_full_rank() {
            return Differential { status: Status::Singular, ..Differential::of((0.0, f64::NAN, f64::NAN)) };
        }
        let volume = factors.volume();
        // f(ln w) = w^p has every derivative p^k w^p.
        let (value, power) = if self.squared { (volume * volume, 2.0) } else { (volume, 1.0) };
        let mut out = Differential::of((value, power * value, power * power * value));
        if order == Order::Value {
            return out;
        }
        let p = factors.pseudo_inverse();
        for i in 0..n {
            out.y[i] = self.rows.spread(&std::array::from_fn(|r| p[r][i]));
        }
        if with_length {
            // ln w = (angular rows) ln L + a part free of L; d(w)/dq scales alike, so Y of ln w does not depend on L.
            let angular = self.rows.angular() as f64;
            out.length_slope = angular / self.rows.length;
            out.length_curvature = -angular / (self.rows.length * self.rows.length);
        }
        if let (Order::Hessian, Some(derivative)) = (order, derivative) {
            self.second(&factors, &p, derivative, m, &mut out.second);
        }
        out
    }

    #[inline(always)]
    fn second<const C: usize>(
        &self,
        factors: &Orthogonal<C>,
        p: &Rows6<C>,
        derivative: &JacobianDerivative<C>,
        m: usize,
        second: &mut [[f64; C]; C],
    ) {
        let n = derivative.n();
        let mut omega = [[[0.0; 6]; 6]; C];
        for k in 0..n {
            omega[k] = product_transposed(&self.rows.normalised_derivative(derivative, k), p, m);
        }
        for k in 0..n {
            for l in k..n {
                let mut sum = 0.0;
                for r in 0..m {
                    for c in 0..m {
                        sum += omega[k][r][c] * omega[l][c][r];
                    }
                }
                second[k][l] = -sum;
            }
        }
        if n == m {
            return;
        }
        let basis = factors.null_space();
        // tr(dJ_k Z Z' dJ_l' W) = <P dJ_k z, P dJ_l z> summed over the null vectors, with W = P'P.
        for z in 0..n - m {
            let mut moved = [[0.0; C]; C];
            for k in 0..n {
                let dj = self.rows.normalised_derivative(derivative, k);
                for r in 0..m {
                    let along: f64 = (0..n).map(|i| dj[r][i] * basis[z][i]).sum();
                    for i in 0..n {
                        moved[k][i] += p[r][i] * along;
                    }
                }
            }
            for k in 0..n {
                for l in k..n {
                    second[k][l] += (0..n).map(|i| moved[k][i] * moved[l][i]).sum::<f64>();
                }
            }
        }
    }
}

impl JacobianIndex for Manipulability {
    #[inline(always)]
    fn differential<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        derivative: Option<&JacobianDerivative<C>>,
        order: Order,
        with_length: bool,
    ) -> Differential<C> {
        match self.rows.count() {
            6 => self.body(jacobian, derivative, 6, order, with_length),
            m => self.body(jacobian, derivative, m, order, with_length),
        }
    }
}
