//! Names of branches. Where the determinant of the Jacobian is a product of three factors, of shoulder, elbow and wrist, a singularity is where one of them
//! vanishes, and their signs tell the eight postures of a frame apart.

use std::fmt;

use super::structure::{COINCIDENT, across, meeting, point};
use crate::error::{Result, check_vector};
use crate::kinematics::sized::link_frames;
use crate::linalg::vector::{cross, dot, norm, scale, sub};
use crate::robot::{Joint, Robot};

/// The names of a posture's branch (Lee and Ziegler 1984, arms with a shoulder offset as their makers say it).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Branch {
    /// "front" or "back" of axis 1, the side of axis 2 being the front; "right" or "left" where axis 2 meets it.
    pub shoulder: &'static str,
    /// "up" where the elbow is above the line from shoulder to wrist, seen with the wrist ahead; "down".
    pub elbow: &'static str,
    /// "no flip" where joint 5 is turned from in line in its positive sense; "flip".
    pub wrist: &'static str,
}

impl fmt::Display for Branch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, {}", self.shoulder, self.elbow, self.wrist)
    }
}

/// The factors of the determinant, each over the largest that it could be: a distance over the size of the robot and two sines.
#[derive(Debug, Clone, Copy)]
pub struct Factors {
    /// Distance of the wrist from the plane that holds axis 1 and the direction of axis 2, positive in the direction of `z1 x z2`, with axis 1 pointing up.
    pub shoulder: f64,
    /// Of upper arm and forearm, about axis 2.
    pub elbow: f64,
    /// Of axes 4 and 6, about axis 5.
    pub wrist: f64,
    /// On which side of axis 1 axis 2 is, as for the shoulder; 0 where they meet.
    front: f64,
}

impl Factors {
    /// Of a posture of a robot with axes 2 and 3 parallel and a wrist whose three axes meet, or with axes 2, 3 and 4 parallel and 5 and 6 meeting.
    pub fn of(robot: &Robot, q: &[f64]) -> Option<Self> {
        if robot.n() != 6 || robot.joints().contains(&Joint::Prismatic) {
            return None;
        }
        let (links, size) = (robot.links(), robot.size());
        let parallel = |i: usize| across(links[i].axes[2]) <= COINCIDENT * COINCIDENT;
        let square = across(links[1].axes[2]) > COINCIDENT * COINCIDENT;
        let (_, last) = meeting(&links[4], size).unzip();
        let (fifth, _) = meeting(&links[5], size)?;
        let is_wrist = last.is_some_and(|last| (last - fifth).abs() <= COINCIDENT * size);
        if !square || !parallel(2) || !(is_wrist || parallel(3)) {
            return None;
        }
        let frames = link_frames(robot, q);
        let (axis, place) = (|i: usize| frames[i].axes[2], |i: usize| frames[i].origin);
        let wrist = point(&frames[4], [0.0, 0.0, fifth]);
        // Of both links of the planar arm, what is across its axes.
        let flat = |v| sub(v, scale(dot(v, axis(1)), axis(1)));
        let (upper, fore) = (flat(sub(place(2), place(1))), flat(sub(if is_wrist { wrist } else { place(3) }, place(2))));
        // Axis 1 as it leads from the base to axis 2: makers let it point down, too.
        let up = if links[1].origin[2] < -COINCIDENT * size { -1.0 } else { 1.0 };
        let ahead = scale(up, cross(axis(0), axis(1)));
        let reached = norm(upper) * norm(fore);
        let front = dot(ahead, sub(place(1), place(0)));
        Some(Self {
            shoulder: dot(ahead, sub(wrist, place(0))) / size,
            elbow: if reached > 0.0 { dot(axis(1), cross(upper, fore)) / reached } else { 0.0 },
            wrist: dot(cross(axis(4), axis(3)), axis(5)),
            front: if front.abs() > COINCIDENT * size { front } else { 0.0 },
        })
    }

    /// The names that their signs have.
    pub fn names(&self) -> Branch {
        let pick = |first: bool, names: [&'static str; 2]| names[usize::from(!first)];
        let ahead = self.shoulder >= 0.0;
        Branch {
            shoulder: if self.front == 0.0 { pick(ahead, ["right", "left"]) } else { pick(ahead == (self.front > 0.0), ["front", "back"]) },
            elbow: pick(ahead == (self.elbow <= 0.0), ["up", "down"]),
            wrist: pick(self.wrist >= 0.0, ["no flip", "flip"]),
        }
    }

    /// Each with the name of the singularity where it vanishes.
    pub fn named(&self) -> [(&'static str, f64); 3] {
        [("shoulder", self.shoulder.abs()), ("elbow", self.elbow.abs()), ("wrist", self.wrist.abs())]
    }
}

/// The names of a posture's branch, `None` for a robot whose branches have none. They change only at a singularity, where either may be told.
pub fn branch(robot: &Robot, q: &[f64]) -> Result<Option<Branch>> {
    check_vector("q", q, robot.n())?;
    Ok(Factors::of(robot, q).map(|factors| factors.names()))
}
