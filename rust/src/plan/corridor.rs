//! Ways whose steps cost what the caller says, of which no derivatives are known: the better of a route and its optimum without these costs, made
//! better in a corridor around it that narrows (iterative dynamic programming, Luus 1990).

use super::edges::{Asked, BATCH};
use super::failure::{FailureCause, PlanFailure};
use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::part::{Part, best_part};
use super::path::point_weights;
use super::problem::PathProblem;
use crate::linalg::MAX_JOINTS;

/// Half the width of the corridor at the start and at the end [rad or m].
const WIDEST: f64 = 0.1;
const NARROWEST: f64 = 1e-5;
/// Factor by which it narrows where nothing much is gained, and what that is, relative.
const NARROWER: f64 = 0.5;
const LITTLE: f64 = 1e-6;
/// Searches of the corridor at most.
const MAX_SEARCHES: usize = 200;

/// A part with what its steps cost, or the `route` that it was refined from where that is worth more: the refinement does not know of these
/// costs. Without a caller's cost the part as it is.
pub(super) fn weighed(problem: &PathProblem, part: Part, route: &[f64], hooks: &mut Hooks) -> Result<Part, PlanError> {
    if hooks.edge_cost.is_none() {
        return Ok(part);
    }
    let (first, mut rows) = (part.first, route.to_vec());
    let reached = problem.restored(first, &mut rows).into_iter().all(|reached| reached);
    problem.settle(first, &mut rows);
    let part = priced(problem, part, hooks)?;
    if !(reached && problem.holds(first, &rows) && hooks.all_allowed(&rows, problem.n())?) {
        return Ok(part);
    }
    let value = problem.values(&rows);
    let smoothness = part.smoothness;
    let route = Part { q: rows, value, residual: f64::NAN, refined: false, failure: None, ..part.clone() };
    let route = priced(problem, Part { smoothness, ..route }, hooks)?;
    Ok(best_part(problem.criterion, vec![part, route]))
}

/// A part with its cost as its postures have it, steps included; it fails where one of them is forbidden.
fn priced(problem: &PathProblem, mut part: Part, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let n = problem.n();
    let (mut asked, mut costs) = (Asked::new(n), Vec::new());
    for (before, after) in part.q.chunks_exact(n).zip(part.q[n..].chunks_exact(n)) {
        asked.push(before, after.iter().copied());
        asked.answer_if(BATCH, &mut costs, hooks)?;
    }
    asked.answer_if(1, &mut costs, hooks)?;
    part.motion = problem.motion_integral(part.first, &part.q);
    part.edge_cost = costs.iter().sum();
    part.cost = cost(problem, &part);
    if let (Some(step), None) = (costs.iter().position(|cost| cost.is_infinite()), &part.failure) {
        part.failure = Some(PlanFailure::at(part.first + step + 1, FailureCause::EdgeCost));
        part.refined = false;
    }
    Ok(part)
}

/// The cost of a part by its values, its motion and what its steps cost.
pub(super) fn cost(problem: &PathProblem, part: &Part) -> f64 {
    match problem.criterion {
        Criterion::Minimax => part.worst() + part.smoothness * (part.motion + part.edge_cost),
        Criterion::Integral => {
            let value: f64 = shares(problem, part).0.iter().zip(&part.value).map(|(weight, value)| weight * value).sum();
            value + part.smoothness * part.motion + part.edge_cost
        }
    }
}

/// What each point of a part stands for, and each of its steps.
fn shares(problem: &PathProblem, part: &Part) -> (Vec<f64>, Vec<f64>) {
    let steps = &problem.steps[part.first..part.first + part.len() - 1];
    let total: f64 = steps.iter().sum();
    let steps: Vec<f64> = steps.iter().map(|step| step / total).collect();
    (point_weights(&steps, closes(problem, part)), steps)
}

/// Whether a part ends in the posture it begins with.
fn closes(problem: &PathProblem, part: &Part) -> bool {
    problem.closed && part.len() == problem.points() && part.len() > 2
}

