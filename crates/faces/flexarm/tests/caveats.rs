//! Mistakes in robot files, URDFs, motions and loads: counts those reported, and checks that
//! plausible changes are not reported.
//!
//! A mutation changes one thing in a shipped robot; `check` and `statics` then have to warn (or
//! refuse) with the corresponding code. A harmless change must not add a warning to those of the
//! shipped robot.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use flexarm::{LinkModel, LoadOptions, Modelling, Motion, Robot, RunOptions, Scenario, check, statics};
use toml::{Table, Value};

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..").join(path)
}

/// A robot as text: its robot file as a table, its URDF.
#[derive(Clone)]
struct Texts {
    robot: Table,
    urdf: String,
}

/// A temporary folder with a copy of the files that the robot file needs in addition to the URDF.
struct Place {
    folder: PathBuf,
    texts: Texts,
}

impl Place {
    fn new(robot: &str) -> Self {
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
    fn told(&self, texts: &Texts) -> [BTreeSet<String>; 2] {
        let file = self.folder.join("robot.toml");
        std::fs::write(&file, toml::to_string(&texts.robot).unwrap()).unwrap();
        std::fs::write(self.folder.join("robot.urdf"), &texts.urdf).unwrap();
        let options = LoadOptions::default();
        let found = check(&file, None, &options);
        let found = found.iter().filter(|f| f.code != "missing-mesh"); // the copy has no meshes
        let loud = found.filter(|f| f.severity != "note").map(|f| f.code.clone()).collect();
        let held = Robot::load_with(&file, &options).and_then(|robot| {
            let motion = Motion::load_for(robot.default_trajectory.as_ref().unwrap(), &*robot.rigid_model()?)?;
            let n = motion.trajectory.joints().len();
            let mut q = vec![0.0; n];
            motion.trajectory.sample(0.0, &mut q, &mut vec![0.0; n], &mut vec![0.0; n]);
            statics(&robot, &Modelling::default(), Some(&q), [0.0; 6])
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
fn scaled(urdf: &str, element: &str, attribute: &str, factor: f64) -> String {
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
fn times(value: &mut Value, factor: f64) {
    match value {
        Value::Float(x) => *x *= factor,
        Value::Integer(x) => *value = Value::Float(*x as f64 * factor),
        Value::Array(all) => all.iter_mut().for_each(|x| times(x, factor)),
        _ => {}
    }
}

type Change = Box<dyn Fn(&mut Texts) -> bool>;

/// Multiplies the value of a key path in the robot file; `*` matches every entry of a list. Returns
/// false if nothing is there.
fn key(path: &'static str, factor: f64) -> Change {
    fn walk(value: &mut Value, keys: &[&str], factor: f64) -> bool {
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
fn set(path: &'static str, text: &'static str) -> Change {
    fn walk(value: &mut Value, keys: &[&str], new: &Value) -> bool {
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

/// Multiplies an attribute in the URDF.
fn urdf(element: &'static str, attribute: &'static str, factor: f64) -> Change {
    Box::new(move |texts| {
        let new = scaled(&texts.urdf, element, attribute, factor);
        std::mem::replace(&mut texts.urdf, new.clone()) != new
    })
}

/// Another material, if a section has one.
fn material(text: &'static str) -> Change {
    let new = set("flexible_link.*.beam.material", text);
    Box::new(move |texts| {
        let given = |link: &Value| link.get("beam").and_then(|b| b["section"].as_str()) == Some("given");
        !links(texts).iter().any(given) && new(texts)
    })
}

/// Transverse channels instead of boxes and tubes.
fn channels() -> Change {
    let channel = "{ section = \"channel\", width = 0.1, height = 0.2, web = 0.01, flange = 0.01, material = \"steel\", \
                   parts = \"uniform\" }";
    let new = set("flexible_link.*.beam", channel);
    Box::new(move |texts| {
        let shaped = |link: &Value| link.get("beam").is_some_and(|b| b.get("wall").is_some());
        links(texts).iter().any(shaped) && new(texts)
    })
}

fn links(texts: &Texts) -> Vec<Value> {
    texts.robot.get("flexible_link").and_then(Value::as_array).cloned().unwrap_or_default()
}

/// Multiplies the stiffness of one gear of an arm that has five, that of the second last joint.
fn one_gear(factor: f64) -> Change {
    Box::new(move |texts| {
        let drives = texts.robot.get_mut("drive").and_then(Value::as_array_mut);
        let gears = drives.into_iter().flatten().filter_map(|drive| drive.get_mut("gearbox")?.get_mut("stiffness"));
        let mut gears: Vec<&mut Value> = gears.collect();
        let place = gears.len().checked_sub(2).filter(|_| gears.len() >= 5);
        place.map(|place| times(gears[place], factor)).is_some()
    })
}

/// A change for robots without links from meshes, whose masses and lengths are independent.
fn without_meshes(change: Change) -> Change {
    Box::new(move |texts| !links(texts).iter().any(|link| link.get("reduced").is_some()) && change(texts))
}

/// A change for robots whose beams do not cut the inertia of their link.
fn without_from_link(change: Change) -> Change {
    let cuts =
        |link: &Value| link.get("beam").is_some_and(|b| b.get("parts").and_then(Value::as_str) != Some("uniform"));
    Box::new(move |texts| !links(texts).iter().any(cuts) && change(texts))
}

/// Both changes together.
fn both(first: Change, second: Change) -> Change {
    Box::new(move |texts| first(texts) && second(texts))
}

/// A change for robots with torque-driven joints (or without).
fn torque(has: bool, change: Change) -> Change {
    Box::new(move |texts| {
        let drives = texts.robot.get("drive").and_then(Value::as_array).cloned().unwrap_or_default();
        drives.iter().any(|drive| drive["kind"].as_str() == Some("torque")) == has && change(texts)
    })
}

/// A counterbalance whose gas has volume for only a part of the stroke, and a gas spring with
/// enough volume.
const CRAMPED: &str = "[{ from = { link = \"link_1\", xyz = [-0.6, 0.0, 0.0] }, to = { link = \"link_2\", xyz = [0.0, 0.0, 0.3] }, \
                       gas = { acts = \"pull\", pressure = 2e6, volume = 1e-4, area = 1e-3, length = 0.6 } }]";
const GAS_SPRING: &str = "[{ from = { link = \"link_1\", xyz = [-0.6, 0.0, 0.0] }, to = { link = \"link_2\", xyz = [0.0, 0.0, 0.3] }, \
                          gas_spring = { force = 900.0, length = 1.6, stroke = 1.4, progression = 1.3 } }]";

/// Balancers on the arms that have the required joints and links.
fn balanced(text: &'static str) -> Change {
    let new = set("balancer", text);
    Box::new(move |texts| {
        let arm = ["link_1", "link_2", "joint_2"].iter().all(|name| texts.urdf.contains(&format!("name=\"{name}\"")));
        arm && texts.robot.contains_key("payload") && new(texts)
    })
}

/// Only a lumped link accepts factors by direction.
fn lumped(change: Change) -> Change {
    Box::new(move |texts| links(texts).iter().all(|link| link.get("reduced").is_none()) && change(texts))
}

/// A change for robots whose links are only beams: mass and inertia are those of the section.
fn bare(change: Change) -> Change {
    Box::new(move |texts| texts.urdf.contains("beam_1") && change(texts))
}

/// Name of the n-th link of arms with numbered links.
fn link_n(texts: &Texts, n: usize) -> Option<String> {
    let names = if n == 0 { vec!["base_link".to_owned(), "base".to_owned()] } else { vec![format!("link_{n}")] };
    let six = texts.urdf.contains("name=\"link_6\"");
    names.into_iter().find(|name| six && texts.urdf.contains(&format!("<link name=\"{name}\"")))
}

/// The TCP on the n-th link.
fn tcp_on(n: usize) -> Change {
    Box::new(move |texts| {
        let Some(link) = link_n(texts, n) else { return false };
        let tcp = texts.robot.get_mut("tcp").and_then(Value::as_table_mut);
        tcp.is_some_and(|tcp| tcp.insert("link".into(), link.into()).is_some())
    })
}

/// The payload on the n-th link, if it exists.
fn payload_on(n: usize) -> Change {
    Box::new(move |texts| {
        let Some(link) = link_n(texts, n) else { return false };
        let payload = texts.robot.get_mut("payload").and_then(Value::as_table_mut);
        payload.is_some_and(|payload| payload.insert("link".into(), link.into()).is_some())
    })
}

/// The n-th of six drives without its gearbox, if all six have one.
fn without_gear(n: usize) -> Change {
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
fn unbalanced(change: Change) -> Change {
    Box::new(move |texts| !texts.robot.contains_key("balancer") && change(texts))
}

fn inertia(factor: f64) -> Change {
    Box::new(move |texts| {
        for name in ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"] {
            texts.urdf = scaled(&texts.urdf, "inertia", name, factor);
        }
        true
    })
}

const ROBOTS: [&str; 15] = [
    "kr210/robot.toml",
    "kr210/links.toml",
    "kr210/drives.toml",
    "kr210/beams.toml",
    "kr210_identified/loaded.toml",
    "kr500_identified/loaded.toml",
    "manutec_r3/robot.toml",
    "reference_arm/robot.toml",
    "one_beam/robot.toml",
    "three_beams/robot.toml",
    "lower_arm/robot.toml",
    "palletiser/robot.toml",
    "kr300/robot.toml",
    "abb_three_mass/robot.toml",
    "abb_three_mass/torque.toml",
];

/// The mistake, its change, and the codes of which one must be reported.
fn slips() -> Vec<(&'static str, Change, &'static [&'static str])> {
    let deg = 180.0 / std::f64::consts::PI;
    let soft: &[&str] = &["gear-stiffness", "gear-rotation", "sag", "first-frequency"];
    vec![
        ("tcp in mm", key("tcp.xyz", 1e3), &["far"]),
        ("tcp in cm", key("tcp.xyz", 1e2), &["far"]),
        ("tcp turned by degrees", set("tcp.rpy", "[0.0, 90.0, 0.0]"), &["angle"]),
        ("URDF in mm", urdf("origin", "xyz", 1e3), &["size", "joint-distance"]),
        ("URDF angles in degrees", urdf("origin", "rpy", deg), &["angle"]),
        ("masses in g", urdf("mass", "value", 1e3), &["density", "beam-mass", "effort"]),
        ("masses in t", urdf("mass", "value", 1e-3), &["inertia", "effort-limit", "beam-mass", "inertia-too-large"]),
        ("inertias in kg mm2", inertia(1e6), &["inertia"]),
        ("inertias in kg cm2", inertia(1e4), &["inertia"]),
        ("speed limits in deg/s", urdf("limit", "velocity", deg), &["speed-limit"]),
        ("effort limits in N mm", urdf("limit", "effort", 1e3), &["effort-limit"]),
        ("effort limits in kN m", urdf("limit", "effort", 1e-3), &["effort", "motion-effort"]),
        ("payload of 15 t", set("payload", "{ mass = 15000.0, com = [0.0, 0.0, 0.1] }"), &["payload-mass", "effort"]),
        (
            "payload of 7.5 kg in g",
            set("payload", "{ mass = 7500.0, com = [0.0, 0.0, 0.1] }"),
            &["payload-mass", "effort"],
        ),
        ("payload in mm", set("payload", "{ mass = 1.0, com = [0.0, 0.0, 250.0] }"), &["far"]),
        (
            "payload inertia of no body",
            set("payload", "{ mass = 2.0, com = [0.0, 0.0, 0.1], inertia = [0.01, 0.01, 0.1, 0.0, 0.0, 0.0] }"),
            &["impossible-inertia"],
        ),
        (
            "payload inertia in kg mm2",
            set("payload", "{ mass = 2.0, com = [0.0, 0.0, 0.1], inertia = [5e3, 5e3, 6e3, 0.0, 0.0, 0.0] }"),
            &["payload-inertia"],
        ),
        ("gravity of 1 m/s2", set("gravity", "[0.0, 0.0, -1.0]"), &["gravity"]),
        ("gravity of 98.1 m/s2", set("gravity", "[0.0, 0.0, -98.1]"), &["gravity"]),
        ("gravity in mm/s2", set("gravity", "[0.0, 0.0, -9810.0]"), &["gravity"]),
        ("modulus in MPa", material("{ E = 70e3, nu = 0.33, rho = 2700.0 }"), &["modulus", "no-equilibrium"]),
        ("modulus in GPa", material("{ E = 70.0, nu = 0.33, rho = 2700.0 }"), &["modulus", "no-equilibrium"]),
        ("density in t/mm3", material("{ E = 70e9, nu = 0.33, rho = 2.7e-9 }"), &["material-density"]),
        ("density in g/cm3", material("{ E = 70e9, nu = 0.33, rho = 2.7 }"), &["material-density"]),
        ("nu of 0.5", material("{ E = 70e9, nu = 0.5, rho = 2700.0 }"), &["poisson"]),
        ("nu of -0.9", material("{ E = 70e9, nu = -0.9, rho = 2700.0 }"), &["poisson"]),
        ("bending stiffness in N mm2", key("flexible_link.*.beam.EI_y", 1e6), &["section"]),
        (
            "bending stiffness in kN m2",
            key("flexible_link.*.beam.EI_y", 1e-3),
            &["section", "large-deformation", "sag", "torsion", "large-strain"],
        ),
        ("damping of 30 per cent", set("flexible_link.*.damping", "{ modal = 0.3 }"), &["damping-ratio"]),
        ("stiffness_beta of 1e3", set("flexible_link.*.damping", "{ stiffness_beta = 1e3 }"), &["creep"]),
        ("Rayleigh damping of 1e4", set("flexible_link.*.damping", "{ rayleigh = [1e4, 1e-4] }"), &["damped-mode"]),
        ("channels that bend across their webs", channels(), &["shear-centre"]),
        ("roll in degrees", set("flexible_link.*.beam.roll", "90.0"), &["angle"]),
        ("gears in N m/deg", key("drive.*.gearbox.stiffness", 1.0 / deg), soft),
        ("one gear in N m/deg", one_gear(1.0 / deg), &["gear-stiffness"]),
        ("gears in kN m/rad", key("drive.*.gearbox.stiffness", 1e-3), soft),
        ("gears in N mm/rad", key("drive.*.gearbox.stiffness", 1e3), &["gear-stiffness", "first-frequency"]),
        ("gear damping 1000 times", key("drive.*.gearbox.damping", 1e3), &["creep", "damped-mode"]),
        ("play of 0.5 rad", set("drive.*.gearbox.backlash", "0.5"), &["backlash"]),
        ("ratio inverted", set("drive.*.ratio", "0.01"), &["ratio"]),
        ("rotors in kg cm2", key("drive.*.motor_inertia", 1e4), &["rotor"]),
        (
            "gear bearings in kN/m",
            set("drive.1.gearbox", "{ stiffness = [1e6, 1e6, 1e6, 2e6, 2e6, 2e6] }"),
            &["gear-lever"],
        ),
        ("friction in N mm", set("drive.*.friction", "{ coulomb = 1e6 }"), &["friction"]),
        ("servo sampled every second", torque(true, set("drive.0.servo", "{ sample_s = 1.0 }")), &["sampling"]),
        (
            "balancer in N mm/rad",
            balanced("[{ joint = \"joint_2\", spring = { rate = 2e6, free_angle = 0.0 } }]"),
            &["balancer-strong"],
        ),
        ("a counterbalance with a tenth of its volume", balanced(CRAMPED), &["balancer-room"]),
        ("tcp on the base", tcp_on(0), &["tcp-link"]),
        ("tcp on the elbow", tcp_on(3), &["tcp-link"]),
        ("tcp before the last joint", tcp_on(5), &["tcp-link"]),
        ("payload on the elbow", payload_on(3), &["payload-link"]),
        ("first drive rigid", without_gear(0), &["stiff-joint"]),
        ("second drive rigid", without_gear(1), &["stiff-joint"]),
        ("last drive rigid", without_gear(5), &["stiff-joint"]),
        ("links 100 times as stiff", set("flexible_link.*.stiffness_factor", "100.0"), &["link-stiffness"]),
        ("links a hundredth as stiff", set("flexible_link.*.stiffness_factor", "0.01"), &["link-stiffness"]),
        (
            "one direction of the links 50 times",
            lumped(set("flexible_link.0.stiffness_factors", "[1, 1, 1, 1, 50, 1]")),
            &["link-stiffness"],
        ),
        ("links without damping", set("flexible_link.*.damping", "{ modal = 0.0 }"), &["no-damping"]),
        ("stiffness_beta of 0", set("flexible_link.*.damping", "{ stiffness_beta = 0.0 }"), &["no-damping"]),
        ("gears without damping", set("drive.*.gearbox.damping", "0.0"), &["no-damping"]),
        ("walls a tenth", key("flexible_link.*.beam.wall", 0.1), &["wall"]),
        ("radius for diameter", key("flexible_link.*.beam.outer_diameter", 0.5), &["section-size"]),
        (
            "half the width and height",
            bare(both(key("flexible_link.0.beam.width", 0.5), key("flexible_link.0.beam.height", 0.5))),
            &["section-size"],
        ),
        ("counterbalance on the other side", key("balancer.0.from.xyz", -1.0), &["balancer-side"]),
        (
            "counterbalance with the sense of a load",
            balanced("[{ joint = \"joint_2\", sine = { torque = -12000.0, zero = 1.5708 } }]"),
            &["balancer-side"],
        ),
        ("servo far too stiff", torque(true, set("drive.0.servo", "{ velocity_gain = 1e4 }")), &["velocity-gain"]),
    ]
}

/// Valid alternatives.
fn harmless() -> Vec<(&'static str, Change)> {
    vec![
        ("as shipped", Box::new(|_| true)),
        ("no payload", Box::new(|texts| texts.robot.remove("payload").is_some())),
        (
            "payload 0 kg",
            Box::new(|texts| {
                let payload = texts.robot.get_mut("payload").and_then(Value::as_table_mut);
                payload.is_some_and(|payload| payload.insert("mass".into(), 0.0.into()).is_some())
            }),
        ),
        ("half the payload", key("payload.mass", 0.5)),
        ("a tenth of the payload", key("payload.mass", 0.1)),
        ("gears half as stiff", key("drive.*.gearbox.stiffness", 0.5)),
        ("one gear half as stiff", one_gear(0.5)),
        ("one gear twice as stiff", one_gear(2.0)),
        ("gears half as stiff again", key("drive.*.gearbox.stiffness", 1.5)),
        ("gears twice as stiff", key("drive.*.gearbox.stiffness", 2.0)),
        ("gear damping half", key("drive.*.gearbox.damping", 0.5)),
        ("gear damping twice", key("drive.*.gearbox.damping", 2.0)),
        ("play of 2 arc minutes", torque(false, set("drive.1.gearbox.backlash", "6e-4"))),
        ("links half as stiff", key("flexible_link.*.beam.EI_y", 0.5)),
        ("links stiffer", key("flexible_link.*.beam.EI_y", 1.5)),
        ("steel", material("\"steel\"")),
        ("a polymer", material("{ E = 3e9, nu = 0.4, rho = 1200.0 }")),
        ("thicker walls", key("flexible_link.*.beam.wall", 1.5)),
        ("one per cent of damping", set("flexible_link.*.damping", "{ modal = 0.01 }")),
        ("ten per cent of damping", set("flexible_link.*.damping", "{ modal = 0.1 }")),
        ("damping of 1e-4 s", set("flexible_link.*.damping", "{ stiffness_beta = 1e-4 }")),
        ("modal links", without_from_link(set("flexible_link.*.model", "\"modal\""))),
        ("on a ceiling", unbalanced(set("gravity", "[0.0, 0.0, 9.81]"))),
        ("on a wall", unbalanced(set("gravity", "[9.81, 0.0, 0.0]"))),
        ("on a slope", unbalanced(set("gravity", "[0.0, -6.937, -6.937]"))),
        ("on the moon", unbalanced(set("gravity", "[0.0, 0.0, -1.62]"))),
        ("in orbit", set("gravity", "[0.0, 0.0, 0.0]")),
        ("another tool", set("tcp.xyz", "[0.0, 0.1, 0.6]")),
        ("tool turned by a right angle", set("tcp.rpy", "[0.0, 1.5707963, 0.0]")),
        ("a torsion spring", balanced("[{ joint = \"joint_2\", spring = { rate = 90.0, free_angle = -1.0 } }]")),
        ("a gas spring", balanced(GAS_SPRING)),
        ("links a half stiffer by measurement", set("flexible_link.*.stiffness_factor", "1.5")),
        ("links half as stiff by measurement", set("flexible_link.*.stiffness_factor", "0.5")),
        ("wrist left rigid", both(without_gear(5), both(without_gear(4), without_gear(3)))),
        ("a payload of the tool's link, named", payload_on(6)),
        ("counterbalance of half its pressure", key("balancer.0.gas.pressure", 0.5)),
        ("rotors twice", key("drive.*.motor_inertia", 2.0)),
        ("effort limits 1.5 times", urdf("limit", "effort", 1.5)),
        ("effort limits twice", urdf("limit", "effort", 2.0)),
        ("speed limits up", urdf("limit", "velocity", 1.3)),
        ("masses 5 % up", without_meshes(urdf("mass", "value", 1.05))),
        ("inertias half", without_from_link(inertia(0.5))),
        (
            "a giant",
            Box::new(|texts| {
                let shapeless = texts.robot.contains_key("payload")
                    && !texts.robot.contains_key("waive_inertia")
                    && !texts.robot.contains_key("balancer");
                let stiff = key("drive.*.gearbox.stiffness", 4.0);
                let large = both(urdf("origin", "xyz", 3.0), urdf("limit", "effort", 4.0));
                shapeless && links(texts).is_empty() && stiff(texts) && large(texts)
            }),
        ),
    ]
}

#[test]
fn slips_are_told_and_plausible_robots_are_not() {
    let (mut made, mut missed) = (0, Vec::new());
    let (mut tried, mut false_alarms) = (0, Vec::new());
    for name in ROBOTS {
        let place = Place::new(name);
        let shipped = place.told(&place.texts);
        if !shipped[0].is_empty() {
            false_alarms.push(format!("{name} as shipped: {shipped:?}"));
        }
        for (what, change, codes) in slips() {
            let mut texts = place.texts.clone();
            if !change(&mut texts) {
                continue;
            }
            made += 1;
            let told = place.told(&texts);
            // Statics has no motion; an error that stops both counts too.
            let stops = |c: &String| c.starts_with("error") || c == "robot-file" || c == "no-equilibrium";
            let heard = |told: &BTreeSet<String>| told.iter().any(|c| codes.contains(&c.as_str()) || stops(c));
            let heard = heard(&told[0]) && (codes.contains(&"motion-effort") || heard(&told[1]));
            if !heard {
                missed.push(format!("{name}: {what}: {told:?}"));
            }
        }
        for (what, change) in harmless() {
            let mut texts = place.texts.clone();
            if !change(&mut texts) {
                continue;
            }
            tried += 1;
            for (told, before) in place.told(&texts).iter().zip(&shipped) {
                if !told.is_subset(before) {
                    false_alarms.push(format!("{name}: {what}: {told:?}"));
                }
            }
        }
    }
    let told = made - missed.len();
    println!("told {told} of {made} slips, {} false alarms in {tried} harmless changes", false_alarms.len());
    missed.iter().for_each(|missed| println!("missed: {missed}"));
    assert_eq!(false_alarms, [""; 0]);
    // Gear stiffnesses of the arm on the motor side are lower by the ratio squared; a tool of 10 m
    // is within three times the reach of the large arm. The fifth gear of kr210 rotates a quarter
    // as far as the others under their torques: in N m/deg it rotates 14.7 times as far, and a gear
    // of kr500 with half the stiffness, which is plausible, 15 times.
    let known = [
        ("abb_three_mass/", "gears in N mm/rad"),
        ("kr300/", "tcp in cm"),
        ("kr210/", "one gear in N m/deg"),
        ("kr210_identified/", "one gear in N m/deg"),
    ];
    let is_known =
        |missed: &String| known.iter().any(|(robot, what)| missed.starts_with(robot) && missed.contains(what));
    assert!(missed.iter().all(is_known), "{missed:#?}");
    assert!(made > 200 && tried > 180, "{made} {tried}");
}

/// Every kind of the catalogue is on the page, and the page lists none that does not exist in the
/// program.
#[test]
fn the_page_lists_the_catalogue() {
    let page = std::fs::read_to_string(project("docs/caveats.md")).unwrap();
    let read = |name: &str| std::fs::read_to_string(project("crates").join(name)).unwrap();
    let source = [
        "run/flexarm-run/src/caveat/kinds.rs",
        "run/flexarm-run/src/caveat/kinds_of_use.rs",
        "studies/flexarm-chatter/src/caveats.rs",
        "studies/flexarm-identify/src/doubts.rs",
    ]
    .map(read)
    .concat();
    let codes = source.split("CaveatKind::").skip(1).filter_map(|rest| rest.split_once("(\n").map(|(_, rest)| rest));
    let codes: Vec<&str> =
        codes.map(|rest| rest.trim_start().trim_start_matches('"').split('"').next().unwrap()).collect();
    assert!(codes.len() > 50, "{codes:?}");
    for code in &codes {
        assert!(page.contains(&format!("`{code}`")), "{code} is not in docs/caveats.md");
    }
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `")?.split(" |").next());
    let named = rows.flat_map(|cell| cell.split(", ")).map(|code| code.trim_matches('`'));
    for code in named {
        let said = [
            "gravity-direction",
            "no-payload",
            "no-effect",
            "uniform-mass",
            "second-order-unknown",
            "euler-chain",
            "held-joints",
            // In crates/run/flexarm-linkmaker.
            "link-sound",
            "link-density",
            "interface-size",
            // In crates/motion/flexarm-motion-io.
            "motion-topic",
            "motion-messages",
            "motion-dropped-joints",
            "motion-clock",
            "motion-stamps",
            "motion-velocities",
            "motion-positions",
            "motion-ends",
            "motion-start",
            "motion-cut",
        ]
        .contains(&code);
        assert!(said || codes.contains(&code), "{code} is no code of the program");
    }
}

/// The arm spins up to 8 rad/s; without stiffening by load, modal links are 3.4 % off.
#[test]
fn modal_links_that_spin_fast_without_stiffening_by_load_are_reported() {
    let robot = Robot::load(project("tests/benchmarks/two_link/two_link_30.toml")).unwrap();
    let run = |motion: &str, links, stiffening: bool| {
        let mut robot = robot.clone();
        robot.flexible_links.iter_mut().for_each(|link| link.choices.geometric = stiffening);
        let motion = Motion::load(project("tests/benchmarks/two_link").join(motion), &robot).unwrap();
        let modelling =
            Modelling { links, modes: Some(2).filter(|_| links == LinkModel::Modal), ..Modelling::default() };
        let options = RunOptions { step_s: 1e-3, modelling, ..RunOptions::default() };
        let summary = robot.flexible(modelling).unwrap().simulate(Scenario::new(motion), &options).unwrap().summary;
        summary.caveats.into_iter().filter(|caveat| caveat.code == "fast-spin").collect::<Vec<_>>()
    };
    let found = run("spin.csv", LinkModel::Modal, false);
    println!("{found:?}");
    assert_eq!(found.len(), 2);
    assert_eq!(run("spin.csv", LinkModel::Modal, true), []);
    assert_eq!(run("spin.csv", LinkModel::Lumped, false), []);
    assert_eq!(run("slew.toml", LinkModel::Modal, false), []);
}
