//! Methods of strings, lists and dictionaries, indexing, and the two ways of formatting.
//!
//! Start at [`call`], [`index`], [`slice`] and [`formatted`]. Positions count characters, as in
//! Python. Not here: functions ([`super::functions`]), operators ([`super::arithmetic`]).

use std::rc::Rc;

use super::value::{Value, float_repr, lookup};
use super::{Charge, ExpressionError};

/// `value[key]`
pub(super) fn index(owner: &Value, key: &Value) -> Result<Value, ExpressionError> {
    let position = |length: usize| {
        let i = key.as_int().ok_or_else(|| ExpressionError::new(format!("{} is not an index", key.repr())))?;
        let at = if i < 0 { i + length as i128 } else { i };
        usize::try_from(at).ok().filter(|at| *at < length).ok_or_else(|| {
            ExpressionError::new(format!("the index {i} is outside of a {} with {length} elements", owner.kind()))
        })
    };
    match owner {
        Value::List(items) | Value::Tuple(items) => Ok(items[position(items.len())?].clone()),
        Value::Str(text) => {
            let letters: Vec<char> = text.chars().collect();
            Ok(Value::text(letters[position(letters.len())?].to_string()))
        }
        Value::Dict(items) => lookup(items, key).cloned().ok_or_else(|| {
            let keys: Vec<String> = items.iter().map(|(k, _)| k.repr()).collect();
            let help = format!("its keys are {}", super::shortened(&keys.join(", ")));
            ExpressionError::new(format!("the dictionary has no key {}", key.repr())).help(help)
        }),
        other => Err(ExpressionError::new(format!("a {} has no elements", other.kind()))
            .help("is it a text that should have been loaded from a file?")),
    }
}

/// `value[start:end:step]`
pub(super) fn slice(owner: &Value, [start, end, step]: [Option<i128>; 3]) -> Result<Value, ExpressionError> {
    let step = step.unwrap_or(1);
    if step == 0 {
        return Err(ExpressionError::new("the step of a slice is 0"));
    }
    // Negative bounds count from the end, and bounds beyond the ends are moved to them.
    let picked = |length: usize| -> Vec<usize> {
        let n = length as i128;
        let (low, high) = if step > 0 { (0, n) } else { (-1, n - 1) };
        let bound = |b: Option<i128>, default: i128| {
            b.map_or(default, |b| (if b < 0 { b.saturating_add(n) } else { b }).clamp(low, high))
        };
        let (mut at, end) =
            if step > 0 { (bound(start, 0), bound(end, n)) } else { (bound(start, n - 1), bound(end, -1)) };
        let mut found = Vec::new();
        while (step > 0 && at < end) || (step < 0 && at > end) {
            found.extend(usize::try_from(at));
            at = at.saturating_add(step);
        }
        found
    };
    Ok(match owner {
        Value::List(items) => Value::list(picked(items.len()).into_iter().map(|i| items[i].clone()).collect()),
        Value::Tuple(items) => {
            Value::Tuple(Rc::new(picked(items.len()).into_iter().map(|i| items[i].clone()).collect()))
        }
        Value::Str(text) => {
            let letters: Vec<char> = text.chars().collect();
            Value::text(picked(letters.len()).into_iter().map(|i| letters[i]).collect::<String>())
        }
        other => return Err(ExpressionError::new(format!("a {} cannot be sliced", other.kind()))),
    })
}

