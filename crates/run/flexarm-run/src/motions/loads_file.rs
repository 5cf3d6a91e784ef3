//! Files of loads and payloads (`--loads FILE.toml`), read into the values of a
//! [`Scenario`](crate::Scenario).
//!
//! Loads have a file of their own because they belong to a run and not to a robot. Start at
//! `read_loads`. Not here: the effect of the values on a robot (`applied_load`, `payload`). The
//! values keep their location in the file (`LoadLocation`), so that later errors can name it.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use exmex::{Express, FlatEx};
use flexarm_files::{NumberTable, Source, TextFileError as RobotFileError, named_file, read_text};
use flexarm_kinematics::{LinkInertia, Wrench};
use flexarm_stepping::{LoadAxes, TimedWrench};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::motions::applied_load::{AppliedLoad, interpolated};
use crate::motions::load_jumps::jumps_of;
use crate::motions::payload::PayloadChange;
use crate::ranges::{OF_LOADS, USUAL_OF_LOADS, judged};
use crate::robot::toml_file::parsed;

/// Loads file as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadsFile {
    format: Spanned<i64>,
    #[serde(default)]
    load: Vec<Spanned<LoadEntry>>,
    #[serde(default)]
    payload: Vec<Spanned<PayloadEntry>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadEntry {
    /// `tcp` or a link name.
    frame: Option<Spanned<String>>,
    /// `world` or `frame`.
    axes: Option<Spanned<String>>,
    /// `step`, `impulse`, `sine`, `sweep`, `milling`, `table` or `expression`.
    kind: Spanned<String>,
    /// Start time (s).
    #[serde(default)]
    start: f64,
    /// End time (s); the end of the run by default.
    end: Option<Spanned<f64>>,
    /// Force amplitude (N).
    #[serde(default)]
    force: [f64; 3],
    /// Moment amplitude (N m).
    #[serde(default)]
    torque: [f64; 3],
    /// sine: frequency (Hz).
    frequency: Option<Spanned<f64>>,
    /// sine: phase (rad).
    #[serde(default)]
    phase: f64,
    /// sweep: start frequency (Hz).
    from: Option<Spanned<f64>>,
    /// sweep: end frequency (Hz).
    to: Option<Spanned<f64>>,
    /// impulse: duration of the half sine (s); `force` is then the impulse (N s).
    duration: Option<Spanned<f64>>,
    /// milling: number of cutting edges.
    teeth: Option<u32>,
    /// milling: spindle speed (rev/min).
    spindle_rpm: Option<Spanned<f64>>,
    /// milling: number of harmonics of the tooth frequency in addition to the mean; 3 by default.
    harmonics: Option<u32>,
    /// table: CSV with time, fx, fy, fz and optionally tx, ty, tz (s, N, N m).
    file: Option<Spanned<PathBuf>>,
    /// expression: functions of t (s), for fx, fy, fz, tx, ty, tz.
    fx: Option<Spanned<String>>,
    fy: Option<Spanned<String>>,
    fz: Option<Spanned<String>>,
    tx: Option<Spanned<String>>,
    ty: Option<Spanned<String>>,
    tz: Option<Spanned<String>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PayloadEntry {
    /// Time of the change (s).
    at: f64,
    /// New mass (kg), which replaces the mass carried before; 0 drops it.
    mass: f64,
    /// Link that carries the payload; by default that of the robot's payload, or else of the TCP.
    link: Option<Spanned<String>>,
    /// Centre of mass in link axes (m).
    #[serde(default)]
    com: [f64; 3],
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass (kg m²).
    inertia: Option<Spanned<[f64; 6]>>,
}

type WrenchFn = Arc<dyn Fn(f64) -> Wrench + Send + Sync>;

/// Location of a value in the file: its entry, its frame or link, and its inertia.
#[derive(Clone, Debug)]
pub(crate) struct LoadLocation {
    entry: RobotFileError,
    frame: RobotFileError,
    inertia: RobotFileError,
}

impl LoadLocation {
    fn new(source: &Source, entry: Range<usize>, frame: Option<Range<usize>>, inertia: Option<Range<usize>>) -> Self {
        let place = |span: Option<Range<usize>>| source.error(span.unwrap_or_else(|| entry.clone()), "");
        Self { entry: place(None), frame: place(frame), inertia: place(inertia) }
    }

    /// Error about the value as a whole, with its location if it was read from a file.
    pub(crate) fn entry(written: Option<&Self>, cause: impl ToString) -> Error {
        Self::error(written.map(|written| &written.entry), cause.to_string())
    }

    /// Error about the frame or link.
    pub(crate) fn frame(written: Option<&Self>, cause: impl ToString) -> Error {
        Self::error(written.map(|written| &written.frame), cause.to_string())
    }

    /// Error about the inertia.
    pub(crate) fn inertia(written: Option<&Self>, cause: impl ToString) -> Error {
        Self::error(written.map(|written| &written.inertia), cause.to_string())
    }

    fn error(place: Option<&RobotFileError>, message: String) -> Error {
        match place {
            Some(place) => RobotFileError { message, ..place.clone() }.into(),
            None => Error::Load(message),
        }
    }
}

/// Reads a loads file for a run that ends at `duration` (s).
///
/// # Errors
/// [`Error`] with file, location, the value found and the expected one.
pub(crate) fn read_loads(path: &Path, duration: f64) -> Result<(Vec<AppliedLoad>, Vec<PayloadChange>), Error> {
    parse_loads(&read_text(path)?, path, duration)
}

/// Reads loads and payloads from the text of a file, for a run that ends at `duration` (s).
///
/// * `path`: place of the file in messages; tables of loads are relative to its folder.
///
/// # Errors
/// [`Error`] with file, location, the value found and the expected one.
pub fn parse_loads(text: &str, path: &Path, duration: f64) -> Result<(Vec<AppliedLoad>, Vec<PayloadChange>), Error> {
    let source = Source::new(path, text, "loads");
    let file: LoadsFile = parsed(text, &source, OF_LOADS, |file: &LoadsFile| &file.format)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let loads = file.load.iter().map(|entry| load(entry, folder, duration, &source));
    let payloads = file.payload.iter().map(|entry| payload(entry, &source));
    let loads = loads.collect::<Result<_, _>>()?;
    for (k, entry) in file.payload.iter().enumerate() {
        let same = |other: &Spanned<PayloadEntry>| {
            let [a, b] = [entry, other].map(Spanned::get_ref);
            a.at == b.at && a.link.as_ref().map(Spanned::get_ref) == b.link.as_ref().map(Spanned::get_ref)
        };
        if file.payload[..k].iter().any(same) {
            let message = format!("two payloads change at {} s on the same link: keep one of them", entry.get_ref().at);
            return Err(source.error(entry.span(), message).into());
        }
    }
    Ok((loads, payloads.collect()))
}

/// Converts a load; whether its frame exists is checked later.
fn load(entry: &Spanned<LoadEntry>, folder: &Path, duration: f64, source: &Source) -> Result<AppliedLoad, Error> {
    let e = entry.get_ref();
    let axes = axes(entry, source)?;
    let (end, last) = end(entry, duration, source)?;
    if let Some((key, kinds)) = stray_key(e, e.kind.get_ref()) {
        let message = format!("kind = {:?} takes no {key}, only {kinds} does", e.kind.get_ref());
        return Err(source.error(entry.span(), message).into());
    }
    let Curve { value, bends, period } = Reading { entry, source, start: e.start, end }.curve(folder, duration)?;
    let jumps = [e.start].into_iter().chain(last).chain(bends).collect();
    let name = e.frame.as_ref().map_or("tcp", |frame| frame.get_ref());
    let written = LoadLocation::new(source, entry.span(), e.frame.as_ref().map(Spanned::span), None);
    let load =
        AppliedLoad::new(name, TimedWrench { axes, value, jumps, stops: Vec::new(), period }).starting_at(e.start);
    Ok(AppliedLoad { written: Some(written), findings: findings(e), ..load })
}

/// Returns the axes in which a load acts.
fn axes(entry: &Spanned<LoadEntry>, source: &Source) -> Result<LoadAxes, RobotFileError> {
    let axes = entry.get_ref().axes.as_ref();
    match axes.map(|axes| axes.get_ref().as_str()) {
        None | Some("world") => Ok(LoadAxes::World),
        Some("frame") => Ok(LoadAxes::Frame),
        Some(other) => {
            let message = format!("axes {other:?} are not known; use \"world\" or \"frame\"");
            Err(source.error(span_or(axes, entry), message))
        }
    }
}

/// Caveats about angles that look like degrees (the phase of a sine, arguments of sin and cos in
/// expressions), and about unusual numbers.
fn findings(e: &LoadEntry) -> Vec<Finding> {
    let angles = sines_of(e).filter_map(|(text, rate, phase)| caveat::loads::of_sine(&text, rate, phase));
    let numbers = [
        ("duration", &e.duration),
        ("spindle_rpm", &e.spindle_rpm),
        ("frequency", &e.frequency),
        ("from", &e.from),
        ("to", &e.to),
    ];
    let numbers = numbers.into_iter().filter_map(|(key, value)| Some((key, *value.as_ref()?.get_ref())));
    let numbers = numbers.chain(e.teeth.map(|teeth| ("teeth", f64::from(teeth))));
    let unusual =
        numbers.flat_map(|(key, number)| judged(&format!("load.{key}"), number, USUAL_OF_LOADS).collect::<Vec<_>>());
    caveat::loads::of_phase(e.phase).into_iter().chain(unusual).chain(angles).collect()
}

/// The sines and cosines in all expressions of a load; see [`sines`].
fn sines_of(e: &LoadEntry) -> impl Iterator<Item = (String, f64, f64)> + '_ {
    let parts = [&e.fx, &e.fy, &e.fz, &e.tx, &e.ty, &e.tz];
    parts.into_iter().flatten().flat_map(|text| sines(text.get_ref()))
}

