//! Limits of the joints. A joint without a limit has an infinite one.

use std::f64::consts::TAU;

use super::Combination;
use super::combination::MAX_COMBINATIONS;
use crate::error::{Error, Result};

/// A coordinate beyond a limit by no more than this is on it [rad or m]: rounding takes a posture no farther. Where it is handed out it is put onto the
/// limit, which moves the tool by no more than this angle at the length of the arm.
pub const AT_LIMIT: f64 = 1e-9;
/// Projections onto one limit after another that bring a posture within all of them, at most.
const PROJECTIONS: usize = 200;
/// How far inside a posture is put by these, as a part of a range, so that the last of them ends it.
const INSIDE: f64 = 1e-3;

/// Angles nearer to each other than this are so without a turn \[rad\]: a little less than half a turn, so that rounding does not tell.
const NEAR: f64 = 3.1;

/// The angle that is another up to whole turns and nearest to a third.
#[inline(always)]
pub fn nearest_turn(angle: f64, to: f64) -> f64 {
    // Nearly every angle of an inverse solver: a division and a call less.
    if (angle - to).abs() < NEAR {
        return angle;
    }
    angle - TAU * ((angle - to) / TAU).round()
}

/// Limits of position, speed and acceleration; infinite where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Lower position limits [rad or m].
    pub q_min: Vec<f64>,
    /// Upper position limits [rad or m].
    pub q_max: Vec<f64>,
    /// Speed limits [rad/s or m/s].
    pub qd_max: Vec<f64>,
    /// Acceleration limits [rad/s^2 or m/s^2].
    pub qdd_max: Vec<f64>,
    /// Limits on combinations of joints, at most [`MAX_COMBINATIONS`].
    pub coupled: Vec<Combination>,
}

impl Limits {
    /// No limit on any of `n` joints.
    pub fn none(n: usize) -> Self {
        Self {
            q_min: vec![f64::NEG_INFINITY; n],
            q_max: vec![f64::INFINITY; n],
            qd_max: vec![f64::INFINITY; n],
            qdd_max: vec![f64::INFINITY; n],
            coupled: Vec::new(),
        }
    }

    /// Lengths agree, nothing is NaN, lower below upper, rates above zero.
    pub fn check(&self, n: usize) -> Result<()> {
        let named = [("q_min", &self.q_min), ("q_max", &self.q_max), ("qd_max", &self.qd_max), ("qdd_max", &self.qdd_max)];
        for (name, values) in named {
            if values.len() != n {
                return Err(Error::length(name, values.len(), n));
            }
            if let Some(index) = values.iter().position(|x| x.is_nan()) {
                return Err(Error::NonFinite { name: name.into(), index, value: f64::NAN });
            }
        }
        for i in 0..n {
            if self.q_min[i] >= self.q_max[i] {
                return Err(Error::value(&format!("q_min[{i}]"), self.q_min[i], &format!("a limit below q_max[{i}] = {}", self.q_max[i])));
            }
        }
        for (name, values) in &named[2..] {
            if let Some(index) = values.iter().position(|x| *x <= 0.0) {
                return Err(Error::value(&format!("{name}[{index}]"), values[index], "a limit above 0"));
            }
        }
        if self.coupled.len() > MAX_COMBINATIONS {
            let given = format!("{} combinations", self.coupled.len());
            return Err(Error::value("coupled", given, &format!("at most {MAX_COMBINATIONS}")));
        }
        self.coupled.iter().enumerate().try_for_each(|(at, combination)| combination.check(at, n))
    }

    /// Whether joint `i` has both position limits.
    #[inline]
    pub fn is_bounded(&self, i: usize) -> bool {
        self.q_min[i].is_finite() && self.q_max[i].is_finite()
    }

    /// Middle and half of the range of joint `i`, if it has both limits.
    #[inline]
    pub fn middle_and_half(&self, i: usize) -> Option<(f64, f64)> {
        self.is_bounded(i).then(|| (0.5 * (self.q_min[i] + self.q_max[i]), 0.5 * (self.q_max[i] - self.q_min[i])))
    }

    /// The middle of the range of joint `i`; where it lacks a limit, the coordinate next to 0 that the other one allows.
    #[inline]
    pub fn middle(&self, i: usize) -> f64 {
        self.middle_and_half(i).map_or_else(|| 0f64.clamp(self.q_min[i], self.q_max[i]), |(middle, _)| middle)
    }

