//! numpy arrays in and out.
//!
//! Inputs are copied to the stack (one posture) or to a vector (a batch) before anything else happens, so no borrow of a Python buffer
//! outlives the call's first lines: another thread, or an `out` that overlaps the input, cannot disturb a result.

use std::sync::OnceLock;

use numpy::{Element, PyArray1, PyArrayDescr, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods, npyffi};
use pyo3::ffi;
use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};
use pyo3::sync::PyOnceLock;
use rayon::prelude::*;

use redundancy::error::{Error, Result, check_finite};
use redundancy::linalg::MAX_JOINTS;

/// Batches from this size on release the GIL and run on every core.
const PARALLEL: usize = 256;
/// Postures a thread takes at a time.
const CHUNK: usize = 128;

/// One vector or a batch of them.
pub enum Rows {
    /// Shape (n,).
    One([f64; MAX_JOINTS]),
    /// Shape (N, n), by rows.
    Many(Vec<f64>),
}

/// Reads element `i` of a strided dimension; numpy promises neither contiguity nor alignment.
#[inline(always)]
unsafe fn read(data: *const f64, bytes: isize) -> f64 {
    unsafe { data.byte_offset(bytes).read_unaligned() }
}

/// Any array-like as float64, shape kept.
fn as_array<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let py = value.py();
    let function = ASARRAY.import(py, "numpy", "asarray")?;
    let wrong =
        || Failure::from(Error::value(name, value.repr().map_or_else(|_| "?".into(), |r| r.to_string()), "an array of real numbers"));
    let array = function.call1((value,)).map_err(|_| wrong())?;
    // numpy would only warn while it drops an imaginary part.
    if array.getattr("dtype")?.getattr("kind")?.extract::<char>()? == 'c' {
        return Err(wrong());
    }
    let array = function.call1((array, "float64")).map_err(|_| wrong())?;
    Ok(array.cast_into::<PyArrayDyn<f64>>().map_err(PyErr::from)?)
}

/// A shape as numpy shows it.
pub fn shape_of(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// The numbers of a plain array with their strides: numpy's own type, D dimensions of this shape, the float64 of this machine. `None` for anything
/// else; nearly every call is answered by these few comparisons.
#[inline(always)]
fn plain<const D: usize>(value: &Bound<'_, PyAny>, shape: [usize; D]) -> Option<(*const f64, [isize; D])> {
    static FLOAT64: PyOnceLock<Py<PyArrayDescr>> = PyOnceLock::new();
    let py = value.py();
    let float64 = FLOAT64.get_or_init(py, || f64::get_dtype(py).unbind());
    // SAFETY: the fields are those of a live object of numpy's type, with as many dimensions as are read.
    unsafe {
        let plain = npyffi::get_type_object(py, npyffi::NpyTypes::PyArray_Type);
        if !std::ptr::eq(ffi::Py_TYPE(value.as_ptr()), plain) {
            return None;
        }
        let array = &(*value.as_ptr().cast::<npyffi::PyArrayObject>()).fields;
        if array.nd != D as i32 || array.descr.cast() != float64.as_ptr() {
            return None;
        }
        let same = (0..D).all(|k| *array.dimensions.add(k) == shape[k] as npyffi::npy_intp);
        same.then(|| (array.data.cast_const().cast::<f64>(), std::array::from_fn(|k| *array.strides.add(k))))
    }
}

/// Copies `n` numbers to the front of `buffer` when `value` is a plain array of them; whether it is.
#[inline(always)]
fn read_plain(value: &Bound<'_, PyAny>, n: usize, buffer: &mut [f64]) -> bool {
    let Some((data, [stride])) = plain(value, [n]) else { return false };
    for (i, slot) in buffer[..n].iter_mut().enumerate() {
        // SAFETY: i is within the dimension, and the GIL keeps the array alive.
        *slot = unsafe { read(data, stride * i as isize) };
    }
    true
}

/// The numbers of one row of `width`, or of a 4 x 4 matrix.
pub enum RowOrMatrix {
    /// A row.
    Row([f64; MAX_JOINTS]),
    /// A matrix by rows.
    Matrix([f64; 16]),
}

/// Reads a row of `width` numbers, all finite, or a 4 x 4 matrix.
#[inline(always)]
pub fn read_row_or_matrix(name: &str, value: &Bound<'_, PyAny>, width: usize) -> PyResult<RowOrMatrix> {
    let mut row = [0.0; MAX_JOINTS];
    if read_plain(value, width, &mut row) {
        check_finite(name, &row[..width])?;
        return Ok(RowOrMatrix::Row(row));
    }
    if let Some((data, [down, right])) = plain(value, [4, 4]) {
        // SAFETY: both indices are within their dimensions, and the GIL keeps the array alive.
        return Ok(RowOrMatrix::Matrix(std::array::from_fn(|k| unsafe { read(data, down * (k / 4) as isize + right * (k % 4) as isize) })));
    }
    let (numbers, shape) = read_any(name, value)?;
    check_finite(name, &numbers)?;
    if shape == [width] {
        row[..width].copy_from_slice(&numbers);
        return Ok(RowOrMatrix::Row(row));
    }
    match <[f64; 16]>::try_from(&numbers[..]) {
        Ok(matrix) if shape == [4, 4] => Ok(RowOrMatrix::Matrix(matrix)),
        _ => Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: format!("({width},) or (4, 4)") }.into()),
    }
}

