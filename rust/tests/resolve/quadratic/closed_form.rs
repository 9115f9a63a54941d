//! Ticks without bounds and rows are solutions of linear equations.

use super::oracle::{Case, apart, expansion, first_step, minimiser, posture, settings, twist};
use crate::common::{Rng, iiwa, rngs};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use redundancy::index::{Index, JointLimits, Kind, Objective, Rows};
use redundancy::resolve::{Derivatives, IndexForm, QuadraticSettings, QuadraticSolver, QuadraticStatus, Tick};
use redundancy::task::Task;
use std::sync::Arc;

fn objective(rng: &mut Rng, n: usize) -> Objective {
    let rows = Rows::new(if n < 6 { &[3, 4] } else { &[0, 1, 2, 3, 4, 5] }, 0.5).unwrap();
    let index = match rng.below(3) {
        0 => return Objective::new(vec![(-1.0, Index::of(Kind::Manipulability, rows, false))]).unwrap(),
        1 => Index::JointLimits(JointLimits::new(&[]).unwrap()),
        _ => Index::of(Kind::ConditionNumber, rows, false),
    };
    Objective::new(vec![(1.0, index)]).unwrap()
}

/// The part of a symmetric matrix with eigenvalues above zero.
fn positive_part(h: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = h.clone().symmetric_eigen();
    &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| x.max(0.0))) * eigen.eigenvectors.transpose()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rates_of_a_task_alone(seed in rngs(), kind in 0usize..4, stiffness in -2.0..5.0f64) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        // In so short a tick the tool's way does not bend, however long the rates: the programme as it is printed.
        let (settings, q) = (QuadraticSettings { dt: 1e-9, ..settings(rng, false) }, posture(rng, &case.robot));
        let tick = Tick { q: &q, twist: twist(rng, 1.0), stiffness: 10f64.powf(stiffness), rows: &[], twists: &[], frame: None };
        let (rates, outcome) = first_step(&case.plain(settings), &tick);
        let (h, g) = case.quadratic(&settings, &tick);
        prop_assert!(apart(&rates, &minimiser(&h, &g)) < 1e-9 * 10f64.powf(stiffness).max(1.0));
        let residual = &h * DVector::from_column_slice(&rates) + &g;
        prop_assert!(residual.norm() <= 1e-11 * g.norm());
        // The deviation is what is left of the twist, and the status says whether that counts.
        let left = case.left(&q, &tick.twist, &rates);
        prop_assert!((&left - DVector::from_column_slice(&outcome.deviation)).amax() < 1e-12);
        let weighted = |x: &DVector<f64>| (settings.length.powi(2) * x.rows(0, 3).norm_squared() + x.rows(3, 3).norm_squared()).sqrt();
        let part = weighted(&left) / weighted(&case.left(&q, &tick.twist, &vec![0.0; q.len()]));
        let expected = if part <= settings.tolerance { QuadraticStatus::Solved } else { QuadraticStatus::Relaxed };
        prop_assert!(outcome.status == expected || (part / settings.tolerance - 1.0).abs() < 1e-9, "{:?} {}", outcome, part);
        prop_assert!(outcome.conditioned && outcome.failed == 0 && outcome.changes == 0);
    }

    /// Eq. 10 and 14: a Hessian and a gradient, or a matrix of rank one.
    #[test]
    fn rates_with_an_index(seed in rngs(), kind in 0usize..4, weight in -2.0..7.5f64) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        // In so short a tick the tool's way bends by nothing that counts.
        let (settings, q) = (QuadraticSettings { dt: 3e-4, ..settings(rng, false) }, posture(rng, &case.robot));
        let (objective, weight, dt) = (objective(rng, case.n()), 10f64.powf(weight), settings.dt);
        let tick = Tick { q: &q, twist: twist(rng, 1.0), stiffness: 100.0, rows: &[], twists: &[], frame: None };
        let (value, gradient, hessian) = expansion(&objective, &case.robot, &q);
        prop_assume!(value.abs() < 1e3 && hessian.amax() < 1e4);
        let (h, g) = case.quadratic(&settings, &tick);
        let q_weights = DMatrix::from_diagonal(&DVector::from_fn(case.n(), |i, _| settings.rate_weights[i]));

        let form = |form| first_step(&case.solver(Some((&objective, weight)), form, Derivatives::Exact, settings), &tick);
        let check = |rates: &[f64], h: &DMatrix<f64>, g: &DVector<f64>| {
            let residual = h * DVector::from_column_slice(rates) + g;
            residual.norm() / (g.norm() + h.norm() * DVector::from_column_slice(rates).norm())
        };
        let (rates, outcome) = form(IndexForm::Equality);
        prop_assert!(outcome.conditioned && matches!(outcome.status, QuadraticStatus::Solved | QuadraticStatus::Relaxed));
        let rank_one = weight * dt * dt * &gradient * gradient.transpose();
        prop_assert!(check(&rates, &(&h + rank_one), &(&g + weight * dt * value.abs() * &gradient)) < 1e-12);

        let curvature = weight * dt * dt * &hessian;
        let linear = &g + weight * dt * &gradient;
        // Left as it is as long as half the cost of the rates outweighs it.
        let least = (0.5 * &q_weights + &curvature).symmetric_eigenvalues().min();
        prop_assume!(least.abs() > 1e-9 * curvature.amax());
        let kept = if least > 0.0 { curvature.clone() } else { positive_part(&curvature) };
        let (rates, outcome) = form(IndexForm::Curvature);
        prop_assert!(matches!(outcome.status, QuadraticStatus::Solved | QuadraticStatus::Relaxed), "{:?}", outcome);
        prop_assert!(check(&rates, &(&h + kept), &linear) < 1e-12);

        let whole = &h + &curvature;
        let spread = whole.symmetric_eigenvalues();
        let (rates, outcome) = form(IndexForm::Printed);
        if spread.min() > 1e-10 * spread.max() {
            prop_assert!(outcome.status != QuadraticStatus::NotConvex);
            prop_assert!(check(&rates, &whole, &linear) < 1e-12);
        } else if spread.min() < -1e-10 * spread.max() {
            prop_assert_eq!(outcome.status, QuadraticStatus::NotConvex);
            prop_assert!(check(&rates, &h, &g) < 1e-12, "the index is left out");
        }
    }

    /// As the deviation costs more, the rates tend to the weighted pseudo-inverse, and the deviation falls as fast.
    #[test]
    fn stiffness_leads_to_the_pseudo_inverse(seed in rngs(), kind in 0usize..4) {
        let rng = &mut Rng(seed);
        let case = Case::new(rng, kind);
        let (settings, q) = (QuadraticSettings { length: 1.0, dt: 1e-9, ..settings(rng, false) }, posture(rng, &case.robot));
        let twist = twist(rng, 1.0);
        let (all, projector) = case.matrices(&q);
        let task = projector * all;
        let root = DMatrix::from_diagonal(&DVector::from_fn(case.n(), |i, _| 1.0 / settings.rate_weights[i].sqrt()));
        let weighted = &task * &root;
        let sigma = weighted.clone().svd(false, false).singular_values;
        let rank = case.task.dimension();
        prop_assume!(sigma[rank - 1] > 0.1);
        let limit = root * weighted.pseudo_inverse(1e-9).unwrap() * DVector::from_column_slice(&twist);
        let errors = [1e4, 1e6, 1e8].map(|stiffness| {
            let tick = Tick { q: &q, twist, stiffness, rows: &[], twists: &[], frame: None };
            let (rates, outcome) = first_step(&case.plain(settings), &tick);
            (apart(&rates, &limit), outcome)
        });
        for pair in errors.windows(2) {
            let ratio = pair[1].0 / pair[0].0;
            prop_assert!((ratio - 0.01).abs() < 3e-3 || pair[1].0 < 1e-6, "{:?}", errors);
        }
        prop_assert!(errors[2].0 < 1e-5 && errors[2].1.status == QuadraticStatus::Solved, "{:?}", errors);
    }
}

