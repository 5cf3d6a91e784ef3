//! Identities between the recursions on random trees: each algorithm is the truth for another.

use flexarm_kinematics::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{Cloud, Draw, random_flexible_tree, random_state, random_tree};
use nalgebra::{DMatrix, DVector, Matrix6xX, Vector3};
use proptest::prelude::*;

/// Maximum difference relative to the maximum entry.
fn difference(a: &DVector<f64>, b: &DVector<f64>) -> f64 {
    (a - b).amax() / a.amax().max(b.amax()).max(1e-300)
}

struct Case {
    model: Model,
    data: Data,
    state: State,
    qddot: DVector<f64>,
    draw: Draw,
}

fn case(seed: u64, n_joints: usize) -> Case {
    let mut tree =
        if seed.is_multiple_of(2) { random_tree(seed, n_joints) } else { random_flexible_tree(seed, n_joints) };
    if (seed / 2).is_multiple_of(2) {
        add_balancers(&mut tree, &mut Draw(seed ^ 0x5EED));
    }
    let model = Model::new(&tree).expect("random trees are valid");
    let mut draw = Draw(seed ^ 0xABCD);
    let state = random_state(&model, &mut draw);
    let qddot = DVector::from_fn(model.nv(), |_, _| 3.0 * draw.signed());
    let mut data = Data::new(&model);
    for F in data.F_ext.iter_mut().skip(1) {
        *F = Wrench::new(draw.vector(20.0), draw.vector(5.0));
    }
    Case { model, data, state, qddot, draw }
}

/// Balancers with all laws: between links and anchors that no link reaches, and about single-DoF
/// joints.
fn add_balancers(tree: &mut Mechanism, draw: &mut Draw) {
    let links: Vec<String> = tree.links.iter().map(|link| link.name.clone()).collect();
    let single: Vec<Joint> = tree.joints.iter().filter(|j| j.kind.axis_motion().is_some()).cloned().collect();
    let points = [[-2.0, -4.0], [-0.3, 6.0], [0.4, 5.0], [2.0, -3.0]];
    for k in 0..6 {
        let law = match draw.index(5) {
            0 => BalancerLaw::Linear { rate: 20.0 * draw.signed(), free: draw.signed(), preload: 30.0 * draw.signed() },
            1 => BalancerLaw::Gas(GasLaw {
                force: 40.0,
                opposing: 3.0,
                at: 4.0,
                slope: 0.01,
                exponent: draw.between(1.0, 1.6),
                pulls: draw.signed() > 0.0,
            }),
            2 => BalancerLaw::Gas(GasLaw {
                force: 40.0,
                opposing: 0.0,
                at: 4.0,
                slope: 0.01,
                exponent: 1.0,
                pulls: true,
            }),
            3 => BalancerLaw::Sine { amplitude: 10.0, zero: draw.signed() },
            _ => BalancerLaw::Curve(BalancerCurve::new(&points).expect("points rise")),
        };
        let span = match draw.index(single.len() + 2) {
            i if i < single.len() => {
                BalancerSpan::Joint { joint: single[i].name.clone(), child: single[i].child.clone() }
            }
            _ => {
                let (anchor, from) = (format!("anchor_{k}"), links[draw.index(links.len())].clone());
                let X = Pose::translation(6.0, 5.0, 4.0) * draw.pose(1.0);
                tree.joints.push(Joint::new(format!("fix_{k}"), JointKind::Fixed, from, &anchor, X));
                tree.links.push(Link { name: anchor.clone(), inertia: None });
                BalancerSpan::Points { from: anchor, to: links[draw.index(links.len())].clone() }
            }
        };
        tree.balancers.push(Balancer { name: format!("balancer_{k}"), span, law });
    }
}

