//! Robot files with identified values.

use std::path::Path;

use flexarm_identify::FittedParameter;
use flexarm_identify::internals::{ParameterLocation, displacement, rewritten};
use flexarm_kinematics::Pose;
use flexarm_run::Calibration;
use flexarm_stepping::GuideTerm;
use nalgebra::{Rotation3, Translation3, Vector6};
use toml_edit::{DocumentMut, Item, Table};

fn found(name: &str, initial: f64, value: f64, std: f64) -> FittedParameter {
    let (name, unit) = (name.to_owned(), "N m/rad".to_owned());
    FittedParameter { name, unit, initial, value, std, interval: [0.0, 0.0], identifiable: true, rigid: false }
}

#[test]
fn numbers_are_changed_in_their_places_and_nothing_else_is() {
    let text = "format = 1 # version\nurdf = \"a.urdf\"\n\n[[drive]]\njoint = \"j1\"\nkind = \"gearbox\"\n\
                gearbox = { stiffness = 1.0e6, damping = 3.0 } # maker\n\n[[drive]]\njoint = \"j2\"\nkind = \"gearbox\"\n\
                [drive.gearbox]\nstiffness = [1.0, 2.0, 3.0] # three\n\n[[flexible_link]]\nlink = \"arm\" # bends\n";
    let gear = |joint: &str, entry| ParameterLocation::Gearbox { joint: joint.into(), entry };
    let all = [
        (found("a", 1e6, 1.234567e6, 2.0e3), gear("j1", None)),
        (found("b", 2.0, 2.51234, 0.02), gear("j2", Some(1))),
        (found("c", 1.0, 0.87654321, 0.01), ParameterLocation::Link { link: "arm".into() }),
        (found("d", 1.0, 1.2345, 0.01), ParameterLocation::LinkDirection { link: "arm".into(), entry: 4 }),
    ];
    let here = Path::new(".");
    let new = rewritten(text, &all, ("tool", &Pose::identity()), &[], here, here).unwrap();
    let (comments, body) = new.split_once("\n\n").unwrap();
    assert!(comments.contains("a = 1234570 +- 2000 N m/rad, was 1000000"), "{comments}");
    let expected = text.replace("1.0e6", "1234567.0").replace("3.0 }", "3.0 , identified = true }").replace("[1.0, 2.0, 3.0] # three\n", "[1.0, 2.51234, 3.0] # three\nidentified = true\n").replace(
        "link = \"arm\" # bends\n",
        "link = \"arm\" # bends\nstiffness_factor = 0.87654321\nstiffness_factors = [1.0, 1.0, 1.0, 1.0, 1.2345, 1.0]\n",
    );
    assert_eq!(body, expected);
}

/// Truth: the old correction of the frame, its zero, and the identified displacements one after
/// the other.
#[test]
fn corrections_of_joint_frames_follow_those_of_the_old_file() {
    let text = "format = 1\n\n[[drive]]\njoint = \"lift\"\ngearbox = { guide = { outer_end = 1.4, y = { compliance = [0, 0, 3e-7], \
                play = { gap = 4e-4 } } } }\n\n[[calibration]]\njoint = \"j2\"\nzero = 0.3 # old\n";
    let axis = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.6, 0.8);
    let frame =
        |joint: &str, twist: Vector6<f64>, zero| ParameterLocation::Frame { joint: joint.into(), twist, axis, zero };
    let guide = |term| ParameterLocation::Guide { joint: "lift".into(), axis: 'y', term };
    let old = Calibration { joint: "j2".into(), frame: Pose::translation(0.1, 0.0, 0.2), zero: 0.3 };
    let all = [
        (found("c2", 3e-7, 4.0004e-7, 1e-9), guide(GuideTerm::Compliance(2))),
        (found("width", 10.0, 21.0, 0.1), guide(GuideTerm::Width)),
        (found("j2.x", 0.0, 0.02, 1e-4), frame("j2", Vector6::ith(0, 1.0), false)),
        (found("j2.roll", 0.0, -0.05, 1e-4), frame("j2", Vector6::ith(3, 1.0), false)),
        (found("j2.zero", 0.0, 0.01, 1e-4), frame("j2", axis, true)),
        (found("j1.y", 0.0, 0.004, 1e-4), frame("j1", Vector6::ith(1, 1.0), false)),
    ];
    let here = Path::new(".");
    let new = rewritten(text, &all, ("tool", &Pose::identity()), std::slice::from_ref(&old), here, here).unwrap();
    assert!(new.contains("compliance = [0, 0, 0.00000040004]"), "{new}");
    assert!(new.contains("play = { gap = 4e-4 , width = 21.0 }"), "{new}");
    assert!(new.contains("zero = 0.31 # old"), "{new}");
    let file: DocumentMut = new.parse().unwrap();
    let tables = file["calibration"].as_array_of_tables().unwrap();
    let read = |table: &Table| {
        let three = |key: &str| -> [f64; 3] {
            let list = table.get(key).and_then(Item::as_array);
            std::array::from_fn(|k| list.map_or(0.0, |list| list.get(k).unwrap().as_float().unwrap()))
        };
        let ([x, y, z], [roll, pitch, yaw]) = (three("xyz"), three("rpy"));
        let zero = table.get("zero").and_then(Item::as_float).unwrap_or(0.0);
        Pose::from_parts(Translation3::new(x, y, z), Rotation3::from_euler_angles(roll, pitch, yaw))
            * displacement(&(axis * zero))
    };
    let truth = old.frame
        * displacement(&(axis * 0.3))
        * displacement(&(Vector6::ith(0, 1.0) * 0.02))
        * displacement(&(Vector6::ith(3, 1.0) * -0.05))
        * displacement(&(axis * 0.01));
    let written = read(tables.get(0).unwrap());
    let error = (written.to_homogeneous() - truth.to_homogeneous()).amax();
    // Rounded to twelve digits.
    assert!(error < 3e-12, "{error:e} {new}");
    assert_eq!(tables.get(1).unwrap()["joint"].as_str(), Some("j1"));
}
