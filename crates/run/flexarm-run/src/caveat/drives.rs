//! Caveats about the drives of a robot file: gear stiffness relative to the effort limit, backlash,
//! ratio, rotor, friction, gains.
//!
//! Start at [`of_drives`]; [`give`], [`speed_loop`] and [`integral`] judge an arm at rest. Quantities
//! are on the joint's side of the gear (N m, rad). Not here: drives with an error
//! (`robot/drive_entry.rs`), the arm at rest itself (`pose.rs`).

use std::ops::RangeInclusive;

use flexarm_flexlink::GearStiffness;
use flexarm_kinematics::{Mechanism, Model};

use super::links::{CREEP, USUAL_DAMPING};
use super::size::inertia_moved;
use super::slip::{self, outside, slip};
use super::{Finding, kinds};
use crate::robot::drive_entry::{Drive, DriveKind};
use crate::robot::gearbox_entry::GearDamping;

/// Effort limit above which drives have stiff gears (N m); weaker drives may contain springs on
/// purpose.
const STRONG: f64 = 150.0;
/// Rotation of a strong gear under its effort limit (rad): note, warning. Reducers have 1e-3 at
/// rated torque, 5e-3 at peak.
const TURNED: [f64; 2] = [0.01, 0.08];
/// As [`TURNED`], for weak drives, including series-elastic ones.
const TURNED_WEAK: [f64; 2] = [0.3, 3.0];
/// A note above this multiple of its threshold also names the probable unit error.
const HINTED: f64 = 3.0;
/// Maximum ratio of a strong gear's rotation to the median of the robot's other strong gears:
/// shipped robots have up to 7.5, up to 15 if one gear is half as stiff, and most exceed it if one
/// gear is given in N m/deg.
const MAX_ROTATION_RATIO: f64 = 16.0;
/// Rotation below which gears are too stiff (rad): note, warning.
const RIGID: [f64; 2] = [1e-4, 1e-5];
/// Elastic rotation of gears under gravity (rad): note, warning; for strong drives and weak ones.
const SAGS: [[f64; 2]; 2] = [[0.01, 0.05], [0.05, 0.15]];
/// Maximum elastic translation of a gear's bearings (m).
const BEARING: f64 = 5e-3;
/// Lever of a bearing (m): square root of rotational over translational stiffness.
const LEVER: RangeInclusive<f64> = 1e-3..=1.0;
/// Backlash to each side (rad): note, warning.
const PLAY: [f64; 2] = [0.01, 0.05];
/// Minimum damping over stiffness of a gear (s); identified gears have 1e-4 to 7e-3.
const UNDAMPED: f64 = 2e-6;
/// Maximum transmission error (rad); small strain wave gears have 2 arcmin.
const TRANSMISSION_ERROR: f64 = 1e-3;
/// Maximum hysteresis loss (rad); small strain wave gears have 3 arcmin, belts more.
const HYSTERESIS_LOSS: f64 = 3e-3;
/// Maximum friction divided by transmitted torque; even small strain wave gears transmit two
/// thirds.
const LOAD_FRICTION: f64 = 0.5;
/// Range of the turns of the motor per turn of the joint.
const RATIO: RangeInclusive<f64> = 1.0..=5000.0;
/// Maximum reflected rotor inertia, relative to the largest inertia moved by a joint.
const ROTOR: f64 = 10.0;
/// Maximum speed at which friction reaches its value, over the speed limit.
const SMOOTHING: f64 = 0.1;
/// Range of the sampling period of a servo (s).
const SAMPLE: RangeInclusive<f64> = 1e-6..=0.05;
/// Range of the gain of a position loop (1/s).
const GAIN: RangeInclusive<f64> = 0.1..=1000.0;
/// Range of the integral over the velocity gain (1/s).
const INTEGRAL: RangeInclusive<f64> = 0.01..=1000.0;
/// Range of the torque limit of a servo over the effort limit of its joint.
const LIMIT: RangeInclusive<f64> = 0.01..=30.0;
/// Minimum velocity gain over inertia (1/s): a slower speed loop does not follow a motion.
const FOLLOWS: f64 = 0.5;
/// Stability limit of a sampled velocity loop: velocity gain times sampling period divided by the
/// high-frequency inertia.
const STABLE: f64 = 2.0;

