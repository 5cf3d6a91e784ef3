//! The catalogue of caveats: code, sentence, unit and help. `docs/caveats.md` tells the source of each yardstick.

use super::CaveatKind;

/// Far end of a flexible link turned beyond small rotations.
pub const LARGE_DEFORMATION: CaveatKind = CaveatKind::warning(
    "large-deformation",
    "{where} bends by {value} rad, beyond the {yardstick} rad for which the linear elastic model is good",
    "rad",
    "the model is linear elastic: check stiffness, loads and units",
);
/// Distance of the interfaces of a flexible link changed.
pub const LARGE_STRAIN: CaveatKind = CaveatKind::warning(
    "large-strain",
    "{where} changes its length by {value} of it, beyond {yardstick}: check stiffness and loads",
    "",
    "metals yield at 1e-3 to 5e-3: check stiffness, loads and units",
);
/// A drive needs more in a run than it has.
pub const EFFORT: CaveatKind = CaveatKind::warning(
    "effort",
    "{where} needs {value} N m (or N), its limit is {yardstick}: the real drive would not follow",
    "N m",
    "check masses, payload, loads and the effort limit of the URDF",
);
/// A drive needs more than it has to hold a pose.
pub const HOLDING: CaveatKind = CaveatKind::warning(
    "effort",
    "{where} needs {value} N m (or N) to hold the pose, its limit is {yardstick}",
    "N m",
    "check masses, payload, loads and the effort limit of the URDF",
);
/// A servo at its limit.
pub const SERVO_LIMIT: CaveatKind = CaveatKind::warning(
    "servo-limit",
    "the servo of {where} is at its torque limit in {value} % of the samples: it cannot follow, or its loop is unstable \
     (gains too high for the inertia and sampling; is motor_inertia given?)",
    "%",
    "check gains, sampling, torque limit and motor inertia",
);
/// Few samples.
pub const FEW_SAMPLES: CaveatKind = CaveatKind::warning(
    "few-samples",
    "{value} logged samples a second are few for a first frequency of {yardstick} Hz: peaks between them are missed; raise \
     --log-rate or lower --step",
    "1/s",
    "ten samples per period show its peak to 5 %",
);
/// Few steps.
pub const COARSE_STEP: CaveatKind = CaveatKind::warning(
    "coarse-step",
    "{value} steps per period of the first mode are coarse: lower --step",
    "",
    "twenty steps per period or more follow it",
);
/// Energy.
pub const ENERGY_OPEN: CaveatKind = CaveatKind::warning(
    "energy-open",
    "the energy balance is open by {value} % of the energy in it: the samples are too far apart (--log-rate), the step too \
     coarse (--step), or the stepper damps by itself",
    "%",
    "halve the step and compare",
);
/// A mode without damping in a response.
pub const UNDAMPED: CaveatKind = CaveatKind::warning(
    "undamped",
    "{where} has no damping: the height of its peak means nothing",
    "",
    "give the springs damping",
);
/// A joint outside its range at a pose.
pub const OUTSIDE_LIMITS: CaveatKind = CaveatKind::warning(
    "outside-limits",
    "{where} at {value} is outside its limits",
    "rad",
    "choose a pose that the robot can take",
);
