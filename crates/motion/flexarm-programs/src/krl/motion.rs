//! Moves: PTP, LIN, CIRC, their relative and spline forms, and SPLINE blocks.
//!
//! Start at [`motion`]: it reads the target ([`target`]), the frames in force ([`frames`]), speeds
//! and blend, and adds one [`Move`]. KRL writes mm and degrees, angles A, B, C about z, y, x; here
//! m and rad. `X_WB` is the pose of `$BASE` in the world, `X_FT` that of `$TOOL` on the flange,
//! `X_BT` a target. Not here: system variables and inline forms (`system`, `bas`), syntax
//! (`parse`).

use flexarm_path::ToolCurve;
use flexarm_path::program::{Blend, Configuration, Move, MoveKind, Selection, Speed, Target};
use flexarm_settings::Place;
use flexarm_spatial::Pose;
use nalgebra::Vector3;

use super::system::{CARTESIAN, Krls, frame_of, set_axes, tool_data, unknown_tool_number};
use crate::common::frames::{Circle, mm_deg_zyx, pose_zyx_mm_deg};
use crate::common::machine::{Flow, positional};
use crate::common::recorder::Sources;
use crate::common::tree::{Argument, Expr, Kind, Operator, Statement};
use crate::common::value::{Record, Value, depends};
use crate::common::{Result, Span, fail};

const AXES: [&str; 6] = ["a1", "a2", "a3", "a4", "a5", "a6"];
/// Minimum number of axes of a first target.
const FEWEST_AXES: usize = 4;
const EXTERNAL: [&str; 6] = ["e1", "e2", "e3", "e4", "e5", "e6"];

/// Converts axis values in rad to KRL's aggregate in degrees.
pub(super) fn axes_value(joints: &[f64]) -> Value {
    let fields = AXES.iter().zip(joints).map(|(name, joint)| (*name, Value::Number(joint.to_degrees()))).collect();
    Value::record("axis", fields)
}

/// Runs a motion instruction.
pub(super) fn motion(machine: &mut Krls<'_>, word: &str, arguments: &[Argument], span: Span) -> Result<()> {
    let to_itself = ["$axis_act", "$pos_act", "$axis_for", "$pos_for", "xact"];
    if matches!(word, "ptp" | "sptp") && is_name(arguments, 0, &to_itself) {
        machine.recorder.note("a move to where the robot already is (block coincidence) is passed", span);
        return Ok(());
    }
    if word == "asyptp" {
        return fail(span, "external axes that move by themselves (ASYPTP) are not simulated: take the line out");
    }
    with_settings(machine, arguments, |machine| make(machine, word, arguments, span))
}

