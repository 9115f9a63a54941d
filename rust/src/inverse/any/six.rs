//! Chains of six joints that have a closed form, or an elimination: candidates for a frame.

use std::sync::Arc;

use super::arm::{Arm, solved};
use super::chain::{Chain, Role};
use crate::error::Result;
use crate::inverse::analytic::circle::{Blind, turn_between_values};
use crate::inverse::analytic::structure::{Turned, angle_of, meeting, point, third_row, unpoint};
use crate::inverse::analytic::wrist::{Turns, wrist};
use crate::inverse::{Inverse, Structure};
use crate::kinematics::jacobian_at;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{norm, sub};
use crate::robot::{Joint, Robot};

/// Wrist centres this near to each other, over the size of the robot, are one; the answers are polished on the true geometry.
const COINCIDENT: f64 = 1e-9;

/// How a chain of six joints is solved.
#[derive(Debug, Clone)]
enum Form {
    /// Six revolute joints.
    Turning(Box<Inverse>),
    /// Three neighbouring revolute axes meet in a point; entered at joint `first` they are the last three, with the point at heights on the first and
    /// the last of them.
    Wrist { first: usize, before: f64, after: f64 },
    /// Three slides: the others turn the tool, then the slides bring it where it has to be.
    Sliding,
}

/// A chain of six joints and its form.
#[derive(Debug, Clone)]
pub struct Six {
    robot: Arc<Robot>,
    roles: [Role; 6],
    form: Form,
}

impl Six {
    /// `None` where the chain has no form that is known.
    pub fn new(chain: &Chain) -> Result<Option<Self>> {
        let Ok(roles) = <[Role; 6]>::try_from(&chain.roles[..]) else { return Ok(None) };
        let robot = Arc::new(chain.robot()?);
        let slides = robot.joints().iter().filter(|joint| **joint == Joint::Prismatic).count();
        let form = match slides {
            0 => Some(Form::Turning(Box::new(Inverse::new(robot.clone())?))),
            3 => Some(Form::Sliding),
            _ => wrist_of(&robot),
        };
        Ok(form.map(|form| Self { robot, roles, form }))
    }

    /// The chain as a robot.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// What moves its joints.
    pub fn roles(&self) -> &[Role; 6] {
        &self.roles
    }

    /// What the solution is built on.
    pub fn structure(&self) -> Structure {
        match &self.form {
            Form::Turning(inverse) => inverse.structure(),
            Form::Wrist { first, before, after } => Structure::Wrist { first: *first, before: *before, after: *after },
            Form::Sliding => Structure::Sliding,
        }
    }

    /// Calls `found` with the robot's own joints for every posture of the chain that takes its tool to `target`, and perhaps for some that do not;
    /// false where there may be others.
    pub fn candidates(&self, target: &Frame, found: &mut dyn FnMut(&[f64; 6])) -> bool {
        let mut keep = |q: &[f64; 6]| {
            let mut own = [0.0; 6];
            for (role, x) in self.roles.iter().zip(q) {
                if let Role::Own(joint) = role {
                    own[*joint] = *x;
                }
            }
            found(&own);
        };
        match &self.form {
            Form::Turning(inverse) => {
                let all = inverse.solve(target);
                all.q[..all.count].iter().for_each(keep);
                all.complete
            }
            Form::Wrist { first, before, after } => self.decoupled(target, *first, *before, *after, &mut keep),
            Form::Sliding => self.sliding(target, &mut keep),
        }
    }

    /// A wrist: the other three joints place its centre, it does the rest.
    fn decoupled(&self, target: &Frame, first: usize, before: f64, after: f64, found: &mut dyn FnMut(&[f64; 6])) -> bool {
        let closing = self.robot.end().compose(&target.inverse()).compose(&self.robot.links()[0]);
        // Entered at `first`: joint k of the loop, and the transform after it.
        let joint = |k: usize| (k + first) % 6;
        let l: [Frame; 6] = std::array::from_fn(|k| if joint(k) == 5 { closing } else { self.robot.links()[joint(k) + 1] });
        let joints: [Joint; 3] = std::array::from_fn(|k| self.robot.joints()[joint(k)]);
        let hand = l[5].inverse();
        let (centre, place) = (point(&l[2], [0.0, 0.0, before]), unpoint(&l[5], [0.0, 0.0, after]));
        let arm = Arm { joints, links: [l[0], l[1]], wrist: centre, place };
        let moved = |q: &[f64; 3], range: std::ops::Range<usize>, start: Frame| {
            range.fold(start, |frame, k| moved(&frame, joints[k], q[k]).compose(&l[k]))
        };
        // A wrist that comes in line says nothing of the robot where it is not all the robot's and the task's: still joints are not in line.
        let counts = (3..6).all(|k| self.roles[joint(k)] != Role::Still) && (3..6).any(|k| matches!(self.roles[joint(k)], Role::Own(_)));
        let mut complete = true;
        complete &= arm.solve(&mut |placed| {
            let mut q = placed.q;
            if let Some(free) = placed.free {
                complete = false;
                q[free] = chosen(&l, &hand, &moved(&q, 0..free, Frame::IDENTITY), &moved(&q, free + 1..3, l[free]));
            }
            let upper = moved(&q, 0..3, Frame::IDENTITY);
            let wanted = Frame { axes: hand.axes.map(|axis| upper.unrotate(axis)), origin: [0.0; 3] };
            each_turn(&l[3], &l[4], &wanted, &mut |w| {
                let entered = [q[0], q[1], q[2], w.q[0], w.q[1], w.q[2]];
                let mut own = [0.0; 6];
                (0..6).for_each(|k| own[joint(k)] = entered[k]);
                complete &= !(w.free && counts);
                found(&own);
            });
        });
        complete
    }

