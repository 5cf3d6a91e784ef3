//! Mounting of the base of a robot: springs, beams, walls and rails, compared with closed forms and
//! between the steppers.

use std::f64::consts::TAU;
use std::path::PathBuf;

use flexarm_kinematics::Wrench;
use flexarm_run::{Error, LinkModel, LoadOptions, Modelling, Motion, Robot, RunOptions, Variation, check};
use flexarm_stepping::{ReferenceSettings, SpookSettings, StepperKind};
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};

/// A rail along x, a slewing column, a boom; every moving link has mass.
const URDF: &str = r#"<robot name="cell">
  <link name="base"><inertial><origin xyz="0 0 0.1"/><mass value="80"/><inertia ixx="2" iyy="2.5" izz="3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><origin xyz="0 0 0.2"/><axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="9000" velocity="4"/></joint>
  <link name="cart"><inertial><origin xyz="0 0 0.1"/><mass value="60"/><inertia ixx="1.5" iyy="1.4" izz="1.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slew" type="revolute"><parent link="cart"/><child link="boom"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="900" velocity="6"/></joint>
  <link name="boom"><inertial><origin xyz="0.4 0 0"/><mass value="25"/><inertia ixx="0.3" iyy="1.9" izz="2.0" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="flange" type="fixed"><parent link="boom"/><child link="tool"/><origin xyz="0.9 0 0"/></joint>
  <link name="tool"/>
</robot>"#;

/// The same without mass in the base.
fn light_base() -> String {
    let (head, rest) = URDF.split_once("<link name=\"base\">").unwrap();
    let rest = rest.split_once("</link>").unwrap().1;
    format!("{head}<link name=\"base\"/>{rest}")
}

const HEAD: &str = "format = 1\nurdf = \"cell.urdf\"\ntcp = { link = \"tool\" }\n";
const FREE: &str = "gravity = [0.0, 0.0, 0.0]\n";
const STIFF: [f64; 6] = [2e8, 3e8, 4e8, 5e7, 6e7, 7e7];

struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-mounting-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("cell.urdf"), URDF).unwrap();
        Self(folder)
    }

    fn load(&self, text: &str) -> Result<Robot, Error> {
        std::fs::write(self.0.join("robot.toml"), text).unwrap();
        Robot::load(&self.0)
    }

    fn robot(&self, text: &str) -> Robot {
        self.load(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Six coupled springs, positive definite.
fn coupled() -> Matrix6<f64> {
    let mut K = Matrix6::from_diagonal(&STIFF.into());
    for (i, j, k) in [(0, 4, 3e7), (1, 3, -2e7), (2, 5, 1e7), (0, 1, 4e7)] {
        (K[(i, j)], K[(j, i)]) = (k, k);
    }
    K
}

fn written(K: &Matrix6<f64>) -> String {
    let rows = K.row_iter().map(|row| format!("{:?}", row.iter().copied().collect::<Vec<_>>()));
    format!("[{}]", rows.collect::<Vec<_>>().join(", "))
}

/// Twist of a point at `p` from the twist at the origin.
fn carried(p: &Vector3<f64>) -> Matrix6<f64> {
    let mut Ad = Matrix6::identity();
    Ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&-p.cross_matrix());
    Ad
}

fn turned(R: &Matrix3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(R);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(R);
    both
}

/// Truth: a rigid arm on springs moves its TCP by `Ad C_S Adᵀ F`, with C_S the inverse of the
/// stiffness rotated into world axes, Ad the lever from the springs to the TCP. Measured 2.9e-16 of
/// the maximum compliance.
#[test]
fn the_tool_of_a_rigid_arm_gives_way_by_the_compliance_of_the_springs_at_its_lever() {
    let place = Place::new("tilt");
    let (xyz, rpy) = ([0.1, -0.2, -0.3], [0.3f64, -0.4, 0.8]);
    let text = format!("{HEAD}{FREE}[mounting]\nstiffness = {}\nxyz = {xyz:?}\nrpy = {rpy:?}\n", written(&coupled()));
    let robot = place.robot(&text);
    let (x, slew) = (0.7, 0.5f64);
    let found = robot.model(&Modelling::default()).unwrap().statics(Some(&[x, slew]), [0.0; 6]).unwrap();
    let tool = Vector3::new(x + 0.9 * slew.cos(), 0.9 * slew.sin(), 0.6);
    let R = turned(Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]).matrix());
    let Ad = carried(&(tool - Vector3::from(xyz)));
    let C = Ad * R * coupled().try_inverse().unwrap() * R.transpose() * Ad.transpose();
    let error = Matrix6::from_fn(|i, j| found.compliance[i][j] - C[(i, j)]).amax() / C.amax();
    eprintln!("compliance at the lever: {error:.1e}");
    assert!(error < 1e-13, "{error}");
    // Its share has its name, and the springs carry the load on the TCP.
    let pulled = robot
        .model(&Modelling::default())
        .unwrap()
        .statics(Some(&[x, slew]), [0.0, 0.0, -500.0, 0.0, 0.0, 0.0])
        .unwrap();
    assert_eq!(pulled.elements.iter().map(|e| e.name.as_str()).collect::<Vec<_>>(), ["mounting"]);
    let share = pulled.elements[0].tcp_displacement_m;
    assert!((0..3).all(|k| (share[k] - pulled.tcp_displacement_m[k]).abs() < 1e-9), "{share:?}");
    assert!(
        (pulled.tcp_displacement_m[2] / (-500.0 * C[(2, 2)]) - 1.0).abs() < 1e-4,
        "{:?}",
        pulled.tcp_displacement_m
    );
}

