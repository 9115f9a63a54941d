//! Real roots of polynomials up to the fourth degree.

/// Coefficients from the constant on.
pub type Polynomial = [f64; 5];

/// Leading coefficients below this part of the largest are rounding.
const ROUNDING: f64 = 1e-14;
/// A polynomial whose extremum misses zero by this much, relative to what it is the sum of, touches it.
const TOUCHING: f64 = 1e-10;
/// Roots and extrema that count as such.
const MOST: usize = 7;
/// Halvings of a bracket: all digits of a double.
const HALVINGS: usize = 60;
/// Newton steps after them.
const POLISH: usize = 3;

/// The product of two polynomials; terms beyond the fourth degree have to be zero.
pub fn product(a: &Polynomial, b: &Polynomial) -> Polynomial {
    let mut out = [0.0; 5];
    for i in 0..5 {
        for j in 0..5 - i {
            out[i + j] += a[i] * b[j];
        }
    }
    out
}

/// The value at `x`.
pub fn value(p: &[f64], x: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Calls `each` with every real root; false where all numbers are. `scale` is the size of what `p` is the sum of, for roots of about 1.
pub fn real_roots(p: &Polynomial, scale: f64, each: &mut dyn FnMut(f64)) -> bool {
    let largest = p.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if !(largest > ROUNDING * scale && largest.is_finite()) {
        return false;
    }
    let degree = (0..5).rev().find(|&k| p[k].abs() > ROUNDING * largest).unwrap_or(0);
    let mut roots = ([0.0; MOST], 0);
    collect(&p[..=degree], scale, &mut roots);
    roots.0[..roots.1].iter().for_each(|x| each(*x));
    true
}

/// The roots between the extrema, which are the roots of the derivative, in increasing order.
fn collect(p: &[f64], scale: f64, roots: &mut ([f64; MOST], usize)) {
    let degree = p.len() - 1;
    roots.1 = 0;
    if degree == 0 {
        return;
    }
    let derivative: [f64; 4] = std::array::from_fn(|k| if k < degree { (k + 1) as f64 * p[k + 1] } else { 0.0 });
    let mut extrema = ([0.0; MOST], 0);
    collect(&derivative[..degree], scale, &mut extrema);
    // No root is larger (Cauchy).
    let bound = 1.0 + p[..degree].iter().fold(0.0f64, |m, c| m.max((c / p[degree]).abs()));
    let mut push = |x: f64| {
        if roots.1 < MOST && !roots.0[..roots.1].contains(&x) {
            roots.0[roots.1] = x;
            roots.1 += 1;
        }
    };
    let mut low = -bound;
    for high in extrema.0[..extrema.1].iter().copied().chain([bound]) {
        let (at_low, at_high) = (value(p, low), value(p, high));
        if at_low == 0.0 {
            push(low);
        } else if at_low.is_sign_positive() != at_high.is_sign_positive() && at_high != 0.0 {
            push(between(p, &derivative[..degree], low, high));
        }
        let terms = p.iter().enumerate().fold(scale, |sum, (k, c)| sum + (c * high.powi(k as i32)).abs());
        if high < bound && value(p, high).abs() <= TOUCHING * terms {
            push(high);
        }
        low = high;
    }
}

/// The root between two places where the signs differ.
fn between(p: &[f64], derivative: &[f64], mut low: f64, mut high: f64) -> f64 {
    let rising = value(p, high) > 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if (value(p, middle) > 0.0) == rising { high = middle } else { low = middle }
    }
    let mut x = 0.5 * (low + high);
    for _ in 0..POLISH {
        let step = value(p, x) / value(derivative, x);
        if step.abs() <= high - low {
            x -= step;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roots(p: Polynomial) -> Vec<f64> {
        let mut out = Vec::new();
        assert!(real_roots(&p, 1.0, &mut |x| out.push(x)));
        out
    }

    #[test]
    fn roots_of_every_degree_are_found() {
        // (x - 1)(x + 2)(x - 3)(x - 0.5)
        let p = [(-1.0, 1.0), (2.0, 1.0), (-3.0, 1.0), (-0.5, 1.0)]
            .iter()
            .fold([1.0, 0.0, 0.0, 0.0, 0.0], |p, (a, b)| product(&p, &[*a, *b, 0.0, 0.0, 0.0]));
        for (got, wanted) in roots(p).iter().zip([-2.0, 0.5, 1.0, 3.0]) {
            assert!((got - wanted).abs() < 1e-14);
        }
        assert_eq!(roots([1.0, 0.0, 1.0, 0.0, 0.0]), Vec::<f64>::new());
        assert_eq!(roots([0.0, 0.0, 1.0, 0.0, 0.0]), [0.0]);
        assert_eq!(roots([-1.0, 2.0, 0.0, 0.0, 0.0]), [0.5]);
        assert!(!real_roots(&[0.0; 5], 1.0, &mut |_| {}));
    }

    #[test]
    fn a_parabola_that_touches_zero_to_rounding_has_its_vertex() {
        assert_eq!(roots([1.0 + 1e-14, -2.0, 1.0, 0.0, 0.0]).len(), 1);
    }
}
