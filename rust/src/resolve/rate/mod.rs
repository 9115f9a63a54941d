//! Resolution at the level of rates (Huo 2009): twist decomposition and its rivals.

mod methods;
mod secondary;
mod solver;

pub use methods::{Method, Situation};
pub use secondary::{Memory, PosturePull, Scaling, Secondary};
pub use solver::{RateSettings, RateSolver};
