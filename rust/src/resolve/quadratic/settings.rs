//! What a programme is made of, asked and answers.

use super::index_term::IndexMemory;
use super::rest::Closing;
use crate::error::{Error, Result, check_positive};
use crate::linalg::{MAX_JOINTS, Row6};
use crate::qp::{ActiveSet, Constraint, Place, Row, Side};
use crate::resolve::PathFrame;

/// Settings of [`QuadraticSolver`](super::QuadraticSolver).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticSettings {
    /// Length that weighs angular deviations against linear ones \[m\].
    pub length: f64,
    /// Length of a tick \[s\].
    pub dt: f64,
    /// Weight of each joint's squared rate (Q).
    pub rate_weights: [f64; MAX_JOINTS],
    /// Weight of the squared deviation (Q_delta) where a tick does not say.
    pub stiffness: f64,
    /// Largest angular [rad/s] and linear [m/s] deviation, a component; infinite for none.
    pub largest_deviation: (f64, f64),
    /// Whether limits of position, speed and acceleration hold.
    pub limits: bool,
    /// Deviation, as a part of the twist, up to which the task counts as kept.
    pub tolerance: f64,
}

impl Default for QuadraticSettings {
    fn default() -> Self {
        Self {
            length: 1.0,
            dt: 1e-3,
            rate_weights: [1.0; MAX_JOINTS],
            stiffness: 1e4,
            largest_deviation: (f64::INFINITY, f64::INFINITY),
            limits: true,
            tolerance: 1e-3,
        }
    }
}

impl QuadraticSettings {
    pub(super) fn check(&self, n: usize) -> Result<()> {
        for (name, value) in [("length", self.length), ("dt", self.dt), ("stiffness", self.stiffness), ("tolerance", self.tolerance)] {
            check_positive(name, value)?;
        }
        for weight in &self.rate_weights[..n] {
            check_positive("rate_weights", *weight)?;
        }
        for value in [self.largest_deviation.0, self.largest_deviation.1] {
            if value.is_nan() || value < 0.0 {
                return Err(Error::value("largest_deviation", value, "a number of at least 0"));
            }
        }
        Ok(())
    }
}

/// How a tick ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuadraticStatus {
    /// The task is kept.
    Solved,
    /// The task gives way to rows or to the worth of the index; the deviation says by how much.
    Relaxed,
    /// The task gives way to limits of joints.
    Limited,
    /// A joint is beyond a limit of position, or the tool outside the volume, and comes back; the task is followed as far as that allows.
    Returning,
    /// Rows exclude each other or the limits: all of them give way by as little as can be, and the largest deviation does not count.
    Infeasible,
    /// The printed form is not convex: the index is left out.
    NotConvex,
}

impl QuadraticStatus {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::Relaxed => "relaxed",
            Self::Limited => "limited",
            Self::Returning => "returning",
            Self::Infeasible => "infeasible",
            Self::NotConvex => "not convex",
        }
    }
}

/// What a tick asks for.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Posture.
    pub q: &'a [f64],
    /// Twist of the tool [omega; v].
    pub twist: Row6,
    /// Weight of the squared deviation.
    pub stiffness: f64,
    /// `lower <= a'qd <= upper`, at most [`MAX_OWN_ROWS`](super::MAX_OWN_ROWS).
    pub rows: &'a [Row<'a>],
    /// Twists of the frames beside the task [omega; v], in their order; a frame without one does not count.
    pub twists: &'a [Row6],
    /// The path's frame, about which a volume is: without it a volume does not count.
    pub frame: Option<PathFrame>,
}

/// What came of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub status: QuadraticStatus,
    /// The part of the twist that is not followed [omega; v].
    pub deviation: Row6,
    /// Rows that fail, one bit a row.
    pub failed: u64,
    /// Whether the largest deviation is exceeded, by little.
    pub beyond_deviation: bool,
    /// Whether the index could be evaluated, with numbers that the programme can hold.
    pub conditioned: bool,
    /// Whether the tool is outside the volume about the path's frame at the end, by more than rounding: bounds excluded each other, or it comes back.
    pub outside: bool,
    /// Constraints that the programme added or dropped.
    pub changes: usize,
}

impl Default for Outcome {
    /// Nothing asked yet.
    fn default() -> Self {
        let status = QuadraticStatus::Solved;
        Self { status, deviation: [0.0; 6], failed: 0, beyond_deviation: false, conditioned: true, outside: false, changes: 0 }
    }
}

/// What is remembered from tick to tick.
#[derive(Debug, Clone, Copy)]
pub struct QuadraticMemory {
    /// Rates of the tick before, if there was one.
    pub rates: Option<[f64; MAX_JOINTS]>,
    /// Rates of the tick before that, where jerk counts.
    pub(super) earlier: Option<[f64; MAX_JOINTS]>,
    active: ([Constraint; MAX_JOINTS], usize),
    pub(super) closing: Closing,
    /// Last, as it is large and touched by BFGS alone.
    pub(super) index: IndexMemory,
}

impl Default for QuadraticMemory {
    fn default() -> Self {
        let none = Constraint { place: Place::Bound(0), side: Side::Lower };
        let active = ([none; MAX_JOINTS], 0);
        Self { rates: None, earlier: None, active, closing: Closing::default(), index: IndexMemory::default() }
    }
}

impl QuadraticMemory {
    /// Forgets which constraints were active, and nothing else: the next tick starts cold, with the same answer.
    pub fn forget_active(&mut self) {
        self.active.1 = 0;
    }

    pub(super) fn start<const C: usize>(&self) -> ActiveSet<C> {
        let mut out = ActiveSet::default();
        for item in &self.active.0[..self.active.1] {
            out.push(*item);
        }
        out
    }

    pub(super) fn keep<const C: usize>(&mut self, active: &ActiveSet<C>) {
        let items = active.as_slice();
        self.active.0[..items.len()].copy_from_slice(items);
        self.active.1 = items.len();
    }
}
