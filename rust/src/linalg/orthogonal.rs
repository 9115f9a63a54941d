//! Orthogonal factors of a small matrix of full row rank, by modified Gram-Schmidt without square roots, and from them its
//! pseudo-inverse and null space.
//!
//! `A' = O U` with orthogonal columns o_k of squared length s_k and U unit upper triangular, so `A^+ = O diag(1/s) U^-T` for square and wide
//! matrices alike. Errors are of the size of the condition number of A, not of its square as through the Gram matrix `A A'`. There is no
//! pivot and no branch, and one division a row on the critical path: at 6 x 6 it takes a third of the time of elimination with pivoting or
//! of Householder reflections (`benches/linalg.rs`).

use super::{Mat6, Row6, Rows6, size};

/// An orthogonal vector shorter than this multiple of the longest means that the rows of A are dependent to working precision.
const RANK_TOLERANCE: f64 = 8.0 * f64::EPSILON;

/// A vector whose square shrinks below this part of its row's has lost digits to cancellation, and with them orthogonality
/// (Daniel, Gragg, Kaufman and Stewart 1976).
const CANCELLED: f64 = 0.5;

#[inline(always)]
fn dot<const C: usize>(a: &[f64; C], b: &[f64; C]) -> f64 {
    let mut sum = a[0] * b[0];
    for i in 1..C {
        sum += a[i] * b[i];
    }
    sum
}

/// a - factor b.
#[inline(always)]
fn subtract<const C: usize>(a: &mut [f64; C], factor: f64, b: &[f64; C]) {
    for i in 0..C {
        a[i] -= factor * b[i];
    }
}

/// The factors of A'.
#[derive(Debug, Clone, Copy)]
pub struct Orthogonal<const C: usize> {
    n: usize,
    m: usize,
    /// Columns of O, as rows.
    o: Rows6<C>,
    /// Their squared lengths.
    square: Row6,
    /// The reciprocals of these.
    reciprocal: Row6,
    /// U, strictly above the diagonal.
    u: Mat6,
}

impl<const C: usize> Orthogonal<C> {
    /// Of the m x n matrix `a`, by rows.
    #[inline(always)]
    pub fn new(a: &Rows6<C>, n: usize, m: usize) -> Self {
        let n = size::<C>(n);
        let mut out = Self { n, m, o: *a, square: [0.0; 6], reciprocal: [0.0; 6], u: [[0.0; 6]; 6] };
        for k in 0..m {
            out.square[k] = dot(&out.o[k], &out.o[k]);
            if out.square[k] < CANCELLED * dot(&a[k], &a[k]) {
                out.orthogonalise_again(k);
            }
            let pivot = out.o[k];
            out.reciprocal[k] = 1.0 / out.square[k];
            for c in k + 1..m {
                let factor = dot(&pivot, &out.o[c]) / out.square[k];
                out.u[k][c] = factor;
                subtract(&mut out.o[c], factor, &pivot);
            }
        }
        out
    }

    /// What cancellation has brought back of the earlier vectors into vector k is taken out once more: twice is enough (Kahan, Parlett).
    #[cold]
    #[inline(never)]
    fn orthogonalise_again(&mut self, k: usize) {
        for j in 0..k {
            let known = self.o[j];
            let factor = dot(&known, &self.o[k]) * self.reciprocal[j];
            self.u[j][k] += factor;
            subtract(&mut self.o[k], factor, &known);
        }
        self.square[k] = dot(&self.o[k], &self.o[k]);
    }

    #[inline(always)]
    fn extremes(&self) -> (f64, f64) {
        let (mut smallest, mut largest) = (f64::INFINITY, 0.0f64);
        for k in 0..self.m {
            smallest = smallest.min(self.square[k]);
            largest = largest.max(self.square[k]);
        }
        (smallest, largest)
    }

    /// Whether the rows of A are independent to working precision.
    #[inline(always)]
    pub fn has_full_rank(&self) -> bool {
        let (smallest, largest) = self.extremes();
        self.m <= self.n && smallest > RANK_TOLERANCE * RANK_TOLERANCE * largest && largest.is_finite()
    }

    /// Length of the shortest orthogonal vector over that of the longest: a cheap sign of near dependence, 0 to 1.
    #[inline(always)]
    pub fn spread(&self) -> f64 {
        let (smallest, largest) = self.extremes();
        (smallest / largest.max(f64::MIN_POSITIVE)).sqrt()
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

    /// `P = A^+` by columns: m of n numbers.
    #[inline(always)]
    pub fn pseudo_inverse(&self) -> Rows6<C> {
        let mut p = self.o;
        for k in (0..self.m).rev() {
            for x in &mut p[k] {
                *x /= self.square[k];
            }
            for j in k + 1..self.m {
                let done = p[j];
                subtract(&mut p[k], self.u[k][j], &done);
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
                let mut left = 1.0;
                for c in 0..self.m {
                    left -= self.o[c][i] * self.o[c][i] * self.reciprocal[c];
                }
                for known in basis.iter().take(j) {
                    left -= known[i] * known[i];
                }
                if left > farthest {
                    (seed, farthest) = (i, left);
                }
            }
            let mut vector = [0.0; C];
            vector[seed] = 1.0;
            // Twice is enough (Kahan, Parlett).
            for _ in 0..2 {
                for c in 0..self.m {
                    let along = self.reciprocal[c] * dot(&self.o[c], &vector);
                    subtract(&mut vector, along, &self.o[c]);
                }
                for known in basis.iter().take(j) {
                    let along = dot(known, &vector);
                    subtract(&mut vector, along, known);
                }
            }
            let length = dot(&vector, &vector).sqrt();
            basis[j] = vector.map(|x| x / length);
        }
        basis
    }
}
