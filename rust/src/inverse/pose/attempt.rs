//! One search for a pose from one start: damped Newton within limits, given up early where it does not get on.

use std::f64::consts::TAU;

use super::goal::{Goal, Left};
use crate::inverse::coupled::least_squares;
use crate::kinematics::sized::jacobian;
use crate::linalg::damped::damped_step;
use crate::linalg::vector::norm;
use crate::linalg::{MAX_JOINTS, Row6, Rows6, size};
use crate::qp::DenseRow;
use crate::robot::{AT_LIMIT, Joint, Limits, MAX_COMBINATIONS, Robot};

/// Damping relative to the squared error (Sugihara 2011).
const DAMPING: f64 = 0.02;
/// Least damping, relative to the squared size of the Jacobian.
const LEAST_DAMPING: f64 = 1e-10;
/// Largest motion of a joint in one step \[rad, or m over the length\].
const LARGEST_STEP: f64 = 1.5;
/// After so many steps the squared error has to be such a part of what it was, else the start is given up.
const GETS_ON: (usize, f64) = (4, 0.3);
/// The same where other starts have failed: near singular postures steps are small.
const PATIENT: (usize, f64) = (8, 0.7);

/// What a search is for, beside the robot: where it ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Position error \[m\].
    pub position: f64,
    /// Orientation error \[rad\].
    pub orientation: f64,
    /// Steps.
    pub steps: usize,
    /// Whether to go on where little is gained.
    pub patient: bool,
}

impl Bounds {
    /// Whether what is left is within them.
    #[inline(always)]
    pub fn hold(&self, (w, v): &Left) -> bool {
        norm(*v) <= self.position && norm(*w) <= self.orientation
    }
}

/// What every start has in common.
pub(super) struct Problem<'a> {
    pub robot: &'a Robot,
    pub goal: Goal<'a>,
    pub bounds: Bounds,
    /// Joints that may turn once round: beyond a limit they go on at the other end. One bit a joint.
    pub turning: u32,
}

impl<'a> Problem<'a> {
    pub fn new(robot: &'a Robot, goal: Goal<'a>, bounds: Bounds) -> Self {
        let limits = robot.limits();
        let once_round = |i: &usize| robot.is_periodic(*i) && limits.q_max[*i] - limits.q_min[*i] >= TAU - AT_LIMIT;
        let turning = if limits.coupled.is_empty() { (0..robot.n()).filter(once_round).fold(0, |bits, i| bits | 1 << i) } else { 0 };
        Self { robot, goal, bounds, turning }
    }

    /// A coordinate within the limits of its joint.
    #[inline(always)]
    pub fn held(&self, i: usize, x: f64) -> f64 {
        let limits = self.robot.limits();
        let inside = x.clamp(limits.q_min[i], limits.q_max[i]);
        if inside == x || self.turning >> i & 1 == 0 {
            return inside;
        }
        (x + TAU.copysign(inside - x)).clamp(limits.q_min[i], limits.q_max[i])
    }
}

/// Where a search ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt<const C: usize> {
    /// The posture with the least error on the way.
    pub q: [f64; C],
    /// What is left there.
    pub left: Left,
    /// Its square, angles times the length.
    pub square: f64,
    /// Steps taken.
    pub steps: usize,
}

/// Searches from `q`, which is within the limits; each error that is met is shown to `seen`.
#[inline(never)]
pub(super) fn attempt<const C: usize>(problem: &Problem, start: &[f64], seen: &mut Option<Vec<f64>>) -> Attempt<C> {
    let Problem { robot, goal, bounds, .. } = problem;
    let n = size::<C>(robot.n());
    let mut q = [0.0; C];
    q[..n].copy_from_slice(&start[..n]);
    let mut best = Attempt { q, left: ([f64::INFINITY; 3], [f64::INFINITY; 3]), square: f64::INFINITY, steps: 0 };
    let (every, part) = if problem.bounds.patient { PATIENT } else { GETS_ON };
    let (mut watched, mut reached) = (f64::INFINITY, false);
    for steps in 0..=bounds.steps {
        let (tool, columns) = jacobian::<C>(robot, &q[..n]);
        let left = goal.left(&tool);
        let (rows, b, m) = goal.rows(&tool, &columns, &left, bounds.patient);
        let square: f64 = b.iter().map(|x| x * x).sum();
        if let Some(seen) = seen {
            seen.push(goal.cost(&left));
        }
        best.steps = steps;
        let within = bounds.hold(&left);
        if (within && !reached) || (square < best.square && (within || !reached)) {
            (best.q, best.left, best.square) = (q, left, square);
        }
        // One step more than is asked for: it squares the error.
        if reached || square.is_nan() {
            break;
        }
        reached = within;
        if steps % every == 0 && !reached {
            if square > part * watched {
                break;
            }
            watched = square;
        }
        let moved = move_within::<C>(problem, &rows, &b, m, square, &mut q);
        if !moved {
            break;
        }
    }
    best
}

