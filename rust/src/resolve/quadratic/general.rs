//! What is not one number: full matrices of the weights, bounds of the deviation by component and side, jerk (Dufour and Suleiman 2020, eq. 3).

use super::beside::Beside;
use super::jerk::Moving;
use super::programme::Cost;
use super::settings::QuadraticMemory;
use super::solver::QuadraticSolver;
use crate::error::{Error, Result, check_finite, check_length};
use crate::linalg::cholesky::Cholesky;
use crate::linalg::{MAX_JOINTS, Mat6, Row6, Rows6};
use crate::resolve::bounds::beyond;
use crate::robot::Limits;
use crate::task::Directions;

/// Entries of a matrix that differ from their mirrored ones by no more than this part of the largest are the same.
const SYMMETRIC: f64 = 1e-9;

/// What was given; nothing at first.
#[derive(Debug, Clone, Default)]
pub(super) struct General {
    rates: Option<Wide>,
    deviation: Option<Wide>,
    pub(super) bounds: Option<(Row6, Row6)>,
    jerk: Option<[f64; MAX_JOINTS]>,
    pub(super) beside: Vec<Beside>,
}

impl QuadraticSolver {
    pub(super) fn general_mut(&mut self) -> &mut General {
        self.general.get_or_insert_default()
    }

    /// Sets a full matrix Q of the rates, n x n by rows, symmetric and positive definite, in place of one weight a joint.
    pub fn set_rate_matrix(&mut self, q: &[f64]) -> Result<()> {
        let n = self.robot.n();
        self.general_mut().rates = Some(positive_definite("rate_weights", q, n)?);
        Ok(())
    }

    /// Sets a full matrix W of the deviation [omega; v] in the base frame at the tool point, 6 x 6 by rows, symmetric and positive definite: it counts
    /// the stiffness of a tick times `delta'W delta / 2`, and the length no longer weighs angles.
    pub fn set_deviation_matrix(&mut self, w: &[f64]) -> Result<()> {
        self.general_mut().deviation = Some(positive_definite("stiffness", w, 6)?);
        Ok(())
    }

    /// Sets bounds of the deviation by component, [omega; v] in the base frame at the tool point [rad/s, m/s]: lower ones at most 0, upper ones at least 0,
    /// infinite for none. They take the place of the largest deviation.
    pub fn set_deviation_bounds(&mut self, lower: &[f64], upper: &[f64]) -> Result<()> {
        check_length("largest_deviation", lower, 6)?;
        check_length("largest_deviation", upper, 6)?;
        for (value, sign) in lower.iter().map(|x| (x, -1.0)).chain(upper.iter().map(|x| (x, 1.0))) {
            if value.is_nan() || sign * value < 0.0 {
                let expected = if sign < 0.0 { "a lower bound of at most 0" } else { "an upper bound of at least 0" };
                return Err(Error::value("largest_deviation", value, expected));
            }
        }
        self.general_mut().bounds = Some((std::array::from_fn(|k| lower[k]), std::array::from_fn(|k| upper[k])));
        Ok(())
    }

    /// Sets limits of jerk, one a joint [rad/s^3 or m/s^3], infinite for none: they hold as far as position, speed and acceleration allow.
    pub fn set_jerk(&mut self, jerk: &[f64]) -> Result<()> {
        check_length("jerk", jerk, self.robot.n())?;
        if let Some(value) = jerk.iter().find(|x| x.is_nan() || **x <= 0.0) {
            return Err(Error::value("jerk", value, "a limit above 0"));
        }
        self.general_mut().jerk = Some(std::array::from_fn(|i| jerk.get(i).copied().unwrap_or(f64::INFINITY)));
        Ok(())
    }
}

/// A matrix in the room for the largest there are, and its factor L of `L L'`: so that no size has machine code of its own.
type Wide = [[f64; MAX_JOINTS]; MAX_JOINTS];

#[inline(never)]
fn factor(matrix: &Wide, n: usize) -> Option<Cholesky<MAX_JOINTS>> {
    Cholesky::new(matrix, n)
}

#[inline(never)]
fn positive_definite(name: &str, given: &[f64], n: usize) -> Result<Wide> {
    check_length(name, given, n * n)?;
    check_finite(name, given)?;
    let (mut out, mut largest, mut odd) = ([[0.0; MAX_JOINTS]; MAX_JOINTS], 0.0f64, 0.0f64);
    for (i, row) in given.chunks_exact(n).enumerate() {
        for (j, one) in row.iter().enumerate() {
            let other = given[j * n + i];
            (largest, odd) = (largest.max(one.abs()), odd.max((one - other).abs()));
            out[i][j] = 0.5 * (one + other);
        }
    }
    if odd <= SYMMETRIC * largest && factor(&out, n).is_some() {
        return Ok(out);
    }
    Err(Error::value(name, "a matrix that is not", "a symmetric positive definite matrix"))
}

