//! Every fault is found once, with its line and a remedy.

use crate::common::{TestFolder, hinge, link, problem, problems, problems_with, robot, with_joint};
use flexarm_settings::Severity;
use flexarm_urdf::{ReadOptions, UrdfError, check_urdf, check_urdf_text, parse_urdf, read_urdf};

#[track_caller]
fn assert_code(text: &str, line: u32, code: &str) {
    let (found_line, found) = problem(text);
    assert_eq!((&*found.code, found_line), (code, line), "{found}");
    assert!(!found.help.is_empty() && !found.message.is_empty());
}

#[track_caller]
fn assert_message(text: &str, line: u32, code: &str, message: &str) {
    let (found_line, found) = problem(text);
    assert_eq!((found_line, &*found.code, &*found.message), (line, code, message));
}

#[test]
fn malformed_xml_names_what_was_found_and_expected() {
    let cases = [
        ("", "the end of the file", "<robot"),
        ("<robot name='r'>\n<link name='a'>\n", "the end of the file", "</link>, which is opened at robot.urdf:2:1"),
        ("<robot name='r'>\n<link name='a", "the end of the file", "the rest of <link ...>"),
        ("<robot name='r'><link name='a'></joint></robot>", "</joint>", "</link>"),
        ("<robot name='r' name='s'/>", "a second attribute \"name\"", "once"),
        ("<robot><xacro:link/></robot>", "undeclared prefix", "xmlns:xacro"),
        ("<robot>&boo;</robot>", "unknown entity", "plain text"),
        ("<robot name=r/>", "'r'", "quote"),
        ("plain text", "", ""),
    ];
    for (text, found_part, expected_part) in cases {
        let (_, fault) = problem(text);
        assert_eq!(fault.code, "malformed-xml");
        let (found, expected) = fault.message.split_once(", expected ").unwrap();
        assert!(found.contains(found_part), "{text:?}: {found}");
        assert!(expected.contains(expected_part), "{text:?}: {expected}");
    }
    let error = parse_urdf("<robot name='r'>\n  <link name='a'></robot>", "arm.urdf", &ReadOptions::default());
    let text = error.unwrap_err().to_string();
    assert!(text.starts_with("arm.urdf:2:18: found </robot>, expected </link>"), "{text}");
}

#[test]
fn other_files_are_recognised() {
    assert_code("<sdf/>", 1, "not-urdf");
    assert!(problem("<mujoco/>").1.help.contains("MJCF"));
    let macros = "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>\n<xacro:macro name='m'/></robot>";
    assert_code(macros, 1, "no-link");
    let folder = TestFolder::new();
    let path = folder.write("a.urdf", b"<robot name='\xff'/>");
    let error = read_urdf(&path, &ReadOptions::default()).unwrap_err();
    let issue = &error.issues()[0];
    assert_eq!((&*issue.code, &*issue.message), ("not-utf8", "the byte 0xff is not UTF-8 text"));
    assert!(issue.location.ends_with("a.urdf:1:14"), "{issue}");
}

#[test]
fn unreadable_files_say_so() {
    let folder = TestFolder::new();
    let missing = folder.0.join("missing.urdf");
    assert!(matches!(read_urdf(&missing, &ReadOptions::default()), Err(UrdfError::Io { .. })));
    assert!(matches!(read_urdf(&folder, &ReadOptions::default()), Err(UrdfError::Io { .. })));
    let finding = &check_urdf(&missing, &ReadOptions::default())[0];
    assert_eq!((&*finding.code, &*finding.help), ("unreadable", "correct the path"));
    let error = read_urdf(&missing, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with("help: correct the path"), "{error}");
}

#[test]
fn names_are_unique_and_known() {
    assert_code("<robot name='r'/>", 1, "no-link");
    assert_code(&robot(&[&link("a"), &link("b"), &hinge("j", "a", "b"), &link("b")]), 5, "duplicate-link");
    let twice = robot(&[&link("a"), &link("b"), &link("c"), &hinge("j", "a", "b"), &hinge("j", "b", "c")]);
    assert_message(&twice, 6, "duplicate-joint", "joint \"j\" is defined twice, first at robot.urdf:5:1");

    let unknown = robot(&[&link("base_link"), &link("arm"), &hinge("j", "base_lnk", "arm")]);
    assert_message(&unknown, 4, "unknown-link", "joint \"j\": its parent link \"base_lnk\" does not exist");
    assert_eq!(problem(&unknown).1.help, "did you mean \"base_link\"?");
}

