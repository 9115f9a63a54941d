//! `redundancy.OrientationVolume`.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::array::{for_each_row, ok, read_any, read_vector, shape_of};
use crate::errors::PyResult;
use crate::results::NEAREST_ORIENTATION;
use redundancy::error::{Error, Result, check_finite};
use redundancy::linalg::frame::Frame;
use redundancy::linalg::quaternion::Quaternion;
use redundancy::task::OrientationVolume;
use redundancy::task::volume::Shape;

/// How far from one the length of a caller's quaternion may be; within it, it is scaled to one.
const LENGTH: f64 = 1e-6;

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
    pub fn map(&self, py: Python<'_>, cell: usize, kernel: impl Fn(&Quaternion, &mut [f64]) + Sync) -> Vec<f64> {
        let mut out = vec![0.0; self.numbers.len() / 4 * cell];
        py.detach(|| for_each_row(&self.numbers, 4, &mut out, cell, |q, out| kernel(&Quaternion([q[0], q[1], q[2], q[3]]), out)));
        out
    }

    /// An array of `cell` numbers an orientation; a number alone if there is one of each.
    pub fn array<'py>(&self, py: Python<'py>, numbers: &[f64], cell: &[usize]) -> PyResult<Bound<'py, PyAny>> {
        if let ([number], true) = (numbers, cell.is_empty() && self.lead.is_empty()) {
            return Ok(number.into_pyobject(py)?.into_any());
        }
        Ok(PyArray1::from_slice(py, numbers).reshape([&self.lead[..], cell].concat())?.into_any())
    }

    /// Flags, one an orientation.
    fn flags<'py>(&self, py: Python<'py>, numbers: &[f64]) -> PyResult<Bound<'py, PyAny>> {
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

/// A range of spins: a pair, or one number for plus and minus that.
fn read_spin(spin: Option<&Bound<'_, PyAny>>) -> PyResult<Option<(f64, f64)>> {
    let Some(spin) = spin else { return Ok(None) };
    let wrong = || {
        let shown = spin.repr().map_or_else(|_| "?".into(), |r| r.to_string());
        Error::value("spin", shown, "None, an angle [rad] of at least 0 or two, the lower first")
    };
    if let Ok(reach) = spin.extract::<f64>() {
        return if reach >= 0.0 { Ok(Some((-reach, reach))) } else { Err(wrong().into()) };
    }
    spin.extract::<(f64, f64)>().map(Some).or_else(|_| match &read_any("spin", spin)?.0[..] {
        [low, high] => Ok(Some((*low, *high))),
        _ => Err(wrong().into()),
    })
}

/// Which orientations of a tool, relative to a frame, are allowed (From and Gravdahl 2007, eq. 6, 7 and 12).
///
/// Made by `cone`, `pyramid`, `square`, `line_x`, `line_y` or `product`. The tool's axis is the z axis of the tool frame; a volume allows
/// it some tilts from its own z axis, and about it some spins. Tilts and ranges are closed and in rad; ``spin`` is None (free), a number (plus and
/// minus that) or a pair (low, high), free from a whole turn on.
///
/// Orientations are quaternions [w, x, y, z] of unit length (to 1e-6, scaled to one) of shape (..., 4), both signs the same, or rotation
/// matrices of shape (..., 3, 3), and are answered in the same form. They are those of the tool in the frame that the volume stands in: in a
/// task the frame of the path, else the base frame or whatever the caller means.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import redundancy as rd
/// >>> volume = rd.OrientationVolume.square(np.deg2rad(10), np.deg2rad(10))
/// >>> corner = rd.quaternion.about([1, -1, 0], np.deg2rad(14))
/// >>> volume.contains(corner), rd.OrientationVolume.cone(np.deg2rad(10)).contains(corner)
/// (True, False)
#[pyclass(name = "OrientationVolume", frozen, eq, module = "redundancy._core")]
#[derive(PartialEq, Clone)]
pub struct PyVolume {
    pub volume: OrientationVolume,
}

