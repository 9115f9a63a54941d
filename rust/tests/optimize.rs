//! Minimisers on functions with known minima, the line search by its own conditions.

use crate::common::{Rng, rngs};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use redundancy::optimize::{Minimum, Outcome, Smooth, Stop, bfgs, strong_wolfe, trust_region_newton};

/// A function by value, gradient and Hessian.
struct Function<F>(F);

impl<F: Fn(&DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>)> Smooth for Function<F> {
    fn gradient(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>) {
        let (value, gradient, _) = self.0(x);
        (value, gradient)
    }

    fn hessian(&mut self, x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
        self.0(x)
    }
}

const STOP: Stop = Stop { step: 1e-9, iterations: 500 };

fn rosenbrock(x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    let n = x.len();
    let (mut value, mut gradient, mut hessian) = (0.0, DVector::zeros(n), DMatrix::zeros(n, n));
    for i in 0..n - 1 {
        let (a, b) = (x[i], x[i + 1]);
        let (u, v) = (b - a * a, 1.0 - a);
        value += 100.0 * u * u + v * v;
        gradient[i] += -400.0 * a * u - 2.0 * v;
        gradient[i + 1] += 200.0 * u;
        hessian[(i, i)] += 1200.0 * a * a - 400.0 * b + 2.0;
        hessian[(i + 1, i + 1)] += 200.0;
        hessian[(i, i + 1)] -= 400.0 * a;
        hessian[(i + 1, i)] -= 400.0 * a;
    }
    (value, gradient, hessian)
}

fn beale(x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    let (a, b) = (x[0], x[1]);
    let (mut value, mut gradient, mut hessian) = (0.0, DVector::zeros(2), DMatrix::zeros(2, 2));
    for (k, c) in [(1, 1.5), (2, 2.25), (3, 2.625)] {
        let (p, kf) = (b.powi(k), f64::from(k));
        let (dp, d2p) = (kf * b.powi(k - 1), if k > 1 { kf * (kf - 1.0) * b.powi(k - 2) } else { 0.0 });
        let r = c - a + a * p;
        let slope = DVector::from_vec(vec![p - 1.0, a * dp]);
        value += r * r;
        gradient += 2.0 * r * &slope;
        hessian += 2.0 * &slope * slope.transpose() + 2.0 * r * DMatrix::from_row_slice(2, 2, &[0.0, dp, dp, a * d2p]);
    }
    (value, gradient, hessian)
}

/// x^2 - y^2 + y^4: a saddle at 0, minima at y = +-1/sqrt 2.
fn saddle(x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    let (a, b) = (x[0], x[1]);
    let gradient = DVector::from_vec(vec![2.0 * a, -2.0 * b + 4.0 * b.powi(3)]);
    (a * a - b * b + b.powi(4), gradient, DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, -2.0 + 12.0 * b * b])))
}

/// (x + y - 1)^2 + 3 z^2: flat along (1, -1, 0).
fn flat(x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    let u = x[0] + x[1] - 1.0;
    let hessian = DMatrix::from_row_slice(3, 3, &[2.0, 2.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0, 6.0]);
    (u * u + 3.0 * x[2] * x[2], DVector::from_vec(vec![2.0 * u, 2.0 * u, 6.0 * x[2]]), hessian)
}

/// A quartic bowl about (0.85, 0.3), NaN outside the unit circle.
fn ball(x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    if x.norm() > 1.0 {
        return (f64::NAN, DVector::repeat(2, f64::NAN), DMatrix::repeat(2, 2, f64::NAN));
    }
    let d = x - DVector::from_vec(vec![0.85, 0.3]);
    let s = d.norm_squared();
    (s + s * s, &d * (2.0 + 4.0 * s), DMatrix::identity(2, 2) * (2.0 + 4.0 * s) + 8.0 * &d * d.transpose())
}

type Test = fn(&DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>);

/// Both methods from one start; each must settle where the gradient is zero.
fn both(name: &str, f: Test, start: &[f64]) -> [Minimum; 2] {
    let x = DVector::from_column_slice(start);
    let newton = trust_region_newton(&mut Function(f), x.clone(), STOP);
    let quasi = bfgs(&mut Function(f), x, STOP);
    for (method, minimum) in [("Newton", &newton), ("BFGS", &quasi)] {
        println!(
            "{name} {method}: {:?} after {} iterations, {} evaluations, value {:.3e}",
            minimum.outcome, minimum.iterations, minimum.evaluations, minimum.value
        );
        let (value, gradient, _) = f(&minimum.x);
        assert!(matches!(minimum.outcome, Outcome::Converged | Outcome::Stalled), "{name} {method} {minimum:?}");
        assert!(
            (value - minimum.value).abs() <= 1e-14 * (1.0 + value.abs()),
            "{name} {method}: value {value} is not that at x, {}",
            minimum.value
        );
        assert!(gradient.amax() <= 1e-6, "{name} {method}: gradient {gradient}");
        assert!(value <= f(&DVector::from_column_slice(start)).0);
        history_leads_there(f, start, minimum);
    }
    [newton, quasi]
}

