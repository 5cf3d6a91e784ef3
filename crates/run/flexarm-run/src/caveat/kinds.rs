//! Catalogue of caveats: code, message, unit and help. `docs/caveats.md` gives the source of each
//! threshold.
//!
//! In a message `{value}` is what was found and `{yardstick}` what it is compared with; names in
//! braces such as `{step_s}` are settings, which each interface names in its own terms. Not here:
//! thresholds and the rules that use them (the other files of this folder).

use super::FindingKind;
pub(crate) use super::kinds_of_entries::*;
pub(crate) use super::kinds_of_use::*;

/// The far end of a flexible link rotates beyond small rotations.
pub(crate) const LARGE_DEFORMATION: FindingKind = FindingKind::warning(
    "large-deformation",
    "{where} deflects by {value} rad; the linear elastic model holds up to {yardstick} rad",
    "rad",
    "the model is linear elastic: check stiffness, loads and units",
);
/// The distance between the interfaces of a flexible link changes too much.
pub(crate) const LARGE_STRAIN: FindingKind = FindingKind::warning(
    "large-strain",
    "{where} changes its length by {value} of it, beyond {yardstick}: check stiffness and loads",
    "",
    "metals yield at 1e-3 to 5e-3: check stiffness, loads and units",
);
/// Centrifugal forces stiffen a modal link whose model leaves them out.
pub(crate) const FAST_SPIN: FindingKind = FindingKind::warning(
    "fast-spin",
    "{where} turns so fast that centrifugal forces change its stiffness by about {value} %; its modal model leaves them \
     out (limit {yardstick} %)",
    "%",
    "set geometric_stiffening = true on the link, or model = \"lumped\" with more segments",
);
/// The stress of a link exceeds the strength of its material.
pub(crate) const STRESS: FindingKind = FindingKind::warning(
    "stress",
    "{where} bears {value} MPa, the strength of its material is {yardstick} MPa",
    "MPa",
    "check payload and motion, the strength of the real material, and the mesh at this place",
);
/// The stepper does not give accelerations.
pub(crate) const NO_STRESS: FindingKind = FindingKind::note(
    "no-stress",
    "{where} gives no accelerations: the stress of the links is not computed",
    "",
    "use another stepper for the stress",
);
/// A beam with modes has no section forces.
pub(crate) const NO_STRESS_OF_MODES: FindingKind = FindingKind::note(
    "no-stress",
    "{where} is a beam with modes: its stress is not computed",
    "",
    "use model = \"lumped\" for the stress, with more segments if its own vibration matters",
);
/// A drive needs more than its effort limit during a run.
pub const EFFORT: FindingKind = FindingKind::warning(
    "effort",
    "{where} needs {value} {unit}, its limit is {yardstick}: the real drive would not follow",
    "N m",
    "check masses, payload, loads and the effort limit of the URDF",
);
/// A drive needs more than its effort limit to hold a pose.
pub(crate) const HOLDING: FindingKind = FindingKind::warning(
    "effort",
    "{where} needs {value} {unit} to hold the pose, its limit is {yardstick}",
    "N m",
    "check masses, payload, loads and the effort limit of the URDF",
);
/// A servo is at its torque limit.
pub(crate) const SERVO_LIMIT: FindingKind = FindingKind::warning(
    "servo-limit",
    "the servo of {where} is at its torque limit in {value} % of the samples: it cannot follow, or its loop is unstable \
     (gains too high for the inertia and sampling; is motor_inertia given?)",
    "%",
    "check gains, sampling, torque limit and motor inertia",
);
/// The sample rate is low for the first natural frequency.
pub const FEW_SAMPLES: FindingKind = FindingKind::warning(
    "few-samples",
    "{value} logged samples a second are few for a first frequency of {yardstick} Hz: peaks between them are missed; raise \
     {log_rate_hz} or lower {step_s}",
    "1/s",
    "ten samples per period show its peak to 5 %",
);
/// The step size is large for the first mode.
pub(crate) const COARSE_STEP: FindingKind = FindingKind::warning(
    "coarse-step",
    "a swing of the first mode comes out {value} % off within one period, as the steps are long for this method: lower {step_s} \
     or choose another {stepper}",
    "%",
    "compare with half the step",
);
/// Joints drift apart in maximal coordinates.
pub(crate) const JOINT_DRIFT: FindingKind = FindingKind::warning(
    "joint-drift",
    "constraint drift in {where}: {value} % of the peak TCP error is drift of the joints and no deflection: lower {step_s}",
    "%",
    "the drift falls with the square of the step",
);
/// The settling band is probably given in other units.
pub(crate) const WIDE_BAND: FindingKind = FindingKind::warning(
    "wide-band",
    "the settling band of {value} m is wide for a robot: give {settling_band_m} in m",
    "m",
    "robots are specified to settle within 0.01 to 1 mm",
);
/// The settling band is wider than the error.
pub(crate) const BAND_BEYOND_ERROR: FindingKind = FindingKind::warning(
    "band-beyond-error",
    "the settling band of {value} m is wider than the peak TCP error of {yardstick} m: the tool counts as settled at all times; \
     narrow {settling_band_m}",
    "m",
    "a tenth of the error shows when the ringing is over",
);
/// The step size is large for the motion.
pub(crate) const LONG_STEP: FindingKind = FindingKind::warning(
    "long-step",
    "the step of the {where} is {value} s, a fiftieth of its longest move is {yardstick} s: lower {step_s}",
    "s",
    "the step is in s: 1 ms is 0.001",
);
/// The energy balance does not close.
pub(crate) const ENERGY_OPEN: FindingKind = FindingKind::warning(
    "energy-open",
    "the energy balance is open by {value} % of the energy in it: the samples are too far apart ({log_rate_hz}), the step too \
     coarse ({step_s}), or the stepper has numerical damping",
    "%",
    "halve the step and compare",
);
/// A mode in a response has no damping.
pub(crate) const UNDAMPED: FindingKind = FindingKind::warning(
    "undamped",
    "{where} has no damping: the height of its peak means nothing",
    "",
    "give the springs damping",
);
/// The forces on the deflections change while the arm turns at constant speed.
pub(crate) const UNSTEADY_ROTATION: FindingKind = FindingKind::warning(
    "unsteady-rotation",
    "{where} is not steady: the forces on the deflections change by {value} % while it turns by one radian (limit \
     {yardstick} %), by weight or by other joints; the modes are those of an instant",
    "%",
    "turn one joint about a vertical axis, or set gravity to zero, for modes that last",
);
/// The links of a turning arm have too few modes.
pub(crate) const FEW_MODES: FindingKind = FindingKind::warning(
    "few-modes",
    "{where} is off by about {value} %, because the links have few modes: the speed couples them (limit {yardstick} %)",
    "%",
    "give the links more modes: modes = 32 on the link",
);
/// A joint is outside its limits at a pose.
pub(crate) const OUTSIDE_LIMITS: FindingKind = FindingKind::warning(
    "outside-limits",
    "{where} at {value} {unit} is outside its limits",
    "rad",
    "choose a pose that the robot can take",
);
/// A joint without limits is turned several revolutions.
pub(crate) const MANY_TURNS: FindingKind = FindingKind::warning(
    "many-turns",
    "{where} at {value} rad is turned further than twice around ({yardstick} rad)",
    "rad",
    "give the pose in rad",
);

