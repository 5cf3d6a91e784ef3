//! Meshes of the reference cases, made and used by other programs. They are stored outside the
//! project: the tests are ignored by default.

use std::path::{Path, PathBuf};

use flexarm_fe_io::mesh::{MeshFile, ReadOptions, read_mesh};
use flexarm_fem::mesh::{Mesh, connected_parts, select, skin};
use flexarm_fem::{ElementKind, Material};

/// A file of the shared folder: `FLEXARM_SHARED`, or `shared` next to a folder above this crate.
fn shared(file: &str) -> PathBuf {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|folder| folder.join("shared"));
    let folder = std::env::var_os("FLEXARM_SHARED").map(PathBuf::from);
    let path = folder.into_iter().chain(above).map(|folder| folder.join("fe").join(file)).find(|path| path.exists());
    path.unwrap_or_else(|| panic!("there is no fe/{file} below FLEXARM_SHARED or beside the project"))
}

fn read(path: &Path) -> MeshFile {
    read_mesh(path, &ReadOptions::default()).unwrap()
}

/// Volume by the divergence theorem over the triangles of the skin.
fn volume(mesh: &Mesh) -> f64 {
    let p = |node: u32| mesh.nodes[node as usize];
    skin(mesh).triangles().iter().map(|[a, b, c]| p(*a).dot(&p(*b).cross(&p(*c))) / 6.0).sum()
}

/// Reads the three formats of a mesh and checks that they agree; returns the mesh of the deck.
fn same_in_all_formats(stem: &str, nodes: usize, elements: usize, interfaces: [usize; 2]) -> Mesh {
    let [v22, v41, deck] = ["_v22.msh.gz", "_v41.msh.gz", ".inp.gz"].map(|end| shared(&format!("{stem}{end}")));
    let (v22, v41, deck) = (read(&v22).mesh, read(&v41).mesh, read(&deck).mesh);
    assert_eq!((v22.nodes.len(), v22.element_count()), (nodes, elements));
    assert_eq!(v41, v22);

    // The deck has four reference nodes at the end, and its nodes have twelve digits.
    assert_eq!(deck.node_ids[..nodes], v22.node_ids);
    assert!(deck.nodes.iter().zip(&v22.nodes).all(|(a, b)| (a - b).norm() < 1e-11));
    assert_eq!(deck.blocks.len(), 1);
    assert_eq!(deck.blocks[0].kind, ElementKind::Tet10);
    assert_eq!(deck.blocks[0].connectivity, v22.blocks[0].connectivity);
    for (name, count) in ["interface_A", "interface_B"].into_iter().zip(interfaces) {
        assert_eq!(v22.node_sets[name].len(), count);
        assert_eq!(deck.node_sets[&name.to_uppercase()], v22.node_sets[name]);
    }
    assert_eq!(connected_parts(&deck).len(), 1);
    deck
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn the_beam_of_tetrahedra_is_the_same_in_three_formats() {
    let mesh = same_in_all_formats("A1_beam/beam_tet10_h50mm", 946, 421, [23, 23]);
    assert!((volume(&mesh) - 1.0 * 0.1 * 0.05).abs() < 1e-14, "{}", volume(&mesh)); // measured 1e-17
    assert_eq!(mesh.regions[0].material, Some(Material::isotropic(2.1e11, 0.3, 7850.0)));
    let end = select(&mesh, &"plane(0,0,0; 1,0,0)".parse().unwrap(), 1.0).unwrap();
    assert_eq!(end, mesh.node_sets["INTERFACE_A"]);
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn the_arm_of_tetrahedra_is_the_same_in_three_formats() {
    let mesh = same_in_all_formats("A2_lower_arm/arm_tet10_h30mm", 13867, 7071, [369, 214]);
    // arm_meta.json: annular flange of radii 0.110 and 0.165 in the plane y = -0.075.
    let flange = select(&mesh, &"plane(0,-0.075,0; 0,1,0)".parse().unwrap(), 1.0).unwrap();
    assert_eq!(flange, mesh.node_sets["INTERFACE_A"]);
    let rim = "interface_a & cylinder(0,0,0; 0,1,0; 0.165; 1e-5)".parse().unwrap();
    assert!(select(&mesh, &rim, 1.0).unwrap().len() > 10);

    // Mass matrix of CalculiX: unit acceleration of both interfaces along x.
    let matrix = shared("A2_lower_arm/arm_tet10_h30mm_ccx_M12.mtx");
    let text = std::fs::read_to_string(matrix).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('%'));
    assert_eq!(lines.next().unwrap().split_whitespace().next(), Some("12"));
    let values: Vec<f64> = lines.flat_map(str::split_whitespace).map(|word| word.parse().unwrap()).collect();
    assert_eq!(values.len(), 144);
    let m = |i: usize, j: usize| values[12 * j + i];
    let mass = m(0, 0) + m(0, 6) + m(6, 0) + m(6, 6);
    // measured 3.4e-4: curved faces as plane triangles
    assert!((volume(&mesh) * 2700.0 / mass - 1.0).abs() < 1e-3, "{} {mass}", volume(&mesh) * 2700.0);
}

#[test]
#[ignore = "needs the reference data beside the project"]
fn the_beam_of_bricks_is_read_over_continuation_lines() {
    let path = shared("A1_beam/beam_hex20_20x4x2.inp.gz");
    let file = read(&path);
    assert_eq!((file.mesh.blocks[0].kind, file.mesh.element_count()), (ElementKind::Hex20, 20 * 4 * 2));
    assert!((volume(&file.mesh) - 0.005).abs() < 1e-12, "{}", volume(&file.mesh));
    assert!(file.warnings.iter().any(|warning| warning.contains("*RIGID BODY (2 times)")), "{:?}", file.warnings);
    assert!(file.warnings.iter().any(|warning| warning.contains("4 nodes belong to no element")));
    let end = select(&file.mesh, &"plane(1,0,0; 2,0,0)".parse().unwrap(), 1.0).unwrap();
    assert_eq!(end, file.mesh.node_sets["INTERFACE_B"]);
}
