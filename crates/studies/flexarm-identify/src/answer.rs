//! Result of `flexarm identify`, built from the result of the estimation.
//!
//! Start at [`answer`]. The structures are the JSON of `--json`: their names are a contract. Not
//! here: caveats ([`super::caveats`]), the page ([`super::page`]).

use std::path::Path;

use flexarm_kinematics::Pose;
use flexarm_run::{Error, Finding, Robot};
use nalgebra::{DVector, Vector3};
use serde::Serialize;

use super::caveats::{caveats, combinations};
use super::encoders::EncoderFigures;
use super::file::MeasurementInput;
use crate::estimation::{
    FittedParameter, Form, Identified, IdentifyError, Instrument, MeasuredArm, Measurements, ModelError, NominalArm,
    Parameter, Reading, ReadingKind, Target,
};

/// Maximum number of suspicious readings in the result.
const MAX_SUSPICIOUS: usize = 10;

/// Result of `flexarm identify`.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// Robot.
    pub robot: String,
    /// File of measurements.
    pub measurements: String,
    /// Number of readings.
    pub readings: usize,
    /// Number of measured numbers.
    pub numbers: usize,
    /// Fitted parameters.
    pub parameters: Vec<FittedParameter>,
    /// Correlation of the parameters, row after row.
    pub correlation: Vec<Vec<f64>>,
    /// Combinations that the readings do not determine.
    pub untold: Vec<Vec<Weight>>,
    /// Parameters that the readings do not determine, and those that they determine only together, in
    /// words.
    pub combinations: Vec<String>,
    /// RMS of the residuals.
    pub residual: Residual,
    /// RMS of cross-validation residuals; null with fewer than two readings.
    pub held_out: Option<HeldOutFigures>,
    /// Ratio of the scatter to the declared one, above or below 1, if chance does not explain it;
    /// otherwise null.
    pub misfit: Option<f64>,
    /// Whether the deviations of all readings were given; the others are estimated from the scatter.
    pub deviations_known: bool,
    /// Errors of the model that the fit found, per kind of readings.
    pub model_errors: Vec<ModelError>,
    /// Gears with recorded positions of motor and link.
    pub encoders: Vec<EncoderFigures>,
    /// Readings that contradict the others, worst first.
    pub suspicious: Vec<Suspicious>,
    /// Measured mode shapes compared with those of the arm.
    pub shapes: Vec<ShapeFigures>,
    /// Estimated poses of unknown instruments, in the world.
    pub instruments: Vec<FoundFrame>,
    /// Estimated positions of unknown targets in tool axes (m).
    pub targets: Vec<FoundPoint>,
    /// Number of iterations.
    pub iterations: usize,
    /// Whether the search converged to a solution that fits the readings.
    pub converged: bool,
    /// New robot file.
    pub file: Option<String>,
    /// Path of the page.
    pub page: Option<String>,
    /// Caveats about the identification and the robot.
    pub caveats: Vec<Finding>,
    /// Sentences of the caveats that are warnings.
    pub warnings: Vec<String>,
    /// Frequency responses: measured, predicted before and after.
    #[serde(skip)]
    pub responses: Vec<ResponseCurves>,
    /// Measured numbers: measured, predicted before and after.
    #[serde(skip)]
    pub compared: Vec<Compared>,
}

/// Parameter in a combination.
#[derive(Clone, Debug, Serialize)]
pub struct Weight {
    /// Name of the parameter.
    pub name: String,
    /// Weight of the parameter over its prior deviation.
    pub weight: f64,
}

/// RMS of the residuals before and after.
#[derive(Clone, Debug, Serialize)]
pub struct Residual {
    /// With the robot file as it is.
    pub before: f64,
    /// With the estimated parameters.
    pub after: f64,
    /// `m`, `Hz`, or `std` where readings have different units.
    pub unit: &'static str,
}

/// RMS of cross-validation residuals.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutFigures {
    /// Number of folds.
    pub folds: usize,
    /// Number of folds that are not predicted, since the others do not determine an unknown.
    pub skipped: usize,
    /// With the parameters fitted to the other folds.
    pub rms: f64,
    /// With the robot file as it is.
    pub rms_before: f64,
    /// Unit, as in [`Residual`].
    pub unit: &'static str,
}