/// Wrench of a load at Bo in B axes.
fn wrench_on_body(load: &PointLoad, X_WB: &Pose, F_W: &Wrench) -> Wrench {
    let R_BW = X_WB.rotation.inverse();
    let (force, torque) = (R_BW * F_W.force, R_BW * F_W.torque);
    Wrench::new(force, torque + load.p_B.cross(&force))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// τ = M q̈ + bias; measured at most 3e-14.
    #[test]
    fn inverse_dynamics_is_mass_times_acceleration_plus_bias(seed in any::<u64>(), n in 1usize..=60) {
        let Case { model, mut data, state, qddot, .. } = case(seed, n);
        let tau = inverse_dynamics(&model, &mut data, &state, &qddot).clone();
        let bias = nonlinear_effects(&model, &mut data, &state).clone();
        let M = mass_matrix(&model, &mut data, &state.q).clone();
        prop_assert!(difference(&tau, &(&M * &qddot + &bias)) < 1e-10);
        prop_assert!((&M - M.transpose()).amax() <= 1e-12 * M.amax());
        prop_assert!(M.cholesky().is_some());
    }

    /// The tangent of the static forces, with fixed and follower loads, equals their central
    /// differences; measured below 2e-8 of the maximum entry, which is the error of the
    /// differences.
    #[test]
    fn the_static_tangent_is_the_slope_of_the_static_forces(seed in any::<u64>(), n in 1usize..=24, elastic: bool) {
        let Case { model, mut data, state, mut draw, .. } = case(seed, n);
        let first = if elastic { model.n_actuated() } else { 0 };
        let load = |draw: &mut Draw| {
            let body = 1 + draw.index(model.bodies().len() - 1);
            let F_W = Wrench::new(draw.vector(50.0), draw.vector(20.0));
            PointLoad { body, p_B: draw.vector(0.5), F_W, turns: draw.signed() > 0.0 }
        };
        let loads = [load(&mut draw), load(&mut draw)];
        forward_kinematics(&model, &mut data, &state.q);
        // Loads in the axes of their bodies at this configuration.
        let in_body: Vec<Wrench> = loads.iter().map(|load| wrench_on_body(load, &data.X_WB[load.body], &load.F_W)).collect();
        let mut G = DMatrix::zeros(model.nv() - first, model.nv() - first);
        let mut tangent = StaticTangent::new(&model, first);
        let allocated = count_allocations(|| tangent.compute(&model, &data, &state.q, &loads, &mut G));
        prop_assert_eq!(allocated, 0);
        let mut forces = |q: &DVector<f64>| {
            forward_kinematics(&model, &mut data, q);
            data.clear_external_wrenches();
            for (load, turned) in loads.iter().zip(&in_body) {
                let kept = wrench_on_body(load, &data.X_WB[load.body], &load.F_W);
                data.F_ext[load.body] += if load.turns { *turned } else { kept };
            }
            gravity_forces(&model, &mut data, q).clone()
        };
        let (mut D, h) = (G.clone(), 1e-5);
        for k in first..model.nv() {
            let mut q = state.q.clone();
            q[k] += h;
            let up = forces(&q);
            q[k] -= 2.0 * h;
            let slope = (up - forces(&q)) / (2.0 * h);
            D.set_column(k - first, &slope.rows_range(first..));
        }
        prop_assert!((&G - &D).amax() <= 1e-7 * D.amax().max(1.0), "{:.1e}", (&G - &D).amax() / D.amax());
    }

    /// Forward dynamics inverts inverse dynamics: force error of the resulting accelerations;
    /// measured at most 4e-12.
    #[test]
    fn forward_dynamics_is_the_inverse_of_inverse_dynamics(seed in any::<u64>(), n in 1usize..=60) {
        let Case { model, mut data, state, qddot, .. } = case(seed, n);
        let tau = inverse_dynamics(&model, &mut data, &state, &qddot).clone();
        let roles = Roles::all_free(&model);
        let back = forward_dynamics(&model, &mut data, &state, &roles, &tau).clone();
        let tau_back = inverse_dynamics(&model, &mut data, &state, &back).clone();
        prop_assert!(difference(&tau, &tau_back) < 1e-10, "{:e}", difference(&tau, &tau_back));
    }

    /// Hybrid dynamics recovers motion and forces for any split into prescribed and free joints.
    #[test]
    fn hybrid_dynamics_agrees_with_inverse_dynamics(seed in any::<u64>(), n in 1usize..=60) {
        let Case { model, mut data, state, qddot, mut draw } = case(seed, n);
        let tau = inverse_dynamics(&model, &mut data, &state, &qddot).clone();
        let mask: Vec<bool> = (0..model.nv()).map(|_| draw.signed() > 0.0).collect();
        let roles = Roles::new(&model, |k| mask[k]);
        let (mut a, mut f) = (qddot.clone(), tau.clone());
        let free: Vec<usize> = roles.free_coordinates().to_vec();
        for k in 0..model.nv() {
            if free.contains(&k) { a[k] = f64::NAN } else { f[k] = f64::NAN }
        }
        for &k in &free { a[k] = 0.0; }
        hybrid_dynamics(&model, &mut data, &state, &roles, &mut a, &mut f);
        let tau_back = inverse_dynamics(&model, &mut data, &state, &a).clone();
        prop_assert!(difference(&tau, &tau_back) < 1e-10, "forces of the motion {:e}", difference(&tau, &tau_back));
        prop_assert!(difference(&tau, &f) < 1e-10, "forces {:e}", difference(&tau, &f));
    }

    /// dJ/dt against central differences (step 1e-6); measured at most 2e-8 of the maximum entry.
    /// The bound is the error of the differences; agreement to 1e-10 is tested in
    /// `jacobian_derivative_is_the_acceleration_bias`.
    #[test]
    fn jacobian_derivative_is_the_rate_of_the_jacobian(seed in any::<u64>(), n in 1usize..=30) {
        let Case { model, mut data, state, .. } = case(seed, n);
        let frame = model.frames().last().expect("has frames").clone();
        let mut at = |t: f64| {
            let mut J = Matrix6xX::zeros(model.nv());
            forward_kinematics(&model, &mut data, &(&state.q + &state.qdot * t));
            frame_jacobian(&model, &data, &frame, &mut J);
            J
        };
        let h = 1e-6;
        let numeric = (at(h) - at(-h)) / (2.0 * h);
        let mut Jdot = Matrix6xX::zeros(model.nv());
        forward_kinematics_velocity(&model, &mut data, &state);
        frame_jacobian_derivative(&model, &data, &state, &frame, &mut Jdot);
        prop_assert!((&numeric - &Jdot).amax() <= 2e-7 * (1.0 + Jdot.amax()), "{:e}", (&numeric - &Jdot).amax());
    }

    /// J q̈ + J̇ q̇ equals the frame acceleration of the Newton-Euler pass; measured at most 1e-13.
    #[test]
    fn jacobian_derivative_is_the_acceleration_bias(seed in any::<u64>(), n in 1usize..=60) {
        let Case { model, mut data, state, qddot, .. } = case(seed, n);
        let frame = model.frames().last().expect("has frames").clone();
        forward_kinematics_velocity(&model, &mut data, &state);
        let (mut J, mut Jdot) = (Matrix6xX::zeros(model.nv()), Matrix6xX::zeros(model.nv()));
        frame_jacobian(&model, &data, &frame, &mut J);
        frame_jacobian_derivative(&model, &data, &state, &frame, &mut Jdot);
        let V = &J * &state.qdot;
        prop_assert!((V - frame_twist(&data, &frame).to_vector()).amax() <= 1e-11 * (1.0 + V.amax()));
        let A = &J * &qddot + &Jdot * &state.qdot;
        inverse_dynamics(&model, &mut data, &state, &qddot);
        // Spatial acceleration of the frame without gravity, plus w × v for the acceleration of the
        // point.
        let X = data.X_WF(&frame);
        let V_F = data.V[frame.body].at_child(&frame.X_BF);
        let mut A_F = data.A[frame.body].at_child(&frame.X_BF);
        A_F.linear += V_F.angular.cross(&V_F.linear);
        let linear = X.rotation * A_F.linear + model.gravity;
        let angular = X.rotation * A_F.angular;
        let scale = 1.0 + A.amax();
        prop_assert!((linear - A.fixed_rows::<3>(0)).amax() <= 1e-10 * scale);
        prop_assert!((angular - A.fixed_rows::<3>(3)).amax() <= 1e-10 * scale);
    }

    /// Kinetic energy is ½ q̇ᵀ M q̇, and gravity forces are the gradient of the potential energy.
    #[test]
    fn energies_agree_with_mass_matrix_and_gravity_forces(seed in any::<u64>(), n in 1usize..=30) {
        let Case { model, mut data, state, .. } = case(seed, n);
        data.clear_external_wrenches();
        let T = kinetic_energy(&model, &mut data, &state);
        let M = mass_matrix(&model, &mut data, &state.q).clone();
        prop_assert!((T - 0.5 * state.qdot.dot(&(&M * &state.qdot))).abs() <= 1e-11 * T);
        let g = gravity_forces(&model, &mut data, &state.q).clone();
        let h = 1e-5;
        let up = potential_energy(&model, &mut data, &(&state.q + &state.qdot * h));
        let down = potential_energy(&model, &mut data, &(&state.q - &state.qdot * h));
        let slope = g.dot(&state.qdot);
        // Bound by the size of the terms: the derivative itself may cancel.
        let scale = 1.0 + g.amax() * state.qdot.amax() * model.nv() as f64;
        prop_assert!(((up - down) / (2.0 * h) - slope).abs() <= 1e-6 * scale);
    }

    /// Lagrange's equations from the kinetic energy only: bias = Ṁ q̇ - ½ ∂(q̇ᵀ M q̇)/∂q, every
    /// component, by central differences; measured at most 1e-8 of the maximum term. Unlike the
    /// power balance below, this test sees gyroscopic forces, which do no work.
    #[test]
    fn velocity_terms_are_those_of_lagranges_equations(seed in any::<u64>(), n in 1usize..=8) {
        let Case { model, mut data, state, .. } = case(seed, n);
        data.clear_external_wrenches();
        let bias = nonlinear_effects(&model, &mut data, &state).clone();
        let bias = bias - gravity_forces(&model, &mut data, &state.q);
        let h = 1e-4;
        let mut at = |q: &DVector<f64>| mass_matrix(&model, &mut data, q).clone();
        let rate = (at(&(&state.q + &state.qdot * h)) - at(&(&state.q - &state.qdot * h))) / (2.0 * h);
        let mut truth = &rate * &state.qdot;
        let scale = 1.0 + rate.amax() * state.qdot.amax() * model.nv() as f64;
        for k in 0..model.nv() {
            let mut step = DVector::zeros(model.nv());
            step[k] = h;
            let slope = (at(&(&state.q + &step)) - at(&(&state.q - &step))) / (2.0 * h);
            truth[k] -= 0.5 * state.qdot.dot(&(slope * &state.qdot));
        }
        prop_assert!((&bias - &truth).amax() <= 1e-6 * scale, "{:e}", (&bias - &truth).amax() / scale);
    }

    /// Power balance d/dt(T + U) = q̇ᵀ τ along the motion, by central differences of the energy.
    #[test]
    fn power_of_the_forces_is_the_rate_of_energy(seed in any::<u64>(), n in 1usize..=20) {
        let Case { model, mut data, state, qddot, .. } = case(seed, n);
        data.clear_external_wrenches();
        let tau = inverse_dynamics(&model, &mut data, &state, &qddot).clone();
        let h = 1e-5;
        let mut energy = |t: f64| {
            let q = &state.q + &state.qdot * t + &qddot * (0.5 * t * t);
            let moved = State { q, qdot: &state.qdot + &qddot * t };
            kinetic_energy(&model, &mut data, &moved) + potential_energy(&model, &mut data, &moved.q)
        };
        let rate = (energy(h) - energy(-h)) / (2.0 * h);
        let power = tau.dot(&state.qdot);
        let scale = tau.amax() * state.qdot.amax() * model.nv() as f64;
        prop_assert!((rate - power).abs() <= 1e-6 * scale, "{rate} {power}");
    }
}

