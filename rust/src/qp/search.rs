//! The dual method: from the minimiser on a working set with multipliers of the right sign to that on a better one, until nothing fails.

use super::active::{ActiveSet, Constraint, Side};
use super::factors::{Factors, dot, size};
use super::problem::{Problem, Scales, Violated};
use super::{Minimum, Status, most_changes};

/// A constraint fails when it does so by more than this, relative to the numbers it is made of.
const FEASIBILITY: f64 = 1e-13;
/// The loosest that rounding may make it.
const LOOSEST: f64 = 1e-6;
/// A normal depends on the working set when what is left of it, squared, is below this part of its whole.
const DEPENDENT: f64 = 1e-20;
/// A rate of a multiplier below this part of what the normals' lengths suggest is rounding.
const FLAT: f64 = 1e-13;
/// Rounding of a sum, relative to its parts.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// An iterate: x minimises the objective on the working set, with the multipliers of its constraints as `a'x >= b`.
pub(super) struct Search<'a, const N: usize, const FULL: bool> {
    problem: &'a Problem<'a, N>,
    factors: Factors<N, FULL>,
    scales: Scales<N>,
    x: [f64; N],
    set: ActiveSet<N>,
    multipliers: [f64; N],
    violated: Option<(Constraint, f64)>,
    changes: usize,
}

impl<'a, const N: usize, const FULL: bool> Search<'a, N, FULL> {
    /// The whole method.
    #[inline(never)]
    pub fn solve(problem: &'a Problem<'a, N>, start: &ActiveSet<N>) -> Minimum<N> {
        match Self::new(problem) {
            Ok(search) => search.run(start),
            Err(status) => Minimum::unsolved(status),
        }
    }

    /// With an empty working set.
    #[inline(always)]
    fn new(problem: &'a Problem<'a, N>) -> Result<Self, Status> {
        let Some(factors) = Factors::new(problem.h, size::<N, FULL>(problem.n)) else {
            let defined = problem.h[..problem.n].iter().enumerate().all(|(i, row)| row[..=i].iter().all(|value| value.is_finite()));
            return Err(if defined { Status::NotConvex } else { Status::Undefined });
        };
        let mut unit = [0.0; N];
        for i in 0..size::<N, FULL>(problem.n) {
            unit[i] = 1.0 / problem.h[i][i].sqrt();
        }
        let scales = Scales { unit, reach: 0.0, tolerance: FEASIBILITY };
        Ok(Self { problem, factors, scales, x: [0.0; N], set: ActiveSet::default(), multipliers: [0.0; N], violated: None, changes: 0 })
    }

    #[inline(always)]
    fn n(&self) -> usize {
        size::<N, FULL>(self.problem.n)
    }

    #[inline(always)]
    fn run(mut self, start: &ActiveSet<N>) -> Minimum<N> {
        let status = self.search(start).err().unwrap_or(Status::Solved);
        let mut multipliers = self.multipliers;
        for (value, constraint) in multipliers.iter_mut().zip(self.set.as_slice()) {
            *value *= constraint.side.sign();
        }
        let violated = self.violated.map(|(constraint, value)| (constraint, constraint.side.sign() * value));
        if status == Status::Solved {
            for i in 0..self.n() {
                self.x[i] = self.x[i].clamp(self.problem.lower[i], self.problem.upper[i]);
            }
        }
        Minimum { status, x: self.x, active: self.set, multipliers, violated, changes: self.changes }
    }

    fn search(&mut self, start: &ActiveSet<N>) -> Result<(), Status> {
        self.guess(start);
        self.settle()?;
        // Twice at least: what the first solution of the conditions leaves to rounding, the second refines.
        loop {
            let before = self.changes;
            while let Some(worst) = self.most_violated()? {
                self.enforce(worst.constraint)?;
            }
            self.settle()?;
            if self.changes == before && self.most_violated()?.is_none() {
                return Ok(());
            }
        }
    }

