//! Redundancy resolution of serial robots: exact derivatives of condition number and manipulability, functional redundancy of
//! axisymmetric tools, whole toolpaths.
//!
//! Rooms, lowest first: [`linalg`], [`robot`], [`kinematics`], [`index`] and [`task`], [`qp`] and [`optimize`], [`inverse`], [`collision`],
//! [`resolve`], [`plan`] and [`design`].
//! SI units and radians everywhere; twists are `[omega; v]`, angular part first, at the tool point, in the base frame.

pub mod collision;
pub mod design;
pub mod error;
pub mod index;
#[cfg(feature = "internals")]
pub mod internals;
pub mod inverse;
pub mod kinematics;
pub mod linalg;
pub mod optimize;
pub mod plan;
pub mod qp;
pub mod resolve;
pub mod robot;
pub mod task;
