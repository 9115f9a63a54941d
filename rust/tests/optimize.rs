//! Minimisers on functions with known minima, the line search by its own conditions, the QP by its optimality conditions and Clarabel.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::{Rng, rngs};
use _core::optimize::qp::{self, MAX_VARIABLES, QpSolution, QpStatus, Row};
use _core::optimize::{Minimum, Outcome, Smooth, Stop, bfgs, strong_wolfe, trust_region_newton};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

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
    }
    [newton, quasi]
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

// The quadratic programme.

type Vector = [f64; MAX_VARIABLES];

#[derive(Debug, Clone)]
struct Programme {
    n: usize,
    h: [Vector; MAX_VARIABLES],
    g: Vector,
    rows: Vec<Row>,
}

static MOST_CHANGES: AtomicUsize = AtomicUsize::new(0);

impl Programme {
    /// A convex objective whose curvatures spread over up to four decades.
    fn new(rng: &mut Rng, n: usize) -> Self {
        let graded: Vec<f64> = (0..n).map(|_| 10f64.powf(rng.within(-2.0, 2.0) * rng.within(0.0, 1.0))).collect();
        let b = DMatrix::from_fn(n, n, |_, _| rng.within(-1.0, 1.0)).qr().q() * DMatrix::from_diagonal(&DVector::from_vec(graded));
        let full = &b * b.transpose();
        let mut out = Self { n, h: [[0.0; MAX_VARIABLES]; MAX_VARIABLES], g: [0.0; MAX_VARIABLES], rows: Vec::new() };
        for i in 0..n {
            out.g[i] = rng.within(-3.0, 3.0);
            for j in 0..n {
                out.h[i][j] = 0.5 * (full[(i, j)] + full[(j, i)]);
            }
        }
        out
    }

    fn direction(&self, rng: &mut Rng) -> Vector {
        std::array::from_fn(|i| if i < self.n { rng.within(-1.0, 1.0) } else { 0.0 })
    }

    fn dot(&self, a: &Vector, x: &Vector) -> f64 {
        (0..self.n).map(|i| a[i] * x[i]).sum()
    }

    fn size(&self, a: &Vector) -> f64 {
        self.dot(a, a).sqrt()
    }

    fn solve(&self) -> QpSolution {
        let solution = qp::solve(&self.h, &self.g, &self.rows, self.n);
        MOST_CHANGES.fetch_max(solution.changes, Ordering::Relaxed);
        solution
    }

    fn value(&self, x: &Vector) -> f64 {
        self.dot(&self.g, x) + (0..self.n).map(|i| 0.5 * x[i] * self.dot(&self.h[i], x)).sum::<f64>()
    }

    /// The KKT conditions: feasible, and the gradient a non-negative combination of active rows. Returns the worst residual.
    fn kkt(&self, solution: &QpSolution) -> Result<f64, TestCaseError> {
        let n = self.n;
        let x = &solution.x;
        let reach = 1.0 + self.size(x);
        let mut worst = 0.0f64;
        let mut active = Vec::new();
        for row in &self.rows {
            let length = self.size(&row.a);
            let slack = self.dot(&row.a, x) - row.b;
            let relative = slack / (length * reach + row.b.abs()).max(f64::MIN_POSITIVE);
            prop_assert!(relative >= -1e-11, "infeasible by {relative:e}: {row:?}");
            worst = worst.max(-relative);
            if relative <= 1e-9 && length > 0.0 {
                active.push(DVector::from_fn(n, |i, _| row.a[i] / length));
            }
        }
        let gradient = DVector::from_fn(n, |i, _| self.g[i] + self.dot(&self.h[i], x));
        let size = DVector::from_column_slice(&self.g[..n]).norm() + gradient.norm();
        let residual = non_negative_residual(&active, &gradient) / size;
        prop_assert!(residual <= 1e-9, "not stationary: {residual:e} with {} active, {solution:?}", active.len());
        Ok(worst.max(residual))
    }

