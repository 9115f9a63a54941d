//! The Python module `redundancy._core`: arrays in, arrays out. The only room that names pyo3 or numpy; no formula lives here.

mod array;
mod custom;
mod errors;
mod frames;
mod index;
mod inverse;
mod objective;
mod plan;
mod posture;
mod programme_arguments;
mod qp;
mod quadratic;
mod rate;
mod refine;
mod robot;
mod scene;
mod secondary;
mod shape;
mod solution;
mod sqp;
mod task;

use pyo3::prelude::*;

/// The compiled core.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::index::{
        ConditionNumber, CustomIndex, JointLimits, LimitBarrier, Manipulability, SingularityParameter, SmallestSingularValue,
    };
    #[pymodule_export]
    use super::objective::PyObjective;
    #[pymodule_export]
    use super::plan::{PyLattice, find_route_py};
    #[pymodule_export]
    use super::posture::{characteristic_length, minimum_condition_posture, planar_tetrahedron, rms_length};
    #[pymodule_export]
    use super::qp::solve_qp;
    #[pymodule_export]
    use super::quadratic::PyQuadraticProgram;
    #[pymodule_export]
    use super::rate::{
        Elimination, GradientProjection, Householder, PyRateSolver, ResolvedRate, TaskPriority, TwistDecomposition, VirtualJoint,
        WeightedInverse,
    };
    #[pymodule_export]
    use super::refine::{least_value_py, refine_path, restore_path};
    #[pymodule_export]
    use super::robot::PyRobot;
    #[pymodule_export]
    use super::scene::{PyProximity, PyScene};
    #[pymodule_export]
    use super::secondary::PyPosturePull;
    #[pymodule_export]
    use super::shape::{PyBody, PyShape, bodies_from_urdf_py, capsules_along_links_py, self_pairs_py};
    #[pymodule_export]
    use super::sqp::PyOrthogonalSqp;
    #[pymodule_export]
    use super::task::PyTask;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("build_profile", if cfg!(debug_assertions) { "debug" } else { "release" })
    }
}
