//! Places of errors and warnings in motion files of every text format.

use std::path::{Path, PathBuf};

use flexarm_run::{Motion, Robot};

fn kr210() -> Robot {
    Robot::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210")).unwrap()
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("flexarm-motion-places-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Truth: line and column, from 1, counted by hand.
#[test]
fn errors_in_motion_files_of_every_format_have_their_line_and_column() {
    let waypoints = "format = 1\nunit = \"deg\"\njoints = [\"joint_1\"]\n";
    let home = "PTP {A1 0, A2 -60, A3 90, A4 0, A5 60, A6 0}\n";
    let cases = [
        ("samples.csv", "time,joint_1\n0,0\n1,x\n".to_owned(), "3:3", "\"x\" is not a number"),
        ("table.csv", "t[s];joint_1[deg]\n0,5;1\n1.5;2\n".to_owned(), "3:1", "decimal points"),
        (
            "moves.toml",
            format!("{waypoints}start = [0]\n[[move]]\nto = [9]\nduration = -2\n"),
            "7:12",
            "`duration` is -2",
        ),
        ("rows.toml", format!("{waypoints}[samples]\ntime = [0.0, 1.0]\nposition = [[0.0]]\n"), "6:12", "1 rows"),
        (
            "path.toml",
            "format = 1\n[path]\nlengths = \"cm\"\nangles = \"deg\"\n".to_owned(),
            "3:11",
            "give \"m\" or \"mm\"",
        ),
        ("krl.src", format!("DEF x()\n{home}  WAIT FOR $IN[1]\nEND\n"), "3:3", "depends on `$IN[1]`"),
        ("rapid.mod", "MODULE t\nPROC main()\nWaitDI di1, 1;\nENDPROC\nENDMODULE\n".to_owned(), "3:1", "depends on"),
        ("ur.script", "def t():\n movel(get_actual_tcp_pose())\nend\nt()\n".to_owned(), "2:8", "depends on"),
        ("mill.nc", "G21 G90\nG41 D1 X5\n".to_owned(), "2:1", "cutter radius"),
        (
            "plan.yaml",
            "joint_names: [joint_1]\npoints:\n- {positions: [x], time_from_start: 1.0}\n".to_owned(),
            "3:16",
            "expected numbers alone",
        ),
        (
            "plan.json",
            "{\"joint_names\": [\"joint_1\"],\n \"points\": [{\"positions\": [0.0]}]}\n".to_owned(),
            "2:13",
            "has no `time_from_start`",
        ),
    ];
    let (robot, folder) = (kr210(), folder("errors"));
    for (name, text, place, words) in cases {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        let error = Motion::load(&path, &robot).unwrap_err().to_string();
        let placed = format!("{}:{place}: ", path.display());
        assert!(error.contains(&placed) && error.contains(words), "{placed} and {words:?} are not in\n{error}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Truth: the lines of the texts, counted by hand.
#[test]
fn warnings_about_motion_files_have_their_line_and_a_code_for_each_kind() {
    let program =
        "DEF x()\nPTP {A1 0, A2 -60, A3 90, A4 0, A5 60, A6 0}\n  $OUT[1]=TRUE\nPTP {A1 9}\n$OUT[2]=TRUE\nEND\n";
    let cases = [
        ("cut.csv", "time,joint_1\n0,0\n1,0\n1,0\n2,0\n3", "motion-cut", "6"),
        ("cut.csv", "time,joint_1\n0,0\n1,0\n1,0\n2,0\n3", "table-repeated-rows", "4"),
        ("unit.txt", "t;joint_1;wear\n0;0;1\n1;0;1\n", "table-unit", "1"),
        ("unit.txt", "t;joint_1;wear\n0;0;1\n1;0;1\n", "table-time-unit", "1:1"),
        ("unit.txt", "t;joint_1;wear\n0;0;1\n1;0;1\n", "table-columns", "1"),
        ("outputs.src", program, "tool-path", "3:3"),
    ];
    let (robot, folder) = (kr210(), folder("warnings"));
    for (name, text, code, place) in cases {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        let caveats = Motion::load(&path, &robot).unwrap().caveats();
        let location = format!("{}:{place}", path.display());
        let found = caveats.iter().find(|caveat| caveat.code == code && caveat.location == location);
        let found = found.unwrap_or_else(|| panic!("{code} at {location} is not in {caveats:#?}"));
        assert!(found.message.starts_with(&format!("{location}: ")), "{found:?}");
    }
    // A caveat about the whole curve of a joint names the joint.
    let path = folder.join("start.csv");
    std::fs::write(&path, "time,joint_1\n0,0\n1,0.5\n2,1\n").unwrap();
    let caveats = Motion::load(&path, &robot).unwrap().caveats();
    let start = caveats.iter().find(|caveat| caveat.code == "motion-start-speed").unwrap();
    assert!((start.location.as_str(), start.value) == ("joint_1", Some(0.5)), "{start:?}");
    assert!(start.message.starts_with(&format!("{}: joint \"joint_1\" starts", path.display())), "{start:?}");
    std::fs::remove_dir_all(folder).unwrap();
}