    /// Clarabel's status, minimiser and value.
    fn clarabel(&self) -> (SolverStatus, Vector) {
        let (n, rows) = (self.n, self.rows.len());
        let upper: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| if j >= i { self.h[i][j] } else { 0.0 }).collect()).collect();
        let p = CscMatrix::from(&upper);
        let table: Vec<Vec<f64>> = self.rows.iter().map(|row| row.a[..n].iter().map(|x| -x).collect()).collect();
        let a = if rows == 0 { CscMatrix::zeros((0, n)) } else { CscMatrix::from(&table) };
        let b: Vec<f64> = self.rows.iter().map(|row| -row.b).collect();
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .tol_gap_abs(1e-14)
            .tol_gap_rel(1e-14)
            .tol_feas(1e-12)
            .max_iter(200)
            .build()
            .unwrap();
        let mut solver = DefaultSolver::new(&p, &self.g[..n], &a, &b, &[NonnegativeConeT(rows)], settings).unwrap();
        solver.solve();
        let mut x = [0.0; MAX_VARIABLES];
        x[..n].copy_from_slice(&solver.solution.x);
        (solver.solution.status, x)
    }
}

/// The distance of `b` to the cone of `columns`: Lawson and Hanson's non-negative least squares.
fn non_negative_residual(columns: &[DVector<f64>], b: &DVector<f64>) -> f64 {
    let k = columns.len();
    let mut passive = vec![false; k];
    let mut x = vec![0.0; k];
    let residual = |x: &[f64]| columns.iter().zip(x).fold(b.clone(), |r, (c, x)| r - c * *x);
    for _ in 0..10 * (k + 1) {
        let r = residual(&x);
        let next = (0..k).filter(|j| !passive[*j]).map(|j| (j, columns[j].dot(&r))).max_by(|a, b| a.1.total_cmp(&b.1));
        match next {
            Some((j, gain)) if gain > 1e-13 * b.norm() && r.norm() > 1e-13 * b.norm() => passive[j] = true,
            _ => break,
        }
        loop {
            let set: Vec<usize> = (0..k).filter(|j| passive[*j]).collect();
            if set.is_empty() {
                break;
            }
            let matrix = DMatrix::from_columns(&set.iter().map(|j| columns[*j].clone()).collect::<Vec<_>>());
            let z = matrix.svd(true, true).solve(b, 1e-12).unwrap();
            if z.iter().all(|v| *v > 0.0) {
                for (i, j) in set.iter().enumerate() {
                    x[*j] = z[i];
                }
                break;
            }
            let step = set.iter().enumerate().filter(|(i, _)| z[*i] <= 0.0).map(|(i, j)| x[*j] / (x[*j] - z[i])).fold(1.0, f64::min);
            for (i, j) in set.iter().enumerate() {
                x[*j] += step * (z[i] - x[*j]);
                if x[*j] <= 1e-15 {
                    (passive[*j], x[*j]) = (false, 0.0);
                }
            }
        }
    }
    residual(&x).norm()
}

