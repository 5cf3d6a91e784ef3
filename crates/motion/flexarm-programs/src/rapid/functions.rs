//! RAPID functions of numbers, frames and targets, and operators on positions and texts.
//!
//! Start at [`function`]. Values are as RAPID has them, in mm, degrees and quaternions; [`pose_mm`]
//! converts a record to a pose whose translation is still in mm. Not here: moves (`motion`), which
//! convert to m.

use std::rc::Rc;

use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Vector3};

use super::{Rapid, Rapids, types};
use crate::common::frames::{angles_zyx, quaternion, rotation_quaternion, rotation_zyx};
use crate::common::machine::{Dialect, positional};
use crate::common::tree::{Argument, Kind, Operator};
use crate::common::value::{Record, Value};
use crate::common::{Result, Span, fail};

fn number(record: &Record, name: &str, span: Span) -> Result<f64> {
    match record.get(name) {
        Some(value) => value.number(span),
        None => fail(span, format!("`{name}` is missing")),
    }
}

/// Converts a value to an aggregate of a type.
pub(super) fn typed(machine: &mut Rapids<'_>, kind: &str, value: Value, span: Span) -> Result<Rc<Record>> {
    let value = value.known(span)?;
    match Rapid::coerce(machine, kind, value, span)? {
        Value::Record(record) => Ok(record),
        other => {
            let other = other.known(span)?;
            fail(span, format!("{kind} is expected, this is {}", other.kind()))
        }
    }
}

/// Reads a `pos` in mm.
pub(super) fn position(value: Option<&Value>, span: Span) -> Result<Vector3<f64>> {
    match value {
        Some(Value::Record(record)) => {
            Ok(Vector3::new(number(record, "x", span)?, number(record, "y", span)?, number(record, "z", span)?))
        }
        Some(Value::List(values)) if values.len() == 3 => {
            Ok(Vector3::new(values[0].number(span)?, values[1].number(span)?, values[2].number(span)?))
        }
        Some(other) => {
            let other = other.clone().known(span)?;
            fail(span, format!("a position [x, y, z] is expected, this is {}", other.kind()))
        }
        None => fail(span, "a position [x, y, z] is missing"),
    }
}

/// Reads an `orient`.
pub(super) fn rotation(value: Option<&Value>, span: Span) -> Result<Rotation3<f64>> {
    let q = match value {
        Some(Value::Record(record)) => [
            number(record, "q1", span)?,
            number(record, "q2", span)?,
            number(record, "q3", span)?,
            number(record, "q4", span)?,
        ],
        Some(other) => {
            let numbers = other.numbers(span)?;
            let [a, b, c, d] = numbers.as_slice() else {
                return fail(span, "a quaternion has 4 numbers, the real part first");
            };
            [*a, *b, *c, *d]
        }
        None => return fail(span, "an orientation [q1, q2, q3, q4] is missing"),
    };
    match rotation_quaternion(q) {
        Some(R) => Ok(R),
        None => fail(
            span,
            format!("the quaternion {q:?} has not the length 1: the real part comes first, [1,0,0,0] turns nothing"),
        ),
    }
}

/// Pose of `trans` and `rot` of a `pose` or target, in mm.
pub(super) fn pose_mm(record: &Record, span: Span) -> Result<Pose> {
    let (p, R) = (position(record.get("trans"), span)?, rotation(record.get("rot"), span)?);
    Ok(Pose::from_parts(p.into(), R))
}

fn position_value(p: Vector3<f64>) -> Value {
    Value::record("pos", vec![("x", Value::Number(p.x)), ("y", Value::Number(p.y)), ("z", Value::Number(p.z))])
}

fn rotation_value(R: &Rotation3<f64>) -> Value {
    let fields = ["q1", "q2", "q3", "q4"].into_iter().zip(quaternion(R)).map(|(name, q)| (name, Value::Number(q)));
    Value::record("orient", fields.collect())
}

fn pose_value(X: &Pose) -> Value {
    Value::record("pose", vec![("trans", position_value(X.translation.vector)), ("rot", rotation_value(&X.rotation))])
}

/// The target with another position and orientation, in mm.
fn moved(target: &Record, X: &Pose) -> Value {
    let mut target = target.clone();
    target.set("trans", position_value(X.translation.vector));
    target.set("rot", rotation_value(&X.rotation));
    Value::Record(Rc::new(target))
}

pub(super) fn function(machine: &mut Rapids<'_>, name: &str, arguments: &[Argument], span: Span) -> Result<Value> {
    if name == "present" {
        let given =
            matches!(positional(arguments, 0).map(|a| &a.kind), Some(Kind::Name(name)) if machine.is_given(name));
        return Ok(Value::Flag(given));
    }
    let mut values = Vec::with_capacity(arguments.len());
    for argument in arguments.iter().filter(|argument| argument.name.is_none()) {
        let Some(expression) = &argument.value else { continue };
        match machine.value(expression)? {
            Value::Outside(what) => return Ok(Value::Outside(what)),
            value => values.push(value),
        }
    }
    if let Some(value) = target_function(machine, name, &values, arguments, span)? {
        return Ok(value);
    }
    match geometry(machine, name, &values, arguments, span)? {
        Some(value) => Ok(value),
        None => mathematics(name, &values, arguments, machine, span),
    }
}

