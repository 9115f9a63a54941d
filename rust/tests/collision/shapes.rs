//! Random shapes, poses and bodies; supports of shapes by what is public of them.

use std::f64::consts::PI;

use crate::common::Rng;
use redundancy::collision::{Body, Mount, Shape};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::{Vec3, add, norm, scale};

impl Rng {
    pub fn vector(&mut self, size: f64) -> Vec3 {
        std::array::from_fn(|_| self.within(-size, size))
    }

    pub fn pose(&mut self, size: f64) -> Frame {
        let turned = Frame::rotation(self.direction(), self.within(-PI, PI));
        Frame { origin: self.vector(size), ..turned }
    }

    /// Kinds 0 to 4: sphere, capsule, box, hull, rounded box.
    pub fn shape(&mut self, kind: usize) -> Shape {
        let size = |r: &mut Self| r.within(0.05, 0.4);
        match kind {
            0 => Shape::sphere(size(self)).unwrap(),
            1 => Shape::capsule(size(self), 0.3 * size(self)).unwrap(),
            2 => Shape::cuboid([size(self), size(self), size(self)]).unwrap(),
            3 => self.cloud(20),
            _ => Shape::cuboid([size(self), size(self), size(self)]).unwrap().grown(0.03).unwrap(),
        }
    }

    pub fn cloud(&mut self, count: usize) -> Shape {
        let (offset, extent) = (self.vector(0.1), [self.within(0.1, 0.4), self.within(0.1, 0.4), self.within(0.1, 0.4)]);
        let points: Vec<Vec3> = (0..count)
            .map(|_| {
                let d = self.direction();
                std::array::from_fn(|i| offset[i] + extent[i] * d[i])
            })
            .collect();
        Shape::hull(&points).unwrap()
    }

    pub fn posture(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.within(-2.5, 2.5)).collect()
    }

    pub fn body(&mut self, kind: usize, mount: Mount) -> Body {
        Body { name: format!("{kind}"), mount, pose: self.pose(0.2), shape: self.shape(kind) }
    }
}

/// How far the shape at a pose reaches along a unit vector.
pub fn support(shape: &Shape, pose: &Frame, n: Vec3) -> f64 {
    let (along, at) = (pose.unrotate(n), pose.origin);
    let dot = |a: Vec3, b: Vec3| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let core = match shape.half_extents() {
        Some(half) => (0..3).map(|i| half[i] * along[i].abs()).sum(),
        None => shape.vertices().iter().map(|p| dot(*p, along)).fold(f64::NEG_INFINITY, f64::max),
    };
    dot(at, n) + core + shape.radius()
}

/// Seven capsules, one a link.
pub fn seven_capsules() -> Vec<Body> {
    let lengths = [0.36, 0.0, 0.42, 0.0, 0.4, 0.0, 0.126];
    (0..7)
        .map(|k| {
            let half = if lengths[k] > 0.0 { 0.5 * lengths[k] } else { 0.05 };
            let (shape, pose) = Shape::capsule_between([0.0; 3], [0.0, -2.0 * half, 0.0], 0.07).unwrap();
            Body { name: format!("link {k}"), mount: Mount::Link(k), pose, shape }
        })
        .collect()
}

pub fn stepped(pose: &Frame, twist: &[f64; 6], t: f64) -> Frame {
    let (w, v) = ([twist[0], twist[1], twist[2]], [twist[3], twist[4], twist[5]]);
    let speed = norm(w);
    let turned = if speed > 0.0 { Frame::rotation(scale(1.0 / speed, w), speed * t) } else { Frame::IDENTITY };
    Frame { axes: pose.axes.map(|axis| turned.rotate(axis)), origin: add(pose.origin, scale(t, v)) }
}
