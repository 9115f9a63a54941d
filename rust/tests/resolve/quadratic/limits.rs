//! Whatever is asked for, rates are finite and within the limits.

use super::oracle::{C, Case, first_step, planar, posture, settings, step, twist};
use crate::common::{OwnRow, Rng, iiwa, rngs, views};
use proptest::prelude::*;
use redundancy::index::{Index, JointLimits, Kind, Objective, Rows};
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Derivatives, IndexForm, QuadraticMemory, QuadraticSettings, QuadraticStatus, Tick};
use redundancy::robot::{Limits, Robot};
use redundancy::task::Task;
use std::sync::Arc;

const SLACK: f64 = 1e-12;

/// Whether a joint at `q` may move at `rate` as far as its position is concerned: not across a limit within the tick, not so fast that it cannot
/// come to rest before it, and not further out where it is beyond.
fn position_allows(limits: &Limits, i: usize, q: f64, dt: f64, rate: f64) -> bool {
    let towards = |room: f64, v: f64| {
        let braking = if limits.qdd_max[i].is_finite() { v * v / (2.0 * limits.qdd_max[i]) } else { 0.0 };
        v <= 0.0 || v * dt + braking <= room.max(0.0) * (1.0 + SLACK)
    };
    towards(limits.q_max[i] - q, rate) && towards(q - limits.q_min[i], -rate)
}

fn allowed(robot: &Robot, q: &[f64], dt: f64, rates: &[f64], before: Option<&[f64; MAX_JOINTS]>) -> Result<(), TestCaseError> {
    let limits = robot.limits();
    for i in 0..q.len() {
        let v = rates[i];
        prop_assert!(v.is_finite() && v.abs() <= limits.qd_max[i], "joint {}: {:e} beyond {:e}", i, v, limits.qd_max[i]);
        prop_assert!(position_allows(limits, i, q[i], dt, v), "joint {} at {} by {:e}", i, q[i], v);
        let Some(before) = before.filter(|_| limits.qdd_max[i].is_finite()) else { continue };
        let most = limits.qdd_max[i] * dt;
        let over = (v - before[i]).abs() - most;
        if over > 1e-12 * (1.0 + before[i].abs()) {
            // Only as much as position or speed needs: a little less of a change is too little.
            let nudged = v + 1e-6 * (1.0 + v.abs()) * (before[i] - v).signum();
            let needed = !position_allows(limits, i, q[i], dt, nudged) || nudged.abs() > limits.qd_max[i];
            prop_assert!(needed, "joint {} at {}: from {} to {} with {} a tick", i, q[i], before[i], v, most);
        }
    }
    Ok(())
}

/// A case whose accelerations are limited on some joints.
fn limited(rng: &mut Rng, kind: usize) -> Case {
    let case = Case::new(rng, kind);
    let mut limits = case.robot.limits().clone();
    for acceleration in &mut limits.qdd_max {
        *acceleration = if rng.below(3) == 0 { f64::INFINITY } else { 10f64.powf(rng.within(-1.0, 2.0)) };
    }
    Case { robot: Arc::new(case.robot.with_limits(limits).unwrap()), ..case }
}

/// In, at and beyond the limits.
fn anywhere(rng: &mut Rng, robot: &Robot) -> Vec<f64> {
    let limits = robot.limits();
    let mut q = posture(rng, robot);
    for (i, x) in q.iter_mut().enumerate() {
        let limit = if rng.below(2) == 0 { limits.q_min[i] } else { limits.q_max[i] };
        if limit.is_finite() {
            *x = match rng.below(6) {
                0 => limit,
                1 => limit + rng.within(-1e-3, 1e-3),
                2 => limit + rng.within(-1.0, 1.0),
                3 => limit * 1e3,
                _ => *x,
            };
        }
    }
    q
}

