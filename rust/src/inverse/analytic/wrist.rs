//! Three axes through a point, turned to an orientation.

use super::circle::on_line;
use super::structure::{Turned, across, angle_between, third_row};
use crate::linalg::frame::Frame;

/// Sine of the angle between the outer axes below which they count as in line: only the sum (or difference) of their angles is known then.
const IN_LINE: f64 = 1e-8;

/// Calls `found(q1, q2, q3, side, singular)` for each solution of `Z(q1) a Z(q2) b Z(q3) = wanted`, rotations alone. Where the outer axes
/// are in line, q1 is 0 and q3 does it all.
#[inline(always)]
pub fn wrist(a: &Frame, b: &Frame, wanted: &Frame, mut found: impl FnMut(f64, f64, f64, u8, bool)) {
    let ahead = third_row(a);
    let Some(points) = on_line(&Turned::new(ahead, b.axes[2]), wanted.axes[2][2], 1.0) else {
        return;
    };
    for ((c, s), side) in points.iter() {
        let middle = Frame { origin: [0.0; 3], ..*a }.turn_z(c, s).compose(b);
        // The third axis seen from the first, and the first from the third.
        let (axis, row) = (middle.axes[2], third_row(&middle));
        let (target, target_row) = (wanted.axes[2], third_row(wanted));
        let in_line = across(axis) <= IN_LINE * IN_LINE || across(target) <= IN_LINE * IN_LINE;
        let (q1, q3) = if in_line {
            // middle' wanted is the rotation about the third axis, but for q1 = 0.
            let x = middle.unrotate(wanted.axes[0]);
            (0.0, x[1].atan2(x[0]))
        } else {
            (angle_between(axis, target), angle_between(target_row, row))
        };
        found(q1, s.atan2(c), q3, side, in_line || points.tangent);
    }
}
