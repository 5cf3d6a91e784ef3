//! System variables, BAS, and the functions of the inline forms.

use std::rc::Rc;

use super::{motion, parse};
use crate::common::frames::{mm_deg_zyx, pose_zyx_mm_deg};
use crate::common::machine::{Dialect, Flow, Machine, positional};
use crate::common::tree::{Argument, Expr, Kind, Operator, Statement};
use crate::common::value::{Record, Value, depends};
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

type Krls<'a> = Machine<'a, Krl>;

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

/// Components of frames and positions, in mm and degrees.
pub(super) const CARTESIAN: [&str; 6] = ["x", "y", "z", "a", "b", "c"];

/// System variables that have no effect on the motion of the arm.
const STILL: [&str; 31] = [
    "$anout",
    "$anin",
    "$timer",
    "$timer_stop",
    "$timer_flag",
    "$bwdstart",
    "$advance",
    "$load",
    "$load_a1",
    "$load_a2",
    "$load_a3",
    "$h_pos",
    "$act_tool",
    "$act_base",
    "$act_tool_c",
    "$act_base_c",
    "$gear_jerk",
    "$jerk",
    "$collmon_tol_pro",
    "$loop_msg",
    "$loop_cont",
    "$vel_extax",
    "$acc_extax",
    "$ov_appl",
    "$torqmon",
    "$torqmon_com",
    "$msg_t",
    "$cmd",
    "$error",
    "$home",
    "$tech",
];

/// Whether a name is implemented by this reader.
pub(super) fn is_built_in(name: &str) -> bool {
    parse::MOTIONS.contains(&name) || matches!(name, "bas" | "wait sec" | "wait for")
}

