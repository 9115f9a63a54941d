//! A small strictly convex quadratic programme by the dual active-set method of Goldfarb and Idnani (1983): exact, bounded, on the stack.
//!
//! `README.md` beside this file tells the method, its cost and what it guarantees. Programmes of this room are those of a control tick: a few
//! variables in arrays on the stack, nothing allocated. Problems of a design, whose size is not bounded, are in [`crate::optimize`].
//!
//! ```
//! use redundancy::qp::{self, Programme, Row, Status};
//!
//! // The point nearest to (2, 1) with x + y <= 1, and y = 0 at the most.
//! let rows = [Row { a: &[1.0, 1.0], lower: f64::NEG_INFINITY, upper: 1.0 }];
//! let (open, most) = ([f64::NEG_INFINITY; 2], [f64::INFINITY, 0.0]);
//! let programme = Programme { h: &[1.0, 0.0, 0.0, 1.0], g: &[-2.0, -1.0], lower: &open, upper: &most, rows: &rows };
//! let found = qp::solve(&programme, &[])?;
//! assert_eq!(found.status, Status::Solved);
//! assert_eq!(found.x, [1.0, 0.0]);
//! // The answer's constraints are a start for a programme that differs a little.
//! assert_eq!(qp::solve(&programme, &found.active)?.changes, 0);
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod active;
mod factors;
mod problem;
mod search;

pub(crate) use active::ActiveSet;
pub use active::{Constraint, Place, Side};
pub(crate) use problem::{DenseRow, Problem};

use crate::error::{Error, Result};
use search::Search;

/// Variables of a programme at most.
pub const MAX_VARIABLES: usize = 20;

/// `lower <= a'x <= upper`, an equality when both are the same; infinite limits do not count.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Coefficients, one a variable.
    pub a: &'a [f64],
    /// Least value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
}

/// Minimise `x'Hx/2 + g'x` subject to bounds and rows.
#[derive(Debug, Clone, Copy)]
pub struct Programme<'a> {
    /// H by rows, n x n, symmetric and positive definite; the lower triangle is read.
    pub h: &'a [f64],
    /// Gradient at zero, n numbers.
    pub g: &'a [f64],
    /// Lower bounds, possibly infinite.
    pub lower: &'a [f64],
    /// Upper bounds, possibly infinite.
    pub upper: &'a [f64],
    /// General constraints.
    pub rows: &'a [Row<'a>],
}

impl Programme<'_> {
    fn check(&self) -> Result<()> {
        let n = self.g.len();
        if n > MAX_VARIABLES {
            return Err(Error::value("g", format!("{n} variables"), &format!("at most {MAX_VARIABLES}")));
        }
        let sizes = [("h", self.h.len(), n * n), ("lower", self.lower.len(), n), ("upper", self.upper.len(), n)];
        let wrong = sizes.into_iter().chain(self.rows.iter().map(|row| ("a", row.a.len(), n))).find(|(_, got, expected)| got != expected);
        wrong.map_or(Ok(()), |(name, got, expected)| Err(Error::length(name, got, expected)))
    }
}

/// How a problem ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The unique minimiser.
    Solved,
    /// No point satisfies the constraints; the multipliers prove it.
    Infeasible,
    /// H is not positive definite.
    NotConvex,
    /// No answer within [`most_changes`].
    Iterations,
    /// Numbers that are not finite (limits may be infinite, outwards) or overflow on the way.
    Undefined,
}

impl Status {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::Infeasible => "infeasible",
            Self::NotConvex => "not convex",
            Self::Iterations => "iterations",
            Self::Undefined => "undefined",
        }
    }
}

/// The last iterate and how it ended.
#[derive(Debug, Clone)]
pub struct Solution {
    /// How it ended.
    pub status: Status,
    /// Minimiser, if solved: within its bounds exactly, and the rows to rounding.
    pub x: Vec<f64>,
    /// Constraints that hold with equality and determine x: a start for the next problem.
    pub active: Vec<Constraint>,
    /// Multipliers of the active constraints: `Hx + g = sum of multiplier times normal`, at least zero at a lower limit, at most zero at an upper one.
    ///
    /// If infeasible, with that of `violated` a Farkas certificate: the multipliers' combination of the normals is zero, that of the limits is above
    /// zero.
    pub multipliers: Vec<f64>,
    /// If infeasible: the constraint that the active ones contradict, and its multiplier.
    pub violated: Option<(Constraint, f64)>,
    /// Constraints added or dropped since the start.
    pub changes: usize,
}

impl Solution {
    /// The multiplier of a constraint; zero when it is not active.
    pub fn multiplier(&self, place: Place) -> f64 {
        self.active.iter().zip(&self.multipliers).filter(|(item, _)| item.place == place).map(|(_, value)| value).sum()
    }
}

/// The bound on the changes of a problem of `n` variables and `rows` rows.
pub const fn most_changes(n: usize, rows: usize) -> usize {
    50 + 10 * (n + rows)
}

