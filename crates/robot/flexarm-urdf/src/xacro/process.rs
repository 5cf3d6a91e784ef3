//! Processing of xacro elements in the order of the file.
//!
//! Start at [`Interpreter::element`], for an element that remains, and [`Interpreter::child`],
//! which distinguishes the elements of xacro. Later elements use what earlier ones define. Not
//! here: macros ([`super::macros`]), text of attributes ([`super::text`]).

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::document::{Element, Node, parse};
use super::expression::value::Value;
use super::expression::{ExpressionError, is_built_in};
use super::macros::Macros;
use super::scope::{self, Scope, Table};
use super::{Content, ELEMENT, Interpreter, MAX_FILES, Outcome, boolean};
use flexarm_settings::{Finding, Place, Severity};

impl Interpreter<'_> {
    /// Evaluates an element that is not xacro's, with all its content.
    pub(super) fn element(&mut self, element: &Element, macros: &Rc<Macros>, scope: &Scope) -> Outcome<Element> {
        let at = &element.at;
        self.charge(ELEMENT + 60 * element.attributes.len()).map_err(|e| self.fault(at, e))?;
        self.deeper().map_err(|e| self.fault(at, e))?;
        self.at = at.clone();
        let mut done = Element {
            name: element.name.clone(),
            attributes: Vec::with_capacity(element.attributes.len()),
            children: Vec::new(),
            at: at.clone(),
        };
        for (name, value) in &element.attributes {
            if name.starts_with("xmlns:") {
                self.declare(name, value);
            } else if !name.starts_with("xacro:") {
                let text =
                    self.shown_text(value, scope).map_err(|e| self.fault(at, e.within(format!("{name}=..."))))?;
                done.attributes.push((name.clone(), text));
            }
        }
        let content = self.children(&element.children, macros, scope)?;
        done.children = content.nodes;
        content.attributes.into_iter().for_each(|(name, value)| done.set_attribute(&name, value));
        self.depth -= 1;
        Ok(done)
    }

    /// Collects namespaces, which are declared once, at the root of the result.
    fn declare(&mut self, name: &str, uri: &str) {
        if name != "xmlns:xacro" && !self.namespaces.iter().any(|(n, _)| n == name) {
            self.namespaces.push((name.to_owned(), uri.to_owned()));
        }
    }

    /// Processes nodes in sequence: later ones may use what earlier ones define.
    pub(super) fn children(&mut self, nodes: &[Node], macros: &Rc<Macros>, scope: &Scope) -> Outcome<Content> {
        let mut content = Content::default();
        for node in nodes {
            match node {
                Node::Literal(text) => content.nodes.push(Node::Literal(text.clone())),
                Node::Text(text) => {
                    let at = self.at.clone();
                    let text = self.shown_text(text, scope).map_err(|e| self.fault(&at, e))?;
                    content.nodes.push(Node::Text(text));
                }
                Node::Element(element) => self.child(element, macros, scope, &mut content)?,
            }
        }
        Ok(content)
    }

    fn child(
        &mut self,
        element: &Rc<Element>,
        macros: &Rc<Macros>,
        scope: &Scope,
        content: &mut Content,
    ) -> Outcome<()> {
        let at = &element.at;
        self.at = at.clone();
        let Some(name) = element.name.strip_prefix("xacro:") else {
            let done = self.element(element, macros, scope)?;
            content.nodes.push(Node::Element(Rc::new(done)));
            return Ok(());
        };
        self.charge(ELEMENT).map_err(|e| self.fault(at, e))?;
        self.deeper().map_err(|e| self.fault(at, e))?;
        match name {
            // Definitions leave nothing in the document.
            "property" => self.property_element(element, scope)?,
            "macro" => self.define_macro(element, macros)?,
            "arg" => self.declare_argument(element, scope)?,
            // These are replaced by other elements.
            "include" => content.nodes.extend(self.include(element, macros, scope)?),
            "insert_block" => content.nodes.extend(self.insert_block(element, macros, scope)?),
            "if" | "unless" => {
                let condition = self.required(element, "value")?.to_owned();
                let value = self.text(&condition, scope).map_err(|e| self.fault(at, e))?;
                let is_true = boolean(&value).ok_or_else(|| self.fault(at, not_boolean(&condition, &value)))?;
                if is_true == (name == "if") {
                    content.nodes.extend(self.children(&element.children, macros, scope)?.nodes);
                }
            }
            // These change the enclosing element, or make one with an evaluated name.
            "attribute" => {
                let name = self.attribute_text(element, "name", scope)?;
                let value = self.attribute_text(element, "value", scope)?;
                content.attributes.push((name, value));
            }
            "element" => {
                let name = self.attribute_text(element, "xacro:name", scope)?;
                let mut renamed = Element { name, ..(**element).clone() };
                renamed.attributes.retain(|(name, _)| name != "xacro:name");
                self.child(&Rc::new(renamed), macros, scope, content)?;
            }
            _ => content.nodes.extend(self.call_macro(element, macros, scope)?.nodes),
        }
        self.depth -= 1;
        Ok(())
    }

    /// A required attribute.
    pub(super) fn required<'e>(&mut self, element: &'e Element, name: &str) -> Outcome<&'e str> {
        element.attribute(name).ok_or_else(|| {
            let trouble = ExpressionError::new(format!("<{}> has no attribute {name:?}", element.name));
            self.fault(&element.at, trouble.help(format!("add {name}=\"...\"")))
        })
    }

    /// Evaluated text of a required attribute, which must not be empty.
    pub(super) fn attribute_text(&mut self, element: &Element, name: &str, scope: &Scope) -> Outcome<String> {
        let raw = self.required(element, name)?.to_owned();
        let text = self.shown_text(&raw, scope).map_err(|e| self.fault(&element.at, e))?;
        if text.is_empty() && name != "value" {
            let trouble = ExpressionError::new(format!("<{}>: the attribute {name:?} is empty", element.name));
            return Err(self.fault(&element.at, trouble));
        }
        Ok(text)
    }

    /// Warns about attributes that an element of xacro ignores.
    pub(super) fn expect_attributes(&mut self, element: &Element, known: &[&str]) {
        for (name, _) in &element.attributes {
            if !known.contains(&name.as_str()) && !name.starts_with("xmlns") {
                let message = format!("<{}>: the attribute {name:?} is not known and ignored", element.name);
                self.remark(Severity::Warning, "xacro-attribute", message, "is it misspelt?");
            }
        }
    }

    /// Handles `<xacro:arg name="..." default="..."/>`.
    fn declare_argument(&mut self, element: &Element, scope: &Scope) -> Outcome<()> {
        let name = self.required(element, "name")?.to_owned();
        self.declared_arguments.insert(name.clone());
        if self.arguments.contains_key(&name) {
            return Ok(());
        }
        // Without a default it is an error only where it is used.
        if element.attribute("default").is_some() {
            let default = self.required(element, "default")?.to_owned();
            let value = self.shown_text(&default, scope).map_err(|e| self.fault(&element.at, e))?;
            self.arguments.insert(name, value);
        }
        Ok(())
    }

    /// Handles `<xacro:property name="..." value="..."/>`, or with a block inside.
    fn property_element(&mut self, element: &Rc<Element>, scope: &Scope) -> Outcome<()> {
        let at = &element.at;
        let mut name = self.attribute_text(element, "name", scope)?;
        if !scope::is_name(&name) || name.starts_with("__") {
            let help = "a name starts with a letter, has letters, digits and _, and is not a Python keyword";
            return Err(
                self.fault(at, ExpressionError::new(format!("{name:?} cannot be the name of a property")).help(help))
            );
        }
        self.expect_attributes(element, &["name", "value", "default", "remove", "scope", "lazy_eval"]);
        let (mut value, default) = (element.attribute("value"), element.attribute("default"));
        let remove = self.flag(element, "remove", false, scope)?;
        if usize::from(value.is_some()) + usize::from(default.is_some()) + usize::from(remove) > 1 {
            let message = format!("the property {name:?} has more than one of value, default and remove");
            return Err(self.fault(at, ExpressionError::new(message).help("keep one of them")));
        }
        if remove && scope.contains(&name) {
            scope.remove(&name);
            return Ok(());
        }
        if default.is_some() {
            if scope.contains(&name) {
                return Ok(());
            }
            value = default;
        }
        if is_built_in(&name) {
            let message = format!("the property {name:?} hides what expressions know under that name");
            self.remark(Severity::Note, "xacro-hides", message, "choose another name");
        }
        let value = match value {
            Some(text) => Value::text(text),
            None => {
                name = format!("**{name}");
                Value::Block(element.clone())
            }
        };
        let lazy = self.flag(element, "lazy_eval", true, scope)?;
        let target = match element.attribute("scope") {
            Some("global") => Some(scope::top(scope)),
            Some("parent") => match scope::outer(scope) {
                Some(outer) => Some(outer),
                None => {
                    let message = format!("the property {name:?} has no scope=\"parent\" here and is left out");
                    self.remark(Severity::Warning, "xacro-scope", message, "remove scope=\"parent\"");
                    return Ok(());
                }
            },
            _ => None,
        };
        // A property set in another scope is evaluated in the current one.
        let eager = target.is_some() || !lazy;
        let value = match &value {
            Value::Str(text) if eager => self.text(text, scope).map_err(|e| self.fault(at, e))?,
            _ => value,
        };
        target.unwrap_or_else(|| scope.clone()).set(&name, value, !eager, at);
        Ok(())
    }

    /// Evaluates a Boolean attribute.
    fn flag(&mut self, element: &Element, name: &str, default: bool, scope: &Scope) -> Outcome<bool> {
        let Some(text) = element.attribute(name) else { return Ok(default) };
        let at = &element.at;
        let value = self.text(text, scope).map_err(|e| self.fault(at, e))?;
        boolean(&value).ok_or_else(|| self.fault(at, not_boolean(text, &value)))
    }

    /// Handles `<xacro:insert_block name="..."/>`.
    fn insert_block(&mut self, element: &Element, macros: &Rc<Macros>, scope: &Scope) -> Outcome<Vec<Node>> {
        let at = &element.at;
        let name = self.required(element, "name")?.to_owned();
        for (stars, content_only) in [("**", true), ("*", false)] {
            let found = self.property(scope, &format!("{stars}{name}")).map_err(|e| self.fault(at, e))?;
            let Some(Value::Block(block)) = found else { continue };
            if content_only {
                self.deeper().map_err(|e| self.fault(at, e))?;
                let content = self.children(&block.children, macros, scope)?;
                self.depth -= 1;
                return Ok(content.nodes);
            }
            let mut content = Content::default();
            // The block itself is inserted as it is, even if it is an element of xacro.
            let done = self.element(&block, macros, scope)?;
            content.nodes.push(Node::Element(Rc::new(done)));
            return Ok(content.nodes);
        }
        let trouble = ExpressionError::new(format!("there is no block {name:?}"));
        let help = "it needs a parameter *name of the macro, or a <xacro:property name=\"...\"> with elements inside";
        Err(self.fault(at, trouble.help(help)))
    }

    /// Handles `<xacro:include filename="..." ns="..." optional="..."/>`.
    fn include(&mut self, element: &Element, macros: &Rc<Macros>, scope: &Scope) -> Outcome<Vec<Node>> {
        let at = &element.at;
        self.expect_attributes(element, &["filename", "ns", "optional"]);
        let spec = self.attribute_text(element, "filename", scope)?;
        let optional = self.flag(element, "optional", false, scope)?;
        let (macros, scope) = match element.attribute("ns") {
            Some(_) => {
                let name = self.attribute_text(element, "ns", scope)?;
                let (inner_macros, inner_scope) = (Macros::new(), Table::namespace(scope));
                macros.add_namespace(&name, inner_macros.clone());
                scope.define(&name, Value::Namespace(inner_scope.clone()));
                (inner_macros, inner_scope)
            }
            None => (macros.clone(), scope.clone()),
        };
        let mut nodes = Vec::new();
        for path in self.matching(&spec, at)? {
            if optional && !path.is_file() {
                continue;
            }
            nodes.extend(self.included(&path, at, &macros, &scope)?);
        }
        Ok(nodes)
    }

    /// Reads an included file, and expands it in the place of the include.
    fn included(&mut self, path: &Path, at: &Place, macros: &Rc<Macros>, scope: &Scope) -> Outcome<Vec<Node>> {
        if self.files.len() >= MAX_FILES {
            let trouble = ExpressionError::new(format!("files include each other more than {MAX_FILES} deep"));
            return Err(self.fault(at, trouble.help("does a file include itself?")));
        }
        let text = self.read(path).map_err(|e| self.fault(at, e))?;
        let file: Rc<Path> = path.into();
        let root = parse(&text, &file).map_err(|issue| {
            Box::new(Finding {
                code: "xacro".into(),
                message: format!("{}\n  included from {at}", issue.message),
                ..*issue
            })
        })?;
        self.charge(2 * text.len()).map_err(|e| self.fault(at, e))?;
        for (name, value) in &root.attributes {
            if name.starts_with("xmlns:") {
                self.declare(name, value);
            }
        }
        self.files.push(file);
        let content = self.children(&root.children, macros, scope)?;
        self.files.pop();
        Ok(content.nodes)
    }

    /// Files that a name refers to: one, or all that match its `*`, `?` and `[...]`, ordered by
    /// name.
    fn matching(&mut self, spec: &str, at: &Place) -> Outcome<Vec<PathBuf>> {
        let path = self.beside(spec);
        if !spec.contains(['*', '?', '[']) || path.is_file() {
            return Ok(vec![path]);
        }
        // Folders that match the parts of the path so far.
        let mut found = vec![PathBuf::new()];
        for part in path.components() {
            let name = part.as_os_str().to_string_lossy().into_owned();
            if !name.contains(['*', '?', '[']) {
                found.iter_mut().for_each(|folder| folder.push(part));
                continue;
            }
            // Entries that match this part; hidden ones only if the pattern starts with a dot.
            let mut next = Vec::new();
            for folder in &found {
                let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
                for entry in std::fs::read_dir(here).into_iter().flatten().flatten() {
                    self.charge(100).map_err(|e| self.fault(at, e))?;
                    let entry = entry.file_name();
                    let shown = entry.to_string_lossy();
                    if fits(&name, &shown) && (name.starts_with('.') || !shown.starts_with('.')) {
                        next.push(folder.join(&entry));
                    }
                }
            }
            found = next;
        }
        found.retain(|path| path.exists());
        found.sort();
        if found.is_empty() {
            let message = format!("no file fits {spec:?}");
            self.remark(Severity::Warning, "xacro-include", message, "correct the name, or remove the include");
        }
        Ok(found)
    }
}

