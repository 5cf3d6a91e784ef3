//! Bad input: each kind has its own message with the location and the fix, exit code 2, nothing on
//! standard output, and no file or folder is created or changed.
//!
//! The required words are those a user needs: file, location in it, what was found, what is
//! expected. Tests marked `ignore` state the wanted behaviour that is not implemented yet.

use crate::common::{self, Answer, Place, ROBOT, SWING, URDF, flex, garbage, line_of, with};

/// Runs `compare` with the swing.
fn compare_robot(place: &Place, robot: &str, words: &[&str]) -> Answer {
    place.refused(&["compare", robot, "swing.toml", "-o", "result"], words)
}

/// Runs `compare` with the beam along a trajectory given as text.
fn compare_motion(file: &str, text: impl AsRef<[u8]>, words: &[&str]) -> Answer {
    let place = Place::new();
    place.write(file, text);
    place.refused(&["compare", "robot.toml", file, "-o", "result"], words)
}

/// A robot file given as text; the message must point to its line with `piece`.
fn robot_file(text: &str, piece: &str, words: &[&str]) {
    let place = Place::new();
    place.write("robot.toml", text);
    let here = format!("robot.toml:{}:", line_of(text, piece));
    compare_robot(&place, "robot.toml", &[&[here.as_str()], words].concat());
}

/// A URDF given as text; the message must point to the line with `piece` and offer help.
fn urdf(text: &str, piece: &str, words: &[&str]) {
    let place = Place::new();
    place.write("beam.urdf", text);
    let here = format!("beam.urdf:{}:", line_of(text, piece));
    compare_robot(&place, "beam.urdf", &[&[here.as_str(), "help: "], words].concat());
    // The same through the robot file.
    compare_robot(&place, "robot.toml", words);
}

/// A reduced link given as text; the message must point to the line with `piece`.
fn flex_file(text: &str, piece: &str, words: &[&str]) {
    let place = Place::new();
    place.write("robot.toml", flex::robot());
    place.write("bar.flex", text);
    let here = format!("bar.flex:{}:", line_of(text, piece));
    compare_robot(&place, "robot.toml", &[&[here.as_str()], words].concat());
}

/// Options after a valid `compare`.
fn options(arguments: &[&str], words: &[&str]) {
    let place = Place::new();
    place.refused(&[&["compare", "robot.toml", "swing.toml", "-o", "result"], arguments].concat(), words);
}

mod missing {
    use super::*;

    #[test]
    fn robot_file() {
        let place = Place::new();
        for name in ["nowhere.toml", "nowhere", "folder/robot.toml", "nowhere.urdf"] {
            compare_robot(&place, name, &[name, "no such file", "robot.toml", ".urdf"]);
        }
        place.refused(&["inspect", "nowhere.toml"], &["nowhere.toml", "no such file"]);
    }

    #[test]
    fn robot_of_another_kind() {
        let place = Place::new();
        place.write("robot.txt", ROBOT);
        compare_robot(&place, "robot.txt", &["robot.txt", "expected", "robot.toml", ".urdf"]);
    }

    #[test]
    fn trajectory() {
        let place = Place::new();
        for name in ["nowhere.csv", "nowhere.toml", "nowhere"] {
            let arguments = ["compare", "robot.toml", name, "-o", "result"];
            place.refused(&arguments, &[name, "no such trajectory", ".csv", ".toml"]);
        }
        place.refused(&["compare", "robot.toml", "-o", "result"], &["default_trajectory", ".csv", ".toml"]);
    }

    #[test]
    fn trajectory_of_another_kind() {
        let letter = "A letter.\nIt says nothing about motion.\n";
        compare_motion(
            "swing.txt",
            letter,
            &["swing.txt", "\"A letter.\"", "waypoints (TOML)", "(CSV)", "rename or convert"],
        );
    }

    #[test]
    fn urdf() {
        let place = Place::new();
        std::fs::remove_file(place.path("beam.urdf")).unwrap();
        compare_robot(&place, "robot.toml", &["robot.toml:3:", "beam.urdf", "no file", "correct the path"]);
    }

    #[test]
    fn reduced_link() {
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        compare_robot(&place, "robot.toml", &["robot.toml:11:", "bar.flex", "no file", "correct the path"]);
    }

    #[test]
    fn a_robot_that_is_not_shipped() {
        let place = Place::new();
        place.refused(&["inspect", "kr211"], &["kr211", "did you mean \"kr210\"?", "manutec_r3"]);
    }

    #[test]
    fn xacro_that_is_not_whole() {
        let place = Place::new();
        let text = with(URDF, "<robot ", "<robot xmlns:xacro=\"http://wiki.ros.org/xacro\" ");
        place.write("arm.urdf.xacro", with(&text, "</robot>", "<link name=\"$(arg tool)\"/></robot>"));
        place.refused(
            &["compare", "arm.urdf.xacro", "swing.toml"],
            &["arm.urdf.xacro:", "\"tool\" has no value", "--arg tool="],
        );
        place.refused(&["inspect", "arm.urdf.xacro", "--arg", "tool"], &["--arg", "NAME=VALUE"]);
    }

    #[test]
    fn command() {
        let place = Place::new();
        place.refused(&["simulate"], &["simulate"]);
        place.refused(&["inspect"], &["<ROBOT>"]);
        place.refused(&["compare", "robot.toml", "swing.toml", "--stp", "1e-3"], &["--stp", "--step"]);
    }
}

mod trajectory {
    use super::*;

    #[test]
    fn joint_that_the_robot_lacks() {
        let csv = "time,swong\n0,0\n1,0.5\n";
        let words = ["\"swong\" is not a joint of the robot", "did you mean \"swing\"?", "rename"];
        compare_motion("extra.csv", csv, &[&["extra.csv:1:6"], &words[..]].concat());
        let toml = with(SWING, "\"swing\"", "\"swong\"");
        compare_motion("other.toml", toml, &[&["other.toml"], &words[..]].concat());
    }

    /// A column that is no joint of the robot is left out with a warning, even with a name close to
    /// a joint, if the file names this joint as well.
    #[test]
    fn column_that_is_no_joint() {
        let place = Place::new();
        place.write("extra.csv", "time,swing,swong\n0,0,0\n1,0.5,0\n");
        let answer = place.flexarm(&["compare", "robot.toml", "extra.csv", "--no-files"]);
        assert_eq!(answer.code, 0, "{}", answer.err);
        answer.says(&["warning: extra.csv", "left out: \"swong\"", "--columns"]);
    }

