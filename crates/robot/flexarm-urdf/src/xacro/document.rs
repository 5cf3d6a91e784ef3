//! XML as a tree that can be copied, with the place of every element; parsing and writing.
//!
//! Start at [`parse`] and [`write`]. Not here: positions and syntax errors ([`crate::xml`]), the
//! meaning of elements ([`super::process`]).

use std::path::Path;
use std::rc::Rc;

use flexarm_settings::{Finding, Place};
use roxmltree::{Document, NodeType};

use crate::xml;

/// Maximum nesting depth of elements.
const MAX_NESTED: usize = 200;

/// An element with its attributes in the order of the file. Names include their prefixes, as in the
/// file.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Node>,
    pub(crate) at: Place,
}

/// Comments are omitted, since they have no effect.
#[derive(Clone, Debug)]
pub(crate) enum Node {
    Element(Rc<Element>),
    Text(String),
    /// Text that is not evaluated.
    Literal(String),
}

impl Element {
    pub(crate) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_str())
    }

    pub(crate) fn set_attribute(&mut self, name: &str, value: String) {
        match self.attributes.iter_mut().find(|(n, _)| n == name) {
            Some(slot) => slot.1 = value,
            None => self.attributes.push((name.to_owned(), value)),
        }
    }

    pub(crate) fn elements(&self) -> impl Iterator<Item = &Rc<Element>> {
        self.children.iter().filter_map(|node| if let Node::Element(element) = node { Some(element) } else { None })
    }
}

/// Parses a text and returns its root element.
pub(crate) fn parse(text: &str, file: &Path) -> Result<Element, Box<Finding>> {
    let lines = xml::Lines::new(file, text);
    let document = xml::parse(text, &lines)?;
    let deepest = document.descendants().find(|n| n.ancestors().nth(MAX_NESTED).is_some());
    if let Some(node) = deepest {
        return Err(Box::new(xml::issue(lines.of(node), format_args!("elements nested {MAX_NESTED} deep"), "fewer")));
    }
    Ok(element(&document, document.root_element(), &lines))
}

fn element(document: &Document<'_>, node: roxmltree::Node<'_, '_>, lines: &xml::Lines<'_>) -> Element {
    let text = document.input_text();
    let range = node.range();
    // The name with its prefix follows the bracket.
    let tag = text.get(range.start + 1..range.end).unwrap_or_default();
    let end = tag.find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(tag.len());
    let place = lines.of(node);
    let outer = node.parent_element();
    // Namespaces declared at this element, which `roxmltree` lists with those of its parents.
    let declared = node.namespaces().filter_map(|ns| {
        let known = outer.is_some_and(|o| o.namespaces().any(|n| n.name() == ns.name() && n.uri() == ns.uri()));
        let name = ns.name().map_or_else(|| "xmlns".to_owned(), |prefix| format!("xmlns:{prefix}"));
        (!known && ns.name() != Some("xml")).then(|| (name, ns.uri().to_owned()))
    });
    let plain = node.attributes().map(|a| {
        let name = text.get(a.range_qname()).unwrap_or(a.name());
        (name.to_owned(), a.value().to_owned())
    });
    let attributes = declared.chain(plain).collect();
    let children = node.children().filter_map(|child| match child.node_type() {
        NodeType::Element => Some(Node::Element(Rc::new(element(document, child, lines)))),
        NodeType::Text => {
            let words = child.text().unwrap_or_default().to_owned();
            let literal = text.get(child.range()).is_some_and(|source| source.starts_with("<![CDATA["));
            Some(if literal { Node::Literal(words) } else { Node::Text(words) })
        }
        _ => None,
    });
    Element { name: tag[..end].to_owned(), attributes, children: children.collect(), at: place }
}

/// A document as text, and the origin of each of its lines.
pub(crate) struct ExpandedText {
    pub(crate) text: String,
    pub(crate) origins: Vec<Place>,
}

/// Writes an element with one line per tag. `namespaces` are declared at the root.
pub(crate) fn write(root: &Element, namespaces: &[(String, String)]) -> ExpandedText {
    let first = root.at.clone();
    let mut out = ExpandedText { text: "<?xml version=\"1.0\"?>\n".to_owned(), origins: vec![first] };
    write_element(root, namespaces, 0, &mut out);
    out
}

impl ExpandedText {
    fn line(&mut self, depth: usize, text: &str, at: &Place) {
        self.text.extend(std::iter::repeat_n("  ", depth));
        self.text.push_str(text);
        self.text.push('\n');
        let lines = text.matches('\n').count() + 1;
        self.origins.extend(std::iter::repeat_n(at.clone(), lines));
    }
}

/// Writes an element and its children, one per line, indented by depth.
fn write_element(element: &Element, namespaces: &[(String, String)], depth: usize, out: &mut ExpandedText) {
    let mut tag = format!("<{}", element.name);
    for (name, value) in element.attributes.iter().chain(namespaces) {
        tag.push_str(&format!(" {name}=\"{}\"", xml::escaped(value, true)));
    }
    let words = |node: &Node| match node {
        Node::Text(words) | Node::Literal(words) if !words.trim().is_empty() => Some(xml::escaped(words, false)),
        _ => None,
    };
    let has_content = element.children.iter().any(|node| matches!(node, Node::Element(_)) || words(node).is_some());
    // An element without content closes itself; one with text alone stays on its line.
    if !has_content {
        out.line(depth, &format!("{tag}/>"), &element.at);
        return;
    }
    let texts: Vec<String> = element.children.iter().filter_map(words).collect();
    if element.elements().next().is_none() {
        out.line(depth, &format!("{tag}>{}</{}>", texts.concat(), element.name), &element.at);
        return;
    }
    out.line(depth, &format!("{tag}>"), &element.at);
    for node in &element.children {
        match (node, words(node)) {
            (Node::Element(child), _) => write_element(child, &[], depth + 1, out),
            (_, Some(words)) => out.line(depth + 1, words.trim(), &element.at),
            (_, None) => {}
        }
    }
    out.line(depth, &format!("</{}>", element.name), &element.at);
}
