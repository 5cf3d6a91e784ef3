//! `statics`, `modes`, `response`, `map`: keys, consistency of the numbers, files, and bad input.

use crate::common::{Place, ROBOT, Table, matrix, mcap_records, numbers, shipped_robot, with};

/// The bar of the test robot: EI in the horizontal and in the vertical plane (aluminium, 20 x 40
/// mm, lying flat), 0.8 m.
const LENGTH: f64 = 0.8;

mod statics {
    use super::*;

    #[test]
    fn keys_and_shapes() {
        let place = Place::new();
        for (robot, joints, flexible) in
            [("kr210/links.toml", 6, 2), ("test/reference_arm", 6, 2), ("test/three_beams", 1, 3)]
        {
            let seen = place.json(&["statics", &shipped_robot(robot), "--wrench", "1,2,3,4,5,6"]);
            for key in ["tcp_displacement_m", "tcp_rotation_rad", "sag_m", "sag_rad", "tcp_position_m"] {
                assert_eq!(numbers(&seen[key]).len(), 3, "{robot} {key}");
            }
            let C = matrix(&seen["compliance"]);
            assert!(C.len() == 6 && C.iter().all(|row| row.len() == 6), "{robot}");
            assert!((0..6).all(|i| C[i][i] > 0.0), "{robot}: what yields, yields along the force");
            assert_eq!(numbers(&seen["holding_torque"]).len(), joints);
            assert_eq!(numbers(&seen["wrench"]), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
            let elements = seen["elements"].as_array().unwrap();
            assert_eq!(elements.len(), flexible, "{robot}");
            for element in elements {
                assert!(element["name"].is_string() && element["energy_j"].as_f64().unwrap() >= 0.0);
                assert_eq!((numbers(&element["deflection"]).len(), numbers(&element["load"]).len()), (6, 6));
            }
        }
    }

    /// Truth: a cantilever, `F l³ / 3EI + F l / kGA`; the bar is flat, y is its wide side.
    #[test]
    fn a_bar_yields_like_a_cantilever() {
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "-9.81]", "0.0]"));
        let at_rest = place.json(&["statics", "robot.toml"]);
        assert!(numbers(&at_rest["tcp_displacement_m"]).iter().all(|x| x.abs() < 1e-15), "weightless");
        let C = matrix(&at_rest["compliance"]);
        let pushed = place.json(&["statics", "robot.toml", "--wrench", "0,10,0"]);
        let y = numbers(&pushed["tcp_displacement_m"])[1];
        assert!((y / (10.0 * C[1][1]) - 1.0).abs() < 1e-4, "small: linear");
        let torque = numbers(&pushed["holding_torque"])[0];
        assert!((torque + 10.0 * LENGTH).abs() < 1e-3, "the drive holds against the force: {torque}");
        // Slope over deflection of a cantilever under a force at its end: 3 / (2 l), except for
        // shear.
        assert!((C[5][1] / C[1][1] * LENGTH / 1.5 - 1.0).abs() < 0.01);
        assert!((C[5][1] - C[1][5]).abs() < 1e-12 * C[5][5]);
        // Rotated by a right angle, x and y are exchanged.
        let C_turned = matrix(&place.json(&["statics", "robot.toml", "--at", "90deg"])["compliance"]);
        assert!((C_turned[0][0] / C[1][1] - 1.0).abs() < 1e-9);
        assert!((C_turned[1][1] / C[0][0] - 1.0).abs() < 1e-6);
    }

    /// The rigid share of the weight, and the sum of the parts.
    #[test]
    fn elements_add_up_to_the_displacement() {
        let place = Place::new();
        let seen = place.json(&[
            "statics",
            &shipped_robot("kr210/links.toml"),
            "--at",
            "0.1,-1,1,0,0.4,0",
            "--wrench",
            "0,0,-500",
        ]);
        let total = numbers(&seen["tcp_displacement_m"]);
        let mut sum = [0.0; 3];
        for element in seen["elements"].as_array().unwrap() {
            for (sum, x) in sum.iter_mut().zip(numbers(&element["tcp_displacement_m"])) {
                *sum += x;
            }
        }
        for (sum, total) in sum.iter().zip(&total) {
            assert!((sum - total).abs() < 0.01 * total.abs().max(1e-3), "to first order: {sum} {total}");
        }
        assert!(total[2] < numbers(&seen["sag_m"])[2], "pushed down further");
    }

    #[test]
    fn the_arm_is_drawn_with_its_figures_and_nothing_is_overwritten() {
        let place = Place::new();
        let words = ["statics", "robot.toml", "--wrench", "0,0,-10", "-o", "sag"];
        let seen = place.json(&words);
        let stored: serde_json::Value = serde_json::from_str(&place.text("sag/statics.json")).unwrap();
        assert_eq!(stored, seen);
        let picture = seen["files"]["picture"].as_str();
        if let Some(picture) = picture {
            assert!(picture.ends_with("statics.png"));
            let png = std::fs::read(place.path("sag/statics.png")).unwrap();
            assert!(png.starts_with(b"\x89PNG") && png.len() > 10_000, "{} bytes", png.len());
        } else {
            assert!(seen["warnings"].to_string().contains("without the feature png"), "{}", seen["warnings"]);
        }
        place.refused(&words, &["sag", "--force"]);
        assert_eq!(place.json(&[&words[..], &["--force"]].concat()), seen);
    }

    #[test]
    fn a_rigid_robot_does_not_yield_and_says_so() {
        let place = Place::new();
        let seen = place.json(&["statics", "beam.urdf", "--wrench", "0,0,-100"]);
        assert_eq!(numbers(&seen["tcp_displacement_m"]), [0.0; 3]);
        assert!(matrix(&seen["compliance"]).concat().iter().all(|x| *x == 0.0));
        assert!(seen["warnings"].to_string().contains("no flexible link"));
    }

    #[test]
    fn bad_input_is_named() {
        let place = Place::new();
        place.refused(&["statics"], &["ROBOT"]);
        place.refused(&["statics", "nowhere.toml"], &["nowhere.toml", "no such file"]);
        place.refused(&["statics", "robot.toml", "--at", "1,2"], &["2 joint values", "swing"]);
        place.refused(&["statics", "robot.toml", "--at", "elbow=1"], &["elbow", "swing"]);
        place.refused(&["statics", "robot.toml", "--wrench", "1,2"], &["--wrench", "2 numbers", "fx,fy,fz"]);
        place.refused(&["statics", "robot.toml", "--wrench", "1,2,nan"], &["--wrench", "nan"]);
        place.refused(&["statics", "robot.toml", "--wrench", "1,2,x"], &["--wrench", "x"]);
        place.refused(&["statics", "robot.toml", "--tcp", "hand"], &["hand", "ball"]);
    }

    /// Beyond the buckling load there is an equilibrium, but an unstable one. Truth: Euler's load
    /// of a clamped bar, `π² EI / (2l)²`; a single elastic joint buckles slightly below it (a
    /// spring EI/l at half the length: `2 EI / l²`). Under a large pull the result is a number with
    /// a warning.
    #[test]
    fn a_load_beyond_buckling_is_no_answer() {
        let place = Place::new();
        let euler = std::f64::consts::PI.powi(2) * 70e9 * (0.04 * 0.02f64.powi(3) / 12.0) / (4.0 * LENGTH * LENGTH);
        let pushed = |load: f64| format!("{:e},0,0", -load);
        let C = |load: f64| matrix(&place.json(&["statics", "robot.toml", "--wrench", &pushed(load)])["compliance"]);
        let soft = C(0.5 * euler)[1][1] / C(0.0)[1][1];
        assert!((1.5..3.0).contains(&soft), "half the load doubles the compliance: {soft}");
        place.refused(
            &["statics", "robot.toml", "--wrench", &pushed(2.0 * euler)],
            &["stiffness", "load", "not positive"],
        );
        place.refused(&["statics", "robot.toml", "--wrench", "-1e9,0,0"], &["not positive"]);
        let pulled = place.json(&["statics", "robot.toml", "--wrench", "1e9,0,0"]);
        assert!(pulled["warnings"].to_string().contains("changes its length"), "{pulled}");
    }
}

