//! Orthogonal factors of a small matrix of full row rank, by modified Gram-Schmidt without square roots, and from them its
//! pseudo-inverse and null space.
//!
//! `A' = O U` with orthogonal columns o_k of squared length s_k and U unit upper triangular, so `A^+ = O diag(1/s) U^-T` for square and wide
//! matrices alike. Errors are of the size of the condition number of A, not of its square as through the Gram matrix `A A'`. There is no
//! pivot, no branch but where digits are lost to cancellation, and one division a row on the critical path: at 6 x 6 it takes a third of the
//! time of elimination with pivoting or of Householder reflections (`benches/linalg.rs`).

use super::real::Real;
use super::{Mat6, Row6, Rows6, size};

/// An orthogonal vector shorter than this multiple of the longest means that the rows of A are dependent to working precision.
const RANK_TOLERANCE: f64 = 8.0 * f64::EPSILON;

/// A vector of which less than this is left over, both squared, has lost digits to cancellation and is orthogonalised again: vectors are
/// orthogonal to five roundings. (With 1e-3 the derivatives of one reference posture in a thousand leave their bounds.)
const CANCELLED: f64 = 5e-2;

/// Runs the body for k from 0 to m - 1, at most 5, with k a constant in each copy, so that the triangular loops within unroll too.
macro_rules! unrolled {
    ($k:ident < $m:expr, $body:block) => {
        unrolled!(@ $k $m, $body, 0 1 2 3 4 5)
    };
    (@ $k:ident $m:expr, $body:block, $($constant:literal)*) => {
        $(
            if $constant < $m {
                let $k: usize = $constant;
                $body
            }
        )*
    };
}

/// a . b.
#[inline(always)]
pub fn dot<const C: usize, T: Real>(a: &[T; C], b: &[T; C]) -> T {
    // Two sums: half the latency, and the compiler keeps them in one register.
    let mut sums = [a[0] * b[0], a[1] * b[1]];
    for i in 2..C {
        sums[i % 2] += a[i] * b[i];
    }
    sums[0] + sums[1]
}

/// a - factor b.
#[inline(always)]
fn subtract<const C: usize, T: Real>(a: &mut [T; C], factor: T, b: &[T; C]) {
    for i in 0..C {
        a[i] -= factor * b[i];
    }
}

/// What the square of an orthogonal vector must not be less than, from the row that it was.
#[inline(always)]
fn least<const C: usize, T: Real>(row: &[T; C]) -> T {
    T::splat(CANCELLED) * dot(row, row)
}

/// The factors of A'.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))] // no row of eight lies across two lines of the cache
pub struct Orthogonal<const C: usize, T = f64> {
    /// Columns of O, as rows.
    o: Rows6<C, T>,
    n: usize,
    m: usize,
    /// Their squared lengths.
    square: Row6<T>,
    /// The reciprocals of these.
    reciprocal: Row6<T>,
    /// U, strictly above the diagonal.
    u: Mat6<T>,
}

impl<const C: usize, T: Real> Orthogonal<C, T> {
    /// Of the m x n matrix `a`, by rows.
    #[inline(always)]
    pub fn new(a: &Rows6<C, T>, n: usize, m: usize) -> Self {
        let mut out = Self::blank();
        out.factor(a, n, m);
        out
    }

    /// Nothing yet: what [`Self::factor`] fills in place, for a copy costs as much as half the factorisation.
    #[inline(always)]
    pub fn blank() -> Self {
        Self { n: 0, m: 0, o: [[T::ZERO; C]; 6], square: [T::ZERO; 6], reciprocal: [T::ZERO; 6], u: [[T::ZERO; 6]; 6] }
    }

    /// Fills a blank one with the factors of the m x n matrix `a`, by rows. Of one matrix in one copy, so that a tick with cold caches fetches it
    /// once; of several side by side within the caller, whose registers may be wider than any machine's.
    #[inline(always)]
    pub fn factor(&mut self, a: &Rows6<C, T>, n: usize, m: usize) {
        if T::LANES == 1 { self.factor_apart(a, n, m) } else { self.factor_here(a, n, m) }
    }

    #[inline(never)]
    fn factor_apart(&mut self, a: &Rows6<C, T>, n: usize, m: usize) {
        self.factor_here(a, n, m);
    }

