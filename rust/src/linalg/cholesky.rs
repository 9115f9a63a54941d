//! Cholesky factor of a small positive definite matrix, on the stack.

/// Lower triangle L of `A = L L'`.
#[derive(Debug, Clone, Copy)]
pub struct Cholesky<const C: usize> {
    n: usize,
    l: [[f64; C]; C],
    /// Reciprocals of its diagonal.
    inverse: [f64; C],
}

impl<const C: usize> Cholesky<C> {
    /// Of the leading n x n block; `None` when it is not positive definite to working precision.
    #[inline(always)]
    pub fn new(a: &[[f64; C]; C], n: usize) -> Option<Self> {
        let mut l = [[0.0; C]; C];
        let mut inverse = [0.0; C];
        for j in 0..n {
            for i in j..n {
                let mut sum = a[i][j];
                for k in 0..j {
                    sum -= l[i][k] * l[j][k];
                }
                if i > j {
                    l[i][j] = sum * inverse[j];
                } else if sum > 0.0 && sum.is_finite() {
                    l[j][j] = sum.sqrt();
                    inverse[j] = 1.0 / l[j][j];
                } else {
                    return None;
                }
            }
        }
        Some(Self { n, l, inverse })
    }

    /// Entry `j` of the diagonal of L.
    #[inline(always)]
    pub fn diagonal(&self, j: usize) -> f64 {
        self.l[j][j]
    }

    /// Entry `(i, j)` of L, `j <= i`.
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        self.l[i][j]
    }

    /// L^-1 b.
    #[inline(always)]
    pub fn forward(&self, b: &[f64; C]) -> [f64; C] {
        self.forward_leading(b, self.n)
    }

    /// L^-1 b by the leading n x n block, the factor of that of A.
    #[inline(always)]
    pub fn forward_leading(&self, b: &[f64; C], n: usize) -> [f64; C] {
        let mut x = *b;
        for i in 0..n {
            for k in 0..i {
                x[i] -= self.l[i][k] * x[k];
            }
            x[i] *= self.inverse[i];
        }
        x
    }

    /// L^-T b.
    #[inline(always)]
    pub fn backward(&self, b: &[f64; C]) -> [f64; C] {
        self.backward_leading(b, self.n)
    }

    /// L^-T b by the leading n x n block.
    #[inline(always)]
    pub fn backward_leading(&self, b: &[f64; C], n: usize) -> [f64; C] {
        let mut x = *b;
        for i in (0..n).rev() {
            for k in i + 1..n {
                x[i] -= self.l[k][i] * x[k];
            }
            x[i] *= self.inverse[i];
        }
        x
    }

    /// A^-1 b.
    #[inline(always)]
    pub fn solve(&self, b: &[f64; C]) -> [f64; C] {
        self.backward(&self.forward(b))
    }
}
