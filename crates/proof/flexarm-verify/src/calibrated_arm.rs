//! A UR5 under a laser tracker: the fit of joint frames, zeros and gears runs, and predicts poses that
//! are not used in it.

use std::path::Path;

use flexarm::Robot;
use flexarm::identify::{Identification, IdentifyRequest, identify_robot};
use flexarm_files::NumberTable;
use flexarm_kinematics::{Pose, Wrench};
use nalgebra::{Rotation3, Vector3};

use crate::Error;
use crate::Pace;
use crate::bench::Bench;
use crate::page::{Bound, Case, Table, fixed, percent, word};

const FOLDER: &str = "tests/ur5";
/// Bound of the distance on poses that were not used: a rigid robot with fitted frames of another
/// program gives 0.115 mm from twice as many poses.
const UNSEEN_MM: f64 = 0.118;
/// Bounds of the share of unseen numbers in their 95 % interval.
const COVERED: [f64; 2] = [0.90, 0.99];
/// Bound of the residuals of the written file over the reported ones.
const WRITTEN: f64 = 1e-6;
/// Normal quantile of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// A fit and how well its robot file predicts.
struct Fitted {
    name: &'static str,
    found: Identification,
    /// Residuals of the written file (m), of fitted and of unseen poses.
    residuals: [Vec<Vector3<f64>>; 2],
}

/// Runs the case.
pub(crate) fn case(bench: &Bench, pace: &mut Pace<'_>) -> Result<Case, Error> {
    let robot = bench.robot(&format!("{FOLDER}/robot.toml"))?;
    let fits = [("joint frames and zeros", &["joint.*"][..]), ("and gears", &["joint.*", "drive.*"][..])];
    let mut all = Vec::new();
    for (k, (name, fit)) in fits.into_iter().enumerate() {
        all.push(fitted(bench, &robot, name, fit)?);
        pace.at(0.5 * (k + 1) as f64);
    }
    Ok(page(&all, &weight_torques(&robot, &bench.file(&format!("{FOLDER}/fit.csv")))?))
}

/// Returns the root mean square of each joint's torque by the weight over the poses of a table (N m).
fn weight_torques(robot: &Robot, path: &Path) -> Result<[f64; 6], Error> {
    let table = NumberTable::read(path).map_err(flexarm::Error::from)?;
    let recursions = robot.recursions()?;
    let (mut squares, mut torques) = ([0.0; 6], [0.0; 6]);
    for row in &table.rows {
        let q: Vec<f64> = row[..6].iter().map(|deg| deg.to_radians()).collect();
        recursions.gravity_forces(&q, &mut torques)?;
        squares.iter_mut().zip(torques).for_each(|(sum, torque)| *sum += torque * torque);
    }
    Ok(squares.map(|sum| (sum / table.rows.len() as f64).sqrt()))
}

fn fitted(bench: &Bench, robot: &Robot, name: &'static str, fit: &[&str]) -> Result<Fitted, Error> {
    let output = bench.scratch.join(name);
    let request = IdentifyRequest {
        fit: fit.iter().map(|&name| name.to_owned()).collect(),
        output: Some(output.clone()),
        overwrite: true,
        ..IdentifyRequest::default()
    };
    let found = identify_robot(robot, &bench.file(&format!("{FOLDER}/measurements.toml")), &request)?;
    let written = Robot::load(output.join("robot.toml"))?;
    let of = |file: &str| residuals(&written, &found, &bench.file(&format!("{FOLDER}/{file}")));
    let residuals = [of("fit.csv")?, of("others.csv")?];
    Ok(Fitted { name, found, residuals })
}

/// Returns predicted minus measured places in the axes of the tracker (m).
fn residuals(robot: &Robot, found: &Identification, path: &Path) -> Result<Vec<Vector3<f64>>, Error> {
    let table = NumberTable::read(path).map_err(flexarm::Error::from)?;
    let (tracker, reflector) = (&found.instruments[0], Vector3::from(found.targets[0].xyz));
    let [roll, pitch, yaw] = tracker.rpy;
    let X_WI = Pose::from_parts(tracker.xyz.into(), Rotation3::from_euler_angles(roll, pitch, yaw));
    let mut point = robot.model(&Default::default())?.operating_point()?;
    let mut all = Vec::new();
    for row in &table.rows {
        let q: Vec<f64> = row[..6].iter().map(|deg| deg.to_radians()).collect();
        let unsolved = |source| flexarm::Error::Step { source, partial: false };
        point.solve(&q, &Wrench::zeros()).map_err(unsolved)?;
        let measured = X_WI.inverse() * (point.tcp_pose() * nalgebra::Point3::from(reflector));
        all.push(measured.coords - 1e-3 * Vector3::new(row[6], row[7], row[8]));
    }
    Ok(all)
}

