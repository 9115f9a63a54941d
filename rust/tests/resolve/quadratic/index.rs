//! The worth of an index: forms where it is not convex, the memory of BFGS, differences.

use super::oracle::{Case, apart, expansion, first_step, minimiser, posture, settings, step, twist};
use crate::common::{Rng, evaluate, iiwa, rngs};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use redundancy::index::{Evaluation, Index, JointLimits, Kind, Objective, Order, Rows, differences};
use redundancy::internals::resolve::direct_update;
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Derivatives, IndexForm, QuadraticMemory, QuadraticSettings, QuadraticStatus, Tick};
use redundancy::robot::Robot;
use redundancy::task::Task;
use std::sync::Arc;

fn all_rows() -> Rows {
    Rows::new(&[0, 1, 2, 3, 4, 5], 0.5).unwrap()
}

/// Of which more is better.
fn manipulability() -> Objective {
    Objective::new(vec![(-1.0, Index::of(Kind::Manipulability, all_rows(), false))]).unwrap()
}

fn condition() -> Objective {
    Objective::new(vec![(1.0, Index::of(Kind::ConditionNumber, all_rows(), false))]).unwrap()
}

#[test]
fn the_printed_form_is_not_convex_for_large_weights() {
    let rng = &mut Rng(1);
    let case = Case { robot: Arc::new(iiwa()), task: Task::FULL };
    let objective = manipulability();
    let mut refused = 0;
    for _ in 0..200 {
        let (settings, q) =
            (QuadraticSettings { rate_weights: [1.0; MAX_JOINTS], dt: 0.01, ..settings(rng, false) }, posture(rng, &case.robot));
        let (value, gradient, hessian) = expansion(&objective, &case.robot, &q);
        let lowest = hessian.symmetric_eigenvalues().min();
        // The first joint never changes the index: an eigenvalue of zero, to rounding, is no curvature.
        if lowest > -1e-3 {
            continue;
        }
        // Of seven directions, the task holds six: the index may be concave along the last.
        let tick = Tick { q: &q, twist: twist(rng, 0.1), stiffness: 1e-3, rows: &[], twists: &[], frame: None };
        let weight = 2.0 * (1.0 + tick.stiffness * 20.0) / (-lowest * settings.dt * settings.dt);
        let answer = |form, weight| first_step(&case.solver(Some((&objective, weight)), form, Derivatives::Exact, settings), &tick);
        let (plain, _) = first_step(&case.plain(settings), &tick);
        let (rates, outcome) = answer(IndexForm::Printed, weight);
        assert_eq!((outcome.status, &rates), (QuadraticStatus::NotConvex, &plain));
        refused += 1;
        for form in [IndexForm::Curvature, IndexForm::Equality] {
            let (rates, outcome) = answer(form, weight);
            assert!(matches!(outcome.status, QuadraticStatus::Solved | QuadraticStatus::Relaxed), "{outcome:?}");
            // Downhill, more than the task alone would.
            let slope = |rates: &[f64]| gradient.dot(&DVector::from_column_slice(rates));
            assert!(slope(&rates) < slope(&plain), "{form:?} {} {}", slope(&rates), slope(&plain));
            assert!(rates.iter().all(|x| x.is_finite()));
        }
        // An equality costs nothing beyond its own value.
        let (rates, _) = answer(IndexForm::Equality, weight);
        let reached = value.abs() + settings.dt * gradient.dot(&DVector::from_column_slice(&rates));
        assert!(reached >= -1e-9 && reached <= value.abs() + settings.dt * gradient.dot(&DVector::from_column_slice(&plain)) + 1e-9);
        // Where the whole is convex, both forms with a curvature are one.
        let small = 0.4 / (-lowest * settings.dt * settings.dt);
        let (one, two) = (answer(IndexForm::Printed, small), answer(IndexForm::Curvature, small));
        assert_eq!(one, two);
    }
    assert!(refused > 100, "{refused}");
}

/// B of the direct update by its formula, with matrices.
fn textbook(b: &DMatrix<f64>, s: &DVector<f64>, y: &DVector<f64>) -> DMatrix<f64> {
    let bs = b * s;
    b - &bs * bs.transpose() / s.dot(&bs) + y * y.transpose() / y.dot(s)
}

fn entries(hessian: &[[f64; MAX_JOINTS]; MAX_JOINTS], n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |i, j| hessian[i][j])
}

fn padded(x: &DVector<f64>) -> [f64; MAX_JOINTS] {
    std::array::from_fn(|i| if i < x.len() { x[i] } else { 0.0 })
}

