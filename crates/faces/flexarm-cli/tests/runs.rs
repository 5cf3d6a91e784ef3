//! Successful runs, and runs that stop early: printed and written output, and their consistency.

use crate::common::{
    self, Answer, Place, ROBOT, Table, matrix, mcap_records, numbers, shipped_robot, shipped_trajectory, with,
};
use serde_json::Value;

const RUN: [&str; 5] = ["compare", "robot.toml", "swing.toml", "-o", "result"];

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {value}"))
}

fn max(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn near(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * a.abs().max(b.abs()), "{a} and {b} differ by more than {relative:e}");
}

/// Keys and types on which other programs rely.
fn has_stable_keys(summary: &Value) {
    for key in ["robot", "trajectory"] {
        assert!(summary[key].is_string(), "{key}: {summary}");
    }
    for key in ["duration_s", "wall_s", "real_time_factor", "cpu_s"] {
        assert!(number(summary, key) >= 0.0, "{key}: {summary}");
    }
    assert!(summary["stepper"]["name"].is_string());
    assert!(number(&summary["stepper"], "h_s") > 0.0);
    let tcp = &summary["tcp"];
    for key in ["peak_m", "rms_m", "end_m", "static_sag_m", "peak_rad", "rms_rad", "overshoot_m"] {
        assert!(number(tcp, key) >= 0.0, "{key}: {tcp}");
    }
    for key in ["settling_s", "dominant_hz"] {
        assert!(tcp[key].is_number() || (tcp[key].is_null() && tcp.get(key).is_some()), "{key}: {tcp}");
    }
    for link in summary["links"].as_array().unwrap() {
        assert!(link["name"].is_string());
        for key in ["peak_contribution_m", "engineering_strain"] {
            assert!(number(link, key) >= 0.0, "{key}: {link}");
        }
    }
    assert!(summary["warnings"].as_array().unwrap().iter().all(Value::is_string));
    let files = &summary["files"];
    for (key, written) in
        [("mcap", cfg!(feature = "mcap")), ("rrd", cfg!(feature = "rerun")), ("csv", true), ("report", true)]
    {
        assert_eq!(files[key].is_string(), written, "{key}: {files}");
    }
}

/// The TCP figures of the summary must agree with the table.
fn agrees_with_table(summary: &Value, table: &Table) {
    let tcp = &summary["tcp"];
    let times = table.column("time");
    let error = table.length(["error_x_m", "error_y_m", "error_z_m"]);
    let angle = table.length(["error_rx_rad", "error_ry_rad", "error_rz_rad"]);
    near(number(tcp, "peak_m"), max(&error), 1e-12);
    near(number(tcp, "peak_rad"), max(&angle), 1e-12);
    // The run started in equilibrium.
    near(number(tcp, "static_sag_m"), error[0], 1e-9);
    near(number(tcp, "end_m"), *error.last().unwrap(), 1e-12);
    near(number(summary, "duration_s"), *times.last().unwrap(), 1e-12);
    let at_peak =
        times.iter().position(|t| *t == number(tcp, "t_peak_s")).expect("the time of the peak is a logged one");
    near(error[at_peak], max(&error), 1e-12);
    for (key, values) in [("rms_m", &error), ("rms_rad", &angle)] {
        // Mean over time, trapezoidal.
        let square = |k: usize| values[k] * values[k];
        let integral: f64 =
            (1..times.len()).map(|k| 0.5 * (square(k) + square(k - 1)) * (times[k] - times[k - 1])).sum();
        near(number(tcp, key), (integral / times.last().unwrap()).sqrt(), 1e-9);
    }
    // The path frame rotates the error but keeps its magnitude.
    let along = table.length(["error_tangential_m", "error_normal_m", "error_binormal_m"]);
    for (a, b) in along.iter().zip(&error) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
    for axis in ["x", "y", "z"] {
        let [e, r, f] = ["error", "rigid", "flexible"].map(|who| table.column(&format!("{who}_{axis}_m")));
        for k in 0..e.len() {
            assert!((f[k] - r[k] - e[k]).abs() < 1e-12, "error is flexible minus rigid");
        }
    }
    assert!(table.rows.iter().flatten().all(|x| x.is_finite()));
}