impl Fitted {
    /// Returns the root mean square of the distances of fitted and of unseen poses (mm).
    fn rms_mm(&self) -> [f64; 2] {
        let square = |all: &Vec<Vector3<f64>>| all.iter().map(Vector3::norm_squared).sum::<f64>();
        [0, 1].map(|k| 1e3 * (square(&self.residuals[k]) / self.residuals[k].len() as f64).sqrt())
    }

    /// Returns the share of unseen numbers in their 95 % interval.
    fn covered(&self) -> f64 {
        let std = self.found.model_errors.first().map_or(f64::NAN, |model| model.error);
        let numbers: Vec<f64> = self.residuals[1].iter().flat_map(|r| r.iter().copied()).collect();
        numbers.iter().filter(|r| r.abs() <= INTERVAL * std).count() as f64 / numbers.len() as f64
    }
}

/// Claims of a fit: prediction against the tracker at the other poses, the share of their numbers
/// within the stated uncertainty, and the residuals of the written file, which must be those reported.
fn claims_of(case: &mut Case, fit: &Fitted) {
    let truth = "laser tracker";
    let [own, others] = fit.rms_mm();
    let reported = 1e3 * 3f64.sqrt() * fit.found.residual.after;
    let name = fit.name;
    let distance = format!("{name}: distance at other poses [m]");
    case.claim(distance, truth, 1e-3 * others, Bound::AtMost(1e-3 * UNSEEN_MM));
    case.claim(format!("{name}: share in its interval"), truth, fit.covered(), Bound::AtLeast(COVERED[0]));
    case.claim(format!("{name}: share in its interval"), truth, fit.covered(), Bound::AtMost(COVERED[1]));
    let written = (own / reported - 1.0).abs();
    case.claim(format!("{name}: written file against reported residuals"), "identity", written, Bound::AtMost(WRITTEN));
}

fn page(all: &[Fitted], weight_torques: &[f64; 6]) -> Case {
    let mut case = Case::new(
        "calibrated-arm",
        "9. A UR5 under a laser tracker",
        "places by a laser tracker, predicted at poses that were not used",
    );
    case.text(
        "500 poses of a grid (`tests/ur5`, MIT licence), no load but the arm's own weight. Every second pose is used for the \
         fit, which starts from the nominal robot; pose of the tracker and place of the reflector are found as well. The robot \
         file that the fit writes predicts the other poses.",
    );
    // Distances from the tracker's places, of poses in the fit and of poses outside it.
    let heads = ["fitted", "numbers", "fitted poses", "other poses", "in their 95 % interval"];
    let mut table = Table::new("Root mean square of the distance from the measured place [mm].", &heads);
    for fit in all {
        let [own, others] = fit.rms_mm();
        table.rows.push(vec![
            word(fit.name),
            word(fit.found.parameters.len().to_string()),
            fixed(own, 4),
            fixed(others, 4),
            word(percent(fit.covered(), 1)),
        ]);
    }
    case.table(table);
    for fit in all {
        claims_of(&mut case, fit);
    }
    // Gears that carry little weight must be reported as not identifiable.
    if let Some(last) = all.last() {
        let of = |joint: usize| format!("drive.joint_{joint}.gearbox.stiffness");
        let is_identifiable =
            |joint: &usize| last.found.parameters.iter().any(|p| p.name == of(*joint) && p.identifiable);
        let count = (4..=6).filter(is_identifiable).count() as f64;
        case.claim("determined stiffnesses of joints 4 to 6, which carry little", "statics", count, Bound::AtMost(0.0));
    }
    // The loads on the joints, which explain the small effect of the gears.
    let torques: Vec<String> = weight_torques.iter().map(|torque| format!("{torque:.1}")).collect();
    let [before, after] = [&all[0], &all[1]].map(|fit| fit.rms_mm()[1]);
    case.text(format!(
        "The weight loads the six joints with {} N m (root mean square over the fitted poses). At the other poses, gears \
         reduce the distance from {before:.3} to {after:.3} mm.",
        torques.join(", ")
    ));
    case
}
