//! Postures and lengths chosen for their own sake: of minimum condition number, with the characteristic length, and the tetrahedron that
//! shows both for planar robots.
//!
//! ```
//! use redundancy::design::{Length, Method, minimum_condition, rms_length};
//! use redundancy::index::Rows;
//! use redundancy::optimize::Stop;
//! use redundancy::robot::{Convention, DhTable, Robot};
//!
//! // A planar robot that has an isotropic posture: the arms from its joints to the tool point make a star of three equal rays.
//! let table = DhTable {
//!     convention: Convention::Standard,
//!     a: vec![3f64.sqrt(), 3f64.sqrt(), 1.0],
//!     d: vec![0.0; 3],
//!     alpha: vec![0.0; 3],
//!     theta: vec![0.0; 3],
//! };
//! let robot = Robot::from_dh("planar", table, "RRR")?;
//! let stop = Stop { step: 1e-10, iterations: 100 };
//! let found = minimum_condition(&robot, &[0.1, 1.0, 2.0], Rows::new(&[2, 3, 4], 1.0)?, Length::Eliminated, Method::Newton, stop)?;
//! assert!((found.condition_number - 1.0).abs() < 1e-9);
//! assert!((found.length - rms_length(&robot, &found.q)? / 2f64.sqrt()).abs() < 1e-9);
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod posture;
mod tetrahedron;

pub use posture::{Length, Method, MinimumCondition, characteristic_length, minimum_condition, rms_length};
pub use tetrahedron::PlanarTetrahedron;
