//! What a descent minimises: how far the tool misses its goal, and what points and joints add to that.

use super::cosine::Cosine;
use super::form::Form;
use super::half_angle::HalfAngle;
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::robot::Joint;
use crate::task::{OrientationVolume, Target, Task};

/// Points of their own that a cost has at most.
pub const MAX_POINTS: usize = 8;

/// How a miss of the orientation is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// |C - D|_F^2 = 8 sin^2(w/2), w the angle of error.
    Frobenius,
    /// 2 - 2 |<c, d>| = 4 sin^2(w/4), the smaller of both signs of the quaternion.
    Quaternion,
}

/// What is wanted of the orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Orientation {
    /// Nothing.
    Free,
    /// A direction in the base frame for an axis of the tool, both of length one; measured by |z - z_d|^2.
    Axis {
        /// In the tool frame.
        tool: Vec3,
        /// In the base frame.
        direction: Vec3,
    },
    /// The axes of the tool frame in the base frame.
    Whole([Vec3; 3]),
}

/// Where the tool has to be, and what a miss costs (From and Gravdahl 2007, eq. 9 to 12): `w_p |p - p_d|^2 + w_o E_o`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Of the tool point \[m\].
    pub position: Vec3,
    /// Of the tool frame.
    pub orientation: Orientation,
    /// w_p \[1/m^2\].
    pub position_weight: f64,
    /// w_o.
    pub orientation_weight: f64,
    /// E_o.
    pub metric: Metric,
}

/// A point of a link that is drawn to a place, or kept off one (an elbow, an obstacle; eq. 43): `weight |p - goal|^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// How many joints carry it: it is fixed in the frame after that many.
    pub joints: usize,
    /// Where, in that frame \[m\].
    pub at: Vec3,
    /// Where it is to be, in the base frame \[m\].
    pub goal: Vec3,
    /// Below zero: it is to be elsewhere \[1/m^2\].
    pub weight: f64,
}

/// A joint that is drawn to a value: `weight (1 - cos(q - middle))` if it turns, `weight (q - middle)^2 / 2` if it slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centre {
    /// Which joint.
    pub joint: usize,
    /// The value [rad or m].
    pub middle: f64,
    /// Weight.
    pub weight: f64,
}

/// The cost of a posture.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// Of the tool.
    pub goal: Goal,
    /// Of points of links, at most [`MAX_POINTS`].
    pub points: Vec<Point>,
    /// Of joints.
    pub centres: Vec<Centre>,
}

/// Where a posture has what a cost looks at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    /// The goal, with the orientation that is wanted of this posture.
    pub goal: Goal,
    pub tool: Frame,
    pub points: [Vec3; MAX_POINTS],
}

impl Goal {
    /// Of a task: the whole pose, an axis of the tool and a position, or a position.
    pub fn of(task: &Task, target: &Target, (position_weight, orientation_weight): (f64, f64)) -> Result<Self> {
        let there = Frame { axes: target.frame, origin: [0.0; 3] };
        let orientation = match (task.kind(), task.spin_axis()) {
            ("full", _) => Orientation::Whole(target.frame),
            ("position", _) => Orientation::Free,
            (_, Some(tool)) => Orientation::Axis { tool, direction: target.axis.unwrap_or_else(|| there.rotate(tool)) },
            (kind, None) => return Err(Error::value("task", format!("a {kind} one"), "full, axisymmetric or position")),
        };
        Ok(Self { position: target.position, orientation, position_weight, orientation_weight, metric: Metric::Frobenius })
    }

    /// The cost of a tool frame.
    pub fn cost(&self, tool: &Frame) -> f64 {
        let miss = sub(tool.origin, self.position);
        self.position_weight * dot(miss, miss) + self.orientation_weight * self.orientation_cost(tool)
    }

    fn orientation_cost(&self, tool: &Frame) -> f64 {
        match (self.orientation, self.metric) {
            (Orientation::Free, _) => 0.0,
            (Orientation::Axis { tool: axis, direction }, _) => square(sub(tool.rotate(axis), direction)),
            (Orientation::Whole(axes), Metric::Frobenius) => (0..3).map(|k| square(sub(tool.axes[k], axes[k]))).sum(),
            (Orientation::Whole(axes), Metric::Quaternion) => {
                // 1 - |w| without the difference of two that are nearly the same.
                let left = rotation_left(&tool.axes, &axes);
                2.0 * square(left.vector()) / (1.0 + left.0[0].abs())
            }
        }
    }

