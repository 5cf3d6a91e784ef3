//! Choice of poses and loads to measure on a robot, and the files to fill in.
//!
//! Start at [`plan_measurements`]. Candidates are all pairs of a pose and a load; poses come from a table or
//! are spread over the joint ranges, loads from the request or from the effort limits. Not here: the
//! choice among the candidates ([`crate::plan`]), the limits of the drives ([`super::plan_load`]).

use std::path::{Path, PathBuf};

use flexarm_files::{NumberTable, check_apart, check_free, write_all};
use flexarm_kinematics::Wrench;
use flexarm_run::caveat::size::halton;
use flexarm_run::caveat::{Use, warnings};
use flexarm_run::{Arm, Error, Finding, Modelling, Robot};
use flexarm_settings::written::csv_field;
use nalgebra::{DVector, Vector3};
use serde::Serialize;

use super::error::refused;
use super::plan_load::Efforts;
use super::{joints_of, nominal};
use crate::estimation::{
    Component, IdentifyError, LoadCase, MeasuredArm, Measurements, NominalArm, Parameter, Plan, PlanOptions, Reading,
    ReadingKind, Row, plan,
};

/// Number of candidate poses if none are given.
const CANDIDATES: usize = 400;
/// Range of joints without limits to each side (rad; m for sliding joints).
const WITHOUT_LIMITS: f64 = std::f64::consts::PI;
/// Fraction of each joint's range that is used.
const RANGE: f64 = 0.9;

/// Arguments of [`plan_measurements`].
#[derive(Clone, Debug, Default)]
pub struct PlanRequest {
    /// Modelling of links and drives.
    pub modelling: Modelling,
    /// Names of the parameters to identify, with `*` as a wildcard; all stiffnesses if empty.
    pub fit: Vec<String>,
    /// Number of readings.
    pub count: usize,
    /// Candidate forces on the tool, world axes (N). If empty, forces downwards and to two sides that
    /// the effort limits of the joints allow, 500 N at most; poses where they exceed the limits are
    /// left out.
    pub forces: Vec<[f64; 3]>,
    /// Candidate points of application of the force, tool axes (m); the TCP if empty. A force
    /// causes no rotation about an axis through its point of application.
    pub levers: Vec<[f64; 3]>,
    /// Candidate points to measure on the tool, tool axes (m); the TCP if empty.
    pub points: Vec<[f64; 3]>,
    /// Candidate directions of a gauge, world axes. If empty, all three components of the
    /// displacement are measured.
    pub directions: Vec<[f64; 3]>,
    /// Standard deviation of a measured displacement (m).
    pub std_m: f64,
    /// Table of candidate poses, reachable and free of collisions (a column per joint; rad or m).
    pub poses: Option<PathBuf>,
    /// Table of poses where the robot will work. The plan minimises the uncertainty of the tool's
    /// deflection there under the first force.
    pub work: Option<PathBuf>,
    /// Folder for the files to fill in; none are written if absent.
    pub output: Option<PathBuf>,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

impl PlanRequest {
    /// Returns a request for a number of readings, measured to 0.03 mm.
    pub fn new(count: usize) -> Self {
        Self { count, std_m: 3e-5, ..Self::default() }
    }
}

/// Result of `flexarm identify --plan N`.
#[derive(Clone, Debug, Serialize)]
pub struct MeasurementPlan {
    /// Robot.
    pub robot: String,
    /// Joints, in the order of the pose values.
    pub joints: Vec<String>,
    /// Planned readings, most informative first.
    pub poses: Vec<PlannedReading>,
    /// Expected uncertainty of each parameter.
    pub parameters: Vec<ExpectedParameter>,
    /// Maximum standard deviation of the tool's displacement over the poses of the work and the
    /// axes (m); null without such poses.
    pub work_std_m: Option<f64>,
    /// Gain in information over the same number of candidates in their given order: half the
    /// logarithm of the ratio of the determinants, divided by the number of parameters. 0.69
    /// corresponds to half the standard deviation.
    pub gain_over_first: f64,
    /// Number of candidate poses.
    pub candidates: usize,
    /// File of measurements to fill in.
    pub file: Option<String>,
    /// Table to fill in.
    pub table: Option<String>,
    /// Caveats about the robot, as from `check`.
    pub caveats: Vec<Finding>,
    /// Sentences of the caveats that are warnings.
    pub warnings: Vec<String>,
}

/// Pose and load of a planned reading.
#[derive(Clone, Debug, Serialize)]
pub struct PlannedReading {
    /// Joint values (rad or m).
    pub joints: Vec<f64>,
    /// Force on the tool, world axes (N).
    pub force: [f64; 3],
    /// Point of application of the force, tool axes (m).
    pub at: [f64; 3],
    /// Measured point, tool axes (m).
    pub point: [f64; 3],
    /// Direction of the gauge, world axes; null if all three components are measured.
    pub direction: Option<[f64; 3]>,
    /// Predicted displacement of the point with the robot file as it is (m).
    pub expected_m: [f64; 3],
}

/// Load and measured quantity at a pose.
#[derive(Clone, Copy, Debug)]
struct Setup {
    /// Force, world axes (N).
    force: [f64; 3],
    /// Point of application, tool axes (m).
    at: [f64; 3],
    /// Measured point, tool axes (m).
    point: [f64; 3],
    /// Unit vector, world axes.
    direction: Option<[f64; 3]>,
}

/// Returns points on the tool; the TCP if there are none.
fn or_tcp(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    if points.is_empty() { vec![[0.0; 3]] } else { points.to_vec() }
}

impl PlanRequest {
    /// Returns all combinations of force, point of application, measured point and direction.
    fn setups(&self) -> Vec<Setup> {
        let unit = |d: &[f64; 3]| Some(Vector3::from(*d).normalize().into());
        let directions =
            if self.directions.is_empty() { vec![None] } else { self.directions.iter().map(unit).collect() };
        let mut all = Vec::new();
        for at in or_tcp(&self.levers) {
            for point in or_tcp(&self.points) {
                for direction in &directions {
                    let setup = |force: &[f64; 3]| Setup { force: *force, at, point, direction: *direction };
                    all.extend(self.forces.iter().map(setup));
                }
            }
        }
        all
    }

