//! Algorithm 1: the joints in turn, each to its minimum (From and Gravdahl 2007, section 5.3).

use super::state::{Problem, State, axis_of};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, scale};
use crate::robot::Joint;

/// In which order the joints come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// The last joint first.
    EndToBase,
    /// The first joint first.
    BaseToEnd,
    /// To the base and back, the first joint once (Aitken's double sweep).
    Double,
}

impl Problem<'_> {
    /// One sweep over the joints, in a time that is proportional to their number: only what a joint carries is moved. The state's frames are those of the
    /// start; the posture after it is returned.
    #[inline(never)]
    pub fn cyclic(&self, start: &State, order: Order) -> [f64; MAX_JOINTS] {
        match order {
            Order::EndToBase => self.inwards(start),
            Order::BaseToEnd => self.outwards(start, 0),
            Order::Double => {
                let there = self.inwards(start);
                self.outwards(&self.at(&there[..self.robot.n()]), 1)
            }
        }
    }

    /// From the last joint to the first: the joints that are yet to come have not moved, nor their axes.
    fn inwards(&self, start: &State) -> [f64; MAX_JOINTS] {
        let mut state = *start;
        for i in (0..self.robot.n()).rev() {
            self.set(&mut state, i, axis_of(&start.frames[i]));
        }
        state.q
    }

    /// From joint `first` to the last: the axis of each comes from the frame of the one before, which has its place.
    fn outwards(&self, start: &State, first: usize) -> [f64; MAX_JOINTS] {
        let mut state = *start;
        let (links, joints) = (self.robot.links(), self.robot.joints());
        let mut before = if first == 0 { Frame::IDENTITY } else { start.frames[first - 1] };
        for i in first..joints.len() {
            let frame = before.compose(&links[i]);
            self.set(&mut state, i, axis_of(&frame));
            before = after(&frame, joints[i], state.q[i]);
        }
        state.q
    }

    /// Takes joint `i` to its minimum and what it carries with it.
    #[inline]
    fn set(&self, state: &mut State, i: usize, axis: (Vec3, Vec3)) {
        let (joint, q) = (self.robot.joints()[i], state.q[i]);
        let (low, high) = self.room(&state.q[..self.robot.n()], i);
        let x = self.cost.form(&state.places, i, joint, axis, q).best(low, high);
        state.q[i] = self.moved(q, i, x);
        self.cost.carry(&mut state.places, i, joint, axis, state.q[i] - q);
    }
}

/// A joint's frame after its motion.
#[inline]
fn after(frame: &Frame, joint: Joint, q: f64) -> Frame {
    match joint {
        Joint::Revolute => frame.turn_z(q.cos(), q.sin()),
        Joint::Prismatic => Frame { axes: frame.axes, origin: add(frame.origin, scale(q, frame.axes[2])) },
    }
}
