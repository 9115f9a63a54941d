//! Indices of a posture. Each is written once, as a function of the Jacobian or of the joints, and serves alone, in a weighted sum, in
//! every resolution method and in the planner.

mod batch;
mod condition;
mod differences;
mod evaluate;
mod joint_limits;
mod manipulability;
mod objective;
mod planar;
mod rows;
mod spectral;

pub use batch::Answers;
pub use condition::{ConditionNumber, length_of_least_condition};
pub use differences::differences;
pub use evaluate::{Evaluation, Order, Status};
pub use joint_limits::{JointLimits, LimitBarrier};
pub use manipulability::Manipulability;
pub use objective::{CustomIndex, Index, Objective};
pub use planar::PlanarTetrahedron;
pub use rows::Rows;
pub use spectral::{Spectral, SpectralKind};
