//! Signed distance of two shapes.

use parry3d_f64::query::epa::EPA;

use super::gjk;
use super::overlap::overlap_of_blocks;
use super::segments::nearest_of_segments;
use super::shape::{Core, Shape};
use super::stick_box::nearest_of_stick_and_box;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, norm, scale, sub};

/// The distance of cores over their size below which they count as touching: the difference of nearest points has lost its direction.
const TOUCHING: f64 = 1e-9;

/// How two shapes lie to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// Signed distance: negative by the depth where they overlap \[m\].
    pub distance: f64,
    /// The points: nearest, or deepest in each other.
    pub points: [Vec3; 2],
    /// Unit vector from the first shape to the second, also where they overlap.
    pub normal: Vec3,
}

/// How two shapes at poses lie to each other.
pub fn separation(first: &Shape, pose1: &Frame, second: &Shape, pose2: &Frame) -> Separation {
    separate(first, &first.core_frame(pose1), second, &second.core_frame(pose2), &mut EPA::new())
}

/// The same by the frames of the cores, with memory to use again.
pub(super) fn separate(first: &Shape, frame1: &Frame, second: &Shape, frame2: &Frame, epa: &mut EPA) -> Separation {
    let (distance, normal, [c1, c2]) = match (&first.core, &second.core) {
        (Core::Block(half1), Core::Block(half2)) => blocks(frame1, *half1, frame2, *half2),
        _ => gjk::hulls(&first.core, frame1, &second.core, frame2, epa),
    };
    Separation {
        distance: distance - first.radius - second.radius,
        points: [add(c1, scale(first.radius, normal)), sub(c2, scale(second.radius, normal))],
        normal,
    }
}

/// Distance, normal and points of two blocks.
fn blocks(frame1: &Frame, half1: Vec3, frame2: &Frame, half2: Vec3) -> (f64, Vec3, [Vec3; 2]) {
    let is_box = |half: Vec3| half[0] > 0.0;
    let points = match (is_box(half1), is_box(half2)) {
        (false, false) => {
            let axis = |frame: &Frame, half: Vec3| scale(half[2], frame.axes[2]);
            Some(nearest_of_segments(frame1.origin, axis(frame1, half1), frame2.origin, axis(frame2, half2)))
        }
        (false, true) => Some(stick_and_box(frame1, half1[2], frame2, half2)),
        (true, false) => {
            let [p2, p1] = stick_and_box(frame2, half2[2], frame1, half1);
            Some([p1, p2])
        }
        (true, true) => gjk::nearest(&Core::Block(half1), frame1, &Core::Block(half2), frame2),
    };
    if let Some([p1, p2]) = points {
        let between = sub(p2, p1);
        let distance = norm(between);
        if distance > TOUCHING * (norm(half1) + norm(half2)) {
            return (distance, scale(1.0 / distance, between), [p1, p2]);
        }
    }
    overlap_of_blocks(frame1, half1, frame2, half2)
}

/// The nearest points of a stick along z of its frame and of a box.
fn stick_and_box(stick: &Frame, half_length: f64, frame: &Frame, half: Vec3) -> [Vec3; 2] {
    let c = frame.unrotate(sub(stick.origin, frame.origin));
    let u = scale(half_length, frame.unrotate(stick.axes[2]));
    nearest_of_stick_and_box(c, u, half).map(|p| add(frame.origin, frame.rotate(p)))
}
