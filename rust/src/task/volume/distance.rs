//! Membership, the nearest member and the distance to a volume or, inside, to its bounds.

use super::best::{Best, Nearest};
use super::{Factor, OrientationVolume, Shape, product, sphere, twist};
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, cross, dot, norm, perpendicular, scale, sub, unit};
use product::Lie;
use std::f64::consts::{FRAC_PI_2, PI};

use super::range::{Range, wrap};

/// Directions this close to opposite \[rad\] have no shortest way between them.
const OPPOSITE: f64 = 1e-9;

pub(super) const X: Vec3 = [1.0, 0.0, 0.0];
pub(super) const Y: Vec3 = [0.0, 1.0, 0.0];
pub(super) const Z: Vec3 = [0.0, 0.0, 1.0];

/// The distance to a volume, negative inside, and how turning changes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignedDistance {
    /// The smallest angle \[rad\] of a rotation to a member; inside, minus that to the nearest bound. NaN inside where that is not known.
    pub value: f64,
    /// Its derivative for an angular velocity in the frame that the orientation is given in; NaN where the distance is zero or not known.
    pub gradient: Vec3,
}

/// The shortest rotation of one direction onto another, and whether there is only one.
pub(super) fn shortest(from: Vec3, to: Vec3) -> (Quaternion, bool) {
    let normal = cross(from, to);
    let angle = norm(normal).atan2(dot(from, to));
    // Near half a turn the normal has few digits; across `from` it still ends on `to`.
    let axis = unit(sub(normal, scale(dot(normal, from), from)));
    (Quaternion::about(axis.unwrap_or_else(|| perpendicular(from).0), angle), angle < PI - OPPOSITE)
}

impl OrientationVolume {
    /// The orientation seen in the reference.
    pub(super) fn seen(&self, q: &Quaternion) -> Quaternion {
        self.reference.conjugate().product(q)
    }

    /// The tool's axis seen in the reference, and the spin \[rad\] about it: of pyramids c of Qx(a) Qy(b) Qz(c), of the rest the twist about z.
    pub fn pointing(&self, q: &Quaternion) -> (Vec3, f64) {
        let seen = self.seen(q);
        let spin = match &self.shape {
            Shape::Pyramid(_) => {
                let [x, y, _] = seen.axes();
                (-y[0]).atan2(x[0])
            }
            _ => wrap(twist::twist(&seen)),
        };
        (seen.rotate(Z), spin)
    }

    /// \[cos(spin/2), sin(spin/2) z'\]: a picture of an orientation in the unit ball (From and Gravdahl 2007, eq. 8 and 10).
    pub fn visualising(&self, q: &Quaternion) -> Quaternion {
        let (direction, spin) = self.pointing(q);
        Quaternion::about(direction, spin)
    }

    /// Whether an orientation is at most `tolerance` \[rad\] from a member.
    pub fn contains(&self, q: &Quaternion, tolerance: f64) -> bool {
        self.nearest(q).distance <= tolerance
    }

    /// The member nearest to an orientation.
    #[inline(never)]
    pub fn nearest(&self, q: &Quaternion) -> Nearest {
        let seen = self.seen(q);
        let mut best = Best::to(&seen);
        match &self.shape {
            Shape::Product(factors) => product::offer(factors, &seen, &mut best),
            _ if self.spin.is_free() => self.offer_directions(&seen, &mut best),
            Shape::Pyramid(tilts) => product::offer(&self.rotations(tilts), &seen, &mut best),
            Shape::Cone(tilt) => twist::offer_cone(*tilt, &self.spin, &seen, &mut best),
            Shape::Square(_) => twist::offer_square(&self.shape, &self.spin, &seen, &mut best),
        }
        let found = best.nearest().unwrap_or(Nearest { orientation: seen, distance: f64::NAN, unique: false });
        Nearest { orientation: self.reference.product(&found.orientation), ..found }
    }