/// A modal body equals its mass points: sum of momentum and energy of each; measured 3e-16.
///
/// Includes second-order terms: the modal coordinates are of the size of the body.
#[test]
fn modal_body_moves_like_its_mass_points() {
    for seed in 0..20 {
        let mut draw = Draw(seed);
        let n = 1 + draw.index(5);
        let cloud = Cloud::random(&mut draw, n);
        let mut tree = Mechanism::new("cloud");
        tree.links.push(Link { name: "base".into(), inertia: None });
        tree.links.push(Link { name: "body".into(), inertia: None });
        let free = JointKind::Elastic(ElasticAngles::RotationVector);
        tree.joints.push(Joint::new("free", free, "base", "body", draw.pose(0.5)));
        tree.modal.push(("body".into(), std::sync::Arc::new(cloud.modal_body(&mut draw, 0))));
        let model = Model::new(&tree).expect("valid");
        let (mut data, state) = (Data::new(&model), random_state(&model, &mut draw));
        let energy = kinetic_energy(&model, &mut data, &state);
        let momentum = momentum_of(&model, &data);
        let (X, V) = (data.X_WB[1], data.V[1]);
        let (eta, rates) = (&state.q.as_slice()[6..], &state.qdot.as_slice()[6..]);
        let (mut T, mut p, mut L, mut U) = (0.0, Vector3::zeros(), Vector3::zeros(), 0.0);
        for ((m, s), phi) in cloud.mass.iter().zip(&cloud.s).zip(&cloud.phi) {
            let sum = |x: &[f64]| phi.iter().zip(x).fold(Vector3::zeros(), |sum, (phi, x)| sum + phi * *x);
            let r = s + sum(eta);
            let v = X.rotation * (V.linear + V.angular.cross(&r) + sum(rates));
            let r = X.rotation * r + X.translation.vector;
            T += 0.5 * m * v.norm_squared();
            p += v * *m;
            L += r.cross(&(v * *m));
            U -= m * model.gravity.dot(&r);
        }
        assert!((energy - T).abs() < 1e-13 * T);
        assert!((momentum.force - p).norm() < 1e-13 * (1.0 + p.norm()));
        assert!((momentum.torque - L).norm() < 1e-13 * (1.0 + L.norm()));
        assert!((potential_energy(&model, &mut data, &state.q) - U).abs() < 1e-12 * (1.0 + U.abs()));
    }
}

