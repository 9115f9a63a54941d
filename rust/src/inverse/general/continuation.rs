//! All solutions of a closed loop of six revolute joints by continuation: a loop with known solutions is changed into the one at hand, and
//! each solution is followed (Morgan and Sommese 1989, coefficient-parameter continuation).
//!
//! A loop of general, complex links has sixteen solutions (Primrose 1986). On the straight line from one of them to a real loop, all stay
//! apart before the end is reached, whatever is special about the end; and every solution of the end where the Jacobian has full rank is
//! the end of exactly one way.

use std::f64::consts::TAU;

use super::closure::{polished, spread, twins};
use super::found::Found;
use super::line::{Line, Turn, closure};
use super::start;
use crate::linalg::complex::Complex;
use crate::linalg::frame::Frame;
use crate::linalg::real::{Lanes, Real};

/// How many solutions a general loop has.
const WAYS: usize = 16;

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
/// Evaluations of all ways together, lanes counted as one.
const MOST: usize = 6000;

/// The end of a way.
#[derive(Debug, Clone, Copy)]
struct End {
    /// Complex joint angles [rad].
    q: [Complex; 6],
    /// What was left of the line: zero where the way ended in a solution.
    left: f64,
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
fn ends(links: &[Frame; 6], accuracy: f64) -> [End; WAYS] {
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

/// Where the loop is entered, and the fraction of the usual steps: what nearly always keeps the ways apart and finite comes first. Another entry
/// is another line through the space of loops.
const ATTEMPTS: [(usize, f64); 5] = [(0, 1.0), (3, 1.0), (1, 0.3), (4, 0.3), (2, 0.1)];

/// Imaginary parts below which the end of a way is real, for one that ended and for one that did not: at a fold of many sheets the way is still
/// some distance off [rad].
const REAL: f64 = 1e-7;
const NEARLY_REAL: f64 = 3e-2;
/// Imaginary parts above which an angle is on its way to infinity at the end of the line, and before it [rad].
const FAR: f64 = 4.0;
const GONE: f64 = 10.0;
/// What is left of the line where that is seen.
const SEEN: f64 = 1e-2;
/// Two ends this near to each other are one [rad].
const SAME: f64 = 1e-5;
/// Smallest over largest pivot of the Jacobian at which two solutions may have become one.
const MET: f64 = 1e-6;
/// What may be left of the line at a singular end.
const NEARLY_ENDED: f64 = 1e-7;

impl End {
    fn imaginary(&self) -> f64 {
        self.q.iter().fold(0.0, |most, z| most.max(z.im.abs()))
    }

    fn has_ended(&self) -> bool {
        self.left == 0.0
    }

    /// What a way tells that has not ended: that it is at infinity, about to end at a singular solution, or lost.
    fn unfinished(&self) -> Verdict {
        let off = self.imaginary();
        if self.left <= NEARLY_ENDED && !(NEARLY_REAL..FAR).contains(&off) {
            Verdict::Proven
        } else if self.left <= SEEN && off >= GONE {
            Verdict::Likely
        } else if off >= FAR {
            Verdict::Lost
        } else {
            Verdict::Doubtful
        }
    }

    /// Whether two ends are one, the other one conjugated or not.
    fn is_at(&self, other: &Self, conjugated: bool) -> bool {
        let sign = if conjugated { -1.0 } else { 1.0 };
        (0..6).all(|i| {
            let (a, b) = (self.q[i], other.q[i]);
            (0.5 * (a.re - b.re)).sin().abs() <= 0.5 * SAME && (a.im - sign * b.im).abs() <= SAME
        })
    }
}

/// What the ends of all ways tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    /// All sixteen are accounted for.
    Proven,
    /// Some were about to end too far away to be followed.
    Likely,
    /// Some went too far away before.
    Lost,
    /// Some are missing.
    Doubtful,
}

/// The real solutions of a loop, and whether all that are regular are among them: either all ways are accounted for, or two lines through the
/// space of loops agree, or one that ends with solutions that are `known` by other means.
pub fn continued(links: &[Frame; 6], known: Found) -> (Found, bool) {
    let mut all = known;
    let (mut likely, mut lost) = (!known.solutions().is_empty(), false);
    for (first, accuracy) in ATTEMPTS {
        let before = all.solutions().len();
        let (here, verdict) = attempt(links, first, accuracy);
        here.solutions().iter().for_each(|q| all.add(q));
        let agree = here.solutions().len() == all.solutions().len() && all.solutions().len() == before;
        match verdict {
            Verdict::Proven => return (all, true),
            Verdict::Likely if agree && (likely || lost) => return (all, true),
            Verdict::Lost if agree && lost => return (all, true),
            _ => {}
        }
        let whole = here.solutions().len() == all.solutions().len();
        likely = verdict == Verdict::Likely && whole;
        lost = verdict <= Verdict::Lost && whole;
    }
    (all, false)
}

/// What one line finds.
fn attempt(links: &[Frame; 6], first: usize, accuracy: f64) -> (Found, Verdict) {
    let entered: [Frame; 6] = std::array::from_fn(|i| links[(i + first) % 6]);
    let ends = ends(&entered, accuracy);
    let (mut verdict, mut found) = (verdict(&ends), Found::none());
    for end in ends.iter().filter(|end| end.imaginary() <= if end.has_ended() { REAL } else { NEARLY_REAL }) {
        let Some(q) = polished(&entered, &end.q.map(|z| z.re)) else {
            verdict = Verdict::Doubtful;
            continue;
        };
        // At a singular end two are one, or nearly.
        let others = if end.has_ended() { [None; 2] } else { twins(&entered, &q) };
        for mut q in others.into_iter().flatten().chain([q]) {
            q.rotate_right(first);
            found.add(&q);
        }
    }
    let singular = || found.solutions().iter().any(|q| spread(links, q) < MET);
    if !found.solutions().len().is_multiple_of(2) && !singular() {
        verdict = Verdict::Doubtful;
    }
    (found, verdict)
}

/// Ends have to differ and come with their conjugates, the real ones in even number, since regular solutions of a real loop come and go in
/// pairs; and what has not ended is at infinity or about to end.
fn verdict(ends: &[End; WAYS]) -> Verdict {
    let near = |end: &&End| end.has_ended() && end.imaginary() < FAR;
    let apart = (0..WAYS).all(|i| !near(&&ends[i]) || !ends[..i].iter().filter(near).any(|other| ends[i].is_at(other, false)));
    let real = ends.iter().filter(near).filter(|end| end.imaginary() <= REAL).count();
    let paired = |end: &End| end.imaginary() <= REAL || ends.iter().filter(near).any(|other| end.is_at(other, true));
    // Where all go to infinity the loop has no shape.
    let some = ends.iter().any(|end| near(&end));
    if !some || !apart || !real.is_multiple_of(2) || !ends.iter().filter(near).all(paired) {
        return Verdict::Doubtful;
    }
    ends.iter().filter(|end| !end.has_ended()).map(End::unfinished).max().unwrap_or(Verdict::Proven)
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
            let end = |q| End { q, left: 0.0 };
            assert!(start::SOLUTIONS[..i].iter().all(|other| !end(*other).is_at(&end(q), false)), "{i}");
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
