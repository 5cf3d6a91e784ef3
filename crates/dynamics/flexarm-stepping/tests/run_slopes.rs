//! Derivatives of whole runs: closed form of one mass, Richardson differences of runs of the
//! reference arm.

use std::sync::Arc;

use flexarm_kinematics::{
    Balancer, BalancerLaw, BalancerSpan, Joint, JointKind, Link, LinkInertia, Mechanism, Model, Pose, SpatialInertia,
    Wrench,
};
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{reference_arm, reference_motion};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3};

/// A mass on a vertical spring, with a damper.
fn oscillator(m: f64, k: f64, d: f64) -> FlexibleArm {
    let mut tree = Mechanism::new("mass on a spring");
    tree.links.push(Link { name: "ground".into(), inertia: None });
    let inertia = LinkInertia { mass: m, com: Vector3::zeros(), inertia_com: Matrix3::identity() };
    tree.links.push(Link { name: "mass".into(), inertia: Some(inertia) });
    let slide = JointKind::ElasticPrismatic(Vector3::z_axis());
    tree.joints.push(Joint::new("spring", slide, "ground", "mass", Pose::identity()));
    let spring = Spring {
        name: "spring".into(),
        K: DMatrix::from_element(1, 1, k),
        damping: Damping::Dampers([d; 6]),
        curve: None,
        geometric: None,
    };
    FlexibleArm::new(Arc::new(Model::new(&tree).unwrap()), vec![spring], Arc::new(Held(vec![]))).unwrap()
}

/// Closed form of the fall from the relaxed spring, and its derivatives with respect to m, k and d.
fn fall(m: f64, k: f64, d: f64, t: f64) -> [f64; 4] {
    let z = |m: f64, k: f64, d: f64| {
        let (w2, s) = (k / m, d / (2.0 * m));
        let w = (w2 - s * s).sqrt();
        -m * 9.81 / k * (1.0 - (-s * t).exp() * ((w * t).cos() + s / w * (w * t).sin()))
    };
    let slope = |f: &dyn Fn(f64) -> f64, h: f64| {
        let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
        (64.0 * d(0.25 * h) - 20.0 * d(0.5 * h) + d(h)) / 45.0
    };
    [
        z(m, k, d),
        slope(&|x| z(m + x, k, d), 0.02 * m),
        slope(&|x| z(m, k + x, d), 0.02 * k),
        slope(&|x| z(m, k, d + x), 0.02 * d),
    ]
}

/// Truth: closed form. The derivatives converge as the run itself does, with the square of the step
/// size.
#[test]
fn a_falling_mass_depends_on_mass_spring_and_damper_as_in_closed_form() {
    let (m, k, d) = (10.0, 1.6e4, 60.0);
    let arm = oscillator(m, k, d);
    let one = DMatrix::from_element(1, 1, 1.0);
    let kilogram = SpatialInertia::from_com(1.0, &Vector3::zeros(), &Matrix3::zeros());
    let directions = [
        Direction { inertias: vec![(1, kilogram)], ..Direction::default() },
        Direction { springs: vec![(0, SpringSlope::Factor(1.0 / k))], ..Direction::default() },
        Direction { damping: Some(one), ..Direction::default() },
    ];
    for dispersion_correction in [false, true] {
        let errors = [1e-3, 5e-4].map(|step_s| {
            let request = SlopesRequest {
                settings: AlphaSettings { rho: 0.9, dispersion_correction },
                step_s,
                duration_s: 0.4,
                start: Start::Undeformed,
                tool: arm.model.frame("mass").unwrap().clone(),
                keep_samples: true,
            };
            let found = run_slopes(&arm, &request, &directions).unwrap();
            let truth = fall(m, k, d, 0.4);
            let last = &found.slopes[found.slopes.len() - 3..];
            let sag = found.errors.last().unwrap()[2];
            let scale = [m, k, d];
            let of = |i: usize| (last[i][2] - truth[i + 1]).abs() * scale[i] / (m * 9.81 / k);
            [(sag - truth[0]).abs() / (m * 9.81 / k), of(0), of(1), of(2)]
        });
        eprintln!("correction {dispersion_correction}: {errors:?}");
        for i in 0..4 {
            let order = (errors[0][i] / errors[1][i]).log2();
            assert!((order - 2.0).abs() < 0.25, "{i}: order {order}, {errors:?}");
        }
        // 3e-2 to 1e-3 of the sag without the correction: the phase drifts over four periods.
        assert!(errors[1].iter().all(|error| *error < 3e-2), "{errors:?}");
    }
}

