//! The points of a path whose postures are known, and routes through them.

use std::collections::HashMap;
use std::f64::consts::TAU;

use rayon::prelude::*;

use super::bound::{distinct, least_value};
use super::failure::Limited;
use super::graph::{Blockage, Graph, Search};
use super::grid::{SpareGrid, angle_grid};
use super::hooks::{Hooks, PlanError};
use super::lattice::{Cause, Cells, Lattice, wide_joints};
use super::numbers::{interpolated, sum};
use super::path::point_weights;
use super::pins::held_cells;
use super::problem::PathProblem;
use super::route::RouteFinder;
use super::settings::PlanSettings;
use crate::error::Error;

/// Numbers of postures that are computed between two signs of life.
const CHUNK: usize = 2_000_000;
/// Largest motion of a joint where the branch changes [rad]: it is at a singularity, where it is small.
const BRANCH_STEP: f64 = 0.5;
/// The same where branches have no names, so that motion alone tells which follows which.
const NAMELESS_STEP: f64 = 1.5;
/// Points of a search at most: what is between them is known well enough.
const MOST_LAYERS: usize = 1000;
/// Cells of the spin by which every joint has to be able to move from layer to layer.
const REACH: f64 = 2.0;
/// Which part of its range a spare joint may pass from layer to layer.
const SPARE_SHARE: usize = 8;
/// Points whose least values are found between two signs of life.
const BOUNDED: usize = 64;

/// A stretch of layers with a route: the layers' points, their postures, and what ended it, if anything.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// Points of the path.
    pub points: Vec<usize>,
    /// Postures, n joints a row.
    pub q: Vec<f64>,
    /// What keeps the next layer from being reached.
    pub blocked: Option<Blockage>,
}

impl Segment {
    /// All points of the segment, the first of them and postures, in between by interpolation.
    pub fn spread(&self, n: usize) -> (usize, Vec<f64>) {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        let known: Vec<f64> = self.points.iter().map(|&point| point as f64).collect();
        (first, interpolated((first..=last).map(|point| point as f64), &known, &self.q, n))
    }
}

/// The points of a path whose cells are known.
pub(super) struct Layers<'a> {
    problem: &'a PathProblem,
    settings: &'a PlanSettings,
    lattice: Lattice,
    spin_step: f64,
    cells: HashMap<usize, Cells>,
    /// The points in the order in which they came.
    order: Vec<usize>,
    /// Least values that are known.
    least: HashMap<usize, f64>,
}

impl<'a> Layers<'a> {
    /// None yet; over a grid of `finer` times as many spins as the settings say.
    pub fn new(problem: &'a PathProblem, settings: &'a PlanSettings, spare: &SpareGrid, finer: usize) -> Result<Self, Error> {
        let angles = angle_grid(spare.spins, settings.n_angles * finer, settings.spin_range)?;
        let (robot, frames, objective) = (problem.robot.clone(), problem.frames.clone(), problem.objective.clone());
        let lattice = Lattice::new(robot, frames, &problem.asked, &angles, spare, objective, problem.limits)?;
        let spin_step = if angles.len() > 1 { angles[1] - angles[0] } else { TAU };
        let (cells, order, least) = (HashMap::new(), Vec::new(), HashMap::new());
        Ok(Self { problem, settings, lattice, spin_step, cells, order, least })
    }

    /// Computes the cells of points, unless they are known.
    pub fn add(&mut self, points: &[usize], hooks: &mut Hooks) -> Result<(), PlanError> {
        let new: Vec<usize> = points.iter().copied().filter(|point| !self.is_known(*point)).collect();
        for chunk in new.chunks(self.chunk()) {
            let cells = self.computed(chunk, hooks)?;
            self.cells.extend(chunk.iter().copied().zip(cells));
            self.order.extend(chunk);
            hooks.advance(chunk.len());
        }
        Ok(())
    }

    /// Points that are computed at once.
    fn chunk(&self) -> usize {
        (CHUNK / (self.lattice.cells() * self.problem.n())).max(1)
    }

    /// The cells of some points, without what the caller refuses.
    fn computed(&self, points: &[usize], hooks: &mut Hooks) -> Result<Vec<Cells>, PlanError> {
        hooks.go_on()?;
        let n = self.problem.n();
        let mut all = self.lattice.allowed_cells(points, hooks)?;
        if let Some(branches) = &self.settings.branches {
            for cells in &mut all {
                let kept: Vec<bool> =
                    cells.open.iter().map(|cell| branches.contains(&(*cell as usize % self.lattice.branches()))).collect();
                cells.retain(n, &kept);
            }
        }
        for (point, cells) in points.iter().zip(&mut all) {
            if let Some(held) = held_cells(self.problem, &self.lattice, *point, hooks)? {
                *cells = held;
            }
        }
        Ok(all)
    }

