//! The normalised Frobenius condition number of the homogeneous Jacobian (Leger 2014, eq. 2.14, algorithms 1 and 2).
//!
//! `kappa^2 = a b / m^2` with `a = |J_n|^2`, `b = |P|^2`, `P = J_n^+`. The derivatives are built on P, never on the Gram matrix, so that they
//! lose kappa digits, not kappa^2. With `W = P'P`, `Omega_k = dJ_k P` and Z a basis of the null space of J_n:
//! `d(a) = 2 <J_n, dJ>`, `d(b) = -2 <W P', dJ>`, and half the second derivative of b along dJ_k, dJ_l is
//! `<W Omega_k, Omega_l> + tr(W Omega_l Omega_k) + tr(W Omega_k Omega_l) - <W dJ_k Z, W dJ_l Z>`.

use super::evaluate::{FirstOrder, JacobianIndex, LengthTerms, Status};
use super::rows::Rows;
use crate::kinematics::sized::Jacobian;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::real::Real;
use crate::linalg::{Mat6, Row6, Rows6, combined, gram, transposed};

/// kappa_F, or its square: 1 at an isotropic posture, infinite at a singular one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionNumber {
    /// Rows and length.
    pub rows: Rows,
    /// Whether the value is kappa^2.
    pub squared: bool,
}

/// `J_n` by rows, its pseudo-inverse by columns, and the squares of their norms.
#[repr(C, align(64))] // no row of eight lies across two lines of the cache
pub struct Factored<const C: usize, T> {
    jn: Rows6<C, T>,
    p: Rows6<C, T>,
    factors: Orthogonal<C, T>,
    w: Mat6<T>,
    a: T,
    b: T,
}

/// Sum of the squares of some rows.
#[inline(always)]
fn norm2<const C: usize, T: Real>(rows: &Rows6<C, T>, range: std::ops::Range<usize>) -> T {
    let mut total = T::ZERO;
    for row in &rows[range] {
        let mut sum = T::ZERO;
        for x in row {
            sum += *x * *x;
        }
        total += sum;
    }
    total
}

/// Sum of the products of the entries of the first `count` rows.
#[inline(always)]
fn inner<const R: usize>(a: &[Row6; R], b: &[Row6; R], count: usize) -> f64 {
    let mut sums = [0.0; 6];
    for i in 0..count {
        for r in 0..6 {
            sums[r] += a[i][r] * b[i][r];
        }
    }
    (sums[0] + sums[2] + sums[4]) + (sums[1] + sums[3] + sums[5])
}

/// a b, m x m.
#[inline(always)]
fn multiply(a: &Mat6, b: &Mat6, m: usize) -> Mat6 {
    let mut product = [[0.0; 6]; 6];
    for r in 0..m {
        for j in 0..m {
            for c in 0..6 {
                product[r][c] += a[r][j] * b[j][c];
            }
        }
    }
    product
}

impl<const C: usize, T: Real> Factored<C, T> {
    /// Fills a blank one whose `jn` is set.
    #[inline(always)]
    fn fill(&mut self, n: usize, m: usize) {
        self.factors.factor(&self.jn, n, m);
        self.factors.pseudo_inverse_into(&mut self.p);
        self.a = norm2(&self.jn, 0..m);
        self.w = gram(&self.p, m);
        for r in 0..m {
            self.b += self.w[r][r];
        }
    }

    /// Entry (r, i) of `W P'`.
    #[inline(always)]
    fn w_pt(&self, r: usize, i: usize, m: usize) -> T {
        let mut sum = self.w[r][0] * self.p[0][i];
        for j in 1..m {
            sum += self.w[r][j] * self.p[j][i];
        }
        sum
    }
}

impl<const C: usize, T: Real> Default for Factored<C, T> {
    #[inline(always)]
    fn default() -> Self {
        let (none, w) = ([[T::ZERO; C]; 6], [[T::ZERO; 6]; 6]);
        Self { factors: Orthogonal::blank(), jn: none, p: none, w, a: T::ZERO, b: T::ZERO }
    }
}

