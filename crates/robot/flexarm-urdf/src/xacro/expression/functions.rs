//! Built-in names: constants, functions of `math`, and those of Python and xacro.
//!
//! Start at [`named_value`] and [`Interpreter::call`]. A call tries the functions in four groups:
//! those with an effect on the interpreter, of real numbers, of single values, of sequences.
//! Not here: methods of values ([`super::methods`]), operators ([`super::arithmetic`]).

use std::cmp::Ordering;
use std::f64::consts;
use std::rc::Rc;

use flexarm_settings::Severity;

use super::arithmetic::{binary, floor_division};
use super::methods::{elements, unique};
use super::value::{Value, float_of, float_repr, int_of};
use super::{ExpressionError, Interpreter};

/// Functions by their names without module.
const FUNCTIONS: &str = "\
    sin cos tan asin acos atan atan2 sinh cosh tanh sqrt exp log log10 log2 floor ceil trunc fabs \
    hypot pow fmod copysign radians degrees isnan isinf isfinite isclose gcd list dict len str float \
    int bool min max round sorted range abs all any divmod enumerate ord chr repr reversed set sum \
    tuple type zip load_yaml abs_filename dotify arg message warning error print_location fatal \
    tokenize cbrt fsum";

/// Returns a constant, a module or a function.
pub(super) fn named_value(name: &str) -> Option<Value> {
    Some(match name {
        "pi" => Value::Float(consts::PI),
        "e" => Value::Float(consts::E),
        "tau" => Value::Float(consts::TAU),
        "inf" => Value::Float(f64::INFINITY),
        "nan" => Value::Float(f64::NAN),
        "True" => Value::Bool(true),
        "False" => Value::Bool(false),
        "math" => Value::Module("math"),
        "python" => Value::Module("python"),
        "xacro" => Value::Module("xacro"),
        _ => Value::Function(FUNCTIONS.split(' ').find(|function| *function == name)?),
    })
}

/// Whether a property of that name hides a built-in one.
pub(crate) fn is_built_in(name: &str) -> bool {
    named_value(name).is_some()
}

impl Interpreter<'_> {
    /// Calls a function of [`FUNCTIONS`] with its arguments by position and by name.
    pub(super) fn call(
        &mut self,
        name: &'static str,
        arguments: &[Value],
        named: Vec<(String, Value)>,
    ) -> Result<Value, ExpressionError> {
        let text = |i: usize| arguments.get(i).map(Value::shown).unwrap_or_default();
        let message = || arguments.iter().map(Value::shown).collect::<Vec<_>>().join(" ");
        match (name, arguments) {
            // Functions of xacro.
            ("load_yaml", [_]) => return self.load_yaml(&text(0)),
            ("abs_filename", [_]) => return Ok(Value::text(self.beside(&text(0)).display().to_string())),
            ("arg", [_]) => return self.argument(&text(0)).map(Value::text),
            ("dotify", [dict]) => return Ok(dict.clone()),
            ("message", _) => self.remark(Severity::Note, "xacro-message", message(), ""),
            ("warning", _) => self.remark(Severity::Warning, "xacro-warning", message(), ""),
            ("error", _) => self.remark(Severity::Warning, "xacro-error", message(), ""),
            ("print_location", _) => {}
            ("fatal", _) => {
                return Err(ExpressionError::new(message()).help("the file itself stops here: see what it requires"));
            }
            // Functions that take names, or charge before they allocate.
            ("range", _) => return self.range(arguments),
            ("dict", _) => return dict(arguments, named),
            _ => {
                if let Some((key, _)) = named.first().filter(|_| name != "sorted") {
                    return Err(ExpressionError::new(format!("{name}() takes no argument {key:?} here")));
                }
                return plain(name, arguments);
            }
        }
        Ok(Value::text(""))
    }

    fn range(&mut self, arguments: &[Value]) -> Result<Value, ExpressionError> {
        let bounds: Option<Vec<i128>> = arguments.iter().map(Value::as_int).collect();
        let (start, end, step) = match bounds.as_deref() {
            Some([end]) => (0, *end, 1),
            Some([start, end]) => (*start, *end, 1),
            Some([start, end, step]) if *step != 0 => (*start, *end, *step),
            _ => return Err(ExpressionError::new("range() takes one to three whole numbers")),
        };
        let span = if step > 0 { end.saturating_sub(start) } else { start.saturating_sub(end) };
        let count = if span <= 0 { 0 } else { (span - 1) / step.saturating_abs() + 1 };
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        self.charge(count.saturating_mul(32))?;
        Ok(Value::list((0..count).map(|k| Value::Int(start + k as i128 * step)).collect()))
    }
}

