//! Universal Robots' URScript.
//!
//! [`parse`] converts text to statements, [`functions`] implements the functions, this module the
//! moves.
//!
//! Poses are m and rotation vectors in rad, in the robot's base; T is set by `set_tcp` on the
//! flange F.
//!
//! Not here: threads, sensors, and set points streamed from outside, which are refused.

mod functions;
mod parse;

use std::rc::Rc;

use flexarm_path::program::{Blend, Configuration, Item, Move, MoveKind, Speed, Target};
use flexarm_settings::Place;
use flexarm_spatial::Pose;

use crate::common::frames::{Circle, pose_rotation_vector, rotation_vector_of};
use crate::common::machine::{Dialect, Flow, Machine, positional};
use crate::common::recorder::{Recorded, Recorder};
use crate::common::tree::{Argument, Operator};
use crate::common::value::{Value, depends};
use crate::common::{Result, Span, Text, fail, is_among};
use crate::{ReadOptions, decode, given_text};

/// URScript state in addition to variables.
pub(crate) struct UrScript {
    X_FT: Option<Pose>,
}

type UrScripts<'a> = Machine<'a, UrScript>;

pub(crate) fn read(texts: &mut Vec<Text>, options: &ReadOptions<'_>) -> Result<Recorded> {
    let mut unit = parse::parse(&texts[0], 0)?;
    for (path, bytes) in &options.companions {
        texts.push(Text::new(path, &decode(bytes)));
        unit.routines.extend(parse::parse(&texts[texts.len() - 1], texts.len() - 1)?.routines);
    }
    texts.push(given_text(options, "=", ""));
    let given = parse::parse(&texts[texts.len() - 1], texts.len() - 1)?;
    let mut machine = Machine::new(Recorder::new(options, texts.clone()), UrScript { X_FT: None });
    machine.recorder.note_files();
    machine.run(&given.main)?;
    let path = texts[0].path.clone();
    let mut name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let outer: Vec<Rc<str>> =
        unit.routines.iter().filter(|(_, depth)| *depth == 0).map(|(routine, _)| routine.name.clone()).collect();
    machine.add(unit.routines.into_iter().map(|(routine, _)| routine));
    let flow = machine.run(&unit.main)?;
    let is_called = machine.recorder.items.iter().any(|item| matches!(item, Item::Move(_)));
    let entry = match &options.entry {
        Some(entry) => Some(entry.as_str().into()),
        None if is_called || flow == Flow::Halt => None,
        // A controller runs the only definition that it receives.
        None => {
            outer.iter().find(|routine| ***routine == *name).or(outer.first().filter(|_| outer.len() == 1)).cloned()
        }
    };
    if let Some(entry) = entry {
        let Some(routine) = machine.routines.get(&entry).cloned() else {
            return fail(Span::default(), format!("there is no definition `{entry}` in this file"));
        };
        machine.invoke(&routine, &[], routine.span)?;
        name = entry.to_string();
    } else if !is_called && outer.len() > 1 {
        let names: Vec<String> = outer.iter().map(|name| format!("`{name}`")).collect();
        return fail(
            Span::default(),
            format!(
                "the file has the definitions {} and calls none: name the one with which the program starts (`entry`)",
                names.join(", ")
            ),
        );
    }
    Ok(machine.recorder.finish(&name))
}

impl Dialect for UrScript {
    const FIRST_INDEX: i64 = 0;

    fn name(_: &mut UrScripts<'_>, name: &str, _: Span) -> Result<Value> {
        Ok(match name {
            "MATH_PI" | "PI" => Value::Number(std::f64::consts::PI),
            _ => Value::Outside(format!("`{name}`").into()),
        })
    }

    fn function(machine: &mut UrScripts<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
        functions::function(machine, name, arguments, span)
    }

