//! Limits on combinations of joints in ticks: whatever is asked for, rates are finite, within the limits and cross no combination's; nothing is allocated.

use std::sync::Arc;

use proptest::prelude::*;
use redundancy::index::{Index, JointLimits, Kind, Objective, Rows};
use redundancy::inverse::reach;
use redundancy::kinematics;
use redundancy::resolve::{
    Derivatives, IndexForm, Memory, Method, OrthogonalSqp, QuadraticMemory, QuadraticSettings, QuadraticSolver, RateSettings, RateSolver,
    Resolver, Secondary, SqpSettings, StepStatus, Tick,
};
use redundancy::robot::{Combination, Limits, Robot};
use redundancy::task::{Target, Task};

use crate::allocation::free_of_allocation;
use crate::common::{Rng, fanuc, iiwa, rngs};

const DT: f64 = 1e-3;

/// An arm with combinations of two and three joints, whose limits are some way from a posture, or on the wrong side of it.
fn limited(rng: &mut Rng, q: &[f64], beyond: bool) -> Arc<Robot> {
    let robot = if q.len() == 6 { fanuc() } else { iiwa() };
    let mut limits = robot.limits().clone();
    if rng.below(2) == 0 {
        limits.qdd_max = vec![20.0; q.len()];
    }
    for _ in 0..1 + rng.below(3) {
        let mut row = vec![0.0; q.len()];
        for _ in 0..2 + rng.below(2) {
            row[rng.below(q.len())] = [1.0, -1.0, 0.5, 2.0][rng.below(4)];
        }
        let value: f64 = row.iter().zip(q).map(|(c, x)| c * x).sum();
        let (low, high) = (value - rng.within(0.0, 1e-3), value + rng.within(0.0, 1e-3));
        let (low, high) = if beyond { (low + 0.1, high + 0.2) } else { (low, high) };
        limits.coupled.push(Combination { row, low: if rng.below(3) == 0 { f64::NEG_INFINITY } else { low }, high });
    }
    Arc::new(robot.with_limits(limits).unwrap())
}

fn objective(n: usize) -> Objective {
    let condition = Index::of(Kind::ConditionNumber, Rows::all(0.5).unwrap(), true);
    let limits = Index::JointLimits(JointLimits::new(&[]).unwrap());
    Objective::new(vec![(1.0, condition), (if n == 6 { 0.1 } else { 0.01 }, limits)]).unwrap()
}

/// A tick of every method, each with a name and whether it comes back.
fn ticks(robot: &Arc<Robot>, task: Task, q: &[f64], twist: &[f64; 6], mut each: impl FnMut(&str, &[f64], bool)) {
    let n = robot.n();
    let mut rates = vec![0.0; n];
    for method in [Method::TwistDecomposition, Method::ResolvedRate, Method::GradientProjection, Method::TaskPriority] {
        let settings = RateSettings { length: 0.5, dt: DT, ..RateSettings::default() };
        let solver = RateSolver::new(robot.clone(), task, method, Secondary::None, None, settings).unwrap();
        let status = free_of_allocation("rate step", || solver.step(q, twist, &mut Memory::default(), &mut rates));
        each(&format!("{method:?}"), &rates, status == StepStatus::Returning);
    }
    let settings = SqpSettings { length: 0.5, dt: DT, ..SqpSettings::default() };
    let solver = OrthogonalSqp::new(robot.clone(), task, objective(n), settings).unwrap();
    let status = free_of_allocation("step", || solver.step(q, twist, &mut rates));
    each("SQP", &rates, status == StepStatus::Returning);
    let settings = QuadraticSettings { length: 0.5, dt: DT, ..QuadraticSettings::default() };
    let index = Some((objective(n), 1.0));
    let solver = QuadraticSolver::new(robot.clone(), task, index, IndexForm::Curvature, Derivatives::Exact, settings).unwrap();
    let tick = Tick { q, twist: *twist, stiffness: 100.0, rows: &[], twists: &[], frame: None };
    let mut memory = QuadraticMemory::default();
    let outcome = free_of_allocation("tick", || solver.step(&tick, &mut memory, &mut rates));
    each("QP", &rates, outcome.status.name() == "returning");
}

