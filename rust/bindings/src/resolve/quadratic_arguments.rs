//! What a `redundancy.QuadraticProgram` is made of and asked, as Python gives it.

use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};

use crate::array::{read_any, read_list};
use redundancy::error::Error;
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Derivatives, IndexForm, MAX_OWN_ROWS};

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
pub fn read_derivatives(name: &str) -> PyResult<Derivatives> {
    match name {
        "exact" => Ok(Derivatives::Exact),
        "bfgs" => Ok(Derivatives::Bfgs),
        "differences" => Ok(Derivatives::DIFFERENCES),
        other => Err(Error::value("derivatives", format!("{other:?}"), "'exact', 'bfgs' or 'differences'").into()),
    }
}

/// One weight a joint, or one for all; 1 if not given.
pub fn read_rate_weights(value: Option<&Bound<'_, PyAny>>, n: usize) -> PyResult<[f64; MAX_JOINTS]> {
    let Some(value) = value else { return Ok([1.0; MAX_JOINTS]) };
    if let Ok(weight) = value.extract::<f64>() {
        return Ok([weight; MAX_JOINTS]);
    }
    let list = read_list("rate_weights", value)?;
    if list.len() != n {
        return Err(Error::length("rate_weights", list.len(), n).into());
    }
    Ok(std::array::from_fn(|i| list.get(i).copied().unwrap_or(1.0)))
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
