//! Monitors of a run, fed with samples that are known in closed form.

use std::path::Path;
use std::sync::Arc;

use flexarm_analysis::{LongRecord, MetricSettings, PathFrame};
use flexarm_fem::stress::von_mises;
use flexarm_kinematics::{Data, LinkInertia, Pose, forward_kinematics};
use flexarm_path::PlannedMove;
use flexarm_run::internals::{
    Deflections, DriveLoad, DriveLoads, Energy, LinkStrain, Strains, ToolError, ToolMonitor, ToolPathMonitor,
    signed_von_mises,
};
use flexarm_run::{Modelling, Robot, TCP_FRAME, ToolPath};
use flexarm_settings::Place;
use flexarm_stepping::{Held, Observation, Plant, Spring};
use nalgebra::{DVector, Matrix3, Point3, Rotation3, Vector3};

use crate::small_robots::two_joints;

/// The robot of two joints with these drives, at rest.
fn two_drives(drives: &str) -> Plant {
    let robot = two_joints(drives).unwrap();
    robot.model(&Modelling::default()).unwrap().plant(Arc::new(Held(vec![0.0; 2]))).unwrap()
}

#[test]
fn the_first_time_beyond_the_limit_counts_and_a_servo_at_its_limit_is_counted() {
    let arm = two_drives("[[drive]]\njoint = \"a\"\nkind = \"torque\"\ntorque_limit = 8.0\n");
    let mut drives = DriveLoads::new(&arm);
    let mut seen = Observation::new(&arm);
    for (k, force) in [1.0, 8.0, -8.0, 11.0, 12.0, 2.0].into_iter().enumerate() {
        seen.t = 0.1 * k as f64;
        seen.drive.copy_from_slice(&[force, -0.25 * force]);
        drives.update(&seen);
    }
    let truth = [
        DriveLoad { peak: 12.0, over_since_s: Some(0.1 * 3.0), at_limit: 4 },
        DriveLoad { peak: 3.0, over_since_s: None, at_limit: 0 },
    ];
    assert_eq!(drives.result(), truth);
}

/// Truth: a mass m picked up at p with velocity v adds `m v²/2 - m g·p`, and removes it when
/// put down; v from differences of p.
#[test]
fn a_payload_brings_its_energy_and_takes_it_along() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let model = Robot::load(root.join("robots/test/one_beam")).unwrap().rigid_model().unwrap();
    let still = Arc::new(Held(vec![0.3]));
    let arm = Plant::new(model.clone(), Vec::<Spring>::new(), still).unwrap();
    let mut seen = Observation::new(&arm);
    (seen.q[0], seen.qdot[0]) = (0.3, 0.5);
    let frame = model.frame(TCP_FRAME).unwrap().clone();
    let (mass, com) = (2.0, Vector3::new(0.1, -0.2, 0.3));
    let mut data = Data::new(&model);
    let mut place = |q: f64| {
        forward_kinematics(&model, &mut data, &DVector::from_element(1, q));
        (data.X_WF(&frame) * Point3::from(com)).coords
    };
    let (p, v) = (place(0.3), (place(0.3 + 1e-5) - place(0.3 - 1e-5)) * (0.5 / 2e-5));
    let truth = 0.5 * mass * v.norm_squared() - mass * model.gravity.dot(&p);

    let added = LinkInertia { mass, com, inertia_com: Matrix3::zeros() }.spatial().at_parent(&frame.X_BF);
    let mut inertia = model.bodies()[frame.body].inertia;
    inertia += added;
    let carrying = Arc::new(model.with_inertia(frame.body, inertia));
    let mut energy = Energy::new(&model);
    let mut payload = Vec::new();
    for model in [&model, &model, &carrying, &carrying, &model] {
        seen.model.clone_from(model);
        energy.update(&seen);
        payload.push(energy.result().payload_j);
    }
    assert!(payload[1] == 0.0 && payload[2] == payload[3] && payload[4].abs() < 1e-12);
    assert!((payload[2] / truth - 1.0).abs() < 1e-9, "{} {truth}", payload[2]);
    // A payload carried from the start adds nothing.
    let mut energy = Energy::new(&model);
    seen.model.clone_from(&carrying);
    energy.update(&seen);
    assert_eq!(energy.result().payload_j, 0.0);
}

