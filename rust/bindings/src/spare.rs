//! Arrays that are handed out again: making and freeing one takes longer than the Jacobian of a robot.

use std::sync::atomic::{AtomicPtr, Ordering::Relaxed};

use numpy::{Element, PyArray1, PyArrayDescr, npyffi};
use pyo3::ffi;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

/// Flags of a new vector.
const NEW: std::ffi::c_int = npyffi::NPY_ARRAY_C_CONTIGUOUS
    | npyffi::NPY_ARRAY_F_CONTIGUOUS
    | npyffi::NPY_ARRAY_OWNDATA
    | npyffi::NPY_ARRAY_ALIGNED
    | npyffi::NPY_ARRAY_WRITEABLE;

/// The last two vectors handed out. One that nobody else holds any more, and that is as a new one would be, is handed out again, as Python's
/// `zip` does with its tuples. Two, because a loop still holds the last answer when it asks for the next.
#[derive(Default)]
pub struct Spare([AtomicPtr<ffi::PyObject>; 2]);

impl Spare {
    /// A vector of `size` numbers, to be written before it is handed out.
    #[inline(always)]
    pub fn vector<'py>(&self, py: Python<'py>, size: usize) -> Bound<'py, PyArray1<f64>> {
        for slot in &self.0 {
            let held = slot.load(Relaxed);
            // SAFETY: a slot owns what it points to, a vector that `fresh` made; the GIL is held from the count to the new reference.
            unsafe {
                if !held.is_null() && is_free(py, held, size) {
                    return Bound::from_borrowed_ptr(py, held).cast_into_unchecked();
                }
            }
        }
        self.fresh(py, size)
    }

    /// A new one, in the place of the elder of the two.
    #[inline(never)]
    fn fresh<'py>(&self, py: Python<'py>, size: usize) -> Bound<'py, PyArray1<f64>> {
        // SAFETY: every element is written before the array is handed out.
        let array = unsafe { PyArray1::<f64>::new(py, [size], false) };
        let elder = self.0[0].swap(array.clone().into_ptr(), Relaxed);
        release(self.0[1].swap(elder, Relaxed));
        array
    }
}

impl Drop for Spare {
    fn drop(&mut self) {
        self.0.iter_mut().for_each(|slot| release(*slot.get_mut()));
    }
}

/// Gives up the reference of a slot.
fn release(held: *mut ffi::PyObject) {
    // SAFETY: slots own what they point to, and Python frees its objects with the GIL held.
    unsafe { ffi::Py_XDECREF(held) }
}

/// Whether nobody but its slot holds a vector, and whether it is as new.
#[inline(always)]
unsafe fn is_free(py: Python<'_>, held: *mut ffi::PyObject, size: usize) -> bool {
    static FLOAT64: PyOnceLock<Py<PyArrayDescr>> = PyOnceLock::new();
    let float64 = FLOAT64.get_or_init(py, || f64::get_dtype(py).unbind());
    // SAFETY: the caller's pointer is that of a live array.
    unsafe {
        let array = &(*held.cast::<npyffi::PyArrayObject>()).fields;
        ffi::Py_REFCNT(held) == 1
            && array.nd == 1
            && *array.dimensions == size as npyffi::npy_intp
            && array.flags == NEW
            && array.base.is_null()
            && array.weakreflist.is_null()
            && std::ptr::eq(array.descr.cast(), float64.as_ptr())
    }
}
