//! Drive entries of a robot file: gearbox springs, rotors, friction and servos, from the text to
//! checked values.

use std::ops::Range;

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_flexlink::{GearStiffness, Gearbox, GuideTubes};
use flexarm_kinematics::{Joint, JointKind, Mechanism};
use flexarm_stepping::{Damping, Friction, Harmonic, TorqueCurve};
use nalgebra::Matrix6;
use serde::Deserialize;
use toml::Spanned;

use crate::entry_checks::loop_of_joint;
use crate::error::Error;
use crate::gear_entry::{GearHysteresis, HarmonicEntry, HysteresisEntry, harmonics, hysteresis};
use crate::guide_entry::{GuideEntry, GuideTilt};
use crate::options::DriveModel;

/// Minimum sampling period of a servo (s); each sample is an event of the run.
const SHORTEST_SAMPLE: f64 = 1e-6;

/// Drive of a joint. Quantities are on the joint's side of the gear unless stated otherwise.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveEntry {
    /// Joint of the URDF.
    pub joint: Spanned<String>,
    /// `prescribed`, `gearbox` or `torque`.
    pub kind: Spanned<String>,
    /// Turns of the motor per turn of the joint; 1 by default. The sign does not matter here.
    pub ratio: Option<Spanned<f64>>,
    /// Inertia of the rotor, on the motor's side (kg m²).
    pub motor_inertia: Option<Spanned<f64>>,
    /// Spring between motor and link.
    pub gearbox: Option<Spanned<GearboxEntry>>,
    /// Friction between the motor and the base of the joint.
    pub friction: Option<Spanned<FrictionEntry>>,
    /// Torque limit; the URDF's effort limit by default (N m).
    pub torque_limit: Option<Spanned<f64>>,
    /// Controller for `kind = "torque"`.
    pub servo: Option<Spanned<ServoEntry>>,
}

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
    /// Tubes of a telescopic joint, instead of a stiffness.
    pub guide: Option<GuideEntry>,
}

impl GearboxEntry {
    /// Whether it has several stiffnesses, as an elastic connection of a fixed joint.
    fn connects(&self) -> bool {
        matches!(self.stiffness, Some(Numbers::Many(_) | Numbers::Matrix(_)))
    }
}

/// Friction of a drive.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrictionEntry {
    /// Viscous friction (N m s/rad).
    #[serde(default)]
    pub viscous: f64,
    /// Coulomb friction (N m).
    #[serde(default)]
    pub coulomb: f64,
    /// Static friction in excess of Coulomb friction (N m).
    #[serde(default)]
    pub stribeck: f64,
    /// Stribeck velocity (rad/s).
    #[serde(default = "stribeck_velocity")]
    pub stribeck_velocity: f64,
    /// Velocity over which the friction changes sign (rad/s).
    #[serde(default = "regularisation")]
    pub regularisation: f64,
    /// Friction divided by transmitted torque.
    #[serde(default)]
    pub load: f64,
}

fn stribeck_velocity() -> f64 {
    0.1
}

fn regularisation() -> f64 {
    0.01
}

/// Sampled controller of a joint.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoEntry {
    /// Gain of the position loop (1/s); 20 by default.
    pub position_gain: Option<f64>,
    /// Gain of the velocity loop (N m s/rad); inertia times 100/s by default.
    pub velocity_gain: Option<f64>,
    /// Integral gain of the velocity loop (N m/rad); 20/s times the velocity gain by default.
    pub integral_gain: Option<f64>,
    /// Sampling period (s); 1 ms by default, the same for all axes.
    pub sample_s: Option<f64>,
    /// Whether to add the rigid robot's torques along the reference motion.
    pub feed_forward: Option<bool>,
}

/// Kind of actuation of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveKind {
    /// The joint follows the trajectory exactly.
    Prescribed,
    /// The motor follows the trajectory exactly and moves the link through a spring.
    Gearbox,
    /// The motor is driven by torque under a servo, through a spring to the link if there is one.
    Torque,
}

/// Checked drive of a joint.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Joint.
    pub joint: String,
    /// Kind of actuation.
    pub kind: DriveKind,
    /// Turns of the motor per turn of the joint.
    pub(crate) ratio: f64,
    /// Rotor inertia reflected to the joint (kg m²).
    pub(crate) armature: f64,
    /// Spring of the gearbox, with its damping and curve.
    pub gearbox: Option<(Gearbox, GearDamping)>,
    /// Friction.
    pub friction: Friction,
    /// Load-dependent friction as a fraction of the transmitted torque.
    pub load_friction: f64,
    /// Torque limit (N m).
    pub torque_limit: f64,
    /// Servo settings as written.
    pub servo: ServoEntry,
}

