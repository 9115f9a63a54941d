//! Convex hulls.

use parry3d_f64::math::Vector;
use parry3d_f64::transformation::try_convex_hull;

use crate::error::{Error, Result, check_finite};
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};

/// The least volume of a hull over the cube of its size: flatter ones have no depth to be pushed out of.
const FLAT: f64 = 1e-9;

/// The vertices of a convex hull, about the middle of its bounding box.
#[derive(Debug, Clone)]
pub(super) struct Hull {
    pub(super) centre: Vec3,
    pub(super) points: Vec<Vec3>,
    pub(super) reach: f64,
}

impl Hull {
    pub(super) fn new(points: &[Vec3]) -> Result<Self> {
        check_finite("points", points.as_flattened())?;
        let flat = || Error::value("points", format!("{} points", points.len()), "at least 4 that do not lie in a plane");
        if points.len() < 4 {
            return Err(flat());
        }
        let bound = |pick: fn(f64, f64) -> f64| points.iter().fold(points[0], |m, p| std::array::from_fn(|i| pick(m[i], p[i])));
        let (low, high) = (bound(f64::min), bound(f64::max));
        let (centre, size) = (scale(0.5, add(low, high)), norm(sub(high, low)));
        if !(size > 0.0 && size.is_finite()) {
            return Err(flat());
        }
        // parry's tolerances are absolute: it works at size one.
        let unit: Vec<Vector> = points.iter().map(|p| Vector::from_array(scale(1.0 / size, sub(*p, centre)))).collect();
        let (vertices, triangles) = try_convex_hull(&unit).map_err(|_| flat())?;
        let volume: f64 =
            triangles.iter().map(|t| t.map(|i| vertices[i as usize].to_array())).map(|[a, b, c]| dot(a, cross(b, c)) / 6.0).sum();
        if volume.abs() < FLAT {
            return Err(flat());
        }
        // Vertices that no triangle uses are inside.
        let mut used = vec![false; vertices.len()];
        for index in triangles.as_flattened() {
            used[*index as usize] = true;
        }
        let points: Vec<Vec3> = (0..vertices.len()).filter(|i| used[*i]).map(|i| scale(size, vertices[i].to_array())).collect();
        let reach = points.iter().fold(0.0f64, |m, p| m.max(norm(*p)));
        Ok(Self { centre, points, reach })
    }
}
