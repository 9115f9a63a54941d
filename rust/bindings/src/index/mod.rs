//! Indices and their weighted sums.

mod custom;
pub mod kinds;
pub mod objective;