mod modes {
    use super::*;

    #[test]
    fn keys_and_shapes() {
        let place = Place::new();
        let seen = place.json(&["modes", &shipped_robot("kr210/links.toml"), "--count", "4"]);
        let (frequencies, ratios) = (numbers(&seen["frequencies_hz"]), numbers(&seen["damping_ratio"]));
        assert_eq!((frequencies.len(), ratios.len()), (4, 4));
        assert!(frequencies.windows(2).all(|w| 0.0 < w[0] && w[0] <= w[1]));
        assert!(ratios.iter().all(|r| (r - 0.03).abs() < 1e-6), "3 per cent: {ratios:?}");
        assert_eq!((seen["total"].as_u64(), seen["elements"].as_array().unwrap().len()), (Some(12), 2));
        for mode in seen["modes"].as_array().unwrap() {
            for key in ["tcp", "tcp_imaginary", "effective_mass", "compliance_share"] {
                assert_eq!(mode[key].as_array().unwrap().len(), 6, "{key}");
            }
            let shares = numbers(&mode["strain_energy"]);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9 && shares.len() == 2);
        }
    }

    /// Truth: `compare`, at the start pose of its motion.
    #[test]
    fn frequencies_are_those_that_a_run_reports() {
        let place = Place::new();
        let run = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
        let seen = place.json(&["modes", "robot.toml", "--at", "swing=0"]);
        for (found, truth) in numbers(&seen["frequencies_hz"]).iter().zip(numbers(&run["frequencies_hz"])) {
            assert!((found / truth - 1.0).abs() < 1e-9, "{found} {truth}");
        }
    }

    /// Truths: zero speed is rest; weight turns with the arm about a horizontal axis only.
    #[test]
    fn a_turning_arm_stiffens_and_unsteady_rotation_is_named() {
        let place = Place::new();
        let arm = shipped_robot("test/reference_arm");
        let modes = |words: &[&str]| place.json(&[&["modes", &arm, "--count", "3"], words].concat());
        let rest = modes(&[]);
        assert!(rest["speeds"].is_null());
        assert_eq!(rest, modes(&["--speeds", "joint_1=0"]));
        let slow = modes(&["--speeds", "joint_1=0.01rpm"]);
        for (slow, rest) in numbers(&slow["frequencies_hz"]).iter().zip(numbers(&rest["frequencies_hz"])) {
            assert!((slow / rest - 1.0).abs() < 1e-5, "{slow} {rest}");
        }
        let fast = modes(&["--speeds", "joint_1=60rpm"]);
        assert!((fast["speeds"][0].as_f64().unwrap() / std::f64::consts::TAU - 1.0).abs() < 1e-12);
        assert!(fast["frequencies_hz"] != rest["frequencies_hz"]);
        let codes = |found: &serde_json::Value| found["caveats"].to_string().contains("unsteady-rotation");
        assert!(!codes(&fast) && codes(&modes(&["--speeds", "joint_2=1"])));
        place.refused(&["modes", &arm, "--speeds", "joint_1=5 turns"], &["5 turns", "30rpm"]);
        place.refused(&["modes", &arm, "--speeds", "1,2"], &["2 joint values", "joint_1"]);
        assert!(numbers(&place.json(&["modes", "beam.urdf", "--speeds", "swing=1"])["frequencies_hz"]).is_empty());
    }

    /// The recording contains every mode for its duration, with the requested TCP amplitude.
    #[test]
    fn modes_swing_in_a_recording() {
        let place = Place::new();
        let words = ["modes", "robot.toml", "--count", "2", "-o", "shapes", "--seconds", "2", "--tool-motion", "0.03"];
        let seen = place.json(&words);
        let table = Table::parse(&place.text("shapes/run.csv"));
        assert_eq!(table.column("time").last(), Some(&4.0));
        let still = numbers(&place.json(&["statics", "robot.toml"])["tcp_displacement_m"]);
        let swing = |half: usize| {
            let rows = table.rows.len() / 2;
            let column = |k: usize| table.column(["error_x_m", "error_y_m", "error_z_m"][k]);
            let [x, y, z] = [0, 1, 2].map(|k| {
                let part: Vec<f64> = column(k)[half * rows..(half + 1) * rows].iter().map(|e| e - still[k]).collect();
                part
            });
            (0..rows).map(|k| x[k].hypot(y[k]).hypot(z[k])).fold(0.0, f64::max)
        };
        for half in [0, 1] {
            assert!((swing(half) / 0.03 - 1.0).abs() < 0.05, "{}", swing(half));
        }
        if !seen["files"]["mcap"].is_null() {
            mcap_records(&place.read("shapes/run.mcap"));
        }
        place.refused(&words, &["shapes", "--force"]);
        place.json(&[&words[..], &["--force"]].concat());
    }

    #[test]
    fn bad_input_is_named() {
        let place = Place::new();
        place.refused(&["modes", "robot.toml", "--count", "0"], &["--count"]);
        place.refused(&["modes", "robot.toml", "--count", "-3"], &["-3"]);
        place.refused(&["modes", "robot.toml", "--at", "1;2"], &["1;2"]);
        place.refused(&["modes", "robot.toml", "--seconds", "2"], &["--output"]);
        place.refused(&["modes", "robot.toml", "-o", "out", "--seconds", "0"], &["--seconds", "positive"]);
        place.refused(&["modes", "robot.toml", "-o", "out", "--tool-motion", "-1"], &["--tool-motion", "positive"]);
        place.refused(&["modes", "beam.urdf", "-o", "out"], &["no flexible link"]);
        let rigid = place.json(&["modes", "beam.urdf"]);
        assert!(numbers(&rigid["frequencies_hz"]).is_empty());
    }
}

