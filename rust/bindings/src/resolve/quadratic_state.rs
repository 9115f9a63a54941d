//! What a `redundancy.QuadraticProgram` remembers, and its scene as a tick asks it.

use crate::collision::scene::PyScene;
use redundancy::collision::{Distances, Found, Proximity};
use redundancy::linalg::Row6;
use redundancy::linalg::vector::Vec3;
use redundancy::resolve::{Near, Outcome, QuadraticMemory};

/// What is remembered from step to step, and what came of the last one. Near pairs, 15 kB of them, lie apart: only ticks among obstacles touch them.
#[derive(Clone)]
pub struct State {
    pub outcome: Outcome,
    /// Rows of the last step's own.
    pub own: usize,
    pub near: Option<Box<Near>>,
    /// Posture and twists of the last step, where something counts beside the task.
    pub beside: Option<(Vec<f64>, Vec<Row6>)>,
    /// The path's frame at the end of the last step, about which a volume is.
    pub frame: Option<[Vec3; 3]>,
    pub memory: QuadraticMemory,
}

impl State {
    /// Nothing seen yet, with or without a scene.
    pub fn new(among_obstacles: bool) -> Self {
        Self {
            outcome: Outcome::default(),
            own: 0,
            near: among_obstacles.then(Box::default),
            beside: None,
            frame: None,
            memory: QuadraticMemory::default(),
        }
    }

    /// The pairs that were near in the last step.
    pub fn pairs(&self) -> &[Proximity] {
        self.near.as_ref().map_or(&[], |near| near.pairs())
    }
}

/// A scene that is locked for each question alone: a Python objective between two of them may ask it, or let another thread do so.
pub struct Shared<'a>(pub &'a PyScene);

impl Distances for Shared<'_> {
    fn near(&mut self, q: &[f64], influence: f64, out: &mut [Proximity]) -> redundancy::error::Result<Found> {
        self.0.lock().near(q, influence, out)
    }
}
