//! The indices made of the Jacobian as one type: what each line of the declaration in [`super`] becomes.

use super::evaluate::{Evaluation, JacobianIndex, Order, add_first_order};
use super::rows::Rows;
use crate::kinematics::sized::Jacobian;
use crate::linalg::real::Real;

/// An index of the rows in use of the normalised Jacobian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfJacobian {
    /// Which one.
    pub kind: Kind,
    /// Rows and length.
    pub rows: Rows,
    /// Whether the value is squared.
    pub squared: bool,
}

/// What is done with an index of which several postures go side by side, and with one whose postures go alone.
macro_rules! if_lanes {
    (lanes, $then:expr, $otherwise:expr) => {
        $then
    };
    (alone, $then:expr, $otherwise:expr) => {
        $otherwise
    };
}

macro_rules! declare {
    ($($(#[$doc:meta])* $kind:ident $name:literal $lanes:ident $kernel:expr;)*) => {
        /// Which index made of the Jacobian.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind {
            $($(#[$doc])* $kind,)*
        }

        impl Kind {
            /// Every kind.
            pub const ALL: &'static [Self] = &[$(Self::$kind),*];

            /// Its name in job files.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Whether several postures go side by side.
            pub(super) const fn has_lanes(self) -> bool {
                match self {
                    $(Self::$kind => if_lanes!($lanes, true, false),)*
                }
            }
        }

        impl OfJacobian {
            /// Value and derivatives with respect to the joints, into a zeroed `out`.
            #[inline(always)]
            pub(super) fn evaluate<const C: usize>(&self, jacobian: &Jacobian<C>, order: Order, with_length: bool, out: &mut Evaluation<C>) {
                match self.kind {
                    $(Kind::$kind => ($kernel)(self.rows, self.squared).evaluate(jacobian, order, with_length, out),)*
                }
            }

            /// Values and gradients of the postures side by side, added with a weight; nothing for kinds whose postures go alone.
            #[inline(always)]
            pub(super) fn add_first_order<const C: usize, T: Real>(
                &self,
                weight: f64,
                jacobian: &Jacobian<C, T>,
                order: Order,
                value: &mut T,
                gradient: &mut [T; C],
            ) {
                match self.kind {
                    $(Kind::$kind => if_lanes!(
                        $lanes,
                        add_first_order(&($kernel)(self.rows, self.squared), weight, jacobian, order, value, gradient),
                        ()
                    ),)*
                }
            }
        }
    };
}

crate::of_jacobian!(declare);
