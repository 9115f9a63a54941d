//! The small dense linear algebra by the properties that define it.

use std::f64::consts::PI;

use crate::common::{Rng, distance, rngs};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use redundancy::error::Error;
use redundancy::internals::linalg::{Cholesky, Orthogonal, Rows6, Svd, diagonalise};
use redundancy::kinematics::{forward, jacobian};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::{cross, dot, norm, perpendicular, scale};
use redundancy::robot::{Robot, UrdfChain};

const C: usize = 16;
const EPS: f64 = f64::EPSILON;

/// Random orthonormal columns.
fn orthonormal(rng: &mut Rng, rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| rng.within(-1.0, 1.0)).qr().q()
}

/// An m x n matrix with singular values from 1 down to 1/kappa, by rows and as a matrix.
fn conditioned(rng: &mut Rng, n: usize, m: usize, kappa: f64) -> (Rows6<C>, DMatrix<f64>) {
    let values: Vec<f64> = (0..m)
        .map(|i| match i {
            0 => 1.0,
            _ if i == m - 1 => 1.0 / kappa,
            _ => kappa.powf(-rng.within(0.0, 1.0)),
        })
        .collect();
    let a = orthonormal(rng, m, m) * DMatrix::from_diagonal(&DVector::from_vec(values)) * orthonormal(rng, n, m).transpose();
    (rows_of(&a), a)
}

fn rows_of(a: &DMatrix<f64>) -> Rows6<C> {
    std::array::from_fn(|r| std::array::from_fn(|i| if i < a.ncols() && r < a.nrows() { a[(r, i)] } else { 0.0 }))
}

/// The leading rows and columns.
fn matrix<const R: usize, const K: usize>(rows: &[[f64; K]; R], n: usize, m: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, m, |i, j| rows[i][j])
}

