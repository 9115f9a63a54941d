//! Small dense linear algebra on the stack: nothing here allocates, loops without bound or knows a robot.
//!
//! The sizes of this field (6 rows, at most [`MAX_JOINTS`] columns) are too small for a general library's blocking, and the number of
//! joints is known only at run time; `benches/linalg.rs` measures these routines beside nalgebra and faer.

pub mod banded;
pub mod cholesky;
pub mod frame;
pub mod householder;
mod jacobi;
pub mod orthogonal;
pub mod real;
pub mod svd;
pub mod symmetric;
pub mod trig;
pub mod vector;

use real::Real;

/// The largest number of joints of a robot.
pub const MAX_JOINTS: usize = 16;

/// Six numbers, angular part first: a twist [omega; v] or a row of a pseudo-inverse.
pub type Row6<T = f64> = [T; 6];

/// A matrix of at most six by six, by rows.
pub type Mat6<T = f64> = [Row6<T>; 6];

/// A matrix of at most six rows, one column a joint, by rows.
pub type Rows6<const C: usize, T = f64> = [[T; C]; 6];

/// The number of joints in use, a compile-time constant for the commonest capacity, so that loops unroll. Inner loops run over the whole
/// capacity, whose entries beyond the joints are zero: whole vectors cost less than ragged ones.
#[inline(always)]
pub const fn size<const C: usize>(n: usize) -> usize {
    if C == 6 { C } else { n }
}

/// The transpose: one row a joint.
#[inline(always)]
pub fn transposed<const C: usize, T: Real>(a: &Rows6<C, T>, m: usize) -> [Row6<T>; C] {
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
pub fn combined<const C: usize>(columns: &[Row6; C], z: &[f64; C], n: usize) -> Row6 {
    let mut out = [0.0; 6];
    for i in 0..n {
        for r in 0..6 {
            out[r] += z[i] * columns[i][r];
        }
    }
    out
}

/// `a a'`, computed once above the diagonal.
#[inline(always)]
pub fn gram<const C: usize, T: Real>(a: &Rows6<C, T>, m: usize) -> Mat6<T> {
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

/// Calls `$function::<C>(args)` with the capacity that fits `$n` joints.
#[macro_export]
macro_rules! with_capacity {
    ($n:expr, $function:ident ( $($argument:expr),* $(,)? )) => {
        match $n {
            6 => $function::<6>($($argument),*),
            0..=8 => $function::<8>($($argument),*),
            _ => $function::<{ $crate::linalg::MAX_JOINTS }>($($argument),*),
        }
    };
}