    #[test]
    fn joint_that_is_missing() {
        let place = Place::new();
        place.write("motion.csv", "time,joint_1\n0,0\n1,0.5\n");
        let robot = common::shipped_robot("test/reference_arm");
        let answer = place.flexarm(&["compare", &robot, "motion.csv", "-o", "result"]);
        assert_eq!(answer.code, 0, "{}", answer.err);
        answer.says(&["motion.csv", "joints that the motion does not name are held", "\"joint_2\" at 0", "[hold]"]);
    }

    #[test]
    fn joints_that_do_not_match_with_file() {
        compare_motion("other.csv", "time,swong\n0,0\n1,0.5\n", &["other.csv", "\"swong\"", "did you mean \"swing\"?"]);
    }

    #[test]
    fn unit_in_csv() {
        let csv = "# made by hand\n# unit: grad\ntime,swing\n0,0\n1,0.5\n";
        compare_motion("m.csv", csv, &["m.csv:2:", "\"grad\"", "accepted: rad, deg"]);
        let csv = "# time: ms\ntime,swing\n0,0\n1,0.5\n";
        compare_motion("m.csv", csv, &["m.csv:1:", "\"ms\"", "`time`", "accepted: s"]);
    }

    #[test]
    fn unit_in_toml() {
        let toml = with(SWING, "\"deg\"", "\"degrees\"");
        compare_motion("m.toml", toml, &["m.toml:2:", "\"degrees\"", "\"rad\", \"deg\""]);
    }

    #[test]
    fn time_that_does_not_increase() {
        for (last, found) in [("0.5", "0.5 s does not follow 1 s"), ("1", "1 s does not follow 1 s")] {
            let csv = format!("time,swing\n0,0\n1,0.5\n{last},0.2\n");
            compare_motion("m.csv", csv, &["m.csv:4:1", found, "increase", "sort"]);
        }
    }

    #[test]
    fn number_that_is_none() {
        for found in ["NaN", "inf", "-Infinity", "1.0.0", "", "0x10", "1e999"] {
            let csv = format!("time,swing\n0,0\n1,{found}\n2,0.2\n");
            compare_motion("m.csv", csv, &["m.csv:3:3", "swing", "number"]);
        }
        let csv = "time,swing\nNaN,0\n1,0.1\n";
        compare_motion("m.csv", csv, &["m.csv:2:1", "time", "\"NaN\""]);
    }

    #[test]
    fn ragged_rows() {
        let short = "time,swing\n0,0\n1,0.1\n2\n";
        compare_motion("m.csv", short, &["m.csv:4:", "1 fields", "2", "cut off"]);
        let long = "time,swing\n0,0\n1,0.1,7\n2,0.2\n";
        compare_motion("m.csv", long, &["m.csv:3:", "3 fields", "2"]);
    }

    #[test]
    fn no_rows() {
        compare_motion("m.csv", "", &["m.csv", "empty", "time"]);
        compare_motion("m.csv", "time,swing\n", &["m.csv", "0 rows", "at least 2"]);
        compare_motion("m.csv", "time,swing\n0,0\n", &["m.csv", "1 rows", "at least 2"]);
        compare_motion("m.csv", "time\n0\n1\n", &["m.csv", "joint"]);
    }

    #[test]
    fn no_time_column() {
        compare_motion("m.csv", "x,swing\n0,0\n1,0.1\n", &["m.csv:1:", "`time`", "\"swing\""]);
    }

    #[test]
    fn other_separators() {
        compare_motion("m.csv", "time,swing\n0,0,0,0\n1,0,0,1\n", &["m.csv:2:", "decimal commas", "semicolons"]);
        compare_motion("m.csv", "time;swing\n0;0.5\n1;0,1\n", &["m.csv:3:", "m.csv:2:3)", "m.csv:3:3)"]);
    }

    #[test]
    fn bytes_that_are_no_text() {
        for (seed, file) in [(1, "m.csv"), (2, "m.toml"), (3, "m.csv"), (4, "m.toml")] {
            compare_motion(file, garbage(3000, seed), &[file, "UTF-8"]);
        }
    }

    #[test]
    fn toml_cut_off() {
        // Truncated within a string, within an array, between lines: no truncation before the first
        // complete move may pass.
        let end = SWING.find(".0]\nduration").unwrap();
        for length in 0..end {
            let answer = compare_motion("m.toml", &SWING[..length], &["m.toml"]);
            assert!(!answer.err.contains("untagged"), "{}", answer.err);
        }
        compare_motion("m.toml", &SWING[..40], &["m.toml:3:", "expected"]);
    }

    #[test]
    fn toml_key_misspelt() {
        let toml = with(SWING, "hold", "hodl");
        let line = format!("m.toml:{}:", line_of(&toml, "hodl"));
        compare_motion("m.toml", toml, &[&line, "`hodl`", "`hold`"]);
    }

    #[test]
    fn toml_values() {
        let toml = with(SWING, "duration = 0.5", "duration = -0.5");
        compare_motion("m.toml", toml, &["m.toml:", "duration", "-0.5"]);
        let toml = with(SWING, "to = [60.0]", "to = [60.0, 1.0]");
        compare_motion("m.toml", toml, &["m.toml:", "`to`", "2 entries", "expected 1"]);
        let toml = with(SWING, "to = [60.0]", "to = [nan]");
        compare_motion("m.toml", toml, &["m.toml:", "`to", "NaN"]);
        let toml = with(SWING, "\"quintic\"", "\"septic\"");
        compare_motion("m.toml", toml, &["m.toml:5:", "septic", "quintic"]);
        let toml = with(SWING, "format = 1", "format = 7");
        compare_motion("m.toml", toml, &["m.toml", "7", "format = 1"]);
    }

    /// Above, below and too fast in one motion.
    const WILD: &str = "time,swing\n0,0\n1,3.5\n2,-3.5\n3,0\n";

