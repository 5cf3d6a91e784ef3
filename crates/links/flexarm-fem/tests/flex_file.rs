//! The reduced-link file: lossless reading and writing, and a precise error for every mistake.

use crate::common::{fixed_cases, lower_arm, offset_arm, pose, spd_stiffness, turned_arm};
use approx::assert_relative_eq;
use flexarm_fem::{
    FemError, FlexErrorKind, FlexFileError, GateLimits, LinkFrames, Provenance, ReducedLink, parse_flex, read_flex,
    write_flex,
};
use flexarm_spatial::{turn6, twice};
use nalgebra::{DMatrix, Matrix6};
use proptest::prelude::*;

/// The example in the documentation of the format.
const EXAMPLE: &str = include_str!("../src/flex_file/format.md");

fn example() -> &'static str {
    EXAMPLE.split("```toml\n").nth(1).unwrap().split("```").next().unwrap()
}

/// The error after changing the text of the example.
fn error_of(from: &str, to: &str) -> FlexFileError {
    assert!(example().contains(from), "{from:?} is not in the example");
    parse_flex(&example().replacen(from, to, 1), "arm.flex").unwrap_err()
}

/// File of a link with a 12×12 or 6×6 in any axes and in mm, kN, t.
fn in_other_units(link: &ReducedLink, kind: &str, axes: &str) -> String {
    let K: DMatrix<f64> = {
        let R = match axes {
            "interface_A" => *link.X_LA.rotation.matrix(),
            "interface_B" => *link.X_LB.rotation.matrix(),
            _ => nalgebra::Matrix3::identity(),
        };
        let Q = turn6(&R);
        match kind {
            "6x6" => DMatrix::from_iterator(6, 6, (Q.transpose() * link.K_BB * Q).iter().copied()),
            _ => {
                let K = twice(&Q).transpose() * link.matrix12() * twice(&Q);
                DMatrix::from_iterator(12, 12, K.iter().copied())
            }
        }
    };
    let mut text = format!(
        "format = \"flexarm-reduced-link\"\nversion = 1\nlink = \"arm\"\n[units]\nlength = \"mm\"\n\
         force = \"kN\"\nmass = \"t\"\n[stiffness]\nkind = \"{kind}\"\naxes = \"{axes}\"\n\
         order = \"ux uy uz rx ry rz\"\nmatrix = [\n"
    );
    for i in 0..K.nrows() {
        // kN/mm = 1e6 N/m, kN = 1e3 N, kN mm = 1 N m
        let unit = |j: usize| [1e6, 1e3, 1.0][usize::from(i % 6 > 2) + usize::from(j % 6 > 2)];
        let row: Vec<_> = (0..K.ncols()).map(|j| format!("{:e}", K[(i, j)] / unit(j))).collect();
        text += &format!("[{}],\n", row.join(", "));
    }
    text += "]\n";
    for (name, X) in [("interface.A", link.X_LA), ("interface.B", link.X_LB), ("split", link.split.X_LS)] {
        let (p, (r, t, y)) = (X.translation.vector * 1e3, X.rotation.euler_angles());
        text += &format!("[{name}]\nxyz = [{:?}, {:?}, {:?}]\n", p.x, p.y, p.z);
        text += &format!("rpy = [{r:?}, {t:?}, {y:?}]\n");
    }
    for (name, part) in [("proximal", &link.proximal), ("distal", &link.distal)] {
        let (c, I) = (part.com * 1e3, part.inertia * 1e3); // kg m² = 1e3 t mm²
        text += &format!("[[part]]\nname = \"{name}\"\nmass = {:?}\n", part.mass * 1e-3);
        text += &format!("com = [{:?}, {:?}, {:?}]\n", c.x, c.y, c.z);
        let [xx, yy, zz] = [I.m11, I.m22, I.m33];
        text += &format!("inertia = [{xx:?}, {yy:?}, {zz:?}, {:?}, {:?}, {:?}]\n", I.m12, I.m13, I.m23);
    }
    text
}

#[test]
fn the_example_of_the_format_page_is_a_link() {
    let link = parse_flex(example(), "format.md").unwrap();
    assert_eq!(link.name, "lower_arm");
    assert_eq!(link.mass(), 6.0);
    assert_eq!(link.provenance.method, "guyan");
    assert_eq!(link.checks.rigid_body_residual, Some(3.0e-9));
    assert_relative_eq!(link.K_BB[(1, 5)], -1.2e6);
    // Midway the straight beam is uncoupled: 4EI/l - 6EI/l² · l + 12EI/l³ · l²/4 = EI/l
    assert_relative_eq!(link.split.K_S[(5, 5)], 1.0e5, max_relative = 1e-14);
    assert!(link.split.K_S[(1, 5)].abs() < 1e-9);
}

