//! Entry for a robot file that uses a link file, as text to paste.

use std::path::Path;

/// Returns the entry. Its path is absolute, since the robot file may be anywhere.
///
/// * `link`: name of the link in the robot.
/// * `distal`: joint at the distal interface, if it is known.
pub(crate) fn robot_entry(flex: &Path, link: &str, distal: Option<&str>) -> String {
    // A JSON string is a valid TOML string.
    let quoted = |text: &str| serde_json::to_string(text).expect("text is JSON");
    let path = std::path::absolute(flex).unwrap_or_else(|_| flex.to_owned());
    let distal = match distal {
        Some(joint) => format!("distal = {}", quoted(joint)),
        None => "# distal = \"...\"  the joint at the far end, if several follow the link".to_owned(),
    };
    let reduced = quoted(&path.display().to_string());
    format!("[[flexible_link]]\nlink = {}\n{distal}\nreduced = {reduced}\n", quoted(link))
}
