//! `docs/robot-file.md` and `docs/robot.schema.json`: every example loads, every key is there.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use flexarm::{Disturbances, DriveKind, LinkModel, LoadOptions, Robot};

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(project(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Text of every fenced block of that language.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    page.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

/// A folder with the shipped KR 210 class robot, without its meshes.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-docs-{}-{name}", std::process::id()));
        std::fs::create_dir_all(folder.join("fe")).unwrap();
        for file in ["kr210.urdf", "fe/link_2.flex", "fe/link_3.flex"] {
            std::fs::copy(project("robots/kr210").join(file), folder.join(file)).unwrap();
        }
        Self(folder)
    }

    fn robot(&self, text: &str) -> Robot {
        std::fs::write(self.0.join("robot.toml"), text).unwrap();
        Robot::load(&self.0, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn every_example_loads() {
    let (page, place) = (read("docs/robot-file.md"), Place::new("examples"));
    std::fs::write(place.0.join("force.csv"), &blocks(&page, "csv")[0]).unwrap();
    let (mut modal, mut torque, mut loads) = (0, 0, 0);
    for block in blocks(&page, "toml") {
        if block.contains("[[load]]") {
            let robot = place.robot("format = 1\nurdf = \"kr210.urdf\"\ntcp = { link = \"tool0\" }\n");
            let path = place.0.join("loads.toml");
            std::fs::write(&path, &block).unwrap();
            let model = robot.rigid_model().unwrap();
            let read = Disturbances::load(&path, &robot, &model, 3.0).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(read.loads.len(), block.matches("[[load]]").count());
            assert_eq!(read.changes.len(), block.matches("[[payload]]").count());
            for t in [0.0, 0.3, 1.0005, 2.9] {
                for load in &read.loads {
                    let wrench = (load.wrench)(t);
                    assert!(wrench.force.iter().chain(wrench.torque.iter()).all(|x| x.is_finite()), "at {t} s");
                }
            }
            loads += 1;
            continue;
        }
        let head = if block.starts_with("format") { "" } else { "format = 1\nurdf = \"kr210.urdf\"\n" };
        let robot = place.robot(&format!("{head}{block}"));
        assert_eq!(robot.flexible.len(), block.matches("[[flexible_link]]").count());
        assert_eq!(robot.drives.len(), block.matches("[[drive]]").count());
        robot.flexible_robot().unwrap();
        modal += robot.flexible.iter().filter(|link| link.choices.model == LinkModel::Modal).count();
        torque += robot.drives.iter().filter(|drive| drive.kind == DriveKind::Torque).count();
    }
    assert!(modal >= 2 && torque >= 1 && loads >= 1, "{modal} {torque} {loads}");
}

/// Keys of every struct that is read from a file.
fn keys(sources: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for source in sources {
        let (mut reads, mut inside, mut renamed) = (false, None::<String>, None::<String>);
        for line in read(source).lines().map(str::trim) {
            let line = line.strip_prefix("pub ").unwrap_or(line);
            if line.starts_with("#[derive(") {
                reads = line.contains("Deserialize");
            } else if let Some(name) = line.strip_prefix("struct ").filter(|_| reads) {
                inside = Some(name.trim_end_matches(" {").to_owned());
                reads = false;
            } else if line == "}" {
                inside = None;
            } else if let Some(rest) = line.strip_prefix("#[serde(rename = \"") {
                renamed = rest.split('"').next().map(str::to_owned);
            } else if let (Some(of), Some((name, _))) = (&inside, line.split_once(": "))
                && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            {
                found.entry(of.clone()).or_default().insert(renamed.take().unwrap_or_else(|| name.to_owned()));
            }
        }
    }
    found
}

const ROBOT: [&str; 2] = ["crates/flexarm/src/robot_file.rs", "crates/flexarm/src/drive_entry.rs"];

#[test]
fn every_key_is_on_the_page() {
    let page = read("docs/robot-file.md");
    let all = keys(&[ROBOT[0], ROBOT[1], "crates/flexarm/src/disturbance.rs"]);
    assert!(all["FlexibleLinkEntry"].contains("eigenmodes") && all["BeamEntry"].contains("kGA_y"), "{all:?}");
    assert!(all["LoadEntry"].contains("spindle_rpm") && all["DriveEntry"].contains("motor_inertia"), "{all:?}");
    for (of, names) in &all {
        for name in names {
            let shown = [format!("`{name}`"), format!("{name} ="), format!("{{ {name}"), format!(", {name}")];
            assert!(shown.iter().any(|text| page.contains(text)), "{name} of {of} is not in docs/robot-file.md");
        }
    }
}

#[test]
fn the_schema_has_the_same_keys() {
    let schema: serde_json::Value = serde_json::from_str(&read("docs/robot.schema.json")).unwrap();
    let properties = |node: &serde_json::Value| -> BTreeSet<String> {
        node["properties"].as_object().unwrap().keys().cloned().collect()
    };
    let all = keys(&ROBOT);
    assert_eq!(properties(&schema), all["RobotFile"]);
    for (definition, entry) in [
        ("tcp", "TcpEntry"),
        ("payload", "PayloadEntry"),
        ("flexible_link", "FlexibleLinkEntry"),
        ("damping", "DampingEntry"),
        ("beam", "BeamEntry"),
        ("material", "MaterialConstants"),
        ("drive", "DriveEntry"),
        ("gearbox", "GearboxEntry"),
        ("friction", "FrictionEntry"),
        ("servo", "ServoEntry"),
    ] {
        let node = &schema["$defs"][definition];
        assert_eq!(properties(node), all[entry], "{definition}");
        assert_eq!(node["additionalProperties"], false, "{definition}");
    }
}
