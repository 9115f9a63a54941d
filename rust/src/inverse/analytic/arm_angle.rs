//! Seven-axis arms with a shoulder and a wrist that are points: all postures for a frame of the tool and an angle of the arm's plane.

use super::circle::{Blind, on_line};
use super::solutions::Solutions;
use super::solver::{CLOSED, POLISH, VERIFIED};
use super::structure::{Turned, meeting, point, square};
use super::wrist::wrist;
use crate::error::{Error, Result};
use crate::inverse::newton::reach_sized;
use crate::kinematics::sized::link_frames;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::robot::{Joint, Robot};
use crate::task::{Target, Task};

/// How near the axes of shoulder and wrist have to meet, relative to the size of the arm.
const MEETING: f64 = 1e-9;
/// Sine below which two directions span no plane.
const STRAIGHT: f64 = 1e-9;

/// The inverse kinematics of an arm whose first three axes meet and whose last three meet (Shimizu et al. 2008: the angle of its plane).
///
/// The plane holds the shoulder, the wrist and the upper arm (axis 3); its angle about the line from shoulder to wrist is counted from the
/// plane that holds axis 1, right-handed.
#[derive(Debug, Clone)]
pub struct ArmAngle {
    robot: Robot,
    size: f64,
    links: [Frame; 7],
    end: Frame,
    /// Height of the shoulder on axis 1 and on axis 3 [m].
    shoulder: (f64, f64),
    /// Height of the wrist on axis 5 and on axis 7 [m].
    wrist: (f64, f64),
    /// Sense of axis 3 from shoulder to elbow.
    upward: f64,
}

impl ArmAngle {
    /// For a robot whose axes meet as they have to.
    pub fn new(robot: &Robot) -> Result<Self> {
        let refused = || {
            let expected = "seven revolute joints, the first three and the last three axes meeting in a point each (fix a joint instead)";
            Error::value("robot", robot.name(), expected)
        };
        let links: [Frame; 7] = robot.links().try_into().map_err(|_| refused())?;
        if robot.joints().contains(&Joint::Prismatic) || robot.coupling().is_some() {
            return Err(refused());
        }
        let size: f64 = links[1..].iter().map(|link| norm(link.origin)).sum();
        let point_of = |i: usize| match (meeting(&links[i], size), meeting(&links[i + 1], size)) {
            (Some((first, middle)), Some((other, last))) if (middle - other).abs() <= MEETING * size => Some((first, last)),
            _ => None,
        };
        let (shoulder, wrist) = (point_of(1).ok_or_else(refused)?, point_of(5).ok_or_else(refused)?);
        let elbow = links[3].origin[2] - shoulder.1;
        Ok(Self { robot: robot.clone(), size, links, end: *robot.end(), shoulder, wrist, upward: if elbow < 0.0 { -1.0 } else { 1.0 } })
    }

    /// Where the shoulder is.
    fn shoulder(&self) -> Vec3 {
        point(&self.links[0], [0.0, 0.0, self.shoulder.0])
    }

    /// The frame whose x axis leads from shoulder to wrist and whose y axis is square to it, on the side of `toward`.
    fn plane(along: Vec3, toward: Vec3) -> Option<[Vec3; 3]> {
        let x = unit(along)?;
        let y = sub(toward, scale(dot(toward, x), x));
        if norm(y) <= STRAIGHT {
            return None;
        }
        let y = unit(y)?;
        Some([x, y, cross(x, y)])
    }

    /// The angle of the arm's plane \[rad\]; NaN where the arm is straight or points along axis 1.
    pub fn of(&self, q: &[f64]) -> f64 {
        let frames = link_frames(&self.robot, q);
        let reach = sub(point(&frames[4], [0.0, 0.0, self.wrist.0]), self.shoulder());
        match (Self::plane(reach, self.links[0].axes[2]), unit(reach)) {
            (Some([_, y, z]), Some(x)) => {
                let arm = scale(self.upward, frames[2].axes[2]);
                let across = sub(arm, scale(dot(arm, x), x));
                if norm(across) > STRAIGHT { dot(z, across).atan2(dot(y, across)) } else { f64::NAN }
            }
            _ => f64::NAN,
        }
    }

