//! The Newton system of a path under a barrier: a band of small blocks, one a point, bordered by the common variables.

use super::constraints::{Common, Constraint, Kind};
use super::points::Point;
use super::problem::PathProblem;
use crate::linalg::banded::Banded;

/// Common variables: ceiling and widening.
pub const COMMON: usize = 2;
/// Shifts of the diagonal tried before a system is given up.
const MAX_SHIFTS: usize = 25;
/// The first of them, relative to the largest entry of the diagonal, and the factor from one to the next.
const FIRST_SHIFT: f64 = 1e-10;
const SHIFT_GROWTH: f64 = 8.0;
/// Weight of the widening in what is minimised, relative to the rest.
const WIDENING_WEIGHT: f64 = 1e3;

/// A direction of all variables.
#[derive(Debug, Clone)]
pub struct Direction<const C: usize> {
    /// Of the postures.
    pub dq: Vec<[f64; C]>,
    /// Of ceiling and widening.
    pub common: [f64; COMMON],
    /// Change of every slack to first order.
    pub slack: Vec<f64>,
    /// Change of the barrier function to first order; negative.
    pub slope: f64,
}

/// Gradients and Hessian blocks, before they are reduced to the free motion.
pub struct Model<const C: usize> {
    /// Gradient of the Lagrangian.
    lagrangian: Vec<[f64; C]>,
    /// Gradient of the barrier function.
    barrier: Vec<[f64; C]>,
    hessian: Vec<[[f64; C]; C]>,
    /// Diagonal coupling along every edge.
    coupling: Vec<[f64; C]>,
    /// Columns of the border.
    border: [Vec<[f64; C]>; COMMON],
    corner: [f64; COMMON],
    lagrangian_common: [f64; COMMON],
    barrier_common: [f64; COMMON],
    /// Which common variables there are.
    present: [bool; COMMON],
}

/// Weight of the widening in what is minimised, relative to the rest.
pub fn widening_weight(scale: f64) -> f64 {
    WIDENING_WEIGHT * scale
}

impl<const C: usize> Model<C> {
    /// At the points, with slacks and multipliers, for the barrier's weight `mu`.
    pub fn new(
        problem: &PathProblem,
        points: &[Point<C>],
        constraints: &[Constraint],
        slack: &[f64],
        dual: &[f64],
        mu: f64,
        scale: f64,
    ) -> Self {
        let (count, n) = (points.len(), problem.n());
        let zero = vec![[0.0; C]; count];
        let minimax = problem.has_ceiling();
        let widened = constraints.last().is_some_and(|c| c.kind == Kind::Widening);
        let weight = widening_weight(scale);
        let mut model = Self {
            lagrangian: zero.clone(),
            barrier: zero.clone(),
            hessian: vec![[[0.0; C]; C]; count],
            coupling: vec![[0.0; C]; problem.edges()],
            border: [zero.clone(), zero],
            corner: [0.0; COMMON],
            lagrangian_common: [1.0, weight],
            barrier_common: [1.0, weight],
            present: [minimax, widened],
        };
        if !minimax {
            for (i, point) in points.iter().enumerate() {
                model.add_value(i, point, problem.weights[i], problem.weights[i], problem.weights[i], n);
            }
        }
        model.add_motion(problem, points, n);
        for ((c, s), y) in constraints.iter().zip(slack).zip(dual) {
            match c.kind {
                Kind::Combination => model.add_gradient(c, &problem.robot.limits().coupled[c.joint].row, *y, mu / s, y / s),
                Kind::Side => {
                    model.add_gradient(c, &points[c.point].side_gradient(c.joint), *y, mu / s, y / s);
                    points[c.point].add_side_hessian(c.joint, -y, &mut model.hessian[c.point]);
                }
                Kind::Spin => model.add_gradient(c, &points[c.point].spin_gradient(), *y, mu / s, y / s),
                _ => model.add_constraint(points, c, *y, mu / s, y / s, n),
            }
            model.add_widening(c, *y, mu / s, y / s);
        }
        model
    }

