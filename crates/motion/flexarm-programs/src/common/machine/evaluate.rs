//! Values of expressions, and the literals that they come from.
//!
//! Start at [`Machine::value`]. A value that only the controller knows makes every value that is
//! computed from it unknown, with its cause. Not here: operators (`operators`), functions of a
//! language (its [`Dialect`]).

use std::rc::Rc;

use super::operators::combine;
use super::{Dialect, Machine};
use crate::common::tree::{Expr, Kind, Operator};
use crate::common::value::{Record, Value};
use crate::common::{Result, Span, fail};

impl<D: Dialect> Machine<'_, D> {
    /// Evaluates an expression.
    pub(crate) fn value(&mut self, expression: &Expr) -> Result<Value> {
        // Names and parts of variables, operators and calls, aggregates.
        let span = expression.span;
        match &expression.kind {
            Kind::Literal(value) => Ok(value.clone()),
            Kind::Name(name) => match self.variable(name) {
                Some(variable) => Ok(variable.value.clone()),
                None => D::name(self, name, span),
            },
            Kind::Field(base, field) => {
                let base_value = self.value(base)?;
                read_field(base_value, field, base.span, span)
            }
            Kind::Index(base, indices) => {
                let mut value = self.value(base)?;
                for index in indices {
                    let at = self.value(index)?;
                    value = self.element(value, base, at, index.span)?;
                }
                Ok(value)
            }
            Kind::Not(inner) => match self.value(inner)? {
                Value::Outside(what) => Ok(Value::Outside(what)),
                value => Ok(Value::Flag(!value.flag(inner.span)?)),
            },
            Kind::Negative(inner) => match self.value(inner)? {
                Value::Outside(what) => Ok(Value::Outside(what)),
                Value::Whole(whole) => Ok(Value::Whole(whole.saturating_neg())),
                value => Ok(Value::Number(-value.number(inner.span)?)),
            },
            Kind::Binary(operator, left, right) => self.binary(*operator, left, right, span),
            Kind::Call(name, arguments) => self.function(name, arguments, span),
            Kind::List(elements) => {
                let values = elements.iter().map(|element| self.value(element)).collect::<Result<_>>()?;
                Ok(Value::list(values))
            }
            Kind::Record(kind, fields) => {
                let mut record = Record { kind: kind.clone(), fields: Vec::with_capacity(fields.len()) };
                for (name, value) in fields {
                    let value = self.value(value)?;
                    record.set(name, value);
                }
                Ok(Value::Record(Rc::new(record)))
            }
            Kind::Pose(elements) => self.pose_literal(elements, span),
        }
    }

    fn pose_literal(&mut self, elements: &[Expr], span: Span) -> Result<Value> {
        let mut pose = [0.0; 6];
        if elements.len() != 6 {
            return fail(span, format!("a pose has 6 numbers, p[x, y, z, rx, ry, rz]; found {}", elements.len()));
        }
        for (number, element) in pose.iter_mut().zip(elements) {
            match self.value(element)? {
                Value::Outside(what) => return Ok(Value::Outside(what)),
                value => *number = value.number(element.span)?,
            }
        }
        Ok(Value::Pose(pose))
    }

    /// Returns the element of a list or pose at an index, which starts as in the language.
    fn element(&mut self, value: Value, base: &Expr, at: Value, span: Span) -> Result<Value> {
        if let Value::Outside(what) = at {
            return Ok(Value::Outside(what));
        }
        // Index as the language counts; system variables without a value are outside the program.
        let at = at.count(span)?;
        let index = usize::try_from(at - D::FIRST_INDEX).ok();
        let is_system = matches!(&base.kind, Kind::Name(name) if name.starts_with('$'));
        let found = match &value {
            Value::Outside(_) if is_system => None,
            Value::Outside(what) => return Ok(Value::Outside(what.clone())),
            Value::List(values) => index.and_then(|index| values.get(index)).cloned(),
            Value::Pose(pose) => index.and_then(|index| pose.get(index)).map(|number| Value::Number(*number)),
            other => {
                let kind = other.kind().to_owned();
                other.clone().known(base.span)?;
                return fail(base.span, format!("a list is expected before an index, this is {kind}"));
            }
        };
        // No value: outside for a system variable, otherwise an error.
        match found {
            Some(Value::Nothing) | None if is_system => {
                Ok(Value::Outside(format!("`{}[{at}]`", self.recorder.excerpt(base.span)).into()))
            }
            Some(Value::Nothing) | None => fail(
                span,
                format!(
                    "`{}` has no value at {at}: set it in the file or give it as an option (`given`)",
                    self.recorder.excerpt(base.span)
                ),
            ),
            Some(value) => Ok(value),
        }
    }

    fn binary(&mut self, operator: Operator, left: &Expr, right: &Expr, span: Span) -> Result<Value> {
        let a = self.value(left)?;
        // Short-circuit evaluation.
        match (operator, &a) {
            (Operator::And, Value::Flag(false)) => return Ok(Value::Flag(false)),
            (Operator::Or, Value::Flag(true)) => return Ok(Value::Flag(true)),
            _ => {}
        }
        let b = self.value(right)?;
        match (operator, &a, &b) {
            (Operator::And, Value::Outside(_), Value::Flag(false)) => return Ok(Value::Flag(false)),
            (Operator::Or, Value::Outside(_), Value::Flag(true)) => return Ok(Value::Flag(true)),
            (_, Value::Outside(what), _) | (_, _, Value::Outside(what)) => return Ok(Value::Outside(what.clone())),
            _ => {}
        }
        if let Some(result) = D::binary(operator, &a, &b, span) {
            return result;
        }
        combine(operator, &a, &b, [left.span, right.span], span)
    }

    /// Span of the literal from which the value of an expression comes: the expression itself, or
    /// the literal assigned to a variable.
    pub(crate) fn origin(&mut self, expression: &Expr) -> Option<Span> {
        match &expression.kind {
            Kind::Record(..) | Kind::List(_) => Some(expression.span),
            Kind::Name(name) => self.variable(name)?.origin,
            _ => None,
        }
    }
}

fn read_field(value: Value, field: &str, base: Span, span: Span) -> Result<Value> {
    match value {
        Value::Outside(what) => Ok(Value::Outside(what)),
        Value::Record(record) => match record.get(field) {
            Some(value) => Ok(value.clone()),
            None => {
                let fields: Vec<&str> = record.fields.iter().map(|(name, _)| &**name).collect();
                fail(span, format!("there is no `{field}` here; there is {}", fields.join(", ")))
            }
        },
        other => {
            let kind = other.kind().to_owned();
            other.known(base)?;
            fail(span, format!("`{field}` is asked of {kind}, which has no parts"))
        }
    }
}
