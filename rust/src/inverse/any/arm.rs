//! Three joints, prismatic and revolute in any order, that take a point to a place.

use super::roots::{Polynomial, product, real_roots, value};
use crate::inverse::analytic::circle::{magnitude, on_conic, on_line, product as squared};
use crate::inverse::analytic::structure::{Turn, Turned, across, angle_of, point, square, third_row, turn_between, turned, unpoint};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::robot::Joint::{self, Prismatic, Revolute};

/// A point this near to an axis, relative to the size of the arm, is on it.
const ON_AXIS: f64 = 1e-9;
/// Directions this near to parallel, or this near to across, count as such.
const PARALLEL: f64 = 1e-9;

/// `J(q1) l1 J(q2) l2 J(q3) wrist = place`, J the motion of a joint about or along z.
#[derive(Debug, Clone, Copy)]
pub struct Arm {
    pub joints: [Joint; 3],
    pub links: [Frame; 2],
    pub wrist: Vec3,
    pub place: Vec3,
}

/// One solution: coordinates, and a revolute joint that may be chosen (it is 0), if any.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    pub q: [f64; 3],
    pub free: Option<usize>,
}

impl Arm {
    /// Calls `found` for each solution; false where there may be more than it was called for.
    pub fn solve(&self, found: &mut dyn FnMut(Placed)) -> bool {
        match self.joints {
            // Six revolute joints, which are solved elsewhere.
            [Revolute, Revolute, Revolute] => false,
            [Prismatic, Prismatic, Prismatic] => self.three_slides(found),
            [Revolute, Prismatic, Prismatic] => self.turn_and_two_slides(found),
            [Prismatic, Revolute, Prismatic] => self.turn_between_slides(found),
            [Revolute, Revolute, Prismatic] => self.two_turns_and_slide(found),
            [Revolute, Prismatic, Revolute] => self.slide_between_turns(found),
            // The same arm seen from the place.
            [Prismatic, _, Revolute] => self.reversed().solve(&mut |placed| {
                let [a, b, c] = placed.q;
                found(Placed { q: [-c, -b, -a], free: placed.free.map(|joint| 2 - joint) });
            }),
        }
    }

    fn reversed(&self) -> Self {
        let [a, b, c] = self.joints;
        Self { joints: [c, b, a], links: [self.links[1].inverse(), self.links[0].inverse()], wrist: self.place, place: self.wrist }
    }

    /// The length that tells what is small.
    fn size(&self) -> f64 {
        norm(self.links[0].origin) + norm(self.links[1].origin) + norm(self.wrist) + norm(self.place)
    }

    fn is_on_axis(&self, a: Vec3) -> bool {
        across(a) <= (ON_AXIS * self.size()).powi(2)
    }

    /// The turn about z that takes one vector to another; none, and told, where they are on the axis.
    fn turn(&self, from: Vec3, to: Vec3) -> (Turn, bool) {
        let on_axis = self.is_on_axis(from) || self.is_on_axis(to);
        (if on_axis { (1.0, 0.0) } else { turn_between(from, to) }, on_axis)
    }

    /// Where the wrist is in the frame of joint 2 as it moves along joint 3: a point and a direction.
    fn slide(&self) -> (Vec3, Vec3) {
        (point(&self.links[1], self.wrist), self.links[1].axes[2])
    }

    /// Three slides: one linear system.
    fn three_slides(&self, found: &mut dyn FnMut(Placed)) -> bool {
        let [l1, l2] = &self.links;
        let columns = [[0.0, 0.0, 1.0], l1.axes[2], l1.compose(l2).axes[2]];
        match solved(columns, sub(self.place, point(l1, self.slide().0))) {
            Some(q) => {
                found(Placed { q, free: None });
                true
            }
            None => false,
        }
    }

    /// A turn, then two slides: the wrist stays in a plane that turns.
    fn turn_and_two_slides(&self, found: &mut dyn FnMut(Placed)) -> bool {
        let l1 = &self.links[0];
        let (start, last) = self.slide();
        let (start, second, third) = (point(l1, start), l1.axes[2], l1.rotate(last));
        let normal = cross(second, third);
        let square_of_normal = dot(normal, normal);
        if square_of_normal <= PARALLEL * PARALLEL {
            return false;
        }
        let mut finish = |(c, s): Turn, free: Option<usize>| {
            let rest = sub(turned(c, -s, self.place), start);
            let q2 = dot(cross(rest, third), normal) / square_of_normal;
            let q3 = dot(cross(second, rest), normal) / square_of_normal;
            found(Placed { q: [angle_of((c, s)), q2, q3], free });
        };
        // normal . Z(-q1) place = normal . start
        match on_line(&Turned::new(self.place, normal), dot(normal, start), self.size()) {
            Some(points) => {
                points.iter().for_each(|(turn, ..)| finish(turn, None));
                true
            }
            None => {
                finish((1.0, 0.0), Some(0));
                false
            }
        }
    }

