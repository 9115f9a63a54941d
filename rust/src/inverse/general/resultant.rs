//! The postures of a loop with one joint hidden: elimination leaves a determinant that is a trigonometric polynomial of the hidden angle, whose
//! real roots are found on the circle. Manocha and Canny (1994) solve the same matrix as an eigenvalue problem.

use super::closure::{polished, turned, twins};
use super::elimination::{Moments, Pencil, eliminated};
use super::polynomial::{Harmonics, MOST, Multiplicity, Root, SAMPLES, START};
use crate::linalg::frame::Frame;
use crate::linalg::lu::Lu;
use crate::linalg::vector::{Vec3, dot, norm, scale};
use std::f64::consts::TAU;

/// Harmonics that should vanish, over those that should not, above which a determinant tells nothing.
const NOISE: f64 = 1e-11;

/// How far Newton's method may lead from a root before the root counts as unexplained [rad].
const STRAY: f64 = 1e-4;

/// How far apart two solutions are that are not one [rad].
const DISTINCT: f64 = 1e-6;

/// Below this ratio, equations in the cosine and sine of an angle hold one combination of the two.
const ONE_COMBINATION: f64 = 1e-10;

/// How little the matrix of a double root may shrink a third direction.
const THIRD: f64 = 1e-3;

/// The first joint of each choice, and whether the chain runs backwards. The first hides joint 5 and the second joint 2, which serve the
/// robots whose axes 2 and 3 are parallel.
#[rustfmt::skip]
pub const CHOICES: [(usize, bool); 12] = [
    (0, true), (5, false), (2, false), (3, true), (1, false), (0, false),
    (3, false), (4, false), (1, true), (2, true), (4, true), (5, true),
];

/// The solutions with one choice of the hidden joint; whether none seems to be missing.
pub fn with_hidden(links: &[Frame; 6], (first, reversed): (usize, bool), found: &mut impl FnMut(&[f64; 6])) -> bool {
    let joint: [usize; 6] = std::array::from_fn(|i| if reversed { (first + 6 - i) % 6 } else { (first + i) % 6 });
    let chain = std::array::from_fn(|i| if reversed { backwards(&links[(joint[i] + 5) % 6]) } else { links[joint[i]] });
    one_joint_hidden(&chain, &mut |q| {
        let mut out = [0.0; 6];
        for i in 0..6 {
            out[joint[i]] = q[i];
        }
        found(&out);
    })
}

/// The inverse of a link between frames turned over, whose joints then turn as they did: inv(L) between half turns about x.
fn backwards(link: &Frame) -> Frame {
    let inverse = link.inverse();
    let over = |v: Vec3| [v[0], -v[1], -v[2]];
    let [x, y, z] = inverse.axes.map(over);
    Frame { axes: [x, scale(-1.0, y), scale(-1.0, z)], origin: over(inverse.origin) }
}

/// Solutions with q3 as the hidden joint; true when every root is accounted for, so that none is missing.
fn one_joint_hidden(links: &[Frame; 6], found: &mut impl FnMut(&[f64; 6])) -> bool {
    let pencil = eliminated(links);
    let samples: [f64; SAMPLES] = std::array::from_fn(|i| {
        let (s, c) = (START + TAU * i as f64 / SAMPLES as f64).sin_cos();
        Lu::new(matrix(&pencil, c, s)).determinant()
    });
    let determinant = Harmonics::new(&samples);
    if determinant.noise.is_nan() || determinant.noise > NOISE {
        return false;
    }
    let (mut roots, mut count) = ([Root { angle: 0.0, multiplicity: Multiplicity::Unknown }; MOST], 0);
    let mut clean = determinant.roots(&mut |root| {
        if count < MOST {
            roots[count] = Root { angle: root.angle + START, ..root };
            count += 1;
        }
    });
    clean &= count < MOST;
    for root in &roots[..count] {
        clean &= explained(links, &pencil, *root, found);
    }
    clean
}

