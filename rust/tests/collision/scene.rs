//! Which pairs are found; what bad input gives; the law of damping.

use std::sync::Arc;

use super::shapes::seven_capsules;
use crate::common::{Rng, iiwa, rngs};
use proptest::prelude::*;
use redundancy::collision::{Body, Mount, Obstacle, Pair, Proximity, Scene, Shape, capsules_along_links, self_pairs, separation};
use redundancy::linalg::frame::Frame;
use redundancy::resolve::Damper;

fn cluttered(rng: &mut Rng, count: usize) -> Vec<Obstacle> {
    (0..count).map(|k| Obstacle::new(&k.to_string(), rng.shape(k % 5), rng.pose(0.8)).unwrap()).collect()
}

#[test]
fn the_nearest_are_kept() {
    let mut rng = Rng(2);
    let robot = Arc::new(iiwa());
    let bodies = capsules_along_links(&robot, 0.06).unwrap();
    assert_eq!(bodies.len(), 4);
    let obstacles = cluttered(&mut rng, 10);
    let mut scene = Scene::new(robot.clone(), bodies, obstacles, vec![[0, 3]]).unwrap();
    for _ in 0..50 {
        let q = rng.posture(7);
        let mut all = [Proximity::NONE; 64];
        let found = scene.near(&q, 0.6, &mut all).unwrap();
        assert_eq!(found.written, found.within);
        assert!(all[..found.written].is_sorted_by(|a, b| a.distance <= b.distance));
        let mut few = [Proximity::NONE; 5];
        let less = scene.near(&q, 0.6, &mut few).unwrap();
        assert_eq!((less.within, less.written), (found.within, found.within.min(5)));
        assert_eq!(few[..less.written], all[..less.written]);
        assert_eq!(scene.near(&q, 0.6, &mut []).unwrap().within, found.within);
        // Against a look at every pair.
        let frames = redundancy::kinematics::link_frames(&robot, &q).unwrap();
        let mut count = 0;
        for body in scene.bodies().iter().filter(|b| b.mount != Mount::Base) {
            let Mount::Link(k) = body.mount else { panic!() };
            for obstacle in scene.obstacles() {
                let s = separation(&body.shape, &frames[k].compose(&body.pose), &obstacle.shape, obstacle.pose());
                count += usize::from(s.distance <= 0.6);
            }
        }
        let own = all[..found.written].iter().filter(|p| matches!(p.pair, Pair::Bodies { .. })).count();
        assert_eq!(count, found.within - own);
    }
}

#[test]
fn pairs_of_bodies() {
    let robot = iiwa();
    let bodies = capsules_along_links(&robot, 0.06).unwrap();
    // Base, upper arm, forearm, hand: neighbours share an end.
    assert_eq!(self_pairs(&robot, &bodies, &[0.3; 7], 0.01).unwrap(), [[0, 2], [0, 3], [1, 3]]);
    assert!(self_pairs(&robot, &bodies, &[f64::NAN; 7], 0.01).is_err());
    assert!(Scene::new(Arc::new(robot), bodies, vec![], vec![[0, 9]]).is_err());
}

#[test]
fn bad_input_is_an_error() {
    let mut rng = Rng(4);
    let robot = Arc::new(iiwa());
    let mut scene = Scene::new(robot.clone(), seven_capsules(), cluttered(&mut rng, 3), vec![[0, 5]]).unwrap();
    let mut out = [Proximity::NONE; 8];
    assert!(scene.near(&[f64::NAN; 7], 1.0, &mut out).is_err());
    assert!(scene.near(&[f64::INFINITY; 7], 1.0, &mut out).is_err());
    assert!(scene.near(&[0.0; 6], 1.0, &mut out).is_err());
    assert!(scene.near(&[0.0; 7], f64::NAN, &mut out).is_err());
    assert_eq!(scene.near(&[0.0; 7], f64::INFINITY, &mut out).unwrap().within, 22);
    assert!(scene.place(3, Frame::IDENTITY, [0.0; 6]).is_err());
    assert!(scene.place(0, Frame::translation([f64::NAN; 3]), [0.0; 6]).is_err());
    assert!(scene.place(0, Frame::IDENTITY, [f64::INFINITY; 6]).is_err());
    let body = Body { name: "far".into(), mount: Mount::Link(7), pose: Frame::IDENTITY, shape: Shape::sphere(0.1).unwrap() };
    assert!(Scene::new(robot, vec![body], vec![], vec![]).is_err());
}

#[test]
fn damping_holds_the_security_distance() {
    // A tool above a ball that rises: the least motion within the law keeps d above d_s.
    let robot = Arc::new(iiwa());
    let ball = Obstacle::new("ball", Shape::sphere(0.1).unwrap(), Frame::translation([0.45, 0.1, 0.2])).unwrap();
    let mut scene = Scene::new(robot, seven_capsules(), vec![ball], vec![]).unwrap();
    let law = Damper::new(0.1, 0.03, 0.3).unwrap();
    let mut q = [0.0, 0.9, 0.0, -1.2, 0.0, 0.8, 0.0];
    let (mut least, mut active) = (f64::INFINITY, 0);
    for tick in 0..4000 {
        let dt = 1e-3;
        let speed = 0.1;
        let pose = Frame::translation([0.45, 0.1, 0.2 + speed * dt * f64::from(tick)]);
        scene.place(0, pose, [0.0, 0.0, 0.0, 0.0, 0.0, speed]).unwrap();
        let mut out = [Proximity::NONE; 1];
        if scene.near(&q, law.influence(), &mut out).unwrap().written == 0 {
            continue;
        }
        let near = out[0];
        least = least.min(near.distance);
        let (bound, square) = (law.bound(&near), near.row.iter().map(|x| x * x).sum::<f64>());
        if bound > 0.0 {
            active += 1;
            for i in 0..7 {
                q[i] += dt * bound / square * near.row[i];
            }
        }
    }
    assert!(active > 500 && least > 0.03 - 1e-4, "{active} {least}");
    assert!(Damper::new(0.1, 0.1, 1.0).is_err() && Damper::new(0.1, f64::NAN, 1.0).is_err() && Damper::new(0.1, 0.0, 0.0).is_err());
    let deep = Proximity { distance: -5.0, drift: -0.5, ..Proximity::NONE };
    assert!((law.bound(&deep) - 0.8).abs() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_posture_is_answered_with_numbers(seed in rngs()) {
        let mut rng = Rng(seed);
        let robot = Arc::new(rng.robot(6, true, 6));
        let bodies: Vec<Body> = (0..5).map(|k| rng.body(k, Mount::Link(k))).collect();
        let size = 10f64.powi(rng.below(300) as i32);
        let obstacles = cluttered(&mut rng, 6);
        let mut scene = Scene::new(robot, bodies, obstacles, vec![[0, 2], [0, 3], [1, 4]]).unwrap();
        let q: Vec<f64> = (0..6).map(|_| rng.within(-1.0, 1.0) * if rng.below(2) == 0 { size } else { 3.0 }).collect();
        let mut out = [Proximity::NONE; 12];
        let found = scene.near(&q, f64::INFINITY, &mut out).unwrap();
        for p in &out[..found.written] {
            prop_assert!(p.distance.is_finite() && p.row.iter().chain(&p.normal).all(|x| x.is_finite()), "{:?}", p);
        }
    }
}