#[test]
fn the_links_form_one_tree() {
    let two = robot(&[
        &link("a"),
        &link("b"),
        &link("c"),
        &hinge("j", "a", "b"),
        &hinge("k", "a", "c"),
        &hinge("l", "b", "c"),
    ]);
    let message = "link \"c\" is the child of two joints, \"k\" (robot.urdf:6:1) and \"l\"";
    assert_message(&two, 7, "two-parents", message);

    let cycle = robot(&[&link("a"), &link("b"), &link("c"), &hinge("j", "b", "c"), &hinge("k", "c", "b")]);
    let (_, fault) = problem(&cycle);
    assert_eq!((&*fault.code, fault.message.matches('"').count()), ("cycle", 4), "{fault}");
    assert_code(&robot(&[&link("a"), &hinge("j", "a", "a")]), 3, "cycle");

    let apart = robot(&[&link("a"), &link("b"), &link("c"), &hinge("j", "a", "b")]);
    let message = "the links are not connected: \"a\", \"c\" have no parent joint, expected one base link";
    assert_message(&apart, 4, "disconnected", message);
}

#[test]
fn missing_parts_are_named() {
    assert_code(&robot(&["<link/>\n", &link("a")]), 2, "missing-attribute");
    let no_mass =
        "<link name='a'><inertial><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>";
    assert_message(&robot(&[no_mass]), 2, "missing-element", "link \"a\", <inertial> has no <mass>");
    let no_parent = with_joint("<joint name='j' type='continuous'><child link='arm'/></joint>");
    assert_code(&no_parent, 4, "missing-element");
    let empty = "<joint name='j' type='continuous'><parent link=''/><child link='arm'/></joint>";
    assert_code(&with_joint(empty), 4, "missing-attribute");
    assert_code(&robot(&["<link name='a'><visual><geometry/></visual></link>"]), 2, "missing-element");
    assert_code(
        &with_joint("<joint name='j'><parent link='base'/><child link='arm'/></joint>"),
        4,
        "missing-attribute",
    );
}

#[test]
fn what_is_not_a_finite_number_is_refused_where_it_stands() {
    for word in ["NaN", "inf", "1,5", "", "0x10", "1e999", "two"] {
        let text = robot(&[&link("a").replace("value=\"2\"", &format!("value=\"{word}\""))]);
        let (line, fault) = problem(&text);
        assert_eq!((line, &*fault.code), (2, "not-a-number"));
        let found = format!("link \"a\", <mass>: value={word:?}, expected ");
        assert!(fault.message.starts_with(&found), "{fault}");
    }
    for origin in ["xyz='0 0'", "xyz='0 0 0 0'", "rpy='0 x 0 0'", "rpy='0 0 nan'"] {
        let joint = hinge("j", "base", "arm").replace("<axis", &format!("\n<origin {origin}/><axis"));
        assert_code(&with_joint(&joint), 5, "not-a-number");
    }
    let limit = "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/>\
                 <limit lower='-1' upper='one' effort='1' velocity='1'/></joint>";
    assert_code(&with_joint(limit), 4, "not-a-number");
}

#[test]
fn joint_types_and_limits() {
    let joint = |kind: &str, limit: &str| {
        let text = format!(
            "<joint name='j' type='{kind}'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>{limit}</joint>"
        );
        with_joint(&text)
    };
    for kind in ["floating", "planar", "spherical"] {
        let (line, fault) = problem(&joint(kind, ""));
        assert_eq!((line, &*fault.code), (4, "unsupported-joint"));
        assert!(fault.message.contains(kind) && fault.help.contains("joint"));
    }
    let (_, fault) = problem(&joint("revolut", ""));
    assert_eq!(fault.help, "did you mean \"revolute\"?");
    assert_message(&joint("revolute", ""), 4, "missing-limit", "revolute joint \"j\" has no <limit>");
    assert_eq!(problem(&joint("prismatic", "")).1.code, "missing-limit");
    let reversed = joint("revolute", "<limit lower='1' upper='-1' effort='1' velocity='1'/>");
    assert_message(&reversed, 4, "limits-reversed", "joint \"j\": the lower limit 1 is above the upper limit -1");
    let negative = joint("continuous", "<limit effort='-1' velocity='1'/>");
    assert_message(&negative, 4, "negative-limit", "joint \"j\": the effort limit -1 is negative");
    let zero = joint("continuous", "").replace("0 0 1", "0 0 0");
    assert_message(&zero, 4, "zero-axis", "joint \"j\": the axis is the zero vector");
}

