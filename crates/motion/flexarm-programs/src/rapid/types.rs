//! RAPID data types, and the predefined speeds, zones, tool and work object of every controller.
//!
//! A type is a list of named fields; [`coerce`] makes a record of a list by them. Predefined data
//! have the values of the manual, in mm, mm/s and degrees. Not here: records that a program defines
//! itself (`parse`).

use std::collections::HashMap;
use std::rc::Rc;

use crate::common::value::{Record, Value};
use crate::common::{Result, Span, fail};

/// Names and types of fields.
pub(super) type Fields = Vec<(Rc<str>, Rc<str>)>;

/// Fields of types declared in a file.
pub(super) type Records = HashMap<Rc<str>, Fields>;

/// Fields of a built-in type, with their types.
fn fields(kind: &str) -> Option<&'static [(&'static str, &'static str)]> {
    Some(match kind {
        // Places, orientations (quaternions), configurations.
        "pos" => &[("x", "num"), ("y", "num"), ("z", "num")],
        "orient" => &[("q1", "num"), ("q2", "num"), ("q3", "num"), ("q4", "num")],
        "pose" => &[("trans", "pos"), ("rot", "orient")],
        "confdata" => &[("cf1", "num"), ("cf4", "num"), ("cf6", "num"), ("cfx", "num")],
        // Axes: external ones and those of the robot.
        "extjoint" => &[
            ("eax_a", "num"),
            ("eax_b", "num"),
            ("eax_c", "num"),
            ("eax_d", "num"),
            ("eax_e", "num"),
            ("eax_f", "num"),
        ],
        "robjoint" => &[
            ("rax_1", "num"),
            ("rax_2", "num"),
            ("rax_3", "num"),
            ("rax_4", "num"),
            ("rax_5", "num"),
            ("rax_6", "num"),
        ],
        // Targets, speeds, zones.
        "robtarget" => &[("trans", "pos"), ("rot", "orient"), ("robconf", "confdata"), ("extax", "extjoint")],
        "jointtarget" => &[("robax", "robjoint"), ("extax", "extjoint")],
        "speeddata" => &[("v_tcp", "num"), ("v_ori", "num"), ("v_leax", "num"), ("v_reax", "num")],
        "zonedata" => &[
            ("finep", "bool"),
            ("pzone_tcp", "num"),
            ("pzone_ori", "num"),
            ("pzone_eax", "num"),
            ("zone_ori", "num"),
            ("zone_leax", "num"),
            ("zone_reax", "num"),
        ],
        // Loads, tools, work objects.
        "loaddata" => {
            &[("mass", "num"), ("cog", "pos"), ("aom", "orient"), ("ix", "num"), ("iy", "num"), ("iz", "num")]
        }
        "tooldata" => &[("robhold", "bool"), ("tframe", "pose"), ("tload", "loaddata")],
        "wobjdata" => {
            &[("robhold", "bool"), ("ufprog", "bool"), ("ufmec", "string"), ("uframe", "pose"), ("oframe", "pose")]
        }
        _ => return None,
    })
}

/// Converts a value to a type: lists become records, omitted values get the language's default.
/// `kind` ends with `{}` for each dimension of an array.
pub(super) fn coerce(records: &Records, kind: &str, value: Value, span: Span, depth: usize) -> Result<Value> {
    if depth > 8 {
        return fail(span, format!("the type `{kind}` contains itself"));
    }
    if let Some(element) = kind.strip_suffix("{}") {
        let Value::List(values) = value else { return Ok(value) };
        let values = values.iter().map(|value| coerce(records, element, value.clone(), span, depth + 1));
        return Ok(Value::list(values.collect::<Result<_>>()?));
    }
    let declared: Option<Vec<(&str, &str)>> = match fields(kind) {
        Some(fields) => Some(fields.to_vec()),
        None => records.get(kind).map(|fields| fields.iter().map(|(name, kind)| (&**name, &**kind)).collect()),
    };
    let Some(fields) = declared else {
        return Ok(match (kind, value) {
            ("num" | "dnum" | "byte", Value::Nothing) => Value::Number(0.0),
            ("bool", Value::Nothing) => Value::Flag(false),
            ("string", Value::Nothing) => Value::text(""),
            (_, value) => value,
        });
    };
    let values = match &value {
        Value::List(values) if values.len() == fields.len() => values.to_vec(),
        Value::List(values) if kind == "robtarget" && values.len() == 2 => {
            // Only position and orientation, as some generators write them.
            vec![values[0].clone(), values[1].clone(), Value::Nothing, Value::Nothing]
        }
        Value::List(values) => {
            return fail(span, format!("{kind} has {} parts, found {}", fields.len(), values.len()));
        }
        Value::Nothing => vec![Value::Nothing; fields.len()],
        Value::Record(_) | Value::Outside(_) => return Ok(value),
        other => return fail(span, format!("{kind} is expected, this is {}", other.kind())),
    };
    let mut record = Record { kind: kind.into(), fields: Vec::with_capacity(fields.len()) };
    let is_short = matches!(&value, Value::List(written) if written.len() < fields.len());
    for ((name, kind), value) in fields.iter().zip(values) {
        if is_short && matches!(value, Value::Nothing) {
            record.fields.push(((*name).into(), value)); // omitted, which is not 0
            continue;
        }
        record.fields.push(((*name).into(), coerce(records, kind, value, span, depth + 1)?));
    }
    Ok(Value::Record(Rc::new(record)))
}

