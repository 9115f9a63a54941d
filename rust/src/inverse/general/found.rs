//! Solutions of a loop, each once.

/// Two solutions this near to each other are one [rad].
const SAME: f64 = 2e-7;

/// The solutions found so far.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    q: [[f64; 6]; Found::MOST],
    count: usize,
}

impl Found {
    /// The most solutions a loop has, if they are not infinitely many (Primrose 1986).
    const MOST: usize = 16;

    /// None yet.
    pub fn none() -> Self {
        Self { q: [[0.0; 6]; Self::MOST], count: 0 }
    }

    /// Adds one that is not there yet.
    pub fn add(&mut self, q: &[f64; 6]) {
        let same = |a: &[f64; 6]| (0..6).all(|i| (0.5 * (a[i] - q[i])).sin().abs() <= 0.5 * SAME);
        if self.count < Self::MOST && !self.solutions().iter().any(same) {
            self.q[self.count] = *q;
            self.count += 1;
        }
    }

    /// All of them.
    pub fn solutions(&self) -> &[[f64; 6]] {
        &self.q[..self.count]
    }
}
