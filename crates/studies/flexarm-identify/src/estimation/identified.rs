//! Result of an identification: estimates, cross-validation, and the reasons why it fails.
//!
//! Start at [`Identified`]. Values are in SI units; the order of parameters and residuals is that of
//! the request and of the readings. Not here: how they are computed (`identify.rs`).

use flexarm_kinematics::Pose;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::estimation::least_squares::Solution;
use crate::estimation::measurement::NoAnswer;

/// Estimate of a number of the robot file.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FittedParameter {
    /// Name, as in the robot file.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Initial value.
    pub initial: f64,
    /// Value of the fit, which the new robot file has, whether or not the readings determine it.
    pub value: f64,
    /// Standard deviation; NaN (null in JSON) if the parameter is not identifiable.
    pub std: f64,
    /// 95 % confidence interval; NaN (nulls) if the parameter is neither identifiable nor rigid. The
    /// upper end of a stiffness that is rigid within the readings is infinite (null).
    pub interval: [f64; 2],
    /// Whether the readings determine the parameter.
    pub identifiable: bool,
    /// Whether a spring or a clearance is rigid within the readings.
    pub rigid: bool,
}

/// Error of the model in one kind of readings, in addition to their deviations.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ModelError {
    /// Kind of readings.
    pub kind: &'static str,
    /// Standard deviation (m or rad; relative for frequencies; as the compared numbers for
    /// responses and shapes).
    pub error: f64,
}

/// Cross-validation: residuals of readings that the fit did not use.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Number of folds.
    pub folds: usize,
    /// Number of folds that are not predicted, since the other folds do not determine an unknown.
    pub skipped: usize,
    /// RMS of the standardised residuals, each predicted from the other folds.
    pub rms: f64,
    /// RMS of the standardised residuals with the initial values.
    pub rms_initial: f64,
    /// Residual of each number of each reading; NaN where no prediction is possible.
    pub residuals: Vec<f64>,
}

/// Result of an identification.
#[derive(Clone, Debug)]
pub struct Identified {
    /// Estimates, one per parameter, in order.
    pub parameters: Vec<FittedParameter>,
    /// Correlation matrix of the parameters' coordinates, p×p.
    pub correlation: DMatrix<f64>,
    /// Combinations that the readings do not determine: parameter and weight, largest weight first.
    pub undetermined: Vec<Vec<(usize, f64)>>,
    /// Parameters that these combinations connect; alone: a parameter that the readings do not
    /// determine.
    pub together: Vec<Vec<usize>>,
    /// Search coordinates of the parameters, then the unknowns of the measurements.
    pub unknowns: DVector<f64>,
    /// Solution of the least-squares problem.
    pub solution: Solution,
    /// Residuals with the initial values, with the unknowns of the measurement fitted; NaN if the arm
    /// has no equilibrium with them.
    pub before: Vec<f64>,
    /// Residuals over their own standard deviation after the fit; a magnitude above four
    /// contradicts the other readings.
    pub normalised: Vec<f64>,
    /// Indices into [`Self::normalised`] with a magnitude above four, largest first.
    pub suspicious: Vec<usize>,
    /// Ratio of the scatter to the declared one, above or below 1, if chance gives it less than once
    /// in a thousand cases.
    pub misfit: Option<f64>,
    /// Errors of the model that the fit found.
    pub model_errors: Vec<ModelError>,
    /// Cross-validation.
    pub held_out: Option<HeldOut>,
    /// Estimated poses of unknown instruments: the world in the instrument's axes.
    pub instruments: Vec<Pose>,
    /// Estimated positions of the targets in tool axes (m).
    pub targets: Vec<Vector3<f64>>,
}

/// Reason why an identification fails.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The arm model has no solution for a reading.
    #[error(transparent)]
    Model(#[from] NoAnswer),
    /// The readings do not suffice, or are not finite; with what is missing.
    #[error("{0}")]
    Readings(String),
}
