//! Three parallel axes, joints 2, 3 and 4 of the loop (the UR robots and their kin).

use super::circle::{on_line, on_two_circles};
use super::solutions::Solutions;
use super::structure::{Loop, Turned, across, angle_between, point, square, third_row, turned, unpoint};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{dot, norm, scale};

/// Axis 6 this near to parallel to the three (sine of the angle): it can do what they can.
const IN_LINE: f64 = 1e-8;

/// The point of the second axis nearest to the first, in the frame of the second: height on it. `link` leads from the first axis to the
/// second.
fn nearest_height(link: &Frame) -> f64 {
    let axis = link.axes[2];
    let sine2 = axis[0] * axis[0] + axis[1] * axis[1];
    if sine2 > 1e-12 { -(axis[0] * link.origin[0] + axis[1] * link.origin[1]) / sine2 } else { 0.0 }
}

/// Every solution of `Z(q1) l[0] Z(q2) l[1] ... Z(q6) l[5] = 1` when axes 2, 3 and 4 are parallel; candidates, not verified.
pub fn parallel(l: &Loop, found: &mut Solutions) {
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
    for &((c1, s1), (c5, s5), side) in &pairs.at[..pairs.count] {
        last_and_planar(l, (c1, s1), (c5, s5), sense, side, pairs.tangent, found);
    }
}

/// q6 from the directions, then the planar arm of joints 2, 3 and 4.
fn last_and_planar(l: &Loop, (c1, s1): (f64, f64), (c5, s5): (f64, f64), sense: f64, side: u8, tangent: bool, found: &mut Solutions) {
    // The common axis seen from joint 6, from either end.
    let from_four = l[4].unrotate(turned(c5, -s5, third_row(&l[3])));
    let from_two = scale(sense, l[5].rotate(turned(c1, s1, l[0].axes[2])));
    let in_line = across(from_four) <= IN_LINE * IN_LINE || across(from_two) <= IN_LINE * IN_LINE;
    let q6 = if in_line { 0.0 } else { angle_between(from_two, from_four) };
    let (s6, c6) = q6.sin_cos();
    // What is left for joints 2 to 4: Z(q2) l1 Z(q3) l2 Z(q4).
    let rest = Frame::IDENTITY.turn_z(c1, s1).compose(&l[0]).inverse();
    let hand = l[3].turn_z(c5, s5).compose(&l[4]).turn_z(c6, s6).compose(&l[5]);
    let planar = hand.compose(&rest.inverse()).inverse();
    let reach = planar.origin;
    let [x, y, _] = l[2].origin;
    let spokes = [l[1].rotate([x, y, 0.0]), l[1].rotate([-y, x, 0.0])];
    let upper = [l[1].origin[0], l[1].origin[1], 0.0];
    let distance =
        Turned { constant: square(upper) + x * x + y * y, cosine: 2.0 * dot(upper, spokes[0]), sine: 2.0 * dot(upper, spokes[1]) };
    let Some(third) = on_line(&distance, across(reach), square(upper) + x * x + y * y) else {
        found.complete = false;
        return;
    };
    for ((c3, s3), elbow) in third.iter() {
        let arm = std::array::from_fn(|i| upper[i] + c3 * spokes[0][i] + s3 * spokes[1][i]);
        let q2 = angle_between(arm, reach);
        let (s2, c2) = q2.sin_cos();
        let ahead = Frame::IDENTITY.turn_z(c2, s2).compose(&l[1]).turn_z(c3, s3).compose(&l[2]);
        let turn = ahead.unrotate(planar.axes[0]);
        let q4 = turn[1].atan2(turn[0]);
        let q = [s1.atan2(c1), q2, s3.atan2(c3), q4, s5.atan2(c5), q6];
        found.push(q, 2 * side + elbow, in_line || tangent || third.tangent);
    }
}
