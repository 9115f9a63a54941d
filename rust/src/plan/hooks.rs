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
    /// Told of the points that are done since the last call.
    pub progress: Option<&'a mut dyn FnMut(usize)>,
    /// Asked before every piece of work whether to end it.
    pub cancelled: Option<&'a mut dyn FnMut() -> bool>,
}

impl fmt::Debug for Hooks<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hooks").finish_non_exhaustive()
    }
}

impl Hooks<'_> {
    /// Whether the caller ends the work.
    pub(super) fn is_cancelled(&mut self) -> bool {
        self.cancelled.as_mut().is_some_and(|cancelled| cancelled())
    }

    /// An error where the caller ends the work.
    pub(super) fn go_on(&mut self) -> Result<(), PlanError> {
        if self.is_cancelled() { Err(PlanError::Cancelled) } else { Ok(()) }
    }

    /// Tells of points that are done.
    pub(super) fn advance(&mut self, points: usize) {
        if let Some(progress) = &mut self.progress {
            progress(points);
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
