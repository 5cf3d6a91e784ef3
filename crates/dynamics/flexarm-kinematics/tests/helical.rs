//! Helical joints against the closed form of a nut on a spindle, and against a rotation with a
//! coupled translation.

use std::f64::consts::TAU;

use flexarm_kinematics::*;
use flexarm_testkit::{Draw, random_state};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6xX, Unit, Vector3};

const MASS: f64 = 2.5;
const I_ZZ: f64 = 0.03;
/// Distance of the centre of mass from the spindle (m).
const OFFSET: f64 = 0.2;

/// Body on a vertical spindle that descends as it turns.
fn nut(pitch: f64) -> Model {
    let mut tree = Mechanism::new("nut");
    let com = Vector3::new(OFFSET, 0.0, 0.1);
    let inertia_com = Matrix3::from_diagonal(&Vector3::new(0.05, 0.04, I_ZZ));
    tree.links.push(Link { name: "base".into(), inertia: None });
    tree.links.push(Link { name: "nut".into(), inertia: Some(LinkInertia { mass: MASS, com, inertia_com }) });
    let kind = JointKind::Helical { axis: Vector3::z_axis(), pitch };
    tree.joints.push(Joint::new("thread", kind, "base", "nut", Pose::translation(0.0, 0.0, 1.0)));
    Model::new(&tree).unwrap()
}

/// Truth: energy ½ (I_zz + m r² + m p²) q̇² + m g p q, hence q̈ = -m g p/(I_zz + m r² + m p²), at
/// any angle and speed.
#[test]
fn a_nut_under_gravity_turns_with_constant_acceleration() {
    let mut worst = [0.0f64; 3];
    for pitch in [0.02, -0.05, 0.4] {
        let model = nut(pitch);
        let mut data = Data::new(&model);
        let inertia = I_ZZ + MASS * OFFSET * OFFSET + MASS * pitch * pitch;
        let weight = MASS * 9.81 * pitch;
        for (q, qdot) in [(0.0, 0.0), (1.3, -4.0), (-7.0, 20.0)] {
            let state = State { q: DVector::from_element(1, q), qdot: DVector::from_element(1, qdot) };
            let roles = Roles::all_free(&model);
            let qddot = forward_dynamics(&model, &mut data, &state, &roles, &DVector::zeros(1))[0];
            let M = mass_matrix(&model, &mut data, &state.q)[(0, 0)];
            let hold = gravity_forces(&model, &mut data, &state.q)[0];
            let found = [qddot * inertia / -weight, M / inertia, hold / weight];
            for (worst, ratio) in worst.iter_mut().zip(found) {
                *worst = worst.max((ratio - 1.0).abs());
            }
        }
    }
    eprintln!("acceleration, inertia, weight: {:.0e} {:.0e} {:.0e}", worst[0], worst[1], worst[2]);
    assert!(worst.iter().all(|error| *error < 1e-12), "{worst:?}"); // measured 2e-16
}

/// Truth: one turn advances by one lead and restores the orientation.
#[test]
fn a_turn_advances_by_the_lead() {
    let lead = 0.02;
    let model = nut(lead / TAU);
    let mut data = Data::new(&model);
    for turns in [1.0, -3.0] {
        forward_kinematics(&model, &mut data, &DVector::from_element(1, turns * TAU));
        let X = data.X_WB[1];
        let off = (X.translation.vector - Vector3::z() * (1.0 + turns * lead)).norm();
        let turned = (X.rotation.matrix() - Matrix3::identity()).amax();
        eprintln!("{turns} turns: {off:.0e} m, {turned:.0e}");
        assert!(off < 1e-14 && turned < 1e-14); // measured 0 and 7e-16
    }
}

