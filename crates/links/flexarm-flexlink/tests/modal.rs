//! Invariants and effects of the substitution by modal links.

use std::sync::Arc;

use flexarm_fem::{BeamLink, BeamTheory, LinkDetails, Material, ModalInterface, ModalLink, RigidPart, Section};
use flexarm_flexlink::*;
use flexarm_kinematics::*;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Matrix6xX, Rotation3, Vector3, vector};

const L: f64 = 0.9;

fn inertia(mass: f64, com: Vector3<f64>, scale: f64) -> LinkInertia {
    let I = Matrix3::new(1.3, 0.1, -0.05, 0.1, 1.1, 0.08, -0.05, 0.08, 0.9) * scale;
    LinkInertia { mass, com, inertia_com: I }
}

/// Oblique beam from the link origin with a rotated section, offset from the line of the joints.
fn beam() -> BeamLink {
    let section = Section::Box { width: 0.05, height: 0.08, wall: 0.004 };
    let beam = BeamLink::new("boom", section, Material::STEEL, L);
    beam.along(vector![0.8, 0.3, 0.5], Vector3::z(), 0.4, vector![0.0, 0.02, -0.01]).expect("a direction")
}

/// Slew - boom - elbow - arm - tool, with a motor attached at either end of the boom.
fn robot(boom: LinkInertia) -> Mechanism {
    let mut robot = Mechanism::new("robot");
    robot.gravity = vector![1.5, -2.0, -9.0];
    let B = beam().X_LB.translation.vector;
    let turned =
        |p: Vector3<f64>, r: [f64; 3]| Pose::from_parts(p.into(), Rotation3::from_euler_angles(r[0], r[1], r[2]));
    for (name, inertia) in [
        ("base", None),
        ("boom", Some(boom)),
        ("arm", Some(inertia(5.0, vector![0.2, 0.05, 0.0], 0.1))),
        ("tool", Some(inertia(2.0, vector![0.05, 0.0, 0.1], 0.02))),
        ("near_motor", Some(inertia(3.0, vector![0.0, 0.01, 0.0], 0.01))),
        ("far_motor", Some(inertia(4.0, vector![0.0, 0.02, 0.03], 0.02))),
    ] {
        robot.links.push(Link { name: name.into(), inertia });
    }
    for (name, kind, parent, child, X) in [
        (
            "slew",
            JointKind::Continuous(Vector3::z_axis()),
            "base",
            "boom",
            turned(vector![0.1, 0.0, 0.4], [0.1, 0.2, 0.3]),
        ),
        ("elbow", JointKind::Revolute(Vector3::y_axis()), "boom", "arm", turned(B, [0.5, -0.2, 0.7])),
        (
            "slide",
            JointKind::Prismatic(Vector3::x_axis()),
            "arm",
            "tool",
            turned(vector![0.4, 0.1, 0.0], [0.0, 0.3, 0.0]),
        ),
        (
            "near_bolts",
            JointKind::Fixed,
            "boom",
            "near_motor",
            turned(B * 0.2 + vector![0.0, 0.1, 0.0], [0.2, 0.0, 0.0]),
        ),
        ("far_bolts", JointKind::Fixed, "boom", "far_motor", turned(B * 0.8 + vector![0.1, 0.0, 0.0], [0.0, 0.4, 0.0])),
    ] {
        robot.joints.push(Joint::new(name, kind, parent, child, X));
    }
    robot
}

fn flexible(modal: &Arc<ModalLink>, parts: Parts) -> FlexibleLink {
    let reduced = beam().reduce().expect("a beam");
    let form = LinkForm::Modal(modal.clone());
    FlexibleLink { parts, form, distal: Some("elbow".into()), ..FlexibleLink::new("boom", reduced) }
}

/// Maximum relative differences of mass matrix, torques of a motion (with velocities and
/// accelerations) and frames.
fn differences(rigid: &Mechanism, soft: &Mechanism) -> [f64; 3] {
    let (rigid, soft) = (Model::new(rigid).expect("a tree"), Model::new(soft).expect("a tree"));
    let (mut d1, mut d2) = (Data::new(&rigid), Data::new(&soft));
    let n = rigid.nv();
    let pad = |x: &[f64]| DVector::from_fn(soft.nv(), |k, _| if k < n { x[k] } else { 0.0 });
    let (q, v, a) = ([0.7, -0.4, 0.15], [1.1, -2.0, 0.6], [3.0, 1.0, -2.0]);
    let (mut s1, mut s2) = (State::zeros(&rigid), State::zeros(&soft));
    (s1.q, s1.qdot) = (DVector::from_row_slice(&q), DVector::from_row_slice(&v));
    (s2.q, s2.qdot) = (pad(&q), pad(&v));
    let M = mass_matrix(&rigid, &mut d1, &s1.q).clone();
    let M_soft = mass_matrix(&soft, &mut d2, &s2.q).view((0, 0), (n, n)).clone_owned();
    let tau = inverse_dynamics(&rigid, &mut d1, &s1, &DVector::from_row_slice(&a)).clone();
    let tau_soft = inverse_dynamics(&soft, &mut d2, &s2, &pad(&a)).rows(0, n).clone_owned();
    world_poses(&rigid, &mut d1);
    world_poses(&soft, &mut d2);
    let mut worst = 0.0f64;
    for frame in rigid.frames() {
        let twin = soft.frame(&frame.name).expect("there");
        worst = worst.max((d1.X_WF(frame).to_homogeneous() - d2.X_WF(twin).to_homogeneous()).amax());
    }
    [(&M - M_soft).amax() / M.amax(), (&tau - tau_soft).amax() / tau.amax(), worst]
}

