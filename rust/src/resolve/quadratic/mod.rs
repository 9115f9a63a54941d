//! One control tick as a quadratic programme (Dufour and Suleiman 2020, eq. 3 to 16): the rates that follow a twist as far as bounds, rows and the
//! worth of an index allow.
//!
//! The deviation from the twist is not a variable here: `delta = t - J qd` is put into the objective, so that a programme has as many variables
//! as the robot has joints, and is strictly convex at singularities too.

mod beside;
mod damper;
mod general;
mod guarded;
mod index_term;
mod jerk;
mod path;
mod programme;
mod rest;
mod settings;
mod solver;

pub use beside::{Beside, FrameTask, PostureTask};
pub use damper::Damper;
pub use guarded::{Guard, MAX_NEAR, Near};
pub use index_term::{Derivatives, IndexForm};
pub use settings::{Outcome, QuadraticMemory, QuadraticSettings, QuadraticStatus, Tick};
use solver::MAX_ROWS;
pub use solver::{MAX_OWN_ROWS, QuadraticSolver};
