//! KRL in the interpreter: names of the controller, instructions, blocks, types and operators.
//!
//! [`Krl`] implements [`Dialect`]: what the interpreter asks about names, calls and types of KRL.
//! Not here: moves (`motion`), functions (`functions`), initial values (`system`).

use std::rc::Rc;

use super::bas::bas;
use super::functions::{inline_form, mathematics};
use super::system::{CARTESIAN, Krl, Krls, frame_of, frame_value};
use super::{motion, parse};
use crate::common::frames::{mm_deg_zyx, pose_zyx_mm_deg};
use crate::common::machine::{Dialect, Flow};
use crate::common::tree::{Argument, Operator, Statement};
use crate::common::value::{Record, Value};
use crate::common::{Result, Span, fail, is_among};

/// System variables that have no effect on the motion of the arm.
const STILL: &str = "\
    $anout $anin $timer $timer_stop $timer_flag $bwdstart $advance $load $load_a1 $load_a2 $load_a3 \
    $h_pos $act_tool $act_base $act_tool_c $act_base_c $gear_jerk $jerk $collmon_tol_pro $loop_msg \
    $loop_cont $vel_extax $acc_extax $ov_appl $torqmon $torqmon_com $msg_t $cmd $error $home $tech";

/// Whether a name is implemented by this reader.
pub(super) fn is_built_in(name: &str) -> bool {
    is_among(name, parse::MOTIONS) || matches!(name, "bas" | "wait sec" | "wait for")
}

impl Dialect for Krl {
    const FIRST_INDEX: i64 = 1;

    fn name(machine: &mut Krls<'_>, name: &str, span: Span) -> Result<Value> {
        match name {
            "$axis_act" | "$axis_for" | "$axis_int" => {
                if let Some(joints) = machine.recorder.joints() {
                    return Ok(motion::axes_value(joints));
                }
            }
            "$pos_act" | "$pos_for" | "$pos_int" => {
                let (X_WB, X_FT) = motion::frames(machine, span)?;
                if let Ok(X_BT) = machine.recorder.pose(&X_WB, &X_FT, span) {
                    return Ok(frame_value(mm_deg_zyx(&X_BT)));
                }
            }
            "tool_data" | "base_data" => {
                let element = |k: usize| Value::Outside(format!("`{}[{k}]`", name.to_uppercase()).into());
                return Ok(Value::list((1..=64).map(element).collect()));
            }
            _ if name.starts_with("xhome") => {
                let what = format!("`{}`, in `$config.dat` (`companions`)", name.to_uppercase());
                return Ok(Value::Outside(what.into()));
            }
            "$pi" => return Ok(Value::Number(std::f64::consts::PI)),
            _ => {}
        }
        Ok(Value::Outside(format!("`{name}`").into()))
    }

    fn function(machine: &mut Krls<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
        match inline_form(machine, name, arguments, span)? {
            Some(value) => Ok(value),
            None => mathematics(machine, name, arguments, span),
        }
    }

    fn instruction(machine: &mut Krls<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Flow> {
        if is_among(name, parse::MOTIONS) {
            motion::motion(machine, name, arguments, span)?;
            return Ok(Flow::On);
        }
        match name {
            "bas" => bas(machine, arguments, span)?,
            "wait sec" => {
                let seconds = machine.number(arguments, 0, span)?;
                machine.recorder.dwell(seconds.max(0.0), span)?;
            }
            "wait for" => {
                let (condition, at) = machine.argument(arguments, 0, span)?;
                machine.wait_for(condition, at, span)?;
            }
            _ if Self::is_still(name) => machine.recorder.note(still_words(name), span),
            _ => {
                return fail(
                    span,
                    format!(
                        "the routine `{name}` is neither in this file nor beside it: give its file (`companions`), or take the call \
                         out if it does not move the robot"
                    ),
                );
            }
        }
        Ok(Flow::On)
    }

    fn block(
        machine: &mut Krls<'_>,
        name: &str,
        arguments: &[Argument],
        body: &[Statement],
        span: Span,
    ) -> Result<Flow> {
        if name == "ptp_spline" {
            return fail(span, "splines of joint moves (PTP_SPLINE) are not read: write the points as SPTP with C_SPL");
        }
        motion::spline(machine, arguments, body, span)
    }

    fn undeclared(machine: &mut Krls<'_>, name: &str, span: Span) -> Result<bool> {
        if machine.dialect.is_given || !name.starts_with('$') {
            return Ok(true);
        }
        if is_among(name, STILL) {
            let what = match name {
                "$load" | "$load_a1" | "$load_a2" | "$load_a3" => {
                    "loads of the program are not taken: the robot has its own"
                }
                "$jerk" | "$gear_jerk" => "bounds of the jerk are not taken from the program",
                _ => "system variables without effect on the motion are set",
            };
            machine.recorder.note(what, span);
            return Ok(false);
        }
        fail(
            span,
            format!(
                "what the system variable `{}` does to the motion is not known here: take the line out",
                name.to_uppercase()
            ),
        )
    }

    fn coerce(_: &mut Krls<'_>, kind: &str, value: Value, span: Span) -> Result<Value> {
        Ok(match (kind, value) {
            ("int", Value::Number(number)) => Value::Whole(number.round() as i64),
            ("real", Value::Whole(whole)) => Value::Number(whole as f64),
            ("int" | "real" | "bool", value @ (Value::Record(_) | Value::List(_))) => {
                return fail(span, format!("{kind} is expected, this is {}", value.kind()));
            }
            (kind, Value::Record(record)) if record.kind.is_empty() => {
                Value::Record(Rc::new(Record { kind: kind.into(), fields: record.fields.clone() }))
            }
            (_, value) => value,
        })
    }

    fn binary(operator: Operator, left: &Value, right: &Value, span: Span) -> Option<Result<Value>> {
        if operator != Operator::Frame {
            return None;
        }
        Some(frame_product(left, right, span))
    }

    fn is_still(name: &str) -> bool {
        const BEGINNINGS: &str = "msg set_cd_params ir_stopm swrite str user grp h_gripper h50 varstate clear log";
        matches!(name, "$out" | "$flag" | "$cycflag" | "$timer" | "$anout" | "$timer_stop")
            || BEGINNINGS.split(' ').any(|beginning| name.starts_with(beginning))
    }
}

fn still_words(name: &str) -> &'static str {
    match name {
        _ if name.starts_with("grp") || name.starts_with('h') => "grippers are not simulated",
        "set_cd_params" => "monitoring of collisions is not simulated",
        _ => "messages are not shown",
    }
}

/// `a : b`: composition of the frames a and b, both in mm and degrees.
fn frame_product(left: &Value, right: &Value, span: Span) -> Result<Value> {
    let (Some(a), Some(b)) = (frame_of(left, span)?, frame_of(right, span)?) else {
        return fail(span, "frames are expected on both sides of `:`");
    };
    let product = mm_deg_zyx(&(pose_zyx_mm_deg(a) * pose_zyx_mm_deg(b)));
    let mut result = Record::default();
    for (name, number) in CARTESIAN.iter().zip(product) {
        result.set(name, Value::Number(number));
    }
    if let Value::Record(right) = right {
        result.kind = right.kind.clone();
        for (name, value) in right.fields.iter().filter(|(name, _)| !CARTESIAN.contains(&&**name)) {
            result.set(name, value.clone());
        }
    }
    Ok(Value::Record(Rc::new(result)))
}