    /// Returns the files to write, none of which may be a file of the request or exist already.
    fn targets(&self) -> Result<Option<[PathBuf; 2]>, Error> {
        let Some(folder) = &self.output else { return Ok(None) };
        let targets = [folder.join("measurements.toml"), folder.join("displacements.csv")];
        let inputs: Vec<&Path> = self.poses.iter().chain(&self.work).map(|path| &**path).collect();
        check_apart(&targets, &inputs)?;
        check_free(&targets, self.overwrite)?;
        Ok(Some(targets))
    }

    /// Returns the reason why the request is invalid, as a sentence.
    fn fault(&self) -> Option<String> {
        if self.count == 0 || !(self.std_m > 0.0 && self.std_m.is_finite()) {
            return Some("a plan needs at least one reading and a positive standard deviation".into());
        }
        for (what, rows) in
            [("force", &self.forces), ("lever", &self.levers), ("point", &self.points), ("direction", &self.directions)]
        {
            if let Some(bad) = rows.iter().flatten().find(|x| !x.is_finite()) {
                return Some(format!("a {what} has the entry {bad}, expected finite numbers"));
            }
        }
        if let Some(force) = self.forces.iter().find(|force| Vector3::from(**force).norm() < 1e-9) {
            return Some(format!("the force {force:?} is zero and causes no displacement: give a nonzero force (N)"));
        }
        let none = self.directions.iter().find(|d| Vector3::from(**d).norm() < 1e-9);
        none.map(|d| format!("the direction {d:?} of a gauge has zero length"))
    }
}

/// Expected uncertainty of a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ExpectedParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Present value.
    pub initial: f64,
    /// Standard deviation after the measurement.
    pub std: f64,
}

