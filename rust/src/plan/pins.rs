//! Postures and spins that are held at points of a path: where it begins and ends, and where somebody has put it.

use std::ops::Range;

use super::frames::{outside, spin, tools};
use super::hooks::{Hooks, PlanError};
use super::lattice::{Cells, Lattice};
use super::problem::{ON_PATH, PathProblem};
use super::settings::PlanSettings;
use crate::error::{Error, Result, check_finite, check_vector};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, norm};
use crate::robot::{Robot, nearest_turn};
use crate::task::volume::OrientationVolume;
use crate::task::{Target, Task};

/// A held posture this near to its point counts as on it [rad, m]: it is where the robot stands, as its controller shows it.
const HELD_ON_PATH: f64 = 1e-6;
/// Digits that a spin in degrees may lose at the ends of its range [rad].
const AT_RANGE: f64 = 1e-12;

/// What is held at a point.
#[derive(Debug, Clone, PartialEq)]
pub enum Held {
    /// All joints, whole turns included [rad or m].
    Posture(Vec<f64>),
    /// The spin of the tool from the path's frame \[rad\].
    Spin(f64),
}

/// What is held, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Pin {
    /// Point of the path, counted from 0.
    pub point: usize,
    /// What is held there.
    pub held: Held,
}

/// A pin and what it asks of the posture at its point.
#[derive(Debug, Clone)]
pub(super) struct Fixed {
    point: usize,
    pub held: Held,
    /// With a spin held: all that the tool can do.
    pub task: Task,
    pub target: Target,
}

/// The pins of a path, or of a stretch of it, in order.
#[derive(Debug, Clone, Default)]
pub struct Pins(Vec<Fixed>);

/// A path whose pins are checked.
pub(super) struct Pinned<'a> {
    pub robot: &'a Robot,
    pub frames: &'a [Frame],
    pub targets: &'a [Target],
    pub asked: &'a Task,
    pub task: &'a Task,
    pub volume: Option<&'a OrientationVolume>,
}

impl Pins {
    /// Those of the settings.
    ///
    /// # Errors
    /// [`Error::Value`] if a point is not on the path or held twice, a posture is off its point or beyond limits, a spin is not free or beyond its range,
    /// or the end of a closed path is held.
    pub(super) fn new(path: &Pinned, settings: &PlanSettings) -> Result<Self> {
        let last = path.frames.len() - 1;
        let end = |point: usize, q: &Option<Vec<f64>>| q.clone().map(|q| Pin { point, held: Held::Posture(q) });
        let ends = [("start".to_owned(), end(0, &settings.start)), ("end".to_owned(), end(last, &settings.end))];
        let others = settings.pins.iter().map(|pin| (format!("pins[{}]", pin.point), Some(pin.clone())));
        let mut all: Vec<Fixed> = Vec::new();
        for (name, pin) in ends.into_iter().chain(others) {
            let Some(pin) = pin else { continue };
            if pin.point > last {
                return Err(Error::value("pins", format!("at point {}", pin.point), &format!("points from 0 to {last}")));
            }
            if settings.closed && pin.point == last && last > 0 {
                let expected = "none at the last point of a closed path, which ends in the posture that it starts from";
                return Err(Error::value(&name, "given", expected));
            }
            if all.iter().any(|other| other.point == pin.point) {
                return Err(Error::value(&name, format!("a second one at point {}", pin.point), "one a point"));
            }
            all.push(path.fixed(&name, pin, settings)?);
        }
        all.sort_by_key(|pin| pin.point);
        Ok(Self(all))
    }

    /// Whether nothing is held.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The points at which something is held, in order.
    pub fn points(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().map(|pin| pin.point)
    }

    /// What is held at a point.
    #[inline]
    pub(super) fn at(&self, point: usize) -> Option<&Fixed> {
        if self.0.is_empty() {
            return None;
        }
        self.0.binary_search_by_key(&point, |pin| pin.point).ok().map(|at| &self.0[at])
    }

    /// The posture that is held at a point.
    #[inline]
    pub(super) fn posture(&self, point: usize) -> Option<&[f64]> {
        match &self.at(point)?.held {
            Held::Posture(q) => Some(q),
            Held::Spin(_) => None,
        }
    }

    /// The pins of some points, counted from the first of these.
    pub(super) fn within(&self, points: Range<usize>) -> Self {
        let kept = self.0.iter().filter(|pin| points.contains(&pin.point));
        Self(kept.map(|pin| Fixed { point: pin.point - points.start, ..pin.clone() }).collect())
    }

    /// The same with a spin held at all points between a spin that is held and the pins beside it: evenly from one to the other, the shorter way round.
    pub(super) fn spun(&self, problem: &PathProblem) -> Self {
        let Some(axis) = problem.asked.spin_axis() else { return self.clone() };
        let (task, mut all, mut before) = (Task::FULL.suited(&problem.robot), self.0.clone(), None);
        for pin in &self.0 {
            let (own, is_spin) = match &pin.held {
                Held::Spin(own) => (*own, true),
                Held::Posture(q) => (spin(&problem.frames[pin.point], &tools(&problem.robot, q)[0], axis), false),
            };
            let (from, start, was_spin) = before.unwrap_or((pin.point, own, is_spin));
            let end = nearest_turn(own, start);
            if is_spin || was_spin {
                all.extend((from + 1..pin.point).map(|point| {
                    let held = start + (end - start) * (point - from) as f64 / (pin.point - from) as f64;
                    spinning(point, held, axis, task, &problem.frames[point])
                }));
            }
            before = Some((pin.point, end, is_spin));
        }
        all.sort_by_key(|pin| pin.point);
        Self(all)
    }