/// Truth: the whole robot is one body on springs, `K φ = ω² M φ` with its mass, centre and moments
/// about the springs from Steiner's theorem. Measured 2e-15.
#[test]
fn the_first_frequencies_are_those_of_a_rigid_body_on_the_springs() {
    let place = Place::new("modes");
    let pedestal = "mass = 40.0\ncom = [0.0, 0.1, -0.2]\ninertia = [1.0, 1.1, 1.2, 0.1, 0.0, 0.0]\n";
    let text = format!("{HEAD}{FREE}[mounting]\nstiffness = {STIFF:?}\nxyz = [0.0, 0.0, -0.1]\n{pedestal}");
    let (x, slew) = (-0.6, 0.9f64);
    let found = place.robot(&text).model(&Modelling::default()).unwrap().modes(Some(&[x, slew]), None, 6).unwrap();
    let Rz = *Rotation3::from_axis_angle(&Vector3::z_axis(), slew).matrix();
    let diagonal = |a: f64, b: f64, c: f64| Matrix3::from_diagonal(&Vector3::new(a, b, c));
    let S = Vector3::new(0.0, 0.0, -0.1);
    let boom = Vector3::new(x + 0.4 * slew.cos(), 0.4 * slew.sin(), 0.6);
    let mut I = diagonal(1.0, 1.1, 1.2);
    (I[(0, 1)], I[(1, 0)]) = (0.1, 0.1);
    let parts = [
        (80.0, Vector3::new(0.0, 0.0, 0.1) - S, diagonal(2.0, 2.5, 3.0)),
        (60.0, Vector3::new(x, 0.0, 0.3) - S, diagonal(1.5, 1.4, 1.2)),
        (25.0, boom - S, Rz * diagonal(0.3, 1.9, 2.0) * Rz.transpose()),
        (40.0, Vector3::new(0.0, 0.1, -0.2), I),
    ];
    let M: Matrix6<f64> = parts
        .iter()
        .map(|(m, c, I)| {
            let mut M = Matrix6::zeros();
            M.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(*m);
            M.fixed_view_mut::<3, 3>(3, 3).copy_from(I);
            carried(&-c).transpose() * M * carried(&-c)
        })
        .sum();
    let half = Matrix6::from_diagonal(&STIFF.map(f64::sqrt).into());
    // Eigenvalues 1/ω² of K^-1/2 M K^-1/2.
    let scaled = half.try_inverse().unwrap() * M * half.try_inverse().unwrap();
    let mut hz: Vec<f64> = scaled.symmetric_eigenvalues().iter().map(|l| 1.0 / l.sqrt() / TAU).collect();
    hz.sort_by(f64::total_cmp);
    let error = found.undamped_frequencies_hz.iter().zip(&hz).map(|(f, t)| (f / t - 1.0).abs()).fold(0.0, f64::max);
    eprintln!("rigid body on springs: {error:.1e} of {hz:.2?} Hz");
    assert_eq!(found.undamped_frequencies_hz.len(), 6);
    assert!(error < 1e-12, "{error} {:?} {hz:?}", found.undamped_frequencies_hz);
}

