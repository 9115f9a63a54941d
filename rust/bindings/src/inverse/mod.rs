//! Ways to a pose.

pub mod descent;
pub mod one_joint;
pub mod terms;
