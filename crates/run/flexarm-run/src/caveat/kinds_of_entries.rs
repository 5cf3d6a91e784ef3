//! Catalogue of caveats about strengths, gauges, guides and calibrations; part of [`super::kinds`].
//!
//! Words only, one constant per kind: code, message, unit, help. Not here: thresholds and rules (the
//! other files of this folder), kinds of use (`kinds_of_use.rs`).

use super::FindingKind;

/// A number is outside the range of usual ones.
pub const UNUSUAL: FindingKind = FindingKind::warning(
    "unusual",
    "{where} is {value} {unit}, usual values end at {yardstick}",
    "",
    "check the number and its unit (`flexarm format` lists the units of every key)",
);
/// A strength is outside that of materials.
pub(crate) const STRENGTH: FindingKind = FindingKind::warning(
    "strength",
    "{where} is {value} Pa, materials end at {yardstick}",
    "Pa",
    "strengths are in Pa: S355 has 355e6",
);
/// A fatigue strength does not match the tensile strength.
pub(crate) const FATIGUE_STRENGTH: FindingKind = FindingKind::warning(
    "fatigue-strength",
    "{where} is {value} times the tensile strength, metals have 0.3 to 0.6 (limit {yardstick})",
    "",
    "fatigue is the amplitude in Pa of a reversed stress that 1e6 cycles bear",
);
/// The grids of a rosette are almost parallel.
pub(crate) const GAUGE_ANGLE: FindingKind = FindingKind::warning(
    "gauge-angle",
    "{where} has its grid at {value} degrees, grids of rosettes are apart by more than {yardstick}",
    "deg",
    "angles_deg is in degrees: 0, 45, 90",
);
/// A gauge is not on its beam.
pub(crate) const GAUGE_PLACE: FindingKind = FindingKind::warning(
    "gauge-place",
    "{where} is {value} m from the axis of its beam, the surface ends at {yardstick} m",
    "m",
    "at is in m, in the axes of the link: strain is taken at the nearest point of the surface",
);
/// The end of a guide's tube is out of reach.
pub(crate) const GUIDE_END: FindingKind = FindingKind::warning(
    "guide-end",
    "{where} is {value} m away, the whole arm reaches {yardstick} m",
    "m",
    "ends of tubes are in m along the axis of the joint",
);
/// The compliance of a guide does not suit the robot.
pub(crate) const GUIDE_TILT: FindingKind = FindingKind::warning(
    "guide-tilt",
    "the {where} gives {value} rad under the weight of the robot at its reach, guides end at {yardstick}",
    "rad",
    "[c0, c1, c2] in rad/(N m), rad/N and rad m/N",
);
/// The play of a guide does not suit the robot.
pub(crate) const GUIDE_PLAY: FindingKind = FindingKind::warning(
    "guide-play",
    "{where} is {value} N m, by the weight of the robot at its reach it ends at {yardstick}",
    "N m",
    "width and centre of the play are moments in N m",
);
/// A calibration is too large for one.
pub(crate) const CALIBRATION: FindingKind = FindingKind::warning(
    "calibration",
    "{where} is {value} rad or m, calibrations are below {yardstick}",
    "rad or m",
    "zero and rpy are in rad, xyz is in m; other joint frames belong into the URDF",
);
/// The gear is hardly damped.
pub(crate) const GEAR_UNDAMPED: FindingKind = FindingKind::warning(
    "gear-damping",
    "the damping of {where} over its stiffness is {value} s, gears have more than {yardstick}: vibrations hardly decay",
    "s",
    "damping is in N m s/rad on the joint's side; identified gears have 0.1 to 7 ms times their stiffness",
);
/// Friction is smoothed over most speeds of the joint.
pub(crate) const FRICTION_SMOOTHING: FindingKind = FindingKind::warning(
    "friction-smoothing",
    "friction of {where} reaches its value at {value} rad/s only, it should at {yardstick} by the speed limit",
    "rad/s",
    "regularisation is the speed in rad/s at which friction has three quarters of its value: 0.01",
);
/// The springs of a mounting are as good as rigid.
pub(crate) const MOUNTING_RIGID: FindingKind = FindingKind::warning(
    "mounting-stiff",
    "{where} deflects by {value} m under the weight of the robot, usual springs by more than {yardstick}",
    "m",
    "stiffness is in N/m and N m/rad; leave the mounting out if it is rigid",
);
/// The rotary inertia of a section does not match its stiffness.
pub(crate) const ROTARY: FindingKind = FindingKind::warning(
    "section",
    "the rotary inertia of the section of {where} has a radius of gyration of {value} m, its stiffness one of {yardstick} m",
    "m",
    "rotary_y and rotary_z are rho I in kg m",
);
/// Springs before and after a joint have no inertia between them.
pub(crate) const SEAT_INERTIA: FindingKind = FindingKind::warning(
    "seat-inertia",
    "{where}: its seat and its three stiffnesses turn the same link about the same axes with no inertia between them: \
     only statics and identify can use it",
    "",
    "give the stiffness about the axis alone",
);
