//! Displacements from one load to another.

use std::ops::Range;
use std::path::PathBuf;

use crate::estimation::{Component, Reading, ReadingKind, Row};
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use super::common::{Joints, LOAD_COLUMNS, LoadEntry, TableRow};
use super::reader::Reader;
use flexarm_run::Error;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DisplacementEntry {
    file: Option<Spanned<PathBuf>>,
    joints: Option<Spanned<Joints>>,
    #[serde(default)]
    load: LoadEntry,
    #[serde(default)]
    before: LoadEntry,
    #[serde(default)]
    point: [f64; 3],
    direction: Option<Spanned<[f64; 3]>>,
    /// Instrument in whose axes directions, values and rotations are given; world axes if absent.
    instrument: Option<Spanned<String>>,
    value: Option<Spanned<Value>>,
    rotation: Option<[f64; 3]>,
    std: Option<Spanned<f64>>,
    std_rotation: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize, Clone, Copy)]
#[serde(untagged, expecting = "expected a number along direction, or a list of three")]
enum Value {
    One(f64),
    Three([f64; 3]),
}

impl Value {
    fn read(self) -> Measured {
        match self {
            Self::One(d) => Measured::One(d),
            Self::Three(d) => Measured::Three(d.map(Some)),
        }
    }
}

/// Measured displacement: along a direction, or the measured components.
#[derive(Debug, Clone, Copy)]
enum Measured {
    One(f64),
    Three([Option<f64>; 3]),
}

/// Displacement in the units of the file.
struct FileDisplacement {
    name: String,
    q: Vec<f64>,
    load: LoadEntry,
    point: [f64; 3],
    value: Option<Measured>,
    direction: Option<Spanned<[f64; 3]>>,
    rotation: Option<[Option<f64>; 3]>,
    std: Option<Spanned<f64>>,
    std_rotation: Option<Spanned<f64>>,
}

/// Columns of a table in addition to joints and loads.
const COLUMNS: [&str; 15] =
    ["px", "py", "pz", "dx", "dy", "dz", "rx", "ry", "rz", "d", "ux", "uy", "uz", "std", "std_rotation"];

