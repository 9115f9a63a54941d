//! A path of the tool, and what share of it lies between its points.

use super::numbers::{linspace, shown, sum};
use crate::error::{Error, Result, check_finite, check_positive};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, dot, norm, scale, sub, unit};
use crate::task::{Projector, Reference, Target, Task};

/// Length of path that a turn of the axis by one radian counts for [m], where there are no times.
const TURN_LENGTH: f64 = 0.1;
/// Least share of the path from a point to the next, relative to the mean: points may lie on each other.
const LEAST_SHARE: f64 = 1e-3;
/// A vector whose length is this near to 1 is a unit vector and stays as it is.
const UNIT: f64 = 1e-15;

/// Positions and axis directions of a tool, in the robot's base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    position: Vec<Vec3>,
    axis: Vec<Vec3>,
    rotation: Option<Vec<[Vec3; 3]>>,
    time: Option<Vec<f64>>,
}

impl Path {
    /// A path of at least one point.
    ///
    /// `position` \[m\] and `axis` (any length but zero, kept as unit vectors) have one entry a point; so have `rotation`, the axes x, y, z of
    /// the tool frame, and `time` \[s\], strictly increasing, if they are given.
    ///
    /// # Errors
    /// [`Error::Shape`] or [`Error::NonFinite`] where lengths differ or a number is not finite; [`Error::Value`] where there is no point, an
    /// axis is zero, a rotation is none or time does not increase.
    pub fn new(position: Vec<Vec3>, axis: Vec<Vec3>, rotation: Option<Vec<[Vec3; 3]>>, time: Option<Vec<f64>>) -> Result<Self> {
        let n = position.len();
        if n == 0 {
            return Err(Error::value("position", "empty", "at least 1 point"));
        }
        check_finite("position", position.as_flattened())?;
        check_finite("axis", axis.as_flattened())?;
        let lengths =
            [("axis", axis.len()), ("rotation", rotation.as_ref().map_or(n, Vec::len)), ("time", time.as_ref().map_or(n, Vec::len))];
        for (name, length) in lengths {
            if length != n {
                return Err(Error::length(name, length, n));
            }
        }
        let axis = axis.into_iter().enumerate().map(|(i, axis)| direction(i, axis)).collect::<Result<_>>()?;
        let rotation = rotation.map(|all| all.into_iter().map(orthogonal).collect::<Result<_>>()).transpose()?;
        if let Some(time) = &time {
            check_finite("time", time)?;
            if let Some(late) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
                let expected = format!("more than {}, the time before", shown(time[late]));
                return Err(Error::value(&format!("time[{}]", late + 1), shown(time[late + 1]), &expected));
            }
        }
        Ok(Self { position, axis, rotation, time })
    }

    /// A helix of `points` points on a cylinder along y, the tool's axis along the inward normal (Leger 2014, eq. 4.21 to 4.24):
    /// `x = R cos(offset - phi)`, `y = p phi`, `z = R sin(offset - phi)` about `center` \[m\], phi going over `angles` (first and last) \[rad\];
    /// `radius` R \[m\], `pitch` p [m/rad].
    ///
    /// # Errors
    /// [`Error::Value`] if the radius is not positive or there are fewer than 2 points.
    pub fn helix(radius: f64, pitch: f64, angles: (f64, f64), offset: f64, center: Vec3, points: usize) -> Result<Self> {
        check_positive("radius", radius)?;
        if points < 2 {
            return Err(Error::value("points", points, "at least 2"));
        }
        let phi = linspace(angles.0, angles.1, points);
        let outward: Vec<Vec3> = phi.iter().map(|phi| [(offset - phi).cos(), 0.0, (offset - phi).sin()]).collect();
        let on_cylinder = |(phi, outward): (&f64, &Vec3)| add(add(center, scale(radius, *outward)), [0.0, pitch * phi, 0.0]);
        let position = phi.iter().zip(&outward).map(on_cylinder).collect();
        Self::new(position, outward.iter().map(|a| sub([0.0; 3], *a)).collect(), None, None)
    }

    /// The same path with times \[s\], strictly increasing.
    ///
    /// # Errors
    /// As for [`Path::new`].
    pub fn with_time(self, time: Vec<f64>) -> Result<Self> {
        Self::new(self.position, self.axis, self.rotation, Some(time))
    }

    /// The same path without times.
    #[must_use]
    pub fn without_time(self) -> Self {
        Self { time: None, ..self }
    }

    /// Number of points, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "no path is empty")]
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Positions of the tool point \[m\].
    pub fn position(&self) -> &[Vec3] {
        &self.position
    }

    /// Directions of the tool's axis.
    pub fn axis(&self) -> &[Vec3] {
        &self.axis
    }

    /// Axes of the tool frame, if they are given.
    pub fn rotation(&self) -> Option<&[[Vec3; 3]]> {
        self.rotation.as_deref()
    }

    /// Times \[s\], if they are given.
    pub fn time(&self) -> Option<&[f64]> {
        self.time.as_deref()
    }

    /// The targets of a task, one a point.
    ///
    /// # Errors
    /// [`Error::Value`] if the task needs rotations and the path has none.
    pub fn targets(&self, task: &Task) -> Result<Vec<Target>> {
        let frame = Frame::IDENTITY.axes;
        let positions = self.position.iter().copied();
        match (Orientation::of(task), &self.rotation) {
            (Orientation::Free, _) => Ok(positions.map(|position| Target { position, axis: None, frame }).collect()),
            (Orientation::Whole, None) => Err(no_rotations()),
            (_, Some(rotation)) if task.spin_axis().is_none() => {
                Ok(positions.zip(rotation).map(|(position, frame)| Target { position, axis: None, frame: *frame }).collect())
            }
            _ => {
                let axis = |axis: &Vec3| unit(*axis).unwrap_or(*axis);
                Ok(positions.zip(&self.axis).map(|(position, a)| Target { position, axis: Some(axis(a)), frame }).collect())
            }
        }
    }

    /// The share of the path from each point to the next, N - 1 numbers whose sum is 1: by time where the path has times; else by length, a
    /// turn of the axis by one radian counting as 0.1 m.
    pub fn shares(&self) -> Vec<f64> {
        let mut steps: Vec<f64> = match &self.time {
            Some(time) => time.windows(2).map(|pair| pair[1] - pair[0]).collect(),
            None => (1..self.len()).map(|i| self.step(i)).collect(),
        };
        if steps.is_empty() {
            return steps;
        }
        if sum(&steps) == 0.0 {
            steps.fill(1.0);
        }
        let least = LEAST_SHARE * (sum(&steps) / steps.len() as f64);
        steps.iter_mut().for_each(|step| *step = step.max(least));
        let total = sum(&steps);
        steps.into_iter().map(|step| step / total).collect()
    }

    /// Length and turn of the way to point `i`.
    fn step(&self, i: usize) -> f64 {
        let cosine = dot(self.axis[i], self.axis[i - 1]).clamp(-1.0, 1.0);
        norm(sub(self.position[i], self.position[i - 1])) + TURN_LENGTH * cosine.acos()
    }
}

