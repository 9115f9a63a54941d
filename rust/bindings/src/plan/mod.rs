//! Maps and plans of whole paths.

pub mod map;
pub mod refine;
