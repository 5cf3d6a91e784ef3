//! Properties by name: one table for the document, and one for each macro call and namespace.
//!
//! A name missing in a table is looked up in its parent: that of the caller, as in ROS's xacro.
//! Texts are evaluated at first use.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use flexarm_settings::Place;

use super::expression::value::{Value, float_of, int_of};
use super::expression::{ExpressionError, KEYWORDS};
use super::{Interpreter, boolean};

pub(crate) type Scope = Rc<Table>;

/// Properties of one scope.
pub(crate) struct Table {
    entries: RefCell<HashMap<String, Entry>>,
    parent: Option<Scope>,
    /// Whether it was created by an include with a namespace.
    is_namespace: bool,
}

#[derive(Clone)]
struct Entry {
    value: Value,
    state: State,
    at: Option<Place>,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    /// Text that was not evaluated yet.
    Unevaluated,
    Evaluating,
    Known,
}

impl Table {
    pub(crate) fn root() -> Scope {
        Rc::new(Self { entries: RefCell::default(), parent: None, is_namespace: false })
    }

    pub(crate) fn child(parent: &Scope) -> Scope {
        Rc::new(Self { entries: RefCell::default(), parent: Some(parent.clone()), is_namespace: false })
    }

    pub(crate) fn namespace(parent: &Scope) -> Scope {
        Rc::new(Self { entries: RefCell::default(), parent: Some(parent.clone()), is_namespace: true })
    }

    /// Defines a known value.
    pub(crate) fn define(&self, name: &str, value: Value) {
        self.put(name, value, State::Known, None);
    }

    /// Sets a value from an attribute: text may be converted to a number, and is evaluated later if
    /// `lazy`.
    pub(crate) fn set(&self, name: &str, value: Value, lazy: bool, at: &Place) {
        let value = literal(value);
        let unevaluated = lazy && matches!(value, Value::Str(_));
        let state = if unevaluated { State::Unevaluated } else { State::Known };
        self.put(name, value, state, Some(at.clone()));
    }

    fn put(&self, name: &str, value: Value, state: State, at: Option<Place>) {
        self.entries.borrow_mut().insert(name.to_owned(), Entry { value, state, at });
    }

    pub(crate) fn contains(&self, name: &str) -> bool {
        self.entries.borrow().contains_key(name) || self.parent.as_ref().is_some_and(|p| p.contains(name))
    }

    /// Removes a name here and in all parent tables.
    pub(crate) fn remove(&self, name: &str) {
        self.entries.borrow_mut().remove(name);
        if let Some(parent) = &self.parent {
            parent.remove(name);
        }
    }

    /// Names that are visible here.
    pub(crate) fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.entries.borrow().keys().filter(|n| !n.starts_with('*')).cloned().collect();
        names.extend(self.parent.iter().flat_map(|p| p.names()));
        names.sort();
        names.dedup();
        names
    }
}

/// Returns the table of the document.
pub(crate) fn top(scope: &Scope) -> Scope {
    let mut table = scope;
    while let Some(parent) = &table.parent {
        table = parent;
    }
    table.clone()
}

/// Target of `scope="parent"`: the scope outside the macro, skipping the namespaces of the call.
pub(crate) fn outer(scope: &Scope) -> Option<Scope> {
    let mut target = scope.parent.clone()?;
    while !scope.is_namespace && target.is_namespace {
        let Some(parent) = target.parent.clone() else { break };
        target = parent;
    }
    Some(target)
}

/// Removes single quotes from text; converts text to a number or a Boolean if possible.
fn literal(value: Value) -> Value {
    let Value::Str(text) = &value else { return value };
    if text.len() >= 2 && text.starts_with('\'') && text.ends_with('\'') {
        return Value::text(&text[1..text.len() - 1]);
    }
    // Python would read 1_000 as a number; names such as 2_1 remain text.
    if text.contains('_') {
        return value;
    }
    let number = int_of(text).map(Value::Int).or_else(|| float_of(text).map(Value::Float));
    number.or_else(|| boolean(&value).map(Value::Bool)).unwrap_or(value)
}

/// Whether a property may have this name, which must be a Python identifier.
pub(crate) fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && letters.all(|c| c.is_alphanumeric() || c == '_')
        && !KEYWORDS.contains(&name)
}

impl Interpreter<'_> {
    /// Value of a name in a scope; a text is evaluated now, in the table that contains it.
    pub(crate) fn property(&mut self, scope: &Scope, name: &str) -> Result<Option<Value>, ExpressionError> {
        let mut table = scope;
        // Innermost table that has the name.
        let entry = loop {
            self.charge(1)?;
            if let Some(entry) = table.entries.borrow().get(name) {
                break entry.clone();
            }
            match &table.parent {
                Some(parent) => table = parent,
                None => return Ok(None),
            }
        };
        match entry.state {
            State::Known => Ok(Some(entry.value)),
            State::Evaluating => Err(ExpressionError::new(format!("the property {name:?} is defined by itself"))
                .help("give it another name, or write lazy_eval=\"false\" to use the value that it had before")),
            State::Unevaluated => {
                // The mark finds a property that refers to itself.
                table.put(name, entry.value.clone(), State::Evaluating, entry.at.clone());
                self.deeper()?;
                let value = self.text(&entry.value.shown(), table).map_err(|trouble| match &entry.at {
                    Some(at) => trouble.within(format!("in the property {name:?} ({at})")),
                    None => trouble,
                })?;
                self.depth -= 1;
                let value = literal(value);
                table.put(name, value.clone(), State::Known, entry.at);
                Ok(Some(value))
            }
        }
    }
}
