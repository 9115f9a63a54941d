//! Reproducible random postures within the limits.

use super::{Joint, Robot};

/// Postures drawn at most for one within the limits on combinations of joints.
const TRIES: usize = 100;

/// A stream of postures, uniform within the limits; a joint without limits turns within +-pi or slides within +-1 m, one with a single limit
/// moves over as much next to it, as near to 0 as it lets.
#[derive(Debug, Clone)]
pub struct RandomPostures {
    state: u64,
}

impl RandomPostures {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// A number in [0, 1): splitmix64 (Steele, Lea and Flood 2014).
    fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Fills `q` with the next posture. One beyond a limit on a combination of joints is drawn again, and after some tries moved within.
    pub fn fill(&mut self, robot: &Robot, q: &mut [f64]) {
        let limits = robot.limits();
        for _ in 0..TRIES {
            for i in 0..q.len() {
                let reach = if robot.joints()[i] == Joint::Revolute { std::f64::consts::PI } else { 1.0 };
                let low = limits.q_min[i].max(limits.q_max[i].min(reach) - 2.0 * reach);
                let high = limits.q_max[i].min(low + 2.0 * reach);
                q[i] = low + (high - low) * self.uniform();
            }
            if limits.coupled.iter().all(|it| it.margin(q) >= 0.0) {
                return;
            }
        }
        limits.pull_inside(q);
    }
}
