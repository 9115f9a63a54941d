//! Rates of distances against differences, robot and obstacles moving.

use std::sync::Arc;

use super::shapes::stepped;
use crate::common::Rng;
use redundancy::collision::{Mount, Obstacle, Pair, Proximity, Scene};

/// The worst error of `row' qd + drift` where the distance is smooth, and how many of all those were.
fn worst(ka: usize, kb: usize, own: bool, cases: usize) -> (f64, usize, usize) {
    let (mut worst, mut smooth, mut overlapping) = (0.0f64, 0, 0);
    let mut rng = Rng((100 * ka + 10 * kb + usize::from(own)) as u64);
    for _ in 0..cases {
        let robot = Arc::new(rng.robot(6, true, 6));
        let n = robot.n();
        let q = rng.posture(n);
        let k = rng.below(n);
        let mount = if rng.below(4) == 0 { Mount::Tool } else { Mount::Link(k) };
        let mut bodies = vec![rng.body(ka, mount)];
        let (mut obstacles, mut pairs) = (Vec::new(), Vec::new());
        let twist: [f64; 6] = std::array::from_fn(|_| rng.within(-1.0, 1.0));
        if own {
            let other = [Mount::Base, Mount::Link(rng.below(n)), Mount::Tool][rng.below(3)];
            bodies.push(rng.body(kb, other));
            pairs.push([0, 1]);
        } else {
            let near = collision_origin(&robot, &bodies[0], &q);
            let mut pose = rng.pose(0.4);
            pose.origin = std::array::from_fn(|i| pose.origin[i] + near[i]);
            let mut obstacle = Obstacle::new("it", rng.shape(kb), pose).unwrap();
            obstacle.place(pose, twist).unwrap();
            obstacles.push(obstacle);
        }
        let mut scene = Scene::new(robot, bodies, obstacles, pairs).unwrap();
        let mut out = [Proximity::NONE];
        assert_eq!(scene.near(&q, 10.0, &mut out).unwrap().written, 1);
        let found = out[0];
        let rates = rng.posture(n);
        let rate: f64 = (0..n).map(|i| found.row[i] * rates[i]).sum::<f64>() + found.drift;
        let start = (!own).then(|| *scene.obstacles()[0].pose());
        let mut at = |t: f64| {
            let moved: Vec<f64> = (0..n).map(|i| q[i] + t * rates[i]).collect();
            if let Some(start) = &start {
                scene.place(0, stepped(start, &twist, t), twist).unwrap();
            }
            scene.near(&moved, 10.0, &mut out).unwrap();
            out[0].distance
        };
        let h = 1e-5;
        let around = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| at(k * h));
        let slopes: Vec<f64> = around.windows(2).map(|pair| (pair[1] - pair[0]) / h).collect();
        // A corner of the distance: another pair of features takes over.
        if slopes.iter().any(|slope| (slope - slopes[0]).abs() > 2e-2) {
            continue;
        }
        let fine = (8.0 * (around[3] - around[1]) - (around[4] - around[0])) / (12.0 * h);
        smooth += 1;
        overlapping += usize::from(found.distance < 0.0);
        worst = worst.max((fine - rate).abs());
    }
    (worst, smooth, overlapping)
}

fn collision_origin(robot: &redundancy::robot::Robot, body: &redundancy::collision::Body, q: &[f64]) -> [f64; 3] {
    let frames = redundancy::kinematics::link_frames(robot, q).unwrap();
    let k = match body.mount {
        Mount::Base => return robot.base().origin,
        Mount::Link(k) => k,
        Mount::Tool => robot.n(),
    };
    frames[k].compose(&body.pose).origin
}

#[test]
fn rates_of_all_pairs_of_shapes() {
    let mut failed = false;
    for ka in 0..5 {
        for kb in 0..5 {
            for own in [false, true] {
                let cases = 150;
                let (worst, smooth, overlapping) = worst(ka, kb, own, cases);
                let exact = ka != 3 && kb != 3;
                println!("{ka} {kb} own {own}: worst {worst:.1e}, smooth {smooth} of {cases}, {overlapping} overlapping");
                failed |= worst > if exact { 1e-6 } else { 1e-5 } || smooth < cases * 8 / 10;
            }
        }
    }
    assert!(!failed);
}

#[test]
fn common_joints_change_nothing() {
    let mut rng = Rng(1);
    let robot = Arc::new(rng.robot(6, true, 6));
    let bodies = vec![rng.body(1, Mount::Link(2)), rng.body(2, Mount::Link(4))];
    let mut scene = Scene::new(robot, bodies, vec![], vec![[1, 0]]).unwrap();
    let mut out = [Proximity::NONE];
    scene.near(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], 10.0, &mut out).unwrap();
    assert_eq!(out[0].pair, Pair::Bodies { first: 1, second: 0 });
    assert!(out[0].row.iter().enumerate().all(|(i, x)| (*x != 0.0) == (i == 3 || i == 4)), "{:?}", out[0]);
}
