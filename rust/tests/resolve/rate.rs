//! Twist projectors, twist decomposition and its rivals.

use std::sync::Arc;

use proptest::prelude::*;
use redundancy::index::{Index, JointLimits, Objective};
use redundancy::internals::kinematics::{Jacobian, forward, jacobian};
use redundancy::internals::linalg::Svd;
use redundancy::linalg::Row6;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::halves;
use redundancy::resolve::{Memory, Method, RateSettings, RateSolver, Resolver, Scaling, Secondary, Situation, StepStatus};
use redundancy::robot::Robot;
use redundancy::task::{Projector, Reference, Target, Task};

use crate::common::{Rng, distance, fanuc, iiwa, length, rngs};

/// The capacity of all tests of this file: the largest, so that virtual joints fit.
const C: usize = 16;

fn projectors(rng: &mut Rng) -> Vec<Projector> {
    vec![Projector::None, Projector::line(rng.direction()).unwrap(), Projector::plane(rng.direction()).unwrap(), Projector::All]
}

/// All 16 tasks in all three references.
fn tasks(rng: &mut Rng) -> Vec<Task> {
    let mut out = Vec::new();
    for reference in [Reference::Tool, Reference::Base, Reference::Part(rng.frame())] {
        for angular in projectors(rng) {
            for linear in projectors(rng) {
                out.push(Task { angular, linear, reference });
            }
        }
    }
    out
}

/// J dq as a twist.
fn twist_of(columns: &Jacobian<C>, dq: &[f64]) -> Row6 {
    columns.times(dq)
}

fn reduced(task: &Task, tool: &Frame, twist: &Row6) -> Row6 {
    let (w, v) = halves(twist);
    task.directions(tool, 1.0).reduce(w, v)
}

/// A posture far from singular for all six components.
fn regular(rng: &mut Rng, robot: &Robot) -> Option<(Vec<f64>, f64)> {
    (0..50).find_map(|_| {
        let q: Vec<f64> = (0..robot.n()).map(|_| rng.within(-2.5, 2.5)).collect();
        let (tool, columns) = jacobian::<C>(robot, &q);
        let sigma = Svd::<C>::new(&Task::FULL.directions(&tool, 1.0).rows(&columns), robot.n(), 6).sigma;
        (sigma[0] < 300.0 * sigma[5]).then_some((q, sigma[0] / sigma[5]))
    })
}

fn motion(method: Method, task: &Task, robot: &Robot, q: &[f64], twist: &Row6, h: &[f64; C], weights: &[f64; C]) -> ([f64; C], bool) {
    let n = robot.n();
    let at = Situation { robot, q, task, length: 0.7, damping: 1e-9, weights: &weights[..n] };
    let mut dq = [0.0; C];
    let damped = method.motion(&at, twist, &h[..n], &mut dq[..n]);
    (dq, damped)
}

