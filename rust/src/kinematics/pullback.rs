//! From a derivative with respect to the Jacobian to derivatives with respect to the joints, without forming dJ/dq or d2J/dq2.
//!
//! Given `Y = d(phi)/dJ` by columns `y_i = [y_w; y_v]`, the gradient is `g_k = <Y, dJ/dq_k>` and the part of the Hessian that comes from
//! the curvature of J is `<Y, d2J/dq_k dq_l>`. With `J_i = [w_i; v_i]` both are running sums over the chain, valid for revolute and
//! prismatic joints alike (`w = 0`).

use super::forward::Jacobian;
use crate::linalg::Row6;
use crate::linalg::real::Real;
use crate::linalg::vector::{Vec3, add, cross, dot, halves, scale, sub};

type Mat3 = [Vec3; 3];

/// m + a b'.
#[inline(always)]
fn add_outer(m: &mut Mat3, a: Vec3, b: Vec3) {
    for r in 0..3 {
        for c in 0..3 {
            m[r][c] += a[r] * b[c];
        }
    }
}

#[inline(always)]
fn times(m: &Mat3, a: Vec3) -> Vec3 {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// m' a.
#[inline(always)]
fn transposed_times(m: &Mat3, a: Vec3) -> Vec3 {
    std::array::from_fn(|c| m[0][c] * a[0] + m[1][c] * a[1] + m[2][c] * a[2])
}

#[inline(always)]
fn trace(m: &Mat3) -> f64 {
    m[0][0] + m[1][1] + m[2][2]
}

/// `g_k = <Y, dJ/dq_k>`: `w_k . sum_{i>k} (w_i x y_w + v_i x y_v) + v_k . sum_{i<=k} (y_v x w_i)`.
#[inline(always)]
pub fn pull_back<const C: usize>(jacobian: &Jacobian<C>, y: &[Row6; C]) -> [f64; C] {
    match jacobian.coupled() {
        None => pull_back_of(jacobian, y),
        Some(coupled) => coupled.pull_back(y),
    }
}

/// The same for one posture or for several side by side, of joints that follow no others.
#[inline(always)]
pub fn pull_back_of<const C: usize, T: Real>(jacobian: &Jacobian<C, T>, y: &[Row6<T>; C]) -> [T; C] {
    let n = jacobian.n();
    let mut gradient = [T::ZERO; C];
    let mut inner = [T::ZERO; 3];
    for k in 0..n {
        let (_, yv) = halves(&y[k]);
        inner = add(inner, cross(yv, jacobian.w[k]));
        gradient[k] = dot(jacobian.v[k], inner);
    }
    let mut outer = [T::ZERO; 3];
    for k in (0..n).rev() {
        let (yw, yv) = halves(&y[k]);
        gradient[k] += dot(jacobian.w[k], outer);
        outer = add(outer, add(cross(jacobian.w[k], yw), cross(jacobian.v[k], yv)));
    }
    gradient
}

/// Adds `<Y, d2J/dq_k dq_l>` to the upper triangle (k <= l) of `hessian`: the sum over i > l is `w_l' M w_k - (w_k.w_l) tr M` with
/// `M = sum y_w w_i' + y_v v_i'`; over k < i <= l it is `(w_k.v_l) tr C - w_k' C v_l` with `C = sum w_i y_v'`; over i <= k it is
/// `(sum y_v x w_i) . (w_k x v_l)`.
#[inline(always)]
pub fn pull_back_second<const C: usize>(jacobian: &Jacobian<C>, y: &[Row6; C], hessian: &mut [[f64; C]; C]) {
    if let Some(coupled) = jacobian.coupled() {
        return coupled.pull_back_second(y, hessian);
    }
    let n = jacobian.n();
    let (w, v) = (&jacobian.w, &jacobian.v);

    // Prefix sums over i <= k, folded with w_k: `left` multiplies v_l from within <.>.
    let mut middle = [[0.0; 3]; 3];
    let mut inner = [0.0; 3];
    let mut left = [[0.0; 3]; C];
    let mut full = [[0.0; 3]; C];
    let mut traces = [0.0; C];
    for k in 0..n {
        let (_, yv) = halves(&y[k]);
        add_outer(&mut middle, w[k], yv);
        inner = add(inner, cross(yv, w[k]));
        traces[k] = trace(&middle);
        left[k] = add(transposed_times(&middle, w[k]), cross(inner, w[k]));
        full[k] = times(&middle, v[k]);
    }

    let mut outer = [[0.0; 3]; 3];
    for l in (0..n).rev() {
        // The parts that do not depend on k, as one vector against w_k.
        let turned = sub(transposed_times(&outer, w[l]), scale(trace(&outer), w[l]));
        let against = sub(add(turned, scale(traces[l], v[l])), full[l]);
        for k in 0..=l {
            hessian[k][l] += dot(w[k], against) - traces[k] * dot(w[k], v[l]) + dot(left[k], v[l]);
        }
        let (yw, yv) = halves(&y[l]);
        add_outer(&mut outer, yw, w[l]);
        add_outer(&mut outer, yv, v[l]);
    }
}
