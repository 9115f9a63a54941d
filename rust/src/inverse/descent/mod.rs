//! Coordinate descent to a pose, a direction or a position: the cost of one joint is `K + a cos x + b sin x`, whose minimum is in closed form
//! (From and Gravdahl 2007, section 5).
//!
//! A few sweeps come near most goals and keep all limits; near a goal they converge slowly, where Newton's method does fast.

mod cosine;
mod cost;
mod cyclic;
mod form;
mod half_angle;
mod one_joint;
mod solver;
mod state;
mod steps;

pub use cost::{Centre, Cost, Goal, MAX_POINTS, Metric, Orientation, Point};
pub use cyclic::Order;
pub use one_joint::{OneJoint, one_joint_minimum};
pub use solver::{Algorithm, Descended, Descent, Stop, Stopped, Trace};
pub use steps::Rule;

use crate::robot::{Limits, Robot};
use state::Problem;

/// Part of a robot's size that stands for the length at which an angle is as long as a way.
const LENGTH: f64 = 1.0 / 3.0;

/// Weights (w_p, w_o) for which the cost next to a goal is the squared miss of the position plus that of the angle times a third of the robot's size: about the
/// distance of its tool from most of its axes.
pub fn suggested_weights(robot: &Robot) -> (f64, f64) {
    (1.0, 0.5 * (LENGTH * robot.size()).powi(2))
}

/// Moves `q` by `count` sweeps of coordinate descent (algorithm 1) and returns the cost there, without allocating: a start for a solver that converges.
/// Positions within the `limits` stay there; those beyond are put onto them.
///
/// The cost is infinite, and `q` what it was, for a robot whose joints follow others, and for a `q` or a cost that does not belong to the robot.
pub fn descend(robot: &Robot, cost: &Cost, limits: Option<&Limits>, order: Order, count: usize, q: &mut [f64]) -> f64 {
    let Ok(problem) = Problem::new(robot, cost, limits) else { return f64::INFINITY };
    if q.len() != robot.n() {
        return f64::INFINITY;
    }
    if let Some(limits) = limits {
        limits.pull_inside(q);
    }
    let mut state = problem.at(q);
    for _ in 0..count {
        let there = problem.at(&problem.cyclic(&state, order)[..q.len()]);
        if there.cost >= state.cost {
            break;
        }
        state = there;
    }
    q.copy_from_slice(&state.q[..q.len()]);
    state.cost
}
