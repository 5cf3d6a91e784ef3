//! What acts on an arm from outside during a run: loads as functions of time, and payloads that are picked and dropped.
//!
//! A file of its own (`--loads FILE.toml`), because loads belong to a run and not to a robot. Start at
//! [`Disturbances::load`].

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use exmex::{Express, FlatEx};
use flexarm_kinematics::{Frame, LinkInertia, Model, Pose, SpatialInertia, Wrench};
use flexarm_stepping::{InertiaChange, Load, LoadAxes, TimedWrench};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use crate::caveat::size::Size;
use crate::caveat::{Caveat, parts};
use crate::error::Error;
use crate::input::read_text;
use crate::load_jumps::jumps_of;
use crate::robot::{PAYLOAD_LINK, Robot, TCP_FRAME};
use crate::robot_file::{RobotFileError, Source};

/// The file as written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadsFile {
    format: Spanned<i64>,
    #[serde(default)]
    load: Vec<Spanned<LoadEntry>>,
    #[serde(default)]
    payload: Vec<Spanned<PayloadChange>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadEntry {
    /// tcp, or a link.
    frame: Option<Spanned<String>>,
    /// world or frame.
    axes: Option<Spanned<String>>,
    /// step, impulse, sine, sweep, milling, table or expression.
    kind: Spanned<String>,
    /// When it begins (s).
    #[serde(default)]
    start: f64,
    /// When it ends (s); the end of the run if not given.
    end: Option<Spanned<f64>>,
    /// Size of the force (N).
    #[serde(default)]
    force: [f64; 3],
    /// Size of the moment (N m).
    #[serde(default)]
    torque: [f64; 3],
    /// sine (Hz).
    frequency: Option<Spanned<f64>>,
    /// sine (rad).
    #[serde(default)]
    phase: f64,
    /// sweep: first frequency (Hz).
    from: Option<Spanned<f64>>,
    /// sweep: last frequency (Hz).
    to: Option<Spanned<f64>>,
    /// impulse: length of the half sine (s); force is then the impulse (N s).
    duration: Option<Spanned<f64>>,
    /// milling: cutting edges.
    teeth: Option<u32>,
    /// milling: turns per minute.
    spindle_rpm: Option<Spanned<f64>>,
    /// milling: harmonics of the tooth frequency beside the mean; 3 if not given.
    harmonics: Option<u32>,
    /// table: CSV with time, fx, fy, fz and optionally tx, ty, tz (s, N, N m).
    file: Option<Spanned<PathBuf>>,
    /// expression: in t (s), for fx, fy, fz, tx, ty, tz.
    fx: Option<Spanned<String>>,
    fy: Option<Spanned<String>>,
    fz: Option<Spanned<String>>,
    tx: Option<Spanned<String>>,
    ty: Option<Spanned<String>>,
    tz: Option<Spanned<String>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PayloadChange {
    /// When (s).
    at: f64,
    /// Mass from then on, in the place of what was carried before (kg); 0 drops it.
    mass: f64,
    /// Link that carries it; that of the robot's payload, else of the TCP.
    link: Option<Spanned<String>>,
    /// Centre of mass in link axes (m).
    #[serde(default)]
    com: [f64; 3],
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass (kg m²).
    inertia: Option<Spanned<[f64; 6]>>,
}

/// Loads and changes, for a model.
#[derive(Clone, Debug, Default)]
pub struct Disturbances {
    /// Loads.
    pub loads: Vec<Load>,
    /// Changes of what bodies carry, by time.
    pub changes: Vec<InertiaChange>,
    /// Entries that do nothing.
    pub caveats: Vec<Caveat>,
}

type WrenchFn = Arc<dyn Fn(f64) -> Wrench + Send + Sync>;

impl Disturbances {
    /// Reads a file of loads for a model of the robot; `duration` is the end of the run (s).
    ///
    /// # Errors
    /// [`Error`] with file, place, what was found and what was expected.
    pub fn load(path: &Path, robot: &Robot, model: &Model, duration: f64) -> Result<Self, Error> {
        let text = read_text(path)?;
        let source = Source::new(path, &text);
        let file: LoadsFile = toml::from_str(&text).map_err(|error| {
            let message = error.message().trim().replace('\n', " ");
            source.error(error.span().unwrap_or(0..0), message)
        })?;
        if *file.format.get_ref() != 1 {
            let message = format!("format is {}, this program reads format 1", file.format.get_ref());
            return Err(source.error(file.format.span(), message).into());
        }
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut disturbances = Self::default();
        for entry in &file.load {
            disturbances.loads.push(load(entry, model, folder, duration, &source)?);
            let start = entry.get_ref().start;
            if start >= duration {
                let text = format!("a load starts at {start} s, the run ends at {duration} s: it does nothing");
                disturbances.caveats.push(Caveat::said("no-effect", "loads", text, "move it into the run"));
            }
        }
        let size = Size::of(&robot.urdf.mechanism);
        let mut changes: Vec<&Spanned<PayloadChange>> = file.payload.iter().collect();
        changes.sort_by(|a, b| a.get_ref().at.total_cmp(&b.get_ref().at));
        for entry in changes {
            let earlier = disturbances.changes.clone();
            disturbances.changes.push(change(entry, robot, model, &earlier, &source)?);
            let at = entry.get_ref().at;
            let weighs = robot.rigid.gravity.norm() > 0.0;
            let what = format!("the payload from {at} s on");
            disturbances.caveats.extend(parts::payload(&what, &carried(entry.get_ref()), &size, weighs));
            if at > duration {
                let text = format!("the payload changes at {at} s, the run ends at {duration} s: it stays as it is");
                disturbances.caveats.push(Caveat::said("no-effect", "loads", text, "move it into the run"));
            }
        }
        Ok(disturbances)
    }
}

/// Names of the links that move, for messages.
pub(crate) fn moving_links(model: &Model) -> Vec<&str> {
    let named = model.frames().iter().filter(|f| f.body > 0 && !f.name.starts_with("__"));
    named.map(|f| f.name.as_str()).collect()
}

/// The frame of this name; `tcp` is that of the tool.
pub(crate) fn frame_of<'m>(name: &str, model: &'m Model) -> Option<&'m Frame> {
    model.frame(if name == "tcp" { TCP_FRAME } else { name })
}

