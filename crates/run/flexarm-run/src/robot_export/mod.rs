//! A flexible arm for other simulators: MJCF for MuJoCo, and URDF with a file of springs.
//!
//! Every elastic coordinate becomes a joint. Stiffness and damping are those of the arm at the pose;
//! [`springs`] splits coupled matrices into springs over several joints, which MuJoCo calls fixed
//! tendons. Parts that a format cannot express are listed. Start at [`Arm::export`].

mod mjcf;
mod parts;
mod springs;
mod urdf;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_kinematics::{ElasticAngles, JointMotion};
use flexarm_settings::Words;
use serde::Serialize;
use serde_json::json;

use self::parts::{Axis, parts, with_mass};
use self::springs::{Springs, step};
use crate::arm::Arm;
use crate::error::Error;
use crate::poses::posed::Posed;

/// Description of robots that another simulator reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotFormat {
    /// MuJoCo's own, with springs as tendons.
    Mjcf,
    /// URDF: elastic coordinates are joints without springs, which are in a JSON file.
    Urdf,
}

impl Words for RobotFormat {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("mjcf", Self::Mjcf, "MuJoCo: springs as joint stiffness and tendons"),
        ("urdf", Self::Urdf, "A joint per elastic coordinate, with springs.json; Pinocchio, Drake"),
    ];
}

/// Files of an exported arm.
#[derive(Clone, Debug, Serialize)]
pub struct RobotExport {
    /// Step size with which MuJoCo stays within 0.5 % of the largest deflection (s); for MJCF.
    pub step_s: Option<f64>,
    /// Parts of the arm that the format cannot express.
    pub left_out: Vec<String>,
    /// Names and contents of the files, relative to one folder; the description comes first.
    #[serde(skip)]
    pub files: Vec<(PathBuf, Vec<u8>)>,
}

impl Arm {
    /// Returns the files that describe the arm for another simulator, at rest at a pose.
    ///
    /// * `at`: values of all actuated joints (rad or m), zero by default.
    ///
    /// # Errors
    /// [`Error::Value`] for arms with modal links,
    /// closed loops or screw joints; [`Error::Pose`] for joint values that do not fit.
    pub fn export(self: &Arc<Self>, at: Option<&[f64]>, format: RobotFormat) -> Result<RobotExport, Error> {
        let posed = self.posed(at)?;
        let (mut parts, mut files) = parts(self.robot(), &posed)?;
        let springs = Springs::of(&posed.plant);
        let step_s = step(&posed.plant);
        let mut left_out = left_out(&posed);
        let (text, ending) = match format {
            RobotFormat::Mjcf => {
                parts = with_mass(parts)?;
                if parts.iter().flat_map(|part| &part.joints).any(|axis| axis.follows.is_some()) {
                    left_out.push("exact mimic joints: MuJoCo holds them by soft constraints".into());
                }
                (mjcf::text(self.robot(), &posed, &parts, &springs, step_s), "xml")
            }
            RobotFormat::Urdf => (urdf::text(self.robot(), &posed, &parts), "urdf"),
        };
        let axes: Vec<&Axis> = parts.iter().flat_map(|part| &part.joints).collect();
        let name = format!("{}.{ending}", file_name(&self.robot().name));
        files.insert(0, (name.into(), text.into_bytes()));
        files.insert(1, ("springs.json".into(), springs_json(&posed, &axes, &springs, step_s, &left_out).into_bytes()));
        Ok(RobotExport { step_s: (format == RobotFormat::Mjcf).then_some(step_s), left_out, files })
    }
}

impl RobotExport {
    /// Writes the files into a folder; returns their paths.
    ///
    /// # Errors
    /// [`Error::Taken`] for an existing file without `overwrite`, [`Error::Write`].
    pub fn write(&self, folder: &Path, overwrite: bool) -> Result<Vec<PathBuf>, Error> {
        let files: Vec<_> = self.files.iter().map(|(name, bytes)| (folder.join(name), bytes)).collect();
        let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
        flexarm_files::check_free(&paths, overwrite)?;
        flexarm_files::write_all(&files)?;
        Ok(paths)
    }
}

/// Numbers as XML attributes have them; each reads back as the same number.
fn numbers(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(" ")
}

/// Name that every file system takes.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect()
}

/// Joints of the elastic coordinates, their matrices, rest position, and what is left out.
fn springs_json(posed: &Posed, axes: &[&Axis], springs: &Springs, step_s: f64, left_out: &[String]) -> String {
    let n = posed.plant.model.n_actuated();
    let joint = |k: usize| axes.iter().find(|axis| axis.coordinate == k).map_or("", |axis| axis.name.as_str());
    let rows = |M: &nalgebra::DMatrix<f64>| -> Vec<Vec<f64>> {
        M.row_iter().map(|row| row.iter().copied().collect()).collect()
    };
    let rotors: Vec<f64> = (0..n).map(|k| posed.plant.model.rotor_inertia(k)).collect();
    let text = json!({
        "joints": (n..posed.plant.model.nv()).map(joint).collect::<Vec<_>>(),
        "stiffness": rows(&springs.K),
        "damping": rows(&springs.D),
        "rest": posed.plant.modes.equilibrium.as_slice(),
        "motors": (0..n).map(joint).collect::<Vec<_>>(),
        "rotor_inertia": rotors,
        "at": posed.at,
        "gravity": posed.plant.model.gravity.as_slice(),
        "mujoco_step_s": step_s,
        "left_out": left_out,
    });
    format!("{text:#}\n")
}

/// Lists the parts of the arm that neither format can express.
fn left_out(posed: &Posed) -> Vec<String> {
    let arm = &posed.plant;
    let mut list = Vec::new();
    let mut add = |there: bool, what: String| list.extend(there.then_some(what));
    let named = |of: Vec<&str>| of.join(", ");
    let bent: Vec<&str> = arm.elements.iter().filter(|e| e.curve.is_some()).map(|e| e.name.as_str()).collect();
    add(!bent.is_empty(), format!("play and nonlinear stiffness of {}: a constant stiffness is written", named(bent)));
    let stiffened = arm.elements.iter().any(|element| element.geometric.is_some());
    add(stiffened, "stiffness that depends on the load".into());
    // Joints of six degrees of freedom become three revolute ones in a row.
    let turns = |e: &&flexarm_stepping::ElasticElement| {
        arm.model.bodies()[e.body].motion == JointMotion::Elastic(ElasticAngles::RotationVector)
    };
    let turning: Vec<&str> = arm.elements.iter().filter(turns).map(|e| e.name.as_str()).collect();
    add(
        !turning.is_empty(),
        format!(
            "rotation vectors of {}: the joints are Z-Y-X angles, equal to first order (exact with angles = \"euler-zyx\")",
            named(turning)
        ),
    );
    add(arm.has_hysteresis(), "hysteresis of gears".into());
    add(!arm.transmission.is_empty(), "transmission errors of gears".into());
    add(!arm.friction.is_empty() || !arm.load_friction.is_empty(), "friction of drives".into());
    add(arm.coupling.is_some(), "motors that move several joints".into());
    add(arm.servo.is_some(), "servos: gains and sampling; the motors take torques".into());
    add(!arm.model.balancers().is_empty(), "balancers".into());
    list
}
