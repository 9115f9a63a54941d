//! Points that no posture reaches: what is wrong with a path that is out of reach as a whole.

use std::f64::consts::PI;

use super::failure::{FailureCause, PlanFailure};
use super::frames::across;
use super::grid::SpareGrid;
use super::numbers::three_digits;
use super::postures::{is_reached, postures_by_newton};
use super::problem::PathProblem;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, norm, scale, sub};
use crate::robot::Joint;
use crate::task::{Projector, Target, Task};

/// Points of the path that are looked at.
const POINTS: usize = 5;
/// Where one of this many of them is in reach, or fewer, the path as a whole is not.
const MOST: usize = 5;
/// A path whose nearest point is this many times farther from the base than the robot reaches is in other units.
const FAR: f64 = 10.0;
/// In the right ones it is at least this part of the robot's reach away.
const CLOSE: f64 = 0.05;
/// A path is in other units, too, that is this many times smaller than the robot, as is its distance.
const NEAR: f64 = 100.0;
/// Units that numbers are taken for metres from, by what they are in metres.
const UNITS: [(f64, &str); 3] = [(1e-3, "millimetres"), (0.0254, "inches"), (1e-2, "centimetres")];
/// The length of a tool that may be missing [m].
const TOOL: f64 = 0.2;

/// The failure at a point for which the grid has no posture: with another cause if Newton finds one, else with what is wrong with the path, as far
/// as can be told.
pub(super) fn missing_point(problem: &PathProblem, spare: &SpareGrid, failure: &PlanFailure) -> PlanFailure {
    let told = |cause, hint: Option<String>| PlanFailure { cause, hint, ..failure.clone() };
    match failure.cause {
        FailureCause::Unreachable | FailureCause::JointLimit => {}
        FailureCause::Singular => return told(failure.cause, Some("the objective has no finite value in any posture there".into())),
        _ => return failure.clone(),
    }
    let point = failure.point;
    if !postures_by_newton(problem, point).is_empty() {
        let finer = match (spare.joints.is_empty(), spare.spins) {
            (true, _) => "more n_angles",
            (false, true) => "more n_spare or n_angles, or other spare joints,",
            (false, false) => "more n_spare, or other spare joints,",
        };
        let hint = format!("Newton finds a posture there that the grid is too coarse for: {finer} may help");
        return PlanFailure { joint: None, ..told(FailureCause::NoWay, Some(hint)) };
    }
    told(failure.cause, Path(problem).hint(point))
}

/// The points of a problem.
struct Path<'a>(&'a PathProblem);