// The robot's files.

/// An angle exceeds one turn.
pub(crate) const ANGLE: FindingKind = FindingKind::warning(
    "angle",
    "{where} has an angle of {value} rad, more than a turn ({yardstick} rad)",
    "rad",
    "angles of robot files are in rad: write 90 degrees as 1.5707963",
);
/// The TCP or payload is out of reach.
pub(crate) const FAR: FindingKind = FindingKind::warning(
    "far",
    "{where} is {value} m away from its link, the whole arm reaches {yardstick} m",
    "m",
    "lengths are in m",
);
/// A joint is far from its parent.
pub(crate) const JOINT_DISTANCE: FindingKind = FindingKind::warning(
    "joint-distance",
    "{where} is {value} m away from its parent, all other joints together {yardstick} m",
    "m",
    "lengths of a URDF are in m",
);
/// The arm is larger than any real one.
pub(crate) const SIZE: FindingKind = FindingKind::warning(
    "size",
    "{where} reaches {value} m; the largest arms built reach less than {yardstick} m",
    "m",
    "lengths of a URDF are in m",
);
/// A radius of gyration exceeds the size of the arm.
pub(crate) const INERTIA: FindingKind = FindingKind::warning(
    "inertia",
    "{where} has a radius of gyration of {value} m; all mass of the arm is within {yardstick} m",
    "m",
    "check mass (kg), inertia (kg m2) and lengths (m) of the URDF",
);
/// A link is denser than the densest metal.
pub(crate) const DENSITY: FindingKind = FindingKind::warning(
    "density",
    "{where} has at least {value} kg/m3 by its mass and inertia, osmium has {yardstick}",
    "kg/m3",
    "check mass (kg) and inertia (kg m2)",
);
/// The mounting is soft in translation.
pub(crate) const MOUNTING_SINK: FindingKind = FindingKind::warning(
    "mounting-soft",
    "{where} deflects by {value} m under the weight of the robot, a pedestal by less than {yardstick} m",
    "m",
    "stiffness is in N/m along and N m/rad about the axes",
);
/// The mounting is soft in rotation.
pub(crate) const MOUNTING_TILT: FindingKind = FindingKind::warning(
    "mounting-soft",
    "{where} tilts by {value} rad under the weight of the robot at a lever of 1 m, a pedestal by less than {yardstick} rad",
    "rad",
    "stiffness is in N/m along and N m/rad about the axes",
);
/// Linear results are requested for a robot with hysteresis.
pub(crate) const HYSTERESIS_LINEAR: FindingKind = FindingKind::note(
    "hysteresis-linear",
    "{where} has hysteresis of {value} rad: statics use the curve of first loading, from which the deflection after a motion may differ by half of that; frequencies, responses and compliance are those of motions without slip",
    "rad",
    "run a motion that comes to the pose as the robot does",
);
/// The hysteresis loss is implausibly large.
pub(crate) const HYSTERESIS_LOSS: FindingKind = FindingKind::warning(
    "hysteresis-loss",
    "{where} has a hysteresis loss of {value} rad, gears of robots less than {yardstick} rad",
    "rad",
    "catalogues give 1 arcmin, which is 2.9e-4 rad: write loss_arcmin",
);
/// The transmission error is implausibly large.
pub(crate) const TRANSMISSION_ERROR: FindingKind = FindingKind::warning(
    "transmission-error",
    "{where} has a transmission error of {value} rad, gears of robots less than {yardstick} rad",
    "rad",
    "catalogues give arc seconds, one of which is 4.8e-6 rad: write amplitude_arcsec",
);
/// The gear ripple has few steps per period.
pub(crate) const RIPPLE_STEP: FindingKind = FindingKind::warning(
    "ripple-step",
    "the ripple of the gear of {where} has {value} steps a period at the maximum speed, less than {yardstick}: lower {step_s}",
    "",
    "a stepper of second order needs a dozen steps in a period for the right amplitude",
);
/// The load-dependent friction is implausibly large.
pub(crate) const LOAD_FRICTION: FindingKind = FindingKind::warning(
    "load-friction",
    "{where} loses {value} of the transmitted torque to friction, gears of robots less than {yardstick}",
    "",
    "load is a ratio: 5 per cent is 0.05",
);
/// Gravity differs from that on earth.
pub(crate) const GRAVITY: FindingKind = FindingKind::warning(
    "gravity",
    "{where} is {value} m/s2, on earth it is {yardstick}",
    "m/s2",
    "gravity is in m/s2, in the axes of the base",
);
/// The payload is heavy relative to the robot.
pub(crate) const PAYLOAD_MASS: FindingKind = FindingKind::warning(
    "payload-mass",
    "{where} weighs {value} kg, the robot itself {yardstick} kg",
    "kg",
    "masses are in kg; robots carry less than they weigh",
);
/// A heavy payload is a point mass.
pub(crate) const POINT_PAYLOAD: FindingKind = FindingKind::note(
    "point-payload",
    "{where} of {value} kg is a point: it has no inertia of its own (reported above {yardstick} kg)",
    "kg",
    "give inertia about its centre of mass if the tool turns fast",
);
/// The principal moments violate the triangle inequality.
pub(crate) const TRIANGLE: FindingKind = FindingKind::warning(
    "impossible-inertia",
    "{where} has a principal moment of {value} kg m2, more than the other two together ({yardstick}): no body has that",
    "kg m2",
    "the order is ixx iyy izz ixy ixz iyz, about the centre of mass",
);
/// The payload's radius of gyration exceeds the reach of the arm.
pub(crate) const PAYLOAD_INERTIA: FindingKind = FindingKind::warning(
    "payload-inertia",
    "{where} has a radius of gyration of {value} m, the whole arm reaches {yardstick} m",
    "m",
    "inertia is in kg m2, about the centre of mass",
);
/// The speed limit is implausibly high.
pub(crate) const SPEED_LIMIT: FindingKind = FindingKind::warning(
    "speed-limit",
    "{where} has a speed limit of {value} rad/s, joints of robots turn with less than {yardstick}",
    "rad/s",
    "limits of a URDF are in rad and rad/s",
);
/// The joint range covers several turns.
pub(crate) const JOINT_RANGE: FindingKind = FindingKind::warning(
    "joint-range",
    "{where} has a limit at {value} rad, more than two turns ({yardstick} rad)",
    "rad",
    "limits of a URDF are in rad and rad/s",
);
/// The effort limit is far above the gravity load.
pub(crate) const EFFORT_LIMIT: FindingKind = FindingKind::warning(
    "effort-limit",
    "{where} has an effort limit of {value} {unit}; gravity loads it with up to {yardstick} {unit}",
    "N m",
    "limits of a URDF are in N m and N; too small a mass has the same effect",
);
/// The effort limit is far above the inertial load.
pub(crate) const TIP_ACCELERATION: FindingKind = FindingKind::warning(
    "effort-limit",
    "the effort limit of {where} would accelerate the tip by {value} m/s2 (at most {yardstick} are plausible)",
    "m/s2",
    "limits of a URDF are in N m and N; too small a mass has the same effect",
);

