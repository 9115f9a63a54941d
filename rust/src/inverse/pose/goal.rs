//! What a pose is asked for: how far a tool is from it, and the cost of that.

use crate::kinematics::sized::Jacobian;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::linalg::{Row6, Rows6};
use crate::task::{Projector, Target, Task, rotation_vector};

/// A target of a task, and the length that makes an angle a distance.
#[derive(Debug, Clone)]
pub(super) struct Goal<'a> {
    pub task: &'a Task,
    pub target: Target,
    pub length: f64,
    /// Every component of the pose matters: what nearly every call asks, and quicker.
    whole: bool,
}

/// The motion [w; v] that is left: a rotation vector \[rad\] and a translation \[m\].
pub(super) type Left = (Vec3, Vec3);

impl<'a> Goal<'a> {
    pub fn new(task: &'a Task, target: Target, length: f64) -> Self {
        Self { task, target, length, whole: *task == Task::FULL }
    }

    /// The motion that takes the tool to the target.
    #[inline(always)]
    pub fn left(&self, tool: &Frame) -> Left {
        if self.whole {
            (rotation_vector(&tool.axes, &self.target.frame), sub(self.target.position, tool.origin))
        } else {
            self.task.error(tool, &self.target)
        }
    }

    /// `|v|^2 + L^2 4 sin^2(|w|/2)`: the squared distance of the tool point and half the squared difference of the rotation matrices, times L^2 (From and
    /// Gravdahl 2007, eqs. 14, 36, with weights 1 and L^2/2).
    pub fn cost(&self, (w, v): &Left) -> f64 {
        let (angle, distance) = (norm(*w), norm(*v));
        distance * distance + (2.0 * self.length * (0.5 * angle).sin()).powi(2)
    }

    /// The cost of a tool frame.
    #[inline(always)]
    pub fn cost_of(&self, tool: &Frame) -> f64 {
        if !self.whole {
            return self.cost(&self.task.error(tool, &self.target));
        }
        let (v, to) = (sub(self.target.position, tool.origin), &self.target.frame);
        let cosines = (0..3).map(|k| dot(tool.axes[k], to[k])).sum::<f64>();
        dot(v, v) + self.length * self.length * (3.0 - cosines)
    }

    /// The Jacobian of the task by rows, angular ones times the length, and the motion that is left in these; how many there are.
    #[inline(always)]
    pub fn rows<const C: usize>(&self, tool: &Frame, columns: &Jacobian<C>, (w, v): &Left) -> (Rows6<C>, Row6, usize) {
        if !self.whole {
            return self.rows_of_task(tool, columns, (*w, *v));
        }
        let mut rows = [[0.0; C]; 6];
        for i in 0..columns.n() {
            for r in 0..3 {
                (rows[r][i], rows[r + 3][i]) = (self.length * columns.w[i][r], columns.v[i][r]);
            }
        }
        let b = std::array::from_fn(|r| if r < 3 { self.length * w[r] } else { v[r - 3] });
        (rows, b, 6)
    }

    #[inline(never)]
    fn rows_of_task<const C: usize>(&self, tool: &Frame, columns: &Jacobian<C>, (w, v): Left) -> (Rows6<C>, Row6, usize) {
        let b = self.task.directions(tool, self.length).reduce(w, v);
        (self.task.constraint(tool, &self.target, self.length).jacobian(columns), b, self.task.dimension())
    }
}

/// Directions of the tool and what they are to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pairs {
    is: [Vec3; 3],
    wanted: [Vec3; 3],
    /// What the cross products count.
    weight: f64,
}

impl Goal<'_> {
    /// The directions whose squared differences the cost holds: three axes by half, or the axis of a tool that may spin; `None` for other tasks.
    pub fn pairs(&self, tool: &Frame) -> Option<Pairs> {
        if self.task.linear != Projector::All {
            return None;
        }
        const NONE: [Vec3; 3] = [[0.0; 3]; 3];
        match (self.task.angular, self.task.spin_axis()) {
            (Projector::All, _) => Some(Pairs { is: tool.axes, wanted: self.target.frame, weight: 0.5 }),
            (Projector::None, _) => Some(Pairs { is: NONE, wanted: NONE, weight: 0.0 }),
            (_, Some(axis)) => {
                let wanted = Frame { axes: self.target.frame, origin: [0.0; 3] };
                let (mut is, mut to) = (NONE, NONE);
                (is[0], to[0]) = (tool.rotate(axis), self.target.axis.unwrap_or_else(|| wanted.rotate(axis)));
                Some(Pairs { is, wanted: to, weight: 1.0 })
            }
            _ => None,
        }
    }
}

impl Pairs {
    /// The sum of cross products: what turns the tool, and minus half the derivative of the squared differences by a turn.
    pub fn torque(&self) -> Vec3 {
        let sum = (0..3).fold([0.0; 3], |sum, k| add(sum, cross(self.is[k], self.wanted[k])));
        scale(self.weight, sum)
    }

    /// Its derivative by a turn w of the tool: of the sum of `(w x c) x d`.
    pub fn torque_rate(&self, w: Vec3) -> Vec3 {
        let each = |k: usize| sub(scale(dot(w, self.wanted[k]), self.is[k]), scale(dot(self.is[k], self.wanted[k]), w));
        scale(self.weight, (0..3).fold([0.0; 3], |sum, k| add(sum, each(k))))
    }
}
