//! Exact derivatives against central differences: kinematics, and every index in joints and length, on random robots.

use std::sync::Mutex;

use crate::common::{Rng, derivative, distance, evaluate, indices, length, rngs, singular_values};
use proptest::prelude::*;
use redundancy::index::{Index, Kind, Objective, OfJacobian, Order, Rows, Status};
use redundancy::internals::index::Evaluation;
use redundancy::kinematics::{first_derivative, forward, jacobian, jacobian_into, jacobian_rate, link_frames, second_derivative};
use redundancy::linalg::vector::{cross, scale};
use redundancy::robot::Robot;
use redundancy::with_capacity;

const C: usize = 16;

fn moved(q: &[f64], k: usize, h: f64) -> Vec<f64> {
    let mut q = q.to_vec();
    q[k] += h;
    q
}

fn posture(rng: &mut Rng, robot: &Robot) -> Vec<f64> {
    let limits = robot.limits();
    (0..robot.n())
        .map(|i| {
            let (low, high) = (limits.q_min[i].max(-3.0), limits.q_max[i].min(3.0));
            rng.within(low + 0.1 * (high - low), high - 0.1 * (high - low))
        })
        .collect()
}

fn flat_jacobian(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; 6 * robot.n()];
    jacobian_into(robot, q, &mut out).unwrap();
    out
}

fn flat_derivative(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let n = robot.n();
    let mut out = vec![0.0; 6 * n * n];
    first_derivative(robot, q, &mut out).unwrap();
    out
}

/// Differences against exact values: within the plateau's own uncertainty and `tolerance` times the size.
fn check(what: &str, exact: &[f64], (estimate, change): &(Vec<f64>, f64), size: f64, tolerance: f64) -> Result<(), TestCaseError> {
    let error = distance(exact, estimate);
    prop_assert!(error.is_finite(), "{what}: {exact:?} {estimate:?}");
    // A plateau too rough to judge by would hide an error: it is one itself.
    prop_assert!(*change <= tolerance * size, "{what}: no plateau, {change:e} of {size:e}");
    prop_assert!(error <= tolerance * size, "{what}: off by {error:e} of {size:e}\n{exact:?}\n{estimate:?}");
    note(what, error / size);
    Ok(())
}

static WORST: Mutex<Vec<(String, f64)>> = Mutex::new(Vec::new());

