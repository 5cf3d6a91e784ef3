//! Derivatives of runs with closed loops, with modal links, and along motions with velocity jumps:
//! against differences of whole runs.

use std::sync::Arc;

use flexarm_fem::{BeamLink, Material, ModalOptions, Section};
use flexarm_flexlink::{FlexibleLink, LinkForm, substitute};
use flexarm_kinematics::*;
use flexarm_stepping::*;
use flexarm_testkit::{follow_reference_motion, reference_arm, reference_motion};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, vector};

const BETA: f64 = 1e-3;
const STEP: f64 = 2e-3;

fn per_kg() -> SpatialInertia {
    SpatialInertia::from_com(1.0, &vector![0.1, -0.05, 0.2], &(Matrix3::identity() * 0.02))
}

fn request(tool: &Frame, duration_s: f64) -> SlopesRequest {
    SlopesRequest {
        settings: AlphaSettings::default(),
        step_s: STEP,
        duration_s,
        start: Start::Equilibrium,
        tool: tool.clone(),
        keep_samples: true,
    }
}

fn heavier(model: &Model, kg: f64) -> Model {
    let body = model.frame("tcp").unwrap().body;
    let mut inertia = model.bodies()[body].inertia;
    let more = per_kg();
    inertia +=
        SpatialInertia { mass: kg * more.mass, first_moment: more.first_moment * kg, rotational: more.rotational * kg };
    model.with_inertia(body, inertia)
}

/// Returns the derivative by eighth-order differences over `± size`.
fn richardson(size: f64, f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let h = 0.25 * size;
    let d = |k: f64| (f(k * h) - f(-k * h)) / h;
    d(1.0) * 0.8 - d(2.0) * 0.2 + d(3.0) * (4.0 / 105.0) - d(4.0) / 280.0
}

// --- Closed loops and modal links

/// An arm whose forces are differentiated by differences; the parameters are a spring, a mass, the
/// motion, the tool.
struct Other {
    tree: Mechanism,
    /// Springs per group of the model, ten times softer than those of the shipped arm.
    springs: Vec<Spring>,
    tool: &'static str,
    servo: Option<Mechanism>,
    motion: fn(f64, &mut [f64], &mut [f64], &mut [f64]),
}

const OTHERS: [&str; 5] = ["spring", "mass", "shift", "stretch", "tool"];

