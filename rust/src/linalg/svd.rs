//! Singular values and vectors of a small matrix by one-sided Jacobi rotations: bounded sweeps, high relative accuracy of the small
//! singular values (Demmel and Veselic, 1992), no allocation.
//!
//! A sweep is a tournament: in each of five rounds three pairs of different columns turn, so that the processor works on three chains of
//! square roots and divisions at a time (Brent and Luk, 1985). No branch depends on the numbers.

use super::jacobi::rotation;
use super::orthogonal::{Orthogonal, dot};
use super::{Row6, Rows6, size};

/// More sweeps than any 6 x 6 matrix needs (quadratic convergence sets in after three or four).
const MAX_SWEEPS: usize = 30;

/// Columns whose cosine is at most this are orthogonal to working precision.
const ORTHOGONAL: f64 = f64::EPSILON;

/// A sweep in which no pair has a larger cosine nor turns by a larger tangent than this is the last: what it leaves is of the size of the square.
const LAST: f64 = 1e-8;

/// Matrices whose squared norm is outside of this range are scaled first, because fourth powers are formed on the way.
const UNSCALED: std::ops::Range<f64> = 1e-100..1e100;

/// Squares below this have lost digits: columns so short in comparison to the longest are zero.
const UNDERFLOW: f64 = 1e-290;

/// `A = U diag(sigma) V'` of an m x n matrix, m <= n, sigma decreasing.
#[derive(Debug, Clone, Copy)]
pub struct Svd<const C: usize> {
    n: usize,
    m: usize,
    /// Singular values, decreasing, m of them.
    pub sigma: Row6,
    /// Left vector `i` in row `i`.
    pub u: [Row6; 6],
    /// Right vector `i` < m in row `i`.
    pub v: Rows6<C>,
}

impl<const C: usize> Default for Svd<C> {
    /// Of no matrix yet.
    #[inline(always)]
    fn default() -> Self {
        Self { n: 0, m: 0, sigma: [0.0; 6], u: [[0.0; 6]; 6], v: [[0.0; C]; 6] }
    }
}

impl<const C: usize> Svd<C> {
    /// Of the m x n matrix `a`, by rows.
    #[inline(never)]
    pub fn new(a: &Rows6<C>, n: usize, m: usize) -> Self {
        let n = size::<C>(n);
        let square: f64 = a.iter().map(|row| dot(row, row)).sum();
        if !UNSCALED.contains(&square)
            && let Some(scaled) = Self::scaled(a, n, m)
        {
            return scaled;
        }
        // Rotate the columns of A' until they are orthogonal: A' Y = V S. Then A = Y S V'.
        let mut columns = *a;
        let mut y = [[0.0; 6]; 6];
        for c in 0..m {
            y[c][c] = 1.0;
        }
        orthogonalise(&mut columns, &mut y);
        let sigma = columns.each_ref().map(|column| dot(column, column).sqrt());
        let places = places(&sigma, m);
        let mut out = Self { n, m, ..Self::default() };
        for (from, to) in places.iter().enumerate().take(m) {
            out.sigma[*to] = sigma[from];
            out.u[*to] = y[from];
            if sigma[from] > 0.0 {
                let reciprocal = 1.0 / sigma[from];
                out.v[*to] = columns[from].map(|x| x * reciprocal);
            }
        }
        out
    }

    /// The same of a very large or very small matrix; `None` where there is nothing to scale.
    #[cold]
    fn scaled(a: &Rows6<C>, n: usize, m: usize) -> Option<Self> {
        let largest = a.iter().flatten().fold(0.0f64, |largest, x| largest.max(x.abs()));
        if largest == 0.0 || !a.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let mut out = Self::new(&a.map(|row| row.map(|x| x / largest)), n, m);
        out.sigma = out.sigma.map(|x| x * largest);
        Some(out)
    }

    /// The rest of the right vectors: a basis of the null space, vector `j` in row `j`.
    #[inline(always)]
    pub fn null_space(&self) -> [[f64; C]; C] {
        if self.n == self.m { [[0.0; C]; C] } else { Orthogonal::new(&self.v, self.n, self.m).null_space() }
    }
}

/// The place of each of `m` numbers in decreasing order.
#[inline(always)]
fn places(numbers: &Row6, m: usize) -> [usize; 6] {
    let mut places = [0; 6];
    for i in 0..m {
        for j in i + 1..m {
            let later = usize::from(numbers[j] > numbers[i]);
            places[i] += later;
            places[j] += 1 - later;
        }
    }
    places
}

/// The vectors p and q turned into each other.
#[inline(always)]
fn turn<const C: usize>(vectors: &mut [[f64; C]; 6], p: usize, q: usize, cosine: f64, sine: f64) {
    let (x, z) = (vectors[p], vectors[q]);
    for i in 0..C {
        vectors[p][i] = cosine * x[i] - sine * z[i];
        vectors[q][i] = sine * x[i] + cosine * z[i];
    }
}

/// Rotates pairs of columns until all are orthogonal to working precision, and the columns of `y` with them.
#[inline(always)]
fn orthogonalise<const C: usize>(columns: &mut [[f64; C]; 6], y: &mut [Row6; 6]) {
    for _ in 0..MAX_SWEEPS {
        let mut squares = columns.each_ref().map(|column| dot(column, column));
        let mut more = false;
        more |= play(columns, y, &mut squares, [(0, 1), (2, 3), (4, 5)]);
        more |= play(columns, y, &mut squares, [(0, 3), (1, 5), (2, 4)]);
        more |= play(columns, y, &mut squares, [(0, 5), (3, 4), (1, 2)]);
        more |= play(columns, y, &mut squares, [(0, 4), (5, 2), (3, 1)]);
        more |= play(columns, y, &mut squares, [(0, 2), (4, 1), (5, 3)]);
        if !more {
            break;
        }
    }
}

/// One round: every pair of columns is made orthogonal, and `squares`, the squared lengths, follow. Whether another sweep is wanted.
#[inline(always)]
fn play<const C: usize>(columns: &mut [[f64; C]; 6], y: &mut [Row6; 6], squares: &mut Row6, pairs: [(usize, usize); 3]) -> bool {
    let twice = pairs.map(|(p, q)| 2.0 * dot(&columns[p], &columns[q]));
    let mut more = false;
    let (mut cosines, mut sines) = ([0.0; 3], [0.0; 3]);
    for i in 0..3 {
        let (p, q) = pairs[i];
        let (difference, square) = (squares[q] - squares[p], twice[i] * twice[i]);
        let (cosine, sine, far) = rotation(difference, twice[i]);
        let whole = 4.0 * (squares[p] * squares[q]); // square / whole is the squared cosine
        let rests = square <= ORTHOGONAL * ORTHOGONAL * whole + UNDERFLOW;
        cosines[i] = if rests { 1.0 } else { cosine };
        sines[i] = if rests { 0.0 } else { sine };
        more |= !rests & (square > LAST * LAST * if far * far < whole { far * far } else { whole });
        let gain = if rests { 0.0 } else { 0.5 * square / far }.copysign(difference);
        squares[p] -= gain;
        squares[q] += gain;
    }
    for i in 0..3 {
        let (p, q) = pairs[i];
        turn(columns, p, q, cosines[i], sines[i]);
        turn(y, p, q, cosines[i], sines[i]);
    }
    more
}
