//! The equality constraint of the SQP (Leger 2014, eq. 4.5 to 4.13), as others see it.

use super::OrthogonalSqp;
use crate::error::{Result, check_length};
use crate::kinematics::sized::jacobian;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::svd::Svd;
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::task::Target;

/// A singular value below this part of the largest is none.
const NEGLIGIBLE: f64 = 1e-12;

/// The constraint at a posture.
#[derive(Debug, Clone, Copy)]
pub struct ConstraintAt {
    /// Components of the constraint; the first `dimension` count.
    pub h: Row6,
    /// dh/dq by rows, one column a joint.
    pub jacobian: Rows6<MAX_JOINTS>,
    /// An orthonormal basis of the null space of dh/dq: `free` vectors.
    pub null: [[f64; MAX_JOINTS]; MAX_JOINTS],
    /// Number of components.
    pub dimension: usize,
    /// Number of free directions: n - dimension, and more where dh/dq is singular.
    pub free: usize,
}

impl OrthogonalSqp {
    /// The constraint h of a target at a posture, its Jacobian and its null directions: what is there less what should be, angular components (first)
    /// times the length.
    pub fn constraint(&self, target: &Target, q: &[f64]) -> Result<ConstraintAt> {
        let n = self.robot.n();
        check_length("q", q, n)?;
        let (tool, columns) = jacobian::<MAX_JOINTS>(&self.robot, q);
        let length = self.settings.length;
        let constraint = self.task.constraint(&tool, target, length);
        let m = constraint.dimension();
        let rows = constraint.jacobian(&columns);
        let (w, v) = self.task.error(&tool, target);
        let h = self.task.directions(&tool, length).reduce(w, v).map(|x| -x);
        let factors = Svd::<MAX_JOINTS>::new(&rows, n, m);
        let rank = factors.sigma[..m].iter().filter(|sigma| **sigma > NEGLIGIBLE * factors.sigma[0]).count();
        // Of the right vectors that count: those of a zero are not known.
        let null = Orthogonal::new(&factors.v, n, rank).null_space();
        Ok(ConstraintAt { h, jacobian: rows, null, dimension: m, free: n - rank })
    }
}
