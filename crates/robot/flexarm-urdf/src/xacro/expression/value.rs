//! Values of expressions, with Python's printing, comparison and truth values.
//!
//! Start at [`Value`]; [`int_of`] and [`float_of`] parse text like Python's `int()` and `float()`.
//! Not here: operators ([`super::arithmetic`]), scalars of YAML ([`super::super::yaml`]).

use std::cmp::Ordering;
use std::rc::Rc;

use super::super::document::Element;
use super::super::scope::Table;

/// Value of a property or an expression.
#[derive(Clone)]
pub(crate) enum Value {
    None,
    Bool(bool),
    /// Integer; Python's are unbounded, these are limited to 1.7e38, and overflow is an error.
    Int(i128),
    Float(f64),
    Str(Rc<str>),
    List(Rc<Vec<Value>>),
    Tuple(Rc<Vec<Value>>),
    /// Dictionary in the order of insertion.
    Dict(Rc<Vec<(Value, Value)>>),
    /// XML kept for `<xacro:insert_block>`.
    Block(Rc<Element>),
    /// A function by its name without module.
    Function(&'static str),
    /// `math`, `python` or `xacro`.
    Module(&'static str),
    /// Namespace of `<xacro:include ns="...">`.
    Namespace(Rc<Table>),
}

impl Value {
    pub(crate) fn text(text: impl AsRef<str>) -> Self {
        Self::Str(Rc::from(text.as_ref()))
    }

    pub(crate) fn list(items: Vec<Value>) -> Self {
        Self::List(Rc::new(items))
    }

    /// Python's name of the type.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::None => "None",
            Self::Bool(_) => "bool",
            Self::Int(_) => "int",
            Self::Float(_) => "float",
            Self::Str(_) => "str",
            Self::List(_) => "list",
            Self::Tuple(_) => "tuple",
            Self::Dict(_) => "dict",
            Self::Block(_) => "block of XML",
            Self::Function(_) => "function",
            Self::Module(_) => "module",
            Self::Namespace(_) => "namespace",
        }
    }

    pub(crate) fn is_true(&self) -> bool {
        match self {
            Self::None => false,
            Self::Bool(b) => *b,
            Self::Int(i) => *i != 0,
            Self::Float(x) => *x != 0.0,
            Self::Str(s) => !s.is_empty(),
            Self::List(items) | Self::Tuple(items) => !items.is_empty(),
            Self::Dict(items) => !items.is_empty(),
            Self::Block(_) | Self::Function(_) | Self::Module(_) | Self::Namespace(_) => true,
        }
    }

    pub(crate) fn as_str(&self) -> Option<&str> {
        if let Self::Str(text) = self { Some(text) } else { None }
    }

    /// Integer value; a Boolean counts as 0 or 1.
    pub(crate) fn as_int(&self) -> Option<i128> {
        match self {
            Self::Bool(b) => Some(i128::from(*b)),
            Self::Int(i) => Some(*i),
            _ => None,
        }
    }

    pub(crate) fn as_float(&self) -> Option<f64> {
        match self {
            Self::Float(x) => Some(*x),
            other => other.as_int().map(|i| i as f64),
        }
    }

    /// Text as from `str()`, as it is written into the document.
    pub(crate) fn shown(&self) -> String {
        match self {
            Self::Str(s) => s.to_string(),
            other => other.repr(),
        }
    }

    /// Text as from `repr()`, with quoted strings.
    pub(crate) fn repr(&self) -> String {
        let joined = |items: &[Value]| items.iter().map(Self::repr).collect::<Vec<_>>().join(", ");
        match self {
            Self::None => "None".into(),
            Self::Bool(b) => if *b { "True" } else { "False" }.into(),
            Self::Int(i) => i.to_string(),
            Self::Float(x) => float_repr(*x),
            Self::Str(s) => quoted(s),
            Self::List(items) => format!("[{}]", joined(items)),
            Self::Tuple(items) if items.len() == 1 => format!("({},)", items[0].repr()),
            Self::Tuple(items) => format!("({})", joined(items)),
            Self::Dict(items) => {
                let pairs: Vec<_> = items.iter().map(|(k, v)| format!("{}: {}", k.repr(), v.repr())).collect();
                format!("{{{}}}", pairs.join(", "))
            }
            Self::Block(_) | Self::Function(_) | Self::Module(_) | Self::Namespace(_) => format!("<{}>", self.kind()),
        }
    }