/// Reading that contradicts the others.
#[derive(Clone, Debug, Serialize)]
pub struct Suspicious {
    /// Name of the reading and of the number in it.
    pub reading: String,
    /// Measured value (SI).
    pub measured: f64,
    /// Value predicted with the estimated parameters (SI).
    pub expected: f64,
    /// Residual over its own standard deviation after the fit.
    pub normalised: f64,
}

/// Measured mode shape and the most similar mode of the arm.
#[derive(Clone, Debug, Serialize)]
pub struct ShapeFigures {
    /// Name of the reading.
    pub reading: String,
    /// Number of the mode, from 1, with the estimated parameters.
    pub mode: usize,
    /// Modal assurance criterion with the robot file as it is (0 to 1).
    pub assurance_before: f64,
    /// Modal assurance criterion with the estimated parameters (0 to 1).
    pub assurance: f64,
}

/// Pose of an instrument.
#[derive(Clone, Debug, Serialize)]
pub struct FoundFrame {
    /// Name of the instrument.
    pub name: String,
    /// Position in the world (m).
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw (rad).
    pub rpy: [f64; 3],
}

/// Position of a target.
#[derive(Clone, Debug, Serialize)]
pub struct FoundPoint {
    /// Name of the target.
    pub name: String,
    /// Link on which it is; `tcp` for the tool.
    pub link: String,
    /// Position in the axes of the link or the tool (m).
    pub xyz: [f64; 3],
}

/// One measured number.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Kind of the reading.
    pub kind: &'static str,
    /// Measured value.
    pub measured: f64,
    /// Value predicted with the robot file as it is.
    pub before: f64,
    /// Value predicted with the estimated parameters.
    pub after: f64,
    /// Standard deviation of the residual, with the error of the model.
    pub std: f64,
}

/// Magnitude of a frequency response.
#[derive(Clone, Debug)]
pub struct ResponseCurves {
    /// Name of the reading.
    pub name: String,
    /// Unit of the magnitudes.
    pub unit: &'static str,
    /// Frequencies (Hz).
    pub hz: Vec<f64>,
    /// Measured, predicted with the robot file as it is, predicted with the estimated parameters.
    pub magnitude: [Vec<f64>; 3],
}

/// Returns the name of the kind of a reading, for output.
fn kind_of(reading: &Reading) -> &'static str {
    match reading.kind {
        ReadingKind::Displacement { .. } => "displacements",
        ReadingKind::Place { .. } => "places",
        ReadingKind::Known { .. } => "encoders",
        ReadingKind::TargetAt { .. } | ReadingKind::InstrumentAt { .. } => "targets and instruments",
        ReadingKind::Frequencies { .. } => "frequencies",
        ReadingKind::Response(_) => "responses",
        ReadingKind::Shape(_) => "mode shapes",
    }
}

/// Returns the name of the link on which a target is.
fn link_of(input: &MeasurementInput, target: usize) -> &str {
    input.measurements.links.get(target).and_then(Option::as_ref).map_or("tcp", |frame| &frame.name)
}

/// Returns the magnitudes of the responses from the compared numbers.
fn responses(measurements: &Measurements, compared: &[Compared]) -> Vec<ResponseCurves> {
    let mut first = 0;
    let mut all = Vec::new();
    for reading in &measurements.readings {
        let own = &compared[first..][..reading.rows()];
        first += own.len();
        let ReadingKind::Response(response) = &reading.kind else { continue };
        let magnitude = |value: fn(&Compared) -> f64| -> Vec<f64> {
            let modulus = |pair: &[Compared]| match response.form {
                Form::Logarithmic => value(&pair[0]).exp(),
                Form::Complex => value(&pair[0]).hypot(value(&pair[1])),
            };
            own.chunks_exact(2).map(modulus).collect()
        };
        all.push(ResponseCurves {
            name: reading.name.clone(),
            unit: response.answer.unit(),
            hz: response.points.iter().map(|(omega, ..)| omega / std::f64::consts::TAU).collect(),
            magnitude: [magnitude(|c| c.measured), magnitude(|c| c.before), magnitude(|c| c.after)],
        });
    }
    all
}

