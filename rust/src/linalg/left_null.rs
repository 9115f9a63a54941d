//! The left null space of a tall matrix.

/// Orthonormal vectors orthogonal to C columns of R numbers, L = R - C of them, by Householder reflections with column pivoting, which leaves
/// them orthogonal where the columns depend on each other, too.
pub fn left_null_space<const R: usize, const C: usize, const L: usize>(mut columns: [[f64; R]; C]) -> [[f64; R]; L] {
    const { assert!(L + C == R, "as many vectors as are left") };
    for k in 0..C {
        let square = |c: &[f64; R]| c[k..].iter().map(|x| x * x).sum::<f64>();
        let (mut best, mut largest) = (k, square(&columns[k]));
        for j in k + 1..C {
            let size = square(&columns[j]);
            if size > largest {
                (best, largest) = (j, size);
            }
        }
        columns.swap(k, best);
        let mut reflector = [0.0; R];
        reflector[k..].copy_from_slice(&columns[k][k..]);
        reflector[k] += largest.sqrt().copysign(reflector[k]);
        let length = reflector.iter().map(|x| x * x).sum::<f64>();
        if length > 0.0 {
            let unit = 2.0f64.sqrt() / length.sqrt();
            reflector = reflector.map(|x| x * unit);
            for column in &mut columns[k + 1..] {
                reflect(column, &reflector);
            }
        }
        columns[k] = reflector;
    }
    let mut null = [[0.0; R]; L];
    for (i, vector) in null.iter_mut().enumerate() {
        vector[C + i] = 1.0;
        for reflector in columns.iter().rev() {
            reflect(vector, reflector);
        }
    }
    null
}

/// (1 - v v') x, for v of squared length two.
fn reflect<const R: usize>(x: &mut [f64; R], v: &[f64; R]) {
    let along: f64 = (0..R).map(|i| v[i] * x[i]).sum();
    for i in 0..R {
        x[i] -= along * v[i];
    }
}
