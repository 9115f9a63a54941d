//! The joint of a robot with one more than six revolute ones that is held at values over its range, and these values.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use super::any::TaskInverse;
use super::singularity::self_motion;
use crate::error::{Error, Result};
use crate::robot::{Joint, RandomPostures, Robot};
use crate::task::Task;

/// Where a joint is held to look at the rest [rad or m]: not at a special place.
const ANYWHERE: f64 = 0.37;
/// Postures at which the self-motion is looked at.
const POSTURES: usize = 64;

/// The joint that is held in turn, and its values: `samples` over its limits, ends included; over a turn without them. It is the one whose holding leaves
/// a closed form, of several the one with the largest share in the self-motion (mean of its squared part of the unit null vector over random postures).
pub fn grid(robot: &Robot, task: &Task, fixed: &[(usize, f64)], samples: usize) -> Result<(usize, Vec<f64>)> {
    if samples == 0 {
        return Err(Error::value("samples", samples, "at least 1"));
    }
    let moving: Vec<usize> = (0..robot.n()).filter(|i| fixed.iter().all(|(held, _)| held != i)).collect();
    let given = format!("given for the joints '{}' with {} held", robot.joint_letters(), fixed.len());
    let refused = || Error::value("samples", &given, "a robot with one joint more than the task takes, the others held (fixed)");
    let whole = robot.with_fixed(fixed)?;
    let taken = task.rank(&whole);
    if moving.len() != taken + 1 {
        return Err(refused());
    }
    let share = if moving.len() == 7 { shares(&whole) } else { vec![0.0; moving.len()] };
    let mut best: Option<((u8, bool), f64, usize)> = None;
    for (k, &joint) in moving.iter().enumerate() {
        let held = [fixed, &[(joint, ANYWHERE)]].concat();
        let rest = robot.with_fixed(&held)?;
        if task.rank(&rest) < taken {
            continue;
        }
        // A rail before the others.
        let rank = (TaskInverse::new(Arc::new(rest), *task)?.effort(), robot.joints()[joint] == Joint::Revolute);
        if best.is_none_or(|(least, most, _)| rank < least || (rank == least && share[k] > most)) {
            best = Some((rank, share[k], joint));
        }
    }
    let (_, _, joint) = best.ok_or_else(refused)?;
    Ok((joint, values(robot, joint, samples)?))
}

/// The share of each joint in the self-motion.
fn shares(robot: &Robot) -> Vec<f64> {
    let (mut random, mut q, mut share) = (RandomPostures::new(1), vec![0.0; robot.n()], vec![0.0; robot.n()]);
    for _ in 0..POSTURES {
        random.fill(robot, &mut q);
        for (sum, x) in share.iter_mut().zip(self_motion(robot, &q)) {
            *sum += x * x / POSTURES as f64;
        }
    }
    share
}

fn values(robot: &Robot, joint: usize, samples: usize) -> Result<Vec<f64>> {
    let limits = robot.limits();
    let (low, high) = (limits.q_min[joint], limits.q_max[joint]);
    let turns = robot.joints()[joint] == Joint::Revolute;
    let steps = |low: f64, range: f64, count: usize| (0..samples).map(move |k| low + range / count as f64 * k as f64).collect();
    if turns && high - low >= TAU {
        // A turn about the middle; next to a single limit.
        let start = (limits.middle(joint) - PI).max(low).min(high - TAU);
        return Ok(steps(start, TAU, samples));
    }
    if !limits.is_bounded(joint) {
        return Err(Error::value(
            &format!("limits of joint {joint}"),
            format!("({low}, {high})"),
            "two limits, for a joint that slides to be swept",
        ));
    }
    if samples == 1 {
        return Ok(vec![limits.middle(joint)]);
    }
    let mut values: Vec<f64> = steps(low, high - low, samples - 1);
    values[samples - 1] = high;
    Ok(values)
}