    fn instruction(machine: &mut UrScripts<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Flow> {
        match name {
            "movej" | "movel" | "movep" | "movec" => motion(machine, name, arguments, span)?,
            "set_tcp" => {
                let (value, at) = machine.argument(arguments, 0, span)?;
                machine.dialect.X_FT = Some(pose_rotation_vector(pose(&value, at)?));
            }
            // Waiting and stopping.
            "sleep" => {
                let seconds = machine.number(arguments, 0, span)?;
                machine.recorder.dwell(seconds, span)?;
            }
            "sync" => machine.recorder.note("waiting for the next cycle (sync) takes no time", span),
            "stopj" | "stopl" => machine.recorder.stop(),
            "halt" | "end_program" => return Ok(Flow::Halt),
            "popup" => {
                machine.recorder.stop();
                machine.recorder.note("messages are not shown, and none waits for an answer", span);
            }
            // The rest: motion by outside data, no motion, or a function whose result is dropped.
            _ if is_refused(name) => {
                return fail(
                    span,
                    format!(
                        "`{name}` moves the robot by data outside the program (sensors, measured positions, a stream of set points), which is not simulated: write movej, movel, movep or movec"
                    ),
                );
            }
            _ if Self::is_still(name) => machine.recorder.note(still_words(name), span),
            _ if functions::is_known(name) => {
                functions::function(machine, name, arguments, span)?;
            }
            _ => {
                return fail(
                    span,
                    format!(
                        "`{name}` is not known here: give the file that defines it (`companions`), or take the line out if it does not move \
                         the robot"
                    ),
                );
            }
        }
        Ok(Flow::On)
    }

    fn binary(operator: Operator, left: &Value, right: &Value, span: Span) -> Option<Result<Value>> {
        functions::binary(operator, left, right, span)
    }

    fn is_still(name: &str) -> bool {
        const WORDS: &str = "\
            textmsg set_payload set_target_payload set_payload_mass set_payload_cog set_gravity \
            request_boolean_from_primary_client enter_critical exit_critical start \
            set_safety_mode_transition_hardness set_tool_communication set_runstate_outputs varmsg \
            set_target_payload_inertia set_digital_out";
        const BEGINNINGS: &str = "\
            set_standard_ set_configurable_ set_tool_ set_analog_ set_euromap_ socket_ write_ \
            modbus_ rtde_ rpc_ rq_set set_flag zero_ftsensor set_input_actions set_baselight popup_";
        is_among(name, WORDS) || BEGINNINGS.split(' ').any(|beginning| name.starts_with(beginning))
    }
}

/// Functions that depend on values known only to the controller, or change the execution of moves.
fn is_refused(name: &str) -> bool {
    const WORDS: &str = "\
        servoj servoc servol speedj speedl force_mode force_mode_set_damping freedrive_mode \
        teach_mode conveyor_pulse_decode track_conveyor_linear track_conveyor_circular \
        path_offset_enable path_offset_set move_until direct_torque optimove_j optimovej optimovel \
        run mc_add_linear position_deviation_warning";
    is_among(name, WORDS)
}

fn still_words(name: &str) -> &'static str {
    match name {
        _ if name.starts_with("set_payload") || name.starts_with("set_target_payload") || name == "set_gravity" => {
            "loads of the program are not taken: the robot has its own"
        }
        _ if name.starts_with("socket")
            || name.starts_with("rpc")
            || name.starts_with("modbus")
            || name.starts_with("rtde") =>
        {
            "communication is not simulated"
        }
        _ if name.starts_with("set_") || name.starts_with("write_") => {
            "outputs and settings without effect on the motion are not simulated"
        }
        _ => "messages are not shown",
    }
}

/// Six numbers of a pose or of a list of six.
fn pose(value: &Value, span: Span) -> Result<[f64; 6]> {
    match value {
        Value::Pose(pose) => Ok(*pose),
        other => {
            let numbers = other.numbers(span)?;
            match <[f64; 6]>::try_from(numbers) {
                Ok(pose) => Ok(pose),
                Err(numbers) => fail(span, format!("a pose has 6 numbers, found {}", numbers.len())),
            }
        }
    }
}

/// Optional number given by position or name.
fn number(machine: &mut UrScripts<'_>, arguments: &[Argument], position: usize, name: &str) -> Result<Option<f64>> {
    if let Some((value, at)) = machine.named(arguments, name)? {
        return value.number(at).map(Some);
    }
    match positional(arguments, position).cloned() {
        Some(expression) => machine.value(&expression)?.number(expression.span).map(Some),
        None => Ok(None),
    }
}

/// Target of a move: joint values, a pose, or joint values of a pose.
fn target(value: Value, span: Span) -> Result<Target> {
    match value.known(span)? {
        Value::Pose(pose) => {
            Ok(Target::Pose { X_BT: pose_rotation_vector(pose), configuration: Configuration::NEAREST })
        }
        Value::Inverse(inner) => {
            let (pose, near) = *inner;
            let configuration = near.map_or(Configuration::NEAREST, Configuration::Near);
            Ok(Target::Pose { X_BT: pose_rotation_vector(pose), configuration })
        }
        list @ Value::List(_) => {
            let joints = list.numbers(span)?;
            if joints.len() != 6 {
                return fail(span, format!("a list of 6 joint values in rad is expected, found {}", joints.len()));
            }
            Ok(Target::Joints(joints))
        }
        other => fail(
            span,
            format!(
                "joint values [q1, ..., q6] or a pose p[x, y, z, rx, ry, rz] are expected, this is {}",
                other.kind()
            ),
        ),
    }
}

