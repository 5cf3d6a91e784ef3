//! Models of links and drives, and loads during a run: effect of the command-line options, and
//! refusals.

use crate::common::{self, Place, ROBOT, line_of, numbers, shipped_robot, shipped_trajectory, with};
use serde_json::Value;

const RUN: [&str; 4] = ["compare", "robot.toml", "swing.toml", "--no-files"];
/// Length (m), mass per length (kg/m), bending stiffness in the vertical plane and across it (N m²)
/// of the beam; ball (kg).
const L: f64 = 0.8;
const BALL: f64 = 0.5;
const G: f64 = 9.81;

fn stiffness() -> [f64; 2] {
    let (w, h) = (0.02f64, 0.04f64);
    [70e9 * w * h.powi(3) / 12.0, 70e9 * h * w.powi(3) / 12.0]
}

/// The beam as a slender uniform one, so that the closed forms hold.
fn slender() -> String {
    with(ROBOT, "y_axis", "theory = \"euler-bernoulli\", parts = \"uniform\", y_axis")
}

/// The same with a drive on its joint.
fn driven(drive: &str) -> String {
    format!("{}\n[[drive]]\njoint = \"swing\"\n{drive}\n", slender())
}

const GEAR: &str =
    "kind = \"gearbox\"\nratio = 50.0\nmotor_inertia = 1e-4\ngearbox = { stiffness = 2e4, damping = 20.0 }";

fn answer(robot: &str, extra: &[&str]) -> Value {
    let place = Place::new();
    place.write("robot.toml", robot);
    place.json(&[&RUN[..], extra].concat())
}

fn near(a: f64, b: f64, relative: f64, what: &str) {
    assert!((a / b - 1.0).abs() < relative, "{what}: {a} instead of {b}");
}

fn sag(summary: &Value) -> f64 {
    summary["tcp"]["static_sag_m"].as_f64().unwrap()
}

mod links {
    use super::*;

    /// Truth: a clamped beam with its own weight and a weight at its end, in closed form.
    #[test]
    fn modal_links_sag_as_beams_do_and_parts_come_near() {
        let [ei, _] = stiffness();
        let truth = BALL * G * L.powi(3) / (3.0 * ei) + 1.728 / L * G * L.powi(4) / (8.0 * ei);
        let modal = answer(&slender(), &["--links", "modal"]);
        assert_eq!(modal["links_model"], "modal");
        assert_eq!(modal["warnings"], serde_json::json!([]));
        near(sag(&modal), truth, 1e-4, "modal");
        let in_file = answer(&with(&slender(), "damping", "model = \"modal\"\ndamping"), &[]);
        near(sag(&in_file), sag(&modal), 1e-12, "as the file says");
        let error = |segments: &str| 1.0 - sag(&answer(&slender(), &["--segments", segments])) / truth;
        let errors = ["2", "3", "6"].map(error);
        assert!(errors[0] > 0.05 && errors[1] < 0.5 * errors[0] && errors[2] < 0.3 * errors[1], "{errors:?}");
        // Fewer coordinates, the same first frequency.
        let few = answer(&slender(), &["--links", "modal", "--modes", "0"]);
        let hz = |summary: &Value| numbers(&summary["frequencies_hz"]);
        assert_eq!((hz(&few).len(), hz(&modal).len()), (6, 12));
        near(hz(&few)[0], hz(&modal)[0], 1e-3, "first frequency");
        let rigid = answer(&slender(), &["--links", "rigid"]);
        assert_eq!((rigid["links_model"].as_str(), sag(&rigid)), (Some("rigid"), 0.0));
    }

