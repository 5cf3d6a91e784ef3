//! Selection of interface nodes on a block of bricks with known node positions.

use flexarm_fem::mesh::{Mesh, Region, SelectError, connected_parts, select, skin};
use flexarm_fem::{ElementBlock, ElementKind, NodeSelector};
use nalgebra::Vector3;

/// `n` unit cubes along each axis, in m times `unit`, and one node without an element.
fn bricks(n: u32, unit: f64) -> Mesh {
    let at = |i: u32, j: u32, k: u32| (k * (n + 1) + j) * (n + 1) + i;
    let mut mesh = Mesh::default();
    for (k, j, i) in grid(n + 1) {
        mesh.nodes.push(Vector3::new(f64::from(i), f64::from(j), f64::from(k)) * unit);
    }
    mesh.nodes.push(Vector3::new(-1.0, 0.0, 0.0) * unit);
    mesh.node_ids = (101..).take(mesh.nodes.len()).collect();
    let mut block = ElementBlock { kind: ElementKind::Hex8, region: 0, ids: vec![], connectivity: vec![] };
    for (k, j, i) in grid(n) {
        block.ids.push(block.ids.len() as u64 + 1);
        for k in [k, k + 1] {
            block.connectivity.extend([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]);
        }
    }
    mesh.blocks.push(block);
    mesh.regions.push(Region { name: "body".into(), material: None, beam: None });
    mesh.node_sets.insert("interface_A".into(), vec![0, 1, 2]);
    mesh.node_sets.insert("loose".into(), vec![mesh.nodes.len() as u32 - 1]);
    mesh
}

fn grid(n: u32) -> impl Iterator<Item = (u32, u32, u32)> {
    (0..n).flat_map(move |k| (0..n).flat_map(move |j| (0..n).map(move |i| (k, j, i))))
}

fn choose(mesh: &Mesh, text: &str) -> Result<Vec<u32>, SelectError> {
    select(mesh, &text.parse::<NodeSelector>().unwrap(), 1e-3)
}

#[test]
fn places_choose_nodes_of_the_surface_only() {
    let mesh = bricks(4, 1e-3); // mm, as the selections below
    for (text, count) in [
        ("plane(0,0,0; 1,0,0)", 25),
        ("plane(2,0,0; -3,0,0)", 16), // a cut: the rim without inner nodes
        ("plane(0.4,0,0; 1,0,0; 0.5)", 25),
        ("box(0,0,0; 4,4,4)", 98), // the whole skin
        ("box(1,1,1; 3,3,4)", 9),
        ("cylinder(2,2,0; 0,0,2; 1)", 8), // four nodes at each end
        ("cylinder(2,2,0; 0,0,1; 1) & plane(0,0,4; 0,0,1)", 4),
        ("interface_A & plane(0,0,0; 1,0,0)", 1),
        ("INTERFACE_a", 3),
    ] {
        let nodes = choose(&mesh, text).unwrap();
        assert_eq!(nodes.len(), count, "{text}");
        assert!(nodes.windows(2).all(|pair| pair[0] < pair[1]));
    }
}

#[test]
fn an_empty_choice_tells_the_nearest_node_and_its_distance() {
    let mesh = bricks(2, 1e-3);
    match choose(&mesh, "plane(2.25,0,0; 1,0,0)").unwrap_err() {
        SelectError::NothingNear { distance, nearest_id, .. } => {
            assert!((distance - 0.25).abs() < 1e-12);
            assert_eq!(nearest_id, 103); // (2, 0, 0)
        }
        other => panic!("{other}"),
    }
    let message = choose(&mesh, "plane(0,0,0; 1,0,0) & plane(2,0,0; 1,0,0)").unwrap_err().to_string();
    assert!(message.contains("nodes in each: plane(0,0,0; 1,0,0): 9"), "{message}");
}

#[test]
fn an_unknown_set_is_answered_with_the_nearest_spelling_first() {
    let mut mesh = bricks(2, 1e-3);
    let message = choose(&mesh, "interfaceA").unwrap_err().to_string();
    assert!(message.contains("known are \"interface_A\" (3 nodes), \"loose\" (1 nodes)"), "{message}");
    let message = choose(&mesh, "Body").unwrap_err().to_string();
    assert!(message.contains("is a set of elements"), "{message}");
    let message = choose(&mesh, "loose").unwrap_err().to_string();
    assert!(message.contains("none of the nodes"), "{message}");
    mesh.node_sets.insert("INTERFACE_A".into(), vec![5]);
    assert!(matches!(choose(&mesh, "Interface_A"), Err(SelectError::Ambiguous { .. })));
    assert_eq!(choose(&mesh, "INTERFACE_A").unwrap(), [5]);
    mesh.node_sets.clear();
    assert!(choose(&mesh, "x").unwrap_err().to_string().contains("no node sets"));
}

#[test]
fn impossible_places_are_refused_with_the_value() {
    let mesh = bricks(2, 1e-3);
    for (text, word) in [
        ("plane(0,0,0; 0,0,0)", "normal"),
        ("cylinder(0,0,0; 0,0,1; -1)", "radius"),
        ("box(1,0,0; 0,1,1)", "min up to max"),
        ("plane(0,0,0; 1,0,0; -1)", "tolerance"),
    ] {
        let message = choose(&mesh, text).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    let empty = NodeSelector::All(vec![]);
    assert!(select(&mesh, &empty, 1.0).unwrap_err().to_string().contains("no terms"));
    let nan = NodeSelector::Plane { point: [f64::NAN, 0.0, 0.0], normal: [1.0, 0.0, 0.0], tolerance: None };
    assert!(matches!(select(&mesh, &nan, 1.0), Err(SelectError::Geometry { .. })));
}

#[test]
fn nodes_of_beams_can_be_chosen_by_place() {
    let mut mesh = bricks(2, 1e-3);
    let connectivity = vec![13, 27]; // from the middle of the block to the loose node
    mesh.blocks.push(ElementBlock { kind: ElementKind::Beam2, region: 0, ids: vec![99], connectivity });
    assert_eq!(choose(&mesh, "box(-1,0,0; -1,0,0)").unwrap(), [27]);
    assert_eq!(connected_parts(&mesh).len(), 1);
}

#[test]
fn the_skin_of_a_block_is_its_six_sides_seen_from_outside() {
    let mesh = bricks(3, 1.0);
    let faces = skin(&mesh);
    assert_eq!((faces.len(), faces.triangles().len(), faces.nodes().len()), (54, 108, 56));
    let centre = Vector3::from_element(1.5);
    for face in faces.faces() {
        let p: Vec<Vector3<f64>> = face.corners.iter().map(|node| mesh.nodes[*node as usize]).collect();
        let normal = (p[1] - p[0]).cross(&(p[2] - p[0]));
        assert!(normal.dot(&(p[0] - centre)) > 0.0 && face.midsides.is_empty());
        assert!(mesh.blocks[face.block].elements().nth(face.element).unwrap().contains(&face.corners[0]));
    }
}
