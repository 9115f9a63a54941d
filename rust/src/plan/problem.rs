//! A path of postures as one optimisation problem: what is minimised, what has to hold, and the freedom that is left at every point.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::graph::Criterion;
use crate::index::sized::Evaluation;
use crate::index::{Objective, Order};
use crate::inverse::reach_sized;
use crate::kinematics::sized::{Jacobian, forward, jacobian, jacobian_rate};
use crate::linalg::frame::Frame;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::vector::{Vec3, dot};
use crate::linalg::{Rows6, size};
use crate::robot::Robot;
use crate::task::{Directions, Target, Task};

/// Paths with fewer points are evaluated on one core.
const PARALLEL: usize = 32;
/// Error of a point that counts as on the path [rad, m over the length].
const ON_PATH: f64 = 1e-12;
/// The same where rounding allows no better.
const NEAR_PATH: f64 = 1e-9;
/// Newton steps back onto the path.
const RETURN_ITERATIONS: usize = 12;
/// The least ratio of shortest to longest orthogonal row of the task's Jacobian at which its free motion is told.
const SINGULAR: f64 = 1e-9;

/// A path and what is wanted of it.
#[derive(Debug, Clone)]
pub struct PathProblem<'a> {
    /// Robot.
    pub robot: &'a Robot,
    /// Task.
    pub task: Task,
    /// Targets, one a point. In a closed path the last, which is the first, is left out.
    pub targets: &'a [Target],
    /// What is minimised; motion alone if nothing.
    pub objective: Option<&'a Objective>,
    /// Worst value or integral.
    pub criterion: Criterion,
    /// Weight of the integral of the squared joint speed over the path's share.
    pub smoothness: f64,
    /// Share of the path that each point stands for.
    pub weights: &'a [f64],
    /// Share of the path from each point to the next; one more than gaps when the path is closed.
    pub steps: &'a [f64],
    /// Largest motions from each point to the next [rad or m]; infinite where there is none.
    pub bounds: &'a [f64],
    /// Whether position limits hold.
    pub limits: bool,
    /// Whether the last point leads to the first, and the whole turns in between.
    pub closed: Option<&'a [f64]>,
    /// Length that weighs angles against distances in the task [m].
    pub length: f64,
    /// Range of the spin, if it has one.
    pub spin: Option<SpinRange<'a>>,
}

/// The spin that a tool is allowed.
#[derive(Debug, Clone, Copy)]
pub struct SpinRange<'a> {
    /// Tool frames at spin 0, one a point.
    pub frames: &'a [Frame],
    /// The axis in the tool frame.
    pub axis: Vec3,
    /// Least and largest spin [rad], at most a turn apart.
    pub range: (f64, f64),
}

impl SpinRange<'_> {
    /// The spin of a tool at a point, within half a turn of the middle of the range.
    fn of(&self, point: usize, tool: &Frame) -> f64 {
        let turned = tool.axes.map(|axis| self.frames[point].unrotate(axis));
        let skew = [turned[1][2] - turned[2][1], turned[2][0] - turned[0][2], turned[0][1] - turned[1][0]];
        let angle = dot(skew, self.axis).atan2(turned[0][0] + turned[1][1] + turned[2][2] - 1.0);
        let middle = 0.5 * (self.range.0 + self.range.1);
        angle - TAU * ((angle - middle) / TAU).round()
    }
}

/// All that is known of one point.
#[derive(Debug, Clone)]
pub struct Point<const C: usize> {
    /// Posture.
    pub q: [f64; C],
    /// Objective with derivatives.
    pub objective: Evaluation<C>,
    /// Orthonormal basis of the free motion.
    pub basis: [[f64; C]; C],
    pseudo_inverse: Rows6<C>,
    jacobian: Jacobian<C>,
    directions: Directions,
    spin_axis: Vec3,
}

/// Brings every posture onto its target by Newton; tells of each whether it got there.
pub fn onto_path<const C: usize>(robot: &Robot, task: &Task, targets: &[Target], length: f64, q: &mut [[f64; C]]) -> Vec<bool> {
    let n = size::<C>(robot.n());
    let one = |(q, target): (&mut [f64; C], &Target)| {
        reach_sized::<C>(robot, None, task, target, length, &mut q[..n], ON_PATH, RETURN_ITERATIONS).error <= NEAR_PATH
    };
    if q.len() < PARALLEL {
        q.iter_mut().zip(targets).map(one).collect()
    } else {
        q.par_iter_mut().zip(targets).with_min_len(16).map(one).collect()
    }
}

