//! Natural modes at a pose, drives locked or under their servos: frequencies, damping, what the
//! tool does in them and which link bends.

use flexarm_analysis::{
    DampedMode, LinearError, compliance_parts, damped_modes, effective_mass, mode_outputs, strain_energy_shares,
};
use flexarm_stepping::Linear;
use nalgebra::{DMatrix, Vector6};
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::{self, Caveat};
use crate::error::{Error, PoseError};
use crate::options::Modelling;
use crate::posed::{Posed, step_error};
use crate::robot::Robot;
use crate::summary::Files;

/// Answer of `flexarm modes`. SI units; world axes, at the TCP; six-vectors linear first.
#[derive(Clone, Debug, Serialize)]
pub struct ModeTable {
    /// Name of the robot.
    pub robot: String,
    /// Joints that are locked, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which they are locked (rad or m).
    pub at: Vec<f64>,
    /// Joints that are not locked but under a servo, which counts as spring and damper here.
    pub driven: Vec<String>,
    /// Link that carries the TCP.
    pub tcp: String,
    /// Natural frequencies `|λ| / 2π` (Hz), ascending.
    pub frequencies_hz: Vec<f64>,
    /// Frequencies without the dampers (Hz), ascending, as many.
    pub undamped_frequencies_hz: Vec<f64>,
    /// Damping ratios `-Re λ / |λ|`.
    pub damping_ratio: Vec<f64>,
    /// Elastic elements, in the order of `strain_energy`.
    pub elements: Vec<String>,
    /// One entry per mode.
    pub modes: Vec<ModeFigures>,
    /// Number of modes; `modes` may have fewer.
    pub total: usize,
    /// Parts of the static compliance that the modes above carry, per direction of the TCP; null
    /// where it is rigid.
    pub compliance_covered: [Option<f64>; 6],
    /// Written files.
    pub files: Files,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Doubts about the input and limits of the result.
    pub caveats: Vec<Caveat>,
}

/// One mode.
#[derive(Clone, Debug, Serialize)]
pub struct ModeFigures {
    /// Natural frequency (Hz).
    pub frequency_hz: f64,
    /// Frequency of the decaying oscillation (Hz).
    pub damped_frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Motion of the TCP in the mode scaled to unit modal mass (1/sqrt(kg), rad/sqrt(kg m²) ...),
    /// real part.
    pub tcp: [f64; 6],
    /// Imaginary part; zero where the damping is proportional.
    pub tcp_imaginary: [f64; 6],
    /// Mass (kg) at the TCP, moment of inertia (kg m²) for rotations, that moves like the mode;
    /// null at a node.
    pub effective_mass: [Option<f64>; 6],
    /// Part of the static compliance of the TCP in each direction that this mode carries; null
    /// where it is rigid.
    pub compliance_share: [Option<f64>; 6],
    /// Share of each element in the strain energy.
    pub strain_energy: Vec<f64>,
    /// Relative residual of the eigenvalue equation.
    pub residual: f64,
}

/// An effective mass above this is that of a node (kg, kg m²).
const NODE: f64 = 1e12;

