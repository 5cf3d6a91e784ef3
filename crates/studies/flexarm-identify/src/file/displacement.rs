//! Displacements from one load to another: an entry, or the rows of a table.
//!
//! A row of a table replaces what the entry says for all rows. Values are along a direction or along
//! the axes x, y, z of the world or of an instrument; empty cells are not measured.
//!
//! Not here: other kinds of readings, recordings over time (`recording.rs`).

use std::path::{Path, PathBuf};

use flexarm_run::Error;
use flexarm_settings::Place;
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use super::common::{Joints, LOAD_COLUMNS, LoadEntry, TableRow};
use super::reader::{Reader, Site, located};
use crate::estimation::{Component, Reading, ReadingKind, Row};

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

/// Measured displacement: along a direction, or the measured components.
#[derive(Debug, Clone, Copy)]
enum Measured {
    One(f64),
    Three([Option<f64>; 3]),
}

/// Displacement in the units of the file.
struct FileDisplacement<'a> {
    name: String,
    site: Site<'a>,
    /// Joint values (rad or m).
    q: Vec<f64>,
    load: LoadEntry,
    point: [f64; 3],
    value: Option<Measured>,
    direction: Option<([f64; 3], Site<'a>)>,
    rotation: Option<[Option<f64>; 3]>,
    std: Option<(f64, Site<'a>)>,
    std_rotation: Option<(f64, Site<'a>)>,
}

/// Columns of a table in addition to joints and loads.
const COLUMNS: [&str; 15] =
    ["px", "py", "pz", "dx", "dy", "dz", "rx", "ry", "rz", "d", "ux", "uy", "uz", "std", "std_rotation"];

impl Reader<'_> {
    /// Adds the displacements of an entry.
    ///
    /// * `number`: of the entry, from 0, for its name.
    pub(super) fn displacement(&mut self, number: usize, entry: &Spanned<DisplacementEntry>) -> Result<(), Error> {
        let e = entry.get_ref();
        match (&e.file, &e.joints) {
            (Some(file), None) => {
                let table = self.table(file, &[&LOAD_COLUMNS[..], &COLUMNS].concat())?;
                for row in 0..table.rows.len() {
                    let measured = self.in_row(e, file.get_ref(), TableRow { table: &table, row })?;
                    self.add_displacement(e, measured)?;
                }
                Ok(())
            }
            // An entry is one row: the same reading without a table.
            (None, Some(joints)) => {
                let measured = FileDisplacement {
                    name: format!("displacement {}", number + 1),
                    site: entry.into(),
                    q: self.joints(joints)?,
                    load: e.load,
                    point: e.point,
                    value: e.value.as_ref().map(|value| match *value.get_ref() {
                        Value::One(d) => Measured::One(d),
                        Value::Three(d) => Measured::Three(d.map(Some)),
                    }),
                    direction: located(&e.direction),
                    rotation: e.rotation.map(|turn| turn.map(Some)),
                    std: located(&e.std),
                    std_rotation: located(&e.std_rotation),
                };
                self.add_displacement(e, measured)
            }
            _ => Err(self.error(entry, "a displacement needs joints = [...] and value, or file = \"table.csv\"")),
        }
    }

    /// Returns the displacement in a row of a table; the entry gives what the row does not.
    fn in_row<'a>(&self, e: &DisplacementEntry, file: &Path, row: TableRow<'a>) -> Result<FileDisplacement<'a>, Error> {
        let value = match (row.get("d"), row.filled(["dx", "dy", "dz"])) {
            (Some(d), None) => Some(Measured::One(d)),
            (None, three) => three.map(Measured::Three),
            (Some(_), Some(_)) => {
                return Err(self.error(row.site(), "a row has d and dx, dy, dz: keep one of them"));
            }
        };
        // The direction columns count only in rows with a reading along them.
        let direction = if row.get("d").is_some() { row.all(["ux", "uy", "uz"])? } else { None };
        Ok(FileDisplacement {
            name: Place::of_file(file.display()).line(row.table.lines[row.row]).to_string(),
            site: row.site(),
            q: self.table_joints(row)?,
            load: e.load.with_columns(row)?,
            point: row.all(["px", "py", "pz"])?.unwrap_or(e.point),
            value,
            direction: direction.map(|d| (d, row.site())).or_else(|| located(&e.direction)),
            rotation: row.filled(["rx", "ry", "rz"]),
            std: row.std("std").or_else(|| located(&e.std)),
            std_rotation: row.std("std_rotation").or_else(|| located(&e.std_rotation)),
        })
    }

    /// Adds one displacement.
    fn add_displacement(&mut self, e: &DisplacementEntry, measured: FileDisplacement<'_>) -> Result<(), Error> {
        let known = |name| self.chosen("instrument", Some(name), &self.measurements.instrument_names, &measured.site);
        let instrument = e.instrument.as_ref().map(known).transpose()?;
        let mut rows = self.translations(&measured, instrument)?;
        rows.extend(self.rotations(&measured, instrument)?);
        let FileDisplacement { name, site, q, load, point, .. } = measured;
        if let Some(bad) = rows.iter().find(|row| !row.value.is_finite()) {
            return Err(self.error(site, format!("{name}: found {}, expected a finite number", bad.value)));
        }
        let (before, after) = (self.load(&e.before, &site)?, self.load(&load, &site)?);
        if before == after {
            let text = format!("{name}: the loads before and after are equal: there is no displacement");
            return Err(self.error(site, text));
        }
        let point = Vector3::from(point) * self.units.length;
        let kind = ReadingKind::Displacement { before, after, point, rows };
        self.measurements.readings.push(Reading { name, q, kind });
        Ok(())
    }

    /// Returns the measured translations: one along a direction, or the measured components.
    fn translations(
        &self,
        measured: &FileDisplacement<'_>,
        instrument: Option<usize>,
    ) -> Result<Vec<Row<Component>>, Error> {
        let FileDisplacement { name, site, value, direction, rotation, std, .. } = measured;
        let std = self.std(std.clone(), self.units.length)?;
        let row = |d: Vector3<f64>, value: f64| {
            let of = Component { direction: d, instrument, rotation: false };
            Row { of, value: value * self.units.length, std }
        };
        // One number is along its direction; three are along the axes, where a gap is no reading.
        match (*value, direction) {
            (Some(Measured::One(value)), Some((direction, site))) => {
                let d = Vector3::from(*direction);
                let d = d.try_normalize(1e-9).filter(|v| v.iter().all(|x| x.is_finite()));
                Ok(vec![row(d.ok_or_else(|| self.error(site, "direction has zero length"))?, value)])
            }
            (Some(Measured::One(_)), None) => {
                let text = "a single value needs its direction: add direction = [x, y, z] in world axes, or in those \
                            of its instrument";
                Err(self.error(site, text))
            }
            (Some(Measured::Three(_)), Some((_, site))) => {
                Err(self.error(site, "three numbers are components along x, y and z: remove direction"))
            }
            (Some(Measured::Three(d)), None) => {
                Ok(d.into_iter().enumerate().filter_map(|(axis, d)| Some(row(Vector3::ith(axis, 1.0), d?))).collect())
            }
            (None, _) if rotation.is_some() => Ok(Vec::new()),
            (None, _) => Err(self.error(site, format!("{name}: there is no measured value: add value = [dx, dy, dz]"))),
        }
    }

    /// Returns the measured rotations.
    fn rotations(
        &self,
        measured: &FileDisplacement<'_>,
        instrument: Option<usize>,
    ) -> Result<Vec<Row<Component>>, Error> {
        let Some(turn) = measured.rotation else { return Ok(Vec::new()) };
        let std = self.std(measured.std_rotation.clone(), self.units.angle)?;
        let row = |(axis, angle): (usize, Option<f64>)| {
            let of = Component { direction: Vector3::ith(axis, 1.0), instrument, rotation: true };
            Some(Row { of, value: angle? * self.units.angle, std })
        };
        Ok(turn.into_iter().enumerate().filter_map(row).collect())
    }
}