/// The solutions at one root of the determinant; whether they are as many as the root is.
fn explained(links: &[Frame; 6], pencil: &Pencil, root: Root, found: &mut impl FnMut(&[f64; 6])) -> bool {
    let (s, c) = root.angle.sin_cos();
    let matrix = matrix(pencil, c, s);
    let factors = Lu::new(matrix);
    let mut first: Option<[f64; 6]> = None;
    let mut second = false;
    let mut try_angles = |(q4, q5): (f64, f64)| {
        completed(links, [root.angle, q4, q5], &mut |q| {
            let Some(q) = polished(links, q) else { return };
            found(&q);
            if (q[2] - root.angle).abs() < STRAY {
                match first {
                    None => first = Some(q),
                    Some(other) => second |= (0..6).any(|i| (q[i] - other[i]).sin().abs() > DISTINCT || (q[i] - other[i]).cos() < 0.0),
                }
            }
        });
    };
    if root.multiplicity == Multiplicity::Simple {
        try_angles(angles(&factors.null_vector()));
        return first.is_some();
    }
    let space = factors.null_vectors();
    try_angles(angles(&space[0]));
    for v in products_among(&space[0], &space[1]).into_iter().flatten() {
        try_angles(angles(&v));
    }
    let shrunk = |v: &[f64; 12]| (0..12).map(|r| (0..12).map(|i| matrix[r][i] * v[i]).sum::<f64>().abs()).fold(0.0, f64::max);
    // Two directions at a double root are two postures; one is one posture, singular, or two about to meet there.
    let enough = if shrunk(&space[1]) < THIRD {
        second && shrunk(&space[2]) > THIRD
    } else {
        for q in first.iter().flat_map(|q| twins(links, q)).flatten() {
            found(&q);
        }
        first.is_some()
    };
    root.multiplicity == Multiplicity::Double && enough
}