impl PathProblem<'_> {
    /// Number of joints.
    pub fn n(&self) -> usize {
        self.robot.n()
    }

    /// Freedoms of a point.
    pub fn freedoms(&self) -> usize {
        self.n() - self.task.dimension()
    }

    /// The pairs of neighbours: from, to.
    pub fn edges(&self) -> usize {
        self.targets.len() - usize::from(self.closed.is_none())
    }

    /// Motion of a joint along an edge.
    #[inline(always)]
    pub fn motion<const C: usize>(&self, q: &[[f64; C]], edge: usize, joint: usize) -> f64 {
        let next = edge + 1;
        if next < q.len() {
            q[next][joint] - q[edge][joint]
        } else {
            q[0][joint] + self.closed.map_or(0.0, |turns| turns[joint]) - q[edge][joint]
        }
    }

    /// The spin at a point; 0 where it has no range.
    pub fn spin<const C: usize>(&self, point: usize, q: &[f64; C]) -> f64 {
        let n = size::<C>(self.n());
        self.spin.as_ref().map_or(0.0, |spin| spin.of(point, &forward::<C>(self.robot, &q[..n])))
    }

    /// Brings every posture back onto its target; false where one does not get there.
    pub fn restore<const C: usize>(&self, q: &mut [[f64; C]]) -> bool {
        onto_path(self.robot, &self.task, self.targets, self.length, q).into_iter().all(|reached| reached)
    }

    /// Objective at every posture, with derivatives if asked for.
    pub fn evaluate<const C: usize>(&self, q: &[[f64; C]], order: Order) -> Vec<Evaluation<C>> {
        let n = size::<C>(self.n());
        let one = |q: &[f64; C]| self.objective.map_or_else(Evaluation::zero, |o| o.evaluate_sized::<C>(self.robot, &q[..n], order, false));
        if q.len() < PARALLEL { q.iter().map(one).collect() } else { q.par_iter().with_min_len(16).map(one).collect() }
    }

    /// Everything at every posture; `None` where one is singular for its task or the objective has no derivatives.
    pub fn points<const C: usize>(&self, q: &[[f64; C]]) -> Option<Vec<Point<C>>> {
        if q.len() < PARALLEL {
            q.iter().map(|q| self.point(q)).collect()
        } else {
            q.par_iter().with_min_len(16).map(|q| self.point(q)).collect()
        }
    }

    fn point<const C: usize>(&self, q: &[f64; C]) -> Option<Point<C>> {
        let n = size::<C>(self.n());
        let (tool, columns) = jacobian::<C>(self.robot, &q[..n]);
        let directions = self.task.directions(&tool, self.length);
        let factors = Orthogonal::new(&directions.rows(&columns), n, self.task.dimension());
        if factors.spread() < SINGULAR {
            return None;
        }
        let objective = match self.objective {
            Some(objective) => objective.evaluate_at(self.robot, &q[..n], &columns, Order::Hessian, false),
            None => Evaluation::zero(),
        };
        let finite = objective.gradient[..n].iter().chain(objective.hessian[..n].iter().flat_map(|row| &row[..n])).all(|x| x.is_finite());
        finite.then(|| Point {
            q: *q,
            objective,
            basis: factors.null_space(),
            pseudo_inverse: factors.pseudo_inverse(),
            jacobian: columns,
            directions,
            spin_axis: self.spin.map_or([0.0; 3], |spin| tool.rotate(spin.axis)),
        })
    }
}

impl<const C: usize> Point<C> {
    /// How the spin changes with the joints.
    pub fn spin_gradient(&self) -> [f64; C] {
        self.jacobian.w.map(|w| dot(self.spin_axis, w))
    }

    /// The reduced Hessian `Z' (H - sum lambda d2h) Z` for the whole problem's gradient and Hessian at this point: lambda are the forces that
    /// hold the posture on its target.
    pub fn reduce(&self, gradient: &[f64; C], hessian: &[[f64; C]; C], n: usize, r: usize) -> [[f64; C]; C] {
        let m = self.directions.dimension();
        let mut lambda = [0.0; 6];
        for i in 0..n {
            for c in 0..m {
                lambda[c] += self.pseudo_inverse[c][i] * gradient[i];
            }
        }
        let (force_w, force_v) = self.directions.expand(&lambda);
        let mut out = [[0.0; C]; C];
        for a in 0..r {
            let z = &self.basis[a];
            let rate = jacobian_rate(&self.jacobian, z);
            for b in 0..r {
                let y = &self.basis[b];
                let mut sum = 0.0;
                let mut bent = 0.0;
                for i in 0..n {
                    sum += y[i] * (0..n).map(|k| hessian[i][k] * z[k]).sum::<f64>();
                    bent += y[i] * (dot(force_w, rate.w[i]) + dot(force_v, rate.v[i]));
                }
                out[a][b] += sum - 0.5 * bent;
                out[b][a] -= 0.5 * bent;
            }
        }
        out
    }
}
