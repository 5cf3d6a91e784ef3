//! Macros: definitions, parameters and calls.
//!
//! Start at [`Interpreter::define_macro`] and [`Interpreter::call_macro`]. The body of a macro is
//! processed in a scope of its own, below that of the caller.
//! Not here: other elements ([`super::process`]), tables of properties ([`super::scope`]).

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use flexarm_settings::{Place, closest};

use super::document::Element;
use super::expression::ExpressionError;
use super::expression::value::Value;
use super::scope::{Scope, Table};
use super::{Content, Interpreter, Outcome};
use crate::report::did_you_mean;

/// Maximum depth of nested calls; ROS's xacro fails at about 200.
const MAX_CALLS: usize = 300;

/// A macro definition.
pub(crate) struct Macro {
    name: String,
    parameters: Vec<Parameter>,
    body: Rc<Element>,
}

/// A parameter with its default.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, with `*` or `**` for a block.
    pub name: String,
    /// Whether the value is taken from the caller's property of that name (`^`).
    pub forwarded: bool,
    pub default: Option<String>,
}

/// Macros by name, and those of namespaces; other names are looked up in `outer`.
#[derive(Default)]
pub(crate) struct Macros {
    macros: RefCell<HashMap<String, Rc<Macro>>>,
    namespaces: RefCell<HashMap<String, Rc<Macros>>>,
    outer: Option<Rc<Macros>>,
}

impl Macros {
    pub(crate) fn new() -> Rc<Self> {
        Rc::new(Self::default())
    }

    fn within(outer: &Rc<Self>) -> Rc<Self> {
        Rc::new(Self { outer: Some(outer.clone()), ..Self::default() })
    }

    pub(crate) fn add_namespace(&self, name: &str, macros: Rc<Self>) {
        self.namespaces.borrow_mut().insert(name.to_owned(), macros);
    }

    fn find(&self, name: &str) -> Option<Rc<Macro>> {
        let own = self.macros.borrow().get(name).cloned();
        own.or_else(|| self.outer.as_ref().and_then(|outer| outer.find(name)))
    }

    fn namespace(&self, name: &str) -> Option<Rc<Self>> {
        let own = self.namespaces.borrow().get(name).cloned();
        own.or_else(|| self.outer.as_ref().and_then(|outer| outer.namespace(name)))
    }

    /// All names that can be called.
    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.macros.borrow().keys().cloned().collect();
        for (space, macros) in self.namespaces.borrow().iter() {
            names.extend(macros.names().iter().map(|name| format!("{space}.{name}")));
        }
        names.extend(self.outer.iter().flat_map(|outer| outer.names()));
        names.sort();
        names.dedup();
        names
    }
}

