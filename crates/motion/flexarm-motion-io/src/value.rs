//! Messages as trees of values, from text or bytes.
//!
//! Start at [`Node`]. Not here: parsing (`yaml.rs`, `cdr.rs`), meaning (`message.rs`).

use std::rc::Rc;

/// A value and its place.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) value: Value,
    /// Line and column of text, from 1; zeros for bytes.
    pub(crate) place: [u32; 2],
}

/// Value of a message.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    Null,
    /// Integer, exact.
    Whole(i64),
    Number(f64),
    Text(Rc<str>),
    /// List that holds only numbers.
    Numbers(Vec<f64>),
    List(Vec<Node>),
    Map(Vec<(Rc<str>, Node)>),
}

impl Node {
    pub(crate) fn new(value: Value, place: [u32; 2]) -> Self {
        Self { value, place }
    }

    /// Value of a key of a map; the last one if the key is repeated.
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

    /// Description for messages.
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
