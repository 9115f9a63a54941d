//! The tool kept inside a volume in a tick whose rates are given.
//!
//! In the usual case a few bounds cut into the free motion and nothing else is in the way: the least change that leaves the position as it is has a closed form,
//! and Newton's method with exact second derivatives, which tells by itself when it is there, makes the bounds hold. Where limits are in the way, or the position has to give way, a programme finds the rates.

use std::cmp::Ordering;

use super::bounds::{coupled_rows, speed_bounds};
use super::coupled::Kept;
use super::inside::{Inside, PathFrame, ROUNDS, SHORT, Step, TELLING, turn};
use crate::inverse::least_squares;
use crate::kinematics::sized::{Jacobian, jacobian_apart};
use crate::linalg::frame::Frame;
use crate::linalg::orthogonal::{self, Orthogonal};
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale};
use crate::linalg::{MAX_JOINTS, Rows6, size};
use crate::qp::DenseRow;
use crate::robot::{MAX_COMBINATIONS, Robot};
use crate::task::Task;
use crate::task::volume::{MAX_SIDES, OrientationVolume, Side, Sides};

/// Squared size of the position's Jacobian over the damping: the position comes first, to as many digits as the programme has left.
const POSITION_FIRST: f64 = 1e8;
/// Part of the motion of the tool point that may be missing where the position counts as kept.
const KEPT: f64 = 1e-4;
/// Rows of the position.
const POINT: usize = 3;
/// Least ratio of the orthogonal rows of position and bounds with which the closed form is as good as the programme.
const INDEPENDENT: f64 = 1e-2;
/// Newton steps from where rates lead, at most.
const CORRECTIONS: usize = 4;
/// Solutions of one step with the second derivatives of the one before, at most.
const BENDS: usize = 4;

/// A tick of a method whose task is the position.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asking<'a> {
    pub robot: &'a Robot,
    pub q: &'a [f64],
    pub dt: f64,
    /// Whether limits of position and speed hold.
    pub limits: bool,
    /// The rates of the tick before, or none.
    pub before: &'a [f64],
}

/// Keeps the tool inside a volume in a tick whose rates are given: where it would leave, the nearest rates with which it does not, the position first. Limits
/// of single joints and of combinations hold. `at` is the tool at the start of the tick and its Jacobian. No allocation.
#[inline(never)]
pub(super) fn keep_inside<const C: usize>(
    asking: &Asking<'_>,
    volume: &OrientationVolume,
    frame: &PathFrame,
    at: (&Frame, &Jacobian<C>),
    rates: &mut [f64],
) -> Kept {
    let sides = volume.sides(&frame.end, &at.0.axes);
    let inside = Inside::of(volume, frame, at.0, asking.dt, &sides);
    let returning = inside.outside;
    let held = inside.near(turn(rates, asking.dt)) && !slide(asking, &inside, at, &sides, rates) && !press_inside(asking, &inside, rates);
    Kept { held, returning }
}

/// What a step of [`Sliding`] has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Found {
    /// The rates as they are keep every bound.
    Given,
    /// Rates that do.
    Rates,
    /// Rates that are near such.
    Near,
    /// Nothing.
    Nothing,
}

/// The search for the least change of rates that leaves the position as it is and keeps the bounds, by motions in the tick.
struct Sliding<'a, const C: usize> {
    inside: &'a Inside<'a>,
    n: usize,
    given: [f64; C],
    change: [f64; C],
    /// The position, then the bounds that are equations.
    rows: Rows6<C>,
    /// These, one bit a bound.
    active: u32,
    /// Whether none of them pulls: one that does need not be an equation.
    pushes: bool,
    /// Whether joints move one link each, so that second derivatives are those of [`bend`].
    simple: bool,
}

