//! From a route through a grid to the optimum of the continuous path: a primal-dual interior-point method with exact second derivatives
//! (Nocedal and Wright 2006, chapter 19), every iterate on the path and within what has to hold.

use super::constraints::{Common, Constraint, Kind, constraints};
use super::newton_system::{Direction, Model, moved, widening_weight};
use super::points::Point;
use super::problem::PathProblem;
use crate::linalg::with_capacity;
use crate::robot::AT_LIMIT;

/// The sum of slack times multiplier at the start and at the end, relative to what is minimised.
const FIRST_GAP: f64 = 1e-2;
const LAST_GAP: f64 = 1e-9;
/// Factor by which the barrier's weight falls.
const FALL: f64 = 0.04;
/// Residual at which the barrier's weight falls, relative to the weight.
const CENTRED: f64 = 10.0;
/// Part of a slack that a step may not take.
const KEPT: f64 = 0.005;
/// Longest motion of a joint in one step [rad or m].
const LONGEST: f64 = 0.4;
/// Trial lengths of a step.
const MAX_HALVINGS: usize = 20;
/// Times that a step is corrected for the curvature of a volume's bounds, and the part of the room to them that it has to leave.
const CORRECTIONS: usize = 3;
const SHORT: f64 = 0.9;
/// Part of the slope that a step has to gain (Armijo).
const DECREASE: f64 = 1e-4;
/// Rounding of the barrier function, relative to its size.
const ROUNDING: f64 = 1e-14;
/// A slope below this part of that rounding, relative, is none.
const UNSEEN: f64 = 1e-2;
/// Residual that is an optimum where rounding keeps it from getting smaller, relative to the scale of what is minimised.
const SETTLED: f64 = 1e-8;
/// A step of the joints below this [rad or m] is none.
const STILL: f64 = 1e-15;
/// Least and largest multiplier, as a multiple of `mu / slack`.
const LEAST_DUAL: f64 = 1e-8;
const LARGEST_DUAL: f64 = 1e8;
/// How far the ceiling starts above the worst value, relative to it, and the least size of a value for that.
const HEADROOM: f64 = 1e-3;
const LEAST_VALUE: f64 = 1e-3;
/// Least scale of what is minimised, and least slope of a slack with the widening.
const TINY: f64 = 1e-12;
/// How far the limits are widened at the start beyond what is missing: as a factor, and beside it.
const WIDER: f64 = 1.1;
const WIDER_BY: f64 = 1e-6;
/// A point that starts on a limit, as where its posture has no choice, has this much room beyond it [rad or m]: more than rounding takes.
const ROOM: f64 = 0.1 * AT_LIMIT;

/// How a refinement ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefineStatus {
    /// First-order residual and gap are below their tolerances.
    Converged,
    /// The iterations, or the digits, were used up.
    Stopped,
    /// Limits leave no path near: what remains beyond them is as little as was found.
    Infeasible,
    /// Some point cannot be brought onto the path, or has no free motion.
    Singular,
    /// The caller ended it.
    Cancelled,
}

/// A refined path.
#[derive(Debug, Clone)]
pub struct Refined {
    /// Postures, n joints a row.
    pub q: Vec<f64>,
    /// Values of the objective.
    pub values: Vec<f64>,
    /// What was minimised.
    pub cost: f64,
    /// Largest slope of the Lagrangian along a free motion.
    pub residual: f64,
    /// How it ended.
    pub status: RefineStatus,
    /// The constraint that resists most, when infeasible.
    pub tightest: Option<Constraint>,
}

/// Postures, and what the barrier needs of them.
struct State<const C: usize> {
    q: Vec<[f64; C]>,
    values: Vec<f64>,
    common: Common,
    slack: Vec<f64>,
    dual: Vec<f64>,
}

/// The iteration.
struct Solver<'a, const C: usize> {
    problem: &'a PathProblem,
    constraints: Vec<Constraint>,
    scale: f64,
}

