//! The shortest solution of a wide system by Householder reflections (Arenson, Angeles and Slutski 1998, after Huo 2009, eq. 2.44 to 2.50).

use super::{Row6, Rows6, size};

/// `H A' = [U; 0]` of an m x n matrix A of full row rank, m <= n, with the reflections that H is made of.
#[derive(Debug, Clone, Copy)]
pub struct Householder<const C: usize> {
    n: usize,
    m: usize,
    /// Vector of reflection k in row k, zero ahead of entry k.
    vectors: Rows6<C>,
    /// Two over the squared lengths of these.
    factors: Row6,
    /// Column k of U in row k, entries up to k.
    columns: Rows6<C>,
}

#[inline(always)]
fn reflect<const C: usize>(x: &mut [f64; C], vector: &[f64; C], factor: f64) {
    let along = factor * super::orthogonal::dot(vector, x);
    for i in 0..C {
        x[i] -= along * vector[i];
    }
}

impl<const C: usize> Householder<C> {
    /// Of the m x n matrix `a`, by rows.
    #[inline(always)]
    pub fn new(a: &Rows6<C>, n: usize, m: usize) -> Self {
        let n = size::<C>(n);
        let mut out = Self { n, m, vectors: [[0.0; C]; 6], factors: [0.0; 6], columns: *a };
        for k in 0..m.min(n) {
            let tail = &out.columns[k];
            let square: f64 = (k..n).map(|i| tail[i] * tail[i]).sum();
            let pivot = out.columns[k][k];
            let length = square.sqrt().copysign(pivot);
            let mut vector = [0.0; C];
            vector[k..n].copy_from_slice(&out.columns[k][k..n]);
            vector[k] += length;
            let norm2 = square + length * (2.0 * pivot + length);
            let factor = if norm2 > 0.0 { 2.0 / norm2 } else { 0.0 };
            for column in out.columns.iter_mut().take(m).skip(k) {
                reflect(column, &vector, factor);
            }
            out.vectors[k] = vector;
            out.factors[k] = factor;
        }
        out
    }

    /// Smallest over largest diagonal entry of U: a cheap sign of near dependence, 0 to 1.
    #[inline(always)]
    pub fn spread(&self) -> f64 {
        if self.m > self.n {
            return 0.0;
        }
        let diagonal = |k: usize| self.columns[k][k].abs();
        let (smallest, largest) = (0..self.m).fold((f64::INFINITY, 0.0f64), |(s, l), k| (s.min(diagonal(k)), l.max(diagonal(k))));
        smallest / largest.max(f64::MIN_POSITIVE)
    }

    /// The shortest x with `A x = b`: `H' [U^-T b; 0]`.
    #[inline(always)]
    pub fn solve(&self, b: &Row6) -> [f64; C] {
        let mut x = [0.0; C];
        for k in 0..self.m {
            let known: f64 = (0..k).map(|j| self.columns[k][j] * x[j]).sum();
            x[k] = (b[k] - known) / self.columns[k][k];
        }
        for k in (0..self.m).rev() {
            reflect(&mut x, &self.vectors[k], self.factors[k]);
        }
        x
    }
}