/// `owner.name(arguments)`; memory is charged before it is allocated.
pub(super) fn call(
    owner: &Value,
    name: &str,
    arguments: &[Value],
    named: &[(String, Value)],
    charge: &mut Charge<'_>,
) -> Result<Value, ExpressionError> {
    // `None` stands for a method that the type does not have, or not with so many arguments.
    let method = match owner {
        Value::Str(text) if name == "format" => return format(text, arguments, named, charge).map(Value::text),
        Value::Str(text) => of_text(text, name, arguments, charge)?,
        Value::List(items) | Value::Tuple(items) => match (name, arguments) {
            ("index", [item]) => {
                let found = items.iter().position(|i| i.equals(item));
                let found = found.ok_or_else(|| ExpressionError::new(format!("{} is not in the list", item.repr())))?;
                Some(Value::Int(found as i128))
            }
            ("count", [item]) => Some(Value::Int(items.iter().filter(|i| i.equals(item)).count() as i128)),
            _ => None,
        },
        Value::Dict(items) => match (name, arguments) {
            ("keys", []) => Some(Value::list(items.iter().map(|(k, _)| k.clone()).collect())),
            ("values", []) => Some(Value::list(items.iter().map(|(_, v)| v.clone()).collect())),
            ("items", []) => {
                let pair = |(k, v): &(Value, Value)| Value::Tuple(Rc::new(vec![k.clone(), v.clone()]));
                Some(Value::list(items.iter().map(pair).collect()))
            }
            ("get", [key]) => Some(lookup(items, key).cloned().unwrap_or(Value::None)),
            ("get", [key, default]) => Some(lookup(items, key).unwrap_or(default).clone()),
            _ => None,
        },
        _ => None,
    };
    method.ok_or_else(|| {
        ExpressionError::new(format!("{}.{name}() with {} arguments is not known", owner.kind(), arguments.len()))
    })
}

/// Method of a text; `None` if there is no such one with these arguments.
fn of_text(
    text: &str,
    name: &str,
    arguments: &[Value],
    charge: &mut Charge<'_>,
) -> Result<Option<Value>, ExpressionError> {
    let texts: Vec<&str> = arguments.iter().map_while(Value::as_str).collect();
    let all_texts = texts.len() == arguments.len();
    let set = |chars: &str| chars.chars().collect::<Vec<char>>();
    Ok(Some(match (name, &texts[..]) {
        // Methods with arguments other than texts.
        ("join", []) if arguments.len() == 1 => joined(text, &arguments[0], charge)?,
        ("split", [separator]) if arguments.len() == 2 && !separator.is_empty() => {
            let most =
                arguments[1].as_int().ok_or_else(|| ExpressionError::new("split() takes a text and a whole number"))?;
            let parts = text.splitn(usize::try_from(most + 1).unwrap_or(usize::MAX), *separator);
            Value::list(parts.map(Value::text).collect())
        }
        ("zfill", []) if arguments.len() == 1 => {
            let width = arguments[0].as_int().and_then(|w| usize::try_from(w).ok()).unwrap_or(0).min(1000);
            Value::text(format!("{text:0>width$}"))
        }
        _ if !all_texts => return Ok(None),
        // Letters and white space.
        ("lower", []) => Value::text(text.to_lowercase()),
        ("upper", []) => Value::text(text.to_uppercase()),
        ("capitalize", []) => Value::text(capitalized(text)),
        ("title", []) => Value::text(title(text)),
        ("strip", []) => Value::text(text.trim()),
        ("lstrip", []) => Value::text(text.trim_start()),
        ("rstrip", []) => Value::text(text.trim_end()),
        ("strip", [chars]) => Value::text(text.trim_matches(&set(chars)[..])),
        ("lstrip", [chars]) => Value::text(text.trim_start_matches(&set(chars)[..])),
        ("rstrip", [chars]) => Value::text(text.trim_end_matches(&set(chars)[..])),
        // Parts of the text.
        ("split", []) => Value::list(text.split_whitespace().map(Value::text).collect()),
        ("split", [separator]) if !separator.is_empty() => {
            Value::list(text.split(separator).map(Value::text).collect())
        }
        ("splitlines", []) => Value::list(text.lines().map(Value::text).collect()),
        ("replace", [from, to]) => {
            if from.is_empty() {
                return Err(ExpressionError::new("replace() of an empty text"));
            }
            charge(text.matches(from).count().saturating_mul(to.len()).saturating_add(text.len()))?;
            Value::text(text.replace(from, to))
        }
        // Searches and tests.
        ("startswith", [part]) => Value::Bool(text.starts_with(part)),
        ("endswith", [part]) => Value::Bool(text.ends_with(part)),
        ("removeprefix", [part]) => Value::text(text.strip_prefix(part).unwrap_or(text)),
        ("removesuffix", [part]) => Value::text(text.strip_suffix(part).unwrap_or(text)),
        ("find", [part]) => Value::Int(text.find(part).map_or(-1, |at| text[..at].chars().count() as i128)),
        ("count", [part]) if !part.is_empty() => Value::Int(text.matches(part).count() as i128),
        ("isdigit" | "isnumeric", []) => Value::Bool(!text.is_empty() && text.chars().all(char::is_numeric)),
        ("isalpha", []) => Value::Bool(!text.is_empty() && text.chars().all(char::is_alphabetic)),
        _ => return Ok(None),
    }))
}