/// Runs `inner` with the assignments of WITH in force, and restores the old values.
fn with_settings<T>(
    machine: &mut Krls<'_>,
    arguments: &[Argument],
    inner: impl FnOnce(&mut Krls<'_>) -> Result<T>,
) -> Result<T> {
    let mut before = Vec::new();
    for argument in arguments.iter().filter(|argument| argument.name.as_deref() == Some("with")) {
        let Some(Expr { kind: Kind::Binary(Operator::Equal, place, value), .. }) = &argument.value else { continue };
        let root = root_name(place);
        if let Some(old) = machine.globals.get(root).cloned() {
            before.push((root.to_owned(), old));
        }
        let value = machine.value(value)?;
        match (root, &place.kind) {
            // A value for one axis applies to all axes here.
            ("$vel_axis" | "$acc_axis", Kind::Index(..)) => {
                let percent = value.number(argument.span)?;
                set_axes(machine, root, percent);
            }
            _ => machine.assign(place, value)?,
        }
    }
    let result = inner(machine);
    for (name, old) in before.into_iter().rev() {
        machine.globals.insert(name.as_str().into(), old);
    }
    result
}

fn root_name(place: &Expr) -> &str {
    match &place.kind {
        Kind::Name(name) => name,
        Kind::Field(base, _) | Kind::Index(base, _) => root_name(base),
        _ => "",
    }
}

fn has(arguments: &[Argument], word: &str) -> bool {
    arguments.iter().any(|argument| argument.name.as_deref() == Some(word))
}

/// `X_WB` of `$BASE` and `X_FT` of `$TOOL`; an undefined tool is the robot's own.
pub(super) fn frames(machine: &mut Krls<'_>, span: Span) -> Result<(Pose, Option<Pose>)> {
    let frame = |machine: &Krls<'_>, name: &str| -> Result<Option<Pose>> {
        match machine.global(name) {
            None | Some(Value::Nothing) => Ok(None),
            Some(Value::Outside(what)) => fail(span, format!("{} {}", name.to_uppercase(), depends(what))),
            Some(value) => match frame_of(value, span)? {
                Some(parts) => Ok(Some(pose_zyx_mm_deg(parts))),
                None => fail(span, format!("{} is {}, a frame is expected", name.to_uppercase(), value.kind())),
            },
        }
    };
    // A tool of the controller that the files do not hold is looked up by its number.
    if let Some(Value::Outside(what)) = machine.global("$tool")
        && let Some(number) = unknown_tool_number(what)
    {
        let value = tool_data(machine, number, span)?;
        machine.set_global("$tool", value);
    }
    let base = frame(machine, "$base")?;
    let tool = frame(machine, "$tool")?;
    if base.is_none() {
        machine.recorder.note_all("no $BASE is set where the first moves are: the world of the controller is taken");
    }
    if tool.is_none() && machine.dialect.unknown_tool.is_none() {
        machine
            .recorder
            .note_all("no $TOOL is set where the first moves are: the robot's own tool centre point is taken");
    }
    // $BASE is relative to the world of the cell, in which $ROBROOT places the robot.
    let root = frame(machine, "$robroot")?.unwrap_or_else(Pose::identity);
    let base = base.unwrap_or_else(Pose::identity);
    let X_WB = if root == Pose::identity() { base } else { root.inverse() * base };
    Ok((X_WB, tool))
}

/// Adds one move with the current settings.
fn make(machine: &mut Krls<'_>, word: &str, arguments: &[Argument], span: Span) -> Result<()> {
    if matches!(machine.global("$ipo_mode"), Some(Value::Word(mode)) if &**mode == "tcp") {
        return fail(
            span,
            "the robot guides the work piece here ($IPO_MODE = #TCP), which is not read: program the tool with #BASE",
        );
    }
    // Frames, speeds, and the target with the kind of the move.
    let (stem, is_relative) = match word.strip_suffix("_rel") {
        Some(stem) => (stem, true),
        None => (word, false),
    };
    let (X_WB, X_FT) = frames(machine, span)?;
    let context = Context { X_WB, X_FT, in_tool: has(arguments, "#tool"), is_relative };
    let is_joint = matches!(stem, "ptp" | "sptp");
    let speed = if is_joint { joint_speed(machine, span)? } else { path_speed(machine, span)? };
    let (kind, to) = match stem {
        "ptp" | "sptp" => (MoveKind::Joint, target(machine, &context, arguments, 0, span)?),
        "lin" | "slin" => {
            let to = target(machine, &context, arguments, 0, span)?;
            (MoveKind::Line, oriented(machine, &context, to, None, span)?)
        }
        "spl" if machine.dialect.in_spline => (MoveKind::Spline, target(machine, &context, arguments, 0, span)?),
        "spl" => return fail(span, "SPL is allowed in a SPLINE block only: put SPLINE before and ENDSPLINE after it"),
        _ => arc(machine, &context, arguments, span)?,
    };
    if !is_joint && matches!(to, Target::Joints(_)) {
        return fail(span, "a path needs a target with X, Y, Z; axis values (A1...) are for PTP");
    }
    // Knots of a spline are passed; other moves stop or blend by the words after the target.
    let blend = if machine.dialect.in_spline { Blend::Pass } else { blend(machine, arguments, span)? };
    let end = end_of_arc(machine, &context, &kind, &to, span);
    let step = Move { place: Place::default(), statement: String::new(), kind, to, X_WB, X_FT, speed, blend };
    machine.recorder.next = sources(machine, arguments, &context, &step);
    machine.recorder.add(step, span)?;
    if let Some(X_BT) = end {
        machine.recorder.now_at(X_WB, X_FT, X_BT);
    }
    Ok(())
}

