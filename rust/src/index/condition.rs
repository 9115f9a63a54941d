//! The normalised Frobenius condition number of the homogeneous Jacobian (Leger 2014, eq. 2.14, algorithms 1 and 2).
//!
//! `kappa^2 = a b / m^2` with `a = |J_n|^2`, `b = |P|^2`, `P = J_n^+`. The derivatives are built on P, never on the Gram matrix, so that they
//! lose kappa digits, not kappa^2. With `W = P'P`, `Omega_k = dJ_k P` and Z a basis of the null space of J_n:
//! `d(a) = 2 <J_n, dJ>`, `d(b) = -2 <W P', dJ>`, and half the second derivative of b along dJ_k, dJ_l is
//! `<W Omega_k, Omega_l> + tr(W Omega_l Omega_k) + tr(W Omega_k Omega_l) - <W dJ_k Z, W dJ_l Z>`.

use super::evaluate::{Differential, JacobianIndex, Order, Status};
use super::rows::Rows;
use crate::kinematics::{Jacobian, JacobianDerivative};
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::{Mat6, Rows6, gram, product_transposed};

/// kappa_F, or its square: 1 at an isotropic posture, infinite at a singular one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionNumber {
    /// Rows and length.
    pub rows: Rows,
    /// Whether the value is kappa^2.
    pub squared: bool,
}

/// `J_n` by rows, its pseudo-inverse by columns, and what both norms need.
struct Factored<const C: usize> {
    n: usize,
    m: usize,
    jn: Rows6<C>,
    p: Rows6<C>,
    w: Mat6,
    factors: Orthogonal<C>,
}

/// Sum of the squares of some rows.
#[inline(always)]
fn norm2<const C: usize>(rows: &Rows6<C>, range: std::ops::Range<usize>) -> f64 {
    let mut total = 0.0;
    for row in &rows[range] {
        let mut sum = 0.0;
        for x in row {
            sum += x * x;
        }
        total += sum;
    }
    total
}

/// a b, m x m.
#[inline(always)]
fn multiply(a: &Mat6, b: &Mat6, m: usize) -> Mat6 {
    let mut product = [[0.0; 6]; 6];
    for r in 0..m {
        for j in 0..m {
            for c in 0..m {
                product[r][c] += a[r][j] * b[j][c];
            }
        }
    }
    product
}

/// What the second derivatives of the norms need: `<dJ_k, dJ_l>` and half the second derivative of b (k <= l), and `tr(W Omega_k)`.
struct Second<const C: usize> {
    norms: [[f64; C]; C],
    curvature: [[f64; C]; C],
    slopes: [f64; C],
}

impl<const C: usize> Factored<C> {
    /// `None` when the rows are dependent to working precision.
    #[inline(always)]
    fn new(jn: Rows6<C>, n: usize, m: usize) -> Option<Self> {
        let factors = Orthogonal::new(&jn, n, m);
        if !factors.has_full_rank() {
            return None;
        }
        let p = factors.pseudo_inverse();
        let w = gram(&p, m);
        Some(Self { n, m, jn, p, w, factors })
    }

    /// `W P'` by rows.
    #[inline(always)]
    fn w_pt(&self) -> Rows6<C> {
        let mut out = [[0.0; C]; 6];
        for r in 0..self.m {
            for j in 0..self.m {
                for i in 0..C {
                    out[r][i] += self.w[r][j] * self.p[j][i];
                }
            }
        }
        out
    }

    #[inline(always)]
    fn second(&self, rows: &Rows, derivative: &JacobianDerivative<C>) -> Second<C> {
        let (n, m) = (self.n, self.m);
        let mut out = Second { norms: [[0.0; C]; C], curvature: [[0.0; C]; C], slopes: [0.0; C] };
        let mut dj = [[[0.0; C]; 6]; C];
        let mut omega = [[[0.0; 6]; 6]; C];
        let mut twice = [[[0.0; 6]; 6]; C]; // W Omega + (W Omega)'
        let mut turned = [[[0.0; 6]; 6]; C]; // (W Omega)'
        for k in 0..n {
            dj[k] = rows.normalised_derivative(derivative, k);
            omega[k] = product_transposed(&dj[k], &self.p, m);
            let product = multiply(&self.w, &omega[k], m);
            for r in 0..m {
                for c in 0..m {
                    turned[k][r][c] = product[c][r];
                    twice[k][r][c] = product[r][c] + product[c][r];
                }
                out.slopes[k] += product[r][r];
            }
        }
        for k in 0..n {
            for l in k..n {
                let mut sums = [0.0; 6];
                for r in 0..m {
                    for c in 0..m {
                        sums[c] += twice[k][r][c] * omega[l][r][c] + turned[l][r][c] * omega[k][r][c];
                    }
                }
                out.curvature[k][l] = sums.iter().sum();
                let mut sums = [0.0; C];
                for r in 0..m {
                    for i in 0..C {
                        sums[i] += dj[k][r][i] * dj[l][r][i];
                    }
                }
                out.norms[k][l] = sums.iter().sum();
            }
        }
        if n > m {
            self.subtract_null_space(&self.factors.null_space(), &dj, &mut out.curvature);
        }
        out
    }

    /// The term of redundant robots, `- <W dJ_k Z, W dJ_l Z>`.
    #[inline(always)]
    fn subtract_null_space(&self, basis: &[[f64; C]; C], dj: &[Rows6<C>; C], curvature: &mut [[f64; C]; C]) {
        let (n, m) = (self.n, self.m);
        for z in 0..n - m {
            let mut moved = [[0.0; 6]; C]; // W dJ_k z
            for k in 0..n {
                for r in 0..m {
                    let mut along = 0.0;
                    for i in 0..C {
                        along += dj[k][r][i] * basis[z][i];
                    }
                    for c in 0..m {
                        moved[k][c] += self.w[r][c] * along;
                    }
                }
            }
            for k in 0..n {
                for l in k..n {
                    for r in 0..m {
                        curvature[k][l] -= moved[k][r] * moved[l][r];
                    }
                }
            }
        }
    }
}

