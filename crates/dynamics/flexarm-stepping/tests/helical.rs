//! A body on a helical joint (spindle), driven and on a spring, in closed form with every stepper.

use std::sync::Arc;

use flexarm_kinematics::*;
use flexarm_stepping::*;
use nalgebra::{DMatrix, Matrix3, Vector3};

const MASS: f64 = 4.0;
const I_ZZ: f64 = 0.02;
const PITCH: f64 = 0.05;
const STIFFNESS: f64 = 60.0;
const G: f64 = 9.81;

/// Effective inertia of the coordinate: I_zz + m p².
const INERTIA: f64 = I_ZZ + MASS * PITCH * PITCH;

fn steppers() -> [StepperKind; 4] {
    [
        StepperKind::GeneralizedAlpha(AlphaSettings::default()),
        StepperKind::Rk4,
        StepperKind::Reference(ReferenceSettings::new(1e-9)),
        StepperKind::Spook(SpookSettings::default()),
    ]
}

/// Returns an upright spindle that carries a body, behind a spring if `spring`.
fn spindle(spring: bool, motion: Arc<dyn PrescribedMotion>) -> Plant {
    let mut tree = Mechanism::new("spindle");
    let axis = Vector3::z_axis();
    let inertia_com = Matrix3::from_diagonal(&Vector3::new(0.03, 0.03, I_ZZ));
    let inertia = LinkInertia { mass: MASS, com: Vector3::zeros(), inertia_com };
    tree.links.push(Link { name: "base".into(), inertia: None });
    let drive = JointKind::Helical { axis, pitch: PITCH };
    let (last, parent) = match spring {
        true => ("motor", "motor"),
        false => ("body", "base"),
    };
    tree.joints.push(Joint::new("spindle", drive, "base", last, Pose::identity()));
    if spring {
        tree.links.push(Link { name: "motor".into(), inertia: None });
        tree.joints.push(Joint::new("spring", drive.spring().unwrap(), parent, "body", Pose::identity()));
    }
    tree.links.push(Link { name: "body".into(), inertia: Some(inertia) });
    let damping = Damping::StiffnessProportional(0.0);
    let K = DMatrix::from_element(1, 1, STIFFNESS);
    let springs = Spring::linear("spring", K, damping);
    let springs = if spring { vec![springs] } else { vec![] };
    Plant::new(Arc::new(Model::new(&tree).unwrap()), springs, motion).unwrap()
}

/// Truth: released with relaxed spring, the spindle oscillates as φ₀ (1 - cos ωt) with φ₀ = -m g
/// p/k and ω² = k/(I_zz + m p²); at rest it stays at φ₀.
///
/// Measured, relative to the sag: generalised-alpha 6e-8, RK4 1e-9, reference 1e-7, SPOOK 5e-3; at
/// rest at most 2e-10.
#[test]
fn a_body_on_a_sprung_spindle_swings_about_its_sag() {
    let plant = spindle(true, Arc::new(Held(vec![0.0])));
    let (sag, omega) = (-MASS * G * PITCH / STIFFNESS, (STIFFNESS / INERTIA).sqrt());
    assert!((plant.modes.omega[0] / omega - 1.0).abs() < 1e-12, "{} {omega}", plant.modes.omega[0]);
    let h = 2e-4;
    for (kind, bound) in steppers().into_iter().zip([1e-5, 1e-7, 5e-6, 5e-2]) {
        let mut worst = [0.0f64; 2];
        for (start, worst) in [Start::Equilibrium, Start::Undeformed].into_iter().zip(&mut worst) {
            let mut stepper = new_stepper(kind, plant.clone(), h, start).unwrap();
            let mut seen = Observation::new(&plant);
            for _ in 0..2500 {
                stepper.step().unwrap();
                stepper.observe(&mut seen);
                let swing = if start == Start::Undeformed { (omega * seen.t).cos() } else { 0.0 };
                *worst = worst.max((seen.q[1] - sag * (1.0 - swing)).abs() / sag.abs());
                // The body has rotated by φ and moved by p φ.
                let X = seen.X_WB[2];
                let turned = rotation_vector(X.rotation.matrix()).z;
                assert!((turned - seen.q[1]).abs() < 1e-9 && (X.translation.z - PITCH * seen.q[1]).abs() < 1e-9);
            }
        }
        eprintln!("{:<18} at rest {:.1e}, swinging {:.1e} of the sag", kind.name(), worst[0], worst[1]);
        assert!(worst[0] < 1e-7 && worst[1] < bound, "{}: {worst:?}", kind.name());
    }
}

/// A rotation back and forth.
struct Swing;

const AMPLITUDE: f64 = 2.0;
const OMEGA: f64 = 5.0;

impl PrescribedMotion for Swing {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let (s, c) = (OMEGA * t).sin_cos();
        (q[0], qdot[0], qddot[0]) = (AMPLITUDE * (1.0 - c), AMPLITUDE * OMEGA * s, AMPLITUDE * OMEGA * OMEGA * c);
    }
}

/// Truth: τ = (I_zz + m p²) q̈ + m g p, and the body rises by p q.
///
/// Measured, relative to the largest torque: 3e-16 in reduced coordinates, 4e-4 for SPOOK, whose
/// force is the mean over its last step; its first ten steps, in which its impulses settle, are
/// excluded.
#[test]
fn a_driven_spindle_needs_the_torque_of_the_textbook() {
    let plant = spindle(false, Arc::new(Swing));
    for (kind, bound) in steppers().into_iter().zip([1e-12, 1e-12, 1e-12, 5e-3]) {
        let mut stepper = new_stepper(kind, plant.clone(), 2e-4, Start::Equilibrium).unwrap();
        let mut seen = Observation::new(&plant);
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for _ in 0..5000 {
            stepper.step().unwrap();
            stepper.observe(&mut seen);
            let truth = INERTIA * AMPLITUDE * OMEGA * OMEGA * (OMEGA * seen.t).cos() + MASS * G * PITCH;
            if seen.t > 5e-3 {
                worst = worst.max((seen.drive[0] - truth).abs());
            }
            largest = largest.max(truth.abs());
            let X = seen.X_WB[1];
            let rise = PITCH * AMPLITUDE * (1.0 - (OMEGA * seen.t).cos());
            // measured 1e-16; SPOOK 2e-7
            assert!((X.translation.z - rise).abs() < 1e-5, "{}", kind.name());
        }
        eprintln!("{:<18} torque {:.1e} of the largest", kind.name(), worst / largest);
        assert!(worst < bound * largest, "{}: {worst} of {largest}", kind.name());
    }
}
