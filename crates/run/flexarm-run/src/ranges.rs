//! Ranges of the numbers in flexarm's TOML files, by key: possible ones, and usual ones.
//!
//! A number outside its possible range is an error ([`outside`], [`not_finite`]), one outside its
//! usual range a caveat ([`unusual`]). Keys are paths joined by dots; units are those of the files
//! (SI, rad). Not here: numbers whose range depends on the robot ([`crate::caveat`]), the ranges of
//! quantities (`flexarm_settings::Quantity`).

use std::cell::RefCell;
use std::f64::consts::TAU;
use std::ops::{Range, RangeInclusive};

use flexarm_settings::finding::FindingKind;
use flexarm_settings::{OutOfRange, Quantity};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::caveat::slip::{self, Factor};
use crate::caveat::{Finding, kinds};

/// Quantity of each key; a prefix restricts it to one table, as in `payload.mass`.
pub(crate) type Ranges = &'static [(&'static str, Quantity)];

/// Keys of a robot file.
pub(crate) const OF_ROBOT: Ranges = &[
    ("gravity", Quantity::ACCELERATION),
    ("mass", Quantity::MASS),
    ("inertia_from_total_mass", Quantity::MASS),
    ("inertia_from_density", Quantity::DENSITY),
    ("inertia", Quantity::INERTIA),
    ("motor_inertia", Quantity::INERTIA),
    ("com", Quantity::LENGTH),
    ("xyz", Quantity::LENGTH),
    ("rpy", Quantity::JOINT),
    ("ratio", Quantity::RATIO),
    ("stiffness_factor", Quantity::RATIO),
    ("stiffness_factors", Quantity::RATIO),
    ("gearbox.stiffness", Quantity::STIFFNESS),
    ("mounting.stiffness", Quantity::STIFFNESS),
    ("gearbox.damping", Quantity::DAMPING),
    ("backlash", Quantity::JOINT),
    ("viscous", Quantity::DAMPING),
    ("coulomb", Quantity::TORQUE),
    ("stribeck", Quantity::TORQUE),
    ("torque_limit", Quantity::TORQUE),
    ("rated_torque", Quantity::TORQUE),
    ("velocity_gain", Quantity::DAMPING),
    ("position_gain", Quantity::RATIO),
    ("sample_s", Quantity::TIME),
    ("play.width", Quantity::TORQUE),
    ("play.centre", Quantity::TORQUE),
    ("gap", Quantity::LENGTH),
    ("outer_end", Quantity::LENGTH),
    ("inner_end", Quantity::LENGTH),
    ("width", Quantity::LENGTH),
    ("height", Quantity::LENGTH),
    ("wall", Quantity::LENGTH),
    ("web", Quantity::LENGTH),
    ("flange", Quantity::LENGTH),
    ("fillet", Quantity::LENGTH),
    ("diameter", Quantity::LENGTH),
    ("outer_diameter", Quantity::LENGTH),
    ("piston_diameter", Quantity::LENGTH),
    ("rod_diameter", Quantity::LENGTH),
    ("offset", Quantity::LENGTH),
    ("length", Quantity::LENGTH),
    ("free_length", Quantity::LENGTH),
    ("stroke", Quantity::LENGTH),
    ("rho", Quantity::DENSITY),
    ("E", Quantity::PRESSURE),
    ("pressure", Quantity::PRESSURE),
    ("ambient_pressure", Quantity::PRESSURE),
    ("gas_spring.force", Quantity::FORCE),
    ("preload", Quantity::FORCE),
    ("sine.torque", Quantity::TORQUE),
    ("lead", Quantity::LENGTH),
    ("hold", Quantity::JOINT),
    ("calibration.zero", Quantity::JOINT),
    ("strength.yield", Quantity::PRESSURE),
    ("strength.tensile", Quantity::PRESSURE),
    ("strength.fatigue", Quantity::PRESSURE),
    ("strain_gauge.at", Quantity::LENGTH),
    ("stress_point.at", Quantity::LENGTH),
];

