//! `redundancy.Robot`, and frames and limits in and out.

pub mod frames;
mod inverse;
mod model;

pub use model::PyRobot;