#[test]
fn followers_have_a_leader_that_moves() {
    let follower =
        |leader: &str| hinge("j", "base", "arm").replace("</joint>", &format!("<mimic joint='{leader}'/></joint>"));
    let (_, fault) = problem(&with_joint(&follower("jj")));
    assert_eq!(fault.code, "unknown-mimic");
    let itself = "the joints \"j\" mimic each other in a circle";
    assert_message(&with_joint(&follower("j")), 4, "mimic-cycle", itself);
    let two =
        hinge("j", "base", "arm").replace("</joint>", "<mimic joint='a'/><mimic joint='b' multiplier='2'/></joint>");
    let (a, b) = (hinge("a", "arm", "hand"), hinge("b", "hand", "tip"));
    let text = robot(&[&link("base"), &link("arm"), &link("hand"), &link("tip"), &two, &a, &b]);
    let (_, fault) = problem(&text);
    assert_eq!(fault.message, "joint \"j\" has 2 <mimic>; a joint follows one other joint");
    assert!(fault.help.contains("[[loop]]"), "{}", fault.help);
    let fixed = "<joint name='f' type='fixed'><parent link='arm'/><child link='tip'/></joint>\n";
    let text = robot(&[&link("base"), &link("arm"), "<link name='tip'/>\n", &follower("f"), fixed]);
    assert_eq!(warned(&text), ["mimic-fixed"]);
    let second = hinge("k", "arm", "hand").replace("</joint>", "<mimic joint='j'/></joint>");
    let third = hinge("l", "hand", "tip").replace("</joint>", "<mimic joint='j'/></joint>");
    let text = robot(&[&link("base"), &link("arm"), &link("hand"), &link("tip"), &follower("k"), &second, &third]);
    assert_eq!(problem(&text).1.message, "the joints \"j\", \"k\" mimic each other in a circle");
}