impl Other {
    fn arm(&self, what: &str, x: f64) -> FlexibleArm {
        let by = |other: &str| if what == other { x } else { 0.0 };
        let heavier = |tree: &Mechanism| {
            let model = Model::new(tree).unwrap();
            let frame = model.frame(self.tool).unwrap().clone();
            let more = per_kg().at_parent(&frame.X_BF);
            let mut inertia = model.bodies()[frame.body].inertia;
            inertia += SpatialInertia {
                mass: by("mass") * more.mass,
                first_moment: more.first_moment * by("mass"),
                rotational: more.rotational * by("mass"),
            };
            model.with_inertia(frame.body, inertia)
        };
        let mut springs = self.springs.clone();
        springs[0].K *= 1.0 + by("spring");
        let (shift, stretch, motion) = (by("shift"), 1.0 + by("stretch"), self.motion);
        let motion = MotionFn(move |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
            motion(t, q, v, a);
            q.iter_mut().chain(v).chain(a).for_each(|x| *x *= stretch);
            q[1] += shift;
        });
        let arm = FlexibleArm::new(Arc::new(heavier(&self.tree)), springs, Arc::new(motion)).unwrap();
        let body = arm.model.frame(self.tool).unwrap().body;
        let force = |t: f64| Wrench::new(vector![90.0 * (19.0 * t).sin(), 0.0, -50.0], vector![0.0, 20.0, 5.0]);
        let load = Load::at_origin(body, TimedWrench::new(force).in_axes(LoadAxes::Frame));
        let arm = arm.with_timed_loads(vec![load]).unwrap();
        let Some(rigid) = &self.servo else { return arm };
        let axis = |coordinate: usize| ServoAxis {
            coordinate,
            position_gain: 15.0,
            velocity_gain: 900.0,
            integral_gain: 8e3,
            feed_forward: true,
            limit: f64::INFINITY,
        };
        let axes = (0..arm.model.n_actuated()).map(axis).collect();
        arm.with_servo(Servo { sample_s: 2e-3, axes, rigid: Arc::new(heavier(rigid)) }).unwrap()
    }

    fn direction(&self, what: &str) -> Direction {
        let arm = self.arm("", 0.0);
        let n = arm.n_elastic_coordinates();
        let mut direction = Direction::default();
        match what {
            "spring" => {
                direction.springs.push((0, SpringSlope::Factor(1.0)));
                let element = &arm.elements[0];
                let (first, size) = (arm.offset(element), element.size);
                let mut dD = DMatrix::zeros(n, n);
                if let Damping::StiffnessProportional(beta) = element.damping {
                    dD.view_mut((first, first), (size, size)).copy_from(&(&element.K * beta));
                }
                direction.damping = Some(dD);
            }
            "mass" => {
                let frame = arm.model.frame(self.tool).unwrap();
                direction.inertias.push((frame.body, per_kg().at_parent(&frame.X_BF)));
                if let Some(servo) = &arm.servo {
                    let frame = servo.rigid.frame(self.tool).unwrap();
                    direction.fed_forward.push((frame.body, per_kg().at_parent(&frame.X_BF)));
                }
            }
            "shift" => {
                let shift = (0..arm.model.n_actuated()).map(|k| f64::from(u8::from(k == 1))).collect();
                direction.motion = Some(Arc::new(Held(shift)));
            }
            "stretch" => direction.motion = Some(Arc::new(MotionFn(self.motion))),
            _ => direction.tool = vector![0.3, -0.2, 0.5],
        }
        direction
    }

    fn request(&self, arm: &FlexibleArm, tool: Vector3<f64>) -> SlopesRequest {
        let frame = arm.model.frame(self.tool).unwrap();
        request(&Frame { X_BF: frame.X_BF * Pose::from(tool), ..frame.clone() }, 0.2)
    }

    fn compare(&self, name: &str, bound: f64) {
        let arm = self.arm("", 0.0);
        let directions = OTHERS.map(|what| self.direction(what));
        let found = run_slopes(&arm, &self.request(&arm, Vector3::zeros()), &directions).unwrap();
        for (k, what) in OTHERS.into_iter().enumerate() {
            let run = |x: f64| {
                let arm = self.arm(what, x);
                let tool = if what == "tool" { vector![0.3, -0.2, 0.5] * x } else { Vector3::zeros() };
                let found = run_slopes(&arm, &self.request(&arm, tool), &[]).unwrap();
                DVector::from_iterator(6 * found.errors.len(), found.errors.iter().flatten().copied())
            };
            let size = if matches!(what, "mass" | "tool") { 0.4 } else { 0.03 };
            let truth = richardson(size, run);
            let own: Vec<f64> = found.slopes.iter().skip(k).step_by(OTHERS.len()).flatten().copied().collect();
            let error = (DVector::from_vec(own) - &truth).amax() / truth.amax();
            eprintln!("{name}, {what}: {error:.1e} of {:.2e}", truth.amax());
            assert!(error < bound, "{name}, {what}: {error:e}");
        }
    }
}

/// Truth: differences of whole runs.
#[test]
fn arms_with_closed_loops_are_differentiated() {
    let made = flexarm_testkit::palletising_arm(true);
    let spring = |(name, K): (String, DMatrix<f64>)| Spring {
        name,
        K,
        damping: Damping::StiffnessProportional(BETA),
        curve: None,
        geometric: None,
    };
    let springs: Vec<Spring> = made.springs.into_iter().map(spring).collect();
    fn motion(t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        for (k, (start, by)) in [(0.3, 0.3), (0.35, 0.15), (0.2, -0.15)].into_iter().enumerate() {
            let w = 11.0;
            (q[k], v[k], a[k]) =
                (start + by * (1.0 - (w * t).cos()), by * w * (w * t).sin(), by * w * w * (w * t).cos());
        }
    }
    let rigid = flexarm_testkit::palletising_arm(false).mechanism;
    for servo in [None, Some(rigid)] {
        let name = if servo.is_some() { "loops under servos" } else { "loops" };
        Other { tree: made.mechanism.clone(), springs: springs.clone(), tool: "tool", servo, motion }
            .compare(name, 1e-8);
    }
}

/// Returns the reference arm with its upper arm as one link, a tube with six modes; with servos
/// also a rotor at each joint.
fn modal_arm(damping: Damping, servo: bool) -> Other {
    let mut arm = reference_arm(false).mechanism;
    arm.links.retain(|link| link.name != "link4b");
    arm.joints.retain(|joint| joint.name != "joint4b");
    for joint in &mut arm.joints {
        joint.armature = if servo { 5.0 } else { 0.0 };
        if joint.name == "joint5" {
            (joint.parent, joint.X_PJ) = ("link4".into(), Pose::translation(1.0, 0.0, 0.0));
        }
    }
    let tube = Section::Tube { outer_diameter: 0.09, wall: 0.004 };
    let beam = BeamLink { mass: Some(40.0), ..BeamLink::new("link4", tube, Material::STEEL, 1.0) };
    let beam = beam.along(Vector3::x(), Vector3::y(), 0.0, Vector3::zeros()).unwrap();
    let modal = Arc::new(beam.modal_with(&ModalOptions::default()).unwrap());
    let link =
        FlexibleLink { form: LinkForm::Modal(modal.clone()), ..FlexibleLink::new("link4", beam.reduce().unwrap()) };
    let tree = substitute(&arm, &[link]).unwrap().mechanism;
    let spring = Spring { name: "link4".into(), K: modal.K.clone(), damping, curve: None, geometric: None };
    Other { tree, springs: vec![spring], tool: "tcp", servo: servo.then_some(arm), motion: follow_reference_motion }
}

