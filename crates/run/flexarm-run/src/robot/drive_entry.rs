//! Drive entries of a robot file: kinds, rotors, friction and servos, from the text to checked
//! values.
//!
//! Quantities are on the joint's side of the gear (N m, rad; N, m for joints that slide). Start at
//! [`drives`]; a [`Drive`] then serves models and caveats. Not here: gearboxes (`gearbox_entry`),
//! default gains (`arm::servo_gains`).

use std::ops::Range;

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_flexlink::{GearStiffness, Gearbox, GuideTubes};
use flexarm_kinematics::{Joint, JointKind, Mechanism};
use flexarm_settings::known_names;
use flexarm_stepping::Friction;
use serde::Deserialize;
use toml::Spanned;

use crate::arm::options::DriveModel;
use crate::error::Error;
use crate::robot::entry_checks::loop_of_joint;
use crate::robot::gearbox_entry::{GearDamping, GearboxEntry, gear};

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
    pub ratio: f64,
    /// Rotor inertia reflected to the joint (kg m²). Models take it from the joint in
    /// [`crate::Robot::rigid`], which has it too.
    pub armature: f64,
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
    // Joint and kind of actuation, and whether they go together.
    let joint = joint_of(entry, mechanism, &fail)?;
    let kind = kind_of(entry, source)?;
    check_joint(entry, joint, kind, mechanism, &fail)?;
    let number = |value: &Option<Spanned<f64>>, what: &str, default: f64, lowest: f64| match value {
        None => Ok(default),
        Some(v) if v.get_ref().is_finite() && *v.get_ref() >= lowest => Ok(*v.get_ref()),
        Some(v) => Err(fail(v.span(), format!("{what} is {}, expected a number of at least {lowest}", v.get_ref()))),
    };
    // Rotor: its inertia counts ratio² times at the joint.
    let ratio = number(&entry.ratio, "ratio", 1.0, f64::MIN)?;
    if ratio == 0.0 {
        let span = entry.ratio.as_ref().map_or(0..0, Spanned::span);
        return Err(fail(span, "ratio is 0, expected the motor's turns per turn of the joint".into()));
    }
    let armature = ratio * ratio * number(&entry.motor_inertia, "motor_inertia", 0.0, 0.0)?;
    // Spring, without which a gearbox drive is none, and which a prescribed one does not use.
    let own_ratio = entry.ratio.as_ref().map(|_| ratio);
    let gearbox = entry.gearbox.as_ref().map(|gearbox| gear(joint, gearbox, own_ratio, &fail)).transpose()?;
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
    // Friction and servo.
    let gear = gearbox.as_ref().map(|(gearbox, _)| gearbox);
    let (friction, load_friction) = match &entry.friction {
        None => (Friction::NONE, 0.0),
        Some(friction) => friction_of(friction, kind, gear, &fail)?,
    };
    let servo = entry.servo.as_ref().map(|servo| checked_servo(servo, &fail)).transpose()?.unwrap_or_default();
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
        fail(
            entry.joint.span(),
            format!("the robot has no such movable joint; it has {}", known_names(entry.joint.get_ref(), &known)),
        )
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
    // Settings that only a motor can have.
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
