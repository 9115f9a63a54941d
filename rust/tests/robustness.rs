//! No bit pattern makes a kernel panic or loop.

use std::sync::Arc;

use crate::common::{OwnRow, Rng, evaluate, fanuc, iiwa, indices, views};
use redundancy::index::{CustomIndex, Evaluation, Index, Objective, Order, Rows, length_of_least_condition};
use redundancy::internals::kinematics::{first_derivative, forward, jacobian, jacobian_rate, link_frames, second_derivative};
use redundancy::internals::linalg::{Orthogonal, Svd, diagonalise};
use redundancy::inverse::reach;
use redundancy::qp::{self, Programme, most_changes};
use redundancy::resolve::{Memory, Method, OrthogonalSqp, RateSettings, RateSolver, Resolver, Scaling, Secondary, SqpSettings};
use redundancy::robot::Robot;
use redundancy::task::{Projector, Reference, Target, Task};
use redundancy::with_capacity;

/// A robot with its solvers, made once.
pub struct Subject {
    pub robot: Arc<Robot>,
    objectives: Vec<Objective>,
    pub solvers: Vec<OrthogonalSqp>,
}

pub fn objectives(n: usize) -> Vec<Objective> {
    let one = |index: Index| Objective::new(vec![(1.0, index)]).unwrap();
    let rows = Rows::new(&[0, 1, 2, 3, 4, 5][6 - n.min(6)..], 0.5).unwrap();
    let mut out: Vec<Objective> = indices(rows).into_iter().map(one).collect();
    out.push(Objective::new(indices(rows).into_iter().map(|index| (0.2, index)).collect()).unwrap());
    out
}

pub fn solvers(robot: &Arc<Robot>, objectives: &[Objective]) -> Vec<OrthogonalSqp> {
    let mut out = Vec::new();
    for task in [Task::axisymmetric([0.3, -0.2, 1.0]).unwrap(), Task::POSITION, Task::FULL] {
        if task.dimension() > robot.n() {
            continue;
        }
        for (i, objective) in objectives.iter().enumerate() {
            let settings = SqpSettings {
                length: [0.5, 1e-3, 20.0][i % 3],
                exact_hessian: i % 4 != 3,
                gain: [10.0, 0.0, 1e4][i % 3],
                dt: [1e-3, 0.05][i % 2],
                limits: i % 5 != 4,
                tolerance: 1e-9,
                max_iterations: 12,
            };
            out.push(OrthogonalSqp::new(robot.clone(), task, objective.clone(), settings).unwrap());
        }
    }
    out
}

pub fn subjects() -> Vec<Subject> {
    let mut robots = vec![fanuc(), iiwa(), iiwa(), fanuc(), Rng(2).coupled(6, 4), Rng(4).coupled(9, 7)];
    for n in [1, 3, 5, 9, 12] {
        robots.push(Rng(n as u64).robot(n, true, n / 2));
    }
    robots
        .into_iter()
        .map(|robot| {
            let robot = Arc::new(robot);
            let objectives = objectives(robot.n());
            let solvers = solvers(&robot, &objectives);
            Subject { robot, objectives, solvers }
        })
        .collect()
}

/// Every kernel once with numbers of any kind.
/// An index that answers whatever it was made of.
#[derive(Debug)]
struct Invented(Evaluation);

impl CustomIndex for Invented {
    fn evaluate(&self, _q: &[f64], _order: Order) -> Evaluation {
        self.0
    }
}

fn trial<const C: usize>(subject: &Subject, rng: &mut Rng) {
    let robot = &*subject.robot;
    let n = robot.n();
    // All wild, or one wild number among tame ones, which gets further.
    let spread = rng.below(3);
    let culprit = rng.below(n);
    let mut number = |i: usize, culprit: usize| if spread == 0 || i == culprit { rng.wild() } else { rng.within(-2.5, 2.5) };
    let q: Vec<f64> = (0..n).map(|i| number(i, culprit)).collect();
    let other = culprit % 6;
    let twist: [f64; 6] = std::array::from_fn(|i| number(i, other));
    let target = Target {
        position: std::array::from_fn(|i| number(i, other)),
        axis: Some(std::array::from_fn(|i| number(i, other))),
        frame: std::array::from_fn(|c| std::array::from_fn(|r| number(3 * c + r, culprit))),
    };
    let rates: Vec<f64> = (0..n).map(|i| number(i, culprit)).collect();

    let frame = forward::<C>(robot, &q);
    let (tool, columns) = jacobian::<C>(robot, &q);
    link_frames(robot, &q);
    jacobian_rate(&columns, &rates);
    first_derivative(&columns, &mut vec![0.0; 6 * n * n]);
    if n <= 3 {
        second_derivative(&columns, &mut [0.0; 6 * 27]);
    }
    length_of_least_condition(robot, &q, &Rows::new(&[3, 4, 5][3 - n.min(3)..], 0.5).unwrap()).unwrap();

    let objective = &subject.objectives[rng.below(subject.objectives.len())];
    evaluate::<C>(objective, robot, &q, Order::Hessian, rng.below(2) == 0);
    evaluate::<C>(objective, robot, &q, Order::Value, false);

    let task = [Task::FULL, Task::POSITION, Task::axisymmetric([0.0, 0.6, 0.8]).unwrap()][rng.below(3)];
    for at in [&frame, &tool] {
        task.error(at, &target);
        Task::FULL.error(at, &target);
    }
    let mut moved = q.clone();
    reach(robot, Some(robot.limits()), &task, &target, 0.5, &mut moved, 1e-9, 4);

    // A step with a made-up objective of numbers of any kind.
    let mut invented = Evaluation::zero();
    invented.value = 1.0;
    for k in 0..n {
        invented.gradient[k] = rng.finite();
        for l in 0..n {
            invented.hessian[k][l] = rng.finite();
        }
    }
    let objective = Objective::new(vec![(1.0, Index::Custom(Arc::new(Invented(invented))))]).unwrap();
    let settings = SqpSettings { limits: rng.below(2) == 0, ..SqpSettings::default() };
    if let Ok(solver) = OrthogonalSqp::new(subject.robot.clone(), task, objective, settings) {
        let mut rates = vec![0.0; n];
        solver.step(&q, &twist, &mut rates);
        assert!(rates.iter().all(|x| !x.is_nan()), "NaN rates from {q:?} {twist:?}: {rates:?}");
    }

    rate_trial(subject, rng, &q, &twist, &target);

    if !subject.solvers.is_empty() {
        let solver = &subject.solvers[rng.below(subject.solvers.len())];
        let mut out = vec![0.0; n];
        solver.step(&q, &twist, &mut out);
        assert!(out.iter().all(|x| !x.is_nan()), "NaN rates from {q:?} {twist:?}: {out:?}");
        let solution = solver.solve(&target, &q);
        assert!(solution.iterations <= solver.settings().max_iterations.max(60));
    }
}

