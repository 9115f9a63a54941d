//! Reproducible random postures within the limits.

use super::{Joint, Robot};
use crate::linalg::random::Uniform;

/// Postures drawn at most for one within the limits on combinations of joints.
const TRIES: usize = 100;

/// A stream of postures, uniform within the limits; a joint without limits turns within +-pi or slides within +-1 m, one with a single limit
/// moves over as much next to it, as near to 0 as it lets.
#[derive(Debug, Clone)]
pub struct RandomPostures {
    stream: Uniform,
}

impl RandomPostures {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self { stream: Uniform::new(seed) }
    }

    /// Fills `q` with the next posture. One beyond a limit on a combination of joints is drawn again, and after some tries moved within.
    pub fn fill(&mut self, robot: &Robot, q: &mut [f64]) {
        let limits = robot.limits();
        for _ in 0..TRIES {
            for i in 0..q.len() {
                let reach = if robot.joints()[i] == Joint::Revolute { std::f64::consts::PI } else { 1.0 };
                let low = limits.q_min[i].max(limits.q_max[i].min(reach) - 2.0 * reach);
                let high = limits.q_max[i].min(low + 2.0 * reach);
                q[i] = low + (high - low) * self.stream.draw();
            }
            if limits.coupled.iter().all(|it| it.margin(q) >= 0.0) {
                return;
            }
        }
        limits.pull_inside(q);
    }
}
