//! Postures by Newton from many starts, where no closed form is known.

use super::verified::Verified;
use crate::linalg::frame::Frame;
use crate::robot::RandomPostures;

/// Starts that have to lead to nothing new before the search ends.
const PATIENCE: usize = 96;
/// The same where nothing was found at all.
const PATIENCE_FOR_ONE: usize = 400;
/// Newton steps from a start.
const STEPS: usize = 60;

/// Adds what Newton finds from random postures, the same ones every time; where a continuum is known already, nothing of it.
pub fn search(found: &mut Verified, target: &Frame) {
    let mut postures = RandomPostures::new(7);
    let regular = !found.is_empty();
    let mut idle = 0;
    while idle < if found.is_empty() { PATIENCE_FOR_ONE } else { PATIENCE } {
        let mut q = [0.0; 6];
        postures.fill(found.robot(), &mut q[..found.robot().n()]);
        idle = if found.add(&q, target, STEPS, regular) { 0 } else { idle + 1 };
    }
}
