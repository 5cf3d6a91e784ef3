//! One small mesh in every layout that Gmsh writes (`data/three_blocks.*`, made by
//! `tools/make_mesh_fixtures.py`), and in layouts that it does not write on this platform.

use std::collections::BTreeSet;
use std::io::Write;

use flexarm_fe_io::mesh::{MeshFile, ReadOptions, parse_mesh};
use flexarm_fem::mesh::{Mesh, connected_parts, skin};
use flexarm_fem::{ElementKind, UnitSystem};
use nalgebra::Vector3;
use proptest::prelude::*;

const V22: &[u8] = include_bytes!("data/three_blocks_v22_ascii.msh");
const V22_BINARY: &[u8] = include_bytes!("data/three_blocks_v22_binary.msh");
const V41: &[u8] = include_bytes!("data/three_blocks_v41_ascii.msh");
const V41_BINARY: &[u8] = include_bytes!("data/three_blocks_v41_binary.msh");
const DECK: &[u8] = include_bytes!("data/three_blocks.inp");

fn read(bytes: &[u8]) -> MeshFile {
    parse_mesh(bytes, "three_blocks", &ReadOptions::default()).unwrap()
}

/// Corners of the edges of the mid-side nodes, in the order that `ElementKind` documents.
fn edges(kind: ElementKind) -> &'static [[usize; 2]] {
    match kind {
        ElementKind::Tet10 => &[[1, 2], [2, 3], [3, 1], [1, 4], [2, 4], [3, 4]],
        ElementKind::Hex20 => {
            &[[1, 2], [2, 3], [3, 4], [4, 1], [5, 6], [6, 7], [7, 8], [8, 5], [1, 5], [2, 6], [3, 7], [4, 8]]
        }
        ElementKind::Wedge15 => &[[1, 2], [2, 3], [3, 1], [4, 5], [5, 6], [6, 4], [1, 4], [2, 5], [3, 6]],
        _ => &[],
    }
}

/// Elements with their node numbers, independent of the order of nodes in the file.
fn by_number(mesh: &Mesh) -> BTreeSet<(String, u64, Vec<u64>)> {
    let mut all = BTreeSet::new();
    for block in &mesh.blocks {
        for (id, nodes) in block.ids.iter().zip(block.elements()) {
            let nodes = nodes.iter().map(|node| mesh.node_ids[*node as usize]).collect();
            all.insert((block.kind.name().to_owned(), *id, nodes));
        }
    }
    all
}

/// Volume enclosed by the triangles of the skin (divergence theorem).
fn volume(mesh: &Mesh) -> f64 {
    let p = |node: u32| mesh.nodes[node as usize];
    skin(mesh).triangles().iter().map(|[a, b, c]| p(*a).dot(&p(*b).cross(&p(*c))) / 6.0).sum()
}

#[test]
fn every_layout_gives_the_same_mesh() {
    let truth = read(V22);
    for (bytes, format) in [
        (V22_BINARY, "Gmsh MSH 2 binary"),
        (V41, "Gmsh MSH 4.1 text"),
        (V41_BINARY, "Gmsh MSH 4.1 binary"),
        (DECK, "CalculiX/Abaqus deck"),
    ] {
        let file = read(bytes);
        assert_eq!(file.format, format);
        assert_eq!(file.mesh.node_ids, truth.mesh.node_ids, "{format}");
        for (a, b) in file.mesh.nodes.iter().zip(&truth.mesh.nodes) {
            assert!((a - b).norm() < 1e-14, "{format}"); // the deck has fewer digits
        }
        // Gmsh's own node order for CalculiX is the independent truth here.
        let (ours, theirs) = (by_number(&file.mesh), by_number(&truth.mesh));
        let nodes_only = |all: &BTreeSet<(String, u64, Vec<u64>)>| {
            all.iter().map(|(kind, _, nodes)| (kind.clone(), nodes.clone())).collect::<BTreeSet<_>>()
        };
        assert_eq!(nodes_only(&ours), nodes_only(&theirs), "{format}");
        for name in ["left", "right", "rim", "corner"] {
            assert_eq!(file.mesh.node_sets[name], truth.mesh.node_sets[name], "{format} {name}");
        }
    }
}

