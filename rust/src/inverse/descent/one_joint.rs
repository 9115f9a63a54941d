//! The best change of one joint, for itself.

use super::cost::{Cost, Goal};
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, unit};
use crate::robot::Joint;

/// One joint, and what it carries.
#[derive(Debug, Clone)]
pub struct OneJoint {
    /// Turns or slides.
    pub joint: Joint,
    /// Its axis in the base frame, any length but zero.
    pub axis: Vec3,
    /// A point on it \[m\].
    pub origin: Vec3,
    /// The tool frame at present.
    pub tool: Frame,
    /// Where the tool has to be.
    pub goal: Goal,
    /// Points carried, at most [`super::MAX_POINTS`]: where they are, where they are to be \[m\], and the weights.
    pub points: Vec<(Vec3, Vec3, f64)>,
    /// How far the joint is from where it is drawn to [rad or m], and the weight.
    pub centring: (f64, f64),
}

/// The change of the joint within a range that makes the cost least, and the cost there. Of several the one nearest to 0; where the cost is flat 0, or the end
/// of the range that is nearest to it.
pub fn one_joint_minimum(it: &OneJoint, (low, high): (f64, f64)) -> Result<(f64, f64)> {
    if !(low <= high && low < f64::INFINITY && high > f64::NEG_INFINITY) {
        return Err(Error::value("change_min, change_max", format!("{low}, {high}"), "a range that is not empty"));
    }
    check_finite("origin", &it.origin)?;
    check_finite("current_position", &it.tool.origin)?;
    let axis = unit(it.axis).ok_or_else(|| Error::value("axis", format!("{:?}", it.axis), "a vector that is not zero"))?;
    let mut cost = Cost::new(it.goal);
    let mut places = cost.places(it.tool, None);
    for (i, (at, goal, weight)) in it.points.iter().enumerate() {
        cost.points.push(super::Point { joints: 1, at: *at, goal: *goal, weight: *weight });
        if let Some(place) = places.points.get_mut(i) {
            *place = *at;
        }
    }
    cost.centres.push(super::Centre { joint: 0, middle: 0.0, weight: it.centring.1 });
    cost.check(1)?;
    check_finite("centring", &[it.centring.0])?;
    let (line, from_middle) = ((axis, it.origin), it.centring.0);
    let form = cost.form(&places, 0, it.joint, line, from_middle);
    if form.is_unbounded(low, high) {
        return Err(Error::value(
            "w_p and the weights of points",
            "a sum that is not above 0",
            "one above 0, for a joint that slides without limits",
        ));
    }
    let change = form.best(low, high);
    cost.carry(&mut places, 0, it.joint, line, change);
    Ok((change, cost.value(&places, &[from_middle + change], &[it.joint])))
}