/// Spans of the literals of a move; none if its target depends on others.
fn sources(machine: &mut Krls<'_>, arguments: &[Argument], context: &Context, step: &Move) -> Sources {
    let constant = matches!(machine.global("$ori_type"), Some(Value::Word(word)) if &**word == "constant");
    let joint = step.kind == MoveKind::Joint;
    match &step.kind {
        _ if context.is_relative || (constant && !joint) => Sources::default(),
        MoveKind::Arc { angle: Some(_), .. } => Sources::default(),
        MoveKind::Arc { .. } => {
            Sources { target: machine.argument_origin(arguments, 1), via: machine.argument_origin(arguments, 0) }
        }
        _ => Sources { target: machine.argument_origin(arguments, 0), via: None },
    }
}

/// Frames of a move, and the interpretation of its targets.
struct Context {
    X_WB: Pose,
    X_FT: Option<Pose>,
    in_tool: bool,
    is_relative: bool,
}

/// Target at a position of the arguments.
fn target(
    machine: &mut Krls<'_>,
    context: &Context,
    arguments: &[Argument],
    position: usize,
    span: Span,
) -> Result<Target> {
    let (value, at) = machine.argument(arguments, position, span)?;
    let value = value.known(at)?;
    let Value::Record(record) = &value else {
        return fail(
            at,
            format!(
                "a target such as {{X 1000, Y 0, Z 500}} or {{A1 0, A2 -90}} is expected, this is {}",
                value.kind()
            ),
        );
    };
    let read = |names: &[&str; 6]| -> Result<[Option<f64>; 6]> {
        let mut parts = [None; 6];
        for (part, name) in parts.iter_mut().zip(names) {
            match record.get(name) {
                None | Some(Value::Nothing) => {}
                Some(value) => *part = Some(value.number(at)?),
            }
        }
        Ok(parts)
    };
    // External axes must stay; then either axis values or a pose.
    let external = read(&EXTERNAL)?;
    if context.is_relative {
        if external.iter().flatten().any(|value| *value != 0.0) {
            return fail(at, "external axes move here (E1...); only the axes of the arm are moved: take them out");
        }
    } else {
        machine.recorder.external_axes(external, at)?;
    }
    let (axes, frame) = (read(&AXES)?, read(&CARTESIAN)?);
    if axes.iter().any(Option::is_some) {
        return joints(machine, context, axes, at);
    }
    if frame.iter().all(Option::is_none) && external.iter().all(Option::is_none) {
        return fail(at, "the target gives no coordinate: X, Y, Z, A, B, C or A1 to A6 are expected");
    }
    let X_BT = pose(machine, context, frame, at)?;
    Ok(Target::Pose { X_BT, configuration: configuration(record, at)? })
}

/// Axis values; omitted ones are kept.
fn joints(machine: &mut Krls<'_>, context: &Context, axes: [Option<f64>; 6], span: Span) -> Result<Target> {
    let given = axes.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    let before = machine.recorder.joints().map(<[f64]>::to_vec);
    // Arms with fewer than six axes have fewer values.
    let count = before.as_ref().map_or(FEWEST_AXES, Vec::len).max(given);
    let mut joints = Vec::with_capacity(count);
    for k in 0..count {
        let old = before.as_ref().and_then(|before| before.get(k)).copied();
        let value = axes.get(k).copied().flatten().map(f64::to_radians);
        joints.push(match (value, old, context.is_relative) {
            (Some(value), Some(old), true) => old + value,
            (Some(value), _, false) => value,
            (None, Some(old), _) => old,
            _ => {
                return fail(
                    span,
                    format!("axis {} stays or moves on, but the position before was not given in axis values: write A1 to A6 of a PTP", k + 1),
                );
            }
        });
    }
    Ok(Target::Joints(joints))
}

