//! Arms with closed loops in motion: steppers against each other, statics, modes, energy, servos,
//! refused cases.

use std::sync::Arc;

use flexarm_kinematics::{Data, Model, State, Wrench, forward_kinematics, frame_jacobian, inverse_dynamics};
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::palletising_arm;
use nalgebra::{DVector, Matrix6xX, Vector3};

const POSE: [f64; 3] = [0.3, 0.35, 0.2];

fn plant(motion: Arc<dyn PrescribedMotion>, beta: f64) -> Plant {
    let made = palletising_arm(true);
    let spring = |(name, K): (String, _)| Spring::linear(name, K, Damping::StiffnessProportional(beta));
    let springs: Vec<Spring> = made.springs.into_iter().map(spring).collect();
    Plant::new(Arc::new(Model::new(&made.mechanism).unwrap()), springs, motion).unwrap()
}

/// Returns a motion from [`POSE`] to another pose in 0.6 s, with continuous acceleration.
fn moving() -> Arc<dyn PrescribedMotion> {
    Arc::new(MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        let (s, T) = ((t / 0.6).clamp(0.0, 1.0), 0.6);
        let rise = [
            s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s),
            30.0 * s * s * (1.0 - s).powi(2),
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
        ];
        for (k, by) in [0.8, 0.35, -0.3].into_iter().enumerate() {
            (q[k], v[k], a[k]) = (POSE[k] + by * rise[0], by * rise[1] / T, by * rise[2] / (T * T));
        }
    }))
}

fn of(word: &str) -> StepperKind {
    let entry = STEPPERS.into_iter().find(|entry| entry.name == word).unwrap();
    (entry.with)(&StepperOptions::default())
}

/// Returns the final state of a run: position of the tool, energies (kinetic, potential, elastic),
/// drive forces.
fn end(plant: &Plant, kind: StepperKind, h: f64, duration: f64) -> (Vector3<f64>, f64, DVector<f64>) {
    let tool = plant.model.frame("tool").unwrap().clone();
    let mut seen = Observation::new(plant);
    let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).unwrap();
    (0..(duration / h).round() as usize).for_each(|_| stepper.step().unwrap());
    stepper.observe(&mut seen);
    ((seen.X_WB[tool.body] * tool.X_BF).translation.vector, seen.energy[1], seen.drive.clone())
}

/// Truth: the reference stepper on the same equations. Differences relative to the deflection at
/// the end of the motion: measured generalised-alpha 1.0e-6, SDIRK3 8e-7, RK4 1.1e-7.
#[test]
fn steppers_agree_on_an_arm_with_a_loop() {
    let plant = plant(moving(), 1e-4);
    let (truth, _, drives) = end(&plant, of("reference"), 1e-3, 0.5);
    let rigid = {
        let mut data = Data::new(&plant.model);
        let (mut state, mut a) = (State::zeros(&plant.model), DVector::zeros(plant.model.nv()));
        plant.prescribed_state(0.5, &mut state, &mut a);
        forward_kinematics(&plant.model, &mut data, &state.q);
        data.X_WF(plant.model.frame("tool").unwrap()).translation.vector
    };
    let share = (truth - rigid).norm();
    assert!(share > 1e-4, "{share}");
    for (word, h) in [("generalized-alpha", 2e-4), ("sdirk3", 2e-4), ("rk4", 2e-5)] {
        let (found, _, torque) = end(&plant, of(word), h, 0.5);
        let off = (found - truth).norm() / share;
        let torque = (torque - &drives).amax() / drives.amax();
        eprintln!("{word} h {h:.0e}: {off:.1e} of the deflection ({share:.1e} m), torques {torque:.1e}");
        assert!(off < 1e-5, "{word} {off:e}");
        assert!(torque < 1e-5, "{word} {torque:e}");
    }
}

/// Truth: the reference stepper. SPOOK is of first order: half the step size halves the error of
/// its torques (1.3e-3 at 0.4 ms, 1.6e-4 at 0.05 ms), the error of its tool is 3.7e-6 m and 1.2e-7
/// m.
#[test]
fn spook_tends_to_the_others_on_an_arm_with_a_loop() {
    let plant = plant(moving(), 1e-3);
    let (truth, _, drives) = end(&plant, of("reference"), 1e-3, 0.5);
    let mut last = f64::INFINITY;
    for h in [4e-4, 2e-4, 1e-4, 5e-5] {
        let (found, _, torque) = end(&plant, of("spook"), h, 0.5);
        let off = (found - truth).norm();
        let torque = (torque - &drives).amax() / drives.amax();
        eprintln!("spook h {h:.0e}: {off:.2e} m, torques {torque:.1e}");
        assert!(off < 2e-2 * h && torque < 10.0 * h, "{off:e} {torque:e}");
        assert!(torque < 0.55 * last, "{torque:e} {last:e}");
        last = torque;
    }
}

