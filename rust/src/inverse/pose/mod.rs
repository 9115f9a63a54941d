//! One posture for a pose, of any robot, for any task: the quickest way to it that is sure, and where there is none the nearest posture.
//!
//! Six joints with a closed form have all postures listed, and the one nearest to the start is taken. Else damped Newton searches from the start, and
//! from postures whose tools are near the target, each given up as soon as it does not get on; six joints without a closed form have all their postures
//! eliminated where this fails. What is not reached ends at a minimum of the cost `|dp|^2 + L^2/2 |R - R_d|^2` (From and Gravdahl 2007, eqs. 14, 36).

mod answer;
mod attempt;
mod goal;
mod nearest;
mod starts;

use std::sync::Arc;

use rayon::prelude::*;

use super::any::TaskInverse;
use super::descent::{Cost, Order, descend, suggested_weights};
use super::{Request, Structure, Wanted};
use crate::error::{Result, check_vector};
use crate::kinematics::jacobian_at;
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{norm, sub};
use crate::robot::{AT_LIMIT, RandomPostures, Robot, nearest_turn};
use crate::task::{Target, Task};
pub use answer::{Method, Outcome, Pose, Settings};
use attempt::{Attempt, Bounds, Problem, attempt};
pub use goal::Aim;
use goal::Goal;
use nearest::nearest;
use starts::Starts;

/// Sweeps of coordinate descent ahead of Newton.
const FIRST_SWEEPS: usize = 2;
/// Starts that are enough where a pose is known to be out of reach.
const OUT_OF_REACH: usize = 24;
/// Starts after which all postures of six joints are eliminated.
const BEFORE_ELIMINATION: usize = 24;
/// Starts after which each is given more time.
const PATIENT_AFTER: usize = 16;
/// Postures from which the nearest one is looked for.
const CANDIDATES: usize = 4;
/// Targets that a thread takes at a time, at least.
const TOGETHER: usize = 8;
/// Steps on the way to it.
const DOWNHILL: usize = 200;

/// The ways of a robot to poses, within some limits.
#[derive(Debug, Clone)]
pub struct PoseSolver {
    robot: Arc<Robot>,
    starts: Starts,
    length: f64,
}

/// What one search has found so far.
struct Search<'a> {
    solver: &'a PoseSolver,
    problem: Problem<'a>,
    start: [f64; MAX_JOINTS],
    /// The best ends, the best first.
    ends: [Option<Attempt<MAX_JOINTS>>; CANDIDATES],
    iterations: usize,
    attempts: usize,
    unreachable: bool,
    /// Where all postures are beyond the limits, the one that is so least.
    beyond: Option<[f64; MAX_JOINTS]>,
    seen: Option<Vec<f64>>,
}

impl PoseSolver {
    /// Of a robot, within its limits.
    pub fn new(robot: Arc<Robot>) -> Self {
        let length = (2.0 * suggested_weights(&robot).1).sqrt();
        Self { starts: Starts::new(&robot), length, robot }
    }

    /// L, the length at which an angle is as long as a way \[m\]: that of [`suggested_weights`].
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// The posture that takes the tool to a target, or as near as may be; `inverse` is that of the same robot for the whole frame, if there is one. With
    /// `trace` beside it the cost at every posture that was looked at.
    ///
    /// # Errors
    /// Where `start` (the middle posture, if not given) is not one finite number a joint.
    pub fn solve(
        &self,
        inverse: Option<&TaskInverse>,
        aim: Aim,
        target: &Target,
        start: Option<&[f64]>,
        settings: &Settings,
        trace: bool,
    ) -> Result<(Pose, Vec<f64>)> {
        let n = self.robot.n();
        let mut from = [0.0; MAX_JOINTS];
        match start {
            Some(start) => {
                check_vector("q0", start, n)?;
                from[..n].copy_from_slice(start);
            }
            None => from.iter_mut().enumerate().take(n).for_each(|(i, x)| *x = self.robot.limits().middle(i)),
        }
        let bounds = Bounds { position: settings.position, orientation: settings.orientation, steps: settings.iterations, patient: false };
        let mut search = Search {
            solver: self,
            problem: Problem::new(&self.robot, Goal::new(aim, *target, self.length), bounds),
            start: from,
            ends: [None; CANDIDATES],
            iterations: 0,
            attempts: 0,
            unreachable: self.is_too_far(aim.task, target, settings),
            beyond: None,
            seen: trace.then(Vec::new),
        };
        let pose = search.run(inverse, settings);
        Ok((pose, search.seen.unwrap_or_default()))
    }

    /// The same of many targets, on every core, without traces; `starts` holds one posture for all of them or one for each.
    pub fn solve_many(
        &self,
        inverse: Option<&TaskInverse>,
        aim: Aim,
        targets: &[Target],
        starts: Option<&[f64]>,
        settings: &Settings,
    ) -> Result<Vec<Pose>> {
        let n = self.robot.n();
        let one = |(i, target): (usize, &Target)| {
            let start = starts.map(|starts| if starts.len() == n { starts } else { starts.get(i * n..(i + 1) * n).unwrap_or_default() });
            self.solve(inverse, aim, target, start, settings, false).map(|(pose, _)| pose)
        };
        targets.par_iter().enumerate().with_min_len(TOGETHER).map(one).collect()
    }

