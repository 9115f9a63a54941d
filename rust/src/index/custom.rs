//! Indices written by the user.

use std::fmt::Debug;

use super::differences;
use super::evaluate::{Evaluation, Order};
use crate::linalg::MAX_JOINTS;

/// Step of the central differences that stand in for a gradient: the cube root of the rounding.
const GRADIENT_STEP: f64 = 6e-6;
/// Step of the second differences of values: the fourth root.
const HESSIAN_STEP: f64 = 1.2e-4;

/// An index written by the user.
pub trait CustomIndex: Send + Sync + Debug {
    /// Value and derivatives at `q`; NaN where it cannot be evaluated. Entries beyond the joints are zero.
    fn evaluate(&self, q: &[f64], order: Order) -> Evaluation<MAX_JOINTS>;
}

/// What a function of the posture says of itself.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// Value.
    pub value: f64,
    /// d/dq, n numbers.
    pub gradient: Option<Vec<f64>>,
    /// d2/dq2 by rows, n x n numbers.
    pub hessian: Option<Vec<f64>>,
}

impl Given {
    /// The gradient, if it gives one.
    fn gradient(&self) -> Option<[f64; MAX_JOINTS]> {
        let given = self.gradient.as_ref()?;
        let mut out = [0.0; MAX_JOINTS];
        out.iter_mut().zip(given).for_each(|(slot, x)| *slot = *x);
        Some(out)
    }
}

/// The gradient of a function at `q`, its own if it gives one there.
fn gradient<E>(
    q: &[f64],
    own: Option<[f64; MAX_JOINTS]>,
    function: &mut impl FnMut(&[f64]) -> Result<Given, E>,
) -> Result<[f64; MAX_JOINTS], E> {
    let Some(own) = own else {
        let mut out = [0.0; MAX_JOINTS];
        differences::gradient(q, GRADIENT_STEP, |q| Ok(function(q)?.value), &mut out)?;
        return Ok(out);
    };
    Ok(own)
}

/// Value and derivatives of a function of at most [`MAX_JOINTS`] joints: what it does not give is taken by central differences. A failure
/// of the function ends it.
pub fn completed<E>(q: &[f64], order: Order, mut function: impl FnMut(&[f64]) -> Result<Given, E>) -> Result<Evaluation<MAX_JOINTS>, E> {
    let q = &q[..q.len().min(MAX_JOINTS)];
    let given = function(q)?;
    let mut out = Evaluation::zero();
    out.value = given.value;
    let own = given.gradient();
    if order >= Order::Gradient {
        out.gradient = gradient(q, own, &mut function)?;
    }
    if order < Order::Hessian {
        return Ok(out);
    }
    match (given.hessian, own) {
        (Some(hessian), _) => {
            for (row, given) in out.hessian.iter_mut().zip(hessian.chunks(q.len().max(1))) {
                row.iter_mut().zip(given).for_each(|(slot, x)| *slot = *x);
            }
        }
        (None, Some(_)) => {
            let at = |q: &[f64]| {
                let own = function(q)?.gradient();
                gradient(q, own, &mut function)
            };
            differences::hessian_of_gradients(q, GRADIENT_STEP, at, &mut out.hessian)?;
        }
        (None, None) => differences::hessian(q, HESSIAN_STEP, |q| Ok(function(q)?.value), &mut out.hessian)?,
    }
    Ok(out)
}