/// `1 / m^2`.
#[inline(always)]
fn scale(m: usize) -> f64 {
    1.0 / (m * m) as f64
}

/// What the joints bring to the second derivatives, one entry a joint.
struct Directions<const C: usize> {
    /// `dJ_n/dq_k` by columns.
    dj: [[Row6; C]; C],
    /// `Omega_k`.
    omega: [Mat6; C],
    /// `(W Omega_k)'`.
    turned: [Mat6; C],
    /// `W Omega_k + (W Omega_k)'`.
    twice: [Mat6; C],
    /// `d(a) = 2 <J_n, dJ_k>`.
    da: [f64; C],
    /// `d(b) = -2 tr(W Omega_k)`.
    db: [f64; C],
}

impl<const C: usize> Directions<C> {
    #[inline(always)]
    fn zero() -> Self {
        let none = [[[0.0; 6]; 6]; C];
        Self { dj: [[[0.0; 6]; C]; C], omega: none, turned: none, twice: none, da: [0.0; C], db: [0.0; C] }
    }

    /// Fills a zeroed one in place: it is too large to be handed around.
    #[inline(always)]
    fn fill(&mut self, factored: &Factored<C, f64>, rows: &Rows, jacobian: &Jacobian<C>, m: usize) {
        let n = jacobian.n();
        let (pt, jt) = (transposed(&factored.p, m), transposed(&factored.jn, m));
        rows.derivatives(jacobian, &pt, m, &mut self.dj, &mut self.omega);
        for k in 0..n {
            let product = multiply(&factored.w, &self.omega[k], m);
            for r in 0..m {
                for c in 0..m {
                    self.turned[k][r][c] = product[c][r];
                    self.twice[k][r][c] = product[r][c] + product[c][r];
                }
                self.db[k] -= 2.0 * product[r][r];
            }
            self.da[k] = 2.0 * inner(&jt, &self.dj[k], C);
        }
    }
}

impl<const C: usize> Factored<C, f64> {
    /// The term of redundant robots, `<W dJ_k Z, W dJ_l Z>`.
    #[inline(always)]
    fn null_space_term(&self, dj: &[[Row6; C]; C], n: usize, m: usize) -> [[f64; C]; C] {
        let mut out = [[0.0; C]; C];
        if n == m {
            return out;
        }
        let basis = self.factors.null_space();
        for z in 0..n - m {
            let mut moved = [[0.0; 6]; C]; // W dJ_k z
            for k in 0..n {
                let along = combined(&dj[k], &basis[z], n);
                for r in 0..m {
                    for c in 0..m {
                        moved[k][c] += self.w[r][c] * along[r];
                    }
                }
            }
            for k in 0..n {
                for l in k..n {
                    for r in 0..m {
                        out[k][l] += moved[k][r] * moved[l][r];
                    }
                }
            }
        }
        out
    }
}

impl<T: Real> FirstOrder<T> for ConditionNumber {
    type Factors<const C: usize> = Factored<C, T>;

    #[inline(always)]
    fn rows(&self) -> &Rows {
        &self.rows
    }

    #[inline(always)]
    fn factor<const C: usize>(&self, jacobian: &Jacobian<C, T>, m: usize, out: &mut Factored<C, T>) {
        out.jn = self.rows.normalised(jacobian);
        out.fill(jacobian.n(), m);
    }

    #[inline(always)]
    fn outer<const C: usize>(&self, factored: &Factored<C, T>, m: usize) -> (T, T, T) {
        let square = T::splat(scale(m)) * factored.a * factored.b;
        if self.squared {
            (square, T::splat(1.0), T::ZERO)
        } else {
            let kappa = square.sqrt();
            (kappa, T::splat(0.5) / kappa, T::splat(-0.25) / (kappa * square))
        }
    }

    #[inline(always)]
    fn status<const C: usize>(&self, factored: &Factored<C, T>, value: f64, _: usize, lane: usize) -> Status {
        if factored.factors.lane_has_full_rank(lane) && value.is_finite() { Status::Regular } else { Status::Singular }
    }

