//! Invariants and effects of the substitution by lumped links.

use approx::assert_relative_eq;
use flexarm_fem::{BeamLink, BeamTheory, Material, Section};
use flexarm_flexlink::*;
use flexarm_kinematics::*;
use nalgebra::{DVector, Matrix3, Vector3, Vector6, vector};

const L: f64 = 0.8;

/// Clamped beam without gravity, with a tip frame at its end.
fn cantilever(split: f64) -> (Mechanism, FlexibleLink) {
    let mut arm = Mechanism::new("cantilever");
    arm.gravity = Vector3::zeros();
    arm.links.push(Link { name: "clamp".into(), inertia: None });
    let inertia = LinkInertia { mass: 4.0, com: vector![0.4, 0.0, 0.0], inertia_com: Matrix3::identity() * 0.3 };
    arm.links.push(Link { name: "beam".into(), inertia: Some(inertia) });
    arm.links.push(Link { name: "tip".into(), inertia: None });
    arm.joints.push(Joint::new("root", JointKind::Continuous(Vector3::z_axis()), "clamp", "beam", Pose::identity()));
    arm.joints.push(Joint::new("end", JointKind::Fixed, "beam", "tip", Pose::translation(L, 0.0, 0.0)));
    let section = Section::Box { width: 0.05, height: 0.08, wall: 0.004 };
    let mut beam = BeamLink::new("beam", section, Material::STEEL, L);
    beam.theory = BeamTheory::EulerBernoulli;
    beam.split_fraction = split;
    (arm, FlexibleLink::new("beam", beam.reduce().expect("a beam")))
}

/// Truth: F l³/(3EI), F l²/(2EI), M l²/(2EI), M l/(EI), F l/(EA), T l/(GJ) for any position of the
/// split; measured 2e-15.
#[test]
fn tip_of_the_substituted_link_moves_as_the_cantilever_does() {
    let (steel, section) = (Material::STEEL, Section::Box { width: 0.05, height: 0.08, wall: 0.004 });
    let p = section.properties(steel.nu).expect("a section");
    let (EA, GJ, EI_y, EI_z) = (steel.E * p.A, steel.shear_modulus() * p.J, steel.E * p.I_y, steel.E * p.I_z);
    for split in [0.2, 0.5, 0.7] {
        let (arm, flexible) = cantilever(split);
        let substituted = substitute(&arm, &[flexible]).expect("fits");
        let model = Model::new(&substituted.mechanism).expect("a tree");
        let mut data = Data::new(&model);
        let tip = model.frame("tip").expect("there").clone();
        let q = DVector::zeros(model.nv());
        forward_kinematics(&model, &mut data, &q);
        let mut J = nalgebra::Matrix6xX::zeros(model.nv());
        frame_jacobian(&model, &data, &tip, &mut J);
        let J_e = J.fixed_columns::<6>(1).into_owned();
        let C = J_e * substituted.spans[0].joints[0].K_S.try_inverse().expect("stiff") * J_e.transpose();
        let bend = |EI: f64| (L.powi(3) / (3.0 * EI), L * L / (2.0 * EI), L / EI);
        let ((ty, cy, ry), (tz, cz, rz)) = (bend(EI_z), bend(EI_y));
        let truth = [
            Vector6::new(L / EA, 0.0, 0.0, 0.0, 0.0, 0.0),
            Vector6::new(0.0, ty, 0.0, 0.0, 0.0, cy),
            Vector6::new(0.0, 0.0, tz, 0.0, -cz, 0.0),
            Vector6::new(0.0, 0.0, 0.0, L / GJ, 0.0, 0.0),
            Vector6::new(0.0, 0.0, -cz, 0.0, rz, 0.0),
            Vector6::new(0.0, cy, 0.0, 0.0, 0.0, ry),
        ];
        for (load, u) in truth.iter().enumerate() {
            assert_relative_eq!(C.column(load).into_owned(), *u, epsilon = 1e-10 * u.amax());
        }
    }
}

/// At zero elastic coordinates, frames, mass matrix and gravity torques equal those of the rigid
/// robot; measured 1e-14.
#[test]
fn undeformed_robot_is_the_rigid_robot() {
    let (mut arm, mut flexible) = cantilever(0.4);
    arm.gravity = vector![0.5, -9.0, 2.0];
    flexible.parts = Parts::FromLink(0.4);
    let substituted = substitute(&arm, &[flexible]).expect("fits");
    let (rigid, soft) = (Model::new(&arm).expect("a tree"), Model::new(&substituted.mechanism).expect("a tree"));
    let (mut d1, mut d2) = (Data::new(&rigid), Data::new(&soft));
    let q = DVector::from_element(1, 0.7);
    let mut full = DVector::zeros(7);
    full[0] = 0.7;
    assert_relative_eq!(mass_matrix(&rigid, &mut d1, &q)[0], mass_matrix(&soft, &mut d2, &full)[0], epsilon = 1e-12);
    assert_relative_eq!(
        gravity_forces(&rigid, &mut d1, &q)[0],
        gravity_forces(&soft, &mut d2, &full)[0],
        epsilon = 1e-12
    );
    forward_kinematics(&rigid, &mut d1, &q);
    forward_kinematics(&soft, &mut d2, &full);
    for name in ["beam", "tip"] {
        let (a, b) = (d1.X_WF(rigid.frame(name).expect("there")), d2.X_WF(soft.frame(name).expect("there")));
        assert_relative_eq!(a, b, epsilon = 1e-14);
    }
}