/// Truth: the rigid recursion with the beam's own mass properties; torques of a fast motion.
/// Measured: 2e-16 at most.
#[test]
fn undeformed_robot_with_a_modal_link_is_the_rigid_robot() {
    let modal = Arc::new(beam().modal(4).expect("a beam"));
    let body = modal.rigid();
    let rigid = robot(LinkInertia { mass: body.mass, com: body.com, inertia_com: body.inertia });
    let soft = substitute(&rigid, &[flexible(&modal, Parts::Reduced)]).expect("fits");
    let found = differences(&rigid, &soft.mechanism);
    eprintln!("{found:?}");
    assert!(found.iter().all(|d| *d < 1e-12), "{found:?}");
    assert_eq!(soft.spans[0].part_masses, [body.mass]);
}

/// Same, with the modal link taking the mass properties of the robot's link, which differ from
/// those of the beam.
#[test]
fn undeformed_robot_keeps_the_mass_properties_of_its_own_link() {
    let modal = Arc::new(beam().modal(4).expect("a beam"));
    let own = inertia(modal.mass, modal.rigid().com + vector![0.02, -0.01, 0.03], 0.6);
    let rigid = robot(own);
    let soft = substitute(&rigid, &[flexible(&modal, Parts::FromLink(0.5))]).expect("fits");
    let found = differences(&rigid, &soft.mechanism);
    eprintln!("{found:?}");
    assert!(found.iter().all(|d| *d < 1e-12), "{found:?}");

    // No body of this mass with a tenth of the inertia has the modes of the beam, which would move
    // more than its whole mass: the beam has a share of it.
    let light = robot(inertia(modal.mass, modal.rigid().com, 0.1));
    let soft = substitute(&light, &[flexible(&modal, Parts::FromLink(0.5))]).expect("fits");
    let found = differences(&light, &soft.mechanism);
    assert!(found.iter().all(|d| *d < 1e-12), "{found:?}");
    assert!(soft.spans[0].share < 0.2, "{}", soft.spans[0].share);
    let point = robot(inertia(modal.mass, modal.rigid().com, 1e-6));
    let error = substitute(&point, &[flexible(&modal, Parts::FromLink(0.5))]).expect_err("no such body").to_string();
    assert!(error.contains("boom") && error.contains("parts = \"uniform\""), "{error}");

    let other = robot(LinkInertia { mass: 1.01 * own.mass, ..own });
    let error = substitute(&other, &[flexible(&modal, Parts::FromLink(0.5))]).expect_err("another mass").to_string();
    assert!(error.contains("boom") && error.contains("kg"), "{error}");
    let mut weightless = robot(own);
    weightless.links[1].inertia = None;
    let error = substitute(&weightless, &[flexible(&modal, Parts::FromLink(0.5))]).expect_err("no mass").to_string();
    assert!(error.contains("boom"), "{error}");
}

/// Compliance of a frame due to modal coordinates, world axes.
fn compliance(model: &Model, name: &str, K: &DMatrix<f64>) -> Matrix6<f64> {
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, &DVector::zeros(model.nv()));
    let mut J = Matrix6xX::zeros(model.nv());
    frame_jacobian(model, &data, model.frame(name).expect("there"), &mut J);
    let J_e = DMatrix::from_column_slice(6, K.nrows(), J.columns(model.n_actuated(), K.nrows()).as_slice());
    let C = &J_e * K.clone().cholesky().expect("stiff").solve(&J_e.transpose());
    Matrix6::from_column_slice(C.as_slice())
}

