//! A plan put together from its parts, and what is wrong with it.

use std::f64::consts::TAU;

use super::failure::{FailureCause, PlanFailure};
use super::hooks::{Hooks, PlanError};
use super::lattice::Cause;
use super::layers::Layers;
use super::part::Part;
use super::problem::{ON_PATH, PathProblem};
use super::transfer::Transfer;
use crate::resolve::SolveStatus;

/// A path planned as a whole.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Postures, n joints a row and one row a point; points that are not reached hold the posture of the nearest point that is.
    pub q: Vec<f64>,
    /// Values of the objective, NaN where a point is not reached.
    pub value: Vec<f64>,
    /// Distances of the tool point to the path \[m\].
    pub position_error: Vec<f64>,
    /// Angles to the axis, or the orientation, of the path \[rad\].
    pub axis_error: Vec<f64>,
    /// How every point is reached.
    pub status: Vec<SolveStatus>,
    /// Length that made the objective homogeneous \[m\].
    pub length: f64,
    /// Weight of the integral of the squared joint speed over the path's share.
    pub smoothness: f64,
    /// What was minimised: worst value, or integral of the value, each plus smoothness times motion; NaN if the plan is not whole.
    pub cost: f64,
    /// Integral of the squared joint speed over the path's share [rad^2 or m^2].
    pub motion: f64,
    /// No path can do better than this, to the resolution of the search; NaN where it was not asked for.
    pub bound: f64,
    /// First-order residual: the largest slope of the Lagrangian along a free motion.
    pub residual: f64,
    /// Whether the continuous optimum was reached; else the best route of the grid is what is returned.
    pub refined: bool,
    /// Why the plan is not whole.
    pub failure: Option<PlanFailure>,
    /// First and last point of every stretch that is followed without lifting off.
    pub segments: Vec<(usize, usize)>,
    /// The ways from one to the next, where the path was to be cut.
    pub transfers: Vec<Transfer>,
}

impl Plan {
    /// The worst value of the points that are reached; negative infinity where there is none.
    pub fn worst(&self) -> f64 {
        self.value.iter().filter(|value| !value.is_nan()).fold(f64::NEG_INFINITY, |worst, value| worst.max(*value))
    }

    /// The largest motion of a joint from point to point [rad or m].
    pub(super) fn largest_step(&self, n: usize) -> f64 {
        self.q.iter().zip(&self.q[n..]).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max)
    }
}

/// Puts the parts of a path together; where there is none the nearest posture stays.
pub(super) fn assembled(problem: &PathProblem, known: &mut Layers, parts: &[Part], hooks: &mut Hooks) -> Result<Plan, PlanError> {
    let (count, n) = (problem.points(), problem.n());
    let mut q = vec![f64::NAN; count * n];
    let mut value = vec![f64::NAN; count];
    let mut status = vec![SolveStatus::Unreachable; count];
    for part in parts {
        let points = part.first..part.first + part.len();
        q[points.start * n..points.end * n].copy_from_slice(&part.q);
        value[points.clone()].copy_from_slice(&part.value);
        status[points].fill(if part.refined { SolveStatus::Converged } else { SolveStatus::OnTarget });
    }
    fill_gaps(problem, &mut q);
    let (position_error, axis_error) = problem.errors(&q);
    for i in 0..count {
        if position_error[i].max(axis_error[i]) > problem.pins.tolerance(i) {
            (value[i], status[i]) = (f64::NAN, SolveStatus::Unreachable);
        }
    }
    let off = status.contains(&SolveStatus::Unreachable);
    let whole = parts.first().filter(|part| part.len() == count && !off);
    let mut plan = Plan {
        smoothness: parts.first().map_or(0.0, |part| part.smoothness),
        cost: whole.map_or(f64::NAN, |part| part.cost),
        motion: problem.motion_integral(0, &q),
        bound: f64::NAN,
        residual: parts.iter().map(|part| part.residual).reduce(|a, b| if b > a { b } else { a }).unwrap_or(f64::NAN),
        refined: whole.is_some_and(|part| part.refined),
        length: problem.length,
        failure: None,
        segments: parts.iter().map(|part| (part.first, part.first + part.len() - 1)).collect(),
        transfers: Vec::new(),
        q,
        value,
        position_error,
        axis_error,
        status,
    };
    let failure = first_failure(problem, known, parts, &plan, hooks)?;
    plan.failure = failure.map(|failure| PlanFailure { pins: problem.pins.beside(failure.point), ..failure });
    Ok(plan)
}

