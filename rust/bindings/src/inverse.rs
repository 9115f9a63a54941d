//! Inverse kinematics as Python gets it.

use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};
use pyo3::types::PyDict;

use crate::array::{elements, ok, output};
use crate::robot::frames::read_frame;
use redundancy::error::{Error, Result, check_finite};
use redundancy::inverse::{ArmAngle, Inverse};
use redundancy::linalg::MAX_JOINTS;
use redundancy::linalg::frame::Frame;
use redundancy::robot::{Joint, Limits, Robot};

/// Postures, whether each is at a singularity, whether there are no others.
pub type Report<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<bool>>, bool);

/// Postures of n joints, one after the other.
struct Postures {
    n: usize,
    q: Vec<f64>,
    singular: Vec<bool>,
    complete: bool,
}

/// The joints that are held: ``{joint: coordinate}``.
pub fn read_fixed(fixed: &Bound<'_, PyDict>) -> PyResult<Vec<(usize, f64)>> {
    let wrong = |item: String| Failure::from(Error::value("fixed", item, "joints counted from 0, each with a coordinate"));
    fixed
        .iter()
        .map(|(joint, value)| match (joint.extract::<usize>(), value.extract::<f64>()) {
            (Ok(joint), Ok(value)) => Ok((joint, value)),
            _ => Err(wrong(format!("{{{joint}: {value}}}"))),
        })
        .collect()
}

/// Which solutions of a pose are asked for.
pub struct Wanted<'a, 'py> {
    pub fixed: Option<&'a Bound<'py, PyDict>>,
    pub arm_angle: Option<f64>,
    pub limits: bool,
    pub turns: bool,
}

/// All postures for a pose.
pub fn solve<'py>(
    py: Python<'py>,
    robot: &Arc<Robot>,
    solver: &OnceLock<Result<Inverse>>,
    pose: &Bound<'py, PyAny>,
    wanted: &Wanted<'_, 'py>,
) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Vec<bool>, bool)> {
    let target = read_frame("pose", pose)?;
    let mut found = match (wanted.fixed, wanted.arm_angle) {
        (Some(_), Some(_)) => return Err(Error::value("arm_angle", "given beside fixed", "one of the two").into()),
        (_, Some(angle)) => ok(with_arm_angle(robot, &target, angle))?,
        (Some(fixed), None) => ok(with_fixed(robot, &target, &read_fixed(fixed)?))?,
        (None, None) => match solver.get_or_init(|| Inverse::new(robot.clone())) {
            Ok(solver) => six(solver, &target),
            Err(_) => return Err(ok(Inverse::new(robot.clone())).err().unwrap_or_else(|| Error::Model("no inverse".into()).into())),
        },
    };
    if wanted.limits || wanted.turns {
        let held = wanted.fixed.map(read_fixed).transpose()?.unwrap_or_default();
        found.within_limits(robot, wanted.turns, &held);
    }
    let count = found.singular.len();
    let array = output(py, None, [count, found.n])?;
    elements(&array).copy_from_slice(&found.q);
    Ok((array, found.singular, found.complete))
}

/// As a report.
pub fn report<'py>(py: Python<'py>, (array, singular, complete): (Bound<'py, PyArrayDyn<f64>>, Vec<bool>, bool)) -> Report<'py> {
    (array, PyArray1::from_vec(py, singular), complete)
}

fn six(solver: &Inverse, target: &Frame) -> Postures {
    let found = solver.solve(target);
    Postures {
        n: 6,
        q: found.q[..found.count].as_flattened().to_vec(),
        singular: found.singular[..found.count].to_vec(),
        complete: found.complete,
    }
}

fn with_fixed(robot: &Arc<Robot>, target: &Frame, fixed: &[(usize, f64)]) -> Result<Postures> {
    let solver = Inverse::new(Arc::new(robot.with_fixed(fixed)?))?;
    let found = six(&solver, target);
    let mut q = Vec::with_capacity(found.singular.len() * robot.n());
    for row in found.q.chunks_exact(6) {
        let mut moving = row.iter();
        for joint in 0..robot.n() {
            let held = fixed.iter().rev().find(|(held, _)| *held == joint).map(|(_, value)| *value);
            q.push(held.or_else(|| moving.next().copied()).unwrap_or(f64::NAN));
        }
    }
    Ok(Postures { n: robot.n(), q, ..found })
}

fn with_arm_angle(robot: &Robot, target: &Frame, angle: f64) -> Result<Postures> {
    check_finite("arm_angle", &[angle])?;
    let found = ArmAngle::new(robot)?.solve(target, angle);
    Ok(Postures {
        n: 7,
        q: found.q[..found.count].as_flattened().to_vec(),
        singular: found.singular[..found.count].to_vec(),
        complete: found.complete,
    })
}

impl Postures {
    /// Leaves what is within the limits, whole turns of a joint considered: one of each posture, or all. Joints that are held stay.
    fn within_limits(&mut self, robot: &Robot, all: bool, held: &[(usize, f64)]) {
        let (mut q, mut singular) = (Vec::new(), Vec::new());
        let free: Vec<bool> =
            (0..self.n).map(|i| robot.joints()[i] == Joint::Revolute && held.iter().all(|(joint, _)| *joint != i)).collect();
        for (row, flag) in self.q.chunks_exact(self.n).zip(&self.singular) {
            let mut buffer = [0.0; MAX_JOINTS];
            buffer[..self.n].copy_from_slice(row);
            place(robot.limits(), &free, all, &mut buffer[..self.n], 0, &mut |row| {
                q.extend_from_slice(row);
                singular.push(*flag);
            });
        }
        (self.q, self.singular) = (q, singular);
    }
}

/// Calls `each` with the posture if it is within the limits; with `all`, joints from `joint` on that may turn (`free`) in every whole turn.
fn place(limits: &Limits, free: &[bool], all: bool, row: &mut [f64], joint: usize, each: &mut impl FnMut(&[f64])) {
    if joint == row.len() {
        return each(row);
    }
    let (low, high) = (limits.q_min[joint], limits.q_max[joint]);
    let given = row[joint];
    let turning = all && free[joint] && limits.is_bounded(joint);
    let first = if turning { given + TAU * ((low - given) / TAU).ceil() } else { given };
    let copies = if turning { ((high - first) / TAU).floor() + 1.0 } else { 1.0 };
    for copy in 0..copies.max(0.0) as usize {
        row[joint] = first + TAU * copy as f64;
        if row[joint] >= low && row[joint] <= high {
            place(limits, free, all, row, joint + 1, each);
        }
    }
    row[joint] = given;
}
