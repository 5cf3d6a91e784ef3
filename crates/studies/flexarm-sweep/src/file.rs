//! File of a study (`docs/sweep.md`): varied parameters, sampling, and metrics. Checks only what
//! does not need the robot.
//!
//! Start at [`read`]. Every entry keeps its place in the file: paths, metrics and options are
//! checked later against the robot ([`super::workshop`]), with the same line and column.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use flexarm_files::{NumberTable, read_text};
use flexarm_run::robot_file::Source;
use flexarm_run::toml_file::{parsed, word};
use flexarm_run::{Error, RobotFileError};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::direction::Better;
use super::value::ParameterValue;
use crate::statistics::{Distribution, SampleMethod};

/// Contents of the file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyToml {
    format: Spanned<i64>,
    name: Option<Spanned<String>>,
    robot: Spanned<String>,
    motion: Option<Spanned<String>>,
    loads: Option<Spanned<String>>,
    runs: Option<Spanned<PathBuf>>,
    #[serde(default)]
    options: BTreeMap<String, Spanned<toml::Value>>,
    #[serde(default)]
    reduce: BTreeMap<String, Spanned<PathBuf>>,
    #[serde(default)]
    parameter: Vec<Spanned<ParameterToml>>,
    sample: Option<Spanned<SampleToml>>,
    metrics: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    better: BTreeMap<String, Spanned<String>>,
    best: Option<Spanned<String>>,
    pareto: Option<Spanned<[String; 2]>>,
}

/// Varied parameter.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterToml {
    path: Option<Spanned<String>>,
    #[serde(default)]
    paths: Vec<Spanned<String>>,
    name: Option<Spanned<String>>,
    #[serde(rename = "as")]
    role: Option<Spanned<String>>,
    #[serde(default)]
    each: bool,
    linked: Option<String>,
    expression: Option<String>,
    values: Option<Spanned<Vec<toml::Value>>>,
    from: Option<f64>,
    to: Option<f64>,
    count: Option<Spanned<i64>>,
    spacing: Option<Spanned<String>>,
    distribution: Option<Spanned<String>>,
    low: Option<f64>,
    high: Option<f64>,
    mean: Option<f64>,
    std: Option<f64>,
    median: Option<f64>,
    sigma: Option<f64>,
    mode: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SampleToml {
    method: Option<Spanned<String>>,
    count: Spanned<i64>,
    #[serde(default)]
    seed: u64,
}

/// Effect of a parameter's value on the value in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Replaces the value in the file.
    Value,
    /// Multiplies the value in the file.
    Factor,
    /// Is added to the value in the file.
    Offset,
}

/// Values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    /// List of values, all of which are used.
    Levels(Vec<ParameterValue>),
    /// Random values from a distribution.
    Spread(Distribution),
    /// Random values from a list with equal probabilities.
    Choice(Vec<ParameterValue>),
    /// Expression of other parameters.
    Derived(String),
}

/// Parameter with its place in the file, for messages.
#[derive(Clone, Debug)]
pub(super) struct ParameterEntry {
    pub(super) name: Option<String>,
    pub(super) paths: Vec<String>,
    pub(super) role: Role,
    /// Whether every entry that its paths match is a parameter of its own.
    pub(super) each: bool,
    /// Group of parameters that vary together.
    pub(super) linked: Option<String>,
    pub(super) values: Values,
    pub(super) place: RobotFileError,
}

/// Text with its place in the file.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) text: String,
    pub(super) place: RobotFileError,
}

