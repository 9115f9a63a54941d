//! How redundant a robot is for a task.

use super::Task;
use crate::kinematics::jacobian_at;
use crate::linalg::MAX_JOINTS;
use crate::linalg::svd::Svd;
use crate::robot::{RandomPostures, Robot};

/// Postures tried: only special ones have less than the full rank.
pub(super) const POSTURES: usize = 8;
/// A singular value below this part of the largest is none.
const NEGLIGIBLE: f64 = 1e-9;

impl Task {
    /// The dimension of the motions that matter and that a robot can make.
    pub fn rank(&self, robot: &Robot) -> usize {
        let n = robot.n();
        let mut postures = RandomPostures::new(1);
        let mut q = [0.0; MAX_JOINTS];
        let mut rank = 0;
        for _ in 0..POSTURES {
            postures.fill(robot, &mut q[..n]);
            let (tool, columns) = jacobian_at(robot, &q[..n]);
            let rows = self.directions(&tool, 1.0).rows(&columns);
            let sigma = Svd::<MAX_JOINTS>::new(&rows, n, self.dimension()).sigma;
            rank = rank.max(sigma.iter().filter(|s| **s > NEGLIGIBLE * sigma[0]).count());
        }
        rank
    }

    /// Degrees of intrinsic and of functional redundancy of a robot (Huo 2009, eq. 1.4, 1.5): `n - o` and `o - t`, with o the dimension of the
    /// motions that the robot's tool can make at all. The second is negative when the robot cannot do the task.
    pub fn redundancy(&self, robot: &Robot) -> (usize, isize) {
        let operational = Self::FULL.rank(robot);
        (robot.n() - operational, operational as isize - self.dimension() as isize)
    }
}
