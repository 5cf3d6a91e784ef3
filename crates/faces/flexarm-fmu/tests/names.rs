//! Names of variables, and addresses of resources.

use std::path::PathBuf;

use flexarm_fmu::internals::{folder, part};

#[test]
fn names_that_are_no_identifiers_are_quoted() {
    assert_eq!(part("joint_1"), "joint_1");
    assert_eq!(part("1st joint"), "'1st joint'");
    assert_eq!(part("a'b\\c"), "'a\\'b\\\\c'");
    assert_eq!(part("gelenk-ü"), "'gelenk-ufc'");
}

#[test]
fn resources_are_found_by_every_form_of_their_address() {
    for (location, path) in [
        ("file:///tmp/a%20b/r", "/tmp/a b/r"),
        ("file:/tmp/r", "/tmp/r"),
        ("file://localhost/tmp/r", "/tmp/r"),
        ("/tmp/r", "/tmp/r"),
        ("file:///tmp/100%", "/tmp/100%"),
        ("file:///tmp/%C3%BC", "/tmp/ü"),
    ] {
        assert_eq!(folder(location), PathBuf::from(path), "{location}");
    }
}
