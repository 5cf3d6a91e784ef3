//! Checks for features that maximal coordinates do not support, before a run.

use flexarm_kinematics::Model;
use nalgebra::Vector3;

use crate::error::StepError;
use crate::plant::Plant;

/// Name of changes of inertia.
pub(super) const CHANGES: &str = "payloads that change";

/// Refuses arms with unsupported features.
pub(super) fn check_known(plant: &Plant) -> Result<(), StepError> {
    let unknown = [
        (!plant.torque_driven.is_empty(), "joints driven by torque"),
        (!plant.inertia_changes.is_empty(), CHANGES),
        (plant.has_hysteresis(), "gears with hysteresis"),
        (plant.has_guides(), "telescopic guides"),
        (plant.elements.iter().any(|e| e.curve.is_some()), "springs with play or curves"),
        (!plant.transmission.is_empty(), "transmission errors"),
        (!plant.load_friction.is_empty(), "friction that grows with the load"),
        (plant.coupling.as_ref().is_some_and(|coupling| !coupling.is_none()), "gears that move several joints"),
        (plant.model.has_mimic(), "mimic joints"),
    ];
    match unknown.iter().find(|(there, _)| *there) {
        _ if plant.model.has_modal() => Err(StepError::ModalLinks),
        None => Ok(()),
        Some((_, what)) => Err(StepError::NotInMaximal(what)),
    }
}

/// Minimum ratio of the smallest to the largest principal moment of inertia of an end body.
const MIN_MOMENT: f64 = 1e-9;

/// Checks the bodies at the ends of the arm: with six degrees of freedom and no body outward, they
/// need mass and moments of inertia of their own. Other bodies get them from the bodies they carry.
pub(super) fn check_ends(model: &Model) -> Result<(), StepError> {
    let carries = |i: usize| model.bodies().iter().any(|body| body.parent == i);
    for (_, body) in model.bodies().iter().enumerate().skip(1).filter(|(i, _)| !carries(*i)) {
        let mass = body.inertia.mass;
        let moments = if mass > 0.0 { body.inertia.inertia_com().symmetric_eigenvalues() } else { Vector3::zeros() };
        let (least, most) = (moments.min(), moments.max());
        if mass <= 0.0 || least <= MIN_MOMENT * most {
            return Err(StepError::Setup(format!(
                "spook works in maximal coordinates and needs a mass and three moments of inertia of link {:?}, at the end of \
                 the arm: it has {mass} kg and principal moments of {least:.3e} to {most:.3e} kg m²; give it (or its payload) \
                 an inertia, or use generalized-alpha",
                body.name
            )));
        }
    }
    Ok(())
}
