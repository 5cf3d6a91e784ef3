//! Checks of measurements against the nominal arm: modes and units.
//!
//! A file with wrong units is refused before the fit, which would find stiffnesses for it. Not
//! here: joint values, whose unit the reader checks.

use flexarm_run::Error;
use nalgebra::{DVector, Vector3};

use super::error::refused;
use super::file::MeasurementInput;
use crate::estimation::{Form, MeasuredArm, MeasuredResponse, Measurements, NominalArm, Reading, ReadingKind};

/// Ratio of measured to predicted size above which wrong units are the only plausible cause.
const UNIT_RATIO: f64 = 100.0;

/// Maximum factor by which every frequency differs from 2π times that of the model if it is given in
/// rad/s: the effect of wrong stiffnesses differs more between modes.
const RADIAN_RATIO: f64 = 1.6;

/// Rejects modes with numbers beyond those of the model.
pub(super) fn check_modes(nominal: &NominalArm, input: &MeasurementInput) -> Result<(), Error> {
    let modes = nominal.model.n_elastic();
    for reading in &input.measurements.readings {
        let ReadingKind::Frequencies { rows, .. } = &reading.kind else { continue };
        if let Some(row) = rows.iter().find(|row| row.of >= modes) {
            let (name, mode) = (&reading.name, row.of + 1);
            return Err(refused(format!("{name}: mode {mode} does not exist, the model has {modes} modes")));
        }
    }
    Ok(())
}

/// Compares displacements and distances with those of the nominal robot; a large ratio indicates
/// wrong units.
pub(super) fn check_units(nominal: &NominalArm, input: &MeasurementInput) -> Result<(), Error> {
    let subset = |which: fn(&Reading) -> bool| input.measurements.in_world(|k| which(&input.measurements.readings[k]));
    // An arm without equilibrium is not judged here.
    let both = |some: &Measurements| {
        let arm = MeasuredArm { nominal, parameters: &[], measurements: some };
        let expected = arm.predicted(&DVector::zeros(0)).unwrap_or_default();
        (arm.observed(), expected)
    };
    let norm = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
    let moved = subset(|reading| matches!(reading.kind, ReadingKind::Displacement { .. }));
    let (measured, expected) = both(&moved);
    check_ratio("displacements", norm(&measured), norm(&expected), input)?;
    let (measured, expected) = both(&subset(|reading| reading.position().is_some()));
    let spread = |values: &[f64]| {
        let points: Vec<Vector3<f64>> = values.chunks_exact(3).map(Vector3::from_column_slice).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        points.iter().map(|p| (p - middle).norm_squared()).sum::<f64>().sqrt()
    };
    check_ratio("distances between places", spread(&measured), spread(&expected), input)?;
    let (measured, expected) = both(&subset(|reading| matches!(reading.kind, ReadingKind::Frequencies { .. })));
    check_frequencies(&measured, &expected)?;
    for reading in &input.measurements.readings {
        let ReadingKind::Response(response) = &reading.kind else { continue };
        let plain = MeasuredResponse { form: Form::Logarithmic, ..response.clone() };
        let reading = Reading { kind: ReadingKind::Response(plain), ..reading.clone() };
        let one = Measurements { readings: vec![reading.clone()], ..Measurements::default() };
        let (measured, expected) = both(&one);
        let off: f64 = measured.iter().zip(&expected).step_by(2).map(|(a, b)| a - b).sum();
        let ratio = (off / response.points.len() as f64).exp();
        if expected.iter().any(|x| !x.is_finite()) {
            return Err(refused(format!(
                "{}: in the model the arm does not move there in that direction, or cannot be excited so: check nodes, \
                 their links and directions",
                reading.name
            )));
        }
        if !(1.0 / UNIT_RATIO..=UNIT_RATIO).contains(&ratio) {
            return Err(refused(format!(
                "{}: the measured response is {ratio:.3e} times as large as that of the robot model, which is \
                 implausible; check the unit, the measured quantity (displacement, velocity, acceleration), nodes and \
                 directions",
                reading.name
            )));
        }
    }
    Ok(())
}

/// Refuses frequencies that are those of the model in rad/s.
fn check_frequencies(measured: &[f64], expected: &[f64]) -> Result<(), Error> {
    let ratios: Vec<f64> = measured.iter().zip(expected).map(|(a, b)| a / b).collect();
    let turn = std::f64::consts::TAU;
    let in_rad = |ratio: &f64| (turn / RADIAN_RATIO..turn * RADIAN_RATIO).contains(ratio);
    match !ratios.is_empty() && ratios.iter().all(in_rad) {
        true => {
            let ratio = (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp();
            Err(refused(format!(
                "the measured frequencies are {ratio:.2} times as large as those of the robot model, all of them about \
                 2 pi times: they are expected in Hz; divide numbers in rad/s by 2 pi, or give initial stiffnesses of \
                 the right order of magnitude"
            )))
        }
        false => Ok(()),
    }
}

fn check_ratio(what: &'static str, measured: f64, expected: f64, input: &MeasurementInput) -> Result<(), Error> {
    if measured == 0.0 || expected == 0.0 {
        return Ok(());
    }
    let ratio = measured / expected;
    if (1.0 / UNIT_RATIO..=UNIT_RATIO).contains(&ratio) {
        return Ok(());
    }
    let units = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6)];
    let better = units.iter().find(|(_, size)| {
        let other = ratio * size / input.length_m;
        *size != input.length_m && (0.1..=10.0).contains(&other)
    });
    let help = match better {
        Some((name, _)) => format!("with length = {name:?} they would agree in magnitude"),
        None => "check units, loads and the initial stiffnesses".into(),
    };
    Err(refused(format!(
        "the measured {what} are {ratio:.3e} times as large as those of the robot model, which is implausible. The file \
         has length = {:?}; {help}",
        input.length
    )))
}
