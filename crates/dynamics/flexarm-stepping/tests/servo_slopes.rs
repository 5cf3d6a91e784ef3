//! Derivatives of runs with servos, gear laws and payload changes against Richardson differences of
//! whole runs.

use std::sync::Arc;

use flexarm_kinematics::*;
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, vector};

const BETA: f64 = 1e-3;
const GEAR: [f64; 3] = [9e4, 7e4, 3e4];
const GEAR_DAMPING: f64 = 30.0;
const ROTOR: f64 = 6.0;
const STEP: f64 = 2e-3;
/// Round-off of the tool error in the differences (m, rad).
const ROUNDING: f64 = 2e-14;

/// One parameter of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    /// Stiffness of the gear of the second joint, as a factor.
    Gear,
    /// Stiffness of the flexible link, with its damping, as a factor.
    Link,
    /// Damping of the last gear, as a factor.
    Damper,
    /// Additional mass of the last body (kg), known to the controller.
    Mass,
    Viscous,
    Coulomb,
    Stribeck,
    StribeckSpeed,
    Regularisation,
    Position,
    Velocity,
    Integral,
    /// Factor on the feed-forward of all servos.
    Ahead,
    Shift(usize),
    Stretch(usize),
    Tool,
}

const ALL: [What; 17] = [
    What::Gear,
    What::Link,
    What::Damper,
    What::Mass,
    What::Viscous,
    What::Coulomb,
    What::Stribeck,
    What::StribeckSpeed,
    What::Regularisation,
    What::Position,
    What::Velocity,
    What::Integral,
    What::Shift(0),
    What::Shift(1),
    What::Stretch(0),
    What::Stretch(1),
    What::Tool,
];

/// Oscillation of three joints.
struct Swing {
    shift: [f64; 3],
    stretch: [f64; 3],
}

impl PrescribedMotion for Swing {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        for k in 0..3 {
            let (size, w, phase) = ([0.5, 0.3, 0.6][k], [9.0, 11.0, 13.0][k], [0.0, 0.7, -0.4][k]);
            let s = size * self.stretch[k];
            q[k] = self.shift[k] + s * (w * t + phase).sin() + [0.2, -0.7, 0.9][k] * self.stretch[k];
            qdot[k] = s * w * (w * t + phase).cos();
            qddot[k] = -s * w * w * (w * t + phase).sin();
        }
    }
}

fn inertia(mass: f64) -> LinkInertia {
    let moments = Matrix3::from_diagonal(&vector![0.03, 0.04, 0.02]) * mass;
    LinkInertia { mass, com: vector![0.03, -0.02, 0.25], inertia_com: moments }
}

/// Three joints about z, y, y, each with a motor and a gear; the second link is flexible in its
/// middle. `factor` scales all inertias and the weight.
fn tree(elastic: bool, factor: f64) -> Mechanism {
    let mut tree = Mechanism::new("arm");
    let link = |name: &str, inertia: Option<LinkInertia>| Link { name: name.into(), inertia };
    let scaled = |mass: f64| {
        let own = inertia(mass);
        LinkInertia { mass: factor * own.mass, inertia_com: own.inertia_com * factor, ..own }
    };
    tree.links.push(link("base", None));
    let mut parent = "base".to_owned();
    for (k, axis) in [Vector3::z_axis(), Vector3::y_axis(), Vector3::y_axis()].into_iter().enumerate() {
        let place = if k == 0 { Pose::identity() } else { Pose::translation(0.05, 0.0, 0.5) };
        let (motor, body) = (format!("motor_{k}"), format!("body_{k}"));
        let mut joint = Joint::new(format!("axis_{k}"), JointKind::Continuous(axis), &parent, &motor, place);
        joint.armature = ROTOR * factor;
        tree.joints.push(joint);
        tree.links.push(link(&motor, None));
        let kind = if elastic { JointKind::ElasticRevolute(axis) } else { JointKind::Fixed };
        tree.joints.push(Joint::new(format!("gear_{k}"), kind, &motor, &body, Pose::identity()));
        tree.links.push(link(&body, Some(scaled([25.0, 10.0, 12.0][k]))));
        parent = body;
        if k == 1 {
            let kind = if elastic { JointKind::Elastic(ElasticAngles::RotationVector) } else { JointKind::Fixed };
            tree.joints.push(Joint::new("bend", kind, &parent, "far", Pose::translation(0.0, 0.0, 0.25)));
            tree.links.push(link("far", Some(scaled(8.0))));
            parent = "far".into();
        }
    }
    tree.joints.push(Joint::new("tool", JointKind::Fixed, &parent, "tcp", Pose::translation(0.1, 0.05, 0.4)));
    tree.links.push(link("tcp", None));
    tree
}

