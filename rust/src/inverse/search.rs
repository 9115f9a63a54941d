//! Postures that are not isolated: where an arm can move while its tool stands still, damped Newton from random starts finds some of them.

use super::newton::reach_sized;
use crate::linalg::frame::Frame;
use crate::robot::{Limits, RandomPostures, Robot};
use crate::task::{Target, Task};

/// How many starts: where a search in two finds a posture, one frame in a million million is overlooked.
const STARTS: usize = 40;
/// Steps of each.
const STEPS: usize = 60;
/// How many postures are enough.
const ENOUGH: usize = 8;

/// Calls `found` with postures of a six-axis robot that take the tool to `target` up to `tolerance` (rad, and m over `length`), at most eight.
pub fn search(robot: &Robot, target: &Frame, length: f64, tolerance: f64, mut found: impl FnMut(&[f64; 6])) {
    let wanted = Target { position: target.origin, axis: None, frame: target.axes };
    let mut starts = RandomPostures::new(0);
    let mut count = 0;
    for _ in 0..STARTS {
        let mut q = [0.0; 6];
        starts.fill(robot, &mut q);
        if reach_sized::<6>(robot, None::<&Limits>, &Task::FULL, &wanted, length, &mut q, tolerance, STEPS).error <= tolerance {
            found(&q);
            count += 1;
            if count == ENOUGH {
                return;
            }
        }
    }
}
