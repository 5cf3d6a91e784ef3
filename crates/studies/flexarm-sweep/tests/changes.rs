//! Changes of a robot file for a single run.

use std::path::Path;

use flexarm_sweep::internals::change_text;
use flexarm_sweep::{Change, SweepError};

const FILE: &str = "payload = { mass = 5.0 } # carried\n[[drive]]\njoint = \"a\"\ngearbox = { stiffness = 2 }\n\
                    [[drive]]\njoint = \"b\"\ngearbox = { stiffness = [1.0, 3.0] }\n";

fn changed(changes: &[&str]) -> Result<(String, f64), String> {
    let changes: Result<Vec<Change>, SweepError> = changes.iter().map(|text| text.parse()).collect();
    let changes = changes.map_err(|error| error.to_string())?;
    change_text(Path::new("robot.toml"), FILE, &changes).map_err(|error| error.to_string())
}

#[test]
fn changes_replace_and_multiply_values_one_after_the_other_and_keep_the_comments() {
    let (text, speed) = changed(&[
        "payload.mass=7.5",
        "drive.*.gearbox.stiffness *= 0.5",
        "drive.a.gearbox.stiffness*=4",
        "motion.speed=0.8",
        "motion.speed*=0.5",
    ])
    .unwrap();
    let expected = FILE
        .replace("mass = 5.0", "mass = 7.5")
        .replace("stiffness = 2 ", "stiffness = 4.0 ")
        .replace("[1.0, 3.0]", "[0.5, 1.5]");
    assert_eq!((text, speed), (expected, 0.4));
}

#[test]
fn a_change_that_matches_nothing_names_what_is_similar() {
    let message = changed(&["drive.c.gearbox.stiffness=1"]).unwrap_err();
    assert!(
        message.starts_with("robot.toml: \"drive.c.gearbox.stiffness\" matches no entry; did you mean"),
        "{message}"
    );
    for (wrong, part) in [
        ("payload.mass", "expected PATH=VALUE"),
        ("motion.speed=0", "expected a positive number"),
        ("motion.speed=fast", "expected a positive number"),
        ("payload.mass=nan", "not a finite number"),
        ("options.step=1e-4", "only entries of the robot file"),
        ("drive.*.gearbox*=hard", "must be a number"),
    ] {
        let message = changed(&[wrong]).unwrap_err();
        assert!(message.contains(part), "{wrong}: {message}");
    }
}
