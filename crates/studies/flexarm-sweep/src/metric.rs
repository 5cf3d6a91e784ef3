//! Metrics of a run: numbers of its summary by their path in the JSON, parameters, and expressions
//! of both.
//!
//! Start at [`Metric::parse`] and [`values`]. A path in an expression becomes a variable of the
//! parser's expression. Not here: which direction is better ([`super::direction`]).

use exmex::{Express, FlatEx, FloatOpsFactory, MakeOperators};
use serde_json::Value;

use super::direction::{self, Better};
use super::path::near;
use super::value::ParameterValue;

/// Keys of the summary that depend on the machine and the time of the run.
const OF_THE_MACHINE: [&str; 4] = ["wall_s", "cpu_s", "real_time_factor", "cpu_s_per_simulated_s"];
/// Maximum length of an expression (bytes).
const LONGEST: usize = 1000;
/// Keys that name the entries of a list.
const NAMES: [&str; 3] = ["name", "joint", "label"];

/// Number of a run that is available without its full summary.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(hidden)]
pub enum Quick {
    Peak,
    PeakTime,
    Rms,
    End,
    Sag,
    Duration,
    Frequency(usize),
    Mass,
}

/// Variable of an expression.
#[derive(Clone, Debug, PartialEq)]
enum Variable {
    /// Parameter, by its column.
    Parameter(usize),
    /// Earlier metric, by its index.
    Metric(usize),
    /// Number of the run, by its path.
    Fact(Vec<String>, Option<Quick>),
}

/// Metric of a run.
#[derive(Clone, Debug)]
#[doc(hidden)]
pub struct Metric {
    pub name: String,
    /// Text as written.
    pub text: String,
    /// Preferred direction, if known.
    pub better: Option<Better>,
    formula: Formula,
}

/// Expression of parameters, metrics and numbers of a run.
#[derive(Clone, Debug)]
pub(super) struct Formula {
    expression: FlatEx<f64>,
    variables: Vec<Variable>,
}

/// Reason why a text is not a metric or formula.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
#[doc(hidden)]
pub struct MetricError(String);

/// Names that a metric may refer to.
#[doc(hidden)]
pub struct Vocabulary<'a> {
    /// Names of the parameters, in the order of their columns; `None` for parameters that are not
    /// numeric.
    pub parameters: &'a [Option<String>],
    /// Earlier metrics.
    pub metrics: &'a [Metric],
    /// Summary with all names that a run of this study can have.
    pub summary: &'a Value,
}

/// Access to the numbers of a run.
#[doc(hidden)]
pub trait Facts {
    /// Returns the number at a path; NaN if there is none.
    fn number(&self, path: &[String], quick: Option<Quick>) -> f64;
}

/// Numbers from a full summary.
#[doc(hidden)]
pub struct SummaryFacts {
    pub summary: Value,
    pub mass_kg: f64,
}

impl Facts for SummaryFacts {
    fn number(&self, path: &[String], quick: Option<Quick>) -> f64 {
        match quick {
            Some(Quick::Mass) => self.mass_kg,
            _ => find(&self.summary, path).and_then(number).unwrap_or(f64::NAN),
        }
    }
}

/// Converts a value to a number; true is 1.
fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_bool().map(|truth| if truth { 1.0 } else { 0.0 }))
}

/// Returns the value at a path; list entries by index or by name.
fn find<'a>(value: &'a Value, path: &[String]) -> Option<&'a Value> {
    path.iter().try_fold(value, |value, word| match value {
        Value::Object(map) => map.get(word),
        Value::Array(list) => {
            let named = |entry: &&Value| NAMES.iter().any(|key| entry.get(key).and_then(Value::as_str) == Some(word));
            list.iter().find(named).or_else(|| list.get(word.parse::<usize>().ok()?))
        }
        _ => None,
    })
}

impl Metric {
    /// Parses `expression`, or `name = expression`.
    ///
    /// # Errors
    /// [`MetricError`] for an unknown variable, a syntax error or an invalid name.
    pub fn parse(text: &str, known: &Vocabulary<'_>) -> Result<Self, MetricError> {
        let (name, expression) = match text.split_once('=') {
            Some((name, expression)) => (name.trim(), expression.trim()),
            None => (text.trim(), text.trim()),
        };
        if name.is_empty() || name.chars().any(|c| c.is_control()) {
            return Err(MetricError(format!("metric {text:?} has no name: expected name = expression")));
        }
        if known.metrics.iter().any(|other| other.name == name)
            || name != expression && known.parameters.iter().flatten().any(|other| other == name)
        {
            return Err(MetricError(format!("metric {text:?}: the name {name:?} is taken: give it another one")));
        }
        let formula = Formula::parse(expression, known)?;
        let better = formula.better(known).or_else(|| direction::of_name(name));
        Ok(Self { name: name.to_owned(), text: text.trim().to_owned(), better, formula })
    }

