//! Why a plan is not whole, asked again without one of its conditions at a time: what ends the way, and what would help.

use std::f64::consts::PI;
use std::sync::Arc;

use super::failure::{FailedJoint, FailureCause, Limited, PlanFailure, farthest_beyond, turns};
use super::grid::SpareGrid;
use super::hooks::{Hooks, PlanError};
use super::lattice::wide_joints;
use super::layers::Layers;
use super::numbers::linspace;
use super::problem::PathProblem;
use super::reach::missing_point;
use super::settings::PlanSettings;
use super::singular::Singularities;
use super::verdict::Plan;
use crate::robot::{AT_LIMIT, Robot};

/// Spins and places of spare joints at which a question is asked again, all points together; and points, least and most, beside those around the
/// one that fails.
const SAMPLES: usize = 6000;
const POINTS: (usize, usize) = (12, 400);
/// Points on either side of it.
const AROUND: usize = 3;
/// A joint that moves further from one of these points to the next \[rad\] may turn more often than they tell.
const TOLD: f64 = 2.0;
/// A joint this near to its limit [rad or m] stands on it.
const ON_LIMIT: f64 = 1e-6;

/// A failure with its cause and with what would help, as far as questions that cost no more than a first search tell.
pub(super) fn explained(
    problem: &PathProblem,
    settings: &PlanSettings,
    spare: &SpareGrid,
    plan: &Plan,
    hooks: &mut Hooks,
) -> Result<Option<PlanFailure>, PlanError> {
    let Some(failure) = &plan.failure else { return Ok(None) };
    let mut asked = Asked { problem, settings, spare, point: failure.point, hooks };
    let of_point =
        matches!(failure.cause, FailureCause::Unreachable | FailureCause::JointLimit | FailureCause::Singular | FailureCause::Predicate);
    if of_point && !asked.is_open()? {
        return Ok(Some(missing_point(problem, spare, failure)));
    }
    let may_lead_on = match failure.cause {
        // The search found no way whatever the steps.
        FailureCause::NoWay => false,
        FailureCause::StepLimit | FailureCause::SpeedLimit => asked.leads_on(problem, settings)?,
        _ => true,
    };
    if !may_lead_on && let Some(found) = asked.without_one()? {
        return Ok(Some(found));
    }
    Ok(Some(with_advice(problem, settings, plan, &by_its_bound(problem, settings, failure))))
}

/// A way along some of the path that is looked for.
struct Asked<'a, 'h, 'b> {
    problem: &'a PathProblem,
    settings: &'a PlanSettings,
    spare: &'a SpareGrid,
    /// The point that fails.
    point: usize,
    hooks: &'h mut Hooks<'b>,
}

/// The points that a way reaches, and its postures.
struct Way {
    points: Vec<usize>,
    q: Vec<f64>,
}

