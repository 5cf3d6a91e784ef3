//! Slips in strengths, gauges, guides, calibrations, mountings and sections: each has its caveat, and
//! the robot without the slip has none of them.

use std::path::{Path, PathBuf};

use flexarm_run::{LoadOptions, Modelling, Motion, Robot, RunOptions, Scenario, check, check_with_loads};

/// A folder that is removed at the end.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-entries-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// Codes of the warnings and errors of `check`, with the guess of each.
    fn told(&self, text: &str) -> Vec<(String, String)> {
        let file = self.0.join("robot.toml");
        std::fs::write(&file, text).unwrap();
        let found = check(&file, None, &LoadOptions::default()).into_iter();
        found
            .filter(|f| f.severity != flexarm_run::Severity::Note && f.code != "missing-mesh")
            .map(|f| (f.code, f.message))
            .collect()
    }

    fn tries(&self, sound: &str, slips: &[(&str, &str, &str, &str)]) {
        let before = self.told(sound);
        assert_eq!(before, [], "without a slip");
        for (from, to, code, part) in slips {
            assert!(sound.contains(from), "{from}");
            let told = self.told(&sound.replace(from, to));
            println!("{to}: {told:?}");
            assert!(told.iter().any(|(of, message)| of == code && message.contains(part)), "{to}: {told:?}");
        }
    }
}

const STRENGTH: &str = "strength = { yield = 3.55e8, tensile = 5.1e8, fatigue = 2.1e8 }";

#[test]
fn slips_in_strengths_gauges_and_damping_of_a_beam_are_told() {
    let folder = Folder::new("beam");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().join("robots/test/one_beam");
    std::fs::copy(shipped.join("one_beam.urdf"), folder.0.join("one_beam.urdf")).unwrap();
    let text = std::fs::read_to_string(shipped.join("robot.toml")).unwrap();
    let kept = text.lines().filter(|line| !line.starts_with("default_trajectory") && !line.starts_with("damping"));
    let text: String = kept.map(|line| format!("{line}\n")).collect();
    let model = "model = \"lumped\"";
    assert!(text.contains(model));
    let text = text.replace(model, &format!("stress = true\ndamping = {{ modal = 0.03 }}\n{STRENGTH}"));
    let gauge = "\n[[strain_gauge]]\nname = \"root\"\nlink = \"beam_1\"\nat = [0.1, 0.01, 0.0]\n\
                 direction = [1.0, 0.0, 0.0]\nangles_deg = [0.0, 45.0, 90.0]\n";
    let sound = text + gauge;
    folder.tries(
        &sound,
        &[
            ("yield = 3.55e8, tensile = 5.1e8", "yield = 3.55e11, tensile = 5.1e11", "strength", "GPa for MPa?"),
            (
                "yield = 3.55e8, tensile = 5.1e8, fatigue = 2.1e8",
                "yield = 355, tensile = 510, fatigue = 210",
                "strength",
                "MPa?",
            ),
            ("fatigue = 2.1e8", "fatigue = 0.43", "fatigue-strength", "a ratio to the tensile strength?"),
            ("fatigue = 2.1e8", "fatigue = 210", "fatigue-strength", "MPa?"),
            ("fatigue = 2.1e8", "fatigue = 5.1e8", "fatigue-strength", "1 times the tensile strength"),
            ("[0.0, 45.0, 90.0]", "[0.0, 0.785, 1.571]", "gauge-angle", "radians?"),
            ("[0.1, 0.01, 0.0]", "[0.1, 0.06, 0.0]", "gauge-place", "0.06 m from the axis"),
            ("[0.1, 0.01, 0.0]", "[400.0, 10.0, 0.0]", "gauge-place", "millimetres?"),
            ("modal = 0.03", "modal = 3e-4", "damping-ratio", "divided by 100 twice?"),
        ],
    );
}