/// From the start down to the minimum, each point with the evaluations that it took.
fn history_leads_there(f: Test, start: &[f64], minimum: &Minimum) {
    let (value, gradient, _) = f(&DVector::from_column_slice(start));
    let (first, last) = (minimum.history[0], minimum.history[minimum.history.len() - 1]);
    assert_eq!((first.evaluations, first.value, first.gradient), (1, value, gradient.norm()));
    assert_eq!(last.value, minimum.value);
    assert!(last.evaluations <= minimum.evaluations && minimum.history.len() <= minimum.iterations + 1);
    for pair in minimum.history.windows(2) {
        assert!(pair[1].evaluations > pair[0].evaluations);
        assert!(pair[1].value <= pair[0].value + 8.0 * f64::EPSILON * pair[0].value.abs());
    }
}

#[test]
fn rosenbrock_of_two() {
    let [newton, quasi] = both("Rosenbrock 2", rosenbrock, &[-1.2, 1.0]);
    for minimum in [&newton, &quasi] {
        assert!((&minimum.x - DVector::repeat(2, 1.0)).amax() < 1e-7, "{minimum:?}");
    }
    assert_eq!(newton.outcome, Outcome::Converged);
    assert!(newton.iterations <= 40 && quasi.iterations <= 80);
}

#[test]
fn rosenbrock_of_ten() {
    // From here the global minimum; from the classical start possibly the local one near (-1, 1, ..., 1), value 3.986.
    for start in [vec![0.0; 10], vec![1.5; 10]] {
        for minimum in both("Rosenbrock 10", rosenbrock, &start) {
            assert!((&minimum.x - DVector::repeat(10, 1.0)).amax() < 1e-6, "{minimum:?}");
        }
    }
    let classical: Vec<f64> = (0..10).map(|i| if i % 2 == 0 { -1.2 } else { 1.0 }).collect();
    for minimum in both("Rosenbrock 10 classical", rosenbrock, &classical) {
        assert!(minimum.value < 1e-12 || (minimum.value - 3.9866).abs() < 1e-3, "{minimum:?}");
        let eigenvalues = rosenbrock(&minimum.x).2.symmetric_eigenvalues();
        assert!(eigenvalues.min() > 0.0, "not a minimum");
    }
}

#[test]
fn beale_from_its_classical_starts() {
    for start in [[1.0, 1.0], [0.0, 0.0], [2.0, 0.2]] {
        for minimum in both("Beale", beale, &start) {
            assert!((&minimum.x - DVector::from_vec(vec![3.0, 0.5])).amax() < 1e-6, "{minimum:?}");
        }
    }
}

#[test]
fn newton_leaves_a_saddle() {
    // On the ridge, where the gradient has no downhill component, and on the saddle itself.
    for start in [[1.0, 0.0], [1e-3, 0.0], [0.0, 0.0]] {
        let minimum = trust_region_newton(&mut Function(saddle), DVector::from_column_slice(&start), STOP);
        assert_eq!(minimum.outcome, Outcome::Converged, "{minimum:?}");
        assert!(minimum.x[0].abs() < 1e-8 && (minimum.x[1].abs() - 0.5f64.sqrt()).abs() < 1e-8, "{start:?}: {minimum:?}");
        assert!((minimum.value + 0.25).abs() < 1e-14);
    }
    // Beside the ridge both get there.
    for minimum in both("saddle", saddle, &[1.0, 1e-3]) {
        assert!((minimum.x[1].abs() - 0.5f64.sqrt()).abs() < 1e-6, "{minimum:?}");
    }
}

#[test]
fn flat_directions_are_left_alone() {
    for minimum in both("flat", flat, &[2.0, 0.5, 1.0]) {
        assert!((minimum.x[0] - minimum.x[1] - 1.5).abs() < 1e-7, "moved along the flat direction: {minimum:?}");
        assert!(minimum.value < 1e-14);
    }
}