/// Parameters of the reference arm, by number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    /// Stiffness of the whole lower spring, with its damping.
    Lower,
    /// One entry of the upper spring's stiffness.
    Entry,
    Damper,
    Mass,
    /// Shift of the whole motion of a joint.
    Shift(usize),
    /// Factor on the motion of a joint.
    Stretch(usize),
    Tool,
}

const ALL: [What; 9] = [
    What::Lower,
    What::Entry,
    What::Damper,
    What::Mass,
    What::Shift(1),
    What::Shift(4),
    What::Stretch(0),
    What::Stretch(2),
    What::Tool,
];
const BETA: f64 = 1e-3;

struct Changed {
    motion: [f64; 6],
    stretch: [f64; 6],
}

impl PrescribedMotion for Changed {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        let (x, y, z) = reference_motion(t);
        for k in 0..6 {
            q[k] = self.stretch[k] * x[k] + self.motion[k];
            (qdot[k], qddot[k]) = (self.stretch[k] * y[k], self.stretch[k] * z[k]);
        }
    }
}

fn per_kg() -> SpatialInertia {
    SpatialInertia::from_com(1.0, &Vector3::new(0.1, -0.05, 0.2), &(Matrix3::identity() * 0.02))
}

fn entry(size: f64) -> Matrix6<f64> {
    let mut dK = Matrix6::zeros();
    (dK[(1, 5)], dK[(5, 1)]) = (size, size);
    dK
}

fn dampers(size: f64) -> [f64; 6] {
    [4e3 * size, 4e3 * size, 4e3 * size, 300.0 * size, 300.0 * size, 300.0 * size]
}

struct Case {
    tree: Mechanism,
    loaded: bool,
    settings: AlphaSettings,
}

impl Case {
    /// Returns the arm with one parameter changed by x, ten times softer than the reference arm.
    fn arm(&self, what: What, x: f64) -> FlexibleArm {
        let by = |other: What| if what == other { x } else { 0.0 };
        let K_S = reference_arm(true).K_S.map(|K| K / 10.0);
        let lower = ("lower".to_owned(), K_S[0] * (1.0 + by(What::Lower)), Damping::StiffnessProportional(BETA));
        let upper =
            ("upper".to_owned(), K_S[1] + entry(by(What::Entry)), Damping::Dampers(dampers(1.0 + by(What::Damper))));
        let mut motion = Changed { motion: [0.0; 6], stretch: [1.0; 6] };
        for k in 0..6 {
            motion.motion[k] += by(What::Shift(k));
            motion.stretch[k] += by(What::Stretch(k));
        }
        let mut model = Model::new(&self.tree).unwrap();
        let body = model.frame("tcp").unwrap().body;
        let mut inertia = model.bodies()[body].inertia;
        let more = per_kg();
        inertia += SpatialInertia {
            mass: by(What::Mass) * more.mass,
            first_moment: more.first_moment * by(What::Mass),
            rotational: more.rotational * by(What::Mass),
        };
        model = model.with_inertia(body, inertia);
        let arm = FlexibleArm::new(Arc::new(model), vec![lower, upper], Arc::new(motion)).unwrap();
        if !self.loaded {
            return arm;
        }
        let force =
            |t: f64| Wrench::new(Vector3::new(80.0 * (9.0 * t).sin(), 0.0, -50.0), Vector3::new(0.0, 20.0, 5.0));
        let world = Load::at_origin(body, TimedWrench::new(force));
        // Starts in the middle of a step.
        let late = move |t: f64| if t < 0.1013 { Wrench::zeros() } else { force(2.0 * t) };
        let turning = TimedWrench::new(late).in_axes(LoadAxes::Frame).with_jumps(vec![0.1013]);
        let turning = Load { X_BF: Pose::translation(0.1, 0.2, -0.1), ..Load::at_origin(body - 1, turning) };
        arm.with_timed_loads(vec![world, turning]).unwrap()
    }

