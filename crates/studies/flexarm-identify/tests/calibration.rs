//! Calibration of an arm with two hands by its own weight: several targets, missing readings, springs
//! before and after a joint, rigid springs, and a written file that is the model of the answer.

use std::fmt::Write as _;
use std::path::PathBuf;

use flexarm_identify::{
    Identification, IdentifyRequest, NominalArm, identify_robot, nominal, parameters_like, tool_slopes,
};
use flexarm_kinematics::{Pose, Wrench, rotation_vector};
use flexarm_run::caveat::Use;
use flexarm_run::{Error, Modelling, Robot};
use flexarm_stepping::OperatingPoint;
use flexarm_testkit::Draw;
use nalgebra::{Rotation3, Translation3, Vector3, Vector6};

/// Joint values and the markers of two targets; `None` where a coordinate was not seen.
type Row = (Vec<f64>, [[Option<f64>; 3]; 2]);

/// Noise of a camera (m).
const NOISE: f64 = 1e-4;
const JOINTS: [&str; 6] = ["yaw", "pitch", "l1", "l2", "r1", "r2"];
/// Parent, origin, mass (kg) and centre of mass (x, m) of the link of each joint. All turn about z; the
/// axis of the first is vertical, those of the others horizontal.
const LINKS: [(&str, [f64; 3], f64, f64); 6] = [
    ("base", [0.0, 0.0, 0.3], 9.0, 0.0),
    ("yaw", [0.0, 0.0, 0.2], 12.0, 0.15),
    ("pitch", [0.35, 0.0, 0.2], 5.0, 0.2),
    ("l1", [0.4, 0.0, 0.0], 3.0, 0.15),
    ("pitch", [0.35, 0.0, -0.35], 7.0, 0.2),
    ("r1", [0.4, 0.0, 0.0], 3.0, 0.15),
];
/// Stiffness (N m/rad) of the drives from `pitch` on, and of the seat of `pitch`; `l2` is rigid.
const TRUTH: [f64; 7] = [2.2e4, 4.0e3, 1e12, 6.0e3, 1.5e3, 3.0e4, 5.0e4];
const HANDS: [(&str, &str, [f64; 3]); 2] = [("left", "l2", [0.31, 0.02, 0.01]), ("right", "r2", [0.29, -0.03, 0.0])];