    /// How far a tool frame is from its goal \[m\], \[rad\].
    pub fn residuals(&self, tool: &Frame) -> (f64, f64) {
        let angle = match self.orientation {
            Orientation::Free => 0.0,
            Orientation::Axis { tool: axis, direction } => {
                let axis = tool.rotate(axis);
                norm(cross(axis, direction)).atan2(dot(axis, direction))
            }
            Orientation::Whole(axes) => rotation_left(&tool.axes, &axes).angle(),
        };
        (norm(sub(tool.origin, self.position)), angle)
    }
}

impl Cost {
    /// That of the tool alone.
    pub const fn new(goal: Goal) -> Self {
        Self { goal, points: Vec::new(), centres: Vec::new() }
    }

    /// Whether nothing but the tool has a cost.
    pub(super) fn is_of_tool_alone(&self) -> bool {
        self.points.is_empty() && self.centres.is_empty()
    }

    /// What is looked at where the tool is in its place; the points are left out. Of a volume, the member nearest to the tool's orientation is wanted.
    pub(super) fn places(&self, tool: Frame, volume: Option<&OrientationVolume>) -> Places {
        let mut goal = self.goal;
        if let Some(volume) = volume {
            goal.orientation = Orientation::Whole(volume.nearest(&Quaternion::from_axes(&tool.axes)).orientation.axes());
        }
        Places { goal, tool, points: [[0.0; 3]; MAX_POINTS] }
    }

    /// Checks it against a robot of `n` joints: weights are finite, those of the tool at least 0, and points and joints are there.
    pub(super) fn check(&self, n: usize) -> Result<()> {
        let goal = &self.goal;
        check_finite("position of the goal", &goal.position)?;
        for (name, weight) in [("w_p", goal.position_weight), ("w_o", goal.orientation_weight)] {
            if !(weight >= 0.0 && weight.is_finite()) {
                return Err(Error::value(name, weight, "a finite weight, at least 0"));
            }
        }
        if self.points.len() > MAX_POINTS {
            return Err(Error::value("points", self.points.len(), &format!("at most {MAX_POINTS}")));
        }
        for (i, point) in self.points.iter().enumerate() {
            for numbers in [point.at, point.goal, [point.weight; 3]] {
                check_finite("points", &numbers)?;
            }
            if !(1..=n).contains(&point.joints) {
                return Err(Error::value(&format!("points[{i}]"), format!("a frame after {} joints", point.joints), &format!("1 to {n}")));
            }
        }
        for (i, centre) in self.centres.iter().enumerate() {
            check_finite("centring", &[centre.middle, centre.weight])?;
            if centre.joint >= n {
                return Err(Error::value(&format!("centring[{i}]"), format!("joint {}", centre.joint), &format!("0 to {}", n - 1)));
            }
        }
        Ok(())
    }

    /// Checks that the cost has a least value over a joint that slides without end.
    pub(super) fn check_slide(&self, i: usize) -> Result<()> {
        let Form::Slide { bend, .. } = self.slide(&self.places(Frame::IDENTITY, None), i, [0.0, 0.0, 1.0], 0.0) else { return Ok(()) };
        let pulled = self.points.iter().any(|point| point.joints > i && point.weight != 0.0);
        if bend < 0.0 || (bend == 0.0 && pulled) {
            let given = format!("weights whose sum over what joint {i} carries is {}", 0.5 * bend);
            return Err(Error::value("points", given, "a sum above 0, for a joint that slides without limits"));
        }
        Ok(())
    }

    /// The value at a posture.
    pub(super) fn value(&self, places: &Places, q: &[f64], joints: &[Joint]) -> f64 {
        let points = self.points.iter().zip(&places.points).map(|(point, at)| point.weight * square(sub(*at, point.goal)));
        let centres = self.centres.iter().map(|centre| {
            let off = q[centre.joint] - centre.middle;
            match joints[centre.joint] {
                Joint::Revolute => 2.0 * centre.weight * (0.5 * off).sin().powi(2),
                Joint::Prismatic => 0.5 * centre.weight * off * off,
            }
        });
        places.goal.cost(&places.tool) + points.sum::<f64>() + centres.sum::<f64>()
    }