/// Clamped modal beam with a tip frame in link axes.
fn cantilever(modal: &Arc<ModalLink>, reduced: ReducedLink) -> Mechanism {
    let mut arm = Mechanism::new("cantilever");
    arm.gravity = Vector3::zeros();
    for name in ["clamp", "boom", "tip"] {
        arm.links.push(Link { name: name.into(), inertia: None });
    }
    arm.joints.push(Joint::new("root", JointKind::Continuous(Vector3::z_axis()), "clamp", "boom", Pose::identity()));
    let tip = Pose::from(reduced.X_LB.translation);
    arm.joints.push(Joint::new("end", JointKind::Fixed, "boom", "tip", tip));
    let flexible = FlexibleLink { form: LinkForm::Modal(modal.clone()), ..FlexibleLink::new("boom", reduced) };
    substitute(&arm, &[flexible]).expect("fits").mechanism
}

/// Truth: `K_BB⁻¹ F` of the reduced link, for any number of modes; measured 1.4e-14.
#[test]
fn tip_of_a_modal_cantilever_moves_as_its_reduced_stiffness_says() {
    for modes in [0, 1, 6] {
        let modal = Arc::new(beam().modal(modes).expect("a beam"));
        let reduced = beam().reduce().expect("a beam");
        let truth = reduced.K_BB.try_inverse().expect("stiff");
        let model = Model::new(&cantilever(&modal, reduced)).expect("a tree");
        let C = compliance(&model, "tip", &modal.K);
        for load in 0..6 {
            let error = (C.column(load) - truth.column(load)).amax() / truth.column(load).amax();
            eprintln!("{modes} modes, load {load}: {error:.1e}");
            assert!(error < 1e-9, "{modes} modes, load {load}: {error:e}");
        }
    }
}

/// Euler-Bernoulli beam along x with a third interface at the fraction `at`, with its exact static
/// shapes.
fn branched(at: f64, name: &str) -> (ModalLink, ReducedLink, f64) {
    let section = Section::Tube { outer_diameter: 0.06, wall: 0.003 };
    let mut straight = BeamLink::new("boom", section, Material::STEEL, L);
    straight.theory = BeamTheory::EulerBernoulli;
    let mut modal = straight.modal(0).expect("a beam");
    let (x, x2, x3) = (at, at * at, at * at * at);
    // Hermite cubics for a displacement and a rotation at B, and their slopes.
    let (v, vs) = (3.0 * x2 - 2.0 * x3, (6.0 * x - 6.0 * x2) / L);
    let (r, rs) = (L * (x3 - x2), 3.0 * x2 - 2.0 * x);
    let mut Phi = Matrix6xX::zeros(6);
    for (row, column, value) in [
        (0, 0, x),
        (3, 3, x),
        (1, 1, v),
        (5, 1, vs),
        (1, 5, r),
        (5, 5, rs),
        (2, 2, v),
        (4, 2, -vs),
        (2, 4, -r),
        (4, 4, rs),
    ] {
        Phi[(row, column)] = value;
    }
    modal.interfaces.push(ModalInterface { name: name.into(), X_LI: Pose::translation(at * L, 0.0, 0.0), Phi });
    let EI = Material::STEEL.E * section.properties(Material::STEEL.nu).expect("a section").I_z;
    (modal, straight.reduce().expect("a beam"), EI)
}

