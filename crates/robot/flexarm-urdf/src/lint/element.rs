//! Single elements: their attributes, read and checked.

use flexarm_settings::closest;
use roxmltree::Node;

use crate::lint::Lint;
use crate::xml::named;

/// An element, `None` if it is missing, and its name in messages.
pub(super) struct Part<'n, 'i> {
    pub(super) node: Option<Node<'n, 'i>>,
    pub(super) owner: String,
}

impl Lint<'_, '_> {
    /// Returns the first child of this name.
    pub(super) fn part<'n, 'i>(&self, node: Node<'n, 'i>, name: &str) -> Part<'n, 'i> {
        Part { node: named(node, name), owner: format!("{}, <{name}>", self.owner) }
    }

    /// Returns the first child of this name; reports a fault if it is missing.
    pub(super) fn needed<'n, 'i>(&mut self, node: Node<'n, 'i>, name: &str) -> Part<'n, 'i> {
        let part = self.part(node, name);
        if part.node.is_none() {
            let message = format!("{} has no <{name}>", self.outer(node));
            self.report.error(&self.lines.of(node), "missing-element", message, format!("add <{name} .../>"));
        }
        part
    }

    /// Returns the numbers of an attribute, which is required if it has no default. Those of a missing
    /// element and those that cannot be read are the default, or else zeros.
    pub(super) fn numbers<const N: usize>(
        &mut self,
        part: &Part<'_, '_>,
        attribute: &str,
        default: Option<[f64; N]>,
    ) -> [f64; N] {
        let found = match default {
            Some(_) => part.node.and_then(|node| node.attribute(attribute)),
            None => self.required(part, attribute),
        };
        let number = |word: &str| word.parse().ok().filter(|x: &f64| x.is_finite());
        let read = |found: &str| found.split_whitespace().map(number).collect::<Option<Vec<_>>>()?.try_into().ok();
        let expected = match N {
            1 => "a finite number",
            3 => "three finite numbers",
            _ => "four finite numbers",
        };
        let numbers =
            found.and_then(|found| read(found).or_else(|| self.not_a_number(part, attribute, found, expected)));
        numbers.or(default).unwrap_or([0.0; N])
    }

    /// Returns one number of an attribute; see [`Lint::numbers`].
    pub(super) fn number(&mut self, part: &Part<'_, '_>, attribute: &str, default: Option<f64>) -> f64 {
        self.numbers(part, attribute, default.map(|x| [x]))[0]
    }

    /// Returns a number that may be infinite, if there is one.
    pub(super) fn bound(&mut self, part: &Part<'_, '_>, attribute: &str) -> Option<f64> {
        let found = part.node?.attribute(attribute)?;
        let read = found.trim().parse().ok().filter(|x: &f64| !x.is_nan());
        read.or_else(|| self.not_a_number(part, attribute, found, "a number"))
    }

    /// Reports an attribute that is not a number, or NaN or infinite.
    fn not_a_number<T>(&mut self, part: &Part<'_, '_>, attribute: &str, found: &str, expected: &str) -> Option<T> {
        let message = format!("{}: {attribute}={found:?}, expected {expected}", part.owner);
        let help = "write plain decimal numbers such as 0.1 or -1.5e-3, separated by spaces";
        self.report.error(&self.lines.of(part.node?), "not-a-number", message, help);
        None
    }

    /// Returns a name in an attribute; reports a fault if it is missing or blank.
    pub(super) fn name_in(&mut self, part: &Part<'_, '_>, attribute: &str) -> String {
        let blank = part.node.and_then(|node| node.attribute(attribute)).is_some_and(|name| name.trim().is_empty());
        let name = if blank { self.missing(part, attribute) } else { self.required(part, attribute) };
        name.unwrap_or_default().to_owned()
    }

    /// Returns the name of a link or joint and sets it as the owner in later messages.
    pub(super) fn name(&mut self, node: Node<'_, '_>) -> Option<String> {
        let tag = node.tag_name().name();
        let name = self.name_in(&Part { node: Some(node), owner: format!("<{tag}>") }, "name");
        self.owner = format!("{tag} {name:?}");
        Some(name).filter(|name| !name.is_empty())
    }

    /// Returns the name of an element for messages about its children.
    pub(super) fn outer(&self, node: Node<'_, '_>) -> String {
        match node.tag_name().name() {
            "link" | "joint" => self.owner.clone(),
            tag => format!("{}, <{tag}>", self.owner),
        }
    }

    /// Returns an attribute; reports a fault if the element is without it.
    pub(super) fn required<'n>(&mut self, part: &Part<'n, '_>, attribute: &str) -> Option<&'n str> {
        part.node?.attribute(attribute).or_else(|| self.missing(part, attribute))
    }

    fn missing<T>(&mut self, part: &Part<'_, '_>, attribute: &str) -> Option<T> {
        let message = format!("{} has no attribute {attribute:?}", part.owner);
        let help = format!("add {attribute}=\"...\"");
        self.report.error(&self.lines.of(part.node?), "missing-attribute", message, help);
        None
    }

    /// Warns about an element that is neither URDF nor a known extension, and thus probably
    /// misspelt.
    pub(super) fn known_element(&mut self, node: Node<'_, '_>, known: &str) {
        let name = node.tag_name().name();
        if node.tag_name().namespace().is_some() || known.split(' ').any(|word| word == name) {
            return;
        }
        let help = match closest(name, known.split(' ')) {
            Some(meant) => format!("did you mean <{meant}>?"),
            None => format!("remove it, or use one of {}", known.replace(' ', ", ")),
        };
        let message = format!("{}: the element <{name}> is not URDF and is ignored", self.owner);
        self.report.warning(&self.lines.of(node), "unknown-element", message, help);
    }
}
