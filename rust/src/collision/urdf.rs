//! Bodies out of the collision elements of URDF files.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use urdf_rs::{Geometry, JointType, Pose};

use super::body::{Body, Mount};
use super::mesh_file;
use super::shape::Shape;
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, unit};
use crate::robot::urdf::{chain, frame_of, with_z};

/// The bodies of the chain between two links of a URDF file, as `Robot::from_urdf_file` reads it with the same links. Meshes are
/// replaced by their convex hulls; `search` are folders of packages. See [`bodies_from_urdf_str`].
pub fn bodies_from_urdf_file(path: &Path, base: Option<&str>, tip: Option<&str>, search: &[PathBuf]) -> Result<Vec<Body>> {
    let named = |why: String| Error::Model(format!("{}: {why}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|e| named(e.to_string()))?;
    let folder = std::path::absolute(path).map_err(|e| named(e.to_string()))?;
    bodies_from_urdf_str(&text, base, tip, folder.parent().unwrap_or(Path::new("")), search).map_err(|e| match e {
        Error::Model(why) => named(why),
        other => other,
    })
}

/// The same from the text of a URDF and the folder to which its meshes are relative.
///
/// Links beside the chain belong to it as far as fixed joints hold them (a gripper's palm, a pedestal); what hangs on moving joints of its
/// own is left out, since nothing says where it is. A cylinder becomes the capsule of its radius about its whole axis: it holds the cylinder,
/// touches all of its side and is at most one radius too long at each end, and its distances are exact and smooth, which those of a prism
/// with many faces are not.
pub fn bodies_from_urdf_str(text: &str, base: Option<&str>, tip: Option<&str>, folder: &Path, search: &[PathBuf]) -> Result<Vec<Body>> {
    let urdf = urdf_rs::read_from_string(text).map_err(|e| Error::Model(format!("not a URDF: {e}")))?;
    let places = places(&urdf, base, tip)?;
    let mut bodies = Vec::new();
    for link in &urdf.links {
        let Some((mount, frame)) = places.get(link.name.as_str()) else { continue };
        for (i, collision) in link.collision.iter().enumerate() {
            let name = match &collision.name {
                Some(name) => format!("{}/{name}", link.name),
                None if link.collision.len() > 1 => format!("{}/{i}", link.name),
                None => link.name.clone(),
            };
            let shape = shape(&collision.geometry, folder, search).map_err(|e| Error::Model(format!("collision {name:?}: {e}")))?;
            let pose = frame.compose(&placed(&collision.origin, &format!("collision {name:?}"))?);
            bodies.push(Body { name, mount: *mount, pose, shape });
        }
    }
    if bodies.is_empty() {
        return Err(Error::Model("no link of the chain has a collision element: see capsules_along_links".into()));
    }
    Ok(bodies)
}

fn shape(geometry: &Geometry, folder: &Path, search: &[PathBuf]) -> Result<Shape> {
    match geometry {
        Geometry::Box { size } => Shape::cuboid(size.0.map(|x| 0.5 * x)),
        Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => Shape::capsule(0.5 * length, *radius),
        Geometry::Sphere { radius } => Shape::sphere(*radius),
        Geometry::Mesh { filename, scale } => {
            let scale = scale.map_or([1.0; 3], |s| s.0);
            let points = mesh_file::points(&mesh_file::resolve(filename, folder, search)?)?;
            let scaled: Vec<Vec3> = points.iter().map(|p| std::array::from_fn(|i| scale[i] * p[i])).collect();
            Shape::hull(&scaled)
        }
    }
}

/// The frame of a pose with finite numbers.
fn placed(pose: &Pose, what: &str) -> Result<Frame> {
    check_finite(&format!("xyz of {what}"), &pose.xyz.0)?;
    check_finite(&format!("rpy of {what}"), &pose.rpy.0)?;
    Ok(frame_of(pose))
}

/// What every link that the chain determines is fixed to, and its frame there.
fn places<'a>(urdf: &'a urdf_rs::Robot, base: Option<&str>, tip: Option<&str>) -> Result<HashMap<&'a str, (Mount, Frame)>> {
    let chain = chain(urdf, base, tip)?;
    let mut places: HashMap<&str, (Mount, Frame)> = HashMap::new();
    let (mut mount, mut pending, mut moving) = (Mount::Base, Frame::IDENTITY, 0);
    if let Some(first) = chain.first() {
        places.insert(&first.parent.link, (mount, pending));
    }
    for joint in &chain {
        pending = pending.compose(&placed(&joint.origin, &format!("joint {:?}", joint.name))?);
        if joint.joint_type != JointType::Fixed {
            // The joint's frame in the robot has the axis as z, as in `robot/urdf.rs`.
            let axis = unit(joint.axis.xyz.0).ok_or_else(|| Error::Model(format!("joint {:?} has no axis", joint.name)))?;
            (mount, pending) = (Mount::Link(moving), with_z(axis).inverse());
            moving += 1;
        }
        places.insert(&joint.child.link, (mount, pending));
    }
    // What fixed joints hold, from link to link until nothing more is reached.
    let mut grown = true;
    while grown {
        grown = false;
        for joint in urdf.joints.iter().filter(|joint| joint.joint_type == JointType::Fixed) {
            let (parent, child) = (joint.parent.link.as_str(), joint.child.link.as_str());
            let step = placed(&joint.origin, &format!("joint {:?}", joint.name))?;
            let reached = match (places.get(parent), places.get(child)) {
                (Some((mount, frame)), None) => (child, (*mount, frame.compose(&step))),
                (None, Some((mount, frame))) => (parent, (*mount, frame.compose(&step.inverse()))),
                _ => continue,
            };
            places.insert(reached.0, reached.1);
            grown = true;
        }
    }
    Ok(places)
}
