//! Caveats about an identification.

use crate::estimation::{Identified, MeasuredArm, NoAnswer, ParameterEstimate, Plant, Reading, ReadingKind};
use nalgebra::DVector;

use super::answer::{Identification, rms};
use super::encoders::EncoderFigures;
use super::file::MeasurementInput;
use flexarm_run::Caveat;
use flexarm_run::Robot;
use flexarm_run::caveat::CaveatKind;

/// Measured displacements differ in magnitude from those of the robot.
const LOAD_UNIT: CaveatKind = CaveatKind::warning(
    "load-unit",
    "measured displacements under {where} are {value} times the predicted ones, a difference by more than a factor of \
     {yardstick}: loads or initial stiffnesses are wrong",
    "",
    "force is in the file's unit of force, mass in kg: a weight of 100 kg is mass = 100, or a force of 981 N",
);
/// The residual of an encoder exceeds its noise.
const ENCODER_RESIDUAL: CaveatKind = CaveatKind::warning(
    "encoder-rest",
    "{where}: {value} rad (or m) of the deflection are not explained by the torque, the noise of the encoders is \
     {yardstick}: the error of the stiffness may exceed its standard deviation",
    "rad",
    "give the measured torque, lower `below`, or check friction, masses, transmission errors and flexible \
     neighbouring links",
);

/// Ratio of measured to predicted displacements above which an initial stiffness is not a plausible
/// cause.
const LOAD_RATIO: f64 = 5.0;
/// Weight of one kilogram (N).
const WEIGHT: f64 = 9.81;
/// Minimum ratio of encoder residual to noise for a caveat.
const ENCODER_REST: f64 = 1.5;

/// Ratio of position residuals to the spread of the positions above which frames or joints are
/// suspect.
const FRAME_RATIO: f64 = 0.05;

pub(super) fn caveats(found: &Identified) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    if let Some(factor) = found.misfit {
        let results = match found.parameters.iter().all(|p| p.std.is_nan()) {
            true => "the fit does not reproduce the readings, and its results have no standard deviations",
            false => "the standard deviations of the results are scaled by this factor",
        };
        let text = format!(
            "the residuals are {factor:.1} times as large as the standard deviations of the readings: the model lacks \
             a flexible part, loads or frames are wrong, or the standard deviations are too small; {results}"
        );
        caveats.push(Caveat::from_message(
            "misfit",
            "measurements",
            text,
            "fit more parameters, and check the largest residuals",
        ));
    }
    for parameter in found.parameters.iter().filter(|p| !p.identifiable && !p.shared) {
        let text = format!("these readings do not determine {}: it keeps its initial value", parameter.name);
        caveats.push(Caveat::from_message(
            "not-identifiable",
            "measurements",
            text,
            "add readings at the poses of a measurement plan",
        ));
    }
    let together = |p: &&ParameterEstimate| p.shared && !p.identifiable && !p.name.starts_with("joint.");
    for parameter in found.parameters.iter().filter(together) {
        let text = format!(
            "these readings determine {} only together with others: it has the value nearest to the initial one that \
             explains them",
            parameter.name
        );
        caveats.push(Caveat::from_message(
            "not-identifiable",
            "measurements",
            text,
            "add readings at the poses of a measurement plan",
        ));
    }
    if let Some(held) = found.held_out.as_ref().filter(|held| held.rms > held.rms_initial) {
        let text = format!(
            "the fit predicts held-out readings worse than the unchanged robot file ({:.2} against {:.2} standard \
             deviations): there are too many parameters for these readings",
            held.rms, held.rms_initial
        );
        caveats.push(Caveat::from_message(
            "over-fitted",
            "measurements",
            text,
            "fit fewer parameters or measure more poses",
        ));
    }
    if !found.solution.converged && found.misfit.is_none() {
        let text = "the fit did not converge: its values may be inaccurate";
        caveats.push(Caveat::from_message("not-converged", "measurements", text, "use better initial values"));
    }
    caveats
}