/// Pose in the base; omitted components are kept.
fn pose(machine: &mut Krls<'_>, context: &Context, given: [Option<f64>; 6], span: Span) -> Result<Pose> {
    if context.is_relative {
        let change = given.map(|value| value.unwrap_or(0.0));
        let X_BT = machine.recorder.pose(&context.X_WB, &context.X_FT, span)?;
        return moved_by(X_BT, change, context.in_tool, span);
    }
    if given.iter().all(Option::is_some) {
        return Ok(pose_zyx_mm_deg(given.map(|value| value.unwrap_or(0.0))));
    }
    let mut parts = mm_deg_zyx(&machine.recorder.pose(&context.X_WB, &context.X_FT, span)?);
    for (part, value) in parts.iter_mut().zip(given) {
        *part = value.unwrap_or(*part);
    }
    Ok(pose_zyx_mm_deg(parts))
}

/// Relative move along and about the axes of the base, or of the tool.
fn moved_by(X_BT: Pose, change: [f64; 6], in_tool: bool, span: Span) -> Result<Pose> {
    if in_tool {
        return Ok(X_BT * pose_zyx_mm_deg(change));
    }
    if change[4] != 0.0 || change[5] != 0.0 {
        return fail(
            span,
            "a relative turn by B or C in the base is understood in two ways by controllers: write the full target, or turn in the tool (#TOOL)",
        );
    }
    let turn = pose_zyx_mm_deg([0.0, 0.0, 0.0, change[3], 0.0, 0.0]).rotation;
    let mut X = Pose::from_parts(X_BT.translation, turn * X_BT.rotation);
    X.translation.vector += Vector3::new(change[0], change[1], change[2]) * 1e-3;
    Ok(X)
}

fn configuration(record: &Record, span: Span) -> Result<Configuration> {
    let bits = |name: &str| match record.get(name) {
        None | Some(Value::Nothing) => Ok(None),
        Some(value) => match u8::try_from(value.count(span)?) {
            Ok(bits) => Ok(Some(bits)),
            Err(_) => fail(span, format!("{} is from 0 to 63", name.to_uppercase())),
        },
    };
    let (status, turn) = (bits("s")?, bits("t")?);
    Ok(if status.is_none() && turn.is_none() {
        Configuration::NEAREST
    } else {
        Configuration::Selected(Selection::Kuka { status, turn })
    })
}

/// Applies `$ORI_TYPE` to the orientation at the end of a path; `turned` is the rotation due to
/// following the path.
fn oriented(
    machine: &mut Krls<'_>,
    context: &Context,
    to: Target,
    turned: Option<nalgebra::Rotation3<f64>>,
    span: Span,
) -> Result<Target> {
    let word = match machine.global("$ori_type") {
        Some(Value::Word(word)) => word.clone(),
        _ => "var".into(),
    };
    match (&*word, to) {
        ("constant", Target::Pose { X_BT, configuration }) => {
            let before = machine.recorder.pose(&context.X_WB, &context.X_FT, span)?.rotation;
            let rotation = turned.map_or(before, |turned| turned * before);
            Ok(Target::Pose { X_BT: Pose::from_parts(X_BT.translation, rotation), configuration })
        }
        ("var" | "constant", to) => Ok(to),
        (other, _) => fail(
            span,
            format!(
                "$ORI_TYPE = #{} is not read: set #VAR, by which the orientation turns evenly",
                other.to_uppercase()
            ),
        ),
    }
}

/// Reads `CIRC via, target, CA angle`.
fn arc(machine: &mut Krls<'_>, context: &Context, arguments: &[Argument], span: Span) -> Result<(MoveKind, Target)> {
    let via = target_point(machine, context, arguments, span)?;
    let to = target(machine, context, arguments, 1, span)?;
    let angle = match machine.named(arguments, "ca")? {
        Some((value, at)) => Some(value.number(at)?.to_radians()),
        None => None,
    };
    let turns_with_path = matches!(machine.global("$circ_type"), Some(Value::Word(word)) if &**word == "path");
    let is_constant = matches!(machine.global("$ori_type"), Some(Value::Word(word)) if &**word == "constant");
    let turned = match &to {
        Target::Pose { X_BT, .. } if turns_with_path && is_constant => {
            let start = machine.recorder.pose(&context.X_WB, &context.X_FT, span)?.translation.vector;
            let Some(circle) = Circle::through(start, via, X_BT.translation.vector) else {
                return fail(
                    span,
                    "start, auxiliary point and target are on a line or at one place: they must make a circle",
                );
            };
            Some(circle.turn(circle.angle))
        }
        _ => None,
    };
    let to = oriented(machine, context, to, turned, span)?;
    Ok((MoveKind::Arc { via, via_rotation: None, angle, turns_with_path }, to))
}