/// Returns the name and unit of each measured number.
fn numbers(measurements: &Measurements) -> Vec<(String, &'static str)> {
    let axis = |v: &Vector3<f64>| match v.iter().position(|x| *x == 1.0) {
        Some(k) => ["x", "y", "z"][k].to_owned(),
        None => "along its direction".to_owned(),
    };
    // The order is that of the residuals: readings in their order, components within a reading.
    let mut all = Vec::new();
    for reading in &measurements.readings {
        match &reading.kind {
            ReadingKind::Displacement { rows, .. } => all.extend(rows.iter().map(|row| match row.of.rotation {
                false => (format!("{}, {}", reading.name, axis(&row.of.direction)), "m"),
                true => (format!("{}, about {}", reading.name, axis(&row.of.direction)), "rad"),
            })),
            ReadingKind::TargetAt { .. } => {
                all.extend(["x", "y", "z"].map(|axis| (format!("{}, {axis}", reading.name), "m")));
            }
            // A pose known in advance: position, if its deviation is given, then orientation.
            ReadingKind::InstrumentAt { std, .. } => {
                if std.is_some() {
                    all.extend(["x", "y", "z"].map(|axis| (format!("{}, {axis}", reading.name), "m")));
                }
                all.extend(["x", "y", "z"].map(|axis| (format!("{}, about {axis}", reading.name), "rad")));
            }
            ReadingKind::Place { rows, .. } => {
                all.extend(rows.iter().map(|row| (format!("{}, {}", reading.name, ["x", "y", "z"][row.of]), "m")));
            }
            ReadingKind::Known { .. } => all.push((reading.name.clone(), "ln")),
            ReadingKind::Frequencies { rows, .. } => {
                all.extend(rows.iter().map(|row| (format!("{}, mode {}", reading.name, row.of + 1), "Hz")));
            }
            ReadingKind::Response(response) => {
                let (words, units) = match response.form {
                    Form::Logarithmic => (["magnitude (ln)", "phase"], ["ln", "rad"]),
                    Form::Complex => (["real part", "imaginary part"], [response.answer.unit(); 2]),
                };
                for (omega, ..) in &response.points {
                    let hz = omega / std::f64::consts::TAU;
                    all.extend([0, 1].map(|k| (format!("{}, {hz:.4} Hz, {}", reading.name, words[k]), units[k])));
                }
            }
            ReadingKind::Shape(shape) => {
                all.extend((0..shape.probes.len()).map(|k| (format!("{}, point {}", reading.name, k + 1), "1")));
            }
        }
    }
    all
}

/// Returns the root mean square; NaN without values.
pub(super) fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    (values.map(|x| x * x).sum::<f64>() / n).sqrt()
}

