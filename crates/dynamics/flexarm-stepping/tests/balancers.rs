//! Balancers in motion: steppers against each other, statics, modes and lanes, stored energy.

use std::sync::Arc;

use flexarm_kinematics::{
    Balancer, BalancerLaw, BalancerSpan, GasLaw, Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose, Wrench,
};
use flexarm_stepping::*;
use flexarm_testkit::{follow_reference_motion, reference_arm};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

/// Returns the reference arm with a gas cylinder from the column to the distal part of its lower
/// arm, and torque balancers at two joints.
fn balanced() -> Mechanism {
    let mut tree = reference_arm(true).mechanism;
    for (link, frame, place) in
        [("link1", "anchor", Pose::translation(-0.3, 0.1, 0.2)), ("link2b", "eye", Pose::translation(-0.1, 0.05, 0.2))]
    {
        tree.joints.push(Joint::new(format!("fix_{frame}"), JointKind::Fixed, link, frame, place));
        tree.links.push(Link { name: frame.into(), inertia: None });
    }
    let cylinder = GasLaw { force: 9e3, opposing: 50.0, at: 1.0, slope: 0.8, exponent: 1.3, pulls: true };
    let mut add = |name: &str, span, law| tree.balancers.push(Balancer { name: name.into(), span, law });
    add("cylinder", BalancerSpan::Points { from: "anchor".into(), to: "eye".into() }, BalancerLaw::Gas(cylinder));
    let over = |joint: &str, child: &str| BalancerSpan::Joint { joint: joint.into(), child: child.into() };
    let torsion = BalancerLaw::Linear { rate: 900.0, free: 0.2, preload: 150.0 };
    add("torsion", over("joint3", "link3"), torsion);
    add("sine", over("joint2", "link2"), BalancerLaw::Sine { amplitude: 700.0, zero: -0.3 });
    tree
}

fn arm_of(tree: &Mechanism, motion: Arc<dyn PrescribedMotion>, beta: f64) -> Plant {
    let springs = reference_arm(true).K_S.map(|K| ("spring".to_owned(), K, Damping::StiffnessProportional(beta)));
    Plant::new(Arc::new(Model::new(tree).unwrap()), springs.to_vec(), motion).unwrap()
}

fn moving() -> Arc<dyn PrescribedMotion> {
    Arc::new(MotionFn(follow_reference_motion))
}

/// Returns the position of the TCP at the end of a run.
fn end(plant: &Plant, kind: StepperKind, h: f64, start: Start, duration: f64) -> Vector3<f64> {
    end_of(plant, kind, h, start, duration).0
}

/// Returns the same, the potential energy of weight and balancers there (J), and the drive torques
/// (N m).
fn end_of(plant: &Plant, kind: StepperKind, h: f64, start: Start, duration: f64) -> (Vector3<f64>, f64, DVector<f64>) {
    let tcp = plant.model.frame("tcp").unwrap().clone();
    let mut seen = Observation::new(plant);
    let mut stepper = new_stepper(kind, plant.clone(), h, start).unwrap();
    (0..(duration / h).round() as usize).for_each(|_| stepper.step().unwrap());
    stepper.observe(&mut seen);
    ((seen.X_WB[tcp.body] * tcp.X_BF).translation.vector, seen.energy[1], seen.drive)
}

fn of(word: &str) -> StepperKind {
    let entry = STEPPERS.into_iter().find(|entry| entry.name == word).unwrap();
    (entry.with)(&StepperOptions::default())
}

/// Truth: Newton statics with the balancers in forces and tangent. Maximal coordinates use only
/// bodies and wrenches, so SPOOK finds the same equilibrium independently; drift measured 9e-11 of
/// the balancers' effect on the sag.
#[test]
fn an_arm_with_balancers_rests_where_statics_say_in_every_stepper() {
    let held: Arc<dyn PrescribedMotion> = Arc::new(Held(POSE.to_vec()));
    let plant = arm_of(&balanced(), held.clone(), 1e-3);
    let bare = arm_of(&reference_arm(true).mechanism, held, 1e-3);
    let at = |plant: &Plant| end(plant, StepperKind::default(), 1e-3, Start::Equilibrium, 0.0);
    let (rest, share) = (at(&plant), (at(&plant) - at(&bare)).norm());
    let (_, stored, held) = end_of(&plant, StepperKind::default(), 1e-3, Start::Equilibrium, 0.0);
    assert!(share > 1e-4, "{share}");
    for entry in STEPPERS.into_iter().filter(|entry| entry.steps != StepRule::UpToTheStabilityLimit) {
        for h in [1e-4, 1e-3] {
            let (end, energy, drives) = end_of(&plant, of(entry.name), h, Start::Equilibrium, 0.02);
            let drift = (end - rest).norm() / share;
            assert!((energy - stored).abs() < 1e-6, "{}: {energy} J, {stored} J", entry.name);
            // measured 5.9e-8 N m of 1.1 kN m, energy 2e-9 J
            assert!((&drives - &held).amax() < 1e-5 * held.amax(), "{}: {drives} {held}", entry.name);
            eprintln!("{} h {h:.0e}: {drift:.1e} of the balancers' share", entry.name);
            assert!(drift < 1e-7, "{} {drift:e}", entry.name);
        }
    }
}