fn load(
    entry: &Spanned<LoadEntry>,
    model: &Model,
    folder: &Path,
    duration: f64,
    source: &Source,
) -> Result<Load, Error> {
    let e = entry.get_ref();
    let fail = |message: String| source.error(entry.span(), message);
    let name = e.frame.as_ref().map_or("tcp", |frame| frame.get_ref());
    let frame = frame_of(name, model).filter(|f| f.body > 0).ok_or_else(|| {
        let known = moving_links(model);
        let message = format!("load on frame {name:?}: expected \"tcp\" or a link that moves, of {known:?}");
        source.error(span_or(e.frame.as_ref(), entry), message)
    })?;
    let axes = match e.axes.as_ref().map(|axes| axes.get_ref().as_str()) {
        None | Some("world") => LoadAxes::World,
        Some("frame") => LoadAxes::Frame,
        Some(other) => {
            let message = format!("axes {other:?} are not known; use \"world\" or \"frame\"");
            return Err(source.error(span_or(e.axes.as_ref(), entry), message).into());
        }
    };
    let last = e.end.as_ref().map(|end| *end.get_ref());
    let numbers = [e.start, e.phase].into_iter().chain(last).chain(e.force).chain(e.torque);
    if let Some(bad) = numbers.into_iter().find(|x| !x.is_finite()) {
        return Err(fail(format!("a load has the entry {bad}, expected finite numbers")).into());
    }
    let end = last.unwrap_or(duration.max(e.start));
    if end < e.start {
        let message = format!("a load ends at {end} s before it starts at {} s", e.start);
        return Err(source.error(span_or(e.end.as_ref(), entry), message).into());
    }
    let kind = e.kind.get_ref().as_str();
    if let Some((key, kinds)) = stray_key(e, kind) {
        return Err(fail(format!("kind = {kind:?} takes no {key}, only {kinds} does")).into());
    }
    let lacks = |what: &str| source.error(e.kind.span(), format!("kind = {kind:?} needs {what} = ..."));
    let needs = |value: &Option<Spanned<f64>>, what: &str| match value {
        Some(x) if x.get_ref().is_finite() && *x.get_ref() > 0.0 => Ok(*x.get_ref()),
        Some(x) => Err(source.error(x.span(), format!("{what} = {}: expected a positive number", x.get_ref()))),
        None => Err(lacks(what)),
    };
    let size = Wrench::new(e.force.into(), e.torque.into());
    let start = e.start;
    let scaled = move |s: Box<dyn Fn(f64) -> f64 + Send + Sync>| -> WrenchFn {
        Arc::new(move |t| if t >= start && t <= end { size * s(t - start) } else { Wrench::zeros() })
    };
    let (mut rows, mut period) = (Vec::new(), f64::INFINITY);
    let wrench: WrenchFn = match kind {
        "step" => scaled(Box::new(|_| 1.0)),
        "impulse" => {
            let d = needs(&e.duration, "duration")?;
            // It is zero at both its ends: a solver must also see its middle.
            rows = [0.137, 0.5, 0.863, 1.0].iter().map(|s| start + s * d).collect();
            // Half a sine of area 1.
            scaled(Box::new(move |t| if t < d { 0.5 * PI / d * (PI * t / d).sin() } else { 0.0 }))
        }
        "sine" => {
            let (f, phase) = (needs(&e.frequency, "frequency")?, e.phase);
            period = 1.0 / f;
            scaled(Box::new(move |t| (TAU * f * t + phase).sin()))
        }
        "sweep" => {
            let (from, to) = (needs(&e.from, "from")?, needs(&e.to, "to")?);
            period = 1.0 / from.max(to);
            let rate = (to - from) / (end - start).max(1e-9);
            scaled(Box::new(move |t| (TAU * (from * t + 0.5 * rate * t * t)).sin()))
        }
        "milling" => {
            let teeth = f64::from(e.teeth.ok_or_else(|| lacks("teeth"))?);
            if teeth == 0.0 {
                return Err(fail("teeth = 0: expected the number of cutting edges".into()).into());
            }
            let tooth = teeth * needs(&e.spindle_rpm, "spindle_rpm")? / 60.0;
            let harmonics = e.harmonics.unwrap_or(3);
            if harmonics > MOST_HARMONICS {
                return Err(fail(format!("harmonics = {harmonics}: expected at most {MOST_HARMONICS}")).into());
            }
            period = 1.0 / (tooth * f64::from(harmonics.max(1)));
            // Mean 1, harmonics that halve: the shape of an intermittent cut.
            scaled(Box::new(move |t| {
                1.0 + (1..=harmonics)
                    .map(|k| 0.5f64.powi(k as i32 - 1) * (TAU * f64::from(k) * tooth * t).sin())
                    .sum::<f64>()
            }))
        }
        "table" => {
            let file = e.file.as_ref().ok_or_else(|| lacks("file"))?;
            let path = folder.join(file.get_ref());
            if !path.is_file() {
                let message = format!("file = {:?}: there is no file {}", file.get_ref(), path.display());
                return Err(source.error(file.span(), message).into());
            }
            let (inner, times) = table(&path)?;
            rows = times;
            Arc::new(move |t| if t >= start && t <= end { inner(t) } else { Wrench::zeros() })
        }
        "expression" => {
            period = EXPRESSION_PERIOD;
            let wrench = expression(e, source, (start, end))?;
            rows = jumps_of(&*wrench, start.max(0.0), end.min(duration));
            wrench
        }
        other => {
            let text = "use step, impulse, sine, sweep, milling, table or expression";
            return Err(source.error(e.kind.span(), format!("load kind {other:?} is not known; {text}")).into());
        }
    };
    let jumps = [start].into_iter().chain(last).chain(rows).filter(|t| *t <= duration).collect();
    Ok(Load { body: frame.body, X_BF: frame.X_BF, wrench: TimedWrench { axes, value: wrench, jumps, period } })
}

