//! Frequency responses and mode shapes in a file of measurements: points of the arm, tables and
//! universal files, units.
//!
//! Start at [`Reader::response`] and [`Reader::shape`]. A response is first a [`Curve`] with the names
//! of its nodes, then resolved to points of the arm. Not here: universal files ([`super::uff`]).

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use flexarm_files::{NumberTable, TextFileError, named_file};
use flexarm_kinematics::{Data, Frame, Pose, forward_kinematics};
use flexarm_run::Error;
use flexarm_run::toml_file::word;
use flexarm_settings::Place;
use nalgebra::{Complex, DVector, Rotation3, Translation3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::file::{Joints, LoadEntry, Reader, Site, located};
use super::uff::{UffFunction, read_functions};
use crate::estimation::{Answer, Form, MeasuredResponse, MeasuredShape, Probe, Reading, ReadingKind};

/// Maximum size of a universal file (bytes).
const LARGEST: u64 = 1 << 30;
/// Maximum number of points of one response.
const MAX_POINTS: usize = 20_000;
/// Standard gravity, the unit `g` of accelerometers (m/s²).
const GRAVITY: f64 = 9.80665;

/// Point of the arm.
#[derive(Debug, Deserialize, Clone)]
#[serde(deny_unknown_fields)]
pub(super) struct NodeEntry {
    /// Name of a link; the tool if absent.
    link: Option<Spanned<String>>,
    #[serde(default)]
    xyz: [f64; 3],
    /// Axes of its directions: world or frame.
    axes: Option<Spanned<String>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ResponseEntry {
    file: Spanned<PathBuf>,
    joints: Spanned<Joints>,
    #[serde(default)]
    load: LoadEntry,
    /// Nodes and directions; only for tables.
    watched: Option<Spanned<String>>,
    watched_direction: Option<Spanned<Direction>>,
    hit: Option<Spanned<String>>,
    hit_direction: Option<Spanned<Direction>>,
    unit: Option<Spanned<String>>,
    form: Option<Spanned<String>>,
    from: Option<Spanned<f64>>,
    to: Option<Spanned<f64>>,
    every: Option<Spanned<usize>>,
    std: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShapeEntry {
    joints: Spanned<Joints>,
    #[serde(default)]
    load: LoadEntry,
    nodes: Spanned<Vec<String>>,
    directions: Spanned<Vec<Direction>>,
    amplitudes: Spanned<Vec<f64>>,
    std: Option<Spanned<f64>>,
}

/// Direction: `x`, `-y`, or three numbers.
#[derive(Debug, Deserialize, Clone)]
#[serde(untagged, expecting = "expected \"x\", \"-y\" and so on, or a list of three numbers")]
enum Direction {
    Word(String),
    Vector([f64; 3]),
}

/// Message about a direction that is none.
const NO_DIRECTION: &str = "expected a direction: \"x\", \"-y\" and so on, or three numbers that are not all zero";

impl Direction {
    fn vector(&self) -> Option<Vector3<f64>> {
        let v = match self {
            Self::Vector(v) => Vector3::from(*v),
            Self::Word(word) => {
                let (sign, axis) = match word.trim().strip_prefix('-') {
                    Some(axis) => (-1.0, axis),
                    None => (1.0, word.trim().trim_start_matches('+')),
                };
                let k = ["x", "y", "z"].iter().position(|known| axis.eq_ignore_ascii_case(known))?;
                Vector3::ith(k, sign)
            }
        };
        v.try_normalize(1e-9).filter(|v| v.iter().all(|x| x.is_finite()))
    }
}

/// Units by name: measured quantity and factor to SI units.
const UNITS: [(&str, (Answer, f64)); 11] = [
    ("m/N", (Answer::Receptance, 1.0)),
    ("mm/N", (Answer::Receptance, 1e-3)),
    ("um/N", (Answer::Receptance, 1e-6)),
    ("m/s/N", (Answer::Mobility, 1.0)),
    ("mm/s/N", (Answer::Mobility, 1e-3)),
    ("m/s2/N", (Answer::Accelerance, 1.0)),
    ("mm/s2/N", (Answer::Accelerance, 1e-3)),
    ("g/N", (Answer::Accelerance, GRAVITY)),
    ("m/s^2/N", (Answer::Accelerance, 1.0)),
    ("mm/s^2/N", (Answer::Accelerance, 1e-3)),
    ("mm/kN", (Answer::Receptance, 1e-6)),
];

/// Frequency (Hz), value in SI units, and its standard deviation if the file has one.
type Point = (f64, Complex<f64>, Option<f64>);

/// A response whose nodes are not resolved yet.
struct Curve {
    name: String,
    watched: (Option<String>, Vector3<f64>),
    hit: (Option<String>, Vector3<f64>),
    answer: Answer,
    values: Vec<Point>,
}

impl Reader<'_> {
    /// Reads the responses of one file at a pose.
    pub(super) fn response(
        &mut self,
        nodes: &BTreeMap<String, Spanned<NodeEntry>>,
        entry: &Spanned<ResponseEntry>,
    ) -> Result<(), Error> {
        let (e, site) = (entry.get_ref(), Site::from(entry));
        let path = named_file("file", e.file.get_ref(), self.folder).map_err(|message| self.error(&e.file, message))?;
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let curves = match ending.as_str() {
            "uff" | "unv" | "ufb" | "bunv" => self.universal(&path, e)?,
            _ => vec![self.curve(&path, e)?],
        };
        let form = word(self.source, "form", &e.form, &[("log", Form::Logarithmic), ("complex", Form::Complex)])?.1;
        // All curves of the file at one pose, each with its points and nodes.
        let (q, load) = (self.joints(&e.joints)?, self.load(&e.load, &site)?);
        let own = self.std(located(&e.std), 1.0)?;
        for curve in curves {
            let kept = self.kept(&curve, e)?;
            let columns = kept.iter().all(|(.., std)| std.is_some());
            if e.std.is_some() && columns {
                let text = format!("{}: std is given both in the table and here: remove one of them", curve.name);
                return Err(self.error(&site, text));
            }
            let point = |(hz, value, std): &Point| {
                let std = std.unwrap_or(own);
                (TAU * hz, *value, [std, std])
            };
            let kind = ReadingKind::Response(MeasuredResponse {
                load: load.clone(),
                watched: self.probe(nodes, &curve.watched, &q, &site)?,
                hit: self.probe(nodes, &curve.hit, &q, &site)?,
                answer: curve.answer,
                form,
                points: kept.iter().map(point).collect(),
            });
            self.measurements.readings.push(Reading { name: curve.name, q: q.clone(), kind });
        }
        Ok(())
    }

    /// Returns the points within the requested range.
    fn kept(&self, curve: &Curve, e: &ResponseEntry) -> Result<Vec<Point>, Error> {
        let bound = |given: &Option<Spanned<f64>>, otherwise: f64| given.as_ref().map_or(otherwise, |x| *x.get_ref());
        let (from, to) = (bound(&e.from, 0.0), bound(&e.to, f64::INFINITY));
        let every = e.every.as_ref().map_or(1, |n| *n.get_ref()).max(1);
        // At 0 Hz there is no acceleration, and the logarithm needs a value above zero.
        let counts = |(hz, value, _): &&Point| *hz > 0.0 && *hz >= from && *hz <= to && value.norm() > 0.0;
        let kept: Vec<_> = curve.values.iter().filter(counts).step_by(every).copied().collect();
        match kept.len() {
            0 => Err(self
                .error(&e.file, format!("{}: no nonzero value from {from} to {to} Hz: check from and to", curve.name))),
            n if n > MAX_POINTS => Err(self.error(
                &e.file,
                format!("{}: {n} frequencies, the maximum is {MAX_POINTS}: use from, to and every", curve.name),
            )),
            _ => Ok(kept),
        }
    }

    /// Reads a response from a table.
    fn curve(&self, path: &Path, e: &ResponseEntry) -> Result<Curve, Error> {
        let table = NumberTable::read(path)?;
        let known = ["hz", "re", "im", "magnitude", "phase", "std"];
        if let Some(stray) = table.names.iter().find(|name| !known.contains(&name.as_str())) {
            let text = format!("column {stray:?} is not known; expected hz, re and im or magnitude and phase, and std");
            return Err(table.error(None, text).into());
        }
        // Columns, and the unit of the values.
        let column = |name: &str| table.column(name);
        let hz = column("hz").ok_or_else(|| table.error(None, "there is no column hz"))?;
        let pair = match (column("re"), column("im"), column("magnitude"), column("phase")) {
            (Some(re), Some(im), None, None) => (re, im, false),
            (None, None, Some(size), Some(phase)) => (size, phase, true),
            _ => return Err(table.error(None, "expected the columns re and im, or magnitude and phase").into()),
        };
        if e.unit.is_none() {
            let text = "a table needs the unit of the measured quantity per force, such as unit = \"m/s2/N\"";
            return Err(self.error(&e.file, text));
        }
        let (answer, factor) = word(self.source, "unit", &e.unit, &UNITS)?.1;
        let mut values = Vec::with_capacity(table.rows.len());
        for (number, row) in table.rows.iter().enumerate() {
            let (f, a, b) = (row[hz], row[pair.0], row[pair.1]);
            let std = column("std").map(|k| row[k]);
            let bad = |x: f64| !x.is_finite();
            if bad(f) || bad(a) || bad(b) || f < 0.0 || std.is_some_and(|std| bad(std) || std <= 0.0) {
                return Err(table.error(Some(number), "expected finite numbers, hz >= 0 and std > 0").into());
            }
            let value = if pair.2 { Complex::from_polar(a, b * self.units.angle) } else { Complex::new(a, b) };
            values.push((f, value * factor, std));
        }
        // A table names one pair of points.
        let probe_of = |node: &Option<Spanned<String>>, direction: &Option<Spanned<Direction>>, what: &str| {
            let Some(direction) = direction else {
                return Err(self.error(&e.file, format!("a table needs a direction, such as {what}_direction = \"x\"")));
            };
            let vector = direction.get_ref().vector().ok_or_else(|| self.error(direction, NO_DIRECTION))?;
            Ok((node.as_ref().map(|node| node.get_ref().clone()), vector))
        };
        Ok(Curve {
            name: e.file.get_ref().display().to_string(),
            watched: probe_of(&e.watched, &e.watched_direction, "watched")?,
            hit: probe_of(&e.hit, &e.hit_direction, "hit")?,
            answer,
            values,
        })
    }

    /// Reads the responses of a universal file.
    fn universal(&self, path: &Path, e: &ResponseEntry) -> Result<Vec<Curve>, Error> {
        let fail = |what: String| Error::File { path: path.to_owned(), what };
        let size = path.metadata().map_or(0, |there| there.len());
        if size > LARGEST {
            return Err(fail(format!("the file has {size} bytes, the maximum is {LARGEST}")));
        }
        let bytes = std::fs::read(path).map_err(|error| fail(error.to_string()))?;
        let given = [&e.watched, &e.hit].into_iter().flatten().next();
        if let Some(node) = given {
            return Err(self.error(node, "a universal file contains nodes and directions: remove them here"));
        }
        // Each function names its pair of points by node numbers.
        let functions = read_functions(path, &bytes)?;
        let one = |function: &UffFunction| {
            let name = Place::of_file(e.file.get_ref().display()).line(function.line).to_string();
            let (answer, factor) = match &e.unit {
                Some(_) => word(self.source, "unit", &e.unit, &UNITS)?.1,
                None => unit_of(function).ok_or_else(|| {
                    let what = &function.unit;
                    self.error(
                        &e.file,
                        format!(
                            "{name}: the file does not define the measured quantity (label {what:?}): add its unit, \
                             such as unit = \"m/s2/N\""
                        ),
                    )
                })?,
            };
            let direction = |code: i64| match code {
                1..=3 => Ok(Vector3::ith(code as usize - 1, 1.0)),
                -3..=-1 => Ok(Vector3::ith(code.unsigned_abs() as usize - 1, -1.0)),
                _ => Err(TextFileError {
                    path: path.to_owned(),
                    line: function.line,
                    column: 1,
                    message: format!("direction {code}: expected 1 to 3 or -1 to -3 for x, y, z"),
                    page: "measurements",
                }),
            };
            let place = |(node, code): (i64, i64)| Ok::<_, Error>((Some(node.to_string()), direction(code)?));
            Ok(Curve {
                name,
                watched: place(function.response)?,
                hit: place(function.reference)?,
                answer,
                values: function.values.iter().map(|(hz, value)| (*hz, value * factor, None)).collect(),
            })
        };
        functions.iter().map(one).collect()
    }

    /// Reads a mode shape.
    pub(super) fn shape(
        &mut self,
        nodes: &BTreeMap<String, Spanned<NodeEntry>>,
        number: usize,
        entry: &Spanned<ShapeEntry>,
    ) -> Result<(), Error> {
        let (e, site) = (entry.get_ref(), Site::from(entry));
        let (names, directions, amplitudes) = (e.nodes.get_ref(), e.directions.get_ref(), e.amplitudes.get_ref());
        if names.len() != directions.len() || names.len() != amplitudes.len() || names.len() < 2 {
            let (a, b, c) = (names.len(), directions.len(), amplitudes.len());
            let text = format!("{a} nodes, {b} directions, {c} amplitudes: expected equal numbers of at least two");
            return Err(self.error(site, text));
        }
        // The scale of the amplitudes is arbitrary, so only their direction counts.
        let amplitudes = DVector::from_column_slice(amplitudes);
        if !(amplitudes.norm().is_finite() && amplitudes.norm() > 0.0) {
            return Err(self.error(&e.amplitudes, "amplitudes: expected finite numbers that are not all zero"));
        }
        let q = self.joints(&e.joints)?;
        let probe = |(name, direction): (&String, &Direction)| {
            let vector = direction.vector().ok_or_else(|| self.error(&e.directions, NO_DIRECTION))?;
            self.probe(nodes, &(Some(name.clone()), vector), &q, &site)
        };
        let probes = names.iter().zip(directions).map(probe).collect::<Result<Vec<Probe>, Error>>()?;
        let (std, load) = (self.std(located(&e.std), 1.0)?, self.load(&e.load, &site)?);
        let kind = ReadingKind::Shape(MeasuredShape { load, probes, amplitudes, std });
        self.measurements.readings.push(Reading { name: format!("shape {}", number + 1), q, kind });
        Ok(())
    }

    /// Returns a point of the arm and a direction in world axes at the pose.
    fn probe(
        &self,
        nodes: &BTreeMap<String, Spanned<NodeEntry>>,
        (name, direction): &(Option<String>, Vector3<f64>),
        q: &[f64],
        site: &Site<'_>,
    ) -> Result<Probe, Error> {
        // Point: the tool, or a node on a link.
        let arm = self.cell.arm;
        let tool = || arm.tcp.clone();
        let Some(name) = name else { return Ok(Probe { frame: tool(), direction: *direction }) };
        let node = nodes.get(name).ok_or_else(|| {
            let known: Vec<&String> = nodes.keys().collect();
            self.error(site, format!("there is no [node.{name}]; the file has {known:?}: add it with link and xyz"))
        })?;
        let NodeEntry { link, xyz, axes } = node.get_ref();
        let frame = match link {
            None => tool(),
            Some(link) => self.moving_link(link)?,
        };
        if xyz.iter().any(|x| !x.is_finite()) {
            return Err(self.error(node, "xyz: expected finite numbers"));
        }
        let at = Translation3::from(Vector3::from(*xyz) * self.units.length);
        let frame = Frame { X_BF: frame.X_BF * Pose::from_parts(at, Rotation3::identity()), ..frame };
        // Direction: in world axes, or in those of the frame at the pose.
        let mut direction = *direction;
        if word(self.source, "axes", axes, &[("world", false), ("frame", true)])?.1 {
            let mut all = DVector::zeros(arm.model.nv());
            all.rows_mut(0, q.len()).copy_from_slice(q);
            let mut data = Data::new(&arm.model);
            forward_kinematics(&arm.model, &mut data, &all);
            direction = data.X_WF(&frame).rotation * direction;
        }
        Ok(Probe { frame, direction })
    }
}

/// Returns the unit of a function of a universal file: from its label, otherwise from the file's
/// units and its kind.
fn unit_of(function: &UffFunction) -> Option<(Answer, f64)> {
    let label = function.unit.replace([' ', '^'], "").to_lowercase();
    let label = label.split("/n").next().unwrap_or_default();
    let answer = match function.ordinate {
        8 => Answer::Receptance,
        11 => Answer::Mobility,
        12 => Answer::Accelerance,
        _ => return None,
    };
    let known = match (label, answer) {
        ("m", Answer::Receptance) | ("m/s", Answer::Mobility) | ("m/s2", Answer::Accelerance) => Some(1.0),
        ("mm", Answer::Receptance) | ("mm/s", Answer::Mobility) | ("mm/s2", Answer::Accelerance) => Some(1e-3),
        ("g", Answer::Accelerance) => Some(GRAVITY),
        _ => None,
    };
    known.or(function.per_si.map(|[length, force]| force / length)).map(|factor| (answer, factor))
}