fn shapes() -> impl Strategy<Value = (usize, usize)> {
    (1usize..=6).prop_flat_map(|m| (m..=C, Just(m)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pseudo_inverse_and_null_space(seed in rngs(), (n, m) in shapes(), digits in 0.0..10.0f64, size in -100.0..100.0f64) {
        let rng = &mut Rng(seed);
        let kappa = if m == 1 { 1.0 } else { 10f64.powf(digits) };
        let size = 2f64.powf(size.round());
        let (_, a) = conditioned(rng, n, m, kappa);
        let a = a * size;
        let factors = Orthogonal::<C>::new(&rows_of(&a), n, m);
        prop_assert!(factors.has_full_rank());
        let p = matrix(&factors.pseudo_inverse(), m, n).transpose();
        let unit = 50.0 * EPS * kappa;
        // Moore and Penrose, each relative to the sizes that meet in it: |A| = size, |P| = kappa / size.
        let (ap, pa) = (&a * &p, &p * &a);
        prop_assert!((&ap - DMatrix::identity(m, m)).norm() <= unit * kappa.min(1e3), "A P = 1 within {:e} of eps kappa", (&ap - DMatrix::identity(m, m)).norm() / unit);
        prop_assert!((&ap * &a - &a).norm() <= unit * size, "A P A = A");
        prop_assert!((&pa * &p - &p).norm() <= unit * kappa / size, "P A P = P");
        prop_assert!((&pa - pa.transpose()).norm() <= unit, "P A symmetric: {:e}", (&pa - pa.transpose()).norm() / unit);
        let volume = a.clone().singular_values().iter().product::<f64>();
        prop_assert!((factors.volume() - volume).abs() <= unit * volume);
        prop_assert!(factors.spread() <= 1.0 && factors.spread() >= 0.1 / kappa);

        let basis = matrix(&factors.null_space(), n - m, n);
        let gram = &basis * basis.transpose();
        prop_assert!((gram - DMatrix::identity(n - m, n - m)).norm() <= 20.0 * EPS * (n as f64), "orthonormal");
        prop_assert!((&a * basis.transpose()).norm() <= unit * size, "annihilated to {:e} of eps kappa", (&a * basis.transpose()).norm() / size / unit);
    }

    #[test]
    fn exact_and_general_capacities(seed in rngs()) {
        let (general, _) = conditioned(&mut Rng(seed), 6, 6, 100.0);
        let special: Rows6<6> = std::array::from_fn(|r| std::array::from_fn(|i| general[r][i]));
        let (a, b) = (Orthogonal::<C>::new(&general, 6, 6).pseudo_inverse(), Orthogonal::<6>::new(&special, 6, 6).pseudo_inverse());
        prop_assert!((matrix(&a, 6, 6) - matrix(&b, 6, 6)).norm() <= 1e-11);
    }

    #[test]
    fn dependent_rows_are_seen(seed in rngs(), (n, m) in shapes()) {
        prop_assume!(m > 1);
        let rng = &mut Rng(seed);
        let (mut rows, _) = conditioned(rng, n, m, 10.0);
        rows[m - 1] = rows[rng.below(m - 1)].map(|x| 2.0 * x);
        prop_assert!(!Orthogonal::<C>::new(&rows, n, m).has_full_rank());
        let svd = Svd::<C>::new(&rows, n, m);
        prop_assert!(svd.sigma[m - 1] <= 10.0 * EPS * svd.sigma[0]);
        // More rows than columns never have full rank.
        let (mut narrow, _) = conditioned(rng, m, m, 10.0);
        narrow.iter_mut().for_each(|row| row[m - 1] = 0.0);
        prop_assert!(!Orthogonal::<C>::new(&narrow, m - 1, m).has_full_rank());
    }

    #[test]
    fn singular_values_and_vectors(seed in rngs(), (n, m) in shapes(), digits in 0.0..15.0f64) {
        let kappa = if m == 1 { 1.0 } else { 10f64.powf(digits) };
        let (rows, a) = conditioned(&mut Rng(seed), n, m, kappa);
        let svd = Svd::<C>::new(&rows, n, m);
        let u = DMatrix::from_fn(m, m, |r, i| svd.u[i][r]);
        let v = matrix(&svd.v, m, n).transpose();
        let sigma = DMatrix::from_diagonal(&DVector::from_column_slice(&svd.sigma[..m]));
        prop_assert!((0..m).all(|i| svd.sigma[i] >= 0.0) && (1..m).all(|i| svd.sigma[i] <= svd.sigma[i - 1]), "order");
        prop_assert!((&u * &sigma * v.transpose() - &a).norm() <= 100.0 * EPS, "reconstruction");
        prop_assert!((u.transpose() * &u - DMatrix::identity(m, m)).norm() <= 100.0 * EPS, "U orthogonal");
        prop_assert!((v.transpose() * &v - DMatrix::identity(m, m)).norm() <= 100.0 * EPS, "V orthogonal");
        let null = matrix(&svd.null_space(), n - m, n);
        prop_assert!((&null * &v).norm() <= 100.0 * EPS && (&null * null.transpose() - DMatrix::identity(n - m, n - m)).norm() <= 100.0 * EPS);
        let expected = a.singular_values();
        for i in 0..m {
            prop_assert!((svd.sigma[i] - expected[i]).abs() <= 50.0 * EPS, "{} {}", svd.sigma[i], expected[i]);
        }
    }

    /// Rows of very different lengths, otherwise well conditioned: one-sided Jacobi keeps the relative accuracy of every singular value.
    #[test]
    fn graded_singular_values(seed in rngs(), (n, m) in shapes(), spread in 0.0..8.0f64) {
        let rng = &mut Rng(seed);
        let (_, b) = conditioned(rng, n, m, 5.0);
        // Integers by powers of two: the product of graded singular values is that of the determinant, computed without cancellation.
        let grades: Vec<f64> = (0..m).map(|i| 2f64.powf((-spread * i as f64).round())).collect();
        let a = DMatrix::from_diagonal(&DVector::from_column_slice(&grades)) * &b;
        let sigma = Svd::<C>::new(&rows_of(&a), n, m).sigma;
        let product: f64 = sigma[..m].iter().product();
        let expected = grades.iter().product::<f64>() * b.singular_values().iter().product::<f64>();
        prop_assert!((product / expected - 1.0).abs() <= 1e-13, "relative {:e}", product / expected - 1.0);
        // Each within the factors by which grading can move it (Ostrowski), smallest included.
        for i in 0..m {
            prop_assert!(sigma[i] <= grades[i] * 1.0000001 && sigma[i] >= grades[i] / 5.0000001 || i > 0, "{sigma:?} {grades:?}");
        }
        prop_assert!(sigma[m - 1] <= grades[m - 1] * 1.0000001 && sigma[m - 1] >= grades[m - 1] / 5.0000001, "{sigma:?} {grades:?}");
        // The same matrix by rows in another order has the same values to the last digits, relative to each.
        let shuffled = DMatrix::from_fn(m, n, |r, i| a[(m - 1 - r, i)]);
        let again = Svd::<C>::new(&rows_of(&shuffled), n, m).sigma;
        for i in 0..m {
            prop_assert!((again[i] / sigma[i] - 1.0).abs() <= 1e-13, "{} {}", again[i], sigma[i]);
        }
    }

    #[test]
    fn symmetric_eigenvalues(seed in rngs(), n in 1usize..=16, size in -100.0..100.0f64, repeated in any::<bool>()) {
        let rng = &mut Rng(seed);
        let size = 10f64.powf(size);
        let values: Vec<f64> = (0..n).map(|i| if repeated { f64::from((i % 3) as u8) - 1.0 } else { rng.within(-1.0, 1.0) }).collect();
        let q = orthonormal(rng, n, n);
        let a = &q * DMatrix::from_diagonal(&DVector::from_vec(values.clone())) * q.transpose() * size;
        let mut inside: [[f64; C]; C] = std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { a[(i.min(j), i.max(j))] } else { 7.0 }));
        let mut vectors = [[0.0; C]; C];
        diagonalise(&mut inside, &mut vectors, n);
        let v = matrix(&vectors, n, n);
        let d = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| inside[i][i]));
        prop_assert!((v.transpose() * &v - DMatrix::identity(n, n)).norm() <= 100.0 * EPS * n as f64);
        prop_assert!((&v * &d * v.transpose() - &a).norm() <= 100.0 * EPS * size * n as f64);
        let mut got: Vec<f64> = (0..n).map(|i| inside[i][i]).collect();
        let mut expected: Vec<f64> = values.iter().map(|x| size * x).collect();
        got.sort_by(f64::total_cmp);
        expected.sort_by(f64::total_cmp);
        prop_assert!(distance(&got, &expected) <= 100.0 * EPS * size * n as f64);
    }

    #[test]
    fn cholesky(seed in rngs(), n in 1usize..=16, digits in 0.0..10.0f64) {
        let rng = &mut Rng(seed);
        let values: Vec<f64> = (0..n).map(|i| if i == 0 { 1.0 } else { 10f64.powf(-digits * rng.within(0.0, 1.0)) }).collect();
        let kappa = 1.0 / values.iter().fold(1.0f64, |m, x| m.min(*x));
        let q = orthonormal(rng, n, n);
        let a = &q * DMatrix::from_diagonal(&DVector::from_vec(values.clone())) * q.transpose();
        let inside: [[f64; C]; C] = std::array::from_fn(|i| std::array::from_fn(|j| if i < n && j < n { a[(i.max(j), i.min(j))] } else { f64::NAN }));
        let factor = Cholesky::new(&inside, n).unwrap();
        let b: [f64; C] = std::array::from_fn(|i| if i < n { rng.within(-1.0, 1.0) } else { 0.0 });
        let x = factor.solve(&b);
        let residual: Vec<f64> = (0..n).map(|i| (0..n).map(|j| inside[i.max(j)][i.min(j)] * x[j]).sum::<f64>() - b[i]).collect();
        let size = crate::common::length(&x[..n]);
        prop_assert!(crate::common::length(&residual) <= 100.0 * EPS * (size + 1.0), "{residual:?}");
        // |L^-1 b|^2 = b' A^-1 b, and solve is backward after forward.
        let half = factor.forward(&b);
        let energy: f64 = (0..n).map(|i| b[i] * x[i]).sum();
        prop_assert!((half[..n].iter().map(|v| v * v).sum::<f64>() - energy).abs() <= 1e3 * EPS * kappa * energy);
        prop_assert_eq!(factor.backward(&half), x);

        let mut indefinite = inside;
        let last = n - 1;
        indefinite[last][last] -= 1.0 + 1e-6;
        prop_assert!(Cholesky::new(&indefinite, n).is_none() || a[(last, last)] > 1.0, "not positive definite");
        indefinite[last][last] = f64::NAN;
        prop_assert!(Cholesky::new(&indefinite, n).is_none());
    }

    #[test]
    fn frames(seed in rngs()) {
        let rng = &mut Rng(seed);
        let (a, b) = (rng.frame(), rng.frame());
        let same = Frame::from_matrix("tool", &a.matrix()).unwrap();
        prop_assert!(distance(&same.matrix(), &a.matrix()) <= 8.0 * EPS);
        let identity = a.compose(&a.inverse());
        prop_assert!(distance(&identity.matrix(), &Frame::IDENTITY.matrix()) <= 16.0 * EPS);
        let (ab, ma, mb) = (a.compose(&b).matrix(), a.matrix(), b.matrix());
        for r in 0..4 {
            for c in 0..4 {
                let sum: f64 = (0..4).map(|k| ma[4 * r + k] * mb[4 * k + c]).sum();
                prop_assert!((ab[4 * r + c] - sum).abs() <= 8.0 * EPS);
            }
        }
        let v = rng.direction();
        prop_assert!(distance(&a.unrotate(a.rotate(v)), &v) <= 8.0 * EPS);
        // A little off is made orthogonal again, more is refused.
        let mut off = a.matrix();
        off[1] += 3e-7;
        let mended = Frame::from_matrix("tool", &off).unwrap();
        prop_assert!((dot(mended.axes[0], mended.axes[1])).abs() <= 4.0 * EPS && (norm(mended.axes[2]) - 1.0).abs() <= 4.0 * EPS);
        prop_assert!(distance(&cross(mended.axes[0], mended.axes[1]), &mended.axes[2]) <= 8.0 * EPS);
        off[rng.below(3) * 4 + rng.below(3)] += 1e-3;
        prop_assert!(Frame::from_matrix("tool", &off).is_err());
    }

    #[test]
    fn perpendicular_to_anything(seed in rngs(), tilt in -20.0..0.0f64, down in any::<bool>()) {
        let rng = &mut Rng(seed);
        let near = [10f64.powf(tilt) * rng.within(-1.0, 1.0), 10f64.powf(tilt) * rng.within(-1.0, 1.0), if down { -1.0 } else { 1.0 }];
        for e in [rng.direction(), scale(1.0 / norm(near), near)] {
            let (a, b) = perpendicular(e);
            for defect in [dot(a, b), dot(a, e), dot(b, e), norm(a) - 1.0, norm(b) - 1.0] {
                prop_assert!(defect.abs() <= 8.0 * EPS, "{e:?} {defect:e}");
            }
            prop_assert!(distance(&cross(a, b), &e) <= 16.0 * EPS, "left-handed at {e:?}");
        }
    }

    /// Axis directions of every kind, those within rounding of +-z included: the joint turns about its axis and is at rest at 0.
    #[test]
    fn urdf_axes(seed in rngs(), tilt in -18.0..0.0f64, kind in 0usize..3, length in -3.0..3.0f64) {
        let rng = &mut Rng(seed);
        let tilted = |z: f64, rng: &mut Rng| [10f64.powf(tilt) * rng.within(-1.0, 1.0), 10f64.powf(tilt) * rng.within(-1.0, 1.0), z];
        let axis = match kind {
            0 => rng.direction(),
            1 => tilted(1.0, rng),
            _ => tilted(-1.0, rng),
        };
        urdf_axis(scale(10f64.powf(length), axis))?;
    }

    /// Tilts so small that their squares underflow.
    #[test]
    fn urdf_axes_with_tiny_tilts(tilt in -320.0..-18.0f64, x in -1.0..1.0f64, down in any::<bool>()) {
        urdf_axis([10f64.powf(tilt) * x, 0.0, if down { -1.0 } else { 1.0 }])?;
    }
}

