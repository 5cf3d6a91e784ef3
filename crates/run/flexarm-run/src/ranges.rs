//! Ranges of the numbers in flexarm's TOML files, by key.

use std::ops::Range;

use flexarm_settings::{OutOfRange, Quantity};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

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
    // A table whose keys are joint names has one quantity.
    let own = |key: &str| {
        let within = name.strip_suffix(key).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
        within || name.strip_prefix(key).is_some_and(|rest| rest.starts_with('.') && !rest[1..].contains('.'))
    };
    let quantity = ranges.iter().find(|(key, _)| own(key)).map_or(Quantity::NUMBER, |(_, quantity)| *quantity);
    quantity.check(name, number)
}