/// No algorithm allocates after `Data` is created.
#[test]
fn recursions_do_not_allocate() {
    let Case { model, mut data, state, qddot, .. } = case(7, 30);
    assert!(model.has_modal());
    let roles = Roles::all_free(&model);
    let hybrid = Roles::actuated_prescribed(&model);
    let (mut a, mut f) = (qddot.clone(), qddot.clone());
    let frame = model.frames().last().expect("has frames").clone();
    let mut J = Matrix6xX::zeros(model.nv());
    let allocations = count_allocations(|| {
        inverse_dynamics(&model, &mut data, &state, &qddot);
        gravity_forces(&model, &mut data, &state.q);
        mass_matrix(&model, &mut data, &state.q);
        forward_dynamics(&model, &mut data, &state, &roles, &qddot);
        hybrid_dynamics(&model, &mut data, &state, &hybrid, &mut a, &mut f);
        forward_kinematics_velocity(&model, &mut data, &state);
        frame_jacobian(&model, &data, &frame, &mut J);
        frame_jacobian_derivative(&model, &data, &state, &frame, &mut J);
        kinetic_energy(&model, &mut data, &state);
    });
    assert_eq!(allocations, 0);
}

/// A mimic joint equals an explicit constraint q_full = G q + b: M, τ and q̈ are projected by G.
#[test]
fn mimic_joints_project_the_dynamics_of_the_unconstrained_tree() {
    let mut tree = random_tree(11, 0);
    let mut draw = Draw(5);
    for i in 0..4 {
        let axis = nalgebra::Unit::new_normalize(draw.vector(1.0));
        let parent = tree.links.last().expect("base").name.clone();
        let joint = Joint::new(format!("j{i}"), JointKind::Revolute(axis), parent, format!("l{i}"), draw.pose(0.4));
        tree.joints.push(joint);
        tree.links.push(Link { name: format!("l{i}"), inertia: Some(draw.inertia()) });
    }
    let free = Model::new(&tree).expect("valid");
    tree.joints[2].mimic = Some(Mimic { joint: "j0".into(), ratio: -0.7, offset: 0.2 });
    let tied = Model::new(&tree).expect("valid");
    assert_eq!((free.nv(), tied.nv()), (4, 3));

    let mut state = State::zeros(&tied);
    state.q.copy_from_slice(&[0.4, -0.8, 1.1]);
    state.qdot.copy_from_slice(&[0.9, 0.3, -0.6]);
    let qddot = DVector::from_vec(vec![1.0, -2.0, 0.5]);
    // q_full = G q + b with the third joint following the first.
    let G = nalgebra::Matrix4x3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.7, 0.0, 0.0, 0.0, 0.0, 1.0);
    let expand = |v: &DVector<f64>| DVector::from_column_slice((G * Vector3::new(v[0], v[1], v[2])).as_slice());
    let mut full = State { q: expand(&state.q), qdot: expand(&state.qdot) };
    full.q[2] += 0.2;

    let (mut d3, mut d4) = (Data::new(&tied), Data::new(&free));
    let tau = inverse_dynamics(&tied, &mut d3, &state, &qddot).clone();
    let tau_full = inverse_dynamics(&free, &mut d4, &full, &expand(&qddot)).clone();
    assert!((G.transpose() * &tau_full - &tau).amax() < 1e-12);
    let M = mass_matrix(&tied, &mut d3, &state.q).clone();
    let M_full = mass_matrix(&free, &mut d4, &full.q).clone();
    assert!((G.transpose() * M_full * G - M).amax() < 1e-12);
    let back = forward_dynamics(&tied, &mut d3, &state, &Roles::all_free(&tied), &tau).clone();
    assert!((back - qddot).amax() < 1e-10);
}

