//! Displacements, energies and loads that a run shows, against their definitions.

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, forward_kinematics};
use flexarm_stepping::*;
use flexarm_testkit::{follow_reference_motion, reference_arm};

fn plant() -> Plant {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let damping = Damping::StiffnessProportional(reference.beta);
    let springs =
        vec![("lower".to_owned(), reference.K_S[0], damping), ("upper".to_owned(), reference.K_S[1], damping)];
    let motion = MotionFn(follow_reference_motion);
    Plant::new(model, springs, Arc::new(motion)).unwrap()
}

/// Truth: poses with the springs deflected and with the springs at zero; energy and loads from the
/// stiffness matrix.
#[test]
fn displacement_energy_and_loads_are_those_of_their_definitions() {
    let plant = plant();
    let (model, tool) = (&plant.model, plant.model.frame("tcp").unwrap().clone());
    let mut path = StaticPath::new(plant.clone());
    let mut data = Data::new(model);
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

    let mut stepper = new_stepper(StepperKind::default(), plant.clone(), 2e-3, Start::Equilibrium).unwrap();
    let mut seen = Observation::new(&plant);
    for _ in 0..150 {
        stepper.step().unwrap();
    }
    stepper.observe(&mut seen);
    let n = model.n_actuated();
    let (e, rates) = (seen.q.rows(n, 12).clone_owned(), seen.qdot.rows(n, 12).clone_owned());
    let forces = plant.stiffness() * &e + &plant.D * &rates;
    for (load, truth) in seen.load.iter().zip([forces.rows(0, 6), forces.rows(6, 6)]) {
        assert!((load + truth).norm() < 1e-12 * truth.norm());
    }
    let energy = plant.elastic_energy(seen.q.as_slice());
    assert!((seen.energy[2] - energy).abs() < 1e-13 * energy && energy > 0.0);
    assert!((seen.power[2] - rates.dot(&(&plant.D * &rates))).abs() < 1e-12 * seen.power[2]);
}