fn argument<'v>(values: &'v [Value], k: usize, name: &str, span: Span) -> Result<&'v Value> {
    match values.get(k) {
        Some(value) => Ok(value),
        None => fail(span, format!("`{name}` misses argument {}", k + 1)),
    }
}

/// Functions of targets; `None` if the name is not one of them.
fn target_function(
    machine: &mut Rapids<'_>,
    name: &str,
    values: &[Value],
    arguments: &[Argument],
    span: Span,
) -> Result<Option<Value>> {
    let at = |k: usize| argument(values, k, name, span);
    let offset = || -> Result<Vector3<f64>> {
        Ok(Vector3::new(at(1)?.number(span)?, at(2)?.number(span)?, at(3)?.number(span)?))
    };
    let angle = |machine: &mut Rapids<'_>, name: &str| -> Result<f64> {
        match machine.named(arguments, name)? {
            Some((value, at)) => Ok(value.number(at)?.to_radians()),
            None => Ok(0.0),
        }
    };
    Ok(Some(match name {
        "offs" => {
            let target = typed(machine, "robtarget", at(0)?.clone(), span)?;
            let mut X = pose_mm(&target, span)?;
            X.translation.vector += offset()?;
            moved(&target, &X)
        }
        "reltool" => {
            let target = typed(machine, "robtarget", at(0)?.clone(), span)?;
            let [x, y, z] = [angle(machine, "rx")?, angle(machine, "ry")?, angle(machine, "rz")?];
            // Rotation about x, then the new y, then the new z.
            let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), x)
                * Rotation3::from_axis_angle(&Vector3::y_axis(), y)
                * Rotation3::from_axis_angle(&Vector3::z_axis(), z);
            let X = pose_mm(&target, span)? * Pose::from_parts(offset()?.into(), turn);
            moved(&target, &X)
        }
        "cjointt" => match machine.recorder.joints() {
            Some(joints) => {
                let axes = joints.iter().take(6).map(|joint| Value::Number(joint.to_degrees())).collect();
                let target = Value::list(vec![Value::list(axes), Value::list(vec![Value::Number(9e9); 6])]);
                types::coerce(&Default::default(), "jointtarget", target, span, 0)?
            }
            None => Value::Outside("`CJointT()`".into()),
        },
        "crobt" | "cpos" => super::motion::current_target(machine, name, arguments, span)?,
        _ => return Ok(None),
    }))
}

/// Functions of frames and vectors; `None` if the name is not one of them.
fn geometry(
    machine: &mut Rapids<'_>,
    name: &str,
    values: &[Value],
    arguments: &[Argument],
    span: Span,
) -> Result<Option<Value>> {
    let at = |k: usize| argument(values, k, name, span);
    let vector = |k: usize| position(Some(at(k)?), span);
    let is_given = |name: &str| arguments.iter().any(|argument| argument.name.as_deref() == Some(name));
    // Poses, orientations, frames by points, vectors.
    Ok(Some(match name {
        "posemult" => {
            let (a, b) = (typed(machine, "pose", at(0)?.clone(), span)?, typed(machine, "pose", at(1)?.clone(), span)?);
            pose_value(&(pose_mm(&a, span)? * pose_mm(&b, span)?))
        }
        "poseinv" => pose_value(&pose_mm(&*typed(machine, "pose", at(0)?.clone(), span)?, span)?.inverse()),
        "posevect" => {
            let X = pose_mm(&*typed(machine, "pose", at(0)?.clone(), span)?, span)?;
            position_value(X * nalgebra::Point3::from(vector(1)?) - nalgebra::Point3::origin())
        }
        "orientzyx" => {
            let [z, y, x] = [at(0)?.number(span)?, at(1)?.number(span)?, at(2)?.number(span)?].map(f64::to_radians);
            rotation_value(&rotation_zyx(z, y, x))
        }
        "eulerzyx" => {
            let angles = angles_zyx(&rotation(Some(at(0)?), span)?).map(f64::to_degrees);
            match ["z", "y", "x"].iter().position(|axis| is_given(axis)) {
                Some(axis) => Value::Number(angles[axis]),
                None => return fail(span, "EulerZYX needs \\X, \\Y or \\Z"),
            }
        }
        "norient" => {
            let record = typed(machine, "orient", at(0)?.clone(), span)?;
            let q = ["q1", "q2", "q3", "q4"].map(|name| number(&record, name, span).unwrap_or(0.0));
            let length = q.iter().map(|q| q * q).sum::<f64>().sqrt();
            match rotation_quaternion(q.map(|q| q / length)) {
                Some(R) => rotation_value(&R),
                None => return fail(span, "this quaternion cannot be made one of length 1"),
            }
        }
        "defframe" if !is_given("origin") => def_frame(machine, &at, span)?,
        "distance" => Value::Number((vector(0)? - vector(1)?).norm()),
        "vectmagn" => Value::Number(vector(0)?.norm()),
        "dotprod" => Value::Number(vector(0)?.dot(&vector(1)?)),
        _ => return Ok(None),
    }))
}

