//! `redundancy.Robot`, and frames and limits in and out.

pub mod frames;
pub mod joint_limits;
mod inverse;
mod model;
mod tables;

pub use model::PyRobot;
