//! Real roots of a trigonometric polynomial.

use std::f64::consts::TAU;

/// The degree the determinant of a general chain has: sixteen roots, in half as many harmonics.
pub const DEGREE: usize = 8;

/// Samples a turn: enough to leave four harmonics that must vanish, whose size is the rounding error of the others.
pub const SAMPLES: usize = 24;

/// The first sample [rad]: no multiple of a right angle, where the roots of symmetric robots lie.
pub const START: f64 = 0.2345;

/// By how much rounding may exceed what is seen of it in the harmonics that must vanish.
const SAFETY: f64 = 100.0;

/// The most roots and tangencies that are reported.
pub const MOST: usize = 24;

/// The most intervals that are looked at; some sixty are where nothing is wrong.
const INTERVALS: usize = 2048;

/// a[0] + sum of a[k] cos kx + b[k] sin kx.
#[derive(Debug, Clone)]
pub struct Harmonics {
    a: [f64; DEGREE + 1],
    b: [f64; DEGREE + 1],
    /// The size of the harmonics beyond the degree over the size of the others.
    pub noise: f64,
    /// What rounding may have added to a value, the largest harmonic being one.
    floor: f64,
}

/// A root, or a place where the polynomial nearly vanishes.
#[derive(Debug, Clone, Copy)]
pub struct Root {
    /// Where [rad].
    pub angle: f64,
    /// How many roots it is, as far as rounding lets one tell them apart.
    pub multiplicity: Multiplicity,
}

/// How many roots there are in one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Multiplicity {
    /// One, far from the others.
    Simple,
    /// Two.
    Double,
    /// Two or more, or nothing but rounding.
    Unknown,
}

impl Harmonics {
    /// From samples at equal angles, the first at zero.
    pub fn new(samples: &[f64; SAMPLES]) -> Self {
        let turn: [(f64, f64); SAMPLES] = std::array::from_fn(|i| (TAU * i as f64 / SAMPLES as f64).sin_cos());
        let coefficient = |k: usize| {
            let (mut a, mut b) = (0.0, 0.0);
            for (j, y) in samples.iter().enumerate() {
                let (s, c) = turn[j * k % SAMPLES];
                (a, b) = (a + c * y, b + s * y);
            }
            let weight = if k == 0 || 2 * k == SAMPLES { 1.0 } else { 2.0 } / SAMPLES as f64;
            (a * weight, b * weight)
        };
        let mut out = Self { a: [0.0; DEGREE + 1], b: [0.0; DEGREE + 1], noise: 0.0, floor: 0.0 };
        let (mut largest, mut beyond) = (0.0f64, 0.0f64);
        for k in 0..=SAMPLES / 2 {
            let (a, b) = coefficient(k);
            if k <= DEGREE {
                (out.a[k], out.b[k]) = (a, b);
                largest = largest.max(a.abs()).max(b.abs());
            } else {
                beyond = beyond.max(a.abs()).max(b.abs());
            }
        }
        out.noise = if largest > 0.0 { beyond / largest } else { 1.0 };
        out.floor = SAFETY * (out.noise + f64::EPSILON);
        let scale = 1.0 / largest.max(f64::MIN_POSITIVE);
        out.a = out.a.map(|x| x * scale);
        out.b = out.b.map(|x| x * scale);
        out
    }

    /// Value and three derivatives.
    #[inline]
    fn at(&self, x: f64) -> [f64; 4] {
        let (s1, c1) = x.sin_cos();
        let (mut s, mut c) = (0.0, 1.0);
        let mut out = [self.a[0], 0.0, 0.0, 0.0];
        for k in 1..=DEGREE {
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
            let n = k as f64;
            let (value, slope) = (self.a[k] * c + self.b[k] * s, n * (self.b[k] * c - self.a[k] * s));
            out[0] += value;
            out[1] += slope;
            out[2] -= n * n * value;
            out[3] -= n * n * slope;
        }
        out
    }