/// Changes rates by as little as can be so that the bounds hold, with the position as it was; whether that did, within the limits. Else the rates stay.
#[inline(always)]
fn slide<const C: usize>(asking: &Asking<'_>, inside: &Inside<'_>, at: (&Frame, &Jacobian<C>), sides: &Sides, rates: &mut [f64]) -> bool {
    let Asking { robot, q, dt, limits, before } = *asking;
    let n = size::<C>(q.len());
    if turn(rates, dt) > TELLING {
        // Rates that lead far tell nothing of the bounds.
        return !inside.falls_short::<C>(robot, q, rates, dt);
    }
    let (mut given, mut rows) = ([0.0; C], [[0.0; C]; 6]);
    for i in 0..n {
        given[i] = dt * rates[i];
    }
    for (c, row) in rows.iter_mut().enumerate().take(POINT) {
        *row = at.1.v.map(|v| v[c]);
    }
    let simple = robot.coupling().is_none();
    let mut search = Sliding { inside, n, given, change: [0.0; C], rows, active: 0, pushes: true, simple };
    // From where the tick before leads, or the start of the tick, where second derivatives tell the rest, else from where the rates lead.
    let smooth = simple && sides.as_slice().iter().all(|side| side.normal.is_some());
    let told = turn(before, dt);
    let mut found = if smooth && !(told > 0.0 && told <= TELLING) {
        search.step(at, &[0.0; C], sides, true)
    } else {
        for i in 0..if smooth { n } else { 0 } {
            search.change[i] = dt * (before[i] - rates[i]);
        }
        search.step_from(robot, q, true)
    };
    for _ in 0..CORRECTIONS {
        if found == Found::Near {
            found = search.step_from(robot, q, false);
        }
    }
    match found {
        Found::Given => return true,
        Found::Rates => {}
        // The rates may be inside by less than second derivatives tell.
        Found::Near | Found::Nothing => return !inside.falls_short::<C>(robot, q, rates, dt),
    }
    // Limits on combinations are for the programme.
    if limits {
        let (mut low, mut high) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C]);
        speed_bounds(robot.limits(), q, dt, &mut low[..n], &mut high[..n]);
        let holds = |i: usize| (low[i]..=high[i]).contains(&(rates[i] + search.change[i] / dt));
        if !robot.limits().coupled.is_empty() || !(0..n).all(holds) {
            return false;
        }
    }
    for i in 0..n {
        rates[i] += search.change[i] / dt;
    }
    true
}

