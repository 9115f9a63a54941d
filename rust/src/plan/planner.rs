//! The best posture at every point of a path, as one call.

use std::sync::Arc;

use super::corridor::{cost, polished, weighed};
use super::diagnosis::explained;
use super::frames::volume_frames;
use super::grid::{SpareGrid, angle_grid};
use super::hooks::{Hooks, Phase, PlanError};
use super::layers::Layers;
use super::leaps::without_leaps;
use super::led::or_led;
use super::members::{upright, without_tilt};
use super::notes::notes;
use super::part::{Part, WarmStart, best_part, better_parts, refined_part, worst};
use super::path::Path;
use super::problem::{Goal, PathProblem};
use super::proof::proven_bound;
use super::reconfigure::reconfigured;
use super::settings::{Aim, PlanSettings};
use super::strategy::{improved, is_worth_more, searched};
use super::verdict::{Plan, assembled};
use crate::error::{Error, Result};
use crate::index::Objective;
use crate::linalg::frame::Frame;
use crate::linalg::vector::Vec3;
use crate::robot::Robot;
use crate::task::Task;
use crate::task::volume::OrientationVolume;

/// Largest motion of a turning joint between neighbouring points of a path without times \[rad\], where nothing else is said.
const LARGEST_STEP: f64 = 0.25;

/// How many times as many spins there are on a grid where the speed is sought: what a spin of the grid takes must not be more than what the path itself takes.
const FINE: usize = 4;

/// Plans the free motion of a robot along a whole path: the spin of its tool, and its spare joints.
///
/// Every inverse solution at some points of the path, over a grid of spins, is searched for the best route; from there the path as a whole is
/// brought to its continuous optimum by an interior-point method with exact second derivatives.
#[derive(Debug, Clone)]
pub struct Planner {
    problem: PathProblem,
    path: Path,
    settings: PlanSettings,
    choices: Vec<SpareGrid>,
    warm_start: Option<WarmStart>,
    /// Planners whose postures are rivals: of a tool that is not tilted, where the task is a volume that holds it; of the least motion, where the speed counts.
    rivals: Vec<Self>,
}

impl Planner {
    /// For any task, and any robot whose joints it takes, or that has some to spare.
    ///
    /// # Errors
    /// [`Error::Value`] if a setting is out of its domain, an objective is missing, or the task, the robot or the path is none that can be
    /// planned for.
    pub fn new(robot: Arc<Robot>, path: Path, task: Task, objective: Option<Objective>, settings: PlanSettings) -> Result<Self> {
        Self::towards(robot, path, &task.into(), objective, settings)
    }

    /// For tools whose orientation is to be within a volume at every point, seen in the path's rotations.
    ///
    /// # Errors
    /// As [`Planner::new`]; where the volume is none that can be planned for, or the path has no rotations and the volume looks at more than an axis.
    pub fn within(
        robot: Arc<Robot>,
        path: Path,
        volume: &OrientationVolume,
        objective: Option<Objective>,
        settings: PlanSettings,
    ) -> Result<Self> {
        let upright = upright_goal(&path, volume, &settings)?;
        if without_tilt(volume).is_some()
            && let Some((path, task, settings)) = upright
        {
            return Self::new(robot, path, task, objective, settings);
        }
        // A tool that is never tilted is one way: the plan is no worse than the best of these.
        let without = upright.and_then(|(path, task, settings)| Self::new(robot.clone(), path, task, objective.clone(), settings).ok());
        let goal = Goal { task: Task::axisymmetric([0.0, 0.0, 1.0])?, volume: Some(volume.clone()) };
        let planner = Self::towards(robot, path, &goal, objective, settings)?;
        let rivals = planner.rivals.iter().cloned().chain(without).collect();
        Ok(Self { rivals, ..planner })
    }

