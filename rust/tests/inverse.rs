//! All inverse solutions: the posture that made the pose is among them, each takes the tool there, none comes twice.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use redundancy::internals::kinematics::forward;
use redundancy::inverse::{ArmAngle, Inverse, Structure};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::{norm, sub};
use redundancy::robot::{Joint, Robot};

use crate::common::Rng;

/// Between the frames of two joints: any turn about the first axis, then lengths and a twist.
fn dh(rng: &mut Rng, a: f64, d: f64, alpha: f64) -> Frame {
    let turn = Frame::rotation([0.0, 0.0, 1.0], rng.within(-PI, PI));
    turn.compose(&Frame::translation([a, 0.0, d])).compose(&Frame::rotation([1.0, 0.0, 0.0], alpha))
}

/// Any link.
fn link(rng: &mut Rng) -> Frame {
    let (a, d, alpha) = (rng.within(-1.0, 1.0), rng.within(-1.0, 1.0), rng.within(-PI, PI));
    dh(rng, a, d, alpha)
}

/// Between axes that meet, at height `d` on the first.
fn meeting(rng: &mut Rng, d: f64) -> Frame {
    let alpha = rng.within(0.3, 1.5);
    dh(rng, 0.0, d, alpha)
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y - TAU * ((x - y) / TAU).round()).abs()).fold(0.0, f64::max)
}

fn pose_error(a: &Frame, b: &Frame) -> f64 {
    (0..3).map(|k| norm(sub(a.axes[k], b.axes[k]))).fold(norm(sub(a.origin, b.origin)), f64::max)
}

/// The worst distance of the nearest solution to the posture that made the pose, over `count` random postures.
fn worst(robot: &Robot, count: usize, rng: &mut Rng) -> f64 {
    let solver = Inverse::new(Arc::new(robot.clone())).unwrap();
    let mut worst = 0.0f64;
    for _ in 0..count {
        let q: [f64; 6] = std::array::from_fn(|_| rng.within(-PI, PI));
        let pose = forward::<6>(robot, &q);
        let found = solver.solve(&pose);
        let solutions = &found.q[..found.count];
        for (i, solution) in solutions.iter().enumerate() {
            let error = pose_error(&forward::<6>(robot, solution), &pose);
            assert!(error < 1e-8, "{}: {solution:?} misses by {error}", robot.name());
            assert!(solutions[..i].iter().all(|other| apart(other, solution) > 1e-8), "{}: twice {solution:?}", robot.name());
        }
        let nearest = solutions.iter().map(|s| apart(s, &q)).fold(f64::INFINITY, f64::min);
        worst = worst.max(nearest);
    }
    worst
}

fn six(name: &str, links: [Frame; 6], end: Frame) -> Robot {
    Robot::new(name, &[Joint::Revolute; 6], &links, end).unwrap()
}

#[test]
fn wrists_anywhere_in_the_chain() {
    let mut rng = Rng(1);
    for first in 0..4 {
        for _ in 0..250 {
            let mut links: [Frame; 6] = std::array::from_fn(|_| link(&mut rng));
            let height = rng.within(-1.0, 1.0);
            // Axes first, first + 1 and first + 2 meet at the origin of the middle one.
            links[first + 1] = meeting(&mut rng, height);
            links[first + 2] = meeting(&mut rng, 0.0);
            let robot = six("wrist", links, link(&mut rng));
            let solver = Inverse::new(Arc::new(robot.clone())).unwrap();
            assert!(matches!(solver.structure(), Structure::Wrist { .. }), "{first}: {:?}", solver.structure());
            let worst = worst(&robot, 10, &mut rng);
            assert!(worst < 1e-6, "{worst}");
        }
    }
}

#[test]
fn industrial_arms_with_offsets() {
    let mut rng = Rng(2);
    for _ in 0..500 {
        let mut links: [Frame; 6] = std::array::from_fn(|_| link(&mut rng));
        let (a, b, c) = (rng.within(-1.0, 1.0), rng.within(-1.0, 1.0), rng.within(-1.0, 1.0));
        links[1] = dh(&mut rng, 0.3 * a, 0.5, FRAC_PI_2);
        links[2] = dh(&mut rng, 0.8 + 0.3 * b, 0.2 * c, 0.0);
        let height = rng.within(-1.0, 1.0);
        links[4] = meeting(&mut rng, height);
        links[5] = meeting(&mut rng, 0.0);
        let robot = six("industrial", links, link(&mut rng));
        assert!(Inverse::new(Arc::new(robot.clone())).unwrap().has_branches());
        let worst = worst(&robot, 20, &mut rng);
        assert!(worst < 1e-8, "{worst}");
    }
}

#[test]
fn three_parallel_axes() {
    let mut rng = Rng(3);
    for first in [1, 0, 2, 3] {
        for _ in 0..250 {
            let mut links: [Frame; 6] = std::array::from_fn(|_| link(&mut rng));
            let (a, b) = (0.3 + rng.within(0.0, 1.0), 0.3 + rng.within(0.0, 1.0));
            links[first + 1] = dh(&mut rng, a, 0.2, 0.0);
            links[first + 2] = dh(&mut rng, b, -0.1, 0.0);
            let robot = six("parallel", links, link(&mut rng));
            let solver = Inverse::new(Arc::new(robot.clone())).unwrap();
            assert!(matches!(solver.structure(), Structure::Parallel { .. }), "{first}: {:?}", solver.structure());
            let worst = worst(&robot, 10, &mut rng);
            assert!(worst < 1e-6, "{worst}");
        }
    }
}

