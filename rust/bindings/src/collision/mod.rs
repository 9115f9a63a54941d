//! `redundancy.Scene`, `Body`, `Shape`.

pub mod scene;
pub mod shape;
