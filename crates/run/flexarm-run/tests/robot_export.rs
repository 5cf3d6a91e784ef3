//! Arms for other simulators. `tools/check_mujoco.py` compares them in MuJoCo; here are the identities
//! that need no other program.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_run::{Arm, LinkModel, Modelling, Robot, RobotExport, RobotFormat};
use nalgebra::DMatrix;

fn arm(robot: &str, links: LinkModel) -> Arc<Arm> {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots").join(robot);
    Robot::load(path).unwrap().model(&Modelling { links, ..Modelling::default() }).unwrap()
}

fn text(export: &RobotExport, k: usize) -> &str {
    str::from_utf8(&export.files[k].1).unwrap()
}

/// Values of an attribute of all elements of a kind that have it, with the element.
fn elements<'t>(text: &'t str, kind: &str) -> Vec<&'t str> {
    let open = format!("<{kind} ");
    text.split(&open).skip(1).map(|rest| rest.split('>').next().unwrap()).collect()
}

fn attribute<'t>(element: &'t str, name: &str) -> Option<&'t str> {
    element
        .split_once(&format!(" {name}=\""))
        .or_else(|| element.split_once(&format!("{name}=\"")))
        .map(|(_, rest)| rest.split('"').next().unwrap())
}

fn number(element: &str, name: &str) -> f64 {
    attribute(element, name).map_or(0.0, |text| text.parse().unwrap())
}

/// Truth: the matrices of the arm. The springs and dampers of the file, each over a sum of joints, add
/// up to them.
#[test]
fn springs_and_dampers_of_the_mjcf_add_up_to_the_matrices_of_the_arm() {
    for robot in ["kr210/robot.toml", "test/reference_arm_coupled", "kr210_identified", "test/lower_arm"] {
        let export = arm(robot, LinkModel::Lumped).export(None, RobotFormat::Mjcf).unwrap();
        let springs: serde_json::Value = serde_json::from_str(text(&export, 1)).unwrap();
        let names: Vec<&str> =
            springs["joints"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        let n = names.len();
        let place = |joint: &str| names.iter().position(|name| *name == joint);
        let mut sums = [DMatrix::<f64>::zeros(n, n), DMatrix::zeros(n, n)];
        let mjcf = text(&export, 0);
        for joint in elements(mjcf, "joint").into_iter().filter(|joint| joint.contains("type=")) {
            let Some(k) = place(attribute(joint, "name").unwrap()) else { continue };
            sums[0][(k, k)] += number(joint, "stiffness");
            sums[1][(k, k)] += number(joint, "damping");
        }
        for tendon in mjcf.split("<fixed ").skip(1) {
            let tendon = tendon.split("</fixed>").next().unwrap();
            let terms: Vec<(usize, f64)> = elements(tendon, "joint")
                .iter()
                .map(|term| (place(attribute(term, "joint").unwrap()).unwrap(), number(term, "coef")))
                .collect();
            for (sum, kind) in sums.iter_mut().zip(["stiffness", "damping"]) {
                let strength = number(tendon, kind);
                terms.iter().for_each(|(i, a)| terms.iter().for_each(|(j, b)| sum[(*i, *j)] += strength * a * b));
            }
        }
        for (sum, kind) in sums.iter().zip(["stiffness", "damping"]) {
            let rows = springs[kind].as_array().unwrap();
            let truth = DMatrix::from_fn(n, n, |i, j| rows[i][j].as_f64().unwrap());
            let scale = |i: usize, j: usize| (truth[(i, i)] * truth[(j, j)]).sqrt().max(f64::MIN_POSITIVE);
            let error = (sum - &truth).map_with_location(|i, j, x| x.abs() / scale(i, j)).max();
            println!("{robot}: {kind} off by {error:.1e} of its diagonal, bound 1e-9");
            assert!(error < 1e-9, "{robot}: {kind} {error}");
        }
    }
}

/// Truth: the mass of the model. Motors of gears have none and are joined with what they move.
#[test]
fn exported_bodies_have_the_mass_of_the_arm_and_none_that_moves_is_without() {
    let arm = arm("kr210/robot.toml", LinkModel::Lumped);
    let truth = arm.model.moving_mass();
    let mjcf = arm.export(None, RobotFormat::Mjcf).unwrap();
    let masses: Vec<f64> = elements(text(&mjcf, 0), "inertial").iter().map(|body| number(body, "mass")).collect();
    assert_eq!(masses.len(), elements(text(&mjcf, 0), "body").len());
    let error = masses.iter().sum::<f64>() / truth - 1.0;
    println!("mass off by {error:.1e}, bound 1e-12");
    assert!(error.abs() < 1e-12, "{error}");
    // The URDF is read back as a robot with the same joints, motors and elastic coordinates.
    let urdf = arm.export(None, RobotFormat::Urdf).unwrap();
    let joints = arm.model.nv();
    assert_eq!(elements(text(&urdf, 0), "joint").iter().filter(|joint| !joint.contains("fixed")).count(), joints);
}

#[test]
fn what_no_format_can_hold_is_refused_or_told() {
    let refused = |robot: &str, links| arm(robot, links).export(None, RobotFormat::Mjcf).unwrap_err().to_string();
    assert!(refused("palletiser", LinkModel::AsFiled).contains("closed loop"));
    assert!(refused("kr210/robot.toml", LinkModel::Modal).contains("modal"));
    assert!(refused("manutec_r3", LinkModel::AsFiled).contains("link_1"));
    let told =
        |robot: &str| arm(robot, LinkModel::AsFiled).export(None, RobotFormat::Mjcf).unwrap().left_out.join("; ");
    assert!(told("test/moberg_arm").contains("play") && told("test/moberg_arm").contains("friction"));
    assert!(told("kr300").contains("balancers"));
    assert_eq!(told("test/reference_arm"), "");
}
