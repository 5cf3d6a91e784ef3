//! Joint values and wrenches as typed by the user.
//!
//! Joints by position or by name, each with its unit (rad or deg, m or mm; without one rad and m);
//! wrenches as six numbers, force (N) then torque (N m), world axes.

use flexarm::Robot;
use flexarm::links::reduce::numbers;
use flexarm::robots::known_names;

use crate::failure::Failure;

/// Units of angles, with their size (rad).
const ANGLES: &[(&str, f64)] = &[("deg", std::f64::consts::PI / 180.0)];
/// Units of angular speeds, with their size (rad/s).
const SPEEDS: &[(&str, f64)] = &[("rpm", std::f64::consts::PI / 30.0), ("deg", std::f64::consts::PI / 180.0)];

/// Parses a joint vector: `v1,v2,...` in coordinate order, or `name=value,...` with the others
/// zero; SI units, or a suffix from `units` for joints that turn.
///
/// * `joints`: names, and whether they are prismatic.
///
/// # Errors
/// [`Failure::Usage`], listing the joints.
fn parse_joint_values(text: &str, joints: &[(&str, bool)], units: &[(&str, f64)]) -> Result<Vec<f64>, Failure> {
    let mut values = vec![0.0; joints.len()];
    let items: Vec<&str> = text.split(',').map(str::trim).filter(|s| !s.is_empty()).collect();
    let names: Vec<&str> = joints.iter().map(|(name, _)| *name).collect();
    let number = |s: &str, (joint, slides): (&str, bool)| {
        let suffixed = units.iter().find_map(|(unit, size)| Some((s.trim().strip_suffix(unit)?.trim(), *size)));
        if suffixed.is_some() && slides {
            return Err(Failure::Usage(format!("joint value {s:?}: joint {joint:?} slides; give it in m or m/s")));
        }
        let (digits, unit) = suffixed.unwrap_or((s.trim(), 1.0));
        let value: Option<f64> = digits.parse().ok().filter(|x: &f64| x.is_finite());
        value.map(|x| x * unit).ok_or_else(|| {
            let example = format!("30{}", units[0].0);
            Failure::Usage(format!("joint value {s:?} is not a finite number (rad or m, or as in {example})"))
        })
    };
    // By name: joints that are not named stay at zero. By position: one value for each joint.
    if items.iter().any(|i| i.contains('=')) {
        let mut given = vec![false; joints.len()];
        for item in items {
            let (name, value) = item
                .split_once('=')
                .ok_or_else(|| Failure::Usage(format!("{item:?}: either all joint values have names or none")))?;
            let k = names.iter().position(|j| *j == name.trim()).ok_or_else(|| {
                let (name, known) = (name.trim(), known_names(name.trim(), &names));
                Failure::Usage(format!("there is no movable joint {name:?}; the joints are {known}"))
            })?;
            if std::mem::replace(&mut given[k], true) {
                return Err(Failure::Usage(format!("joint {:?} is given twice", names[k])));
            }
            values[k] = number(value, joints[k])?;
        }
    } else {
        if items.len() != joints.len() {
            return Err(Failure::Usage(format!(
                "{} joint values given, the robot has {} movable joints: {names:?}",
                items.len(),
                joints.len()
            )));
        }
        for ((value, item), joint) in values.iter_mut().zip(items).zip(joints) {
            *value = number(item, *joint)?;
        }
    }
    Ok(values)
}

/// Values of a robot's joints, if any are given; see [`parse_joint_values`].
///
/// # Errors
/// Those of [`parse_joint_values`], and [`Error::Model`].
pub(crate) fn joint_values(text: Option<&str>, robot: &Robot) -> Result<Option<Vec<f64>>, Failure> {
    of_joints(text, robot, ANGLES)
}

/// Speeds of a robot's joints, if any are given, likewise.
///
/// # Errors
/// As [`joint_values`].
pub(crate) fn joint_speeds(text: Option<&str>, robot: &Robot) -> Result<Option<Vec<f64>>, Failure> {
    of_joints(text, robot, SPEEDS)
}

fn of_joints(text: Option<&str>, robot: &Robot, units: &[(&str, f64)]) -> Result<Option<Vec<f64>>, Failure> {
    let Some(text) = text else { return Ok(None) };
    let model = robot.rigid_model()?;
    let joints: Vec<(&str, bool)> = model.coordinates().iter().map(|c| (c.joint.as_str(), c.slides())).collect();
    parse_joint_values(text, &joints, units).map(Some)
}

/// Parses a wrench: `fx,fy,fz` or `fx,fy,fz,tx,ty,tz` (N, N m).
///
/// * `flag`: its name in messages.
///
/// # Errors
/// [`Failure::Usage`].
pub(crate) fn wrench(flag: &str, text: &str) -> Result<[f64; 6], Failure> {
    let values = numbers(text).map_err(|what| Failure::Usage(format!("{flag}: {what} (N, N m)")))?;
    match values.as_slice() {
        [fx, fy, fz] => Ok([*fx, *fy, *fz, 0.0, 0.0, 0.0]),
        [fx, fy, fz, tx, ty, tz] => Ok([*fx, *fy, *fz, *tx, *ty, *tz]),
        other => Err(Failure::Usage(format!(
            "{flag} has {} numbers; expected fx,fy,fz or fx,fy,fz,tx,ty,tz in world axes",
            other.len()
        ))),
    }
}
