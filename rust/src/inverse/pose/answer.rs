//! What is asked of a search for a pose, and what it answers.

use crate::error::{Error, Result};
use crate::linalg::MAX_JOINTS;

/// A way to a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The closed form where there is one, else as [`Method::Newton`].
    Auto,
    /// All postures, and the nearest of them.
    Closed,
    /// Damped Newton from one start after the other.
    Newton,
    /// Sweeps of coordinate descent from the first start alone: slow near the target, and seldom the way to go ([`super::descent`]).
    Descent,
    /// A few sweeps from each start, then Newton.
    Hybrid,
}

/// How far a search goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The way.
    pub method: Method,
    /// Position error that counts as reached \[m\].
    pub position: f64,
    /// Orientation error that counts as reached \[rad\].
    pub orientation: f64,
    /// Steps from one start.
    pub iterations: usize,
    /// Starts beside the first one.
    pub restarts: usize,
    /// Of the random starts.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { method: Method::Auto, position: 1e-4, orientation: 1e-3, iterations: 40, restarts: 300, seed: 0 }
    }
}

impl Settings {
    /// Checks that tolerances are not negative and there are steps to take.
    pub fn check(&self) -> Result<()> {
        for (name, x) in [("position_tolerance", self.position), ("orientation_tolerance", self.orientation)] {
            if x.is_nan() || x <= 0.0 {
                return Err(Error::value(name, x, "a tolerance above 0"));
            }
        }
        if self.iterations == 0 {
            return Err(Error::value("iterations", 0, "at least 1"));
        }
        Ok(())
    }
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The pose is reached.
    Converged,
    /// No posture of the robot reaches it: it is farther away than the robot is long, or all its postures are known.
    Unreachable,
    /// None was found; the cost is least among the postures around.
    Stationary,
    /// None was found in the steps there were.
    OutOfIterations,
}

impl Outcome {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Unreachable => "unreachable",
            Self::Stationary => "stationary",
            Self::OutOfIterations => "out of iterations",
        }
    }
}

/// Where a search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The posture: one coordinate a joint, then zeros.
    pub q: [f64; MAX_JOINTS],
    /// How the search ended.
    pub outcome: Outcome,
    /// \[m\]
    pub position_error: f64,
    /// \[rad\]
    pub orientation_error: f64,
    /// Of all starts.
    pub iterations: usize,
    /// Starts beside the first one.
    pub restarts: usize,
    /// `|dp|^2 + L^2 4 sin^2(angle / 2)` \[m^2\].
    pub cost: f64,
}
