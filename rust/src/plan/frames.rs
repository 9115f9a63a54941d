//! Tool frames along a path at spin 0, and the spin of a tool against them.

use std::f64::consts::{PI, TAU};

use super::members::is_axial;
use super::numbers::{linspace, three_digits};
use super::path::{Orientation, Path, no_rotations};
use crate::error::{Error, Result};
use crate::kinematics::sized::forward;
use crate::linalg::frame::Frame;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::linalg::with_capacity;
use crate::robot::Robot;
use crate::task::Task;
use crate::task::volume::OrientationVolume;

/// Two points of a path this near [m], with axes whose cosine is this near to 1, are one.
const SAME: f64 = 1e-9;
/// Axes whose cosine is this near to -1 are opposite: the smallest rotation from one to the other is not unique.
const OPPOSITE: f64 = 1e-12;
/// An angle between an axis and a rotation of one point of a path that rounding, or a drawing, may leave \[rad\].
const ROUNDED: f64 = 0.02;
/// Cosine with the path's axis above which the tool's x axis does not show its spin.
const ALONG: f64 = 0.9;

/// The tool frames at spin 0, one a point: the path's rotations where it has any; else the first is arbitrary and the others follow without
/// turning about the axis. In a `closed` path, what the way round turned the tool by is spread over the path, so that the last is the first.
///
/// # Errors
/// [`Error`] if the rotations that the task needs are missing, or a closed path does not end where it starts.
pub fn spin_frames(path: &Path, task: &Task, closed: bool) -> Result<Vec<Frame>> {
    let orientation = Orientation::of(task);
    let last = path.len() - 1;
    let apart = sub(path.position()[0], path.position()[last]).iter().any(|x| x.abs() > SAME);
    let leans = orientation != Orientation::Free && dot(path.axis()[0], path.axis()[last]) < 1.0 - SAME;
    if closed && (apart || leans) {
        let given = "True, but the last point of the path is not the first";
        return Err(Error::value("closed", given, "a path that ends where it starts"));
    }
    let at = |(axes, origin): ([Vec3; 3], &Vec3)| Frame { axes, origin: *origin };
    if let Some(rotation) = path.rotation() {
        let frames = rotation.iter().copied().zip(path.position()).map(at);
        return match task.spin_axis() {
            Some(tool) => frames.zip(path.axis()).enumerate().map(|(i, (frame, axis))| aligned(i, frame, tool, *axis)).collect(),
            None => Ok(frames.collect()),
        };
    }
    let tool = match orientation {
        Orientation::Whole => return Err(no_rotations()),
        Orientation::Axis(axis) => axis,
        Orientation::Free => [0.0, 0.0, 1.0],
    };
    let first = to_axis(tool, path.axis()[0]);
    let mut turns: Vec<[Vec3; 3]> = transport(path.axis()).iter().map(|turn| product(turn, &first)).collect();
    if closed && orientation != Orientation::Free {
        close(&mut turns, path.axis());
    }
    turns.into_iter().zip(path.position()).map(at).map(|frame| Frame::from_matrix("frames", &frame.matrix())).collect()
}

/// The frame of a point with the tool's axis along the path's: the two come from one file, rounded each for itself.
fn aligned(point: usize, frame: Frame, tool: Vec3, axis: Vec3) -> Result<Frame> {
    let own = frame.rotate(tool);
    let away = norm(cross(own, axis)).atan2(dot(own, axis));
    if away > ROUNDED {
        let given = format!("one that has the tool's axis {} deg from axis[{point}]", three_digits(away.to_degrees()));
        return Err(Error::value(&format!("rotation[{point}]"), given, "the same direction as that of the path"));
    }
    Ok(if away > 0.0 { Frame { axes: product(&smallest_rotation(own, axis), &frame.axes), ..frame } } else { frame })
}

/// Frames that a tool which turns about the direction `about` of the base alone, such as a planar arm's, has with its `axis` along that of each frame, as far as
/// it can: what it is spun by there is not its own choice. `tool` is one of its frames.
pub(super) fn turned_about(about: Vec3, tool: &Frame, axis: Vec3, frames: &[Frame]) -> Vec<Frame> {
    let now = tool.rotate(axis);
    let one = |frame: &Frame| {
        let wanted = frame.rotate(axis);
        let angle = dot(about, cross(now, wanted)).atan2(dot(now, wanted) - dot(about, now) * dot(about, wanted));
        Frame { axes: product(&Frame::rotation(about, angle).axes, &tool.axes), origin: frame.origin }
    };
    frames.iter().map(one).collect()
}