    fn limit(&self) -> f64 {
        f64::INFINITY
    }

    #[inline(always)]
    fn slope<const C: usize>(&self, factored: &Factored<C, T>, n: usize, m: usize) -> [Row6<T>; C] {
        let twice = T::splat(2.0 * scale(m));
        let (for_jn, for_p) = (twice * factored.b, twice * factored.a);
        let mut out = [[T::ZERO; 6]; C];
        for i in 0..n {
            let mut y = [T::ZERO; 6];
            for r in 0..m {
                y[r] = for_jn * factored.jn[r][i] - for_p * factored.w_pt(r, i, m);
            }
            out[i] = self.rows.spread(&y);
        }
        out
    }
}

impl JacobianIndex for ConditionNumber {
    #[inline(always)]
    fn second<const C: usize>(&self, factored: &Factored<C, f64>, jacobian: &Jacobian<C>, m: usize, out: &mut [[f64; C]; C]) {
        let n = jacobian.n();
        let mut along = Directions::zero();
        along.fill(factored, &self.rows, jacobian, m);
        let null = factored.null_space_term(&along.dj, n, m);
        for l in 0..n {
            for k in 0..=l {
                let curvature = inner(&along.twice[k], &along.omega[l], m) + inner(&along.omega[k], &along.turned[l], m) - null[k][l];
                let norms = inner(&along.dj[k], &along.dj[l], C);
                let products = along.da[k] * along.db[l] + along.da[l] * along.db[k];
                out[k][l] = scale(m) * (2.0 * (factored.a * curvature + factored.b * norms) + products);
            }
        }
    }

    fn is_scale_free(&self) -> bool {
        true
    }

    /// With alpha and gamma the angular parts of a and b: `da/dL = 2 alpha / L`, `db/dL = -2 gamma / L` (at full row rank, the pseudo-inverse of
    /// `D J` is `J^+ D^-1`).
    #[inline(always)]
    fn length_terms<const C: usize>(&self, factored: &Factored<C, f64>, n: usize, m: usize) -> LengthTerms<C> {
        let Factored { jn, p, w, a, b, .. } = factored;
        let (angular, length) = (self.rows.angular(), self.rows.length);
        let alpha = norm2(jn, 0..angular);
        let gamma = norm2(p, 0..angular);
        let slope = 2.0 * scale(m) / length * (alpha * b - a * gamma);
        let curvature = scale(m) / (length * length) * (2.0 * alpha * b - 8.0 * alpha * gamma + 6.0 * a * gamma);
        let mut columns = [[0.0; 6]; C];
        for i in 0..n {
            let mut y = [0.0; 6];
            for r in 0..m {
                let mut w_angular_pt = 0.0; // (W Pi P')_ri with Pi the angular rows
                for j in 0..angular {
                    w_angular_pt += w[r][j] * p[j][i];
                }
                let own = if r < angular { *b } else { 0.0 };
                y[r] = 4.0 * scale(m) / length * ((own - gamma) * jn[r][i] - alpha * factored.w_pt(r, i, m) + a * w_angular_pt);
            }
            columns[i] = self.rows.spread(&y);
        }
        LengthTerms { slope, y: columns, curvature }
    }
}

/// [`super::length_of_least_condition`] where the Jacobian is known.
pub fn length_at<const C: usize>(rows: &Rows, jacobian: &Jacobian<C>) -> Option<f64> {
    let (n, m, angular) = (jacobian.n(), rows.count(), rows.angular());
    if angular == 0 || angular == m {
        return None;
    }
    let unit = rows.with_length(1.0);
    let mut factored = Factored { jn: unit.normalised(jacobian), ..Factored::default() };
    factored.fill(n, m);
    if !factored.factors.has_full_rank() {
        return None;
    }
    let a = norm2(&factored.jn, 0..angular);
    let b = norm2(&factored.jn, angular..m);
    let c = norm2(&factored.p, 0..angular);
    let d = norm2(&factored.p, angular..m);
    let length = (b * c / (a * d)).sqrt().sqrt();
    (length.is_finite() && length > 0.0).then_some(length)
}
