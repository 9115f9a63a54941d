//! Orientations in and out, and `redundancy.quaternion`.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::array::{for_each_row, ok, read_any, shape_of};
use crate::errors::PyResult;
use redundancy::error::{Error, Result, check_finite};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::quaternion::Quaternion;
use redundancy::linalg::vector::{Vec3, unit};

/// How far from one the length of a caller's quaternion may be; within it, it is scaled to one.
const LENGTH: f64 = 1e-6;

/// Orientations that are answered before a look whether the caller wants to stop: seconds' work where volumes are the slowest.
const BETWEEN_SIGNALS: usize = 4096;

/// Orientations as they came: quaternions (..., 4), or matrices (..., 3, 3).
pub struct Orientations {
    /// Four numbers each.
    pub numbers: Vec<f64>,
    lead: Vec<usize>,
    matrices: bool,
}

/// A caller's quaternion, of unit length to 1e-6.
pub fn read_quaternion(name: &str, row: &[f64]) -> Result<Quaternion> {
    let q = Quaternion([row[0], row[1], row[2], row[3]]);
    match q.normalized() {
        Some(unit) if (q.dot(&q).sqrt() - 1.0).abs() <= LENGTH => Ok(unit),
        _ => Err(Error::value(name, format!("{row:?}"), "a quaternion [w, x, y, z] of length 1 (to 1e-6)")),
    }
}

/// A caller's rotation matrix by rows.
fn read_rotation(name: &str, m: &[f64]) -> Result<Quaternion> {
    let matrix = [m[0], m[1], m[2], 0.0, m[3], m[4], m[5], 0.0, m[6], m[7], m[8], 0.0, 0.0, 0.0, 0.0, 1.0];
    Ok(Quaternion::from_axes(&Frame::from_matrix(name, &matrix)?.axes))
}

impl Orientations {
    /// Reads quaternions or matrices of any leading shape.
    pub fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (given, shape) = read_any(name, value)?;
        ok(check_finite(name, &given))?;
        let (lead, size, matrices) = match &shape[..] {
            [lead @ .., 3, 3] => (lead, 9, true),
            [lead @ .., 4] => (lead, 4, false),
            _ => return Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: "(..., 4) or (..., 3, 3)".into() }.into()),
        };
        let mut numbers = Vec::with_capacity(given.len() / size * 4);
        for (i, row) in given.chunks_exact(size).enumerate() {
            let read = |name: &str| if matrices { read_rotation(name, row) } else { read_quaternion(name, row) };
            // A name is made for the one that is refused alone.
            let q = read(name).or_else(|error| if lead.is_empty() { Err(error) } else { read(&format!("{name}[{i}]")) });
            numbers.extend(ok(q)?.0);
        }
        Ok(Self { numbers, lead: lead.to_vec(), matrices })
    }

    /// One orientation.
    pub fn one(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Quaternion> {
        let read = Self::read(name, value)?;
        match <[f64; 4]>::try_from(&read.numbers[..]) {
            Ok(q) if read.lead.is_empty() => Ok(Quaternion(q)),
            _ => Err(Error::Shape {
                name: name.into(),
                got: format!("{} orientations", read.numbers.len() / 4),
                expected: "(4,) or (3, 3)".into(),
            }
            .into()),
        }
    }

    /// A kernel's `cell` numbers of each, on every core when there are many.
    pub fn map(&self, py: Python<'_>, cell: usize, kernel: impl Fn(&Quaternion, &mut [f64]) + Sync) -> PyResult<Vec<f64>> {
        let mut out = vec![0.0; self.numbers.len() / 4 * cell];
        for (rows, out) in self.numbers.chunks(4 * BETWEEN_SIGNALS).zip(out.chunks_mut(cell * BETWEEN_SIGNALS)) {
            py.detach(|| for_each_row(rows, 4, out, cell, |q, out| kernel(&Quaternion([q[0], q[1], q[2], q[3]]), out)));
            py.check_signals()?;
        }
        Ok(out)
    }

    /// An array of `cell` numbers an orientation; a number alone if there is one of each.
    pub fn array<'py>(&self, py: Python<'py>, numbers: &[f64], cell: &[usize]) -> PyResult<Bound<'py, PyAny>> {
        if let ([number], true) = (numbers, cell.is_empty() && self.lead.is_empty()) {
            return Ok(number.into_pyobject(py)?.into_any());
        }
        Ok(PyArray1::from_slice(py, numbers).reshape([&self.lead[..], cell].concat())?.into_any())
    }

    /// Flags, one an orientation.
    pub fn flags<'py>(&self, py: Python<'py>, numbers: &[f64]) -> PyResult<Bound<'py, PyAny>> {
        let flags: Vec<bool> = numbers.iter().map(|x| *x != 0.0).collect();
        if let ([flag], true) = (&flags[..], self.lead.is_empty()) {
            return Ok(flag.into_pyobject(py)?.to_owned().into_any());
        }
        Ok(PyArray1::from_vec(py, flags).reshape(self.lead.clone())?.into_any())
    }

    /// Orientations in the form in which these came.
    pub fn same_form<'py>(&self, py: Python<'py>, numbers: &[f64]) -> PyResult<Bound<'py, PyAny>> {
        if self.matrices { self.array(py, &matrices(numbers), &[3, 3]) } else { self.array(py, numbers, &[4]) }
    }
}

