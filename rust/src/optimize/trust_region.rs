//! Newton's method in a trust region, with the subproblem solved exactly in the eigenvectors of the Hessian (Nocedal and Wright 1999, ch. 4).

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::{Minimum, Outcome, Smooth, Stop};

/// Radius of the first region; coordinates are angles in radians and logarithms of lengths.
const FIRST_RADIUS: f64 = 0.5;
/// Largest radius.
const LARGEST_RADIUS: f64 = 2.0;
/// Eigenvalues below this multiple of the largest are directions in which the function does not change.
const FLAT: f64 = 1e-12;
/// A slope below this part of the whole gradient along a direction without curvature is rounding.
const LEVEL: f64 = 1e-10;
/// An eigenvalue below minus this multiple of the largest is a saddle's, not rounding.
const SADDLE: f64 = 1e-8;
/// Bounds every inner iteration.
const MAX_INNER: usize = 60;
/// Part of the radius by which a step may miss it.
const NEAR_RADIUS: f64 = 1e-3;
/// Least part of the predicted gain for which a step is taken.
const TAKEN: f64 = 1e-4;
/// Part of the predicted gain below which the region shrinks.
const POOR: f64 = 0.25;
/// And above which it grows.
const GOOD: f64 = 0.75;

/// Minimises `f` from `x`.
pub fn trust_region_newton(f: &mut impl Smooth, x: DVector<f64>, stop: Stop) -> Minimum {
    let (mut value, mut gradient, mut hessian) = f.hessian(&x);
    let mut best = Minimum::at(x, value, &gradient);
    if best.outcome == Outcome::Undefined {
        return best;
    }
    let mut radius = FIRST_RADIUS;
    while best.iterations < stop.iterations {
        best.iterations += 1;
        let (step, predicted) = subproblem(&gradient, &hessian, radius);
        // A predicted gain below the rounding of the value cannot be told from none; the step is still the best guess.
        let negligible = predicted <= 4.0 * f64::EPSILON * value.abs();
        if step.amax() <= stop.step {
            // Too short to change the value, but Newton's step is right to more digits than the value has.
            best.x += &step;
            best.outcome = Outcome::Converged;
            break;
        }
        let trial = &best.x + &step;
        best.evaluations += 1;
        let (next, next_gradient, next_hessian) = f.hessian(&trial);
        let ratio = (value - next) / predicted;
        let improved = next.is_finite() && (ratio > TAKEN || (negligible && next <= value + 8.0 * f64::EPSILON * value.abs()));
        if improved {
            let taken = step.amax();
            (best.x, value, gradient, hessian) = (trial, next, next_gradient, next_hessian);
            best.value = value;
            best.pass(&gradient);
            if ratio > GOOD && step.norm() > 0.9 * radius {
                radius = (2.0 * radius).min(LARGEST_RADIUS);
            }
            if negligible && taken <= stop.step.sqrt() {
                best.outcome = Outcome::Converged;
                break;
            }
        } else if negligible {
            best.outcome = Outcome::Stalled;
            break;
        }
        if !improved || ratio < POOR {
            radius = 0.25 * radius.min(step.norm());
        }
    }
    best
}

/// The minimiser of `g's + s'Hs/2` over `|s| <= radius`, and the decrease it promises.
fn subproblem(gradient: &DVector<f64>, hessian: &DMatrix<f64>, radius: f64) -> (DVector<f64>, f64) {
    let n = gradient.len();
    // Bounded; a Hessian on which it fails is not finite, and the identity then makes a gradient step.
    let eigen = SymmetricEigen::try_new(hessian.clone(), f64::EPSILON, 1000).unwrap_or_else(|| SymmetricEigen {
        eigenvectors: DMatrix::identity(n, n),
        eigenvalues: DVector::repeat(n, gradient.norm() / radius),
    });
    let slope = eigen.eigenvectors.tr_mul(gradient);
    let scale = eigen.eigenvalues.amax().max(f64::MIN_POSITIVE);
    let lowest = eigen.eigenvalues.min();
    let flat = |i: usize| eigen.eigenvalues[i].abs() <= FLAT * scale && slope[i].abs() <= LEVEL * gradient.norm();
    let at =
        |shift: f64| DVector::from_fn(n, |i, _| if flat(i) { 0.0 } else { -slope[i] / (eigen.eigenvalues[i] + shift).max(FLAT * scale) });
    let mut shift = if lowest > -FLAT * scale { 0.0 } else { -lowest };
    let mut step = at(shift);
    if step.norm() > radius {
        // Newton on 1/|s| - 1/radius, nearly linear in the shift, with a bracket as safeguard.
        let (mut low, mut high) = (shift, shift + slope.norm() / radius + scale);
        for _ in 0..MAX_INNER {
            let norm = step.norm();
            if (norm - radius).abs() <= NEAR_RADIUS * radius {
                break;
            }
            if norm > radius {
                low = shift
            } else {
                high = shift
            }
            let bend: f64 = (0..n).map(|i| step[i] * step[i] / (eigen.eigenvalues[i] + shift).max(FLAT * scale)).sum();
            let newton = shift + (norm - radius) / radius * norm * norm / bend;
            shift = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            step = at(shift);
        }
    } else if lowest < -SADDLE * scale {
        // A saddle whose downhill direction the gradient does not see: leave along it.
        let i = eigen.eigenvalues.imin();
        step[i] = (radius * radius - step.norm_squared()).max(0.0).sqrt();
    }
    let predicted = -(0..n).map(|i| step[i] * (slope[i] + 0.5 * eigen.eigenvalues[i] * step[i])).sum::<f64>();
    (&eigen.eigenvectors * step, predicted)
}
