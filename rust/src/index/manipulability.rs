//! Manipulability, the volume of the ellipsoid (Leger 2014, eq. 1.8; Huo 2009, eq. 4.4).
//!
//! As `phi = ln w`: `d(phi) = <P', dJ>` and its second derivative is `tr(dJ_k Z Z' dJ_l' W) - tr(dJ_l P dJ_k P)`.

use super::evaluate::{FirstOrder, JacobianIndex, LengthTerms, Status};
use super::rows::Rows;
use crate::kinematics::sized::Jacobian;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::real::Real;
use crate::linalg::{Row6, Rows6, combined, transposed};

/// `w = sqrt(det(J_n J_n'))`, or its square: 0 at a singular posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manipulability {
    /// Rows and length.
    pub rows: Rows,
    /// Whether the value is w^2.
    pub squared: bool,
}

/// The factors of J_n and its pseudo-inverse by columns.
#[repr(C, align(64))]
pub struct Factored<const C: usize, T> {
    p: Rows6<C, T>,
    factors: Orthogonal<C, T>,
}

impl<const C: usize, T: Real> Default for Factored<C, T> {
    #[inline(always)]
    fn default() -> Self {
        Self { factors: Orthogonal::blank(), p: [[T::ZERO; C]; 6] }
    }
}

impl<T: Real> FirstOrder<T> for Manipulability {
    type Factors<const C: usize> = Factored<C, T>;

    #[inline(always)]
    fn rows(&self) -> &Rows {
        &self.rows
    }

    #[inline(always)]
    fn factor<const C: usize>(&self, jacobian: &Jacobian<C, T>, m: usize, out: &mut Factored<C, T>) {
        out.factors.factor(&self.rows.normalised(jacobian), jacobian.n(), m);
        out.factors.pseudo_inverse_into(&mut out.p);
    }

    /// f(ln w) = w^p has every derivative p^k w^p.
    #[inline(always)]
    fn outer<const C: usize>(&self, factored: &Factored<C, T>, _: usize) -> (T, T, T) {
        let volume = factored.factors.volume();
        let (value, power) = if self.squared { (volume * volume, T::splat(2.0)) } else { (volume, T::splat(1.0)) };
        (value, power * value, power * power * value)
    }

    #[inline(always)]
    fn status<const C: usize>(&self, factored: &Factored<C, T>, _: f64, _: usize, lane: usize) -> Status {
        if factored.factors.lane_has_full_rank(lane) { Status::Regular } else { Status::Singular }
    }

    fn limit(&self) -> f64 {
        0.0
    }

    #[inline(always)]
    fn slope<const C: usize>(&self, factored: &Factored<C, T>, n: usize, m: usize) -> [Row6<T>; C] {
        let columns = transposed(&factored.p, m);
        let mut out = [[T::ZERO; 6]; C];
        for i in 0..n {
            out[i] = self.rows.spread(&columns[i]);
        }
        out
    }
}

impl JacobianIndex for Manipulability {
    #[inline(always)]
    fn second<const C: usize>(&self, factored: &Factored<C, f64>, jacobian: &Jacobian<C>, m: usize, out: &mut [[f64; C]; C]) {
        let n = jacobian.n();
        let pt = transposed(&factored.p, m);
        let mut dj = [[[0.0; 6]; C]; C];
        let mut omega = [[[0.0; 6]; 6]; C];
        let mut turned = [[[0.0; 6]; 6]; C];
        self.rows.derivatives(jacobian, &pt, m, &mut dj, &mut omega);
        for k in 0..n {
            turned[k] = transposed(&omega[k], m);
        }
        for k in 0..n {
            for l in k..n {
                let mut sums = [0.0; 6];
                for r in 0..m {
                    for c in 0..6 {
                        sums[c] += omega[k][r][c] * turned[l][r][c];
                    }
                }
                out[k][l] = -sums.iter().sum::<f64>();
            }
        }
        if n == m {
            return;
        }
        let basis = factored.factors.null_space();
        // tr(dJ_k Z Z' dJ_l' W) = <P dJ_k z, P dJ_l z> summed over the null vectors, with W = P'P.
        for z in 0..n - m {
            let mut moved = [[0.0; C]; C];
            for k in 0..n {
                let along = combined(&dj[k], &basis[z], n);
                for r in 0..m {
                    for i in 0..n {
                        moved[k][i] += factored.p[r][i] * along[r];
                    }
                }
            }
            for k in 0..n {
                for l in k..n {
                    out[k][l] += (0..n).map(|i| moved[k][i] * moved[l][i]).sum::<f64>();
                }
            }
        }
    }

    /// ln w = (angular rows) ln L + a part free of L; d(w)/dq scales alike, so Y of ln w does not depend on L.
    #[inline(always)]
    fn length_terms<const C: usize>(&self, _: &Factored<C, f64>, _: usize, _: usize) -> LengthTerms<C> {
        let (angular, length) = (self.rows.angular() as f64, self.rows.length);
        LengthTerms { slope: angular / length, y: [[0.0; 6]; C], curvature: -angular / (length * length) }
    }
}