/// Contents of the file after checks.
#[derive(Clone, Debug)]
pub(super) struct StudyFile {
    pub(super) path: PathBuf,
    pub(super) text: String,
    pub(super) name: String,
    pub(super) robot: Placed,
    pub(super) motion: Option<Placed>,
    pub(super) loads: Option<Placed>,
    pub(super) options: Vec<(String, ParameterValue, RobotFileError)>,
    /// Jobs for recomputing reduced links.
    pub(super) reduce: Vec<(String, PathBuf, RobotFileError)>,
    pub(super) parameters: Vec<ParameterEntry>,
    pub(super) method: SampleMethod,
    pub(super) count: usize,
    pub(super) seed: u64,
    pub(super) sample_place: RobotFileError,
    pub(super) metrics: Vec<Placed>,
    /// Preferred direction of metrics, by name.
    pub(super) better: Vec<(String, Better, RobotFileError)>,
    pub(super) best: Option<Placed>,
    pub(super) pareto: Option<([String; 2], RobotFileError)>,
}

/// Name of the group that links the columns of a table of runs.
pub(super) const TABLE: &str = "the table of runs";
/// Default number of values in a range.
const USUAL_STEPS: usize = 5;
/// Maximum number of levels of a parameter, and of points of a sample.
const MAX_VALUES: i64 = 1_000_000;

/// Reads the file of a study.
///
/// # Errors
/// [`Error::File`], [`Error::RobotFile`] with line and column.
pub(super) fn read(path: &Path) -> Result<StudyFile, Error> {
    let text = read_text(path)?;
    let source = Source::new(path, &text, "study");
    let file: StudyToml = parsed(&text, &source, &[], |file: &StudyToml| &file.format)?;
    // Parameters: entries and the columns of a table of runs.
    let placed = |text: &Spanned<String>| Placed { text: text.get_ref().clone(), place: source.error(text.span(), "") };
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut parameters =
        file.parameter.iter().map(|entry| parameter(entry, &source)).collect::<Result<Vec<_>, RobotFileError>>()?;
    if let Some(table) = &file.runs {
        parameters.extend(table_of_runs(&folder.join(table.get_ref()), &source.error(table.span(), ""))?);
    }
    let drawn = parameters.iter().any(|p| matches!(p.values, Values::Spread(_) | Values::Choice(_)));
    let (method, count, seed, sample_place) = sample(file.sample.as_ref(), drawn, &source)?;
    // Entries that are checked against the robot later keep their place in the file.
    let options = file.options.iter().map(|(key, value)| option(key, value, &source)).collect::<Result<_, _>>()?;
    let reduce =
        file.reduce.iter().map(|(link, job)| (link.clone(), folder.join(job.get_ref()), source.error(job.span(), "")));
    let stem = path.file_stem().map_or_else(|| "study".into(), |stem| stem.to_string_lossy().into_owned());
    Ok(StudyFile {
        path: path.to_owned(),
        name: file.name.as_ref().map_or(stem, |name| name.get_ref().clone()),
        robot: placed(&file.robot),
        motion: file.motion.as_ref().map(placed),
        loads: file.loads.as_ref().map(placed),
        options,
        reduce: reduce.collect(),
        parameters,
        method,
        count,
        seed,
        sample_place,
        metrics: file.metrics.iter().flatten().map(placed).collect(),
        better: file.better.iter().map(|(name, word)| better(name, word, &source)).collect::<Result<_, _>>()?,
        best: file.best.as_ref().map(placed),
        pareto: file.pareto.as_ref().map(|pair| (pair.get_ref().clone(), source.error(pair.span(), ""))),
        text,
    })
}

/// Reads the preferred direction of a metric.
fn better(
    name: &str,
    word: &Spanned<String>,
    source: &Source,
) -> Result<(String, Better, RobotFileError), RobotFileError> {
    let place = source.error(word.span(), "");
    let message = || format!("better: {name:?} is {:?}, expected \"lower\" or \"higher\"", word.get_ref());
    match Better::from_word(word.get_ref()) {
        Some(better) => Ok((name.to_owned(), better, place)),
        None => Err(RobotFileError { message: message(), ..place }),
    }
}

