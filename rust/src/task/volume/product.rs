//! Products of rotations: the member nearest to an orientation.
//!
//! With half angles, |<Q1(x1) Q2(x2) Q3(x3), q>| = cos(d/2), d the distance, is linear in (cos(x_i/2), sin(x_i/2)) of each factor: one angle is
//! found in closed form, two together too (a bilinear form has one largest value). Of three, the best is either at an end of one range, or where the
//! error vanishes, or where the three axes lie in a plane, which only the middle angle decides: a finite list of pairs, each in closed form.

use std::f64::consts::{FRAC_PI_2, PI};

use super::Factor;
use super::best::Best;
use super::range::{Range, wrap};
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, add, cross, dot, scale, sub};

/// A distance \[rad\] that is rounding.
pub(super) const EXACT: f64 = 1e-14;

/// A distance \[rad\] from which angles found near a singular middle angle are worth another round.
const NEARLY: f64 = 1e-6;

/// Below this, relative to one, the middle angle does not change how the axes of three factors lie.
const PARALLEL: f64 = 1e-12;

/// A distance \[rad\] from which an orientation may be met by four rotations and more.
const NEARBY: f64 = 0.05;

/// Corrections of an orientation that is nearly met.
const POLISH: usize = 4;

/// Rounds over four factors and more.
const ROUNDS: usize = 100;

/// More factors than these are not started in every corner of their ranges.
const FEW: usize = 5;

/// What a round over four factors and more has to gain \[rad\].
const GAIN: f64 = 1e-14;

impl Factor {
    fn turn(&self, angle: f64) -> Quaternion {
        Quaternion::about(self.axis, angle)
    }
}

/// The rotation that angles make.
fn made(factors: &[Factor], angles: &[f64]) -> Quaternion {
    factors.iter().zip(angles).fold(Quaternion::IDENTITY, |q, (factor, &x)| q.product(&factor.turn(x)))
}

/// The angle about an axis that comes nearest, clamped; where both ends are as near, both.
fn single(factor: &Factor, q: &Quaternion, push: &mut dyn FnMut(f64)) {
    let x = 2.0 * dot(q.vector(), factor.axis).atan2(q.0[0]);
    if factor.range.contains(x) {
        push(x);
    } else {
        factor.range.ends().for_each(push);
    }
}

/// Every pair of angles that may be the nearest.
fn pair(first: &Factor, second: &Factor, q: &Quaternion, push: &mut dyn FnMut(f64, f64)) {
    let (a, b, v) = (first.axis, second.axis, q.vector());
    // The bilinear form's entries: q against 1, a, b and a b.
    let (g00, g10, g01) = (q.0[0], dot(a, v), dot(b, v));
    let g11 = dot(cross(a, b), v) - dot(a, b) * q.0[0];
    let (difference, sum) = ((g10 - g01).atan2(g00 + g11), (g10 + g01).atan2(g00 - g11));
    let (x, y) = (wrap(sum + difference), wrap(sum - difference));
    if first.range.contains(x) && second.range.contains(y) {
        push(x, y);
    }
    for x in first.range.ends() {
        single(second, &first.turn(-x).product(q), &mut |y| push(x, y));
    }
    for y in second.range.ends() {
        single(first, &q.product(&second.turn(-y)), &mut |x| push(x, y));
    }
}

/// How the axes of three factors lie as the middle one turns: n1 . R2(x) n3 = height cos(x - phase) + constant.
pub(super) struct Lie {
    height: f64,
    phase: f64,
    constant: f64,
}

impl Lie {
    pub(super) fn of([first, middle, last]: [&Factor; 3]) -> Self {
        let (a, n, b) = (first.axis, middle.axis, last.axis);
        let constant = dot(a, n) * dot(n, b);
        let (cosine, sine) = (dot(a, sub(b, scale(dot(n, b), n))), dot(a, cross(n, b)));
        Self { height: cosine.hypot(sine), phase: sine.atan2(cosine), constant }
    }

    /// Whether the axes stay in a plane.
    pub(super) fn is_flat(&self) -> bool {
        self.height < PARALLEL
    }

    /// Whether the axes come to lie in a plane within a range.
    pub(super) fn is_singular_within(&self, range: &Range) -> bool {
        self.is_flat() || range.contains(self.phase) || range.contains(self.phase + PI)
    }

