//! Distances between a robot and what it must not touch, and how fast joints and obstacles change them.
//!
//! Every shape is a core (a point, a stick, a box or the convex hull of points) with a ball of some radius rolled over it. As long as cores
//! are apart, the distance of two shapes is that of their cores less the radii: smooth across contact, with no penetration to compute.
//! Points and sticks among themselves and against boxes are in closed form, and so is the depth of overlapping points, sticks and boxes;
//! `parry3d-f64` computes the rest (GJK, EPA) and the hulls.
//!
//! The distance d of a pair is signed, the unit normal n leads from the first shape to the second, and `p2 = p1 + d n` always holds. So
//! `d' = n . (v2 - v1)`, with the velocities of the material points at p1 and p2: apart, touching and penetrating alike.

mod along_links;
mod body;
mod damping;
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
pub use damping::Damping;
pub use pairs::{Pair, self_pairs};
pub use scene::{Distances, Found, Proximity, Scene};
pub use separation::{Separation, separation};
pub use shape::Shape;
pub use urdf::{bodies_from_urdf_file, bodies_from_urdf_str};
