//! Points of the unit circle, (cos q, sin q), on a line or on a conic.

use super::structure::Turned;

/// A point of the circle.
pub type Point = (f64, f64);

/// A line may miss the circle by this much, relative to its coefficients: a target on the very edge of the reach is rounded to either side.
const TOUCHING: f64 = 1e-10;
/// Half chords below this are rounding of a tangent: both points are one, and the error of joining them is its square.
const TANGENT: f64 = 1.5e-7;

/// At most four points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Points {
    /// The points.
    pub at: [Point; 4],
    /// Which of the solutions each one is: the same along a continuous motion of the line.
    pub side: [u8; 4],
    /// Whether the curve touches the circle there: two solutions in one, where branches meet.
    pub tangent: [bool; 4],
    /// How many there are.
    pub count: usize,
    /// How much the line or curve may change before points come that are not there now, or all of the circle fulfils it; over `size`.
    pub gap: f64,
    /// The size of what it is the sum of.
    pub size: f64,
}

/// Whether a closed form keeps the smallest gap that it sees on its way: how much the arm may change, relative to its size, before solutions come.
pub trait Watch {
    /// Nothing seen yet.
    fn new() -> Self;
    /// Sees one.
    fn see(&mut self, gap: impl FnOnce() -> f64);
    /// Sees what another one saw.
    fn join(&mut self, other: Self);
}

/// Keeps none: gaps are not even computed.
pub struct Blind;

impl Watch for Blind {
    #[inline(always)]
    fn new() -> Self {
        Self
    }

    #[inline(always)]
    fn see(&mut self, _: impl FnOnce() -> f64) {}

    #[inline(always)]
    fn join(&mut self, _: Self) {}
}

impl Watch for f64 {
    #[inline(always)]
    fn new() -> Self {
        Self::INFINITY
    }

    #[inline(always)]
    fn see(&mut self, gap: impl FnOnce() -> f64) {
        *self = self.min(gap());
    }

    #[inline(always)]
    fn join(&mut self, other: Self) {
        *self = self.min(other);
    }
}

impl Points {
    fn push(&mut self, point: Point, side: u8, tangent: bool) {
        if self.count < 4 {
            (self.at[self.count], self.side[self.count], self.tangent[self.count]) = (point, side, tangent);
            self.count += 1;
        }
    }

    /// What a [`Watch`] sees.
    #[inline(always)]
    pub fn gap(&self) -> f64 {
        self.gap / self.size
    }

    /// The points, their sides and whether each is a tangent's.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (Point, u8, bool)> + '_ {
        (0..self.count).map(|i| (self.at[i], self.side[i], self.tangent[i]))
    }
}

/// Where `line.constant + line.cosine c + line.sine s = value`; `None` when every point of the circle is (or none can be told).
#[inline(always)]
pub fn on_line(line: &Turned, value: f64, scale: f64) -> Option<Points> {
    let (a, b, rest) = (line.cosine, line.sine, value - line.constant);
    let r2 = a * a + b * b;
    if r2 <= (TOUCHING * scale) * (TOUCHING * scale) {
        return None;
    }
    let r = r2.sqrt();
    // On the line, at the foot of the perpendicular and half a chord to either side.
    let foot = rest / r;
    if foot.abs() > 1.0 + TOUCHING {
        return Some(Points { gap: (foot.abs() - 1.0) * r, size: scale, ..Points::default() });
    }
    Some(Points { gap: r, size: scale, ..beside((a / r, b / r), foot, 1.0 - foot.abs()) })
}

/// A turn at which `line` lies between two values: none if that will do, else one well inside.
pub fn turn_between_values(line: &Turned, least: f64, most: f64) -> Point {
    let r = line.cosine.hypot(line.sine);
    if (least..=most).contains(&(line.constant + line.cosine)) {
        return (1.0, 0.0);
    }
    let wanted = 0.5 * (least.max(line.constant - r) + most.min(line.constant + r));
    on_line(line, wanted, r).and_then(|points| points.iter().next()).map_or((1.0, 0.0), |(turn, ..)| turn)
}

