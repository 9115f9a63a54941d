//! All solutions of a closed loop of six revolute joints by continuation: a loop with known solutions is changed into the one at hand, and
//! each solution is followed (Morgan and Sommese 1989, coefficient-parameter continuation).
//!
//! A loop of general, complex links has sixteen solutions (Primrose 1986). On the straight line from one of them to a real loop, all stay
//! apart before the end is reached, whatever is special about the end; and every solution of the end where the Jacobian has full rank is
//! the end of exactly one way.

use super::closure::{polished, spread, twins};
use super::found::Found;
use super::ways::{End, FAR, GONE, SEEN, WAYS, ends};
use crate::linalg::frame::Frame;

/// Where the loop is entered, and the fraction of the usual steps: what nearly always keeps the ways apart and finite comes first. Another entry
/// is another line through the space of loops.
const ATTEMPTS: [(usize, f64); 5] = [(0, 1.0), (3, 1.0), (1, 0.3), (4, 0.3), (2, 0.1)];

/// Imaginary parts below which the end of a way is real, for one that ended and for one that did not: at a fold of many sheets the way is still
/// some distance off [rad].
const REAL: f64 = 1e-7;
const NEARLY_REAL: f64 = 3e-2;
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