impl ConditionNumber {
    #[inline(always)]
    fn outer(&self, square: f64) -> (f64, f64, f64) {
        if self.squared {
            (square, 1.0, 0.0)
        } else {
            let kappa = square.sqrt();
            (kappa, 0.5 / kappa, -0.25 / (kappa * square))
        }
    }

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
        let singular = Differential { status: Status::Singular, ..Differential::of((f64::INFINITY, f64::NAN, f64::NAN)) };
        let jn = self.rows.normalised(jacobian);
        let Some(factored) = Factored::new(jn, n, m) else { return singular };
        let a = norm2(&jn, 0..m);
        let b = (0..m).map(|r| factored.w[r][r]).sum::<f64>();
        let scale = 1.0 / (m * m) as f64;
        let mut out = Differential::of(self.outer(scale * a * b));
        if !out.outer.0.is_finite() {
            return singular;
        }
        if order == Order::Value {
            return out;
        }
        let w_pt = factored.w_pt();
        for i in 0..n {
            let mut y = [0.0; 6];
            for r in 0..m {
                y[r] = 2.0 * scale * (b * jn[r][i] - a * w_pt[r][i]);
            }
            out.y[i] = self.rows.spread(&y);
        }
        if with_length {
            self.length_terms(&factored, &w_pt, a, b, &mut out);
        }
        if let (Order::Hessian, Some(derivative)) = (order, derivative) {
            let second = factored.second(&self.rows, derivative);
            // d2(ab) = b d2a + a d2b + da_k db_l + da_l db_k with da_k = 2 <J_n, dJ_k>, db_k = -2 tr(W Omega_k).
            let mut da = [0.0; C];
            for k in 0..n {
                let dj = self.rows.normalised_derivative(derivative, k);
                for r in 0..m {
                    for i in 0..C {
                        da[k] += 2.0 * jn[r][i] * dj[r][i];
                    }
                }
            }
            for k in 0..n {
                for l in k..n {
                    let product = -2.0 * (da[k] * second.slopes[l] + da[l] * second.slopes[k]);
                    out.second[k][l] = scale * (2.0 * b * second.norms[k][l] + 2.0 * a * second.curvature[k][l] + product);
                }
            }
        }
        out
    }

    /// With alpha and gamma the angular parts of a and b: `da/dL = 2 alpha / L`, `db/dL = -2 gamma / L` (at full row rank, the pseudo-inverse of
    /// `D J` is `J^+ D^-1`).
    #[inline(always)]
    fn length_terms<const C: usize>(&self, factored: &Factored<C>, w_pt: &Rows6<C>, a: f64, b: f64, out: &mut Differential<C>) {
        let (n, m, jn, p, w) = (factored.n, factored.m, &factored.jn, &factored.p, &factored.w);
        let angular = self.rows.angular();
        let length = self.rows.length;
        let alpha = norm2(jn, 0..angular);
        let gamma = norm2(p, 0..angular);
        let scale = 1.0 / (m * m) as f64;
        out.length_slope = 2.0 * scale / length * (alpha * b - a * gamma);
        out.length_curvature = scale / (length * length) * (2.0 * alpha * b - 8.0 * alpha * gamma + 6.0 * a * gamma);
        for i in 0..n {
            let mut y = [0.0; 6];
            for r in 0..m {
                let mut w_angular_pt = 0.0; // (W Pi P')_ri with Pi the angular rows
                for j in 0..angular {
                    w_angular_pt += w[r][j] * p[j][i];
                }
                let own = if r < angular { b } else { 0.0 };
                y[r] = 4.0 * scale / length * ((own - gamma) * jn[r][i] - alpha * w_pt[r][i] + a * w_angular_pt);
            }
            out.length_y[i] = self.rows.spread(&y);
        }
    }
}

impl JacobianIndex for ConditionNumber {
    #[inline(always)]
    fn differential<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        derivative: Option<&JacobianDerivative<C>>,
        order: Order,
        with_length: bool,
    ) -> Differential<C> {
        // The constant lets the loops of the common case unroll.
        match self.rows.count() {
            6 => self.body(jacobian, derivative, 6, order, with_length),
            m => self.body(jacobian, derivative, m, order, with_length),
        }
    }
}

/// The length that minimises kappa_F at a posture, in closed form: `kappa^2 = (L^2 A + B)(C / L^2 + D) / m^2` gives `L^4 = B C / (A D)`, with A, B the
/// squared norms of the angular and linear rows of J and C, D those of the angular and linear columns of J^+. `None` at a singularity or when
/// the rows in use are all angular or all linear.
pub fn length_of_least_condition<const C: usize>(rows: &Rows, jacobian: &Jacobian<C>) -> Option<f64> {
    let (n, m, angular) = (jacobian.n(), rows.count(), rows.angular());
    if angular == 0 || angular == m {
        return None;
    }
    let unit = rows.with_length(1.0);
    let factored = Factored::new(unit.normalised(jacobian), n, m)?;
    let a = norm2(&factored.jn, 0..angular);
    let b = norm2(&factored.jn, angular..m);
    let c = norm2(&factored.p, 0..angular);
    let d = norm2(&factored.p, angular..m);
    let length = (b * c / (a * d)).sqrt().sqrt();
    (length.is_finite() && length > 0.0).then_some(length)
}