    /// Whether the metric is available without the full summary of a run.
    pub(super) fn is_quick(&self) -> bool {
        self.formula.is_quick()
    }

    /// Evaluates the metric.
    ///
    /// * `before`: values of the earlier metrics.
    pub fn value(&self, parameters: &[ParameterValue], before: &[f64], facts: &dyn Facts) -> f64 {
        self.formula.value(parameters, before, facts)
    }
}

impl Formula {
    /// Parses an expression.
    ///
    /// # Errors
    /// [`MetricError`] for an unknown variable or a syntax error.
    pub(super) fn parse(text: &str, known: &Vocabulary<'_>) -> Result<Self, MetricError> {
        let (expression, variables) = expression_of(text, known)?;
        Ok(Self { expression, variables })
    }

    /// Returns the preferred direction, derived from those of the variables.
    fn better(&self, known: &Vocabulary<'_>) -> Option<Better> {
        let better_of = |variable: &Variable| match variable {
            Variable::Parameter(column) => direction::of_name(known.parameters[*column].as_deref()?),
            Variable::Metric(number) => known.metrics[*number].better,
            Variable::Fact(path, _) => direction::of_fact(path),
        };
        let variables: Vec<Option<Better>> = self.variables.iter().map(better_of).collect();
        direction::of_expression(&self.expression, &variables)
    }

    /// Evaluates an expression of parameters only.
    pub(super) fn of_parameters(&self, parameters: &[ParameterValue]) -> f64 {
        self.value(parameters, &[], &SummaryFacts { summary: Value::Null, mass_kg: f64::NAN })
    }

    /// Whether all variables are parameters.
    pub(super) fn is_of_parameters(&self) -> bool {
        self.variables.iter().all(|variable| matches!(variable, Variable::Parameter(_)))
    }

    /// Whether the expression is available without the full summary of a run.
    pub(super) fn is_quick(&self) -> bool {
        self.variables.iter().all(|variable| !matches!(variable, Variable::Fact(_, None)))
    }

    /// Evaluates the expression.
    ///
    /// * `before`: values of the earlier metrics.
    pub(super) fn value(&self, parameters: &[ParameterValue], before: &[f64], facts: &dyn Facts) -> f64 {
        let value_of = |variable: &Variable| match variable {
            Variable::Parameter(column) => parameters[*column].number().unwrap_or(f64::NAN),
            Variable::Metric(number) => before.get(*number).copied().unwrap_or(f64::NAN),
            Variable::Fact(path, quick) => facts.number(path, *quick),
        };
        let values: Vec<f64> = self.variables.iter().map(value_of).collect();
        let value = self.expression.eval(&values).unwrap_or(f64::NAN);
        // Infinite values would spoil means over a table of runs.
        if value.is_finite() { value } else { f64::NAN }
    }
}

/// Evaluates all metrics of a run.
pub(super) fn values(metrics: &[Metric], parameters: &[ParameterValue], facts: &dyn Facts) -> Vec<f64> {
    let mut found = Vec::with_capacity(metrics.len());
    for metric in metrics {
        let value = metric.value(parameters, &found, facts);
        found.push(value);
    }
    found
}

/// Parses an expression, with a variable in place of each path.
fn expression_of(text: &str, known: &Vocabulary<'_>) -> Result<(FlatEx<f64>, Vec<Variable>), MetricError> {
    if text.len() > LONGEST {
        return Err(MetricError(format!("the expression has {} bytes, the maximum is {LONGEST}", text.len())));
    }
    let mut plain = String::new();
    let mut words: Vec<String> = Vec::new();
    for token in tokens(text) {
        match token {
            Token::Word(word) => {
                let place = words.iter().position(|known| *known == word).unwrap_or_else(|| {
                    words.push(word);
                    words.len() - 1
                });
                plain += &format!("{{v{place}}}");
            }
            Token::Other(other) => plain += &other,
        }
    }
    let variables = words.iter().map(|word| variable(word, known)).collect::<Result<Vec<_>, _>>()?;
    let fail = |source: exmex::ExError| MetricError(format!("expression {text:?}: {source}"));
    let parsed: FlatEx<f64> = exmex::parse(&plain).map_err(fail)?;
    // The parser orders variables by name.
    let place = |name: &String| name.strip_prefix('v').and_then(|number| number.parse::<usize>().ok());
    let ordered = parsed.var_names().iter().filter_map(place).filter_map(|k| variables.get(k).cloned()).collect();
    Ok((parsed, ordered))
}

enum Token {
    /// Path.
    Word(String),
    /// Any other text, as the parser expects it.
    Other(String),
}

