//! Common parts of all kinds of readings: joint values, loads, deviations, tables.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use crate::estimation::LoadCase;
use flexarm_files::{NumberTable, named_file};
use flexarm_kinematics::{SpatialInertia, Wrench};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::reader::{Reader, Units};
use flexarm_run::Error;

/// Joint values: a list in order, or by name.
#[derive(Debug, Deserialize, Clone)]
#[serde(untagged, expecting = "expected a list of joint values, or a table { joint = value }")]
pub(crate) enum Joints {
    List(Vec<f64>),
    Named(BTreeMap<String, f64>),
}

#[derive(Debug, Default, Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadEntry {
    #[serde(default)]
    force: [f64; 3],
    #[serde(default)]
    torque: [f64; 3],
    #[serde(default)]
    at: [f64; 3],
    #[serde(default)]
    mass: f64,
    #[serde(default)]
    com: [f64; 3],
    /// `ixx iyy izz ixy ixz iyz` about the centre of mass, axes of the tool (kg m²).
    #[serde(default)]
    inertia: [f64; 6],
}

/// Columns of tables that describe loads.
pub(super) const LOAD_COLUMNS: [&str; 19] = [
    "fx", "fy", "fz", "mx", "my", "mz", "ax", "ay", "az", "mass", "cx", "cy", "cz", "ixx", "iyy", "izz", "ixy", "ixz",
    "iyz",
];

/// Row of a table, accessed by column name.
pub(super) struct TableRow<'a> {
    pub(super) table: &'a NumberTable,
    pub(super) row: usize,
}

/// A cell without the number that is needed.
pub(super) struct EmptyCell<'n> {
    pub(super) column: &'n str,
}

impl TableRow<'_> {
    pub(super) fn get(&self, name: &str) -> Option<f64> {
        let value = self.table.rows[self.row][self.table.column(name)?];
        (!value.is_nan()).then_some(value)
    }

    /// Returns components, 0 for those without a column; `None` if none has a column.
    ///
    /// # Errors
    /// [`EmptyCell`] for a column without a value in this row.
    pub(super) fn all<'n, const N: usize>(&self, names: [&'n str; N]) -> Result<Option<[f64; N]>, EmptyCell<'n>> {
        if names.iter().all(|name| self.table.column(name).is_none()) {
            return Ok(None);
        }
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(names) {
            if self.table.column(name).is_some() {
                *value = self.get(name).ok_or(EmptyCell { column: name })?;
            }
        }
        Ok(Some(values))
    }

    /// Returns three components, `None` for empty cells; `None` if all are empty.
    pub(super) fn filled(&self, names: [&str; 3]) -> Option<[Option<f64>; 3]> {
        let values = names.map(|name| self.get(name));
        values.iter().any(Option::is_some).then_some(values)
    }
}