impl PyVolume {
    fn of(volume: Result<OrientationVolume>) -> PyResult<Self> {
        Ok(Self { volume: ok(volume)? })
    }

    /// As Python would make it.
    pub fn shown(&self) -> String {
        let volume = &self.volume;
        let mut shown: Vec<String> = match volume.shape() {
            Shape::Cone(tilt) => vec![tilt.to_string()],
            Shape::Pyramid([x, _]) if volume.kind() == "line_x" => vec![x.to_string()],
            Shape::Pyramid([_, y]) if volume.kind() == "line_y" => vec![y.to_string()],
            Shape::Pyramid(tilts) | Shape::Square(tilts) => tilts.iter().map(ToString::to_string).collect(),
            Shape::Product(_) => {
                let one = |(axis, low, high): &([f64; 3], f64, f64)| format!("({axis:?}, {low}, {high})");
                vec![format!("[{}]", self.factors().iter().map(one).collect::<Vec<_>>().join(", "))]
            }
        };
        shown.extend(self.spin().map(|(low, high)| format!("spin=({low}, {high})")));
        let made = format!("OrientationVolume.{}({})", volume.kind(), shown.join(", "));
        if volume.reference() == Quaternion::IDENTITY { made } else { format!("{made}.reoriented({:?})", volume.reference().0) }
    }
}

#[pymethods]
impl PyVolume {
    /// Tilts of at most an angle towards any heading: the only kind whose "10 degrees" are 10 degrees in every direction.
    ///
    /// Parameters
    /// ----------
    /// tilt : float
    ///     Largest tilt [rad], 0 to pi.
    /// spin : None, float or (float, float), optional
    ///     Range of the twist about z [rad]: 2 atan2(z, w) of the quaternion. Half a turn of the axis has none: there every spin fits.
    #[staticmethod]
    #[pyo3(signature = (tilt, spin=None))]
    fn cone(tilt: f64, spin: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(OrientationVolume::cone(tilt, read_spin(spin)?))
    }

    /// Rotations Qx(a) Qy(b) Qz(c) with \|a\| <= tilt_x, \|b\| <= tilt_y and c the spin; tilted by up to acos(cos tilt_x cos tilt_y) at the corners.
    ///
    /// Parameters
    /// ----------
    /// tilt_x, tilt_y : float
    ///     Largest tilts [rad] about x and about y, 0 to pi.
    /// spin : None, float or (float, float), optional
    ///     Range of c [rad].
    #[staticmethod]
    #[pyo3(signature = (tilt_x, tilt_y, spin=None))]
    fn pyramid(tilt_x: f64, tilt_y: f64, spin: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(OrientationVolume::pyramid(tilt_x, tilt_y, read_spin(spin)?))
    }

    /// The tool's axis z' with \|z'_x\| <= sin(tilt_y), \|z'_y\| <= sin(tilt_x) and z'_z >= 0: a square in the shadow on the xy plane.
    ///
    /// Parameters
    /// ----------
    /// tilt_x, tilt_y : float
    ///     Largest tilts [rad] about x and about y, 0 to pi/2.
    /// spin : None, float or (float, float), optional
    ///     Range of the twist about z [rad].
    #[staticmethod]
    #[pyo3(signature = (tilt_x, tilt_y, spin=None))]
    fn square(tilt_x: f64, tilt_y: f64, spin: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(OrientationVolume::square(tilt_x, tilt_y, read_spin(spin)?))
    }

    /// Tilts about x alone, then spin: Qx(a) Qz(c).
    ///
    /// Parameters
    /// ----------
    /// tilt : float
    ///     Largest tilt [rad], 0 to pi.
    /// spin : None, float or (float, float), optional
    ///     Range of c [rad].
    #[staticmethod]
    #[pyo3(signature = (tilt, spin=None))]
    fn line_x(tilt: f64, spin: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(OrientationVolume::line_x(tilt, read_spin(spin)?))
    }

