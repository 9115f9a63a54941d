//! What a planner asks of its caller, and tells it, while it works.

use std::fmt;

use thiserror::Error as ThisError;

use crate::error::Error;

/// An error of the caller's own predicate.
pub type PredicateError = Box<dyn std::error::Error + Send + Sync>;

/// Says of postures, n joints a row, which are allowed.
pub type Predicate<'a> = dyn FnMut(&[f64]) -> Result<Vec<bool>, PredicateError> + 'a;

/// Why there is no plan at all.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum PlanError {
    /// What is asked for cannot be planned.
    #[error(transparent)]
    Input(#[from] Error),
    /// The caller's predicate failed.
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

    /// Whether all postures are allowed.
    pub(super) fn all_allowed(&mut self, q: &[f64], n: usize) -> Result<bool, PlanError> {
        Ok(self.allowed(q, n)?.is_none_or(|allowed| allowed.into_iter().all(|one| one)))
    }
}