#[test]
fn links_survive_writing_and_reading_to_the_last_bit() {
    for link in [lower_arm().reduce().unwrap(), offset_arm().reduce().unwrap(), turned_arm()] {
        let text = write_flex(&link);
        let again = parse_flex(&text, "arm.flex").unwrap();
        assert_eq!(again, link);
        assert_eq!(write_flex(&again), text);
    }
}

#[test]
fn a_link_from_twelve_by_twelve_keeps_what_the_gate_measured() {
    let link = turned_arm();
    let provenance = Provenance {
        source: "C:\\models\\arm \"v2\"".into(),
        note: "two\nlines\tand a \u{7f}, µ".into(),
        ..Provenance::default()
    };
    let parts = [link.proximal.clone(), link.distal.clone()];
    let limits = GateLimits::default();
    let link =
        ReducedLink::from_matrix12("a \"b\"", link.frames(), &link.matrix12(), parts, provenance, &limits).unwrap();
    assert_eq!(parse_flex(&write_flex(&link), "arm.flex").unwrap(), link);
}

/// Identity: the same link in m, N, kg and link axes, and in mm, kN, t and the axes of A or B.
#[test]
fn units_and_axes_are_converted_in_every_block() {
    let link = turned_arm();
    for kind in ["6x6", "12x12"] {
        for axes in ["link", "interface_A", "interface_B"] {
            let again = parse_flex(&in_other_units(&link, kind, axes), "arm.flex").unwrap();
            let s = link.K_BB.diagonal().map(f64::sqrt);
            let error = Matrix6::from_fn(|i, j| (again.K_BB[(i, j)] - link.K_BB[(i, j)]) / (s[i] * s[j]));
            assert!(error.amax() < 1e-13, "{kind} {axes}: {:e}", error.amax()); // measured 7e-16
            assert_relative_eq!(again.X_LB, link.X_LB, epsilon = 1e-14);
            assert_relative_eq!(again.split.X_LS, link.split.X_LS, epsilon = 1e-14);
            for (a, b) in [(&again.proximal, &link.proximal), (&again.distal, &link.distal)] {
                assert_relative_eq!(a.mass, b.mass, max_relative = 1e-14);
                assert_relative_eq!(a.com, b.com, max_relative = 1e-14);
                assert_relative_eq!(a.inertia, b.inertia, max_relative = 1e-14);
            }
            assert_eq!(again.provenance.units, "mm, kN, t, rad");
        }
    }
}

#[test]
fn a_missing_split_lies_in_the_middle() {
    let without = example().replacen("[split] ", "# ", 1).replacen("xyz = [0.25, 0.0, 0.0]", "", 1);
    let link = parse_flex(&without, "arm.flex").unwrap();
    assert_eq!(link.split.X_LS.translation.vector.x, 0.25);
}

#[test]
fn what_is_no_number_is_named_with_its_place() {
    let error = error_of("-1.2e6, 0.0, 0.0, 0.0, 4.0e5", "nan, 0.0, 0.0, 0.0, 4.0e5");
    assert_eq!(error.kind, FlexErrorKind::NotFinite);
    assert_eq!((&*error.element, &*error.found), ("stiffness.matrix[5][1]", "nan"));
    let line = example().lines().position(|line| line.contains("[0.0, -1.2e6, 0.0, 0.0, 0.0, 4.0e5]"));
    assert_eq!((error.line, error.column), (line.unwrap() + 1, 9));
    assert!(error.to_string().starts_with(&format!("arm.flex:{}:9: stiffness.matrix[5][1]", error.line)));

    assert_eq!(error_of("mass = 3.0", "mass = inf").kind, FlexErrorKind::NotFinite);
    assert_eq!(error_of("2.0e8", "2.0e999").kind, FlexErrorKind::NotFinite);
    assert_eq!(error_of("2.0e8", "\"2.0e8\"").kind, FlexErrorKind::WrongType);
    assert_eq!(error_of("2.0e8", "0x10").kind, FlexErrorKind::WrongType);
}

#[test]
fn missing_units_are_never_guessed() {
    let error = error_of("length = \"m\" ", "# ");
    assert_eq!((error.kind, &*error.element), (FlexErrorKind::MissingKey, "units.length"));
    assert!(error.to_string().contains("units are never guessed"));

    let units = &example()[example().find("[units]").unwrap()..example().find("[interface.A]").unwrap()];
    let error = error_of(units, "");
    assert_eq!((error.kind, &*error.element), (FlexErrorKind::MissingKey, "units"));
}

