//! What `flexarm identify` answers, and how it is made of what was found.

use std::path::Path;

use crate::estimation::{
    Form, Identified, Instrument, MeasuredArm, Measurements, Parameter, Plant, Reading, ReadingKind, Target,
};
use flexarm_kinematics::Pose;
use nalgebra::{DVector, Vector3};
use serde::Serialize;

use super::doubts::caveats;
use super::encoders::EncoderFigures;
use super::error::IdentifyFileError;
use super::file::MeasurementInput;
use flexarm_run::Caveat;
use flexarm_run::Error;
use flexarm_run::Robot;

/// Readings that are named as arguing against the model.
const MOST_SUSPICIOUS: usize = 10;

/// Answer of `flexarm identify`.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// The robot.
    pub robot: String,
    /// The file of measurements.
    pub measurements: String,
    /// How many readings, and numbers in them.
    pub readings: usize,
    /// Numbers that were measured.
    pub numbers: usize,
    /// What was fitted.
    pub parameters: Vec<FittedParameter>,
    /// Correlation of the parameters, row after row.
    pub correlation: Vec<Vec<f64>>,
    /// Combinations that the readings do not tell.
    pub untold: Vec<Vec<Weight>>,
    /// RMS of the residuals.
    pub residual: Residual,
    /// RMS over readings that the fit had not seen; null with fewer than two readings.
    pub held_out: Option<HeldOutFigures>,
    /// How many times larger than its declared deviation the scatter is, where chance does not
    /// explain it; else null.
    pub misfit: Option<f64>,
    /// Whether the deviations of the readings were given; if not, the scatter tells them.
    pub deviations_known: bool,
    /// Gears of which motor and link were recorded.
    pub encoders: Vec<EncoderFigures>,
    /// Readings that argue against the rest, the worst first.
    pub suspicious: Vec<Suspicious>,
    /// Measured shapes of modes against those of the arm.
    pub shapes: Vec<ShapeFigures>,
    /// Unknown instruments as found, in the world.
    pub instruments: Vec<FoundFrame>,
    /// Unknown targets as found, tool axes (m).
    pub targets: Vec<FoundPoint>,
    /// Iterations.
    pub iterations: usize,
    /// Whether the search ended by itself, at a fit that meets the readings.
    pub converged: bool,
    /// The new robot file.
    pub file: Option<String>,
    /// The page.
    pub page: Option<String>,
    /// What is doubtful, of the robot as well.
    pub caveats: Vec<Caveat>,
    /// The sentences of the caveats that warn.
    pub warnings: Vec<String>,
    /// Instruments and targets: what each is.
    #[serde(skip)]
    pub frames: Vec<String>,
    /// Frequency responses: measured, expected before and after.
    #[serde(skip)]
    pub responses: Vec<ResponseCurves>,
    /// Each number: measured, expected before and after.
    #[serde(skip)]
    pub compared: Vec<Compared>,
}

/// A number of the robot file as it was found.
#[derive(Clone, Debug, Serialize)]
pub struct FittedParameter {
    /// By the names of the robot file.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Before.
    pub initial: f64,
    /// Now; the initial value where the readings say nothing.
    pub value: f64,
    /// Standard deviation; not a number (null in JSON) where the readings do not tell it or the fit
    /// does not meet them.
    pub std: f64,
    /// Where it lies in 95 of 100 cases; not numbers (nulls) without a deviation.
    pub interval: [f64; 2],
    /// Whether the readings tell it.
    pub identifiable: bool,
}

/// A parameter in a combination.
#[derive(Clone, Debug, Serialize)]
pub struct Weight {
    /// Its name.
    pub name: String,
    /// Its weight, over the prior deviation.
    pub weight: f64,
}

/// RMS before and after.
#[derive(Clone, Debug, Serialize)]
pub struct Residual {
    /// With the robot file as it is.
    pub before: f64,
    /// With what was found.
    pub after: f64,
    /// `m`, `Hz`, or `std` where readings of several units are mixed.
    pub unit: &'static str,
}

