//! The tool kept inside a volume in a tick whose rates are given.
//!
//! In the usual case a few bounds cut into the free motion and nothing else is in the way: the least change that leaves the position as it is has a closed form,
//! and Newton steps with the same factors make the bounds hold. Where limits are in the way, or the position has to give way, a programme finds the rates.

use super::bounds::{coupled_rows, speed_bounds};
use super::coupled::Kept;
use super::inside::{Inside, PathFrame, ROUNDS, Step, TELLING, turn};
use crate::inverse::least_squares;
use crate::kinematics::sized::{Jacobian, forward, jacobian};
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::vector::dot;
use crate::linalg::{MAX_JOINTS, Rows6, size, with_capacity};
use crate::qp::DenseRow;
use crate::robot::{MAX_COMBINATIONS, Robot};
use crate::task::Task;
use crate::task::volume::{MAX_SIDES, OrientationVolume};

/// Squared size of the position's Jacobian over the damping: the position comes first, to as many digits as the programme has left.
const POSITION_FIRST: f64 = 1e8;
/// Part of the motion of the tool point that may be missing where the position counts as kept.
const KEPT: f64 = 1e-4;
/// Rows of the position.
const POINT: usize = 3;
/// Least ratio of the orthogonal rows of position and bounds with which the closed form is as good as the programme.
const INDEPENDENT: f64 = 1e-2;
/// Newton steps with the same factors, whose error falls by the length of the correction \[rad\] with each.
const CORRECTIONS: usize = 3;

/// A tick of a method whose task is the position.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asking<'a> {
    pub robot: &'a Robot,
    pub q: &'a [f64],
    pub dt: f64,
    /// Whether limits of position and speed hold.
    pub limits: bool,
}

/// Keeps the tool inside a volume in a tick whose rates are given: where it would leave, the nearest rates with which it does not, the position first. Limits
/// of single joints and of combinations hold. No allocation.
pub(super) fn keep_inside(asking: &Asking<'_>, volume: &OrientationVolume, frame: &PathFrame, rates: &mut [f64]) -> Kept {
    with_capacity!(asking.q.len(), keep(asking, volume, frame, rates))
}

#[inline(never)]
fn keep<const C: usize>(asking: &Asking<'_>, volume: &OrientationVolume, frame: &PathFrame, rates: &mut [f64]) -> Kept {
    let (tool, columns) = jacobian::<C>(asking.robot, asking.q);
    let inside = Inside::new(volume, frame, &tool, asking.dt);
    let returning = inside.outside;
    let held = inside.near(turn(rates, asking.dt)) && !slide(asking, &inside, &columns, rates) && !press_inside(asking, &inside, rates);
    Kept { held, returning }
}

/// Changes rates by as little as can be so that the bounds hold, with the position as it was; whether that did, within the limits. Else the rates stay.
#[inline(always)]
fn slide<const C: usize>(asking: &Asking<'_>, inside: &Inside<'_>, columns: &Jacobian<C>, rates: &mut [f64]) -> bool {
    let Asking { robot, q, dt, limits } = *asking;
    let n = size::<C>(q.len());
    let (mut there, mut found) = ([0.0; C], [0.0; C]);
    let lead = |there: &mut [f64; C], rates: &[f64]| (0..n).for_each(|i| there[i] = q[i] + dt * rates[i]);
    lead(&mut there, rates);
    let (tool, ahead) = jacobian::<C>(robot, &there[..n]);
    let sides = inside.sides(&tool);
    let (mut rows, mut wanted, mut active, mut m) = ([[0.0; C]; 6], [0.0; 6], [0; POINT], POINT);
    let mut any = false;
    for (i, side) in sides.as_slice().iter().enumerate() {
        let (by, short) = inside.lack(i, side.slack);
        any |= short;
        if side.equality || short {
            if m == 6 {
                return false;
            }
            rows[m] = ahead.w.map(|w| dot(side.rate, w));
            (wanted[m], active[m - POINT]) = (by / dt, i);
            m += 1;
        }
    }
    if sides.as_slice().len() > inside.count || !any && sides.as_slice().len() == inside.count {
        return true;
    }
    // A tool that points backwards, and rates that lead far, tell nothing of the bounds.
    if sides.as_slice().len() < inside.count || turn(rates, dt) > TELLING {
        return false;
    }
    let (mut low, mut high) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C]);
    if limits {
        speed_bounds(robot.limits(), q, dt, &mut low[..n], &mut high[..n]);
    }
    for (c, row) in rows.iter_mut().enumerate().take(POINT) {
        *row = columns.v.map(|v| v[c]);
    }
    let factors = Orthogonal::new(&rows, n, m);
    // Limits on combinations are for the programme.
    if m > n || factors.spread() < INDEPENDENT || limits && !robot.limits().coupled.is_empty() {
        return false;
    }
    for _ in 0..CORRECTIONS {
        let change = factors.solve(&wanted);
        (0..n).for_each(|i| found[i] = rates[i] + change[i]);
        if !(0..n).all(|i| found[i] >= low[i] && found[i] <= high[i]) || turn(&change[..n], dt) > TELLING {
            return false;
        }
        lead(&mut there, &found);
        let sides = inside.sides(&forward::<C>(robot, &there[..n]));
        let mut done = true;
        for (i, side) in sides.as_slice().iter().enumerate() {
            let (by, short) = inside.lack(i, side.slack);
            if !short {
                continue;
            }
            match active[..m - POINT].iter().position(|k| *k == i) {
                Some(k) => wanted[POINT + k] += by / dt,
                None => return false,
            }
            done = false;
        }
        if done {
            let pushes = pushes(inside, &factors, &change, (&active, m));
            if pushes {
                rates.copy_from_slice(&found[..n]);
            }
            return pushes;
        }
    }
    false
}

/// Whether no bound pulls: one that does need not hold as an equation.
#[inline(always)]
fn pushes<const C: usize>(inside: &Inside<'_>, factors: &Orthogonal<C>, change: &[f64; C], (active, m): (&[usize; POINT], usize)) -> bool {
    // One alone pushes by what it lacks.
    if m <= POINT + 1 {
        return true;
    }
    let forces = factors.pseudo_inverse();
    (POINT..m).all(|r| inside.is_equal(active[r - POINT]) || forces[r].iter().zip(change).map(|(p, x)| p * x).sum::<f64>() >= 0.0)
}

/// Changes rates so that the bounds hold by a programme; whether they do with the position as it was. In the room for the largest robots, so that no size
/// has machine code of its own.
#[cold]
#[inline(never)]
fn press_inside(asking: &Asking<'_>, inside: &Inside<'_>, rates: &mut [f64]) -> bool {
    let Asking { robot, q, dt, limits } = *asking;
    let n = q.len();
    let (mut low, mut high) = ([f64::NEG_INFINITY; MAX_JOINTS], [f64::INFINITY; MAX_JOINTS]);
    let mut rows = [DenseRow::<MAX_JOINTS>::OPEN; MAX_SIDES + MAX_COMBINATIONS];
    let mut count = inside.count;
    if limits {
        speed_bounds(robot.limits(), q, dt, &mut low[..n], &mut high[..n]);
        count += coupled_rows(robot.limits(), q, dt, &low[..n], &high[..n], &mut rows[inside.count..]).0;
    }
    let rows = &mut rows[..count];
    let (tool, columns) = jacobian::<MAX_JOINTS>(robot, q);
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
