//! Sines and cosines of all joints at once, without branches, so that the compiler makes vectors of them.
//!
//! Reduction by three pieces of pi/2 (Cody and Waite, 1980), then minimax polynomials on |x| <= pi/4 whose errors, 1e-17 and 5e-19, are
//! below the rounding; the results are within two units in the last place. Larger angles than the reduction bears go to the standard library.

/// The reduction is exact to the last bit up to this angle \[rad\].
const LARGEST: f64 = 1e6;

/// 1.5 * 2^52: adding it rounds to the nearest integer and leaves that integer in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// pi/2 in pieces of 33, 33 and 53 bits: the products of the first two with a quadrant below 2^20 are exact.
const HALF_PI: [f64; 3] = [1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21];

/// sin(x) = x + x^3 S(x^2).
const S: [f64; 6] = [
    -0.16666666666666666,
    0.008333333333330946,
    -0.0001984126983675497,
    2.755731610068303e-06,
    -2.5051131455427946e-08,
    1.591810123027412e-10,
];

/// cos(x) = 1 - x^2/2 + x^4 C(x^2).
const C: [f64; 6] = [
    0.041666666666666664,
    -0.0013888888888887395,
    2.4801587298763433e-05,
    -2.7557317270560326e-07,
    2.0876146024689747e-09,
    -1.1382614868556325e-11,
];

#[inline(always)]
fn polynomial(c: &[f64; 6], z: f64) -> f64 {
    let w = z * z;
    (c[0] + z * c[1]) + w * ((c[2] + z * c[3]) + w * (c[4] + z * c[5]))
}

#[inline(always)]
fn one(x: f64) -> (f64, f64) {
    let shifted = x * std::f64::consts::FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let turns = shifted - ROUND;
    let r = ((x - turns * HALF_PI[0]) - turns * HALF_PI[1]) - turns * HALF_PI[2];
    let z = r * r;
    let sine = r + r * z * polynomial(&S, z);
    let cosine = (1.0 - 0.5 * z) + z * z * polynomial(&C, z);
    // A choice by bits: angles are random to the processor's guesses.
    let odd = (quadrant & 1).wrapping_neg();
    let exchanged = (sine.to_bits() ^ cosine.to_bits()) & odd;
    let (s, c) = (sine.to_bits() ^ exchanged, cosine.to_bits() ^ exchanged);
    (f64::from_bits(s ^ ((quadrant & 2) << 62)), f64::from_bits(c ^ ((quadrant.wrapping_add(1) & 2) << 62)))
}

/// Sines and cosines of the first `n` angles.
#[inline(always)]
pub fn sin_cos<const N: usize>(angles: &[f64], n: usize) -> ([f64; N], [f64; N]) {
    // All N, a constant, so that the compiler makes vectors of them.
    let mut all = [0.0; N];
    all[..n].copy_from_slice(&angles[..n]);
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    for i in 0..N {
        (sines[i], cosines[i]) = one(all[i]);
    }
    let largest = all.iter().fold(0.0f64, |largest, x| if x.abs() > largest { x.abs() } else { largest });
    if largest > LARGEST {
        for i in 0..n {
            if angles[i].abs() > LARGEST {
                (sines[i], cosines[i]) = angles[i].sin_cos();
            }
        }
    }
    (sines, cosines)
}

#[cfg(test)]
mod tests {
    use super::sin_cos;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_the_standard_library(x in prop_oneof![-8.0..8.0f64, -1e6..1e6f64, any::<f64>()]) {
            let ([s], [c]) = sin_cos::<1>(&[x], 1);
            let (sine, cosine) = x.sin_cos();
            let close = |a: f64, b: f64| (a.is_nan() && b.is_nan()) || (a - b).abs() <= 4.5e-16 * b.abs().max(1e-3);
            prop_assert!(close(s, sine) && close(c, cosine), "{x}: {s} {sine} {c} {cosine}");
        }

        #[test]
        fn keeps_relative_accuracy_near_multiples_of_a_right_angle(k in -1000i32..1000, offset in -1e-6..1e-6f64) {
            let x = f64::from(k) * std::f64::consts::FRAC_PI_2 + offset;
            let ([s], [c]) = sin_cos::<1>(&[x], 1);
            let (sine, cosine) = x.sin_cos();
            prop_assert!((s - sine).abs() <= 4e-16 * sine.abs() && (c - cosine).abs() <= 4e-16 * cosine.abs(), "{x}");
        }
    }
}
