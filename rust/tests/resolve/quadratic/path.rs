//! Ticks one after another, and programmes without time.

use super::oracle::{Case, apart, first_step, posture, settings, step, tool, twist};
use crate::common::{Rng, fanuc, iiwa, rngs};
use nalgebra::DVector;
use proptest::prelude::*;
use redundancy::index::{Index, Kind, Objective, Order, Rows};
use redundancy::linalg::vector::{dot, norm, sub};
use redundancy::resolve::{
    Derivatives, IndexForm, Memory, QuadraticMemory, QuadraticSettings, QuadraticSolver, Resolver, SolveStatus, Tick,
};
use redundancy::task::{Target, Task};
use std::sync::Arc;

fn condition() -> Objective {
    let rows = Rows::new(&[0, 1, 2, 3, 4, 5], 0.5).unwrap();
    Objective::new(vec![(1.0, Index::of(Kind::ConditionNumber, rows, false))]).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// The working set kept from tick to tick saves work and changes nothing.
    #[test]
    fn a_warm_start_changes_no_rates(seed in rngs(), kind in 0usize..4) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        let mut limits = case.robot.limits().clone();
        limits.qd_max.iter_mut().for_each(|x| *x = rng.within(0.05, 0.5));
        limits.qdd_max.iter_mut().for_each(|x| *x = rng.within(1.0, 20.0));
        let case = Case { robot: Arc::new(case.robot.with_limits(limits).unwrap()), ..case };
        let settings = QuadraticSettings { dt: 0.01, largest_deviation: (1.0, 1.0), ..settings(rng, true) };
        let solver = case.plain(settings);
        let (mut q, first, second) = (posture(rng, &case.robot), twist(rng, 0.5), twist(rng, 0.5));
        let mut memory = QuadraticMemory::default();
        let (mut warm, mut cold) = (0, 0);
        for k in 0..150 {
            let phase = f64::from(k) * 0.05;
            let drive = std::array::from_fn(|i| first[i] * phase.sin() + second[i] * phase.cos());
            let tick = Tick { q: &q, twist: drive, stiffness: 1e3, rows: &[], twists: &[], frame: None };
            let mut fresh = memory;
            fresh.forget_active();
            let (expected, alone) = step(&solver, &tick, &mut fresh);
            let (rates, outcome) = step(&solver, &tick, &mut memory);
            prop_assert!(apart(&rates, &DVector::from_vec(expected)) < 1e-9);
            prop_assert_eq!((outcome.status, outcome.failed), (alone.status, alone.failed));
            (warm, cold) = (warm + outcome.changes, cold + alone.changes);
            for i in 0..q.len() {
                q[i] += settings.dt * rates[i];
            }
        }
        prop_assert!(warm <= cold, "{} {}", warm, cold);
    }
}

fn target(case: &Case, q: &[f64]) -> Target {
    let frame = tool(&case.robot, q);
    let axis = case.task.spin_axis().map(|axis| frame.rotate(axis));
    Target { position: frame.origin, axis, frame: frame.axes }
}

#[test]
fn from_posture_to_posture() {
    let rng = &mut Rng(2);
    for (robot, task) in [(fanuc(), Task::axisymmetric([0.0, 0.0, 1.0]).unwrap()), (iiwa(), Task::FULL)] {
        let case = Case { robot: Arc::new(robot), task };
        let n = case.n();
        let objective = condition();
        let value = |q: &[f64]| crate::common::evaluate::<16>(&objective, &case.robot, q, Order::Value, false).value;
        let (mut reached, mut gained, mut compared) = (0, 0, 0);
        for _ in 0..30 {
            let settings = QuadraticSettings { rate_weights: [1.0; 16], length: 0.5, ..settings(rng, true) };
            let solver = case.solver(Some((&objective, 1.0)), IndexForm::Equality, Derivatives::Exact, settings);
            let q0 = posture(rng, &case.robot);
            let near: Vec<f64> = q0.iter().map(|x| x + rng.within(-0.1, 0.1)).collect();
            let target = target(&case, &near);
            let found = solver.solve(&target, &q0);
            if found.status == SolveStatus::OnTarget {
                reached += 1;
                let at = tool(&case.robot, &found.q[..n]);
                assert!(norm(sub(at.origin, target.position)) < 1e-8);
                let axes = if task == Task::FULL { vec![0, 1, 2] } else { vec![2] };
                assert!(axes.into_iter().all(|k| dot(at.axes[k], target.frame[k]) > 1.0 - 1e-12));
                assert!((found.value - value(&found.q[..n])).abs() < 1e-12 * found.value.abs());
                let plain = case.plain(settings).solve(&target, &q0);
                if plain.status == SolveStatus::OnTarget {
                    assert!(plain.value.is_nan(), "without an objective there is no value");
                    compared += 1;
                    gained += usize::from(found.value <= value(&plain.q[..n]) + 1e-9);
                }
            }
            let mut all = Vec::new();
            solver.follow(&[target, target], &q0, &mut Memory::default(), &mut |point| all.push(*point));
            assert_eq!((all.len(), all[0].q), (2, found.q));
        }
        println!("{reached} of 30 reached, {gained} of {compared} better with the index");
        assert!(reached >= 27 && gained * 10 >= compared * 8);
        let solver = case.solver(Some((&objective, 1.0)), IndexForm::Equality, Derivatives::Exact, settings(rng, true));
        best_of_many(&case, &solver, rng);
    }
}

fn best_of_many(case: &Case, solver: &QuadraticSolver, rng: &mut Rng) {
    let n = case.n();
    let middle: Vec<f64> = posture(rng, &case.robot).iter().map(|x| 0.5 * x).collect();
    let target = target(case, &middle);
    let few = solver.solve_best(&target, 10, 5).unwrap();
    let many = solver.solve_best(&target, 40, 5).unwrap();
    assert!(many.value <= few.value, "more starts cannot be worse");
    assert!(case.robot.limits().margin(&many.q[..n]) >= 0.0);
    assert!(solver.solve_best(&target, 0, 5).is_none());
    // Nothing there to reach.
    let away = Target { position: [100.0, 0.0, 0.0], ..target };
    assert!(solver.solve_best(&away, 5, 5).is_none());
    let found = solver.solve(&away, &middle);
    assert!(found.status != SolveStatus::OnTarget && found.q.iter().all(|x| x.is_finite()));
}

#[test]
fn memories_are_values() {
    // A copy of a memory is as good as the memory.
    let rng = &mut Rng(9);
    let case = Case { robot: Arc::new(iiwa()), task: Task::FULL };
    let solver = case.solver(Some((&condition(), 1.0)), IndexForm::Curvature, Derivatives::Bfgs, settings(rng, true));
    let mut memory = QuadraticMemory::default();
    for _ in 0..20 {
        let q = posture(rng, &case.robot);
        let tick = Tick { q: &q, twist: twist(rng, 1.0), stiffness: 100.0, rows: &[], twists: &[], frame: None };
        let mut copy = memory;
        assert_eq!(step(&solver, &tick, &mut copy), step(&solver, &tick, &mut memory));
        assert_eq!(first_step(&solver, &tick), first_step(&solver, &tick));
    }
}