#[test]
fn bad_settings_are_refused() {
    let robot = Arc::new(iiwa());
    let good = settings(&mut Rng(1), true);
    let objective = Objective::new(vec![(1.0, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap();
    let make = |weight: f64, derivatives, settings| {
        QuadraticSolver::new(robot.clone(), Task::FULL, Some((objective.clone(), weight)), IndexForm::Equality, derivatives, settings)
            .is_ok()
    };
    assert!(make(1.0, Derivatives::Exact, good) && make(0.0, Derivatives::Bfgs, good) && make(1.0, Derivatives::Differences(1e-3), good));
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(!make(bad, Derivatives::Exact, good));
    }
    for bad in [0.0, -1e-3, 1.0, f64::NAN] {
        assert!(!make(1.0, Derivatives::Differences(bad), good));
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut weights = good.rate_weights;
        weights[6] = bad;
        for settings in [
            QuadraticSettings { length: bad, ..good },
            QuadraticSettings { dt: bad, ..good },
            QuadraticSettings { stiffness: bad, ..good },
            QuadraticSettings { tolerance: bad, ..good },
            QuadraticSettings { rate_weights: weights, ..good },
        ] {
            assert!(!make(1.0, Derivatives::Exact, settings));
        }
    }
    for bad in [(-1.0, 1.0), (1.0, f64::NAN)] {
        assert!(!make(1.0, Derivatives::Exact, QuadraticSettings { largest_deviation: bad, ..good }));
    }
}
