//! A step of the SQP at limits on combinations of joints and at bounds of a volume: the curvature of what they leave.

use super::{Bounds, Known, MAX_STEP_ROWS, NewtonStep};
use crate::linalg::MAX_JOINTS;
use crate::linalg::cholesky::Cholesky;
use crate::qp::DenseRow;
use crate::resolve::StepStatus;
use crate::task::volume::MAX_SIDES;

/// A step this near to a limit of a combination, relative to the sizes that it is made of, stands at it.
const AT: f64 = 1e-10;

/// What holds a posture against the gradient: rows of the task, of combinations at their limits, of joints at theirs, in the room for the largest robots.
struct Holds {
    rows: [[f64; MAX_JOINTS]; MAX_JOINTS],
    count: usize,
}

impl Holds {
    /// One row more; whether there is room for it.
    fn push(&mut self, row: &[f64]) -> bool {
        let room = self.count < MAX_JOINTS;
        if room {
            self.rows[self.count][..row.len()].copy_from_slice(row);
            self.count += 1;
        }
        room
    }

    /// The forces along the rows that are nearest to a gradient; `None` where the rows depend on each other.
    #[inline(never)]
    fn forces(&self, gradient: &[f64]) -> Option<[f64; MAX_JOINTS]> {
        let inner = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (mut products, mut along) = ([[0.0; MAX_JOINTS]; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for j in 0..self.count {
            for l in 0..self.count {
                products[j][l] = inner(&self.rows[j], &self.rows[l]);
            }
            along[j] = inner(&self.rows[j], gradient);
        }
        Some(Cholesky::new(&products, self.count)?.solve(&along))
    }
}

/// The bounds of a volume among the rows of a step: from which on, and their second derivatives with weights.
pub(super) type Bend<'a> = (usize, &'a dyn Fn(&[f64; MAX_SIDES]) -> [[f64; MAX_JOINTS]; MAX_JOINTS]);

/// The step with the combinations and bounds of a volume whose limits it goes to held there: they take their part of the gradient, so that the forces of the task, and with them the
/// curvature, are those at the minimum, and convergence is quadratic. The step as it is where it goes to none. A force needs few digits: it only tells of the
/// curvature.
#[cold]
#[inline(never)]
pub(super) fn pressed<const C: usize>(
    known: &Known<'_, C>,
    bounds: &Bounds<'_, C>,
    step: NewtonStep<C>,
    bend: Option<Bend<'_>>,
    again: impl Fn(&Known<'_, C>, &Bounds<'_, C>) -> NewtonStep<C>,
) -> NewtonStep<C> {
    let (n, m) = (known.jacobian.n(), known.constraint.dimension());
    let mut rows = [DenseRow::<C>::OPEN; MAX_STEP_ROWS];
    rows[..bounds.rows.len()].copy_from_slice(bounds.rows);
    let rows = &mut rows[..bounds.rows.len()];
    let mut holds = Holds { rows: [[0.0; MAX_JOINTS]; MAX_JOINTS], count: 0 };
    let mut room = true;
    for row in known.constraint.jacobian(known.jacobian).iter().take(m) {
        room &= holds.push(&row[..n]);
    }
    let (first, mut which, mut straight) = (bend.map_or(rows.len(), |bend| bend.0), [0; MAX_JOINTS], false);
    for (k, row) in rows.iter_mut().enumerate() {
        let (mut value, mut size) = (0.0, f64::EPSILON);
        for i in 0..n {
            value += row.a[i] * step.dq[i];
            size += (row.a[i] * step.dq[i]).abs();
        }
        let end = if value - row.lower <= row.upper - value { row.lower } else { row.upper };
        if (value - end).abs() <= AT * size {
            (row.lower, row.upper) = (end, end);
            straight |= k < first;
            if holds.count < MAX_JOINTS {
                which[holds.count] = k;
            }
            room &= holds.push(&row.a[..n]);
        }
    }
    let combinations = m..holds.count;
    // Joints that stand at their own limits hold their part of it.
    for i in (0..n).filter(|i| step.held >> i & 1 == 1) {
        room &= holds.push(&std::array::from_fn::<f64, MAX_JOINTS, _>(|k| f64::from(u8::from(k == i)))[..n]);
    }
    if combinations.is_empty() || !room {
        return step;
    }
    let Some(forces) = holds.forces(&known.objective.gradient[..n]) else { return step };
    let mut objective = *known.objective;
    for j in combinations.clone() {
        for i in 0..n {
            objective.gradient[i] -= forces[j] * holds.rows[j][i];
        }
    }
    if let Some((first, bend)) = bend {
        let mut weights = [0.0; MAX_SIDES];
        for j in combinations.clone().filter(|j| which[*j] >= first) {
            weights[which[j] - first] = forces[j];
        }
        let curvature = bend(&weights);
        for i in 0..n {
            for k in 0..n {
                objective.hessian[i][k] -= curvature[i][k];
            }
        }
    }
    let mut out = again(&Known { objective: &objective, ..*known }, &Bounds { rows, ..*bounds });
    for j in combinations {
        out.slope += forces[j] * (0..n).map(|i| holds.rows[j][i] * out.dq[i]).sum::<f64>();
    }
    if !(out.free > 0.0 && out.slope < 0.0) {
        return step;
    }
    // A minimum at a bound of the task's own is one.
    let status = if straight || step.held != 0 { StepStatus::Limited } else { StepStatus::Regular };
    NewtonStep { status, ..out }
}
