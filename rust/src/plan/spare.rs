//! Which joints to hold on a grid, so that the others take what is left of the task.

use std::sync::Arc;

use super::numbers::ascending;
use crate::error::{Error, Result};
use crate::inverse::TaskInverse;
use crate::kinematics::jacobian_at;
use crate::linalg::MAX_JOINTS;
use crate::linalg::Row6;
use crate::linalg::svd::Svd;
use crate::robot::{Joint, RandomPostures, Robot};
use crate::task::Task;

/// Joints that an arm needs to reach a frame.
const MOVING: usize = 6;
/// Where a joint is held to look at the geometry of the rest [rad or m]: any place will do but a multiple of a right angle, where axes of other
/// places happen to meet.
const ANYWHERE: f64 = 0.37;
/// Random postures over which the part of joints in the free motion is a mean.
const POSTURES: usize = 32;
/// Choices that are looked at more closely, those of the largest share, and how many are kept.
const LOOKED_AT: usize = 12;
const KEPT: usize = 4;
/// Combinations of joints at most: beyond, those with the least share of their own are always held or never.
const COMBINATIONS: usize = 200;
/// A share below this part of the best is not worth a search.
const LEAST: f64 = 0.1;
/// What a share counts for where the rest is solved by elimination, and where it is by Newton alone.
const ELIMINATED: f64 = 0.5;
const SEARCHED: f64 = 0.25;
/// Effort of a closed form at most ([`crate::inverse::Structure::effort`]).
const CLOSED: u8 = 1;

/// Joints to hold.
#[derive(Clone)]
pub(super) struct Choice {
    pub joints: Vec<usize>,
    /// Whether the tool of the rest spins.
    pub spins: bool,
    effort: u8,
    worth: f64,
}

impl Choice {
    /// Whether the rest has neither a closed form nor an elimination.
    pub fn is_searched(&self) -> bool {
        self.effort == u8::MAX
    }
}

/// The choices of joints to hold, the best first.
///
/// # Errors
/// [`Error::Value`] if none leaves joints that fit the task.
pub(super) fn choices(robot: &Robot, task: &Task) -> Result<Vec<Choice>> {
    if task.rank(robot) == 0 {
        let given = format!("of the kind '{}' and {} components", task.kind(), task.dimension());
        return Err(Error::value("task", given, "one that asks for a motion that the tool can make"));
    }
    let spins = can_spin(robot, task);
    let mut found = choices_with(robot, task, spins)?;
    if found.is_empty() && spins {
        // No other joint may be enough for the spin: then it comes with those that are held.
        found = choices_with(robot, task, false)?;
    }
    if found.is_empty() {
        let given = format!("of the kind '{}' for the joints '{}'", task.kind(), robot.joint_letters());
        return Err(Error::value("task", given, "one for which some joints can be held so that the others take what is left of it"));
    }
    Ok(found)
}

fn choices_with(robot: &Robot, task: &Task, spins: bool) -> Result<Vec<Choice>> {
    let n = robot.n();
    let kept = cell_task(spins, task).rank(robot);
    // What carries others along, and what carries an arm, is held before anything else.
    let turns = |i: usize| robot.joints()[i] == Joint::Revolute && !robot.drives(i);
    let endless = |i: usize| robot.joints()[i] == Joint::Prismatic && !robot.limits().is_bounded(i);
    let carries = (0..n).filter(|i| turns(*i)).count() >= MOVING && n > MOVING;
    let first = |i: &usize| robot.drives(*i) || (carries && !turns(*i) && !endless(*i));
    let always: Vec<usize> = (0..n).filter(first).collect();
    let motions = Motions::new(robot, &cell_task(spins, task), kept);
    // A joint that slides without end has no grid.
    let missing = |joints: &Vec<usize>| {
        always.iter().filter(|joint| !joints.contains(joint)).count() + MAX_JOINTS * joints.iter().filter(|joint| endless(**joint)).count()
    };
    let all = motions.combinations(n - kept);
    let shares: Vec<f64> = all.iter().map(|joints| motions.share(joints)).collect();
    // What is missing counts for more than any share.
    let keys: Vec<f64> = all.iter().zip(&shares).map(|(joints, share)| missing(joints) as f64 - 0.5 * share).collect();
    let mut found: Vec<Choice> = Vec::new();
    for i in ascending(&keys) {
        let joints = &all[i];
        if found.len() == LOOKED_AT || (missing(joints) > 0 && !found.is_empty()) {
            break;
        }
        if fits(robot, joints, task)? != Some(spins) {
            continue;
        }
        let effort = TaskInverse::new(Arc::new(rest(robot, joints)?), cell_task(spins, task))?.effort();
        let worth = match effort {
            0..=CLOSED => shares[i],
            u8::MAX => SEARCHED * shares[i],
            _ => ELIMINATED * shares[i],
        };
        found.push(Choice { joints: joints.clone(), spins, effort, worth });
    }
    let losses: Vec<f64> = found.iter().map(|choice| -choice.worth).collect();
    let order = ascending(&losses);
    let best = order.first().map_or(0.0, |i| found[*i].worth);
    let worth_while = order.into_iter().filter(|i| found[*i].worth >= LEAST * best).take(KEPT);
    Ok(worth_while.map(|i| found[i].clone()).collect())
}

