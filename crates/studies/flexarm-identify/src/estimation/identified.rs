//! Result of an identification: estimates, cross-validation, and the reasons why it fails.

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
    pub untold: Vec<Vec<(usize, f64)>>,
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
    /// No parameter or no reading.
    #[error("{parameters} parameters and {rows} measured numbers: at least one of each is needed")]
    Nothing {
        /// Number of parameters.
        parameters: usize,
        /// Number of measured numbers.
        rows: usize,
    },
    /// Too few measured places for an instrument.
    #[error(
        "instrument {instrument}: its pose requires at least three measured places that are not on one line, found \
         {places}"
    )]
    Instrument {
        /// Number of the instrument.
        instrument: usize,
        /// Number of its places.
        places: usize,
    },
    /// Too few displacements to find the axes of an instrument.
    #[error(
        "instrument {instrument}: its axes require displacements with all three components along at least two \
         directions, found {displacements}; add such readings, or give its orientation"
    )]
    Axes {
        /// Number of the instrument.
        instrument: usize,
        /// Number of its displacements.
        displacements: usize,
    },
    /// The arm model has no solution for a reading.
    #[error(transparent)]
    Model(#[from] NoAnswer),
    /// The readings do not determine an unknown of the measurement.
    #[error(
        "the readings do not determine {what}: measure at more different poses, in particular with different \
         orientations of the tool"
    )]
    Untold {
        /// Description of the unknown.
        what: String,
    },
    /// The scatter cannot be estimated, because there are as many unknowns as numbers.
    #[error(
        "the {rows} numbers have no standard deviation and there are as many unknowns: the scatter cannot be \
         estimated; give a standard deviation or measure more"
    )]
    NoScatter {
        /// Number of measured numbers.
        rows: usize,
    },
    /// A value is not finite.
    #[error(
        "a residual or a derivative is not finite: a value, a standard deviation or an uncertainty is too large or \
         too small"
    )]
    NotFinite,
}
