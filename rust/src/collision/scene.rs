//! A robot with its bodies among obstacles: which pairs are near, how near, and how fast joints and obstacles change that.

use std::cmp::Ordering;
use std::sync::Arc;

use parry3d_f64::query::epa::EPA;

use super::body::{Body, Obstacle};
use super::pairs::Pair;
use super::separation::{Separation, separate};
use super::shape::Shape;
use crate::error::{Error, Result, check_vector};
use crate::kinematics::sized::joint_frames;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, cross, dot, norm, sub};
use crate::linalg::{MAX_JOINTS, Row6};
use crate::robot::{Joint, Robot};

/// A pair that is near: where, how near, and `d' = row' qd + drift`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proximity {
    /// The pair.
    pub pair: Pair,
    /// Signed distance: negative by the depth where they overlap \[m\].
    pub distance: f64,
    /// The points on both shapes: nearest, or deepest in each other, in the frame in which the robot's base is given \[m\].
    pub points: [Vec3; 2],
    /// Unit vector from the first shape to the second: `points[1] = points[0] + distance normal`.
    pub normal: Vec3,
    /// What the joints change of the distance, one number a joint [m/rad or 1]; zeros beyond the last.
    pub row: [f64; MAX_JOINTS],
    /// What the obstacle's motion changes of it [m/s].
    pub drift: f64,
}

impl Proximity {
    /// Nothing found yet: what to fill a slice of results with.
    pub const NONE: Self = Self {
        pair: Pair::Bodies { first: 0, second: 0 },
        distance: f64::INFINITY,
        points: [[0.0; 3]; 2],
        normal: [0.0; 3],
        row: [0.0; MAX_JOINTS],
        drift: 0.0,
    };

    /// The nearer first; equally near ones, as capsules that share a round end, in the order of pairs.
    fn order(&self, other: &Self) -> Ordering {
        self.distance.total_cmp(&other.distance).then(self.pair.cmp(&other.pair))
    }
}

/// How many pairs were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found {
    /// How many of the results were written, nearest first.
    pub written: usize,
    /// How many pairs are within the influence distance; more than written where there was no room for all.
    pub within: usize,
}

/// Who can tell distances: a scene, or one that is shared and locked for the time of a question.
pub trait Distances {
    /// As [`Scene::near`].
    fn near(&mut self, q: &[f64], influence: f64, out: &mut [Proximity]) -> Result<Found>;
}

impl Distances for Scene {
    fn near(&mut self, q: &[f64], influence: f64, out: &mut [Proximity]) -> Result<Found> {
        Self::near(self, q, influence, out)
    }
}

/// A robot with its bodies among obstacles.
pub struct Scene {
    robot: Arc<Robot>,
    bodies: Vec<Body>,
    obstacles: Vec<Obstacle>,
    self_pairs: Vec<[usize; 2]>,
    /// Frames of the cores at the posture looked at.
    body_frames: Vec<Frame>,
    obstacle_frames: Vec<Frame>,
    epa: EPA,
}