/// Takes one damped step; joints that stand at a limit and would cross it are held, and the others make up for them. Whether any joint moves.
#[inline(always)]
fn move_within<const C: usize>(problem: &Problem, rows: &Rows6<C>, b: &Row6, m: usize, square: f64, q: &mut [f64; C]) -> bool {
    let (robot, limits) = (problem.robot, problem.robot.limits());
    let n = size::<C>(robot.n());
    let scale: f64 = rows.iter().flatten().map(|x| x * x).sum();
    let damping = DAMPING * square + LEAST_DAMPING * scale;
    let mut step = if limits.coupled.is_empty() {
        let mut rows = *rows;
        let mut step = damped_step(&rows, b, damping, n, m);
        loop {
            let mut stopped = false;
            for i in 0..n {
                let blocked = (q[i] <= limits.q_min[i] && step[i] < 0.0) || (q[i] >= limits.q_max[i] && step[i] > 0.0);
                if blocked && problem.turning >> i & 1 == 0 {
                    stopped = true;
                    rows.iter_mut().for_each(|row| row[i] = 0.0);
                }
            }
            if !stopped {
                break step;
            }
            step = damped_step(&rows, b, damping, n, m);
        }
    } else {
        coupled_step(n, limits, rows, b, damping, q)
    };
    let largest = step.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    if largest > LARGEST_STEP {
        step = step.map(|x| x * LARGEST_STEP / largest);
    }
    let mut moved = false;
    for i in 0..n {
        let next = problem.held(i, q[i] + step[i]);
        moved |= next != q[i];
        q[i] = next;
    }
    moved
}

/// The damped step within limits on combinations of joints.
#[cold]
#[inline(never)]
fn coupled_step<const C: usize>(n: usize, limits: &Limits, rows: &Rows6<C>, b: &Row6, damping: f64, q: &[f64; C]) -> [f64; C] {
    let mut wide = [[0.0; MAX_JOINTS]; 6];
    wide.iter_mut().zip(rows).for_each(|(wide, row)| wide[..n].copy_from_slice(&row[..n]));
    let (mut low, mut high) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for i in 0..n {
        (low[i], high[i]) = ((limits.q_min[i] - q[i]).clamp(-LARGEST_STEP, 0.0), (limits.q_max[i] - q[i]).clamp(0.0, LARGEST_STEP));
    }
    let (combinations, count) = combinations(limits, &q[..n]);
    let step = least_squares(n, (&wide, b), (damping, &[0.0; MAX_JOINTS]), (&low, &high), &combinations[..count]);
    let step = step.unwrap_or([0.0; MAX_JOINTS]);
    std::array::from_fn(|i| step.get(i).copied().unwrap_or(0.0))
}

/// The room that limits on combinations leave a step, and how many there are.
pub(super) fn combinations(limits: &Limits, q: &[f64]) -> ([DenseRow<MAX_JOINTS>; MAX_COMBINATIONS], usize) {
    let mut rows = [DenseRow::<MAX_JOINTS>::OPEN; MAX_COMBINATIONS];
    for (row, it) in rows.iter_mut().zip(&limits.coupled) {
        row.a[..q.len()].copy_from_slice(&it.row);
        (row.lower, row.upper) = it.room(q);
    }
    (rows, limits.coupled.len())
}

/// The unit of a joint: an angle, or a length that counts as one.
#[inline(always)]
pub(super) fn unit_of(joint: Joint, length: f64) -> f64 {
    if joint == Joint::Prismatic { length } else { 1.0 }
}
