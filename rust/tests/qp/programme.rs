//! A programme that owns its numbers: how random ones are made, and what answers are judged by.

use crate::common::{OwnRow, Rng, views};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT, ZeroConeT};
use nalgebra::{DMatrix, DVector};
use redundancy::qp::{self, Constraint, Place, Side, Solution};

/// Capacity in most of these tests.
pub const N: usize = 20;
pub type Vector = [f64; N];

/// A problem that owns its numbers.
#[derive(Debug, Clone)]
pub struct Programme {
    pub n: usize,
    pub h: [Vector; N],
    pub g: Vector,
    pub lower: Vector,
    pub upper: Vector,
    pub rows: Vec<OwnRow<N>>,
}

/// How a random programme is made.
#[derive(Debug, Clone, Copy)]
pub struct Recipe {
    pub n: usize,
    pub rows: usize,
    /// Decades of the curvatures, of the units of variables and of the rows.
    pub curvature: f64,
    pub units: f64,
    /// Rows that are equalities, that touch the inner point, that repeat or combine earlier ones: parts.
    pub equal: f64,
    pub tight: f64,
    pub repeated: f64,
    pub bounded: f64,
}

pub fn sum(terms: impl Iterator<Item = f64>) -> f64 {
    terms.sum()
}

impl Programme {
    pub fn solve(&self) -> Solution {
        self.solve_from(&[])
    }

    pub fn solve_from(&self, start: &[Constraint]) -> Solution {
        let n = self.n;
        let h: Vec<f64> = self.h[..n].iter().flat_map(|row| &row[..n]).copied().collect();
        let rows = views(&self.rows, n);
        let (g, lower, upper) = (&self.g[..n], &self.lower[..n], &self.upper[..n]);
        qp::solve(&qp::Programme { h: &h, g, lower, upper, rows: &rows }, start).unwrap()
    }