impl Scene {
    /// From bodies, obstacles and the pairs of bodies to look at. Bodies on the base are looked at beside other bodies only: no joint
    /// moves them away from an obstacle.
    pub fn new(robot: Arc<Robot>, bodies: Vec<Body>, obstacles: Vec<Obstacle>, self_pairs: Vec<[usize; 2]>) -> Result<Self> {
        for body in &bodies {
            body.check(&robot)?;
        }
        for pair in &self_pairs {
            if pair.iter().any(|i| *i >= bodies.len()) || pair[0] == pair[1] {
                return Err(Error::value("self_pairs", format!("{pair:?}"), &format!("two different bodies below {}", bodies.len())));
            }
        }
        let (body_frames, obstacle_frames) = (vec![Frame::IDENTITY; bodies.len()], vec![Frame::IDENTITY; obstacles.len()]);
        Ok(Self { robot, bodies, obstacles, self_pairs, body_frames, obstacle_frames, epa: EPA::new() })
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The obstacles.
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// The pairs of bodies that are looked at.
    pub fn self_pairs(&self) -> &[[usize; 2]] {
        &self.self_pairs
    }

    /// Moves an obstacle: its pose, and its velocity [omega; v] at the origin of the pose.
    pub fn place(&mut self, obstacle: usize, pose: Frame, twist: Row6) -> Result<()> {
        let count = self.obstacles.len();
        match self.obstacles.get_mut(obstacle) {
            Some(obstacle) => obstacle.place(pose, twist),
            None => Err(Error::value("obstacle", obstacle, &format!("an index below {count}"))),
        }
    }

    /// Writes the pairs no farther apart than `influence` \[m\] at the posture `q`, nearest first; if they are more than there is room for, the
    /// nearest. Spheres, capsules and boxes ask for no memory, nor do hulls once the first overlaps have been looked at.
    pub fn near(&mut self, q: &[f64], influence: f64, out: &mut [Proximity]) -> Result<Found> {
        check_vector("q", q, self.robot.n())?;
        if influence.is_nan() {
            return Err(Error::value("influence", influence, "a distance"));
        }
        let links = joint_frames(&self.robot, q);
        for (frame, body) in self.body_frames.iter_mut().zip(&self.bodies) {
            *frame = body.shape.core_frame(&body.mount.frame(&self.robot, &links).compose(&body.pose));
        }
        for (frame, obstacle) in self.obstacle_frames.iter_mut().zip(&self.obstacles) {
            *frame = obstacle.shape.core_frame(&obstacle.pose);
        }
        let mut nearest = Nearest { influence, out, written: 0, within: 0 };
        let epa = &mut self.epa;
        for (i, body) in self.bodies.iter().enumerate().filter(|(_, body)| body.mount.joints(&self.robot) > 0) {
            for (k, obstacle) in self.obstacles.iter().enumerate() {
                let pair = Pair::Obstacle { body: i, obstacle: k };
                nearest.look_at(pair, (&body.shape, &self.body_frames[i]), (&obstacle.shape, &self.obstacle_frames[k]), epa);
            }
        }
        for &[i, k] in &self.self_pairs {
            let pair = Pair::Bodies { first: i, second: k };
            let shape = |i: usize| (&self.bodies[i].shape, &self.body_frames[i]);
            nearest.look_at(pair, shape(i), shape(k), epa);
        }
        let Nearest { out, written, within, .. } = nearest;
        let out = &mut out[..written];
        out.sort_unstable_by(Proximity::order);
        for found in out {
            self.add_rates(&links, found);
        }
        Ok(Found { written, within })
    }

    /// `d' = n . (v2 - v1)`. A joint that moves both bodies moves p1 and p2 as one rigid body, and they lie along n: it changes nothing.
    fn add_rates(&self, links: &[Frame; MAX_JOINTS], found: &mut Proximity) {
        let joints = |body: usize| self.bodies[body].mount.joints(&self.robot);
        let ([p1, p2], n) = (found.points, found.normal);
        let (first, second) = match found.pair {
            Pair::Obstacle { body, obstacle } => {
                found.drift = self.obstacles[obstacle].speed(p2, n);
                (joints(body), 0)
            }
            Pair::Bodies { first, second } => (joints(first), joints(second)),
        };
        let (sign, p) = if first > second { (-1.0, p1) } else { (1.0, p2) };
        for i in first.min(second)..first.max(second) {
            let (axis, origin) = (links[i].axes[2], links[i].origin);
            let velocity = match self.robot.chain()[i] {
                Joint::Revolute => cross(axis, sub(p, origin)),
                Joint::Prismatic => axis,
            };
            let (coordinate, factor) = self.robot.moved_by(i);
            found.row[coordinate] += sign * factor * dot(n, velocity);
        }
    }
}

/// The nearest pairs so far.
struct Nearest<'a> {
    influence: f64,
    out: &'a mut [Proximity],
    written: usize,
    within: usize,
}

impl Nearest<'_> {
    fn look_at(&mut self, pair: Pair, first: (&Shape, &Frame), second: (&Shape, &Frame), epa: &mut EPA) {
        let apart = norm(sub(second.1.origin, first.1.origin)) - first.0.reach() - second.0.reach();
        // What is not a number, of a posture at the end of the numbers, is nowhere near.
        if !apart.is_finite() || apart > self.influence {
            return;
        }
        let Separation { distance, points, normal } = separate(first.0, first.1, second.0, second.1, epa);
        if !distance.is_finite() || distance > self.influence {
            return;
        }
        self.within += 1;
        let found = Proximity { pair, distance, points, normal, ..Proximity::NONE };
        if self.written < self.out.len() {
            self.out[self.written] = found;
            self.written += 1;
        } else if let Some(farthest) = self.out.iter_mut().max_by(|a, b| a.order(b))
            && found.order(farthest).is_lt()
        {
            *farthest = found;
        }
    }
}
