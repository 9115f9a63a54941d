//! Small dense linear algebra on the stack: nothing here allocates, loops without bound or knows a robot.
//!
//! The sizes of this field (6 rows, at most [`MAX_JOINTS`] columns) are too small for a general library's blocking, and the number of
//! joints is known only at run time: kernels are compiled for a few capacities, and a room's door chooses the one that fits.
//! `benches/linalg.rs` measures these routines beside nalgebra and faer. Open to users are [`vector`]s, [`frame`]s and [`quaternion`]s, whose sizes are in
//! their types:
//!
//! ```
//! use redundancy::linalg::frame::Frame;
//! use redundancy::linalg::vector::{norm, sub};
//!
//! let turned = Frame::rotation([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2).compose(&Frame::translation([1.0, 0.0, 0.0]));
//! assert!(norm(sub(turned.origin, [0.0, 1.0, 0.0])) < 1e-15);
//! ```

pub(crate) mod banded;
pub(crate) mod capacity;
pub(crate) mod cholesky;
pub(crate) mod complex;
pub(crate) mod damped;
pub mod frame;
pub(crate) mod householder;
mod jacobi;
pub(crate) mod left_null;
pub(crate) mod lu;
pub(crate) mod orthogonal;
pub mod quaternion;
pub(crate) mod random;
pub(crate) mod real;
pub(crate) mod svd;
pub(crate) mod symmetric;
pub(crate) mod trig;
pub mod vector;

pub(crate) use capacity::{Rows6, size, with_capacity};

use real::Real;

/// The largest number of joints of a robot.
pub const MAX_JOINTS: usize = 16;

/// Six numbers, angular part first: a twist [omega; v] or a row of a pseudo-inverse.
pub type Row6<T = f64> = [T; 6];

/// A matrix of at most six by six, by rows.
pub type Mat6<T = f64> = [Row6<T>; 6];

/// The transpose: one row a joint.
#[inline(always)]
pub(crate) fn transposed<const C: usize, T: Real>(a: &Rows6<C, T>, m: usize) -> [Row6<T>; C] {
    let mut out = [[T::ZERO; 6]; C];
    for r in 0..m {
        for i in 0..C {
            out[i][r] = a[r][i];
        }
    }
    out
}

/// Columns weighted by the first `n` entries of `z` and added.
#[inline(always)]
pub(crate) fn combined<const C: usize>(columns: &[Row6; C], z: &[f64; C], n: usize) -> Row6 {
    let mut out = [0.0; 6];
    for i in 0..n {
        for r in 0..6 {
            out[r] += z[i] * columns[i][r];
        }
    }
    out
}

/// `a a'`, computed once above the diagonal. Of one matrix apart: the compiler makes better vectors of its products than among others.
#[inline(always)]
pub(crate) fn gram<const C: usize, T: Real>(a: &Rows6<C, T>, m: usize) -> Mat6<T> {
    if T::LANES == 1 { gram_apart(a, m) } else { gram_here(a, m) }
}

#[inline(never)]
fn gram_apart<const C: usize, T: Real>(a: &Rows6<C, T>, m: usize) -> Mat6<T> {
    gram_here(a, m)
}

#[inline(always)]
fn gram_here<const C: usize, T: Real>(a: &Rows6<C, T>, m: usize) -> Mat6<T> {
    let mut product = [[T::ZERO; 6]; 6];
    for r in 0..m {
        for c in r..m {
            let entry = orthogonal::dot(&a[r], &a[c]);
            product[r][c] = entry;
            product[c][r] = entry;
        }
    }
    product
}
