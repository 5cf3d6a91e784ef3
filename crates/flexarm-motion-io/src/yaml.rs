//! Text to trees: YAML, of which JSON is a part, one tree for each document.

use std::collections::HashMap;
use std::rc::Rc;

use saphyr_parser::{Event, Parser, ScalarStyle};

use crate::error::{Problem, Trouble};
use crate::value::{Node, Value};

/// Collections nested deeper are refused.
const MOST_NESTED: usize = 40;
/// Most values of a text, those behind aliases counted each time.
const MOST_VALUES: usize = 20_000_000;

/// Calls `take` with each document, one after another, so that a long recording is not in memory twice.
pub(crate) fn documents(text: &str, take: &mut dyn FnMut(Node) -> Result<(), Trouble>) -> Result<(), Trouble> {
    let mut builder = Builder::default();
    for event in Parser::new_from_str(text) {
        let (event, span) = event.map_err(|error| {
            let marker = error.marker();
            let line = u32::try_from(marker.line()).unwrap_or(0);
            Trouble::at(line, Problem::NotYaml { message: format!("{}, column {}", error.info(), marker.col() + 1) })
        })?;
        let line = u32::try_from(span.start.line()).unwrap_or(u32::MAX);
        if let Some(document) = builder.take(event, line)? {
            take(document)?;
        }
    }
    Ok(())
}

/// Collections whose end has not come.
enum Open {
    List(Vec<Node>),
    /// With the key whose value is awaited.
    Map(Vec<(Rc<str>, Node)>, Option<Rc<str>>),
}

#[derive(Default)]
struct Builder {
    open: Vec<(Open, usize, u32)>,
    anchors: HashMap<usize, (Node, usize)>,
    root: Option<Node>,
    values: usize,
    /// Keys are few and come often.
    keys: HashMap<String, Rc<str>>,
}

impl Builder {
    fn take(&mut self, event: Event<'_>, line: u32) -> Result<Option<Node>, Trouble> {
        match event {
            Event::Scalar(text, style, anchor, _) => {
                // A key is never a number.
                let awaits_key = matches!(self.open.last(), Some((Open::Map(_, None), ..)));
                let value = match style {
                    _ if awaits_key => Value::Text(self.key(&text)),
                    ScalarStyle::Plain => plain(&text),
                    _ => Value::Text(text.as_ref().into()),
                };
                self.put(Node::new(value, line), anchor)?;
            }
            Event::Alias(anchor) => {
                let problem = || Problem::NotYaml { message: "an alias stands inside of what it names".to_owned() };
                let (node, size) = self.anchors.get(&anchor).cloned().ok_or_else(|| Trouble::at(line, problem()))?;
                self.charge(size, line)?;
                self.put(node, 0)?;
            }
            Event::SequenceStart(anchor, _) => self.begin(Open::List(Vec::new()), anchor, line)?,
            Event::MappingStart(anchor, _) => self.begin(Open::Map(Vec::new(), None), anchor, line)?,
            Event::SequenceEnd | Event::MappingEnd => {
                let Some((open, anchor, line)) = self.open.pop() else { return Ok(None) };
                let value = match open {
                    Open::List(items) => numbers_or_list(items),
                    Open::Map(pairs, _) => Value::Map(pairs),
                };
                self.put(Node::new(value, line), anchor)?;
            }
            Event::DocumentEnd => {
                self.anchors.clear();
                return Ok(self.root.take());
            }
            _ => {}
        }
        Ok(None)
    }

    fn key(&mut self, text: &str) -> Rc<str> {
        if let Some(known) = self.keys.get(text) {
            return known.clone();
        }
        let key: Rc<str> = text.into();
        self.keys.insert(text.to_owned(), key.clone());
        key
    }

    fn charge(&mut self, values: usize, line: u32) -> Result<(), Trouble> {
        self.values += values;
        if self.values > MOST_VALUES {
            return Err(Trouble::at(line, Problem::TooManyNumbers { most: MOST_VALUES }));
        }
        Ok(())
    }

    fn begin(&mut self, open: Open, anchor: usize, line: u32) -> Result<(), Trouble> {
        self.open.push((open, anchor, line));
        if self.open.len() > MOST_NESTED {
            return Err(Trouble::at(line, Problem::TooDeep { most: MOST_NESTED }));
        }
        Ok(())
    }

    fn put(&mut self, node: Node, anchor: usize) -> Result<(), Trouble> {
        self.charge(1, node.line)?;
        if anchor > 0 {
            let size = size(&node);
            self.charge(size, node.line)?;
            self.anchors.insert(anchor, (node.clone(), size));
        }
        match self.open.last_mut() {
            None => self.root = Some(node),
            Some((Open::List(items), ..)) => items.push(node),
            Some((Open::Map(pairs, key), ..)) => match (key.take(), node.value) {
                (Some(name), value) => pairs.push((name, Node::new(value, node.line))),
                (None, Value::Text(name)) => *key = Some(name),
                // A key that is a collection is no key of a message.
                (None, _) => *key = Some("".into()),
            },
        }
        Ok(())
    }
}

fn size(node: &Node) -> usize {
    match &node.value {
        Value::Numbers(numbers) => 1 + numbers.len(),
        Value::List(items) => 1 + items.iter().map(size).sum::<usize>(),
        Value::Map(pairs) => 1 + pairs.iter().map(|(_, node)| size(node)).sum::<usize>(),
        _ => 1,
    }
}

fn numbers_or_list(items: Vec<Node>) -> Value {
    match items.iter().map(Node::number).collect::<Option<Vec<f64>>>() {
        Some(numbers) => Value::Numbers(numbers),
        None => Value::List(items),
    }
}

/// Text without quotes.
fn plain(text: &str) -> Value {
    match text {
        "" | "~" | "null" => return Value::Null,
        ".nan" | ".NaN" | ".NAN" => return Value::Number(f64::NAN),
        ".inf" | ".Inf" | ".INF" | "+.inf" => return Value::Number(f64::INFINITY),
        "-.inf" | "-.Inf" | "-.INF" => return Value::Number(f64::NEG_INFINITY),
        _ => {}
    }
    // Words that Rust takes for numbers are numbers here too: Python prints nan and inf so.
    match (text.parse::<i64>(), text.parse::<f64>()) {
        (Ok(whole), _) => Value::Whole(whole),
        (_, Ok(number)) => Value::Number(number),
        _ => Value::Text(text.into()),
    }
}
