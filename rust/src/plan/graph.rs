//! The best way through the cells of a path, layer by layer (Bellman 1957), over all of them or under the lowest possible worst value.

use std::f64::consts::{PI, TAU};

use std::sync::Arc;

use rayon::prelude::*;

use super::edges::EdgeCosts;
use super::joint_weights::JointWeights;
use super::lattice::Cause;
use crate::robot::{AT_LIMIT, Limits};

/// Layers with fewer edges than this are searched on one core.
const PARALLEL: usize = 100_000;
/// A ceiling must not close the step that it comes from by rounding.
const WITHIN: f64 = 1.0 + 1e-12;

/// What is minimised over a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// The worst value; among paths that share it, the motion.
    Minimax,
    /// The integral of value and motion.
    Integral,
}

/// Cells of every layer, and what may follow what.
#[derive(Debug, Clone)]
pub struct Graph {
    /// Joints of a posture.
    pub n: usize,
    /// Values of the spare joints.
    pub slices: usize,
    /// Of each of them, those from which it may be reached.
    pub near: Arc<[Vec<usize>]>,
    /// Spin angles.
    pub angles: usize,
    /// Branches of a cell.
    pub branches: usize,
    /// Whether branches keep their names, so that only a singularity leads from one to another.
    pub named: bool,
    /// How many neighbouring branches have one name: whole turns of the same posture.
    pub copies: usize,
    /// Postures, layer by layer.
    pub q: Vec<f64>,
    /// Values.
    pub value: Vec<f64>,
    /// Why cells are out.
    pub cause: Vec<u8>,
    /// Joints whose whole turns do not matter.
    pub wide: Vec<bool>,
    /// Weights of the joints in the motion.
    pub joint_weights: JointWeights,
    /// Share of the path that each layer stands for; they sum to 1.
    pub weights: Vec<f64>,
    /// Share of the path from each layer to the next.
    pub steps: Vec<f64>,
    /// Largest motions from each layer to the next [rad or m], n a layer.
    pub bounds: Vec<f64>,
    /// How far joints move from each layer to the next while the tool takes a second for a metre [rad or m], n a layer: where the time of the slowest step counts
    /// (minimax).
    pub pace: Option<Vec<f64>>,
    /// The caller's own costs of steps.
    pub edges: Option<EdgeCosts>,
}

/// How it is searched.
#[derive(Debug, Clone, Copy)]
pub struct Search {
    /// Criterion.
    pub criterion: Criterion,
    /// Weight of the integral of the squared joint speed over the path's share.
    pub smoothness: f64,
    /// Spin cells that may be crossed from layer to layer, either way.
    pub window: usize,
    /// Whether the spin angles close a turn.
    pub around: bool,
    /// Largest motion of a joint where the branch changes [rad or m]; 0 forbids it.
    pub branch_step: f64,
    /// What the worst value may exceed its minimum by, relative, for the sake of motion (minimax).
    pub slack: f64,
}

impl Search {
    /// The search for the least motion among routes no worse than one, and the ceiling that makes them so (minimax).
    pub(super) fn under(&self, route: &Route) -> (Self, f64) {
        self.under_cost(route.cost)
    }

    /// The same from the worst value of a route.
    pub(super) fn under_cost(&self, cost: f64) -> (Self, f64) {
        (Self { criterion: Criterion::Integral, smoothness: 1.0, ..*self }, cost + self.slack * cost.abs())
    }
}

/// A way through the layers.
#[derive(Debug, Clone)]
pub struct Route {
    /// Cell of each layer that was reached.
    pub cells: Vec<usize>,
    /// What it costs: worst value, or integral.
    pub cost: f64,
    /// Which cells of the last layer can be reached.
    pub frontier: Vec<bool>,
}

/// Why there is no way from a layer to the next.
#[derive(Debug, Clone, Copy)]
pub struct Blockage {
    /// The joint that would have to move too far.
    pub joint: usize,
    /// How many times its bound, at the easiest of the steps.
    pub excess: f64,
}

