//! Positions of targets in the axes of an instrument.

use std::ops::Range;
use std::path::PathBuf;

use crate::estimation::{Reading, ReadingKind, Row};
use serde::Deserialize;
use toml::Spanned;

use super::common::{Joints, LOAD_COLUMNS, LoadEntry, TableRow};
use super::reader::Reader;
use flexarm_run::Error;

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

impl Reader<'_> {
    pub(super) fn place(&mut self, number: usize, entry: &Spanned<PlaceEntry>) -> Result<(), Error> {
        let (e, span) = (entry.get_ref(), entry.span());
        let instrument = self.chosen("instrument", e.instrument.as_ref(), &self.instruments, &span)?;
        let target = self.chosen("target", e.target.as_ref(), &self.targets, &span)?;
        let one = |reader: &mut Self, name, q, load: LoadEntry, value: [Option<f64>; 3], std: Option<Spanned<f64>>| {
            if let Some(bad) = value.iter().flatten().find(|x| !x.is_finite()) {
                return Err(reader.error(span.clone(), format!("{name}: found {bad}, expected finite numbers")));
            }
            let (length, std) = (reader.units.length, reader.std(std.as_ref(), reader.units.length)?);
            let row = |(of, value): (usize, Option<f64>)| Some(Row { of, value: value? * length, std });
            let rows = value.into_iter().enumerate().filter_map(row).collect();
            let kind = ReadingKind::Place { load: reader.load(&load, &span)?, target, instrument, rows };
            reader.measurements.readings.push(Reading { name, q, kind });
            Ok(())
        };
        match (&e.file, &e.joints, e.value) {
            (Some(file), None, None) => {
                let table = match &e.columns {
                    Some(own) => self.table_with(file, own)?,
                    None => self.table(file, &[&LOAD_COLUMNS[..], &COLUMNS].concat())?,
                };
                let [x, y, z] = e.columns.as_ref().map_or(["x", "y", "z"], |own| own.each_ref().map(String::as_str));
                let before = self.measurements.readings.len();
                for row in 0..table.rows.len() {
                    let at = TableRow { table: &table, row };
                    let name = format!("{} line {}", file.get_ref().display(), table.lines[row]);
                    let Some(value) = at.filled([x, y, z]) else {
                        self.empty_rows += 1;
                        continue;
                    };
                    let std = at.get("std").map(|x| Spanned::new(file.span(), x)).or_else(|| e.std.clone());
                    let q = self.table_joints(&at, file.span())?;
                    let load = self.with_columns(e.load, &at, file)?;
                    one(self, name, q, load, value, std)?;
                }
                match self.measurements.readings.len() > before {
                    true => Ok(()),
                    false => {
                        Err(self.error(file.span(), format!("no row of the table has a value of {x}, {y} or {z}")))
                    }
                }
            }
            (None, Some(joints), Some(value)) => {
                let q = self.joints(joints)?;
                one(self, format!("place {}", number + 1), q, e.load, value.map(Some), e.std.clone())
            }
            _ => Err(self.error(span, "a place needs joints = [...] and value = [x, y, z], or file = \"table.csv\"")),
        }
    }

    /// Returns the number of a named instrument or target; without a name, of the only one.
    pub(super) fn chosen(
        &self,
        what: &str,
        given: Option<&Spanned<String>>,
        known: &[String],
        span: &Range<usize>,
    ) -> Result<usize, Error> {
        match given {
            Some(name) => known.iter().position(|k| k == name.get_ref()).ok_or_else(|| {
                let message = format!("there is no [{what}.{}]; the file has {known:?}", name.get_ref());
                self.error(name.span(), message)
            }),
            None if known.len() == 1 => Ok(0),
            None => {
                let help =
                    if known.is_empty() { format!("add [{what}.NAME]") } else { format!("choose one of {known:?}") };
                Err(self
                    .error(span.clone(), format!("a place needs an {what}: {help}").replace("an target", "a target")))
            }
        }
    }
}