/// Axes of the measured components.
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Reader<'_> {
    pub(super) fn displacement(&mut self, number: usize, entry: &Spanned<DisplacementEntry>) -> Result<(), Error> {
        let e = entry.get_ref();
        match (&e.file, &e.joints) {
            (Some(file), None) => {
                let table = self.table(file, &[&LOAD_COLUMNS[..], &COLUMNS].concat())?;
                for row in 0..table.rows.len() {
                    let at = TableRow { table: &table, row };
                    let name = format!("{} line {}", file.get_ref().display(), table.lines[row]);
                    let load = self.with_columns(e.load, &at, file)?;
                    let value = match (at.get("d"), at.filled(["dx", "dy", "dz"])) {
                        (Some(d), None) => Some(Measured::One(d)),
                        (None, three) => three.map(Measured::Three),
                        (Some(_), Some(_)) => {
                            let text = "a row has d and dx, dy, dz: keep one of them";
                            return Err(self.error(file.span(), text));
                        }
                    };
                    let spanned = |x: f64| Spanned::new(file.span(), x);
                    let std = at.get("std").map(spanned).or_else(|| e.std.clone());
                    let std_rotation = at.get("std_rotation").map(spanned).or_else(|| e.std_rotation.clone());
                    let q = self.table_joints(&at, file.span())?;
                    let rotation = at.filled(["rx", "ry", "rz"]);
                    let direction = self.table_direction(&at, file)?.or_else(|| e.direction.clone());
                    let point =
                        at.all(["px", "py", "pz"]).map_err(|cell| self.empty(&at, file, &cell))?.unwrap_or(e.point);
                    let said = FileDisplacement { name, q, load, point, value, direction, rotation, std, std_rotation };
                    self.moved(entry, said)?;
                }
                Ok(())
            }
            (None, Some(joints)) => {
                let said = FileDisplacement {
                    name: format!("displacement {}", number + 1),
                    q: self.joints(joints)?,
                    load: e.load,
                    point: e.point,
                    value: e.value.as_ref().map(|value| value.get_ref().read()),
                    direction: e.direction.clone(),
                    rotation: e.rotation.map(|turn| turn.map(Some)),
                    std: e.std.clone(),
                    std_rotation: e.std_rotation.clone(),
                };
                self.moved(entry, said)
            }
            _ => {
                Err(self.error(entry.span(), "a displacement needs joints = [...] and value, or file = \"table.csv\""))
            }
        }
    }

    /// Adds one displacement.
    fn moved(&mut self, entry: &Spanned<DisplacementEntry>, said: FileDisplacement) -> Result<(), Error> {
        let (e, span) = (entry.get_ref(), entry.span());
        let sigma = self.std(said.std.as_ref(), self.units.length)?;
        let instrument =
            e.instrument.as_ref().map(|name| self.chosen("instrument", Some(name), &self.instruments, &span));
        let instrument = instrument.transpose()?;
        let mut rows = self.translations(&said, instrument, sigma, &span)?;
        rows.extend(self.rotations(&said, instrument)?);
        let FileDisplacement { name, q, load, point, .. } = said;
        if let Some(bad) = rows.iter().find(|row| !row.value.is_finite()) {
            return Err(self.error(span, format!("{name}: found {}, expected a finite number", bad.value)));
        }
        let (before, after) = (self.load(&e.before, &span)?, self.load(&load, &span)?);
        if before == after {
            return Err(
                self.error(span, format!("{name}: the loads before and after are equal: there is no displacement"))
            );
        }
        let point = Vector3::from(point) * self.units.length;
        let kind = ReadingKind::Displacement { before, after, point, rows };
        self.measurements.readings.push(Reading { name, q, kind });
        Ok(())
    }

    /// Returns the measured translations: one along a direction, or the measured components.
    fn translations(
        &self,
        said: &FileDisplacement,
        instrument: Option<usize>,
        std: f64,
        span: &Range<usize>,
    ) -> Result<Vec<Row<Component>>, Error> {
        let row = |d: Vector3<f64>, value: f64| {
            let of = instrument.map_or(Component::Along(d), |k| Component::AlongSeen(k, d));
            Row { of, value: value * self.units.length, std }
        };
        match (said.value, &said.direction) {
            (Some(Measured::One(value)), Some(direction)) => {
                let d = Vector3::from(*direction.get_ref());
                let d = d.try_normalize(1e-9).filter(|v| v.iter().all(|x| x.is_finite()));
                let d = d.ok_or_else(|| self.error(direction.span(), "direction has zero length"))?;
                Ok(vec![row(d, value)])
            }
            (Some(Measured::One(_)), None) => {
                let text = "a single value needs its direction: add direction = [x, y, z] in world axes, or in those \
                            of its instrument";
                Err(self.error(span.clone(), text))
            }
            (Some(Measured::Three(_)), Some(direction)) => {
                let text = "three numbers are components along x, y and z: remove direction";
                Err(self.error(direction.span(), text))
            }
            (Some(Measured::Three(d)), None) => {
                Ok(AXES.into_iter().zip(d).filter_map(|(axis, d)| Some(row(axis.into(), d?))).collect())
            }
            (None, _) if said.rotation.is_some() => Ok(Vec::new()),
            (None, _) => {
                let text = format!("{}: there is no measured value: add value = [dx, dy, dz]", said.name);
                Err(self.error(span.clone(), text))
            }
        }
    }

    /// Returns the measured rotations.
    fn rotations(&self, said: &FileDisplacement, instrument: Option<usize>) -> Result<Vec<Row<Component>>, Error> {
        let Some(turn) = said.rotation else { return Ok(Vec::new()) };
        let std = self.std(said.std_rotation.as_ref(), self.units.angle)?;
        let row = |(axis, angle): ([f64; 3], Option<f64>)| {
            let d = Vector3::from(axis);
            let of = instrument.map_or(Component::About(d), |k| Component::AboutSeen(k, d));
            Some(Row { of, value: angle? * self.units.angle, std })
        };
        Ok(AXES.into_iter().zip(turn).filter_map(row).collect())
    }
}