    /// Truth: the mesh, as accurately as its ten modes; the two-part links are slightly stiffer.
    #[test]
    fn shipped_castings_bend_in_modes() {
        let place = Place::new();
        let (robot, motion) = (shipped_robot("kr210/links.toml"), shipped_trajectory("point_to_point.toml"));
        let run = |links: &str| place.json(&["compare", &robot, &motion, "--links", links, "--no-files"]);
        let [modal, lumped] = ["modal", "lumped"].map(run);
        assert_eq!(modal["links_model"], "modal");
        let hz = |summary: &Value| numbers(&summary["frequencies_hz"])[0];
        assert!(hz(&modal) < hz(&lumped) && hz(&modal) > 0.98 * hz(&lumped));
        near(sag(&modal), sag(&lumped), 0.02, "sag");
    }

    #[test]
    fn what_the_file_does_not_hold_is_asked_for() {
        let place = Place::new();
        let (robot, motion) = (shipped_robot("test/lower_arm"), shipped_trajectory("beam_swing.toml"));
        let refused = |extra: &[&str], words: &[&str]| {
            place.refused(&[&["run", &robot, &motion, "--no-files"], extra].concat(), words);
        };
        refused(&["--segments", "5"], &["\"lower_arm\"", "no chain of 5 parts", "2, 3, 4, 8", "--chains 5"]);
        refused(&["--links", "modal", "--modes", "11"], &["11 modes", "has 10"]);
        refused(&["--segments", "1"], &["--segments"]);
        refused(&["--links", "soft"], &["rigid", "lumped", "modal"]);
        place.write("robot.toml", common::flex::robot());
        place.write("bar.flex", common::flex::text(&common::flex::stiffness_12()));
        place.refused(&[&RUN[..], &["--links", "modal"]].concat(), &["no mass", "reduce the mesh again", "lumped"]);
        place.refused(&[&RUN[..], &["--segments", "3"]].concat(), &["only two parts", "--chains 3"]);
    }
}

mod drives {
    use super::*;

    /// Truth: the spring of the gear and the bending stiffness in series under the torque of a
    /// static load.
    #[test]
    fn are_rigid_or_give_way_or_follow_a_servo() {
        let [_, ei] = stiffness();
        let load = "format = 1\n[[load]]\naxes = \"frame\"\nkind = \"step\"\nforce = [0.0, 10.0, 0.0]\n";
        let hold = "format = 1\nunit = \"rad\"\njoints = [\"swing\"]\nstart = [0.0]\nprofile = \"quintic\"\n\n[[move]]\nto = [0.001]\nduration = 0.1\nhold = 4.9\n";
        let place = Place::new();
        place.write("robot.toml", driven(GEAR));
        place.write("loads.toml", load);
        place.write("hold.toml", hold);
        // Transverse deflection at the end: the shares of drive and beam.
        let end = |words: &[&str]| {
            let run = ["compare", "robot.toml", "hold.toml", "--loads", "loads.toml", "-o", "result", "--force"];
            let summary = place.json(&[&run[..], words].concat());
            let table = common::Table::parse(&place.text("result/run.csv"));
            (*table.column("error_y_m").last().unwrap(), summary)
        };
        let bending = 10.0 * L.powi(3) / (3.0 * ei);
        let (rigid, summary) = end(&["--drives", "rigid", "--links", "modal"]);
        near(rigid, bending, 1e-4, "rigid drives");
        assert_eq!(summary["elastic_drives"], serde_json::json!([]));
        let (elastic, summary) = end(&["--drives", "elastic", "--links", "modal"]);
        near(elastic, bending + 10.0 * L * L / 2e4, 1e-4, "elastic drives");
        assert_eq!(summary["elastic_drives"][0]["joint"], "swing");
        // Deflection of the gear without the beam.
        let (alone, _) = end(&["--drives", "elastic", "--links", "rigid"]);
        near(alone, 10.0 * L * L / 2e4, 1e-4, "gear alone");
        // A servo with an integrator corrects the motor position, not the link.
        let (servo, summary) = end(&["--drives", "servo", "--links", "modal"]);
        near(servo, elastic, 0.02, "servo");
        assert_eq!(summary["elastic_drives"][0]["joint"], "swing");
        // With the drive of the file.
        near(end(&["--links", "modal"]).0, elastic, 1e-12, "as the file says");
    }
}

