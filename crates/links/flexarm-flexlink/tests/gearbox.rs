//! Elastic gearboxes on the tree: invariants, compliance and rejected input.

use flexarm_flexlink::*;
use flexarm_kinematics::*;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Matrix6xX, Rotation3, UnitVector3, Vector3, vector};

const TIP: [f64; 3] = [0.6, 0.1, -0.2];

/// Rotation, translation, rotation about oblique axes; heavy links, rotors, a tip frame on the last
/// link.
fn robot() -> Mechanism {
    let mut robot = Mechanism::new("robot");
    robot.gravity = vector![1.5, -2.0, -9.0];
    let I = |mass: f64, com: Vector3<f64>| LinkInertia { mass, com, inertia_com: Matrix3::identity() * 0.1 * mass };
    for (name, inertia) in [
        ("base", None),
        ("column", Some(I(20.0, vector![0.1, 0.0, 0.3]))),
        ("carriage", Some(I(8.0, vector![0.1, 0.2, 0.0]))),
        ("arm", Some(I(5.0, vector![0.3, 0.0, 0.1]))),
        ("tip", None),
    ] {
        robot.links.push(Link { name: name.into(), inertia });
    }
    let oblique = UnitVector3::new_normalize(vector![0.3, 0.9, -0.2]);
    let at = |x: f64, y: f64, z: f64, r: f64| {
        Pose::from_parts(nalgebra::Translation3::new(x, y, z), Rotation3::from_euler_angles(r, 0.5 * r, -r))
    };
    for (name, kind, parent, child, X) in [
        ("slew", JointKind::Continuous(Vector3::z_axis()), "base", "column", at(0.0, 0.1, 0.2, 0.3)),
        ("slide", JointKind::Prismatic(Vector3::y_axis()), "column", "carriage", at(0.1, 0.0, 0.6, -0.2)),
        ("elbow", JointKind::Revolute(oblique), "carriage", "arm", at(0.3, 0.0, 0.0, 0.6)),
        ("flange", JointKind::Fixed, "arm", "tip", Pose::translation(TIP[0], TIP[1], TIP[2])),
    ] {
        robot.joints.push(Joint::new(name, kind, parent, child, X));
    }
    for (joint, armature) in robot.joints.iter_mut().zip([2.0, 30.0, 0.5]) {
        joint.armature = armature;
    }
    robot
}

fn gearbox(joint: &str, stiffness: GearStiffness) -> Gearbox {
    Gearbox { joint: joint.into(), stiffness, seat: None }
}

/// Symmetric positive definite 6x6 matrix with all couplings.
fn full() -> Matrix6<f64> {
    let A = Matrix6::from_fn(|i, j| if i == j { 2.0 } else { 0.3 / (1.0 + (i + 2 * j) as f64) });
    (A * A.transpose()) * 1e5
}

/// Truth: the rigid robot, rotors included. Measured: no difference in mass matrix and torques.
#[test]
fn undeflected_gearboxes_change_nothing() {
    let tubes = GuideTubes { outer_end: 0.9, inner_end: -0.1, tilts: [true, false, true] };
    for (slide, names) in
        [(GearStiffness::Axis(1e6), &["slide"][..]), (GearStiffness::Guide(tubes), &["slide.x", "slide.z"][..])]
    {
        check_undeflected(slide, names);
    }
}

