//! URScript functions of numbers and poses.
//!
//! Start at [`function`]. Poses are lists `p[x, y, z, rx, ry, rz]` in m and rotation vectors in
//! rad. Not here: moves and instructions (`mod.rs`).

use flexarm_spatial::Pose;
use nalgebra::Rotation3;

use super::{UrScripts, pose};
use crate::common::frames::{angles_zyx, pose_rotation_vector, rotation_vector_of, rotation_zyx};
use crate::common::tree::{Argument, Operator};
use crate::common::value::Value;
use crate::common::{Result, Span, fail, is_among};

const KNOWN: &str = "\
    pose_trans pose_add pose_sub pose_inv interpolate_pose point_dist pose_dist get_inverse_kin \
    get_forward_kin rpy2rotvec rotvec2rpy d2r r2d sin cos tan asin acos atan atan2 sqrt pow exp log \
    floor ceil round norm length make_list to_num to_str str_cat normalize";

pub(super) fn is_known(name: &str) -> bool {
    is_among(name, KNOWN)
}

/// Evaluates a built-in function.
pub(super) fn function(machine: &mut UrScripts<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
    let mut values = Vec::with_capacity(arguments.len());
    for argument in arguments {
        let Some(expression) = &argument.value else { continue };
        match machine.value(expression)? {
            Value::Outside(what) if name != "get_inverse_kin" || argument.name.is_none() => {
                return Ok(Value::Outside(what));
            }
            value => values.push((argument.name.clone(), value)),
        }
    }
    // The first group that knows the name computes the value.
    if name == "get_inverse_kin" {
        return inverse(&values, span);
    }
    let values: Vec<Value> = values.into_iter().map(|(_, value)| value).collect();
    if let Some(value) = state(machine, name, &values, span)? {
        return Ok(value);
    }
    let at = |k: usize| match values.get(k) {
        Some(value) => Ok(value),
        None => fail(span, format!("`{name}` misses argument {}", k + 1)),
    };
    if let Some(value) = geometry(name, at, span)? {
        return Ok(value);
    }
    match list_or_text(name, at, span)? {
        Some(value) => Ok(value),
        None => mathematics(name, |k| at(k)?.number(span)),
    }
}

fn pose_value(X: &Pose) -> Value {
    Value::Pose(rotation_vector_of(X))
}

/// Functions of the robot's state and kinematics; `None` if the name is not one of them.
fn state(machine: &mut UrScripts<'_>, name: &str, values: &[Value], span: Span) -> Result<Option<Value>> {
    let (value, outside) = match name {
        "get_forward_kin" => {
            let joints = match values.first() {
                Some(value) => Some(value.numbers(span)?),
                None => machine.recorder.joints().map(<[f64]>::to_vec),
            };
            let pose = joints.and_then(|joints| super::forward_value(machine, &joints));
            (pose, "`get_forward_kin`, the kinematics of the robot")
        }
        "get_target_joint_positions" => {
            let joints = machine.recorder.joints();
            let list = joints.map(|joints| Value::list(joints.iter().map(|joint| Value::Number(*joint)).collect()));
            (list, "`get_target_joint_positions()`")
        }
        "get_target_tcp_pose" => {
            let X_FT = machine.dialect.X_FT;
            let X_WT = machine.recorder.pose(&Pose::identity(), &X_FT, span).ok();
            (X_WT.as_ref().map(pose_value), "`get_target_tcp_pose()`")
        }
        _ => return Ok(None),
    };
    Ok(Some(value.unwrap_or_else(|| Value::Outside(outside.into()))))
}

/// Functions of poses and rotations; `None` if the name is not one of them.
fn geometry<'v>(name: &str, at: impl Fn(usize) -> Result<&'v Value>, span: Span) -> Result<Option<Value>> {
    let place = |k: usize| -> Result<Pose> { Ok(pose_rotation_vector(pose(at(k)?, span)?)) };
    Ok(Some(match name {
        "pose_trans" => pose_value(&(place(0)? * place(1)?)),
        "pose_inv" => pose_value(&place(0)?.inverse()),
        // Positions are added, rotations are composed.
        "pose_add" => {
            let (a, b) = (place(0)?, place(1)?);
            let p = a.translation.vector + b.translation.vector;
            pose_value(&Pose::from_parts(p.into(), a.rotation * b.rotation))
        }
        "pose_sub" => {
            let (a, b) = (place(0)?, place(1)?);
            let p = a.translation.vector - b.translation.vector;
            pose_value(&Pose::from_parts(p.into(), a.rotation * b.rotation.inverse()))
        }
        "interpolate_pose" => {
            let (a, b, part) = (place(0)?, place(1)?, at(2)?.number(span)?);
            let turn = Rotation3::new((a.rotation.inverse() * b.rotation).scaled_axis() * part);
            let p = a.translation.vector.lerp(&b.translation.vector, part);
            pose_value(&Pose::from_parts(p.into(), a.rotation * turn))
        }
        "point_dist" | "pose_dist" => {
            let (a, b) = (place(0)?, place(1)?);
            Value::Number((a.translation.vector - b.translation.vector).norm())
        }
        "rpy2rotvec" => {
            let angles = at(0)?.numbers(span)?;
            let [roll, pitch, yaw] = angles.as_slice() else {
                return fail(span, "three angles [roll, pitch, yaw] in rad are expected");
            };
            let vector = rotation_zyx(*yaw, *pitch, *roll).scaled_axis();
            Value::list(vector.iter().map(|part| Value::Number(*part)).collect())
        }
        "rotvec2rpy" => {
            let vector = at(0)?.numbers(span)?;
            let [x, y, z] = vector.as_slice() else { return fail(span, "a rotation vector [rx, ry, rz] is expected") };
            let [yaw, pitch, roll] = angles_zyx(&Rotation3::new(nalgebra::Vector3::new(*x, *y, *z)));
            Value::list([roll, pitch, yaw].map(Value::Number).to_vec())
        }
        _ => return Ok(None),
    }))
}