mod loads {
    use super::*;

    /// Rows of the table of a run under these loads.
    fn table(place: &Place, text: &str) -> common::Table {
        place.write("loads.toml", format!("format = 1\n{text}"));
        place.json(&["run", "robot.toml", "swing.toml", "--loads", "loads.toml", "-o", "result", "--force"]);
        common::Table::parse(&place.text("result/run.csv"))
    }

    /// Second way: the same force by a step, an expression and a table.
    #[test]
    fn of_three_kinds_are_the_same_force() {
        let place = Place::new();
        place.write("force.csv", "time,fz,ty\n0.2,-5,1.5\n0.8,-5,1.5\n");
        let step = table(
            &place,
            "[[load]]\nkind = \"step\"\nstart = 0.2\nend = 0.8\nforce = [0.0, 0.0, -5.0]\ntorque = [0.0, 1.5, 0.0]\n",
        );
        let words =
            table(&place, "[[load]]\nkind = \"expression\"\nstart = 0.2\nend = 0.8\nfz = \"-5\"\nty = \"1+1/2\"\n");
        let rows = table(&place, "[[load]]\nkind = \"table\"\nfile = \"force.csv\"\n");
        let none = table(&place, "");
        for name in ["flexible_z_m", "flexible_y_m", "bar_ry_rad"] {
            let (a, b, c, d) = (step.column(name), words.column(name), rows.column(name), none.column(name));
            assert_eq!((&a, &b), (&b, &c), "{name}");
            assert_eq!(a[..100], d[..100], "{name} before the load");
            assert!(name == "flexible_y_m" || a[200] != d[200], "{name} under the load");
        }
    }

    /// Truth: at rest, a payload of the same weight from the start.
    #[test]
    fn payloads_are_picked_and_dropped() {
        let place = Place::new();
        let motion = "format = 1\nunit = \"rad\"\njoints = [\"swing\"]\nstart = [0.0]\nprofile = \"quintic\"\n\n[[move]]\nto = [0.0001]\nduration = 0.1\nhold = 4.9\n";
        place.write("swing.toml", motion);
        let picked = table(&place, "[[payload]]\nat = 0.5\nmass = 2.0\n");
        let dropped = table(&place, "[[payload]]\nat = 0.5\nmass = 2.0\n[[payload]]\nat = 1.0\nmass = 0.0\n");
        let bare = table(&place, "");
        let end = |table: &common::Table| *table.column("flexible_z_m").last().unwrap();
        let payload = "\npayload = { link = \"ball\", mass = 2.0, com = [0.0, 0.0, 0.0] }\ngravity";
        place.write("robot.toml", with(ROBOT, "\ngravity", payload));
        near(end(&picked), end(&table(&place, "")), 1e-4, "picked");
        near(end(&dropped), end(&bare), 1e-4, "dropped");
    }
}

/// A robot file that is refused at the line with `piece`, and the column of the value if that is
/// known.
fn robot_file(text: &str, piece: &str, words: &[&str]) {
    let place = Place::new();
    place.write("robot.toml", text);
    let here = format!("robot.toml:{}:", line_of(text, piece));
    place.refused(&["compare", "robot.toml", "swing.toml", "-o", "result"], &[&[here.as_str()], words].concat());
}

mod bad_robot_files {
    use super::*;