    #[test]
    fn limits_are_all_listed() {
        let words = [
            "3 joint limits",
            "upper limit 3.0",
            "lower limit -3.0",
            "velocity exceeds",
            "\"swing\"",
            "--ignore-limits",
        ];
        compare_motion("wild.csv", WILD, &words);
        let place = Place::new();
        let robot = common::shipped_robot("test/reference_arm");
        let rows = |q: f64| format!("1,{}\n", [q; 6].map(|q| q.to_string()).join(","));
        let head = "time,joint_1,joint_2,joint_3,joint_4,joint_5,joint_6\n0,0,0,0,0,0,0\n";
        place.write("fast.csv", format!("{head}{}", rows(6.0)));
        let joints: Vec<String> =
            (1..=6).map(|k| format!("joint \"joint_{k}\": velocity exceeds its limit 4")).collect();
        let words: Vec<&str> = joints.iter().map(String::as_str).collect();
        place.refused(&["compare", &robot, "fast.csv", "-o", "result"], &words);
    }

    #[test]
    fn limits_can_be_ignored() {
        let place = Place::new();
        place.write("wild.csv", WILD);
        let arguments = ["compare", "robot.toml", "wild.csv", "-o", "result", "--ignore-limits", "--json"];
        let answer = place.flexarm(&arguments);
        assert_eq!(answer.code, 0, "{}", answer.err);
        answer.says(&["warning", "upper limit", "lower limit", "velocity exceeds"]);
        let warnings = answer.json()["warnings"].to_string();
        for word in ["upper limit", "lower limit", "velocity exceeds"] {
            assert!(warnings.contains(word), "{word} is not in the report's warnings: {warnings}");
        }
        assert!(place.path("result/run.csv").is_file());
    }

    #[test]
    fn limits_with_file() {
        compare_motion("wild.csv", WILD, &["wild.csv", "3 joint limits"]);
    }
}

mod robot_description {
    use super::*;

    #[test]
    fn urdf_cut_off() {
        // At any truncation the file is refused with a location in it.
        let end = URDF.rfind("</robot>").unwrap();
        let place = Place::new();
        for length in (0..end).step_by(7) {
            place.write("cut.urdf", &URDF[..length]);
            place.refused(&["inspect", "cut.urdf"], &["cut.urdf:", "end of the file", "help: is the file complete?"]);
        }
        place.write("cut.urdf", &URDF[..400]);
        compare_robot(&place, "cut.urdf", &["cut.urdf:", "end of the file"]);
    }

    #[test]
    fn urdf_of_random_bytes() {
        let place = Place::new();
        for seed in 1..20 {
            place.write("garbled.urdf", garbage(2000, seed));
            compare_robot(&place, "garbled.urdf", &["garbled.urdf:1:", "help: "]);
        }
        // Bytes that are text but not XML.
        let letters: String = garbage(500, 5).iter().map(|b| char::from(b' ' + b % 90)).collect();
        place.write("garbled.urdf", letters);
        compare_robot(&place, "garbled.urdf", &["garbled.urdf:1:", "expected", "help: "]);
    }

    #[test]
    fn urdf_with_one_byte_spoilt() {
        // Nearly valid files must never cause a panic; some are still valid.
        let place = Place::new();
        for (k, place_of_byte) in (30..URDF.len()).step_by(23).enumerate() {
            let mut bytes = URDF.as_bytes().to_vec();
            bytes[place_of_byte] = b"<>\"/0-x\xff"[k % 8];
            place.write("spoilt.urdf", bytes);
            let answer = place.flexarm(&["inspect", "spoilt.urdf", "--json"]);
            assert!(matches!(answer.code, 0 | 2), "{}: {}", answer.code, answer.err);
            let warned = answer.err.lines().all(|line| line.starts_with("warning: "));
            assert_eq!(answer.code == 0, warned, "{}", answer.err);
        }
    }

    #[test]
    fn urdf_of_another_format() {
        let place = Place::new();
        place.write("arm.urdf", "<sdf version=\"1.7\"><model name=\"arm\"/></sdf>");
        compare_robot(&place, "arm.urdf", &["arm.urdf:1:", "<sdf>", "<robot>", "help: ", "SDF"]);
        place.write("arm.urdf", with(URDF, "<robot ", "<robot xmlns:xacro=\"http://wiki.ros.org/xacro\" "));
        let with_macro = with(&place.text("arm.urdf"), "</robot>", "<xacro:include filename=\"a\"/></robot>");
        place.write("arm.urdf", with_macro);
        compare_robot(&place, "arm.urdf", &["arm.urdf:", " a cannot be read", "help: "]);
    }

    #[test]
    fn cyclic_links() {
        let text = with(URDF, "<parent link=\"base\"/>", "<parent link=\"ball\"/>");
        urdf(&text, "name=\"swing\"", &["cycle", "\"swing\"", "\"weld\""]);
        let back =
            "<joint name=\"back\" type=\"fixed\"><parent link=\"ball\"/><child link=\"base\"/></joint>\n</robot>";
        let text = with(URDF, "</robot>", back);
        urdf(&text, "name=\"back\"", &["cycle", "\"swing\"", "\"weld\"", "\"back\"", "remove"]);
    }

    #[test]
    fn disconnected_links() {
        let text = with(URDF, "</robot>", "<link name=\"island\"/>\n</robot>");
        urdf(&text, "island", &["not connected", "\"base\"", "\"island\"", "add a (fixed) joint"]);
    }

    #[test]
    fn two_parents() {
        let again =
            "<joint name=\"again\" type=\"fixed\"><parent link=\"base\"/><child link=\"ball\"/></joint>\n</robot>";
        let text = with(URDF, "</robot>", again);
        let first = format!("(beam.urdf:{}:", line_of(URDF, "\"weld\""));
        urdf(&text, "again", &["link \"ball\"", "two joints", "\"weld\"", &first, "\"again\"", "remove"]);
    }

    #[test]
    fn unknown_names() {
        let text = with(URDF, "<child link=\"ball\"/>", "<child link=\"bell\"/>");
        urdf(&text, "\"weld\"", &["\"weld\"", "child link \"bell\" does not exist", "did you mean \"ball\"?"]);
        let text = with(URDF, "\"revolute\"", "\"revolut\"");
        urdf(&text, "revolut", &["\"swing\"", "\"revolut\"", "did you mean \"revolute\"?"]);
        let again = with(URDF, "</robot>", "<link name=\"bar\"/><!-- again -->\n</robot>");
        let first = format!("first at beam.urdf:{}:", line_of(URDF, "<link name=\"bar\">"));
        urdf(&again, "again", &["link \"bar\"", "twice", &first]);
    }