/// Rotations (as the images of x, y, z) that take the first of some unit vectors to each of them, by the smallest rotation from each to the
/// next: none of the steps turns about its axis. Where two in a row are opposite, that rotation is about some perpendicular.
pub fn transport(axis: &[Vec3]) -> Vec<[Vec3; 3]> {
    let mut all = Vec::with_capacity(axis.len());
    let mut now = Frame::IDENTITY.axes;
    for (i, to) in axis.iter().enumerate() {
        if i > 0 && axis[i - 1] != *to {
            // Rounding must not pile up over long paths.
            now = nearest_rotation(&product(&smallest_rotation(axis[i - 1], *to), &now));
        }
        all.push(now);
    }
    all
}

/// A unit vector perpendicular to a unit vector: across it and the coordinate axis that it is least along.
pub fn across(vector: Vec3) -> Vec3 {
    let least = (1..3).fold(0, |least, i| if vector[i].abs() < vector[least].abs() { i } else { least });
    let mut other = [0.0; 3];
    other[least] = 1.0;
    let normal = cross(vector, other);
    normal.map(|x| x / norm(normal))
}

/// The angle about the tool's `axis` (tool frame) from a frame to a tool, from -pi to pi.
pub fn spin(frame: &Frame, tool: &Frame, axis: Vec3) -> f64 {
    let turned = tool.axes.map(|axis| frame.unrotate(axis));
    let skew = [turned[1][2] - turned[2][1], turned[2][0] - turned[0][2], turned[0][1] - turned[1][0]];
    dot(skew, axis).atan2(turned[0][0] + turned[1][1] + turned[2][2] - 1.0)
}

/// How far a tool is outside a volume seen in a frame \[rad\]; 0 inside.
pub(super) fn outside(volume: &OrientationVolume, frame: &Frame, tool: &Frame) -> f64 {
    volume.signed_distance(&Quaternion::from_axes(&tool.axes.map(|axis| frame.unrotate(axis)))).max(0.0)
}

/// Tilt of a tool's z axis from that of a frame, its heading from x to y of the frame, and the twist about z \[rad\].
pub fn tilt_heading_twist(frame: &Frame, tool: &Frame) -> [f64; 3] {
    let [x, y, z] = tool.axes.map(|axis| frame.unrotate(axis));
    [z[0].hypot(z[1]).atan2(z[2]), z[1].atan2(z[0]), (x[1] - y[0]).atan2(x[0] + y[1])]
}

/// The frames in which a volume is seen, one a point: the path's rotations; without them those of spin 0, where the volume looks at an axis alone.
///
/// # Errors
/// [`Error`] if the rotations that the volume needs are missing, or a closed path does not end where it starts.
pub fn volume_frames(path: &Path, volume: &OrientationVolume, closed: bool) -> Result<Vec<Frame>> {
    if path.rotation().is_none() && !is_axial(volume) {
        return Err(Error::value("path", "one that has no rotations", "some for a volume that looks at more than the tool's axis"));
    }
    let task = if path.rotation().is_some() { Task::POSITION } else { Task::axisymmetric([0.0, 0.0, 1.0])? };
    let frames = spin_frames(path, &task, closed)?;
    let (first, last) = (frames[0], frames[frames.len() - 1]);
    if closed && (0..3).any(|i| dot(first.axes[i], last.axes[i]) < 1.0 - SAME) {
        let given = "True, but the last point of the path is not the first";
        return Err(Error::value("closed", given, "a path that ends where it starts"));
    }
    Ok(frames)
}

/// The tool frames of postures, n joints a row.
#[inline(never)]
pub fn tools(robot: &Robot, q: &[f64]) -> Vec<Frame> {
    fn tool<const C: usize>(robot: &Robot, q: &[f64]) -> Frame {
        forward::<C>(robot, q)
    }
    let n = robot.n();
    q.chunks_exact(n).map(|q| with_capacity!(n, tool(robot, q))).collect()
}