impl<const C: usize> Sliding<'_, C> {
    /// A step from where the rates with their change lead, unless these keep the bounds.
    #[inline(never)]
    fn step_from(&mut self, robot: &Robot, q: &[f64], first: bool) -> Found {
        let (mut there, mut motion) = ([0.0; C], [0.0; C]);
        for i in 0..self.n {
            motion[i] = self.given[i] + self.change[i];
            there[i] = q[i] + motion[i];
        }
        let (tool, columns) = jacobian_apart::<C>(robot, &there[..self.n]);
        let sides = self.inside.sides(&tool);
        if !first && sides.as_slice().len() == self.inside.count && !self.inside.lack_any(&sides) {
            return if self.pushes { Found::Rates } else { Found::Nothing };
        }
        self.step((&tool, &columns), &motion, &sides, first)
    }

    /// A Newton step from where a motion leads.
    #[inline(never)]
    fn step(&mut self, (tool, columns): (&Frame, &Jacobian<C>), motion: &[f64; C], sides: &Sides, first: bool) -> Found {
        let (n, inside, sides) = (self.n, self.inside, sides.as_slice());
        match sides.len().cmp(&inside.count) {
            // A tool that points backwards has fewer.
            Ordering::Less => return Found::Nothing,
            Ordering::Greater => return if first { Found::Given } else { Found::Nothing },
            Ordering::Equal => {}
        }
        let mut back = [0.0; C];
        (0..n).for_each(|i| back[i] = self.given[i] - motion[i]);
        // A step that is not the first is from where the change leads.
        let (turned, mut moved) = if first { (sum(&back), self.bend(tool, columns, &back)) } else { (0.0, Bend::NONE) };
        let (mut held, mut m, mut steepest, mut any) = ([(0, 0.0); POINT], POINT, 0.0f64, false);
        for (i, side) in sides.iter().enumerate() {
            // What the rates as they are lack by first derivatives, by second ones too, and how far that may be wrong.
            let (lack, lacks) = inside.lack(i, side.slack);
            let mut lack = lack - dot(side.rate, moved.turn);
            let by = lack - moved.second(side);
            let unsure = side.normal.map_or(0.0, norm) * turned.powi(3) / 6.0;
            let short = if inside.is_equal(i) { by.abs() } else { by } + unsure > 0.5 * SHORT;
            any |= short;
            if inside.is_equal(i) || self.active >> i & 1 == 1 || if first { short } else { lacks } {
                if m == 2 * POINT {
                    return Found::Nothing;
                }
                self.rows[m] = columns.w.map(|w| dot(side.rate, w));
                if !first {
                    lack -= orthogonal::dot(&self.rows[m], &back);
                }
                held[m - POINT] = (i, lack);
                self.active |= 1 << i;
                m += 1;
                steepest = steepest.max(side.normal.filter(|_| self.simple).map_or(f64::INFINITY, norm));
            }
        }
        if first && !any {
            return Found::Given;
        }
        let factors = Orthogonal::new(&self.rows, n, m);
        if m > n || factors.spread() < INDEPENDENT {
            return Found::Nothing;
        }
        let (mut wanted, mut certain, mut there, mut before) = ([0.0; 6], false, [0.0; C], turned);
        if sum(&self.change) > 0.0 {
            // The end is near where the step is from.
            (moved, before) = (Bend::NONE, 0.0);
        }
        for k in 0..BENDS {
            if k > 0 {
                moved = self.bend(tool, columns, &there);
            }
            for (r, (i, lack)) in held[..m - POINT].iter().enumerate() {
                wanted[POINT + r] = lack - moved.second(&sides[*i]);
            }
            let next = factors.solve(&wanted);
            let mut aside = 0.0;
            for i in 0..n {
                aside += (next[i] - self.change[i]).abs();
                there[i] = back[i] + next[i];
            }
            self.change = next;
            let far = sum(&there);
            // Numbers that are none end here too.
            if sum(&next).total_cmp(&TELLING).is_gt() {
                return Found::Nothing;
            }
            // The third derivative of the tool's axis is at most the cube of its turn, and the second was taken for another motion.
            let (cube, rest) = (steepest * before.max(far).powi(3) / 6.0, steepest * before.max(far) * aside);
            certain = cube + rest <= 0.5 * SHORT;
            before = far;
            // Where that leaves too much, two solutions are as good as more.
            if certain || k > 0 && cube > 0.5 * SHORT {
                certain &= (0..sides.len()).all(|i| self.active >> i & 1 == 1 || !inside.may_lack(i, sides[i].slack, far));
                break;
            }
        }
        // One bound alone pushes where it lacks.
        self.pushes = if m == POINT + 1 {
            inside.is_equal(held[0].0) || wanted[POINT] >= 0.0
        } else {
            let forces = factors.pseudo_inverse();
            (POINT..m).all(|r| inside.is_equal(held[r - POINT].0) || orthogonal::dot(&forces[r], &self.change) >= 0.0)
        };
        match (certain, self.pushes) {
            (false, _) => Found::Near,
            (true, true) => Found::Rates,
            (true, false) => Found::Nothing,
        }
    }

    /// The tool's turn by a motion, and the second derivative of its axis along it.
    #[inline(always)]
    fn bend(&self, tool: &Frame, columns: &Jacobian<C>, motion: &[f64; C]) -> Bend {
        let (mut turn, mut twist) = ([0.0; 3], [0.0; 3]);
        for (w, x) in columns.w.iter().zip(motion).take(self.n) {
            let w = scale(*x, *w);
            twist = add(twist, cross(turn, w));
            turn = add(turn, w);
        }
        let z = tool.axes[2];
        let second = if self.simple { add(cross(turn, cross(turn, z)), cross(twist, z)) } else { [0.0; 3] };
        Bend { turn, second }
    }
}