impl Asked<'_, '_, '_> {
    /// Whether the point that fails has any posture.
    fn is_open(&mut self) -> Result<bool, PlanError> {
        let mut known = Layers::new(self.problem, self.settings, self.spare, 1)?;
        known.add(&[self.point], self.hooks)?;
        Ok(known.is_open(self.point))
    }

    /// The best way over the grid, whatever the steps, as far as it leads.
    fn way(&mut self, problem: &PathProblem, settings: &PlanSettings) -> Result<Way, PlanError> {
        let last = problem.points() - 1;
        let samples = self.spare.values.len() * if self.spare.spins { settings.n_angles } else { 1 };
        let count = (SAMPLES / samples).clamp(POINTS.0, POINTS.1).min(last + 1);
        let mut points: Vec<usize> = linspace(0.0, last as f64, count).iter().map(|x| x.round_ties_even() as usize).collect();
        points.extend(self.point.saturating_sub(AROUND)..=(self.point + AROUND).min(last));
        points.sort_unstable();
        points.dedup();
        let mut known = Layers::new(problem, settings, self.spare, 1)?;
        known.add(&points, self.hooks)?;
        points.retain(|point| known.is_open(*point));
        let found = known.finder(&points, false, f64::INFINITY, &mut Hooks::default())?.find(0.0);
        points.truncate(found.cells.len());
        Ok(Way { points, q: found.q })
    }

    /// Whether there is a way over the grid to the point that fails and as far as can be beyond it.
    fn leads_on(&mut self, problem: &PathProblem, settings: &PlanSettings) -> Result<bool, PlanError> {
        let way = self.way(problem, settings)?;
        let end = (self.point + AROUND).min(problem.points() - 1);
        Ok(way.points.last().is_some_and(|last| *last >= end))
    }

    /// The failure by the first condition without which there is a way.
    fn without_one(&mut self) -> Result<Option<PlanFailure>, PlanError> {
        let (problem, settings) = (self.problem, self.settings);
        let any_spin = PlanSettings { spin_range: None, ..settings.clone() };
        if settings.spin_range.is_some() && self.leads_on(&PathProblem { spin: None, ..problem.clone() }, &any_spin)? {
            return Ok(Some(self.told(
                FailureCause::SpinRange,
                None,
                "no spin within it leads along the path there, without it there is a way",
            )));
        }
        if problem.limits {
            if wide_joints(&problem.robot, true).contains(&true)
                && let Some(failure) = self.out_of_turns()?
            {
                return Ok(Some(failure));
            }
            if let Some(failure) = self.beyond_limits()? {
                return Ok(Some(failure));
            }
        }
        let steep = PlanSettings { max_spin_step: PI, ..settings.clone() };
        if settings.max_spin_step < PI && self.leads_on(problem, &steep)? {
            return Ok(Some(self.told(
                FailureCause::NoWay,
                None,
                "the spin would have to change faster there: a larger max_spin_step leads on",
            )));
        }
        let changing = PlanSettings { branch_changes: true, ..settings.clone() };
        if !settings.branch_changes && self.leads_on(problem, &changing)? {
            return Ok(Some(self.told(
                FailureCause::NoWay,
                None,
                "the branch of the points before ends there: branch_changes=True leads on, through a singularity",
            )));
        }
        let all = PlanSettings { branches: None, ..settings.clone() };
        if settings.branches.is_some() && self.leads_on(problem, &all)? {
            return Ok(Some(self.told(
                FailureCause::NoWay,
                None,
                "no way on the branches that are allowed, without branches there is one",
            )));
        }
        Ok(None)
    }

    fn told(&self, cause: FailureCause, joint: Option<FailedJoint>, hint: &str) -> PlanFailure {
        PlanFailure { hint: Some(hint.into()), ..PlanFailure::new(self.point, cause, joint) }
    }

    /// The joint of which the way asks for more whole turns than its limits leave, where there is a way but for that.
    fn out_of_turns(&mut self) -> Result<Option<PlanFailure>, PlanError> {
        let (n, robot) = (self.problem.n(), &self.problem.robot);
        let free = PathProblem { robot: Arc::new(any_turns(robot)), ..self.problem.clone() };
        let way = self.way(&free, self.settings)?;
        if way.points.last().is_none_or(|last| *last < self.point) {
            return Ok(None);
        }
        let missing = |joint: usize| {
            let column = way.q.iter().skip(joint).step_by(n);
            let (low, high) = column.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
            (joint, high - low - (robot.limits().q_max[joint] - robot.limits().q_min[joint]))
        };
        let Some((joint, missing)) = (0..n).map(missing).reduce(|a, b| if b.1 > a.1 { b } else { a }) else { return Ok(None) };
        if missing <= AT_LIMIT {
            return Ok(None);
        }
        let Some(failed) = Limited::Joint(joint).failed(robot, missing) else { return Ok(None) };
        let label = robot.joint_label(joint);
        let column: Vec<f64> = way.q.iter().skip(joint).step_by(n).copied().collect();
        if column.windows(2).any(|pair| (pair[1] - pair[0]).abs() > TOLD) {
            let failed = FailedJoint { excess: f64::NAN, ..failed };
            return Ok(Some(self.told(FailureCause::JointLimit, Some(failed), "it is out of whole turns there")));
        }
        let whole = if way.points.last() == Some(&(self.problem.points() - 1)) { "the path needs" } else { "it would need" };
        let hint = format!("it is out of whole turns there: {whole} {} of {label} more than its position limits leave", turns(missing));
        Ok(Some(self.told(FailureCause::JointLimit, Some(failed), &hint)))
    }

    /// The joint that is farthest beyond its limit at the point that fails, or after it, where there is a way without position limits.
    fn beyond_limits(&mut self) -> Result<Option<PlanFailure>, PlanError> {
        let (problem, robot) = (self.problem, &self.problem.robot);
        let free = PathProblem { limits: false, ..problem.clone() };
        let way = self.way(&free, self.settings)?;
        if way.points.last().is_none_or(|last| *last < (self.point + AROUND).min(problem.points() - 1)) {
            return Ok(None);
        }
        let mut rows: Vec<Vec<f64>> = way.q.chunks_exact(problem.n()).map(<[f64]>::to_vec).collect();
        rows.iter_mut().for_each(|row| turn_inside(robot, row));
        let beyond =
            rows.iter().zip(&way.points).filter(|(_, point)| **point >= self.point).filter_map(|(row, _)| farthest_beyond(robot, row));
        let worst = beyond.reduce(|a, b| if b.1 > a.1 { b } else { a }).filter(|(_, excess)| *excess > AT_LIMIT);
        let joint = worst.and_then(|(limited, excess)| limited.failed(robot, excess));
        Ok(Some(self.told(FailureCause::JointLimit, joint, "without position limits there is a way")))
    }
}

