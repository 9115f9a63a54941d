//! What a plan chooses from: every posture at every point of the path, over a grid of the tool's spin and of the joints that are to spare.

mod held;

use std::f64::consts::TAU;
use std::sync::Arc;

use rayon::prelude::*;

use super::continued::continued;
use super::failure::{Limited, farthest_beyond};
use super::grid::SpareGrid;
use super::hooks::{Hooks, PlanError};
use super::members::Members;
use super::spare::cell_task;
use crate::error::{Error, Result};
use crate::index::Objective;
use crate::inverse::{MAX_SOLUTIONS, Solutions, TaskInverse};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::robot::{AT_LIMIT, Robot};
use crate::task::Task;

/// A value from which on it is infinite but for rounding: that of a condition number whose smallest singular value is nothing but rounding.
const INFINITE: f64 = 1e12;

/// Why a cell holds no posture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Cause {
    /// It holds one.
    Feasible = 0,
    /// No solution of the inverse kinematics on this branch.
    Unreachable = 1,
    /// A joint would be beyond its limit.
    JointLimit = 2,
    /// The objective is not finite.
    Singular = 3,
    /// The user's own reason.
    Predicate = 4,
}

/// The cells of one point.
#[derive(Debug, Clone, Default)]
pub(super) struct Cells {
    /// Why a cell holds no posture, one number a cell.
    pub cause: Vec<u8>,
    /// Those that hold one, in order.
    pub open: Vec<u32>,
    /// Their postures, n joints a row.
    pub q: Vec<f64>,
    /// Their values.
    pub value: Vec<f64>,
}

impl Cells {
    /// Takes out the open cells that are not kept.
    pub fn retain(&mut self, n: usize, kept: &[bool]) {
        let open = std::mem::take(&mut self.open);
        let (q, value) = (std::mem::take(&mut self.q), std::mem::take(&mut self.value));
        for (i, cell) in open.into_iter().enumerate() {
            if kept[i] {
                self.open.push(cell);
                self.value.push(value[i]);
                self.q.extend_from_slice(&q[i * n..(i + 1) * n]);
            } else {
                self.cause[cell as usize] = Cause::Predicate as u8;
            }
        }
    }

    /// Whether there is any posture.
    pub fn is_open(&self) -> bool {
        !self.open.is_empty()
    }
}

/// Joints held at one of the values of the grid, and those that are left.
#[derive(Debug, Clone)]
struct Slice {
    held: Vec<(usize, f64)>,
    moving: Vec<usize>,
    /// `None` where the others, held so, can move while the tool does not.
    inverse: Option<TaskInverse>,
}

/// The grid.
#[derive(Debug, Clone)]
pub struct Lattice {
    robot: Arc<Robot>,
    frames: Arc<[Frame]>,
    members: Members,
    slices: Vec<Slice>,
    near: Arc<[Vec<usize>]>,
    /// The slices, each beside the one before it.
    order: Vec<usize>,
    /// Whether there is neither a closed form nor an elimination for some cells.
    searched: bool,
    objective: Option<Objective>,
    limits: bool,
    branches: usize,
    /// What a cell asks of the tool.
    task: Task,
}

impl Cause {
    /// Every cause, by its number.
    pub const ALL: [Self; 5] = [Self::Feasible, Self::Unreachable, Self::JointLimit, Self::Singular, Self::Predicate];
}