    /// x'Hx/2 + g'x with a random H and no constraint.
    pub fn free(rng: &mut Rng, n: usize, decades: f64) -> Self {
        let graded: Vec<f64> = (0..n).map(|_| 10f64.powf(0.5 * decades * rng.within(-0.5, 0.5))).collect();
        let b = DMatrix::from_fn(n, n, |_, _| rng.within(-1.0, 1.0)).qr().q() * DMatrix::from_diagonal(&DVector::from_vec(graded));
        let full = &b * b.transpose();
        let mut out = Self { n, h: [[f64::NAN; N]; N], g: [f64::NAN; N], lower: [f64::NAN; N], upper: [f64::NAN; N], rows: Vec::new() };
        for i in 0..n {
            for j in 0..n {
                out.h[i][j] = full[(i.max(j), i.min(j))];
            }
            out.g[i] = rng.within(-2.0, 2.0);
            (out.lower[i], out.upper[i]) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        out
    }

    pub fn normal(&self, rng: &mut Rng) -> Vector {
        let mut a = [f64::NAN; N];
        let sparse = rng.below(3) == 0;
        for x in &mut a[..self.n] {
            *x = if sparse && rng.below(3) > 0 { 0.0 } else { rng.within(-1.0, 1.0) };
        }
        a
    }

    /// With a point that satisfies everything.
    pub fn feasible(rng: &mut Rng, recipe: &Recipe) -> (Self, Vector) {
        let n = recipe.n;
        let mut out = Self::free(rng, n, recipe.curvature);
        let mut inside = [0.0; N];
        inside[..n].iter_mut().for_each(|x| *x = if rng.below(4) == 0 { 0.0 } else { rng.within(-1.0, 1.0) });
        let room = |rng: &mut Rng| if rng.within(0.0, 1.0) < recipe.tight { 0.0 } else { rng.within(0.0, 1.0) };
        let limits = |rng: &mut Rng, value: f64| {
            let (mut low, mut high) = (value - room(rng), value + room(rng));
            if rng.within(0.0, 1.0) < recipe.equal {
                (low, high) = (value, value);
            }
            match rng.below(3) {
                0 if low < high => (f64::NEG_INFINITY, high),
                1 if low < high => (low, f64::INFINITY),
                _ => (low, high),
            }
        };
        for i in 0..n {
            if rng.within(0.0, 1.0) < recipe.bounded {
                (out.lower[i], out.upper[i]) = limits(rng, inside[i]);
            }
        }
        for k in 0..recipe.rows {
            let mut a = out.normal(rng);
            if k > 0 && rng.within(0.0, 1.0) < recipe.repeated {
                let (one, two) = (out.rows[rng.below(k)].a, out.rows[rng.below(k)].a);
                let (p, q) = match rng.below(4) {
                    0 => (1.0, 0.0),
                    1 => (-1.0, 0.0),
                    2 => (rng.within(-3.0, 3.0), 0.0),
                    _ => (rng.within(-2.0, 2.0), rng.within(-2.0, 2.0)),
                };
                for i in 0..n {
                    a[i] = p * one[i] + q * two[i];
                }
            }
            let (lower, upper) = limits(rng, sum((0..n).map(|i| a[i] * inside[i])));
            out.rows.push(OwnRow { a, lower, upper });
        }
        out.scale(rng, recipe.units, &mut inside);
        (out, inside)
    }

    /// Other units: of the variables, of the objective and of the rows.
    pub fn scale(&mut self, rng: &mut Rng, decades: f64, inside: &mut Vector) {
        if decades == 0.0 {
            return;
        }
        let n = self.n;
        let unit: Vec<f64> = (0..n).map(|_| (2f64).powi(rng.within(-decades, decades) as i32 * 3)).collect();
        let objective = 10f64.powf(rng.within(-decades, decades));
        for i in 0..n {
            for j in 0..n {
                self.h[i][j] *= unit[i] * unit[j] * objective;
            }
            self.g[i] *= unit[i] * objective;
            self.lower[i] /= unit[i];
            self.upper[i] /= unit[i];
            inside[i] /= unit[i];
        }
        for row in &mut self.rows {
            let factor = 2f64.powi(rng.within(-decades, decades) as i32 * 3);
            for i in 0..n {
                row.a[i] *= unit[i] * factor;
            }
            row.lower *= factor;
            row.upper *= factor;
        }
    }

    pub fn value(&self, x: &[f64]) -> f64 {
        sum((0..self.n).map(|i| x[i] * (self.g[i] + 0.5 * sum((0..self.n).map(|j| self.h[i][j] * x[j])))))
    }

    /// The largest entry of x in units of the objective's curvature, in the units of each variable.
    pub fn reach(&self, x: &[f64]) -> Vector {
        let unit = |i: usize| self.h[i][i].sqrt();
        let size = (0..self.n).map(|i| x[i].abs() * unit(i)).fold(0.0, f64::max).max(sum((0..self.n).map(|i| self.g[i].abs() / unit(i))));
        std::array::from_fn(|i| if i < self.n { size / unit(i) } else { 0.0 })
    }

    pub fn dense(&self, place: Place) -> (Vector, f64, f64) {
        match place {
            Place::Bound(i) => {
                let mut a = [0.0; N];
                a[i] = 1.0;
                (a, self.lower[i], self.upper[i])
            }
            Place::Row(k) => (self.rows[k].a, self.rows[k].lower, self.rows[k].upper),
        }
    }

    pub fn places(&self) -> Vec<Place> {
        (0..self.n).map(Place::Bound).chain((0..self.rows.len()).map(Place::Row)).collect()
    }

    /// Worst relative residual of feasibility, stationarity (each component by its own terms, or the scale of the column), sign and complementarity.
    pub fn residual(&self, solution: &Solution) -> Result<f64, String> {
        let (n, x) = (self.n, &solution.x);
        let mut worst = 0.0f64;
        let reach = self.reach(x);
        let mut gradient = [0.0; N];
        let mut size = [0.0; N];
        for i in 0..n {
            gradient[i] = self.g[i] + sum((0..n).map(|j| self.h[i][j] * x[j]));
            size[i] = self.g[i].abs() + sum((0..n).map(|j| (self.h[i][j] * x[j]).abs()));
        }
        for place in self.places() {
            let (a, lower, upper) = self.dense(place);
            let value = sum((0..n).map(|i| a[i] * x[i]));
            let whole = sum((0..n).map(|i| (a[i] * reach[i]).abs()));
            for (fault, limit) in [(lower - value, lower), (value - upper, upper)] {
                if fault > 0.0 {
                    worst = worst.max(fault / (whole + limit.abs()));
                }
            }
            if let Place::Bound(i) = place
                && !(lower <= x[i] && x[i] <= upper)
            {
                return Err(format!("bound {i} fails: {lower:e} {:e} {upper:e}", x[i]));
            }
            let multiplier = solution.multiplier(place);
            for i in 0..n {
                gradient[i] -= multiplier * a[i];
                size[i] += (multiplier * a[i]).abs();
            }
            let active = if multiplier > 0.0 { lower } else { upper };
            if multiplier != 0.0 && (value - active).abs() > 1e-11 * (whole + active.abs()) {
                return Err(format!("{place:?} has multiplier {multiplier:e} at {value:e} in [{lower:e}, {upper:e}]"));
            }
        }
        for i in 0..n {
            // Gradients are comparable in units of the diagonal.
            let unit = sum((0..n).map(|j| size[j] / self.h[j][j].sqrt())) * self.h[i][i].sqrt();
            worst = worst.max(gradient[i].abs() / unit.max(f64::MIN_POSITIVE));
        }
        Ok(worst)
    }

    /// Whether the certificate proves that no point of the size of `reach` satisfies the constraints.
    pub fn proves_infeasible(&self, solution: &Solution, reach: &Vector) -> Result<(), String> {
        let n = self.n;
        let Some((violated, last)) = solution.violated else { return Err("no violated constraint".into()) };
        let mut all: Vec<(Constraint, f64)> = solution.active.iter().copied().zip(solution.multipliers.iter().copied()).collect();
        all.push((violated, last));
        let (mut normal, mut gap, mut parts) = ([0.0; N], 0.0, 0.0);
        for (constraint, multiplier) in all {
            let (a, lower, upper) = self.dense(constraint.place);
            if multiplier == 0.0 {
                continue;
            }
            let limit = if multiplier > 0.0 { lower } else { upper };
            for i in 0..n {
                normal[i] += multiplier * a[i];
            }
            gap += multiplier * limit;
            parts += (multiplier * limit).abs();
        }
        let slip = sum((0..n).map(|i| normal[i].abs() * reach[i].abs()));
        if gap > slip && gap > 1e-15 * parts { Ok(()) } else { Err(format!("gap {gap:e}, slip {slip:e}, parts {parts:e}")) }
    }

    /// Clarabel's status and minimiser, in units in which it does well.
    pub fn clarabel(&self) -> (SolverStatus, Vector) {
        let n = self.n;
        let unit: Vec<f64> = (0..n).map(|i| 1.0 / self.h[i][i].sqrt()).collect();
        let scale = (0..n).map(|i| (self.g[i] * unit[i]).abs()).fold(0.0, f64::max);
        let (mut zero, mut rest): (Vec<(Vec<f64>, f64)>, Vec<_>) = (Vec::new(), Vec::new());
        for place in self.places() {
            let (a, lower, upper) = self.dense(place);
            let length = sum((0..n).map(|i| (a[i] * unit[i]).powi(2))).sqrt();
            let size = if length > 0.0 { length * scale } else { 1.0 };
            let a: Vec<f64> = (0..n).map(|i| a[i] * unit[i] * scale / size).collect();
            let (lower, upper) = (lower / size, upper / size);
            if lower == upper {
                zero.push((a, lower));
                continue;
            }
            if lower.is_finite() {
                rest.push((a.iter().map(|x| -x).collect(), -lower));
            }
            if upper.is_finite() {
                rest.push((a, upper));
            }
        }
        let cones: Vec<SupportedConeT<f64>> = vec![ZeroConeT(zero.len()), NonnegativeConeT(rest.len())];
        let all: Vec<(Vec<f64>, f64)> = zero.into_iter().chain(rest).collect();
        let table: Vec<Vec<f64>> = all.iter().map(|row| row.0.clone()).collect();
        let a = if all.is_empty() { CscMatrix::zeros((0, n)) } else { CscMatrix::from(&table) };
        let b: Vec<f64> = all.iter().map(|row| row.1).collect();
        let triangle: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| if j >= i { self.h[i][j] * unit[i] * unit[j] } else { 0.0 }).collect()).collect();
        let g: Vec<f64> = (0..n).map(|i| self.g[i] * unit[i] / scale).collect();
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .tol_gap_abs(1e-13)
            .tol_gap_rel(1e-13)
            .tol_feas(1e-12)
            .tol_infeas_abs(1e-10)
            .tol_infeas_rel(1e-10)
            .max_iter(200)
            .build()
            .unwrap();
        let mut solver = DefaultSolver::new(&CscMatrix::from(&triangle), &g, &a, &b, &cones, settings).unwrap();
        solver.solve();
        let mut x = [0.0; N];
        for i in 0..n {
            x[i] = solver.solution.x[i] * unit[i] * scale;
        }
        (solver.solution.status, x)
    }
}

