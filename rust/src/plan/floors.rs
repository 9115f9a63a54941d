//! What no way along a path can do better than: the least bottleneck over ways that are connected, on the grid of a tool's spins.
//!
//! At some points of the path (layers) every branch is a line of spins, cut by the grid's samples into intervals. A way is in some interval at every
//! layer, and is there no better than the interval's least value; from one interval to the next it passes a sample, whose value is known. The least
//! bottleneck over all such ways (a minimax path, Dijkstra 1959, here by a sweep from layer to layer) is a bound that sees walls and ridges between valleys,
//! which the least value of every point alone does not. It is sharpened where it is decided: an interval by its own minimum, a ridge by a layer more.

use std::collections::BTreeMap;

/// Part of what a value changes by from sample to sample that it may still change by at the edge of what is open.
const EDGE: f64 = 1.5;
/// Part of a value that an interval may be lower than what its samples tell, before it is looked at.
const BLUNT: f64 = 1e-3;
/// Part of a value that a ridge may be lower by between two layers, beside half of what it changes by.
const BETWEEN: f64 = 0.02;

/// One line of samples and intervals for every branch, at a layer.
#[derive(Debug, Clone)]
pub(super) struct Line {
    /// Values at the samples, infinite where they are closed; sample by sample, branches together.
    pub value: Vec<f64>,
    /// Least values of the intervals, each from a sample to the next.
    pub least: Vec<f64>,
    /// Whether the least value is the interval's own minimum.
    pub sharp: Vec<bool>,
}

/// Where the least bottleneck is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// In an interval (point, interval), which holds at or above its least value.
    Interval(usize, usize),
    /// On the ridge passed between two layers.
    Ridge(usize, usize),
}

/// The least bottleneck and one way that has it.
#[derive(Debug, Clone)]
pub(super) struct Bottleneck {
    /// Its value.
    pub value: f64,
    /// Where it is.
    pub place: Place,
    /// Interval of the way at every layer.
    pub way: Vec<(usize, usize)>,
}

/// The lines of all layers that are known.
#[derive(Debug, Clone)]
pub(super) struct Floors {
    angles: usize,
    branches: usize,
    around: bool,
    /// Samples by which a way may jump from each point to the next.
    leap: Vec<usize>,
    lines: BTreeMap<usize, Line>,
}

/// What a sweep knows of a layer.
#[derive(Clone)]
struct Reached {
    cost: Vec<f64>,
    place: Vec<Place>,
    from: Vec<usize>,
}

impl Floors {
    /// None yet.
    pub fn new(angles: usize, branches: usize, around: bool, leap: Vec<usize>) -> Self {
        Self { angles, branches, around, leap, lines: BTreeMap::new() }
    }

    /// Whether a layer is there.
    pub fn has(&self, point: usize) -> bool {
        self.lines.contains_key(&point)
    }

    /// Adds a layer by the values at its samples.
    pub fn add(&mut self, point: usize, value: Vec<f64>) {
        let least: Vec<f64> = (0..value.len()).map(|i| self.first_least(&value, i)).collect();
        let sharp = least.iter().map(|least| least.is_infinite()).collect();
        self.lines.insert(point, Line { value, least, sharp });
    }

    /// The line of a layer.
    pub fn line_mut(&mut self, point: usize) -> Option<&mut Line> {
        self.lines.get_mut(&point)
    }

    /// Whether an interval's least value is its own minimum.
    pub fn is_sharp(&self, point: usize, interval: usize) -> bool {
        self.lines.get(&point).is_none_or(|line| line.sharp[interval])
    }

    /// The least value of an interval.
    pub fn least(&self, point: usize, interval: usize) -> f64 {
        self.lines.get(&point).map_or(f64::INFINITY, |line| line.least[interval])
    }

    /// The sample `by` further on the same branch.
    fn beside(&self, sample: usize, by: isize) -> Option<usize> {
        let (angle, branch) = (sample / self.branches, sample % self.branches);
        let (at, angles) = (angle as isize + by, self.angles as isize);
        let at = if self.around { at.rem_euclid(angles) } else { at };
        (0..angles).contains(&at).then(|| at as usize * self.branches + branch)
    }