/// Chooses poses and loads at which displacements of the tool give the most information about the
/// robot's parameters.
///
/// # Errors
/// [`Error::File`] for a table without valid poses, [`super::IdentifyFileError`] if there is nothing to
/// identify, [`Error::Taken`], [`Error::Write`].
pub fn plan_measurements(robot: &Robot, request: &PlanRequest) -> Result<MeasurementPlan, Error> {
    let arm = robot.model(&request.modelling)?;
    let (joints, slides): (Vec<String>, Vec<bool>) = joints_of(&arm).into_iter().unzip();
    if let Some(text) = request.fault() {
        return Err(refused(text));
    }
    if arm.springs.is_empty() {
        let text = "the robot has no flexible link and no elastic drive: loads do not displace it, so there is nothing to \
                    plan; add [[flexible_link]] or [[drive]] entries with initial values";
        return Err(refused(text));
    }
    let targets = request.targets()?;
    // Parameters, poses, and forces that the drives hold there.
    let fitted = super::chosen(&arm, &super::MeasurementInput::default(), &request.fit)?;
    let fitted: Vec<Parameter> = fitted.into_iter().map(|candidate| candidate.parameter).collect();
    let poses = match &request.poses {
        Some(path) => poses_of(path, &joints)?,
        None => spread_poses(&arm),
    };
    let efforts = Efforts::of(&arm, &poses)?;
    let (chosen_forces, mut request) = (!request.forces.is_empty(), request.clone());
    if !chosen_forces {
        request.forces = efforts.default_forces(&or_tcp(&request.levers));
    }
    let request = &request;
    // Candidates, and the readings whose uncertainty the plan minimises.
    let pairs = allowed(&efforts, poses.len(), &request.setups(), if chosen_forces { 0 } else { request.count });
    let candidates: Vec<Reading> =
        pairs.iter().map(|(pose, setup)| displacement(&poses[*pose], setup, request.std_m)).collect();
    let purpose = work_readings(request, &joints)?;
    // The choice, with what it demands of the drives.
    let nominal = nominal(&arm);
    let options = PlanOptions { count: request.count, purpose };
    let [best, first] = plans(&nominal, &fitted, &candidates, &options)?;
    let mut caveats = arm.caveats(Use::Any);
    let over = best.chosen.iter().filter_map(|k| efforts.excess(pairs[*k].0, pairs[*k].1.force, pairs[*k].1.at));
    caveats.extend(load_caveat(&over.collect::<Vec<_>>(), best.chosen.len()));
    let mut answer = MeasurementPlan {
        warnings: warnings(&caveats),
        caveats,
        robot: robot.name.clone(),
        poses: planned(&nominal, &candidates, &best, &pairs)?,
        joints,
        parameters: fitted.iter().zip(&best.deviations).map(expected).collect(),
        work_std_m: best.purpose.iter().copied().reduce(f64::max),
        gain_over_first: 0.5 * (best.gain - first.gain) / fitted.len() as f64,
        candidates: poses.len(),
        file: None,
        table: None,
    };
    if let Some([file, table]) = targets {
        let texts = [(file.clone(), job(&answer, request)), (table.clone(), to_fill_in(&answer, request, &slides))];
        write_all(&texts)?;
        (answer.file, answer.table) = (Some(file.display().to_string()), Some(table.display().to_string()));
    }
    Ok(answer)
}

/// Returns the displacements of the TCP at the poses of the work under the first force; none without
/// such poses.
fn work_readings(request: &PlanRequest, joints: &[String]) -> Result<Vec<Reading>, Error> {
    let Some(path) = &request.work else { return Ok(Vec::new()) };
    let work = Setup { force: request.forces[0], at: [0.0; 3], point: [0.0; 3], direction: None };
    Ok(poses_of(path, joints)?.iter().map(|q| displacement(q, &work, request.std_m)).collect())
}

/// Returns the poses and setups whose loads the drives can hold, if there are `least` of them above 0;
/// otherwise all.
fn allowed(efforts: &Efforts, poses: usize, setups: &[Setup], least: usize) -> Vec<(usize, Setup)> {
    let all: Vec<(usize, Setup)> = (0..poses).flat_map(|pose| setups.iter().map(move |setup| (pose, *setup))).collect();
    let light = all.iter().copied().filter(|(pose, setup)| efforts.excess(*pose, setup.force, setup.at).is_none());
    let light: Vec<(usize, Setup)> = light.collect();
    if least > 0 && light.len() >= least { light } else { all }
}

