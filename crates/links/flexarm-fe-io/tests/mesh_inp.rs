//! Hand-written CalculiX and Abaqus decks: cards, sets, sections, and rejected input with its
//! advice.

use flexarm_fe_io::{FeFileError, FilePosition, MeshFile, ReadOptions, parse_mesh};
use flexarm_fem::mesh::BeamProperties;
use flexarm_fem::{BeamTheory, ElementKind, Section};
use nalgebra::Vector3;

/// A unit cube with a tetrahedron on top; nodes 1 to 9.
const NODES: &str =
    "*NODE, NSET=Nall\n1, 0,0,0\n2, 1,0,0\n3, 1,1,0\n4, 0,1,0\n5, 0,0,1\n6, 1,0,1\n7, 1,1,1\n8, 0,1,1\n9, .2,.2,2\n";
const CUBE: &str = "*ELEMENT, TYPE=C3D8, ELSET=cube\n1, 1,2,3,4,5,6,7,8\n";

fn read(text: &str) -> Result<MeshFile, FeFileError> {
    parse_mesh(text.as_bytes(), "hand.inp", &ReadOptions::default())
}

fn cube_and(more: &str) -> Result<MeshFile, FeFileError> {
    read(&format!("{NODES}{CUBE}{more}"))
}

#[test]
fn keywords_are_read_in_any_case_with_blanks_comments_and_fortran_numbers() {
    let text = "** a comment\r\n*Heading\r\n any, text\r\n* node , nset = \"All Nodes\"\r\n1, 0., 0.d0, 0\r\n2, 1.0D+00,,\r\n\
                ** between\r\n3, 0, 1\r\n4, 0, 0, 1.0+0,\r\n\r\n*Element, Type = c3d4,\r\n ElSet=Body\r\n5, 1, 2,\r\n3, 4\r\n";
    let mesh = read(text).unwrap().mesh;
    assert_eq!(mesh.nodes, [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()]);
    assert_eq!((mesh.blocks[0].ids[0], &mesh.blocks[0].connectivity[..]), (5, &[0, 1, 2, 3][..]));
    assert_eq!(mesh.node_sets["All Nodes"].len(), 4);
    assert_eq!(mesh.regions[0].name, "Body");
}

#[test]
fn sets_may_be_generated_nested_and_taken_from_elements() {
    let sets = "*NSET, NSET=odd, GENERATE\n1, 99, 2\n*NSET, NSET=low\n1, 2, 3\n4\n*NSET, NSET=both\nODD, low,\n\
                *NSET, NSET=of_cube, ELSET=CUBE\n*NSET, NSET=low\n9\n*NSET, NSET=self\n2, self\n\
                *NSET, NSET=none\n*ELSET, ELSET=e1, GENERATE\n1, 1\n*ELSET, ELSET=e2\ne1\n*NSET, NSET=of_e2, ELSET=e2\n";
    let file = cube_and(sets).unwrap();
    let set = |name: &str| -> Vec<u64> {
        file.mesh.node_sets[name].iter().map(|node| file.mesh.node_ids[*node as usize]).collect()
    };
    assert_eq!(set("odd"), [1, 3, 5, 7, 9]);
    assert_eq!(set("low"), [1, 2, 3, 4, 9]);
    assert_eq!(set("both"), [1, 2, 3, 4, 5, 7, 9]);
    assert_eq!(set("of_cube"), (1..=8).collect::<Vec<u64>>());
    assert_eq!((set("self"), set("of_e2")), (vec![2], set("of_cube")));
    assert!(file.warnings.iter().any(|warning| warning.contains("\"none\" is empty")), "{:?}", file.warnings);
}

#[test]
fn sets_that_contain_each_other_over_and_over_are_resolved_all_the_same() {
    let mut sets = "*NSET, NSET=s0\n1\n".to_owned();
    for k in 1..300 {
        sets += &format!("*NSET, NSET=s{k}\ns{}, s{}\n", k - 1, k - 1);
    }
    sets += "*NSET, NSET=s0\ns299, 2\n";
    assert_eq!(cube_and(&sets).unwrap().mesh.node_sets["s100"], [0, 1]);

    // Nesting so deep that the work would grow without bound is rejected at once.
    let deep: String = (1..100_000).map(|k| format!("*NSET, NSET=s{k}\ns{}\n", k - 1)).collect();
    let error = cube_and(&format!("*NSET, NSET=s0\n1\n{deep}")).unwrap_err();
    assert!(error.to_string().contains("too many members"), "{error}");
}