fn semidefinite(b: &DMatrix<f64>) -> bool {
    let eigenvalues = b.clone().symmetric_eigenvalues();
    (b - b.transpose()).amax() <= 1e-12 * b.amax() && eigenvalues.min() >= -1e-10 * eigenvalues.max()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// On a quadratic, the eigenvalues of A^-1 B never move away from one (Fletcher 1970), and all of them come near.
    #[test]
    fn the_update_learns_a_quadratic(seed in rngs(), n in 2usize..=8) {
        let rng = &mut Rng(seed);
        let basis = DMatrix::from_fn(n, n, |_, _| rng.within(-1.0, 1.0)).qr().q();
        let a = &basis * DMatrix::from_diagonal(&DVector::from_fn(n, |_, _| 10f64.powf(rng.within(-1.0, 1.0)))) * basis.transpose();
        let inverse_root = a.clone().cholesky().unwrap().l().try_inverse().unwrap();
        let error = |b: &DMatrix<f64>| (&inverse_root * b * inverse_root.transpose()).symmetric_eigenvalues().map(|x| (x - 1.0).abs()).sum();
        let mut hessian = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        let mut errors = Vec::new();
        for k in 0..60 * n {
            let s = DVector::from_fn(n, |_, _| rng.within(-0.1, 0.1));
            let before = entries(&hessian, n);
            direct_update(&mut hessian, &padded(&s), &padded(&(&a * &s)), n);
            let now = entries(&hessian, n);
            if k > 0 {
                prop_assert!((textbook(&before, &s, &(&a * &s)) - &now).amax() <= 1e-10 * now.amax());
            }
            prop_assert!(semidefinite(&now) && (&now * &s - &a * &s).norm() <= 1e-10 * (now.norm() * s.norm()), "the secant equation");
            errors.push(error(&now));
        }
        for pair in errors.windows(2) {
            prop_assert!(pair[1] <= pair[0] + 1e-9 * (1.0 + pair[0]), "{:?}", pair);
        }
        prop_assert!(errors[errors.len() - 1] < 1e-2 * errors[0].max(0.1), "{} to {}", errors[0], errors[errors.len() - 1]);
    }

    /// Whatever gradients do, the matrix stays positive semidefinite, to rounding of the largest curvature met, and finite.
    #[test]
    fn the_update_stays_semidefinite(seed in rngs(), n in 2usize..=8) {
        let rng = &mut Rng(seed);
        let (mut hessian, mut largest) = ([[0.0; MAX_JOINTS]; MAX_JOINTS], 0.0f64);
        for _ in 0..100 {
            let scale = 10f64.powf(rng.within(-6.0, 1.0));
            let s = DVector::from_fn(n, |_, _| scale * rng.within(-1.0, 1.0));
            let y = match rng.below(4) {
                0 => DVector::zeros(n),
                // Nearly across the step.
                1 => {
                    let y = DVector::from_fn(n, |_, _| rng.within(-1.0, 1.0));
                    let along = y.dot(&s) / s.dot(&s);
                    (y - along * &s).normalize() + 10f64.powf(rng.within(-10.0, 0.0)) * s.normalize()
                }
                _ => DVector::from_fn(n, |_, _| rng.within(-1.0, 1.0)),
            };
            direct_update(&mut hessian, &padded(&s), &padded(&y), n);
            let b = entries(&hessian, n);
            let eigenvalues = b.clone().symmetric_eigenvalues();
            largest = largest.max(eigenvalues.max());
            prop_assert!(b.iter().all(|x| x.is_finite()) && eigenvalues.min() >= -1e-9 * largest, "{} {}", b, eigenvalues);
        }
    }

    /// The memory of a solver along a path is that of the formula, and stays semidefinite with a real index.
    #[test]
    fn bfgs_along_a_path(seed in rngs()) {
        let rng = &mut Rng(seed);
        let case = Case { robot: Arc::new(iiwa()), task: Task::FULL };
        let settings = QuadraticSettings { dt: 0.02, ..settings(rng, false) };
        let (objective, weight) = (condition(), 1.0);
        let solver = case.solver(Some((&objective, weight)), IndexForm::Curvature, Derivatives::Bfgs, settings);
        let (mut q, drive) = (posture(rng, &case.robot), twist(rng, 0.3));
        let (mut memory, mut known, mut last) = (QuadraticMemory::default(), DMatrix::zeros(7, 7), None::<(Vec<f64>, DVector<f64>)>);
        for _ in 0..30 {
            let (value, gradient, _) = expansion(&objective, &case.robot, &q);
            prop_assume!(value < 50.0);
            if let Some((before, slope)) = &last {
                let s = DVector::from_fn(7, |i, _| q[i] - before[i]);
                let y = &gradient - slope;
                if y.dot(&s) > 1.5e-8 * s.norm() * y.norm() {
                    if known == DMatrix::zeros(7, 7) {
                        known = DMatrix::identity(7, 7) * (y.dot(&y) / y.dot(&s));
                    }
                    known = textbook(&known, &s, &y);
                }
            }
            prop_assert!(semidefinite(&known));
            let tick = Tick { q: &q, twist: drive, stiffness: 100.0, rows: &[], twists: &[], frame: None };
            let (rates, _) = step(&solver, &tick, &mut memory);
            let (h, g) = case.quadratic(&settings, &tick);
            let expected = minimiser(&(h + weight * settings.dt.powi(2) * &known), &(g + weight * settings.dt * &gradient));
            prop_assert!(apart(&rates, &expected) < 1e-7, "{:e}", apart(&rates, &expected));
            last = Some((q.clone(), gradient));
            for i in 0..7 {
                q[i] += settings.dt * rates[i];
            }
        }
    }
}

