//! An orientation volume in a tick: the bounds of the tool's orientation about the path's as rows of its rates, to second order.
//!
//! A bound is `slack(q) >= 0`, or `= 0` for what has no width (From and Gravdahl, sections 7 and 8). A row that is linear about the posture at which the tick ends
//! holds there exactly: it is Newton's method for that bound. A first row is linear about where the rates of the tick before lead.

use std::cmp::Ordering;

use super::bounds::fastest;
use crate::error::{Error, Result};
use crate::kinematics::sized::{Jacobian, forward, jacobian_apart};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, dot, norm};
use crate::qp::DenseRow;
use crate::robot::{Limits, Robot};
use crate::task::Task;
use crate::task::volume::{MAX_SIDES, OrientationVolume, Shape, Side, Sides};

/// Speed at which a tool outside comes back [rad/s], beside what the path's frame turns.
const RETURN_SPEED: f64 = 0.5;
/// A tool is outside from here [rad]: what ticks may leave.
const OUTSIDE: f64 = 1e-9;
/// What a bound may be short of at the end of a tick [rad].
pub(super) const SHORT: f64 = 1e-10;
/// Newton steps of a tick for its bounds, at most, first for the least cost; the force of a bound, whose curvature a row leaves out, may make that slow.
pub(super) const ROUNDS: usize = 12;
/// Steps from this one on look for the nearest rates with the task as it is, which a cone that is thin beside the turn of its frame takes some of; those from the
/// second on for the nearest at all.
const SETTLING: usize = 3;
const NEAREST: usize = 7;
/// The step that goes back to standing still, from where every bound is near.
const FROM_REST: usize = 9;
/// Sum of the motions of all joints [rad] up to which the tick before tells where this one leads.
pub(super) const TELLING: f64 = 0.1;
/// How much faster a slack can fall than the tool turns, at most, beside the length of its rate.
const CURVED: f64 = 2.0;
/// Part of the acceleration of its joints together that the tool brakes with in front of a bound.
const BRAKES: f64 = 0.5;
/// Step of differences [rad or m].
const DIFFERENCE: f64 = 1e-5;
/// A rate of a slack below this has no direction.
const LEVEL: f64 = 1e-6;
/// Halvings of rates that no row keeps inside.
const HALVINGS: usize = 40;

/// The axes of the path's frame in a tick, by columns in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathFrame {
    /// At the start of the tick: where the tool is outside of the volume about it too, it comes back at a bounded speed. That at the end if not given.
    pub start: Option<[Vec3; 3]>,
    /// At its end.
    pub end: [Vec3; 3],
}

/// A volume in a tick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inside<'a> {
    volume: &'a OrientationVolume,
    frame: [Vec3; 3],
    pub count: usize,
    /// What each bound has at the start, about the frame at the end.
    start: [f64; MAX_SIDES],
    /// What each has to have at the end: at least, or exactly where `equal`.
    end: [f64; MAX_SIDES],
    equal: [bool; MAX_SIDES],
    /// How much each falls by a turn of the tool, at most.
    slope: [f64; MAX_SIDES],
    /// Whether the tool is outside at the start, and comes back.
    pub outside: bool,
}

/// Checks that a volume can be part of a task of a solver, whose other part is the position.
pub(super) fn check_volume(volume: &OrientationVolume, task: &Task) -> Result<()> {
    if *task != Task::POSITION {
        return Err(Error::value("task", format!("{} beside a volume", task.kind()), "position beside a volume"));
    }
    volume.check_as_task()
}

impl<'a> Inside<'a> {
    /// What the bounds ask of a tick that starts with the tool at `tool`.
    #[inline(always)]
    pub fn new(volume: &'a OrientationVolume, frame: &PathFrame, tool: &Frame, dt: f64) -> Self {
        Self::of(volume, frame, tool, dt, &volume.sides(&frame.end, &tool.axes))
    }

