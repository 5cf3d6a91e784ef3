//! URDF reader and recursions against stored results of Pinocchio (tests/golden/*.json,
//! tools/golden_pinocchio.py).
#![allow(non_snake_case, reason = "monogram notation")]

use std::path::{Path, PathBuf};

use flexarm_kinematics::*;
use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3};
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the workspace").to_owned()
}

fn vector(v: &Value) -> DVector<f64> {
    DVector::from_iterator(
        v.as_array().expect("a list").len(),
        v.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")),
    )
}

fn matrix(v: &Value) -> DMatrix<f64> {
    let rows: Vec<DVector<f64>> = v.as_array().expect("rows").iter().map(vector).collect();
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// Largest difference over the largest entry, put back into our coordinate order by `order`.
fn close(what: &str, found: &DMatrix<f64>, truth: &DMatrix<f64>) {
    let error = (found - truth).amax() / truth.amax().max(1e-12);
    assert!(error < 1e-10, "{what}: relative difference {error:.1e}");
}

fn column(v: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(v.len(), 1, v.as_slice())
}

/// Runs every stored configuration; measured at most 4e-14 over all quantities and robots.
fn check(name: &str) {
    let text = std::fs::read_to_string(root().join(format!("tests/golden/{name}.json"))).expect("golden file");
    let golden: Value = serde_json::from_str(&text).expect("valid json");
    let urdf = root().join(golden["urdf"].as_str().expect("a path"));
    let robot = flexarm_urdf::read_urdf(&urdf, &Default::default()).expect("readable");
    let mut mechanism = robot.mechanism;
    mechanism.gravity = Vector3::from_iterator(vector(&golden["gravity"]).iter().copied());
    for (name, lead) in golden["leads"].as_object().into_iter().flatten() {
        let joint = mechanism.joints.iter_mut().find(|j| j.name == *name).expect("the joint");
        let JointKind::Revolute(axis) = joint.kind else { panic!("{name} does not turn") };
        joint.kind = JointKind::Helical { axis, pitch: lead.as_f64().expect("m") / std::f64::consts::TAU };
    }
    let model = Model::new(&mechanism).expect("a tree");
    let mut data = Data::new(&model);
    let names: Vec<&str> = golden["joints"].as_array().expect("names").iter().filter_map(Value::as_str).collect();
    assert_eq!(names.len(), model.nv());
    // our coordinate k is their index order[k]
    let order: Vec<usize> =
        model.coordinates().iter().map(|c| names.iter().position(|n| *n == c.joint).expect("same joints")).collect();
    let ours = |v: &Value| {
        let v = vector(v);
        DVector::from_iterator(order.len(), order.iter().map(|&i| v[i]))
    };
    let columns = |v: &Value| {
        let M = matrix(v);
        DMatrix::from_fn(M.nrows(), order.len(), |i, j| M[(i, order[j])])
    };
    let frame = model.frame(golden["frame"].as_str().expect("a name")).expect("there").clone();
    let moving = golden["moving_mass"].as_f64().expect("a number");
    assert!((model.moving_mass() / moving - 1.0).abs() < 1e-12);

    let cases = golden["cases"].as_array().expect("cases");
    assert!(cases.len() >= 3);
    for case in cases {
        let state = State { q: ours(&case["q"]), qdot: ours(&case["qd"]) };
        let qddot = ours(&case["qdd"]);
        close("tau", &column(inverse_dynamics(&model, &mut data, &state, &qddot)), &column(&ours(&case["tau"])));
        close(
            "bias",
            &column(nonlinear_effects(&model, &mut data, &state)),
            &column(&ours(&case["nonlinear_effects"])),
        );
        close("gravity", &column(gravity_forces(&model, &mut data, &state.q)), &column(&ours(&case["gravity_torque"])));
        let M = columns(&case["mass_matrix"]);
        let M = DMatrix::from_fn(M.ncols(), M.ncols(), |i, j| M[(order[i], j)]);
        close("mass matrix", mass_matrix(&model, &mut data, &state.q), &M);
        let forward = &case["forward"];
        let found = forward_dynamics(&model, &mut data, &state, &Roles::all_free(&model), &ours(&forward["tau"]));
        close("forward dynamics", &column(found), &column(&ours(&forward["qdd"])));

        forward_kinematics_velocity(&model, &mut data, &state);
        let X = data.X_WF(&frame);
        close(
            "position",
            &column(&DVector::from_column_slice(X.translation.vector.as_slice())),
            &column(&vector(&case["frame"]["translation"])),
        );
        let R = DMatrix::from_fn(3, 3, |i, j| X.rotation.matrix()[(i, j)]);
        close("rotation", &R, &matrix(&case["frame"]["rotation"]));
        let mut J = Matrix6xX::zeros(model.nv());
        frame_jacobian(&model, &data, &frame, &mut J);
        close("jacobian", &DMatrix::from_fn(6, model.nv(), |i, j| J[(i, j)]), &columns(&case["jacobian"]));
        frame_jacobian_derivative(&model, &data, &state, &frame, &mut J);
        close("jacobian rate", &DMatrix::from_fn(6, model.nv(), |i, j| J[(i, j)]), &columns(&case["jacobian_rate"]));

        let com = center_of_mass(&model, &data);
        close("com", &column(&DVector::from_column_slice(com.as_slice())), &column(&vector(&case["com"])));
        let T = kinetic_energy(&model, &mut data, &state);
        let U = potential_energy(&model, &mut data, &state.q);
        assert!((T / case["kinetic_energy"].as_f64().expect("a number") - 1.0).abs() < 1e-10);
        let U_truth = case["potential_energy"].as_f64().expect("a number");
        assert!((U - U_truth).abs() < 1e-10 * (1.0 + U_truth.abs()));
    }
}

#[test]
fn kr210_equals_pinocchio() {
    check("kr210");
}

#[test]
fn ur10_like_arm_equals_pinocchio() {
    check("ur10_like");
}

#[test]
fn seven_axis_arm_equals_pinocchio() {
    check("seven_axis");
}

#[test]
fn branched_tree_with_prismatic_joint_equals_pinocchio() {
    check("branched");
}

#[test]
fn scara_with_a_helical_joint_equals_pinocchio() {
    check("scara");
}
