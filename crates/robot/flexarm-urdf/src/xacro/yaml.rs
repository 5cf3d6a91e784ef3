//! YAML files of `xacro.load_yaml`, with the scalars of PyYAML (YAML 1.1: `on` is true, `1e3`
//! without a dot is text).

use std::rc::Rc;

use flexarm_files::{YamlError, YamlNode, YamlValue, read_yaml};
use flexarm_settings::Place;

use super::Interpreter;
use super::expression::value::{Value, float_of, lookup};
use super::expression::{ExpressionError, unique};
use super::scope::Table;

/// Maximum number of values of a file, with those behind aliases counted each time.
const MAX_VALUES: usize = 1_000_000;
/// Tags that multiply by a unit, with the factor to rad or m.
const UNITS: [(&str, f64); 6] = [
    ("radians", 1.0),
    ("degrees", std::f64::consts::PI / 180.0),
    ("meters", 1.0),
    ("millimeters", 0.001),
    ("foot", 0.3048),
    ("inches", 0.0254),
];

impl Interpreter<'_> {
    /// Content of a YAML file; its path is relative to the file being read.
    pub(crate) fn load_yaml(&mut self, path: &str) -> Result<Value, ExpressionError> {
        let path = self.beside(path);
        let text = self.read(&path)?;
        let place = Place::of_file(path.display());
        self.note_source(format!("the file {place}"));
        let file: Rc<std::path::Path> = path.into();
        self.files.push(file);
        let value = self
            .yaml(&text)
            .map_err(|Located { line, column, error }| error.within(Place { column, ..place.line(line) }.to_string()));
        self.files.pop();
        value
    }

    fn yaml(&mut self, text: &str) -> Result<Value, Located> {
        let mut root = None;
        read_yaml(text, MAX_VALUES, |node| {
            if root.is_some() {
                return Err(located(node.line, ExpressionError::new("a second document, expected one")));
            }
            root = Some(self.value(node)?);
            Ok(())
        })?;
        Ok(root.unwrap_or(Value::None))
    }

    fn value(&mut self, YamlNode { line, value, .. }: YamlNode<'_>) -> Result<Value, Located> {
        let within = |error| located(line, error);
        self.charge(64).map_err(within)?;
        match value {
            YamlValue::Scalar { text, is_plain: true, tag: None } => Ok(plain(&text)),
            YamlValue::Scalar { text, tag: None, .. } => Ok(Value::text(&text)),
            YamlValue::Scalar { text, tag: Some(tag), .. } => self.tagged(&text, &tag).map_err(within),
            YamlValue::List(items) => {
                items.into_iter().map(|item| self.value(item)).collect::<Result<_, _>>().map(Value::list)
            }
            YamlValue::Map(items) => {
                let values = items.into_iter().map(|item| self.value(item)).collect::<Result<Vec<_>, _>>()?;
                self.dictionary(values).map_err(within)
            }
        }
    }

    /// Builds a dictionary from alternating keys and values. The content of `<<` precedes the rest.
    fn dictionary(&mut self, values: Vec<Value>) -> Result<Value, ExpressionError> {
        let (mut pairs, mut merged) = (Vec::new(), Vec::new());
        let mut values = values.into_iter();
        while let (Some(key), Some(value)) = (values.next(), values.next()) {
            if !matches!(&key, Value::Str(name) if &**name == "<<") {
                pairs.push((key, value));
                continue;
            }
            let sources = if let Value::List(items) = &value { items.to_vec() } else { vec![value] };
            for source in sources {
                let Value::Dict(items) = source else { return Err(ExpressionError::new("<< needs a dictionary")) };
                self.charge(64 * items.len() * (1 + merged.len() / 8))?;
                let new: Vec<_> = items.iter().filter(|(k, _)| lookup(&merged, k).is_none()).cloned().collect();
                merged.extend(new);
            }
        }
        merged.extend(pairs);
        // Each key is compared with all previous ones.
        self.charge(merged.len() * merged.len() / 2)?;
        Ok(Value::Dict(Rc::new(unique(merged))))
    }

    fn tagged(&mut self, text: &str, tag: &str) -> Result<Value, ExpressionError> {
        if let Some((_, factor)) = UNITS.iter().find(|(unit, _)| *unit == tag) {
            let value = self.expression(text, &Table::root())?;
            let number = match &value {
                Value::Str(text) => float_of(text),
                value => value.as_float(),
            };
            let number =
                number.ok_or_else(|| ExpressionError::new(format!("!{tag} needs a number, found {}", value.repr())))?;
            return Ok(Value::Float(number * factor));
        }
        match tag {
            "str" | "!" => Ok(Value::text(text)),
            "float" => {
                float_of(text).map(Value::Float).ok_or_else(|| ExpressionError::new(format!("{text:?} is no number")))
            }
            "int" | "bool" | "null" => Ok(plain(text)),
            other => Err(ExpressionError::new(format!("the tag {other:?} is not known"))),
        }
    }
}

/// An error with its line and column in the file.
struct Located {
    line: usize,
    column: Option<usize>,
    error: ExpressionError,
}

fn located(line: usize, error: ExpressionError) -> Located {
    Located { line, column: None, error }
}

impl From<YamlError> for Located {
    fn from(YamlError { line, column, message }: YamlError) -> Self {
        Self { line, column: Some(column), error: ExpressionError::new(format!("it is not YAML: {message}")) }
    }
}

/// Converts an unquoted scalar like PyYAML.
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
        // Sexagesimal numbers such as 1:30.
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

/// A decimal needs a point, and its exponent a sign.
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
