//! Control flow: branches, loops, case distinctions, and branches that only the controller decides.
//!
//! A branch or loop whose condition only the controller knows is an error, unless its statements
//! cannot move the robot. Loops that change no variable and cannot end are recognised instead of
//! run.

use std::rc::Rc;

use super::operators::equal;
use super::{Dialect, Flow, Machine};
use crate::common::tree::{Action, Expr, Kind, Statement};
use crate::common::value::{Value, depends};
use crate::common::{Result, Span, fail};

impl<D: Dialect> Machine<'_, D> {
    pub(super) fn branch(
        &mut self,
        branches: &[(Expr, Vec<Statement>)],
        otherwise: &[Statement],
        span: Span,
    ) -> Result<Flow> {
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

    pub(super) fn while_loop(&mut self, condition: &Expr, body: &[Statement], span: Span) -> Result<Flow> {
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

    /// Waits for a condition: one that is true ends at once, any other does with an option.
    pub(crate) fn wait_for(&mut self, condition: Value, at: Span, span: Span) -> Result<()> {
        match condition {
            Value::Flag(true) => Ok(()),
            _ if self.recorder.options.waits_are_over => {
                self.recorder.note("waiting for the outside is taken as over at once", span);
                self.recorder.stop();
                Ok(())
            }
            Value::Flag(false) => {
                fail(span, "this condition never becomes true, so the program waits for ever: take the line out")
            }
            Value::Outside(what) => {
                fail(span, format!("{}; or let waiting be over at once (`waits_are_over`)", depends(&what)))
            }
            other => fail(at, format!("a truth value is expected, this is {}", other.kind())),
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

    pub(super) fn repeat_loop(&mut self, body: &[Statement], until: &Expr, span: Span) -> Result<Flow> {
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

    pub(super) fn for_loop(
        &mut self,
        name: &Rc<str>,
        range: [Option<&Expr>; 3],
        body: &[Statement],
        span: Span,
    ) -> Result<Flow> {
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

    pub(super) fn switch(
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
