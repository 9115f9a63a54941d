//! Three parallel axes, joints 2, 3 and 4 of the loop (the UR robots and their kin).

use super::circle::{Watch, on_line, on_two_circles, turn_between_values};
use super::solutions::Solutions;
use super::structure::{Loop, Turn, Turned, across, angle_between, angle_of, point, square, third_row, turn_between, turned, unpoint};
use super::wrist::middle_turns;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, dot, norm, scale};

/// Axis 6 this near to parallel to the three (sine of the angle): it can do what they can.
const IN_LINE: f64 = 1e-13;
/// The same below which the cosine of the angle says too little.
const NEARLY_IN_LINE: f64 = 1e-4;

/// The point of the second axis nearest to the first, in the frame of the second: height on it. `link` leads from the first axis to the
/// second.
fn nearest_height(link: &Frame) -> f64 {
    let axis = link.axes[2];
    let sine2 = axis[0] * axis[0] + axis[1] * axis[1];
    if sine2 > 1e-12 { -(axis[0] * link.origin[0] + axis[1] * link.origin[1]) / sine2 } else { 0.0 }
}

/// Every solution of `Z(q1) l[0] Z(q2) l[1] ... Z(q6) l[5] = 1` when axes 2, 3 and 4 are parallel; candidates, not verified.
pub fn parallel<W: Watch>(l: &Loop, watch: &mut W, found: &mut Solutions) {
    let size: f64 = l.iter().map(|link| norm(link.origin)).sum();
    // Joints 2 to 4 keep their common axis, up to its sense, and what lies along it.
    let sense = (l[1].axes[2][2] * l[2].axes[2][2]).signum();
    let along = l[1].origin[2] + l[1].axes[2][2].signum() * l[2].origin[2];
    let axis = l[0].axes[2];
    // A point of axis 6, best that where it meets axis 5, has the same place along the common axis seen from either end of the three.
    let on_six = [0.0, 0.0, nearest_height(&l[4])];
    let ahead = third_row(&l[3]);
    let far = Turned::new(ahead, point(&l[4], on_six));
    let near = Turned::new(unpoint(&l[5], on_six), axis);
    // Axis 6 makes the same angle with the common axis seen from either end.
    let far_angle = Turned::new(ahead, l[4].axes[2]);
    let near_angle = Turned::new(third_row(&l[5]), axis);
    let a = [[near.cosine, near.sine], [near_angle.cosine, near_angle.sine]];
    let b = [[-sense * far.cosine, -sense * far.sine], [-sense * far_angle.cosine, -sense * far_angle.sine]];
    let e = [
        along + dot(axis, l[0].origin) - near.constant + sense * (far.constant + l[3].origin[2]),
        sense * far_angle.constant - near_angle.constant,
    ];
    // Both rows in the same unit.
    let unit = 1.0 / size.max(f64::MIN_POSITIVE);
    let Some(pairs) = on_two_circles([a[0].map(|x| unit * x), a[1]], [b[0].map(|x| unit * x), b[1]], [unit * e[0], e[1]]) else {
        found.complete = false;
        return;
    };
    watch.see(|| pairs.gap);
    for &((c1, s1), fifth, side, tangent) in &pairs.at[..pairs.count] {
        // The common axis seen from joint 6: near it in line, q5 is told by its sine.
        let from_two = scale(sense, l[5].rotate(turned(c1, s1, axis)));
        watch.see(|| across(from_two).sqrt());
        if across(from_two) > NEARLY_IN_LINE * NEARLY_IN_LINE {
            last_and_planar(l, (c1, s1), fifth, from_two, side, tangent, watch, found);
            continue;
        }
        let Some(points) = middle_turns(&far_angle, from_two[2], across(from_two)) else {
            found.complete = false;
            continue;
        };
        watch.see(|| 0.0);
        for (turn, other, double) in points.iter() {
            let same_side = turn.0 * fifth.0 + turn.1 * fifth.1 > 0.0 && (tangent || other == side & 1);
            if same_side {
                last_and_planar(l, (c1, s1), turn, from_two, 2 * (side / 2) + other, double, watch, found);
            }
        }
    }
}

/// A turn of joint 6 at which the planar arm can be closed, when joint 6 is parallel to it and may be chosen: none if that will do.
fn within_reach(distance: &Turned, reach: impl Fn(Turn) -> f64) -> Turn {
    let swing = distance.cosine.hypot(distance.sine);
    let (least, most) = (distance.constant - swing, distance.constant + swing);
    let (none, quarter, half) = (reach((1.0, 0.0)), reach((0.0, 1.0)), reach((-1.0, 0.0)));
    let middle = 0.5 * (none + half);
    turn_between_values(&Turned { constant: middle, cosine: none - middle, sine: quarter - middle }, least, most)
}

/// q6 from the directions, then the planar arm of joints 2, 3 and 4.
fn last_and_planar(
    l: &Loop,
    (c1, s1): Turn,
    (c5, s5): Turn,
    from_two: Vec3,
    side: u8,
    tangent: bool,
    watch: &mut impl Watch,
    found: &mut Solutions,
) {
    // The common axis seen from joint 6, from either end.
    let from_four = l[4].unrotate(turned(c5, -s5, third_row(&l[3])));
    let in_line = across(from_four) <= IN_LINE * IN_LINE || across(from_two) <= IN_LINE * IN_LINE;
    // What is left for joints 2 to 4: Z(q2) l1 Z(q3) l2 Z(q4), up to what joint 6 does.
    let ahead = Frame::IDENTITY.turn_z(c1, s1).compose(&l[0]);
    let behind = l[3].turn_z(c5, s5).compose(&l[4]);
    let left = |(c6, s6): Turn| behind.turn_z(c6, s6).compose(&l[5]).compose(&ahead).inverse();
    let [x, y, _] = l[2].origin;
    let spokes = [l[1].rotate([x, y, 0.0]), l[1].rotate([-y, x, 0.0])];
    let upper = [l[1].origin[0], l[1].origin[1], 0.0];
    let distance =
        Turned { constant: square(upper) + x * x + y * y, cosine: 2.0 * dot(upper, spokes[0]), sine: 2.0 * dot(upper, spokes[1]) };
    let sixth = if in_line { within_reach(&distance, |turn| across(left(turn).origin)) } else { turn_between(from_two, from_four) };
    let q6 = angle_of(sixth);
    let planar = left(sixth);
    let reach = planar.origin;
    let Some(third) = on_line(&distance, across(reach), distance.constant) else {
        found.complete = false;
        return;
    };
    found.complete &= !in_line;
    // Near in line the direction of joint 6 is that much less sure, and so is the reach.
    watch.see(|| third.gap() * if third.count > 0 { 1.0 } else { across(from_two).sqrt() });
    for ((c3, s3), elbow, stretched) in third.iter() {
        let arm = std::array::from_fn(|i| upper[i] + c3 * spokes[0][i] + s3 * spokes[1][i]);
        let q2 = angle_between(arm, reach);
        let (s2, c2) = q2.sin_cos();
        let ahead = Frame::IDENTITY.turn_z(c2, s2).compose(&l[1]).turn_z(c3, s3).compose(&l[2]);
        let turn = ahead.unrotate(planar.axes[0]);
        let q4 = turn[1].atan2(turn[0]);
        let q = [s1.atan2(c1), q2, s3.atan2(c3), q4, s5.atan2(c5), q6];
        found.push(q, 2 * side + elbow, in_line || tangent || stretched);
    }
}