impl General {
    /// Puts the cost of the rates in its place.
    #[cold]
    pub fn set_rates<const C: usize>(&self, cost: &mut Cost<C>, n: usize) {
        if let Some(q) = &self.rates {
            for i in 0..n {
                cost.h[i][..n].copy_from_slice(&q[i][..n]);
            }
        }
    }

    /// What takes the components of the deviation to those whose sum of squares it costs; `None` where these are the components themselves.
    #[cold]
    #[inline(never)]
    pub fn weighing(&self, directions: &Directions, twists: &Mat6) -> Option<Mat6> {
        let (m, weight) = (directions.dimension(), self.deviation.as_ref()?);
        let mut product = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        for a in 0..m {
            for b in 0..m {
                for (row, weights) in twists.iter().zip(weight) {
                    let weighed: f64 = weights.iter().zip(twists).map(|(w, other)| w * other[b]).sum();
                    product[a][b] += row[a] * weighed;
                }
            }
        }
        let factor = factor(&product, m)?;
        let mut out = [[0.0; 6]; 6];
        for a in 0..m {
            for b in 0..=a {
                out[b][a] = factor.entry(a, b);
            }
        }
        Some(out)
    }

    /// What is wanted of the components of a task, weighed by the full matrix of the deviation, if there is one.
    #[cold]
    #[inline(never)]
    pub fn weighed(&self, directions: &Directions, wanted: &Row6) -> Option<Row6> {
        let matrix = self.weighing(directions, &twists_of(directions))?;
        let mut out = [0.0; 6];
        for row in &matrix {
            let along: f64 = row.iter().zip(wanted).map(|(a, b)| a * b).sum();
            for (to, from) in out.iter_mut().zip(row) {
                *to += along * from;
            }
        }
        Some(out)
    }

    /// Whether a limit of jerk is given.
    pub fn limits_jerk(&self) -> bool {
        self.jerk.is_some()
    }

    /// Takes from intervals of rates what jerk does not allow on the way to rates that are aimed at.
    #[cold]
    #[inline(never)]
    pub fn limit_jerk(
        &self,
        limits: &Limits,
        tick: (&[f64], f64),
        memory: &QuadraticMemory,
        aim: &[f64],
        lower: &mut [f64],
        upper: &mut [f64],
    ) {
        let ((q, dt), Some(jerk), Some(before)) = (tick, &self.jerk, &memory.rates) else { return };
        let earlier = memory.earlier.as_ref().unwrap_or(before);
        for i in (0..q.len()).filter(|i| jerk[*i].is_finite()) {
            let (speed, acceleration) = (limits.qd_max[i], limits.qdd_max[i]);
            let joint = Moving { dt, speed, acceleration, jerk: jerk[i], before: before[i], earlier: earlier[i] };
            let (below, above) = ((q[i] - limits.q_min[i]).max(0.0), (limits.q_max[i] - q[i]).max(0.0));
            let (whole, by) = ((lower[i], upper[i]), beyond(limits, i, q[i]));
            (lower[i], upper[i]) = if by == 0.0 {
                joint.narrow(whole, (below, above), aim[i])
            } else {
                // On the way back haste comes last.
                [joint.back(whole, if by > 0.0 { upper[i] } else { lower[i] }); 2].into()
            };
        }
    }
}

/// The twist at the tool point of each component of a task, by columns; angular components count the length.
#[cold]
#[inline(never)]
pub(super) fn twists_of(directions: &Directions) -> Mat6 {
    let mut out = [[0.0; 6]; 6];
    for r in 0..directions.dimension() {
        let (w, v) = directions.direction(r);
        for k in 0..3 {
            (out[k][r], out[k + 3][r]) = (w[k], v[k]);
        }
    }
    out
}

/// `matrix` times rows, and times what is wanted of them.
#[cold]
#[inline(never)]
pub(super) fn combined<const C: usize>(matrix: &Mat6, rows: &Rows6<C>, wanted: &Row6) -> (Rows6<C>, Row6) {
    let (mut out, mut sum) = ([[0.0; C]; 6], [0.0; 6]);
    multiply(matrix, rows.as_flattened(), out.as_flattened_mut());
    multiply(matrix, wanted, &mut sum);
    (out, sum)
}

/// Adds `matrix` times six rows of any length.
#[inline(never)]
fn multiply(matrix: &Mat6, rows: &[f64], out: &mut [f64]) {
    let width = rows.len() / 6;
    for (out, factors) in out.chunks_exact_mut(width).zip(matrix) {
        for (row, factor) in rows.chunks_exact(width).zip(factors) {
            for (to, from) in out.iter_mut().zip(row) {
                *to += factor * from;
            }
        }
    }
}