    /// A turn between two slides: along the axis of the turn the slides add, across it their ends are as far from it.
    fn turn_between_slides(&self, found: &mut dyn FnMut(Placed)) -> bool {
        let l1 = &self.links[0];
        let (target, first) = (unpoint(l1, self.place), third_row(l1));
        let (start, third) = self.slide();
        // target - q1 first = Z(q2) (start + q3 third)
        let height = target[2] - start[2];
        if first[2].abs().max(third[2].abs()) <= PARALLEL {
            return false;
        }
        // Each slide as a linear function of a parameter, which is one of them.
        let (one, other): ([f64; 2], [f64; 2]) = if first[2].abs() >= third[2].abs() {
            ([height / first[2], -third[2] / first[2]], [0.0, 1.0])
        } else {
            ([0.0, 1.0], [height / third[2], -first[2] / third[2]])
        };
        let left = |k: usize| linear(target[k] - one[0] * first[k], -one[1] * first[k]);
        let right = |k: usize| linear(start[k] + other[0] * third[k], other[1] * third[k]);
        let square = |side: Polynomial| product(&side, &side);
        self.balance([square(left(0)), square(left(1))], &[square(right(0)), square(right(1))], &mut |t| {
            let (q1, q3) = (one[0] + t * one[1], other[0] + t * other[1]);
            let (turn, free) = self.turn(add(start, scale(q3, third)), sub(target, scale(q1, first)));
            found(Placed { q: [q1, angle_of(turn), q3], free: free.then_some(1) });
        })
    }

    /// A slide between two turns: the first turn keeps the height along its axis and the distance from it.
    fn slide_between_turns(&self, found: &mut dyn FnMut(Placed)) -> bool {
        let [l1, l2] = &self.links;
        let [x, y, z] = self.wrist;
        let wheel = [point(l1, point(l2, [0.0, 0.0, z])), l1.rotate(l2.rotate([x, y, 0.0])), l1.rotate(l2.rotate([-y, x, 0.0]))];
        let axis = l1.axes[2];
        let row = |k: usize| [wheel[0][k], wheel[1][k], wheel[2][k]];
        let mut close = |(c, s): Turn, q2: f64| {
            let wrist: Vec3 = std::array::from_fn(|k| wheel[0][k] + c * wheel[1][k] + s * wheel[2][k] + q2 * axis[k]);
            let (turn, free) = self.turn(wrist, self.place);
            found(Placed { q: [angle_of(turn), q2, angle_of((c, s))], free: free.then_some(0) });
        };
        if axis[2].abs() > PARALLEL {
            // The height gives the slide: all is a function of the last turn.
            let slide: [f64; 3] = std::array::from_fn(|i| (f64::from(i == 0) * self.place[2] - row(2)[i]) / axis[2]);
            let side = |k: usize| std::array::from_fn::<f64, 3, _>(|i| row(k)[i] + axis[k] * slide[i]);
            let (xx, yy) = (squared(side(0), side(0)), squared(side(1), side(1)));
            let mut conic: [f64; 6] = std::array::from_fn(|i| xx[i] + yy[i]);
            conic[0] -= across(self.place);
            let largest = magnitude(&[xx, yy]).max(across(self.place));
            let Some(points) = on_conic(&conic, largest) else { return false };
            points.iter().for_each(|((c, s), ..)| close((c, s), slide[0] + c * slide[1] + s * slide[2]));
            return true;
        }
        // The slide keeps the height: the last turn gives it.
        let line = Turned { constant: wheel[0][2], cosine: wheel[1][2], sine: wheel[2][2] };
        let Some(points) = on_line(&line, self.place[2], self.size()) else { return false };
        points.iter().fold(true, |complete, ((c, s), ..)| {
            let side = |k: usize| linear(row(k)[0] + c * row(k)[1] + s * row(k)[2], axis[k]);
            let squares = [product(&side(0), &side(0)), product(&side(1), &side(1))];
            self.balance(squares, &[linear(across(self.place), 0.0)], &mut |q2| close((c, s), q2)) && complete
        })
    }

