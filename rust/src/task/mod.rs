//! What the tool has to do, and what it is free to do.

use crate::error::{Error, Result, check_finite};
use crate::kinematics::Jacobian;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, perpendicular, scale, sub, unit};
use crate::linalg::{Row6, Rows6};

/// A task: which motions of the tool matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Position and the direction of an axis of the tool (in the tool frame); the spin about it is free.
    Axisymmetric(Vec3),
    /// Position and orientation.
    Full,
    /// Position.
    Position,
}

/// Where the tool has to be; the parts a task does not ask for are not looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Position of the tool point [m].
    pub position: Vec3,
    /// Direction of the tool's axis (unit), for [`Task::Axisymmetric`].
    pub axis: Vec3,
    /// Axes of the tool frame, for [`Task::Full`].
    pub rotation: [Vec3; 3],
}

/// The twist directions that matter at a posture: unit vectors for the angular part, then the linear part whole.
#[derive(Debug, Clone, Copy)]
pub struct Directions {
    angular: [Vec3; 3],
    count: usize,
    length: f64,
}

impl Directions {
    /// Dimension of the task.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        self.count + 3
    }

    /// The components of a twist that matter, angular ones times the length.
    #[inline(always)]
    pub fn reduce(&self, w: Vec3, v: Vec3) -> Row6 {
        let mut out = [0.0; 6];
        for i in 0..self.count {
            out[i] = self.length * dot(self.angular[i], w);
        }
        out[self.count..self.count + 3].copy_from_slice(&v);
        out
    }

    /// The transpose of [`Directions::reduce`].
    #[inline(always)]
    pub fn expand(&self, components: &Row6) -> (Vec3, Vec3) {
        let mut w = [0.0; 3];
        for i in 0..self.count {
            w = add(w, scale(self.length * components[i], self.angular[i]));
        }
        (w, [components[self.count], components[self.count + 1], components[self.count + 2]])
    }

    /// The Jacobian of the task by rows.
    #[inline(always)]
    pub fn rows<const C: usize>(&self, jacobian: &Jacobian<C>) -> Rows6<C> {
        let mut out = [[0.0; C]; 6];
        for i in 0..jacobian.n() {
            let column = self.reduce(jacobian.w[i], jacobian.v[i]);
            for r in 0..6 {
                out[r][i] = column[r];
            }
        }
        out
    }
}

impl Task {
    /// A tool that may spin about `axis` (tool frame, any length).
    pub fn axisymmetric(axis: Vec3) -> Result<Self> {
        check_finite("axis", &axis)?;
        match unit(axis) {
            Some(axis) => Ok(Self::Axisymmetric(axis)),
            None => Err(Error::value("axis", format!("{axis:?}"), "a vector that is not zero")),
        }
    }

    /// Number of components of the twist that matter.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        match self {
            Self::Axisymmetric(_) => 5,
            Self::Full => 6,
            Self::Position => 3,
        }
    }

    /// The twist directions that matter when the tool is at `tool`.
    #[inline(always)]
    pub fn directions(&self, tool: &Frame, length: f64) -> Directions {
        let (angular, count) = match self {
            Self::Axisymmetric(axis) => {
                let (a, b) = perpendicular(tool.rotate(*axis));
                ([a, b, [0.0; 3]], 2)
            }
            Self::Full => (Frame::IDENTITY.axes, 3),
            Self::Position => ([[0.0; 3]; 3], 0),
        };
        Directions { angular, count, length }
    }

    /// The small motion [w; v] that takes the tool to its target: a rotation vector and a translation (Leger 2014, eq. 4.34, from the
    /// actual to the desired pose). Opposite axes are turned about any perpendicular.
    #[inline(always)]
    pub fn error(&self, tool: &Frame, target: &Target) -> (Vec3, Vec3) {
        let w = match self {
            Self::Axisymmetric(axis) => turn(tool.rotate(*axis), target.axis),
            Self::Full => rotation_vector(&tool.axes, &target.rotation),
            Self::Position => [0.0; 3],
        };
        (w, sub(target.position, tool.origin))
    }
}

/// Axes this close to opposite [rad] have no usable direction to turn in: any perpendicular will do.
const OPPOSITE: f64 = 1e-8;

/// The rotation vector that turns unit vector `from` onto `to` along the shortest way.
#[inline(always)]
fn turn(from: Vec3, to: Vec3) -> Vec3 {
    let normal = cross(from, to);
    let sine = norm(normal);
    let cosine = dot(from, to);
    if cosine >= 0.0 || sine > OPPOSITE {
        scale(if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 }, normal)
    } else {
        scale(std::f64::consts::PI, perpendicular(from).0)
    }
}

/// The rotation vector that turns the axes `from` onto the axes `to`.
fn rotation_vector(from: &[Vec3; 3], to: &[Vec3; 3]) -> Vec3 {
    // Twice the sine times the axis is the sum of cross products of corresponding axes.
    let double = add(add(cross(from[0], to[0]), cross(from[1], to[1])), cross(from[2], to[2]));
    let sine = 0.5 * norm(double);
    let cosine = 0.5 * (dot(from[0], to[0]) + dot(from[1], to[1]) + dot(from[2], to[2]) - 1.0);
    if sine > 1e-6 || cosine > 0.0 {
        let factor = if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 };
        return scale(0.5 * factor, double);
    }
    // Half a turn: its axis is the sum of a from axis and its image, for the pair that differs least.
    let mut axis = [0.0; 3];
    for i in 0..3 {
        let sum = add(from[i], to[i]);
        if norm(sum) > norm(axis) {
            axis = sum;
        }
    }
    scale(std::f64::consts::PI / norm(axis), axis)
}