impl Reader<'_> {
    /// Returns the joint values of a reading in SI units.
    pub(crate) fn joints(&self, joints: &Spanned<Joints>) -> Result<Vec<f64>, Error> {
        let known = self.cell.joints;
        let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
        let values: Vec<f64> = match joints.get_ref() {
            Joints::List(list) if list.len() == known.len() => list.clone(),
            Joints::List(list) => {
                let message = format!("{} joint values, the robot has {}: {names:?}", list.len(), known.len());
                return Err(self.error(joints.span(), message));
            }
            Joints::Named(map) => {
                if let Some(stray) = map.keys().find(|name| !names.contains(&name.as_str())) {
                    let message = format!("the robot has no joint {stray:?}; its joints are {names:?}");
                    return Err(self.error(joints.span(), message));
                }
                let value = |name: &&str| {
                    map.get(*name).copied().ok_or_else(|| {
                        self.error(joints.span(), format!("joint {name:?} has no value: all of {names:?} are needed"))
                    })
                };
                names.iter().map(value).collect::<Result<_, _>>()?
            }
        };
        self.scaled(values, joints.span())
    }

    fn scaled(&self, values: Vec<f64>, span: Range<usize>) -> Result<Vec<f64>, Error> {
        let scaled = values.iter().zip(self.cell.joints).map(|(value, (name, slides))| {
            let factor = if *slides { self.units.length } else { self.units.angle };
            let q = value * factor;
            // Values above ten turns are probably degrees read as rad.
            let most = if *slides { 1e3 } else { 20.0 * std::f64::consts::PI };
            match q.is_finite() && q.abs() <= most {
                true => Ok(q),
                false => {
                    let help = if *slides { "length = \"mm\"" } else { "angle = \"deg\"" };
                    let message =
                        format!("joint {name:?} at {value}: outside the range of any joint; is {help} missing?");
                    Err(self.error(span.clone(), message))
                }
            }
        });
        scaled.collect()
    }

    /// Returns a load in SI units.
    pub(crate) fn load(&self, load: &LoadEntry, span: &Range<usize>) -> Result<LoadCase, Error> {
        let LoadEntry { force, torque, at, mass, com, inertia } = *load;
        let all = [&force[..], &torque, &at, &[mass], &com, &inertia].concat();
        if let Some(bad) = all.iter().find(|x| !x.is_finite()) {
            return Err(self.error(span.clone(), format!("a load has the entry {bad}, expected finite numbers")));
        }
        if mass < 0.0 {
            return Err(self.error(span.clone(), format!("a load has a mass of {mass} kg, expected 0 or more")));
        }
        let [xx, yy, zz, xy, xz, yz] = inertia;
        let about_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let moments = about_com.symmetric_eigenvalues();
        let (largest, sum) = (moments.max(), moments.sum());
        if moments.min() < -1e-9 * largest.abs() || largest > (sum - largest) * (1.0 + 1e-6) + 1e-12 {
            let text = format!(
                "a load has the principal moments of inertia {:.4?} kg m2, which are not physical: no moment may be \
                 negative or exceed the sum of the two others",
                moments.as_slice()
            );
            return Err(self.error(span.clone(), text));
        }
        if mass == 0.0 && inertia != [0.0; 6] {
            return Err(self.error(span.clone(), "a load has an inertia and no mass: give both"));
        }
        let Units { length, force: newton, .. } = self.units;
        // Moments are in the product of the units of force and length.
        let wrench = Wrench::new(Vector3::from(force) * newton, Vector3::from(torque) * newton * length);
        let carried = SpatialInertia::from_com(mass, &(Vector3::from(com) * length), &about_com);
        Ok(LoadCase { wrench, at: Vector3::from(at) * length, carried })
    }

    /// Returns a standard deviation in SI units; 0 if none is given.
    pub(crate) fn std(&self, given: Option<&Spanned<f64>>, factor: f64) -> Result<f64, Error> {
        match given {
            None => Ok(0.0),
            Some(std) if std.get_ref().is_finite() && *std.get_ref() > 0.0 => Ok(std.get_ref() * factor),
            Some(std) => Err(self.error(std.span(), format!("std is {}, expected a positive number", std.get_ref()))),
        }
    }

    /// Reads a table of the joints and some of the given columns.
    pub(super) fn table(&self, file: &Spanned<PathBuf>, columns: &[&str]) -> Result<NumberTable, Error> {
        let table = self.table_with(file, &[])?;
        let joints: Vec<&str> = self.cell.joints.iter().map(|(name, _)| name.as_str()).collect();
        match table.names.iter().find(|n| !columns.contains(&n.as_str()) && !joints.contains(&n.as_str())) {
            None => Ok(table),
            Some(stray) => {
                let what =
                    format!("column {stray:?} is not known; expected the joints {joints:?} and some of {columns:?}");
                Err(Error::File { path: self.folder.join(file.get_ref()), what })
            }
        }
    }

    /// Reads a table that has the joints and the given columns.
    pub(super) fn table_with(&self, file: &Spanned<PathBuf>, columns: &[String]) -> Result<NumberTable, Error> {
        let path =
            named_file("file", file.get_ref(), self.folder).map_err(|message| self.error(file.span(), message))?;
        let table = NumberTable::read(&path)?;
        let fail = |what: String| Error::File { path: path.clone(), what };
        if let Some((joint, _)) = self.cell.joints.iter().find(|(joint, _)| table.column(joint).is_none()) {
            return Err(fail(format!("there is no column for joint {joint:?}")));
        }
        if let Some(missing) = columns.iter().find(|name| table.column(name).is_none()) {
            return Err(fail(format!("there is no column {missing:?}; found {:?}", table.names)));
        }
        if table.rows.is_empty() {
            return Err(fail("the table has no rows".into()));
        }
        Ok(table)
    }

    pub(super) fn table_joints(&self, row: &TableRow<'_>, span: Range<usize>) -> Result<Vec<f64>, Error> {
        let value = |(name, _): &(String, bool)| {
            row.get(name).ok_or_else(|| {
                let line = row.table.lines[row.row];
                self.error(span.clone(), format!("line {line} of the table has no value for joint {name:?}"))
            })
        };
        let values = self.cell.joints.iter().map(value).collect::<Result<Vec<f64>, Error>>()?;
        self.scaled(values, span)
    }

    /// Returns the error for an empty cell where a number is required.
    pub(super) fn empty(&self, row: &TableRow<'_>, file: &Spanned<PathBuf>, cell: &EmptyCell<'_>) -> Error {
        let (line, column) = (row.table.lines[row.row], cell.column);
        let text = format!("{} line {line}: {column} is empty, expected a number", file.get_ref().display());
        self.error(file.span(), text)
    }

    /// Returns a load with the values of a table row in place of the given ones.
    pub(super) fn with_columns(
        &self,
        load: LoadEntry,
        row: &TableRow<'_>,
        file: &Spanned<PathBuf>,
    ) -> Result<LoadEntry, Error> {
        let empty = |cell: EmptyCell<'_>| self.empty(row, file, &cell);
        let mass = match row.table.column("mass") {
            None => load.mass,
            Some(_) => row.get("mass").ok_or_else(|| empty(EmptyCell { column: "mass" }))?,
        };
        let force = row.all(["fx", "fy", "fz"]).map_err(empty)?.unwrap_or(load.force);
        let torque = row.all(["mx", "my", "mz"]).map_err(empty)?.unwrap_or(load.torque);
        let at = row.all(["ax", "ay", "az"]).map_err(empty)?.unwrap_or(load.at);
        let com = row.all(["cx", "cy", "cz"]).map_err(empty)?.unwrap_or(load.com);
        let moments = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
        let inertia = row.all(moments).map_err(empty)?.unwrap_or(load.inertia);
        Ok(LoadEntry { force, torque, at, mass, com, inertia })
    }

    /// Returns the direction of the gauge of a row if the row has a gauge reading.
    pub(super) fn table_direction(
        &self,
        row: &TableRow<'_>,
        file: &Spanned<PathBuf>,
    ) -> Result<Option<Spanned<[f64; 3]>>, Error> {
        if row.get("d").is_none() {
            return Ok(None);
        }
        let empty = |cell: EmptyCell<'_>| self.empty(row, file, &cell);
        let direction = row.all(["ux", "uy", "uz"]).map_err(empty)?;
        Ok(direction.map(|direction| Spanned::new(file.span(), direction)))
    }
}
