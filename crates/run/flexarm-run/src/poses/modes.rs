//! Natural modes at a pose, with drives locked, under their servos, or turning at constant speed:
//! frequencies, damping, TCP motion and strain energy of the links.
//!
//! Start at [`Arm::modes`]. World axes at the TCP, six-vectors linear first. Not here: the
//! eigenvalue problem (`flexarm_analysis::damped_modes`), recordings of modes (`mode_recording`).

use std::sync::Arc;

use flexarm_analysis::{
    DampedMode, LinearError, compliance_parts, damped_modes, effective_mass, mode_outputs, strain_energy_shares,
};
use flexarm_stepping::{Linear, linearise_rotation};
use nalgebra::{DMatrix, Vector6};
use serde::Serialize;

use crate::arm::Arm;
use crate::arm::joint_values::joint_values;
use crate::arm::options::Modelling;
use crate::caveat::{self, Finding, kinds};
use crate::error::Error;
use crate::poses::posed::{Posed, step_error};
use crate::run::summary::Files;

/// Result of `flexarm modes`. SI units; world axes, at the TCP; six-vectors linear first.
#[derive(Clone, Debug, Serialize)]
pub struct ModeTable {
    /// Name of the robot.
    pub robot: String,
    /// Locked joints, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which they are locked (rad or m).
    pub at: Vec<f64>,
    /// Speeds at which the joints turn instead of being locked (rad/s or m/s); left out at rest.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub speeds: Vec<f64>,
    /// Joints under a servo instead of locked; the servo acts as spring and damper here.
    pub driven: Vec<String>,
    /// Link that carries the TCP.
    pub tcp: String,
    /// Natural frequencies `|λ| / 2π` (Hz), ascending.
    pub frequencies_hz: Vec<f64>,
    /// Undamped frequencies (Hz), ascending, the same number.
    pub undamped_frequencies_hz: Vec<f64>,
    /// Damping ratios `-Re λ / |λ|`.
    pub damping_ratio: Vec<f64>,
    /// Elastic elements, in the order of `strain_energy`.
    pub elements: Vec<String>,
    /// One entry per mode.
    pub modes: Vec<ModeFigures>,
    /// Total number of modes; `modes` may contain fewer.
    pub total: usize,
    /// Fraction of the static compliance covered by the listed modes, per TCP direction; null where
    /// the compliance is zero, and for a turning arm.
    pub compliance_covered: [Option<f64>; 6],
    /// Written files.
    pub files: Files,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Probable errors in the input, and limits of the result's validity.
    pub caveats: Vec<Finding>,
}

/// Figures of one mode.
#[derive(Clone, Debug, Serialize)]
pub struct ModeFigures {
    /// Natural frequency (Hz).
    pub frequency_hz: f64,
    /// Damped frequency (Hz).
    pub damped_frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// TCP motion in the mode at unit modal mass (1/sqrt(kg), rad/sqrt(kg m²) ...), real part.
    pub tcp: [f64; 6],
    /// Imaginary part; zero for proportional damping.
    pub tcp_imaginary: [f64; 6],
    /// Effective mass at the TCP (kg), or moment of inertia for rotations (kg m²); null at a node.
    pub effective_mass: [Option<f64>; 6],
    /// Fraction of the static compliance of the TCP carried by this mode, per direction; null where
    /// the compliance is zero, and for a turning arm: Coriolis forces couple the shares of its
    /// modes.
    pub compliance_share: [Option<f64>; 6],
    /// Share of each element in the strain energy.
    pub strain_energy: Vec<f64>,
    /// Relative residual of the eigenvalue equation.
    pub residual: f64,
}

/// Change of the forces during rotation above which it is not steady.
const STEADY: f64 = 1e-3;
/// Factor by which twice as many modes of a link reduce the error of a frequency; measured on a
/// swept blade: 2.5 % with 16 modes, 0.2 % with 32.
const HALVED: f64 = 8.0;
/// Estimated error of a frequency above which the modes of the links are too few.
const MODES_ENOUGH: f64 = 0.01;
/// Effective mass above which the TCP is at a node (kg, kg m²).
const NODE: f64 = 1e12;

