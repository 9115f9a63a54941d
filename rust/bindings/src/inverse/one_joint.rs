//! `redundancy.one_joint_minimum`.

use pyo3::prelude::*;

use super::terms::{read_direction, read_metric, read_orientation, read_tuples, read_vec3};
use crate::array::ok;
use crate::errors::PyResult;
use crate::results::ONE_JOINT;
use crate::robot::frames::Maybe;
use redundancy::error::Error;
use redundancy::inverse::descent::{self, Goal, OneJoint, Orientation};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::Vec3;
use redundancy::robot::Joint;

/// Both of a pair, or none of them.
fn both<T>(
    name: &str,
    now: Maybe<'_, '_>,
    wanted: Maybe<'_, '_>,
    read: impl Fn(&str, &Bound<'_, PyAny>) -> PyResult<T>,
) -> PyResult<Option<(T, T)>> {
    match (now, wanted) {
        (Some(now), Some(wanted)) => Ok(Some((read(&format!("current_{name}"), now)?, read(&format!("desired_{name}"), wanted)?))),
        (None, None) => Ok(None),
        (Some(_), None) => Err(Error::value(&format!("current_{name}"), format!("given without desired_{name}"), "both or none").into()),
        (None, Some(_)) => Err(Error::value(&format!("desired_{name}"), format!("given without current_{name}"), "both or none").into()),
    }
}

/// The change of one joint that brings what it carries nearest to a goal, in closed form (From and Gravdahl 2007, sections 5.1 and 5.2).
///
/// The cost is ``w_p |p - p_d|^2 + w_o E_o`` and what the points and the centring add. Of several minima the one nearest to 0 is taken; where the cost is flat
/// the joint stays, as far as its range allows; where the present value is a maximum a free joint turns by +pi.
///
/// Parameters
/// ----------
/// joint : {"R", "P"}
///     Turns about its axis or slides along it.
/// axis : array_like, shape (3,)
///     Direction of the axis in the base frame, any length but zero.
/// origin : array_like, shape (3,)
///     A point on the axis [m].
/// current_position, desired_position : array_like, shape (3,), optional
///     Tool point [m].
/// current_orientation, desired_orientation : array_like, shape (4,) or (3, 3), optional
///     Unit quaternion [w, x, y, z], either sign, or rotation matrix of the tool frame in the base frame.
/// w_p, w_o : float
///     Weights of position [1/m^2] and orientation, at least 0.
/// orientation_metric : {"frobenius", "quaternion"}
///     E_o: ``|C - D|_F^2 = 8 sin^2(w/2)``, or ``2 - 2 |<c, d>| = 4 sin^2(w/4)``, with w the angle of error. For an axis always ``|z - z_d|^2``.
/// change_min, change_max : float, optional
///     Range of the change [rad or m], ends included, as wide as it may be; infinite if not given. A free joint that turns changes by (-pi, pi].
/// current_axis, desired_axis : array_like, shape (3,), optional
///     Direction of the tool in the base frame instead of the orientation: the spin about it is free.
/// points : sequence of (array_like, array_like, float), optional
///     Points that the joint carries beside the tool, each with its place at present, its goal [m] and its weight; below zero it is kept off. At most 8.
/// centring : (float, float), optional
///     How far the joint is from where it is drawn to [rad or m], and a weight: ``weight (1 - cos(q - middle))``, for a sliding joint ``weight (q - middle)^2 / 2``.
///
/// Returns
/// -------
/// change : float
///     Change of the joint [rad or m].
/// value : float
///     Cost after it, from the residuals: exact next to a goal, where the closed form ``K - hypot(a, b)`` loses half its digits.
///
/// Raises
/// ------
/// ShapeError, NonFiniteError, InvalidValueError
///     If an argument is not one of these, a range is empty, or nothing bounds the cost of a joint that slides without limits.
///
/// Notes
/// -----
/// A joint that turns has ``K + a cos x + b sin x``, whose minimum is ``atan2(-b, -a)``; the printed (25), ``atan2(b/a)``, is the maximum. With the quaternion
/// metric beside other terms the derivative, (35) with its half-angle terms halved, is a quartic in ``tan(x/4)``.
///
/// Examples
/// --------
/// >>> import redundancy as rd
/// >>> found = rd.one_joint_minimum("R", [0, 0, 1], [0, 0, 0], current_position=[1, 0, 0], desired_position=[0, 2, 0])
/// >>> round(found.change, 12), round(found.value, 12)
/// (1.570796326795, 1.0)
#[pyfunction]
#[pyo3(signature = (joint, axis, origin, *, current_position=None, desired_position=None, current_orientation=None, desired_orientation=None, w_p=1.0, w_o=1.0, orientation_metric="frobenius", change_min=None, change_max=None, current_axis=None, desired_axis=None, points=None, centring=None))]
pub fn one_joint_minimum<'py>(
    py: Python<'py>,
    joint: &str,
    axis: &Bound<'py, PyAny>,
    origin: &Bound<'py, PyAny>,
    current_position: Maybe<'_, 'py>,
    desired_position: Maybe<'_, 'py>,
    current_orientation: Maybe<'_, 'py>,
    desired_orientation: Maybe<'_, 'py>,
    w_p: f64,
    w_o: f64,
    orientation_metric: &str,
    change_min: Option<f64>,
    change_max: Option<f64>,
    current_axis: Maybe<'_, 'py>,
    desired_axis: Maybe<'_, 'py>,
    points: Maybe<'_, 'py>,
    centring: Option<(f64, f64)>,
) -> PyResult<Bound<'py, PyAny>> {
    let joint = match joint {
        "R" => Joint::Revolute,
        "P" => Joint::Prismatic,
        _ => return Err(Error::value("joint", format!("{joint:?}"), "\"R\" or \"P\"").into()),
    };
    let (axis, origin) = (read_direction("axis", axis)?, read_vec3("origin", origin)?);
    let mut tool = Frame::IDENTITY;
    // Without a position there is none to miss.
    let (position, w_p) = match both("position", current_position, desired_position, read_vec3)? {
        Some((now, wanted)) => {
            tool.origin = now;
            (wanted, w_p)
        }
        None => ([0.0; 3], 0.0),
    };
    let whole = both("orientation", current_orientation, desired_orientation, read_orientation)?;
    let orientation = match (whole, both("axis", current_axis, desired_axis, read_direction)?) {
        (Some(_), Some(_)) => return Err(Error::value("desired_axis", "given beside desired_orientation", "one of the two").into()),
        (Some((now, wanted)), None) => {
            tool.axes = now;
            Orientation::Whole(wanted)
        }
        (None, Some((now, wanted))) => Orientation::Axis { tool: now, direction: wanted },
        (None, None) => Orientation::Free,
    };
    let metric = read_metric(orientation_metric)?;
    let goal = Goal { position, orientation, position_weight: w_p, orientation_weight: w_o, metric };
    let triples = points.map_or_else(|| Ok(Vec::new()), |points| read_tuples("points", points, "tuples (point, goal, weight)"))?;
    let read = |(at, goal, weight): (Bound<'py, PyAny>, Bound<'py, PyAny>, f64)| -> PyResult<(Vec3, Vec3, f64)> {
        Ok((read_vec3("points", &at)?, read_vec3("points", &goal)?, weight))
    };
    let points = triples.into_iter().map(read).collect::<PyResult<Vec<_>>>()?;
    let range = (change_min.unwrap_or(f64::NEG_INFINITY), change_max.unwrap_or(f64::INFINITY));
    let found =
        descent::one_joint_minimum(&OneJoint { joint, axis, origin, tool, goal, points, centring: centring.unwrap_or_default() }, range);
    Ok(ONE_JOINT.make(py, ok(found)?)?)
}