/// Sines and cosines of an expression whose argument is linear in t, as text, rate (1/s) and value
/// at t = 0.
fn sines(text: &str) -> Vec<(String, f64, f64)> {
    let starts = ["sin", "cos"].into_iter().flat_map(|name| text.match_indices(name).map(|(at, _)| at));
    let one = |at: usize| {
        let open = at + 3 + text[at + 3..].find(|c: char| !c.is_whitespace())?;
        let mut depth = 0;
        let close = text[open..].char_indices().find_map(|(k, c)| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            (depth <= 0).then_some(open + k)
        })?;
        let argument: FlatEx<f64> = exmex::parse(&without_exponents(text.get(open + 1..close)?)).ok()?;
        if argument.var_names() != ["t"] {
            return None;
        }
        let value = |t: f64| argument.eval(&[t]).ok().filter(|x| x.is_finite());
        let [a, b, c] = [value(0.0)?, value(1.0)?, value(2.0)?];
        let linear = (c - 2.0 * b + a).abs() <= 1e-9 * (a.abs() + b.abs() + c.abs());
        linear.then(|| (text[at..=close].to_owned(), b - a, a))
    };
    starts.filter_map(one).collect()
}

/// Returns the latest end of a load (s), and the end given in the file, if any (s).
fn end(entry: &Spanned<LoadEntry>, duration: f64, source: &Source) -> Result<(f64, Option<f64>), RobotFileError> {
    let e = entry.get_ref();
    let last = e.end.as_ref().map(|end| *end.get_ref());
    let numbers = [e.start, e.phase].into_iter().chain(last).chain(e.force).chain(e.torque);
    if let Some(bad) = numbers.into_iter().find(|x| !x.is_finite()) {
        return Err(source.error(entry.span(), format!("a load has the entry {bad}, expected finite numbers")));
    }
    let end = last.unwrap_or(duration.max(e.start));
    if end < e.start {
        let message = format!("a load ends at {end} s before it starts at {} s", e.start);
        return Err(source.error(span_or(e.end.as_ref(), entry), message));
    }
    Ok((end, last))
}

