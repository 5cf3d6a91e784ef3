//! Discrete events: payload changes, loads that start between steps, velocity jumps, failing steps.

use std::sync::Arc;

use flexarm_kinematics::*;
use flexarm_stepping::*;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3};

const PLAIN: StepperKind = StepperKind::GeneralizedAlpha(AlphaSettings { rho: 0.6, dispersion_correction: false });
const SPOOK: StepperKind =
    StepperKind::Spook(SpookSettings { form: ConstraintForm::Local, preset: SpookPreset::Exact });

fn reference() -> StepperKind {
    StepperKind::Reference(ReferenceSettings::new(1e-9))
}

/// Returns every stepper of the registry with its default settings; `maximal`: including those in
/// maximal coordinates.
fn registered(maximal: bool) -> impl Iterator<Item = StepperKind> {
    let entries = STEPPERS.into_iter().filter(move |entry| maximal || !entry.maximal);
    entries.map(|entry| (entry.with)(&StepperOptions::default()))
}

/// Returns whether the errors at 1 ms are far below those of an implicit method of second order.
fn is_fine(kind: &StepperKind) -> bool {
    kind.entry().steps != StepRule::AnyLength
}

const K: f64 = 4e4;
const MASS: f64 = 10.0;

/// Piecewise constant joint velocity, zero at first, that jumps at given times.
#[derive(Clone)]
struct Corners {
    /// Time and the velocity from then on.
    corners: Vec<(f64, f64)>,
}

impl PrescribedMotion for Corners {
    fn sample(&self, t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]) {
        (q[0], qdot[0], qddot[0]) = (0.0, 0.0, 0.0);
        for (k, &(from, v)) in self.corners.iter().enumerate() {
            let to = self.corners.get(k + 1).map_or(t, |next| next.0.min(t));
            if t >= from {
                (q[0], qdot[0]) = (q[0] + v * (to - from), v);
            }
        }
    }

    fn velocity_jumps(&self) -> Vec<f64> {
        self.corners.iter().map(|c| c.0).collect()
    }
}

/// Returns a slide along x with a body on a 6x6 spring, and gravity if given.
fn slide(motion: Arc<dyn PrescribedMotion>, gravity: f64, damping: Damping) -> Plant {
    let mut slide = Mechanism::new("slide");
    slide.gravity = -Vector3::z() * gravity;
    let carriage = LinkInertia { mass: 2.0, com: Vector3::zeros(), inertia_com: Matrix3::identity() * 0.1 };
    let body = LinkInertia { mass: MASS, com: Vector3::zeros(), inertia_com: Matrix3::identity() * 0.5 };
    slide.links.push(Link { name: "base".into(), inertia: None });
    slide.links.push(Link { name: "carriage".into(), inertia: Some(carriage) });
    slide.links.push(Link { name: "body".into(), inertia: Some(body) });
    slide.joints.push(Joint::new(
        "slide",
        JointKind::Prismatic(Vector3::x_axis()),
        "base",
        "carriage",
        Pose::identity(),
    ));
    let elastic = JointKind::Elastic(ElasticAngles::RotationVector);
    slide.joints.push(Joint::new("spring", elastic, "carriage", "body", Pose::identity()));
    let spring = ("spring".to_owned(), Matrix6::identity() * K, damping);
    Plant::new(Arc::new(Model::new(&slide).unwrap()), vec![spring], motion).unwrap()
}

fn held() -> Arc<dyn PrescribedMotion> {
    Arc::new(Held(vec![0.0]))
}

/// Returns the maximum distance of elastic coordinate `k` from `truth(t)` at the steps.
fn error(plant: &Plant, kind: StepperKind, h: f64, duration: f64, k: usize, truth: impl Fn(f64) -> f64) -> f64 {
    let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).unwrap();
    let mut seen = Observation::new(plant);
    let mut worst = 0.0f64;
    for _ in 0..(duration / h).round() as usize {
        stepper.step().unwrap();
        stepper.observe(&mut seen);
        worst = worst.max((seen.q[1 + k] - truth(seen.t)).abs());
    }
    worst
}

fn pick_up(t: f64, mass: f64, damping: Damping) -> Plant {
    let mut plant = slide(held(), 9.81, damping);
    let body = plant.model.frame("body").unwrap().body;
    let inertia = LinkInertia { mass, com: Vector3::zeros(), inertia_com: Matrix3::identity() * 0.05 * mass };
    plant.inertia_changes = vec![InertiaChange { t, body, inertia: inertia.spatial() }];
    plant
}

