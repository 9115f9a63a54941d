//! Whole turns of joints along a path.

use std::f64::consts::{PI, TAU};

use crate::robot::{AT_LIMIT, Limits};

/// Makes wide joints continuous: each posture by whole turns next to the one before.
pub fn unwind(q: &mut [f64], n: usize, wide: &[bool]) {
    for row in 1..q.len() / n {
        for k in (0..n).filter(|&k| wide[k]) {
            let before = q[(row - 1) * n + k];
            let x = &mut q[row * n + k];
            *x -= TAU * ((*x - before) / TAU).round();
        }
    }
}

/// Shifts every wide joint by the whole turns that bring all of its path within its limits, nearest to their middle. The first joint for
/// which no turn does is the error.
pub fn within_limits(q: &mut [f64], n: usize, wide: &[bool], limits: &Limits) -> Result<(), usize> {
    for k in (0..n).filter(|&k| wide[k]) {
        let column = || q.iter().skip(k).step_by(n).copied();
        let (low, high) = column().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let middle = limits.middle_and_half(k).map_or(0.0, |(middle, _)| middle);
        let least = ((limits.q_min[k] - AT_LIMIT - low) / TAU).ceil();
        let most = ((limits.q_max[k] + AT_LIMIT - high) / TAU).floor();
        if least > most {
            return Err(k);
        }
        let shift = TAU * ((middle - 0.5 * (low + high)) / TAU).round().max(least).min(most);
        q.iter_mut().skip(k).step_by(n).for_each(|x| *x = (*x + shift).max(limits.q_min[k]).min(limits.q_max[k]));
    }
    Ok(())
}

/// Shifts every wide joint by the whole turns that bring it to what is held in some rows. The first joint for which no turn does, or takes the rest beyond
/// limits, is the error.
pub fn through(q: &mut [f64], n: usize, wide: &[bool], limits: &Limits, held: &[(usize, &[f64])]) -> Result<(), usize> {
    let Some((first, there)) = held.first() else { return Ok(()) };
    for k in (0..n).filter(|&k| wide[k]) {
        let shift = TAU * ((there[k] - q[first * n + k]) / TAU).round();
        q.iter_mut().skip(k).step_by(n).for_each(|x| *x += shift);
        let apart = held.iter().any(|(row, there)| (there[k] - q[row * n + k]).abs() > PI);
        if apart || q.iter().skip(k).step_by(n).any(|x| !limits.admit(k, *x)) {
            return Err(k);
        }
        q.iter_mut().skip(k).step_by(n).for_each(|x| *x = x.max(limits.q_min[k]).min(limits.q_max[k]));
    }
    Ok(())
}
