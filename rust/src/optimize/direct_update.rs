//! The direct BFGS update, of the Hessian itself (Nocedal and Wright 2006, eq. 6.19), on the stack.

/// Updates `hessian`, n x n, with the step `s` and the change `y` of the gradient. Without curvature along the step, or with squares that
/// overflow, nothing is learnt: the matrix stays positive semidefinite, to rounding of the largest curvature met. A zero matrix, of which nothing is known, is first scaled to the curvature seen.
pub fn direct_update<const N: usize>(hessian: &mut [[f64; N]; N], s: &[f64; N], y: &[f64; N], n: usize) {
    let dot = |a: &[f64; N], b: &[f64; N]| (0..n).map(|i| a[i] * b[i]).sum::<f64>();
    let (sy, ss, yy) = (dot(s, y), dot(s, s), dot(y, y));
    if !(ss * yy).is_normal() || sy <= f64::EPSILON.sqrt() * (ss * yy).sqrt() {
        return;
    }
    if hessian.iter().flatten().all(|x| *x == 0.0) {
        for (i, row) in hessian.iter_mut().enumerate().take(n) {
            row[i] = yy / sy;
        }
    }
    let mut hs = [0.0; N];
    for i in 0..n {
        hs[i] = dot(&hessian[i], s);
    }
    let shs = dot(s, &hs);
    if !shs.is_normal() {
        return;
    }
    for i in 0..n {
        for j in 0..n {
            hessian[i][j] += y[i] * y[j] / sy - hs[i] * hs[j] / shs;
        }
    }
}
