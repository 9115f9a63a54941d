//! Indices of a posture. Each is written once, as a function of the Jacobian or of the joints, and serves alone, in a weighted sum, in
//! every resolution method and in the planner.
//!
//! ```
//! use redundancy::index::{Index, JointLimits, Kind, Objective, Order, Rows};
//! use redundancy::robot::{Convention, DhTable, Robot};
//!
//! let table = DhTable { convention: Convention::Standard, a: vec![0.4, 0.3, 0.2], d: vec![0.0; 3], alpha: vec![0.0; 3], theta: vec![0.0; 3] };
//! let robot = Robot::from_dh("planar", table, "RRR")?;
//! let condition = Index::of(Kind::ConditionNumber, Rows::new(&[2, 3, 4], 0.3)?, false);
//! let objective = Objective::new(vec![(1.0, condition), (0.1, Index::JointLimits(JointLimits::new(&[])?))])?;
//! let got = objective.evaluate(&robot, &[0.2, 1.0, 1.5], Order::Gradient, false)?;
//! assert!(got.value > 1.0 && got.gradient[0].abs() < 1e-12);
//! // In a loop, straight into the caller's memory; what is not wanted is empty.
//! let mut gradient = [0.0; 3];
//! let (value, _) = objective.evaluate_into(&robot, &[0.2, 1.0, 1.5], false, &mut gradient, &mut [])?;
//! assert_eq!((value, gradient[1]), (got.value, got.gradient[1]));
//! # Ok::<(), redundancy::error::Error>(())
//! ```

mod batch;
mod condition;
mod custom;
mod differences;
mod evaluate;
mod joint_limits;
mod kinds;
mod manipulability;
mod objective;
mod rows;
mod spectral;

/// Every index made of the Jacobian, one entry each: what it is, its type's and job files' names for it, whether its kernel takes several
/// postures side by side (`lanes`) or goes `alone`, and its kernel. Hands them to the macro `$then`, here and in the bindings.
#[doc(hidden)]
#[macro_export]
macro_rules! of_jacobian {
    ($then:ident) => {
        $then! {
            /// Condition number of the homogeneous Jacobian, `(1/m) sqrt(tr(G) tr(G^-1))` with `G = J_n J_n^T` (Leger 2014, eq. 2.14): 1 at an
            /// isotropic posture, inf at a singular one.
            ConditionNumber "condition_number" lanes |rows, squared| $crate::index::condition::ConditionNumber { rows, squared };
            /// Manipulability `sqrt(det(J_n J_n^T))`, the volume of the ellipsoid (Leger 2014, eq. 1.8): 0 at a singular posture.
            Manipulability "manipulability" lanes |rows, squared| $crate::index::manipulability::Manipulability { rows, squared };
            /// Spectral condition number of the homogeneous Jacobian, its largest over its smallest singular value: inf at a singular posture.
            SpectralConditionNumber "spectral_condition_number" alone
                |rows, squared| $crate::index::spectral::Spectral { kind: $crate::index::spectral::SpectralKind::ConditionNumber, rows, squared };
            /// Smallest singular value of the homogeneous Jacobian: 0 at a singular posture.
            SmallestSingularValue "smallest_singular_value" alone
                |rows, squared| $crate::index::spectral::Spectral { kind: $crate::index::spectral::SpectralKind::SmallestSingularValue, rows, squared };
            /// Huo's parameter of singularity `sqrt(kappa_2 / manipulability)` (Huo 2009, eq. 4.6; the source uses length 1): inf at a singular
            /// posture.
            SingularityParameter "singularity_parameter" alone
                |rows, squared| $crate::index::spectral::Spectral { kind: $crate::index::spectral::SpectralKind::SingularityParameter, rows, squared };
        }
    };
}

use crate::error::{Result, check_length};
use crate::linalg::MAX_JOINTS;
use crate::robot::Robot;

pub use batch::Answers;
pub use custom::{CustomIndex, Given, completed};
pub use differences::differences;
pub use evaluate::{Order, Status};
pub use joint_limits::{JointLimits, LimitBarrier};
pub use kinds::{Kind, OfJacobian};
pub use objective::{Index, Objective};
pub use rows::Rows;

/// The kernels, by capacity: the caller has checked the lengths.
pub(crate) mod sized {
    pub use crate::index::differences::sized as differences;
    pub use crate::index::evaluate::Evaluation;
}

/// The value and derivatives of an index at a posture; entries beyond the joints are zero.
pub type Evaluation = sized::Evaluation<MAX_JOINTS>;

/// The length that minimises kappa_F at a posture, in closed form: `kappa^2 = (L^2 A + B)(C / L^2 + D) / m^2` gives `L^4 = B C / (A D)`, with A, B the
/// squared norms of the angular and linear rows of J and C, D those of the angular and linear columns of J^+. `None` at a singularity or when
/// the rows in use are all angular or all linear.
pub fn length_of_least_condition(robot: &Robot, q: &[f64], rows: &Rows) -> Result<Option<f64>> {
    check_length("q", q, robot.n())?;
    Ok(condition::length_at(rows, &crate::kinematics::sized::jacobian::<MAX_JOINTS>(robot, q).1))
}