/// Truth: `v(x) = F x² (3 l - x)/(6 EI)` and its slope under a tip force, at the branch and at the
/// tip; measured 2e-16.
///
/// With the branch beyond the middle, a joint there must be at its own interface, not at B.
#[test]
fn children_of_a_branched_modal_link_hang_on_their_interfaces() {
    for at in [0.4, 0.7] {
        let (modal, reduced, EI) = branched(at, "mid");
        let mut arm = Mechanism::new("branched");
        for name in ["clamp", "boom", "tip", "camera", "label", "lamp"] {
            let inertia = ["tip", "camera"].contains(&name).then(|| inertia(1.0, Vector3::zeros(), 0.01));
            arm.links.push(Link { name: name.into(), inertia });
        }
        let z = JointKind::Continuous(Vector3::z_axis());
        let x = |x: f64, y: f64| Pose::translation(x, y, 0.0);
        arm.joints.push(Joint::new("root", z, "clamp", "boom", Pose::identity()));
        arm.joints.push(Joint::new("pan", z, "boom", "camera", x(at * L, 0.0)));
        arm.joints.push(Joint::new("end", z, "boom", "tip", x(L, 0.0)));
        arm.joints.push(Joint::new("glue", JointKind::Fixed, "boom", "label", x(0.1 * L, 0.05)));
        arm.joints.push(Joint::new("screw", JointKind::Fixed, "boom", "lamp", x(0.95 * L, 0.05)));
        let modal = Arc::new(modal);
        let flexible = FlexibleLink {
            form: LinkForm::Modal(modal.clone()),
            distal: Some("end".into()),
            ..FlexibleLink::new("boom", reduced)
        };
        let soft = substitute(&arm, &[flexible]).expect("fits").mechanism;
        let parent = |joint: &str| soft.joint(joint).expect("there").parent.clone();
        assert_eq!(["pan", "end", "glue", "screw"].map(parent), ["boom__mid", "boom__distal", "boom", "boom__distal"]);

        let model = Model::new(&soft).expect("a tree");
        let (mut data, mut q) = (Data::new(&model), DVector::zeros(model.nv()));
        let F = 1e-3; // small: the sine is the slope
        let tip_load = nalgebra::DVector::from_row_slice(&[0.0, F, 0.0, 0.0, 0.0, 0.0]);
        let eta = modal.K.clone().cholesky().expect("stiff").solve(&tip_load);
        q.rows_mut(model.n_actuated(), 6).copy_from(&eta);
        forward_kinematics(&model, &mut data, &q);
        for (name, s) in [("camera", at * L), ("tip", L)] {
            let X = data.X_WF(model.frame(name).expect("there"));
            let v = F * s * s * (3.0 * L - s) / (6.0 * EI);
            let slope = F * s * (2.0 * L - s) / (2.0 * EI);
            eprintln!("{name}: {:.1e} {:.1e}", X.translation.y / v - 1.0, X.rotation.matrix()[(1, 0)] / slope - 1.0);
            assert!((X.translation.y / v - 1.0).abs() < 1e-9, "{name} {} {v}", X.translation.y);
            assert!((X.rotation.matrix()[(1, 0)] / slope - 1.0).abs() < 1e-9, "{name}");
        }
        // A lamp off the axis rotates with the tip.
        let tip = data.X_WF(model.frame("tip").expect("there"));
        let lamp = data.X_WF(model.frame("lamp").expect("there"));
        assert!((tip.inverse() * lamp).translation.vector.metric_distance(&vector![-0.05 * L, 0.05, 0.0]) < 1e-12);
        let label = data.X_WF(model.frame("label").expect("there")).translation.vector;
        assert_eq!(label, vector![0.1 * L, 0.05, 0.0]);
    }
}

/// Attached bodies: those near the proximal end stay with the link, those beyond the split move
/// with B. Truth: the rigid robot with all bodies, and the inertias of the two links.
#[test]
fn attached_bodies_ride_on_the_side_of_the_split_on_which_they_are() {
    let modal = Arc::new(beam().modal(3).expect("a beam"));
    let B = beam().X_LB.translation.vector;
    let ride = |mass: f64, com: Vector3<f64>| RigidPart { mass, com, inertia: Matrix3::identity() * 0.02 * mass };
    let riders =
        vec![ride(1.5, B * 0.1), ride(2.5, B * 0.9 + vector![0.0, 0.1, 0.0]), ride(0.5, B * 1.2), ride(0.7, -B * 0.1)];
    let all = riders.iter().fold(modal.rigid(), |sum, part| sum.merged(part));
    let rigid = robot(LinkInertia { mass: all.mass, com: all.com, inertia_com: all.inertia });
    let mut flexible = flexible(&modal, Parts::Reduced);
    flexible.reduced.details = Some(Box::new(LinkDetails { attached: riders, ..LinkDetails::default() }));
    let soft = substitute(&rigid, &[flexible]).expect("fits");
    let found = differences(&rigid, &soft.mechanism);
    eprintln!("{found:?}");
    assert!(found.iter().all(|d| *d < 1e-12), "{found:?}");
    let mass = |link: &str| soft.mechanism.link(link).expect("there").inertia.expect("has mass").mass;
    assert!((mass("boom") - 2.2).abs() < 1e-12 && (mass("boom__distal") - 3.0).abs() < 1e-12);
    assert!((soft.spans[0].part_masses.iter().sum::<f64>() - all.mass).abs() < 1e-12);
    // Motors of the robot itself, which are off the ends.
    let parent = |joint: &str| soft.mechanism.joint(joint).expect("there").parent.clone();
    assert_eq!(["near_bolts", "far_bolts", "elbow"].map(parent), ["boom", "boom__distal", "boom__distal"]);
}

/// A modal link whose far interface is elsewhere, or that has none, is rejected by name.
#[test]
fn modal_links_of_another_place_are_refused() {
    let right = beam().modal(1).expect("a beam");
    let body = right.rigid();
    let rigid = robot(LinkInertia { mass: body.mass, com: body.com, inertia_com: body.inertia });
    let refuse = |change: &dyn Fn(&mut ModalLink)| {
        let mut wrong = right.clone();
        change(&mut wrong);
        substitute(&rigid, &[flexible(&Arc::new(wrong), Parts::Reduced)]).map(|_| ()).expect_err("refused").to_string()
    };
    let error = refuse(&|m| m.interfaces[0].X_LI = Pose::translation(900.0, 0.0, 0.0));
    assert!(error.contains("boom") && error.contains("lies"), "{error}");
    assert!(refuse(&|m| m.interfaces.clear()).contains("one interface"));
}
