//! The orientations of a tool that are on a grid: turned about its axis, and where the task is a volume tilted within that.

use super::grid::angle_grid;
use super::settings::PlanSettings;
use crate::error::{Error, Result};
use crate::linalg::frame::Frame;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, dot};
use crate::task::volume::{OrientationVolume, Range, Shape};

/// Angle from one ring of tilts to the next, about \[rad\], and how many there are at most.
const RING: f64 = 0.27;
const RINGS: usize = 3;
/// Headings of a ring.
const HEADINGS: usize = 8;
/// Angles of the rotations of a product.
const FACTORS: (usize, usize, usize) = (4, 4, 12);
/// Members nearer to each other than this many times the largest distance from one to the next are neighbours.
const NEAR: f64 = 1.6;
/// Which part of the spins that are asked for there is beside the tilts of a volume.
const SHARE: usize = 2;
/// Cosine between a volume's axis and z from which on they are one.
const ALONG: f64 = 1.0 - 1e-12;

/// Orientations relative to the frame of a point.
#[derive(Debug, Clone)]
pub struct Members {
    /// Spins of the grid \[rad\]; one where the tilts have their own.
    pub angles: Vec<f64>,
    /// Whether the spins go round.
    pub around: bool,
    /// For every tilt all spins.
    pub turns: Vec<Frame>,
    /// Of every tilt those that are next to it, with itself.
    pub near: Vec<Vec<usize>>,
    /// Of every tilt how far it is, and its heading \[rad\]; of a product its first two angles.
    pub directions: Vec<[f64; 2]>,
    /// The axis of the spin.
    pub axis: Vec3,
}

impl Members {
    /// Turns about an axis by some angles.
    pub fn spins(axis: Vec3, angles: &[f64], around: bool) -> Self {
        let turns = angles.iter().map(|angle| Frame::rotation(axis, *angle)).collect();
        Self { angles: angles.to_vec(), around, turns, near: vec![vec![0]], directions: vec![[0.0; 2]], axis }
    }

    /// On the grid of a plan, `finer` times as many spins as the settings say; `spins` tells whether they are on the grid at all.
    ///
    /// # Errors
    /// [`Error::Value`] as [`angle_grid`].
    pub fn of(volume: Option<&OrientationVolume>, axis: Vec3, spins: bool, finer: usize, settings: &PlanSettings) -> Result<Self> {
        let Some(volume) = volume else {
            let angles = angle_grid(spins, settings.n_angles * finer, settings.spin_range)?;
            return Ok(Self::spins(axis, &angles, settings.spin_range.is_none()));
        };
        let range = if volume.spin().is_free() { None } else { Some((volume.spin().low, volume.spin().high)) };
        let product = matches!(volume.shape(), Shape::Product(_));
        let angles = angle_grid(spins && !product, (settings.n_angles * finer).div_ceil(SHARE), range)?;
        let steepest = volume.grid(1, HEADINGS, 1).iter().fold(0.0f64, |most, member| most.max(member.tilt));
        let rings = ((steepest / RING).ceil() as usize).clamp(1, RINGS);
        Ok(Self::within(volume, &angles, rings, HEADINGS))
    }

    /// Of a volume, so many rings of tilts, each of some headings, all with some spins; of a product, whose angles hold its spins, as many as there are angles.
    pub fn within(volume: &OrientationVolume, angles: &[f64], rings: usize, headings: usize) -> Self {
        let product = matches!(volume.shape(), Shape::Product(_));
        let members = if product { volume.grid(FACTORS.0, FACTORS.1, FACTORS.2) } else { volume.grid(rings, headings, 1) };
        let turned = |angle: f64, from: f64| Quaternion::about([0.0, 0.0, 1.0], angle - from);
        let frame = |q: Quaternion| Frame { axes: q.axes(), origin: [0.0; 3] };
        let all = members.iter().flat_map(|member| {
            let of = move |angle: &f64| if product { member.orientation } else { member.orientation.product(&turned(*angle, member.spin)) };
            angles.iter().map(of).collect::<Vec<_>>()
        });
        Self {
            turns: all.map(frame).collect(),
            around: volume.spin().is_free(),
            near: neighbours(&members.iter().map(|member| member.orientation).collect::<Vec<_>>()),
            directions: members.iter().map(|member| [member.tilt, member.heading]).collect(),
            angles: angles.to_vec(),
            axis: [0.0, 0.0, 1.0],
        }
    }