    /// The same with the sides there.
    #[inline(never)]
    pub fn of(volume: &'a OrientationVolume, frame: &PathFrame, tool: &Frame, dt: f64, sides: &Sides) -> Self {
        let mut out = Self {
            volume,
            frame: frame.end,
            count: 0,
            start: [0.0; MAX_SIDES],
            end: [0.0; MAX_SIDES],
            equal: [false; MAX_SIDES],
            slope: [0.0; MAX_SIDES],
            outside: false,
        };
        for (i, side) in sides.as_slice().iter().enumerate() {
            (out.start[i], out.equal[i], out.slope[i]) = (side.slack, side.equality, CURVED * norm(side.rate).max(1.0));
            out.count = i + 1;
        }
        if (0..out.count).any(|i| out.beyond(i, out.start[i]) > 0.0) {
            out.come_back(frame, tool, dt);
        }
        out
    }

    /// How far a slack is from what it has to be, above zero where that is too little.
    #[inline(always)]
    fn beyond(&self, i: usize, slack: f64) -> f64 {
        if self.equal[i] { slack.abs() } else { -slack }
    }

    /// Bounds that do not hold yet: what the frame turns in the tick is made up for, what was outside before comes back at a bounded speed.
    #[cold]
    #[inline(never)]
    fn come_back(&mut self, frame: &PathFrame, tool: &Frame, dt: f64) {
        let before = self.volume.sides(frame.start.as_ref().unwrap_or(&frame.end), &tool.axes);
        for (i, side) in before.as_slice().iter().enumerate().take(self.count) {
            let (now, was) = (self.beyond(i, self.start[i]), self.beyond(i, side.slack));
            self.outside |= was > OUTSIDE;
            // Far outside a slack is no angle: its rate tells what a turn makes of it.
            let way = RETURN_SPEED * dt * self.slope[i] / CURVED + (now - was.max(0.0)).max(0.0);
            self.end[i] = (now - way).max(0.0).copysign(self.start[i]);
        }
    }

    /// Leaves the room that joints with limits of acceleration need to come to rest in front of a bound.
    #[cold]
    #[inline(never)]
    pub fn brake(&mut self, tool: &Frame, turns: &[Vec3], limits: &Limits, dt: f64) {
        let sides = self.volume.sides(&self.frame, &tool.axes);
        for (i, side) in sides.as_slice().iter().enumerate().filter(|(i, side)| !side.equality && self.start[*i] > 0.0) {
            // The turn towards a bound that can be stopped in front of it, and the slack that it takes, to second order where the tool stands in the middle.
            let (steep, bent) = (norm(side.rate), side.normal.map_or(1.0, norm));
            let along = |w: &Vec3| if steep > LEVEL { dot(side.rate, *w) / steep } else { norm(*w) };
            let acceleration: f64 = turns.iter().zip(&limits.qdd_max).map(|(w, most)| (along(w) * most).abs()).sum();
            let turn = dt * fastest(self.start[i], BRAKES * acceleration, dt);
            self.end[i] = (self.start[i] - turn * (steep + 0.5 * bent * turn)).max(0.0);
        }
    }

    /// Whether a bound may be short at the end of a tick in which the tool turns by no more than `turn`.
    #[inline(always)]
    pub fn near(&self, turn: f64) -> bool {
        (0..self.count).any(|i| self.equal[i] || self.may_lack(i, self.start[i], turn))
    }

    /// Whether a bound with a slack may be short when the tool has turned by `turn` more.
    #[inline(always)]
    pub fn may_lack(&self, i: usize, slack: f64, turn: f64) -> bool {
        slack - self.slope[i] * turn < self.end[i] + SHORT
    }

    /// Whether a bound lacks something.
    #[inline(always)]
    pub fn lack_any(&self, sides: &Sides) -> bool {
        sides.as_slice().iter().enumerate().any(|(i, side)| self.lack(i, side.slack).1)
    }

    /// The bounds with the tool at `tool` at the end.
    #[inline(always)]
    pub fn sides(&self, tool: &Frame) -> Sides {
        self.volume.sides(&self.frame, &tool.axes)
    }