/// A key that the kind of load would not use, and the kinds that would.
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

/// Nobody knows what is in an expression: the reference stepper looks at it as at a vibration of this period (s).
pub(crate) const EXPRESSION_PERIOD: f64 = 5e-3;
/// Longest expression (characters).
const LONGEST_EXPRESSION: usize = 2000;
/// Most harmonics of a milling force; beyond, each is nothing against the first.
const MOST_HARMONICS: u32 = 50;
/// Most rows of a table whose times the reference stepper meets one by one.
const MOST_ROWS: usize = 1000;

/// Where a value stands, else its entry.
fn span_or<T, E>(value: Option<&Spanned<T>>, entry: &Spanned<E>) -> Range<usize> {
    value.map_or(entry.span(), Spanned::span)
}

/// Linear between the rows of a CSV, zero outside; with the times at which it bends.
fn table(path: &Path) -> Result<(WrenchFn, Vec<f64>), Error> {
    let fail = |what: String| Error::File { path: path.to_owned(), what };
    let text = read_text(path)?;
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let header: Vec<String> =
        lines.next().map(|(_, l)| l.split(',').map(|w| w.trim().to_owned()).collect()).unwrap_or_default();
    const NAMES: [&str; 7] = ["time", "fx", "fy", "fz", "tx", "ty", "tz"];
    if header.first().is_none_or(|h| h != "time") || header.iter().any(|h| !NAMES.contains(&h.as_str())) {
        return Err(fail(format!("the header is {header:?}, expected time and some of fx, fy, fz, tx, ty, tz")));
    }
    let earlier = |k: usize| header[..k].iter().position(|name| *name == header[k]);
    if let Some((k, first)) = (0..header.len()).find_map(|k| Some((k, earlier(k)?))) {
        let (name, first, second) = (&header[k], first + 1, k + 1);
        let mend = "remove or rename one of them";
        return Err(fail(format!("the header names {name:?} twice, in columns {first} and {second}: {mend}")));
    }
    let mut rows: Vec<(f64, [f64; 6])> = Vec::new();
    for (number, line) in lines {
        let values: Vec<f64> = line.split(',').map_while(|w| w.trim().parse().ok()).collect();
        if values.len() != header.len() || values.iter().any(|x| !x.is_finite()) {
            return Err(fail(format!("line {}: expected {} finite numbers, found {line:?}", number + 1, header.len())));
        }
        let mut row = [0.0; 6];
        for (name, value) in header.iter().zip(&values).skip(1) {
            if let Some(k) = NAMES.iter().position(|n| n == name) {
                row[k - 1] = *value;
            }
        }
        if rows.last().is_some_and(|(t, _)| *t >= values[0]) {
            return Err(fail(format!("line {}: time {} does not rise", number + 1, values[0])));
        }
        rows.push((values[0], row));
    }
    if rows.len() < 2 {
        return Err(fail("a table of loads needs at least two rows".into()));
    }
    let bends = if rows.len() <= MOST_ROWS { &rows[..] } else { &[rows[0], rows[rows.len() - 1]][..] };
    let bends = bends.iter().map(|(t, _)| *t).collect();
    let wrench = Arc::new(move |t| {
        let k = rows.partition_point(|(x, _)| *x <= t);
        let between = |k: usize| {
            let ((t0, a), (t1, b)) = (&rows[k - 1], &rows[k]);
            let s = (t - t0) / (t1 - t0);
            let at = |c: usize| a[c] + s * (b[c] - a[c]);
            Wrench::new(Vector3::new(at(0), at(1), at(2)), Vector3::new(at(3), at(4), at(5)))
        };
        match k {
            0 => Wrench::zeros(),
            k if k < rows.len() => between(k),
            k if t == rows[k - 1].0 => between(k - 1),
            _ => Wrench::zeros(),
        }
    });
    Ok((wrench, bends))
}

