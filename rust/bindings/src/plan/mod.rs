//! Maps and plans of whole paths.

pub mod failure;
pub mod frames;
pub mod map;
pub mod path;
pub mod planner;
pub mod predicate;
pub mod settings;