/// A programme with a point that satisfies all rows, many of them exactly when `tight`.
fn feasible(rng: &mut Rng, n: usize, count: usize, tight: bool) -> Programme {
    let mut out = Programme::new(rng, n);
    let inside = out.direction(rng);
    for _ in 0..count {
        let a = out.direction(rng);
        let slack = if tight && rng.below(2) == 0 { 0.0 } else { rng.within(0.0, 1.0) };
        out.rows.push(Row { a, b: out.dot(&a, &inside) - slack });
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn qp_agrees_with_clarabel(seed in rngs(), n in 2usize..=16, count in 0usize..=40) {
        let rng = &mut Rng(seed);
        let programme = feasible(rng, n, count, false);
        let solution = programme.solve();
        prop_assert_eq!(solution.status, QpStatus::Solved);
        prop_assert!(solution.active <= n);
        programme.kkt(&solution)?;
        let (status, x) = programme.clarabel();
        prop_assert!(matches!(status, SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress), "Clarabel: {status:?}");
        // Where Clarabel itself says that it did not converge, only its value is compared; the conditions of optimality were checked above.
        let error = (0..n).map(|i| (x[i] - solution.x[i]).abs()).fold(0.0, f64::max);
        let converged = status == SolverStatus::Solved;
        prop_assert!(!converged || error <= 1e-8 * (1.0 + programme.size(&x)), "x differs from Clarabel's ({status:?}) by {error:e}");
        prop_assert!(programme.value(&solution.x) <= programme.value(&x) + 1e-9 * (1.0 + programme.value(&x).abs()));
    }

    /// Many rows through one vertex, duplicates, and multiples of rows.
    #[test]
    fn qp_degenerate(seed in rngs(), n in 2usize..=16, count in 1usize..=30) {
        let rng = &mut Rng(seed);
        let mut programme = feasible(rng, n, count, true);
        for _ in 0..10 {
            let copied = programme.rows[rng.below(count)];
            let factor = if rng.below(2) == 0 { 1.0 } else { rng.within(0.1, 10.0) };
            programme.rows.push(Row { a: copied.a.map(|x| factor * x), b: factor * copied.b });
        }
        let solution = programme.solve();
        prop_assert_eq!(solution.status, QpStatus::Solved, "{} changes", solution.changes);
        programme.kkt(&solution)?;
    }

    /// The form in which the resolution uses it: a box on combinations, lower and upper.
    #[test]
    fn qp_box(seed in rngs(), n in 1usize..=13, joints in 1usize..=16) {
        let rng = &mut Rng(seed);
        let mut programme = Programme::new(rng, n);
        for _ in 0..joints {
            let a = programme.direction(rng);
            let closed = rng.below(4) == 0;
            let (low, high) = if closed { (0.0, 0.0) } else { (rng.within(-0.3, 0.0), rng.within(0.0, 0.3)) };
            programme.rows.push(Row { a, b: low });
            programme.rows.push(Row { a: a.map(|x| -x), b: -high });
        }
        let solution = programme.solve();
        prop_assert_eq!(solution.status, QpStatus::Solved, "{} changes", solution.changes);
        programme.kkt(&solution)?;
    }

    /// Rows with a positive combination that says 0 >= something above 0.
    #[test]
    fn qp_infeasible(seed in rngs(), n in 2usize..=16, count in 0usize..=35, parts in 1usize..=4) {
        let rng = &mut Rng(seed);
        let mut programme = feasible(rng, n, count, false);
        let mut sum = [0.0; MAX_VARIABLES];
        let mut bound = 0.0;
        for _ in 0..parts {
            let (a, b) = (programme.direction(rng), rng.within(-1.0, 1.0));
            for i in 0..n {
                sum[i] -= a[i];
            }
            bound -= b;
            programme.rows.push(Row { a, b });
        }
        programme.rows.push(Row { a: sum, b: bound + rng.within(0.01, 1.0) });
        for i in 0..programme.rows.len() {
            let j = rng.below(programme.rows.len());
            programme.rows.swap(i, j);
        }
        prop_assert_eq!(programme.solve().status, QpStatus::Infeasible);
    }

    /// Units: the objective and every row scaled give the same minimiser.
    #[test]
    fn qp_does_not_depend_on_units(seed in rngs(), n in 2usize..=8, count in 1usize..=20, objective in -10.0..10.0f64) {
        let rng = &mut Rng(seed);
        let programme = feasible(rng, n, count, false);
        let mut scaled = programme.clone();
        let factor = 10f64.powf(objective);
        scaled.h = scaled.h.map(|row| row.map(|x| factor * x));
        scaled.g = scaled.g.map(|x| factor * x);
        for row in &mut scaled.rows {
            let factor = 10f64.powf(rng.within(-6.0, 6.0));
            *row = Row { a: row.a.map(|x| factor * x), b: factor * row.b };
        }
        let (a, b) = (programme.solve(), scaled.solve());
        prop_assert_eq!((a.status, b.status), (QpStatus::Solved, QpStatus::Solved), "objective times {:e}", factor);
        let error = (0..n).map(|i| (a.x[i] - b.x[i]).abs()).fold(0.0, f64::max);
        prop_assert!(error <= 1e-9 * (1.0 + programme.size(&a.x)), "{error:e}");
    }

    /// Far from the origin, where rounding of a'x exceeds what b alone suggests.
    #[test]
    fn qp_far_from_the_origin(seed in rngs(), n in 2usize..=8, count in 1usize..=10, size in 0.0..7.0f64) {
        // Fewer rows than variables: always feasible.
        let count = 1 + count % (n - 1);
        let rng = &mut Rng(seed);
        let mut programme = Programme::new(rng, n);
        let far = programme.direction(rng).map(|x| x * 10f64.powf(size));
        for i in 0..n {
            programme.g[i] = -programme.dot(&programme.h[i], &far);
        }
        // Rows of bound about zero that pass near the free minimiser, on its wrong side, and twice each.
        for _ in 0..count {
            let mut a = programme.direction(rng);
            let along = programme.dot(&a, &far) / programme.dot(&far, &far);
            for i in 0..n {
                a[i] -= along * far[i];
            }
            let b = rng.within(0.0, 0.1);
            programme.rows.push(Row { a, b });
            programme.rows.push(Row { a: a.map(|x| 0.3 * x), b: 0.3 * b });
        }
        let solution = programme.solve();
        prop_assert_eq!(solution.status, QpStatus::Solved, "{} changes", solution.changes);
        programme.kkt(&solution)?;
    }
}

#[test]
fn qp_rows_of_zeros() {
    let mut programme = Programme::new(&mut Rng(1), 4);
    let free = programme.solve();
    for (b, status) in [
        (0.0, QpStatus::Solved),
        (-1.0, QpStatus::Solved),
        (-0.0, QpStatus::Solved),
        (1.0, QpStatus::Infeasible),
        (1e-6, QpStatus::Infeasible),
    ] {
        programme.rows = vec![Row { a: [0.0; MAX_VARIABLES], b }];
        let solution = programme.solve();
        assert_eq!(solution.status, status, "0 >= {b}");
        if status == QpStatus::Solved {
            assert_eq!((solution.x, solution.active), (free.x, 0));
        }
    }
    programme.rows = vec![Row { a: [0.0; MAX_VARIABLES], b: 0.0 }; 3];
    let mut a = [0.0; MAX_VARIABLES];
    a[0] = 1.0;
    programme.rows.push(Row { a, b: 5.0 });
    let solution = programme.solve();
    assert_eq!((solution.status, solution.active), (QpStatus::Solved, 1));
    assert!((solution.x[0] - 5.0).abs() < 1e-12);
}

#[test]
fn qp_vertices() {
    // A cone of 40 rows with its tip at the origin, the free minimiser far below.
    for n in [2, 3, 5, 16] {
        let mut programme = Programme::new(&mut Rng(n as u64), n);
        programme.h = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        programme.g = std::array::from_fn(|i| if i == 0 { 10.0 } else { 0.0 });
        let rng = &mut Rng(7);
        for _ in 0..40 {
            let mut a = programme.direction(rng);
            a[0] = 1.5 * programme.size(&a);
            programme.rows.push(Row { a, b: 0.0 });
        }
        let solution = programme.solve();
        assert_eq!(solution.status, QpStatus::Solved, "{n} variables, {} changes", solution.changes);
        programme.kkt(&solution).unwrap();
    }
}

#[test]
fn qp_not_convex() {
    let mut programme = Programme::new(&mut Rng(3), 3);
    for bad in [0.0, -1.0, f64::NAN] {
        programme.h[1][1] = bad;
        assert_eq!(programme.solve().status, QpStatus::NotConvex, "{bad}");
    }
}

/// Records the worst number of changes over many programmes of the largest size.
#[test]
fn qp_changes() {
    let mut most = 0;
    for seed in 0..2000u64 {
        let rng = &mut Rng(seed);
        let n = 2 + rng.below(15);
        let programme = feasible(rng, n, 40, seed % 2 == 0);
        let solution = programme.solve();
        assert_eq!(solution.status, QpStatus::Solved, "seed {seed}");
        most = most.max(solution.changes);
    }
    println!("most changes of a programme of up to 16 variables and 40 rows: {most} (bound 200)");
    assert!(most <= 150, "{most}");
}