/// A part made better as far as postures next to it along their free motions allow. Without a caller's cost the part as it is.
pub(super) fn polished(problem: &PathProblem, mut part: Part, hooks: &mut Hooks) -> Result<Part, PlanError> {
    // A step of its own that is forbidden it may lose, what ends it or a limit not.
    let own = |failure: &PlanFailure| failure.cause == FailureCause::EdgeCost && failure.point < part.first + part.len();
    let broken = part.failure.as_ref().is_some_and(|failure| !own(failure));
    if hooks.edge_cost.is_none() || part.len() < 2 || problem.freedoms() == 0 || broken {
        return Ok(part);
    }
    let mut width = WIDEST;
    for _ in 0..MAX_SEARCHES {
        let Some(corridor) = Corridor::new(problem, &part, width, hooks)? else { break };
        let before = rank(problem, &part);
        let better = match corridor.best(problem, &part, hooks)? {
            Some(q) => {
                let value = problem.values(&q);
                let moved = Part { q, value, failure: None, residual: f64::NAN, ..part.clone() };
                Some(priced(problem, moved, hooks)?).filter(|moved| moved.failure.is_none() && rank(problem, moved) < before)
            }
            None => None,
        };
        let gain = better.as_ref().map_or(0.0, |better| before - rank(problem, better));
        part = better.unwrap_or(part);
        if gain <= LITTLE * before.abs() {
            width *= NARROWER;
        }
        part.refined = width < NARROWEST && part.failure.is_none();
        if width < NARROWEST {
            break;
        }
    }
    Ok(part)
}

/// What the corridor makes less of: the cost; for a worst value, which stays no worse, motion and steps.
fn rank(problem: &PathProblem, part: &Part) -> f64 {
    match problem.criterion {
        Criterion::Minimax => part.motion + part.edge_cost,
        Criterion::Integral => part.cost,
    }
}

/// Postures on the path, a few at every point: those of a part, and those that lie one width along each of its free motions.
struct Corridor {
    /// Postures, one choice at all points after another, n joints a row.
    q: Vec<Vec<f64>>,
    /// What each is worth by itself; infinite where it is out.
    own: Vec<Vec<f64>>,
}

impl Corridor {
    /// `None` where a posture has no free motion that can be told.
    fn new(problem: &PathProblem, part: &Part, width: f64, hooks: &mut Hooks) -> Result<Option<Self>, PlanError> {
        let (n, freedoms) = (problem.n(), problem.freedoms());
        let Some(basis) = free_motions(problem, &part.q) else { return Ok(None) };
        let (worst, weights) = (part.worst(), shares(problem, part).0);
        let mut corridor = Self { q: vec![part.q.clone()], own: Vec::new() };
        for along in 0..freedoms {
            for side in [-width, width] {
                let mut rows = part.q.clone();
                for (i, row) in rows.chunks_exact_mut(n).enumerate() {
                    let free = &basis[(i * freedoms + along) * n..(i * freedoms + along + 1) * n];
                    row.iter_mut().zip(free).for_each(|(x, free)| *x += side * free);
                }
                corridor.q.push(rows);
            }
        }
        for (choice, rows) in corridor.q.iter_mut().enumerate() {
            let mut kept = if choice == 0 { vec![true; part.len()] } else { problem.restored(part.first, rows) };
            if choice > 0 && closes(problem, part) {
                // The last posture is the first, whole turns away.
                let last = rows.len() - n;
                for k in 0..n {
                    rows[last + k] = rows[k] + part.q[last + k] - part.q[k];
                }
            }
            problem.settle(part.first, rows);
            let value = problem.values(rows);
            for (i, kept) in kept.iter_mut().enumerate() {
                let within = problem.is_within(part.first + i, &rows[i * n..(i + 1) * n]);
                *kept &= choice == 0 || (within && value[i].is_finite());
                *kept &= problem.criterion == Criterion::Integral || value[i] <= worst;
            }
            if choice > 0 {
                let asked: Vec<f64> =
                    rows.chunks_exact(n).zip(&kept).filter(|(_, kept)| **kept).flat_map(|(row, _)| row).copied().collect();
                if let Some(allowed) = hooks.allowed(&asked, n)? {
                    kept.iter_mut().filter(|kept| **kept).zip(allowed).for_each(|(kept, allowed)| *kept = allowed);
                }
            }
            let own = |i: usize| match (kept[i], problem.criterion) {
                (false, _) => f64::INFINITY,
                (true, Criterion::Minimax) => 0.0,
                (true, Criterion::Integral) => weights[i] * value[i],
            };
            corridor.own.push((0..part.len()).map(own).collect());
        }
        Ok(Some(corridor))
    }

