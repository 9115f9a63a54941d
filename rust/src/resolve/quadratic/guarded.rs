//! A tick among obstacles: no pair comes nearer than its security distance within it.

use super::damper::Damper;
use super::settings::{Outcome, QuadraticMemory, QuadraticStatus, Tick};
use super::solver::{MAX_OWN_ROWS, MAX_ROWS, QuadraticSolver};
use crate::collision::{Distances, Proximity};
use crate::error::Result;
use crate::linalg::MAX_JOINTS;
use crate::qp::Row;
use crate::robot::MAX_COMBINATIONS;
use crate::task::volume::MAX_SIDES;

/// Pairs that are looked at in a tick, the nearest ones.
pub const MAX_NEAR: usize = 24;
/// How often rows are tightened for what a straight line does not tell of a distance.
const TIGHTENINGS: usize = 6;
/// How far above the security distance ticks end at least [m]: between them, on a chord of the motion, a distance can be a little less.
const MARGIN: f64 = 1e-6;

/// The pairs that were near in the last tick, and room for those that are near at its end. Kept from tick to tick, so that none begins with
/// clearing it.
#[derive(Debug, Clone)]
pub struct Near {
    pairs: [Proximity; MAX_NEAR],
    count: usize,
    ahead: [Proximity; MAX_NEAR],
}

impl Default for Near {
    fn default() -> Self {
        Self { pairs: [Proximity::NONE; MAX_NEAR], count: 0, ahead: [Proximity::NONE; MAX_NEAR] }
    }
}

impl Near {
    /// The pairs, nearest first.
    pub fn pairs(&self) -> &[Proximity] {
        &self.pairs[..self.count]
    }
}

/// Obstacles, and the law that keeps them away.
pub struct Guard<'a, D: Distances> {
    /// The robot's bodies and the obstacles.
    pub scene: &'a mut D,
    /// How fast distances may fall.
    pub damper: Damper,
    /// What was near.
    pub near: &'a mut Near,
}

impl<D: Distances> Guard<'_, D> {
    /// As [`QuadraticSolver::step`], with one row a near pair after those of the tick (eq. A.1). The distances at the end of the tick are
    /// computed, and rows tightened where the curvature of the motion would bring a pair nearer than its security distance.
    ///
    /// No allocation, but of hulls that overlap for the first time.
    pub fn step(&mut self, solver: &QuadraticSolver, tick: &Tick<'_>, memory: &mut QuadraticMemory, rates: &mut [f64]) -> Result<Outcome> {
        let Near { pairs, count, ahead } = &mut *self.near;
        *count = 0;
        *count = self.scene.near(tick.q, self.damper.influence(), pairs)?.written;
        let pairs = &pairs[..*count];
        let mut rows = [Row { a: &[], lower: 0.0, upper: f64::INFINITY }; MAX_OWN_ROWS + MAX_NEAR];
        let own = tick.rows.len().min(MAX_OWN_ROWS);
        rows[..own].copy_from_slice(&tick.rows[..own]);
        for (row, pair) in rows[own..].iter_mut().zip(pairs) {
            (row.a, row.lower) = (&pair.row, self.damper.bound(pair));
        }
        let rows = &mut rows[..own + pairs.len()];
        let before = (memory.rates, memory.earlier, memory.closing);
        let mut left = TIGHTENINGS;
        loop {
            let outcome = solver.step(&Tick { rows: &*rows, ..*tick }, memory, rates);
            let there = Self::at_the_end(self.scene, self.damper, tick.q, rates, solver.settings().dt, ahead)?;
            let tightened = tighten(self.damper, pairs, there, solver.settings().dt, &mut rows[own..]);
            if !tightened || left == 0 || outcome.status == QuadraticStatus::Infeasible {
                return Ok(outcome);
            }
            left -= 1;
            (memory.rates, memory.earlier, memory.closing) = before;
        }
    }

    /// What is near at the end of a tick.
    fn at_the_end<'n>(
        scene: &mut D,
        damper: Damper,
        q: &[f64],
        rates: &[f64],
        dt: f64,
        room: &'n mut [Proximity; MAX_NEAR],
    ) -> Result<&'n [Proximity]> {
        let mut there = [0.0; MAX_JOINTS];
        // Of the right number of joints: the scene has seen to that.
        for i in 0..q.len() {
            there[i] = q[i] + dt * rates[i];
        }
        let found = scene.near(&there[..q.len()], damper.influence(), room)?.written;
        Ok(&room[..found])
    }
}

/// Raises the bounds of pairs that would be too near at the end of the tick; whether there are any.
fn tighten(damper: Damper, pairs: &[Proximity], there: &[Proximity], dt: f64, rows: &mut [Row<'_>]) -> bool {
    let mut tightened = false;
    for next in there {
        let Some(k) = pairs.iter().position(|pair| pair.pair == next.pair) else { continue };
        // What is too near already has only to keep its distance.
        let floor = (damper.security() + MARGIN).min(pairs[k].distance);
        let short = floor - (next.distance + dt * next.drift);
        if short > 0.0 {
            rows[k].lower += short / dt;
            tightened = true;
        }
    }
    tightened
}

const _: () = assert!(
    MAX_OWN_ROWS + MAX_NEAR + MAX_SIDES + MAX_COMBINATIONS + 6 <= MAX_ROWS,
    "rows of a tick, of near pairs, of a volume, of combinations and of the deviation"
);