/// The stiffness of a beam at its end, clamped at the other, along x of the base; Euler-Bernoulli.
fn beam_stiffness(l: f64, EA: f64, EI: f64, GJ: f64) -> Matrix6<f64> {
    let mut C = Matrix6::zeros();
    (C[(0, 0)], C[(3, 3)]) = (l / EA, l / GJ);
    for (u, r, sign) in [(1, 5, 1.0), (2, 4, -1.0)] {
        (C[(u, u)], C[(r, r)]) = (l.powi(3) / (3.0 * EI), l / EI);
        (C[(u, r)], C[(r, u)]) = (sign * l * l / (2.0 * EI), sign * l * l / (2.0 * EI));
    }
    C.try_inverse().unwrap()
}

/// Identity: a beam below the base is equivalent to springs with the closed-form stiffness of its
/// far end, in both link models; so is a joint at rest with a 6x6 gearbox. Compliance, displacement
/// and frequencies; measured 1.2e-8 for the beam in two parts, 1e-15 (frequencies 9.8e-7, due to
/// its mass) with modes, bitwise equal for the gearbox.
#[test]
fn springs_a_beam_and_a_gearbox_of_six_are_the_same_mounting() {
    let place = Place::new("identity");
    let (l, EA, EI, GJ) = (0.8, 4e9, 3e7, 2e7);
    let K = beam_stiffness(l, EA, EI, GJ);
    let text = |mounting: &str| format!("{HEAD}{FREE}[mounting]\n{mounting}\n");
    let beam = |model: &str| {
        text(&format!(
            "xyz = [-{l}, 0.0, 0.0]\nmodel = \"{model}\"\nbeam = {{ section = \"given\", EA = {EA:e}, EI_y = {EI:e}, EI_z = {EI:e}, GJ = {GJ:e}, \
             mass_per_length = 1e-6, rotary_y = 1e-9, rotary_z = 1e-9, theory = \"euler-bernoulli\", parts = \"uniform\" }}"
        ))
    };
    let at = [0.4, -0.3];
    let figures = |robot: &Robot| {
        let statics = robot
            .model(&Modelling::default())
            .unwrap()
            .statics(Some(&at), [0.1, -0.2, 0.3, 0.01, 0.02, -0.03])
            .unwrap();
        let modes = robot.model(&Modelling::default()).unwrap().modes(Some(&at), None, 4).unwrap();
        (statics.compliance.concat(), statics.tcp_displacement_m, modes.undamped_frequencies_hz[..4].to_vec())
    };
    let springs = figures(&place.robot(&text(&format!("stiffness = {}", written(&K)))));
    let far = |a: &[f64], b: &[f64]| {
        let scale = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / scale
    };
    let compare = |what: &str, other: (Vec<f64>, [f64; 3], Vec<f64>), bound: f64| {
        let errors = [far(&other.0, &springs.0), far(&other.1, &springs.1), far(&other.2, &springs.2)];
        eprintln!("{what}: compliance, displacement, frequencies {errors:?}");
        assert!(errors.iter().all(|e| *e < bound), "{what} {errors:?}");
    };
    compare("lumped beam", figures(&place.robot(&beam("lumped"))), 1e-6);
    compare("modal beam", figures(&place.robot(&beam("modal"))), 1e-5);

    // A prismatic joint at rest below the base, with a gearbox that is elastic in all directions.
    let below = URDF.replace(
        "<link name=\"base\">",
        "<link name=\"floor\"/><joint name=\"still\" type=\"prismatic\"><parent link=\"floor\"/><child link=\"base\"/><axis xyz=\"0 0 1\"/>\
         <limit lower=\"-1\" upper=\"1\" effort=\"9e4\" velocity=\"1\"/></joint><link name=\"base\">",
    );
    std::fs::write(place.0.join("cell.urdf"), below).unwrap();
    let robot = place.robot(&format!(
        "{HEAD}{FREE}[[drive]]\njoint = \"still\"\nkind = \"gearbox\"\ngearbox = {{ stiffness = {} }}\n",
        written(&K)
    ));
    let at = [0.0, at[0], at[1]];
    let wrench = [0.1, -0.2, 0.3, 0.01, 0.02, -0.03];
    let statics = robot.model(&Modelling::default()).unwrap().statics(Some(&at), wrench).unwrap();
    let hz = robot.model(&Modelling::default()).unwrap().modes(Some(&at), None, 4).unwrap().undamped_frequencies_hz
        [..4]
        .to_vec();
    compare("gearbox of six", (statics.compliance.concat(), statics.tcp_displacement_m, hz), 1e-12);
}