    /// The best way through it; `None` if there is none.
    fn best(&self, problem: &PathProblem, part: &Part, hooks: &mut Hooks) -> Result<Option<Vec<f64>>, PlanError> {
        let steps = self.steps(problem, part, hooks)?;
        let choices = self.q.len();
        let mut best: (f64, Vec<usize>) = (f64::INFINITY, Vec::new());
        // A path that closes ends in the choice that it begins with.
        for start in 0..if closes(problem, part) { choices } else { 1 } {
            let ends = if closes(problem, part) { start..start + 1 } else { 0..choices };
            let found = self.way(&steps, part.len(), &ends);
            if found.0 < best.0 {
                best = found;
            }
        }
        let n = problem.n();
        let rows = |(i, &choice): (usize, &usize)| self.q[choice][i * n..(i + 1) * n].to_vec();
        Ok((!best.1.is_empty()).then(|| best.1.iter().enumerate().flat_map(rows).collect()))
    }

    /// The cheapest way that starts and ends in some of the choices.
    fn way(&self, steps: &[f64], count: usize, ends: &std::ops::Range<usize>) -> (f64, Vec<usize>) {
        let choices = self.q.len();
        let open = |choice: usize| if ends.contains(&choice) { self.own[choice][0] } else { f64::INFINITY };
        let mut label: Vec<f64> = (0..choices).map(open).collect();
        let mut back = vec![0; count * choices];
        for i in 1..count {
            let mut next = vec![f64::INFINITY; choices];
            for to in 0..choices {
                for from in 0..choices {
                    let cost = label[from] + steps[((i - 1) * choices + to) * choices + from] + self.own[to][i];
                    if cost < next[to] {
                        (next[to], back[i * choices + to]) = (cost, from);
                    }
                }
            }
            label = next;
        }
        let (mut choice, mut cost) = (0, f64::INFINITY);
        for end in ends.clone() {
            if label[end] < cost {
                (choice, cost) = (end, label[end]);
            }
        }
        let mut way = vec![choice; if cost.is_finite() { count } else { 0 }];
        for i in (1..way.len()).rev() {
            way[i - 1] = back[i * choices + way[i]];
        }
        (cost, way)
    }

    /// What it costs to move from each choice at a point to each at the next, infinite where that is too far: by the step, where it ends, and where
    /// it begins.
    fn steps(&self, problem: &PathProblem, part: &Part, hooks: &mut Hooks) -> Result<Vec<f64>, PlanError> {
        let (n, choices) = (problem.n(), self.q.len());
        let weight = if problem.criterion == Criterion::Minimax { 1.0 } else { part.smoothness };
        let shares = shares(problem, part).1;
        let mut costs = vec![f64::INFINITY; shares.len() * choices * choices];
        let (mut asked, mut places, mut answers) = (Asked::new(n), Vec::new(), Vec::new());
        for (i, share) in shares.iter().enumerate() {
            let bounds = &problem.bounds[(part.first + i) * n..(part.first + i + 1) * n];
            for to in (0..choices).filter(|&to| self.own[to][i + 1].is_finite()) {
                for from in (0..choices).filter(|&from| self.own[from][i].is_finite()) {
                    let (before, after) = (&self.q[from][i * n..(i + 1) * n], &self.q[to][(i + 1) * n..(i + 2) * n]);
                    // What the part does already it may do.
                    if (from == 0 && to == 0) || (0..n).all(|k| (after[k] - before[k]).abs() <= bounds[k]) {
                        let place = (i * choices + to) * choices + from;
                        costs[place] = weight / share * problem.joint_weights.squares(|k| after[k] - before[k]);
                        places.push(place);
                        asked.push(before, after.iter().copied());
                    }
                }
            }
            asked.answer_if(BATCH, &mut answers, hooks)?;
        }
        asked.answer_if(1, &mut answers, hooks)?;
        places.into_iter().zip(answers).for_each(|(place, answer)| costs[place] += answer);
        Ok(costs)
    }
}

/// Orthonormal bases of the free motions of postures, one vector after another; `None` where one is singular for its task.
fn free_motions(problem: &PathProblem, q: &[f64]) -> Option<Vec<f64>> {
    let (n, freedoms) = (problem.n(), problem.freedoms());
    let padded = |row: &[f64]| -> [f64; MAX_JOINTS] { std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0)) };
    let rows: Vec<_> = q.chunks_exact(n).map(padded).collect();
    let free = PathProblem { objective: None, ..problem.clone() };
    let points = free.points_at(&rows)?;
    Some(points.iter().flat_map(|point| point.basis[..freedoms].iter().flat_map(|free| free[..n].to_vec())).collect())
}