impl ModeFigures {
    fn new(mode: &DampedMode, model: &ModeModel, compliance: &Vector6<f64>) -> Self {
        let (linear, C) = (&model.linear, tool_map(&model.linear));
        let output = mode_outputs(mode, &C);
        let at_rest = model.speeds.is_empty();
        let parts = compliance_parts(mode, &linear.M, &linear.D, &C).filter(|_| at_rest);
        let six = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
        Self {
            frequency_hz: mode.frequency_hz(),
            damped_frequency_hz: mode.damped_frequency_hz(),
            damping_ratio: mode.damping_ratio(),
            tcp: six(&|i| output[i].re),
            tcp_imaginary: six(&|i| output[i].im),
            effective_mass: std::array::from_fn(|i| Some(effective_mass(output[i])).filter(|m| *m < NODE)),
            compliance_share: std::array::from_fn(|i| share(parts.as_ref()?[i], compliance[i])),
            strain_energy: strain_energy_shares(&mode.shape, &blocks(linear)),
            residual: mode.residual,
        }
    }
}

/// Jacobian of the TCP twist with respect to the rates of the free coordinates.
pub(crate) fn tool_map(linear: &Linear) -> DMatrix<f64> {
    DMatrix::from_fn(6, linear.J.ncols(), |i, j| linear.J[(i, j)])
}

/// Returns first coordinate and stiffness of each elastic element.
fn blocks(linear: &Linear) -> Vec<(usize, DMatrix<f64>)> {
    let block = |first: usize, n: usize| linear.springs.view((first, first), (n, n)).into_owned();
    linear.elements.iter().map(|(_, range)| (range.start, block(range.start, range.len()))).collect()
}

