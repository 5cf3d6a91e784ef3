//! Linearisation about a static pose against the nonlinear arm.

use std::sync::Arc;

use flexarm_kinematics::{Data, Frame, Model, State, Wrench, forward_kinematics, inverse_dynamics, rotation_vector};
use flexarm_stepping::*;
use flexarm_testkit::reference_arm;
use nalgebra::{DVector, Matrix6, Vector3, Vector6};

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

fn arm_at(pose: &[f64], softer: f64) -> (Plant, Frame) {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let spring = |name: &str, k: usize| (name.to_owned(), reference.K_S[k] / softer, Damping::Modal(0.03));
    let tool = model.frame("tcp").expect("there").clone();
    let springs = vec![spring("lower", 0), spring("upper", 1)];
    (Plant::new(model, springs, Arc::new(Held(pose.to_vec()))).expect("valid"), tool)
}

fn wrench(F: &Vector6<f64>) -> Wrench {
    Wrench::new(F.fixed_rows::<3>(0).into(), F.fixed_rows::<3>(3).into())
}

fn at(plant: &Plant, tool: &Frame, F: &Vector6<f64>) -> Linear {
    linearise(plant, tool, &wrench(F), 0.0).expect("an equilibrium")
}

/// Returns the small displacement of the tool from one equilibrium to another.
fn moved(from: &Linear, to: &Linear) -> Vector6<f64> {
    let d = to.X_WT.translation.vector - from.X_WT.translation.vector;
    let phi = rotation_vector((to.X_WT.rotation * from.X_WT.rotation.inverse()).matrix());
    Vector6::new(d.x, d.y, d.z, phi.x, phi.y, phi.z)
}

/// Truth: central differences of the nonlinear equilibrium with respect to the wrench, under weight
/// and under an additional heavy load (force and moment), on an arm twenty times softer than the
/// reference arm (sag 4 cm), for which the geometric stiffness matters.
#[test]
fn compliance_is_the_derivative_of_the_nonlinear_equilibrium() {
    let (plant, tool) = arm_at(&POSE, 20.0);
    for load in [
        Vector6::zeros(),
        Vector6::new(200.0, -300.0, 150.0, 0.0, 0.0, 0.0),
        Vector6::new(90.0, 50.0, -200.0, 80.0, -60.0, 40.0),
    ] {
        let here = at(&plant, &tool, &load);
        let C = here.compliance().expect("stiff");
        let mut differences = Matrix6::zeros();
        for k in 0..6 {
            let step = if k < 3 { 2.0 } else { 1.0 };
            let mut part = Vector6::zeros();
            part[k] = step;
            let change = moved(&at(&plant, &tool, &(load - part)), &at(&plant, &tool, &(load + part)));
            differences.set_column(k, &(change / (2.0 * step)));
        }
        // Metres and radians: each entry is relative to the diagonal of its row and column.
        let scale = |i: usize, j: usize| (C[(i, i)] * C[(j, j)]).sqrt();
        let error = Matrix6::from_fn(|i, j| (C[(i, j)] - differences[(i, j)]) / scale(i, j)).amax();
        let skew = Matrix6::from_fn(|i, j| (C[(i, j)] - C[(j, i)]) / scale(i, j)).amax();
        let springs_alone = {
            let K = plant.stiffness();
            let C = &here.J * K.cholesky().expect("stiff").solve(&here.J.transpose());
            Matrix6::from_fn(|i, j| (C[(i, j)] - differences[(i, j)]) / scale(i, j)).amax()
        };
        eprintln!(
            "load {:.0} N: compliance within {error:.1e}, skew {skew:.1e}, springs alone {springs_alone:.1e}",
            load.norm()
        );
        assert!(error < 1e-6); // measured 2.6e-8
        assert!(springs_alone > 100.0 * error, "weight and load must count here");
        // A constant moment is not conservative.
        assert!(if load.fixed_rows::<3>(3).norm() == 0.0 { skew < 1e-12 } else { skew > 1e-3 });
        assert!(here.residual < 1e-12);
    }
}