fn some_posture(rng: &mut Rng) -> Vec<f64> {
    let robot = if rng.below(2) == 0 { fanuc() } else { iiwa() };
    let limits: &Limits = robot.limits();
    (0..robot.n()).map(|i| rng.within(limits.q_min[i], limits.q_max[i])).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_tick_crosses_them(seed in rngs(), full in any::<bool>(), beyond in any::<bool>()) {
        let rng = &mut Rng(seed);
        let q = some_posture(rng);
        let robot = limited(rng, &q, beyond);
        let task = if full { Task::FULL } else { Task::axisymmetric([0.1, 0.2, 1.0]).unwrap() };
        let size = 10f64.powf(rng.within(-2.0, 2.0));
        let twist = std::array::from_fn(|_| size * rng.within(-1.0, 1.0));
        let limits = robot.limits();
        let mut wrong = None;
        ticks(&robot, task, &q, &twist, |name, rates, returning| {
            let there: Vec<f64> = q.iter().zip(rates).map(|(x, rate)| x + DT * rate).collect();
            let fast = rates.iter().zip(&limits.qd_max).any(|(rate, most)| rate.is_nan() || rate.abs() > most * (1.0 + 1e-12));
            let crossed = limits.coupled.iter().any(|it| it.margin(&there) < it.margin(&q).min(0.0) - 1e-13);
            if fast || crossed || returning != limits.coupled.iter().any(|it| it.margin(&q) < -1e-9) {
                wrong = Some(format!("{name}: {rates:?} fast {fast} crossed {crossed} returning {returning}"));
            }
        });
        prop_assert!(wrong.is_none(), "{}", wrong.unwrap_or_default());
    }

    #[test]
    fn rates_are_finite_from_any_bits(seed in rngs()) {
        let rng = &mut Rng(seed);
        let mut q = some_posture(rng);
        let robot = limited(rng, &q, false);
        let which = rng.below(q.len());
        q[which] = rng.wild();
        let twist = std::array::from_fn(|_| rng.wild());
        let mut wrong = None;
        ticks(&robot, Task::FULL, &q, &twist, |name, rates, _| {
            if !rates.iter().all(|x| x.is_finite()) {
                wrong = Some(format!("{name}: {rates:?} at {q:?}"));
            }
        });
        prop_assert!(wrong.is_none(), "{}", wrong.unwrap_or_default());
    }

    #[test]
    fn newton_stays_within_them(seed in rngs()) {
        let rng = &mut Rng(seed);
        let q = some_posture(rng);
        let robot = limited(rng, &q, false);
        let far: Vec<f64> = q.iter().map(|x| 0.5 * x + rng.within(-0.3, 0.3)).collect();
        let (tool, _) = kinematics::jacobian(&robot, &far).unwrap();
        let target = Target { position: tool.origin, axis: Some(tool.axes[2]), frame: tool.axes };
        let mut there = q.clone();
        free_of_allocation("reach", || reach(&robot, Some(robot.limits()), &Task::POSITION, &target, 0.5, &mut there, 1e-9, 60));
        prop_assert!(robot.limits().contain(&there), "{}", robot.limits().margin(&there));
        let settings = SqpSettings { length: 0.5, ..SqpSettings::default() };
        let solver = OrthogonalSqp::new(robot.clone(), Task::POSITION, objective(q.len()), settings).unwrap();
        let found = free_of_allocation("solve", || solver.solve(&target, &q));
        prop_assert!(robot.limits().contain(&found.q[..q.len()]), "{}", robot.limits().margin(&found.q[..q.len()]));
    }
}