    /// A first guess of the least value of an interval: where both sides fall into it, where their tangents meet.
    fn first_least(&self, value: &[f64], interval: usize) -> f64 {
        let at = |by: isize| self.beside(interval, by).map_or(f64::INFINITY, |sample| value[sample]);
        if self.beside(interval, 1).is_none() {
            return f64::INFINITY;
        }
        let least = least_between([at(-1), at(0), at(1), at(2)]);
        if least.is_finite() { least - BLUNT * least.abs() } else { least }
    }

    /// The least bottleneck; `None` where there is no way at all, or no layer.
    pub fn bottleneck(&self) -> Option<Bottleneck> {
        let mut layers = self.lines.iter();
        let (first, line) = layers.next()?;
        let own = |point: usize, line: &Line| (0..line.least.len()).map(|i| Place::Interval(point, i)).collect::<Vec<_>>();
        let mut reached = vec![Reached { cost: line.least.clone(), place: own(*first, line), from: Vec::new() }];
        let mut before = (*first, line);
        for (point, line) in layers {
            let mut next = self.spread(&reached[reached.len() - 1], before, (*point, line));
            for i in 0..line.least.len() {
                if line.least[i] >= next.cost[i] {
                    (next.cost[i], next.place[i]) = (line.least[i], Place::Interval(*point, i));
                }
            }
            reached.push(next);
            before = (*point, line);
        }
        let end = &reached[reached.len() - 1];
        let best = (0..end.cost.len()).min_by(|&a, &b| end.cost[a].total_cmp(&end.cost[b]))?;
        if !end.cost[best].is_finite() {
            return None;
        }
        let mut way = vec![0; reached.len()];
        let mut at = best;
        for (layer, known) in reached.iter().enumerate().rev() {
            way[layer] = at;
            at = known.from.get(at).copied().unwrap_or(at);
        }
        let way = self.lines.keys().copied().zip(way).collect();
        Some(Bottleneck { value: end.cost[best], place: end.place[best], way })
    }

    /// What the ways of a layer cost in every interval of the next, before its own values count: they may pass samples on the way.
    fn spread(&self, known: &Reached, before: (usize, &Line), after: (usize, &Line)) -> Reached {
        let mut out = Reached { from: (0..known.cost.len()).collect(), ..known.clone() };
        let passed: Vec<f64> = (0..known.cost.len()).map(|sample| self.pass(before, after, sample)).collect();
        let ridge = Place::Ridge(before.0, after.0);
        // Twice round, either way.
        for up in [true, false] {
            for step in 0..2 * self.angles {
                let angle = if up { step % self.angles } else { self.angles - 1 - step % self.angles };
                for branch in 0..self.branches {
                    let from = angle * self.branches + branch;
                    let Some(to) = self.beside(from, if up { 1 } else { -1 }) else { continue };
                    let sample = if up { to } else { from };
                    let cost = out.cost[from].max(passed[sample]);
                    if cost < out.cost[to] {
                        let place = if passed[sample] > out.cost[from] { ridge } else { out.place[from] };
                        (out.cost[to], out.place[to], out.from[to]) = (cost, place, out.from[from]);
                    }
                }
            }
        }
        out
    }

    /// What it costs at least to pass a sample between two layers.
    fn pass(&self, before: (usize, &Line), after: (usize, &Line), sample: usize) -> f64 {
        let leap = self.leap[before.0..after.0].iter().fold(0, |most, leap| most.max(*leap));
        let reach = leap.div_ceil(2) as isize;
        let least = |line: &Line| {
            let near = (-reach..=reach).filter_map(|by| self.beside(sample, by));
            near.map(|sample| line.value[sample]).fold(f64::INFINITY, f64::min)
        };
        let (a, b) = (least(before.1), least(after.1));
        let lower = a.min(b);
        if after.0 == before.0 + 1 || !lower.is_finite() {
            return lower;
        }
        let change = if a.max(b).is_finite() { 0.5 * (a - b).abs() } else { 0.0 };
        lower - change - BETWEEN * lower.abs()
    }
}

