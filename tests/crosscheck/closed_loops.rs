//! Closed loops against stored results of Pinocchio's constrained dynamics
//! (tests/golden/closed_loops.json, tools/golden_loops.py).
#![allow(non_snake_case, reason = "monogram notation")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]

use std::path::Path;

use flexarm_kinematics::*;
use nalgebra::{DVector, Vector3};
use serde_json::Value;

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn text(v: &Value) -> String {
    v.as_str().expect("a text").to_owned()
}

fn point(v: &Value) -> Pose {
    let p = numbers(v);
    Pose::translation(p[0], p[1], p[2])
}

/// The robot of the file with its loops.
fn closed(golden: &Value, root: &Path) -> Model {
    let urdf = root.join(text(&golden["urdf"]));
    let mut mechanism = flexarm_urdf::read_urdf(&urdf, &Default::default()).expect("readable").mechanism;
    mechanism.gravity = Vector3::from_row_slice(&numbers(&golden["gravity"]));
    for own in golden["loops"].as_array().expect("loops") {
        let name = text(&own["name"]);
        let ends = ["pin", "eye"].map(|end| {
            let frame = format!("{name}_{end}");
            let link = text(&own[format!("{end}_link")]);
            mechanism.joints.push(Joint::new(format!("{frame}_fix"), JointKind::Fixed, link, &frame, point(&own[end])));
            mechanism.links.push(Link { name: frame.clone(), inertia: None });
            frame
        });
        let [pin, eye] = ends;
        let dependent = [0, 1].map(|k| text(&own["dependent"][k]));
        mechanism.loops.push(LoopClosure { name, pin, axis: Vector3::y_axis(), eye, dependent, at: vec![] });
    }
    Model::new(&mechanism).expect("loops that close")
}

/// Truth: Pinocchio's constraintDynamics with point contacts, three loops of which two rest on one
/// another and none is a parallelogram. Measured: accelerations 2.8e-15 of the largest, torques
/// 1.3e-14, dependent joints 4e-15 rad, tool 3e-15 m, energies 1.2e-15.
#[test]
fn dynamics_over_three_loops_are_those_of_pinocchio() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the workspace");
    let file = std::fs::read_to_string(root.join("tests/golden/closed_loops.json")).expect("golden file");
    let golden: Value = serde_json::from_str(&file).expect("valid json");
    let model = closed(&golden, root);
    let names: Vec<&str> = golden["driven"].as_array().expect("names").iter().filter_map(Value::as_str).collect();
    // our coordinate k is their driving joint order[k]
    let order: Vec<usize> = model
        .coordinates()
        .iter()
        .map(|c| names.iter().position(|n| *n == c.joint).expect("a driving joint"))
        .collect();
    assert_eq!(order.len(), names.len());
    let loops = golden["loops"].as_array().expect("loops");
    let dependent: Vec<String> =
        loops.iter().flat_map(|l| [text(&l["dependent"][0]), text(&l["dependent"][1])]).collect();
    assert_eq!(model.dependent().iter().map(|c| c.joint.clone()).collect::<Vec<_>>(), dependent);
    let mut data = Data::new(&model);
    let mut worst = [0.0f64; 6];
    let mut see = |which: usize, off: f64| worst[which] = worst[which].max(off);
    for case in golden["cases"].as_array().expect("cases") {
        let vector = |key: &str| DVector::from_vec(numbers(&case[key]));
        let ours = |key: &str| DVector::from_iterator(order.len(), order.iter().map(|&i| vector(key)[i]));
        let state = State { q: ours("q"), qdot: ours("qd") };
        let (tau, qddot) = (ours("tau"), ours("qdd"));
        let largest = qddot.amax().max(vector("dependent_qdd").amax());
        let a = forward_dynamics(&model, &mut data, &state, &Roles::all_free(&model), &tau).clone();
        see(0, (a - &qddot).amax() / largest);
        let back = inverse_dynamics(&model, &mut data, &state, &qddot).clone();
        see(1, (back - &tau).amax() / tau.amax());
        see(2, (DVector::from_row_slice(data.dependent_values()) - vector("dependent_q")).amax());
        see(3, (DVector::from_row_slice(data.dependent_rates()) - vector("dependent_qd")).amax());
        let energy = [kinetic_energy(&model, &mut data, &state), potential_energy(&model, &mut data, &state.q)];
        let theirs = numbers(&case["energy"]);
        see(4, (energy[0] - theirs[0]).abs() / theirs[0]);
        let tool = data.X_WF(model.frame("tool0").expect("the tool"));
        see(5, (tool.translation.vector - Vector3::from_row_slice(&numbers(&case["tool"]))).amax());
    }
    let [a, tau, q, qd, e, p] = worst;
    eprintln!(
        "accelerations {a:.1e}, torques {tau:.1e}, dependent {q:.1e} rad {qd:.1e} rad/s, energy {e:.1e}, tool {p:.1e} m"
    );
    assert!(a < 1e-12 && tau < 1e-12 && q < 1e-13 && qd < 1e-12 && e < 1e-13 && p < 1e-13, "{worst:?}");
}