/// A method of the rate level with numbers of any kind: no NaN leaves a step.
fn rate_trial(subject: &Subject, rng: &mut Rng, q: &[f64], twist: &[f64; 6], target: &Target) {
    let projector = |rng: &mut Rng| match rng.below(4) {
        0 => Projector::None,
        1 => Projector::line(rng.direction()).unwrap(),
        2 => Projector::plane(rng.direction()).unwrap(),
        _ => Projector::All,
    };
    let reference = [Reference::Tool, Reference::Base, Reference::Part(rng.frame())][rng.below(3)];
    let task = Task { angular: projector(rng), linear: projector(rng), reference };
    let objective = subject.objectives[rng.below(subject.objectives.len())].clone();
    let scaling = [Scaling::Gradient, Scaling::Newton][rng.below(2)];
    let secondary = if rng.below(4) == 0 { Secondary::None } else { Secondary::Objective(objective, scaling) };
    let settings = RateSettings {
        length: 0.5,
        gain: 3.0,
        relaxation: 1.0,
        damping: 1e-3,
        dt: 1e-3,
        limits: rng.below(2) == 0,
        iterations: 2,
        stop: 0.0,
        correct: rng.below(8) == 0,
        tolerance: 1e-9,
    };
    let Ok(solver) = RateSolver::new(subject.robot.clone(), task, Method::ALL[rng.below(8)], secondary, None, settings) else { return };
    let mut rates = vec![f64::NAN; q.len()];
    solver.step(q, twist, &mut Memory::default(), &mut rates);
    assert!(rates.iter().all(|x| !x.is_nan()), "NaN rates of {solver:?} from {q:?} {twist:?}: {rates:?}");
    solver.solve(target, q);
}

/// The linear algebra and the programme by themselves.
fn matrices(rng: &mut Rng) {
    let spread = rng.below(3);
    let culprit = rng.below(42);
    let mut number = |i: usize| if spread == 0 || i == culprit { rng.wild() } else { rng.within(-2.0, 2.0) };
    let a: [[f64; 7]; 6] = std::array::from_fn(|r| std::array::from_fn(|i| number(6 * i + r)));
    for m in [1, 3, 6] {
        let factors = Orthogonal::new(&a, 7, m);
        factors.pseudo_inverse();
        factors.null_space();
        Svd::new(&a, 7, m).null_space();
    }
    let mut symmetric: [[f64; 7]; 7] = std::array::from_fn(|i| std::array::from_fn(|j| number(7 * i.min(j) + i.max(j))));
    diagonalise(&mut symmetric, &mut [[0.0; 7]; 7], 7);

    let n = 1 + rng.below(6);
    let (mut h, mut g) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut lower, mut upper) = (vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n]);
    let tame = rng.below(2) == 0;
    for i in 0..n {
        h[i * n + i] = if tame { 1.0 } else { rng.wild() };
        g[i] = rng.wild();
        if rng.below(2) == 0 {
            (lower[i], upper[i]) = (rng.wild(), rng.wild());
        }
    }
    let row = |rng: &mut Rng| OwnRow::<7> { a: std::array::from_fn(|_| rng.wild()), lower: rng.wild(), upper: rng.wild() };
    let rows: Vec<_> = (0..rng.below(20)).map(|_| row(rng)).collect();
    let programme = Programme { h: &h, g: &g, lower: &lower, upper: &upper, rows: &views(&rows, n) };
    let solution = qp::solve(&programme, &[]).unwrap();
    assert!(solution.changes <= 1 + most_changes(n, rows.len()));
    let finite = solution.x.iter().all(|x| x.is_finite());
    assert!(solution.status != qp::Status::Solved || finite, "{solution:?}");
}

fn trials(count: usize, seed: u64) {
    let subjects = subjects();
    for i in 0..count {
        let rng = &mut Rng(seed.wrapping_add(i as u64).wrapping_mul(0x5851_f42d_4c95_7f2d));
        let subject = &subjects[i % subjects.len()];
        with_capacity!(subject.robot.n(), trial(subject, rng));
        matrices(rng);
    }
}

#[test]
fn no_panic_on_20_000_patterns() {
    trials(20_000, 1);
}

#[test]
#[ignore = "a minute or more: make soak"]
fn no_panic_on_a_million_patterns() {
    trials(1_000_000, 1 << 40);
}
