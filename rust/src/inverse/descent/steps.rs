//! Algorithms 2 to 5: what all joints would do at the present posture, and which of it is done (From and Gravdahl 2007, sections 5.4 to 5.7).

use super::state::{Problem, State};
use crate::linalg::MAX_JOINTS;

/// Part of the decrease along the slope that a step of the line search has to bring (Armijo).
const SUFFICIENT: f64 = 0.25;
/// Halvings of a step before the search is given up: what is left is below rounding.
const HALVINGS: usize = 60;
/// Changes up to this, beside 1 and the joint, are what rounding leaves of a move. Of a joint on its limit the decrease over such a change is the slope there, as if it had a
/// way to go.
const LEFTOVER: f64 = 8.0 * f64::EPSILON;

/// A number for each joint.
pub(super) type Joints = [f64; MAX_JOINTS];

/// How the estimate of the gradient becomes a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Armijo's search along it: a descent.
    Search,
    /// As printed, `q - min|x| W G`: the units do not match, and it stalls as soon as one joint is at its minimum. No descent.
    Printed(Joints),
    /// The same with `G / max|G|`. No descent.
    Normalised(Joints),
}

/// What each joint alone would do.
struct Alone {
    /// Its best change, as far as it is downhill all the way.
    x: Joints,
    /// The estimate of the gradient, (47): minus the decrease over the change, 0 where there is none.
    g: Joints,
}

impl Problem<'_> {
    /// Algorithms 2 and 3: the joint with the largest decrease, or decrease over change if `by_rate`, moves by its share of the way to its minimum. The
    /// posture and the joint; none where none lowers the cost.
    #[inline(never)]
    pub fn largest(&self, state: &State, by_rate: bool, share: &Joints) -> Option<(Joints, usize)> {
        let n = self.robot.n();
        let (mut chosen, mut most) = (None, 0.0);
        for i in 0..n {
            let (form, (low, high)) = (self.form(state, i), self.room(&state.q[..n], i));
            // A part of the way has to be downhill, the whole of it may cross a maximum.
            let x = if share[i] < 1.0 { form.downhill(low, high) } else { form.best(low, high) };
            if is_leftover(x, state.q[i]) {
                continue;
            }
            let decrease = form.decrease(x);
            let gain = if by_rate { decrease / x.abs() } else { decrease };
            if gain > most {
                (chosen, most) = (Some((i, share[i] * x)), gain);
            }
        }
        let (i, x) = chosen?;
        let mut q = state.q;
        q[i] = self.moved(q[i], i, x);
        Some((q, i))
    }

    /// Algorithm 4: every joint by its share of the way to its minimum, `q + step W x` (45). No descent.
    #[inline(never)]
    pub fn together(&self, state: &State, weights: &Joints, step: f64) -> Joints {
        let alone = self.alone(state);
        self.stepped(&state.q, &std::array::from_fn(|i| step * weights[i] * alone.x[i]))
    }

    /// Algorithm 5: along the estimate of the gradient; none where the search finds no decrease.
    #[inline(never)]
    pub fn along_estimate(&self, state: &State, rule: &Rule) -> Option<State> {
        let n = self.robot.n();
        let alone = self.alone(state);
        let largest = |v: &Joints| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let shortest = alone.x[..n].iter().fold(f64::INFINITY, |m, x| m.min(x.abs()));
        let steepest = largest(&alone.g);
        if steepest == 0.0 {
            return None;
        }
        let (weights, length) = match rule {
            Rule::Search => return self.search(state, &alone, largest(&alone.x) / steepest),
            Rule::Printed(weights) => (weights, shortest),
            Rule::Normalised(weights) => (weights, shortest / steepest),
        };
        let q = self.stepped(&state.q, &std::array::from_fn(|i| -length * weights[i] * alone.g[i]));
        Some(self.at(&q[..n]))
    }

    fn search(&self, state: &State, alone: &Alone, longest: f64) -> Option<State> {
        let n = self.robot.n();
        let slope: Joints = std::array::from_fn(|i| if i < n { self.form(state, i).slope() } else { 0.0 });
        let mut t = longest;
        for _ in 0..HALVINGS {
            let q = self.stepped(&state.q, &std::array::from_fn(|i| -t * alone.g[i]));
            let there = self.at(&q[..n]);
            let along: f64 = (0..n).map(|i| (state.q[i] - q[i]) * slope[i]).sum();
            if there.cost <= state.cost - SUFFICIENT * along {
                return Some(there);
            }
            t *= 0.5;
        }
        None
    }

    fn alone(&self, state: &State) -> Alone {
        let n = self.robot.n();
        let mut alone = Alone { x: [0.0; MAX_JOINTS], g: [0.0; MAX_JOINTS] };
        for i in 0..n {
            let (form, (low, high)) = (self.form(state, i), self.room(&state.q[..n], i));
            let x = form.downhill(low, high);
            if !is_leftover(x, state.q[i]) {
                (alone.x[i], alone.g[i]) = (x, -form.decrease(x) / x);
            }
        }
        alone
    }

    /// A posture after a step, each joint within its own limits; shortened where a limit on several joints would be crossed.
    fn stepped(&self, q: &Joints, step: &Joints) -> Joints {
        let n = self.robot.n();
        let mut to = *q;
        (0..n).for_each(|i| to[i] = self.moved(q[i], i, step[i]));
        let mut part = 1.0f64;
        for it in self.limits.iter().flat_map(|limits| &limits.coupled) {
            let (change, (below, above)) = (it.value(&to[..n]) - it.value(&q[..n]), it.room(&q[..n]));
            let room = if change > 0.0 { above } else { below };
            if change.abs() > room.abs() {
                part = part.min(room / change);
            }
        }
        if part < 1.0 {
            (0..n).for_each(|i| to[i] = q[i] + part * (to[i] - q[i]));
        }
        to
    }

    /// The largest slope of the cost along a joint that may move down it.
    pub fn steepest(&self, state: &State) -> f64 {
        let n = self.robot.n();
        let free = |i: usize| {
            let (slope, (low, high)) = (self.form(state, i).slope(), self.room(&state.q[..n], i));
            let room = if slope > 0.0 { -low } else { high };
            if room > 0.0 { slope.abs() } else { 0.0 }
        };
        (0..n).map(free).fold(0.0, f64::max)
    }
}

/// Whether a change of a joint is no more than rounding.
#[inline]
fn is_leftover(x: f64, q: f64) -> bool {
    x.abs() <= LEFTOVER * (1.0 + q.abs())
}
