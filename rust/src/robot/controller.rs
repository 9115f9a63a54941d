//! Joints as the robot's controller has them: signs, zeros and couplings of the pendant.

use super::Robot;
use crate::error::{Error, Result, check_vector};
use crate::linalg::MAX_JOINTS;

/// Entries of `matrix inverse` this far from those of the identity tell that there is no inverse.
const SINGULAR: f64 = 1e-9;

/// An invertible linear map from the joint coordinates q of a robot to those that its controller shows and takes: `p = matrix q + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// By rows, n x n.
    matrix: Vec<f64>,
    inverse: Vec<f64>,
    offset: Vec<f64>,
    names: Vec<String>,
}

impl Controller {
    /// The same coordinates, called J1, J2, ...
    pub fn identity(n: usize) -> Self {
        let matrix = Self::unit(n);
        Self { inverse: matrix.clone(), matrix, offset: vec![0.0; n], names: default_names(n) }
    }

    /// The identity by rows.
    fn unit(n: usize) -> Vec<f64> {
        (0..n * n).map(|k| if k % (n + 1) == 0 { 1.0 } else { 0.0 }).collect()
    }

    /// From the matrix by rows, the offset [rad or m] and names; J1, J2, ... without.
    pub fn new(matrix: Vec<f64>, offset: Vec<f64>, names: Option<Vec<String>>) -> Result<Self> {
        let n = offset.len();
        if n == 0 || n > MAX_JOINTS {
            return Err(Error::value("number of joints", n, &format!("1 to {MAX_JOINTS}")));
        }
        check_vector("matrix", &matrix, n * n)?;
        check_vector("offset", &offset, n)?;
        let names = names.unwrap_or_else(|| default_names(n));
        let distinct = (0..names.len()).all(|i| !names[i].is_empty() && !names[..i].contains(&names[i]));
        if names.len() != n || !distinct {
            return Err(Error::value("names", format!("{names:?}"), &format!("{n} different names")));
        }
        let inverse = inverse(&matrix, n).ok_or_else(|| Error::value("matrix", format!("{matrix:?}"), "an invertible matrix"))?;
        Ok(Self { matrix, inverse, offset, names })
    }

    /// Number of joints.
    pub fn n(&self) -> usize {
        self.offset.len()
    }

    /// The matrix by rows.
    pub fn matrix(&self) -> &[f64] {
        &self.matrix
    }

    /// The offset [rad or m].
    pub fn offset(&self) -> &[f64] {
        &self.offset
    }

    /// Names of the controller's joints.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Rates, or differences, of the controller's joints from those of the robot's.
    pub fn rates_from_robot(&self, rates: &[f64], out: &mut [f64]) {
        multiply(&self.matrix, rates, out);
    }

    /// Rates, or differences, of the robot's joints from those of the controller's.
    pub fn rates_to_robot(&self, rates: &[f64], out: &mut [f64]) {
        multiply(&self.inverse, rates, out);
    }

    /// The controller's joints from the robot's.
    pub fn from_robot(&self, q: &[f64], out: &mut [f64]) {
        self.rates_from_robot(q, out);
        out.iter_mut().zip(&self.offset).for_each(|(p, offset)| *p += offset);
    }

    /// The robot's joints from the controller's.
    pub fn to_robot(&self, p: &[f64], out: &mut [f64]) {
        let mut rest = [0.0; MAX_JOINTS];
        for ((rest, p), offset) in rest.iter_mut().zip(p).zip(&self.offset) {
            *rest = p - offset;
        }
        self.rates_to_robot(&rest[..p.len()], out);
    }

    /// That of a robot of which some joints are held: the controller's joints of the same numbers. `None` where those do not tell the others.
    fn without(&self, held: &[Option<f64>]) -> Option<Self> {
        let n = self.n();
        let left: Vec<usize> = (0..n).filter(|i| held[*i].is_none()).collect();
        let shift = |i: usize| held.iter().enumerate().map(|(k, held)| held.map_or(0.0, |q| self.matrix[i * n + k] * q)).sum::<f64>();
        let kept = |i: usize| left.iter().map(move |k| self.matrix[i * n + k]);
        let matrix = left.iter().flat_map(|i| kept(*i)).collect();
        let offset = left.iter().map(|i| self.offset[*i] + shift(*i)).collect();
        Self::new(matrix, offset, Some(left.iter().map(|i| self.names[*i].clone()).collect())).ok()
    }
}

fn default_names(n: usize) -> Vec<String> {
    (1..=n).map(|i| format!("J{i}")).collect()
}

fn multiply(matrix: &[f64], x: &[f64], out: &mut [f64]) {
    for (out, row) in out.iter_mut().zip(matrix.chunks_exact(x.len())) {
        *out = row.iter().zip(x).map(|(a, x)| a * x).sum();
    }
}

/// The inverse of a matrix by rows, if it has one: Gauss and Jordan's, by the largest pivots of columns.
fn inverse(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut a = matrix.to_vec();
    let mut inverse = Controller::unit(n);
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))?;
        for half in [&mut a, &mut inverse] {
            (0..n).for_each(|c| half.swap(pivot * n + c, k * n + c));
        }
        let scale = 1.0 / a[k * n + k];
        for half in [&mut a, &mut inverse] {
            half[k * n..(k + 1) * n].iter_mut().for_each(|x| *x *= scale);
        }
        for i in (0..n).filter(|i| *i != k) {
            let factor = a[i * n + k];
            for half in [&mut a, &mut inverse] {
                (0..n).for_each(|c| half[i * n + c] -= factor * half[k * n + c]);
            }
        }
    }
    let product = |i: usize, k: usize| (0..n).map(|l| matrix[i * n + l] * inverse[l * n + k]).sum::<f64>();
    let identity = Controller::unit(n);
    (0..n * n).all(|j| (product(j / n, j % n) - identity[j]).abs() <= SINGULAR).then_some(inverse)
}

impl Robot {
    /// The same robot with another map to its controller's joints; `None` for the same coordinates.
    pub fn with_controller(&self, controller: Option<Controller>) -> Result<Self> {
        match &controller {
            Some(it) if it.n() != self.n() => Err(Error::length("controller", it.n(), self.n())),
            _ => Ok(Self { controller, ..self.clone() }),
        }
    }

    /// The map to its controller's joints; `None` for the same coordinates.
    pub fn controller(&self) -> Option<&Controller> {
        self.controller.as_ref()
    }

    /// The map that is left when some joints are held.
    pub(super) fn controller_without(&self, held: &[Option<f64>]) -> Option<Controller> {
        self.controller().and_then(|it| it.without(held))
    }
}