mod compare {
    use super::*;

    #[test]
    fn summary_and_table_of_the_beam() {
        let place = Place::new();
        let summary = place.json(&RUN);
        has_stable_keys(&summary);
        assert_eq!(summary["robot"], "beam");
        assert_eq!(summary["trajectory"], "swing");
        assert_eq!(summary["stepper"]["name"], "generalized-alpha");
        assert_eq!(summary["links"][0]["name"], "bar");
        near(number(&summary, "duration_s"), 1.0, 1e-12);
        near(number(&summary["stepper"], "h_s"), 1e-3, 1e-12);

        let table = Table::parse(&place.text("result/run.csv"));
        // 1 s at 500 Hz, both ends.
        assert_eq!(table.rows.len(), 501);
        agrees_with_table(&summary, &table);
        let expected = [
            "time",
            "rigid_x_m",
            "rigid_y_m",
            "rigid_z_m",
            "flexible_x_m",
            "flexible_y_m",
            "flexible_z_m",
            "error_x_m",
            "error_y_m",
            "error_z_m",
            "error_rx_rad",
            "error_ry_rad",
            "error_rz_rad",
        ];
        assert_eq!(table.names[..expected.len()], expected);
        for (k, t) in table.column("time").iter().enumerate() {
            near(*t, 0.002 * k as f64, 1e-12);
        }
        // The joint follows the trajectory, 60 degrees.
        near(*table.column("swing_position_rad").last().unwrap(), 60f64.to_radians(), 1e-9);
    }

    #[test]
    fn sag_of_the_beam_is_that_of_the_books() {
        // Weight of the ball at the tip: m g l³/(3 EI); the bar's own weight acts on two rigid
        // parts.
        let place = Place::new();
        let bare = "theory = \"euler-bernoulli\", parts = \"uniform\", y_axis";
        place.write("robot.toml", with(ROBOT, "y_axis", bare));
        let summary = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
        let (e, l, g) = (70e9, 0.8f64, 9.81);
        let ei = e * 0.02 * 0.04f64.powi(3) / 12.0;
        let ball = 0.5 * g * l.powi(3) / (3.0 * ei);
        // Only the distal half of its own weight loads the joint in the middle: 5/6 of q l⁴/(8 EI).
        let own = 5.0 / 6.0 * (1.728 / l * g) * l.powi(4) / (8.0 * ei);
        near(number(&summary["tcp"], "static_sag_m"), ball + own, 1e-3);
    }

