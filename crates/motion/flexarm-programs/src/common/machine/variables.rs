//! Variables: declaration, assignment to a variable or a part of one, and the count of changes.
//!
//! A variable remembers the literal that gave its value as long as nothing changes it, which is
//! what `rewrite` replaces. Changes are counted, so that a loop which changes nothing is recognised
//! as endless (`control`). Not here: values of expressions (`evaluate`).

use std::rc::Rc;

use super::{Dialect, LARGEST, Machine, Variable};
use crate::common::tree::{Expr, Kind};
use crate::common::value::{Value, depends};
use crate::common::{Result, Span, fail};

/// One step from a variable to a part of it.
enum Part {
    Field(Rc<str>),
    Index(i64),
}

impl<D: Dialect> Machine<'_, D> {
    pub(crate) fn set_global(&mut self, name: &str, value: Value) {
        self.globals.insert(name.into(), Variable { origin: None, value, kind: "".into() });
    }

    pub(crate) fn global(&self, name: &str) -> Option<&Value> {
        self.globals.get(name).map(|variable| &variable.value)
    }

    pub(super) fn declare(
        &mut self,
        kind: &Rc<str>,
        name: &Rc<str>,
        sizes: &[Expr],
        value: Option<&Expr>,
        span: Span,
    ) -> Result<()> {
        let origin = value.and_then(|value| self.origin(value));
        let declared = value.map(|value| self.value(value)).transpose()?;
        let variables = self.locals.last_mut().unwrap_or(&mut self.globals);
        if let (None, Some(old)) = (&declared, variables.get_mut(name)) {
            old.kind = kind.clone(); // a parameter whose type is declared in the body
            return Ok(());
        }
        let value = match declared {
            Some(value) => self.fit(kind, value, span)?,
            None if !sizes.is_empty() => self.array(kind.trim_end_matches("{}"), sizes, span)?,
            None => D::coerce(self, kind, Value::Nothing, span)?,
        };
        let variables = self.locals.last_mut().unwrap_or(&mut self.globals);
        variables.insert(name.clone(), Variable { origin, value, kind: kind.clone() });
        Ok(())
    }

    /// Assigns the value of an expression; a variable as a whole also takes its origin.
    pub(super) fn assign_expression(&mut self, place: &Expr, expression: &Expr) -> Result<()> {
        let value = self.value(expression)?;
        if value == Value::Nothing {
            value.clone().known(expression.span)?;
        }
        let origin = self.origin(expression).filter(|_| matches!(place.kind, Kind::Name(_)));
        self.assign(place, value)?;
        if let Some(variable) = root_name(place).and_then(|name| self.variable(name)) {
            variable.origin = origin;
        }
        Ok(())
    }

    /// Creates an array of unset values.
    fn array(&mut self, kind: &str, sizes: &[Expr], span: Span) -> Result<Value> {
        let mut value = D::coerce(self, kind, Value::Nothing, span)?;
        for size in sizes.iter().rev() {
            let count = match self.value(size)? {
                Value::Outside(_) => return Ok(Value::list(Vec::new())),
                known => known.count(size.span)?,
            };
            let count = usize::try_from(count).unwrap_or(0);
            if count.saturating_mul(value.size()) > LARGEST {
                return fail(size.span, format!("the array would hold more than {LARGEST} values"));
            }
            value = Value::list(vec![value; count]);
        }
        Ok(value)
    }

    /// Converts a value, or a list of values, to a type.
    pub(super) fn fit(&mut self, kind: &str, value: Value, span: Span) -> Result<Value> {
        if kind.is_empty() || matches!(value, Value::Outside(_)) {
            return Ok(value);
        }
        D::coerce(self, kind, value, span)
    }

    pub(super) fn variable(&mut self, name: &str) -> Option<&mut Variable> {
        if let Some(scope) = self.locals.last_mut()
            && scope.contains_key(name)
        {
            return scope.get_mut(name);
        }
        self.globals.get_mut(name)
    }

    /// Whether a variable of this name exists.
    pub(crate) fn is_variable(&self, name: &str) -> bool {
        self.locals.last().is_some_and(|scope| scope.contains_key(name)) || self.globals.contains_key(name)
    }

    /// Counts a change of a variable at the level of its scope.
    fn changed(&mut self, name: &str) {
        let is_local = self.locals.last().is_some_and(|scope| scope.contains_key(name));
        let level = if is_local { self.locals.len() } else { 0 };
        if self.changes.len() <= level {
            self.changes.resize(level + 1, 0);
        }
        self.changes[level] += 1;
    }

    /// Number of changes of the variables visible here.
    pub(super) fn visible_changes(&self) -> usize {
        let local = self.changes.get(self.locals.len()).copied().unwrap_or(0);
        if self.locals.is_empty() { self.changes[0] } else { self.changes[0] + local }
    }

    pub(super) fn set(&mut self, name: &Rc<str>, value: Value) {
        self.changed(name);
        match self.variable(name) {
            Some(variable) => (variable.value, variable.origin) = (value, None),
            None => {
                let variables = self.locals.last_mut().unwrap_or(&mut self.globals);
                variables.insert(name.clone(), Variable { origin: None, value, kind: "".into() });
            }
        }
    }

    /// Sets a variable or a part of one.
    pub(crate) fn assign(&mut self, place: &Expr, value: Value) -> Result<()> {
        if value.size() > LARGEST {
            return fail(
                place.span,
                format!("`{}` would hold more than {LARGEST} values", self.recorder.excerpt(place.span)),
            );
        }
        let mut parts = Vec::new();
        let name = self.parts(place, &mut parts)?;
        if !self.is_variable(&name) {
            if !D::undeclared(self, &name, place.span)? {
                return Ok(());
            }
            self.globals.insert(name.clone(), Variable { origin: None, value: Value::Nothing, kind: "".into() });
        }
        let kind = self.variable(&name).map(|variable| variable.kind.clone()).unwrap_or_default();
        if let Some(number) = self.number_of_pose(&name, &parts, place.span)? {
            *number = value.number(place.span)?;
            self.changed(&name);
            return Ok(());
        }
        let only_indices = parts.iter().all(|part| matches!(part, Part::Index(_)));
        let value = if only_indices {
            // Each index removes one dimension from an array's type.
            let element = parts.iter().fold(&*kind, |kind, _| kind.strip_suffix("{}").unwrap_or(kind));
            self.fit(element, value, place.span)?
        } else {
            value
        };
        let Some(variable) = self.variable(&name) else { return Ok(()) };
        let mut slot = &mut variable.value;
        for part in &parts {
            slot = part_of(slot, part, D::FIRST_INDEX, place.span)?;
        }
        let old_kind = match slot {
            Value::Record(record) if !only_indices => Some(record.kind.clone()),
            _ => None,
        };
        let value = match old_kind {
            Some(kind) => self.fit(&kind, value, place.span)?,
            None => value,
        };
        let Some(variable) = self.variable(&name) else { return Ok(()) };
        let mut slot = &mut variable.value;
        for part in &parts {
            slot = part_of(slot, part, D::FIRST_INDEX, place.span)?;
        }
        if *slot != value {
            *slot = value;
            self.changed(&name);
        }
        Ok(())
    }

    /// Number within a pose that a place refers to (`p[2]`).
    fn number_of_pose(&mut self, name: &str, parts: &[Part], span: Span) -> Result<Option<&mut f64>> {
        let Some((Part::Index(at), parts)) = parts.split_last() else { return Ok(None) };
        let index = usize::try_from(at - D::FIRST_INDEX).unwrap_or(usize::MAX);
        let Some(variable) = self.variable(name) else { return Ok(None) };
        let mut slot = &mut variable.value;
        for part in parts {
            slot = part_of(slot, part, D::FIRST_INDEX, span)?;
        }
        match slot {
            Value::Pose(pose) if index < 6 => Ok(Some(&mut pose[index])),
            Value::Pose(_) => fail(span, format!("{at} is not an index of a pose: expected 0 to 5")),
            _ => Ok(None),
        }
    }

    /// Variable of a place and the path from it to the part.
    fn parts(&mut self, place: &Expr, parts: &mut Vec<Part>) -> Result<Rc<str>> {
        match &place.kind {
            Kind::Name(name) => Ok(name.clone()),
            Kind::Field(base, field) => {
                let name = self.parts(base, parts)?;
                parts.push(Part::Field(field.clone()));
                Ok(name)
            }
            Kind::Index(base, indices) => {
                let name = self.parts(base, parts)?;
                for index in indices {
                    parts.push(Part::Index(self.value(index)?.count(index.span)?));
                }
                Ok(name)
            }
            _ => fail(place.span, "a variable is expected on the left of an assignment"),
        }
    }
}

