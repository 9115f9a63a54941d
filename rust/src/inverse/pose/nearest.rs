//! The nearest posture to a pose that is not reached: Newton on the cost itself with its second derivatives, within all limits.

use super::attempt::{Problem as Search, combinations, unit_of};
use super::goal::{Goal, Left};
use crate::kinematics::jacobian_at;
use crate::kinematics::sized::first_derivative;
use crate::linalg::MAX_JOINTS;
use crate::linalg::cholesky::Cholesky;
use crate::linalg::vector::{Vec3, dot};
use crate::qp::{self, ActiveSet, DenseRow, Problem, Status};
use crate::robot::{MAX_COMBINATIONS, Robot};

/// A posture is stationary where a step along the gradient of half the cost, over L^2 and within the limits, moves no joint by more than this \[rad, or m over
/// the length\], of a cost of L^2 or less.
const STATIONARY: f64 = 1e-7;
/// What is aimed for.
const AIM: f64 = 1e-11;
/// Largest motion of a joint in one step \[rad, or m over the length\].
const LARGEST_STEP: f64 = 0.5;
/// A step is kept where the cost falls by this part of what was foretold.
const KEPT: f64 = 1e-4;
/// Where less than this part of the cost is foretold its rounding hides the fall: a step is kept where the slope falls, and the cost rises by rounding alone.
const FLAT: f64 = 1e-9;
const ROUNDING: f64 = 1e-13;
/// Least curvature, over that of a unit turn at the length.
const LEAST_CURVATURE: f64 = 1e-9;
/// First curvature that is added where that of the cost is not positive or a step was refused.
const ADDED: f64 = 1e-3;
/// A curvature below minus this is one: the posture is no minimum.
const SADDLE: f64 = 1e-6;
/// How far a posture is moved from a saddle \[rad, or m over the length\], and how often.
const NUDGE: f64 = 0.03;
const NUDGES: usize = 3;

type Wide = [f64; MAX_JOINTS];
type Square = [Wide; MAX_JOINTS];

/// Where the way down ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    pub q: Wide,
    pub left: Left,
    /// What the search makes least.
    pub cost: f64,
    pub stationary: bool,
    pub steps: usize,
}

/// The cost, half of its gradient and of its second derivative, by joints in their units.
struct Model {
    cost: f64,
    left: Left,
    g: Wide,
    h: Square,
}

/// Goes down from `start` in at most so many steps.
#[inline(never)]
pub(super) fn nearest(problem: &Search, start: &[f64], most: usize, seen: &mut Option<Vec<f64>>) -> Nearest {
    let Search { robot, goal, .. } = problem;
    let n = robot.n();
    let mut q = [0.0; MAX_JOINTS];
    q[..n].copy_from_slice(&start[..n]);
    let (mut added, mut nudges) = (0.0, 0);
    let mut here = model(robot, goal, &q[..n]);
    let bar = |cost: f64| (1.0 + cost.sqrt() / goal.length) * goal.length.powi(2);
    let slope_of = |q: &Wide, here: &Model| {
        let square = goal.length.powi(2);
        square * largest(&Room::of(problem, &q[..n]).step(&here.g, &scaled(square, n)))
    };
    let end = |q: Wide, here: &Model, slope: f64, steps: usize| Nearest {
        q,
        left: here.left,
        cost: here.cost,
        stationary: slope <= STATIONARY * bar(here.cost),
        steps,
    };
    for steps in 0..most {
        let room = Room::of(problem, &q[..n]);
        let slope = slope_of(&q, &here);
        if slope <= AIM * bar(here.cost) {
            if nudges == NUDGES || !nudge(problem, &here, &mut q) {
                return end(q, &here, slope, steps);
            }
            nudges += 1;
            here = model(robot, goal, &q[..n]);
            continue;
        }
        let h = convex(&freed(problem, &here, &q), n, &mut added, goal.length.powi(2));
        let step = room.step(&here.g, &h);
        let mut trial = q;
        for i in 0..n {
            let unit = unit_of(robot.joints()[i], goal.length);
            trial[i] = problem.held(i, q[i] + unit * step[i]);
        }
        let foretold = -(0..n).map(|i| step[i] * (2.0 * here.g[i] + (0..n).map(|k| h[i][k] * step[k]).sum::<f64>())).sum::<f64>();
        let there = model(robot, goal, &trial[..n]);
        if let Some(seen) = seen {
            seen.push(goal.cost(&there.left));
        }
        let flat = foretold <= FLAT * here.cost && there.cost <= (1.0 + ROUNDING) * here.cost && slope_of(&trial, &there) < slope;
        if foretold > 0.0 && (flat || here.cost - there.cost >= KEPT * foretold) {
            added *= 0.1;
            (q, here) = (trial, there);
        } else {
            added = f64::max(8.0 * added, ADDED);
            // Rounding allows no further decrease.
            if added > 1e9 || foretold <= f64::EPSILON * here.cost {
                return end(q, &here, slope, steps);
            }
        }
    }
    end(q, &here, slope_of(&q, &here), most)
}

