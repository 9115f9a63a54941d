//! Damped least squares: bounded at singularities.

use super::cholesky::Cholesky;
use super::{Mat6, Row6, Rows6, gram, size};

/// `A' (A A' + damping 1)^-1 b` for the m x n matrix A with rows `rows`: bounded by |b| / (2 sqrt(damping)).
#[inline(never)]
pub fn damped_step<const C: usize>(rows: &Rows6<C>, b: &Row6, damping: f64, n: usize, m: usize) -> [f64; C] {
    let n = size::<C>(n);
    let mut a: Mat6 = gram(rows, m);
    for r in 0..m {
        a[r][r] += damping;
    }
    let mut step = [0.0; C];
    if let Some(factor) = Cholesky::new(&a, m) {
        let x = factor.solve(b);
        for i in 0..n {
            step[i] = (0..m).map(|r| rows[r][i] * x[r]).sum();
        }
    }
    step
}
