//! Redundancy resolution of serial robots: exact derivatives of condition number and manipulability, functional redundancy of
//! axisymmetric tools, whole toolpaths.
//!
//! Rooms, lowest first: [`linalg`], [`robot`], [`kinematics`], [`index`] and [`task`], [`optimize`], [`posture`], [`inverse`], [`resolve`], [`plan`].
//! SI units and radians everywhere; twists are `[omega; v]`, angular part first, at the tool point, in the base frame.

pub mod collision;
pub mod error;
pub mod index;
pub mod inverse;
pub mod kinematics;
pub mod linalg;
pub mod optimize;
pub mod plan;
pub mod posture;
pub mod resolve;
pub mod robot;
pub mod task;