/// A rotation (3, 3) or a pose (4, 4) as the numbers of a pose by rows: of a rotation with no translation.
#[inline(never)]
pub fn read_rotation_or_pose(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; 16]> {
    let mut out = [0.0; 16];
    out[15] = 1.0;
    if let Some((data, [down, right])) = plain(value, [3, 3]) {
        for k in 0..9 {
            // SAFETY: both indices are within their dimensions, and the GIL keeps the array alive.
            out[4 * (k / 3) + k % 3] = unsafe { read(data, down * (k / 3) as isize + right * (k % 3) as isize) };
        }
        return Ok(out);
    }
    if let Some((data, [down, right])) = plain(value, [4, 4]) {
        // SAFETY: as above.
        return Ok(std::array::from_fn(|k| unsafe { read(data, down * (k / 4) as isize + right * (k % 4) as isize) }));
    }
    let (numbers, shape) = read_any(name, value)?;
    match *shape {
        [3, 3] => {
            for (row, given) in out.chunks_exact_mut(4).zip(numbers.chunks_exact(3)) {
                row[..3].copy_from_slice(given);
            }
        }
        [4, 4] => out.copy_from_slice(&numbers),
        _ => return Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: "(3, 3) or (4, 4)".into() }.into()),
    }
    Ok(out)
}

/// Many of them: the numbers, and how many are one. Shape (N, width) or (N, 4, 4), or one alone.
pub fn read_rows_or_matrices(name: &str, value: &Bound<'_, PyAny>, width: usize) -> PyResult<(Vec<f64>, usize)> {
    let (numbers, shape) = read_any(name, value)?;
    check_finite(name, &numbers)?;
    match *shape {
        [k] | [_, k] if k == width => Ok((numbers, width)),
        [4, 4] | [_, 4, 4] => Ok((numbers, 16)),
        _ => Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: format!("(N, {width}) or (N, 4, 4)") }.into()),
    }
}

/// Copies one finite vector of length `n` to the front of `buffer`.
#[inline(always)]
pub fn read_vector(name: &str, value: &Bound<'_, PyAny>, n: usize, buffer: &mut [f64]) -> PyResult<()> {
    if read_plain(value, n, buffer) {
        check_finite(name, &buffer[..n])?;
        return Ok(());
    }
    read_any_vector(name, value, n, buffer)
}

/// The same of anything that numpy makes an array of.
#[cold]
#[inline(never)]
fn read_any_vector(name: &str, value: &Bound<'_, PyAny>, n: usize, buffer: &mut [f64]) -> PyResult<()> {
    match read_rows(name, value, n)? {
        Rows::One(row) => {
            buffer[..n].copy_from_slice(&row[..n]);
            Ok(())
        }
        Rows::Many(rows) => {
            Err(Error::Shape { name: name.into(), got: format!("({}, {n})", rows.len() / n), expected: format!("({n},)") }.into())
        }
    }
}

