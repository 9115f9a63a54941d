//! What a robot does with the freedom that the task leaves: the motion h that a secondary task asks for.

use super::methods::Posed;
use crate::error::{Result, check_positive, check_vector};
use crate::index::{Index, Kind, Objective, Order, Rows};
use crate::kinematics::sized::Jacobian;
use crate::linalg::{MAX_JOINTS, size};
use crate::resolve::sqp::{Bounds, Known, newton_step};
use crate::robot::Robot;
use crate::task::Constraint;

/// Largest secondary motion of a joint in one step [rad or m].
const RADIUS: f64 = 0.3;
/// Above this, as at a singularity itself, the parameter of singularity is taken as this.
const LARGEST_PARAMETER: f64 = 1e6;

/// How the gradient of an objective becomes a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scaling {
    /// Minus the gradient.
    Gradient,
    /// A Newton step in the redundant subspace.
    Newton,
}

/// The pull towards a posture, and away from where the robot came close to a singularity (Huo 2009, eq. 3.17, 3.31, 4.9, 4.12):
/// `h = W (middle - q) + K w_ps (q_s - q)`, the second part while `w_ps >= threshold`, with q_s the posture at which it was crossed.
#[derive(Debug, Clone)]
pub struct PosturePull {
    w: [f64; MAX_JOINTS],
    k: [f64; MAX_JOINTS],
    middle: [f64; MAX_JOINTS],
    threshold: f64,
    parameter: Option<Objective>,
}

impl PosturePull {
    /// Weights of both parts and the posture of the first, one number a joint: no second part if `k` is not given, the middle of the ranges
    /// ([`Robot::middle`]) if `middle` is not. The length is that of the parameter of singularity.
    pub fn new(robot: &Robot, w: &[f64], k: Option<&[f64]>, middle: Option<&[f64]>, threshold: f64, length: f64) -> Result<Self> {
        let n = robot.n();
        let none = [0.0; MAX_JOINTS];
        let ranges = robot.middle();
        let (k, middle) = (k.unwrap_or(&none[..n]), middle.unwrap_or(&ranges));
        for (name, values) in [("w", w), ("k", k), ("middle", middle)] {
            check_vector(name, values, n)?;
        }
        check_positive("threshold", threshold)?;
        let rows = Rows::all(length)?;
        let wide = |values: &[f64]| std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0));
        let parameter = if k.iter().any(|x| *x != 0.0) {
            let parameter = Objective::new(vec![(1.0, Index::of(Kind::SingularityParameter, rows, false))])?;
            parameter.check(robot)?;
            Some(parameter)
        } else {
            None
        };
        Ok(Self { w: wide(w), k: wide(k), middle: wide(middle), threshold, parameter })
    }

    #[inline(always)]
    fn motion<const C: usize>(&self, robot: &Robot, q: &[f64], jacobian: &Jacobian<C>, memory: &mut Memory) -> [f64; C] {
        let n = size::<C>(robot.n());
        let mut h = [0.0; C];
        for i in 0..n {
            h[i] = self.w[i] * (self.middle[i] - q[i]);
        }
        if let Some(parameter) = &self.parameter {
            let value = parameter.evaluate_at(robot, q, jacobian, Order::Value, false).value.min(LARGEST_PARAMETER);
            if value >= self.threshold {
                let anchor = memory.anchor.get_or_insert_with(|| std::array::from_fn(|i| q.get(i).copied().unwrap_or(0.0)));
                for i in 0..n {
                    h[i] += self.k[i] * value * (anchor[i] - q[i]);
                }
            } else {
                memory.anchor = None;
            }
        }
        h
    }
}

/// What a solver remembers from step to step: the posture at which the threshold was crossed, and the rates of a tick within a volume.
#[derive(Debug, Clone, Copy, Default)]
pub struct Memory {
    anchor: Option<[f64; MAX_JOINTS]>,
    pub(super) rates: [f64; MAX_JOINTS],
}

/// A secondary task.
#[derive(Debug, Clone)]
pub enum Secondary {
    /// None: the shortest motion.
    None,
    /// An objective falls.
    Objective(Objective, Scaling),
    /// The pull of a posture.
    Pull(Box<PosturePull>),
}

impl Secondary {
    /// The motion it asks for, and whether it could be evaluated: zero where it could not. Never longer than 0.3 rad or m a joint.
    #[inline(never)]
    pub(super) fn motion<const C: usize>(&self, robot: &Robot, q: &[f64], at: &Posed<'_, C>, memory: &mut Memory) -> ([f64; C], bool) {
        let jacobian = at.jacobian;
        let n = size::<C>(robot.n());
        let mut h = match self {
            Self::None => return ([0.0; C], true),
            Self::Pull(pull) => pull.motion(robot, q, jacobian, memory),
            Self::Objective(objective, Scaling::Gradient) => {
                objective.evaluate_at(robot, q, jacobian, Order::Gradient, false).gradient.map(|g| -g)
            }
            Self::Objective(objective, Scaling::Newton) => {
                let objective = objective.evaluate_at(robot, q, jacobian, Order::Hessian, false);
                let constraint = Constraint::of(at.directions);
                let known = Known { jacobian, objective: &objective, constraint: &constraint, turning: None, wanted: [0.0; 6] };
                let open = Bounds { low: [f64::NEG_INFINITY; C], high: [f64::INFINITY; C], rows: &[], radius: RADIUS, gain: 1.0 };
                if !objective.gradient[..n].iter().all(|g| g.is_finite()) {
                    return ([0.0; C], false);
                }
                newton_step(&known, &open).dq
            }
        };
        let largest = h[..n].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if !h[..n].iter().all(|x| x.is_finite()) {
            return ([0.0; C], false);
        }
        for i in n..C {
            h[i] = 0.0;
        }
        (if largest > RADIUS { h.map(|x| x * (RADIUS / largest)) } else { h }, true)
    }

    /// Its value at a posture, NaN for a pull or nothing.
    pub(super) fn value<const C: usize>(&self, robot: &Robot, q: &[f64]) -> f64 {
        match self {
            Self::Objective(objective, _) => objective.value_sized::<C>(robot, q),
            Self::None | Self::Pull(_) => f64::NAN,
        }
    }
}