pub fn garbage(rng: &mut Rng, programme: &Programme) -> Vec<Constraint> {
    let mut out = Vec::new();
    for _ in 0..rng.below(N + 3) {
        let place = if rng.below(2) == 0 { Place::Bound(rng.below(N + 2)) } else { Place::Row(rng.below(programme.rows.len() + 2)) };
        out.push(Constraint { place, side: if rng.below(2) == 0 { Side::Lower } else { Side::Upper } });
    }
    out
}

/// Distance of two points in units of the objective's curvature, relative to their size.
pub fn apart(programme: &Programme, a: &[f64], b: &[f64]) -> f64 {
    let unit = |i: usize| programme.h[i][i].sqrt();
    let reach = programme.reach(a);
    let size = reach[0] * unit(0);
    (0..programme.n).map(|i| (a[i] - b[i]).abs() * unit(i)).fold(0.0, f64::max) / size
}

pub fn recipe(rng: &mut Rng) -> Recipe {
    let mut part = || if rng.below(2) == 0 { 0.0 } else { rng.within(0.0, 1.0) };
    let (tight, repeated, equal, bounded) = (part(), part(), 0.3 * part(), part());
    Recipe {
        n: 2 + rng.below(N - 1),
        rows: rng.below(41),
        curvature: if rng.below(2) == 0 { 1.0 } else { rng.within(0.0, 6.0) },
        units: if rng.below(3) == 0 { rng.within(0.0, 8.0) } else { 0.0 },
        equal,
        tight,
        repeated,
        bounded,
    }
}

/// x'x/2 and no constraint.
pub fn simple(n: usize) -> Programme {
    let mut out =
        Programme { n, h: [[0.0; N]; N], g: [0.0; N], lower: [f64::NEG_INFINITY; N], upper: [f64::INFINITY; N], rows: Vec::new() };
    for i in 0..n {
        out.h[i][i] = 1.0;
    }
    out
}

pub fn row(entries: &[(usize, f64)], lower: f64, upper: f64) -> OwnRow<N> {
    let mut a = [0.0; N];
    for (i, value) in entries {
        a[*i] = *value;
    }
    OwnRow { a, lower, upper }
}