    /// The cost as a function of the change of joint `i`, whose axis is `u` through `origin`.
    pub(super) fn form(&self, places: &Places, i: usize, joint: Joint, (u, origin): (Vec3, Vec3), q: f64) -> Form {
        match joint {
            Joint::Revolute => self.turn(places, i, (u, origin), q),
            Joint::Prismatic => self.slide(places, i, u, q),
        }
    }

    fn turn(&self, places: &Places, i: usize, (u, origin): (Vec3, Vec3), q: f64) -> Form {
        let (goal, tool) = (&places.goal, &places.tool);
        let mut cosine = Cosine::default();
        cosine.pull(u, sub(tool.origin, origin), sub(goal.position, origin), goal.position_weight);
        for (point, at) in self.points.iter().zip(&places.points).filter(|(point, _)| point.joints > i) {
            cosine.pull(u, sub(*at, origin), sub(point.goal, origin), point.weight);
        }
        for centre in self.centres.iter().filter(|centre| centre.joint == i) {
            cosine.centre(q - centre.middle, centre.weight);
        }
        match (goal.orientation, goal.metric) {
            (Orientation::Free, _) => {}
            (Orientation::Axis { tool: axis, direction }, _) => cosine.pull(u, tool.rotate(axis), direction, goal.orientation_weight),
            (Orientation::Whole(axes), Metric::Frobenius) => {
                (0..3).for_each(|k| cosine.pull(u, tool.axes[k], axes[k], goal.orientation_weight));
            }
            (Orientation::Whole(axes), Metric::Quaternion) => {
                return Form::Half(HalfAngle::new(cosine, u, &rotation_left(&tool.axes, &axes), goal.orientation_weight));
            }
        }
        Form::Turn(cosine)
    }

    fn slide(&self, places: &Places, i: usize, u: Vec3, q: f64) -> Form {
        let (goal, mut bend) = (&self.goal, 2.0 * self.goal.position_weight);
        let mut slope = bend * dot(u, sub(places.tool.origin, goal.position));
        for (point, at) in self.points.iter().zip(&places.points).filter(|(point, _)| point.joints > i) {
            bend += 2.0 * point.weight;
            slope += 2.0 * point.weight * dot(u, sub(*at, point.goal));
        }
        for centre in self.centres.iter().filter(|centre| centre.joint == i) {
            bend += centre.weight;
            slope += centre.weight * (q - centre.middle);
        }
        Form::Slide { slope, bend }
    }

    /// Moves what joint `i` carries by a change of it.
    pub(super) fn carry(&self, places: &mut Places, i: usize, joint: Joint, (u, origin): (Vec3, Vec3), x: f64) {
        let (sine, cosine) = x.sin_cos();
        let turned = |v: Vec3| {
            let along = scale(dot(u, v), u);
            add(along, add(scale(cosine, sub(v, along)), scale(sine, cross(u, v))))
        };
        let moved = |p: Vec3| match joint {
            Joint::Revolute => add(origin, turned(sub(p, origin))),
            Joint::Prismatic => add(p, scale(x, u)),
        };
        places.tool.origin = moved(places.tool.origin);
        if joint == Joint::Revolute {
            places.tool.axes = places.tool.axes.map(turned);
        }
        for (_, at) in self.points.iter().zip(&mut places.points).filter(|(point, _)| point.joints > i) {
            *at = moved(*at);
        }
    }
}

/// |a|^2.
#[inline]
fn square(a: Vec3) -> f64 {
    dot(a, a)
}

/// The rotation M = D C^T from axes C to axes D.
fn rotation_left(from: &[Vec3; 3], to: &[Vec3; 3]) -> Quaternion {
    let image = |j: usize| (0..3).fold([0.0; 3], |sum, k| add(sum, scale(from[k][j], to[k])));
    Quaternion::from_axes(&[image(0), image(1), image(2)])
}
