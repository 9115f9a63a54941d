//! Nearest points of two segments, in closed form (Ericson, Real-Time Collision Detection, 2005, 5.1.9).

use crate::linalg::vector::{Vec3, add, cross, dot, scale, sub};

/// The squared sine below which two segments count as parallel.
const PARALLEL: f64 = 1e-20;

/// Where the point `c + t u`, t in [-1, 1], is nearest to `p`; 0 where u is zero.
#[inline]
pub(super) fn nearest_on_segment(c: Vec3, u: Vec3, p: Vec3) -> f64 {
    let square = dot(u, u);
    if square > 0.0 { (dot(sub(p, c), u) / square).clamp(-1.0, 1.0) } else { 0.0 }
}

/// The nearest points of the segments `c1 + s u` and `c2 + t v`, s and t in [-1, 1]; either may be a point. Of parallel segments, those in
/// the middle of where they lie beside each other: moving little when the segments turn a little is what a controller wants.
#[inline]
pub(super) fn nearest_of_segments(c1: Vec3, u: Vec3, c2: Vec3, v: Vec3) -> [Vec3; 2] {
    let (a, e, between) = (dot(u, u), dot(v, v), sub(c2, c1));
    let normal = cross(u, v);
    // |u x v|^2 in place of a e - (u . v)^2: no cancellation.
    let square = dot(normal, normal);
    let s = if square > PARALLEL * a * e {
        (dot(cross(between, v), normal) / square).clamp(-1.0, 1.0)
    } else {
        let ends = [add(c2, v), sub(c2, v)].map(|end| nearest_on_segment(c1, u, end));
        0.5 * (ends[0] + ends[1])
    };
    let t = nearest_on_segment(c2, v, add(c1, scale(s, u)));
    let p2 = add(c2, scale(t, v));
    // Where t met its bound, s has to follow; elsewhere this changes nothing.
    let s = if t.abs() < 1.0 { s } else { nearest_on_segment(c1, u, p2) };
    [add(c1, scale(s, u)), p2]
}
