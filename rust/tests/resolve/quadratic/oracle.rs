//! Robots with tasks, and their programmes once more by nalgebra and Clarabel.

use std::sync::Arc;

use crate::common::{OwnRow, Rng, fanuc, iiwa};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use nalgebra::{DMatrix, DVector};
use redundancy::index::{Objective, Order};
use redundancy::internals::kinematics::jacobian;
use redundancy::linalg::MAX_JOINTS;
use redundancy::linalg::frame::Frame;
use redundancy::resolve::{Derivatives, IndexForm, Outcome, QuadraticMemory, QuadraticSettings, QuadraticSolver, Resolver, Tick};
use redundancy::robot::{Convention, DhTable, Limits, Robot};
use redundancy::task::{Projector, Reference, Task};

/// Capacity in most of these tests.
pub const C: usize = 8;

/// A robot with a task.
#[derive(Clone)]
pub struct Case {
    pub robot: Arc<Robot>,
    pub task: Task,
}

/// Three revolute joints in the plane z = 0.
pub fn planar() -> Robot {
    let table =
        DhTable { convention: Convention::Standard, a: vec![0.5, 0.4, 0.3], d: vec![0.0; 3], alpha: vec![0.0; 3], theta: vec![0.0; 3] };
    let limits = Limits { q_min: vec![-2.8; 3], q_max: vec![2.8; 3], qd_max: vec![2.0; 3], ..Limits::none(3) };
    Robot::from_dh("planar", table, "RRR").unwrap().with_limits(limits).unwrap()
}

pub fn in_plane() -> Task {
    Task { angular: Projector::None, linear: Projector::plane([0.0, 0.0, 1.0]).unwrap(), reference: Reference::Base }
}

impl Case {
    /// Six axes with a tool that may spin, seven with a full task, three in a plane, seven of which some are prismatic.
    pub fn new(rng: &mut Rng, kind: usize) -> Self {
        let (robot, task) = match kind {
            0 => (fanuc(), Task::axisymmetric(rng.direction()).unwrap()),
            1 => (iiwa(), Task::FULL),
            2 => (planar(), in_plane()),
            _ => (rng.robot(7, true, 2), Task::axisymmetric(rng.direction()).unwrap()),
        };
        Self { robot: Arc::new(robot), task }
    }

    pub fn n(&self) -> usize {
        self.robot.n()
    }

    pub fn solver(
        &self,
        index: Option<(&Objective, f64)>,
        form: IndexForm,
        derivatives: Derivatives,
        settings: QuadraticSettings,
    ) -> QuadraticSolver {
        let index = index.map(|(objective, weight)| (objective.clone(), weight));
        QuadraticSolver::new(self.robot.clone(), self.task, index, form, derivatives, settings).unwrap()
    }

    pub fn plain(&self, settings: QuadraticSettings) -> QuadraticSolver {
        self.solver(None, IndexForm::Curvature, Derivatives::Exact, settings)
    }

    /// The Jacobian, and the projectors of angular and linear motions in one, at a posture.
    pub fn matrices(&self, q: &[f64]) -> (DMatrix<f64>, DMatrix<f64>) {
        let (tool, columns) = jacobian::<MAX_JOINTS>(&self.robot, q);
        let all = DMatrix::from_fn(6, q.len(), |r, i| columns.column(i)[r]);
        let mut projector = DMatrix::zeros(6, 6);
        let turned = |e: [f64; 3]| if self.task.reference == Reference::Base { e } else { tool.rotate(e) };
        for (first, part) in [(0, self.task.angular), (3, self.task.linear)] {
            let (identity, along, e) = match part {
                Projector::None => (0.0, 0.0, [0.0; 3]),
                Projector::All => (1.0, 0.0, [0.0; 3]),
                Projector::Line(e) => (0.0, 1.0, turned(e)),
                Projector::Plane(e) => (1.0, -1.0, turned(e)),
            };
            for i in 0..3 {
                for j in 0..3 {
                    projector[(first + i, first + j)] = along * e[i] * e[j] + if i == j { identity } else { 0.0 };
                }
            }
        }
        (all, projector)
    }

    /// The objective `x'Hx/2 + g'x` of a tick without an index.
    pub fn quadratic(&self, settings: &QuadraticSettings, tick: &Tick<'_>) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.n();
        let (all, projector) = self.matrices(tick.q);
        let square = settings.length * settings.length;
        let weights = DMatrix::from_diagonal(&DVector::from_fn(6, |i, _| if i < 3 { square } else { 1.0 }));
        let (task, twist) = (projector * all, DVector::from_column_slice(&tick.twist));
        let rates = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| settings.rate_weights[i]));
        (rates + tick.stiffness * task.transpose() * &weights * &task, -tick.stiffness * task.transpose() * weights * twist)
    }

    /// What is left of a twist.
    pub fn left(&self, q: &[f64], twist: &[f64; 6], rates: &[f64]) -> DVector<f64> {
        let (all, projector) = self.matrices(q);
        projector * (DVector::from_column_slice(twist) - all * DVector::from_column_slice(rates))
    }
}

pub fn settings(rng: &mut Rng, limits: bool) -> QuadraticSettings {
    QuadraticSettings {
        length: rng.within(0.2, 1.0),
        dt: 10f64.powf(rng.within(-3.0, -1.5)),
        rate_weights: std::array::from_fn(|_| 10f64.powf(rng.within(-1.0, 1.0))),
        stiffness: 1e4,
        largest_deviation: (f64::INFINITY, f64::INFINITY),
        limits,
        tolerance: 1e-3,
    }
}

