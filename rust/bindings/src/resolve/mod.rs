//! The solvers: `redundancy.OrthogonalSQP`, the methods at the level of rates, `redundancy.QuadraticProgram`.

pub mod quadratic;
pub mod quadratic_arguments;
pub mod quadratic_beside;
pub mod quadratic_state;
pub mod rate;
pub mod rate_methods;
pub mod secondary;
pub mod solution;
pub mod sqp;
