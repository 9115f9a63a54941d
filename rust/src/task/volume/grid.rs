//! Members on a grid, for searches.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{OrientationVolume, Shape};
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::Vec3;

/// A member of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// Relative to the frame of the volume's user: the reference is in it.
    pub orientation: Quaternion,
    /// How far the tool's axis is tilted \[rad\], of a product its first angle.
    pub tilt: f64,
    /// Towards which heading, from x to y \[rad\], of a product its second angle.
    pub heading: f64,
    /// The spin \[rad\], of a product its third angle.
    pub spin: f64,
}

/// The direction tilted towards a heading.
fn direction(tilt: f64, heading: f64) -> Vec3 {
    let ((s, c), (sh, ch)) = (tilt.sin_cos(), heading.sin_cos());
    [s * ch, s * sh, c]
}

/// The shortest rotation of z onto a direction.
pub(super) fn swing(direction: Vec3) -> Quaternion {
    let [x, y, z] = direction;
    // By half angles, so that half a turn has an axis.
    let sine = x.hypot(y);
    let (s, c) = (0.5 * sine.atan2(z)).sin_cos();
    if sine > 0.0 { Quaternion([c, -s * y / sine, s * x / sine, 0.0]) } else { Quaternion([c, s, 0.0, 0.0]) }
}

/// Qx(a) Qy(b) that turns z onto a direction.
pub(super) fn tilts(direction: Vec3) -> Quaternion {
    let [x, y, z] = direction;
    let (a, b) = ((-y).atan2(z), x.atan2(y.hypot(z)));
    Quaternion::about([1.0, 0.0, 0.0], a).product(&Quaternion::about([0.0, 1.0, 0.0], b))
}

impl OrientationVolume {
    /// A member from a direction of the tool's axis and a spin, seen in the reference.
    pub(super) fn member(&self, direction: Vec3, spin: f64) -> Quaternion {
        let leaning = if matches!(self.shape, Shape::Pyramid(_)) { tilts(direction) } else { swing(direction) };
        leaning.product(&Quaternion::about([0.0, 0.0, 1.0], spin))
    }

    /// How far a direction may be tilted towards a heading, by up to a quarter turn but for cones.
    fn reach(&self, heading: f64) -> f64 {
        let (along_x, along_y) = (heading.cos().abs(), heading.sin().abs());
        let band = |tilt: f64, along: f64| if tilt.sin() < along { (tilt.sin() / along).asin() } else { FRAC_PI_2 };
        match &self.shape {
            Shape::Cone(tilt) => *tilt,
            // Lines, along themselves.
            Shape::Pyramid([x, y]) | Shape::Square([x, y]) if *x == 0.0 || *y == 0.0 => x.max(*y).min(FRAC_PI_2),
            Shape::Pyramid([x, y]) => (x.min(FRAC_PI_2).tan()).atan2(along_y).min(band(y.min(FRAC_PI_2), along_x)),
            Shape::Square([x, y]) => band(*y, along_x).min(band(*x, along_y)),
            Shape::Product(_) => 0.0,
        }
    }

    /// Members on a grid: the middle direction and `tilts` rings around it out to the bound, each of `headings` directions, every one with `spins`
    /// spins from end to end (once around if free, the lower end first). Lines have the two headings along themselves. Of a product the three
    /// numbers are those of its first three angles, the others in the middle.
    pub fn grid(&self, tilts: usize, headings: usize, spins: usize) -> Vec<Member> {
        let mut out = Vec::new();
        let mut push = |seen: Quaternion, tilt, heading, spin| {
            out.push(Member { orientation: self.reference.product(&seen), tilt, heading, spin });
        };
        if let Shape::Product(factors) = &self.shape {
            let counts = [tilts, headings, spins];
            let mut all = vec![(Quaternion::IDENTITY, [0.0; 3])];
            for (i, factor) in factors.iter().enumerate() {
                let count = counts.get(i).copied().unwrap_or(1);
                let one = |(q, angles): (Quaternion, [f64; 3])| {
                    factor.range.spaced(count).map(move |x| {
                        let mut angles = angles;
                        if let Some(slot) = angles.get_mut(i) {
                            *slot = x;
                        }
                        (q.product(&Quaternion::about(factor.axis, x)), angles)
                    })
                };
                all = all.into_iter().flat_map(one).collect();
            }
            all.into_iter().for_each(|(q, [a, b, c])| push(q, a, b, c));
            return out;
        }
        let around: Vec<f64> = match &self.shape {
            Shape::Pyramid([_, y]) | Shape::Square([_, y]) if *y == 0.0 => vec![FRAC_PI_2, -FRAC_PI_2],
            Shape::Pyramid([x, _]) | Shape::Square([x, _]) if *x == 0.0 => vec![0.0, PI],
            _ => (0..headings.max(1)).map(|i| TAU * i as f64 / headings.max(1) as f64).collect(),
        };
        let spins = self.spin.spaced(spins);
        spins.clone().for_each(|spin| push(self.member([0.0, 0.0, 1.0], spin), 0.0, 0.0, spin));
        for ring in 1..=tilts {
            for &heading in &around {
                let tilt = self.reach(heading) * ring as f64 / tilts as f64;
                if tilt > 0.0 {
                    spins.clone().for_each(|spin| push(self.member(direction(tilt, heading), spin), tilt, heading, spin));
                }
            }
        }
        out
    }
}
