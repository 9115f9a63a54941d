//! Singular values and vectors of a small matrix by one-sided Jacobi rotations: bounded sweeps, high relative accuracy of the small
//! singular values (Demmel and Veselic, 1992), no allocation.

use super::orthogonal::Orthogonal;
use super::{Row6, Rows6, size};

/// More sweeps than any 6 x 6 matrix needs (quadratic convergence sets in after three or four).
const MAX_SWEEPS: usize = 30;

/// `A = U diag(sigma) V'` of an m x n matrix, m <= n, sigma decreasing.
#[derive(Debug, Clone, Copy)]
pub struct Svd<const C: usize> {
    n: usize,
    m: usize,
    /// Singular values, decreasing, m of them.
    pub sigma: Row6,
    /// Left vector `i` in row `i`.
    pub u: [Row6; 6],
    /// Right vector `i` < m in row `i`.
    pub v: Rows6<C>,
}

impl<const C: usize> Svd<C> {
    /// Of the m x n matrix `a`, by rows.
    #[inline(always)]
    pub fn new(a: &Rows6<C>, n: usize, m: usize) -> Self {
        let n = size::<C>(n);
        // Rotate the columns of A' until they are orthogonal: A' Y = V S. Then A = Y S V'.
        let mut columns = *a;
        let mut y = [[0.0; 6]; 6];
        for c in 0..m {
            y[c][c] = 1.0;
        }
        orthogonalise(&mut columns, &mut y, m);
        let mut sigma = [0.0; 6];
        for c in 0..m {
            sigma[c] = dot(&columns[c], &columns[c]).sqrt();
        }
        let mut order = [0, 1, 2, 3, 4, 5];
        order[..m].sort_unstable_by(|i, j| sigma[*j].total_cmp(&sigma[*i]));
        let mut out = Self { n, m, sigma: [0.0; 6], u: [[0.0; 6]; 6], v: [[0.0; C]; 6] };
        for (to, from) in order[..m].iter().enumerate() {
            out.sigma[to] = sigma[*from];
            out.u[to] = y[*from];
            if sigma[*from] > 0.0 {
                out.v[to] = columns[*from].map(|x| x / sigma[*from]);
            }
        }
        out
    }

    /// The rest of the right vectors: a basis of the null space, vector `j` in row `j`.
    #[inline(always)]
    pub fn null_space(&self) -> [[f64; C]; C] {
        if self.n == self.m { [[0.0; C]; C] } else { Orthogonal::new(&self.v, self.n, self.m).null_space() }
    }
}

#[inline(always)]
fn dot<const C: usize>(a: &[f64; C], b: &[f64; C]) -> f64 {
    (0..C).map(|i| a[i] * b[i]).sum()
}

/// The vectors a and b turned into each other.
#[inline(always)]
fn turn<const C: usize>(vectors: &mut [[f64; C]; 6], p: usize, q: usize, cosine: f64, sine: f64) {
    for i in 0..C {
        let (x, z) = (vectors[p][i], vectors[q][i]);
        vectors[p][i] = cosine * x - sine * z;
        vectors[q][i] = sine * x + cosine * z;
    }
}

/// Rotates pairs of columns until all are orthogonal to working precision, and the columns of `y` with them.
#[inline(always)]
fn orthogonalise<const C: usize>(columns: &mut [[f64; C]; 6], y: &mut [Row6; 6], m: usize) {
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..m {
            for q in p + 1..m {
                let (app, aqq, apq) = (dot(&columns[p], &columns[p]), dot(&columns[q], &columns[q]), dot(&columns[p], &columns[q]));
                if apq == 0.0 || apq * apq <= f64::EPSILON * f64::EPSILON * app * aqq {
                    continue;
                }
                rotated = true;
                let zeta = (aqq - app) / (2.0 * apq);
                let t = 1.0f64.copysign(zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cosine = 1.0 / (1.0 + t * t).sqrt();
                turn(columns, p, q, cosine, cosine * t);
                turn(y, p, q, cosine, cosine * t);
            }
        }
        if !rotated {
            break;
        }
    }
}
