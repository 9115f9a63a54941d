//! Distances between a robot and what it must not touch, and how fast joints and obstacles change them.
//!
//! Every shape is a core (a point, a stick, a box or the convex hull of points) with a ball of some radius rolled over it. As long as cores
//! are apart, the distance of two shapes is that of their cores less the radii: smooth across contact, with no penetration to compute.
//! Points and sticks among themselves and against boxes are in closed form, and so is the depth of overlapping points, sticks and boxes;
//! `parry3d-f64` computes the rest (GJK, EPA) and the hulls.
//!
//! The distance d of a pair is signed, the unit normal n leads from the first shape to the second, and `p2 = p1 + d n` always holds. So
//! `d' = n . (v2 - v1)`, with the velocities of the material points at p1 and p2: apart, touching and penetrating alike.
//!
//! ```
//! use std::sync::Arc;
//! use redundancy::collision::{Obstacle, Proximity, Scene, Shape, capsules_along_links};
//! use redundancy::linalg::frame::Frame;
//! use redundancy::robot::{Convention, DhTable, Robot};
//!
//! let table = DhTable { convention: Convention::Standard, a: vec![0.5, 0.4], d: vec![0.0; 2], alpha: vec![0.0; 2], theta: vec![0.0; 2] };
//! let robot = Arc::new(Robot::from_dh("planar", table, "RR")?);
//! // Capsules of 5 cm along the links, and a ball 20 cm beyond the stretched arm.
//! let bodies = capsules_along_links(&robot, 0.05)?;
//! let ball = Obstacle::new("ball", Shape::sphere(0.1)?, Frame::translation([1.2, 0.0, 0.0]))?;
//! let mut scene = Scene::new(robot, bodies, vec![ball], vec![])?;
//! let mut near = [Proximity::NONE; 4];
//! let found = scene.near(&[0.0, 0.0], 0.5, &mut near)?;
//! assert_eq!(found.written, 1);
//! assert!((near[0].distance - (1.2 - 0.9 - 0.05 - 0.1)).abs() < 1e-12);
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod along_links;
mod body;
mod gjk;
mod hull;
mod mesh_file;
mod overlap;
mod pairs;
mod scene;
mod segments;
mod separation;
mod shape;
mod stick_box;
mod urdf;

pub use along_links::capsules_along_links;
pub use body::{Body, Mount, Obstacle};
pub use pairs::{Pair, self_pairs};
pub use scene::{Distances, Found, Proximity, Scene};
pub use separation::{Separation, separation};
pub use shape::Shape;
pub use urdf::{bodies_from_urdf_file, bodies_from_urdf_str};
