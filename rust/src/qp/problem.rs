//! The problem: limits, normals and how far a point is from satisfying them.

use super::active::{ActiveSet, Constraint, Place, Side};
use super::factors::{add, dot, size};

/// A [`super::Row`] that owns its coefficients, in the capacity of a problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DenseRow<const N: usize> {
    pub a: [f64; N],
    pub lower: f64,
    pub upper: f64,
}

impl<const N: usize> DenseRow<N> {
    /// No limit: what a buffer is filled with.
    pub const OPEN: Self = Self { a: [0.0; N], lower: f64::NEG_INFINITY, upper: f64::INFINITY };
}

/// Minimise `x'Hx/2 + g'x` subject to bounds and rows. Entries beyond `n` are not read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Problem<'a, const N: usize> {
    /// Variables in use, at most N.
    pub n: usize,
    /// Symmetric positive definite; the lower triangle is read.
    pub h: &'a [[f64; N]; N],
    /// Gradient at zero.
    pub g: &'a [f64; N],
    /// Lower bounds, possibly infinite.
    pub lower: &'a [f64; N],
    /// Upper bounds, possibly infinite.
    pub upper: &'a [f64; N],
    /// General constraints.
    pub rows: &'a [DenseRow<N>],
}

/// The yardsticks of a scan. Variables are compared in units of the objective's curvature along them.
pub(super) struct Scales<const N: usize> {
    /// Length of a variable's unit.
    pub unit: [f64; N],
    /// Largest entry of x on the way, in these units: its rounding is that of all entries.
    pub reach: f64,
    /// Part of the numbers it is made of by which a constraint may fail.
    pub tolerance: f64,
}

/// A constraint that fails.
pub(super) struct Violated {
    pub constraint: Constraint,
    /// By how much, relative to the numbers it is made of.
    pub relative: f64,
}

impl<const N: usize> Problem<'_, N> {
    /// All constraints, bounds first.
    pub(super) fn places(&self) -> impl Iterator<Item = Place> {
        (0..self.n).map(Place::Bound).chain((0..self.rows.len()).map(Place::Row))
    }

    /// Whether a constraint is one of this problem.
    pub(super) fn has(&self, place: Place) -> bool {
        match place {
            Place::Bound(i) => i < self.n,
            Place::Row(k) => k < self.rows.len(),
        }
    }

    /// Least and greatest value.
    #[inline(always)]
    pub(super) fn limits(&self, place: Place) -> (f64, f64) {
        match place {
            Place::Bound(i) => (self.lower[i], self.upper[i]),
            Place::Row(k) => (self.rows[k].lower, self.rows[k].upper),
        }
    }

    /// Whether least and greatest value are the same.
    #[inline(always)]
    pub(super) fn is_equality(&self, place: Place) -> bool {
        let (lower, upper) = self.limits(place);
        lower == upper
    }

    /// b of the constraint as `a'x >= b`.
    #[inline(always)]
    pub(super) fn limit(&self, constraint: Constraint) -> f64 {
        let (lower, upper) = self.limits(constraint.place);
        match constraint.side {
            Side::Lower => lower,
            Side::Upper => -upper,
        }
    }

    /// `out += factor * a` of the constraint as `a'x >= b`.
    #[inline(always)]
    pub(super) fn add_normal<const FULL: bool>(&self, constraint: Constraint, factor: f64, out: &mut [f64; N]) {
        let n = size::<N, FULL>(self.n);
        let factor = factor * constraint.side.sign();
        match constraint.place {
            Place::Bound(i) => out[i] += factor,
            Place::Row(k) => add(&mut out[..n], factor, &self.rows[k].a[..n]),
        }
    }

    /// `b - a'x` of the constraint as `a'x >= b`.
    #[inline(always)]
    pub(super) fn violation<const FULL: bool>(&self, constraint: Constraint, x: &[f64; N]) -> f64 {
        let n = size::<N, FULL>(self.n);
        let value = match constraint.place {
            Place::Bound(i) => x[i],
            Place::Row(k) => dot(&self.rows[k].a[..n], &x[..n]),
        };
        self.limit(constraint) - constraint.side.sign() * value
    }

    /// `g + Hx`.
    #[inline(always)]
    pub(super) fn gradient<const FULL: bool>(&self, x: &[f64; N]) -> [f64; N] {
        let mut out = [0.0; N];
        for i in 0..size::<N, FULL>(self.n) {
            out[i] += self.g[i] + dot(&self.h[i][..=i], &x[..=i]);
            add(&mut out[..i], x[i], &self.h[i][..i]);
        }
        out
    }

    /// The constraint outside the set that fails by the longest way; an error where numbers are not finite.
    #[inline(always)]
    pub(super) fn most_violated<const FULL: bool>(
        &self,
        x: &[f64; N],
        scales: &Scales<N>,
        set: &ActiveSet<N>,
    ) -> Result<Option<Violated>, ()> {
        let n = size::<N, FULL>(self.n);
        let (mut worst, mut farthest, mut finite) = (None, 0.0, true);
        let mut consider = |place: Place, value: f64, length: &dyn Fn() -> f64| {
            finite &= value.is_finite();
            let (lower, upper) = self.limits(place);
            let (below, above) = (lower - value, value - upper);
            let (fault, limit, side) = if below >= above { (below, lower, Side::Lower) } else { (above, upper, Side::Upper) };
            if fault <= scales.tolerance * limit.abs() {
                return;
            }
            let length = length();
            let whole = length * scales.reach + limit.abs();
            if fault > scales.tolerance * whole && (worst.is_none() || fault > farthest * length) && !set.contains(place) {
                farthest = fault / length;
                worst = Some(Violated { constraint: Constraint { place, side }, relative: fault / whole });
            }
        };
        for i in 0..n {
            consider(Place::Bound(i), x[i], &|| scales.unit[i]);
        }
        for (k, row) in self.rows.iter().enumerate() {
            let value = dot(&row.a[..n], &x[..n]);
            let length = || (0..n).map(|i| (row.a[i] * scales.unit[i]).powi(2)).sum::<f64>().sqrt();
            consider(Place::Row(k), value, &length);
        }
        if finite { Ok(worst) } else { Err(()) }
    }
}