#[test]
fn slips_in_guides_calibrations_and_mountings_are_told() {
    let folder = Folder::new("lift");
    std::fs::write(folder.0.join("lift.urdf"), include_str!("data/lift.urdf")).unwrap();
    let sound = "format = 1\nurdf = \"lift.urdf\"\ntcp = { link = \"tcp\" }\n\
                 [[drive]]\njoint = \"lift\"\nkind = \"gearbox\"\ngearbox = { guide = { outer_end = 2.5, inner_end = 0.0, \
                 x = { compliance = [1e-6, 4e-7, 3e-7], play = { gap = 1e-4, centre = 3.0, width = 20.0 } }, \
                 y = { compliance = [1e-6, 4e-7, 3e-7] } } }\n\
                 [[calibration]]\njoint = \"turn\"\nzero = 0.003\nrpy = [0.002, 0.0, 0.0]\nxyz = [0.001, 0.0, 0.0]\n\
                 [mounting]\nstiffness = [1e8, 1e8, 1e8, 1e7, 1e7, 1e7]\nmass = 100.0\n";
    folder.tries(
        sound,
        &[
            ("outer_end = 2.5", "outer_end = 2500", "guide-end", "millimetres?"),
            ("inner_end = 0.0", "inner_end = -1400", "guide-end", "of the guide of joint \"lift\""),
            ("[1e-6, 4e-7, 3e-7], play", "[1e-12, 4e-13, 3e-13], play", "guide-tilt", "x.compliance"),
            ("width = 20.0", "width = 0.02", "guide-play", "x.play.width"),
            ("centre = 3.0", "centre = 3e6", "guide-play", "x.play.centre"),
            ("zero = 0.003", "zero = -0.18", "calibration", "degrees?"),
            ("rpy = [0.002, 0.0, 0.0]", "rpy = [1.2, 0.0, 0.0]", "calibration", "degrees?"),
            ("xyz = [0.001, 0.0, 0.0]", "xyz = [1.0, 0.0, 0.0]", "calibration", "millimetres?"),
            ("[1e8, 1e8, 1e8, 1e7, 1e7, 1e7]", "[1e14, 1e14, 1e14, 1e13, 1e13, 1e13]", "mounting-stiff", "uN/m?"),
        ],
    );
}

#[test]
fn an_expression_that_the_steps_do_not_resolve_is_told() {
    let folder = Folder::new("expression");
    let robot =
        Robot::load(Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().join("robots/test/one_beam"))
            .unwrap();
    let motion = Motion::from_samples(&[0.0, 0.1, 0.2], &[0.0, 0.0, 0.0], &robot).unwrap();
    let told = |fz: &str| {
        let file = folder.0.join("loads.toml");
        std::fs::write(&file, format!("format = 1\n[[load]]\nkind = \"expression\"\nfz = {fz:?}\n")).unwrap();
        let scenario = Scenario::new(motion.clone()).with_loads_file(&file).unwrap();
        let options = RunOptions { step_s: 1e-3, ..RunOptions::default() };
        let run = robot.model(&Modelling::default()).unwrap().simulate(&scenario, &options).unwrap();
        run.summary.caveats.into_iter().filter(|of| of.code == "short-load").map(|of| of.message).collect::<Vec<_>>()
    };
    assert_eq!(told("sin(125.66370614359172*t)"), [""; 0]);
    let found = told("0.1*sin(18849.55592153876*t)");
    assert!(found.len() == 1 && found[0].contains("3000.0 Hz has 0.3 steps per period"), "{found:?}");
}

