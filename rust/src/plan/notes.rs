//! What is worth saying of a plan, whole or not.

use super::failure::{degrees, listed};
use super::grid::{SpareGrid, angle_grid};
use super::lattice::Lattice;
use super::members::Members;
use super::problem::PathProblem;
use super::singular::Singularities;
use super::verdict::Plan;
use crate::error::Error;
use crate::kinematics::jacobian_at;
use crate::linalg::vector::{cross, dot, norm};
use crate::resolve::SolveStatus;
use crate::robot::Joint;

/// Points and spins at which values are compared.
const POINTS: usize = 3;
const SPINS: usize = 4;
/// Places of joints to spare at which they are.
const PLACES: usize = 2;
/// Values that differ by less than this, relative, are the same.
const SAME: f64 = 1e-9;
/// Directions whose sine is below this are parallel; lengths below it, relative to the robot's, are none.
const PARALLEL: f64 = 1e-9;

/// What is worth saying of a plan.
pub(super) fn notes(problem: &PathProblem, spare: &SpareGrid, plan: &Plan) -> Result<Vec<String>, Error> {
    Ok([passage(problem, plan), idle_spin(problem, spare)?].into_iter().flatten().collect())
}

/// A way through a singularity.
fn passage(problem: &PathProblem, plan: &Plan) -> Option<String> {
    let followed: Vec<bool> = plan.status.iter().map(|status| *status != SolveStatus::Unreachable).collect();
    let (at, after) = Singularities::of(&problem.robot).on(&plan.q, &followed);
    let infinite = at.iter().any(|point| plan.value[*point].is_infinite());
    if at.is_empty() && after.is_empty() {
        return None;
    }
    let value = if infinite { ", where the value is infinite" } else { "" };
    if !at.is_empty() && at.len() == followed.iter().filter(|one| **one).count() {
        return Some(format!("every posture is singular{value}"));
    }
    let between: Vec<String> = after.iter().map(|point| format!("between points {point} and {}", point + 1)).collect();
    let named: Vec<String> = at.iter().map(|point| format!("at point {point}")).collect();
    let places = [&named[..], &between].concat();
    let motion = largest_turn(problem, plan, &at.iter().chain(&after).copied().collect::<Vec<_>>());
    Some(format!("the way passes through a singularity {}{value}; no joint turns by more than {motion} a point there", listed(&places)))
}

/// The largest motion of a turning joint from and to some points.
fn largest_turn(problem: &PathProblem, plan: &Plan, points: &[usize]) -> String {
    let n = problem.n();
    let last = plan.status.len() - 1;
    let edges = points.iter().flat_map(|point| point.saturating_sub(1)..(point + 1).min(last));
    let turning = |k: &usize| problem.robot.joints()[*k] == Joint::Revolute;
    let motion = |edge: usize| (0..n).filter(turning).map(move |k| (plan.q[(edge + 1) * n + k] - plan.q[edge * n + k]).abs());
    degrees(edges.flat_map(motion).fold(0.0, f64::max))
}

/// A spin of the tool that changes nothing, or that the robot cannot make.
fn idle_spin(problem: &PathProblem, spare: &SpareGrid) -> Result<Option<String>, Error> {
    let Some(axis) = problem.asked.spin_axis() else { return Ok(None) };
    if !spare.spins {
        return Ok(Some("the spin of the tool is no freedom: no joint is left to turn it".into()));
    }
    let angles = angle_grid(true, SPINS, problem.spin.map(|spin| spin.range))?;
    let last = problem.points() - 1;
    let mut points: Vec<usize> = (0..POINTS).map(|i| last * i / (POINTS - 1)).collect();
    points.dedup();
    let Some(objective) = problem.objective.clone() else { return Ok(None) };
    let stride = spare.values.len().div_ceil(PLACES).max(1);
    let few = spare.values.iter().step_by(stride).cloned().collect();
    let few = SpareGrid::at(&problem.robot, &problem.asked, &spare.joints, few)?;
    let spins = Members::spins(axis, &angles, problem.spin.is_none());
    let lattice = Lattice::new(problem.robot.clone(), problem.frames.clone(), &problem.asked, spins, &few, Some(objective), false)?;
    let branches = lattice.branches();
    let mut compared = false;
    for point in points {
        let Some(cells) = lattice.cells_of(&[point]).pop() else { continue };
        // Of every branch and place of the spare joints, the values over the spins.
        let mut first = vec![f64::NAN; lattice.slices() * branches];
        for (cell, value) in cells.open.iter().zip(&cells.value) {
            let known = &mut first[*cell as usize / (SPINS * branches) * branches + *cell as usize % branches];
            if known.is_nan() {
                *known = *value;
            } else if (*value - *known).abs() > SAME * known.abs() {
                return Ok(None);
            } else {
                compared = true;
            }
        }
    }
    if !compared {
        return Ok(None);
    }
    let joint = turner(problem, axis).map_or(String::new(), |joint| format!(", which {} alone makes", problem.robot.joint_label(joint)));
    Ok(Some(format!("the value does not depend on the spin of the tool{joint}: among equals the least motion decides")))
}

/// The joint about whose axis the tool's axis lies: its motion is the spin.
fn turner(problem: &PathProblem, axis: [f64; 3]) -> Option<usize> {
    let robot = &problem.robot;
    let (tool, columns) = jacobian_at(robot, &robot.middle());
    let axis = tool.rotate(axis);
    // The last one: in the middle posture others may happen to be in line with it.
    (0..robot.n()).rev().find(|&i| {
        let (w, v) = (columns.w[i], columns.v[i]);
        robot.joints()[i] == Joint::Revolute && norm(cross(w, axis)) <= PARALLEL && dot(w, w) > 0.0 && norm(v) <= PARALLEL * robot.size()
    })
}
