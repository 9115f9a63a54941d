//! Orthogonal factors of a small matrix of full row rank, by modified Gram-Schmidt without square roots, and from them its
//! pseudo-inverse and null space.
//!
//! `A' = O U` with orthogonal columns o_k of squared length s_k and U unit upper triangular, so `A^+ = O diag(1/s) U^-T` for square and wide
//! matrices alike. Errors are of the size of the condition number of A, not of its square as through the Gram matrix `A A'`. There is no
//! pivot and no branch, and one division a column on the critical path: twice as fast at 6 x 6 as elimination with pivoting or
//! Householder reflections (`benches/linalg.rs`).

use super::{Row6, size};

/// An orthogonal column shorter than this multiple of the longest means that the rows of A are dependent to working precision.
const RANK_TOLERANCE: f64 = 8.0 * f64::EPSILON;

/// The factors of A'.
#[derive(Debug, Clone, Copy)]
pub struct Orthogonal<const C: usize> {
    n: usize,
    m: usize,
    /// O by rows: n rows of m.
    o: [Row6; C],
    /// Squared lengths of the columns of O.
    square: Row6,
    /// Their reciprocals.
    reciprocal: Row6,
    /// U transposed, strictly lower part: `[j][k]` is U_kj, k < j.
    ut: [Row6; 6],
}

impl<const C: usize> Orthogonal<C> {
    /// Of the m x n matrix whose columns are the first m entries of the n rows `columns`.
    ///
    /// Inner loops run over all six entries, finished ones included: whole vectors cost less than ragged ones.
    #[inline(always)]
    pub fn new(columns: &[Row6; C], n: usize, m: usize) -> Self {
        let n = size::<C>(n);
        let mut o = *columns;
        let mut out = Self { n, m, o, square: [0.0; 6], reciprocal: [0.0; 6], ut: [[0.0; 6]; 6] };
        for k in 0..m {
            let mut dots = [0.0; 6];
            for i in 0..n {
                for c in 0..6 {
                    dots[c] += o[i][k] * o[i][c];
                }
            }
            let reciprocal = 1.0 / dots[k];
            out.square[k] = dots[k];
            out.reciprocal[k] = reciprocal;
            let mut factors = [0.0; 6];
            for c in k + 1..m {
                factors[c] = dots[c] * reciprocal;
                out.ut[c][k] = factors[c];
            }
            for i in 0..n {
                let head = o[i][k];
                for c in 0..6 {
                    o[i][c] -= head * factors[c];
                }
            }
        }
        out.o = o;
        out
    }

    /// Whether the rows of A are independent to working precision.
    #[inline(always)]
    pub fn has_full_rank(&self) -> bool {
        let (mut smallest, mut largest) = (f64::INFINITY, 0.0f64);
        for k in 0..self.m {
            smallest = smallest.min(self.square[k]);
            largest = largest.max(self.square[k]);
        }
        self.m <= self.n && smallest > RANK_TOLERANCE * RANK_TOLERANCE * largest && largest.is_finite()
    }

    /// Length of the shortest orthogonal column over that of the longest: a cheap sign of near dependence, 0 to 1.
    #[inline(always)]
    pub fn spread(&self) -> f64 {
        let (mut smallest, mut largest) = (f64::INFINITY, f64::MIN_POSITIVE);
        for k in 0..self.m {
            smallest = smallest.min(self.square[k]);
            largest = largest.max(self.square[k]);
        }
        (smallest / largest).sqrt()
    }

    /// `sqrt(det(A A'))`.
    #[inline(always)]
    pub fn volume(&self) -> f64 {
        let mut product = 1.0;
        for k in 0..self.m {
            product *= self.square[k].sqrt();
        }
        product
    }

    /// `P = A^+` by rows: n rows of m.
    #[inline(always)]
    pub fn pseudo_inverse(&self) -> [Row6; C] {
        let n = size::<C>(self.n);
        let mut p = [[0.0; 6]; C];
        for i in 0..n {
            for c in 0..self.m {
                p[i][c] = self.o[i][c] * self.reciprocal[c];
            }
        }
        for j in (1..self.m).rev() {
            for i in 0..n {
                let done = p[i][j];
                for c in 0..6 {
                    p[i][c] -= done * self.ut[j][c];
                }
            }
        }
        p
    }

    /// An orthonormal basis of the null space of A: vector `j` in row `j`, n - m of them.
    #[inline(always)]
    pub fn null_space(&self) -> [[f64; C]; C] {
        let n = size::<C>(self.n);
        let mut basis = [[0.0; C]; C];
        for j in 0..n.saturating_sub(self.m) {
            // The joint whose unit vector lies farthest from what is spanned already.
            let (mut seed, mut farthest) = (0, -1.0);
            for i in 0..n {
                let spanned: f64 = (0..self.m).map(|c| self.o[i][c] * self.o[i][c] * self.reciprocal[c]).sum();
                let taken: f64 = (0..j).map(|b| basis[b][i] * basis[b][i]).sum();
                if 1.0 - spanned - taken > farthest {
                    (seed, farthest) = (i, 1.0 - spanned - taken);
                }
            }
            let mut vector = [0.0; C];
            vector[seed] = 1.0;
            // Twice is enough (Kahan, Parlett).
            for _ in 0..2 {
                for c in 0..self.m {
                    let along = self.reciprocal[c] * (0..n).map(|i| self.o[i][c] * vector[i]).sum::<f64>();
                    for i in 0..n {
                        vector[i] -= along * self.o[i][c];
                    }
                }
                for b in 0..j {
                    let along: f64 = (0..n).map(|i| basis[b][i] * vector[i]).sum();
                    for i in 0..n {
                        vector[i] -= along * basis[b][i];
                    }
                }
            }
            let length = (0..n).map(|i| vector[i] * vector[i]).sum::<f64>().sqrt();
            for i in 0..n {
                basis[j][i] = vector[i] / length;
            }
        }
        basis
    }
}