    /// The objective's value at a point, times weights for the Lagrangian, the barrier and the Hessian.
    fn add_value(&mut self, i: usize, point: &Point<C>, lagrangian: f64, barrier: f64, hessian: f64, n: usize) {
        for a in 0..n {
            self.lagrangian[i][a] += lagrangian * point.objective.gradient[a];
            self.barrier[i][a] += barrier * point.objective.gradient[a];
            for b in 0..n {
                self.hessian[i][a][b] += hessian * point.objective.hessian[a][b];
            }
        }
    }

    fn add_motion(&mut self, problem: &PathProblem, points: &[Point<C>], n: usize) {
        let q: Vec<[f64; C]> = points.iter().map(|point| point.q).collect();
        for edge in 0..problem.edges() {
            let next = (edge + 1) % points.len();
            let all = 2.0 * problem.smoothness() / problem.steps[edge];
            for k in 0..n {
                let factor = all * problem.joint_weights.of(k);
                let force = factor * problem.motion(&q, edge, k);
                for (i, sign) in [(next, 1.0), (edge, -1.0)] {
                    self.lagrangian[i][k] += sign * force;
                    self.barrier[i][k] += sign * force;
                    self.hessian[i][k][k] += factor;
                }
                self.coupling[edge][k] -= factor;
            }
        }
    }

    /// A slack with multiplier `y`, barrier force `force` and stiffness `w`.
    fn add_constraint(&mut self, points: &[Point<C>], c: &Constraint, y: f64, force: f64, w: f64, n: usize) {
        let widening = c.widening_slope();
        let (i, k) = (c.point, c.joint);
        match c.kind {
            Kind::Position => self.add_linear(i, k, c.sign, y, force, w, widening),
            Kind::Motion | Kind::Pace => {
                let next = (i + 1) % points.len();
                self.add_linear(next, k, c.sign, y, force, w, widening);
                self.add_linear(i, k, -c.sign, y, force, w, widening);
                self.coupling[i][k] -= w;
                if c.kind == Kind::Pace {
                    self.border[0][next][k] -= c.sign * w * c.bound;
                    self.border[0][i][k] += c.sign * w * c.bound;
                    self.corner[0] += w * c.bound * c.bound;
                    self.lagrangian_common[0] -= y * c.bound;
                    self.barrier_common[0] -= force * c.bound;
                }
            }
            Kind::Value => {
                self.add_value(i, &points[i], y, force, y, n);
                let gradient = points[i].objective.gradient;
                for a in 0..n {
                    self.border[0][i][a] -= w * gradient[a];
                    for b in 0..n {
                        self.hessian[i][a][b] += w * gradient[a] * gradient[b];
                    }
                }
                self.corner[0] += w;
                self.lagrangian_common[0] -= y;
                self.barrier_common[0] -= force;
            }
            Kind::Combination | Kind::Spin | Kind::Side | Kind::Widening => {}
        }
    }

    /// What a slack does through the widening.
    fn add_widening(&mut self, c: &Constraint, y: f64, force: f64, w: f64) {
        let widening = c.widening_slope();
        if widening != 0.0 && self.present[1] {
            self.corner[1] += w * widening * widening;
            self.lagrangian_common[1] -= y * widening;
            self.barrier_common[1] -= force * widening;
        }
    }

    /// A slack `... - sign x` of a quantity whose gradient is given.
    fn add_gradient(&mut self, c: &Constraint, gradient: &[f64], y: f64, force: f64, w: f64) {
        let (i, widening) = (c.point, c.widening_slope());
        for (a, along) in gradient.iter().enumerate() {
            self.lagrangian[i][a] += c.sign * y * along;
            self.barrier[i][a] += c.sign * force * along;
            self.border[1][i][a] -= c.sign * w * widening * along;
            for (b, other) in gradient.iter().enumerate() {
                self.hessian[i][a][b] += w * along * other;
            }
        }
    }