mod response {
    use super::*;

    #[test]
    fn keys_files_and_shapes() {
        let place = Place::new();
        let words_of =
            |points| ["response", "robot.toml", "--input", "force-z,swing", "--output", "y,z", "--points", points];
        let words = words_of("60");
        let seen = place.json(&[&words[..], &["--from", "2", "--to", "300", "-o", "bode"]].concat());
        let hz = numbers(&seen["frequency_hz"]);
        assert_eq!((hz[0], *hz.last().unwrap(), seen["quantity"].as_str()), (2.0, 300.0, Some("displacement")));
        assert!(hz.len() > 60, "more points around the resonances");
        let curves = seen["curves"].as_array().unwrap();
        let named: Vec<_> =
            curves.iter().map(|c| (c["input"].as_str().unwrap(), c["output"].as_str().unwrap())).collect();
        assert_eq!(named, [("force-z", "y"), ("force-z", "z"), ("swing", "y"), ("swing", "z")]);
        for curve in curves {
            assert_eq!((numbers(&curve["magnitude"]).len(), numbers(&curve["phase_rad"]).len()), (hz.len(), hz.len()));
        }
        assert_eq!((curves[1]["unit"].as_str(), curves[2]["unit"].as_str()), (Some("m/N"), Some("m/rad")));

        // A slow joint motion moves the TCP by its lever; a slow force by the compliance.
        assert!((curves[2]["at_rest"].as_f64().unwrap() - LENGTH).abs() < 1e-3);
        let C = matrix(&place.json(&["statics", "robot.toml"])["compliance"]);
        assert!((curves[1]["at_rest"].as_f64().unwrap() / C[2][2] - 1.0).abs() < 1e-12);
        // With one mode in the direction, the peak is near its frequency and is 1/(2 ζ) times the
        // static response.
        let peak = &curves[1]["peaks"][0];
        let modes = numbers(&seen["frequencies_hz"]);
        assert!(modes.iter().any(|f| (f / peak["frequency_hz"].as_f64().unwrap() - 1.0).abs() < 2e-3));
        assert!((peak["magnitude"].as_f64().unwrap() * 2.0 * 0.03 / C[2][2] - 1.0).abs() < 0.02);
        assert!((peak["phase_rad"].as_f64().unwrap() + 1.54).abs() < 0.1);

        let table = Table::parse(&place.text("bode/response.csv"));
        assert_eq!(table.names[..3], ["frequency_hz", "force-z_to_y_m_per_N", "force-z_to_y_phase_rad"]);
        for (csv, json) in table.column("force-z_to_z_m_per_N").iter().zip(numbers(&curves[1]["magnitude"])) {
            assert!((csv / json - 1.0).abs() < 1e-12);
        }
        let plot = place.text("bode/response.svg");
        // The picture has readable units, the pose, the natural frequencies, and z in the colour of
        // z.
        let shown =
            ["<svg", "frequency [Hz]", "force-z to z", "magnitude [µm/N]", "magnitude [m/rad]", "at swing 0°", "f1"];
        for word in shown {
            assert!(plot.contains(word), "{word}");
        }
        assert!(plot.contains(&format!("f1 {}", (modes[0] * 100.0).round() / 100.0)));
        assert!(plot.contains("stroke=\"#2A6FDB\""), "force-z to z");
        // Linear interpolation between the points reproduces the curve: twice as many points add
        // nothing.
        let finer = place.json(&[&words_of("120")[..], &["--from", "2", "--to", "300", "--no-files"]].concat());
        let fine: Vec<(f64, f64)> =
            numbers(&finer["frequency_hz"]).into_iter().zip(numbers(&finer["curves"][1]["magnitude"])).collect();
        let z = numbers(&curves[1]["magnitude"]);
        for (f, m) in fine {
            let k = hz.partition_point(|known| *known <= f).clamp(1, hz.len() - 1);
            let part = (f / hz[k - 1]).ln() / (hz[k] / hz[k - 1]).ln();
            let line = z[k - 1].ln() * (1.0 - part) + z[k].ln() * part;
            assert!((m.ln() - line).abs() < 0.02, "{f} Hz: {m:e} is off the line by {}", m.ln() - line);
        }
        let stored: serde_json::Value = serde_json::from_str(&place.text("bode/response.json")).unwrap();
        assert_eq!(stored["curves"], seen["curves"]);
        place.refused(&[&words[..], &["-o", "bode"]].concat(), &["bode", "--force"]);
    }