    #[test]
    fn masses() {
        let text = with(URDF, "\"1.728\"", "\"-1.728\"");
        urdf(&text, "<inertial>", &["link \"bar\"", "-1.728 kg", "positive", "sign"]);
        let text = with(URDF, "\"1.728\"", "\"nan\"");
        urdf(&text, "\"nan\"", &["link \"bar\"", "value=\"nan\"", "finite number"]);
        let text = with(URDF, "\"1.728\"", "\"1,728\"");
        urdf(&text, "\"1,728\"", &["link \"bar\"", "value=\"1,728\"", "number"]);
    }

    #[test]
    fn inertias() {
        let text = with(URDF, "ixx=\"0.000288\"", "ixx=\"-0.000288\"");
        urdf(&text, "<inertial>", &["link \"bar\"", "not positive definite", "-2.88", "kg m^2"]);
        let text = with(URDF, "ixy=\"0\"", "ixy=\"1\"");
        urdf(&text, "<inertial>", &["link \"bar\"", "not positive definite"]);
        let text = with(URDF, "ixx=\"0.000288\"", "ixx=\"0.5\"");
        urdf(&text, "<inertial>", &["link \"bar\"", "triangle inequality", "5.0", "order ixx ixy ixz iyy iyz izz"]);
    }

    /// A bare arm without masses can be moved; the missing masses are reported, with options that
    /// exist.
    #[test]
    fn missing_inertial() {
        let place = Place::new();
        place.write("arm.urdf", URDF.replace("inertial>", "inertia_tensor>"));
        let answer = place.flexarm(&["check", "arm.urdf"]);
        assert_eq!(answer.code, 0, "{}{}", answer.out, answer.err);
        for piece in [
            "\"bar\"",
            "\"swing\"",
            "no <inertial>",
            "(\"ball\")",
            "--inertia-from-density",
            "--inertia-from-total-mass",
        ] {
            assert!(format!("{}{}", answer.out, answer.err).contains(piece), "{piece}: {}{}", answer.out, answer.err);
        }
        assert_eq!(place.flexarm(&["inspect", "arm.urdf"]).code, 0);
        assert_eq!(place.flexarm(&["compare", "arm.urdf", "swing.toml", "--no-files"]).code, 0);
    }

    #[test]
    fn joints() {
        let text = with(URDF, "\"0 0 1\"", "\"0 0 0\"");
        urdf(&text, "<axis", &["\"swing\"", "zero vector", "unit vector"]);
        let text = with(URDF, "lower=\"-3.0\"", "lower=\"5.0\"");
        urdf(&text, "<limit", &["\"swing\"", "lower limit 5", "upper limit 3"]);
        let text = with(URDF, "<limit lower=\"-3.0\" upper=\"3.0\" effort=\"500\" velocity=\"4\"/>", "");
        urdf(&text, "\"swing\"", &["\"swing\"", "no <limit>", "continuous"]);
    }

    #[test]
    fn several_faults_at_once() {
        let text = with(&with(URDF, "\"1.728\"", "\"-1.728\""), "\"0 0 1\"", "\"0 0 0\"");
        let mass = format!("beam.urdf:{}:", line_of(&text, "<inertial>"));
        urdf(&text, "<axis", &["zero vector", &mass, "-1.728 kg"]);
    }
}

mod robot_toml {
    use super::*;

    #[test]
    fn cut_off() {
        let end = ROBOT.find("damping").unwrap();
        let place = Place::new();
        // A truncation between two lines may leave a valid file; one within a line never does.
        for length in (1..end).filter(|n| !ROBOT[..*n].ends_with('\n') && !ROBOT[*n..].starts_with('\n')) {
            place.write("robot.toml", &ROBOT[..length]);
            place.refused(&["inspect", "robot.toml"], &["robot.toml:"]);
        }
        place.write("robot.toml", &ROBOT[..ROBOT.find("ball").unwrap() + 2]);
        compare_robot(&place, "robot.toml", &["robot.toml:4:", "expected"]);
        place.write("robot.toml", "");
        compare_robot(&place, "robot.toml", &["robot.toml:1:", "missing", "`format`"]);
    }

    #[test]
    fn random_bytes() {
        let place = Place::new();
        for seed in 1..10 {
            place.write("robot.toml", garbage(1000, seed));
            compare_robot(&place, "robot.toml", &["robot.toml", "UTF-8"]);
        }
    }

    #[test]
    fn misspelt_keys() {
        let keys = [
            ("gravity", "gravitty"),
            ("damping", "dampng"),
            ("modal", "modul"),
            ("width", "widht"),
            ("distal", "distl"),
        ];
        for (key, wrong) in keys {
            let (key_quoted, wrong_quoted) = (format!("`{key}`"), format!("`{wrong}`"));
            robot_file(&with(ROBOT, key, wrong), wrong, &["unknown field", &wrong_quoted, "expected", &key_quoted]);
        }
    }

    #[test]
    fn format_of_another_version() {
        robot_file(&with(ROBOT, "format = 1", "format = 2"), "format", &["format is 2", "reads format 1"]);
    }

    #[test]
    fn vectors_of_another_length() {
        robot_file(&with(ROBOT, "[0.0, 0.0, -9.81]", "[0.0, -9.81]"), "gravity", &["length 2", "length 3"]);
    }

    #[test]
    fn unknown_section_material_theory() {
        robot_file(
            &with(ROBOT, "\"rectangle\"", "\"rectangel\""),
            "beam =",
            &["\"bar\"", "\"rectangel\"", "rectangle", "tube"],
        );
        robot_file(
            &with(ROBOT, "\"aluminium\"", "\"unobtainium\""),
            "beam =",
            &["\"unobtainium\"", "aluminium", "steel"],
        );
        let text = with(ROBOT, "y_axis", "theory = \"string\", y_axis");
        robot_file(&text, "beam =", &["\"string\"", "timoshenko", "euler-bernoulli"]);
    }