/// The vectors of a batch, or `None` and one vector at the front of `buffer`.
#[inline(always)]
pub fn read_one_or_many(name: &str, value: &Bound<'_, PyAny>, n: usize, buffer: &mut [f64; MAX_JOINTS]) -> PyResult<Option<Vec<f64>>> {
    if read_plain(value, n, buffer) {
        check_finite(name, &buffer[..n])?;
        return Ok(None);
    }
    Ok(match read_rows(name, value, n)? {
        Rows::One(row) => {
            *buffer = row;
            None
        }
        Rows::Many(rows) => Some(rows),
    })
}

/// Copies finite vectors of length `n`: shape (n,) or (N, n).
pub fn read_rows(name: &str, value: &Bound<'_, PyAny>, n: usize) -> PyResult<Rows> {
    let array = as_array(name, value)?;
    let (shape, strides, data) = (array.shape(), array.strides(), array.data());
    match *shape {
        [length] if length == n && n <= MAX_JOINTS => {
            let mut row = [0.0; MAX_JOINTS];
            for (i, slot) in row[..n].iter_mut().enumerate() {
                // SAFETY: as above.
                *slot = unsafe { read(data, strides[0] * i as isize) };
            }
            check_finite(name, &row[..n])?;
            Ok(Rows::One(row))
        }
        [count, length] if length == n => {
            let mut rows = Vec::with_capacity(count * n);
            if has_flags(&array, npyffi::NPY_ARRAY_ALIGNED | npyffi::NPY_ARRAY_C_CONTIGUOUS) {
                // SAFETY: contiguous, aligned, alive while the GIL is held.
                rows.extend_from_slice(unsafe { std::slice::from_raw_parts(data, count * n) });
                check_finite(name, &rows)?;
                return Ok(Rows::Many(rows));
            }
            for i in 0..count {
                for j in 0..n {
                    // SAFETY: as above.
                    rows.push(unsafe { read(data, strides[0] * i as isize + strides[1] * j as isize) });
                }
            }
            check_finite(name, &rows)?;
            Ok(Rows::Many(rows))
        }
        _ => Err(Error::Shape { name: name.into(), got: shape_of(shape), expected: format!("({n},) or (N, {n})") }.into()),
    }
}

/// Numbers of any shape, NaN and infinities allowed: for constructors.
pub fn read_any(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = as_array(name, value)?;
    let readable = array.try_readonly().map_err(|e| Failure::from(Error::value(name, e, "a readable array")))?;
    // A slice may be in Fortran's order too.
    let numbers = match readable.as_slice() {
        Ok(contiguous) if array.is_c_contiguous() => contiguous.to_vec(),
        _ => readable.as_array().iter().copied().collect(),
    };
    Ok((numbers, array.shape().to_vec()))
}

/// A vector of any length.
pub fn read_list(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let (numbers, shape) = read_any(name, value)?;
    if shape.len() == 1 {
        Ok(numbers)
    } else {
        Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: "(n,)".into() }.into())
    }
}

/// A 4 x 4 matrix by rows.
pub fn read_matrix(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    read_square(name, value, 4)
}

/// An n x n matrix by rows.
pub fn read_square(name: &str, value: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    let (numbers, shape) = read_any(name, value)?;
    if shape == [n, n] {
        Ok(numbers)
    } else {
        Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: format!("({n}, {n})") }.into())
    }
}

/// Whether an array has all of numpy's flags given.
#[inline(always)]
fn has_flags(array: &Bound<'_, PyArrayDyn<f64>>, flags: std::ffi::c_int) -> bool {
    // SAFETY: the pointer is that of a live array.
    unsafe { (*array.as_array_ptr()).fields.flags & flags == flags }
}