/// The drives of kr210 with entries that need no robot to compare with, and entries of all kinds.
fn drives_with_entries() -> String {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let text = std::fs::read_to_string(project.join("robots/kr210/drives.toml")).unwrap();
    let kept = text.lines().filter(|line| !line.starts_with("default_trajectory"));
    let text: String = kept.map(|line| format!("{line}\n")).collect();
    let servo = "kind = \"torque\"\nratio = 200.0\nmotor_inertia = 0.01\ntorque_limit = 3000.0\n\
                 servo = { position_gain = 20.0, velocity_gain = 40000.0 }\n\
                 friction = { coulomb = 60.0, stribeck = 20.0, stribeck_velocity = 0.05, regularisation = 0.01 }\n";
    let urdf = project.join("robots/kr210/kr210.urdf");
    let text = text.replace("\"kr210.urdf\"", &format!("{urdf:?}"));
    let text = text.replacen("kind = \"gearbox\"\n", servo, 1);
    let text = text.replace(
        "{ stiffness = 2775692.4, damping = 1232.3 }",
        "{ stiffness = [2e7, 2e7, 2775692.4], damping = [5000.0, 5000.0, 1232.3] }",
    );
    text + "[mounting]\nstiffness = [1e9, 1e9, 1e9, 1e8, 1e8, 1e8]\nxyz = [0.0, 0.0, -0.3]\nrpy = [0.0, 0.0, 0.785]\n\
            backlash = [1e-5, 1e-5, 1e-5, 0.0, 0.0, 0.0]\nmass = 400.0\ncom = [0.0, 0.0, -0.2]\n\
            inertia = [20.0, 20.0, 20.0, 0.0, 0.0, 0.0]\n\
            [[balancer]]\njoint = \"joint_2\"\nsine = { torque = 300.0, zero = 1.57 }\n\
            [[balancer]]\nfrom = { link = \"link_1\", xyz = [0.0, 0.3, 0.1] }\n\
            to = { link = \"link_2\", xyz = [0.7, 0.0, 0.3] }\n\
            gas_spring = { force = 900.0, length = 2.0, stroke = 1.5, progression = 1.4 }\n\
            [[balancer]]\njoint = \"joint_3\"\ncurve = [[-2.4, 50.0], [0.0, 0.0], [2.6, -50.0]]\n\
            [[controller_axis]]\njoint = \"joint_2\"\nzero = 1.5708\n\
            [[controller_axis]]\njoint = \"joint_3\"\nzero_deg = -90.0\n"
}

#[test]
fn slips_in_mountings_balancers_axes_and_drives_are_told() {
    let folder = Folder::new("usual");
    folder.tries(
        &drives_with_entries(),
        &[
            ("xyz = [0.0, 0.0, -0.3]", "xyz = [0.0, 0.0, -300]", "unusual", "mounting.xyz is 300 m"),
            ("rpy = [0.0, 0.0, 0.785]", "rpy = [0.0, 0.0, 45]", "angle", "degrees?"),
            ("backlash = [1e-5, ", "backlash = [0.1, ", "unusual", "mounting.backlash is 0.1 m or rad"),
            ("com = [0.0, 0.0, -0.2]", "com = [0.0, 0.0, -200]", "unusual", "mounting.com"),
            ("inertia = [20.0, 20.0, 20.0", "inertia = [2e7, 2e7, 2e7", "unusual", "radius of gyration of mounting"),
            ("zero = 1.57 }", "zero = 90.0 }", "angle", "degrees?"),
            ("length = 2.0, stroke = 1.5", "length = 2000, stroke = 1500", "unusual", "balancer.gas_spring.stroke"),
            ("force = 900.0", "force = 0.9", "balancer-weak", "kN"),
            ("[[-2.4, 50.0], [0.0, 0.0], [2.6,", "[[-138.0, 50.0], [0.0, 0.0], [149.0,", "angle", "degrees?"),
            ("zero = 1.5708", "zero = 90.0", "angle", "controller_axis.zero"),
            ("zero_deg = -90.0", "zero_deg = -1.5708", "unusual", "radians?"),
            ("position_gain = 20.0", "position_gain = 0.02", "position-gain", "0.02 1/s"),
            ("velocity_gain = 40000.0", "velocity_gain = 40.0", "velocity-gain", "kN m s/rad?"),
            ("position_gain = 20.0", "position_gain = 20.0, integral_gain = 50.0", "unusual", "integral over"),
            ("position_gain = 20.0", "position_gain = 20.0, integral_gain = 5e9", "unusual", "integral over"),
            ("torque_limit = 3000.0", "torque_limit = 3e6", "unusual", "torque_limit of joint \"joint_1\""),
            ("regularisation = 0.01", "regularisation = 1e-9", "unusual", "drive.friction.regularisation"),
            ("stribeck_velocity = 0.05", "stribeck_velocity = 57.0", "friction-smoothing", "degrees?"),
            ("damping = [5000.0, ", "damping = [0.005, ", "gear-damping", "joint \"joint_3\""),
        ],
    );
}

