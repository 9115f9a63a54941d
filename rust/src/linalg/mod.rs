//! Small dense linear algebra on the stack: nothing here allocates, loops without bound or knows a robot.
//!
//! The sizes of this field (6 rows, at most [`MAX_JOINTS`] columns) are too small for a general library's blocking, and the number of
//! joints is known only at run time; `benches/linalg.rs` measures these routines beside nalgebra and faer.

pub mod cholesky;
pub mod frame;
pub mod orthogonal;
pub mod svd;
pub mod symmetric;
pub mod trig;
pub mod vector;

/// The largest number of joints of a robot.
pub const MAX_JOINTS: usize = 16;

/// Six numbers, angular part first: a twist [omega; v] or a row of a pseudo-inverse.
pub type Row6 = [f64; 6];

/// A matrix of at most six by six, by rows.
pub type Mat6 = [Row6; 6];

/// The number of columns in use: a compile-time constant for the specialised capacities, so that loops unroll.
#[inline(always)]
pub const fn size<const C: usize>(n: usize) -> usize {
    if C < MAX_JOINTS { C } else { n }
}

/// `a' b` of two n x m matrices stored by rows: m x m.
#[inline(always)]
pub fn gram<const C: usize>(a: &[Row6; C], b: &[Row6; C], n: usize, m: usize) -> Mat6 {
    let mut product = [[0.0; 6]; 6];
    for i in 0..size::<C>(n) {
        for r in 0..m {
            for c in 0..m {
                product[r][c] += a[i][r] * b[i][c];
            }
        }
    }
    product
}

/// Calls `$function::<C>(args)` with the capacity that fits `$n` joints: exact for the common robots, [`MAX_JOINTS`] otherwise.
#[macro_export]
macro_rules! with_capacity {
    ($n:expr, $function:ident ( $($argument:expr),* $(,)? )) => {
        match $n {
            6 => $function::<6>($($argument),*),
            7 => $function::<7>($($argument),*),
            _ => $function::<{ $crate::linalg::MAX_JOINTS }>($($argument),*),
        }
    };
}
