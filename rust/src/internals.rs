//! The kernels by their capacity, for this crate's own tests and benches: whoever calls them has to choose one that fits. Not part of what
//! the crate promises.

/// Kernels of [`crate::index`].
pub mod index {
    pub use crate::index::sized::*;

    /// [`crate::index::Objective::evaluate`] by capacity.
    pub fn evaluate<const C: usize>(
        objective: &crate::index::Objective,
        robot: &crate::robot::Robot,
        q: &[f64],
        order: crate::index::Order,
        with_length: bool,
    ) -> Evaluation<C> {
        objective.evaluate_sized(robot, q, order, with_length)
    }
}

/// Kernels of [`crate::kinematics`].
pub mod kinematics {
    pub use crate::kinematics::sized::*;
}

/// Kernels of [`crate::linalg`].
pub mod linalg {
    pub use crate::linalg::banded::Banded;
    pub use crate::linalg::capacity::Rows6;
    pub use crate::linalg::cholesky::Cholesky;
    pub use crate::linalg::orthogonal::Orthogonal;
    pub use crate::linalg::svd::Svd;
    pub use crate::linalg::symmetric::diagonalise;
}

/// Kernels of [`crate::resolve`].
pub mod resolve {
    pub use crate::resolve::direct_update::direct_update;
}