    /// Tilts about y alone, then spin: Qy(b) Qz(c).
    ///
    /// Parameters
    /// ----------
    /// tilt : float
    ///     Largest tilt [rad], 0 to pi.
    /// spin : None, float or (float, float), optional
    ///     Range of c [rad].
    #[staticmethod]
    #[pyo3(signature = (tilt, spin=None))]
    fn line_y(tilt: f64, spin: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Self::of(OrientationVolume::line_y(tilt, read_spin(spin)?))
    }

    /// Rotations one after another, each about an axis of the frame that those before it have turned (eq. 6).
    ///
    /// Parameters
    /// ----------
    /// factors : sequence of (axis, low, high)
    ///     1 to 16 of them: axis (3,) of any length but zero, and its lowest and highest angle [rad].
    #[staticmethod]
    fn product(factors: &Bound<'_, PyAny>) -> PyResult<Self> {
        let wrong = |shown: &Bound<'_, PyAny>| {
            let shown = shown.repr().map_or_else(|_| "?".into(), |r| r.to_string());
            Error::value("factors", shown, "a sequence of (axis, low, high)")
        };
        let mut read = Vec::new();
        for item in factors.try_iter().map_err(|_| wrong(factors))? {
            let item = item?;
            let (axis, low, high): (Bound<'_, PyAny>, f64, f64) = item.extract().map_err(|_| wrong(&item))?;
            let mut e = [0.0; 3];
            read_vector("axis", &axis, 3, &mut e)?;
            read.push((e, low, high));
        }
        Self::of(OrientationVolume::product(&read))
    }