impl Drive {
    /// Returns the turns of the motor per turn of the joint.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Returns the rotor inertia reflected to the joint (kg m²). Models take it from the joint in
    /// [`crate::Robot::rigid`], which has it too.
    pub fn armature(&self) -> f64 {
        self.armature
    }

    /// Returns the largest play to each side of the gearbox's rotations (rad) and translations (m);
    /// `slides`: whether its only spring is a translation. The curves of the springs include it.
    pub fn play(&self, slides: bool) -> [f64; 2] {
        let Some((_, springs)) = &self.gearbox else { return [0.0; 2] };
        let translations = match springs.play.len() {
            6 => 3,
            1 if slides => 1,
            _ => 0,
        };
        let largest = |play: &[f64]| play.iter().copied().fold(0.0, f64::max);
        [largest(&springs.play[translations..]), largest(&springs.play[..translations])]
    }
}

/// Damping and curve of a gearbox's springs.
#[derive(Clone, Debug)]
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
}

impl Drive {
    /// Returns the kind of actuation under this drive model.
    pub(crate) fn kind_as(&self, drives: DriveModel) -> DriveKind {
        match drives {
            DriveModel::AsFiled => self.kind,
            DriveModel::Rigid => DriveKind::Prescribed,
            DriveModel::Elastic if self.gearbox.is_some() => DriveKind::Gearbox,
            DriveModel::Elastic => DriveKind::Prescribed,
            DriveModel::Servo => DriveKind::Torque,
        }
    }

    /// Returns the gearbox if it is elastic under this drive model.
    pub(crate) fn gearbox_as(&self, drives: DriveModel) -> Option<Gearbox> {
        let gives_way = self.kind_as(drives) != DriveKind::Prescribed;
        self.gearbox.as_ref().filter(|_| gives_way).map(|(gearbox, _)| gearbox.clone())
    }

    /// Returns the tubes of the guide if the joint is telescopic; its deflections are rotations.
    pub fn guide(&self) -> Option<&GuideTubes> {
        match &self.gearbox.as_ref()?.0.stiffness {
            GearStiffness::Guide(tubes) => Some(tubes),
            _ => None,
        }
    }
}

impl GearDamping {
    /// Returns the damping of the gearbox spring number `component`, which has `size` coordinates.
    pub fn of(&self, component: usize, size: usize) -> Damping {
        match &self.dampers {
            None => Damping::Modal(0.03),
            Some(d) if size == 1 => Damping::Dampers([d[component], 0.0, 0.0, 0.0, 0.0, 0.0]),
            Some(d) => Damping::Dampers(std::array::from_fn(|c| d[c])),
        }
    }
}

/// Checks all drives; collects the errors so that all are found.
pub(crate) fn drives(
    entries: &[DriveEntry],
    mechanism: &Mechanism,
    source: &Source,
    warnings: &mut Vec<String>,
    faults: &mut Vec<Error>,
) -> Vec<Drive> {
    let mut drives: Vec<Drive> = Vec::new();
    let mut sample: Option<f64> = None;
    for entry in entries {
        match drive(entry, mechanism, source, warnings) {
            Err(error) => {
                // An unknown joint must not hide an unknown kind.
                faults.extend(kind_of(entry, source).err().filter(|other| *other != error).map(Error::from));
                faults.push(error.into());
            }
            Ok(drive) if drives.iter().any(|d| d.joint == drive.joint) => {
                let message = format!("joint {:?} has two [[drive]] entries: keep one", drive.joint);
                faults.push(source.error(entry.joint.span(), message).into());
            }
            Ok(drive) => {
                if let (DriveKind::Torque, Some(s)) = (drive.kind, drive.servo.sample_s)
                    && let Some(other) = sample.replace(s)
                    && other != s
                {
                    let message = format!("sample_s = {s}, another drive has {other}: all servos sample together");
                    faults.push(source.error(entry.joint.span(), message).into());
                }
                drives.push(drive);
            }
        }
    }
    drives
}