    #[inline(always)]
    fn factor_here(&mut self, a: &Rows6<C, T>, n: usize, m: usize) {
        (self.n, self.m) = (size::<C>(n), m);
        self.o.copy_from_slice(a);
        unrolled!(k < m, {
            let (square, least) = (dot(&self.o[k], &self.o[k]), least(&a[k]));
            let cancelled = k > 0 && T::any_less(square, least);
            let square = if cancelled { self.orthogonalise_again(k, square, least) } else { square };
            let (pivot, reciprocal) = (self.o[k], T::splat(1.0) / square);
            (self.square[k], self.reciprocal[k]) = (square, reciprocal);
            for c in k + 1..m {
                let factor = dot(&pivot, &self.o[c]) * reciprocal;
                self.u[k][c] = factor;
                subtract(&mut self.o[c], factor, &pivot);
            }
        });
    }

    /// What cancellation has brought back of the earlier vectors into vector k is taken out once more: twice is enough (Kahan, Parlett). Only in
    /// the lanes whose squared length is less than `least`, so that each answers what it would alone. Returns the squared length after it.
    #[inline(never)]
    fn orthogonalise_again(&mut self, k: usize, square: T, least: T) -> T {
        let vector = self.o[k];
        for j in 0..k {
            let factor = (dot(&self.o[j], &vector) * self.reciprocal[j]).where_less(square, least);
            self.u[j][k] += factor;
            let known = self.o[j];
            subtract(&mut self.o[k], factor, &known);
        }
        dot(&self.o[k], &self.o[k])
    }

    #[inline(always)]
    fn extremes(&self, lane: usize) -> (f64, f64) {
        let (mut smallest, mut largest) = (f64::INFINITY, 0.0f64);
        for k in 0..self.m {
            smallest = smallest.min(self.square[k].lane(lane));
            largest = largest.max(self.square[k].lane(lane));
        }
        (smallest, largest)
    }

    /// Whether the rows of A, in one lane, are independent to working precision.
    #[inline(always)]
    pub fn lane_has_full_rank(&self, lane: usize) -> bool {
        let (smallest, largest) = self.extremes(lane);
        self.m <= self.n && smallest > RANK_TOLERANCE * RANK_TOLERANCE * largest && largest.is_finite()
    }

    /// `sqrt(det(A A'))`.
    #[inline(always)]
    pub fn volume(&self) -> T {
        let mut product = T::splat(1.0);
        for k in 0..self.m {
            product = product * self.square[k].sqrt();
        }
        product
    }

    /// The shortest x with `A x = b`: `O diag(1/s) U^-T b`.
    #[inline(always)]
    pub fn solve(&self, b: &Row6<T>) -> [T; C] {
        let mut x = [T::ZERO; C];
        let mut left = *b;
        for k in 0..self.m {
            for j in 0..k {
                let known = left[j];
                left[k] -= self.u[j][k] * known;
            }
        }
        for k in 0..self.m {
            let factor = left[k] / self.square[k];
            for i in 0..C {
                x[i] += factor * self.o[k][i];
            }
        }
        x
    }

    /// `P = A^+` by columns: m of n numbers.
    #[inline(always)]
    pub fn pseudo_inverse(&self) -> Rows6<C, T> {
        let mut p = [[T::ZERO; C]; 6];
        self.pseudo_inverse_into(&mut p);
        p
    }

    /// The same into a zeroed `p`, apart or within the caller as [`Self::factor`].
    #[inline(always)]
    pub fn pseudo_inverse_into(&self, p: &mut Rows6<C, T>) {
        if T::LANES == 1 { self.pseudo_inverse_apart(p) } else { self.pseudo_inverse_here(p) }
    }

    #[inline(never)]
    fn pseudo_inverse_apart(&self, p: &mut Rows6<C, T>) {
        self.pseudo_inverse_here(p);
    }

    #[inline(always)]
    fn pseudo_inverse_here(&self, p: &mut Rows6<C, T>) {
        unrolled!(back < self.m, {
            let k = self.m - 1 - back;
            for i in 0..C {
                p[k][i] = self.o[k][i] * self.reciprocal[k];
            }
            // The row that was finished last comes last: the others do not wait for it.
            for j in (k + 1..self.m).rev() {
                let done = p[j];
                subtract(&mut p[k], self.u[k][j], &done);
            }
        });
    }
}

impl<const C: usize> Orthogonal<C> {
    /// Whether the rows of A are independent to working precision.
    #[inline(always)]
    pub fn has_full_rank(&self) -> bool {
        self.lane_has_full_rank(0)
    }

    /// Length of the shortest orthogonal vector over that of the longest: a cheap sign of near dependence, 0 to 1.
    #[inline(always)]
    pub fn spread(&self) -> f64 {
        let (smallest, largest) = self.extremes(0);
        (smallest / largest.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// An orthonormal basis of the null space of A: vector `j` in row `j`, n - m of them.
    #[inline(never)]
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
