//! Hand-written Gmsh files: groups, beams, and rejected input with its advice.

use flexarm_fe_io::{FeFileError, FilePosition, MeshFile, ReadOptions, parse_mesh};
use flexarm_fem::mesh::BeamProperties;
use flexarm_fem::{BeamTheory, ElementKind, Section};
use nalgebra::Vector3;

/// Five nodes: a unit tetrahedron and one further point.
const NODES: &str = "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n";

/// A file of version 2.2 with the given names and elements.
fn msh2(names: &str, elements: &[&str]) -> String {
    let names = match names.lines().count() {
        0 => String::new(),
        count => format!("$PhysicalNames\n{count}\n{names}\n$EndPhysicalNames\n"),
    };
    let elements = format!("$Elements\n{}\n{}\n$EndElements\n", elements.len(), elements.join("\n"));
    format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}{NODES}{elements}")
}

fn read(text: &str) -> Result<MeshFile, FeFileError> {
    parse_mesh(text.as_bytes(), "hand.msh", &ReadOptions::default())
}

fn tube() -> BeamProperties {
    let section = Section::Tube { outer_diameter: 0.05, wall: 0.005 };
    BeamProperties { section, y_axis: Vector3::y(), theory: BeamTheory::Timoshenko }
}

#[test]
fn without_physical_volumes_all_elements_are_one_region() {
    let file = read(&msh2("", &["7 4 2 0 1 1 2 3 4", "8 4 0 2 3 4 5"])).unwrap();
    assert_eq!(file.mesh.regions[0].name, "all");
    assert_eq!(file.mesh.blocks[0].ids, [7, 8]);
    assert_eq!(file.warnings, Vec::<String>::new());
}

#[test]
fn elements_in_no_physical_volume_are_left_out_where_there_are_some() {
    let file = read(&msh2("", &["7 4 2 1 1 1 2 3 4", "8 4 2 0 1 2 3 4 5"])).unwrap();
    assert_eq!((file.mesh.regions[0].name.as_str(), file.mesh.element_count()), ("physical_3_1", 1));
    assert!(file.warnings[0].contains("1 volume elements are in no physical volume"), "{:?}", file.warnings);
    assert!(file.warnings[1].contains("1 nodes belong to no element (numbers 5)"), "{:?}", file.warnings);
}

#[test]
fn a_name_used_in_two_dimensions_stays_with_the_larger_one() {
    let names = "1 4 \"end\"\n2 5 \"end\"\n0 6 \"tip (A)\"\n2 9 \"unused\"";
    let file = read(&msh2(
        names,
        &["1 4 2 1 1 1 2 3 4", "2 1 2 4 1 1 2", "3 2 2 5 1 1 2 3", "4 15 2 6 1 4", "5 2 2 8 1 1 2 4"],
    ))
    .unwrap();
    let sets = &file.mesh.node_sets;
    assert_eq!(sets.keys().collect::<Vec<_>>(), ["end", "end_curve", "physical_2_8", "tip (A)"]);
    assert_eq!(
        (&sets["end"][..], &sets["end_curve"][..], &sets["tip (A)"][..]),
        (&[0, 1, 2][..], &[0, 1][..], &[3][..])
    );
    assert!(file.warnings.iter().any(|warning| warning.contains("\"unused\" is empty")), "{:?}", file.warnings);
}

#[test]
fn lines_are_beams_only_where_the_caller_says_so() {
    let text =
        msh2("1 4 \"spine\"\n1 5 \"edge\"", &["1 1 2 4 1 1 2", "2 1 2 4 1 2 5", "3 1 2 5 1 3 4", "4 4 2 0 1 1 2 3 4"]);
    assert_eq!(read(&text).unwrap().mesh.element_count(), 1);

    let options = ReadOptions { beams: vec![("spine".into(), tube())], ..ReadOptions::default() };
    let mesh = parse_mesh(text.as_bytes(), "hand.msh", &options).unwrap().mesh;
    let beams = mesh.blocks.iter().find(|block| block.kind == ElementKind::Beam2).unwrap();
    assert_eq!((&beams.ids[..], &beams.connectivity[..]), (&[1, 2][..], &[0, 1, 1, 4][..]));
    assert_eq!((mesh.regions[beams.region].name.as_str(), &mesh.regions[beams.region].beam), ("spine", &Some(tube())));
    assert_eq!(mesh.regions.len(), 2);
    assert_eq!(mesh.node_sets["edge"], [2, 3]);

    let options = ReadOptions { beams: vec![("spin".into(), tube())], ..ReadOptions::default() };
    let error = parse_mesh(text.as_bytes(), "hand.msh", &options).unwrap_err();
    assert!(error.to_string().contains("spine, edge"), "{error}");

    let bent = msh2("1 4 \"spine\"", &["1 8 2 4 1 1 2 5", "4 4 2 0 1 1 2 3 4"]);
    let options = ReadOptions { beams: vec![("spine".into(), tube())], ..ReadOptions::default() };
    let error = parse_mesh(bent.as_bytes(), "hand.msh", &options).unwrap_err();
    assert!(error.to_string().contains("Mesh.ElementOrder=1"), "{error}");
}

