//! Inverse position: postures that fulfil a task.

mod analytic;
mod any;
mod coupled;
pub mod descent;
mod general;
mod nearby;
mod newton;
mod pose;
mod postures;
mod request;
mod search;
mod singularity;
mod sweep;

pub use analytic::{ArmAngle, Branch, Inverse, MAX_SOLUTIONS, Solutions, Structure, branch};
pub use any::TaskInverse;
pub(crate) use coupled::least_squares;
pub use newton::{Reach, reach};
pub(crate) use newton::{error_at, reach_holding, reach_sized};
pub use pose::{Aim, Method, Outcome, Pose, PoseSolver, Settings};
pub use postures::Postures;
pub use request::{Batch, Request, Wanted};
pub use singularity::{Singularity, singularity};