/// Whether what is left when joints are held has none to spare for a cell of the grid; if so, whether its tool may spin.
pub(super) fn fits(robot: &Robot, joints: &[usize], task: &Task) -> Result<Option<bool>> {
    if joints.iter().enumerate().any(|(i, joint)| *joint >= robot.n() || joints[..i].contains(joint)) || joints.len() >= robot.n() {
        return Ok(None);
    }
    let rest = rest(robot, joints)?;
    let all = |spins: bool| {
        let cell = cell_task(spins, task);
        let rank = cell.rank(&rest);
        rank == rest.n() && rank == cell.rank(robot)
    };
    let spins = can_spin(robot, task);
    if spins && can_spin(&rest, task) {
        return Ok(all(true).then_some(true));
    }
    Ok(all(false).then_some(false))
}

/// What a cell of the grid asks of a robot without its spare joints: the task, or all where the spin is given too.
pub(super) fn cell_task(spins: bool, task: &Task) -> Task {
    if spins { Task::FULL } else { *task }
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

/// What the joints do to a task at random postures.
struct Motions {
    n: usize,
    rank: usize,
    /// The columns of the task's Jacobian, one posture after another; slides in units of the size of the robot.
    columns: Vec<Vec<Row6>>,
}

impl Motions {
    fn new(robot: &Robot, task: &Task, rank: usize) -> Self {
        let (n, size) = (robot.n(), robot.size());
        let (mut random, mut q) = (RandomPostures::new(1), [0.0; MAX_JOINTS]);
        let posture = |_| {
            random.fill(robot, &mut q[..n]);
            let (tool, jacobian) = jacobian_at(robot, &q[..n]);
            let directions = task.directions(&tool, size);
            let unit = |i: usize| if robot.joints()[i] == Joint::Prismatic { size } else { 1.0 };
            (0..n).map(|i| directions.reduce(jacobian.w[i], jacobian.v[i]).map(|x| unit(i) * x)).collect()
        };
        Self { n, rank, columns: (0..POSTURES).map(posture).collect() }
    }

    /// Mean part of the free motion that is in some joints, the others being enough for the task: 1 where these alone move, 0 where the task does not let them.
    /// It is the volume that an orthonormal basis of the null space has in their rows, and that is the volume of the columns of the others over that of all.
    fn share(&self, joints: &[usize]) -> f64 {
        let part = |columns: &Vec<Row6>| {
            let whole = volume(columns.iter(), self.rank);
            if whole > 0.0 { volume((0..self.n).filter(|i| !joints.contains(i)).map(|i| &columns[i]), self.rank) / whole } else { 0.0 }
        };
        self.columns.iter().map(part).sum::<f64>() / POSTURES as f64
    }

    /// Combinations of `count` joints: all, unless they are very many; then those among the joints that move most.
    fn combinations(&self, count: usize) -> Vec<Vec<usize>> {
        let losses: Vec<f64> = (0..self.n).map(|joint| -self.share(&[joint])).collect();
        let mut many = self.n;
        while many > count + 1 && number_of_combinations(many, count) > COMBINATIONS {
            many -= 1;
        }
        let moving = &ascending(&losses)[..many];
        let among: Vec<usize> = (0..self.n).filter(|joint| moving.contains(joint)).collect();
        combinations(&among, count)
    }
}

/// The product of the `rank` largest singular values of some columns.
fn volume<'a>(columns: impl Iterator<Item = &'a Row6>, rank: usize) -> f64 {
    let mut rows = [[0.0; MAX_JOINTS]; 6];
    let mut count = 0;
    for (i, column) in columns.enumerate() {
        (0..6).for_each(|r| rows[r][i] = column[r]);
        count = i + 1;
    }
    Svd::<MAX_JOINTS>::new(&rows, count.max(6), 6).sigma[..rank].iter().product()
}

/// How many choices of `count` of so many items there are.
fn number_of_combinations(items: usize, count: usize) -> usize {
    (0..count.min(items - count)).fold(1, |product, i| product * (items - i) / (i + 1))
}

/// All choices of `count` of some items, in their order.
fn combinations(items: &[usize], count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let with_first = |i: usize| combinations(&items[i + 1..], count - 1).into_iter().map(move |rest| [&[items[i]], &rest[..]].concat());
    (0..items.len()).flat_map(with_first).collect()
}
