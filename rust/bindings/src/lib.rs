//! The Python module `redundancy._core`: arrays in, arrays out, in the rooms of the core. No formula lives here.

mod array;
mod collision;
mod design;
mod errors;
mod index;
mod orientation;
mod plan;
mod qp;
mod resolve;
mod results;
mod robot;
mod spare;
mod task;
mod volume;

use pyo3::prelude::*;

/// The compiled core.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::collision::scene::{PyProximity, PyScene};
    #[pymodule_export]
    use super::collision::shape::{PyBody, PyShape, bodies_from_urdf_py, capsules_along_links_py, self_pairs_py};
    #[pymodule_export]
    use super::design::posture::{characteristic_length, minimum_condition_posture, planar_tetrahedron, rms_length};
    #[pymodule_export]
    use super::index::objective::PyObjective;
    #[pymodule_export]
    use super::orientation::{
        quaternion_about, quaternion_angle, quaternion_axis_angle, quaternion_conjugate, quaternion_from_matrix, quaternion_matrix,
        quaternion_product, quaternion_rotate,
    };
    #[pymodule_export]
    use super::plan::failure::PyPlanFailure;
    #[pymodule_export]
    use super::plan::frames::{angle_grid, perpendicular, spare_grid, transport};
    #[pymodule_export]
    use super::plan::map::PyLattice;
    #[pymodule_export]
    use super::plan::path::PyPath;
    #[pymodule_export]
    use super::plan::planner::{PyPathTransfer, PyPlannedPath, plan_path};
    #[pymodule_export]
    use super::plan::settings::PyPlanSettings;
    #[pymodule_export]
    use super::qp::solve_qp;
    #[pymodule_export]
    use super::resolve::quadratic::PyQuadraticProgram;
    #[pymodule_export]
    use super::resolve::quadratic_beside::{PyFrameTask, PyPostureTask};
    #[pymodule_export]
    use super::resolve::rate::PyRateSolver;
    #[pymodule_export]
    use super::resolve::rate_methods::{
        Elimination, GradientProjection, Householder, ResolvedRate, TaskPriority, TwistDecomposition, VirtualJoint, WeightedInverse,
    };
    #[pymodule_export]
    use super::resolve::secondary::PyPosturePull;
    #[pymodule_export]
    use super::resolve::sqp::PyOrthogonalSqp;
    #[pymodule_export]
    use super::robot::PyRobot;
    #[pymodule_export]
    use super::robot::controller::PyController;
    #[pymodule_export]
    use super::task::PyTask;
    #[pymodule_export]
    use super::volume::PyVolume;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::index::kinds::register(module)?;
        super::results::add_to(module)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("build_profile", if cfg!(debug_assertions) { "debug" } else { "release" })
    }
}