    /// How fast the three angles turn the tool: n1 . (n2 x R2 n3).
    pub(super) fn density(&self, x: f64) -> f64 {
        (self.height * (x - self.phase).sin()).abs()
    }

    /// The most of that within a range.
    pub(super) fn most_dense(&self, range: &Range) -> f64 {
        let peak = range.contains(self.phase + FRAC_PI_2) || range.contains(self.phase - FRAC_PI_2);
        if peak { self.height } else { self.density(range.low).max(self.density(range.high)) }
    }

    /// The two middle angles of an orientation.
    fn roots(&self, factors: [&Factor; 3], q: &Quaternion) -> [f64; 2] {
        let cosine = dot(factors[0].axis, q.rotate(factors[2].axis)) - self.constant;
        let sine = ((self.height - cosine) * (self.height + cosine)).max(0.0).sqrt();
        let x = sine.atan2(cosine);
        [self.phase + x, self.phase - x]
    }
}

/// Every triple of angles with the given middle one that may be the nearest.
#[inline(never)]
fn with_middle(factors: [&Factor; 3], x: f64, q: &Quaternion, push: &mut dyn FnMut([f64; 3])) {
    let back = factors[1].turn(-x);
    let turned = Factor { axis: back.rotate(factors[0].axis), range: factors[0].range };
    pair(&turned, factors[2], &back.product(q), &mut |a, b| push([a, x, b]));
}

#[inline(never)]
fn with_first(factors: [&Factor; 3], x: f64, q: &Quaternion, push: &mut dyn FnMut([f64; 3])) {
    pair(factors[1], factors[2], &factors[0].turn(-x).product(q), &mut |a, b| push([x, a, b]));
}

#[inline(never)]
fn with_last(factors: [&Factor; 3], x: f64, q: &Quaternion, push: &mut dyn FnMut([f64; 3])) {
    pair(factors[0], factors[1], &q.product(&factors[2].turn(-x)), &mut |a, b| push([a, b, x]));
}

/// The triples of angles that make an orientation, ranges aside; the nearest ones where none does.
pub(super) fn solutions(factors: [&Factor; 3], q: &Quaternion) -> [[f64; 3]; 2] {
    let free = factors.map(|factor| Factor { range: Range::FREE, ..*factor });
    let free = [&free[0], &free[1], &free[2]];
    Lie::of(factors).roots(factors, q).map(|x| {
        let mut out = [0.0, x, 0.0];
        with_middle(free, x, q, &mut |angles| out = angles);
        out
    })
}

/// The other triple of angles of an orientation that has one with the middle angle given.
pub(super) fn other(factors: [&Factor; 3], middle: f64, q: &Quaternion) -> [f64; 3] {
    let free = factors.map(|factor| Factor { range: Range::FREE, ..*factor });
    let x = 2.0 * Lie::of(factors).phase - middle;
    let mut out = [0.0, x, 0.0];
    with_middle([&free[0], &free[1], &free[2]], x, q, &mut |angles| out = angles);
    out
}

/// The pair of angles that comes nearest to an orientation, ranges aside.
pub(super) fn solution_of_pair(first: &Factor, second: &Factor, q: &Quaternion) -> [f64; 2] {
    let [first, second] = [first, second].map(|factor| Factor { range: Range::FREE, ..*factor });
    let mut out = [0.0; 2];
    pair(&first, &second, q, &mut |x, y| out = [x, y]);
    out
}

/// The angles of a triple and how near they come.
struct Tried<'a> {
    factors: [&'a Factor; 3],
    q: &'a Quaternion,
    angles: [f64; 3],
    distance: f64,
    each: &'a mut dyn FnMut(Quaternion),
}