/// Gives rows that are not known the nearest one that is, the earlier of two; the middle of the ranges where there is none.
fn fill_gaps(problem: &PathProblem, q: &mut [f64]) {
    let n = problem.n();
    let reached: Vec<usize> = (0..q.len() / n).filter(|&i| q[i * n..(i + 1) * n].iter().all(|x| x.is_finite())).collect();
    if reached.is_empty() {
        let middle = problem.robot.middle();
        q.chunks_exact_mut(n).for_each(|row| row.copy_from_slice(&middle));
        return;
    }
    let mut next = 0;
    for i in 0..q.len() / n {
        while next + 1 < reached.len() && reached[next + 1].abs_diff(i) < reached[next].abs_diff(i) {
            next += 1;
        }
        let from = reached[next] * n;
        q.copy_within(from..from + n, i * n);
    }
}

/// The first reason why the plan is not whole.
fn first_failure(
    problem: &PathProblem,
    known: &mut Layers,
    parts: &[Part],
    plan: &Plan,
    hooks: &mut Hooks,
) -> Result<Option<PlanFailure>, PlanError> {
    let n = problem.n();
    let mut failures: Vec<PlanFailure> = parts.iter().filter_map(|part| part.failure.clone()).collect();
    let is_reached = |point: &usize| plan.status[*point] != SolveStatus::Unreachable;
    let count = plan.status.len();
    if let Some(bad) = (0..count).find(|point| !is_reached(point))
        && !failures.iter().any(|failure| failure.point <= bad)
    {
        failures.push(cause_at(problem, known, bad, hooks)?);
    }
    if hooks.feasible.is_some() && !parts.is_empty() {
        let reached: Vec<usize> = (0..count).filter(is_reached).collect();
        let rows: Vec<f64> = reached.iter().flat_map(|point| &plan.q[point * n..(point + 1) * n]).copied().collect();
        if let Some(allowed) = hooks.allowed(&rows, n)? {
            let refused = reached.iter().zip(allowed).find(|(_, allowed)| !allowed);
            failures.extend(refused.map(|(point, _)| PlanFailure::at(*point, FailureCause::Predicate)));
        }
    }
    if let (Some(part), true) = (parts.get(1), failures.is_empty()) {
        failures.push(PlanFailure::at(part.first, FailureCause::NoWay));
    }
    let is_turn = |k: usize| {
        let turns = (plan.q[(count - 1) * n + k] - plan.q[k]) / TAU;
        let whole = if problem.robot.is_periodic(k) { turns.round_ties_even() } else { 0.0 };
        (turns - whole).abs() <= ON_PATH
    };
    if problem.closed && failures.is_empty() && !(0..n).all(is_turn) {
        failures.push(PlanFailure::at(count - 1, FailureCause::NotClosed));
    }
    Ok(failures.into_iter().min_by_key(|failure| failure.point))
}

/// Why a point has no posture.
fn cause_at(problem: &PathProblem, known: &mut Layers, point: usize, hooks: &mut Hooks) -> Result<PlanFailure, PlanError> {
    known.add(&[point], hooks)?;
    let cause = known.worst_cause(point).unwrap_or(Cause::Unreachable);
    if cause == Cause::JointLimit
        && let Some((limited, beyond)) = known.nearest_to_limits(point)
    {
        return Ok(PlanFailure { point, cause: FailureCause::JointLimit, joint: limited.failed(&problem.robot, beyond), pins: Vec::new() });
    }
    let cause = match cause {
        _ if known.is_open(point) => FailureCause::NoWay,
        Cause::Feasible => FailureCause::NoWay,
        Cause::Unreachable => FailureCause::Unreachable,
        Cause::JointLimit => FailureCause::JointLimit,
        Cause::Singular => FailureCause::Singular,
        Cause::Predicate => FailureCause::Predicate,
    };
    Ok(PlanFailure::at(point, cause))
}
