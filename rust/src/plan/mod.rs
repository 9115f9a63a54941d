//! The best way through a whole path: a map of all postures, the best route through it, and its continuous refinement.
//!
//! [`Planner`] is the door: robot, path, task, objective and settings in, [`Plan`] out.

mod bound;
mod closed;
mod constraints;
mod failure;
mod frames;
mod graph;
mod greedy;
mod grid;
mod hooks;
mod lattice;
mod layers;
mod newton_system;
mod numbers;
mod part;
mod path;
mod planner;
mod points;
mod problem;
mod proof;
mod refine;
mod route;
mod settings;
mod strategy;
mod turns;
mod verdict;

pub use failure::{FailedJoint, FailureCause, PlanFailure};
pub use frames::{across, spin, spin_along, spin_frames, tools, transport};
pub use graph::{Blockage, Criterion, Graph, Route, Search};
pub use grid::{SpareGrid, angle_grid};
pub use hooks::{Hooks, PlanError, Predicate, PredicateError};
pub use lattice::{Cause, LIMIT_MARGIN, Lattice};
pub use part::WarmStart;
pub use path::{Path, point_weights};
pub use planner::Planner;
pub use problem::ON_PATH;
pub use route::{FoundRoute, find_route};
pub use settings::{Aim, PlanSettings};
pub use turns::{unwind, within_limits};
pub use verdict::Plan;