    /// The volume seen in another frame (eq. 12): what it allows, P turns too.
    ///
    /// Parameters
    /// ----------
    /// P : array_like, shape (4,) or (3, 3)
    ///     The frame's orientation.
    #[pyo3(signature = (P))]
    #[allow(non_snake_case)]
    fn reoriented(&self, P: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { volume: self.volume.reoriented(&Orientations::one("P", P)?) })
    }

    /// Whether orientations are members.
    ///
    /// Parameters
    /// ----------
    /// R : array_like, shape (..., 4) or (..., 3, 3)
    ///     Orientations.
    /// tolerance : float, optional
    ///     How far from a member [rad] counts as one.
    ///
    /// Returns
    /// -------
    /// bool or ndarray of bool, shape (...)
    ///     Whether the distance is at most the tolerance.
    #[pyo3(signature = (R, tolerance=1e-12))]
    #[allow(non_snake_case)]
    fn contains<'py>(&self, py: Python<'py>, R: &Bound<'py, PyAny>, tolerance: f64) -> PyResult<Bound<'py, PyAny>> {
        if !(tolerance >= 0.0 && tolerance.is_finite()) {
            return Err(Error::value("tolerance", tolerance, "a finite angle [rad] of at least 0").into());
        }
        let asked = Orientations::read("R", R)?;
        let inside = asked.map(py, 1, |q, out| out[0] = f64::from(self.volume.contains(q, tolerance)));
        asked.flags(py, &inside)
    }

    /// The members nearest to orientations: those at the smallest rotation angle.
    ///
    /// Parameters
    /// ----------
    /// R : array_like, shape (..., 4) or (..., 3, 3)
    ///     Orientations.
    ///
    /// Returns
    /// -------
    /// NearestOrientation
    ///     ``orientation`` in the form of R (of quaternions the sign nearer to R), ``distance`` (...) [rad] and ``unique`` (...): False where
    ///     others are as near (to 1e-12), as after half a turn of the tool's axis; the distance is right all the same.
    ///
    /// Notes
    /// -----
    /// In closed form for every kind but products of four rotations and more, which are searched from many starts.
    #[allow(non_snake_case)]
    fn nearest<'py>(&self, py: Python<'py>, R: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let asked = Orientations::read("R", R)?;
        let found = asked.map(py, 6, |q, out| {
            let nearest = self.volume.nearest(q);
            out[..4].copy_from_slice(&nearest.orientation.0);
            (out[4], out[5]) = (nearest.distance, f64::from(nearest.unique));
        });
        let column = |at: usize, width: usize| -> Vec<f64> { found.chunks_exact(6).flat_map(|row| row[at..at + width].to_vec()).collect() };
        let parts = (asked.same_form(py, &column(0, 4))?, asked.array(py, &column(4, 1), &[])?, asked.flags(py, &column(5, 1))?);
        Ok(NEAREST_ORIENTATION.make(py, parts)?)
    }

    /// The smallest rotation angles [rad] to a member, 0 for members.
    ///
    /// Parameters
    /// ----------
    /// R : array_like, shape (..., 4) or (..., 3, 3)
    ///     Orientations.
    ///
    /// Returns
    /// -------
    /// float or ndarray, shape (...)
    ///     Distances.
    #[allow(non_snake_case)]
    fn distance<'py>(&self, py: Python<'py>, R: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let asked = Orientations::read("R", R)?;
        let found = asked.map(py, 1, |q, out| out[0] = self.volume.nearest(q).distance);
        asked.array(py, &found, &[])
    }

    /// The distance to a member or, inside, minus the angle to the nearest orientation that is none.
    ///
    /// Parameters
    /// ----------
    /// R : array_like, shape (..., 4) or (..., 3, 3)
    ///     Orientations.
    /// gradient : bool, optional
    ///     Whether to answer the gradient too.
    ///
    /// Returns
    /// -------
    /// distance : float or ndarray, shape (...)
    ///     Angles [rad]. Inside it is known of cones, squares, pyramids with tilt_y <= pi/2, lines and what else has no interior (0), and of
    ///     products of three rotations whose axes do not come to lie in a plane; NaN of the rest, -inf where nothing bounds.
    /// gradient : ndarray, shape (..., 3)
    ///     With ``gradient=True``: d distance / dt = gradient . omega, omega the angular velocity in the frame that R is given in. A unit vector; NaN
    ///     where the distance is 0 or NaN. Where the nearest is not unique it is that of one of them.
    #[pyo3(signature = (R, gradient=false))]
    #[allow(non_snake_case)]
    fn signed_distance<'py>(&self, py: Python<'py>, R: &Bound<'py, PyAny>, gradient: bool) -> PyResult<Bound<'py, PyAny>> {
        let asked = Orientations::read("R", R)?;
        let found = asked.map(py, 4, |q, out| {
            let signed = self.volume.signed(q);
            out[0] = signed.value;
            out[1..].copy_from_slice(&signed.gradient);
        });
        let values: Vec<f64> = found.chunks_exact(4).map(|row| row[0]).collect();
        let values = asked.array(py, &values, &[])?;
        if !gradient {
            return Ok(values);
        }
        let gradients: Vec<f64> = found.chunks_exact(4).flat_map(|row| row[1..].to_vec()).collect();
        Ok(PyTuple::new(py, [values, asked.array(py, &gradients, &[3])?])?.into_any())
    }

    /// Random members, the same for the same seed.
    ///
    /// Parameters
    /// ----------
    /// n : int
    ///     How many.
    /// seed : int, optional
    ///     Of the random numbers.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, 4)
    ///     Quaternions, uniform over the volume (by Haar's measure, that of random rotations); over lines and products of fewer freedoms by length or
    ///     area; of products of four rotations and more uniform in the angles alone.
    #[pyo3(signature = (n, seed=0))]
    fn sample<'py>(&self, py: Python<'py>, n: usize, seed: u64) -> PyResult<Bound<'py, PyAny>> {
        let numbers: Vec<f64> = py.detach(|| self.volume.samples(n, seed)).iter().flat_map(|q| q.0).collect();
        Ok(PyArray1::from_vec(py, numbers).reshape([n, 4])?.into_any())
    }

    /// Members on a grid.
    ///
    /// Parameters
    /// ----------
    /// tilts, headings, spins : int
    ///     Rings of tilts around the middle direction out to the bound, directions of each, and spins of every direction, from end to end or
    ///     once around. Lines have the two headings along themselves; of a product they are the numbers of its first three angles.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (N, 4)
    ///     Quaternions.
    fn grid<'py>(&self, py: Python<'py>, tilts: usize, headings: usize, spins: usize) -> PyResult<Bound<'py, PyAny>> {
        let numbers: Vec<f64> = self.volume.grid(tilts, headings, spins).iter().flat_map(|member| member.orientation.0).collect();
        let count = numbers.len() / 4;
        Ok(PyArray1::from_vec(py, numbers).reshape([count, 4])?.into_any())
    }

    /// "cone", "pyramid", "square", "line_x", "line_y" or "product".
    #[getter]
    fn kind(&self) -> &'static str {
        self.volume.kind()
    }

    /// The tilts that it was made with [rad]: one of a cone, about x and about y of the rest, none of a product.
    #[getter]
    fn tilts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        Ok(match self.volume.shape() {
            Shape::Cone(tilt) => PyTuple::new(py, [tilt])?,
            Shape::Pyramid(tilts) | Shape::Square(tilts) => PyTuple::new(py, tilts)?,
            Shape::Product(_) => PyTuple::empty(py),
        })
    }

    /// Lowest and highest spin [rad]; None if free, and of a product.
    #[getter]
    fn spin(&self) -> Option<(f64, f64)> {
        let spin = self.volume.spin();
        (!spin.is_free()).then_some((spin.low, spin.high))
    }

    /// The rotations of a product: unit axis, lowest and highest angle [rad] of each.
    #[getter]
    fn factors(&self) -> Vec<([f64; 3], f64, f64)> {
        match self.volume.shape() {
            Shape::Product(factors) => factors.iter().map(|factor| (factor.axis, factor.range.low, factor.range.high)).collect(),
            _ => Vec::new(),
        }
    }

    /// The frame that it was reoriented to, a quaternion of shape (4,).
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.volume.reference().0)
    }

    /// Freedoms of a member: 3 if the volume has an interior, fewer of lines, fixed spins and products of fewer rotations.
    #[getter]
    fn freedoms(&self) -> usize {
        self.volume.freedoms()
    }

    /// The part of all rotations that are members, 0 to 1: in closed form (From and Gravdahl leave it open), to 1e-6 of products of three rotations and
    /// of pyramids with tilt_y > pi/2, NaN of products of four and more.
    #[getter]
    fn share(&self) -> f64 {
        self.volume.share()
    }

    fn __repr__(&self) -> String {
        self.shown()
    }

    /// From its parts, for pickle.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let class = slf.get_type();
        let spin = this.spin();
        let parts = match this.volume.shape() {
            Shape::Product(_) => PyTuple::new(py, [this.factors().into_pyobject(py)?.into_any()])?,
            _ => {
                let mut parts = this.tilts(py)?.iter().collect::<Vec<_>>();
                if let "line_x" | "line_y" = this.kind() {
                    parts.remove(usize::from(this.kind() == "line_x"));
                }
                parts.push(spin.into_pyobject(py)?.into_any());
                PyTuple::new(py, parts)?
            }
        };
        let restore = class.getattr("_restore")?;
        Ok((restore, (this.kind(), parts, this.volume.reference().0).into_pyobject(py)?))
    }

    #[staticmethod]
    fn _restore(kind: &str, parts: &Bound<'_, PyTuple>, reference: [f64; 4]) -> PyResult<Self> {
        let made = parts.py().get_type::<Self>().getattr(kind)?.call1(parts.clone())?;
        let volume = made.cast::<Self>()?.get().volume.clone();
        let reference = Quaternion(reference);
        Ok(Self { volume: if reference == Quaternion::IDENTITY { volume } else { volume.reoriented(&reference) } })
    }
}
