//! What has to hold along a path, each as a slack that has to stay positive.

use super::graph::Criterion;
use super::problem::PathProblem;
use crate::task::volume::{Side, Sides};

/// Where the common variables stand, beside the postures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Common {
    /// Ceiling of the values (minimax).
    pub ceiling: f64,
    /// How much every limit is widened; only while the path is not within them.
    pub widening: f64,
}

/// Which quantity is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A joint coordinate.
    Position,
    /// A combination of joints, whose number takes the place of the joint's.
    Combination,
    /// The motion of a joint from a point to the next.
    Motion,
    /// The tool's spin.
    Spin,
    /// A bound of a volume of orientations, whose number takes the place of the joint's.
    Side,
    /// The objective's value, by the ceiling.
    Value,
    /// The motion of a joint from a point to the next, by the ceiling: the time that the tool takes for a metre.
    Pace,
    /// The widening itself, by 0.
    Widening,
}

/// `bound - sign x > 0` (and widening).
#[derive(Debug, Clone, Copy)]
pub struct Constraint {
    /// What x is.
    pub kind: Kind,
    /// Point, or the point an edge starts from.
    pub point: usize,
    /// Joint, or combination.
    pub joint: usize,
    /// Side of the bound.
    pub sign: f64,
    /// Bound of `sign x`.
    pub bound: f64,
}

/// Everything that has to hold; without what is infinite.
pub fn constraints(problem: &PathProblem, widened: bool) -> Vec<Constraint> {
    let n = problem.n();
    let mut all = Vec::new();
    let mut push = |kind, point, joint, sign: f64, bound: f64| {
        if bound.is_finite() {
            all.push(Constraint { kind, point, joint, sign, bound });
        }
    };
    for point in 0..problem.points() {
        let free = problem.pins.at(point).is_none();
        // A posture that is held is within its limits; one whose spin is held has none to choose.
        if problem.limits && problem.pins.posture(point).is_none() {
            for joint in 0..n {
                // The first point of a closed path is passed again, whole turns away.
                let turns = problem.turns.as_ref().filter(|_| point == 0).map_or(0.0, |turns| turns[joint]);
                push(Kind::Position, point, joint, 1.0, problem.robot.limits().q_max[joint] - turns.max(0.0));
                push(Kind::Position, point, joint, -1.0, turns.min(0.0) - problem.robot.limits().q_min[joint]);
            }
            for (k, it) in problem.robot.limits().coupled.iter().enumerate() {
                let turns = problem.turns.as_ref().filter(|_| point == 0).map_or(0.0, |turns| it.value(turns));
                push(Kind::Combination, point, k, 1.0, it.high - turns.max(0.0));
                push(Kind::Combination, point, k, -1.0, turns.min(0.0) - it.low);
            }
        }
        if let Some(spin) = problem.spin.as_ref().filter(|_| free) {
            push(Kind::Spin, point, 0, 1.0, spin.range.1);
            push(Kind::Spin, point, 0, -1.0, -spin.range.0);
        }
        if problem.pins.posture(point).is_none() {
            (0..problem.room.len()).for_each(|side| push(Kind::Side, point, side, -1.0, 0.0));
        }
        if problem.criterion == Criterion::Minimax && problem.objective.is_some() {
            push(Kind::Value, point, 0, 1.0, 0.0);
        }
    }
    for edge in 0..problem.edges() {
        for joint in 0..n {
            push(Kind::Motion, edge, joint, 1.0, problem.bounds[edge * n + joint]);
            push(Kind::Motion, edge, joint, -1.0, problem.bounds[edge * n + joint]);
            if let Some(pace) = &problem.pace {
                push(Kind::Pace, edge, joint, 1.0, pace[edge * n + joint]);
                push(Kind::Pace, edge, joint, -1.0, pace[edge * n + joint]);
            }
        }
    }
    if widened {
        push(Kind::Widening, 0, 0, -1.0, 0.0);
    }
    all
}

impl Constraint {
    /// Slack at postures with their values and the bounds of their volumes.
    #[inline(always)]
    pub fn slack<const C: usize>(&self, problem: &PathProblem, q: &[[f64; C]], values: &[f64], sides: &[Sides], common: &Common) -> f64 {
        match self.kind {
            Kind::Position => self.bound - self.sign * q[self.point][self.joint] + common.widening,
            Kind::Combination => {
                self.bound - self.sign * problem.robot.limits().coupled[self.joint].value(&q[self.point]) + common.widening
            }
            Kind::Motion => self.bound * (1.0 + common.widening) - self.sign * problem.motion(q, self.point, self.joint),
            Kind::Spin => self.bound - self.sign * problem.spin(self.point, &q[self.point]) + common.widening,
            Kind::Side => self.bound + side(&sides[self.point], self.joint).slack + common.widening,
            Kind::Value => common.ceiling - values[self.point],
            Kind::Pace => self.bound * common.ceiling - self.sign * problem.motion(q, self.point, self.joint),
            Kind::Widening => common.widening,
        }
    }

    /// Derivative of the slack with respect to the widening.
    #[inline(always)]
    pub fn widening_slope(&self) -> f64 {
        match self.kind {
            Kind::Position | Kind::Combination | Kind::Spin | Kind::Side | Kind::Widening => 1.0,
            Kind::Motion => self.bound,
            Kind::Value | Kind::Pace => 0.0,
        }
    }
}

/// One of the bounds of a volume: where there are fewer than usual, beyond a horizon, the last stands for the rest.
pub fn side(sides: &Sides, number: usize) -> &Side {
    let all = sides.as_slice();
    &all[number.min(all.len() - 1)]
}
