//! Derivatives by central differences of values (Dufour and Suleiman 2020, eq. 17 and 19): what exact ones are compared with, and what stands
//! in for those that a user's own index does not give.

use std::convert::Infallible;

use super::evaluate::{Evaluation, Order};
use super::objective::Objective;
use crate::error::{Result, check_length, check_positive};
use crate::linalg::MAX_JOINTS;
use crate::robot::Robot;

type Fallible<T, E> = std::result::Result<T, E>;

/// Value, gradient and, if asked for, Hessian, with `step` for every joint: 2n values for a gradient, 4n(n + 1)/2 more for a Hessian.
pub fn differences(objective: &Objective, robot: &Robot, q: &[f64], order: Order, step: f64) -> Result<Evaluation<MAX_JOINTS>> {
    check_length("q", q, robot.n())?;
    check_positive("step", step)?;
    Ok(sized(objective, robot, q, order, step))
}

/// The same by capacity.
pub fn sized<const C: usize>(objective: &Objective, robot: &Robot, q: &[f64], order: Order, step: f64) -> Evaluation<C> {
    let mut value = |q: &[f64]| Ok::<_, Infallible>(objective.value_sized::<C>(robot, q));
    let mut out = Evaluation::zero();
    let Ok(here) = value(q);
    out.value = here;
    let Ok(()) = gradient(q, step, &mut value, &mut out.gradient);
    if order == Order::Hessian {
        let Ok(()) = hessian(q, step, &mut value, &mut out.hessian);
    }
    out
}

/// `q` with some joints moved.
fn moved<const K: usize>(q: &[f64], moves: [(usize, f64); K]) -> [f64; MAX_JOINTS] {
    let mut x = [0.0; MAX_JOINTS];
    x[..q.len()].copy_from_slice(q);
    for (i, by) in moves {
        x[i] += by;
    }
    x
}

/// The gradient of a function that may fail, from 2n of its values.
pub(super) fn gradient<E>(q: &[f64], h: f64, mut value: impl FnMut(&[f64]) -> Fallible<f64, E>, out: &mut [f64]) -> Fallible<(), E> {
    let n = q.len();
    for i in 0..n {
        out[i] = (value(&moved(q, [(i, h)])[..n])? - value(&moved(q, [(i, -h)])[..n])?) / (2.0 * h);
    }
    Ok(())
}

/// The Hessian of a function that may fail, from 2n(n + 1) of its values.
pub(super) fn hessian<const C: usize, E>(
    q: &[f64],
    h: f64,
    mut value: impl FnMut(&[f64]) -> Fallible<f64, E>,
    out: &mut [[f64; C]; C],
) -> Fallible<(), E> {
    let n = q.len();
    for i in 0..n {
        for j in 0..=i {
            let mut slope =
                |at: f64| Ok((value(&moved(q, [(i, at), (j, h)])[..n])? - value(&moved(q, [(i, at), (j, -h)])[..n])?) / (2.0 * h));
            out[i][j] = (slope(h)? - slope(-h)?) / (2.0 * h);
            out[j][i] = out[i][j];
        }
    }
    Ok(())
}

/// The Hessian of a function that gives its gradient, from 2n gradients, made symmetric.
pub(super) fn hessian_of_gradients<const C: usize, E>(
    q: &[f64],
    h: f64,
    mut gradient: impl FnMut(&[f64]) -> Fallible<[f64; C], E>,
    out: &mut [[f64; C]; C],
) -> Fallible<(), E> {
    let n = q.len();
    for k in 0..n {
        let (above, below) = (gradient(&moved(q, [(k, h)])[..n])?, gradient(&moved(q, [(k, -h)])[..n])?);
        for l in 0..n {
            let half = 0.5 * (above[l] - below[l]) / (2.0 * h);
            out[k][l] += half;
            out[l][k] += half;
        }
    }
    Ok(())
}
