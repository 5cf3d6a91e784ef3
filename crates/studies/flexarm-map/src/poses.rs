//! Lists of poses read from a file.
//!
//! Start at [`read_poses`]. A table names its columns after joints, a TOML file lists values.

use std::path::Path;

use flexarm_files::{NumberTable, read_text};
use flexarm_kinematics::Model;
use flexarm_settings::Quantity;
use serde::Deserialize;
use toml::Spanned;

use super::MapError;
use super::checked_region::Region;
use super::region::MAX_PLACES;
use flexarm_run::inspect::joint_values;
use flexarm_run::robot_file::Source;
use flexarm_run::toml_file::{parsed, word};
use flexarm_run::{Error, Finding, Robot};

/// Message about a list without a pose.
const NO_POSE: &str = "there is no pose: expected a row of joint values";

/// A list of poses as written in TOML.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PosesFile {
    format: Spanned<i64>,
    /// Unit of angles: rad or deg.
    angles: Option<Spanned<String>>,
    /// Names of the columns; default: all actuated joints in coordinate order.
    joints: Option<Spanned<Vec<String>>>,
    poses: Vec<Spanned<Vec<f64>>>,
}

/// Reads poses from a file: all actuated joints in coordinate order (rad or m), pose after pose.
///
/// A table has a column for each joint, with its name, or the name with a unit (`_rad`, `_m`,
/// `_deg`). A `.toml` file has `format = 1`, `poses = [[...], ...]`, and optionally
/// `joints = [...]` and `angles = "deg"`.
///
/// * `at`: positions of joints that the file does not name; default zero.
///
/// # Errors
/// [`Error::RobotFile`] or [`Error::File`] with the location of the error.
pub fn read_poses(path: impl AsRef<Path>, robot: &Robot, at: Option<&[f64]>) -> Result<Vec<Vec<f64>>, Error> {
    let (path, model) = (path.as_ref(), robot.rigid_model()?);
    let actuated = &model.coordinates()[..model.n_actuated()];
    let joints: Vec<(&str, bool)> = actuated.iter().map(|c| (c.joint.as_str(), c.slides())).collect();
    let names: Vec<&str> = joints.iter().map(|(name, _)| *name).collect();
    let home = joint_values(at, &names)?;
    let list = List { joints: &joints, home };
    match path.extension().is_some_and(|end| end == "toml") {
        true => list.of_toml(path),
        false => list.of_table(path),
    }
}

/// Data of the robot needed to read a list.
struct List<'a> {
    /// Names, and whether they are prismatic.
    joints: &'a [(&'a str, bool)],
    home: Vec<f64>,
}

impl List<'_> {
    fn of_table(&self, path: &Path) -> Result<Vec<Vec<f64>>, Error> {
        let table = NumberTable::read(path)?;
        let columns = table.names.iter().map(|name| self.column(name)).collect::<Result<Vec<_>, _>>();
        let columns = columns.map_err(|message| table.error(None, message))?;
        if table.rows.is_empty() {
            return Err(table.error(None, NO_POSE).into());
        }
        let pose = |(k, row): (usize, &Vec<f64>)| {
            self.pose(row, &columns).map_err(|message| table.error(Some(k), message).into())
        };
        table.rows.iter().enumerate().map(pose).collect()
    }

    fn of_toml(&self, path: &Path) -> Result<Vec<Vec<f64>>, Error> {
        let text = read_text(path)?;
        let source = Source::new(path, &text, "map");
        let file: PosesFile = parsed(&text, &source, &[], |file: &PosesFile| &file.format)?;
        let degrees = word(&source, "angles", &file.angles, &[("rad", false), ("deg", true)])?.1;
        let mut columns = match &file.joints {
            None => (0..self.joints.len()).map(|k| (k, 1.0)).collect(),
            Some(names) => {
                let columns = names.get_ref().iter().map(|name| self.column(name)).collect::<Result<Vec<_>, _>>();
                columns.map_err(|message| source.error(names.span(), message))?
            }
        };
        for (_, factor) in columns.iter_mut().filter(|(k, _)| degrees && !self.joints[*k].1) {
            *factor = 1.0_f64.to_radians();
        }
        if file.poses.is_empty() {
            return Err(source.error(0..0, NO_POSE).into());
        }
        let pose = |row: &Spanned<Vec<f64>>| {
            self.pose(row.get_ref(), &columns).map_err(|message| source.error(row.span(), message).into())
        };
        file.poses.iter().map(pose).collect()
    }

    /// Returns the index of the joint of a column, and the factor from its unit to rad or m.
    fn column(&self, name: &str) -> Result<(usize, f64), String> {
        let joint = |(k, (joint, slides)): (usize, &(&str, bool))| match (name.strip_prefix(joint)?, slides) {
            ("", _) | ("_rad", false) | ("_m", true) => Some((k, 1.0)),
            ("_deg", false) => Some((k, 1.0_f64.to_radians())),
            _ => None,
        };
        let unknown = || {
            let known: Vec<&str> = self.joints.iter().map(|(name, _)| *name).collect();
            format!(
                "column {name:?} is not a joint of the robot; its joints are {known:?}; append _deg to the name for degrees"
            )
        };
        self.joints.iter().enumerate().find_map(joint).ok_or_else(unknown)
    }

    fn pose(&self, row: &[f64], columns: &[(usize, f64)]) -> Result<Vec<f64>, String> {
        if row.len() != columns.len() {
            return Err(format!("a pose has {} values, expected {}", row.len(), columns.len()));
        }
        let mut pose = self.home.clone();
        for (value, (k, unit)) in row.iter().zip(columns) {
            let name = format!("joint {:?}", self.joints[*k].0);
            pose[*k] = Quantity::JOINT.check(&name, unit * value).map_err(|error| error.to_string())?;
        }
        Ok(pose)
    }
}

/// Checks the poses and returns them as a region.
pub(super) fn region<'m>(poses: &'m [Vec<f64>], model: &Model) -> Result<(Region<'m>, Vec<Finding>), Error> {
    let actuated = &model.coordinates()[..model.n_actuated()];
    let names: Vec<&str> = actuated.iter().map(|c| c.joint.as_str()).collect();
    if !(1..=MAX_PLACES).contains(&poses.len()) {
        let message = format!("the list has {found} poses, expected one to {MAX_PLACES}", found = poses.len());
        return Err(MapError::Input(message).into());
    }
    let mut caveats = Vec::new();
    for (k, c) in actuated.iter().enumerate() {
        let outside = |pose: &&Vec<f64>| pose.get(k).is_some_and(|q| *q < c.limits.lower || *q > c.limits.upper);
        let count = poses.iter().filter(outside).count();
        if count > 0 {
            let (lower, upper) = (c.limits.lower, c.limits.upper);
            let message = format!("{count} poses have joint {:?} beyond its limits {lower} to {upper}", c.joint);
            caveats.push(Finding::warning("outside-limits", &c.joint, message, "check the units of the list"));
        }
    }
    for pose in poses {
        joint_values(Some(pose), &names)?;
    }
    let values = move |k: usize, q: &mut Vec<f64>| q.extend_from_slice(&poses[k]);
    Ok((Region::Poses(poses.len(), Box::new(values)), caveats))
}