#[test]
fn domains() {
    for start in [[-0.9, 0.0], [0.0, -0.99], [-0.7, -0.7], [0.0, 0.0]] {
        for minimum in both("ball", ball, &start) {
            assert!((&minimum.x - DVector::from_vec(vec![0.85, 0.3])).amax() < 1e-6, "{minimum:?}");
        }
    }
    let outside = DVector::from_vec(vec![2.0, 0.0]);
    for minimum in [trust_region_newton(&mut Function(ball), outside.clone(), STOP), bfgs(&mut Function(ball), outside.clone(), STOP)] {
        assert_eq!((minimum.outcome, minimum.iterations, minimum.evaluations), (Outcome::Undefined, 0, 1));
        assert_eq!(minimum.x, outside);
    }
}

#[test]
fn stops_at_the_number_of_iterations() {
    let stop = Stop { step: 1e-9, iterations: 3 };
    for minimum in [
        trust_region_newton(&mut Function(rosenbrock), DVector::from_vec(vec![-1.2, 1.0]), stop),
        bfgs(&mut Function(rosenbrock), DVector::from_vec(vec![-1.2, 1.0]), stop),
    ] {
        assert_eq!((minimum.outcome, minimum.iterations), (Outcome::Iterations, 3));
    }
}

/// Strong Wolfe at a step of `strong_wolfe`: (3.56) and (3.57) with 1e-4 and 0.9.
fn wolfe_conditions(f: Test, x: &DVector<f64>, direction: &DVector<f64>, first: f64) -> Result<(), TestCaseError> {
    let (value, gradient, _) = f(x);
    let slope = gradient.dot(direction);
    let (found, evaluations) = strong_wolfe(&mut Function(f), x, value, &gradient, direction, first);
    prop_assert!(evaluations <= 30);
    let Some(found) = found else { return Err(TestCaseError::fail(format!("nothing found from {x} along {direction}"))) };
    let (again, gradient_again, _) = f(&(x + direction * found.alpha));
    prop_assert!((&found.x - x - direction * found.alpha).amax() <= 1e-14 * (1.0 + found.x.amax()));
    prop_assert_eq!(again, found.value);
    prop_assert_eq!(&gradient_again, &found.gradient);
    prop_assert!(found.value <= value + 1e-4 * found.alpha * slope, "no sufficient decrease");
    let end = found.gradient.dot(direction);
    prop_assert!(
        end.abs() <= 0.9 * slope.abs(),
        "curvature: slope {slope} at the start, {end} at alpha = {} after {evaluations}",
        found.alpha
    );
    Ok(())
}

/// Wavy along every line: the first trials overshoot, and lower points can be steep.
fn waves(x: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
    let t = x[0];
    let value = 0.05 * t * t + (3.0 * t).sin() + 0.3 * (11.0 * t).cos();
    let slope = 0.1 * t + 3.0 * (3.0 * t).cos() - 3.3 * (11.0 * t).sin();
    (value, DVector::from_vec(vec![slope]), DMatrix::from_element(1, 1, 0.1 - 9.0 * (3.0 * t).sin() - 36.3 * (11.0 * t).cos()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn strong_wolfe_holds(seed in rngs(), which in 0usize..4, first in -3.0..2.0f64) {
        let rng = &mut Rng(seed);
        let (f, n): (Test, usize) = [(rosenbrock as Test, 4), (beale as Test, 2), (saddle as Test, 2), (ball as Test, 2)][which];
        let x = DVector::from_fn(n, |_, _| rng.within(-0.7, 0.7));
        let (_, gradient, hessian) = f(&x);
        // Steepest descent, or Newton where that descends.
        let mut direction = -gradient.clone();
        if let Some(newton) = hessian.cholesky().map(|c| -c.solve(&gradient)).filter(|_| seed & 1 == 0) {
            direction = newton;
        }
        prop_assume!(direction.amax() > 1e-8 && gradient.dot(&direction) < -1e-8);
        wolfe_conditions(f, &x, &direction, 10f64.powf(first))?;
    }

    #[test]
    fn strong_wolfe_holds_on_waves(start in -6.0..6.0f64, first in -2.0..1.5f64) {
        let x = DVector::from_vec(vec![start]);
        let slope = waves(&x).1[0];
        prop_assume!(slope.abs() > 1e-3);
        wolfe_conditions(waves, &x, &DVector::from_vec(vec![-slope.signum()]), 10f64.powf(first))?;
    }
}
