//! A path led through what is held along it: a rival of what a grid knows between pins, whose cells are coarse beside a largest step.

use super::hooks::{Hooks, PlanError};
use super::layers::Layers;
use super::part::{Part, best_part, refined_part};
use super::problem::{ON_PATH, PathProblem};
use crate::inverse::reach;

/// Postures at most from which a path is led whose pins are spins alone.
const STARTS: usize = 8;
/// Error at which Newton ends [rad, m over the length], and its steps at most.
const REACHED: f64 = 1e-12;
const ITERATIONS: usize = 20;

/// The parts, if they are the whole path; else what comes of leading the path from pin to pin, if that can be followed.
pub(super) fn or_led(
    problem: &PathProblem,
    known: &Layers,
    parts: Vec<Part>,
    most: usize,
    hooks: &mut Hooks,
) -> Result<Vec<Part>, PlanError> {
    let whole = |part: &Part| part.failure.is_none() && part.len() == problem.points();
    let Some(first) = problem.pins.points().next().filter(|_| !parts.first().is_some_and(whole)) else { return Ok(parts) };
    let held: Vec<(usize, Vec<f64>)> =
        problem.pins.points().filter_map(|point| Some((point, problem.pins.posture(point)?.to_vec()))).collect();
    let starts =
        if held.is_empty() { known.best_postures(first, STARTS).into_iter().map(|q| vec![(first, q)]).collect() } else { vec![held] };
    let spun = PathProblem { pins: problem.pins.spun(problem), ..problem.clone() };
    let ways = starts.iter().flat_map(|held| [(problem, held), (&spun, held)]);
    let mut found = Vec::new();
    for (with, held) in ways {
        hooks.go_on()?;
        let Some(q) = led(with, held) else { continue };
        let part = refined_part(problem, 0, &q, most, hooks)?;
        let (distance, angle) = problem.errors(&part.q);
        let on_path = distance.iter().zip(&angle).enumerate().all(|(i, (a, b))| a.max(*b) <= problem.pins.tolerance(i));
        if part.is_optimum() && on_path {
            found.push(part);
        }
    }
    Ok(if found.is_empty() { parts } else { vec![best_part(problem.criterion, found)] })
}

/// Postures of all points: each from the one before it, a share of the way nearer to the next posture of `held`, by Newton onto the path and what is held
/// there; before the first of `held` and behind the last each from its neighbour alone. `None` where Newton does not get there.
#[inline(never)]
fn led(problem: &PathProblem, held: &[(usize, Vec<f64>)]) -> Option<Vec<f64>> {
    let (n, count, mut held) = (problem.n(), problem.points(), held.to_vec());
    let (first, start) = held.first()?.clone();
    if problem.closed && first == 0 {
        held.push((count - 1, start.clone()));
    }
    let mut q = vec![0.0; count * n];
    q[first * n..(first + 1) * n].copy_from_slice(&start);
    let mut step = |point: usize, from: usize, towards: Option<&(usize, Vec<f64>)>| {
        let mut row = q[from * n..(from + 1) * n].to_vec();
        if let Some((goal, there)) = towards {
            let share = 1.0 / (*goal - from) as f64;
            row.iter_mut().zip(there).for_each(|(x, there)| *x += share * (there - *x));
        }
        let reached = within(problem, point, &mut row) || problem.restored(point, &mut row)[0];
        q[point * n..(point + 1) * n].copy_from_slice(&row);
        reached
    };
    let back = (0..first).rev().all(|point| step(point, point + 1, None));
    let on = (first + 1..count).all(|point| step(point, point - 1, held.iter().find(|(goal, _)| *goal >= point)));
    (back && on).then_some(q)
}

/// Brings a posture onto a point within limits; whether it got there.
fn within(problem: &PathProblem, point: usize, q: &mut [f64]) -> bool {
    if !problem.limits || problem.pins.posture(point).is_some() {
        return false;
    }
    let (task, target) = problem.wanted(point);
    let limits = Some(problem.robot.limits());
    let mut row = q.to_vec();
    let reached = reach(&problem.robot, limits, task, target, problem.length, &mut row, REACHED, ITERATIONS).error <= ON_PATH;
    if reached {
        q.copy_from_slice(&row);
    }
    reached
}