/// A decimal comma makes one value two: `[0, 0, 0,35]`. A list that is too long loses none of its
/// values without a word.
#[test]
fn lists_that_are_longer_than_their_keys_take_are_refused() {
    let folder = Folder::new("lists");
    let sound = drives_with_entries();
    let refused = "expected 3: leave the others out; decimals have a point";
    folder.tries(
        &sound,
        &[
            ("xyz = [0.0, 0.0, 0.35]", "xyz = [0, 0, 0,35]", "robot-file", refused),
            ("gravity = [0.0, 0.0, -9.81]", "gravity = [0, 0, -9,81]", "robot-file", refused),
            ("com = [0.0, 0.0, 0.25]", "com = [0.0, 0.0, 0.0, 0.25]", "robot-file", refused),
            ("6.25, 0.0, 0.0, 0.0]", "6.25, 0.0, 0.0, 0.0, 0.0]", "robot-file", "the list has 7 values, expected 6"),
            (
                "from = { link = \"link_1\", xyz = [0.0,",
                "from = { link = \"link_1\", xyz = [0,0, 0,",
                "robot-file",
                "5 values",
            ),
            ("curve = [[-2.4, 50.0]", "curve = [[-2,4, 50.0]", "robot-file", "the list has 3 values, expected 2"),
            (
                "gearbox = { stiffness = 3376721.9",
                "gearbox = { seat = [1e7, 1e7, 1e7], stiffness = 3376721.9",
                "robot-file",
                "3 values",
            ),
        ],
    );
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let (loads, path) = (folder.0.join("loads.toml"), folder.0.join("path.toml"));
    std::fs::write(&loads, "format = 1\n[[load]]\nkind = \"step\"\nforce = [0,0, 0.0, -200.0]\n").unwrap();
    let text = std::fs::read_to_string(project.join("trajectories/milling_square.toml")).unwrap();
    std::fs::write(&path, text.replacen("line = [300.0, 0.0, 0.0]", "line = [300,0, 0.0, 0.0]", 1)).unwrap();
    let robot = project.join("robots/kr210/robot.toml");
    for (motion, loads) in [(None, Some(&*loads)), (Some(&*path), None)] {
        let found = check_with_loads(&robot, motion, loads, &LoadOptions::default());
        assert!(
            found.iter().any(|f| f.severity == flexarm_run::Severity::Error && f.message.contains(refused)),
            "{found:?}"
        );
    }
}

/// Seat and shaft turn the same link about the same axes: the message names them, not a link that
/// lacks a mass.
#[test]
fn a_seat_beside_three_stiffnesses_is_named_as_modes_need_inertia_between_them() {
    let folder = Folder::new("seat");
    let sound = drives_with_entries();
    let three = "gearbox = { seat = [1e7, 1e7], stiffness = [1e7, 1e7, 3376721.9], damping = [1e3, 1e3, 4481.0] }";
    folder.tries(
        &sound,
        &[(
            "gearbox = { stiffness = 3376721.9, damping = 4481.0 }",
            three,
            "seat-inertia",
            "its seat and its three stiffnesses",
        )],
    );
}

