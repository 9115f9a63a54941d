//! The settings of a plan, one set for every way to ask for one.

use std::f64::consts::PI;

use super::joint_weights::JointWeights;
use super::numbers::shown;
use super::pins::Pin;
use crate::error::{Error, Result};

/// Searches at most where nothing is said and the grid is small.
const EFFORT: usize = 2;
/// How far a tool is lifted off where nothing is said \[m\].
const LIFT_OFF: f64 = 0.05;

/// What a plan is best in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aim {
    /// The worst value on the path.
    Minimax,
    /// The mean value.
    Integral,
    /// The motion of the joints alone.
    Motion,
    /// The largest constant speed of the tool, by the speeds of the joints.
    Speed,
}

impl Aim {
    /// All of them, with the names that settings have for them.
    pub const NAMED: [(&'static str, Self); 4] =
        [("minimax", Self::Minimax), ("integral", Self::Integral), ("motion", Self::Motion), ("speed", Self::Speed)];

    /// The one of a name.
    ///
    /// # Errors
    /// [`Error::Value`] if there is none.
    pub fn named(name: &str) -> Result<Self> {
        let known = Self::NAMED.iter().find(|(known, _)| *known == name).map(|(_, aim)| *aim);
        let expected = || Self::NAMED.map(|(name, _)| format!("'{name}'")).join(", ");
        known.ok_or_else(|| Error::value("criterion", format!("'{name}'"), &format!("one of {}", expected())))
    }

    /// Whether values of an objective count.
    pub fn has_objective(self) -> bool {
        matches!(self, Self::Minimax | Self::Integral)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// How a path is planned. Angles in radians, joints counted from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanSettings {
    /// What is minimised.
    pub criterion: Aim,
    /// Whether position limits hold, and speed limits where the path has times.
    pub limits: bool,
    /// Weight of the integral of the squared joint speed over the path's share; next to nothing beside the value if not given.
    pub smoothness: Option<f64>,
    /// Weights of the joints in the motion, one a joint; 1 if not given.
    pub joint_weights: Option<Vec<f64>>,
    /// Spins of the search's grid.
    pub n_angles: usize,
    /// Points of the path at which the first search begins.
    pub layers: usize,
    /// Least and largest spin \[rad\]; a whole turn if not given.
    pub spin_range: Option<(f64, f64)>,
    /// Largest change of the spin from one point of the search to the next \[rad\].
    pub max_spin_step: f64,
    /// Largest motion of any joint from point to point [rad or m]; 0.25 rad for turning joints of paths without times if not given.
    pub max_step: Option<f64>,
    /// Joints on the grid; chosen if not given.
    pub spare: Option<Vec<usize>>,
    /// Values of each of them; chosen if not given.
    pub n_spare: Option<usize>,
    /// Branches that may be used; all if not given.
    pub branches: Option<Vec<usize>>,
    /// Whether the branch may change through a singularity.
    pub branch_changes: bool,
    /// Whether the last point, which has to be the first, is reached in the same posture up to whole turns.
    pub closed: bool,
    /// Whether to prove how good the plan is; done for the worst value if not given.
    pub bound: Option<bool>,
    /// Searches at most; chosen if not given.
    pub effort: Option<usize>,
    /// Newton steps of the refinement at most.
    pub max_iterations: usize,
    /// The posture in which the path begins [rad or m]; any if not given.
    pub start: Option<Vec<f64>>,
    /// The posture in which it ends.
    pub end: Option<Vec<f64>>,
    /// What is held at points between.
    pub pins: Vec<Pin>,
    /// Whether the path may be left and entered again in another posture where no single way exists.
    pub reconfigurations: bool,
    /// How far the tool is lifted off for that \[m\].
    pub lift_off: f64,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self {
            criterion: Aim::Minimax,
            limits: true,
            smoothness: None,
            joint_weights: None,
            n_angles: 48,
            layers: 32,
            spin_range: None,
            max_spin_step: PI / 3.0,
            max_step: None,
            spare: None,
            n_spare: None,
            branches: None,
            branch_changes: false,
            closed: false,
            bound: None,
            effort: None,
            max_iterations: 200,
            start: None,
            end: None,
            pins: Vec::new(),
            reconfigurations: false,
            lift_off: LIFT_OFF,
        }
    }
}

impl PlanSettings {
    /// Checks every setting that can be checked without robot, path and task.
    ///
    /// # Errors
    /// [`Error::Value`] with the first that is out of its domain.
    pub fn check(&self) -> Result<()> {
        let counts = [
            ("layers", Some(self.layers)),
            ("effort", self.effort),
            ("max_iterations", Some(self.max_iterations)),
            ("n_angles", Some(self.n_angles)),
            ("n_spare", self.n_spare),
        ];
        if let Some((name, _)) = counts.iter().find(|(_, count)| *count == Some(0)) {
            return Err(Error::value(name, 0, "at least 1"));
        }
        if self.criterion == Aim::Speed && self.reconfigurations {
            return Err(Error::value(
                "reconfigurations",
                "True with the criterion 'speed'",
                "False: a constant speed is one of a path that is not left",
            ));
        }
        match self.smoothness {
            Some(x) if !(x >= 0.0 && x.is_finite()) => return Err(Error::value("smoothness", shown(x), "a finite number of at least 0")),
            _ => {}
        }
        if let Some(weights) = &self.joint_weights {
            JointWeights::check(weights)?;
        }
        if !(self.lift_off >= 0.0 && self.lift_off.is_finite()) {
            return Err(Error::value("lift_off", shown(self.lift_off), "a length of at least 0 [m]"));
        }
        let step = self.max_spin_step;
        if !(step > 0.0 && step <= PI) {
            return Err(Error::value("max_spin_step", shown(step), "an angle above 0, at most pi [rad]"));
        }
        match self.max_step {
            Some(x) if x.is_nan() || x <= 0.0 => Err(Error::value("max_step", shown(x), "a number above 0")),
            _ => Ok(()),
        }
    }

    /// Searches at most, for a robot with or without joints to spare.
    pub(super) fn searches(&self, spare: bool) -> usize {
        // Grids with joints to spare are large, and of motion and speed it is not known whether more can be gained.
        self.effort.unwrap_or(if spare || !self.criterion.has_objective() { 1 } else { EFFORT })
    }

    /// Whether the plan is proven.
    pub(super) fn is_bounded(&self) -> bool {
        self.bound.unwrap_or(self.criterion == Aim::Minimax)
    }
}