#[test]
fn mid_side_nodes_lie_in_the_middle_of_their_corners() {
    for bytes in [V22, V22_BINARY, V41, V41_BINARY, DECK] {
        let mesh = read(bytes).mesh;
        let kinds: Vec<ElementKind> = mesh.blocks.iter().map(|block| block.kind).collect();
        assert_eq!(kinds, [ElementKind::Tet10, ElementKind::Hex20, ElementKind::Wedge15]);
        for block in &mesh.blocks {
            let corners = block.kind.nodes() - edges(block.kind).len();
            for nodes in block.elements() {
                for (middle, [a, b]) in nodes[corners..].iter().zip(edges(block.kind)) {
                    let p = |node: u32| mesh.nodes[node as usize];
                    let middle_truth = (p(nodes[a - 1]) + p(nodes[b - 1])) / 2.0;
                    // measured 1.1e-16
                    assert!((p(*middle) - middle_truth).norm() < 1e-14, "{:?}", block.kind);
                }
            }
        }
    }
}

#[test]
fn the_skin_encloses_the_volume_and_has_no_hole() {
    let mesh = read(V41).mesh;
    assert!((volume(&mesh) - 3.0).abs() < 1e-10, "{}", volume(&mesh)); // three unit cubes
    let faces = skin(&mesh);
    let mut edges = std::collections::BTreeMap::new();
    for face in faces.faces() {
        assert_eq!(face.corners.len(), face.midsides.len());
        for k in 0..face.corners.len() {
            let (a, b) = (face.corners[k], face.corners[(k + 1) % face.corners.len()]);
            *edges.entry((a, b)).or_insert(0) += 1;
        }
    }
    // Every edge is traversed once in each direction.
    assert!(edges.iter().all(|((a, b), count)| *count == 1 && edges.get(&(*b, *a)) == Some(&1)));
}

#[test]
fn blocks_without_common_nodes_are_separate_parts() {
    let mesh = read(V22_BINARY).mesh;
    let parts = connected_parts(&mesh);
    assert_eq!(parts.len(), 3);
    assert_eq!(parts.iter().map(|part| part.elements).sum::<usize>(), mesh.element_count());
    assert_eq!(parts.iter().map(|part| part.nodes).sum::<usize>(), mesh.nodes.len());
    assert!(parts.windows(2).all(|pair| pair[0].elements >= pair[1].elements));
}

#[test]
fn groups_become_regions_and_sets_with_their_mid_side_nodes() {
    let mesh = read(V41_BINARY).mesh;
    let names: Vec<&str> = mesh.regions.iter().map(|region| region.name.as_str()).collect();
    assert_eq!(names, ["tets", "hexes", "wedges"]);
    assert_eq!((mesh.node_sets["rim"].len(), mesh.node_sets["corner"].len()), (3, 1));
    let at = |name: &str, x: f64| mesh.node_sets[name].iter().all(|node| mesh.nodes[*node as usize].x == x);
    assert!(at("left", 0.0) && at("right", 5.0));
    assert_eq!(mesh.node_sets["right"].len(), 8); // one second-order quadrangle
}

#[test]
fn lengths_are_converted_with_the_named_units() {
    let options = ReadOptions { units: "mm-t-s".parse::<UnitSystem>().unwrap(), ..ReadOptions::default() };
    let (small, large) = (parse_mesh(V41, "mm", &options).unwrap().mesh, read(V41).mesh);
    assert!(small.nodes.iter().zip(&large.nodes).all(|(a, b)| (a - b * 1e-3).norm() < 1e-18));
}

