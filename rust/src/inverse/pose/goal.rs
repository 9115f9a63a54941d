//! What a pose is asked for: how far a tool is from it, and the cost of that.

use crate::inverse::descent::Goal as Wish;
use crate::kinematics::sized::Jacobian;
use crate::linalg::frame::Frame;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::linalg::{Row6, Rows6};
use crate::task::{OrientationVolume, Projector, Target, Task, rotation_vector};

/// A tool this near to a volume \[rad\] is in it.
const INSIDE: f64 = 1e-12;
/// The turn of a difference \[rad\].
const DIFFERENCE: f64 = 1e-6;

/// What of a pose matters.
#[derive(Debug, Clone, Copy)]
pub struct Aim<'a> {
    /// The directions that do; of a volume those of the position.
    pub task: &'a Task,
    /// The orientations that are allowed, relative to that of the target.
    pub volume: Option<&'a OrientationVolume>,
}

impl Aim<'static> {
    /// Position and orientation.
    pub const FULL: Self = Self { task: &Task::FULL, volume: None };
}

/// A target of a task, and the length that makes an angle a distance.
#[derive(Debug, Clone)]
pub(super) struct Goal<'a> {
    pub aim: Aim<'a>,
    pub target: Target,
    pub length: f64,
    /// Every component of the pose matters: what nearly every call asks, and quicker.
    pub whole: bool,
}

/// The motion [w; v] that is left: a rotation vector \[rad\] and a translation \[m\].
pub(super) type Left = (Vec3, Vec3);

impl<'a> Goal<'a> {
    pub fn new(aim: Aim<'a>, target: Target, length: f64) -> Self {
        Self { aim, target, length, whole: *aim.task == Task::FULL && aim.volume.is_none() }
    }

    /// The motion that takes the tool to the target, or to the member of the volume that is nearest to it.
    #[inline(always)]
    pub fn left(&self, tool: &Frame) -> Left {
        if self.whole {
            return (rotation_vector(&tool.axes, &self.target.frame), sub(self.target.position, tool.origin));
        }
        match self.aim.volume {
            None => self.aim.task.error(tool, &self.target),
            Some(volume) => {
                let turn = self.member(volume, tool).map_or([0.0; 3], |axes| rotation_vector(&tool.axes, &axes));
                (turn, sub(self.target.position, tool.origin))
            }
        }
    }

    /// The axes of the member of a volume that is nearest to a tool which is not one; so are those of the pose itself where no volume is.
    #[inline(never)]
    fn member(&self, volume: &OrientationVolume, tool: &Frame) -> Option<[Vec3; 3]> {
        let frame = Frame { axes: self.target.frame, origin: [0.0; 3] };
        let relative = Quaternion::from_axes(&tool.axes.map(|axis| frame.unrotate(axis)));
        let nearest = volume.nearest(&relative);
        (nearest.distance > INSIDE).then(|| nearest.orientation.axes().map(|axis| frame.rotate(axis)))
    }

    /// `|v|^2 + L^2 4 sin^2(|w|/2)`: the squared distance of the tool point and half the squared difference of the rotation matrices, times L^2 (From and
    /// Gravdahl 2007, eqs. 14, 36, with weights 1 and L^2/2).
    pub fn cost(&self, (w, v): &Left) -> f64 {
        let (angle, distance) = (norm(*w), norm(*v));
        distance * distance + (2.0 * self.length * (0.5 * angle).sin()).powi(2)
    }

    /// The cost of a tool frame; with a volume that of the direction of its middle.
    #[inline(always)]
    pub fn cost_of(&self, tool: &Frame) -> f64 {
        let (v, to) = (sub(self.target.position, tool.origin), &self.target.frame);
        if self.aim.volume.is_some() {
            // The member is not worth its while: it is for the order of starts.
            return dot(v, v) + 2.0 * self.length * self.length * (1.0 - dot(tool.axes[2], to[2]));
        }
        if !self.whole {
            return self.cost(&self.aim.task.error(tool, &self.target));
        }
        let cosines = (0..3).map(|k| dot(tool.axes[k], to[k])).sum::<f64>();
        dot(v, v) + self.length * self.length * (3.0 - cosines)
    }