/// Inverse kinematics recovers the pose of forward kinematics, within limits.
#[test]
fn inverse_kinematics_reaches_a_reachable_pose_within_limits() {
    let mut tree = flexarm_testkit::reference_arm(false).mechanism;
    for joint in &mut tree.joints {
        joint.limits = Limits { lower: -2.6, upper: 2.6, ..Limits::NONE };
    }
    let model = Model::new(&tree).expect("valid");
    let mut data = Data::new(&model);
    let frame = model.frame("tcp").expect("there").clone();
    let mut draw = Draw(3);
    for _ in 0..40 {
        let q = DVector::from_fn(6, |_, _| 1.2 * draw.signed());
        forward_kinematics(&model, &mut data, &q);
        let target = data.X_WF(&frame);
        let start = &q + DVector::from_fn(6, |_, _| 0.4 * draw.signed());
        let found = inverse_kinematics(&model, &mut data, &frame, &target, &start, &IkOptions::default());
        let found = found.expect("reachable");
        forward_kinematics(&model, &mut data, &found);
        let X = data.X_WF(&frame);
        assert!((X.translation.vector - target.translation.vector).norm() < 1e-9);
        assert!(found.iter().all(|x| (-2.6..=2.6).contains(x)));
    }
    let far = Pose::translation(9.0, 0.0, 0.0);
    let q = DVector::zeros(6);
    let error = inverse_kinematics(&model, &mut data, &frame, &far, &q, &IkOptions::default()).expect_err("too far");
    assert!(error.position_m > 5.0);
}

