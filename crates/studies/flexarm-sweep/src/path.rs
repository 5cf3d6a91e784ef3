//! Paths of values in a TOML file: `payload.mass`, `drive.joint_2.gearbox.stiffness`,
//! `mounting.stiffness[2]`, `drive.*.gearbox`.
//!
//! A list entry is identified by its `joint`, `link` or `name`, or by its index from 0; `*` matches
//! all. A path resolved in a file is a [`ValueLocation`], which changes one value in the text of the file
//! and keeps everything else as written.

use flexarm_urdf::closest;
use toml_edit::{DocumentMut, Item, Value};

use super::value::ParameterValue;

/// Keys that name the entries of a list.
const NAMES: [&str; 3] = ["joint", "link", "name"];
/// Maximum number of similar paths listed in addition to the closest one.
const MAX_TOLD: usize = 6;

/// Segment of a path.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Segment {
    /// Key of a table, or name of a list entry.
    Key(String),
    /// Index of a list entry.
    Index(usize),
    /// All keys or entries.
    Any,
}

/// Step to a value in a parsed file.
#[derive(Clone, Debug, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

/// Location of a value, present or not.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ValueLocation {
    steps: Vec<Step>,
    /// Path that resolves to this location, with the names of list entries.
    pub(super) name: String,
    /// Whether a value is present.
    pub(super) is_there: bool,
}

/// Splits a path into segments; `None` if a segment is empty, brackets contain no number, or a
/// quote is not closed.
pub(super) fn segments(text: &str) -> Option<Vec<Segment>> {
    let mut found = Vec::new();
    let mut rest = text.trim();
    loop {
        let (word, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').map(|(word, after)| (Segment::Key(word.to_owned()), after))?,
            None => {
                let end = rest.find(['.', '[']).unwrap_or(rest.len());
                let word = match rest[..end].trim() {
                    "" => return None,
                    "*" => Segment::Any,
                    word => Segment::Key(word.to_owned()),
                };
                (word, &rest[end..])
            }
        };
        found.push(word);
        rest = after;
        while let Some(bracket) = rest.strip_prefix('[') {
            let (number, after) = bracket.split_once(']')?;
            found.push(if number.trim() == "*" { Segment::Any } else { Segment::Index(number.trim().parse().ok()?) });
            rest = after;
        }
        match rest.strip_prefix('.') {
            Some(more) => rest = more,
            None => return rest.is_empty().then_some(found),
        }
    }
}

/// Returns all locations that a path matches in a file; empty if there are none. The last keys may
/// be new in an existing table.
pub(super) fn places(root: &toml::Value, path: &[Segment]) -> Vec<ValueLocation> {
    let mut found = Vec::new();
    let start = ValueLocation { steps: Vec::new(), name: String::new(), is_there: true };
    follow(root, path, start, &mut found);
    found
}

fn follow(value: &toml::Value, path: &[Segment], so_far: ValueLocation, found: &mut Vec<ValueLocation>) {
    let Some((segment, rest)) = path.split_first() else {
        found.push(so_far);
        return;
    };
    match (value, segment) {
        (toml::Value::Table(table), Segment::Key(key)) => match table.get(key) {
            Some(inner) => follow(inner, rest, so_far.with_key(key), found),
            None => found.extend(new_place(path, so_far)),
        },
        (toml::Value::Table(table), Segment::Any) => {
            table.iter().for_each(|(key, inner)| follow(inner, rest, so_far.with_key(key), found));
        }
        (toml::Value::Array(list), segment) => {
            for (number, inner) in list.iter().enumerate() {
                let own = name_of(inner);
                let meant = match segment {
                    Segment::Any => true,
                    Segment::Index(k) => *k == number,
                    Segment::Key(key) => own == Some(key) || own.is_none() && key.parse() == Ok(number),
                };
                if meant {
                    follow(inner, rest, so_far.with_entry(number, own), found);
                }
            }
        }
        _ => {}
    }
}

/// Returns the location of a new value in an existing table.
fn new_place(path: &[Segment], so_far: ValueLocation) -> Option<ValueLocation> {
    if so_far.steps.is_empty() {
        return None;
    }
    path.iter().try_fold(ValueLocation { is_there: false, ..so_far }, |place, segment| match segment {
        Segment::Key(key) => Some(place.with_key(key)),
        _ => None,
    })
}

/// Returns the name of a list entry.
fn name_of(entry: &toml::Value) -> Option<&String> {
    let table = entry.as_table()?;
    NAMES.iter().find_map(|key| match table.get(*key) {
        Some(toml::Value::String(name)) => Some(name),
        _ => None,
    })
}

impl ValueLocation {
    fn with(&self, step: Step, name: &str) -> Self {
        let mut steps = self.steps.clone();
        steps.push(step);
        Self { steps, name: name.to_owned(), is_there: self.is_there }
    }

