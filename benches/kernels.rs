//! Kernels at n = 6 and 7 over varied postures: forward kinematics to the Hessian of the condition number.

#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use redundancy::index::{Answers, Index, Kind, Objective, Order, Rows};
use redundancy::internals::index::evaluate;
use redundancy::internals::kinematics::{first_derivative, forward, jacobian};
use redundancy::robot::{Convention, DhTable, Robot};
use std::f64::consts::FRAC_PI_2;

/// Postures that cycle, so that no branch predictor learns one input.
const POSTURES: usize = 256;

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

/// Low-discrepancy postures within +-2 rad.
fn postures(n: usize) -> Vec<Vec<f64>> {
    (0..POSTURES)
        .map(|i| (0..n).map(|j| 4.0 * ((i as f64 * (0.618034 + 0.1031 * j as f64) + 0.17 * j as f64) % 1.0) - 2.0).collect())
        .collect()
}

fn bench<const N: usize, const C: usize>(criterion: &mut Criterion) {
    let robot = robot(N);
    let q = postures(N);
    let rows = Rows::all(0.48).unwrap();
    let mut group = criterion.benchmark_group(format!("{N}R"));
    let mut next = 0;
    let mut pick = || {
        next = (next + 1) % POSTURES;
        q[next].as_slice()
    };
    group.bench_function("empty", |b| b.iter_batched(&mut pick, |q| black_box(q[0]), BatchSize::SmallInput));
    group.bench_function("forward", |b| b.iter_batched(&mut pick, |q| forward::<C>(black_box(&robot), q), BatchSize::SmallInput));
    group.bench_function("jacobian", |b| b.iter_batched(&mut pick, |q| jacobian::<C>(black_box(&robot), q), BatchSize::SmallInput));
    group.bench_function("jacobian derivative", |b| {
        let mut out = vec![0.0; 6 * N * N];
        b.iter_batched(&mut pick, |q| first_derivative(&jacobian::<C>(black_box(&robot), q).1, black_box(&mut out)), BatchSize::SmallInput)
    });
    let indices = [
        ("kappa_F", Index::of(Kind::ConditionNumber, rows, false)),
        ("manipulability", Index::of(Kind::Manipulability, rows, false)),
        ("kappa_2", Index::of(Kind::SpectralConditionNumber, rows, false)),
    ];
    for (name, index) in indices {
        let objective = Objective::new(vec![(1.0, index)]).unwrap();
        for (order, label) in [(Order::Value, "value"), (Order::Gradient, "gradient"), (Order::Hessian, "Hessian")] {
            group.bench_function(format!("{name} {label}"), |b| {
                b.iter_batched(&mut pick, |q| evaluate::<C>(&objective, black_box(&robot), q, order, false), BatchSize::SmallInput)
            });
        }
    }
    let objective = Objective::new(vec![(1.0, Index::of(Kind::ConditionNumber, rows, false))]).unwrap();
    let flat = q.concat();
    let (mut values, mut gradients) = (vec![0.0; POSTURES], vec![0.0; POSTURES * N]);
    group.throughput(Throughput::Elements(POSTURES as u64));
    group.bench_function("kappa_F gradient of many", |b| {
        b.iter(|| {
            let mut out = Answers { values: &mut values, gradients: &mut gradients, hessians: &mut [] };
            objective.evaluate_many(black_box(&robot), &flat, false, &mut out).unwrap();
        })
    });
    group.finish();
}

fn both(criterion: &mut Criterion) {
    bench::<6, 6>(criterion);
    bench::<7, 8>(criterion);
}

criterion_group!(benches, both);
criterion_main!(benches);
