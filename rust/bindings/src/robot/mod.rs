//! `redundancy.Robot`, and frames and limits in and out.

pub mod controller;
mod coupled;
pub mod frames;
mod inverse;
pub mod joint_limits;
mod mimic;
mod model;
mod tables;

pub use model::PyRobot;