impl Tried<'_> {
    fn push(&mut self, angles: [f64; 3]) {
        let [a, b, c] = self.factors;
        let member = a.turn(angles[0]).product(&b.turn(angles[1])).product(&c.turn(angles[2]));
        let distance = member.angle_to(self.q);
        if distance < self.distance {
            (self.angles, self.distance) = (angles, distance);
        }
        (self.each)(member);
    }

    /// One step of Newton's method towards the orientation, within the ranges.
    fn correct(&mut self) {
        let [a, b, c] = self.factors;
        let [x, y, z] = self.angles;
        let (first, second) = (a.turn(x), a.turn(x).product(&b.turn(y)));
        let axes = [a.axis, first.rotate(b.axis), second.rotate(c.axis)];
        let error = self.q.product(&second.product(&c.turn(z)).conjugate());
        // Small, so twice the vector part.
        let error = scale(2.0f64.copysign(error.0[0]), error.vector());
        let volume = dot(axes[0], cross(axes[1], axes[2]));
        if volume.abs() > PARALLEL {
            let change = |i: usize| dot(error, cross(axes[(i + 1) % 3], axes[(i + 2) % 3])) / volume;
            self.push(std::array::from_fn(|i| self.factors[i].range.clamp(self.angles[i] + change(i))));
        }
    }
}

/// The angles of three factors that come nearest; every member tried is shown.
fn triple(factors: [&Factor; 3], q: &Quaternion, each: &mut dyn FnMut(Quaternion)) -> ([f64; 3], f64) {
    let mut tried = Tried { factors, q, angles: [0.0; 3], distance: f64::INFINITY, each };
    let (lie, middle) = (Lie::of(factors), factors[1].range);
    let [one, two] = lie.roots(factors, q);
    for x in [one, two, lie.phase, lie.phase + PI] {
        if middle.contains(x) {
            with_middle(factors, x, q, &mut |angles| tried.push(angles));
        }
        if tried.distance <= EXACT {
            return (tried.angles, tried.distance);
        }
    }
    middle.ends().for_each(|x| with_middle(factors, x, q, &mut |angles| tried.push(angles)));
    factors[0].range.ends().for_each(|x| with_first(factors, x, q, &mut |angles| tried.push(angles)));
    factors[2].range.ends().for_each(|x| with_last(factors, x, q, &mut |angles| tried.push(angles)));
    // Near a singular middle angle roots and pairs have half of the digits: the error itself, or at it the other two ways of pairing, tell the rest.
    for _ in 0..POLISH {
        if !(EXACT..NEARLY).contains(&tried.distance) {
            break;
        }
        tried.correct();
        let angles = tried.angles;
        with_first(factors, angles[0], q, &mut |angles| tried.push(angles));
        with_last(factors, angles[2], q, &mut |angles| tried.push(angles));
        let middle = tried.angles[1];
        with_middle(factors, middle, q, &mut |angles| tried.push(angles));
    }
    (tried.angles, tried.distance)
}

/// Offers the members of a product that may be the nearest.
#[inline(never)]
pub(super) fn offer(factors: &[Factor], q: &Quaternion, best: &mut Best) {
    match factors {
        [one] => single(one, q, &mut |x| best.offer(one.turn(x))),
        [a, b] => pair(a, b, q, &mut |x, y| best.offer(a.turn(x).product(&b.turn(y)))),
        [a, b, c] => {
            triple([a, b, c], q, &mut |member| best.offer(member));
        }
        _ => many(factors, q, best),
    }
}

/// Offers the members of a pair, times a fixed rotation on the right, that may be the nearest to an orientation times the same.
pub(super) fn offer_times([a, b]: &[Factor; 2], q: &Quaternion, right: &Quaternion, best: &mut Best) {
    pair(a, b, q, &mut |x, y| best.offer(a.turn(x).product(&b.turn(y)).product(right)));
}

/// Offers the members on the bounds of a product of three.
pub(super) fn offer_bounds(factors: [&Factor; 3], q: &Quaternion, best: &mut Best) {
    let mut push = |angles: [f64; 3]| {
        let [a, b, c] = factors;
        best.offer(a.turn(angles[0]).product(&b.turn(angles[1])).product(&c.turn(angles[2])));
    };
    factors[0].range.ends().for_each(|x| with_first(factors, x, q, &mut push));
    factors[1].range.ends().for_each(|x| with_middle(factors, x, q, &mut push));
    factors[2].range.ends().for_each(|x| with_last(factors, x, q, &mut push));
}