/// Value of an argument given by position or name.
fn required(
    machine: &mut UrScripts<'_>,
    arguments: &[Argument],
    position: usize,
    names: &[&str],
    span: Span,
) -> Result<(Value, Span)> {
    for name in names {
        if let Some(found) = machine.named(arguments, name)? {
            return Ok(found);
        }
    }
    machine.argument(arguments, position, span)
}

fn motion(machine: &mut UrScripts<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<()> {
    let X_FT = machine.dialect.X_FT;
    if X_FT.is_none() {
        machine
            .recorder
            .note_all("no set_tcp is called before the first moves: the robot's own tool centre point is taken");
    }
    let last = usize::from(name == "movec");
    let (value, at) = required(machine, arguments, last, if last == 1 { &["pose_to"] } else { &["q", "pose"] }, span)?;
    let mut to = target(value, at)?;
    let kind = match name {
        "movej" => MoveKind::Joint,
        "movec" => arc(machine, arguments, &mut to, span)?,
        _ => MoveKind::Line,
    };
    let first = last + 1;
    let a = number(machine, arguments, first, "a")?;
    let v = number(machine, arguments, first + 1, "v")?;
    // movep and movec have no duration.
    let (t, r) = match name {
        "movej" | "movel" => (number(machine, arguments, first + 2, "t")?, number(machine, arguments, first + 3, "r")?),
        _ => (None, number(machine, arguments, first + 2, "r")?),
    };
    let duration_s = t.filter(|t| *t != 0.0);
    let speed = if name == "movej" {
        Speed {
            joint_rad_s: Some(v.unwrap_or(1.05)),
            joint_rad_s2: Some(a.unwrap_or(1.4)),
            duration_s,
            ..Speed::default()
        }
    } else {
        Speed {
            linear_m_s: Some(v.unwrap_or(0.25)),
            linear_m_s2: Some(a.unwrap_or(1.2)),
            duration_s,
            ..Speed::default()
        }
    };
    let blend = match r {
        Some(r) if r != 0.0 => Blend::Distance(r),
        _ => Blend::Stop,
    };
    let step = Move {
        place: Place::default(),
        statement: String::new(),
        kind,
        to,
        X_WB: Pose::identity(),
        X_FT,
        speed,
        blend,
    };
    machine.recorder.add(step, span)
}

/// `movec(via, to, a, v, r, mode)`: in mode 0 the orientation changes uniformly, in mode 1 it is
/// constant relative to the circle.
fn arc(machine: &mut UrScripts<'_>, arguments: &[Argument], to: &mut Target, span: Span) -> Result<MoveKind> {
    let (value, at) = required(machine, arguments, 0, &["pose_via"], span)?;
    let via = match target(value, at)? {
        Target::Pose { X_BT, .. } => X_BT,
        Target::Joints(joints) => forward(machine, &joints, at)?,
    };
    if let Target::Joints(joints) = to {
        let X_BT = forward(machine, joints, span)?;
        *to = Target::Pose { X_BT, configuration: Configuration::Near(joints.clone()) };
    }
    let mode = number(machine, arguments, 5, "mode")?.unwrap_or(0.0);
    let turns_with_path = mode == 1.0;
    if turns_with_path && let Target::Pose { X_BT, .. } = to {
        let start = machine.recorder.pose(&Pose::identity(), &machine.dialect.X_FT, span)?;
        let Some(circle) = Circle::through(start.translation.vector, via.translation.vector, X_BT.translation.vector)
        else {
            return fail(
                span,
                "start, point on the way and target are on a line or at one place: they must make a circle",
            );
        };
        X_BT.rotation = circle.turn(circle.angle) * start.rotation;
    }
    Ok(MoveKind::Arc { via: via.translation.vector, via_rotation: None, angle: None, turns_with_path })
}

/// Tool pose for joint values.
fn forward(machine: &UrScripts<'_>, joints: &[f64], span: Span) -> Result<Pose> {
    match machine.recorder.forward(joints, &machine.dialect.X_FT) {
        Some(X_WT) => Ok(X_WT),
        None => fail(span, format!("{}; write a pose p[x, y, z, rx, ry, rz]", depends("the kinematics of the robot"))),
    }
}

/// Tool pose for joint values, as six numbers.
fn forward_value(machine: &UrScripts<'_>, joints: &[f64]) -> Option<Value> {
    let X_WT = machine.recorder.forward(joints, &machine.dialect.X_FT)?;
    Some(Value::Pose(rotation_vector_of(&X_WT)))
}