/// Truth: the static start of a stepper with the wrench as a load on the tool's body. A force at To
/// is a force at Bo with a moment; the lever arm is that of the final pose.
#[test]
fn the_equilibrium_under_a_wrench_is_that_of_the_steppers() {
    let (plant, tool) = arm_at(&POSE, 5.0);
    let load = Vector6::new(200.0, -300.0, 150.0, 20.0, 10.0, -40.0);
    let found = at(&plant, &tool, &load);
    let mut data = Data::new(&plant.model);
    forward_kinematics(&plant.model, &mut data, &found.q);
    let r = found.X_WT.translation.vector - data.X_WB[tool.body].translation.vector;
    let (f, moment): (Vector3<f64>, Vector3<f64>) = (load.fixed_rows::<3>(0).into(), load.fixed_rows::<3>(3).into());
    let at_body = Wrench::new(f, moment + r.cross(&f));
    let loaded = plant.clone().with_loads(vec![(tool.body, at_body)]).expect("carries it");
    let truth = static_equilibrium(&loaded, 0.0).expect("an equilibrium");
    let error = (&found.equilibrium - &truth).amax() / truth.amax();
    eprintln!("equilibrium within {error:.1e}");
    assert!(error < 1e-11); // measured 6e-14

    // Holding torques: the drives of the loaded arm at rest.
    let mut seen = Observation::new(&loaded);
    let kind = StepperKind::GeneralizedAlpha(AlphaSettings::default());
    new_stepper(kind, loaded, 1e-3, Start::Equilibrium).expect("starts").observe(&mut seen);
    let error = (&found.holding - &seen.drive).amax() / seen.drive.amax();
    eprintln!("holding torques within {error:.1e}");
    assert!(error < 1e-10); // measured 4e-14
}

/// Truth: modes of the arm from the other routine, and central differences of inverse dynamics with
/// respect to the joints.
#[test]
fn matrices_are_those_of_the_modes_and_of_inverse_dynamics() {
    let (plant, tool) = arm_at(&POSE, 1.0);
    let here = at(&plant, &tool, &Vector6::zeros());
    let mut worst = 0.0f64;
    for (j, omega) in plant.modes.omega.iter().enumerate() {
        let phi = plant.modes.shapes.column(j);
        let ratio = phi.dot(&(&here.K * phi)) / phi.dot(&(&here.M * phi)) / (omega * omega);
        worst = worst.max((ratio - 1.0).abs());
    }
    eprintln!("omega² within {worst:.1e}");
    assert!(worst < 1e-9); // measured 6e-15

    // Forces on the elastic coordinates for an accelerated and for a moved joint.
    let model = &plant.model;
    let (m, n) = (model.n_actuated(), here.equilibrium.len());
    let mut data = Data::new(model);
    let mut elastic_force = |q: &DVector<f64>, qddot: &DVector<f64>| -> DVector<f64> {
        let state = State { q: q.clone(), qdot: DVector::zeros(model.nv()) };
        inverse_dynamics(model, &mut data, &state, qddot).rows(m, n).into_owned()
    };
    let rest = DVector::zeros(model.nv());
    let still = elastic_force(&here.q, &rest);
    for k in 0..m {
        let mut accelerated = rest.clone();
        accelerated[k] = 1.0;
        let inertia = elastic_force(&here.q, &accelerated) - &still;
        let error = (inertia - here.M_a.column(k)).amax() / here.M_a.amax();
        assert!(error < 1e-12, "{error:e}"); // measured 1e-15
        let step = 1e-4;
        let mut turned = here.q.clone();
        turned[k] += step;
        let up = elastic_force(&turned, &rest);
        turned[k] -= 2.0 * step;
        let slope = (up - elastic_force(&turned, &rest)) / (2.0 * step);
        let error = (slope - here.K_a.column(k)).amax() / here.K_a.amax();
        assert!(error < 1e-7, "{error:e}"); // measured 2e-9
    }
}

/// A rigid robot has no compliance, and its drives hold the gravity torques.
#[test]
fn a_rigid_arm_does_not_yield() {
    let reference = reference_arm(false);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let plant = Plant::new(model.clone(), Vec::<Spring>::new(), Arc::new(Held(POSE.to_vec()))).expect("valid");
    let tool = model.frame("tcp").expect("there").clone();
    let here = at(&plant, &tool, &Vector6::new(100.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    assert_eq!(here.compliance().expect("no motion at all"), Matrix6::zeros());
    let weight = at(&plant, &tool, &Vector6::zeros());
    let push = here.J_a.row(0).transpose() * 100.0;
    assert!((&weight.holding - &here.holding - push).amax() < 1e-10);
}