struct Place(PathBuf);

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-calibration-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let mut urdf = "<robot name=\"two_hands\">\n<link name=\"base\"/>\n".to_owned();
        for (name, (parent, [x, y, z], mass, com)) in JOINTS.iter().zip(LINKS) {
            let roll = if *name == "pitch" { -std::f64::consts::FRAC_PI_2 } else { 0.0 };
            let i = 0.01 * mass;
            let _ = writeln!(
                urdf,
                "<link name=\"{name}\"><inertial><origin xyz=\"{com} 0 0\"/><mass value=\"{mass}\"/>\
                 <inertia ixx=\"{i}\" iyy=\"{i}\" izz=\"{i}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n\
                 <joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{name}\"/>\
                 <origin xyz=\"{x} {y} {z}\" rpy=\"{roll} 0 0\"/><axis xyz=\"0 0 1\"/>\
                 <limit lower=\"-3\" upper=\"3\" effort=\"500\" velocity=\"2\"/></joint>"
            );
        }
        std::fs::write(folder.join("arm.urdf"), urdf + "</robot>\n").unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    /// An arm with stiffnesses in the order of [`TRUTH`].
    fn robot(&self, name: &str, k: [f64; 7], more: &str) -> Robot {
        let mut text = "format = 1\nurdf = \"arm.urdf\"\ntcp = { link = \"r2\" }\n".to_owned();
        for (joint, own) in JOINTS[1..].iter().zip(k) {
            let seat = if *joint == "pitch" { format!(", seat = [{:?}, {:?}]", k[5], k[6]) } else { String::new() };
            let _ = writeln!(
                text,
                "[[drive]]\njoint = \"{joint}\"\nkind = \"gearbox\"\ngearbox = {{ stiffness = {own:?}{seat} }}"
            );
        }
        Robot::load(self.write(name, &(text + more))).unwrap()
    }

    /// Measures both hands at some poses with noise; some cells are empty. Returns poses and readings.
    ///
    /// * `slip`: changes the joint values and places that are written.
    fn measure(&self, robot: &Robot, draw: &mut Draw, slip: &dyn Fn(&mut [f64], &mut Vector3<f64>)) -> Vec<Row> {
        let arm = robot.model(&Modelling::default()).unwrap();
        let mut at = arm.operating_point().unwrap();
        let X_IW = instrument();
        let mut rows = Vec::new();
        let mut text = JOINTS.join(",") + ",left_x,left_y,left_z,right_x,right_y,right_z\n";
        for k in 0..60 {
            let mut q: Vec<f64> = [1.5, 0.5, 1.4, 1.4, 1.4, 1.4].iter().map(|range| range * draw.signed()).collect();
            at.solve(&q, &Wrench::zeros()).unwrap();
            let seen = [0, 1].map(|hand| {
                let (_, link, xyz) = HANDS[hand];
                let X = X_IW * at.pose_of(arm.model.frame(link).unwrap());
                let mut p = X.rotation * Vector3::from(xyz) + X.translation.vector;
                slip(&mut [0.0; 6], &mut p);
                let lost = |axis: usize| (k + 3 * hand) % 9 == 0 || (k % 7 == 2 && axis == 1);
                [0, 1, 2].map(|axis| (!lost(axis)).then_some(p[axis] + NOISE * normal(draw)))
            });
            slip(&mut q, &mut Vector3::zeros());
            let cells = q.iter().map(|q| format!("{q:?}"));
            let read = seen.iter().flatten().map(|x| x.map(|x| format!("{x:?}")).unwrap_or_default());
            text += &(cells.chain(read).collect::<Vec<_>>().join(",") + "\n");
            rows.push((q, seen));
        }
        self.write("hands.csv", &text);
        rows
    }

    fn identify(&self, robot: &Robot, std: &str) -> Result<Identification, Error> {
        self.identify_all(robot, r#"["drive.*", "joint.*.zero"]"#, std)
    }

    fn identify_all(&self, robot: &Robot, fit: &str, std: &str) -> Result<Identification, Error> {
        let mut text = format!("format = 1\nfit = {fit}\n[instrument.camera]\n");
        for (name, link, xyz) in HANDS {
            let near = xyz.map(|x| x + 0.004);
            let _ = writeln!(text, "[target.{name}]\nlink = \"{link}\"\nxyz = {near:?}\nunknown = true");
        }
        for (name, ..) in HANDS {
            let columns = ["x", "y", "z"].map(|axis| format!("{name}_{axis}"));
            let _ =
                writeln!(text, "[[place]]\nfile = \"hands.csv\"\ntarget = \"{name}\"\ncolumns = {columns:?}\n{std}");
        }
        let output = Some(self.0.join("out"));
        let request = IdentifyRequest { output, overwrite: true, ..IdentifyRequest::default() };
        identify_robot(robot, &self.write("job.toml", &text), &request)
    }
}

fn instrument() -> Pose {
    Pose::from_parts(Translation3::new(0.4, -0.2, 2.5), Rotation3::from_euler_angles(0.2, -0.1, 1.9))
}

fn normal(draw: &mut Draw) -> f64 {
    let (u, v) = (draw.between(1e-12, 1.0), draw.between(0.0, std::f64::consts::TAU));
    (-2.0 * u.ln()).sqrt() * v.cos()
}