/// Keys of a loads file.
pub(crate) const OF_LOADS: Ranges = &[
    ("mass", Quantity::MASS),
    ("com", Quantity::LENGTH),
    ("inertia", Quantity::INERTIA),
    ("force", Quantity::FORCE),
    ("torque", Quantity::TORQUE),
    ("at", Quantity::TIME),
    ("start", Quantity::TIME),
    ("end", Quantity::TIME),
    ("duration", Quantity::TIME),
    ("phase", Quantity::JOINT),
    ("frequency", Quantity::FREQUENCY),
    ("from", Quantity::FREQUENCY),
    ("to", Quantity::FREQUENCY),
    ("spindle_rpm", Quantity::SPEED),
];

/// Usual magnitudes of nonzero numbers that need no robot to compare with, the caveat of others, and
/// the mistakes that explain them.
pub(crate) struct Usual {
    keys: &'static [&'static str],
    kind: FindingKind,
    range: RangeInclusive<f64>,
    factors: &'static [Factor],
}

/// Usual numbers of a robot file.
const USUAL_OF_ROBOT: &[Usual] = &[
    // One turn: larger angles are in degrees.
    Usual {
        keys: &["rpy", "roll", "free_angle", "sine.zero", "controller_axis.zero"],
        kind: kinds::ANGLE,
        range: 0.0..=TAU + 1e-9,
        factors: slip::ANGLE,
    },
    // Smaller corrections are calibrations; a right angle in rad is 1.57.
    Usual {
        keys: &["zero_deg"],
        kind: kinds::UNUSUAL.with_unit("degrees"),
        range: 2.0..=f64::INFINITY,
        factors: &[(1.0 / slip::DEGREES, "radians")],
    },
    // Parts of arms, the longest of which reach 70 m.
    Usual {
        keys: &[
            "free_length",
            "gas_spring.length",
            "stroke",
            "from.xyz",
            "to.xyz",
            "offset",
            "ends",
            "mounting.xyz",
            "mounting.com",
        ],
        kind: kinds::UNUSUAL.with_unit("m"),
        range: 0.0..=20.0,
        factors: slip::LENGTH,
    },
    Usual { keys: &["split"], kind: kinds::UNUSUAL, range: 0.05..=0.95, factors: &[] },
    // Anchored feet have hundredths of a millimetre.
    Usual {
        keys: &["mounting.backlash"],
        kind: kinds::UNUSUAL.with_unit("m or rad"),
        range: 0.0..=0.01,
        factors: &[(1e3, "millimetres or mrad"), (slip::DEGREES, "degrees")],
    },
    // Friction that acts below the resolution of a speed.
    Usual {
        keys: &["regularisation"],
        kind: kinds::UNUSUAL.with_unit("rad/s"),
        range: 1e-6..=f64::INFINITY,
        factors: &[],
    },
    // Gas springs and hydraulic accumulators.
    Usual {
        keys: &["gas.pressure"],
        kind: kinds::UNUSUAL.with_unit("Pa"),
        range: 1e5..=1e8,
        factors: &[(1e-3, "kPa"), (1e-5, "bar"), (1e-6, "MPa")],
    },
    Usual {
        keys: &["gas.volume"],
        kind: kinds::UNUSUAL.with_unit("m3"),
        range: 1e-6..=0.1,
        factors: &[(1e3, "litres"), (1e6, "cm3")],
    },
];

/// Usual numbers of a loads file.
pub(crate) const USUAL_OF_LOADS: &[Usual] = &[
    // Impulses of hammers and bumps take 1e-4 to 0.1 s.
    Usual {
        keys: &["duration"],
        kind: kinds::UNUSUAL.with_unit("s"),
        range: 1e-6..=0.5,
        factors: &[(1e3, "milliseconds")],
    },
    // Large face mills have 100, dental spindles 4e5.
    Usual {
        keys: &["spindle_rpm"],
        kind: kinds::UNUSUAL.with_unit("1/min"),
        range: 20.0..=5e5,
        factors: &[(1e-3, "1000/min"), (1.0 / 60.0, "1/s")],
    },
    Usual { keys: &["teeth"], kind: kinds::UNUSUAL, range: 1.0..=100.0, factors: &[] },
    // Arms have no modes above.
    Usual {
        keys: &["frequency", "from", "to"],
        kind: kinds::UNUSUAL.with_unit("Hz"),
        range: 1e-3..=5000.0,
        factors: &[(60.0, "1/min"), (1e3, "mHz")],
    },
];

