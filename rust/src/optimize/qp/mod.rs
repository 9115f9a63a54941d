//! A small strictly convex quadratic programme by the dual active-set method of Goldfarb and Idnani (1983): exact, bounded, on the stack.
//!
//! See `README.md` beside this file for the method, its cost and what it guarantees.

mod active;
mod factors;
mod problem;
mod search;

pub use active::{ActiveSet, Constraint, Place, Side};
pub use problem::{Problem, Row};

use search::Search;

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
    /// More variables than the capacity, or numbers that are not finite (limits may be infinite, outwards) or overflow on the way.
    Undefined,
}

/// The last iterate and how it ended.
#[derive(Debug, Clone, Copy)]
pub struct Solution<const N: usize> {
    /// How it ended.
    pub status: Status,
    /// Minimiser, if solved: within its bounds exactly, and the rows to rounding.
    pub x: [f64; N],
    /// Constraints that hold with equality and determine x: a start for the next problem.
    pub active: ActiveSet<N>,
    /// Multipliers of the active constraints: `Hx + g = sum of multiplier times normal`, at least zero at a lower limit, at most zero at an upper one.
    ///
    /// If infeasible, with that of `violated` a Farkas certificate: the multipliers' combination of the normals is zero, that of the limits is above
    /// zero.
    pub multipliers: [f64; N],
    /// If infeasible: the constraint that the active ones contradict, and its multiplier.
    pub violated: Option<(Constraint, f64)>,
    /// Constraints added or dropped since the start.
    pub changes: usize,
}

impl<const N: usize> Solution<N> {
    fn unsolved(status: Status) -> Self {
        Self { status, x: [0.0; N], active: ActiveSet::default(), multipliers: [0.0; N], violated: None, changes: 0 }
    }

    /// The multiplier of a constraint; zero when it is not active.
    pub fn multiplier(&self, place: Place) -> f64 {
        self.active.as_slice().iter().zip(&self.multipliers).filter(|(item, _)| item.place == place).map(|(_, value)| value).sum()
    }
}

/// The bound on the changes of a problem of `n` variables and `rows` rows.
pub const fn most_changes(n: usize, rows: usize) -> usize {
    50 + 10 * (n + rows)
}

/// Solves the problem, from the working set `start` (empty or of a similar problem; any set will do).
pub fn solve<const N: usize>(problem: &Problem<'_, N>, start: &ActiveSet<N>) -> Solution<N> {
    if problem.n > N {
        return Solution::unsolved(Status::Undefined);
    }
    for place in problem.places() {
        let (lower, upper) = problem.limits(place);
        if lower > upper {
            return contradiction(place);
        }
        if lower.is_nan() || upper.is_nan() {
            return Solution::unsolved(Status::Undefined);
        }
    }
    if problem.n == N { Search::<N, true>::solve(problem, start) } else { Search::<N, false>::solve(problem, start) }
}

/// Lower and upper limit of one constraint exclude each other.
fn contradiction<const N: usize>(place: Place) -> Solution<N> {
    let mut out = Solution::unsolved(Status::Infeasible);
    if out.active.push(Constraint { place, side: Side::Lower }) {
        out.multipliers[0] = 1.0;
    }
    out.violated = Some((Constraint { place, side: Side::Upper }, -1.0));
    out
}
