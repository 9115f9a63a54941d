//! The condition number of a planar 3R robot as a tetrahedron (Leger 2014, eq. 2.15 to 2.21).

use crate::error::{Error, Result, check_positive};
use crate::kinematics::jacobian;
use crate::linalg::vector::{Vec3, cross, dot, norm};
use crate::robot::Robot;

/// How far an axis may lean from the base z axis, as what its z component misses 1 by.
const UPRIGHT: f64 = 1e-12;

/// The tetrahedron whose edges from one vertex are the columns `[L; r_i]` of the rotated normalised Jacobian, `r_i` from joint i to the
/// operation point: its base is the robot, its height the length L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarTetrahedron {
    /// Edges p_i \[m\].
    pub edges: [Vec3; 3],
    /// Volume of the tetrahedron [m^3].
    pub volume: f64,
    /// Area of the triangular face opposite to edge i [m^2].
    pub faces: [f64; 3],
    /// Distance from the tip of edge i to the opposite face \[m\].
    pub distances: [f64; 3],
    /// Height: the length L \[m\].
    pub height: f64,
    /// kappa_F by (2.16): `sqrt(sum p^2 sum S^2) / (9 V)`; infinite when the volume is zero.
    pub condition_number: f64,
}

impl PlanarTetrahedron {
    /// Of a robot of three revolute joints about the base z axis, at a posture.
    pub fn of(robot: &Robot, q: &[f64], length: f64) -> Result<Self> {
        let (_, columns) = jacobian(robot, q)?;
        if robot.n() != 3 || (0..3).any(|i| (columns.w[i][2].abs() - 1.0).abs() >= UPRIGHT) {
            return Err(Error::value("robot", robot.name(), "three revolute joints about the base z axis"));
        }
        // v = e x r turned back by a right angle gives r.
        let arms = std::array::from_fn(|i| [columns.v[i][1] * columns.w[i][2], -columns.v[i][0] * columns.w[i][2]]);
        Self::new(arms, length)
    }

    /// From the vectors from each joint to the operation point, in the plane, and the length.
    pub fn new(arms: [[f64; 2]; 3], length: f64) -> Result<Self> {
        check_positive("length", length)?;
        let edges = arms.map(|r| [length, r[0], r[1]]);
        let opposite = [cross(edges[1], edges[2]), cross(edges[2], edges[0]), cross(edges[0], edges[1])];
        let volume = dot(edges[0], opposite[0]).abs() / 6.0;
        let faces = opposite.map(|s| 0.5 * norm(s));
        let distances = faces.map(|s| if s > 0.0 { 3.0 * volume / s } else { 0.0 });
        let squares = |values: [f64; 3]| values.iter().map(|x| x * x).sum::<f64>();
        let product = squares(edges.map(norm)) * squares(faces);
        let condition_number = if volume > 0.0 { product.sqrt() / (9.0 * volume) } else { f64::INFINITY };
        Ok(Self { edges, volume, faces, distances, height: length, condition_number })
    }
}
