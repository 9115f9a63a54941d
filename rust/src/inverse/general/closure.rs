//! Newton's method on a closed loop of six joints.

use crate::linalg::frame::Frame;
use crate::linalg::vector::{cross, sub};

use crate::linalg::damped::damped_step;
use crate::linalg::lu::Lu;

/// What a closed loop may miss by, in rad and in the unit of its lengths.
const CLOSED: f64 = 1e-10;

/// Where nothing is left to gain.
const EXACT: f64 = 1e-15;

/// How far from a fold the search for the solutions on its sides starts [rad].
const FOLD: f64 = 1e-4;

/// Smallest over largest pivot of the Jacobian above which a solution is isolated.
const SINGULAR: f64 = 1e-5;

/// How far along a continuum its next solution is looked for [rad].
const AWAY: f64 = 0.02;

/// The most steps, and the longest [rad]: near a singularity only half a digit is won a step.
const STEPS: usize = 16;
const LONGEST_STEP: f64 = 0.3;

/// Z(q) L.
pub fn turned(q: f64, link: &Frame) -> Frame {
    let (s, c) = q.sin_cos();
    Frame::IDENTITY.turn_z(c, s).compose(link)
}

/// The best of Newton's steps from `q`; `None` where the loop does not close.
pub fn polished(links: &[Frame; 6], q: &[f64; 6]) -> Option<[f64; 6]> {
    let mut q = *q;
    let mut best = (f64::INFINITY, q);
    for _ in 0..STEPS {
        let (error, jacobian) = closure(links, &q);
        let size = error.iter().map(|x| x * x).sum::<f64>().sqrt();
        if size >= best.0 && best.0 < CLOSED {
            break;
        }
        if size < best.0 {
            best = (size, q);
        }
        if size < EXACT {
            break;
        }
        let step = Lu::new(jacobian).solve(&error, 1e-14);
        let length = step.iter().map(|x| x * x).sum::<f64>().sqrt();
        let shorter = (LONGEST_STEP / length).min(1.0);
        for i in 0..6 {
            q[i] -= shorter * step[i];
        }
    }
    (best.0 < CLOSED).then_some(best.1)
}

/// The solutions on both sides of one that is nearly singular: Newton's method from either side of a fold ends on that side.
pub fn twins(links: &[Frame; 6], q: &[f64; 6]) -> [Option<[f64; 6]>; 2] {
    let along = Lu::new(closure(links, q).1).null_vector();
    [FOLD, -FOLD].map(|step| polished(links, &std::array::from_fn(|i| q[i] + step * along[i])))
}

/// Smallest over largest pivot of the Jacobian.
pub fn spread(links: &[Frame; 6], q: &[f64; 6]) -> f64 {
    Lu::new(closure(links, q).1).spread()
}

/// Whether a solution is one of a continuum: the loop closes a little way along the direction that the Jacobian does not see, too.
pub fn moves_on(links: &[Frame; 6], q: &[f64; 6]) -> bool {
    let factors = Lu::new(closure(links, q).1);
    if factors.spread() > SINGULAR {
        return false;
    }
    let along = factors.null_vector();
    let mut there: [f64; 6] = std::array::from_fn(|i| q[i] + AWAY * along[i]);
    for _ in 0..STEPS {
        let (error, jacobian) = closure(links, &there);
        let step = damped_step::<6>(&jacobian, &error, 1e-13, 6, 6);
        there = std::array::from_fn(|i| there[i] - step[i]);
    }
    let (error, _) = closure(links, &there);
    let gone: f64 = (0..6).map(|i| (there[i] - q[i]) * along[i]).sum();
    error.iter().all(|x| x.abs() < CLOSED) && gone > 0.5 * AWAY
}

/// By how much a loop does not close, as a small rotation and a displacement, and its derivatives, one column a joint.
fn closure(links: &[Frame; 6], q: &[f64; 6]) -> ([f64; 6], [[f64; 6]; 6]) {
    let mut frame = Frame::IDENTITY;
    let mut axes = [frame; 6];
    for i in 0..6 {
        axes[i] = frame;
        let (s, c) = q[i].sin_cos();
        frame = frame.turn_z(c, s).compose(&links[i]);
    }
    let [x, y, z] = frame.axes;
    let turn = [0.5 * (y[2] - z[1]), 0.5 * (z[0] - x[2]), 0.5 * (x[1] - y[0])];
    // The sine of half a turn vanishes too: its cosine tells them apart.
    let flipped = if x[0] + y[1] + z[2] < 0.0 { 1.0 } else { 0.0 };
    let mut jacobian = [[0.0; 6]; 6];
    for i in 0..6 {
        let axis = axes[i].axes[2];
        let arm = cross(axis, sub(frame.origin, axes[i].origin));
        for r in 0..3 {
            jacobian[r][i] = axis[r];
            jacobian[3 + r][i] = arm[r];
        }
    }
    let t = frame.origin;
    ([turn[0] + flipped, turn[1], turn[2], t[0], t[1], t[2]], jacobian)
}
