//! Rates of a step are finite and within the limits for every finite input, at singular postures too.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use crate::common::{Rng, fanuc, iiwa, rngs};
use crate::robustness::{Subject, objectives, solvers, subjects};
use proptest::prelude::*;
use redundancy::internals::kinematics::{jacobian, link_frames};
use redundancy::resolve::{OrthogonalSqp, SqpSettings, StepStatus};
use redundancy::robot::Robot;
use redundancy::task::Task;

/// Whether rates of an unlimited joint can overflow: a twist or posture whose square does.
fn is_huge(q: &[f64], twist: &[f64; 6]) -> bool {
    q.iter().chain(twist).any(|x| x.abs() > 1e100)
}

/// Rates are finite, within the speed limits, and keep each joint within its position limits or bring it no further out.
fn check_step(solver: &OrthogonalSqp, q: &[f64], twist: &[f64; 6]) -> Result<StepStatus, TestCaseError> {
    let n = q.len();
    let mut rates = vec![f64::NAN; n];
    let status = solver.step(q, twist, &mut rates);
    let dt = solver.settings().dt;
    for i in 0..n {
        let limits = solver.robot().limits();
        let free = !solver.settings().limits || limits.qd_max[i].is_infinite();
        // Overflow of an unlimited joint has a test of its own.
        prop_assert!(
            rates[i].is_finite() || (free && !rates[i].is_nan() && is_huge(q, twist)),
            "{status:?}: rate {i} of {rates:?} from {q:?}, {twist:?}"
        );
        if !solver.settings().limits || rates[i].is_infinite() {
            continue;
        }
        let speed = limits.qd_max[i];
        prop_assert!(rates[i].abs() <= speed * (1.0 + 1e-14), "{status:?}: rate {i} is {} of {speed}", rates[i]);
        let next = q[i] + rates[i] * dt;
        let rounding = 4.0 * f64::EPSILON * (q[i].abs() + (rates[i] * dt).abs());
        let (low, high) = (limits.q_min[i].min(q[i]), limits.q_max[i].max(q[i]));
        prop_assert!(
            next >= low - rounding && next <= high + rounding,
            "{status:?}: joint {i} goes from {} to {next}, limits {low} {high}",
            q[i]
        );
    }
    Ok(status)
}

/// A posture: tame, at a singularity, at or beyond limits, or of any size.
fn posture(rng: &mut Rng, robot: &Robot, kind: usize) -> Vec<f64> {
    let n = robot.n();
    let limits = robot.limits();
    let mut q: Vec<f64> = (0..n).map(|_| rng.within(-2.5, 2.5)).collect();
    match kind {
        // Multiples of a right angle: wrists, elbows and shoulders in line.
        0 => q.iter_mut().for_each(|x| *x = (*x / FRAC_PI_2).round() * FRAC_PI_2),
        // Within rounding of them.
        1 => q.iter_mut().for_each(|x| *x = (*x / FRAC_PI_2).round() * FRAC_PI_2 + 1e-9 * (*x)),
        2 => {
            for i in 0..n {
                q[i] = [limits.q_min[i], limits.q_max[i], q[i]][rng.below(3)].clamp(-10.0, 10.0);
            }
        }
        3 => q.iter_mut().for_each(|x| *x *= 10.0),
        4 => q.iter_mut().for_each(|x| *x = rng.finite()),
        5 => {
            let i = rng.below(n);
            q[i] = rng.finite();
        }
        6 => {
            let i = rng.below(n);
            q[i] = 0.0;
        }
        _ => {}
    }
    q
}

