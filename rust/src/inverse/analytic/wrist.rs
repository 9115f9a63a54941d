//! Three axes through a point, turned to an orientation.

use super::circle::{Points, Watch, beside, on_line};
use super::structure::{Turned, across, angle_between, third_row};
use crate::linalg::frame::Frame;

/// Sine of the angle between the outer axes below which it is rounding: only the sum (or difference) of their angles is known then.
const IN_LINE: f64 = 1e-14;
/// The same below which the two solutions of a wrist count as meeting.
const NEARLY_IN_LINE: f64 = 1e-7;
/// How near to 1 the largest cosine between the outer axes has to be for the wrist to come in line at all.
const COMES_IN_LINE: f64 = 1e-9;

/// One solution of a wrist.
#[derive(Debug, Clone, Copy)]
pub struct Turns {
    /// Angles [rad].
    pub q: [f64; 3],
    /// Which of the two.
    pub side: u8,
    /// Whether they meet here.
    pub singular: bool,
    /// Whether only the sum or difference of the outer angles is known: the first is 0, but may be anything.
    pub free: bool,
}

/// Calls `found` for each solution of `Z(q1) a Z(q2) b Z(q3) = wanted`, rotations alone.
#[inline(always)]
pub fn wrist<W: Watch>(a: &Frame, b: &Frame, wanted: &Frame, watch: &mut W, mut found: impl FnMut(Turns)) {
    let line = Turned::new(third_row(a), b.axes[2]);
    let Some(points) = middle_turns(&line, wanted.axes[2][2], across(wanted.axes[2])) else {
        return;
    };
    watch.see(|| points.gap());
    for ((c, s), side, tangent) in points.iter() {
        let middle = Frame { origin: [0.0; 3], ..*a }.turn_z(c, s).compose(b);
        // The third axis seen from the first, and the first from the third.
        let (axis, row) = (middle.axes[2], third_row(&middle));
        let (target, target_row) = (wanted.axes[2], third_row(wanted));
        let least = across(axis).min(across(target));
        let free = least <= IN_LINE * IN_LINE;
        let (q1, q3) = if free {
            // middle' wanted is the rotation about the third axis, but for q1 = 0.
            let x = middle.unrotate(wanted.axes[0]);
            (0.0, x[1].atan2(x[0]))
        } else {
            (angle_between(axis, target), angle_between(target_row, row))
        };
        let singular = tangent || least <= NEARLY_IN_LINE * NEARLY_IN_LINE;
        found(Turns { q: [q1, s.atan2(c), q3], side, singular, free });
    }
}

/// Where `line` makes the cosine of the angle between two outer axes; `square` is the square of its sine. Near in line the cosine says
/// little, the sine all.
#[inline(always)]
pub fn middle_turns(line: &Turned, cosine: f64, square: f64) -> Option<Points> {
    let r = line.cosine.hypot(line.sine);
    let sense = cosine.signum();
    let peak = line.constant + sense * r;
    if square > 1e-4 || (1.0 - sense * peak).abs() > COMES_IN_LINE || r < COMES_IN_LINE {
        // In line, the outer joints may be chosen.
        return on_line(line, cosine, 1.0)
            .map(|points| Points { gap: if points.count > 0 { square.sqrt() } else { points.gap }, ..points });
    }
    let gap = square / ((1.0 + cosine.abs()) * r);
    let towards = (line.cosine / r, line.sine / r);
    let points = beside(towards, sense * (1.0 - gap), gap);
    // Both are told apart by the way they lean, however little.
    let apart = points.count == 2 || square <= IN_LINE * IN_LINE;
    let points = if apart { points } else { leaning(towards, sense, (2.0 * gap).sqrt()) };
    Some(Points { gap: square.sqrt(), size: 1.0, ..points })
}

/// The two points a small angle to either side of a unit vector (or of its opposite).
fn leaning((x, y): (f64, f64), sense: f64, angle: f64) -> Points {
    let (x, y) = (sense * x, sense * y);
    let at = [(x - angle * y, y + angle * x), (x + angle * y, y - angle * x), (0.0, 0.0), (0.0, 0.0)];
    Points { at, side: [0, 1, 0, 0], tangent: [true, true, false, false], count: 2, gap: 0.0, size: 1.0 }
}