/// How far a tool has turned about its axis since the first point \[rad\], unwrapped: the angle of a tool axis across `axis` (base frame, one a
/// point), from where transport without spin would have taken it. `q` are the postures, n joints a row.
pub fn spin_along(robot: &Robot, axis: &[Vec3], q: &[f64]) -> Vec<f64> {
    let tools = tools(robot, q);
    let (Some(first), Some(start)) = (tools.first(), axis.first()) else { return Vec::new() };
    // The x axis shows the spin, unless the tool turns about it.
    let pointer = usize::from(dot(first.axes[0], *start).abs() >= ALONG);
    let seen = first.axes[pointer];
    let seen = sub(seen, scale(dot(seen, *start), *start));
    let reference = seen.map(|x| x / norm(seen));
    let angle = |((tool, axis), turn): ((&Frame, &Vec3), &[Vec3; 3])| {
        let carried = rotated(turn, reference);
        let seen = tool.axes[pointer];
        dot(seen, cross(*axis, carried)).atan2(dot(seen, carried))
    };
    let mut angles: Vec<f64> = tools.iter().zip(axis).zip(&transport(axis)).map(angle).collect();
    unwrap(&mut angles);
    angles
}

/// Takes the whole turns out of the steps of a row of angles.
fn unwrap(angles: &mut [f64]) {
    let (mut turns, mut before) = (0.0, angles.first().copied().unwrap_or(0.0));
    for angle in angles.iter_mut().skip(1) {
        let step = *angle - before;
        before = *angle;
        if step.abs() >= PI {
            let short = (step + PI).rem_euclid(TAU) - PI;
            turns += if short == -PI && step > 0.0 { PI } else { short } - step;
        }
        *angle += turns;
    }
}

/// A rotation that takes the tool's axis to the path's.
fn to_axis(tool: Vec3, axis: Vec3) -> [Vec3; 3] {
    let (from, to) = (basis(tool), basis(axis));
    // The columns of to * from'.
    std::array::from_fn(|c| rotated(&to, [from[0][c], from[1][c], from[2][c]]))
}

/// An orthonormal frame whose z axis is given.
fn basis(axis: Vec3) -> [Vec3; 3] {
    let x = across(axis);
    [x, cross(axis, x), axis]
}

/// Turns frames about the axes, ever more along the path, until the last is the first.
fn close(frames: &mut [[Vec3; 3]], axis: &[Vec3]) {
    let last = frames.len() - 1;
    let of_tool = Frame { axes: frames[0], origin: [0.0; 3] }.unrotate(across(axis[0]));
    let (start, end) = (rotated(&frames[0], of_tool), rotated(&frames[last], of_tool));
    let angle = dot(cross(end, start), axis[0]).atan2(dot(end, start));
    for ((frame, axis), share) in frames.iter_mut().zip(axis).zip(linspace(0.0, angle, last + 1)) {
        *frame = product(&Frame::rotation(*axis, share).axes, frame);
    }
    frames[last] = frames[0];
}

/// The smallest rotation from a unit vector to another.
fn smallest_rotation(from: Vec3, to: Vec3) -> [Vec3; 3] {
    let cosine = dot(from, to);
    let unit = Frame::IDENTITY.axes;
    if cosine < -1.0 + OPPOSITE {
        let normal = across(from);
        return unit.map(|e| sub(scale(2.0 * dot(normal, e), normal), e));
    }
    let normal = cross(from, to);
    let factor = 1.0 / (1.0 + cosine);
    unit.map(|e| add(add(e, cross(normal, e)), scale(factor, cross(normal, cross(normal, e)))))
}

/// One Newton step towards the polar factor, `1.5 M - 0.5 M M' M`: enough from an error of rounding size.
fn nearest_rotation(m: &[Vec3; 3]) -> [Vec3; 3] {
    // Column c of M' M tells how columns of M combine.
    std::array::from_fn(|c| {
        let mixed = (0..3).fold([0.0; 3], |sum, k| add(sum, scale(dot(m[k], m[c]), m[k])));
        sub(scale(1.5, m[c]), scale(0.5, mixed))
    })
}

/// A vector turned by a rotation given as the images of x, y, z.
fn rotated(turn: &[Vec3; 3], v: Vec3) -> Vec3 {
    Frame { axes: *turn, origin: [0.0; 3] }.rotate(v)
}

fn product(a: &[Vec3; 3], b: &[Vec3; 3]) -> [Vec3; 3] {
    b.map(|column| rotated(a, column))
}