/// No joint moves the TCP.
pub(crate) const TCP_FIXED: FindingKind = FindingKind::warning(
    "tcp-link",
    "{where}: {value} of {yardstick} joints move it",
    "",
    "the TCP is on the last link of the arm, such as tool0 or flange",
);
/// The arm continues beyond the TCP.
pub(crate) const TCP_INSIDE: FindingKind = FindingKind::warning(
    "tcp-link",
    "{where}: the arm continues {value} m beyond it, of {yardstick} m in all",
    "m",
    "the TCP is on the last link of the arm, such as tool0 or flange",
);
/// No joint moves the payload.
pub(crate) const PAYLOAD_FIXED: FindingKind = FindingKind::warning(
    "payload-link",
    "{where}: {value} of {yardstick} joints move it",
    "",
    "the payload is on the link of the TCP, where it is without link",
);
/// The arm continues beyond the payload.
pub(crate) const PAYLOAD_INSIDE: FindingKind = FindingKind::warning(
    "payload-link",
    "{where}: the arm continues {value} m beyond it, of {yardstick} m in all",
    "m",
    "the payload is on the link of the TCP, where it is without link",
);

// Flexible links.

/// The stiffness given for a link differs from that of its source.
pub(crate) const LINK_STIFFNESS: FindingKind = FindingKind::warning(
    "link-stiffness",
    "the stiffness given for {where} is {value} times that of its beam or .flex file in one direction, measured links stay within {yardstick} times",
    "",
    "stiffness is the 6x6 of the spring between the two parts, at the split and in link axes (N/m, N, N m/rad): see docs/robot-file.md",
);
/// The stiffness given for a link has no coupling terms.
pub(crate) const LINK_COUPLING: FindingKind = FindingKind::warning(
    "link-stiffness",
    "the stiffness given for {where} has no coupling terms, its beam or .flex file has some of {value} of the diagonal (reported above {yardstick})",
    "",
    "give all 36 numbers of the spring between the two parts, at the split and in link axes: see docs/robot-file.md",
);
/// The speed of sound along a link, from stiffness and mass, is implausible.
pub(crate) const LINK_SOUND: FindingKind = FindingKind::warning(
    "link-stiffness",
    "stiffness and mass of {where} give a wave speed of {value} m/s along it; links of robots have 300 to 6000 m/s (reported beyond {yardstick})",
    "m/s",
    "no material is stiffer for its mass: check units of stiffness (N/m, N m/rad) and mass (kg)",
);
/// The wall is thin.
pub(crate) const WALL: FindingKind = FindingKind::warning(
    "wall",
    "the wall of {where} is {value} of its width, walls of arms are more than {yardstick}",
    "",
    "thinner walls buckle before they carry any load; wall is in m",
);
/// The outer size of a section does not match the inertia of the link.
pub(crate) const SECTION_SIZE: FindingKind = FindingKind::warning(
    "section-size",
    "the section of {where} has a radius of gyration of {value} m about the beam, the link's own inertia has {yardstick} m",
    "m",
    "outer_diameter, width and height are outer sizes, not radii or halves",
);
/// A link has no damping.
pub(crate) const NO_DAMPING: FindingKind = FindingKind::warning(
    "no-damping",
    "{where} has a damping of {value}: vibrations do not decay (jointed structures have {yardstick} of critical)",
    "",
    "leave damping out for 3 per cent",
);