fn joined(separator: &str, list: &Value, charge: &mut Charge<'_>) -> Result<Value, ExpressionError> {
    let parts = elements(list)?;
    let parts: Option<Vec<&str>> = parts.iter().map(Value::as_str).collect();
    let parts = parts.ok_or_else(|| ExpressionError::new("join() takes texts"))?;
    let separators = separator.len().saturating_mul(parts.len());
    charge(parts.iter().fold(separators, |sum, part| sum.saturating_add(part.len())))?;
    Ok(Value::text(parts.join(separator)))
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    first + &letters.as_str().to_lowercase()
}

fn title(text: &str) -> String {
    let mut inside = false;
    let mut out = String::new();
    for c in text.chars() {
        if inside {
            out.extend(c.to_lowercase())
        } else {
            out.extend(c.to_uppercase())
        }
        inside = c.is_alphabetic();
    }
    out
}

/// Evaluates `text.format(...)`: `{}`, `{0}`, `{name}`, each with `:spec`.
fn format(
    text: &str,
    arguments: &[Value],
    named: &[(String, Value)],
    charge: &mut Charge<'_>,
) -> Result<String, ExpressionError> {
    let mut out = String::new();
    let (mut rest, mut next) = (text, 0);
    while let Some(at) = rest.find(['{', '}']) {
        out.push_str(&rest[..at]);
        if rest[at..].starts_with("{{") || rest[at..].starts_with("}}") {
            out.push_str(&rest[at..=at]);
            rest = &rest[at + 2..];
            continue;
        }
        let field = rest[at..].strip_prefix('{').and_then(|field| field.split_once('}'));
        let (field, after) = field.ok_or_else(|| ExpressionError::new("format(): a bracket { or } is unpaired"))?;
        let (name, spec) = field.split_once(':').unwrap_or((field, ""));
        let value = if name.is_empty() {
            next += 1;
            arguments.get(next - 1)
        } else if let Ok(number) = name.parse::<usize>() {
            arguments.get(number)
        } else {
            named.iter().find(|(n, _)| n == name).map(|(_, v)| v)
        };
        let value = value.ok_or_else(|| ExpressionError::new(format!("format(): there is nothing for {{{field}}}")))?;
        let shown = formatted(value, spec)?;
        charge(shown.len())?; // a value may be shown many times
        out.push_str(&shown);
        rest = after;
    }
    out.push_str(rest);
    Ok(out)
}

/// `format % values`
pub(super) fn percent(format: &str, values: &Value) -> Result<Value, ExpressionError> {
    let values = if let Value::Tuple(items) = values { items.to_vec() } else { vec![values.clone()] };
    let mut values = values.into_iter();
    let mut out = String::new();
    let mut rest = format;
    while let Some(at) = rest.find('%') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix('%') {
            out.push('%');
            rest = after;
            continue;
        }
        // A conversion ends with its letter.
        let end = rest.find(|c: char| c.is_ascii_alphabetic());
        let end = end.ok_or_else(|| ExpressionError::new("a % in a format has no letter behind it"))?;
        let value =
            values.next().ok_or_else(|| ExpressionError::new("there are fewer values than the format requires"))?;
        let kind = match &rest[end..=end] {
            "i" | "u" => "d",
            kind => kind,
        };
        out.push_str(&formatted(&value, &format!("{}{kind}", &rest[..end]))?);
        rest = &rest[end + 1..];
    }
    out.push_str(rest);
    match values.next() {
        Some(_) => Err(ExpressionError::new("there are more values than the format requires")),
        None => Ok(Value::text(out)),
    }
}

