//! Boxes and hulls by the algorithms of parry: GJK for those apart, EPA for those that overlap.

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::epa::EPA;
use parry3d_f64::query::gjk::{CsoPoint, GJKResult, VoronoiSimplex, closest_points};
use parry3d_f64::shape::SupportMap;

use super::shape::Core;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, dot, norm, scale, sub, unit};

/// The distance over the size below which the difference of nearest points says less about the normal than the algorithm's last direction.
const TOUCHING: f64 = 1e-7;

/// The distance over the size beyond which shapes are points to each other, and squares in parry might overflow.
const FAR: f64 = 1e9;

/// How far apart over the size overlapping cores are moved, and how often at most: one round confirms a depth, a second follows a correction.
const CLEAR: f64 = 0.01;
const ROUNDS: usize = 12;

/// The gain over the size that is no gain any more.
const ROUNDING: f64 = 1e-13;

/// A core about the first core's middle and in units of the pair's size: parry's tolerances are absolute, these make them relative.
struct Scaled<'a> {
    core: &'a Core,
    frame: &'a Frame,
    offset: Vec3,
    scale: f64,
}

impl SupportMap for Scaled<'_> {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let point = self.frame.rotate(self.core.support(self.frame.unrotate(direction.to_array())));
        Vector::from_array(scale(self.scale, add(self.offset, point)))
    }
}

/// A pair as parry sees it.
struct Scaling<'a> {
    first: Scaled<'a>,
    second: Scaled<'a>,
    origin: Vec3,
    size: f64,
}

impl<'a> Scaling<'a> {
    fn new(core1: &'a Core, frame1: &'a Frame, core2: &'a Core, frame2: &'a Frame) -> Self {
        let offset = sub(frame2.origin, frame1.origin);
        let size = core1.reach() + core2.reach();
        let scaled = |core, frame, offset| Scaled { core, frame, offset, scale: 1.0 / size };
        Self { first: scaled(core1, frame1, [0.0; 3]), second: scaled(core2, frame2, offset), origin: frame1.origin, size }
    }

    fn gjk(&self, simplex: &mut VoronoiSimplex) -> GJKResult {
        if norm(self.second.offset) > FAR * self.size {
            return GJKResult::NoIntersection(Vector::X);
        }
        let towards = unit(self.second.offset).unwrap_or([1.0, 0.0, 0.0]);
        simplex.reset(CsoPoint::from_shapes(&Pose::IDENTITY, &self.first, &self.second, Vector::from_array(towards)));
        closest_points(&Pose::IDENTITY, &self.first, &self.second, f64::MAX, true, simplex)
    }

    /// The signed distance along a unit direction from the first to the second core.
    fn along(&self, n: Vec3) -> f64 {
        let (a, b) = (&self.first, &self.second);
        let extent = |s: &Scaled, n: Vec3| dot(n, s.frame.rotate(s.core.support(s.frame.unrotate(n))));
        dot(n, b.offset) - extent(a, n) - extent(b, scale(-1.0, n))
    }

    /// The point of the first core farthest along a direction.
    fn farthest(&self, n: Vec3) -> Vec3 {
        let frame = self.first.frame;
        add(frame.origin, frame.rotate(self.first.core.support(frame.unrotate(n))))
    }

    fn point(&self, p: Vector) -> Vec3 {
        add(self.origin, scale(self.size, p.to_array()))
    }
}

/// The nearest points of two cores that are apart.
pub(super) fn nearest(core1: &Core, frame1: &Frame, core2: &Core, frame2: &Frame) -> Option<[Vec3; 2]> {
    let pair = Scaling::new(core1, frame1, core2, frame2);
    match pair.gjk(&mut VoronoiSimplex::new()) {
        GJKResult::ClosestPoints(p1, p2, _) => Some([pair.point(p1), pair.point(p2)]),
        _ => None,
    }
}

/// Distance, normal and points of two cores of which one is a hull.
pub(super) fn hulls(core1: &Core, frame1: &Frame, core2: &Core, frame2: &Frame, epa: &mut EPA) -> (f64, Vec3, [Vec3; 2]) {
    let mut pair = Scaling::new(core1, frame1, core2, frame2);
    let mut simplex = VoronoiSimplex::new();
    let normal = match pair.gjk(&mut simplex) {
        GJKResult::ClosestPoints(p1, p2, n) => {
            let points = [pair.point(p1), pair.point(p2)];
            let between = sub(points[1], points[0]);
            let distance = norm(between);
            if distance > TOUCHING * pair.size {
                return (distance, scale(1.0 / distance, between), points);
            }
            unit(n.to_array())
        }
        GJKResult::Intersection => {
            epa.closest_points(&Pose::IDENTITY, &pair.first, &pair.second, &simplex).and_then(|(.., n)| unit(n.to_array()))
        }
        _ => None,
    };
    // EPA may give up on nearly flat simplices, as when faces just touch, and at times it stops short of the deepest face.
    let n = best_of(&pair, normal);
    deepest(&mut pair, n)
}

/// The direction of greatest signed distance among one found, the axes of both frames and the line of the origins.
fn best_of(pair: &Scaling, found: Option<Vec3>) -> Vec3 {
    let axes = pair.first.frame.axes.into_iter().chain(pair.second.frame.axes).chain(unit(pair.second.offset));
    let all = axes.flat_map(|axis| [axis, scale(-1.0, axis)]).chain(found);
    all.max_by(|a, b| pair.along(*a).total_cmp(&pair.along(*b))).unwrap_or([0.0, 0.0, 1.0])
}

/// The signed distance of cores that touch or overlap, which is the greatest g(n) of the signed distances along directions, from a guess on.
///
/// Moved by `s n`, s = clear - g(n), the cores are apart, by at least `clear`; GJK gives the direction m of their distance
/// `g(m) + s n . m >= clear = g(n) + s`. So `g(m) >= g(n) + s (1 - n . m)`: the step never loses, and rests where g is greatest nearby.
fn deepest(pair: &mut Scaling, guess: Vec3) -> (f64, Vec3, [Vec3; 2]) {
    let offset = pair.second.offset;
    let (mut n, mut distance) = (guess, pair.along(guess));
    let mut p1 = pair.farthest(guess);
    for _ in 0..ROUNDS {
        pair.second.offset = add(offset, scale(CLEAR * pair.size - distance, n));
        let moved = pair.gjk(&mut VoronoiSimplex::new());
        pair.second.offset = offset;
        let GJKResult::ClosestPoints(first, second, _) = moved else { break };
        let Some(m) = unit(sub(second.to_array(), first.to_array())) else { break };
        let along = pair.along(m);
        let gained = along - distance;
        if gained < -ROUNDING * pair.size {
            break;
        }
        (n, distance, p1) = (m, along, pair.point(first));
        if gained <= ROUNDING * pair.size {
            break;
        }
    }
    (distance, n, [p1, add(p1, scale(distance, n))])
}
