//! Orthogonal projectors of three-dimensional motions (Huo 2009, eq. 3.2, 3.3).

use crate::error::{Error, Result, check_finite};
use crate::linalg::vector::{Vec3, perpendicular, unit};

/// Which directions of a three-dimensional motion matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projector {
    /// None: the motion is free.
    None,
    /// Along a unit vector.
    Line(Vec3),
    /// In the plane normal to a unit vector.
    Plane(Vec3),
    /// All three.
    All,
}

impl Projector {
    /// Along `direction`, of any length.
    pub fn line(direction: Vec3) -> Result<Self> {
        checked(direction).map(Self::Line)
    }

    /// In the plane normal to `normal`, of any length.
    pub fn plane(normal: Vec3) -> Result<Self> {
        checked(normal).map(Self::Plane)
    }

    /// Rank of the projector.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Line(_) => 1,
            Self::Plane(_) => 2,
            Self::All => 3,
        }
    }

    /// `1 - M`: what this one leaves free.
    pub fn complement(&self) -> Self {
        match *self {
            Self::None => Self::All,
            Self::Line(e) => Self::Plane(e),
            Self::Plane(e) => Self::Line(e),
            Self::All => Self::None,
        }
    }

    /// An orthonormal basis of its range, of [`Projector::dimension`] vectors, in the frame that `turn` takes its vector to.
    #[inline(always)]
    pub fn basis(&self, turn: impl Fn(Vec3) -> Vec3) -> [Vec3; 3] {
        const ZERO: Vec3 = [0.0; 3];
        match *self {
            Self::None => [ZERO; 3],
            Self::Line(e) => [turn(e), ZERO, ZERO],
            Self::Plane(e) => {
                let (a, b) = perpendicular(turn(e));
                [a, b, ZERO]
            }
            Self::All => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        }
    }
}

fn checked(vector: Vec3) -> Result<Vec3> {
    check_finite("axis", &vector)?;
    unit(vector).ok_or_else(|| Error::value("axis", format!("{vector:?}"), "a vector that is not zero"))
}