/// Formats one value by a spec such as `.3f`, `04d`, `>8`, `s`.
fn formatted(value: &Value, spec: &str) -> Result<String, ExpressionError> {
    let bad = || ExpressionError::new(format!("the format {spec:?} does not fit {}", value.repr()));
    if spec.is_empty() {
        return Ok(value.shown());
    }
    // Alignment, width, precision, kind.
    let (align, body) = match spec.strip_prefix(['<', '>', '-']) {
        Some(body) => (&spec[..1], body),
        None => ("", spec),
    };
    let kind = body.chars().last().filter(char::is_ascii_alphabetic);
    let body = kind.map_or(body, |kind| &body[..body.len() - kind.len_utf8()]);
    let (width, precision) = body.split_once('.').map_or((body, None), |(w, p)| (w, Some(p)));
    let small = |text: &str| text.parse::<usize>().ok().filter(|n| *n <= 1000);
    let precision = precision.map(|p| small(p).ok_or_else(bad)).transpose()?;
    let zeros = width.starts_with('0');
    let width = if width.is_empty() { 0 } else { small(width).ok_or_else(bad)? };
    // The value in its kind, without padding.
    let text = match (kind, value) {
        (Some('d'), value) => match (value.as_int(), value) {
            (Some(i), _) => i.to_string(),
            (None, Value::Float(x)) => format!("{}", x.trunc()),
            _ => return Err(bad()),
        },
        (Some('f' | 'F'), value) => format!("{:.*}", precision.unwrap_or(6), value.as_float().ok_or_else(bad)?),
        (Some('e'), value) => {
            let text = format!("{:.*e}", precision.unwrap_or(6), value.as_float().ok_or_else(bad)?);
            let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            let exponent: i32 = exponent.parse().unwrap_or(0);
            let sign = if exponent < 0 { '-' } else { '+' };
            format!("{mantissa}e{sign}{:02}", exponent.abs())
        }
        (Some('g'), value) => {
            let x = value.as_float().ok_or_else(bad)?;
            let rounded: f64 = format!("{:.*e}", precision.unwrap_or(6).max(1) - 1, x).parse().unwrap_or(x);
            float_repr(rounded).trim_end_matches(".0").to_owned()
        }
        (Some('s') | None, value) => value.shown(),
        (Some('r'), value) => value.repr(),
        _ => return Err(bad()),
    };
    // Numbers are aligned to the right, or padded by zeros after the sign; texts to the left.
    let number = value.as_float().is_some() && kind != Some('s');
    Ok(match (align, number) {
        (_, true) if zeros => match text.strip_prefix('-') {
            Some(digits) => format!("-{digits:0>w$}", w = width.saturating_sub(1)),
            None => format!("{text:0>width$}"),
        },
        ("<" | "-", _) => format!("{text:<width$}"),
        (">", _) | (_, true) => format!("{text:>width$}"),
        _ => format!("{text:<width$}"),
    })
}

/// Elements that a loop over the value visits.
pub(super) fn elements(value: &Value) -> Result<Vec<Value>, ExpressionError> {
    Ok(match value {
        Value::List(items) | Value::Tuple(items) => items.to_vec(),
        Value::Dict(items) => items.iter().map(|(k, _)| k.clone()).collect(),
        Value::Str(text) => text.chars().map(|c| Value::text(c.to_string())).collect(),
        other => return Err(ExpressionError::new(format!("a {} has no elements", other.kind()))),
    })
}

/// Keeps the last value of each key, at the position of the first one.
pub(crate) fn unique(pairs: Vec<(Value, Value)>) -> Vec<(Value, Value)> {
    let mut kept: Vec<(Value, Value)> = Vec::with_capacity(pairs.len());
    for (key, value) in pairs {
        match kept.iter_mut().find(|(k, _)| k.equals(&key)) {
            Some(slot) => slot.1 = value,
            None => kept.push((key, value)),
        }
    }
    kept
}
