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
/// A constraint is violated when it fails by more than this, relative to the numbers it is made of.
const FEASIBILITY: f64 = 1e-12;
/// A constraint depends on the active ones when what is left of it, squared, is below this part of its whole.
const DEPENDENT: f64 = 1e-24;

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
    // Rounding in x is that of the largest x on the way.
    let mut size = dot(&out.x, &out.x, n).sqrt();
    while let Some(worst) = most_violated(rows, &out.x, size, &active, n) {
        match enforce(&factor, rows, worst, &mut active, &mut out, n) {
            QpStatus::Solved => {
                out.active = active.count;
                size = size.max(dot(&out.x, &out.x, n).sqrt());
            }
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
fn most_violated(rows: &[Row], x: &Vector, size: f64, active: &Active, n: usize) -> Option<usize> {
    let mut worst = None;
    let mut depth = 0.0;
    for (i, row) in rows.iter().enumerate() {
        let length = dot(&row.a, &row.a, n).sqrt();
        let slack = dot(&row.a, x, n) - row.b;
        let tolerance = FEASIBILITY * (length * size + row.b.abs());
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
        let Directions { primal, dual, left, whole } = directions(factor, rows, &normal, active, n);
        let mut full = f64::INFINITY;
        let slack = dot(&normal, &out.x, n) - rows[p].b;
        if left > DEPENDENT * whole && active.count < n {
            full = (-slack / left).max(0.0);
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

/// Where the next constraint pushes.
struct Directions {
    /// Step in x per unit of its multiplier.
    primal: Vector,
    /// Rate at which the active multipliers fall.
    dual: Vector,
    /// Square of the part of its normal that the active ones leave, in the metric of H^-1.
    left: f64,
    /// Square of its normal in that metric.
    whole: f64,
}

/// Takes the components along the first `count` basis vectors out of `vector`, twice, and returns them.
fn project_out(vector: &mut Vector, basis: &[Vector; MAX_VARIABLES], count: usize, n: usize) -> Vector {
    let mut along = [0.0; MAX_VARIABLES];
    for _ in 0..2 {
        for k in 0..count {
            let part = dot(&basis[k], vector, n);
            along[k] += part;
            for i in 0..n {
                vector[i] -= part * basis[k][i];
            }
        }
    }
    along
}

fn directions(factor: &Cholesky<MAX_VARIABLES>, rows: &[Row], normal: &Vector, active: &Active, n: usize) -> Directions {
    let count = active.count;
    let mut basis = [[0.0; MAX_VARIABLES]; MAX_VARIABLES]; // orthonormal, from L^-1 a_j
    let mut r = [[0.0; MAX_VARIABLES]; MAX_VARIABLES]; // column j by row j
    for j in 0..count {
        let mut column = factor.forward(&rows[active.rows[j]].a);
        r[j] = project_out(&mut column, &basis, j, n);
        r[j][j] = dot(&column, &column, n).sqrt();
        basis[j] = column.map(|value| value / r[j][j]);
    }
    let mut rest = factor.forward(normal);
    let whole = dot(&rest, &rest, n);
    let mut dual = project_out(&mut rest, &basis, count, n);
    for j in (0..count).rev() {
        for k in j + 1..count {
            dual[j] -= r[k][j] * dual[k];
        }
        dual[j] /= r[j][j];
    }
    Directions { primal: factor.backward(&rest), dual, left: dot(&rest, &rest, n), whole }
}
