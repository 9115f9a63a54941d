//! Complex numbers, one or several side by side.

use std::ops::{Add, Mul, Neg, Sub};

use super::real::Real;

/// A complex number.
#[derive(Debug, Clone, Copy)]
pub struct Complex<R = f64> {
    /// Real part.
    pub re: R,
    /// Imaginary part.
    pub im: R,
}

impl<R: Real> Complex<R> {
    /// Zero.
    pub const ZERO: Self = Self { re: R::ZERO, im: R::ZERO };

    /// A real number.
    #[inline(always)]
    pub fn real(re: R) -> Self {
        Self { re, im: R::ZERO }
    }

    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(z: Complex) -> Self {
        Self { re: R::splat(z.re), im: R::splat(z.im) }
    }

    /// Lane by lane from a function.
    #[inline(always)]
    pub fn from_lanes(lane: impl Fn(usize) -> Complex) -> Self {
        Self { re: R::from_lanes(|i| lane(i).re), im: R::from_lanes(|i| lane(i).im) }
    }

    /// One lane.
    #[inline(always)]
    pub fn lane(self, i: usize) -> Complex {
        Complex { re: self.re.lane(i), im: self.im.lane(i) }
    }

    /// Times a real number.
    #[inline(always)]
    pub fn times(self, x: R) -> Self {
        Self { re: self.re * x, im: self.im * x }
    }

    /// The square of the modulus.
    #[inline(always)]
    pub fn square(self) -> R {
        self.re * self.re + self.im * self.im
    }

    /// One over the number.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        let over = R::splat(1.0) / self.square();
        Self { re: self.re * over, im: -(self.im * over) }
    }
}

impl<R: Real> Add for Complex<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl<R: Real> Sub for Complex<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl<R: Real> Mul for Complex<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

impl<R: Real> Neg for Complex<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { re: -self.re, im: -self.im }
    }
}