/// The least value between the second and the third of four samples in a row: where both sides fall into it, where their tangents meet; as much
/// lower at the edge of what is open as it may fall there.
pub(super) fn least_between(v: [f64; 4]) -> f64 {
    let [before, a, b, after] = v;
    match (a.is_finite(), b.is_finite()) {
        (false, false) => f64::INFINITY,
        (true, false) => beyond(before, a),
        (false, true) => beyond(after, b),
        (true, true) => {
            let fall = |outer: f64, inner: f64, other: f64| if outer.is_finite() { outer - inner } else { (other - inner).abs() };
            let (left, right) = (fall(before, a, b), fall(after, b, a));
            let inside = left > 0.0 && right > 0.0;
            if !inside {
                return a.min(b);
            }
            let t = ((a - b + right) / (left + right)).clamp(0.0, 1.0);
            (a - left * t).min(a).min(b)
        }
    }
}

/// The least value from the last open sample to the edge of what is open.
fn beyond(before: f64, last: f64) -> f64 {
    if before.is_finite() { last - EDGE * (before - last).max(0.0) } else { last - 0.5 * last.abs() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A smooth landscape over points and spins, of two branches, with a wall where it exceeds a height.
    fn value(seed: f64, point: f64, spin: f64, branch: f64) -> f64 {
        let wave = (spin + 0.13 * point * seed).sin() + 0.6 * (2.0 * spin - 0.21 * point + seed + branch).cos();
        let value = 2.0 + wave + 0.3 * (0.4 * point + 3.0 * seed + branch).sin();
        if value > 3.2 { f64::INFINITY } else { value }
    }

    /// The least bottleneck over a fine grid of spins: from a sample to the next at one point, or to the next point at one sample.
    fn fine(seed: f64, points: usize, samples: usize, branch: f64) -> f64 {
        let row =
            |point: usize| (0..samples).map(|i| value(seed, point as f64, TAU * i as f64 / samples as f64, branch)).collect::<Vec<_>>();
        let settle = |row: &[f64], cost: &mut [f64]| {
            for step in 0..4 * samples {
                let (i, j) = if step < 2 * samples {
                    (step % samples, (step + 1) % samples)
                } else {
                    let k = samples - 1 - step % samples;
                    (k, (k + samples - 1) % samples)
                };
                cost[j] = cost[j].min(cost[i].max(row[j]));
            }
        };
        let mut cost = row(0);
        for point in 1..points {
            let next = row(point);
            settle(&row(point - 1), &mut cost);
            cost.iter_mut().zip(&next).for_each(|(cost, value)| *cost = cost.max(*value));
            settle(&next, &mut cost);
        }
        cost.into_iter().fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_bottleneck_is_below_that_of_a_fine_grid_and_near_it() {
        let (points, angles) = (9, 48);
        let mut far = 0.0f64;
        for k in 0..60 {
            let seed = 0.37 * k as f64;
            let mut floors = Floors::new(angles, 2, true, vec![0; points - 1]);
            for point in 0..points {
                let sample = |i: usize| value(seed, point as f64, TAU * (i / 2) as f64 / angles as f64, (i % 2) as f64);
                floors.add(point, (0..2 * angles).map(sample).collect());
            }
            let least = fine(seed, points, 480, 0.0).min(fine(seed, points, 480, 1.0));
            match floors.bottleneck() {
                Some(found) => {
                    assert!(found.value <= least + 1e-9, "{} above {least}", found.value);
                    assert_eq!(found.way.len(), points);
                    far = far.max((least - found.value) / least);
                }
                None => assert!(least.is_infinite()),
            }
        }
        assert!(far < 0.05, "{far}");
    }

    #[test]
    fn a_minimum_between_samples_is_no_higher_than_told() {
        for k in 0..200 {
            let place = 0.005 * k as f64;
            let v = [-1.0, 0.0, 1.0, 2.0].map(|x: f64| 1.0 + (x - place).powi(2));
            assert!(least_between(v) <= 1.0 + 1e-12);
            assert!(least_between(v) > 0.2);
        }
        assert_eq!(least_between([f64::INFINITY; 4]), f64::INFINITY);
        assert_eq!(least_between([3.0, 2.0, 1.0, 0.5]), 1.0);
    }
}