fn kind_of(entry: &DriveEntry, source: &Source) -> Result<DriveKind, RobotFileError> {
    match entry.kind.get_ref().as_str() {
        "prescribed" => Ok(DriveKind::Prescribed),
        "gearbox" => Ok(DriveKind::Gearbox),
        "torque" => Ok(DriveKind::Torque),
        other => {
            let text = format!(
                "drive of joint {:?}: kind {other:?} is not known; use \"prescribed\", \"gearbox\" or \"torque\"",
                entry.joint.get_ref()
            );
            Err(source.error(entry.kind.span(), text))
        }
    }
}

/// Reads the drive of a joint.
fn drive(
    entry: &DriveEntry,
    mechanism: &Mechanism,
    source: &Source,
    warnings: &mut Vec<String>,
) -> Result<Drive, RobotFileError> {
    let name = entry.joint.get_ref();
    let fail = |span: Range<usize>, message: String| source.error(span, format!("drive of joint {name:?}: {message}"));
    let joint = joint_of(entry, mechanism, &fail)?;
    let kind = kind_of(entry, source)?;
    check_joint(entry, joint, kind, mechanism, &fail)?;
    let number = |value: &Option<Spanned<f64>>, what: &str, default: f64, lowest: f64| match value {
        None => Ok(default),
        Some(v) if v.get_ref().is_finite() && *v.get_ref() >= lowest => Ok(*v.get_ref()),
        Some(v) => Err(fail(v.span(), format!("{what} is {}, expected a number of at least {lowest}", v.get_ref()))),
    };
    let ratio = number(&entry.ratio, "ratio", 1.0, f64::MIN)?;
    if ratio == 0.0 {
        let span = entry.ratio.as_ref().map_or(0..0, Spanned::span);
        return Err(fail(span, "ratio is 0, expected the motor's turns per turn of the joint".into()));
    }
    let armature = ratio * ratio * number(&entry.motor_inertia, "motor_inertia", 0.0, 0.0)?;
    let gearbox = match &entry.gearbox {
        Some(gearbox) => Some(gear(joint, gearbox, entry.ratio.as_ref().map(|_| ratio), &fail)?),
        None => None,
    };
    match (kind, &gearbox) {
        (DriveKind::Gearbox, None) => {
            let text = "kind = \"gearbox\" needs gearbox = { stiffness = ..., damping = ... }";
            return Err(fail(entry.kind.span(), text.into()));
        }
        (DriveKind::Prescribed, Some(_)) => warnings.push(format!(
            "drive of joint {name:?}: its gearbox is not used because kind = \"prescribed\" drives the link itself; \
             kind = \"gearbox\" would put the spring in"
        )),
        (DriveKind::Torque, Some(_)) if armature == 0.0 => {
            let text = "a motor that drives through a spring needs an inertia: give motor_inertia and ratio";
            return Err(fail(entry.kind.span(), text.into()));
        }
        _ => {}
    }
    let gear = gearbox.as_ref().map(|(gearbox, _)| gearbox);
    let (friction, load_friction) = match &entry.friction {
        None => (Friction::NONE, 0.0),
        Some(friction) => friction_of(friction, kind, gear, &fail)?,
    };
    let servo = match &entry.servo {
        None => ServoEntry::default(),
        Some(servo) => checked_servo(servo, &fail)?,
    };
    if entry.servo.is_some() && kind != DriveKind::Torque {
        warnings.push(format!("drive of joint {name:?}: its servo is not used, only kind = \"torque\" has one"));
    }
    let torque_limit = number(&entry.torque_limit, "torque_limit", joint.limits.effort, 0.0)?;
    let joint = name.clone();
    Ok(Drive { joint, kind, ratio, armature, gearbox, friction, load_friction, torque_limit, servo })
}

/// Returns the joint of a drive; a fixed one may have an elastic connection.
fn joint_of<'m>(
    entry: &DriveEntry,
    mechanism: &'m Mechanism,
    fail: &impl Fn(Range<usize>, String) -> RobotFileError,
) -> Result<&'m Joint, RobotFileError> {
    let connects = entry.gearbox.as_ref().is_some_and(|gearbox| gearbox.get_ref().connects());
    let moves = |joint: &&Joint| joint.kind != JointKind::Fixed || connects;
    let found = mechanism.joints.iter().filter(moves).find(|joint| joint.name == *entry.joint.get_ref());
    found.ok_or_else(|| {
        let movable =
            |joint: &&Joint| joint.kind != JointKind::Fixed && loop_of_joint(mechanism, &joint.name).is_none();
        let known: Vec<_> = mechanism.joints.iter().filter(movable).map(|joint| joint.name.as_str()).collect();
        fail(entry.joint.span(), format!("the robot has no such movable joint; it has {known:?}"))
    })
}

