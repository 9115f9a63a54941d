//! Convex shapes: a core, and the radius of a ball rolled over it.

use std::sync::Arc;

use super::hull::Hull;
use crate::error::{Error, Result, check_finite, check_positive};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, dot, norm, perpendicular, scale, sub, unit};

/// What the ball is rolled over.
#[derive(Debug, Clone)]
pub(super) enum Core {
    /// Half extents along x, y, z, centred at the origin: a box, or with zeros a stick along z (0, 0, h) or a point (0, 0, 0).
    Block(Vec3),
    /// The convex hull of points.
    Hull(Arc<Hull>),
}

/// A convex shape in a frame of its own. Copies share the points of a hull.
#[derive(Debug, Clone)]
pub struct Shape {
    pub(super) core: Core,
    pub(super) radius: f64,
}

impl Shape {
    /// A ball about the origin \[m\].
    pub fn sphere(radius: f64) -> Result<Self> {
        Ok(Self { core: Core::Block([0.0; 3]), radius: check_positive("radius", radius)? })
    }

    /// All points within `radius` of the segment from -half_length to half_length on the z axis \[m\].
    pub fn capsule(half_length: f64, radius: f64) -> Result<Self> {
        Ok(Self { core: Core::Block([0.0, 0.0, check_positive("half_length", half_length)?]), radius: check_positive("radius", radius)? })
    }

    /// The capsule about the segment from `a` to `b`, and its pose in the frame in which these are given.
    pub fn capsule_between(a: Vec3, b: Vec3, radius: f64) -> Result<(Self, Frame)> {
        check_finite("a", &a)?;
        check_finite("b", &b)?;
        let axis = sub(b, a);
        let z = unit(axis).ok_or_else(|| Error::value("b", format!("{b:?}"), "a point other than a"))?;
        let (x, y) = perpendicular(z);
        Ok((Self::capsule(0.5 * norm(axis), radius)?, Frame { axes: [x, y, z], origin: scale(0.5, add(a, b)) }))
    }

    /// A box centred at the origin, from its half extents along x, y, z \[m\].
    pub fn cuboid(half_extents: Vec3) -> Result<Self> {
        for half in half_extents {
            check_positive("half_extents", half)?;
        }
        Ok(Self { core: Core::Block(half_extents), radius: 0.0 })
    }

    /// The convex hull of points \[m\], which must not lie in a plane.
    pub fn hull(points: &[Vec3]) -> Result<Self> {
        Ok(Self { core: Core::Hull(Arc::new(Hull::new(points)?)), radius: 0.0 })
    }

    /// The same shape with every point within `margin` of it \[m\]: a safety distance, or rounded edges, with which distances are smooth.
    pub fn grown(&self, margin: f64) -> Result<Self> {
        Ok(Self { core: self.core.clone(), radius: self.radius + check_positive("margin", margin)? })
    }

    /// The radius of the ball rolled over the core \[m\].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Half extents of a core that is a box, (0, 0, h) of a stick, (0, 0, 0) of a point; none of a hull.
    pub fn half_extents(&self) -> Option<Vec3> {
        match &self.core {
            Core::Block(half) => Some(*half),
            Core::Hull(_) => None,
        }
    }

    /// The vertices of a hull, in the shape's frame.
    pub fn vertices(&self) -> Vec<Vec3> {
        match &self.core {
            Core::Block(_) => Vec::new(),
            Core::Hull(hull) => hull.points.iter().map(|p| add(*p, hull.centre)).collect(),
        }
    }

    /// The farthest that a point of the shape is from [`Shape::centre`].
    #[inline]
    pub(super) fn reach(&self) -> f64 {
        self.core.reach() + self.radius
    }

    /// The shape at a pose, by the frame of its core: axes of the pose, origin in the middle of the core.
    #[inline]
    pub(super) fn core_frame(&self, pose: &Frame) -> Frame {
        match &self.core {
            Core::Block(_) => *pose,
            Core::Hull(hull) => Frame { axes: pose.axes, origin: add(pose.origin, pose.rotate(hull.centre)) },
        }
    }
}

impl Core {
    /// The farthest that a point of the core is from its middle.
    #[inline]
    pub(super) fn reach(&self) -> f64 {
        match self {
            Self::Block(half) => norm(*half),
            Self::Hull(hull) => hull.reach,
        }
    }

    /// The point of the core farthest along a direction, both in the core's frame.
    #[inline]
    pub(super) fn support(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Block(half) => std::array::from_fn(|i| half[i].copysign(direction[i])),
            Self::Hull(hull) => {
                let (mut best, mut most) = (hull.points[0], f64::NEG_INFINITY);
                for &point in &hull.points {
                    let along = dot(point, direction);
                    if along > most {
                        (best, most) = (point, along);
                    }
                }
                best
            }
        }
    }
}