fn dict(arguments: &[Value], named: Vec<(String, Value)>) -> Result<Value, ExpressionError> {
    let mut pairs = match arguments {
        [] => Vec::new(),
        [Value::Dict(items)] => items.to_vec(),
        [other] => {
            let pair = |value: Value| match &elements(&value)?[..] {
                [key, value] => Ok((key.clone(), value.clone())),
                _ => Err(ExpressionError::new("dict() takes pairs")),
            };
            elements(other)?.into_iter().map(pair).collect::<Result<_, _>>()?
        }
        _ => return Err(ExpressionError::new("dict() takes at most one argument without a name")),
    };
    pairs.extend(named.into_iter().map(|(key, value)| (Value::text(key), value)));
    Ok(Value::Dict(Rc::new(unique(pairs))))
}

/// A function that depends only on its arguments.
fn plain(name: &str, arguments: &[Value]) -> Result<Value, ExpressionError> {
    let numbers: Option<Vec<f64>> = arguments.iter().map(Value::as_float).collect();
    if let Some(value) = numbers.as_deref().and_then(|numbers| of_numbers(name, numbers)) {
        return value.map(Value::Float).map_err(|domain| domain.within(format!("{name}()")));
    }
    let wrong = || {
        let kinds: Vec<&str> = arguments.iter().map(Value::kind).collect();
        ExpressionError::new(format!("{name}() does not take {} ({})", arguments.len(), kinds.join(", ")))
    };
    Ok(match (name, arguments) {
        // Rounding and tests of numbers.
        ("floor", [x]) => rounded(x, f64::floor).ok_or_else(wrong)?,
        ("ceil", [x]) => rounded(x, f64::ceil).ok_or_else(wrong)?,
        ("trunc", [x]) => rounded(x, f64::trunc).ok_or_else(wrong)?,
        ("isnan", [x]) => Value::Bool(x.as_float().ok_or_else(wrong)?.is_nan()),
        ("isinf", [x]) => Value::Bool(x.as_float().ok_or_else(wrong)?.is_infinite()),
        ("isfinite", [x]) => Value::Bool(x.as_float().ok_or_else(wrong)?.is_finite()),
        ("isclose", [a, b]) => {
            let (a, b) = (a.as_float().ok_or_else(wrong)?, b.as_float().ok_or_else(wrong)?);
            Value::Bool(a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs()))
        }
        // Arithmetic of integers.
        ("gcd", [a, b]) => Value::Int(gcd(a.as_int().ok_or_else(wrong)?, b.as_int().ok_or_else(wrong)?)),
        ("abs", [Value::Float(x)]) => Value::Float(x.abs()),
        ("abs", [x]) => Value::Int(x.as_int().and_then(i128::checked_abs).ok_or_else(wrong)?),
        ("round", [x]) => rounded(x, f64::round_ties_even).ok_or_else(wrong)?,
        ("round", [x, digits]) => round_to(x, digits).ok_or_else(wrong)?,
        // Conversions.
        ("int", []) => Value::Int(0),
        ("int", [Value::Str(text)]) => Value::Int(int_of(text).ok_or_else(|| not_number("whole number", text))?),
        ("int", [x]) => rounded(x, f64::trunc).ok_or_else(wrong)?,
        ("float", []) => Value::Float(0.0),
        ("float", [Value::Str(text)]) => Value::Float(float_of(text).ok_or_else(|| not_number("number", text))?),
        ("float", [x]) => Value::Float(x.as_float().ok_or_else(wrong)?),
        ("str", []) => Value::text(""),
        ("str", [value]) => Value::text(value.shown()),
        ("repr", [value]) => Value::text(value.repr()),
        ("bool", []) => Value::Bool(false),
        ("bool", [value]) => Value::Bool(value.is_true()),
        // Lengths, types and characters.
        ("len", [Value::Str(text)]) => Value::Int(text.chars().count() as i128),
        ("len", [value]) => Value::Int(elements(value)?.len() as i128),
        ("type", [value]) => Value::text(format!("<class '{}'>", value.kind())),
        ("ord", [Value::Str(text)]) if text.chars().count() == 1 => {
            Value::Int(text.chars().next().map_or(0, |c| i128::from(u32::from(c))))
        }
        ("chr", [code]) => {
            let code = code.as_int().and_then(|i| u32::try_from(i).ok()).and_then(char::from_u32);
            Value::text(code.ok_or_else(wrong)?.to_string())
        }
        ("divmod", [a, b]) => Value::Tuple(Rc::new(divmod(a, b)?.ok_or_else(wrong)?.to_vec())),
        _ => return of_elements(name, arguments).unwrap_or_else(|| Err(wrong())),
    })
}