/// Load as a function of time.
struct Curve {
    value: WrenchFn,
    /// Times of kinks and jumps, except start and end (s).
    bends: Vec<f64>,
    /// Shortest period in the load (s).
    period: f64,
}

/// Entry being read, with the time interval in which it acts (s).
struct Reading<'a> {
    entry: &'a Spanned<LoadEntry>,
    source: &'a Source,
    start: f64,
    end: f64,
}

impl Reading<'_> {
    /// Returns the curve of the entry's kind.
    fn curve(&self, folder: &Path, duration: f64) -> Result<Curve, Error> {
        let kind = &self.entry.get_ref().kind;
        match kind.get_ref().as_str() {
            "step" => Ok(self.scaled(Vec::new(), f64::INFINITY, |_| 1.0)),
            "impulse" => Ok(self.impulse()?),
            "sine" => Ok(self.sine()?),
            "sweep" => Ok(self.sweep()?),
            "milling" => Ok(self.milling()?),
            "table" => self.table(folder),
            "expression" => self.expression(duration),
            other => {
                let text = "use step, impulse, sine, sweep, milling, table or expression";
                Err(self.source.error(kind.span(), format!("load kind {other:?} is not known; {text}")).into())
            }
        }
    }

    fn lacks(&self, what: &str) -> RobotFileError {
        let kind = &self.entry.get_ref().kind;
        self.source.error(kind.span(), format!("kind = {:?} needs {what} = ...", kind.get_ref()))
    }

    fn needs(&self, value: Option<&Spanned<f64>>, what: &str) -> Result<f64, RobotFileError> {
        match value {
            Some(x) if x.get_ref().is_finite() && *x.get_ref() > 0.0 => Ok(*x.get_ref()),
            Some(x) => {
                Err(self.source.error(x.span(), format!("{what} = {}: expected a positive number", x.get_ref())))
            }
            None => Err(self.lacks(what)),
        }
    }

    /// Force and torque of the entry times a factor of the time since its start.
    fn scaled(&self, bends: Vec<f64>, period: f64, factor: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Curve {
        let e = self.entry.get_ref();
        let size = Wrench::new(e.force.into(), e.torque.into());
        let (start, end) = (self.start, self.end);
        let value = move |t| if t >= start && t <= end { size * factor(t - start) } else { Wrench::zeros() };
        Curve { value: Arc::new(value), bends, period }
    }

    /// Half sine of area 1.
    fn impulse(&self) -> Result<Curve, RobotFileError> {
        let d = self.needs(self.entry.get_ref().duration.as_ref(), "duration")?;
        // The pulse is zero at both ends; extra breakpoints make the stepper resolve its middle.
        let bends = [0.137, 0.5, 0.863, 1.0].iter().map(|s| self.start + s * d).collect();
        let factor = move |t: f64| if t < d { 0.5 * PI / d * (PI * t / d).sin() } else { 0.0 };
        Ok(self.scaled(bends, f64::INFINITY, factor))
    }

    fn sine(&self) -> Result<Curve, RobotFileError> {
        let (f, phase) =
            (self.needs(self.entry.get_ref().frequency.as_ref(), "frequency")?, self.entry.get_ref().phase);
        Ok(self.scaled(Vec::new(), 1.0 / f, move |t| (TAU * f * t + phase).sin()))
    }

    fn sweep(&self) -> Result<Curve, RobotFileError> {
        let e = self.entry.get_ref();
        let (from, to) = (self.needs(e.from.as_ref(), "from")?, self.needs(e.to.as_ref(), "to")?);
        let rate = (to - from) / (self.end - self.start).max(1e-9);
        let factor = move |t: f64| (TAU * (from * t + 0.5 * rate * t * t)).sin();
        Ok(self.scaled(Vec::new(), 1.0 / from.max(to), factor))
    }

    fn milling(&self) -> Result<Curve, RobotFileError> {
        let e = self.entry.get_ref();
        let fail = |message: String| self.source.error(self.entry.span(), message);
        let teeth = f64::from(e.teeth.ok_or_else(|| self.lacks("teeth"))?);
        if teeth == 0.0 {
            return Err(fail("teeth = 0: expected the number of cutting edges".into()));
        }
        let tooth = teeth * self.needs(e.spindle_rpm.as_ref(), "spindle_rpm")? / 60.0;
        let harmonics = e.harmonics.unwrap_or(3);
        if harmonics > MAX_HARMONICS {
            return Err(fail(format!("harmonics = {harmonics}: expected at most {MAX_HARMONICS}")));
        }
        // Mean 1 plus harmonics of halving amplitude, shaped like an intermittent cut.
        let factor = move |t: f64| {
            1.0 + (1..=harmonics)
                .map(|k| 0.5f64.powi(k as i32 - 1) * (TAU * f64::from(k) * tooth * t).sin())
                .sum::<f64>()
        };
        Ok(self.scaled(Vec::new(), 1.0 / (tooth * f64::from(harmonics.max(1))), factor))
    }

    fn table(&self, folder: &Path) -> Result<Curve, Error> {
        let file = self.entry.get_ref().file.as_ref().ok_or_else(|| self.lacks("file"))?;
        let located = |message: String| self.source.error(file.span(), message);
        let path = named_file("file", file.get_ref(), folder).map_err(located)?;
        let (inner, bends) = table(&path)?;
        let (start, end) = (self.start, self.end);
        let value = move |t| if t >= start && t <= end { inner(t) } else { Wrench::zeros() };
        Ok(Curve { value: Arc::new(value), bends, period: f64::INFINITY })
    }

    fn expression(&self, duration: f64) -> Result<Curve, Error> {
        let value = expression(self.entry.get_ref(), self.source, (self.start, self.end))?;
        let bends = jumps_of(&*value, self.start.max(0.0), self.end.min(duration));
        let periods = sines_of(self.entry.get_ref()).map(|(_, rate, _)| TAU / rate.abs());
        Ok(Curve { value, bends, period: periods.fold(EXPRESSION_PERIOD, f64::min) })
    }
}

