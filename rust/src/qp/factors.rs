//! The factors the method lives on: `H = L L'` and `L^-1 A = Q [R; 0]` for the normals A of the working set.
//!
//! Goldfarb and Idnani keep `L^-T Q`; Q by itself stays orthonormal however badly H is conditioned. Reflections add a normal, rotations take one
//! out: O(n^2) each.

use crate::linalg::cholesky::Cholesky;

/// A curvature left by elimination below this part of its whole is rounding: H is not positive definite.
const CURVATURE: f64 = 1e-13;

#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// `y += factor * x`.
#[inline(always)]
pub(super) fn add(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// The variables in use: a compile-time constant where all are, so that loops unroll.
#[inline(always)]
pub(super) fn size<const N: usize, const FULL: bool>(n: usize) -> usize {
    if FULL { N } else { n }
}

/// Factors of H and of the working set.
pub(super) struct Factors<const N: usize, const FULL: bool> {
    n: usize,
    cholesky: Cholesky<N>,
    /// Columns of Q.
    q: [[f64; N]; N],
    /// Columns of R.
    r: [[f64; N]; N],
    count: usize,
}

impl<const N: usize, const FULL: bool> Factors<N, FULL> {
    #[inline(always)]
    fn n(&self) -> usize {
        size::<N, FULL>(self.n)
    }

    /// Of an empty working set; `None` when H is not positive definite.
    #[inline(always)]
    pub fn new(h: &[[f64; N]; N], n: usize) -> Option<Self> {
        let cholesky = Cholesky::new(h, n)?;
        if (0..n).any(|j| cholesky.diagonal(j).powi(2) <= CURVATURE * h[j][j]) {
            return None;
        }
        let mut q = [[0.0; N]; N];
        for k in 0..n {
            q[k][k] = 1.0;
        }
        Some(Self { n, cholesky, q, r: [[0.0; N]; N], count: 0 })
    }

    /// L^-1 a: lengths in the metric of H^-1.
    #[inline(always)]
    pub fn whitened(&self, a: &[f64; N]) -> [f64; N] {
        self.cholesky.forward_leading(a, self.n())
    }

    /// Q'w.
    #[inline(always)]
    pub fn components(&self, w: &[f64; N]) -> [f64; N] {
        let n = self.n();
        let mut out = [0.0; N];
        for k in 0..n {
            out[k] = dot(&self.q[k][..n], &w[..n]);
        }
        out
    }

    /// The part of `Q c` along the columns from `first` on.
    #[inline(always)]
    pub fn combined(&self, c: &[f64; N], first: usize) -> [f64; N] {
        let n = self.n();
        let mut out = [0.0; N];
        for k in first..n {
            add(&mut out[..n], c[k], &self.q[k][..n]);
        }
        out
    }

    /// L^-T w.
    #[inline(always)]
    pub fn unwhitened(&self, w: &[f64; N]) -> [f64; N] {
        self.cholesky.backward_leading(w, self.n())
    }

    /// R^-1 c.
    #[inline(always)]
    pub fn solve(&self, c: &[f64; N]) -> [f64; N] {
        let mut out = [0.0; N];
        out[..self.count].copy_from_slice(&c[..self.count]);
        for j in (0..self.count).rev() {
            let (above, rest) = out.split_at_mut(j);
            rest[0] /= self.r[j][j];
            add(above, -rest[0], &self.r[j][..j]);
        }
        out
    }

    /// R^-T s.
    #[inline(always)]
    pub fn solve_transposed(&self, s: &[f64; N]) -> [f64; N] {
        let mut out = [0.0; N];
        for j in 0..self.count {
            out[j] = (s[j] - dot(&self.r[j][..j], &out[..j])) / self.r[j][j];
        }
        out
    }

    /// Length of normal `j` of the working set in the metric of H^-1.
    #[inline(always)]
    pub fn length(&self, j: usize) -> f64 {
        dot(&self.r[j][..=j], &self.r[j][..=j]).sqrt()
    }

    /// Appends a normal of components `d`; `rest` is `combined(d, count)` and must not be zero. A reflection turns it into the next column of Q.
    #[inline(always)]
    pub fn append(&mut self, d: &[f64; N], rest: &[f64; N]) {
        let (n, k) = (self.n(), self.count);
        let left = dot(&d[k..n], &d[k..n]).sqrt();
        let corner = if d[k] > 0.0 { -left } else { left };
        // I - v v' / (corner v_k) with v = d - corner e_k over the columns from k on; p = Q v.
        let mut v = *d;
        v[k] -= corner;
        let mut p = *rest;
        add(&mut p[..n], -corner, &self.q[k][..n]);
        let scale = 1.0 / (corner * v[k]);
        for j in k..n {
            add(&mut self.q[j][..n], v[j] * scale, &p[..n]);
        }
        self.r[k][..k].copy_from_slice(&d[..k]);
        self.r[k][k] = corner;
        self.count += 1;
    }

    /// Takes out normal `k`. Rotations restore the triangle.
    #[inline(always)]
    pub fn remove(&mut self, k: usize) {
        self.r.copy_within(k + 1..self.count, k);
        self.count -= 1;
        let n = self.n();
        for j in k..self.count {
            let (a, b) = (self.r[j][j], self.r[j][j + 1]);
            let length = (a * a + b * b).sqrt();
            let (c, s) = (a / length, b / length);
            self.r[j][j] = length;
            for column in &mut self.r[j + 1..self.count] {
                (column[j], column[j + 1]) = (c * column[j] + s * column[j + 1], c * column[j + 1] - s * column[j]);
            }
            let (before, after) = self.q.split_at_mut(j + 1);
            for (x, y) in before[j][..n].iter_mut().zip(&mut after[0][..n]) {
                (*x, *y) = (c * *x + s * *y, c * *y - s * *x);
            }
        }
    }
}
