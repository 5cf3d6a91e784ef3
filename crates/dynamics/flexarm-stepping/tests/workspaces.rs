//! Workspaces that are reused between runs of one arm.

use std::sync::Arc;

use flexarm_kinematics::{Model, Wrench, forward_kinematics};
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{reference_arm, reference_motion};
use nalgebra::Vector3;

/// Returns the reference motion at `speed` times its speed.
fn motion(speed: f64) -> Arc<dyn PrescribedMotion> {
    Arc::new(MotionFn(move |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        let (x, y, z) = reference_motion(speed * t);
        q.copy_from_slice(&x);
        v.iter_mut().zip(y).for_each(|(v, y)| *v = speed * y);
        a.iter_mut().zip(z).for_each(|(a, z)| *a = speed * speed * z);
    }))
}

fn arm() -> FlexibleArm {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let damping = Damping::StiffnessProportional(reference.beta);
    let springs =
        vec![("lower".to_owned(), reference.K_S[0], damping), ("upper".to_owned(), reference.K_S[1], damping)];
    FlexibleArm::new(model, springs, motion(1.0)).unwrap()
}

/// Returns the bits of all results of a run and of its equilibria.
fn bits(arm: &FlexibleArm, kind: StepperKind) -> Vec<u64> {
    let mut stepper = new_stepper(kind, arm.clone(), 2e-3, Start::Equilibrium).unwrap();
    let mut path = StaticPath::new(arm.clone());
    let tool = arm.model.frame("tcp").unwrap().clone();
    let (mut seen, mut bits) = (Observation::new(arm), Vec::new());
    for step in 0..300 {
        stepper.step().unwrap();
        if step % 10 == 0 {
            stepper.observe(&mut seen);
            path.at(seen.t).unwrap();
            let places = seen.X_WB.iter().flat_map(|X| X.to_homogeneous().iter().copied().collect::<Vec<f64>>());
            let forces = seen.drive.iter().chain(seen.load.iter().flat_map(|load| load.iter())).copied();
            let rates = seen.q.iter().chain(&seen.qdot).copied();
            let figures = seen
                .energy
                .into_iter()
                .chain(seen.power)
                .chain(path.displacement(&tool).iter().copied().collect::<Vec<f64>>());
            bits.extend(places.chain(forces).chain(rates).chain(figures).map(f64::to_bits));
        }
    }
    bits
}

/// Returns a change to a heavier tool at a given time.
fn payload(arm: &FlexibleArm, t: f64) -> InertiaChange {
    let body = arm.model.frame("link6").unwrap().body;
    let mut inertia = arm.model.bodies()[body].inertia;
    inertia += arm.model.bodies()[body].inertia;
    InertiaChange { t, body, inertia }
}

/// Truth: the same run of an arm that has not run before. In between the arm runs other motions,
/// under loads, with payload changes before and during a run.
#[test]
fn a_run_has_the_same_bits_with_new_and_with_used_workspaces() {
    let shared = arm();
    for entry in STEPPERS.iter().filter(|entry| entry.steps == StepRule::AnyLength) {
        let kind = (entry.with)(&StepperOptions::default());
        let truth = bits(&arm(), kind);
        assert!(bits(&shared, kind) == truth, "{}: first", entry.name);
        bits(&shared.along(motion(1.7)), kind);
        let body = shared.model.frame("link6").unwrap().body;
        let pulled = vec![(body, Wrench::new(Vector3::new(200.0, -300.0, 150.0), Vector3::new(20.0, 10.0, -40.0)))];
        bits(&shared.clone().with_loads(pulled).unwrap(), kind);
        if !entry.maximal {
            for t in [0.0, 0.1] {
                let carrying = |arm: &FlexibleArm| arm.clone().with_inertia_changes(vec![payload(arm, t)]).unwrap();
                assert!(bits(&carrying(&shared), kind) == bits(&carrying(&arm()), kind), "{}: payload", entry.name);
            }
        }
        assert!(bits(&shared, kind) == truth, "{}: after others", entry.name);
        let runs = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..3).map(|_| scope.spawn(|| bits(&shared, kind))).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
        });
        assert!(runs.iter().all(|run| *run == truth), "{}: side by side", entry.name);
    }
}

#[test]
fn the_second_run_of_an_arm_takes_less_memory_than_the_first() {
    let arm = arm();
    let set_up = || drop((ReducedArm::new(arm.clone()), StaticPath::new(arm.clone())));
    let [first, second] = [count_allocations(set_up), count_allocations(set_up)];
    assert!(second + 40 < first, "{second} and {first} allocations"); // measured 66 and 112
}

/// Truth: poses with the springs deflected and with the springs at zero; energy and loads from the
/// stiffness matrix.
#[test]
fn displacement_energy_and_loads_are_those_of_their_definitions() {
    let arm = arm();
    let (model, tool) = (&arm.model, arm.model.frame("tcp").unwrap().clone());
    let mut path = StaticPath::new(arm.clone());
    let mut data = arm.lend_data();
    for t in [0.0, 0.3, 0.6, 1.1] {
        let mut q = path.at(t).unwrap().clone();
        let found = path.displacement(&tool);
        forward_kinematics(model, &mut data, &q);
        let bent = data.X_WF(&tool).translation.vector;
        q.rows_mut(model.n_actuated(), model.n_elastic()).fill(0.0);
        forward_kinematics(model, &mut data, &q);
        let truth = bent - data.X_WF(&tool).translation.vector;
        // measured 3e-16 m
        assert!((found - truth).norm() < 1e-14, "{:.1e}", (found - truth).norm());
    }

    let mut stepper = new_stepper(StepperKind::default(), arm.clone(), 2e-3, Start::Equilibrium).unwrap();
    let mut seen = Observation::new(&arm);
    for _ in 0..150 {
        stepper.step().unwrap();
    }
    stepper.observe(&mut seen);
    let n = model.n_actuated();
    let (e, rates) = (seen.q.rows(n, 12).clone_owned(), seen.qdot.rows(n, 12).clone_owned());
    let forces = arm.stiffness() * &e + &arm.D * &rates;
    for (load, truth) in seen.load.iter().zip([forces.rows(0, 6), forces.rows(6, 6)]) {
        assert!((load + truth).norm() < 1e-12 * truth.norm());
    }
    let energy = arm.elastic_energy(seen.q.as_slice());
    assert!((seen.energy[2] - energy).abs() < 1e-13 * energy && energy > 0.0);
    assert!((seen.power[2] - rates.dot(&(&arm.D * &rates))).abs() < 1e-12 * seen.power[2]);
}