/// Refines the postures `q`, n joints a row and one row a point, each on or near its target. `cancelled` is asked before every step.
pub fn refine(problem: &PathProblem, q: &[f64], max_iterations: usize, cancelled: &mut dyn FnMut() -> bool) -> Refined {
    with_capacity!(problem.n(), refine_in(problem, q, max_iterations, cancelled))
}

fn refine_in<const C: usize>(problem: &PathProblem, rows: &[f64], max_iterations: usize, cancelled: &mut dyn FnMut() -> bool) -> Refined {
    let n = problem.n();
    let mut q: Vec<[f64; C]> = rows.chunks_exact(n).map(padded).collect();
    if !problem.restore(&mut q) {
        let values = problem.values_at(&q);
        let (cost, residual, status) = (f64::NAN, f64::NAN, RefineStatus::Singular);
        return Refined { q: flat(&q, n), values, cost, residual, status, tightest: None };
    }
    let values = problem.values_at(&q);
    let worst = values.iter().fold(problem.slowest(&q), |m, v| m.max(*v));
    let common = Common { ceiling: worst + HEADROOM * worst.abs().max(LEAST_VALUE), widening: 0.0 };
    let mut solver = Solver { problem, constraints: constraints(problem, false), scale: 1.0 };
    let mut state = State { q, values, common, slack: Vec::new(), dual: Vec::new() };
    solver.scale = solver.cost(&state.q, &state.values, &state.common).abs().max(TINY);
    state.slack = solver.slacks(&state.q, &state.values, &state.common);
    make_room(&mut solver.constraints, &mut state.slack);
    let least = state.slack.iter().zip(&solver.constraints).map(|(s, c)| s / c.widening_slope().max(TINY)).fold(f64::INFINITY, f64::min);
    if least <= 0.0 {
        // Not within the limits: they are widened until it is, and the widening is what costs most.
        solver.constraints = constraints(problem, true);
        let mut slack = solver.slacks(&state.q, &state.values, &state.common);
        make_room(&mut solver.constraints, &mut slack);
        state.common.widening = -WIDER * least + WIDER_BY;
        state.slack = solver.slacks(&state.q, &state.values, &state.common);
    }
    solver.run(state, max_iterations, cancelled)
}

/// Points that are on a limit get room beyond it.
fn make_room(constraints: &mut [Constraint], slack: &mut [f64]) {
    for (c, slack) in constraints.iter_mut().zip(slack) {
        if matches!(c.kind, Kind::Position | Kind::Combination) && *slack < ROOM && *slack > -AT_LIMIT - ROOM {
            (c.bound, *slack) = (c.bound + ROOM - *slack, ROOM);
        }
    }
}

/// A posture in the capacity of the kernels.
fn padded<const C: usize>(row: &[f64]) -> [f64; C] {
    let mut q = [0.0; C];
    q[..row.len()].copy_from_slice(row);
    q
}

fn flat<const C: usize>(q: &[[f64; C]], n: usize) -> Vec<f64> {
    q.iter().flat_map(|q| &q[..n]).copied().collect()
}

