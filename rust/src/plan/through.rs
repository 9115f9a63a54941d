//! Singular points at the ends of a way: no posture of theirs is a neighbour of others, so that a search begins beside them. The way is continued onto
//! them, each posture from the one beside it.

use super::hooks::{Hooks, PlanError};
use super::layers::{Layers, Segment};
use super::part::Part;
use super::postures::postures_by_newton;
use super::problem::PathProblem;
use super::rivals::best_of;

/// A part with the singular points before and behind it, as far as the joints are continuous.
pub(super) fn with_singular_ends(problem: &PathProblem, known: &mut Layers, mut part: Part, hooks: &mut Hooks) -> Result<Part, PlanError> {
    if part.failure.is_some() {
        return Ok(part);
    }
    let n = problem.n();
    let singular = |known: &mut Layers, point: usize, hooks: &mut Hooks| {
        known.add(&[point], hooks)?;
        Ok::<bool, PlanError>(known.is_singular(point))
    };
    while part.first > 0 && singular(known, part.first - 1, hooks)? {
        let Some((row, value)) = beside(problem, part.first - 1, part.first - 1, &part.q[..n]) else { break };
        part.q.splice(0..0, row);
        part.value.insert(0, value);
        (part.first, part.refined) = (part.first - 1, false);
    }
    while part.first + part.len() < problem.points() && singular(known, part.first + part.len(), hooks)? {
        let next = part.first + part.len();
        let Some((row, value)) = beside(problem, next, next - 1, &part.q[(part.len() - 1) * n..]) else { break };
        part.q.extend(row);
        part.value.push(value);
        part.refined = false;
    }
    Ok(part)
}

/// A way along a path whose points are all singular, from a posture that Newton finds at the first; none if they are not, or it finds none.
pub(super) fn singular_way(problem: &PathProblem, known: &mut Layers, most: usize, hooks: &mut Hooks) -> Result<Option<Part>, PlanError> {
    known.add(&[0], hooks)?;
    if !known.is_singular(0) {
        return Ok(None);
    }
    let n = problem.n();
    let starts = postures_by_newton(problem, 0);
    let Some(start) = starts.chunks_exact(n).next() else { return Ok(None) };
    let only = Segment { points: vec![0], q: start.to_vec(), blocked: None, way: 0 };
    let (part, _) = best_of(problem, known, &[only], most, hooks)?;
    with_singular_ends(problem, known, part, hooks).map(Some)
}

/// The posture of a point that is next to one of a point beside it, with its value; none where it is out of reach, beyond a limit, or a step too far.
fn beside(problem: &PathProblem, point: usize, edge: usize, from: &[f64]) -> Option<(Vec<f64>, f64)> {
    let n = problem.n();
    let mut row = from.to_vec();
    let reached = problem.restored(point, &mut row)[0] && problem.is_within(point, &row);
    let near = row.iter().zip(from).zip(&problem.bounds[edge * n..]).all(|((a, b), bound)| (a - b).abs() <= *bound);
    (reached && near).then(|| {
        let value = problem.values(&row)[0];
        (row, value)
    })
}
