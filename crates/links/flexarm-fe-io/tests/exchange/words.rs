//! Words of matrix files: Fortran's formats and numbers, names of files, maps of interfaces.

use flexarm_fe_io::exchange::{DofLabel, InterfaceMap, MatrixRole, propose_map};
use flexarm_fe_io::internals::{ErrorPosition, Format, other_names, parse_format, real};

#[test]
fn formats_give_their_width() {
    for (text, width) in [("(8I10)", 10), ("(3E25.16)", 25), ("1P,3E23.16", 23), ("(1P5D16.9)", 16), ("5e16.9", 16)] {
        assert_eq!(parse_format(text, &ErrorPosition::file("t")).unwrap().width, width, "{text}");
    }
    assert!(parse_format("(A8)", &ErrorPosition::file("t")).is_err());
    let fields: Vec<_> = Format { width: 5 }.fields("-1.0-2.00-3.000  ").collect();
    assert_eq!(fields, ["-1.0-", "2.00-", "3.000"]);
}

#[test]
fn the_mass_beside_a_stiffness_has_the_usual_names() {
    for (stiffness, mass) in [
        ("fork_K.mtx", "fork_M.mtx"),
        ("K.mtx", "M.mtx"),
        ("arm-k.csv", "arm-m.csv"),
        ("job_STIF1.mtx", "job_MASS1.mtx"),
        ("kuka_stiffness.mtx.gz", "kuka_mass.mtx.gz"),
        ("beam_K12.mtx", "beam_M12.mtx"),
    ] {
        assert!(other_names(stiffness, MatrixRole::Stiffness).contains(&mass.to_owned()), "{stiffness}");
        assert!(other_names(mass, MatrixRole::Mass).contains(&stiffness.to_owned()), "{mass}");
    }
    assert!(other_names("kuka.mtx", MatrixRole::Stiffness).is_empty());
}

#[test]
fn numbers_of_fortran_are_read_with_d_and_without_letter() {
    for (text, value) in [
        ("1.5", 1.5),
        (" 1.055845337D+09", 1.055_845_337e9),
        ("-2.5d-3", -2.5e-3),
        ("1.5-3", 1.5e-3),
        ("-1.5+3", -1.5e3),
        ("1.-3", 1e-3),
        (".5", 0.5),
        ("7", 7.0),
    ] {
        assert_eq!(real(text), Some(value), "{text}");
    }
    for text in ["", "-", "1.5-", "1-5-3e", "d", "1,5", "--1", "1e"] {
        assert_eq!(real(text), None, "{text}");
    }
    assert!(real("nan").unwrap().is_nan() && real("1e999").unwrap().is_infinite());
}

fn rows(nodes: &[i64], last: u8) -> Vec<DofLabel> {
    nodes.iter().flat_map(|node| (1..=last).map(|dof| DofLabel::new(*node, dof))).collect()
}

#[test]
fn a_map_is_read_and_printed_unchanged() {
    for text in ["A=1001,B=1002", "A=947:1-3+948:1-3,B=949:1-3+950:1-3", "A=#1-6,B=#7-12,modal=#13-22", "A=5:2"] {
        assert_eq!(text.parse::<InterfaceMap>().unwrap().to_string(), text);
    }
    for text in ["", "A", "A=", "A=1:0-9", "A=#0-5", "A=#6-1", "A=x", "A=1,A=2", "A=#1-99999999999999999999"] {
        let error = text.parse::<InterfaceMap>().unwrap_err();
        assert_eq!(&*error.origin, "map of interfaces", "{text}: {error}");
    }
}

#[test]
fn maps_find_their_rows_in_any_order_and_the_rest_is_modal() {
    let mut labels = rows(&[7, 3], 6);
    labels.push(DofLabel::new(2001, 0));
    let map: InterfaceMap = "A=3,B=7".parse().unwrap();
    let resolved = map.resolve(&labels, "t").unwrap();
    assert_eq!(resolved.interfaces, [[6, 7, 8, 9, 10, 11], [0, 1, 2, 3, 4, 5]]);
    assert_eq!(resolved.modal, [12]);
}

#[test]
fn maps_that_do_not_fit_say_what_the_file_has() {
    let labels = rows(&[947, 948, 949, 950], 3);
    let fail = |text: &str| text.parse::<InterfaceMap>().unwrap().resolve(&labels, "t").unwrap_err().to_string();
    assert!(fail("A=947,B=948").contains("its nodes are [947, 948, 949, 950]"));
    assert!(fail("A=947:1-3,B=949:1-3+950:1-3").contains("3 rows"));
    assert!(fail("A=#1-6,B=#6-11").contains("also in A"));
    assert!(fail("A=947:1-3+948:1-3").contains("one of 6 in no interface"));
    assert!(fail("A=#9-14").contains("12 rows"));
}

#[test]
fn proposals_fit_the_rows() {
    let text = |rows: &[DofLabel]| propose_map(rows).map(|map| map.to_string());
    assert_eq!(text(&rows(&[1001, 1002], 6)).unwrap(), "A=1001,B=1002");
    assert_eq!(text(&rows(&[947, 948, 949, 950], 3)).unwrap(), "A=947:1-3+948:1-3,B=949:1-3+950:1-3");
    assert_eq!(text(&[DofLabel::UNKNOWN; 22]).unwrap(), "A=#1-6,B=#7-12");
    assert_eq!(text(&rows(&[1, 2, 3], 6)).unwrap(), "A=1,B=2,C=3");
    assert_eq!(text(&rows(&[1], 6)), None);
}
