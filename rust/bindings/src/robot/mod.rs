//! `redundancy.Robot`, and frames and limits in and out.

pub mod controller;
pub mod frames;
mod inverse;
mod mimic;
mod model;
mod tables;

pub use model::PyRobot;
