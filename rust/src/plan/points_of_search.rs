//! The points of a path at which a search begins: evenly, and where the path bends.

use std::collections::BTreeSet;

use super::numbers::linspace;
use super::problem::PathProblem;
use crate::linalg::vector::{Vec3, add, dot, norm, scale, sub};

/// How far the path may be from a straight way between two points of the search, of the robot's size.
const STRAIGHT: f64 = 0.03;
/// How far its axis may be from an even turn between them [rad].
const EVEN: f64 = 0.2;
/// Points of a search at most where the path bends.
const MOST: usize = 1000;

/// The points: `count` evenly, and those between which position and axis of the tool go as straight as they may (Douglas and Peucker 1973).
pub(super) fn first_points(problem: &PathProblem, count: usize) -> Vec<usize> {
    let n = problem.points();
    let even = linspace(0.0, (n - 1) as f64, n.min(count));
    let mut points: BTreeSet<usize> = even.iter().map(|x| x.round_ties_even() as usize).collect();
    let size = problem.robot.links().iter().map(|link| norm(link.origin)).sum::<f64>() + norm(problem.robot.end().origin);
    let axis = problem.asked.spin_axis();
    let at = |point: usize| (problem.frames[point].origin, axis.map_or([0.0; 3], |axis| problem.frames[point].rotate(axis)));
    let mut spans: Vec<(usize, usize)> = points.iter().copied().zip(points.iter().copied().skip(1)).collect();
    while let Some((a, b)) = spans.pop() {
        let worst = (a + 1..b).map(|point| (bend(&at, a, point, b, size), point)).reduce(|x, y| if y.0 > x.0 { y } else { x });
        if let Some((_, point)) = worst.filter(|(bend, _)| *bend > 1.0 && points.len() < MOST) {
            points.insert(point);
            spans.extend([(a, point), (point, b)]);
        }
    }
    points.into_iter().collect()
}

/// How far a point is from a straight way between two others, relative to what it may be.
fn bend(at: &impl Fn(usize) -> (Vec3, Vec3), a: usize, point: usize, b: usize, size: f64) -> f64 {
    let t = (point - a) as f64 / (b - a) as f64;
    let ((p, x), (q, y), (here, axis)) = (at(a), at(b), at(point));
    let between = |from: Vec3, to: Vec3| add(scale(1.0 - t, from), scale(t, to));
    let mean = between(x, y);
    let turned = norm(sub(axis, scale(1.0 / dot(mean, mean).sqrt().max(f64::MIN_POSITIVE), mean)));
    (norm(sub(here, between(p, q))) / (STRAIGHT * size)).max(if dot(axis, axis) > 0.0 { turned / EVEN } else { 0.0 })
}
