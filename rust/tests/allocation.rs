//! No kernel, index or step allocates after construction.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;
use std::sync::Arc;

use crate::collision::shapes::seven_capsules;
use crate::common::{Rng, fanuc, iiwa, indices};
use redundancy::collision::{Obstacle, Proximity, Scene, Shape, capsules_along_links};
use redundancy::index::{Answers, Index, Objective, Order, Rows, length_of_least_condition};
use redundancy::internals::kinematics::forward;
use redundancy::inverse::descent::{Cost, Goal, Order as Sweeps, descend, suggested_weights};
use redundancy::inverse::{Inverse, reach};
use redundancy::kinematics;
use redundancy::linalg::{MAX_JOINTS, frame::Frame, quaternion::Quaternion};
use redundancy::qp::Row;
use redundancy::resolve::{
    Beside, Damper, Derivatives, FrameTask, Guard, IndexForm, Memory, Method, Near, OrthogonalSqp, PathFrame, PosturePull, PostureTask,
    QuadraticMemory, QuadraticSettings, QuadraticSolver, RateSettings, RateSolver, Resolver, Scaling, Secondary, SqpSettings, Tick,
};
use redundancy::robot::{Joint, Robot};
use redundancy::task::{OrientationVolume, Target, Task};
use redundancy::with_capacity;

/// Counts what the current thread asks for.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

fn count() {
    // A thread that is going away has no counter any more.
    let _ = ALLOCATIONS.try_with(|counter| counter.set(counter.get() + 1));
}

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What `f` returns, after checking that it asked for no memory.
pub fn free_of_allocation<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let before = ALLOCATIONS.get();
    let out = black_box(f());
    let after = ALLOCATIONS.get();
    assert_eq!(after - before, 0, "{what}: {} allocations", after - before);
    out
}

#[test]
fn the_counter_counts() {
    let before = ALLOCATIONS.get();
    black_box(vec![1.0; 10]);
    assert_eq!(ALLOCATIONS.get() - before, 1);
}

fn rows_for(n: usize) -> Rows {
    Rows::new(if n < 6 { &[3, 4, 5] } else { &[0, 1, 2, 3, 4, 5] }, 0.5).unwrap()
}

fn tasks(n: usize) -> Vec<Task> {
    let all = [Task::POSITION, Task::axisymmetric([0.0, 0.0, 1.0]).unwrap(), Task::FULL];
    all.into_iter().filter(|task| task.dimension() <= n).collect()
}

fn target_at<const C: usize>(robot: &Robot, q: &[f64]) -> Target {
    let tool = forward::<C>(robot, q);
    Target { position: tool.origin, axis: Some(tool.axes[2]), frame: tool.axes }
}

fn kernels(robot: &Robot, q: &[f64]) {
    let n = robot.n();
    let rates: Vec<f64> = (0..n).map(|i| 0.1 + 0.2 * i as f64).collect();
    let mut second = vec![0.0; 6 * n * n * n];
    let mut first = vec![0.0; 6 * n * n];
    let mut columns = vec![0.0; 6 * n];
    free_of_allocation("forward", || kinematics::forward(robot, q)).unwrap();
    free_of_allocation("forward_into", || kinematics::forward_into(robot, q, &mut [0.0; 16])).unwrap();
    free_of_allocation("jacobian", || kinematics::jacobian(robot, q)).unwrap();
    free_of_allocation("jacobian_into", || kinematics::jacobian_into(robot, q, &mut columns)).unwrap();
    free_of_allocation("first_derivative", || kinematics::first_derivative(robot, q, &mut first)).unwrap();
    free_of_allocation("second_derivative", || kinematics::second_derivative(robot, q, &mut second)).unwrap();
    free_of_allocation("jacobian_rate", || kinematics::jacobian_rate(robot, q, &rates, &mut columns)).unwrap();

    let rows = rows_for(n);
    free_of_allocation("length_of_least_condition", || length_of_least_condition(robot, q, &rows)).unwrap();
    for index in indices(rows) {
        let objective = Objective::new(vec![(1.0, index.clone())]).unwrap();
        for order in [Order::Value, Order::Gradient, Order::Hessian] {
            for with_length in [false, true] {
                free_of_allocation(&format!("{index:?} {order:?} {with_length}"), || objective.evaluate(robot, q, order, with_length))
                    .unwrap();
            }
        }
    }
    let sum = Objective::new(indices(rows).into_iter().map(|index| (0.3, index)).collect()).unwrap();
    free_of_allocation("sum", || sum.evaluate_into(robot, q, false, &mut first[..n], &mut second[..n * n])).unwrap();
    let (mut values, mut gradients) = ([0.0; 5], vec![0.0; 5 * n]);
    let many = q.repeat(5);
    for objective in [&sum, &Objective::new(vec![(1.0, indices(rows)[2].clone())]).unwrap()] {
        let out = &mut Answers { values: &mut values, gradients: &mut gradients, hessians: &mut [] };
        free_of_allocation("evaluate_many", || objective.evaluate_many(robot, &many, false, out)).unwrap();
    }
    free_of_allocation("check", || sum.check(robot).is_ok());
}

