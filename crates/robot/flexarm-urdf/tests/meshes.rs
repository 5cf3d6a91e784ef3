//! One box in every format against the closed form; and bytes that are not a mesh.

use std::path::Path;

use approx::assert_relative_eq;
use flexarm_kinematics::Pose;
use flexarm_settings::Finding;
use flexarm_urdf::internals::{Loaded, decode as decode_with, load_with_remarks};
use flexarm_urdf::{Geometry, UpAxis, load_mesh};
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3, vector};
use proptest::prelude::*;

/// Decodes with the declared up axis.
fn decode(bytes: &[u8], path: &Path) -> Result<Loaded, Box<Finding>> {
    decode_with(bytes, path, UpAxis::Declared)
}

/// Edge lengths and centre of the box (m).
const SIZE: [f64; 3] = [0.25, 0.5, 0.75];
const CENTRE: [f64; 3] = [1.0, -2.0, 0.5];

/// The eight corners for these edges and centre; bit i of the index is the side along axis i.
fn corners(size: [f64; 3], centre: [f64; 3]) -> Vec<[f64; 3]> {
    (0..8)
        .map(|k: usize| std::array::from_fn(|i| centre[i] + if k >> i & 1 == 1 { 0.5 } else { -0.5 } * size[i]))
        .collect()
}

/// The six faces, counter-clockwise from outside.
const QUADS: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

fn triangles() -> impl Iterator<Item = [usize; 3]> {
    QUADS.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
}

fn stl_ascii() -> Vec<u8> {
    let p = corners(SIZE, CENTRE);
    let mut text = "solid box\n".to_owned();
    for t in triangles() {
        text += "facet normal 0 0 0\n outer loop\n";
        t.iter().for_each(|&i| text += &format!("  vertex {} {} {}\n", p[i][0], p[i][1], p[i][2]));
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid box\n").into_bytes()
}

/// Binary, with a header that claims to be ASCII.
fn stl_binary() -> Vec<u8> {
    let p = corners(SIZE, CENTRE);
    let mut bytes = b"solid this header lies".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(12u32.to_le_bytes());
    for t in triangles() {
        bytes.extend([0u8; 12]);
        t.iter().flat_map(|&i| p[i]).for_each(|x| bytes.extend((x as f32).to_le_bytes()));
        bytes.extend([0u8; 2]);
    }
    bytes
}

/// Quads with indices relative to the end.
fn obj() -> Vec<u8> {
    let mut text = "# box\no box\n".to_owned();
    corners(SIZE, CENTRE).iter().for_each(|p| text += &format!("v {} {} {}\n", p[0], p[1], p[2]));
    for quad in QUADS {
        text += &format!("f {}\n", quad.map(|i| format!("{}", i as i64 - 8)).join(" "));
    }
    text.into_bytes()
}

/// In millimetres, y up, with a translating node and a second geometry level; the box as a
/// polylist.
fn collada() -> Vec<u8> {
    // V has z up: x_V = x, y_V = -z, z_V = y of the file; the node translates by 100 mm along x of
    // the file.
    let file_size = [SIZE[0], SIZE[2], SIZE[1]].map(|x| x * 1000.0);
    let file_centre = [CENTRE[0], CENTRE[2], -CENTRE[1]].map(|x| x * 1000.0);
    let moved = [file_centre[0] - 100.0, file_centre[1], file_centre[2]];
    let numbers: Vec<String> = corners(file_size, moved).iter().flatten().map(f64::to_string).collect();
    let indices: Vec<String> = QUADS.iter().flatten().map(usize::to_string).collect();
    format!(
        r##"<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
 <library_effects><effect id="red-fx"><profile_COMMON><technique sid="t"><lambert>
  <diffuse><color>0.8 0.1 0.1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
 <library_materials><material id="red"><instance_effect url="#red-fx"/></material></library_materials>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="24">{}</float_array>
   <technique_common><accessor source="#pa" count="8" stride="3"/></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <polylist material="m" count="6"><input semantic="VERTEX" source="#v" offset="0"/>
   <vcount>4 4 4 4 4 4</vcount><p>{}</p></polylist>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node><translate>100 0 0</translate>
  <node><scale>1 1 1</scale><instance_geometry url="#g"><bind_material><technique_common>
   <instance_material symbol="m" target="#red"/></technique_common></bind_material></instance_geometry></node>
 </node></visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"##,
        numbers.join(" "),
        indices.join(" ")
    )
    .into_bytes()
}

/// A unit box scaled and translated by a node; y up: x_V = x, y_V = -z, z_V = y of the file.
fn glb() -> Vec<u8> {
    let mut data = Vec::new();
    corners([1.0; 3], [0.0; 3]).iter().flatten().for_each(|x| data.extend((*x as f32).to_le_bytes()));
    triangles().flatten().for_each(|i| data.extend((i as u16).to_le_bytes()));
    let json = gltf_json(&format!(r#"{{"byteLength":{}}}"#, data.len()));
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    for word in [2, 12 + 8 + json.len() + 8 + data.len(), json.len()] {
        bytes.extend((word as u32).to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

fn gltf_json(buffer: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1],"translation":[{},{},{}]}},{{"mesh":0,"scale":[{},{},{}]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.25,0.125,1.0]}}}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[-0.5,-0.5,-0.5],"max":[0.5,0.5,0.5]}},
{{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":72}}],
"buffers":[{buffer}]}}"#,
        CENTRE[0], CENTRE[2], -CENTRE[1], SIZE[0], SIZE[2], SIZE[1]
    )
}