    /// The number of tilts.
    pub fn tilts(&self) -> usize {
        self.near.len()
    }

    /// The orientation that is nearest to one: the number of its tilt and of its spin.
    pub fn nearest(&self, turn: &Frame) -> (usize, usize) {
        let alike = |other: &Frame| (0..3).map(|i| dot(other.axes[i], turn.axes[i])).sum::<f64>();
        let best = (0..self.turns.len()).fold(0, |best, i| if alike(&self.turns[i]) > alike(&self.turns[best]) { i } else { best });
        (best / self.angles.len(), best % self.angles.len())
    }
}

/// Of every orientation those next to it.
fn neighbours(all: &[Quaternion]) -> Vec<Vec<usize>> {
    let apart = |i: usize, j: usize| all[i].angle_to(&all[j]);
    let nearest = |i: usize| (0..all.len()).filter(|&j| j != i).map(|j| apart(i, j)).fold(f64::INFINITY, f64::min);
    let reach = (0..all.len()).map(nearest).filter(|least| least.is_finite()).fold(0.0, f64::max) * NEAR;
    (0..all.len()).map(|i| (0..all.len()).filter(|&j| j == i || apart(i, j) <= reach).collect()).collect()
}

/// The orientation in the middle of a volume.
pub(super) fn middle(volume: &OrientationVolume) -> Quaternion {
    let about = |q: Quaternion, axis: Vec3, angle: f64| q.product(&Quaternion::about(axis, angle));
    match volume.shape() {
        Shape::Product(factors) => factors.iter().fold(volume.reference(), |q, factor| about(q, factor.axis, factor.range.middle())),
        _ => about(volume.reference(), [0.0, 0.0, 1.0], volume.spin().middle()),
    }
}

/// The spins of a volume that leaves the tool no tilt: `None` if it leaves one.
pub(super) fn without_tilt(volume: &OrientationVolume) -> Option<Range> {
    match volume.shape() {
        Shape::Cone(tilt) => (*tilt == 0.0).then_some(volume.spin()),
        Shape::Pyramid(tilts) | Shape::Square(tilts) => (*tilts == [0.0; 2]).then_some(volume.spin()),
        Shape::Product(factors) => match &factors[..] {
            [one] if one.axis[2].abs() >= ALONG => {
                let Range { low, high } = one.range;
                Some(if one.axis[2] > 0.0 { one.range } else { Range { low: -high, high: -low } })
            }
            _ => None,
        },
    }
}

/// The spins that a volume leaves a tool along its own axis, where that is a member.
pub(super) fn upright(volume: &OrientationVolume) -> Option<Range> {
    without_tilt(volume).or(match volume.shape() {
        Shape::Product(_) => None,
        _ => Some(volume.spin()),
    })
}

/// Whether a volume looks at the direction of the tool's axis alone, so that the axes of a path are enough.
pub(super) fn is_axial(volume: &OrientationVolume) -> bool {
    matches!(volume.shape(), Shape::Cone(_)) && volume.spin().is_free() && volume.reference().rotate([0.0, 0.0, 1.0])[2] >= ALONG
}

/// Why a volume cannot be planned for.
///
/// # Errors
/// [`Error::Value`].
pub(super) fn check(volume: &OrientationVolume) -> Result<()> {
    volume.check_as_task()?;
    if volume.freedoms() < 3 {
        let given = format!("one of the kind '{}' that leaves the orientation {} of 3 freedoms", volume.kind(), volume.freedoms());
        return Err(Error::value("volume", given, "tilts about x and y and a spin that are all above 0 for a plan"));
    }
    Ok(())
}
