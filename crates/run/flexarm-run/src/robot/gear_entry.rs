//! Gear entries of a robot file beyond stiffness: transmission error and hysteresis, and the gear
//! effects of a robot.
//!
//! Catalogue terms become laws on the joint's side (rad, N m). Start at [`harmonics`] and
//! [`hysteresis`]. Not here: stiffness, play and damping (`gearbox_entry`), the torque of the laws
//! (`flexarm_stepping::Hysteresis`).

use flexarm_stepping::{
    GearCoupling, Harmonic, Hysteresis, LoadFriction, Plant, StepError, TorqueCurve, TransmissionError,
};
use nalgebra::DMatrix;
use serde::Deserialize;

use crate::robot::drive_entry::Drive;

/// One arc second (rad).
const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;
const ARCMIN: f64 = 60.0 * ARCSEC;
/// Default number of sliders of a hysteresis.
const SLIDERS: usize = 8;
/// Maximum number of sliders.
const MAX_SLIDERS: i64 = 200;
/// Fraction of the rated torque at which catalogues give the lost motion.
const LOST_MOTION_AT: f64 = 0.03;

/// A harmonic of a transmission error.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HarmonicEntry {
    /// Amplitude on the joint's side, half of peak to peak (rad).
    pub amplitude: Option<f64>,
    /// Amplitude (arc seconds).
    pub amplitude_arcsec: Option<f64>,
    /// Cycles per turn of the motor.
    pub per_motor_turn: Option<f64>,
    /// Cycles per turn of the joint.
    pub per_joint_turn: Option<f64>,
    /// Phase at joint value zero (rad).
    #[serde(default)]
    pub phase: f64,
}

/// Hysteresis of a gear in catalogue terms.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HysteresisEntry {
    /// Width of the loop at zero torque, after loading in both directions (rad).
    pub loss: Option<f64>,
    /// The same in arc minutes.
    pub loss_arcmin: Option<f64>,
    /// Distance between the mid-points of the loop at ±3 % of the rated torque (rad); follows from
    /// the stiffness by default.
    pub lost_motion: Option<f64>,
    /// The same in arc minutes.
    pub lost_motion_arcmin: Option<f64>,
    /// Rated torque to which the lost motion refers (N m).
    pub rated_torque: Option<f64>,
    /// Deflection of first loading at which all friction slips (rad); half the loss by default.
    pub reach: Option<f64>,
    /// Number of sliders in the model.
    pub sliders: Option<i64>,
}

/// Checked coupling of joints.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotCoupling {
    /// Coupled joints, one motor each.
    pub joints: Vec<String>,
    /// Matrix C of `q_joints = C q_motors`.
    pub C: DMatrix<f64>,
    /// Inverse of `C`.
    pub C_inverse: DMatrix<f64>,
}

/// Hysteresis of a gear.
#[derive(Clone, Debug, PartialEq)]
pub struct GearHysteresis {
    /// Law of the torque.
    pub law: Hysteresis,
    /// Width of the loop at zero torque (rad).
    pub loss: f64,
}

