//! Gearbox of a drive: springs, dampers, play, curves and guides, from the text to checked values.
//!
//! Springs are on the joint's side, along and about the axes of the joint frame (N/m, N m/rad): one
//! about the axis, three about x, y, z, or six. Start at [`gear`]. Not here: transmission error and
//! hysteresis (`gear_entry`), tubes of telescopic joints (`guide_entry`).

use std::ops::Range;

use flexarm_files::TextFileError as RobotFileError;
use flexarm_flexlink::{GearStiffness, Gearbox, spring_stiffness};
use flexarm_kinematics::{Joint, JointKind};
use flexarm_stepping::{Damping, Harmonic, TorqueCurve};
use nalgebra::{Matrix6, Vector6};
use serde::Deserialize;
use toml::Spanned;

use crate::robot::gear_entry::{GearHysteresis, HarmonicEntry, HysteresisEntry, harmonics, hysteresis};
use crate::robot::guide_entry::{GuideEntry, GuideTilt};

/// A number, a list of numbers or a matrix.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a number, a list of 3 or 6 numbers, or a 6x6 matrix")]
pub(crate) enum Numbers {
    /// Single number.
    One(f64),
    /// List.
    Many(Vec<f64>),
    /// Matrix by rows.
    Matrix(Vec<Vec<f64>>),
}

/// Spring and damper of a gearbox.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GearboxEntry {
    /// Stiffness about the axis (N m/rad); or about x, y, z of the joint frame; or for its three
    /// translations and rotations; or a 6x6 matrix.
    pub stiffness: Option<Numbers>,
    /// Damping in the same forms except 6x6 (N m s/rad); 3 % modal damping by default.
    pub damping: Option<Numbers>,
    /// Play to each side (rad), in the form of the stiffness.
    pub backlash: Option<Numbers>,
    /// Torque curve instead of a stiffness: points (deflection, torque).
    pub curve: Option<Vec<[f64; 2]>>,
    /// Harmonics of the transmission error.
    #[serde(default)]
    pub transmission_error: Vec<HarmonicEntry>,
    /// Internal friction, in catalogue terms.
    pub hysteresis: Option<HysteresisEntry>,
    /// Stiffness of the housing across the joint's axis, before its angle (N m/rad).
    pub seat: Option<Spanned<[f64; 2]>>,
    /// Tubes of a telescopic joint, instead of a stiffness.
    pub guide: Option<GuideEntry>,
    /// Whether the stiffness was identified from measurements, so that no caveat questions it.
    #[serde(default)]
    pub identified: bool,
}

impl GearboxEntry {
    /// Whether it has several stiffnesses, as an elastic connection of a fixed joint.
    pub(crate) fn connects(&self) -> bool {
        matches!(self.stiffness, Some(Numbers::Many(_) | Numbers::Matrix(_)))
    }
}

/// Damping and curve of a gearbox's springs.
#[derive(Clone, Debug, Default)]
pub struct GearDamping {
    /// Damping per coordinate; None means 3 % modal damping.
    pub dampers: Option<Vec<f64>>,
    /// Torque curve of each spring; empty if all are linear.
    pub curves: Vec<Option<TorqueCurve>>,
    /// Play of each spring to each side (rad or m), which its curve includes; empty if there is
    /// none.
    pub play: Vec<f64>,
    /// Harmonics of the transmission error.
    pub transmission: Vec<Harmonic>,
    /// Internal friction.
    pub hysteresis: Option<GearHysteresis>,
    /// Tilts of a telescopic guide, one per spring; empty for other gearboxes.
    pub tilts: Vec<GuideTilt>,
    /// Whether the stiffness was identified from measurements.
    pub identified: bool,
}

impl GearDamping {
    /// Returns the damping of the gearbox spring number `component`, which has `size` coordinates: 1, or
    /// 6 for springs that are coupled. 3 % modal damping without dampers, and for the springs of a seat.
    pub fn of(&self, component: usize, size: usize) -> Damping {
        match &self.dampers {
            None => Damping::Modal(0.03),
            // The springs of a seat have none.
            Some(d) if component >= d.len() => Damping::Modal(0.03),
            Some(d) if size == 1 => Damping::Dampers([d[component], 0.0, 0.0, 0.0, 0.0, 0.0]),
            Some(d) => Damping::Dampers(std::array::from_fn(|c| d[c])),
        }
    }
}

