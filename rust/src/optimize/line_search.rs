//! A line search for the strong Wolfe conditions by cubic interpolation (Leger 2014, 3.2.2; Nocedal and Wright 1999, alg. 3.5 and 3.6).

use nalgebra::DVector;

use super::Smooth;

/// Ends of a bracket this near to each other, relative, are one.
const SAME: f64 = 1e-14;
/// Sufficient decrease (3.56).
const C1: f64 = 1e-4;
/// Curvature (3.57), in print without its last d_k.
const C2: f64 = 0.9;
/// Trials of one search.
const MAX_TRIALS: usize = 30;

/// A point along the line.
#[derive(Debug, Clone)]
pub struct LineSearch {
    /// Step length.
    pub alpha: f64,
    /// Where.
    pub x: DVector<f64>,
    /// Value there.
    pub value: f64,
    /// Gradient there.
    pub gradient: DVector<f64>,
    /// Evaluations spent.
    pub evaluations: usize,
}

#[derive(Clone, Copy)]
struct Point {
    alpha: f64,
    value: f64,
    slope: f64,
}

/// Minimiser of the cubic through two points and their slopes; the middle when the cubic has none well inside.
fn cubic(a: Point, b: Point) -> f64 {
    let width = b.alpha - a.alpha;
    let d1 = a.slope + b.slope - 3.0 * (a.value - b.value) / (a.alpha - b.alpha);
    let d2 = (d1 * d1 - a.slope * b.slope).sqrt().copysign(width);
    let t = b.alpha - width * (b.slope + d2 - d1) / (b.slope - a.slope + 2.0 * d2);
    let (low, high) = (a.alpha.min(b.alpha), a.alpha.max(b.alpha));
    let margin = 0.1 * (high - low);
    if t.is_finite() && t >= low + margin && t <= high - margin { t } else { 0.5 * (low + high) }
}

/// Searches along `direction` from `x`, where value and gradient are known; `None` if no decrease was found.
pub fn strong_wolfe(
    f: &mut impl Smooth,
    x: &DVector<f64>,
    value: f64,
    gradient: &DVector<f64>,
    direction: &DVector<f64>,
    first: f64,
) -> (Option<LineSearch>, usize) {
    let start = Point { alpha: 0.0, value, slope: gradient.dot(direction) };
    let (mut low, mut high): (Point, Option<Point>) = (start, None);
    let mut best: Option<LineSearch> = None;
    let mut alpha = first;
    for trial in 1..=MAX_TRIALS {
        let at = x + direction * alpha;
        let (value, gradient) = f.gradient(&at);
        let now = Point { alpha, value, slope: gradient.dot(direction) };
        let decreased = value.is_finite() && value <= start.value + C1 * alpha * start.slope;
        let here = LineSearch { alpha, x: at, value, gradient, evaluations: trial };
        if decreased && now.slope.abs() <= -C2 * start.slope {
            return (Some(here), trial);
        }
        if decreased && best.as_ref().is_none_or(|b| value < b.value) {
            best = Some(here);
        }
        if !decreased || value >= low.value {
            high = Some(now);
        } else {
            if now.slope * (high.map_or(f64::INFINITY, |h| h.alpha) - low.alpha) >= 0.0 {
                high = Some(low);
            }
            low = now;
        }
        alpha = match high {
            Some(high) if high.value.is_finite() && high.slope.is_finite() => cubic(low, high),
            Some(high) => 0.5 * (low.alpha + high.alpha),
            None => 2.0 * alpha,
        };
        if high.is_some_and(|h| (h.alpha - low.alpha).abs() <= SAME * alpha.abs()) {
            return (best, trial);
        }
    }
    (best, MAX_TRIALS)
}
