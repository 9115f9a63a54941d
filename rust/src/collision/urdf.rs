//! Bodies out of the collision elements of URDF files.

use std::path::{Path, PathBuf};

use super::body::{Body, Mount};
use super::mesh_file;
use super::shape::Shape;
use crate::error::{Error, Result};
use crate::linalg::frame::Frame;
use crate::linalg::vector::Vec3;
use crate::robot::UrdfChain;
use crate::robot::urdf::{Document, Element, attribute, chain, document_of, fault, origin};

/// The bodies of the chain between two links of a URDF file, as `Robot::from_urdf_file` reads it when asked for the same. Meshes are
/// replaced by their convex hulls; `search` are folders of packages. See [`bodies_from_urdf_str`].
pub fn bodies_from_urdf_file(path: &Path, asked: &UrdfChain, search: &[PathBuf]) -> Result<Vec<Body>> {
    let folder = std::path::absolute(path).map_err(|e| Error::Model(format!("{}: {e}", path.display())))?;
    bodies(&document_of(path)?, asked, folder.parent().unwrap_or(Path::new("")), search)
}

/// The same from the text of a URDF and the folder to which its meshes are relative.
///
/// Links beside the chain belong to it as far as fixed joints hold them (a gripper's palm, a pedestal); what hangs on moving joints of its
/// own is left out, since nothing says where it is. A cylinder becomes the capsule of its radius about its whole axis: it holds the cylinder,
/// touches all of its side and is at most one radius too long at each end, and its distances are exact and smooth, which those of a prism
/// with many faces are not.
pub fn bodies_from_urdf_str(text: &str, asked: &UrdfChain, folder: &Path, search: &[PathBuf]) -> Result<Vec<Body>> {
    bodies(&Document::read("URDF", text)?, asked, folder, search)
}

fn bodies(document: &Document, asked: &UrdfChain, folder: &Path, search: &[PathBuf]) -> Result<Vec<Body>> {
    let mut bodies = Vec::new();
    for (link, place) in document.links.iter().zip(places(document, asked)?) {
        let Some((mount, frame)) = place else { continue };
        let several = link.element.children.len() > 1;
        for (i, collision) in link.element.children.iter().enumerate() {
            let name = match collision.attribute("name") {
                Some(name) => format!("{}/{name}", link.name),
                None if several => format!("{}/{i}", link.name),
                None => link.name.clone(),
            };
            let who = format!("collision {name:?}");
            let pose = frame.compose(&origin(&document.source, &who, collision)?);
            let shape = shape(&document.source, &who, collision, folder, search)?;
            bodies.push(Body { name, mount, pose, shape });
        }
    }
    if bodies.is_empty() {
        return Err(Error::Model(format!("{}: no link of the chain has a collision element: see capsules_along_links", document.source)));
    }
    Ok(bodies)
}

fn shape(source: &str, who: &str, collision: &Element, folder: &Path, search: &[PathBuf]) -> Result<Shape> {
    let geometry = collision.child("geometry").and_then(|geometry| geometry.children.first());
    let missing = || fault(source, collision.line, format!("{who}: no box, cylinder, capsule, sphere or mesh in its <geometry>"));
    let solid = geometry.ok_or_else(missing)?;
    let failed = |why: &dyn std::fmt::Display| fault(source, solid.line, format!("{who}: {why}"));
    let absent = |name: &str| failed(&format!("no {name} in <{}>", solid.name));
    let number = |name: &str| attribute::<1>(source, who, solid, name)?.map(|[x]| x).ok_or_else(|| absent(name));
    let found = match solid.name.as_str() {
        "box" => Shape::cuboid(attribute::<3>(source, who, solid, "size")?.ok_or_else(|| absent("size"))?.map(|x| 0.5 * x)),
        "sphere" => Shape::sphere(number("radius")?),
        "mesh" => {
            let scale: [f64; 3] = attribute(source, who, solid, "scale")?.unwrap_or([1.0; 3]);
            let file = solid.attribute("filename").ok_or_else(|| absent("filename"))?;
            let points = mesh_file::resolve(file, folder, search).and_then(|path| mesh_file::points(&path)).map_err(|e| failed(&e))?;
            let scaled: Vec<Vec3> = points.iter().map(|p| std::array::from_fn(|i| scale[i] * p[i])).collect();
            Shape::hull(&scaled)
        }
        _ => Shape::capsule(0.5 * number("length")?, number("radius")?),
    };
    found.map_err(|e| failed(&e))
}

/// What every link that the chain determines is fixed to, and its frame there.
fn places(document: &Document, asked: &UrdfChain) -> Result<Vec<Option<(Mount, Frame)>>> {
    let mut places: Vec<Option<(Mount, Frame)>> = vec![None; document.links.len()];
    let mut waiting = Vec::new();
    for (link, moved, frame) in chain(document, asked)?.places {
        places[link] = Some((if moved == 0 { Mount::Base } else { Mount::Link(moved - 1) }, frame));
        waiting.push(link);
    }
    // What fixed joints hold, below and above, from link to link.
    while let Some(link) = waiting.pop() {
        let Some((mount, frame)) = places[link] else { continue };
        let it = &document.links[link];
        for number in it.below.iter().chain(&it.above) {
            let joint = &document.joints[*number];
            let other = if joint.child == link { joint.parent } else { joint.child };
            if places[other].is_some() {
                continue;
            }
            let Some(step) = document.held(*number, asked.limits)? else { continue };
            places[other] = Some((mount, frame.compose(&if other == joint.child { step } else { step.inverse() })));
            waiting.push(other);
        }
    }
    Ok(places)
}
