//! The direct BFGS update, of the Hessian itself (Nocedal and Wright 2006, eq. 6.19), on the stack.

/// Curvature along a step below this part of what the lengths of step and change would allow is none.
const CURVED: f64 = 1.490_116_119_384_765_6e-8; // the root of the rounding unit
/// The same where negative curvature counts too, relative to the squared length of the step.
const DEFINED: f64 = 1e-12;

#[inline(always)]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N], n: usize) -> f64 {
    (0..n).map(|i| a[i] * b[i]).sum()
}

/// Updates `hessian`, n x n, with the step `s` and the change `y` of the gradient. Without curvature along the step, or with squares that
/// overflow, nothing is learnt: the matrix stays positive semidefinite, to rounding of the largest curvature met. A zero matrix, of which nothing is
/// known, is first scaled to the curvature seen.
pub fn direct_update<const N: usize>(hessian: &mut [[f64; N]; N], s: &[f64; N], y: &[f64; N], n: usize) {
    let (sy, ss, yy) = (dot(s, y, n), dot(s, s, n), dot(y, y, n));
    if !(ss * yy).is_normal() || sy <= CURVED * (ss * yy).sqrt() {
        return;
    }
    if hessian.iter().flatten().all(|x| *x == 0.0) {
        for (i, row) in hessian.iter_mut().enumerate().take(n) {
            row[i] = yy / sy;
        }
    }
    update(hessian, s, y, n, f64::is_normal);
}

/// The same update of a matrix that may be indefinite, as the Hessian of an index is: negative curvature is learnt too.
pub(crate) fn direct_update_indefinite<const N: usize>(hessian: &mut [[f64; N]; N], s: &[f64; N], y: &[f64; N], n: usize) {
    let least = DEFINED * dot(s, s, n);
    if dot(s, y, n).abs() > least {
        update(hessian, s, y, n, |curvature| curvature.abs() > least);
    }
}

/// `H - H s s' H / s'Hs + y y' / s'y`, where `usable` of `s'Hs`.
#[inline(always)]
fn update<const N: usize>(hessian: &mut [[f64; N]; N], s: &[f64; N], y: &[f64; N], n: usize, usable: impl Fn(f64) -> bool) {
    let mut hs = [0.0; N];
    for i in 0..n {
        hs[i] = dot(&hessian[i], s, n);
    }
    let (shs, sy) = (dot(s, &hs, n), dot(s, y, n));
    if !usable(shs) {
        return;
    }
    for i in 0..n {
        for j in 0..n {
            hessian[i][j] += y[i] * y[j] / sy - hs[i] * hs[j] / shs;
        }
    }
}
