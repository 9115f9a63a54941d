//! The solutions of a loop of complex links followed along a line to another loop, several side by side.

use std::f64::consts::TAU;

use super::line::{Line, Turn, closure};
use super::start;
use crate::linalg::complex::Complex;
use crate::linalg::frame::Frame;
use crate::linalg::real::{Lanes, Real};

/// How many solutions a general loop has.
pub const WAYS: usize = 16;

/// The Newton step after a prediction that is aimed at, that is taken as it is, and that is refused [rad].
const AIM: f64 = 2e-3;
const GOOD: f64 = 8e-3;
const REFUSED: f64 = 4e-2;
/// The Newton step that ends a way [rad].
const ENDED: f64 = 1e-11;
/// The same far from any real angle, where sines and cosines are large and rounding is.
const ENDED_FAR: f64 = 1e-5;
/// The largest step of a complex angle [rad].
const STRIDE: f64 = 0.5;
/// By how much steps grow and shrink at most.
const GROW: f64 = 2.5;
const SHRINK: f64 = 0.4;
/// First step.
const FIRST: f64 = 0.05;
/// What is left of the line where a way that has not ended will not end.
const LEFT: f64 = 1e-11;
/// Imaginary parts above which an angle is on its way to infinity at the end of the line, and before it [rad].
pub const FAR: f64 = 4.0;
pub const GONE: f64 = 10.0;
/// What is left of the line where that is seen.
pub const SEEN: f64 = 1e-2;
/// Evaluations of all ways together, lanes counted as one.
const MOST: usize = 6000;

/// The end of a way.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Complex joint angles \[rad\].
    pub q: [Complex; 6],
    /// What was left of the line: zero where the way ended in a solution.
    pub left: f64,
}

/// One way: where it is, and where it was before.
#[derive(Debug, Clone, Copy)]
struct Way {
    t: f64,
    q: [Complex; 6],
    turns: [Turn<f64>; 6],
    tangent: [Complex; 6],
    before: Option<(f64, [Complex; 6], [Complex; 6])>,
    /// Next place on the line, its prediction less where the way is, and the turns it starts from.
    next: f64,
    step: [Complex; 6],
    base: [Turn<f64>; 6],
    length: f64,
    first: f64,
    round: u8,
}

impl Way {
    fn new(q: [Complex; 6]) -> Self {
        let turns = q.map(|z| {
            let ((s, c), up, down) = (z.re.sin_cos(), z.im.exp(), (-z.im).exp());
            let (ch, sh) = (0.5 * (up + down), 0.5 * (up - down));
            Turn { cosine: Complex { re: c * ch, im: -s * sh }, sine: Complex { re: s * ch, im: c * sh } }
        });
        let zero = [Complex::ZERO; 6];
        Self { t: 0.0, q, turns, tangent: zero, before: None, next: 0.0, step: zero, base: turns, length: FIRST, first: 0.0, round: 0 }
    }

    /// Cubic through the last two places and their tangents, else along the tangent.
    fn predict(&mut self) {
        let left = 1.0 - self.t;
        let mut length = self.length.min(left);
        // Half the way that is left, unless all of it can be made at once.
        if length < left {
            length = length.min(0.5 * left);
        }
        loop {
            let largest = self.extrapolate(length);
            if largest <= STRIDE {
                break;
            }
            length *= (0.9 * STRIDE / largest).max(0.1);
        }
        self.next = if length == left { 1.0 } else { self.t + length };
        self.length = length;
        (self.base, self.round) = (self.turns, 0);
    }

    fn extrapolate(&mut self, length: f64) -> f64 {
        let mut largest = 0.0f64;
        match &self.before {
            None => {
                for i in 0..6 {
                    self.step[i] = self.tangent[i].times(length);
                    largest = largest.max(self.step[i].square());
                }
            }
            Some((t, q, tangent)) => {
                let span = self.t - t;
                let u = length / span;
                // Hermite's cubic at 1 + u, less its value at 1.
                let (back, from, along) = (u * u * (2.0 * u + 3.0), u * (1.0 + u) * (1.0 + u), u * u * (1.0 + u));
                for i in 0..6 {
                    self.step[i] = (q[i] - self.q[i]).times(back) + self.tangent[i].times(from * span) + tangent[i].times(along * span);
                    largest = largest.max(self.step[i].square());
                }
            }
        }
        largest.sqrt()
    }

    /// Takes what an evaluation at `next` says; whether the way is at its end.
    fn take(&mut self, turns: [Turn<f64>; 6], newton: [Complex; 6], tangent: [Complex; 6], accuracy: f64) -> bool {
        let size = newton.iter().map(|z| z.square()).fold(0.0, f64::max).sqrt();
        let last = self.next >= 1.0;
        if self.round == 0 {
            self.first = size;
        }
        let wanted = match last {
            true if self.q.iter().any(|z| z.im.abs() >= FAR) => ENDED_FAR,
            true => ENDED,
            false => GOOD * accuracy,
        };
        let refused = if self.round == 0 { REFUSED * accuracy } else { 0.2 * self.first };
        if size <= wanted {
            let q = std::array::from_fn(|i| self.q[i] + self.step[i] + newton[i]);
            self.before = (self.next > self.t).then_some((self.t, self.q, self.tangent));
            (self.t, self.q, self.turns, self.tangent) = (self.next, q, turns, tangent);
            self.turned(newton);
            if last {
                return true;
            }
            let grow = 0.9 * (AIM * accuracy / self.first.max(1e-30)).sqrt().sqrt();
            self.length *= grow.clamp(SHRINK, GROW);
            self.predict();
            return false;
        }
        if size < refused && self.round < 6 {
            self.step = std::array::from_fn(|i| self.step[i] + newton[i]);
            self.round += 1;
            return false;
        }
        // Also what is not a number.
        self.length *= SHRINK;
        self.predict();
        let left = 1.0 - self.t;
        self.length < 1e-3 * LEFT || left < LEFT || (left < SEEN && self.q.iter().any(|z| z.im.abs() > GONE))
    }

