//! The cost as a function of the change of one joint.

use super::cosine::Cosine;
use super::half_angle::HalfAngle;

/// The cost less its present value, of the change x of one joint.
#[derive(Debug, Clone, Copy)]
pub(super) enum Form {
    /// Of a joint that turns.
    Turn(Cosine),
    /// The same with the quaternion metric.
    Half(HalfAngle),
    /// Of a joint that slides: `slope x + bend x^2 / 2`.
    Slide { slope: f64, bend: f64 },
}

impl Form {
    /// The derivative at the present value.
    #[inline]
    pub fn slope(&self) -> f64 {
        match self {
            Self::Turn(cosine) => cosine.b,
            Self::Half(half) => half.slope(),
            Self::Slide { slope, .. } => *slope,
        }
    }

    /// The decrease of the cost by a change.
    #[inline]
    pub fn decrease(&self, x: f64) -> f64 {
        match self {
            Self::Turn(cosine) => cosine.decrease(x),
            Self::Half(half) => half.decrease(x),
            Self::Slide { slope, bend } => -x * (slope + 0.5 * bend * x),
        }
    }

    /// The best change within a range; of several the nearest to zero, none where the cost is flat.
    #[inline]
    pub fn best(&self, low: f64, high: f64) -> f64 {
        match self {
            Self::Turn(cosine) => cosine.best(low, high),
            Self::Half(half) => half.best(low, high),
            Self::Slide { slope, bend } if *bend > 0.0 => (-slope / bend).max(low).min(high),
            Self::Slide { .. } => {
                // No minimum within: an end.
                let stay = 0f64.max(low).min(high);
                let ends = [low, high].into_iter().filter(|x| x.is_finite());
                ends.fold(stay, |best, x| if self.decrease(x) > self.decrease(best) { x } else { best })
            }
        }
    }

    /// The best change that is downhill all the way, so that any part of it lowers the cost. [`Form::best`] may lie behind a maximum where a range is narrow.
    #[inline]
    pub fn downhill(&self, low: f64, high: f64) -> f64 {
        match self {
            Self::Turn(cosine) => cosine.downhill(low, high),
            Self::Half(half) => half.downhill(low, high),
            Self::Slide { slope, bend } if *bend <= 0.0 => {
                let end = if *slope > 0.0 { low } else { high };
                if *slope != 0.0 && end.is_finite() { end } else { 0.0 }
            }
            Self::Slide { .. } => self.best(low, high),
        }
    }

    /// Whether a joint that slides has no best change: nothing bounds the cost from below.
    pub fn is_unbounded(&self, low: f64, high: f64) -> bool {
        match self {
            Self::Slide { slope, bend } => {
                let falls = |x: f64| !x.is_finite() && (*bend < 0.0 || (*bend == 0.0 && slope * x < 0.0));
                falls(low) || falls(high)
            }
            _ => false,
        }
    }
}