/// Reads an option of the runs.
fn option(
    key: &str,
    value: &Spanned<toml::Value>,
    source: &Source,
) -> Result<(String, ParameterValue, RobotFileError), RobotFileError> {
    let place = source.error(value.span(), "");
    match ParameterValue::of(value.get_ref()) {
        Some(known) => Ok((key.to_owned(), known, place)),
        None => {
            let found = value.get_ref().type_str();
            let message = format!("options.{key} is a {found}, expected a number, a string, true or false");
            Err(RobotFileError { message, ..place })
        }
    }
}

/// Reads method, count and seed of the sample.
///
/// * `drawn`: whether a parameter has a distribution; only then there is a sample.
fn sample(
    entry: Option<&Spanned<SampleToml>>,
    drawn: bool,
    source: &Source,
) -> Result<(SampleMethod, usize, u64, RobotFileError), RobotFileError> {
    let Some(entry) = entry else {
        if drawn {
            let message =
                "a parameter has a distribution: set the number of samples with [sample], for instance count = 100";
            return Err(source.error(0..0, message));
        }
        return Ok((SampleMethod::Random, 1, 0, source.error(0..0, "")));
    };
    if !drawn {
        let message = "[sample] has no effect: no parameter has a distribution";
        return Err(source.error(entry.span(), message));
    }
    let sample = entry.get_ref();
    let method = match &sample.method {
        None => SampleMethod::LatinHypercube,
        Some(word) => {
            let known = SampleMethod::WORDS.iter().find(|(known, ..)| known == word.get_ref());
            known.map(|(_, method, _)| *method).ok_or_else(|| {
                let words = SampleMethod::WORDS.map(|(word, ..)| word).join(", ");
                source.error(word.span(), format!("method {:?} is not known; use {words}", word.get_ref()))
            })?
        }
    };
    let count = count(&sample.count, "count", 1, source)?;
    Ok((method, count, sample.seed, source.error(entry.span(), "")))
}

/// Returns a whole number from `least` to [`MAX_VALUES`].
fn count(value: &Spanned<i64>, what: &str, least: i64, source: &Source) -> Result<usize, RobotFileError> {
    match *value.get_ref() {
        n if (least..=MAX_VALUES).contains(&n) => Ok(n as usize),
        n => {
            let message = format!("{what} = {n}: expected a whole number from {least} to {MAX_VALUES}");
            Err(source.error(value.span(), message))
        }
    }
}

/// Keys of a robot file that only name things.
const LABELS: [&str; 3] = ["name", "format", "urdf"];

/// Reads a parameter.
fn parameter(entry: &Spanned<ParameterToml>, source: &Source) -> Result<ParameterEntry, RobotFileError> {
    // Paths, which must not name labels.
    let own = entry.get_ref();
    let fail = |message: String| source.error(entry.span(), message);
    let paths: Vec<String> = own.path.iter().chain(&own.paths).map(|path| path.get_ref().clone()).collect();
    let Some(first) = paths.first() else {
        return Err(fail("a parameter needs a path, such as \"payload.mass\", or paths = [...]".into()));
    };
    let fail = |message: String| source.error(entry.span(), format!("parameter {first:?}: {message}"));
    if let Some(label) = paths.iter().find(|path| LABELS.contains(&path.as_str())) {
        return Err(fail(format!(
            "{label:?} is a label that no result depends on; vary a number of the robot or the run"
        )));
    }
    // Effect of the values on those in the files, and the values themselves.
    let roles = [("value", Role::Value), ("factor", Role::Factor), ("offset", Role::Offset)];
    let role = word(source, "as", &own.role, &roles)?.1;
    let values = values(own, source, &fail)?;
    let place = source.error(entry.span(), "");
    if own.each && own.name.is_some() {
        return Err(fail("each = true creates several parameters, named by their paths: remove name".into()));
    }
    if own.linked.is_some() && !matches!(values, Values::Levels(_)) {
        return Err(fail(
            "linked needs listed values; to sample one value for several paths, use paths = [...]".into(),
        ));
    }
    let (each, linked) = (own.each, own.linked.clone());
    let name = own.name.as_ref().map(|name| name.get_ref().clone());
    Ok(ParameterEntry { name, paths, role, each, linked, values, place })
}