/// Invalid trees are rejected with the names of the invalid items.
#[test]
fn wrong_trees_are_refused_by_name() {
    let good = flexarm_testkit::reference_arm(true).mechanism;
    let error = |change: &dyn Fn(&mut Mechanism)| {
        let mut tree = good.clone();
        change(&mut tree);
        Model::new(&tree).map(|_| "accepted").expect_err("must be refused").to_string()
    };
    assert!(error(&|t| t.joints[1].parent = "nowhere".into()).contains("nowhere"));
    assert!(error(&|t| t.links.push(Link { name: "island".into(), inertia: None })).contains("island"));
    assert!(error(&|t| t.links[1].name = "base".into()).contains("twice"));
    assert!(error(&|t| t.joints[0].parent = "link3".into()).contains("loop"));
    assert!(error(&|t| t.joints[2].child = "link2".into()).contains("joint2"));
    assert!(error(&|t| t.links.iter_mut().for_each(|link| link.inertia = None)).contains("mass 0"));
    assert!(error(&|t| t.links[1].inertia.as_mut().expect("has").mass = -1.0).contains("-1"));
    assert!(error(&|t| t.links[1].inertia.as_mut().expect("has").com.x = f64::NAN).contains("link1"));
    let mimic = Mimic { joint: "ghost".into(), ratio: 1.0, offset: 0.0 };
    assert!(error(&|t| t.joints[0].mimic = Some(mimic.clone())).contains("ghost"));
}

/// A rotor driven by two joints is included in all algorithms: `M q̈ + bias` against one
/// Newton-Euler pass, kinetic energy against `½ q̇ᵀ M q̇`, and hybrid dynamics with either joint
/// free. Truth for the coupling term: `a q̇_1 q̇_2`. Measured 3e-13.
#[test]
fn rotors_that_turn_with_two_joints_are_in_every_algorithm() {
    let (mut worst, mut own) = (0.0f64, 0.0f64);
    for seed in 0..40 {
        let mut tree = random_flexible_tree(seed, 7);
        let bare = Model::new(&tree).unwrap();
        let single = |j: &&Joint| !j.kind.is_elastic() && j.kind.axis_motion().is_some() && j.mimic.is_none();
        let joints: Vec<String> = tree.joints.iter().filter(single).map(|j| j.name.clone()).collect();
        let mut draw = Draw(seed ^ 0x707);
        if joints.len() < 2 {
            continue;
        }
        for name in &joints {
            tree.joints.iter_mut().find(|j| j.name == *name).unwrap().armature += 0.5;
        }
        let pair = [joints[0].clone(), joints[1].clone()];
        tree.rotor_couplings.push(RotorCoupling { joints: pair, inertia: 0.4 });
        let model = Model::new(&tree).unwrap();
        let place = |name: &String| model.coordinates().iter().position(|c| c.joint == *name).unwrap();
        let (a, b) = (place(&joints[0]), place(&joints[1]));
        let state = random_state(&model, &mut draw);
        let qddot = DVector::from_fn(model.nv(), |_, _| 3.0 * draw.signed());
        let mut data = Data::new(&model);
        let tau = inverse_dynamics(&model, &mut data, &state, &qddot).clone();
        let bias = nonlinear_effects(&model, &mut data, &state).clone();
        let M = mass_matrix(&model, &mut data, &state.q).clone();
        worst = worst.max(difference(&(&M * &qddot + &bias), &tau));
        let kinetic = kinetic_energy(&model, &mut data, &state);
        let half = 0.5 * state.qdot.dot(&(&M * &state.qdot));
        worst = worst.max((kinetic / half - 1.0).abs());
        // Coupling term only, relative to the tree without rotors.
        let mut plain = Data::new(&bare);
        let rotors: f64 = joints.iter().map(|name| 0.25 * state.qdot[place(name)].powi(2)).sum();
        let part = kinetic - kinetic_energy(&bare, &mut plain, &state) - rotors;
        own = own.max((part - 0.4 * state.qdot[a] * state.qdot[b]).abs() / kinetic);
        let prescribe: [&dyn Fn(usize) -> bool; 4] =
            [&|_| false, &|k| k == a, &|k| k == b, &|k| k < model.n_actuated()];
        for prescribed in prescribe {
            let roles = Roles::new(&model, prescribed);
            let (mut found, mut forces) = (qddot.clone(), tau.clone());
            for &k in roles.free_coordinates() {
                found[k] = 0.0;
            }
            (0..model.nv()).filter(|k| !roles.free_coordinates().contains(k)).for_each(|k| forces[k] = 0.0);
            hybrid_dynamics(&model, &mut data, &state, &roles, &mut found, &mut forces);
            worst = worst.max(difference(&found, &qddot)).max(difference(&forces, &tau));
        }
    }
    eprintln!("coupled rotors {worst:.1e}, their own energy {own:.1e}");
    assert!(worst < 1e-10 && own < 1e-13, "{worst} {own}");
}