/// Rotation matrices by rows.
pub fn matrices(quaternions: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(quaternions.len() / 4 * 9);
    for q in quaternions.chunks_exact(4) {
        let axes = Quaternion([q[0], q[1], q[2], q[3]]).axes();
        out.extend((0..9).map(|k| axes[k % 3][k / 3]));
    }
    out
}

/// Numbers of any leading shape, `width` each.
fn read_vectors(name: &str, value: &Bound<'_, PyAny>, width: usize) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let (numbers, mut shape) = read_any(name, value)?;
    ok(check_finite(name, &numbers))?;
    if width > 1 && shape.pop() != Some(width) {
        let got = shape_of(&read_any(name, value)?.1);
        return Err(Error::Shape { name: name.into(), got, expected: format!("(..., {width})") }.into());
    }
    Ok((numbers, shape))
}

/// The leading shape of two arguments: the same, or that of the one that is no single one.
fn together(names: [&str; 2], first: &[usize], second: &[usize]) -> PyResult<Vec<usize>> {
    match (first, second) {
        (lead, []) | ([], lead) => Ok(lead.to_vec()),
        _ if first == second => Ok(first.to_vec()),
        _ => Err(Error::Shape {
            name: names[1].into(),
            got: format!("leading {}", shape_of(second)),
            expected: format!("that of {}, {}, or a single one", names[0], shape_of(first)),
        }
        .into()),
    }
}

/// A kernel's `cell` numbers of each two rows, the single one of either repeated.
fn of_two(first: (&[f64], usize), second: (&[f64], usize), count: usize, kernel: impl Fn(&[f64], &[f64], &mut Vec<f64>)) -> Vec<f64> {
    let row = |(numbers, width): (&'_ [f64], usize), i: usize| {
        let at = if numbers.len() == width { 0 } else { i * width };
        at..at + width
    };
    let mut out = Vec::new();
    for i in 0..count {
        kernel(&first.0[row(first, i)], &second.0[row(second, i)], &mut out);
    }
    out
}

fn quaternion(row: &[f64]) -> Quaternion {
    Quaternion([row[0], row[1], row[2], row[3]])
}

/// Numbers of a leading shape; one alone is a number.
fn shaped<'py>(py: Python<'py>, numbers: &[f64], lead: Vec<usize>, cell: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    Orientations { numbers: Vec::new(), lead, matrices: false }.array(py, numbers, cell)
}

/// The rotation b about the axes that a has turned, or first b, then a about fixed axes: a * b (From and Gravdahl 2007, eq. 3).
///
/// Parameters
/// ----------
/// a, b : array_like, shape (..., 4)
///     Quaternions [w, x, y, z] of unit length (to 1e-6) with the same leading shape, or one of them a single one. Rotation matrices
///     (..., 3, 3) are taken too.
///
/// Returns
/// -------
/// ndarray, shape (..., 4)
///     Their products.
#[pyfunction]
pub fn quaternion_product<'py>(py: Python<'py>, a: &Bound<'py, PyAny>, b: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (a, b) = (Orientations::read("a", a)?, Orientations::read("b", b)?);
    let lead = together(["a", "b"], &a.lead, &b.lead)?;
    let out = of_two((&a.numbers, 4), (&b.numbers, 4), lead.iter().product(), |a, b, out| {
        out.extend(quaternion(a).product(&quaternion(b)).0);
    });
    shaped(py, &out, lead, &[4])
}

/// The inverse rotations.
///
/// Parameters
/// ----------
/// q : array_like, shape (..., 4)
///     Quaternions of unit length (to 1e-6).
///
/// Returns
/// -------
/// ndarray, shape (..., 4)
///     [w, -x, -y, -z].
#[pyfunction]
pub fn quaternion_conjugate<'py>(py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let q = Orientations::read("q", q)?;
    let out = q.map(py, 4, |q, out| out.copy_from_slice(&q.conjugate().0))?;
    q.array(py, &out, &[4])
}

/// Vectors turned by rotations (eq. 4).
///
/// Parameters
/// ----------
/// q : array_like, shape (..., 4)
///     Quaternions of unit length (to 1e-6).
/// v : array_like, shape (..., 3)
///     Vectors, with the same leading shape, or either a single one.
///
/// Returns
/// -------
/// ndarray, shape (..., 3)
///     q v q*.
#[pyfunction]
pub fn quaternion_rotate<'py>(py: Python<'py>, q: &Bound<'py, PyAny>, v: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (q, (v, shape)) = (Orientations::read("q", q)?, read_vectors("v", v, 3)?);
    let lead = together(["q", "v"], &q.lead, &shape)?;
    let out = of_two((&q.numbers, 4), (&v, 3), lead.iter().product(), |q, v, out| out.extend(quaternion(q).rotate([v[0], v[1], v[2]])));
    shaped(py, &out, lead, &[3])
}

