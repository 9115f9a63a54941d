//! `redundancy.OrientationVolume`.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::array::{ok, read_any, read_vector};
use crate::errors::PyResult;
use crate::orientation::Orientations;
use crate::results::NEAREST_ORIENTATION;
use redundancy::error::{Error, Result};
use redundancy::linalg::quaternion::Quaternion;
use redundancy::task::OrientationVolume;
use redundancy::task::volume::Shape;

/// Most members that are made at a time, 320 MB of numbers.
const MOST: usize = 10_000_000;

/// Refuses more members than fit in memory.
fn check_count(name: &str, count: Option<usize>) -> PyResult<()> {
    match count {
        Some(count) if count <= MOST => Ok(()),
        _ => Err(Error::value(name, count.map_or("more than 2^64".into(), |n| n.to_string()), "at most 10000000").into()),
    }
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
        let inside = asked.map(py, 1, |q, out| out[0] = f64::from(self.volume.contains(q, tolerance)))?;
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
        })?;
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
        let found = asked.map(py, 1, |q, out| out[0] = self.volume.nearest(q).distance)?;
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
        })?;
        let values: Vec<f64> = found.chunks_exact(4).map(|row| row[0]).collect();
        let values = asked.array(py, &values, &[])?;
        if !gradient {
            return Ok(values);
        }
        let gradients: Vec<f64> = found.chunks_exact(4).flat_map(|row| row[1..].to_vec()).collect();
        Ok(PyTuple::new(py, [values, asked.array(py, &gradients, &[3])?])?.into_any())
    }

    /// Where the tool's axis points and how far the tool is spun about it, both seen in the volume's frame.
    ///
    /// Parameters
    /// ----------
    /// R : array_like, shape (..., 4) or (..., 3, 3)
    ///     Orientations.
    ///
    /// Returns
    /// -------
    /// direction : ndarray, shape (..., 3)
    ///     z', unit vectors.
    /// spin : float or ndarray, shape (...)
    ///     Of pyramids and lines the last angle of Qx(a) Qy(b) Qz(c), of the rest the twist about z [rad], -pi to pi; 0 where undefined.
    #[allow(non_snake_case)]
    fn pointing<'py>(&self, py: Python<'py>, R: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
        let asked = Orientations::read("R", R)?;
        let found = asked.map(py, 4, |q, out| {
            let (direction, spin) = self.volume.pointing(q);
            out[..3].copy_from_slice(&direction);
            out[3] = spin;
        })?;
        let directions: Vec<f64> = found.chunks_exact(4).flat_map(|row| row[..3].to_vec()).collect();
        let spins: Vec<f64> = found.chunks_exact(4).map(|row| row[3]).collect();
        Ok(PyTuple::new(py, [asked.array(py, &directions, &[3])?, asked.array(py, &spins, &[])?])?)
    }

    /// The visualising quaternions Q_s Q_z Q_s* = [cos(spin/2), sin(spin/2) z'] (From and Gravdahl 2007, eq. 8 and 10).
    ///
    /// Parameters
    /// ----------
    /// R : array_like, shape (..., 4) or (..., 3, 3)
    ///     Orientations.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (..., 4)
    ///     Their vector parts v lie in the unit ball, along z', as long as |sin(spin/2)|. (8) reads the spin from the length and so loses its sign:
    ///     it is 2 atan2(v . z', w). Several orientations share one: (z', spin) and (-z', -spin), and every direction without spin.
    #[allow(non_snake_case)]
    fn visualising<'py>(&self, py: Python<'py>, R: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let asked = Orientations::read("R", R)?;
        let found = asked.map(py, 4, |q, out| out.copy_from_slice(&self.volume.visualising(q).0))?;
        asked.array(py, &found, &[4])
    }

    /// Random members, the same for the same seed.
    ///
    /// Parameters
    /// ----------
    /// n : int
    ///     How many, 10 million at most.
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
        check_count("n", Some(n))?;
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
        check_count("tilts * headings * spins", tilts.max(1).checked_mul(headings.max(1)).and_then(|n| n.checked_mul(spins.max(1))))?;
        let numbers: Vec<f64> = self.volume.grid(tilts, headings, spins).iter().flat_map(|member| member.orientation.0).collect();
        let count = numbers.len() / 4;
        Ok(PyArray1::from_vec(py, numbers).reshape([count, 4])?.into_any())
    }

    /// A picture: the members' quaternions, their visualising quaternions, and where they point with the spin as colour.
    ///
    /// Parameters
    /// ----------
    /// path : path-like, optional
    ///     Where to save it as well; the ending (``.png``, ``.svg``, ``.pdf``) tells the format.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    ///     What `redundancy.plots.orientation_volumes` draws; needs matplotlib.
    #[pyo3(signature = (path=None))]
    fn plot<'py>(slf: &Bound<'py, Self>, path: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        let plots = slf.py().import("redundancy.plots")?;
        let figure = plots.getattr("orientation_volumes")?.call1((slf,))?;
        Ok(plots.getattr("saved")?.call1((figure, path))?)
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