    /// Whether the cells of a point are known.
    pub fn is_known(&self, point: usize) -> bool {
        self.cells.contains_key(&point)
    }

    /// Whether a point that is known has any posture.
    pub fn is_open(&self, point: usize) -> bool {
        self.cells.get(&point).is_some_and(Cells::is_open)
    }

    /// Why a point that is known has no posture: of its cells, the one that came nearest to having one counts.
    pub fn worst_cause(&self, point: usize) -> Option<Cause> {
        let worst = self.cells.get(&point)?.cause.iter().max()?;
        Cause::ALL.get(usize::from(*worst)).copied()
    }

    /// What is least beyond its limit at a point, and by how much.
    pub fn nearest_to_limits(&self, point: usize) -> Option<(Limited, f64)> {
        self.lattice.nearest_to_limits(point)
    }

    /// Whether joints to spare are on the grid.
    pub fn has_spare(&self) -> bool {
        self.lattice.held() > 0
    }

    /// Routes through some points whose cells are known, the last being the first where they are `closed`; bounds of the motion are multiplied by
    /// `haste`.
    pub fn finder(&self, points: &[usize], closed: bool, haste: f64) -> RouteFinder<'a> {
        let problem = self.problem;
        let limits = problem.limits.then(|| problem.robot.limits());
        let held = |(layer, point): (usize, &usize)| problem.pins.posture(*point).map(|q| (layer, q));
        let (graph, search) = self.searched(points, haste);
        RouteFinder::new(graph, search, limits, closed).holding(points.iter().enumerate().filter_map(held).collect())
    }

    /// The graph of some points whose cells are known, and how it is searched.
    pub fn searched(&self, points: &[usize], haste: f64) -> (Graph, Search) {
        let (problem, settings, lattice) = (self.problem, self.settings, &self.lattice);
        let layers: Vec<&Cells> = points.iter().filter_map(|point| self.cells.get(point)).collect();
        let values = layers.iter().flat_map(|cells| &cells.value).copied();
        let search = Search {
            criterion: problem.criterion,
            smoothness: problem.weight_of_motion(values),
            window: ((settings.max_spin_step / self.spin_step).round_ties_even() as usize).max(1),
            slice_window: self.slice_window(),
            around: settings.spin_range.is_none(),
            branch_step: match (lattice.has_branches(), settings.branch_changes) {
                (false, _) => NAMELESS_STEP,
                (true, true) => BRANCH_STEP,
                (true, false) => 0.0,
            },
            slack: 0.0,
        };
        (self.graph(points, &layers, haste), search)
    }

    /// The graph of some points.
    fn graph(&self, points: &[usize], layers: &[&Cells], haste: f64) -> Graph {
        let (problem, lattice) = (self.problem, &self.lattice);
        let (n, cells) = (problem.n(), lattice.cells());
        let spans: Vec<(usize, usize)> = points.windows(2).map(|pair| (pair[0], pair[1])).collect();
        let steps: Vec<f64> = spans.iter().map(|&(a, b)| sum(&problem.steps[a..b])).collect();
        let total = sum(&steps);
        let steps: Vec<f64> = steps.iter().map(|step| step / total).collect();
        let span = |&(a, b): &(usize, usize), k: usize| haste * (a..b).map(|i| problem.bounds[i * n + k]).sum::<f64>();
        let mut graph = Graph {
            n,
            slices: lattice.slices(),
            angles: lattice.angles(),
            branches: lattice.branches(),
            named: lattice.has_branches(),
            copies: 1,
            q: vec![f64::NAN; points.len() * cells * n],
            value: vec![f64::NAN; points.len() * cells],
            cause: Vec::with_capacity(points.len() * cells),
            wide: wide_joints(&problem.robot, problem.limits),
            weights: point_weights(&steps, false),
            steps,
            bounds: spans.iter().flat_map(|pair| (0..n).map(move |k| span(pair, k))).collect(),
        };
        for (layer, known) in layers.iter().enumerate() {
            graph.cause.extend_from_slice(&known.cause);
            for (i, &cell) in known.open.iter().enumerate() {
                let at = layer * cells + cell as usize;
                graph.value[at] = known.value[i];
                graph.q[at * n..(at + 1) * n].copy_from_slice(&known.q[i * n..(i + 1) * n]);
            }
        }
        self.with_coupled_turns(graph)
    }

    /// Where limits on combinations hold, whole turns of their joints tell postures apart: each is a branch of its own from the start.
    fn with_coupled_turns(&self, mut graph: Graph) -> Graph {
        let (robot, limits) = (&self.problem.robot, self.problem.robot.limits());
        if !self.problem.limits || limits.coupled.is_empty() {
            return graph;
        }
        for joint in (0..robot.n()).filter(|&joint| limits.coupled.iter().any(|combination| combination.row[joint] != 0.0)) {
            if graph.wide[joint] {
                let (low, high) = robot.span(joint);
                graph = graph.with_turns(joint, low, high);
            }
        }
        graph.close_beyond(limits);
        graph
    }

    /// How many values a spare joint may pass from layer to layer. Several joints are one after another in the grid, so neighbours lie far apart
    /// in it: all are looked at.
    fn slice_window(&self) -> usize {
        let slices = self.lattice.slices();
        if self.lattice.held() == 1 { (slices / SPARE_SHARE).max(1) } else { slices }
    }

    /// At how many points a search is worth while: joints have to be able to follow a change of the spin.
    pub fn most_layers(&self) -> usize {
        let least = |bounds: &[f64]| bounds.iter().fold(f64::INFINITY, |least, bound| least.min(*bound));
        let reach = sum(&self.problem.bounds.chunks_exact(self.problem.n()).map(least).collect::<Vec<_>>());
        let most = self.problem.points().min(MOST_LAYERS) as f64;
        most.min(reach / (REACH * self.spin_step)).max(2.0) as usize
    }

    /// At how many points a search can still pass from one value of a joint to spare to the next.
    pub fn layers_to_spare(&self) -> usize {
        let n = self.problem.n();
        let reach = |joint: usize| sum(&self.problem.bounds.iter().skip(joint).step_by(n).copied().collect::<Vec<_>>());
        let steps = self.lattice.spare_steps().into_iter().map(|(joint, step)| reach(joint) / (REACH * step));
        steps.fold(self.most_layers() as f64, f64::min).max(2.0) as usize
    }

    /// The `count` known points whose best posture is worst, the worst first: no path passes below them.
    pub fn hardest(&self, count: usize) -> Vec<usize> {
        let best = |point: &usize| self.cells[point].value.iter().fold(f64::INFINITY, |least, value| least.min(*value));
        let mut open: Vec<(usize, f64)> =
            self.order.iter().filter(|point| self.is_open(**point)).map(|point| (*point, best(point))).collect();
        open.sort_by(|a, b| b.1.total_cmp(&a.1));
        open.into_iter().take(count).map(|(point, _)| point).collect()
    }

    /// The best postures of a point that is known, no two of them next to each other.
    pub fn best_postures(&self, point: usize, most: usize) -> Vec<Vec<f64>> {
        let Some(cells) = self.cells.get(&point) else { return Vec::new() };
        distinct(&cells.q, &cells.value, self.problem.n(), most).into_iter().map(<[f64]>::to_vec).collect()
    }

    /// The least value at a point, from the cells of the search there.
    pub fn least(&mut self, point: usize, hooks: &mut Hooks) -> Result<f64, PlanError> {
        if let Some(least) = self.least.get(&point) {
            return Ok(*least);
        }
        self.add_quietly(point, hooks)?;
        hooks.go_on()?;
        let cells = &self.cells[&point];
        let least = least_value(&self.problem.alone(point), &cells.q, &cells.value);
        self.least.insert(point, least);
        Ok(least)
    }

    /// The same, from a posture beside.
    pub fn least_beside(&mut self, point: usize, q: &[f64], hooks: &mut Hooks) -> Result<f64, PlanError> {
        self.add_quietly(point, hooks)?;
        hooks.go_on()?;
        Ok(self.least_of(point, &self.cells[&point], q))
    }

    fn least_of(&self, point: usize, cells: &Cells, q: &[f64]) -> f64 {
        let postures = [&cells.q, q].concat();
        let values = [&cells.value[..], &self.problem.values(q)].concat();
        least_value(&self.problem.alone(point), &postures, &values)
    }

    /// The least values of all points of the path, each from the cells there and from a posture beside. Cells that are not known are not kept.
    pub fn least_of_all(&self, q: &[f64], hooks: &mut Hooks) -> Result<Vec<f64>, PlanError> {
        let n = self.problem.n();
        let points: Vec<usize> = (0..self.problem.points()).collect();
        let mut all = Vec::with_capacity(points.len());
        for chunk in points.chunks(BOUNDED.min(self.chunk())) {
            let new: Vec<usize> = chunk.iter().copied().filter(|point| !self.is_known(*point)).collect();
            let cells: HashMap<usize, Cells> = new.iter().copied().zip(self.computed(&new, hooks)?).collect();
            let least = |point: &usize| {
                self.least_of(*point, cells.get(point).unwrap_or_else(|| &self.cells[point]), &q[point * n..(point + 1) * n])
            };
            all.par_extend(chunk.par_iter().map(least));
            hooks.advance(new.len());
        }
        Ok(all)
    }

    fn add_quietly(&mut self, point: usize, hooks: &mut Hooks) -> Result<(), PlanError> {
        if !self.is_known(point) {
            let cells = self.computed(&[point], hooks)?;
            self.cells.extend([point].into_iter().zip(cells));
            self.order.push(point);
        }
        Ok(())
    }
}
