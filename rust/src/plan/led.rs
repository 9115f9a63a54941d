//! A path led through the postures that are held along it: a rival of what a grid knows between them, whose cells are coarse beside a largest step.

use super::hooks::{Hooks, PlanError};
use super::part::{Part, refined_part};
use super::problem::PathProblem;

/// The parts, if they are the whole path; else what comes of leading the path from held posture to held posture, if that can be followed.
pub(super) fn or_led(problem: &PathProblem, parts: Vec<Part>, most: usize, hooks: &mut Hooks) -> Result<Vec<Part>, PlanError> {
    let whole = |part: &Part| part.failure.is_none() && part.len() == problem.points();
    if problem.pins.is_empty() || parts.first().is_some_and(whole) {
        return Ok(parts);
    }
    hooks.go_on()?;
    let Some(q) = led(problem) else { return Ok(parts) };
    let part = refined_part(problem, 0, &q, most, hooks)?;
    let (distance, angle) = problem.errors(&part.q);
    let on_path = distance.iter().zip(&angle).enumerate().all(|(i, (a, b))| a.max(*b) <= problem.pins.tolerance(i));
    Ok(if part.failure.is_none() && part.refined && on_path { vec![part] } else { parts })
}

/// Postures of all points: each from the one before it, a share of the way nearer to the next one that is held, by Newton onto the path; before the first
/// and behind the last that is held each from its neighbour alone. `None` where nothing is held, or Newton does not get there.
fn led(problem: &PathProblem) -> Option<Vec<f64>> {
    let (n, count) = (problem.n(), problem.points());
    let mut held: Vec<(usize, &[f64])> = problem.pins.points().filter_map(|point| Some((point, problem.pins.posture(point)?))).collect();
    let (first, start) = *held.first()?;
    if problem.closed && first == 0 {
        held.push((count - 1, start));
    }
    let mut q = vec![0.0; count * n];
    q[first * n..(first + 1) * n].copy_from_slice(start);
    let mut step = |point: usize, from: usize, towards: Option<(usize, &[f64])>| {
        let mut row = q[from * n..(from + 1) * n].to_vec();
        if let Some((goal, there)) = towards {
            let share = 1.0 / (goal - from) as f64;
            row.iter_mut().zip(there).for_each(|(x, there)| *x += share * (there - *x));
        }
        let reached = problem.restored(point, &mut row)[0];
        q[point * n..(point + 1) * n].copy_from_slice(&row);
        reached
    };
    let back = (0..first).rev().all(|point| step(point, point + 1, None));
    let on = (first + 1..count).all(|point| step(point, point - 1, held.iter().find(|(goal, _)| *goal >= point).copied()));
    (back && on).then_some(q)
}