/// Labels of a layer and the cells they came from.
#[derive(Debug, Clone)]
pub(super) struct Labels {
    /// What the best route to each cell costs; infinite where there is none.
    pub cost: Vec<f64>,
    /// The cell of the layer before from which it comes.
    pub from: Vec<u32>,
}

impl Graph {
    /// Cells of a layer.
    pub fn cells(&self) -> usize {
        self.slices * self.angles * self.branches
    }

    /// The postures that are open at the first layer and at the last, branch by branch. All whole turns of a posture are one.
    pub(super) fn seams(&self) -> Vec<usize> {
        let (names, samples) = (self.branches / self.copies, self.cells() / self.branches);
        let by_branch = (0..names).flat_map(|name| (0..samples).map(move |sample| sample * names + name));
        let open = |layer: usize, seam: usize| (0..self.copies).any(|copy| self.open(layer, seam * self.copies + copy));
        by_branch.filter(|&seam| open(0, seam) && open(self.layers() - 1, seam)).collect()
    }

    /// The posture of a cell, all its whole turns being one.
    pub(super) fn seam(&self, cell: usize) -> usize {
        cell / self.copies
    }

    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.weights.len()
    }

    /// Posture of a cell.
    #[inline(always)]
    pub fn posture(&self, layer: usize, cell: usize) -> &[f64] {
        let at = (layer * self.cells() + cell) * self.n;
        &self.q[at..at + self.n]
    }

    /// The postures of a cell at every layer.
    pub(super) fn postures(&self, cells: &[usize]) -> Vec<f64> {
        cells.iter().enumerate().flat_map(|(layer, &cell)| self.posture(layer, cell)).copied().collect()
    }

    /// Whether a cell holds a posture.
    #[inline(always)]
    pub(super) fn open(&self, layer: usize, cell: usize) -> bool {
        self.cause[layer * self.cells() + cell] == Cause::Feasible as u8
    }

    #[inline(always)]
    pub(super) fn value_of(&self, layer: usize, cell: usize) -> f64 {
        self.value[layer * self.cells() + cell]
    }

    /// Weighted squared motion between postures of neighbouring layers; `None` where a joint would have to move too far.
    #[inline(always)]
    fn motion(&self, from: &[f64], to: &[f64], bounds: &[f64], largest: f64) -> Option<f64> {
        let mut sum = 0.0;
        for i in 0..self.n {
            let mut apart = (to[i] - from[i]).abs();
            if self.wide[i] && apart > PI {
                apart -= TAU * (apart / TAU).round();
                apart = apart.abs();
            }
            if apart > bounds[i] || apart > largest {
                return None;
            }
            sum += self.joint_weights.square(i, apart);
        }
        Some(sum)
    }

    /// The best route: through all layers, or as far as there is a way. `best` is that of a sweep without a ceiling.
    pub(super) fn smoothed(&self, search: &Search, best: &Route) -> Route {
        if search.criterion == Criterion::Integral || best.cells.is_empty() {
            return best.clone();
        }
        // The same layers again under the lowest ceiling, for the least motion.
        let (under, ceiling) = search.under(best);
        let smooth = self.sweep(&under, None, Some(ceiling));
        if smooth.cells.len() < best.cells.len() { best.clone() } else { Route { cost: best.cost, ..smooth } }
    }

    /// One pass of dynamic programming; under a ceiling the values themselves do not count. `ends` are the cells at which a route may start and
    /// end.
    pub(super) fn sweep(&self, search: &Search, ends: Option<&[bool]>, ceiling: Option<f64>) -> Route {
        backtrack(&self.labels(search, ends, ceiling))
    }

    /// What the best route to every cell costs, layer by layer as far as there is a way.
    pub(super) fn labels(&self, search: &Search, ends: Option<&[bool]>, ceiling: Option<f64>) -> Vec<Labels> {
        if let (Some(pace), Some(most)) = (&self.pace, ceiling) {
            // No step may be slower than the ceiling: that bounds the motion on it.
            let bounds = self.bounds.iter().zip(pace).map(|(bound, pace)| bound.min(most * pace * WITHIN)).collect();
            return Self { bounds, pace: None, ..self.clone() }.labels(search, ends, ceiling);
        }
        let last = self.layers() - 1;
        let allowed = |layer: usize, cell: usize| {
            self.open(layer, cell)
                && ceiling.is_none_or(|ceiling| self.value_of(layer, cell) <= ceiling)
                && ends.is_none_or(|ends| (layer != 0 && layer != last) || ends[cell])
        };
        let own =
            |layer: usize, cell: usize| if ceiling.is_none() { self.own(search, layer, cell) } else { self.free(search, layer, cell) };
        let start = (0..self.cells()).map(|cell| if allowed(0, cell) { own(0, cell) } else { f64::INFINITY }).collect();
        let mut labels = vec![Labels { cost: start, from: Vec::new() }];
        for layer in 1..=last {
            let before = &labels[layer - 1].cost;
            if before.iter().all(|cost| cost.is_infinite()) {
                break;
            }
            let best = |cell: usize| {
                if allowed(layer, cell) { self.best_step(search, layer, cell, before, own(layer, cell)) } else { (f64::INFINITY, 0) }
            };
            let (cost, from) = self.of_every_cell(search, &best).into_iter().unzip();
            labels.push(Labels { cost, from });
        }
        labels
    }

    /// How many steps from cell to cell a sweep looks at, at most.
    pub(super) fn steps_of_sweep(&self, search: &Search) -> usize {
        let branches = if self.named && search.branch_step == 0.0 { self.copies } else { self.branches };
        let spins = (2 * search.window + 1).min(self.angles);
        let slices = self.near.iter().fold(0, |most, near| most.max(near.len()));
        self.layers() * self.cells() * branches * spins * slices
    }

    /// What a cell itself costs.
    pub(super) fn own(&self, search: &Search, layer: usize, cell: usize) -> f64 {
        match search.criterion {
            Criterion::Minimax => self.value_of(layer, cell),
            Criterion::Integral => self.weights[layer] * self.value_of(layer, cell),
        }
    }

    /// The same where values do not count.
    fn free(&self, search: &Search, layer: usize, cell: usize) -> f64 {
        if search.criterion == Criterion::Minimax { self.value_of(layer, cell) } else { 0.0 }
    }

    /// The layers from the last to the first.
    pub(super) fn reversed(&self) -> Self {
        let turned = |values: &[f64], width: usize| values.chunks_exact(width).rev().flatten().copied().collect::<Vec<f64>>();
        let cells = self.cells();
        Self {
            q: turned(&self.q, cells * self.n),
            value: turned(&self.value, cells),
            cause: self.cause.chunks_exact(cells).rev().flatten().copied().collect(),
            weights: turned(&self.weights, 1),
            steps: turned(&self.steps, 1),
            bounds: turned(&self.bounds, self.n),
            pace: self.pace.as_ref().map(|pace| turned(pace, self.n)),
            wide: self.wide.clone(),
            near: self.near.clone(),
            joint_weights: self.joint_weights.clone(),
            edges: self.edges.as_ref().map(EdgeCosts::reversed),
            ..*self
        }
    }

    /// Labels of the cells of a layer, on every core where there are many steps into them.
    pub(super) fn of_every_cell(&self, search: &Search, label: &(dyn Fn(usize) -> (f64, u32) + Sync)) -> Vec<(f64, u32)> {
        let edges = self.steps_of_sweep(search) / self.layers();
        if edges >= PARALLEL {
            (0..self.cells()).into_par_iter().with_min_len(16).map(label).collect()
        } else {
            (0..self.cells()).map(label).collect()
        }
    }

    /// The cheapest step into a cell, and where it comes from.
    #[inline(always)]
    pub(super) fn best_step(&self, search: &Search, layer: usize, cell: usize, before: &[f64], own: f64) -> (f64, u32) {
        let to = self.posture(layer, cell);
        let bounds = &self.bounds[(layer - 1) * self.n..layer * self.n];
        let factor = search.smoothness / self.steps[layer - 1];
        let mut best = (f64::INFINITY, 0);
        // A worst value is never less than the cell's own.
        let least = if search.criterion == Criterion::Minimax { own } else { f64::NEG_INFINITY };
        self.each_origin(search, cell, |from, largest| {
            if best.0 <= least || before[from] >= best.0 {
                return;
            }
            if let Some(square) = self.motion(self.posture(layer - 1, from), to, bounds, largest) {
                let edge = self.edges.as_ref().map_or(0.0, |edges| edges.cost(layer, from, cell, self.copies));
                let cost = match search.criterion {
                    Criterion::Minimax if edge.is_finite() => before[from].max(own).max(self.slowness(layer, from, to)),
                    Criterion::Minimax => f64::INFINITY,
                    Criterion::Integral => before[from] + own + factor * square + edge,
                };
                if cost < best.0 {
                    best = (cost, from as u32);
                }
            }
        });
        best
    }

    /// Calls `each` with every cell of the layer before from which a step may lead to `cell`, and with the largest motion of a joint on it.
    #[inline(always)]
    fn each_origin(&self, search: &Search, cell: usize, mut each: impl FnMut(usize, f64)) {
        let name = cell % self.branches / self.copies;
        let others = if self.named && search.branch_step == 0.0 { name * self.copies..(name + 1) * self.copies } else { 0..self.branches };
        self.each_neighbour(search, cell, |start| {
            for other in others.clone() {
                each(start + other, if self.named && other / self.copies == name { PI } else { search.branch_step });
            }
        });
    }

    /// The cells of the layer before from which a step leads to `cell`, in order.
    pub(super) fn origins(&self, search: &Search, layer: usize, cell: usize, found: &mut Vec<u32>) {
        let (to, bounds) = (self.posture(layer, cell), &self.bounds[(layer - 1) * self.n..layer * self.n]);
        found.clear();
        self.each_origin(search, cell, |from, largest| {
            if self.open(layer - 1, from) && self.motion(self.posture(layer - 1, from), to, bounds, largest).is_some() {
                found.push(from as u32);
            }
        });
        found.sort_unstable();
    }

    /// Calls `each` with the first cell of every sample within the windows around that of `cell`.
    #[inline(always)]
    fn each_neighbour(&self, search: &Search, cell: usize, mut each: impl FnMut(usize)) {
        let sample = cell / self.branches;
        let (slice, angle) = (sample / self.angles, (sample % self.angles) as isize);
        let (window, angles) = (search.window as isize, self.angles as isize);
        let full = search.around && 2 * window + 1 >= angles;
        let (low, high) = if full { (0, angles - 1) } else { (angle - window, angle + window) };
        for s in &self.near[slice] {
            for j in low..=high {
                let j = if search.around {
                    j.rem_euclid(angles)
                } else if (0..angles).contains(&j) {
                    j
                } else {
                    continue;
                };
                each((s * self.angles + j as usize) * self.branches);
            }
        }
    }

    /// The time that the tool takes for a metre \[s\] on a step into a posture of a layer, by the joint that is slowest; 0 where that does not count.
    #[inline(always)]
    fn slowness(&self, layer: usize, from: usize, to: &[f64]) -> f64 {
        let Some(pace) = &self.pace else { return 0.0 };
        self.excess(self.posture(layer - 1, from), to, &pace[(layer - 1) * self.n..layer * self.n], f64::INFINITY).excess
    }

    /// Why no cell of `layer` is reached from the one before: the joint in the way, at the step that asks least; `None` when no branch leads on.
    pub fn blockage(&self, search: &Search, layer: usize, reached: &[bool]) -> Option<Blockage> {
        let bounds = &self.bounds[(layer - 1) * self.n..layer * self.n];
        let mut best: Option<Blockage> = None;
        for cell in (0..self.cells()).filter(|&cell| self.open(layer, cell)) {
            let to = self.posture(layer, cell);
            self.each_neighbour(search, cell, |start| {
                for from in (start..start + self.branches).filter(|&from| reached[from]) {
                    // Without a bound of its own a joint still may not jump.
                    let worst = self.excess(self.posture(layer - 1, from), to, bounds, PI);
                    if best.is_none_or(|b| worst.excess < b.excess) {
                        best = Some(worst);
                    }
                }
            });
        }
        best
    }

    /// The layers once, then again without the first, which the last one is.
    pub fn twice(&self) -> Self {
        let (cells, n) = (self.cells(), self.n);
        let again = |values: &[f64], skip: usize| [values, &values[skip..]].concat();
        Self {
            q: again(&self.q, cells * n),
            value: again(&self.value, cells),
            cause: [&self.cause[..], &self.cause[cells..]].concat(),
            weights: again(&self.weights, 1),
            steps: again(&self.steps, 0),
            bounds: again(&self.bounds, 0),
            pace: self.pace.as_ref().map(|pace| again(pace, 0)),
            wide: self.wide.clone(),
            near: self.near.clone(),
            joint_weights: self.joint_weights.clone(),
            edges: self.edges.clone(),
            ..*self
        }
    }

    /// The joint of a motion that exceeds its bound, `most` at most, most.
    fn excess(&self, from: &[f64], to: &[f64], bounds: &[f64], most: f64) -> Blockage {
        let mut worst = Blockage { joint: 0, excess: 0.0 };
        for i in 0..self.n {
            let mut apart = (to[i] - from[i]).abs();
            if self.wide[i] {
                apart -= TAU * (apart / TAU).round();
            }
            let excess = apart.abs() / bounds[i].min(most);
            if excess > worst.excess {
                worst = Blockage { joint: i, excess };
            }
        }
        worst
    }

    /// The same graph with every whole turn of one wide joint within its limits as a branch of its own.
    pub fn with_turns(&self, joint: usize, low: f64, high: f64) -> Self {
        let copies = ((high - low + 2.0 * AT_LIMIT) / TAU).floor() as usize + 1;
        let (n, b) = (self.n, self.branches);
        let mut out = Self {
            branches: b * copies,
            copies: self.copies * copies,
            q: Vec::new(),
            value: Vec::new(),
            cause: Vec::new(),
            ..self.clone()
        };
        out.wide[joint] = false;
        for cell in 0..self.value.len() {
            let row = &self.q[cell * n..(cell + 1) * n];
            let first = row[joint] + TAU * ((low - AT_LIMIT - row[joint]) / TAU).ceil();
            for copy in 0..copies {
                let turned = first + TAU * copy as f64;
                let inside = turned <= high + AT_LIMIT;
                out.q.extend_from_slice(row);
                let at = out.q.len() - n + joint;
                out.q[at] = if inside { turned.max(low).min(high) } else { turned };
                out.value.push(self.value[cell]);
                out.cause.push(if inside { self.cause[cell] } else { self.cause[cell].max(Cause::JointLimit as u8) });
            }
        }
        out
    }

    /// Closes the whole turns of a layer's postures that are not those of one that is held there.
    pub fn hold(&mut self, layer: usize, held: &[f64]) {
        for cell in 0..self.cells() {
            let at = layer * self.cells() + cell;
            let row = &self.q[at * self.n..(at + 1) * self.n];
            if row.iter().zip(held).zip(&self.wide).any(|((x, held), wide)| !wide && (x - held).abs() > PI) {
                self.cause[at] = self.cause[at].max(Cause::JointLimit as u8);
            }
        }
    }

    /// Closes the postures beyond limits.
    pub fn close_beyond(&mut self, limits: &Limits) {
        for (row, cause) in self.q.chunks_exact(self.n).zip(&mut self.cause) {
            if !limits.contain(row) {
                *cause = (*cause).max(Cause::JointLimit as u8);
            }
        }
    }
}

fn backtrack(labels: &[Labels]) -> Route {
    let reached = labels.iter().rposition(|labels| labels.cost.iter().any(|cost| cost.is_finite()));
    let Some(last) = reached else {
        return Route { cells: Vec::new(), cost: f64::INFINITY, frontier: Vec::new() };
    };
    let (mut cell, mut cost) = (0, f64::INFINITY);
    for (i, &c) in labels[last].cost.iter().enumerate() {
        if c < cost {
            (cell, cost) = (i, c);
        }
    }
    let mut cells = vec![cell; last + 1];
    for layer in (1..=last).rev() {
        cell = labels[layer].from[cell] as usize;
        cells[layer - 1] = cell;
    }
    Route { cells, cost, frontier: labels[last].cost.iter().map(|cost| cost.is_finite()).collect() }
}
