//! One step of twist decomposition and of each rival at n = 6 and 7: the motion of the method alone from a posture, and the whole step with an
//! objective of singularity and limits.

#![allow(missing_docs, clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use redundancy::index::{Index, JointLimits, Kind, Objective, Rows};
use redundancy::resolve::{Memory, Method, RateSettings, RateSolver, Scaling, Secondary, Situation};
use redundancy::robot::{Convention, DhTable, Robot};
use redundancy::task::Task;

const POSTURES: usize = 256;
const LENGTH: f64 = 0.48;

fn robot(n: usize) -> Robot {
    let (a, d, alpha): (&[f64], &[f64], &[f64]) = if n == 6 {
        (&[0.15, 0.87, 0.17, 0.0, 0.0, -0.287692], &[0.0, 0.0, 0.0, -1.016, 0.0, -0.607777], &[-1.0, 2.0, -1.0, 1.0, -1.0, 2.0])
    } else {
        (&[0.0; 7], &[0.36, 0.0, 0.42, 0.0, 0.4, 0.0, 0.126], &[-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0])
    };
    let alpha = alpha.iter().map(|quarter| quarter * FRAC_PI_2).collect();
    let table = DhTable { convention: Convention::Standard, a: a.to_vec(), d: d.to_vec(), alpha, theta: vec![0.0; n] };
    Robot::from_dh("bench", table, &"R".repeat(n)).unwrap()
}

fn bench<const N: usize>(criterion: &mut Criterion) {
    let robot = Arc::new(robot(N));
    let q: Vec<Vec<f64>> = (0..POSTURES)
        .map(|i| (0..N).map(|j| 4.0 * ((i as f64 * (0.618034 + 0.1031 * j as f64) + 0.17 * j as f64) % 1.0) - 2.0).collect())
        .collect();
    let task = Task::axisymmetric([0.3, 0.2, 0.9]).unwrap();
    let condition = Index::of(Kind::ConditionNumber, Rows::all(LENGTH).unwrap(), true);
    let objective = Objective::new(vec![(1.0, condition), (0.1, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap();
    let settings = RateSettings {
        length: LENGTH,
        gain: 1.0,
        relaxation: 1.0,
        damping: 1e-3,
        dt: 1e-3,
        limits: true,
        iterations: 20,
        stop: 0.0,
        correct: true,
        tolerance: 1e-12,
    };
    let twist = [0.1, -0.05, 0.02, 0.05, 0.1, -0.1];
    let mut group = criterion.benchmark_group(format!("{N}R"));
    for method in Method::ALL {
        let secondary = Secondary::Objective(objective.clone(), Scaling::Gradient);
        let solver = RateSolver::new(robot.clone(), task, method, secondary, None, settings).unwrap();
        run(&mut group, &robot, &solver, method, &task, &q, &twist);
    }
    group.finish();
}

fn run(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    robot: &Robot,
    solver: &RateSolver,
    method: Method,
    task: &Task,
    q: &[Vec<f64>],
    twist: &[f64; 6],
) {
    let n = robot.n();
    let mut next = 0;
    let h: Vec<f64> = (0..n).map(|i| 0.1 - 0.03 * i as f64).collect();
    let (weights, mut dq) = (vec![1.5; n], vec![0.0; n]);
    group.bench_function(format!("{method:?} motion"), |b| {
        b.iter(|| {
            next = (next + 1) % POSTURES;
            let at = Situation { robot, q: &q[next], task, length: LENGTH, damping: 1e-3, weights: &weights };
            black_box(method.motion(black_box(&at), &[0.1, -0.05, 0.02, 0.05, 0.1, -0.1], &h, &mut dq))
        })
    });
    let (mut memory, mut rates) = (Memory::default(), vec![0.0; n]);
    group.bench_function(format!("{method:?} step"), |b| {
        b.iter(|| {
            next = (next + 1) % POSTURES;
            black_box(solver.step(black_box(&q[next]), twist, &mut memory, &mut rates))
        })
    });
}

fn both(criterion: &mut Criterion) {
    bench::<6>(criterion);
    bench::<7>(criterion);
}

criterion_group!(benches, both);
criterion_main!(benches);
