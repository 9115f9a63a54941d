//! A tick among obstacles: no pair comes nearer than its security distance within it.

use super::solver::{MAX_OWN_ROWS, MAX_ROWS, Outcome, QuadraticMemory, QuadraticSolver, QuadraticStatus, Tick};
use crate::collision::{Damping, Distances, Proximity};
use crate::error::Result;
use crate::linalg::MAX_JOINTS;
use crate::optimize::qp::Row;

/// Pairs that are looked at in a tick, the nearest ones.
pub const MAX_NEAR: usize = 24;
/// How often rows are tightened for what a straight line does not tell of a distance.
const TIGHTENINGS: usize = 3;
/// How far above the security distance ticks end at least [m]: between them, on a chord of the motion, a distance can be a little less.
const MARGIN: f64 = 1e-6;

/// Obstacles, and the law that keeps them away.
pub struct Guard<'a, D: Distances> {
    /// The robot's bodies and the obstacles.
    pub scene: &'a mut D,
    /// How fast distances may fall.
    pub damping: Damping,
    /// The pairs that were near in the last tick.
    pub near: [Proximity; MAX_NEAR],
    /// How many of them.
    pub count: usize,
}

impl<'a, D: Distances> Guard<'a, D> {
    /// Nothing seen yet.
    pub fn new(scene: &'a mut D, damping: Damping) -> Self {
        Self { scene, damping, near: [Proximity::NONE; MAX_NEAR], count: 0 }
    }

    /// As [`QuadraticSolver::step`], with one row a near pair after those of the tick (eq. A.1). The distances at the end of the tick are
    /// computed, and rows tightened where the curvature of the motion would bring a pair nearer than its security distance.
    pub fn step<const C: usize>(
        &mut self,
        solver: &QuadraticSolver,
        tick: &Tick<'_, C>,
        memory: &mut QuadraticMemory,
        rates: &mut [f64],
    ) -> Result<Outcome> {
        self.count = self.scene.near(tick.q, self.damping.influence(), &mut self.near)?.written;
        let mut rows = [Row { a: [0.0; C], lower: f64::NEG_INFINITY, upper: f64::INFINITY }; MAX_ROWS];
        let own = tick.rows.len().min(MAX_OWN_ROWS);
        rows[..own].copy_from_slice(&tick.rows[..own]);
        for (row, pair) in rows[own..].iter_mut().zip(&self.near[..self.count]) {
            row.a.copy_from_slice(&pair.row[..C.min(MAX_JOINTS)]);
            row.lower = self.damping.bound(pair);
        }
        let before = *memory;
        let mut left = TIGHTENINGS;
        loop {
            let outcome = solver.step(&Tick { rows: &rows[..own + self.count], ..*tick }, memory, rates);
            let tightened = self.tighten(tick.q, rates, solver.settings().dt, &mut rows[own..own + self.count])?;
            if !tightened || left == 0 || outcome.status == QuadraticStatus::Infeasible {
                return Ok(outcome);
            }
            left -= 1;
            memory.rates = before.rates;
        }
    }

    /// Raises the bounds of pairs that would be too near at the end of the tick; whether there are any.
    fn tighten<const C: usize>(&mut self, q: &[f64], rates: &[f64], dt: f64, rows: &mut [Row<C>]) -> Result<bool> {
        let mut ahead = [0.0; MAX_JOINTS];
        for i in 0..q.len() {
            ahead[i] = q[i] + dt * rates[i];
        }
        let mut there = [Proximity::NONE; MAX_NEAR];
        let found = self.scene.near(&ahead[..q.len()], self.damping.influence(), &mut there)?.written;
        let mut tightened = false;
        for next in &there[..found] {
            let Some(k) = self.near[..self.count].iter().position(|pair| pair.pair == next.pair) else { continue };
            // What is too near already has only to keep its distance.
            let floor = (self.damping.security() + MARGIN).min(self.near[k].distance);
            let short = floor - (next.distance + dt * next.drift);
            if short > 0.0 {
                rows[k].lower += short / dt;
                tightened = true;
            }
        }
        Ok(tightened)
    }
}

const _: () = assert!(MAX_OWN_ROWS + MAX_NEAR + 6 <= MAX_ROWS, "rows of a tick, of near pairs and of the deviation");