/// Young's modulus is implausibly large.
pub(crate) const MODULUS: FindingKind = FindingKind::warning(
    "modulus",
    "{where} has a Young's modulus of {value} Pa, solids end at {yardstick}",
    "Pa",
    "E is in Pa: steel has 210e9, aluminium 70e9",
);
/// The density of a material is implausibly large.
pub(crate) const MATERIAL_DENSITY: FindingKind = FindingKind::warning(
    "material-density",
    "{where} has a material of {value} kg/m3, solids end at {yardstick}",
    "kg/m3",
    "rho is in kg/m3: steel has 7850, aluminium 2700",
);
/// Poisson's ratio is implausible.
pub(crate) const POISSON: FindingKind = FindingKind::warning(
    "poisson",
    "{where} has a Poisson's ratio of {value}, structural materials end at {yardstick}",
    "",
    "metals have 0.26 to 0.35; 0.5 is a liquid, less than 0 a foam that thickens when pulled",
);
/// The section is thick relative to the beam's length.
pub(crate) const SECTION: FindingKind = FindingKind::warning(
    "section",
    "the section of {where} is {value} m thick, its beam {yardstick} m long",
    "m",
    "sections are in m",
);
/// The radius of gyration of a section is too large for the beam.
pub(crate) const SECTION_RADIUS: FindingKind = FindingKind::warning(
    "section",
    "the section of {where} has a radius of gyration sqrt(EI/EA) of {value} m, beams of its length end at {yardstick}",
    "m",
    "EA is in N, EI in N m2",
);
/// The torsional stiffness is large relative to the bending stiffness.
pub(crate) const TORSION: FindingKind = FindingKind::warning(
    "torsion",
    "the section of {where} has GJ/EI = {value}, sections end at {yardstick}",
    "",
    "GJ and EI are in N m2",
);
/// The shear centre of a channel is far from its centroid.
pub(crate) const SHEAR_CENTRE: FindingKind = FindingKind::warning(
    "shear-centre",
    "the shear centre of {where} is {value} m from its centroid: a side force through the centroid twists it by more than 1 % of its bending (limit {yardstick} m), which the beam model leaves out",
    "m",
    "beams bend and twist about the centroid: reduce a mesh of the link, or bend the section in the plane of its flanges only",
);
/// The mass of the link differs from that of the beam.
pub(crate) const BEAM_MASS: FindingKind = FindingKind::warning(
    "beam-mass",
    "{where} weighs {value} kg, its beam would weigh {yardstick} kg",
    "kg",
    "check the mass of the URDF, section and density",
);
/// The modal damping ratio is implausibly large.
pub(crate) const DAMPING_RATIO: FindingKind = FindingKind::warning(
    "damping-ratio",
    "{where} has a damping ratio of {value}, jointed structures have less than {yardstick}",
    "",
    "3 per cent is 0.03",
);
/// The ratio of damping to stiffness is implausibly large.
pub(crate) const CREEP: FindingKind = FindingKind::warning(
    "creep",
    "the damping of {where} over its stiffness is {value} s, springs of robots have less than {yardstick}: it creeps instead \
     of swinging",
    "s",
    "D = beta K with beta of some ms; gear damping in N m s/rad",
);