/// Half the gradient and half the second derivative of the cost; by Gauss and Newton alone where the task is no distance of points and axes.
fn model(robot: &Robot, goal: &Goal, q: &[f64]) -> Model {
    let n = q.len();
    let (tool, columns) = jacobian_at(robot, q);
    let left = goal.left(&tool);
    let units: Wide = std::array::from_fn(|i| robot.joints().get(i).map_or(1.0, |joint| unit_of(*joint, goal.length)));
    let (mut g, mut h) = ([0.0; MAX_JOINTS], [[0.0; MAX_JOINTS]; MAX_JOINTS]);
    let Some(pairs) = goal.pairs(&tool) else {
        let (rows, b, m) = goal.rows(&tool, &columns, &left, false);
        for i in 0..n {
            g[i] = -units[i] * (0..m).map(|r| rows[r][i] * b[r]).sum::<f64>();
            for k in 0..n {
                h[i][k] = units[i] * units[k] * rows.iter().map(|row| row[i] * row[k]).sum::<f64>();
            }
        }
        return Model { cost: b.iter().map(|x| x * x).sum(), left, g, h };
    };
    let mut bending = [0.0; 6 * MAX_JOINTS * MAX_JOINTS];
    first_derivative(&columns, &mut bending);
    let rate = |first: usize, i: usize, k: usize| -> Vec3 { std::array::from_fn(|r| bending[((first + r) * n + i) * n + k]) };
    let (square, torque, turned) = (goal.length.powi(2), pairs.torque(), goal.torque_rates(&tool, &pairs));
    for i in 0..n {
        let (w, v) = (columns.w[i], columns.v[i]);
        g[i] = -units[i] * (dot(v, left.1) + square * dot(w, torque));
        for k in 0..n {
            let along = dot(v, columns.v[k]) - dot(left.1, rate(3, i, k));
            let about = dot(torque, rate(0, i, k)) + dot(w, weighted(&turned, columns.w[k]));
            h[i][k] = units[i] * units[k] * (along - square * about);
        }
    }
    for i in 0..n {
        for k in 0..i {
            let mean = 0.5 * (h[i][k] + h[k][i]);
            (h[i][k], h[k][i]) = (mean, mean);
        }
    }
    Model { cost: goal.cost(&left), left, g, h }
}

/// Columns weighted and added.
fn weighted(columns: &[Vec3; 3], by: Vec3) -> Vec3 {
    std::array::from_fn(|r| (0..3).map(|k| columns[k][r] * by[k]).sum())
}

/// What the limits leave of a step, by joints in their units.
struct Room {
    n: usize,
    low: Wide,
    high: Wide,
    rows: [DenseRow<MAX_JOINTS>; MAX_COMBINATIONS],
    count: usize,
}

impl Room {
    fn of(problem: &Search, q: &[f64]) -> Self {
        let (robot, limits, n) = (problem.robot, problem.robot.limits(), q.len());
        let (mut low, mut high) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        let (mut rows, count) = combinations(limits, q);
        for i in 0..n {
            let unit = unit_of(robot.joints()[i], problem.goal.length);
            (low[i], high[i]) = (-LARGEST_STEP, LARGEST_STEP);
            if problem.turning >> i & 1 == 0 {
                low[i] = ((limits.q_min[i] - q[i]) / unit).clamp(-LARGEST_STEP, 0.0);
                high[i] = ((limits.q_max[i] - q[i]) / unit).clamp(0.0, LARGEST_STEP);
            }
            rows.iter_mut().take(count).for_each(|row| row.a[i] *= unit);
        }
        Self { n, low, high, rows, count }
    }

    /// The step that makes `g x + x h x / 2` least; none where rounding leaves none.
    fn step(&self, g: &Wide, h: &Square) -> Wide {
        let problem = Problem { n: self.n, h, g, lower: &self.low, upper: &self.high, rows: &self.rows[..self.count] };
        let found = qp::minimise(&problem, &ActiveSet::default());
        if found.status == Status::Solved { found.x } else { [0.0; MAX_JOINTS] }
    }
}

/// A second derivative that is positive: with as much added to its diagonal as that takes, which is remembered.
fn convex(h: &Square, n: usize, added: &mut f64, square: f64) -> Square {
    loop {
        let mut out = *h;
        (0..n).for_each(|i| out[i][i] += square * (LEAST_CURVATURE + *added));
        if Cholesky::new(&out, n).is_some() || *added > 1e12 {
            return out;
        }
        *added = f64::max(4.0 * *added, ADDED);
    }
}

/// The second derivative of the joints that their limits do not hold: only these have to have a minimum.
fn freed(problem: &Search, here: &Model, q: &Wide) -> Square {
    let (limits, n, square) = (problem.robot.limits(), problem.robot.n(), problem.goal.length.powi(2));
    let mut h = here.h;
    for i in (0..n).filter(|i| problem.turning >> i & 1 == 0) {
        if (q[i] <= limits.q_min[i] && here.g[i] > 0.0) || (q[i] >= limits.q_max[i] && here.g[i] < 0.0) {
            (0..n).for_each(|k| (h[i][k], h[k][i]) = (0.0, 0.0));
            h[i][i] = square;
        }
    }
    h
}

/// Moves a stationary posture that is no minimum of its free joints a little; whether it is such a one.
fn nudge(problem: &Search, here: &Model, q: &mut Wide) -> bool {
    let Search { robot, goal, .. } = problem;
    let (limits, n) = (robot.limits(), robot.n());
    let mut free = freed(problem, here, q);
    (0..n).for_each(|i| free[i][i] += goal.length.powi(2) * SADDLE);
    if !limits.coupled.is_empty() || Cholesky::new(&free, n).is_some() {
        return false;
    }
    for i in 0..n {
        let by = NUDGE * unit_of(robot.joints()[i], goal.length) * if i % 2 == 0 { 1.0 } else { -0.7 };
        q[i] = problem.held(i, q[i] + by);
    }
    true
}

/// A multiple of the identity.
fn scaled(by: f64, n: usize) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|k| if i == k && i < n { by } else { 0.0 }))
}

fn largest(x: &Wide) -> f64 {
    x.iter().fold(0.0, |most, x| most.max(x.abs()))
}