impl Lattice {
    /// `frames` are those of the tool at spin 0, one a point, from which it may be turned as the `members` are. The joints to spare are held at each of their values in turn.
    pub fn new(
        robot: Arc<Robot>,
        frames: Arc<[Frame]>,
        task: &Task,
        members: Members,
        spare: &SpareGrid,
        objective: Option<Objective>,
        limits: bool,
    ) -> Result<Self> {
        if let Some(objective) = &objective {
            objective.check(&robot)?;
        }
        if frames.is_empty() || members.turns.is_empty() || spare.values.is_empty() {
            return Err(Error::value("path", "empty", "at least one point, one angle and one value of the spare joints"));
        }
        let moving: Vec<usize> = (0..robot.n()).filter(|i| !spare.joints.contains(i)).collect();
        let slices = spare
            .values
            .iter()
            .map(|row| {
                let held: Vec<(usize, f64)> = spare.joints.iter().copied().zip(row.iter().copied()).collect();
                Slice::new(&robot, held, moving.clone(), cell_task(spare.spins, task))
            })
            .collect::<Result<Vec<Slice>>>()?;
        let inverses = || slices.iter().filter_map(|slice| slice.inverse.as_ref());
        let branches = if inverses().all(TaskInverse::has_branches) { 8 } else { MAX_SOLUTIONS };
        let searched = inverses().any(|inverse| inverse.structure().is_none());
        Ok(Self {
            robot,
            frames,
            near: together(&spare.neighbours(), &members.near).into(),
            members,
            slices,
            order: spare.order(),
            searched,
            objective,
            limits,
            branches,
            task: cell_task(spare.spins, task),
        })
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.frames.len()
    }

    /// A spin of the grid \[rad\].
    pub(super) fn spin(&self, angle: usize) -> f64 {
        self.members.angles[angle]
    }

    /// Spin angles of the grid.
    pub fn angles(&self) -> usize {
        self.members.angles.len()
    }

    /// Tilts of the grid, each with its heading \[rad\].
    pub fn tilts(&self) -> &[[f64; 2]] {
        &self.members.directions
    }

    /// Values of the spare joints, each with all tilts.
    pub fn slices(&self) -> usize {
        self.slices.len() * self.members.tilts()
    }

    /// Of each of them, those from which it may be reached.
    pub(super) fn near(&self) -> &Arc<[Vec<usize>]> {
        &self.near
    }

    /// Joints that are held on the grid.
    pub fn held(&self) -> usize {
        self.slices.first().map_or(0, |slice| slice.held.len())
    }