    /// Python's `==`.
    pub(crate) fn equals(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Str(a), Self::Str(b)) => a == b,
            (Self::List(a), Self::List(b)) | (Self::Tuple(a), Self::Tuple(b)) => {
                a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| a.equals(b))
            }
            (Self::Dict(a), Self::Dict(b)) => {
                a.len() == b.len() && a.iter().all(|(k, v)| lookup(b, k).is_some_and(|w| v.equals(w)))
            }
            (Self::None, Self::None) => true,
            (Self::Function(a), Self::Function(b)) | (Self::Module(a), Self::Module(b)) => a == b,
            _ => self.order(other) == Some(Ordering::Equal),
        }
    }

    /// Python's `<` for values that have an order.
    pub(crate) fn order(&self, other: &Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Str(a), Self::Str(b)) => Some(a.cmp(b)),
            (Self::List(a), Self::List(b)) | (Self::Tuple(a), Self::Tuple(b)) => {
                let unequal = a.iter().zip(b.iter()).find(|(a, b)| !a.equals(b));
                unequal.map_or_else(|| Some(a.len().cmp(&b.len())), |(a, b)| a.order(b))
            }
            _ => match (self.as_int(), other.as_int()) {
                (Some(a), Some(b)) => Some(a.cmp(&b)),
                _ => self.as_float()?.partial_cmp(&other.as_float()?),
            },
        }
    }

    /// Approximate number of bytes, for the work limit.
    pub(crate) fn size(&self) -> usize {
        match self {
            Self::Str(s) => s.len(),
            Self::List(items) | Self::Tuple(items) => 16 + 32 * items.len(),
            Self::Dict(items) => 16 + 64 * items.len(),
            _ => 16,
        }
    }
}

/// Value of a key.
pub(crate) fn lookup<'a>(items: &'a [(Value, Value)], key: &Value) -> Option<&'a Value> {
    items.iter().find(|(k, _)| k.equals(key)).map(|(_, v)| v)
}

/// Shortest digits that restore the number, laid out like Python's `repr`.
pub(crate) fn float_repr(x: f64) -> String {
    if x.is_nan() {
        return "nan".into();
    }
    if x.is_infinite() {
        return if x > 0.0 { "inf" } else { "-inf" }.into();
    }
    let scientific = format!("{x:e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..16).contains(&exponent) {
        let plain = format!("{x}");
        return if plain.contains('.') { plain } else { format!("{plain}.0") };
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{mantissa}e{sign}{:02}", exponent.abs())
}

fn quoted(text: &str) -> String {
    let quote = if text.contains('\'') && !text.contains('"') { '"' } else { '\'' };
    let mut out = String::from(quote);
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            c if c == quote => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out.push(quote);
    out
}

/// Parses text like Python's `int()`.
pub(crate) fn int_of(text: &str) -> Option<i128> {
    let digits = text.trim();
    let bare = digits.strip_prefix(['+', '-']).unwrap_or(digits);
    let single = !bare.starts_with('_') && !bare.ends_with('_') && !bare.contains("__");
    let plain = !bare.is_empty() && bare.bytes().all(|b| b.is_ascii_digit() || b == b'_') && single;
    plain.then(|| digits.replace('_', "").parse().ok()).flatten()
}

/// Parses text like Python's `float()`.
pub(crate) fn float_of(text: &str) -> Option<f64> {
    let text = text.trim();
    let bare = text.strip_prefix(['+', '-']).unwrap_or(text).to_ascii_lowercase();
    let word = matches!(bare.as_str(), "inf" | "infinity" | "nan");
    let digits = bare.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'+' | b'-'));
    if word || (digits && bare.starts_with(|c: char| c.is_ascii_digit() || c == '.')) {
        return text.parse().ok();
    }
    None
}