/// Checks that a joint can have a drive of this kind.
fn check_joint(
    entry: &DriveEntry,
    joint: &Joint,
    kind: DriveKind,
    mechanism: &Mechanism,
    fail: &impl Fn(Range<usize>, String) -> RobotFileError,
) -> Result<(), RobotFileError> {
    let of_motor = entry.friction.is_some()
        || entry.servo.is_some()
        || entry.motor_inertia.is_some()
        || entry.ratio.is_some()
        || entry.torque_limit.is_some();
    if joint.kind == JointKind::Fixed && (kind == DriveKind::Torque || of_motor) {
        let text = "the joint is fixed: as an elastic connection it has kind = \"gearbox\" and a gearbox, no motor";
        return Err(fail(entry.kind.span(), text.into()));
    }
    if let Some(own) = loop_of_joint(mechanism, &joint.name) {
        let text = format!(
            "the joint follows from loop {own:?}: nothing drives it, drives belong to the other joints of the loop"
        );
        return Err(fail(entry.joint.span(), text));
    }
    if joint.mimic.is_some() && (kind == DriveKind::Torque || entry.friction.is_some()) {
        let text = "the joint mimics another one: servo and friction belong to that one's drive";
        return Err(fail(entry.joint.span(), text.into()));
    }
    Ok(())
}

/// Reads the friction of a joint, and the coefficient of the part that grows with its load.
fn friction_of(
    entry: &Spanned<FrictionEntry>,
    kind: DriveKind,
    gearbox: Option<&Gearbox>,
    fail: &impl Fn(Range<usize>, String) -> RobotFileError,
) -> Result<(Friction, f64), RobotFileError> {
    let FrictionEntry { viscous, coulomb, stribeck, stribeck_velocity, regularisation, load } = *entry.get_ref();
    let values = [viscous, coulomb, stribeck, load];
    let speeds = [stribeck_velocity, regularisation];
    if values.iter().any(|x| !(x.is_finite() && *x >= 0.0)) || speeds.iter().any(|x| !(x.is_finite() && *x > 0.0)) {
        let text = "friction takes viscous, coulomb, stribeck and load of at least 0, and speeds above 0";
        return Err(fail(entry.span(), text.into()));
    }
    if load > 0.0 && gearbox.is_some_and(|gearbox| !matches!(gearbox.stiffness, GearStiffness::Axis(_))) {
        let text = "friction with load needs a gearbox with one stiffness, about the axis";
        return Err(fail(entry.span(), text.into()));
    }
    if load > 0.0 && kind == DriveKind::Torque && gearbox.is_none() {
        let text = "friction with load on a joint driven by torque needs a gearbox, whose torque is the load";
        return Err(fail(entry.span(), text.into()));
    }
    Ok((Friction { viscous, coulomb, stribeck, stribeck_velocity, regularisation }, load))
}

/// Checks the gains and the sampling time of a servo.
fn checked_servo(
    entry: &Spanned<ServoEntry>,
    fail: &impl Fn(Range<usize>, String) -> RobotFileError,
) -> Result<ServoEntry, RobotFileError> {
    let servo = *entry.get_ref();
    let gains = [servo.position_gain, servo.velocity_gain, servo.integral_gain];
    if gains.iter().flatten().any(|g| !(g.is_finite() && *g >= 0.0)) {
        return Err(fail(entry.span(), "servo gains must be 0 or above".into()));
    }
    if let Some(t) = servo.sample_s.filter(|t| !(t.is_finite() && *t >= SHORTEST_SAMPLE)) {
        let text = format!("sample_s must be a positive time in seconds, {SHORTEST_SAMPLE} at least, found {t}");
        return Err(fail(entry.span(), text));
    }
    Ok(servo)
}

