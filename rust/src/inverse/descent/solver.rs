//! The five algorithms as one solver: sweeps, when to stop, what came of it.

use std::sync::Arc;

use super::cost::Cost;
use super::cyclic::Order;
use super::state::{Problem, State};
use super::steps::{Joints, Rule};
use crate::error::{Error, Result, check_length};
use crate::robot::{Limits, Robot};
use crate::task::OrientationVolume;

/// Two costs are equal when they differ by less than this part: they are sums of squares of residuals.
const EQUAL: f64 = 4.0 * f64::EPSILON;

/// What a sweep does (From and Gravdahl 2007, section 5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Algorithm {
    /// 1: coordinate descent, each joint once (5.3).
    Cyclic(Order),
    /// 2: as many times as there are joints, the joint with the largest decrease (5.4).
    LargestDecrease {
        /// Of its way to the minimum, above 0 and at most 1.
        share: Joints,
    },
    /// 3: the one with the largest decrease over its change (5.5).
    LargestRate {
        /// As above.
        share: Joints,
    },
    /// 4: all joints at once, `q + step W x` (5.6).
    Together {
        /// W.
        weights: Joints,
        /// w_s.
        step: f64,
    },
    /// 5: along an estimate of the gradient (5.7).
    Gradient(Rule),
}

impl Algorithm {
    /// The bound `2 / sum W` of the step of algorithm 4 where the step is above it: below it, sweeps next to a goal are stable.
    pub fn largest_safe_step(&self, n: usize) -> Option<f64> {
        let Self::Together { weights, step } = self else { return None };
        let most = 2.0 / weights[..n].iter().sum::<f64>();
        (*step > most).then_some(most)
    }

    /// Whether no sweep raises the cost.
    pub fn is_monotone(&self) -> bool {
        matches!(self, Self::Cyclic(_) | Self::LargestDecrease { .. } | Self::LargestRate { .. } | Self::Gradient(Rule::Search))
    }
}

/// When a solver stops.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Position error \[m\] and angle of the orientation \[rad\], both, that are near enough.
    pub residuals: (f64, f64),
    /// Largest slope of the cost along a free joint that counts as none.
    pub slope: f64,
    /// Sweeps at most.
    pub sweeps: usize,
}

/// Why it stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// The residuals are small enough, and nothing but the tool has a cost.
    Converged,
    /// No joint alone can lower the cost.
    Stationary,
    /// The last two costs are equal within rounding, or a monotone algorithm found none that is lower.
    Stalled,
    /// As many sweeps as were allowed.
    Sweeps,
}

impl Stopped {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Stationary => "stationary",
            Self::Stalled => "stalled",
            Self::Sweeps => "out of sweeps",
        }
    }
}

/// Where a descent ended.
#[derive(Debug, Clone)]
pub struct Descended {
    /// Joint coordinates [rad or m].
    pub q: Vec<f64>,
    /// Cost before the first sweep and after each.
    pub costs: Vec<f64>,
    /// Position error \[m\] and angle of the orientation \[rad\] at the end.
    pub residuals: (f64, f64),
    /// Why it ended.
    pub stopped: Stopped,
}

/// The postures of a descent.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Cost before the first sweep and after each.
    pub costs: Vec<f64>,
    /// Joints before the first sweep and after each, by rows.
    pub postures: Vec<f64>,
    /// Joints that algorithms 2 and 3 moved, one for each joint of the robot a sweep; `None` where none lowered the cost.
    pub picks: Vec<Option<usize>>,
}

/// A descent of a cost over the joints of a robot, one by one in closed form.
#[derive(Debug, Clone)]
pub struct Descent {
    robot: Arc<Robot>,
    cost: Cost,
    volume: Option<OrientationVolume>,
    algorithm: Algorithm,
    limits: bool,
}

impl Descent {
    /// For a robot whose joints are all free; with `limits` it keeps those of the robot.
    pub fn new(robot: Arc<Robot>, cost: Cost, algorithm: Algorithm, limits: bool) -> Result<Self> {
        Problem::new(&robot, &cost, limits.then(|| robot.limits()))?;
        check_algorithm(&algorithm, robot.n())?;
        Ok(Self { robot, cost, volume: None, algorithm, limits })
    }