// Drives.

/// The gear is implausibly soft.
pub(crate) const GEAR_SOFT: FindingKind = FindingKind::warning(
    "gear-stiffness",
    "the gearbox of {where} deflects by {value} rad under its effort limit, usual gearboxes by less than {yardstick}",
    "rad",
    "stiffness is in N m/rad on the joint's side; published gears turn by 1e-3 (rated) to 1e-2 rad (peak)",
);
/// The gear is implausibly stiff.
pub(crate) const GEAR_STIFF: FindingKind = FindingKind::warning(
    "gear-stiffness",
    "the gearbox of {where} turns by {value} rad under its effort limit, such drives by more than {yardstick}",
    "rad",
    "stiffness is in N m/rad on the joint's side; published gears turn by 1e-3 (rated) to 1e-2 rad (peak)",
);
/// The ratio of rotational to translational stiffness is implausible.
pub(crate) const LEVER: FindingKind = FindingKind::warning(
    "gear-lever",
    "rotations over translations in the stiffness of {where} make a lever of {value} m, bearings end at {yardstick}",
    "m",
    "three translations in N/m, then three rotations in N m/rad",
);
/// The backlash is implausibly large.
pub(crate) const BACKLASH: FindingKind = FindingKind::warning(
    "backlash",
    "{where} has a play of {value} rad to each side, gears of robots have less than {yardstick}",
    "rad",
    "reducers have 1 to 30 arc minutes, 3e-4 to 9e-3 rad",
);
/// The gear ratio is implausibly large.
pub(crate) const RATIO: FindingKind = FindingKind::warning(
    "ratio",
    "the motor of {where} turns {value} times per turn of the joint, gears of robots end at {yardstick}",
    "",
    "ratio is the motor's turns per turn of the joint",
);
/// The rotor inertia is implausibly large.
pub(crate) const ROTOR: FindingKind = FindingKind::warning(
    "rotor",
    "the rotor of {where} has {value} kg m2 on the joint's side; no joint moves more than {yardstick} kg m2 of the arm",
    "kg m2",
    "motor_inertia is in kg m2 on the motor's side; the ratio counts squared",
);
/// The friction is large relative to the effort limit.
pub(crate) const FRICTION: FindingKind = FindingKind::warning(
    "friction",
    "friction of {where} is {value} N m; its effort limit is {yardstick}",
    "N m",
    "coulomb in N m and viscous in N m s/rad on the joint's side",
);
/// The sampling period of the servo is implausibly long.
pub(crate) const SAMPLE: FindingKind = FindingKind::warning(
    "sampling",
    "the servo of {where} samples every {value} s, controllers of robots end at {yardstick}",
    "s",
    "sample_s is in s: 1 ms is 0.001",
);
/// The position gain is implausibly high.
pub(crate) const POSITION_GAIN: FindingKind = FindingKind::warning(
    "position-gain",
    "the position gain of {where} is {value} 1/s, usual values end at {yardstick}",
    "1/s",
    "position_gain is in 1/s: 5 to 50",
);
/// The velocity gain makes the sampled loop unstable.
pub(crate) const VELOCITY_GAIN: FindingKind = FindingKind::warning(
    "velocity-gain",
    "the velocity gain of {where} is {value} N m s/rad, sampled loops follow and are stable up to {yardstick}",
    "N m s/rad",
    "velocity_gain over the inertia is the bandwidth in rad/s; faster sampling allows more",
);

