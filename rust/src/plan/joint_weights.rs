//! What the squared motion of joints sums: each joint's square times its weight.

use std::sync::Arc;

use super::numbers::shown;
use crate::error::{Error, Result};

/// Weights of the joints in the motion, one a joint: 1 unless given.
#[derive(Debug, Clone, PartialEq)]
pub struct JointWeights(Arc<[f64]>);

impl JointWeights {
    /// Of `n` joints.
    ///
    /// # Errors
    /// [`Error::Shape`] unless there is one for every joint; else as for [`JointWeights::check`].
    pub fn new(n: usize, given: Option<&[f64]>) -> Result<Self> {
        let Some(given) = given else { return Ok(Self(vec![1.0; n].into())) };
        if given.len() != n {
            return Err(Error::length("joint_weights", given.len(), n));
        }
        Self::check(given)?;
        Ok(Self(given.into()))
    }

    /// Checks weights of any number of joints.
    ///
    /// # Errors
    /// [`Error::Value`] if one is negative or not finite, or all are 0.
    pub fn check(given: &[f64]) -> Result<()> {
        if let Some(joint) = given.iter().position(|weight| !(*weight >= 0.0 && weight.is_finite())) {
            return Err(Error::value(&format!("joint_weights[{joint}]"), shown(given[joint]), "a finite number of at least 0"));
        }
        if given.iter().all(|weight| *weight == 0.0) {
            return Err(Error::value("joint_weights", "all of them 0", "one above 0 at least"));
        }
        Ok(())
    }

    /// The weight of a joint.
    #[inline(always)]
    pub fn of(&self, joint: usize) -> f64 {
        self.0[joint]
    }

    /// The weighted square of the motion of one joint.
    #[inline(always)]
    pub fn square(&self, joint: usize, motion: f64) -> f64 {
        self.0[joint] * (motion * motion)
    }

    /// The weighted squared motion of all joints.
    #[inline(always)]
    pub fn squares(&self, motion: impl Fn(usize) -> f64) -> f64 {
        (0..self.0.len()).map(|joint| self.square(joint, motion(joint))).sum()
    }
}
