//! Grids of the spin and of the joints that a robot has to spare.

use std::f64::consts::PI;
use std::sync::Arc;

use super::numbers::{half_open, linspace, shown};
use crate::error::{Error, Result};
use crate::inverse::TaskInverse;
use crate::robot::{Joint, Robot};
use crate::task::Task;

/// Joints that an arm needs to reach a frame.
const MOVING: usize = 6;
/// How far from its limits a spare joint's grid begins, relative to its range.
const EDGE: f64 = 1e-3;
/// Where a joint is held to look at the geometry of the rest [rad or m]: any place will do but a multiple of a right angle, where axes of other
/// places happen to meet.
const ANYWHERE: f64 = 0.37;

/// The spins of a grid \[rad\]: from -pi over a whole turn, from end to end of a range, or 0 where the tool does not spin freely.
///
/// # Errors
/// [`Error::Value`] if there is not at least one angle, or the range is not one.
pub fn angle_grid(spins: bool, n_angles: usize, spin_range: Option<(f64, f64)>) -> Result<Vec<f64>> {
    if !spins {
        return Ok(vec![0.0]);
    }
    if n_angles < 1 {
        return Err(Error::value("n_angles", n_angles, "at least 1"));
    }
    let Some((low, high)) = spin_range else { return Ok(half_open(-PI, PI, n_angles)) };
    if !(low.is_finite() && high.is_finite() && low < high && high <= low + 2.0 * PI) {
        let given = format!("({}, {})", shown(low), shown(high));
        let degrees = if low < high && high - low <= 360.0 { "; degrees?" } else { "" };
        return Err(Error::value("spin_range", given, &format!("two increasing angles at most a turn apart [rad]{degrees}")));
    }
    Ok(if n_angles > 1 { linspace(low, high, n_angles) } else { vec![0.5 * (low + high)] })
}

/// Joints that are held on a grid, counted from 0, and every combination of their values [rad or m], one a row.
#[derive(Debug, Clone, PartialEq)]
pub struct SpareGrid {
    /// The joints.
    pub joints: Vec<usize>,
    /// Their values; one row, an empty one, without joints.
    pub values: Vec<Vec<f64>>,
    /// Whether the tool of the others may spin as it likes, so that its spins are on a grid too.
    pub spins: bool,
}

impl SpareGrid {
    /// Over `n_spare` values of each of the joints `spare`; if these are not given, of those that slide, or that others follow, beside six that turn, and those
    /// without which the rest has a closed form.
    ///
    /// # Errors
    /// [`Error::Value`] if what is left does not fit the task, or a joint slides without limits.
    pub fn new(robot: &Robot, task: &Task, spare: Option<&[usize]>, n_spare: usize) -> Result<Self> {
        let joints = spare.map_or_else(|| choice(robot, task), |spare| Ok(spare.to_vec()))?;
        if n_spare < 1 {
            return Err(Error::value("n_spare", n_spare, "at least 1"));
        }
        let fitting = joints.iter().all(|joint| *joint < robot.n()) && joints.len() < robot.n();
        let rest = if fitting { Some(rest(robot, &joints)?).filter(|rest| fits(robot, rest, task)) } else { None };
        let Some(rest) = rest else {
            let letters = robot.joint_letters();
            let left: String = letters.chars().enumerate().filter(|(i, _)| !joints.contains(i)).map(|(_, letter)| letter).collect();
            let given = format!("{}, which leaves the joints '{left}' of '{letters}'", tuple(&joints));
            return Err(Error::value("spare", given, "six revolute ones, or as many as the task and its free spin take"));
        };
        let spins = can_spin(&rest, task);
        let mut values = vec![Vec::new()];
        for &joint in &joints {
            let column = column(robot, joint, n_spare)?;
            let extended = |row: &Vec<f64>| column.iter().map(|x| [&row[..], &[*x]].concat()).collect::<Vec<_>>();
            values = values.iter().flat_map(extended).collect();
        }
        Ok(Self { joints, values, spins })
    }
}

