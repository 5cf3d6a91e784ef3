//! Plans that choose among levers and gauges, and arms with coupled gears.

use std::path::{Path, PathBuf};

use flexarm_identify::{
    Component, IdentifyOptions, IdentifyRequest, LoadCase, MeasuredArm, Measurements, Parameter, PlanRequest, Reading,
    ReadingKind, Row, frequency_slopes, identify, identify_robot, nominal, parameters, plan_measurements,
};
use flexarm_kinematics::Wrench;
use flexarm_run::{Modelling, Robot};
use nalgebra::{DVector, Vector3};

/// A folder that is removed at the end.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-levers-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn home() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210_identified").canonicalize().unwrap()
}

/// The arm with wrist gears that move two joints each.
fn coupled(place: &Place) -> Robot {
    let urdf = home().join("kr210_identified.urdf");
    let text = std::fs::read_to_string(home().join("robot.toml")).unwrap();
    let text = text.replace("\"kr210_identified.urdf\"", &format!("{urdf:?}"));
    let own: Vec<&str> = text.lines().filter(|line| !line.starts_with("default_trajectory")).collect();
    let wrist = "\n[coupling]\njoints = [\"joint_4\", \"joint_5\", \"joint_6\"]\n\
                 matrix = [[1.0, 0.0, 0.0], [-0.02, 1.0, 0.0], [0.04, -0.3, 1.0]]\n";
    let file = place.0.join("robot.toml");
    std::fs::write(&file, own.join("\n") + wrist).unwrap();
    Robot::load(&file).unwrap()
}

fn pulls() -> Measurements {
    let readings = (0..15).map(|k| {
        let angle = |j: usize| 0.4 * (1.3 * k as f64 + 2.1 * j as f64).sin() + [0.0, -0.9, 1.2, 0.3, 0.5, 0.2][j];
        let force = [-Vector3::z(), Vector3::x(), Vector3::y()][k % 3] * 2000.0;
        let at = Vector3::new(0.4, 0.1, 0.0);
        let after = LoadCase { wrench: Wrench::new(force, Vector3::zeros()), at, ..LoadCase::none() };
        let rows =
            [Vector3::x(), Vector3::y(), Vector3::z()].map(|d| Row { of: Component::along(d), value: 0.0, std: 3e-5 });
        let kind = ReadingKind::Displacement { before: LoadCase::none(), after, point: at, rows: rows.to_vec() };
        Reading { name: format!("pull {k}"), q: (0..6).map(angle).collect(), kind }
    });
    Measurements { readings: readings.collect(), ..Measurements::default() }
}

fn gears(all: Vec<Parameter>) -> Vec<Parameter> {
    all.into_iter().filter(|p| p.name.ends_with("gearbox.stiffness")).collect()
}

/// Truth: Richardson differences of displacements and frequencies; the synthetic arm itself,
/// measured without noise.
#[test]
fn springs_of_coupled_motors_have_the_derivatives_of_their_arm_and_are_found_from_displacements() {
    let place = Place::new("coupled");
    let robot = coupled(&place);
    let arm = robot.model(&Modelling::default()).unwrap();
    let (nominal, parameters) = (nominal(&arm), gears(parameters(&arm)));
    assert_eq!(parameters.len(), 6);
    let poses = pulls();
    let measured = MeasuredArm { nominal: &nominal, parameters: &parameters, measurements: &poses };
    let shown = |x: &[f64]| DVector::from_vec(measured.predicted(&DVector::from_column_slice(x)).unwrap());
    let q = &poses.readings[3].q;
    let hz = |x: &[f64]| DVector::from_vec(frequency_slopes(&nominal.with(&parameters, x), &[], q).unwrap().hz);
    let slopes = frequency_slopes(&nominal, &parameters, q).unwrap().slopes;
    let mut J = nalgebra::DMatrix::zeros(0, 0);
    evaluated(&measured, &mut J);
    let richardson = |k: usize, f: &dyn Fn(&[f64]) -> DVector<f64>| {
        let at = |h: f64| {
            let mut x = vec![0.0; 6];
            x[k] = h;
            f(&x)
        };
        let d = |h: f64| (at(h) - at(-h)) / (2.0 * h);
        let (a, b, c) = (d(0.04), d(0.02), d(0.01));
        let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
        (bc * 16.0 - ab) / 15.0
    };
    for (k, parameter) in parameters.iter().enumerate().skip(3) {
        let truth = richardson(k, &shown);
        let error = (J.column(k) - &truth).amax() / truth.amax();
        let of_hz = richardson(k, &hz);
        let apart = (slopes.column(k) - &of_hz).amax() / of_hz.amax();
        eprintln!("{}: displacement {error:.1e}, frequency {apart:.1e}", parameter.name);
        assert!(error < 1e-8 && apart < 1e-7, "{k}: {error:e} {apart:e}");
    }
    // Readings of an arm with other springs, fitted.
    let truth: Vec<f64> = (0..6).map(|k| 0.3 * (1.7 * k as f64 + 1.0).sin()).collect();
    let mut values = shown(&truth).into_iter().copied().collect::<Vec<_>>().into_iter();
    let mut read = poses.clone();
    for reading in &mut read.readings {
        if let ReadingKind::Displacement { rows, .. } = &mut reading.kind {
            rows.iter_mut().for_each(|row| row.value = values.next().unwrap());
        }
    }
    let options = IdentifyOptions { folds: 0, ..IdentifyOptions::default() };
    let found = identify(&nominal, &parameters, &read, &options, &|_| true).unwrap();
    for (p, x) in found.parameters.iter().zip(&truth) {
        let off = (p.value - p.initial * x.exp()) / p.std;
        assert!(p.identifiable && off.abs() < 0.02, "{}: {off:e}", p.name);
    }
}

