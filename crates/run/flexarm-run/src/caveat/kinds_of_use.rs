//! Catalogue of caveats about motions, loads, balancers and closed loops; part of [`super::kinds`].
//!
//! Words only, one constant per kind: code, message, unit, help. Not here: thresholds and rules (the
//! other files of this folder), kinds of entries (`kinds_of_entries.rs`).

use super::FindingKind;

/// A joint exceeds its effort limit along a motion.
pub(crate) const MOTION_EFFORT: FindingKind = FindingKind::warning(
    "motion-effort",
    "{where} needs up to {value} {unit} along the motion, its limit is {yardstick}",
    "N m",
    "slow the motion down; check masses, payload, unit and time of the motion",
);
/// A balancer is far stronger than the weight of the arm.
pub(crate) const BALANCER_STRONG: FindingKind = FindingKind::warning(
    "balancer-strong",
    "{where} puts up to {value} {unit} on a joint, more than three times the gravity torque of the arm ({yardstick} {unit})",
    "N m",
    "a balancer carries about the weight of the arm: check rate, pressure, area and ends (N/m, Pa, m2, m)",
);
/// A balancer is negligibly weak.
pub(crate) const BALANCER_WEAK: FindingKind = FindingKind::warning(
    "balancer-weak",
    "{where} puts at most {value} {unit} on a joint, less than a thousandth of the gravity torque of the arm ({yardstick} {unit})",
    "N m",
    "check its ends and its force: units are m, N/m and Pa",
);
/// A gas balancer exceeds its stroke in part of the joint ranges.
pub(crate) const BALANCER_ROOM: FindingKind = FindingKind::warning(
    "balancer-room",
    "{where} gets {value} m long within the joint ranges, its gas has room up to {yardstick} m: poses beyond are refused",
    "m",
    "check ends, volume, area and the length to which they belong, or the joint ranges",
);
/// A force curve does not cover the joint ranges.
pub(crate) const BALANCER_CURVE: FindingKind = FindingKind::note(
    "balancer-curve",
    "{where} is at {value} within the joint ranges, its curve ends at {yardstick}: it goes straight on from there",
    "",
    "add points, in m or rad",
);
/// A loop is assembled away from the given joint values.
pub(crate) const LOOP_ASSEMBLED: FindingKind = FindingKind::warning(
    "loop-assembled",
    "{where} closes with its dependent joints {value} rad or m from the given assembly (reported above {yardstick})",
    "rad or m",
    "check the points of pin and eye and the lengths of the bars, or give the values in at",
);
/// A loop does not close in some poses within the joint ranges.
pub(crate) const LOOP_RANGE: FindingKind = FindingKind::warning(
    "loop-range",
    "{where} does not close in {value} % of the poses within the ranges of the driving joints (reported above {yardstick} %): such poses are refused",
    "%",
    "limits of the driving joints hold for each joint separately; check the lengths of the bars",
);
/// The transmission angle is small within the joint ranges.
pub(crate) const LOOP_REACH: FindingKind = FindingKind::warning(
    "loop-transmission",
    "{where} has transmission angles down to {value} deg within the joint ranges (reported below {yardstick})",
    "deg",
    "limits of the dependent joints keep poses out that the machine does not reach",
);
/// The transmission angle is small along a motion.
pub(crate) const LOOP_TRANSMISSION: FindingKind = FindingKind::warning(
    "loop-transmission",
    "{where} reaches a transmission angle of {value} deg along the motion (reported below {yardstick}): forces in its bars grow as 1/sin of it",
    "deg",
    "keep the motion away from the dead point, where the bars are collinear",
);
/// A dependent joint exceeds its limit.
pub(crate) const LOOP_LIMIT: FindingKind = FindingKind::warning(
    "loop-limit",
    "{where}, which follows from a loop, reaches {value} along the motion, its limit is {yardstick}",
    "",
    "keep the driving joints nearer to each other, or correct the limit of the URDF",
);
/// A motion is much slower than the robot.
pub(crate) const SLOW_MOTION: FindingKind = FindingKind::note(
    "slow-motion",
    "{where} never uses more than {value} of a joint's speed limit (reported below {yardstick})",
    "",
    "times are in s",
);
/// A motion hardly moves the joints.
pub(crate) const SMALL_MOTION: FindingKind = FindingKind::note(
    "small-motion",
    "{where} turns no joint by more than {value} rad (reported below {yardstick})",
    "rad",
    "is the unit of the angles right?",
);
/// A force is large relative to the weight of the arm.
pub(crate) const LOAD: FindingKind = FindingKind::warning(
    "load",
    "{where} is {value} N, the arm with its payload weighs {yardstick} N on earth",
    "N",
    "forces are in N, moments in N m",
);
/// A moment is large relative to the weight of the arm at full length.
pub(crate) const MOMENT: FindingKind = FindingKind::warning(
    "load",
    "{where} is {value} N m; the weight of the arm makes {yardstick} N m at its full length",
    "N m",
    "forces are in N, moments in N m",
);
/// The log rate exceeds the number of steps per second.
pub(crate) const LOG_RATE: FindingKind = FindingKind::warning(
    "log-rate",
    "{value} samples a second are requested, but there are {yardstick} steps a second: every step is logged",
    "1/s",
    "lower the step or the log rate",
);
/// A load continues long after the end of the run.
pub(crate) const LOAD_TIME: FindingKind = FindingKind::warning(
    "load-time",
    "{where} lasts until {value} s; the run ends at {yardstick} s",
    "s",
    "times of loads are in s",
);
/// The argument of a sine is probably in degrees.
pub(crate) const LOAD_DEGREES: FindingKind = FindingKind::warning(
    "load-degrees",
    "{where} swings with {value} Hz, with degrees it would be {yardstick} Hz",
    "Hz",
    "angles of sin and cos are in rad: write 2*pi*3*t",
);
/// A balancer increases the joint's holding torque.
pub(crate) const BALANCER_SIDE: FindingKind = FindingKind::warning(
    "balancer-side",
    "{where}: with it the joint that it acts on needs {value} {unit} over the joint ranges (RMS), without it {yardstick} {unit}",
    "N m",
    "a balancer takes weight off the motor: check on which side of the joint its ends are, and its sense",
);

/// The arm rests for most of its motion.
pub(crate) const LONG_REST: FindingKind = FindingKind::note(
    "long-rest",
    "{where} rests for {value} s, more than ten times the {yardstick} s in which it moves",
    "s",
    "times of holds and dwells are in s",
);
/// All joints are slow.
pub(crate) const SLOW_JOINTS: FindingKind = FindingKind::note(
    "speed-limit",
    "{where} turns with at most {value} rad/s, those of arms of this size with more than {yardstick}",
    "rad/s",
    "limits of a URDF are in rad and rad/s",
);
/// The range of a joint is small.
pub(crate) const NARROW_RANGE: FindingKind = FindingKind::warning(
    "joint-range",
    "{where} has a range of {value} rad, joints of arms have more than {yardstick}",
    "rad",
    "limits of a URDF are in rad and rad/s",
);