    /// A zero of the derivative of the given order between two places where it has opposite signs, by Newton steps kept in the bracket.
    fn zero(&self, order: usize, mut low: f64, mut high: f64, falling: bool) -> f64 {
        let mut x = 0.5 * (low + high);
        for _ in 0..60 {
            let y = self.at(x);
            if (y[order] > 0.0) == falling {
                low = x;
            } else {
                high = x;
            }
            let newton = x - y[order] / y[order + 1];
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - x).abs() < 1e-14 {
                return next;
            }
            x = next;
        }
        x
    }

    /// All real roots, and the places where rounding may have hidden some; false where those are too many to look at.
    ///
    /// A quarter of a turn at a time, by sign changes of the Bernstein coefficients, halving where there is more than one (Descartes' rule:
    /// Lane and Riesenfeld, 1981): no root is overlooked, however close to another.
    pub fn roots(&self, found: &mut impl FnMut(Root)) -> bool {
        let mut budget = INTERVALS;
        for quarter in 0..4 {
            let mut waiting = [([0.0; ORDER], 0.0, 0.0); DEPTH + 1];
            waiting[0] = (self.bernstein(quarter), 0.0, 1.0);
            let mut count = 1;
            while count > 0 {
                if budget == 0 {
                    return false;
                }
                (count, budget) = (count - 1, budget - 1);
                let (coefficients, low, high) = waiting[count];
                let changes = sign_changes(&coefficients);
                let certain = coefficients.iter().all(|x| x.abs() > self.floor);
                if certain && changes == 0 {
                    continue;
                }
                if (certain && changes == 1) || high - low < SHORTEST {
                    let [x, y] = [low, high].map(|t| angle(quarter, t));
                    self.few(x, y, found);
                    continue;
                }
                let (left, right) = halved(coefficients);
                let middle = 0.5 * (low + high);
                waiting[count] = (right, middle, high);
                waiting[count + 1] = (left, low, middle);
                count += 2;
            }
        }
        true
    }

    /// The coefficients of one quarter of a turn.
    fn bernstein(&self, quarter: usize) -> [f64; ORDER] {
        let mut out = [0.0; ORDER];
        for k in 0..=DEGREE {
            let (a, b) = (self.a[k], self.b[k]);
            let (a, b) = [(a, b), (b, -a), (-a, -b), (-b, a)][k * quarter % 4];
            for j in 0..ORDER {
                out[j] += a * BERNSTEIN[k][j].0 + b * BERNSTEIN[k][j].1;
            }
        }
        out
    }

    /// The roots of an interval that holds one, or is too short to halve further.
    fn few(&self, low: f64, high: f64, found: &mut impl FnMut(Root)) {
        let (low, high) = ((low, self.at(low)), (high, self.at(high)));
        // Zeros of the second derivative part it into pieces where the first is monotone.
        if (low.1[2] > 0.0) != (high.1[2] > 0.0) {
            let bend = self.zero(2, low.0, high.0, low.1[2] > 0.0);
            let middle = (bend, self.at(bend));
            self.one_bend(low, middle, found);
            self.one_bend(middle, high, found);
        } else {
            self.one_bend(low, high, found);
        }
    }

    /// The roots between two places between which the slope is monotone: at most one extremum, and two roots.
    fn one_bend(&self, low: (f64, [f64; 4]), high: (f64, [f64; 4]), found: &mut impl FnMut(Root)) {
        if (low.1[1] > 0.0) == (high.1[1] > 0.0) {
            return self.one_slope(low, high, found);
        }
        let top = self.zero(1, low.0, high.0, low.1[1] > 0.0);
        let middle = (top, self.at(top));
        self.one_slope(low, middle, found);
        self.one_slope(middle, high, found);
        let y = middle.1;
        // A valley above zero or a peak below: rounding may have lifted a double root off zero.
        if (low.1[0] > 0.0) == (y[0] > 0.0) && (high.1[0] > 0.0) == (y[0] > 0.0) && y[0].abs() < self.floor {
            found(Root { angle: top, multiplicity: self.double(y) });
        }
    }

    /// The root between two places between which the polynomial is monotone.
    fn one_slope(&self, low: (f64, [f64; 4]), high: (f64, [f64; 4]), found: &mut impl FnMut(Root)) {
        if (low.1[0] > 0.0) == (high.1[0] > 0.0) {
            return;
        }
        let angle = self.zero(0, low.0, high.0, low.1[0] > 0.0);
        let y = self.at(angle);
        // What rounding moves the root by, against the distance 2 y'/y'' of the other root of the parabola through it.
        let moved = self.floor / y[1].abs();
        let simple = moved < 1e-5 && moved * y[2].abs() < 1e-2 * y[1].abs();
        found(Root { angle, multiplicity: if simple { Multiplicity::Simple } else { self.double(y) } });
    }

    /// Two roots that rounding moves little make a parabola.
    fn double(&self, y: [f64; 4]) -> Multiplicity {
        let moved = (self.floor / y[2].abs()).sqrt();
        if moved < 1e-4 && moved * y[3].abs() < 1e-1 * y[2].abs() { Multiplicity::Double } else { Multiplicity::Unknown }
    }
}