/// Truth: the integral of `A sin t` over a turn is 2 A - 2 A, for each drive. Identity:
/// positive minus negative work is the net work.
#[test]
fn drives_that_give_back_what_they_took_have_no_net_work_and_much_gross_work() {
    let arm = two_drives("");
    let mut seen = Observation::new(&arm);
    let mut energy = Energy::new(&arm.model);
    let n = 1000;
    for k in 0..=n {
        let t = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
        // The second drive brakes while the first drives: their sum is zero at all times.
        let drives = [3.0 * t.sin(), -3.0 * t.sin()];
        seen.t = t;
        seen.qdot.fill(1.0);
        seen.drive.copy_from_slice(&drives);
        seen.power = [drives.iter().sum(), 0.0, 0.0];
        energy.update(&seen);
    }
    let figures = energy.result();
    assert!(figures.drives_j.abs() < 1e-12, "{}", figures.drives_j);
    // Measured 3.9e-5 too little: error of the trapezoidal rule with a thousand samples.
    assert!((figures.drives_positive_j - 12.0).abs() < 1e-4, "{}", figures.drives_positive_j);
    assert!((figures.drives_negative_j - 12.0).abs() < 1e-4, "{}", figures.drives_negative_j);
    // A power that is linear between two samples.
    let mut parts = |time: f64, powers: [f64; 2]| {
        let mut energy = Energy::new(&arm.model);
        for (t, power) in [(0.0, powers[0]), (time, powers[1])] {
            seen.t = t;
            seen.drive.copy_from_slice(&[power, 0.0]);
            energy.update(&seen);
        }
        let figures = energy.result();
        [figures.drives_positive_j, figures.drives_negative_j]
    };
    assert_eq!(parts(2.0, [-1.0, 3.0]), [2.25, 0.25]);
    assert_eq!(parts(2.0, [-1.0, 0.0]), [0.0, 1.0]);
}

#[test]
fn a_gearbox_of_six_coordinates_is_judged_by_its_rotations() {
    let six =
        "[[drive]]\njoint = \"a\"\nkind = \"gearbox\"\ngearbox = { stiffness = [1e6, 1e6, 1e6, 1e4, 1e4, 1e4] }\n";
    let one = "[[drive]]\njoint = \"b\"\nkind = \"gearbox\"\ngearbox = { stiffness = 1e4 }\n";
    let robot = two_joints(&format!("{six}{one}")).unwrap();
    let arm = robot.model(&Modelling::default()).unwrap();
    let plant = arm.plant(Arc::new(Held(vec![0.0; 2]))).unwrap();
    let mut seen = Deflections::new(&plant, &arm, 3);
    let q = |six: [f64; 6], one: f64| {
        let mut q = DVector::from_element(arm.model.nv(), 9.0);
        q.rows_mut(plant.elements[0].coordinate, 6).copy_from_slice(&six);
        q[plant.elements[1].coordinate] = one;
        q
    };
    seen.update(&q([5.0, 5.0, 5.0, 0.0, 3.0, -4.0], -2.0));
    seen.update(&q([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 1.0));
    assert_eq!(seen.result(), [5.0, 2.0, 0.0]);
}

fn a_move(line: usize, span_s: [f64; 2]) -> PlannedMove {
    PlannedMove {
        place: Place::of_file("p.src").line(line),
        statement: "line".into(),
        span_s,
        top_m_s: Some(1.0),
        programmed_m_s: Some(1.0),
        slowed: None,
        least_sigma: None,
        blend_m: 0.0,
    }
}

/// Truth: a TCP that moves along x for a second, then along y, with a sag of 2 mm and an
/// overshoot along x of 1 mm after the corner.
#[test]
fn sag_is_an_offset_and_a_swing_behind_the_corner_an_overshoot() {
    let mut path = ToolPath::default();
    path.moves = vec![a_move(3, [0.0, 1.0]), a_move(4, [1.0, 2.0])];
    let mut monitor = ToolPathMonitor::new(Arc::new(path));
    for k in 0..=200 {
        let t = 0.01 * f64::from(k);
        let behind = t > 1.0;
        let swing = if behind { 1e-3 * (10.0 * (t - 1.0)).sin() * (-3.0 * (t - 1.0)).exp() } else { 0.0 };
        let velocity = if behind { Vector3::y() } else { Vector3::x() };
        let sag = [0.0, 0.0, -2e-3];
        let error = [swing, 0.0, -2e-3, 0.0, 0.0, 0.0];
        let path_error = if behind { [0.0, swing, -2e-3, 0.0, 0.0, 0.0] } else { [0.0, 0.0, -2e-3, 0.0, 0.0, 0.0] };
        let (X_rigid, X_flexible) = (Pose::identity(), Pose::identity());
        monitor.update(t, &ToolError { X_rigid, X_flexible, error, path_error, static_m: sag }, &velocity);
    }
    let figures = monitor.result().unwrap();
    let peak = (0..200).map(|k| 0.005 * f64::from(k)).map(|t| (10.0 * t).sin() * (-3.0 * t).exp()).fold(0.0, f64::max);
    assert!((figures.corner_overshoot_m - 1e-3 * peak).abs() < 2e-5 * peak, "{}", figures.corner_overshoot_m);
    assert_eq!(figures.offset_m[2], -2e-3);
    assert!(figures.left_m < 1e-3 && figures.left_m > 0.4e-3);
    assert_eq!((figures.moves[0].line, figures.moves[0].across_peak_m), (3, 2e-3));
    assert!(figures.across_peak_m > 2e-3 && figures.t_across_peak_s > 1.0);
}

/// Truth: the principal stresses as eigenvalues.
#[test]
fn the_sign_of_von_mises_is_that_of_the_largest_principal_stress() {
    let mut seed = 1_u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    };
    let mut counts = [0, 0];
    for _ in 0..1000 {
        let stress = std::array::from_fn(|_| draw());
        let [xx, yy, zz, xy, yz, zx] = stress;
        let principal = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz).symmetric_eigenvalues();
        let [largest, smallest] = [principal.max(), principal.min()];
        let signed = signed_von_mises(stress);
        assert_eq!(signed, von_mises(stress).copysign(largest + smallest), "{stress:?}");
        counts[usize::from(signed > 0.0)] += 1;
    }
    assert!(counts.iter().all(|count| *count > 300), "{counts:?}");
    assert_eq!(signed_von_mises([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), -1.0);
}

