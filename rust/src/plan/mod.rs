//! The best way through a whole path: a map of all postures, the best route through it, and its continuous refinement.
//!
//! [`Planner`] is the door: robot, path, task, objective and settings in, [`Plan`] out.
//!
//! ```
//! use std::{f64::consts::{FRAC_PI_2, PI}, sync::Arc};
//! use redundancy::plan::{Aim, Hooks, Path, PlanSettings, Planner};
//! use redundancy::robot::{Convention, DhTable, Robot};
//! use redundancy::task::Task;
//!
//! let table = DhTable {
//!     convention: Convention::Standard,
//!     a: vec![0.0, 0.43, -0.02, 0.0, 0.0, 0.0],
//!     d: vec![0.0, 0.15, 0.0, 0.43, 0.0, 0.1],
//!     alpha: vec![-FRAC_PI_2, 0.0, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2, 0.0],
//!     theta: vec![0.0; 6],
//! };
//! let robot = Arc::new(Robot::from_dh("puma", table, "RRRRRR")?);
//! let path = Path::helix(0.1, 0.02, (0.0, FRAC_PI_2), PI, [0.4, 0.1, 0.1], 11)?;
//! let settings = PlanSettings { criterion: Aim::Motion, n_angles: 24, ..PlanSettings::default() };
//! let plan = Planner::new(robot, path, Task::axisymmetric([0.0, 0.0, 1.0])?, None, settings)?.plan(&mut Hooks::default())?;
//! assert!(plan.failure.is_none() && plan.refined);
//! assert_eq!(plan.q.len(), 11 * 6);
//! # Ok::<(), redundancy::plan::PlanError>(())
//! ```

mod bound;
mod closed;
mod constraints;
mod continued;
mod corridor;
mod derived;
mod diagnosis;
mod edges;
mod failure;
mod floors;
mod frames;
mod graph;
mod greedy;
mod grid;
mod hooks;
mod inside;
mod joint_weights;
mod lattice;
mod layers;
mod leaps;
mod led;
mod members;
mod newton_system;
mod notes;
mod numbers;
mod part;
mod path;
mod pins;
mod planner;
mod points;
mod points_of_search;
mod postures;
mod problem;
mod proof;
mod reach;
mod reconfigure;
mod refine;
mod rivals;
mod route;
mod settings;
mod singular;
mod spare;
mod strategy;
mod through;
mod transfer;
mod turns;
mod verdict;
mod ways;

pub use edges::EdgeCosts;
pub use failure::{FailedJoint, FailureCause, PlanFailure};
pub use frames::{across, spin, spin_along, spin_frames, tilt_heading_twist, tools, transport, volume_frames};
pub use graph::{Blockage, Criterion, Graph, Route, Search};
pub use grid::{SpareGrid, angle_grid};
pub use hooks::{EdgeCost, Hooks, PlanError, Predicate, PredicateError, Progress};
pub use joint_weights::JointWeights;
pub use lattice::{Cause, Lattice};
pub use members::Members;
pub use part::WarmStart;
pub use path::{Path, point_weights};
pub use pins::{Held, Pin, Pins};
pub use planner::Planner;
pub use problem::ON_PATH;
pub use rivals::Way;
pub use route::{FoundRoute, find_route};
pub use settings::{Aim, PlanSettings};
pub use transfer::Transfer;
pub use turns::{unwind, within_limits};
pub use verdict::Plan;