    fn with_key(&self, key: &str) -> Self {
        let dot = if self.name.is_empty() { "" } else { "." };
        let name = format!("{}{dot}{}", self.name, quoted(key));
        self.with(Step::Key(key.to_owned()), &name)
    }

    fn with_entry(&self, number: usize, own: Option<&String>) -> Self {
        let name = match own {
            Some(own) => format!("{}.{}", self.name, quoted(own)),
            None => format!("{}[{number}]", self.name),
        };
        self.with(Step::Index(number), &name)
    }

    /// Returns the present value.
    pub(super) fn value<'a>(&self, root: &'a toml::Value) -> Option<&'a toml::Value> {
        self.steps.iter().try_fold(root, |value, step| match step {
            Step::Key(key) => value.get(key),
            Step::Index(number) => value.get(*number),
        })
    }

    /// Sets a value, and keeps the spaces and comments around the old one.
    pub(super) fn put(&self, file: &mut DocumentMut, value: Value) {
        let Some((last, way)) = self.steps.split_last() else { return };
        let mut item: &mut Item = file.as_item_mut();
        for step in way {
            let next = match step {
                Step::Key(key) => item.get_mut(key.as_str()),
                Step::Index(number) => item.get_mut(*number),
            };
            let Some(next) = next else { return };
            item = next;
        }
        let place = match last {
            Step::Key(key) => &mut item[key.as_str()],
            Step::Index(number) => &mut item[*number],
        };
        let mut value = value;
        if let Item::Value(old) = place {
            *value.decor_mut() = old.decor().clone();
        }
        *place = Item::Value(value);
    }
}

fn quoted(key: &str) -> String {
    if key.contains(['.', '[', '"', ' ']) { format!("\"{key}\"") } else { key.to_owned() }
}

/// Returns all paths of a file that lead to a number, a text, or a list of these.
pub(super) fn leaves(root: &toml::Value) -> Vec<String> {
    let mut found = Vec::new();
    collect(root, &ValueLocation { steps: Vec::new(), name: String::new(), is_there: true }, &mut found);
    found
}

fn collect(value: &toml::Value, place: &ValueLocation, found: &mut Vec<String>) {
    match value {
        toml::Value::Table(table) => {
            table.iter().for_each(|(key, inner)| collect(inner, &place.with_key(key), found));
        }
        toml::Value::Array(list) if list.iter().any(toml::Value::is_table) => {
            let entries = list.iter().enumerate();
            entries.for_each(|(number, inner)| collect(inner, &place.with_entry(number, name_of(inner)), found));
        }
        _ => found.push(place.name.clone()),
    }
}

/// Lists the paths closest to an invalid one, as the end of a sentence.
pub(super) fn near(path: &str, known: &[String]) -> String {
    let meant = closest(path, known.iter().map(String::as_str));
    // Paths with the longest common prefix.
    let alike = |other: &String| path.bytes().zip(other.bytes()).take_while(|(a, b)| a == b).count();
    let most = known.iter().map(alike).max().unwrap_or(0);
    let mut others: Vec<&String> =
        known.iter().filter(|other| alike(other) == most && meant.as_ref() != Some(*other)).collect();
    others.truncate(MAX_TOLD);
    let listed: Vec<String> = others.iter().map(|other| format!("{other:?}")).collect();
    match (meant, listed.is_empty()) {
        (Some(meant), true) => format!("did you mean {meant:?}?"),
        (Some(meant), false) => format!("did you mean {meant:?}? similar names are {}", listed.join(", ")),
        (None, true) => "there are none".into(),
        (None, false) => format!("similar names are {}", listed.join(", ")),
    }
}

/// Returns a value as written into a file whose old value is `old`.
pub(super) fn written(value: &ParameterValue, old: Option<&toml::Value>) -> Value {
    match value {
        ParameterValue::Whole(n) => Value::from(*n),
        // A whole number replaces an integer as an integer.
        ParameterValue::Number(x)
            if matches!(old, Some(toml::Value::Integer(_))) && x.fract() == 0.0 && x.abs() < 1e15 =>
        {
            Value::from(*x as i64)
        }
        ParameterValue::Number(x) => Value::from(*x),
        ParameterValue::Text(text) => Value::from(text.as_str()),
        ParameterValue::Truth(truth) => Value::from(*truth),
    }
}

/// Applies a function to a number, or to all numbers in nested lists.
pub(super) fn changed(old: &toml::Value, change: &dyn Fn(f64) -> f64) -> Option<Value> {
    match old {
        toml::Value::Integer(n) => Some(Value::from(change(*n as f64))),
        toml::Value::Float(x) => Some(Value::from(change(*x))),
        toml::Value::Array(list) => {
            let entries = list.iter().map(|entry| changed(entry, change)).collect::<Option<Vec<Value>>>()?;
            Some(Value::Array(entries.into_iter().collect()))
        }
        _ => None,
    }
}
