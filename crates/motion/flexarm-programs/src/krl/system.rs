//! State of the controller: system variables, tools and bases, and frames as values.
//!
//! Frames are values with X, Y, Z in mm and A, B, C in degrees, as in KRL; [`frame_of`] reads them.
//! Not here: conversion to poses (`common/frames`).

use std::rc::Rc;

use crate::common::machine::Machine;
use crate::common::value::{Record, Value};
use crate::common::{Result, Span, fail};

/// KRL state in addition to variables.
pub(super) struct Krl {
    /// Whether the user's assignments are running, which may set everything.
    pub(super) is_given: bool,
    /// Number of the tool whose data are not in the files.
    pub(super) unknown_tool: Option<i64>,
    /// Whether a SPLINE block is running.
    pub(super) in_spline: bool,
}

impl Krl {
    pub(super) fn new() -> Self {
        Self { is_given: false, unknown_tool: None, in_spline: false }
    }
}

pub(super) type Krls<'a> = Machine<'a, Krl>;

/// Components of frames and positions, in mm and degrees.
pub(super) const CARTESIAN: [&str; 6] = ["x", "y", "z", "a", "b", "c"];

/// Sets the variables to their initial values on a controller.
pub(super) fn set_up(machine: &mut Krls<'_>) {
    let parts = |names: &[&str]| Value::record("", names.iter().map(|name| (*name, Value::Nothing)).collect());
    let zero = frame_value([0.0; 6]);
    for (name, value) in [
        // Speeds, accelerations and blending, unset until the program sets them.
        ("$vel", parts(&["cp", "ori1", "ori2"])),
        ("$acc", parts(&["cp", "ori1", "ori2"])),
        ("$apo", parts(&["cptp", "cdis", "cvel", "cori"])),
        ("$vel_axis", Value::list(Vec::new())),
        ("$acc_axis", Value::list(Vec::new())),
        ("$ov_pro", Value::Whole(100)),
        // Frames and interpolation.
        ("$base", Value::Nothing),
        ("$tool", Value::Nothing),
        ("$robroot", zero.clone()),
        ("$nullframe", zero.clone()),
        ("$world", zero),
        ("$ipo_mode", Value::Word("base".into())),
        ("$ori_type", Value::Word("var".into())),
        ("$circ_type", Value::Word("base".into())),
        ("$sen_ori_type", Value::Nothing),
        // Outputs and flags.
        ("$out", Value::list(Vec::new())),
        ("$flag", Value::list(Vec::new())),
        ("$cycflag", Value::list(Vec::new())),
        // Data of the inline forms.
        ("pdat_act", parts(&["vel", "acc", "apo_dist", "apo_mode"])),
        ("ldat_act", parts(&["vel", "acc", "apo_dist", "apo_fac", "ori_typ"])),
        ("fdat_act", parts(&["tool_no", "base_no", "ipo_frame"])),
        ("pdefault", pdat_default()),
        (
            "fhome",
            Value::record(
                "fdat",
                vec![
                    ("tool_no", Value::Whole(0)),
                    ("base_no", Value::Whole(0)),
                    ("ipo_frame", Value::Word("base".into())),
                ],
            ),
        ),
    ] {
        machine.set_global(name, value);
    }
}

/// KUKA's default data of the inline forms of joint moves.
fn pdat_default() -> Value {
    Value::record(
        "pdat",
        vec![("vel", Value::Number(100.0)), ("acc", Value::Number(100.0)), ("apo_dist", Value::Number(100.0))],
    )
}

/// KRL aggregate of a frame in mm and degrees.
pub(super) fn frame_value(parts: [f64; 6]) -> Value {
    Value::record("frame", CARTESIAN.iter().zip(parts).map(|(name, part)| (*name, Value::Number(part))).collect())
}

/// The six numbers of a frame, if the value is one; omitted components are 0.
pub(super) fn frame_of(value: &Value, span: Span) -> Result<Option<[f64; 6]>> {
    let Value::Record(record) = value else { return Ok(None) };
    if !CARTESIAN.iter().any(|name| record.get(name).is_some()) {
        return Ok(None);
    }
    let mut parts = [0.0; 6];
    for (part, name) in parts.iter_mut().zip(CARTESIAN) {
        if let Some(value) = record.get(name).filter(|value| !matches!(value, Value::Nothing)) {
            *part = value.number(span)?;
        }
    }
    Ok(Some(parts))
}

