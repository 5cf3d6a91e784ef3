//! Interpreter of programs: variables, expressions, branches, loops and calls. The instructions of
//! a language are in its [`Dialect`].
//!
//! A value that only the controller knows (an input, a measured position) passes through
//! expressions and variables as [`Value::Outside`]; it is an error where a move, a branch or a loop
//! needs it.

mod control;
mod evaluate;
mod operators;
mod routines;
mod variables;

use std::collections::HashMap;
use std::rc::Rc;

use super::recorder::Recorder;
use super::tree::{Action, Argument, Operator, Routine, Statement};
use super::value::Value;
use super::{Result, Span, fail};

pub(crate) use routines::positional;

/// Language-specific part of the interpreter.
pub(crate) trait Dialect: Sized {
    /// First index of a list.
    const FIRST_INDEX: i64;

    /// Value of a name that is not a variable.
    fn name(machine: &mut Machine<Self>, name: &str, span: Span) -> Result<Value>;

    /// Calls a function that is not defined in the file.
    fn function(machine: &mut Machine<Self>, name: &str, arguments: &[Argument], span: Span) -> Result<Value>;

    /// Runs an instruction that is not a routine of the file.
    fn instruction(machine: &mut Machine<Self>, name: &str, arguments: &[Argument], span: Span) -> Result<Flow>;

    /// Runs a block of statements with a keyword; by default there is none.
    fn block(_: &mut Machine<Self>, _: &str, _: &[Argument], _: &[Statement], span: Span) -> Result<Flow> {
        fail(span, "this block is not known")
    }

    /// Whether an undeclared variable may be assigned; may add a note. `false`: the assignment has
    /// no effect.
    fn undeclared(_: &mut Machine<Self>, _: &str, _: Span) -> Result<bool> {
        Ok(true)
    }

    /// Converts a value to the type of a variable or parameter.
    fn coerce(_: &mut Machine<Self>, _: &str, value: Value, _: Span) -> Result<Value> {
        Ok(value)
    }

    /// Applies an operator to values of the language's own types; `None` if it does not apply.
    fn binary(operator: Operator, left: &Value, right: &Value, span: Span) -> Option<Result<Value>>;

    /// Whether the instruction waits for a given time.
    fn takes_time(name: &str) -> bool {
        matches!(name, "waittime" | "wait sec" | "sleep")
    }

    /// Whether the instruction has no effect on the motion.
    fn is_still(name: &str) -> bool;
}

/// A variable.
#[derive(Debug, Clone)]
pub(crate) struct Variable {
    /// Span of the literal that gave the value, as long as nothing else has changed it.
    origin: Option<Span>,
    pub(crate) value: Value,
    pub(crate) kind: Rc<str>,
}

type Variables = HashMap<Rc<str>, Variable>;

/// Control flow after a statement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Flow {
    On,
    Leave,
    Again,
    Return(Value),
    Halt,
}

/// State of a running program.
pub(crate) struct Machine<'a, D> {
    pub(crate) recorder: Recorder<'a>,
    pub(crate) dialect: D,
    pub(crate) globals: Variables,
    locals: Vec<Variables>,
    pub(crate) routines: HashMap<Rc<str>, Rc<Routine>>,
    /// Numbers of assignments to variables: globals, then by scope.
    changes: Vec<usize>,
    steps: usize,
    depth: usize,
}

/// Maximum nesting depth of routines, blocks and loops.
const DEEPEST: usize = 120;
/// Maximum number of values in one variable.
const LARGEST: usize = 200_000;

impl<'a, D: Dialect> Machine<'a, D> {
    pub(crate) fn new(recorder: Recorder<'a>, dialect: D) -> Self {
        let (globals, locals, routines) = (HashMap::new(), Vec::new(), HashMap::new());
        Self { recorder, dialect, globals, locals, routines, changes: vec![0], steps: 0, depth: 0 }
    }

    /// Runs statements in sequence.
    pub(crate) fn run(&mut self, statements: &[Statement]) -> Result<Flow> {
        for statement in statements {
            let flow = self.statement(statement)?;
            if flow != Flow::On {
                return Ok(flow);
            }
        }
        Ok(Flow::On)
    }

    /// Runs a nested block and limits the depth.
    pub(crate) fn nested<T>(&mut self, span: Span, inner: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.depth >= DEEPEST {
            return fail(
                span,
                format!("more than {DEEPEST} calls and blocks are inside of each other: does a routine call itself?"),
            );
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    fn step(&mut self, span: Span) -> Result<()> {
        self.steps += 1;
        let most = self.recorder.options.most_steps;
        if self.steps > most {
            return fail(
                span,
                format!(
                    "{most} statements were run and the program has not ended: does this loop end? Allow more (`most_steps`)"
                ),
            );
        }
        Ok(())
    }

    fn statement(&mut self, statement: &Statement) -> Result<Flow> {
        let span = statement.span;
        self.step(span)?;
        match &statement.action {
            Action::Declare { kind, name, sizes, value } => self.declare(kind, name, sizes, value.as_ref(), span)?,
            Action::Assign { place, value } => self.assign_expression(place, value)?,
            Action::If { branches, otherwise } => return self.branch(branches, otherwise, span),
            Action::While { condition, body } => return self.while_loop(condition, body, span),
            Action::Repeat { body, until } => return self.repeat_loop(body, until, span),
            Action::For { name, from, to, step, body } => {
                return self.for_loop(name, [Some(from), Some(to), step.as_ref()], body, span);
            }
            Action::Switch { subject, cases, otherwise } => return self.switch(subject, cases, otherwise),
            Action::Call { name, arguments } => return self.call(name, arguments, span),
            Action::Block { name, arguments, body } => {
                return self.nested(span, |machine| D::block(machine, name, arguments, body, span));
            }
            Action::Return(value) => {
                let value = value.as_ref().map_or(Ok(Value::Nothing), |value| self.value(value))?;
                return Ok(Flow::Return(value));
            }
            Action::Leave => return Ok(Flow::Leave),
            Action::Again => return Ok(Flow::Again),
            Action::Halt => return Ok(Flow::Halt),
            Action::Still(what) => self.recorder.note(what, span),
            Action::Refused(message) => return fail(span, message.clone()),
        }
        Ok(Flow::On)
    }
}