/// RMS over readings that the fit had not seen.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutFigures {
    /// Parts that were held out in turn.
    pub folds: usize,
    /// With the parameters fitted to the others.
    pub rms: f64,
    /// With the robot file as it is.
    pub rms_before: f64,
    /// As of the residual.
    pub unit: &'static str,
}

/// A reading that argues against the rest.
#[derive(Clone, Debug, Serialize)]
pub struct Suspicious {
    /// Which reading and number of it.
    pub reading: String,
    /// Measured (SI).
    pub measured: f64,
    /// Expected with what was found.
    pub expected: f64,
    /// Difference over what its scatter would be.
    pub normalised: f64,
}

/// A measured shape against the arm's mode that is most like it.
#[derive(Clone, Debug, Serialize)]
pub struct ShapeFigures {
    /// Which reading.
    pub reading: String,
    /// The mode, from 1, with what was found.
    pub mode: usize,
    /// Modal assurance criterion with the robot file as it is, from 0 to 1.
    pub assurance_before: f64,
    /// The same with what was found.
    pub assurance: f64,
}

/// Where an instrument stands.
#[derive(Clone, Debug, Serialize)]
pub struct FoundFrame {
    /// Its name.
    pub name: String,
    /// In the world (m).
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw (rad).
    pub rpy: [f64; 3],
}

/// Where a target is.
#[derive(Clone, Debug, Serialize)]
pub struct FoundPoint {
    /// Its name.
    pub name: String,
    /// In tool axes (m).
    pub xyz: [f64; 3],
}

/// One measured number.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// Which.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Kind of its reading.
    pub kind: &'static str,
    /// Measured.
    pub measured: f64,
    /// Expected of the robot file as it is.
    pub before: f64,
    /// Expected with what was found.
    pub after: f64,
    /// Its deviation.
    pub std: f64,
}

/// A frequency response by its magnitude.
#[derive(Clone, Debug)]
pub struct ResponseCurves {
    /// Which reading.
    pub name: String,
    /// Unit of the magnitudes.
    pub unit: &'static str,
    /// Frequencies (Hz).
    pub hz: Vec<f64>,
    /// Measured, expected of the robot file as it is, expected with what was found.
    pub magnitude: [Vec<f64>; 3],
}

/// Kind of a reading, for people.
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

/// What each instrument and target is, in a sentence.
fn described(input: &MeasurementInput, found: &Identified) -> Vec<String> {
    let millimetres = |v: &Vector3<f64>| format!("{:.3}, {:.3}, {:.3} mm", 1e3 * v.x, 1e3 * v.y, 1e3 * v.z);
    let deviation = |of: &dyn Fn(&ReadingKind) -> Option<String>| {
        input.measurements.readings.iter().find_map(|reading| of(&reading.kind)).unwrap_or_default()
    };
    let instruments = input.instruments.iter().enumerate().map(|(k, name)| {
        let X_WI = found.instruments[k].inverse();
        let (r, p, y) = X_WI.rotation.euler_angles();
        let turn = [r, p, y].map(|x| format!("{:.4}", x.to_degrees())).join(", ");
        let said = deviation(&|kind| match kind {
            ReadingKind::InstrumentAt { instrument, std, std_rotation, .. } if *instrument == k => {
                let place = std.map(|std| format!("{:.3} mm and ", 1e3 * std)).unwrap_or_default();
                Some(format!(", known to {place}{:.3} mrad", 1e3 * std_rotation))
            }
            _ => None,
        });
        match &input.measurements.instruments[k] {
            Instrument::Axes(_) => {
                format!(
                    "Instrument {name}: its axes are found to be turned by {turn} degrees (roll, pitch, yaw){said}."
                )
            }
            given => {
                let how = if matches!(given, Instrument::Known(_)) { "given" } else { "found" };
                let at = millimetres(&X_WI.translation.vector);
                format!("Instrument {name}: stands at {at} in the world, turned by {turn} degrees ({how}){said}.")
            }
        }
    });
    let targets = input.targets.iter().enumerate().map(|(k, name)| {
        let how = if matches!(input.measurements.targets[k], Target::Known(_)) { "given" } else { "found" };
        let said = deviation(&|kind| match kind {
            ReadingKind::TargetAt { target, std, .. } if *target == k => {
                Some(format!(", known to {:.3} mm", 1e3 * std))
            }
            _ => None,
        });
        format!("Target {name}: at {} from the TCP in its axes ({how}){said}.", millimetres(&found.targets[k]))
    });
    instruments.chain(targets).collect()
}

