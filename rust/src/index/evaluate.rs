//! What an index answers, and how its derivatives with respect to the Jacobian become derivatives with respect to the joints.

use super::rows::Rows;
use crate::kinematics::sized::{Jacobian, pull_back, pull_back_of, pull_back_second};
use crate::linalg::Row6;
use crate::linalg::real::Real;

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

impl Order {
    /// What an answer has room for.
    #[inline(always)]
    pub(super) fn wanted(gradient: &[f64], hessian: &[f64]) -> Self {
        match (gradient, hessian) {
            ([], []) => Self::Value,
            (_, []) => Self::Gradient,
            _ => Self::Hessian,
        }
    }
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

    /// The same of `n` joints in another capacity that holds them.
    #[inline(always)]
    pub(crate) fn resized<const D: usize>(&self, n: usize) -> Evaluation<D> {
        let mut out = Evaluation {
            value: self.value,
            length_slope: self.length_slope,
            length_curvature: self.length_curvature,
            status: self.status,
            ..Evaluation::zero()
        };
        out.gradient[..n].copy_from_slice(&self.gradient[..n]);
        out.length_gradient[..n].copy_from_slice(&self.length_gradient[..n]);
        for k in 0..n {
            out.hessian[k][..n].copy_from_slice(&self.hessian[k][..n]);
        }
        out
    }

    /// Writes the gradient and the Hessian of `n` joints, with the length as entry n when `with_length`; what is not wanted is empty.
    #[inline(always)]
    pub(super) fn write(&self, n: usize, with_length: bool, gradient: &mut [f64], hessian: &mut [f64]) {
        let size = n + usize::from(with_length);
        if !gradient.is_empty() {
            gradient[..n].copy_from_slice(&self.gradient[..n]);
            if with_length {
                gradient[n] = self.length_slope;
            }
        }
        if hessian.is_empty() {
            return;
        }
        for k in 0..n {
            hessian[k * size..k * size + n].copy_from_slice(&self.hessian[k][..n]);
            if with_length {
                hessian[k * size + n] = self.length_gradient[k];
                hessian[n * size + k] = self.length_gradient[k];
            }
        }
        if with_length {
            hessian[n * size + n] = self.length_curvature;
        }
    }

