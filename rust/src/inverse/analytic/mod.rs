//! Every inverse solution of six revolute joints, in closed form where the geometry has one.
//!
//! The chain is closed into a loop, `Z(q1) L1 Z(q2) L2 ... Z(q6) L6 = 1`: the target is one more fixed transform, between the last joint and
//! the first, and the loop may be entered at any joint. So a spherical wrist is the same problem whether it stands at the hand, at the
//! shoulder or between, and so are three parallel axes.

mod arm_angle;
mod branches;
mod calibrated;
pub(super) mod circle;
mod parallel;
mod regional;
mod solutions;
mod solver;
pub(super) mod structure;
pub(super) mod wrist;

pub use arm_angle::ArmAngle;
pub(super) use branches::Factors;
pub use branches::{Branch, branch};
pub use solutions::{MAX_SOLUTIONS, Solutions};
pub use solver::Inverse;
pub use structure::Structure;
