//! The worth of an index in a programme: by its curvature (Dufour and Suleiman 2020, eq. 10) or as a relaxed equality (eq. 14).

use super::programme::Cost;
use crate::error::{Error, Result};
use crate::index::sized::{Evaluation, differences};
use crate::index::{Objective, Order};
use crate::kinematics::sized::Jacobian;
use crate::linalg::cholesky::Cholesky;
use crate::linalg::symmetric::positive_part;
use crate::linalg::{MAX_JOINTS, size};
use crate::resolve::direct_update::direct_update;
use crate::robot::Robot;

/// Part of the cost of the rates that has to be left when the curvature of an index has been taken from it.
const LEFT: f64 = 0.5;

/// How an index enters the programme.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IndexForm {
    /// `weight (T g'qd + T^2 qd'H qd / 2)` (eq. 10), with what is not convex in it left out.
    Curvature,
    /// The same as printed: not convex for large weights.
    Printed,
    /// `weight (|value| + T g'qd)^2 / 2` (eq. 14, 16): convex whatever the weight.
    Equality,
}

/// Where derivatives come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Derivatives {
    /// The exact gradient and Hessian.
    Exact,
    /// The exact gradient; the Hessian by the direct BFGS update (eq. 20, corrected).
    Bfgs,
    /// Differences of values with this step [rad or m] (eq. 17, 19).
    Differences(f64),
}

impl Derivatives {
    /// Differences with a step that suits angles and indices about 1: errors of the step and of rounding are of one size.
    pub const DIFFERENCES: Self = Self::Differences(1e-4);

    pub(super) fn check(self) -> Result<()> {
        match self {
            Self::Differences(step) if !(step > 0.0 && step < 1.0) => Err(Error::value("step", step, "a number between 0 and 1")),
            _ => Ok(()),
        }
    }
}

/// What BFGS remembers.
#[derive(Debug, Clone, Copy)]
pub struct IndexMemory {
    known: bool,
    q: [f64; MAX_JOINTS],
    gradient: [f64; MAX_JOINTS],
    hessian: [[f64; MAX_JOINTS]; MAX_JOINTS],
}

impl Default for IndexMemory {
    fn default() -> Self {
        Self { known: false, q: [0.0; MAX_JOINTS], gradient: [0.0; MAX_JOINTS], hessian: [[0.0; MAX_JOINTS]; MAX_JOINTS] }
    }
}

impl IndexMemory {
    /// The direct update with the step from the posture before; nothing is known of the curvature at first.
    fn update<const C: usize>(&mut self, q: &[f64], gradient: &[f64; C]) -> [[f64; C]; C] {
        let n = q.len();
        if self.known {
            let (mut s, mut y) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
            for i in 0..n {
                (s[i], y[i]) = (q[i] - self.q[i], gradient[i] - self.gradient[i]);
            }
            direct_update(&mut self.hessian, &s, &y, n);
        }
        self.known = true;
        self.q[..n].copy_from_slice(q);
        self.gradient[..n].copy_from_slice(&gradient[..n]);
        std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { self.hessian[i][j] } else { 0.0 }))
    }
}

/// An index with its weight.
#[derive(Debug, Clone)]
pub(super) struct IndexTerm {
    pub objective: Objective,
    pub weight: f64,
    pub form: IndexForm,
    pub derivatives: Derivatives,
}

impl IndexTerm {
    /// Adds the term to the cost of the rates; false where the index has no derivatives, as at a singularity.
    pub fn add<const C: usize>(
        &self,
        robot: &Robot,
        q: &[f64],
        jacobian: &Jacobian<C>,
        dt: f64,
        memory: &mut IndexMemory,
        cost: &mut Cost<C>,
    ) -> bool {
        match self.form {
            IndexForm::Equality => self.add_equality(robot, q, jacobian, dt, cost),
            IndexForm::Curvature | IndexForm::Printed => self.add_curvature(robot, q, jacobian, dt, memory, cost),
        }
    }

    #[inline(always)]
    fn add_equality<const C: usize>(&self, robot: &Robot, q: &[f64], jacobian: &Jacobian<C>, dt: f64, cost: &mut Cost<C>) -> bool {
        let (value, gradient) = match self.derivatives {
            Derivatives::Differences(step) => {
                let Evaluation { value, gradient, .. } = differences::<C>(&self.objective, robot, q, Order::Gradient, step);
                (value, gradient)
            }
            Derivatives::Exact | Derivatives::Bfgs => {
                let at = self.objective.evaluate_at(robot, q, jacobian, Order::Gradient, false);
                (at.value, at.gradient)
            }
        };
        let finite = value.is_finite() && gradient[..size::<C>(robot.n())].iter().all(|x| x.is_finite());
        if finite {
            cost.add_square(self.weight, &gradient.map(|g| dt * g), value.abs());
        }
        finite
    }

    #[inline(never)]
    fn add_curvature<const C: usize>(
        &self,
        robot: &Robot,
        q: &[f64],
        jacobian: &Jacobian<C>,
        dt: f64,
        memory: &mut IndexMemory,
        cost: &mut Cost<C>,
    ) -> bool {
        let n = size::<C>(robot.n());
        let (value, gradient, hessian) = match self.derivatives {
            Derivatives::Differences(step) => {
                let Evaluation { value, gradient, hessian, .. } = differences::<C>(&self.objective, robot, q, Order::Hessian, step);
                (value, gradient, hessian)
            }
            Derivatives::Bfgs => {
                let at = self.objective.evaluate_at(robot, q, jacobian, Order::Gradient, false);
                (at.value, at.gradient, memory.update(q, &at.gradient))
            }
            Derivatives::Exact => {
                let at = self.objective.evaluate_at(robot, q, jacobian, Order::Hessian, false);
                (at.value, at.gradient, at.hessian)
            }
        };
        let finite = value.is_finite() && gradient[..n].iter().chain(hessian[..n].as_flattened()).all(|x| x.is_finite());
        if !finite {
            return false;
        }
        let curvature = hessian.map(|row| row.map(|x| self.weight * dt * dt * x));
        let kept = if self.form == IndexForm::Printed { curvature } else { convex_part(cost, curvature, n) };
        for i in 0..n {
            cost.g[i] += self.weight * dt * gradient[i];
            for j in 0..n {
                cost.h[i][j] += kept[i][j];
            }
        }
        true
    }
}

/// The curvature itself where enough of the cost of the rates is left beside it, else what is convex of it.
fn convex_part<const C: usize>(rates: &Cost<C>, curvature: [[f64; C]; C], n: usize) -> [[f64; C]; C] {
    let mut left = curvature;
    for i in 0..n {
        for j in 0..n {
            left[i][j] += LEFT * rates.h[i][j];
        }
    }
    if Cholesky::<C>::new(&left, n).is_some() { curvature } else { positive_part(curvature, n) }
}