/// Truth: differences of the response, and the arm whose motors have other dampers.
#[test]
fn dampers_of_coupled_motors_are_found_from_the_response_of_the_arm_that_has_them() {
    use flexarm_identify::{Answer, Form, MeasuredResponse, Probe, structure_slopes};
    let place = Place::new("dampers");
    let robot = coupled(&place);
    let arm = robot.model(&Modelling::default()).unwrap();
    let nominal = nominal(&arm);
    let of =
        |p: &Parameter| p.name.ends_with("gearbox.damping") && ["_4", "_5", "_6"].iter().any(|j| p.name.contains(j));
    let parameters: Vec<Parameter> = parameters(&arm).into_iter().filter(of).collect();
    assert_eq!(parameters.len(), 3);
    let q = [0.2, -0.9, 1.2, 0.3, 0.5, 0.2];
    let omega: Vec<f64> = (1..40).map(|k| 12.0 * f64::from(k)).collect();
    let frame = flexarm_kinematics::Frame {
        X_BF: nominal.tool.X_BF * flexarm_kinematics::Pose::translation(0.4, 0.1, 0.0),
        ..nominal.tool.clone()
    };
    let probes = [Vector3::z(), Vector3::new(0.6, 0.8, 0.0)].map(|direction| Probe { frame: frame.clone(), direction });
    let found = structure_slopes(&nominal, &parameters, &q, &probes).unwrap();
    let slopes = found.response(0, 1, Answer::Accelerance, &omega).unwrap().slopes;
    let at = |k: usize, h: f64| {
        let changed = nominal.with(&parameters[k..=k], &[h]);
        let again = structure_slopes(&changed, &[], &q, &probes).unwrap();
        let H = again.response(0, 1, Answer::Accelerance, &omega).unwrap().values;
        DVector::from_iterator(2 * H.len(), H.iter().flat_map(|h| [h.re, h.im]))
    };
    for (k, parameter) in parameters.iter().enumerate() {
        let d = |h: f64| (at(k, h) - at(k, -h)) / (2.0 * h);
        let (a, b, c) = (d(0.1), d(0.05), d(0.025));
        let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
        let truth = (bc * 16.0 - ab) / 15.0;
        let own = DVector::from_iterator(2 * omega.len(), slopes.column(k).iter().flat_map(|h| [h.re, h.im]));
        let error = (own - &truth).amax() / truth.amax();
        eprintln!("{}: {error:.1e} of {:.1e}", parameter.name, truth.amax());
        assert!(error < 1e-8, "{k}: {error:e}");
    }
    let truth = [0.4, -0.3, 0.25];
    let other = nominal.with(&parameters, &truth);
    let readings = [(0, 0), (0, 1), (1, 1)].into_iter().map(|(watched, hit)| {
        let H = structure_slopes(&other, &[], &q, &probes).unwrap();
        let H = H.response(watched, hit, Answer::Accelerance, &omega).unwrap().values;
        let kind = ReadingKind::Response(MeasuredResponse {
            load: LoadCase::none(),
            watched: probes[watched].clone(),
            hit: probes[hit].clone(),
            answer: Answer::Accelerance,
            form: Form::Logarithmic,
            points: omega.iter().zip(H).map(|(w, h)| (*w, h, [1e-3, 1e-3])).collect(),
        });
        Reading { name: "response".into(), q: q.to_vec(), kind }
    });
    let read = Measurements { readings: readings.collect(), ..Measurements::default() };
    let options = IdentifyOptions { folds: 0, ..IdentifyOptions::default() };
    let found = identify(&nominal, &parameters, &read, &options, &|_| true).unwrap();
    for (p, x) in found.parameters.iter().zip(truth) {
        let off = (p.value - p.initial * x.exp()) / p.std;
        eprintln!("{}: off by {off:.1e} deviations", p.name);
        assert!(p.identifiable && off.abs() < 0.02, "{}: {off:e}", p.name);
    }
}

