//! Well-formedness and positions: describes the first syntax error of a broken file, and its place.
//!
//! Start at [`parse`] and [`Lines`]. Lines and columns count from 1, columns in characters.
//! Not here: the meaning of elements ([`crate::lint`]), a tree that can be changed
//! (`crate::xacro::document`).

use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

use flexarm_settings::{Finding, Place};
use roxmltree::{Document, Error, Node};

/// Start offsets of all lines, to convert byte offsets to places without scanning the text each
/// time.
pub struct Lines<'t> {
    file: Place,
    text: &'t str,
    starts: Vec<usize>,
    /// Origin of each line, if the text was generated from other files.
    origins: &'t [Place],
}

impl<'t> Lines<'t> {
    /// Finds the lines of a text.
    pub fn new(file: &Path, text: &'t str) -> Self {
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { file: Place::of_file(file.display()), text, starts, origins: &[] }
    }

    /// Sets the origins of the lines of a generated text.
    pub(crate) fn with_origins(self, origins: &'t [Place]) -> Self {
        Self { origins, ..self }
    }

    /// The place of a byte offset.
    pub(crate) fn place(&self, offset: usize) -> Place {
        let row = self.starts.partition_point(|&start| start <= offset) - 1;
        if let Some(origin) = self.origins.get(row) {
            return origin.clone();
        }
        let before = self.text.get(self.starts[row]..offset).unwrap_or("");
        self.file.at(row + 1, before.chars().count() + 1)
    }

    /// The place of the start tag of an element.
    pub(crate) fn of(&self, node: Node<'_, '_>) -> Place {
        self.place(node.range().start)
    }

    /// Place after the last character that is not white space: the end of a truncated file.
    fn end(&self) -> Place {
        self.place(self.text.trim_end().len())
    }
}

/// Returns the child elements.
pub(crate) fn elements<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

/// Returns the first child element of this name.
pub(crate) fn named<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    elements(node).find(|n| n.tag_name().name() == name)
}

/// Decodes UTF-8 without a byte order mark.
pub(crate) fn decode(bytes: Vec<u8>, file: &Path) -> Result<String, Box<Finding>> {
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let valid = String::from_utf8_lossy(&bytes[..at]);
        let place = Lines::new(file, &valid).place(at);
        let message = format!("the byte 0x{:02x} is not UTF-8 text", bytes[at]);
        let help = "save the file as UTF-8; is it a URDF at all?";
        Box::new(Finding::error("not-utf8", place.to_string(), message, help))
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Maximum number of attributes of an element, and of namespace declarations in a text, since
/// parsers compare every pair. Real descriptions have up to a hundred and a dozen.
const MAX_ATTRIBUTES: usize = 500;

/// Maximum number of prefixes that are declared for a text.
const MAX_PREFIXES: usize = 20;

/// Returns the tree of the text, or the first syntax error. Limits the attributes before any parser
/// sees them.
pub(crate) fn parse<'t>(text: &'t str, lines: &Lines<'_>) -> Result<Document<'t>, Box<Finding>> {
    if let Some((at, what)) = crowded(text) {
        return Err(Box::new(issue(lines.place(at), format!("more than {MAX_ATTRIBUTES} {what}"), "fewer")));
    }
    Document::parse(text).map_err(|error| Box::new(describe(text, lines, &error)))
}

/// Returns the text with all prefixes declared at its root, and those that it does not declare
/// itself with their places. Other readers of URDF ignore name spaces.
pub(crate) fn declared<'t>(text: &'t str, lines: &Lines<'_>) -> (Cow<'t, str>, Vec<(String, Place)>) {
    let mut missing: Vec<(String, Place)> = Vec::new();
    // Offset after the name of the root element, where declarations are inserted.
    let mut root = None;
    for (at, tag, _) in tags(text).filter(|(_, tag, _)| !tag[1..].starts_with(['!', '?', '/'])) {
        let name = tag.trim_start_matches('<').trim_start();
        let mut words = name.split_whitespace();
        let element = words.next().unwrap_or_default();
        root.get_or_insert(at + tag.len() - name.len() + element.trim_end_matches(['>', '/']).len());
        let attributes = words.filter_map(|word| Some(word.split_once('=')?.0));
        for (prefix, _) in std::iter::once(element).chain(attributes).filter_map(|name| name.split_once(':')) {
            let is_name = prefix.starts_with(char::is_alphabetic)
                && prefix.chars().all(|c| c.is_alphanumeric() || "_-.".contains(c));
            let known = ["xml", "xmlns", "xacro"].contains(&prefix) || missing.iter().any(|(name, _)| name == prefix);
            if is_name && !known && missing.len() < MAX_PREFIXES && !text.contains(&format!("xmlns:{prefix}")) {
                missing.push((prefix.to_owned(), lines.place(at)));
            }
        }
    }
    let Some(root) = root.filter(|_| !missing.is_empty()) else { return (text.into(), missing) };
    let declarations: String = missing.iter().map(|(name, _)| format!(" xmlns:{name}=\"undeclared\"")).collect();
    ((text[..root].to_owned() + &declarations + &text[root..]).into(), missing)
}

