//! Derivatives of an objective by central differences of its values (Dufour and Suleiman 2020, eq. 17 and 19): what exact ones are compared with.

use super::{Objective, Order};
use crate::linalg::MAX_JOINTS;
use crate::robot::Robot;

/// Value, gradient and, if asked for, Hessian, with `step` for every joint: 2n values for a gradient, 4n(n + 1)/2 more for a Hessian.
pub fn differences<const C: usize>(
    objective: &Objective,
    robot: &Robot,
    q: &[f64],
    order: Order,
    step: f64,
) -> (f64, [f64; C], [[f64; C]; C]) {
    let n = q.len();
    let value = |moved: &[(usize, f64)]| {
        let mut x = [0.0; MAX_JOINTS];
        x[..n].copy_from_slice(q);
        for (i, by) in moved {
            x[*i] += by;
        }
        objective.evaluate::<C>(robot, &x[..n], Order::Value, false).value
    };
    let (mut gradient, mut hessian) = ([0.0; C], [[0.0; C]; C]);
    for i in 0..n {
        gradient[i] = (value(&[(i, step)]) - value(&[(i, -step)])) / (2.0 * step);
        if order < Order::Hessian {
            continue;
        }
        for j in 0..=i {
            let slope = |at: f64| (value(&[(i, at), (j, step)]) - value(&[(i, at), (j, -step)])) / (2.0 * step);
            hessian[i][j] = (slope(step) - slope(-step)) / (2.0 * step);
            hessian[j][i] = hessian[i][j];
        }
    }
    (value(&[]), gradient, hessian)
}
