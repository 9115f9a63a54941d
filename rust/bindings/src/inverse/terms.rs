//! What a cost of descent is made of, in from Python.

use pyo3::prelude::*;

use crate::array::{ok, read_list, read_vector};
use crate::errors::PyResult;
use crate::orientation::Orientations;
use crate::robot::frames::Maybe;
use redundancy::error::{Error, check_finite};
use redundancy::inverse::descent::{Centre, Metric, Point};
use redundancy::linalg::vector::{Vec3, unit};
use redundancy::robot::Robot;

/// The metric of orientation.
pub fn read_metric(metric: &str) -> PyResult<Metric> {
    match metric {
        "frobenius" => Ok(Metric::Frobenius),
        "quaternion" => Ok(Metric::Quaternion),
        _ => Err(Error::value("orientation_metric", format!("{metric:?}"), "\"frobenius\" or \"quaternion\"").into()),
    }
}

/// Three numbers.
pub fn read_vec3(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec3> {
    let mut v = [0.0; 3];
    read_vector(name, value, 3, &mut v)?;
    Ok(v)
}

/// The axes of an orientation: a quaternion [w, x, y, z] or a matrix (3, 3).
pub fn read_orientation(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[Vec3; 3]> {
    Ok(Orientations::one(name, value)?.axes())
}

/// A direction of length one.
pub fn read_direction(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec3> {
    let v = read_vec3(name, value)?;
    unit(v).ok_or_else(|| Error::value(name, format!("{v:?}"), "a vector that is not zero").into())
}

/// The items of a sequence, each of which has to be a tuple that reads as `T`.
pub fn read_tuples<'py, T: for<'a> FromPyObject<'a, 'py>>(name: &str, value: &Bound<'py, PyAny>, expected: &str) -> PyResult<Vec<T>> {
    let wrong = |given: &Bound<'py, PyAny>| Error::value(name, given.repr().map_or_else(|_| "?".into(), |r| r.to_string()), expected);
    let items = value.try_iter().map_err(|_| wrong(value))?;
    items
        .map(|item| {
            let item = item?;
            item.extract().map_err(|_| wrong(&item).into())
        })
        .collect()
}

/// Points of links: (frame after that many joints, point in it, goal, weight).
pub fn read_points(points: Maybe<'_, '_>) -> PyResult<Vec<Point>> {
    let Some(points) = points else { return Ok(Vec::new()) };
    let expected = "tuples (number of joints that carry it, point in the frame after them, goal, weight)";
    read_tuples::<(usize, Bound<'_, PyAny>, Bound<'_, PyAny>, f64)>("points", points, expected)?
        .into_iter()
        .map(|(joints, at, goal, weight)| Ok(Point { joints, at: read_vec3("points", &at)?, goal: read_vec3("points", &goal)?, weight }))
        .collect()
}

/// Joints drawn to values: weights of all of them, or one for all; to the middle of their ranges unless it is said where to.
pub fn read_centres(robot: &Robot, weights: Maybe<'_, '_>, middle: Maybe<'_, '_>) -> PyResult<Vec<Centre>> {
    let n = robot.n();
    let list = |name: &str, values: &Bound<'_, PyAny>| -> PyResult<Vec<f64>> {
        let values = values.extract::<f64>().map_or_else(|_| read_list(name, values), |one| Ok(vec![one; n]))?;
        ok(check_finite(name, &values))?;
        if values.len() == n { Ok(values) } else { Err(Error::length(name, values.len(), n).into()) }
    };
    let middle = middle.map_or_else(|| Ok(robot.middle()), |middle| list("middle", middle))?;
    let Some(weights) = weights else { return Ok(Vec::new()) };
    let weights = list("centring", weights)?;
    let each = weights.into_iter().zip(middle).enumerate();
    Ok(each.filter(|(_, (weight, _))| *weight != 0.0).map(|(joint, (weight, middle))| Centre { joint, middle, weight }).collect())
}