    #[test]
    fn six_axes() {
        let place = Place::new();
        let (robot, motion) = (shipped_robot("test/reference_arm"), shipped_trajectory("reference_arm.toml"));
        let summary = place.json(&["compare", &robot, &motion, "-o", "result", "--log-rate", "100"]);
        has_stable_keys(&summary);
        let table = Table::parse(&place.text("result/run.csv"));
        assert_eq!(table.rows.len(), 401, "4 s at 100 Hz, both ends");
        agrees_with_table(&summary, &table);
        let names: Vec<&str> =
            summary["links"].as_array().unwrap().iter().map(|l| l["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["link_2", "link_4"]);
        for joint in 1..=6 {
            for column in [format!("joint_{joint}_position_rad"), format!("joint_{joint}_effort")] {
                assert!(table.names.contains(&column), "{column}");
            }
        }
    }

    #[test]
    fn files_are_what_the_summary_says() {
        let place = Place::new();
        let summary = place.json(&RUN);
        for (_, name) in summary["files"].as_object().unwrap() {
            if let Some(name) = name.as_str() {
                assert!(!place.read(name).is_empty(), "{name}");
            }
        }
        let written: Value = serde_json::from_str(&place.text("result/summary.json")).unwrap();
        assert_eq!(written, summary, "summary.json says what --json printed");
        if cfg!(feature = "mcap") {
            const MESSAGE: u8 = 0x05;
            const CHUNK: u8 = 0x06;
            let records = mcap_records(&place.read("result/run.mcap"));
            assert!(records.contains_key(&MESSAGE) || records.contains_key(&CHUNK), "{records:?}");
        }
        if cfg!(feature = "rerun") {
            assert!(place.read("result/run.rrd").starts_with(b"RRF2"));
        }
        assert!(place.text("result/report.md").contains("peak TCP error"));
        assert_eq!(summary["files"]["report"], "result/report.html");
        assert_eq!(summary["files"]["report_md"], "result/report.md");
        assert_eq!(summary["files"]["figures"], Value::Null, "only with --figures");
        assert!(place.text("result/report.html").contains("beam on swing"));
    }

    #[test]
    fn figures_for_papers_when_asked_for() {
        let place = Place::new();
        let summary = place.json(&[&RUN[..], &["--figures"]].concat());
        assert_eq!(summary["files"]["figures"], "result/figures");
        assert!(place.text("result/figures/tcp_error.svg").starts_with("<svg"));
        assert!(place.text("result/figures/tcp_error.csv").starts_with("time_s,size_mm"));
        assert_eq!(place.path("result/figures/arm_side.png").is_file(), cfg!(feature = "png"));
        // Not over those of another run, and not if no files are to be written.
        assert_eq!(place.flexarm(&[&RUN[..], &["--figures"]].concat()).code, 2);
        let answer = place.flexarm(&["compare", "robot.toml", "swing.toml", "--no-files", "--figures"]);
        assert_eq!(answer.code, 2);
    }

    #[test]
    fn bare_urdf_does_not_bend() {
        let place = Place::new();
        let summary = place.json(&["compare", "beam.urdf", "swing.toml", "-o", "result"]);
        has_stable_keys(&summary);
        assert_eq!(summary["links"], Value::Array(Vec::new()));
        for key in ["peak_m", "rms_m", "end_m", "static_sag_m", "peak_rad"] {
            assert_eq!(number(&summary["tcp"], key), 0.0, "{key}");
        }
        let table = Table::parse(&place.text("result/run.csv"));
        assert_eq!(max(&table.length(["error_x_m", "error_y_m", "error_z_m"])), 0.0);
    }

    #[test]
    fn same_command_same_bytes() {
        let places = [Place::new(), Place::new()];
        for place in &places {
            place.json(&RUN);
        }
        let mut files = vec!["result/run.csv"];
        files.extend(cfg!(feature = "mcap").then_some("result/run.mcap"));
        for file in files {
            assert!(places[0].read(file) == places[1].read(file), "{file} differs from run to run");
        }
    }

    #[test]
    fn steppers_agree() {
        let place = Place::new();
        let peak = |options: &[&str]| {
            let summary = place.json(&[&["compare", "robot.toml", "swing.toml", "--no-files"], options].concat());
            (number(&summary["tcp"], "peak_m"), number(&summary["tcp"], "rms_m"))
        };
        let reference = peak(&["--stepper", "rk4", "--step", "1e-4"]);
        for (options, allowed) in [
            (vec!["--stepper", "generalized-alpha", "--step", "1e-4"], 1e-4),
            (vec!["--stepper", "generalised-alpha"], 2e-3),
            (vec!["--stepper", "generalized-alpha", "--rho-inf", "0"], 5e-3),
            (vec!["--stepper", "generalized-alpha", "--rho-inf", "1"], 2e-3),
            (vec!["--stepper", "spook", "--step", "1e-4"], 2e-3),
            (vec!["--stepper", "spook", "--step", "2.5e-4", "--spook-form", "global"], 5e-3),
        ] {
            let found = peak(&options);
            near(found.0, reference.0, allowed);
            near(found.1, reference.1, allowed);
        }
    }

    #[test]
    fn start_in_equilibrium_or_undeformed() {
        let place = Place::new();
        place.write("hold.toml", with(&with(common::SWING, "duration = 0.5\n", ""), "to = [60.0]", "to = [0.0]"));
        let summary =
            |start: &str| place.json(&["compare", "robot.toml", "hold.toml", "--no-files", "--from-rest", start]);
        let (rest, fall) = (summary("equilibrium"), summary("undeformed"));
        let sag = number(&rest["tcp"], "static_sag_m");
        near(number(&rest["tcp"], "peak_m"), sag, 1e-6);
        near(number(&fall["tcp"], "static_sag_m"), sag, 1e-9);
        // It falls to nearly twice the sag: 3 per cent damping reduces the overshoot by exp(-0.03
        // pi), 9 per cent.
        near(number(&fall["tcp"], "peak_m"), sag * (1.0 + (-0.03 * std::f64::consts::PI).exp()), 0.02);
    }

    /// There is nothing to log between two steps.
    #[test]
    fn a_log_rate_above_the_rate_of_the_steps_is_told() {
        let place = Place::new();
        let run = place.json(&["compare", "robot.toml", "swing.toml", "--no-files", "--log-rate", "5000"]);
        let told = run["caveats"].as_array().unwrap().iter().find(|c| c["code"] == "log-rate").unwrap();
        assert_eq!((told["value"].as_f64(), told["yardstick"].as_f64()), (Some(5000.0), Some(1000.0)), "{told}");
    }

    #[test]
    fn peak_at_a_low_log_rate() {
        let place = Place::new();
        let run = |rate: &str| place.json(&["compare", "robot.toml", "swing.toml", "--no-files", "--log-rate", rate]);
        let (fine, coarse) = (run("1000"), run("3"));
        if coarse["warnings"].as_array().unwrap().is_empty() {
            near(number(&fine["tcp"], "peak_m"), number(&coarse["tcp"], "peak_m"), 0.02);
        }
    }
}

mod run {
    use super::*;

    #[test]
    fn prismatic_joints_are_in_metres() {
        let place = Place::new();
        place.write("beam.urdf", with(common::URDF, "\"revolute\"", "\"prismatic\""));
        place.write("slide.csv", "time,swing,swing.vel\n0,0,0\n1,0.1,0\n");
        place.json(&["run", "beam.urdf", "slide.csv", "-o", "result"]);
        let table = Table::parse(&place.text("result/run.csv"));
        assert!(table.names.contains(&"swing_position_m".to_owned()), "{:?}", table.names);
    }

    /// Truth: `m g / k` of a carriage of 10 kg on a vertical slide, 0.0981 mm. Its figures are in mm,
    /// its efforts in N.
    #[test]
    fn the_deflection_of_an_elastic_slide_is_in_millimetres_and_its_effort_in_newtons() {
        let place = Place::new();
        let urdf = r#"<robot name="lift"><link name="base"/>
            <link name="carriage"><inertial><mass value="10"/>
              <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="lift" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="0 0 1"/>
              <limit lower="0" upper="1" effort="90" velocity="1"/></joint></robot>"#;
        place.write("lift.urdf", urdf);
        let drive = "[[drive]]\njoint = \"lift\"\nkind = \"gearbox\"\ngearbox = { stiffness = 1e6, damping = 1e3 }\n";
        place.write("lift.toml", format!("format = 1\nurdf = \"lift.urdf\"\ntcp = {{ link = \"carriage\" }}\n{drive}"));
        place.write("up.csv", "t[s],lift[m]\n0,0.1\n0.5,0.1\n1,0.1\n");
        let summary = place.json(&["compare", "lift.toml", "up.csv", "--no-files"]);
        let figures = &summary["elastic_drives"][0];
        near(number(figures, "peak_deflection_rad"), 10.0 * 9.81 / 1e6, 1e-4);
        assert_eq!(figures["slides"], Value::Bool(true));
        let said = place.flexarm(&["compare", "lift.toml", "up.csv", "--no-files"]);
        assert!(said.out.contains("deflection 0.0981 mm"), "{}", said.out);
        assert!(said.err.contains("\"lift\" needs 98.1 N, its limit is 90"), "{}", said.err);
    }

    /// A load beyond the cut of a flexible link deflects it as much as the same load on the next
    /// link.
    #[test]
    fn payload_at_the_far_end_of_a_flexible_link_bends_it() {
        let place = Place::new();
        let sag = |payload: &str| {
            let text = with(common::ROBOT, "\ngravity", &format!("\npayload = {{ {payload} }}\ngravity"));
            place.write("robot.toml", text);
            let summary = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
            number(&summary["tcp"], "static_sag_m")
        };
        let on_the_ball = sag("link = \"ball\", mass = 1.0, com = [0.0, 0.0, 0.0]");
        let on_the_bar = sag("link = \"bar\", mass = 1.0, com = [0.8, 0.0, 0.0]");
        near(on_the_bar, on_the_ball, 1e-9);
        let near_the_hinge = sag("link = \"bar\", mass = 1.0, com = [0.1, 0.0, 0.0]");
        assert!(near_the_hinge < 0.7 * on_the_ball);
    }

    #[test]
    fn rigid_links_do_not_bend() {
        let place = Place::new();
        let summary = place.json(&["run", "robot.toml", "swing.toml", "--links", "rigid", "-o", "result"]);
        assert_eq!(summary["links_model"], "rigid");
        assert_eq!(summary["links"], Value::Array(Vec::new()));
        assert!(numbers(&summary["frequencies_hz"]).is_empty());
        let table = Table::parse(&place.text("result/run.csv"));
        assert!(table.names.iter().all(|n| !n.contains("error") && !n.starts_with("rigid_") && !n.starts_with("bar_")));
        assert!(table.column("elastic_energy_j").iter().all(|e| *e == 0.0));
        // The ball stays on its circle.
        for r in table.length(["flexible_x_m", "flexible_y_m", "flexible_z_m"]) {
            near(r, 0.8, 1e-12);
        }
    }

    #[test]
    fn one_model_has_no_comparison() {
        let place = Place::new();
        let summary = place.json(&["run", "robot.toml", "swing.toml", "-o", "result"]);
        assert_eq!(summary["links_model"], "lumped");
        assert!(summary.get("tcp").is_none());
        for key in ["duration_s", "wall_s", "real_time_factor", "cpu_s"] {
            assert!(number(&summary, key) >= 0.0);
        }
        let table = Table::parse(&place.text("result/run.csv"));
        assert!(table.names.iter().all(|n| !n.contains("error") && !n.starts_with("rigid_")));
        assert!(max(&table.column("elastic_energy_j")) > 0.0);
    }

    #[test]
    fn same_flexible_robot_as_compare() {
        let place = Place::new();
        place.json(&RUN);
        place.json(&["run", "robot.toml", "swing.toml", "-o", "alone"]);
        let [with_twin, alone] = ["result/run.csv", "alone/run.csv"].map(|f| Table::parse(&place.text(f)));
        for name in ["flexible_x_m", "flexible_y_m", "flexible_z_m", "swing_effort", "bar_rz_rad"] {
            assert_eq!(with_twin.column(name), alone.column(name), "{name}");
        }
    }
}

mod printing {
    use super::*;

    #[test]
    fn json_is_one_object_and_quiet_is_silent() {
        let place = Place::new();
        place.write("wild.csv", "time,swing\n0,0\n1,3.5\n2,0\n");
        let wild = ["compare", "robot.toml", "wild.csv", "--no-files", "--ignore-limits"];
        let answer = place.flexarm(&[&wild[..], &["--json"]].concat());
        assert_eq!(answer.code, 0);
        assert!(!answer.json()["warnings"].as_array().unwrap().is_empty());
        assert!(answer.err.contains("warning"), "warnings go to standard error");

        let quiet = place.flexarm(&[&wild[..], &["--json", "--quiet"]].concat());
        assert_eq!((quiet.code, quiet.err.as_str()), (0, ""));
        assert_eq!(quiet.json()["warnings"], answer.json()["warnings"], "quiet does not hide them in the answer");

        let table = place.flexarm(&[&wild[..], &["-q"]].concat());
        assert_eq!((table.code, table.err.as_str()), (0, ""));
        assert!(table.out.contains("peak TCP error"));
        assert!(!table.out.contains('\u{1b}') && !table.err.contains('\u{1b}'), "no colours in a pipe");
        assert!(!table.out.contains('\u{1b}'), "no colours away from a terminal");
    }

    #[test]
    fn errors_speak_even_when_quiet() {
        let place = Place::new();
        place.refused(&["compare", "none.toml", "swing.toml", "--quiet", "--json"], &["none.toml"]);
    }

    #[test]
    fn no_files_means_none() {
        let place = Place::new();
        let before = place.snapshot();
        let summary = place.json(&["compare", "robot.toml", "swing.toml", "--no-files"]);
        assert!(summary["files"].as_object().unwrap().values().all(Value::is_null));
        assert!(place.snapshot() == before);
    }

    #[test]
    fn closed_pipe_is_no_error() {
        let place = Place::new();
        let mut command = place.command(&["inspect", "robot.toml", "--json"]);
        let mut child =
            command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        assert_eq!(Answer::of(child.wait_with_output().unwrap()).err, "");
    }

    #[test]
    fn completions_man_and_help() {
        let place = Place::new();
        for shell in ["bash", "zsh", "fish"] {
            let answer = place.flexarm(&["completions", shell]);
            assert_eq!(answer.code, 0);
            assert!(answer.out.contains("flexarm"));
        }
        assert!(place.flexarm(&["man"]).out.starts_with(".ie"));
        let help = place.flexarm(&["compare", "--help"]);
        for word in ["--stepper", "--step", "--links", "--log-rate", "--from-rest", "--force", "--json", "--quiet"] {
            assert!(help.out.contains(word), "{word}");
        }
        assert!(place.flexarm(&["--version"]).out.starts_with("flexarm "));
    }
}

mod folders {
    use super::*;

    #[test]
    fn without_o_each_run_gets_a_new_one() {
        let place = Place::new();
        let files: Vec<String> = (0..3)
            .map(|_| place.json(&["compare", "robot.toml", "swing.toml"])["files"]["csv"].as_str().unwrap().to_owned())
            .collect();
        assert_eq!(files[0], "out/beam-swing-001/run.csv");
        assert_eq!(files[2], "out/beam-swing-003/run.csv");
        assert_eq!(place.read(&files[0]), place.read(&files[2]));
        assert_eq!(std::fs::read_dir(place.path("out")).unwrap().count(), 3);
    }

    #[test]
    fn robot_folder_and_own_trajectory() {
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "\ngravity", "\ndefault_trajectory = \"swing.toml\"\ngravity"));
        let summary = place.json(&["compare", ".", "-o", "deep/down/result"]);
        assert_eq!(summary["trajectory"], "swing");
        assert!(place.path("deep/down/result/run.csv").is_file());
    }

