//! Closed ranges of angles, compared on the circle.

use std::f64::consts::{PI, TAU};

use crate::error::{Error, Result};

/// A gap in a range below this \[rad\] is none: what rounding leaves of a whole turn.
const GAP: f64 = 1e-12;

/// A closed range of angles \[rad\]; as wide as a turn, it leaves the angle free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Its lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Range {
    /// Any angle.
    pub const FREE: Self = Self { low: -PI, high: PI };

    /// From ends in order.
    pub fn new(name: &str, low: f64, high: f64) -> Result<Self> {
        if low <= high && (high - low).is_finite() {
            Ok(Self { low, high })
        } else {
            Err(Error::value(name, format!("({low}, {high})"), "two finite angles [rad], the lower first"))
        }
    }

    /// Angles of this size at most.
    pub(super) const fn within(reach: f64) -> Self {
        Self { low: -reach, high: reach }
    }

    /// Whether it is a whole turn.
    pub fn is_free(&self) -> bool {
        self.high - self.low >= TAU - GAP
    }

    /// Whether it is one angle.
    pub fn is_fixed(&self) -> bool {
        self.high == self.low
    }

    /// Half way between its ends.
    pub fn middle(&self) -> f64 {
        0.5 * self.low + 0.5 * self.high
    }

    /// Half its width, half a turn at most.
    pub fn half(&self) -> f64 {
        (0.5 * self.high - 0.5 * self.low).min(PI)
    }

    /// The part of a whole turn that it is.
    pub fn share(&self) -> f64 {
        self.half() / PI
    }

    /// How far an angle is from the middle, in (-pi, pi].
    pub(super) fn offset(&self, angle: f64) -> f64 {
        wrap(angle - self.middle())
    }

    /// Whether an angle is in it, but for whole turns.
    pub(super) fn contains(&self, angle: f64) -> bool {
        self.is_free() || self.offset(angle).abs() <= self.half()
    }

    /// The angle of the range that is nearest on the circle.
    pub(super) fn clamp(&self, angle: f64) -> f64 {
        match self.contains(angle) {
            true => angle,
            false if self.offset(angle) > 0.0 => self.high,
            false => self.low,
        }
    }

    /// Its ends, if it has any.
    pub(super) fn ends(&self) -> impl Iterator<Item = f64> + use<> {
        let count = if self.is_free() { 0 } else { 2 };
        [self.low, self.high].into_iter().take(count)
    }

    /// Evenly spaced angles from end to end, or once around from the lower end.
    pub(super) fn spaced(&self, count: usize) -> impl Iterator<Item = f64> + Clone + use<> {
        let (low, width, free) = (self.low, self.high - self.low, self.is_free());
        let count = if self.is_fixed() { 1 } else { count.max(1) };
        (0..count).map(move |i| match (free, count) {
            (_, 1) => low + 0.5 * width,
            (true, _) => low + TAU * i as f64 / count as f64,
            (false, _) => low + width * i as f64 / (count - 1) as f64,
        })
    }
}

/// An angle but for whole turns, in (-pi, pi].
pub(super) fn wrap(angle: f64) -> f64 {
    if angle.abs() <= PI {
        return if angle == -PI { PI } else { angle };
    }
    let turned = angle - TAU * (angle / TAU).round();
    if turned <= -PI { turned + TAU } else { turned }
}
