//! The velocity damper: how fast a distance may fall (Faverjon and Tournassoud, 1987; Dufour and Suleiman 2020, A.1).

use crate::collision::Proximity;
use crate::error::{Error, Result, check_finite, check_positive};

/// The law `d' >= -gain (d - security) / (influence - security)` for pairs nearer than the influence distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damper {
    influence: f64,
    security: f64,
    gain: f64,
}

impl Damper {
    /// Influence and security distance [m], the first the larger, and the speed at which a distance may fall at the influence distance [m/s].
    pub fn new(influence: f64, security: f64, gain: f64) -> Result<Self> {
        check_finite("influence", &[influence])?;
        check_finite("security", &[security])?;
        if influence <= security {
            return Err(Error::value("influence", influence, &format!("a distance above security = {security}")));
        }
        Ok(Self { influence, security, gain: check_positive("damping", gain)? })
    }

    /// The influence distance [m].
    pub fn influence(&self) -> f64 {
        self.influence
    }

    /// The security distance [m].
    pub fn security(&self) -> f64 {
        self.security
    }

    /// The bound b of the row `row' qd >= b`.
    ///
    /// Dufour and Suleiman write `-n' J qd <= gain (d - d_s) / (d_i - d_s)`: with n from p1 on the robot to p2 on the obstacle that would
    /// bound the speed of going away. It bounds the approach for n from p2 to p1, that is `row = -n' J` with the n of [`Proximity`]. An
    /// obstacle's own approach counts as well (drift). Below the security distance the law asks for a retreat, which is no faster than the
    /// gain however deep the pair is: a depth is worth little as a measure, and the bounds of the joints must be able to meet the demand.
    pub fn bound(&self, found: &Proximity) -> f64 {
        let share = (found.distance - self.security) / (self.influence - self.security);
        -self.gain * share.max(-1.0) - found.drift
    }
}
