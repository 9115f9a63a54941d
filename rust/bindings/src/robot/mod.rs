//! `redundancy.Robot`, and frames and limits in and out.

pub mod controller;
mod coupled;
pub mod frames;
mod inverse;
pub mod joint_limits;
mod mimic;
mod model;
pub mod pose;
mod tables;

pub use model::PyRobot;
