//! Which rows of the Jacobian an index uses, and the length that makes them homogeneous.

use crate::error::{Error, Result, check_positive};
use crate::kinematics::sized::{Jacobian, derivative_column};
use crate::linalg::real::Real;
use crate::linalg::{Mat6, Row6, Rows6};

/// The rows in use and the length: `J_n = [L A; B]` restricted to the rows (Leger 2014, eq. 2.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    indices: [usize; 6],
    count: usize,
    /// Characteristic length \[m\].
    pub length: f64,
}

impl Rows {
    /// All six rows.
    pub fn all(length: f64) -> Result<Self> {
        Self::new(&[0, 1, 2, 3, 4, 5], length)
    }

    /// Some rows: 0 to 2 angular, 3 to 5 linear, in increasing order.
    pub fn new(rows: &[usize], length: f64) -> Result<Self> {
        check_positive("length", length)?;
        let increasing = rows.windows(2).all(|pair| pair[0] < pair[1]);
        if rows.is_empty() || rows.iter().any(|r| *r > 5) || !increasing {
            return Err(Error::value("rows", format!("{rows:?}"), "one to six different numbers from 0 to 5 in increasing order"));
        }
        let mut indices = [0; 6];
        indices[..rows.len()].copy_from_slice(rows);
        Ok(Self { indices, count: rows.len(), length })
    }

    /// The same rows with another length, which the caller has checked.
    pub fn with_length(self, length: f64) -> Self {
        Self { length, ..self }
    }

    /// Number of rows m.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The rows.
    pub fn indices(&self) -> &[usize] {
        &self.indices[..self.count]
    }

    /// How many of the first rows in use are angular: those the length multiplies.
    #[inline(always)]
    pub fn angular(&self) -> usize {
        self.indices().iter().filter(|r| **r < 3).count()
    }

    #[inline(always)]
    fn scale(&self, row: usize) -> f64 {
        if row < 3 { self.length } else { 1.0 }
    }

    /// `J_n` by rows.
    #[inline(always)]
    pub fn normalised<const C: usize, T: Real>(&self, jacobian: &Jacobian<C, T>) -> Rows6<C, T> {
        self.select(jacobian.n(), |i, row| if row < 3 { jacobian.w[i][row] } else { jacobian.v[i][row - 3] })
    }

    /// `dJ_n/dq_k` by columns, into a zeroed `out`.
    #[inline(always)]
    pub(super) fn normalised_derivative<const C: usize>(&self, jacobian: &Jacobian<C>, k: usize, out: &mut [Row6; C]) {
        match jacobian.coupled() {
            None => self.free_derivative(jacobian, k, out),
            Some(coupled) => self.scaled(&coupled.derivative(k), out),
        }
    }

    /// The same where no joint follows another.
    #[inline(always)]
    fn free_derivative<const C: usize>(&self, jacobian: &Jacobian<C>, k: usize, out: &mut [Row6; C]) {
        for i in 0..jacobian.n() {
            self.put(&derivative_column(jacobian, k, i), &mut out[i]);
        }
    }

    /// The rows in use of a column, scaled.
    #[inline(always)]
    fn put(&self, column: &Row6, out: &mut Row6) {
        if self.count == 6 {
            *out = std::array::from_fn(|r| if r < 3 { self.length * column[r] } else { column[r] });
        } else {
            for (r, row) in self.indices().iter().enumerate() {
                out[r] = self.scale(*row) * column[*row];
            }
        }
    }

    #[cold]
    #[inline(never)]
    fn scaled(&self, columns: &[Row6], out: &mut [Row6]) {
        columns.iter().zip(out).for_each(|(column, out)| self.put(column, out));
    }

    /// `dJ_n/dq_k` by columns for every k, and `Omega_k = dJ_n/dq_k P`, both into zeroed ones, P by joints.
    #[inline(always)]
    pub(super) fn derivatives<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        p: &[Row6; C],
        m: usize,
        dj: &mut [[Row6; C]; C],
        omega: &mut [Mat6; C],
    ) {
        for k in 0..jacobian.n() {
            self.free_derivative(jacobian, k, &mut dj[k]);
            self.omega(&dj[k], p, k, m, &mut omega[k]);
        }
        // Once more where that was not it, out of the way of loops that the compiler unrolls.
        if jacobian.coupled().is_some() {
            self.coupled_derivatives(jacobian, p, m, dj, omega);
        }
    }

    #[cold]
    #[inline(never)]
    fn coupled_derivatives<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        p: &[Row6; C],
        m: usize,
        dj: &mut [[Row6; C]; C],
        omega: &mut [Mat6; C],
    ) {
        for k in 0..jacobian.n() {
            self.normalised_derivative(jacobian, k, &mut dj[k]);
            omega[k] = [[0.0; 6]; 6];
            product(&dj[k], p, m, &mut omega[k]);
        }
    }

    /// Adds `Omega_k = dJ_n/dq_k P`, from both by joints, to `out`; the angular part of dJ_i/dq_k vanishes for i <= k where no joint follows another.
    #[inline(always)]
    fn omega<const C: usize>(&self, dj: &[Row6; C], p: &[Row6; C], k: usize, m: usize, out: &mut Mat6) {
        let angular = if m == 6 { 3 } else { self.angular() };
        for r in 0..m {
            for i in if r < angular { k + 1 } else { 0 }..C {
                for c in 0..6 {
                    out[r][c] += dj[i][r] * p[i][c];
                }
            }
        }
    }

    #[inline(always)]
    fn select<const C: usize, T: Real>(&self, n: usize, entry: impl Fn(usize, usize) -> T) -> Rows6<C, T> {
        let mut out = [[T::ZERO; C]; 6];
        if self.count == 6 {
            for r in 0..6 {
                for i in 0..n {
                    out[r][i] = if r < 3 { T::splat(self.length) * entry(i, r) } else { entry(i, r) };
                }
            }
        } else {
            for (r, row) in self.indices().iter().enumerate() {
                for i in 0..n {
                    out[r][i] = T::splat(self.scale(*row)) * entry(i, *row);
                }
            }
        }
        out
    }

    /// From `d(phi)/dJ_n` to `d(phi)/dJ`: puts the rows back and scales them again.
    #[inline(always)]
    pub(super) fn spread<T: Real>(&self, y: &Row6<T>) -> Row6<T> {
        let mut out = [T::ZERO; 6];
        if self.count == 6 {
            for r in 0..6 {
                out[r] = T::splat(self.scale(r)) * y[r];
            }
        } else {
            for r in 0..self.count {
                out[self.indices[r]] = T::splat(self.scale(self.indices[r])) * y[r];
            }
        }
        out
    }
}

/// Adds `dJ P`.
#[inline(never)]
fn product(dj: &[Row6], p: &[Row6], m: usize, out: &mut Mat6) {
    for (dj, p) in dj.iter().zip(p) {
        for r in 0..m {
            for c in 0..6 {
                out[r][c] += dj[r] * p[c];
            }
        }
    }
}
