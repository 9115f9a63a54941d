//! The points of mesh files, and where URDFs mean them to be.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::linalg::vector::Vec3;
use crate::robot::urdf::{decoded, read_bytes};

/// Bytes ahead of the triangles of a binary STL: a header of 80 and the number of triangles.
const HEADER: usize = 84;

/// Bytes of each triangle: its normal and its corners by 32-bit numbers, and two that mean nothing.
const TRIANGLE: usize = 50;

/// Bytes that a program may leave behind the last triangle: the end of a line.
const LINE_END: u64 = 2;

/// The vertices of the faces in an STL (binary or text) or OBJ file, in its own units.
pub(super) fn points(path: &Path) -> Result<Vec<Vec3>> {
    let bytes = read_bytes(path)?;
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let found = match extension.as_str() {
        "stl" if is_text(&bytes) => text_stl(&decoded(&bytes)),
        "stl" => binary_stl(&bytes),
        "obj" => obj(&decoded(&bytes)),
        _ => Err("expected a mesh in a file .stl or .obj".into()),
    };
    let finite = found.and_then(|points| match points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(i) => Err(format!("vertex {i} is {:?}, expected finite numbers", points[i])),
        None => Ok(points),
    });
    finite.map_err(|why| Error::Model(format!("{}: {why}", path.display())))
}

/// The bytes that a binary STL has by its own count of triangles.
fn counted(bytes: &[u8]) -> Option<(u32, u64)> {
    let count = u32::from_le_bytes(bytes.get(HEADER - 4..HEADER)?.try_into().ok()?);
    Some((count, HEADER as u64 + TRIANGLE as u64 * u64::from(count)))
}

/// Whether an STL is text. Headers of binary ones may begin as text does; then their size tells.
fn is_text(bytes: &[u8]) -> bool {
    let begins = bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    begins
        && counted(bytes).is_none_or(|(_, size)| size != bytes.len() as u64)
        && bytes.windows(8).any(|word| word.eq_ignore_ascii_case(b"endsolid"))
}

fn binary_stl(bytes: &[u8]) -> std::result::Result<Vec<Vec3>, String> {
    let held = bytes.len() as u64;
    let (count, size) = counted(bytes).ok_or_else(|| format!("{held} bytes, expected an STL: at least the {HEADER} of its header"))?;
    if size > held || held - size > LINE_END {
        return Err(format!("an STL of {held} bytes that counts {count} triangles, for which {size} bytes are expected"));
    }
    let number = |four: &[u8]| f64::from(f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
    let corners = bytes[HEADER..size as usize].chunks_exact(TRIANGLE).flat_map(|triangle| triangle[12..48].chunks_exact(12));
    Ok(corners.map(|corner| std::array::from_fn(|i| number(&corner[4 * i..]))).collect())
}

fn text_stl(text: &str) -> std::result::Result<Vec<Vec3>, String> {
    let mut points = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        if words.next().is_some_and(|word| word.eq_ignore_ascii_case("vertex")) {
            points.push(three(words).ok_or_else(|| format!("line {}: {line:?}, expected three numbers of a vertex", i + 1))?);
        }
    }
    if points.len() % 3 == 0 { Ok(points) } else { Err(format!("{} vertices, expected three for each triangle", points.len())) }
}

/// Materials, normals and textures have no part in collisions: whatever else an OBJ file has or refers to stays unread.
fn obj(text: &str) -> std::result::Result<Vec<Vec3>, String> {
    let (mut points, mut used): (Vec<Vec3>, Vec<usize>) = (Vec::new(), Vec::new());
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => points.push(three(words).ok_or_else(|| format!("line {}: {line:?}, expected three numbers of a vertex", i + 1))?),
            Some("f") => {
                for word in words {
                    let number = word.split('/').next().and_then(|number| number.parse::<i64>().ok());
                    // Counted from 1, or back from the last one so far.
                    let vertex = number.map(|k| if k < 0 { k + points.len() as i64 } else { k - 1 }).and_then(|k| usize::try_from(k).ok());
                    used.push(vertex.ok_or_else(|| format!("line {}: {word:?}, expected the number of a vertex", i + 1))?);
                }
            }
            _ => {}
        }
    }
    if let Some(most) = used.iter().max().filter(|most| **most >= points.len()) {
        return Err(format!("a face of vertex {}, expected at most the {} that it holds", most + 1, points.len()));
    }
    used.sort_unstable();
    used.dedup();
    Ok(if used.is_empty() { points } else { used.iter().map(|vertex| points[*vertex]).collect() })
}

/// The first three of words as numbers.
fn three<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Vec3> {
    let mut point = [0.0; 3];
    for x in &mut point {
        *x = words.next()?.parse().ok()?;
    }
    Some(point)
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
