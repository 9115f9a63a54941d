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

/// A matrix of at most six rows, one column a joint, by rows.
pub type Rows6<const C: usize> = [[f64; C]; 6];

/// The number of joints in use, a compile-time constant for the commonest capacity, so that loops unroll. Inner loops run over the whole
/// capacity, whose entries beyond the joints are zero: whole vectors cost less than ragged ones.
#[inline(always)]
pub const fn size<const C: usize>(n: usize) -> usize {
    if C == 6 { C } else { n }
}

/// `a b'` of two matrices of m rows: m x m.
#[inline(always)]
pub fn product_transposed<const C: usize>(a: &Rows6<C>, b: &Rows6<C>, m: usize) -> Mat6 {
    let mut product = [[0.0; 6]; 6];
    for r in 0..m {
        for c in 0..m {
            for i in 0..C {
                product[r][c] += a[r][i] * b[c][i];
            }
        }
    }
    product
}

/// `a a'`, computed once above the diagonal.
#[inline(always)]
pub fn gram<const C: usize>(a: &Rows6<C>, m: usize) -> Mat6 {
    let mut product = [[0.0; 6]; 6];
    for r in 0..m {
        for c in r..m {
            let mut sum = 0.0;
            for i in 0..C {
                sum += a[r][i] * a[c][i];
            }
            product[r][c] = sum;
            product[c][r] = sum;
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
            0..=4 => $function::<4>($($argument),*),
            5..=8 => $function::<8>($($argument),*),
            9..=12 => $function::<12>($($argument),*),
            _ => $function::<{ $crate::linalg::MAX_JOINTS }>($($argument),*),
        }
    };
}
