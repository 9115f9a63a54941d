//! The quadratic programme by its optimality conditions, by Farkas certificates and beside Clarabel.

mod programme;

use crate::common::{OwnRow, Rng, rngs};
use clarabel::solver::SolverStatus;
use nalgebra::DVector;
use programme::{N, Programme, Recipe, apart, garbage, recipe, row, simple, sum};
use proptest::prelude::*;
use redundancy::qp::{self, Constraint, MAX_VARIABLES, Place, Side, Status, most_changes};

#[derive(Default, Debug)]
struct Tally {
    failures: usize,
    changes: usize,
    warm_changes: usize,
    ratio: f64,
    residual: f64,
    clarabel: f64,
    compared: usize,
    warm: f64,
    infeasible: usize,
    confirmed: usize,
}

/// One random programme against everything.
fn trial(seed: u64, tally: &mut Tally, beside_clarabel: bool) -> Result<(), String> {
    let rng = &mut Rng(seed);
    let recipe = recipe(rng);
    let (mut programme, inside) = Programme::feasible(rng, &recipe);
    let (n, m) = (recipe.n, recipe.rows);
    let wrong = rng.below(5) == 0;
    if wrong {
        // A combination of constraints that contradicts them.
        let (mut a, mut bound, mut whole) = ([0.0; N], 0.0, 0.0);
        for _ in 0..1 + rng.below(4) {
            let places = programme.places();
            let (normal, lower, upper) = programme.dense(places[rng.below(places.len())]);
            let reach = programme.reach(&inside);
            let size = sum((0..n).map(|i| (normal[i] * reach[i]).abs()));
            let factor = if size > 0.0 { rng.within(0.1, 1.0) / size } else { 0.0 };
            let (sign, limit) = if lower.is_finite() { (1.0, lower) } else { (-1.0, upper) };
            if limit.is_finite() && size > 0.0 {
                for i in 0..n {
                    a[i] += sign * factor * normal[i];
                }
                bound += sign * factor * limit;
                whole += factor * limit.abs() + factor * size;
            }
        }
        let gap = 10f64.powf(rng.within(-9.0, 0.0)) * if whole > 0.0 { whole } else { 1.0 };
        programme.rows.push(OwnRow { a, lower: f64::NEG_INFINITY, upper: bound - gap });
    }
    let solution = programme.solve();
    tally.changes = tally.changes.max(solution.changes);
    tally.ratio = tally.ratio.max(solution.changes as f64 / (n + m) as f64);
    let guess = garbage(rng, &programme);
    let warm = programme.solve_from(&guess);
    tally.warm_changes = tally.warm_changes.max(warm.changes);
    if warm.status != solution.status {
        return Err(format!("cold {:?} after {}, warm {:?} after {}", solution.status, solution.changes, warm.status, warm.changes));
    }
    if wrong {
        tally.infeasible += 1;
        if solution.status != Status::Infeasible {
            return Err(format!("{:?} after {} changes though infeasible", solution.status, solution.changes));
        }
        programme.proves_infeasible(&solution, &programme.reach(&inside)).map_err(|e| format!("cold certificate: {e}"))?;
        programme.proves_infeasible(&warm, &programme.reach(&inside)).map_err(|e| format!("warm certificate: {e}"))?;
        if beside_clarabel && matches!(programme.clarabel().0, SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible) {
            tally.confirmed += 1;
        }
        return Ok(());
    }
    if solution.status != Status::Solved {
        return Err(format!("{:?} after {} changes though feasible", solution.status, solution.changes));
    }
    for solution in [&solution, &warm] {
        let residual = programme.residual(solution)?;
        tally.residual = tally.residual.max(residual);
        if residual > 1e-11 {
            return Err(format!("residual {residual:e}"));
        }
    }
    let distance = apart(&programme, &solution.x, &warm.x);
    tally.warm = tally.warm.max(distance);
    if distance > 1e-8 {
        return Err(format!("warm and cold differ by {distance:e}"));
    }
    let scale = sum((0..n).map(|i| (programme.g[i] * programme.reach(&inside)[i]).abs()));
    if programme.value(&solution.x) > programme.value(&inside) + 1e-9 * scale {
        return Err("worse than a feasible point".into());
    }
    if beside_clarabel {
        let (status, x) = programme.clarabel();
        if status == SolverStatus::Solved {
            let distance = apart(&programme, &solution.x, &x);
            tally.clarabel = tally.clarabel.max(distance);
            tally.compared += 1;
            let (mine, other) = (programme.value(&solution.x), programme.value(&x));
            if distance > 1e-6 || mine > other + 1e-9 * other.abs().max(scale) {
                return Err(format!("Clarabel differs by {distance:e}, value {mine:e} against {other:e}"));
            }
        }
    }
    Ok(())
}