    /// From the cosines and sines: the sum of the steps has drifted.
    fn angles(&self) -> [Complex; 6] {
        self.turns.map(|turn| {
            let (c, s) = (turn.cosine, turn.sine);
            // exp(i q) = cos q + i sin q.
            let (re, im) = (c.re - s.im, c.im + s.re);
            Complex { re: im.atan2(re), im: -re.hypot(im).ln() }
        })
    }

    fn turned(&mut self, newton: [Complex; 6]) {
        for i in 0..6 {
            self.turns[i] = self.turns[i].stepped(newton[i]);
        }
    }
}

/// Follows all ways to a loop; `accuracy` is 1, or less where ways were mixed up.
#[inline(always)]
fn follow<R: Real>(line: &Line, accuracy: f64) -> [End; WAYS] {
    let mut ends = [End { q: [Complex::ZERO; 6], left: 1.0 }; WAYS];
    let mut ways: [(usize, Way); 8] = std::array::from_fn(|lane| (lane, Way::new(start::SOLUTIONS[lane])));
    let mut next = R::LANES;
    let mut running = R::LANES;
    for _ in 0..MOST {
        let t = R::from_lanes(|i| ways[i].1.next);
        let turns: [Turn<R>; 6] = std::array::from_fn(|k| Turn {
            cosine: Complex::from_lanes(|i| ways[i].1.base[k].cosine),
            sine: Complex::from_lanes(|i| ways[i].1.base[k].sine),
        });
        let steps: [Complex<R>; 6] = std::array::from_fn(|k| Complex::from_lanes(|i| ways[i].1.step[k]));
        let at = closure(line, t, &turns, &steps);
        for lane in 0..R::LANES {
            let (number, way) = &mut ways[lane];
            if *number >= WAYS {
                continue;
            }
            let turns = std::array::from_fn(|k| Turn { cosine: at.turns[k].cosine.lane(lane), sine: at.turns[k].sine.lane(lane) });
            if way.take(turns, at.step.map(|z| z.lane(lane)), at.tangent.map(|z| z.lane(lane)), accuracy) {
                ends[*number] = End { q: way.angles(), left: 1.0 - way.t };
                if next < WAYS {
                    (*number, *way) = (next, Way::new(start::SOLUTIONS[next]));
                    next += 1;
                } else {
                    *number = WAYS;
                    running -= 1;
                }
            }
        }
        if running == 0 {
            break;
        }
    }
    for (number, way) in &ways[..R::LANES] {
        if *number < WAYS {
            ends[*number] = End { q: way.angles(), left: 1.0 - way.t };
        }
    }
    ends
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn follow_avx2(line: &Line, accuracy: f64) -> [End; WAYS] {
    follow::<Lanes>(line, accuracy)
}

/// The ends of all ways to a loop, in the joint angles of the loop.
pub fn ends(links: &[Frame; 6], accuracy: f64) -> [End; WAYS] {
    let line = Line::to(links);
    #[cfg(target_arch = "x86_64")]
    let found = if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has been asked.
        unsafe { follow_avx2(&line, accuracy) }
    } else {
        follow::<Lanes>(&line, accuracy)
    };
    #[cfg(not(target_arch = "x86_64"))]
    let found = follow::<Lanes>(&line, accuracy);
    found.map(|mut end| {
        for i in 0..6 {
            let angle = end.q[i].re - line.offset[i];
            end.q[i].re = angle - TAU * (angle / TAU).round();
        }
        end
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(z: [Complex; 6]) -> f64 {
        z.iter().map(|z| z.square()).fold(0.0, f64::max).sqrt()
    }

    #[test]
    fn the_first_loop_has_sixteen_solutions() {
        let line = Line::to(&[Frame::IDENTITY; 6]);
        for (i, q) in start::SOLUTIONS.into_iter().enumerate() {
            let way = Way::new(q);
            let open = closure(&line, 0.0, &way.turns, &way.step);
            assert!(size(open.step) < 1e-12, "{i}: {:?}", open.step);
            let apart = |a: &Complex, b: &Complex| (0.5 * (a.re - b.re)).sin().abs() + (a.im - b.im).abs();
            assert!(start::SOLUTIONS[..i].iter().all(|other| (0..6).any(|k| apart(&q[k], &other[k]) > 1e-3)), "{i}");
        }
    }

    #[test]
    fn the_tangent_is_where_the_solution_goes() {
        let links = std::array::from_fn(|i| {
            let turn = Frame::rotation([1.0, 0.0, 0.0], 0.4 + i as f64);
            Frame::translation([0.1 * i as f64, 0.2, -0.1]).compose(&turn)
        });
        let line = Line::to(&links);
        for q in start::SOLUTIONS {
            let way = Way::new(q);
            let tangent = closure(&line, 0.0, &way.turns, &way.step).tangent;
            // A step along the tangent leaves an error of second order.
            let left = [1e-3, 5e-4].map(|t| size(closure(&line, t, &way.turns, &tangent.map(|z| z.times(t))).step));
            assert!(left[0] < 1e-2 * size(tangent) && left[0] / left[1] > 3.5, "{left:?}");
        }
    }
}
