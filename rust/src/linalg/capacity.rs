//! Capacities: kernels hold their numbers in arrays of 6, 8 or 16 joints, the smallest that a robot fits.

/// A matrix of at most six rows, one column a joint, by rows.
pub type Rows6<const C: usize, T = f64> = [[T; C]; 6];

/// The number of joints in use, a compile-time constant for the commonest capacity, so that loops unroll. Inner loops run over the whole
/// capacity, whose entries beyond the joints are zero: whole vectors cost less than ragged ones.
#[inline(always)]
pub(crate) const fn size<const C: usize>(n: usize) -> usize {
    if C == 6 { C } else { n }
}

/// Calls `$function::<C>(args)` with the capacity that fits `$n` joints.
#[cfg_attr(feature = "internals", macro_export, doc(hidden))]
macro_rules! with_capacity {
    ($n:expr, $function:ident ( $($argument:expr),* $(,)? )) => {
        match $n {
            6 => $function::<6>($($argument),*),
            0..=8 => $function::<8>($($argument),*),
            _ => $function::<{ $crate::linalg::MAX_JOINTS }>($($argument),*),
        }
    };
}
pub(crate) use with_capacity;
