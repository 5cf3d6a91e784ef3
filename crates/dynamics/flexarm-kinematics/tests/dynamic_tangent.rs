//! Derivatives of inverse dynamics against Richardson extrapolation of differences of the
//! recursion, on random trees.

use flexarm_kinematics::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{Draw, random_state, random_tree};
use nalgebra::{DMatrix, DVector};

struct Case {
    model: Model,
    state: State,
    qddot: DVector<f64>,
    loads: Vec<Wrench>,
}

/// Random tree in motion with external wrenches fixed to the bodies; every other pair of seeds has
/// balancers.
fn case(seed: u64, n_joints: usize) -> Case {
    let mut tree = random_tree(seed, n_joints);
    // Rotors, and a mimic joint.
    let single: Vec<usize> = (0..tree.joints.len()).filter(|&k| tree.joints[k].kind.axis_motion().is_some()).collect();
    single.iter().for_each(|&k| tree.joints[k].armature = 0.3 * k as f64);
    if let [first, .., last] = single[..] {
        let leader = tree.joints[first].name.clone();
        tree.joints[last].mimic = Some(Mimic { joint: leader, ratio: -0.7, offset: 0.2 });
    }
    if (seed / 2).is_multiple_of(2) {
        let single = tree.joints.iter().find(|joint| joint.kind.axis_motion().is_some()).unwrap();
        let span = BalancerSpan::Joint { joint: single.name.clone(), child: single.child.clone() };
        let law = BalancerLaw::Sine { amplitude: 10.0, zero: 0.3 };
        tree.balancers.push(Balancer { name: "sine".into(), span, law });
        let X = Pose::translation(6.0, 5.0, 4.0);
        let (base, last) = (tree.links[0].name.clone(), tree.links.last().unwrap().name.clone());
        tree.joints.push(Joint::new("fix", JointKind::Fixed, base, "anchor", X));
        tree.links.push(Link { name: "anchor".into(), inertia: None });
        let law = BalancerLaw::Linear { rate: 20.0, free: 0.7, preload: 30.0 };
        let span = BalancerSpan::Points { from: "anchor".into(), to: last };
        tree.balancers.push(Balancer { name: "spring".into(), span, law });
    }
    let model = Model::new(&tree).unwrap();
    let mut draw = Draw(seed ^ 0xABCD);
    let state = random_state(&model, &mut draw);
    let qddot = DVector::from_fn(model.nv(), |_, _| 3.0 * draw.signed());
    let loads = (0..model.bodies().len()).map(|_| Wrench::new(draw.vector(20.0), draw.vector(5.0))).collect();
    Case { model, state, qddot, loads }
}

impl Case {
    fn forces(&self, data: &mut Data, q: &DVector<f64>, qdot: &DVector<f64>) -> DVector<f64> {
        data.F_ext.copy_from_slice(&self.loads);
        data.F_ext[0] = Wrench::zeros();
        let state = State { q: q.clone(), qdot: qdot.clone() };
        inverse_dynamics(&self.model, data, &state, &self.qddot).clone()
    }
}

/// Derivatives with respect to each coordinate by differences of sixth order.
fn richardson(n: usize, h: f64, mut f: impl FnMut(usize, f64) -> DVector<f64>) -> DMatrix<f64> {
    let mut J = DMatrix::zeros(n, n);
    for k in 0..n {
        let mut d = |h: f64| (f(k, h) - f(k, -h)) / (2.0 * h);
        let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
        let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
        J.set_column(k, &((bc * 16.0 - ab) / 15.0));
    }
    J
}

fn moved(x: &DVector<f64>, k: usize, by: f64) -> DVector<f64> {
    let mut x = x.clone();
    x[k] += by;
    x
}

