//! What counts beside the task in a tick: a posture that the joints are drawn to, and tasks of other frames of the arm.

use super::general::{General, combined, twists_of};
use super::programme::Cost;
use super::settings::Tick;
use super::solver::QuadraticSolver;
use crate::error::{Error, Result, check_finite, check_length, check_positive};
use crate::kinematics::sized::joint_frames;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{cross, halves, sub};
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::robot::{Joint, Robot};
use crate::task::{Directions, Target, Task};

/// A posture that the joints are drawn to: `sum of w_i (qd_i - gain (posture_i - q_i))^2 / 2`.
#[derive(Debug, Clone)]
pub struct PostureTask {
    /// The posture [rad or m].
    pub posture: Vec<f64>,
    /// One weight a joint, of at least 0.
    pub weights: Vec<f64>,
    /// Part of the way to go in a second [1/s], and no more than all of it in a tick.
    pub gain: f64,
}

/// A task of a frame that is fixed to a link: `weight |t - J qd|^2 / 2`, angles times the solver's length.
#[derive(Debug, Clone)]
pub struct FrameTask {
    /// The link, which moves with joints 0 to this one of the chain.
    pub link: usize,
    /// The frame in that of the link.
    pub frame: Frame,
    /// What the frame has to do.
    pub task: Task,
    /// Weight, above 0.
    pub weight: f64,
}

/// One of them.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)] // a few of them, side by side, so that ticks follow no pointers
pub enum Beside {
    /// A posture.
    Posture(PostureTask),
    /// A frame.
    Frame(FrameTask),
}

/// The rows of a frame's task, as long as there are joints, and what is wanted of them.
struct Asked {
    rows: [[f64; MAX_JOINTS]; 6],
    wanted: Row6,
    dimension: usize,
}

impl Beside {
    fn check(&self, robot: &Robot) -> Result<()> {
        match self {
            Self::Posture(it) => {
                check_length("posture", &it.posture, robot.n())?;
                check_finite("posture", &it.posture)?;
                check_length("weight", &it.weights, robot.n())?;
                if let Some(value) = it.weights.iter().chain([&it.gain]).find(|x| !(**x >= 0.0 && x.is_finite())) {
                    return Err(Error::value("weight or gain", value, "a finite number of at least 0"));
                }
                Ok(())
            }
            Self::Frame(it) if it.link >= robot.chain().len() => {
                Err(Error::value("link", it.link, &format!("the number of a link, 0 to {}", robot.chain().len() - 1)))
            }
            Self::Frame(it) => check_positive("weight", it.weight).map(|_| ()),
        }
    }
}

impl FrameTask {
    /// The frame in the base frame.
    #[inline(never)]
    fn place(&self, links: &[Frame; MAX_JOINTS]) -> Frame {
        links[self.link].compose(&self.frame)
    }

    /// The rows of the task, columns of the joints that move it; the frame's motion is decomposed as the tool's is.
    #[inline(never)]
    fn asked(&self, robot: &Robot, links: &[Frame; MAX_JOINTS], twist: &Row6, length: f64) -> Asked {
        let frame = self.place(links);
        let directions = self.task.directions(&frame, length);
        let mut rows = [[0.0; MAX_JOINTS]; 6];
        for i in 0..=self.link {
            let axis = links[i].axes[2];
            let (coordinate, factor) = robot.moved_by(i);
            let (w, v) = match robot.chain()[i] {
                Joint::Revolute => (axis, cross(axis, sub(frame.origin, links[i].origin))),
                Joint::Prismatic => ([0.0; 3], axis),
            };
            for (row, entry) in rows.iter_mut().zip(directions.reduce(w, v)) {
                row[coordinate] += factor * entry;
            }
        }
        let (w, v) = halves(twist);
        Asked { rows, wanted: directions.reduce(w, v), dimension: directions.dimension() }
    }
}

impl QuadraticSolver {
    /// Sets what counts beside the task.
    pub fn set_beside(&mut self, beside: Vec<Beside>) -> Result<()> {
        for one in &beside {
            one.check(&self.robot)?;
        }
        self.general_mut().beside = beside;
        Ok(())
    }

    /// What counts beside the task.
    pub fn beside(&self) -> &[Beside] {
        self.general.as_ref().map_or(&[], |general| &general.beside)
    }

