//! Capsules where nothing is known of a robot but its joints.

use super::body::{Body, Mount};
use super::shape::Shape;
use crate::error::{Result, check_positive};
use crate::linalg::frame::Frame;
use crate::linalg::vector::norm;
use crate::robot::Robot;

/// The distance over the radius below which two origins coincide, and no capsule is needed between them.
const COINCIDENT: f64 = 1e-6;

/// A capsule of the given radius \[m\] from the origin of every joint frame to that of the next, the last to the tool point, the first from the
/// base. Joint frames follow the robot's convention: with DH tables their origins may lie off the links, and a stretched prismatic
/// joint leaves a gap.
pub fn capsules_along_links(robot: &Robot, radius: f64) -> Result<Vec<Body>> {
    check_positive("radius", radius)?;
    let mut bodies = Vec::new();
    let n = robot.links().len();
    for k in 0..=n {
        let end = match k {
            0 => robot.bare_links()[0].origin,
            _ if k < n => robot.links()[k].origin,
            _ => robot.end().origin,
        };
        if norm(end) <= COINCIDENT * radius {
            continue;
        }
        let (shape, pose): (Shape, Frame) = Shape::capsule_between([0.0; 3], end, radius)?;
        let (name, mount) = if k == 0 { ("base".into(), Mount::Base) } else { (format!("link {}", k - 1), Mount::Link(k - 1)) };
        bodies.push(Body { name, mount, pose, shape });
    }
    Ok(bodies)
}
