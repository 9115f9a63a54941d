//! One tick with cold caches, as in a control loop that sleeps between ticks: twist decomposition and the quadratic programme at n = 6 and 7.
//! Between ticks a block of twice the last-level cache is walked through, so that code and data come from memory.

#![allow(missing_docs, clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use redundancy::index::{Index, JointLimits, Kind, Objective, Rows};
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{
    Derivatives, IndexForm, Memory, Method, QuadraticMemory, QuadraticSettings, QuadraticSolver, RateSettings, RateSolver, Scaling,
    Secondary, Tick,
};
use redundancy::robot::{Convention, DhTable, Robot};
use redundancy::task::Task;

const TICKS: usize = 200;
const LENGTH: f64 = 0.48;
const TWIST: [f64; 6] = [0.1, -0.05, 0.02, 0.05, 0.1, -0.1];

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

/// Bytes of the largest cache; 32 MB where the system does not tell.
fn cache_size() -> usize {
    let read = |i: usize| std::fs::read_to_string(format!("/sys/devices/system/cpu/cpu0/cache/index{i}/size")).ok();
    let bytes = |text: String| Some(text.trim().strip_suffix('K')?.parse::<usize>().ok()? << 10);
    (0..8).filter_map(|i| read(i).and_then(bytes)).max().unwrap_or(32 << 20)
}

/// Prints the medians of a call with cold and with hot caches.
fn measure(name: &str, mut call: impl FnMut(usize)) {
    let mut block = vec![0u8; 2 * cache_size()];
    let mut median = |cold: bool| {
        let mut times: Vec<Duration> = (0..TICKS)
            .map(|i| {
                if cold {
                    black_box(&mut block).iter_mut().step_by(64).for_each(|x| *x = x.wrapping_add(1));
                }
                let start = Instant::now();
                call(i);
                start.elapsed()
            })
            .collect();
        times.sort_unstable();
        times[TICKS / 2].as_secs_f64() * 1e6
    };
    println!("{name:24} cold {:7.2} us, hot {:6.2} us", median(true), median(false));
}

fn bench<const N: usize>() {
    let robot = Arc::new(robot(N));
    let q: Vec<Vec<f64>> = (0..TICKS)
        .map(|i| (0..N).map(|j| 4.0 * ((i as f64 * (0.618034 + 0.1031 * j as f64) + 0.17 * j as f64) % 1.0) - 2.0).collect())
        .collect();
    let task = Task::axisymmetric([0.3, 0.2, 0.9]).unwrap();
    let condition = Index::of(Kind::ConditionNumber, Rows::all(LENGTH).unwrap(), true);
    let both = Objective::new(vec![(1.0, condition.clone()), (0.1, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap();
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
    let secondary = Secondary::Objective(both, Scaling::Gradient);
    let solver = RateSolver::new(robot.clone(), task, Method::TwistDecomposition, secondary, None, settings).unwrap();
    let (mut memory, mut rates) = (Memory::default(), vec![0.0; N]);
    measure(&format!("{N}R twist decomposition"), |i| {
        black_box(solver.step(black_box(&q[i]), &TWIST, &mut memory, &mut rates));
    });
    let settings = QuadraticSettings {
        length: LENGTH,
        dt: 1e-2,
        rate_weights: [1.0; MAX_JOINTS],
        stiffness: 1e4,
        largest_deviation: (f64::INFINITY, f64::INFINITY),
        limits: true,
        tolerance: 1e-3,
    };
    let index = Objective::new(vec![(1.0, condition)]).unwrap();
    let solver = QuadraticSolver::new(robot, task, Some((index, 0.1)), IndexForm::Curvature, Derivatives::Exact, settings).unwrap();
    let mut memory = QuadraticMemory::default();
    measure(&format!("{N}R programme"), |i| {
        let tick = Tick { q: &q[i], twist: TWIST, stiffness: 1e4, rows: &[], twists: &[], frame: None };
        black_box(solver.step(black_box(&tick), &mut memory, &mut rates));
    });
}

fn main() {
    bench::<6>();
    bench::<7>();
}
