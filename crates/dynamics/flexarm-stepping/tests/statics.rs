//! At rest every stepper stays at the static equilibrium, for any step size.

use std::sync::Arc;

use flexarm_kinematics::{Model, Wrench};
use flexarm_stepping::*;
use flexarm_testkit::reference_arm;
use nalgebra::Vector3;

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

fn plant(beta: f64, loaded: bool) -> Plant {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let damping = Damping::StiffnessProportional(beta);
    let springs =
        vec![("lower".to_owned(), reference.K_S[0], damping), ("upper".to_owned(), reference.K_S[1], damping)];
    let tool = model.frame("link6").expect("there").body;
    let plant = Plant::new(model, springs, Arc::new(Held(POSE.to_vec()))).expect("valid");
    let load = Wrench::new(Vector3::new(200.0, -300.0, 150.0), Vector3::new(20.0, 10.0, -40.0));
    if loaded { plant.with_loads(vec![(tool, load)]).expect("valid") } else { plant }
}

fn tcp(seen: &Observation, model: &Model) -> Vector3<f64> {
    let frame = model.frame("tcp").expect("there");
    (seen.X_WB[frame.body] * frame.X_BF).translation.vector
}

fn deflection(plant: &Plant, kind: StepperKind, h: f64, start: Start, duration: f64) -> (Vector3<f64>, Vector3<f64>) {
    let model = plant.model.clone();
    let mut seen = Observation::new(plant);
    let mut stepper = new_stepper(kind, plant.clone(), h, start).expect("starts");
    stepper.observe(&mut seen);
    let before = tcp(&seen, &model);
    for _ in 0..((duration / h).ceil() as usize).max(20) {
        stepper.step().expect("steps");
    }
    stepper.observe(&mut seen);
    (before, tcp(&seen, &model))
}

const ALPHA: StepperKind = StepperKind::GeneralizedAlpha(AlphaSettings { rho: 0.9, dispersion_correction: true });
fn spook(preset: SpookPreset) -> StepperKind {
    StepperKind::Spook(SpookSettings { form: ConstraintForm::Local, preset })
}

/// Returns every stepper of the registry that accepts any step size, with its default settings.
fn any_length() -> impl Iterator<Item = StepperKind> {
    let entries = STEPPERS.into_iter().filter(|entry| entry.steps != StepRule::UpToTheStabilityLimit);
    entries.map(|entry| (entry.with)(&StepperOptions::default()))
}

/// Truth: Newton statics `K e + g(e) = 0`. Measured drift: generalised-alpha 2e-16 m, SPOOK 5e-13 m
/// of 1.9 mm.
#[test]
fn static_deflection_does_not_depend_on_the_step() {
    for loaded in [false, true] {
        let plant = plant(1e-3, loaded);
        let sag = static_deflection(&plant);
        assert!(sag > 1e-3, "{sag}");
        for h in [1e-5, 1e-4, 1e-3, 1e-2] {
            for kind in any_length().chain([spook(SpookPreset::Source)]) {
                let (before, after) = deflection(&plant, kind, h, Start::Equilibrium, 0.02);
                let drift = (after - before).norm();
                eprintln!("{:<18} loaded {loaded:<5} h {h:.0e}: drift {:.1e} of the sag", kind.name(), drift / sag);
                assert!(drift < 1e-8 * sag, "{} h {h}: {}", kind.name(), drift / sag);
            }
        }
    }
}

/// Returns the distance between the static and the undeformed TCP.
fn static_deflection(plant: &Plant) -> f64 {
    let mut seen = Observation::new(plant);
    let mut at = |start| {
        let mut stepper = new_stepper(ALPHA, plant.clone(), 1e-3, start).expect("starts");
        stepper.observe(&mut seen);
        tcp(&seen, &plant.model)
    };
    let sagging = at(Start::Equilibrium);
    (sagging - at(Start::Undeformed)).norm()
}

/// Started undeformed and damped to rest, every stepper reaches the static pose; measured 2e-12 to
/// 4e-10.
#[test]
fn a_ringing_arm_settles_on_the_static_pose() {
    let plant = plant(2e-2, true);
    let sag = static_deflection(&plant);
    let (truth, _) = deflection(&plant, ALPHA, 1e-3, Start::Equilibrium, 0.0);
    for (kind, h) in any_length().flat_map(|kind| [(kind, 1e-3), (kind, 1e-2)]) {
        let (_, end) = deflection(&plant, kind, h, Start::Undeformed, 3.0);
        let error = (end - truth).norm() / sag;
        eprintln!("{} h {h}: settled within {error:.1e} of the sag", kind.name());
        assert!(error < 1e-8, "{} h {h}: {error}", kind.name());
    }
}

