//! Robots as text, and changes of their files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use flexarm_run::{LoadOptions, Modelling, Motion, Robot, check};
use toml::{Table, Value};

pub(super) fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(path)
}

/// A robot as text: its robot file as a table, its URDF.
#[derive(Clone)]
pub(super) struct Texts {
    pub(super) robot: Table,
    pub(super) urdf: String,
}

/// A temporary folder with a copy of the files that the robot file needs in addition to the URDF.
pub(super) struct Place {
    pub(super) folder: PathBuf,
    pub(super) texts: Texts,
}

impl Place {
    pub(super) fn new(robot: &str) -> Self {
        let folder =
            std::env::temp_dir().join(format!("flexarm-caveats-{}-{}", std::process::id(), robot.replace('/', "-")));
        let file = project("robots").join(robot);
        let text = std::fs::read_to_string(&file).unwrap();
        let robot: Table = text.parse().unwrap();
        let near = file.parent().unwrap();
        let urdf = std::fs::read_to_string(near.join(robot["urdf"].as_str().unwrap())).unwrap();
        for link in robot.get("flexible_link").and_then(Value::as_array).into_iter().flatten() {
            if let Some(reduced) = link.get("reduced").and_then(Value::as_str) {
                std::fs::create_dir_all(folder.join(reduced).parent().unwrap()).unwrap();
                std::fs::copy(near.join(reduced), folder.join(reduced)).unwrap();
            }
        }
        std::fs::create_dir_all(&folder).unwrap();
        let mut robot = robot;
        robot.insert("urdf".into(), "robot.urdf".into());
        let motion = near.join(robot["default_trajectory"].as_str().unwrap());
        robot.insert("default_trajectory".into(), motion.canonicalize().unwrap().to_str().unwrap().into());
        Self { folder, texts: Texts { robot, urdf } }
    }