/// Returns each measured number with its predictions.
fn compared(nominal: &NominalArm, measurements: &Measurements, found: &Identified) -> Vec<Compared> {
    let deviations = &found.solution.deviations;
    let observed = MeasuredArm { nominal, parameters: &[], measurements }.observed();
    let kinds: Vec<&str> = measurements.readings.iter().flat_map(|r| vec![kind_of(r); r.rows()]).collect();
    let one = |(k, (name, unit)): (usize, (String, &'static str))| Compared {
        name,
        unit,
        kind: kinds[k],
        measured: observed[k],
        before: observed[k] + found.before[k],
        after: observed[k] + found.solution.residuals[k],
        std: deviations[k],
    };
    numbers(measurements).into_iter().enumerate().map(one).collect()
}

/// Returns the RMS of the residuals of all readings, and of those that cross-validation predicts.
fn residuals(found: &Identified, compared: &[Compared]) -> (Residual, Option<HeldOutFigures>) {
    let one_unit = compared.windows(2).all(|pair| pair[0].unit == pair[1].unit);
    let unit = if one_unit { compared[0].unit } else { "std" };
    let in_unit = |r: f64, k: usize| if one_unit { r } else { r / compared[k].std };
    let all = |residuals: &[f64]| rms(residuals.iter().enumerate().map(|(k, r)| in_unit(*r, k)));
    let held_out = found.held_out.as_ref().map(|held| {
        let predicted: Vec<usize> = (0..held.residuals.len()).filter(|k| held.residuals[*k].is_finite()).collect();
        let rms_of = |values: &[f64]| rms(predicted.iter().map(|k| in_unit(values[*k], *k)));
        HeldOutFigures {
            folds: held.folds,
            skipped: held.skipped,
            rms: rms_of(&held.residuals),
            rms_before: rms_of(&found.before),
            unit,
        }
    });
    let after = all(found.solution.residuals.as_slice());
    (Residual { before: all(&found.before), after, unit }, held_out)
}

/// Returns the result of an identification; encoders, files and further caveats are added later.
///
/// * `path`: file of the measurements.
/// * `fitted`: parameters in the order of `found`.
pub(super) fn answer(
    robot: &Robot,
    path: &Path,
    nominal: &NominalArm,
    fitted: &[Parameter],
    input: &MeasurementInput,
    found: &Identified,
) -> Result<Identification, Error> {
    let measurements = &input.measurements;
    // Measured numbers with their predictions; what follows is taken from them.
    let compared = compared(nominal, measurements, found);
    let (residual, held_out) = residuals(found, &compared);
    let suspicious = found.suspicious.iter().take(MAX_SUSPICIOUS).map(|k| Suspicious {
        reading: compared[*k].name.clone(),
        measured: compared[*k].measured,
        expected: compared[*k].after,
        normalised: found.normalised[*k],
    });
    let weights = |combination: &Vec<(usize, f64)>| {
        combination.iter().map(|(k, weight)| Weight { name: fitted[*k].name.clone(), weight: *weight }).collect()
    };
    let p = fitted.len();
    Ok(Identification {
        robot: robot.name.clone(),
        measurements: path.display().to_string(),
        readings: measurements.readings.len(),
        numbers: compared.len(),
        parameters: found.parameters.clone(),
        correlation: (0..p).map(|i| (0..p).map(|j| found.correlation[(i, j)]).collect()).collect(),
        untold: found.undetermined.iter().map(weights).collect(),
        combinations: combinations(found),
        residual,
        held_out,
        misfit: found.misfit,
        deviations_known: input.measurements.readings.iter().all(|r| r.deviations().iter().all(|std| *std > 0.0)),
        model_errors: found.model_errors.clone(),
        encoders: Vec::new(),
        suspicious: suspicious.collect(),
        shapes: shapes(nominal, fitted, measurements, &found.unknowns)?,
        instruments: frames(input, found),
        targets: points(input, found),
        iterations: found.solution.iterations,
        converged: found.solution.converged,
        file: None,
        page: None,
        caveats: caveats(found),
        warnings: Vec::new(),
        responses: responses(measurements, &compared),
        compared,
    })
}

/// Compares the measured mode shapes with the most similar modes, before and after the fit.
fn shapes(
    nominal: &NominalArm,
    fitted: &[Parameter],
    measurements: &Measurements,
    unknowns: &DVector<f64>,
) -> Result<Vec<ShapeFigures>, Error> {
    let arm = MeasuredArm { nominal, parameters: fitted, measurements };
    let assurances = |unknowns: &DVector<f64>| arm.assurances(unknowns).map_err(IdentifyError::from);
    let (before, after) = (assurances(&DVector::zeros(unknowns.len()))?, assurances(unknowns)?);
    let figures = before.iter().zip(after).map(|((_, _, before), (number, mode, assurance))| ShapeFigures {
        reading: measurements.readings[number].name.clone(),
        mode: mode + 1,
        assurance_before: *before,
        assurance,
    });
    Ok(figures.collect())
}

/// Returns the poses of the fitted instruments in the world.
fn frames(input: &MeasurementInput, found: &Identified) -> Vec<FoundFrame> {
    let all = input.measurements.instrument_names.iter().zip(&found.instruments).zip(&input.measurements.instruments);
    let unknown = all.filter(|(_, given)| !matches!(given, Instrument::Known(_)));
    let frame = |((name, X_IW), _): ((&String, &Pose), _)| {
        let X_WI = X_IW.inverse();
        let (roll, pitch, yaw) = X_WI.rotation.euler_angles();
        FoundFrame { name: name.clone(), xyz: X_WI.translation.vector.into(), rpy: [roll, pitch, yaw] }
    };
    unknown.map(frame).collect()
}

/// Returns the positions of the fitted targets.
fn points(input: &MeasurementInput, found: &Identified) -> Vec<FoundPoint> {
    let all = input.targets.iter().zip(&found.targets).zip(&input.measurements.targets);
    let point = |(k, ((name, p), _)): (usize, ((&String, &Vector3<f64>), _))| FoundPoint {
        name: name.clone(),
        link: link_of(input, k).to_owned(),
        xyz: (*p).into(),
    };
    all.enumerate().filter(|(_, (_, given))| matches!(given, Target::Unknown(_))).map(point).collect()
}
