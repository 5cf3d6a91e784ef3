//! `flexarm motion`, and motions of other programs in the commands that accept one.

use std::path::{Path, PathBuf};

use crate::common::{self, Place};

/// Fixtures of the readers: two joints of an arm and a gripper.
fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../motion/flexarm-motion-io/tests/data").join(name)
}

/// The swing of 60 degrees in 0.5 s about the vertical axis.
const SWING_DEG: f64 = 60.0;
const SWING_S: f64 = 0.5;

/// A trajectory as planned by MoveIt, with a gripper that no arm has; the pose is one of the KR
/// 210.
fn planned() -> String {
    let mut points = String::new();
    for k in 0..=20 {
        let (t, s) = (0.1 * f64::from(k), f64::from(k) / 20.0);
        // The quintic from rest to rest in 2 s, with its velocities and accelerations.
        let u = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        let v = 30.0 * s * s * (1.0 - s) * (1.0 - s) / 2.0;
        let a = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / 4.0;
        points += &format!(
            "    - positions: [0.01, {}, {}, 1.5]\n      velocities: [0.0, {}, {}, 0.0]\n      accelerations: [0.0, {}, {}, 0.0]\n      time_from_start: {{sec: {}, nanosec: {}}}\n",
            0.3 * u,
            -1.3 + 0.2 * u,
            0.3 * v,
            0.2 * v,
            0.3 * a,
            0.2 * a,
            (1e9 * t).round() as i64 / 1_000_000_000,
            (1e9 * t).round() as i64 % 1_000_000_000
        );
    }
    format!(
        "model_id: kr210\ntrajectory:\n- joint_trajectory:\n    header: {{stamp: {{sec: 0, nanosec: 0}}, frame_id: base_link}}\n    \
         joint_names: [gripper_finger_joint, joint_1, joint_2, joint_3]\n    points:\n{points}  multi_dof_joint_trajectory:\n    joint_names: []\n    points: []\n\
         trajectory_start: {{joint_state: {{name: [], position: []}}}}\n"
    )
}

/// Truth: the same motion in flexarm's CSV format, with positions, velocities and accelerations.
fn planned_csv(place: &Place) {
    let yaml = planned();
    let numbers = |key: &str| -> Vec<Vec<f64>> {
        let lines = yaml.lines().filter(|line| line.contains(key));
        lines
            .map(|line| line.split(['[', ']']).nth(1).unwrap().split(", ").map(|x| x.parse().unwrap()).collect())
            .collect()
    };
    let (q, v, a) = (numbers("positions"), numbers("velocities"), numbers("accelerations"));
    let names = ["joint_1", "joint_2", "joint_3"];
    let mut text = "# unit: rad\ntime".to_owned();
    ["", ".vel", ".acc"].iter().for_each(|end| names.iter().for_each(|name| text += &format!(",{name}{end}")));
    for k in 0..q.len() {
        text += &format!("\n{:?}", (1e8 * k as f64).round() / 1e9);
        [&q, &v, &a].iter().for_each(|list| list[k][1..].iter().for_each(|x| text += &format!(",{x:?}")));
    }
    place.write("plan.csv", text + "\n");
}

#[test]
fn peaks_torque_and_way_of_the_tool_are_those_of_a_quintic_swing_about_the_vertical() {
    let place = Place::new();
    let found = place.json(&["motion", "swing.toml", "robot.toml"]);
    assert_eq!(found["format"], "waypoints");
    assert_eq!(found["joints"], serde_json::json!(["swing"]));
    assert_eq!((found["duration_s"].as_f64(), found["samples"].as_u64()), (Some(1.0), None));
    let peak = &found["peaks"][0];
    let value = |key: &str| peak[key].as_f64().unwrap();
    let (d, t) = (SWING_DEG.to_radians(), SWING_S);
    // D u³ (10 - 15 u + 6 u²): peaks 15/8 D/T, 10/√3 D/T² and 60 D/T³.
    let acceleration = 10.0 / 3f64.sqrt() * d / (t * t);
    // About the axis: the bar at 0.4 m, the ball at 0.8 m.
    let inertia = 0.0922176 + 1.728 * 0.16 + 0.000125 + 0.5 * 0.64;
    for (key, truth, bound) in [
        ("upper", d, 1e-12),
        ("lower", 0.0, 1e-12),
        ("speed", 15.0 / 8.0 * d / t, 1e-12),
        ("jerk", 60.0 * d / (t * t * t), 1e-9),
    ] {
        assert!((value(key) - truth).abs() <= bound * truth.abs().max(1.0), "{key}: {} {truth}", value(key));
    }
    assert!((value("acceleration").abs() - acceleration).abs() < 1e-9, "{}", value("acceleration"));
    // Of 4000 instants, the one nearest to the peak: measured 5.5e-7 relative error.
    let error = (value("torque").abs() / (inertia * acceleration) - 1.0).abs();
    assert!(error < 1e-6, "{error:e}");
    assert_eq!((value("torque_limit"), value("speed_limit"), value("upper_limit")), (500.0, 4.0, 3.0));
    // An arc of 0.8 m radius; measured 4e-14.
    let length = found["tcp_length_m"].as_f64().unwrap();
    assert!((length - 0.8 * d).abs() < 1e-12, "{length}");
    assert!((found["tcp_speed_m_s"].as_f64().unwrap() - 0.8 * 15.0 / 8.0 * d / t).abs() < 1e-4);
    assert!(found["violations"].as_array().unwrap().is_empty());
}