/// Magnitudes of the responses, from the numbers that were compared.
fn responses(measurements: &Measurements, compared: &[Compared]) -> Vec<ResponseCurves> {
    let mut first = 0;
    let mut all = Vec::new();
    for reading in &measurements.readings {
        let own = &compared[first..][..reading.rows()];
        first += own.len();
        let ReadingKind::Response(response) = &reading.kind else { continue };
        let magnitude = |value: fn(&Compared) -> f64| -> Vec<f64> {
            let of = |pair: &[Compared]| match response.form {
                Form::Logarithmic => value(&pair[0]).exp(),
                Form::Complex => value(&pair[0]).hypot(value(&pair[1])),
            };
            own.chunks_exact(2).map(of).collect()
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

/// Unit of each number, and its name within the reading.
fn numbers(measurements: &Measurements) -> Vec<(String, &'static str)> {
    let axis = |v: &Vector3<f64>| match v.iter().position(|x| *x == 1.0) {
        Some(k) => ["x", "y", "z"][k].to_owned(),
        None => "along its direction".to_owned(),
    };
    let mut all = Vec::new();
    for reading in &measurements.readings {
        match &reading.kind {
            ReadingKind::Displacement { rows, .. } => all.extend(rows.iter().map(|row| match row.of.parts() {
                (d, _, false) => (format!("{}, {}", reading.name, axis(&d)), "m"),
                (d, _, true) => (format!("{}, about {}", reading.name, axis(&d)), "rad"),
            })),
            ReadingKind::TargetAt { .. } => {
                all.extend(["x", "y", "z"].map(|axis| (format!("{}, {axis}", reading.name), "m")));
            }
            ReadingKind::InstrumentAt { std, .. } => {
                if std.is_some() {
                    all.extend(["x", "y", "z"].map(|axis| (format!("{}, {axis}", reading.name), "m")));
                }
                all.extend(["x", "y", "z"].map(|axis| (format!("{}, about {axis}", reading.name), "rad")));
            }
            ReadingKind::Place { .. } => {
                all.extend(["x", "y", "z"].map(|axis| (format!("{}, {axis}", reading.name), "m")));
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

pub(super) fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    (values.map(|x| x * x).sum::<f64>() / n).sqrt()
}

pub(super) fn answer(
    robot: &Robot,
    path: &Path,
    plant: &Plant,
    fitted: &[Parameter],
    input: &MeasurementInput,
    found: &Identified,
) -> Result<Identification, Error> {
    let measurements = &input.measurements;
    let names = numbers(measurements);
    let deviations: Vec<f64> = measurements.readings.iter().flat_map(Reading::deviations).collect();
    let observed = MeasuredArm { plant, parameters: &[], measurements }.observed();
    let one_unit = names.windows(2).all(|pair| pair[0].1 == pair[1].1);
    let unit = if one_unit { names[0].1 } else { "std" };
    let in_unit = |r: f64, k: usize| if one_unit { r * deviations[k] } else { r };
    let of = |residuals: &[f64]| rms(residuals.iter().enumerate().map(|(k, r)| in_unit(*r, k)));
    let residuals = found.solution.residuals.as_slice();
    let kinds: Vec<&str> = measurements.readings.iter().flat_map(|r| vec![kind_of(r); r.rows()]).collect();
    let compared: Vec<Compared> = (0..names.len())
        .map(|k| Compared {
            name: names[k].0.clone(),
            unit: names[k].1,
            kind: kinds[k],
            measured: observed[k],
            before: observed[k] + found.before[k] * deviations[k],
            after: observed[k] + residuals[k] * deviations[k],
            std: deviations[k],
        })
        .collect();
    let held_out = found.held_out.as_ref().map(|held| {
        let seen: Vec<usize> = (0..held.residuals.len()).filter(|k| held.residuals[*k].is_finite()).collect();
        let of = |values: &[f64]| rms(seen.iter().map(|k| in_unit(values[*k], *k)));
        HeldOutFigures { folds: held.folds, rms: of(&held.residuals), rms_before: of(&found.before), unit }
    });
    let suspicious = found.suspicious.iter().take(MOST_SUSPICIOUS).map(|k| Suspicious {
        reading: compared[*k].name.clone(),
        measured: compared[*k].measured,
        expected: compared[*k].after,
        normalised: found.normalised[*k],
    });
    let weights = |combination: &Vec<(usize, f64)>| {
        combination.iter().map(|(k, weight)| Weight { name: fitted[*k].name.clone(), weight: *weight }).collect()
    };
    let parameters = found.parameters.iter().map(|p| FittedParameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        initial: p.initial,
        value: p.value,
        std: p.std,
        interval: p.interval,
        identifiable: p.identifiable,
    });
    let p = fitted.len();
    Ok(Identification {
        robot: robot.name.clone(),
        measurements: path.display().to_string(),
        readings: measurements.readings.len(),
        numbers: names.len(),
        parameters: parameters.collect(),
        correlation: (0..p).map(|i| (0..p).map(|j| found.correlation[(i, j)]).collect()).collect(),
        untold: found.untold.iter().map(weights).collect(),
        residual: Residual { before: of(&found.before), after: of(residuals), unit },
        held_out,
        misfit: found.misfit,
        deviations_known: input.deviations_known,
        encoders: Vec::new(),
        suspicious: suspicious.collect(),
        shapes: shapes(plant, fitted, measurements, &found.solution.unknowns)?,
        instruments: frames(input, found),
        targets: points(input, found),
        iterations: found.solution.iterations,
        converged: found.solution.converged,
        file: None,
        page: None,
        caveats: caveats(found),
        warnings: Vec::new(),
        frames: described(input, found),
        responses: responses(measurements, &compared),
        compared,
    })
}

fn shapes(
    plant: &Plant,
    fitted: &[Parameter],
    measurements: &Measurements,
    unknowns: &DVector<f64>,
) -> Result<Vec<ShapeFigures>, Error> {
    let arm = MeasuredArm { plant, parameters: fitted, measurements };
    let of = |unknowns: &DVector<f64>| {
        arm.assurances(unknowns).map_err(|error| Error::from(IdentifyFileError::Fit(error.to_string())))
    };
    let (before, after) = (of(&DVector::zeros(unknowns.len()))?, of(unknowns)?);
    let figures = before.iter().zip(after).map(|((_, _, before), (number, mode, assurance))| ShapeFigures {
        reading: measurements.readings[number].name.clone(),
        mode: mode + 1,
        assurance_before: *before,
        assurance,
    });
    Ok(figures.collect())
}

fn frames(input: &MeasurementInput, found: &Identified) -> Vec<FoundFrame> {
    let all = input.instruments.iter().zip(&found.instruments).zip(&input.measurements.instruments);
    let unknown = all.filter(|(_, given)| !matches!(given, Instrument::Known(_)));
    let frame = |((name, X_IW), _): ((&String, &Pose), _)| {
        let X_WI = X_IW.inverse();
        let (roll, pitch, yaw) = X_WI.rotation.euler_angles();
        FoundFrame { name: name.clone(), xyz: X_WI.translation.vector.into(), rpy: [roll, pitch, yaw] }
    };
    unknown.map(frame).collect()
}

fn points(input: &MeasurementInput, found: &Identified) -> Vec<FoundPoint> {
    let all = input.targets.iter().zip(&found.targets).zip(&input.measurements.targets);
    let unknown = all.filter(|(_, given)| matches!(given, Target::Unknown(_)));
    unknown.map(|((name, p), _)| FoundPoint { name: name.clone(), xyz: (*p).into() }).collect()
}
