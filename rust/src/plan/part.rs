//! From a route to the continuous optimum of a stretch of the path, and the best of several.

use std::f64::consts::TAU;

use super::constraints::{Constraint, Kind};
use super::corridor::{cost, weighed};
use super::failure::{FailedJoint, FailureCause, Limited, PlanFailure};
use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::numbers::{interpolated, mean_size};
use super::path::Path;
use super::problem::{ON_PATH, PathProblem};
use super::refine::{RefineStatus, refine};
use super::verdict::violation;
use crate::error::Error;
use crate::robot::Joint;

/// A worst value this near to its lower bound, relative, is the least.
const PROVEN: f64 = 1e-7;
/// Costs this near to each other, relative, are equal: the lesser motion wins.
const TIE: f64 = 1e-7;
/// Newton steps that are enough unless a path creeps.
const TRIAL: usize = 40;
/// The same for a path that is near its optimum most likely.
const PATIENT: usize = 100;
/// Weight of the motion beside the mean, relative, where that is a start for a worst value.
const STEADY: f64 = 1e-3;
/// A last posture this near to the first [rad or m] is the first: what is left is rounding.
const CLOSES: f64 = 1e-6;
/// Share of the largest step below which a route is refined without it.
const SLOW: f64 = 0.8;
/// Halvings of the way to an optimum that the caller refuses.
const HALVINGS: usize = 6;

/// What is known of a stretch of the path.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Its first point.
    pub first: usize,
    /// Postures, n joints a row.
    pub q: Vec<f64>,
    /// Values, one a point.
    pub value: Vec<f64>,
    /// What was minimised; NaN where that broke off.
    pub cost: f64,
    /// Integral of the squared joint speed.
    pub motion: f64,
    /// What the caller says that its steps cost.
    pub edge_cost: f64,
    /// First-order residual.
    pub residual: f64,
    /// Weight of the motion.
    pub smoothness: f64,
    /// Whether this is an optimum.
    pub refined: bool,
    /// Why it cannot be followed.
    pub failure: Option<PlanFailure>,
}

impl Part {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.value.len()
    }

    /// Largest value.
    pub fn worst(&self) -> f64 {
        self.value.iter().fold(f64::NEG_INFINITY, |worst, value| worst.max(*value))
    }

    /// Whether this is an optimum whose worst value is at a lower bound.
    pub fn is_at(&self, bound: f64) -> bool {
        self.is_optimum() && self.worst() <= bound * (1.0 + PROVEN)
    }

    /// Whether the worst value is within a part of itself of a lower bound.
    pub fn is_within(&self, bound: f64, gap: f64) -> bool {
        self.worst() - bound <= gap * self.worst().abs()
    }

    /// Whether this is an optimum that can be followed.
    pub fn is_optimum(&self) -> bool {
        self.refined && self.failure.is_none()
    }
}

/// Refines postures of the points from `first` on; keeps them as they are where that fails.
pub(super) fn refined_part(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let part = tried_part(problem, first, q, most, hooks)?;
    if part.refined || part.failure.is_some() || most <= TRIAL {
        return Ok(part);
    }
    let again = refined_once(problem, first, &part.q, most, hooks)?;
    Ok(best_part(problem.criterion, vec![part, again]))
}

/// Refines postures with a few steps.
pub(super) fn first_part(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    refined_once(problem, first, q, most.min(TRIAL), hooks)
}

/// Refines postures that come from an optimum over fewer points; from afar where that fails.
pub(super) fn next_part(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let part = refined_once(problem, first, q, most.min(PATIENT), hooks)?;
    if part.is_optimum() { Ok(part) } else { refined_part(problem, first, q, most, hooks) }
}

/// Refines postures that are far from keeping to the largest steps, by way of the motion that is least beside these.
pub(super) fn calmed_part(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let calm = refined_once(&problem.calm(), first, q, most, hooks)?;
    refined_once(problem, first, if calm.failure.is_none() { &calm.q } else { q }, most, hooks)
}