#[test]
fn limits_that_are_passed_are_listed_with_their_times() {
    let place = Place::new();
    place.write("beam.urdf", common::URDF.replace("effort=\"500\" velocity=\"4\"", "effort=\"10\" velocity=\"3\""));
    let found = place.json(&["motion", "swing.toml", "robot.toml"]);
    let violations = found["violations"].as_array().unwrap();
    let kinds: Vec<&str> = violations.iter().map(|v| v["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["velocity", "effort"]);
    let at = violations[0]["time_s"].as_f64().unwrap();
    assert!((at - 0.25).abs() < 1e-6, "{at}");
    assert!(violations[1]["since_s"].as_f64().unwrap() < 0.1);
    let answer = place.flexarm(&["motion", "swing.toml", "robot.toml"]);
    assert!(
        answer.out.contains("2 limits are passed") && answer.out.contains("effort exceeds its limit 10.0000"),
        "{}",
        answer.out
    );
    assert!(answer.out.contains('▁') && answer.out.contains('█'), "{}", answer.out);
}

#[test]
fn without_a_robot_there_are_values_and_no_torques() {
    let place = Place::new();
    let found = place.json(&["motion", "swing.toml"]);
    assert!(found["tcp_length_m"].is_null() && found["robot"].is_null() && found["peaks"][0]["torque"].is_null());
    assert_eq!(found["peaks"][0]["unit"], "rad or m");
    let bag = fixture("states_lz4.mcap");
    let found = place.json(&["motion", bag.to_str().unwrap()]);
    assert_eq!(found["joints"], serde_json::json!(["joint_1", "joint_2", "gripper_finger_joint"]));
    assert_eq!((found["topic"].as_str(), found["samples"].as_u64()), (Some("/joint_states"), Some(26)));
    assert_eq!(found["format"], "MCAP bag, sensor_msgs/msg/JointState");
}

#[test]
fn a_planned_trajectory_with_a_gripper_runs_on_a_shipped_arm_and_gives_the_figures_of_the_csv() {
    let place = Place::new();
    place.write("plan.yaml", planned());
    planned_csv(&place);
    let run = |motion: &str| place.json(&["compare", "kr210", motion, "--no-files"]);
    let (message, csv) = (run("plan.yaml"), run("plan.csv"));
    for key in ["peak_m", "rms_m", "end_m", "static_sag_m"] {
        let of = |found: &serde_json::Value| found["tcp"][key].as_f64().unwrap();
        // The numbers are identical, letter by letter.
        let (message, csv) = (of(&message), of(&csv));
        assert!(csv > 0.0 && (message - csv).abs() < 1e-12, "{key}: {message} {csv}");
    }
    let warnings = message["warnings"].to_string();
    assert!(warnings.contains("gripper_finger_joint") && warnings.contains("left out"), "{warnings}");
    assert!(warnings.contains("joint_4") && warnings.contains("held"), "{warnings}");
}

#[test]
fn joints_that_no_robot_has_are_refused_with_those_that_may_be_meant() {
    let place = Place::new();
    place.write("plan.yaml", planned().replace("joint_1, joint_2, joint_3", "joitn_1, joitn_2, joitn_3"));
    place.refused(&["motion", "plan.yaml", "kr210"], &["joitn_1", "did you mean \"joint_1\"?"]);
}

/// Truth: one answer for one name, whatever the format.
#[test]
fn a_misspelt_joint_is_refused_and_a_gripper_is_left_out_in_every_format() {
    let place = Place::new();
    let formats = [
        (
            "moves.toml",
            "format = 1\nunit = \"rad\"\njoints = [\"joint_1\", \"NAME\"]\nstart = [0.0, 0.0]\n\
                        [[move]]\nto = [1.0, 0.0]\nduration = 1.0\n",
        ),
        (
            "samples.toml",
            "format = 1\nunit = \"rad\"\njoints = [\"joint_1\", \"NAME\"]\n[samples]\ntime = [0.0, 1.0]\n\
                          position = [[0.0, 0.0], [1.0, 0.0]]\nvelocity = [[0.0, 0.0], [0.0, 0.0]]\n",
        ),
        ("comma.csv", "time,joint_1,NAME\n0,0,0\n1,1,0\n"),
        ("semicolon.csv", "t[s];joint_1[rad];NAME[rad]\n0;0;0\n1;1;0\n"),
        ("tab.txt", "t[s]\tjoint_1[rad]\tNAME[rad]\n0\t0\t0\n1\t1\t0\n"),
        (
            "plan.json",
            "{\"joint_names\": [\"joint_1\", \"NAME\"], \"points\": [{\"positions\": [0, 0], \"time_from_start\": 0}, \
                       {\"positions\": [1, 0], \"time_from_start\": 1}]}",
        ),
        (
            "state.yaml",
            "header: {stamp: 1}\nname: [joint_1, NAME]\nposition: [0, 0]\n---\n\
                        header: {stamp: 2}\nname: [joint_1, NAME]\nposition: [1, 0]\n",
        ),
        (
            "run.csv",
            "time,flexible_x_m,joint_1_position_rad,NAME_position_rad,kinetic_energy_j\n0,0,0,0,0\n1,0,1,0,0\n",
        ),
    ];
    for (file, text) in formats {
        place.write(file, text.replace("NAME", "jiont_2"));
        place.refused(&["motion", file, "kr210"], &["jiont_2", "did you mean \"joint_2\"?"]);
        place.write(file, text.replace("NAME", "gripper"));
        let warnings = place.json(&["motion", file, "kr210"])["warnings"].to_string();
        assert_eq!(warnings.matches("gripper").count(), 1, "{file}: {warnings}");
        assert!(warnings.contains("left out"), "{file}: {warnings}");
    }
}

#[test]
fn what_is_written_is_read_again_as_the_same_motion() {
    let place = Place::new();
    let outputs = ["out/a.csv", "out/a.yaml", "out/a.json", "out/a.toml", "out/a.svg"];
    let mut arguments = vec!["motion", "swing.toml", "robot.toml", "--rate", "100"];
    outputs.iter().for_each(|path| arguments.extend(["-o", path]));
    let found = place.json(&arguments);
    assert_eq!(found["files"]["motions"].as_array().unwrap().len(), 4);
    assert!(place.text("out/a.svg").starts_with("<svg"));
    for path in &outputs[..4] {
        let again = place.json(&["motion", path, "robot.toml"]);
        for key in ["speed", "acceleration", "upper", "torque"] {
            let of = |found: &serde_json::Value| found["peaks"][0][key].as_f64().unwrap().abs();
            assert!(
                (of(&again) - of(&found)).abs() < 1e-8 * of(&found).max(1.0),
                "{path} {key}: {} {}",
                of(&again),
                of(&found)
            );
        }
    }
    // Existing files are never overwritten without --force.
    place.refused(&arguments, &["out/a.csv", "--force"]);
    arguments.push("--force");
    place.json(&arguments);
    place.refused(&["motion", "swing.toml", "-o", "a.xlsx"], &["-o writes by the ending of the name", ".yaml", "xlsx"]);
    place.refused(&["motion", "swing.toml", "-o", "b.csv", "--rate", "0"], &["sampling rate 0 Hz"]);
    // Samples cannot be written as waypoints: they are written as samples.
    place.write("sine.csv", "time,swing\n0,0\n0.5,0.3\n1,0.5\n1.5,0.3\n2,0\n");
    let first = place.json(&["motion", "sine.csv", "robot.toml", "-o", "sine.toml"]);
    let again = place.json(&["motion", "sine.toml", "robot.toml"]);
    for key in ["upper", "speed"] {
        let [a, b] = [&first, &again].map(|found| found["peaks"][0][key].as_f64().unwrap());
        assert!((a - b).abs() < 1e-9, "{key}: {a} {b}");
    }
}

#[test]
fn tables_take_a_map_of_columns_in_every_command_that_takes_a_motion() {
    let place = Place::new();
    place.write("trace.txt", "Zeit[ms];A1;Kraft\n0;0,0;1\n500;30,0;1\n1000;45,5;1\n1500;45,5;1\n");
    let map = ["--columns", "swing=A1[deg]"];
    let found = place.json(&[&["motion", "trace.txt", "robot.toml"], &map[..]].concat());
    assert_eq!((found["duration_s"].as_f64(), found["samples"].as_u64()), (Some(1.5), Some(4)));
    assert!((found["peaks"][0]["upper"].as_f64().unwrap() - 45.5f64.to_radians()).abs() < 1e-3);
    assert_eq!(found["format"], "table, semicolons, decimal commas");
    place.json(&[&["compare", "robot.toml", "trace.txt", "--no-files"], &map[..]].concat());
    let findings = place.json(&[&["check", "robot.toml", "trace.txt"], &map[..]].concat());
    assert!(!findings.to_string().contains("\"error\""), "{findings}");
    place.refused(
        &["motion", "trace.txt", "robot.toml"],
        &["none of the names", "\"A1\"", "is a joint of the robot", "\"swing\"", "--columns <joint>=<column>"],
    );
    place.refused(
        &["motion", "swing.toml", "robot.toml", "--columns", "t=a"],
        &["--columns names the columns of a table"],
    );
    place.refused(&["motion", "trace.txt", "--topic", "/joint_states"], &["a table, which has no topics"]);
}

#[test]
fn a_run_is_replayed_from_its_table() {
    let place = Place::new();
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "run", "--log-rate", "200"]);
    let found = place.json(&["motion", "run/run.csv", "robot.toml"]);
    assert_eq!(found["duration_s"].as_f64(), Some(1.0));
    // Sampled every 5 ms and interpolated by a spline; measured 2e-8.
    let speed = found["peaks"][0]["speed"].as_f64().unwrap();
    assert!((speed / (15.0 / 8.0 * SWING_DEG.to_radians() / SWING_S) - 1.0).abs() < 1e-6, "{speed}");
    place.json(&["compare", "robot.toml", "run/run.csv", "--no-files"]);
    assert!(found["warnings"].to_string().contains("flexible robot of a run"), "{}", found["warnings"]);
}