/// How often an interval is halved at most, and what is left of it then.
const DEPTH: usize = 11;
const SHORTEST: f64 = 1.5 / (1 << DEPTH) as f64;

/// Bernstein coefficients of a form of twice the degree in the cosine and sine of half the angle.
const ORDER: usize = 2 * DEGREE + 1;

/// Bernstein coefficients of cos kx and sin kx on the first quarter of a turn: with e = exp(i pi/4), exp(ix/2) is a positive multiple of
/// (1 - t) + t e, and exp(ikx) of ((1 - t) + t e)^(8 + k) ((1 - t) + t / e)^(8 - k).
const BERNSTEIN: [[(f64, f64); ORDER]; DEGREE + 1] = bernstein();

const fn bernstein() -> [[(f64, f64); ORDER]; DEGREE + 1] {
    let mut out = [[(0.0, 0.0); ORDER]; DEGREE + 1];
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let mut k = 0;
    while k <= DEGREE {
        let mut form = [(0.0, 0.0); ORDER];
        form[0] = (1.0, 0.0);
        let mut factor = 0;
        while factor < 2 * DEGREE {
            let sine = if factor < DEGREE + k { half } else { -half };
            let mut j = factor + 1;
            while j > 0 {
                let (re, im) = form[j - 1];
                form[j] = (form[j].0 + half * re - sine * im, form[j].1 + half * im + sine * re);
                j -= 1;
            }
            factor += 1;
        }
        let (mut binomial, mut j) = (1.0, 0);
        while j < ORDER {
            out[k][j] = (form[j].0 / binomial, form[j].1 / binomial);
            binomial = binomial * (2 * DEGREE - j) as f64 / (j + 1) as f64;
            j += 1;
        }
        k += 1;
    }
    out
}

/// The angle at a parameter of a quarter of a turn.
fn angle(quarter: usize, t: f64) -> f64 {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    2.0 * (t * half).atan2(1.0 - t + t * half) + quarter as f64 * std::f64::consts::FRAC_PI_2
}

fn sign_changes(coefficients: &[f64; ORDER]) -> usize {
    coefficients.windows(2).filter(|pair| (pair[0] > 0.0) != (pair[1] > 0.0)).count()
}

/// The coefficients of both halves of an interval (de Casteljau).
fn halved(mut c: [f64; ORDER]) -> ([f64; ORDER], [f64; ORDER]) {
    let mut left = [0.0; ORDER];
    for k in 0..ORDER {
        left[k] = c[0];
        for j in 0..ORDER - 1 - k {
            c[j] = 0.5 * (c[j] + c[j + 1]);
        }
    }
    (left, c)
}