/// Refines postures with a few steps only. A worst value that creeps is tried again from the optimum of the mean, which is next to it and
/// reached at once.
fn tried_part(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let most = most.min(TRIAL);
    let part = first_part(problem, first, q, most, hooks)?;
    if problem.criterion == Criterion::Minimax && !part.refined && part.failure.is_none() {
        let smoothness = Some(STEADY * mean_size(part.value.iter().copied()));
        let mean = PathProblem { criterion: Criterion::Integral, smoothness, ..problem.clone() };
        let mean = if problem.pace.is_some() { problem.for_search() } else { mean };
        let mean = refined_once(&mean, first, q, most, hooks)?;
        if mean.is_optimum() {
            let again = refined_once(problem, first, &mean.q, most, hooks)?;
            return Ok(best_part(problem.criterion, vec![part, again]));
        }
    }
    Ok(part)
}

fn refined_once(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    if problem.steps_only() && largest_share(problem, first, q) < SLOW {
        // Far from the largest step: the path is refined without it and most likely keeps it.
        let part = refined_within(&problem.without_steps(), first, q, most, hooks)?;
        if part.failure.is_none() && largest_share(problem, first, &part.q) < 1.0 {
            return Ok(part);
        }
    }
    refined_within(problem, first, q, most, hooks)
}

/// The largest motion between points as a share of what it may be.
pub(super) fn largest_share(problem: &PathProblem, first: usize, q: &[f64]) -> f64 {
    let n = problem.n();
    let steps = q.iter().zip(&q[n..]).zip(&problem.bounds[first * n..]);
    steps.map(|((from, to), bound)| (to - from).abs() / bound).fold(0.0, f64::max)
}

/// The motion of a joint round a closed path: the whole turns nearest to what there is, none where a turn leads elsewhere.
fn whole_turns(problem: &PathProblem, joint: usize, motion: f64) -> f64 {
    if problem.robot.is_periodic(joint) { TAU * (motion / TAU).round_ties_even() } else { 0.0 }
}

fn refined_within(problem: &PathProblem, first: usize, q: &[f64], most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    hooks.go_on()?;
    let n = problem.n();
    let count = q.len() / n;
    let closing = problem.closed && count == problem.points() && count > 2;
    let turns: Option<Vec<f64>> = closing.then(|| (0..n).map(|k| whole_turns(problem, k, q[(count - 1) * n + k] - q[k])).collect());
    let mut start = q.to_vec();
    if !problem.restored(first, &mut start).into_iter().all(|reached| reached) {
        start.copy_from_slice(q);
    }
    problem.draw_inside(first, &mut start);
    let stretch = problem.stretch(first, count, turns, &start);
    let found = refine(&stretch, &start[..stretch.points() * n], most, &mut || hooks.is_cancelled());
    if found.status == RefineStatus::Cancelled {
        return Err(PlanError::Cancelled);
    }
    let (mut rows, mut value) = (found.q, found.values);
    if let Some(turns) = &stretch.turns {
        let last: Vec<f64> = (0..n).map(|k| rows[k] + turns[k]).collect();
        rows.extend(last);
        value.push(value[0]);
    }
    let allowed = hooks.all_allowed(&rows, n)?;
    problem.settle(first, &mut rows);
    if let Some(turns) = &stretch.turns {
        let end = (count - 1) * n;
        let closes = (0..n).all(|k| (rows[end + k] - rows[k] - turns[k]).abs() <= CLOSES);
        (0..n).filter(|_| closes).for_each(|k| rows[end + k] = rows[k] + turns[k]);
    }
    let tightest = found.tightest.filter(|_| found.status == RefineStatus::Infeasible);
    let mut part = Part {
        first,
        cost: found.cost,
        motion: problem.motion_integral(first, &rows),
        edge_cost: 0.0,
        residual: found.residual,
        smoothness: stretch.smoothness(),
        refined: allowed && found.status == RefineStatus::Converged,
        failure: tightest.map(|constraint| failure(problem, first, &rows, &constraint)),
        value: if problem.pace.is_some() { problem.worth(first, &rows) } else { value },
        q: rows,
    };
    if found.status == RefineStatus::Singular {
        part = Part { value: problem.worth(first, &start), motion: problem.motion_integral(first, &start), q: start, ..part };
    } else if !allowed {
        part = as_far_as_allowed(problem, &start, part, hooks)?;
    }
    Ok(part)
}

