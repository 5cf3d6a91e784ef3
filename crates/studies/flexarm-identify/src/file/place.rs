//! Positions of targets in the axes of an instrument: an entry, or the rows of a table.
//!
//! Start at [`Reader::place`]. Values keep the units of the file up to `Reader::add_place`.
//! Not here: instruments and targets themselves (`frame.rs`), displacements (`displacement.rs`).

use std::path::PathBuf;

use flexarm_run::Error;
use flexarm_settings::Place;
use serde::Deserialize;
use toml::Spanned;

use super::common::{Joints, LOAD_COLUMNS, LoadEntry, TableRow};
use super::reader::{Reader, Site, located};
use crate::estimation::{Reading, ReadingKind, Row};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaceEntry {
    file: Option<Spanned<PathBuf>>,
    joints: Option<Spanned<Joints>>,
    instrument: Option<Spanned<String>>,
    target: Option<Spanned<String>>,
    /// Names of the columns of x, y and z; other columns of the table are then ignored.
    columns: Option<[String; 3]>,
    #[serde(default)]
    load: LoadEntry,
    value: Option<[f64; 3]>,
    std: Option<Spanned<f64>>,
}

/// Columns of a table in addition to joints and loads.
const COLUMNS: [&str; 4] = ["x", "y", "z", "std"];

/// Position in the units of the file.
struct FilePosition<'a> {
    name: String,
    site: Site<'a>,
    /// Joint values (rad or m).
    q: Vec<f64>,
    load: LoadEntry,
    value: [Option<f64>; 3],
    std: Option<(f64, Site<'a>)>,
}

impl Reader<'_> {
    /// Adds the positions of an entry.
    ///
    /// * `number`: of the entry, from 0, for its name.
    pub(super) fn place(&mut self, number: usize, entry: &Spanned<PlaceEntry>) -> Result<(), Error> {
        let e = entry.get_ref();
        let instrument =
            self.chosen("instrument", e.instrument.as_ref(), &self.measurements.instrument_names, entry)?;
        let target = self.chosen("target", e.target.as_ref(), &self.targets, entry)?;
        match (&e.file, &e.joints, e.value) {
            (Some(file), None, None) => self.table_of_places(e, file, instrument, target),
            (None, Some(joints), Some(value)) => {
                let name = format!("place {}", number + 1);
                let (q, value, std) = (self.joints(joints)?, value.map(Some), located(&e.std));
                let measured = FilePosition { name, site: entry.into(), q, load: e.load, value, std };
                self.add_place(measured, instrument, target)
            }
            _ => Err(self.error(entry, "a place needs joints = [...] and value = [x, y, z], or file = \"table.csv\"")),
        }
    }

    /// Adds the positions in a table; rows without any coordinate are counted and skipped.
    fn table_of_places(
        &mut self,
        e: &PlaceEntry,
        file: &Spanned<PathBuf>,
        instrument: usize,
        target: usize,
    ) -> Result<(), Error> {
        let table = match &e.columns {
            Some(own) => self.table_with(file, own)?,
            None => self.table(file, &[&LOAD_COLUMNS[..], &COLUMNS].concat())?,
        };
        // With names of its own, the table may have any further columns.
        let [x, y, z] = e.columns.as_ref().map_or(["x", "y", "z"], |own| own.each_ref().map(String::as_str));
        let before = self.measurements.readings.len();
        for row in (0..table.rows.len()).map(|row| TableRow { table: &table, row }) {
            let Some(value) = row.filled([x, y, z]) else {
                self.empty_rows += 1;
                continue;
            };
            let measured = FilePosition {
                name: Place::of_file(file.get_ref().display()).line(table.lines[row.row]).to_string(),
                site: row.site(),
                q: self.table_joints(row)?,
                load: e.load.with_columns(row)?,
                value,
                std: row.std("std").or_else(|| located(&e.std)),
            };
            self.add_place(measured, instrument, target)?;
        }
        // A table in which the instrument saw nothing is a wrong file.
        match self.measurements.readings.len() > before {
            true => Ok(()),
            false => Err(table.error(None, format!("no row has a value of {x}, {y} or {z}")).into()),
        }
    }

    /// Adds one position.
    fn add_place(&mut self, measured: FilePosition<'_>, instrument: usize, target: usize) -> Result<(), Error> {
        let FilePosition { name, site, q, load, value, std } = measured;
        if let Some(bad) = value.iter().flatten().find(|x| !x.is_finite()) {
            return Err(self.error(site, format!("{name}: found {bad}, expected finite numbers")));
        }
        let (length, std) = (self.units.length, self.std(std, self.units.length)?);
        let row = |(of, value): (usize, Option<f64>)| Some(Row { of, value: value? * length, std });
        let rows = value.into_iter().enumerate().filter_map(row).collect();
        let kind = ReadingKind::Place { load: self.load(&load, &site)?, target, instrument, rows };
        self.measurements.readings.push(Reading { name, q, kind });
        Ok(())
    }

    /// Returns the number of a named instrument or target; without a name, of the only one.
    pub(super) fn chosen<'a>(
        &self,
        what: &str,
        given: Option<&Spanned<String>>,
        known: &[String],
        site: impl Into<Site<'a>>,
    ) -> Result<usize, Error> {
        match given {
            Some(name) => known.iter().position(|k| k == name.get_ref()).ok_or_else(|| {
                let message = format!("there is no [{what}.{}]; the file has {known:?}", name.get_ref());
                self.error(name, message)
            }),
            None if known.len() == 1 => Ok(0),
            None => {
                let help =
                    if known.is_empty() { format!("add [{what}.NAME]") } else { format!("choose one of {known:?}") };
                Err(self.error(site, format!("a place needs its {what}: {help}")))
            }
        }
    }
}