/// Truth, to first order: on springs at its origin a base sinks by `m g / k` along gravity and
/// rotates by the moment of the weight over the stiffness; on ceiling and wall as on the floor, and
/// in proportion with the cart farther out. The remainder is of second order.
#[test]
fn the_sag_on_floor_wall_and_ceiling_follows_the_weight_and_the_place_on_the_rail() {
    let place = Place::new("wall");
    for g in [[0.0, 0.0, -9.81], [0.0, 0.0, 9.81], [9.81, 0.0, 0.0], [0.0, -9.81, 0.0]] {
        let robot = place.robot(&format!("{HEAD}gravity = {g:?}\n[mounting]\nstiffness = {STIFF:?}\n"));
        let gravity = Vector3::from(g);
        for (x, slew) in [(-1.5, 0.0f64), (0.0, 1.0), (1.5, -0.7)] {
            let boom = Vector3::new(x + 0.4 * slew.cos(), 0.4 * slew.sin(), 0.6);
            let parts = [(80.0, Vector3::new(0.0, 0.0, 0.1)), (60.0, Vector3::new(x, 0.0, 0.3)), (25.0, boom)];
            let force: Vector3<f64> = gravity * 165.0;
            let moment: Vector3<f64> = parts.iter().map(|(m, c)| c.cross(&(gravity * *m))).sum();
            let sink = force.zip_map(&Vector3::from_row_slice(&STIFF[..3]), |f, k| f / k);
            let turn = moment.zip_map(&Vector3::from_row_slice(&STIFF[3..]), |m, k| m / k);
            let tool = Vector3::new(x + 0.9 * slew.cos(), 0.9 * slew.sin(), 0.6);
            let truth = sink + turn.cross(&tool);
            let found = robot.model(&Modelling::default()).unwrap().statics(Some(&[x, slew]), [0.0; 6]).unwrap();
            let error = (Vector3::from(found.sag_m) - truth).norm() / truth.norm();
            assert!(error < 1e-3, "{g:?} {x} {slew}: {error:.1e}");
        }
    }
}

fn moving(robot: &Robot) -> Motion {
    let smooth = |s: f64| s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    let t: Vec<f64> = (0..=150).map(|k| f64::from(k) * 0.004).collect();
    let q: Vec<f64> = t.iter().flat_map(|t| [0.5, 0.8].map(|far| far * smooth((t / 0.4).min(1.0)))).collect();
    Motion::from_samples(&t, &q, robot).unwrap()
}

const DAMPED: &str = "damping = { stiffness_beta = 2e-4 }\n";

