//! Programmes without time: from posture to posture towards targets.

use std::sync::Arc;

use super::settings::{QuadraticMemory, Tick};
use super::solver::{QuadraticSolver, RateBounds};
use crate::index::Objective;
use crate::inverse::{error_at, reach_sized};
use crate::kinematics::sized::forward;
use crate::linalg::vector::norm;
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, Row6};
use crate::resolve::bounds::motion_interval;
use crate::resolve::reach_inside::Sought;
use crate::resolve::{Memory, ON_TARGET, PathFrame, Resolver, Solution, SolveStatus};
use crate::robot::Robot;
use crate::task::{OrientationVolume, Target, Task};

/// Steps towards a target.
const STEPS: usize = 20;
/// Newton steps onto it.
const REACH_ITERATIONS: usize = 60;
/// Error at which Newton ends.
const TOLERANCE: f64 = 1e-12;

impl Resolver for QuadraticSolver {
    fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    fn task(&self) -> &Task {
        &self.task
    }

    fn volume(&self) -> Option<&OrientationVolume> {
        self.volume.as_deref()
    }

    fn keeps_limits(&self) -> bool {
        self.settings().limits
    }

    fn dt(&self) -> f64 {
        self.settings().dt
    }

    /// From `q0` to a target: programmes for motions instead of rates, of a tick of length 1 in which no joint moves far, then Newton onto the
    /// target. Nothing is remembered from target to target.
    fn solve_next(&self, target: &Target, q0: &[f64], _memory: &mut Memory) -> Solution {
        if q0.len() != self.robot.n() {
            return Solution::nowhere();
        }
        with_capacity!(self.robot.n(), solve(self, target, q0))
    }
}

#[inline(never)]
fn solve<const C: usize>(solver: &QuadraticSolver, target: &Target, q0: &[f64]) -> Solution {
    let (n, robot, settings) = (q0.len(), &solver.robot, solver.settings());
    let limits = settings.limits.then(|| robot.limits());
    let mut q = [0.0; MAX_JOINTS];
    q[..n].copy_from_slice(q0);
    let mut memory = QuadraticMemory::default();
    for _ in 0..STEPS {
        let (w, v) = error_at::<C>(robot, &solver.task, target, &q[..n]);
        let twist: Row6 = [w[0], w[1], w[2], v[0], v[1], v[2]];
        let bounds = RateBounds { lower: [0.0; C], upper: [0.0; C], returning: false, brakes: false, jerks: false };
        let (mut bounds, mut motion) = (bounds, [0.0; MAX_JOINTS]);
        for i in 0..n {
            (bounds.lower[i], bounds.upper[i]) = motion_interval(limits, i, q[i]);
        }
        let tick = Tick {
            q: &q[..n],
            twist,
            stiffness: settings.stiffness,
            rows: &[],
            twists: &[],
            frame: Some(PathFrame { start: None, end: target.frame }),
        };
        solver.within::<C>(&tick, 1.0, &bounds, &mut memory, &mut motion[..n]);
        for i in 0..n {
            q[i] += motion[i];
        }
    }
    let found = match &solver.volume {
        None => reach_sized::<C>(robot, limits, &solver.task, target, settings.length, &mut q[..n], TOLERANCE, REACH_ITERATIONS),
        Some(volume) => {
            let sought = Sought { robot, volume, target, length: settings.length, limits, held: 0 };
            sought.reach(&mut q[..n], TOLERANCE, REACH_ITERATIONS)
        }
    };
    let (w, v) = solver.left(&forward::<C>(robot, &q[..n]), target);
    let (position_error, angle_error) = (norm(v), norm(w));
    let value = |objective: &Objective| objective.value_sized::<C>(robot, &q[..n]);
    Solution {
        q,
        value: solver.objective().map_or(f64::NAN, value),
        position_error,
        angle_error,
        status: if position_error.max(angle_error) <= ON_TARGET { SolveStatus::OnTarget } else { SolveStatus::Unreachable },
        iterations: STEPS + found.iterations,
    }
}