fn resolution<const C: usize>(robot: &Robot, q: &[f64]) {
    let n = robot.n();
    let robot = Arc::new(robot.clone());
    let rows = rows_for(n);
    let simple = |index: Index| Objective::new(vec![(1.0, index)]).unwrap();
    let objectives = [
        simple(indices(rows)[2].clone()),
        Objective::new(vec![(1.0, indices(rows)[7].clone()), (0.1, indices(rows)[0].clone()), (1e-3, indices(rows)[1].clone())]).unwrap(),
    ];
    let near: Vec<f64> = q.iter().enumerate().map(|(i, x)| x + 0.03 * (i as f64).cos()).collect();
    let far: Vec<f64> = q.iter().enumerate().map(|(i, x)| 0.3 * x - 0.4 * (2.0 * i as f64).cos()).collect();
    let twist = [0.1, -0.2, 0.05, 0.3, 0.1, -0.2];
    let mut rates = vec![0.0; n];
    for task in tasks(n) {
        for objective in &objectives {
            for (exact_hessian, limits) in [(true, true), (false, true), (true, false)] {
                let settings =
                    SqpSettings { length: 0.5, exact_hessian, gain: 5.0, dt: 0.001, limits, tolerance: 1e-10, max_iterations: 60 };
                let sqp = OrthogonalSqp::new(robot.clone(), task, objective.clone(), settings).unwrap();
                free_of_allocation("step", || sqp.step(q, &twist, &mut rates));
                let target = free_of_allocation("target", || target_at::<C>(&robot, &near));
                free_of_allocation("solve", || sqp.solve(&target, q));
                let targets = [target, target_at::<C>(&robot, q), target_at::<C>(&robot, &far)];
                free_of_allocation("solve from afar", || sqp.solve(&targets[2], q));
                let mut worst = 0.0f64;
                free_of_allocation("follow", || {
                    sqp.follow(&targets, q, &mut Memory::default(), &mut |point| worst = worst.max(point.position_error))
                });
                free_of_allocation("solve_best", || sqp.solve_best(&target, 3, 5));
            }
        }
        let target = target_at::<C>(&robot, &far);
        let mut moved = q.to_vec();
        // A refusal has words, which take memory.
        let sound = robot.coupling().is_none() && target.position.iter().all(|x| x.is_finite());
        if task.kind() != "general" && sound {
            let cost = Cost::new(Goal::of(&task, &target, suggested_weights(&robot)).unwrap());
            let sweep = |q: &mut [f64]| descend(&robot, &cost, Some(robot.limits()), Sweeps::Double, 3, q);
            // Joints that follow others and goals that are no numbers are refused.
            if sweep(&mut q.to_vec()).is_finite() {
                let mut swept = q.to_vec();
                free_of_allocation("descend", || sweep(&mut swept));
            }
        }
        free_of_allocation("reach", || reach(&robot, Some(robot.limits()), &task, &target, 0.5, &mut moved, 1e-9, 60));
    }
}

/// Every method of the rate level, at the largest capacity so that virtual joints fit.
#[test]
fn rate_methods() {
    for robot in [crate::common::fanuc(), crate::common::iiwa()] {
        let n = robot.n();
        let robot = Arc::new(robot);
        let q = [0.3, 0.4, -0.5, 0.6, 0.9, 0.2, 0.4];
        let rows = rows_for(n);
        let settings = RateSettings {
            length: 0.5,
            gain: 1.0,
            relaxation: 0.5,
            damping: 1e-3,
            dt: 1e-3,
            limits: true,
            iterations: 5,
            stop: 0.0,
            correct: true,
            tolerance: 1e-12,
        };
        let pull = PosturePull::new(&robot, &[0.01; 7][..n], Some(&[0.01; 7][..n]), None, 5.0, 1.0).unwrap();
        let objective = |scaling| Secondary::Objective(Objective::new(vec![(1.0, indices(rows)[2].clone())]).unwrap(), scaling);
        for secondary in [Secondary::None, objective(Scaling::Gradient), objective(Scaling::Newton), Secondary::Pull(Box::new(pull))] {
            for method in Method::ALL {
                let task = Task::axisymmetric([0.1, 0.2, 1.0]).unwrap();
                let solver = RateSolver::new(robot.clone(), task, method, secondary.clone(), None, settings).unwrap();
                let (mut memory, mut rates) = (Memory::default(), [0.0; 7]);
                let twist = [0.1, -0.2, 0.05, 0.3, 0.1, -0.2];
                free_of_allocation("rate step", || solver.step(&q[..n], &twist, &mut memory, &mut rates[..n]));
                let target = target_at::<16>(&robot, &q[..n]);
                free_of_allocation("rate solve", || solver.solve_next(&target, &q[..n], &mut memory));
            }
        }
    }
}