    /// Whether a bound is an equation.
    #[inline(always)]
    pub fn is_equal(&self, i: usize) -> bool {
        self.equal[i]
    }

    /// What a bound lacks at the end with a slack, with the sign of an equation, and whether that is too much.
    #[inline(always)]
    pub fn lack(&self, i: usize, slack: f64) -> (f64, bool) {
        let by = self.end[i] - slack;
        (by, if self.equal[i] { by.abs() > SHORT } else { by > SHORT })
    }

    /// How much the bounds are short of, at most, with the tool at `tool` at the end.
    pub fn short(&self, tool: &Frame) -> f64 {
        let sides = self.volume.sides(&self.frame, &tool.axes);
        // A tool that points backwards has one bound, which leads to where it has the others.
        match sides.as_slice().len().cmp(&self.count) {
            Ordering::Less => return f64::INFINITY,
            Ordering::Greater => return f64::NEG_INFINITY,
            Ordering::Equal => {}
        }
        let short = |(i, side): (usize, &Side)| {
            let by = self.end[i] - side.slack;
            if self.equal[i] { by.abs() } else { by }
        };
        sides.as_slice().iter().enumerate().take(self.count).map(short).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Writes the bounds as rows of rates, linear about a motion, which takes the tool to `tool` with a Jacobian there.
    pub fn write<const C: usize>(&self, (tool, there): (&Frame, &Jacobian<C>), motion: &[f64; C], dt: f64, rows: &mut [DenseRow<C>]) {
        let sides = self.volume.sides(&self.frame, &tool.axes);
        for (i, (side, row)) in sides.as_slice().iter().zip(rows).enumerate().take(self.count) {
            let (scale, missing) = self.in_angles(i, side.slack);
            row.a = std::array::from_fn(|k| scale * dot(side.rate, there.w[k]));
            let along: f64 = row.a.iter().zip(motion).map(|(a, x)| a * x).sum();
            row.lower = (missing + along) / dt;
            row.upper = if self.equal[i] { row.lower } else { f64::INFINITY };
        }
    }

    /// What a slack lacks at the end, and what its rate has to be multiplied with for that: where the frame turns out of a cone the angle of tilt, of which a cosine is
    /// a poor measure where the cone is thin.
    #[inline(always)]
    fn in_angles(&self, i: usize, slack: f64) -> (f64, f64) {
        let missing = self.end[i] - slack;
        if let Shape::Cone(tilt) = self.volume.shape()
            && i == 0
            && !self.outside
            && slack < 0.0
            && missing > 0.0
        {
            let (sine, cosine) = tilt.sin_cos();
            let angle = |slack: f64| (slack * sine + cosine).clamp(-1.0, 1.0).acos();
            let now = angle(slack);
            if sine > 0.0 && now.sin() > LEVEL {
                return (sine / now.sin(), now - angle(self.end[i]));
            }
        }
        (1.0, missing)
    }

    /// The same about where rates lead.
    #[inline(never)]
    pub fn write_about<const C: usize>(&self, robot: &Robot, q: &[f64], rates: &[f64], dt: f64, rows: &mut [DenseRow<C>]) {
        let mut motion = [0.0; C];
        let mut there = [0.0; C];
        for i in 0..q.len() {
            motion[i] = dt * rates[i];
            there[i] = q[i] + motion[i];
        }
        let (tool, columns) = jacobian_apart::<C>(robot, &there[..q.len()]);
        self.write((&tool, &columns), &motion, dt, rows);
    }

    /// The first rows of a tick from where the tool and its Jacobian are given: about where the rates of the tick before lead, where a bound is near.
    #[inline(always)]
    pub fn predict<const C: usize>(
        &self,
        robot: &Robot,
        q: &[f64],
        at: (&Frame, &Jacobian<C>),
        before: Option<&[f64; MAX_JOINTS]>,
        dt: f64,
        rows: &mut [DenseRow<C>],
    ) {
        if let Some(rates) = before {
            let turn = turn(&rates[..q.len()], dt);
            if turn <= TELLING && turn > 0.0 && self.near(turn) {
                return self.write_about(robot, q, &rates[..q.len()], dt, rows);
            }
        }
        self.write(at, &[0.0; C], dt, rows);
    }

    /// Whether rates leave a bound short.
    #[inline(always)]
    pub fn falls_short<const C: usize>(&self, robot: &Robot, q: &[f64], rates: &[f64], dt: f64) -> bool {
        self.near(turn(rates, dt)) && self.short_after::<C>(robot, q, rates, dt) > SHORT
    }

    #[inline(never)]
    fn short_after<const C: usize>(&self, robot: &Robot, q: &[f64], rates: &[f64], dt: f64) -> f64 {
        let mut there = [0.0; C];
        for i in 0..q.len() {
            there[i] = q[i] + dt * rates[i];
        }
        self.short(&forward::<C>(robot, &there[..q.len()]))
    }

    /// Shortens rates that no row keeps inside until they leave nothing short, if to stand still does not.
    #[cold]
    #[inline(never)]
    pub fn shorten(&self, robot: &Robot, q: &[f64], dt: f64, rates: &mut [f64]) {
        let short = |rates: &[f64]| self.short_after::<MAX_JOINTS>(robot, q, rates, dt) > SHORT;
        if short(&[0.0; MAX_JOINTS][..q.len()]) {
            return;
        }
        let mut halvings = 0;
        while short(rates) && halvings < HALVINGS {
            rates.iter_mut().for_each(|rate| *rate *= 0.5);
            halvings += 1;
        }
    }
}

/// The second derivative of the sum of slacks with weights, by differences of their rates.
#[cold]
#[inline(never)]
pub(super) fn curvature(
    volume: &OrientationVolume,
    robot: &Robot,
    frame: &[Vec3; 3],
    q: &[f64],
    weights: &[f64; MAX_SIDES],
) -> [[f64; MAX_JOINTS]; MAX_JOINTS] {
    let (n, mut there, mut out) = (q.len(), [0.0; MAX_JOINTS], [[0.0; MAX_JOINTS]; MAX_JOINTS]);
    there[..n].copy_from_slice(q);
    for k in 0..n {
        for (step, sign) in [(DIFFERENCE, 0.25), (-DIFFERENCE, -0.25)] {
            there[k] = q[k] + step;
            let (tool, columns) = jacobian_apart::<MAX_JOINTS>(robot, &there[..n]);
            for (side, weight) in volume.sides(frame, &tool.axes).as_slice().iter().zip(weights) {
                for i in 0..n {
                    let part = sign / DIFFERENCE * weight * dot(side.rate, columns.w[i]);
                    out[i][k] += part;
                    out[k][i] += part;
                }
            }
        }
        there[k] = q[k];
    }
    out
}

/// What a Newton step of a tick for its bounds looks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// The least cost.
    Whole,
    /// The nearest rates, with the task as it is.
    Task,
    /// The nearest rates.
    Nearest,
    /// The same, from standing still.
    Rest,
}

impl Step {
    /// The step of a round; round 0 is the tick without any.
    pub fn of(round: usize) -> Self {
        match round {
            FROM_REST => Self::Rest,
            0..SETTLING => Self::Whole,
            SETTLING..NEAREST => Self::Task,
            _ => Self::Nearest,
        }
    }

    /// The round after one whose rows exclude each other: from standing still, once.
    pub fn after_excluding(round: usize) -> Option<usize> {
        (round < FROM_REST).then_some(FROM_REST)
    }

    /// Whether there is one.
    pub fn exists(round: usize) -> bool {
        round <= ROUNDS
    }
}

/// How far rates turn the tool in a tick, at most.
#[inline(always)]
pub(super) fn turn(rates: &[f64], dt: f64) -> f64 {
    dt * rates.iter().map(|rate| rate.abs()).sum::<f64>()
}