pub fn twist(rng: &mut Rng, size: f64) -> [f64; 6] {
    std::array::from_fn(|_| rng.within(-size, size))
}

/// Within the limits of position, and within 2 where there are none.
pub fn posture(rng: &mut Rng, robot: &Robot) -> Vec<f64> {
    let limits = robot.limits();
    (0..robot.n()).map(|i| rng.within(limits.q_min[i].max(-2.0), limits.q_max[i].min(2.0))).collect()
}

/// One step with a memory.
#[inline(never)]
pub fn step(solver: &QuadraticSolver, tick: &Tick<'_>, memory: &mut QuadraticMemory) -> (Vec<f64>, Outcome) {
    let mut rates = vec![f64::NAN; solver.robot().n()];
    let outcome = solver.step(tick, memory, &mut rates);
    assert!(
        rates.iter().chain(&outcome.deviation).all(|x| x.is_finite()) || tick.twist.iter().any(|x| x.abs() > 1e150),
        "{rates:?} {outcome:?}"
    );
    (rates, outcome)
}

/// One step without a past.
pub fn first_step(solver: &QuadraticSolver, tick: &Tick<'_>) -> (Vec<f64>, Outcome) {
    step(solver, tick, &mut QuadraticMemory::default())
}

/// Value, gradient and Hessian of an objective.
pub fn expansion(objective: &Objective, robot: &Robot, q: &[f64]) -> (f64, DVector<f64>, DMatrix<f64>) {
    let n = q.len();
    let at = objective.evaluate(robot, q, Order::Hessian, false).unwrap();
    (at.value, DVector::from_column_slice(&at.gradient[..n]), DMatrix::from_fn(n, n, |i, j| at.hessian[i][j]))
}

pub fn minimiser(h: &DMatrix<f64>, g: &DVector<f64>) -> DVector<f64> {
    h.clone().cholesky().unwrap().solve(&-g)
}

pub fn apart(rates: &[f64], expected: &DVector<f64>) -> f64 {
    (DVector::from_column_slice(rates) - expected).norm() / expected.norm().max(1e-12)
}

/// Rates within bounds and rows, lower and upper: the cheapest of `x'Hx/2 + g'x`, or `None` where Clarabel finds none.
pub fn cheapest(h: &DMatrix<f64>, g: &DVector<f64>, bounds: &[(f64, f64)], rows: &[OwnRow<C>]) -> Option<DVector<f64>> {
    let n = g.len();
    let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect::<Vec<_>>();
    let mut all: Vec<(Vec<f64>, f64)> = Vec::new();
    let mut add = |a: Vec<f64>, lower: f64, upper: f64| {
        if lower.is_finite() {
            all.push((a.iter().map(|x| -x).collect(), -lower));
        }
        if upper.is_finite() {
            all.push((a, upper));
        }
    };
    for (i, (lower, upper)) in bounds.iter().enumerate() {
        add(unit(i), *lower, *upper);
    }
    for row in rows {
        add(row.a[..n].to_vec(), row.lower, row.upper);
    }
    let scale = h.amax();
    let triangle: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| if j >= i { h[(i, j)] / scale } else { 0.0 }).collect()).collect();
    let linear: Vec<f64> = g.iter().map(|x| x / scale).collect();
    let table: Vec<Vec<f64>> = all.iter().map(|row| row.0.clone()).collect();
    let a = if all.is_empty() { CscMatrix::zeros((0, n)) } else { CscMatrix::from(&table) };
    let b: Vec<f64> = all.iter().map(|row| row.1).collect();
    let settings = DefaultSettingsBuilder::default().verbose(false).tol_gap_abs(1e-13).tol_gap_rel(1e-13).tol_feas(1e-12).build().unwrap();
    let mut solver = DefaultSolver::new(&CscMatrix::from(&triangle), &linear, &a, &b, &[NonnegativeConeT(all.len())], settings).unwrap();
    solver.solve();
    let good = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress);
    good.then(|| DVector::from_column_slice(&solver.solution.x))
}

/// The least worst violation of rows within bounds, by a programme in which nothing else counts.
pub fn least_violation(n: usize, bounds: &[(f64, f64)], rows: &[OwnRow<C>]) -> f64 {
    let wide = |row: &OwnRow<C>, sign: f64, limit: f64| {
        let mut a = [0.0; C];
        a[..n].copy_from_slice(&row.a[..n]);
        a[..n].iter_mut().for_each(|x| *x *= sign);
        a[n] = 1.0;
        OwnRow { a, lower: sign * limit, upper: f64::INFINITY }
    };
    let both = rows.iter().flat_map(|row| [wide(row, 1.0, row.lower), wide(row, -1.0, row.upper)]);
    let all: Vec<OwnRow<C>> = both.filter(|row| row.lower.is_finite()).collect();
    // The violation counts so much that what the rest costs changes it by rounding.
    let (h, mut g) = (DMatrix::identity(n + 1, n + 1), DVector::zeros(n + 1));
    g[n] = 1e9;
    let bounds: Vec<(f64, f64)> = bounds.iter().copied().chain([(0.0, f64::INFINITY)]).collect();
    cheapest(&h, &g, &bounds, &all).unwrap()[n]
}

/// A robot's tool frame.
pub fn tool(robot: &Robot, q: &[f64]) -> Frame {
    redundancy::kinematics::forward(robot, q).unwrap()
}