fn check_undeflected(slide: GearStiffness, names_of_slide: &[&str]) {
    let rigid = robot();
    let mut soft = robot();
    let gearboxes = [
        gearbox("slew", GearStiffness::Tilting([4e5, 3e5, 1e5])),
        gearbox("slide", slide),
        gearbox("elbow", GearStiffness::Full(full())),
    ];
    let springs = insert_gearboxes(&mut soft, &gearboxes).expect("fits");
    let names: Vec<&str> = springs.iter().map(|s| s.name.as_str()).collect();
    let all: Vec<&str> =
        ["slew.x", "slew.y", "slew.z"].iter().chain(names_of_slide).chain(&["elbow"]).copied().collect();
    assert_eq!(names, all);
    let elastic = names.len() + 5;
    let (rigid, soft) = (Model::new(&rigid).expect("a tree"), Model::new(&soft).expect("a tree"));
    assert_eq!((rigid.nv(), soft.n_actuated(), soft.nv()), (3, 3, 3 + elastic));
    assert_eq!(rigid.moving_mass(), soft.moving_mass());
    let pad = |x: [f64; 3]| DVector::from_fn(soft.nv(), |k, _| if k < 3 { x[k] } else { 0.0 });
    let (q, v, a) = ([0.7, 0.3, -0.4], [1.1, -2.0, 0.6], [3.0, 1.0, -2.0]);
    let (mut d1, mut d2) = (Data::new(&rigid), Data::new(&soft));
    let (mut s1, mut s2) = (State::zeros(&rigid), State::zeros(&soft));
    (s1.q, s1.qdot) = (DVector::from_row_slice(&q), DVector::from_row_slice(&v));
    (s2.q, s2.qdot) = (pad(q), pad(v));
    let M = mass_matrix(&rigid, &mut d1, &s1.q).clone();
    let M_soft = mass_matrix(&soft, &mut d2, &s2.q).view((0, 0), (3, 3)).clone_owned();
    let error = (&M - M_soft).amax() / M.amax();
    eprintln!("mass matrix {error:.1e}");
    assert!(error < 1e-12, "{error:e}");
    let tau = inverse_dynamics(&rigid, &mut d1, &s1, &DVector::from_row_slice(&a)).clone();
    let tau_soft = inverse_dynamics(&soft, &mut d2, &s2, &pad(a)).rows(0, 3).clone_owned();
    let error = (&tau - tau_soft).amax() / tau.amax();
    eprintln!("torques {error:.1e}");
    assert!(error < 1e-12, "{error:e}");
    world_poses(&rigid, &mut d1);
    world_poses(&soft, &mut d2);
    for frame in rigid.frames() {
        let twin = soft.frame(&frame.name).expect("there");
        assert!((d1.X_WF(frame).to_homogeneous() - d2.X_WF(twin).to_homogeneous()).amax() < 1e-14, "{}", frame.name);
    }
}

/// The rotor is inward of the spring, so it appears in the motor's diagonal entry only. Truth: the
/// armature itself.
#[test]
fn rotor_stays_on_the_motor_side_of_the_spring() {
    let model = |armature: f64| {
        let mut soft = robot();
        soft.joints[0].armature = armature;
        insert_gearboxes(&mut soft, &[gearbox("slew", GearStiffness::Axis(1e5))]).expect("fits");
        let model = Model::new(&soft).expect("a tree");
        mass_matrix(&model, &mut Data::new(&model), &DVector::from_element(4, 0.2)).clone()
    };
    let rotor = model(7.0) - model(0.0);
    let mut truth = DMatrix::zeros(4, 4);
    truth[(0, 0)] = 7.0;
    assert!((rotor - truth).amax() < 1e-12);
}

/// Compliance of the tip at `q` due to the springs of one gearbox.
fn tip_compliance(mechanism: &Mechanism, springs: &[GearSpring], q: [f64; 3]) -> (Matrix6<f64>, Pose, Pose) {
    let model = Model::new(mechanism).expect("a tree");
    let (mut data, mut full) = (Data::new(&model), DVector::zeros(model.nv()));
    full.rows_mut(0, 3).copy_from_slice(&q);
    forward_kinematics(&model, &mut data, &full);
    let mut J = Matrix6xX::zeros(model.nv());
    let tip = model.frame("tip").expect("there");
    frame_jacobian(&model, &data, tip, &mut J);
    let mut C = Matrix6::zeros();
    let mut column = 3;
    for spring in springs {
        let n = spring.K.nrows();
        let J_e = DMatrix::from_column_slice(6, n, J.columns(column, n).as_slice());
        let part = &J_e * spring.K.clone().try_inverse().expect("stiff") * J_e.transpose();
        C += Matrix6::from_column_slice(part.as_slice());
        column += n;
    }
    let motor = model.frame(&format!("{}__motor", springs[0].gearbox)).expect("there");
    (C, data.X_WF(tip), data.X_WF(motor))
}

