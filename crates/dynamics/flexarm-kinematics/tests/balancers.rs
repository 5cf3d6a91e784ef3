//! Balancers against closed forms: a pendulum with a spring, and a published hydraulic
//! counterbalance.

use flexarm_kinematics::*;
use nalgebra::{DMatrix, DVector, Vector3};

const MASS: f64 = 12.0;
const LENGTH: f64 = 0.8;
const GRAVITY: f64 = 9.81;

/// Point mass on a rod below a hinge about y, q measured from straight down; the spring connects an
/// anchor at height D above the hinge with a point at distance k along the rod.
fn pendulum(D: f64, k: f64, law: BalancerLaw) -> Model {
    let mut tree = Mechanism::new("pendulum");
    for name in ["base", "rod", "anchor", "eye"] {
        tree.links.push(Link { name: name.into(), inertia: None });
    }
    let com = Vector3::new(0.0, 0.0, -LENGTH);
    tree.links[1].inertia = Some(LinkInertia { mass: MASS, com, inertia_com: nalgebra::Matrix3::zeros() });
    let hinge = JointKind::Continuous(Vector3::y_axis());
    tree.joints.push(Joint::new("hinge", hinge, "base", "rod", Pose::identity()));
    tree.joints.push(Joint::new("a", JointKind::Fixed, "base", "anchor", Pose::translation(0.0, 0.0, D)));
    tree.joints.push(Joint::new("b", JointKind::Fixed, "rod", "eye", Pose::translation(0.0, 0.0, -k)));
    let span = BalancerSpan::Points { from: "anchor".into(), to: "eye".into() };
    tree.balancers.push(Balancer { name: "spring".into(), span, law });
    Model::new(&tree).expect("valid")
}

fn holding(model: &Model, q: f64) -> f64 {
    gravity_forces(model, &mut Data::new(model), &DVector::from_element(1, q))[0]
}

/// Truth: a balanced-arm lamp. With zero free length and c D k = m g l the rod is in equilibrium
/// everywhere; otherwise it takes the torque (m g l - c D k) sin q. Measured 3e-14 N m.
#[test]
fn a_spring_without_free_length_balances_the_rod_everywhere() {
    let (D, k) = (0.5, 0.3);
    let rate = MASS * GRAVITY * LENGTH / (D * k);
    let spring = |rate| BalancerLaw::Linear { rate, free: 0.0, preload: 0.0 };
    let (full, half) = (pendulum(D, k, spring(rate)), pendulum(D, k, spring(0.5 * rate)));
    for q in [-2.5, -0.7, 0.0, 0.4, 1.6, 3.0f64] {
        assert!(holding(&full, q).abs() < 1e-11, "{:e}", holding(&full, q));
        let rest = 0.5 * MASS * GRAVITY * LENGTH * q.sin();
        assert!((holding(&half, q) - rest).abs() < 1e-11);
    }
}

/// Truth: with c D k twice the balancing value, hanging is unstable and the upright position
/// stable: there the rod swings with omega² = (c D k - m g l)/(m l²). The tangent gives the same;
/// measured 2e-16.
#[test]
fn slope_of_the_tangent_is_that_of_the_closed_form() {
    let (D, k, weight) = (0.5, 0.3, MASS * GRAVITY * LENGTH);
    let model = pendulum(D, k, BalancerLaw::Linear { rate: 2.0 * weight / (D * k), free: 0.0, preload: 0.0 });
    let mut data = Data::new(&model);
    for (q, sign) in [(0.0, -1.0), (std::f64::consts::PI, 1.0)] {
        let q = DVector::from_element(1, q);
        forward_kinematics(&model, &mut data, &q);
        let mut G = DMatrix::zeros(1, 1);
        StaticTangent::new(&model, 0).compute(&model, &data, &q, &[], &mut G);
        assert!((G[(0, 0)] - sign * weight).abs() < 1e-12 * weight, "{}", G[(0, 0)]);
        let M = mass_matrix(&model, &mut data, &q)[(0, 0)];
        assert!((G[(0, 0)] / M - sign * GRAVITY / LENGTH).abs() < 1e-11);
    }
}

