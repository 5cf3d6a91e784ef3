//! Runs whose iterations converge fully, and differences of them: closed form of one mass.

use std::sync::Arc;

use flexarm_kinematics::{Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose};
use flexarm_stepping::*;
use flexarm_testkit::{reference_arm, reference_motion};
use nalgebra::{DMatrix, Matrix3, Vector3};

/// A mass on a vertical spring, with a damper.
fn oscillator([m, k, d]: [f64; 3]) -> Plant {
    let mut tree = Mechanism::new("mass on a spring");
    tree.links.push(Link { name: "ground".into(), inertia: None });
    let inertia = LinkInertia { mass: m, com: Vector3::zeros(), inertia_com: Matrix3::identity() };
    tree.links.push(Link { name: "mass".into(), inertia: Some(inertia) });
    let slide = JointKind::ElasticPrismatic(Vector3::z_axis());
    tree.joints.push(Joint::new("spring", slide, "ground", "mass", Pose::identity()));
    let spring = Spring::linear("spring", DMatrix::from_element(1, 1, k), Damping::Dampers([d; 6]));
    Plant::new(Arc::new(Model::new(&tree).unwrap()), vec![spring], Arc::new(Held(vec![]))).unwrap()
}

/// Closed form of the fall from the relaxed spring.
fn fall([m, k, d]: [f64; 3], t: f64) -> f64 {
    let (w2, s) = (k / m, d / (2.0 * m));
    let w = (w2 - s * s).sqrt();
    -m * 9.81 / k * (1.0 - (-s * t).exp() * ((w * t).cos() + s / w * (w * t).sin()))
}

/// Central difference in the logarithm of one of three numbers.
fn difference(h: f64, which: usize, numbers: [f64; 3], of: impl Fn([f64; 3]) -> f64) -> f64 {
    let at = |x: f64| {
        let mut numbers = numbers;
        numbers[which] *= x.exp();
        of(numbers)
    };
    (at(h) - at(-h)) / (2.0 * h)
}

/// Truth: closed form. Differences of runs converge to the derivatives as the run itself does, with
/// the square of the step size. Rounding is invisible: differences over 3e-5 and 1e-4 agree up to
/// the truncation of the latter, measured 2e-7.
#[test]
fn a_falling_mass_depends_on_mass_spring_and_damper_as_in_closed_form() {
    let numbers = [10.0, 1.6e4, 60.0];
    let sag = numbers[0] * 9.81 / numbers[1];
    for dispersion_correction in [false, true] {
        let last = |step_s: f64, numbers: [f64; 3]| {
            let plant = oscillator(numbers);
            let settings = AlphaSettings { rho: 0.9, dispersion_correction };
            let tool = plant.model.frame("mass").unwrap().clone();
            let run = ExactRun { settings, step_s, duration_s: 0.4, start: Start::Undeformed, tool };
            run.errors(&plant).unwrap().errors.last().unwrap()[2]
        };
        for which in 0..3 {
            let truth = difference(1e-4, which, numbers, |numbers| fall(numbers, 0.4));
            let of = |h: f64, step_s: f64| difference(h, which, numbers, |numbers| last(step_s, numbers));
            let errors = [1e-3, 5e-4].map(|step_s| (of(3e-5, step_s) - truth).abs() / sag);
            let noise = (of(3e-5, 1e-3) - of(1e-4, 1e-3)).abs() / sag;
            eprintln!("correction {dispersion_correction}, number {which}: {errors:?}, between steps {noise:.1e}");
            let order = (errors[0] / errors[1]).log2();
            assert!((order - 2.0).abs() < 0.25, "{which}: order {order}, {errors:?}");
            // 3e-2 to 1e-3 of the sag without the correction: the phase drifts over four periods.
            assert!(errors[1] < 3e-2, "{errors:?}");
            assert!(noise < 1e-6, "{noise:e}");
        }
    }
}

/// An ordinary run ends its iterations early and keeps its matrices: the effect is small compared
/// with the error of its step.
#[test]
fn the_exact_run_is_the_ordinary_run_but_for_what_iterations_leave() {
    let reference = reference_arm(true);
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K / 10.0, Damping::StiffnessProportional(1e-3))).to_vec();
    let motion = MotionFn(|t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
        let (x, y, z) = reference_motion(t);
        q.copy_from_slice(&x);
        qdot.copy_from_slice(&y);
        qddot.copy_from_slice(&z);
    });
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let plant = Plant::new(model, springs, Arc::new(motion)).unwrap();
    let tool = plant.model.frame("tcp").unwrap().clone();
    let settings = AlphaSettings::default();
    let run = ExactRun { settings, step_s: 2e-3, duration_s: 0.4, start: Start::Equilibrium, tool: tool.clone() };
    let exact = run.errors(&plant).unwrap();
    let ordinary = |step_s: f64| {
        let mut stepper =
            new_stepper(StepperKind::GeneralizedAlpha(settings), plant.clone(), step_s, Start::Equilibrium).unwrap();
        let mut seen = Observation::new(&plant);
        let every = (2e-3 / step_s).round() as usize;
        let place = |stepper: &mut Box<dyn Stepper>, seen: &mut Observation| {
            stepper.observe(seen);
            (seen.X_WB[tool.body] * tool.X_BF).translation.vector
        };
        let mut places = vec![place(&mut stepper, &mut seen)];
        for _ in 0..200 {
            (0..every).for_each(|_| stepper.step().unwrap());
            places.push(place(&mut stepper, &mut seen));
        }
        places
    };
    let (coarse, fine) = (ordinary(2e-3), ordinary(1e-4));
    let error = coarse.iter().zip(&fine).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    // The rigid arm is the same at the same times.
    let parts = |errors: &[f64; 6]| Vector3::new(errors[0], errors[1], errors[2]);
    let shift: Vec<Vector3<f64>> = exact.errors.iter().zip(&coarse).map(|(e, p)| parts(e) - p).collect();
    let rigid = |t: f64| {
        let mut q = nalgebra::DVector::zeros(plant.model.nv());
        q.as_mut_slice()[..6].copy_from_slice(&reference_motion(t).0);
        let mut data = flexarm_kinematics::Data::new(&plant.model);
        flexarm_kinematics::forward_kinematics(&plant.model, &mut data, &q);
        data.X_WF(&tool).translation.vector
    };
    let off = exact.times_s.iter().zip(&shift).map(|(t, shift)| (shift + rigid(*t)).norm());
    let left = off.fold(0.0, f64::max);
    eprintln!("left {left:.1e} m, error of the step {error:.1e} m");
    assert!(exact.errors.len() == 201 && left < 0.1 * error, "{left:e} {error:e}");
}

#[test]
fn a_step_that_is_no_time_is_refused() {
    let plant = oscillator([10.0, 1.6e4, 60.0]);
    let (settings, tool) = (AlphaSettings::default(), plant.model.frame("mass").unwrap().clone());
    for step_s in [0.0, f64::NAN] {
        let run = ExactRun { settings, step_s, duration_s: 0.1, start: Start::Equilibrium, tool: tool.clone() };
        let error = run.errors(&plant).unwrap_err().to_string();
        assert!(error.contains("positive time in seconds"), "{error}");
    }
}
