//! `redundancy.Robot`, and frames and limits in and out.

pub mod frames;
mod model;

pub use model::PyRobot;
