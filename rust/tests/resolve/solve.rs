//! The orthogonal SQP on the milling robot of the thesis: the oracle's minimum, local minima along the free motion, statuses.

use std::sync::Arc;

use crate::common::{Rng, evaluate, fanuc, iiwa};
use redundancy::index::{Index, JointLimits, Kind, LimitBarrier, Objective, Order, Rows};
use redundancy::internals::kinematics::{forward, jacobian};
use redundancy::internals::linalg::Orthogonal;
use redundancy::inverse::reach;
use redundancy::resolve::{Memory, OrthogonalSqp, Resolver, Solution, SolveStatus, SqpSettings, StepStatus};
use redundancy::robot::{Limits, RandomPostures, Robot};
use redundancy::task::{Target, Task};
use serde_json::Value;

const LENGTH: f64 = 0.485_593_3;

fn settings() -> SqpSettings {
    SqpSettings { length: LENGTH, exact_hessian: true, gain: 10.0, dt: 0.001, limits: true, tolerance: 1e-10, max_iterations: 100 }
}

fn condition(length: f64) -> Objective {
    Objective::new(vec![(1.0, Index::of(Kind::ConditionNumber, Rows::all(length).unwrap(), true))]).unwrap()
}

fn milling() -> Task {
    Task::axisymmetric([0.0, 0.0, 1.0]).unwrap()
}

fn sqp(robot: Robot, task: Task, objective: Objective, settings: SqpSettings) -> OrthogonalSqp {
    OrthogonalSqp::new(Arc::new(robot), task, objective, settings).unwrap()
}

fn start_of_helix() -> Target {
    Target { position: [1.05, 1.0, 0.0], axis: Some([1.0, 0.0, 0.0]), frame: [[0.0; 3]; 3] }
}

/// Where the robot is at `q`, as a target of every kind.
fn target_at(robot: &Robot, q: &[f64], task: &Task) -> Target {
    let tool = forward::<16>(robot, q);
    let axis = Some(task.spin_axis().map_or(tool.axes[2], |axis| tool.rotate(axis)));
    Target { position: tool.origin, axis, frame: tool.axes }
}

fn on_target(solver: &OrthogonalSqp, target: &Target, solution: &Solution) {
    let n = solver.robot().n();
    let q = &solution.q[..n];
    let (w, v) = solver.task().error(&forward::<16>(solver.robot(), q), target);
    let size = |x: [f64; 3]| crate::common::length(&x);
    assert!(size(w) <= 1e-9 && size(v) <= 1e-9, "off target by {w:?} {v:?}");
    assert!((solution.position_error - size(v)).abs() <= 1e-12 && (solution.angle_error - size(w)).abs() <= 1e-12);
    if solver.settings().limits {
        assert!(solver.robot().limits().margin(q) >= -1e-9, "beyond the limits by {:e}", solver.robot().limits().margin(q));
    }
    let value = evaluate::<16>(solver.objective(), solver.robot(), q, Order::Value, false).value;
    assert!((value - solution.value).abs() <= 1e-9 * value.abs().max(1.0));
}

/// Moves along the free directions, returns to the target, and expects no lower value.
fn local_minimum(solver: &OrthogonalSqp, target: &Target, solution: &Solution) {
    let robot = solver.robot();
    let n = robot.n();
    let q = &solution.q[..n];
    let (tool, columns) = jacobian::<16>(robot, q);
    let directions = solver.task().directions(&tool, LENGTH);
    let m = directions.dimension();
    let factors = Orthogonal::new(&directions.rows(&columns), n, m);
    let basis = factors.null_space();
    let got = evaluate::<16>(solver.objective(), robot, q, Order::Hessian, false);
    let size = crate::common::length(&got.gradient[..n]);
    for z in &basis[..n - m] {
        let slope: f64 = (0..n).map(|i| z[i] * got.gradient[i]).sum();
        assert!(
            slope.abs() <= 1e-6 * (1.0 + size),
            "slope {slope:e} along the free motion at {q:?}, margin {:e}",
            robot.limits().margin(q)
        );
        for step in [-0.03, -0.01, -0.003, 0.003, 0.01, 0.03] {
            let mut moved: Vec<f64> = (0..n).map(|i| q[i] + step * z[i]).collect();
            if robot.limits().margin(&moved) < 1e-3 {
                continue;
            }
            let reached = reach(robot, Some(robot.limits()), solver.task(), target, LENGTH, &mut moved, 1e-12, 50);
            assert!(reached.error < 1e-9);
            let value = evaluate::<16>(solver.objective(), robot, &moved, Order::Value, false).value;
            assert!(value >= solution.value - 1e-9 * solution.value.abs(), "{step} away: {value} below {}", solution.value);
        }
    }
}

#[test]
fn first_point_of_the_helix() {
    let solver = sqp(fanuc(), milling(), condition(LENGTH), settings());
    for seed in [1, 2] {
        let best = solver.solve_best(&start_of_helix(), 40, seed).unwrap();
        assert_eq!(best.status, SolveStatus::Converged);
        assert!((best.value.sqrt() - 2.011_275_054).abs() < 1e-9, "kappa {}", best.value.sqrt());
        on_target(&solver, &start_of_helix(), &best);
        local_minimum(&solver, &start_of_helix(), &best);
    }
}

