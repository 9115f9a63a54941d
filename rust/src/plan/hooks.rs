//! What a planner asks of its caller, and tells it, while it works.

use std::fmt;

use thiserror::Error as ThisError;

use super::numbers::shown;
use crate::error::Error;

/// An error of the caller's own predicate.
pub type PredicateError = Box<dyn std::error::Error + Send + Sync>;

/// Says of postures, n joints a row, which are allowed.
pub type Predicate<'a> = dyn FnMut(&[f64]) -> Result<Vec<bool>, PredicateError> + 'a;

/// Says what it costs to move from some postures to others, n joints a row each.
pub type EdgeCost<'a> = dyn FnMut(&[f64], &[f64]) -> Result<Vec<f64>, PredicateError> + 'a;

/// Why there is no plan at all.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum PlanError {
    /// What is asked for cannot be planned.
    #[error(transparent)]
    Input(#[from] Error),
    /// The caller's predicate, or its cost of a step, failed.
    #[error("the predicate failed: {0}")]
    Predicate(PredicateError),
    /// The caller ended it.
    #[error("cancelled")]
    Cancelled,
}

/// What a planner asks of its caller, and tells it; by default nothing.
#[derive(Default)]
pub struct Hooks<'a> {
    /// The caller's own reason to refuse postures, such as a collision.
    pub feasible: Option<&'a mut Predicate<'a>>,
    /// The caller's own cost of a step from a posture to the next, at least 0; infinite where it is forbidden.
    pub edge_cost: Option<&'a mut EdgeCost<'a>>,
    /// Told how far the work is.
    pub progress: Option<Progress<'a>>,
    /// Asked before every piece of work whether to end it.
    pub cancelled: Option<&'a mut dyn FnMut() -> bool>,
}

/// What a round of a plan does, one after another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// Postures are computed and routes are searched.
    Search,
    /// Routes are refined.
    Refine,
    /// What no route can be better than is looked for.
    Prove,
}

impl Phase {
    /// Which part of a round it is, from where to where.
    fn share(self) -> (f64, f64) {
        match self {
            Self::Search => (0.0, 0.5),
            Self::Refine => (0.5, 0.8),
            Self::Prove => (0.8, 1.0),
        }
    }
}

/// Which part of what is left of a phase a sign of life is worth: how long a phase takes is not known before it ends.
const LIFE: f64 = 0.01;
/// Shares of the work smaller than this are told together.
const TOLD: f64 = 2e-3;

/// How far the work is. It never goes back nor beyond its end, and comes to its end.
pub struct Progress<'a> {
    tell: &'a mut dyn FnMut(f64),
    /// What was told, where the work is, and where its phase ends, of 1.
    told: f64,
    at: f64,
    end: f64,
    /// Where the round begins, and how long it is.
    round: (f64, f64),
}

impl<'a> Progress<'a> {
    /// `tell` is told the share of the work that was done since the last call; all shares together are 1.
    pub fn new(tell: &'a mut dyn FnMut(f64)) -> Self {
        Self { tell, told: 0.0, at: 0.0, end: 1.0, round: (0.0, 1.0) }
    }

    fn enter(&mut self, phase: Phase) {
        let (from, to) = phase.share();
        let (start, length) = self.round;
        self.end = start + to * length;
        self.reach(start + from * length);
    }

    fn live(&mut self) {
        self.reach(self.at + LIFE * (self.end - self.at).max(0.0));
    }

    fn reach(&mut self, share: f64) {
        self.at = self.at.max(share.min(1.0));
        if self.at - self.told >= TOLD || (self.at == 1.0 && self.told < 1.0) {
            (self.tell)(self.at - self.told);
            self.told = self.at;
        }
    }
}

impl fmt::Debug for Hooks<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hooks").finish_non_exhaustive()
    }
}

impl Hooks<'_> {
    /// Whether the caller ends the work; a sign of life.
    pub(super) fn is_cancelled(&mut self) -> bool {
        if let Some(progress) = &mut self.progress {
            progress.live();
        }
        self.cancelled.as_mut().is_some_and(|cancelled| cancelled())
    }

    /// An error where the caller ends the work.
    pub(super) fn go_on(&mut self) -> Result<(), PlanError> {
        if self.is_cancelled() { Err(PlanError::Cancelled) } else { Ok(()) }
    }

    /// A round of the work begins: one of `count`, by its number.
    pub(super) fn begin(&mut self, round: usize, count: usize) {
        if let Some(progress) = &mut self.progress {
            progress.round = (round as f64 / count as f64, 1.0 / count as f64);
            progress.enter(Phase::Search);
        }
    }

    /// A phase of the round begins.
    pub(super) fn enter(&mut self, phase: Phase) {
        if let Some(progress) = &mut self.progress {
            progress.enter(phase);
        }
    }

    /// All is done.
    pub(super) fn finish(&mut self) {
        if let Some(progress) = &mut self.progress {
            progress.reach(1.0);
        }
    }

    /// Which postures, n joints a row, are allowed; `None` without a predicate, or without a posture.
    pub(super) fn allowed(&mut self, q: &[f64], n: usize) -> Result<Option<Vec<bool>>, PlanError> {
        let Some(feasible) = self.feasible.as_mut().filter(|_| !q.is_empty()) else { return Ok(None) };
        let answer = feasible(q).map_err(PlanError::Predicate)?;
        if answer.len() != q.len() / n {
            return Err(Error::length("feasible", answer.len(), q.len() / n).into());
        }
        Ok(Some(answer))
    }

    /// What the caller's cost says of steps between postures, n joints a row each; nothing without a cost.
    pub(super) fn edge_costs(&mut self, before: &[f64], after: &[f64], n: usize) -> Result<Vec<f64>, PlanError> {
        let Some(edge_cost) = self.edge_cost.as_mut().filter(|_| !before.is_empty()) else { return Ok(Vec::new()) };
        let answer = edge_cost(before, after).map_err(PlanError::Predicate)?;
        if answer.len() != before.len() / n {
            return Err(Error::length("what edge_cost returned", answer.len(), before.len() / n).into());
        }
        match answer.iter().position(|cost| cost.is_nan() || *cost < 0.0) {
            Some(i) => Err(Error::value(&format!("what edge_cost returned, [{i}]"), shown(answer[i]), "a number of at least 0").into()),
            None => Ok(answer),
        }
    }

    /// Whether all postures are allowed.
    pub(super) fn all_allowed(&mut self, q: &[f64], n: usize) -> Result<bool, PlanError> {
        Ok(self.allowed(q, n)?.is_none_or(|allowed| allowed.into_iter().all(|one| one)))
    }
}