/// Returns the caveat about planned loads that exceed effort limits: joints, and their shares of them.
fn load_caveat(over: &[(&str, f64)], readings: usize) -> Option<Finding> {
    let (joint, share) = over.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let text = format!(
        "the loads of {} of {readings} readings exceed effort limits, that of joint {joint:?} by a factor of \
         {share:.1}",
        over.len()
    );
    let remedy = "give smaller forces, or none: then they follow from the limits";
    Some(Finding::warning("plan-load", "plan", text, remedy))
}

/// Returns the best plan, and the one with the same number of candidates in their given order.
fn plans(
    nominal: &NominalArm,
    fitted: &[Parameter],
    candidates: &[Reading],
    options: &PlanOptions,
) -> Result<[Plan; 2], Error> {
    let plan = |candidates: &[Reading]| plan(nominal, fitted, candidates, options).map_err(IdentifyError::from);
    let best = plan(candidates)?;
    if best.chosen.len() < options.count {
        let text = format!("only {} of {} readings are possible at these poses", best.chosen.len(), options.count);
        return Err(refused(text));
    }
    Ok([best, plan(&candidates[..options.count.min(candidates.len())])?])
}

/// Returns the expected uncertainty of a parameter from that of its search coordinate.
fn expected((parameter, std): (&Parameter, &f64)) -> ExpectedParameter {
    ExpectedParameter {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        initial: parameter.initial,
        std: parameter.deviation(0.0, *std),
    }
}

/// Returns the displacement from no load to the force of a setup, in all axes or along its direction.
fn displacement(q: &[f64], setup: &Setup, std: f64) -> Reading {
    let wrench = Wrench::new(Vector3::from(setup.force), Vector3::zeros());
    let all = [Vector3::x(), Vector3::y(), Vector3::z()];
    let axes = setup.direction.map_or_else(|| all.to_vec(), |direction| vec![Vector3::from(direction)]);
    let kind = ReadingKind::Displacement {
        before: LoadCase::none(),
        after: LoadCase { wrench, at: Vector3::from(setup.at), ..LoadCase::none() },
        point: Vector3::from(setup.point),
        rows: axes.into_iter().map(|d| Row { of: Component::along(d), value: 0.0, std }).collect(),
    };
    Reading { name: format!("pose {q:?}"), q: q.to_vec(), kind }
}

/// Poses spread over the joint ranges as Halton points.
fn spread_poses(arm: &Arm) -> Vec<Vec<f64>> {
    let model = &arm.model;
    let ranges: Vec<(f64, f64)> = model.coordinates()[..model.n_actuated()]
        .iter()
        .map(|c| {
            let bound = |x: f64, other: f64| if x.is_finite() { x } else { other };
            let (a, b) = (bound(c.limits.lower, -WITHOUT_LIMITS), bound(c.limits.upper, WITHOUT_LIMITS));
            let (middle, half) = (0.5 * (a + b), 0.5 * RANGE * (b - a));
            (middle - half, middle + half)
        })
        .collect();
    let pose = |k: u32| ranges.iter().enumerate().map(|(j, (a, b))| a + (b - a) * halton(k + 20, j)).collect();
    (1..=CANDIDATES as u32).map(pose).collect()
}

/// Reads poses from a table with a column per joint.
fn poses_of(path: &Path, joints: &[String]) -> Result<Vec<Vec<f64>>, Error> {
    let table = NumberTable::read(path)?;
    let columns = joints.iter().map(|joint| {
        let missing = || format!("there is no column for joint {joint:?}; found {:?}", table.names);
        table.column(joint).ok_or_else(|| table.error(None, missing()))
    });
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let pose = |(number, row): (usize, &Vec<f64>)| -> Result<Vec<f64>, Error> {
        let q: Vec<f64> = columns.iter().map(|k| row[*k]).collect();
        match q.iter().position(|x| !x.is_finite()) {
            None => Ok(q),
            Some(k) => Err(table.error(Some(number), format!("joint {:?} has no value", joints[k])).into()),
        }
    };
    let poses = table.rows.iter().enumerate().map(pose).collect::<Result<Vec<_>, _>>()?;
    match poses.is_empty() {
        true => Err(table.error(None, "the table has no poses").into()),
        false => Ok(poses),
    }
}

