//! Mistakes in robot files, URDFs, motions and loads: counts those reported, and checks that
//! plausible changes are not reported.
//!
//! A mutation changes one thing in a shipped robot; `check` and `statics` then have to warn (or
//! refuse) with the corresponding code. A harmless change must not add a warning to those of the
//! shipped robot.

mod changes;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use changes::*;
use flexarm_run::{LinkModel, Modelling, Motion, Robot, RunOptions, Scenario};
use toml::Value;

const ROBOTS: [&str; 15] = [
    "kr210/robot.toml",
    "kr210/links.toml",
    "kr210/drives.toml",
    "kr210/beams.toml",
    "kr210_identified/loaded.toml",
    "kr500_identified/loaded.toml",
    "manutec_r3/robot.toml",
    "test/reference_arm/robot.toml",
    "test/one_beam/robot.toml",
    "test/three_beams/robot.toml",
    "test/lower_arm/robot.toml",
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
        (
            "friction that begins at 4 rad/s",
            set("drive.*.friction", "{ coulomb = 1.0, regularisation = 4.0 }"),
            &["friction-smoothing"],
        ),
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
        ("gear damping of 0.03", set("drive.*.gearbox.damping", "0.03"), &["gear-damping", "no-damping"]),
        ("counterbalance in bar", key("balancer.0.gas.pressure", 1e-5), &["balancer-weak"]),
        ("modal damping of 3e-4", set("flexible_link.*.damping", "{ modal = 3e-4 }"), &["damping-ratio"]),
        ("calibration in degrees", calibrated("zero", -0.18), &["calibration"]),
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
    // Gear stiffnesses of the arm on the motor side are lower by the ratio squared, its speeds higher
    // by the ratio, so that such friction and damping are plausible there. A tool of 10 m is within
    // three times the reach of the large arm. The fifth gear of kr210 rotates a quarter as far as
    // the others under their torques: in N m/deg it rotates 14.7 times as far, and a gear of kr500
    // with half the stiffness, which is plausible, 15 times.
    let known = [
        ("abb_three_mass/", "gears in N mm/rad"),
        ("abb_three_mass/", "friction that begins at 4 rad/s"),
        ("abb_three_mass/", "gear damping of 0.03"),
        ("kr300/", "tcp in cm"),
        ("kr210/", "one gear in N m/deg"),
        ("kr210_identified/", "one gear in N m/deg"),
    ];
    let is_known =
        |missed: &String| known.iter().any(|(robot, what)| missed.starts_with(robot) && missed.contains(what));
    assert!(missed.iter().all(is_known), "{missed:#?}");
    assert!(made > 200 && tried > 180, "{made} {tried}");
}

/// Every code that the program gives a caveat is on the page, and the page lists no other.
#[test]
fn the_page_lists_the_codes_of_the_program() {
    let page = std::fs::read_to_string(project("docs/caveats.md")).unwrap();
    let source = program_source(&project("crates"));
    let makers = ["Finding::warning(", "FindingKind::warning(", "FindingKind::note("];
    let calls = makers.iter().flat_map(|maker| source.split(maker).skip(1));
    let codes: BTreeSet<&str> =
        calls.filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next()).collect();
    assert!(codes.len() > 100, "{codes:?}");
    for code in &codes {
        assert!(page.contains(&format!("`{code}`")), "{code} is not in docs/caveats.md");
    }
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `")?.split(" |").next());
    for code in rows.flat_map(|cell| cell.split(", ")).map(|code| code.trim_matches('`')) {
        assert!(source.contains(&format!("\"{code}\"")), "{code} is no code of the program");
    }
}

/// Text of the sources below a folder, without tests.
fn program_source(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let text = |path: PathBuf| match path.extension() {
        None if path.is_dir() && !path.ends_with("tests") => program_source(&path),
        Some(end) if end == "rs" => std::fs::read_to_string(&path).unwrap(),
        _ => String::new(),
    };
    entries.map(text).collect()
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
        let options = RunOptions { step_s: 1e-3, ..RunOptions::default() };
        let summary = robot.model(&modelling).unwrap().simulate(Scenario::new(motion), &options).unwrap().summary;
        summary.caveats.into_iter().filter(|caveat| caveat.code == "fast-spin").collect::<Vec<_>>()
    };
    let found = run("spin.csv", LinkModel::Modal, false);
    println!("{found:?}");
    assert_eq!(found.len(), 2);
    assert_eq!(run("spin.csv", LinkModel::Modal, true), []);
    assert_eq!(run("spin.csv", LinkModel::Lumped, false), []);
    assert_eq!(run("slew.toml", LinkModel::Modal, false), []);
}
