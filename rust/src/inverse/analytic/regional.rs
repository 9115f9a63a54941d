//! The first three joints of a decoupled arm: any three revolute axes that take a point to a place (Pieper 1968).

use super::circle::{Watch, magnitude, on_conic, on_line, product};
use super::structure::{Turn, Turned, across, point, square, third_row, turn_between, turned, unpoint};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, dot, norm};

/// A point this near to an axis, relative to the size of the arm, is on it.
const ON_AXIS: f64 = 1e-9;
/// Directions this near to parallel count as such.
const PARALLEL: f64 = 1e-9;

/// One solution.
#[derive(Debug, Clone, Copy)]
pub struct Regional {
    /// Cosines and sines of the joints.
    pub turns: [Turn; 3],
    /// Which solution: two bits.
    pub side: u8,
    /// Whether solutions meet here.
    pub singular: bool,
    /// A joint that may be chosen: it is 0.
    pub free: Option<usize>,
}

/// Calls `found` for each solution of `Z(q1) l1 Z(q2) l2 Z(q3) wrist = place`; false where there may be more than it was called for.
#[inline(always)]
pub fn regional<W: Watch>(l1: &Frame, l2: &Frame, wrist: Vec3, place: Vec3, watch: &mut W, found: impl FnMut(Regional)) -> bool {
    let arm = Arm { l1, l2, wrist, place, size: norm(l1.origin) + norm(l2.origin) + norm(wrist) };
    if across(l2.axes[2]) <= PARALLEL * PARALLEL { arm.elbow_parallel(watch, found) } else { arm.any(watch, found) }
}

struct Arm<'a> {
    l1: &'a Frame,
    l2: &'a Frame,
    wrist: Vec3,
    place: Vec3,
    size: f64,
}

/// A vector that depends on an angle: constant, factor of the cosine, factor of the sine.
type Wheel = [Vec3; 3];