fn gcd(mut a: i128, mut b: i128) -> i128 {
    while b != 0 {
        (a, b) = (b, a.wrapping_rem(b));
    }
    a.saturating_abs()
}

/// Quotient and remainder; `None` unless both arguments are numbers.
fn divmod(a: &Value, b: &Value) -> Result<Option<[Value; 2]>, ExpressionError> {
    if a.as_int().is_some() && b.as_int().is_some() {
        let part = |sign| binary(sign, a, b, &mut |_| Ok(()));
        return Ok(Some([part("//")?, part("%")?]));
    }
    let (Some(a), Some(b)) = (a.as_float(), b.as_float()) else { return Ok(None) };
    if b == 0.0 {
        return Err(ExpressionError::new("division by zero"));
    }
    let (quotient, remainder) = floor_division(a, b);
    Ok(Some([quotient, remainder].map(Value::Float)))
}

/// Functions of sequences; `None` if there is no such function.
fn of_elements(name: &str, arguments: &[Value]) -> Option<Result<Value, ExpressionError>> {
    let value = match (name, arguments) {
        // Containers.
        ("list", []) => Ok(Value::list(Vec::new())),
        ("tuple", []) => Ok(Value::Tuple(Rc::new(Vec::new()))),
        ("list", [items]) => elements(items).map(Value::list),
        ("tuple", [items]) => elements(items).map(|items| Value::Tuple(Rc::new(items))),
        ("set", [items]) => elements(items).map(|items| {
            let unit = items.into_iter().map(|item| (item, Value::None)).collect();
            Value::list(unique(unit).into_iter().map(|(item, _)| item).collect())
        }),
        // Reductions.
        ("min" | "max", arguments) => extreme(name, arguments),
        ("all", [items]) => elements(items).map(|items| Value::Bool(items.iter().all(Value::is_true))),
        ("any", [items]) => elements(items).map(|items| Value::Bool(items.iter().any(Value::is_true))),
        ("sum" | "fsum", [items]) => elements(items).and_then(|items| {
            let add = |sum: Value, item: &Value| binary("+", &sum, item, &mut |_| Ok(()));
            items.iter().try_fold(Value::Int(0), add)
        }),
        // Other lists of the same elements.
        ("reversed", [items]) => elements(items).map(|items| Value::list(items.into_iter().rev().collect())),
        ("sorted", [items]) => elements(items).and_then(sorted),
        ("enumerate", [items]) => elements(items).map(|items| {
            let pair = |(i, item)| Value::Tuple(Rc::new(vec![Value::Int(i as i128), item]));
            Value::list(items.into_iter().enumerate().map(pair).collect())
        }),
        ("zip", lists) => lists.iter().map(elements).collect::<Result<Vec<_>, _>>().map(|lists| {
            let shortest = lists.iter().map(Vec::len).min().unwrap_or(0);
            let row = |i: usize| Value::Tuple(Rc::new(lists.iter().map(|list| list[i].clone()).collect()));
            Value::list((0..shortest).map(row).collect())
        }),
        ("tokenize", [Value::Str(text)]) => {
            let words = text.split([',', ';', ' ']).filter(|word| !word.is_empty());
            Ok(Value::list(words.map(Value::text).collect()))
        }
        _ => return None,
    };
    Some(value)
}

fn sorted(mut items: Vec<Value>) -> Result<Value, ExpressionError> {
    if let Some(pair) = items.windows(2).find(|pair| pair[0].order(&pair[1]).is_none()) {
        return Err(ExpressionError::new(format!("{} and {} have no order", pair[0].repr(), pair[1].repr())));
    }
    items.sort_by(|a, b| a.order(b).unwrap_or(Ordering::Equal));
    Ok(Value::list(items))
}