fn random_h(rng: &mut Rng, n: usize) -> [f64; C] {
    std::array::from_fn(|i| if i < n { rng.within(-1.0, 1.0) } else { 0.0 })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn projectors_are_projectors(seed in rngs()) {
        let rng = &mut Rng(seed);
        let tool = rng.frame();
        for task in tasks(rng) {
            let (t, rest) = (task.projector(&tool), task.complement().projector(&tool));
            let mut trace = 0.0;
            for r in 0..6 {
                trace += t[r][r];
                for c in 0..6 {
                    let square: f64 = (0..6).map(|i| t[r][i] * t[i][c]).sum();
                    let crossed: f64 = (0..6).map(|i| t[r][i] * rest[i][c]).sum();
                    let one = f64::from(u8::from(r == c));
                    prop_assert!((t[r][c] - t[c][r]).abs() < 4e-15 && (square - t[r][c]).abs() < 4e-15, "{task:?}");
                    prop_assert!((t[r][c] + rest[r][c] - one).abs() < 4e-15 && crossed.abs() < 4e-15, "{task:?}");
                }
            }
            prop_assert!((trace - task.dimension() as f64).abs() < 1e-14, "rank {trace} of {task:?}");
            prop_assert_eq!(task.dimension() + task.complement().dimension(), 6);
        }
    }

    /// The motion that a projection at the point of the task leaves is what `project` answers at the tool point.
    #[test]
    fn twists_split_into_task_and_rest(seed in rngs()) {
        let rng = &mut Rng(seed);
        let tool = rng.frame();
        for task in tasks(rng) {
            let (w, v) = (rng.direction(), rng.direction());
            let (tw, tv) = task.directions(&tool, 1.0).project(w, v);
            let (rw, rv) = task.complement().directions(&tool, 1.0).project(w, v);
            for i in 0..3 {
                prop_assert!((tw[i] + rw[i] - w[i]).abs() < 1e-13 && (tv[i] + rv[i] - v[i]).abs() < 1e-13, "{task:?}");
            }
            let kept = task.directions(&tool, 1.0).reduce(rw, rv);
            prop_assert!(length(&kept) < 1e-13, "{task:?}: the rest moves {kept:?}");
        }
    }

    /// Every method does what the task asks, whatever the secondary motion; and none touches the twist's free part but those that say so.
    #[test]
    fn every_method_fulfils_the_task(seed in rngs(), n in 6usize..=8) {
        let rng = &mut Rng(seed);
        let robot = rng.robot(n, false, n);
        let Some((q, kappa)) = regular(rng, &robot) else { return Ok(()) };
        let (tool, columns) = jacobian::<C>(&robot, &q);
        let twist: Row6 = std::array::from_fn(|_| rng.within(-1.0, 1.0));
        let (h, weights) = (random_h(rng, n), std::array::from_fn(|_| rng.within(0.2, 5.0)));
        for task in tasks(rng) {
            let wanted = reduced(&task, &tool, &twist);
            for method in Method::ALL {
                let (dq, damped) = motion(method, &task, &robot, &q, &twist, &h, &weights);
                let got = reduced(&task, &tool, &twist_of(&columns, &dq[..n]));
                let size = length(&wanted) + length(&h) + length(&dq);
                prop_assert!(!damped && distance(&wanted, &got) < 1e-13 * kappa * kappa * size.max(1.0), "{method:?} {task:?}: {wanted:?} {got:?}");
            }
        }
    }

    /// Projection, reflections and elimination are three ways to the same motion, the nearest to h that fulfils the task; the weighted inverse
    /// finds the nearest in its own metric.
    #[test]
    fn the_nearest_motion(seed in rngs(), n in 6usize..=8) {
        let rng = &mut Rng(seed);
        let robot = rng.robot(n, false, n);
        let Some((q, kappa)) = regular(rng, &robot) else { return Ok(()) };
        let twist: Row6 = std::array::from_fn(|_| rng.within(-1.0, 1.0));
        let (h, weights): ([f64; C], [f64; C]) = (random_h(rng, n), std::array::from_fn(|_| rng.within(0.2, 5.0)));
        for task in tasks(rng) {
            let of = |method| motion(method, &task, &robot, &q, &twist, &h, &weights).0;
            let nearest = of(Method::GradientProjection);
            let tolerance = 1e-12 * kappa * kappa * (1.0 + length(&nearest));
            prop_assert!(distance(&nearest, &of(Method::Householder)) < tolerance);
            // Its rows are not orthonormal: worse conditioned, the same motion.
            prop_assert!(distance(&nearest, &of(Method::Elimination)) < 10.0 * tolerance, "{task:?}");
            let weighted = of(Method::WeightedInverse);
            let norm = |x: &[f64; C]| (0..n).map(|i| weights[i] * (x[i] - h[i]).powi(2)).sum::<f64>();
            for other in [nearest, of(Method::TwistDecomposition), of(Method::VirtualJoint), of(Method::TaskPriority)] {
                prop_assert!(norm(&weighted) <= norm(&other) + tolerance, "{task:?}");
                prop_assert!(distance(&nearest, &h) <= distance(&other, &h) + tolerance, "{task:?}");
            }
        }
    }

    /// With every component of the twist wanted nothing is functional: twist decomposition is gradient projection (2.25), and so is the
    /// virtual joint that does not exist.
    #[test]
    fn intrinsic_redundancy_alone(seed in rngs(), n in 6usize..=9) {
        let rng = &mut Rng(seed);
        let robot = rng.robot(n, false, n);
        let Some((q, kappa)) = regular(rng, &robot) else { return Ok(()) };
        let twist: Row6 = std::array::from_fn(|_| rng.within(-1.0, 1.0));
        let (h, ones) = (random_h(rng, n), [1.0; C]);
        let nearest = motion(Method::GradientProjection, &Task::FULL, &robot, &q, &twist, &h, &ones).0;
        for method in [Method::TwistDecomposition, Method::VirtualJoint] {
            let got = motion(method, &Task::FULL, &robot, &q, &twist, &h, &ones).0;
            prop_assert!(distance(&got, &nearest) < 1e-12 * kappa * kappa * (1.0 + length(&nearest)), "{method:?}");
        }
    }

    /// (3.8) as printed: `J^-1 T t + J^-1 (1 - T) J h`, by Gauss elimination of the square system.
    #[test]
    fn twist_decomposition_as_printed(seed in rngs()) {
        let rng = &mut Rng(seed);
        let robot = rng.robot(6, false, 6);
        let Some((q, kappa)) = regular(rng, &robot) else { return Ok(()) };
        let task = Task::axisymmetric(rng.direction()).unwrap();
        let (tool, columns) = jacobian::<C>(&robot, &q);
        let twist: Row6 = std::array::from_fn(|_| rng.within(-1.0, 1.0));
        let h = random_h(rng, 6);
        let t = nalgebra::Matrix6::from_fn(|r, c| task.projector(&tool)[r][c]);
        let j = nalgebra::Matrix6::from_fn(|r, c| columns.column(c)[r]);
        let (twist_v, h_v) = (nalgebra::Vector6::from_row_slice(&twist), nalgebra::Vector6::from_row_slice(&h[..6]));
        let wanted = t * twist_v + (nalgebra::Matrix6::identity() - t) * j * h_v;
        let printed = j.lu().solve(&wanted).unwrap();
        let got = motion(Method::TwistDecomposition, &task, &robot, &q, &twist, &h, &[1.0; C]).0;
        prop_assert!(distance(&got[..6], printed.as_slice()) < 1e-13 * kappa * kappa * (1.0 + length(printed.as_slice())));
    }

    /// What is left of a target is nothing once the free motions of the task have been made.
    #[test]
    fn free_motions_leave_no_error(seed in rngs()) {
        let rng = &mut Rng(seed);
        let tool = rng.frame();
        let target = Target { position: tool.origin, axis: None, frame: tool.axes };
        let spin = rng.within(-3.0, 3.0);
        let axis = rng.direction();
        let part = rng.frame();
        for (reference, turned) in [
            (Reference::Tool, tool.compose(&Frame::rotation(axis, spin))),
            (Reference::Base, Frame { axes: Frame::rotation(axis, spin).compose(&tool).axes, origin: tool.origin }),
            (Reference::Part(part), part.compose(&Frame::rotation(axis, spin)).compose(&part.inverse()).compose(&tool)),
        ] {
            let task = Task { angular: Projector::plane(axis).unwrap(), linear: Projector::All, reference };
            let (w, v) = task.error(&turned, &target);
            prop_assert!(length(&w) < 1e-13 && length(&v) < 1e-12, "{reference:?}: {w:?} {v:?}");
        }
    }
}

