//! Cost of a run with each stepper: steps, evaluations of the equations of motion (Newton
//! iterations) and factorisations.
//!
//! These numbers were printed by the program itself and only show changes, such as a modification
//! that gives the same results at twice the cost. If a change is intended, update the numbers; add
//! a line for a new stepper.

use std::sync::Arc;

use flexarm_kinematics::Model;
use flexarm_stepping::*;
use flexarm_testkit::{follow_reference_motion, reference_arm};

/// Stepper, step size (s), then the work: steps, evaluations, factorisations. The reference stepper
/// chooses its own steps.
const WORK: [(&str, f64, [u64; 3]); 6] = [
    ("generalized-alpha", 1e-3, [500, 678, 41]),
    ("spook", 1e-3, [500, 500, 500]),
    ("rk4", 1e-4, [5000, 20000, 0]),
    ("reference", 1e-3, [2750, 6374, 583]),
    ("sdirk3", 1e-3, [500, 4271, 13]),
    ("extrapolated-alpha", 1e-3, [500, 1965, 75]),
];

/// Half a second of the motion of the reference arm, with default settings and modal damping of 3
/// %.
#[test]
fn every_stepper_works_as_hard_as_it_did() {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K, Damping::Modal(0.03))).to_vec();
    let motion = MotionFn(follow_reference_motion);
    let plant = Plant::new(model, springs, Arc::new(motion)).expect("valid");
    let found = STEPPERS.map(|entry| {
        let told = WORK.iter().find(|work| work.0 == entry.name);
        let h = told.unwrap_or_else(|| panic!("{} has no line in WORK", entry.name)).1;
        let kind = (entry.with)(&StepperOptions::default());
        let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).expect("starts");
        (0..(0.5 / h).round() as usize).for_each(|_| stepper.step().expect("steps"));
        let Counts { steps, evaluations, factorisations } = stepper.counts();
        (entry.name, h, [steps, evaluations, factorisations])
    });
    assert_eq!(found, WORK);
}
