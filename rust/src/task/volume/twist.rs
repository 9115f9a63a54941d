//! Spin as the twist about z: cones and squares with a bounded spin.
//!
//! With q = [cos(b/2) cos(c/2), sin(b/2) (cos h, sin h), cos(b/2) sin(c/2)], b is the tilt, c the twist and h the heading of the axis of the tilt.

use std::f64::consts::PI;

use super::best::Best;
use super::distance::{Z, shortest};
use super::grid::swing;
use super::range::Range;
use super::{Shape, sphere};
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, dot, unit};

/// Stretches of an arc that are searched one by one for a best point.
const STRETCHES: usize = 24;

/// Halvings of a stretch: to the last digit.
const HALVINGS: usize = 60;

/// The twist about z \[rad\]; 0 where half a turn of the axis leaves it undefined.
pub(super) fn twist(q: &Quaternion) -> f64 {
    2.0 * q.0[3].atan2(q.0[0])
}

/// The nearest orientation with a twist, whatever its tilt.
pub(super) fn with_spin(q: &Quaternion, spin: f64) -> Quaternion {
    let spun = Quaternion::about(Z, spin);
    let [w, x, y, _] = q.product(&spun.conjugate()).0;
    Quaternion([w, x, y, 0.0]).normalized().unwrap_or(Quaternion([0.0, 1.0, 0.0, 0.0])).product(&spun)
}

/// Offers the members of a cone with bounded spin that may be the nearest: of the twist and the ends of its range, each with its best tilt.
pub(super) fn offer_cone(most: f64, range: &Range, q: &Quaternion, best: &mut Best) {
    let [w, x, y, z] = q.0;
    let (spin, sine, cosine) = (twist(q), x.hypot(y), w.hypot(z));
    let heading = y.atan2(x);
    let mut offer = |spin_of_member: f64| {
        // Towards the twist or, a whole turn away from it, with the other sign of the quaternion.
        let (s, c) = (0.5 * spin_of_member).sin_cos();
        let near = if cosine > 0.0 { (w * c + z * s) / cosine } else { (0.5 * (spin - spin_of_member)).cos() };
        let tilt = most.min(2.0 * sine.atan2(cosine * near.abs()));
        let mut push = |tilt: f64, heading: f64| {
            let (st, ct) = (0.5 * tilt).sin_cos();
            let (sh, ch) = heading.sin_cos();
            let st = st.copysign(near);
            best.offer(Quaternion([ct * c, st * ch, st * sh, ct * s]));
        };
        push(tilt, heading);
        // As far from every tilt.
        if sine.hypot(cosine * near) < 1e-12 {
            push(most, heading);
            push(most, heading + PI);
        }
    };
    if range.contains(spin) {
        offer(spin);
    }
    range.ends().for_each(offer);
}

/// Offers the members of a square with bounded spin that may be the nearest.
pub(super) fn offer_square(shape: &Shape, range: &Range, q: &Quaternion, best: &mut Best) {
    let z = q.rotate(Z);
    // The spin within its range: the axis turned the shortest way.
    let inside = sphere::allows(shape, z);
    let mut leaning = |direction: Vec3| {
        let member = shortest(z, direction).0.product(q);
        if range.contains(twist(&member)) {
            best.offer(member);
        }
    };
    if inside {
        leaning(z);
    } else {
        sphere::nearest(shape, z, &mut leaning);
    }
    if inside && best.distance() < 1e-15 {
        return;
    }
    // At an end of its range: the direction n whose swing [1 + n_z, -n_y, n_x, 0] is nearest to q Qz(-end).
    for end in range.ends() {
        let spun = Quaternion::about(Z, end);
        let [w, x, y, _] = q.product(&spun.conjugate()).0;
        let sign = 1.0f64.copysign(w);
        let s = Quaternion([sign * w, sign * x, sign * y, 0.0]).normalized();
        if let Some(direction) = s.map(|s| s.rotate(Z)).filter(|direction| sphere::allows(shape, *direction)) {
            best.offer(swing(direction).product(&spun));
        }
        let linear = [y, -x, w];
        sphere::bounds(shape, &mut |arc| along(&arc, linear, w, &mut |direction| best.offer(swing(direction).product(&spun))));
    }
}

/// The points of an arc where the part of a quaternion along the swing, (linear . n + w) / sqrt(2 (1 + n_z)), is extreme, and its ends.
fn along(arc: &sphere::Arc, linear: Vec3, w: f64, push: &mut dyn FnMut(Vec3)) {
    let rate = |angle: f64| {
        let (n, dn) = (arc.at(angle), arc.rate(angle));
        let (value, scaled) = (dot(linear, n) + w, 1.0 + n[2]);
        (2.0 * dot(linear, dn) * scaled - value * dn[2]) * 1.0f64.copysign(value)
    };
    push(arc.at(arc.range.low));
    push(arc.at(arc.range.high));
    let width = (arc.range.high - arc.range.low) / STRETCHES as f64;
    let mut before = rate(arc.range.low);
    for i in 1..=STRETCHES {
        let end = arc.range.low + width * i as f64;
        let after = rate(end);
        if before > 0.0 && after <= 0.0 {
            let (mut low, mut high) = (end - width, end);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if rate(middle) > 0.0 { low = middle } else { high = middle }
            }
            let found = arc.at(0.5 * (low + high));
            push(unit(found).unwrap_or(found));
        }
        before = after;
    }
}
