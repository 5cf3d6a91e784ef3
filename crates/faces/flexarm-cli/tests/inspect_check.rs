//! `inspect`: keys, and consistency of the numbers. `check`: all findings of a file, not only the
//! first.

use crate::common::{self, Place, ROBOT, URDF, line_of, matrix, numbers, shipped_robot, shipped_trajectory, with};
use serde_json::Value;

mod inspect {
    use super::*;

    const POSE: [f64; 6] = [0.3, -0.7, 0.9, 0.4, -1.1, 0.2];

    fn joined(values: &[f64]) -> String {
        values.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
    }

    fn at(place: &Place, robot: &str, q: &[f64], more: &[&str]) -> Value {
        place.json(&[&["inspect", robot, "--at", &joined(q)], more].concat())
    }

    /// Largest entry of the difference.
    fn distance(a: &[f64], b: &[f64]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Observing another frame must not move the load: it used to be attached to the frame of
    /// `--tcp`.
    #[test]
    fn another_tcp_leaves_the_payload_where_it_is() {
        let place = Place::new();
        let payload = "\npayload = { mass = 2.0, com = [0.1, 0.0, 0.0] }\ngravity";
        place.write("robot.toml", with(&with(ROBOT, "\ngravity", payload), "-9.81]", "-9.81]"));
        let masses = |more: &[&str]| {
            let seen = place.json(&[&["inspect", "robot.toml"], more].concat());
            matrix(&seen["mass_matrix"])[0][0]
        };
        assert_eq!(masses(&[]), masses(&["--tcp", "bar"]));
        assert_eq!(masses(&[]), masses(&["--tcp", "base"]));
    }

    /// The two parts of a flexible link have the mass of the link, without bodies attached to it.
    #[test]
    fn parts_of_flexible_links_are_the_links_own() {
        let place = Place::new();
        for robot in ["test/one_beam", "test/three_beams", "kr210", "test/reference_arm"] {
            let seen = place.json(&["inspect", &shipped_robot(robot)]);
            let links = seen["links"].as_array().unwrap();
            for flexible in seen["flexible_links"].as_array().unwrap() {
                let link = links.iter().find(|l| l["name"] == flexible["name"]).unwrap();
                let whole = link["mass_kg"].as_f64().unwrap();
                let parts: f64 = numbers(&flexible["parts_kg"]).iter().sum();
                assert!((parts / whole - 1.0).abs() < 1e-9, "{robot}: {parts} {whole}");
            }
        }
    }

    #[test]
    fn keys_and_shapes() {
        let place = Place::new();
        for (robot, n) in [("test/reference_arm", 6), ("kr210", 6), ("test/three_beams", 1)] {
            let seen = place.json(&["inspect", &shipped_robot(robot)]);
            let joints = seen["joints"].as_array().unwrap();
            assert_eq!(joints.len(), n);
            for joint in joints {
                assert!(joint["name"].is_string());
                assert!(["revolute", "continuous", "prismatic"].contains(&joint["type"].as_str().unwrap()));
                assert!(joint["lower"].as_f64().unwrap() < joint["upper"].as_f64().unwrap());
            }
            assert!(seen["links"].as_array().unwrap().len() > n);
            assert!(seen["tcp"]["link"].is_string());
            assert_eq!(numbers(&seen["tcp"]["position_m"]).len(), 3);
            let quaternion = numbers(&seen["tcp"]["quaternion_wxyz"]);
            assert_eq!(quaternion.len(), 4);
            assert!((quaternion.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            for (key, rows) in [("jacobian", 6), ("mass_matrix", n)] {
                let m = matrix(&seen[key]);
                assert!(m.len() == rows && m.iter().all(|r| r.len() == n), "{robot} {key}");
            }
            for key in ["gravity_torque", "bias", "coriolis", "q", "velocity"] {
                assert_eq!(numbers(&seen[key]).len(), n, "{robot} {key}");
            }
        }
    }

    #[test]
    fn joints_and_links_as_written() {
        let seen = Place::new().json(&["inspect", "robot.toml"]);
        let joint = &seen["joints"][0];
        assert_eq!((joint["name"].as_str(), joint["type"].as_str()), (Some("swing"), Some("revolute")));
        let limits = ["lower", "upper", "velocity", "effort"].map(|key| joint[key].as_f64().unwrap());
        assert_eq!(limits, [-3.0, 3.0, 4.0, 500.0]);
        let bar = seen["links"].as_array().unwrap().iter().find(|l| l["name"] == "bar").unwrap();
        assert_eq!(bar["mass_kg"].as_f64(), Some(1.728));
        assert_eq!(numbers(&bar["com_m"]), [0.4, 0.0, 0.0]);
        assert!(distance(&numbers(&bar["inertia"]), &[0.000288, 0.0923904, 0.0922176, 0.0, 0.0, 0.0]) < 1e-15);
        assert!((seen["mass_kg"].as_f64().unwrap() - 2.228).abs() < 1e-12);
        let flexible = &seen["flexible_links"][0];
        assert_eq!(flexible["name"], "bar");
        assert!((numbers(&flexible["parts_kg"]).iter().sum::<f64>() - 1.728).abs() < 1e-9, "the bar alone: {flexible}");
        assert_eq!(seen["tcp"]["link"], "ball");
    }

    #[test]
    fn joint_without_limits_has_null() {
        let place = Place::new();
        let text = with(URDF, "\"revolute\"", "\"continuous\"");
        place.write("beam.urdf", with(&text, "lower=\"-3.0\" upper=\"3.0\" ", ""));
        let seen = place.json(&["inspect", "beam.urdf"]);
        let joint = &seen["joints"][0];
        assert_eq!(joint["type"], "continuous");
        assert!(joint["lower"].is_null() && joint["upper"].is_null(), "{joint}");
        assert_eq!(joint["velocity"].as_f64(), Some(4.0));
    }

    #[test]
    fn beam_by_hand() {
        // A bar and a ball about a vertical axis: all results are known.
        let place = Place::new();
        let seen = at(&place, "robot.toml", &[0.5], &["--velocity", "2"]);
        let position = numbers(&seen["tcp"]["position_m"]);
        assert!(distance(&position, &[0.8 * 0.5f64.cos(), 0.8 * 0.5f64.sin(), 0.0]) < 1e-12);
        let jacobian: Vec<f64> = matrix(&seen["jacobian"]).concat();
        assert!(distance(&jacobian, &[-position[1], position[0], 0.0, 0.0, 0.0, 1.0]) < 1e-12);
        let inertia = 0.0922176 + 1.728 * 0.16 + 0.5 * 0.64 + 0.000125;
        assert!((matrix(&seen["mass_matrix"])[0][0] - inertia).abs() < 1e-12);
        for key in ["gravity_torque", "bias", "coriolis"] {
            assert!(numbers(&seen[key])[0].abs() < 1e-12, "no force about a vertical axis: {key}");
        }
    }

    #[test]
    fn gravity_about_a_horizontal_axis() {
        let place = Place::new();
        place.write("beam.urdf", with(URDF, "\"0 0 1\"", "\"0 1 0\""));
        for angle in [0.0, 0.7f64] {
            let seen = at(&place, "robot.toml", &[angle], &[]);
            // A rotation about +y lowers the tip; the drive holds against it.
            let expected = -9.81 * (1.728 * 0.4 + 0.5 * 0.8) * angle.cos();
            assert!((numbers(&seen["gravity_torque"])[0] - expected).abs() < 1e-10, "{seen}");
        }
        // Without gravity if the robot file sets it to zero.
        place.write("robot.toml", with(ROBOT, "-9.81]", "0.0]"));
        assert_eq!(numbers(&place.json(&["inspect", "robot.toml"])["gravity_torque"])[0].abs(), 0.0);
    }

    #[test]
    fn vertical_axis_carries_no_weight() {
        let place = Place::new();
        for robot in ["test/reference_arm", "kr210"] {
            let torque = numbers(&at(&place, &shipped_robot(robot), &POSE, &[])["gravity_torque"]);
            let largest = torque.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            assert!(largest > 10.0 && torque[0].abs() < 1e-12 * largest, "{robot}: {torque:?}");
        }
    }

    #[test]
    fn mass_matrix_is_symmetric_positive_definite() {
        let place = Place::new();
        for robot in ["test/reference_arm", "kr210"] {
            let m = matrix(&at(&place, &shipped_robot(robot), &POSE, &[])["mass_matrix"]);
            let n = m.len();
            for i in 0..n {
                for j in 0..n {
                    assert!((m[i][j] - m[j][i]).abs() <= 1e-12 * (m[i][i] * m[j][j]).sqrt(), "{robot} ({i}, {j})");
                }
            }
            // Cholesky: every pivot is positive.
            let mut l = vec![vec![0.0; n]; n];
            for i in 0..n {
                for j in 0..=i {
                    let rest = m[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
                    if i == j {
                        assert!(rest > 0.0, "{robot}: pivot {i} is {rest}");
                        l[i][i] = rest.sqrt();
                    } else {
                        l[i][j] = rest / l[j][j];
                    }
                }
            }
        }
    }

    /// Angular velocity in world axes that rotates quaternion `a` into `b` in unit time, for small
    /// rotations (w first).
    fn turn(a: &[f64], b: &[f64]) -> [f64; 3] {
        let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
        let b: Vec<f64> = b.iter().map(|x| x * dot.signum()).collect();
        // Vector part of 2 b a*.
        [
            2.0 * (-b[0] * a[1] + b[1] * a[0] - b[2] * a[3] + b[3] * a[2]),
            2.0 * (-b[0] * a[2] + b[2] * a[0] - b[3] * a[1] + b[1] * a[3]),
            2.0 * (-b[0] * a[3] + b[3] * a[0] - b[1] * a[2] + b[2] * a[1]),
        ]
    }

    #[test]
    fn jacobian_by_finite_differences() {
        let place = Place::new();
        for (robot, frame) in [("test/reference_arm", None), ("kr210", None), ("kr210", Some("link_4"))] {
            let path = shipped_robot(robot);
            let tcp: Vec<&str> = frame.iter().flat_map(|f| ["--tcp", f]).collect();
            let jacobian = matrix(&at(&place, &path, &POSE, &tcp)["jacobian"]);
            let h = 1e-5;
            for k in 0..POSE.len() {
                let pose = |shift: f64| {
                    let mut q = POSE;
                    q[k] += shift;
                    let tcp = at(&place, &path, &q, &tcp)["tcp"].clone();
                    (numbers(&tcp["position_m"]), numbers(&tcp["quaternion_wxyz"]))
                };
                let ((p0, a0), (p1, a1)) = (pose(-h), pose(h));
                let linear = (0..3).map(|i| (p1[i] - p0[i]) / (2.0 * h));
                let angular = turn(&a0, &a1).map(|w| w / (2.0 * h));
                let column: Vec<f64> = linear.chain(angular).collect();
                let expected: Vec<f64> = jacobian.iter().map(|row| row[k]).collect();
                assert!(distance(&column, &expected) < 1e-8, "{robot} {frame:?} joint {k}: {column:?} {expected:?}");
            }
        }
    }

    #[test]
    fn bias_is_gravity_and_coriolis() {
        let place = Place::new();
        let robot = shipped_robot("test/reference_arm");
        let still = at(&place, &robot, &POSE, &[]);
        assert_eq!(still["bias"], still["gravity_torque"], "nothing else acts at rest");
        let v = [0.5, -0.4, 0.3, 1.0, -0.8, 0.6];
        let moving = at(&place, &robot, &POSE, &["--velocity", &joined(&v)]);
        assert!(distance(&numbers(&moving["gravity_torque"]), &numbers(&still["gravity_torque"])) < 1e-12);
        let [bias, gravity, coriolis] = ["bias", "gravity_torque", "coriolis"].map(|key| numbers(&moving[key]));
        let sum: Vec<f64> = gravity.iter().zip(&coriolis).map(|(g, c)| g + c).collect();
        assert!(distance(&bias, &sum) < 1e-9);
        // Quadratic in the velocity.
        let twice = at(&place, &robot, &POSE, &["--velocity", &joined(&v.map(|x| 2.0 * x))]);
        let four: Vec<f64> = coriolis.iter().map(|c| 4.0 * c).collect();
        assert!(distance(&numbers(&twice["coriolis"]), &four) < 1e-9);
        // Coriolis forces do half the work of the change of the mass matrix: v'(dM/dt)v = 2 v'c,
        // with dM/dt along v by differences.
        let h = 1e-5;
        let energy = |sign: f64| {
            let q: Vec<f64> = POSE.iter().zip(&v).map(|(q, v)| q + sign * h * v).collect();
            let m = matrix(&at(&place, &robot, &q, &[])["mass_matrix"]);
            (0..6).map(|i| (0..6).map(|j| v[i] * m[i][j] * v[j]).sum::<f64>()).sum::<f64>()
        };
        let power = (energy(1.0) - energy(-1.0)) / (2.0 * h);
        let work: f64 = 2.0 * v.iter().zip(&coriolis).map(|(v, c)| v * c).sum::<f64>();
        assert!((power - work).abs() < 1e-5 * power.abs().max(1.0), "{power} {work}");
    }

    #[test]
    fn names_or_order() {
        let place = Place::new();
        let robot = shipped_robot("test/reference_arm");
        let by_order = at(&place, &robot, &POSE, &["--velocity", "0,0,0.5,0,0,0"]);
        let pairs: Vec<String> = (1..=6).rev().map(|k| format!("joint_{k} = {}", POSE[k - 1])).collect();
        let by_name = place.json(&["inspect", &robot, "--at", &pairs.join(", "), "--velocity", "joint_3=0.5"]);
        assert_eq!(by_order, by_name);
        assert_eq!(numbers(&by_order["q"]), POSE);
        // Joints without a value stay at zero.
        let some = place.json(&["inspect", &robot, "--at", "joint_5=-1.1"]);
        assert_eq!(numbers(&some["q"]), [0.0, 0.0, 0.0, 0.0, -1.1, 0.0]);
        let none = place.json(&["inspect", &robot]);
        assert_eq!(numbers(&none["q"]), [0.0; 6]);
    }

    #[test]
    fn other_tcp() {
        let place = Place::new();
        let seen = place.json(&["inspect", "robot.toml", "--tcp", "bar"]);
        assert_eq!(seen["tcp"]["link"], "bar");
        assert_eq!(numbers(&seen["tcp"]["position_m"]), [0.0; 3]);
        // The offset in the robot file applies to its own TCP.
        place.write("robot.toml", with(ROBOT, "{ link = \"ball\" }", "{ link = \"ball\", xyz = [0.0, 0.0, 0.1] }"));
        let own = numbers(&place.json(&["inspect", "robot.toml"])["tcp"]["position_m"]);
        assert!(distance(&own, &[0.8, 0.0, 0.1]) < 1e-12, "{own:?}");
        let ball = numbers(&place.json(&["inspect", "robot.toml", "--tcp", "ball"])["tcp"]["position_m"]);
        assert!(distance(&ball, &[0.8, 0.0, 0.0]) < 1e-12, "{ball:?}");
    }

    #[test]
    fn payload_counts() {
        let place = Place::new();
        let light = place.json(&["inspect", "robot.toml"]);
        let payload =
            "\npayload = { mass = 2.0, com = [0.1, 0.0, 0.0], inertia = [0.01, 0.02, 0.03, 0.0, 0.0, 0.0] }\ngravity";
        place.write("robot.toml", with(ROBOT, "\ngravity", payload));
        let heavy = place.json(&["inspect", "robot.toml"]);
        let more = |key: &str| heavy[key].as_f64().unwrap() - light[key].as_f64().unwrap();
        assert!((more("mass_kg") - 2.0).abs() < 1e-12);
        let more = matrix(&heavy["mass_matrix"])[0][0] - matrix(&light["mass_matrix"])[0][0];
        assert!((more - (0.03 + 2.0 * 0.81)).abs() < 1e-12, "{more}");
    }

    #[test]
    fn models_of_flexible_links() {
        let place = Place::new();
        let lumped = &place.json(&["inspect", "robot.toml"])["flexible_links"][0];
        assert_eq!((&lumped["model"], &lumped["coordinates"]), (&"lumped".into(), &6.into()));
        assert!(lumped.get("modal_frequencies_hz").is_none(), "{lumped}");
        place.write("robot.toml", with(ROBOT, "damping", "segments = 4\ndamping"));
        assert_eq!(place.json(&["inspect", "robot.toml"])["flexible_links"][0]["coordinates"], 18);
        place.write("robot.toml", with(ROBOT, "damping", "model = \"modal\"\nmodes = 3\ndamping"));
        let modal = &place.json(&["inspect", "robot.toml"])["flexible_links"][0];
        assert_eq!((&modal["model"], &modal["coordinates"]), (&"modal".into(), &9.into()));
        let hz = numbers(&modal["modal_frequencies_hz"]);
        // Clamped beam: 1.8751² sqrt(EI/(mu l⁴))/2π; shear and rotary inertia are negligible for a
        // slender beam.
        let truth = 3.516 / 0.64 * (70e9 * 0.02f64.powi(2) / 12.0 / 2700.0).sqrt() / std::f64::consts::TAU;
        assert!(hz.len() == 9 && (hz[0] / truth - 1.0).abs() < 3e-3, "{hz:?} {truth}");
        let answer = place.flexarm(&["inspect", "robot.toml"]);
        for word in ["modal, 9 coordinates", "near joint held: 25."] {
            assert!(answer.out.contains(word), "{word}: {}", answer.out);
        }
    }

    #[test]
    fn table_for_people() {
        let answer = Place::new().flexarm(&["inspect", "robot.toml", "--at", "-0.5"]);
        assert_eq!((answer.code, answer.err.as_str()), (0, ""));
        for word in ["swing", "revolute", "-0.5000", "bar", "TCP on ball", "flexible: bar"] {
            assert!(answer.out.contains(word), "{word}: {}", answer.out);
        }
    }
}

mod check {
    use super::*;

    fn findings(place: &Place, arguments: &[&str], code: i32) -> Vec<Value> {
        let answer = place.flexarm(&[&["check"], arguments, &["--json"]].concat());
        assert_eq!(answer.code, code, "{} {}", answer.out, answer.err);
        assert_eq!(answer.err, "");
        let findings = answer.json()["findings"].as_array().unwrap().clone();
        for finding in &findings {
            for key in ["severity", "code", "where", "message", "help"] {
                assert!(finding[key].is_string(), "{key}: {finding}");
            }
            assert!(["error", "warning", "note"].contains(&finding["severity"].as_str().unwrap()));
        }
        findings
    }

    fn codes(findings: &[Value], severity: &str) -> Vec<String> {
        let wanted = findings.iter().filter(|f| f["severity"] == severity);
        wanted.map(|f| f["code"].as_str().unwrap().to_owned()).collect()
    }

    #[test]
    fn sound_files_are_clean() {
        let place = Place::new();
        let own = findings(&place, &["robot.toml", "swing.toml"], 0);
        assert_eq!((codes(&own, "error").len(), codes(&own, "warning").len()), (0, 0), "{own:?}");
        for (robot, motions) in [
            ("test/one_beam", &["beam_swing.toml", "beam_hold.toml"][..]),
            ("test/three_beams", &["beam_swing.toml"]),
            ("test/reference_arm", &["reference_arm.toml"]),
            ("test/reference_arm_coupled", &["reference_arm.toml"]),
            ("kr210", &["pick_and_place.toml", "point_to_point.toml", "iso9283_path.csv", "stress.toml"]),
        ] {
            for motion in motions {
                let found = findings(&place, &[&shipped_robot(robot), &shipped_trajectory(motion)], 0);
                assert_eq!(codes(&found, "error"), [""; 0], "{robot} {motion}: {found:?}");
                assert_eq!(codes(&found, "warning"), [""; 0], "{robot} {motion}: {found:?}");
            }
        }
    }

    #[test]
    fn all_faults_of_a_urdf() {
        let mut text = URDF.to_owned();
        for (old, new) in [
            ("\"0 0 1\"", "\"0 0 0\""),
            ("lower=\"-3.0\"", "lower=\"9.0\""),
            ("\"1.728\"", "\"-1.728\""),
            ("<child link=\"ball\"/>", "<child link=\"bell\"/>"),
            ("\"0.5\"", "\"nan\""),
        ] {
            text = with(&text, old, new);
        }
        let place = Place::new();
        place.write("beam.urdf", &text);
        let found = findings(&place, &["beam.urdf"], 2);
        for (code, piece) in [
            ("zero-axis", "<axis"),
            ("limits-reversed", "<limit"),
            ("negative-mass", "<inertial>"),
            ("unknown-link", "\"weld\""),
            ("not-a-number", "\"nan\""),
        ] {
            let finding = found.iter().find(|f| f["code"] == code).unwrap_or_else(|| panic!("no {code} in {found:?}"));
            assert_eq!(finding["severity"], "error");
            let place = format!("beam.urdf:{}:", line_of(&text, piece));
            assert!(finding["where"].as_str().unwrap().starts_with(&place), "{code}: {finding}");
            assert!(!finding["help"].as_str().unwrap().is_empty(), "{code} has no help");
        }
        assert_eq!(found.len(), 5, "{found:?}");
        // The same through the robot file, and as text.
        assert_eq!(findings(&place, &["robot.toml"], 2).len(), 5);
        let answer = place.flexarm(&["check", "beam.urdf"]);
        assert_eq!(answer.code, 2);
        for word in ["error[zero-axis] beam.urdf:7:", "help: ", "5 errors, 0 warnings"] {
            assert!(answer.out.contains(word), "{word}: {}", answer.out);
        }
    }

    #[test]
    fn warnings_do_not_fail() {
        let place = Place::new();
        let mesh =
            "<visual><geometry><mesh filename=\"package://parts/ball.stl\"/></geometry></visual></link>\n</robot>";
        place.write("beam.urdf", with(URDF, "</link>\n</robot>", mesh));
        let found = findings(&place, &["robot.toml"], 0);
        assert_eq!(codes(&found, "warning"), ["missing-mesh"], "{found:?}");
        let finding = found.iter().find(|f| f["code"] == "missing-mesh").unwrap();
        assert!(finding["message"].as_str().unwrap().contains("\"parts\""));
        assert!(finding["help"].as_str().unwrap().contains("--package parts=FOLDER"));
    }

    #[test]
    fn all_limits_of_a_motion() {
        let place = Place::new();
        place.write("wild.csv", "time,swing\n0,0\n1,3.5\n2,-3.5\n3,0\n");
        let found = findings(&place, &["robot.toml", "wild.csv"], 2);
        assert_eq!(codes(&found, "error"), ["joint-limit"; 3], "{found:?}");
        let text = serde_json::to_string(&found).unwrap();
        for word in ["upper limit", "lower limit", "velocity", "wild.csv"] {
            assert!(text.contains(word), "{word}: {text}");
        }
        // It starts at speed, which is not an error.
        assert!(codes(&found, "warning").contains(&"motion-start-speed".to_owned()), "{found:?}");
    }

    #[test]
    fn files_that_cannot_be_read() {
        let place = Place::new();
        assert_eq!(codes(&findings(&place, &["none.toml"], 2), "error"), ["missing-file"]);
        assert_eq!(codes(&findings(&place, &["robot.toml", "none.csv"], 2), "error"), ["trajectory"]);
        place.write("m.csv", "time,swung\n0,0\n1,1\n");
        assert_eq!(codes(&findings(&place, &["robot.toml", "m.csv"], 2), "error"), ["trajectory"]);
        place.write("robot.toml", with(ROBOT, "gravity", "gravitty"));
        let found = findings(&place, &["robot.toml"], 2);
        assert_eq!(codes(&found, "error"), ["robot-file"]);
        assert!(found[0]["message"].as_str().unwrap().contains("gravitty"));
    }

    #[test]
    fn doubts_about_modal_links() {
        let place = Place::new();
        // Matrices contain no second-order terms, and no load-dependent stiffness.
        let [k, m] = super::condensed_beam();
        place.write("arm_K.csv", k);
        place.write("arm_M.csv", m);
        let at = ["--map", "A=#1-6,B=#7-12", "--at", "A=0,0,0", "--at", "B=0.8,0,0", "--flex", "bar.flex"];
        let import = ["import", "arm_K.csv", "arm_M.csv", "--units", "m-kg-s", "--name", "bar"];
        let said = place.json(&[&import[..], &at].concat());
        assert_eq!((&said["modal"]["coordinates"], &said["modal"]["second_order"]), (&6.into(), &false.into()));
        let robot = common::flex::robot();
        place.write("robot.toml", with(&robot, "damping", "model = \"modal\"\ndamping"));
        let found = findings(&place, &["robot.toml"], 0);
        assert_eq!(codes(&found, "warning"), ["second-order-unknown"], "{found:?}");
        let run = place.json(&["run", "robot.toml", "swing.toml", "--no-files"]);
        assert!(run["warnings"][0].as_str().unwrap().contains("second-order terms"), "{run}");
        assert!(place.json(&["inspect", "robot.toml"])["warnings"][0].is_string());

        place.write("robot.toml", with(&robot, "damping", "geometric_stiffening = true\ndamping"));
        let found = findings(&place, &["robot.toml"], 0);
        assert_eq!(codes(&found, "warning"), ["geometric-stiffening"], "{found:?}");
        assert!(found.iter().any(|f| f["help"].as_str().unwrap().contains("reduce --geometric")));
        let both = "model = \"modal\"\ngeometric_stiffening = true\ndamping";
        place.write("robot.toml", with(&robot, "damping", both));
        let found = findings(&place, &["robot.toml"], 2);
        assert!(found[0]["message"].as_str().unwrap().contains("reduce --geometric"), "{found:?}");
        assert!(found[0]["where"].as_str().unwrap().starts_with("robot.toml:11:"), "{found:?}");

        // A beam can have it, but only as a modal link.
        place.write("robot.toml", with(ROBOT, "damping", "geometric_stiffening = true\ndamping"));
        let found = findings(&place, &["robot.toml"], 0);
        assert_eq!(codes(&found, "warning"), ["geometric-stiffening"], "{found:?}");
        place.write("robot.toml", with(ROBOT, "damping", both));
        assert_eq!(codes(&findings(&place, &["robot.toml"], 0), "warning"), [""; 0]);
    }

    #[test]
    fn rigid_robot_is_noted() {
        let found = findings(&Place::new(), &["beam.urdf"], 0);
        assert_eq!(codes(&found, "note"), ["no-flexible-link"]);
    }

    #[test]
    fn all_faults_of_a_robot_file() {
        let place = Place::new();
        let mut text = with(ROBOT, "\"ball\"", "\"bell\"");
        text = with(&text, "modal = 0.03", "modal = 3.0");
        text = with(&text, "\"aluminium\"", "\"unobtainium\"");
        place.write("robot.toml", text + "\n[[drive]]\njoint = \"elbow\"\nkind = \"magic\"\n");
        let text = serde_json::to_string(&findings(&place, &["robot.toml"], 2)).unwrap();
        for word in ["bell", "below 1", "unobtainium", "elbow", "magic"] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }

    /// A run, statics and `check` report the same mistake in the same way, with value and reference
    /// value.
    #[test]
    fn a_slip_is_told_by_check_runs_and_statics_alike() {
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "{ link = \"ball\" }", "{ link = \"ball\", xyz = [0.0, 0.0, 350.0] }"));
        let far = |all: &Value| all.as_array().unwrap().iter().find(|c| c["code"] == "far").cloned().unwrap();
        let run = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
        let still = place.json(&["statics", "robot.toml"]);
        let found = Value::Array(findings(&place, &["robot.toml"], 0));
        for caveat in [far(&run["caveats"]), far(&still["caveats"]), far(&found)] {
            assert_eq!(caveat["value"].as_f64(), Some(350.0), "{caveat}");
            assert_eq!((&caveat["unit"], &caveat["severity"]), (&"m".into(), &"warning".into()));
            assert_eq!(caveat["likely"], "about 1000 times: millimetres?");
            assert!(caveat["message"].as_str().unwrap().contains("millimetres?"), "{caveat}");
        }
        assert!(run["warnings"].to_string().contains("350 m away"), "{run}");
    }

    #[test]
    fn loads_are_checked_with_the_motion() {
        let place = Place::new();
        let loads = |text: &str| {
            place.write("loads.toml", format!("format = 1\n{text}"));
            place.flexarm(&["check", "robot.toml", "swing.toml", "--loads", "loads.toml", "--json"])
        };
        let step = "[[load]]\nkind = \"step\"\nforce = [0.0, 0.0, -1e6]\n";
        let heavy = loads(step);
        assert!(heavy.code == 0 && heavy.out.contains("\"code\":\"load\""), "{}", heavy.out);
        let late = loads("[[load]]\nkind = \"step\"\nstart = 7.0\nforce = [0.0, 0.0, -1.0]\n");
        assert!(late.out.contains("\"code\":\"no-effect\""), "{}", late.out);
        let carried = loads("[[payload]]\nat = 0.1\nmass = 15000.0\n");
        assert!(carried.out.contains("\"code\":\"payload-mass\""), "{}", carried.out);
        let nowhere = loads("[[load]]\nframe = \"elbow\"\nkind = \"step\"\nforce = [0.0, 0.0, -1.0]\n");
        assert!(nowhere.code == 2 && nowhere.out.contains("elbow"), "{}", nowhere.out);
        // A run reports the same.
        loads("[[load]]\nkind = \"step\"\nstart = 0.3\nforce = [0.0, 0.0, -1e3]\n");
        let run = place.json(&["compare", "robot.toml", "swing.toml", "--loads", "loads.toml", "--no-files"]);
        let told = run["caveats"].as_array().unwrap().iter().find(|c| c["code"] == "load").unwrap();
        assert_eq!(told["value"].as_f64(), Some(1e3), "{told}");
    }

    #[test]
    fn a_payload_of_0_kg_is_noted_and_counts_as_none() {
        let place = Place::new();
        let none = place.json(&["statics", "robot.toml"]);
        place.write(
            "robot.toml",
            with(ROBOT, "\ngravity", "\npayload = { mass = 0.0, com = [0.1, 0.0, 0.0] }\ngravity"),
        );
        let found = findings(&place, &["robot.toml"], 0);
        assert!(codes(&found, "note").contains(&"no-payload".to_owned()), "{found:?}");
        assert_eq!(place.json(&["statics", "robot.toml"])["sag_m"], none["sag_m"]);
    }

    /// At zero the shipped arm is outside its limits.
    #[test]
    fn the_robot_is_held_where_the_motion_begins() {
        let place = Place::new();
        let at = |arguments: &[&str]| {
            let found = findings(&place, arguments, 0);
            let note = found.iter().find(|f| f["code"] == "modes").unwrap_or_else(|| panic!("{found:?}"));
            note["message"].as_str().unwrap().to_owned()
        };
        let (robot, motion) = (shipped_robot("kr210"), shipped_trajectory("large_moves.toml"));
        assert!(at(&[&robot, &motion]).contains("at the start of large_moves"));
        assert!(at(&[&robot]).contains("at the start of pick_and_place"));
        assert!(at(&["robot.toml"]).contains("in the middle of the joint ranges"));
        // The frequencies are those of a run from the start of the motion.
        let run = place.json(&["compare", &robot, &motion, "--no-files", "--step", "2e-3"]);
        let first = format!("{:.2}", numbers(&run["frequencies_hz"])[0]);
        assert!(at(&[&robot, &motion]).contains(&first), "{first}");
    }

    /// Limits that the robot would have are not reported as missing if the robot has errors.
    #[test]
    fn a_broken_robot_makes_no_fault_of_the_motion() {
        let place = Place::new();
        place.write("beam.urdf", with(URDF, "\"1.728\"", "\"-1.728\""));
        let motion = "format = 1\nunit = \"deg\"\njoints = [\"swing\"]\nstart = [0.0]\n\n[[move]]\nto = [60.0]\n";
        place.write("fast.toml", motion);
        let found = findings(&place, &["robot.toml", "fast.toml"], 2);
        assert_eq!(codes(&found, "error"), ["negative-mass"], "{found:?}");
    }

    #[test]
    fn degrees_in_a_file_of_radians_are_named() {
        let place = Place::new();
        // A file that calls its degrees radians, and one without a unit and with less than two turns.
        place.write("rad.csv", "# unit: rad\ntime,swing\n0,0\n1,60\n2,0\n");
        place.write("few.csv", "time,swing\n0,0\n1,10\n2,0\n");
        for file in ["rad.csv", "few.csv"] {
            let found = findings(&place, &["robot.toml", file], 2);
            let passed = found.iter().find(|f| f["code"] == "joint-limit").unwrap_or_else(|| panic!("{found:?}"));
            assert_eq!(passed["likely"], "about 57 times: degrees?", "{found:?}");
            place.refused(&["compare", "robot.toml", file, "-o", "result"], &["upper limit", "degrees?"]);
        }
        // More than two turns without a unit are not taken as radians at all.
        place.write("deg.csv", "time,swing\n0,0\n1,60\n2,0\n");
        let found = findings(&place, &["robot.toml", "deg.csv"], 2);
        assert_eq!(codes(&found, "error"), ["trajectory"], "{found:?}");
        assert!(found.iter().any(|f| f["message"].as_str().unwrap().contains("`swing[deg]`")), "{found:?}");
        place.refused(&["compare", "robot.toml", "deg.csv", "-o", "result"], &["deg.csv:1:", "`# unit: deg`"]);
    }

    #[test]
    fn motion_beside_a_faulty_robot() {
        let place = Place::new();
        place.write("beam.urdf", with(URDF, "\"1.728\"", "\"-1.728\""));
        let found = findings(&place, &["robot.toml", "none.csv"], 2);
        assert_eq!(codes(&found, "error").len(), 2, "{found:?}");
    }

    #[test]
    fn default_trajectory_that_is_missing() {
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "\ngravity", "\ndefault_trajectory = \"none.toml\"\ngravity"));
        let text = serde_json::to_string(&findings(&place, &["robot.toml"], 2)).unwrap();
        assert!(text.contains("none.toml"), "{text}");
    }

