//! YAML files of `xacro.load_yaml`, with the scalars of PyYAML (YAML 1.1: `on` is true, `1e3` without a dot is text).

use std::collections::HashMap;
use std::rc::Rc;

use saphyr_parser::{Event, Parser, ScalarStyle, Tag};

use super::Interpreter;
use super::expression::Trouble;
use super::expression::unique;
use super::expression::value::{Value, lookup};
use super::scope::Table;

/// Collections nested deeper are refused.
const MOST_NESTED: usize = 60;
/// Tags that multiply by a unit: to rad and to m.
const UNITS: [(&str, f64); 6] = [
    ("radians", 1.0),
    ("degrees", std::f64::consts::PI / 180.0),
    ("meters", 1.0),
    ("millimeters", 0.001),
    ("foot", 0.3048),
    ("inches", 0.0254),
];

impl Interpreter<'_> {
    /// The content of a YAML file; its path is relative to the file that is being read.
    pub(crate) fn load_yaml(&mut self, path: &str) -> Result<Value, Trouble> {
        let path = self.beside(path);
        let text = self.read(&path)?;
        let shown = path.display().to_string();
        let file: Rc<std::path::Path> = path.into();
        self.files.push(file);
        let value = self.yaml(&text).map_err(|trouble| trouble.within(shown));
        self.files.pop();
        value
    }

    fn yaml(&mut self, text: &str) -> Result<Value, Trouble> {
        let mut builder = Builder { open: Vec::new(), anchors: HashMap::new(), root: None };
        for event in Parser::new_from_str(text) {
            let (event, span) = event.map_err(|error| Trouble::new(format!("it is not YAML: {error}")))?;
            let line = span.start.line();
            self.charge(64)?;
            builder.take(self, event).map_err(|trouble| trouble.within(format!("line {line}")))?;
        }
        Ok(builder.root.unwrap_or(Value::None))
    }
}

/// Collections whose end has not come.
enum Open {
    List(Vec<Value>),
    /// With the key whose value is awaited, and what `<<` brings.
    Dict {
        pairs: Vec<(Value, Value)>,
        key: Option<Value>,
        merged: Vec<(Value, Value)>,
    },
}

struct Builder {
    open: Vec<(Open, usize)>,
    anchors: HashMap<usize, Value>,
    root: Option<Value>,
}

impl Builder {
    fn take(&mut self, interpreter: &mut Interpreter<'_>, event: Event<'_>) -> Result<(), Trouble> {
        match event {
            Event::Scalar(text, style, anchor, tag) => {
                let value = scalar(interpreter, &text, style, tag.as_deref())?;
                interpreter.charge(value.size())?;
                self.put(interpreter, value, anchor)
            }
            Event::Alias(anchor) => {
                let value = self.anchors.get(&anchor).cloned();
                let value = value.ok_or_else(|| Trouble::new("an alias stands inside of what it names"))?;
                interpreter.charge(value.size())?;
                self.put(interpreter, value, 0)
            }
            Event::SequenceStart(anchor, _) => self.begin(Open::List(Vec::new()), anchor),
            Event::MappingStart(anchor, _) => {
                self.begin(Open::Dict { pairs: Vec::new(), key: None, merged: Vec::new() }, anchor)
            }
            Event::SequenceEnd | Event::MappingEnd => {
                let Some((open, anchor)) = self.open.pop() else { return Ok(()) };
                let value = match open {
                    Open::List(items) => Value::list(items),
                    Open::Dict { pairs, merged, .. } if merged.is_empty() => Value::Dict(Rc::new(pairs)),
                    Open::Dict { pairs, mut merged, .. } => {
                        interpreter.charge(merged.len() * pairs.len())?;
                        merged.extend(pairs);
                        Value::Dict(Rc::new(unique(merged)))
                    }
                };
                self.put(interpreter, value, anchor)
            }
            Event::DocumentStart(_) if self.root.is_some() => Err(Trouble::new("a second document, expected one")),
            _ => Ok(()),
        }
    }

    fn begin(&mut self, open: Open, anchor: usize) -> Result<(), Trouble> {
        self.open.push((open, anchor));
        if self.open.len() > MOST_NESTED {
            return Err(Trouble::new(format!("it is nested more than {MOST_NESTED} deep")));
        }
        Ok(())
    }

    fn put(&mut self, interpreter: &mut Interpreter<'_>, value: Value, anchor: usize) -> Result<(), Trouble> {
        if anchor > 0 {
            self.anchors.insert(anchor, value.clone());
        }
        match self.open.last_mut() {
            None => self.root = Some(value),
            Some((Open::List(items), _)) => items.push(value),
            Some((Open::Dict { pairs, key, merged }, _)) => match key.take() {
                None => *key = Some(value),
                Some(Value::Str(name)) if &*name == "<<" => {
                    let sources = if let Value::List(items) = &value { items.to_vec() } else { vec![value] };
                    for source in sources {
                        let Value::Dict(items) = source else { return Err(Trouble::new("<< needs a dictionary")) };
                        interpreter.charge(64 * items.len() * (1 + merged.len() / 8))?;
                        let new: Vec<_> = items.iter().filter(|(k, _)| lookup(merged, k).is_none()).cloned().collect();
                        merged.extend(new);
                    }
                }
                Some(name) => {
                    // each key is looked for among the ones before
                    interpreter.charge(64 + pairs.len())?;
                    match pairs.iter_mut().find(|(k, _)| k.equals(&name)) {
                        Some(slot) => slot.1 = value,
                        None => pairs.push((name, value)),
                    }
                }
            },
        }
        Ok(())
    }
}

