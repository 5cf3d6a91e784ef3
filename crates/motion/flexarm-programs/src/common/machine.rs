//! Interpreter of programs: variables, expressions, branches, loops and calls. The instructions of
//! a language are in its [`Dialect`].
//!
//! A value that only the controller knows (an input, a measured position) passes through
//! expressions and variables as [`Value::Outside`]; it is an error where a move, a branch or a loop
//! needs it.

use std::collections::HashMap;
use std::rc::Rc;

use super::recorder::Recorder;
use super::tree::{Action, Argument, Expr, Kind, Operator, Routine, Statement};
use super::value::{Record, Value, depends};
use super::{Fail, Result, Span, fail};

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

    /// Runs a block of statements with a keyword.
    fn block(
        machine: &mut Machine<Self>,
        name: &str,
        arguments: &[Argument],
        body: &[Statement],
        span: Span,
    ) -> Result<Flow>;

    /// Whether an undeclared variable may be assigned; may add a note. `false`: the assignment has
    /// no effect.
    fn undeclared(machine: &mut Machine<Self>, name: &str, span: Span) -> Result<bool>;

    /// Converts a value to the type of a variable or parameter.
    fn coerce(machine: &mut Machine<Self>, kind: &str, value: Value, span: Span) -> Result<Value>;

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

/// One step from a variable to a part of it.
enum Part {
    Field(Rc<str>),
    Index(i64),
}

impl<'a, D: Dialect> Machine<'a, D> {
    pub(crate) fn new(recorder: Recorder<'a>, dialect: D) -> Self {
        let (globals, locals, routines) = (HashMap::new(), Vec::new(), HashMap::new());
        Self { recorder, dialect, globals, locals, routines, changes: vec![0], steps: 0, depth: 0 }
    }

    pub(crate) fn set_global(&mut self, name: &str, value: Value) {
        self.globals.insert(name.into(), Variable { origin: None, value, kind: "".into() });
    }