fn objective(n: usize) -> Objective {
    let rows = Rows::new(if n < 6 { &[3, 4] } else { &[0, 1, 2, 3, 4, 5] }, 0.5).unwrap();
    let both = vec![(1.0, Index::of(Kind::ConditionNumber, rows, false)), (0.1, Index::JointLimits(JointLimits::new(&[]).unwrap()))];
    Objective::new(both).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rates_are_finite_and_within_limits(seed in rngs(), kind in 0usize..4) {
        let rng = &mut Rng(seed);
        let case = limited(rng, kind);
        let mut settings = settings(rng, true);
        if rng.below(3) == 0 {
            settings.largest_deviation = (rng.within(0.0, 0.1), rng.within(0.0, 0.1));
        }
        let form = [IndexForm::Curvature, IndexForm::Printed, IndexForm::Equality][rng.below(3)];
        let derivatives = [Derivatives::Exact, Derivatives::Bfgs, Derivatives::Differences(1e-3)][rng.below(3)];
        let objective = objective(case.n());
        let weight = 10f64.powf(rng.within(-3.0, 9.0));
        let solver = case.solver(Some((&objective, weight)).filter(|_| rng.below(4) > 0), form, derivatives, settings);
        let mut memory = QuadraticMemory::default();
        let mut q = anywhere(rng, &case.robot);
        for _ in 0..4 {
            let size = [0.0, 1.0, 100.0, 1e308][rng.below(4)];
            let mut rows = Vec::new();
            for _ in 0..rng.below(4) {
                let a: [f64; C] = std::array::from_fn(|_| rng.within(-1.0, 1.0));
                rows.push(OwnRow { a, lower: rng.within(-1.0, 1.0), upper: if rng.below(2) == 0 { f64::INFINITY } else { rng.within(-1.0, 1.0) } });
            }
            let before = memory.rates;
            let tick = Tick { q: &q, twist: twist(rng, size), stiffness: 10f64.powf(rng.within(-2.0, 6.0)), rows: &views(&rows, q.len()), twists: &[], frame: None };
            let (rates, _) = step(&solver, &tick, &mut memory);
            allowed(&case.robot, &q, settings.dt, &rates, before.as_ref())?;
            prop_assert_eq!(&memory.rates.unwrap()[..q.len()], &rates[..]);
            q = if rng.below(4) == 0 { anywhere(rng, &case.robot) } else { (0..q.len()).map(|i| q[i] + settings.dt * rates[i]).collect() };
        }
    }

    /// Without limits, numbers of any size are answered with finite ones.
    #[test]
    fn any_finite_numbers(seed in rngs(), kind in 0usize..4) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        let form = [IndexForm::Curvature, IndexForm::Printed, IndexForm::Equality][rng.below(3)];
        let derivatives = [Derivatives::Exact, Derivatives::Bfgs, Derivatives::Differences(1e-3)][rng.below(3)];
        let objective = objective(case.n());
        let limits = rng.below(2) == 0;
        let solver = case.solver(Some((&objective, 1.0)), form, derivatives, settings(rng, limits));
        let mut memory = QuadraticMemory::default();
        for _ in 0..3 {
            let q: Vec<f64> = (0..case.n()).map(|_| rng.finite()).collect();
            let rows: Vec<OwnRow<C>> = (0..rng.below(3)).map(|_| OwnRow { a: std::array::from_fn(|_| rng.wild()), lower: rng.wild(), upper: rng.wild() }).collect();
            let mut rates = vec![f64::NAN; case.n()];
            let tick = Tick { q: &q, twist: std::array::from_fn(|_| rng.finite()), stiffness: rng.finite().abs(), rows: &views(&rows, q.len()), twists: &[], frame: None };
            solver.step(&tick, &mut memory, &mut rates);
            prop_assert!(rates.iter().all(|x| x.is_finite()), "{:?}", rates);
        }
    }
}