/// The postures on the way from those at the `start` to those of a part that the caller refuses, as far as all are allowed; the start, with what is wrong
/// with it, where it is refused itself.
fn as_far_as_allowed(problem: &PathProblem, start: &[f64], part: Part, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let (n, first) = (problem.n(), part.first);
    let mut kept = start.to_vec();
    problem.settle(first, &mut kept);
    let mut wrong = violation(problem, first, &kept, &|_| true);
    if let Some(allowed) = hooks.allowed(&kept, n)? {
        let refused = allowed.iter().position(|allowed| !allowed).map(|i| PlanFailure::at(first + i, FailureCause::Predicate));
        wrong = [refused, wrong].into_iter().flatten().min_by_key(|failure| failure.point);
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..if wrong.is_none() { HALVINGS } else { 0 } {
        let middle = 0.5 * (low + high);
        let mut rows: Vec<f64> = start.iter().zip(&part.q).map(|(from, to)| from + middle * (to - from)).collect();
        let reached = problem.restored(first, &mut rows).into_iter().all(|reached| reached);
        problem.settle(first, &mut rows);
        if reached && problem.holds(first, &rows) && hooks.all_allowed(&rows, n)? {
            (low, kept) = (middle, rows);
        } else {
            high = middle;
        }
    }
    let (value, motion) = (problem.worth(first, &kept), problem.motion_integral(first, &kept));
    let part = Part { q: kept, value, motion, residual: f64::NAN, failure: wrong, ..part };
    Ok(Part { cost: cost(problem, &part), ..part })
}

/// The best of several: whole before broken, then by cost; among equals refined first, then by motion.
pub(super) fn best_part(criterion: Criterion, parts: Vec<Part>) -> Part {
    // What broke off has no cost.
    let cost = |part: &Part| {
        let cost = if criterion == Criterion::Minimax { part.worst() } else { part.cost };
        if cost.is_finite() { cost } else { f64::INFINITY }
    };
    let any_whole = parts.iter().any(|part| part.failure.is_none());
    let mut rivals: Vec<Part> = parts.into_iter().filter(|part| !any_whole || part.failure.is_none()).collect();
    let least = rivals.iter().map(cost).fold(f64::INFINITY, f64::min);
    let limit = least + TIE * least.abs();
    let rank = |part: &Part| (cost(part) > limit, !part.refined, part.motion + part.edge_cost);
    let better = |a: &(bool, bool, f64), b: &(bool, bool, f64)| (a.0, a.1) < (b.0, b.1) || ((a.0, a.1) == (b.0, b.1) && a.2 < b.2);
    let best = (1..rivals.len()).fold(0, |best, i| if better(&rank(&rivals[i]), &rank(&rivals[best])) { i } else { best });
    rivals.swap_remove(best)
}

/// The better of two ways to follow a path: the one that reaches more of it, else the better one.
pub(super) fn better_parts(criterion: Criterion, old: Vec<Part>, new: Vec<Part>) -> Vec<Part> {
    if old.is_empty() || new.is_empty() {
        return if old.is_empty() { new } else { old };
    }
    let reach = |parts: &[Part]| (parts.iter().map(Part::len).sum::<usize>(), std::cmp::Reverse(parts.len()));
    match reach(&old).cmp(&reach(&new)) {
        std::cmp::Ordering::Greater => old,
        std::cmp::Ordering::Less => new,
        std::cmp::Ordering::Equal if old.len() == 1 => vec![best_part(criterion, old.into_iter().chain(new).collect())],
        std::cmp::Ordering::Equal => old,
    }
}

/// The worst value of a whole path; infinite where there is none.
pub(super) fn worst(parts: &[Part]) -> f64 {
    match parts {
        [part] if part.is_optimum() => part.worst(),
        _ => f64::INFINITY,
    }
}

/// An earlier plan of another path, from which one is made at once.
#[derive(Debug, Clone)]
pub struct WarmStart {
    /// The path that was planned.
    pub path: Path,
    /// Joints of a posture.
    pub n: usize,
    /// Its postures, n joints a row and one row a point.
    pub q: Vec<f64>,
}

impl WarmStart {
    /// Refined, carried over by the share of the path; nothing if that does not lead to an optimum.
    pub(super) fn refined(&self, problem: &PathProblem, path: &Path, most: usize, hooks: &mut Hooks) -> Result<Vec<Part>, PlanError> {
        if self.n != problem.n() {
            return Err(Error::value("warm_start", format!("a plan of {} joints", self.n), &problem.n().to_string()).into());
        }
        let places = |path: &Path| {
            let ends = path.shares().into_iter().scan(0.0, |end, share| {
                *end += share;
                Some(*end)
            });
            std::iter::once(0.0).chain(ends).collect::<Vec<_>>()
        };
        let q = interpolated(places(path).into_iter(), &places(&self.path), &self.q, self.n);
        let part = weighed(problem, refined_part(problem, 0, &q, most, hooks)?, &q, hooks)?;
        let (distance, angle) = problem.errors(&part.q);
        let on_path = distance.iter().chain(&angle).all(|error| *error <= ON_PATH);
        Ok(if part.is_optimum() && on_path { vec![part] } else { Vec::new() })
    }
}

/// Which limit leaves no path: where, and by how much.
fn failure(problem: &PathProblem, first: usize, q: &[f64], tightest: &Constraint) -> PlanFailure {
    let n = problem.n();
    let (at, number) = (tightest.point, tightest.joint);
    let slides = problem.robot.joints().get(number) == Some(&Joint::Prismatic);
    let joint = |excess: f64| Some(FailedJoint { number, slides, excess, combination: None });
    let point = first + at;
    match tightest.kind {
        Kind::Position => {
            let (limits, x) = (problem.robot.limits(), q[at * n + number]);
            let beyond = (limits.q_min[number] - x).max(x - limits.q_max[number]);
            PlanFailure::new(point, FailureCause::JointLimit, joint(beyond))
        }
        Kind::Combination => {
            let beyond = -problem.robot.limits().coupled[number].margin(&q[at * n..(at + 1) * n]);
            let joint = Limited::Combination(number).failed(&problem.robot, beyond);
            PlanFailure::new(point, FailureCause::JointLimit, joint)
        }
        Kind::Motion => {
            let following = (at + 1).min(q.len() / n - 1);
            let excess = (q[following * n + number] - q[at * n + number]).abs() / problem.bounds[point * n + number];
            let cause = if problem.timed { FailureCause::SpeedLimit } else { FailureCause::StepLimit };
            PlanFailure::new(point + 1, cause, joint(excess))
        }
        Kind::Spin => PlanFailure::at(point, FailureCause::SpinRange),
        Kind::Side => PlanFailure::at(point, FailureCause::Volume),
        Kind::Value | Kind::Pace | Kind::Widening => PlanFailure::at(point, FailureCause::NoWay),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(cost: f64, motion: f64, refined: bool) -> Part {
        let (q, value) = (vec![0.0; 18], vec![1.0; 3]);
        Part { first: 0, q, value, cost, motion, edge_cost: 0.0, residual: 0.0, smoothness: 0.0, refined, failure: None }
    }

    #[test]
    fn a_rival_without_a_cost_never_wins() {
        let (good, broken) = (part(2.0, 1.0, true), part(f64::NAN, 0.0, false));
        let best = |parts: [&Part; 2]| best_part(Criterion::Integral, parts.map(Clone::clone).to_vec());
        assert!(best([&broken, &good]).cost == 2.0 && best([&good, &broken]).cost == 2.0);
        assert!(best_part(Criterion::Integral, vec![broken]).cost.is_nan());
    }

    #[test]
    fn among_equals_the_refined_one_and_then_the_calmer_one_wins() {
        let parts = vec![part(2.0, 0.1, false), part(2.0 + 1e-8, 3.0, true), part(2.0, 2.0, true)];
        assert_eq!(best_part(Criterion::Integral, parts).motion, 2.0);
    }
}