/// Returns the chosen readings with the displacements that the robot file as it is predicts.
fn planned(
    nominal: &NominalArm,
    candidates: &[Reading],
    best: &Plan,
    pairs: &[(usize, Setup)],
) -> Result<Vec<PlannedReading>, Error> {
    let one = |number: &usize| {
        let setup = pairs[*number].1;
        let q = candidates[*number].q.clone();
        let reading = displacement(&q, &Setup { direction: None, ..setup }, 1.0);
        let measurements = Measurements { readings: vec![reading], ..Measurements::default() };
        let arm = MeasuredArm { nominal, parameters: &[], measurements: &measurements };
        let moved = arm.predicted(&DVector::zeros(0)).map_err(IdentifyError::from)?;
        let Setup { force, at, point, direction } = setup;
        Ok(PlannedReading { joints: q, force, at, point, direction, expected_m: [moved[0], moved[1], moved[2]] })
    };
    best.chosen.iter().map(one).collect()
}

/// Returns a file of measurements that refers to the table.
fn job(answer: &MeasurementPlan, request: &PlanRequest) -> String {
    let fit = match request.fit.is_empty() {
        true => String::new(),
        false => format!("fit = {:?}\n", request.fit),
    };
    let (read, how) = match request.directions.is_empty() {
        true => ("dx, dy, dz", "world axes"),
        false => ("d", "along ux, uy, uz, world axes"),
    };
    let what = if request.points.is_empty() { "the TCP" } else { "the point px, py, pz (mm, tool axes)" };
    let lever = if request.levers.is_empty() { "" } else { ", which acts at ax, ay, az (mm, tool axes)" };
    format!(
        "# Measurements of {}: {} readings, planned by flexarm identify.\n\
         # Fill in {read} of displacements.csv (mm, {how}): displacement of {what} from no load to the force{lever}.\n\
         # Then: flexarm identify ROBOT measurements.toml\n\
         format = 1\nlength = \"mm\"\nangle = \"deg\"\n{fit}\n[[displacement]]\nfile = \"displacements.csv\"\nstd = {}\n",
        answer.robot,
        answer.poses.len(),
        1e3 * request.std_m
    )
}

/// Returns the table with empty cells.
fn to_fill_in(answer: &MeasurementPlan, request: &PlanRequest, slides: &[bool]) -> String {
    let (levers, gauges) = (!request.levers.is_empty(), !request.directions.is_empty());
    let points = !request.points.is_empty();
    let lever = if levers { ",ax,ay,az" } else { "" };
    let point = if points { ",px,py,pz" } else { "" };
    let read = if gauges { ",ux,uy,uz,d" } else { ",dx,dy,dz" };
    let joints: Vec<String> = answer.joints.iter().map(|joint| csv_field(joint)).collect();
    let mut out = format!("{},fx,fy,fz{lever}{point}{read}\n", joints.join(","));
    // Joints in degrees or mm, forces in N, lengths in mm; the readings stay empty.
    for pose in &answer.poses {
        let joint_text = |(q, slides): (&f64, &bool)| format!("{:.4}", if *slides { 1e3 * q } else { q.to_degrees() });
        let joints: Vec<String> = pose.joints.iter().zip(slides).map(joint_text).collect();
        let three = |[x, y, z]: [f64; 3]| format!(",{x},{y},{z}");
        out += &format!("{}{}", joints.join(","), three(pose.force));
        if levers {
            out += &three(pose.at.map(|x| 1e3 * x));
        }
        if points {
            out += &three(pose.point.map(|x| 1e3 * x));
        }
        out += &match pose.direction {
            Some(direction) => three(direction) + ",\n",
            None => ",,,\n".to_owned(),
        };
    }
    out
}