    /// Two turns, then a slide. With x = Z(q2) (start + q3 third), the height of the place along axis 1 and its squared distance from the foot of
    /// axis 1 do not depend on q1 and are linear in x; what x has across axis 2 is known up to its direction (as in `regional`, a slide for a turn).
    fn two_turns_and_slide(&self, found: &mut dyn FnMut(Placed)) -> bool {
        let l1 = &self.links[0];
        let (start, third) = self.slide();
        let (u, t) = (l1.unrotate(l1.origin), third_row(l1));
        let side = |k: usize| linear(start[k], third[k]);
        let sides = [0, 1, 2].map(|k| product(&side(k), &side(k)));
        let radial: Polynomial = std::array::from_fn(|i| sides[0][i] + sides[1][i]);
        // u . x and t . x without the parts along z.
        let first = |i: usize| f64::from(i == 0);
        let known = 0.5 * (square(self.place) - square(l1.origin));
        let f: Polynomial = std::array::from_fn(|i| known * first(i) - 0.5 * (radial[i] + sides[2][i]) - u[2] * side(2)[i]);
        let g: Polynomial = std::array::from_fn(|i| (self.place[2] - l1.origin[2]) * first(i) - t[2] * side(2)[i]);
        let size = self.size();
        let wrist = |q3: f64| add(start, scale(q3, third));
        let mut close = |q3: f64, x: Vec3| {
            let (second, on_second) = self.turn(wrist(q3), x);
            let seen = point(l1, turned(second.0, second.1, wrist(q3)));
            let (first, on_first) = self.turn(seen, self.place);
            let free = if on_first { Some(0) } else { on_second.then_some(1) };
            found(Placed { q: [angle_of(first), angle_of(second), q3], free });
        };
        let det = u[0] * t[1] - u[1] * t[0];
        if det.abs() > PARALLEL * size {
            let x: Polynomial = std::array::from_fn(|i| (t[1] * f[i] - u[1] * g[i]) / det);
            let y: Polynomial = std::array::from_fn(|i| (u[0] * g[i] - t[0] * f[i]) / det);
            return self.balance([product(&x, &x), product(&y, &y)], &[radial], &mut |q3| close(q3, [value(&x, q3), value(&y, q3), 0.0]));
        }
        // The combination of the two that does not know q2, and the one that does.
        let (size_u, size_t) = (u[0].hypot(u[1]), t[0].hypot(t[1]));
        // In metres, or in square metres.
        let (alone, direction, row, power): (Polynomial, Vec3, Polynomial, i32) = if size_t > PARALLEL && size_t * size >= size_u {
            let share = (u[0] * t[0] + u[1] * t[1]) / (size_t * size_t);
            (std::array::from_fn(|i| f[i] - share * g[i]), t, g, 2)
        } else if size_u > PARALLEL * size {
            let share = (u[0] * t[0] + u[1] * t[1]) / (size_u * size_u);
            (std::array::from_fn(|i| g[i] - share * f[i]), u, f, 1)
        } else {
            return false;
        };
        let mut complete = true;
        let known = self.roots(&alone, size.powi(power), &mut |q3| {
            let at = wrist(q3);
            let line = Turned { constant: 0.0, ..Turned::new([direction[0], direction[1], 0.0], at) };
            match on_line(&line, value(&row, q3), norm(direction) * size) {
                Some(points) => points.iter().for_each(|((c, s), ..)| close(q3, turned(c, s, [at[0], at[1], 0.0]))),
                // The wrist is on axis 2: any q2 will do.
                None => {
                    complete = false;
                    close(q3, [at[0], at[1], 0.0]);
                }
            }
        });
        known && complete
    }

    /// The real roots of a sum of squares less others, as [`Arm::roots`].
    fn balance(&self, plus: [Polynomial; 2], minus: &[Polynomial], each: &mut dyn FnMut(f64)) -> bool {
        let p: Polynomial = std::array::from_fn(|i| plus[0][i] + plus[1][i] - minus.iter().map(|part| part[i]).sum::<f64>());
        let largest = plus.iter().chain(minus).flat_map(|part| self.scaled(part)).fold(0.0f64, |m, x| m.max(x.abs()));
        self.roots(&p, largest.max(self.size().powi(2)), each)
    }

    /// The real roots of a polynomial in a slide; false where all numbers are. `scale` is the size of what it is the sum of.
    fn roots(&self, p: &Polynomial, scale: f64, each: &mut dyn FnMut(f64)) -> bool {
        real_roots(&self.scaled(p), scale, &mut |x| each(self.size() * x))
    }

    /// In the slide over the size of the arm, so that roots are of about 1.
    fn scaled(&self, p: &Polynomial) -> Polynomial {
        std::array::from_fn(|k| p[k] * self.size().powi(k as i32))
    }
}

/// `a + b t`.
fn linear(a: f64, b: f64) -> Polynomial {
    [a, b, 0.0, 0.0, 0.0]
}

/// What three columns have to be multiplied by to make `b`; `None` where they lie in a plane.
pub fn solved([x, y, z]: [Vec3; 3], b: Vec3) -> Option<Vec3> {
    let det = dot(x, cross(y, z));
    let volume = norm(x) * norm(y) * norm(z);
    (det.abs() > PARALLEL * volume).then(|| [dot(b, cross(y, z)) / det, dot(x, cross(b, z)) / det, dot(x, cross(y, b)) / det])
}