fn not_boolean(text: &str, value: &Value) -> ExpressionError {
    let trouble =
        ExpressionError::new(format!("the condition {text:?} is {}, which is neither true nor false", value.repr()));
    trouble.help("expected are true, false, a number or a comparison; texts are compared as ${x == 'a'}")
}

/// Whether a name matches a pattern of `*`, `?` and `[...]`.
pub fn fits(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    // Position of the last star, and of the name part that it has consumed.
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        match one(&pattern[p..], name[n]) {
            Some(length) => (p, n) = (p + length, n + 1),
            None if pattern.get(p) == Some(&'*') => {
                star = Some((p, n));
                p += 1;
            }
            None => match star {
                Some((at, taken)) => {
                    star = Some((at, taken + 1));
                    (p, n) = (at + 1, taken + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// Length of the pattern's first part if it matches the character.
fn one(pattern: &[char], letter: char) -> Option<usize> {
    match pattern.first()? {
        '*' => None,
        '?' => Some(1),
        '[' => {
            let close = pattern.iter().skip(2).position(|c| *c == ']').map(|at| at + 2);
            let Some(close) = close else { return (letter == '[').then_some(1) };
            let negated = pattern[1] == '!';
            let set = &pattern[1 + usize::from(negated)..close];
            let mut inside = set.contains(&letter);
            for range in set.windows(3).filter(|w| w[1] == '-') {
                inside = inside || (range[0]..=range[2]).contains(&letter);
            }
            (inside != negated).then_some(close + 1)
        }
        c => (*c == letter).then_some(1),
    }
}
