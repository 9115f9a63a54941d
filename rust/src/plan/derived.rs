//! Problems made of a problem: of a stretch of its path, of some of its points, with other bounds or for the motion alone.

use super::graph::Criterion;
use super::joint_weights::JointWeights;
use super::numbers::{sum, to_one_digit};
use super::path::point_weights;
use super::problem::PathProblem;
use crate::robot::Joint;

/// Least weight of a joint in the motion where those count that may move little.
const LIGHT: f64 = 1e-3;

impl PathProblem {
    /// The problem of `count` points from `first` on, whose postures start as `q`; `turns` are those of a stretch that closes, whose last point
    /// is left out.
    pub(super) fn stretch(&self, first: usize, count: usize, turns: Option<Vec<f64>>, q: &[f64]) -> Self {
        let n = self.n();
        let kept = first..first + count - usize::from(turns.is_some());
        let steps = &self.steps[first..first + count - 1];
        let total = if steps.is_empty() { 1.0 } else { sum(steps) };
        let steps: Vec<f64> = steps.iter().map(|step| step / total).collect();
        let weight = self.weight_of_motion(self.worth(first, q).into_iter());
        // What is next to nothing must not hang on where a closed path starts: a digit of it is enough.
        let weight = if turns.is_some() && self.smoothness.is_none() { to_one_digit(weight) } else { weight };
        Self {
            targets: self.targets[kept.clone()].into(),
            frames: self.frames[kept.clone()].into(),
            pins: self.pins.within(kept.clone()),
            smoothness: Some(weight),
            weights: point_weights(&steps, turns.is_some())[..kept.len()].into(),
            steps: steps.into(),
            bounds: self.bounds[first * n..(first + count - 1) * n].into(),
            pace: self.pace.as_ref().map(|pace| pace[first * n..(first + count - 1) * n].into()),
            turns,
            ..self.clone()
        }
    }

    /// The problem of one point: the least value there.
    pub(super) fn alone(&self, point: usize) -> Self {
        Self {
            targets: self.targets[point..=point].into(),
            frames: self.frames[point..=point].into(),
            pins: self.pins.within(point..point + 1),
            criterion: Criterion::Integral,
            smoothness: Some(0.0),
            weights: [1.0].into(),
            steps: [].into(),
            bounds: [].into(),
            pace: None,
            turns: None,
            ..self.clone()
        }
    }

    /// The same problem with a largest motion from point to point, beside the bounds that there are: of every joint [rad or m] if `max_step` is given,
    /// else `usual` of those that turn, where the path has no times.
    pub(super) fn with_steps(&self, max_step: Option<f64>, usual: f64) -> Self {
        let joints = self.robot.joints();
        let own = |joint: usize| match max_step {
            Some(step) => step,
            None if self.timed || joints[joint] == Joint::Prismatic => f64::INFINITY,
            None => usual,
        };
        let n = self.n();
        Self { bounds: self.bounds.iter().enumerate().map(|(i, bound)| bound.min(own(i % n))).collect(), ..self.clone() }
    }

    /// The problem of some of its points alone, in their order; the bounds of the motion between them add up.
    pub(super) fn thinned(&self, kept: &[usize]) -> Self {
        let n = self.n();
        let spans: Vec<(usize, usize)> = kept.windows(2).map(|pair| (pair[0], pair[1])).collect();
        let steps: Vec<f64> = spans.iter().map(|&(a, b)| sum(&self.steps[a..b])).collect();
        let total = sum(&steps);
        let steps: Vec<f64> = steps.iter().map(|step| step / total).collect();
        let total_of = |all: &[f64]| -> Vec<f64> {
            let of = |&(a, b): &(usize, usize), k: usize| (a..b).map(|i| all[i * n + k]).sum::<f64>();
            spans.iter().flat_map(|span| (0..n).map(move |k| of(span, k))).collect()
        };
        let closed = self.closed && kept.first() == Some(&0) && kept.last() == Some(&(self.points() - 1));
        Self {
            targets: kept.iter().map(|&point| self.targets[point]).collect(),
            frames: kept.iter().map(|&point| self.frames[point]).collect(),
            weights: point_weights(&steps, closed).into(),
            bounds: total_of(&self.bounds).into(),
            pace: self.pace.as_ref().map(|pace| total_of(pace).into()),
            steps: steps.into(),
            closed,
            ..self.clone()
        }
    }

    /// The same problem with any motion from point to point.
    pub(super) fn without_steps(&self) -> Self {
        Self { bounds: vec![f64::INFINITY; self.bounds.len()].into(), ..self.clone() }
    }

    /// The same problem of the motion alone, each joint weighed by how little it may move, with any motion from point to point.
    pub(super) fn calm(&self) -> Self {
        let n = self.n();
        let least = |k: usize| self.bounds.iter().skip(k).step_by(n).fold(f64::INFINITY, |least, bound| least.min(*bound));
        self.without_steps().of_motion(&(0..n).map(least).collect::<Vec<_>>())
    }

    /// The problem whose routes are looked at: this one; where the tool's speed is sought that of the motion, each joint weighed by how slow it is.
    pub(super) fn for_search(&self) -> Self {
        if self.pace.is_some() { self.of_motion(&self.robot.limits().qd_max) } else { self.clone() }
    }

    /// The same problem of the motion alone, each joint weighed by how little it may move.
    fn of_motion(&self, least: &[f64]) -> Self {
        let slowest = least.iter().copied().fold(f64::INFINITY, f64::min);
        let weights: Vec<f64> = least.iter().map(|least| (slowest / least).powi(2).max(LIGHT)).collect();
        let joint_weights = JointWeights::new(self.n(), Some(&weights)).unwrap_or_else(|_| self.joint_weights.clone());
        Self { objective: None, pace: None, criterion: Criterion::Integral, smoothness: Some(1.0), joint_weights, ..self.clone() }
    }
}
