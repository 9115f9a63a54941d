//! First and second derivatives of the Jacobian (Leger 2014, eq. 3.9 to 3.22, 3.41, with the errata). With `w = 0` and `v` the axis for a
//! prismatic joint, one formula serves every mix of joints.

use super::forward::Jacobian;
use crate::linalg::Row6;
use crate::linalg::vector::{Vec3, add, cross, dot, scale};

/// `dJ_i / dq_k` (3.9 to 3.22), a twist, of joints that follow no others.
#[inline(always)]
pub fn derivative_column<const C: usize>(jacobian: &Jacobian<C>, k: usize, i: usize) -> Row6 {
    let (wk, vk, wi, vi) = (jacobian.w[k], jacobian.v[k], jacobian.w[i], jacobian.v[i]);
    let (dw, dv) = if i > k { (cross(wk, wi), cross(wk, vi)) } else { ([0.0; 3], cross(wi, vk)) };
    [dw[0], dw[1], dw[2], dv[0], dv[1], dv[2]]
}

/// Writes the array of shape (6, n, n), `[r, i, k] = dJ[r, i] / dq_k`.
#[inline(always)]
pub fn first_derivative<const C: usize>(jacobian: &Jacobian<C>, out: &mut [f64]) {
    let n = jacobian.n();
    let out = &mut out[..6 * n * n];
    if let Some(coupled) = jacobian.coupled() {
        for k in 0..n {
            for (i, column) in coupled.derivative(k).iter().enumerate().take(n) {
                for r in 0..6 {
                    out[(r * n + i) * n + k] = column[r];
                }
            }
        }
        return;
    }
    for i in 0..n {
        for k in 0..n {
            let column = derivative_column(jacobian, k, i);
            for r in 0..6 {
                out[(r * n + i) * n + k] = column[r];
            }
        }
    }
}

/// `d2J_i / dq_k dq_l` (3.41, 3.42), of joints that follow no others.
#[inline(always)]
pub(super) fn second<const C: usize>(jacobian: &Jacobian<C>, i: usize, k: usize, l: usize) -> Row6 {
    let (k, l) = (k.min(l), k.max(l));
    let (w, v) = (&jacobian.w, &jacobian.v);
    let (dw, dv) = if i > l {
        (cross(w[k], cross(w[l], w[i])), cross(w[k], cross(w[l], v[i])))
    } else if i > k {
        ([0.0; 3], cross(w[k], cross(w[i], v[l])))
    } else {
        ([0.0; 3], cross(w[i], cross(w[k], v[l])))
    };
    [dw[0], dw[1], dw[2], dv[0], dv[1], dv[2]]
}

/// Writes the array of shape (6, n, n, n), `[r, i, k, l] = d2J[r, i] / dq_k dq_l`.
pub fn second_derivative<const C: usize>(jacobian: &Jacobian<C>, out: &mut [f64]) {
    if let Some(coupled) = jacobian.coupled() {
        return coupled.second_derivative(out);
    }
    let n = jacobian.n();
    for i in 0..n {
        for k in 0..n {
            for l in k..n {
                let column = second(jacobian, i, k, l);
                for r in 0..6 {
                    out[((r * n + i) * n + k) * n + l] = column[r];
                    out[((r * n + i) * n + l) * n + k] = column[r];
                }
            }
        }
    }
}

/// The time derivative of every column of J at joint rates `rates`, by running sums (no dJ/dq is formed).
pub fn jacobian_rate<const C: usize>(jacobian: &Jacobian<C>, rates: &[f64]) -> Jacobian<'static, C> {
    if let Some(coupled) = jacobian.coupled() {
        return coupled.jacobian_rate(rates);
    }
    let n = jacobian.n();
    let mut rate = Jacobian::zero(n);
    let mut turning = [0.0; 3]; // sum of w_k qd_k over k < i
    let mut pushing = [0.0; 3]; // sum of v_k qd_k over k >= i
    for k in 0..n {
        pushing = add(pushing, scale(rates[k], jacobian.v[k]));
    }
    for i in 0..n {
        let (wi, vi) = (jacobian.w[i], jacobian.v[i]);
        rate.w[i] = cross(turning, wi);
        rate.v[i] = add(cross(turning, vi), cross(wi, pushing));
        turning = add(turning, scale(rates[i], wi));
        pushing = add(pushing, scale(-rates[i], vi));
    }
    rate
}

/// The second derivative of the work of a wrench [moment; force] at the tool point, `[i][k] = f . (dJ_i/dq_k + dJ_k/dq_i) / 2`.
#[inline(never)]
pub fn bending<const C: usize>(jacobian: &Jacobian<C>, moment: Vec3, force: Vec3) -> [[f64; C]; C] {
    if let Some(coupled) = jacobian.coupled() {
        return coupled.bending(moment, force);
    }
    let n = jacobian.n();
    let mut out = [[0.0; C]; C];
    for k in 0..n {
        let (turned, pushed) = (scale(0.5, cross(moment, jacobian.w[k])), cross(force, jacobian.w[k]));
        for i in k..n {
            // A joint does not turn its own axis.
            let term = if i > k { dot(turned, jacobian.w[i]) } else { 0.0 } + dot(pushed, jacobian.v[i]);
            (out[i][k], out[k][i]) = (term, term);
        }
    }
    out
}
