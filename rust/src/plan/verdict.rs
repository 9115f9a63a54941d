//! A plan put together from its parts, and what is wrong with it.

use std::f64::consts::TAU;
use std::ops::Range;

use super::failure::{FailureCause, Limited, PlanFailure, farthest_beyond};
use super::hooks::{Hooks, PlanError};
use super::lattice::Cause;
use super::layers::Layers;
use super::part::Part;
use super::postures::lands;
use super::problem::{ON_PATH, PathProblem};
use super::rivals::Way;
use super::singular::Singularities;
use super::transfer::Transfer;
use crate::resolve::SolveStatus;

/// A motion that exceeds its bound by less than this, relative, is at it: the refinement keeps to bounds to rounding.
const AT_BOUND: f64 = 1e-9;

/// A path planned as a whole.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Postures, n joints a row and one row a point; points that are not reached hold the posture of the nearest point that is.
    pub q: Vec<f64>,
    /// Values of the objective: NaN where a point is not reached, infinite where the objective has none, as in a singular posture.
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
    /// What the caller says that its steps cost.
    pub edge_cost: f64,
    /// No path can do better than this, to the resolution of the search; NaN where it was not asked for.
    pub bound: f64,
    /// First-order residual: the largest slope of the Lagrangian along a free motion.
    pub residual: f64,
    /// Whether the continuous optimum was reached; else the best route of the grid is what is returned.
    pub refined: bool,
    /// Why the plan is not whole.
    pub failure: Option<PlanFailure>,
    /// The ways through the whole path that were compared, the best first: on other branches, on the other side of postures that are closed or much worse.
    pub ways: Vec<Way>,
    /// What else is worth saying, in words.
    pub notes: Vec<String>,
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

    /// Number of points that are reached.
    pub(super) fn reached(&self) -> usize {
        self.status.iter().filter(|status| **status != SolveStatus::Unreachable).count()
    }

    /// Whether points that have postures cannot be joined: by a step, by speed, for want of a branch that leads on.
    pub(super) fn is_blocked(&self) -> bool {
        use FailureCause::{NoWay, NotClosed, Singular, SpeedLimit, StepLimit};
        self.failure.as_ref().is_some_and(|failure| matches!(failure.cause, NoWay | NotClosed | Singular | SpeedLimit | StepLimit))
    }

    /// The plan, failed at the first step that is larger than a problem allows.
    pub(super) fn judged_by_steps(mut self, problem: &PathProblem) -> Self {
        self.failure = first_violation(problem, 0..problem.points(), &self);
        self
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
    // What a refinement that failed tells of motions is of postures beyond limits; those that are kept tell their own.
    let of_motion = |failure: &PlanFailure| matches!(failure.cause, FailureCause::SpeedLimit | FailureCause::StepLimit);
    let within = |part: &Part, failure: &PlanFailure| failure.point < part.first + part.len();
    let failure = |part: &Part| part.failure.clone().filter(|failure| !(of_motion(failure) && within(part, failure)));
    let mut failures: Vec<PlanFailure> = parts.iter().filter_map(failure).collect();
    let beyond = within_limits(problem, &mut q, &mut value, &mut status, hooks)?;
    fill_gaps(problem, &mut q);
    let (position_error, axis_error) = problem.errors(&q);
    for i in 0..count {
        if position_error[i].max(axis_error[i]) > problem.pins.tolerance(i) {
            (value[i], status[i]) = (f64::NAN, SolveStatus::Unreachable);
        }
    }
    if problem.pace.is_some() {
        let worth = problem.worth(0, &q);
        value.iter_mut().zip(worth).filter(|(value, _)| !value.is_nan()).for_each(|(value, worth)| *value = worth);
    }
    infinite_values(problem, &q, &mut value, &status);
    let off = position_error.iter().chain(&axis_error).any(|error| *error > ON_PATH);
    let whole = parts.first().filter(|part| part.len() == count && !off && beyond.is_none());
    let mut plan = Plan {
        smoothness: parts.first().map_or(0.0, |part| part.smoothness),
        cost: whole.map_or(f64::NAN, |part| if value.contains(&f64::INFINITY) { f64::INFINITY } else { part.cost }),
        motion: problem.motion_integral(0, &q),
        edge_cost: parts.iter().map(|part| part.edge_cost).sum(),
        bound: f64::NAN,
        residual: parts.iter().map(|part| part.residual).reduce(|a, b| if b > a { b } else { a }).unwrap_or(f64::NAN),
        refined: whole.is_some_and(|part| part.refined),
        length: problem.length,
        failure: None,
        ways: Vec::new(),
        notes: Vec::new(),
        segments: parts.iter().map(|part| (part.first, part.first + part.len() - 1)).collect(),
        transfers: Vec::new(),
        q,
        value,
        position_error,
        axis_error,
        status,
    };
    failures.extend(beyond);
    failures.extend(parts.iter().filter_map(|part| first_violation(problem, part.first..part.first + part.len(), &plan)).next());
    let failure = first_failure(problem, known, parts, &plan, failures, hooks)?;
    plan.failure = failure.map(|failure| PlanFailure { pins: problem.pins.beside(failure.point), ..failure });
    Ok(plan)
}

