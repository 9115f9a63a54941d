//! Resolution of the redundancy: one control tick of each method, and what all of them do with targets.
//!
//! [`OrthogonalSqp`] (Leger 2014), [`RateSolver`] (Huo 2009) and [`QuadraticSolver`] (Dufour and Suleiman 2020) each have a `step`, joint rates for a
//! twist of the tool, that allocates nothing; as [`Resolver`]s they find postures on targets, the best of many, and follow paths.
//!
//! ```
//! use std::sync::Arc;
//! use redundancy::index::{Index, Kind, Objective, Rows};
//! use redundancy::resolve::{OrthogonalSqp, Resolver, SolveStatus, SqpSettings, StepStatus};
//! use redundancy::robot::{Convention, DhTable, Robot};
//! use redundancy::task::{Target, Task};
//!
//! // A milling robot: the spin of the tool is free.
//! let table = DhTable {
//!     convention: Convention::Standard,
//!     a: vec![0.15, 0.87, 0.17, 0.0, 0.0, -0.288],
//!     d: vec![0.0, 0.0, 0.0, -1.016, 0.0, -0.608],
//!     alpha: [-90f64, 180.0, -90.0, 90.0, -90.0, 180.0].map(f64::to_radians).to_vec(),
//!     theta: [0f64, -90.0, 0.0, 0.0, 0.0, 0.0].map(f64::to_radians).to_vec(),
//! };
//! let robot = Arc::new(Robot::from_dh("mill", table, "RRRRRR")?);
//! let condition = Index::of(Kind::ConditionNumber, Rows::all(0.48)?, true);
//! let objective = Objective::new(vec![(1.0, condition)])?;
//! let solver = OrthogonalSqp::new(robot, Task::axisymmetric([0.0, 0.0, 1.0])?, objective, SqpSettings::default())?;
//!
//! let target = Target { position: [1.05, 1.0, 0.0], axis: Some([1.0, 0.0, 0.0]), frame: [[0.0; 3]; 3] };
//! let start = solver.solve_best(&target, 24, 0).expect("within reach");
//! assert_ne!(start.status, SolveStatus::Unreachable);
//!
//! // A tick of a control loop: the tool moves along y with 0.1 m/s.
//! let mut rates = [0.0; 6];
//! let status = solver.step(&start.q[..6], &[0.0, 0.0, 0.0, 0.0, 0.1, 0.0], &mut rates);
//! assert_eq!(status, StepStatus::Regular);
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod bounds;
mod coupled;
pub(crate) mod direct_update;
mod inside;
mod keep_inside;
mod nearest;
mod quadratic;
mod rate;
mod reach_inside;
mod resolver;
pub(crate) mod sqp;

pub use inside::PathFrame;
pub use quadratic::{
    Beside, Damper, Derivatives, FrameTask, Guard, IndexForm, MAX_NEAR, MAX_OWN_ROWS, Near, Outcome, PostureTask, QuadraticMemory,
    QuadraticSettings, QuadraticSolver, QuadraticStatus, Tick,
};
pub use rate::{Memory, Method, PosturePull, RateSettings, RateSolver, Scaling, Secondary, Situation};
pub use resolver::{ON_TARGET, Resolver, Solution, SolveStatus, StepStatus};
pub use sqp::{ConstraintAt, Iteration, OrthogonalSqp, SqpSettings};
