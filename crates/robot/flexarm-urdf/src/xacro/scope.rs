//! Properties by name: one table for the document, one for each macro call and each namespace.
//!
//! A name that a table does not have is looked for in the one it was made from: that of the caller,
//! as ROS's xacro does. Texts are evaluated at their first use.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use super::document::At;
use super::expression::value::{Value, float_of, int_of};
use super::expression::{KEYWORDS, Trouble};
use super::{Interpreter, boolean};

pub(crate) type Scope = Rc<Table>;

/// Properties of one place in the document.
pub(crate) struct Table {
    entries: RefCell<HashMap<String, Entry>>,
    parent: Option<Scope>,
    /// Made by an include with a namespace.
    is_namespace: bool,
}

#[derive(Clone)]
struct Entry {
    value: Value,
    state: State,
    at: Option<At>,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    /// A text that was not looked at.
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

    /// A value that is known.
    pub(crate) fn define(&self, name: &str, value: Value) {
        self.put(name, value, State::Known, None);
    }

    /// A value as an attribute gives it: text may be a number, and is evaluated later if `lazy`.
    pub(crate) fn set(&self, name: &str, value: Value, lazy: bool, at: &At) {
        let value = literal(value);
        let unevaluated = lazy && matches!(value, Value::Str(_));
        let state = if unevaluated { State::Unevaluated } else { State::Known };
        self.put(name, value, state, Some(at.clone()));
    }

    fn put(&self, name: &str, value: Value, state: State, at: Option<At>) {
        self.entries.borrow_mut().insert(name.to_owned(), Entry { value, state, at });
    }

    pub(crate) fn contains(&self, name: &str) -> bool {
        self.entries.borrow().contains_key(name) || self.parent.as_ref().is_some_and(|p| p.contains(name))
    }

    /// Removes a name here and in all tables that this one was made from.
    pub(crate) fn remove(&self, name: &str) {
        self.entries.borrow_mut().remove(name);
        if let Some(parent) = &self.parent {
            parent.remove(name);
        }
    }

    /// Names that can be used here.
    pub(crate) fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.entries.borrow().keys().filter(|n| !n.starts_with('*')).cloned().collect();
        names.extend(self.parent.iter().flat_map(|p| p.names()));
        names.sort();
        names.dedup();
        names
    }
}

/// The table of the document.
pub(crate) fn top(scope: &Scope) -> Scope {
    let mut table = scope;
    while let Some(parent) = &table.parent {
        table = parent;
    }
    table.clone()
}

/// Where `scope="parent"` leads: out of the macro, past the namespaces that it was called through.
pub(crate) fn outer(scope: &Scope) -> Option<Scope> {
    let mut target = scope.parent.clone()?;
    while !scope.is_namespace && target.is_namespace {
        let Some(parent) = target.parent.clone() else { break };
        target = parent;
    }
    Some(target)
}

/// Text in single quotes loses them; text that is a number or a Boolean becomes one.
fn literal(value: Value) -> Value {
    let Value::Str(text) = &value else { return value };
    if text.len() >= 2 && text.starts_with('\'') && text.ends_with('\'') {
        return Value::text(&text[1..text.len() - 1]);
    }
    // Python would read 1_000 as a number: names such as 2_1 stay text
    if text.contains('_') {
        return value;
    }
    let number = int_of(text).map(Value::Int).or_else(|| float_of(text).map(Value::Float));
    number.or_else(|| boolean(&value).map(Value::Bool)).unwrap_or(value)
}

/// Whether a property may be called so: as a variable of Python.
pub(crate) fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && letters.all(|c| c.is_alphanumeric() || c == '_')
        && !KEYWORDS.contains(&name)
}

impl Interpreter<'_> {
    /// The value of a name in a scope; a text is evaluated now, in the table that holds it.
    pub(crate) fn property(&mut self, scope: &Scope, name: &str) -> Result<Option<Value>, Trouble> {
        let mut table = scope;
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
            State::Evaluating => Err(Trouble::new(format!("the property {name:?} is defined by itself"))
                .help("give it another name, or write lazy_eval=\"false\" to use the value that it had before")),
            State::Unevaluated => {
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
