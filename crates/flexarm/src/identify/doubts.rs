//! What is doubtful of an identification.

use flexarm_identify::{Identified, ReadingKind};

use super::answer::{Identification, rms};
use super::file::MeasurementInput;
use crate::caveat::Caveat;
use crate::robot::Robot;

/// Scatter of places about the rigid robot, over their spread, beyond which frames or joints do not fit.
const FRAME_RATIO: f64 = 0.05;

pub(super) fn caveats(found: &Identified) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    if let Some(factor) = found.misfit {
        let text = format!(
            "the readings scatter {factor:.1} times as much as their deviations say: the model lacks something that gives way, \
             loads or frames are wrong, or the deviations are too small; the deviations of the results are enlarged by that"
        );
        caveats.push(Caveat::said(
            "misfit",
            "measurements",
            text,
            "free more parameters, look at the largest residuals",
        ));
    }
    for parameter in found.parameters.iter().filter(|p| !p.identifiable) {
        let text = format!("{} does not follow from these readings: it stays where it was", parameter.name);
        caveats.push(Caveat::said(
            "not-identifiable",
            "measurements",
            text,
            "measure where it counts: a plan says where",
        ));
    }
    if let Some(held) = found.held_out.as_ref().filter(|held| held.rms > held.rms_initial) {
        let text = format!(
            "readings that the fit had not seen are met worse than with the robot file as it is ({:.2} against {:.2} deviations): \
             there are too many parameters for these readings",
            held.rms, held.rms_initial
        );
        caveats.push(Caveat::said("over-fitted", "measurements", text, "fit fewer parameters or measure more poses"));
    }
    if !found.solution.converged {
        let text = "the search did not settle: take the values with care";
        caveats.push(Caveat::said("not-converged", "measurements", text, "a better first guess helps"));
    }
    caveats
}

/// Laws of gears that the readings are met without.
pub(super) fn gear_caveat(robot: &Robot) -> Option<Caveat> {
    let has = |drive: &&crate::Drive| {
        drive.gearbox.as_ref().is_some_and(|(_, gear)| gear.hysteresis.is_some() || !gear.transmission.is_empty())
    };
    let joints: Vec<&str> = robot.drives.iter().filter(has).map(|drive| drive.joint.as_str()).collect();
    (!joints.is_empty()).then(|| {
        let text = format!(
            "hysteresis and transmission errors of {} are not in the fit: gears are springs there",
            joints.join(", ")
        );
        Caveat::said("gear-laws", "measurements", text, "load from the same side every time").as_note()
    })
}

/// Places that no placement of the instrument brings near those of the robot.
pub(super) fn frame_caveat(input: &MeasurementInput, answer: &Identification) -> Option<Caveat> {
    let places = |k: &usize| answer.compared[*k].unit == "m";
    let has_places = input.measurements.readings.iter().any(|r| matches!(r.kind, ReadingKind::Place { .. }));
    let metres: Vec<usize> = (0..answer.compared.len()).filter(places).collect();
    if !has_places || metres.is_empty() {
        return None;
    }
    let measured: Vec<f64> = metres.iter().map(|k| answer.compared[*k].measured).collect();
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let spread = rms(measured.iter().map(|x| x - mean));
    let left = rms(metres.iter().map(|k| answer.compared[*k].after - answer.compared[*k].measured));
    (left > FRAME_RATIO * spread).then(|| {
        let text = format!(
            "the places are {:.1} mm (RMS) from those of the robot wherever the instrument stands: joint values, their order, senses or \
             units, or the targets are not those of this robot",
            1e3 * left
        );
        Caveat::said("frames", "measurements", text, "compare one pose by hand with what the robot model says (inspect)")
    })
}
