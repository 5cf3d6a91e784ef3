//! Common parts of all kinds of readings: joint values, loads, deviations, tables.
//!
//! Start at [`Reader::joints`] and [`Reader::load`] for entries, at [`Reader::table`] for tables. Values
//! leave in SI units. An error is reported at its [`Site`]: the entry, or the row of the table.
//! Not here: what each kind of reading measures (the modules beside this one).

use std::collections::BTreeMap;
use std::path::PathBuf;

use flexarm_files::{NumberTable, named_file};
use flexarm_kinematics::{SpatialInertia, Wrench};
use flexarm_run::Error;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::reader::{Reader, Site, Units};
use crate::estimation::LoadCase;

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
#[derive(Clone, Copy)]
pub(super) struct TableRow<'a> {
    pub(super) table: &'a NumberTable,
    pub(super) row: usize,
}

impl<'a> TableRow<'a> {
    pub(super) fn site(self) -> Site<'a> {
        Site::Row(self.table, self.row)
    }

    /// Returns the value of a cell; `None` without the column and for an empty cell.
    pub(super) fn get(self, name: &str) -> Option<f64> {
        let value = self.table.rows[self.row][self.table.column(name)?];
        (!value.is_nan()).then_some(value)
    }

    /// Returns a standard deviation with its place, if the cell has one.
    pub(super) fn std(self, name: &str) -> Option<(f64, Site<'a>)> {
        Some((self.get(name)?, self.site()))
    }

    /// Returns components, 0 for those without a column; `None` if none has a column.
    ///
    /// # Errors
    /// For a column without a value in this row.
    pub(super) fn all<const N: usize>(self, names: [&str; N]) -> Result<Option<[f64; N]>, Error> {
        if names.iter().all(|name| self.table.column(name).is_none()) {
            return Ok(None);
        }
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(names) {
            if self.table.column(name).is_some() {
                let empty = || self.table.error(Some(self.row), format!("{name} is empty, expected a number"));
                *value = self.get(name).ok_or_else(empty)?;
            }
        }
        Ok(Some(values))
    }

    /// Returns three components, `None` for empty cells; `None` if all are empty.
    pub(super) fn filled(self, names: [&str; 3]) -> Option<[Option<f64>; 3]> {
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
                return Err(self.error(joints, message));
            }
            Joints::Named(map) => {
                if let Some(stray) = map.keys().find(|name| !names.contains(&name.as_str())) {
                    let message = format!("the robot has no joint {stray:?}; its joints are {names:?}");
                    return Err(self.error(joints, message));
                }
                let value = |name: &&str| {
                    map.get(*name).copied().ok_or_else(|| {
                        self.error(joints, format!("joint {name:?} has no value: all of {names:?} are needed"))
                    })
                };
                names.iter().map(value).collect::<Result<_, _>>()?
            }
        };
        self.scaled(&values, &joints.into())
    }

    /// Returns joint values in SI units.
    ///
    /// # Errors
    /// For a value that no joint reaches: the unit is probably another one.
    fn scaled(&self, values: &[f64], site: &Site<'_>) -> Result<Vec<f64>, Error> {
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
                    Err(self.error(site, message))
                }
            }
        });
        scaled.collect()
    }

    /// Returns a load in SI units.
    ///
    /// # Errors
    /// For an entry that is not finite, a negative mass, and an inertia that no body has.
    pub(crate) fn load(&self, load: &LoadEntry, site: &Site<'_>) -> Result<LoadCase, Error> {
        let LoadEntry { force, torque, at, mass, com, inertia } = *load;
        let all = [&force[..], &torque, &at, &[mass], &com, &inertia].concat();
        if let Some(bad) = all.iter().find(|x| !x.is_finite()) {
            return Err(self.error(site, format!("a load has the entry {bad}, expected finite numbers")));
        }
        if mass < 0.0 {
            return Err(self.error(site, format!("a load has a mass of {mass} kg, expected 0 or more")));
        }
        let [xx, yy, zz, xy, xz, yz] = inertia;
        let about_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        // Principal moments of a body are not negative and obey the triangle inequality.
        let moments = about_com.symmetric_eigenvalues();
        let (largest, sum) = (moments.max(), moments.sum());
        if moments.min() < -1e-9 * largest.abs() || largest > (sum - largest) * (1.0 + 1e-6) + 1e-12 {
            let text = format!(
                "a load has the principal moments of inertia {:.4?} kg m2, which are not physical: no moment may be \
                 negative or exceed the sum of the two others",
                moments.as_slice()
            );
            return Err(self.error(site, text));
        }
        if mass == 0.0 && inertia != [0.0; 6] {
            return Err(self.error(site, "a load has an inertia and no mass: give both"));
        }
        let Units { length, force: newton, .. } = self.units;
        // Moments are in the product of the units of force and length.
        let wrench = Wrench::new(Vector3::from(force) * newton, Vector3::from(torque) * newton * length);
        let carried = SpatialInertia::from_com(mass, &(Vector3::from(com) * length), &about_com);
        Ok(LoadCase { wrench, at: Vector3::from(at) * length, carried })
    }

    /// Returns a standard deviation in SI units; 0 if none is given.
    ///
    /// * `factor`: unit of the file in SI units.
    pub(crate) fn std(&self, given: Option<(f64, Site<'_>)>, factor: f64) -> Result<f64, Error> {
        match given {
            None => Ok(0.0),
            Some((std, _)) if std.is_finite() && std > 0.0 => Ok(std * factor),
            Some((std, site)) => Err(self.error(site, format!("std is {std}, expected a positive number"))),
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
                Err(table.error(None, what).into())
            }
        }
    }

    /// Reads a table that has the joints and the given columns.
    pub(super) fn table_with(&self, file: &Spanned<PathBuf>, columns: &[String]) -> Result<NumberTable, Error> {
        let path = named_file("file", file.get_ref(), self.folder).map_err(|message| self.error(file, message))?;
        let table = NumberTable::read(&path)?;
        if let Some((joint, _)) = self.cell.joints.iter().find(|(joint, _)| table.column(joint).is_none()) {
            return Err(table.error(None, format!("there is no column for joint {joint:?}")).into());
        }
        if let Some(missing) = columns.iter().find(|name| table.column(name).is_none()) {
            return Err(table.error(None, format!("there is no column {missing:?}; found {:?}", table.names)).into());
        }
        if table.rows.is_empty() {
            return Err(table.error(None, "the table has no rows").into());
        }
        Ok(table)
    }

    /// Returns the joint values of a row in SI units.
    pub(super) fn table_joints(&self, row: TableRow<'_>) -> Result<Vec<f64>, Error> {
        let value = |(name, _): &(String, bool)| {
            row.get(name).ok_or_else(|| self.error(row.site(), format!("joint {name:?} has no value")))
        };
        let values = self.cell.joints.iter().map(value).collect::<Result<Vec<f64>, Error>>()?;
        self.scaled(&values, &row.site())
    }
}

impl LoadEntry {
    /// Returns the load with the values of a table row in place of its own.
    pub(super) fn with_columns(self, row: TableRow<'_>) -> Result<Self, Error> {
        Ok(Self {
            force: row.all(["fx", "fy", "fz"])?.unwrap_or(self.force),
            torque: row.all(["mx", "my", "mz"])?.unwrap_or(self.torque),
            at: row.all(["ax", "ay", "az"])?.unwrap_or(self.at),
            mass: row.all(["mass"])?.map_or(self.mass, |[mass]| mass),
            com: row.all(["cx", "cy", "cz"])?.unwrap_or(self.com),
            inertia: row.all(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"])?.unwrap_or(self.inertia),
        })
    }
}
