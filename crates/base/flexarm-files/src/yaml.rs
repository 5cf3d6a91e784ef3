//! YAML, including JSON, as trees of text. The caller interprets the text.
//!
//! Start at [`read_yaml`]. Nodes are counted while they are read, so that aliases of aliases cannot
//! fill the memory. Not here: meaning of keys and tags, JSON written by this program
//! (`serde_json`).

use std::borrow::Cow;
use std::collections::HashMap;

use saphyr_parser::{Event, Parser, ScalarStyle};

/// Maximum nesting depth of collections.
const MAX_NESTED: usize = 40;

/// Text or collection.
#[derive(Clone, Debug)]
pub struct YamlNode<'t> {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// Text, list or map.
    pub value: YamlValue<'t>,
}

/// Content of a node.
#[derive(Clone, Debug)]
pub enum YamlValue<'t> {
    /// Text, possibly a number.
    Scalar {
        /// The text, without its quotes.
        text: Cow<'t, str>,
        /// Whether it is unquoted.
        is_plain: bool,
        /// Tag without leading marks: `degrees` for `!degrees`.
        tag: Option<String>,
    },
    /// A list.
    List(Vec<YamlNode<'t>>),
    /// Alternating keys and values, in source order.
    Map(Vec<YamlNode<'t>>),
}

/// Error in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct YamlError {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// Cause, worded as the end of a sentence.
    pub message: String,
}

/// Node with its anchor, size and nesting depth.
#[derive(Clone)]
struct SizedNode<'t> {
    node: YamlNode<'t>,
    anchor: usize,
    size: usize,
    height: usize,
}

impl<'t> SizedNode<'t> {
    /// Appends an item to a collection.
    fn add(&mut self, item: Self) {
        self.size += item.size;
        self.height = self.height.max(item.height + 1);
        if let YamlValue::List(items) | YamlValue::Map(items) = &mut self.node.value {
            items.push(item.node);
        }
    }
}

/// Calls `take` with the root of each document in turn.
///
/// * `most`: maximum number of nodes. Anchored and aliased nodes count again, and every 32 bytes of
///   text count as one more node.
///
/// # Errors
/// [`YamlError`] for text that is not YAML, has more nodes or is nested more than 40 deep; and
/// errors returned by `take`.
pub fn read_yaml<'t, E: From<YamlError>>(
    text: &'t str,
    most: usize,
    mut take: impl FnMut(YamlNode<'t>) -> Result<(), E>,
) -> Result<(), E> {
    let (mut open, mut anchors, mut count) = (Vec::<SizedNode<'_>>::new(), HashMap::<usize, SizedNode<'_>>::new(), 0);
    for event in Parser::new_from_str(text) {
        let (event, span) = event.map_err(|error| {
            let (line, column) = (error.marker().line(), error.marker().col() + 1);
            YamlError { line, column, message: error.info().to_owned() }
        })?;
        let (line, column) = (span.start.line(), span.start.col() + 1);
        let fail = |message: String| E::from(YamlError { line, column, message });
        let new = |value, anchor| SizedNode { node: YamlNode { line, column, value }, anchor, size: 1, height: 0 };
        // A text or an alias is done at once, a collection at its end.
        let mut done = None;
        match event {
            Event::Scalar(text, style, anchor, tag) => {
                let (is_plain, tag) = (style == ScalarStyle::Plain, tag.map(|tag| tag.suffix.clone()));
                let size = 1 + text.len() / 32;
                count += size;
                done = Some(SizedNode { size, ..new(YamlValue::Scalar { text, is_plain, tag }, anchor) });
            }
            Event::SequenceStart(anchor, _) => open.push(new(YamlValue::List(Vec::new()), anchor)),
            Event::MappingStart(anchor, _) => open.push(new(YamlValue::Map(Vec::new()), anchor)),
            Event::SequenceEnd | Event::MappingEnd => {
                count += 1;
                done = open.pop();
            }
            Event::Alias(anchor) => {
                let named = anchors.get(&anchor);
                let named = named.ok_or_else(|| fail("an alias refers to a node that contains it".to_owned()))?;
                count += named.size;
                done = Some(SizedNode { anchor: 0, ..named.clone() });
            }
            Event::DocumentEnd => anchors.clear(),
            _ => {}
        }
        if open.len() + done.as_ref().map_or(0, |done| done.height) > MAX_NESTED {
            return Err(fail(format!("collections are nested more than {MAX_NESTED} deep")));
        }
        let Some(done) = done else { continue };
        // An anchored node is copied, because an alias may follow.
        if done.anchor > 0 {
            count += done.size;
            anchors.insert(done.anchor, done.clone());
        }
        if count > most {
            return Err(fail(format!("more than {most} numbers and texts")));
        }
        // A finished node belongs to the innermost open collection, or is a document.
        match open.last_mut() {
            None => take(done.node)?,
            Some(outer) => outer.add(done),
        }
    }
    Ok(())
}