/// Splits an expression into paths and other text.
fn tokens(text: &str) -> Vec<Token> {
    let functions: Vec<&str> = FloatOpsFactory::<f64>::make().iter().map(|operator| operator.repr()).collect();
    let letters: Vec<char> = text.chars().collect();
    let mut found = Vec::new();
    let mut k = 0;
    while k < letters.len() {
        let c = letters[k];
        let start = k;
        if c == '{' {
            while k < letters.len() && letters[k] != '}' {
                k += 1;
            }
            found.push(Token::Word(letters[start + 1..k].iter().collect()));
            k += 1;
        } else if c.is_ascii_digit() || c == '.' {
            let is_sign = |k: usize| "+-".contains(letters[k]) && "eE".contains(letters[k - 1]);
            while k < letters.len()
                && (letters[k].is_ascii_alphanumeric() || letters[k] == '.' || k > start && is_sign(k))
            {
                k += 1;
            }
            let word: String = letters[start..k].iter().collect();
            // Written without an exponent, which the parser would take for a name.
            found.push(Token::Other(word.parse::<f64>().map_or(word, |x| x.to_string())));
        } else if c.is_alphabetic() || c == '_' {
            while k < letters.len() && goes_on(&letters, k) {
                k += 1;
            }
            let word: String = letters[start..k].iter().collect();
            found.push(if functions.contains(&word.as_str()) { Token::Other(word) } else { Token::Word(word) });
        } else {
            found.push(Token::Other(c.to_string()));
            k += 1;
        }
    }
    found
}

/// Whether a path continues with this character.
fn goes_on(letters: &[char], k: usize) -> bool {
    let next = letters.get(k + 1).copied().unwrap_or(' ');
    match letters[k] {
        '.' => next.is_alphanumeric() || next == '_',
        '[' => next.is_ascii_digit(),
        ']' => letters[..k].iter().rev().find(|c| !c.is_ascii_digit()) == Some(&'['),
        c => c.is_alphanumeric() || c == '_',
    }
}

/// Returns what a name in an expression stands for.
fn variable(word: &str, known: &Vocabulary<'_>) -> Result<Variable, MetricError> {
    if let Some(column) = known.parameters.iter().position(|name| name.as_deref() == Some(word)) {
        return Ok(Variable::Parameter(column));
    }
    if let Some(number) = known.metrics.iter().position(|metric| metric.name == word) {
        return Ok(Variable::Metric(number));
    }
    // A number of the summary, by its path; those of the machine are no results.
    let path: Vec<String> = word.replace('[', ".").replace(']', "").split('.').map(str::to_owned).collect();
    if path.len() == 1 && OF_THE_MACHINE.contains(&word) {
        let why = "depends on the machine and its load: it cannot be a metric of a study";
        return Err(MetricError(format!("{word} {why}")));
    }
    let quick = quick(&path);
    match (quick, find(known.summary, &path)) {
        (Some(Quick::Mass), _) => Ok(Variable::Fact(path, quick)),
        (_, Some(Value::Null | Value::Number(_) | Value::Bool(_))) => Ok(Variable::Fact(path, quick)),
        (_, found) => {
            let what = match found {
                Some(Value::String(_)) => "is a string, expected a number",
                Some(_) => "has several entries, expected a number",
                None if known.summary.is_null() => "is not a parameter defined before this one",
                None => "is not in the summary of a run",
            };
            let mut all = Vec::new();
            if !known.summary.is_null() {
                all.push("robot.mass_kg".to_owned());
                leaves(known.summary, "", &mut all);
            }
            all.extend(known.parameters.iter().flatten().cloned());
            Err(MetricError(format!("{word:?} {what}; {}", near(word, &all))))
        }
    }
}

/// Returns the number at a path, if it is available without the full summary.
fn quick(path: &[String]) -> Option<Quick> {
    let words: Vec<&str> = path.iter().map(String::as_str).collect();
    Some(match words[..] {
        ["tcp", "peak_m"] => Quick::Peak,
        ["tcp", "t_peak_s"] => Quick::PeakTime,
        ["tcp", "rms_m"] => Quick::Rms,
        ["tcp", "end_m"] => Quick::End,
        ["tcp", "static_sag_m"] => Quick::Sag,
        ["duration_s"] => Quick::Duration,
        ["frequencies_hz", number] => Quick::Frequency(number.parse().ok()?),
        ["robot", "mass_kg"] => Quick::Mass,
        _ => return None,
    })
}

/// Collects the paths of all numbers.
fn leaves(value: &Value, place: &str, found: &mut Vec<String>) {
    let below = |word: &str| if place.is_empty() { word.to_owned() } else { format!("{place}.{word}") };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, inner)| leaves(inner, &below(key), found)),
        Value::Array(list) => {
            for (number, inner) in list.iter().enumerate() {
                let name = NAMES.iter().find_map(|key| inner.get(key).and_then(Value::as_str));
                leaves(inner, &below(name.unwrap_or(&number.to_string())), found);
            }
        }
        Value::Null | Value::Number(_) | Value::Bool(_) => found.push(place.to_owned()),
        Value::String(_) => {}
    }
}
