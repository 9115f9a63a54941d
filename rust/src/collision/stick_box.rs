//! Nearest points of a segment and a box, in closed form.
//!
//! Half the derivative of the squared distance along the segment is a sum of ramps: it grows with the parameter, piecewise linearly, with
//! bends where the segment passes the planes of the faces. Its zero lies between two of at most eight bends.

use crate::linalg::vector::{Vec3, add, scale};

/// How far a coordinate is beyond [-h, h], signed.
#[inline]
fn beyond(x: f64, h: f64) -> f64 {
    x - x.clamp(-h, h)
}

/// The nearest points of the segment `c + t u`, t in [-1, 1] (a point for u zero), and of the box of half extents `half`, both in the
/// frame of the box: on the segment, on the box. They coincide where both meet. Of a segment parallel to a face, those in the middle.
#[inline]
pub(super) fn nearest_of_stick_and_box(c: Vec3, u: Vec3, half: Vec3) -> [Vec3; 2] {
    let slope = |t: f64| (0..3).map(|i| u[i] * beyond(c[i] + t * u[i], half[i])).sum::<f64>();
    let mut bends = [1.0; 8];
    (bends[0], bends[1]) = (-1.0, 1.0);
    let mut count = 2;
    for i in 0..3 {
        for face in [-half[i], half[i]] {
            let t = (face - c[i]) / u[i];
            if t.abs() < 1.0 {
                bends[count] = t;
                count += 1;
            }
        }
    }
    let bends = &mut bends[..count];
    bends.sort_unstable_by(f64::total_cmp);
    // From below the first bend at which the slope is not negative, from above the last at which it is not positive.
    let t = match (bends.iter().position(|t| slope(*t) >= 0.0), bends.iter().rposition(|t| slope(*t) <= 0.0)) {
        (None, _) => 1.0,
        (_, None) => -1.0,
        (Some(first), Some(last)) if first <= last => 0.5 * (bends[first] + bends[last]),
        (Some(above), Some(below)) => {
            let (low, high) = (slope(bends[below]), slope(bends[above]));
            bends[below] + (bends[above] - bends[below]) * (low / (low - high))
        }
    };
    let point = add(c, scale(t, u));
    [point, std::array::from_fn(|i| point[i].clamp(-half[i], half[i]))]
}