#[test]
fn other_units_words_and_formats_are_refused() {
    let error = error_of("length = \"m\"", "length = \"inch\"");
    assert_eq!(error.kind, FlexErrorKind::Unit);
    assert!(error.to_string().contains("\"m\" or \"mm\""));
    assert_eq!(error_of("angle = \"rad\"", "angle = \"deg\"").kind, FlexErrorKind::Unit);
    assert_eq!(error_of("\"ux uy uz rx ry rz\"", "\"rx ry rz ux uy uz\"").kind, FlexErrorKind::Word);
    assert_eq!(error_of("axes = \"link\"", "axes = \"world\"").kind, FlexErrorKind::Word);
    assert_eq!(error_of("version = 1", "version = 2").kind, FlexErrorKind::Format);
    assert_eq!(error_of("flexarm-reduced-link", "something").kind, FlexErrorKind::Format);
}

#[test]
fn unknown_keys_are_refused_where_they_stand() {
    let error = error_of("com = [0.125", "colour = 1\ncom = [0.125");
    assert_eq!((error.kind, &*error.element), (FlexErrorKind::UnknownKey, "part[0].colour"));
    assert_eq!(error.column, 1);
    for (from, to) in [
        ("link = ", "robot = 1\nlink = "),
        ("[split] ", "[interface.C]\nxyz = [0.0, 0.0, 0.0]\n[split] "),
        ("kind = ", "unit = \"N\"\nkind = "),
        ("note = ", "remark = "),
        ("block_identity = ", "identity = "),
        ("force = ", "temperature = \"K\"\nforce = "),
        ("[split] ", "[split]\nrpy = [0.0, 0.0, 0.0]\nxyzw = 1 "),
    ] {
        assert_eq!(error_of(from, to).kind, FlexErrorKind::UnknownKey);
    }
}

#[test]
fn wrong_sizes_are_named() {
    let error = error_of("[0.0, 0.0, 0.0, 8.0e4, 0.0, 0.0]", "[0.0, 0.0, 0.0, 8.0e4, 0.0]");
    assert_eq!((error.kind, &*error.element), (FlexErrorKind::WrongSize, "stiffness.matrix[3]"));
    assert!(error.to_string().contains("found 5 entries; expected 6 numbers in each row"));
    let error = error_of("  [0.0, 0.0, 0.0, 8.0e4, 0.0, 0.0],\n", "");
    assert_eq!((error.kind, &*error.element), (FlexErrorKind::WrongSize, "stiffness.matrix"));
    assert_eq!(error_of("kind = \"6x6\"", "kind = \"12x12\"").kind, FlexErrorKind::WrongSize);
    assert_eq!(error_of("com = [0.125, 0.0, 0.0]", "com = [0.125, 0.0]").kind, FlexErrorKind::WrongSize);
}

#[test]
fn parts_must_be_two_possible_bodies() {
    assert_eq!(error_of("\"distal\"", "\"proximal\"").kind, FlexErrorKind::Part);
    assert_eq!(error_of("\"distal\"", "\"middle\"").kind, FlexErrorKind::Word);
    let last = &example()[example().rfind("[[part]]").unwrap()..];
    let error = error_of(last, "");
    assert!(error.kind == FlexErrorKind::Part && &*error.found == "no distal part", "{error}");

    let error = error_of("mass = 3.0", "mass = -3.0");
    assert_eq!((error.kind, &*error.element), (FlexErrorKind::Link, "part[0]"));
    assert!(error.to_string().contains("mass of the proximal part (kg) is -3"));
    let error = error_of("[1.0e-3, 0.02, 0.02", "[1.0e-3, 0.02, 0.04");
    assert!(matches!(error.source.as_deref(), Some(FemError::ImpossibleInertia { .. })));
}

#[test]
fn matrices_that_cannot_be_a_link_are_refused_with_the_reason() {
    let cause = |from: &str, to: &str| {
        let error = error_of(from, to);
        assert_eq!((error.kind, &*error.element), (FlexErrorKind::Link, "stiffness.matrix"));
        *error.source.unwrap()
    };
    let asymmetric = cause("[0.0, -1.2e6, 0.0, 0.0, 0.0, 4.0e5]", "[0.0, 1.2e6, 0.0, 0.0, 0.0, 4.0e5]");
    assert!(matches!(asymmetric, FemError::NotSymmetric { row: 1, column: 5, .. }));
    let singular = cause("8.0e4", "0.0");
    assert!(matches!(singular, FemError::NotPositiveDefinite { .. }));

    // A 12×12 in metres in a file whose frames are in millimetres.
    let text = in_other_units(&lower_arm().reduce().unwrap(), "12x12", "link");
    let text = text.replace("xyz = [0.0, 0.0, 1095.0]", "xyz = [0.0, 0.0, 1.095]");
    let error = parse_flex(&text, "arm.flex").unwrap_err();
    let cause = *error.source.clone().unwrap();
    assert!(matches!(cause, FemError::MovesUnderRigidMotion { .. }), "{error}");

    let far = error_of("xyz = [0.5, 0.0, 0.0]", "xyz = [500.0, 0.0, 0.0]");
    assert!(&*far.element == "interface" && far.to_string().contains("millimetres"), "{far}");
}