impl Path<'_> {
    /// What is wrong.
    fn hint(&self, point: usize) -> Option<String> {
        let problem = self.0;
        let by_distance = || if problem.asked.linear == Projector::All { self.far_or_near(point) } else { None };
        by_distance().or_else(|| self.by_direction(point))
    }

    /// What its distance from the base tells.
    fn far_or_near(&self, point: usize) -> Option<String> {
        let problem = self.0;
        let radius = radius(problem);
        let far = |frame: &Frame| norm(sub(frame.origin, self.base()));
        let distances: Vec<f64> = problem.frames.iter().map(far).collect();
        let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let most = distances.iter().copied().fold(0.0, f64::max);
        if least > radius {
            return self.seen_from_base(&self.some_points(point)).or_else(|| Some(self.far_away(least, radius)));
        }
        if most * NEAR < problem.robot.size() {
            return Some(format!("all points are within {} of the base: metres taken for millimetres?", length(most)));
        }
        let outside = distances.iter().filter(|distance| **distance > radius).count();
        if distances[point] > radius {
            let place = format!("it is {} from the base, and the robot reaches {}", length(distances[point]), length(radius));
            let all = distances.len();
            return Some(if outside < all { format!("{place}; {outside} of {all} points are that far") } else { place });
        }
        None
    }

    /// What it is where the distance is none of it.
    fn by_direction(&self, point: usize) -> Option<String> {
        let problem = self.0;
        let points = self.some_points(point);
        if MOST * self.all_reached(&points, |target, _| target, &problem.asked) > points.len() {
            // Others are in reach: this one is what is wrong.
            return self.place_alone(&[point]);
        }
        let turned = || self.turned(&points);
        turned().or_else(|| self.seen_from_base(&points)).or_else(|| self.with_tool(&points)).or_else(|| self.place_alone(&points))
    }

    /// Where the base of the first joint is.
    fn base(&self) -> Vec3 {
        self.0.robot.links()[0].origin
    }

    /// Every point is farther away than the robot can reach.
    fn far_away(&self, least: f64, radius: f64) -> String {
        let place = format!("the whole path is at least {} away, and the robot reaches {}", length(least), length(radius));
        let fits = |(unit, _): &&(f64, &str)| least * unit <= radius && least * unit >= CLOSE * radius;
        let unit = UNITS.iter().find(fits).map_or("other units", |(_, name)| name);
        if least > FAR * radius { format!("{place}: {unit}?") } else { format!("{place}: another base, or other units?") }
    }

    /// Some points of the path, the one that fails among them.
    fn some_points(&self, point: usize) -> Vec<usize> {
        let last = self.0.points() - 1;
        let mut points: Vec<usize> = (0..POINTS).map(|i| last * i / (POINTS - 1)).chain([point]).collect();
        points.sort_unstable();
        points.dedup();
        points
    }

    /// How many of some points are reached when their targets are changed.
    fn all_reached(&self, points: &[usize], change: impl Fn(Target, &Frame) -> Target, task: &Task) -> usize {
        let problem = self.0;
        let reached = |point: &&usize| {
            let target = change(problem.targets[**point], &problem.frames[**point]);
            is_reached(&problem.robot, task, &target, problem.length, problem.limits)
        };
        points.iter().filter(reached).count()
    }

    /// Whether points are reached with the axis reversed.
    fn turned(&self, points: &[usize]) -> Option<String> {
        let axis = self.0.asked.spin_axis().unwrap_or([0.0, 0.0, 1.0]);
        let half = Frame::rotation(across(axis), PI);
        let reversed = |target: Target, frame: &Frame| Target {
            axis: target.axis.map(|axis| scale(-1.0, axis)),
            frame: frame.compose(&half).axes,
            ..target
        };
        let all = self.all_reached(points, reversed, &self.0.asked) == points.len();
        all.then(|| "the path is in reach with the axis reversed: does it point the other way?".into())
    }

    /// Whether points are reached as what the robot's base sees.
    fn seen_from_base(&self, points: &[usize]) -> Option<String> {
        let problem = self.0;
        let base = problem.robot.base();
        let seen = |target: Target, frame: &Frame| {
            let there = base.compose(frame);
            Target { position: there.origin, axis: target.axis.map(|axis| base.rotate(axis)), frame: there.axes }
        };
        let all = *base != Frame::IDENTITY && self.all_reached(points, seen, &problem.asked) == points.len();
        all.then(|| "the path is in reach if it is given in the frame of the robot's base, which is not that of the world".into())
    }

    /// Whether points are reached with a tool, where there is none.
    fn with_tool(&self, points: &[usize]) -> Option<String> {
        let problem = self.0;
        let beyond = |target: Target, frame: &Frame| Target { position: sub(target.position, scale(TOOL, frame.axes[2])), ..target };
        if *problem.robot.tool() == Frame::IDENTITY && self.all_reached(points, beyond, &problem.asked) == points.len() {
            return Some(format!("the path is in reach with a tool {} long: is the tool missing?", length(TOOL)));
        }
        None
    }

    /// Whether points are reached when the tool may point anywhere.
    fn place_alone(&self, points: &[usize]) -> Option<String> {
        let limits = if self.0.limits { " within the limits" } else { "" };
        let what = if points.len() > 1 { "the places of the path are" } else { "its place is" };
        let reached = self.all_reached(points, |target, _| target, &Task::POSITION);
        if reached == points.len() {
            return Some(format!("{what} in reach{limits}, but with the tool turned otherwise"));
        }
        (reached == 0).then(|| format!("{what} out of reach{limits} however the tool turns"))
    }
}

/// What no tool point is farther than from the base of the first joint [m]: the links in line, and what joints slide.
fn radius(problem: &PathProblem) -> f64 {
    let (robot, limits) = (&problem.robot, problem.robot.limits());
    let slides = (0..robot.n()).filter(|&i| robot.joints()[i] == Joint::Prismatic);
    let reach = slides.map(|i| if problem.limits { limits.q_min[i].abs().max(limits.q_max[i].abs()) } else { f64::INFINITY });
    robot.size() + reach.sum::<f64>()
}

/// A length as people read it.
fn length(metres: f64) -> String {
    match metres {
        x if x >= 1000.0 => format!("{} km", three_digits(x / 1000.0)),
        x if x >= 1.0 => format!("{} m", three_digits(x)),
        x => format!("{} mm", three_digits(1000.0 * x)),
    }
}
