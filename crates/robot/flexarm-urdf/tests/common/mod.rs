//! Small robots and a temporary folder, shared by the tests.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use flexarm_settings::Finding;
use flexarm_urdf::{ReadOptions, parse_urdf};

/// A temporary folder that is removed at the end.
pub(crate) struct TestFolder(pub(crate) PathBuf);

impl TestFolder {
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("flexarm-urdf-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl AsRef<Path> for TestFolder {
    fn as_ref(&self) -> &Path {
        &self.0
    }
}

/// A valid `<inertial>`.
pub(crate) const INERTIAL: &str =
    r#"<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>"#;

/// A link with valid mass.
pub(crate) fn link(name: &str) -> String {
    format!("<link name=\"{name}\">{INERTIAL}</link>\n")
}

/// A continuous joint about z.
pub(crate) fn hinge(name: &str, parent: &str, child: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"continuous\"><parent link=\"{parent}\"/><child link=\"{child}\"/><axis xyz=\"0 0 1\"/></joint>\n"
    )
}

/// `<robot>` in line 1, the parts from line 2 on.
pub(crate) fn robot(parts: &[&str]) -> String {
    format!("<robot name=\"r\">\n{}</robot>\n", parts.concat())
}

/// Two links and the given joint.
pub(crate) fn with_joint(joint: &str) -> String {
    robot(&[&link("base"), &link("arm"), joint, "\n"])
}

/// Faults of a text and their lines.
pub(crate) fn problems(text: &str) -> Vec<(u32, Finding)> {
    problems_with(text, &ReadOptions::default())
}

pub(crate) fn problems_with(text: &str, options: &ReadOptions) -> Vec<(u32, Finding)> {
    match parse_urdf(text, "robot.urdf", options) {
        Ok(_) => Vec::new(),
        Err(error) => error.issues().iter().map(|issue| (line(issue), issue.clone())).collect(),
    }
}

/// Line of a finding in `robot.urdf`.
pub(crate) fn line(finding: &Finding) -> u32 {
    finding.location.split(':').nth(1).unwrap().parse().unwrap()
}

/// The only fault of a text.
#[track_caller]
pub(crate) fn problem(text: &str) -> (u32, Finding) {
    let mut all = problems(text);
    assert_eq!(all.len(), 1, "{all:?}");
    all.remove(0)
}