/// Truth: `Σ u uᵀ/k` with `u = [axis × lever; axis]` for each spring, `A K⁻¹ Aᵀ` for the full
/// stiffness, axes of the rotated joint frame; measured 3e-16 relative.
#[test]
fn tip_gives_way_by_lever_and_axis() {
    let q = [0.7, 0.3, -0.4];
    let k = [4e5, 3e5, 1e5];
    for (joint, stiffness) in [
        ("elbow", GearStiffness::Axis(k[2])),
        ("slide", GearStiffness::Axis(2e6)),
        ("elbow", GearStiffness::Tilting(k)),
        ("elbow", GearStiffness::Full(full())),
        ("slide", GearStiffness::Full(full())),
        ("elbow", GearStiffness::Separate([3e6, 5e6, 4e6, k[0], k[1], k[2]])),
        ("slide", GearStiffness::Separate([3e6, 5e6, 4e6, k[0], k[1], k[2]])),
    ] {
        let mut soft = robot();
        let springs = insert_gearboxes(&mut soft, &[gearbox(joint, stiffness.clone())]).expect("fits");
        let (C, X_WT, X_WJ) = tip_compliance(&soft, &springs, q);
        let lever = X_WT.translation.vector - X_WJ.translation.vector;
        let turn = |axis: Vector3<f64>| {
            let (axis, mut u) = (X_WJ.rotation * axis, nalgebra::Vector6::zeros());
            u.fixed_rows_mut::<3>(0).copy_from(&axis.cross(&lever));
            u.fixed_rows_mut::<3>(3).copy_from(&axis);
            u
        };
        let shift = |axis: Vector3<f64>| {
            let (axis, mut u) = (X_WJ.rotation * axis, nalgebra::Vector6::zeros());
            u.fixed_rows_mut::<3>(0).copy_from(&axis);
            u
        };
        let e = |a: usize| Vector3::ith(a, 1.0);
        let kind = robot().joint(joint).expect("there").kind;
        let truth = match (&stiffness, kind) {
            (GearStiffness::Axis(k), JointKind::Revolute(axis)) => turn(*axis) * turn(*axis).transpose() / *k,
            (GearStiffness::Axis(k), JointKind::Prismatic(axis)) => shift(*axis) * shift(*axis).transpose() / *k,
            (GearStiffness::Tilting(k), _) => (0..3).map(|a| turn(e(a)) * turn(e(a)).transpose() / k[a]).sum(),
            (GearStiffness::Separate(k), _) => (0..3)
                .map(|a| {
                    let (u, w) = (shift(e(a)), turn(e(a)));
                    u * u.transpose() / k[a] + w * w.transpose() / k[a + 3]
                })
                .sum(),
            (GearStiffness::Full(K), _) => {
                let A =
                    Matrix6::from_columns(&[shift(e(0)), shift(e(1)), shift(e(2)), turn(e(0)), turn(e(1)), turn(e(2))]);
                A * K.try_inverse().expect("stiff") * A.transpose()
            }
            _ => unreachable!("no such case"),
        };
        let error = (C - truth).amax() / truth.amax();
        eprintln!("{joint} {stiffness:?}: {error:.1e}");
        assert!(error < 1e-12, "{joint} {stiffness:?}: {error:e}");
    }
}

/// Truth: `Σ u uᵀ/k` with the axes of the joint frame before the joint turns for the seat, and the
/// joint's axis for its gear, at two values of the joint.
#[test]
fn a_seat_yields_about_axes_that_do_not_turn_with_the_joint() {
    for turned in [-0.4, 1.1] {
        let q = [0.7, 0.3, turned];
        let (seat, k) = ([4e5, 3e5], 1e5);
        let mut soft = robot();
        let gear = Gearbox { seat: Some(seat), ..gearbox("elbow", GearStiffness::Axis(k)) };
        let springs = insert_gearboxes(&mut soft, &[gear]).expect("fits");
        let (C, X_WT, X_WJ) = tip_compliance(&soft, &springs, q);
        let JointKind::Revolute(axis) = robot().joint("elbow").expect("there").kind else { panic!("turns") };
        let before = X_WJ.rotation * Rotation3::from_axis_angle(&axis, -turned);
        let lever = X_WT.translation.vector - X_WJ.translation.vector;
        let across: Vec<usize> = (0..3).filter(|a| *a != axis.iamax()).collect();
        let own = [(Vector3::ith(across[0], 1.0), seat[0]), (Vector3::ith(across[1], 1.0), seat[1]), (*axis, k)];
        let truth: Matrix6<f64> = own.into_iter().fold(Matrix6::zeros(), |sum, (axis, k)| {
            let axis = before * axis;
            let mut u = nalgebra::Vector6::zeros();
            u.fixed_rows_mut::<3>(0).copy_from(&axis.cross(&lever));
            u.fixed_rows_mut::<3>(3).copy_from(&axis);
            sum + u * u.transpose() / k
        });
        let error = (C - truth).amax() / truth.amax();
        eprintln!("joint at {turned}: {error:.1e}");
        assert!(error < 1e-12, "{turned}: {error:e}"); // measured: 3e-16
    }
    let mut mechanism = robot();
    let weak = Gearbox { seat: Some([1e5, 0.0]), ..gearbox("elbow", GearStiffness::Axis(1e5)) };
    assert!(insert_gearboxes(&mut mechanism, &[weak]).unwrap_err().to_string().contains(POSITIVE));
    assert_eq!(mechanism, robot());
}