/// Frame with its origin at the first of three targets, x towards the second, and the third on the
/// positive side of y.
fn def_frame<'v>(machine: &mut Rapids<'_>, at: &impl Fn(usize) -> Result<&'v Value>, span: Span) -> Result<Value> {
    let mut points = [Vector3::zeros(); 3];
    for (k, point) in points.iter_mut().enumerate() {
        let target = typed(machine, "robtarget", at(k)?.clone(), span)?;
        *point = position(target.get("trans"), span)?;
    }
    let x = points[1] - points[0];
    let z = x.cross(&(points[2] - points[0]));
    if z.norm() <= 1e-9 * x.norm() || z.iter().any(|part| part.is_nan()) {
        return fail(span, "the three points are on a line: they make no frame");
    }
    let (x, z) = (x.normalize(), z.normalize());
    let R = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, z.cross(&x), z]));
    Ok(pose_value(&Pose::from_parts(points[0].into(), R)))
}

fn mathematics(
    name: &str,
    values: &[Value],
    arguments: &[Argument],
    machine: &mut Rapids<'_>,
    span: Span,
) -> Result<Value> {
    let text = |k: usize| match argument(values, k, name, span)? {
        Value::Text(text) => Ok(text.clone()),
        other => fail(span, format!("a text is expected, this is {}", other.kind())),
    };
    let at = |k: usize| argument(values, k, name, span)?.number(span);
    // Numbers with angles in degrees, then texts and arrays.
    Ok(Value::Number(match name {
        "abs" | "dabs" => at(0)?.abs(),
        "sqrt" => at(0)?.sqrt(),
        "pow" => at(0)?.powf(at(1)?),
        "exp" => at(0)?.exp(),
        "sin" => at(0)?.to_radians().sin(),
        "cos" => at(0)?.to_radians().cos(),
        "tan" => at(0)?.to_radians().tan(),
        "asin" => at(0)?.asin().to_degrees(),
        "acos" => at(0)?.acos().to_degrees(),
        "atan" => at(0)?.atan().to_degrees(),
        "atan2" => at(0)?.atan2(at(1)?).to_degrees(),
        "round" | "trunc" => {
            let decimals = match machine.named(arguments, "dec")? {
                Some((value, at)) => value.count(at)?.clamp(0, 9) as i32,
                None => 0,
            };
            let scaled = at(0)? * 10f64.powi(decimals);
            (if name == "round" { scaled.round() } else { scaled.trunc() }) / 10f64.powi(decimals)
        }
        "numtostr" | "valtostr" => {
            let shown = match values {
                [] => return fail(span, "a value is expected"),
                [first, ..] => first.number(span).map_or_else(|_| first.kind().to_owned(), |number| number.to_string()),
            };
            return Ok(Value::text(&shown));
        }
        "strlen" => text(0)?.chars().count() as f64,
        "dim" => {
            let mut value = argument(values, 0, name, span)?;
            for _ in 1..at(1)? as usize {
                match value {
                    Value::List(inner) if !inner.is_empty() => value = &inner[0],
                    _ => break,
                }
            }
            match value {
                Value::List(values) => values.len() as f64,
                _ => return fail(span, "an array is expected"),
            }
        }
        _ => return Ok(Value::Outside(format!("`{name}(...)`").into())),
    }))
}

/// `+`, `-`, `*` of positions and numbers, `*` of orientations.
pub(super) fn binary(operator: Operator, left: &Value, right: &Value, span: Span) -> Option<Result<Value>> {
    let is = |value: &Value, kind: &str| matches!(value, Value::Record(record) if &*record.kind == kind);
    let positions = || Ok((position(Some(left), span)?, position(Some(right), span)?));
    let result = match operator {
        Operator::Add if is(left, "pos") => positions().map(|(a, b)| position_value(a + b)),
        Operator::Subtract if is(left, "pos") => positions().map(|(a, b)| position_value(a - b)),
        Operator::Multiply if is(left, "pos") && is(right, "pos") => {
            positions().map(|(a, b)| position_value(a.cross(&b)))
        }
        Operator::Multiply if is(left, "pos") => {
            position(Some(left), span).and_then(|a| Ok(position_value(a * right.number(span)?)))
        }
        Operator::Multiply if is(right, "pos") => {
            position(Some(right), span).and_then(|b| Ok(position_value(b * left.number(span)?)))
        }
        Operator::Multiply if is(left, "orient") => {
            rotation(Some(left), span).and_then(|a| Ok(rotation_value(&(a * rotation(Some(right), span)?))))
        }
        _ => return None,
    };
    Some(result)
}
