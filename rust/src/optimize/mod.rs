//! Optimisation that knows no robot: trust-region Newton, BFGS with a strong Wolfe line search.
//!
//! The house has two systems of vectors, on purpose. Problems of this room are dense and of a size known at run time alone (a posture with its
//! length, a whole design): their vectors are nalgebra's, on the heap. What a control tick solves is in [`crate::qp`] and [`crate::linalg`]: arrays
//! on the stack, nothing allocated.
//!
//! ```
//! use nalgebra::{DMatrix, DVector};
//! use redundancy::optimize::{Outcome, Smooth, Stop, trust_region_newton};
//!
//! fn one(x: f64) -> DVector<f64> {
//!     DVector::from_element(1, x)
//! }
//!
//! /// (x - 1)^4 + (x - 1)^2
//! struct Bowl;
//!
//! impl Smooth for Bowl {
//!     fn gradient(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>) {
//!         let (value, gradient, _) = self.hessian(x);
//!         (value, gradient)
//!     }
//!     fn hessian(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
//!         let d = x[0] - 1.0;
//!         (d.powi(4) + d * d, one(4.0 * d.powi(3) + 2.0 * d), DMatrix::from_element(1, 1, 12.0 * d * d + 2.0))
//!     }
//! }
//!
//! let found = trust_region_newton(&mut Bowl, one(5.0), Stop { step: 1e-10, iterations: 100 });
//! assert_eq!(found.outcome, Outcome::Converged);
//! assert!((found.x[0] - 1.0).abs() < 1e-12);
//! ```

mod bfgs;
mod line_search;
mod trust_region;

pub use bfgs::bfgs;
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

/// A point that a minimisation went through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// Evaluations of the function up to here.
    pub evaluations: usize,
    /// Value.
    pub value: f64,
    /// Norm of the gradient.
    pub gradient: f64,
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
    /// The start and every point that a step was taken to. Newton's last step, too short to change the value, is taken without an evaluation
    /// and is not among them.
    pub history: Vec<Passed>,
}

impl Minimum {
    /// Nothing but a start, evaluated once.
    fn at(x: DVector<f64>, value: f64, gradient: &DVector<f64>) -> Self {
        let outcome = if value.is_finite() { Outcome::Iterations } else { Outcome::Undefined };
        let mut start = Self { x, value, iterations: 0, evaluations: 1, outcome, history: Vec::new() };
        start.pass(gradient);
        start
    }

    /// Puts down the point reached.
    fn pass(&mut self, gradient: &DVector<f64>) {
        self.history.push(Passed { evaluations: self.evaluations, value: self.value, gradient: gradient.norm() });
    }
}
