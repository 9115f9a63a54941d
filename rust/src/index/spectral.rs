//! Indices that are products of powers of the singular values: the spectral condition number, the smallest singular value, and Huo's
//! parameter of singularity (Huo 2009, eq. 4.4 to 4.6).
//!
//! With `phi = sum c_i ln sigma_i` and `B_k = U' dJ_k V`, `d sigma_i = B_ii`, and the second derivative of sigma_i follows from the eigenvalues of
//! `[0 J; J' 0]`. Pairs of equal exponents need no gap between their singular values; pairs of different exponents do.

use super::evaluate::{FirstOrder, JacobianIndex, LengthTerms, Status};
use super::rows::Rows;
use crate::kinematics::sized::Jacobian;
use crate::linalg::svd::Svd;
use crate::linalg::{Row6, Rows6};

/// Two singular values closer than this, relative to the larger, are taken as one.
const GAP: f64 = 1e-9;

/// A singular value below this multiple of the largest is taken as zero.
const RANK_TOLERANCE: f64 = 8.0 * f64::EPSILON;

/// Which product of powers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpectralKind {
    /// `kappa_2 = sigma_1 / sigma_m`, infinite at a singularity.
    ConditionNumber,
    /// `sigma_m`, zero at a singularity.
    SmallestSingularValue,
    /// `w_ps = sqrt(kappa_2 / w)`, infinite at a singularity.
    SingularityParameter,
}

/// An index made of singular values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectral {
    /// Which one.
    pub kind: SpectralKind,
    /// Rows and length.
    pub rows: Rows,
    /// Whether the value is squared.
    pub squared: bool,
}

impl Spectral {
    /// The exponents c_i of m singular values in decreasing order.
    #[inline(always)]
    fn exponents(&self, m: usize) -> Row6 {
        let mut c = [0.0; 6];
        match self.kind {
            SpectralKind::ConditionNumber => {
                c[0] += 1.0;
                c[m - 1] -= 1.0;
            }
            SpectralKind::SmallestSingularValue => c[m - 1] = 1.0,
            SpectralKind::SingularityParameter => {
                c[0] += 0.5;
                c[m - 1] -= 0.5;
                for entry in c.iter_mut().take(m) {
                    *entry -= 0.5;
                }
            }
        }
        if self.squared { c.map(|x| 2.0 * x) } else { c }
    }
}

/// `x^c`; the exponents met here are halves, for which a square root and a division are quicker than a power.
#[inline(always)]
fn power(x: f64, c: f64) -> f64 {
    let root = if c.abs() == 0.5 { x.sqrt() } else { x };
    match (c.abs(), c > 0.0) {
        (0.0, _) => 1.0,
        (0.5 | 1.0, true) => root,
        (0.5 | 1.0, false) => 1.0 / root,
        _ => x.powf(c),
    }
}

/// `B = U' dJ V` and `dJ` along the null space: rows i < m, columns j < n.
#[inline(always)]
fn projected<const C: usize>(svd: &Svd<C>, null: &[[f64; C]; C], dj: &[Row6; C], n: usize, m: usize) -> [[f64; C]; 6] {
    let mut b = [[0.0; C]; 6];
    for i in 0..m {
        let mut row = [0.0; C]; // u_i' dJ
        for j in 0..n {
            row[j] = (0..m).map(|r| svd.u[i][r] * dj[j][r]).sum();
        }
        for j in 0..m {
            b[i][j] = (0..n).map(|s| row[s] * svd.v[j][s]).sum();
        }
        for j in m..n {
            b[i][j] = (0..n).map(|s| row[s] * null[j - m][s]).sum();
        }
    }
    b
}

/// Second derivative of phi along two directions.
#[inline(always)]
fn second<const C: usize>(c: &Row6, sigma: &Row6, bk: &[[f64; C]; 6], bl: &[[f64; C]; 6], n: usize, m: usize) -> f64 {
    let mut sum = 0.0;
    for i in 0..m {
        let s = sigma[i];
        sum -= c[i] * bk[i][i] * bl[i][i] / (s * s);
        for j in m..n {
            sum += c[i] * bk[i][j] * bl[i][j] / (s * s);
        }
        for j in i + 1..m {
            let t = sigma[j];
            let symmetric = (bk[i][j] + bk[j][i]) * (bl[i][j] + bl[j][i]);
            let skew = (bk[i][j] - bk[j][i]) * (bl[i][j] - bl[j][i]);
            let split = if c[i] == c[j] { -c[i] / (s * t) } else { (c[i] / s - c[j] / t) / (s - t) };
            sum += 0.5 * (symmetric * split + skew * (c[i] / s + c[j] / t) / (s + t));
        }
    }
    sum
}

/// The singular value decomposition, the exponents, and J_n by rows.
pub struct Decomposed<const C: usize> {
    svd: Svd<C>,
    c: Row6,
    jn: Rows6<C>,
    repeated: bool,
}

impl<const C: usize> Default for Decomposed<C> {
    #[inline(always)]
    fn default() -> Self {
        Self { svd: Svd::default(), c: [0.0; 6], jn: [[0.0; C]; 6], repeated: false }
    }
}