/// A 6×6 in N/mm read as N/m passes the dimensionless gate; only the warning remains.
#[test]
fn a_stiffness_in_other_units_than_its_frames_is_warned_about() {
    let link = lower_arm().reduce().unwrap();
    let parts = [link.proximal.clone(), link.distal.clone()];
    let unit = |i: usize| if i < 3 { 1.0 } else { 1e3 };
    let K_mm = Matrix6::from_fn(|i, j| link.K_BB[(i, j)] * unit(i) * unit(j) * 1e-3);
    let limits = GateLimits::default();
    let warnings = ReducedLink::from_matrix6("arm", link.frames(), &K_mm, parts, link.provenance.clone(), &limits)
        .map(|link| link.warnings(&limits))
        .unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("other units"), "{warnings:?}");
    assert!(link.warnings(&limits).is_empty());
}

#[test]
fn rotations_are_rpy_or_an_orthonormal_matrix() {
    let both = error_of("rotation = ", "rpy = [0.0, 0.0, 0.0]\nrotation = ");
    assert_eq!(both.kind, FlexErrorKind::UnknownKey);
    let skewed = error_of("[[1.0, 0.0, 0.0], [0.0, 1.0", "[[1.0, 0.1, 0.0], [0.0, 1.0");
    assert_eq!(skewed.kind, FlexErrorKind::Rotation);
    let mirrored = error_of("[[1.0, 0.0, 0.0], [0.0, 1.0", "[[-1.0, 0.0, 0.0], [0.0, 1.0");
    assert_eq!(mirrored.kind, FlexErrorKind::Rotation);
}

/// A file truncated anywhere is rejected: its last entry is required.
#[test]
fn truncated_files_are_refused_wherever_they_end() {
    let text = write_flex(&turned_arm());
    let end = text.trim_end().len();
    for cut in (0..end).filter(|&cut| text.is_char_boundary(cut)) {
        assert!(parse_flex(&text[..cut], "arm.flex").is_err(), "{}", &text[..cut]);
    }
}

#[test]
fn files_that_cannot_be_read_say_so() {
    let error = read_flex("no/such/file.flex").unwrap_err();
    assert_eq!(error.kind, FlexErrorKind::Unreadable);
    assert!(error.to_string().starts_with("no/such/file.flex:1:1"), "{error}");
    let error = flexarm_fem::flex_file::parse_flex_bytes(b"link = \"\xff\"", "arm.flex").unwrap_err();
    assert_eq!((error.kind, error.line, error.column), (FlexErrorKind::Unreadable, 1, 9));
}

proptest! {
    #![proptest_config(fixed_cases())]

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = flexarm_fem::flex_file::parse_flex_bytes(&bytes, "bytes");
    }

    #[test]
    fn arbitrary_text_of_toml_signs_never_panics(text in "[\\[\\]{}=\",.#\n a-c0-9eé\\\\-]{0,200}") {
        let _ = parse_flex(&text, "text");
    }

    /// Cutting and pasting in a good file reaches every branch after the parser.
    #[test]
    fn mutilated_files_never_panic(
        from in 0.0..1.0_f64, length in 0_usize..40, paste in "[0-9a-zA-Z.=\"\\[\\], \n-]{0,12}",
    ) {
        let bytes = example().as_bytes();
        let start = (from * bytes.len() as f64) as usize;
        let end = (start + length).min(bytes.len());
        let changed = [&bytes[..start], paste.as_bytes(), &bytes[end..]].concat();
        let _ = flexarm_fem::flex_file::parse_flex_bytes(&changed, "bytes");
    }

    /// Numbers of any size at any position of the matrix: an error or a link, never a panic or a
    /// loop.
    #[test]
    fn any_number_anywhere_never_panics(value in any::<f64>(), i in 0_usize..6, j in 0_usize..6) {
        let mut link = parse_flex(example(), "a").unwrap();
        link.K_BB[(i, j)] = value;
        link.K_BB[(j, i)] = value;
        let _ = parse_flex(&write_flex(&link), "a");
    }

    #[test]
    fn any_link_survives_writing_and_reading(
        K_BB in spd_stiffness(), X_LA in pose(), X_LB in pose(), X_LS in pose(),
    ) {
        let parts = parse_flex(example(), "a").unwrap();
        let frames = LinkFrames::new(X_LA, X_LB).with_split(X_LS);
        let link = ReducedLink::from_matrix6(
            "any", frames, &K_BB, [parts.proximal, parts.distal], parts.provenance,
            &GateLimits::default(),
        ).unwrap();
        prop_assert_eq!(parse_flex(&write_flex(&link), "a").unwrap(), link);
    }
}
