//! The rotation of Jacobi's methods.

/// Cosine and sine of the angle of at most 45 degrees that makes `[a_pp, a_pq; a_pq, a_qq]` diagonal, from `difference = a_qq - a_pp` and
/// `twice = 2 a_pq`, and `far`, of which `twice` is the tangent's share: `tan = +-twice / far`. One square root after another and one
/// division, no branch. Both zero, or so large or small that the fourth power of either leaves the range of numbers, are for the caller to keep away.
#[inline(always)]
pub fn rotation(difference: f64, twice: f64) -> (f64, f64, f64) {
    let far = difference.abs() + (difference * difference + twice * twice).sqrt();
    let length = (far * far + twice * twice).sqrt();
    (far / length, twice.copysign(twice * difference) / length, far)
}
