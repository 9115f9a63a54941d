//! A path followed greedily from its first point: a rival of what comes of a coarse grid.

use std::f64::consts::TAU;

use super::corridor::weighed;
use super::hooks::{Hooks, PlanError};
use super::part::{Part, best_part, refined_part};
use super::problem::{ON_PATH, PathProblem};
use crate::error::Error;
use crate::index::Objective;
use crate::resolve::{Memory, OrthogonalSqp, Resolver, SolveStatus, SqpSettings};

/// Random postures from which the first point is solved.
const STARTS: usize = 64;
/// Seed of these postures.
const SEED: u64 = 0;

/// The parts, or what comes of following the path greedily from its first point if that is better. With joints to spare the grid is coarse, and
/// a greedy walk that keeps away from limits can be worth more.
pub(super) fn or_followed(problem: &PathProblem, parts: Vec<Part>, most: usize, hooks: &mut Hooks) -> Result<Vec<Part>, PlanError> {
    hooks.go_on()?;
    let followed = match &problem.objective {
        Some(objective) => followed(problem, objective)?,
        None => None,
    };
    let Some(mut q) = followed else { return Ok(parts) };
    if problem.closed {
        let n = problem.n();
        let last = q.len() - n;
        for k in (0..n).filter(|k| problem.robot.is_periodic(*k)) {
            q[last + k] = q[k] + TAU * ((q[last + k] - q[k]) / TAU).round_ties_even();
        }
    }
    let part = weighed(problem, refined_part(problem, 0, &q, most, hooks)?, &q, hooks)?;
    if parts.len() == 1 && parts[0].len() == part.len() {
        return Ok(vec![best_part(problem.criterion, parts.into_iter().chain([part]).collect())]);
    }
    Ok(vec![part])
}

/// The postures along the whole path, n joints a row; `None` where a point is not reached.
fn followed(problem: &PathProblem, objective: &Objective) -> Result<Option<Vec<f64>>, Error> {
    let settings = SqpSettings { length: problem.length, limits: problem.limits, ..SqpSettings::default() };
    let solver = OrthogonalSqp::new(problem.robot.clone(), problem.task, objective.clone(), settings)?;
    Ok(walk(&solver, problem))
}

fn walk(solver: &OrthogonalSqp, problem: &PathProblem) -> Option<Vec<f64>> {
    let n = problem.n();
    let start = solver.solve_best(&problem.targets[0], STARTS, SEED)?;
    if start.status == SolveStatus::Unreachable {
        return None;
    }
    let (mut rows, mut on_path) = (Vec::with_capacity(problem.points() * n), true);
    solver.follow(&problem.targets, &start.q[..n], &mut Memory::default(), &mut |point| {
        on_path &= point.position_error.max(point.angle_error) <= ON_PATH;
        rows.extend_from_slice(&point.q[..n]);
    });
    on_path.then_some(rows)
}
