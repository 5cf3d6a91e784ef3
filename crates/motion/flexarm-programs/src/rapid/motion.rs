//! Moves (MoveAbsJ, MoveJ, MoveL, MoveC and their variants) and the settings that affect them.
//!
//! Start at [`motion`]. RAPID writes mm, degrees and quaternions; here m and rad. `X_WO` is the
//! pose of the work object in the world, `X_WB` with the program displacement in addition, `X_FT`
//! the tool on the flange. Not here: data types (`types`), other instructions (`mod.rs`), syntax
//! (`parse`).

use std::rc::Rc;

use flexarm_path::program::{Blend, Configuration, Move, MoveKind, Selection, Speed, Target};
use flexarm_settings::Place;
use flexarm_spatial::Pose;
use nalgebra::Translation3;

use super::functions::{pose_mm, position, rotation, typed};
use super::{Rapid, Rapids, types};
use crate::common::frames::quaternion;
use crate::common::machine::{Dialect, positional};
use crate::common::recorder::Sources;
use crate::common::tree::{Argument, Expr, Kind};
use crate::common::value::{Record, Value};
use crate::common::{Result, Span, fail};

/// Modal settings.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    check_joint_configuration: bool,
    check_line_configuration: bool,
    /// Fraction of the accelerations, initially 1.
    acceleration: f64,
    /// Acceleration along the path (m/s²).
    path_acceleration: Option<f64>,
    /// Fraction of the programmed speeds, initially 1.
    speed: f64,
    /// Maximum speed (m/s).
    largest_speed: Option<f64>,
    /// Program displacement in the object frame.
    displacement: Pose,
    circle: CircleOrientation,
}

/// Orientation mode on circles.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CircleOrientation {
    WithPath,
    InObject,
    ThroughPoint,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            check_joint_configuration: true,
            check_line_configuration: true,
            acceleration: 1.0,
            path_acceleration: None,
            speed: 1.0,
            largest_speed: None,
            displacement: Pose::identity(),
            circle: CircleOrientation::WithPath,
        }
    }
}

/// Positions of a move's arguments among the unnamed ones.
struct Places {
    circle_point: Option<usize>,
    target: usize,
    speed: usize,
    zone: usize,
    tool: usize,
}

fn places(name: &str) -> Option<Places> {
    let plain = |circle: bool, between: usize| {
        let first = usize::from(circle);
        Places {
            circle_point: circle.then_some(0),
            target: first,
            speed: first + 1,
            zone: first + 2 + between,
            tool: first + 3 + between,
        }
    };
    Some(match name {
        "moveabsj" | "movej" | "movel" | "movejdo" | "moveldo" | "movejao" | "movelao" | "movejgo" | "movelgo"
        | "movejsync" | "movelsync" => plain(false, 0),
        "movec" | "movecdo" | "movecao" | "movecgo" | "movecsync" => plain(true, 0),
        "triggj" | "triggl" => plain(false, 1),
        "triggc" => plain(true, 1),
        _ => return None,
    })
}

