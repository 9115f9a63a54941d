//! What an inverse solver finds.

use crate::robot::nearest_turn;

/// A chain of six revolute joints has at most 16 solutions (Primrose 1986).
pub const MAX_SOLUTIONS: usize = 16;

/// Two solutions this near to each other [rad] are one.
const SAME: f64 = 1e-7;

/// Every solution of one target, without allocation.
#[derive(Debug, Clone, Copy)]
pub struct Solutions<const N: usize = 6> {
    /// Joints \[rad\]; the first `count` rows count.
    pub q: [[f64; N]; MAX_SOLUTIONS],
    /// Which branch of the closed form each one is on: the same along a continuous motion that crosses no singularity.
    pub branch: [u8; MAX_SOLUTIONS],
    /// Whether it stands at a singularity, where branches meet or a joint may be chosen.
    pub singular: [bool; MAX_SOLUTIONS],
    /// How many there are.
    pub count: usize,
    /// Whether there are no others.
    pub complete: bool,
}

impl<const N: usize> Solutions<N> {
    /// None yet.
    pub const NONE: Self =
        Self { q: [[0.0; N]; MAX_SOLUTIONS], branch: [0; MAX_SOLUTIONS], singular: [false; MAX_SOLUTIONS], count: 0, complete: true };

    /// Adds a candidate; what does not fit any more is told as incomplete.
    #[inline(always)]
    pub fn push(&mut self, q: [f64; N], branch: u8, singular: bool) {
        if self.count == MAX_SOLUTIONS {
            self.complete = false;
            return;
        }
        (self.q[self.count], self.branch[self.count], self.singular[self.count]) = (q, branch, singular);
        self.count += 1;
    }

    /// Keeps what `keep` says, which may mend a solution.
    #[inline(always)]
    pub fn retain(&mut self, mut keep: impl FnMut(&mut [f64; N], &mut bool) -> bool) {
        let mut kept = 0;
        for i in 0..self.count {
            let (mut q, mut singular) = (self.q[i], self.singular[i]);
            if keep(&mut q, &mut singular) {
                (self.q[kept], self.branch[kept], self.singular[kept]) = (q, self.branch[i], singular);
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// Of those that are the same up to whole turns, keeps the first and tells that branches meet in it.
    #[inline(always)]
    pub fn merge_twins(&mut self) {
        let mut kept = 0;
        for i in 0..self.count {
            match (0..kept).find(|&j| same(&self.q[i], &self.q[j], SAME)) {
                Some(twin) => self.singular[twin] = true,
                None => {
                    (self.q[kept], self.branch[kept], self.singular[kept]) = (self.q[i], self.branch[i], self.singular[i]);
                    kept += 1;
                }
            }
        }
        self.count = kept;
    }
}

/// Whether two postures are the same up to whole turns.
#[inline(always)]
fn same<const N: usize>(a: &[f64; N], b: &[f64; N], tolerance: f64) -> bool {
    (0..N).all(|k| nearest_turn(a[k] - b[k], 0.0).abs() <= tolerance)
}