    fn most_violated(&self) -> Result<Option<Violated>, Status> {
        self.problem.most_violated::<FULL>(&self.x, &self.scales, &self.set).map_err(|()| Status::Undefined)
    }

    /// Takes up the equalities, which stay for good, and those of the start, as far as they do not depend on each other.
    fn guess(&mut self, start: &ActiveSet<N>) {
        let problem = self.problem;
        for place in problem.places().filter(|place| problem.is_equality(*place)) {
            self.take(Constraint { place, side: Side::Lower });
        }
        for constraint in start.as_slice() {
            if problem.has(constraint.place) && problem.limit(*constraint).is_finite() && !self.set.contains(constraint.place) {
                self.take(*constraint);
            }
        }
    }

    fn take(&mut self, constraint: Constraint) {
        let (n, count) = (self.n(), self.set.len());
        let d = self.factors.components(&self.whitened(constraint));
        if count < n && dot(&d[count..n], &d[count..n]) > DEPENDENT * dot(&d[..n], &d[..n]) {
            self.factors.append(&d, &self.factors.combined(&d, count));
            self.multipliers[count] = 0.0;
            self.set.push(constraint);
        }
    }

    fn release(&mut self, k: usize) {
        let count = self.set.len();
        self.factors.remove(k);
        self.set.remove(k);
        self.multipliers.copy_within(k + 1..count, k);
    }

    fn whitened(&self, constraint: Constraint) -> [f64; N] {
        let mut a = [0.0; N];
        self.problem.add_normal::<FULL>(constraint, 1.0, &mut a);
        self.factors.whitened(&a)
    }

    fn count_change(&mut self) -> Result<(), Status> {
        self.changes += 1;
        if self.changes > most_changes(self.n(), self.problem.rows.len()) { Err(Status::Iterations) } else { Ok(()) }
    }

    /// Goes to the minimiser on the working set, without the constraints that would rather be left.
    fn settle(&mut self) -> Result<(), Status> {
        loop {
            self.correct()?;
            let mut worst = None;
            let mut least = 0.0;
            for (j, constraint) in self.set.as_slice().iter().enumerate() {
                if self.multipliers[j] < 0.0 && !self.problem.is_equality(constraint.place) {
                    let weighted = self.multipliers[j] * self.factors.length(j);
                    if weighted < least {
                        (worst, least) = (Some(j), weighted);
                    }
                }
            }
            let Some(worst) = worst else { return Ok(()) };
            self.count_change()?;
            self.release(worst);
        }
    }

    /// A step of Newton's method on the conditions of optimality on the working set: from anywhere to their solution, from there a refinement.
    fn correct(&mut self) -> Result<(), Status> {
        let n = self.n();
        let mut residual = self.problem.gradient::<FULL>(&self.x);
        let mut fault = [0.0; N];
        let count = self.set.len();
        for (j, constraint) in self.set.as_slice().iter().enumerate() {
            self.problem.add_normal::<FULL>(*constraint, -self.multipliers[j], &mut residual);
            fault[j] = self.problem.violation::<FULL>(*constraint, &self.x);
        }
        let mut step = self.factors.components(&self.factors.whitened(&residual)).map(|value| -value);
        let inside = self.factors.solve_transposed(&fault);
        let mut excess = [0.0; N];
        for j in 0..count {
            excess[j] = inside[j] - step[j];
            step[j] = inside[j];
        }
        let gain = self.factors.solve(&excess);
        for j in 0..count {
            self.multipliers[j] += gain[j];
        }
        let dx = self.factors.unwhitened(&self.factors.combined(&step, 0));
        self.advance(1.0, &dx);
        if self.x[..n].iter().all(|value| value.is_finite()) { Ok(()) } else { Err(Status::Undefined) }
    }

    #[inline(always)]
    fn advance(&mut self, length: f64, direction: &[f64; N]) {
        for i in 0..self.n() {
            self.x[i] += length * direction[i];
            self.scales.reach = self.scales.reach.max(self.x[i].abs() / self.scales.unit[i]);
        }
    }

