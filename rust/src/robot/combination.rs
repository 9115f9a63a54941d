//! Limits on combinations of joints: a range of joint 3 that depends on joint 2, the parallelogram of a palletiser.

use crate::error::{Error, Result, check_finite};

/// Combinations that a robot may have limits on: a tick has room for as many rows.
pub const MAX_COMBINATIONS: usize = 8;

/// `low <= row . q <= high`; one of the two may be infinite.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// Coefficients, one a joint.
    pub row: Vec<f64>,
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
}

impl Combination {
    /// One coefficient a joint, all finite and one of them not 0; the least value below the greatest, one of them finite.
    pub(super) fn check(&self, at: usize, n: usize) -> Result<()> {
        let name = format!("coupled[{at}]");
        if self.row.len() != n {
            return Err(Error::length(&name, self.row.len(), n));
        }
        check_finite(&name, &self.row)?;
        if self.row.iter().all(|c| *c == 0.0) {
            return Err(Error::value(&name, "0 for every joint", "a coefficient other than 0"));
        }
        let (increasing, bounded) = (self.low < self.high, self.low.is_finite() || self.high.is_finite());
        if !(increasing && bounded) {
            let given = format!("{} to {}", self.low, self.high);
            return Err(Error::value(
                &format!("{name}, the limits of {self}"),
                given,
                "a lower limit below the upper one, one of them finite",
            ));
        }
        Ok(())
    }

    /// The value at a posture.
    #[inline(never)]
    pub fn value(&self, q: &[f64]) -> f64 {
        self.row.iter().zip(q).map(|(c, x)| c * x).sum()
    }

    /// Length of the row: what a value is divided by to be a distance of postures.
    pub fn norm(&self) -> f64 {
        self.row.iter().map(|c| c * c).sum::<f64>().sqrt()
    }

    /// Distance of a posture to the nearer limit, in the joints, negative beyond it.
    #[inline(never)]
    pub fn margin(&self, q: &[f64]) -> f64 {
        let value = self.value(q);
        (value - self.low).min(self.high - value) / self.norm()
    }

    /// How far the value may fall and rise from a posture: not at all beyond a limit.
    pub fn room(&self, q: &[f64]) -> (f64, f64) {
        let value = self.value(q);
        ((self.low - value).min(0.0), (self.high - value).max(0.0))
    }

    /// What is left of it where some joints are held at coordinates; `None` where none of its joints is free.
    pub(super) fn with_held(&self, held: &[Option<f64>]) -> Option<Self> {
        let mut fixed = 0.0;
        let mut row = Vec::with_capacity(self.row.len());
        for (c, held) in self.row.iter().zip(held) {
            match held {
                Some(x) => fixed += c * x,
                None => row.push(*c),
            }
        }
        row.iter().any(|c| *c != 0.0).then_some(Self { row, low: self.low - fixed, high: self.high - fixed })
    }
}

/// Its joints, counted from 1, positive coefficients first: "joint 3 - joint 2".
impl std::fmt::Display for Combination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let terms = |sign: f64| self.row.iter().enumerate().filter(move |(_, c)| sign * **c > 0.0);
        for (k, (joint, c)) in terms(1.0).chain(terms(-1.0)).enumerate() {
            f.write_str(match (k, *c > 0.0) {
                (0, true) => "",
                (0, false) => "-",
                (_, true) => " + ",
                (_, false) => " - ",
            })?;
            if c.abs() != 1.0 {
                write!(f, "{} ", c.abs())?;
            }
            write!(f, "joint {}", joint + 1)?;
        }
        Ok(())
    }
}
