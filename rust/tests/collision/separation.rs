//! Signed distances proved right: points in both shapes are a bound from above, a plane between them one from below.

use super::shapes::support;
use crate::common::{Rng, rngs};
use proptest::prelude::*;
use redundancy::collision::{Shape, separation};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::{Vec3, add, dot, norm, scale, sub, unit};

/// The signed distance along a direction: the true one is its maximum over all.
fn gap(a: &Shape, at: &Frame, b: &Shape, bt: &Frame, n: Vec3) -> f64 {
    -support(b, bt, scale(-1.0, n)) - support(a, at, n)
}

/// How far `p` is outside, by directions at random and one given: not above zero for points of the shape.
fn outside(rng: &mut Rng, shape: &Shape, pose: &Frame, p: Vec3, n: Vec3) -> f64 {
    let mut worst = dot(p, n) - support(shape, pose, n);
    for _ in 0..50 {
        let n = rng.direction();
        worst = worst.max(dot(p, n) - support(shape, pose, n));
    }
    worst
}

#[track_caller]
fn check(rng: &mut Rng, a: &Shape, at: &Frame, b: &Shape, bt: &Frame, tolerance: f64) -> f64 {
    let s = separation(a, at, b, bt);
    let n = s.normal;
    assert!((norm(n) - 1.0).abs() < 1e-12, "{s:?}");
    let off = sub(sub(s.points[1], s.points[0]), scale(s.distance, n));
    assert!(norm(off) < tolerance, "points {s:?} {off:?}");
    let bound = gap(a, at, b, bt, n);
    assert!((bound - s.distance).abs() < tolerance, "distance {} but the plane says {bound}; {s:?} {a:?} {at:?} {b:?} {bt:?}", s.distance);
    assert!(outside(rng, a, at, s.points[0], n) < tolerance, "{s:?}");
    assert!(outside(rng, b, bt, s.points[1], scale(-1.0, n)) < tolerance, "{s:?}");
    if s.distance < 0.0 {
        // No direction is better: at random, then climbing from the best.
        let mut best = (n, bound);
        for k in 0..600 {
            let d = rng.direction();
            let n = if k < 200 { d } else { unit(add(best.0, scale(0.5f64.powi((k - 200) / 20), d))).unwrap() };
            let g = gap(a, at, b, bt, n);
            if g > best.1 {
                best = (n, g);
            }
        }
        assert!(best.1 <= s.distance + tolerance, "depth {} but {} along {:?}; {a:?} {at:?} {b:?} {bt:?}", s.distance, best.1, best.0);
    }
    s.distance
}

#[test]
fn signed_distances_of_all_pairs_of_shapes() {
    let mut worst_of = Vec::new();
    for ka in 0..5 {
        for kb in 0..5 {
            let mut rng = Rng((10 * ka + kb) as u64);
            let (mut apart, mut overlapping) = (0, 0);
            for _ in 0..300 {
                let (a, b) = (rng.shape(ka), rng.shape(kb));
                let (at, bt) = (rng.pose(0.4), rng.pose(0.4));
                let hull = ka == 3 || kb == 3;
                let boxes = (ka == 2 || ka == 4) && (kb == 2 || kb == 4);
                let d = check(&mut rng, &a, &at, &b, &bt, if hull || boxes { 1e-7 } else { 1e-12 });
                if d > 0.0 { apart += 1 } else { overlapping += 1 }
            }
            worst_of.push((ka, kb, apart, overlapping));
            assert!(apart > 10 && overlapping > 10, "{worst_of:?}");
        }
    }
}

#[test]
fn nearly_touching_and_aligned() {
    // Boxes and hulls of boxes face to face, edge to edge, at all small distances.
    let half = [0.1, 0.2, 0.3];
    let corners: Vec<Vec3> = (0..8).map(|k| std::array::from_fn(|i| if k >> i & 1 == 0 { -half[i] } else { half[i] })).collect();
    let shapes = [
        Shape::cuboid(half).unwrap(),
        Shape::hull(&corners).unwrap(),
        Shape::capsule(0.3, 0.1).unwrap(),
        Shape::sphere(0.1).unwrap(),
        Shape::cuboid(half).unwrap().grown(0.01).unwrap(),
    ];
    let mut rng = Rng(3);
    for a in &shapes {
        for b in &shapes {
            for angle in [0.0, 1e-9, 1e-5, 0.3, std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_2] {
                for gap in [0.0, 1e-16, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3, -1e-12, -1e-10, -1e-8, -1e-6, -1e-3, -0.05] {
                    for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                        let turned = Frame::rotation([0.0, 0.0, 1.0], angle);
                        let reach = support(a, &Frame::IDENTITY, axis) + support(b, &turned, scale(-1.0, axis));
                        let bt = Frame { origin: scale(reach + gap, axis), ..turned };
                        check(&mut rng, a, &Frame::IDENTITY, b, &bt, 2e-7);
                    }
                }
            }
        }
    }
}