/// Truth: the model of the mechanism whose joint is written with the other frame.
#[test]
fn a_joint_frame_set_in_a_model_is_that_of_a_mechanism_with_this_frame() {
    let mut worst = 0.0f64;
    for seed in 0..8 {
        let tree = if seed % 2 == 0 { random_tree(seed, 6) } else { random_flexible_tree(seed, 6) };
        let mut draw = Draw(seed ^ 0xF4A3E);
        let X = Pose::from_parts(
            nalgebra::Translation3::from(draw.vector(0.3)),
            nalgebra::Rotation3::new(draw.vector(0.4)),
        );
        let mut set = Model::new(&tree).unwrap();
        for body in 1..set.bodies().len() {
            let before = set.bodies()[body].X_PJ;
            let joint = set.bodies()[body].joint.clone();
            let mut moved = tree.clone();
            let parent = moved.joints.iter_mut().find(|j| j.name == joint).unwrap();
            // The joint frame of the mechanism is in its parent link, which may be fixed to a body.
            parent.X_PJ *= X;
            let written = Model::new(&moved).unwrap();
            set.set_joint_frame(body, before * X);
            let state = random_state(&written, &mut Draw(seed ^ 0xABCD));
            let [mut a, mut b] = [Data::new(&set), Data::new(&written)];
            let qddot = DVector::from_element(set.nv(), 0.7);
            let tau = [&set, &written].into_iter().zip([&mut a, &mut b]);
            let [one, other]: [DVector<f64>; 2] = tau
                .map(|(model, data)| inverse_dynamics(model, data, &state, &qddot).clone())
                .collect::<Vec<_>>()
                .try_into()
                .unwrap();
            worst = worst.max(difference(&one, &other));
            set.set_joint_frame(body, before);
        }
    }
    eprintln!("frames {worst:.1e}");
    assert!(worst < 1e-12, "{worst:e}"); // measured 2e-16
}

/// Vectors that are too long were accepted, too short ones ended in an index out of bounds.
#[test]
fn a_vector_of_another_length_than_the_tree_is_refused_with_both_lengths() {
    let Case { model, mut data, state, qddot, .. } = case(3, 4);
    let (n, roles) = (model.nv(), Roles::all_free(&model));
    for length in [0, n - 1, n + 1] {
        let other = DVector::zeros(length);
        let with = |q: &DVector<f64>, qdot: &DVector<f64>| State { q: q.clone(), qdot: qdot.clone() };
        let states = [with(&other, &state.qdot), with(&state.q, &other)];
        let mut refused = |name: &str, call: &mut dyn FnMut(&mut Data)| {
            let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| call(&mut data)));
            let panic = caught.expect_err(name);
            let text = panic.downcast_ref::<String>().expect(name);
            let expected = format!("has {length} values, expected one for each of the {n} coordinates");
            assert!(text.contains(&expected), "{name}: {text}");
        };
        for state in &states {
            refused("inverse_dynamics", &mut |data| {
                let _ = inverse_dynamics(&model, data, state, &qddot);
            });
            refused("nonlinear_effects", &mut |data| {
                let _ = nonlinear_effects(&model, data, state);
            });
            refused("forward_dynamics", &mut |data| {
                let _ = forward_dynamics(&model, data, state, &roles, &qddot);
            });
            refused("kinetic_energy", &mut |data| {
                let _ = kinetic_energy(&model, data, state);
            });
            refused("forward_kinematics_velocity", &mut |data| forward_kinematics_velocity(&model, data, state));
        }
        refused("inverse_dynamics", &mut |data| {
            let _ = inverse_dynamics(&model, data, &state, &other);
        });
        refused("forward_dynamics", &mut |data| {
            let _ = forward_dynamics(&model, data, &state, &roles, &other);
        });
        refused("gravity_forces", &mut |data| {
            let _ = gravity_forces(&model, data, &other);
        });
        refused("gravity_forces_at_poses", &mut |data| {
            let _ = gravity_forces_at_poses(&model, data, &other);
        });
        refused("mass_matrix", &mut |data| {
            let _ = mass_matrix(&model, data, &other);
        });
        refused("potential_energy", &mut |data| {
            let _ = potential_energy(&model, data, &other);
        });
        refused("forward_kinematics", &mut |data| forward_kinematics(&model, data, &other));
        let (mut both, frame, X) = (qddot.clone(), model.frames()[0].clone(), Pose::identity());
        refused("hybrid_dynamics", &mut |data| {
            hybrid_dynamics(&model, data, &state, &roles, &mut both, &mut other.clone())
        });
        refused("inverse_kinematics", &mut |data| {
            let _ = inverse_kinematics(&model, data, &frame, &X, &other, &IkOptions::default());
        });
    }
}

