//! The caller's own costs of moving from a posture to the next: a table of all steps of a search.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use super::graph::{Graph, Search};
use super::hooks::{Hooks, PlanError};

/// Steps of which the caller is asked at once, about.
pub(super) const BATCH: usize = 100_000;

/// Costs of the steps from one layer to the next.
#[derive(Debug, Default)]
struct Steps {
    /// Where the steps into each cell begin, and where the last ones end.
    start: Vec<u32>,
    /// The cells that they come from, in order for each cell.
    from: Vec<u32>,
    /// What they cost.
    cost: Vec<f64>,
}

/// Costs of all steps through the layers of a graph.
#[derive(Debug, Clone)]
pub struct EdgeCosts {
    /// Neighbouring branches of one name in the cells that were asked of.
    copies: usize,
    layers: Vec<Arc<Steps>>,
    /// Whether the layers are those of the path from its end to its start.
    backwards: bool,
}

/// What is known of the steps between points of a path.
#[derive(Debug, Default)]
pub(super) struct EdgeTable {
    /// By their points, with the haste at which they were asked of: with less there are fewer.
    known: HashMap<(usize, usize), (f64, Arc<Steps>)>,
}

impl EdgeCosts {
    /// The same from the end of the path to its start.
    pub(super) fn reversed(&self) -> Self {
        Self { backwards: !self.backwards, ..self.clone() }
    }

    /// The cost of a step into a cell of a layer, in a graph whose branches have `copies` of one name; infinite if it was not asked of.
    #[inline(always)]
    pub(super) fn cost(&self, layer: usize, from: usize, to: usize, copies: usize) -> f64 {
        let turns = copies / self.copies;
        // A path that is searched twice round has the same layers again.
        let layer = (layer - 1) % self.layers.len();
        let (layer, from, to) = if self.backwards { (self.layers.len() - 1 - layer, to, from) } else { (layer, from, to) };
        let (steps, to) = (&self.layers[layer], to / turns);
        let (first, end) = (steps.start[to] as usize, steps.start[to + 1] as usize);
        steps.from[first..end].binary_search(&((from / turns) as u32)).map_or(f64::INFINITY, |i| steps.cost[first + i])
    }
}

impl EdgeTable {
    /// The costs of a graph over some points of the path, whose bounds of the motion are multiplied by `haste`; `None` without a caller's cost.
    pub fn of(
        &mut self,
        points: &[usize],
        graph: &Graph,
        search: &Search,
        haste: f64,
        hooks: &mut Hooks,
    ) -> Result<Option<EdgeCosts>, PlanError> {
        if hooks.edge_cost.is_none() {
            return Ok(None);
        }
        let mut layers = Vec::with_capacity(points.len());
        for (i, pair) in points.windows(2).enumerate() {
            let key = (pair[0], pair[1]);
            let steps = match self.known.get(&key) {
                Some((asked, steps)) if *asked >= haste => steps.clone(),
                _ => {
                    let steps = Arc::new(Steps::of(graph, search, i + 1, hooks)?);
                    self.known.insert(key, (haste, steps.clone()));
                    steps
                }
            };
            layers.push(steps);
        }
        Ok(Some(EdgeCosts { copies: graph.copies, layers, backwards: false }))
    }
}

impl Steps {
    /// Asks of all steps into a layer that are within bounds.
    fn of(graph: &Graph, search: &Search, layer: usize, hooks: &mut Hooks) -> Result<Self, PlanError> {
        let mut steps = Self { start: vec![0], ..Self::default() };
        let (mut origins, mut asked) = (Vec::new(), Asked::new(graph.n));
        for cell in 0..graph.cells() {
            if graph.open(layer, cell) {
                graph.origins(search, layer, cell, &mut origins);
                let after = graph.posture(layer, cell);
                for &from in &origins {
                    let before = graph.posture(layer - 1, from as usize);
                    // Joints whose whole turns do not matter end next to where they begin.
                    let turns = |k: usize| if graph.wide[k] { ((after[k] - before[k]) / TAU).round() } else { 0.0 };
                    asked.push(before, (0..graph.n).map(|k| after[k] - TAU * turns(k)));
                }
                steps.from.extend_from_slice(&origins);
                asked.answer_if(BATCH, &mut steps.cost, hooks)?;
            }
            steps.start.push(steps.from.len() as u32);
        }
        asked.answer_if(1, &mut steps.cost, hooks)?;
        Ok(steps)
    }
}

/// Steps that the caller is about to be asked of.
pub(super) struct Asked {
    n: usize,
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Asked {
    /// None yet, of n joints.
    pub fn new(n: usize) -> Self {
        Self { n, before: Vec::new(), after: Vec::new() }
    }

    /// One more.
    pub fn push(&mut self, before: &[f64], after: impl Iterator<Item = f64>) {
        self.before.extend_from_slice(before);
        self.after.extend(after);
    }

    /// Asks once there are `least` of them, and adds what they cost.
    pub fn answer_if(&mut self, least: usize, costs: &mut Vec<f64>, hooks: &mut Hooks) -> Result<(), PlanError> {
        if self.before.len() >= least * self.n {
            hooks.go_on()?;
            costs.extend(hooks.edge_costs(&self.before, &self.after, self.n)?);
            self.before.clear();
            self.after.clear();
        }
        Ok(())
    }
}
