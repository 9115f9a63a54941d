//! What a `redundancy.QuadraticProgram` is made of and asked, as Python gives it.

use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};

use crate::array::{read_any, read_list};
use redundancy::error::Error;
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Derivatives, IndexForm, MAX_OWN_ROWS, QuadraticSettings, QuadraticSolver};

/// How an index enters.
pub fn read_form(name: &str) -> PyResult<IndexForm> {
    match name {
        "curvature" => Ok(IndexForm::Curvature),
        "printed" => Ok(IndexForm::Printed),
        "equality" => Ok(IndexForm::Equality),
        other => Err(Error::value("form", format!("{other:?}"), "'curvature', 'equality' or 'printed'").into()),
    }
}

/// Where derivatives come from.
pub fn read_derivatives(name: &str, step: Option<f64>) -> PyResult<Derivatives> {
    let out = match name {
        "exact" => Derivatives::Exact,
        "bfgs" => Derivatives::Bfgs,
        "differences" => step.map_or(Derivatives::DIFFERENCES, Derivatives::Differences),
        other => return Err(Error::value("derivatives", format!("{other:?}"), "'exact', 'bfgs' or 'differences'").into()),
    };
    match step {
        Some(step) if name != "differences" => Err(Error::value("step", step, "none, but for derivatives='differences'").into()),
        _ => Ok(out),
    }
}

/// What is given in one of several forms.
pub struct Weights<'a, 'py> {
    pub rate_weights: Option<&'a Bound<'py, PyAny>>,
    pub stiffness: Option<&'a Bound<'py, PyAny>>,
    pub largest_deviation: Option<&'a Bound<'py, PyAny>>,
    pub jerk: Option<&'a Bound<'py, PyAny>>,
}

/// Numbers of one of some shapes, and which of them; `()` is a number alone.
#[inline(never)]
fn read_one_of(name: &str, given: &Bound<'_, PyAny>, shapes: &[&[usize]]) -> PyResult<(Vec<f64>, usize)> {
    let (numbers, shape) = read_any(name, given)?;
    match shapes.iter().position(|known| *known == shape) {
        Some(which) => Ok((numbers, which)),
        None => Err(Error::Shape { name: name.into(), got: format!("{shape:?}"), expected: format!("one of {shapes:?}") }.into()),
    }
}

impl Weights<'_, '_> {
    /// The settings that have room for what is given, and a solver made of them that has the rest too.
    #[inline(never)]
    pub fn apply(&self, settings: &mut QuadraticSettings, n: usize) -> PyResult<Rest> {
        let mut rest = Rest::default();
        if let Some(given) = self.rate_weights {
            let (values, which) = read_one_of("rate_weights", given, &[&[], &[n], &[n, n]])?;
            match which {
                0 => settings.rate_weights = [values[0]; MAX_JOINTS],
                1 => settings.rate_weights[..n].copy_from_slice(&values),
                _ => rest.rates = Some(values),
            }
        }
        if let Some(given) = self.stiffness {
            let (values, which) = read_one_of("stiffness", given, &[&[], &[6], &[6, 6]])?;
            settings.stiffness = if which == 0 { values[0] } else { 1.0 };
            rest.deviation = match which {
                0 => None,
                1 => Some((0..36).map(|k| if k / 6 == k % 6 { values[k % 6] } else { 0.0 }).collect()),
                _ => Some(values),
            };
        }
        if let Some(given) = self.largest_deviation {
            let (values, which) = read_one_of("largest_deviation", given, &[&[2], &[6], &[2, 6]])?;
            if which == 0 {
                settings.largest_deviation = (values[0], values[1]);
            } else {
                let upper = values.len() - 6;
                rest.bounds = Some(std::array::from_fn(|k| {
                    if k < 6 && which == 1 {
                        -values[k]
                    } else if k < 6 {
                        values[k]
                    } else {
                        values[upper + k - 6]
                    }
                }));
            }
        }
        if let Some(given) = self.jerk {
            let (values, which) = read_one_of("jerk", given, &[&[], &[n]])?;
            rest.jerk = Some(if which == 0 { vec![values[0]; n] } else { values });
        }
        Ok(rest)
    }
}

/// What settings have no room for.
#[derive(Default)]
pub struct Rest {
    rates: Option<Vec<f64>>,
    deviation: Option<Vec<f64>>,
    /// Lower ones, then upper ones.
    bounds: Option<[f64; 12]>,
    jerk: Option<Vec<f64>>,
}

impl Rest {
    /// The solver with it.
    #[inline(never)]
    pub fn give(&self, solver: &mut QuadraticSolver) -> redundancy::error::Result<()> {
        if let Some(q) = &self.rates {
            solver.set_rate_matrix(q)?;
        }
        if let Some(w) = &self.deviation {
            solver.set_deviation_matrix(w)?;
        }
        if let Some(bounds) = &self.bounds {
            let (lower, upper) = bounds.split_at(6);
            solver.set_deviation_bounds(lower, upper)?;
        }
        if let Some(jerk) = &self.jerk {
            solver.set_jerk(jerk)?;
        }
        Ok(())
    }
}

/// Rows (m, n) and their limits (m,).
pub type ReadRows = (Vec<f64>, Vec<f64>, Vec<f64>);

/// The rows of a step, with infinite limits where none are given.
pub fn read_constraints(
    rows: Option<&Bound<'_, PyAny>>,
    lower: Option<&Bound<'_, PyAny>>,
    upper: Option<&Bound<'_, PyAny>>,
    n: usize,
) -> PyResult<ReadRows> {
    let Some(rows) = rows else {
        return match lower.or(upper) {
            Some(_) => Err(Error::value("rows", "None", "rows where lower or upper is given").into()),
            None => Ok((Vec::new(), Vec::new(), Vec::new())),
        };
    };
    let (numbers, shape) = read_any("rows", rows)?;
    let &[count, width] = shape.as_slice() else {
        return Err(Error::Shape { name: "rows".into(), got: format!("{shape:?}"), expected: format!("(m, {n})") }.into());
    };
    if width != n {
        return Err(Error::Shape { name: "rows".into(), got: format!("({count}, {width})"), expected: format!("(m, {n})") }.into());
    }
    redundancy::error::check_finite("rows", &numbers).map_err(Failure::from)?;
    if count > MAX_OWN_ROWS {
        return Err(Error::value("rows", count, &format!("at most {MAX_OWN_ROWS} rows")).into());
    }
    let limit = |name: &str, value: Option<&Bound<'_, PyAny>>, open: f64| -> PyResult<Vec<f64>> {
        let list = value.map_or_else(|| Ok(vec![open; count]), |value| read_list(name, value))?;
        if list.len() != count {
            return Err(Error::length(name, list.len(), count).into());
        }
        if let Some(index) = list.iter().position(|x| x.is_nan()) {
            return Err(Error::NonFinite { name: name.into(), index, value: f64::NAN }.into());
        }
        match list.iter().position(|x| x.is_infinite() && *x != open) {
            Some(index) => {
                Err(Error::value(&format!("{name}[{index}]"), list[index], "a number, or an infinite one on the other side").into())
            }
            None => Ok(list),
        }
    };
    Ok((numbers, limit("lower", lower, f64::NEG_INFINITY)?, limit("upper", upper, f64::INFINITY)?))
}
