//! BAS: initial values of the motion, and the data of the inline forms' moves.
//!
//! `BAS` is the program of the controller that teach pendants call before each move of an inline
//! form; what it sets is set here. Not here: newer inline forms, which are functions (`functions`).

use super::system::{Krls, base_data, path_acceleration, record_of, set_axes, set_part, set_path_speed, tool_data};
use crate::common::tree::Argument;
use crate::common::value::Value;
use crate::common::{Result, Span, fail};

/// Parts of system variables that `BAS(#INITMOV, 0)` sets from `$config.dat`.
const DEFAULTS: [(&str, &str, &str); 8] = [
    ("$vel", "cp", "def_vel_cp"),
    ("$vel", "ori1", "def_vel_ori1"),
    ("$vel", "ori2", "def_vel_ori2"),
    ("$acc", "cp", "def_acc_cp"),
    ("$acc", "ori1", "def_acc_ori1"),
    ("$acc", "ori2", "def_acc_ori2"),
    ("$apo", "cptp", "def_apo_cptp"),
    ("$apo", "cdis", "def_apo_cdis"),
];

/// Runs `BAS(#COMMAND, number)`.
pub(super) fn bas(machine: &mut Krls<'_>, arguments: &[Argument], span: Span) -> Result<()> {
    let command = match machine.argument(arguments, 0, span)?.0 {
        Value::Word(word) => word,
        other => return fail(span, format!("BAS needs a command such as #INITMOV, found {}", other.kind())),
    };
    // Initial values, single settings, then the data of an inline form's move.
    match &*command {
        "initmov" => initial_motion(machine, span),
        "vel_ptp" | "acc_ptp" => {
            let percent = machine.number(arguments, 1, span)?;
            set_axes(machine, if &*command == "vel_ptp" { "$vel_axis" } else { "$acc_axis" }, percent);
        }
        "vel_cp" | "acc_cp" => {
            let number = machine.number(arguments, 1, span)?;
            if &*command == "vel_cp" {
                set_path_speed(machine, number, span)?;
            } else {
                let value = path_acceleration(machine, number, span)?;
                set_part(machine, "$acc", "cp", value);
            }
        }
        "ov_pro" => {
            let value = Value::Number(machine.number(arguments, 1, span)?);
            machine.set_global("$ov_pro", value);
        }
        "tool" => {
            let number = machine.number(arguments, 1, span)? as i64;
            let value = tool_data(machine, number, span)?;
            machine.set_global("$tool", value);
        }
        "base" => {
            let number = machine.number(arguments, 1, span)? as i64;
            let value = base_data(machine, number, span)?;
            machine.set_global("$base", value);
        }
        "frames" => act_frames(machine, span)?,
        "ptp_params" | "ptp_dat" => {
            act_frames(machine, span)?;
            ptp_data(machine, arguments, &command, span)?;
        }
        "cp_params" | "cp_dat" => {
            act_frames(machine, span)?;
            cp_data(machine, arguments, &command, span)?;
        }
        "out" | "null" => {}
        other => {
            return fail(
                span,
                format!("BAS(#{}) is not known here: take it out if it does not move the robot", other.to_uppercase()),
            );
        }
    }
    Ok(())
}

/// Runs `BAS(#INITMOV, 0)`.
fn initial_motion(machine: &mut Krls<'_>, span: Span) {
    set_axes(machine, "$vel_axis", 100.0);
    set_axes(machine, "$acc_axis", 100.0);
    for (variable, part, default) in DEFAULTS {
        if let Some(value) = machine.global(default).cloned() {
            set_part(machine, variable, part, value);
        }
    }
    machine
        .recorder
        .note("BAS(#INITMOV) sets 100 % for the axes; path speeds of the controller's own files are not known", span);
}

/// Sets tool and base of FDAT_ACT.
fn act_frames(machine: &mut Krls<'_>, span: Span) -> Result<()> {
    let fdat = record_of(machine.global("fdat_act"));
    let number = |name: &str| match fdat.get(name) {
        None | Some(Value::Nothing) => Ok(None),
        Some(value) => value.count(span).map(Some),
    };
    if let Some(number) = number("tool_no")? {
        let value = tool_data(machine, number, span)?;
        machine.set_global("$tool", value);
    }
    if let Some(number) = number("base_no")? {
        let value = base_data(machine, number, span)?;
        machine.set_global("$base", value);
    }
    if let Some(mode @ Value::Word(_)) = fdat.get("ipo_frame") {
        machine.set_global("$ipo_mode", mode.clone());
    }
    Ok(())
}

fn ptp_data(machine: &mut Krls<'_>, arguments: &[Argument], command: &str, span: Span) -> Result<()> {
    let pdat = record_of(machine.global("pdat_act"));
    let given = |name: &str| pdat.get(name).filter(|value| !matches!(value, Value::Nothing)).cloned();
    let speed = if command == "ptp_params" { Some(machine.argument(arguments, 1, span)?.0) } else { given("vel") };
    if let Some(percent) = speed {
        let percent = percent.number(span)?;
        set_axes(machine, "$vel_axis", percent);
    }
    if let Some(percent) = given("acc") {
        let percent = percent.number(span)?;
        set_axes(machine, "$acc_axis", percent);
    }
    if let Some(distance) = given("apo_dist") {
        let in_mm = matches!(given("apo_mode"), Some(Value::Word(mode)) if &*mode == "cdis");
        set_part(machine, "$apo", if in_mm { "cdis" } else { "cptp" }, distance);
    }
    Ok(())
}

fn cp_data(machine: &mut Krls<'_>, arguments: &[Argument], command: &str, span: Span) -> Result<()> {
    let ldat = record_of(machine.global("ldat_act"));
    let given = |name: &str| ldat.get(name).filter(|value| !matches!(value, Value::Nothing)).cloned();
    let speed = if command == "cp_params" { Some(machine.argument(arguments, 1, span)?.0) } else { given("vel") };
    if let Some(speed) = speed {
        let speed = speed.number(span)?;
        set_path_speed(machine, speed, span)?;
    }
    if let Some(percent) = given("acc") {
        let percent = percent.number(span)?;
        let value = path_acceleration(machine, percent, span)?;
        set_part(machine, "$acc", "cp", value);
    }
    if let Some(distance) = given("apo_dist") {
        set_part(machine, "$apo", "cdis", distance);
    }
    if let Some(kind @ Value::Word(_)) = given("ori_typ") {
        machine.set_global("$ori_type", kind);
    }
    Ok(())
}