#[test]
fn files_are_recognised_by_content_and_what_is_none_is_refused_with_the_list() {
    let place = Place::new();
    std::fs::copy(fixture("states_zstd.mcap"), place.path("bag.csv")).unwrap();
    std::fs::copy(fixture("plan.json"), place.path("plan.txt")).unwrap();
    std::fs::copy(fixture("old.db3"), place.path("log")).unwrap();
    if cfg!(not(feature = "sqlite")) {
        place.refused(&["motion", "log"], &["feature sqlite"]);
    }
    let bags = [("bag.csv", "MCAP bag"), ("plan.txt", "JSON message"), ("log", "SQLite bag")];
    for (file, format) in bags.into_iter().take(if cfg!(feature = "sqlite") { 3 } else { 2 }) {
        let found = place.json(&["motion", file]);
        assert!(found["format"].as_str().unwrap().starts_with(format), "{found}");
    }
    place.write("letter.txt", "Dear Sir,\nthis is no motion.\n");
    place.refused(
        &["motion", "letter.txt"],
        &["this is not a readable motion", "Dear Sir", "bags as MCAP", "waypoints (TOML)", "tables"],
    );
    place.write("ros1.log", "#ROSBAG V2.0\nabc 1 2 3");
    place.refused(
        &["motion", "ros1.log"],
        &["ros1.log", "bag of ROS 1", "MCAP", "rosbags-convert", "--dst-storage mcap"],
    );
    place.write("nothing.yaml", "a: 1\n");
    place.refused(&["motion", "nothing.yaml"], &["there is no motion in the text", "joint_names"]);
    place.write("folder/x.txt", "1");
    place.refused(&["motion", "folder"], &["the folder is not a rosbag2 bag"]);
    let bag = fixture("both.mcap");
    let bag = bag.to_str().unwrap();
    place.refused(&["motion", bag, "--topic", "/x"], &["--topic", "/x", "is not in the file", "/joint_states"]);
    let found = place.json(&["motion", bag, "--topic", "/arm_controller/controller_state"]);
    assert_eq!(found["joints"], serde_json::json!(["joint_1", "joint_2"]));
}