/// Truth: the reference stepper on the same equations; for SPOOK its first order. Differences
/// relative to the effect of the balancers (2.8 mm): measured generalised-alpha and SDIRK3 below
/// 1e-6, RK4 1.0e-7, SPOOK 2.9e-4 at 0.2 ms and 1.1e-4 at 0.1 ms.
#[test]
fn steppers_agree_on_an_arm_that_moves_with_balancers() {
    let plant = arm_of(&balanced(), moving(), 1e-3);
    let bare = arm_of(&reference_arm(true).mechanism, moving(), 1e-3);
    let run = |plant: &Plant, word: &str, h: f64| end(plant, of(word), h, Start::Equilibrium, 0.8);
    let truth = run(&plant, "reference", 1e-3);
    let share = (truth - run(&bare, "reference", 1e-3)).norm();
    assert!(share > 1e-4, "{share}");
    let off = |word: &str, h: f64| {
        let off = (run(&plant, word, h) - truth).norm() / share;
        eprintln!("{word} h {h:.0e}: {off:.1e} of what the balancers change ({share:.1e} m)");
        off
    };
    assert!(off("generalized-alpha", 5e-4) < 1e-5);
    assert!(off("sdirk3", 5e-4) < 1e-5);
    assert!(off("rk4", 1.25e-4) < 1e-5);
    let spook = [2e-4, 1e-4].map(|h| off("spook", h));
    assert!(spook[0] < 5e-3 && spook[1] < 0.6 * spook[0], "{spook:?}");
}

/// Truth: without damping and with locked drives the energy of springs, weight and balancers is
/// conserved; RK4 at 25 us, measured 8e-7 of the energy exchanged between them.
#[test]
fn a_ringing_arm_keeps_its_energy_with_balancers_in_it() {
    let plant = arm_of(&balanced(), Arc::new(Held(POSE.to_vec())), 1e-12);
    let mut stepper = new_stepper(of("rk4"), plant.clone(), 2.5e-5, Start::Undeformed).unwrap();
    let mut seen = Observation::new(&plant);
    let (mut totals, mut kinetic) = (Vec::new(), 0.0f64);
    for _ in 0..8000 {
        stepper.observe(&mut seen);
        totals.push(seen.energy.iter().sum::<f64>());
        kinetic = kinetic.max(seen.energy[0]);
        stepper.step().unwrap();
    }
    let gap = totals.iter().map(|e| (e - totals[0]).abs()).fold(0.0, f64::max);
    eprintln!("energy open by {gap:.1e} J of {kinetic:.2e} J");
    assert!(gap < 1e-5 * kinetic, "{gap} {kinetic}");
}

/// Truth: omega² = (k_s + c D k - m g l)/(m l²) of an upright rod on a soft spring, held by a
/// spring without free length above it.
#[test]
fn a_balancer_raises_the_frequency_as_the_closed_form_says() {
    let (m, l, soft, D, k, rate) = (5.0, 0.6, 40.0, 0.9, 0.4, 300.0);
    let mut tree = Mechanism::new("rod");
    for name in ["base", "rod", "anchor", "eye"] {
        tree.links.push(Link { name: name.into(), inertia: None });
    }
    let com = Vector3::new(0.0, 0.0, l);
    tree.links[1].inertia = Some(LinkInertia { mass: m, com, inertia_com: Matrix3::zeros() });
    let hinge = JointKind::ElasticRevolute(Vector3::y_axis());
    tree.joints.push(Joint::new("hinge", hinge, "base", "rod", Pose::identity()));
    tree.joints.push(Joint::new("a", JointKind::Fixed, "base", "anchor", Pose::translation(0.0, 0.0, D)));
    tree.joints.push(Joint::new("b", JointKind::Fixed, "rod", "eye", Pose::translation(0.0, 0.0, k)));
    let span = BalancerSpan::Points { from: "anchor".into(), to: "eye".into() };
    let law = BalancerLaw::Linear { rate, free: 0.0, preload: 0.0 };
    tree.balancers.push(Balancer { name: "spring".into(), span, law });
    let K = DMatrix::from_element(1, 1, soft);
    let damping = Damping::StiffnessProportional(0.0);
    let spring = Spring::linear("hinge", K, damping);
    let plant = Plant::new(Arc::new(Model::new(&tree).unwrap()), vec![spring], Arc::new(Held(vec![]))).unwrap();
    let truth = ((soft + rate * D * k - m * 9.81 * l) / (m * l * l)).sqrt();
    // measured 2e-16
    assert!((plant.modes.omega[0] / truth - 1.0).abs() < 1e-12, "{} {truth}", plant.modes.omega[0]);
}

/// Truth: central differences of the equilibria under small forces at the tool; measured 2.3e-8.
#[test]
fn compliance_has_the_stiffness_of_the_balancers_in_it() {
    let plant = arm_of(&balanced(), Arc::new(Held(POSE.to_vec())), 1e-3);
    let tool = plant.model.frame("tcp").unwrap().clone();
    let mut at = OperatingPoint::new(plant, tool);
    at.solve(&POSE, &Wrench::zeros()).unwrap();
    let C = at.compliance();
    for c in 0..3 {
        let mut moved = |sign: f64| {
            let F = Wrench::new(Vector3::ith(c, sign * 50.0), Vector3::zeros());
            at.solve(&POSE, &F).unwrap();
            at.tcp_pose().translation.vector
        };
        let slope = (moved(1.0) - moved(-1.0)) / 100.0;
        let column: Vector3<f64> = C.fixed_view::<3, 1>(0, c).into();
        assert!((slope - column).norm() < 1e-6 * column.norm(), "{:e}", (slope - column).norm() / column.norm());
    }
}
