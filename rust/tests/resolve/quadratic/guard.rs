//! Ticks among obstacles that move.

use super::oracle::{C, Case, posture, settings, twist};
use crate::common::{OwnRow, Rng, iiwa, rngs, views};
use proptest::prelude::*;
use redundancy::collision::{Obstacle, Pair, Proximity, Scene, Shape, capsules_along_links, self_pairs};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::{Vec3, add, scale};
use redundancy::resolve::{Damper, Guard, MAX_NEAR, Near, Outcome, QuadraticMemory, QuadraticSettings, QuadraticStatus, Tick};
use redundancy::robot::{Limits, Robot};
use redundancy::task::Task;
use std::collections::BTreeMap;
use std::sync::Arc;

const INFLUENCE: f64 = 0.1;
const SECURITY: f64 = 0.03;
const GAIN: f64 = 0.5;

/// Seven joints with speeds enough to get out of the way.
fn quick() -> Robot {
    let robot = iiwa();
    let limits = robot.limits().clone();
    robot.with_limits(Limits { qd_max: vec![4.0; 7], ..limits }).unwrap()
}

/// A robot of capsules among spheres.
struct World {
    case: Case,
    scene: Scene,
    poses: Vec<Vec3>,
    speeds: Vec<Vec3>,
    q: Vec<f64>,
}

/// Every distance by its pair.
type Distances = BTreeMap<Pair, Proximity>;

impl World {
    fn new(rng: &mut Rng, count: usize, speed: f64) -> Self {
        let case = Case { robot: Arc::new(quick()), task: Task::POSITION };
        let bodies = capsules_along_links(&case.robot, 0.06).unwrap();
        let pairs = self_pairs(&case.robot, &bodies, &[0.3; 7], 0.15).unwrap();
        let q: Vec<f64> = posture(rng, &case.robot).iter().map(|x| 0.8 * x).collect();
        let poses: Vec<Vec3> = (0..count).map(|_| add([0.0, 0.0, 0.5], scale(rng.within(0.2, 0.9), rng.direction()))).collect();
        let speeds = (0..count).map(|_| scale(speed * rng.within(0.0, 1.0), rng.direction())).collect();
        let sphere = |rng: &mut Rng, at: &Vec3| {
            Obstacle::new("ball", Shape::sphere(rng.within(0.04, 0.12)).unwrap(), Frame::translation(*at)).unwrap()
        };
        let obstacles = poses.iter().map(|at| sphere(rng, at)).collect();
        let scene = Scene::new(case.robot.clone(), bodies, obstacles, pairs).unwrap();
        let mut out = Self { case, scene, poses, speeds, q };
        out.advance(0.0);
        out
    }

    /// Moves the spheres on.
    fn advance(&mut self, dt: f64) {
        for (k, (at, v)) in self.poses.iter_mut().zip(&self.speeds).enumerate() {
            *at = add(*at, scale(dt, *v));
            self.scene.place(k, Frame::translation(*at), [0.0, 0.0, 0.0, v[0], v[1], v[2]]).unwrap();
        }
    }

    fn distances(&mut self, q: &[f64]) -> Distances {
        let mut out = [Proximity::NONE; 64];
        let found = self.scene.near(q, f64::INFINITY, &mut out).unwrap();
        assert_eq!(found.written, found.within);
        out[..found.written].iter().map(|pair| (pair.pair, *pair)).collect()
    }

    fn ahead(&self, rates: &[f64], dt: f64) -> Vec<f64> {
        self.q.iter().zip(rates).map(|(q, rate)| q + dt * rate).collect()
    }

    fn step(
        &mut self,
        settings: QuadraticSettings,
        drive: [f64; 6],
        rows: &[OwnRow<C>],
        memory: &mut QuadraticMemory,
    ) -> (Vec<f64>, Outcome, usize) {
        let solver = self.case.plain(settings);
        let mut rates = vec![f64::NAN; 7];
        let tick = Tick { q: &self.q, twist: drive, stiffness: 1e4, rows: &views(rows, 7), twists: &[], frame: None };
        let (damper, mut near) = (Damper::new(INFLUENCE, SECURITY, GAIN).unwrap(), Near::default());
        let mut guard = Guard { scene: &mut self.scene, damper, near: &mut near };
        let outcome = guard.step(&solver, &tick, memory, &mut rates).unwrap();
        let count = near.pairs().len();
        assert!(rates.iter().all(|x| x.is_finite() && x.abs() <= 4.0));
        (rates, outcome, count)
    }
}

#[derive(Debug, Default)]
struct Tally {
    ticks: usize,
    near: usize,
    infeasible: usize,
    shortest: f64,
    fastest: f64,
}

