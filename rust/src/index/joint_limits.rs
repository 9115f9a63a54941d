//! Indices of the joints alone: distance to the middle of the ranges (Huo 2009, eq. 4.1) and a barrier at the limits.

use super::evaluate::{Evaluation, Order, Status};
use crate::error::{Error, Result};
use crate::robot::Limits;

/// Weights of the joints: one for each, or 1.
fn weight(weights: &[f64], i: usize) -> f64 {
    weights.get(i).copied().unwrap_or(1.0)
}

fn check_weights(weights: &[f64]) -> Result<()> {
    match weights.iter().position(|w| !(*w >= 0.0 && w.is_finite())) {
        Some(i) => Err(Error::value(&format!("weights[{i}]"), weights[i], "a finite number of at least 0")),
        None => Ok(()),
    }
}

/// `1/2 sum w_i ((q_i - middle_i) / half_i)^2` over the joints that have both limits: 1/2 for each joint at a limit, 0 in the middle.
#[derive(Debug, Clone, PartialEq)]
pub struct JointLimits {
    weights: Vec<f64>,
}

impl JointLimits {
    /// Its name in job files.
    pub const NAME: &str = "joint_limits";

    /// With one weight a joint, or an empty list for ones.
    pub fn new(weights: &[f64]) -> Result<Self> {
        check_weights(weights)?;
        Ok(Self { weights: weights.to_vec() })
    }

    /// The weights given.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Value, gradient and (diagonal) Hessian.
    #[inline]
    pub(super) fn evaluate<const C: usize>(&self, limits: &Limits, q: &[f64], order: Order) -> Evaluation<C> {
        let mut out = Evaluation::zero();
        for i in 0..q.len() {
            let Some((middle, half)) = limits.middle_and_half(i) else { continue };
            let w = weight(&self.weights, i);
            let offset = (q[i] - middle) / half;
            out.value += 0.5 * w * offset * offset;
            if order >= Order::Gradient {
                out.gradient[i] = w * offset / half;
                out.hessian[i][i] = w / (half * half);
            }
        }
        out
    }
}

/// `- sum w_i ln(4 (q_max - q)(q - q_min) / range^2)`: 0 in the middle, infinite at a limit; one-sided limits are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitBarrier {
    weights: Vec<f64>,
}

impl LimitBarrier {
    /// Its name in job files.
    pub const NAME: &str = "limit_barrier";

    /// With one weight a joint, or an empty list for ones.
    pub fn new(weights: &[f64]) -> Result<Self> {
        check_weights(weights)?;
        Ok(Self { weights: weights.to_vec() })
    }

    /// The weights given.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Value, gradient and (diagonal) Hessian; infinite with NaN derivatives on or beyond a limit.
    #[inline]
    pub(super) fn evaluate<const C: usize>(&self, limits: &Limits, q: &[f64], order: Order) -> Evaluation<C> {
        let mut out = Evaluation::zero();
        for i in 0..q.len() {
            let Some((_, half)) = limits.middle_and_half(i) else { continue };
            let w = weight(&self.weights, i);
            let (above, below) = (q[i] - limits.q_min[i], limits.q_max[i] - q[i]);
            if w == 0.0 {
                continue;
            }
            if above <= 0.0 || below <= 0.0 {
                return Evaluation::without_derivatives(f64::INFINITY, Status::OutsideLimits);
            }
            out.value -= w * (above / half * (below / half)).ln();
            if order >= Order::Gradient {
                out.gradient[i] = w * (1.0 / below - 1.0 / above);
                out.hessian[i][i] = w * (1.0 / (below * below) + 1.0 / (above * above));
            }
        }
        out
    }
}