/// Returns all caveats about the drives as written.
pub(crate) fn of_drives(drives: &[Drive], mechanism: &Mechanism, rigid: &Model) -> Vec<Finding> {
    let mut caveats = Vec::new();
    let heaviest = inertia_moved(rigid);
    let heaviest = heaviest.iter().zip(rigid.coordinates());
    let armature = |joint: &str| drives.iter().find(|d| d.joint == joint).map_or(0.0, |d| d.armature);
    let heaviest = heaviest.map(|(inertia, c)| inertia - armature(&c.joint)).fold(0.0, f64::max);
    for drive in drives {
        let joint = mechanism.joint(&drive.joint);
        let slides = joint.is_some_and(|j| j.kind.slides());
        let effort = joint.map_or(f64::INFINITY, |j| j.limits.effort);
        let speed = joint.map_or(f64::INFINITY, |j| j.limits.velocity);
        caveats.extend(motor(drive, heaviest));
        caveats.extend(friction(drive, effort, speed));
        caveats.extend(smoothing(drive, speed));
        let per_cent = &[(100.0, "per cent")];
        let load = drive.load_friction;
        caveats.extend(outside(&kinds::LOAD_FRICTION, name(drive), load, &(0.0..=LOAD_FRICTION), per_cent, 1.0));
        caveats.extend(servo(drive, effort));
        caveats.extend(seat(drive));
        if !slides && drive.kind != DriveKind::Prescribed {
            caveats.extend(gear(drive, effort, others_turn(drive, drives, mechanism)));
            caveats.extend(errors(drive));
        }
    }
    caveats
}

fn name(drive: &Drive) -> String {
    format!("joint {:?}", drive.joint)
}

/// Returns the stiffness about the axis (N m/rad), and along translations (N/m) if there is one.
fn stiffness(drive: &Drive) -> Option<(f64, Option<f64>)> {
    match &drive.gearbox.as_ref()?.0.stiffness {
        GearStiffness::Axis(k) => Some((*k, None)),
        GearStiffness::Tilting(k) => Some((k.iter().copied().fold(f64::INFINITY, f64::min), None)),
        GearStiffness::Full(K) => {
            let least = |r: std::ops::Range<usize>| r.map(|i| K[(i, i)]).fold(f64::INFINITY, f64::min);
            Some((least(3..6), Some(least(0..3))))
        }
        GearStiffness::Separate(k) => {
            let least = |k: &[f64]| k.iter().copied().fold(f64::INFINITY, f64::min);
            Some((least(&k[3..]), Some(least(&k[..3]))))
        }
        GearStiffness::Guide(_) => None,
    }
}

/// Returns damping over stiffness of each spring of a gear (s).
fn relaxations(gear: &GearDamping, stiffness: &GearStiffness, least: f64) -> Vec<f64> {
    let springs = stiffness.each().unwrap_or_default();
    let dampers = gear.dampers.iter().flatten().enumerate();
    dampers.map(|(i, d)| d / springs.get(i).copied().unwrap_or(least)).collect()
}

/// Returns the median rotation of the other strong gears under their effort limits (rad); None for
/// a weak gear, or with fewer than two others.
fn others_turn(drive: &Drive, drives: &[Drive], mechanism: &Mechanism) -> Option<f64> {
    let turns = |drive: &Drive| {
        let joint = mechanism.joint(&drive.joint).filter(|j| !j.kind.slides())?;
        let effort = joint.limits.effort;
        (effort.is_finite() && effort > STRONG).then_some(effort / stiffness(drive)?.0)
    };
    turns(drive)?;
    let mut others: Vec<f64> = drives.iter().filter(|other| other.joint != drive.joint).filter_map(turns).collect();
    others.sort_by(f64::total_cmp);
    (others.len() >= 2).then(|| 0.5 * (others[others.len() / 2] + others[(others.len() - 1) / 2]))
}

