//! Many postures: several side by side in a vector register, on the widest registers the machine has.

use super::evaluate::Order;
use super::objective::{Index, Objective};
use crate::error::{Error, Result, check_length};
use crate::kinematics::sized::jacobian_of;
use crate::linalg::real::{Lanes, Real};
use crate::linalg::size;
use crate::linalg::with_capacity;
use crate::robot::Robot;

/// Where the answers go: one entry, one row of n and one of n x n a posture, with the length as one more variable n + 1. Derivatives that are
/// not wanted are empty.
#[derive(Debug)]
pub struct Answers<'a> {
    /// Values.
    pub values: &'a mut [f64],
    /// Gradients.
    pub gradients: &'a mut [f64],
    /// Hessians.
    pub hessians: &'a mut [f64],
}

impl Answers<'_> {
    fn order(&self) -> Order {
        Order::wanted(self.gradients, self.hessians)
    }

    fn check(&self, count: usize, size: usize) -> Result<()> {
        check_length("values", self.values, count)?;
        if !self.gradients.is_empty() {
            check_length("gradients", self.gradients, count * size)?;
        }
        if self.hessians.is_empty() { Ok(()) } else { check_length("hessians", self.hessians, count * size * size) }
    }
}

impl Objective {
    /// Values and derivatives at the postures `q`, n numbers each, with the length as variable n where `with_length`; bit for bit what
    /// [`Objective::evaluate`] answers for each of them.
    pub fn evaluate_many(&self, robot: &Robot, q: &[f64], with_length: bool, out: &mut Answers) -> Result<()> {
        let n = robot.n();
        if !q.len().is_multiple_of(n) {
            return Err(Error::length("q", q.len(), q.len() / n * n));
        }
        self.check(robot)?;
        out.check(q.len() / n, n + usize::from(with_length))?;
        with_capacity!(n, many(self, robot, q, with_length, out));
        Ok(())
    }

    /// Values alone; NaN where the objective does not fit the robot.
    pub(crate) fn values_of(&self, robot: &Robot, q: &[f64], values: &mut [f64]) {
        let out = &mut Answers { values, gradients: &mut [], hessians: &mut [] };
        if self.evaluate_many(robot, q, false, out).is_err() {
            out.values.fill(f64::NAN);
        }
    }

    fn one_by_one<const C: usize>(&self, robot: &Robot, q: &[f64], with_length: bool, out: &mut Answers) {
        let (n, order) = (robot.n(), out.order());
        let size = n + usize::from(with_length);
        for (i, q) in q.chunks_exact(n).enumerate() {
            let got = self.evaluate_sized::<C>(robot, q, order, with_length);
            let gradient = out.gradients.get_mut(i * size..(i + 1) * size).unwrap_or_default();
            let hessian = out.hessians.get_mut(i * size * size..(i + 1) * size * size).unwrap_or_default();
            out.values[i] = got.value;
            got.write(n, with_length, gradient, hessian);
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn side_by_side_avx2<const C: usize>(&self, robot: &Robot, q: &[f64], out: &mut Answers) {
        self.side_by_side::<C, Lanes>(robot, q, out);
    }

    #[inline(always)]
    fn side_by_side<const C: usize, T: Real>(&self, robot: &Robot, q: &[f64], out: &mut Answers) {
        let (n, order) = (size::<C>(robot.n()), out.order());
        let count = q.len() / n;
        for first in (0..count).step_by(T::LANES) {
            let used = T::LANES.min(count - first);
            // The last posture fills the lanes that are left over.
            let mut joints = [T::ZERO; C];
            for k in 0..n {
                joints[k] = T::from_lanes(|lane| q[(first + lane.min(used - 1)) * n + k]);
            }
            let (_, jacobian) = jacobian_of::<C, T>(robot, &joints[..n]);
            let (mut value, mut gradient) = (T::ZERO, [T::ZERO; C]);
            for (weight, index) in self.terms() {
                if let Index::OfJacobian(index) = index {
                    index.add_first_order(*weight, &jacobian, order, &mut value, &mut gradient);
                }
            }
            for lane in 0..used {
                out.values[first + lane] = value.lane(lane);
            }
            if order >= Order::Gradient {
                for lane in 0..used {
                    for k in 0..n {
                        out.gradients[(first + lane) * n + k] = gradient[k].lane(lane);
                    }
                }
            }
        }
    }
}

fn many<const C: usize>(objective: &Objective, robot: &Robot, q: &[f64], with_length: bool, out: &mut Answers) {
    let lanes = objective.terms().iter().all(|(_, index)| matches!(index, Index::OfJacobian(index) if index.kind.has_lanes()));
    if with_length || out.order() == Order::Hessian || !lanes || robot.coupling().is_some() {
        return objective.one_by_one::<C>(robot, q, with_length, out);
    }
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has been asked.
        unsafe { objective.side_by_side_avx2::<C>(robot, q, out) }
    } else {
        objective.one_by_one::<C>(robot, q, with_length, out);
    }
    #[cfg(not(target_arch = "x86_64"))]
    objective.side_by_side::<C, Lanes>(robot, q, out);
}