    #[test]
    fn force_replaces_all() {
        let place = Place::new();
        for file in ["run.csv", "run.mcap", "run.rrd", "report.html", "report.md", "summary.json"] {
            place.write(&format!("result/{file}"), "old and long ".repeat(100_000));
        }
        place.write("result/notes.txt", "mine");
        place.json(&[&RUN[..], &["--force"]].concat());
        Table::parse(&place.text("result/run.csv"));
        if cfg!(feature = "mcap") {
            mcap_records(&place.read("result/run.mcap"));
        }
        let fresh = Place::new();
        fresh.json(&RUN);
        assert_eq!(place.read("result/run.csv"), fresh.read("result/run.csv"));
        assert_eq!(place.text("result/notes.txt"), "mine");
    }

    #[test]
    fn shipped_names() {
        // Shipped robots and trajectories are found by their names.
        let place = Place::new();
        let summary = place.json(&["compare", "one_beam", "beam_hold", "--no-files"]);
        assert_eq!((summary["robot"].as_str(), summary["trajectory"].as_str()), (Some("one_beam"), Some("beam_hold")));
    }

    #[test]
    fn without_arguments_the_shipped_arm() {
        let place = Place::new();
        let summary = place.json(&["compare"]);
        has_stable_keys(&summary);
        assert_eq!(
            (summary["robot"].as_str(), summary["trajectory"].as_str()),
            (Some("fanuc_r2000_210f"), Some("handling"))
        );
        let help = place.flexarm(&["help", "compare"]).out;
        assert!(
            help.contains("[default: fanuc_r2000_210f]") && help.contains("fanuc_r2000_210f on its handling"),
            "{help}"
        );
        let report = place.text("out/fanuc_r2000_210f-handling-001/report.md");
        let headline = summary["headline"].as_str().unwrap();
        assert!(headline.contains("static") && headline.contains("gearboxes"), "{headline}");
        assert_eq!(report.lines().nth(2), Some(headline));
        assert!(place.text("out/fanuc_r2000_210f-handling-001/report.html").contains(headline));
        let stiffness = matrix(&place.json(&["inspect", "fanuc_r2000_210f"])["flexible_links"][0]["stiffness"]);
        assert_eq!((stiffness.len(), stiffness[0].len()), (6, 6));
    }
}