fn settings() -> RateSettings {
    RateSettings {
        length: 0.5,
        gain: 1.0,
        relaxation: 1.0,
        damping: 1e-3,
        dt: 1e-3,
        limits: true,
        iterations: 20,
        stop: 0.0,
        correct: true,
        tolerance: 1e-12,
    }
}

fn limits_objective() -> Objective {
    Objective::new(vec![(1.0, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap()
}

/// Straight through wrist, elbow and shoulder singularities: every rate finite, within its limit, with a status; and without limits bounded
/// by the damping.
#[test]
fn through_singularities() {
    let robot = Arc::new(fanuc());
    let task = Task::axisymmetric([0.0, 0.0, 1.0]).unwrap();
    // Wrist: q5 through 0; elbow: the arm stretched; shoulder: the wrist over the first axis.
    let through: [(&str, [f64; 6], usize); 3] = [
        ("wrist", [0.3, 0.2, -0.4, 0.5, 0.0, 0.1], 4),
        ("elbow", [0.3, 0.2, (0.17f64 / 1.016).atan() - std::f64::consts::FRAC_PI_2, 0.5, 0.8, 0.1], 2),
        ("shoulder", [0.3, -0.98, 0.25, 0.5, 0.8, 0.1], 1),
    ];
    for (name, centre, joint) in through {
        for method in Method::ALL {
            for scaling in [Scaling::Gradient, Scaling::Newton] {
                for limits in [true, false] {
                    let secondary = Secondary::Objective(limits_objective(), scaling);
                    let solver =
                        RateSolver::new(robot.clone(), task, method, secondary, None, RateSettings { limits, ..settings() }).unwrap();
                    let mut memory = Memory::default();
                    for i in -200..=200 {
                        let mut q = centre;
                        q[joint] += f64::from(i) * 1e-3;
                        let mut rates = [f64::NAN; 6];
                        let twist = [0.3, -0.2, 0.4, 0.1, 0.2, -0.1];
                        let status = solver.step(&q, &twist, &mut memory, &mut rates);
                        let fastest = rates.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                        assert!(rates.iter().all(|x| x.is_finite()), "{name} {method:?} {i}: {rates:?}");
                        // |b| / (damping |A|) at most: (0.6 + 0.6) / (1e-3 * 0.5) is far above what the thresholds let through.
                        assert!(fastest < 4e3, "{name} {method:?} {i} {status:?}: {rates:?}");
                        if limits {
                            assert!(
                                rates.iter().zip(&robot.limits().qd_max).all(|(x, most)| x.abs() <= most * (1.0 + 1e-12)),
                                "{name} {method:?}"
                            );
                        }
                        if i == 0 && name == "wrist" {
                            assert!(matches!(status, StepStatus::Damped | StepStatus::Limited | StepStatus::Regular), "{status:?}");
                        }
                    }
                }
            }
        }
    }
}

/// On a closed path every method that resolves redundancy returns onto its targets, whatever the number of joints.
#[test]
fn converged_solutions_keep_their_targets() {
    let task = Task::axisymmetric([0.0, 0.0, 1.0]).unwrap();
    let secondary = || Secondary::Objective(limits_objective(), Scaling::Gradient);
    for robot in [fanuc(), iiwa()] {
        let robot = Arc::new(robot);
        let n = robot.n();
        let bent = [0.3, 0.6, -0.5, if n == 6 { 0.6 } else { -1.3 }, 0.9, 0.8, 0.4];
        let q0 = bent[..n].to_vec();
        let start = forward::<C>(&robot, &q0);
        let targets: Vec<Target> = (0..60)
            .map(|i| {
                let angle = f64::from(i) * 0.1;
                let position = [start.origin[0], start.origin[1] + 0.05 * angle.sin(), start.origin[2] + 0.05 * (1.0 - angle.cos())];
                Target { position, axis: Some(start.axes[2]), frame: start.axes }
            })
            .collect();
        for method in Method::ALL {
            let solver = RateSolver::new(robot.clone(), task, method, secondary(), None, settings()).unwrap();
            let mut count = 0;
            solver.follow(&targets, &q0, &mut Memory::default(), &mut |point| {
                count += 1;
                assert!(point.position_error < 1e-11 && point.angle_error < 1e-11, "{method:?} {n}: {point:?}");
            });
            assert_eq!(count, targets.len());
        }
    }
}

/// Newton steps lie in the null space of the task, where every method keeps them, and end where the objective is least. (The gradient,
/// which twist decomposition projects obliquely, ends elsewhere.)
#[test]
fn newton_scaling_ends_at_the_minimum() {
    let robot = Arc::new(fanuc());
    let task = Task::axisymmetric([0.0, 0.0, 1.0]).unwrap();
    let q = [0.3, 0.4, -0.5, 0.6, 0.9, 0.2];
    let tool = forward::<C>(&robot, &q);
    let target = Target { position: tool.origin, axis: Some(tool.axes[2]), frame: tool.axes };
    let value = |method, scaling, iterations| {
        let settings = RateSettings { iterations, ..settings() };
        let secondary = Secondary::Objective(limits_objective(), scaling);
        let solver = RateSolver::new(robot.clone(), task, method, secondary, None, settings).unwrap();
        solver.solve(&target, &q).value
    };
    let least = value(Method::GradientProjection, Scaling::Gradient, 5000);
    assert!(value(Method::GradientProjection, Scaling::Gradient, 12) > least + 1e-6);
    for method in [Method::GradientProjection, Method::TwistDecomposition, Method::VirtualJoint] {
        let newton = value(method, Scaling::Newton, 20);
        assert!((newton - least).abs() < 1e-9, "{method:?}: {newton} {least}");
    }
}

/// A secondary motion that pushes against a limit gives way; the task does not suffer.
#[test]
fn the_task_comes_before_the_secondary_motion() {
    let robot = Arc::new(fanuc());
    let task = Task::axisymmetric([0.0, 0.0, 1.0]).unwrap();
    let mut q = [0.3, 0.4, -0.5, 0.6, 0.9, 0.2];
    q[3] = robot.limits().q_max[3];
    let (tool, columns) = jacobian::<C>(&robot, &q);
    let objective = Objective::new(vec![(-1.0, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap();
    let secondary = Secondary::Objective(objective, Scaling::Gradient);
    let mut held = 0;
    for method in Method::ALL {
        let settings = RateSettings { gain: 5.0, ..settings() };
        let solver = RateSolver::new(robot.clone(), task, method, secondary.clone(), None, settings).unwrap();
        for twist in [[0.1, -0.1, 0.05, 0.02, -0.03, 0.01], [-0.1, 0.1, -0.05, -0.02, 0.03, -0.01]] {
            let mut rates = [0.0; 6];
            let status = solver.step(&q, &twist, &mut Memory::default(), &mut rates);
            let alone = RateSolver::new(robot.clone(), task, method, Secondary::None, None, settings).unwrap();
            let mut without = [0.0; 6];
            if alone.step(&q, &twist, &mut Memory::default(), &mut without) != StepStatus::Regular {
                continue;
            }
            held += usize::from(status == StepStatus::Limited);
            assert!(rates[3] <= 0.0, "{method:?}");
            let (wanted, got) = (reduced(&task, &tool, &twist), reduced(&task, &tool, &twist_of(&columns, &rates)));
            assert!(distance(&wanted, &got) < 1e-10, "{method:?} {status:?}: {wanted:?} {got:?}");
        }
    }
    assert!(held > 0);
}

/// With as many columns, virtual ones included, as the capacity that takes all of them for joints.
#[test]
fn virtual_joints_of_small_arms() {
    let rng = &mut Rng(4);
    for n in 2..=7 {
        let robot = Arc::new(rng.robot(n, false, n));
        for task in tasks(rng) {
            let q: Vec<f64> = (0..n).map(|_| rng.within(-2.0, 2.0)).collect();
            let solver = RateSolver::new(robot.clone(), task, Method::VirtualJoint, Secondary::None, None, settings()).unwrap();
            let mut rates = vec![f64::NAN; n];
            solver.step(&q, &[0.1; 6], &mut Memory::default(), &mut rates);
            assert!(rates.iter().all(|x| x.is_finite()), "{n} joints, {task:?}");
        }
    }
}