/// A new array, or the caller's `out` after a check of its type, shape, order and writability.
#[inline(always)]
pub fn output<'py, const D: usize>(
    py: Python<'py>,
    out: Option<&Bound<'py, PyAny>>,
    shape: [usize; D],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let Some(out) = out else {
        // SAFETY: every kernel writes every element before the array is handed out.
        return Ok(unsafe { PyArrayDyn::<f64>::new(py, &shape[..], false) });
    };
    let wrong = |got: String| {
        Failure::from(Error::Shape {
            name: "out".into(),
            got,
            expected: format!("a writable C-contiguous float64 array of shape {}", shape_of(&shape)),
        })
    };
    let array = out.cast::<PyArrayDyn<f64>>().map_err(|_| wrong(format!("{}", out.get_type())))?;
    if array.shape() != shape {
        return Err(wrong(shape_of(array.shape())));
    }
    if !has_flags(array, npyffi::NPY_ARRAY_WRITEABLE | npyffi::NPY_ARRAY_ALIGNED | npyffi::NPY_ARRAY_C_CONTIGUOUS) {
        return Err(wrong("a read-only, unaligned or non-contiguous array".into()));
    }
    Ok(array.clone())
}

/// The elements of an array that [`output`] made or checked.
#[allow(clippy::mut_from_ref)] // the array is a handle: its elements are not behind the reference
#[inline(always)]
pub fn elements<'a>(array: &'a Bound<'_, PyArrayDyn<f64>>) -> &'a mut [f64] {
    // SAFETY: checked or created contiguous and aligned by `output`; the input was copied before, so nothing else is borrowed.
    unsafe { std::slice::from_raw_parts_mut(array.data(), array.len()) }
}

/// Runs `kernel` over chunks of postures and the chunks of the outputs that belong to them, each output with its numbers a posture: on every
/// core when there are many.
pub fn for_each_chunk<const K: usize>(
    rows: &[f64],
    n: usize,
    mut outputs: [(&mut [f64], usize); K],
    kernel: impl Fn(&[f64], [&mut [f64]; K]) + Sync,
) {
    if rows.len() / n < PARALLEL {
        return kernel(rows, outputs.map(|(out, _)| out));
    }
    let mut chunks = Vec::with_capacity(rows.len() / (CHUNK * n) + 1);
    for rows in rows.chunks(CHUNK * n) {
        let count = rows.len() / n;
        let parts = outputs.each_mut().map(|(rest, width)| {
            let (head, tail) = std::mem::take(rest).split_at_mut(count * *width);
            *rest = tail;
            head
        });
        chunks.push((rows, parts));
    }
    chunks.into_par_iter().for_each(|(rows, parts)| kernel(rows, parts));
}

/// Runs `kernel` over rows of `n` numbers into cells of `cell` numbers each, on every core when there are many.
pub fn for_each_row(rows: &[f64], n: usize, out: &mut [f64], cell: usize, kernel: impl Fn(&[f64], &mut [f64]) + Sync) {
    for_each_chunk(rows, n, [(out, cell)], |rows, [out]| {
        rows.chunks_exact(n).zip(out.chunks_exact_mut(cell)).for_each(|(q, out)| kernel(q, out));
    });
}

/// Applies a kernel to one posture or to a batch; `cell` is the shape of one result.
#[inline(always)]
pub fn map_rows<'py, const D: usize, const E: usize>(
    py: Python<'py>,
    n: usize,
    q: &Bound<'py, PyAny>,
    out: Option<&Bound<'py, PyAny>>,
    cell: [usize; D],
    kernel: impl Fn(&[f64], &mut [f64]) -> Result<()> + Sync,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let mut row = [0.0; MAX_JOINTS];
    let Some(rows) = read_one_or_many("q", q, n, &mut row)? else {
        let array = output(py, out, cell)?;
        ok(kernel(&row[..n], elements(&array)))?;
        return Ok(array);
    };
    let mut shape = [rows.len() / n; E];
    shape[1..].copy_from_slice(&cell);
    let array = output(py, out, shape)?;
    let size = cell.iter().product();
    let numbers = elements(&array);
    let refused = OnceLock::new();
    py.detach(|| {
        for_each_row(&rows, n, numbers, size, |q, out| {
            if let Err(error) = kernel(q, out) {
                refused.get_or_init(|| error);
            }
        })
    });
    ok(refused.into_inner().map_or(Ok(()), Err))?;
    Ok(array)
}

/// A vector as an array.
pub fn vector<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, values)
}

/// `Result` with the core's error, for `?` in bindings.
pub fn ok<T>(result: Result<T>) -> PyResult<T> {
    result.map_err(Failure::from)
}