impl<const C: usize> Solver<'_, C> {
    fn slacks(&self, q: &[[f64; C]], values: &[f64], common: &Common) -> Vec<f64> {
        let sides = self.problem.sides_at(q);
        self.constraints.iter().map(|c| c.slack(self.problem, q, values, &sides, common)).collect()
    }

    /// What is minimised.
    fn cost(&self, q: &[[f64; C]], values: &[f64], common: &Common) -> f64 {
        let problem = self.problem;
        let mut motion = 0.0;
        for edge in 0..problem.edges() {
            motion += problem.joint_weights.squares(|k| problem.motion(q, edge, k)) / problem.steps[edge];
        }
        let own = if problem.has_ceiling() { common.ceiling } else { problem.weights.iter().zip(values).map(|(w, v)| w * v).sum() };
        own + problem.smoothness() * motion + widening_weight(self.scale) * common.widening
    }

    fn merit(&self, q: &[[f64; C]], values: &[f64], common: &Common, slack: &[f64], mu: f64) -> f64 {
        self.cost(q, values, common) - mu * slack.iter().map(|s| s.ln()).sum::<f64>()
    }

    fn run(mut self, mut state: State<C>, max_iterations: usize, cancelled: &mut dyn FnMut() -> bool) -> Refined {
        let count = self.constraints.len().max(1) as f64;
        let (mut mu, last) = (FIRST_GAP * self.scale / count, LAST_GAP * self.scale / count);
        if self.constraints.is_empty() {
            mu = last;
        }
        state.dual = state.slack.iter().map(|s| mu / s).collect();
        let (n, r) = (self.problem.n(), self.problem.freedoms());
        let mut out = (f64::NAN, RefineStatus::Stopped);
        let mut iterations = 0;
        while iterations < max_iterations {
            if cancelled() {
                out.1 = RefineStatus::Cancelled;
                break;
            }
            let Some(points) = self.problem.points_at(&state.q) else {
                out.1 = RefineStatus::Singular;
                break;
            };
            let model = Model::new(self.problem, &points, &self.constraints, &state.slack, &state.dual, mu, self.scale);
            out.0 = model.residual(&points, n, r);
            let complementarity = state.slack.iter().zip(&state.dual).map(|(s, y)| (s * y - mu).abs()).fold(0.0, f64::max);
            if out.0.max(complementarity) <= CENTRED * mu {
                if mu <= last {
                    out.1 = RefineStatus::Converged;
                    break;
                }
                mu = (FALL * mu).max(last);
                continue;
            }
            iterations += 1;
            let step = model.direction(self.problem, &points, &self.constraints);
            // Bounds of a volume, and of the speed, are many: rounding keeps the residual above what few of them leave.
            let many = self.problem.volume.is_some() || self.problem.pace.is_some();
            let told = ROUNDING * UNSEEN * self.scale;
            let taken = step.is_some_and(|step| (!many || step.slope < -told) && self.advance(&mut state, &points, &step, mu));
            if !taken {
                // Rounding has the last word at this weight.
                if mu <= last {
                    if many && out.0 <= SETTLED * self.scale && complementarity <= CENTRED * mu {
                        out.1 = RefineStatus::Converged;
                    }
                    break;
                }
                mu = (FALL * mu).max(last);
            }
            self.drop_widening(&mut state);
        }
        self.finish(state, out)
    }

    /// Takes the longest of the step, its half, ... that stays within everything and lowers the barrier function.
    fn advance(&self, state: &mut State<C>, points: &[Point<C>], step: &Direction<C>, mu: f64) -> bool {
        let before = self.merit(&state.q, &state.values, &state.common, &state.slack, mu);
        let longest = step.dq.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        let mut alpha = if longest > LONGEST { LONGEST / longest } else { 1.0 };
        for (s, ds) in state.slack.iter().zip(&step.slack) {
            if *ds < 0.0 {
                alpha = alpha.min((1.0 - KEPT) * s / -ds);
            }
        }
        let rounding = ROUNDING * (before.abs() + self.scale);
        for _ in 0..MAX_HALVINGS {
            let mut q = state.q.clone();
            for (q, dq) in q.iter_mut().zip(&step.dq) {
                for k in 0..C {
                    q[k] += alpha * dq[k];
                }
            }
            if self.problem.restore(&mut q) && self.corrected(&mut q, state, points, step, alpha) {
                let values = self.problem.values_at(&q);
                let common = moved(&state.common, &step.common, alpha);
                let slack = self.slacks(&q, &values, &common);
                if slack.iter().all(|s| *s > 0.0)
                    && self.merit(&q, &values, &common, &slack, mu) <= before + DECREASE * alpha * step.slope + rounding
                {
                    self.update_duals(state, step, &slack, mu);
                    *state = State { q, values, common, slack, dual: std::mem::take(&mut state.dual) };
                    return longest * alpha > STILL || alpha * step.common[0].abs() > 0.0;
                }
            }
            alpha *= 0.5;
        }
        false
    }

    /// Draws postures after a step to where the step was to bring them, as the bounds of a volume see it: along these, which are curved, a step would else be short.
    /// Whether they stay on the path.
    fn corrected(&self, q: &mut [[f64; C]], state: &State<C>, points: &[Point<C>], step: &Direction<C>, alpha: f64) -> bool {
        let (n, r) = (self.problem.n(), self.problem.freedoms());
        let common = moved(&state.common, &step.common, alpha);
        for _ in 0..if self.problem.volume.is_some() { CORRECTIONS } else { 0 } {
            let sides = self.problem.sides_at(q);
            let mut changed = false;
            for (i, c) in self.constraints.iter().enumerate().filter(|(_, c)| c.kind == Kind::Side) {
                let wanted = state.slack[i] + alpha * step.slack[i];
                let slack = c.slack(self.problem, q, &state.values, &sides, &common);
                if slack > SHORT * wanted {
                    continue;
                }
                let point = &points[c.point];
                let gradient = point.side_gradient(c.joint);
                let along: Vec<f64> = point.basis[..r].iter().map(|z| (0..n).map(|k| z[k] * gradient[k]).sum()).collect();
                let square: f64 = along.iter().map(|x| x * x).sum();
                if square > 0.0 {
                    let factor = (wanted - slack) / square;
                    (0..n).for_each(|k| q[c.point][k] += factor * point.basis[..r].iter().zip(&along).map(|(z, x)| x * z[k]).sum::<f64>());
                    changed = true;
                }
            }
            if !changed {
                return true;
            }
            if !self.problem.restore(q) {
                return false;
            }
        }
        true
    }

    /// Multipliers by their own Newton step, kept positive and near `mu / slack`.
    fn update_duals(&self, state: &mut State<C>, step: &Direction<C>, slack: &[f64], mu: f64) {
        let change: Vec<f64> = state.dual.iter().zip(&state.slack).zip(&step.slack).map(|((y, s), ds)| mu / s - y - y / s * ds).collect();
        let mut alpha = 1.0f64;
        for (y, dy) in state.dual.iter().zip(&change) {
            if *dy < 0.0 {
                alpha = alpha.min((1.0 - KEPT) * y / -dy);
            }
        }
        for ((y, dy), s) in state.dual.iter_mut().zip(&change).zip(slack) {
            *y = (*y + alpha * dy).clamp(LEAST_DUAL * mu / s, LARGEST_DUAL * mu / s);
        }
    }

    /// Once the path is within its true limits they hold from there on.
    fn drop_widening(&mut self, state: &mut State<C>) {
        if state.common.widening == 0.0 {
            return;
        }
        let common = Common { widening: 0.0, ..state.common };
        let own = self.constraints.len() - 1;
        let mut slack = self.slacks(&state.q, &state.values, &common);
        slack.truncate(own);
        if slack.iter().all(|s| *s > 0.0) {
            self.constraints.truncate(own);
            state.dual.truncate(own);
            (state.common, state.slack) = (common, slack);
        }
    }

    fn finish(self, state: State<C>, (residual, status): (f64, RefineStatus)) -> Refined {
        let beyond = state.common.widening > AT_LIMIT;
        let tightest = beyond
            .then(|| {
                let forces = self.constraints.iter().zip(&state.dual).map(|(c, y)| (c, y * c.widening_slope()));
                forces.take(self.constraints.len() - 1).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(c, _)| *c)
            })
            .flatten();
        Refined {
            cost: self.cost(&state.q, &state.values, &Common { widening: 0.0, ..state.common }),
            q: flat(&state.q, self.problem.n()),
            values: state.values,
            residual,
            status: if beyond && status != RefineStatus::Cancelled { RefineStatus::Infeasible } else { status },
            tightest,
        }
    }
}