/// Sets the variables to their initial values on a controller.
pub(super) fn set_up(machine: &mut Krls<'_>) {
    let parts = |names: &[&str]| Value::record("", names.iter().map(|name| (*name, Value::Nothing)).collect());
    let zero = frame_value([0.0; 6]);
    for (name, value) in [
        ("$vel", parts(&["cp", "ori1", "ori2"])),
        ("$acc", parts(&["cp", "ori1", "ori2"])),
        ("$apo", parts(&["cptp", "cdis", "cvel", "cori"])),
        ("$vel_axis", Value::list(Vec::new())),
        ("$acc_axis", Value::list(Vec::new())),
        ("$ov_pro", Value::Whole(100)),
        ("$base", Value::Nothing),
        ("$tool", Value::Nothing),
        ("$robroot", zero.clone()),
        ("$nullframe", zero.clone()),
        ("$world", zero),
        ("$ipo_mode", Value::Word("base".into())),
        ("$ori_type", Value::Word("var".into())),
        ("$circ_type", Value::Word("base".into())),
        ("$sen_ori_type", Value::Nothing),
        ("$out", Value::list(Vec::new())),
        ("$flag", Value::list(Vec::new())),
        ("$cycflag", Value::list(Vec::new())),
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
        if parse::MOTIONS.contains(&name) {
            motion::motion(machine, name, arguments, span)?;
            return Ok(Flow::On);
        }
        match name {
            "bas" => bas(machine, arguments, span)?,
            "wait sec" => {
                let seconds = machine.number(arguments, 0, span)?;
                machine.recorder.dwell(seconds.max(0.0), span)?;
            }
            "wait for" => wait_for(machine, arguments, span)?,
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
        if STILL.contains(&name) {
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
        matches!(name, "$out" | "$flag" | "$cycflag" | "$timer" | "$anout" | "$timer_stop")
            || [
                "msg",
                "set_cd_params",
                "ir_stopm",
                "swrite",
                "str",
                "user",
                "grp",
                "h_gripper",
                "h50",
                "varstate",
                "clear",
                "log",
            ]
            .iter()
            .any(|known| name.starts_with(known))
    }
}

fn is_numeric(name: &str) -> bool {
    matches!(name, "abs" | "sqrt" | "sin" | "cos" | "tan" | "acos" | "asin" | "atan2" | "round" | "trunc")
}

fn still_words(name: &str) -> &'static str {
    match name {
        _ if name.starts_with("grp") || name.starts_with('h') => "grippers are not simulated",
        "set_cd_params" => "monitoring of collisions is not simulated",
        _ => "messages are not shown",
    }
}

fn record_of(value: Option<&Value>) -> Record {
    match value {
        Some(Value::Record(record)) => (**record).clone(),
        _ => Record::default(),
    }
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

fn data(machine: &mut Krls<'_>, arguments: &[Argument], position: usize, name: &str, span: Span) -> Result<Value> {
    let (value, at) = machine.argument(arguments, position, span)?;
    part(&value, name, at)
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

/// Functions of the inline forms; `None` if the name is not one of them.
fn inline_form(machine: &mut Krls<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Option<Value>> {
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

/// Functions of numbers and frames.
fn mathematics(machine: &mut Krls<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
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

/// `BASE_DATA[n]`.
fn base_data(machine: &Krls<'_>, number: i64, span: Span) -> Result<Value> {
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
fn path_acceleration(machine: &mut Krls<'_>, percent: f64, span: Span) -> Result<Value> {
    match machine.global("def_acc_cp").cloned() {
        Some(value) => Ok(Value::Number(value.number(span)? * percent / 100.0)),
        None => {
            machine.recorder.note("path accelerations in percent need DEF_ACC_CP of `$config.dat`, which was not given: the robot's limits rule", span);
            Ok(Value::Nothing)
        }
    }
}

/// Sets one component of a system variable.
fn set_part(machine: &mut Krls<'_>, name: &str, field: &str, value: Value) {
    let mut record = record_of(machine.global(name));
    record.set(field, value);
    machine.set_global(name, Value::Record(Rc::new(record)));
}

/// Sets `$VEL.CP`, limited to the maximum of `$config.dat`.
fn set_path_speed(machine: &mut Krls<'_>, speed: f64, span: Span) -> Result<()> {
    let largest = machine.global("def_vel_cp").cloned().map(|value| value.number(span)).transpose()?;
    set_part(machine, "$vel", "cp", Value::Number(largest.map_or(speed, |largest| speed.min(largest))));
    Ok(())
}

/// Sets the same percentage for all axes.
pub(super) fn set_axes(machine: &mut Krls<'_>, name: &str, percent: f64) {
    machine.set_global(name, Value::list(vec![Value::Number(percent); 12]));
}

/// Runs `BAS(#COMMAND, number)`.
fn bas(machine: &mut Krls<'_>, arguments: &[Argument], span: Span) -> Result<()> {
    let command = match machine.argument(arguments, 0, span)?.0 {
        Value::Word(word) => word,
        other => return fail(span, format!("BAS needs a command such as #INITMOV, found {}", other.kind())),
    };
    match &*command {
        "initmov" => {
            set_axes(machine, "$vel_axis", 100.0);
            set_axes(machine, "$acc_axis", 100.0);
            for (variable, part, default) in DEFAULTS {
                if let Some(value) = machine.global(default).cloned() {
                    set_part(machine, variable, part, value);
                }
            }
            machine.recorder.note(
                "BAS(#INITMOV) sets 100 % for the axes; path speeds of the controller's own files are not known",
                span,
            );
        }
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

fn wait_for(machine: &mut Krls<'_>, arguments: &[Argument], span: Span) -> Result<()> {
    let (value, at) = machine.argument(arguments, 0, span)?;
    match value {
        Value::Flag(true) => Ok(()),
        _ if machine.recorder.options.waits_are_over => {
            machine.recorder.note("waiting for the outside is taken as over at once", span);
            machine.recorder.stop();
            Ok(())
        }
        Value::Flag(false) => {
            fail(span, "this condition never becomes true, so the program waits for ever: take the line out")
        }
        Value::Outside(what) => {
            fail(span, format!("{}; or let waiting be over at once (`waits_are_over`)", depends(&what)))
        }
        other => fail(at, format!("a truth value is expected, this is {}", other.kind())),
    }
}

/// Whether the argument at a position is one of these names.
pub(super) fn is_name(arguments: &[Argument], position: usize, names: &[&str]) -> bool {
    matches!(positional(arguments, position), Some(Expr { kind: Kind::Name(name), .. }) if names.contains(&&**name))
}
