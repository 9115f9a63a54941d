//! What a Newton step needs of every point of a path: the objective with derivatives, and the freedom that the task leaves.

use rayon::prelude::*;

use super::constraints::side;
use super::problem::{CHUNK, PARALLEL, PathProblem};
use crate::index::Order;
use crate::index::sized::Evaluation;
use crate::kinematics::sized::{Jacobian, forward, jacobian};
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::vector::{Vec3, cross, dot};
use crate::linalg::{Rows6, size};
use crate::resolve::sqp::reduce::{Curvature, Turning};
use crate::task::Constraint;
use crate::task::volume::Sides;

/// The least ratio of shortest to longest orthogonal row of the task's Jacobian at which its free motion is told.
const SINGULAR: f64 = 1e-9;

/// All that is known of one point.
#[derive(Debug, Clone)]
pub struct Point<'r, const C: usize> {
    /// Posture.
    pub q: [f64; C],
    /// Objective with derivatives.
    pub objective: Evaluation<C>,
    /// Orthonormal basis of the free motion.
    pub basis: [[f64; C]; C],
    pseudo_inverse: Rows6<C>,
    jacobian: Jacobian<'r, C>,
    constraint: Constraint,
    spin_axis: Vec3,
    /// The bounds of the volume that is asked for, and the tool's axis.
    sides: Option<Sides>,
    tool_axis: Vec3,
    /// Where the task's directions turn along the free motion, whose they are: the problem and the number of the point.
    turning: Option<(&'r PathProblem, usize)>,
}

impl PathProblem {
    /// Motion of a joint along an edge.
    #[inline(always)]
    pub(super) fn motion<const C: usize>(&self, q: &[[f64; C]], edge: usize, joint: usize) -> f64 {
        let next = edge + 1;
        if next < q.len() {
            q[next][joint] - q[edge][joint]
        } else {
            q[0][joint] + self.turns.as_ref().map_or(0.0, |turns| turns[joint]) - q[edge][joint]
        }
    }

    /// Brings every posture back onto its target; false where one does not get there.
    pub(super) fn restore<const C: usize>(&self, q: &mut [[f64; C]]) -> bool {
        let n = size::<C>(self.n());
        if q.len() < PARALLEL {
            q.iter_mut().enumerate().all(|(i, q)| self.reach::<C>(i, &mut q[..n]))
        } else {
            q.par_iter_mut().enumerate().with_min_len(CHUNK).map(|(i, q)| self.reach::<C>(i, &mut q[..n])).reduce(|| true, |a, b| a && b)
        }
    }

    /// Objective at every posture.
    pub(super) fn values_at<const C: usize>(&self, q: &[[f64; C]]) -> Vec<f64> {
        let n = size::<C>(self.n());
        let Some(objective) = &self.objective else { return vec![0.0; q.len()] };
        let one = |q: &[f64; C]| objective.value_sized::<C>(&self.robot, &q[..n]);
        if q.len() < PARALLEL { q.iter().map(one).collect() } else { q.par_iter().with_min_len(CHUNK).map(one).collect() }
    }

    /// The bounds of the volume that is asked for at every posture; none without one.
    pub(super) fn sides_at<const C: usize>(&self, q: &[[f64; C]]) -> Vec<Sides> {
        if self.volume.is_none() {
            return Vec::new();
        }
        let n = size::<C>(self.n());
        q.iter().enumerate().filter_map(|(i, q)| self.sides_of(i, &forward::<C>(&self.robot, &q[..n]))).collect()
    }

    /// Everything at every posture; `None` where one is singular for its task or the objective has no derivatives.
    pub(super) fn points_at<const C: usize>(&self, q: &[[f64; C]]) -> Option<Vec<Point<'_, C>>> {
        if q.len() < PARALLEL {
            q.iter().enumerate().map(|(i, q)| self.point(i, q)).collect()
        } else {
            q.par_iter().enumerate().with_min_len(CHUNK).map(|(i, q)| self.point(i, q)).collect()
        }
    }

    fn point<const C: usize>(&self, i: usize, q: &[f64; C]) -> Option<Point<'_, C>> {
        let n = size::<C>(self.n());
        let (tool, columns) = jacobian::<C>(&self.robot, &q[..n]);
        // The directions that are left for a tool that turns about one alone do not turn with it.
        let turning = (self.task == self.asked && self.task.turns_with_free_motion()).then_some((self, i));
        let ((task, target), free) = (self.wanted(i), self.freedoms_at(i) > 0);
        let constraint = task.constraint(&tool, target, self.length);
        let factors = Orthogonal::new(&constraint.jacobian(&columns), n, task.dimension());
        // What is held has no free motion to be told, nor derivatives that count.
        let held = !free && self.pins.at(i).is_some();
        if !held && factors.spread() < SINGULAR {
            return None;
        }
        let objective = match &self.objective {
            Some(objective) if !held => objective.evaluate_at(&self.robot, &q[..n], &columns, Order::Hessian, false),
            _ => Evaluation::zero(),
        };
        let finite = objective.gradient[..n].iter().chain(objective.hessian[..n].iter().flat_map(|row| &row[..n])).all(|x| x.is_finite());
        finite.then(|| Point {
            q: *q,
            objective,
            basis: if held { [[0.0; C]; C] } else { factors.null_space() },
            pseudo_inverse: factors.pseudo_inverse(),
            jacobian: columns,
            constraint,
            spin_axis: self.spin.map_or([0.0; 3], |spin| tool.rotate(spin.axis)),
            sides: self.sides_of(i, &tool),
            tool_axis: tool.axes[2],
            turning,
        })
    }
}

impl<const C: usize> Point<'_, C> {
    /// How a bound of the volume changes with the joints.
    pub fn side_gradient(&self, number: usize) -> [f64; C] {
        let Some(sides) = &self.sides else { return [0.0; C] };
        let rate = side(sides, number).rate;
        self.jacobian.w.map(|w| dot(rate, w))
    }

    /// Adds the second derivative of a bound of the tilt times a factor; those of spins are left out (Gauss-Newton).
    pub fn add_side_hessian(&self, number: usize, factor: f64, hessian: &mut [[f64; C]; C]) {
        let Some(normal) = self.sides.as_ref().and_then(|sides| side(sides, number).normal) else { return };
        let n = self.jacobian.n();
        for l in 0..n {
            let moved = cross(self.jacobian.w[l], self.tool_axis);
            for k in 0..=l {
                let second = factor * dot(normal, cross(self.jacobian.w[k], moved));
                hessian[k][l] += second;
                if k < l {
                    hessian[l][k] += second;
                }
            }
        }
    }

    /// How the spin changes with the joints.
    pub fn spin_gradient(&self) -> [f64; C] {
        self.jacobian.w.map(|w| dot(self.spin_axis, w))
    }

    /// The reduced Hessian `Z' (H - sum lambda d2h) Z` for the whole problem's gradient and Hessian at this point.
    #[inline(never)]
    pub fn reduce(&self, gradient: &[f64; C], hessian: &[[f64; C]; C], r: usize) -> [[f64; C]; C] {
        let turning = self.turning.map(|(problem, i)| Turning {
            robot: &problem.robot,
            task: &problem.task,
            target: &problem.targets[i],
            length: problem.length,
            q: &self.q[..problem.n()],
            held: 0,
        });
        Curvature::new(&self.jacobian, &self.constraint, turning, &self.pseudo_inverse, gradient).reduced_hessian(hessian, &self.basis, r).0
    }
}