    fn direction(&self, what: What) -> Direction {
        let arm = self.arm(What::Tool, 0.0);
        let n = arm.n_elastic_coordinates();
        let mut direction = Direction::default();
        let unit = |k: usize| -> [f64; 6] { std::array::from_fn(|i| f64::from(u8::from(i == k))) };
        match what {
            What::Lower => {
                direction.springs.push((0, SpringSlope::Factor(1.0)));
                let mut dD = DMatrix::zeros(n, n);
                dD.view_mut((0, 0), (6, 6)).copy_from(&(&arm.elements[0].K * BETA));
                direction.damping = Some(dD);
            }
            What::Entry => {
                let dK = DMatrix::from_column_slice(6, 6, entry(1.0).as_slice());
                direction.springs.push((1, SpringSlope::Matrix(dK)));
            }
            What::Damper => {
                let mut d = DVector::zeros(n);
                d.rows_mut(6, 6).copy_from_slice(&dampers(1.0));
                direction.damping = Some(DMatrix::from_diagonal(&d));
            }
            What::Mass => direction.inertias.push((arm.model.frame("tcp").unwrap().body, per_kg())),
            What::Shift(k) => direction.motion = Some(Arc::new(Held(unit(k).to_vec()))),
            What::Stretch(k) => {
                direction.motion =
                    Some(Arc::new(MotionFn(move |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
                        let (x, y, z) = reference_motion(t);
                        q.fill(0.0);
                        v.fill(0.0);
                        a.fill(0.0);
                        (q[k], v[k], a[k]) = (x[k], y[k], z[k]);
                    })));
            }
            What::Tool => direction.tool = Vector3::new(0.3, -0.2, 0.5),
        }
        direction
    }

    fn request(&self, arm: &FlexibleArm, tool: Vector3<f64>) -> SlopesRequest {
        let frame = arm.model.frame("tcp").unwrap();
        let tool = flexarm_kinematics::Frame { X_BF: frame.X_BF * Pose::from(tool), ..frame.clone() };
        SlopesRequest {
            settings: self.settings,
            step_s: 2e-3,
            duration_s: 0.4,
            start: Start::Equilibrium,
            tool,
            keep_samples: true,
        }
    }

    /// Returns the errors at all times, concatenated, then their sizes at the steps of the peaks,
    /// and the RMS values.
    fn run(&self, what: What, x: f64, peaks: [usize; 2]) -> DVector<f64> {
        let arm = self.arm(what, x);
        let tool = if what == What::Tool { Vector3::new(0.3, -0.2, 0.5) * x } else { Vector3::zeros() };
        let found = run_slopes(&arm, &self.request(&arm, tool), &[]).unwrap();
        let size = |first: usize| Vector3::from_row_slice(&found.errors[peaks[first / 3]][first..first + 3]).norm();
        let figures = [size(0), found.position.rms, size(3), found.rotation.rms];
        DVector::from_iterator(6 * found.errors.len() + 4, found.errors.iter().flatten().copied().chain(figures))
    }

    /// Compares derivatives and differences: maximum error of each direction relative to its
    /// largest entry, along the run and for the four figures.
    fn compare(&self, name: &str, bound: f64) {
        let arm = self.arm(What::Tool, 0.0);
        let directions = ALL.map(|what| self.direction(what));
        let found = run_slopes(&arm, &self.request(&arm, Vector3::zeros()), &directions).unwrap();
        for (k, what) in ALL.into_iter().enumerate() {
            let h = match what {
                What::Mass | What::Tool => 0.5,
                What::Entry => 2e3,
                What::Damper => 0.06,
                _ => 0.02,
            };
            let peaks = [&found.position, &found.rotation].map(|s| (s.t_peak_s / 2e-3).round() as usize);
            let truth = richardson(h, |x| self.run(what, x, peaks));
            let (along, figures) = truth.as_slice().split_at(truth.len() - 4);
            let own: Vec<f64> = found.slopes.iter().skip(k).step_by(ALL.len()).flatten().copied().collect();
            let scale = |x: &[f64]| x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let off: Vec<f64> = own.iter().zip(along).map(|(a, b)| a - b).collect();
            let at = |s: &ErrorSlopes| [s.peak_slopes[k], s.rms_slopes[k]];
            let [p, r] = [at(&found.position), at(&found.rotation)];
            let of_figures = [p[0], p[1], r[0], r[1]];
            let figures_off: Vec<f64> = of_figures.iter().zip(figures).map(|(a, b)| a - b).collect();
            let (error, of_figures) = (scale(&off) / scale(along), scale(&figures_off) / scale(figures));
            eprintln!("{name}, {what:?}: {error:.1e} of {:.2e}, figures {of_figures:.1e}", scale(along));
            // 1e-9 and less; at best limited by the round-off of the differences.
            assert!(error < bound && of_figures < bound, "{name}, {what:?}: {error:e} {of_figures:e}");
        }
    }
}

/// Returns the derivative by sixth-order differences.
fn richardson(h: f64, f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
    (bc * 16.0 - ab) / 15.0
}

/// Truth: differences of whole runs.
#[test]
fn a_run_of_the_reference_arm_depends_on_its_parameters_as_differences_of_runs_say() {
    let tree = reference_arm(true).mechanism;
    for dispersion_correction in [false, true] {
        let settings = AlphaSettings { rho: 0.9, dispersion_correction };
        let case = Case { tree: tree.clone(), loaded: false, settings };
        case.compare(&format!("correction {dispersion_correction}"), 1e-8);
    }
}

