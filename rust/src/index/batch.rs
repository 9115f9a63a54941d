//! Many postures: several side by side in a vector register, on the widest registers the machine has.

use super::evaluate::{Order, add_first_order};
use super::objective::{Index, Objective};
use crate::kinematics::jacobian_of;
use crate::linalg::real::{Lanes, Real};
use crate::linalg::size;
use crate::robot::Robot;

/// Where the answers go: one entry, one row of n and one of n x n a posture. Those that the order does not ask for may be empty.
#[derive(Debug)]
pub struct Answers<'a> {
    /// Values.
    pub values: &'a mut [f64],
    /// Gradients.
    pub gradients: &'a mut [f64],
    /// Hessians.
    pub hessians: &'a mut [f64],
}

impl Objective {
    /// Values and derivatives at the postures `q`, n numbers each; bit for bit what [`Objective::evaluate`] answers for each of them.
    pub fn evaluate_many<const C: usize>(&self, robot: &Robot, q: &[f64], order: Order, out: &mut Answers) {
        let smooth = self.terms().iter().all(|(_, index)| matches!(index, Index::Condition(_) | Index::Manipulability(_)));
        if order == Order::Hessian || !smooth {
            return self.one_by_one::<C>(robot, q, order, out);
        }
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the machine has been asked.
            unsafe { self.side_by_side_avx2::<C>(robot, q, order, out) }
        } else {
            self.one_by_one::<C>(robot, q, order, out);
        }
        #[cfg(not(target_arch = "x86_64"))]
        self.side_by_side::<C, Lanes>(robot, q, order, out);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn side_by_side_avx2<const C: usize>(&self, robot: &Robot, q: &[f64], order: Order, out: &mut Answers) {
        self.side_by_side::<C, Lanes>(robot, q, order, out);
    }

    fn one_by_one<const C: usize>(&self, robot: &Robot, q: &[f64], order: Order, out: &mut Answers) {
        let n = robot.n();
        for (i, q) in q.chunks_exact(n).enumerate() {
            let got = self.evaluate::<C>(robot, q, order, false);
            out.values[i] = got.value;
            if order >= Order::Gradient {
                out.gradients[i * n..(i + 1) * n].copy_from_slice(&got.gradient[..n]);
            }
            if order == Order::Hessian {
                for k in 0..n {
                    out.hessians[(i * n + k) * n..(i * n + k + 1) * n].copy_from_slice(&got.hessian[k][..n]);
                }
            }
        }
    }

    #[inline(always)]
    fn side_by_side<const C: usize, T: Real>(&self, robot: &Robot, q: &[f64], order: Order, out: &mut Answers) {
        let n = size::<C>(robot.n());
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
                match index {
                    Index::Condition(index) => add_first_order(index, *weight, &jacobian, order, &mut value, &mut gradient),
                    Index::Manipulability(index) => add_first_order(index, *weight, &jacobian, order, &mut value, &mut gradient),
                    _ => {}
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