/// What of the orientation of a path a task looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Orientation {
    /// Nothing.
    Free,
    /// The direction of an axis of the tool.
    Axis(Vec3),
    /// More than that.
    Whole,
}

impl Orientation {
    /// That of a task.
    pub fn of(task: &Task) -> Self {
        match (task.angular, task.reference) {
            (Projector::None, _) => Self::Free,
            (Projector::Plane(axis), Reference::Tool) => Self::Axis(axis),
            _ => Self::Whole,
        }
    }
}

/// What a path without rotations is told by a task that needs them.
pub(super) fn no_rotations() -> Error {
    Error::value("path", "one that has no rotations", "some for a task that looks at more of the orientation than an axis of the tool")
}

/// The share of the path that each point stands for (trapezoidal rule), one number more than `steps`. In a closed path the last point, which
/// is the first, has none.
pub fn point_weights(steps: &[f64], closed: bool) -> Vec<f64> {
    if steps.is_empty() {
        return vec![1.0];
    }
    let last = steps.len();
    let mut weights = vec![0.0; last + 1];
    for (i, step) in steps.iter().enumerate() {
        weights[i] += 0.5 * step;
        weights[i + 1] += 0.5 * step;
    }
    if closed {
        weights[0] += weights[last];
        weights[last] = 0.0;
    }
    weights
}

/// A direction as a unit vector; unit vectors stay as they are.
fn direction(point: usize, axis: Vec3) -> Result<Vec3> {
    let largest = axis.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return Err(Error::value(&format!("axis[{point}]"), format!("{axis:?}"), "a vector that is not zero"));
    }
    // Scaled by its largest component first, so that no length overflows or vanishes.
    let scaled = axis.map(|x| x / largest);
    let length = norm(scaled);
    Ok(if (length * largest - 1.0).abs() < UNIT { axis } else { scaled.map(|x| x / length) })
}

/// Axes of a frame, made orthogonal to the last digit.
fn orthogonal(axes: [Vec3; 3]) -> Result<[Vec3; 3]> {
    Ok(Frame::from_matrix("rotation", &Frame { axes, origin: [0.0; 3] }.matrix())?.axes)
}
