//! Loops on the way from one to another: complex links that change along a straight line, and how far a loop is from closing.

use super::start;
use crate::linalg::complex::Complex;
use crate::linalg::frame::Frame;
use crate::linalg::real::Real;

type C<R> = Complex<R>;
type Vec3<R> = [C<R>; 3];

/// Coefficients of x^3, x^5, ... of the sine, and of x^2, x^4, ... of the cosine, over the one before.
const SINE: [f64; 3] = [-1.0 / 6.0, -1.0 / 20.0, -1.0 / 42.0];
const COSINE: [f64; 4] = [-1.0 / 2.0, -1.0 / 12.0, -1.0 / 30.0, -1.0 / 56.0];

/// What a link is besides turns about z, which belong to the joints: a displacement and a turn about x, whose half has a cosine and a sine
/// that count up to a factor.
#[derive(Debug, Clone, Copy)]
struct Link {
    origin: [Complex; 3],
    half: [Complex; 2],
}

/// Links `start + t change`, t from 0 to 1.
#[derive(Debug, Clone)]
pub struct Line {
    start: [Link; 6],
    change: [Link; 6],
    /// What the joints of the line's end turn more than those of the loop it was made for [rad].
    pub offset: [f64; 6],
}

impl Line {
    /// From the loop whose solutions are known to a real one.
    pub fn to(links: &[Frame; 6]) -> Self {
        let mut offset = [0.0; 6];
        let start: [Link; 6] = start::LINKS.map(|(origin, half)| Link { origin, half });
        let change = std::array::from_fn(|i| {
            // Rz(before) Trans Rx(twist) Rz(after).
            let frame = &links[i];
            let axis = frame.axes[2];
            let before = if axis[0] == 0.0 && axis[1] == 0.0 { 0.0 } else { axis[0].atan2(-axis[1]) };
            let (s, c) = before.sin_cos();
            let twist = axis[0].hypot(axis[1]).atan2(axis[2]);
            let x = [c * frame.axes[0][0] + s * frame.axes[0][1], c * frame.axes[1][0] + s * frame.axes[1][1]];
            offset[i] += before;
            offset[(i + 1) % 6] += (-x[1]).atan2(x[0]);
            let [px, py, pz] = frame.origin;
            let origin = [c * px + s * py, c * py - s * px, pz];
            let half = [(0.5 * twist).cos(), (0.5 * twist).sin()];
            let away = |there: f64, here: Complex| Complex { re: there - here.re, im: -here.im };
            Link {
                origin: std::array::from_fn(|k| away(origin[k], start[i].origin[k])),
                half: std::array::from_fn(|k| away(half[k], start[i].half[k])),
            }
        });
        Self { start, change, offset }
    }
}

/// The cosine and the sine of a complex angle that steps from one place to the next.
#[derive(Debug, Clone, Copy)]
pub struct Turn<R> {
    pub cosine: C<R>,
    pub sine: C<R>,
}

impl<R: Real> Turn<R> {
    /// Turned on by a step of at most about half a radian.
    #[inline(always)]
    pub fn stepped(self, step: C<R>) -> Self {
        let square = step * step;
        let series = |coefficients: &[f64]| {
            coefficients.iter().rev().fold(C::real(R::splat(1.0)), |sum, k| C::real(R::splat(1.0)) + (square * sum).times(R::splat(*k)))
        };
        let (c, s) = (series(&COSINE), step * series(&SINE));
        let (cosine, sine) = (self.cosine * c - self.sine * s, self.cosine * s + self.sine * c);
        // Back to where the squares add to one.
        let excess = cosine * cosine + sine * sine;
        let factor = C::real(R::splat(1.5)) - excess.times(R::splat(0.5));
        Self { cosine: cosine * factor, sine: sine * factor }
    }
}

/// Newton's step for the loop and the direction in which its solution moves with t.
#[derive(Debug, Clone, Copy)]
pub struct Closure<R> {
    pub turns: [Turn<R>; 6],
    pub step: [C<R>; 6],
    pub tangent: [C<R>; 6],
}

/// `a x b`.
#[inline(always)]
fn cross<R: Real>(a: &Vec3<R>, b: &Vec3<R>) -> Vec3<R> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn sub<R: Real>(a: &Vec3<R>, b: &Vec3<R>) -> Vec3<R> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Turns two vectors within their plane.
#[inline(always)]
fn rotate<R: Real>(a: &mut Vec3<R>, b: &mut Vec3<R>, cosine: C<R>, sine: C<R>) {
    for k in 0..3 {
        (a[k], b[k]) = (cosine * a[k] + sine * b[k], cosine * b[k] - sine * a[k]);
    }
}