/// Returns a caveat about gear effects that the fit does not include.
pub(super) fn gear_caveat(robot: &Robot) -> Option<Caveat> {
    let has = |drive: &&flexarm_run::Drive| {
        drive.gearbox.as_ref().is_some_and(|(_, gear)| gear.hysteresis.is_some() || !gear.transmission.is_empty())
    };
    let joints: Vec<&str> = robot.drives.iter().filter(has).map(|drive| drive.joint.as_str()).collect();
    (!joints.is_empty()).then(|| {
        let text = format!(
            "the fit ignores hysteresis and transmission errors of {}: it models gears as springs",
            joints.join(", ")
        );
        Caveat::from_message("gear-laws", "measurements", text, "apply every load from the same side").as_note()
    })
}

/// Encoders whose residual exceeds their noise, and whose excess relative to the deflection exceeds
/// the relative deviation of the stiffness.
pub(super) fn encoder_caveats(encoders: &[EncoderFigures]) -> impl Iterator<Item = Caveat> + '_ {
    let odd = |gear: &&EncoderFigures| {
        let more = (gear.rest_rms.powi(2) - gear.noise_rms.powi(2)).max(0.0).sqrt();
        let matters = more / gear.deflection_rms > gear.std / gear.stiffness;
        gear.told && matters && gear.rest_rms > ENCODER_REST * gear.noise_rms
    };
    let told = |gear: &EncoderFigures| {
        ENCODER_RESIDUAL.found(format!("encoders of {}", gear.joint), gear.rest_rms, gear.noise_rms)
    };
    encoders.iter().filter(odd).map(told)
}

/// Displacements under forces, or under masses, that differ from the robot's by more than
/// [`LOAD_RATIO`]. Checks whether the factor between N and kg explains the ratio.
pub(super) fn load_caveats(plant: &Plant, input: &MeasurementInput) -> Result<Vec<Caveat>, NoAnswer> {
    let mut caveats = Vec::new();
    for (what, slip, pulls) in [("forces", "kg given as N", true), ("masses", "N given as kg", false)] {
        let some = input.measurements.of_readings(|k| match &input.measurements.readings[k].kind {
            ReadingKind::Displacement { before, after, .. } => {
                let forces = before.wrench != after.wrench;
                let masses = before.carried != after.carried;
                forces != masses && forces == pulls
            }
            _ => false,
        });
        if some.readings.is_empty() {
            continue;
        }
        let arm = MeasuredArm { plant, parameters: &[], measurements: &some };
        // The size of a displacement does not depend on the unknown rotations of instruments.
        let predicted = arm.predicted(&DVector::zeros(some.own_unknowns()))?;
        let deviations: Vec<f64> = some.readings.iter().flat_map(Reading::deviations).collect();
        let size =
            |values: &[f64]| values.iter().zip(&deviations).map(|(x, std)| (x / std).powi(2)).sum::<f64>().sqrt();
        let ratio = size(&arm.observed()) / size(&predicted);
        if !ratio.is_finite() || (1.0 / LOAD_RATIO..=LOAD_RATIO).contains(&ratio) {
            continue;
        }
        let mended = if pulls { ratio / WEIGHT } else { ratio * WEIGHT };
        let likely = match (0.4..=2.5).contains(&mended) {
            true => format!("about {WEIGHT} times too {}: {slip}?", if pulls { "large" } else { "small" }),
            false => String::new(),
        };
        caveats.push(LOAD_UNIT.found(what, ratio, LOAD_RATIO).likely(likely));
    }
    Ok(caveats)
}

/// Positions that do not fit the robot at any pose of the instrument.
pub(super) fn frame_caveat(answer: &Identification) -> Option<Caveat> {
    let metres: Vec<usize> = (0..answer.compared.len()).filter(|k| answer.compared[*k].kind == "places").collect();
    if metres.is_empty() {
        return None;
    }
    let measured: Vec<f64> = metres.iter().map(|k| answer.compared[*k].measured).collect();
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let spread = rms(measured.iter().map(|x| x - mean));
    let left = rms(metres.iter().map(|k| answer.compared[*k].after - answer.compared[*k].measured));
    (left > FRAME_RATIO * spread).then(|| {
        let text = format!(
            "the places differ by {:.1} mm (RMS) from those of the robot for every pose of the instrument: joint \
             values, their order, signs or units, or the targets are not those of this robot",
            1e3 * left
        );
        Caveat::from_message("frames", "measurements", text, "compare one pose by hand with the robot model (inspect)")
    })
}
