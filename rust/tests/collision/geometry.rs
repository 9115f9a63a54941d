//! Bodies out of URDF files.

use std::fs;
use std::path::{Path, PathBuf};

use redundancy::collision::{Mount, bodies_from_urdf_file, bodies_from_urdf_str};
use redundancy::linalg::vector::{norm, sub};
use redundancy::robot::{Robot, UrdfChain};

const TIP: UrdfChain = UrdfChain { base: None, tip: Some("tip"), limits: &[] };

const TRIANGLES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const POINTS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn ascii() -> String {
    let facets: String = TRIANGLES
        .iter()
        .map(|t| {
            let corners: String = t.iter().map(|i| format!("vertex {} {} {}\n", POINTS[*i][0], POINTS[*i][1], POINTS[*i][2])).collect();
            format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
        })
        .collect();
    format!("solid it\n{facets}endsolid it\n")
}

fn binary() -> Vec<u8> {
    let mut bytes = b"solid, as CAD programs write in binary files too".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4u32.to_le_bytes());
    for t in TRIANGLES {
        bytes.extend([0u8; 12]);
        bytes.extend(t.iter().flat_map(|i| POINTS[*i]).flat_map(f32::to_le_bytes));
        bytes.extend([0u8; 2]);
    }
    bytes
}

fn obj() -> String {
    let vertices: String = POINTS.iter().map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).collect();
    let faces: String = TRIANGLES.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)).collect();
    format!("mtllib missing.mtl\n{vertices}{faces}")
}

fn urdf(palm: &str) -> String {
    format!(
        r#"<robot name="it">
  <link name="world"/>
  <link name="foot"><collision><geometry><box size="0.2 0.4 0.6"/></geometry></collision></link>
  <link name="arm"><collision name="rod"><origin xyz="0 0 0.5" rpy="0 0 0"/><geometry><cylinder radius="0.1" length="1"/></geometry></collision></link>
  <link name="hand"/>
  <link name="palm">{palm}</link>
  <link name="finger"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
  <link name="tip"/>
  <joint name="a" type="fixed"><origin xyz="0 0 1" rpy="0 0 0"/><parent link="world"/><child link="foot"/></joint>
  <joint name="b" type="revolute"><origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/><parent link="foot"/><child link="arm"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="c" type="prismatic"><origin xyz="0 0 1" rpy="0.4 0 0"/><axis xyz="1 0 0"/><parent link="arm"/><child link="hand"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="d" type="fixed"><origin xyz="0.1 0 0" rpy="0 0 0.5"/><parent link="hand"/><child link="palm"/></joint>
  <joint name="e" type="prismatic"><axis xyz="1 0 0"/><parent link="palm"/><child link="finger"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="f" type="fixed"><origin xyz="0 0 0.2" rpy="0 0 0"/><parent link="hand"/><child link="tip"/></joint>
</robot>"#
    )
}

fn mesh(name: &str) -> String {
    format!(r#"<collision><geometry><mesh filename="{name}" scale="0.1 0.2 -0.3"/></geometry></collision>"#)
}

/// A folder of packages that is removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("collision-{name}-{}", std::process::id()));
        fs::create_dir_all(path.join("pkg/meshes")).unwrap();
        fs::create_dir_all(path.join("pkg/urdf")).unwrap();
        fs::write(path.join("pkg/meshes/a.stl"), ascii()).unwrap();
        fs::write(path.join("pkg/meshes/b.STL"), binary()).unwrap();
        fs::write(path.join("pkg/meshes/c.obj"), obj()).unwrap();
        fs::write(path.join("pkg/meshes/cut.stl"), &binary()[..150]).unwrap();
        fs::write(path.join("pkg/meshes/d.dae"), "<COLLADA/>").unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn shapes_and_places() {
    let text = urdf("");
    let bodies = bodies_from_urdf_str(&text, &TIP, Path::new("."), &[]).unwrap();
    let robot = Robot::from_urdf_str(&text, &TIP).unwrap();
    assert_eq!(bodies.iter().map(|b| (b.name.as_str(), b.mount)).collect::<Vec<_>>(), [("foot", Mount::Base), ("arm/rod", Mount::Link(0))]);
    assert_eq!(bodies[0].shape.half_extents(), Some([0.1, 0.2, 0.3]));
    assert_eq!(bodies[1].shape.half_extents(), Some([0.0, 0.0, 0.5]));
    // The rod's axis leads from the first joint to the second at every posture.
    let frames = redundancy::kinematics::link_frames(&robot, &[0.7, 0.0]).unwrap();
    let rod = frames[0].compose(&bodies[1].pose);
    let end: [f64; 3] = std::array::from_fn(|i| rod.origin[i] + 0.5 * rod.axes[2][i]);
    assert!(norm(sub(end, frames[1].origin)) < 1e-12);
    // From another base, the foot is still held by what holds the base.
    let bodies = bodies_from_urdf_str(&text, &UrdfChain { base: Some("foot"), ..TIP }, Path::new("."), &[]).unwrap();
    assert_eq!(bodies[0].mount, Mount::Base);
}

#[test]
fn meshes_of_every_kind() {
    let folder = Folder::new("kinds");
    let inside = folder.0.join("pkg/urdf");
    for (name, search) in [
        ("package://pkg/meshes/a.stl", vec![]),
        ("package://pkg/meshes/b.STL", vec![]),
        ("../meshes/c.obj", vec![]),
        ("meshes/c.obj", vec![folder.0.join("pkg")]),
    ] {
        let path = inside.join("it.urdf");
        fs::write(&path, urdf(&mesh(name))).unwrap();
        let bodies = bodies_from_urdf_file(&path, &TIP, &search).unwrap();
        let palm = bodies.iter().find(|b| b.name == "palm").unwrap();
        assert_eq!(palm.mount, Mount::Link(1));
        let mut vertices = palm.shape.vertices();
        vertices.sort_by(|a, b| b[0].total_cmp(&a[0]).then(b[1].total_cmp(&a[1])).then(a[2].total_cmp(&b[2])));
        let expected = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, -0.3], [0.0; 3]];
        assert!(vertices.iter().zip(expected).all(|(a, b)| norm(sub(*a, b)) < 1e-7), "{name} {vertices:?}");
    }
    let anywhere = bodies_from_urdf_str(&urdf(&mesh("package://pkg/meshes/a.stl")), &TIP, Path::new("/"), std::slice::from_ref(&folder.0));
    assert_eq!(anywhere.unwrap().len(), 3);
    for name in ["package://pkg/meshes/none.stl", "package://pkg", "../meshes/cut.stl", "../meshes/d.dae", ""] {
        let error = bodies_from_urdf_str(&urdf(&mesh(name)), &TIP, &inside, &[]).unwrap_err();
        println!("{error}");
    }
}

#[test]
fn without_collision_elements() {
    for name in ["panda", "ur5"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/{name}.urdf"));
        let error = bodies_from_urdf_file(&path, &UrdfChain::default(), &[]).unwrap_err();
        println!("{error}");
    }
}