    #[test]
    fn models_of_links() {
        let key = |line: &str| with(ROBOT, "damping", &format!("{line}\ndamping"));
        robot_file(&key("model = \"rigid\""), "model =", &[":10:9:", "\"rigid\"", "\"lumped\"", "\"modal\""]);
        robot_file(&key("segments = 1"), "segments", &["segments = 1", "at least 2"]);
        robot_file(&key("segments = 2.5"), "segments", &["2.5"]);
        robot_file(&key("modes = -1"), "modes =", &["modes = -1", "at least 0"]);
        robot_file(&key("eigenmodes = 0"), "eigenmodes", &["eigenmodes = 0", "at least 1"]);
        robot_file(&key("model = \"modal\"\neigenmodes = 99"), "eigenmodes", &["99", "up to 12"]);
        robot_file(&key("model = \"modal\"\nmodes = 5000"), "modes =", &["modes"]);
        robot_file(&key("geometric_stiffening = 1"), "geometric", &["boolean"]);
        robot_file(&key("geometric_stifening = true"), "geometric", &["`geometric_stiffening`"]);
        robot_file(&with(ROBOT, "modal = 0.03", "rayleigh = [1.0]"), "damping", &["2"]);
        robot_file(&with(ROBOT, "modal = 0.03", "rayleigh = [1.0, -1e-5]"), "damping", &["positive"]);
        robot_file(&with(ROBOT, "modal = 0.03", "rayleigh = [0.0, 1e-5], modal = 0.1"), "damping", &["exactly one"]);
    }

    #[test]
    fn links_whose_file_does_not_hold_it() {
        let place = Place::new();
        place.write("bar.flex", common::flex::text(&common::flex::stiffness_12()));
        for (line, words) in [
            ("model = \"modal\"", &["no mass", "reduce the mesh again"][..]),
            ("segments = 4", &["no chain of 4 parts", "--chains 4"]),
        ] {
            let text = with(&common::flex::robot(), "damping", &format!("{line}\ndamping"));
            place.write("robot.toml", &text);
            let here = format!("robot.toml:{}:", line_of(&text, line));
            place.refused(&RUN, &[&[here.as_str()], words].concat());
        }
    }

    #[test]
    fn drives() {
        let text = |line: &str| format!("{ROBOT}\n[[drive]]\njoint = \"swing\"\n{line}\n");
        let gear = |entry: &str| text(&format!("kind = \"gearbox\"\ngearbox = {{ {entry} }}"));
        robot_file(&text("kind = \"geared\""), "kind", &["\"geared\"", "\"prescribed\"", "\"gearbox\"", "\"torque\""]);
        robot_file(&text("kind = \"gearbox\""), "kind", &["needs gearbox"]);
        robot_file(&text(""), "[[drive]]", &["missing field `kind`"]);
        robot_file(&text("kind = \"prescribed\"\nratio = 0.0"), "ratio", &["ratio is 0", "turns"]);
        robot_file(&text("kind = \"prescribed\"\nmotor_inertia = -1.0"), "motor_inertia", &["-1", "at least 0"]);
        robot_file(&text("kind = \"torque\"\ntorque_limit = nan"), "torque_limit", &["NaN"]);
        robot_file(&text("kind = \"prescribed\"\nrato = 3.0"), "rato", &["`rato`", "`ratio`"]);
        robot_file(&gear("damping = 1.0"), "gearbox = {", &["stiffness = N m/rad", "curve"]);
        robot_file(&gear("stiffness = -1.0"), "gearbox = {", &["positive"]);
        robot_file(&gear("stiffness = [1.0, 2.0]"), "gearbox = {", &["one number, 3, 6 or a 6x6"]);
        robot_file(&gear("stiffness = \"stiff\""), "gearbox = {", &["a number, a list of 3 or 6"]);
        robot_file(&gear("stiffness = 1e4, damping = [1.0, 2.0, 3.0]"), "gearbox = {", &["damping takes one number"]);
        robot_file(&gear("stiffness = 1e4, damping = -1.0"), "gearbox = {", &["damping must be 0 or above"]);
        robot_file(&gear("stiffness = 1e4, backlash = -1e-3"), "gearbox = {", &["backlash = -0.001", "0 or above"]);
        robot_file(&gear("stiffness = 1e4, curve = [[0.0, 0.0], [1.0, 1.0]]"), "gearbox = {", &["one of them"]);
        robot_file(&gear("curve = [[0.0, 0.0], [1.0, -1.0]]"), "gearbox = {", &["curve"]);
        robot_file(&text("kind = \"prescribed\"\nfriction = { coulomb = -1.0 }"), "friction", &["at least 0"]);
        robot_file(&text("kind = \"torque\"\nservo = { position_gain = -1.0 }"), "servo", &["0 or above"]);
        robot_file(&text("kind = \"torque\"\nservo = { sample_s = 0.0 }"), "servo", &["positive time"]);
        let spring = "kind = \"torque\"\ngearbox = { stiffness = 1e4 }";
        robot_file(&text(spring), "kind", &["motor_inertia"]);
        robot_file(
            &format!(
                "{}{}",
                text("kind = \"prescribed\""),
                "\n[[drive]]\njoint = \"swing\" # again\nkind = \"prescribed\"\n"
            ),
            "# again",
            &["two [[drive]]"],
        );
    }
}