    /// The joints to spare, each with the least distance of two of its values [rad or m].
    pub(super) fn spare_steps(&self) -> Vec<(usize, f64)> {
        let Some(first) = self.slices.first() else { return Vec::new() };
        let least = |at: usize| {
            let mut all: Vec<f64> = self.slices.iter().map(|slice| slice.held[at].1).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min)
        };
        first.held.iter().enumerate().map(|(at, &(joint, _))| (joint, least(at))).collect()
    }

    /// Branches of a cell.
    pub fn branches(&self) -> usize {
        self.branches
    }

    /// Whether branches are the same from cell to cell.
    pub fn has_branches(&self) -> bool {
        self.branches < MAX_SOLUTIONS
    }

    /// Cells of one point: spare values by tilts by angles by branches.
    pub fn cells(&self) -> usize {
        self.slices.len() * self.members.turns.len() * self.branches
    }

    /// Postures (NaN where there are none), values and causes of some points, as the outputs take them, on every core.
    pub fn fill(&self, points: &[usize], q: &mut [f64], value: &mut [f64], cause: &mut [u8]) {
        let (n, cells) = (self.robot.n(), self.cells());
        let outputs = q.par_chunks_mut(cells * n).zip(value.par_chunks_mut(cells)).zip(cause.par_chunks_mut(cells));
        points.par_iter().zip(outputs).for_each(|(point, ((q, value), cause))| {
            q.fill(f64::NAN);
            self.point(*point, q, value, cause);
        });
    }

    /// The cells of some points, in their order, only those kept that hold a posture.
    pub(super) fn cells_of(&self, points: &[usize]) -> Vec<Cells> {
        let (n, cells) = (self.robot.n(), self.cells());
        let one = |(q, value): &mut (Vec<f64>, Vec<f64>), point: &usize| {
            let mut cause = vec![0; cells];
            self.point(*point, q, value, &mut cause);
            let open: Vec<u32> = (0..cells as u32).filter(|&cell| cause[cell as usize] == Cause::Feasible as u8).collect();
            let posture = |&cell: &u32| q[cell as usize * n..(cell as usize + 1) * n].iter().copied();
            Cells {
                q: open.iter().flat_map(posture).collect(),
                value: open.iter().map(|&cell| value[cell as usize]).collect(),
                open,
                cause,
            }
        };
        points.par_iter().map_init(|| (vec![0.0; cells * n], vec![0.0; cells]), one).collect()
    }

    /// The same without what the caller refuses.
    pub(super) fn allowed_cells(&self, points: &[usize], hooks: &mut Hooks) -> std::result::Result<Vec<Cells>, PlanError> {
        let n = self.robot.n();
        let mut all = self.cells_of(points);
        if hooks.feasible.is_some() {
            let postures: Vec<f64> = all.iter().flat_map(|cells| &cells.q).copied().collect();
            if let Some(allowed) = hooks.allowed(&postures, n)? {
                let mut rest = &allowed[..];
                for cells in &mut all {
                    let (own, others) = rest.split_at(cells.open.len());
                    cells.retain(n, own);
                    rest = others;
                }
            }
        }
        Ok(all)
    }

    /// As [`Lattice::survey`], without what the caller refuses.
    ///
    /// # Errors
    /// [`PlanError`] if the caller's predicate fails.
    pub fn survey_allowed(
        &self,
        first: usize,
        value: &mut [f64],
        cause: &mut [u8],
        hooks: &mut Hooks,
    ) -> std::result::Result<(), PlanError> {
        let cells = self.cells();
        let points: Vec<usize> = (first..first + value.len() / cells).collect();
        value.fill(f64::NAN);
        let outputs = value.chunks_exact_mut(cells).zip(cause.chunks_exact_mut(cells));
        for (known, (value, cause)) in self.allowed_cells(&points, hooks)?.into_iter().zip(outputs) {
            cause.copy_from_slice(&known.cause);
            known.open.iter().zip(known.value).for_each(|(cell, known)| value[*cell as usize] = known);
        }
        Ok(())
    }

    /// As [`Lattice::fill`], of the points from `first` on, without keeping the postures.
    pub fn survey(&self, first: usize, value: &mut [f64], cause: &mut [u8]) {
        let (n, cells) = (self.robot.n(), self.cells());
        value
            .par_chunks_mut(cells)
            .zip(cause.par_chunks_mut(cells))
            .enumerate()
            .for_each_init(|| vec![0.0; cells * n], |q, (i, (value, cause))| self.point(first + i, q, value, cause));
    }

    /// Postures and values of the open cells of point `i` at a spin of its own, on a branch, with nothing to spare.
    pub(super) fn spun(&self, i: usize, spin: f64, branch: usize) -> Option<(Vec<f64>, f64)> {
        let slice = &self.slices[0];
        let found = slice.inverse.as_ref()?.solve(&self.frames[i].compose(&Frame::rotation(self.members.axis, spin)));
        let k = (0..found.count).find(|&k| usize::from(found.branch[k]) == branch && !found.singular[k])?;
        let mut row = vec![0.0; self.robot.n()];
        slice.expand(&found, k, &mut row);
        self.robot.turn_together(&mut row, &slice.held);
        if self.limits && !self.robot.limits().settle(&mut row) {
            return None;
        }
        let mut value = [0.0];
        if let Some(objective) = &self.objective {
            objective.values_of(&self.robot, &row, &mut value);
        }
        is_regular(value[0]).then(|| (row, value[0]))
    }

    /// One point.
    fn point(&self, i: usize, q: &mut [f64], value: &mut [f64], cause: &mut [u8]) {
        let (n, b, a) = (self.robot.n(), self.branches, self.members.turns.len());
        cause.fill(Cause::Unreachable as u8);
        value.fill(f64::NAN);
        let mut feasible = Vec::with_capacity(value.len());
        let continued = self.searched.then(|| self.continued(i));
        for (s, slice) in self.slices.iter().enumerate() {
            for (j, turn) in self.members.turns.iter().enumerate() {
                let found = match &continued {
                    Some(all) => all[s * a + j],
                    None => slice.solve(&self.frames[i].compose(turn)),
                };
                let start = (s * a + j) * b;
                for k in 0..found.count {
                    let slot = if self.has_branches() { usize::from(found.branch[k]) } else { k };
                    let cell = start + slot;
                    let row = &mut q[cell * n..(cell + 1) * n];
                    slice.expand(&found, k, row);
                    self.robot.turn_together(row, &slice.held);
                    if !self.limits || self.robot.limits().settle(row) {
                        // Where a joint may be chosen, the one that was is no neighbour of anything.
                        cause[cell] = if found.singular[k] { Cause::Singular } else { Cause::Feasible } as u8;
                        feasible.extend((!found.singular[k]).then_some(cell));
                    } else {
                        cause[cell] = Cause::JointLimit as u8;
                    }
                }
            }
        }
        if !self.has_branches() {
            self.sort_branches(q, cause, &mut feasible);
        }
        self.evaluate(q, &feasible, value, cause);
    }

    /// The solutions of all cells of a point, by Newton from cell to cell.
    fn continued(&self, i: usize) -> Vec<Solutions> {
        let (a, frame) = (self.members.turns.len(), &self.frames[i]);
        let solve = |cell: usize, starts: &[f64], random: usize| {
            let inverse = self.slices[cell / a].inverse.as_ref();
            inverse.map_or(Solutions::NONE, |inverse| inverse.near(&frame.compose(&self.members.turns[cell % a]), starts, random))
        };
        let angle = |k: usize, j: usize| if k.is_multiple_of(2) { j } else { a - 1 - j };
        let order: Vec<usize> = self.order.iter().enumerate().flat_map(|(k, slice)| (0..a).map(move |j| slice * a + angle(k, j))).collect();
        continued(&order, self.slices[0].moving.len(), &solve)
    }

    /// The objective at the cells that hold a posture.
    fn evaluate(&self, q: &[f64], feasible: &[usize], value: &mut [f64], cause: &mut [u8]) {
        let n = self.robot.n();
        let Some(objective) = &self.objective else {
            feasible.iter().for_each(|&cell| value[cell] = 0.0);
            return;
        };
        let postures: Vec<f64> = feasible.iter().flat_map(|&cell| q[cell * n..(cell + 1) * n].iter().copied()).collect();
        let mut values = vec![f64::NAN; feasible.len()];
        objective.values_of(&self.robot, &postures, &mut values);
        for (&cell, got) in feasible.iter().zip(values) {
            if is_regular(got) {
                value[cell] = got;
            } else {
                cause[cell] = Cause::Singular as u8;
            }
        }
    }

    /// Where solutions come in no order of their own, puts each where the nearest one of the neighbouring angle is.
    fn sort_branches(&self, q: &mut [f64], cause: &mut [u8], feasible: &mut Vec<usize>) {
        let (n, b) = (self.robot.n(), self.branches);
        let none = Cause::Unreachable as u8;
        for sample in 1..self.members.turns.len() * self.slices.len() {
            let (before, now) = ((sample - 1) * b, sample * b);
            let (old, new) = q[before * n..(now + b) * n].split_at_mut(b * n);
            let (rows, causes) = (new.to_vec(), cause[now..now + b].to_vec());
            let mut slots = [None; MAX_SOLUTIONS];
            let mut placed = [false; MAX_SOLUTIONS];
            for _ in 0..b {
                let mut best = (f64::INFINITY, 0, 0);
                for slot in (0..b).filter(|&slot| slots[slot].is_none() && cause[before + slot] != none) {
                    for k in (0..b).filter(|&k| !placed[k] && causes[k] != none) {
                        let apart = distance(&old[slot * n..(slot + 1) * n], &rows[k * n..(k + 1) * n]);
                        if apart < best.0 {
                            best = (apart, slot, k);
                        }
                    }
                }
                if best.0.is_finite() {
                    (slots[best.1], placed[best.2]) = (Some(best.2), true);
                }
            }
            // What has no neighbour goes where there is room.
            for k in (0..b).filter(|&k| causes[k] != none) {
                if !placed[k]
                    && let Some(slot) = (0..b).find(|&slot| slots[slot].is_none())
                {
                    slots[slot] = Some(k);
                }
            }
            for slot in 0..b {
                cause[now + slot] = slots[slot].map_or(none, |k| causes[k]);
                if let Some(k) = slots[slot] {
                    new[slot * n..(slot + 1) * n].copy_from_slice(&rows[k * n..(k + 1) * n]);
                }
            }
        }
        feasible.clear();
        feasible.extend((0..cause.len()).filter(|&cell| cause[cell] == Cause::Feasible as u8));
    }

    /// What keeps point `i` from being feasible, if a limit is what does: the one that the posture least beyond limits is farthest beyond, with how far
    /// [rad or m].
    pub fn nearest_to_limits(&self, i: usize) -> Option<(Limited, f64)> {
        let mut best: Option<(Limited, f64)> = None;
        let mut row = [0.0; MAX_JOINTS];
        for slice in &self.slices {
            for turn in &self.members.turns {
                let found = slice.solve(&self.frames[i].compose(turn));
                for k in 0..found.count {
                    let row = &mut row[..self.robot.n()];
                    slice.expand(&found, k, row);
                    self.robot.turn_together(row, &slice.held);
                    let beyond = farthest_beyond(&self.robot, row);
                    if let Some(beyond) = beyond
                        && best.is_none_or(|(_, least)| beyond.1 < least)
                    {
                        best = Some(beyond);
                    }
                }
            }
        }
        best
    }
}