    /// A pyramid as a product.
    pub(super) fn rotations(&self, [x, y]: &[f64; 2]) -> [Factor; 3] {
        [Factor { axis: X, range: Range::within(*x) }, Factor { axis: Y, range: Range::within(*y) }, Factor { axis: Z, range: self.spin }]
    }

    /// With the spin free: the tool's axis turned the shortest way.
    fn offer_directions(&self, seen: &Quaternion, best: &mut Best) {
        let z = seen.rotate(Z);
        if sphere::allows(&self.shape, z) {
            return best.offer(*seen);
        }
        self.offer_bounds_of_tilt(z, seen, best);
    }

    fn offer_bounds_of_tilt(&self, z: Vec3, seen: &Quaternion, best: &mut Best) {
        sphere::nearest(&self.shape, z, &mut |direction| {
            let (turn, only) = shortest(z, direction);
            let member = turn.product(seen);
            best.offer(member);
            if !only && member.angle_to(seen) <= best.distance() {
                best.tie();
            }
        });
    }

    /// [`SignedDistance::value`].
    pub fn signed_distance(&self, q: &Quaternion) -> f64 {
        self.signed(q).value
    }

    /// The distance to a member or, inside, minus that to the nearest bound, with its gradient.
    ///
    /// Inside it is known of cones and squares, of pyramids whose tilt about y is at most pi/2, of what has no interior (0), and of products of
    /// three rotations whose axes do not come to lie in a plane; it is minus infinity where nothing bounds.
    pub fn signed(&self, q: &Quaternion) -> SignedDistance {
        let nearest = self.nearest(q);
        // What is left of a member that was decomposed is rounding.
        if nearest.distance > product::EXACT {
            return SignedDistance { value: nearest.distance, gradient: away(&nearest.orientation, q) };
        }
        let seen = self.seen(q);
        let mut best = Best::to(&seen);
        if !self.offer_bounds(&seen, &mut best) {
            return SignedDistance { value: f64::NAN, gradient: [f64::NAN; 3] };
        }
        match best.nearest() {
            Some(bound) => {
                let gradient = away(&self.reference.product(&bound.orientation), q);
                SignedDistance { value: -bound.distance, gradient: scale(-1.0, gradient) }
            }
            None => SignedDistance { value: f64::NEG_INFINITY, gradient: [0.0; 3] },
        }
    }

    /// Offers what bounds the volume, as seen from inside; whether that is known.
    fn offer_bounds(&self, seen: &Quaternion, best: &mut Best) -> bool {
        if self.freedoms() < 3 {
            best.offer(*seen);
            return true;
        }
        match &self.shape {
            Shape::Product(factors) => match &factors[..] {
                [a, b, c] if !Lie::of([a, b, c]).is_singular_within(&b.range) => product::offer_bounds([a, b, c], seen, best),
                _ => return false,
            },
            Shape::Pyramid([_, y]) if *y > FRAC_PI_2 => return false,
            Shape::Pyramid(_) => {
                // Beyond a quarter turn about y it is another spin that the orientation has.
                let leaning = [Factor { axis: X, range: Range::FREE }, Factor { axis: Y, range: Range::within(FRAC_PI_2) }];
                for end in self.spin.ends() {
                    let spun = Quaternion::about(Z, end);
                    product::offer_times(&leaning, &seen.product(&spun.conjugate()), &spun, best);
                }
            }
            Shape::Cone(_) | Shape::Square(_) => self.spin.ends().for_each(|end| best.offer(twist::with_spin(seen, end))),
        }
        if !matches!(self.shape, Shape::Product(_)) {
            self.offer_bounds_of_tilt(seen.rotate(Z), seen, best);
        }
        true
    }
}

/// The direction of the angular velocity that takes an orientation away from another.
fn away(from: &Quaternion, q: &Quaternion) -> Vec3 {
    let turn = q.product(&from.conjugate());
    unit(scale(1.0f64.copysign(turn.0[0]), turn.vector())).unwrap_or([f64::NAN; 3])
}
