//! The points of a path whose postures are known, and routes through them.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::bound::{distinct, least_value};
use super::edges::EdgeTable;
use super::failure::Limited;
use super::floors::{Bottleneck, Floors, least_between};
use super::graph::{Blockage, Criterion, Graph, Search};
use super::grid::SpareGrid;
use super::hooks::{Hooks, PlanError};
use super::lattice::{Cause, Cells, Lattice, wide_joints};
use super::members::Members;
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
/// Values of the grid by which every joint has to be able to move from layer to layer.
const REACH: f64 = 2.0;
/// Points whose least values are found between two signs of life.
const BOUNDED: usize = 64;
/// Part of the turns of all joints that the tool may spin by from a point to the next, for the bound.
const LEAP: f64 = 0.6;
/// Samples in which an interval of the spin is cut to find its least value.
const CUT: usize = 8;
/// Samples at either side of a way that belong to it.
const BESIDE: usize = 3;

/// A stretch of layers with a route: the layers' points, their postures, and what ended it, if anything.
#[derive(Debug, Clone)]
pub(super) struct Segment {
    /// Points of the path.
    pub points: Vec<usize>,
    /// Postures, n joints a row.
    pub q: Vec<f64>,
    /// What keeps the next layer from being reached.
    pub blocked: Option<Blockage>,
    /// Which of the ways through these points it is.
    pub way: usize,
}

impl Segment {
    /// All points of the segment, the first of them and postures, in between by interpolation.
    pub fn spread(&self, n: usize) -> (usize, Vec<f64>) {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        (first, self.at(&(first..=last).collect::<Vec<_>>(), n))
    }

    /// Postures at some points in its range, by interpolation.
    pub fn at(&self, points: &[usize], n: usize) -> Vec<f64> {
        let known: Vec<f64> = self.points.iter().map(|&point| point as f64).collect();
        interpolated(points.iter().map(|&point| point as f64), &known, &self.q, n)
    }
}

/// The points of a path whose cells are known.
pub(super) struct Layers<'a> {
    problem: &'a PathProblem,
    settings: &'a PlanSettings,
    lattice: Lattice,
    spin_step: f64,
    /// Whether spins go round.
    around: bool,
    cells: HashMap<usize, Cells>,
    /// The points in the order in which they came.
    order: Vec<usize>,
    /// Least values that are known.
    least: HashMap<usize, f64>,
    /// What the caller says of steps.
    edges: EdgeTable,
    spare: &'a SpareGrid,
    /// Values above which a cell is of no use.
    ceiling: f64,
    floors: Floors,
    /// What no connected way is better than, as far as it is known.
    pub connected: f64,
}

impl<'a> Layers<'a> {
    /// None yet; over a grid of `finer` times as many spins as the settings say.
    pub fn new(problem: &'a PathProblem, settings: &'a PlanSettings, spare: &'a SpareGrid, finer: usize) -> Result<Self, Error> {
        let axis = problem.asked.spin_axis().unwrap_or([0.0, 0.0, 1.0]);
        let members = Members::of(problem.volume.as_ref(), axis, spare.spins, finer, settings)?;
        let (angles, around) = (&members.angles, members.around);
        let spin_step = if angles.len() > 1 { angles[1] - angles[0] } else { TAU };
        let (robot, frames, objective) = (problem.robot.clone(), problem.frames.clone(), problem.objective.clone());
        let lattice = Lattice::new(robot, frames, &problem.asked, members, &spare.finer(finer), objective, problem.limits)?;
        let (cells, order, least, edges) = (HashMap::new(), Vec::new(), HashMap::new(), EdgeTable::default());
        let ceiling = f64::INFINITY;
        // Of the turns of all joints in one step some are about the tool's axis.
        let reach = |bounds: &[f64]| LEAP * bounds.iter().map(|bound| bound.min(PI)).sum::<f64>();
        let leap = problem.bounds.chunks_exact(problem.n()).map(|bounds| (reach(bounds) / spin_step).ceil() as usize).collect();
        let floors = Floors::new(lattice.angles(), lattice.branches(), around, leap);
        Ok(Self {
            problem,
            settings,
            lattice,
            spin_step,
            around,
            cells,
            order,
            least,
            edges,
            spare,
            ceiling,
            floors,
            connected: f64::NEG_INFINITY,
        })
    }