    #[test]
    fn section_values() {
        robot_file(&with(ROBOT, "width = 0.02", "width = 0.0"), "beam =", &["\"bar\"", "width (m) is 0", "positive"]);
        robot_file(&with(ROBOT, "width = 0.02", "width = nan"), "beam =", &["width (m) is NaN", "positive finite"]);
        robot_file(&with(ROBOT, "width = 0.02, ", ""), "beam =", &["\"rectangle\"", "needs width"]);
        robot_file(
            &with(ROBOT, "width = 0.02", "width = 0.02, wall = 0.001"),
            "beam =",
            &["does not take wall", "width", "height"],
        );
        robot_file(&with(ROBOT, "[0.0, 1.0, 0.0]", "[1.0, 0.0, 0.0]"), "beam =", &["\"bar\"", "axis y"]);
        robot_file(&with(ROBOT, "y_axis", "split = 1.5, y_axis"), "beam =", &["1.5", "above 0 and below 1"]);
    }

    #[test]
    fn material_values() {
        let negative = "{ E = -70e9, nu = 0.33, rho = 2700.0 }";
        robot_file(&with(ROBOT, "\"aluminium\"", negative), "beam =", &["Young's modulus", "-70000000000", "positive"]);
    }

    #[test]
    fn material_without_density() {
        robot_file(&with(ROBOT, "\"aluminium\"", "{ E = 70e9, nu = 0.33 }"), "beam =", &["rho"]);
    }

    #[test]
    fn unknown_links_and_joints() {
        let words = ["\"bor\"", "not a link", "\"base\", \"bar\", \"ball\""];
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "link = \"bar\"", "link = \"bor\""));
        compare_robot(&place, "robot.toml", &[&["robot.toml:"], &words[..]].concat());
        robot_file(&with(ROBOT, "\"weld\"", "\"wold\""), "wold", &["\"wold\"", "\"bar\"", "\"weld\""]);
        robot_file(&with(ROBOT, "\"ball\"", "\"bell\""), "bell", &["TCP", "\"bell\"", "\"ball\""]);
        let text =
            with(ROBOT, "\ngravity", "\npayload = { link = \"hand\", mass = 1.0, com = [0.0, 0.0, 0.0] }\ngravity");
        robot_file(&text, "payload", &["payload", "\"hand\"", "\"ball\""]);
    }

    #[test]
    fn unknown_link_in_its_line() {
        robot_file(&with(ROBOT, "link = \"bar\"", "link = \"bor\""), "\"bor\"", &["not a link"]);
    }

    #[test]
    fn link_twice() {
        let again = "\n[[flexible_link]]\nlink = \"bar\"\nbeam = { section = \"circle\", diameter = 0.1, material = \"steel\" }\n";
        let place = Place::new();
        place.write("robot.toml", format!("{ROBOT}{again}"));
        compare_robot(&place, "robot.toml", &["robot.toml:", "\"bar\"", "twice"]);
    }

    #[test]
    fn value_of_a_key_with_several_forms() {
        let drive = "[[drive]]\njoint = \"swing\"\nkind = \"gearbox\"\ngearbox = { stiffness = \"soft\" }\n";
        robot_file(&format!("{ROBOT}\n{drive}"), "\"soft\"", &["a list of 3 or 6 numbers", "found \"soft\""]);
    }

    #[test]
    fn link_without_stiffness() {
        let text: String = ROBOT.lines().filter(|l| !l.starts_with("beam =")).map(|l| format!("{l}\n")).collect();
        robot_file(&text, "link = \"bar\"", &["\"bar\"", "reduced", "beam"]);
        let both = with(ROBOT, "beam =", "reduced = \"bar.flex\"\nbeam =");
        robot_file(&both, "link = \"bar\"", &["\"bar\"", "either", "reduced", "beam"]);
    }

    #[test]
    fn angles() {
        robot_file(
            &with(ROBOT, "damping", "angles = \"xyz\"\ndamping"),
            "angles",
            &["\"xyz\"", "rotation-vector", "euler-zyx"],
        );
    }

    #[test]
    fn damping_values() {
        robot_file(&with(ROBOT, "modal = 0.03", "modal = -0.03"), "damping", &["-0.03", "positive"]);
        robot_file(&with(ROBOT, "modal = 0.03", "modal = 3.0"), "damping", &["3", "below 1", "0.03"]);
        robot_file(&with(ROBOT, "modal = 0.03", "modal = nan"), "damping", &["NaN"]);
        let both = with(ROBOT, "modal = 0.03", "modal = 0.03, stiffness_beta = 1e-4");
        robot_file(&both, "damping", &["exactly one", "modal", "stiffness_beta"]);
    }

    #[test]
    fn drives() {
        let drive = |joint: &str, kind: &str| format!("{ROBOT}\n[[drive]]\njoint = \"{joint}\"\nkind = \"{kind}\"\n");
        robot_file(&drive("swing", "gearbx"), "kind", &["\"gearbx\"", "\"prescribed\""]);
        robot_file(&drive("elbow", "prescribed"), "elbow", &["\"elbow\"", "no such movable joint", "\"swing\""]);
        robot_file(&drive("weld", "prescribed"), "joint = \"weld\"", &["\"weld\"", "\"swing\""]);
    }

    #[test]
    fn payload_values() {
        let payload = |entry: &str| with(ROBOT, "\ngravity", &format!("\npayload = {{ {entry} }}\ngravity"));
        for mass in ["-1.0", "nan"] {
            let text = payload(&format!("mass = {mass}, com = [0.0, 0.0, 0.0]"));
            robot_file(&text, "payload", &["payload mass", "positive"]);
        }
        let text = payload("mass = 1.0, com = [0.0, 0.0, 0.0], inertia = [-1.0, 1.0, 1.0, 0.0, 0.0, 0.0]");
        robot_file(&text, "payload", &["payload inertia", "negative", "ixx iyy izz ixy ixz iyz"]);
    }

    #[test]
    fn gravity_that_is_no_number() {
        robot_file(&with(ROBOT, "-9.81]", "nan]"), "gravity", &["gravity", "NaN"]);
    }

    #[test]
    fn tcp_and_payload_that_are_no_numbers() {
        robot_file(&with(ROBOT, "{ link = \"ball\" }", "{ link = \"ball\", xyz = [0.0, nan, 0.0] }"), "tcp", &["NaN"]);
        let payload = "\npayload = { mass = 1.0, com = [0.0, inf, 0.0] }\ngravity";
        robot_file(&with(ROBOT, "\ngravity", payload), "payload", &["payload", "inf"]);
    }
}

