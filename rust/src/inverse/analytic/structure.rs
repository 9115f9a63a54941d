//! The loop that a chain of six revolute joints and its target form, and what in its geometry makes a closed form.

use crate::linalg::frame::Frame;
use crate::linalg::vector::{add, dot, norm, scale, sub};

/// `Z(q1) L1 Z(q2) L2 ... Z(q6) L6 = 1`, Z the rotation about z.
pub type Loop = [Frame; 6];

/// Axes this near to meeting (over the size of the robot) or to parallel [rad] count as such; the answers are polished on the true geometry.
pub const COINCIDENT: f64 = 1e-9;
/// Axes this near to parallel [rad] do not make a wrist.
const SLANTED: f64 = 1e-3;

/// Geometry that decides how the loop is solved. `first` is where the loop is entered, counted from 0: the joint that the closed form
/// calls joint 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Structure {
    /// Three neighbouring axes meet in a point; entered so that they are joints 4, 5 and 6, and the point is at `before` on the axis of
    /// joint 4 and at `after` on that of joint 6.
    Wrist {
        /// Entry.
        first: usize,
        /// Height of the wrist's centre on the fourth axis \[m\].
        before: f64,
        /// Height of the wrist's centre on the sixth axis \[m\].
        after: f64,
    },
    /// Three neighbouring axes are parallel; entered so that they are joints 2, 3 and 4.
    Parallel {
        /// Entry.
        first: usize,
    },
    /// Neither.
    General,
    /// Three joints slide: the others turn the tool, then these bring it where it has to be.
    Sliding,
}

/// The loop entered `first` joints later.
pub fn entered(links: &Loop, first: usize) -> Loop {
    std::array::from_fn(|i| links[(i + first) % 6])
}

/// Where the z axis of the parent frame meets that of `link`: heights on both; `None` if they pass or are parallel.
pub fn meeting(link: &Frame, size: f64) -> Option<(f64, f64)> {
    let axis = link.axes[2];
    let sine2 = axis[0] * axis[0] + axis[1] * axis[1];
    if sine2 < SLANTED * SLANTED {
        return None;
    }
    // The point origin + k axis nearest to the z axis.
    let k = -(axis[0] * link.origin[0] + axis[1] * link.origin[1]) / sine2;
    let point = add(link.origin, scale(k, axis));
    (point[0].hypot(point[1]) <= COINCIDENT * size).then_some((point[2], k))
}

impl Structure {
    /// How hard it is to solve, 0 to 2: what there is to choose from is taken by this.
    pub fn effort(self) -> u8 {
        match self {
            Self::Wrist { .. } | Self::Sliding => 0,
            Self::Parallel { .. } => 1,
            Self::General => 2,
        }
    }

    /// Of a loop whose last transform (the one with the target) may be anything.
    pub fn of(links: &Loop) -> Self {
        let size = links[..5].iter().map(|link| norm(link.origin)).sum::<f64>();
        // The usual place first: the hand.
        for (i, first) in [(3, 0), (0, 3), (1, 4), (2, 5)] {
            if let (Some((before, middle)), Some((other, after))) = (meeting(&links[i], size), meeting(&links[i + 1], size))
                && (middle - other).abs() <= COINCIDENT * size
            {
                return Self::Wrist { first, before, after };
            }
        }
        let parallel = |link: &Frame| link.axes[2][0].hypot(link.axes[2][1]) <= COINCIDENT;
        for i in [1, 0, 2, 3] {
            if parallel(&links[i]) && parallel(&links[i + 1]) {
                return Self::Parallel { first: (i + 5) % 6 };
            }
        }
        Self::General
    }
}

/// `a' Z(q) b` is `constant + cosine cos q + sine sin q`.
#[derive(Debug, Clone, Copy)]
pub struct Turned {
    /// Part that does not turn.
    pub constant: f64,
    /// Factor of the cosine.
    pub cosine: f64,
    /// Factor of the sine.
    pub sine: f64,
}

impl Turned {
    /// Of two vectors.
    #[inline(always)]
    pub fn new(a: [f64; 3], b: [f64; 3]) -> Self {
        Self { constant: a[2] * b[2], cosine: a[0] * b[0] + a[1] * b[1], sine: a[1] * b[0] - a[0] * b[1] }
    }
}

/// A point of this frame in the parent frame.
#[inline(always)]
pub fn point(frame: &Frame, a: [f64; 3]) -> [f64; 3] {
    add(frame.origin, frame.rotate(a))
}

/// A point of the parent frame in this frame.
#[inline(always)]
pub fn unpoint(frame: &Frame, a: [f64; 3]) -> [f64; 3] {
    frame.unrotate(sub(a, frame.origin))
}

/// A vector turned about z.
#[inline(always)]
pub fn turned(cosine: f64, sine: f64, a: [f64; 3]) -> [f64; 3] {
    [cosine * a[0] - sine * a[1], sine * a[0] + cosine * a[1], a[2]]
}

/// Third row of the rotation: the parent's z axis in this frame.
#[inline(always)]
pub fn third_row(frame: &Frame) -> [f64; 3] {
    [frame.axes[0][2], frame.axes[1][2], frame.axes[2][2]]
}

/// The angle from the first to the second of two vectors, seen along z.
#[inline(always)]
pub fn angle_between(from: [f64; 3], to: [f64; 3]) -> f64 {
    (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1])
}

/// Cosine and sine of an angle.
pub type Turn = (f64, f64);

/// The turn about z from the first to the second of two vectors; none where one of them is along z.
#[inline(always)]
pub fn turn_between(from: [f64; 3], to: [f64; 3]) -> Turn {
    let (c, s) = (from[0] * to[0] + from[1] * to[1], from[0] * to[1] - from[1] * to[0]);
    let r = (c * c + s * s).sqrt();
    if r > 0.0 { (c / r, s / r) } else { (1.0, 0.0) }
}

/// Its angle [rad].
#[inline(always)]
pub fn angle_of((cosine, sine): Turn) -> f64 {
    sine.atan2(cosine)
}

/// Square of the part of a vector across z.
#[inline(always)]
pub fn across(a: [f64; 3]) -> f64 {
    a[0] * a[0] + a[1] * a[1]
}

/// `a . a`.
#[inline(always)]
pub fn square(a: [f64; 3]) -> f64 {
    dot(a, a)
}