#[test]
fn forces_change_with_coordinates_and_rates_as_differences_of_the_recursion_say() {
    let mut worst = [0.0f64; 3];
    for seed in 0..24 {
        let case = case(seed, 5 + seed as usize % 5);
        let (model, n) = (&case.model, case.model.nv());
        let (q, qdot) = (case.state.q.clone(), case.state.qdot.clone());
        let (mut data, mut tangent) = (Data::new(model), DynamicTangent::new(model).unwrap());
        let tau = case.forces(&mut data, &q, &qdot);
        world_poses(model, &mut data);
        let [mut by_q, mut by_rate, mut G] = std::array::from_fn(|_| DMatrix::zeros(n, n));
        let mut loads = Vec::new();
        for (body, F) in case.loads.iter().enumerate().skip(1) {
            let R = data.X_WB[body].rotation;
            let F_W = Wrench::new(R * F.force, R * F.torque);
            loads.push(PointLoad { body, p_B: nalgebra::Vector3::zeros(), F_W, turns: true });
        }
        let mut of_loads = StaticTangent::new(model, 0);
        let allocated = count_allocations(|| {
            tangent.compute(model, &data, &case.state, &case.qddot, &mut by_q, &mut by_rate);
            of_loads.of_loads(model, &data, &q, &loads, &mut G);
        });
        assert_eq!(allocated, 0);
        let whole = &by_q + &G;
        let mut work = Data::new(model);
        let truth = richardson(n, 2e-2, |k, h| case.forces(&mut work, &moved(&q, k, h), &qdot));
        let rates = richardson(n, 0.5, |k, h| case.forces(&mut work, &q, &moved(&qdot, k, h)));
        let errors = [(&whole - &truth).amax() / truth.amax(), (&by_rate - &rates).amax() / rates.amax()];

        // Derivative of the mass matrix only.
        forward_kinematics(model, &mut data, &q);
        tangent.of_inertia(model, &data, &q, &case.qddot, &mut G);
        let mut of_inertia = |q: &DVector<f64>| mass_matrix(model, &mut work, q).clone() * &case.qddot;
        let inertia = richardson(n, 2e-2, |k, h| of_inertia(&moved(&q, k, h)));
        let third = (&G - &inertia).amax() / inertia.amax();
        for (worst, error) in worst.iter_mut().zip([errors[0], errors[1], third]) {
            *worst = worst.max(error);
        }
        assert!(tau.amax() > 0.0);
        assert!(errors[0] < 1e-9 && errors[1] < 1e-9 && third < 1e-9, "seed {seed}: {errors:?} {third:e}");
    }
    eprintln!("by coordinates, by rates, of the mass matrix: {worst:?}");
}

/// Truth: forces are linear in the inertia.
#[test]
fn an_inertia_more_asks_for_the_difference_of_two_recursions() {
    for seed in 0..6 {
        let case = case(2 * seed, 6);
        let (model, n) = (&case.model, case.model.nv());
        let (mut data, mut tangent) = (Data::new(model), DynamicTangent::new(model).unwrap());
        let before = case.forces(&mut data, &case.state.q, &case.state.qdot);
        world_poses(model, &mut data);
        let body = model.bodies().len() - 2;
        let com = nalgebra::Vector3::new(0.2, -0.1, 0.3);
        let more = SpatialInertia::from_com(2.0, &com, &(nalgebra::Matrix3::identity() * 0.1));
        let [mut by_q, mut by_rate] = std::array::from_fn(|_| DMatrix::zeros(n, n));
        tangent.compute(model, &data, &case.state, &case.qddot, &mut by_q, &mut by_rate);
        let mut found = DVector::zeros(n);
        tangent.add_inertia_forces(model, &data, body, &more, 0.5, found.as_mut_slice());
        let mut sum = model.bodies()[body].inertia;
        sum += more;
        let heavier = Case { model: model.with_inertia(body, sum), ..case };
        let truth = (heavier.forces(&mut data, &heavier.state.q, &heavier.state.qdot) - before) * 0.5;
        let error = (&found - &truth).amax() / truth.amax();
        assert!(error < 1e-11, "{error:e}");
    }
}
