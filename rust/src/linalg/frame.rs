//! Rigid transforms.

use super::real::Real;
use super::vector::{Vec3, add, cross, dot, norm, scale};
use crate::error::{Error, Result, check_finite};

/// A rigid transform: the three axes of a frame and its origin, both in the parent frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<T = f64> {
    /// Unit vectors x, y, z of the frame, in the parent frame.
    pub axes: [Vec3<T>; 3],
    /// Origin of the frame, in the parent frame \[m\].
    pub origin: Vec3<T>,
}

/// How far the rotation part of a user's transform may be from orthogonal before it is refused; within it, it is re-orthogonalised.
const ORTHOGONALITY: f64 = 1e-6;

/// How far it may be for the matrix to be taken as it is.
const ROUNDING: f64 = 1e-14;

/// How far the last row of a user's matrix may be from [0, 0, 0, 1].
const LAST_ROW: f64 = 1e-12;

/// What multiples of a right angle miss zero by.
const ROUNDING_OF_PI: f64 = 1e-15;

impl<T: Real> Frame<T> {
    /// The same fixed frame in every lane.
    #[inline(always)]
    pub fn splat(frame: &Frame) -> Self {
        Self { axes: frame.axes.map(|axis| axis.map(T::splat)), origin: frame.origin.map(T::splat) }
    }

    /// A vector of this frame in the parent frame.
    #[inline(always)]
    pub fn rotate(&self, a: Vec3) -> Vec3<T> {
        let [x, y, z] = self.axes;
        let a = a.map(T::splat);
        std::array::from_fn(|r| x[r] * a[0] + y[r] * a[1] + z[r] * a[2])
    }

    /// self * other, a fixed one.
    #[inline(always)]
    pub fn compose(&self, other: &Frame) -> Self {
        Self {
            axes: [self.rotate(other.axes[0]), self.rotate(other.axes[1]), self.rotate(other.axes[2])],
            origin: add(self.origin, self.rotate(other.origin)),
        }
    }

    /// This frame turned about its own z axis by the angle whose cosine and sine are given.
    #[inline(always)]
    pub fn turn_z(&self, cosine: T, sine: T) -> Self {
        let [x, y, z] = self.axes;
        Self { axes: [add(scale(cosine, x), scale(sine, y)), add(scale(-sine, x), scale(cosine, y)), z], origin: self.origin }
    }
}

impl Frame {
    /// No rotation, no translation.
    pub const IDENTITY: Self = Self { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin: [0.0; 3] };

    /// A vector of the parent frame in this frame.
    #[inline(always)]
    pub fn unrotate(&self, a: Vec3) -> Vec3 {
        [dot(self.axes[0], a), dot(self.axes[1], a), dot(self.axes[2], a)]
    }

    /// The inverse transform.
    pub fn inverse(&self) -> Self {
        let transposed = std::array::from_fn(|c| std::array::from_fn(|r| self.axes[r][c]));
        Self { axes: transposed, origin: scale(-1.0, self.unrotate(self.origin)) }
    }

    /// Rotation about the unit vector `axis` by `angle` \[rad\].
    pub fn rotation(axis: Vec3, angle: f64) -> Self {
        let (s, c) = exact_sin_cos(angle);
        let column = |e: Vec3| add(add(scale(c, e), scale(s, cross(axis, e))), scale((1.0 - c) * dot(axis, e), axis));
        Self { axes: Self::IDENTITY.axes.map(column), origin: [0.0; 3] }
    }

    /// Translation.
    pub const fn translation(origin: Vec3) -> Self {
        Self { axes: Self::IDENTITY.axes, origin }
    }

    /// From a row-major 4 x 4 homogeneous matrix; its rotation must be orthogonal to 1e-6 and right-handed.
    pub fn from_matrix(name: &str, matrix: &[f64]) -> Result<Self> {
        if matrix.len() != 16 {
            return Err(Error::Shape { name: name.into(), got: format!("{} numbers", matrix.len()), expected: "(4, 4)".into() });
        }
        check_finite(name, matrix)?;
        if matrix[12..15].iter().any(|x| x.abs() > LAST_ROW) || (matrix[15] - 1.0).abs() > LAST_ROW {
            return Err(Error::value(name, format!("a matrix with last row {:?}", &matrix[12..16]), "last row [0, 0, 0, 1]"));
        }
        let column = |c: usize| [matrix[c], matrix[4 + c], matrix[8 + c]];
        let (x, y, z) = (column(0), column(1), column(2));
        let defect = [dot(x, x) - 1.0, dot(y, y) - 1.0, dot(z, z) - 1.0, dot(x, y), dot(y, z), dot(z, x), dot(cross(x, y), z) - 1.0];
        if let Some(worst) = defect.into_iter().find(|d| d.abs() > ORTHOGONALITY) {
            return Err(Error::value(
                name,
                format!("a matrix whose rotation part is off by {worst:.3e}"),
                "an orthogonal rotation of determinant +1",
            ));
        }
        // A rotation that is orthogonal to rounding is kept bit for bit, so that what was saved is what is loaded.
        if defect.iter().all(|d| d.abs() <= ROUNDING) {
            return Ok(Self { axes: [x, y, z], origin: column(3) });
        }
        let x = scale(1.0 / norm(x), x);
        let z = cross(x, y);
        let z = scale(1.0 / norm(z), z);
        Ok(Self { axes: [x, cross(z, x), z], origin: column(3) })
    }

    /// Writes the row-major 4 x 4 homogeneous matrix.
    #[inline(always)]
    pub fn write_matrix(&self, out: &mut [f64; 16]) {
        for r in 0..3 {
            for c in 0..3 {
                out[4 * r + c] = self.axes[c][r];
            }
            out[4 * r + 3] = self.origin[r];
        }
        out[12..16].copy_from_slice(&[0.0, 0.0, 0.0, 1.0]);
    }

    /// The row-major 4 x 4 homogeneous matrix.
    pub fn matrix(&self) -> [f64; 16] {
        let mut out = [0.0; 16];
        self.write_matrix(&mut out);
        out
    }
}

/// Sine and cosine of a constant angle, with the rounding of pi removed: a right angle written in radians or degrees gives an exact zero
/// and an exact one. Both are rounded or neither, so that frames stay orthogonal.
pub fn exact_sin_cos(angle: f64) -> (f64, f64) {
    let (s, c) = angle.sin_cos();
    if s.abs() < ROUNDING_OF_PI {
        (0.0, c.signum())
    } else if c.abs() < ROUNDING_OF_PI {
        (s.signum(), 0.0)
    } else {
        (s, c)
    }
}