/// Auxiliary point of a circle; omitted coordinates are those of the start.
fn target_point(machine: &mut Krls<'_>, context: &Context, arguments: &[Argument], span: Span) -> Result<Vector3<f64>> {
    let (value, at) = machine.argument(arguments, 0, span)?;
    let value = value.known(at)?;
    let Value::Record(record) = &value else {
        return fail(at, format!("an auxiliary point with X, Y, Z is expected, this is {}", value.kind()));
    };
    let mut given = [None; 6];
    for (part, name) in given.iter_mut().zip(&CARTESIAN[..3]) {
        if let Some(value) = record.get(name).filter(|value| !matches!(value, Value::Nothing)) {
            *part = Some(value.number(at)?);
        }
    }
    if given.iter().all(Option::is_none) {
        return fail(at, "an auxiliary point with X, Y, Z is expected");
    }
    if !context.is_relative && given[..3].iter().all(Option::is_some) {
        return Ok(Vector3::new(given[0].unwrap_or(0.0), given[1].unwrap_or(0.0), given[2].unwrap_or(0.0)) * 1e-3);
    }
    Ok(pose(machine, context, given, at)?.translation.vector)
}

/// End of an arc with a given angle, if its start is known.
fn end_of_arc(machine: &Krls<'_>, context: &Context, kind: &MoveKind, to: &Target, span: Span) -> Option<Pose> {
    let MoveKind::Arc { via, angle: angle @ Some(_), turns_with_path, .. } = kind else { return None };
    let Target::Pose { X_BT, .. } = to else { return None };
    let start = machine.recorder.pose(&context.X_WB, &context.X_FT, span).ok()?;
    let arc = ToolCurve::arc(&start, via, None, X_BT, *angle, *turns_with_path).ok()?;
    Some(arc.at(arc.length()).X)
}

/// Number of a component of a system variable, if it is set.
fn setting(machine: &Krls<'_>, name: &str, part: &str, span: Span) -> Result<Option<f64>> {
    let value = match machine.global(name) {
        Some(Value::Record(record)) => record.get(part).cloned(),
        Some(Value::Outside(what)) => return fail(span, format!("{} {}", name.to_uppercase(), depends(what))),
        _ => None,
    };
    match value {
        None | Some(Value::Nothing) => Ok(None),
        Some(Value::Outside(what)) => {
            fail(span, format!("{}.{} {}", name.to_uppercase(), part.to_uppercase(), depends(&what)))
        }
        Some(value) => value.number(span).map(Some),
    }
}

/// `$OV_PRO` as a fraction.
fn overriding(machine: &Krls<'_>, span: Span) -> Result<f64> {
    let percent = match machine.global("$ov_pro") {
        Some(value) => value.number(span)?,
        None => 100.0,
    };
    if !(percent > 0.0 && percent <= 100.0) {
        return fail(
            span,
            format!("$OV_PRO is {percent}; with it the robot does not move as programmed: set 1 to 100"),
        );
    }
    Ok(percent / 100.0)
}

/// Common percentage of all axes, as a fraction.
fn of_axes(machine: &Krls<'_>, name: &str, span: Span) -> Result<Option<f64>> {
    let Some(Value::List(values)) = machine.global(name) else { return Ok(None) };
    let mut percents = [100.0; 6];
    for (percent, value) in percents.iter_mut().zip(values.iter()) {
        if !matches!(value, Value::Nothing) {
            *percent = value.number(span)?;
        }
    }
    if values.iter().all(|value| matches!(value, Value::Nothing)) {
        return Ok(None);
    }
    if percents.iter().any(|percent| *percent != percents[0]) {
        return fail(
            span,
            format!(
                "{}[] differs between the axes ({percents:?}): one percentage for all six is read",
                name.to_uppercase()
            ),
        );
    }
    if !(percents[0] > 0.0 && percents[0] <= 100.0) {
        return fail(span, format!("{}[] is {} %: 1 to 100 is expected", name.to_uppercase(), percents[0]));
    }
    Ok(Some(percents[0] / 100.0))
}

