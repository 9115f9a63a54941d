//! `redundancy.Robot`, and frames and limits in and out.

mod coupled;
pub mod frames;
mod inverse;
mod model;
mod tables;

pub use model::PyRobot;