mod contradictions {
    use super::*;

    /// Options that no link uses are refused, not ignored.
    #[test]
    fn segments_and_modes_need_links_of_their_kind() {
        let place = Place::new();
        place.write("robot.toml", slender());
        let refused = |extra: &[&str], words: &[&str]| place.refused(&[&RUN[..], extra].concat(), words);
        refused(&["--links", "rigid", "--segments", "3"], &["3 segments", "no link", "--links lumped"]);
        refused(&["--links", "modal", "--segments", "3"], &["3 segments", "no link", "--links lumped"]);
        refused(&["--modes", "3"], &["3 modes", "no link", "--links modal"]);
        refused(&["--links", "lumped", "--modes", "3"], &["3 modes", "no link", "--links modal"]);
    }

    /// Truth: beyond the backlash a linear spring carries the drive load; the energy is that of the
    /// linear part.
    #[test]
    fn statics_tell_the_load_behind_a_play() {
        let place = Place::new();
        let gear = "kind = \"gearbox\"\ngearbox = { stiffness = 1e4, damping = 5.0, backlash = 1e-3 }";
        place.write("robot.toml", driven(gear));
        let run = ["statics", "robot.toml", "--links", "rigid", "--wrench", "0,10,0"];
        let found = place.json(&run);
        let element = &found["elements"][0];
        let (load, holding) = (numbers(&element["load"])[0], numbers(&found["holding_torque"])[0]);
        near(load, -holding, 1e-9, "load");
        near(element["energy_j"].as_f64().unwrap(), 0.5 * load * load / 1e4, 1e-9, "energy");
        near(numbers(&element["deflection"])[0].abs(), 1e-3 + load.abs() / 1e4, 1e-9, "deflection");
    }
}

mod bad_loads_files {
    use super::*;

    fn refused(text: &str, piece: &str, words: &[&str]) {
        let place = Place::new();
        place.write("loads.toml", text);
        let here = format!("loads.toml:{}:", line_of(text, piece));
        place.refused(&[&RUN[..], &["--loads", "loads.toml"]].concat(), &[&[here.as_str()], words].concat());
    }