/// Data of another model gave numbers of the wrong tree, or ended in an index out of bounds.
#[test]
fn data_and_roles_of_another_tree_are_refused_with_both_sizes() {
    let Case { model, mut data, state, qddot, .. } = case(3, 4);
    let other = case(5, 3);
    let (bodies, nv) = (other.model.bodies().len(), other.model.nv());
    assert_ne!((bodies, nv), (model.bodies().len(), model.nv()));
    let (roles, others) = (Roles::all_free(&model), Roles::all_free(&other.model));
    let refused = |expected: &str, call: &mut dyn FnMut()| {
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call));
        let panic = caught.expect_err(expected);
        let text = panic.downcast_ref::<String>().unwrap();
        assert!(text.contains(expected), "{text}");
    };
    let mut wrong = other.data;
    let sizes = format!("data has {bodies} bodies and {nv} coordinates");
    let mut with_wrong_data = |call: &dyn Fn(&mut Data)| refused(&sizes, &mut || call(&mut wrong));
    with_wrong_data(&|data| forward_kinematics(&model, data, &state.q));
    with_wrong_data(&|data| forward_kinematics_velocity(&model, data, &state));
    with_wrong_data(&|data| drop(inverse_dynamics(&model, data, &state, &qddot).clone()));
    with_wrong_data(&|data| drop(nonlinear_effects(&model, data, &state).clone()));
    with_wrong_data(&|data| drop(gravity_forces(&model, data, &state.q).clone()));
    with_wrong_data(&|data| drop(gravity_forces_at_poses(&model, data, &state.q).clone()));
    with_wrong_data(&|data| drop(mass_matrix(&model, data, &state.q).clone()));
    with_wrong_data(&|data| drop(forward_dynamics(&model, data, &state, &roles, &qddot).clone()));
    refused(&format!("roles are those of a model of {bodies} bodies"), &mut || {
        drop(forward_dynamics(&model, &mut data, &state, &others, &qddot).clone());
    });
}

/// Truth: the coordinate of `S q` is q for every type of joint, whatever its axis and pitch; a twist
/// and its power on a wrench are those of the column S.
#[test]
fn a_joint_axis_and_its_column_describe_one_motion() {
    let axis = Vector3::new(2.0, -1.0, 2.0) / 3.0;
    let motions = [
        AxisMotion::Revolute(axis),
        AxisMotion::Prismatic(axis),
        AxisMotion::Helical { axis, pitch: 0.3 },
        AxisMotion::Helical { axis, pitch: -4.0 },
    ];
    let F = Wrench::new(Vector3::new(3.0, -5.0, 7.0), Vector3::new(-2.0, 11.0, 4.0));
    let mut worst = [0.0_f64; 4];
    for motion in motions {
        let S = motion.column();
        for q in [-1.3, 0.0, 2.7] {
            worst[0] = worst[0].max((motion.coordinate_of(&(S * q)) - q).abs());
            worst[1] = worst[1].max((motion.twist(q).to_vector() - S * q).amax());
        }
        worst[2] = worst[2].max((motion.project(&F) - S.dot(&F.to_vector())).abs());
        // A small motion along the pose is the column, to second order.
        let (h, X) = (1e-5, motion.pose(1e-5));
        let (d, r) = (X.translation.vector, rotation_vector(X.rotation.matrix()));
        worst[3] = worst[3].max((nalgebra::Vector6::new(d.x, d.y, d.z, r.x, r.y, r.z) / h - S).amax());
    }
    eprintln!("{worst:?}");
    for (found, bound) in worst.into_iter().zip([1e-14, 1e-14, 1e-13, 1e-9]) {
        assert!(found < bound, "{found:e} {bound:e}"); // measured 4.4e-16, 0, 0 and 0
    }
}