/// Converts an entry; whether the robot can carry the payload is checked later.
fn payload(entry: &Spanned<PayloadEntry>, source: &Source) -> PayloadChange {
    let e = entry.get_ref();
    let [xx, yy, zz, xy, xz, yz] = e.inertia.as_ref().map_or([0.0; 6], |inertia| *inertia.get_ref());
    let inertia_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let (link, inertia) = (e.link.as_ref().map(Spanned::span), e.inertia.as_ref().map(Spanned::span));
    PayloadChange {
        at_s: e.at,
        link: e.link.as_ref().map(|link| link.get_ref().clone()),
        carried: LinkInertia { mass: e.mass, com: e.com.into(), inertia_com },
        written: Some(LoadLocation::new(source, entry.span(), link, inertia)),
    }
}

/// Returns a key that this kind of load does not use, with the kinds that do.
fn stray_key(e: &LoadEntry, kind: &str) -> Option<(&'static str, &'static str)> {
    let sized = "step, impulse, sine, sweep and milling";
    let keys = [
        ("force", e.force != [0.0; 3], sized),
        ("torque", e.torque != [0.0; 3], sized),
        ("frequency", e.frequency.is_some(), "sine"),
        ("phase", e.phase != 0.0, "sine"),
        ("from", e.from.is_some(), "sweep"),
        ("to", e.to.is_some(), "sweep"),
        ("duration", e.duration.is_some(), "impulse"),
        ("teeth", e.teeth.is_some(), "milling"),
        ("spindle_rpm", e.spindle_rpm.is_some(), "milling"),
        ("harmonics", e.harmonics.is_some(), "milling"),
        ("file", e.file.is_some(), "table"),
        ("fx", e.fx.is_some(), "expression"),
        ("fy", e.fy.is_some(), "expression"),
        ("fz", e.fz.is_some(), "expression"),
        ("tx", e.tx.is_some(), "expression"),
        ("ty", e.ty.is_some(), "expression"),
        ("tz", e.tz.is_some(), "expression"),
    ];
    let known = ["step", "impulse", "sine", "sweep", "milling", "table", "expression"].contains(&kind);
    let stray = |(_, given, kinds): &&(&str, bool, &str)| known && *given && !kinds.contains(kind);
    keys.iter().find(stray).map(|(key, _, kinds)| (*key, *kinds))
}