#[test]
fn limits_of_a_urdf_in_other_units_are_told() {
    let folder = Folder::new("limits");
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let text = std::fs::read_to_string(project.join("robots/kr210/drives.toml")).unwrap();
    let text = text.lines().filter(|line| !line.starts_with("default_trajectory")).collect::<Vec<_>>().join("\n");
    let urdf = std::fs::read_to_string(project.join("robots/kr210/kr210.urdf")).unwrap();
    // Multiplies the values of some attributes of <limit>.
    let scaled = |keys: &[&str], factor: f64| {
        let change = |original: &str| {
            let mut line = original.to_owned();
            for key in keys.iter().filter(|_| original.contains("<limit ")) {
                let Some((before, rest)) = line.split_once(&format!("{key}=\"")) else { continue };
                let (value, after) = rest.split_once('"').unwrap();
                let value = value.parse::<f64>().unwrap() * factor;
                line = format!("{before}{key}=\"{value}\"{after}");
            }
            line + "\n"
        };
        urdf.lines().map(change).collect::<String>()
    };
    let told = |urdf: &str| {
        std::fs::write(folder.0.join("kr210.urdf"), urdf).unwrap();
        std::fs::write(folder.0.join("robot.toml"), &text).unwrap();
        let found = check(&folder.0.join("robot.toml"), None, &LoadOptions::default());
        let limits = found.into_iter().filter(|f| ["speed-limit", "joint-range"].contains(&f.code.as_str()));
        limits.map(|f| f.message).collect::<Vec<_>>()
    };
    assert_eq!(told(&urdf), [""; 0]);
    let (turn, degree) = (60.0 / std::f64::consts::TAU, 180.0 / std::f64::consts::PI);
    for (keys, factor, number, part) in [
        (&["velocity"][..], turn, 5, "1/min?"),
        (&["velocity"], degree, 6, "degrees?"),
        (&["velocity"], 1.0 / degree, 1, "converted to radians twice?"),
        (&["lower", "upper"], degree, 6, "degrees?"),
        (&["lower", "upper"], 1.0 / degree, 4, "converted to radians twice?"),
    ] {
        let found = told(&scaled(keys, factor));
        println!("{keys:?} times {factor}: {found:?}");
        assert!(found.len() == number && found.iter().all(|message| message.contains(part)), "{found:?}");
    }
}

#[test]
fn slips_in_a_given_section_and_its_split_are_told() {
    let folder = Folder::new("given");
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let text = std::fs::read_to_string(project.join("robots/kr210/beams.toml")).unwrap();
    let given = "beam = { section = \"given\", EA = 6.7e8, EI_y = 5.5e6, EI_z = 7.4e6, GJ = 4.9e6, \
                 mass_per_length = 26.0, rotary_y = 0.21, rotary_z = 0.29, kGA_y = 1e8, kGA_z = 1e8 }";
    let change = |line: &str| match line {
        line if line.starts_with("default_trajectory") => String::new(),
        line if line.contains("width = 0.24, height = 0.24") => given.to_owned(),
        line => line.replace("\"kr210.urdf\"", &format!("{:?}", project.join("robots/kr210/kr210.urdf"))),
    };
    let sound: String = text.lines().map(|line| change(line) + "\n").collect();
    folder.tries(
        &sound,
        &[
            ("kGA_z = 1e8", "kGA_z = 1e5", "unusual", "kGA over EA of link \"link_3\""),
            ("kGA_y = 1e8, kGA_z = 1e8", "kGA_y = 1e11, kGA_z = 1e11", "unusual", "EA in kN?"),
            ("split = 0.5", "split = 0.999", "unusual", "flexible_link.beam.split"),
        ],
    );
}