/// Reads a value in rad, or in another unit under another key; at most one may be given.
fn one_of(keys: [(&'static str, Option<f64>); 2], unit: f64) -> Result<Option<f64>, String> {
    let [(own, value), (other, scaled)] = keys;
    let found = match (value, scaled) {
        (Some(_), Some(_)) => return Err(format!("{own} and {other} are both given: keep one of them")),
        (Some(x), None) => Some((own, x, x)),
        (None, Some(x)) => Some((other, x, x * unit)),
        (None, None) => None,
    };
    match found {
        Some((key, x, _)) if !(x.is_finite() && x > 0.0) => Err(format!("{key} is {x}, expected a positive number")),
        found => Ok(found.map(|(_, _, value)| value)),
    }
}

/// Reads the harmonics of a gear whose motor makes `ratio` turns per turn of the joint.
///
/// # Errors
/// A sentence with the remedy for a missing or invalid value.
pub(crate) fn harmonics(entries: &[HarmonicEntry], ratio: Option<f64>) -> Result<Vec<Harmonic>, String> {
    let harmonic = |entry: &HarmonicEntry| {
        let keys = [("amplitude", entry.amplitude), ("amplitude_arcsec", entry.amplitude_arcsec)];
        let amplitude = one_of(keys, ARCSEC)?.ok_or("transmission_error needs amplitude (rad) or amplitude_arcsec")?;
        let cycles = match (entry.per_motor_turn, entry.per_joint_turn, ratio) {
            (Some(n), None, Some(ratio)) => n * ratio.abs(),
            (Some(_), None, None) => {
                return Err("transmission_error per_motor_turn needs the ratio of the drive".into());
            }
            (None, Some(n), _) => n,
            _ => return Err("transmission_error needs one of per_motor_turn and per_joint_turn".into()),
        };
        if !(cycles.is_finite() && cycles > 0.0 && entry.phase.is_finite()) {
            let message = format!(
                "transmission_error has {cycles} cycles in a turn of the joint and phase {phase}: expected positive \
                 and finite numbers",
                phase = entry.phase
            );
            return Err(message);
        }
        Ok(Harmonic { amplitude, cycles, phase: entry.phase })
    };
    entries.iter().map(harmonic).collect()
}

/// Builds the hysteresis of a spring with this curve.
///
/// The total friction of the sliders equals the torque of the elastic part at half the loss: with
/// all sliders slipping, the branches of the loop cross zero torque there.
///
/// # Errors
/// A sentence with the remedy for a value that is missing, invalid or inconsistent with the stiffness.
pub(crate) fn hysteresis(
    entry: &HysteresisEntry,
    stiffness: f64,
    curve: Option<&TorqueCurve>,
) -> Result<GearHysteresis, String> {
    let loss = one_of([("loss", entry.loss), ("loss_arcmin", entry.loss_arcmin)], ARCMIN)?;
    let loss = loss.ok_or("hysteresis needs loss (rad) or loss_arcmin: the width of its loop without torque")?;
    let elastic = elastic_part(entry, stiffness, curve, loss)?;
    // Friction of all sliders together, and how it grows with the deflection of first loading.
    let friction = elastic.torque(0.5 * loss);
    if friction <= 0.0 {
        return Err(format!(
            "hysteresis has a loss of {loss:e} rad within the play, where no torque holds the gear back: give a \
             larger loss, or less backlash"
        ));
    }
    let reach = match entry.reach {
        None => 0.5 * loss,
        Some(reach) if reach.is_finite() && reach > 0.0 => reach,
        Some(reach) => return Err(format!("hysteresis has reach {reach}, expected a positive deflection in rad")),
    };
    let sliders = match entry.sliders {
        None => SLIDERS,
        Some(n) if (1..=MAX_SLIDERS).contains(&n) => n as usize,
        Some(n) => return Err(format!("hysteresis has {n} sliders, expected 1 to {MAX_SLIDERS}")),
    };
    let sliders = Hysteresis::even_sliders(friction, reach, sliders);
    Ok(GearHysteresis { law: Hysteresis { elastic, sliders }, loss })
}

/// Returns the elastic part of a hysteresis: the curve or the stiffness, or a curve that is softer
/// around zero for a given lost motion.
///
/// * `loss`: width of the loop at zero torque (rad).
fn elastic_part(
    entry: &HysteresisEntry,
    stiffness: f64,
    curve: Option<&TorqueCurve>,
    loss: f64,
) -> Result<TorqueCurve, String> {
    let lost_motion =
        one_of([("lost_motion", entry.lost_motion), ("lost_motion_arcmin", entry.lost_motion_arcmin)], ARCMIN)?;
    Ok(match (curve, lost_motion, entry.rated_torque) {
        (Some(_), Some(_), _) => {
            return Err("hysteresis with lost_motion takes a stiffness: backlash and a curve say the same".into());
        }
        (None, Some(_), None) => {
            return Err("hysteresis needs the rated_torque (N m) to which its lost_motion belongs".into());
        }
        (_, _, Some(rated)) if !(rated.is_finite() && rated > 0.0) => {
            return Err(format!("hysteresis has rated_torque {rated}, expected a positive torque in N m"));
        }
        (None, Some(lost), Some(rated)) => {
            let (torque, half) = (LOST_MOTION_AT * rated, 0.5 * lost);
            if half <= torque / stiffness {
                let message = format!(
                    "hysteresis has a lost motion of {lost:e} rad, less than the {elastic:e} rad of elastic \
                     deflection at 3 % of the rated torque to either side: check both, or leave lost_motion out",
                    elastic = 2.0 * torque / stiffness
                );
                return Err(message);
            }
            // On either branch of the loop the elastic part is offset by half the loop width. It
            // must be soft up to that offset plus half the lost motion, so that the middle line
            // shows the lost motion whatever the width.
            let (slope, soft) = (torque / half, half + 0.5 * loss);
            let (edge, far) = (slope * soft, soft + 1.0);
            let end = edge + stiffness;
            TorqueCurve::new(&[[-far, -end], [-soft, -edge], [0.0, 0.0], [soft, edge], [far, end]])
                .map_err(|error| error.to_string())?
        }
        (Some(curve), None, _) => curve.clone(),
        (None, None, _) => TorqueCurve::straight(stiffness),
    })
}

/// Gear effects other than elasticity and hysteresis, assigned to their elements.
#[derive(Clone, Debug, Default)]
pub(crate) struct GearLaws {
    pub(crate) transmission: Vec<TransmissionError>,
    pub(crate) load_friction: Vec<LoadFriction>,
    pub(crate) coupling: Option<GearCoupling>,
}

impl GearLaws {
    /// Adds those of a drive whose joint has this coordinate and whose gearbox, if elastic, is this
    /// element.
    pub(crate) fn add(&mut self, drive: &Drive, coordinate: usize, element: Option<usize>) {
        if let (Some(element), Some((_, gear))) = (element, &drive.gearbox)
            && !gear.transmission.is_empty()
        {
            let harmonics = gear.transmission.clone();
            self.transmission.push(TransmissionError { element, motor: coordinate, harmonics });
        }
        if drive.load_friction > 0.0 {
            let (coefficient, regularisation) = (drive.load_friction, drive.friction.regularisation);
            self.load_friction.push(LoadFriction { coordinate, element, coefficient, regularisation });
        }
    }

    /// Adds them to a plant.
    pub(crate) fn put_into(&self, mut plant: Plant) -> Result<Plant, StepError> {
        plant.load_friction.clone_from(&self.load_friction);
        if let Some(coupling) = &self.coupling {
            plant = plant.with_coupling(coupling.clone())?;
        }
        if !self.transmission.is_empty() {
            plant = plant.with_transmission_errors(self.transmission.clone())?;
        }
        Ok(plant)
    }
}
