//! Slips in strengths, gauges, guides, calibrations, mountings and sections: each has its caveat, and
//! the robot without the slip has none of them.

use std::path::{Path, PathBuf};

use flexarm::{LoadOptions, Modelling, Motion, Robot, RunOptions, Scenario, check};

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
            .filter(|f| f.severity != flexarm::Severity::Note && f.code != "missing-mesh")
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
