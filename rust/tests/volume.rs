//! Volumes as bounds: their sides against membership and differences.

use std::f64::consts::{FRAC_PI_2, PI};

use redundancy::linalg::frame::Frame;
use redundancy::linalg::quaternion::Quaternion;
use redundancy::linalg::vector::{Vec3, add, cross, dot, scale, unit};
use redundancy::task::OrientationVolume;
use redundancy::task::volume::Side;

/// Numbers evenly in a range, the same in every run.
struct Numbers(u64);

impl Numbers {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let v = [(); 3].map(|()| self.within(-1.0, 1.0));
            if dot(v, v) < 1.0 {
                return unit(v).unwrap();
            }
        }
    }

    /// Half of them small turns, so that they meet small volumes.
    fn turn(&mut self) -> Quaternion {
        let most = if self.within(0.0, 1.0) < 0.5 { 0.5 } else { PI };
        Quaternion::about(self.direction(), self.within(0.0, most))
    }
}

fn volumes() -> Vec<OrientationVolume> {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let spin = Some((-0.4, 0.9));
    let made = [
        OrientationVolume::cone(0.3, None),
        OrientationVolume::cone(2.0, Some((-3.0, 1.0))),
        OrientationVolume::cone(0.4, spin),
        OrientationVolume::cone(PI, spin),
        OrientationVolume::pyramid(0.2, 0.4, None),
        OrientationVolume::pyramid(0.5, 0.3, spin),
        OrientationVolume::pyramid(FRAC_PI_2, 0.3, None),
        OrientationVolume::pyramid(0.3, FRAC_PI_2, None),
        OrientationVolume::square(0.2, 0.4, None),
        OrientationVolume::square(0.5, 0.3, spin),
        OrientationVolume::product(&[(z, -0.3, 0.5), (y, -0.5, 0.4), (x, -0.4, 0.3)]),
        OrientationVolume::product(&[(z, -PI, PI), (y, 0.1, 0.5), (z, -1.0, 1.0)]),
        OrientationVolume::product(&[([0.2, 0.1, 1.0], -0.5, 0.4), ([0.1, 1.0, -0.2], -0.3, 0.4), ([1.0, 0.3, 0.0], -0.4, 0.5)]),
    ];
    made.map(Result::unwrap).into()
}

fn thin() -> Vec<OrientationVolume> {
    let made = [
        OrientationVolume::cone(0.0, None),
        OrientationVolume::cone(0.0, Some((0.2, 0.2))),
        OrientationVolume::cone(0.3, Some((0.2, 0.2))),
        OrientationVolume::line_x(0.5, None),
        OrientationVolume::line_y(0.5, Some((-0.4, 0.9))),
        OrientationVolume::square(0.0, 0.4, Some((-0.4, 0.9))),
        OrientationVolume::pyramid(0.4, 0.3, Some((0.1, 0.1))),
        OrientationVolume::product(&[([1.0, 2.0, 3.0], -0.5, 0.4)]),
        OrientationVolume::product(&[([0.0, 0.0, 1.0], -0.5, 0.4), ([1.0, 1.0, 0.0], -0.5, 0.4)]),
    ];
    made.map(Result::unwrap).into()
}

/// A volume seen in a reference, a path's frame, and the tool there with a relative orientation.
fn placed(
    volume: &OrientationVolume,
    relative: &Quaternion,
    numbers: &mut Numbers,
) -> (OrientationVolume, [Vec3; 3], Quaternion, Quaternion) {
    let (p, frame) = (numbers.turn(), numbers.turn());
    let seen = p.product(relative);
    (volume.reoriented(&p), frame.axes(), frame.product(&seen), seen)
}

#[test]
fn all_slacks_are_positive_inside_alone() {
    let mut numbers = Numbers(1);
    for volume in volumes() {
        volume.check_as_task().unwrap();
        assert_eq!(volume.freedoms(), 3);
        let (mut inside, mut outside) = (0, 0);
        let mut asked = volume.samples(500, 3);
        asked.extend([(); 1000].map(|()| numbers.turn()));
        for relative in asked {
            let (volume, frame, tool, seen) = placed(&volume, &relative, &mut numbers);
            let sides = volume.sides(&frame, &tool.axes());
            assert!(sides.as_slice().iter().all(|side| !side.equality));
            let slack = sides.as_slice().iter().fold(f64::INFINITY, |least, side| least.min(side.slack));
            let distance = volume.signed_distance(&seen);
            if slack.abs() > 1e-9 {
                assert_eq!(slack > 0.0, volume.contains(&seen, 1e-12), "{volume:?} {seen:?} {slack} {distance}");
                if slack > 0.0 { inside += 1 } else { outside += 1 }
            }
        }
        assert!(inside > 100 && outside > 100, "{volume:?}: {inside} inside, {outside} outside");
    }
}

#[test]
fn members_of_thin_volumes_have_no_error() {
    let mut numbers = Numbers(2);
    for volume in thin() {
        volume.check_as_task().unwrap();
        for member in volume.samples(200, 5) {
            let (volume, frame, tool, _) = placed(&volume, &member, &mut numbers);
            let sides = volume.sides(&frame, &tool.axes());
            let equalities = sides.as_slice().iter().filter(|side| side.equality);
            assert_eq!(3 - equalities.clone().count(), volume.freedoms(), "{volume:?}");
            for side in sides.as_slice() {
                assert!(if side.equality { side.slack.abs() < 1e-12 } else { side.slack > -1e-12 }, "{volume:?} {side:?}");
            }
            // A little beside it, the errors tell how far.
            let off = Quaternion::about(numbers.direction(), 1e-3);
            let beside = volume.sides(&frame, &off.product(&tool).axes());
            let error = beside.as_slice().iter().filter(|side| side.equality).map(|side| side.slack * side.slack).sum::<f64>().sqrt();
            assert!(error < 1.001e-3 / 0.5, "{volume:?} {error}");
        }
    }
}

