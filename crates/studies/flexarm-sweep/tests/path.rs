//! Paths of values in a robot file.

use std::path::Path;

use flexarm_sweep::Change;
use flexarm_sweep::internals::change_text;

const FILE: &str = "urdf = \"a.urdf\"\npayload = { mass = 5.0, com = [0, 0.1, 0.0] } # carried\n\n[[drive]]\njoint = \"j.1\" # first\n\
                    gearbox = { stiffness = 1.0e6, damping = 3 }\n[[drive]]\njoint = \"j2\"\n[drive.gearbox]\nstiffness = [1.0, 2.0]\n";

fn changed(changes: &[&str]) -> Result<String, String> {
    let changes: Result<Vec<Change>, String> =
        changes.iter().map(|text| text.parse().map_err(|error: flexarm_sweep::SweepError| error.to_string())).collect();
    let changed = change_text(Path::new("robot.toml"), FILE, &changes?);
    changed.map(|(text, _)| text).map_err(|error| error.to_string())
}

#[test]
fn paths_lead_to_tables_entries_by_name_and_number_and_all_of_them() {
    for (path, parts) in [
        ("payload.mass", &[("mass = 5.0", "mass = 7.5")][..]),
        ("payload.com[1]", &[("0, 0.1,", "0, 7.5,")]),
        ("drive.j2.gearbox.stiffness", &[("[1.0, 2.0]", "7.5")]),
        ("drive[0].gearbox.damping", &[("damping = 3 ", "damping = 7.5 ")]),
        ("drive.\"j.1\".gearbox.damping", &[("damping = 3 ", "damping = 7.5 ")]),
        ("drive.*.gearbox.stiffness", &[("1.0e6", "7.5"), ("[1.0, 2.0]", "7.5")]),
        ("payload.*", &[("mass = 5.0", "mass = 7.5"), ("[0, 0.1, 0.0]", "7.5")]),
        // New keys are valid only in existing tables.
        ("drive.j2.ratio", &[("joint = \"j2\"\n", "joint = \"j2\"\nratio = 7.5\n")]),
    ] {
        let expected = parts.iter().fold(FILE.to_owned(), |text, (old, new)| text.replace(old, new));
        assert_eq!(changed(&[&format!("{path}=7.5")]).unwrap(), expected, "{path}");
    }
    for none in ["drve.j2.ratio", "drive.j3.ratio", "payload.com[7]"] {
        let message = changed(&[&format!("{none}=7.5")]).unwrap_err();
        assert!(message.contains("matches no entry"), "{message}");
    }
    for bad in ["", "a..b", "a.", "a[x]", "a[1", "\"a"] {
        let message = changed(&[&format!("{bad}=7.5")]).unwrap_err();
        assert!(message.contains("is not a path"), "{bad}: {message}");
    }
}

#[test]
fn a_value_is_changed_in_its_place_and_nothing_else_is() {
    let changes = [
        "payload.mass=7.5",
        "payload.com[1]=0.25",
        "drive[0].gearbox.damping=4.0",
        "drive.j2.gearbox.stiffness[0]=9.0",
        "drive.j2.ratio=3",
    ];
    let expected = FILE
        .replace("mass = 5.0", "mass = 7.5")
        .replace("0, 0.1,", "0, 0.25,")
        .replace("damping = 3 ", "damping = 4 ")
        .replace("[1.0, 2.0]", "[9.0, 2.0]")
        .replace("joint = \"j2\"\n", "joint = \"j2\"\nratio = 3\n");
    assert_eq!(changed(&changes).unwrap(), expected);
}

#[test]
fn a_path_that_leads_nowhere_is_told_with_those_that_are_near() {
    let message = changed(&["drive.j3.gearbox.stiffness=1"]).unwrap_err();
    assert!(message.contains("did you mean \"drive.j2.gearbox.stiffness\"?"), "{message}");
}