/// Ticks of all methods within volumes, on the way to their bounds, at these and from outside.
#[test]
fn within_volumes() {
    let spin = Some((-0.1, 0.2));
    let volumes = [
        OrientationVolume::cone(0.03, None),
        OrientationVolume::pyramid(0.03, 0.02, spin),
        OrientationVolume::square(0.02, 0.03, spin),
        OrientationVolume::line_x(0.03, None),
        OrientationVolume::product(&[([1.0, 0.0, 0.0], -0.02, 0.03), ([0.0, 1.0, 0.0], -0.1, 0.1), ([0.0, 0.0, 1.0], -0.1, 0.1)]),
    ];
    for (robot, volume) in [fanuc(), iiwa()].iter().flat_map(|robot| volumes.iter().map(move |volume| (robot, volume.clone().unwrap()))) {
        let (n, robot) = (robot.n(), Arc::new(robot.clone()));
        let start = [0.3, 0.4, -0.5, 0.6, 0.9, 0.2, 0.4];
        let frame = forward::<MAX_JOINTS>(&robot, &start[..n]).axes;
        let objective = Objective::new(vec![(1.0, indices(rows_for(n))[2].clone())]).unwrap();
        let settings = QuadraticSettings {
            length: 0.5,
            dt: 0.01,
            rate_weights: [1.0; MAX_JOINTS],
            stiffness: 1e4,
            largest_deviation: (f64::INFINITY, f64::INFINITY),
            limits: true,
            tolerance: 1e-3,
        };
        let term = Some((objective.clone(), 1e3));
        let quadratic =
            QuadraticSolver::new(robot.clone(), Task::POSITION, term, IndexForm::Curvature, Derivatives::Exact, settings).unwrap();
        let quadratic = quadratic.within_volume(volume.clone()).unwrap();
        let settings = SqpSettings { dt: 0.01, ..SqpSettings::default() };
        let sqp = OrthogonalSqp::new(robot.clone(), Task::POSITION, objective.clone(), settings).unwrap();
        let sqp = sqp.within_volume(volume.clone()).unwrap();
        let rate = |method| {
            let secondary = Secondary::Objective(objective.clone(), Scaling::Gradient);
            let settings = RateSettings { dt: 0.01, gain: 10.0, ..RateSettings::default() };
            RateSolver::new(robot.clone(), Task::POSITION, method, secondary, None, settings)?.within_volume(volume.clone())
        };
        let rates = Method::ALL.into_iter().filter_map(|method| rate(method).ok()).collect::<Vec<_>>();
        assert!(rates.len() >= 4);
        let (mut quadratic_memory, mut memory) = (QuadraticMemory::default(), Memory::default());
        // Then the frame leaves the tool outside.
        let away = [frame, Frame { axes: frame, origin: [0.0; 3] }.compose(&Frame::rotation([1.0, 0.0, 0.0], 0.2)).axes];
        // Of the programme, the SQP, and any of the methods of the rate level.
        let mut reached = [f64::INFINITY; 3];
        for which in 0..2 + rates.len() {
            let mut q = start;
            for k in 0..200 {
                let end = away[k / 150];
                let (path, twist) = (PathFrame { start: Some(end), end }, [0.0, 0.0, 0.0, 0.05, 0.02, -0.02]);
                let (at, mut out) = (q, [0.0; 7]);
                free_of_allocation("tick within a volume", || match which {
                    0 => {
                        let tick = Tick { q: &at[..n], twist, stiffness: 1e4, rows: &[], twists: &[], frame: Some(path) };
                        quadratic.step(&tick, &mut quadratic_memory, &mut out[..n]);
                    }
                    1 => {
                        sqp.step_about(&at[..n], &twist, Some(&path), &mut out[..n]);
                    }
                    _ => {
                        rates[which - 2].step_about(&at[..n], &twist, &path, &mut memory, &mut out[..n]);
                    }
                });
                (0..n).for_each(|i| q[i] += 0.01 * out[i]);
                let tool = Quaternion::from_axes(&forward::<MAX_JOINTS>(&robot, &q[..n]).axes);
                let distance = volume.signed_distance(&Quaternion::from_axes(&end).conjugate().product(&tool));
                assert!(k >= 150 || distance < 1e-9, "{which} {k} {distance}");
                reached[which.min(2)] = reached[which.min(2)].min(distance.abs());
            }
        }
        assert!(reached.iter().all(|distance| *distance < 1e-8), "{reached:?}");
    }
}

