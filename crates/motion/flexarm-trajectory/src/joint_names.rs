//! The rule for names of joints in motion files of all formats: a name close to a joint that the
//! file does not name is an error; other names that the robot does not have are left out.

use flexarm_settings::{Setting, closest};

use crate::problem::list;

/// Names in a motion file that do not fit the robot.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// Name close to that of a joint which the file does not name.
    #[error("{found:?} is not a joint of the robot; did you mean {meant:?}? rename it{}, or remove it", by_column(column.as_deref(), meant))]
    Misspelt {
        /// Name in the file.
        found: String,
        /// Joint of the robot.
        meant: String,
        /// Column of the name, if the file is a table.
        column: Option<String>,
    },
    /// No name is a joint of the robot.
    #[error(
        "none of the names {} is a joint of the robot, which has {}; rename them{}",
        list(found),
        list(joints),
        if *is_table { format!(", or name the columns: {} <joint>=<column>", Setting::Columns) } else { String::new() }
    )]
    NoneKnown {
        /// Names in the file.
        found: Vec<String>,
        /// Joints of the robot.
        joints: Vec<String>,
        /// Whether the file is a table.
        is_table: bool,
    },
}

fn by_column(column: Option<&str>, meant: &str) -> String {
    column
        .map_or_else(String::new, |column| format!(", say which column it is ({} {meant}={column})", Setting::Columns))
}

/// Returns the names of a motion that the robot does not have, in the order of the file.
///
/// * `names`: joints that the motion moves.
/// * `joints`: joints of the robot.
///
/// # Errors
/// [`NameError`] for a misspelt name, and if no name is a joint of the robot.
pub fn foreign_joints(names: &[String], joints: &[&str]) -> Result<Vec<String>, NameError> {
    let is_known = |name: &&String| joints.contains(&name.as_str());
    let foreign: Vec<String> = names.iter().filter(|name| !is_known(name)).cloned().collect();
    let unnamed: Vec<&str> = joints.iter().copied().filter(|joint| names.iter().all(|name| name != joint)).collect();
    if let Some((found, meant)) = misspelt(foreign.iter().map(String::as_str), &unnamed) {
        return Err(NameError::Misspelt { found: found.to_owned(), meant, column: None });
    }
    if foreign.len() == names.len() && !names.is_empty() {
        let joints = joints.iter().map(|joint| (*joint).to_owned()).collect();
        return Err(NameError::NoneKnown { found: foreign, joints, is_table: false });
    }
    Ok(foreign)
}

/// Returns the first foreign name that is close to a joint which the file does not name, and this
/// joint.
pub(crate) fn misspelt<'a>(foreign: impl IntoIterator<Item = &'a str>, unnamed: &[&str]) -> Option<(&'a str, String)> {
    foreign.into_iter().find_map(|name| Some((name, closest(name, unnamed.iter().copied())?)))
}
