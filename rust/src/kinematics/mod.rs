//! Forward kinematics, the Jacobian, its derivatives, and the sweep that pulls an index back from the Jacobian to the joints.

mod derivatives;
mod forward;
mod pullback;

pub use derivatives::{derivative_column, first_derivative, jacobian_rate, second_derivative};
pub use forward::{Jacobian, forward, forward_of, jacobian, jacobian_of, joint_frames, link_frames};
pub use pullback::{pull_back, pull_back_second};