/// Derivatives of the residuals.
fn evaluated(arm: &MeasuredArm<'_>, J: &mut nalgebra::DMatrix<f64>) {
    use flexarm_identify::Residuals;
    arm.evaluate(&DVector::zeros(arm.parameters.len()), Some(J)).unwrap();
}

/// Truth: a force has no moment about an axis through its point of application; at a lever it has.
/// The table written by a plan is read again, and measurements of the unchanged arm change nothing.
#[test]
fn a_plan_with_levers_tells_the_last_gearbox_and_its_table_with_gauges_is_read_again() {
    let robot = Robot::load(home()).unwrap();
    let std_of = |plan: &flexarm_identify::MeasurementPlan| {
        plan.parameters.iter().find(|p| p.name == "drive.joint_6.gearbox.stiffness").map(|p| p.std / p.initial).unwrap()
    };
    let plain = plan_measurements(&robot, &PlanRequest::new(8)).unwrap();
    let levers = vec![[0.0; 3], [0.0, 0.5, 0.0]];
    let points = levers.clone();
    let with = PlanRequest { levers: levers.clone(), points: points.clone(), ..PlanRequest::new(8) };
    let with = plan_measurements(&robot, &with).unwrap();
    eprintln!("joint_6 to {:.3} of itself at the TCP, {:.3} with a lever", std_of(&plain), std_of(&with));
    assert!(std_of(&with) < 0.5 * std_of(&plain));
    assert!(
        with.poses.iter().any(|pose| pose.at == levers[1] && pose.point == points[1])
            && plain.poses.iter().all(|pose| pose.at == [0.0; 3])
    );

    let place = Place::new("gauges");
    let directions = vec![[0.0, 0.0, -2.0], [1.0, 1.0, 0.0]];
    let request = PlanRequest { levers, points, directions, output: Some(place.0.clone()), ..PlanRequest::new(14) };
    let plan = plan_measurements(&robot, &request).unwrap();
    let table = PathBuf::from(plan.table.clone().unwrap());
    let text = std::fs::read_to_string(&table).unwrap();
    assert!(
        text.starts_with("joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,fx,fy,fz,ax,ay,az,px,py,pz,ux,uy,uz,d\n"),
        "{text}"
    );
    let mut lines = text.lines();
    let mut filled = vec![lines.next().unwrap().to_owned()];
    for (line, pose) in lines.zip(&plan.poses) {
        let along = Vector3::from(pose.direction.unwrap()).dot(&Vector3::from(pose.expected_m));
        filled.push(format!("{line}{}", 1e3 * along));
    }
    std::fs::write(&table, filled.join("\n")).unwrap();
    let found = identify_robot(&robot, Path::new(&plan.file.unwrap()), &IdentifyRequest::default()).unwrap();
    eprintln!("residual {:.1e} {}", found.residual.after, found.residual.unit);
    // Angles in the table have four decimals.
    assert!(found.residual.before < 1e-7, "{:e}", found.residual.before);
    for p in &found.parameters {
        assert!((p.value / p.initial - 1.0).abs() < 0.02, "{}: {} {}", p.name, p.value, p.initial);
    }
    let none = PlanRequest { directions: vec![[0.0; 3]], ..PlanRequest::new(3) };
    assert!(plan_measurements(&robot, &none).unwrap_err().to_string().contains("has zero length"));
}