    /// One coordinate in a slack `... - sign q`.
    #[inline(always)]
    fn add_linear(&mut self, i: usize, k: usize, sign: f64, y: f64, force: f64, w: f64, widening: f64) {
        self.lagrangian[i][k] += sign * y;
        self.barrier[i][k] += sign * force;
        self.hessian[i][k][k] += w;
        self.border[1][i][k] -= sign * w * widening;
    }

    /// First-order residual: the largest slope of the Lagrangian along any free motion or common variable.
    pub fn residual(&self, points: &[Point<C>], n: usize, r: usize) -> f64 {
        let mut largest = 0.0f64;
        for (point, gradient) in points.iter().zip(&self.lagrangian) {
            for z in &point.basis[..r] {
                largest = largest.max((0..n).map(|k| z[k] * gradient[k]).sum::<f64>().abs());
            }
        }
        (0..COMMON).filter(|&k| self.present[k]).fold(largest, |m, k| m.max(self.lagrangian_common[k].abs()))
    }

    /// The Newton direction; `None` where no shift makes the system positive definite.
    pub fn direction(&self, problem: &PathProblem, points: &[Point<C>], constraints: &[Constraint]) -> Option<Direction<C>> {
        let (n, r, count) = (problem.n(), problem.freedoms(), points.len());
        let place = |i: usize| folded(i, count, problem.turns.is_some());
        let reach = if problem.turns.is_some() { 2 } else { 1 };
        let mut matrix = Banded::new(count * r, ((reach + 1) * r).saturating_sub(1));
        for (i, point) in points.iter().enumerate() {
            let free = problem.freedoms_at(i).min(r);
            // A motion that is held is none, and alone in its row.
            (free..r).for_each(|a| matrix.add(place(i) * r + a, place(i) * r + a, 1.0));
            if free == 0 {
                continue;
            }
            let block = point.reduce(&self.lagrangian[i], &self.hessian[i], free);
            for a in 0..free {
                for b in 0..=a {
                    matrix.add(place(i) * r + a, place(i) * r + b, block[a][b]);
                }
            }
        }
        for (edge, coupling) in self.coupling.iter().enumerate() {
            let next = (edge + 1) % count;
            for a in 0..r {
                for b in 0..r {
                    let (y, z) = (&points[edge].basis[a], &points[next].basis[b]);
                    matrix.add(place(edge) * r + a, place(next) * r + b, (0..n).map(|k| y[k] * coupling[k] * z[k]).sum());
                }
            }
        }
        let reduced = |vectors: &[[f64; C]]| {
            let mut out = vec![0.0; count * r];
            for (i, point) in points.iter().enumerate() {
                for a in 0..r {
                    out[place(i) * r + a] = (0..n).map(|k| point.basis[a][k] * vectors[i][k]).sum();
                }
            }
            out
        };
        let gradient = reduced(&self.barrier);
        let border = [reduced(&self.border[0]), reduced(&self.border[1])];
        let (z, common) = self.solve(&matrix, &gradient, &border)?;
        let mut direction = Direction { dq: vec![[0.0; C]; count], common, slack: Vec::new(), slope: 0.0 };
        for (i, point) in points.iter().enumerate() {
            for a in 0..r {
                for k in 0..n {
                    direction.dq[i][k] += z[place(i) * r + a] * point.basis[a][k];
                }
            }
        }
        direction.slope =
            gradient.iter().zip(&z).map(|(g, z)| g * z).sum::<f64>() + (0..COMMON).map(|k| self.barrier_common[k] * common[k]).sum::<f64>();
        direction.slack = constraints.iter().map(|c| slack_change(c, problem, points, &direction, n)).collect();
        Some(direction)
    }