/// Truth: the energy of a frictionless pendulum with a spring is constant; RK4 at 1 ms over 5 s,
/// measured 7e-14.
#[test]
fn a_swinging_rod_with_a_spring_keeps_its_energy() {
    let model = pendulum(0.5, 0.3, BalancerLaw::Linear { rate: 900.0, free: 0.35, preload: 40.0 });
    let (mut data, mut state, roles) = (Data::new(&model), State::zeros(&model), Roles::all_free(&model));
    state.q[0] = 2.0;
    let none = DVector::zeros(1);
    let total =
        |data: &mut Data, state: &State| kinetic_energy(&model, data, state) + potential_energy(&model, data, &state.q);
    let start = total(&mut data, &state);
    let mut rate = |state: &State| (state.qdot[0], forward_dynamics(&model, &mut data, state, &roles, &none)[0]);
    let h = 1e-3;
    for _ in 0..5000 {
        let at = |f: f64, (v, a): (f64, f64)| {
            let mut next = state.clone();
            next.q[0] += f * h * v;
            next.qdot[0] += f * h * a;
            next
        };
        let k1 = rate(&state);
        let k2 = rate(&at(0.5, k1));
        let k3 = rate(&at(0.5, k2));
        let k4 = rate(&at(1.0, k3));
        state.q[0] += h / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
        state.qdot[0] += h / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
    }
    let end = total(&mut Data::new(&model), &state);
    assert!(state.qdot[0].abs() > 0.1 && (end - start).abs() < 1e-11 * start.abs(), "{start} {end}");
}

/// Truth: counterbalance of a KUKA KR 300, with the formula and pressures read on the robot by its
/// authors (github.com/JonasWeigand/Robot_Identification, MIT): torque h p A from the law of sines,
/// pressure within 1.72 % of nine readings. Torque measured 4e-12 N m.
#[test]
fn a_hydraulic_counterbalance_has_the_published_torque_and_pressure() {
    let (D, k, offset) = (0.8, 0.2, 1.658_062_789_394_613_4f64);
    let area = std::f64::consts::PI * (0.055f64.powi(2) - 0.03f64.powi(2)) / 4.0;
    let (volume, heat) = (0.00096, 1.01 * 296.8 * 328.0 * 0.159);
    let gas = GasLaw {
        force: heat / volume * area,
        opposing: 0.0,
        at: D - k,
        slope: area / volume,
        exponent: 1.0,
        pulls: true,
    };
    let law = BalancerLaw::Gas(gas);
    let readings = [170e5, 167e5, 164e5, 162e5, 164e5, 170e5, 180e5, 190e5, 200e5];
    let mut tree = Mechanism::new("upper arm");
    for name in ["base", "arm", "anchor", "eye"] {
        tree.links.push(Link { name: name.into(), inertia: None });
    }
    tree.joints.push(Joint::new("a2", JointKind::Continuous(Vector3::z_axis()), "base", "arm", Pose::identity()));
    tree.joints.push(Joint::new("a", JointKind::Fixed, "base", "anchor", Pose::translation(D, 0.0, 0.0)));
    let eye = Pose::new(Vector3::new(k * offset.cos(), k * offset.sin(), 0.0), Vector3::zeros());
    tree.joints.push(Joint::new("b", JointKind::Fixed, "arm", "eye", eye));
    let span = BalancerSpan::Points { from: "anchor".into(), to: "eye".into() };
    tree.balancers.push(Balancer { name: "counterbalance".into(), span, law: law.clone() });
    let model = Model::new(&tree).expect("valid");
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for (i, reading) in readings.into_iter().enumerate() {
        let q2 = (-120.0 + 10.0 * i as f64).to_radians();
        let delta = q2 + offset;
        let L = (D * D + k * k - 2.0 * D * k * delta.cos()).sqrt();
        let p = heat / (volume - (L - (D - k)) * area);
        let torque = D * k * delta.sin() / L * p * area;
        assert!((holding(&model, q2) - torque).abs() < 1e-9, "{} {torque}", holding(&model, q2));
        assert!((law.tension(L) / area / reading - 1.0).abs() < 0.0175, "{}", law.tension(L) / area / reading);
        (least, most) = (least.min(torque), most.max(torque));
    }
    // measured -3073.774 and 6179.319 N m at the nine angles
    assert!((least + 3073.77).abs() < 0.05 && (most - 6179.32).abs() < 0.05, "{least} {most}");
}