/// Assumed longest period of an expression, whose content is unknown, for the reference stepper
/// (s).
pub(crate) const EXPRESSION_PERIOD: f64 = 5e-3;
/// Maximum length of an expression (characters).
const LONGEST_EXPRESSION: usize = 2000;
/// Maximum number of harmonics of a milling force; higher ones are negligible.
const MAX_HARMONICS: u32 = 50;
/// Maximum number of table rows at whose times the reference stepper stops.
const MAX_ROWS: usize = 1000;

/// Location of a value, or else of its entry.
fn span_or<T, E>(value: Option<&Spanned<T>>, entry: &Spanned<E>) -> Range<usize> {
    value.map_or(entry.span(), Spanned::span)
}

/// Reads a CSV table: linear between rows, zero outside; also returns the times of its kinks.
fn table(path: &Path) -> Result<(WrenchFn, Vec<f64>), Error> {
    const NAMES: [&str; 7] = ["time", "fx", "fy", "fz", "tx", "ty", "tz"];
    let table = NumberTable::read(path)?;
    let header = &table.names;
    if header[0] != "time" || header.iter().any(|name| !NAMES.contains(&name.as_str())) {
        let message = format!("the header is {header:?}, expected time and some of fx, fy, fz, tx, ty, tz");
        return Err(table.error(None, message).into());
    }
    if table.rows.len() < 2 {
        return Err(table.error(None, "a table of loads needs at least two rows").into());
    }
    // Columns that are missing are zero.
    let (mut times, mut F): (Vec<f64>, Vec<Wrench>) = (Vec::new(), Vec::new());
    for (k, values) in table.rows.iter().enumerate() {
        if let Some(empty) = values.iter().position(|value| value.is_nan()) {
            return Err(table.error(Some(k), format!("column {:?} is empty, expected a number", header[empty])).into());
        }
        if times.last().is_some_and(|t| *t >= values[0]) {
            return Err(table.error(Some(k), format!("time {} s does not rise: sort the rows", values[0])).into());
        }
        let value = |name: &str| header.iter().rposition(|of| of == name).map_or(0.0, |column| values[column]);
        let [fx, fy, fz, tx, ty, tz] = [1, 2, 3, 4, 5, 6].map(|c| value(NAMES[c]));
        times.push(values[0]);
        F.push(Wrench::new(Vector3::new(fx, fy, fz), Vector3::new(tx, ty, tz)));
    }
    // The reference stepper stops at the kinks, or at the ends of a long table.
    let bends = if times.len() <= MAX_ROWS { times.clone() } else { vec![times[0], times[times.len() - 1]] };
    Ok((Arc::new(interpolated(times, F)), bends))
}