/// Returns the values of a parameter.
fn values(
    own: &ParameterToml,
    source: &Source,
    fail: &dyn Fn(String) -> RobotFileError,
) -> Result<Values, RobotFileError> {
    const ONE: &str = "give exactly one of values = [...], from and to, distribution = \"...\" or expression = \"...\"";
    // Exactly one of four ways to give the values.
    let has_range = own.from.is_some() || own.to.is_some() || own.count.is_some();
    if let Some(expression) = &own.expression {
        return match own.values.is_none() && !has_range && own.distribution.is_none() {
            true => Ok(Values::Derived(expression.clone())),
            false => Err(fail(ONE.into())),
        };
    }
    match (&own.values, has_range, &own.distribution) {
        (Some(list), false, word) => {
            let known: Option<Vec<ParameterValue>> = list.get_ref().iter().map(ParameterValue::of).collect();
            let known = known.filter(|known| !known.is_empty()).ok_or_else(|| {
                source.error(list.span(), "values: expected a list of finite numbers, of strings, or of true and false")
            })?;
            if known.len() > 1 && known.iter().all(|value| *value == known[0]) {
                return Err(
                    source.error(list.span(), "values: all are equal, so that nothing is varied; give different ones")
                );
            }
            match word.as_ref().map(|word| word.get_ref().as_str()) {
                None => Ok(Values::Levels(known)),
                Some("choice") => Ok(Values::Choice(known)),
                Some(other) => {
                    Err(fail(format!("distribution = {other:?} does not allow values; only \"choice\" does")))
                }
            }
        }
        (None, true, None) => range(own, source, fail),
        (None, false, Some(word)) => distribution(own, word.get_ref(), fail).map(Values::Spread),
        _ => Err(fail(ONE.into())),
    }
}

/// Returns equally or logarithmically spaced values of a range.
fn range(
    own: &ParameterToml,
    source: &Source,
    fail: &dyn Fn(String) -> RobotFileError,
) -> Result<Values, RobotFileError> {
    let (Some(from), Some(to)) = (own.from, own.to) else {
        return Err(fail("a range needs from = ... and to = ...".into()));
    };
    let logarithmic = word(source, "spacing", &own.spacing, &[("linear", false), ("log", true)])?.1;
    if !(from.is_finite() && to.is_finite()) || logarithmic && !(from > 0.0 && to > 0.0) {
        let expected = if logarithmic { "positive numbers for spacing = \"log\"" } else { "finite numbers" };
        return Err(fail(format!("from = {from}, to = {to}: expected {expected}")));
    }
    if from == to {
        return Err(fail(format!("from and to are {from}, so that nothing is varied; give different ones")));
    }
    // Equal differences or ratios; the last value is exactly the end.
    let steps = match &own.count {
        Some(steps) => count(steps, "count", 2, source)?,
        None => USUAL_STEPS,
    };
    let at = |k: usize| {
        let part = k as f64 / (steps - 1) as f64;
        match (k + 1 == steps, logarithmic) {
            (true, _) => to,
            (false, true) => from * (to / from).powf(part),
            (false, false) => from + (to - from) * part,
        }
    };
    Ok(Values::Levels((0..steps).map(|k| ParameterValue::Number(at(k))).collect()))
}