/// Root mean square of the residuals (m) of a robot file with the instrument and targets of an answer.
fn rms(robot: &Robot, found: &Identification, rows: &[Row]) -> f64 {
    let arm = robot.model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    let [frame] = &found.instruments[..] else { panic!("one camera") };
    let [r, p, y] = frame.rpy;
    let X_WI = Pose::from_parts(Translation3::from(Vector3::from(frame.xyz)), Rotation3::from_euler_angles(r, p, y));
    let (mut sum, mut count) = (0.0, 0.0);
    for (q, seen) in rows {
        at.solve(q, &Wrench::zeros()).unwrap();
        for (hand, read) in seen.iter().enumerate() {
            let X = X_WI.inverse() * at.pose_of(arm.model.frame(HANDS[hand].1).unwrap());
            let p = X.rotation * Vector3::from(found.targets[hand].xyz) + X.translation.vector;
            for (p, read) in p.iter().zip(read).filter_map(|(p, read)| Some((p, (*read)?))) {
                sum += (p - read).powi(2);
                count += 1.0;
            }
        }
    }
    f64::sqrt(sum / count)
}

/// Truth: the measured arm, of which one drive is rigid and the zeros are off; the first guess is far
/// too soft for some springs and too stiff for others.
#[test]
fn two_hands_in_one_fit_tell_the_springs_and_the_written_file_is_the_model_of_the_answer() {
    let place = Place::new("hands");
    let zeros = JOINTS[1..].iter().enumerate();
    let zeros: String = zeros
        .map(|(k, j)| format!("[[calibration]]\njoint = \"{j}\"\nzero = {:?}\n", 2e-3 * (k as f64 - 2.2)))
        .collect();
    let truth = place.robot("truth.toml", TRUTH, &zeros);
    let guess = place.robot("guess.toml", [1e4; 7], "");
    let (mut inside, mut told) = (0, 0);
    for seed in 0..8 {
        let mut draw = Draw(70 + seed);
        let rows = place.measure(&truth, &mut draw, &|_, _| {});
        // Without deviations, with correct ones, and with some that are far too small.
        let std = ["", "std = 1e-4", "std = 1e-6"][seed as usize % 3];
        let found = place.identify(&guess, std).unwrap();
        assert!(found.converged && found.numbers < 360, "{} numbers", found.numbers);
        let written = Robot::load(place.0.join("out")).unwrap();
        // The drive of `l2` is written as a rigid one, which was found, not mistyped.
        let caveats = written.model(&Modelling::default()).unwrap().caveats(Use::Any);
        assert!(caveats.iter().all(|caveat| caveat.code != "gear-stiffness"), "{caveats:?}");
        let written = rms(&written, &found, &rows);
        let apart = (written / found.residual.after - 1.0).abs();
        eprintln!("{std}: residual {:.4e} m, the written file {apart:.1e} of it off", found.residual.after);
        assert!(apart < 1e-6, "{written:e} {:e}", found.residual.after);
        assert!((0.8..1.1).contains(&(found.residual.after / NOISE)), "{:?}", found.residual);
        for p in found.parameters.iter().filter(|p| p.name.starts_with("drive")) {
            let number = match p.name.strip_prefix("drive.pitch.gearbox.seat[") {
                Some(rest) => 5 + usize::from(rest.starts_with('1')),
                None => JOINTS[1..].iter().position(|j| p.name.contains(&format!(".{j}."))).unwrap(),
            };
            if p.identifiable || p.rigid {
                told += 1;
                inside += usize::from(p.interval[0] < TRUTH[number] && TRUTH[number] < p.interval[1]);
            }
            assert!(number != 2 || (p.rigid && p.interval[1].is_infinite()), "{p:?}");
            // The weight has no moment about the second axis of the seat, which is vertical.
            assert!([2, 6].contains(&number) || p.identifiable, "{p:?}");
        }
    }
    eprintln!("{inside} of {told} intervals hold the truth");
    assert!(told >= 48 && inside * 100 >= told * 88, "{inside} of {told}");
}