/// One joint about `axis`, with a tool at (0.3, 0.2, 0.1).
fn urdf_axis(axis: [f64; 3]) -> Result<(), TestCaseError> {
    let text = format!(
        r#"<robot name="one"><link name="a"/><link name="b"/><link name="c"/>
        <joint name="j" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0" rpy="0 0 0"/><axis xyz="{:e} {:e} {:e}"/></joint>
        <joint name="t" type="fixed"><parent link="b"/><child link="c"/><origin xyz="0.3 0.2 0.1" rpy="0 0 0"/></joint></robot>"#,
        axis[0], axis[1], axis[2]
    );
    let robot = Robot::from_urdf_str(&text, &UrdfChain::default()).map_err(|e| TestCaseError::fail(e.to_string()))?;
    prop_assert_eq!(robot.n(), 1);
    let unit = scale(1.0 / norm(axis), axis);
    let rest = forward(&robot, &[0.0]).unwrap();
    prop_assert!(
        distance(&rest.matrix(), &Frame::translation([0.3, 0.2, 0.1]).matrix()) <= 8.0 * EPS,
        "not at rest about {axis:?}: {rest:?}"
    );
    let (_, columns) = jacobian(&robot, &[0.7]).unwrap();
    prop_assert!(distance(&columns.w[0], &unit) <= 8.0 * EPS, "turns about {:?} in place of {unit:?}", columns.w[0]);
    let turned = forward(&robot, &[0.7]).unwrap();
    let expected = Frame::rotation(unit, 0.7).compose(&Frame::translation([0.3, 0.2, 0.1]));
    prop_assert!(distance(&turned.matrix(), &expected.matrix()) <= 16.0 * EPS, "{axis:?}");
    Ok(())
}