fn trials(first: u64, count: u64, every: u64) -> Tally {
    let mut tally = Tally::default();
    for seed in first..first + count {
        if let Err(message) = trial(seed.wrapping_mul(0x5851_f42d_4c95_7f2d), &mut tally, seed % every == 0) {
            tally.failures += 1;
            if tally.failures <= 20 {
                let recipe = recipe(&mut Rng(seed.wrapping_mul(0x5851_f42d_4c95_7f2d)));
                println!("seed {seed}: {message}\n    {recipe:?}");
            }
        }
    }
    println!("{tally:?}");
    tally
}

#[test]
fn random_programmes() {
    assert_eq!(trials(0, 3000, 3).failures, 0);
}

/// Some other `COUNT` programmes from the one of number `FIRST` on, every `EVERY`th beside Clarabel.
#[test]
#[ignore = "long"]
fn soak() {
    let read = |name: &str, default: u64| std::env::var(name).ok().and_then(|s| s.parse().ok()).unwrap_or(default);
    assert_eq!(trials(read("FIRST", 1 << 20), read("COUNT", 100_000), read("EVERY", 10)).failures, 0);
}

#[test]
fn none_and_one_variable() {
    let mut none = simple(0);
    assert_eq!(none.solve().status, Status::Solved);
    none.rows = vec![row(&[], -1.0, 0.0)];
    assert_eq!(none.solve().status, Status::Solved);
    none.rows = vec![row(&[], 1.0, 2.0)];
    let solution = none.solve();
    assert_eq!(solution.status, Status::Infeasible);
    none.proves_infeasible(&solution, &[0.0; N]).unwrap();

    let mut one = simple(1);
    one.g[0] = -3.0;
    assert_eq!(one.solve().x[0], 3.0);
    one.upper[0] = 2.0;
    let solution = one.solve();
    assert_eq!((solution.x[0], solution.multiplier(Place::Bound(0)), solution.changes), (2.0, -1.0, 1));
    one.lower[0] = 2.5;
    let solution = one.solve();
    assert_eq!(solution.status, Status::Infeasible);
    assert_eq!(solution.violated, Some((Constraint { place: Place::Bound(0), side: Side::Upper }, -1.0)));
    one.proves_infeasible(&solution, &[10.0; N]).unwrap();
    one.lower[0] = 2.0;
    let solution = one.solve();
    assert_eq!((solution.status, solution.x[0], solution.multiplier(Place::Bound(0)), solution.changes), (Status::Solved, 2.0, -1.0, 0));
}

#[test]
fn arrays_that_do_not_fit() {
    let good = qp::Programme { h: &[1.0, 0.0, 0.0, 1.0], g: &[0.0; 2], lower: &[0.0; 2], upper: &[1.0; 2], rows: &[] };
    assert!(qp::solve(&good, &[]).is_ok());
    let short = [qp::Row { a: &[1.0], lower: 0.0, upper: 1.0 }];
    for bad in [
        qp::Programme { h: &[1.0; 3], ..good },
        qp::Programme { g: &[0.0; 3], ..good },
        qp::Programme { lower: &[], ..good },
        qp::Programme { upper: &[1.0; 5], ..good },
        qp::Programme { rows: &short, ..good },
    ] {
        assert!(qp::solve(&bad, &[]).is_err());
    }
    let many = [0.0; (MAX_VARIABLES + 1) * (MAX_VARIABLES + 1)];
    let row = &many[..=MAX_VARIABLES];
    assert!(qp::solve(&qp::Programme { h: &many, g: row, lower: row, upper: row, rows: &[] }, &[]).is_err());
}

#[test]
fn not_convex() {
    for bad in [0.0, -1.0, 0.25, 0.2] {
        let mut programme = simple(3);
        (programme.h[1][1], programme.h[1][0], programme.h[0][1]) = (bad, 0.5, 0.5);
        assert_eq!(programme.solve().status, Status::NotConvex, "{bad}");
    }
    // A projector, singular up to rounding.
    for seed in 0..1000 {
        let rng = &mut Rng(seed);
        let n = 2 + rng.below(N - 1);
        let mut programme = simple(n);
        let v = DVector::from_fn(n, |_, _| rng.within(0.2, 1.0)).normalize();
        for i in 0..n {
            for j in 0..n {
                programme.h[i][j] -= v[i] * v[j];
            }
        }
        assert_eq!(programme.solve().status, Status::NotConvex, "seed {seed}");
    }
}