/// Runs a move; `false` if the instruction is not a move.
pub(super) fn motion(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<bool> {
    let Some(places) = places(name) else { return Ok(false) };
    // Options and variants that act on more than the path.
    for argument in arguments {
        match argument.name.as_deref() {
            Some("corr") => {
                return fail(
                    argument.span,
                    "corrections of the path by a sensor (\\Corr) are not simulated: take it out",
                );
            }
            Some("id") => machine.recorder.note("moves in step with other robots (\\ID) are run alone", span),
            _ => {}
        }
    }
    if name.ends_with("sync") {
        machine.recorder.note("routines that are called on the path (MoveLSync and the like) are not run", span);
    } else if !matches!(name, "moveabsj" | "movej" | "movel" | "movec") {
        machine.recorder.note("switching on the path is not simulated", span);
    }
    // Frames, target, speed and zone, then the move with the places of its literals.
    let (X_WO, X_FT) = frames(machine, arguments, places.tool, span)?;
    let X_WB = X_WO * machine.dialect.settings.displacement;
    let (value, at) = machine.argument(arguments, places.target, span)?;
    let value = value.known(at)?;
    let (kind, to) = match name {
        "moveabsj" => (MoveKind::Joint, joints(machine, value, at)?),
        _ => {
            let kind = match places.circle_point {
                Some(place) => arc(machine, arguments, place, span)?,
                None if name.starts_with("movej") || name == "triggj" => MoveKind::Joint,
                None => MoveKind::Line,
            };
            (kind.clone(), pose(machine, value, &kind, at)?)
        }
    };
    let speed = speed(machine, arguments, places.speed, span)?;
    let blend = zone(machine, arguments, places.zone, span)?;
    let step = Move { place: Place::default(), statement: String::new(), kind, to, X_WB, X_FT, speed, blend };
    let target = machine.argument_origin(arguments, places.target);
    let via = places.circle_point.and_then(|place| machine.argument_origin(arguments, place));
    machine.recorder.next = Sources { target, via };
    machine.recorder.add(step, span)?;
    Ok(true)
}

/// Object frame in the world, and the tool on the flange.
fn frames(
    machine: &mut Rapids<'_>,
    arguments: &[Argument],
    tool_at: usize,
    span: Span,
) -> Result<(Pose, Option<Pose>)> {
    let tool = match positional(arguments, tool_at) {
        Some(expression) => Some((machine.value(expression)?, expression.clone())),
        None => machine
            .named(arguments, "tool")?
            .map(|(value, at)| (value, Expr { kind: Kind::List(Vec::new()), span: at })),
    };
    let Some((tool, expression)) = tool else { return fail(span, "the tool is missing: put `tool0` for the flange") };
    let X_FT = match (&tool, &expression.kind) {
        (Value::Outside(_), Kind::Name(name)) => unknown_tool(machine, name, expression.span)?,
        _ => Some(tool_frame(machine, tool, expression.span)?),
    };
    let X_WO = match machine.named(arguments, "wobj")? {
        Some((value, at)) => object_frame(machine, value, at)?,
        None => Pose::identity(),
    };
    Ok((X_WO, X_FT))
}

/// A single tool that the files do not define is the robot's own.
fn unknown_tool(machine: &mut Rapids<'_>, name: &Rc<str>, span: Span) -> Result<Option<Pose>> {
    if let Some(other) = machine.dialect.unknown_tool.as_ref().filter(|other| *other != name) {
        return fail(
            span,
            format!(
                "neither the tool `{other}` nor `{name}` is in the files, so they cannot be told apart: give the module that has them \
                 (`companions`), or their tooldata as an option (`given`)"
            ),
        );
    }
    machine.dialect.unknown_tool = Some(name.clone());
    let text = format!("the tool `{name}` is not in the files: the robot's own tool centre point is taken");
    machine.recorder.note(&text, span);
    Ok(None)
}

fn flag(record: &Record, name: &str, span: Span) -> Result<bool> {
    record.get(name).map_or(Ok(false), |value| value.flag(span))
}

fn part(machine: &mut Rapids<'_>, record: &Record, name: &str, kind: &str, span: Span) -> Result<Rc<Record>> {
    let value = record.get(name).cloned().unwrap_or(Value::Nothing);
    typed(machine, kind, value, span)
}

/// Converts the translation of a pose from mm to m.
fn in_metres(mut X: Pose) -> Pose {
    X.translation = Translation3::from(X.translation.vector * 1e-3);
    X
}

fn tool_frame(machine: &mut Rapids<'_>, value: Value, span: Span) -> Result<Pose> {
    let tool = typed(machine, "tooldata", value, span)?;
    if !flag(&tool, "robhold", span)? {
        return fail(
            span,
            "this tool is stationary and the robot carries the work piece (robhold FALSE), which is not supported",
        );
    }
    let load = part(machine, &tool, "tload", "loaddata", span)?;
    if load.get("mass").and_then(|mass| mass.number(span).ok()).is_some_and(|mass| mass > 0.01) {
        machine.recorder.note_all("masses of tooldata are not taken: the robot has its own load");
    }
    Ok(in_metres(pose_mm(&*part(machine, &tool, "tframe", "pose", span)?, span)?))
}

fn object_frame(machine: &mut Rapids<'_>, value: Value, span: Span) -> Result<Pose> {
    let object = typed(machine, "wobjdata", value, span)?;
    if flag(&object, "robhold", span)? {
        return fail(
            span,
            "the robot carries this work object (robhold TRUE), which is not read: the tool must be on the robot",
        );
    }
    if !flag(&object, "ufprog", span)? {
        return fail(
            span,
            "this work object is moved by a mechanical unit (ufprog FALSE), which is not read: give its place as a fixed user frame",
        );
    }
    let user = pose_mm(&*part(machine, &object, "uframe", "pose", span)?, span)?;
    Ok(in_metres(user * pose_mm(&*part(machine, &object, "oframe", "pose", span)?, span)?))
}

/// Checks the values of external axes; 9E9 means not connected.
fn external(machine: &mut Rapids<'_>, target: &Record, span: Span) -> Result<()> {
    let Some(Value::Record(record)) = target.get("extax").cloned() else { return Ok(()) };
    let mut values = [None; 6];
    for (value, (_, field)) in values.iter_mut().zip(&record.fields) {
        *value = Some(field.number(span)?).filter(|number| number.abs() < 8.9e9);
    }
    machine.recorder.external_axes(values, span)
}

fn joints(machine: &mut Rapids<'_>, value: Value, span: Span) -> Result<Target> {
    let target = typed(machine, "jointtarget", value, span)?;
    external(machine, &target, span)?;
    let axes = part(machine, &target, "robax", "robjoint", span)?;
    let values: Vec<f64> = axes.fields.iter().map(|(_, value)| value.number(span)).collect::<Result<_>>()?;
    // Arms with four axes have 9E9 for the missing ones.
    let count = values.iter().rposition(|value| value.abs() < 8.9e9).map_or(0, |last| last + 1);
    if count == 0 || values[..count].iter().any(|value| value.abs() > 8.9e9) {
        return fail(span, "an axis has the value 9E9, which is none: write the angle of each axis in degrees");
    }
    Ok(Target::Joints(values[..count].iter().map(|value| value.to_radians()).collect()))
}

fn pose(machine: &mut Rapids<'_>, value: Value, kind: &MoveKind, span: Span) -> Result<Target> {
    let target = typed(machine, "robtarget", value, span)?;
    external(machine, &target, span)?;
    let X_BT = in_metres(pose_mm(&target, span)?);
    let settings = &machine.dialect.settings;
    let is_checked = match kind {
        MoveKind::Joint => settings.check_joint_configuration,
        _ => settings.check_line_configuration,
    };
    let configuration = match target.get("robconf") {
        Some(Value::Record(conf))
            if is_checked && conf.fields.iter().all(|(_, value)| !matches!(value, Value::Nothing)) =>
        {
            let mut numbers = [0; 4];
            for (number, (_, value)) in numbers.iter_mut().zip(&conf.fields) {
                let count = value.count(span)?;
                *number = i32::try_from(count)
                    .or_else(|_| fail(span, format!("confdata has {count}, expected quarter turns of an axis")))?;
            }
            Configuration::Selected(Selection::Abb { quadrants: [numbers[0], numbers[1], numbers[2]], cfx: numbers[3] })
        }
        _ => Configuration::NEAREST,
    };
    Ok(Target::Pose { X_BT, configuration })
}

fn arc(machine: &mut Rapids<'_>, arguments: &[Argument], place: usize, span: Span) -> Result<MoveKind> {
    let (value, at) = machine.argument(arguments, place, span)?;
    let point = typed(machine, "robtarget", value, at)?;
    let via = position(point.get("trans"), at)? * 1e-3;
    let mode = machine.dialect.settings.circle;
    let via_rotation = match mode {
        CircleOrientation::ThroughPoint => Some(rotation(point.get("rot"), at)?),
        _ => None,
    };
    Ok(MoveKind::Arc { via, via_rotation, angle: None, turns_with_path: mode == CircleOrientation::WithPath })
}

fn speed(machine: &mut Rapids<'_>, arguments: &[Argument], place: usize, span: Span) -> Result<Speed> {
    let (value, at) = machine.argument(arguments, place, span)?;
    let data = typed(machine, "speeddata", value, at)?;
    let number = |name: &str| data.get(name).map_or(Ok(0.0), |value| value.number(at));
    let (mut linear, angular) = (number("v_tcp")? * 1e-3, number("v_ori")?.to_radians());
    if let Some((value, at)) = machine.named(arguments, "v")? {
        linear = value.number(at)? * 1e-3;
    }
    let duration_s = machine.named(arguments, "t")?.map(|(value, at)| value.number(at)).transpose()?;
    let settings = &machine.dialect.settings;
    linear *= settings.speed;
    if let Some(largest) = settings.largest_speed {
        linear = linear.min(largest);
    }
    let acceleration = Some(settings.acceleration).filter(|part| *part < 1.0);
    Ok(Speed {
        linear_m_s: Some(linear),
        linear_m_s2: settings.path_acceleration,
        angular_rad_s: Some(angular * settings.speed),
        joint_acceleration_fraction: acceleration,
        duration_s,
        ..Speed::default()
    })
}

fn zone(machine: &mut Rapids<'_>, arguments: &[Argument], place: usize, span: Span) -> Result<Blend> {
    let (value, at) = machine.argument(arguments, place, span)?;
    let data = typed(machine, "zonedata", value, at)?;
    if let Some((value, at)) = machine.named(arguments, "z")? {
        return Ok(Blend::Distance(value.number(at)? * 1e-3));
    }
    if flag(&data, "finep", at)? {
        return Ok(Blend::Stop);
    }
    let number = |name: &str| data.get(name).map_or(Ok(0.0), |value| value.number(at));
    let (tcp, orientation) = (number("pzone_tcp")?, number("pzone_ori")?);
    if orientation > tcp {
        machine.recorder.note_all(
            "orientations are blended within the zones of the tool centre point; the larger pzone_ori is not taken",
        );
    }
    Ok(if tcp > 0.0 { Blend::Distance(tcp * 1e-3) } else { Blend::Pass })
}

/// Whether the switch is present.
fn has(arguments: &[Argument], name: &str) -> bool {
    arguments.iter().any(|argument| argument.name.as_deref() == Some(name))
}

/// Runs an instruction that affects later moves; `false` if it is not one.
pub(super) fn setting(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<bool> {
    // Settings that are kept until they are set again, then instructions that are not simulated.
    match name {
        "confj" => machine.dialect.settings.check_joint_configuration = !has(arguments, "off"),
        "confl" => machine.dialect.settings.check_line_configuration = !has(arguments, "off"),
        "singarea" => {
            if has(arguments, "wrist") {
                machine
                    .recorder
                    .note("the orientation is kept near singularities, where SingArea \\Wrist would change it", span);
            } else if !has(arguments, "off") {
                return fail(span, "only SingArea \\Off and \\Wrist are read: take the line out");
            }
        }
        "accset" => acceleration_fraction(machine, arguments, span)?,
        "velset" => {
            let (percent, largest) = (machine.number(arguments, 0, span)?, machine.number(arguments, 1, span)?);
            if !(percent > 0.0 && percent <= 100.0 && largest > 0.0) {
                return fail(span, "VelSet needs a percentage from 1 to 100 and a speed in mm/s");
            }
            machine.dialect.settings.speed = percent / 100.0;
            machine.dialect.settings.largest_speed = Some(largest * 1e-3);
        }
        "pathacclim" | "worldacclim" => return acceleration_limit(machine, name, arguments, span).map(|()| true),
        "pdispset" => {
            let (value, at) = machine.argument(arguments, 0, span)?;
            let displacement = typed(machine, "pose", value, at)?;
            machine.dialect.settings.displacement = in_metres(pose_mm(&displacement, at)?);
        }
        "pdispoff" => machine.dialect.settings.displacement = Pose::identity(),
        "cirpathmode" => machine.dialect.settings.circle = circle_orientation(arguments, span)?,
        "pathresol" | "sim" => machine.recorder.note("the resolution of the controller's path is not simulated", span),
        "softact" | "pdispon" | "eoffson" | "eoffsset" | "searchl" | "searchc" | "searchj" | "moveextj"
        | "stopmove" | "startmove" | "storepath" | "restopath" | "corrcon" | "corrwrite" | "contactl"
        | "egmrunjoint" | "egmrunpose" | "load" => {
            return fail(
                span,
                "this instruction changes the motion by data outside the program, which is not simulated: remove it",
            );
        }
        "syncmoveon" => machine.recorder.note("moves in step with other robots (\\ID) are run alone", span),
        "syncmoveoff" => {}
        _ => return Ok(false),
    }
    Ok(true)
}

/// Runs `AccSet`: a fraction of the accelerations.
fn acceleration_fraction(machine: &mut Rapids<'_>, arguments: &[Argument], span: Span) -> Result<()> {
    let (acceleration, ramp) = (machine.number(arguments, 0, span)?, machine.number(arguments, 1, span)?);
    if ramp < 100.0 {
        machine
            .recorder
            .note("ramps of accelerations (AccSet) are not taken: the robot's limits of the jerk rule", span);
    }
    machine.dialect.settings.acceleration = acceleration.clamp(20.0, 100.0) / 100.0;
    Ok(())
}

/// Reads the mode of `CirPathMode`.
fn circle_orientation(arguments: &[Argument], span: Span) -> Result<CircleOrientation> {
    match arguments.first().and_then(|argument| argument.name.as_deref()) {
        Some("pathframe") | None => Ok(CircleOrientation::WithPath),
        Some("objectframe") => Ok(CircleOrientation::InObject),
        Some("cirpointori") => Ok(CircleOrientation::ThroughPoint),
        Some(other) => {
            fail(span, format!("CirPathMode \\{other} is not read: \\PathFrame, \\ObjectFrame and \\CirPointOri are"))
        }
    }
}

fn acceleration_limit(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<()> {
    let mut limit: Option<f64> = None;
    let mut add = |value: f64| limit = Some(limit.map_or(value, |old| old.min(value)));
    if name == "worldacclim" {
        if let Some((value, at)) = machine.named(arguments, "on")? {
            add(value.number(at)?);
        }
    } else {
        for word in ["accmax", "decelmax"] {
            if let Some((value, at)) = machine.named(arguments, word)? {
                add(value.number(at)?);
            }
        }
    }
    if limit.is_some_and(|limit: f64| limit.is_nan() || limit <= 0.0) {
        return fail(span, "a limit of the acceleration is above 0 m/s2");
    }
    machine.dialect.settings.path_acceleration = limit;
    Ok(())
}

/// Current position of the robot as a target, if it is known from earlier moves.
pub(super) fn current_target(
    machine: &mut Rapids<'_>,
    name: &str,
    arguments: &[Argument],
    span: Span,
) -> Result<Value> {
    let X_FT = match machine.named(arguments, "tool")? {
        Some((value, at)) => Some(tool_frame(machine, value, at)?),
        None => Some(Pose::identity()),
    };
    let X_WO = match machine.named(arguments, "wobj")? {
        Some((value, at)) => object_frame(machine, value, at)?,
        None => Pose::identity(),
    };
    let X_WB = X_WO * machine.dialect.settings.displacement;
    let Ok(X_BT) = machine.recorder.pose(&X_WB, &X_FT, span) else {
        return Ok(Value::Outside(format!("`{name}(...)`, where the robot is").into()));
    };
    let p = X_BT.translation.vector * 1e3;
    let place = Value::list([p.x, p.y, p.z].map(Value::Number).to_vec());
    if name == "cpos" {
        return Rapid::coerce(machine, "pos", place, span);
    }
    let turn = Value::list(quaternion(&X_BT.rotation).map(Value::Number).to_vec());
    types::coerce(&Default::default(), "robtarget", Value::list(vec![place, turn]), span, 0)
}
