//! Operators on values, with Python's rules for signs, integers and strings.
//!
//! Start at [`unary`], [`binary`] and [`compare`]. Integers remain integers, except under `/`; one
//! with a float gives a float. Not here: evaluation of the operands ([`super::evaluate`]).

use std::cmp::Ordering;
use std::rc::Rc;

use super::value::{Value, lookup};
use super::{Charge, ExpressionError, methods};

fn not_defined(sign: &str, left: &Value, right: &Value) -> ExpressionError {
    let trouble = ExpressionError::new(format!("{sign} is not defined between {} and {}", left.kind(), right.kind()));
    match (left, right) {
        (Value::Str(text), _) | (_, Value::Str(text)) => {
            trouble.help(format!("{:?} is a text: convert it with float() or str()", super::shortened(text)))
        }
        _ => trouble,
    }
}

fn too_large() -> ExpressionError {
    ExpressionError::new("a whole number above 1e38 is not computed").help("use decimals, such as 10.0 instead of 10")
}

pub(super) fn unary(sign: &str, operand: &Value) -> Result<Value, ExpressionError> {
    Ok(match (sign, operand) {
        ("not", operand) => Value::Bool(!operand.is_true()),
        ("-", Value::Float(x)) => Value::Float(-x),
        ("+", Value::Float(x)) => Value::Float(*x),
        (sign, operand) => {
            let i = operand.as_int().ok_or_else(|| {
                ExpressionError::new(format!("{sign} is not defined for {}", operand.kind())).help("is it a text?")
            })?;
            match sign {
                "-" => Value::Int(i.checked_neg().ok_or_else(too_large)?),
                "+" => Value::Int(i),
                _ => Value::Int(!i),
            }
        }
    })
}

/// Evaluates `left sign right`; memory is charged before it is allocated.
pub(super) fn binary(
    sign: &str,
    left: &Value,
    right: &Value,
    charge: &mut Charge<'_>,
) -> Result<Value, ExpressionError> {
    // Texts and sequences: concatenation, repetition, formatting.
    match (sign, left, right) {
        ("+", Value::Str(a), Value::Str(b)) => {
            charge(a.len() + b.len())?;
            return Ok(Value::text(format!("{a}{b}")));
        }
        ("+", Value::List(a), Value::List(b)) => {
            charge(left.size() + right.size())?;
            return Ok(Value::list(a.iter().chain(b.iter()).cloned().collect()));
        }
        ("+", Value::Tuple(a), Value::Tuple(b)) => {
            charge(left.size() + right.size())?;
            return Ok(Value::Tuple(Rc::new(a.iter().chain(b.iter()).cloned().collect())));
        }
        ("*", Value::Str(_) | Value::List(_) | Value::Tuple(_), times) => {
            if let Some(times) = times.as_int() {
                return repeat(left, times, charge);
            }
        }
        ("*", times, Value::Str(_) | Value::List(_) | Value::Tuple(_)) => {
            if let Some(times) = times.as_int() {
                return repeat(right, times, charge);
            }
        }
        ("%", Value::Str(format), _) => return methods::percent(format, right),
        _ => {}
    }
    // Numbers.
    if let (Some(a), Some(b)) = (left.as_int(), right.as_int()) {
        return whole(sign, a, b);
    }
    match (left.as_float(), right.as_float()) {
        (Some(a), Some(b)) => decimal(sign, a, b).unwrap_or_else(|| Err(not_defined(sign, left, right))),
        _ => Err(not_defined(sign, left, right)),
    }
}

fn repeat(value: &Value, times: i128, charge: &mut Charge<'_>) -> Result<Value, ExpressionError> {
    let times = usize::try_from(times.max(0)).unwrap_or(usize::MAX);
    charge(value.size().saturating_mul(times))?;
    let copies = |items: &[Value]| std::iter::repeat_n(items, times).flatten().cloned().collect::<Vec<_>>();
    Ok(match value {
        Value::Str(text) => Value::text(text.repeat(times)),
        Value::Tuple(items) => Value::Tuple(Rc::new(copies(items))),
        Value::List(items) => Value::list(copies(items)),
        other => other.clone(),
    })
}

