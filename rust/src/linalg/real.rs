//! What the kernels compute with: one number, or the same number of several postures side by side.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, Neg, Sub, SubAssign};

use super::trig;

/// A number of a kernel. Each lane goes through the same operations in the same order as a lone `f64`, so a batch answers bit for bit what
/// single calls answer.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + DivAssign
{
    /// How many numbers lie side by side.
    const LANES: usize;
    /// Zero in every lane.
    const ZERO: Self;

    /// The same number in every lane.
    fn splat(x: f64) -> Self;

    /// Lane by lane from a function.
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self;

    /// One lane.
    fn lane(self, i: usize) -> f64;

    /// Square root.
    fn sqrt(self) -> Self;

    /// Whether a < b in any lane.
    fn any_less(a: Self, b: Self) -> bool;

    /// The number in the lanes where a < b, zero in the others.
    fn where_less(self, a: Self, b: Self) -> Self;

    /// `x` in the lanes where a < b, `y` in the others.
    fn pick(a: Self, b: Self, x: Self, y: Self) -> Self;

    /// Sines and cosines of the first `n` angles.
    fn sin_cos<const C: usize>(angles: &[Self], n: usize) -> ([Self; C], [Self; C]);
}

impl Real for f64 {
    const LANES: usize = 1;
    const ZERO: Self = 0.0;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn from_lanes(mut lane: impl FnMut(usize) -> f64) -> Self {
        lane(0)
    }

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn any_less(a: Self, b: Self) -> bool {
        a < b
    }

    #[inline(always)]
    fn where_less(self, a: Self, b: Self) -> Self {
        if a < b { self } else { 0.0 }
    }

    #[inline(always)]
    fn pick(a: Self, b: Self, x: Self, y: Self) -> Self {
        if a < b { x } else { y }
    }

    #[inline(always)]
    fn sin_cos<const C: usize>(angles: &[Self], n: usize) -> ([Self; C], [Self; C]) {
        trig::sin_cos(angles, n)
    }
}

/// How many postures fit a vector register of the machines of the last ten years.
const WIDTH: usize = 4;

/// Numbers of [`WIDTH`] postures; the compiler keeps them in one register where the machine has one wide enough, in two elsewhere.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub struct Lanes([f64; WIDTH]);

macro_rules! lane_wise {
    ($($trait:ident $method:ident $assign:ident $assign_method:ident $op:tt),*) => {
        $(
            impl $trait for Lanes {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    Self(std::array::from_fn(|i| self.0[i] $op other.0[i]))
                }
            }
            impl $assign for Lanes {
                #[inline(always)]
                fn $assign_method(&mut self, other: Self) {
                    *self = *self $op other;
                }
            }
        )*
    };
}

lane_wise!(Add add AddAssign add_assign +, Sub sub SubAssign sub_assign -, Div div DivAssign div_assign /);

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl Real for Lanes {
    const LANES: usize = WIDTH;
    const ZERO: Self = Self([0.0; WIDTH]);

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; WIDTH])
    }

    #[inline(always)]
    fn from_lanes(lane: impl FnMut(usize) -> f64) -> Self {
        Self(std::array::from_fn(lane))
    }

    #[inline(always)]
    fn lane(self, i: usize) -> f64 {
        self.0[i]
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn any_less(a: Self, b: Self) -> bool {
        (0..WIDTH).any(|i| a.0[i] < b.0[i])
    }

    #[inline(always)]
    fn where_less(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| if a.0[i] < b.0[i] { self.0[i] } else { 0.0 }))
    }

    #[inline(always)]
    fn pick(a: Self, b: Self, x: Self, y: Self) -> Self {
        Self(std::array::from_fn(|i| if a.0[i] < b.0[i] { x.0[i] } else { y.0[i] }))
    }

    #[inline(always)]
    fn sin_cos<const C: usize>(angles: &[Self], n: usize) -> ([Self; C], [Self; C]) {
        let (mut sines, mut cosines) = ([Self::ZERO; C], [Self::ZERO; C]);
        for i in 0..n {
            let (s, c) = trig::sin_cos::<WIDTH>(&angles[i].0, WIDTH);
            (sines[i], cosines[i]) = (Self(s), Self(c));
        }
        (sines, cosines)
    }
}
