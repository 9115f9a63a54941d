//! Limits of single joints by their names, as `Robot.from_urdf` takes them.

use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::errors::PyResult;
use redundancy::error::Error;
use redundancy::robot::JointLimits;

/// What every joint may be given.
const EXPECTED: &str = "(low, high), or a dictionary with some of \"low\", \"high\" and \"velocity\", numbers or None";

/// What a mapping holds; nothing if there is none.
fn items<'py>(mapping: Option<&Bound<'py, PyMapping>>) -> PyResult<Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
    let Some(mapping) = mapping else { return Ok(Vec::new()) };
    Ok(mapping.items()?.extract()?)
}

/// A dictionary from names to (low, high), or to dictionaries.
pub fn read_joint_limits(limits: Option<&Bound<'_, PyMapping>>) -> PyResult<Vec<JointLimits>> {
    let mut read = Vec::new();
    for (key, value) in items(limits)? {
        let joint: String = key.extract().map_err(|_| Error::value("limits", format!("for {key}"), "names of joints"))?;
        let wrong = || Error::value(&format!("limits[{joint:?}]"), &value, EXPECTED);
        let mut one = JointLimits { joint: joint.clone(), ..JointLimits::default() };
        if let Ok(named) = value.cast::<PyMapping>() {
            for (name, number) in items(Some(named))? {
                let number: Option<f64> = number.extract().map_err(|_| wrong())?;
                match name.extract::<String>().unwrap_or_default().as_str() {
                    "low" => one.low = number,
                    "high" => one.high = number,
                    "velocity" => one.velocity = number,
                    _ => return Err(wrong().into()),
                }
            }
        } else {
            let ends = value.try_iter().and_then(|ends| ends.map(|end| end?.extract::<Option<f64>>()).collect::<Result<Vec<_>, _>>());
            [one.low, one.high] = ends.ok().and_then(|ends| ends.try_into().ok()).ok_or_else(wrong)?;
        }
        read.push(one);
    }
    Ok(read)
}