#[test]
fn plane_elements_and_lines_that_gmsh_writes_for_groups_give_node_sets() {
    let skins = "*ELEMENT, TYPE=CPS4, ELSET=Surface1\n2, 1,2,3,4\n*ELEMENT, TYPE=T3D2, ELSET=Line1\n3, 1,2\n\
                 *ELSET, ELSET=interface_A\n2\n*ELSET, ELSET=all_of_it\n1, 2\n";
    let mesh = cube_and(skins).unwrap().mesh;
    assert_eq!(mesh.element_count(), 1);
    assert_eq!((&mesh.node_sets["interface_A"][..], &mesh.node_sets["Line1"][..]), (&[0, 1, 2, 3][..], &[0, 1][..]));
    assert!(!mesh.node_sets.contains_key("all_of_it"));
}

#[test]
fn beams_without_a_section_take_the_one_that_the_caller_gives() {
    let section = Section::Circle { diameter: 0.02 };
    let tube = BeamProperties { section, y_axis: Vector3::y(), theory: BeamTheory::Timoshenko };
    let text = format!("{NODES}{CUBE}*ELEMENT, TYPE=B31, ELSET=spine\n2, 1,2\n");
    let options = |name: &str| ReadOptions { beams: vec![(name.into(), tube.clone())], ..ReadOptions::default() };
    let mesh = parse_mesh(text.as_bytes(), "hand.inp", &options("Spine")).unwrap().mesh;
    assert_eq!((&mesh.regions[0].beam, &mesh.regions[1].beam), (&None, &Some(tube.clone())));
    let error = parse_mesh(text.as_bytes(), "hand.inp", &options("cube")).unwrap_err();
    assert!(error.to_string().contains("a set of beam elements: spine"), "{error}");
}

#[test]
fn surfaces_give_the_nodes_of_their_faces() {
    let surfaces = "*ELEMENT, TYPE=C3D4, ELSET=tip\n2, 5,6,8,9\n*SURFACE, NAME=bottom\ncube, S1\n\
                    *SURFACE, NAME=mixed, TYPE=ELEMENT\n1, S4\ntip, s2\n*NSET, NSET=n\n1\n*SURFACE, NAME=points, TYPE=NODE\nn, 1.\n9,\n";
    let mesh = cube_and(surfaces).unwrap().mesh;
    assert_eq!(mesh.node_sets["bottom"], [0, 1, 2, 3]);
    // Abaqus: S4 of a brick is 2-6-7-3, S2 of a tetrahedron 1-4-2.
    assert_eq!(mesh.node_sets["mixed"], [1, 2, 4, 5, 6, 8]);
    assert_eq!(mesh.node_sets["points"], [0, 8]);
    let error = cube_and("*SURFACE, NAME=bottom\ncube, S7\n").unwrap_err();
    assert!(error.to_string().contains("a face S1 to S6 of a solid"), "{error}");
}

#[test]
fn sections_make_regions_with_materials_in_si() {
    let text = format!(
        "{NODES}{CUBE}*ELEMENT, TYPE=C3D4, ELSET=tip\n2, 5,6,8,9\n*MATERIAL, NAME=Steel\n*ELASTIC\n210000., .3, 20.\n\
         200000., .3, 100.\n*DENSITY\n7.85e-9\n*EXPANSION\n1e-5\n*SOLID SECTION, ELSET=CUBE, MATERIAL=STEEL\n1.,\n"
    );
    let options = ReadOptions { units: "mm-t-s".parse().unwrap(), ..ReadOptions::default() };
    let file = parse_mesh(text.as_bytes(), "hand.inp", &options).unwrap();
    let [cube, tip] = &file.mesh.regions[..] else { panic!("{:?}", file.mesh.regions) };
    let steel = cube.material.unwrap();
    assert!((steel.E / 210e9 - 1.0).abs() < 1e-12 && (steel.rho / 7850.0 - 1.0).abs() < 1e-12 && steel.nu == 0.3);
    assert_eq!((cube.name.as_str(), tip.name.as_str(), tip.material), ("cube", "tip", None));
    let warnings = file.warnings.join("\n");
    for word in ["depends on temperature", "without a material: tip", "ignored cards: *EXPANSION"] {
        assert!(warnings.contains(word), "{warnings}");
    }
}

