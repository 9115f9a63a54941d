//! The best way through a whole path: a map of all postures, the best route through it, and its continuous refinement.

mod bound;
mod closed;
mod constraints;
mod graph;
mod lattice;
mod newton_system;
mod problem;
mod refine;
mod route;
mod turns;

pub use bound::least_value;
pub use constraints::{Constraint, Kind};
pub use graph::{Blockage, Criterion, Graph, Route, Search};
pub use lattice::{Cause, LIMIT_MARGIN, Lattice, wide_joints};
pub use problem::{PathProblem, SpinRange, onto_path};
pub use refine::{RefineStatus, Refined, refine};
pub use route::{FoundRoute, find_route};
pub use turns::{unwind, within_limits};
