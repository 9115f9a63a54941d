//! The solvers: rates, programmes, postures on targets.

mod quadratic;
mod rate;
mod solve;
mod steps;