/// Keeps the worst relative error of every kind of check, shown with --nocapture.
fn note(what: &str, error: f64) {
    let mut worst = WORST.lock().unwrap();
    match worst.iter_mut().find(|(name, _)| name == what) {
        Some((_, value)) if *value >= error => {}
        Some((_, value)) => {
            *value = error;
            println!("worst {what}: {error:.1e}");
        }
        None => worst.push((what.into(), error)),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn kinematics(seed in rngs(), n in 1usize..=12) {
        let rng = &mut Rng(seed);
        let robot = rng.robot(n, true, 0);
        let q = posture(rng, &robot);
        let (tool, columns) = jacobian(&robot, &q).unwrap();
        let alone = forward(&robot, &q).unwrap();
        prop_assert!(distance(&tool.matrix(), &alone.matrix()) <= 1e-14, "forward and jacobian disagree");
        let last = link_frames(&robot, &q).unwrap()[n];
        prop_assert!(distance(&tool.matrix(), &last.matrix()) <= 1e-13, "forward and link_frames disagree");
        let size = 1.0 + length(&flat_jacobian(&robot, &q));

        // Columns of J: the origin's derivative, and half the sum of axis x its derivative.
        for k in 0..n {
            let estimate = derivative(|h| {
                let at = forward(&robot, &moved(&q, k, h)).unwrap();
                at.axes.iter().flatten().chain(&at.origin).copied().collect()
            }, 0.1);
            let axis_rate = |c: usize| [estimate.0[3 * c], estimate.0[3 * c + 1], estimate.0[3 * c + 2]];
            let mut twist = vec![0.0; 3];
            for c in 0..3 {
                for (sum, x) in twist.iter_mut().zip(scale(0.5, cross(tool.axes[c], axis_rate(c)))) {
                    *sum += x;
                }
            }
            twist.extend_from_slice(&estimate.0[9..12]);
            check("Jacobian", &columns.column(k), &(twist, estimate.1), size, 1e-11)?;
        }

        // dJ/dq and d2J/dq2.
        let first = flat_derivative(&robot, &q);
        let mut second = vec![0.0; 6 * n * n * n];
        second_derivative(&robot, &q, &mut second).unwrap();
        for k in 0..n {
            let slice = |all: &[f64]| (0..all.len() / n).map(|j| all[j * n + k]).collect::<Vec<_>>();
            check("dJ/dq", &slice(&first), &derivative(|h| flat_jacobian(&robot, &moved(&q, k, h)), 0.1), size, 1e-11)?;
            check("d2J/dq2", &slice(&second), &derivative(|h| flat_derivative(&robot, &moved(&q, k, h)), 0.1), size * n as f64, 1e-11)?;
        }

        // dJ/dt, by differences along the motion and by contraction.
        let rates: Vec<f64> = (0..n).map(|_| rng.within(-2.0, 2.0)).collect();
        let mut rate = vec![0.0; 6 * n];
        jacobian_rate(&robot, &q, &rates, &mut rate).unwrap();
        let contracted: Vec<f64> = (0..6 * n).map(|j| (0..n).map(|k| first[j * n + k] * rates[k]).sum()).collect();
        prop_assert!(distance(&rate, &contracted) <= 1e-14 * size * n as f64 * length(&rates).max(1.0));
        let along = derivative(|h| flat_jacobian(&robot, &(0..n).map(|i| q[i] + h * rates[i]).collect::<Vec<_>>()), 0.03);
        check("dJ/dt", &rate, &along, size * (1.0 + length(&rates)) * n as f64, 1e-11)?;
    }
}

fn of(index: &Index) -> Objective {
    Objective::new(vec![(1.0, index.clone())]).unwrap()
}

fn rows_hessian(got: &Evaluation<C>, n: usize) -> Vec<f64> {
    got.hessian[..n].iter().flat_map(|row| row[..n].to_vec()).collect()
}

/// The smallest relative gap between singular values that the index tells apart.
fn gap(index: &Index, sigma: &[f64]) -> f64 {
    let m = sigma.len();
    let at = |i: usize| (sigma[i] - sigma[i + 1]) / sigma[i];
    match index {
        Index::OfJacobian(OfJacobian { kind, .. }) if m > 1 => match kind {
            Kind::SmallestSingularValue => at(m - 2),
            Kind::SpectralConditionNumber | Kind::SingularityParameter => at(0).min(at(m - 2)),
            Kind::ConditionNumber | Kind::Manipulability => 1.0,
        },
        _ => 1.0,
    }
}

/// A posture and its robot, away from singularities.
struct Sample {
    robot: Robot,
    q: Vec<f64>,
    rows: Rows,
    /// Singular values of the rows in use.
    sigma: Vec<f64>,
    /// The larger of kappa and how far J_n changes a radian or metre, over the smallest singular value.
    kappa: f64,
}

/// A posture, rows and length at which kappa stays below 1e3.
fn well_conditioned(rng: &mut Rng, n: usize) -> Option<Sample> {
    let robot = rng.robot(n, true, n / 3);
    let count = 1 + rng.below(n.min(6));
    // The full set of rows as often as all others.
    let rows = if n >= 6 && rng.below(2) == 0 { rng.rows(6) } else { rng.rows(count) };
    let rows = Rows::new(&rows, rng.within(0.1, 2.0)).unwrap();
    for _ in 0..10 {
        let q = posture(rng, &robot);
        let sigma = singular_values(&robot, &rows, &q);
        // A robot of one row has kappa = 1 even beside a singularity.
        let change = length(&flat_derivative(&robot, &q)) * rows.length.max(1.0);
        let kappa = sigma[0].max(change) / sigma[sigma.len() - 1];
        if kappa < 1e3 {
            return Some(Sample { robot, q, rows, sigma, kappa });
        }
    }
    None
}

fn check_index(index: &Index, Sample { robot, q, rows, sigma, kappa }: &Sample) -> Result<(), TestCaseError> {
    let (n, kappa) = (robot.n(), *kappa);
    let objective = of(index);
    let (value, gradient) = (
        |q: &[f64]| evaluate::<C>(&objective, robot, q, Order::Value, false),
        |q: &[f64]| evaluate::<C>(&objective, robot, q, Order::Gradient, true),
    );
    let got = evaluate::<C>(&objective, robot, q, Order::Hessian, true);
    prop_assert_eq!(got.status, Status::Regular);
    let name = index.name();
    let closeness = gap(index, sigma);
    // What lower orders say is the same.
    prop_assert!((value(q).value - got.value).abs() <= 1e-14 * got.value.abs());
    let middle = gradient(q);
    prop_assert!(distance(&middle.gradient[..n], &got.gradient[..n]) <= 1e-13 * (1.0 + length(&got.gradient[..n])));
    for k in 0..n {
        for l in 0..n {
            prop_assert!(got.hessian[k][l] == got.hessian[l][k], "not symmetric");
        }
    }

    // The function changes over distances of 1/kappa and of the gap.
    let widest = 0.2 * (1.0 / kappa).max(1e-3) * closeness;
    let mut exact = Vec::new();
    let mut estimate = (Vec::new(), 0.0f64);
    let mut hessian = (vec![0.0; n * n], 0.0f64);
    for k in 0..n {
        let (slope, change) = derivative(|h| vec![value(&moved(q, k, h)).value], widest);
        exact.push(got.gradient[k]);
        estimate.0.push(slope[0]);
        estimate.1 = estimate.1.max(change);
        let (row, change) = derivative(|h| gradient(&moved(q, k, h)).gradient[..n].to_vec(), widest);
        hessian.0[k * n..(k + 1) * n].copy_from_slice(&row);
        hessian.1 = hessian.1.max(change);
    }
    let size = length(&exact) + got.value.abs() * kappa;
    check(&format!("{name} gradient"), &exact, &estimate, size, 1e-8)?;
    let exact = rows_hessian(&got, n);
    let size_hessian = length(&exact) + size * kappa / closeness;
    check(&format!("{name} Hessian"), &exact, &hessian, size_hessian, 1e-8)?;

    // In the length: its logarithm is the natural variable.
    let at = |h: f64| objective.with_length(rows.length + h);
    let widest = 0.2 * rows.length * closeness;
    let slope = derivative(|h| vec![evaluate::<C>(&at(h), robot, q, Order::Value, false).value], widest);
    let size_slope = got.value.abs() / rows.length + got.length_slope.abs();
    check(&format!("{name} length slope"), &[got.length_slope], &slope, size_slope, 1e-8)?;
    let again = derivative(
        |h| {
            let got = evaluate::<C>(&at(h), robot, q, Order::Gradient, true);
            [&[got.length_slope * kappa], &got.gradient[..n]].concat()
        },
        widest,
    );
    let exact = [&[got.length_curvature * kappa], &got.length_gradient[..n]].concat();
    check(&format!("{name} length"), &exact, &again, length(&exact) + size / rows.length / closeness, 1e-8)?;
    prop_assert!(distance(&middle.length_gradient[..n], &got.length_gradient[..n]) <= 1e-12 * (1.0 + length(&got.length_gradient[..n])));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 192, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_index(seed in rngs(), n in 1usize..=12) {
        let rng = &mut Rng(seed);
        let Some(sample) = well_conditioned(rng, n) else { return Ok(()) };
        for index in indices(sample.rows) {
            if gap(&index, &sample.sigma) > 0.02 {
                check_index(&index, &sample)?;
            }
        }
    }

    /// The paths of all capacities differ by rounding only.
    #[test]
    fn capacities_agree(seed in rngs(), n in prop_oneof![1usize..=12, Just(6usize), Just(7usize)]) {
        let rng = &mut Rng(seed);
        let Some(Sample { robot, q, rows, sigma, kappa }) = well_conditioned(rng, n) else { return Ok(()) };
        for index in indices(rows) {
            let objective = of(&index);
            let general = flatten(&evaluate::<16>(&objective, &robot, &q, Order::Hessian, true), n);
            let special = with_capacity!(n, evaluated(&objective, &robot, &q));
            // Near a coincidence of singular values the differences of vectors grow.
            let unit = f64::EPSILON * kappa / gap(&index, &sigma).powi(2);
            for (a, b) in general.iter().zip(&special) {
                let (error, size) = (distance(a, b), length(a) + 1e-3 * length(&general[2]));
                if size > 0.0 {
                    note("capacities, over eps kappa", error / size / unit);
                }
                prop_assert!(error <= 1e3 * unit * size, "{index:?}: {a:?} {b:?}");
            }
            if n == 7 {
                let exact = flatten(&evaluate::<7>(&objective, &robot, &q, Order::Hessian, true), n);
                for (a, b) in general.iter().zip(&exact) {
                    prop_assert!(distance(a, b) <= 1e3 * unit * (length(a) + 1e-3 * length(&general[2])), "{index:?}: {a:?} {b:?}");
                }
            }
        }
    }

    /// A sum has the sums of its terms' derivatives.
    #[test]
    fn sums(seed in rngs(), n in 3usize..=9) {
        let rng = &mut Rng(seed);
        let Some(Sample { robot, q, rows, .. }) = well_conditioned(rng, n) else { return Ok(()) };
        let terms: Vec<(f64, Index)> = indices(rows).into_iter().map(|index| (rng.within(-2.0, 2.0), index)).collect();
        let sum = evaluate::<C>(&Objective::new(terms.clone()).unwrap(), &robot, &q, Order::Hessian, true);
        prop_assume!(sum.status == Status::Regular);
        let sum = flatten(&sum, n);
        let mut expected = sum.clone().map(|part| vec![0.0; part.len()]);
        for (weight, index) in &terms {
            let term = flatten(&evaluate::<C>(&of(index), &robot, &q, Order::Hessian, true), n);
            expected.iter_mut().flatten().zip(term.iter().flatten()).for_each(|(total, x)| *total += weight * x);
        }
        for (a, b) in sum.iter().zip(&expected) {
            prop_assert!(distance(a, b) <= 1e-14 * length(b), "{a:?} {b:?}");
        }
    }
}

fn evaluated<const C: usize>(objective: &Objective, robot: &Robot, q: &[f64]) -> [Vec<f64>; 6] {
    flatten(&evaluate::<C>(objective, robot, q, Order::Hessian, true), q.len())
}

fn flatten<const C: usize>(got: &Evaluation<C>, n: usize) -> [Vec<f64>; 6] {
    [
        vec![got.value],
        got.gradient[..n].to_vec(),
        got.hessian[..n].iter().flat_map(|row| row[..n].to_vec()).collect(),
        vec![got.length_slope],
        got.length_gradient[..n].to_vec(),
        vec![got.length_curvature],
    ]
}

/// What an index says where it has no derivatives.
#[test]
fn singular_and_outside() {
    let robot = crate::common::fanuc();
    // Wrist stretched: axes 4 and 6 in line.
    let q = [0.3, 0.2, 0.4, 0.7, 0.0, -0.2];
    for index in indices(Rows::all(0.5).unwrap()) {
        let got = evaluate::<6>(&of(&index), &robot, &q, Order::Hessian, true);
        match index {
            Index::JointLimits(_) | Index::LimitBarrier(_) => assert_eq!(got.status, Status::Regular),
            Index::OfJacobian(OfJacobian { kind: Kind::ConditionNumber, .. }) => {
                assert!(got.value == f64::INFINITY || got.value > 1e14, "{got:?}")
            }
            _ => {}
        }
        if got.status == Status::Singular {
            assert!(got.gradient.iter().chain(got.hessian.iter().flatten()).all(|x| x.is_nan()), "{index:?}");
            assert!(got.value == 0.0 || got.value == f64::INFINITY, "{index:?} {}", got.value);
        }
    }
    let outside = [0.0, 2.0, 0.0, 0.0, 0.5, 0.0];
    let barrier = &indices(Rows::all(0.5).unwrap())[1];
    let got = evaluate::<6>(&of(barrier), &robot, &outside, Order::Hessian, false);
    assert_eq!((got.value, got.status), (f64::INFINITY, Status::OutsideLimits));
    assert!(got.gradient.iter().all(|x| x.is_nan()));
}