fn all_formats() -> [(&'static str, Vec<u8>); 5] {
    [
        ("ascii.stl", stl_ascii()),
        ("binary.STL", stl_binary()),
        ("box.obj", obj()),
        ("box.dae", collada()),
        ("box.glb", glb()),
    ]
}

fn box_inertia() -> Matrix3<f64> {
    let [x, y, z] = SIZE.map(|e| e * e);
    Matrix3::from_diagonal(&vector![y + z, z + x, x + y]) * (SIZE.iter().product::<f64>() / 12.0)
}

/// Closed form: V = abc, I = V (b² + c²)/12 about the centroid.
#[test]
fn a_box_has_its_mass_properties_in_every_format() {
    for (name, bytes) in all_formats() {
        let mesh = decode(&bytes, Path::new(name)).unwrap_or_else(|e| panic!("{name}: {e}")).mesh;
        let p = mesh.mass_properties();
        assert_eq!(mesh.triangles.len(), 12, "{name}");
        assert!(p.is_closed() && !p.inside_out, "{name}: {p:?}");
        // measured 0, 0 and 9e-19: these corners are exact in single precision
        assert_relative_eq!(p.volume, SIZE.iter().product::<f64>(), max_relative = 1e-14);
        assert_relative_eq!(p.centroid, Vector3::from(CENTRE), max_relative = 1e-14);
        assert_relative_eq!(p.inertia, box_inertia(), epsilon = 1e-16);
    }
}

#[test]
fn colours_come_from_dae_and_glb() {
    let color = |bytes: Vec<u8>, name: &str| decode(&bytes, Path::new(name)).unwrap().mesh.color;
    assert_eq!(color(collada(), "a.dae"), Some([0.8, 0.1, 0.1, 1.0]));
    assert_eq!(color(glb(), "a.glb"), Some([0.5, 0.25, 0.125, 1.0]));
    assert_eq!(color(stl_binary(), "a.stl"), None);
}

#[test]
fn a_turned_up_axis_is_remarked_and_can_be_ignored() {
    let remarks = decode(&collada(), Path::new("a.dae")).unwrap().remarks;
    assert!(remarks[0].contains("Y_UP"), "{remarks:?}");
    let z_up = String::from_utf8(collada()).unwrap().replace("Y_UP", "Z_UP");
    assert!(decode(z_up.as_bytes(), Path::new("a.dae")).unwrap().remarks.is_empty());
    let ignored = decode_with(&collada(), Path::new("a.dae"), UpAxis::Ignored).unwrap();
    assert!(ignored.remarks.is_empty());
    let file = vector![CENTRE[0], CENTRE[2], -CENTRE[1]];
    assert_relative_eq!(ignored.mesh.mass_properties().centroid, file, max_relative = 1e-14);
}

/// X_UP by the specification: right is -y, up is x, towards the viewer is z; z up: right x, up z,
/// towards -y.
#[test]
fn x_up_is_turned_as_the_specification_says() {
    let text = String::from_utf8(collada()).unwrap().replace("Y_UP", "X_UP");
    let p = decode(text.as_bytes(), Path::new("a.dae")).unwrap().mesh.mass_properties();
    let file = [CENTRE[0], CENTRE[2], -CENTRE[1]];
    assert_relative_eq!(p.centroid, vector![-file[1], -file[2], file[0]], max_relative = 1e-6);
    assert!(!p.inside_out);
}

#[test]
fn a_geometry_placed_twice_is_there_twice() {
    let text = String::from_utf8(collada()).unwrap();
    let twice =
        text.replace("<node><scale>", "<node><scale>-1 1 1</scale><instance_geometry url=\"#g\"/></node><node><scale>");
    let mesh = decode(twice.as_bytes(), Path::new("a.dae")).unwrap().mesh;
    let p = mesh.mass_properties();
    // The mirrored instance keeps its outward side, so the volumes add.
    assert_relative_eq!(p.volume, 2.0 * SIZE.iter().product::<f64>(), max_relative = 1e-6);
    assert_eq!(mesh.triangles.len(), 24);
}

#[test]
fn a_gltf_with_its_buffer_as_text_is_read() {
    let glb = glb();
    let data = &glb[glb.len() - 168..];
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let text: String = data
        .chunks(3)
        .flat_map(|c| {
            let n = c.iter().fold(0u32, |n, b| n << 8 | u32::from(*b));
            [18, 12, 6, 0].map(|s| char::from(alphabet[(n >> s & 63) as usize]))
        })
        .collect();
    let uri = format!(r#"{{"byteLength":168,"uri":"data:application/octet-stream;base64,{text}"}}"#);
    let p = decode(gltf_json(&uri).as_bytes(), Path::new("a.gltf")).unwrap().mesh.mass_properties();
    assert_relative_eq!(p.inertia, box_inertia(), epsilon = 1e-8);
    let beside = r#"{"byteLength":168,"uri":"missing.bin"}"#;
    let error = decode(gltf_json(beside).as_bytes(), Path::new("a.gltf")).unwrap_err();
    assert!(error.to_string().contains("missing.bin"), "{error}");
}

/// Layout: robot/meshes/a.*, robot/side/a.*, and secret/a.* beside the robot.
#[test]
fn a_mesh_reads_files_of_its_robot_and_no_others() {
    let top = std::env::temp_dir().join(format!("flexarm-mesh-sides-{}", std::process::id()));
    let (meshes, data) = (top.join("robot/meshes"), glb());
    for folder in ["robot/meshes", "robot/side", "secret"] {
        std::fs::create_dir_all(top.join(folder)).unwrap();
        std::fs::write(top.join(folder).join("a.bin"), &data[data.len() - 168..]).unwrap();
        std::fs::write(top.join(folder).join("a.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    }
    let load = |name: &str, text: &str| {
        std::fs::write(meshes.join(name), text).unwrap();
        load_with_remarks(&meshes.join(name), UpAxis::Declared)
    };
    let gltf = |uri: &str| load("a.gltf", &gltf_json(&format!(r#"{{"byteLength":168,"uri":"{uri}"}}"#)));
    let refused = |uri: &str| {
        let error = gltf(uri).unwrap_err().to_string();
        let words = ["a.gltf", uri, "outside", "copy it beside the mesh"];
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    let plain = String::from_utf8(obj()).unwrap();
    let obj = |name: &str| load("a.obj", &format!("mtllib {name}.mtl\nusemtl red\n{plain}")).unwrap();
    let is_red = |loaded: &Loaded| loaded.mesh.color == Some([1.0, 0.0, 0.0, 1.0]) && loaded.remarks.is_empty();
    let is_bare = |loaded: &Loaded| loaded.mesh.color.is_none() && loaded.remarks[0].contains("outside");

    assert!(gltf("a.bin").is_ok() && is_red(&obj("a")));
    refused("../side/a.bin");
    assert!(is_bare(&obj("../side/a")));
    std::fs::write(top.join("robot/package.xml"), "<package/>").unwrap();
    assert!(gltf("../side/a.bin").is_ok() && is_red(&obj("../side/a")));
    let absolute = top.join("secret/a");
    for name in ["../../secret/a", absolute.to_str().unwrap()] {
        refused(&format!("{name}.bin"));
        assert!(is_bare(&obj(name)));
    }
    refused("../../../../x/secret.txt");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(top.join("secret/a.bin"), meshes.join("link.bin")).unwrap();
        refused("link.bin");
    }
    std::fs::remove_dir_all(&top).unwrap();
}

#[test]
fn formats_are_told_by_content_where_the_name_is_silent() {
    for (name, bytes) in all_formats().into_iter().filter(|(name, _)| !name.ends_with("obj")) {
        assert!(decode(&bytes, Path::new("mesh")).is_ok(), "{name}");
    }
    let error = decode(b"hello", Path::new("mesh")).unwrap_err();
    assert!(error.to_string().contains("unknown mesh format"), "{error}");
}

#[test]
fn broken_files_are_refused_with_the_reason() {
    let reason = |bytes: &[u8], name: &str| decode(bytes, Path::new(name)).unwrap_err().to_string();
    let binary = stl_binary();
    let cut = [&[0u8; 80], &binary[80..binary.len() - 20]].concat();
    assert!(reason(&cut, "a.stl").contains("cut off: 664 bytes, expected 684"), "{}", reason(&cut, "a.stl"));
    assert!(reason(&binary[..40], "a.stl").contains("STL"));
    assert!(reason(b"solid a\nendsolid a\n", "a.stl").contains("no triangles"));
    assert!(reason(b"v 0 0 0\nf 1 2 3\n", "a.obj").contains("OBJ"));
    let nan = String::from_utf8(obj()).unwrap().replacen("v 0.875", "v NaN", 1);
    assert!(reason(nan.as_bytes(), "a.obj").contains("not finite"));
    let dae = String::from_utf8(collada()).unwrap();
    assert!(reason(dae.replace("url=\"#g\"", "url=\"#h\"").as_bytes(), "a.dae").contains("does not exist"));
    assert!(reason(dae.replace("<p>0 ", "<p>9 ").as_bytes(), "a.dae").contains("index 9 is beyond"));
    assert!(reason(dae.replace("polylist", "polygons").as_bytes(), "a.dae").contains("<polygons>"));
    let looped = dae
        .replace("<visual_scene id=\"s\"><node>", "<visual_scene id=\"s\"><node id=\"n\"><instance_node url=\"#n\"/>");
    assert!(reason(looped.as_bytes(), "a.dae").contains("cycle"));
    let glb = glb();
    assert!(reason(&glb[..glb.len() - 8], "a.glb").contains("cut off"));
    let missing = load_mesh("/nowhere/a.stl", UpAxis::Declared).unwrap_err();
    assert!(missing.to_string().starts_with("/nowhere/a.stl: cannot be read"), "{missing}");
    let folder = load_mesh(std::env::temp_dir(), UpAxis::Declared).unwrap_err();
    assert!(folder.message.contains("not a file"), "{folder}");
}

#[test]
fn an_open_mesh_and_one_inside_out_are_recognised() {
    let mut mesh = Geometry::Box { size: Vector3::from(SIZE) }.triangles().unwrap();
    assert!(mesh.mass_properties().is_closed());
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let p = mesh.mass_properties();
    assert!(p.inside_out && p.is_closed());
    assert_relative_eq!(p.inertia, box_inertia(), epsilon = 1e-9);
    mesh.triangles.pop();
    assert_eq!(mesh.mass_properties().open_edges, 3);
}

/// Closed forms of primitives against the integrals over their inscribed polyhedra with 48 corners.
#[test]
fn primitives_agree_with_their_triangles() {
    let shapes = [
        Geometry::Box { size: Vector3::from(SIZE) },
        Geometry::Cylinder { radius: 0.3, length: 0.8 },
        Geometry::Capsule { radius: 0.3, length: 0.8 },
        Geometry::Sphere { radius: 0.4 },
    ];
    for shape in shapes {
        let (exact, mesh) = (shape.mass_properties().unwrap(), shape.triangles().unwrap());
        let sum = mesh.mass_properties();
        assert!(sum.is_closed() && !sum.inside_out, "{shape:?}");
        // measured: volume 0.3 % and 0.7 %, inertia 0.4 % and 1.3 % for cylinder and sphere
        assert_relative_eq!(sum.volume, exact.volume, max_relative = 0.01);
        assert_relative_eq!(sum.inertia, exact.inertia, epsilon = 0.015 * exact.inertia.amax());
        let normals = mesh.normals.unwrap();
        for t in &mesh.triangles {
            let p = t.map(|i| Vector3::from(mesh.positions[i as usize].map(f64::from)));
            let outward = (p[1] - p[0]).cross(&(p[2] - p[0]));
            t.iter().for_each(|&i| assert!(outward.dot(&Vector3::from(normals[i as usize].map(f64::from))) > 0.0));
        }
    }
}

/// Mirroring preserves the outward side; a pose rotates the inertia.
#[test]
fn scaling_and_moving_keep_a_body_a_body() {
    let mesh = decode(&stl_binary(), Path::new("a.stl")).unwrap().mesh;
    let mirrored = mesh.clone().scaled(&vector![-2.0, 1.0, 1.0]).mass_properties();
    assert!(!mirrored.inside_out);
    assert_relative_eq!(mirrored.volume, 2.0 * SIZE.iter().product::<f64>(), max_relative = 1e-6);
    assert_relative_eq!(mirrored.centroid.x, -2.0 * CENTRE[0], max_relative = 1e-6);

    let R = Rotation3::from_euler_angles(0.3, -0.4, 1.2);
    let X_AB = Pose::from_parts(Translation3::new(0.1, 0.2, 0.3), R);
    let moved = mesh.transformed(&X_AB).mass_properties();
    assert_relative_eq!(moved.inertia, R.matrix() * box_inertia() * R.matrix().transpose(), epsilon = 1e-7);
    assert_relative_eq!(moved.centroid, (X_AB * nalgebra::Point3::from(CENTRE)).coords, epsilon = 1e-6);
}

#[test]
fn every_truncation_is_read_or_refused() {
    for (name, bytes) in all_formats() {
        for end in 0..bytes.len() {
            let _ = decode(&bytes[..end], Path::new(name));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Valid files with some bytes changed reach deeper code than noise does.
    #[test]
    fn no_change_of_bytes_panics(
        which in 0usize..5,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (name, mut bytes) = all_formats()[which].clone();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let _ = decode(&bytes, Path::new(name));
    }

    #[test]
    fn no_bytes_at_all_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), which in 0usize..6) {
        let name = ["a.stl", "a.obj", "a.dae", "a.glb", "a.gltf", "a"][which];
        let _ = decode(&bytes, Path::new(name));
        let _ = decode(&[b"solid a\nfacet normal", &bytes[..]].concat(), Path::new("a.stl"));
        let _ = decode(&[b"glTF\x02\0\0\0", &bytes[..]].concat(), Path::new("a.glb"));
    }

    /// Numbers and words of the format in any order.
    #[test]
    fn no_words_of_obj_and_stl_panic(words in prop::collection::vec(
        prop::sample::select(vec![
            "v", "vn", "vt", "f", "g", "usemtl", "mtllib", "o", "s", "1", "-1", "0", "2/3/1", "1//2", "1e39", "-2147483648",
            "\n", "nan", "solid", "facet", "normal", "outer loop", "vertex", "endloop", "endfacet", "endsolid", "/", "#",
        ]), 0..60)) {
        let text = words.join(" ");
        let _ = decode(text.as_bytes(), Path::new("a.obj"));
        let _ = decode(text.as_bytes(), Path::new("a.stl"));
    }
}