    #[test]
    fn place_in_a_robot_file() {
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "gravity", "gravitty"));
        let found = findings(&place, &["robot.toml"], 2);
        assert_eq!(found[0]["where"], "robot.toml:5:1", "{found:?}");
        assert!(!found[0]["message"].as_str().unwrap().contains("robot.toml"), "{found:?}");
    }
}

/// Stiffness and mass of the beam as CSV, six rows per end; the mass is the consistent one of
/// Euler-Bernoulli theory.
fn condensed_beam() -> [String; 2] {
    let (l, mass, w, h) = (0.8, 1.728, 0.02f64, 0.04f64);
    let mut m = vec![vec![0.0; 12]; 12];
    let mut put = |i: usize, j: usize, value: f64| {
        m[i][j] = value;
        m[j][i] = value;
    };
    let polar = mass * (w * w + h * h) / 12.0;
    for (at, size) in [(0, mass), (3, polar)] {
        put(at, at, size / 3.0);
        put(at + 6, at + 6, size / 3.0);
        put(at, at + 6, size / 6.0);
    }
    for (y, r, sign) in [(1, 5, 1.0), (2, 4, -1.0)] {
        let unit = mass / 420.0;
        put(y, y, 156.0 * unit);
        put(y + 6, y + 6, 156.0 * unit);
        put(y, y + 6, 54.0 * unit);
        put(r, r, 4.0 * l * l * unit);
        put(r + 6, r + 6, 4.0 * l * l * unit);
        put(r, r + 6, -3.0 * l * l * unit);
        put(y, r, sign * 22.0 * l * unit);
        put(y, r + 6, -sign * 13.0 * l * unit);
        put(y + 6, r, sign * 13.0 * l * unit);
        put(y + 6, r + 6, -sign * 22.0 * l * unit);
    }
    let text = |a: &[Vec<f64>]| -> String {
        a.iter().map(|row| row.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(",") + "\n").collect()
    };
    [text(&common::flex::stiffness_12()), text(&m)]
}