/// The global form neglects a moment d × f: its rest pose has an error of the order of the
/// deflection, independent of the step size.
#[test]
fn global_constraints_rest_near_the_static_pose() {
    let plant = plant(2e-2, true);
    let sag = static_deflection(&plant);
    let (truth, _) = deflection(&plant, ALPHA, 1e-3, Start::Equilibrium, 0.0);
    let kind = StepperKind::Spook(SpookSettings { form: ConstraintForm::Global, preset: SpookPreset::Exact });
    let errors = [1e-3, 1e-2].map(|h| (deflection(&plant, kind, h, Start::Undeformed, 3.0).1 - truth).norm() / sag);
    eprintln!("global form: {errors:?} of the sag");
    assert!(errors.iter().all(|e| *e < 5e-3));
    assert!((errors[0] - errors[1]).abs() < 1e-7);
}

/// Truth: the drive torques at rest are the gravity torques of the deflected arm, in every stepper
/// from the first sample on; measured 2.6e-10.
#[test]
fn drives_carry_the_weight_from_the_first_sample_on() {
    let plant = plant(1e-3, false);
    let drive = |kind| {
        let mut seen = Observation::new(&plant);
        let mut stepper = new_stepper(kind, plant.clone(), 1e-3, Start::Equilibrium).expect("starts");
        stepper.observe(&mut seen);
        let first = seen.drive.clone();
        stepper.step().expect("steps");
        stepper.observe(&mut seen);
        (first, seen.drive.clone())
    };
    let (truth, _) = drive(ALPHA);
    assert!(truth.amax() > 500.0);
    for kind in any_length().chain([spook(SpookPreset::Source)]) {
        let (first, second) = drive(kind);
        for found in [first, second] {
            let error = (&found - &truth).amax() / truth.amax();
            eprintln!("{}: drive torques within {error:.1e}", kind.name());
            assert!(error < 1e-7, "{}: {error:e}", kind.name());
        }
    }
}

/// Truth: the fastest decay of an overdamped mode, `(d + sqrt(d² - 4 omega²))/2` with
/// `d = 2 ζ omega`, against the limit of RK4 on the real axis, 2.78. A check with d itself would
/// refuse steps up to a factor of two below the limit.
#[test]
fn rk4_takes_steps_up_to_the_decay_of_an_overdamped_mode() {
    let undamped = plant(0.0, false);
    let omega = undamped.modes.omega.iter().copied().fold(0.0, f64::max);
    let beta = 2.2 / omega;
    let damped = plant(beta, false);
    let fastest = damped.modes.omega.iter().map(|w| {
        let d = beta * w * w;
        0.5 * (d + (d * d - 4.0 * w * w).max(0.0).sqrt())
    });
    let limit = 2.78 / fastest.fold(0.0, f64::max);
    assert!(limit > 1.2 * 2.78 / (beta * omega * omega), "the two rules must differ for this test to say anything");
    let mut stepper = new_stepper(StepperKind::Rk4, damped.clone(), 0.95 * limit, Start::Undeformed).expect("stable");
    let mut seen = Observation::new(&damped);
    for _ in 0..20_000 {
        stepper.step().expect("steps");
    }
    stepper.observe(&mut seen);
    let still = static_deflection(&damped);
    assert!(seen.qdot.amax() < 1e3 * still && seen.q.amax().is_finite(), "{}", seen.qdot.amax());
    let refused = new_stepper(StepperKind::Rk4, damped, 1.05 * limit, Start::Undeformed).err();
    match refused {
        Some(StepError::UnstableStep { largest_s, .. }) => {
            assert!((largest_s / limit - 1.0).abs() < 1e-3, "{largest_s} {limit}")
        }
        other => panic!("{other:?}"),
    }
}

/// Truth: Newton statics from scratch at each time. Measured 3e-12 of the largest deflection.
#[test]
fn equilibria_followed_along_a_motion_are_those_found_at_each_instant() {
    let mut plant = plant(1e-3, true);
    let swing = MotionFn(|t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
        for (k, q) in q.iter_mut().enumerate() {
            *q = POSE[k] + 0.8 * (1.3 * t + k as f64).sin();
        }
        qdot.fill(0.0);
        qddot.fill(0.0);
    });
    plant.motion = Arc::new(swing);
    let mut heavier = plant.model.bodies()[plant.loads[0].body].inertia;
    heavier += plant.model.bodies()[plant.loads[0].body].inertia;
    plant.inertia_changes = vec![InertiaChange { t: 1.0, body: plant.loads[0].body, inertia: heavier }];
    let mut path = StaticPath::new(plant.clone());
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for k in 0..=100 {
        let t = 0.02 * f64::from(k);
        if k == 50 {
            // Events at a time are still pending just before it.
            let before = path.just_before(t).expect("an equilibrium").rows(6, 12).clone_owned();
            let truth = static_equilibrium(&plant, t).expect("an equilibrium");
            worst = worst.max((before - &truth).amax());
        }
        let e = path.at(t).expect("an equilibrium").rows(6, 12).clone_owned();
        if k == 50 {
            plant.model = Arc::new(plant.model.with_inertia(plant.loads[0].body, heavier));
        }
        let truth = static_equilibrium(&plant, t).expect("an equilibrium");
        worst = worst.max((e - &truth).amax());
        largest = largest.max(truth.amax());
    }
    eprintln!("followed equilibria within {:.1e} of the largest deflection {largest:.3e}", worst / largest);
    assert!(worst < 1e-9 * largest);
}
