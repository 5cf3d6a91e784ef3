//! The rule for names of joints in motion files of all formats: a name close to a joint that the
//! file does not name is an error; other names that the robot does not have are left out.

use flexarm_settings::closest;

use crate::error::list;

/// Text about a name close to that of a joint which the file does not name; `or` is another remedy.
pub(crate) fn misspelt_text(found: &str, meant: &str, or: &str) -> String {
    format!("{found:?} is not a joint of the robot; did you mean {meant:?}? rename it{or}, or remove it")
}

/// Text about names of which none is a joint of the robot; `or` is another remedy.
pub(crate) fn none_known_text(found: &[String], joints: &[&str], or: &str) -> String {
    let joints: Vec<String> = joints.iter().map(|joint| (*joint).to_owned()).collect();
    let (found, joints) = (list(found), list(&joints));
    format!("none of the names {found} is a joint of the robot, which has {joints}; rename them{or}")
}

/// Returns the names of a motion that the robot does not have, in the order of the file.
///
/// * `names`: joints that the motion moves.
/// * `joints`: joints of the robot.
///
/// # Errors
/// A sentence with the remedy for a misspelt name, and if no name is a joint of the robot.
pub fn foreign_joints(names: &[String], joints: &[&str]) -> Result<Vec<String>, String> {
    let is_known = |name: &&String| joints.contains(&name.as_str());
    let foreign: Vec<String> = names.iter().filter(|name| !is_known(name)).cloned().collect();
    let unnamed: Vec<&str> = joints.iter().copied().filter(|joint| names.iter().all(|name| name != joint)).collect();
    if let Some((found, meant)) = misspelt(foreign.iter().map(String::as_str), &unnamed) {
        return Err(misspelt_text(found, &meant, ""));
    }
    if foreign.len() == names.len() && !names.is_empty() {
        return Err(none_known_text(&foreign, joints, ""));
    }
    Ok(foreign)
}

/// Returns the first foreign name that is close to a joint which the file does not name, and this
/// joint.
pub(crate) fn misspelt<'a>(foreign: impl IntoIterator<Item = &'a str>, unnamed: &[&str]) -> Option<(&'a str, String)> {
    foreign.into_iter().find_map(|name| Some((name, closest(name, unnamed.iter().copied())?)))
}
