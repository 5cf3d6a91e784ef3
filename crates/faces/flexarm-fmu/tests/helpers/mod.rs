//! Robots, motions and variables of the tests.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::{Arm, DriveModel, LinkModel, LoadOptions, Modelling, RobotSource};
use flexarm_fmu::{FmuModel, FmuSettings};

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

pub(crate) fn robot(name: &str) -> PathBuf {
    root().join("robots").join(name).join("robot.toml")
}

/// Loads the arm of the shipped kr210 with a changed robot file.
pub(crate) fn changed_kr210(document: &toml_edit::DocumentMut) -> Arc<Arm> {
    let (path, options) = (robot("kr210"), LoadOptions::default());
    RobotSource { text: Some(&document.to_string()), ..RobotSource::new(&path, &options) }.load().unwrap()
}

pub(crate) fn settings(links: LinkModel, drives: DriveModel) -> FmuSettings {
    FmuSettings { modelling: Modelling { links, drives, ..Modelling::default() }, ..FmuSettings::default() }
}

/// Targets of a smooth swing of all joints that starts at rest.
pub(crate) fn targets(from: &[f64], t: f64) -> (Vec<f64>, Vec<f64>) {
    let swing = |k: usize| (0.05 + 0.01 * k as f64, 3.0 + k as f64);
    let q = from.iter().enumerate().map(|(k, q)| q + swing(k).0 * (1.0 - (swing(k).1 * t).cos()));
    let qdot = from.iter().enumerate().map(|(k, _)| swing(k).0 * swing(k).1 * (swing(k).1 * t).sin());
    (q.collect(), qdot.collect())
}

/// References of a variable of every joint that has it.
pub(crate) fn of_joints(model: &FmuModel, what: &str) -> Vec<usize> {
    let ending = format!(".{what}");
    let names = model.variables().iter().enumerate();
    names.filter(|(_, v)| v.name.starts_with("joint.") && v.name.ends_with(&ending)).map(|(k, _)| k).collect()
}

pub(crate) fn values(model: &FmuModel, names: &[&str]) -> Vec<f64> {
    names.iter().map(|name| model.get(model.find(name).unwrap()).unwrap()).collect()
}
