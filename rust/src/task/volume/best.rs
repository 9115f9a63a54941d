//! The nearest of several members.

use crate::linalg::quaternion::Quaternion;

/// Distances \[rad\] that differ by less are the same.
const SAME_DISTANCE: f64 = 1e-12;

/// Members \[rad\] apart that are not the same one found twice.
const OTHER: f64 = 1e-5;

/// The member nearest to an orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The member, of the two quaternions the nearer one.
    pub orientation: Quaternion,
    /// The smallest angle \[rad\] of a rotation to it.
    pub distance: f64,
    /// Whether no other member is as near.
    pub unique: bool,
}

/// The nearest of the members offered so far.
pub(super) struct Best {
    wanted: Quaternion,
    found: Option<Nearest>,
}

impl Best {
    pub(super) fn to(wanted: &Quaternion) -> Self {
        Self { wanted: *wanted, found: None }
    }

    pub(super) fn distance(&self) -> f64 {
        self.found.map_or(f64::INFINITY, |found| found.distance)
    }

    /// One more member.
    pub(super) fn offer(&mut self, member: Quaternion) {
        let distance = member.angle_to(&self.wanted);
        let one = Nearest { orientation: member, distance, unique: true };
        match &mut self.found {
            Some(found) if distance >= found.distance + SAME_DISTANCE => {}
            Some(found) if distance > found.distance - SAME_DISTANCE => {
                let other = member.angle_to(&found.orientation) > OTHER;
                let unique = found.unique && !other;
                *found = if distance < found.distance { Nearest { unique, ..one } } else { Nearest { unique, ..*found } };
            }
            found => *found = Some(one),
        }
    }

    /// The nearest, but not the only one.
    pub(super) fn tie(&mut self) {
        if let Some(found) = &mut self.found {
            found.unique = false;
        }
    }

    /// The nearest, if one was offered.
    pub(super) fn nearest(&self) -> Option<Nearest> {
        self.found.map(|found| {
            let near = found.orientation.dot(&self.wanted) >= 0.0;
            Nearest { orientation: if near { found.orientation } else { found.orientation.opposite() }, ..found }
        })
    }
}