#[test]
fn degenerate_normals() {
    let mut rng = Rng(5);
    for ka in 0..5 {
        for kb in 0..5 {
            let (a, b) = (rng.shape(ka), rng.shape(kb));
            for pose in [Frame::IDENTITY, rng.pose(1.0)] {
                let middle = Frame { origin: [0.0; 3], ..pose };
                check(&mut rng, &a, &pose, &b, &pose, 1e-7);
                check(&mut rng, &a, &pose, &b, &middle.compose(&Frame::translation(pose.origin)), f64::INFINITY);
            }
        }
    }
    // A ball's middle on a capsule's axis, its end, and two capsules whose axes cross.
    let (ball, capsule) = (Shape::sphere(0.1).unwrap(), Shape::capsule(0.5, 0.2).unwrap());
    for z in [0.0, 0.2, 0.5] {
        let s = separation(&ball, &Frame::translation([0.0, 0.0, z]), &capsule, &Frame::IDENTITY);
        assert!((s.distance + 0.3).abs() < 1e-15 && s.normal[2].abs() < 1e-12, "{s:?}");
    }
    let crossing = separation(&capsule, &Frame::IDENTITY, &capsule, &Frame::rotation([1.0, 0.0, 0.0], 1.0));
    assert!((crossing.distance + 0.4).abs() < 1e-15 && crossing.normal[0].abs() > 1.0 - 1e-12);
}

#[test]
fn far_smaller_and_larger_shapes() {
    let mut rng = Rng(8);
    for size in [1e-4, 1e-2, 1.0, 100.0, 1e4] {
        for ka in 0..5 {
            for kb in 0..5 {
                let scaled = |shape: Shape| match shape.half_extents() {
                    Some([0.0, 0.0, 0.0]) => Shape::sphere(size * shape.radius()).unwrap(),
                    Some([0.0, 0.0, h]) => Shape::capsule(size * h, size * shape.radius()).unwrap(),
                    Some(half) => Shape::cuboid(half.map(|x| size * x)).unwrap(),
                    None => Shape::hull(&shape.vertices().iter().map(|p| scale(size, *p)).collect::<Vec<_>>()).unwrap(),
                };
                let (a, b) = (scaled(rng.shape(ka)), scaled(rng.shape(kb)));
                for _ in 0..20 {
                    let (at, bt) = (rng.pose(0.4 * size), rng.pose(0.4 * size));
                    check(&mut rng, &a, &at, &b, &bt, 1e-7 * size);
                }
            }
        }
    }
}

#[test]
fn hulls_refuse_what_has_no_volume() {
    let grid: Vec<Vec3> = (0..100).map(|i| [(i % 10) as f64, (i / 10) as f64, 1.0]).collect();
    let line: Vec<Vec3> = (0..10).map(|i| [i as f64, 2.0 * i as f64, 0.5 * i as f64]).collect();
    for points in [
        vec![],
        vec![[0.0; 3]; 3],
        vec![[1.0; 3]; 50],
        grid,
        line,
        vec![[f64::NAN; 3]; 8],
        vec![[f64::MAX; 3], [f64::MIN; 3], [0.0; 3], [1.0; 3]],
    ] {
        assert!(Shape::hull(&points).is_err());
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Shape::sphere(bad).is_err() && Shape::capsule(bad, 1.0).is_err() && Shape::capsule(1.0, bad).is_err());
        assert!(Shape::cuboid([1.0, bad, 1.0]).is_err());
    }
    assert!(Shape::capsule_between([1.0; 3], [1.0; 3], 0.1).is_err());
}

/// The hull of random points reaches as far as they do; its distance to a ball.
fn hull_of_points(seed: u64) -> Result<(), TestCaseError> {
    let mut rng = Rng(seed);
    let count = rng.below(200);
    let (steps, size) = (rng.below(12) + 1, 10f64.powi(rng.below(13) as i32 - 6));
    let flat = rng.below(8);
    // Grids, repeated points, nearly coplanar ones.
    let points: Vec<Vec3> = (0..count)
        .map(|_| {
            let mut p = rng.vector(1.0);
            if steps < 8 {
                p = p.map(|x| (x * steps as f64).round() / steps as f64);
            }
            if flat == 0 {
                p[2] *= 1e-7
            }
            scale(size, p)
        })
        .collect();
    if let Ok(hull) = Shape::hull(&points) {
        for _ in 0..50 {
            let n = rng.direction();
            let most = points.iter().map(|p| dot(*p, n)).fold(f64::NEG_INFINITY, f64::max);
            let found = support(&hull, &Frame::IDENTITY, n);
            prop_assert!((most - found).abs() <= 1e-6 * size, "{} {} {}", most, found, size);
        }
        let ball = Shape::sphere(0.1 * size).unwrap();
        let at = rng.pose(0.5 * size);
        check(&mut rng, &hull, &Frame::IDENTITY, &ball, &at, 1e-6 * size);
    }
    Ok(())
}

fn shapes_at_any_poses(seed: u64) -> Result<(), TestCaseError> {
    let mut rng = Rng(seed);
    let (ka, kb) = (rng.below(5), rng.below(5));
    let (a, b) = (rng.shape(ka), rng.shape(kb));
    let far = |r: &mut Rng| 10f64.powi(r.below(40) as i32 - 20);
    let (x, y) = (far(&mut rng), far(&mut rng));
    let (at, bt) = (rng.pose(x), rng.pose(y));
    let s = separation(&a, &at, &b, &bt);
    prop_assert!((norm(s.normal) - 1.0).abs() < 1e-12 && s.distance.is_finite(), "{:?}", s);
    Ok(())
}

/// What failed once.
#[test]
fn seeds_of_old() {
    hull_of_points(6_800_916_424_214_341_349).unwrap();
    shapes_at_any_poses(6_800_916_424_214_341_349).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn hulls_of_any_points(seed in rngs()) {
        hull_of_points(seed)?;
    }

    #[test]
    fn any_poses_are_answered(seed in rngs()) {
        shapes_at_any_poses(seed)?;
    }
}