    /// How far off the path a point may be [rad, m].
    pub(super) fn tolerance(&self, point: usize) -> f64 {
        if self.posture(point).is_some() { HELD_ON_PATH } else { ON_PATH }
    }

    /// The pins that a failure at a point hangs on: the one there, else the next on either side.
    pub(super) fn beside(&self, point: usize) -> Vec<usize> {
        if self.at(point).is_some() {
            return vec![point];
        }
        let (before, after) = (self.points().filter(|pin| *pin < point).last(), self.points().find(|pin| *pin > point));
        before.into_iter().chain(after).collect()
    }
}

/// The cells of a point at which something is held: its posture alone, or all postures of its spin.
pub(super) fn held_cells(
    problem: &PathProblem,
    lattice: &Lattice,
    point: usize,
    hooks: &mut Hooks,
) -> std::result::Result<Option<Cells>, PlanError> {
    // The way round a closed path ends where it starts.
    let point = if problem.closed && point + 1 == problem.points() { 0 } else { point };
    let Some(pin) = problem.pins.at(point) else { return Ok(None) };
    let axis = problem.asked.spin_axis().unwrap_or([0.0, 0.0, 1.0]);
    let q = match &pin.held {
        Held::Spin(spin) => return lattice.cells_at_spin(point, *spin, axis, hooks).map(Some),
        Held::Posture(q) => q,
    };
    let mut cells = lattice.cells_at_posture(point, q, problem.values(q)[0])?;
    if cells.is_open() && !hooks.all_allowed(q, q.len())? {
        cells.retain(q.len(), &[false]);
    }
    Ok(Some(cells))
}

/// A spin that is held.
fn spinning(point: usize, spin: f64, axis: Vec3, task: Task, frame: &Frame) -> Fixed {
    let tool = frame.compose(&Frame::rotation(axis, spin));
    Fixed { point, held: Held::Spin(spin), task, target: Target { position: tool.origin, axis: None, frame: tool.axes } }
}

impl Pinned<'_> {
    /// A pin that is checked.
    fn fixed(&self, name: &str, pin: Pin, settings: &PlanSettings) -> Result<Fixed> {
        let (point, frame) = (pin.point, &self.frames[pin.point]);
        match pin.held {
            Held::Posture(q) => {
                let held = Held::Posture(self.posture(name, point, q, settings)?);
                Ok(Fixed { point, held, task: *self.task, target: self.targets[point] })
            }
            Held::Spin(spin) => {
                let (axis, task) = self.spin(name, spin, settings)?;
                Ok(spinning(point, spin, axis, task, frame))
            }
        }
    }

    fn posture(&self, name: &str, point: usize, mut q: Vec<f64>, settings: &PlanSettings) -> Result<Vec<f64>> {
        check_vector(name, &q, self.robot.n())?;
        let limits = self.robot.limits();
        if settings.limits && !limits.settle(&mut q) {
            let beyond = (0..q.len()).find(|&i| !limits.admit(i, q[i]));
            let given = beyond.map_or_else(
                || "a posture beyond a limit on several joints".to_owned(),
                |i| format!("a posture with {} at {:?}", self.robot.joint_label(i), q[i]),
            );
            let range = beyond.map_or(String::new(), |i| format!(", from {:?} to {:?}", limits.q_min[i], limits.q_max[i]));
            return Err(Error::value(name, given, &format!("one within its limits{range}")));
        }
        let (turn, shift) = self.task.error(&tools(self.robot, &q)[0], &self.targets[point]);
        let (angle, distance) = (norm(turn), norm(shift));
        if angle.max(distance) > HELD_ON_PATH {
            let given = format!("a posture {:.3e} m and {:.3e} rad off point {point} of the path", distance, angle);
            return Err(Error::value(name, given, "one within 1e-6 of it"));
        }
        let outside = self.volume.map_or(0.0, |volume| outside(volume, &self.frames[point], &tools(self.robot, &q)[0]));
        if outside > HELD_ON_PATH {
            let given = format!("a posture {outside:.3e} rad outside the orientation volume at point {point}");
            return Err(Error::value(name, given, "one within 1e-6 of it"));
        }
        Ok(q)
    }

    fn spin(&self, name: &str, spin: f64, settings: &PlanSettings) -> Result<(Vec3, Task)> {
        check_finite(name, &[spin])?;
        if self.volume.is_some() {
            let given = format!("a spin of {spin:?} rad, but the task is an orientation volume");
            return Err(Error::value(name, given, "a posture"));
        }
        let task = Task::FULL.suited(self.robot);
        let Some(axis) = self.asked.spin_axis().filter(|_| task.dimension() > self.task.dimension()) else {
            let given = format!("a spin of {spin:?} rad, but the task leaves {} no spin", self.robot.name());
            return Err(Error::value(name, given, "a posture"));
        };
        match settings.spin_range {
            Some((low, high)) if spin < low - AT_RANGE || spin > high + AT_RANGE => {
                Err(Error::value(name, format!("a spin of {spin:?} rad"), &format!("one within spin_range, from {low:?} to {high:?}")))
            }
            _ => Ok((axis, task)),
        }
    }
}
