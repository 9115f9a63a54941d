//! From afar to a position, with the tool's orientation in a volume about that of a target.

use crate::inverse::{Reach, least_squares};
use crate::kinematics::sized::{forward, jacobian_apart};
use crate::linalg::frame::Frame;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, dot, norm, scale, sub};
use crate::linalg::{MAX_JOINTS, Row6, Rows6};
use crate::qp::DenseRow;
use crate::robot::{Limits, MAX_COMBINATIONS, Robot};
use crate::task::volume::MAX_SIDES;
use crate::task::{OrientationVolume, Target};

/// Damping relative to the squared error.
const DAMPING: f64 = 0.05;
/// Largest motion of a joint in one step [rad or m].
const LARGEST_STEP: f64 = 1.0;
/// Distance \[rad\] from which the way into a volume counts more than its sides.
const FAR: f64 = 0.1;
/// Steps that were refused in a row before the search is given up.
const MAX_REFUSED: usize = 8;

/// The rotation vector, in the base frame, that takes the tool to the nearest orientation of a volume about a frame: zero inside.
pub(super) fn way_in(volume: &OrientationVolume, frame: &[Vec3; 3], tool: &[Vec3; 3]) -> Vec3 {
    let (path, tool) = (Quaternion::from_axes(frame), Quaternion::from_axes(tool));
    let nearest = volume.nearest(&path.conjugate().product(&tool));
    if nearest.distance <= 0.0 {
        return [0.0; 3];
    }
    let (axis, _) = path.product(&nearest.orientation).product(&tool.conjugate()).axis_angle();
    scale(nearest.distance, axis)
}

/// What is left to a target: the rotation into the volume about its frame, and the translation.
pub(super) fn error_inside(volume: &OrientationVolume, tool: &Frame, target: &Target) -> (Vec3, Vec3) {
    (way_in(volume, &target.frame, &tool.axes), sub(target.position, tool.origin))
}

/// What a search is for.
#[derive(Clone, Copy)]
pub(super) struct Sought<'a> {
    pub robot: &'a Robot,
    pub volume: &'a OrientationVolume,
    pub target: &'a Target,
    /// Weighs angles against distances \[m\].
    pub length: f64,
    /// Limits that hold.
    pub limits: Option<&'a Limits>,
    /// Joints that stand, one bit a joint.
    pub held: u32,
}

impl Sought<'_> {
    fn left(&self, q: &[f64]) -> (Vec3, Vec3, f64) {
        let (w, v) = error_inside(self.volume, &forward::<MAX_JOINTS>(self.robot, q), self.target);
        (w, v, norm(w).max(norm(v) / self.length))
    }

    /// Moves `q` to the target until the error is below `tolerance`: damped Newton (Sugihara 2011) for the position, what has no width of the volume, and the
    /// shortest way into it. It stays at the nearest posture found. In the room for the largest robots.
    #[cold]
    #[inline(never)]
    pub fn reach(&self, q: &mut [f64], tolerance: f64, iterations: usize) -> Reach {
        let n = q.len();
        if let Some(limits) = self.limits.filter(|limits| !limits.coupled.is_empty()) {
            limits.pull_inside(q);
        }
        let (mut refused, mut caution) = (0, 1.0);
        let (mut w, mut v, mut error) = self.left(q);
        for k in 0..iterations {
            if error <= tolerance || refused >= MAX_REFUSED {
                return Reach { error, iterations: k };
            }
            let step = self.step(q, (w, v), DAMPING * caution * error * error * self.length * self.length);
            let mut trial = [0.0; MAX_JOINTS];
            for i in 0..n {
                trial[i] = q[i] + step[i];
                if let Some(limits) = self.limits {
                    trial[i] = trial[i].clamp(limits.q_min[i], limits.q_max[i]);
                }
            }
            let next = self.left(&trial[..n]);
            if next.2 < error {
                // Steps that hardly help will not get there.
                refused = if next.2 > 0.99 * error { refused + 1 } else { 0 };
                caution = f64::max(0.3 * caution, 1e-3);
                (w, v, error) = next;
                q.copy_from_slice(&trial[..n]);
            } else {
                refused += 1;
                caution *= 10.0;
            }
        }
        Reach { error, iterations }
    }

    /// One damped step along what is left, within the limits.
    fn step(&self, q: &[f64], (w, v): (Vec3, Vec3), damping: f64) -> [f64; MAX_JOINTS] {
        let n = q.len();
        let (tool, columns) = jacobian_apart::<MAX_JOINTS>(self.robot, q);
        let (rows, wanted) = self.equations(&tool, &columns.w, &columns.v, (w, v));
        let (mut low, mut high) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for i in (0..n).filter(|i| self.held >> i & 1 == 0) {
            (low[i], high[i]) = self.limits.map_or((-LARGEST_STEP, LARGEST_STEP), |limits| {
                ((limits.q_min[i] - q[i]).clamp(-LARGEST_STEP, 0.0), (limits.q_max[i] - q[i]).clamp(0.0, LARGEST_STEP))
            });
        }
        let mut kept = [DenseRow::<MAX_JOINTS>::OPEN; MAX_COMBINATIONS + MAX_SIDES];
        let combinations = self.limits.map_or(&[][..], |limits| &limits.coupled);
        for (row, it) in kept.iter_mut().zip(combinations) {
            row.a[..n].copy_from_slice(&it.row);
            (row.lower, row.upper) = it.room(q);
        }
        // On its way the tool leaves no bound that it keeps: what the position takes is taken along it.
        let sides = self.volume.sides(&self.target.frame, &tool.axes);
        let bounds = sides.as_slice().iter().filter(|side| !side.equality && side.slack >= 0.0);
        let mut count = combinations.len();
        for (row, side) in kept[count..].iter_mut().zip(bounds) {
            row.a = columns.w.map(|column| dot(side.rate, column));
            row.lower = -side.slack;
            count += 1;
        }
        let kept = &kept[..count];
        least_squares(n, (&rows, &wanted), (damping, &[0.0; MAX_JOINTS]), (&low, &high), kept).unwrap_or([0.0; MAX_JOINTS])
    }

    /// The position, then the sides without width and the way into the volume, of which three are enough; from afar that way comes first.
    fn equations(
        &self,
        tool: &Frame,
        turns: &[Vec3; MAX_JOINTS],
        moves: &[Vec3; MAX_JOINTS],
        (w, v): (Vec3, Vec3),
    ) -> (Rows6<MAX_JOINTS>, Row6) {
        let (mut rows, mut wanted) = ([[0.0; MAX_JOINTS]; 6], [0.0; 6]);
        for c in 0..3 {
            rows[c] = moves.map(|column| column[c]);
            wanted[c] = v[c];
        }
        let mut next = 3;
        let mut push = |rate: Vec3, by: f64| {
            if next < 6 {
                rows[next] = turns.map(|column| self.length * dot(rate, column));
                wanted[next] = self.length * by;
                next += 1;
            }
        };
        let angle = norm(w);
        if angle > FAR {
            push(scale(1.0 / angle, w), angle);
        }
        for side in self.volume.sides(&self.target.frame, &tool.axes).as_slice().iter().filter(|side| side.equality) {
            push(side.rate, -side.slack);
        }
        if angle > 0.0 && angle <= FAR {
            push(scale(1.0 / angle, w), angle);
        }
        (rows, wanted)
    }
}