/// Words about a single stiffness that is not positive.
const POSITIVE: &str = "must be positive";

/// Every invalid gearbox is rejected by name, and the mechanism is unchanged.
#[test]
fn gearboxes_that_hold_nothing_or_sit_nowhere_are_refused() {
    let refuse = |joint: &str, stiffness: GearStiffness| {
        let mut mechanism = robot();
        mechanism.joints[2].mimic = Some(Mimic { joint: "slew".into(), ratio: 2.0, offset: 0.0 });
        let before = mechanism.clone();
        let error = insert_gearboxes(&mut mechanism, &[gearbox(joint, stiffness)]).expect_err("refused");
        assert!(error.to_string().contains(joint), "{error}");
        assert_eq!(mechanism, before, "{error}");
        error
    };
    let says = |error: GearboxError, words: &str| assert!(error.to_string().contains(words), "{error}");
    for k in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
        says(refuse("slew", GearStiffness::Axis(k)), POSITIVE);
        says(refuse("slew", GearStiffness::Tilting([1e5, k, 1e5])), POSITIVE);
    }
    let mut indefinite = full();
    indefinite[(0, 3)] = 1e7;
    indefinite[(3, 0)] = 1e7;
    says(refuse("slew", GearStiffness::Full(indefinite)), "not positive definite");
    let mut lopsided = full();
    lopsided[(0, 3)] += 1e4;
    says(refuse("slew", GearStiffness::Full(lopsided)), "must be symmetric");
    let mut hole = full();
    hole[(2, 2)] = f64::NAN;
    says(refuse("slew", GearStiffness::Full(hole)), "[2][2] is NaN");
    says(refuse("wrist", GearStiffness::Axis(1e5)), "no such movable joint");
    says(refuse("flange", GearStiffness::Axis(1e5)), "no such movable joint");
    let tubes = |tilts: [bool; 3]| GearStiffness::Guide(GuideTubes { outer_end: 1.0, inner_end: 0.0, tilts });
    says(refuse("slew", tubes([true; 3])), "only a prismatic joint");
    says(refuse("slide", tubes([false; 3])), "only a prismatic joint");
    says(refuse("slide", GearStiffness::Tilting([1e5; 3])), "this one slides");
}

/// Truth: rotations of the distal part about the middle of the overlap of the tubes, also where the
/// joint mimics another one.
#[test]
fn a_guide_tilts_in_the_middle_of_the_overlap_also_of_a_joint_that_mimics_another() {
    let [outer_end, inner_end] = [0.9, -0.1];
    for follows in [false, true] {
        let mut soft = robot();
        if follows {
            soft.joints[1].mimic = Some(Mimic { joint: "slew".into(), ratio: 0.4, offset: 0.05 });
        }
        let joints = if follows { 2 } else { 3 };
        let rigid = Model::new(&soft).expect("a tree");
        let tubes = GuideTubes { outer_end, inner_end, tilts: [true, false, true] };
        insert_gearboxes(&mut soft, &[gearbox("slide", GearStiffness::Guide(tubes))]).expect("fits");
        let model = Model::new(&soft).expect("a tree");
        assert_eq!((model.n_actuated(), model.nv()), (joints, joints + 2));
        let q = [0.7, if follows { -0.3 } else { 0.25 }, -0.3];
        let position = if follows { 0.4 * q[0] + 0.05 } else { q[1] };
        let at = |model: &Model, elastic: &[f64]| {
            let mut data = Data::new(model);
            let all = q[..joints].iter().chain(elastic).copied();
            forward_kinematics(model, &mut data, &DVector::from_iterator(model.nv(), all));
            data
        };
        let [rigid_data, data] = [at(&rigid, &[]), at(&model, &[0.01, -0.02])];
        let X_WT = |model: &Model, data: &Data, name: &str| data.X_WF(model.frame(name).expect("there"));
        let column = X_WT(&rigid, &rigid_data, "column") * robot().joints[1].X_PJ;
        let middle = Pose::translation(0.0, 0.5 * (outer_end + inner_end + position), 0.0);
        let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), 0.01)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), -0.02);
        let tilted = column * middle * Pose::from_parts(nalgebra::Translation3::identity(), turn);
        let truth = tilted * middle.inverse() * column.inverse() * X_WT(&rigid, &rigid_data, "tip");
        let error = (X_WT(&model, &data, "tip").to_homogeneous() - truth.to_homogeneous()).amax();
        eprintln!("tilted tubes {error:.1e}");
        assert!(error < 1e-14, "{follows} {error:e}"); // measured 2e-16
    }
}