/// Truth: differences of whole runs.
#[test]
fn arms_with_links_in_modes_are_differentiated() {
    for servo in [false, true] {
        let name = if servo { "modes under servos" } else { "modes" };
        modal_arm(Damping::StiffnessProportional(BETA), servo).compare(name, 1e-8);
    }
}

// --- Velocity jumps

/// The reference arm, at rest until 0.05 s and from 0.13 s on, in between with the speeds of its
/// motion; or moving from the start.
struct Corners {
    from: f64,
    stretch: f64,
    shift: f64,
}

impl PrescribedMotion for Corners {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let (x, v, a) = reference_motion(0.4 + t.clamp(self.from, 0.13));
        let moves = f64::from(u8::from(t >= self.from && t < 0.13));
        for k in 0..6 {
            q[k] = self.stretch * x[k] + if k == 1 { self.shift } else { 0.0 };
            (qdot[k], qddot[k]) = (moves * self.stretch * v[k], moves * self.stretch * a[k]);
        }
    }

    fn velocity_jumps(&self) -> Vec<f64> {
        vec![self.from, 0.13]
    }
}

/// Truth: differences of whole runs, with velocity jumps within a step, at its end and at the start
/// of the run.
#[test]
fn motions_whose_velocity_jumps_are_differentiated() {
    let reference = reference_arm(true);
    let soft = |k: usize| DMatrix::from_column_slice(6, 6, (reference.K_S[k] / 10.0).as_slice());
    for from in [0.0513, 0.0] {
        let arm = |what: &str, x: f64| {
            let by = |other: &str| if what == other { x } else { 0.0 };
            let model = heavier(&Model::new(&reference.mechanism).unwrap(), by("mass"));
            let motion = Corners { from, stretch: 1.0 + by("stretch"), shift: by("shift") };
            let spring = |name: &str, K: DMatrix<f64>| Spring {
                name: name.into(),
                K,
                damping: Damping::Dampers([400.0, 400.0, 400.0, 30.0, 30.0, 30.0]),
                curve: None,
                geometric: None,
            };
            let springs = vec![spring("lower", soft(0) * (1.0 + by("spring"))), spring("upper", soft(1))];
            FlexibleArm::new(Arc::new(model), springs, Arc::new(motion)).unwrap()
        };
        let body = arm("", 0.0).model.frame("tcp").unwrap().body;
        let moved = |stretch: f64, shift: f64| -> Option<Arc<dyn PrescribedMotion>> {
            Some(Arc::new(Corners { from, stretch, shift }))
        };
        let directions = [
            Direction { springs: vec![(0, SpringSlope::Factor(1.0))], ..Direction::default() },
            Direction { inertias: vec![(body, per_kg())], ..Direction::default() },
            Direction { motion: moved(1.0, 0.0), ..Direction::default() },
            Direction { motion: Some(Arc::new(Held(vec![0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))), ..Direction::default() },
        ];
        let request = |arm: &FlexibleArm| request(arm.model.frame("tcp").unwrap(), 0.25);
        let own_arm = arm("", 0.0);
        let found = run_slopes(&own_arm, &request(&own_arm), &directions).unwrap();
        for (k, what) in ["spring", "mass", "stretch", "shift"].into_iter().enumerate() {
            let run = |x: f64| {
                let arm = arm(what, x);
                let found = run_slopes(&arm, &request(&arm), &[]).unwrap();
                DVector::from_iterator(6 * found.errors.len(), found.errors.iter().flatten().copied())
            };
            let truth = richardson(if what == "mass" { 0.1 } else { 0.02 }, run);
            let own: Vec<f64> = found.slopes.iter().skip(k).step_by(directions.len()).flatten().copied().collect();
            let error = (DVector::from_vec(own) - &truth).amax() / truth.amax();
            eprintln!("corners from {from}, {what}: {error:.1e} of {:.2e}", truth.amax());
            assert!(error < 1e-8, "{what}: {error:e}");
        }
    }
}