/// The two points of the circle at `foot` along a unit vector, `gap` short of its end; one where they are rounding apart.
#[inline(always)]
pub fn beside((x, y): Point, foot: f64, gap: f64) -> Points {
    let mut points = Points::default();
    let half = (gap * (2.0 - gap)).max(0.0).sqrt();
    if half <= TANGENT {
        let sign = foot.signum();
        points.push((sign * x, sign * y), 0, true);
    } else {
        points.push((foot * x - half * y, foot * y + half * x), 0, false);
        points.push((foot * x + half * y, foot * y - half * x), 1, false);
    }
    points
}

/// `k[0] + k[1] c + k[2] s + k[3] c^2 + k[4] c s + k[5] s^2`.
pub type Conic = [f64; 6];

/// Sum of two linear functions of (1, c, s), multiplied.
pub fn product(f: [f64; 3], g: [f64; 3]) -> Conic {
    [f[0] * g[0], f[0] * g[1] + f[1] * g[0], f[0] * g[2] + f[2] * g[0], f[1] * g[1], f[1] * g[2] + f[2] * g[1], f[2] * g[2]]
}

/// Largest coefficient of several conics.
pub fn magnitude(conics: &[Conic]) -> f64 {
    conics.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()))
}

/// Roots of the quartic this near to the unit circle (relative) may be real angles: double roots split by the square root of rounding.
const NEAR: f64 = 1e-2;
/// What the conic may miss zero by at an angle, relative to its coefficients.
const ZERO: f64 = 1e-9;
/// The same where it touches zero, relative to what it is the sum of.
const TOUCHED: f64 = 1.4e-14;
/// Newton steps of a polish, and how far they may lead [rad].
const STEPS: usize = 6;
const STRAY: f64 = 0.05;
/// Rounds of the simultaneous iteration; it converges cubically from points spread on a circle.
const ROUNDS: usize = 40;

/// Where a conic meets the circle; `None` when it vanishes on all of it. `magnitude` is that of the terms whose sum it is: it tells what is
/// rounding.
pub fn on_conic(k: &Conic, magnitude: f64) -> Option<Points> {
    // As a trigonometric polynomial: a0 + a1 cos q + b1 sin q + a2 cos 2q + b2 sin 2q.
    let (a0, a1, b1, a2, b2) = (k[0] + 0.5 * (k[3] + k[5]), k[1], k[2], 0.5 * (k[3] - k[5]), 0.5 * k[4]);
    let scale = a0.abs() + a1.abs() + b1.abs() + a2.abs() + b2.abs();
    if !(scale > 1e-14 * magnitude && scale.is_finite()) {
        return None;
    }
    if a2.abs() + b2.abs() <= 1e-14 * scale {
        return on_line(&Turned { constant: a0, cosine: a1, sine: b1 }, 0.0, scale);
    }
    let f = |q: f64| {
        let (s, c) = q.sin_cos();
        let (s2, c2) = (2.0 * s * c, c * c - s * s);
        let slope = b1 * c - a1 * s + 2.0 * (b2 * c2 - a2 * s2);
        [a0 + a1 * c + b1 * s + a2 * c2 + b2 * s2, slope, -(a1 * c + b1 * s) - 4.0 * (a2 * c2 + b2 * s2)]
    };
    let mut points = Points { gap: 1.0, ..Points::default() };
    for z in quartic_roots([(0.5 * a2, 0.5 * b2), (0.5 * a1, 0.5 * b1), (a0, 0.0), (0.5 * a1, -0.5 * b1), (0.5 * a2, -0.5 * b2)]) {
        let modulus = z.0.hypot(z.1);
        if (modulus - 1.0).abs() > NEAR {
            points.gap = points.gap.min(0.5 * (modulus - 1.0).powi(2));
            continue;
        }
        let start = z.1.atan2(z.0);
        // Where two roots have met the slope has one that is told sharply; else the root itself.
        let touching = polished(&f, start, 1).filter(|q| f(*q)[0].abs() <= TOUCHED * magnitude);
        let angle = touching.or_else(|| polished(&f, start, 0).filter(|q| f(*q)[0].abs() <= ZERO * scale));
        if angle.is_none() {
            points.gap = points.gap.min(0.5 * (modulus - 1.0).powi(2));
        }
        if let Some(angle) = angle {
            let (s, c) = angle.sin_cos();
            let twin = points.iter().position(|((x, y), ..)| (x - c).abs() + (y - s).abs() <= TANGENT);
            match twin {
                Some(twin) => points.tangent[twin] = true,
                None => points.push((c, s), points.count as u8, false),
            }
        }
    }
    (points.gap, points.size) = (points.gap * scale, magnitude);
    Some(points)
}