/// Converts the numbers of a text file of version 4.1 to binary of either byte order, with `size_t`
/// of 4 or 8 bytes.
fn as_binary(text: &[u8], big_endian: bool, size: usize) -> Vec<u8> {
    let mut words = std::str::from_utf8(text).unwrap().split_ascii_whitespace();
    let mut out = Vec::new();
    let ordered = |mut bytes: Vec<u8>| {
        if big_endian {
            bytes.reverse();
        }
        bytes
    };
    let int = |out: &mut Vec<u8>, words: &mut dyn Iterator<Item = &str>| -> i64 {
        let value: i64 = words.next().unwrap().parse().unwrap();
        out.extend(ordered((value as i32).to_le_bytes().to_vec()));
        value
    };
    let count = |out: &mut Vec<u8>, words: &mut dyn Iterator<Item = &str>| -> usize {
        let value: usize = words.next().unwrap().parse().unwrap();
        out.extend(ordered(value.to_le_bytes()[..size].to_vec()));
        value
    };
    let real = |out: &mut Vec<u8>, words: &mut dyn Iterator<Item = &str>| {
        out.extend(ordered(words.next().unwrap().parse::<f64>().unwrap().to_le_bytes().to_vec()));
    };
    while let Some(section) = words.next() {
        out.extend(section.as_bytes());
        out.push(b'\n');
        match section {
            "$MeshFormat" => {
                words.by_ref().take(3).for_each(drop);
                out.extend(format!("4.1 1 {size}\n").bytes());
                out.extend(ordered(vec![1, 0, 0, 0]));
            }
            "$PhysicalNames" => {
                let names: usize = words.next().unwrap().parse().unwrap();
                out.extend(format!("{names}\n").bytes());
                for _ in 0..names {
                    let line: Vec<&str> = words.by_ref().take(3).collect();
                    out.extend(format!("{}\n", line.join(" ")).bytes());
                }
            }
            "$Entities" => {
                let counts = [0; 4].map(|_| count(&mut out, &mut words));
                for (dim, entities) in counts.into_iter().enumerate() {
                    for _ in 0..entities {
                        int(&mut out, &mut words);
                        (0..if dim == 0 { 3 } else { 6 }).for_each(|_| real(&mut out, &mut words));
                        for _ in 0..if dim == 0 { 1 } else { 2 } {
                            let tags = count(&mut out, &mut words);
                            for _ in 0..tags {
                                int(&mut out, &mut words);
                            }
                        }
                    }
                }
            }
            "$Nodes" | "$Elements" => {
                let blocks = count(&mut out, &mut words);
                for _ in 0..3 {
                    count(&mut out, &mut words);
                }
                for _ in 0..blocks {
                    let header = [0; 3].map(|_| int(&mut out, &mut words));
                    let things = count(&mut out, &mut words);
                    if section == "$Nodes" {
                        for _ in 0..things {
                            count(&mut out, &mut words);
                        }
                        (0..3 * things).for_each(|_| real(&mut out, &mut words));
                        continue;
                    }
                    let nodes = match header[2] {
                        15 => 1,
                        8 => 3,
                        9 => 6,
                        16 => 8,
                        11 => 10,
                        17 => 20,
                        18 => 15,
                        other => panic!("type {other}"),
                    };
                    for _ in 0..things * (1 + nodes) {
                        count(&mut out, &mut words);
                    }
                }
            }
            other => panic!("{other}"),
        }
        out.push(b'\n');
        out.extend(words.next().unwrap().as_bytes());
        out.push(b'\n');
    }
    out
}

#[test]
fn binary_files_of_either_byte_order_and_word_size_are_read() {
    let truth = read(V41).mesh;
    for big_endian in [false, true] {
        for size in [4, 8] {
            let file = read(&as_binary(V41, big_endian, size));
            assert_eq!((file.format, &file.mesh), ("Gmsh MSH 4.1 binary", &truth), "{big_endian} {size}");
        }
    }
}

#[test]
fn a_compressed_file_is_the_same_and_a_cut_one_is_refused() {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(V41_BINARY).unwrap();
    let packed = encoder.finish().unwrap();
    assert_eq!(read(&packed), read(V41_BINARY));
    let error = parse_mesh(&packed[..packed.len() / 2], "cut.msh.gz", &ReadOptions::default()).unwrap_err();
    assert_eq!(&*error.expected, "a whole gzip file");
}

