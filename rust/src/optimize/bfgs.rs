//! BFGS on the inverse Hessian (Leger 2014, eq. 3.49 to 3.57).

use nalgebra::{DMatrix, DVector};

use super::{Minimum, Outcome, Smooth, Stop, strong_wolfe};

/// Minimises `f` from `x` with gradients alone.
pub fn bfgs(f: &mut impl Smooth, x: DVector<f64>, stop: Stop) -> Minimum {
    let n = x.len();
    let (value, mut gradient) = f.gradient(&x);
    let mut best = Minimum::at(x, value, &gradient);
    if best.outcome == Outcome::Undefined {
        return best;
    }
    // Unknown curvature: a first step of at most a tenth of a radian.
    let mut inverse = DMatrix::<f64>::identity(n, n) * (0.1 / gradient.norm().max(0.1));
    let mut fresh = true;
    while best.iterations < stop.iterations {
        best.iterations += 1;
        let mut direction = -(&inverse * &gradient);
        if gradient.dot(&direction) >= 0.0 {
            direction = -gradient.clone();
        }
        if direction.amax() <= stop.step {
            best.outcome = Outcome::Converged;
            break;
        }
        let (found, evaluations) = strong_wolfe(f, &best.x, best.value, &gradient, &direction, 1.0);
        best.evaluations += evaluations;
        let Some(found) = found else {
            best.outcome = Outcome::Stalled;
            break;
        };
        let s = &found.x - &best.x;
        let y = &found.gradient - &gradient;
        (best.x, best.value, gradient) = (found.x, found.value, found.gradient);
        best.pass(&gradient);
        let sy = s.dot(&y);
        if sy > f64::EPSILON * s.norm() * y.norm() {
            if fresh {
                inverse = DMatrix::identity(n, n) * (sy / y.norm_squared());
                fresh = false;
            }
            update(&mut inverse, &s, &y, sy);
        }
        if s.amax() <= stop.step {
            best.outcome = Outcome::Converged;
            break;
        }
    }
    best
}

/// (3.51b).
fn update(inverse: &mut DMatrix<f64>, s: &DVector<f64>, y: &DVector<f64>, sy: f64) {
    let hy = &*inverse * y;
    let weight = (1.0 + y.dot(&hy) / sy) / sy;
    inverse.ger(weight, s, s, 1.0);
    inverse.ger(-1.0 / sy, &hy, s, 1.0);
    inverse.ger(-1.0 / sy, s, &hy, 1.0);
}