mod first_line {
    use super::*;

    #[test]
    fn says_that_nothing_bends_before_any_figure() {
        let place = Place::new();
        let answer = place.flexarm(&["compare", "beam.urdf", "swing.toml", "--no-files"]);
        assert_eq!(answer.code, 0, "{}", answer.err);
        assert!(answer.out.starts_with("nothing is flexible"), "{}", answer.out);
        let how = answer.out.find("[[flexible_link]]").unwrap();
        assert!(how < answer.out.find("0.0000 mm").unwrap(), "{}", answer.out);
        let summary = place.json(&["compare", "beam.urdf", "swing.toml", "--no-files"]);
        assert!(summary["headline"].as_str().unwrap().starts_with("nothing is flexible"));
        assert_eq!(summary["bends"], serde_json::json!({ "links": [], "gearboxes": [] }));
    }

    #[test]
    fn says_what_bends_and_by_how_much() {
        let place = Place::new();
        let answer = place.flexarm(&["compare", "robot.toml", "swing.toml", "--no-files"]);
        let first = answer.out.lines().next().unwrap();
        assert!(first.contains("static") && first.contains("dynamic") && first.contains("links"), "{first}");
    }
}

mod robot_name {
    use super::*;

    /// A robot file without a name gets that of its real folder, by any path.
    #[test]
    fn is_that_of_the_real_folder() {
        let place = Place::new();
        place.write("seven/robot.toml", with(ROBOT, "name = \"beam\"\n", ""));
        for file in ["beam.urdf", "swing.toml"] {
            place.write(&format!("seven/{file}"), place.read(file));
        }
        place.write("seven/inner/note.txt", "a way round");
        let name = |folder: &str, robot: &str| {
            let mut command = place.command(&["compare", robot, "swing.toml", "--no-files", "--json"]);
            let answer = Answer::of(command.current_dir(place.path(folder)).output().unwrap());
            assert_eq!(answer.code, 0, "{robot}: {}", answer.err);
            answer.json()["robot"].as_str().unwrap().to_owned()
        };
        let ways = ["robot.toml", "./robot.toml", ".", "inner/../robot.toml", "inner/..", "../seven", "../seven/"];
        for way in ways {
            assert_eq!(name("seven", way), "seven", "{way}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(place.path("seven"), place.path("link")).unwrap();
            assert_eq!(name("seven", "../link"), "seven");
        }
    }
}

mod stopped {
    use super::*;