/// Checks stiffness, damping and backlash of a gearbox; `others`: median rotation of the robot's
/// other gears (rad).
fn gear(drive: &Drive, effort: f64, others: Option<f64>) -> Vec<Finding> {
    let (Some((k, along)), Some((springs, gear))) = (stiffness(drive), &drive.gearbox) else { return Vec::new() };
    // Rotation under the effort limit: of all strong gears, and against the robot's other gears.
    let mut caveats = Vec::new();
    let turned = effort / k;
    let [unusual, wrong] = if effort > STRONG { TURNED } else { TURNED_WEAK };
    let sound = RIGID[0]..=unusual;
    let factors: Vec<slip::Factor> = slip::TURNING.iter().map(|(f, words)| (1.0 / f, *words)).collect();
    let likely = || slip(turned, &sound, &factors, 1.0);
    let questioned = effort.is_finite() && !gear.identified;
    if questioned && turned > unusual {
        let wrong = if others.is_some_and(|others| turned > MAX_ROTATION_RATIO * others) { unusual } else { wrong };
        let hinted = turned > wrong || (effort > STRONG && turned > HINTED * unusual);
        let caveat = kinds::GEAR_SOFT.found(name(drive), turned, unusual);
        let caveat = if hinted { caveat.likely(likely()) } else { caveat };
        caveats.push(if turned > wrong { caveat } else { caveat.as_note() });
    } else if questioned && turned < RIGID[0] {
        let caveat = kinds::GEAR_STIFF.found(name(drive), turned, RIGID[0]).likely(likely());
        caveats.push(if turned < RIGID[1] { caveat } else { caveat.as_note() });
    }
    // Translations of bearings against their rotations.
    if let Some(along) = along {
        let factors = &[(1e3, "translations in kN/m or N/mm"), (1.0 / 57.3, "rotations per degree")];
        caveats.extend(outside(&kinds::LEVER, name(drive), (k / along).sqrt(), &LEVER, factors, 0.5));
    }
    // Damping over stiffness: none, so much that it creeps, or almost none.
    if gear.dampers.as_ref().is_some_and(|dampers| dampers.iter().all(|damper| *damper == 0.0)) {
        caveats.push(kinds::NO_DAMPING.found(name(drive), 0.0, USUAL_DAMPING));
    }
    let relaxations = relaxations(gear, &springs.stiffness, k);
    let relaxation = relaxations.iter().copied().fold(0.0, f64::max);
    if relaxations.len() == 1 && relaxation > CREEP {
        caveats.push(kinds::CREEP.found(name(drive), relaxation, CREEP));
    }
    let least = relaxations.into_iter().filter(|time| *time > 0.0).fold(f64::INFINITY, f64::min);
    let factors = &[(1e-3, "kN m s/rad or per ms"), (1.0 / slip::DEGREES, "N m s/deg")];
    caveats.extend(outside(&kinds::GEAR_UNDAMPED, name(drive), least, &(UNDAMPED..=f64::INFINITY), factors, 1.0));
    // Backlash.
    let [play, _] = drive.play(false);
    if play > PLAY[0] {
        let likely = slip(play, &(0.0..=PLAY[0]), slip::ANGLE, 1.0);
        let caveat = kinds::BACKLASH.found(name(drive), play, PLAY[0]).likely(likely);
        caveats.push(if play > PLAY[1] { caveat } else { caveat.as_note() });
    }
    caveats
}

/// Checks transmission error and hysteresis.
fn errors(drive: &Drive) -> Vec<Finding> {
    let Some((_, gear)) = &drive.gearbox else { return Vec::new() };
    let mut caveats = Vec::new();
    let ripple = gear.transmission.iter().map(|harmonic| harmonic.amplitude).sum::<f64>();
    let words = &[(206_265.0, "arc seconds"), (3438.0, "arc minutes"), (slip::DEGREES, "degrees")];
    if ripple > TRANSMISSION_ERROR {
        let caveat = kinds::TRANSMISSION_ERROR.found(name(drive), ripple, TRANSMISSION_ERROR);
        caveats.push(caveat.likely(slip(ripple, &(1e-7..=TRANSMISSION_ERROR), words, 1.0)));
    }
    if let Some(law) = &gear.hysteresis {
        caveats.push(kinds::HYSTERESIS_LINEAR.found(name(drive), law.loss, law.loss));
        if law.loss > HYSTERESIS_LOSS {
            let caveat = kinds::HYSTERESIS_LOSS.found(name(drive), law.loss, HYSTERESIS_LOSS);
            caveats.push(caveat.likely(slip(law.loss, &(1e-6..=HYSTERESIS_LOSS), &words[1..], 1.0)));
        }
    }
    caveats
}

/// Checks ratio and rotor.
fn motor(drive: &Drive, heaviest: f64) -> Vec<Finding> {
    let mut caveats = Vec::new();
    let ratio = drive.ratio.abs();
    if !RATIO.contains(&ratio) {
        let end = if ratio < 1.0 { *RATIO.start() } else { *RATIO.end() };
        let inverted = if ratio < 1.0 && RATIO.contains(&(1.0 / ratio)) {
            "turns of the joint per turn of the motor?"
        } else {
            ""
        };
        caveats.push(kinds::RATIO.found(name(drive), ratio, end).likely(inverted));
    }
    if heaviest > 0.0 && drive.armature > ROTOR * heaviest {
        let caveat = kinds::ROTOR.found(name(drive), drive.armature, heaviest);
        caveats.push(caveat.likely(slip(drive.armature, &(0.0..=heaviest), slip::INERTIA, 1.0)));
    }
    caveats
}

/// Checks whether friction exceeds the effort limit.
fn friction(drive: &Drive, effort: f64, speed: f64) -> Option<Finding> {
    let f = &drive.friction;
    let viscous = if speed.is_finite() { f.viscous * speed } else { 0.0 };
    let torque = (f.coulomb + f.stribeck).max(viscous);
    let over = effort.is_finite() && torque > effort;
    over.then(|| {
        kinds::FRICTION.found(name(drive), torque, effort).likely(slip(
            torque,
            &(0.0..=0.3 * effort),
            slip::EFFORT,
            1.0,
        ))
    })
}