#[test]
fn no_twist_asks_for_no_motion() {
    let rng = &mut Rng(5);
    for kind in 0..4 {
        for _ in 0..50 {
            let case = Case::new(rng, kind);
            let q = posture(rng, &case.robot);
            let (rates, outcome) = first_step(
                &case.plain(settings(rng, true)),
                &Tick { q: &q, twist: [0.0; 6], stiffness: 1e4, rows: &[], twists: &[], frame: None },
            );
            assert!(rates.iter().all(|x| *x == 0.0) && outcome.status == QuadraticStatus::Solved, "{rates:?} {outcome:?}");
        }
    }
}

#[test]
fn a_task_beyond_the_limits_is_limited() {
    let rng = &mut Rng(6);
    let case = Case::new(rng, 1);
    for _ in 0..100 {
        let q = posture(rng, &case.robot);
        let settings = QuadraticSettings { dt: 1e-3, ..settings(rng, true) };
        let (rates, outcome) = first_step(
            &case.plain(settings),
            &Tick { q: &q, twist: twist(rng, 100.0), stiffness: 1e4, rows: &[], twists: &[], frame: None },
        );
        assert_eq!(outcome.status, QuadraticStatus::Limited);
        assert!(rates.iter().any(|x| (x.abs() - 1.7).abs() < 1e-9), "{rates:?}");
    }
}

/// Stretched arms, where no programme without a cost of the rates would be convex.
#[test]
fn singular_postures() {
    let rng = &mut Rng(7);
    let full = Rows::new(&[0, 1, 2, 3, 4, 5], 0.5).unwrap();
    let plane = Rows::new(&[3, 4], 1.0).unwrap();
    for (robot, task, rows) in [(iiwa(), Task::FULL, full), (planar(), super::oracle::in_plane(), plane)] {
        let case = Case { robot: Arc::new(robot), task };
        let condition = Objective::new(vec![(1.0, Index::of(Kind::ConditionNumber, rows, false))]).unwrap();
        let middle = Objective::new(vec![(1.0, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap();
        for off in [0.0, 1e-12, 1e-8, 1e-4, 1e-2] {
            for _ in 0..50 {
                let settings = settings(rng, true);
                let q: Vec<f64> = (0..case.n()).map(|_| off * rng.within(-1.0, 1.0)).collect();
                let tick = Tick {
                    q: &q,
                    twist: twist(rng, 0.05),
                    stiffness: 10f64.powf(rng.within(0.0, 6.0)),
                    rows: &[],
                    twists: &[],
                    frame: None,
                };
                for objective in [None, Some(&condition), Some(&middle)] {
                    for form in [IndexForm::Curvature, IndexForm::Equality] {
                        for derivatives in [Derivatives::Exact, Derivatives::Bfgs] {
                            let solver = case.solver(objective.map(|objective| (objective, 0.1)), form, derivatives, settings);
                            let (rates, outcome) = first_step(&solver, &tick);
                            assert!(rates.iter().all(|x| x.is_finite() && x.abs() <= 2.0));
                            let limited = rates.iter().zip(&case.robot.limits().qd_max).any(|(x, most)| (x.abs() - most).abs() < 1e-6);
                            let fine = matches!(outcome.status, QuadraticStatus::Solved | QuadraticStatus::Relaxed);
                            assert!(fine || (limited && outcome.status == QuadraticStatus::Limited), "{off}: {rates:?} {outcome:?}");
                            let singular = off == 0.0 && objective.is_some_and(|objective| std::ptr::eq(objective, &raw const condition));
                            assert!(!singular || !outcome.conditioned, "{outcome:?}");
                            assert!(
                                outcome.conditioned || off < 1e-3 && std::ptr::eq(objective.unwrap(), &raw const condition),
                                "{off} {outcome:?}"
                            );
                            if !outcome.conditioned {
                                let (plain, _) = first_step(&case.plain(settings), &tick);
                                assert_eq!(plain, rates, "the index is left out");
                            }
                        }
                    }
                }
            }
        }
    }
}