pub(super) fn record_of(value: Option<&Value>) -> Record {
    match value {
        Some(Value::Record(record)) => (**record).clone(),
        _ => Record::default(),
    }
}

/// Element of a controller's list, if the files define it.
fn listed(machine: &Krls<'_>, list: &str, number: i64) -> Option<Value> {
    let Some(Value::List(values)) = machine.global(list) else { return None };
    let value = values.get(usize::try_from(number - 1).ok()?)?;
    (!matches!(value, Value::Nothing)).then(|| value.clone())
}

/// Number of a tool whose data are not in the files.
pub(super) fn unknown_tool_number(what: &str) -> Option<i64> {
    what.strip_prefix("`TOOL_DATA[")?.strip_suffix("]`")?.parse().ok()
}

/// `TOOL_DATA[n]`; a single tool that the files do not define is the robot's own.
pub(super) fn tool_data(machine: &mut Krls<'_>, number: i64, span: Span) -> Result<Value> {
    if number == 0 {
        return Ok(frame_value([0.0; 6]));
    }
    if let Some(value) = listed(machine, "tool_data", number) {
        return Ok(value);
    }
    if let Some(other) = machine.dialect.unknown_tool.filter(|other| *other != number) {
        return fail(
            span,
            format!(
                "neither tool {other} nor tool {number} is in the files, so they cannot be told apart: give `$config.dat` (`companions`), \
                 or `TOOL_DATA[{number}]` as an option (`given`)"
            ),
        );
    }
    machine.dialect.unknown_tool = Some(number);
    let text = format!("TOOL_DATA[{number}] is not in the files: the robot's own tool centre point is taken");
    machine.recorder.note(&text, span);
    Ok(Value::Nothing)
}

/// `BASE_DATA[n]`.
pub(super) fn base_data(machine: &Krls<'_>, number: i64, span: Span) -> Result<Value> {
    match (number, listed(machine, "base_data", number)) {
        (0, _) => Ok(frame_value([0.0; 6])),
        (_, Some(value)) => Ok(value),
        (_, None) => fail(
            span,
            format!(
                "BASE_DATA[{number}] is not in the files: give `$config.dat` (`companions`), or its frame as an option \
                 (`given`, BASE_DATA[{number}])"
            ),
        ),
    }
}

/// Acceleration (m/s²) of a percentage, if the files define the controller's default.
pub(super) fn path_acceleration(machine: &mut Krls<'_>, percent: f64, span: Span) -> Result<Value> {
    match machine.global("def_acc_cp").cloned() {
        Some(value) => Ok(Value::Number(value.number(span)? * percent / 100.0)),
        None => {
            machine.recorder.note("path accelerations in percent need DEF_ACC_CP of `$config.dat`, which was not given: the robot's limits rule", span);
            Ok(Value::Nothing)
        }
    }
}

/// Sets one component of a system variable.
pub(super) fn set_part(machine: &mut Krls<'_>, name: &str, field: &str, value: Value) {
    let mut record = record_of(machine.global(name));
    record.set(field, value);
    machine.set_global(name, Value::Record(Rc::new(record)));
}

/// Sets `$VEL.CP`, limited to the maximum of `$config.dat`.
pub(super) fn set_path_speed(machine: &mut Krls<'_>, speed: f64, span: Span) -> Result<()> {
    let largest = machine.global("def_vel_cp").cloned().map(|value| value.number(span)).transpose()?;
    set_part(machine, "$vel", "cp", Value::Number(largest.map_or(speed, |largest| speed.min(largest))));
    Ok(())
}

/// Sets the same percentage for all axes.
pub(super) fn set_axes(machine: &mut Krls<'_>, name: &str, percent: f64) {
    machine.set_global(name, Value::list(vec![Value::Number(percent); 12]));
}