impl Arm<'_> {
    /// The wrist seen from behind joint 3, `l2 Z(q3) wrist`.
    #[inline(always)]
    fn wheel(&self) -> Wheel {
        let [x, y, z] = self.wrist;
        [point(self.l2, [0.0, 0.0, z]), self.l2.rotate([x, y, 0.0]), self.l2.rotate([-y, x, 0.0])]
    }

    /// `|l2 Z(q3) wrist|^2`; the wheel's spokes are equal and perpendicular.
    #[inline(always)]
    fn distance(wheel: &Wheel) -> Turned {
        Turned { constant: square(wheel[0]) + square(wheel[1]), cosine: 2.0 * dot(wheel[0], wheel[1]), sine: 2.0 * dot(wheel[0], wheel[2]) }
    }

    /// Axes 2 and 3 parallel, as in most industrial arms: the place along them gives q1, its distance from axis 2 q3.
    #[inline(always)]
    fn elbow_parallel(&self, watch: &mut impl Watch, mut found: impl FnMut(Regional)) -> bool {
        let wheel = self.wheel();
        // (l1^-1 Z(-q1) place) along z is what the wrist keeps along axis 2 whatever q3 is.
        let along = Turned::new(self.place, self.l1.axes[2]);
        let height = wheel[0][2] + dot(self.l1.axes[2], self.l1.origin);
        let Some(first) = on_line(&along, height, self.size) else {
            // Axis 1 parallel to the others, or the place on axis 1.
            return self.shoulder_free(watch, found);
        };
        watch.see(|| first.gap());
        let distance = Self::distance(&wheel);
        for ((c1, s1), shoulder, beside) in first.iter() {
            let seen = unpoint(self.l1, turned(c1, -s1, self.place));
            let Some(third) = on_line(&distance, square(seen), self.size * self.size) else {
                return false;
            };
            watch.see(|| third.gap());
            for ((c3, s3), elbow, stretched) in third.iter() {
                let wrist: Vec3 = std::array::from_fn(|i| wheel[0][i] + c3 * wheel[1][i] + s3 * wheel[2][i]);
                let on_axis = across(wrist) <= (ON_AXIS * self.size).powi(2);
                let second = if on_axis { (1.0, 0.0) } else { turn_between(wrist, seen) };
                let singular = on_axis || beside || stretched;
                found(Regional { turns: [(c1, s1), second, (c3, s3)], side: 2 * shoulder + elbow, singular, free: on_axis.then_some(1) });
            }
        }
        true
    }

    /// The place is on axis 1: q1 may be chosen, so it is 0.
    fn shoulder_free(&self, watch: &mut impl Watch, mut found: impl FnMut(Regional)) -> bool {
        if across(self.place) > (ON_AXIS * self.size).powi(2) {
            return self.any(watch, found);
        }
        let wheel = self.wheel();
        let seen = unpoint(self.l1, self.place);
        let Some(third) = on_line(&Self::distance(&wheel), square(seen), self.size * self.size) else {
            return false;
        };
        watch.see(|| 0.0);
        for ((c3, s3), elbow, _) in third.iter() {
            let wrist: Vec3 = std::array::from_fn(|i| wheel[0][i] + c3 * wheel[1][i] + s3 * wheel[2][i]);
            found(Regional { turns: [(1.0, 0.0), turn_between(wrist, seen), (c3, s3)], side: elbow, singular: true, free: Some(0) });
        }
        true
    }

    /// Any axes. With x = Z(q2) l2 Z(q3) wrist, the height of the place along axis 1 and its squared distance from the foot of axis 1 do not
    /// depend on q1 and are linear in x; what x has across axis 2 is known up to its direction.
    fn any(&self, watch: &mut impl Watch, mut found: impl FnMut(Regional)) -> bool {
        let wheel = self.wheel();
        let distance = Self::distance(&wheel);
        let (u, t) = (self.l1.unrotate(self.l1.origin), third_row(self.l1));
        // u . x and t . x without the parts along z, as functions of q3: constant, cosine, sine.
        let f: [f64; 3] = [
            0.5 * (square(self.place) - distance.constant - square(self.l1.origin)) - u[2] * wheel[0][2],
            -0.5 * distance.cosine - u[2] * wheel[1][2],
            -0.5 * distance.sine - u[2] * wheel[2][2],
        ];
        let g: [f64; 3] = [self.place[2] - self.l1.origin[2] - t[2] * wheel[0][2], -t[2] * wheel[1][2], -t[2] * wheel[2][2]];
        // Squared part of x across axis 2.
        let axial = std::array::from_fn::<f64, 3, _>(|i| wheel[i][2]);
        let squared = product(axial, axial);
        let radial: [f64; 6] = std::array::from_fn(|i| [distance.constant, distance.cosine, distance.sine, 0.0, 0.0, 0.0][i] - squared[i]);
        let det = u[0] * t[1] - u[1] * t[0];
        let (size_u, size_t) = (u[0].hypot(u[1]), t[0].hypot(t[1]));
        if det.abs() > PARALLEL * self.size {
            let x: [f64; 3] = std::array::from_fn(|i| (t[1] * f[i] - u[1] * g[i]) / det);
            let y: [f64; 3] = std::array::from_fn(|i| (u[0] * g[i] - t[0] * f[i]) / det);
            let (xx, yy) = (product(x, x), product(y, y));
            let Some(points) = on_conic(&std::array::from_fn(|i| xx[i] + yy[i] - radial[i]), magnitude(&[xx, yy, radial])) else {
                return false;
            };
            watch.see(|| points.gap());
            let at = |f: &[f64; 3], c: f64, s: f64| f[0] + c * f[1] + s * f[2];
            for ((c, s), side, tangent) in points.iter() {
                self.close(&wheel, (c, s), (at(&x, c, s), at(&y, c, s)), side, tangent, watch, &mut found);
            }
            return true;
        }
        // The combination of the two that does not know q2.
        let (alone, known, row) = if size_t > PARALLEL && size_t * self.size >= size_u {
            let share = (u[0] * t[0] + u[1] * t[1]) / (size_t * size_t);
            (std::array::from_fn(|i| f[i] - share * g[i]), t, g)
        } else if size_u > PARALLEL * self.size {
            let share = (u[0] * t[0] + u[1] * t[1]) / (size_u * size_u);
            (std::array::from_fn(|i| g[i] - share * f[i]), u, f)
        } else {
            return false;
        };
        let alone: [f64; 3] = alone;
        let line = Turned { constant: alone[0], cosine: alone[1], sine: alone[2] };
        let Some(third) = on_line(&line, 0.0, self.size * if size_u > PARALLEL * self.size { self.size } else { 1.0 }) else {
            return false;
        };
        watch.see(|| third.gap());
        for ((c, s), side, tangent) in third.iter() {
            self.with_third(&wheel, (c, s), known, row[0] + c * row[1] + s * row[2], 2 * side, tangent, watch, &mut found);
        }
        true
    }

    /// q2 from q3 and one linear equation, `known . x = value`.
    fn with_third(
        &self,
        wheel: &Wheel,
        (c, s): (f64, f64),
        known: Vec3,
        value: f64,
        side: u8,
        tangent: bool,
        watch: &mut impl Watch,
        found: &mut impl FnMut(Regional),
    ) {
        let wrist: Vec3 = std::array::from_fn(|i| wheel[0][i] + c * wheel[1][i] + s * wheel[2][i]);
        // known . Z(q2) wrist, without the part along z.
        let line = Turned { constant: 0.0, ..Turned::new([known[0], known[1], 0.0], wrist) };
        match on_line(&line, value, norm(known) * self.size) {
            Some(points) => {
                watch.see(|| points.gap());
                for ((c2, s2), other, double) in points.iter() {
                    let x = (c2 * wrist[0] - s2 * wrist[1], s2 * wrist[0] + c2 * wrist[1]);
                    self.close(wheel, (c, s), x, side + other, tangent || double, watch, found);
                }
            }
            // The wrist is on axis 2: any q2 will do.
            None => {
                watch.see(|| 0.0);
                self.close(wheel, (c, s), (wrist[0], wrist[1]), side, true, watch, found);
            }
        }
    }

    /// q2 from what x is across axis 2, then q1.
    fn close(
        &self,
        wheel: &Wheel,
        (c, s): (f64, f64),
        (x, y): (f64, f64),
        side: u8,
        tangent: bool,
        watch: &mut impl Watch,
        found: &mut impl FnMut(Regional),
    ) {
        let wrist: Vec3 = std::array::from_fn(|i| wheel[0][i] + c * wheel[1][i] + s * wheel[2][i]);
        let near = (ON_AXIS * self.size).powi(2);
        let on_second = across(wrist) <= near;
        let second = if on_second { (1.0, 0.0) } else { turn_between(wrist, [x, y, 0.0]) };
        let seen = point(self.l1, turned(second.0, second.1, wrist));
        let on_first = across(seen) <= near || across(self.place) <= near;
        watch.see(|| across(wrist).min(across(seen)).sqrt() / self.size);
        let first = if on_first { (1.0, 0.0) } else { turn_between(seen, self.place) };
        found(Regional {
            turns: [first, second, (c, s)],
            side,
            singular: tangent || on_first || on_second,
            free: if on_first { Some(0) } else { on_second.then_some(1) },
        });
    }
}