/// The oracle's posture and the pointwise minima at all points of the helix, followed from the first.
#[test]
fn helix() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/leger_fanuc.json")).unwrap();
    let data: Value = serde_json::from_str(&text).unwrap();
    let numbers = |v: &Value| v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
    let minima = numbers(&data["helix"]["pointwise_minimum_kappa"]);
    let solver = sqp(fanuc(), milling(), condition(LENGTH), settings());
    let first: Vec<f64> = numbers(&data["helix"]["first_point_q_deg"]).iter().map(|x| x.to_radians()).collect();
    let solution = solver.solve(&start_of_helix(), &first);
    assert_eq!(solution.status, SolveStatus::Converged);
    assert!((solution.value.sqrt() - minima[0]).abs() < 1e-9);
    assert!(crate::common::distance(&solution.q[..6], &first) < 1e-6, "{:?}", solution.q.map(f64::to_degrees));
}

#[test]
fn solutions_are_local_minima_along_the_spin() {
    let robot = fanuc();
    let mut converged = 0;
    for exact_hessian in [true, false] {
        let solver = sqp(robot.clone(), milling(), condition(LENGTH), SqpSettings { exact_hessian, ..settings() });
        let mut postures = RandomPostures::new(5);
        for _ in 0..100 {
            let (mut q, mut q0) = ([0.0; 6], [0.0; 6]);
            postures.fill(&robot, &mut q);
            q0.copy_from_slice(&q);
            q0.iter_mut().enumerate().for_each(|(i, x)| *x += 0.02 * (i as f64).cos());
            let target = target_at(&robot, &q, &milling());
            let solution = solver.solve(&target, &q0);
            if solution.status == SolveStatus::Converged {
                converged += 1;
                on_target(&solver, &target, &solution);
                local_minimum(&solver, &target, &solution);
            }
        }
    }
    println!("{converged} of 200 converged");
    assert!(converged >= 100, "only {converged} of 200 converged");
}

/// Redundant arms: position and pointing tasks of six and seven joints, the full task of seven, through the general path too.
#[test]
fn other_tasks() {
    for (robot, task) in [
        (fanuc(), Task::POSITION),
        (iiwa(), Task::FULL),
        (iiwa(), milling()),
        (iiwa(), Task::POSITION),
        (Rng(8).robot(8, false, 8), Task::FULL),
    ] {
        let n = robot.n();
        let solver = sqp(robot.clone(), task, condition(0.4), SqpSettings { max_iterations: 300, ..settings() });
        let rng = &mut Rng(3);
        let (mut converged, mut reached) = (0, 0);
        for _ in 0..30 {
            let q: Vec<f64> = (0..n).map(|_| rng.within(-0.9, 0.9)).collect();
            let q0: Vec<f64> = q.iter().map(|x| x + rng.within(-0.05, 0.05)).collect();
            let target = target_at(&robot, &q, &task);
            let solution = solver.solve(&target, &q0);
            if solution.status != SolveStatus::Unreachable {
                reached += 1;
                on_target(&solver, &target, &solution);
            }
            if solution.status == SolveStatus::Converged {
                converged += 1;
                local_minimum(&solver, &target, &solution);
            }
        }
        println!("{} joints, {task:?}: {reached} of 30 reached, {converged} converged", n);
        assert!(reached >= 24, "{n} joints, {task:?}: {reached} of 30 reached");
        assert!(converged >= 10, "{n} joints, {task:?}: {converged} of 30 converged");
    }
}

/// The full task of six joints leaves nothing free: the pose and nothing else.
#[test]
fn full_task_of_six_joints() {
    let robot = fanuc();
    let solver = sqp(robot.clone(), Task::FULL, condition(LENGTH), settings());
    let q = [0.4, 0.2, 0.3, 0.5, 0.7, -0.3];
    let target = target_at(&robot, &q, &Task::FULL);
    let solution = solver.solve(&target, &q.map(|x| x + 0.05));
    assert_eq!(solution.status, SolveStatus::Converged);
    assert!(crate::common::distance(&solution.q[..6], &q) < 1e-8);
    on_target(&solver, &target, &solution);
}