impl ModeFigures {
    fn new(mode: &DampedMode, linear: &Linear, compliance: &Vector6<f64>) -> Self {
        let C = tool_map(linear);
        let output = mode_outputs(mode, &C);
        let parts = compliance_parts(mode, &linear.M, &linear.D, &C);
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

/// Twist of the tool per rate of the free coordinates.
pub(crate) fn tool_map(linear: &Linear) -> DMatrix<f64> {
    DMatrix::from_fn(6, linear.J.ncols(), |i, j| linear.J[(i, j)])
}

fn blocks(linear: &Linear) -> Vec<(usize, DMatrix<f64>)> {
    let block = |first: usize, n: usize| linear.springs.view((first, first), (n, n)).into_owned();
    linear.elements.iter().map(|(_, range)| (range.start, block(range.start, range.len()))).collect()
}

fn share(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// All damped modes of a linear structure.
pub(crate) fn modes_of(linear: &Linear) -> Result<Vec<DampedMode>, Error> {
    let K = (&linear.K + linear.K.transpose()) * 0.5;
    damped_modes(&linear.M, &linear.D, &K).map_err(linear_error)
}

pub(crate) fn linear_error(error: LinearError) -> Error {
    PoseError::Linear(error).into()
}

/// The lowest `count` modes of the flexible robot at a pose, under its weight, drives locked.
///
/// `at`: all actuated joints (rad or m), zero without it.
///
/// # Errors
/// [`Error::Pose`] for joint values that do not fit, [`Error::Step`] where there is no equilibrium.
pub fn modes(robot: &Robot, modelling: &Modelling, at: Option<&[f64]>, count: usize) -> Result<ModeTable, Error> {
    lowest(robot, Posed::new(robot, modelling, at)?, count)
}

impl Arm {
    /// As [`modes()`], of an arm whose links and drives are in place.
    ///
    /// # Errors
    /// As [`modes()`].
    pub fn modes(&self, at: Option<&[f64]>, count: usize) -> Result<ModeTable, Error> {
        lowest(self.robot(), Posed::on(self, at)?, count)
    }
}

fn lowest(robot: &Robot, posed: Posed, count: usize) -> Result<ModeTable, Error> {
    let linear = posed.linear(&Vector6::zeros())?;
    let all = modes_of(&linear)?;
    table(robot, posed, &linear, &all, count)
}

/// Frequencies without the dampers (Hz): those that are not in proportion move the others. With
/// locked drives the figures of a map at this pose, to the last bit.
fn undamped_frequencies(posed: &Posed, linear: &Linear) -> Result<Vec<f64>, Error> {
    if linear.driven == 0 {
        return Ok(posed.operating_point(&[0.0; 6])?.frequencies_hz().to_vec());
    }
    let undamped = damped_modes(&linear.M, &(&linear.D * 0.0), &((&linear.K + linear.K.transpose()) * 0.5));
    Ok(undamped.map_err(linear_error)?.iter().map(DampedMode::frequency_hz).collect())
}

/// Figures of the modes.
pub(crate) fn table(
    robot: &Robot,
    posed: Posed,
    linear: &Linear,
    all: &[DampedMode],
    count: usize,
) -> Result<ModeTable, Error> {
    // Modes under servos share the compliance of springs and servos; where a motor is held by
    // nothing there is none.
    let compliance = match linear.driven {
        0 => linear.compliance().map_err(step_error)?.diagonal(),
        _ => linear.yielding_compliance().map_or_else(Vector6::zeros, |C| C.diagonal()),
    };
    let mut caveats = posed.caveats_of(robot, linear, &[0.0; 6]);
    let worst = all.iter().map(|mode| mode.residual).fold(0.0, f64::max);
    if worst > 1e-6 {
        let message = format!("a mode has a relative residual of {worst:.1e}: its figures are inaccurate");
        caveats.push(Caveat::said("inexact-mode", "modes", message, ""));
    }
    if all.iter().any(|mode| mode.eigenvalue.re > 1e-9 * mode.eigenvalue.norm()) {
        let message = "a mode grows: the arm is not stable at this pose";
        caveats.push(Caveat::said("unstable", "modes", message, "check the gains of the servos"));
    }
    let modes: Vec<ModeFigures> =
        all.iter().take(count).map(|mode| ModeFigures::new(mode, linear, &compliance)).collect();
    let covered =
        |i: usize| modes.iter().map(|mode| mode.compliance_share[i]).sum::<Option<f64>>().filter(|_| !modes.is_empty());
    let mut undamped = undamped_frequencies(&posed, linear)?;
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
        driven: posed.arm.torque_driven.iter().map(|&k| posed.joints[k].clone()).collect(),
        joints: posed.joints,
        at: posed.at,
    })
}
