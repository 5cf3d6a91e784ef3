//! Functions of KRL: those of the inline forms, and those of numbers and frames.
//!
//! Start at [`inline_form`] and [`mathematics`]. Values are as KRL has them, in mm and degrees. Not
//! here: `BAS` (`bas`), instructions (`dialect`).

use std::rc::Rc;

use super::system::{Krls, base_data, frame_of, frame_value, path_acceleration, record_of, tool_data};
use crate::common::frames::{mm_deg_zyx, pose_zyx_mm_deg};
use crate::common::tree::Argument;
use crate::common::value::Value;
use crate::common::{Result, Span, fail};

/// Functions of the inline forms; `None` if the name is not one of them.
pub(super) fn inline_form(
    machine: &mut Krls<'_>,
    name: &str,
    arguments: &[Argument],
    span: Span,
) -> Result<Option<Value>> {
    Ok(Some(match name {
        "stool2" => {
            let (value, at) = machine.argument(arguments, 0, span)?;
            let number = part(&value, "tool_no", at)?.count(at)?;
            tool_data(machine, number, at)?
        }
        "sbase" => {
            let number = machine.number(arguments, 0, span)? as i64;
            base_data(machine, number, span)?
        }
        "svel_joint" | "sipo_mode" => machine.argument(arguments, 0, span)?.0,
        "sacc_joint" => data(machine, arguments, 0, "acc", span)?,
        "sori_typ" => {
            let (value, at) = machine.argument(arguments, 0, span)?;
            part(&value, "ori_typ", at).unwrap_or(Value::Word("var".into()))
        }
        "sapo_ptp" | "sapo" => {
            let distance = data(machine, arguments, 0, "apo_dist", span)?;
            let mut apo = record_of(machine.global("$apo"));
            apo.set("cdis", distance.clone());
            apo.set("cptp", distance);
            Value::Record(Rc::new(apo))
        }
        "svel_cp" => {
            let mut speed = record_of(machine.global("$vel"));
            speed.set("cp", Value::Number(machine.number(arguments, 0, span)?));
            Value::Record(Rc::new(speed))
        }
        "sacc_cp" => {
            let percent = data(machine, arguments, 0, "acc", span)?.number(span)?;
            let mut acceleration = record_of(machine.global("$acc"));
            acceleration.set("cp", path_acceleration(machine, percent, span)?);
            Value::Record(Rc::new(acceleration))
        }
        "sload" | "sgear_jerk" | "sjerk" | "use_cm_pro_values" => Value::Nothing,
        _ => return Ok(None),
    }))
}

fn data(machine: &mut Krls<'_>, arguments: &[Argument], position: usize, name: &str, span: Span) -> Result<Value> {
    let (value, at) = machine.argument(arguments, position, span)?;
    part(&value, name, at)
}

/// Component of an aggregate.
fn part(value: &Value, name: &str, span: Span) -> Result<Value> {
    match value {
        Value::Record(record) => match record.get(name) {
            Some(Value::Nothing) | None => fail(span, format!("`{}` has no value here", name.to_uppercase())),
            Some(value) => Ok(value.clone()),
        },
        other => {
            let other = other.clone().known(span)?;
            fail(span, format!("data with `{}` are expected, this is {}", name.to_uppercase(), other.kind()))
        }
    }
}

/// Functions of numbers and frames.
pub(super) fn mathematics(machine: &mut Krls<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
    // A value that only the controller knows makes the result such a value.
    let mut numbers = Vec::new();
    for (k, argument) in arguments.iter().enumerate() {
        let Some(expression) = &argument.value else { continue };
        match machine.value(expression)? {
            Value::Outside(what) => return Ok(Value::Outside(what)),
            value if is_numeric(name) => numbers.push(value.number(argument.span)?),
            _ if k > 0 => {}
            value => numbers.push(value.number(argument.span).unwrap_or(f64::NAN)),
        }
    }
    let at = |k: usize| match numbers.get(k) {
        Some(number) => Ok(*number),
        None => fail(span, format!("`{name}` misses argument {}", k + 1)),
    };
    Ok(Value::Number(match name {
        "abs" => at(0)?.abs(),
        "sqrt" => at(0)?.sqrt(),
        "sin" => at(0)?.to_radians().sin(),
        "cos" => at(0)?.to_radians().cos(),
        "tan" => at(0)?.to_radians().tan(),
        "acos" => at(0)?.acos().to_degrees(),
        "asin" => at(0)?.asin().to_degrees(),
        "atan2" => at(0)?.atan2(at(1)?).to_degrees(),
        "round" => return Ok(Value::Whole(at(0)?.round() as i64)),
        "trunc" => return Ok(Value::Whole(at(0)?.trunc() as i64)),
        "inv_pos" => {
            let (value, at) = machine.argument(arguments, 0, span)?;
            let Some(parts) = frame_of(&value, at)? else { return fail(at, "a frame is expected") };
            return Ok(frame_value(mm_deg_zyx(&pose_zyx_mm_deg(parts).inverse())));
        }
        _ => return Ok(Value::Outside(format!("`{name}(...)`").into())),
    }))
}

fn is_numeric(name: &str) -> bool {
    matches!(name, "abs" | "sqrt" | "sin" | "cos" | "tan" | "acos" | "asin" | "atan2" | "round" | "trunc")
}
