//! Shipped robots identified from synthetic measurements: files in workshop units, correct standard
//! deviations, new robot files.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flexarm_identify::{
    Component, IdentifyOptions, IdentifyRequest, LoadCase, MeasuredArm, Measurements, NominalArm, Parameter,
    PlanRequest, Reading, ReadingKind, Row, identify, identify_robot, nominal, parameters, plan_measurements,
};
use flexarm_kinematics::Wrench;
use flexarm_run::{Error, Modelling, Robot};
use flexarm_testkit::Draw;
use nalgebra::{DVector, Vector3};

/// Noise of a laser tracker (m).
const NOISE: f64 = 3e-5;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn shipped(name: &str) -> Robot {
    Robot::load(root().join("robots").join(name)).unwrap()
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("flexarm-identify-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn normal(draw: &mut Draw) -> f64 {
    let (u, v) = (draw.between(1e-12, 1.0), draw.between(0.0, std::f64::consts::TAU));
    (-2.0 * u.ln()).sqrt() * v.cos()
}

/// Pulls of 2 kN along the axes in turn, with a lever of 0.4 m, at poses all over the middle of the
/// joint ranges.
fn pulls(draw: &mut Draw, count: usize) -> Measurements {
    let readings = (0..count).map(|k| {
        let q = [1.5, 0.6, 0.7, 2.0, 1.2, 2.0].map(|range| range * draw.signed());
        let middle = [0.0, -0.9, 1.2, 0.0, 0.3, 0.0];
        let force = [-Vector3::z(), Vector3::x(), Vector3::y()][k % 3] * 2000.0;
        let wrench = Wrench::new(force, Vector3::zeros());
        let rows = [Vector3::x(), Vector3::y(), Vector3::z()];
        let kind = ReadingKind::Displacement {
            before: LoadCase::none(),
            after: LoadCase { wrench, at: Vector3::new(0.4, 0.0, 0.0), ..LoadCase::none() },
            // Off the axis of the last joint, which would otherwise be unobservable.
            point: Vector3::new(0.4, 0.0, 0.0),
            rows: rows.map(|d| Row { of: Component::along(d), value: 0.0, std: NOISE }).to_vec(),
        };
        Reading { name: format!("pull {k}"), q: q.iter().zip(middle).map(|(a, b)| a + b).collect(), kind }
    });
    Measurements { readings: readings.collect(), ..Measurements::default() }
}

/// The default selection of identified parameters.
fn stiffnesses(all: Vec<Parameter>) -> Vec<Parameter> {
    all.into_iter().filter(|p| p.name != "payload.mass" && !p.name.ends_with(".damping")).collect()
}

/// Simulated readings of an arm with parameters at `x`.
fn shown(nominal: &NominalArm, parameters: &[Parameter], x: &[f64], of: &Measurements) -> Vec<f64> {
    let arm = MeasuredArm { nominal, parameters, measurements: of };
    arm.predicted(&DVector::from_column_slice(x)).unwrap()
}

fn with_values(of: &Measurements, values: &[f64]) -> Measurements {
    let mut values = values.iter();
    let mut read = of.clone();
    for reading in &mut read.readings {
        if let ReadingKind::Displacement { rows, .. } = &mut reading.kind {
            rows.iter_mut().for_each(|row| row.value = *values.next().unwrap());
        }
    }
    read
}

/// Truth: the synthetic arm. Returns the share of 95 % intervals that contain it, and the spread of
/// the errors over their deviations, 200 seeds.
fn coverage(robot: &str) -> (f64, f64) {
    let arm = shipped(robot).model(&Modelling::default()).unwrap();
    let (nominal, parameters) = (nominal(&arm), stiffnesses(parameters(&arm)));
    let mut draw = Draw(2026);
    let poses = pulls(&mut draw, 24);
    let truth: Vec<f64> = (0..parameters.len()).map(|k| 0.3 * (1.7 * k as f64 + 1.0).sin()).collect();
    let exact = shown(&nominal, &parameters, &truth, &poses);
    let options = IdentifyOptions { folds: 0, ..IdentifyOptions::default() };
    let (mut inside, mut squares, mut count) = (0.0, 0.0, 0.0);
    for _ in 0..200 {
        let noisy: Vec<f64> = exact.iter().map(|x| x + NOISE * normal(&mut draw)).collect();
        let found = identify(&nominal, &parameters, &with_values(&poses, &noisy), &options, &|_| true).unwrap();
        for (p, x) in found.parameters.iter().zip(&truth) {
            assert!(p.identifiable, "{}", p.name);
            let value = p.initial * x.exp();
            inside += f64::from(u8::from(p.interval[0] < value && value < p.interval[1]));
            squares += ((p.value / p.initial).ln() - x).powi(2) / (p.std / p.value).powi(2);
            count += 1.0;
        }
    }
    (inside / count, (squares / count).sqrt())
}

#[test]
fn six_gearboxes_come_out_with_the_deviations_that_they_have() {
    let (inside, spread) = coverage("kr210_identified");
    eprintln!("six gearboxes: {inside:.3} inside, spread {spread:.3}");
    assert!((0.92..0.98).contains(&inside) && (0.93..1.07).contains(&spread), "{inside} {spread}");
}

#[test]
fn two_links_and_six_gearboxes_of_one_arm_come_out_with_the_deviations_that_they_have() {
    let (inside, spread) = coverage("kr210");
    eprintln!("links and gearboxes: {inside:.3} inside, spread {spread:.3}");
    assert!((0.92..0.98).contains(&inside) && (0.93..1.07).contains(&spread), "{inside} {spread}");
}

/// A table in mm and degrees of the readings of an arm with other gearboxes.
fn table(joints: &[String], poses: &Measurements, values: &[f64], factor: f64) -> String {
    let mut text = format!("{},fx,fy,fz,dx,dy,dz\n", joints.join(","));
    for (k, reading) in poses.readings.iter().enumerate() {
        let ReadingKind::Displacement { after, .. } = &reading.kind else { continue };
        reading.q.iter().for_each(|q| write!(text, "{},", q.to_degrees()).unwrap());
        let force = after.wrench.force;
        write!(text, "{},{},{}", force.x, force.y, force.z).unwrap();
        values[3 * k..3 * k + 3].iter().for_each(|d| write!(text, ",{}", factor * d).unwrap());
        text += "\n";
    }
    text
}

const JOB: &str = "format = 1\nlength = \"mm\"\nangle = \"deg\"\n[[displacement]]\nfile = \"pulls.csv\"\nload = { at = [400.0, 0, 0] }\npoint = [400.0, 0, 0]\n";

fn measured(robot: &Robot, x: &[f64], noise: f64) -> (Measurements, Vec<f64>, Vec<String>) {
    let arm = robot.model(&Modelling::default()).unwrap();
    let mut draw = Draw(5);
    let poses = pulls(&mut draw, 12);
    let parameters: Vec<Parameter> = stiffnesses(parameters(&arm));
    let mut values = shown(&nominal(&arm), &parameters, x, &poses);
    values.iter_mut().for_each(|d| *d += noise * normal(&mut draw));
    (poses, values, arm.joints().map(str::to_owned).collect())
}

#[test]
fn a_table_in_millimetres_gives_a_robot_file_that_shows_what_was_measured() {
    let robot = shipped("kr210_identified");
    let x = [0.2, -0.3, 0.1, -0.2, 0.25, -0.1];
    let (poses, values, joints) = measured(&robot, &x, 0.0);
    let folder = folder("table");
    std::fs::write(folder.join("pulls.csv"), table(&joints, &poses, &values, 1e3)).unwrap();
    std::fs::write(folder.join("job.toml"), JOB.to_owned() + "std = 0.03\n").unwrap();
    let output = folder.join("new");
    let request = IdentifyRequest { output: Some(output.clone()), ..IdentifyRequest::default() };
    let found = identify_robot(&robot, &folder.join("job.toml"), &request).unwrap();
    for (p, x) in found.parameters.iter().zip(x) {
        // Without noise, the prior alone pulls, by a small part of the deviation.
        let error = (p.value - p.initial * x.exp()).abs() / p.std;
        assert!(error < 0.01, "{}: {error:e}", p.name);
    }
    assert!(found.residual.before > 1e-5 && found.residual.after < 1e-8, "{:?}", found.residual);
    // The new file has these stiffnesses, and everything else from the old one.
    let new = Robot::load(&output).unwrap();
    assert_eq!(
        (new.urdf_path.canonicalize().unwrap(), &new.name),
        (robot.urdf_path.canonicalize().unwrap(), &robot.name)
    );
    let arm = new.model(&Modelling::default()).unwrap();
    for (p, found) in stiffnesses(parameters(&arm)).iter().zip(&found.parameters) {
        let off = (p.initial - found.value).abs();
        assert!(off < 1e-11 * found.value, "{}: {off}", p.name);
    }
    let page = std::fs::read_to_string(output.join("identification.html")).unwrap();
    assert!(page.contains("drive.joint_6.gearbox.stiffness") && page.matches("<svg").count() == 1);
    // A second time: nothing is overwritten without permission.
    let again = identify_robot(&robot, &folder.join("job.toml"), &request);
    assert!(matches!(again, Err(Error::Taken { .. })), "{again:?}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_table_in_metres_that_is_said_to_be_in_millimetres_is_recognised() {
    let robot = shipped("kr210_identified");
    let (poses, values, joints) = measured(&robot, &[0.0; 6], NOISE);
    let folder = folder("units");
    for (factor, length, better) in [(1.0, "mm", "\"m\""), (1e3, "m", "\"mm\""), (1e6, "mm", "\"um\"")] {
        std::fs::write(folder.join("pulls.csv"), table(&joints, &poses, &values, factor)).unwrap();
        // The point of application is also in the unit of the file; it is left out here.
        let job = JOB
            .replace("\"mm\"", &format!("{length:?}"))
            .replace("load = { at = [400.0, 0, 0] }\npoint = [400.0, 0, 0]\n", "");
        std::fs::write(folder.join("job.toml"), job).unwrap();
        let error = identify_robot(&robot, &folder.join("job.toml"), &IdentifyRequest::default()).unwrap_err();
        assert!(error.to_string().contains(&format!("with length = {better} they would")), "{error}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn gearboxes_alone_do_not_pass_for_an_arm_whose_links_bend() {
    let robot = shipped("kr210");
    let (poses, values, joints) = measured(&robot, &[0.0; 8], NOISE);
    let folder = folder("wrong");
    std::fs::write(folder.join("pulls.csv"), table(&joints, &poses, &values, 1e3)).unwrap();
    std::fs::write(folder.join("job.toml"), JOB.to_owned() + "std = 0.03\n").unwrap();
    let of = |links| {
        let modelling = Modelling { links, ..Modelling::default() };
        let request = IdentifyRequest { modelling, ..IdentifyRequest::default() };
        identify_robot(&robot, &folder.join("job.toml"), &request).unwrap()
    };
    let (right, wrong) = (of(flexarm_run::LinkModel::AsFiled), of(flexarm_run::LinkModel::Rigid));
    let [r, w] = [&right, &wrong].map(|found| found.held_out.as_ref().unwrap().rms);
    eprintln!(
        "links and drives: residual {:.1e} m, held out {r:.1e}; drives alone: {:.1e}, {w:.1e}, scatter {:?}",
        right.residual.after, wrong.residual.after, wrong.misfit
    );
    assert!(right.misfit.is_none() && wrong.misfit.is_some_and(|factor| factor > 2.0));
    assert!(wrong.caveats.iter().any(|caveat| caveat.message.contains("lacks a flexible part")));
    assert!(w > 2.0 * r, "{w} {r}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_plan_tells_more_than_as_many_poses_as_they_come_and_its_table_is_read_when_filled() {
    let robot = shipped("kr210_identified");
    let folder = folder("plan");
    let request = PlanRequest { output: Some(folder.clone()), ..PlanRequest::new(8) };
    let plan = plan_measurements(&robot, &request).unwrap();
    eprintln!("deviations smaller by a factor of {:.2}", plan.gain_over_first.exp());
    assert!(plan.gain_over_first > 0.2, "{}", plan.gain_over_first);
    let job = folder.join("measurements.toml");
    // Not filled in yet.
    let error = identify_robot(&robot, &job, &IdentifyRequest::default()).unwrap_err().to_string();
    assert!(error.contains("displacements.csv:2:1: displacements.csv:2: there is no measured value"), "{error}");
    let empty = std::fs::read_to_string(folder.join("displacements.csv")).unwrap();
    let mut lines = empty.lines();
    let mut filled = lines.next().unwrap().to_owned() + "\n";
    for (line, pose) in lines.zip(&plan.poses) {
        let d = pose.expected_m.map(|d| format!("{}", 1e3 * d));
        filled += &format!("{}{}\n", line.strip_suffix(",,").unwrap(), d.join(","));
    }
    std::fs::write(folder.join("displacements.csv"), filled).unwrap();
    let found = identify_robot(&robot, &job, &IdentifyRequest::default()).unwrap();
    for (found, promised) in found.parameters.iter().zip(&plan.parameters) {
        // At the TCP the axes of the forearm and of the flange nearly coincide.
        if !found.identifiable {
            assert!(found.std.is_nan() && promised.std > 0.3 * promised.initial, "{}", found.name);
            continue;
        }
        // The file has four digits of a degree; the measurement equals the expectation.
        assert!((found.value - found.initial).abs() < 0.3 * found.std, "{}", found.name);
        let ratio = found.std / promised.std;
        // The plan includes prior knowledge, a factor of two, also for parameters correlated with
        // this one; the fit does not.
        assert!((0.99..1.5).contains(&ratio), "{}: {ratio}", found.name); // measured: 1.0 to 1.3
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_wrong_in_a_file_of_measurements_is_said_with_its_place() {
    let robot = shipped("kr210_identified");
    let folder = folder("wrong-files");
    let job = folder.join("job.toml");
    let q = "joints = [0, -1, 1, 0, 0.5, 0]";
    let fails = |text: &str, part: &str| {
        std::fs::write(&job, text).unwrap();
        let error = identify_robot(&robot, &job, &IdentifyRequest::default()).unwrap_err().to_string();
        assert!(error.contains(part), "{text}\n{error}");
    };
    fails("length = \"mm\"\n", "add format = 1");
    fails("format = 1\n", "there is no reading");
    fails("format = 1\nlength = \"inch\"\n", "job.toml:2:10: length = \"inch\" is not known");
    fails(&format!("format = 1\n[[displacement]]\n{q}\nvalue = 0.1\nload = {{ mass = 3 }}\n"), "add direction");
    fails(&format!("format = 1\n[[displacement]]\n{q}\nvalue = [0, 0, 1e-4]\n"), "are equal: there is no displacement");
    fails("format = 1\n[[displacement]]\njoints = [0, -60, 60]\n", "3 joint values, the robot has 6");
    fails("format = 1\n[[displacement]]\njoints = [0, -90, 90, 0, 0, 0]\n", "is angle = \"deg\" missing?");
    fails(&format!("format = 1\n[[place]]\n{q}\nvalue = [1, 2, 3]\n"), "add [instrument.NAME]");
    fails(&format!("format = 1\n[[frequency]]\n{q}\nhz = [5.0]\nmodes = [9]\nstd = 0.1\n"), "the model has 6 modes");
    fails(
        &format!("format = 1\nfit = [\"payload.mass\"]\n[[frequency]]\n{q}\nhz = [5.0]\nstd = 0.1\n"),
        "no parameter of this robot matches",
    );
    let robot = Robot::load(root().join("robots/kr210/kr210.urdf")).unwrap();
    let good = format!("format = 1\n[[displacement]]\n{q}\nvalue = [0, 0, -1e-4]\nload = {{ mass = 10 }}\n");
    std::fs::write(&job, good).unwrap();
    let error = identify_robot(&robot, &job, &IdentifyRequest::default()).unwrap_err();
    assert!(error.to_string().contains("no flexible link and no elastic drive"), "{error}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Truth: `tests/verification/kr300`, three recordings of a real KUKA KR 300 (MIT licence, see the
/// README there); the bounds come from a similar fit elsewhere: A2 8.7e6 (without one run 8.7e6 to
/// 8.9e6), A3 4.7e6 (4.6e6 to 5.0e6), A1 not identifiable.
#[test]
fn a_measured_robot_tells_two_of_its_gears_and_is_silent_about_the_third() {
    let robot = shipped("kr300");
    let folder = folder("kr300");
    let mut job = "format = 1\n".to_owned();
    let columns = |kind: &str, count: usize| {
        (1..=count).map(|k| format!("joint_a{k} = \"q_{kind}_{k}_rad\"")).collect::<Vec<_>>().join(", ")
    };
    for run in 1..=3 {
        let packed = std::fs::read(root().join(format!("tests/verification/kr300/kr300_run_{run}.csv.gz"))).unwrap();
        std::fs::write(folder.join(format!("run_{run}.csv")), flexarm_fe_io::unpack_gzip(&packed).unwrap()).unwrap();
        let (motor, link) = (columns("motor", 6), columns("link", 3));
        job += &format!(
            "[[encoders]]\nfile = \"run_{run}.csv\"\ntime = \"time_s\"\nmotor = {{ {motor} }}\nlink = {{ {link} }}\n"
        );
    }
    let arm = robot.model(&Modelling { drives: flexarm_run::DriveModel::Elastic, ..Modelling::default() }).unwrap();
    let names: Vec<String> = arm.joints().map(str::to_owned).collect();
    for (k, name) in names.iter().enumerate() {
        job = job.replace(&format!("joint_a{} =", k + 1), &format!("{name} ="));
    }
    std::fs::write(folder.join("job.toml"), job).unwrap();
    let modelling = Modelling { drives: flexarm_run::DriveModel::Elastic, ..Modelling::default() };
    let request = IdentifyRequest { modelling, ..IdentifyRequest::default() };
    let found = identify_robot(&robot, &folder.join("job.toml"), &request).unwrap();
    for gear in &found.encoders {
        eprintln!(
            "{}: {:.3e} +- {:.1e}, late {:.2} ms, R2 {:.2}, unseen {:.2?}, without each {:.0?}, rest {:.0} of {:.0} urad",
            gear.joint,
            gear.stiffness,
            gear.std,
            1e3 * gear.delay_s,
            gear.r2,
            gear.unseen_r2,
            gear.without_each,
            1e6 * gear.rest_rms,
            1e6 * gear.deflection_rms
        );
    }
    let [a1, a2, a3] = &found.encoders[..] else { panic!("three gears have encoders") };
    assert!(!a1.told && a2.told && a3.told);
    assert!((8.5e6..9.1e6).contains(&a2.stiffness) && (4.5e6..5.1e6).contains(&a3.stiffness));
    // Up to 12 Hz the ripple of the encoders remains; below 3 Hz the fit predicts unseen runs as
    // well as elsewhere.
    let slow = std::fs::read_to_string(folder.join("job.toml"))
        .unwrap()
        .replace("[[encoders]]\n", "[[encoders]]\nbelow = 3.0\n");
    std::fs::write(folder.join("slow.toml"), slow).unwrap();
    let slow = identify_robot(&robot, &folder.join("slow.toml"), &request).unwrap();
    let [_, a2, a3] = &slow.encoders[..] else { panic!("three gears have encoders") };
    eprintln!(
        "below 3 Hz: unseen {:.2?} and {:.2?}, rest {:.0} and {:.0} urad",
        a2.unseen_r2,
        a3.unseen_r2,
        1e6 * a2.rest_rms,
        1e6 * a3.rest_rms
    );
    for (unseen, reference) in [(&a2.unseen_r2, [0.75, 0.78, 0.45]), (&a3.unseen_r2, [0.71, 0.93, 0.52])] {
        for (r2, reference) in unseen.iter().zip(reference) {
            assert!(*r2 > reference - 0.06, "{r2} {reference}");
        }
    }
    let told: Vec<bool> = found.parameters.iter().map(|p| p.identifiable).collect();
    assert_eq!(told[..3], [false, true, true], "{:?}", found.parameters);
    assert!(told[3..].iter().all(|told| !told));
    std::fs::remove_dir_all(folder).unwrap();
}