/// Reads a gearbox with its springs and dampers.
pub(crate) fn gear(
    joint: &Joint,
    entry: &Spanned<GearboxEntry>,
    ratio: Option<f64>,
    fail: &impl Fn(Range<usize>, String) -> RobotFileError,
) -> Result<(Gearbox, GearDamping), RobotFileError> {
    let gear = entry.get_ref();
    let at = |message: String| fail(entry.span(), message);
    if let Some(guide) = &gear.guide {
        return guide_gear(joint, guide, gear, &at);
    }
    // Springs, with their play.
    let points = points_of(gear, &at)?;
    let (stiffness, size) = stiffness_of(gear, points.as_ref(), &at)?;
    let springs = match &stiffness {
        GearStiffness::Full(K) => uncoupled(K),
        other => other.each().map(<[f64]>::len),
    };
    let play = play_of(gear.backlash.as_ref(), springs).map_err(|error| at(error.to_string()))?;
    let stiffness = match stiffness {
        // Six springs with play act one after another.
        GearStiffness::Full(K) if !play.is_empty() => GearStiffness::Separate(K.diagonal().into()),
        other => other,
    };
    // Laws beyond stiffness and play: dampers, curves, transmission error, hysteresis.
    let dampers = dampers(gear, size, &at)?;
    if size > 1 && (gear.hysteresis.is_some() || !gear.transmission_error.is_empty()) {
        return Err(at("transmission_error and hysteresis need one stiffness, about the axis".into()));
    }
    let transmission = harmonics(&gear.transmission_error, ratio).map_err(|error| at(error.to_string()))?;
    let curves = match (points, stiffness.each()) {
        (Some(points), _) => vec![Some(points)],
        (None, Some(k)) if !play.is_empty() => curves_with_play(k, &play),
        _ => Vec::new(),
    };
    let about = if let GearStiffness::Axis(k) = stiffness { k } else { f64::NAN };
    let curve = curves.first().and_then(Option::as_ref);
    let law = gear.hysteresis.as_ref().map(|entry| hysteresis(entry, about, curve));
    let hysteresis = law.transpose().map_err(|error| at(error.to_string()))?;
    let identified = gear.identified;
    let damping = GearDamping { dampers, curves, play, transmission, hysteresis, tilts: Vec::new(), identified };
    let seat = gear.seat.as_ref().map(|seat| seat_of(joint, seat.get_ref(), size, gear));
    let seat = seat.transpose().map_err(|text| at(text.into()))?;
    Ok((Gearbox { joint: joint.name.clone(), stiffness, seat }, damping))
}

/// Returns the stiffness of the housing of a joint before its angle.
fn seat_of(joint: &Joint, seat: &[f64; 2], size: usize, gear: &GearboxEntry) -> Result<[f64; 2], &'static str> {
    if joint.kind == JointKind::Fixed {
        return Err("seat is before the angle of a moving joint; this joint is fixed: use stiffness");
    }
    if size > 3 || gear.hysteresis.is_some() || !gear.transmission_error.is_empty() {
        return Err("seat goes with one or three stiffnesses, without transmission_error and hysteresis");
    }
    match seat.iter().all(|k| k.is_finite() && *k > 0.0) {
        true => Ok(*seat),
        false => Err("seat takes two finite stiffnesses above 0"),
    }
}

/// Makes an error at a gearbox.
type GearboxFault<'a> = &'a dyn Fn(String) -> RobotFileError;

/// Returns the torque curve of a gearbox that is given by points.
fn points_of(gear: &GearboxEntry, at: GearboxFault<'_>) -> Result<Option<TorqueCurve>, RobotFileError> {
    match (&gear.curve, &gear.backlash, &gear.stiffness) {
        (Some(points), None, None) => TorqueCurve::new(points).map(Some).map_err(|error| at(error.to_string())),
        (Some(_), ..) => Err(at("curve takes the place of stiffness and backlash: give one of them".into())),
        (None, _, None) => {
            Err(at("gearbox needs stiffness = N m/rad, curve = [[rad, N m], ...], or guide = { ... }".into()))
        }
        (None, _, Some(_)) => Ok(None),
    }
}

/// Reads the play of `springs` springs, `None` if they are coupled; empty if there is none.
pub(crate) fn play_of(given: Option<&Numbers>, springs: Option<usize>) -> Result<Vec<f64>, String> {
    let play: &[f64] = match given {
        None => return Ok(Vec::new()),
        Some(Numbers::One(play)) => std::slice::from_ref(play),
        Some(Numbers::Many(play)) => play,
        Some(Numbers::Matrix(_)) => &[],
    };
    let expected = springs.ok_or("backlash needs uncoupled springs: stiffness of single numbers, not a 6x6 matrix")?;
    if play.len() != expected {
        let message = format!(
            "backlash has a length of {found}, the stiffness of {expected}: give the play to each side of every \
             spring",
            found = play.len()
        );
        return Err(message);
    }
    match play.iter().find(|play| !(play.is_finite() && **play >= 0.0)) {
        Some(wrong) => Err(format!("backlash = {wrong}: it must be 0 or above")),
        None if play.iter().all(|play| *play == 0.0) => Ok(Vec::new()),
        None => Ok(play.to_vec()),
    }
}

