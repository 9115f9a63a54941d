//! Orientation volumes: which orientations relative to a frame are allowed (From and Gravdahl 2007, eq. 6, 7 and 12).
//!
//! A volume is seen in a frame: the orientation q of a tool is a member when q' = P* q is, with P the [`OrientationVolume::reference`]. The tool's
//! axis is z' = R(q') z, the spin a turn about it. With the shares that the source leaves open defined so that each can be tested:
//!
//! | kind | members |
//! |---|---|
//! | cone | tilted by at most `tilt` towards any heading; spin is the twist about z |
//! | pyramid | Qx(a) Qy(b) Qz(c), with \|a\| and \|b\| bounded, c the spin |
//! | line | a pyramid without one of the two |
//! | square | \|z'_x\| <= sin(tilt_y), \|z'_y\| <= sin(tilt_x), z'_z >= 0; spin is the twist about z |
//! | product | rotations about fixed axes one after another, each about an axis that those before have turned |

mod best;
mod distance;
mod grid;
mod product;
mod range;
mod samples;
mod share;
mod sides;
mod sphere;
mod twist;

pub use best::Nearest;
pub use distance::SignedDistance;
pub use grid::Member;
pub use range::Range;
pub use sides::{MAX_SIDES, Side, Sides};

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use crate::error::{Error, Result, check_finite};
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, unit};

/// Most factors of a product.
const MAX_FACTORS: usize = 16;

/// One rotation of a product.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    /// Unit vector.
    pub axis: Vec3,
    /// Angles allowed.
    pub range: Range,
}

/// What is allowed, seen in the reference.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Tilts up to an angle.
    Cone(f64),
    /// Tilts about x and then about y.
    Pyramid([f64; 2]),
    /// The shadow of the tool's axis in a rectangle, by the tilts about x and about y.
    Square([f64; 2]),
    /// Rotations one after another.
    Product(Arc<[Factor]>),
}

/// A set of orientations that a task allows.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationVolume {
    reference: Quaternion,
    shape: Shape,
    spin: Range,
    /// Sine and cosine of the tilt of a cone.
    sine: f64,
    cosine: f64,
}

fn tilt(name: &str, value: f64, most: f64) -> Result<f64> {
    if (0.0..=most).contains(&value) {
        Ok(value)
    } else {
        Err(Error::value(name, value, if most == PI { "0 to pi [rad]" } else { "0 to pi/2 [rad]" }))
    }
}

impl OrientationVolume {
    fn new(shape: Shape, spin: Option<(f64, f64)>) -> Result<Self> {
        let spin = spin.map_or(Ok(Range::FREE), |(low, high)| Range::new("spin", low, high))?;
        let (sine, cosine) = if let Shape::Cone(tilt) = &shape { tilt.sin_cos() } else { (0.0, 1.0) };
        Ok(Self { reference: Quaternion::IDENTITY, shape, spin, sine, cosine })
    }

    /// The tool's axis tilted by at most `tilt` \[rad\], 0 to pi; the spin free, or its twist about z within a range.
    pub fn cone(most: f64, spin: Option<(f64, f64)>) -> Result<Self> {
        Self::new(Shape::Cone(tilt("tilt", most, PI)?), spin)
    }

    /// Tilted about x by at most `tilt_x`, then about y by at most `tilt_y`, 0 to pi, then spun. Its corners are tilted by more than either.
    pub fn pyramid(tilt_x: f64, tilt_y: f64, spin: Option<(f64, f64)>) -> Result<Self> {
        Self::new(Shape::Pyramid([tilt("tilt_x", tilt_x, PI)?, tilt("tilt_y", tilt_y, PI)?]), spin)
    }

    /// The shadow of the tool's axis within +-sin(tilt_y) along x and +-sin(tilt_x) along y, 0 to pi/2; spin as of a cone.
    pub fn square(tilt_x: f64, tilt_y: f64, spin: Option<(f64, f64)>) -> Result<Self> {
        Self::new(Shape::Square([tilt("tilt_x", tilt_x, FRAC_PI_2)?, tilt("tilt_y", tilt_y, FRAC_PI_2)?]), spin)
    }

    /// Tilted about x alone, then spun.
    pub fn line_x(most: f64, spin: Option<(f64, f64)>) -> Result<Self> {
        Self::new(Shape::Pyramid([tilt("tilt", most, PI)?, 0.0]), spin)
    }

    /// Tilted about y alone, then spun.
    pub fn line_y(most: f64, spin: Option<(f64, f64)>) -> Result<Self> {
        Self::new(Shape::Pyramid([0.0, tilt("tilt", most, PI)?]), spin)
    }

    /// Rotations about fixed axes of any length but zero, each with its lowest and highest angle (eq. 6).
    pub fn product(factors: &[(Vec3, f64, f64)]) -> Result<Self> {
        if !(1..=MAX_FACTORS).contains(&factors.len()) {
            return Err(Error::value("factors", format!("{} rotations", factors.len()), "1 to 16"));
        }
        let one = |(i, &(axis, low, high)): (usize, &(Vec3, f64, f64))| {
            let name = format!("factors[{i}]");
            check_finite(&name, &axis)?;
            let axis = unit(axis).ok_or_else(|| Error::value(&name, format!("about {axis:?}"), "an axis that is not zero"))?;
            Ok(Factor { axis, range: Range::new(&name, low, high)? })
        };
        Self::new(Shape::Product(factors.iter().enumerate().map(one).collect::<Result<_>>()?), None)
    }

    /// The volume seen in the frame `p` (eq. 12): p V.
    pub fn reoriented(&self, p: &Quaternion) -> Self {
        let reference = p.product(&self.reference);
        Self { reference: reference.normalized().unwrap_or(self.reference), ..self.clone() }
    }

    /// The frame that the volume is seen in.
    pub fn reference(&self) -> Quaternion {
        self.reference
    }

    /// What is allowed.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Spins allowed; of a product those of its factors count alone.
    pub fn spin(&self) -> Range {
        self.spin
    }

    /// "cone", "pyramid", "square", "line_x", "line_y" or "product".
    pub fn kind(&self) -> &'static str {
        match self.shape {
            Shape::Cone(_) => "cone",
            Shape::Pyramid([x, y]) if x > 0.0 && y == 0.0 => "line_x",
            Shape::Pyramid([x, y]) if x == 0.0 && y > 0.0 => "line_y",
            Shape::Pyramid(_) => "pyramid",
            Shape::Square(_) => "square",
            Shape::Product(_) => "product",
        }
    }
}
