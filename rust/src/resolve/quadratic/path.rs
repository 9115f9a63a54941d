//! Programmes without time: from posture to posture along targets.

use super::solver::{QuadraticMemory, QuadraticSettings, QuadraticSolver, Tick};
use crate::error::Result;
use crate::index::Order;
use crate::inverse::reach_sized;
use crate::kinematics::sized::forward;
use crate::linalg::vector::norm;
use crate::linalg::{MAX_JOINTS, Row6, size};
use crate::resolve::{Solution, SolveStatus};
use crate::robot::{Limits, RandomPostures};
use crate::task::Target;

/// Steps towards a target.
const STEPS: usize = 20;
/// Newton steps onto it.
const REACH_ITERATIONS: usize = 60;
/// Largest motion of a joint in one step [rad or m].
const LARGEST_MOTION: f64 = 0.3;
/// Error of a posture that counts as on target [rad, m].
const ON_TARGET: f64 = 1e-9;
/// That of Newton.
const TOLERANCE: f64 = 1e-12;

impl QuadraticSolver {
    /// The same programme for motions instead of rates: a tick of length 1 in which no joint moves far.
    fn unhurried(&self) -> Result<Self> {
        let n = self.robot().n();
        let own = self.robot().limits();
        let none = Limits::none(n);
        let limits = if self.settings().limits { Limits { q_min: own.q_min.clone(), q_max: own.q_max.clone(), ..none } } else { none };
        let robot = self.robot().with_limits(Limits { qd_max: vec![LARGEST_MOTION; n], ..limits })?;
        self.for_motions(robot, QuadraticSettings { dt: 1.0, limits: true, ..*self.settings() })
    }

    /// From `q0` to a target: steps with the objective, then Newton.
    pub fn solve<const C: usize>(&self, target: &Target, q0: &[f64]) -> Solution {
        self.follow::<C>(std::slice::from_ref(target), q0).pop().unwrap_or_else(|| self.nowhere(q0))
    }

    /// Along the targets, each from the posture of the one before.
    pub fn follow<const C: usize>(&self, targets: &[Target], q0: &[f64]) -> Vec<Solution> {
        let Ok(unhurried) = self.unhurried() else { return targets.iter().map(|_| self.nowhere(q0)).collect() };
        let n = size::<C>(self.robot().n()).min(q0.len());
        let mut q = [0.0; MAX_JOINTS];
        q[..n].copy_from_slice(&q0[..n]);
        let each = targets.iter().map(|target| {
            let found = unhurried.towards::<C>(target, &q[..n]);
            q = found.q;
            found
        });
        each.collect()
    }

    fn towards<const C: usize>(&self, target: &Target, q0: &[f64]) -> Solution {
        let n = q0.len();
        let mut q = [0.0; MAX_JOINTS];
        q[..n].copy_from_slice(q0);
        let mut memory = QuadraticMemory::default();
        for _ in 0..STEPS {
            let (w, v) = self.task().error(&forward::<C>(self.robot(), &q[..n]), target);
            let twist: Row6 = [w[0], w[1], w[2], v[0], v[1], v[2]];
            let mut motion = [0.0; MAX_JOINTS];
            self.step::<C>(&Tick { q: &q[..n], twist, stiffness: self.settings().stiffness, rows: &[] }, &mut memory, &mut motion[..n]);
            for i in 0..n {
                q[i] += motion[i];
            }
        }
        let length = self.settings().length;
        let found = reach_sized::<C>(
            self.robot(),
            Some(self.robot().limits()),
            self.task(),
            target,
            length,
            &mut q[..n],
            TOLERANCE,
            REACH_ITERATIONS,
        );
        self.solution::<C>(target, q, STEPS + found.iterations)
    }

    fn solution<const C: usize>(&self, target: &Target, q: [f64; MAX_JOINTS], iterations: usize) -> Solution {
        let n = self.robot().n();
        let (w, v) = self.task().error(&forward::<C>(self.robot(), &q[..n]), target);
        let [position_error, angle_error] = [norm(v), norm(w)];
        let value = |objective: &crate::index::Objective| objective.evaluate_sized::<C>(self.robot(), &q[..n], Order::Value, false).value;
        Solution {
            q,
            value: self.objective().map_or(f64::NAN, value),
            position_error,
            angle_error,
            status: if position_error.max(angle_error) <= ON_TARGET { SolveStatus::OnTarget } else { SolveStatus::Unreachable },
            iterations,
        }
    }

    fn nowhere(&self, q0: &[f64]) -> Solution {
        let q = std::array::from_fn(|i| q0.get(i).copied().unwrap_or(0.0));
        Solution { q, value: f64::NAN, position_error: f64::NAN, angle_error: f64::NAN, status: SolveStatus::Unreachable, iterations: 0 }
    }

    /// The best of `starts` random postures on the target; `None` if it was never reached.
    pub fn solve_best<const C: usize>(&self, target: &Target, starts: usize, seed: u64) -> Option<Solution> {
        let n = self.robot().n();
        let mut postures = RandomPostures::new(seed);
        let mut best: Option<Solution> = None;
        for _ in 0..starts {
            let mut q = [0.0; MAX_JOINTS];
            postures.fill(self.robot(), &mut q[..n]);
            let found = self.solve::<C>(target, &q[..n]);
            let inside = !self.settings().limits || self.robot().limits().margin(&found.q[..n]) >= 0.0;
            let better = best.is_none_or(|best| found.value < best.value);
            if found.status == SolveStatus::OnTarget && inside && better {
                best = Some(found);
            }
        }
        best
    }
}
