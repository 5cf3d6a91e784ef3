//! Parses YAML, of which JSON is a subset, into one tree for each document.
//!
//! Start at [`documents`]; lines and columns count from 1. Not here: the events of YAML
//! (`flexarm-files`), the meaning of a message (`message.rs`).

use std::borrow::Cow;
use std::collections::HashMap;
use std::rc::Rc;

use flexarm_files::{YamlError, YamlNode, YamlValue, read_yaml};

use crate::error::{FilePosition, PlacedProblem};
use crate::value::{Node, Value};

/// Maximum number of values of a text, with those behind aliases counted each time.
const MAX_VALUES: usize = 20_000_000;

/// Calls `take` with each document in turn, so that a long recording is not in memory twice.
pub(crate) fn documents(
    text: &str,
    take: &mut dyn FnMut(Node) -> Result<(), PlacedProblem>,
) -> Result<(), PlacedProblem> {
    // There are few keys, which occur often; they are shared.
    let mut keys = HashMap::new();
    read_yaml(text, MAX_VALUES, |root| take(node(root, &mut keys)))
}

impl From<YamlError> for PlacedProblem {
    fn from(YamlError { line, column, message }: YamlError) -> Self {
        let place = FilePosition::Text(line, column);
        Self { place, ..Self::new(format!("the text is neither YAML nor JSON: {message}")) }
    }
}

/// Converts a YAML node; equal keys share their text.
fn node<'t>(YamlNode { line, column, value }: YamlNode<'t>, keys: &mut HashMap<Cow<'t, str>, Rc<str>>) -> Node {
    let value = match value {
        YamlValue::Scalar { text, is_plain: true, .. } => plain(&text),
        YamlValue::Scalar { text, .. } => Value::Text(text.as_ref().into()),
        YamlValue::List(items) => numbers_or_list(items.into_iter().map(|item| node(item, keys)).collect()),
        YamlValue::Map(items) => {
            let mut pairs = Vec::with_capacity(items.len() / 2);
            let mut items = items.into_iter();
            while let (Some(key), Some(value)) = (items.next(), items.next()) {
                // A collection used as a key cannot be a key of a message.
                let YamlValue::Scalar { text: key, .. } = key.value else { continue };
                let key = keys.entry(key).or_insert_with_key(|key| key.as_ref().into()).clone();
                pairs.push((key, node(value, keys)));
            }
            Value::Map(pairs)
        }
    };
    Node::new(value, [line, column].map(|count| u32::try_from(count).unwrap_or(u32::MAX)))
}

fn numbers_or_list(items: Vec<Node>) -> Value {
    match items.iter().map(Node::number).collect::<Option<Vec<f64>>>() {
        Some(numbers) => Value::Numbers(numbers),
        None => Value::List(items),
    }
}

/// Parses an unquoted scalar.
fn plain(text: &str) -> Value {
    match text {
        "" | "~" | "null" => return Value::Null,
        ".nan" | ".NaN" | ".NAN" => return Value::Number(f64::NAN),
        ".inf" | ".Inf" | ".INF" | "+.inf" => return Value::Number(f64::INFINITY),
        "-.inf" | "-.Inf" | "-.INF" => return Value::Number(f64::NEG_INFINITY),
        _ => {}
    }
    // Words that Rust parses as numbers are accepted, since Python prints nan and inf.
    match (text.parse::<i64>(), text.parse::<f64>()) {
        (Ok(whole), _) => Value::Whole(whole),
        (_, Ok(number)) => Value::Number(number),
        _ => Value::Text(text.into()),
    }
}