fn joint_speed(machine: &Krls<'_>, span: Span) -> Result<Speed> {
    let part = overriding(machine, span)?;
    let speed = of_axes(machine, "$vel_axis", span)?;
    let joint_fraction = speed.map(|speed| speed * part).or((part < 1.0).then_some(part));
    Ok(Speed { joint_fraction, joint_acceleration_fraction: of_axes(machine, "$acc_axis", span)?, ..Speed::default() })
}

fn path_speed(machine: &mut Krls<'_>, span: Span) -> Result<Speed> {
    let part = overriding(machine, span)?;
    let smaller = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
    let linear = setting(machine, "$vel", "cp", span)?;
    if linear.is_none() {
        machine.recorder.note("no path speed ($VEL.CP) is set: the robot's limits rule", span);
        if part < 1.0 {
            return fail(span, "$OV_PRO slows the path speed, which is not set: set $VEL.CP");
        }
    }
    let turning = smaller(setting(machine, "$vel", "ori1", span)?, setting(machine, "$vel", "ori2", span)?);
    let turning_up = smaller(setting(machine, "$acc", "ori1", span)?, setting(machine, "$acc", "ori2", span)?);
    Ok(Speed {
        linear_m_s: linear.map(|speed| speed * part),
        linear_m_s2: setting(machine, "$acc", "cp", span)?,
        angular_rad_s: turning.map(|speed| speed.to_radians() * part),
        angular_rad_s2: turning_up.map(f64::to_radians),
        ..Speed::default()
    })
}

/// Blend given by the words after a target; the last one applies, as in `C_PTP C_DIS`, whose second
/// word is for a path after a PTP.
fn blend(machine: &mut Krls<'_>, arguments: &[Argument], span: Span) -> Result<Blend> {
    let mut result = Blend::Stop;
    for argument in arguments {
        let Some(word) = argument.name.as_deref() else { continue };
        // Component of $APO that the word refers to, and the blend of its value.
        let (part, make): (&str, fn(f64) -> Blend) = match word {
            "c_ptp" => ("cptp", |percent| Blend::Fraction(percent / 200.0)),
            "c_dis" | "c_spl" => ("cdis", |mm| Blend::Distance(mm / 1000.0)),
            "c_vel" => ("cvel", |percent| Blend::Velocity(percent / 100.0)),
            "c_ori" => ("cori", |degrees| Blend::Orientation(degrees.to_radians())),
            "with" | "ca" | "#base" | "#tool" => continue,
            other => return fail(argument.span, format!("`{}` behind a target is not known", other.to_uppercase())),
        };
        let Some(value) = setting(machine, "$apo", part, span)? else {
            let text = format!(
                "{} has no effect: $APO.{} is not set before and is 0 then",
                word.to_uppercase(),
                part.to_uppercase()
            );
            machine.recorder.note(&text, span);
            continue;
        };
        if value < 0.0 || (matches!(word, "c_ptp" | "c_vel") && value > 100.0) {
            return fail(
                argument.span,
                format!("$APO.{} is {value}, which is outside of its range", part.to_uppercase()),
            );
        }
        result = if value == 0.0 { Blend::Stop } else { make(value) };
    }
    Ok(result)
}

/// Runs `SPLINE ... ENDSPLINE`.
pub(super) fn spline(machine: &mut Krls<'_>, arguments: &[Argument], body: &[Statement], span: Span) -> Result<Flow> {
    let first = machine.recorder.items.len();
    let (flow, blend) = with_settings(machine, arguments, |machine| {
        machine.dialect.in_spline = true;
        let flow = machine.run(body);
        machine.dialect.in_spline = false;
        Ok((flow?, blend(machine, arguments, span)?))
    })?;
    if let Some(flexarm_path::program::Item::Move(last)) = machine.recorder.items[first..].last_mut() {
        last.blend = blend;
    }
    Ok(flow)
}

/// Whether the argument at a position is one of these names.
fn is_name(arguments: &[Argument], position: usize, names: &[&str]) -> bool {
    matches!(positional(arguments, position), Some(Expr { kind: Kind::Name(name), .. }) if names.contains(&&**name))
}