/// Truth: a TCP that moves along y at 1 m/s, one millimetre ahead of its twin and two
/// millimetres beside it.
#[test]
fn what_is_ahead_and_what_is_beside_the_path_are_told_apart() {
    let speed = Vector3::y();
    let path = PathFrame::before((0..3).map(|_| [speed, Vector3::zeros()]));
    let record = LongRecord::new(vec![(0.0, 1.0)], false, MetricSettings::default());
    let mut tool = ToolMonitor::new(path, None, record);
    for k in 0..=100 {
        let t = 0.01 * f64::from(k);
        let X_rigid = Pose::translation(0.5, t, 0.0);
        let seen = tool.add(t, X_rigid, X_rigid * Pose::translation(2e-3, 1e-3, 0.0), &speed);
        let [along, normal, binormal] = [0, 1, 2].map(|c| seen.path_error[c]);
        assert!((along - 1e-3).abs() < 1e-15 && (normal.hypot(binormal) - 2e-3).abs() < 1e-15);
        assert!(seen.static_m.iter().all(|x| x.is_nan()), "nobody asked");
    }
    let metrics = tool.result().metrics().unwrap();
    assert!((metrics.peak_m - 5f64.sqrt() * 1e-3).abs() < 1e-15 && (metrics.path_accuracy_m - 2e-3).abs() < 1e-15);
    assert!((metrics.tangential_peak_m - 1e-3).abs() < 1e-15);
}

/// A beam with the poses of its two ends in the bodies that carry them.
struct Beam {
    seen: Strains,
    length: f64,
    n_bodies: usize,
    ends: [(usize, Pose); 2],
}

impl Beam {
    fn new() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let arm = Robot::load(root.join("robots/test/one_beam")).unwrap().model(&Modelling::default()).unwrap();
        let (arm, model) = (&*arm, &arm.model);
        let span = &arm.spans[0];
        let end = |link: &str, X_LI: Pose| {
            let frame = model.frame(link).unwrap();
            (frame.body, frame.X_BF * X_LI)
        };
        let ends = [end(&span.link, span.X_LA), end(&span.distal_link, span.X_DB)];
        assert!(ends[0].0 != ends[1].0);
        Self { seen: Strains::new(arm, model), length: span.length, n_bodies: model.bodies().len(), ends }
    }

    /// Poses of the bodies at which the ends have these poses.
    fn at(&self, X_WA: Pose, X_AE: Pose) -> Vec<Pose> {
        let mut X_WB = vec![Pose::identity(); self.n_bodies];
        for ((body, X_BI), X_WI) in self.ends.iter().zip([X_WA, X_WA * X_AE]) {
            X_WB[*body] = X_WI * X_BI.inverse();
        }
        X_WB
    }
}

/// Truth: a link whose far end moves by 1 mm along it and rotates by 0.02 rad; a rigid motion of
/// the whole arm changes nothing.
#[test]
fn strain_and_rotation_are_those_of_the_link_wherever_the_arm_is() {
    let mut beam = Beam::new();
    let l = beam.length;
    for X_WA in
        [Pose::identity(), Pose::from_parts([3.0, -1.0, 0.5].into(), Rotation3::new(Vector3::new(0.3, 2.0, -1.0)))]
    {
        let at = |x: f64, turn: f64| {
            let R = Rotation3::new(Vector3::y() * turn);
            beam.at(X_WA, Pose::from_parts([x, 0.0, 0.0].into(), R))
        };
        let (longer, shorter, rigid) = (at(l + 0.001, 0.02), at(l - 0.0005, -0.01), at(l, 0.0));
        beam.seen.update(0.0, &longer, &rigid);
        beam.seen.update(0.0, &shorter, &rigid);
    }
    let LinkStrain { strain, rotation, .. } = beam.seen.result()[0];
    assert!((strain - 1e-3 / l).abs() < 1e-14 && (rotation - 0.02).abs() < 1e-14, "{strain} {rotation}");
}

/// Truth: a link that turns by 2 rad/s about an axis across it and by 5 rad/s about itself.
#[test]
fn the_angular_speed_is_that_of_the_line_between_the_interfaces() {
    let mut beam = Beam::new();
    for t in [0.0, 0.01, 0.02] {
        let R = Rotation3::new(Vector3::z() * (2.0 * t)) * Rotation3::new(Vector3::x() * (5.0 * t));
        let X = beam.at(Pose::from_parts(Vector3::zeros().into(), R), Pose::translation(beam.length, 0.0, 0.0));
        beam.seen.update(t, &X, &X);
    }
    assert!((beam.seen.result()[0].speed - 2.0).abs() < 1e-12, "{}", beam.seen.result()[0].speed);
}