/// Returns the place and kind of an excess of attributes or namespaces.
fn crowded(text: &str) -> Option<(usize, &'static str)> {
    if let Some((at, _)) = text.match_indices("xmlns").nth(MAX_ATTRIBUTES) {
        return Some((at, "declared name spaces"));
    }
    // Parsers stop at a '<' within a tag.
    let elements = tags(text).filter_map(|(at, tag, _)| Some((at, tag[1..].split('<').next()?)));
    let mut elements = elements.filter(|(_, tag)| !tag.starts_with(['!', '?']));
    let crowded = elements.find(|(_, tag)| tag.match_indices('=').nth(MAX_ATTRIBUTES).is_some());
    crowded.map(|(at, _)| (at, "attributes in one element"))
}

fn describe(text: &str, lines: &Lines<'_>, error: &Error) -> Finding {
    if matches!(error, Error::DtdDetected) {
        let place = lines.place(text.find("<!DOCTYPE").unwrap_or(0));
        return issue(place, "a document type declaration", "plain XML: remove <!DOCTYPE ...> and what it declares");
    }
    // For a truncated file, name the element that is still open.
    let cut_off = matches!(error, Error::UnclosedRootNode | Error::UnexpectedEndOfStream | Error::NoRootNode)
        || position(lines, error).is_none_or(|place| place.line >= lines.end().line && ends_inside(text));
    if cut_off {
        let expected = match innermost_open(text) {
            _ if text.trim().is_empty() => "<robot name=\"...\">".to_owned(),
            Open::InsideTag(name, at) => {
                format!("the rest of <{name} ...>, which starts at {}", lines.place(at))
            }
            Open::Element(name, at) => format!("</{name}>, which is opened at {}", lines.place(at)),
            Open::Nothing => "an XML element <robot>".to_owned(),
        };
        return issue(lines.end(), "the end of the file", expected);
    }

    let place = position(lines, error).unwrap_or_else(|| lines.place(0));
    match error {
        Error::UnexpectedCloseTag(expected, actual, _) => {
            issue(place, format!("</{actual}>"), format!("</{expected}>"))
        }
        Error::InvalidChar(expected, actual, _) => issue(place, shown(*actual), shown(*expected)),
        Error::InvalidChar2(expected, actual, _) => issue(place, shown(*actual), *expected),
        Error::InvalidString(expected, _) => issue(place, "something else", format!("{expected:?}")),
        Error::DuplicatedAttribute(name, _) => {
            issue(place, format!("a second attribute {name:?}"), "each attribute once")
        }
        Error::UnknownNamespace(name, _) => {
            issue(place, format!("the undeclared prefix {name:?}"), format!("xmlns:{name}=\"...\" at the root element"))
        }
        Error::UnknownEntityReference(name, _) => issue(place, format!("the unknown entity &{name};"), "plain text"),
        Error::NonXmlChar(c, _) => issue(place, format!("the character {c:?}"), "text"),
        Error::InvalidAttributeValue(_) => issue(place, "'<' inside an attribute value", "a closing quote before it"),
        other => issue(place, other.to_string(), "well-formed XML"),
    }
}