/// Chain of revolute, prismatic and helical joints. With `as_pairs`, helical joints become a
/// rotation and a mimicking translation with a massless link between them.
fn chain(seed: u64, as_pairs: bool) -> Mechanism {
    let mut draw = Draw(seed);
    let mut tree = Mechanism::new("chain");
    tree.links.push(Link { name: "base".into(), inertia: None });
    for i in 0..6 {
        let axis = Unit::new_normalize(draw.vector(1.0) + Vector3::new(0.01, 0.02, 0.5));
        let (X_PJ, inertia, pitch) = (draw.pose(0.4), draw.inertia(), 0.3 * draw.signed());
        let (name, parent) = (format!("j{i}"), tree.links.last().unwrap().name.clone());
        let (link, between) = (format!("l{i}"), format!("between{i}"));
        match (i % 3, as_pairs) {
            (1, true) => {
                tree.joints.push(Joint::new(&name, JointKind::Revolute(axis), parent, &between, X_PJ));
                tree.links.push(Link { name: between.clone(), inertia: None });
                let slide = JointKind::Prismatic(axis);
                let mut slide = Joint::new(format!("{name}_slide"), slide, between, &link, Pose::identity());
                slide.mimic = Some(Mimic { joint: name, ratio: pitch, offset: 0.0 });
                tree.joints.push(slide);
            }
            (1, false) => {
                tree.joints.push(Joint::new(name, JointKind::Helical { axis, pitch }, parent, &link, X_PJ));
            }
            (0, _) => tree.joints.push(Joint::new(name, JointKind::Revolute(axis), parent, &link, X_PJ)),
            _ => tree.joints.push(Joint::new(name, JointKind::Prismatic(axis), parent, &link, X_PJ)),
        }
        tree.links.push(Link { name: link, inertia: Some(inertia) });
    }
    tree
}

/// Second algorithm: the same mechanism with a translation that mimics a rotation, for all
/// recursions.
#[test]
fn a_helical_joint_is_a_rotation_with_a_translation_that_follows() {
    let mut worst = [0.0f64; 6];
    for seed in 0..20 {
        let [model, pairs] = [false, true].map(|as_pairs| Model::new(&chain(seed, as_pairs)).unwrap());
        assert_eq!((model.nv(), pairs.nv()), (6, 6));
        let mut draw = Draw(seed ^ 0xF00D);
        let state = random_state(&model, &mut draw);
        let qddot = DVector::from_fn(6, |_, _| 3.0 * draw.signed());
        let results = |model: &Model| {
            let mut data = Data::new(model);
            let tau = inverse_dynamics(model, &mut data, &state, &qddot).clone();
            let M = mass_matrix(model, &mut data, &state.q).clone();
            let roles = Roles::all_free(model);
            let back = forward_dynamics(model, &mut data, &state, &roles, &tau).clone();
            forward_kinematics_velocity(model, &mut data, &state);
            let (mut J, mut Jdot) = (Matrix6xX::zeros(6), Matrix6xX::zeros(6));
            let tip = model.frame("l5").unwrap();
            frame_jacobian(model, &data, tip, &mut J);
            frame_jacobian_derivative(model, &data, &state, tip, &mut Jdot);
            let X = data.X_WF(tip).to_homogeneous();
            let dense = |rows: usize, columns: usize, values: &[f64]| DMatrix::from_column_slice(rows, columns, values);
            [
                dense(6, 1, tau.as_slice()),
                M,
                dense(6, 1, back.as_slice()),
                dense(4, 4, X.as_slice()),
                dense(6, 6, J.as_slice()),
                dense(6, 6, Jdot.as_slice()),
            ]
        };
        for ((worst, found), truth) in worst.iter_mut().zip(results(&model)).zip(results(&pairs)) {
            *worst = worst.max((found - &truth).amax() / truth.amax());
        }
    }
    eprintln!(
        "forces, mass matrix, accelerations, pose, Jacobian, its rate: {}",
        worst.map(|w| format!("{w:.0e}")).join(", ")
    );
    let bounds = [1e-13, 1e-13, 1e-11, 1e-14, 1e-13, 1e-13]; // measured 1e-15, 4e-16, 3e-14, 2e-16, 5e-16, 7e-16
    assert!(worst.iter().zip(bounds).all(|(error, bound)| *error < bound), "{worst:?}");
}