#[test]
fn a_cut_file_is_refused_wherever_it_is_cut() {
    for bytes in [V22, V22_BINARY, V41, V41_BINARY] {
        for end in (0..bytes.len() - 20).step_by(97) {
            let error = parse_mesh(&bytes[..end], "cut", &ReadOptions::default()).unwrap_err();
            assert!(!error.expected.contains("fewer than") && !error.found.contains("too many"), "{error}");
        }
    }
}

#[test]
fn a_count_that_the_file_cannot_hold_is_refused_before_memory_is_taken() {
    let text = String::from_utf8(V22.to_vec()).unwrap();
    let wild = text.replacen("$Nodes\n145\n", "$Nodes\n900000000000000\n", 1);
    let error = parse_mesh(wild.as_bytes(), "wild.msh", &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("900000000000000"), "{error}");
}

/// Any mesh that is read must satisfy the invariants of `Mesh`, and functions on it must not panic.
fn check_if_read(bytes: &[u8]) -> Result<(), TestCaseError> {
    let Ok(MeshFile { mesh, .. }) = parse_mesh(bytes, "fuzz", &ReadOptions::default()) else { return Ok(()) };
    let nodes = mesh.nodes.len();
    prop_assert!(mesh.element_count() > 0 && mesh.node_ids.len() == nodes);
    prop_assert!(mesh.nodes.iter().all(|p: &Vector3<f64>| p.iter().all(|x| x.is_finite())));
    for block in &mesh.blocks {
        prop_assert!(block.region < mesh.regions.len());
        prop_assert_eq!(block.connectivity.len(), block.len() * block.kind.nodes());
        prop_assert!(block.connectivity.iter().all(|node| (*node as usize) < nodes));
    }
    for set in mesh.node_sets.values() {
        prop_assert!(!set.is_empty() && set.windows(2).all(|pair| pair[0] < pair[1]));
        prop_assert!(set.iter().all(|node| (*node as usize) < nodes));
    }
    skin(&mesh).triangles();
    prop_assert!(!connected_parts(&mesh).is_empty());
    Ok(())
}

fn any_fixture() -> impl Strategy<Value = &'static [u8]> {
    prop::sample::select(vec![V22, V22_BINARY, V41, V41_BINARY, DECK])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_bytes_at_all_stop_the_reader(
        start in prop::sample::select(vec!["", "*", "*NODE\n", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "$MeshFormat\n2.2 1 8\n\u{1}\0\0\0\n$EndMeshFormat\n$Nodes\n", "\u{1f}\u{8b}"]),
        rest in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        check_if_read(&[start.as_bytes(), &rest].concat())?;
    }

    #[test]
    fn no_change_of_a_few_bytes_stops_the_reader(
        fixture in any_fixture(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = fixture.to_vec();
        for (place, value) in changes {
            *place.get_mut(&mut bytes) = value;
        }
        check_if_read(&bytes)?;
    }

    #[test]
    fn no_exchange_of_words_stops_the_reader(
        fixture in prop::sample::select(vec![V22, V41, DECK]),
        place in any::<prop::sample::Index>(),
        word in prop::sample::select(vec!["0", "-1", "99999999999999999999", "18446744073709551615", "1e999", "nan", "*STEP", "$End", ",,,", "17", ""]),
    ) {
        let text = std::str::from_utf8(fixture).unwrap();
        let mut words: Vec<&str> = text.split(' ').collect();
        *place.get_mut(&mut words) = word;
        check_if_read(words.join(" ").as_bytes())?;
    }

    #[test]
    fn no_part_left_out_stops_the_reader(
        fixture in any_fixture(),
        from in any::<prop::sample::Index>(),
        length in 1..400_usize,
    ) {
        let mut bytes = fixture.to_vec();
        let from = from.index(bytes.len());
        bytes.drain(from..(from + length).min(fixture.len()));
        check_if_read(&bytes)?;
    }
}
