//! All postures of a general six-revolute chain: by elimination (Raghavan and Roth, 1993) where that is sure of itself, else by continuation.
//!
//! Elimination is quick, but a determinant may vanish for all angles where axes of the loop are parallel or intersect; and the loop's last link
//! is made by the target, so that every arm has such frames (a tool that points straight down, to begin with). Continuation knows no special
//! loops and counts what it finds.

mod closure;
mod continuation;
mod elimination;
mod found;
mod line;
mod polynomial;
mod resultant;
mod start;
mod ways;

use crate::linalg::frame::Frame;
use crate::linalg::vector::{add, dot, norm, scale};
use closure::{moves_on, polished, twins};
use continuation::continued;
use found::Found;
use resultant::{CHOICES, with_hidden};

/// How many choices of the hidden joint are tried before elimination is given up.
const TRIED: usize = 3;

/// A loop that misses closing by this much of its length cannot be closed.
const OUT_OF_REACH: f64 = 1e-9;

/// The solutions of `Z(q1) L1 Z(q2) L2 ... Z(q6) L6 = 1`, and whether there are no others. Of an arm that nearly has a closed form some may be
/// known; elimination is at its worst there, and left out.
pub fn general(links: &[Frame; 6], known: Option<&[[f64; 6]]>) -> (Found, bool) {
    let links = normalised(links);
    if !links.iter().flat_map(|link| link.origin).all(f64::is_finite) {
        return (Found::none(), false);
    }
    if cannot_close(&links) {
        return (Found::none(), true);
    }
    let eliminated = if known.is_none() { by_elimination(&links) } else { None };
    let (found, complete) = match eliminated {
        Some(found) => (found, true),
        None => {
            let mut start = Found::none();
            known.into_iter().flatten().for_each(|q| start.add(q));
            continued(&links, start)
        }
    };
    (found, complete && !found.solutions().iter().any(|q| moves_on(&links, q)))
}

/// How far a solution may be from where it was looked for to count as found there [rad].
const NEXT: f64 = 0.3;

/// The solutions next to places that nearly are solutions, on both sides of a fold: where one comes or goes another does, so that they are even
/// in number. `None` where they are not, or a search leads somewhere else.
pub fn beside(links: &[Frame; 6], places: &[[f64; 6]]) -> Option<Found> {
    let links = normalised(links);
    let mut found = Found::none();
    for place in places {
        if let Some(q) = polished(&links, place) {
            if (0..6).any(|i| (0.5 * (q[i] - place[i])).sin().abs() > 0.5 * NEXT) {
                return None;
            }
            found.add(&q);
            twins(&links, &q).iter().flatten().for_each(|twin| found.add(twin));
        }
    }
    found.solutions().len().is_multiple_of(2).then_some(found)
}

/// The solutions that elimination finds, if it is sure of them.
fn by_elimination(links: &[Frame; 6]) -> Option<Found> {
    CHOICES.into_iter().take(TRIED).find_map(|choice| {
        let mut found = Found::none();
        let sure = with_hidden(links, choice, &mut |q| found.add(q));
        // Regular solutions of a real loop are even in number: they come and go in pairs.
        (sure && found.solutions().len().is_multiple_of(2)).then_some(found)
    })
}

/// Whether one link of a loop is longer than all others together.
pub fn cannot_close(links: &[Frame; 6]) -> bool {
    let lengths = links.map(|link| norm(link.origin));
    let all: f64 = lengths.iter().sum();
    lengths.iter().any(|length| 2.0 * length > (1.0 + OUT_OF_REACH) * all)
}

/// The length of the longest link in the equations, which add squares of lengths to sines and cosines.
const LONGEST: f64 = 0.5;

/// Origins slid along their own axes to where the links are short, and lengths scaled.
fn normalised(links: &[Frame; 6]) -> [Frame; 6] {
    let mut links = *links;
    for _ in 0..2 {
        for i in 0..6 {
            let previous = (i + 5) % 6;
            let axis = links[previous].axes[2];
            let slide = 0.5 * (links[i].origin[2] - dot(axis, links[previous].origin));
            links[i].origin[2] -= slide;
            links[previous].origin = add(links[previous].origin, scale(slide, axis));
        }
    }
    let longest = links.iter().map(|l| norm(l.origin)).fold(0.0, f64::max);
    if longest > 0.0 {
        for link in &mut links {
            link.origin = scale(LONGEST / longest, link.origin);
        }
    }
    links
}

#[cfg(test)]
mod tests {
    use super::closure::turned;
    use super::*;

    /// Rz(theta) Tz(d) Tx(a) Rx(alpha).
    fn link([theta, d, a, alpha]: [f64; 4]) -> Frame {
        turned(theta, &Frame::translation([a, 0.0, d]).compose(&Frame::rotation([1.0, 0.0, 0.0], alpha)))
    }

    #[test]
    fn a_general_chain_comes_back_among_an_even_number_of_solutions() {
        let mut number = 0.5f64;
        let mut next = || {
            number = (number * 997.0 + 0.123).fract();
            2.0 * number - 1.0
        };
        for _ in 0..200 {
            let mut links: [Frame; 6] = std::array::from_fn(|_| link([3.0 * next(), next(), next(), 3.0 * next()]));
            let wanted: [f64; 6] = std::array::from_fn(|_| 3.1 * next());
            let target = (0..6).fold(Frame::IDENTITY, |f, i| f.compose(&turned(wanted[i], &links[i])));
            links[5] = links[5].compose(&target.inverse());
            let same = |a: &[f64; 6], b: &[f64; 6]| (0..6).all(|i| (0.5 * (a[i] - b[i])).sin().abs() < 1e-7);
            let (found, sure) = general(&links, None);
            let solutions = found.solutions();
            assert!(sure && solutions.iter().any(|s| same(s, &wanted)) && solutions.len().is_multiple_of(2), "{solutions:?}");
        }
    }

    #[test]
    fn what_has_no_finite_solutions_is_not_claimed_to_have_none() {
        assert!(!general(&[Frame::IDENTITY; 6], None).1);
        assert!(!general(&[Frame::translation([f64::NAN; 3]); 6], None).1);
    }
}