/// Numbers as Python shows a tuple of them.
fn tuple(numbers: &[usize]) -> String {
    let shown: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    format!("({}{})", shown.join(", "), if numbers.len() == 1 { "," } else { "" })
}

/// The robot with joints held somewhere.
fn rest(robot: &Robot, joints: &[usize]) -> Result<Robot> {
    let held: Vec<(usize, f64)> = joints.iter().map(|joint| (*joint, ANYWHERE)).collect();
    robot.with_fixed(&held)
}

/// Whether a robot can spin its tool about the task's axis beside what the task asks for.
fn can_spin(robot: &Robot, task: &Task) -> bool {
    task.spin_axis().is_some() && Task::FULL.rank(robot) > task.rank(robot)
}

/// What a cell of the grid asks of a robot without its spare joints: the task, or all where the spin is given too.
pub fn cell_task(spins: bool, task: &Task) -> Task {
    if spins { Task::FULL } else { *task }
}

/// Whether a cell of the grid leaves no joint to spare of what is left of a robot, whose tool can spin still if it could.
fn fits(robot: &Robot, rest: &Robot, task: &Task) -> bool {
    let spins = can_spin(robot, task);
    can_spin(rest, task) == spins && cell_task(spins, task).rank(rest) == rest.n()
}

/// The joints to hold: all that slide, or that others follow, beside six that turn, and those without which the rest has a closed form.
fn choice(robot: &Robot, task: &Task) -> Result<Vec<usize>> {
    let n = robot.n();
    let turns = |i: &usize| robot.joints()[*i] == Joint::Revolute && !robot.drives(*i);
    let (turning, sliding): (Vec<usize>, Vec<usize>) = (0..n).partition(turns);
    let (always, among, count) = match turning.len().checked_sub(MOVING) {
        Some(count) => (sliding, turning, count),
        None => (Vec::new(), (0..n).collect(), n - cell_task(can_spin(robot, task), task).rank(robot)),
    };
    let mut best: Option<((u8, usize), Vec<usize>)> = None;
    for extra in combinations(&among, count) {
        let mut joints = [&always[..], &extra].concat();
        joints.sort_unstable();
        let rest = rest(robot, &joints)?;
        if fits(robot, &rest, task) {
            let turning = joints.iter().filter(|joint| robot.joints()[**joint] == Joint::Revolute).count();
            let rank = (effort(rest, task)?, turning);
            if best.as_ref().is_none_or(|(least, _)| rank < *least) {
                best = Some((rank, joints));
            }
        }
    }
    Ok(best.map_or(Vec::new(), |(_, joints)| joints))
}

/// How hard the cells of a robot are to solve.
fn effort(robot: Robot, task: &Task) -> Result<u8> {
    let task = cell_task(can_spin(&robot, task), task);
    Ok(TaskInverse::new(Arc::new(robot), task)?.effort())
}

/// All choices of `count` of some items, in their order.
fn combinations(items: &[usize], count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let with_first = |i: usize| combinations(&items[i + 1..], count - 1).into_iter().map(move |rest| [&[items[i]], &rest[..]].concat());
    (0..items.len()).flat_map(with_first).collect()
}

/// The values of a spare joint: over its range, or over a turn where it has none.
fn column(robot: &Robot, joint: usize, count: usize) -> Result<Vec<f64>> {
    let (low, high) = (robot.limits().q_min[joint], robot.limits().q_max[joint]);
    if !(high - low).is_finite() {
        if robot.joints()[joint] == Joint::Prismatic {
            return Err(Error::value(&format!("joint {}", joint + 1), "sliding without limits", "limits for a spare joint"));
        }
        return Ok(half_open(-PI, PI, count));
    }
    let edge = EDGE * (high - low);
    Ok(if count > 1 { linspace(low + edge, high - edge, count) } else { vec![0.5 * (low + high)] })
}