/// One side of a tool that is turned by `angle` about `axis` of the base frame.
fn turned(volume: &OrientationVolume, frame: &[Vec3; 3], tool: &Quaternion, axis: Vec3, angle: f64, i: usize) -> Side {
    volume.sides(frame, &Quaternion::about(axis, angle).product(tool).axes()).as_slice()[i]
}

#[test]
fn rates_are_derivatives() {
    let mut numbers = Numbers(4);
    let step = 1e-5;
    for volume in volumes().into_iter().chain(thin()) {
        for member in volume.samples(100, 9) {
            // Up to the bounds and a little beyond; of thin ones at members, where the rate of an error is meant.
            let turn = Quaternion::about(numbers.direction(), if volume.freedoms() == 3 { numbers.within(0.0, 0.05) } else { 0.0 });
            let (volume, frame, tool, _) = placed(&volume, &turn.product(&member), &mut numbers);
            let sides = volume.sides(&frame, &tool.axes());
            for (i, side) in sides.as_slice().iter().enumerate() {
                let axis = numbers.direction();
                let [before, after] = [-step, step].map(|angle| turned(&volume, &frame, &tool, axis, angle, i));
                let rate = (after.slack - before.slack) / (2.0 * step);
                let wanted = dot(side.rate, axis);
                assert!((rate - wanted).abs() < 1e-6 * (1.0 + dot(side.rate, side.rate)), "{volume:?} side {i}: {rate} {wanted}");
                if let Some(normal) = side.normal {
                    let z = tool.axes()[2];
                    let second = (after.slack + before.slack - 2.0 * side.slack) / (step * step);
                    let wanted = dot(normal, cross(axis, cross(axis, z)));
                    assert!((second - wanted).abs() < 1e-4 * (1.0 + dot(normal, normal)), "{volume:?} side {i}: {second} {wanted}");
                }
            }
        }
    }
}

#[test]
fn slacks_are_distances_near_the_bound() {
    let mut numbers = Numbers(5);
    for volume in volumes() {
        for member in volume.samples(300, 11) {
            let signed = volume.signed(&member);
            if !(signed.value.is_finite() && signed.value < 0.0) {
                continue;
            }
            // To just inside the nearest bound.
            let reached = Quaternion::about(signed.gradient, -signed.value - 1e-7).product(&member);
            let (placed, frame, tool, _) = placed(&volume, &reached, &mut numbers);
            // Over its rate: an angle may change faster than the tool turns.
            let turn = |side: &Side| side.slack / dot(side.rate, side.rate).sqrt();
            let least = placed.sides(&frame, &tool.axes()).as_slice().iter().map(turn).fold(f64::INFINITY, f64::min);
            assert!((least - 1e-7).abs() < 1e-9, "{volume:?} {least}");
        }
    }
}

#[test]
fn what_is_no_task() {
    let z = [0.0, 0.0, 1.0];
    let x = [1.0, 0.0, 0.0];
    let refused = [
        OrientationVolume::pyramid(2.0, 0.1, None),
        OrientationVolume::pyramid(0.1, FRAC_PI_2, Some((0.0, 1.0))),
        OrientationVolume::square(1.0, 1.0, None),
        OrientationVolume::cone(1e-9, None),
        OrientationVolume::product(&[(z, 0.0, 1.0), (z, 0.0, 1.0)]),
        OrientationVolume::product(&[(z, 0.0, 1.0), (x, -0.5, 0.5), (z, 0.0, 1.0)]),
        OrientationVolume::product(&[(z, 0.0, 1.0), (x, 0.2, 0.2)]),
        OrientationVolume::product(&[(z, 0.0, 1.0); 4]),
    ];
    for volume in refused {
        assert!(volume.unwrap().check_as_task().is_err());
    }
}

#[test]
fn quaternions_are_rotations() {
    let mut numbers = Numbers(6);
    for _ in 0..500 {
        let (a, b, v) = (numbers.turn(), numbers.turn(), numbers.direction());
        let [ra, rb] = [a, b].map(|q| Frame { axes: q.axes(), origin: [0.0; 3] });
        let near = |p: Vec3, q: Vec3| add(p, scale(-1.0, q)).iter().all(|d| d.abs() < 2e-15);
        assert!(near(a.rotate(v), ra.rotate(v)));
        assert!(near(a.product(&b).rotate(v), ra.rotate(rb.rotate(v))));
        assert!(near(a.conjugate().rotate(a.rotate(v)), v));
        let again = Quaternion::from_axes(&a.axes());
        assert!(again.angle_to(&a) < 2e-15 && a.opposite().angle_to(&a) < 1e-15);
        let half = Quaternion::about(v, PI);
        assert!(Quaternion::from_axes(&half.axes()).angle_to(&half) < 2e-15);
        let (axis, angle) = a.axis_angle();
        assert!(Quaternion::about(axis, angle).angle_to(&a) < 2e-15);
    }
}
