//! Distances and their rates.

mod geometry;
mod rates;
mod scene;
mod separation;
pub mod shapes;
