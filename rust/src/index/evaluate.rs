//! What an index answers, and how its derivatives with respect to the Jacobian become derivatives with respect to the joints.

use crate::kinematics::{Jacobian, JacobianDerivative, pull_back, pull_back_second};
use crate::linalg::Row6;

/// How much of an index is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// The value.
    Value,
    /// The value and the gradient.
    Gradient,
    /// The value, the gradient and the Hessian.
    Hessian,
}

/// How far the numbers of an evaluation can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Value and derivatives are good.
    Regular,
    /// Two singular values coincide where the index tells them apart: the gradient is one of several, the Hessian NaN.
    Repeated,
    /// The Jacobian has lost rank to working precision: the value is the limit (0 or infinity), derivatives are NaN.
    Singular,
    /// A joint is on or beyond a limit at which the index is infinite.
    OutsideLimits,
}

/// The value and derivatives of an index at a posture, over `x = (q_1 .. q_n)` and the length.
#[derive(Debug, Clone, Copy)]
pub struct Evaluation<const C: usize> {
    /// Value.
    pub value: f64,
    /// d/dq.
    pub gradient: [f64; C],
    /// d2/dq2, both triangles.
    pub hessian: [[f64; C]; C],
    /// d/dL.
    pub length_slope: f64,
    /// d2/dL dq.
    pub length_gradient: [f64; C],
    /// d2/dL2.
    pub length_curvature: f64,
    /// How far the numbers can be used.
    pub status: Status,
}

impl<const C: usize> Evaluation<C> {
    /// Nothing yet: the start of a sum.
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            value: 0.0,
            gradient: [0.0; C],
            hessian: [[0.0; C]; C],
            length_slope: 0.0,
            length_gradient: [0.0; C],
            length_curvature: 0.0,
            status: Status::Regular,
        }
    }

    /// A value without derivatives.
    pub fn without_derivatives(value: f64, status: Status) -> Self {
        Self {
            value,
            gradient: [f64::NAN; C],
            hessian: [[f64::NAN; C]; C],
            length_slope: f64::NAN,
            length_gradient: [f64::NAN; C],
            length_curvature: f64::NAN,
            status,
        }
    }

    /// Adds `weight` times another evaluation of `n` joints.
    #[inline(always)]
    pub fn add(&mut self, weight: f64, other: &Self, n: usize, order: Order) {
        self.value += weight * other.value;
        self.length_slope += weight * other.length_slope;
        self.length_curvature += weight * other.length_curvature;
        if order >= Order::Gradient {
            for k in 0..n {
                self.gradient[k] += weight * other.gradient[k];
                self.length_gradient[k] += weight * other.length_gradient[k];
            }
        }
        if order == Order::Hessian {
            for k in 0..n {
                for l in 0..n {
                    self.hessian[k][l] += weight * other.hessian[k][l];
                }
            }
        }
        self.status = self.status.max(other.status);
    }
}

/// An index as an outer function f of a smooth phi(J): all that has to be written down for a new one.
#[derive(Debug, Clone, Copy)]
pub struct Differential<const C: usize> {
    /// f(phi), f'(phi), f''(phi).
    pub outer: (f64, f64, f64),
    /// Y = d(phi)/dJ by columns, all six rows.
    pub y: [Row6; C],
    /// The second derivative of phi with respect to J, taken along `dJ/dq_k` and `dJ/dq_l` (k <= l).
    pub second: [[f64; C]; C],
    /// d(phi)/dL.
    pub length_slope: f64,
    /// d(Y)/dL by columns.
    pub length_y: [Row6; C],
    /// d2(phi)/dL2.
    pub length_curvature: f64,
    /// How far the numbers can be used.
    pub status: Status,
}

impl<const C: usize> Differential<C> {
    /// A value f(phi) whose derivatives are still to be filled in.
    #[inline(always)]
    pub fn of(outer: (f64, f64, f64)) -> Self {
        Self {
            outer,
            y: [[0.0; 6]; C],
            second: [[0.0; C]; C],
            length_slope: 0.0,
            length_y: [[0.0; 6]; C],
            length_curvature: 0.0,
            status: Status::Regular,
        }
    }
}

/// An index that depends on the posture through the Jacobian only.
pub trait JacobianIndex {
    /// Value and derivatives with respect to J. `derivative` is given when `order` is [`Order::Hessian`]; the length's derivatives are
    /// filled in when `with_length` is set.
    fn differential<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        derivative: Option<&JacobianDerivative<C>>,
        order: Order,
        with_length: bool,
    ) -> Differential<C>;

    /// Value and derivatives with respect to the joints: one sweep over the chain, then the outer function.
    #[inline(always)]
    fn evaluate<const C: usize>(
        &self,
        jacobian: &Jacobian<C>,
        derivative: Option<&JacobianDerivative<C>>,
        order: Order,
        with_length: bool,
    ) -> Evaluation<C> {
        let n = jacobian.n();
        let inner = self.differential(jacobian, derivative, order, with_length);
        let (value, slope, curvature) = inner.outer;
        if matches!(inner.status, Status::Singular) {
            return Evaluation::without_derivatives(value, inner.status);
        }
        let mut out = Evaluation::zero();
        out.value = value;
        out.status = inner.status;
        if order == Order::Value {
            return out;
        }
        let gradient = pull_back(jacobian, &inner.y);
        for k in 0..n {
            out.gradient[k] = slope * gradient[k];
        }
        if with_length {
            let mixed = pull_back(jacobian, &inner.length_y);
            out.length_slope = slope * inner.length_slope;
            out.length_curvature = slope * inner.length_curvature + curvature * inner.length_slope * inner.length_slope;
            for k in 0..n {
                out.length_gradient[k] = slope * mixed[k] + curvature * inner.length_slope * gradient[k];
            }
        }
        if order == Order::Hessian {
            let mut second = inner.second;
            pull_back_second(jacobian, &inner.y, &mut second);
            for k in 0..n {
                for l in k..n {
                    let entry = slope * second[k][l] + curvature * gradient[k] * gradient[l];
                    out.hessian[k][l] = entry;
                    out.hessian[l][k] = entry;
                }
            }
        }
        out
    }
}
