//! Resolution of the redundancy: one step of each method, and the loops around it.

mod newton_step;
mod orthogonal_sqp;
mod solve;

pub use newton_step::{Bounds, Known, NewtonStep, StepStatus, newton_step};
pub use orthogonal_sqp::{OrthogonalSqp, Settings};
pub use solve::{PathPoint, Solution, SolveStatus};