/// In the room for the most variables there are.
#[inline(never)]
fn wide(values: &[f64]) -> [f64; MAX_VARIABLES] {
    let mut out = [0.0; MAX_VARIABLES];
    out[..values.len()].copy_from_slice(values);
    out
}

/// Solves a programme of at most [`MAX_VARIABLES`] variables, from the working set `start`: empty or of a similar programme, any set will do.
///
/// An error tells of arrays that do not fit together; how the search ended is the solution's status.
pub fn solve(programme: &Programme<'_>, start: &[Constraint]) -> Result<Solution> {
    programme.check()?;
    let n = programme.g.len();
    let mut h = [[0.0; MAX_VARIABLES]; MAX_VARIABLES];
    for (i, row) in h.iter_mut().enumerate().take(n) {
        *row = wide(&programme.h[i * n..(i + 1) * n]);
    }
    let rows: Vec<_> = programme.rows.iter().map(|row| DenseRow { a: wide(row.a), lower: row.lower, upper: row.upper }).collect();
    let (g, lower, upper) = (wide(programme.g), wide(programme.lower), wide(programme.upper));
    let mut active = ActiveSet::default();
    for constraint in start {
        active.push(*constraint);
    }
    let found = minimise(&Problem { n, h: &h, g: &g, lower: &lower, upper: &upper, rows: &rows }, &active);
    Ok(Solution {
        status: found.status,
        x: found.x[..n].to_vec(),
        multipliers: found.multipliers[..found.active.len()].to_vec(),
        active: found.active.as_slice().to_vec(),
        violated: found.violated,
        changes: found.changes,
    })
}

/// A [`Solution`] of capacity `N`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Minimum<const N: usize> {
    pub status: Status,
    pub x: [f64; N],
    pub active: ActiveSet<N>,
    pub multipliers: [f64; N],
    pub violated: Option<(Constraint, f64)>,
    pub changes: usize,
}

impl<const N: usize> Minimum<N> {
    fn unsolved(status: Status) -> Self {
        Self { status, x: [0.0; N], active: ActiveSet::default(), multipliers: [0.0; N], violated: None, changes: 0 }
    }
}

/// Whether the search is compiled for problems as large as the capacity alone, so that its loops unroll: for six variables, where the capacity of six is that of
/// six joints exactly.
struct Unrolled<const N: usize>;

impl<const N: usize> Unrolled<N> {
    const YES: bool = N == 6;
}

/// Solves a problem whose capacity is known; the problem has no more variables than that, and in the capacity of six exactly as many.
pub(crate) fn minimise<const N: usize>(problem: &Problem<'_, N>, start: &ActiveSet<N>) -> Minimum<N> {
    for place in problem.places() {
        let (lower, upper) = problem.limits(place);
        if lower > upper {
            return contradiction(place);
        }
        if lower.is_nan() || upper.is_nan() {
            return Minimum::unsolved(Status::Undefined);
        }
    }
    match (Unrolled::<N>::YES, problem.n == N) {
        (true, true) => Search::<N, true>::solve(problem, start),
        (true, false) => Minimum::unsolved(Status::Undefined),
        (false, _) => Search::<N, false>::solve(problem, start),
    }
}

/// Lower and upper limit of one constraint exclude each other.
#[cold]
fn contradiction<const N: usize>(place: Place) -> Minimum<N> {
    let mut out = Minimum::unsolved(Status::Infeasible);
    if out.active.push(Constraint { place, side: Side::Lower }) {
        out.multipliers[0] = 1.0;
    }
    out.violated = Some((Constraint { place, side: Side::Upper }, -1.0));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs under bounds and a row; seven variables in any capacity.
    fn seven<const N: usize>(seed: u64) -> [f64; 7] {
        let number = |i: usize| ((seed * 31 + i as u64 * 17) as f64 * 0.618_034).fract() - 0.5;
        let (mut h, mut g, mut a) = ([[0.0; N]; N], [0.0; N], [0.0; N]);
        for i in 0..7 {
            (h[i][i], g[i], a[i]) = (2.0 + number(i), 3.0 * number(i + 7), number(i + 14));
            if i > 0 {
                (h[i][i - 1], h[i - 1][i]) = (-0.4, -0.4);
            }
        }
        let rows = [DenseRow { a, lower: 0.1, upper: 0.2 }];
        let found = minimise(&Problem { n: 7, h: &h, g: &g, lower: &[-0.3; N], upper: &[0.3; N], rows: &rows }, &ActiveSet::default());
        assert_eq!(found.status, Status::Solved);
        std::array::from_fn(|i| found.x[i])
    }

    #[test]
    fn the_capacity_is_no_part_of_the_answer() {
        for seed in 0..50 {
            let eight = seven::<8>(seed);
            for other in [seven::<7>(seed), seven::<16>(seed), seven::<20>(seed)] {
                assert!((0..7).all(|i| (eight[i] - other[i]).abs() < 1e-12), "{seed}: {eight:?} {other:?}");
            }
        }
    }
}
