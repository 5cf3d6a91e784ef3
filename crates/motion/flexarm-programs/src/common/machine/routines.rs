//! Calls of the program's routines, and the arguments of routines, functions and instructions.
//!
//! A routine runs with variables of its own; parameters that return values are copied back at its
//! end. [`Machine::argument`] and [`Machine::named`] read the arguments of instructions. Not here:
//! instructions.

use std::rc::Rc;

use super::{Dialect, Flow, Machine, Variable, Variables};
use crate::common::tree::{Action, Argument, Expr, Kind, Routine, Statement};
use crate::common::value::Value;
use crate::common::{Result, Span, fail};

/// Parameters that return values, with the arguments that take them.
type Returned = Vec<(Rc<str>, Expr)>;

impl<D: Dialect> Machine<'_, D> {
    /// Adds routines; of several with one name the first counts.
    pub(crate) fn add(&mut self, routines: impl IntoIterator<Item = Routine>) {
        for routine in routines {
            self.routines.entry(routine.name.clone()).or_insert_with(|| Rc::new(routine));
        }
    }

    /// Runs declarations; an unreadable one is an error only where its name is used.
    pub(crate) fn declare_all(&mut self, data: &[Statement]) {
        for statement in data {
            if let Err(fail) = self.run(std::slice::from_ref(statement))
                && let Action::Declare { name, .. } = &statement.action
            {
                let place = self.recorder.place(statement.span);
                let what = format!("`{name}`, whose declaration at {place} cannot be read ({})", fail.message);
                self.set_global(name, Value::Outside(what.into()));
            }
        }
    }

    pub(super) fn call(&mut self, name: &Rc<str>, arguments: &[Argument], span: Span) -> Result<Flow> {
        let Some(routine) = self.routines.get(name).cloned() else {
            return D::instruction(self, name, arguments, span);
        };
        match self.invoke(&routine, arguments, span)? {
            Flow::Halt => Ok(Flow::Halt),
            _ => Ok(Flow::On),
        }
    }

    pub(super) fn function(&mut self, name: &Rc<str>, arguments: &[Argument], span: Span) -> Result<Value> {
        let Some(routine) = self.routines.get(name).cloned() else {
            return D::function(self, name, arguments, span);
        };
        self.step(span)?;
        match self.invoke(&routine, arguments, span)? {
            Flow::Return(value) => Ok(value),
            _ => Ok(Value::Nothing),
        }
    }

    /// Runs a routine; its return value is in [`Flow::Return`].
    pub(crate) fn invoke(&mut self, routine: &Rc<Routine>, arguments: &[Argument], span: Span) -> Result<Flow> {
        let (scope, returned) = self.parameters(routine, arguments, span)?;
        self.locals.push(scope);
        let flow = self.nested(span, |machine| machine.run(&routine.body));
        let scope = self.locals.pop().unwrap_or_default();
        let flow = flow?;
        for (name, place) in returned {
            if let (Some(variable), Kind::Name(_) | Kind::Index(..) | Kind::Field(..)) = (scope.get(&name), &place.kind)
            {
                self.assign(&place, variable.value.clone())?;
            }
        }
        Ok(flow)
    }

    /// Returns the variables of a routine at its beginning, and the parameters that return values
    /// with the arguments that take them.
    fn parameters(&mut self, routine: &Routine, arguments: &[Argument], span: Span) -> Result<(Variables, Returned)> {
        let mut scope = Variables::new();
        let mut returned = Returned::new();
        let mut position = 0;
        for argument in arguments {
            // The parameter of this argument, by its name or its position.
            let parameter = match &argument.name {
                Some(name) => routine.parameters.iter().find(|parameter| parameter.name == *name),
                None => {
                    let mut positional =
                        routine.parameters.iter().filter(|p| !p.optional || D::FIRST_INDEX == 0 || p.default.is_some());
                    position += 1;
                    positional.nth(position - 1)
                }
            };
            let Some(parameter) = parameter else {
                return fail(argument.span, format!("`{}` has no such parameter", routine.name));
            };
            // Its value, and the literal that it comes from.
            let value = match &argument.value {
                Some(expression) if parameter.returned => self.value(expression).unwrap_or(Value::Nothing),
                Some(expression) => self.value(expression)?,
                None => Value::Flag(true),
            };
            let value =
                if matches!(value, Value::Nothing) { value } else { self.fit(&parameter.kind, value, argument.span)? };
            let origin = argument.value.as_ref().and_then(|expression| self.origin(expression));
            scope.insert(parameter.name.clone(), Variable { origin, value, kind: parameter.kind.clone() });
            if let (true, Some(place)) = (parameter.returned, &argument.value) {
                returned.push((parameter.name.clone(), place.clone()));
            }
        }
        // Parameters without an argument have their default values.
        for parameter in &routine.parameters {
            if scope.contains_key(&parameter.name) || parameter.optional && parameter.default.is_none() {
                continue;
            }
            let Some(default) = &parameter.default else {
                return fail(span, format!("`{}` needs a value for `{}`", routine.name, parameter.name));
            };
            let value = self.value(default)?;
            scope.insert(parameter.name.clone(), Variable { origin: None, value, kind: parameter.kind.clone() });
        }
        Ok((scope, returned))
    }

    /// Whether an argument of the current routine was given (RAPID's `Present`).
    pub(crate) fn is_given(&self, name: &str) -> bool {
        self.locals.last().is_some_and(|scope| scope.contains_key(name))
    }

    /// Value of an argument, or an error if it is missing.
    pub(crate) fn argument(&mut self, arguments: &[Argument], position: usize, span: Span) -> Result<(Value, Span)> {
        match positional(arguments, position) {
            Some(expression) => Ok((self.value(expression)?, expression.span)),
            None => fail(span, format!("argument {} is missing", position + 1)),
        }
    }

    /// [`Machine::origin`] of an argument.
    pub(crate) fn argument_origin(&mut self, arguments: &[Argument], position: usize) -> Option<Span> {
        self.origin(positional(arguments, position)?)
    }

    /// Numeric value of an argument.
    pub(crate) fn number(&mut self, arguments: &[Argument], position: usize, span: Span) -> Result<f64> {
        let (value, at) = self.argument(arguments, position, span)?;
        value.number(at)
    }

    /// Value of a named argument, if it is present.
    pub(crate) fn named(&mut self, arguments: &[Argument], name: &str) -> Result<Option<(Value, Span)>> {
        match arguments.iter().find(|argument| argument.name.as_deref() == Some(name)) {
            Some(Argument { value: Some(value), .. }) => Ok(Some((self.value(value)?, value.span))),
            Some(Argument { value: None, span, .. }) => Ok(Some((Value::Flag(true), *span))),
            None => Ok(None),
        }
    }
}

/// The unnamed argument at a position.
pub(crate) fn positional(arguments: &[Argument], position: usize) -> Option<&Expr> {
    arguments.iter().filter(|argument| argument.name.is_none()).nth(position)?.value.as_ref()
}