    /// None yet over a grid `finer` times as fine, in which only what is better than `ceiling` counts.
    pub fn finer(&self, finer: usize, ceiling: f64) -> Result<Self, Error> {
        Ok(Self { ceiling, ..Self::new(self.problem, self.settings, self.spare, finer)? })
    }

    /// Computes the cells of points, unless they are known.
    pub fn add(&mut self, points: &[usize], hooks: &mut Hooks) -> Result<(), PlanError> {
        let new: Vec<usize> = points.iter().copied().filter(|point| !self.is_known(*point)).collect();
        for chunk in new.chunks(self.chunk()) {
            let cells = self.computed(chunk, hooks)?;
            self.cells.extend(chunk.iter().copied().zip(cells));
            self.order.extend(chunk);
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
        if problem_is_loose(self.problem, self.spare) {
            for (point, cells) in points.iter().zip(&mut all) {
                let kept: Vec<bool> = cells.q.chunks_exact(n).map(|q| self.problem.is_member(*point, q)).collect();
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

    /// Whether a point that is known has no posture but singular ones, which a way passes through.
    pub fn is_singular(&self, point: usize) -> bool {
        !self.is_open(point) && self.cells.get(&point).is_some_and(|cells| cells.cause.contains(&(Cause::Singular as u8)))
    }

    /// The postures of a point that is known, n joints a row.
    pub fn postures(&self, point: usize) -> &[f64] {
        self.cells.get(&point).map_or(&[], |cells| &cells.q)
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
    pub fn finder(&mut self, points: &[usize], closed: bool, haste: f64, hooks: &mut Hooks) -> Result<RouteFinder<'a>, PlanError> {
        let mut edges = std::mem::take(&mut self.edges);
        let finder = self.finder_among(points, closed, haste, &|_, _| true, &mut edges, hooks);
        self.edges = edges;
        finder
    }

    /// Routes whose slowest step is the fastest, for the largest speed of the tool.
    pub fn finder_of_speed(&self, problem: &PathProblem, points: &[usize], closed: bool, haste: f64) -> Option<RouteFinder<'a>> {
        let pace = problem.thinned(points).pace?;
        let (mut graph, search) = self.searched(points, haste, &|_, _| true);
        graph.pace = Some(pace.to_vec());
        let limits = self.problem.limits.then(|| self.problem.robot.limits());
        let search = Search { criterion: Criterion::Minimax, ..search };
        Some(RouteFinder::new(graph, search, limits, closed).holding(self.held(points)))
    }

    /// The layers at which a posture is held, with it.
    fn held(&self, points: &[usize]) -> Vec<(usize, &'a [f64])> {
        let problem = self.problem;
        points.iter().enumerate().filter_map(|(layer, point)| problem.pins.posture(*point).map(|q| (layer, q))).collect()
    }

    /// The same among those cells (layer, cell) that are allowed.
    fn finder_among(
        &self,
        points: &[usize],
        closed: bool,
        haste: f64,
        allowed: &dyn Fn(usize, usize) -> bool,
        edges: &mut EdgeTable,
        hooks: &mut Hooks,
    ) -> Result<RouteFinder<'a>, PlanError> {
        let problem = self.problem;
        let limits = problem.limits.then(|| problem.robot.limits());
        let (mut graph, search) = self.searched(points, haste, allowed);
        graph.edges = edges.of(points, &graph, &search, haste, hooks)?;
        Ok(RouteFinder::new(graph, search, limits, closed).holding(self.held(points)))
    }

    /// The graph of some points whose cells are known, and how it is searched.
    pub fn searched(&self, points: &[usize], haste: f64, allowed: &dyn Fn(usize, usize) -> bool) -> (Graph, Search) {
        let (problem, settings, lattice) = (self.problem, self.settings, &self.lattice);
        let layers: Vec<&Cells> = points.iter().filter_map(|point| self.cells.get(point)).collect();
        let values = layers.iter().flat_map(|cells| &cells.value).copied();
        let search = Search {
            criterion: problem.criterion,
            smoothness: problem.weight_of_motion(values),
            window: ((settings.max_spin_step / self.spin_step).round_ties_even() as usize).max(1),
            around: self.around,
            branch_step: match (lattice.has_branches(), settings.branch_changes) {
                (false, _) => NAMELESS_STEP,
                (true, true) => BRANCH_STEP,
                // Where branches of the others meet, the robot itself is not singular: joints that are held can move there.
                (true, false) if lattice.held() > 0 => BRANCH_STEP,
                (true, false) => 0.0,
            },
            slack: 0.0,
        };
        (self.graph(points, &layers, haste, allowed), search)
    }

    /// At how many points a search can still pass from one value of a joint to spare to the next, and from one spin to the next.
    pub fn layers_to_spare(&self) -> usize {
        let n = self.problem.n();
        let reach = |joint: usize| sum(&self.problem.bounds.iter().skip(joint).step_by(n).copied().collect::<Vec<_>>());
        let slowest = (0..n).map(reach).fold(f64::INFINITY, f64::min) / (REACH * self.spin_step);
        let steps = self.lattice.spare_steps().into_iter().map(|(joint, step)| reach(joint) / (REACH * step));
        steps.fold(slowest.min(self.problem.points() as f64), f64::min).max(2.0) as usize
    }

    /// Points at which a search begins.
    pub fn first_layers(&self) -> usize {
        self.settings.layers
    }

    /// Routes along a way of intervals of the spin: as `finder`, with all cells closed that are further than a few from it.
    pub fn finder_along(&self, way: &[(usize, usize)], hooks: &mut Hooks) -> Result<RouteFinder<'a>, PlanError> {
        let (b, angles) = (self.lattice.branches(), self.lattice.angles());
        let points: Vec<usize> = way.iter().map(|(point, _)| *point).collect();
        let mut kept: Vec<Vec<bool>> = Vec::with_capacity(way.len());
        for (layer, _) in way.iter().enumerate() {
            let mut open = vec![false; self.lattice.cells()];
            // Between two layers a way may pass all that is between its intervals.
            for &(_, interval) in &way[layer.saturating_sub(1)..(layer + 2).min(way.len())] {
                for by in 0..=2 * BESIDE {
                    let angle = (interval / b + angles + by - BESIDE) % angles;
                    open[angle * b + interval % b] = true;
                }
            }
            kept.push(open);
        }
        self.finder_among(&points, false, f64::INFINITY, &|layer, cell| kept[layer][cell], &mut EdgeTable::default(), hooks)
    }

    /// The graph of some points.
    fn graph(&self, points: &[usize], layers: &[&Cells], haste: f64, allowed: &dyn Fn(usize, usize) -> bool) -> Graph {
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
            near: lattice.near().clone(),
            angles: lattice.angles(),
            branches: lattice.branches(),
            named: lattice.has_branches(),
            copies: 1,
            q: vec![f64::NAN; points.len() * cells * n],
            value: vec![f64::NAN; points.len() * cells],
            cause: Vec::with_capacity(points.len() * cells),
            wide: wide_joints(&problem.robot, problem.limits),
            joint_weights: problem.joint_weights.clone(),
            weights: point_weights(&steps, false),
            steps,
            bounds: spans.iter().flat_map(|pair| (0..n).map(move |k| span(pair, k))).collect(),
            pace: None,
            edges: None,
        };
        for (layer, known) in layers.iter().enumerate() {
            graph.cause.extend_from_slice(&known.cause);
            for (i, &cell) in known.open.iter().enumerate() {
                let at = layer * cells + cell as usize;
                if known.value[i] > self.ceiling || !allowed(layer, cell as usize) {
                    graph.cause[at] = Cause::Singular as u8;
                }
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

    /// The mean of the best cells of the points that are known, weighed as the points that are nearest to each stand for.
    pub fn mean_of_best(&self, weights: &[f64]) -> f64 {
        let mut points: Vec<usize> = self.order.iter().copied().filter(|point| self.is_open(*point)).collect();
        points.sort_unstable();
        let best = |point: &usize| self.cells[point].value.iter().fold(f64::INFINITY, |least, value| least.min(*value));
        let (mut mean, mut nearest) = (0.0, points.iter().map(|point| (*point, best(point))).peekable());
        let Some(mut here) = nearest.next() else { return f64::NEG_INFINITY };
        for (i, weight) in weights.iter().enumerate() {
            while let Some(next) = nearest.next_if(|next| next.0.abs_diff(i) < here.0.abs_diff(i)) {
                here = next;
            }
            mean += weight * here.1;
        }
        mean
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
        }
        Ok(all)
    }

    /// Whether the least bottleneck over connected ways can be told: branches are known by name along one line of spins.
    pub fn has_floors(&self) -> bool {
        self.lattice.has_branches() && self.lattice.slices() == 1 && self.lattice.angles() > 2 && !self.settings.branch_changes
    }

    /// The least bottleneck of the layers that are known.
    pub fn bottleneck(&mut self) -> Option<Bottleneck> {
        let new: Vec<usize> = self.order.iter().copied().filter(|&point| !self.floors.has(point) && self.is_open(point)).collect();
        for point in new {
            let cells = &self.cells[&point];
            let mut value = vec![f64::INFINITY; self.lattice.cells()];
            cells.open.iter().zip(&cells.value).for_each(|(&cell, &known)| value[cell as usize] = known);
            self.floors.add(point, value);
        }
        self.floors.bottleneck()
    }

    /// Replaces the first guess of an interval's least value by its minimum: from finer samples, and from there by Newton. Of those intervals of a
    /// way whose guess is below `target`, the lowest `most`. Whether there was any.
    pub fn sharpen(&mut self, way: &[(usize, usize)], target: f64, most: usize) -> bool {
        let floors = &self.floors;
        let mut blunt: Vec<(usize, usize)> =
            way.iter().copied().filter(|&(point, i)| !floors.is_sharp(point, i) && floors.least(point, i) < target).collect();
        let least = |&(point, i): &(usize, usize)| floors.least(point, i);
        blunt.sort_by(|a, b| least(b).total_cmp(&least(a)));
        blunt.truncate(most);
        let found: Vec<f64> = blunt.par_iter().map(|&(point, interval)| self.least_within(point, interval)).collect();
        for (&(point, interval), least) in blunt.iter().zip(found) {
            if let Some(line) = self.floors.line_mut(point) {
                (line.least[interval], line.sharp[interval]) = (least, true);
            }
        }
        !blunt.is_empty()
    }

    /// The least value of an interval of spins: between finer samples, and by Newton where it is at one of them.
    fn least_within(&self, point: usize, interval: usize) -> f64 {
        let (angle, branch) = (interval / self.lattice.branches(), interval % self.lattice.branches());
        let allowed = |spin: f64| self.settings.spin_range.is_none_or(|(low, high)| (low..=high).contains(&spin));
        let sample = |k: usize| {
            let spin = self.lattice.spin(angle) + self.spin_step * (k as f64 - 1.0) / CUT as f64;
            if allowed(spin) { self.lattice.spun(point, spin, branch) } else { None }
        };
        // One sample more at either side, for the slopes there.
        let samples: Vec<Option<(Vec<f64>, f64)>> = (0..CUT + 3).map(sample).collect();
        let value = |k: usize| samples[k].as_ref().map_or(f64::INFINITY, |(_, value)| *value);
        let four = |k: usize| [value(k - 1), value(k), value(k + 1), value(k + 2)];
        let guess = (1..=CUT).map(|k| least_between(four(k))).fold(f64::INFINITY, f64::min);
        let lowest = (1..=CUT + 1).fold(1, |best, k| if value(k) < value(best) { k } else { best });
        let inside = value(lowest) <= value(lowest - 1)
            && value(lowest) <= value(lowest + 1)
            && value(lowest - 1).max(value(lowest + 1)).is_finite();
        match &samples[lowest] {
            Some((q, value)) if inside => least_value(&self.problem.alone(point), q, &[*value]).max(guess),
            _ => guess,
        }
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

/// Whether cells need not be members of the volume that is asked for: their spin is not theirs to choose.
fn problem_is_loose(problem: &PathProblem, spare: &SpareGrid) -> bool {
    problem.volume.is_some() && !spare.spins
}