    /// Whether a point is farther from the first axis' origin than all links in line.
    fn is_too_far(&self, task: &Task, target: &Target, settings: &Settings) -> bool {
        let whole = task.linear == crate::task::Projector::All;
        whole && norm(sub(target.position, self.robot.links()[0].origin)) > self.robot.arm() + settings.position
    }
}

impl Search<'_> {
    fn run(&mut self, inverse: Option<&TaskInverse>, settings: &Settings) -> Pose {
        let robot = &*self.solver.robot;
        let n = robot.n();
        let all = inverse.filter(|_| self.problem.goal.whole);
        let closed = all.filter(|inverse| settings.method == Method::Closed || has_closed_form(inverse));
        let mut restarts = settings.restarts;
        if let (Some(inverse), true) = (closed, matches!(settings.method, Method::Auto | Method::Closed)) {
            if let Some(pose) = self.listed(inverse) {
                return pose;
            }
            restarts = restarts.min(OUT_OF_REACH);
        }
        if self.unreachable {
            restarts = restarts.min(OUT_OF_REACH);
        }
        let mut start = self.beyond.unwrap_or(self.start);
        for i in 0..n {
            start[i] = self.turned(i, start[i], start[i]).clamp(robot.limits().q_min[i], robot.limits().q_max[i]);
        }
        robot.limits().pull_inside(&mut start[..n]);
        if settings.method == Method::Descent {
            return self.sweep(start, settings.iterations);
        }
        let mut costs = None;
        let mut random = RandomPostures::new(settings.seed.wrapping_add(1));
        for attempts in 0..=restarts {
            self.attempts = attempts;
            self.problem.bounds.patient = attempts >= PATIENT_AFTER;
            if settings.method == Method::Hybrid {
                self.iterations += self.descend(&mut start[..n], FIRST_SWEEPS);
            }
            if let Some(pose) = self.attempt(&start[..n]) {
                return pose;
            }
            // Fewer joints reach few poses: for them it is the last resort.
            if attempts == if n == 6 { BEFORE_ELIMINATION.min(restarts) } else { restarts }
                && closed.is_none()
                && let Some(inverse) = all.filter(|_| n <= 6 && settings.method == Method::Auto)
                && let Some(pose) = self.listed(inverse)
            {
                return pose;
            }
            let table = costs.get_or_insert_with(|| self.solver.starts.costs(&self.problem.goal));
            match if settings.seed == 0 { self.solver.starts.next(table) } else { None } {
                Some(kept) => start = kept,
                None => random.fill(robot, &mut start[..n]),
            }
        }
        self.nearest()
    }

    /// The posture of all that is nearest to the start, if there is one within the limits.
    #[inline(never)]
    fn listed(&mut self, inverse: &TaskInverse) -> Option<Pose> {
        let robot = &*self.solver.robot;
        let (limits, n) = (robot.limits(), robot.n());
        let frame = Frame { axes: self.problem.goal.target.frame, origin: self.problem.goal.target.position };
        let found = inverse.solve(&frame);
        let from = self.start;
        let near = &from[..n];
        let (mut best, mut least, mut farthest) = ([0.0; MAX_JOINTS], f64::INFINITY, f64::INFINITY);
        for row in &found.q[..found.count] {
            let (mut q, mut distance, mut beyond) = ([0.0; MAX_JOINTS], 0.0, 0.0);
            for i in 0..n {
                let x = self.turned(i, row[i], near[i]);
                q[i] = x.clamp(limits.q_min[i], limits.q_max[i]);
                distance += (q[i] - near[i]).powi(2);
                beyond = f64::max(beyond, (x - q[i]).abs());
            }
            if beyond > AT_LIMIT || limits.coupled.iter().any(|it| it.margin(&q[..n]) < 0.0) {
                if beyond < farthest {
                    (self.beyond, farthest) = (Some(q), beyond);
                }
            } else if distance < least {
                (best, least) = (q, distance);
            }
        }
        if least == f64::INFINITY && (found.singular[..found.count].contains(&true) || (!limits.coupled.is_empty() && found.count > 0)) {
            // A joint that may be chosen may come within its limits, as another whole turn may within those on combinations.
            let wanted = Wanted { task: Task::FULL, fixed: &[], limits: true, turns: false };
            let ordered = Request::whole(inverse, wanted).solve(&frame, Some(near)).ok()?;
            let first = ordered.rows().next()?;
            if limits.contain(first) {
                best[..n].copy_from_slice(first);
                least = 0.0;
            }
        }
        if least == f64::INFINITY {
            self.unreachable |= found.complete;
            return None;
        }
        let left = self.problem.goal.left(&jacobian_at(robot, &best[..n]).0);
        if let Some(seen) = &mut self.seen {
            seen.push(self.problem.goal.cost(&left));
        }
        self.problem.bounds.hold(&left).then(|| self.pose(best, left, Outcome::Converged))
    }

    /// A coordinate by the whole turn nearest to another that the limits allow.
    fn turned(&self, i: usize, x: f64, near: f64) -> f64 {
        let robot = &*self.solver.robot;
        if robot.is_periodic(i) { robot.limits().brought_back(i, nearest_turn(x, near)) } else { x }
    }

    /// Sweeps of coordinate descent from a posture, as long as they gain anything; how many.
    #[inline(never)]
    fn descend(&mut self, q: &mut [f64], most: usize) -> usize {
        let (robot, goal) = (self.problem.robot, self.problem.goal.clone());
        let mut last = f64::INFINITY;
        for sweeps in 0..most {
            let Some(goal) = goal.wish(&jacobian_at(robot, q).0) else { return sweeps };
            let cost = Cost { goal, points: Vec::new(), centres: Vec::new() };
            let next = descend(robot, &cost, Some(robot.limits()), Order::EndToBase, 1, q);
            if let Some(seen) = &mut self.seen {
                seen.push(next);
            }
            let left = self.problem.goal.left(&jacobian_at(robot, q).0);
            if self.problem.bounds.hold(&left) || next.is_nan() || next >= last {
                return sweeps + 1;
            }
            last = next;
        }
        most
    }

    /// Coordinate descent alone.
    #[cold]
    fn sweep(&mut self, mut q: [f64; MAX_JOINTS], most: usize) -> Pose {
        let robot = self.problem.robot;
        let n = robot.n();
        self.iterations = self.descend(&mut q[..n], most);
        let end = nearest(&self.problem, &q[..n], 0, &mut None);
        let outcome = match (self.problem.bounds.hold(&end.left), end.stationary) {
            (true, _) => Outcome::Converged,
            (_, true) => Outcome::Stationary,
            _ => Outcome::OutOfIterations,
        };
        self.pose(q, end.left, outcome)
    }

    /// Newton from one start: the pose if it gets there.
    fn attempt(&mut self, start: &[f64]) -> Option<Pose> {
        let robot = &*self.solver.robot;
        let n = robot.n();
        // Six joints gain nothing from a copy of their own.
        let end = match n {
            0..=8 => widened::<8>(&self.problem, start, &mut self.seen),
            _ => widened::<MAX_JOINTS>(&self.problem, start, &mut self.seen),
        };
        self.iterations += end.steps;
        if self.problem.bounds.hold(&end.left) {
            let mut q = end.q;
            for i in 0..n {
                q[i] = self.turned(i, q[i], self.start[i]);
            }
            let q = if robot.limits().contain(&q[..n]) { q } else { end.q };
            return Some(self.pose(q, end.left, Outcome::Converged));
        }
        let mut end = Some(end);
        for slot in &mut self.ends {
            if slot.is_none_or(|it| end.is_some_and(|end| end.square < it.square)) {
                std::mem::swap(slot, &mut end);
            }
        }
        None
    }

    /// The nearest posture from the best ends.
    #[inline(never)]
    fn nearest(&mut self) -> Pose {
        let mut best: Option<nearest::Nearest> = None;
        for end in self.ends.into_iter().flatten() {
            let found = nearest(&self.problem, &end.q, DOWNHILL, &mut self.seen);
            self.iterations += found.steps;
            if best.is_none_or(|best| found.cost < best.cost) {
                best = Some(found);
            }
            if self.problem.bounds.hold(&found.left) {
                break;
            }
        }
        let Some(best) = best else { return self.pose(self.start, ([f64::NAN; 3], [f64::NAN; 3]), Outcome::OutOfIterations) };
        let outcome = match (self.problem.bounds.hold(&best.left), best.stationary) {
            (true, _) => Outcome::Converged,
            (_, false) => Outcome::OutOfIterations,
            _ if self.unreachable => Outcome::Unreachable,
            _ => Outcome::Stationary,
        };
        self.pose(best.q, best.left, outcome)
    }

    fn pose(&self, q: [f64; MAX_JOINTS], left: goal::Left, outcome: Outcome) -> Pose {
        let (orientation_error, position_error) = (norm(left.0), norm(left.1));
        let cost = self.problem.goal.cost(&left);
        Pose { q, outcome, position_error, orientation_error, iterations: self.iterations, restarts: self.attempts, cost }
    }
}

/// An attempt in the room for the largest robots.
fn widened<const C: usize>(problem: &Problem, start: &[f64], seen: &mut Option<Vec<f64>>) -> Attempt<MAX_JOINTS> {
    let end = attempt::<C>(problem, start, seen);
    let mut q = [0.0; MAX_JOINTS];
    q[..C].copy_from_slice(&end.q);
    Attempt { q, left: end.left, square: end.square, steps: end.steps }
}

/// Whether all postures are told in a few microseconds.
fn has_closed_form(inverse: &TaskInverse) -> bool {
    inverse.robot().joint_letters() == "RRRRRR" && matches!(inverse.structure(), Some(Structure::Wrist { .. } | Structure::Parallel { .. }))
}