    #[test]
    fn values_and_words() {
        let load = |lines: &str| format!("format = 1\n\n[[load]]\n{lines}\n");
        let at = "[[load]]";
        refused("format = 2\n", "format", &["format is 2", "format 1"]);
        refused("[[load]]\nkind = \"step\"\n", "[[load]]", &["missing field `format`"]);
        refused("format = 1\nload = 3\n", "load = 3", &[":2:8:", "sequence"]);
        refused(&load("kind = \"step\"\nforse = [1.0, 0.0, 0.0]"), "forse", &["`forse`", "`force`"]);
        refused(&load("kind = \"step\"\nforce = [1.0, 0.0]"), "force", &["3"]);
        refused(&load("kind = \"step\"\nforce = [1.0, nan, 0.0]"), at, &["NaN", "finite"]);
        refused(&load("force = [1.0, 0.0, 0.0]"), at, &["missing field `kind`"]);
        refused(&load("kind = \"stepp\""), "kind", &["\"stepp\"", "step, impulse, sine, sweep, milling, table"]);
        refused(&load("kind = \"step\"\nframe = \"base\""), "frame", &["\"base\"", "\"tcp\"", "\"ball\""]);
        refused(&load("kind = \"step\"\naxes = \"tool\""), "axes", &["\"tool\"", "\"world\"", "\"frame\""]);
        refused(&load("kind = \"step\"\nstart = 2.0\nend = 1.0"), "end", &["ends at 1 s", "starts at 2 s"]);
        refused(&load("kind = \"impulse\""), "kind", &["\"impulse\" needs duration"]);
        refused(&load("kind = \"impulse\"\nduration = 0.0"), "duration", &["duration = 0", "positive"]);
        refused(&load("kind = \"sine\""), "kind", &["\"sine\" needs frequency"]);
        refused(&load("kind = \"sweep\"\nfrom = 1.0"), "kind", &["\"sweep\" needs to"]);
        refused(&load("kind = \"milling\"\nspindle_rpm = 6000.0"), "kind", &["\"milling\" needs teeth"]);
        refused(&load("kind = \"milling\"\nteeth = 4"), "kind", &["\"milling\" needs spindle_rpm"]);
        refused(&load("kind = \"milling\"\nteeth = 0\nspindle_rpm = 6000.0"), at, &["teeth = 0", "cutting edges"]);
        refused(&load("kind = \"step\"\nfrequency = 3.0"), at, &["\"step\" takes no frequency", "sine"]);
        refused(&load("kind = \"expression\"\nfx = \"1\"\nforce = [1.0, 0.0, 0.0]"), at, &["takes no force"]);
        refused(&load("kind = \"table\""), "kind", &["\"table\" needs file"]);
        refused(&load("kind = \"expression\""), "kind", &["needs some of fx"]);
        refused(&load("kind = \"expression\"\nfx = \"2*(t\""), "fx", &["2*(t"]);
        refused(&load("kind = \"expression\"\nfx = \"2*x\""), "fx", &["\"x\"", "only t"]);
        refused(&load("kind = \"expression\"\nfx = \"1/0\""), "fx", &["not a finite number"]);
        refused(&load("kind = \"expression\"\nfx = \"ln(t)\""), "fx", &["not a finite number at t = 0 s"]);
    }

    /// Of two columns with the same name the last used to win silently.
    #[test]
    fn a_column_twice_is_refused() {
        let place = Place::new();
        place.write("loads.toml", "format = 1\n[[load]]\nkind = \"table\"\nfile = \"force.csv\"\n");
        for (header, name) in [("time,fx,fx", "fx"), ("time,fx,time", "time")] {
            place.write("force.csv", format!("{header}\n0,1,2\n1,1,2\n"));
            let words = ["force.csv", &format!("{name:?} twice")];
            place.refused(&[&RUN[..], &["--loads", "loads.toml"]].concat(), &words);
        }
    }

    /// Loads without effect, or that fall between steps, are reported.
    #[test]
    fn doubts() {
        let place = Place::new();
        let warned = |text: &str, words: &[&str]| {
            place.write("loads.toml", format!("format = 1\n{text}\n"));
            let summary = place.json(&[&RUN[..], &["--loads", "loads.toml"]].concat());
            let warnings = summary["warnings"].to_string();
            assert!(words.iter().all(|w| warnings.contains(w)), "{text}: {warnings}");
        };
        warned("[[load]]\nkind = \"step\"\nstart = 99.0\nforce = [1.0, 0.0, 0.0]", &["99 s", "does nothing"]);
        warned("[[payload]]\nat = 99.0\nmass = 1.0", &["99 s", "stays as it is"]);
        let sine = "[[load]]\nkind = \"sine\"\nfrequency = 500.0\nforce = [1.0, 0.0, 0.0]";
        warned(sine, &["500.0 Hz", "2.0 steps per period"]);
        // An expression is checked only where it acts.
        warned("[[load]]\nkind = \"expression\"\nstart = 0.6\nfx = \"sqrt(t-0.6)\"", &[]);
    }