/// Truth: virtual work of springs and weight about the rigid pose. To first order in the compliance
/// of the springs the tool moves by `-J K^-1 g`, with J and g of the closed model; the remainder is
/// due to the deflection itself, measured 7.7e-8 of it.
#[test]
fn an_arm_with_a_loop_rests_where_virtual_work_says() {
    let mut plant = plant(Arc::new(Held(POSE.to_vec())), 1e-3);
    // Ten thousand times stiffer, to reduce the second-order remainder.
    for element in &mut plant.elements {
        element.K *= 1e4;
    }
    plant.update_modes_and_damping().unwrap();
    let (model, tool) = (&plant.model, plant.model.frame("tool").unwrap());
    let (mut data, mut state) = (Data::new(model), State::zeros(model));
    state.q.rows_mut(0, 3).copy_from_slice(&POSE);
    let g =
        flexarm_kinematics::gravity_forces(model, &mut data, &state.q).rows(3, plant.model.n_elastic()).into_owned();
    forward_kinematics(model, &mut data, &state.q);
    let (rigid, mut J) = (data.X_WF(tool).translation.vector, Matrix6xX::zeros(model.nv()));
    frame_jacobian(model, &data, tool, &mut J);
    let e = -plant.stiffness().cholesky().unwrap().solve(&g);
    let expected = J.view((0, 3), (3, e.len())) * &e;
    let (found, ..) = end(&plant, StepperKind::default(), 1e-3, 0.0);
    let off = (found - rigid - &expected).norm() / expected.norm();
    eprintln!("sag {:.3e} m, {off:.1e} of it from first order", expected.norm());
    assert!(off < 1e-6, "{off:e}");
}

/// Truth: differences of equilibria under small forces. Compliance of [`linearise`] and of
/// [`OperatingPoint`], measured 1.3e-8.
#[test]
fn compliance_over_a_loop_is_the_slope_of_the_equilibria() {
    let plant = plant(Arc::new(Held(POSE.to_vec())), 1e-3);
    let tool = plant.model.frame("tool").unwrap().clone();
    let linear = linearise(&plant, &tool, &Wrench::zeros(), 0.0).unwrap();
    let mut point = OperatingPoint::new(plant.clone(), tool.clone());
    let mut place = |F: Vector3<f64>| {
        point.solve(&POSE, &Wrench::new(F, Vector3::zeros())).unwrap();
        point.tcp_pose().translation.vector
    };
    let C = linear.compliance().unwrap();
    for k in 0..3 {
        let F = Vector3::ith(k, 200.0);
        let slope = (place(F) - place(-F)) / 400.0;
        let own = C.fixed_view::<3, 1>(0, k).into_owned();
        let off = (slope - own).norm() / own.norm();
        eprintln!("compliance {k}: {off:.1e}");
        assert!(off < 2e-7, "{off:e}");
    }
    point.solve(&POSE, &Wrench::zeros()).unwrap();
    assert!((point.compliance() - C).amax() < 1e-9 * C.amax());
}

/// Truth: without damping and with locked drives the energy is conserved; RK4 at 10 us, measured
/// 4.3e-11 of the exchanged energy.
#[test]
fn a_ringing_arm_with_a_loop_keeps_its_energy() {
    let plant = plant(Arc::new(Held(POSE.to_vec())), 1e-14);
    let mut stepper = new_stepper(of("rk4"), plant.clone(), 1e-5, Start::Undeformed).unwrap();
    let mut seen = Observation::new(&plant);
    let (mut totals, mut kinetic) = (Vec::new(), 0.0f64);
    for _ in 0..5000 {
        stepper.step().unwrap();
        stepper.observe(&mut seen);
        totals.push(seen.energy.iter().sum::<f64>());
        kinetic = kinetic.max(seen.energy[0]);
    }
    let (low, high) = totals.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(*e), h.max(*e)));
    eprintln!("energy open by {:.1e} of {kinetic:.3} J", (high - low) / kinetic);
    assert!((high - low) < 1e-9 * kinetic, "{:e} {kinetic}", high - low);
}