#[test]
fn arms_with_a_shoulder_and_a_wrist() {
    let mut rng = Rng(4);
    for _ in 0..300 {
        let mut links = vec![link(&mut rng)];
        for (d, alpha) in [(0.3, -FRAC_PI_2), (0.0, FRAC_PI_2), (0.4, FRAC_PI_2), (0.0, -FRAC_PI_2), (0.4, -FRAC_PI_2), (0.0, FRAC_PI_2)] {
            links.push(dh(&mut rng, 0.0, d, alpha));
        }
        let robot = Robot::new("humanoid", &[Joint::Revolute; 7], &links, link(&mut rng)).unwrap();
        let arm = ArmAngle::new(&robot).unwrap();
        let q: [f64; 7] = std::array::from_fn(|_| rng.within(-PI, PI));
        let pose = forward::<8>(&robot, &q);
        let found = arm.solve(&pose, arm.of(&q));
        assert!(found.count >= 8, "{}", found.count);
        for solution in &found.q[..found.count] {
            assert!(pose_error(&forward::<8>(&robot, solution), &pose) < 1e-9);
        }
        let nearest = found.q[..found.count].iter().map(|s| apart(s, &q)).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-8, "{nearest}");
    }
}

#[test]
fn any_six_axes() {
    let mut rng = Rng(5);
    for _ in 0..60 {
        let robot = six("general", std::array::from_fn(|_| link(&mut rng)), link(&mut rng));
        assert_eq!(Inverse::new(Arc::new(robot.clone())).unwrap().structure(), Structure::General);
        let worst = worst(&robot, 50, &mut rng);
        assert!(worst < 1e-7, "{worst}");
    }
}

#[test]
fn singular_postures_are_told() {
    // Shoulder, elbow and wrist of an arm of the usual kind.
    let mut rng = Rng(6);
    let mut links: [Frame; 6] = std::array::from_fn(|_| Frame::IDENTITY);
    for (i, (a, d, alpha)) in
        [(0.15, 0.5, -FRAC_PI_2), (0.7, 0.0, 0.0), (0.1, 0.0, -FRAC_PI_2), (0.0, 0.6, FRAC_PI_2), (0.0, 0.0, -FRAC_PI_2)]
            .into_iter()
            .enumerate()
    {
        links[i + 1] = Frame::translation([a, 0.0, d]).compose(&Frame::rotation([1.0, 0.0, 0.0], alpha));
    }
    let robot = six("usual", links, Frame::translation([0.0, 0.0, 0.1]));
    let solver = Inverse::new(Arc::new(robot.clone())).unwrap();
    let straight = -(0.1f64).atan2(0.6) - FRAC_PI_2;
    for which in 0..3 {
        let mut q: [f64; 6] = std::array::from_fn(|_| rng.within(0.4, 1.2));
        match which {
            0 => q[4] = 0.0,
            1 => q[2] = -straight - PI,
            _ => {
                // The wrist above the base: the elbow bends until it is on axis 1.
                let wrist_x = |q1: f64| 0.15 + 0.7 * q1.cos() + 0.1 * (q1 + 0.3).cos() - 0.6 * (q1 + 0.3).sin();
                let (mut low, mut high) = (0.0, PI);
                for _ in 0..200 {
                    let middle = 0.5 * (low + high);
                    if wrist_x(middle) > 0.0 { low = middle } else { high = middle }
                }
                (q[1], q[2]) = (low, 0.3);
            }
        }
        let pose = forward::<6>(&robot, &q);
        let found = solver.solve(&pose);
        assert!(found.count > 0 && found.singular[..found.count].iter().any(|s| *s), "{which}: {found:?}");
        for solution in &found.q[..found.count] {
            assert!(pose_error(&forward::<6>(&robot, solution), &pose) < 1e-8, "{which}");
        }
    }
}

#[test]
fn out_of_reach_and_senseless_targets_have_no_solution() {
    let mut rng = Rng(7);
    let robots = [
        six("general", std::array::from_fn(|_| link(&mut rng)), link(&mut rng)),
        six("wrist", std::array::from_fn(|i| if i > 3 { meeting(&mut rng, 0.0) } else { link(&mut rng) }), link(&mut rng)),
        six(
            "parallel",
            std::array::from_fn(|i| if i == 2 || i == 3 { dh(&mut rng, 0.5, 0.1, 0.0) } else { link(&mut rng) }),
            link(&mut rng),
        ),
    ];
    for robot in robots {
        let solver = Inverse::new(Arc::new(robot.clone())).unwrap();
        for far in [100.0, 1e8, 1e300] {
            assert_eq!(solver.solve(&Frame::translation([far, 0.0, 0.0])).count, 0, "{} {far}", robot.name());
        }
    }
}
