//! Arms that nearly have a closed form, as calibrated ones do: its postures are carried over to the arm by Newton's method, several side by side.

use super::solutions::{MAX_SOLUTIONS, Solutions};
use super::structure::Loop;
use crate::kinematics::sized::jacobian_of;
use crate::linalg::frame::{Frame, exact_sin_cos};
use crate::linalg::orthogonal::{Orthogonal, dot};
use crate::linalg::real::{Lanes, Real};
use crate::linalg::vector::{cross, norm, sub};
use crate::robot::Robot;
use std::f64::consts::FRAC_PI_2;

/// Angles this near to multiples of a right one \[rad\], and offsets this small over the size of the arm, are meant to be that.
const MEANT: f64 = 2e-3;
/// Steps below this [rad] end Newton's method: the next would be about its square.
const ENDED: f64 = 1e-6;
/// Steps at most, and how far from where it started a posture may end [rad].
const STEPS: usize = 6;
const STRAY: f64 = 0.2;

/// The loop that an arm was meant to be, and how far it is from that \[rad, and over its size\]: twists next to multiples of a right angle and
/// offsets next to none are these. The last link, with the target, stays.
pub fn as_meant(links: &Loop) -> (Loop, f64) {
    let size = links[..5].iter().map(|link| norm(link.origin)).sum::<f64>();
    let (mut meant, mut off) = (*links, 0.0);
    for (link, is) in meant.iter_mut().zip(links).take(5) {
        *link = link_as_meant(is, MEANT * size);
        let turn: f64 = (0..3).map(|k| norm(sub(link.axes[k], is.axes[k]))).fold(0.0, f64::max);
        off += turn + norm(sub(link.origin, is.origin)) / size;
    }
    (meant, off)
}

/// One link as `Rz Trans Rx Trans Rz`, its numbers rounded to what they were meant to be.
fn link_as_meant(link: &Frame, short: f64) -> Frame {
    let axis = link.axes[2];
    let sine = axis[0].hypot(axis[1]);
    let twist = sine.atan2(axis[2]);
    let quarters = twist / FRAC_PI_2;
    let straight = (quarters - quarters.round()).abs() * FRAC_PI_2 <= MEANT;
    let twist = if straight { quarters.round() * FRAC_PI_2 } else { twist };
    let before = if sine > 0.0 { axis[0].atan2(-axis[1]) } else { 0.0 };
    let about = |angle: f64| {
        let (s, c) = exact_sin_cos(angle);
        Frame::IDENTITY.turn_z(c, s)
    };
    let turned = about(-before).compose(link);
    let [x, y, z] = turned.origin;
    let (s, c) = exact_sin_cos(twist);
    let round = |length: f64| if length.abs() <= short { 0.0 } else { length };
    // Across the twist's axis, what is left of y is a slide along the next axis, unless that is parallel to this one.
    let origin = if s.abs() > MEANT {
        let slide = -y / s;
        let (a, slide) = (round(x), round(slide));
        [a, -slide * s, round(z - slide * c) + slide * c]
    } else {
        [if x.hypot(y) <= short { 0.0 } else { x }, if x.hypot(y) <= short { 0.0 } else { y }, round(z)]
    };
    let bent = Frame { axes: [[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]], origin };
    let x = bent.unrotate(turned.axes[0]);
    about(before).compose(&bent).compose(&about(x[1].atan2(x[0])))
}

/// How postures got from a nearby arm to this one.
#[derive(Debug, Clone, Copy)]
pub struct Carried {
    /// The largest error of the pose that one started with \[rad, m over `length`\].
    pub error: f64,
    /// How far one went at most \[rad\].
    pub way: f64,
}

/// Moves postures of a nearby arm to where this one has its tool at the target; `None` if one of them does not get there.
pub fn carried_over(robot: &Robot, target: &Frame, length: f64, found: &mut Solutions) -> Option<Carried> {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has been asked.
        return unsafe { carried_over_avx2(robot, target, length, found) };
    }
    side_by_side(robot, target, length, found)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn carried_over_avx2(robot: &Robot, target: &Frame, length: f64, found: &mut Solutions) -> Option<Carried> {
    side_by_side(robot, target, length, found)
}

#[inline(always)]
fn side_by_side(robot: &Robot, target: &Frame, length: f64, found: &mut Solutions) -> Option<Carried> {
    let mut all = Carried { error: 0.0, way: 0.0 };
    for first in (0..found.count).step_by(Lanes::LANES) {
        // Lanes to spare repeat the last posture.
        let row = |lane: usize| (first + lane).min(found.count - 1).min(MAX_SOLUTIONS - 1);
        let start: [Lanes; 6] = std::array::from_fn(|k| Lanes::from_lanes(|lane| found.q[row(lane)][k]));
        let (q, error, gone) = newton(robot, &Frame::splat(target), Lanes::splat(1.0 / length), start)?;
        for lane in 0..Lanes::LANES {
            found.q[row(lane)] = std::array::from_fn(|k| q[k].lane(lane));
            all.error = all.error.max(error.lane(lane).sqrt());
            all.way = all.way.max(gone.lane(lane).sqrt());
        }
    }
    Some(all)
}

/// Newton's method on the full pose, and the squares of the error that it started with and of how far it went; `None` where it does not converge
/// nearby.
#[inline(always)]
fn newton<R: Real>(robot: &Robot, target: &Frame<R>, over_length: R, start: [R; 6]) -> Option<([R; 6], R, R)> {
    let (mut q, stray) = (start, R::splat(STRAY * STRAY));
    let mut factors = Orthogonal::<6, R>::blank();
    let mut first = None;
    for _ in 0..STEPS {
        let (tool, columns) = jacobian_of::<6, R>(robot, &q);
        let mut motion = [R::ZERO; 6];
        for axis in 0..3 {
            let turn = cross(tool.axes[axis], target.axes[axis]);
            for r in 0..3 {
                motion[r] += R::splat(0.5) * turn[r];
            }
        }
        let mut rows = [[R::ZERO; 6]; 6];
        for r in 0..3 {
            motion[r + 3] = (target.origin[r] - tool.origin[r]) * over_length;
            for i in 0..6 {
                rows[r][i] = columns.w[i][r];
                rows[r + 3][i] = columns.v[i][r] * over_length;
            }
        }
        let error = *first.get_or_insert(dot(&motion, &motion));
        factors.factor(&rows, 6, 6);
        let step = factors.solve(&motion);
        let mut gone = R::ZERO;
        for i in 0..6 {
            q[i] += step[i];
            gone += (q[i] - start[i]) * (q[i] - start[i]);
        }
        // Also what is not a number is far away.
        if !all_less(gone, stray) {
            return None;
        }
        if all_less(dot(&step, &step), R::splat(ENDED * ENDED)) {
            return Some((q, error, gone));
        }
    }
    None
}

/// Whether a < b in every lane.
#[inline(always)]
fn all_less<R: Real>(a: R, b: R) -> bool {
    (0..R::LANES).all(|i| a.lane(i) < b.lane(i))
}