/// The loop at `t` with joints turned on by `steps`.
#[inline(always)]
pub fn closure<R: Real>(line: &Line, t: R, turns: &[Turn<R>; 6], steps: &[C<R>; 6]) -> Closure<R> {
    let one = C::real(R::splat(1.0));
    let (mut x, mut y, mut z, mut p) = ([C::ZERO; 3], [C::ZERO; 3], [C::ZERO; 3], [C::ZERO; 3]);
    (x[0], y[1], z[2]) = (one, one, one);
    let (mut axis, mut place) = ([[C::ZERO; 3]; 6], [[C::ZERO; 3]; 6]);
    let mut moved = *turns;
    // How the links' own change moves the end: displacements and turns, and the moments of the turns.
    let (mut shift, mut turning, mut moment) = ([C::ZERO; 3], [C::ZERO; 3], [C::ZERO; 3]);
    for i in 0..6 {
        (axis[i], place[i]) = (z, p);
        moved[i] = turns[i].stepped(steps[i]);
        rotate(&mut x, &mut y, moved[i].cosine, moved[i].sine);
        let (start, change) = (&line.start[i], &line.change[i]);
        let at = |a: Complex, b: Complex| C::splat(a) + C::splat(b).times(t);
        for (k, direction) in [x, y, z].iter().enumerate() {
            let along = at(start.origin[k], change.origin[k]);
            let growth = C::splat(change.origin[k]);
            for r in 0..3 {
                p[r] = p[r] + along * direction[r];
                shift[r] = shift[r] + growth * direction[r];
            }
        }
        let [c, s] = [0, 1].map(|k| at(start.half[k], change.half[k]));
        let over = (c * c + s * s).inverse();
        let rate = (c * C::splat(change.half[1]) - s * C::splat(change.half[0])) * over;
        let rate = rate + rate;
        let here = cross(&p, &x);
        for r in 0..3 {
            turning[r] = turning[r] + rate * x[r];
            moment[r] = moment[r] + rate * here[r];
        }
        let (cosine, sine) = ((c * c - s * s) * over, (c * s + c * s) * over);
        rotate(&mut y, &mut z, cosine, sine);
    }
    let carried = cross(&turning, &p);
    let half = R::splat(0.5);
    let mut system = [[C::ZERO; 8]; 6];
    let open = [(y[2] - z[1]).times(half), (z[0] - x[2]).times(half), (x[1] - y[0]).times(half)];
    for r in 0..3 {
        for i in 0..6 {
            system[r][i] = axis[i][r];
        }
        (system[r][6], system[r][7]) = (open[r], turning[r]);
        (system[3 + r][6], system[3 + r][7]) = (p[r], shift[r] + carried[r] + moment[r]);
    }
    for i in 0..6 {
        let arm = cross(&axis[i], &sub(&p, &place[i]));
        for r in 0..3 {
            system[3 + r][i] = arm[r];
        }
    }
    let [step, tangent] = solved(system);
    Closure { turns: moved, step: step.map(|z| -z), tangent: tangent.map(|z| -z) }
}

/// Both right-hand sides of six equations solved, by elimination with partial pivoting.
#[inline(always)]
fn solved<R: Real>(mut a: [[C<R>; 8]; 6]) -> [[C<R>; 6]; 2] {
    for k in 0..6 {
        for i in k + 1..6 {
            // The larger of two rows goes up, lane by lane.
            let (upper, lower) = (a[k][k].square(), a[i][k].square());
            let pick = |x: C<R>, y: C<R>| C { re: R::pick(upper, lower, x.re, y.re), im: R::pick(upper, lower, x.im, y.im) };
            for j in k..8 {
                let (u, l) = (a[k][j], a[i][j]);
                (a[k][j], a[i][j]) = (pick(l, u), pick(u, l));
            }
        }
        let inverse = a[k][k].inverse();
        for j in k + 1..8 {
            a[k][j] = a[k][j] * inverse;
        }
        for i in k + 1..6 {
            let factor = a[i][k];
            for j in k + 1..8 {
                a[i][j] = a[i][j] - factor * a[k][j];
            }
        }
    }
    let mut out = [[C::ZERO; 6]; 2];
    for (side, x) in out.iter_mut().enumerate() {
        for i in (0..6).rev() {
            x[i] = a[i][6 + side];
            for j in i + 1..6 {
                x[i] = x[i] - a[i][j] * x[j];
            }
        }
    }
    out
}
