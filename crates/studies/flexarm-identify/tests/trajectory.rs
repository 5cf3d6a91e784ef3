//! Derivatives of the tool error along a motion with respect to parameters, against Richardson
//! extrapolation of runs; the damping depends on the modes.

use std::sync::Arc;

use flexarm_identify::*;
use flexarm_kinematics::{Frame, Model, Pose, SpatialInertia};
use flexarm_stepping::{
    AlphaSettings, Damping, FlexibleArm, InertiaChange, PrescribedMotion, SlopesRequest, Spring, Start, run_slopes,
};
use flexarm_testkit::{reference_arm, reference_motion};
use nalgebra::{DVector, Matrix3, Vector3};

/// Reference motion with one joint shifted.
struct Shifted(usize, f64);

impl PrescribedMotion for Shifted {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let (x, y, z) = reference_motion(t);
        q.copy_from_slice(&x);
        qdot.copy_from_slice(&y);
        qddot.copy_from_slice(&z);
        q[self.0] += self.1;
    }
}

fn plant() -> Plant {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let spring = |name: &str, k: usize, damping| Spring::from((name.to_owned(), reference.K_S[k] / 10.0, damping));
    let springs = vec![spring("lower", 0, Damping::Modal(0.03)), spring("upper", 1, Damping::Rayleigh(0.4, 3e-4))];
    let tool = model.frame("tcp").unwrap().clone();
    Plant { model, springs, tool, coupling: None }
}

fn parameters(plant: &Plant) -> Vec<RunParameter> {
    let of = |name: &str, effect| {
        let (name, unit) = (name.into(), "1".into());
        RunParameter::Arm(Parameter { name, unit, initial: 1.0, prior: 0.7, effect })
    };
    let stiffness = |spring, coordinate| Effect::Stiffness(vec![SpringPart { spring, coordinate }]);
    let per_kg = SpatialInertia::from_com(1.0, &Vector3::new(0.1, -0.05, 0.2), &(Matrix3::identity() * 0.02));
    let K = &plant.springs[1].K;
    let size = (K[(1, 1)] * K[(5, 5)]).sqrt();
    vec![
        of("shear with bending", Effect::Entry { spring: 1, row: 1, column: 5, factor: size, size: 1.0 }),
        of("lower", stiffness(0, None)),
        of("upper about y", stiffness(1, Some(4))),
        of("both", Effect::Stiffness([0, 1].map(|spring| SpringPart { spring, coordinate: None }).to_vec())),
        of("modal damping", Effect::Damping(vec![0])),
        of("Rayleigh damping", Effect::Damping(vec![1])),
        of("mass", Effect::Mass { body: plant.tool.body, per_kg }),
        RunParameter::Joint(1),
        RunParameter::Tool(Vector3::new(0.3, 0.1, -0.2)),
    ]
}

/// Returns the arm and its tool with one parameter changed.
fn changed(plant: &Plant, parameter: Option<&RunParameter>, x: f64) -> (FlexibleArm, Frame) {
    let mut plant = plant.clone();
    let mut motion = Shifted(0, 0.0);
    match parameter {
        Some(RunParameter::Arm(own)) => plant = plant.with(std::slice::from_ref(own), &[x]),
        Some(RunParameter::Joint(k)) => motion = Shifted(*k, x),
        Some(RunParameter::Tool(axis)) => plant.tool.X_BF *= Pose::from(axis * x),
        _ => {}
    }
    (FlexibleArm::new(plant.model, plant.springs, Arc::new(motion)).unwrap(), plant.tool)
}

fn request(tool: Frame) -> SlopesRequest {
    SlopesRequest {
        settings: AlphaSettings::default(),
        step_s: 2e-3,
        duration_s: 0.4,
        start: Start::Equilibrium,
        tool,
        keep_samples: true,
    }
}

/// Computes a derivative by sixth-order Richardson extrapolation of central differences.
fn richardson(h: f64, f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
    (bc * 16.0 - ab) / 15.0
}

#[test]
fn the_error_along_a_motion_depends_on_each_parameter_with_the_damping_that_follows_it() {
    compare(|arm| arm);
}

/// The inertia of the tool body, which has the mass parameter, changes twice; each change replaces
/// the mass, and the modal damping is recomputed.
#[test]
fn the_damping_after_a_change_of_payload_follows_the_parameters() {
    let body = plant().tool.body;
    let carried =
        |mass: f64| SpatialInertia::from_com(mass, &Vector3::new(0.1, 0.0, 0.1), &(Matrix3::identity() * 0.1));
    compare(|arm| {
        let change = |t: f64, mass: f64| InertiaChange { t, body, inertia: carried(mass) };
        arm.with_inertia_changes(vec![change(0.093, 25.0), change(0.21, 8.0)]).unwrap()
    });
}

fn compare(carrying: impl Fn(FlexibleArm) -> FlexibleArm) {
    let plant = plant();
    let parameters = parameters(&plant);
    let (arm, tool) = changed(&plant, None, 0.0);
    let found = error_slopes(&carrying(arm), &parameters, &request(tool)).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        let run = |x: f64| {
            let (arm, tool) = changed(&plant, Some(parameter), x);
            let found = run_slopes(&carrying(arm), &request(tool), &[]).unwrap();
            DVector::from_iterator(6 * found.errors.len(), found.errors.iter().flatten().copied())
        };
        // Small steps lose accuracy to rounding where the parameter has little effect, such as
        // damping.
        let h = match parameter {
            RunParameter::Arm(Parameter { effect: Effect::Mass { .. }, .. }) => 0.2,
            RunParameter::Arm(Parameter { effect: Effect::Damping(_), .. }) => 0.15,
            _ => 0.015,
        };
        let truth = richardson(h, run);
        let own: Vec<f64> = found.slopes.iter().skip(k).step_by(parameters.len()).flatten().copied().collect();
        let error = (DVector::from_vec(own) - &truth).amax() / truth.amax();
        let name = if let RunParameter::Arm(own) = parameter { own.name.as_str() } else { "motion or tool" };
        eprintln!("{name}: {error:.1e} of {:.2e}", truth.amax());
        // Measured: at most 1e-9.
        assert!(error < 1e-8, "{name}: {error:e}");
    }
}