/// Component of an expression, and whether it depends on time.
type Part = Option<(FlatEx<f64>, bool)>;

/// Returns the wrench of an expression, zero outside its time interval.
fn expression(e: &LoadEntry, source: &Source, (start, end): (f64, f64)) -> Result<WrenchFn, Error> {
    let texts = [&e.fx, &e.fy, &e.fz, &e.tx, &e.ty, &e.tz];
    if texts.iter().all(|t| t.is_none()) {
        let message = "kind = \"expression\" needs some of fx, fy, fz, tx, ty, tz as a function of t";
        return Err(source.error(e.kind.span(), message).into());
    }
    let parsed = texts.into_iter().map(|text| text.as_ref().map(|text| part(text, source, (start, end))).transpose());
    let parts: Vec<Part> = parsed.collect::<Result<_, _>>()?;
    Ok(Arc::new(move |t| {
        if t < start || t > end {
            return Wrench::zeros();
        }
        let at = |k: usize| match &parts[k] {
            Some((parsed, timed)) => {
                parsed.eval(if *timed { std::slice::from_ref(&t) } else { &[] }).unwrap_or(f64::NAN)
            }
            None => 0.0,
        };
        Wrench::new(Vector3::new(at(0), at(1), at(2)), Vector3::new(at(3), at(4), at(5)))
    }))
}