#[test]
fn statuses() {
    let robot = fanuc();
    let solver = sqp(robot.clone(), milling(), condition(LENGTH), settings());
    // Out of reach.
    let far = Target { position: [9.0, 0.0, 0.0], ..start_of_helix() };
    let q0 = [0.3, 0.2, 0.3, 0.4, 0.6, 0.1];
    assert_eq!(solver.solve(&far, &q0).status, SolveStatus::Unreachable);
    assert!(solver.solve_best(&far, 5, 1).is_none());
    // One iteration reaches nothing.
    let hasty = sqp(robot.clone(), milling(), condition(LENGTH), SqpSettings { max_iterations: 1, ..settings() });
    assert_eq!(hasty.solve(&start_of_helix(), &q0).status, SolveStatus::Unreachable);
    // A joint whose range excludes the minimum: on the target, at the limit, not converged.
    let free = solver.solve_best(&start_of_helix(), 40, 1).unwrap();
    let mut limits: Limits = robot.limits().clone();
    limits.q_min[5] = free.q[5] + 0.05;
    limits.q_max[5] = free.q[5] + 1.5;
    let tight = sqp(robot.with_limits(limits.clone()).unwrap(), milling(), condition(LENGTH), settings());
    let mut begin = free.q;
    begin[5] += 0.2;
    let mut on = begin[..6].to_vec();
    let reached = reach(tight.robot(), Some(tight.robot().limits()), &milling(), &start_of_helix(), LENGTH, &mut on, 1e-10, 60);
    assert!(reached.error < 1e-9);
    let solution = tight.solve(&start_of_helix(), &on);
    on_target(&tight, &start_of_helix(), &solution);
    assert!(solution.value >= free.value - 1e-9);
    assert_eq!(solution.status, SolveStatus::OnTarget, "{solution:?}");
    assert!(limits.margin(&solution.q[..6]).abs() < 1e-6, "not at its limit: {:e}", limits.margin(&solution.q[..6]));
    // The same start without limits comes back to the free minimum.
    let loose = sqp(robot.with_limits(limits).unwrap(), milling(), condition(LENGTH), SqpSettings { limits: false, ..settings() });
    let solution = loose.solve(&start_of_helix(), &on);
    assert_eq!(solution.status, SolveStatus::Converged);
    assert!((solution.value - free.value).abs() < 1e-9);
}

/// Objectives of joints alone.
#[test]
fn limits_as_objective() {
    let robot = fanuc();
    for index in [Index::JointLimits(JointLimits::new(&[]).unwrap()), Index::LimitBarrier(LimitBarrier::new(&[]).unwrap())] {
        let objective = Objective::new(vec![(1.0, index), (0.1, condition(LENGTH).terms()[0].1.clone())]).unwrap();
        let solver = sqp(robot.clone(), milling(), objective, settings());
        let best = solver.solve_best(&start_of_helix(), 30, 3).unwrap();
        assert_eq!(best.status, SolveStatus::Converged, "{best:?}");
        on_target(&solver, &start_of_helix(), &best);
        local_minimum(&solver, &start_of_helix(), &best);
    }
}

/// Whatever the arrays, nothing is read or written beyond them.
#[test]
fn arrays_of_another_size_lead_nowhere() {
    let solver = sqp(fanuc(), milling(), condition(LENGTH), settings());
    for n in [0, 5, 7, 16, 20] {
        let mut rates = vec![1.0; n];
        assert_eq!(solver.step(&vec![0.1; n], &[0.1; 6], &mut rates), StepStatus::Limited);
        assert!(rates.iter().all(|rate| *rate == 0.0));
        assert_eq!(solver.solve(&start_of_helix(), &vec![0.1; n]).status, SolveStatus::Unreachable);
        assert!(solver.error(&start_of_helix(), &vec![0.1; n])[0].is_nan());
        let mut ends = 0;
        solver.follow(&[start_of_helix()], &vec![0.1; n], &mut Memory::default(), &mut |_| ends += 1);
        assert_eq!(ends, 1);
    }
    assert!(StepStatus::ALL.iter().enumerate().all(|(i, status)| *status as usize == i));
}

/// Of a joint with one limit, a start and its whole turns are one posture, on the right side of the limit.
#[test]
fn solutions_are_turned_into_one_sided_limits() {
    let mut limits = Limits::none(6);
    limits.q_max[0] = -4.0;
    let robot = fanuc().with_limits(limits).unwrap();
    for seed in 0..3 {
        let best = sqp(robot.clone(), milling(), condition(LENGTH), settings()).solve_best(&start_of_helix(), 12, seed).unwrap();
        assert_ne!(best.status, SolveStatus::Unreachable);
        assert!(best.q[0] <= -4.0 + 1e-9, "{best:?}");
    }
}

#[test]
fn follow_goes_from_point_to_point() {
    let robot = fanuc();
    let solver = sqp(robot, milling(), condition(LENGTH), settings());
    let targets: Vec<Target> =
        (0..21).map(|i| Target { position: [1.05 + 0.005 * f64::from(i), 1.0 - 0.01 * f64::from(i), 0.0], ..start_of_helix() }).collect();
    let first = solver.solve_best(&targets[0], 40, 1).unwrap();
    let mut points = Vec::new();
    solver.follow(&targets, &first.q[..6], &mut Memory::default(), &mut |point| {
        points.push(*point);
    });
    assert_eq!(points.len(), targets.len());
    for (i, point) in points.iter().enumerate() {
        assert_eq!(point.status, SolveStatus::Converged, "point {i}");
        on_target(&solver, &targets[i], point);
        local_minimum(&solver, &targets[i], point);
        if i > 0 {
            assert!(crate::common::distance(&point.q, &points[i - 1].q) < 0.2, "jump at {i}");
        }
    }
    assert!((points[0].value.sqrt() - 2.011_275_054).abs() < 1e-9);
}