fn run(seed: u64, dt: f64, tally: &mut Tally) -> Result<(), TestCaseError> {
    let rng = &mut Rng(seed);
    let mut world = World::new(rng, 4, 0.3);
    let settings = QuadraticSettings { dt, ..settings(rng, true) };
    let (drive, mut memory) = (twist(rng, 0.3), QuadraticMemory::default());
    for _ in 0..60 {
        let q = world.q.clone();
        let before = world.distances(&q);
        let (rates, outcome, count) = world.step(settings, drive, &[], &mut memory);
        tally.ticks += 1;
        tally.near += count;
        let feasible = outcome.status != QuadraticStatus::Infeasible;
        tally.infeasible += usize::from(!feasible);
        prop_assert_eq!(count, before.values().filter(|pair| pair.distance <= INFLUENCE).count().min(MAX_NEAR));
        // The speed of approach, by a small part of the tick.
        let h = 1e-6;
        let a_little = world.ahead(&rates, h);
        world.advance(h);
        let soon = world.distances(&a_little);
        world.advance(dt - h);
        world.q = world.ahead(&rates, dt);
        let q = world.q.clone();
        let after = world.distances(&q);
        for (pair, was) in before.iter().filter(|_| feasible) {
            let short = was.distance.min(SECURITY) - after[pair].distance;
            tally.shortest = tally.shortest.max(short);
            prop_assert!(short < 1e-6, "{:?} from {} to {}", pair, was.distance, after[pair].distance);
            if was.distance <= INFLUENCE {
                let law = -GAIN * ((was.distance - SECURITY) / (INFLUENCE - SECURITY)).max(-1.0);
                let over = law - (soon[pair].distance - was.distance) / h;
                tally.fastest = tally.fastest.max(over);
                prop_assert!(over < 1e-4, "{:?} at {} approaches by {} more than it may", pair, was.distance, over);
            }
        }
    }
    Ok(())
}

#[test]
fn distances_never_fall_below_security() {
    for dt in [1e-3, 5e-3, 2e-2] {
        let mut tally = Tally::default();
        let failures: Vec<_> = (0..60).filter_map(|seed| run(seed, dt, &mut tally).err().map(|error| (seed, error))).collect();
        println!("{dt}: {tally:?}");
        assert!(failures.is_empty(), "{dt}: {} fail: {:?}", failures.len(), &failures[..failures.len().min(5)]);
        assert!(tally.near > tally.ticks / 2 && tally.infeasible < tally.ticks / 5, "{tally:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// A sphere in a link from the start, at rest or moving: the robot does not go deeper.
    #[test]
    fn from_inside_a_link(seed in rngs(), moving in proptest::bool::ANY) {
        let rng = &mut Rng(seed);
        let mut world = World::new(rng, 1, if moving { 0.1 } else { 0.0 });
        // About a point of a moving body, off its axis or on it.
        let links = redundancy::kinematics::link_frames(&world.case.robot, &world.q).unwrap();
        let body = &world.scene.bodies()[1 + rng.below(3)];
        let redundancy::collision::Mount::Link(k) = body.mount else { panic!() };
        let half = body.shape.half_extents().unwrap()[2];
        let local = [rng.within(-0.05, 0.05), rng.within(-0.05, 0.05), half * rng.within(-1.0, 1.0)].map(|x| if rng.below(4) == 0 { 0.0 } else { x });
        let pose = links[k].compose(&body.pose);
        world.poses[0] = add(pose.origin, pose.rotate(local));
        world.advance(0.0);
        let settings = QuadraticSettings { dt: 1e-3, ..settings(rng, true) };
        let (drive, mut memory) = (twist(rng, 0.3), QuadraticMemory::default());
        for _ in 0..20 {
            let q = world.q.clone();
            let before = world.distances(&q);
            let (rates, outcome, _) = world.step(settings, drive, &[], &mut memory);
            world.advance(settings.dt);
            world.q = world.ahead(&rates, settings.dt);
            let q = world.q.clone();
            let after = world.distances(&q);
            for (pair, was) in before.iter().filter(|_| outcome.status != QuadraticStatus::Infeasible) {
                prop_assert!(after[pair].distance >= was.distance.min(SECURITY) - 1e-6, "{:?} from {} to {}", pair, was.distance, after[pair].distance);
            }
        }
    }

    /// Own rows come first, and keep their numbers among those that fail.
    #[test]
    fn rows_of_the_tick_stand_first(seed in rngs()) {
        let rng = &mut Rng(seed);
        let mut world = World::new(rng, 4, 0.0);
        let settings = QuadraticSettings { dt: 1e-3, ..settings(rng, true) };
        let stopped = OwnRow { a: std::array::from_fn(|i| f64::from(u8::from(i == 2))), lower: 0.0, upper: 0.0 };
        let never = OwnRow { a: std::array::from_fn(|i| f64::from(u8::from(i == 3))), lower: 100.0, upper: 200.0 };
        let drive = twist(rng, 0.3);
        let (rates, outcome, _) = world.step(settings, drive, &[stopped], &mut QuadraticMemory::default());
        prop_assert!(rates[2].abs() < 1e-9 || outcome.status == QuadraticStatus::Infeasible);
        let (_, outcome, count) = world.step(settings, drive, &[stopped, never], &mut QuadraticMemory::default());
        prop_assert_eq!(outcome.status, QuadraticStatus::Infeasible);
        prop_assert!(outcome.failed & 2 == 2 && outcome.failed >> (2 + count) == 0);
    }
}

#[test]
fn bad_postures_are_an_error() {
    let mut world = World::new(&mut Rng(1), 1, 0.0);
    let solver = world.case.plain(settings(&mut Rng(2), true));
    let (damper, mut near) = (Damper::new(INFLUENCE, SECURITY, GAIN).unwrap(), Near::default());
    let mut guard = Guard { scene: &mut world.scene, damper, near: &mut near };
    let (q, mut rates) = ([f64::NAN; 7], [0.0; 7]);
    let tick = Tick { q: &q, twist: [0.0; 6], stiffness: 1.0, rows: &[], twists: &[], frame: None };
    assert!(guard.step(&solver, &tick, &mut QuadraticMemory::default(), &mut rates).is_err());
}