/// Truth: closed form of a mass that is attached to a spring at rest. The time of the event is at
/// the end of a step or within one. With the matrix of the empty arm the iteration of the next step
/// diverged.
///
/// Measured, relative to the sag: generalised-alpha 2.5e-5, RK4 3.7e-8, reference 8.4e-8.
#[test]
fn an_arm_that_picks_up_fifty_times_its_mass_swings_about_the_new_sag() {
    let (heavy, g) = (50.0 * MASS, 9.81);
    for at in [0.1, 0.10037] {
        let plant = pick_up(at, heavy, Damping::StiffnessProportional(0.0));
        let omega = (K / heavy).sqrt();
        let (before, after) = (-MASS * g / K, -heavy * g / K);
        let truth = |t: f64| if t < at { before } else { after + (before - after) * (omega * (t - at)).cos() };
        let cases = registered(false).map(|kind| (kind, if is_fine(&kind) { 1e-6 } else { 2e-4 }));
        for (kind, bound) in cases.chain([(PLAIN, 2e-3)]) {
            let error = error(&plant, kind, 1e-3, 2.0, 2, truth) / after.abs();
            eprintln!("{:<18} at {at}: {error:.1e}", kind.name());
            assert!(error < bound, "{} at {at}: {error}", kind.name());
        }
    }
}

/// A payload present from the start is part of the initial equilibrium. Truth: `m g / K`, at rest.
#[test]
fn a_payload_of_time_zero_hangs_still() {
    let heavy = 7.0 * MASS;
    let plant = pick_up(0.0, heavy, Damping::Modal(0.03));
    for kind in registered(true) {
        let error = error(&plant, kind, 1e-3, 0.1, 2, |_| -heavy * 9.81 / K);
        // The sag is 0.17 m; from the equilibrium without payload the arm would oscillate with that
        // amplitude.
        assert!(error < 1e-6, "{} {error}", kind.name());
    }
}

/// Truth: a modal damping ratio refers to the modes of the current arm: 3 % before and after the
/// pick-up.
#[test]
fn modal_damping_keeps_its_ratio_with_another_payload() {
    let (heavy, g, zeta, at) = (50.0 * MASS, 9.81, 0.03_f64, 0.1);
    let plant = pick_up(at, heavy, Damping::Modal(zeta));
    let omega = (K / heavy).sqrt();
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let (before, after) = (-MASS * g / K, -heavy * g / K);
    let truth = |t: f64| {
        let s = (t - at).max(0.0);
        let swing = (damped * s).cos() + zeta * omega / damped * (damped * s).sin();
        after + (before - after) * (-zeta * omega * s).exp() * swing
    };
    for kind in registered(false) {
        let error = error(&plant, kind, 1e-3, 4.0, 2, truth) / after.abs();
        eprintln!("{:<18} {error:.1e}", kind.name());
        // measured 2e-5; with the damping of the empty arm 0.2
        assert!(error < 2e-4, "{} {error}", kind.name());
    }
}

/// Truth: an oscillator under a force that begins and ends between steps.
///
/// Second order in the step size: a quarter of the step gives a sixteenth of the error. Resolving
/// both ends only to a step would give first order.
#[test]
fn a_load_that_begins_and_ends_between_steps_acts_as_long_as_it_lasts() {
    let (from, to, F) = (0.01034, 0.05271, 300.0);
    let wrench = TimedWrench::new(move |t: f64| {
        let force = if (from..=to).contains(&t) { F } else { 0.0 };
        Wrench::new(Vector3::x() * force, Vector3::zeros())
    });
    let mut plant = slide(held(), 0.0, Damping::StiffnessProportional(0.0));
    let body = plant.model.frame("body").unwrap().body;
    plant = plant.with_timed_loads(vec![Load::at_origin(body, wrench.with_jumps(vec![from, to]))]).unwrap();
    let omega = (K / MASS).sqrt();
    let ramp = |t: f64, s: f64| if t > s { F / K * (1.0 - (omega * (t - s)).cos()) } else { 0.0 };
    let truth = |t: f64| ramp(t, from) - ramp(t, to);
    let cases = registered(false).map(|kind| (kind, if is_fine(&kind) { 1e-5 } else { 5e-4 }));
    for (kind, bound) in cases.chain([(PLAIN, 2e-2), (SPOOK, 0.1)]) {
        let errors = [1e-3, 2.5e-4].map(|h| error(&plant, kind, h, 0.2, 0, truth) / (F / K));
        eprintln!("{:<18} {errors:?}", kind.name());
        assert!(errors[0] < bound, "{} {errors:?}", kind.name());
        if kind == PLAIN {
            assert!(errors[0] / errors[1] > 12.0, "{errors:?}");
        }
    }
}

