//! Results of several parts as named tuples: they unpack, and each part has a name.

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};

/// A class of results of the module.
pub struct Named {
    name: &'static str,
    fields: &'static [&'static str],
    doc: &'static str,
    class: PyOnceLock<Py<PyType>>,
}

/// One target: what `solve` answers.
pub static SOLUTION: Named = Named {
    name: "Solution",
    fields: &["q", "value", "status", "iterations"],
    doc: "A posture on a target: q (n,) [rad or m], value of the objective, status in words, and steps.",
    class: PyOnceLock::new(),
};

/// Many targets: what `follow_chunk` answers.
pub static PATH_SOLUTION: Named = Named {
    name: "PathSolution",
    fields: &["q", "value", "position_error", "axis_error", "status", "iterations"],
    doc: "Postures q (N, n) [rad or m] on N targets with the values of the objective, the errors [m, rad], each (N,), the status of each in words, and \
          steps altogether.",
    class: PyOnceLock::new(),
};

/// What `OrthogonalSQP.constraint` answers.
pub static CONSTRAINT: Named = Named {
    name: "Constraint",
    fields: &["h", "jacobian", "null"],
    doc: "A task's equality constraint h (m,) = 0 at a posture, dh/dq (m, n), and an orthonormal basis (n, k) of the null space of that.",
    class: PyOnceLock::new(),
};

/// What `OrthogonalSQP.history` answers.
pub static SOLVE_HISTORY: Named = Named {
    name: "SolveHistory",
    fields: &["q", "value", "gradient", "step", "evaluations"],
    doc: "Postures q (k, n) [rad or m] on a target on the way to a minimum, the objective at each (k,), the length of its gradient along the free motion \
          that limits leave (k,), the largest component of the step from there (k,) [rad or m] and evaluations of the objective up to there (k,).",
    class: PyOnceLock::new(),
};

/// What `solve_qp` answers.
pub static QP_SOLUTION: Named = Named {
    name: "QPSolution",
    fields: &["x", "status", "bound_multipliers", "row_multipliers", "changes"],
    doc: "The minimiser x (n,) of a programme, its status in words, the multipliers of bounds (n,) and rows (m,), and changes of the working set.",
    class: PyOnceLock::new(),
};

/// What `one_joint_minimum` answers.
pub static ONE_JOINT: Named = Named {
    name: "OneJointMinimum",
    fields: &["change", "value"],
    doc: "The change of a joint [rad or m] that makes a cost least, and the cost there.",
    class: PyOnceLock::new(),
};

/// What `CoordinateDescent.trace` answers.
pub static DESCENT_TRACE: Named = Named {
    name: "DescentTrace",
    fields: &["cost", "q", "picks"],
    doc: "Cost (k + 1,) and joints q (k + 1, n) [rad or m] before the first of k sweeps and after each, and the joints that algorithms 2 and 3 moved (k, n), \
          -1 where none lowered the cost; (k, 0) for the others.",
    class: PyOnceLock::new(),
};

/// What `CoordinateDescent.solve` answers.
pub static DESCENT: Named = Named {
    name: "DescentResult",
    fields: &["q", "status", "position_error", "orientation_error", "iterations", "cost", "costs"],
    doc: "Posture q (n,) [rad or m], why the sweeps ended, in words, the errors of the tool [m, rad], the number of sweeps, the cost there, and the cost before \
          the first sweep and after each.",
    class: PyOnceLock::new(),
};

/// What `Robot.singularity` answers.
pub static SINGULARITY: Named = Named {
    name: "Singularity",
    fields: &["kind", "value", "twist", "joints"],
    doc: "Which singularity a posture is at, the smallest singular value of its Jacobian without units, the unit twist (6,) that the tool makes least of and \
          the unit motion (n,) of the joints that moves the tool least.",
    class: PyOnceLock::new(),
};

/// What `OrientationVolume.nearest` answers.
pub static NEAREST_ORIENTATION: Named = Named {
    name: "NearestOrientation",
    fields: &["orientation", "distance", "unique"],
    doc: "The members nearest to orientations, in their form, (..., 4) or (..., 3, 3), the smallest rotation angles to them (...) [rad], and whether no \
          other member is as near (...).",
    class: PyOnceLock::new(),
};

impl Named {
    fn class<'py>(&self, py: Python<'py>) -> PyResult<&Bound<'py, PyType>> {
        let class = self.class.get_or_try_init(py, || {
            let options = PyDict::new(py);
            options.set_item("module", "redundancy._core")?;
            let class = py.import("collections")?.getattr("namedtuple")?.call((self.name, self.fields.to_vec()), Some(&options))?;
            class.setattr("__doc__", self.doc)?;
            Ok::<_, PyErr>(class.cast_into::<PyType>()?.unbind())
        })?;
        Ok(class.bind(py))
    }

    /// A result of its parts.
    pub fn make<'py>(&self, py: Python<'py>, parts: impl PyCallArgs<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.class(py)?.call1(parts)
    }
}

/// Adds the classes to the module.
pub fn add_to(module: &Bound<'_, PyModule>) -> PyResult<()> {
    for named in [
        &SOLUTION,
        &PATH_SOLUTION,
        &CONSTRAINT,
        &SOLVE_HISTORY,
        &QP_SOLUTION,
        &SINGULARITY,
        &NEAREST_ORIENTATION,
        &ONE_JOINT,
        &DESCENT_TRACE,
        &DESCENT,
    ] {
        module.add(named.name, named.class(module.py())?)?;
    }
    Ok(())
}