    /// Adds `weight` times another evaluation of `n` joints.
    #[inline(always)]
    pub(crate) fn add(&mut self, weight: f64, other: &Self, n: usize, order: Order) {
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

/// Derivatives of phi with the length: what a normalised index adds when its length is a variable.
#[derive(Debug, Clone, Copy)]
pub struct LengthTerms<const C: usize> {
    /// d(phi)/dL.
    pub slope: f64,
    /// d(Y)/dL by columns.
    pub y: [Row6; C],
    /// d2(phi)/dL2.
    pub curvature: f64,
}

/// Value and slope of an index f(phi(J)), outer function and inner, at one posture or at several side by side. The number of rows `m` is an
/// argument everywhere so that the commonest, 6, is a constant and loops unroll.
pub trait FirstOrder<T: Real> {
    /// What value and derivatives share at a posture: blank at first and filled in place, for a copy costs a tenth of the whole.
    type Factors<const C: usize>: Default;

    /// The rows in use.
    fn rows(&self) -> &Rows;

    /// Factors the normalised Jacobian, into blank factors.
    fn factor<const C: usize>(&self, jacobian: &Jacobian<C, T>, m: usize, out: &mut Self::Factors<C>);

    /// f(phi), f'(phi), f''(phi).
    fn outer<const C: usize>(&self, factors: &Self::Factors<C>, m: usize) -> (T, T, T);

    /// How far the numbers of a lane can be used, whose value is given.
    fn status<const C: usize>(&self, factors: &Self::Factors<C>, value: f64, m: usize, lane: usize) -> Status;

    /// The limit of the value at a singularity.
    fn limit(&self) -> f64;

    /// Y = d(phi)/dJ by columns, all six rows.
    fn slope<const C: usize>(&self, factors: &Self::Factors<C>, n: usize, m: usize) -> [Row6<T>; C];
}

/// The second derivatives of an index: with [`FirstOrder`], all that has to be written down for a new one.
pub trait JacobianIndex: FirstOrder<f64> {
    /// Writes the second derivative of phi with respect to J, taken along `dJ/dq_k` and `dJ/dq_l` (k <= l).
    fn second<const C: usize>(&self, factors: &Self::Factors<C>, jacobian: &Jacobian<C>, m: usize, out: &mut [[f64; C]; C]);

    /// Whether phi(s J_n) = phi(J_n) for every s: such an index does not depend on the length where it multiplies all rows in use.
    fn is_scale_free(&self) -> bool {
        false
    }

    /// Derivatives with the length.
    fn length_terms<const C: usize>(&self, factors: &Self::Factors<C>, n: usize, m: usize) -> LengthTerms<C>;

    /// Whether a change of the length changes the index.
    #[inline(always)]
    fn depends_on_length(&self) -> bool {
        let angular = self.rows().angular();
        angular > 0 && !(self.is_scale_free() && angular == self.rows().count())
    }

    /// Value and derivatives with respect to the joints, into a zeroed `out`. One copy of every kernel, however many kinds share it.
    #[inline(never)]
    fn evaluate<const C: usize>(&self, jacobian: &Jacobian<C>, order: Order, with_length: bool, out: &mut Evaluation<C>) {
        match self.rows().count() {
            6 if unrolls::<C>() => evaluate_rows(self, jacobian, 6, order, with_length, out),
            m => evaluate_rows(self, jacobian, m, order, with_length, out),
        }
    }
}

/// Whether kernels for the commonest number of rows, 6, are compiled beside those for any number: for arms of 5 to 8 joints.
const fn unrolls<const C: usize>() -> bool {
    C == 6 || C == 8
}

/// One sweep over the chain for each of gradient and Hessian, then the outer function.
#[inline(always)]
fn evaluate_rows<const C: usize, I: JacobianIndex + ?Sized>(
    index: &I,
    jacobian: &Jacobian<C>,
    m: usize,
    order: Order,
    with_length: bool,
    out: &mut Evaluation<C>,
) {
    let n = jacobian.n();
    let mut factors = I::Factors::<C>::default();
    index.factor(jacobian, m, &mut factors);
    let (value, slope, curvature) = index.outer(&factors, m);
    out.value = value;
    out.status = index.status(&factors, value, m, 0);
    if out.status == Status::Singular {
        *out = Evaluation::without_derivatives(index.limit(), Status::Singular);
        return;
    }
    if order == Order::Value {
        return;
    }
    let y = index.slope(&factors, n, m);
    let gradient = pull_back(jacobian, &y);
    for k in 0..n {
        out.gradient[k] = slope * gradient[k];
    }
    if with_length && index.depends_on_length() {
        let length = index.length_terms(&factors, n, m);
        let mixed = pull_back(jacobian, &length.y);
        out.length_slope = slope * length.slope;
        out.length_curvature = slope * length.curvature + curvature * length.slope * length.slope;
        for k in 0..n {
            out.length_gradient[k] = slope * mixed[k] + curvature * length.slope * gradient[k];
        }
    }
    if order == Order::Hessian {
        add_hessian(index, &factors, jacobian, m, &y, (slope, curvature), &gradient, &mut out.hessian);
    }
}

/// The Hessian, apart: its code and its stack are large, and many a loop wants gradients only.
#[inline(never)]
fn add_hessian<const C: usize, I: JacobianIndex + ?Sized>(
    index: &I,
    factors: &I::Factors<C>,
    jacobian: &Jacobian<C>,
    m: usize,
    y: &[Row6; C],
    (slope, curvature): (f64, f64),
    gradient: &[f64; C],
    hessian: &mut [[f64; C]; C],
) {
    let n = jacobian.n();
    match m {
        6 if unrolls::<C>() => index.second(factors, jacobian, 6, hessian),
        m => index.second(factors, jacobian, m, hessian),
    }
    pull_back_second(jacobian, y, hessian);
    for k in 0..n {
        for l in k..n {
            let entry = slope * hessian[k][l] + curvature * gradient[k] * gradient[l];
            hessian[k][l] = entry;
            hessian[l][k] = entry;
        }
    }
}

/// Values and gradients of the postures side by side, of a robot without joints that follow others, added with a weight to `value` and `gradient`.
#[inline(always)]
pub fn add_first_order<const C: usize, T: Real, I: FirstOrder<T>>(
    index: &I,
    weight: f64,
    jacobian: &Jacobian<C, T>,
    order: Order,
    value: &mut T,
    gradient: &mut [T; C],
) {
    match index.rows().count() {
        6 if unrolls::<C>() => add_rows(index, weight, jacobian, 6, order, value, gradient),
        m => add_rows(index, weight, jacobian, m, order, value, gradient),
    }
}

#[inline(always)]
fn add_rows<const C: usize, T: Real, I: FirstOrder<T>>(
    index: &I,
    weight: f64,
    jacobian: &Jacobian<C, T>,
    m: usize,
    order: Order,
    value: &mut T,
    gradient: &mut [T; C],
) {
    let n = jacobian.n();
    let mut factors = I::Factors::<C>::default();
    index.factor(jacobian, m, &mut factors);
    let (own, slope, _) = index.outer(&factors, m);
    let singular: [bool; 8] =
        std::array::from_fn(|lane| lane < T::LANES && index.status(&factors, own.lane(lane), m, lane) == Status::Singular);
    let weight = T::splat(weight);
    *value += weight * T::from_lanes(|lane| if singular[lane] { index.limit() } else { own.lane(lane) });
    if order >= Order::Gradient {
        let pulled = pull_back_of(jacobian, &index.slope(&factors, n, m));
        for k in 0..n {
            let entry = slope * pulled[k];
            gradient[k] += weight * T::from_lanes(|lane| if singular[lane] { f64::NAN } else { entry.lane(lane) });
        }
    }
}