fn extreme(name: &str, arguments: &[Value]) -> Result<Value, ExpressionError> {
    let items = if let [items] = arguments { elements(items)? } else { arguments.to_vec() };
    let wanted = if name == "min" { Ordering::Less } else { Ordering::Greater };
    let mut items = items.into_iter();
    let mut best = items.next().ok_or_else(|| ExpressionError::new(format!("{name}() of nothing")))?;
    for item in items {
        match item.order(&best) {
            Some(order) if order == wanted => best = item,
            Some(_) => {}
            None => return Err(ExpressionError::new(format!("{} and {} have no order", item.repr(), best.repr()))),
        }
    }
    Ok(best)
}

fn not_number(what: &str, text: &str) -> ExpressionError {
    ExpressionError::new(format!("{text:?} is not a {what}"))
}

/// Rounds a float to an integer by a rule; integers are unchanged.
fn rounded(x: &Value, rule: fn(f64) -> f64) -> Option<Value> {
    match x {
        Value::Float(x) if x.is_finite() && x.abs() < 1e38 => Some(Value::Int(rule(*x) as i128)),
        Value::Float(_) => None,
        other => other.as_int().map(Value::Int),
    }
}

/// Rounds correctly in decimal, like Python.
fn round_to(x: &Value, digits: &Value) -> Option<Value> {
    if matches!(digits, Value::None) {
        return rounded(x, f64::round_ties_even);
    }
    let digits = digits.as_int()?;
    match (x, usize::try_from(digits)) {
        (Value::Float(x), Ok(_)) if !x.is_finite() => Some(Value::Float(*x)),
        (Value::Float(x), Ok(digits)) => format!("{x:.*}", digits.min(400)).parse().ok().map(Value::Float),
        (Value::Float(x), Err(_)) => {
            let scale = 10f64.powi(i32::try_from(-digits).ok()?);
            Some(Value::Float((x / scale).round_ties_even() * scale))
        }
        (whole, Ok(_)) => whole.as_int().map(Value::Int),
        _ => None,
    }
}

/// Functions of real numbers; `None` if there is no such function with this number of arguments.
fn of_numbers(name: &str, arguments: &[f64]) -> Option<Result<f64, ExpressionError>> {
    let value = match (name, arguments) {
        // Angles in rad.
        ("sin", [x]) => x.sin(),
        ("cos", [x]) => x.cos(),
        ("tan", [x]) => x.tan(),
        ("asin", [x]) => x.asin(),
        ("acos", [x]) => x.acos(),
        ("atan", [x]) => x.atan(),
        ("atan2", [y, x]) => y.atan2(*x),
        ("sinh", [x]) => x.sinh(),
        ("cosh", [x]) => x.cosh(),
        ("tanh", [x]) => x.tanh(),
        // Roots, exponentials and logarithms; a logarithm outside its domain is undefined.
        ("sqrt", [x]) => x.sqrt(),
        ("cbrt", [x]) => x.cbrt(),
        ("exp", [x]) => x.exp(),
        ("log", [x]) if *x > 0.0 => x.ln(),
        ("log", [x, base]) if *x > 0.0 && *base > 0.0 => x.ln() / base.ln(),
        ("log10", [x]) if *x > 0.0 => x.log10(),
        ("log2", [x]) if *x > 0.0 => x.log2(),
        ("log", [_] | [_, _]) | ("log10" | "log2", [_]) => f64::NAN,
        // Other.
        ("fabs", [x]) => x.abs(),
        ("hypot", numbers) => numbers.iter().fold(0.0f64, |h, x| h.hypot(*x)),
        ("pow", [x, y]) => x.powf(*y),
        ("fmod", [x, y]) => x % y,
        ("copysign", [x, y]) => x.copysign(*y),
        ("radians", [x]) => x * (consts::PI / 180.0),
        ("degrees", [x]) => x * (180.0 / consts::PI),
        _ => return None,
    };
    let defined = !value.is_nan() || arguments.iter().any(|x| x.is_nan());
    let shown = || arguments.iter().map(|x| float_repr(*x)).collect::<Vec<_>>().join(", ");
    Some(if defined { Ok(value) } else { Err(ExpressionError::new(format!("not defined for {}", shown()))) })
}