#[test]
fn beams_take_shape_and_direction_from_their_section() {
    for (kind, shape, truth) in [
        ("B31", "RECT\n.02, .04", Section::Rectangle { width: 0.02, height: 0.04 }),
        ("B33", "CIRC\n.02", Section::Circle { diameter: 0.04 }),
        ("B31", "CIRC\n.02, .02", Section::Circle { diameter: 0.02 }),
        ("B31", "PIPE\n.02, .003", Section::Tube { outer_diameter: 0.04, wall: 0.003 }),
        ("B31", "BOX\n.1, .06, .004, .004, .004, .004", Section::Box { width: 0.1, height: 0.06, wall: 0.004 }),
    ] {
        let text = format!(
            "{NODES}*ELEMENT, TYPE={kind}, ELSET=spine\n1, 1,2\n2, 2,3\n*MATERIAL, NAME=m\n*ELASTIC\n2e11,.3\n*DENSITY\n7800\n\
             *BEAM SECTION, ELSET=spine, MATERIAL=m, SECTION={shape}\n0., 0., 1.\n"
        );
        let MeshFile { mesh, warnings, .. } = read(&text).unwrap();
        let ambiguous = warnings.iter().any(|warning| warning.contains("CalculiX takes it as a diameter"));
        assert_eq!(ambiguous, shape == "CIRC\n.02");
        let beam = mesh.regions[0].beam.clone().unwrap();
        assert_eq!((beam.section, beam.y_axis), (truth, Vector3::z()));
        let theory = if kind == "B33" { BeamTheory::EulerBernoulli } else { BeamTheory::Timoshenko };
        assert_eq!((beam.theory, mesh.blocks[0].kind), (theory, ElementKind::Beam2));
    }
}

#[test]
fn types_with_rules_of_their_own_are_read_as_plain_ones_with_a_remark() {
    let file = read(&format!("{NODES}*ELEMENT, TYPE=C3D8R\n1, 1,2,3,4,5,6,7,8\n")).unwrap();
    assert_eq!(file.mesh.blocks[0].kind, ElementKind::Hex8);
    assert!(
        file.warnings.iter().any(|warning| warning.starts_with("C3D8R: reduced integration")),
        "{:?}",
        file.warnings
    );
    assert_eq!(file.mesh.regions[0].name, "all");
}

#[test]
fn loads_and_steps_are_passed_over_and_named() {
    let file = cube_and(
        "*BOUNDARY\n1,1,3\n*EQUATION\n2\n1,1,1.,2,1,-1.\n*BOUNDARY\n2,1\n*STEP\n*STATIC\n*NODE FILE\nU\n*END STEP\n",
    );
    let warnings = file.unwrap().warnings;
    let truth = "ignored cards: *BOUNDARY (2 times), *EQUATION, *STEP, *STATIC, *NODE FILE, *END STEP";
    assert!(warnings.iter().any(|warning| warning == truth), "{warnings:?}");
}

#[test]
fn one_instance_in_place_is_a_flat_deck_and_more_are_refused() {
    let part = format!("*Part, name=P\n{NODES}{CUBE}*Nset, nset=A\n1\n*End Part\n*Assembly, name=Assembly\n");
    let rest = "*Node\n1, 5,5,5\n*Nset, nset=A, instance=P-1\n2, 3\n*Nset, nset=RP\n1\n*Nset, nset=B\nP-1.A, P-1.7\n*End Assembly\n";
    let file = read(&format!("{part}*Instance, name=P-1, part=P\n*End Instance\n{rest}")).unwrap();
    let sets = &file.mesh.node_sets;
    // The set of the assembly keeps its name; its reference points are not nodes of the mesh.
    assert_eq!((&sets["A"][..], &sets["part.A"][..]), (&[1, 2][..], &[0][..]));
    assert!(!sets.contains_key("RP") && file.mesh.nodes.len() == 9);
    assert_eq!(sets["B"], [1, 2, 6]);

    for moved in ["1., 0., 0.\n", "0,0,0\n0,0,0, 0,0,1, 90\n"] {
        let error = read(&format!("{part}*Instance, name=P-1, part=P\n{moved}*End Instance\n{rest}")).unwrap_err();
        assert!(error.to_string().contains("merge the instances"), "{error}");
    }
    let two = "*Instance, name=P-1, part=P\n*End Instance\n*Instance, name=P-2, part=P\n*End Instance\n";
    assert!(read(&format!("{part}{two}{rest}")).unwrap_err().to_string().contains("a second *INSTANCE"));
}