/// Newton's method for a root of derivative `order` (0 or 1); `None` where it leads far away.
fn polished(f: &impl Fn(f64) -> [f64; 3], start: f64, order: usize) -> Option<f64> {
    let (mut angle, mut best) = (start, (f64::INFINITY, start));
    for _ in 0..STEPS {
        let at = f(angle);
        if at[order].abs() < best.0 {
            best = (at[order].abs(), angle);
        }
        let step = at[order] / at[order + 1];
        if !step.is_finite() || step.abs() < 1e-17 {
            break;
        }
        angle -= step.clamp(-0.1, 0.1);
    }
    let angle = best.1;
    ((angle - start).abs() <= STRAY).then_some(angle)
}

type Complex = (f64, f64);

#[inline(always)]
fn times(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

#[inline(always)]
fn over(a: Complex, b: Complex) -> Complex {
    let d = b.0 * b.0 + b.1 * b.1;
    ((a.0 * b.0 + a.1 * b.1) / d, (a.1 * b.0 - a.0 * b.1) / d)
}

/// The roots of `c[0] + c[1] z + ... + c[4] z^4`, all at once (Aberth 1973).
fn quartic_roots(c: [Complex; 5]) -> [Complex; 4] {
    // Starting points off every symmetry of a self-reciprocal polynomial.
    let mut z: [Complex; 4] = [(1.03, 0.31), (-0.42, 0.97), (-0.88, -0.55), (0.37, -0.91)];
    for _ in 0..ROUNDS {
        let mut largest = 0.0f64;
        for i in 0..4 {
            let (mut p, mut slope) = (c[4], (0.0, 0.0));
            for k in (0..4).rev() {
                slope = times(slope, z[i]);
                slope = (slope.0 + p.0, slope.1 + p.1);
                p = times(p, z[i]);
                p = (p.0 + c[k].0, p.1 + c[k].1);
            }
            if p == (0.0, 0.0) {
                continue;
            }
            let newton = over(p, slope);
            let mut repulsion = (0.0, 0.0);
            for j in 0..4 {
                if j != i {
                    let part = over((1.0, 0.0), (z[i].0 - z[j].0, z[i].1 - z[j].1));
                    repulsion = (repulsion.0 + part.0, repulsion.1 + part.1);
                }
            }
            let product = times(newton, repulsion);
            let step = over(newton, (1.0 - product.0, -product.1));
            if step.0.is_finite() && step.1.is_finite() {
                z[i] = (z[i].0 - step.0, z[i].1 - step.1);
                largest = largest.max(step.0.abs() + step.1.abs());
            }
        }
        if largest < 1e-13 {
            break;
        }
    }
    z
}

/// Where `a x + b y = e` with x and y on unit circles; pairs (x, y) with the side of each, at most four. `None` when there is a continuum.
pub fn on_two_circles(a: [[f64; 2]; 2], b: [[f64; 2]; 2], e: [f64; 2]) -> Option<Pairs> {
    // A row that speaks of x alone comes first: two lines, each with two points, instead of a quartic.
    if let Some(weights) = annihilator(&b) {
        return lines(weights, a, b, e);
    }
    if let Some(weights) = annihilator(&a) {
        return lines(weights, b, a, e).map(Pairs::swapped);
    }
    // x = a^-1 (e - b y) on the unit circle: a conic in y.
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    let solved = |r0: f64, r1: f64| [(a[1][1] * r0 - a[0][1] * r1) / det, (a[0][0] * r1 - a[1][0] * r0) / det];
    let constant = solved(e[0], e[1]);
    let cosine = solved(-b[0][0], -b[1][0]);
    let sine = solved(-b[0][1], -b[1][1]);
    let x = |i: usize| [constant[i], cosine[i], sine[i]];
    let (first, second) = (product(x(0), x(0)), product(x(1), x(1)));
    let mut conic: Conic = std::array::from_fn(|i| first[i] + second[i]);
    conic[0] -= 1.0;
    let points = on_conic(&conic, magnitude(&[first, second]).max(1.0))?;
    let mut pairs = Pairs { gap: points.gap(), ..Pairs::default() };
    for ((c, s), side, tangent) in points.iter() {
        let at = |i: usize| constant[i] + c * cosine[i] + s * sine[i];
        let r = at(0).hypot(at(1));
        pairs.push((at(0) / r, at(1) / r), (c, s), side, tangent);
    }
    Some(pairs)
}

/// Solutions on two circles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pairs {
    /// x, y, which solution each one is, and whether it is two in one.
    pub at: [(Point, Point, u8, bool); 4],
    /// How many there are.
    pub count: usize,
    /// The smallest gap, as [`Watch`] has it.
    pub gap: f64,
}

