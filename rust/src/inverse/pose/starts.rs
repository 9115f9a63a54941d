//! Postures to start from: random ones within the limits, the ones with the tool nearest to the target first.

use super::goal::Goal;
use crate::kinematics::jacobian_at;
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::robot::{RandomPostures, Robot};

/// How many postures are kept with where the tool is in them.
const KEPT: usize = 256;

/// Random postures of a robot and its tool frames.
#[derive(Debug, Clone)]
pub(super) struct Starts {
    n: usize,
    q: Vec<f64>,
    tools: Vec<Frame>,
}

impl Starts {
    pub fn new(robot: &Robot) -> Self {
        let n = robot.n();
        let (mut q, mut postures) = (vec![0.0; n * KEPT], RandomPostures::new(0));
        q.chunks_exact_mut(n).for_each(|row| postures.fill(robot, row));
        let tools = q.chunks_exact(n).map(|row| jacobian_at(robot, row).0).collect();
        Self { n, q, tools }
    }

    /// How far each is from a target: the cost there.
    pub fn costs(&self, goal: &Goal) -> [f64; KEPT] {
        std::array::from_fn(|k| self.tools.get(k).map_or(f64::INFINITY, |tool| goal.cost_of(tool)))
    }

    /// The one of the least cost, which is taken out.
    pub fn next(&self, costs: &mut [f64; KEPT]) -> Option<[f64; MAX_JOINTS]> {
        let best = (0..KEPT).fold(0, |best, k| if costs[k] < costs[best] { k } else { best });
        if costs[best] == f64::INFINITY {
            return None;
        }
        costs[best] = f64::INFINITY;
        let mut q = [0.0; MAX_JOINTS];
        q[..self.n].copy_from_slice(&self.q[best * self.n..(best + 1) * self.n]);
        Some(q)
    }
}