mod reduced_link {
    use super::*;

    fn sound() -> String {
        flex::text(&flex::stiffness_6())
    }

    /// The files that the tests below corrupt are valid, and both kinds describe the same link.
    #[test]
    fn sound_files_pass() {
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        let frequencies = [flex::stiffness_6(), flex::stiffness_12()].map(|matrix| {
            place.write("bar.flex", flex::text(&matrix));
            let summary = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
            common::numbers(&summary["frequencies_hz"])
        });
        for (a, b) in frequencies[0].iter().zip(&frequencies[1]) {
            assert!((a - b).abs() < 1e-6 * a, "{frequencies:?}");
        }
    }

    #[test]
    fn singular_stiffness() {
        // No torsional stiffness.
        let mut k = flex::stiffness_6();
        k[3][3] = 0.0;
        flex_file(&flex::text(&k), "matrix", &["singular", "rx", "eigenvalue", "untied"]);
        // Bending without the coupled shear: a combination is free.
        let mut k = flex::stiffness_6();
        k[1][5] = -(k[1][1] * k[5][5]).sqrt();
        k[5][1] = k[1][5];
        flex_file(&flex::text(&k), "matrix", &["singular", "uy", "rz", "eigenvalue"]);
        let mut k = flex::stiffness_6();
        k[0][0] = -k[0][0];
        flex_file(&flex::text(&k), "matrix", &["not positive definite"]);
    }

    #[test]
    fn asymmetric_stiffness() {
        let mut k = flex::stiffness_12();
        k[1][7] *= 1.01;
        flex_file(&flex::text(&k), "matrix", &["12x12", "not symmetric", "(1, 7)", "1.0e-2", "allowed 1.0e-9"]);
        let mut k = flex::stiffness_6();
        k[1][5] *= 1.01;
        flex_file(&flex::text(&k), "matrix", &["not symmetric", "(1, 5)"]);
    }

    #[test]
    fn stiffness_to_the_ground() {
        let mut k = flex::stiffness_12();
        (6..12).for_each(|i| k[i][i] *= 1.05);
        flex_file(&flex::text(&k), "matrix", &["moves under rigid motion", "relative force", "allowed", "support"]);
    }

    #[test]
    fn interfaces_elsewhere() {
        // The 12x12 matrix defines the lever itself, the 6x6 refers to the robot's joint.
        let moved = |text: &str| with(text, "[interface.B]\nxyz = [0.8,", "[interface.B]\nxyz = [0.7,");
        let text = moved(&flex::text(&flex::stiffness_12()));
        flex_file(&text, "matrix", &["p_AB = (0.7", "the matrix itself (0.8"]);
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        place.write("bar.flex", moved(&sound()));
        compare_robot(&place, "robot.toml", &["\"bar\"", "interface B", "1.000e-1 m", "\"weld\"", "units"]);
        // Metres declared as millimetres.
        place.write("bar.flex", with(&sound(), "length = \"m\"", "length = \"mm\""));
        compare_robot(&place, "robot.toml", &["\"bar\"", "interface B", "\"weld\"", "units"]);
    }

    #[test]
    fn file_of_another_link() {
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        place.write("bar.flex", with(&sound(), "link = \"bar\"", "link = \"forearm\""));
        let answer = place.flexarm(&["compare", "robot.toml", "swing.toml", "--no-files"]);
        answer.says(&["\"forearm\"", "\"bar\""]);
    }

    #[test]
    fn missing_interface() {
        let text = with(&sound(), "[interface.A]", "[interface.C]");
        flex_file(&text, "[interface.C]", &["interface.C", "A, B"]);
        let text = with(&sound(), "[interface.A]\nxyz = [0.0, 0.0, 0.0]\n", "");
        flex_file(&text, "[interface.B]", &["interface", "\"A\""]);
    }

    #[test]
    fn cut_off() {
        let text = sound();
        let cut = text.find("matrix").unwrap() + 200;
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        place.write("bar.flex", &text[..cut]);
        compare_robot(&place, "robot.toml", &["bar.flex:", "unclosed array", "cut off?"]);
        place.write("bar.flex", &text[..text.rfind("[[part]]").unwrap()]);
        compare_robot(&place, "robot.toml", &["bar.flex:", "no distal part", "cut off?"]);
        place.write("bar.flex", &text[..text.rfind("inertia").unwrap()]);
        compare_robot(&place, "robot.toml", &["bar.flex:", "\"inertia\"", "ixx, iyy, izz"]);
        // No truncation may pass at any position: the last key is also required.
        for length in (0..text.len() - 2).step_by(17) {
            place.write("bar.flex", &text[..length]);
            place.refused(&["inspect", "robot.toml"], &["bar.flex:"]);
        }
    }

    #[test]
    fn rows_missing() {
        let text = flex::text(&flex::stiffness_6());
        flex_file(&with(&text, "\"6x6\"", "\"12x12\""), "matrix", &["6 entries", "12 rows"]);
        let mut k = flex::stiffness_6();
        k[2].pop();
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        place.write("bar.flex", flex::text(&k));
        compare_robot(&place, "robot.toml", &["bar.flex:", "matrix[2]", "5 entries"]);
    }

    #[test]
    fn words_and_units() {
        flex_file(&with(&sound(), "\"N\"", "\"lbf\""), "lbf", &["units.force", "\"lbf\"", "\"N\" or \"kN\""]);
        let text = with(&sound(), "force = \"N\"\n", "");
        flex_file(&text, "[units]", &["units.force", "\"force\"", "never guessed"]);
        let text = with(&sound(), "ux uy uz rx ry rz", "rx ry rz ux uy uz");
        flex_file(&text, "order", &["stiffness.order", "rx ry rz ux uy uz", "linear first"]);
        let text = with(&sound(), "axes = \"link\"", "axes = \"world\"");
        flex_file(&text, "axes", &["stiffness.axes", "\"world\"", "\"interface_A\""]);
        let text = with(&sound(), "com = ", "cog = ");
        flex_file(&text, "cog", &["\"cog\"", "com", "spelling"]);
    }

    #[test]
    fn parts_that_no_body_has() {
        let text = with(&sound(), "mass = 0.864", "mass = -0.864");
        flex_file(&text, "[[part]]", &["proximal", "-0.864", "positive"]);
        let text = with(&sound(), "mass = 0.864", "mass = nan");
        flex_file(&text, "nan", &["part[0].mass", "nan", "finite"]);
    }