    #[test]
    fn acceleration_is_displacement_times_omega_squared() {
        let place = Place::new();
        let of = |quantity: &str| {
            let words = ["--input", "force-y", "--output", "y,rz", "--from", "1", "--to", "80", "--no-files"];
            place.json(&[&["response", "robot.toml", "--quantity", quantity], &words[..]].concat())
        };
        let (displacement, acceleration) = (of("displacement"), of("acceleration"));
        assert_eq!(acceleration["curves"][1]["unit"], "rad/s2/N");
        let hz = numbers(&displacement["frequency_hz"]);
        let [d, a] = [&displacement, &acceleration].map(|r| numbers(&r["curves"][0]["magnitude"]));
        for ((hz, d), a) in hz.iter().zip(&d).zip(&a) {
            let omega = std::f64::consts::TAU * hz;
            assert!((a / (d * omega * omega) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn bad_input_is_named() {
        let place = Place::new();
        let refused = |more: &[&str], words: &[&str]| {
            place.refused(&[&["response", "robot.toml", "-o", "new"], more].concat(), words);
        };
        refused(&["--input", "force-w"], &["force-w", "force-x", "swing"]);
        refused(&["--input", "swing,swing"], &["swing", "twice"]);
        refused(&["--output", "up"], &["up", "rx"]);
        refused(&["--from", "0"], &["--from", "--spacing linear"]);
        refused(&["--from", "-1", "--spacing", "linear"], &["--from", "-1"]);
        refused(&["--from", "10", "--to", "5"], &["--to", "5"]);
        refused(&["--to", "inf"], &["--to", "inf"]);
        refused(&["--points", "1"], &["--points", "1"]);
        refused(&["--at", "nan"], &["nan"]);
        refused(&["--quantity", "jerk"], &["jerk"]);
        refused(&["--no-files"], &["--no-files"]);
    }

    /// Without damping the response at resonance is infinite, which is reported.
    #[test]
    fn an_undamped_arm_is_told_so() {
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "modal = 0.03", "modal = 0.0"));
        let seen = place.json(&["response", "robot.toml", "--no-files"]);
        assert!(seen["warnings"].to_string().contains("no damping"), "{}", seen["warnings"]);
        let rigid = place.json(&["response", "beam.urdf", "--input", "swing", "--from", "1", "--to", "9", "-o", "r"]);
        assert!((rigid["curves"][1]["at_rest"].as_f64().unwrap() - LENGTH).abs() < 1e-12);
    }
}

mod map {
    use super::*;

    #[test]
    fn keys_files_and_numbers_that_statics_gives() {
        let place = Place::new();
        let robot = shipped_robot("kr210");
        let line =
            ["map", &robot, "--box", "1.4:2.2,-0.4:0.4,0.6:1.4", "--grid", "0.4", "--wrench", "500,0,0", "-o", "out"];
        let seen = place.json(&[&line[..], &["--workpiece", "0.4,0.4,0"]].concat());
        assert_eq!((seen["points"].as_u64(), seen["reachable"].as_u64()), (Some(27), Some(27)));
        for key in ["sag_m", "error_m", "compliance_worst_m_per_n", "frequency_1_hz", "share_link_2"] {
            let spread = &seen["quantities"][key];
            let [min, median, max] =
                [&spread["min"], &spread["quantiles"]["0.5"], &spread["max"]].map(|x| x.as_f64().unwrap());
            assert!(min <= median && median <= max, "{key}");
        }
        let files = ["map.parquet", "map.html", "map.json", "map.rrd"];
        for file in files.into_iter().take(if cfg!(feature = "rerun") { 4 } else { 3 }) {
            assert!(place.path(&format!("out/{file}")).metadata().unwrap().len() > 1000, "{file}");
        }
        let at: Vec<String> = numbers(&seen["worst"]["q"]).iter().map(f64::to_string).collect();
        let alone = place.json(&["statics", &robot, "--at", &at.join(","), "--wrench", "500,0,0"]);
        let size = numbers(&alone["tcp_displacement_m"]).iter().map(|x| x * x).sum::<f64>().sqrt();
        assert_eq!(seen["worst"]["value"].as_f64(), Some(size));
        assert_eq!(seen["by"], "error_m");
        assert_eq!(seen["placement"]["points"], 4);
        // A second one does not replace the first.
        place.refused(&line, &["map.parquet", "--force"]);
    }

    #[test]
    fn bad_input_is_told_in_words_of_the_command_line() {
        let place = Place::new();
        let robot = shipped_robot("kr210");
        for (flags, words) in [
            (&["--box", "1,2,3"][..], "X0:X1"),
            (&["--over", "joint_2"], "JOINT=FROM:TO:N"),
            (&["--over", "elbow=0:1:3"], "joint_2"),
            (&["--grid", "0"], "--grid"),
            (&["--grid", "1e-9"], "--grid"),
            (&["--tool-axis", "0,0,0"], "--tool-axis"),
            (&["--by", "stiffness"], "compliance_worst_m_per_n"),
            (&["--along", "pick_and_place", "--points", "0"], "instants"),
            (&["--box", "8:9,8:9,8:9"], "within reach"),
            (&["--workpiece", "-1,0,0"], "workpiece"),
        ] {
            place.refused(&[&["map", &robot, "--no-files"], flags].concat(), &[words]);
        }
    }
}