#[test]
fn what_cannot_be_read_is_refused_with_line_and_advice() {
    let sections = "*MATERIAL, NAME=m\n*ELASTIC\n1,.3\n*DENSITY\n1\n*SOLID SECTION, ELSET=cube, MATERIAL=m\n";
    for (more, line, word) in [
        ("*INCLUDE, INPUT=mesh.inp\n", 13, "\"mesh.inp\""),
        ("*ELEMENT, TYPE=S4R\n2, 1,2,3,4\n", 13, "mesh the part with solids"),
        ("*ELEMENT, TYPE=B32\n2, 1,2,3\n", 13, "B31 or B33"),
        ("*ELEMENT, TYPE=C3D4\n2, 1,2,3\n", 14, "found 3 nodes; expected 4 nodes"),
        ("*ELEMENT, TYPE=C3D4\n2, 1,2,3,4,5\n", 14, "found 5 nodes"),
        ("*ELEMENT, TYPE=C3D4\n2, 1,2,3,99\n", 14, "node 99"),
        ("*ELEMENT, TYPE=C3D4\n1, 1,2,3,5\n", 14, "element 1"),
        ("*ELEMENT, TYPE=C3D8\n2, 1,2,3,4,5,6,7,8\n", 14, "elements 1 and 2"),
        ("*ELEMENT, TYPE=C3D4\n2, 1,2,3,3\n", 14, "node 3 twice"),
        ("*NODE\n1, 0,0,0\n", 14, "node 1"),
        ("*NODE\n10, 0,nan,0\n", 14, "node 10"),
        ("*NODE, SYSTEM=C\n", 13, "rectangular"),
        ("*NSET, NSET=a\n1, nobody\n", 14, "Nall"),
        ("*NSET, NSET=a\n1, 77\n", 13, "node 77"),
        ("*NSET, NSET=a, GENERATE\n1, 7, 0\n", 14, "first, last, step"),
        ("*MATERIAL, NAME=m\n*ELASTIC, TYPE=ORTHO\n1,1,1\n", 14, "isotropic"),
        ("*MATERIAL, NAME=m\n*ELASTIC\n1\n", 14, "E, nu"),
        ("*MATERIAL, NAME=m\n*MATERIAL, NAME=M\n", 14, "second material"),
        ("*SOLID SECTION, ELSET=cube, MATERIAL=m\n", 13, "MATERIAL=m"),
        ("*SOLID SECTION, ELSET=cub, MATERIAL=m\n", 13, "one of: cube"),
    ] {
        let error = cube_and(more).unwrap_err();
        assert_eq!(error.place, FilePosition::Line(line), "{more}{error}");
        assert!(error.to_string().contains(word), "{error}");
    }
    for (more, word) in [
        ("*SOLID SECTION, ELSET=cube, MATERIAL=m\n", "a second section"),
        ("*ELEMENT, TYPE=B31, ELSET=b\n2, 1,2\n*SOLID SECTION, ELSET=b, MATERIAL=m\n", "B31 with *SOLID SECTION"),
        (
            "*ELEMENT, TYPE=B31, ELSET=b\n2, 1,2\n*BEAM SECTION, ELSET=b, MATERIAL=m, SECTION=I\n1\n",
            "PIPE (radius, wall)",
        ),
        (
            "*ELEMENT, TYPE=B31, ELSET=b\n2, 1,2\n*BEAM SECTION, ELSET=b, MATERIAL=m, SECTION=PIPE\n1,2\n",
            "wall thickness",
        ),
    ] {
        let error = cube_and(&format!("{sections}{more}")).unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
    }
    assert!(cube_and(&sections.replace(".3", ".7")).unwrap_err().to_string().contains("Poisson"));
}