/// Error about a text that is truncated or not well-formed XML.
pub(crate) fn issue(place: Place, found: impl Display, expected: impl Display) -> Finding {
    let help = "is the file complete? Export or copy it again, or mend it here";
    Finding::error("malformed-xml", place.to_string(), format!("found {found}, expected {expected}"), help)
}

fn shown(byte: u8) -> String {
    format!("{:?}", char::from(byte))
}

/// Place of an error, if it has one.
fn position(lines: &Lines<'_>, error: &Error) -> Option<Place> {
    let without = matches!(
        error,
        Error::NoRootNode
            | Error::UnclosedRootNode
            | Error::DtdDetected
            | Error::NodesLimitReached
            | Error::AttributesLimitReached
            | Error::NamespacesLimitReached
            | Error::UnexpectedEndOfStream
    );
    let pos = error.pos();
    (!without).then(|| lines.file.at(pos.row as usize, pos.col as usize))
}

/// Whether the text ends within a tag, as truncated files usually do.
fn ends_inside(text: &str) -> bool {
    matches!(innermost_open(text), Open::InsideTag(..))
}

enum Open<'t> {
    Nothing,
    /// An element without end tag, and the offset of its start tag.
    Element(&'t str, usize),
    /// A tag without '>'.
    InsideTag(&'t str, usize),
}

/// Returns the innermost open element or tag at the end of the text.
fn innermost_open(text: &str) -> Open<'_> {
    let mut stack: Vec<(&str, usize)> = Vec::new();
    for (start, tag, whole) in tags(text) {
        let name_end = tag[1..]
            .find(|c: char| c.is_whitespace() || c == '>' || c == '<' || (c == '/' && !tag.starts_with("</")))
            .map_or(tag.len(), |i| i + 1);
        let name = tag[1..name_end].trim_start_matches('/');
        if !whole {
            return Open::InsideTag(name, start);
        }
        if tag.starts_with("</") {
            stack.pop();
        } else if !tag.starts_with("<!") && !tag.starts_with("<?") && !tag.ends_with("/>") {
            stack.push((name, start));
        }
    }
    stack.pop().map_or(Open::Nothing, |(name, at)| Open::Element(name, at))
}

/// Returns the tags, comments, CDATA sections etc. of a text: offset, text, and whether the end
/// exists. The scan tolerates malformed text.
fn tags(text: &str) -> impl Iterator<Item = (usize, &str, bool)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + text[at..].find('<')?;
        let rest = &text[start..];
        let (skip, close) = if rest.starts_with("<!--") {
            (4, "-->")
        } else if rest.starts_with("<![CDATA[") {
            (9, "]]>")
        } else if rest.starts_with("<?") {
            (2, "?>")
        } else {
            (1, ">")
        };
        let end = tag_end(rest, skip, close);
        at = end.map_or(text.len(), |end| start + end);
        Some((start, &text[start..at], end.is_some()))
    })
}

/// Length of the tag at the start of `rest`; quotes are respected.
fn tag_end(rest: &str, skip: usize, close: &str) -> Option<usize> {
    if close != ">" {
        return rest[skip..].find(close).map(|i| skip + i + close.len());
    }
    let mut quote = None;
    for (i, c) in rest.char_indices() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (None, '>') => return Some(i + 1),
            (Some(q), c) if q == c => quote = None,
            _ => {}
        }
    }
    None
}

/// Escapes text for XML.
pub(crate) fn escaped(text: &str, in_attribute: bool) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' if in_attribute => out.push_str(&format!("&#{};", u32::from(c))),
            '\r' => out.push_str("&#13;"),
            // Characters that cannot be represented in XML.
            c if c < ' ' && c != '\n' && c != '\t' => out.push(' '),
            '\u{fffe}' | '\u{ffff}' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