    fn towards(robot: Arc<Robot>, path: Path, goal: &Goal, objective: Option<Objective>, settings: PlanSettings) -> Result<Self> {
        if settings.criterion.has_objective() && objective.is_none() {
            let expected = format!("an objective for the criterion '{}'", settings.criterion.name());
            return Err(Error::value("objective", "None", &expected));
        }
        settings.check()?;
        // A tool of constant speed takes its own time.
        let path = if settings.criterion == Aim::Speed { path.without_time() } else { path };
        let mut rivals = Vec::new();
        if settings.criterion == Aim::Speed {
            let calm = PlanSettings { criterion: Aim::Motion, ..settings.clone() };
            rivals.push(Self::towards(robot.clone(), path.clone(), goal, None, calm)?);
        }
        let problem = PathProblem::new(robot.clone(), &path, goal, objective, &settings)?;
        let mut choices = SpareGrid::choices(&robot, &goal.task, &settings)?;
        if goal.volume.is_some() && settings.n_spare.is_none() {
            choices.iter_mut().for_each(|choice| *choice = choice.coarser());
        }
        angle_grid(choices[0].spins, settings.n_angles, settings.spin_range)?;
        Ok(Self { problem, path, settings, choices, warm_start: None, rivals })
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
        if self.settings.criterion == Aim::Speed && hooks.edge_cost.is_some() {
            return Err(Error::value("edge_cost", "given", "none for the criterion 'speed', which is no sum over steps").into());
        }
        let problem = &self.problem.with_steps(self.settings.max_step, LARGEST_STEP);
        let mut routes = Vec::new();
        for rival in &self.rivals {
            routes.extend(rival.route(hooks)?);
        }
        let mut plan = self.best(problem, &routes, hooks)?;
        plan.failure = explained(problem, &self.settings, &self.choices[0], &plan, hooks)?;
        plan.notes = notes(&self.problem, &self.choices[0], &plan)?;
        hooks.finish();
        Ok(plan)
    }

    /// The postures of a plan that is whole.
    fn route(&self, hooks: &mut Hooks) -> std::result::Result<Option<Vec<f64>>, PlanError> {
        let plan = self.best(&self.problem.with_steps(self.settings.max_step, LARGEST_STEP), &[], hooks)?;
        Ok((plan.failure.is_none() && plan.transfers.is_empty()).then_some(plan.q))
    }

    /// The best plan that is whole; where there is none, one that tells why.
    fn best(&self, problem: &PathProblem, rivals: &[Vec<f64>], hooks: &mut Hooks) -> std::result::Result<Plan, PlanError> {
        let plan = self.planned(problem, &self.settings, rivals, hooks)?;
        if !plan.is_blocked() {
            return Ok(plan);
        }
        if !self.settings.branch_changes {
            // From one branch to another the joints are continuous at a singularity: a way through one is better than none.
            let through = PlanSettings { branch_changes: true, ..self.settings.clone() };
            let plan = self.planned(problem, &through, rivals, hooks)?;
            if plan.failure.is_none() {
                return Ok(plan);
            }
        }
        if !problem.steps_only() {
            return Ok(plan);
        }
        // A step that is too large is told where it is, on a way that is whole but for it.
        let stepping = self.planned(&self.problem, &self.settings, rivals, hooks)?;
        Ok(if stepping.failure.is_none() { stepping.judged_by_steps(problem) } else { plan })
    }

    /// The first plan that is whole, holding one choice of joints after the other; else the one that reaches most.
    fn planned(
        &self,
        problem: &PathProblem,
        settings: &PlanSettings,
        rivals: &[Vec<f64>],
        hooks: &mut Hooks,
    ) -> std::result::Result<Plan, PlanError> {
        let mut best: Option<Plan> = None;
        for spare in &self.choices {
            let plan = self.planned_over(spare, problem, settings, rivals, hooks)?;
            if plan.failure.is_none() {
                return Ok(plan);
            }
            let further = best.as_ref().is_none_or(|best| plan.reached() > best.reached());
            if further {
                best = Some(plan);
            }
        }
        best.ok_or(PlanError::Cancelled)
    }