    /// The same to a set of orientations in the base frame: before each sweep the member nearest to the present orientation becomes the wanted one. No sweep of a
    /// monotone algorithm raises the cost then either, because no member is nearer.
    pub fn within(self, volume: OrientationVolume) -> Self {
        Self { volume: Some(volume), ..self }
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// What a sweep does.
    pub fn algorithm(&self) -> &Algorithm {
        &self.algorithm
    }

    /// The cost of a posture.
    pub fn cost(&self, q: &[f64]) -> Result<f64> {
        check_length("q", q, self.robot.n())?;
        Ok(self.problem().at(q).cost)
    }

    /// The derivative of the cost along each joint: exact, the b of its closed form.
    pub fn gradient(&self, q: &[f64]) -> Result<Vec<f64>> {
        check_length("q", q, self.robot.n())?;
        let (problem, n) = (self.problem(), q.len());
        let state = problem.at(q);
        Ok((0..n).map(|i| problem.form(&state, i).slope()).collect())
    }

    /// Moves `q` by one sweep and returns the cost there. A posture beyond its limits is put onto them first.
    pub fn sweep(&self, q: &mut [f64]) -> Result<f64> {
        let problem = self.problem();
        let mut state = self.start(&problem, q)?;
        self.step(&problem, &mut state, &mut |_| {});
        q.copy_from_slice(&state.q[..q.len()]);
        Ok(state.cost)
    }

    /// Sweeps until it has to stop.
    pub fn solve(&self, q: &[f64], stop: Stop) -> Result<Descended> {
        let problem = self.problem();
        let mut state = self.start(&problem, q)?;
        let mut costs = vec![state.cost];
        let mut moves = true;
        let stopped = loop {
            let residuals = state.places.goal.residuals(&state.places.tool);
            if self.cost.is_of_tool_alone() && residuals.0 <= stop.residuals.0 && residuals.1 <= stop.residuals.1 {
                break Stopped::Converged;
            }
            if problem.steepest(&state) <= stop.slope {
                break Stopped::Stationary;
            }
            if !moves {
                break Stopped::Stalled;
            }
            if costs.len() > stop.sweeps {
                break Stopped::Sweeps;
            }
            moves = self.step(&problem, &mut state, &mut |_| {});
            costs.push(state.cost);
        };
        let residuals = state.places.goal.residuals(&state.places.tool);
        Ok(Descended { q: state.q[..q.len()].to_vec(), costs, residuals, stopped })
    }

    /// As many sweeps as are asked for, with all that they pass.
    pub fn trace(&self, q: &[f64], sweeps: usize) -> Result<Trace> {
        let problem = self.problem();
        let mut state = self.start(&problem, q)?;
        let mut trace = Trace { costs: vec![state.cost], postures: state.q[..q.len()].to_vec(), picks: Vec::new() };
        for _ in 0..sweeps {
            self.step(&problem, &mut state, &mut |joint| trace.picks.push(joint));
            trace.costs.push(state.cost);
            trace.postures.extend_from_slice(&state.q[..q.len()]);
        }
        Ok(trace)
    }

    fn problem(&self) -> Problem<'_> {
        Problem { robot: &self.robot, cost: &self.cost, volume: self.volume.as_ref(), limits: self.limits.then(|| self.robot.limits()) }
    }

    fn start(&self, problem: &Problem, q: &[f64]) -> Result<State> {
        check_length("q", q, self.robot.n())?;
        let mut inside = [0.0; crate::linalg::MAX_JOINTS];
        let inside = &mut inside[..q.len()];
        inside.copy_from_slice(q);
        if problem.limits.is_some_and(|limits: &Limits| !limits.pull_inside(inside)) {
            return Err(Error::value("q", format!("{q:?}"), "a posture that can be put within the limits"));
        }
        Ok(problem.at(inside))
    }

    /// One sweep; whether the cost changed by more than rounding. An algorithm that is monotone keeps what it had where rounding is all that is left.
    fn step(&self, problem: &Problem, state: &mut State, picked: &mut dyn FnMut(Option<usize>)) -> bool {
        let n = self.robot.n();
        let there = match &self.algorithm {
            Algorithm::Cyclic(order) => Some(problem.at(&problem.cyclic(state, *order)[..n])),
            Algorithm::LargestDecrease { share } => return picks(problem, state, false, share, picked),
            Algorithm::LargestRate { share } => return picks(problem, state, true, share, picked),
            Algorithm::Together { weights, step } => Some(problem.at(&problem.together(state, weights, *step)[..n])),
            Algorithm::Gradient(rule) => problem.along_estimate(state, rule),
        };
        there.is_some_and(|there| take(state, there, self.algorithm.is_monotone()))
    }
}

/// Takes a new posture; whether the cost changed by more than rounding. Where it may not rise and does, the old one stays.
fn take(state: &mut State, there: State, monotone: bool) -> bool {
    let change = there.cost - state.cost;
    if !monotone || change <= 0.0 {
        let moved = change.abs() > EQUAL * state.cost.abs();
        *state = there;
        return moved;
    }
    false
}

/// As many single moves as there are joints.
fn picks(problem: &Problem, state: &mut State, by_rate: bool, share: &Joints, picked: &mut dyn FnMut(Option<usize>)) -> bool {
    let n = problem.robot.n();
    let mut moved = false;
    for _ in 0..n {
        let choice = problem.largest(state, by_rate, share);
        picked(choice.map(|(_, joint)| joint));
        if let Some((q, _)) = choice {
            moved |= take(state, problem.at(&q[..n]), true);
        }
    }
    moved
}

fn check_algorithm(algorithm: &Algorithm, n: usize) -> Result<()> {
    let within = |name: &str, values: &Joints, most: f64| {
        let wrong = values[..n].iter().position(|w| !(*w > 0.0 && *w <= most && w.is_finite()));
        wrong.map_or(Ok(()), |i| {
            let expected = if most.is_finite() { format!("above 0, at most {most}") } else { "a finite weight above 0".into() };
            Err(Error::value(&format!("{name}[{i}]"), values[i], &expected))
        })
    };
    match algorithm {
        Algorithm::LargestDecrease { share } | Algorithm::LargestRate { share } => within("weights", share, 1.0),
        Algorithm::Together { weights, step } => {
            within("weights", weights, f64::INFINITY)?;
            if *step > 0.0 && step.is_finite() { Ok(()) } else { Err(Error::value("step", step, "a finite number above 0")) }
        }
        Algorithm::Gradient(Rule::Printed(weights) | Rule::Normalised(weights)) => within("weights", weights, f64::INFINITY),
        Algorithm::Cyclic(_) | Algorithm::Gradient(Rule::Search) => Ok(()),
    }
}