/// Variable that an expression is part of.
fn root_name(place: &Expr) -> Option<&Rc<str>> {
    match &place.kind {
        Kind::Name(name) => Some(name),
        Kind::Field(base, _) | Kind::Index(base, _) => root_name(base),
        _ => None,
    }
}

/// Mutable reference to a part of a value; records and lists grow as needed.
fn part_of<'v>(value: &'v mut Value, part: &Part, first: i64, span: Span) -> Result<&'v mut Value> {
    if let Value::Outside(what) = value {
        return fail(span, depends(what));
    }
    // A part that does not exist is created, also where the variable has no value yet.
    match part {
        Part::Field(field) => {
            if matches!(value, Value::Nothing) {
                *value = Value::record("", Vec::new());
            }
            let kind = value.kind().to_owned();
            let Value::Record(record) = value else {
                return fail(span, format!("`{field}` cannot be set: this is {kind}, not an aggregate"));
            };
            let record = Rc::make_mut(record);
            let at = match record.fields.iter().position(|(name, _)| name == field) {
                Some(at) => at,
                None => {
                    record.fields.push((field.clone(), Value::Nothing));
                    record.fields.len() - 1
                }
            };
            Ok(&mut record.fields[at].1)
        }
        Part::Index(at) => {
            let index = usize::try_from(at - first).ok().filter(|index| *index < LARGEST);
            let Some(index) = index else {
                return fail(span, format!("{at} is not an index: expected {first} to {LARGEST}"));
            };
            if matches!(value, Value::Nothing) {
                *value = Value::list(Vec::new());
            }
            let kind = value.kind().to_owned();
            match value {
                Value::List(values) => {
                    let values = Rc::make_mut(values);
                    if values.len() <= index {
                        values.resize(index + 1, Value::Nothing);
                    }
                    Ok(&mut values[index])
                }
                _ => fail(span, format!("an element cannot be set: this is {kind}, not a list")),
            }
        }
    }
}
