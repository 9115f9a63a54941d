//! The cells of points at which something is held.

use super::{Cause, Cells, Lattice, Slice, distance};
use crate::error::Result;
use crate::linalg::frame::Frame;
use crate::linalg::vector::Vec3;
use crate::plan::frames::tools;
use crate::plan::hooks::{Hooks, PlanError};
use crate::plan::members::Members;

impl Lattice {
    /// The cells of a point at one spin beside the grid, in place of those at the spin next to it; without what the caller refuses.
    pub(in crate::plan) fn cells_at_spin(
        &self,
        point: usize,
        spin: f64,
        axis: Vec3,
        hooks: &mut Hooks,
    ) -> std::result::Result<Cells, PlanError> {
        let members = Members::spins(axis, &[spin], false);
        let (a, b, angle) = (self.members.turns.len(), self.branches, self.members.nearest(&members.turns[0]).1);
        let alone = Self { members, ..self.clone() };
        let found = alone.allowed_cells(&[point], hooks)?.swap_remove(0);
        let place = |cell: usize| (cell / b * a + angle) * b + cell % b;
        let mut cause = vec![Cause::Unreachable as u8; self.cells()];
        found.cause.iter().enumerate().for_each(|(cell, why)| cause[place(cell)] = *why);
        Ok(Cells { cause, open: found.open.iter().map(|cell| place(*cell as usize) as u32).collect(), ..found })
    }

    /// The cells of a point with one posture alone, in the cell that it is nearest to.
    ///
    /// # Errors
    /// As [`Robot::with_fixed`].
    pub(in crate::plan) fn cells_at_posture(&self, point: usize, q: &[f64], value: f64) -> Result<Cells> {
        let tool = tools(&self.robot, q)[0];
        let turn = Frame { axes: tool.axes.map(|axis| self.frames[point].unrotate(axis)), origin: [0.0; 3] };
        let apart = |slice: &Slice| slice.held.iter().map(|&(joint, x)| (x - q[joint]).powi(2)).sum::<f64>();
        let nearest = (0..self.slices.len()).min_by(|&i, &j| apart(&self.slices[i]).total_cmp(&apart(&self.slices[j]))).unwrap_or(0);
        let (tilt, angle) = self.members.nearest(&turn);
        let sample = nearest * self.members.turns.len() + tilt * self.angles() + angle;
        let cell = (sample * self.branches + self.branch_of(nearest, &tool, q)?) as u32;
        let mut cause = vec![Cause::Unreachable as u8; self.cells()];
        let open = value.is_finite();
        cause[cell as usize] = if open { Cause::Feasible } else { Cause::Singular } as u8;
        Ok(if open { Cells { cause, open: vec![cell], q: q.to_vec(), value: vec![value] } } else { Cells { cause, ..Cells::default() } })
    }

    /// The branch of a posture: that of the nearest one with the same tool and the same joints to spare.
    fn branch_of(&self, slice: usize, tool: &Frame, q: &[f64]) -> Result<usize> {
        if !self.has_branches() {
            return Ok(0);
        }
        let held = self.slices[slice].held.iter().map(|&(joint, _)| (joint, q[joint])).collect();
        let slice = Slice::new(&self.robot, held, self.slices[slice].moving.clone(), self.task)?;
        let (found, mut row) = (slice.solve(tool), vec![0.0; q.len()]);
        let apart = (0..found.count).map(|k| {
            slice.expand(&found, k, &mut row);
            (k, distance(&row, q))
        });
        Ok(apart.reduce(|a, b| if b.1 < a.1 { b } else { a }).map_or(0, |(k, _)| usize::from(found.branch[k])))
    }
}