/// Rotations about axes by angles (eq. 2): [cos(angle/2), sin(angle/2) axis].
///
/// Parameters
/// ----------
/// axis : array_like, shape (..., 3)
///     Axes of any length but zero.
/// angle : array_like, shape (...)
///     Angles [rad], with the same leading shape, or either a single one.
///
/// Returns
/// -------
/// ndarray, shape (..., 4)
///     Quaternions.
#[pyfunction]
pub fn quaternion_about<'py>(py: Python<'py>, axis: &Bound<'py, PyAny>, angle: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let ((axes, shape), (angles, of_angle)) = (read_vectors("axis", axis, 3)?, read_vectors("angle", angle, 1)?);
    let lead = together(["axis", "angle"], &shape, &of_angle)?;
    let mut units: Vec<Vec3> = Vec::with_capacity(axes.len() / 3);
    for row in axes.chunks_exact(3) {
        let axis = unit([row[0], row[1], row[2]]);
        units.push(axis.ok_or_else(|| Error::value("axis", format!("{row:?}"), "a vector that is not zero"))?);
    }
    let out = of_two((units.as_flattened(), 3), (&angles, 1), lead.iter().product(), |axis, angle, out| {
        out.extend(Quaternion::about([axis[0], axis[1], axis[2]], angle[0]).0);
    });
    shaped(py, &out, lead, &[4])
}

/// Axes and angles of rotations.
///
/// Parameters
/// ----------
/// q : array_like, shape (..., 4) or (..., 3, 3)
///     Orientations.
///
/// Returns
/// -------
/// axis : ndarray, shape (..., 3)
///     Unit vectors; z where nothing turns, either of the two of half a turn.
/// angle : float or ndarray, shape (...)
///     Angles [rad], 0 to pi.
#[pyfunction]
pub fn quaternion_axis_angle<'py>(py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
    let q = Orientations::read("q", q)?;
    let axes = q.map(py, 3, |q, out| out.copy_from_slice(&q.axis_angle().0))?;
    let angles = q.map(py, 1, |q, out| out[0] = q.angle())?;
    Ok(PyTuple::new(py, [q.array(py, &axes, &[3])?, q.array(py, &angles, &[])?])?)
}

/// The smallest angles of rotations between orientations.
///
/// Parameters
/// ----------
/// a, b : array_like, shape (..., 4) or (..., 3, 3)
///     Orientations with the same leading shape, or one of them a single one.
///
/// Returns
/// -------
/// float or ndarray, shape (...)
///     Angles [rad], 0 to pi, exact to rounding at both ends; both signs of a quaternion are the same.
#[pyfunction]
pub fn quaternion_angle<'py>(py: Python<'py>, a: &Bound<'py, PyAny>, b: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let (a, b) = (Orientations::read("a", a)?, Orientations::read("b", b)?);
    let lead = together(["a", "b"], &a.lead, &b.lead)?;
    let out = of_two((&a.numbers, 4), (&b.numbers, 4), lead.iter().product(), |a, b, out| {
        out.push(quaternion(a).angle_to(&quaternion(b)));
    });
    shaped(py, &out, lead, &[])
}

/// Rotation matrices (eq. 36 to 38).
///
/// Parameters
/// ----------
/// q : array_like, shape (..., 4)
///     Quaternions of unit length (to 1e-6).
///
/// Returns
/// -------
/// ndarray, shape (..., 3, 3)
///     Matrices whose columns are the axes of the turned frame.
#[pyfunction]
pub fn quaternion_matrix<'py>(py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let q = Orientations::read("q", q)?;
    q.array(py, &matrices(&q.numbers), &[3, 3])
}

/// Quaternions of rotation matrices, without loss at half turns (Shepperd 1978).
///
/// Parameters
/// ----------
/// R : array_like, shape (..., 3, 3)
///     Matrices, orthogonal to 1e-6 and right-handed.
///
/// Returns
/// -------
/// ndarray, shape (..., 4)
///     [w, x, y, z], the component that is largest in size positive.
#[pyfunction]
#[pyo3(signature = (R))]
#[allow(non_snake_case)]
pub fn quaternion_from_matrix<'py>(py: Python<'py>, R: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let read = Orientations::read("R", R)?;
    if !read.matrices {
        return Err(Error::Shape { name: "R".into(), got: "(..., 4)".into(), expected: "(..., 3, 3)".into() }.into());
    }
    read.array(py, &read.numbers, &[4])
}