/// Returns the keys of a distribution.
fn keys_of_distribution(
    word: &str,
    fail: &dyn Fn(String) -> RobotFileError,
) -> Result<&'static [&'static str], RobotFileError> {
    match word {
        "uniform" | "log-uniform" => Ok(&["low", "high"]),
        "normal" => Ok(&["mean", "std"]),
        "lognormal" => Ok(&["median", "sigma"]),
        "triangular" => Ok(&["low", "mode", "high"]),
        "choice" => Err(fail("distribution = \"choice\" needs values = [...]".into())),
        other => {
            let words = "uniform, log-uniform, normal, lognormal, triangular or choice";
            Err(fail(format!("distribution {other:?} is not known; use {words}")))
        }
    }
}

/// Reads a distribution: all of its keys and no others, in the order low, mode, high.
fn distribution(
    own: &ParameterToml,
    word: &str,
    fail: &dyn Fn(String) -> RobotFileError,
) -> Result<Distribution, RobotFileError> {
    let numbers = [
        ("low", own.low),
        ("high", own.high),
        ("mean", own.mean),
        ("std", own.std),
        ("median", own.median),
        ("sigma", own.sigma),
        ("mode", own.mode),
    ];
    let taken = keys_of_distribution(word, fail)?;
    if let Some((key, _)) = numbers.iter().find(|(key, value)| value.is_some() && !taken.contains(key)) {
        return Err(fail(format!("distribution = {word:?} has no key {key}; its keys are {}", taken.join(", "))));
    }
    // Checks of single numbers.
    let number = |key: &str| match numbers.iter().find(|(known, _)| *known == key) {
        Some((_, Some(x))) if x.is_finite() => Ok(*x),
        Some((_, Some(x))) => Err(fail(format!("{key} = {x}: expected a finite number"))),
        _ => Err(fail(format!("distribution = {word:?} needs {key} = ..."))),
    };
    let ordered = |low: f64, high: f64| match low < high {
        true => Ok(()),
        false => Err(fail(format!("low = {low} must be less than high = {high}"))),
    };
    let positive = |what: &str, x: f64| match x > 0.0 {
        true => Ok(x),
        false => Err(fail(format!("{what} = {x}: expected a positive number"))),
    };
    Ok(match word {
        "uniform" | "log-uniform" => {
            let (low, high) = (number("low")?, number("high")?);
            ordered(low, high)?;
            match word {
                "uniform" => Distribution::Uniform { low, high },
                _ => Distribution::LogUniform { low: positive("low", low)?, high },
            }
        }
        "normal" => Distribution::Normal { mean: number("mean")?, std: positive("std", number("std")?)? },
        "lognormal" => Distribution::LogNormal {
            median: positive("median", number("median")?)?,
            sigma: positive("sigma", number("sigma")?)?,
        },
        _ => {
            let (low, mode, high) = (number("low")?, number("mode")?, number("high")?);
            ordered(low, high)?;
            if !(low..=high).contains(&mode) {
                return Err(fail(format!("mode = {mode} must be between low = {low} and high = {high}")));
            }
            Distribution::Triangular { low, mode, high }
        }
    })
}

/// Reads a table of runs: a column for each parameter, named by its path, a row for each run.
fn table_of_runs(path: &Path, place: &RobotFileError) -> Result<Vec<ParameterEntry>, Error> {
    let table = NumberTable::read(path)?;
    if table.rows.is_empty() {
        return Err(table.error(None, "the table has no rows: expected one for each run").into());
    }
    let column = |(k, name): (usize, &String)| {
        let value = |(number, row): (usize, &Vec<f64>)| match row[k].is_nan() {
            true => {
                let message = format!("column {name:?}: the cell is empty, expected a number");
                Err(table.error(Some(number), message).into())
            }
            false => Ok(ParameterValue::Number(row[k])),
        };
        let levels = table.rows.iter().enumerate().map(value).collect::<Result<Vec<_>, Error>>()?;
        Ok(ParameterEntry {
            name: None,
            paths: vec![name.clone()],
            role: Role::Value,
            each: false,
            linked: Some(TABLE.into()),
            values: Values::Levels(levels),
            place: place.clone(),
        })
    };
    table.names.iter().enumerate().map(column).collect()
}