fn scalar(
    interpreter: &mut Interpreter<'_>,
    text: &str,
    style: ScalarStyle,
    tag: Option<&Tag>,
) -> Result<Value, Trouble> {
    let Some(tag) = tag else {
        return Ok(if style == ScalarStyle::Plain { plain(text) } else { Value::text(text) });
    };
    let name = tag.suffix.as_str();
    if let Some((_, factor)) = UNITS.iter().find(|(unit, _)| *unit == name) {
        let value = interpreter.expression(text, &Table::root())?;
        let number = match &value {
            Value::Str(text) => super::expression::value::float_of(text),
            value => value.as_float(),
        };
        let number = number.ok_or_else(|| Trouble::new(format!("!{name} needs a number, found {}", value.repr())))?;
        return Ok(Value::Float(number * factor));
    }
    let number =
        |value: Option<f64>| value.map(Value::Float).ok_or_else(|| Trouble::new(format!("{text:?} is no number")));
    match name {
        "str" | "!" => Ok(Value::text(text)),
        "float" => number(super::expression::value::float_of(text)),
        "int" | "bool" | "null" => Ok(plain(text)),
        other => Err(Trouble::new(format!("the tag {other:?} is not known"))),
    }
}

/// What PyYAML makes of text without quotes.
fn plain(text: &str) -> Value {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => return Value::None,
        "yes" | "Yes" | "YES" | "true" | "True" | "TRUE" | "on" | "On" | "ON" => return Value::Bool(true),
        "no" | "No" | "NO" | "false" | "False" | "FALSE" | "off" | "Off" | "OFF" => return Value::Bool(false),
        _ => {}
    }
    whole(text).map(Value::Int).or_else(|| decimal(text).map(Value::Float)).unwrap_or_else(|| Value::text(text))
}

fn sign(text: &str) -> (i128, &str) {
    match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    }
}

fn whole(text: &str) -> Option<i128> {
    let (sign, digits) = sign(text);
    let only = |digits: &str, radix: u32| {
        let sound = !digits.is_empty() && digits.chars().all(|c| c == '_' || c.is_digit(radix));
        sound.then(|| i128::from_str_radix(&digits.replace('_', ""), radix).ok()).flatten()
    };
    let value = if let Some(binary) = digits.strip_prefix("0b") {
        only(binary, 2)
    } else if let Some(hex) = digits.strip_prefix("0x") {
        only(hex, 16)
    } else if digits.contains(':') {
        // sixties, as in 1:30
        let parts: Option<Vec<i128>> = digits.split(':').map(|part| only(part, 10)).collect();
        let parts = parts.filter(|p| !digits.starts_with('0') && p[1..].iter().all(|x| *x < 60));
        parts.and_then(|parts| parts.iter().try_fold(0i128, |sum, part| sum.checked_mul(60)?.checked_add(*part)))
    } else if digits.len() > 1 && digits.starts_with('0') {
        only(digits, 8)
    } else if digits.starts_with('_') {
        None
    } else {
        only(digits, 10)
    };
    Some(sign * value?)
}

/// A decimal needs a dot, and its exponent a sign.
fn decimal(text: &str) -> Option<f64> {
    let (sign, digits) = sign(text);
    match digits {
        ".inf" | ".Inf" | ".INF" => return Some(sign as f64 * f64::INFINITY),
        ".nan" | ".NaN" | ".NAN" if digits.len() == text.len() => return Some(f64::NAN),
        _ => {}
    }
    let (mantissa, exponent) = digits.split_once(['e', 'E']).map_or((digits, None), |(m, e)| (m, Some(e)));
    let signed = exponent.is_none_or(|e| e.len() > 1 && e.starts_with(['+', '-']));
    let numeric = |s: &str| s.chars().all(|c| c.is_ascii_digit() || c == '_');
    let (before, after) = mantissa.split_once('.')?;
    let first = if before.is_empty() { after } else { before };
    let starts = first.starts_with(|c: char| c.is_ascii_digit());
    if !(signed && starts && numeric(before) && numeric(after)) {
        return None;
    }
    text.replace('_', "").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: PyYAML 6.0.3, `yaml.safe_load`.
    #[test]
    fn plain_scalars_are_what_pyyaml_makes_of_them() {
        let pairs = [
            ("12", "12"),
            ("-0.5", "-0.5"),
            ("1e3", "'1e3'"),
            ("1.0e3", "'1.0e3'"),
            ("1.0e+3", "1000.0"),
            ("1.", "1.0"),
            (".5", "0.5"),
            ("010", "8"),
            ("1:30", "90"),
            ("0x1F", "31"),
            ("yes", "True"),
            ("off", "False"),
            ("~", "None"),
            ("1_000", "1000"),
            ("-.inf", "-inf"),
            ("12 34", "'12 34'"),
            ("0.1.2", "'0.1.2'"),
        ];
        for (text, expected) in pairs {
            assert_eq!(plain(text).repr(), expected, "{text}");
        }
    }
}