    /// A spin that no beam withstands: from rest with 2000 rad/s² for 10 s.
    fn spin() -> String {
        let row = |k: i32| {
            let t = 0.01 * f64::from(k);
            format!("{t},{},{},2000\n", 1000.0 * t * t, 2000.0 * t)
        };
        "time,swing[rad],swing.vel,swing.acc\n".to_owned() + &(0..=1000).map(row).collect::<String>()
    }

    /// Checks complete lines of finite numbers in the table, and a closed MCAP. Returns the last
    /// time.
    fn readable(place: &Place) -> f64 {
        let table = Table::parse(&place.text("result/run.csv"));
        assert!(table.rows.len() > 5, "{} rows", table.rows.len());
        assert!(table.rows.iter().flatten().all(|x| x.is_finite()));
        if cfg!(feature = "mcap") {
            mcap_records(&place.read("result/run.mcap"));
        }
        *table.column("time").last().unwrap()
    }

    /// The number after `t = ` in a message.
    fn time_in(message: &str) -> f64 {
        let rest = message.split("t = ").nth(1).unwrap_or_else(|| panic!("no time in {message:?}"));
        rest.split(' ').next().unwrap().parse().unwrap()
    }

    #[test]
    fn by_divergence() {
        for stepper in flexarm::steppers::STEPPERS.map(|entry| entry.name) {
            let place = Place::new();
            place.write("spin.csv", spin());
            let options = ["--ignore-limits", "--stepper", stepper, "--step", "1e-4", "--log-rate", "1000", "--json"];
            let answer =
                place.flexarm(&[&["compare", "robot.toml", "spin.csv", "-o", "result"], &options[..]].concat());
            assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{stepper}: {}", answer.err);
            answer.says(&["error: ", "t = ", "step 1e-4 s", "--step", "readable"]);
            assert!(answer.err.contains("diverged") || answer.err.contains("did not converge"), "{}", answer.err);
            // The log ends at the time in the message, to one sample.
            let (stop, last) = (time_in(&answer.err), readable(&place));
            assert!((0.0..=1.1e-3).contains(&(stop - last)), "{stepper}: stopped at {stop}, logged to {last}");
        }
    }