    /// Codes of warnings and errors, in `check` and in `statics` at the same pose.
    pub(super) fn told(&self, texts: &Texts) -> [BTreeSet<String>; 2] {
        let file = self.folder.join("robot.toml");
        std::fs::write(&file, toml::to_string(&texts.robot).unwrap()).unwrap();
        std::fs::write(self.folder.join("robot.urdf"), &texts.urdf).unwrap();
        let options = LoadOptions::default();
        let found = check(&file, None, &options);
        let found = found.iter().filter(|f| f.code != "missing-mesh"); // the copy has no meshes
        let loud = found.filter(|f| f.severity != flexarm_run::Severity::Note).map(|f| f.code.clone()).collect();
        let held = Robot::load(&file).and_then(|robot| {
            let motion = Motion::load_for(robot.default_trajectory.as_ref().unwrap(), &*robot.rigid_model()?)?;
            let n = motion.trajectory.joints().len();
            let mut q = vec![0.0; n];
            motion.trajectory.sample(0.0, &mut q, &mut vec![0.0; n], &mut vec![0.0; n]);
            robot.model(&Modelling::default())?.statics(Some(&q), [0.0; 6])
        });
        let loud_too = match held {
            Ok(held) => {
                held.caveats.iter().filter(|c| c.warns() && c.code != "missing-mesh").map(|c| c.code.clone()).collect()
            }
            Err(error) => [format!("error: {error}")].into(),
        };
        [loud, loud_too]
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Multiplies every number of an attribute of an element of the URDF.
pub(super) fn scaled(urdf: &str, element: &str, attribute: &str, factor: f64) -> String {
    let (open, key) = (format!("<{element} "), format!("{attribute}=\""));
    let mut out = String::new();
    let mut rest = urdf;
    while let Some(start) = rest.find(&open) {
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start..end];
        out += &rest[..start];
        match tag.find(&key) {
            Some(at) => {
                let from = at + key.len();
                let to = from + tag[from..].find('"').unwrap();
                let numbers =
                    tag[from..to].split_whitespace().map(|n| (n.parse::<f64>().unwrap() * factor).to_string());
                out += &format!("{}{}{}", &tag[..from], numbers.collect::<Vec<_>>().join(" "), &tag[to..]);
            }
            None => out += tag,
        }
        rest = &rest[end..];
    }
    out + rest
}

/// Multiplies all numbers in a value.
pub(super) fn times(value: &mut Value, factor: f64) {
    match value {
        Value::Float(x) => *x *= factor,
        Value::Integer(x) => *value = Value::Float(*x as f64 * factor),
        Value::Array(all) => all.iter_mut().for_each(|x| times(x, factor)),
        _ => {}
    }
}

pub(super) type Change = Box<dyn Fn(&mut Texts) -> bool>;

/// Multiplies the value of a key path in the robot file; `*` matches every entry of a list. Returns
/// false if nothing is there.
pub(super) fn key(path: &'static str, factor: f64) -> Change {
    pub(super) fn walk(value: &mut Value, keys: &[&str], factor: f64) -> bool {
        match (keys, value) {
            ([], value) => {
                times(value, factor);
                true
            }
            (["*", rest @ ..], Value::Array(all)) => {
                all.iter_mut().filter_map(|x| walk(x, rest, factor).then_some(())).count() > 0
            }
            ([first, rest @ ..], Value::Table(table)) => table.get_mut(*first).is_some_and(|x| walk(x, rest, factor)),
            _ => false,
        }
    }
    Box::new(move |texts| {
        let keys: Vec<&str> = path.split('.').collect();
        let before = texts.robot.clone();
        texts.robot.get_mut(keys[0]).is_some_and(|value| walk(value, &keys[1..], factor)) && texts.robot != before
    })
}

/// Sets a value (TOML) at a key path; with `*` in every entry.
pub(super) fn set(path: &'static str, text: &'static str) -> Change {
    pub(super) fn walk(value: &mut Value, keys: &[&str], new: &Value) -> bool {
        match (keys, value) {
            (["*", rest @ ..], Value::Array(all)) => {
                all.iter_mut().filter_map(|x| walk(x, rest, new).then_some(())).count() > 0
            }
            ([index, rest @ ..], Value::Array(all)) => {
                all.get_mut(index.parse::<usize>().unwrap()).is_some_and(|x| walk(x, rest, new))
            }
            ([last], Value::Table(table)) => {
                table.insert((*last).into(), new.clone());
                true
            }
            ([first, rest @ ..], Value::Table(table)) => table.get_mut(*first).is_some_and(|x| walk(x, rest, new)),
            _ => false,
        }
    }
    Box::new(move |texts| {
        let new: Table = format!("x = {text}").parse().unwrap();
        let keys: Vec<&str> = path.split('.').collect();
        match keys.len() {
            1 => {
                texts.robot.insert(keys[0].into(), new["x"].clone());
                true
            }
            _ => texts.robot.get_mut(keys[0]).is_some_and(|value| walk(value, &keys[1..], &new["x"])),
        }
    })
}

/// Calibrates the first joint that has a drive.
pub(super) fn calibrated(entry: &'static str, value: f64) -> Change {
    Box::new(move |texts| {
        let drives = texts.robot.get("drive").and_then(Value::as_array);
        let Some(joint) = drives.and_then(|all| all[0].get("joint")).cloned() else { return false };
        let table = Table::from_iter([("joint".to_owned(), joint), (entry.to_owned(), value.into())]);
        texts.robot.insert("calibration".into(), Value::Array(vec![table.into()])).is_none()
    })
}

/// Multiplies an attribute in the URDF.
pub(super) fn urdf(element: &'static str, attribute: &'static str, factor: f64) -> Change {
    Box::new(move |texts| {
        let new = scaled(&texts.urdf, element, attribute, factor);
        std::mem::replace(&mut texts.urdf, new.clone()) != new
    })
}

/// Another material, if a section has one.
pub(super) fn material(text: &'static str) -> Change {
    let new = set("flexible_link.*.beam.material", text);
    Box::new(move |texts| {
        let given = |link: &Value| link.get("beam").and_then(|b| b["section"].as_str()) == Some("given");
        !links(texts).iter().any(given) && new(texts)
    })
}

/// Transverse channels instead of boxes and tubes.
pub(super) fn channels() -> Change {
    let channel = "{ section = \"channel\", width = 0.1, height = 0.2, web = 0.01, flange = 0.01, material = \"steel\", \
                   parts = \"uniform\" }";
    let new = set("flexible_link.*.beam", channel);
    Box::new(move |texts| {
        let shaped = |link: &Value| link.get("beam").is_some_and(|b| b.get("wall").is_some());
        links(texts).iter().any(shaped) && new(texts)
    })
}

pub(super) fn links(texts: &Texts) -> Vec<Value> {
    texts.robot.get("flexible_link").and_then(Value::as_array).cloned().unwrap_or_default()
}

/// Multiplies the stiffness of one gear of an arm that has five, that of the second last joint.
pub(super) fn one_gear(factor: f64) -> Change {
    Box::new(move |texts| {
        let drives = texts.robot.get_mut("drive").and_then(Value::as_array_mut);
        let gears = drives.into_iter().flatten().filter_map(|drive| drive.get_mut("gearbox")?.get_mut("stiffness"));
        let mut gears: Vec<&mut Value> = gears.collect();
        let place = gears.len().checked_sub(2).filter(|_| gears.len() >= 5);
        place.map(|place| times(gears[place], factor)).is_some()
    })
}

/// A change for robots without links from meshes, whose masses and lengths are independent.
pub(super) fn without_meshes(change: Change) -> Change {
    Box::new(move |texts| !links(texts).iter().any(|link| link.get("reduced").is_some()) && change(texts))
}

/// A change for robots whose beams do not cut the inertia of their link.
pub(super) fn without_from_link(change: Change) -> Change {
    let cuts =
        |link: &Value| link.get("beam").is_some_and(|b| b.get("parts").and_then(Value::as_str) != Some("uniform"));
    Box::new(move |texts| !links(texts).iter().any(cuts) && change(texts))
}

/// Both changes together.
pub(super) fn both(first: Change, second: Change) -> Change {
    Box::new(move |texts| first(texts) && second(texts))
}

/// A change for robots with torque-driven joints (or without).
pub(super) fn torque(has: bool, change: Change) -> Change {
    Box::new(move |texts| {
        let drives = texts.robot.get("drive").and_then(Value::as_array).cloned().unwrap_or_default();
        drives.iter().any(|drive| drive["kind"].as_str() == Some("torque")) == has && change(texts)
    })
}

/// A counterbalance whose gas has volume for only a part of the stroke, and a gas spring with
/// enough volume.
pub(super) const CRAMPED: &str = "[{ from = { link = \"link_1\", xyz = [-0.6, 0.0, 0.0] }, to = { link = \"link_2\", xyz = [0.0, 0.0, 0.3] }, \
                       gas = { acts = \"pull\", pressure = 2e6, volume = 1e-4, area = 1e-3, length = 0.6 } }]";
pub(super) const GAS_SPRING: &str = "[{ from = { link = \"link_1\", xyz = [-0.6, 0.0, 0.0] }, to = { link = \"link_2\", xyz = [0.0, 0.0, 0.3] }, \
                          gas_spring = { force = 900.0, length = 1.6, stroke = 1.4, progression = 1.3 } }]";

/// Balancers on the arms that have the required joints and links.
pub(super) fn balanced(text: &'static str) -> Change {
    let new = set("balancer", text);
    Box::new(move |texts| {
        let arm = ["link_1", "link_2", "joint_2"].iter().all(|name| texts.urdf.contains(&format!("name=\"{name}\"")));
        arm && texts.robot.contains_key("payload") && new(texts)
    })
}

/// Only a lumped link accepts factors by direction.
pub(super) fn lumped(change: Change) -> Change {
    Box::new(move |texts| links(texts).iter().all(|link| link.get("reduced").is_none()) && change(texts))
}

/// A change for robots whose links are only beams: mass and inertia are those of the section.
pub(super) fn bare(change: Change) -> Change {
    Box::new(move |texts| texts.urdf.contains("beam_1") && change(texts))
}

/// Name of the n-th link of arms with numbered links.
pub(super) fn link_n(texts: &Texts, n: usize) -> Option<String> {
    let names = if n == 0 { vec!["base_link".to_owned(), "base".to_owned()] } else { vec![format!("link_{n}")] };
    let six = texts.urdf.contains("name=\"link_6\"");
    names.into_iter().find(|name| six && texts.urdf.contains(&format!("<link name=\"{name}\"")))
}

/// The TCP on the n-th link.
pub(super) fn tcp_on(n: usize) -> Change {
    Box::new(move |texts| {
        let Some(link) = link_n(texts, n) else { return false };
        let tcp = texts.robot.get_mut("tcp").and_then(Value::as_table_mut);
        tcp.is_some_and(|tcp| tcp.insert("link".into(), link.into()).is_some())
    })
}

/// The payload on the n-th link, if it exists.
pub(super) fn payload_on(n: usize) -> Change {
    Box::new(move |texts| {
        let Some(link) = link_n(texts, n) else { return false };
        let payload = texts.robot.get_mut("payload").and_then(Value::as_table_mut);
        payload.is_some_and(|payload| payload.insert("link".into(), link.into()).is_some())
    })
}

/// The n-th of six drives without its gearbox, if all six have one.
pub(super) fn without_gear(n: usize) -> Change {
    Box::new(move |texts| {
        let drives = texts.robot.get_mut("drive").and_then(Value::as_array_mut);
        drives.is_some_and(|drives| {
            let all =
                drives.len() == 6 && drives.iter().take(n + 1).all(|drive| drive["kind"].as_str() == Some("gearbox"));
            let Some(drive) = drives.get_mut(n).and_then(Value::as_table_mut).filter(|_| all) else { return false };
            drive.insert("kind".into(), "prescribed".into());
            drive.remove("gearbox").is_some()
        })
    })
}

/// A change for robots without a counterbalance, which is designed for a weight and a mounting.
pub(super) fn unbalanced(change: Change) -> Change {
    Box::new(move |texts| !texts.robot.contains_key("balancer") && change(texts))
}

pub(super) fn inertia(factor: f64) -> Change {
    Box::new(move |texts| {
        for name in ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"] {
            texts.urdf = scaled(&texts.urdf, "inertia", name, factor);
        }
        true
    })
}
