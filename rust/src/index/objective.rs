//! Weighted sums of indices.

use std::fmt::Debug;
use std::sync::Arc;

use super::condition::ConditionNumber;
use super::evaluate::{Evaluation, JacobianIndex, Order};
use super::joint_limits::{JointLimits, LimitBarrier};
use super::manipulability::Manipulability;
use super::spectral::Spectral;
use crate::error::{Error, Result};
use crate::kinematics::{Jacobian, jacobian};
use crate::linalg::MAX_JOINTS;
use crate::robot::Robot;

/// An index written by the user.
pub trait CustomIndex: Send + Sync + Debug {
    /// Value and derivatives at `q`; NaN where it cannot be evaluated.
    fn evaluate(&self, q: &[f64], order: Order) -> Evaluation<MAX_JOINTS>;
}

/// Any index of this room.
#[derive(Debug, Clone)]
pub enum Index {
    /// kappa_F.
    Condition(ConditionNumber),
    /// kappa_2, sigma_m, w_ps.
    Spectral(Spectral),
    /// w.
    Manipulability(Manipulability),
    /// Distance to the middle of the ranges.
    JointLimits(JointLimits),
    /// Barrier at the limits.
    LimitBarrier(LimitBarrier),
    /// The user's own.
    Custom(Arc<dyn CustomIndex>),
}

impl Index {
    fn rows(&self) -> Option<&super::Rows> {
        match self {
            Self::Condition(index) => Some(&index.rows),
            Self::Spectral(index) => Some(&index.rows),
            Self::Manipulability(index) => Some(&index.rows),
            Self::JointLimits(_) | Self::LimitBarrier(_) | Self::Custom(_) => None,
        }
    }

    /// The same index with another length; unchanged when it has none.
    pub fn with_length(&self, length: f64) -> Self {
        let mut out = self.clone();
        match &mut out {
            Self::Condition(index) => index.rows.length = length,
            Self::Spectral(index) => index.rows.length = length,
            Self::Manipulability(index) => index.rows.length = length,
            Self::JointLimits(_) | Self::LimitBarrier(_) | Self::Custom(_) => {}
        }
        out
    }

    /// Value and derivatives, into a zeroed `out`.
    #[inline(never)]
    fn evaluate<const C: usize>(
        &self,
        robot: &Robot,
        q: &[f64],
        jacobian: &Jacobian<C>,
        order: Order,
        with_length: bool,
        out: &mut Evaluation<C>,
    ) {
        match self {
            Self::Condition(index) => index.evaluate(jacobian, order, with_length, out),
            Self::Spectral(index) => index.evaluate(jacobian, order, with_length, out),
            Self::Manipulability(index) => index.evaluate(jacobian, order, with_length, out),
            Self::JointLimits(index) => *out = index.evaluate(robot.limits(), q, order),
            Self::LimitBarrier(index) => *out = index.evaluate(robot.limits(), q, order),
            Self::Custom(index) => *out = narrow(&index.evaluate(q, order), q.len()),
        }
    }
}

/// From the largest capacity to the one in use.
fn narrow<const C: usize>(wide: &Evaluation<MAX_JOINTS>, n: usize) -> Evaluation<C> {
    let mut out = Evaluation::zero();
    out.value = wide.value;
    out.status = wide.status;
    out.gradient[..n].copy_from_slice(&wide.gradient[..n]);
    for k in 0..n {
        out.hessian[k][..n].copy_from_slice(&wide.hessian[k][..n]);
    }
    out
}

/// `sum weight * index`.
#[derive(Debug, Clone)]
pub struct Objective {
    terms: Vec<(f64, Index)>,
}

impl Objective {
    /// A weighted sum of at least one index, with finite weights.
    pub fn new(terms: Vec<(f64, Index)>) -> Result<Self> {
        if terms.is_empty() {
            return Err(Error::value("terms", "empty", "at least one index"));
        }
        if let Some((weight, _)) = terms.iter().find(|(weight, _)| !weight.is_finite()) {
            return Err(Error::value("weight", weight, "a finite number"));
        }
        Ok(Self { terms })
    }

    /// The terms.
    pub fn terms(&self) -> &[(f64, Index)] {
        &self.terms
    }

    /// The one length of all terms that have one.
    pub fn length(&self) -> Option<f64> {
        let mut lengths = self.terms.iter().filter_map(|(_, index)| index.rows().map(|rows| rows.length));
        let first = lengths.next()?;
        lengths.all(|length| length == first).then_some(first)
    }

    /// The same sum with another length in every term that has one.
    pub fn with_length(&self, length: f64) -> Self {
        Self { terms: self.terms.iter().map(|(weight, index)| (*weight, index.with_length(length))).collect() }
    }

    /// Checks that weights of joints fit the robot and rows do not outnumber its joints.
    pub fn check(&self, robot: &Robot) -> Result<()> {
        let n = robot.n();
        for (_, index) in &self.terms {
            match index {
                Index::JointLimits(JointLimits { .. }) | Index::LimitBarrier(LimitBarrier { .. }) => {
                    let weights = match index {
                        Index::JointLimits(index) => index.weights(),
                        Index::LimitBarrier(index) => index.weights(),
                        _ => &[],
                    };
                    if !weights.is_empty() && weights.len() != n {
                        return Err(Error::length("weights", weights.len(), n));
                    }
                }
                _ => {
                    if let Some(rows) = index.rows().filter(|rows| rows.count() > n) {
                        return Err(Error::value(
                            "rows",
                            format!("{:?}", rows.indices()),
                            &format!("at most {n} rows, the number of joints"),
                        ));
                    }
                }
            }
        }
        Ok(())
    }

    /// Value and derivatives at a posture whose Jacobian is known.
    #[inline(never)]
    pub fn evaluate_at<const C: usize>(
        &self,
        robot: &Robot,
        q: &[f64],
        jacobian: &Jacobian<C>,
        order: Order,
        with_length: bool,
    ) -> Evaluation<C> {
        let mut sum = Evaluation::zero();
        if let [(1.0, only)] = self.terms.as_slice() {
            only.evaluate(robot, q, jacobian, order, with_length, &mut sum);
            return sum;
        }
        for (weight, index) in &self.terms {
            let mut term = Evaluation::zero();
            index.evaluate(robot, q, jacobian, order, with_length, &mut term);
            sum.add(*weight, &term, q.len(), order);
        }
        sum
    }

    /// Value and derivatives at a posture.
    #[inline(always)]
    pub fn evaluate<const C: usize>(&self, robot: &Robot, q: &[f64], order: Order, with_length: bool) -> Evaluation<C> {
        let (_, columns) = jacobian::<C>(robot, q);
        self.evaluate_at(robot, q, &columns, order, with_length)
    }
}