/// A joint is rigid although others of the arm are elastic.
pub(crate) const STIFF_JOINT: FindingKind = FindingKind::warning(
    "stiff-joint",
    "{where} is rigid, {value} of {yardstick} joints of the arm are elastic",
    "",
    "give its drive a gearbox with its stiffness; leaving out the last joints of a wrist is usual",
);

// The arm at rest.

/// A gear deflects too much.
pub(crate) const GEAR_ROTATION: FindingKind = FindingKind::warning(
    "gear-rotation",
    "the gearbox of {where} deflects by {value} rad, usual gearboxes by less than {yardstick}",
    "rad",
    "check stiffness (N m/rad on the joint's side), masses and loads",
);
/// A bearing deflects too much.
pub(crate) const BEARING: FindingKind = FindingKind::warning(
    "bearing",
    "the bearing of {where} deflects by {value} m, usual bearings by less than {yardstick}",
    "m",
    "translational stiffness is in N/m: bearings have 1e7 to 1e10",
);
/// The TCP sags too much.
pub(crate) const SAG: FindingKind = FindingKind::warning(
    "sag",
    "{where} sags by {value} m, the arm reaches {yardstick} m",
    "m",
    "robots sag by 1e-4 to 1e-2 of their reach: check stiffness, masses and units",
);
/// The first natural frequency is implausibly low.
pub(crate) const SLOW_MODE: FindingKind = FindingKind::warning(
    "first-frequency",
    "{where} has a first frequency of {value} Hz, such arms have more than {yardstick}",
    "Hz",
    "geared arms have 5 to 30 Hz: check stiffness, masses and units",
);
/// The first natural frequency is implausibly high.
pub(crate) const FAST_MODE: FindingKind = FindingKind::warning(
    "first-frequency",
    "{where} has a first frequency of {value} Hz; sound in steel runs along it {yardstick} times a second",
    "Hz",
    "nothing of this size swings so fast: check stiffness, masses and units",
);
/// The first mode is heavily damped.
pub(crate) const DAMPED_MODE: FindingKind = FindingKind::warning(
    "damped-mode",
    "{where} has a damping ratio of {value}; from {yardstick} on it does not oscillate",
    "",
    "arms have 0.01 to 0.1: check damping of links and gearboxes",
);