/// Reads a gearbox with its springs and dampers.
fn gear(
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
    let points = points_of(gear, &at)?;
    let (stiffness, size) = stiffness_of(gear, points.as_ref(), &at)?;
    let (stiffness, play) = with_play(gear.backlash.as_ref(), stiffness, &at)?;
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
    let damping = GearDamping { dampers, curves, play, transmission, hysteresis, tilts: Vec::new() };
    Ok((Gearbox { joint: joint.name.clone(), stiffness }, damping))
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

/// Returns the stiffness and the play of each spring; with play in any of six springs they act one
/// after another.
fn with_play(
    backlash: Option<&Numbers>,
    stiffness: GearStiffness,
    at: GearboxFault<'_>,
) -> Result<(GearStiffness, Vec<f64>), RobotFileError> {
    let given: &[f64] = match backlash {
        None => return Ok((stiffness, Vec::new())),
        Some(Numbers::One(play)) => &[*play],
        Some(Numbers::Many(play)) => play,
        Some(Numbers::Matrix(_)) => &[],
    };
    let stiffness = match stiffness {
        GearStiffness::Full(K) if K == Matrix6::from_diagonal(&K.diagonal()) => {
            GearStiffness::Separate(K.diagonal().into())
        }
        other => other,
    };
    let Some(k) = stiffness.each() else {
        return Err(at("backlash needs uncoupled springs: stiffness of one number, 3 or 6, not a 6x6 matrix".into()));
    };
    let play = checked_play(given, k.len()).map_err(|error| at(error.to_string()))?;
    match (play.iter().all(|play| *play == 0.0), stiffness) {
        (true, GearStiffness::Separate(k)) => Ok((GearStiffness::Full(Matrix6::from_diagonal(&k.into())), Vec::new())),
        (true, stiffness) => Ok((stiffness, Vec::new())),
        (false, stiffness) => Ok((stiffness, play)),
    }
}

/// Reason why numbers are not the play of springs.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlayError {
    /// Their number is not that of the springs.
    #[error(
        "backlash has a length of {found}, the stiffness of {expected}: give the play to each side of every spring"
    )]
    Count { found: usize, expected: usize },
    /// A number is negative or not finite.
    #[error("backlash = {0}: it must be 0 or above")]
    Negative(f64),
}

/// Checks the play of `count` springs.
pub(crate) fn checked_play(given: &[f64], count: usize) -> Result<Vec<f64>, PlayError> {
    if given.len() != count {
        return Err(PlayError::Count { found: given.len(), expected: count });
    }
    match given.iter().find(|play| !(play.is_finite() && **play >= 0.0)) {
        Some(wrong) => Err(PlayError::Negative(*wrong)),
        None => Ok(given.to_vec()),
    }
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
            (GearStiffness::Full(Matrix6::from_diagonal(&nalgebra::Vector6::from_column_slice(k))), 6)
        }
        (Some(Numbers::Matrix(rows)), _) if rows.len() == 6 && rows.iter().all(|r| r.len() == 6) => {
            let K = Matrix6::from_fn(|i, j| rows[i][j]);
            let asymmetry = (K - K.transpose()).amax() / K.amax();
            if asymmetry > 1e-9 {
                return Err(at(format!("the 6x6 stiffness is not symmetric: relative asymmetry {asymmetry:.1e}")));
            }
            (GearStiffness::Full((K + K.transpose()) * 0.5), 6)
        }
        _ => return Err(at("stiffness takes one number, 3, 6 or a 6x6 matrix".into())),
    };
    let finite = match &stiffness {
        GearStiffness::Axis(k) => k.is_finite() && *k > 0.0,
        GearStiffness::Tilting(k) => k.iter().all(|k| k.is_finite() && *k > 0.0),
        GearStiffness::Full(K) => K.iter().all(|k| k.is_finite()) && K.symmetric_eigenvalues().min() > 0.0,
        GearStiffness::Separate(_) | GearStiffness::Guide(_) => true,
    };
    if !finite {
        return Err(at("the stiffness must be finite and positive (definite)".into()));
    }
    Ok((stiffness, size))
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

/// Returns the guide of a telescopic joint.
fn guide_gear(
    joint: &Joint,
    guide: &GuideEntry,
    gear: &GearboxEntry,
    at: GearboxFault<'_>,
) -> Result<(Gearbox, GearDamping), RobotFileError> {
    let others = gear.stiffness.is_some() || gear.backlash.is_some() || gear.curve.is_some();
    if others || gear.hysteresis.is_some() || !gear.transmission_error.is_empty() {
        let text = "guide takes the place of stiffness and of all other laws of a gearbox: keep guide and damping";
        return Err(at(text.into()));
    }
    let (tubes, tilts) = guide.checked(joint).map_err(|error| at(error.to_string()))?;
    let dampers = dampers(gear, tilts.len(), at)?;
    let gearbox = Gearbox { joint: joint.name.clone(), stiffness: GearStiffness::Guide(tubes) };
    Ok((
        gearbox,
        GearDamping {
            dampers,
            curves: Vec::new(),
            play: Vec::new(),
            transmission: Vec::new(),
            hysteresis: None,
            tilts,
        },
    ))
}