/// Returns the caveats about numbers of a robot file that are possible but not usual.
///
/// * `text`: of a file that has been read as TOML.
pub(crate) fn unusual(text: &str) -> Vec<Finding> {
    let found = RefCell::new(Vec::new());
    let judge = |name: &str, number: f64| {
        found.borrow_mut().extend(judged(name, number, USUAL_OF_ROBOT));
        Ok(number)
    };
    first(text, &judge);
    found.into_inner()
}

/// Returns the caveats about a number, by the path of its keys.
pub(crate) fn judged<'a>(name: &'a str, number: f64, usual: &'a [Usual]) -> impl Iterator<Item = Finding> + 'a {
    let own = usual.iter().filter(move |usual| number != 0.0 && usual.keys.iter().any(|key| belongs(name, key)));
    own.filter_map(move |usual| slip::outside(&usual.kind, name, number.abs(), &usual.range, usual.factors, 1.0))
}

/// Returns the first finite number outside its range, with its location and a message. Numbers of
/// other keys only have an upper bound on their magnitude.
///
/// * `text`: of a file that has been read as TOML.
pub(crate) fn outside(text: &str, ranges: Ranges) -> Option<(Range<usize>, String)> {
    first(text, &|name, number| if number.is_finite() { check(name, number, ranges) } else { Ok(number) })
}

/// Returns the first number that is not finite, with its location and a message. Keys with checks
/// of their own have been rejected before. An effort limit of `inf` is allowed.
pub(crate) fn not_finite(text: &str) -> Option<(Range<usize>, String)> {
    let unlimited = |name: &str, number: f64| number == f64::INFINITY && name.starts_with("effort_limit.");
    let finite = |name: &str, number: f64| number.is_finite() || unlimited(name, number);
    first(text, &|name, number| if finite(name, number) { Ok(number) } else { check(name, number, &[]) })
}

type Check<'a> = &'a dyn Fn(&str, f64) -> Result<f64, OutOfRange>;

fn first(text: &str, check: Check<'_>) -> Option<(Range<usize>, String)> {
    let file = DeTable::parse(text).ok()?;
    in_table(file.get_ref(), "", check)
}

fn in_table(table: &DeTable<'_>, name: &str, check: Check<'_>) -> Option<(Range<usize>, String)> {
    table.iter().find_map(|(key, value)| {
        let key: &str = key.get_ref().as_ref();
        in_value(value, &if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") }, check)
    })
}

/// Finds the first number of a value that the check refuses: its place and the message.
///
/// * `name`: path of the keys, joined by dots.
fn in_value(value: &Spanned<DeValue<'_>>, name: &str, check: Check<'_>) -> Option<(Range<usize>, String)> {
    let number: f64 = match value.get_ref() {
        DeValue::Table(table) => return in_table(table, name, check),
        DeValue::Array(values) => return values.iter().find_map(|value| in_value(value, name, check)),
        DeValue::Integer(number) => number.as_str().parse().ok()?,
        DeValue::Float(number) => number.as_str().parse().ok()?,
        DeValue::String(_) | DeValue::Boolean(_) | DeValue::Datetime(_) => return None,
    };
    check(name, number).err().map(|outside| (value.span(), outside.to_string()))
}

fn check(name: &str, number: f64, ranges: Ranges) -> Result<f64, OutOfRange> {
    let quantity =
        ranges.iter().find(|(key, _)| belongs(name, key)).map_or(Quantity::NUMBER, |(_, quantity)| *quantity);
    quantity.check(name, number)
}

/// Whether a path of keys ends with a key, or is in a table of it: a table whose keys are joint
/// names has one quantity.
fn belongs(name: &str, key: &str) -> bool {
    let within = name.strip_suffix(key).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
    within || name.strip_prefix(key).is_some_and(|rest| rest.starts_with('.') && !rest[1..].contains('.'))
}
