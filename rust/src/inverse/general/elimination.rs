//! Elimination of three of the six angles of a closed chain (Raghavan and Roth, 1993): what remains is linear in the sines and cosines of
//! two joints, with coefficients that are affine in the cosine and sine of a third.

use crate::linalg::frame::Frame;
use crate::linalg::left_null::left_null_space;
use crate::linalg::vector::{Vec3, add, cross, dot, scale};

/// How many scalar equations the six vectors and scalars of [`Moments`] make.
pub const EQUATIONS: usize = 14;

/// How many of them are left once two joints are eliminated, and how many products of sines and cosines they hold.
pub const LEFT: usize = 6;

/// Products of (cos, sin, 1) of one joint and (cos, sin, 1) of another.
pub const PRODUCTS: usize = 9;

/// The line of a joint axis, by a point p and its direction l, and the functions of them whose equations add no new products of angles
/// (Raghavan and Roth's fourteen equations). A rigid motion acts on them linearly, so that sums of them mean what they say.
#[derive(Debug, Clone, Copy)]
pub struct Moments {
    /// The weight of the constant: one for a line, zero for the coefficient of a cosine or sine.
    one: f64,
    /// p . p and p . l.
    scalars: [f64; 2],
    /// p, l, p x l and (p . p) l - 2 (p . l) p.
    vectors: [Vec3; 4],
}

impl Moments {
    /// The z axis of a frame, seen from where the frame is given.
    pub fn axis(frame: &Frame) -> Self {
        let (p, l) = (frame.origin, frame.axes[2]);
        let (pp, pl) = (dot(p, p), dot(p, l));
        Self { one: 1.0, scalars: [pp, pl], vectors: [p, l, cross(p, l), add(scale(pp, l), scale(-2.0 * pl, p))] }
    }

    /// The same line after a rigid motion.
    pub fn moved(&self, motion: &Frame) -> Self {
        let t = motion.origin;
        let [p, l, m, r] = self.vectors.map(|v| motion.rotate(v));
        let (tt, pl) = (dot(t, t), self.scalars[1] + dot(t, l));
        Self {
            one: self.one,
            scalars: [self.scalars[0] + 2.0 * dot(t, p) + self.one * tt, pl],
            vectors: [
                add(p, scale(self.one, t)),
                l,
                add(m, cross(t, l)),
                add(add(r, scale(-2.0, cross(t, m))), add(scale(tt, l), scale(-2.0 * pl, t))),
            ],
        }
    }

    /// The coefficients of cos q, of sin q and of one after a turn by q about z.
    pub fn turned(&self) -> [Self; 3] {
        let part = |f: fn(Vec3) -> Vec3| Self { one: 0.0, scalars: [0.0; 2], vectors: self.vectors.map(f) };
        let fixed = Self { vectors: self.vectors.map(|v| [0.0, 0.0, v[2]]), ..*self };
        [part(|v| [v[0], v[1], 0.0]), part(|v| [-v[1], v[0], 0.0]), fixed]
    }

    /// What a turn about z leaves alone.
    pub fn axial(&self) -> [f64; 6] {
        let [p, l, m, r] = self.vectors;
        [p[2], l[2], m[2], r[2], self.scalars[0], self.scalars[1]]
    }

    /// The components across z, in pairs.
    pub fn planar(&self) -> [f64; 8] {
        let [p, l, m, r] = self.vectors;
        [p[0], p[1], l[0], l[1], m[0], m[1], r[0], r[1]]
    }

    /// All fourteen: axial, then planar.
    fn equations(&self) -> [f64; EQUATIONS] {
        let (axial, planar) = (self.axial(), self.planar());
        std::array::from_fn(|i| if i < 6 { axial[i] } else { planar[i - 6] })
    }
}

/// Coefficients of the six equations of two joints: the matrix is `constant + cos q cosine + sin q sine`, one row an equation, one column a
/// product; q is the hidden joint.
#[derive(Debug, Clone)]
pub struct Pencil {
    /// Without the hidden joint.
    pub constant: [[f64; PRODUCTS]; LEFT],
    /// Times its cosine.
    pub cosine: [[f64; PRODUCTS]; LEFT],
    /// Times its sine.
    pub sine: [[f64; PRODUCTS]; LEFT],
}

/// Coefficients of the products of two joints, in the order (cos, sin, 1) x (cos, sin, 1), of a line seen through both and three links.
fn seen_through(start: Moments, links: [&Frame; 2]) -> [Moments; PRODUCTS] {
    let once = start.turned().map(|m| m.moved(links[0]));
    let twice = once.map(|m| m.turned());
    std::array::from_fn(|i| twice[i % 3][i / 3].moved(links[1]))
}

/// The pencil in q3 for the products of q4 and q5: q6 is absent from the line of axis 6, q1 and q2 are eliminated by an orthogonal
/// decomposition of their constant coefficients.
pub fn eliminated(links: &[Frame; 6]) -> Pencil {
    let near = seen_through(Moments::axis(&links[4]), [&links[3], &links[2]]);
    let [l1, l2, l6] = [0, 1, 5].map(|i: usize| links[i].inverse());
    // Turning backwards only changes the sign of sines, which are eliminated whatever their sign.
    let far = seen_through(Moments::axis(&l6), [&l1, &l2]).map(|m| m.equations());
    let annihilator: [_; LEFT] = left_null_space::<EQUATIONS, 8, LEFT>(std::array::from_fn(|c| far[c]));
    let mut pencil = Pencil { constant: [[0.0; PRODUCTS]; LEFT], cosine: [[0.0; PRODUCTS]; LEFT], sine: [[0.0; PRODUCTS]; LEFT] };
    for (r, n) in annihilator.iter().enumerate() {
        for (c, moments) in near.iter().enumerate() {
            let (axial, planar) = (moments.axial(), moments.planar());
            pencil.constant[r][c] = (0..6).map(|i| n[i] * axial[i]).sum();
            for i in (0..8).step_by(2) {
                pencil.cosine[r][c] += n[6 + i] * planar[i] + n[7 + i] * planar[i + 1];
                pencil.sine[r][c] += n[7 + i] * planar[i] - n[6 + i] * planar[i + 1];
            }
        }
        pencil.constant[r][PRODUCTS - 1] -= (0..EQUATIONS).map(|i| n[i] * far[PRODUCTS - 1][i]).sum::<f64>();
    }
    pencil
}