    /// Moves until the constraint holds, dropping those whose multipliers would turn negative.
    fn enforce(&mut self, constraint: Constraint) -> Result<(), Status> {
        let n = self.n();
        let w = self.whitened(constraint);
        let mut own = 0.0;
        loop {
            self.count_change()?;
            let count = self.set.len();
            let d = self.factors.components(&w);
            let (left, whole) = (dot(&d[count..n], &d[count..n]), dot(&d[..n], &d[..n]));
            let mut rates = self.factors.solve(&d);
            let independent = count < n && left > DEPENDENT * whole;
            if !independent {
                self.flatten(&mut rates, whole);
                if !self.contradicts(constraint, &rates) {
                    return self.forgive(constraint);
                }
            }
            let full = if independent { (self.problem.violation::<FULL>(constraint, &self.x) / left).max(0.0) } else { f64::INFINITY };
            let (partial, blocking) = self.blocking(&rates);
            let t = full.min(partial);
            if t.is_infinite() {
                self.multipliers = rates.map(|rate| -rate);
                self.violated = Some((constraint, 1.0));
                return Err(Status::Infeasible);
            }
            for j in 0..count {
                let value = self.multipliers[j] - t * rates[j];
                self.multipliers[j] = if self.problem.is_equality(self.set.as_slice()[j].place) { value } else { value.max(0.0) };
            }
            own += t;
            let rest = self.factors.combined(&d, count);
            if independent {
                self.advance(t, &self.factors.unwhitened(&rest));
            }
            if full <= partial {
                self.factors.append(&d, &rest);
                self.multipliers[count] = own;
                self.set.push(constraint);
                return Ok(());
            }
            self.release(blocking);
        }
    }

    /// Rates of multipliers that are rounding do not block and prove nothing.
    fn flatten(&self, rates: &mut [f64; N], whole: f64) {
        for j in 0..self.set.len() {
            if rates[j].abs() * self.factors.length(j) < FLAT * whole.sqrt() {
                rates[j] = 0.0;
            }
        }
    }

    /// The first multiplier to reach zero, and when. Those of equalities may have any sign.
    fn blocking(&self, rates: &[f64; N]) -> (f64, usize) {
        let mut first = (f64::INFINITY, 0);
        for (j, constraint) in self.set.as_slice().iter().enumerate() {
            if rates[j] > 0.0 && self.multipliers[j] < first.0 * rates[j] && !self.problem.is_equality(constraint.place) {
                first = (self.multipliers[j] / rates[j], j);
            }
        }
        first
    }

    /// Whether a constraint whose normal is the working set's times `rates` fails wherever they hold with equality, by the numbers of the problem
    /// alone. What the combination leaves of the normal counts with the largest x on the way.
    fn contradicts(&self, constraint: Constraint, rates: &[f64; N]) -> bool {
        let mut normal = [0.0; N];
        self.problem.add_normal::<FULL>(constraint, 1.0, &mut normal);
        let mut gap = self.problem.limit(constraint);
        let mut parts = gap.abs();
        for (rate, held) in rates.iter().zip(self.set.as_slice()) {
            self.problem.add_normal::<FULL>(*held, -rate, &mut normal);
            let part = rate * self.problem.limit(*held);
            gap -= part;
            parts += part.abs();
        }
        let slip = self.scales.reach * (0..self.n()).map(|i| normal[i].abs() * self.scales.unit[i]).sum::<f64>();
        gap > ROUNDING * parts + slip
    }

    /// Leaves a constraint that fails by rounding alone, and takes what is left of that after settling for the rounding of all constraints: at
    /// least twice what was assumed before, so that this comes to an end.
    fn forgive(&mut self, constraint: Constraint) -> Result<(), Status> {
        self.settle()?;
        let left = self.most_violated()?.filter(|worst| worst.constraint.place == constraint.place).map_or(0.0, |worst| worst.relative);
        self.scales.tolerance = 2.0 * self.scales.tolerance.max(left);
        if self.scales.tolerance > LOOSEST { Err(Status::Iterations) } else { Ok(()) }
    }
}