/// Parses one component, a function of t (s), and checks that it is finite at the start, the middle
/// and the end of its time interval.
fn part(
    entry: &Spanned<String>,
    source: &Source,
    (start, end): (f64, f64),
) -> Result<(FlatEx<f64>, bool), RobotFileError> {
    let text = entry.get_ref();
    let fail = |message: String| source.error(entry.span(), message);
    if text.len() > LONGEST_EXPRESSION {
        let length = text.len();
        return Err(fail(format!(
            "the expression has {length} characters, at most {LONGEST_EXPRESSION} are read, for it is computed in \
             every step: use kind = \"table\" for curves without a short formula"
        )));
    }
    // Parse, and allow t as the only variable.
    let parsed: FlatEx<f64> =
        exmex::parse(&without_exponents(text)).map_err(|error| fail(format!("expression {text:?}: {error}")))?;
    let unknown: Vec<&String> = parsed.var_names().iter().filter(|v| *v != "t").collect();
    if !unknown.is_empty() {
        return Err(fail(format!("expression {text:?} has the variables {unknown:?}; only t (s) is known")));
    }
    // Probe the value at three instants.
    let timed = !parsed.var_names().is_empty();
    for t in [start.max(0.0), 0.5 * (start.max(0.0) + end), end] {
        let probe = parsed.eval(if timed { std::slice::from_ref(&t) } else { &[] });
        if !probe.is_ok_and(|x: f64| x.is_finite()) {
            return Err(fail(format!("expression {text:?} is not a finite number at t = {t} s")));
        }
    }
    Ok((parsed, timed))
}

/// Returns an expression with its numbers such as 1e-3, which the parser does not read, as
/// decimals.
fn without_exponents(text: &str) -> String {
    let (mut plain, mut rest) = (String::new(), text);
    while let Some(first) = rest.chars().next() {
        let length = |text: &str, of: &dyn Fn(char) -> bool| text.find(|c| !of(c)).unwrap_or(text.len());
        let word = length(rest, &|c| c.is_alphabetic() || c == '_');
        let name = if word > 0 { length(rest, &|c| c.is_alphanumeric() || c == '_') } else { 0 };
        let digits = length(rest, &|c| c.is_ascii_digit() || c == '.');
        let after = rest[digits..].strip_prefix(['e', 'E']).unwrap_or("");
        let sign = usize::from(after.starts_with(['+', '-']));
        let exponent = length(&after[sign..], &|c| c.is_ascii_digit());
        let (taken, value) = match (name, digits, exponent) {
            (name, ..) if name > 0 => (name, None),
            (_, 0, _) => (first.len_utf8(), None),
            (_, digits, 0) => (digits, None),
            (_, digits, exponent) => {
                let end = digits + 1 + sign + exponent;
                (end, rest[..end].parse::<f64>().ok())
            }
        };
        plain += &value.map_or_else(|| rest[..taken].to_owned(), |value| value.to_string());
        rest = &rest[taken..];
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::without_exponents;

    #[test]
    fn numbers_with_exponents_become_decimals_and_names_stay() {
        let text = "1e3*sin(2.5E-1*t) + exp(-t) - 4e+2 + .5e1*e2e3 + 3*PI°";
        assert_eq!(without_exponents(text), "1000*sin(0.25*t) + exp(-t) - 400 + 5*e2e3 + 3*PI°");
    }
}
