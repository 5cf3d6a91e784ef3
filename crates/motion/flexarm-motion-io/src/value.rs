//! A message as a tree of values, whether it was text or bytes.

use std::rc::Rc;

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) value: Value,
    /// Line of text, from 1; 0 for bytes.
    pub(crate) line: u32,
}

/// What a message is made of.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Null,
    /// A whole number, exact.
    Whole(i64),
    Number(f64),
    Text(Rc<str>),
    /// A list of numbers and nothing else.
    Numbers(Vec<f64>),
    List(Vec<Node>),
    Map(Vec<(Rc<str>, Node)>),
}

impl Node {
    pub(crate) fn new(value: Value, line: u32) -> Self {
        Self { value, line }
    }

    /// The value of a key of a map; the last one, should it be there twice.
    pub(crate) fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Map(pairs) => pairs.iter().rev().find(|(name, _)| &**name == key).map(|(_, node)| node),
            _ => None,
        }
    }

    pub(crate) fn number(&self) -> Option<f64> {
        match self.value {
            Value::Whole(whole) => Some(whole as f64),
            Value::Number(number) => Some(number),
            _ => None,
        }
    }

    /// What it is, for messages.
    pub(crate) fn in_words(&self) -> String {
        match &self.value {
            Value::Null => "empty".to_owned(),
            Value::Whole(whole) => whole.to_string(),
            Value::Number(number) => number.to_string(),
            Value::Text(text) => format!("the text {:?}", text.chars().take(40).collect::<String>()),
            Value::Numbers(numbers) => format!("a list of {} numbers", numbers.len()),
            Value::List(items) => format!("a list of {} values", items.len()),
            Value::Map(pairs) => {
                let keys: Vec<&str> = pairs.iter().take(6).map(|(key, _)| &**key).collect();
                format!("a table with the keys {}", keys.join(", "))
            }
        }
    }
}