    #[test]
    fn by_an_explicit_step_outside_its_region() {
        // Modal damping shifts the eigenvalues; a step that passes the stability check must still
        // not end well.
        let place = Place::new();
        place.write("robot.toml", with(ROBOT, "modal = 0.03", "modal = 0.6"));
        for step in ["2e-4", "3e-4", "3.8e-4", "5e-4"] {
            let options = ["--stepper", "rk4", "--step", step, "--force", "--json"];
            let answer = place.flexarm(&[&RUN[..], &options].concat());
            match answer.code {
                0 => assert!(number(&answer.json()["tcp"], "peak_m") < 0.01, "{step}: {}", answer.out),
                1 => answer.says(&["diverged at t = ", "--step", "readable"]),
                2 => answer.says(&["unstable", "--step"]),
                other => panic!("{step}: {other} {}", answer.err),
            }
        }
    }

    #[test]
    fn by_an_absurd_step_of_spook() {
        let place = Place::new();
        let (robot, motion) = (shipped_robot("kr210"), shipped_trajectory("stress.toml"));
        let options = ["--no-files", "--stepper", "spook", "--step", "0.5"];
        let answer = place.flexarm(&[&["compare", &robot, &motion], &options[..]].concat());
        assert_eq!(answer.code, 1, "{}", answer.out);
    }