/// Functions of lists and texts; `None` if the name is not one of them.
fn list_or_text<'v>(name: &str, at: impl Fn(usize) -> Result<&'v Value>, span: Span) -> Result<Option<Value>> {
    Ok(Some(match name {
        // Lists.
        "length" => match at(0)? {
            Value::List(values) => Value::Number(values.len() as f64),
            Value::Pose(_) => Value::Number(6.0),
            other => return fail(span, format!("a list is expected, this is {}", other.kind())),
        },
        "make_list" => {
            let count = usize::try_from(at(0)?.count(span)?).unwrap_or(0).min(10_000);
            Value::list(vec![at(1)?.clone(); count])
        }
        // Texts.
        "to_num" => match at(0)? {
            Value::Text(text) => match text.trim().parse() {
                Ok(number) => Value::Number(number),
                Err(_) => return fail(span, format!("\"{text}\" is not a number")),
            },
            other => other.clone(),
        },
        "to_str" => Value::text(&at(0)?.number(span).map_or_else(|_| String::new(), |number| number.to_string())),
        "str_cat" => match (at(0)?, at(1)?) {
            (Value::Text(a), Value::Text(b)) if a.len() + b.len() < 10_000 => Value::text(&format!("{a}{b}")),
            _ => Value::text(""),
        },
        // Vectors.
        "norm" => match at(0)? {
            Value::List(_) => Value::Number(at(0)?.numbers(span)?.iter().map(|part| part * part).sum::<f64>().sqrt()),
            other => Value::Number(other.number(span)?.abs()),
        },
        "normalize" => {
            let numbers = at(0)?.numbers(span)?;
            let length = numbers.iter().map(|part| part * part).sum::<f64>().sqrt();
            Value::list(numbers.iter().map(|part| Value::Number(part / length)).collect())
        }
        _ => return Ok(None),
    }))
}

fn mathematics(name: &str, number: impl Fn(usize) -> Result<f64>) -> Result<Value> {
    Ok(Value::Number(match name {
        "d2r" => number(0)?.to_radians(),
        "r2d" => number(0)?.to_degrees(),
        "sin" => number(0)?.sin(),
        "cos" => number(0)?.cos(),
        "tan" => number(0)?.tan(),
        "asin" => number(0)?.asin(),
        "acos" => number(0)?.acos(),
        "atan" => number(0)?.atan(),
        "atan2" => number(0)?.atan2(number(1)?),
        "sqrt" => number(0)?.sqrt(),
        "pow" => number(0)?.powf(number(1)?),
        "exp" => number(0)?.exp(),
        // log(base, number)
        "log" => number(1)?.ln() / number(0)?.ln(),
        "floor" => number(0)?.floor(),
        "ceil" => number(0)?.ceil(),
        "round" => number(0)?.round(),
        _ => return Ok(Value::Outside(format!("`{name}(...)`").into())),
    }))
}

/// `get_inverse_kin(pose, qnear)`: the planner of the moves computes the joint values.
fn inverse(values: &[(Option<std::rc::Rc<str>>, Value)], span: Span) -> Result<Value> {
    let find = |name: &str, position: usize| {
        let named = values.iter().find(|(given, _)| given.as_deref() == Some(name));
        let positional = values.iter().filter(|(given, _)| given.is_none()).nth(position);
        named.or(positional).map(|(_, value)| value)
    };
    let Some(target) = find("x", 0) else { return fail(span, "`get_inverse_kin` misses the pose") };
    let near = match find("qnear", 1) {
        Some(Value::Outside(_)) | None => None, // the measured position: the nearest solution
        Some(value) => Some(value.numbers(span)?),
    };
    Ok(Value::Inverse(Box::new((pose(target, span)?, near))))
}

/// `+`, `-`, `*`, `/` of lists, elementwise, and of lists with numbers.
pub(super) fn binary(operator: Operator, left: &Value, right: &Value, span: Span) -> Option<Result<Value>> {
    let apply = |a: f64, b: f64| match operator {
        Operator::Add => Some(a + b),
        Operator::Subtract => Some(a - b),
        Operator::Multiply => Some(a * b),
        Operator::Divide => Some(a / b),
        _ => None,
    };
    apply(1.0, 1.0)?;
    let lists = match (left, right) {
        (Value::List(_), Value::List(_)) => left.numbers(span).and_then(|a| Ok((a, right.numbers(span)?))),
        (Value::List(_), Value::Number(b)) => left.numbers(span).map(|a| (a.clone(), vec![*b; a.len()])),
        (Value::Number(a), Value::List(_)) => right.numbers(span).map(|b| (vec![*a; b.len()], b)),
        _ => return None,
    };
    Some(lists.and_then(|(a, b)| {
        if a.len() != b.len() {
            return fail(span, format!("lists of {} and {} numbers do not go together", a.len(), b.len()));
        }
        Ok(Value::list(a.iter().zip(&b).map(|(a, b)| Value::Number(apply(*a, *b).unwrap_or(f64::NAN))).collect()))
    }))
}
