//! Eigenvalues of a small symmetric matrix by Jacobi rotations: bounded sweeps, no allocation.

use super::jacobi::rotation;

/// More sweeps than any matrix of this size needs.
const MAX_SWEEPS: usize = 30;

/// Diagonalises the leading n x n block of `a` in place: on return its diagonal holds the eigenvalues, and column `i` of `vectors` the unit
/// eigenvector of entry `i`.
pub fn diagonalise<const C: usize>(a: &mut [[f64; C]; C], vectors: &mut [[f64; C]; C], n: usize) {
    for i in 0..n {
        for j in 0..n {
            vectors[i][j] = f64::from(u8::from(i == j));
        }
    }
    for _ in 0..MAX_SWEEPS {
        let mut off = 0.0f64;
        let mut scale = 0.0f64;
        for i in 0..n {
            scale = scale.max(a[i][i].abs());
            for j in i + 1..n {
                off = off.max(a[i][j].abs());
            }
        }
        if off <= 0.25 * f64::EPSILON * scale || !off.is_finite() {
            return;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(a, vectors, n, p, q);
            }
        }
    }
}

#[inline(always)]
fn rotate<const C: usize>(a: &mut [[f64; C]; C], vectors: &mut [[f64; C]; C], n: usize, p: usize, q: usize) {
    let apq = a[p][q];
    if apq == 0.0 {
        return;
    }
    let (difference, twice) = (a[q][q] - a[p][p], 2.0 * apq);
    let size = difference.abs().max(twice.abs());
    let (c, s, _) = rotation(difference / size, twice / size);
    for i in 0..n {
        let (x, y) = (a[i][p], a[i][q]);
        a[i][p] = c * x - s * y;
        a[i][q] = s * x + c * y;
    }
    for i in 0..n {
        let (x, y) = (a[p][i], a[q][i]);
        a[p][i] = c * x - s * y;
        a[q][i] = s * x + c * y;
        let (x, y) = (vectors[i][p], vectors[i][q]);
        vectors[i][p] = c * x - s * y;
        vectors[i][q] = s * x + c * y;
    }
}

/// The part of a symmetric matrix with eigenvalues above zero.
#[inline(never)]
pub fn positive_part<const C: usize>(mut a: [[f64; C]; C], n: usize) -> [[f64; C]; C] {
    let mut vectors = [[0.0; C]; C];
    diagonalise(&mut a, &mut vectors, n);
    let mut out = [[0.0; C]; C];
    for k in 0..n {
        let value = a[k][k].max(0.0);
        for i in 0..n {
            for j in 0..n {
                out[i][j] += value * vectors[i][k] * vectors[j][k];
            }
        }
    }
    out
}