#[test]
fn urdf_axes_of_the_frame() {
    for (i, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
        let mut axis = [0.0; 3];
        axis[i] = sign;
        urdf_axis(axis).unwrap();
        // A signed zero is a zero.
        urdf_axis(axis.map(|x| if x == 0.0 { -0.0 } else { x })).unwrap();
    }
}

#[test]
fn matrices_that_are_no_frames() {
    let good = Frame::rotation([0.6, 0.0, 0.8], 0.5).matrix();
    let refused = |matrix: &[f64]| Frame::from_matrix("base", matrix).unwrap_err();
    assert!(Frame::from_matrix("base", &good).is_ok());
    for n in [0, 9, 12, 15, 17] {
        assert!(matches!(refused(&vec![0.0; n]), Error::Shape { .. }));
    }
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for i in 0..16 {
            let mut matrix = good;
            matrix[i] = bad;
            assert!(matches!(refused(&matrix), Error::NonFinite { index, .. } if index == i));
        }
    }
    for i in 12..16 {
        let mut matrix = good;
        matrix[i] += 1e-9;
        assert!(matches!(refused(&matrix), Error::Value { .. }), "last row");
    }
    let change = |f: &dyn Fn(usize, usize) -> f64| -> [f64; 16] { std::array::from_fn(|i| f(i / 4, i % 4)) };
    let mirrored = change(&|r, c| if c == 0 && r < 3 { -good[4 * r + c] } else { good[4 * r + c] });
    let stretched = change(&|r, c| if r < 3 && c < 3 { 1.001 * good[4 * r + c] } else { good[4 * r + c] });
    let zero = change(&|r, c| if r < 3 && c < 3 { 0.0 } else { good[4 * r + c] });
    let huge = change(&|r, c| if r < 3 && c < 3 { 1e200 * good[4 * r + c] } else { good[4 * r + c] });
    let collapsed = change(&|r, c| if r < 3 && c == 1 { good[4 * r] } else { good[4 * r + c] });
    for matrix in [mirrored, stretched, zero, huge, collapsed] {
        assert!(matches!(refused(&matrix), Error::Value { .. }), "{matrix:?}");
    }
    // A half turn, exactly.
    let half = Frame::rotation([0.0, 0.0, 1.0], PI);
    assert_eq!(half.axes, [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]);
}