/// Returns the number of springs along and about six axes; `None` if they are coupled.
pub(crate) fn uncoupled(K: &Matrix6<f64>) -> Option<usize> {
    (*K == Matrix6::from_diagonal(&K.diagonal())).then_some(6)
}

/// Returns the curves of springs with play; `None` for those without.
pub(crate) fn curves_with_play(stiffness: &[f64], play: &[f64]) -> Vec<Option<TorqueCurve>> {
    let springs = stiffness.iter().zip(play);
    springs.map(|(k, play)| (*play > 0.0).then(|| TorqueCurve::backlash(*k, *play))).collect()
}

/// Returns the stiffness of a gearbox and its number of coordinates.
fn stiffness_of(
    gear: &GearboxEntry,
    curve: Option<&TorqueCurve>,
    at: GearboxFault<'_>,
) -> Result<(GearStiffness, usize), RobotFileError> {
    let (stiffness, size) = match (&gear.stiffness, curve) {
        (Some(Numbers::One(k)), _) => (GearStiffness::Axis(*k), 1),
        (None, Some(curve)) => (GearStiffness::Axis(curve.stiffest()), 1),
        (Some(Numbers::Many(k)), _) if k.len() == 3 => (GearStiffness::Tilting([k[0], k[1], k[2]]), 3),
        (Some(Numbers::Many(k)), _) if k.len() == 6 => {
            (GearStiffness::Full(Matrix6::from_diagonal(&Vector6::from_column_slice(k))), 6)
        }
        (Some(Numbers::Matrix(rows)), _) if rows.len() == 6 && rows.iter().all(|r| r.len() == 6) => {
            (GearStiffness::Full(Matrix6::from_fn(|i, j| rows[i][j])), 6)
        }
        _ => return Err(at("stiffness takes one number, 3, 6 or a 6x6 matrix".into())),
    };
    // A matrix must be symmetric and positive definite; numbers must be positive.
    if let GearStiffness::Full(K) = &stiffness {
        let K = spring_stiffness(K).map_err(|error| at(format!("stiffness: {error}")))?;
        return Ok((GearStiffness::Full(K), size));
    }
    match stiffness.each().unwrap_or_default().iter().find(|k| !(k.is_finite() && **k > 0.0)) {
        Some(found) => Err(at(format!("the stiffness must be finite and positive, found {found:e}"))),
        None => Ok((stiffness, size)),
    }
}

/// Returns the dampers of a gearbox with `size` coordinates, if it has any.
fn dampers(gear: &GearboxEntry, size: usize, at: GearboxFault<'_>) -> Result<Option<Vec<f64>>, RobotFileError> {
    let dampers = match &gear.damping {
        None => return Ok(None),
        Some(Numbers::One(d)) if size == 1 => vec![*d],
        Some(Numbers::Many(d)) if d.len() == size => d.clone(),
        Some(_) => {
            let text = match size {
                1 => "one number".to_owned(),
                n => format!("{n} numbers"),
            };
            return Err(at(format!("with this stiffness, damping takes {text}")));
        }
    };
    match dampers.iter().all(|d| d.is_finite() && *d >= 0.0) {
        true => Ok(Some(dampers)),
        false => Err(at("damping must be 0 or above".into())),
    }
}

/// Reads the gearbox of a telescopic joint, which has a guide and no other spring.
fn guide_gear(
    joint: &Joint,
    guide: &GuideEntry,
    gear: &GearboxEntry,
    at: GearboxFault<'_>,
) -> Result<(Gearbox, GearDamping), RobotFileError> {
    let others = gear.stiffness.is_some() || gear.backlash.is_some() || gear.curve.is_some() || gear.seat.is_some();
    if others || gear.hysteresis.is_some() || !gear.transmission_error.is_empty() {
        let text = "guide takes the place of stiffness and of all other laws of a gearbox: keep guide and damping";
        return Err(at(text.into()));
    }
    let (tubes, tilts) = guide.checked(joint).map_err(|error| at(error.to_string()))?;
    let dampers = dampers(gear, tilts.len(), at)?;
    let gearbox = Gearbox { joint: joint.name.clone(), stiffness: GearStiffness::Guide(tubes), seat: None };
    Ok((gearbox, GearDamping { dampers, tilts, identified: gear.identified, ..GearDamping::default() }))
}