#[test]
fn nothing_but_beams_is_a_mesh_too() {
    let options = ReadOptions { beams: vec![("physical_1_4".into(), tube())], ..ReadOptions::default() };
    let mesh = parse_mesh(msh2("", &["1 1 2 4 1 1 2"]).as_bytes(), "hand.msh", &options).unwrap().mesh;
    assert_eq!((mesh.regions.len(), mesh.blocks[0].region), (1, 0));
}

#[test]
fn impossible_elements_are_refused_with_their_line() {
    for (elements, word) in [
        (&["1 4 2 1 1 1 2 3 9"][..], "hand.msh:14: TET4 element 1: found node 9"),
        (&["1 4 2 1 1 1 2 3 4", "2 4 2 1 1 1 2 3 3"], "hand.msh:15: TET4 element 2: found node 3 twice"),
        (&["1 4 2 1 1 1 2 3 4", "2 4 2 1 1 2 1 3 4"], "elements 1 and 2"),
        (&["1 4 2 1 1 1 2 3 4", "2 4 2 2 1 1 2 3 4"], "one physical volume"),
        (&["1 2 2 1 1 1 2 3"], "no volume elements"),
        (&["1 2 2 1 1 1 2 9", "2 4 2 1 1 1 2 3 4"], "physical_2_1"),
        (&["1 7 2 1 1 1 2 3 4 5"], "5-node pyramid"),
        (&["1 12 2 1 1 1 2 3 4 5"], "Mesh.SecondOrderIncomplete=1"),
        (&["1 29 2 1 1 1 2 3 4 5"], "Mesh.ElementOrder=2"),
        (&["1 777 2 1 1 1 2 3 4 5"], "type 777"),
        (&["1 4 2 1 1 1 2 3"], "\"$EndElements\""),
        (&["1 4 2 1 1 1 2 x 4"], "hand.msh:14: node of an element: found \"x\""),
        (&["1 4 2 1 1 1 2 3 4 5"], "end of $Elements: found \"5\""),
    ] {
        let error = read(&msh2("", elements)).unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn impossible_nodes_are_refused_with_their_line() {
    let good = msh2("", &["1 4 2 1 1 1 2 3 4"]);
    for (from, to, line, word) in [
        ("5 1 1 1", "4 1 1 1", 10, "a second node with this number"),
        ("3 0 1 0", "3 0 inf 0", 8, "finite coordinates"),
        ("3 0 1 0", "3 0 1e400 0", 8, "finite coordinates"),
        ("3 0 1 0", "3 0 1,0 0", 8, "found \"1,0\""),
        ("3 0 1 0", "-3 0 1 0", 8, "found \"-3\""),
    ] {
        let error = read(&good.replacen(from, to, 1)).unwrap_err();
        assert_eq!(error.place, FilePosition::Line(line), "{error}");
        assert!(error.to_string().contains(word), "{error}");
    }
    // Fortran exponents and Windows line ends are accepted.
    let odd = good.replacen("3 0 1 0", "3 0 1.0D+00 0", 1).replace('\n', "\r\n");
    assert_eq!(read(&odd).unwrap().mesh, read(&good).unwrap().mesh);
}

#[test]
fn other_versions_and_partitions_are_refused_with_advice() {
    for (text, word) in [
        ("$MeshFormat\n4 0 8\n$EndMeshFormat\n", "Mesh.MshFileVersion=4.1"),
        ("$MeshFormat\n2.2 1 4\n$EndMeshFormat\n", "data size 4"),
        ("$MeshFormat\n4.1 1 8\n\u{7}\0\0\0\n$EndMeshFormat\n", "byte order"),
        ("$NOD\n1\n1 0 0 0\n$ENDNOD\n", "MSH 1 is not read"),
        ("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PartitionedEntities\n", "UnpartitionMesh"),
        ("$Comments\nnothing\n$EndComments\n", "no $MeshFormat"),
    ] {
        let message = read(text).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

#[test]
fn sections_of_no_interest_are_passed_over() {
    let good = msh2("", &["1 4 2 1 1 1 2 3 4"]);
    let more = format!("$Comments\nmade by $hand\n$EndComments\n{good}$NodeData\n1\n\"x\"\n$EndNodeData\n");
    assert_eq!(read(&more).unwrap(), read(&good).unwrap());
}

#[test]
fn an_entity_in_two_physical_volumes_is_refused_with_both_names() {
    let text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 \"body\"\n3 2 \"rib\"\n$EndPhysicalNames\n\
                $Entities\n0 0 0 1\n1 0 0 0 1 1 1 2 1 -2 0\n$EndEntities\n\
                $Nodes\n1 4 1 4\n3 1 1 4\n1\n2\n3\n4\n0 0 0 .1 .2 .3\n1 0 0 .1 .2 .3\n0 1 0 .1 .2 .3\n0 0 1 .1 .2 .3\n$EndNodes\n\
                $Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n";
    let error = read(text).unwrap_err();
    assert!(error.to_string().contains("\"body\" and \"rib\""), "{error}");
    // In one group it is read, and the parameters of its nodes are ignored.
    let mesh = read(&text.replace("1 1 1 2 1 -2 0", "1 1 1 1 -2 0")).unwrap().mesh;
    assert_eq!((mesh.regions[0].name.as_str(), mesh.nodes[3]), ("rib", Vector3::z()));
}
