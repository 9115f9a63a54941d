//! Unit quaternions: rotations that multiply cheaply and stay rotations.

use super::vector::{Vec3, add, cross, dot, norm, scale, unit};

/// A unit quaternion [w, x, y, z] (Hamilton): w = cos(a/2), [x, y, z] = sin(a/2) axis. It and its opposite are the same rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion(pub [f64; 4]);

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0]);

    /// Rotation about the unit vector `axis` by `angle` \[rad\] (From and Gravdahl 2007, eq. 2).
    #[inline(never)]
    pub fn about(axis: Vec3, angle: f64) -> Self {
        let (s, c) = (0.5 * angle).sin_cos();
        Self::of(c, scale(s, axis))
    }

    /// Of a scalar and a vector part.
    pub const fn of(w: f64, v: Vec3) -> Self {
        Self([w, v[0], v[1], v[2]])
    }

    /// The vector part.
    pub const fn vector(&self) -> Vec3 {
        [self.0[1], self.0[2], self.0[3]]
    }

    /// self * other (eq. 3): the rotation `other` about the axes that `self` has turned, or first `other`, then `self` about fixed axes.
    #[inline(never)] // one copy: it is everywhere
    pub fn product(&self, other: &Self) -> Self {
        let (a, b) = (self.vector(), other.vector());
        let v = add(add(scale(self.0[0], b), scale(other.0[0], a)), cross(a, b));
        Self::of(self.0[0] * other.0[0] - dot(a, b), v)
    }

    /// The inverse rotation.
    pub fn conjugate(&self) -> Self {
        Self::of(self.0[0], scale(-1.0, self.vector()))
    }

    /// The other quaternion of the same rotation.
    pub fn opposite(&self) -> Self {
        Self(self.0.map(|x| -x))
    }

    /// A vector turned: q a q* (eq. 4).
    pub fn rotate(&self, a: Vec3) -> Vec3 {
        let v = self.vector();
        let twice = scale(2.0, cross(v, a));
        add(add(a, scale(self.0[0], twice)), cross(v, twice))
    }

    /// The sum of products of the components.
    pub fn dot(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| a * b).sum()
    }

    /// Of length one; `None` for zero and for what is not finite.
    pub fn normalized(&self) -> Option<Self> {
        let largest = self.0.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if !(largest > 0.0 && self.0.iter().all(|x| x.is_finite())) {
            return None;
        }
        let scaled = Self(self.0.map(|x| x / largest));
        let length = scaled.dot(&scaled).sqrt();
        Some(Self(scaled.0.map(|x| x / length)))
    }

    /// The smallest angle \[rad\] of a rotation between the two, 0 to pi, exact to rounding near both ends.
    pub fn angle_to(&self, other: &Self) -> f64 {
        self.conjugate().product(other).angle()
    }

    /// The angle \[rad\] of the rotation, 0 to pi.
    pub fn angle(&self) -> f64 {
        2.0 * norm(self.vector()).atan2(self.0[0].abs())
    }

    /// Unit axis and angle \[rad\], 0 to pi; the axis is z where nothing turns.
    pub fn axis_angle(&self) -> (Vec3, f64) {
        let v = scale(1.0f64.copysign(self.0[0]), self.vector());
        (unit(v).unwrap_or([0.0, 0.0, 1.0]), self.angle())
    }

    /// The axes of the turned frame: the columns of the rotation matrix (eq. 36 to 38).
    pub fn axes(&self) -> [Vec3; 3] {
        let [w, x, y, z] = self.0;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    /// From the axes of a turned frame, by the largest of its four components, so that half turns lose no digits (Shepperd 1978).
    pub fn from_axes([x, y, z]: &[Vec3; 3]) -> Self {
        let trace = x[0] + y[1] + z[2];
        let sums = [y[2] - z[1], z[0] - x[2], x[1] - y[0]];
        let pairs = [y[2] + z[1], z[0] + x[2], x[1] + y[0]];
        let diagonal = [x[0], y[1], z[2]];
        let largest = (0..3).fold(0, |m, i| if diagonal[i] > diagonal[m] { i } else { m });
        let four = if trace >= diagonal[largest] {
            [1.0 + trace, sums[0], sums[1], sums[2]]
        } else {
            let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
            let mut four = [sums[i], 0.0, 0.0, 0.0];
            four[1 + i] = 1.0 + 2.0 * diagonal[i] - trace;
            four[1 + j] = pairs[k];
            four[1 + k] = pairs[j];
            four
        };
        Self(four).normalized().unwrap_or(Self::IDENTITY)
    }
}