#[test]
fn slips_in_loads_and_paths_are_told() {
    let folder = Folder::new("use");
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap();
    let robot = project.join("robots/kr210/robot.toml");
    let told = |motion: Option<&Path>, loads: Option<&Path>| -> Vec<String> {
        let found = check_with_loads(&robot, motion, loads, &LoadOptions::default()).into_iter();
        found.filter(|f| f.code != "missing-mesh").map(|f| f.message).collect()
    };
    let impulse = "format = 1\n[[load]]\nkind = \"impulse\"\nstart = 1.0\nduration = 0.002\nforce = [0.0, 5.0, 0.0]\n";
    let milling = "format = 1\n[[load]]\nkind = \"milling\"\nteeth = 4\nspindle_rpm = 600.0\nforce = [9.0, 9.0, 0.0]\n";
    let sine = "format = 1\n[[load]]\nkind = \"sine\"\nfrequency = 12.0\nforce = [9.0, 9.0, 0.0]\n";
    let path = std::fs::read_to_string(project.join("trajectories/milling_square.toml")).unwrap();
    // The same moves in degrees and in radians.
    let moves = "format = 1\nunit = \"deg\"\njoints = [\"joint_1\"]\nstart = [0.0]\nprofile = \"s-curve\"\nacceleration = 250.0\n\
                 jerk = 2500.0\nspeed = 0.1\n[limits]\njoint_1 = { velocity = 110.0 }\n[[move]]\nto = [50.0]\nhold = 0.5\n"
        .to_owned();
    let changes = [("deg", "rad"), ("250.0", "4.4"), ("2500.0", "44.0"), ("110.0", "1.92"), ("[50.0]", "[0.9]")];
    let radians = changes.iter().fold(moves.clone(), |text, (from, to)| text.replacen(from, to, 1));
    let (loads, motion) = (folder.0.join("loads.toml"), folder.0.join("path.toml"));
    for (sound, from, to, part) in [
        (impulse, "0.002", "2.0", "load.duration is 2 s"),
        (milling, "600.0", "6.0", "load.spindle_rpm is 6 1/min"),
        (milling, "teeth = 4", "teeth = 400", "load.teeth is 400"),
        (sine, "12.0", "12000.0", "load.frequency is 12000 Hz"),
        (&*path, "speed = 250.0\nacc", "speed = 15000.0\nacc", "mm/min for mm/s?"),
        (&*path, "acceleration = 2000.0", "acceleration = 2.0", "mm/s2 for m/s2?"),
        (&*path, "jerk = 40000.0", "jerk = 40.0", "mm/s3 for m/s3?"),
        (&*path, "joint_speed = 0.3", "joint_speed = 30.0", "per cent?"),
        (&*path, "blend = 8.0", "blend = 0.008", "its blend is"),
        (&*path, "{ acceleration = 300.0 }", "{ acceleration = 5.2 }", "the time to its full speed"),
        (&*path, "dwell = 0.3", "dwell = 300.0", "milliseconds?"),
        (&*moves, "velocity = 110.0", "velocity = 1.92", "its speed limit over that of the robot"),
        (&*moves, "acceleration = 250.0", "acceleration = 4.4", "the time to its full speed"),
        (&*moves, "jerk = 2500.0", "jerk = 44.0", "the time to its full acceleration"),
        (&*moves, "hold = 0.5", "hold = 500.0", "milliseconds?"),
        (&*radians, "velocity = 1.92", "velocity = 110.0", "its speed limit over that of the robot"),
        (&*radians, "acceleration = 4.4", "acceleration = 250.0", "the time to its full speed"),
    ] {
        assert!(sound.contains(from), "{from}");
        let is_path = sound.contains("[[move]]");
        let tell = |text: &str| {
            std::fs::write(if is_path { &motion } else { &loads }, text).unwrap();
            if is_path { told(Some(&motion), None) } else { told(None, Some(&loads)) }
        };
        let before = tell(sound);
        let after = tell(&sound.replacen(from, to, 1));
        println!("{to}: {after:?}");
        assert!(!before.iter().any(|message| message.contains(part)), "{before:?}");
        assert!(after.iter().any(|message| message.contains(part)), "{to}: {after:?}");
    }
}
