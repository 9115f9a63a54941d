//! Why the small dense algebra is our own: the pseudo-inverse and the singular values of a 6 x 6 and a 6 x 7 matrix, beside nalgebra and
//! faer. Matrices cycle, so that pivoting pays for its branches.

#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use faer::linalg::solvers::{DenseSolveCore, PartialPivLu};
use nalgebra::{DMatrix, SMatrix};
use redundancy::internals::linalg::{Orthogonal, Rows6, Svd};

const MATRICES: usize = 256;

/// A number that looks random: the square keeps the matrices at full rank, where sines of equal steps have rank two.
fn entry(k: usize, r: usize, i: usize) -> f64 {
    (((k * 37 + i * 6 + r) as f64).powi(2) * 12.9898).sin()
}

fn bench<const N: usize, const C: usize>(criterion: &mut Criterion) {
    let ours: Vec<Rows6<C>> =
        (0..MATRICES).map(|k| std::array::from_fn(|r| std::array::from_fn(|i| if i < N { entry(k, r, i) } else { 0.0 }))).collect();
    let fixed: Vec<SMatrix<f64, 6, N>> = (0..MATRICES).map(|k| SMatrix::from_fn(|r, i| entry(k, r, i))).collect();
    let dynamic: Vec<DMatrix<f64>> = (0..MATRICES).map(|k| DMatrix::from_fn(6, N, |r, i| entry(k, r, i))).collect();
    let faers: Vec<faer::Mat<f64>> = (0..MATRICES).map(|k| faer::Mat::from_fn(6, N, |r, i| entry(k, r, i))).collect();
    let mut next = 0;
    let mut pick = move || {
        next = (next + 1) % MATRICES;
        next
    };
    let mut group = criterion.benchmark_group(format!("6x{N}"));
    group.bench_function("pseudo-inverse ours", |b| b.iter(|| Orthogonal::new(black_box(&ours[pick()]), N, 6).pseudo_inverse()));
    group.bench_function("pseudo-inverse nalgebra dynamic QR", |b| {
        b.iter(|| {
            let qr = black_box(&dynamic[pick()]).transpose().qr();
            qr.q() * qr.r().try_inverse().unwrap().transpose()
        })
    });
    group.bench_function("pseudo-inverse faer QR", |b| {
        b.iter(|| {
            let transposed = black_box(&faers[pick()]).transpose().to_owned();
            let qr = transposed.qr();
            qr.compute_thin_Q() * PartialPivLu::new(qr.thin_R()).inverse().transpose()
        })
    });
    if N == 6 {
        group.bench_function("inverse nalgebra fixed LU", |b| {
            b.iter(|| black_box(&fixed[pick()]).fixed_view::<6, 6>(0, 0).into_owned().try_inverse())
        });
        group.bench_function("inverse faer LU", |b| b.iter(|| PartialPivLu::new(black_box(&faers[pick()]).as_ref()).inverse()));
    }
    group.bench_function("SVD ours", |b| b.iter(|| Svd::new(black_box(&ours[pick()]), N, 6)));
    group.bench_function("SVD nalgebra dynamic", |b| {
        b.iter(|| nalgebra::SVD::try_new(black_box(&dynamic[pick()]).clone(), true, true, f64::EPSILON, 100))
    });
    group.bench_function("SVD faer", |b| b.iter(|| black_box(&faers[pick()]).svd()));
    group.finish();
}

fn both(criterion: &mut Criterion) {
    bench::<6, 6>(criterion);
    bench::<7, 8>(criterion);
}

criterion_group!(benches, both);
criterion_main!(benches);
