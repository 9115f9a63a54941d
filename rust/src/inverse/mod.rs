//! Inverse position: postures that fulfil a task.

mod analytic;
mod coupled;
mod general;
mod newton;
mod postures;

pub use analytic::{ArmAngle, Inverse, MAX_SOLUTIONS, Solutions, Structure};
pub(crate) use coupled::least_squares;
pub use newton::{Reach, reach};
pub(crate) use newton::{error_at, reach_holding, reach_sized};
pub use postures::Postures;
