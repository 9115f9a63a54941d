//! Rows are kept where they can be; where they exclude each other, the worst violation is as small as can be.

use super::oracle::{C, Case, cheapest, first_step, least_violation, posture, settings, twist};
use crate::common::{OwnRow, Rng, rngs, views};
use nalgebra::DVector;
use proptest::prelude::*;
use redundancy::resolve::{QuadraticSettings, QuadraticStatus, Tick};

fn value(row: &OwnRow<C>, rates: &[f64]) -> f64 {
    row.a.iter().zip(rates).map(|(a, x)| a * x).sum()
}

/// By how much a row fails.
fn violation(row: &OwnRow<C>, rates: &[f64]) -> f64 {
    (row.lower - value(row, rates)).max(value(row, rates) - row.upper).max(0.0)
}

fn normal(rng: &mut Rng, n: usize) -> [f64; C] {
    std::array::from_fn(|i| if i < n { rng.within(-1.0, 1.0) } else { 0.0 })
}

/// Rates within the bounds, and rows that they satisfy, some with equality.
fn feasible(rng: &mut Rng, bounds: &[(f64, f64)], count: usize) -> (Vec<f64>, Vec<OwnRow<C>>) {
    let inside: Vec<f64> = bounds.iter().map(|(low, high)| rng.within(low.max(-1.0), high.min(1.0))).collect();
    let mut rows = Vec::new();
    for _ in 0..count {
        let mut row = OwnRow { a: normal(rng, bounds.len()), lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let at = value(&row, &inside);
        match rng.below(4) {
            0 => row.lower = at,
            1 => row.upper = at + rng.within(0.0, 0.3),
            2 => row.lower = at - rng.within(0.0, 0.3),
            _ => (row.lower, row.upper) = (at - rng.within(0.0, 0.3), at + rng.within(0.0, 0.3)),
        }
        rows.push(row);
    }
    (inside, rows)
}

/// Bounds far from the limits of position: those of speed alone.
fn speeds(case: &Case, q: &[f64], dt: f64) -> Vec<(f64, f64)> {
    let limits = case.robot.limits();
    (0..q.len())
        .map(|i| {
            let (low, high) = ((limits.q_min[i] - q[i]) / dt, (limits.q_max[i] - q[i]) / dt);
            (low.max(-limits.qd_max[i]), high.min(limits.qd_max[i]))
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn feasible_rows_hold_and_nothing_is_cheaper(seed in rngs(), kind in 0usize..4, count in 1usize..12) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        // In so short a tick the tool's way does not bend.
        let (settings, q) = (QuadraticSettings { dt: 1e-9, ..settings(rng, true) }, posture(rng, &case.robot));
        let bounds = speeds(&case, &q, settings.dt);
        let (inside, rows) = feasible(rng, &bounds, count);
        let tick = Tick { q: &q, twist: twist(rng, 1.0), stiffness: 10f64.powf(rng.within(0.0, 4.0)), rows: &views(&rows, q.len()), twists: &[], frame: None };
        let (rates, outcome) = first_step(&case.plain(settings), &tick);
        prop_assert!(outcome.status != QuadraticStatus::Infeasible && outcome.failed == 0, "{:?}", outcome);
        for row in &rows {
            let size: f64 = row.a.iter().zip(&rates).map(|(a, x)| (a * x).abs()).sum();
            prop_assert!(violation(row, &rates) <= 1e-9 * size.max(1e-3), "{:e}", violation(row, &rates));
        }
        let (h, g) = case.quadratic(&settings, &tick);
        let cost = |x: &DVector<f64>| 0.5 * x.dot(&(&h * x)) + g.dot(x);
        let (mine, scale) = (cost(&DVector::from_column_slice(&rates)), g.norm() + h.norm());
        prop_assert!(mine <= cost(&DVector::from_vec(inside)) + 1e-9 * scale);
        let other = cheapest(&h, &g, &bounds, &rows).unwrap();
        prop_assert!(mine <= cost(&other) + 1e-7 * scale, "{} {}", mine, cost(&other));
    }

    #[test]
    fn contradictions_are_shared(seed in rngs(), kind in 0usize..4, count in 0usize..6) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        let (settings, q) = (settings(rng, true), posture(rng, &case.robot));
        let bounds: Vec<(f64, f64)> = speeds(&case, &q, settings.dt);
        let (_, mut rows) = feasible(rng, &bounds, count);
        let a = normal(rng, case.n());
        let gap = 10f64.powf(rng.within(-3.0, 0.5));
        if rng.below(2) == 0 {
            // Against each other.
            let middle = rng.within(-0.5, 0.5);
            rows.push(OwnRow { a, lower: middle + 0.5 * gap, upper: f64::INFINITY });
            rows.push(OwnRow { a, lower: f64::NEG_INFINITY, upper: middle - 0.5 * gap });
        } else {
            // Against the bounds of joints.
            let most: f64 = (0..case.n()).map(|i| (a[i] * bounds[i].0).max(a[i] * bounds[i].1)).sum();
            prop_assume!(most.is_finite());
            rows.push(OwnRow { a, lower: most + gap, upper: f64::INFINITY });
        }
        let tick = Tick { q: &q, twist: twist(rng, 1.0), stiffness: 100.0, rows: &views(&rows, q.len()), twists: &[], frame: None };
        let (rates, outcome) = first_step(&case.plain(settings), &tick);
        prop_assert_eq!(outcome.status, QuadraticStatus::Infeasible);
        for (x, (low, high)) in rates.iter().zip(&bounds) {
            prop_assert!(*low - 1e-12 <= *x && *x <= *high + 1e-12);
        }
        let worst = rows.iter().map(|row| violation(row, &rates)).fold(0.0, f64::max);
        let least = least_violation(case.n(), &bounds, &rows);
        prop_assert!(worst <= least * 1.001 + 1e-6, "{:e} {:e}", worst, least);
        prop_assert!(outcome.failed != 0);
        for (k, row) in rows.iter().enumerate() {
            let by = violation(row, &rates);
            if by > 1e-7 || by == 0.0 {
                prop_assert_eq!(outcome.failed >> k & 1 == 1, by > 0.0, "row {} by {:e}", k, by);
            }
        }
        prop_assert_eq!(outcome.failed >> rows.len(), 0);
    }

    /// A largest deviation is kept where the rows leave room for it, component by component.
    #[test]
    fn the_largest_deviation_holds_where_it_can(seed in rngs(), count in 0usize..5) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, 1);
        let q = posture(rng, &case.robot);
        let most = (10f64.powf(rng.within(-4.0, -1.0)), 10f64.powf(rng.within(-4.0, -1.0)));
        let settings = QuadraticSettings { largest_deviation: most, dt: 1e-3, ..settings(rng, true) };
        let bounds = speeds(&case, &q, settings.dt);
        let (inside, rows) = feasible(rng, &bounds, count);
        // A twist that rates within everything follow up to less than the largest deviation, at a stiffness that would leave more.
        let (all, _) = case.matrices(&q);
        let followed = all * DVector::from_column_slice(&inside);
        let part = |i: usize| if i < 3 { most.0 } else { most.1 };
        let twist = std::array::from_fn(|i| followed[i] + 0.9 * part(i) * rng.within(-1.0, 1.0));
        let tick = Tick { q: &q, twist, stiffness: 1e-2, rows: &views(&rows, q.len()), twists: &[], frame: None };
        let (rates, outcome) = first_step(&case.plain(settings), &tick);
        prop_assert!(outcome.failed == 0 && outcome.status != QuadraticStatus::Infeasible, "{:?}", outcome);
        let left = case.left(&q, &tick.twist, &rates);
        for i in 0..6 {
            prop_assert!(left[i].abs() <= part(i) + 1e-9, "component {}: {:e} of {:e}", i, left[i], part(i));
        }
        // Without it, more would be left.
        let (free, _) = first_step(&case.plain(QuadraticSettings { largest_deviation: (f64::INFINITY, f64::INFINITY), ..settings }), &tick);
        let before = case.left(&q, &tick.twist, &free);
        prop_assert!((0..6).any(|i| before[i].abs() > part(i)) || (DVector::from_vec(free) - DVector::from_vec(rates)).norm() < 1e-9);
    }

    /// Where rows leave no room for the deviation allowed, they hold and it gives way.
    #[test]
    fn the_deviation_gives_way_before_rows(seed in rngs(), kind in 0usize..4) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        let q = posture(rng, &case.robot);
        let settings = QuadraticSettings { largest_deviation: (1e-3, 1e-3), dt: 1e-3, ..settings(rng, true) };
        let twist = twist(rng, 0.3);
        // No motion along the first direction of the task that is asked for.
        let (all, projector) = case.matrices(&q);
        let wanted = &projector * DVector::from_column_slice(&twist);
        let r = (0..6).max_by(|a, b| wanted[*a].abs().total_cmp(&wanted[*b].abs())).unwrap();
        let task = projector * all;
        prop_assume!(wanted[r].abs() > 0.02);
        let rows = [OwnRow { a: std::array::from_fn(|i| if i < case.n() { task[(r, i)] } else { 0.0 }), lower: 0.0, upper: 0.0 }];
        let tick = Tick { q: &q, twist, stiffness: 1e4, rows: &views(&rows, q.len()), twists: &[], frame: None };
        let (rates, outcome) = first_step(&case.plain(settings), &tick);
        prop_assert_eq!(outcome.failed, 0);
        prop_assert!(matches!(outcome.status, QuadraticStatus::Relaxed | QuadraticStatus::Limited), "{:?}", outcome);
        prop_assert!(value(&rows[0], &rates).abs() < 1e-9);
        prop_assert!((outcome.deviation[r] - wanted[r]).abs() < 1e-8);
        // What is left is little more than the least that the row and the limits allow.
        let (h, g) = case.quadratic(&settings, &Tick { stiffness: 1e9, ..tick });
        let least = cheapest(&h, &g, &speeds(&case, &q, settings.dt), &rows).unwrap();
        let size = |rates: &[f64]| {
            let left = case.left(&q, &tick.twist, rates);
            (0..6).map(|i| if i < 3 { settings.length * left[i] } else { left[i] }).map(|x| x * x).sum::<f64>().sqrt()
        };
        prop_assert!(size(&rates) <= (1.0 + 1e-2) * size(least.as_slice()) + 1e-4, "{} {}", size(&rates), size(least.as_slice()));
    }
}