/// Truth: the base of an oscillator at rest jumps to velocity Δv; e = -Δv/ω sin ω(t - t_c) for each
/// corner, summed up.
///
/// Corners at the ends of steps, between them, two in one step, and at the start.
#[test]
fn the_base_velocity_jumps_and_the_spring_takes_the_impulse() {
    let corners = vec![(0.0, 0.3), (0.02, -0.5), (0.06037, 1.0), (0.0611, 0.2), (0.1, 0.0)];
    let motion = Corners { corners: corners.clone() };
    let plant = slide(Arc::new(motion), 0.0, Damping::StiffnessProportional(0.0));
    let omega = (K / MASS).sqrt();
    let truth = |t: f64| {
        let mut before = 0.0;
        let struck = corners.iter().map(|&(at, v)| {
            let jump = v - before;
            before = v;
            if t > at { -jump / omega * (omega * (t - at)).sin() } else { 0.0 }
        });
        struck.sum::<f64>()
    };
    let size = 1.0 / omega;
    let cases = registered(false).flat_map(|kind| {
        let bounds = if is_fine(&kind) { [1e-5, 1e-4] } else { [1e-3, 1e-2] };
        [(kind, 1e-3, bounds[0]), (kind, 2e-3, bounds[1])]
    });
    for (kind, h, bound) in cases.chain([(PLAIN, 5e-4, 1e-2), (reference(), 1e-3, 1e-6), (SPOOK, 1e-4, 1e-2)]) {
        let error = error(&plant, kind, h, 0.2, 0, truth) / size;
        eprintln!("{:<18} {h:.0e}: {error:.1e}", kind.name());
        assert!(error < bound, "{} {h}: {error}", kind.name());
    }
}

/// Truth: the base of an oscillator reaches its velocity with constant acceleration within 3 ms,
/// between the steps, without a declared velocity jump: `e = -a/ω² (1 - cos ω(t - t_0))` minus the
/// same from the end of the acceleration on.
///
/// Measured, relative to the amplitude of a corner: generalised-alpha 2.6e-5 at 1 ms, 3.9e-4 at 2
/// ms, SDIRK3 7.2e-5 and 2.9e-3 (2.1e-2 at 1 ms without subdivided steps), RK4 1.5e-3 at 0.1 ms.
#[test]
fn velocities_that_rise_within_a_few_steps_strike_as_hard_as_corners() {
    let (v, from, rise) = (0.5, 0.01034, 0.003);
    let motion = MotionFn(move |t: f64, q: &mut [f64], qdot: &mut [f64], qddot: &mut [f64]| {
        let s = (t - from).clamp(0.0, rise);
        q[0] = 0.5 * v / rise * s * s + v * (t - from - rise).max(0.0);
        qdot[0] = v / rise * s;
        qddot[0] = if s > 0.0 && s < rise { v / rise } else { 0.0 };
    });
    let plant = slide(Arc::new(motion), 0.0, Damping::StiffnessProportional(0.0));
    let omega = (K / MASS).sqrt();
    let pushed = |t: f64| v / rise / omega.powi(2) * (1.0 - (omega * t.max(0.0)).cos());
    let truth = |t: f64| pushed(t - from - rise) - pushed(t - from);
    for kind in registered(false) {
        let steps = if is_fine(&kind) { [1e-4, 1e-4] } else { [1e-3, 2e-3] };
        for h in steps {
            let error = error(&plant, kind, h, 0.2, 0, truth) * omega / v;
            eprintln!("{:<18} {h:.0e}: {error:.1e}", kind.name());
            assert!(error < 1e-2, "{} {h}: {error}", kind.name());
        }
    }
}

/// Truth: the work of the drive at a velocity jump is the gain of kinetic energy, `m Δv (v + Δv/2)`
/// of the carriage only, because the body on the spring keeps its velocity.
#[test]
fn the_work_of_a_blow_is_the_energy_that_it_brings() {
    let motion = Corners { corners: vec![(0.0105, 0.5), (0.0305, -0.25)] };
    let plant = slide(Arc::new(motion), 0.0, Damping::StiffnessProportional(0.0));
    for kind in registered(false) {
        let mut stepper = new_stepper(kind, plant.clone(), 1e-3, Start::Equilibrium).unwrap();
        let mut seen = Observation::new(&plant);
        (0..40).for_each(|_| stepper.step().unwrap());
        stepper.observe(&mut seen);
        let truth = 2.0 * (0.5 * 0.5f64.powi(2) + -0.75 * (0.5 - 0.375));
        // measured 1e-16
        assert!((seen.impulse_work - truth).abs() < 1e-12, "{} {}", kind.name(), seen.impulse_work);
    }
}