fn numbers(values: &[f64]) -> Value {
    Value::list(values.iter().map(|value| Value::Number(*value)).collect())
}

/// Predefined data of every controller, with their type.
pub(super) fn predefined(name: &str) -> Option<(&'static str, Value)> {
    let no_turn = || numbers(&[1.0, 0.0, 0.0, 0.0]);
    let no_pose = || Value::list(vec![numbers(&[0.0; 3]), no_turn()]);
    let load = || {
        let zero = Value::Number(0.0);
        let com = numbers(&[0.0, 0.0, 0.001]);
        Value::list(vec![Value::Number(0.001), com, no_turn(), zero.clone(), zero.clone(), zero])
    };
    Some(match name {
        "fine" => ("zonedata", zone(true, [0.0; 6])),
        "z0" => ("zonedata", zone(false, [0.3, 0.3, 0.3, 0.03, 0.3, 0.03])),
        "tool0" => ("tooldata", Value::list(vec![Value::Flag(true), no_pose(), load()])),
        "wobj0" => {
            let parts = vec![Value::Flag(false), Value::Flag(true), Value::text(""), no_pose(), no_pose()];
            ("wobjdata", Value::list(parts))
        }
        "load0" => ("loaddata", load()),
        "vmax" => ("speeddata", numbers(&[5000.0, 500.0, 5000.0, 1000.0])),
        "pi" => ("num", Value::Number(std::f64::consts::PI)),
        "high" | "edge" => ("num", Value::Number(1.0)),
        "low" => ("num", Value::Number(0.0)),
        _ => return numbered(name),
    })
}

/// Predefined speeds and zones with a number in their name, such as `v100` and `z10`.
fn numbered(name: &str) -> Option<(&'static str, Value)> {
    const SPEEDS: [u32; 25] = [
        5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800, 1000, 1500, 2000, 2500, 3000, 4000,
        5000, 6000, 7000,
    ];
    const ZONES: [u32; 13] = [1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200];
    let number = |prefix: &str, known: &[u32]| {
        let number = name.strip_prefix(prefix)?.parse::<u32>().ok()?;
        known.contains(&number).then_some(f64::from(number))
    };
    if let Some(speed) = number("vrot", &[1, 2, 5, 10, 20, 50, 100]) {
        return Some(("speeddata", numbers(&[0.0, 0.0, 0.0, speed])));
    }
    if let Some(speed) = number("vlin", &[10, 20, 50, 100, 200, 500, 1000]) {
        return Some(("speeddata", numbers(&[0.0, 0.0, speed, 0.0])));
    }
    if let Some(speed) = number("v", &SPEEDS) {
        return Some(("speeddata", numbers(&[speed, 500.0, 5000.0, 1000.0])));
    }
    let tcp = number("z", &ZONES)?;
    let other = match tcp as u32 {
        1 => 1.0,
        5 => 8.0,
        15 => 23.0,
        _ => 1.5 * tcp,
    };
    Some(("zonedata", zone(false, [tcp, other, other, other / 10.0, other, other / 10.0])))
}

fn zone(fine: bool, values: [f64; 6]) -> Value {
    let mut parts = vec![Value::Flag(fine)];
    parts.extend(values.iter().map(|value| Value::Number(*value)));
    Value::list(parts)
}
