//! Limits of the joints. A joint without a limit has an infinite one.

use std::f64::consts::TAU;

use crate::error::{Error, Result};

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
}

impl Limits {
    /// No limit on any of `n` joints.
    pub fn none(n: usize) -> Self {
        Self {
            q_min: vec![f64::NEG_INFINITY; n],
            q_max: vec![f64::INFINITY; n],
            qd_max: vec![f64::INFINITY; n],
            qdd_max: vec![f64::INFINITY; n],
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
        Ok(())
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

    /// An angle of joint `i` by whole turns nearest to the middle of its range: to 0 without limits, to the limit with one that it is beyond.
    #[inline(always)]
    pub fn turned(&self, i: usize, angle: f64) -> f64 {
        let middle = self.middle_and_half(i).map_or(0.0, |(middle, _)| middle);
        let near = nearest_turn(angle, middle);
        match (self.q_min[i].is_finite(), self.q_max[i].is_finite()) {
            (true, false) if near < self.q_min[i] => near + TAU * ((self.q_min[i] - near) / TAU).ceil(),
            (false, true) if near > self.q_max[i] => near - TAU * ((near - self.q_max[i]) / TAU).ceil(),
            _ => near,
        }
    }

    /// Whether `q` is within the position limits; NaN is not.
    pub fn contain(&self, q: &[f64]) -> bool {
        (0..q.len()).all(|i| q[i] >= self.q_min[i] && q[i] <= self.q_max[i])
    }

    /// The smallest distance of `q` to a limit, negative outside [rad or m]; infinite without limits.
    pub fn margin(&self, q: &[f64]) -> f64 {
        (0..q.len()).map(|i| (q[i] - self.q_min[i]).min(self.q_max[i] - q[i])).fold(f64::INFINITY, f64::min)
    }
}
