//! Names of constraints and sets of them.

/// Which constraint of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The bounds of a variable.
    Bound(usize),
    /// A row.
    Row(usize),
}

/// Which of its two limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// At least.
    Lower,
    /// At most.
    Upper,
}

impl Side {
    /// Turns `a'x <= u` into `-a'x >= -u`, and back.
    #[inline(always)]
    pub fn sign(self) -> f64 {
        match self {
            Self::Lower => 1.0,
            Self::Upper => -1.0,
        }
    }
}

/// One inequality of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Constraint {
    /// Which constraint.
    pub place: Place,
    /// Which of its limits; that of an equality means nothing.
    pub side: Side,
}

/// At most `N` constraints: those that hold with equality at a solution, or a guess of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ActiveSet<const N: usize> {
    items: [Constraint; N],
    count: usize,
}

impl<const N: usize> Default for ActiveSet<N> {
    #[inline(always)]
    fn default() -> Self {
        Self { items: [Constraint { place: Place::Bound(0), side: Side::Lower }; N], count: 0 }
    }
}

impl<const N: usize> ActiveSet<N> {
    /// The constraints, in the order of their multipliers.
    #[inline(always)]
    pub fn as_slice(&self) -> &[Constraint] {
        &self.items[..self.count]
    }

    /// Constraints in the set.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether either limit of a constraint is in the set.
    pub fn contains(&self, place: Place) -> bool {
        self.as_slice().iter().any(|item| item.place == place)
    }

    /// Adds a constraint; `false` when the set is full.
    pub fn push(&mut self, item: Constraint) -> bool {
        let room = self.count < N;
        if room {
            self.items[self.count] = item;
            self.count += 1;
        }
        room
    }

    /// Takes out the constraint at `k`; those after it move up.
    pub(super) fn remove(&mut self, k: usize) {
        self.items.copy_within(k + 1..self.count, k);
        self.count -= 1;
    }
}