    /// Leaves what takes the tool to the target, polished where rounding shows.
    fn verify(&self, target: &Frame, found: &mut Solutions<7>) {
        let wanted = Target { position: target.origin, axis: None, frame: target.axes };
        found.retain(|q, _| {
            let got = reach_sized::<8>(&self.robot, None, &Task::FULL, &wanted, self.size, q, CLOSED, POLISH);
            for (i, x) in q.iter_mut().enumerate() {
                *x = self.robot.limits().turned(i, *x);
            }
            got.error <= VERIFIED
        });
        found.merge_twins();
    }

    /// Every posture with the tool at `target` and the arm's plane at `angle`; empty also where that angle means nothing.
    pub fn solve(&self, target: &Frame, angle: f64) -> Solutions<7> {
        let mut found = Solutions::NONE;
        let hand = target.compose(&self.end.inverse());
        let reach = sub(point(&hand, [0.0, 0.0, self.wrist.1]), self.shoulder());
        let Some([x, y, z]) = Self::plane(reach, self.links[0].axes[2]) else {
            found.complete = false;
            return found;
        };
        let (s, c) = angle.sin_cos();
        let arm_y = add(scale(c, y), scale(s, z));
        let in_base = [x, arm_y, cross(x, arm_y)];
        // The wrist from the shoulder, in the frame of joint 3: `a + R Z(q4) b`.
        let a = sub(self.links[3].origin, [0.0, 0.0, self.shoulder.1]);
        let b = point(&self.links[4], [0.0, 0.0, self.wrist.0]);
        let turning = Turned::new(self.links[3].unrotate(a), b);
        let constant = square(a) + square(b);
        let distance = Turned { constant: constant + 2.0 * turning.constant, cosine: 2.0 * turning.cosine, sine: 2.0 * turning.sine };
        let Some(fourth) = on_line(&distance, square(reach), constant) else {
            found.complete = false;
            return found;
        };
        for ((c4, s4), elbow, stretched) in fourth.iter() {
            let forearm = self.links[3].turn_z(c4, s4).compose(&self.links[4]);
            let seen = sub(point(&forearm, [0.0, 0.0, self.wrist.0]), [0.0, 0.0, self.shoulder.1]);
            let Some(in_arm) = Self::plane(seen, [0.0, 0.0, self.upward]) else {
                // Straight: the plane may turn as it likes.
                found.complete = false;
                continue;
            };
            // The rotation that takes one plane to the other: the frame of joint 3.
            let carried = |v: Vec3| (0..3).fold([0.0; 3], |sum, k| add(sum, scale(dot(in_arm[k], v), in_base[k])));
            let upper = Frame { axes: Frame::IDENTITY.axes.map(carried), origin: [0.0; 3] };
            let shoulder = Frame { axes: upper.axes.map(|axis| self.links[0].unrotate(axis)), origin: [0.0; 3] };
            let fore = upper.compose(&forearm);
            let last = Frame { axes: hand.axes.map(|axis| fore.unrotate(axis)), origin: [0.0; 3] };
            wrist(&self.links[1], &self.links[2], &shoulder, &mut Blind, |upper| {
                wrist(&self.links[5], &self.links[6], &last, &mut Blind, |lower| {
                    let ([q1, q2, q3], [q5, q6, q7]) = (upper.q, lower.q);
                    let branch = 4 * elbow + 2 * upper.side + lower.side;
                    found.push([q1, q2, q3, s4.atan2(c4), q5, q6, q7], branch, stretched || upper.singular || lower.singular);
                    found.complete &= !(upper.free || lower.free);
                });
            });
        }
        self.verify(target, &mut found);
        found
    }
}