/// Whether a point is reached.
fn is_reached(plan: &Plan, point: usize) -> bool {
    plan.status[point] != SolveStatus::Unreachable
}

/// Brings postures that are beyond position limits within them, by Newton from where they are; those that do not get there are taken out. The first
/// of these is the failure that is returned, with the joint that is farthest beyond.
fn within_limits(
    problem: &PathProblem,
    q: &mut [f64],
    value: &mut [f64],
    status: &mut [SolveStatus],
    hooks: &mut Hooks,
) -> Result<Option<PlanFailure>, PlanError> {
    let (n, limits) = (problem.n(), problem.robot.limits());
    let mut first = None;
    for (point, row) in q.chunks_exact_mut(n).enumerate() {
        if !problem.limits || status[point] == SolveStatus::Unreachable || limits.settle(row) {
            continue;
        }
        let mut there = row.to_vec();
        let inside = limits.pull_inside(&mut there)
            && lands(&problem.robot, &problem.task, &problem.targets[point], problem.length, true, &mut there)
            && problem.allows_turn(point, &there)
            && hooks.all_allowed(&there, n)?;
        if inside {
            row.copy_from_slice(&there);
            (value[point], status[point]) = (problem.values(row)[0], SolveStatus::OnTarget);
        } else {
            let joint = farthest_beyond(&problem.robot, row).and_then(|(limited, beyond)| limited.failed(&problem.robot, beyond));
            first.get_or_insert(PlanFailure::new(point, FailureCause::JointLimit, joint));
            row.fill(f64::NAN);
            (value[point], status[point]) = (f64::NAN, SolveStatus::Unreachable);
        }
    }
    Ok(first)
}

/// Takes values for infinite where the objective has none.
fn infinite_values(problem: &PathProblem, q: &[f64], value: &mut [f64], status: &[SolveStatus]) {
    let singularities = Singularities::of(&problem.robot);
    for (point, row) in q.chunks_exact(problem.n()).enumerate().filter(|(point, _)| status[*point] != SolveStatus::Unreachable) {
        if value[point].is_nan() || (singularities.has(row) && problem.is_infinite(row, value[point])) {
            value[point] = f64::INFINITY;
        }
    }
}

/// The first motion of a part from a point to the next that is larger than it may be, of the joint that exceeds its bound most; or the first spin
/// out of its range. What was refined keeps to both; what was not may not.
fn first_violation(problem: &PathProblem, part: Range<usize>, plan: &Plan) -> Option<PlanFailure> {
    let n = problem.n();
    violation(problem, part.start, &plan.q[part.start * n..part.end * n], &|point| is_reached(plan, point))
}

/// The same of postures of the points from `first` on, those that are reached.
pub(super) fn violation(problem: &PathProblem, first: usize, q: &[f64], reached: &dyn Fn(usize) -> bool) -> Option<PlanFailure> {
    let n = problem.n();
    let posture = |point: usize| &q[(point - first) * n..(point - first + 1) * n];
    let too_far = |point: usize| {
        let bounds = &problem.bounds[(point - 1) * n..point * n];
        let share = |k: usize| (k, (posture(point)[k] - posture(point - 1)[k]).abs() / bounds[k]);
        let worst = (0..n).map(share).reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        (reached(point - 1) && reached(point) && worst.1 > 1.0 + AT_BOUND).then(|| {
            let cause = if problem.timed { FailureCause::SpeedLimit } else { FailureCause::StepLimit };
            PlanFailure::new(point, cause, Limited::Joint(worst.0).failed(&problem.robot, worst.1))
        })
    };
    let points = first..first + q.len() / n;
    let spun = |point: &usize| reached(*point) && !problem.allows_spin(*point, posture(*point));
    let spin = points.clone().find(spun).map(|point| PlanFailure::at(point, FailureCause::SpinRange));
    let outside = |point: &usize| reached(*point) && problem.pins.posture(*point).is_none() && !problem.is_member(*point, posture(*point));
    let volume = points.clone().find(outside).map(|point| PlanFailure::at(point, FailureCause::Volume));
    let motion = points.skip(1).find_map(too_far);
    [motion, spin, volume].into_iter().flatten().min_by_key(|failure| failure.point)
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
    mut failures: Vec<PlanFailure>,
    hooks: &mut Hooks,
) -> Result<Option<PlanFailure>, PlanError> {
    let n = problem.n();
    let is_reached = |point: &usize| is_reached(plan, *point);
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
        return Ok(PlanFailure::new(point, FailureCause::JointLimit, limited.failed(&problem.robot, beyond)));
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