    #[test]
    fn random_bytes() {
        let place = Place::new();
        place.write("robot.toml", flex::robot());
        for seed in 1..10 {
            place.write("bar.flex", garbage(1000, seed));
            compare_robot(&place, "robot.toml", &["bar.flex:1:", "UTF-8"]);
        }
    }
}

mod values_on_the_command_line {
    use super::*;

    #[test]
    fn words() {
        let steppers = flexarm::steppers::STEPPERS.map(|entry| entry.name);
        options(&["--stepper", "euler"], &[&["'euler'", "--stepper"][..], &steppers].concat());
        options(&["--reference-method", "euler"], &["'euler'", "--reference-method", "bdf", "esdirk34", "tsit45"]);
        options(&["--links", "stiff"], &["'stiff'", "--links", "rigid", "lumped"]);
        options(&["--from-rest", "flying"], &["'flying'", "--from-rest", "equilibrium", "undeformed"]);
        options(&["--tcp", "nowhere"], &["\"nowhere\"", "\"base\", \"bar\", \"ball\""]);
        options(&["--package", "foo"], &["--package", "\"foo\"", "NAME=FOLDER"]);
    }

    #[test]
    fn steps() {
        for (value, found) in [("0", "0"), ("nan", "NaN"), ("inf", "inf")] {
            options(&["--step", value], &["step must be", "positive", &format!("found {found}")]);
        }
        options(&["--step=-1e-3"], &["step must be", "positive", "-0.001"]);
        options(&["--step", "-1e-3"], &[]);
        options(&["--step", "1ms"], &["'1ms'", "--step"]);
    }

    #[test]
    fn negative_step_after_a_space() {
        options(&["--step", "-1e-3"], &["step must be", "positive", "-0.001"]);
    }

    #[test]
    fn step_longer_than_the_motion() {
        options(&["--step", "10"], &["step", "10"]);
    }

    #[test]
    fn explicit_step_that_is_too_large() {
        options(
            &["--stepper", "rk4", "--step", "1e-2"],
            &["rk4", "unstable", "Hz", "below", "--step", "generalized-alpha"],
        );
    }

    #[test]
    fn tolerances() {
        for (value, found) in [("0", "0e0"), ("nan", "NaN"), ("1", "1e0"), ("1e-16", "1e-16")] {
            let words = ["relative tolerance", "between 1e-13 and 1e-2", &format!("found {found}")];
            options(&["--stepper", "reference", "--rtol", value], &words);
        }
    }

    #[test]
    fn other_numbers() {
        options(&["--rho-inf", "2"], &["spectral radius", "between 0 and 1", "found 2"]);
        options(&["--rho-inf", "nan"], &["spectral radius", "NaN"]);
        options(&["--start-time", "never"], &["--start-time", "now", "never"]);
        options(&["--start-time", "1e12"], &["--start-time", "2038"]);
        options(&["--log-rate", "0"], &["log rate", "positive", "found 0"]);
        options(&["--log-rate=-5"], &["log rate", "positive", "-5"]);
        options(&["--log-rate", "nan"], &["log rate", "NaN"]);
        options(&["--settling-band", "0"], &["settling band", "positive"]);
        options(&["--inertia-from-density", "0"], &["--inertia-from-density", "positive", "found 0"]);
        options(&["--inertia-from-total-mass", "nan"], &["--inertia-from-total-mass", "NaN"]);
    }

    #[test]
    fn options_that_exclude_each_other() {
        options(&["--no-files"], &["--no-files", "--output"]);
        let both = ["--inertia-from-density", "1", "--inertia-from-total-mass", "1"];
        options(&both, &["--inertia-from-density", "--inertia-from-total-mass"]);
    }

    #[test]
    fn joint_values() {
        let place = Place::new();
        let robot = common::shipped_robot("test/reference_arm");
        let at = |value: &str, words: &[&str]| {
            place.refused(&["inspect", &robot, "--at", value], words);
            place.refused(&["inspect", &robot, "--velocity", value], words);
        };
        at("1,2", &["2 joint values", "6 movable joints", "\"joint_1\"", "\"joint_6\""]);
        at("", &["0 joint values", "6 movable joints"]);
        at("0,0,0,0,0,0,0", &["7 joint values", "6 movable joints"]);
        at("elbow=1", &["\"elbow\"", "\"joint_1\"", "\"joint_6\""]);
        at("0,0,nan,0,0,0", &["\"nan\"", "finite number"]);
        at("joint_2=inf", &["\"inf\"", "finite number"]);
        at("0,0,zero,0,0,0", &["\"zero\"", "number"]);
        at("joint_1=1,2", &["\"2\"", "names"]);
        at("joint_1=", &["\"\"", "number"]);
    }

    #[test]
    fn joint_value_twice() {
        Place::new().refused(&["inspect", "robot.toml", "--at", "swing=1,swing=2"], &["\"swing\"", "twice"]);
    }
}

mod outputs {
    use super::*;

    #[test]
    fn existing_results_are_not_overwritten() {
        for file in ["run.csv", "run.mcap", "run.rrd", "report.html", "report.md", "summary.json", "figures"] {
            let place = Place::new();
            place.write(&format!("result/{file}"), "old");
            let there = format!("result/{file}");
            compare_robot(&place, "robot.toml", &[&there, "exists already", "not overwritten", "-o", "--force"]);
        }
    }

    #[test]
    fn results_of_a_run_stay_as_they_are() {
        let place = Place::new();
        place.json(&["compare", "robot.toml", "swing.toml", "-o", "result"]);
        compare_robot(&place, "robot.toml", &["exists already", "--force"]);
        // Nor does --force touch them before the input has been validated.
        let forced = ["compare", "robot.toml", "swing.toml", "-o", "result", "--force"];
        place.refused(&[&forced[..], &["--step", "0"]].concat(), &["step"]);
        place.refused(&[&forced[..], &["--log-rate", "0"]].concat(), &["log rate"]);
        place.refused(&["compare", "robot.toml", "none.csv", "-o", "result", "--force"], &["none.csv"]);
        place.json(&forced);
    }