    /// The Jacobian of the task by rows, angular ones times the length, and the motion that is left in these; how many there are. Outside of a volume those
    /// of the nearest member; `loose`, of the angular ones that along the way to it alone.
    #[inline(always)]
    pub fn rows<const C: usize>(&self, tool: &Frame, columns: &Jacobian<C>, left: &Left, loose: bool) -> (Rows6<C>, Row6, usize) {
        if self.whole {
            return (self.all_rows(columns), self.all(left), 6);
        }
        let (w, v) = *left;
        if self.aim.volume.is_none() {
            let b = self.aim.task.directions(tool, self.length).reduce(w, v);
            return (self.aim.task.constraint(tool, &self.target, self.length).jacobian(columns), b, self.aim.task.dimension());
        }
        let (mut rows, mut b, angle) = (self.all_rows(columns), self.all(left), norm(w));
        if !loose && angle > 0.0 {
            return (rows, b, 6);
        }
        // Three of the position, and one of the way to the volume.
        let mut along = [0.0; C];
        if angle > 0.0 {
            along = std::array::from_fn(|i| (0..3).map(|r| rows[r][i] * w[r] / angle).sum());
        }
        rows.rotate_left(3);
        b.rotate_left(3);
        (rows[3], rows[4], rows[5]) = (along, [0.0; C], [0.0; C]);
        (b[3], b[4], b[5]) = (self.length * angle, 0.0, 0.0);
        (rows, b, if angle > 0.0 { 4 } else { 3 })
    }

    #[inline(always)]
    fn all_rows<const C: usize>(&self, columns: &Jacobian<C>) -> Rows6<C> {
        let mut rows = [[0.0; C]; 6];
        for i in 0..columns.n() {
            for r in 0..3 {
                (rows[r][i], rows[r + 3][i]) = (self.length * columns.w[i][r], columns.v[i][r]);
            }
        }
        rows
    }

    #[inline(always)]
    fn all(&self, (w, v): &Left) -> Row6 {
        std::array::from_fn(|r| if r < 3 { self.length * w[r] } else { v[r - 3] })
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
        if let Some(volume) = self.aim.volume {
            let wanted = self.member(volume, tool);
            return Some(Pairs { is: tool.axes, wanted: wanted.unwrap_or(tool.axes), weight: if wanted.is_some() { 0.5 } else { 0.0 } });
        }
        if self.aim.task.linear != Projector::All {
            return None;
        }
        const NONE: [Vec3; 3] = [[0.0; 3]; 3];
        match (self.aim.task.angular, self.aim.task.spin_axis()) {
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

impl Goal<'_> {
    /// The derivative of [`Pairs::torque`] by turns of the tool about x, y and z: by differences in a volume, whose nearest member turns with the tool.
    pub fn torque_rates(&self, tool: &Frame, pairs: &Pairs) -> [Vec3; 3] {
        Frame::IDENTITY.axes.map(|axis| {
            if self.aim.volume.is_none() {
                return pairs.torque_rate(axis);
            }
            let turned = Frame { axes: tool.axes.map(|e| Frame::rotation(axis, DIFFERENCE).rotate(e)), ..*tool };
            self.pairs(&turned).map_or([0.0; 3], |there| scale(1.0 / DIFFERENCE, sub(there.torque(), pairs.torque())))
        })
    }

    /// The cost as a descent wants it, with the member of a volume that is nearest to the tool; `None` for tasks that it does not know.
    pub fn wish(&self, tool: &Frame) -> Option<Wish> {
        let square = self.length.powi(2);
        if let Some(volume) = self.aim.volume {
            let target = Target { frame: self.member(volume, tool).unwrap_or(tool.axes), ..self.target };
            return Wish::of(&Task::FULL, &target, (1.0, 0.5 * square)).ok();
        }
        let weight = if self.aim.task.spin_axis().is_some() { square } else { 0.5 * square };
        Wish::of(self.aim.task, &self.target, (1.0, weight)).ok()
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