/// The vectors in the plane of two that are products of powers of tan(q4/2) with (cos, sin, 1) of q5, where two postures share the hidden
/// angle: shifting the powers by one scales such a vector, which is an eigenvalue problem of size two.
fn products_among(u: &[f64; 12], v: &[f64; 12]) -> [Option<[f64; 12]>; 2] {
    let gram = |a: &[f64], b: &[f64]| (0..9).map(|i| a[i] * b[i]).sum::<f64>();
    // With N the powers 0 to 2 and K the powers 1 to 3, each turned by an angle at which N is far from singular.
    let mut best = (0.0, [[0.0; 2]; 2]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (c, s) in [(1.0, 0.0), (half, half), (0.0, 1.0), (half, -half)] {
        let n: [[f64; 9]; 2] = [u, v].map(|w| std::array::from_fn(|i| c * w[i] + s * w[i + 3]));
        let k: [[f64; 9]; 2] = [u, v].map(|w| std::array::from_fn(|i| c * w[i + 3] - s * w[i]));
        let (a, b, d) = (gram(&n[0], &n[0]), gram(&n[0], &n[1]), gram(&n[1], &n[1]));
        let determinant = a * d - b * b;
        if determinant > best.0 {
            let column = |k: &[f64; 9]| {
                let (x, y) = (gram(&n[0], k), gram(&n[1], k));
                [(d * x - b * y) / determinant, (a * y - b * x) / determinant]
            };
            best = (determinant, [column(&k[0]), column(&k[1])]);
        }
    }
    let [[a, c], [b, d]] = best.1;
    let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
    let square = half * half + b * c;
    if !(best.0 > 0.0 && square >= 0.0) {
        return [None; 2];
    }
    [1.0, -1.0].map(|sign| {
        let value = mean + sign * square.sqrt();
        let (x, y) = if (value - a).abs() > (value - d).abs() { (b, value - a) } else { (value - d, c) };
        (x != 0.0 || y != 0.0).then(|| std::array::from_fn(|i| x * u[i] + y * v[i]))
    })
}

/// The six equations times the cosine and times the sine of half of q4: twelve equations linear in the products of the cubic monomials of
/// these two with (cos, sin, 1) of q5.
fn matrix(pencil: &Pencil, c: f64, s: f64) -> [[f64; 12]; 12] {
    let mut out = [[0.0; 12]; 12];
    for r in 0..6 {
        let e: [f64; 9] = std::array::from_fn(|i| pencil.constant[r][i] + c * pencil.cosine[r][i] + s * pencil.sine[r][i]);
        for i in 0..3 {
            let (cosine, sine, one) = (e[i], e[3 + i], e[6 + i]);
            let quadratic = [one + cosine, 2.0 * sine, one - cosine];
            for (k, coefficient) in quadratic.into_iter().enumerate() {
                out[r][3 * k + i] = coefficient;
                out[6 + r][3 * (k + 1) + i] = coefficient;
            }
        }
    }
    out
}

/// q4 and q5 from a null vector: the products of (C^3, C^2 S, C S^2, S^3), C and S of half of q4, with (cos, sin, 1) of q5.
fn angles(v: &[f64; 12]) -> (f64, f64) {
    let row = |k: usize| [v[3 * k], v[3 * k + 1], v[3 * k + 2]];
    let (high, low) = (norm(row(0)), norm(row(3)));
    let (pivot, next) = if high > low { (row(0), row(1)) } else { (row(3), row(2)) };
    let ratio = dot(pivot, next) / dot(pivot, pivot);
    let q4 = if high > low { 2.0 * ratio.atan2(1.0) } else { 2.0 * 1.0f64.atan2(ratio) };
    let sign = 1.0f64.copysign(pivot[2]);
    (q4, (sign * pivot[1]).atan2(sign * pivot[0]))
}

/// The other three angles, from what a turn of joint 1 leaves alone. That is linear in cos q2 and sin q2; where it holds only one
/// combination of the two, there are two values of q2.
fn completed(links: &[Frame; 6], [q3, q4, q5]: [f64; 3], found: &mut impl FnMut(&[f64; 6])) {
    let after = links[1].compose(&turned(q3, &links[2])).compose(&turned(q4, &links[3])).compose(&turned(q5, &links[4]));
    let back = links[5].inverse();
    let [cosine, sine, constant] = Moments::axis(&after).turned().map(|m| m.moved(&links[0]).axial());
    let target = Moments::axis(&back).axial();
    let (mut g, mut h) = ([0.0; 3], [0.0; 2]);
    for i in 0..6 {
        let missing = target[i] - constant[i];
        g = [g[0] + cosine[i] * cosine[i], g[1] + cosine[i] * sine[i], g[2] + sine[i] * sine[i]];
        h = [h[0] + cosine[i] * missing, h[1] + sine[i] * missing];
    }
    let mut finish = |q2: f64| {
        let (q1, q6) = ends(&links[0].compose(&turned(q2, &after)), &back);
        found(&[q1, q2, q3, q4, q5, q6]);
    };
    let (mean, half, skew) = (0.5 * (g[0] + g[2]), 0.5 * (g[0] - g[2]), g[1]);
    let spread = half.hypot(skew);
    if mean - spread > ONE_COMBINATION * mean {
        // Cramer's rule; the determinant is positive and the same for both.
        finish((g[0] * h[1] - g[1] * h[0]).atan2(g[2] * h[0] - g[1] * h[1]));
    } else {
        let direction = 0.5 * skew.atan2(half);
        let (s, c) = direction.sin_cos();
        let away = ((c * h[0] + s * h[1]) / (mean + spread)).clamp(-1.0, 1.0).acos();
        finish(direction + away);
        finish(direction - away);
    }
}

/// The turns before and after `arm` that make it `back`.
fn ends(arm: &Frame, back: &Frame) -> (f64, f64) {
    let (mut s, mut c) = (0.0, 0.0);
    for (w, b) in [(arm.origin, back.origin), (arm.axes[2], back.axes[2])] {
        s += w[0] * b[1] - w[1] * b[0];
        c += w[0] * b[0] + w[1] * b[1];
    }
    let first = s.atan2(c);
    let [x, y, _] = turned(first, arm).inverse().compose(back).axes;
    (first, (x[1] - y[0]).atan2(x[0] + y[1]))
}
