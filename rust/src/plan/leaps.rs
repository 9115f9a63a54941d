//! Steps from point to point that leap over what lies between: a ridge of the objective that is passed at one go is not seen at the points. The path is
//! divided there, so that what lies between counts as well, and the way is refined once more.

use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::numbers::interpolated;
use super::part::{Part, next_part};
use super::path::Path;
use super::problem::PathProblem;
use super::settings::PlanSettings;
use crate::error::Result;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, dot, norm, scale};
use crate::task::{Target, Task};

/// Part of the largest step from which on a step may be a leap.
const LEAP: f64 = 0.95;
/// Pieces in which such a step is divided.
const PIECES: usize = 4;
/// Times that steps are looked for: where one is divided another may leap.
const ROUNDS: usize = 4;

/// A whole part without leaps; as it is where there are none, or where what lies between cannot be passed.
pub(super) fn without_leaps(
    problem: &PathProblem,
    path: &Path,
    settings: &PlanSettings,
    part: Part,
    hooks: &mut Hooks,
) -> std::result::Result<Part, PlanError> {
    let looked_at = problem.steps_only() && problem.objective.is_some() && problem.pins.is_empty() && hooks.edge_cost.is_none();
    if !looked_at || !part.is_optimum() || part.len() != problem.points() {
        return Ok(part);
    }
    let n = problem.n();
    let mut pieces = vec![1; problem.points() - 1];
    let mut best = part;
    for _ in 0..ROUNDS {
        let share = |i: usize| (best.q[i + n] - best.q[i]).abs() / problem.bounds[i];
        let leaps = |edge: &usize| pieces[*edge] == 1 && (edge * n..(edge + 1) * n).any(|i| share(i) > LEAP);
        let leaps: Vec<usize> = (0..pieces.len()).filter(leaps).collect();
        if leaps.is_empty() {
            break;
        }
        leaps.iter().for_each(|&edge| pieces[edge] = PIECES);
        match passed(problem, path, settings, &best, &pieces, hooks)? {
            Some(part) => best = part,
            None => break,
        }
    }
    Ok(best)
}

/// The part refined over a path with some of its steps in pieces, at the path's own points; none where that leads to no optimum.
fn passed(
    problem: &PathProblem,
    path: &Path,
    settings: &PlanSettings,
    part: &Part,
    pieces: &[usize],
    hooks: &mut Hooks,
) -> std::result::Result<Option<Part>, PlanError> {
    let n = problem.n();
    let divided = PathProblem::new(problem.robot.clone(), &in_pieces(path, pieces)?, &problem.goal(), problem.objective.clone(), settings)?;
    let bounds = pieces.iter().enumerate().flat_map(|(edge, &count)| {
        let own = &problem.bounds[edge * n..(edge + 1) * n];
        (0..count).flat_map(move |_| own.iter().map(move |bound| bound / count as f64))
    });
    let divided = PathProblem { bounds: bounds.collect(), ..divided };
    let mut own = vec![0];
    pieces.iter().for_each(|count| own.push(own[own.len() - 1] + count));
    let known: Vec<f64> = own.iter().map(|&place| place as f64).collect();
    let start = interpolated((0..divided.points()).map(|place| place as f64), &known, &part.q, n);
    let found = next_part(&divided, 0, &start, settings.max_iterations, hooks)?;
    if !found.is_optimum() {
        return Ok(None);
    }
    let q: Vec<f64> = own.iter().flat_map(|&place| &found.q[place * n..(place + 1) * n]).copied().collect();
    let (value, motion) = (problem.values(&q), problem.motion_integral(0, &q));
    let own = match problem.criterion {
        Criterion::Minimax => value.iter().fold(f64::NEG_INFINITY, |worst, value| worst.max(*value)),
        Criterion::Integral => problem.weights.iter().zip(&value).map(|(weight, value)| weight * value).sum(),
    };
    Ok(Some(Part { cost: own + found.smoothness * motion, motion, q, value, ..found }))
}

/// A path with the ways between its points in pieces: straight in position, by the smallest turn in orientation.
fn in_pieces(path: &Path, pieces: &[usize]) -> Result<Path> {
    let (mut position, mut axis, mut rotation) = (Vec::new(), Vec::new(), Vec::new());
    for (edge, &count) in pieces.iter().enumerate() {
        for piece in 0..count {
            let t = piece as f64 / count as f64;
            let between = |from: Vec3, to: Vec3| if piece == 0 { from } else { add(scale(1.0 - t, from), scale(t, to)) };
            position.push(between(path.position()[edge], path.position()[edge + 1]));
            let (from, to) = (path.axis()[edge], path.axis()[edge + 1]);
            // There is no smallest turn between opposite axes.
            axis.push(if dot(from, to) > 0.0 { between(from, to) } else { from });
            if let Some(all) = path.rotation() {
                rotation.push(turned(all[edge], all[edge + 1], t));
            }
        }
    }
    let last = path.len() - 1;
    position.push(path.position()[last]);
    axis.push(path.axis()[last]);
    rotation.extend(path.rotation().map(|all| all[last]));
    Path::new(position, axis, path.rotation().map(|_| rotation), None)
}

/// Axes of a frame turned part of the way to those of another.
fn turned(from: [Vec3; 3], to: [Vec3; 3], t: f64) -> [Vec3; 3] {
    let (w, _) = Task::FULL.error(&Frame { axes: from, origin: [0.0; 3] }, &Target { position: [0.0; 3], axis: None, frame: to });
    let angle = norm(w);
    if angle == 0.0 || t == 0.0 { from } else { from.map(|axis| Frame::rotation(scale(1.0 / angle, w), t * angle).rotate(axis)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_between_turn_evenly() {
        let quarter = Frame::rotation([0.6, 0.0, 0.8], 1.2).axes;
        let start = Frame::rotation([0.0, 1.0, 0.0], 0.3).axes;
        let end = quarter.map(|axis| axis);
        let half = turned(start, end, 0.5);
        let again = turned(start, half, 1.0);
        for i in 0..3 {
            assert!((dot(again[i], half[i]) - 1.0).abs() < 1e-12);
            assert!((dot(turned(half, end, 1.0)[i], end[i]) - 1.0).abs() < 1e-12);
        }
        let angle = |a: [Vec3; 3], b: [Vec3; 3]| ((0..3).map(|i| dot(a[i], b[i])).sum::<f64>() - 1.0).clamp(-2.0, 2.0) / 2.0;
        assert!((angle(start, half) - angle(half, end)).abs() < 1e-12);
    }
}
