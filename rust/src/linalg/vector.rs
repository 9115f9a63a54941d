//! Vectors of three numbers.

use super::real::Real;

/// A vector of three numbers.
pub type Vec3<T = f64> = [T; 3];

/// a x b.
#[inline(always)]
pub fn cross<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a . b.
#[inline(always)]
pub fn dot<T: Real>(a: Vec3<T>, b: Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + b.
#[inline(always)]
pub fn add<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
#[inline(always)]
pub fn sub<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a.
#[inline(always)]
pub fn scale<T: Real>(s: T, a: Vec3<T>) -> Vec3<T> {
    [s * a[0], s * a[1], s * a[2]]
}

/// Euclidean norm.
#[inline(always)]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// a over its norm, for any size that does not vanish; `None` for zero and for what is not finite.
pub fn unit(a: Vec3) -> Option<Vec3> {
    let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) || a.iter().any(|x| x.is_nan()) {
        return None;
    }
    let a = a.map(|x| x / largest);
    Some(scale(1.0 / norm(a), a))
}

/// The two halves of a twist [omega; v].
#[inline(always)]
pub fn halves<T: Real>(t: &[T; 6]) -> (Vec3<T>, Vec3<T>) {
    ([t[0], t[1], t[2]], [t[3], t[4], t[5]])
}

/// Two unit vectors that complete the unit vector `e` to an orthonormal frame (Duff et al., 2017: no branch that loses digits).
#[inline]
pub fn perpendicular(e: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0f64.copysign(e[2]);
    let a = -1.0 / (sign + e[2]);
    let b = e[0] * e[1] * a;
    ([1.0 + sign * e[0] * e[0] * a, sign * b, -sign * e[0]], [b, sign + e[1] * e[1] * a, -e[1]])
}