    /// What its own limits and those on combinations leave joint `i`, wherever the others are within their own.
    #[inline(never)]
    pub fn range(&self, i: usize) -> (f64, f64) {
        let (mut low, mut high) = (self.q_min[i], self.q_max[i]);
        for Combination { row, low: least, high: most } in self.coupled.iter().filter(|it| it.row[i] != 0.0) {
            let (mut below, mut above) = (0.0, 0.0);
            for j in (0..row.len()).filter(|&j| j != i && row[j] != 0.0) {
                let ends = (row[j] * self.q_min[j], row[j] * self.q_max[j]);
                (below, above) = (below + ends.0.min(ends.1), above + ends.0.max(ends.1));
            }
            let ends = ((least - above) / row[i], (most - below) / row[i]);
            (low, high) = (low.max(ends.0.min(ends.1)), high.min(ends.0.max(ends.1)));
        }
        (low, high)
    }

    /// An angle of joint `i` by whole turns nearest to the middle of its range: to 0 without limits, to the limit with one that it is beyond. The one
    /// rule for whole turns of a joint alone; [`super::Robot::turn`] adds what combinations ask for.
    #[inline(always)]
    pub fn turned(&self, i: usize, angle: f64) -> f64 {
        let middle = self.middle_and_half(i).map_or(0.0, |(middle, _)| middle);
        let near = nearest_turn(angle, middle);
        if self.is_bounded(i) { near } else { self.brought_back(i, near) }
    }

    /// As many whole turns as bring an angle back from beyond a limit.
    #[inline(always)]
    pub fn brought_back(&self, i: usize, angle: f64) -> f64 {
        if angle < self.q_min[i] - AT_LIMIT {
            angle + TAU * ((self.q_min[i] - AT_LIMIT - angle) / TAU).ceil()
        } else if angle > self.q_max[i] + AT_LIMIT {
            angle - TAU * ((angle - self.q_max[i] - AT_LIMIT) / TAU).ceil()
        } else {
            angle
        }
    }

    /// Whether a coordinate of joint `i` is within its own position limits or on one ([`AT_LIMIT`]); NaN is not.
    #[inline(always)]
    pub fn admit(&self, i: usize, x: f64) -> bool {
        x - self.q_min[i] >= -AT_LIMIT && self.q_max[i] - x >= -AT_LIMIT
    }

    /// Whether `q` is within the position limits or on one ([`AT_LIMIT`]), those on combinations included; NaN is not.
    #[inline(never)]
    pub fn contain(&self, q: &[f64]) -> bool {
        (0..q.len()).all(|i| self.admit(i, q[i])) && self.coupled.iter().all(|it| it.margin(q) >= -AT_LIMIT)
    }

    /// Puts coordinates that rounding has taken beyond a limit of theirs onto it; whether `q` is within all limits, else it stays as it is.
    #[inline(never)]
    pub fn settle(&self, q: &mut [f64]) -> bool {
        let within = self.contain(q);
        if within {
            self.clamp(q);
        }
        within
    }

    /// The smallest distance of `q` to a limit, negative outside [rad or m]; infinite without limits. That of a combination is its value's over the length
    /// of its row: how far the joints are from it.
    #[inline(never)]
    pub fn margin(&self, q: &[f64]) -> f64 {
        let alone = (0..q.len()).map(|i| (q[i] - self.q_min[i]).min(self.q_max[i] - q[i])).fold(f64::INFINITY, f64::min);
        self.coupled.iter().map(|it| it.margin(q)).fold(alone, f64::min)
    }

    /// Every joint within its own limits.
    fn clamp(&self, q: &mut [f64]) {
        for (i, x) in q.iter_mut().enumerate() {
            *x = x.max(self.q_min[i]).min(self.q_max[i]);
        }
    }

    /// Moves `q` within all limits where it is not, by projections onto one after another; whether it got there.
    #[cold]
    #[inline(never)]
    pub fn pull_inside(&self, q: &mut [f64]) -> bool {
        for _ in 0..PROJECTIONS {
            self.clamp(q);
            if self.contain(q) {
                return true;
            }
            for it in &self.coupled {
                let (value, range) = (it.value(q), it.high - it.low);
                let edge = if range.is_finite() { INSIDE * range } else { INSIDE };
                let by = (value - (it.high - edge)).max(0.0) - (it.low + edge - value).max(0.0);
                let square = it.row.iter().map(|c| c * c).sum::<f64>();
                q.iter_mut().zip(&it.row).for_each(|(x, c)| *x -= by * c / square);
            }
        }
        false
    }
}
