//! Denavit-Hartenberg tables in and out, and what a saved robot is made of again.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

use crate::array::{ok, read_list, vector};
use crate::errors::PyResult;
use crate::robot::coupled::list;
use crate::robot::frames::{matrices, matrix};
use crate::robot::mimic::{self, chain_letters, limits_by_joint};
use redundancy::robot::{Convention, DhTable, Robot};

/// A table from its columns a, d, alpha and theta.
pub fn read_table(convention: &str, [a, d, alpha, theta]: [&Bound<'_, PyAny>; 4]) -> PyResult<DhTable> {
    Ok(DhTable {
        convention: ok(Convention::parse(convention))?,
        a: read_list("a", a)?,
        d: read_list("d", d)?,
        alpha: read_list("alpha", alpha)?,
        theta: read_list("theta", theta)?,
    })
}

/// A table as a dictionary.
pub fn dictionary<'py>(py: Python<'py>, table: &DhTable) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("convention", table.convention.name())?;
    for (name, column) in [("a", &table.a), ("d", &table.d), ("alpha", &table.alpha), ("theta", &table.theta)] {
        dict.set_item(name, vector(py, column))?;
    }
    Ok(dict)
}

/// The constructor of `class`, a robot's, that makes this one again, and its arguments.
pub fn rebuilt_from<'py>(class: &Bound<'py, PyType>, robot: &Robot) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let py = class.py();
    let [q_min, q_max, qd_max, qdd_max] = limits_by_joint(py, robot);
    let follow = robot.coupling().map(|_| mimic::dictionary(py, robot)).transpose()?;
    let limits = (matrix(py, robot.tool())?, matrix(py, robot.base())?, q_min, q_max, qd_max, qdd_max);
    let rest = (robot.name(), list(py, robot)?, robot.joint_names(), follow);
    let tail = limits.into_pyobject(py)?.add(rest.into_pyobject(py)?)?;
    match robot.dh() {
        Some(t) => {
            let columns = [&t.a, &t.d, &t.alpha, &t.theta].map(|column| vector(py, column));
            let [a, d, alpha, theta] = columns;
            let head = (a, d, alpha, theta, chain_letters(robot), t.convention.name());
            Ok((class.getattr("from_dh")?, head.into_pyobject(py)?.add(tail)?))
        }
        None => {
            let head = (matrices(py, robot.bare_links())?, matrix(py, robot.flange())?, chain_letters(robot));
            Ok((class.getattr("from_links")?, head.into_pyobject(py)?.add(tail)?))
        }
    }
}