impl Slice {
    fn new(robot: &Robot, held: Vec<(usize, f64)>, moving: Vec<usize>, task: Task) -> Result<Self> {
        let rest = Arc::new(robot.with_fixed(&held)?);
        let singular = !held.is_empty() && task.rank(&rest) < rest.n();
        let inverse = if singular { None } else { Some(TaskInverse::new(rest, task)?) };
        Ok(Self { held, moving, inverse })
    }

    fn solve(&self, target: &Frame) -> Solutions {
        self.inverse.as_ref().map_or(Solutions::NONE, |inverse| inverse.solve(target))
    }

    /// Solution `k` with the joints that are held.
    #[inline(always)]
    fn expand(&self, found: &Solutions, k: usize, row: &mut [f64]) {
        for &(joint, value) in &self.held {
            row[joint] = value;
        }
        for (joint, x) in self.moving.iter().zip(found.q[k]) {
            row[*joint] = x;
        }
    }
}

/// Of each place of spare joints and each tilt, in every combination, those next to it.
fn together(places: &[Vec<usize>], tilts: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let one = |place: &Vec<usize>, tilt: &Vec<usize>| place.iter().flat_map(|p| tilt.iter().map(move |t| p * tilts.len() + t)).collect();
    places.iter().flat_map(|place| tilts.iter().map(move |tilt| one(place, tilt))).collect()
}

/// Whether a value is none of a singularity, where it is infinite but for rounding.
fn is_regular(value: f64) -> bool {
    value.abs() < INFINITE
}

/// Largest difference of two postures up to whole turns.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y - TAU * ((x - y) / TAU).round()).abs()).fold(0.0, f64::max)
}

/// Which joints turn far enough to come round to the same place: their whole turns are decided for the path as a whole.
pub fn wide_joints(robot: &Robot, limits: bool) -> Vec<bool> {
    let range = |i: usize| robot.limits().q_max[i] - robot.limits().q_min[i];
    (0..robot.n()).map(|i| robot.is_periodic(i) && (!limits || range(i) >= TAU - 2.0 * AT_LIMIT)).collect()
}
