//! Caveats about an identification.
//!
//! [`caveats`] and [`combinations`] say what the fit itself found; the others compare readings,
//! gears and encoders with the robot. Not here: mistakes that are refused ([`super::units`],
//! [`super::error`]).

use flexarm_run::caveat::FindingKind;
use flexarm_run::{Finding, Robot};
use nalgebra::DVector;

use super::answer::{Identification, rms};
use super::encoders::EncoderFigures;
use super::file::MeasurementInput;
use crate::estimation::{FittedParameter, Identified, MeasuredArm, NominalArm, ReadingKind};

/// Measured displacements differ in magnitude from those of the robot.
const LOAD_UNIT: FindingKind = FindingKind::warning(
    "load-unit",
    "measured displacements under {where} are {value} times the predicted ones, a difference by more than a factor of \
     {yardstick}: loads or initial stiffnesses are wrong",
    "",
    "force is in the file's unit of force, mass in kg: a weight of 100 kg is mass = 100, or a force of 981 N",
);
/// The residual of an encoder exceeds its noise.
const ENCODER_RESIDUAL: FindingKind = FindingKind::warning(
    "encoder-rest",
    "{where}: {value} rad (or m) of the deflection are not explained by the torque, the noise of the encoders is \
     {yardstick}: the standard deviation of the stiffness includes that, as if it followed the torque in part",
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

/// Returns the caveats that the fit itself gives reason for.
pub(super) fn caveats(found: &Identified) -> Vec<Finding> {
    let mut caveats = Vec::new();
    // The scatter differs from that of the given standard deviations.
    if let Some(factor) = found.misfit {
        let (cause, remedy) = match factor > 1.0 {
            true => (
                "the model lacks a flexible part, loads or frames are wrong, or the standard deviations are too small; \
                 the standard deviations of the results include this error of the model",
                "fit more parameters, and check the largest residuals",
            ),
            false => (
                "these are too large; the standard deviations of the results are those of the residuals",
                "give smaller standard deviations, or none",
            ),
        };
        let text =
            format!("the residuals are {factor:.2} times as large as the standard deviations of the readings: {cause}");
        caveats.push(Finding::warning("misfit", "measurements", text, remedy));
    }
    // Readings and prior leave parameters open.
    let unsure = |p: &&FittedParameter| !p.identifiable && !p.rigid;
    let unsure = found.parameters.iter().filter(unsure).count();
    if unsure > 0 {
        let text = format!("these readings do not determine {unsure} of {} parameters alone", found.parameters.len());
        let remedy = "add readings at the poses of a measurement plan, or keep values that you know";
        caveats.push(Finding::warning("not-identifiable", "measurements", text, remedy));
    }
    // Other readings are predicted worse than without a fit.
    if let Some(held) = found.held_out.as_ref().filter(|held| held.rms > held.rms_initial) {
        let text = format!(
            "the fit predicts held-out readings worse than the unchanged robot file ({:.2} against {:.2} standard \
             deviations): there are too many parameters for these readings",
            held.rms, held.rms_initial
        );
        caveats.push(Finding::warning(
            "over-fitted",
            "measurements",
            text,
            "fit fewer parameters or measure more poses",
        ));
    }
    if !found.solution.converged {
        let text = "the fit did not converge: its values may be inaccurate";
        caveats.push(Finding::warning("not-converged", "measurements", text, "use better initial values"));
    }
    caveats
}

/// Says in words which parameters the readings do not determine, and which only together.
pub(super) fn combinations(found: &Identified) -> Vec<String> {
    let (alone, together): (Vec<_>, Vec<_>) = found.together.iter().partition(|group| group.len() == 1);
    let said = |group: &[usize]| in_words(group.iter().map(|k| found.parameters[*k].name.as_str()));
    let none: Vec<usize> = alone.into_iter().flatten().copied().collect();
    let none = (!none.is_empty()).then(|| format!("not determined: {}", said(&none)));
    none.into_iter().chain(together.into_iter().map(|group| format!("only together: {}", said(group)))).collect()
}

/// Lists parameters in words; those of one kind as one.
fn in_words<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut kinds: Vec<(&str, Vec<&str>, Vec<String>)> = Vec::new();
    for name in names {
        let (what, axis, whose) = words(name);
        match kinds.iter_mut().find(|(own, axes, _)| *own == what && axes[0] == axis) {
            Some((.., all)) => all.push(whose),
            None => kinds.push((what, vec![axis], vec![whose])),
        }
    }
    // Axes of the same parts as one.
    let mut merged: Vec<(&str, Vec<&str>, Vec<String>)> = Vec::new();
    for (what, axes, whose) in kinds {
        match merged.iter_mut().find(|(own, _, all)| *own == what && *all == whose) {
            Some((_, all, _)) => all.extend(axes),
            None => merged.push((what, axes, whose)),
        }
    }
    let one = |(what, axes, whose): &(&str, Vec<&str>, Vec<String>)| {
        format!("{} of {}", format!("{what} {}", axes.join(", ")).trim_end(), whose.join(", "))
    };
    merged.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// Returns what a parameter is, its axis, and of what it is.
fn words(name: &str) -> (&str, &str, String) {
    let (kind, rest) = name.split_once('.').unwrap_or(("parameter", name));
    let (whose, last) = rest.rsplit_once('.').unwrap_or(("", rest));
    let (what, axis) = match (kind, last) {
        ("joint" | "tcp", "x" | "y" | "z") => ("shift along", last),
        ("joint" | "tcp", "roll" | "rx") => ("rotation about", "x"),
        ("joint" | "tcp", "pitch" | "ry") => ("rotation about", "y"),
        ("joint" | "tcp", "yaw" | "rz") => ("rotation about", "z"),
        ("link", "x" | "y" | "z") => ("centre of mass along", last),
        _ => (last, ""),
    };
    let whose = match (kind, whose) {
        ("tcp", "") => "the tool".to_owned(),
        (_, "") => format!("the {kind}"),
        _ => [".com", ".gearbox"].iter().find_map(|end| whose.strip_suffix(end)).unwrap_or(whose).to_owned(),
    };
    (what, axis, whose)
}

/// Returns a caveat about gear effects that the fit does not include.
pub(super) fn gear_caveat(robot: &Robot) -> Option<Finding> {
    let has = |drive: &&flexarm_run::Drive| {
        drive.gearbox.as_ref().is_some_and(|(_, gear)| gear.hysteresis.is_some() || !gear.transmission.is_empty())
    };
    let joints: Vec<&str> = robot.drives.iter().filter(has).map(|drive| drive.joint.as_str()).collect();
    (!joints.is_empty()).then(|| {
        let text = format!(
            "the fit ignores hysteresis and transmission errors of {}: it models gears as springs",
            joints.join(", ")
        );
        Finding::warning("gear-laws", "measurements", text, "apply every load from the same side").as_note()
    })
}

/// Encoders whose residual exceeds their noise, and whose excess relative to the deflection exceeds
/// the relative deviation of the stiffness.
pub(super) fn encoder_caveats(encoders: &[EncoderFigures]) -> impl Iterator<Item = Finding> + '_ {
    let exceeds_noise = |gear: &&EncoderFigures| {
        let more = (gear.rest_rms.powi(2) - gear.noise_rms.powi(2)).max(0.0).sqrt();
        let matters = more / gear.deflection_rms > gear.std / gear.stiffness;
        gear.told && matters && gear.rest_rms > ENCODER_REST * gear.noise_rms
    };
    let caveat = |gear: &EncoderFigures| {
        ENCODER_RESIDUAL.found(format!("encoders of {}", gear.joint), gear.rest_rms, gear.noise_rms)
    };
    encoders.iter().filter(exceeds_noise).map(caveat)
}

/// Displacements under forces, or under masses, that differ from the robot's by more than
/// [`LOAD_RATIO`]. Checks whether the factor between N and kg explains the ratio.
pub(super) fn load_caveats(nominal: &NominalArm, input: &MeasurementInput) -> Vec<Finding> {
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
        let arm = MeasuredArm { nominal, parameters: &[], measurements: &some };
        // The size of a displacement does not depend on the unknown rotations of instruments.
        let Ok(predicted) = arm.predicted(&DVector::zeros(some.own_unknowns())) else { continue };
        let size = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
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
    caveats
}

/// Rows of tables of places without a reading.
pub(super) fn empty_caveat(input: &MeasurementInput) -> Option<Finding> {
    let text = format!("{} rows of the tables have no place and are skipped", input.empty_rows);
    (input.empty_rows > 0).then(|| Finding::warning("empty-rows", "measurements", text, "").as_note())
}

/// Positions that do not fit the robot at any pose of the instrument.
pub(super) fn frame_caveat(answer: &Identification) -> Option<Finding> {
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
        Finding::warning("frames", "measurements", text, "compare one pose by hand with the robot model (inspect)")
    })
}