impl Interpreter<'_> {
    /// Handles `<xacro:macro name="..." params="...">`.
    pub(super) fn define_macro(&mut self, element: &Rc<Element>, macros: &Rc<Macros>) -> Outcome<()> {
        let name = self.required(element, "name")?;
        let name = name.strip_prefix("xacro:").unwrap_or(name);
        let at = &element.at;
        if name == "call" || name.contains('.') {
            let trouble = ExpressionError::new(format!("a macro cannot have the name {name:?}"));
            return Err(self.fault(at, trouble.help("dots are for namespaces, \"call\" is an element of xacro")));
        }
        let parameters = parameters(element.attribute("params").unwrap_or_default());
        self.expect_attributes(element, &["name", "params"]);
        self.defined_macros.insert(name.to_owned());
        let defined = Macro { name: name.to_owned(), parameters, body: element.clone() };
        macros.macros.borrow_mut().insert(name.to_owned(), Rc::new(defined));
        Ok(())
    }

    /// Handles `<xacro:NAME ...>` and `<xacro:call macro="NAME" ...>`.
    pub(super) fn call_macro(&mut self, element: &Element, macros: &Rc<Macros>, scope: &Scope) -> Outcome<Content> {
        let at = &element.at;
        let (name, skipped) = if element.name == "xacro:call" {
            (self.attribute_text(element, "macro", scope)?, Some("macro"))
        } else {
            (element.name["xacro:".len()..].to_owned(), None)
        };
        let (inner_macros, inner_scope, called) = self.resolve(&name, macros, scope, at)?;
        if self.calls.len() >= MAX_CALLS {
            let trouble = ExpressionError::new(format!("macros call each other more than {MAX_CALLS} deep"));
            return Err(self.fault(at, trouble.help("does a macro call itself without an end?")));
        }
        self.called_macros.insert(called.name.clone());
        self.calls.push((called.name.clone(), at.clone()));

        // Attributes give values of parameters; blocks and defaults give the rest.
        let local = Table::child(&inner_scope);
        let mut open: Vec<&Parameter> = called.parameters.iter().collect();
        for (name, value) in element.attributes.iter().filter(|(n, _)| Some(n.as_str()) != skipped) {
            if name.starts_with("xmlns") {
                continue;
            }
            let Some(k) = open.iter().position(|p| p.name == *name) else {
                return Err(self.fault(at, unknown_parameter(&called, name)));
            };
            open.remove(k);
            let value = self.text(value, scope).map_err(|e| self.fault(at, e.within(format!("{name}=..."))))?;
            local.set(name, value, false, at);
        }
        self.take_blocks(element, &called, &mut open, macros, scope, &local)?;
        self.take_defaults(&called, open, scope, &local, at)?;

        // The body may define macros that are visible only inside of it.
        let content = self.children(&called.body.children, &Macros::within(&inner_macros), &local)?;
        self.calls.pop();
        Ok(content)
    }

    /// Assigns the elements inside a call, evaluated in the caller's scope, to the block
    /// parameters.
    fn take_blocks(
        &mut self,
        element: &Element,
        called: &Macro,
        open: &mut Vec<&Parameter>,
        macros: &Rc<Macros>,
        scope: &Scope,
        local: &Scope,
    ) -> Outcome<()> {
        let at = &element.at;
        let content = self.children(&element.children, macros, scope)?;
        let evaluated = Element { children: content.nodes, ..element.clone() };
        let mut blocks = evaluated.elements();
        // Blocks are assigned in the order of the parameters; too few or too many are an error.
        let wanted: Vec<&Parameter> = open.iter().copied().filter(|p| p.name.starts_with('*')).collect();
        open.retain(|p| !p.name.starts_with('*'));
        for parameter in wanted {
            let Some(block) = blocks.next() else {
                let name = parameter.name.trim_start_matches('*');
                let trouble = ExpressionError::new(format!("the macro {:?} needs a block for {name:?}", called.name));
                return Err(self.fault(at, trouble.help("put an element inside of the call")));
            };
            local.define(&parameter.name, Value::Block(block.clone()));
        }
        match blocks.next() {
            Some(block) => {
                let trouble =
                    ExpressionError::new(format!("the macro {:?} takes no block <{}>", called.name, block.name));
                Err(self.fault(at, trouble.help("remove it, or add a parameter *name to the macro")))
            }
            None => Ok(()),
        }
    }

    /// Assigns the caller's property of the same name (`^`) or the default to the parameters that
    /// the call does not give.
    fn take_defaults(
        &mut self,
        called: &Macro,
        open: Vec<&Parameter>,
        scope: &Scope,
        local: &Scope,
        at: &Place,
    ) -> Outcome<()> {
        let mut missing = Vec::new();
        for parameter in open {
            let name = &parameter.name;
            let forwarded = match parameter.forwarded {
                true => self.property(scope, name).map_err(|e| self.fault(at, e))?,
                false => None,
            };
            // The default is evaluated in the caller's scope.
            let value = match (forwarded, &parameter.default) {
                (Some(value), _) => value,
                (None, Some(default)) => self.text(default, scope).map_err(|e| {
                    self.fault(at, e.within(format!("in the default of parameter {name:?} of macro {:?}", called.name)))
                })?,
                (None, None) => {
                    missing.push(format!("{name:?}"));
                    continue;
                }
            };
            local.set(name, value, false, at);
        }
        if missing.is_empty() {
            return Ok(());
        }
        let trouble =
            ExpressionError::new(format!("the macro {:?} is called without {}", called.name, missing.join(", ")));
        Err(self.fault(at, trouble.help("give it as an attribute of the call")))
    }

    /// Returns a macro with the tables for its call.
    fn resolve(
        &mut self,
        full: &str,
        macros: &Rc<Macros>,
        scope: &Scope,
        at: &Place,
    ) -> Outcome<(Rc<Macros>, Scope, Rc<Macro>)> {
        if let Some(found) = macros.find(full) {
            return Ok((macros.clone(), scope.clone(), found));
        }
        let mut names: Vec<&str> = full.split('.').collect();
        let name = names.pop().unwrap_or_default();
        // Each name before the last one is a namespace of macros and of properties.
        let (mut macros_there, mut scope_there) = (Some(macros.clone()), scope.clone());
        for space in names {
            macros_there = macros_there.and_then(|m| m.namespace(space));
            match self.property(&scope_there, space).map_err(|e| self.fault(at, e))? {
                Some(Value::Namespace(table)) => scope_there = table,
                _ => macros_there = None,
            }
        }
        let found = macros_there.clone().and_then(|m| m.find(name));
        let (Some(macros_there), Some(found)) = (macros_there, found) else {
            let trouble = ExpressionError::new(format!("there is no macro {full:?}"));
            let known = macros.names();
            return Err(self.fault(
                at,
                match closest(full, known.iter().map(String::as_str)) {
                    Some(meant) => trouble.help(format!("did you mean <xacro:{meant}>?")),
                    None => trouble.help("define it, or include the file that does, before it is called"),
                },
            ));
        };
        Ok((macros_there, scope_there, found))
    }
}