fn friction() -> Friction {
    Friction { viscous: 8.0, coulomb: 15.0, stribeck: 6.0, stribeck_velocity: 0.7, regularisation: 0.4 }
}

fn per_kg() -> SpatialInertia {
    SpatialInertia::from_com(1.0, &vector![0.1, -0.05, 0.2], &(Matrix3::identity() * 0.02))
}

fn axis(coordinate: usize) -> ServoAxis {
    let velocity_gain = [900.0, 1100.0, 500.0][coordinate];
    let (position_gain, integral_gain) = (15.0, 12.0 * velocity_gain);
    ServoAxis { coordinate, position_gain, velocity_gain, integral_gain, feed_forward: true, limit: f64::INFINITY }
}

/// Gear effects other than elasticity.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gears {
    Plain,
    Ripple,
    Hysteresis,
    LoadFriction,
    Coupled,
}

#[derive(Clone, Debug)]
struct Case {
    /// Joints under servos.
    driven: Vec<usize>,
    sample_s: f64,
    limit: f64,
    feed_forward: bool,
    integral: bool,
    gears: Gears,
    friction: bool,
    /// Whether the payload changes during the run, under a load.
    payload: bool,
    settings: AlphaSettings,
}

impl Case {
    fn new() -> Self {
        Self {
            driven: vec![0, 1, 2],
            sample_s: 1e-3,
            limit: f64::INFINITY,
            feed_forward: true,
            integral: true,
            gears: Gears::Plain,
            friction: true,
            payload: false,
            settings: AlphaSettings::default(),
        }
    }

    /// Returns the arm with parameter `what` changed by x.
    fn arm(&self, what: What, x: f64) -> FlexibleArm {
        let by = |other: What| if what == other { x } else { 0.0 };
        let motion = Swing {
            shift: std::array::from_fn(|k| by(What::Shift(k))),
            stretch: std::array::from_fn(|k| 1.0 + by(What::Stretch(k))),
        };
        let gear = |k: usize| {
            let factor = if k == 1 { 1.0 + by(What::Gear) } else { 1.0 };
            let damper = if k == 2 { 1.0 + by(What::Damper) } else { 1.0 };
            let d = [GEAR_DAMPING * damper; 6];
            let K = DMatrix::from_element(1, 1, GEAR[k] * factor);
            Spring { name: format!("gear {k}"), K, damping: Damping::Dampers(d), curve: None, geometric: None }
        };
        let bend = Matrix3::from_diagonal(&vector![2e6, 2e6, 8e6]);
        let turn = Matrix3::from_diagonal(&vector![5e4, 6e4, 2e4]);
        let mut K = DMatrix::zeros(6, 6);
        K.view_mut((0, 0), (3, 3)).copy_from(&bend);
        K.view_mut((3, 3), (3, 3)).copy_from(&turn);
        K *= 1.0 + by(What::Link);
        let damping = Damping::StiffnessProportional(BETA);
        let link = Spring { name: "link".into(), K, damping, curve: None, geometric: None };
        let springs = vec![gear(0), gear(1), link, gear(2)];

        let mut model = Model::new(&tree(true, 1.0)).unwrap();
        model = heavier(&model, by(What::Mass));
        let rigid = tree(false, 1.0 + by(What::Ahead));
        let rigid = heavier(&Model::new(&rigid).unwrap(), by(What::Mass));
        let mut arm = FlexibleArm::new(Arc::new(model), springs, Arc::new(motion)).unwrap();
        let mut law = friction();
        law.viscous += by(What::Viscous);
        law.coulomb += by(What::Coulomb);
        law.stribeck += by(What::Stribeck);
        law.stribeck_velocity += by(What::StribeckSpeed);
        law.regularisation += by(What::Regularisation);
        if self.friction {
            arm.friction = vec![friction(), law, law];
        }
        arm = self.with_gears(arm, 1.0 + by(What::Gear));
        arm = self.with_payload(arm);
        if self.driven.is_empty() {
            return arm;
        }
        let of = |k: &usize| {
            let mut axis = axis(*k);
            axis.limit = self.limit;
            axis.feed_forward = self.feed_forward;
            if !self.integral {
                axis.integral_gain = 0.0;
            }
            if *k == 1 {
                axis.position_gain += by(What::Position);
                axis.velocity_gain += by(What::Velocity);
                axis.integral_gain += by(What::Integral);
            }
            axis
        };
        let axes = self.driven.iter().map(of).collect();
        arm.with_servo(Servo { sample_s: self.sample_s, axes, rigid: Arc::new(rigid) }).unwrap()
    }