/// Without the coupling terms, a split at 0.3 of the beam makes the tip 24 % too soft; the full 6x6
/// gives l³/(3EI).
#[test]
fn dropped_coupling_is_wrong_by_tens_of_per_cent() {
    let (arm, flexible) = cantilever(0.3);
    let deflection = |flexible: &FlexibleLink| {
        let substituted = substitute(&arm, std::slice::from_ref(flexible)).expect("fits");
        let C = substituted.spans[0].joints[0].K_S.try_inverse().expect("stiff");
        let r = 0.7 * L;
        let Ad = adjoint(&Pose::translation(-r, 0.0, 0.0));
        (Ad * C * Ad.transpose())[(1, 1)]
    };
    let full = deflection(&flexible);
    let dropped = deflection(&FlexibleLink { coupling: false, ..flexible });
    let error = dropped / full - 1.0;
    assert!(error.abs() > 0.1, "{error}");
}

/// Every invalid request is rejected with the name of the link and the available names.
#[test]
fn wrong_requests_are_refused_by_name() {
    let (arm, flexible) = cantilever(0.5);
    let refuse = |change: &dyn Fn(&mut FlexibleLink)| {
        let mut wrong = flexible.clone();
        change(&mut wrong);
        substitute(&arm, &[wrong]).map(|_| ()).expect_err("refused").to_string()
    };
    assert!(refuse(&|f| f.link = "boom".into()).contains("boom"));
    assert!(refuse(&|f| f.distal = Some("elbow".into())).contains("elbow"));
    assert!(refuse(&|f| f.reduced.X_LB = Pose::translation(800.0, 0.0, 0.0)).contains("check units"));
    let twice = substitute(&arm, &[flexible.clone(), flexible.clone()]).map(|_| ()).expect_err("refused");
    assert!(twice.to_string().contains("twice"));
}

/// Truth: the rigid robot, value by value. Two joints move to the distal half of the link, the two
/// between them stay, and one of these gets a gearbox: their order in the tree changes, the order
/// of the coordinates does not. Measured 5e-15 of the maximum.
#[test]
fn joints_keep_their_order_whichever_half_of_a_link_carries_them() {
    let (mut arm, mut flexible) = cantilever(0.5);
    arm.gravity = vector![0.5, -9.0, 2.0];
    arm.joints.retain(|joint| joint.name != "end");
    for (k, (name, x)) in [("near_1", 0.1), ("far_1", L), ("near_2", 0.2), ("far_2", 0.6)].into_iter().enumerate() {
        let link = if name == "far_1" { "tip".to_owned() } else { format!("{name}_link") };
        let inertia =
            LinkInertia { mass: 1.0 + k as f64, com: vector![0.1, 0.2, 0.05], inertia_com: Matrix3::identity() * 0.1 };
        match arm.links.iter_mut().find(|own| own.name == link) {
            Some(own) => own.inertia = Some(inertia),
            None => arm.links.push(Link { name: link.clone(), inertia: Some(inertia) }),
        }
        let axis = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()][k % 3];
        arm.joints.push(Joint::new(name, JointKind::Continuous(axis), "beam", link, Pose::translation(x, 0.02, 0.0)));
    }
    flexible.distal = Some("far_1".into());
    flexible.parts = Parts::FromLink(0.5);
    flexible.reduced.X_LB = Pose::translation(L, 0.02, 0.0);
    let mut substituted = substitute(&arm, &[flexible]).expect("fits");
    let gear = Gearbox { joint: "near_1".into(), stiffness: GearStiffness::Axis(1e4), seat: None };
    insert_gearboxes(&mut substituted.mechanism, &[gear]).expect("fits");
    let (rigid, soft) = (Model::new(&arm).expect("a tree"), Model::new(&substituted.mechanism).expect("a tree"));
    let names = |model: &Model| -> Vec<String> {
        model.coordinates()[..model.n_actuated()].iter().map(|c| c.joint.clone()).collect()
    };
    assert_eq!(names(&soft), names(&rigid));
    assert_eq!(names(&rigid), ["root", "near_1", "far_1", "near_2", "far_2"]);

    let n = rigid.nv();
    let (mut d1, mut d2) = (Data::new(&rigid), Data::new(&soft));
    let q = DVector::from_fn(n, |k, _| 0.3 + 0.2 * k as f64);
    let full = DVector::from_fn(soft.nv(), |k, _| if k < n { q[k] } else { 0.0 });
    let (M1, M2) = (mass_matrix(&rigid, &mut d1, &q).clone_owned(), mass_matrix(&soft, &mut d2, &full).clone_owned());
    let size = M1.amax();
    assert_relative_eq!(M2.view((0, 0), (n, n)).into_owned(), M1, epsilon = 1e-13 * size);
    let (g1, g2) = (gravity_forces(&rigid, &mut d1, &q), gravity_forces(&soft, &mut d2, &full));
    assert_relative_eq!(g2.rows(0, n).into_owned(), g1, epsilon = 1e-13 * g1.amax());
    forward_kinematics(&rigid, &mut d1, &q);
    forward_kinematics(&soft, &mut d2, &full);
    for link in &arm.links {
        let (a, b) = (rigid.frame(&link.name).expect("there"), soft.frame(&link.name).expect("there"));
        assert_relative_eq!(d1.X_WF(a), d2.X_WF(b), epsilon = 1e-13);
    }
}
