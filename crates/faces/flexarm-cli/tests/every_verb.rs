//! Every command that takes a robot says of it what `check` says. A new command has to be listed here.

use flexarm_cli::internals::command;

use crate::common::{Place, ROBOT};

const STUDY: &str = "format = 1\nrobot = \"robot.toml\"\nmotion = \"swing.toml\"\nmetrics = [\"peak = tcp.peak_m\"]\n\
                     [options]\nstep = 0.002\n[[parameter]]\npath = \"motion.speed\"\nvalues = [0.5, 1.0]\n";

/// Commands with a robot, with the arguments of a small use of each.
const WITH_ROBOT: [(&str, &[&str]); 14] = [
    ("compare", &["robot.toml", "swing.toml", "--no-files"]),
    ("run", &["robot.toml", "swing.toml", "-o", "logged"]),
    ("inspect", &["robot.toml"]),
    ("motion", &["swing.toml", "robot.toml"]),
    ("statics", &["robot.toml"]),
    ("modes", &["robot.toml"]),
    ("response", &["robot.toml", "--points", "10"]),
    ("lobes", &["robot.toml", "--tool", "endmill_20mm", "--rpm", "8000"]),
    ("map", &["robot.toml", "--over", "swing=-1:1:3"]),
    ("sweep", &["study.toml", "-o", "swept"]),
    ("sensitivity", &["robot.toml", "swing.toml", "--by", "payload.mass"]),
    ("identify", &["robot.toml", "--plan", "3"]),
    ("compensate", &["robot.toml", "swing.toml", "--iterations", "1", "-o", "compensated"]),
    ("export-fmu", &["robot.toml", "-o", "plant.fmu", "--library", "robot.toml"]),
];

/// Commands without a robot, or whose robot is that of a recording or of a description.
const OTHERS: [&str; 13] = [
    "check",
    "report",
    "convert",
    "view",
    "serve",
    "new",
    "format",
    "reduce",
    "import",
    "export",
    "completions",
    "man",
    "help",
];

#[test]
fn every_command_with_a_robot_says_what_check_says() {
    let known = |name: &str| WITH_ROBOT.iter().any(|(own, _)| *own == name) || OTHERS.contains(&name);
    let program = command();
    let unknown: Vec<&str> = program.get_subcommands().map(|of| of.get_name()).filter(|name| !known(name)).collect();
    assert_eq!(unknown, [""; 0], "say here whether these commands take a robot");

    let place = Place::new();
    // Gravity of ten times the earth's, a rubber beam, a payload in millimetres.
    let odd = ROBOT
        .replace("-9.81", "-98.1")
        .replace("\"aluminium\"", "{ E = 70e9, nu = 0.499, rho = 2700.0 }")
        .replace("[[flexible_link]]", "payload = { mass = 0.01, com = [0.0, 0.0, 250.0] }\n\n[[flexible_link]]");
    place.write("robot.toml", odd);
    place.write("study.toml", STUDY);
    let findings = place.json(&["check", "robot.toml"]);
    let told: Vec<String> = (findings["findings"].as_array().unwrap().iter())
        .filter(|found| ["gravity", "poisson", "far"].contains(&found["code"].as_str().unwrap()))
        .map(|found| found["message"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(told.len(), 3, "{findings}");
    for (command, arguments) in WITH_ROBOT {
        let arguments: Vec<&str> = [command].iter().chain(arguments).copied().collect();
        let warnings: Vec<String> = (place.json(&arguments)["warnings"].as_array().unwrap().iter())
            .map(|text| text.as_str().unwrap().to_owned())
            .collect();
        for told in &told {
            assert!(
                warnings.iter().any(|text| text.contains(told.as_str())),
                "{command} does not say {told:?}: {warnings:?}"
            );
        }
    }
}

#[test]
fn an_fmu_warns_of_its_step_and_its_pose() {
    let place = Place::new();
    let export = |more: &[&str]| {
        let fixed = ["export-fmu", "robot.toml", "-o", "plant.fmu", "--force", "--library", "robot.toml"];
        let arguments: Vec<&str> = fixed.iter().chain(more).copied().collect();
        place.json(&arguments)["warnings"].to_string()
    };
    assert_eq!(export(&[]), "[]");
    assert!(export(&["--step", "1"]).contains("period"), "{}", export(&["--step", "1"]));
    assert!(export(&["--at", "90"]).contains("degrees?"), "{}", export(&["--at", "90"]));
}