/// A force that begins in the middle of a long run, a payload and a velocity jump at one time, and
/// a step that is longer than the time between them: every stepper reaches the same final state as
/// the one with error control.
#[test]
fn events_at_one_time_and_events_within_one_step_are_all_met() {
    let motion = Corners { corners: vec![(0.05, 0.4), (0.0503, -0.2), (0.06, 0.0)] };
    let mut plant = slide(Arc::new(motion), 9.81, Damping::StiffnessProportional(1e-4));
    let body = plant.model.frame("body").unwrap().body;
    let change = |t: f64, mass: f64| {
        let inertia = LinkInertia { mass, com: Vector3::x() * 0.1, inertia_com: Matrix3::identity() };
        InertiaChange { t, body, inertia: inertia.spatial() }
    };
    plant.inertia_changes = vec![change(0.05, 80.0), change(0.0508, 5.0), change(0.06, 30.0)];
    let force = |t: f64| Vector3::x() * if t >= 0.0505 { 500.0 } else { 0.0 };
    let wrench = TimedWrench::new(move |t| Wrench::new(force(t), Vector3::zeros())).with_jumps(vec![0.0505]);
    plant = plant.with_timed_loads(vec![Load::at_origin(body, wrench)]).unwrap();
    let end = |kind: StepperKind, h: f64| {
        let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).unwrap();
        let mut seen = Observation::new(&plant);
        (0..(0.2 / h).round() as usize).for_each(|_| stepper.step().unwrap());
        stepper.observe(&mut seen);
        seen.q.rows(1, 6).clone_owned()
    };
    let truth = end(reference(), 2e-3);
    let cases = registered(false).flat_map(|kind| {
        let cases = if is_fine(&kind) { [(5e-4, 1e-5), (2.5e-4, 1e-6)] } else { [(1e-3, 5e-3), (2e-3, 2e-2)] };
        cases.map(|(h, bound)| (kind, h, bound))
    });
    for (kind, h, bound) in cases.chain([(reference(), 5e-4, 1e-6)]) {
        let error = (end(kind, h) - &truth).amax() / truth.amax();
        eprintln!("{:<18} {h:.0e}: {error:.1e}", kind.name());
        assert!(error < bound, "{} {h}: {error}", kind.name());
    }
}

/// A mass between two walls: the force `x / (1 - x²)` is undefined beyond them.
struct Walls {
    /// Position of the last residual.
    x: f64,
}

impl SecondOrderSystem for Walls {
    fn dimension(&self) -> usize {
        1
    }
    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        let mut free = DVector::zeros(1);
        self.acceleration(t, x, v, &mut free).unwrap();
        self.x = x[0];
        r[0] = a[0] - free[0];
    }
    fn acceleration(
        &mut self,
        _: f64,
        x: &DVector<f64>,
        _: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        a[0] = if x[0].abs() < 1.0 { -x[0] / (1.0 - x[0] * x[0]) } else { f64::NAN };
        Ok(())
    }
    fn mass(&mut self, M: &mut DMatrix<f64>) {
        M.fill(1.0);
    }
    fn damping_and_stiffness(&mut self, _: f64, c_K: f64, C: &mut DMatrix<f64>) {
        let s = self.x * self.x;
        C.fill(c_K * (1.0 + s) / (1.0 - s).powi(2));
    }
    fn stiffness(&mut self, stiffness: &mut DMatrix<f64>) {
        stiffness.fill(1.0);
    }
}

/// A step that ends beyond a wall has no solution that Newton's method finds; shorter steps have
/// one, and after the bounce the steps are complete again. Truth: energy, `v²/2 - ln(1 - x²)/2`,
/// and the time, which stays on the grid.
#[test]
fn a_step_that_fails_is_taken_in_shorter_ones() {
    let settings = AlphaSettings { rho: 1.0, dispersion_correction: false };
    let (x, v) = (DVector::zeros(1), DVector::from_element(1, 2.0));
    let mut walls = Walls { x: 0.0 };
    let mut g = GeneralizedAlpha::new(&mut walls, 0.0, 0.05, settings, x, v).unwrap();
    let (mut bounces, mut worst) = (0, 0.0f64);
    for k in 1..=2000 {
        let before = g.now.v[0];
        g.step(&mut walls).unwrap();
        assert!((g.time() - 0.05 * f64::from(k)).abs() < 1e-9 && g.steps() == k as u64);
        bounces += u32::from(before * g.now.v[0] < 0.0);
        if g.now.x[0].abs() < 0.5 {
            worst = worst.max((0.5 * g.now.v[0].powi(2) - 0.5 * (1.0 - g.now.x[0].powi(2)).ln() - 2.0).abs() / 2.0);
        }
    }
    eprintln!("{bounces} bounces in 100 s, energy within {worst:.1e}");
    assert!(bounces > 50 && worst < 0.2, "{bounces} {worst}");
}
