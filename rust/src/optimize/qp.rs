//! A small strictly convex quadratic programme by the dual active-set method (Goldfarb and Idnani 1983): exact, bounded, on the stack.
//!
//! minimise `g'x + x'Hx/2` subject to `a_i' x >= b_i`. It starts from the free minimiser and adds violated constraints one by one, so that an
//! infeasible problem is recognised as such.

use crate::linalg::MAX_JOINTS;
use crate::linalg::cholesky::Cholesky;

/// Variables at most.
pub const MAX_VARIABLES: usize = MAX_JOINTS;
/// Constraints at most.
pub const MAX_ROWS: usize = 4 * MAX_JOINTS;
/// Constraints added or dropped before giving up; a non-degenerate problem of this size needs far fewer.
const MAX_CHANGES: usize = 200;
/// A constraint is violated when it fails by more than this, relative to its own size.
const FEASIBILITY: f64 = 1e-12;

type Vector = [f64; MAX_VARIABLES];

/// `a' x >= b`.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Coefficients.
    pub a: Vector,
    /// Bound.
    pub b: f64,
}

/// How a programme ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QpStatus {
    /// The unique minimiser.
    Solved,
    /// No point satisfies the constraints.
    Infeasible,
    /// H is not positive definite.
    NotConvex,
    /// Out of iterations.
    Iterations,
}

/// The last iterate and how it ended.
#[derive(Debug, Clone, Copy)]
pub struct QpSolution {
    /// Minimiser, if solved.
    pub x: Vector,
    /// How it ended.
    pub status: QpStatus,
    /// Constraints added or dropped.
    pub changes: usize,
    /// Constraints active at the end.
    pub active: usize,
}

struct Active {
    rows: [usize; MAX_VARIABLES],
    multipliers: Vector,
    count: usize,
}

fn dot(a: &Vector, b: &Vector, n: usize) -> f64 {
    (0..n).map(|i| a[i] * b[i]).sum()
}

/// Solves the programme in `n` variables.
pub fn solve(h: &[Vector; MAX_VARIABLES], g: &Vector, rows: &[Row], n: usize) -> QpSolution {
    let mut out = QpSolution { x: [0.0; MAX_VARIABLES], status: QpStatus::NotConvex, changes: 0, active: 0 };
    let Some(factor) = Cholesky::new(h, n) else { return out };
    out.x = factor.solve(g).map(|value| -value);
    let mut active = Active { rows: [0; MAX_VARIABLES], multipliers: [0.0; MAX_VARIABLES], count: 0 };
    while let Some(worst) = most_violated(rows, &out.x, &active, n) {
        match enforce(&factor, rows, worst, &mut active, &mut out, n) {
            QpStatus::Solved => out.active = active.count,
            status => {
                out.status = status;
                return out;
            }
        }
    }
    out.status = QpStatus::Solved;
    out
}

/// The constraint that fails by most, relative to its length.
fn most_violated(rows: &[Row], x: &Vector, active: &Active, n: usize) -> Option<usize> {
    let mut worst = None;
    let mut depth = 0.0;
    for (i, row) in rows.iter().enumerate() {
        let length = dot(&row.a, &row.a, n).sqrt();
        let slack = dot(&row.a, x, n) - row.b;
        let tolerance = FEASIBILITY * (length + row.b.abs());
        if slack < -tolerance && slack / length.max(f64::MIN_POSITIVE) < depth && !active.rows[..active.count].contains(&i) {
            depth = slack / length.max(f64::MIN_POSITIVE);
            worst = Some(i);
        }
    }
    worst
}

/// Moves until constraint `p` holds, dropping constraints whose multipliers would turn negative.
fn enforce(factor: &Cholesky<MAX_VARIABLES>, rows: &[Row], p: usize, active: &mut Active, out: &mut QpSolution, n: usize) -> QpStatus {
    let normal = rows[p].a;
    let mut own = 0.0;
    loop {
        out.changes += 1;
        if out.changes > MAX_CHANGES {
            return QpStatus::Iterations;
        }
        let (primal, dual) = directions(factor, rows, &normal, active, n);
        let mut full = f64::INFINITY;
        let curvature = dot(&primal, &normal, n);
        let slack = dot(&normal, &out.x, n) - rows[p].b;
        if curvature > 1e-14 * dot(&normal, &normal, n) && active.count < n {
            full = -slack / curvature;
        }
        let (mut partial, mut blocking) = (f64::INFINITY, 0);
        for j in 0..active.count {
            if dual[j] > 0.0 && active.multipliers[j] / dual[j] < partial {
                (partial, blocking) = (active.multipliers[j] / dual[j], j);
            }
        }
        let t = full.min(partial);
        if t.is_infinite() {
            return QpStatus::Infeasible;
        }
        for j in 0..active.count {
            active.multipliers[j] = (active.multipliers[j] - t * dual[j]).max(0.0);
        }
        own += t;
        if full.is_finite() {
            for i in 0..n {
                out.x[i] += t * primal[i];
            }
        }
        if full <= partial {
            active.rows[active.count] = p;
            active.multipliers[active.count] = own;
            active.count += 1;
            return QpStatus::Solved;
        }
        active.count -= 1;
        for j in blocking..active.count {
            active.rows[j] = active.rows[j + 1];
            active.multipliers[j] = active.multipliers[j + 1];
        }
    }
}

/// The step in x, and the rate at which the active multipliers fall, per unit of the new constraint's multiplier.
fn directions(factor: &Cholesky<MAX_VARIABLES>, rows: &[Row], normal: &Vector, active: &Active, n: usize) -> (Vector, Vector) {
    let count = active.count;
    let mut basis = [[0.0; MAX_VARIABLES]; MAX_VARIABLES]; // orthonormal, from L^-1 a_j
    let mut r = [[0.0; MAX_VARIABLES]; MAX_VARIABLES];
    for j in 0..count {
        let mut column = factor.forward(&rows[active.rows[j]].a);
        for k in 0..j {
            r[k][j] = dot(&basis[k], &column, n);
            for i in 0..n {
                column[i] -= r[k][j] * basis[k][i];
            }
        }
        r[j][j] = dot(&column, &column, n).sqrt();
        basis[j] = column.map(|value| value / r[j][j]);
    }
    let mut rest = factor.forward(normal);
    let mut dual = [0.0; MAX_VARIABLES];
    for k in 0..count {
        dual[k] = dot(&basis[k], &rest, n);
        for i in 0..n {
            rest[i] -= dual[k] * basis[k][i];
        }
    }
    for j in (0..count).rev() {
        for k in j + 1..count {
            dual[j] -= r[j][k] * dual[k];
        }
        dual[j] /= r[j][j];
    }
    (factor.backward(&rest), dual)
}