/// Checks whether friction acts well below the speed limit, and changes to its rest below it.
fn smoothing(drive: &Drive, speed: f64) -> Option<Finding> {
    let f = &drive.friction;
    let rubs = f.coulomb + f.stribeck + drive.load_friction > 0.0;
    let most = SMOOTHING * speed;
    let within = |name: String, value: f64, most: f64| {
        outside(&kinds::FRICTION_SMOOTHING, name, value, &(0.0..=most), &slip::ANGLE[..1], 1.0)
    };
    let stribeck = || within(format!("stribeck_velocity of {}", name(drive)), f.stribeck_velocity, speed);
    let smooth = rubs.then(|| within(name(drive), f.regularisation, most)).flatten();
    smooth.or_else(|| (f.stribeck > 0.0).then(stribeck).flatten())
}

/// Checks sampling, position gain and torque limit of a servo.
fn servo(drive: &Drive, effort: f64) -> Vec<Finding> {
    let mut caveats = Vec::new();
    if drive.kind != DriveKind::Torque {
        return caveats;
    }
    let (sample, gain) = (drive.servo.sample_s, drive.servo.position_gain.filter(|gain| *gain != 0.0));
    let late = &[(1e3, "milliseconds")];
    caveats.extend(sample.and_then(|s| outside(&kinds::SAMPLE, name(drive), s, &SAMPLE, late, 1.0)));
    caveats.extend(gain.and_then(|g| outside(&kinds::POSITION_GAIN, name(drive), g, &GAIN, &[], 1.0)));
    let limit = drive.torque_limit / effort;
    let what = format!("torque_limit of {} over its effort limit", name(drive));
    let limited = effort.is_finite() && drive.torque_limit.is_finite();
    caveats.extend(limited.then(|| outside(&kinds::UNUSUAL, what, limit, &LIMIT, slip::EFFORT, 1.0)).flatten());
    caveats
}

/// Checks whether a velocity gain makes the sampled loop unstable, or too slow to follow;
/// `inertia` is the high-frequency inertia (kg m²).
pub(crate) fn speed_loop(joint: &str, gain: f64, sample_s: f64, inertia: f64) -> Option<Finding> {
    let range = FOLLOWS * inertia..=STABLE * inertia / sample_s;
    let name = || format!("joint {joint:?}");
    let judge = || outside(&kinds::VELOCITY_GAIN, name(), gain, &range, &[(1e-3, "kN m s/rad")], 1.0);
    (inertia > 0.0 && gain != 0.0).then(judge).flatten()
}

/// Checks whether springs before and after the joint turn the same link about the same axes.
pub(crate) fn seat(drive: &Drive) -> Option<Finding> {
    let (gearbox, _) = drive.gearbox.as_ref()?;
    let several = !matches!(gearbox.stiffness, GearStiffness::Axis(_));
    (gearbox.seat.is_some() && several).then(|| kinds::SEAT_INERTIA.found(name(drive), 0.0, 0.0))
}

/// Checks the integral over the velocity gain of a servo (1/s).
pub(crate) fn integral(joint: &str, rate: f64) -> Option<Finding> {
    let what = format!("the integral over the velocity gain of joint {joint:?}");
    let factors = &[(1e-3, "kN m/rad or 1/ms"), (1e3, "N mm/rad")];
    let judge = || outside(&kinds::UNUSUAL.with_unit("1/s"), what, rate, &INTEGRAL, factors, 1.0);
    (rate > 0.0 && rate.is_finite()).then(judge).flatten()
}

/// Checks the deflection of a drive's spring, in rotation (rad) and translation (m); `times` scales
/// the limits: 1 under gravity, 2 in motion.
pub(crate) fn give(drive: &Drive, effort: f64, rotation: f64, translation: f64, times: f64) -> Vec<Finding> {
    let [unusual, wrong] = SAGS[usize::from(effort <= STRONG)].map(|limit| times * limit);
    let mut caveats = Vec::new();
    // Weak drives may deflect in motion by design.
    let judged = effort > STRONG || times <= 1.0;
    if judged && rotation > unusual {
        let caveat = kinds::GEAR_ROTATION.found(name(drive), rotation, unusual);
        let likely =
            slip(rotation, &(1e-5..=unusual), &[(57.3, "stiffness in N m/deg"), (1e3, "stiffness in kN m/rad")], 1.0);
        caveats.push(if rotation > wrong { caveat.likely(likely) } else { caveat.as_note() });
    }
    if translation > times * BEARING {
        let likely = slip(translation, &(1e-7..=BEARING), &[(1e3, "stiffness in kN/m or N/mm")], 1.0);
        caveats.push(kinds::BEARING.found(name(drive), translation, times * BEARING).likely(likely));
    }
    caveats
}