    pub(crate) fn global(&self, name: &str) -> Option<&Value> {
        self.globals.get(name).map(|variable| &variable.value)
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
            Action::Assign { place, value: expression } => {
                let value = self.value(expression)?;
                if value == Value::Nothing {
                    value.clone().known(expression.span)?;
                }
                let origin = self.origin(expression).filter(|_| matches!(place.kind, Kind::Name(_)));
                self.assign(place, value)?;
                if let Some(variable) = root_name(place).and_then(|name| self.variable(name)) {
                    variable.origin = origin;
                }
            }
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

    fn declare(
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
    fn fit(&mut self, kind: &str, value: Value, span: Span) -> Result<Value> {
        if kind.is_empty() || matches!(value, Value::Outside(_)) {
            return Ok(value);
        }
        D::coerce(self, kind, value, span)
    }

    fn branch(&mut self, branches: &[(Expr, Vec<Statement>)], otherwise: &[Statement], span: Span) -> Result<Flow> {
        for (condition, body) in branches {
            let value = self.value(condition)?;
            if let Value::Outside(what) = &value {
                let mut bodies = branches.iter().map(|(_, body)| body.as_slice()).chain([otherwise]);
                if bodies.all(|body| self.is_still(body)) {
                    for body in branches.iter().map(|(_, body)| body.as_slice()).chain([otherwise]) {
                        self.forget(body, what);
                    }
                    self.recorder.note(
                        "branches that depend on the controller are not taken: they hold nothing that moves",
                        span,
                    );
                    return Ok(Flow::On);
                }
                return fail(condition.span, depends(what));
            }
            if value.flag(condition.span)? {
                return self.nested(span, |machine| machine.run(body));
            }
        }
        self.nested(span, |machine| machine.run(otherwise))
    }

    /// Whether the statements have no effect on the motion, whether they run or not.
    fn is_still(&self, body: &[Statement]) -> bool {
        body.iter().all(|statement| match &statement.action {
            Action::Still(_) => true,
            Action::Call { name, .. } => {
                let is_over = self.recorder.options.waits_are_over && name.starts_with("wait") && !D::takes_time(name);
                !self.routines.contains_key(name) && (is_over || D::is_still(name))
            }
            Action::Assign { place, .. } => match &place.kind {
                Kind::Name(name) => !name.starts_with('$'),
                Kind::Index(base, _) => matches!(&base.kind, Kind::Name(name) if D::is_still(name)),
                _ => false,
            },
            Action::If { branches, otherwise } => {
                branches.iter().all(|(_, body)| self.is_still(body)) && self.is_still(otherwise)
            }
            _ => false,
        })
    }

    /// Marks variables that the statements may have set as known only to the controller.
    fn forget(&mut self, body: &[Statement], what: &Rc<str>) {
        for statement in body {
            match &statement.action {
                Action::Assign { place: Expr { kind: Kind::Name(name), .. }, .. } => {
                    if let Some(variable) = self.variable(name) {
                        variable.value = Value::Outside(what.clone());
                    }
                }
                Action::If { branches, otherwise } => {
                    for body in branches.iter().map(|(_, body)| body.as_slice()).chain([otherwise.as_slice()]) {
                        self.forget(body, what);
                    }
                }
                _ => {}
            }
        }
    }

    fn while_loop(&mut self, condition: &Expr, body: &[Statement], span: Span) -> Result<Flow> {
        let is_endless = matches!(condition.kind, Kind::Literal(Value::Flag(true)));
        if is_endless && !can_end(body) {
            self.check_endless(span)?;
        }
        let (mut passed, mut idle) = (0, false);
        loop {
            self.step(span)?;
            if !self.value(condition)?.flag(condition.span)? {
                return Ok(Flow::On);
            }
            if (is_endless || idle) && self.recorder.options.endless_passes.is_some_and(|passes| passed >= passes) {
                self.recorder.note("a loop without end was run as often as the option `endless_passes` says", span);
                return Ok(Flow::On);
            }
            passed += 1;
            let before = self.visible_changes();
            match self.nested(span, |machine| machine.run(body))? {
                Flow::Leave => return Ok(Flow::On),
                Flow::On | Flow::Again => {}
                out => return Ok(out),
            }
            // A pass without a change of variables repeats identically.
            idle = before == self.visible_changes();
            if idle {
                self.check_endless(span)?;
            }
        }
    }

    fn check_endless(&self, span: Span) -> Result<()> {
        match self.recorder.options.endless_passes {
            Some(_) => Ok(()),
            None => fail(
                span,
                "this loop does not end: say how often it is to be run (`endless_passes`), or write a loop that counts",
            ),
        }
    }

    fn repeat_loop(&mut self, body: &[Statement], until: &Expr, span: Span) -> Result<Flow> {
        let mut passed = 0;
        loop {
            self.step(span)?;
            passed += 1;
            let before = self.visible_changes();
            match self.nested(span, |machine| machine.run(body))? {
                Flow::Leave => return Ok(Flow::On),
                Flow::On | Flow::Again => {}
                out => return Ok(out),
            }
            if self.value(until)?.flag(until.span)? {
                return Ok(Flow::On);
            }
            if before == self.visible_changes() {
                self.check_endless(span)?;
                if self.recorder.options.endless_passes.is_some_and(|passes| passed >= passes) {
                    self.recorder.note("a loop without end was run as often as the option `endless_passes` says", span);
                    return Ok(Flow::On);
                }
            }
        }
    }

    fn for_loop(&mut self, name: &Rc<str>, range: [Option<&Expr>; 3], body: &[Statement], span: Span) -> Result<Flow> {
        let mut numbers = [1.0; 3];
        let mut whole = true;
        for (number, expression) in numbers.iter_mut().zip(range) {
            let Some(expression) = expression else { continue };
            let value = self.value(expression)?;
            *number = value.number(expression.span)?;
            whole &= matches!(value, Value::Whole(_));
        }
        let [from, to, mut step] = numbers;
        if D::FIRST_INDEX == 1 && range[2].is_none() && !whole && to < from {
            step = -1.0; // RAPID counts downwards automatically
        }
        if step == 0.0 {
            return fail(span, "the step of this loop is 0, so it does not end: give another step");
        }
        let mut at = from;
        while (step > 0.0 && at <= to) || (step < 0.0 && at >= to) {
            self.step(span)?;
            let value = if whole { Value::Whole(at as i64) } else { Value::Number(at) };
            self.set(name, value);
            match self.nested(span, |machine| machine.run(body))? {
                Flow::Leave => return Ok(Flow::On),
                Flow::On | Flow::Again => {}
                out => return Ok(out),
            }
            at += step;
        }
        Ok(Flow::On)
    }

    fn switch(
        &mut self,
        subject: &Expr,
        cases: &[(Vec<Expr>, Vec<Statement>)],
        otherwise: &[Statement],
    ) -> Result<Flow> {
        let value = self.value(subject)?.known(subject.span)?;
        for (labels, body) in cases {
            for label in labels {
                let other = self.value(label)?.known(label.span)?;
                if equal(&value, &other) {
                    return self.nested(subject.span, |machine| machine.run(body));
                }
            }
        }
        self.nested(subject.span, |machine| machine.run(otherwise))
    }

    fn call(&mut self, name: &Rc<str>, arguments: &[Argument], span: Span) -> Result<Flow> {
        let Some(routine) = self.routines.get(name).cloned() else {
            return D::instruction(self, name, arguments, span);
        };
        match self.invoke(&routine, arguments, span)? {
            Flow::Halt => Ok(Flow::Halt),
            _ => Ok(Flow::On),
        }
    }

    /// Runs a routine; its return value is in [`Flow::Return`].
    pub(crate) fn invoke(&mut self, routine: &Rc<Routine>, arguments: &[Argument], span: Span) -> Result<Flow> {
        let mut scope = Variables::new();
        let mut returned: Vec<(Rc<str>, Expr)> = Vec::new();
        let mut position = 0;
        for argument in arguments {
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

    /// Whether an argument of the current routine was given (RAPID's `Present`).
    pub(crate) fn is_given(&self, name: &str) -> bool {
        self.locals.last().is_some_and(|scope| scope.contains_key(name))
    }

    fn variable(&mut self, name: &str) -> Option<&mut Variable> {
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
    fn visible_changes(&self) -> usize {
        let local = self.changes.get(self.locals.len()).copied().unwrap_or(0);
        if self.locals.is_empty() { self.changes[0] } else { self.changes[0] + local }
    }

    fn set(&mut self, name: &Rc<str>, value: Value) {
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

    /// Evaluates an expression.
    pub(crate) fn value(&mut self, expression: &Expr) -> Result<Value> {
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

    fn function(&mut self, name: &Rc<str>, arguments: &[Argument], span: Span) -> Result<Value> {
        let Some(routine) = self.routines.get(name).cloned() else {
            return D::function(self, name, arguments, span);
        };
        self.step(span)?;
        match self.invoke(&routine, arguments, span)? {
            Flow::Return(value) => Ok(value),
            _ => Ok(Value::Nothing),
        }
    }

    fn element(&mut self, value: Value, base: &Expr, at: Value, span: Span) -> Result<Value> {
        if let Value::Outside(what) = at {
            return Ok(Value::Outside(what));
        }
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

    /// [`Machine::origin`] of an argument.
    pub(crate) fn argument_origin(&mut self, arguments: &[Argument], position: usize) -> Option<Span> {
        self.origin(positional(arguments, position)?)
    }

    /// Value of an argument, or an error if it is missing.
    pub(crate) fn argument(&mut self, arguments: &[Argument], position: usize, span: Span) -> Result<(Value, Span)> {
        match positional(arguments, position) {
            Some(expression) => Ok((self.value(expression)?, expression.span)),
            None => fail(span, format!("argument {} is missing", position + 1)),
        }
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

/// Variable that an expression is part of.
fn root_name(place: &Expr) -> Option<&Rc<str>> {
    match &place.kind {
        Kind::Name(name) => Some(name),
        Kind::Field(base, _) | Kind::Index(base, _) => root_name(base),
        _ => None,
    }
}

/// Whether an endless loop contains an exit.
fn can_end(body: &[Statement]) -> bool {
    body.iter().any(|statement| match &statement.action {
        Action::Leave | Action::Return(_) | Action::Halt => true,
        Action::If { branches, otherwise } => branches.iter().any(|(_, body)| can_end(body)) || can_end(otherwise),
        Action::Switch { cases, otherwise, .. } => cases.iter().any(|(_, body)| can_end(body)) || can_end(otherwise),
        Action::While { body, .. } | Action::For { body, .. } | Action::Repeat { body, .. } => can_end(body),
        _ => false,
    })
}

/// Mutable reference to a part of a value; records and lists grow as needed.
fn part_of<'v>(value: &'v mut Value, part: &Part, first: i64, span: Span) -> Result<&'v mut Value> {
    if let Value::Outside(what) = value {
        return fail(span, depends(what));
    }
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

/// Whether two values are equal.
pub(crate) fn equal(a: &Value, b: &Value) -> bool {
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
fn combine(operator: Operator, a: &Value, b: &Value, sides: [Span; 2], span: Span) -> Result<Value> {
    use Operator::*;
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
    if let (Add, Value::Text(a), Value::Text(b)) = (operator, a, b) {
        return Ok(Value::Text(format!("{a}{b}").chars().take(LARGEST).collect::<String>().into()));
    }
    if let (Value::Whole(a), Value::Whole(b)) = (a, b)
        && let Some(result) = combine_whole(operator, *a, *b, span)
    {
        return result;
    }
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
