//! The best posture at every point of a path, as one call.

use std::sync::Arc;

use super::grid::{SpareGrid, angle_grid};
use super::hooks::{Hooks, PlanError};
use super::layers::Layers;
use super::led::or_led;
use super::part::{Part, WarmStart, better_parts};
use super::path::Path;
use super::problem::PathProblem;
use super::proof::{is_proven, proven_bound};
use super::reconfigure::reconfigured;
use super::settings::{Aim, PlanSettings};
use super::strategy::searched_parts;
use super::verdict::{Plan, assembled};
use crate::error::{Error, Result};
use crate::index::Objective;
use crate::robot::Robot;
use crate::task::Task;

/// A joint that moves further from point to point [rad or m] jumps, where the path leaves it another way.
const JUMP: f64 = 0.5;

/// Plans the free motion of a robot along a whole path: the spin of its tool, and its spare joints.
///
/// Every inverse solution at some points of the path, over a grid of spins, is searched for the best route; from there the path as a whole is
/// brought to its continuous optimum by an interior-point method with exact second derivatives.
#[derive(Debug, Clone)]
pub struct Planner {
    problem: PathProblem,
    path: Path,
    settings: PlanSettings,
    spare: SpareGrid,
    warm_start: Option<WarmStart>,
}

impl Planner {
    /// For an axisymmetric or a full task and any robot whose joints it takes, or that has some to spare.
    ///
    /// # Errors
    /// [`Error::Value`] if a setting is out of its domain, an objective is missing, or the task, the robot or the path is none that can be
    /// planned for.
    pub fn new(robot: Arc<Robot>, path: Path, task: Task, objective: Option<Objective>, settings: PlanSettings) -> Result<Self> {
        if settings.criterion != Aim::Motion && objective.is_none() {
            let expected = format!("an objective for the criterion '{}'", settings.criterion.name());
            return Err(Error::value("objective", "None", &expected));
        }
        settings.check()?;
        let problem = PathProblem::new(robot.clone(), &path, task, objective, &settings)?;
        let spare = SpareGrid::new(&robot, &task, settings.spare.as_deref(), settings.n_spare)?;
        angle_grid(spare.spins, settings.n_angles, settings.spin_range)?;
        Ok(Self { problem, path, settings, spare, warm_start: None })
    }

    /// Starts from an earlier plan of a similar path: it is refined at once, with a search only if that fails.
    pub fn with_warm_start(self, warm_start: WarmStart) -> Self {
        Self { warm_start: Some(warm_start), ..self }
    }

    /// The plan. The result does not hang on the number of threads.
    ///
    /// # Errors
    /// [`PlanError`] if the caller's predicate fails or the caller ends the work. A path that cannot be followed is no error: the plan's
    /// `failure` tells why.
    pub fn plan(&self, hooks: &mut Hooks) -> std::result::Result<Plan, PlanError> {
        if let Some(max_step) = self.settings.max_step {
            return self.planned(&self.problem.with_step(max_step), hooks);
        }
        let plan = self.planned(&self.problem, hooks)?;
        if self.problem.timed || plan.failure.is_some() || plan.largest_step(self.problem.n()) <= JUMP {
            return Ok(plan);
        }
        // A jump is no way along the path, unless the path itself asks for it.
        let steady = self.planned(&self.problem.with_step(JUMP), hooks)?;
        Ok(if steady.failure.is_none() { steady } else { plan })
    }

    fn planned(&self, problem: &PathProblem, hooks: &mut Hooks) -> std::result::Result<Plan, PlanError> {
        let settings = &self.settings;
        let mut known = Layers::new(problem, settings, &self.spare, finer(0))?;
        let mut parts = match &self.warm_start {
            Some(earlier) => earlier.refined(problem, &self.path, settings.max_iterations, hooks)?,
            None => Vec::new(),
        };
        let searches = if parts.is_empty() { settings.searches(!self.spare.joints.is_empty()) } else { 0 };
        for search in 0..searches {
            let mut layers = settings.layers;
            if search > 0 {
                known = Layers::new(problem, settings, &self.spare, finer(search))?;
                layers = known.most_layers();
            }
            let found: Vec<Part> = searched_parts(problem, &mut known, layers, settings.max_iterations, hooks)?;
            parts = better_parts(problem.criterion, parts, found);
            if is_proven(problem, &mut known, &parts, hooks)? {
                break;
            }
        }
        let parts = or_led(problem, &known, parts, settings.max_iterations, hooks)?;
        let mut plan = assembled(problem, &mut known, &parts, hooks)?;
        if settings.reconfigurations
            && plan.failure.is_some()
            && let Some(cut) = reconfigured(problem, &mut known, &parts, settings, hooks)?
        {
            return Ok(cut);
        }
        if settings.is_bounded() {
            plan.bound = proven_bound(problem, &mut known, &plan.q, &plan.value, hooks)?;
        }
        Ok(plan)
    }
}

/// How much finer than asked for the grid of a search is: the second is as fine as the first, each one after it doubles the spins.
fn finer(search: usize) -> usize {
    1 << search.saturating_sub(1)
}