    #[test]
    fn folder_that_cannot_be_made() {
        let place = Place::new();
        place.refused(
            &["compare", "robot.toml", "swing.toml", "-o", "beam.urdf"],
            &["beam.urdf", "is a file; the results need a folder"],
        );
    }
}

/// A duplicate column is ambiguous in any table; both positions are reported.
#[test]
fn a_column_that_comes_twice_is_refused_with_both_places() {
    let place = Place::new();
    place.write("l.toml", "format = 1\n[[load]]\nkind = \"table\"\nfile = \"l.csv\"\n");
    for (header, name) in [("time,time", "time"), ("time,fx,fy,fx", "fx"), ("time,fz,fz", "fz")] {
        let row = |t: &str| [t].into_iter().chain(header.split(',').skip(1).map(|_| "1")).collect::<Vec<_>>().join(",");
        place.write("l.csv", format!("{header}\n{}\n{}\n", row("0"), row("1")));
        let columns = if name == "fx" {
            "columns 2 and 4"
        } else if name == "fz" {
            "columns 2 and 3"
        } else {
            "columns 1 and 2"
        };
        let arguments = ["compare", "robot.toml", "swing.toml", "--loads", "l.toml", "--no-files"];
        place.refused(&arguments, &["l.csv", columns, name]);
    }
    place.write("m.csv", "time,swing,swing\n0,0,0\n1,0.1,0.2\n");
    place.refused(&["compare", "robot.toml", "m.csv", "--no-files"], &["m.csv:1:12", "as column 2", "swing"]);
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "result"]);
    let table = place.text("result/run.csv");
    for name in ["time", "flexible_x_m", "swing_position_rad"] {
        let doubled = table
            .lines()
            .map(|line| if line.starts_with("time") { format!("{line},{name}\n") } else { format!("{line},0\n") });
        place.write("twice.csv", doubled.collect::<String>());
        place.refused(&["convert", "twice.csv", "x.csv"], &["twice.csv", "columns", name]);
    }
}

/// A prismatic joint instead of the swing: numbers in degrees, of joints and of motions, are not
/// positions of it; and vice versa.
#[test]
fn units_that_contradict_what_a_joint_does_are_refused_wherever_it_is_told() {
    let place = Place::new();
    let slide = URDF.replace("type=\"revolute\"", "type=\"prismatic\"");
    place.write("slide.urdf", slide);
    place.write("slide.toml", ROBOT.replace("beam.urdf", "slide.urdf"));
    let run = |robot: &'static str, motion: &'static str| ["compare", robot, motion, "-o", "result"];
    let mend = ["joint \"swing\" slides", "read as degrees", "add \"swing\" to `metres`"];
    place.refused(&run("slide.toml", "swing.toml"), &[&["swing.toml:2:"][..], &mend].concat());
    place.write("deg.csv", "# unit: deg\ntime,swing\n0,0\n1,0.1\n2,0.1\n");
    place.refused(&run("slide.toml", "deg.csv"), &[&["deg.csv:1:"][..], &mend].concat());
    let sampled =
        "format = 1\nunit = \"deg\"\njoints = [\"swing\"]\n[samples]\ntime = [0.0, 1.0]\nposition = [[0.0], [0.1]]\n";
    place.write("sampled.toml", sampled);
    place.refused(&run("slide.toml", "sampled.toml"), &[&["sampled.toml:2:"][..], &mend].concat());
    for at in ["1deg", "swing=1deg"] {
        place.refused(&["statics", "slide.toml", "--at", at], &["joint \"swing\" slides", "give it in m"]);
    }
    place.refused(
        &["map", "slide.toml", "--over", "swing=0deg:9deg:3", "--no-files"],
        &["joint \"swing\" slides", "give it in m"],
    );
    let turns = ["joint \"swing\" turns", "take it out of `metres`"];
    place.write("m.toml", with(SWING, "unit = \"deg\"", "unit = \"deg\"\nmetres = [\"swing\"]"));
    place.refused(&run("robot.toml", "m.toml"), &[&["m.toml:3:"][..], &turns].concat());
    place.write("m.csv", "# metres: swing\ntime,swing\n0,0\n1,0.1\n2,0.1\n");
    place.refused(&run("robot.toml", "m.csv"), &[&["m.csv:1:"][..], &turns].concat());
    // Correct units are read: 0.3 m, and radians without a unit.
    place.write(
        "right.toml",
        with(SWING, "unit = \"deg\"", "unit = \"deg\"\nmetres = [\"swing\"]").replace("60.0", "0.3"),
    );
    place.write("si.toml", SWING.replace("\"deg\"", "\"rad\"").replace("60.0", "0.3"));
    let [right, si] = ["right.toml", "si.toml"].map(|motion| {
        let found = place.json(&["compare", "slide.toml", motion, "--no-files"]);
        found["tcp"]["peak_m"].as_f64().unwrap()
    });
    assert!(right == si && right > 0.0, "{right} {si}");
}

#[test]
fn questions_about_a_robot_that_does_not_bend_are_refused() {
    let place = Place::new();
    let yields = ["no flexible link and no elastic drive", "add [[flexible_link]] or [[drive]]"];
    place.refused(&["sensitivity", "beam.urdf", "swing.toml"], &yields);
    place.refused(&["sensitivity", "robot.toml", "swing.toml", "--links", "rigid"], &yields);
    place.refused(&["sensitivity", "robot.toml", "--links", "rigid", "--at", "0"], &yields);
    place.refused(&["identify", "beam.urdf", "--plan", "2", "--no-files"], &yields[..1]);
    let zero = ["the force [0.0, 0.0, 0.0] is zero"];
    place.refused(&["identify", "robot.toml", "--plan", "2", "--pull", "0,0,0", "--no-files"], &zero);
    let twice = "[[payload]]\nat = 0.2\nmass = 1.0\ncom = [0.0, 0.0, 0.0]\n";
    place.write("twice.toml", format!("format = 1\n{twice}{twice}"));
    let run = ["compare", "robot.toml", "swing.toml", "--no-files", "--loads", "twice.toml"];
    place.refused(&run, &["twice.toml:6", "two payloads change at 0.2 s on the same link"]);
}

#[test]
fn a_link_without_a_name_is_refused() {
    urdf(&URDF.replace("<link name=\"base\"/>", "<link name=\"\"/>"), "<link name=\"\"/>", &["no attribute \"name\""]);
}
