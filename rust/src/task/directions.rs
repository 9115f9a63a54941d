//! The directions of a task at a posture: from twists to the components that matter, and back.

use crate::kinematics::sized::Jacobian;
use crate::linalg::vector::{Vec3, add, cross, dot, scale, sub};
use crate::linalg::{Row6, Rows6};

/// The twist directions that matter at a posture: unit vectors of the angular part, then of the linear part, at the point that the task
/// speaks of.
#[derive(Debug, Clone, Copy)]
pub struct Directions {
    pub(super) angular: [Vec3; 3],
    pub(super) linear: [Vec3; 3],
    pub(super) counts: (usize, usize),
    /// From the tool point to the point that the task speaks of.
    pub(super) arm: Vec3,
    pub(super) length: f64,
}

impl Directions {
    /// All six, along the axes of the base frame: those of [`super::Task::FULL`], known to the compiler.
    #[inline(always)]
    pub fn all(length: f64) -> Self {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { angular: axes, linear: axes, counts: (3, 3), arm: [0.0; 3], length }
    }

    /// The length that multiplies angular components.
    #[inline(always)]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Dimension of the task.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        self.counts.0 + self.counts.1
    }

    /// The components of a twist that matter, angular ones times the length.
    #[inline(always)]
    pub fn reduce(&self, w: Vec3, v: Vec3) -> Row6 {
        let (angular, linear) = self.counts;
        let v = add(v, cross(w, self.arm));
        let mut out = [0.0; 6];
        for i in 0..angular {
            out[i] = self.length * dot(self.angular[i], w);
        }
        for i in 0..linear {
            out[angular + i] = dot(self.linear[i], v);
        }
        out
    }

    /// The transpose of [`Directions::reduce`].
    #[inline(always)]
    pub fn expand(&self, components: &Row6) -> (Vec3, Vec3) {
        let (angular, linear) = self.counts;
        let (mut w, mut v) = ([0.0; 3], [0.0; 3]);
        for i in 0..angular {
            w = add(w, scale(self.length * components[i], self.angular[i]));
        }
        for i in 0..linear {
            v = add(v, scale(components[angular + i], self.linear[i]));
        }
        (add(w, cross(self.arm, v)), v)
    }

    /// The twist at the tool point that these components make, for a length of 1.
    #[inline(always)]
    pub fn motion_of(&self, components: &Row6) -> (Vec3, Vec3) {
        let (angular, linear) = self.counts;
        let (mut w, mut v) = ([0.0; 3], [0.0; 3]);
        for i in 0..angular {
            w = add(w, scale(components[i], self.angular[i]));
        }
        for i in 0..linear {
            v = add(v, scale(components[angular + i], self.linear[i]));
        }
        (w, sub(v, cross(w, self.arm)))
    }

    /// The twist at the tool point that component `r` of [`Directions::reduce`] makes alone.
    pub fn direction(&self, r: usize) -> (Vec3, Vec3) {
        match r.checked_sub(self.counts.0) {
            None => {
                let w = scale(1.0 / self.length, self.angular[r]);
                (w, cross(self.arm, w))
            }
            Some(r) => ([0.0; 3], self.linear[r]),
        }
    }

    /// The part of a twist in the task subspace, `T t` (Huo 2009, eq. 3.6): projected at the point that the task speaks of, given and answered
    /// at the tool point.
    #[inline(always)]
    pub fn project(&self, w: Vec3, v: Vec3) -> (Vec3, Vec3) {
        let (angular, linear) = self.counts;
        let v = add(v, cross(w, self.arm));
        let (mut task_w, mut task_v) = ([0.0; 3], [0.0; 3]);
        for i in 0..angular {
            task_w = add(task_w, scale(dot(self.angular[i], w), self.angular[i]));
        }
        for i in 0..linear {
            task_v = add(task_v, scale(dot(self.linear[i], v), self.linear[i]));
        }
        (task_w, sub(task_v, cross(task_w, self.arm)))
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
