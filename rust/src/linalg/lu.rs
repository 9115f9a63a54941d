//! Gaussian elimination with partial pivoting, on the stack.

/// A factored square matrix: unit lower triangle below the diagonal, upper triangle on and above it.
#[derive(Debug, Clone)]
pub struct Lu<const N: usize> {
    factors: [[f64; N]; N],
    order: [usize; N],
    odd: bool,
}

impl<const N: usize> Lu<N> {
    /// Factors a matrix given by rows. A vanishing pivot is kept as it is.
    #[inline]
    pub fn new(mut a: [[f64; N]; N]) -> Self {
        let mut order: [usize; N] = std::array::from_fn(|i| i);
        let mut odd = false;
        for k in 0..N {
            let mut best = k;
            for i in k + 1..N {
                if a[i][k].abs() > a[best][k].abs() {
                    best = i;
                }
            }
            if best != k {
                a.swap(k, best);
                order.swap(k, best);
                odd = !odd;
            }
            let pivot = a[k];
            if pivot[k] == 0.0 {
                continue;
            }
            let inverse = 1.0 / pivot[k];
            for row in &mut a[k + 1..] {
                let factor = row[k] * inverse;
                for j in k + 1..N {
                    row[j] -= factor * pivot[j];
                }
                row[k] = factor;
            }
        }
        Self { factors: a, order, odd }
    }

    /// The determinant.
    #[inline]
    pub fn determinant(&self) -> f64 {
        let product: f64 = (0..N).map(|i| self.factors[i][i]).product();
        if self.odd { -product } else { product }
    }

    /// Smallest over largest pivot: a cheap sign of near dependence, 0 to 1.
    pub fn spread(&self) -> f64 {
        let pivots = || (0..N).map(|i| self.factors[i][i].abs());
        pivots().fold(f64::INFINITY, f64::min) / pivots().fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Solves for one right-hand side; pivots smaller than `floor` are taken as `floor`.
    #[inline]
    pub fn solve(&self, b: &[f64; N], floor: f64) -> [f64; N] {
        let mut x: [f64; N] = std::array::from_fn(|i| b[self.order[i]]);
        for i in 0..N {
            for j in 0..i {
                x[i] -= self.factors[i][j] * x[j];
            }
        }
        self.back(x, floor)
    }

    /// Solves with the upper triangle alone.
    #[inline]
    fn back(&self, mut x: [f64; N], floor: f64) -> [f64; N] {
        for i in (0..N).rev() {
            for j in i + 1..N {
                x[i] -= self.factors[i][j] * x[j];
            }
            let pivot = self.factors[i][i];
            x[i] /= if pivot.abs() < floor { floor.copysign(pivot) } else { pivot };
        }
        x
    }

    /// Pivots below this are rounding.
    fn floor(&self) -> f64 {
        let largest = self.factors.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        (largest * f64::EPSILON).max(f64::MIN_POSITIVE)
    }

    /// The direction the matrix shrinks most, by two steps of inverse iteration (Wilkinson's start: the upper triangle alone).
    #[inline]
    pub fn null_vector(&self) -> [f64; N] {
        let floor = self.floor();
        let mut x = unit(self.back([1.0; N], floor));
        for _ in 0..2 {
            x = unit(self.solve(&x, floor));
        }
        x
    }

    /// The three orthonormal directions the matrix shrinks most, the most first, by inverse iteration on all of them.
    pub fn null_vectors(&self) -> [[f64; N]; 3] {
        let floor = self.floor();
        let mut space: [[f64; N]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| if j % 3 == i { 1.0 } else { 0.1 * j as f64 }));
        for _ in 0..3 {
            space = space.map(|x| unit(self.solve(&unit(x), floor)));
            for i in 0..3 {
                // Twice, since what is left after the first time may be small.
                for _ in 0..2 {
                    for j in 0..i {
                        let along: f64 = (0..N).map(|k| space[i][k] * space[j][k]).sum();
                        for k in 0..N {
                            space[i][k] -= along * space[j][k];
                        }
                    }
                    space[i] = unit(space[i]);
                }
            }
        }
        space
    }
}

/// Of length one; zero stays zero.
#[inline]
fn unit<const N: usize>(x: [f64; N]) -> [f64; N] {
    let largest = x.iter().fold(0.0f64, |m, x| m.max(x.abs())).max(f64::MIN_POSITIVE);
    let x = x.map(|x| x / largest);
    let size = x.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    x.map(|x| x / size)
}
