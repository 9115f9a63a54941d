//! The solvers: rates, programmes, postures on targets.

mod coupled;
mod quadratic;
mod rate;
mod solve;
mod steps;