#[test]
fn loads_that_jump_and_turn_and_balancers_are_in_the_derivatives() {
    let mut tree = reference_arm(true).mechanism;
    let X = Pose::translation(-0.3, 0.1, 0.2);
    tree.joints.push(Joint::new("fix_anchor", JointKind::Fixed, "link1", "anchor", X));
    tree.links.push(Link { name: "anchor".into(), inertia: None });
    let span = BalancerSpan::Points { from: "anchor".into(), to: "link2b".into() };
    let law = BalancerLaw::Linear { rate: 900.0, free: 0.2, preload: 150.0 };
    tree.balancers.push(Balancer { name: "spring".into(), span, law });
    Case { tree, loaded: true, settings: AlphaSettings::default() }.compare("loads and balancers", 1e-8);
}

/// An ordinary run ends its iterations early and keeps its matrices: the effect is small compared
/// with the run and with its error.
#[test]
fn the_run_that_is_differentiated_is_the_ordinary_run_but_for_what_iterations_leave() {
    let case = Case { tree: reference_arm(true).mechanism, loaded: false, settings: AlphaSettings::default() };
    let arm = case.arm(What::Tool, 0.0);
    let request = case.request(&arm, Vector3::zeros());
    let exact = run_slopes(&arm, &request, &[]).unwrap();
    let batch = Batch {
        step_s: request.step_s,
        stepper: StepperKind::GeneralizedAlpha(request.settings),
        start: request.start,
        tool: request.tool.clone(),
        keep_samples: true,
    };
    let run = BatchRun { arm: arm.clone(), duration_s: request.duration_s };
    let ordinary = batch.run_alone(&run).unwrap();
    let off = |step_s: f64| {
        let fine = Batch { step_s, ..batch.clone() }.run_alone(&run).unwrap();
        let every = (request.step_s / step_s).round() as usize;
        let pairs = ordinary.samples_m.iter().zip(fine.samples_m.iter().step_by(every));
        pairs.map(|(a, b)| (Vector3::from(*a) - Vector3::from(*b)).norm()).fold(0.0, f64::max)
    };
    let pairs = ordinary.samples_m.iter().zip(&exact.errors);
    let left = pairs.map(|(a, b)| (Vector3::from(*a) - Vector3::new(b[0], b[1], b[2])).norm()).fold(0.0, f64::max);
    let error = off(1e-4);
    eprintln!("left {left:.1e} m, error of the step {error:.1e} m, peak {:.2e} m", ordinary.peak_m);
    assert!(left < 0.1 * error && (ordinary.peak_m - exact.position.peak).abs() <= left);
}

#[test]
fn what_is_not_differentiated_is_refused_with_a_way_out() {
    let case = Case { tree: reference_arm(true).mechanism, loaded: false, settings: AlphaSettings::default() };
    let arm = case.arm(What::Tool, 0.0);
    let request = case.request(&arm, Vector3::zeros());
    struct Jumps;
    impl PrescribedMotion for Jumps {
        fn sample(&self, _t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
            [q, qdot, qddot].into_iter().for_each(|x| x.fill(0.0));
        }

        fn velocity_jumps(&self) -> Vec<f64> {
            vec![0.1]
        }
    }
    let elsewhere = Direction { motion: Some(Arc::new(Jumps)), ..Direction::default() };
    let error = run_slopes(&arm, &request, &[elsewhere]).unwrap_err();
    assert!(matches!(error, StepError::NoSlopes { .. }) && error.to_string().contains("round its corners"), "{error}");
    let unknown = Direction { servo: vec![(0, AxisSlope::default())], ..Direction::default() };
    let error = run_slopes(&arm, &request, &[unknown]).unwrap_err();
    assert!(error.to_string().contains("servo 0"), "{error}");
    let beyond = Direction { inertias: vec![(99, per_kg())], ..Direction::default() };
    let error = run_slopes(&arm, &request, &[beyond]).unwrap_err();
    assert!(error.to_string().contains("body 99"), "{error}");
    let nowhere = Direction { springs: vec![(7, SpringSlope::Factor(1.0))], ..Direction::default() };
    let error = run_slopes(&arm, &request, &[nowhere]).unwrap_err();
    assert!(error.to_string().contains("spring 7"), "{error}");
}

#[test]
fn twice_as_many_steps_allocate_no_more() {
    let case = Case { tree: reference_arm(true).mechanism, loaded: true, settings: AlphaSettings::default() };
    let arm = case.arm(What::Tool, 0.0);
    let directions = ALL.map(|what| case.direction(what));
    let counts = [0.3, 0.6].map(|duration_s| {
        let request = SlopesRequest { duration_s, keep_samples: false, ..case.request(&arm, Vector3::zeros()) };
        count_allocations(|| drop(run_slopes(&arm, &request, &directions).unwrap()))
    });
    assert_eq!(counts[0], counts[1]);
}
