//! Postures and lengths chosen for their own sake.

pub mod posture;