    fn with_gears(&self, arm: FlexibleArm, factor: f64) -> FlexibleArm {
        match self.gears {
            Gears::Plain => arm,
            Gears::Ripple => {
                let harmonic = |amplitude: f64, cycles: f64| Harmonic { amplitude, cycles, phase: 0.3 };
                let error = |element: usize, motor: usize| TransmissionError {
                    element,
                    motor,
                    harmonics: vec![harmonic(2e-4, 20.0), harmonic(1e-4, 31.0)],
                };
                arm.with_transmission_errors(vec![error(1, 1), error(3, 2)]).unwrap()
            }
            Gears::Hysteresis => {
                let law = |element: usize, k: usize, factor: f64| Hysteresis {
                    element,
                    elastic: TorqueCurve::straight(GEAR[k] * factor),
                    sliders: vec![
                        Slider { stiffness: 2e4 * factor, reach: 4e-4 },
                        Slider { stiffness: 1e4 * factor, reach: 1.1e-3 },
                    ],
                };
                arm.with_hysteresis(vec![law(1, 1, factor), law(3, 2, 1.0)]).unwrap()
            }
            Gears::LoadFriction => {
                let law = |element: usize, coordinate: usize| LoadFriction {
                    coordinate,
                    element: Some(element),
                    coefficient: 0.08,
                    regularisation: 0.4,
                };
                let load_friction = vec![law(1, 1), law(3, 2)];
                FlexibleArm { load_friction, ..arm }
            }
            Gears::Coupled => {
                let C = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -0.6, 1.1]);
                let C_inverse = C.clone().try_inverse().unwrap();
                let coupling = GearCoupling { elements: vec![1, 3], coordinates: vec![1, 2], C, C_inverse };
                arm.with_coupling(coupling).unwrap()
            }
        }
    }

    fn with_payload(&self, arm: FlexibleArm) -> FlexibleArm {
        if !self.payload {
            return arm;
        }
        let body = arm.model.frame("tcp").unwrap().body;
        let own = Model::new(&tree(true, 1.0)).unwrap().bodies()[body].inertia;
        let mut more = own;
        more += SpatialInertia::from_com(7.0, &vector![0.1, 0.0, 0.4], &(Matrix3::identity() * 0.03));
        let changes =
            vec![InertiaChange { t: 0.0613, body, inertia: more }, InertiaChange { t: 0.14, body, inertia: own }];
        let force = |t: f64| Wrench::new(vector![80.0 * (19.0 * t).sin(), 0.0, -50.0], vector![0.0, 20.0, 5.0]);
        let load = Load::at_origin(body, TimedWrench::new(force).in_axes(LoadAxes::Frame));
        arm.with_inertia_changes(changes).unwrap().with_timed_loads(vec![load]).unwrap()
    }

    fn direction(&self, what: What) -> Direction {
        let arm = self.arm(What::Tool, 0.0);
        let n = arm.n_elastic_coordinates();
        let mut direction = Direction::default();
        let second = self.driven.iter().position(|k| *k == 1);
        let servo = |by: AxisSlope| second.map(|i| (i, by)).into_iter().collect::<Vec<_>>();
        let law = |by: Friction| vec![(1, by), (2, by)];
        let none = Friction { stribeck_velocity: 0.0, regularisation: 0.0, ..Friction::NONE };
        match what {
            What::Gear => match arm.coupled_stiffness_slope(1) {
                Some((places, own)) => {
                    let mut dK = DMatrix::zeros(n, n);
                    for (a, i) in places.iter().enumerate() {
                        places.iter().enumerate().for_each(|(b, j)| dK[(*i, *j)] += own[(a, b)]);
                    }
                    direction.stiffness = Some(dK);
                }
                None => direction.springs.push((1, SpringSlope::Factor(1.0))),
            },
            What::Link => {
                direction.springs.push((2, SpringSlope::Factor(1.0)));
                let mut dD = DMatrix::zeros(n, n);
                dD.view_mut((2, 2), (6, 6)).copy_from(&(&arm.elements[2].K * BETA));
                direction.damping = Some(dD);
            }
            What::Damper => {
                let mut dD = DMatrix::zeros(n, n);
                match &arm.coupling {
                    Some(coupling) => {
                        let on = GearCoupling::on_joints(&coupling.C_inverse, &[0.0, GEAR_DAMPING]);
                        for (a, i) in [1, 8].into_iter().enumerate() {
                            [1, 8].into_iter().enumerate().for_each(|(b, j)| dD[(i, j)] = on[(a, b)]);
                        }
                    }
                    None => dD[(8, 8)] = GEAR_DAMPING,
                }
                direction.damping = Some(dD);
            }
            What::Mass => {
                direction.inertias.push((arm.model.frame("tcp").unwrap().body, per_kg()));
                direction.fed_forward.push((3, per_kg()));
            }
            What::Viscous => direction.friction = law(Friction { viscous: 1.0, ..none }),
            What::Coulomb => direction.friction = law(Friction { coulomb: 1.0, ..none }),
            What::Stribeck => direction.friction = law(Friction { stribeck: 1.0, ..none }),
            What::StribeckSpeed => direction.friction = law(Friction { stribeck_velocity: 1.0, ..none }),
            What::Regularisation => direction.friction = law(Friction { regularisation: 1.0, ..none }),
            What::Position => direction.servo = servo(AxisSlope { position_gain: 1.0, ..AxisSlope::default() }),
            What::Velocity => direction.servo = servo(AxisSlope { velocity_gain: 1.0, ..AxisSlope::default() }),
            What::Integral => direction.servo = servo(AxisSlope { integral_gain: 1.0, ..AxisSlope::default() }),
            What::Ahead => {
                let by = AxisSlope { feed_forward: 1.0, ..AxisSlope::default() };
                direction.servo = (0..self.driven.len()).map(|i| (i, by)).collect();
            }
            What::Shift(k) => {
                let unit = (0..3).map(|i| f64::from(u8::from(i == k))).collect();
                direction.motion = Some(Arc::new(Held(unit)));
            }
            What::Stretch(k) => {
                let stretch = std::array::from_fn(|i| f64::from(u8::from(i == k)));
                direction.motion = Some(Arc::new(Swing { shift: [0.0; 3], stretch }));
            }
            What::Tool => direction.tool = vector![0.3, -0.2, 0.5],
        }
        direction
    }

    fn request(&self, arm: &FlexibleArm, tool: Vector3<f64>) -> SlopesRequest {
        let frame = arm.model.frame("tcp").unwrap();
        let tool = Frame { X_BF: frame.X_BF * Pose::from(tool), ..frame.clone() };
        SlopesRequest {
            settings: self.settings,
            step_s: STEP,
            duration_s: 0.25,
            start: Start::Equilibrium,
            tool,
            keep_samples: true,
        }
    }

    /// Returns the errors at all times, concatenated.
    fn run(&self, what: What, x: f64) -> DVector<f64> {
        let arm = self.arm(what, x);
        let tool = if what == What::Tool { vector![0.3, -0.2, 0.5] * x } else { Vector3::zeros() };
        let found = run_slopes(&arm, &self.request(&arm, tool), &[]).unwrap();
        DVector::from_iterator(6 * found.errors.len(), found.errors.iter().flatten().copied())
    }

    /// Compares the derivatives with differences: maximum error of each direction relative to its
    /// largest entry along the run.
    fn compare(&self, name: &str, all: &[What], bound: f64) -> RunSlopes {
        let arm = self.arm(What::Tool, 0.0);
        let directions: Vec<Direction> = all.iter().map(|what| self.direction(*what)).collect();
        let found = run_slopes(&arm, &self.request(&arm, Vector3::zeros()), &directions).unwrap();
        for (k, what) in all.iter().enumerate() {
            let truth = richardson(self.size(*what), |x| self.run(*what, x));
            let own: Vec<f64> = found.slopes.iter().skip(k).step_by(all.len()).flatten().copied().collect();
            let error = (DVector::from_vec(own) - &truth).amax();
            eprintln!("{name}, {what:?}: {:.1e} of {:.2e}", error / truth.amax(), truth.amax());
            // Positions are rounded to 2e-14 m along a run; divided by the length of the
            // differences.
            let rounding = ROUNDING / self.size(*what);
            assert!(error < bound * truth.amax() + rounding, "{name}, {what:?}: {error:e} {rounding:e}");
        }
        found
    }

    /// Returns the length of the differences.
    fn size(&self, what: What) -> f64 {
        let size = match what {
            What::Mass | What::Tool => 0.3,
            What::Viscous | What::Coulomb | What::Stribeck => 4.0,
            What::StribeckSpeed | What::Regularisation | What::Damper => 0.06,
            What::Position => 1.0,
            What::Velocity => 20.0,
            What::Integral => 300.0,
            _ => 0.02,
        };
        // Short enough that no torque changes sign, and that no slider or servo changes between
        // sticking and slipping, or reaches its limit, at a different sample.
        let kinked = [Gears::Hysteresis, Gears::LoadFriction].contains(&self.gears) || self.limit.is_finite();
        if kinked { 0.02 * size } else { size }
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

/// Truth: differences of whole runs.
#[test]
fn a_run_under_servos_depends_on_its_numbers_as_differences_of_runs_say() {
    Case::new().compare("servos", &ALL, 1e-8);
    // If inertia and weight of the rigid robot are scaled, so is its torque.
    let case = Case { friction: false, ..Case::new() };
    case.compare("fed forward", &[What::Ahead], 1e-8);
}

/// Truth: differences of whole runs, with one joint prescribed, samples between the ends of steps,
/// and no feed-forward.
#[test]
fn servos_beside_prescribed_joints_and_samples_within_steps_are_differentiated() {
    let plain = AlphaSettings { rho: 0.8, dispersion_correction: false };
    let case = Case { driven: vec![0, 2], sample_s: 1.5e-3, settings: plain, ..Case::new() };
    let of_second = |what: &What| matches!(what, What::Position | What::Velocity | What::Integral);
    let all: Vec<What> = ALL.into_iter().filter(|what| !of_second(what)).collect();
    case.compare("mixed", &all, 1e-8);
    let case = Case { feed_forward: false, integral: false, ..Case::new() };
    let all: Vec<What> = ALL.into_iter().filter(|what| *what != What::Integral).collect();
    case.compare("gains alone", &all, 1e-8);
}

#[test]
fn gears_with_laws_of_their_own_are_differentiated() {
    let none = |what: &What| {
        let of_servos = [What::Position, What::Velocity, What::Integral];
        let of_friction = [What::Viscous, What::Coulomb, What::Stribeck, What::StribeckSpeed, What::Regularisation];
        of_servos.contains(what) || of_friction.contains(what)
    };
    for gears in [Gears::Ripple, Gears::Hysteresis, Gears::LoadFriction, Gears::Coupled] {
        for driven in [vec![0, 1, 2], vec![]] {
            let all: Vec<What> = ALL.into_iter().filter(|what| !driven.is_empty() || !none(what)).collect();
            let case = Case { gears, driven, ..Case::new() };
            case.compare(&format!("{gears:?}, {} servos", case.driven.len()), &all, 1e-8);
        }
    }
}

#[test]
fn payloads_that_change_on_the_way_are_differentiated() {
    let case = Case { payload: true, ..Case::new() };
    case.compare("payload", &ALL, 1e-8);
}

#[test]
fn a_servo_at_its_limit_is_differentiated_through_and_told() {
    let case = Case { limit: 450.0, ..Case::new() };
    let found = case.compare("limit", &ALL, 1e-8);
    eprintln!("{:?}", found.limited);
    assert!(!found.limited.is_empty());
}

#[test]
fn twice_as_many_steps_allocate_no_more() {
    let case = Case { gears: Gears::Hysteresis, payload: true, limit: 450.0, ..Case::new() };
    let arm = case.arm(What::Tool, 0.0);
    let directions = ALL.map(|what| case.direction(what));
    let counts = [0.3, 0.6].map(|duration_s| {
        let request = SlopesRequest { duration_s, keep_samples: false, ..case.request(&arm, Vector3::zeros()) };
        count_allocations(|| drop(run_slopes(&arm, &request, &directions).unwrap()))
    });
    assert_eq!(counts[0], counts[1]);
}
