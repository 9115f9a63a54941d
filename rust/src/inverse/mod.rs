//! Inverse position: postures that fulfil a task.

mod newton;
mod random;

pub use newton::{Reach, damped_step, reach};
pub use random::Postures;