/// Codes of the warnings about a usable robot.
fn warned(text: &str) -> Vec<String> {
    let robot = parse_urdf(text, "r.urdf", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    robot.warnings_only().map(|finding| finding.code.clone()).collect()
}

/// A joint with prescribed motion needs no mass, but a missing mass gives a warning.
#[test]
fn a_moving_link_without_mass_is_told_and_taken() {
    assert_eq!(warned(&with_inertial("")), ["missing-inertial"]);
    assert_eq!(warned(&with_inertial(&inertial(0.0, [0.0; 3]))), ["zero-mass"]);
    for moments in [[0.0, 0.0, 0.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1e-7]] {
        assert_eq!(warned(&with_inertial(&inertial(1.0, moments))), ["point-mass"]);
    }
    let names = ["a", "b", "c", "d", "e"];
    let links: Vec<String> = names.iter().map(|n| format!("<link name='{n}'/>\n")).collect();
    let joints: Vec<String> = names.windows(2).map(|w| hinge(w[1], w[0], w[1])).collect();
    let parts: Vec<&str> = links.iter().chain(&joints).map(String::as_str).collect();
    let text = robot(&parts);
    let robot = parse_urdf(&text, "r.urdf", &ReadOptions::default()).unwrap();
    let told: Vec<_> = robot.warnings_only().collect();
    assert!(told.len() == 1 && told[0].message.contains("4 moving links have no mass: \"b\", \"c\""), "{told:?}");
    assert!(told[0].help.contains("(inertia_from_density or inertia_from_total_mass, "));
}

/// Slightly negative moments due to rounding are accepted: six digits of the file, a micrometre
/// about the mass, no mass.
#[test]
fn a_moment_below_zero_by_rounding_is_zero() {
    for (mass, moments) in [
        (1.0, [-2e-35, 0.0, 0.0]),
        (0.0, [-2e-35, -2e-35, 1e-35]),
        (2.0, [1.0, 1.0, -1e-7]),
        (1.0, [-1e-13, 1e-14, 1e-14]),
    ] {
        let codes = warned(&with_inertial(&inertial(mass, moments)));
        assert!(codes == ["point-mass"] || codes == ["zero-mass"], "{moments:?}: {codes:?}");
    }
}

/// Truth: links fixed to the base do not affect the motion, so the same tensor is a warning at the
/// base and an error on an arm.
#[test]
fn inertia_fixed_to_the_base_is_no_error_and_can_be_waived() {
    let bad = format!("<link name='foot'>{}</link>\n", inertial(1.0, [1.0, 1.0, -1.0]));
    let weld = "<joint name='w' type='fixed'><parent link='base'/><child link='foot'/></joint>\n";
    let arm = format!("<link name='arm'>{}</link>\n", inertial(1.0, [1.0; 3]));
    let text = robot(&[&link("base"), &bad, weld, &arm, &hinge("j", "base", "arm")]);
    assert_eq!(warned(&text), ["inertia-not-positive-definite"]);
    let read = parse_urdf(&text, "r.urdf", &ReadOptions::default()).unwrap();
    flexarm_kinematics::Model::new(&read.mechanism).unwrap();
    let waived = ReadOptions { waive: vec!["foot".into()], ..ReadOptions::default() };
    assert_eq!(parse_urdf(&text, "r.urdf", &waived).unwrap().warnings_only().count(), 0);
}

/// Truth: a joint that follows a fixed one is at its offset, here a quarter turn.
#[test]
fn what_follows_a_fixed_joint_is_fixed_at_its_offset() {
    let fixed = "<joint name='f' type='fixed'><parent link='arm'/><child link='tip'/><mimic joint='j'/></joint>\n";
    let follower = hinge("j", "base", "arm")
        .replace("</joint>", "<mimic joint='f' multiplier='3' offset='1.5707963267948966'/></joint>");
    let text = robot(&[&link("base"), &link("arm"), "<link name='tip'/>\n", &follower, fixed]);
    let read = parse_urdf(&text, "r.urdf", &ReadOptions::default()).unwrap();
    assert_eq!(read.warnings_only().map(|f| &*f.code).collect::<Vec<_>>(), ["mimic-fixed", "mimic-fixed"]);
    let joint = read.mechanism.joint("j").unwrap();
    assert!(joint.mimic.is_none() && joint.kind.name() == "fixed");
    approx::assert_relative_eq!(joint.X_PJ.rotation.angle(), std::f64::consts::FRAC_PI_2, max_relative = 1e-12);
}

#[test]
fn a_document_type_is_named_and_not_taken_for_the_end_of_the_file() {
    let text = format!("<?xml version='1.0'?>\n<!DOCTYPE robot>\n{}", robot(&[&link("base")]));
    let (line, fault) = problem(&text);
    assert_eq!(line, 2);
    assert!(
        fault.to_string().contains("document type declaration") && fault.to_string().contains("<!DOCTYPE"),
        "{fault}"
    );
}

/// The moving link "arm" with this `<inertial>`, in line 3.
fn with_inertial(inertial: &str) -> String {
    let arm = format!("<link name='arm'>{inertial}</link>\n");
    robot(&[&link("base"), &arm, &hinge("j", "base", "arm")])
}

fn inertial(mass: f64, moments: [f64; 3]) -> String {
    let [x, y, z] = moments;
    format!(
        "<inertial><mass value='{mass}'/><inertia ixx='{x}' iyy='{y}' izz='{z}' ixy='0' ixz='0' iyz='0'/></inertial>"
    )
}

#[test]
fn a_moving_link_has_the_mass_of_a_body() {
    let negative = "link \"arm\" has the mass -1 kg, expected a positive one";
    assert_message(&with_inertial(&inertial(-1.0, [1.0; 3])), 3, "negative-mass", negative);
    for moments in [[1.0, 1.0, -1.0], [1.0, 1.0, -1e-5]] {
        assert_code(&with_inertial(&inertial(1.0, moments)), 3, "inertia-not-positive-definite");
    }
    let (_, fault) = problem(&with_inertial(&inertial(1.0, [1.0, 1.0, 2.1])));
    assert!(fault.code == "triangle-inequality" && fault.message.ends_with(" by 1.00e-1"), "{fault}");
    // A flat plate, rounded in the seventh digit, is valid.
    assert_eq!(problems(&with_inertial(&inertial(1.0, [1.0, 1.0, 2.000001]))), []);
    assert_eq!(problem(&with_inertial(&inertial(1.0, [1e308, 1e308, 1e308]))).1.code, "inertia-not-positive-definite");
}

/// The first link of the Manutec r3 in the Modelica library: a rotor, diag(0, 1.16, 0).
#[test]
fn a_rotor_without_extent_passes_where_it_is_waived_by_name() {
    let text = with_inertial(&inertial(1.0, [0.0, 1.16, 0.0]));
    assert_eq!(problem(&text).1.code, "triangle-inequality");
    let waived = ReadOptions { waive: vec!["arm".into()], ..ReadOptions::default() };
    assert_eq!(problems_with(&text, &waived), []);
    let negative = with_inertial(&inertial(1.0, [-0.1, 1.16, 0.0]));
    assert_eq!(problems_with(&negative, &waived)[0].1.code, "inertia-not-positive-definite");
    let misspelt = ReadOptions { waive: vec!["amr".into(), "arm".into()], ..ReadOptions::default() };
    let findings = check_urdf_text(&text, "r.urdf", &misspelt);
    assert!(findings.iter().any(|f| f.code == "waived-unknown-link"));
}

/// Mass may be on links fixed to the moving one; a point mass there needs no inertia of its own.
#[test]
fn the_mass_of_fixed_children_counts() {
    let fixed = "<joint name='f' type='fixed'><parent link='arm'/><child link='body'/><origin xyz='0 0 1'/></joint>\n";
    let parts = |body: &str| {
        let body = format!("<link name='body'>{body}</link>\n");
        robot(&[&link("base"), "<link name='arm'/>\n", &body, &hinge("j", "base", "arm"), fixed])
    };
    assert!(warned(&parts(&inertial(1.0, [1.0; 3]))).is_empty());
    let told = check_urdf_text(&parts(""), "r.urdf", &ReadOptions::default());
    assert!(told.len() == 1 && told[0].message.contains("nor have the links fixed to it (\"body\")"), "{told:?}");
    assert_eq!(warned(&parts(&inertial(1.0, [0.0; 3]))), ["point-mass"]);

    let point = parts(&inertial(1.0, [0.0; 3])).replace("<link name='arm'/>", link("arm").trim());
    let findings = check_urdf_text(&point, "r.urdf", &ReadOptions::default());
    let codes: Vec<_> = findings.iter().map(|f| (f.severity, &*f.code)).collect();
    assert_eq!(codes, [(Severity::Warning, "point-mass")]);
}

#[test]
fn the_base_may_have_any_inertia() {
    let text = robot(&[&format!("<link name='base'>{}</link>", inertial(1.0, [1.0, 1.0, 3.0]))]);
    let findings = check_urdf_text(&text, "r.urdf", &ReadOptions::default());
    assert_eq!((findings[0].severity, &*findings[0].code), (Severity::Warning, "triangle-inequality"));
}

#[test]
fn all_faults_come_at_once_in_the_order_of_the_file() {
    let text = robot(&[
        &link("base"),
        &link("arm").replace("value=\"2\"", "value=\"-2\""),
        &link("arm"),
        &hinge("j", "base", "armm"),
        &hinge("k", "base", "arm").replace("0 0 1", "0 0 0"),
        &hinge("l", "arm", "base2").replace("continuous", "floating"),
    ]);
    let problems = problems(&text);
    let found: Vec<_> = problems.iter().map(|(line, p)| (*line, &*p.code)).collect();
    assert_eq!(
        found,
        [
            (3, "negative-mass"),
            (4, "duplicate-link"),
            (5, "unknown-link"),
            (6, "zero-axis"),
            (7, "unsupported-joint"),
            (7, "unknown-link")
        ]
    );
    let error = parse_urdf(&text, "arm.urdf", &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string().matches("\narm.urdf:").count(), 5);
    assert_eq!(error.to_string().matches("help: ").count(), 6);
    assert!(error.issues()[0].location.starts_with("arm.urdf:3:"), "{error}");
}