impl Pairs {
    fn push(&mut self, x: Point, y: Point, side: u8, tangent: bool) {
        if self.count < 4 {
            self.at[self.count] = (x, y, side, tangent);
            self.count += 1;
        }
    }

    fn swapped(mut self) -> Self {
        for (x, y, ..) in &mut self.at {
            std::mem::swap(x, y);
        }
        self
    }
}

/// Unit weights of the rows that make their sum vanish, for a matrix of rank one; rank zero answers `None` too and leads to a continuum.
fn annihilator(m: &[[f64; 2]; 2]) -> Option<[f64; 2]> {
    let sizes = m.map(|row| row[0].hypot(row[1]));
    let largest = sizes[0].max(sizes[1]);
    let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    if largest > 0.0 && det.abs() > 1e-10 * largest * largest {
        return None;
    }
    // The larger row cancels the smaller one.
    let (i, j) = if sizes[0] >= sizes[1] { (0, 1) } else { (1, 0) };
    let share = if largest > 0.0 { (m[i][0] * m[j][0] + m[i][1] * m[j][1]) / (largest * largest) } else { 0.0 };
    let mut weights = [0.0; 2];
    (weights[j], weights[i]) = (1.0, -share);
    Some(weights)
}

/// First the combination of the rows that speaks of x alone, then the row that knows most of y.
fn lines(weights: [f64; 2], a: [[f64; 2]; 2], b: [[f64; 2]; 2], e: [f64; 2]) -> Option<Pairs> {
    let combined = |m: &[[f64; 2]; 2], c: usize| weights[0] * m[0][c] + weights[1] * m[1][c];
    let size = |m: &[[f64; 2]; 2]| m.iter().flatten().fold(0.0f64, |s, x| s.max(x.abs()));
    let line = Turned { constant: 0.0, cosine: combined(&a, 0), sine: combined(&a, 1) };
    let xs = on_line(&line, weights[0] * e[0] + weights[1] * e[1], size(&a))?;
    let row = usize::from(b[1][0].hypot(b[1][1]) > b[0][0].hypot(b[0][1]));
    let mut pairs = Pairs { gap: xs.gap(), ..Pairs::default() };
    for (x, side, double) in xs.iter() {
        let rest = e[row] - a[row][0] * x.0 - a[row][1] * x.1;
        let ys = on_line(&Turned { constant: 0.0, cosine: b[row][0], sine: b[row][1] }, rest, size(&b))?;
        pairs.gap = pairs.gap.min(ys.gap());
        for (y, other, tangent) in ys.iter() {
            pairs.push(x, y, 2 * side + other, double || tangent);
        }
    }
    Some(pairs)
}