fn whole(sign: &str, a: i128, b: i128) -> Result<Value, ExpressionError> {
    let by_zero = || ExpressionError::new("division by zero");
    let shift = |b: i128| u32::try_from(b).map_err(|_| ExpressionError::new(format!("shift by {b}")));
    let value = match sign {
        "+" => a.checked_add(b),
        "-" => a.checked_sub(b),
        "*" => a.checked_mul(b),
        "/" if b == 0 => return Err(by_zero()),
        "/" => return Ok(Value::Float(a as f64 / b as f64)),
        "//" | "%" if b == 0 => return Err(by_zero()),
        "//" => a.checked_div_euclid(b).map(|q| if b < 0 && a.rem_euclid(b) != 0 { q - 1 } else { q }),
        "%" => a.checked_rem_euclid(b).map(|r| if b < 0 && r != 0 { r + b } else { r }),
        "**" if b < 0 && a == 0 => return Err(by_zero()),
        "**" if b < 0 => return Ok(Value::Float((a as f64).powf(b as f64))),
        "**" => match u32::try_from(b) {
            Ok(exponent) => a.checked_pow(exponent),
            // Only these bases have integer results for other exponents.
            Err(_) if a == 0 || a == 1 => Some(a),
            Err(_) if a == -1 => Some(if b % 2 == 0 { 1 } else { -1 }),
            Err(_) => None,
        },
        "<<" => {
            let bits = shift(b)?;
            if bits < 120 { a.checked_mul(1 << bits) } else { None }
        }
        ">>" => Some(a >> shift(b)?.min(127)),
        "&" => Some(a & b),
        "|" => Some(a | b),
        "^" => Some(a ^ b),
        _ => return Err(ExpressionError::new(format!("{sign} is not known"))),
    };
    value.map(Value::Int).ok_or_else(too_large)
}

/// Float arithmetic; `None` if floats do not have the operator.
fn decimal(sign: &str, a: f64, b: f64) -> Option<Result<Value, ExpressionError>> {
    let by_zero = matches!(sign, "/" | "//" | "%") && b == 0.0;
    let pole = sign == "**" && a == 0.0 && b < 0.0;
    if by_zero || pole {
        return Some(Err(ExpressionError::new("division by zero")));
    }
    let value = match sign {
        "+" => a + b,
        "-" => a - b,
        "*" => a * b,
        "/" => a / b,
        "//" => floor_division(a, b).0,
        "%" => floor_division(a, b).1,
        "**" => a.powf(b),
        _ => return None,
    };
    if sign == "**" && value.is_nan() && !a.is_nan() && !b.is_nan() {
        return Some(Err(ExpressionError::new(format!("{a} ** {b} is not a real number"))));
    }
    if sign == "**" && value.is_infinite() && a.is_finite() && b.is_finite() {
        return Some(Err(ExpressionError::new(format!("{a} ** {b} is too large"))));
    }
    Some(Ok(Value::Float(value)))
}

/// Quotient and remainder as in CPython: the remainder has the sign of the divisor.
pub(super) fn floor_division(a: f64, b: f64) -> (f64, f64) {
    let mut remainder = a % b;
    let mut quotient = (a - remainder) / b;
    if remainder == 0.0 {
        remainder = 0.0f64.copysign(b);
    } else if (b < 0.0) != (remainder < 0.0) {
        remainder += b;
        quotient -= 1.0;
    }
    let floored = if quotient == 0.0 {
        0.0f64.copysign(a / b)
    } else {
        let floor = quotient.floor();
        if quotient - floor > 0.5 { floor + 1.0 } else { floor }
    };
    (floored, remainder)
}

pub(super) fn compare(sign: &str, left: &Value, right: &Value) -> Result<bool, ExpressionError> {
    let order = |left: &Value, right: &Value| {
        let numbers = left.as_float().is_some() && right.as_float().is_some();
        match left.order(right) {
            None if !numbers => Err(not_defined(sign, left, right)),
            order => Ok(order),
        }
    };
    Ok(match sign {
        "==" | "is" => left.equals(right),
        "!=" | "is not" => !left.equals(right),
        "<" => order(left, right)? == Some(Ordering::Less),
        ">" => order(left, right)? == Some(Ordering::Greater),
        "<=" => matches!(order(left, right)?, Some(Ordering::Less | Ordering::Equal)),
        ">=" => matches!(order(left, right)?, Some(Ordering::Greater | Ordering::Equal)),
        "in" => contains(right, left)?,
        _ => !contains(right, left)?,
    })
}

fn contains(container: &Value, item: &Value) -> Result<bool, ExpressionError> {
    match (container, item) {
        (Value::Str(text), Value::Str(part)) => Ok(text.contains(&**part)),
        (Value::List(items) | Value::Tuple(items), item) => Ok(items.iter().any(|i| i.equals(item))),
        (Value::Dict(items), key) => Ok(lookup(items, key).is_some()),
        (container, item) => Err(not_defined("in", item, container)),
    }
}