/// Steps of Newton's method towards an orientation that is nearly met, the shortest ones, each within the ranges: three at a time slow down there.
fn approach(factors: &[Factor], q: &Quaternion, angles: &mut [f64]) {
    let mut distance = made(factors, angles).angle_to(q);
    for _ in 0..ROUNDS {
        if !(EXACT..NEARBY).contains(&distance) {
            return;
        }
        let mut next = angles.to_vec();
        let mut held = vec![false; angles.len()];
        // What an angle at its end cannot do is left to the others.
        for _ in 0..angles.len() {
            let (axes, reached) = axes_and_end(factors, &next);
            let error = q.product(&reached.conjugate());
            let error = scale(2.0f64.copysign(error.0[0]), error.vector());
            let free = || axes.iter().zip(&held).filter(|(_, held)| !**held).map(|(axis, _)| *axis);
            let Some(force) = solve_symmetric(free(), error) else { break };
            let mut clamped = false;
            for i in 0..next.len() {
                if !held[i] {
                    let wanted = next[i] + dot(axes[i], force);
                    next[i] = factors[i].range.clamp(wanted);
                    held[i] = next[i] != wanted;
                    clamped |= held[i];
                }
            }
            if !clamped {
                break;
            }
        }
        let now = made(factors, &next).angle_to(q);
        if now >= distance {
            return;
        }
        angles.copy_from_slice(&next);
        distance = now;
    }
}

/// The axes of the rotations as those before them turn them, and the orientation that all make.
fn axes_and_end(factors: &[Factor], angles: &[f64]) -> (Vec<Vec3>, Quaternion) {
    let mut reached = Quaternion::IDENTITY;
    let turn = |(factor, x): (&Factor, &f64)| {
        let axis = reached.rotate(factor.axis);
        reached = reached.product(&factor.turn(*x));
        axis
    };
    (factors.iter().zip(angles).map(turn).collect(), reached)
}

/// The f with sum a (a . f) = error over the axes a; `None` if they lie in a plane.
fn solve_symmetric(axes: impl Iterator<Item = Vec3>, error: Vec3) -> Option<Vec3> {
    let mut columns = [[0.0; 3]; 3];
    for a in axes {
        for (column, x) in columns.iter_mut().zip(a) {
            *column = add(*column, scale(x, a));
        }
    }
    let [x, y, z] = columns;
    let volume = dot(x, cross(y, z));
    (volume.abs() > PARALLEL).then(|| [cross(y, z), cross(z, x), cross(x, y)].map(|normal| dot(error, normal) / volume))
}

/// Sets three angles to the best of them with the others as they are; the distance then.
fn best_three(factors: &[Factor], [i, j, l]: [usize; 3], q: &Quaternion, angles: &mut [f64]) -> f64 {
    let part = |from: usize, to: usize| made(&factors[from..to], &angles[from..to]);
    // What is fixed between them goes to the front, and turns the axes that it passes.
    let (second, first) = (part(j + 1, l), part(i + 1, j));
    let between = first.product(&second);
    let a = Factor { axis: between.conjugate().rotate(factors[i].axis), ..factors[i] };
    let b = Factor { axis: second.conjugate().rotate(factors[j].axis), ..factors[j] };
    let front = part(0, i).product(&between);
    let inner = front.conjugate().product(q).product(&part(l + 1, factors.len()).conjugate());
    let (found, distance) = triple([&a, &b, &factors[l]], &inner, &mut |_| {});
    [angles[i], angles[j], angles[l]] = found;
    distance
}

/// Three at a time, each time the best of them, from the middle and from corners of the ranges: every step comes nearer.
fn many(factors: &[Factor], q: &Quaternion, best: &mut Best) {
    let k = factors.len();
    let corners = if k > FEW { 1 } else { 1 << k };
    let mut angles: Vec<f64> = factors.iter().map(|factor| factor.range.middle()).collect();
    for start in 0..=corners {
        if start > 0 {
            let end = |(i, factor): (usize, &Factor)| if (start - 1) >> i & 1 == 1 { factor.range.high } else { factor.range.low };
            angles.iter_mut().zip(factors.iter().enumerate().map(end)).for_each(|(x, end)| *x = end);
        }
        let mut last = f64::INFINITY;
        for _ in 0..ROUNDS {
            let mut now = last;
            for i in 0..k - 2 {
                for j in i + 1..k - 1 {
                    for l in j + 1..k {
                        now = best_three(factors, [i, j, l], q, &mut angles);
                    }
                }
            }
            if now <= EXACT || last - now < GAIN {
                break;
            }
            last = now;
        }
        approach(factors, q, &mut angles);
        best.offer(made(factors, &angles));
        if best.distance() <= EXACT {
            return;
        }
    }
}
