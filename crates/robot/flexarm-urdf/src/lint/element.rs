//! Single elements: their attributes, checked and written to the plain text.
//!
//! Start at [`Lint::element`]. A fault is reported, and zeros replace the value, so that `urdf_rs`
//! reads the rest. Not here: which elements a robot has ([`super`]), kinds of values
//! ([`super::attribute`]).

use std::fmt::Write as _;

use flexarm_settings::{Place, closest};
use roxmltree::Node;

use crate::lint::Lint;
use crate::lint::attribute::Attribute;
use crate::lint::attribute::Kind::{self, Name};
use crate::lint::attribute::Missing::{As, Fault, LeftOut};
use crate::xml::{escaped, named};

impl Lint<'_, '_> {
    /// Writes the first child of this name and returns its place. A missing required child is
    /// written with zeros.
    pub(super) fn child(
        &mut self,
        node: Node<'_, '_>,
        name: &'static str,
        must: bool,
        attributes: &[Attribute],
    ) -> Option<Place> {
        let found = if must { self.needed(node, name) } else { named(node, name) };
        if let Some(child) = found {
            self.element(child, &format!("{}, <{name}>", self.owner), attributes);
        } else if must {
            let zeros: Vec<_> = attributes.iter().map(|(name, kind, _)| (*name, kind.zero())).collect();
            self.start(name, &zeros);
            self.end(name);
        }
        found.map(|child| self.lines.of(child))
    }

    /// Writes an element with these attributes. Returns the numbers that could be read.
    pub(super) fn element(&mut self, node: Node<'_, '_>, owner: &str, attributes: &[Attribute]) -> Vec<f64> {
        let (mut all, mut written) = (Vec::new(), Vec::new());
        for &(attribute, kind, missing) in attributes {
            let found = match missing {
                Fault => self.required(node, owner, attribute, kind),
                LeftOut | As(_) => node.attribute(attribute),
            };
            let value = match (found, missing) {
                (Some(found), _) => match kind.numbers(found) {
                    Some(numbers) => {
                        all.extend(numbers);
                        found
                    }
                    None => {
                        self.not_a_number(&self.lines.of(node), owner, attribute, found, kind.expected());
                        kind.zero()
                    }
                },
                (None, LeftOut) => continue,
                (None, As(value)) => value,
                (None, Fault) => kind.zero(),
            };
            written.push((attribute, value));
        }
        self.start(node.tag_name().name(), &written);
        self.end(node.tag_name().name());
        all
    }

    pub(super) fn start(&mut self, element: &str, attributes: &[(&str, &str)]) {
        let _ = write!(self.text, "<{element}");
        for (name, value) in attributes {
            let _ = write!(self.text, " {name}=\"{}\"", escaped(value, true));
        }
        self.text.push('>');
    }

    pub(super) fn end(&mut self, element: &str) {
        let _ = write!(self.text, "</{element}>");
    }

    /// Returns the name of a link or joint and sets it as the owner in later messages.
    pub(super) fn name<'n>(&mut self, node: Node<'n, '_>) -> Option<&'n str> {
        let tag = node.tag_name().name();
        let name = self.required(node, &format!("<{tag}>"), "name", Name)?;
        self.owner = format!("{tag} {name:?}");
        Some(name)
    }

    /// Returns the name of an element for messages about its children.
    pub(super) fn outer(&self, node: Node<'_, '_>) -> String {
        match node.tag_name().name() {
            "link" | "joint" => self.owner.clone(),
            tag => format!("{}, <{tag}>", self.owner),
        }
    }

    /// Reports an attribute that is not a number, or NaN or infinite.
    pub(super) fn not_a_number(&mut self, place: &Place, owner: &str, attribute: &str, found: &str, expected: &str) {
        let message = format!("{owner}: {attribute}={found:?}, expected {expected}");
        let help = "write plain decimal numbers such as 0.1 or -1.5e-3, separated by spaces";
        self.report.error(place, "not-a-number", message, help);
    }

    /// Returns a child element; reports a fault if it is missing.
    pub(super) fn needed<'n, 'i>(&mut self, node: Node<'n, 'i>, element: &'static str) -> Option<Node<'n, 'i>> {
        let child = named(node, element);
        if child.is_none() {
            let owner = self.outer(node);
            let message = format!("{owner} has no <{element}>");
            self.report.error(&self.lines.of(node), "missing-element", message, format!("add <{element} .../>"));
        }
        child
    }

    /// Returns an attribute; reports a fault if it is missing.
    pub(super) fn required<'n>(
        &mut self,
        node: Node<'n, '_>,
        owner: &str,
        attribute: &'static str,
        kind: Kind,
    ) -> Option<&'n str> {
        let value = node.attribute(attribute).filter(|value| !matches!(kind, Name) || !value.trim().is_empty());
        if value.is_none() {
            let message = format!("{owner} has no attribute {attribute:?}");
            self.report.error(&self.lines.of(node), "missing-attribute", message, format!("add {attribute}=\"...\""));
        }
        value
    }

    /// Warns about an element that is neither URDF nor a known extension, and thus probably
    /// misspelt.
    pub(super) fn known_element(&mut self, node: Node<'_, '_>, known: &[&'static str]) {
        let name = node.tag_name().name();
        if node.tag_name().namespace().is_some() || known.contains(&name) {
            return;
        }
        let help = match closest(name, known.iter().copied()) {
            Some(meant) => format!("did you mean <{meant}>?"),
            None => format!("remove it, or use one of {}", known.join(", ")),
        };
        let message = format!("{}: the element <{name}> is not URDF and is ignored", self.owner);
        self.report.warning(&self.lines.of(node), "unknown-element", message, help);
    }
}