/// Identity: `K φ = ω² M φ` with the matrices of [`linearise`] has the frequencies of the operating
/// point.
#[test]
fn frequencies_over_a_loop_agree_between_linear_structure_and_operating_point() {
    let plant = plant(Arc::new(Held(POSE.to_vec())), 1e-3);
    let tool = plant.model.frame("tool").unwrap().clone();
    let linear = linearise(&plant, &tool, &Wrench::zeros(), 0.0).unwrap();
    let mut point = OperatingPoint::new(plant.clone(), tool);
    point.solve(&POSE, &Wrench::zeros()).unwrap();
    let L = linear.M.clone().cholesky().unwrap().l();
    let inverse = L.clone().try_inverse().unwrap();
    let mut squares: Vec<f64> =
        (&inverse * &linear.K * inverse.transpose()).symmetric_eigenvalues().iter().copied().collect();
    squares.sort_by(f64::total_cmp);
    for (hz, square) in point.frequencies_hz().iter().zip(&squares) {
        let truth = square.sqrt() / std::f64::consts::TAU;
        assert!((hz - truth).abs() < 1e-8 * truth, "{hz} {truth}");
    }
    assert!(squares[0] > 0.0 && point.frequencies_hz()[0] < 60.0, "{:?}", point.frequencies_hz());
}

/// Truth: with the torques of its inverse dynamics as feed-forward a rigid arm stays on its motion.
/// Sampled at 0.1 ms, measured 3.9e-6 rad and 0.34 % of the torque.
#[test]
fn servos_drive_a_rigid_arm_with_a_loop_along_its_motion() {
    let model = Arc::new(Model::new(&palletising_arm(false).mechanism).unwrap());
    let axis = |coordinate| ServoAxis {
        coordinate,
        position_gain: 20.0,
        velocity_gain: 4e4,
        integral_gain: 1e5,
        feed_forward: 1.0,
        limit: f64::INFINITY,
    };
    let servo = Servo { sample_s: 1e-4, axes: (0..3).map(axis).collect(), rigid: model.clone() };
    let plant = Plant::new(model.clone(), Vec::<Spring>::new(), moving()).unwrap().with_servo(servo).unwrap();
    let mut seen = Observation::new(&plant);
    let mut stepper = new_stepper(StepperKind::default(), plant.clone(), 1e-4, Start::Equilibrium).unwrap();
    let (mut data, mut state, mut a) = (Data::new(&model), State::zeros(&model), DVector::zeros(3));
    let (mut worst, mut torque) = (0.0f64, 0.0f64);
    for _ in 0..5000 {
        stepper.step().unwrap();
        stepper.observe(&mut seen);
        plant.prescribed_state(stepper.time(), &mut state, &mut a);
        worst = worst.max((&seen.q - &state.q).amax());
        let needed = inverse_dynamics(&model, &mut data, &state, &a);
        torque = torque.max((&seen.drive - needed).amax() / needed.amax());
    }
    eprintln!("servos: {worst:.1e} rad off, torques {torque:.1e}");
    assert!(worst < 2e-5, "{worst:e}");
    assert!(torque < 2e-2, "{torque:e}");
}

#[test]
fn steps_over_a_loop_do_not_allocate() {
    for (word, h) in [("generalized-alpha", 2e-4), ("sdirk3", 2e-4), ("rk4", 2e-5), ("spook", 2e-4)] {
        let mut stepper = new_stepper(of(word), plant(moving(), 1e-4), h, Start::Equilibrium).unwrap();
        (0..20).for_each(|_| stepper.step().unwrap());
        assert_eq!(count_allocations(|| (0..100).for_each(|_| stepper.step().unwrap())), 0, "{word}");
    }
}

/// A crank that turns until the rod is too short: all steppers stop there and report place and
/// cause.
#[test]
fn a_motion_that_tears_a_loop_apart_ends_with_its_name_and_time() {
    let tearing = || -> Arc<dyn PrescribedMotion> {
        Arc::new(MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
            let s = (t / 0.4).clamp(0.0, 1.0);
            for (k, by) in [0.0, -1.6, 3.0].into_iter().enumerate() {
                q[k] = by * s;
                v[k] = if s < 1.0 { by / 0.4 } else { 0.0 };
                a[k] = 0.0;
            }
        }))
    };
    for word in ["generalized-alpha", "sdirk3", "rk4", "reference", "spook"] {
        let mut stepper =
            new_stepper(of(word), plant(tearing(), 1e-3), if word == "rk4" { 2e-5 } else { 1e-3 }, Start::Equilibrium)
                .unwrap();
        let error = (0..40_000).find_map(|_| stepper.step().err()).expect("it must stop");
        eprintln!("{word}: {error}");
        assert!(
            matches!(&error, StepError::OpenLoop { t, name } if *t > 0.05 && *t < 0.4 && name == "drive of the upper arm"),
            "{word}: {error}"
        );
    }
    let far = plant(Arc::new(Held(vec![0.0, 0.0, 0.0])), 1e-3);
    let mut point = OperatingPoint::new(far.clone(), far.model.frame("tool").unwrap().clone());
    let error = point.solve(&[0.0, -2.0, 3.1], &Wrench::zeros()).unwrap_err();
    assert!(matches!(error, StepError::OpenLoop { .. }), "{error}");
}
