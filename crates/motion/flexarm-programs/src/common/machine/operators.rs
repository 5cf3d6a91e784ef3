//! Operators on numbers, truth values and texts.

use super::LARGEST;
use crate::common::tree::Operator;
use crate::common::value::Value;
use crate::common::{Fail, Result, Span, fail};

/// Whether two values are equal.
pub(super) fn equal(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Whole(a), Value::Number(b)) | (Value::Number(b), Value::Whole(a)) => *a as f64 == *b,
        // RAPID compares aggregates of which only one may be typed.
        (Value::Record(record), Value::List(values)) | (Value::List(values), Value::Record(record)) => {
            record.fields.len() == values.len()
                && record.fields.iter().zip(values.iter()).all(|((_, a), b)| equal(a, b))
        }
        (Value::List(a), Value::List(b)) => a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| equal(a, b)),
        _ => a == b,
    }
}

/// Applies an operator to numbers, truth values or texts.
pub(super) fn combine(operator: Operator, a: &Value, b: &Value, sides: [Span; 2], span: Span) -> Result<Value> {
    use Operator::*;
    // Comparisons of any values, and logic.
    match operator {
        Equal | Unequal => {
            for (value, side) in [a, b].into_iter().zip(sides) {
                value.clone().known(side)?;
            }
            return Ok(Value::Flag(equal(a, b) == (operator == Equal)));
        }
        And => return Ok(Value::Flag(a.flag(sides[0])? && b.flag(sides[1])?)),
        Or => return Ok(Value::Flag(a.flag(sides[0])? || b.flag(sides[1])?)),
        Either => return Ok(Value::Flag(a.flag(sides[0])? != b.flag(sides[1])?)),
        _ => {}
    }
    // Texts are joined; whole numbers stay whole where the language has them.
    if let (Add, Value::Text(a), Value::Text(b)) = (operator, a, b) {
        return Ok(Value::Text(format!("{a}{b}").chars().take(LARGEST).collect::<String>().into()));
    }
    if let (Value::Whole(a), Value::Whole(b)) = (a, b)
        && let Some(result) = combine_whole(operator, *a, *b, span)
    {
        return result;
    }
    // All other operators work on numbers.
    let (x, y) = (a.number(sides[0])?, b.number(sides[1])?);
    let number = match operator {
        Add => x + y,
        Subtract => x - y,
        Multiply => x * y,
        Divide | WholeDivide | Remainder if y == 0.0 => return fail(span, "a division by 0"),
        Divide => x / y,
        WholeDivide => (x / y).trunc(),
        Remainder => x % y,
        Power => x.powf(y),
        Less => return Ok(Value::Flag(x < y)),
        LessEqual => return Ok(Value::Flag(x <= y)),
        Greater => return Ok(Value::Flag(x > y)),
        GreaterEqual => return Ok(Value::Flag(x >= y)),
        _ => return fail(span, "frames are expected on both sides of `:`"),
    };
    Ok(Value::Number(number))
}

/// Integer arithmetic; `None` for other operators.
fn combine_whole(operator: Operator, a: i64, b: i64, span: Span) -> Option<Result<Value>> {
    use Operator::*;
    let result = match operator {
        Add => a.checked_add(b),
        Subtract => a.checked_sub(b),
        Multiply => a.checked_mul(b),
        Divide if b == 0 => return Some(fail(span, "a division by 0")),
        Divide => a.checked_div(b),
        BitAnd => Some(a & b),
        BitOr => Some(a | b),
        BitEither => Some(a ^ b),
        _ => return None,
    };
    let too_large = || Fail { span, message: "the whole number is too large".into() };
    Some(result.map(Value::Whole).ok_or_else(too_large))
}
