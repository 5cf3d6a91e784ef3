//! The pages of the robot, motion and loads files in `docs/` and their schemas: every example
//! loads, every key is documented.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use flexarm_run::{DriveKind, LinkModel, Modelling, Motion, Robot, Scenario};

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(path)
}

fn read(path: &str) -> String {
    std::fs::read_to_string(project(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Text of every fenced block in a language.
fn blocks(page: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    page.split(&fence).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

/// A telescopic column with an arm on a flange.
const COLUMN: &str = r#"<robot name="column">
  <link name="outer"/>
  <link name="inner"><inertial><mass value="20"/><inertia ixx="2" iyy="2" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tool0"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lift" type="prismatic"><parent link="outer"/><child link="inner"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.2" velocity="1" effort="1000"/></joint>
  <joint name="column_to_arm" type="fixed"><parent link="inner"/><child link="tool0"/><origin xyz="0.5 0 1.5"/></joint>
</robot>"#;

/// A folder with the shipped KR 210 class robot, without its meshes.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-docs-{}-{name}", std::process::id()));
        std::fs::create_dir_all(folder.join("fe")).unwrap();
        for file in ["kr210.urdf", "fe/link_2.flex", "fe/link_3.flex"] {
            std::fs::copy(project("robots/kr210").join(file), folder.join(file)).unwrap();
        }
        std::fs::write(folder.join("column.urdf"), COLUMN).unwrap();
        Self(folder)
    }

    fn robot(&self, text: &str) -> Robot {
        std::fs::write(self.0.join("robot.toml"), text).unwrap();
        Robot::load(&self.0).unwrap_or_else(|e| panic!("{e}\n{text}"))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn every_example_of_a_robot_file_loads() {
    let (page, place) =
        (read("docs/robot-file.md") + &read("docs/mounting.md") + &read("docs/gears.md"), Place::new("robots"));
    let (mut modal, mut torque) = (0, 0);
    for block in blocks(&page, "toml") {
        // A 6x6 alone is an entry of a link; `link_bodies` reads both of them.
        if block.starts_with("stiffness = [") {
            continue;
        }
        // Loops belong to another robot: the shipped palletiser has the same entries.
        if block.contains("[[loop]]") {
            let shipped = read("robots/palletiser/robot.toml");
            let keys = |text: &str| -> Vec<String> {
                let lines = text.lines().filter_map(|line| line.split_once(" = "));
                lines
                    .map(|(key, _)| key.to_owned())
                    .filter(|key| ["pin", "eye", "dependent"].contains(&key.as_str()))
                    .collect()
            };
            assert_eq!(keys(&block), keys(shipped.split("[[loop]]").nth(1).unwrap()));
            assert!(shipped.contains(block.lines().nth(1).unwrap()), "{block}");
            continue;
        }
        let column = block.contains("\"lift\"") || block.contains("\"column_to_arm\"");
        let urdf = if column { "column.urdf" } else { "kr210.urdf" };
        let head = if block.starts_with("format") { String::new() } else { format!("format = 1\nurdf = \"{urdf}\"\n") };
        let robot = place.robot(&format!("{head}{block}"));
        let mounted = block.contains("[mounting]");
        let under = usize::from(mounted && !block.contains("[mounting]\nstiffness"));
        assert_eq!(robot.is_mounted(), mounted);
        assert_eq!(robot.flexible_links.len(), block.matches("[[flexible_link]]").count() + under);
        assert_eq!(robot.drives.len(), block.matches("[[drive]]").count());
        assert_eq!(robot.rigid.balancers.len(), block.matches("[[balancer]]").count());
        robot.model(&Modelling::default()).unwrap();
        modal += robot.flexible_links.iter().filter(|link| link.choices.model == LinkModel::Modal).count();
        torque += robot.drives.iter().filter(|drive| drive.kind == DriveKind::Torque).count();
    }
    assert!(modal >= 2 && torque >= 1, "{modal} {torque}");
}

#[test]
fn every_example_of_a_loads_file_loads() {
    let (page, place) = (read("docs/loads.md"), Place::new("loads"));
    std::fs::write(place.0.join("force.csv"), &blocks(&page, "csv")[0]).unwrap();
    let robot = place.robot("format = 1\nurdf = \"kr210.urdf\"\ntcp = { link = \"tool0\" }\n");
    let model = robot.rigid_model().unwrap();
    let motion = Motion::from_samples(&[0.0, 3.0], &[0.0; 12], &robot).unwrap();
    let examples = blocks(&page, "toml");
    assert!(!examples.is_empty());
    for block in examples {
        let path = place.0.join("loads.toml");
        std::fs::write(&path, &block).unwrap();
        let scenario = Scenario::from(&motion).with_loads_file(&path).unwrap_or_else(|e| panic!("{e}"));
        let read = scenario.acting_on(&robot, &model).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(read.loads.len(), block.matches("[[load]]").count());
        assert_eq!(read.changes.len(), block.matches("[[payload]]").count());
        for t in [0.0, 0.3, 1.0005, 2.9] {
            for load in &read.loads {
                let wrench = load.wrench.at(t);
                assert!(wrench.force.iter().chain(wrench.torque.iter()).all(|x| x.is_finite()), "at {t} s");
            }
        }
    }
}

/// A robot on a rail, for the examples of motions: speed limits as in a URDF.
const RAIL: &str = r#"<robot name="rail">
  <link name="base"/>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="2"/></joint>
  <link name="cart"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint_1" type="revolute"><parent link="cart"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="4"/></joint>
  <link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="joint_2" type="revolute"><parent link="arm"/><child link="hand"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="20"/></joint>
  <link name="hand"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"#;

/// Truth: the goals, durations and units in the examples.
#[test]
fn every_example_of_a_motion_file_loads_and_goes_where_it_says() {
    let (page, place) = (read("docs/motions.md"), Place::new("motions"));
    std::fs::write(place.0.join("rail.urdf"), RAIL).unwrap();
    let robot = Robot::load(place.0.join("rail.urdf")).unwrap();
    let model = robot.rigid_model().unwrap();
    for language in ["toml", "csv"] {
        let examples = blocks(&page, language);
        assert!(!examples.is_empty(), "{language}");
        for block in examples {
            let path = place.0.join(format!("motion.{language}"));
            std::fs::write(&path, &block).unwrap();
            let motion = Motion::load_for(&path, &model).unwrap_or_else(|e| panic!("{e}"));
            assert!(motion.violations.is_empty(), "{:?}", motion.violations);
            let (mut q, mut v, mut a) = ([0.0; 3], [0.0; 3], [0.0; 3]);
            let degrees = f64::to_radians(1.0);
            let (t, goal) = match (language, block.contains("[samples]")) {
                ("toml", false) => (1.6, [0.2, 60.0 * degrees, 30.0 * degrees]),
                ("toml", true) => (0.01, [0.0, 0.1 * degrees, -0.2 * degrees]),
                _ => (0.04, [0.003, 0.3 * degrees, -0.5 * degrees]),
            };
            motion.trajectory.sample(t, &mut q, &mut v, &mut a);
            // measured 6e-17
            assert!(q.iter().zip(goal).all(|(q, goal)| (q - goal).abs() < 1e-14), "{q:?}");
        }
    }
}

/// Keys of every struct that is read from a file.
fn keys(sources: &[impl AsRef<str>]) -> BTreeMap<String, BTreeSet<String>> {
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for source in sources {
        let (mut reads, mut inside, mut renamed) = (false, None::<String>, None::<String>);
        for line in read(source.as_ref()).lines().map(str::trim) {
            let line = line.strip_prefix("pub ").or_else(|| line.strip_prefix("pub(crate) ")).unwrap_or(line);
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

/// Sources of `robot.toml`: the file itself and every entry.
fn robot_sources() -> Vec<String> {
    let mut found = vec!["crates/run/flexarm-run/src/robot/robot_file.rs".to_owned()];
    for folder in ["crates/run/flexarm-run/src/robot", "crates/run/flexarm-linkmaker/src"] {
        let names = std::fs::read_dir(project(folder)).unwrap().map(|file| file.unwrap().file_name());
        let names = names.map(|name| name.into_string().unwrap());
        found.extend(names.filter(|name| name.ends_with("_entry.rs")).map(|name| format!("{folder}/{name}")));
    }
    found
}

const LOADS: [&str; 1] = ["crates/run/flexarm-run/src/motions/loads_file.rs"];
const MOTION: [&str; 2] =
    ["crates/motion/flexarm-trajectory/src/waypoints_toml.rs", "crates/motion/flexarm-trajectory/src/samples_toml.rs"];

#[test]
fn every_key_is_on_its_page() {
    let robot = robot_sources();
    let all = keys(&robot);
    assert!(all["FlexibleLinkEntry"].contains("eigenmodes") && all["BeamEntry"].contains("kGA_y"), "{all:?}");
    assert!(all["DriveEntry"].contains("motor_inertia"), "{all:?}");
    assert!(keys(&LOADS)["LoadEntry"].contains("spindle_rpm"));
    assert!(keys(&MOTION)["MoveToml"].contains("via") && keys(&MOTION)["FileToml"].contains("move"));
    for (path, structs) in
        [("docs/robot-file.md", all), ("docs/loads.md", keys(&LOADS)), ("docs/motions.md", keys(&MOTION))]
    {
        let page = read(path);
        for (of, names) in &structs {
            for name in names {
                let shown = [format!("`{name}`"), format!("{name} ="), format!("{{ {name}"), format!(", {name}")];
                assert!(shown.iter().any(|text| page.contains(text)), "{name} of {of} is not in {path}");
            }
        }
    }
}

/// Compares the definitions of a schema, by name, with the struct that each describes; the first
/// one is the whole file.
fn same_keys(schema: &str, sources: &[impl AsRef<str>], files: &[&str], definitions: &[(&str, &str)]) {
    let schema: serde_json::Value = serde_json::from_str(&read(schema)).unwrap();
    let properties = |node: &serde_json::Value| -> BTreeSet<String> {
        node["properties"].as_object().unwrap().keys().cloned().collect()
    };
    let all = keys(sources);
    let of_files: BTreeSet<String> = files.iter().flat_map(|file| all[*file].iter().cloned()).collect();
    assert_eq!(properties(&schema), of_files);
    assert_eq!(schema["additionalProperties"], false);
    for (definition, entry) in definitions {
        let node = &schema["$defs"][definition];
        assert_eq!(properties(node), all[*entry], "{definition}");
        assert_eq!(node["additionalProperties"], false, "{definition}");
    }
}

#[test]
fn the_schemas_have_the_same_keys() {
    let robot = [
        ("tcp", "TcpEntry"),
        ("payload", "PayloadEntry"),
        ("mounting", "MountingEntry"),
        ("flexible_link", "FlexibleLinkEntry"),
        ("damping", "DampingEntry"),
        ("beam", "BeamEntry"),
        ("material", "MaterialConstants"),
        ("drive", "DriveEntry"),
        ("gearbox", "GearboxEntry"),
        ("friction", "FrictionEntry"),
        ("transmission_error", "HarmonicEntry"),
        ("hysteresis", "HysteresisEntry"),
        ("coupling", "CouplingEntry"),
        ("servo", "ServoEntry"),
        ("controller_axis", "ControllerAxisEntry"),
        ("balancer", "BalancerEntry"),
        ("loop", "LoopEntry"),
        ("balancer_end", "EndEntry"),
        ("balancer_spring", "SpringEntry"),
        ("balancer_gas", "GasEntry"),
        ("balancer_gas_spring", "GasSpringEntry"),
        ("balancer_sine", "SineEntry"),
        ("guide", "GuideEntry"),
        ("tilt", "TiltEntry"),
        ("calibration", "CalibrationEntry"),
        ("inertial", "InertialEntry"),
        ("strain_gauge", "StrainGaugeEntry"),
        ("stress_point", "StressPointEntry"),
    ];
    same_keys("docs/robot.schema.json", &robot_sources(), &["RobotFile"], &robot);
    same_keys("docs/loads.schema.json", &LOADS, &["LoadsFile"], &[("load", "LoadEntry"), ("payload", "PayloadEntry")]);
    let motion = [("move", "MoveToml"), ("limits", "LimitsToml"), ("samples", "SamplesToml")];
    same_keys("docs/motion.schema.json", &MOTION, &["FileToml", "SamplesFileToml"], &motion);
}