    /// Truth: stored energy equals supplied energy, including the energy that leaves with a
    /// payload.
    #[test]
    fn a_payload_that_is_dropped_takes_its_energy_along() {
        let place = Place::new();
        place.write("loads.toml", "format = 1\n[[payload]]\nat = 0.5\nmass = 2.0\n[[payload]]\nat = 1.0\nmass = 0.0\n");
        let summary = place.json(&[&RUN[..], &["--loads", "loads.toml", "--log-rate", "1000"]].concat());
        assert!(summary["energy"]["imbalance"].as_f64().unwrap() < 1e-2, "{}", summary["energy"]);
    }

    #[test]
    fn payloads() {
        let payload = |lines: &str| format!("format = 1\n\n[[payload]]\n{lines}\n");
        let at = "[[payload]]";
        refused(&payload("at = 0.5"), at, &["missing field `mass`"]);
        refused(&payload("at = -0.5\nmass = 1.0"), at, &["at least 0"]);
        refused(&payload("at = 0.5\nmass = -1.0"), at, &["at least 0"]);
        refused(&payload("at = 0.5\nmass = 1.0\nlink = \"hand\""), "link", &["\"hand\"", "moves", "\"ball\""]);
        refused(&payload("at = 0.5\nmass = 1.0\ninertia = [-1.0, 1.0, 1.0, 0.0, 0.0, 0.0]"), "inertia", &["negative"]);
    }

    #[test]
    fn files_and_tables() {
        let place = Place::new();
        let run = [&RUN[..], &["--loads", "loads.toml"]].concat();
        place.refused(&run, &["loads.toml", "cannot be read"]);
        place.write("loads.toml", "format = 1\n[[load]]\nkind = \"table\"\nfile = \"force.csv\"\n");
        place.refused(&run, &["force.csv"]);
        for (text, words) in [
            ("t,fx\n0,1\n1,1\n", &["header", "expected time"][..]),
            ("time,fx,fw\n0,1,1\n1,1,1\n", &["header", "fw"]),
            ("time,fx\n0,1\n1,one\n", &["force.csv:3:3", "column \"fx\"", "\"one\""]),
            ("time,fx\n0,1\n1\n", &["force.csv:3:1", "expected 2 cells"]),
            ("time,fx\n0,1\n0,2\n", &["force.csv:3:1", "does not rise"]),
            ("time,fx\n0,1\n", &["at least two rows"]),
        ] {
            place.write("force.csv", text);
            place.refused(&run, &[&["force.csv"], words].concat());
        }
    }
}

/// Truth: forward kinematics, and equal impulses move an arm alike for any duration; steps of 20 us
/// resolve all of it.
#[test]
fn an_impulse_within_one_step_acts_as_it_does_in_fine_steps() {
    let place = Place::new();
    place.write("robot.toml", slender());
    let peak = |duration: f64, extra: &[&str]| {
        let load = "[[load]]\nkind = \"impulse\"\nstart = 0.70037\nforce = [0.0, 0.0, 0.5]\n";
        place.write("blow.toml", format!("format = 1\n{load}duration = {duration}\n"));
        let found = place.json(&[&RUN[..], &["--loads", "blow.toml"], extra].concat());
        found["tcp"]["peak_m"].as_f64().unwrap()
    };
    for duration in [1e-4, 5e-4, 1e-3, 2e-3, 5e-3] {
        let (coarse, fine) = (peak(duration, &[]), peak(duration, &["--step", "2e-5"]));
        near(coarse, fine, 0.02, &format!("peak of an impulse of {duration} s"));
    }
}