/// Truth: the reference stepper under error control; measured 5.3e-5 of the peak for
/// generalised-alpha at 0.5 ms, 3.4e-5 SDIRK, 1.5e-7 RK4 at 0.1 ms, 5.8e-4 SPOOK at 0.1 ms. The
/// mounting is the whole error, under its name; a run in a batch equals a single run.
#[test]
fn every_stepper_swings_on_the_mounting_as_the_reference_does() {
    let place = Place::new("steppers");
    let robot = place
        .robot(&format!("{HEAD}[mounting]\nname = \"pedestal\"\nstiffness = [8e6, 8e6, 2e7, 4e6, 4e6, 5e6]\n{DAMPED}"));
    let motion = moving(&robot);
    let arm = robot.model(&Modelling::default()).unwrap();
    let run = |stepper: StepperKind, step_s: f64| {
        let options = RunOptions { stepper, step_s, log_rate_hz: 500.0, ..RunOptions::default() };
        arm.simulate(&motion, &options).unwrap_or_else(|e| panic!("{} {e}", stepper.name()))
    };
    let truth = run(StepperKind::Reference(ReferenceSettings::new(1e-9)), 5e-4);
    let peak = truth.summary.tcp.as_ref().unwrap().peak_m;
    assert!((1e-4..1e-1).contains(&peak), "{peak}");
    for (stepper, step, bound) in [
        (StepperKind::default(), 5e-4, 1e-3),
        (StepperKind::Sdirk3, 5e-4, 2e-4),
        (StepperKind::Rk4, 1e-4, 1e-6),
        (StepperKind::Spook(SpookSettings::default()), 1e-4, 5e-3),
    ] {
        let found = run(stepper, step);
        let error =
            found.error_world_m().iter().zip(truth.error_world_m()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        eprintln!("{:<18} {:.1e} of the peak", stepper.name(), error / peak);
        assert!(error < bound * peak, "{} {}", stepper.name(), error / peak);
    }
    let summary = &truth.summary;
    assert_eq!(summary.bends.mounting.as_deref(), Some("pedestal"));
    assert!(summary.bends.links.is_empty() && summary.links[0].name == "pedestal", "{:?}", summary.bends);
    let tcp = summary.tcp.as_ref().unwrap();
    assert_eq!((tcp.shares_at_peak.len(), tcp.shares_at_peak[0].kind.as_str()), (1, "mounting"));
    assert!((tcp.shares_at_peak[0].along_m / tcp.peak_m - 1.0).abs() < 0.01, "{:?}", tcp.shares_at_peak);
    assert!(summary.headline.contains("mounting ") && !summary.headline.contains("links"), "{}", summary.headline);
    assert!(summary.energy.imbalance < 1e-3, "{}", summary.energy.imbalance);

    let options = RunOptions::default();
    let alone = arm.simulate(&motion, &options).unwrap().summary.tcp.unwrap();
    let all = arm.deflections(&vec![Variation::new(&motion); 4], &options, false, &|| false);
    for found in all {
        let found = found.unwrap();
        assert!((found.peak_m / alone.peak_m - 1.0).abs() < 1e-12, "{} {}", found.peak_m, alone.peak_m);
    }
    // The rigid twin, and robots with rigid links, have a rigid mounting.
    let rigid = robot.model(&Modelling { links: LinkModel::Rigid, ..Modelling::default() }).unwrap();
    assert_eq!(rigid.springs.len(), 0);
}

/// Truth, to first order: each spring with play deflects by its play and by its force over its
/// stiffness, in the frame of the springs; without load it does not move. A fixed joint with six
/// stiffnesses and the same play below the base is the same mounting. Measured below 1.4e-6, the
/// second order in the deflection.
#[test]
fn springs_with_play_deflect_by_their_play_and_their_force_over_stiffness() {
    let place = Place::new("play");
    let play: [f64; 6] = [2e-7, 0.0, 3e-7, 4e-7, 5e-7, 6e-7];
    let pivot = [0.1, -0.2, -0.3];
    let springs = format!("stiffness = {STIFF:?}\nbacklash = {play:?}\n");
    let text = format!("{HEAD}{FREE}[mounting]\n{springs}xyz = {pivot:?}\n");
    let robot = place.robot(&text);
    let (x, slew) = (0.7, 0.5f64);
    let lever = Vector3::new(x + 0.9 * slew.cos(), 0.9 * slew.sin(), 0.6) - Vector3::from(pivot);
    let displacement = |robot: &Robot, q: &[f64], wrench: [f64; 6]| {
        let found = robot.model(&Modelling::default()).unwrap().statics(Some(q), wrench).unwrap();
        assert!(found.sag_m.iter().all(|sag| sag.abs() < 1e-15), "{:?}", found.sag_m);
        Vector3::from(found.tcp_displacement_m)
    };
    // In the second, a spring bears 0.05 N m beside moments of 90 N m on the others.
    // The third moves a spring by a millionth of its play.
    let loads = [30.0, -20.0, 40.0, 15.0, 10.0, -20.0];
    let wrenches = [loads, [-10.0, 60.0, -5.0, -30.0, 2.0, 9.0], loads.map(|load| 1e-4 * load)];
    let mut found = Vec::new();
    for wrench in wrenches {
        let (force, moment) = (Vector3::from_row_slice(&wrench[..3]), Vector3::from_row_slice(&wrench[3..]));
        let moment: Vector3<f64> = moment + lever.cross(&force);
        let loads = [force.as_slice(), moment.as_slice()].concat();
        let give: Vec<f64> = (0..6).map(|c| loads[c] / STIFF[c] + play[c].copysign(loads[c])).collect();
        let truth = Vector3::from_row_slice(&give[..3]) + Vector3::from_row_slice(&give[3..]).cross(&lever);
        let moved = displacement(&robot, &[x, slew], wrench);
        let error = (moved - truth).norm() / truth.norm();
        eprintln!("springs with play: {error:.1e} of {:.2e} m", truth.norm());
        assert!(error < 1e-5, "{moved:?} {truth:?}");
        found.push(moved);
    }
    // No play is a mounting without the key.
    let none = place.robot(&text.replace(&format!("{play:?}"), &format!("{:?}", [0.0; 6])));
    assert_eq!(none.model(&Modelling::default()).unwrap().springs.len(), 1);

    let base = "<link name=\"base\">";
    let floor = format!(
        "<link name=\"floor\"/><joint name=\"anchors\" type=\"fixed\"><parent link=\"floor\"/><child link=\"foot\"/>\
         <origin xyz=\"0.1 -0.2 -0.3\"/></joint><link name=\"foot\"/><joint name=\"up\" type=\"fixed\"><parent link=\"foot\"/>\
         <child link=\"base\"/><origin xyz=\"-0.1 0.2 0.3\"/></joint>{base}"
    );
    std::fs::write(place.0.join("cell.urdf"), URDF.replace(base, &floor)).unwrap();
    let gearbox = format!("{{ stiffness = {STIFF:?}, backlash = {play:?} }}");
    let drive = format!("[[drive]]\njoint = \"anchors\"\nkind = \"gearbox\"\ngearbox = {gearbox}\n");
    let robot = place.robot(&format!("{HEAD}{FREE}{drive}"));
    for (wrench, moved) in wrenches.into_iter().zip(found) {
        assert!((displacement(&robot, &[x, slew], wrench) - moved).norm() < 1e-9 * moved.norm());
    }
}

/// Truth: the reference stepper. A base that stands on its springs by its weight and rocks within
/// its play as the arm moves; the energy that springs and dampers take is accounted for. Measured
/// 2.4e-5 of the peak for generalised-alpha, 1.8e-6 for RK4.
#[test]
fn a_base_that_rocks_within_its_play_moves_as_the_reference_says() {
    let place = Place::new("rocking");
    let robot = place.robot(&format!(
        "{HEAD}[mounting]\nstiffness = [8e6, 8e6, 2e7, 4e6, 4e6, 5e6]\n\
         backlash = [0.0, 0.0, 0.0, 2e-5, 2e-5, 0.0]\n{DAMPED}"
    ));
    let motion = moving(&robot);
    let arm = robot.model(&Modelling::default()).unwrap();
    let run = |stepper: StepperKind, step_s: f64| {
        let options = RunOptions { stepper, step_s, log_rate_hz: 500.0, ..RunOptions::default() };
        arm.simulate(&motion, &options).unwrap_or_else(|e| panic!("{} {e}", stepper.name()))
    };
    let truth = run(StepperKind::Reference(ReferenceSettings::new(1e-9)), 5e-4);
    let tcp = truth.summary.tcp.as_ref().unwrap();
    assert_eq!(truth.summary.bends.mounting.as_deref(), Some("mounting"));
    assert!((tcp.shares_at_peak[0].along_m / tcp.peak_m - 1.0).abs() < 0.01, "{:?}", tcp.shares_at_peak);
    for (stepper, step, bound) in [(StepperKind::default(), 1e-4, 2e-3), (StepperKind::Rk4, 1e-4, 2e-3)] {
        let found = run(stepper, step);
        let difference = |(a, b): (&f64, &f64)| (a - b).abs();
        let error = found.error_world_m().iter().zip(truth.error_world_m()).map(difference).fold(0.0, f64::max);
        eprintln!("{:<18} {:.1e} of the peak", stepper.name(), error / tcp.peak_m);
        assert!(error < bound * tcp.peak_m, "{} {}", stepper.name(), error / tcp.peak_m);
        assert!(found.summary.energy.imbalance < 1e-2, "{}", found.summary.energy.imbalance);
    }
}

#[test]
fn what_makes_no_mounting_is_refused_with_what_was_found_and_expected() {
    let place = Place::new("refused");
    let fails = |mounting: &str, words: &[&str]| {
        let error = place.load(&format!("{HEAD}[mounting]\n{mounting}\n")).expect_err(mounting).to_string();
        for word in words.iter().chain(&["robot.toml:"]) {
            assert!(error.contains(word), "{mounting}: {error}");
        }
    };
    fails("", &["stiffness = ", "beam = ", "reduced = "]);
    fails("stiffness = 1e6", &["one number", "6x6"]);
    fails("stiffness = [1e6, 1e6, 1e6]", &["3 numbers", "six"]);
    fails("stiffness = [1e6, 1e6, 1e6, 1e6, 1e6, 0.0]", &["[5][5] is 0, expected a positive number"]);
    fails("stiffness = [1e6, 1e6, nan, 1e6, 1e6, 1e6]", &["NaN"]);
    let mut K = coupled();
    K[(0, 4)] = 0.0;
    fails(&format!("stiffness = {}", written(&K)), &["must be symmetric"]);
    (K[(0, 4)], K[(4, 0)]) = (1.2e8, 1.2e8);
    fails(&format!("stiffness = {}", written(&K)), &["not positive definite"]);
    let six = format!("stiffness = {STIFF:?}\n");
    fails(&format!("{six}beam = {{ section = \"circle\", diameter = 0.2 }}"), &["one of stiffness"]);
    fails(&format!("{six}name = \"cart\""), &["\"cart\"", "name = "]);
    fails(&format!("{six}segments = 3"), &["segments", "beam"]);
    fails(&format!("{six}mass = -1.0"), &["-1", "positive"]);
    fails(&format!("{six}com = [0.0, 0.0, 0.1]"), &["mass"]);
    fails(&format!("{six}damping = {{ modal = 1.5 }}"), &["1.5", "below 1"]);
    fails("beam = { section = \"circle\", diameter = 0.2, material = \"steel\" }", &["foot", "xyz"]);
    fails(
        "beam = { section = \"circle\", diameter = 0.2, material = \"steel\" }\nxyz = [0.0, 0.0, -1.0]\nmass = 3.0",
        &["section"],
    );
    fails("reduced = \"nowhere.flex\"", &["there is no file"]);
    fails(&format!("{six}backlash = [0.0, 0.0]"), &["backlash has a length of 2", "6"]);
    fails(&format!("{six}backlash = [0.0, 0.0, 0.0, -1e-3, 0.0, 0.0]"), &["backlash = -0.001", "0 or above"]);
    fails(&format!("stiffness = {}\nbacklash = {:?}", written(&coupled()), [1e-3; 6]), &["uncoupled", "6x6"]);
    fails(&format!("{six}mas = 3.0"), &["unknown field `mas`"]);

    // A base without mass: the mass that oscillates on the springs is unknown, unless the file
    // defines it.
    std::fs::write(place.0.join("cell.urdf"), light_base()).unwrap();
    fails(&six, &["\"base\"", "no mass", "mass = 0.0"]);
    let robot = place.robot(&format!("{HEAD}[mounting]\n{six}mass = 0.0\n"));
    assert_eq!(robot.model(&Modelling::default()).unwrap().model.n_elastic(), 6);
    // Stiffness in N/mm is reported.
    place.robot(&format!("{HEAD}[mounting]\nstiffness = [2e5, 3e5, 4e5, 5e4, 6e4, 7e4]\nmass = 100.0\n"));
    let told = check(&place.0, None, &LoadOptions::default());
    let soft: Vec<_> = told.iter().filter(|f| f.code == "mounting-soft").collect();
    assert!(soft.len() == 2 && soft[0].likely.contains("N/mm"), "{told:?}");
    assert!(check(&place.0, None, &LoadOptions::default()).iter().all(|f| f.code != "no-flexible-link"));
}

/// The compliance of an operating point equals that of statics at any pose; measured 1e-15.
#[test]
fn an_operating_point_on_springs_has_the_compliance_of_statics() {
    let place = Place::new("point");
    let robot = place.robot(&format!("{HEAD}[mounting]\nstiffness = {}\n", written(&coupled())));
    let arm = robot.model(&Modelling::default()).unwrap();
    let mut at = arm.operating_point().unwrap();
    for q in [[0.0, 0.0], [1.0, 0.7], [-1.2, -2.0]] {
        at.solve(&q, &Wrench::zeros()).unwrap();
        let C = at.compliance();
        let truth = robot.model(&Modelling::default()).unwrap().statics(Some(&q), [0.0; 6]).unwrap().compliance;
        let error = Matrix6::from_fn(|i, j| C[(i, j)] - truth[i][j]).amax() / C.amax();
        assert!(error < 1e-12, "{error}");
    }
}