#[test]
fn undefined_numbers() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
        let base = {
            let mut base = simple(3);
            base.g = [1.0; N];
            base.rows = vec![row(&[(0, 1.0), (1, 1.0)], 0.0, 1.0)];
            base
        };
        let spoil: [fn(&mut Programme, f64); 4] = [
            |p, x| (p.h[1][0], p.h[0][1]) = (x, x),
            |p, x| p.h[2][2] = if x > 0.0 { x } else { f64::NAN },
            |p, x| p.g[1] = x,
            |p, x| p.rows[0].a[2] = x,
        ];
        for (k, spoil) in spoil.iter().enumerate() {
            let mut programme = base.clone();
            spoil(&mut programme, bad);
            let status = programme.solve().status;
            assert!(bad == f64::MAX || status == Status::Undefined, "{bad} at {k}: {status:?}");
        }
    }
    let mut limits = simple(2);
    for (low, high) in [(f64::NAN, 1.0), (0.0, f64::NAN), (f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY)] {
        (limits.lower[0], limits.upper[0]) = (low, high);
        assert_eq!(limits.solve().status, Status::Undefined, "{low} {high}");
    }
}

#[test]
fn any_pattern_of_bits() {
    for seed in 0..200_000 {
        let rng = &mut Rng(seed);
        let n = rng.below(8);
        let mut programme = simple(n);
        let tame = rng.below(2) == 0;
        for i in 0..n {
            for j in 0..n {
                if !tame {
                    programme.h[i][j] = rng.wild();
                }
            }
            programme.g[i] = rng.wild();
            if rng.below(2) == 0 {
                (programme.lower[i], programme.upper[i]) = (rng.wild(), rng.wild());
            }
        }
        for _ in 0..rng.below(10) {
            programme.rows.push(OwnRow { a: std::array::from_fn(|_| rng.wild()), lower: rng.wild(), upper: rng.wild() });
        }
        let solution = programme.solve_from(&garbage(rng, &programme));
        assert!(solution.changes <= 1 + most_changes(n, programme.rows.len()));
        let finite = solution.x[..n].iter().all(|x| x.is_finite());
        assert!(solution.status != Status::Solved || finite, "seed {seed}: {solution:?}");
    }
}

#[test]
fn equalities_only() {
    for seed in 0..2000 {
        let rng = &mut Rng(seed);
        let n = 2 + rng.below(N - 1);
        let recipe =
            Recipe { n, rows: 1 + rng.below(n - 1), curvature: 2.0, units: 0.0, equal: 1.0, tight: 0.0, repeated: 0.0, bounded: 0.0 };
        let (mut programme, _) = Programme::feasible(rng, &recipe);
        let solution = programme.solve();
        assert_eq!((solution.status, solution.changes), (Status::Solved, 0), "seed {seed}");
        assert!(programme.residual(&solution).unwrap() < 1e-12);
        // Redundant ones, consistent or not.
        let (one, two) = (programme.rows[0], programme.rows[programme.rows.len() - 1]);
        let (p, q) = (rng.within(-2.0, 2.0), rng.within(-2.0, 2.0));
        let mut both = OwnRow { a: one.a, lower: p * one.lower + q * two.lower, upper: 0.0 };
        both.upper = both.lower;
        for i in 0..n {
            both.a[i] = p * one.a[i] + q * two.a[i];
        }
        programme.rows.insert(rng.below(programme.rows.len()), both);
        let again = programme.solve();
        assert_eq!(again.status, Status::Solved, "seed {seed}");
        assert!(apart(&programme, &solution.x, &again.x) < 1e-9);
        let k = rng.below(programme.rows.len());
        let involved =
            programme.rows[k].a[..n] == one.a[..n] || programme.rows[k].a[..n] == two.a[..n] || programme.rows[k].a[..n] == both.a[..n];
        if involved && p.abs() > 0.1 && q.abs() > 0.1 && p + q > 0.1 {
            programme.rows[k].lower += 1e-6;
            programme.rows[k].upper += 1e-6;
            let solution = programme.solve();
            assert_eq!(solution.status, Status::Infeasible, "seed {seed}");
            programme.proves_infeasible(&solution, &programme.reach(&again.x)).unwrap();
        }
    }
}