fn twist(rng: &mut Rng, kind: usize) -> [f64; 6] {
    std::array::from_fn(|_| match kind {
        0 => 0.0,
        1 => rng.finite(),
        2 => rng.within(-100.0, 100.0),
        _ => rng.within(-0.5, 0.5),
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn step_stays_within_limits(seed in rngs(), which in 0usize..9, kind in 0usize..8, motion in 0usize..4) {
        thread_local! {
            static SUBJECTS: Vec<Subject> = subjects();
        }
        SUBJECTS.with(|subjects| {
            let subject = &subjects[which];
            if subject.solvers.is_empty() {
                return Ok(());
            }
            let rng = &mut Rng(seed);
            let (q, twist) = (posture(rng, &subject.robot, kind), twist(rng, motion));
            let solver = &subject.solvers[rng.below(subject.solvers.len())];
            check_step(solver, &q, &twist).map(|_| ())
        })?;
    }
}

/// Without limits too: a finite twist and posture have finite rates.
#[test]
fn rates_without_limits_are_finite() {
    let robot = Arc::new(iiwa());
    let settings =
        SqpSettings { length: 0.5, exact_hessian: true, gain: 1.0, dt: 1e-3, limits: false, tolerance: 1e-9, max_iterations: 10 };
    let solver = OrthogonalSqp::new(robot, Task::FULL, objectives(7).remove(0), settings).unwrap();
    let mut rates = [0.0; 7];
    solver.step(&[0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9], &[f64::MAX, 0.0, 0.0, 0.0, 0.0, 0.0], &mut rates);
    assert!(rates.iter().all(|x| x.is_finite()), "{rates:?}");
}

/// The three singularities of a decoupled six-axis arm, exactly and nearly, on every solver.
#[test]
fn step_at_singular_postures() {
    // Without a tool, the wrist centre is that of joints 4 to 6.
    let robot = Arc::new(fanuc());
    let solvers = solvers(&robot, &objectives(6));
    let reach_of_forearm = (0.17f64).atan2(1.016);
    for offset in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3] {
        let wrist = [0.4, 0.3, 0.2, 0.5, offset, -0.7];
        let elbow = [0.4, 0.3, stretched_elbow(&robot, reach_of_forearm) + offset, 0.5, 0.8, -0.7];
        let shoulder = shoulder_over_axis(&robot, offset);
        for q in [wrist, elbow, shoulder, [0.0, 0.0, 0.0, 0.0, offset, 0.0]] {
            for solver in &solvers {
                for scale in [0.0, 1e-6, 0.1, 10.0, 1e6, 1e300] {
                    let twist = [0.3, -0.2, 0.5, 0.4, -0.6, 0.2].map(|x| scale * x);
                    check_step(solver, &q, &twist).unwrap();
                }
            }
        }
    }
}

/// The wrist centre in the base frame: where axes 4, 5 and 6 meet.
fn wrist_centre(robot: &Robot, q: &[f64]) -> [f64; 3] {
    link_frames(robot, q)[4].origin
}

/// Extremum of `f` on an interval by golden sections.
fn golden(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..200 {
        let (a, b) = (low + 0.381_966 * (high - low), low + 0.618_034 * (high - low));
        if f(a) < f(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

/// The third angle at which the wrist centre is farthest from joint 2.
fn stretched_elbow(robot: &Robot, guess: f64) -> f64 {
    let farness = |q3: f64| {
        let frames = link_frames(robot, &[0.4, 0.3, q3, 0.5, 0.8, -0.7]);
        let (a, b) = (frames[1].origin, wrist_centre(robot, &[0.4, 0.3, q3, 0.5, 0.8, -0.7]));
        -(0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>()
    };
    let best = (0..64).map(|i| -PI + PI / 32.0 * f64::from(i)).min_by(|a, b| farness(*a).total_cmp(&farness(*b))).unwrap_or(guess);
    golden(farness, best - 0.1, best + 0.1)
}

/// A posture whose wrist centre is on axis 1, plus an offset of joint 2.
fn shoulder_over_axis(robot: &Robot, offset: f64) -> [f64; 6] {
    let at = |q2: f64| [0.4, q2, 1.2, 0.5, 0.8, -0.7];
    let off_axis = |q2: f64| {
        let p = wrist_centre(robot, &at(q2));
        p[0].hypot(p[1])
    };
    let best = (0..128).map(|i| -PI + PI / 64.0 * f64::from(i)).min_by(|a, b| off_axis(*a).total_cmp(&off_axis(*b))).unwrap_or(0.0);
    at(golden(off_axis, best - 0.1, best + 0.1) + offset)
}

/// The task's tool motion is followed exactly at regular postures well inside the limits.
#[test]
fn regular_steps_follow_the_twist() {
    let robot = Arc::new(iiwa());
    let rng = &mut Rng(11);
    let mut regular = 0;
    for solver in solvers(&robot, &objectives(7)) {
        for _ in 0..20 {
            let q: Vec<f64> = (0..7).map(|_| rng.within(-1.2, 1.2)).collect();
            let twist: [f64; 6] = std::array::from_fn(|_| rng.within(-0.02, 0.02));
            let mut rates = vec![0.0; 7];
            let status = solver.step(&q, &twist, &mut rates);
            if status != StepStatus::Regular {
                continue;
            }
            regular += 1;
            let (tool, columns) = jacobian::<7>(&robot, &q);
            let got = columns.times(&rates);
            let directions = solver.task().directions(&tool, 0.5);
            let split = |t: &[f64; 6]| directions.reduce([t[0], t[1], t[2]], [t[3], t[4], t[5]]);
            for (a, b) in split(&got).iter().zip(&split(&twist)) {
                assert!((a - b).abs() <= 1e-10, "{a} {b}");
            }
        }
    }
    assert!(regular > 200, "only {regular} regular steps");
}