/// Truth: by hand, x = cos 0.2 + 0.8 cos 1.2 and z = -sin 0.2 - 0.8 sin 1.2. The joint of the
/// camera is on the near half of the flexible link and listed after the one at its end.
#[test]
fn joints_have_their_values_whichever_half_of_a_flexible_link_carries_them() {
    let place = Place::new();
    let link = |name: &str, mass: f64, x: f64| {
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"{x} 0 0\"/><mass value=\"{mass}\"/><inertia ixx=\"0.05\" iyy=\"0.1\" izz=\"0.1\" \
             ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
        )
    };
    let joint = |name: &str, [parent, child]: [&str; 2], x: f64, axis: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"{x} 0 0\"/>\
             <axis xyz=\"{axis}\"/><limit lower=\"-3\" upper=\"3\" effort=\"1000\" velocity=\"5\"/></joint>"
        )
    };
    let urdf = [
        "<robot name=\"branch\"><link name=\"base\"/>".into(),
        link("arm", 10.0, 0.5),
        link("fore", 5.0, 0.4),
        link("camera", 1.0, 0.0),
        joint("shoulder", ["base", "arm"], 0.0, "0 1 0"),
        joint("elbow", ["arm", "fore"], 1.0, "0 1 0"),
        joint("pan", ["arm", "camera"], 0.2, "0 0 1"),
        "</robot>".into(),
    ];
    place.write("branch.urdf", urdf.concat());
    let robot = "format = 1\nurdf = \"branch.urdf\"\ntcp = { link = \"fore\", xyz = [0.8, 0.0, 0.0] }\n[[flexible_link]]\nlink = \"arm\"\n\
                 distal = \"elbow\"\ndamping = { stiffness_beta = 5e-4 }\n\
                 beam = { section = \"tube\", outer_diameter = 0.08, wall = 0.004, material = \"aluminium\", parts = \"uniform\" }\n";
    place.write("branch.toml", robot);
    let motion = "format = 1\nunit = \"rad\"\njoints = [\"shoulder\", \"elbow\", \"pan\"]\nstart = [0.0, 0.0, 0.0]\n[[move]]\n\
                  to = [0.2, 1.0, -0.5]\nduration = 1.0\nhold = 0.5\n";
    place.write("branch_motion.toml", motion);
    for links in ["lumped", "modal"] {
        let statics =
            place.json(&["statics", "branch.toml", "--links", links, "--at", "shoulder=0.2,elbow=1,pan=-0.5"]);
        assert_eq!(numbers(&statics["at"]), [0.2, 1.0, -0.5]);
        assert_eq!(statics["joints"], serde_json::json!(["shoulder", "elbow", "pan"]));
        place.json(&["compare", "branch.toml", "branch_motion.toml", "--links", links, "-o", "result", "--force"]);
        let table = common::Table::parse(&place.text("result/run.csv"));
        let last = |name: &str| *table.column(name).last().unwrap();
        for (column, value) in [
            ("rigid_x_m", 0.2f64.cos() + 0.8 * 1.2f64.cos()),
            ("rigid_z_m", -0.2f64.sin() - 0.8 * 1.2f64.sin()),
            ("elbow_position_rad", 1.0),
            ("pan_position_rad", -0.5),
        ] {
            assert!((last(column) - value).abs() < 1e-9, "{column}: {} instead of {value}", last(column));
        }
    }
}

/// An arm at rest: its energy changes only by rounding, nothing oscillates.
#[test]
fn an_arm_that_stands_still_neither_swings_nor_loses_energy() {
    let place = Place::new();
    place.write("still.csv", "time,swing\n0,0.3\n0.5,0.3\n1,0.3\n");
    for extra in [&[][..], &["--links", "modal"]] {
        let found = place.json(&[&["compare", "robot.toml", "still.csv", "--no-files"], extra].concat());
        assert!(found["tcp"]["dominant_hz"].is_null(), "{}", found["tcp"]);
        assert!(found["energy"]["imbalance"].as_f64().unwrap() < 1e-3, "{}", found["energy"]);
    }
}