/// A posture with each joint by whole turns as near to its range as can be.
fn turn_inside(robot: &Robot, q: &mut [f64]) {
    for (i, x) in q.iter_mut().enumerate().filter(|(i, _)| robot.is_periodic(*i)) {
        *x = robot.limits().turned(i, *x);
    }
}

/// The robot without limits of the joints whose whole turns count.
fn any_turns(robot: &Robot) -> Robot {
    let mut limits = robot.limits().clone();
    for (joint, _) in wide_joints(robot, true).into_iter().enumerate().filter(|(_, wide)| *wide) {
        (limits.q_min[joint], limits.q_max[joint]) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    robot.with_limits(limits).unwrap_or_else(|_| robot.clone())
}

/// A step that is too large by `max_step`, if that and not the speed of the joint is what bounds it.
fn by_its_bound(problem: &PathProblem, settings: &PlanSettings, failure: &PlanFailure) -> PlanFailure {
    let by_step = match (&failure.joint, settings.max_step) {
        (Some(joint), Some(step)) if failure.point > 0 => step <= problem.bounds[(failure.point - 1) * problem.n() + joint.number],
        _ => false,
    };
    let cause = if by_step && failure.cause == FailureCause::SpeedLimit { FailureCause::StepLimit } else { failure.cause };
    PlanFailure { cause, ..failure.clone() }
}

/// What helps where a step is too large, or nothing is known to.
fn with_advice(problem: &PathProblem, settings: &PlanSettings, plan: &Plan, failure: &PlanFailure) -> PlanFailure {
    let advice = match failure.cause {
        FailureCause::SpeedLimit => format!("more time there would help{}", in_the_way(problem, settings, plan, failure.point)),
        FailureCause::StepLimit => {
            let others = in_the_way(problem, settings, plan, failure.point);
            format!("a path with more points or a larger max_step may help{others}")
        }
        FailureCause::Volume => "no orientation within it leads along the path there: a wider one may help".into(),
        FailureCause::SpinRange => "no spin within it leads along the path there: a wider one may help".into(),
        FailureCause::NoWay => {
            "it has postures, but no branch leads there from the points before: a finer grid (n_angles, n_spare) may help".into()
        }
        FailureCause::NotClosed => "its posture is not that of the first point: closed=False leads along the path".into(),
        _ => return failure.clone(),
    };
    PlanFailure { hint: Some(advice), ..failure.clone() }
}

/// What makes joints move far from the point before to a point: a singularity that is near, or a joint that stands on its limit.
fn in_the_way(problem: &PathProblem, settings: &PlanSettings, plan: &Plan, point: usize) -> String {
    let (n, limits) = (problem.n(), problem.robot.limits());
    let rows = [point.saturating_sub(1), point].map(|point| &plan.q[point * n..(point + 1) * n]);
    let singularities = Singularities::of(&problem.robot);
    if rows.iter().any(|row| singularities.near(row)) {
        let through = if settings.branch_changes { "" } else { ": branch_changes=True may lead through it" };
        return format!("; a singularity is near{through}");
    }
    let near = |x: f64, joint: usize| (x - limits.q_min[joint]).min(limits.q_max[joint] - x) <= ON_LIMIT;
    let on_limit = (0..n).find(|joint| problem.limits && rows.iter().any(|row| near(row[*joint], *joint)));
    on_limit.map_or(String::new(), |joint| format!("; {} stands on its position limit", problem.robot.joint_label(joint)))
}
