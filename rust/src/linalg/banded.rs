//! Symmetric positive definite band matrices: what a path's neighbouring points make of a Newton system. Cost and memory grow with n w.

/// Lower band of a symmetric matrix, then of its Cholesky factor.
#[derive(Debug, Clone)]
pub struct Banded {
    n: usize,
    /// Subdiagonals.
    width: usize,
    /// Row i holds the columns i - width to i.
    rows: Vec<f64>,
}

impl Banded {
    /// Zero, with `width` subdiagonals.
    pub fn new(n: usize, width: usize) -> Self {
        Self { n, width, rows: vec![0.0; n * (width + 1)] }
    }

    #[inline(always)]
    fn at(&self, i: usize, j: usize) -> usize {
        i * (self.width + 1) + self.width + j - i
    }

    /// Adds to the entry (i, j) and so to (j, i); the two are the same one.
    #[inline(always)]
    pub fn add(&mut self, i: usize, j: usize, x: f64) {
        let at = self.at(i.max(j), i.min(j));
        self.rows[at] += x;
    }

    /// Largest entry of the diagonal.
    pub fn largest_diagonal(&self) -> f64 {
        (0..self.n).fold(0.0, |m, i| self.rows[self.at(i, i)].abs().max(m))
    }

    /// Factors `A + shift 1` into `into`; false when it is not positive definite.
    pub fn factor_into(&self, shift: f64, into: &mut Self) -> bool {
        into.rows.copy_from_slice(&self.rows);
        for j in 0..self.n {
            let at = self.at(j, j);
            into.rows[at] += shift;
        }
        for i in 0..self.n {
            let first = i.saturating_sub(self.width);
            for j in first..=i {
                let mut sum = into.rows[self.at(i, j)];
                for k in first.max(j.saturating_sub(self.width))..j {
                    sum -= into.rows[self.at(i, k)] * into.rows[self.at(j, k)];
                }
                let at = self.at(i, j);
                if j < i {
                    into.rows[at] = sum / into.rows[self.at(j, j)];
                } else if sum > 0.0 && sum.is_finite() {
                    into.rows[at] = sum.sqrt();
                } else {
                    return false;
                }
            }
        }
        true
    }

    /// Solves with the factor, in place.
    pub fn solve(&self, b: &mut [f64]) {
        for i in 0..self.n {
            let mut sum = b[i];
            for k in i.saturating_sub(self.width)..i {
                sum -= self.rows[self.at(i, k)] * b[k];
            }
            b[i] = sum / self.rows[self.at(i, i)];
        }
        for i in (0..self.n).rev() {
            let mut sum = b[i];
            for k in i + 1..(i + self.width + 1).min(self.n) {
                sum -= self.rows[self.at(k, i)] * b[k];
            }
            b[i] = sum / self.rows[self.at(i, i)];
        }
    }
}