fn unknown_parameter(called: &Macro, name: &str) -> ExpressionError {
    let known: Vec<&str> = called.parameters.iter().map(|p| p.name.as_str()).collect();
    let trouble = ExpressionError::new(format!("the macro {:?} has no parameter {name:?}", called.name));
    trouble
        .help(did_you_mean(closest(name, known.iter().copied()), &format!("its parameters are {}", known.join(", "))))
}

/// Parses parameters such as `a b:=1 c:='x y' d:=${e} f:=^ g:=^|2 *block **blocks`.
pub fn parameters(text: &str) -> Vec<Parameter> {
    let mut found: Vec<Parameter> = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() {
        let end = rest.find(|c: char| c.is_whitespace() || c == ':' || c == '=').unwrap_or(rest.len());
        let behind = rest[end..].trim_start();
        let value = behind.strip_prefix(":=").or_else(|| behind.strip_prefix('='));
        let with_default = value.filter(|_| end > 0).and_then(|value| {
            let value = value.trim_start();
            let (forwarded, value) = match value.strip_prefix("^|").or_else(|| value.strip_prefix('^')) {
                Some(value) => (true, value),
                None => (false, value),
            };
            let length = default_length(value)?;
            let default = Some(value[..length].to_owned()).filter(|d| !d.is_empty());
            Some((Parameter { name: rest[..end].to_owned(), forwarded, default }, &value[length..]))
        });
        let (parameter, after) = with_default.unwrap_or_else(|| {
            let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
            (Parameter { name: rest[..end].to_owned(), forwarded: false, default: None }, &rest[end..])
        });
        found.push(parameter);
        rest = after.trim_start();
    }
    // A duplicate parameter counts once.
    let mut names = HashSet::new();
    found.retain(|p| names.insert(p.name.clone()));
    found
}

/// Length of the default at the start of a text, which ends before white space or at the end.
fn default_length(text: &str) -> Option<usize> {
    let ends_at = |at: usize| text[at..].chars().next().is_none_or(char::is_whitespace);
    for (open, close) in [("${", '}'), ("$(", ')')] {
        if text.starts_with(open) {
            let mut closings = text.match_indices(close).map(|(at, _)| at + 1);
            if let Some(end) = closings.find(|end| ends_at(*end)) {
                return Some(end);
            }
        }
    }
    let mut at = 0;
    while let Some(c) = text[at..].chars().next().filter(|c| !c.is_whitespace()) {
        at += match c {
            '\'' | '"' => text[at + 1..].find(c)? + 2,
            c => c.len_utf8(),
        };
    }
    Some(at)
}