/// See [`Sliding::bend`].
#[derive(Debug, Clone, Copy)]
struct Bend {
    turn: Vec3,
    second: Vec3,
}

impl Bend {
    const NONE: Self = Self { turn: [0.0; 3], second: [0.0; 3] };

    /// What second derivatives add to a slack.
    #[inline(always)]
    fn second(&self, side: &Side) -> f64 {
        side.normal.map_or(0.0, |normal| 0.5 * dot(normal, self.second))
    }
}

/// Sum of the sizes of motions.
#[inline(always)]
fn sum<const C: usize>(motion: &[f64; C]) -> f64 {
    motion.iter().map(|x| x.abs()).sum()
}

/// Changes rates so that the bounds hold by a programme; whether they do with the position as it was. In the room for the largest robots, so that no size
/// has machine code of its own.
#[cold]
#[inline(never)]
fn press_inside(asking: &Asking<'_>, inside: &Inside<'_>, rates: &mut [f64]) -> bool {
    let Asking { robot, q, dt, limits, .. } = *asking;
    let n = q.len();
    let (mut low, mut high) = ([f64::NEG_INFINITY; MAX_JOINTS], [f64::INFINITY; MAX_JOINTS]);
    let mut rows = [DenseRow::<MAX_JOINTS>::OPEN; MAX_SIDES + MAX_COMBINATIONS];
    let mut count = inside.count;
    if limits {
        speed_bounds(robot.limits(), q, dt, &mut low[..n], &mut high[..n]);
        count += coupled_rows(robot.limits(), q, dt, &low[..n], &high[..n], &mut rows[inside.count..]).0;
    }
    let rows = &mut rows[..count];
    let (tool, columns) = jacobian_apart::<MAX_JOINTS>(robot, q);
    let position = Task::POSITION.directions(&tool, 1.0).rows(&columns);
    let size: f64 = position.iter().flatten().map(|x| x * x).sum();
    let damping = if size > 0.0 { size / POSITION_FIRST } else { 1.0 };
    let mut given = [0.0; MAX_JOINTS];
    given[..n].copy_from_slice(rates);
    let made = moved(&position, &given[..n]);
    // Rates that lead far tell nothing of the bounds.
    let mut about = if turn(rates, dt) <= TELLING { given } else { [0.0; MAX_JOINTS] };
    for round in 1..=ROUNDS {
        inside.write_about(robot, q, &about[..n], dt, rows);
        let found = match Step::of(round) {
            Step::Whole => least_squares(n, (&position, &made), (damping, &given[..n]), (&low, &high), rows),
            Step::Task => least_squares(n, (&position, &moved(&position, &about[..n])), (damping, &about[..n]), (&low, &high), rows),
            Step::Nearest | Step::Rest => least_squares(n, (&[[0.0; MAX_JOINTS]; 6], &[0.0; 6]), (1.0, &about[..n]), (&low, &high), rows),
        };
        if let Some(found) = found {
            about = found;
            rates.copy_from_slice(&found[..n]);
            if !inside.falls_short::<MAX_JOINTS>(robot, q, rates, dt) {
                let (there, whole) = (moved(&position, rates), made.iter().map(|x| x * x).sum::<f64>().sqrt());
                return there.iter().zip(&made).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() <= KEPT * (whole + f64::EPSILON);
            }
        }
        if found.is_none() || Step::of(round + 1) == Step::Rest {
            about = [0.0; MAX_JOINTS];
        }
    }
    inside.shorten(robot, q, dt, rates);
    false
}

/// The motion of the tool point that rates make.
fn moved(position: &Rows6<MAX_JOINTS>, rates: &[f64]) -> [f64; 6] {
    position.map(|row| row.iter().zip(rates).map(|(a, x)| a * x).sum())
}