/// Matrices, bounds by side, jerk, and what counts beside the task.
fn in_general(solver: &mut QuadraticSolver, task: Task, n: usize) {
    let identity = |n: usize| (0..n * n).map(|k| if k / n == k % n { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    solver.set_rate_matrix(&identity(n)).unwrap();
    solver.set_deviation_matrix(&identity(6)).unwrap();
    solver.set_deviation_bounds(&[-0.1; 6], &[0.2; 6]).unwrap();
    solver.set_jerk(&vec![10.0; n]).unwrap();
    let frame = Beside::Frame(FrameTask { link: n / 2, frame: Frame::IDENTITY, task, weight: 10.0 });
    let posture = Beside::Posture(PostureTask { posture: vec![0.1; n], weights: vec![1.0; n], gain: 2.0 });
    solver.set_beside(vec![posture, frame]).unwrap();
}

/// Ticks as programmes, among obstacles where the posture is one.
fn ticks(robot: &Robot, q: &[f64]) {
    let n = robot.n();
    let robot = Arc::new(robot.clone());
    let objective = Objective::new(vec![(1.0, indices(rows_for(n))[2].clone())]).unwrap();
    let bodies = capsules_along_links(&robot, 0.06).unwrap();
    let tool = forward::<MAX_JOINTS>(&robot, &vec![0.3; n]).origin;
    let ball = |name: &str, at| Obstacle::new(name, Shape::sphere(0.2).unwrap(), Frame::translation(at)).unwrap();
    let obstacles = vec![ball("one", tool), ball("two", [0.3, 0.0, 0.3])];
    let mut scene = Scene::new(robot.clone(), bodies, obstacles, vec![]).unwrap();
    scene.place(0, Frame::translation(tool), [0.0, 0.0, 0.0, 0.1, 0.0, 0.0]).unwrap();
    let settings = QuadraticSettings {
        length: 0.5,
        dt: 1e-3,
        rate_weights: [1.0; MAX_JOINTS],
        stiffness: 1e4,
        largest_deviation: (0.1, 0.1),
        limits: true,
        tolerance: 1e-3,
    };
    let ones = vec![1.0; n];
    let own = |lower| Row { a: &ones, lower, upper: f64::INFINITY };
    let mut near = Near::default();
    for task in tasks(n) {
        for form in [IndexForm::Curvature, IndexForm::Printed, IndexForm::Equality] {
            for derivatives in [Derivatives::Exact, Derivatives::Bfgs, Derivatives::Differences(1e-4)] {
                let mut solver =
                    QuadraticSolver::new(robot.clone(), task, Some((objective.clone(), 100.0)), form, derivatives, settings).unwrap();
                if form == IndexForm::Equality {
                    in_general(&mut solver, task, n);
                }
                let (mut memory, mut rates) = (QuadraticMemory::default(), vec![0.0; n]);
                // Rows that hold, and rows that exclude each other.
                for rows in [[own(-0.1), own(-0.2)], [own(1e3), Row { upper: -1e3, ..own(f64::NEG_INFINITY) }]] {
                    let tick = Tick {
                        q,
                        twist: [0.1, -0.2, 0.05, 0.3, 0.1, -0.2],
                        stiffness: 100.0,
                        rows: &rows,
                        twists: &[[0.1; 6]],
                        frame: None,
                    };
                    for _ in 0..2 {
                        free_of_allocation("tick", || solver.step(&tick, &mut memory, &mut rates));
                        if q.iter().all(|x| x.is_finite()) {
                            let damper = Damper::new(5.0, 0.05, 0.5).unwrap();
                            let mut guard = Guard { scene: &mut scene, damper, near: &mut near };
                            free_of_allocation("guarded tick", || guard.step(&solver, &tick, &mut memory, &mut rates).is_ok());
                            assert!(!near.pairs().is_empty() || q[0] > 1e100);
                        }
                    }
                }
            }
        }
    }
}

/// Allocations of many queries of distances with obstacles of some kinds, of the first round and of a second.
fn queries(kinds: &[usize]) -> [usize; 2] {
    let mut rng = Rng(7);
    let obstacles = (0..10).map(|k| Obstacle::new("", rng.shape(kinds[k % kinds.len()]), rng.pose(0.6)).unwrap()).collect();
    let mut bodies = seven_capsules();
    bodies[3].shape = rng.shape(2);
    bodies[5].shape = rng.shape(4);
    bodies[6].shape = rng.shape(0);
    let mut scene = Scene::new(Arc::new(iiwa()), bodies, obstacles, vec![[0, 3], [0, 5], [3, 5], [1, 6]]).unwrap();
    let postures: Vec<Vec<f64>> = (0..300).map(|_| rng.posture(7)).collect();
    let mut out = [Proximity::NONE; 20];
    let mut overlapping = 0;
    let rounds = [0, 1].map(|_| {
        let before = ALLOCATIONS.get();
        for (k, q) in postures.iter().enumerate() {
            scene.place(k % 10, Frame::translation([0.3, 0.1 * (k % 5) as f64, 0.5]), [0.1; 6]).unwrap();
            let found = scene.near(q, 0.5, &mut out).unwrap();
            overlapping += out[..found.written].iter().filter(|p| p.distance < 0.0).count();
        }
        ALLOCATIONS.get() - before
    });
    assert!(overlapping > 100);
    rounds
}

#[test]
fn distances() {
    assert_eq!(queries(&[0, 1, 2, 4]), [0, 0]);
    let [first, second] = queries(&[3]);
    println!("hulls: {first} allocations in the first 300 queries, {second} in the next");
    assert_eq!(second, 0);
}

fn everything(robot: &Robot) {
    let n = robot.n();
    let q: Vec<f64> = (0..n).map(|i| 0.4 + 0.3 * (1.7 * i as f64).sin()).collect();
    kernels(robot, &q);
    with_capacity!(n, resolution(robot, &q));
    ticks(robot, &q);
    // Singular postures and bad numbers take other paths.
    for bad in [vec![0.0; n], vec![f64::NAN; n], vec![1e300; n], vec![f64::INFINITY; n]] {
        kernels(robot, &bad);
        with_capacity!(n, resolution(robot, &bad));
        ticks(robot, &bad);
    }
}

#[test]
fn three_joints() {
    everything(&Rng(3).robot(3, false, 0));
}

#[test]
fn six_joints() {
    everything(&fanuc());
}

#[test]
fn seven_joints() {
    everything(&iiwa());
}

#[test]
fn nine_joints() {
    everything(&Rng(9).robot(9, true, 2));
}

#[test]
fn twelve_joints() {
    everything(&Rng(12).robot(12, true, 0));
}

#[test]
fn joints_that_follow_others() {
    everything(&Rng(13).coupled(8, 6));
    everything(&Rng(14).coupled(11, 7));
}

#[test]
fn inverse_kinematics() {
    let mut rng = Rng(21);
    let mut link = |alpha: f64, meeting: bool| {
        let (a, d) = if meeting { (0.0, 0.0) } else { (rng.within(0.1, 0.5), rng.within(0.1, 0.5)) };
        Frame::translation([a, 0.0, d]).compose(&Frame::rotation([1.0, 0.0, 0.0], alpha))
    };
    let wrist: [Frame; 6] = std::array::from_fn(|i| link(1.2 - 0.3 * i as f64, i > 3));
    let parallel: [Frame; 6] = std::array::from_fn(|i| link(if i == 2 || i == 3 { 0.0 } else { 1.2 }, false));
    let general: [Frame; 6] = std::array::from_fn(|i| link(1.2 - 0.3 * i as f64, false));
    for links in [wrist, parallel, general] {
        let robot = Robot::new("arm", &[Joint::Revolute; 6], &links, Frame::IDENTITY).unwrap();
        let solver = Inverse::new(Arc::new(robot.clone())).unwrap();
        let pose = forward::<6>(&robot, &[0.3, -0.4, 0.5, 0.6, 0.7, 0.8]);
        let found = free_of_allocation(&format!("{:?}", solver.structure()), || solver.solve(&pose));
        assert!(found.count > 0);
    }
}
