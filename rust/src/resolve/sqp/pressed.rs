//! A step of the SQP at limits on combinations of joints: the curvature of what they leave.

use super::{Bounds, Known, NewtonStep};
use crate::linalg::MAX_JOINTS;
use crate::linalg::cholesky::Cholesky;
use crate::linalg::orthogonal::Orthogonal;
use crate::qp::DenseRow;
use crate::resolve::StepStatus;
use crate::robot::MAX_COMBINATIONS;

/// A step this near to a limit of a combination, relative to the sizes that it is made of, stands at it.
const AT: f64 = 1e-10;

/// The step with the combinations whose limits it goes to held there: they take their part of the gradient, so that the forces of the task, and with them the
/// curvature, are those at the minimum, and convergence is quadratic. The step as it is where it goes to none.
#[cold]
#[inline(never)]
pub(super) fn pressed<const C: usize>(
    known: &Known<'_, C>,
    bounds: &Bounds<'_, C>,
    step: NewtonStep<C>,
    again: impl Fn(&Known<'_, C>, &Bounds<'_, C>) -> NewtonStep<C>,
) -> NewtonStep<C> {
    let n = known.jacobian.n();
    let inner = |a: &[f64; C], b: &[f64; C]| (0..n).map(|i| a[i] * b[i]).sum::<f64>();
    let mut rows = [DenseRow::<C>::OPEN; MAX_COMBINATIONS];
    rows[..bounds.rows.len()].copy_from_slice(bounds.rows);
    let mut active = [0; MAX_COMBINATIONS];
    let mut count = 0;
    for (k, row) in rows[..bounds.rows.len()].iter_mut().enumerate() {
        let value = inner(&row.a, &step.dq);
        let size = (0..n).fold(f64::EPSILON, |sum, i| sum + (row.a[i] * step.dq[i]).abs());
        let end = if value >= 0.0 { row.upper } else { row.lower };
        if (value - end).abs() <= AT * size {
            (row.lower, row.upper) = (end, end);
            active[count] = k;
            count += 1;
        }
    }
    if count == 0 {
        return step;
    }
    // The gradient along the free motion as far as the combinations hold it.
    let m = known.constraint.dimension();
    let basis = Orthogonal::new(&known.constraint.jacobian(known.jacobian), n, m).null_space();
    let free = |a: &[f64; C]| -> [f64; C] { std::array::from_fn(|z| if z + m < n { inner(a, &basis[z]) } else { 0.0 }) };
    let slopes = free(&known.objective.gradient);
    let mut normals = [[0.0; C]; MAX_JOINTS];
    let mut all = count;
    for (normal, k) in normals.iter_mut().zip(&active[..count]) {
        *normal = free(&rows[*k].a);
    }
    // Joints that stand at their own limits hold their part of it.
    for i in (0..n).filter(|i| step.held >> i & 1 == 1) {
        if all < MAX_JOINTS {
            normals[all] = free(&std::array::from_fn(|k| f64::from(u8::from(k == i))));
            all += 1;
        }
    }
    let (mut products, mut along) = ([[0.0; MAX_JOINTS]; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for j in 0..all {
        for l in 0..all {
            products[j][l] = inner(&normals[j], &normals[l]);
        }
        along[j] = inner(&normals[j], &slopes);
    }
    let Some(factor) = Cholesky::<MAX_JOINTS>::new(&products, all) else { return step };
    let forces = factor.solve(&along);
    let mut objective = *known.objective;
    for j in 0..count {
        for i in 0..n {
            objective.gradient[i] -= forces[j] * rows[active[j]].a[i];
        }
    }
    let held = Bounds { rows: &rows[..bounds.rows.len()], ..*bounds };
    let mut out = again(&Known { objective: &objective, ..*known }, &held);
    out.slope += (0..count).map(|j| forces[j] * inner(&rows[active[j]].a, &out.dq)).sum::<f64>();
    if !(out.free > 0.0 && out.slope < 0.0) {
        return step;
    }
    NewtonStep { status: StepStatus::Limited, ..out }
}