impl FirstOrder<f64> for Spectral {
    type Factors<const C: usize> = Decomposed<C>;

    #[inline(always)]
    fn rows(&self) -> &Rows {
        &self.rows
    }

    #[inline(always)]
    fn factor<const C: usize>(&self, jacobian: &Jacobian<C>, m: usize, out: &mut Decomposed<C>) {
        out.jn = self.rows.normalised(jacobian);
        out.svd = Svd::new(&out.jn, jacobian.n(), m);
        out.c = self.exponents(m);
        let (c, sigma) = (out.c, out.svd.sigma);
        out.repeated = (1..m).any(|i| c[i] != c[i - 1] && sigma[i - 1] - sigma[i] <= GAP * sigma[i - 1]);
    }

    #[inline(always)]
    fn outer<const C: usize>(&self, factors: &Decomposed<C>, m: usize) -> (f64, f64, f64) {
        let Decomposed { c, svd, .. } = factors;
        let value: f64 = (0..m).map(|i| power(svd.sigma[i], c[i])).product();
        (value, value, value)
    }

    #[inline(always)]
    fn status<const C: usize>(&self, factors: &Decomposed<C>, _: f64, m: usize, _: usize) -> Status {
        let sigma = &factors.svd.sigma;
        if sigma[m - 1].is_nan() || sigma[m - 1] <= RANK_TOLERANCE * sigma[0] {
            Status::Singular
        } else if factors.repeated {
            Status::Repeated
        } else {
            Status::Regular
        }
    }

    fn limit(&self) -> f64 {
        if self.kind == SpectralKind::SmallestSingularValue { 0.0 } else { f64::INFINITY }
    }

    #[inline(always)]
    fn slope<const C: usize>(&self, factors: &Decomposed<C>, n: usize, m: usize) -> [Row6; C] {
        let Decomposed { svd, c, .. } = factors;
        let mut weighted = [[0.0; 6]; 6]; // c_s / sigma_s u_s
        for s in 0..m {
            let weight = c[s] / svd.sigma[s];
            weighted[s] = svd.u[s].map(|x| weight * x);
        }
        let mut out = [[0.0; 6]; C];
        for i in 0..n {
            let mut y = [0.0; 6];
            for s in 0..m {
                for r in 0..6 {
                    y[r] += weighted[s][r] * svd.v[s][i];
                }
            }
            out[i] = self.rows.spread(&y);
        }
        out
    }
}

impl JacobianIndex for Spectral {
    #[inline(always)]
    fn second<const C: usize>(&self, factors: &Decomposed<C>, jacobian: &Jacobian<C>, m: usize, out: &mut [[f64; C]; C]) {
        let Decomposed { svd, c, repeated, .. } = factors;
        let n = jacobian.n();
        let null = svd.null_space();
        let mut b = [[[0.0; C]; 6]; C];
        for k in 0..n {
            let mut dj = [[0.0; 6]; C];
            self.rows.normalised_derivative(jacobian, k, &mut dj);
            b[k] = projected(svd, &null, &dj, n, m);
        }
        for k in 0..n {
            for l in k..n {
                out[k][l] = if *repeated { f64::NAN } else { second(c, &svd.sigma, &b[k], &b[l], n, m) };
            }
        }
    }

    fn is_scale_free(&self) -> bool {
        self.kind == SpectralKind::ConditionNumber
    }

    /// `dJ_n/dL = Pi J_n / L` is one more direction, whose own second derivative is zero.
    #[inline(always)]
    fn length_terms<const C: usize>(&self, factors: &Decomposed<C>, n: usize, m: usize) -> LengthTerms<C> {
        let Decomposed { svd, c, jn, repeated } = factors;
        let (angular, length) = (self.rows.angular(), self.rows.length);
        let mut along = [[0.0; 6]; C];
        for i in 0..n {
            for r in 0..angular {
                along[i][r] = jn[r][i] / length;
            }
        }
        let sigma = &svd.sigma;
        let null = svd.null_space();
        let b = projected(svd, &null, &along, n, m);
        let slope = (0..m).map(|i| c[i] / sigma[i] * b[i][i]).sum();
        if *repeated {
            return LengthTerms { slope, y: [[f64::NAN; 6]; C], curvature: f64::NAN };
        }
        let curvature = second(c, sigma, &b, &b, n, m);
        let mut columns = [[0.0; 6]; C];
        // d(phi_L) along any dJ: the bilinear form with one argument fixed, plus phi_J applied to the change of Pi J_n / L itself.
        for i in 0..n {
            let mut y = [0.0; 6];
            for r in 0..m {
                let mut unit = [[0.0; 6]; C];
                unit[i][r] = 1.0;
                y[r] = second(c, sigma, &b, &projected(svd, &null, &unit, n, m), n, m);
                if r < angular {
                    y[r] += (0..m).map(|s| c[s] / sigma[s] * svd.u[s][r] * svd.v[s][i]).sum::<f64>() / length;
                }
            }
            columns[i] = self.rows.spread(&y);
        }
        LengthTerms { slope, y: columns, curvature }
    }
}
