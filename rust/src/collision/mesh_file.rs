//! The points of mesh files, and where URDFs mean them to be.

use std::io::{Error as IoError, ErrorKind};
use std::path::{Path, PathBuf};

use mesh_loader::Loader;

use crate::error::{Error, Result};
use crate::linalg::vector::Vec3;

/// The vertices of an STL (binary or text) or OBJ file, in its own units.
pub(super) fn points(path: &Path) -> Result<Vec<Vec3>> {
    let failed = |why: String| Error::Model(format!("{}: {why}", path.display()));
    let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    // Materials have no part in collisions: whatever an OBJ file refers to stays unread.
    let unread = |_: &Path| Err::<Vec<u8>, _>(IoError::from(ErrorKind::NotFound));
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let loader = Loader::default();
    let scene = match extension.as_str() {
        "stl" => loader.load_stl_from_slice(&bytes, path),
        "obj" => loader.load_obj_from_slice_with_reader(&bytes, path, unread),
        _ => return Err(failed("expected a mesh in a file .stl or .obj".into())),
    };
    let scene = scene.map_err(|e| failed(e.to_string()))?;
    Ok(scene.meshes.iter().flat_map(|mesh| &mesh.vertices).map(|p| p.map(f64::from)).collect())
}

/// The file that a URDF names: `package://name/rest`, `file://` or a path relative to the URDF's folder. A package is looked for, by its name
/// or as the folder itself, in the search paths and in the folder of the URDF and those above it.
pub(super) fn resolve(name: &str, folder: &Path, search: &[PathBuf]) -> Result<PathBuf> {
    let name = name.trim();
    let candidates: Vec<PathBuf> = if let Some(rest) = name.strip_prefix("package://") {
        let (package, inside) = rest.split_once('/').unwrap_or((rest, ""));
        let places = search.iter().map(PathBuf::as_path).chain(folder.ancestors());
        places
            .flat_map(|place| {
                let is_package = place.file_name().is_some_and(|last| last == package);
                [Some(place.join(package).join(inside)), is_package.then(|| place.join(inside))]
            })
            .flatten()
            .collect()
    } else {
        let path = Path::new(name.strip_prefix("file://").unwrap_or(name));
        std::iter::once(folder).chain(search.iter().map(PathBuf::as_path)).map(|place| place.join(path)).collect()
    };
    candidates.iter().find(|path| path.is_file()).cloned().ok_or_else(|| {
        let tried: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
        Error::Model(format!("mesh {name:?} was not found; tried {}", tried.join(", ")))
    })
}
