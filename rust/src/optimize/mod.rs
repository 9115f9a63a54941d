//! Optimisation that knows no robot: trust-region Newton, BFGS with a strong Wolfe line search, a small dense QP.

mod bfgs;
mod direct_update;
mod line_search;
pub mod qp;
mod trust_region;

pub use bfgs::bfgs;
pub use direct_update::direct_update;
pub use line_search::{LineSearch, strong_wolfe};
use nalgebra::{DMatrix, DVector};
pub use trust_region::trust_region_newton;

/// A twice differentiable function. Outside its domain the value is infinite or NaN.
pub trait Smooth {
    /// Value and gradient.
    fn gradient(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>);
    /// Value, gradient and Hessian.
    fn hessian(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>);
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Largest component of a step that counts as none.
    pub step: f64,
    /// Number of iterations.
    pub iterations: usize,
}

/// How a minimisation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The steps became smaller than asked.
    Converged,
    /// Rounding forbids further decrease, or the line search found none.
    Stalled,
    /// Out of iterations.
    Iterations,
    /// The start is outside the domain.
    Undefined,
}

/// The best point found.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// Where.
    pub x: DVector<f64>,
    /// Value there.
    pub value: f64,
    /// Steps taken or refused.
    pub iterations: usize,
    /// Evaluations of the function, with whatever derivatives.
    pub evaluations: usize,
    /// How it ended.
    pub outcome: Outcome,
}