/// Steps and gradients whose squares overflow teach nothing, and spoil nothing.
#[test]
fn the_update_survives_numbers_of_any_size() {
    for seed in 0..20_000 {
        let rng = &mut Rng(seed);
        let mut hessian = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        direct_update(&mut hessian, &[0.1; MAX_JOINTS], &[0.2; MAX_JOINTS], 3);
        let (s, y) = (std::array::from_fn(|_| rng.wild()), std::array::from_fn(|_| rng.wild()));
        direct_update(&mut hessian, &s, &y, 3);
        assert!(entries(&hessian, 3).iter().all(|x| x.is_finite()), "{seed}: {s:?} {y:?} {hessian:?}");
    }
}

/// The errors of both derivatives with a step.
fn errors(objective: &Objective, robot: &Robot, q: &[f64], step: f64) -> (f64, f64) {
    let n = q.len();
    let Evaluation { value, gradient, hessian, .. } = differences(objective, robot, q, Order::Hessian, step).unwrap();
    let exact = evaluate::<8>(objective, robot, q, Order::Hessian, false);
    assert!((value - exact.value).abs() <= 1e-14 * value.abs());
    let slope = (0..n).map(|i| (gradient[i] - exact.gradient[i]).powi(2)).sum::<f64>().sqrt();
    let curvature = (0..n * n).map(|k| (hessian[k / n][k % n] - exact.hessian[k / n][k % n]).powi(2)).sum::<f64>().sqrt();
    (slope, curvature)
}

#[test]
fn differences_are_of_second_order() {
    let rng = &mut Rng(3);
    let robot = iiwa();
    let mut compared = 0;
    for objective in [condition(), manipulability()] {
        for _ in 0..100 {
            let q = posture(rng, &robot);
            if expansion(&condition(), &robot, &q).0 > 6.0 {
                continue;
            }
            let (wide, narrow) = (errors(&objective, &robot, &q, 4e-3), errors(&objective, &robot, &q, 2e-3));
            for (wide, narrow) in [(wide.0, narrow.0), (wide.1, narrow.1)] {
                assert!((wide / narrow - 4.0).abs() < 0.25, "{wide:e} {narrow:e}");
                compared += 1;
            }
        }
    }
    assert!(compared > 100, "{compared}");
    // A quadratic has no third derivative: nothing but rounding is left, and the gradient alone asks for no Hessian.
    let quadratic = Objective::new(vec![(1.0, Index::JointLimits(JointLimits::new(&[]).unwrap()))]).unwrap();
    let (slope, curvature) = errors(&quadratic, &robot, &[0.3; 7], 0.1);
    assert!(slope < 1e-13 && curvature < 1e-12, "{slope:e} {curvature:e}");
    assert_eq!(differences(&quadratic, &robot, &[0.3; 7], Order::Gradient, 0.1).unwrap().hessian, [[0.0; 16]; 16]);
}

/// All sources of derivatives lead to the same rates, as far as differences can.
#[test]
fn sources_of_derivatives_agree() {
    let rng = &mut Rng(4);
    let case = Case { robot: Arc::new(iiwa()), task: Task::FULL };
    let mut compared = 0;
    while compared < 50 {
        let (settings, q) = (settings(rng, false), posture(rng, &case.robot));
        let objective = condition();
        if expansion(&objective, &case.robot, &q).0 > 6.0 {
            continue;
        }
        compared += 1;
        let tick = Tick { q: &q, twist: twist(rng, 0.3), stiffness: 100.0, rows: &[], twists: &[], frame: None };
        for form in [IndexForm::Curvature, IndexForm::Equality] {
            let rates = |derivatives| first_step(&case.solver(Some((&objective, 10.0)), form, derivatives, settings), &tick).0;
            let exact = DVector::from_vec(rates(Derivatives::Exact));
            assert!(apart(&rates(Derivatives::Differences(1e-4)), &exact) < 1e-4, "{form:?}");
            if form == IndexForm::Equality {
                assert_eq!(rates(Derivatives::Bfgs), exact.as_slice(), "eq. 14 asks for no Hessian");
            }
        }
    }
}
