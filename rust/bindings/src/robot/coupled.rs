//! Limits on combinations of joints, in and out: ``[({joint: coefficient}, low, high), ...]``.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use redundancy::error::Error;
use redundancy::robot::{Combination, Robot};

use super::PyRobot;
use super::frames::Maybe;
use crate::array::ok;
use crate::errors::PyResult;

/// A robot with limits on combinations of joints in the place of its own, if they are given.
pub fn with_coupled(robot: PyRobot, given: Maybe<'_, '_>) -> PyResult<PyRobot> {
    let Some(given) = given else { return Ok(robot) };
    let mut limits = robot.robot.limits().clone();
    limits.coupled = read(given, robot.robot.n())?;
    Ok(ok(robot.robot.with_limits(limits))?.into())
}

fn read(given: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<Combination>> {
    let wrong = |name: String, value: String| Error::value(&name, value, "({joint: coefficient, ...}, low, high), joints counted from 0");
    let Ok(items) = given.try_iter() else { return Err(wrong("coupled".into(), given.to_string()).into()) };
    let mut out = Vec::new();
    for (at, item) in items.enumerate() {
        let item = item?;
        let name = format!("coupled[{at}]");
        let Ok((terms, low, high)) = item.extract::<(Bound<'_, PyDict>, f64, f64)>() else {
            return Err(wrong(name, item.to_string()).into());
        };
        let mut row = vec![0.0; n];
        for (joint, coefficient) in terms.iter() {
            let (Ok(number), Ok(c)) = (joint.extract::<usize>(), coefficient.extract::<f64>()) else {
                return Err(wrong(name, item.to_string()).into());
            };
            match row.get_mut(number) {
                Some(slot) => *slot = c,
                None => return Err(Error::value(&name, format!("joint {number}"), &format!("joints from 0 to {}", n - 1)).into()),
            }
        }
        out.push(Combination { row, low, high });
    }
    Ok(out)
}

/// As they are given.
pub fn list<'py>(py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyList>> {
    let out = PyList::empty(py);
    for it in &robot.limits().coupled {
        let terms = PyDict::new(py);
        for (joint, c) in it.row.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            terms.set_item(joint, c)?;
        }
        out.append(PyTuple::new(py, [terms.into_any(), it.low.into_pyobject(py)?.into_any(), it.high.into_pyobject(py)?.into_any()])?)?;
    }
    Ok(out)
}
