//! The rows of the Jacobian in which a robot can move its tool at all.

use std::f64::consts::PI;

use super::sized::jacobian;
use crate::linalg::MAX_JOINTS;
use crate::robot::Robot;

/// Postures tried. A row that is zero at some postures in general position is zero at all of them: its entries are analytic in q.
const POSTURES: usize = 8;

/// Square roots of primes: multiples of numbers that no rational combination ties fill the space of postures evenly (Kronecker's sequence).
const PRIMES: [f64; MAX_JOINTS] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0, 41.0, 43.0, 47.0, 53.0];

/// A row whose largest entry is below this part of the largest of its kind, angular or linear, is rounding.
const NEGLIGIBLE: f64 = 1e-12;

impl Robot {
    /// Rows 0 to 2 (angular) and 3 to 5 (linear) of the Jacobian in which the tool can move at all: most robots have all six, a planar one in
    /// the x-y plane has 2, 3 and 4.
    pub fn rows_in_use(&self) -> Vec<usize> {
        let n = self.n();
        let mut largest = [0.0f64; 6];
        for k in 1..=POSTURES {
            let mut q = [0.0; MAX_JOINTS];
            for i in 0..n {
                q[i] = PI * (2.0 * (k as f64 * PRIMES[i].sqrt()).fract() - 1.0);
            }
            let (_, columns) = jacobian::<MAX_JOINTS>(self, &q[..n]);
            for i in 0..n {
                for (size, x) in largest.iter_mut().zip(columns.column(i)) {
                    *size = size.max(x.abs());
                }
            }
        }
        // Angular and linear rows have different units, so each kind is measured by its own largest entry.
        let of_kind = |row: usize| largest[row / 3 * 3..row / 3 * 3 + 3].iter().fold(0.0f64, |a, b| a.max(*b));
        (0..6).filter(|row| largest[*row] > NEGLIGIBLE * of_kind(*row)).collect()
    }
}