fn expression(e: &LoadEntry, source: &Source, (start, end): (f64, f64)) -> Result<WrenchFn, Error> {
    let texts = [&e.fx, &e.fy, &e.fz, &e.tx, &e.ty, &e.tz];
    if texts.iter().all(|t| t.is_none()) {
        let message = "kind = \"expression\" needs some of fx, fy, fz, tx, ty, tz as a function of t";
        return Err(source.error(e.kind.span(), message).into());
    }
    let mut parts: Vec<Option<(FlatEx<f64>, bool)>> = Vec::new();
    for text in texts {
        parts.push(match text {
            None => None,
            Some(entry) => {
                let text = entry.get_ref();
                let fail = |message: String| source.error(entry.span(), message);
                if text.len() > LONGEST_EXPRESSION {
                    let length = text.len();
                    let message = format!(
                        "the expression has {length} characters, at most {LONGEST_EXPRESSION} are read, for it is computed in \
                         every step: use kind = \"table\" for curves without a short formula"
                    );
                    return Err(fail(message).into());
                }
                let parsed: FlatEx<f64> =
                    exmex::parse(text).map_err(|error| fail(format!("expression {text:?}: {error}")))?;
                let unknown: Vec<&String> = parsed.var_names().iter().filter(|v| *v != "t").collect();
                if !unknown.is_empty() {
                    let text = format!("expression {text:?} has the variables {unknown:?}; only t (s) is known");
                    return Err(fail(text).into());
                }
                let timed = !parsed.var_names().is_empty();
                // At times at which it acts.
                for t in [start.max(0.0), 0.5 * (start.max(0.0) + end), end] {
                    let probe = parsed.eval(if timed { std::slice::from_ref(&t) } else { &[] });
                    if !probe.is_ok_and(|x: f64| x.is_finite()) {
                        return Err(fail(format!("expression {text:?} is no finite number at t = {t} s")).into());
                    }
                }
                Some((parsed, timed))
            }
        });
    }
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

/// What the entry hangs on its link, about its centre of mass.
fn carried(e: &PayloadChange) -> LinkInertia {
    let [xx, yy, zz, xy, xz, yz] = e.inertia.as_ref().map_or([0.0; 6], |inertia| *inertia.get_ref());
    let inertia_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    LinkInertia { mass: e.mass, com: e.com.into(), inertia_com }
}

fn change(
    entry: &Spanned<PayloadChange>,
    robot: &Robot,
    model: &Model,
    earlier: &[InertiaChange],
    source: &Source,
) -> Result<InertiaChange, RobotFileError> {
    let e = entry.get_ref();
    let span: Range<usize> = entry.span();
    let fail = |message: String| source.error(span.clone(), message);
    let inertia_given = e.inertia.as_ref().map_or([0.0; 6], |inertia| *inertia.get_ref());
    let mut numbers = [e.at, e.mass].into_iter().chain(e.com).chain(inertia_given);
    if numbers.any(|x| !x.is_finite()) || e.mass < 0.0 || e.at < 0.0 {
        return Err(fail("a payload needs a time and a mass of at least 0, and finite numbers".into()));
    }
    let own = model.frame(PAYLOAD_LINK);
    let carrier = robot.rigid.joints.iter().find(|j| j.child == PAYLOAD_LINK).map(|j| j.parent.clone());
    let named = e.link.as_ref().map(|link| link.get_ref().clone());
    let link = named.or(carrier).unwrap_or_else(|| robot.tcp.0.clone());
    let frame = model.frame(&link).filter(|f| f.body > 0).ok_or_else(|| {
        let known = moving_links(model);
        let message = format!("payload link {link:?}: expected a link that moves, of {known:?}");
        source.error(span_or(e.link.as_ref(), entry), message)
    })?;
    if robot.flexible.iter().any(|f| f.flexible.link == link) && model.frame(&format!("{link}__distal")).is_some() {
        let beyond = robot.urdf.mechanism.child_joints(&link).map(|j| j.child.as_str()).collect::<Vec<_>>();
        let message = format!(
            "payload link {link:?} bends, so that it is not clear how the payload rides on it: name a link beyond it, of {beyond:?}"
        );
        return Err(source.error(span_or(e.link.as_ref(), entry), message));
    }
    let added = carried(e);
    if added.inertia_com.symmetric_eigenvalues().min() < -1e-9 * added.inertia_com.norm() {
        let message = "payload inertia has a negative principal moment; the order is ixx iyy izz ixy ixz iyz";
        return Err(source.error(span_or(e.inertia.as_ref(), entry), message));
    }
    // The body as it is without what it carries at the start.
    let mut inertia = model.bodies()[frame.body].inertia;
    let at_start = robot.rigid.link(PAYLOAD_LINK).and_then(|l| l.inertia);
    if let (Some(payload), Some(own)) = (at_start, own) {
        if own.body != frame.body {
            return Err(fail(format!("the robot's own payload does not ride on link {link:?}: give that link")));
        }
        let carried = payload.spatial().at_parent(&own.X_BF);
        inertia = SpatialInertia {
            mass: inertia.mass - carried.mass,
            first_moment: inertia.first_moment - carried.first_moment,
            rotational: inertia.rotational - carried.rotational,
        };
    }
    if let Some(other) = earlier.iter().find(|c| c.body != frame.body) {
        let name = &model.bodies()[other.body].name;
        return Err(fail(format!("payloads on two bodies ({name:?} and {link:?}): one changes in a run")));
    }
    if e.mass > 0.0 {
        let X_BF: Pose = frame.X_BF;
        inertia += added.spatial().at_parent(&X_BF);
    }
    Ok(InertiaChange { t: e.at, body: frame.body, inertia })
}