    fn planned_over(
        &self,
        spare: &SpareGrid,
        problem: &PathProblem,
        settings: &PlanSettings,
        rivals: &[Vec<f64>],
        hooks: &mut Hooks,
    ) -> std::result::Result<Plan, PlanError> {
        let coarse_grid = !spare.joints.is_empty() || problem.volume.is_some();
        let looked_at = problem.for_search();
        let finest = if problem.pace.is_some() && !coarse_grid { FINE } else { 1 };
        let mut known = Layers::new(&looked_at, settings, spare, finest)?;
        let mut parts = match &self.warm_start {
            Some(earlier) => earlier.refined(problem, &self.path, settings.max_iterations, hooks)?,
            None => Vec::new(),
        };
        let mut ways = Vec::new();
        // Finer grids have many more steps to ask of.
        let coarse = !spare.joints.is_empty() || hooks.edge_cost.is_some() || problem.volume.is_some();
        if parts.is_empty() {
            let searches = settings.searches(coarse);
            for search in 0..searches {
                hooks.begin(search, searches);
                if search > 0 {
                    known = known.finer(1 << search, worst(&parts))?;
                }
                let found = searched(problem, &mut known, settings.max_iterations, hooks)?;
                if search == 0 {
                    ways = found.ways;
                }
                parts = better_parts(problem.criterion, parts, found.parts);
                hooks.enter(Phase::Prove);
                if settings.is_bounded() {
                    parts = improved(problem, &mut known, parts, settings.max_iterations, hooks)?;
                }
                if !is_worth_more(problem, &mut known, &parts, hooks)? {
                    break;
                }
            }
        }
        for q in rivals {
            let part = refined_part(problem, 0, q, settings.max_iterations, hooks)?;
            let own = problem.holds(0, q).then(|| as_is(problem, q, &part));
            let part = best_part(problem.criterion, own.into_iter().chain([part]).collect());
            parts = better_parts(problem.criterion, parts, vec![weighed(problem, part, q, hooks)?]);
        }
        let parts = or_led(problem, &known, parts, settings.max_iterations, hooks)?;
        let parts = parts.into_iter().map(|part| polished(problem, part, hooks)).collect::<std::result::Result<Vec<_>, _>>()?;
        let parts = parts.into_iter().map(|part| without_leaps(problem, &self.path, settings, part, hooks));
        let parts = parts.collect::<std::result::Result<Vec<_>, _>>()?;
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
        plan.ways = ways;
        Ok(plan)
    }
}

/// Postures of the whole path as they are, as a part that a refinement of theirs is compared with.
fn as_is(problem: &PathProblem, q: &[f64], refined: &Part) -> Part {
    let (value, motion) = (problem.worth(0, q), problem.motion_integral(0, q));
    let part = Part { first: 0, q: q.to_vec(), value, motion, residual: f64::NAN, refined: false, failure: None, ..refined.clone() };
    Part { cost: cost(problem, &part), ..part }
}

/// The path, the task and the settings of a tool that is not tilted, where a volume holds it: its spin is bounded as the volume's.
fn upright_goal(path: &Path, volume: &OrientationVolume, settings: &PlanSettings) -> Result<Option<(Path, Task, PlanSettings)>> {
    let Some(spins) = upright(volume) else { return Ok(None) };
    let path = if path.rotation().is_some() {
        let turn = Frame { axes: volume.reference().axes(), origin: [0.0; 3] };
        let frames = volume_frames(path, volume, settings.closed)?;
        let rotation: Vec<[Vec3; 3]> = frames.iter().map(|frame| frame.compose(&turn).axes).collect();
        let axis = rotation.iter().map(|axes| axes[2]).collect();
        Path::new(path.position().to_vec(), axis, Some(rotation), path.time().map(<[f64]>::to_vec))?
    } else {
        volume_frames(path, volume, settings.closed)?;
        path.clone()
    };
    if spins.is_fixed() {
        let turn = Frame::rotation([0.0, 0.0, 1.0], spins.low);
        let rotation =
            path.rotation().map(|all| all.iter().map(|axes| Frame { axes: *axes, origin: [0.0; 3] }.compose(&turn).axes).collect());
        let fixed = Path::new(path.position().to_vec(), path.axis().to_vec(), rotation, path.time().map(<[f64]>::to_vec))?;
        return Ok(Some((fixed, Task::FULL, settings.clone())));
    }
    let spin_range = if spins.is_free() { None } else { Some((spins.low, spins.high)) };
    Ok(Some((path, Task::axisymmetric([0.0, 0.0, 1.0])?, PlanSettings { spin_range, ..settings.clone() })))
}