    /// Three slides: whatever they do, the other joints turn the tool alone; what is left of the way is linear in them.
    fn sliding(&self, target: &Frame, found: &mut dyn FnMut(&[f64; 6])) -> bool {
        let robot = &*self.robot;
        let of_kind = |kind: Joint| (0..6).filter(move |&i| robot.joints()[i] == kind);
        let (mut turning, mut slides) = ([0; 3], [0; 3]);
        turning.iter_mut().zip(of_kind(Joint::Revolute)).for_each(|(slot, i)| *slot = i);
        slides.iter_mut().zip(of_kind(Joint::Prismatic)).for_each(|(slot, i)| *slot = i);
        let between = |range: std::ops::Range<usize>| range.fold(Frame::IDENTITY, |frame, i| frame.compose(&robot.links()[i]));
        let start = between(0..turning[0] + 1);
        let rest = between(turning[2] + 1..6).compose(robot.end()).inverse();
        let wanted = Frame { origin: [0.0; 3], ..start }.inverse().compose(target).compose(&rest);
        let mut complete = true;
        let (a, b) = (between(turning[0] + 1..turning[1] + 1), between(turning[1] + 1..turning[2] + 1));
        each_turn(&a, &b, &wanted, &mut |w| {
            let mut q = [0.0; 6];
            (0..3).for_each(|k| q[turning[k]] = w.q[k]);
            let (tool, columns) = jacobian_at(robot, &q);
            match solved(slides.map(|i| columns.v[i]), sub(target.origin, tool.origin)) {
                Some(x) => (0..3).for_each(|k| q[slides[k]] = x[k]),
                None => complete = false,
            }
            complete &= !w.free;
            found(&q);
        });
        complete
    }
}

/// Calls `found` for each solution of a wrist; one copy of its code.
#[inline(never)]
fn each_turn(a: &Frame, b: &Frame, wanted: &Frame, found: &mut dyn FnMut(Turns)) {
    wrist(a, b, wanted, &mut Blind, found);
}

/// `frame` moved by a joint.
fn moved(frame: &Frame, joint: Joint, q: f64) -> Frame {
    match joint {
        Joint::Revolute => frame.turn_z(q.cos(), q.sin()),
        Joint::Prismatic => frame.compose(&Frame::translation([0.0, 0.0, q])),
    }
}

/// A turn of a joint that does not move the wrist's centre, at which the wrist can do the rest; `before` and `after` are the arm on its two sides.
fn chosen(l: &[Frame; 6], hand: &Frame, before: &Frame, after: &Frame) -> f64 {
    // Cosine of the angle between the outer axes of the wrist: what the joint makes of it, and what the wrist can.
    let made = Turned::new(before.unrotate(hand.axes[2]), after.axes[2]);
    let wrist = Turned::new(third_row(&l[3]), l[4].axes[2]);
    let r = wrist.cosine.hypot(wrist.sine);
    angle_of(turn_between_values(&made, wrist.constant - r, wrist.constant + r))
}

/// Three neighbouring revolute axes that meet in a point, the hand's first.
fn wrist_of(robot: &Robot) -> Option<Form> {
    let links = robot.links();
    let size: f64 = links[1..].iter().map(|link| norm(link.origin)).sum();
    [3, 0, 1, 2].into_iter().find_map(|i| {
        let turning = robot.joints()[i..i + 3].iter().all(|joint| *joint == Joint::Revolute);
        let ((before, middle), (other, after)) = (meeting(&links[i + 1], size)?, meeting(&links[i + 2], size)?);
        let meet = turning && (middle - other).abs() <= COINCIDENT * size;
        meet.then_some(Form::Wrist { first: (i + 3) % 6, before, after })
    })
}
