//! How deep two blocks (points, sticks, boxes) are in each other, exactly.
//!
//! The differences of their points form a zonotope: its faces are spanned by pairs of its generators, the half axes of both blocks. The
//! depth is the least distance of the origin to one of at most 15 pairs of faces; nothing iterates and nothing can fail to converge.

use super::segments::nearest_of_segments;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, perpendicular, scale, sub, unit};

/// The sine below which two generators count as parallel, and the cosine below which one counts as lying in a face.
const PARALLEL: f64 = 1e-9;

/// A block: its middle and half axes, zero where it has no extent.
struct Block {
    centre: Vec3,
    axes: [Vec3; 3],
}

impl Block {
    fn new(frame: &Frame, half: Vec3) -> Self {
        Self { centre: frame.origin, axes: std::array::from_fn(|i| scale(half[i], frame.axes[i])) }
    }

    /// Half its extent along a unit vector.
    fn extent(&self, n: Vec3) -> f64 {
        self.axes.iter().map(|axis| dot(*axis, n).abs()).sum()
    }

    /// The middle of the vertex, edge or face farthest along a unit vector.
    fn farthest(&self, n: Vec3) -> Vec3 {
        self.axes.iter().fold(self.centre, |point, axis| {
            let along = dot(*axis, n);
            if along.abs() <= PARALLEL * norm(*axis) { point } else { add(point, scale(1.0f64.copysign(along), *axis)) }
        })
    }

    /// The point of the block nearest to `p`.
    fn nearest(&self, p: Vec3) -> Vec3 {
        let from = sub(p, self.centre);
        self.axes.iter().fold(self.centre, |point, axis| {
            let square = dot(*axis, *axis);
            if square > 0.0 { add(point, scale((dot(from, *axis) / square).clamp(-1.0, 1.0), *axis)) } else { point }
        })
    }
}

/// Which blocks the generators of a face belong to.
#[derive(Clone, Copy)]
enum Face {
    First,
    Second,
    Edges(usize, usize),
}

/// Signed distance (negative: the depth), the unit normal from the first block to the second, and the two points of deepest overlap.
pub(super) fn overlap_of_blocks(frame1: &Frame, half1: Vec3, frame2: &Frame, half2: Vec3) -> (f64, Vec3, [Vec3; 2]) {
    let (first, second) = (Block::new(frame1, half1), Block::new(frame2, half2));
    let between = sub(second.centre, first.centre);
    let mut best: Option<(f64, Vec3, Face)> = None;
    let mut consider = |u: Vec3, v: Vec3, face: Face| {
        let normal = cross(u, v);
        let length = norm(normal);
        if length <= PARALLEL * norm(u) * norm(v) {
            return;
        }
        let along = dot(between, normal);
        let n = scale(1.0f64.copysign(along) / length, normal);
        let distance = along.abs() / length - first.extent(n) - second.extent(n);
        if best.is_none_or(|(most, ..)| distance > most) {
            best = Some((distance, n, face));
        }
    };
    // Faces ahead of pairs of edges: the first of equals stays, and its points do not depend on where edges cross.
    for i in 0..3 {
        consider(first.axes[i], first.axes[(i + 1) % 3], Face::First);
        consider(second.axes[i], second.axes[(i + 1) % 3], Face::Second);
    }
    for i in 0..3 {
        for j in 0..3 {
            consider(first.axes[i], second.axes[j], Face::Edges(i, j));
        }
    }
    let (distance, n, face) = best.unwrap_or_else(|| {
        // Points, or sticks in one line: any direction across will do, since their depth is zero.
        let n = [first.axes[2], second.axes[2]].into_iter().find_map(unit).map_or([0.0, 0.0, 1.0], |axis| perpendicular(axis).0);
        (dot(between, n), n, Face::First)
    });
    let points = match face {
        Face::First => {
            let p = second.farthest(scale(-1.0, n));
            [first.nearest(sub(p, scale(distance, n))), p]
        }
        Face::Second => {
            let p = first.farthest(n);
            [p, second.nearest(add(p, scale(distance, n)))]
        }
        Face::Edges(i, j) => nearest_of_segments(first.farthest(n), first.axes[i], second.farthest(scale(-1.0, n)), second.axes[j]),
    };
    (distance, n, points)
}