/// Truth: virtual work. A torque about a joint with an elastic gearbox acts equally on motor and
/// spring, for single-DoF and six-DoF springs.
#[test]
fn a_torque_over_a_joint_goes_through_the_spring_of_its_gearbox() {
    for full in [false, true] {
        let mut tree = Mechanism::new("geared");
        for name in ["base", "motor", "link"] {
            tree.links.push(Link { name: name.into(), inertia: None });
        }
        tree.gravity = Vector3::zeros();
        tree.links[2].inertia =
            Some(LinkInertia { mass: 2.0, com: Vector3::x(), inertia_com: nalgebra::Matrix3::identity() });
        let spring = match full {
            true => JointKind::Elastic(ElasticAngles::RotationVector),
            false => JointKind::ElasticRevolute(Vector3::z_axis()),
        };
        tree.joints.push(Joint::new("j", JointKind::Continuous(Vector3::z_axis()), "base", "motor", Pose::identity()));
        tree.joints.push(Joint::new("s", spring, "motor", "link", Pose::identity()));
        let span = BalancerSpan::Joint { joint: "j".into(), child: "link".into() };
        let law = BalancerLaw::Linear { rate: 50.0, free: 0.1, preload: 0.0 };
        tree.balancers.push(Balancer { name: "torsion".into(), span, law });
        let model = Model::new(&tree).expect("valid");
        let mut q = DVector::zeros(model.nv());
        let about = if full { 6 } else { 1 };
        q[0] = 0.4;
        q[about] = 0.02;
        let hold = gravity_forces(&model, &mut Data::new(&model), &q).clone();
        let torque = 50.0 * (0.42 - 0.1);
        assert!((hold[0] - torque).abs() < 1e-12 && (hold[about] - torque).abs() < 1e-12, "{hold}");
        assert!((1..about).all(|k| hold[k].abs() < 1e-12));
    }
}

#[test]
fn balancers_on_what_is_not_there_are_refused_by_name() {
    let law = BalancerLaw::Linear { rate: 1.0, free: 0.0, preload: 0.0 };
    let refused = |change: &dyn Fn(&mut Mechanism)| {
        let mut tree = flexarm_testkit::reference_arm(false).mechanism;
        let span = BalancerSpan::Points { from: "base".into(), to: "link2".into() };
        tree.balancers.push(Balancer { name: "piston".into(), span, law: law.clone() });
        change(&mut tree);
        Model::new(&tree).map(|_| "accepted").expect_err("must be refused").to_string()
    };
    let to = |to: &str| BalancerSpan::Points { from: "base".into(), to: to.into() };
    assert!(refused(&|t| t.balancers[0].span = to("ghost")).contains("piston"));
    assert!(refused(&|t| t.balancers.push(t.balancers[0].clone())).contains("twice"));
    let nan = BalancerLaw::Linear { rate: f64::NAN, free: 0.0, preload: 0.0 };
    assert!(refused(&|t| t.balancers[0].law = nan.clone()).contains("piston"));
    let over = BalancerSpan::Joint { joint: "ghost".into(), child: "link2".into() };
    assert!(refused(&|t| t.balancers[0].span = over.clone()).contains("joint"));
}