    /// The bordered system, by its Schur complement.
    fn solve(&self, matrix: &Banded, gradient: &[f64], border: &[Vec<f64>; COMMON]) -> Option<(Vec<f64>, [f64; COMMON])> {
        let mut factor = matrix.clone();
        let mut shift = 0.0;
        for _ in 0..MAX_SHIFTS {
            if matrix.factor_into(shift, &mut factor)
                && let Some(found) = self.bordered(&factor, gradient, border)
            {
                return Some(found);
            }
            shift = if shift == 0.0 { FIRST_SHIFT * matrix.largest_diagonal() } else { SHIFT_GROWTH * shift };
        }
        None
    }

    fn bordered(&self, factor: &Banded, gradient: &[f64], border: &[Vec<f64>; COMMON]) -> Option<(Vec<f64>, [f64; COMMON])> {
        let solved = |b: &[f64]| {
            let mut x = b.to_vec();
            factor.solve(&mut x);
            x
        };
        let inner = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let negative: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let mut z = solved(&negative);
        let columns = [0, 1].map(|k| if self.present[k] { solved(&border[k]) } else { Vec::new() });
        // S dc = rc - B' A^-1 rz, with an identity in the place of what is not there.
        let entry = |a: usize, b: usize| match (self.present[a] && self.present[b], a == b) {
            (true, true) => self.corner[a] - inner(&border[a], &columns[a]),
            (true, false) => -inner(&border[a], &columns[b]),
            (false, diagonal) => f64::from(u8::from(diagonal)),
        };
        let right = [0, 1].map(|k| if self.present[k] { -self.barrier_common[k] - inner(&border[k], &z) } else { 0.0 });
        let (s00, s01, s11) = (entry(0, 0), entry(0, 1), entry(1, 1));
        let det = s00 * s11 - s01 * s01;
        if !(s00 > 0.0 && s11 > 0.0 && det > 0.0) {
            return None;
        }
        let common = [(s11 * right[0] - s01 * right[1]) / det, (s00 * right[1] - s01 * right[0]) / det];
        for k in (0..COMMON).filter(|&k| self.present[k]) {
            z.iter_mut().zip(&columns[k]).for_each(|(z, x)| *z -= common[k] * x);
        }
        z.iter().all(|x| x.is_finite()).then_some((z, common))
    }
}

/// Where a point stands in the band. A ring is folded, 0, 1, last, 2, last but one ...: neighbours are two places apart at most.
fn folded(i: usize, count: usize, ring: bool) -> usize {
    if !ring || i == 0 {
        i
    } else if 2 * i <= count {
        2 * i - 1
    } else {
        2 * (count - i)
    }
}

fn slack_change<const C: usize>(c: &Constraint, problem: &PathProblem, points: &[Point<C>], direction: &Direction<C>, n: usize) -> f64 {
    let dq = &direction.dq;
    let motion = || -c.sign * (dq[(c.point + 1) % dq.len()][c.joint] - dq[c.point][c.joint]);
    let own = match c.kind {
        Kind::Position => -c.sign * dq[c.point][c.joint],
        Kind::Combination => -c.sign * problem.robot.limits().coupled[c.joint].value(&dq[c.point]),
        Kind::Motion => motion(),
        Kind::Pace => c.bound * direction.common[0] + motion(),
        Kind::Value => direction.common[0] - (0..n).map(|k| points[c.point].objective.gradient[k] * dq[c.point][k]).sum::<f64>(),
        Kind::Spin => {
            let gradient = points[c.point].spin_gradient();
            -c.sign * (0..n).map(|k| gradient[k] * dq[c.point][k]).sum::<f64>()
        }
        Kind::Side => {
            let gradient = points[c.point].side_gradient(c.joint);
            (0..n).map(|k| gradient[k] * dq[c.point][k]).sum::<f64>()
        }
        Kind::Widening => 0.0,
    };
    own + c.widening_slope() * direction.common[1]
}

/// The common variables after a step.
pub fn moved(common: &Common, step: &[f64; COMMON], alpha: f64) -> Common {
    Common { ceiling: common.ceiling + alpha * step[0], widening: common.widening + alpha * step[1] }
}
