//! The errors a caller can cause. A numerical outcome (singular, out of iterations, ...) is never an error: it is a
//! status returned beside the best iterate.

use thiserror::Error;

/// What was wrong with an input, with the offending value and what was expected.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An array has the wrong length or shape.
    #[error("{name}: got shape {got}, expected {expected}")]
    Shape {
        /// Argument.
        name: String,
        /// Shape received.
        got: String,
        /// Shape wanted.
        expected: String,
    },
    /// A number is NaN or infinite where a finite one is needed.
    #[error("{name}[{index}] is {value}, expected a finite number")]
    NonFinite {
        /// Argument.
        name: String,
        /// Flat index of the first offender.
        index: usize,
        /// The offender.
        value: f64,
    },
    /// A value is outside its domain.
    #[error("{name} is {value}, expected {expected}")]
    Value {
        /// Argument.
        name: String,
        /// What was given.
        value: String,
        /// What was wanted.
        expected: String,
    },
    /// A robot model is inconsistent.
    #[error("{0}")]
    Model(String),
}

/// Result with this crate's [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An [`Error::Value`].
    pub fn value(name: &str, value: impl ToString, expected: &str) -> Self {
        Self::Value { name: name.into(), value: value.to_string(), expected: expected.into() }
    }

    /// An [`Error::Shape`] for a vector.
    pub fn length(name: &str, got: usize, expected: usize) -> Self {
        Self::Shape { name: name.into(), got: format!("({got},)"), expected: format!("({expected},)") }
    }
}

/// Checks that `values` has `n` entries.
#[inline]
pub fn check_length(name: &str, values: &[f64], n: usize) -> Result<()> {
    if values.len() == n { Ok(()) } else { Err(Error::length(name, values.len(), n)) }
}

/// Checks that `values` has `n` finite entries.
pub fn check_vector(name: &str, values: &[f64], n: usize) -> Result<()> {
    check_length(name, values, n)?;
    check_finite(name, values)
}

/// Checks that every entry is finite.
#[inline]
pub fn check_finite(name: &str, values: &[f64]) -> Result<()> {
    match values.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(Error::NonFinite { name: name.into(), index, value: values[index] }),
        None => Ok(()),
    }
}

/// Checks that a number is finite and above zero.
pub fn check_positive(name: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(Error::value(name, value, "a finite number above 0")) }
}