    /// The small motion of a frame beside to a target, as [`crate::resolve::Resolver::error`] is the tool's; NaN for a `q` of another size.
    pub fn error_beside(&self, frame: &FrameTask, target: &Target, q: &[f64]) -> Row6 {
        if q.len() != self.robot.n() {
            return [f64::NAN; 6];
        }
        let ([a, b, c], [x, y, z]) = frame.task.error(&frame.place(&joint_frames(&self.robot, q)), target);
        [a, b, c, x, y, z]
    }

    /// What rates leave undone beside: for a posture the rates that are missing, n of them, for a frame the part of its twist that it does not follow,
    /// 6 numbers.
    pub fn deviation_beside(&self, one: &Beside, q: &[f64], twist: &Row6, rates: &[f64]) -> ([f64; MAX_JOINTS], usize) {
        let (mut out, n) = ([0.0; MAX_JOINTS], self.robot.n().min(q.len()).min(rates.len()));
        match one {
            Beside::Posture(it) => {
                for i in 0..n {
                    out[i] = it.rate(i, q[i], self.settings().dt) - rates[i];
                }
                (out, n)
            }
            Beside::Frame(it) => {
                let links = joint_frames(&self.robot, &q[..n]);
                let asked = it.asked(&self.robot, &links, twist, 1.0);
                let mut left = [0.0; 6];
                for r in 0..asked.dimension {
                    left[r] = asked.wanted[r] - asked.rows[r].iter().zip(rates).map(|(a, x)| a * x).sum::<f64>();
                }
                let (w, v) = it.task.directions(&it.place(&links), 1.0).motion_of(&left);
                out[..6].copy_from_slice(&[w[0], w[1], w[2], v[0], v[1], v[2]]);
                (out, 6)
            }
        }
    }

    /// Adds to the cost the deviation, weighed by a matrix if there is one, and what counts beside the task; frames whose twist the tick does not give count
    /// nothing. No allocation.
    #[cold]
    #[inline(never)]
    pub(super) fn add_general<const C: usize>(
        &self,
        general: &General,
        tick: &Tick<'_>,
        dt: f64,
        at: &Directions,
        rows: &Rows6<C>,
        wanted: &Row6,
        cost: &mut Cost<C>,
    ) {
        let mut wide = [[0.0; MAX_JOINTS]; 6];
        for (wide, row) in wide.iter_mut().zip(rows) {
            wide[..C].copy_from_slice(row);
        }
        let sum = self.cost_general(general, tick, dt, at, &wide, wanted);
        for i in 0..C {
            for j in 0..C {
                cost.h[i][j] += sum.h[i][j];
            }
            cost.g[i] += sum.g[i];
        }
    }

    /// That, in one capacity for all.
    #[inline(never)]
    fn cost_general(
        &self,
        general: &General,
        tick: &Tick<'_>,
        dt: f64,
        at: &Directions,
        rows: &Rows6<MAX_JOINTS>,
        wanted: &Row6,
    ) -> Cost<MAX_JOINTS> {
        let mut cost = Cost::<MAX_JOINTS>::of_rates(&[]);
        let (mut twists, mut links) = (tick.twists.iter(), None);
        for one in &general.beside {
            match one {
                Beside::Posture(it) => {
                    for i in 0..tick.q.len() {
                        cost.h[i][i] += it.weights[i];
                        cost.g[i] -= it.weights[i] * it.rate(i, tick.q[i], dt);
                    }
                }
                Beside::Frame(it) => {
                    let Some(twist) = twists.next() else { continue };
                    let links = links.get_or_insert_with(|| joint_frames(&self.robot, tick.q));
                    let asked = it.asked(&self.robot, links, twist, self.settings().length);
                    cost.add_deviation(it.weight, &asked.rows, &asked.wanted, asked.dimension);
                }
            }
        }
        match general.weighing(at, &twists_of(at)).map(|matrix| combined(&matrix, rows, wanted)) {
            Some((rows, wanted)) => cost.add_deviation(tick.stiffness, &rows, &wanted, at.dimension()),
            None => cost.add_deviation(tick.stiffness, rows, wanted, at.dimension()),
        }
        cost
    }
}

impl PostureTask {
    /// The rate that is wanted of joint `i`.
    fn rate(&self, i: usize, q: f64, dt: f64) -> f64 {
        self.gain.min(1.0 / dt) * (self.posture[i] - q)
    }
}