    #[test]
    fn without_files_there_is_no_log() {
        let place = Place::new();
        place.write("spin.csv", spin());
        let options = ["--ignore-limits", "--step", "1e-4", "--no-files"];
        let answer = place.flexarm(&[&["compare", "robot.toml", "spin.csv"], &options[..]].concat());
        assert_eq!(answer.code, 1);
        assert!(!answer.err.contains("readable"), "{}", answer.err);
    }

    #[test]
    fn report_of_a_stopped_run_says_so() {
        let place = Place::new();
        place.write("spin.csv", spin());
        place.flexarm(&["compare", "robot.toml", "spin.csv", "-o", "result", "--ignore-limits", "--step", "1e-4"]);
        for file in ["result/report.md", "result/summary.json"] {
            let text = place.text(file);
            assert!(text.contains("diverged") || text.contains("did not converge"), "{file}: {text}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn by_ctrl_c() {
        use std::process::{Command, Stdio};
        use std::time::{Duration, Instant};

        let place = Place::new();
        // Samples 0.1 ms apart: the message rounds the stop time by up to 0.5 ms.
        let arguments = [&RUN[..], &["--step", "1e-8", "--log-rate", "10000", "--json"]].concat();
        let child = place.command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        // Wait for rows in the table: then the run has started.
        let started = Instant::now();
        let rows = || std::fs::read_to_string(place.path("result/run.csv")).map_or(0, |t| t.lines().count());
        while rows() < 8 {
            assert!(started.elapsed() < Duration::from_secs(60), "no samples in a minute");
            std::thread::sleep(Duration::from_millis(20));
        }
        let sent = Instant::now();
        let status = Command::new("kill").args([common::stop_signal(), &child.id().to_string()]).status().unwrap();
        assert!(status.success());
        let answer = Answer::of(child.wait_with_output().unwrap());
        assert!(sent.elapsed() < Duration::from_secs(10), "took {:?} to stop", sent.elapsed());
        assert_eq!((answer.code, answer.out.as_str()), (1, ""), "{}", answer.err);
        answer.says(&["stopped at t = ", "readable"]);
        let (stop, last) = (time_in(&answer.err), readable(&place));
        assert!((stop - last).abs() < 1e-3, "stopped at {stop}, logged to {last}");
    }
}
