//! Resolution of the redundancy: one step of each method, and the loops around it.

mod newton_step;
mod orthogonal_sqp;
mod quadratic;
mod rate;
mod rate_solver;
mod secondary;
mod solve;

pub use newton_step::{Bounds, Known, NewtonStep, StepStatus, newton_step};
pub use orthogonal_sqp::{OrthogonalSqp, Settings};
pub use quadratic::{
    Derivatives, Form, Guard, MAX_NEAR, MAX_OWN_ROWS, Outcome, QuadraticMemory, QuadraticSettings, QuadraticSolver, QuadraticStatus, Tick,
};
pub use rate::{Method, Situation};
pub use rate_solver::{RateSettings, RateSolver, RateStatus};
pub use secondary::{Memory, PosturePull, Scaling, Secondary};
pub use solve::{PathPoint, Solution, SolveStatus};