/// Returns a part of a whole; `None` if there is no whole.
fn share(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// Computes all damped modes of a linearised structure.
pub(crate) fn modes_of(linear: &Linear) -> Result<Vec<DampedMode>, Error> {
    let K = (&linear.K + linear.K.transpose()) * 0.5;
    damped_modes(&linear.M, &linear.D, &K).map_err(linear_error)
}

/// Returns an error about a linear model at a pose.
pub(crate) fn linear_error(error: LinearError) -> Error {
    Error::Pose(format!("the linear model at this pose: {error}"))
}

impl Arm {
    /// Returns the lowest `count` modes at a pose, about the static equilibrium, with the drives
    /// locked.
    ///
    /// * `at`: values of all actuated joints (rad or m), [`crate::Robot::start_pose`] by default.
    /// * `speeds`: speeds of all actuated joints (rad/s or m/s). With them the modes are those
    ///   about the equilibrium of the turning arm, with stiffening by centrifugal loads and
    ///   Coriolis forces, the motors following their motion exactly.
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit, [`Error::Step`] if there is no
    /// equilibrium.
    pub fn modes(
        self: &Arc<Self>,
        at: Option<&[f64]>,
        speeds: Option<&[f64]>,
        count: usize,
    ) -> Result<ModeTable, Error> {
        lowest(&self.posed(at)?, speeds, count)
    }
}

/// Linear model about which the modes oscillate.
pub(crate) struct ModeModel {
    pub(crate) linear: Linear,
    /// Damping matrix without Coriolis terms.
    damping: DMatrix<f64>,
    /// Speeds of the joints; empty at rest.
    speeds: Vec<f64>,
    /// Result of [`linearise_rotation`]: change of the forces during rotation.
    change: f64,
}

impl ModeModel {
    pub(crate) fn new(posed: &Posed, speeds: Option<&[f64]>) -> Result<Self, Error> {
        let names: Vec<&str> = posed.joints.iter().map(String::as_str).collect();
        let speeds = joint_values(speeds, &names)?;
        if speeds.iter().all(|speed| *speed == 0.0) {
            let linear = posed.linear(&Vector6::zeros())?;
            return Ok(Self { damping: linear.D.clone(), linear, speeds: Vec::new(), change: 0.0 });
        }
        let found = linearise_rotation(&posed.plant, &posed.tool, &posed.at, &speeds);
        let found = found.map_err(|error| posed.arm.explained(error))?;
        Ok(Self { linear: found.linear, damping: found.damping, speeds, change: found.change })
    }

    /// Computes the undamped frequencies (Hz), from which non-proportional damping shifts the
    /// damped ones. With locked drives they equal those of a map at this pose bit for bit.
    fn undamped_frequencies(&self, posed: &Posed) -> Result<Vec<f64>, Error> {
        let linear = &self.linear;
        if self.speeds.is_empty() && linear.driven == 0 {
            return Ok(posed.operating_point(&[0.0; 6])?.frequencies_hz().to_vec());
        }
        let K = (&linear.K + linear.K.transpose()) * 0.5;
        let undamped = damped_modes(&linear.M, &(&linear.D - &self.damping), &K).map_err(linear_error)?;
        Ok(undamped.iter().map(DampedMode::frequency_hz).collect())
    }

    /// Checks whether the rotation is steady.
    fn caveat(&self) -> Option<Finding> {
        let found = || kinds::UNSTEADY_ROTATION.found("the rotation", 100.0 * self.change, 100.0 * STEADY);
        (self.change > STEADY).then(found)
    }
}

/// Computes the lowest modes, with a caveat if the links have too few.
fn lowest(posed: &Posed, speeds: Option<&[f64]>, count: usize) -> Result<ModeTable, Error> {
    let model = ModeModel::new(posed, speeds)?;
    let all = modes_of(&model.linear)?;
    let mut found = table(posed, &model, &all, count)?;
    found.caveats.extend(few_modes(posed, &model, &found.frequencies_hz));
    found.warnings = caveat::warnings(&found.caveats);
    Ok(found)
}

/// Estimates the error of the frequencies of a turning arm from those with half as many modes of
/// its links; returns a caveat if it is large.
fn few_modes(posed: &Posed, model: &ModeModel, frequencies_hz: &[f64]) -> Option<Finding> {
    let arm = &posed.arm;
    let of_links = arm.spans.iter().filter(|span| span.lumped.is_none()).filter_map(|span| {
        let (_, range) = model.linear.elements.iter().find(|(name, _)| *name == span.link)?;
        range.len().checked_sub(6)
    });
    let modes = of_links.min().filter(|modes| *modes > 1 && !model.speeds.is_empty())?;
    let fewer = Modelling { modes: Some(modes / 2), ..*arm.modelling() };
    let half = arm.robot().model(&fewer).and_then(|arm| {
        let half = ModeModel::new(&Posed::new(arm, posed.at.clone())?, Some(&model.speeds))?;
        modes_of(&half.linear)
    });
    let errors = half.ok()?.iter().map(DampedMode::frequency_hz).zip(frequencies_hz).collect::<Vec<_>>();
    let errors = errors.into_iter().map(|(half, hz)| (half / hz - 1.0).abs() / HALVED);
    let (mode, error) = errors.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let place = format!("the frequency of mode {}", mode + 1);
    (error > MODES_ENOUGH).then(|| kinds::FEW_MODES.found(place, 100.0 * error, 100.0 * MODES_ENOUGH))
}

/// Computes the figures of the modes.
pub(crate) fn table(posed: &Posed, model: &ModeModel, all: &[DampedMode], count: usize) -> Result<ModeTable, Error> {
    let robot = posed.arm.robot();
    let linear = &model.linear;
    // Under servos the modes share the compliance of springs and servos; it does not exist if a
    // motor is free.
    let compliance = match linear.driven {
        0 => linear.compliance().map_err(step_error)?.diagonal(),
        _ => linear.yielding_compliance().map_or_else(Vector6::zeros, |C| C.diagonal()),
    };
    let mut caveats = posed.caveats_of(linear, &[0.0; 6]);
    let worst = all.iter().map(|mode| mode.residual).fold(0.0, f64::max);
    if worst > 1e-6 {
        let message = format!("a mode has a relative residual of {worst:.1e}: its figures are inaccurate");
        caveats.push(Finding::warning("inexact-mode", "modes", message, ""));
    }
    if all.iter().any(|mode| mode.eigenvalue.re > 1e-9 * mode.eigenvalue.norm()) {
        let message = "a mode grows: the arm is not stable at this pose";
        caveats.push(Finding::warning("unstable", "modes", message, "check the gains of the servos"));
    }
    let modes: Vec<ModeFigures> =
        all.iter().take(count).map(|mode| ModeFigures::new(mode, model, &compliance)).collect();
    let covered =
        |i: usize| modes.iter().map(|mode| mode.compliance_share[i]).sum::<Option<f64>>().filter(|_| !modes.is_empty());
    caveats.extend(model.caveat());
    let mut undamped = model.undamped_frequencies(posed)?;
    undamped.truncate(count);
    Ok(ModeTable {
        undamped_frequencies_hz: undamped,
        robot: robot.name.clone(),
        tcp: robot.tcp.0.clone(),
        frequencies_hz: modes.iter().map(|mode| mode.frequency_hz).collect(),
        damping_ratio: modes.iter().map(|mode| mode.damping_ratio).collect(),
        elements: linear.elements.iter().map(|(name, _)| name.clone()).collect(),
        total: all.len(),
        compliance_covered: std::array::from_fn(covered),
        modes,
        files: Files::default(),
        warnings: caveat::warnings(&caveats),
        caveats,
        driven: posed.plant.torque_driven.iter().take(linear.driven).map(|&k| posed.joints[k].clone()).collect(),
        joints: posed.joints.clone(),
        at: posed.at.clone(),
        speeds: model.speeds.clone(),
    })
}
