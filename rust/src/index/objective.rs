//! Weighted sums of indices.

use std::sync::Arc;

use super::custom::CustomIndex;
use super::evaluate::{Evaluation, Order, Status};
use super::joint_limits::{JointLimits, LimitBarrier};
use super::kinds::{Kind, OfJacobian};
use super::rows::Rows;
use crate::error::{Error, Result, check_length};
use crate::kinematics::sized::{Jacobian, jacobian};
use crate::linalg::MAX_JOINTS;
use crate::linalg::with_capacity;
use crate::robot::Robot;

/// Any index of this room.
#[derive(Debug, Clone)]
pub enum Index {
    /// Made of the Jacobian.
    OfJacobian(OfJacobian),
    /// Distance to the middle of the ranges.
    JointLimits(JointLimits),
    /// Barrier at the limits.
    LimitBarrier(LimitBarrier),
    /// The user's own.
    Custom(Arc<dyn CustomIndex>),
}

impl Index {
    /// An index made of the Jacobian.
    pub fn of(kind: Kind, rows: Rows, squared: bool) -> Self {
        Self::OfJacobian(OfJacobian { kind, rows, squared })
    }

    /// The names of all indices, and whether each is made of the Jacobian.
    pub fn names() -> impl Iterator<Item = (&'static str, bool)> {
        let of_jacobian = Kind::ALL.iter().map(|kind| (kind.name(), true));
        of_jacobian.chain([(JointLimits::NAME, false), (LimitBarrier::NAME, false)])
    }

    /// An index by its name; those of the joints' limits have neither rows nor square, and weigh every joint alike.
    pub fn named(name: &str, rows: Rows, squared: bool) -> Result<Self> {
        match Kind::ALL.iter().find(|kind| kind.name() == name) {
            Some(kind) => Ok(Self::of(*kind, rows, squared)),
            None if name == JointLimits::NAME => Ok(Self::JointLimits(JointLimits::new(&[])?)),
            None if name == LimitBarrier::NAME => Ok(Self::LimitBarrier(LimitBarrier::new(&[])?)),
            None => {
                let known: Vec<&str> = Self::names().map(|(name, _)| name).collect();
                Err(Error::value("name", format!("{name:?}"), &format!("one of {}", known.join(", "))))
            }
        }
    }

    /// Its name in job files, where squares are told apart by what follows it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::OfJacobian(index) => index.kind.name(),
            Self::JointLimits(_) => JointLimits::NAME,
            Self::LimitBarrier(_) => LimitBarrier::NAME,
            Self::Custom(_) => "custom",
        }
    }

    fn rows(&self) -> Option<&Rows> {
        match self {
            Self::OfJacobian(index) => Some(&index.rows),
            _ => None,
        }
    }

    /// The same index with another length; unchanged when it has none.
    pub fn with_length(&self, length: f64) -> Self {
        match self {
            Self::OfJacobian(index) => Self::OfJacobian(OfJacobian { rows: index.rows.with_length(length), ..*index }),
            other => other.clone(),
        }
    }

    /// Checks that weights of joints fit the robot and rows do not outnumber its joints.
    fn check(&self, robot: &Robot) -> Result<()> {
        let n = robot.n();
        let weights = match self {
            Self::OfJacobian(OfJacobian { rows, .. }) if rows.count() > n => {
                return Err(Error::value("rows", format!("{:?}", rows.indices()), &format!("at most {n} rows, the number of joints")));
            }
            Self::JointLimits(index) => index.weights(),
            Self::LimitBarrier(index) => index.weights(),
            Self::OfJacobian(_) | Self::Custom(_) => &[],
        };
        if weights.is_empty() { Ok(()) } else { check_length("weights", weights, n) }
    }

    /// Value and derivatives, into a zeroed `out`.
    #[inline(always)]
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
            Self::OfJacobian(index) => index.evaluate(jacobian, order, with_length, out),
            Self::JointLimits(index) => *out = index.evaluate(robot.limits(), q, order),
            Self::LimitBarrier(index) => *out = index.evaluate(robot.limits(), q, order),
            Self::Custom(index) => *out = index.evaluate(q, order).resized(q.len()),
        }
    }
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
        self.terms.iter().try_for_each(|(_, index)| index.check(robot))
    }

    #[inline(always)]
    fn check_at(&self, robot: &Robot, q: &[f64]) -> Result<()> {
        check_length("q", q, robot.n())?;
        self.check(robot)
    }

    /// Value and derivatives at a posture, with those in the length if wanted; indices without a length do not change with it.
    pub fn evaluate(&self, robot: &Robot, q: &[f64], order: Order, with_length: bool) -> Result<Evaluation<MAX_JOINTS>> {
        fn kernel<const C: usize>(
            objective: &Objective,
            robot: &Robot,
            q: &[f64],
            order: Order,
            with_length: bool,
        ) -> Evaluation<MAX_JOINTS> {
            objective.evaluate_sized::<C>(robot, q, order, with_length).resized(q.len())
        }
        self.check_at(robot, q)?;
        Ok(with_capacity!(q.len(), kernel(self, robot, q, order, with_length)))
    }

    /// The value and how far it can be used; writes the gradient (n) and the Hessian (n, n), with the length as entry n where `with_length`.
    /// Derivatives that are not wanted are empty.
    pub fn evaluate_into(
        &self,
        robot: &Robot,
        q: &[f64],
        with_length: bool,
        gradient: &mut [f64],
        hessian: &mut [f64],
    ) -> Result<(f64, Status)> {
        fn kernel<const C: usize>(
            objective: &Objective,
            robot: &Robot,
            q: &[f64],
            with_length: bool,
            gradient: &mut [f64],
            hessian: &mut [f64],
        ) -> (f64, Status) {
            let got = objective.evaluate_sized::<C>(robot, q, Order::wanted(gradient, hessian), with_length);
            got.write(q.len(), with_length, gradient, hessian);
            (got.value, got.status)
        }
        self.check_at(robot, q)?;
        let size = q.len() + usize::from(with_length);
        if !gradient.is_empty() {
            check_length("gradient", gradient, size)?;
        }
        if !hessian.is_empty() {
            check_length("hessian", hessian, size * size)?;
        }
        Ok(with_capacity!(q.len(), kernel(self, robot, q, with_length, gradient, hessian)))
    }

    /// The value at a posture.
    pub fn value(&self, robot: &Robot, q: &[f64]) -> Result<f64> {
        Ok(self.evaluate_into(robot, q, false, &mut [], &mut [])?.0)
    }

    /// Value and derivatives at a posture whose Jacobian is known.
    #[inline(never)]
    pub(crate) fn evaluate_at<const C: usize>(
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

    /// The value at a posture.
    #[inline(never)]
    pub(crate) fn value_sized<const C: usize>(&self, robot: &Robot, q: &[f64]) -> f64 {
        self.evaluate_sized::<C>(robot, q, Order::Value, false).value
    }

    /// Value and derivatives at a posture.
    #[inline(always)]
    pub(crate) fn evaluate_sized<const C: usize>(&self, robot: &Robot, q: &[f64], order: Order, with_length: bool) -> Evaluation<C> {
        let (_, columns) = jacobian::<C>(robot, q);
        self.evaluate_at(robot, q, &columns, order, with_length)
    }
}
