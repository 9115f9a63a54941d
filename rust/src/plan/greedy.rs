//! A path followed from its first point on: a rival of what comes of a coarse grid, and a way where the grid knows none.

use std::f64::consts::TAU;

use super::corridor::weighed;
use super::hooks::{Hooks, PlanError};
use super::layers::Layers;
use super::numbers::ascending;
use super::part::{Part, best_part, better_parts, refined_part};
use super::problem::{ON_PATH, PathProblem};
use crate::error::Error;
use crate::index::Objective;
use crate::inverse::reach;
use crate::resolve::{Memory, OrthogonalSqp, Resolver, SolveStatus, SqpSettings};

/// Random postures from which the first point is solved.
const STARTS: usize = 64;
/// Seed of these postures.
const SEED: u64 = 0;
/// Postures of the first point from which the path is followed with the least motion, far from each other.
const FOLLOWED: usize = 24;
/// The ways with the least motion that are refined beside the best of the grid.
const REFINED: usize = 6;
/// Newton steps from a point to the next.
const STEPS: usize = 30;

/// The parts, or what comes of following the path from its first point if that is better. With joints to spare the grid is coarse: a walk that keeps away
/// from limits can be worth more, and one with the least motion may find a way where the grid has none.
pub(super) fn or_followed(
    problem: &PathProblem,
    known: &mut Layers,
    mut parts: Vec<Part>,
    most: usize,
    hooks: &mut Hooks,
) -> Result<Vec<Part>, PlanError> {
    hooks.go_on()?;
    // The grid tells ways of one value apart by what its coarse steps cost: where nothing but the motion counts, ways of other kinds are looked at as well.
    let motion_alone = problem.objective.is_none();
    if motion_alone || !is_whole(problem, &parts) {
        known.add(&[0], hooks)?;
        for (i, q) in followed_with_least_motion(problem, known.postures(0)).into_iter().enumerate() {
            if is_whole(problem, &parts) && (!motion_alone || i >= REFINED) {
                break;
            }
            let part = weighed(problem, refined_part(problem, 0, &q, most, hooks)?, &q, hooks)?;
            parts = better_parts(problem.criterion, parts, vec![part]);
        }
    }
    let best = match &problem.objective {
        Some(objective) => followed(problem, objective)?,
        None => None,
    };
    let Some(mut q) = best else { return Ok(parts) };
    close(problem, &mut q);
    let part = weighed(problem, refined_part(problem, 0, &q, most, hooks)?, &q, hooks)?;
    if parts.len() == 1 && parts[0].len() == part.len() {
        return Ok(vec![best_part(problem.criterion, parts.into_iter().chain([part]).collect())]);
    }
    Ok(vec![part])
}

fn is_whole(problem: &PathProblem, parts: &[Part]) -> bool {
    matches!(parts, [part] if part.len() == problem.points() && part.failure.is_none())
}

/// Ends a closed path as many whole turns from its start as there are.
fn close(problem: &PathProblem, q: &mut [f64]) {
    let n = problem.n();
    let last = q.len() - n;
    for k in (0..n).filter(|k| problem.closed && problem.robot.is_periodic(*k)) {
        q[last + k] = q[k] + TAU * ((q[last + k] - q[k]) / TAU).round_ties_even();
    }
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

/// Postures along the whole path, from some of the first point and with the least motion from each point to the next, where that leads to the end; the least
/// motion first.
fn followed_with_least_motion(problem: &PathProblem, starts: &[f64]) -> Vec<Vec<f64>> {
    let n = problem.n();
    let mut found: Vec<Vec<f64>> = apart(starts, n).into_iter().filter_map(|start| followed_from(problem, start)).collect();
    found.iter_mut().for_each(|q| close(problem, q));
    let motion: Vec<f64> = found.iter().map(|q| problem.motion_integral(0, q)).collect();
    ascending(&motion).into_iter().map(|i| std::mem::take(&mut found[i])).collect()
}

fn followed_from(problem: &PathProblem, start: &[f64]) -> Option<Vec<f64>> {
    let limits = problem.limits.then(|| problem.robot.limits());
    let mut rows = start.to_vec();
    let mut q = start.to_vec();
    for target in &problem.targets[1..] {
        if reach(&problem.robot, limits, &problem.task, target, problem.length, &mut q, ON_PATH, STEPS).error > ON_PATH {
            return None;
        }
        rows.extend_from_slice(&q);
    }
    Some(rows)
}

/// Some of the postures, each as far as can be from those before it.
fn apart(postures: &[f64], n: usize) -> Vec<&[f64]> {
    let rows: Vec<&[f64]> = postures.chunks_exact(n).collect();
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum::<f64>();
    let mut chosen: Vec<&[f64]> = rows.first().copied().into_iter().collect();
    let mut away: Vec<f64> = vec![f64::INFINITY; rows.len()];
    while let Some(last) = chosen.last().filter(|_| chosen.len() < FOLLOWED) {
        away.iter_mut().zip(&rows).for_each(|(away, row)| *away = away.min(far(row, last)));
        let most = (1..rows.len()).fold(0, |most, i| if away[i] > away[most] { i } else { most });
        if away[most] <= 0.0 {
            break;
        }
        chosen.push(rows[most]);
    }
    chosen
}