/// Truth: links whose masses differ from the file's by 6 to 15 % and whose centres of mass are
/// elsewhere; the springs are known.
#[test]
fn masses_and_centres_of_mass_are_found_where_they_bend_the_arm_and_stay_where_they_do_not() {
    let place = Place::new("masses");
    // Relative error of the mass, and centre of mass (m).
    let true_of: [(&str, f64, [f64; 3]); 5] = [
        ("pitch", 1.06, [0.17, 0.02, 0.01]),
        ("l1", 0.9, [0.215, 0.015, -0.01]),
        ("l2", 1.15, [0.14, -0.01, 0.005]),
        ("r1", 0.93, [0.18, 0.02, 0.0]),
        ("r2", 1.12, [0.165, 0.01, 0.0]),
    ];
    let mass_of = |name: &str| LINKS[JOINTS.iter().position(|joint| *joint == name).unwrap()].2;
    let inertials: String = true_of
        .iter()
        .map(|(name, by, com)| {
            format!("[[inertial]]\nlink = \"{name}\"\nmass = {:?}\ncom = {com:?}\n", by * mass_of(name))
        })
        .collect();
    let springs = [2.2e4, 4.0e3, 1.5e3, 6.0e3, 1.5e3, 3.0e4, 5.0e4].map(|k| 0.1 * k);
    let truth = place.robot("truth.toml", springs, &inertials);
    let guess = place.robot("guess.toml", springs, "");
    let (mut inside, mut told) = (0, 0);
    for seed in 0..6 {
        let mut draw = Draw(170 + seed);
        let rows = place.measure(&truth, &mut draw, &|_, _| {});
        let found = place.identify_all(&guess, r#"["link.*.mass", "link.*.com.*"]"#, "").unwrap();
        assert_eq!(found.parameters.len(), 4 * JOINTS.len());
        eprintln!("{}", found.combinations.join("\n"));
        let said = |word: &str, what: &str| found.combinations.iter().any(|t| t.starts_with(word) && t.contains(what));
        assert!(said("not determined: mass of yaw; ", "along x, y of yaw"), "{:?}", found.combinations);
        // The mass of a forearm pulls at the elbow as that of the upper arm does.
        assert!(said("only together: ", "mass of "), "{:?}", found.combinations);
        let written = rms(&Robot::load(place.0.join("out")).unwrap(), &found, &rows);
        let apart = (written / found.residual.after - 1.0).abs();
        eprintln!("residual {:.4e} m, the written file {apart:.1e} of it off", found.residual.after);
        assert!(apart < 1e-6, "{written:e} {:e}", found.residual.after);
        assert!((0.8..1.1).contains(&(found.residual.after / NOISE)), "{:?}", found.residual);
        for p in &found.parameters {
            let (link, key) = p.name["link.".len()..].split_once('.').unwrap();
            let Some((_, by, com)) = true_of.iter().find(|(name, ..)| *name == link) else {
                // The first axis is vertical: its link bends nothing.
                assert!(!p.identifiable && (p.value - p.initial).abs() < 1e-6, "{p:?}");
                continue;
            };
            let truth = match key {
                "mass" => by * mass_of(link),
                _ => com["xyz".find(&key[4..]).unwrap()],
            };
            if p.identifiable {
                (told, inside) = (told + 1, inside + usize::from(p.interval[0] < truth && truth < p.interval[1]));
            }
            assert!(key != "mass" || (p.value / p.initial - 1.0).abs() < 0.4, "{p:?}");
        }
    }
    eprintln!("{inside} of {told} intervals hold the truth");
    assert!(told >= 24 && inside * 100 >= told * 88, "{inside} of {told}");
}

/// Truth: the robot file of a shipped robot with two other masses, one of them of a beam.
#[test]
fn masses_of_beams_and_of_rigid_links_are_written_to_the_robot_file_that_gives_them() {
    let place = Place::new("beams");
    let beam = |mass: &str| {
        format!(
            "[[flexible_link]]\nlink = \"l1\"\n{mass}damping = {{ modal = 0.02 }}\nsegments = 3\n\
             beam = {{ section = \"tube\", outer_diameter = 0.05, wall = 0.001, material = \"steel\" }}\n"
        )
    };
    let springs = [2.2e3, 4.0e2, 1.5e2, 6.0e2, 1.5e2, 3.0e3, 5.0e3];
    let other = beam("mass = 5.4\n") + "[[inertial]]\nlink = \"l2\"\nmass = 2.7\n";
    let truth = place.robot("truth.toml", springs, &other);
    let guess = place.robot("guess.toml", springs, &beam(""));
    let rows = place.measure(&truth, &mut Draw(31), &|_, _| {});
    let found = place.identify_all(&guess, r#"["link.l*.mass"]"#, "").unwrap();
    let text = std::fs::read_to_string(place.0.join("out/robot.toml")).unwrap();
    let written = rms(&Robot::load(place.0.join("out")).unwrap(), &found, &rows);
    let apart = (written / found.residual.after - 1.0).abs();
    for (p, truth) in found.parameters.iter().zip([5.4, 2.7]) {
        eprintln!("{} = {:.4} +- {:.4} kg, truth {truth}", p.name, p.value, p.std);
        assert!(p.identifiable && p.interval[0] < truth && truth < p.interval[1], "{p:?}");
    }
    assert!(apart < 1e-6 && text.lines().filter(|line| line.starts_with("mass = ")).count() == 2, "{apart} {text}");
}

#[test]
fn a_wrong_sign_a_zero_off_by_a_right_angle_and_mirrored_axes_are_named() {
    let place = Place::new("slips");
    let truth = place.robot("truth.toml", TRUTH, "");
    let guess = place.robot("guess.toml", [1e4; 7], "");
    type Slip = fn(&mut [f64], &mut Vector3<f64>);
    let cases: [(Slip, &str); 3] = [
        (|q, _| q[2] = -q[2], "joint \"l1\" turns the other way"),
        (|q, _| q[4] -= std::f64::consts::FRAC_PI_2, "90 degrees are added to the values of joint \"r1\""),
        (|_, p| p.y = -p.y, "one axis of the instrument is reversed"),
    ];
    for (slip, words) in cases {
        place.measure(&truth, &mut Draw(5), &slip);
        let error = place.identify(&guess, "").expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    }
}

/// Truth: sixth-order differences of equilibria, for all frames of a robot with three loops, of which
/// two depend on the first, under weight and a load.
#[test]
fn the_tool_of_a_robot_with_loops_moves_with_its_joint_frames_as_differences_say() {
    let robots = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../robots");
    let arm = Robot::load(robots.join("palletiser")).unwrap().model(&Modelling::default()).unwrap();
    let (nominal, load) = (nominal(&arm), Wrench::new(Vector3::new(300.0, -200.0, -500.0), Vector3::zeros()));
    let q = [0.4, 0.3, -0.5, 0.6];
    let solved = |nominal: &NominalArm| {
        let mut at = OperatingPoint::new(nominal.at_rest(&q).unwrap(), nominal.tool.clone());
        at.solve(&q, &load).unwrap();
        at
    };
    let parameters = parameters_like(&arm, "joint.*");
    let mut at = solved(&nominal);
    let (slopes, here) = (tool_slopes(&mut at, &parameters), at.tcp_pose());
    let mut worst = 0.0_f64;
    for (k, parameter) in parameters.iter().enumerate() {
        let moved = |x: f64| {
            let X = solved(&nominal.with(std::slice::from_ref(parameter), &[x])).tcp_pose();
            let turn = rotation_vector((X.rotation * here.rotation.inverse()).matrix());
            Vector6::from_iterator(X.translation.vector.iter().chain(&turn).copied())
        };
        let d = |h: f64| (moved(h) - moved(-h)) / (2.0 * h);
        let (a, b, c) = (d(4e-3), d(2e-3), d(1e-3));
        let truth = (c * 64.0 - b * 20.0 + a) / 45.0;
        let error = (slopes.column(k) - truth).amax();
        worst = worst.max(error);
        // Measured: at most 2e-12.
        assert!(error < 1e-10, "{}: {error:e} of {:e}", parameter.name, truth.amax());
    }
    eprintln!("{} frames, error at most {worst:.1e}", parameters.len());
}

/// Joint, parent, origin of an arm whose upper arm is driven by a parallelogram.
const BARS: [(&str, &str, [f64; 3]); 5] = [
    ("yaw", "base", [0.0, 0.0, 0.3]),
    ("lower", "yaw", [0.1, 0.0, 0.2]),
    ("crank", "yaw", [0.1, 0.0, 0.2]),
    ("upper", "lower", [0.0, -0.6, 0.0]),
    ("rod", "crank", [-0.2, 0.0, 0.0]),
];

/// Truth: an arm with a parallelogram, of which two axes are off its plane, without noise.
#[test]
fn frames_of_a_loop_are_fitted_off_its_plane_and_the_written_file_is_read_again() {
    let place = Place::new("loop");
    let mut urdf = "<robot name=\"loop\">\n<link name=\"base\"/>\n".to_owned();
    for (name, parent, [x, y, z]) in BARS {
        let roll = if parent == "yaw" { -std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let _ = writeln!(
            urdf,
            "<link name=\"{name}\"/><joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/>\
             <child link=\"{name}\"/><origin xyz=\"{x} {y} {z}\" rpy=\"{roll} 0 0\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"-3\" upper=\"3\" effort=\"500\" velocity=\"2\"/></joint>"
        );
    }
    place.write("loop.urdf", &(urdf + "</robot>\n"));
    let robot = |name: &str, more: &str| {
        let text = "format = 1\nurdf = \"loop.urdf\"\ntcp = { link = \"upper\" }\n[[loop]]\n\
                    pin = { link = \"upper\", xyz = [-0.2, 0.0, 0.0] }\neye = { link = \"rod\", xyz = [0.0, -0.6, 0.0] }\n\
                    dependent = [\"upper\", \"rod\"]\n";
        Robot::load(place.write(name, &(text.to_owned() + more))).unwrap()
    };
    let off = "[[calibration]]\njoint = \"lower\"\nrpy = [0.006, -0.004, 0.0]\n\
               [[calibration]]\njoint = \"crank\"\nrpy = [-0.005, 0.0, 0.003]\n";
    let arm = robot("truth.toml", off).model(&Modelling::default()).unwrap();
    let (mut at, mut draw) = (arm.operating_point().unwrap(), Draw(9));
    let mut text = "yaw,lower,crank,x,y,z\n".to_owned();
    for _ in 0..24 {
        let q = [1.5, 0.4, 0.4].map(|range| range * draw.signed());
        at.solve(&q, &Wrench::zeros()).unwrap();
        let X = instrument() * at.pose_of(arm.model.frame("upper").unwrap());
        let p = X.rotation * Vector3::new(0.7, 0.1, 0.05) + X.translation.vector;
        let cells = q.iter().chain(&p).map(|x| format!("{x:?}"));
        text += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    place.write("places.csv", &text);
    let job = "format = 1\nfit = [\"joint.lower.*\", \"joint.crank.*\"]\n[instrument.camera]\n[target.ball]\n\
               xyz = [0.7, 0.1, 0.05]\n[[place]]\nfile = \"places.csv\"\nstd = 1e-5\n";
    let request = IdentifyRequest { output: Some(place.0.join("out")), overwrite: true, ..IdentifyRequest::default() };
    let found = identify_robot(&robot("guess.toml", ""), &place.write("job.toml", job), &request).unwrap();
    eprintln!("residual {:.1e} m, before {:.1e} m", found.residual.after, found.residual.before);
    assert!(found.residual.before > 1e-4 && found.residual.after < 1e-6, "{:?}", found.residual);
    let written = Robot::load(place.0.join("out")).unwrap();
    assert_eq!(written.calibration.len(), 2);
}