#[test]
fn cones_of_rows() {
    // Forty rows through one vertex, the free minimiser far outside.
    for n in [2, 3, 5, 16, 20] {
        let mut programme = simple(n);
        programme.g[0] = 10.0;
        let rng = &mut Rng(7);
        for _ in 0..40 {
            let mut a = programme.normal(rng);
            a[0] = 1.5 * sum(a[..n].iter().map(|x| x * x)).sqrt();
            programme.rows.push(OwnRow { a, lower: 0.0, upper: f64::INFINITY });
        }
        let solution = programme.solve();
        assert_eq!(solution.status, Status::Solved, "{n} variables, {} changes", solution.changes);
        assert!(programme.residual(&solution).unwrap() < 1e-12);
    }
}

#[test]
fn rows_of_zeros() {
    let mut programme = simple(4);
    programme.g = [1.0; N];
    let free = programme.solve();
    for (lower, status) in [(0.0, Status::Solved), (-1.0, Status::Solved), (1.0, Status::Infeasible), (1e-6, Status::Infeasible)] {
        programme.rows = vec![row(&[], lower, f64::INFINITY); 3];
        let solution = programme.solve();
        assert_eq!(solution.status, status, "0 >= {lower}");
        assert!(status == Status::Infeasible || solution.x == free.x);
    }
    programme.rows = vec![row(&[], 0.0, 0.0), row(&[], 0.0, f64::INFINITY), row(&[(0, 1.0)], 5.0, f64::INFINITY)];
    let solution = programme.solve();
    assert_eq!((solution.status, solution.active.len(), solution.x[0]), (Status::Solved, 1, 5.0));
}

#[test]
fn warm_start_at_the_answer_changes_nothing() {
    let mut changes = 0;
    for seed in 0..2000 {
        let rng = &mut Rng(seed);
        let recipe = Recipe { n: 7, rows: 6, curvature: 3.0, units: 0.0, equal: 0.1, tight: 0.0, repeated: 0.0, bounded: 1.0 };
        let (programme, _) = Programme::feasible(rng, &recipe);
        let cold = programme.solve();
        let warm = programme.solve_from(&cold.active);
        assert_eq!((cold.status, warm.status), (Status::Solved, Status::Solved));
        assert!(apart(&programme, &cold.x, &warm.x) < 1e-11, "seed {seed}");
        changes += warm.changes;
    }
    assert_eq!(changes, 0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Limits that leave a sliver, or miss by as little.
    #[test]
    fn slivers(seed in rngs(), n in 2usize..=N, gap in -9.0..-3.0f64) {
        let rng = &mut Rng(seed);
        let recipe = Recipe { n, rows: 10, curvature: 2.0, units: 0.0, equal: 0.0, tight: 0.3, repeated: 0.2, bounded: 0.5 };
        let (mut programme, inside) = Programme::feasible(rng, &recipe);
        let a = programme.normal(rng);
        let value = sum((0..n).map(|i| a[i] * inside[i]));
        let gap = 10f64.powf(gap);
        prop_assume!(a[..n].iter().any(|x| x.abs() > 0.1));
        programme.rows.push(OwnRow { a, lower: f64::NEG_INFINITY, upper: value });
        let mut back = a.map(|x| -1.7 * x);
        back[n..].fill(f64::NAN);
        programme.rows.push(OwnRow { a: back, lower: f64::NEG_INFINITY, upper: -1.7 * (value - gap) });
        let solution = programme.solve();
        // Cutting off half-spaces about one point may leave nothing: only the certificate or the conditions decide.
        match solution.status {
            Status::Solved => prop_assert!(programme.residual(&solution).unwrap() < 1e-11),
            Status::Infeasible => programme.proves_infeasible(&solution, &programme.reach(&inside)).map_err(TestCaseError::fail)?,
            other => prop_assert!(false, "{other:?}"),
        }
        let last = programme.rows.len() - 1;
        programme.rows[last].upper = -1.7 * (value + gap);
        let solution = programme.solve();
        prop_assert_eq!(solution.status, Status::Infeasible);
        programme.proves_infeasible(&solution, &programme.reach(&inside)).map_err(TestCaseError::fail)?;
    }
}
