//! Inverse position: postures that fulfil a task.

mod analytic;
mod general;
mod newton;
mod random;

pub use analytic::{ArmAngle, Inverse, MAX_SOLUTIONS, Solutions, Structure};
pub use newton::{Reach, damped_step, reach};
pub use random::Postures;
