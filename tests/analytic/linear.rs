//! Statics, modes and frequency response against each other and against what the time steppers do.
#![allow(non_snake_case, reason = "monogram notation")]
#![allow(clippy::print_stderr, reason = "measured numbers are shown with --nocapture")]

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::poses::ResponseRequest;
use flexarm::{Modelling, Motion, Robot, RunOptions};
use flexarm_analysis::{Taper, strongest_line};
use flexarm_kinematics::{Data, Frame, Model, State, Wrench, forward_kinematics, mass_matrix};
use flexarm_stepping::*;
use nalgebra::{DMatrix, DVector, Vector3};

const POSE: [f64; 6] = [0.3, 0.4, -0.2, 0.5, 0.7, 0.1];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the workspace").to_owned()
}

fn load(robot: &str) -> Robot {
    Robot::load(root().join("robots").join(robot)).expect("a sound robot")
}

/// The reference arm by file with another damping.
fn plant(damping: Damping, motion: Arc<dyn PrescribedMotion>) -> (Plant, Frame) {
    let robot = load("test/reference_arm").model(&Modelling::default()).expect("a tree");
    let mut robot = Arc::unwrap_or_clone(robot);
    robot.springs.iter_mut().for_each(|spring| spring.damping = damping);
    let tool = robot.model.frame("__tcp").expect("there").clone();
    (robot.plant(motion).expect("carries its weight"), tool)
}

fn held() -> Arc<dyn PrescribedMotion> {
    Arc::new(Held(POSE.to_vec()))
}

fn position(model: &Model, data: &mut Data, tool: &Frame, x: &DVector<f64>) -> Vector3<f64> {
    let mut state = State::zeros(model);
    state.q.rows_mut(0, 6).copy_from_slice(&POSE);
    state.q.rows_mut(6, x.len()).copy_from(x);
    forward_kinematics(model, data, &state.q);
    data.X_WF(tool).translation.vector
}

/// Amplitude and phase of `value = a sin(ωt + φ) + constant` over whole periods.
fn fitted(samples: &[(f64, f64)], omega: f64) -> (f64, f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().map(|s| s.1).sum::<f64>() / n;
    let part = |f: fn(f64) -> f64| samples.iter().map(|(t, y)| 2.0 / n * (y - mean) * f(omega * t)).sum::<f64>();
    let (sine, cosine) = (part(f64::sin), part(f64::cos));
    (sine.hypot(cosine), cosine.atan2(sine))
}

/// Truth: `compare`, which finds the modes at the start of its motion by the undamped problem.
#[test]
fn modes_of_the_industrial_arm_are_those_that_compare_reports() {
    let robot = load("kr210/links.toml");
    let path = root().join("trajectories/pick_and_place.toml");
    let motion = Motion::load_for(&path, &robot.rigid_model().expect("a tree")).expect("a sound trajectory");
    let (mut q, mut v, mut a) = ([0.0; 6], [0.0; 6], [0.0; 6]);
    motion.trajectory.sample(0.0, &mut q, &mut v, &mut a);
    let options = RunOptions { log_rate_hz: 100.0, step_s: 0.01, ..RunOptions::default() };
    let arm = robot.model(&Modelling::default()).expect("a model");
    let reported = arm.simulate(&motion, &options).expect("runs").summary.frequencies_hz;
    let found = robot
        .model(&Modelling::default())
        .expect("an equilibrium")
        .modes(Some(q.as_slice()), None, 100)
        .expect("an equilibrium");
    assert_eq!((found.total, found.frequencies_hz.len()), (12, reported.len()));
    let mut worst = 0.0f64;
    for (mode, truth) in found.modes.iter().zip(&reported) {
        worst = worst.max((mode.frequency_hz / truth - 1.0).abs());
        // Modal damping of 3 per cent is what its file asks for, in every mode.
        assert!((mode.damping_ratio - 0.03).abs() < 1e-8, "{}", mode.damping_ratio);
        assert!((mode.strain_energy.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(mode.residual < 1e-8);
    }
    eprintln!("KR 210: frequencies within {worst:.1e} of those of compare, first {:.4} Hz", reported[0]);
    assert!(worst < 1e-9); // measured 8e-15
    for (axis, covered) in found.compliance_covered.iter().enumerate() {
        assert!((covered.expect("it yields") - 1.0).abs() < 1e-9, "axis {axis}: {covered:?}");
    }
}

/// Truth: `C = J K^-1 Jᵀ` of statics is the response at 0 Hz, all 36 entries, and the sag is what
/// the steppers start from.
#[test]
fn response_at_rest_is_the_compliance() {
    let robot = load("kr210/links.toml");
    let at: &[f64] = &[0.2, -1.1, 1.2, 0.3, 0.4, 0.5];
    let C = robot
        .model(&Modelling::default())
        .expect("an equilibrium")
        .statics(Some(at), [0.0; 6])
        .expect("an equilibrium")
        .compliance;
    let words = |words: [&str; 6]| words.map(str::to_owned).to_vec();
    let request = ResponseRequest {
        inputs: words(["force-x", "force-y", "force-z", "torque-x", "torque-y", "torque-z"]),
        outputs: words(["x", "y", "z", "rx", "ry", "rz"]),
        points: 2,
        ..ResponseRequest::default()
    };
    let found =
        robot.model(&Modelling::default()).expect("a response").response(Some(at), &request).expect("a response");
    let mut worst = 0.0f64;
    for (k, curve) in found.curves.iter().enumerate() {
        let (i, j) = (k % 6, k / 6);
        let size = (C[i][i] * C[j][j]).sqrt();
        worst = worst.max((curve.at_rest.expect("finite") - C[i][j]).abs() / size);
    }
    eprintln!("response at rest within {worst:.1e} of the compliance");
    assert!(worst < 1e-12); // measured 3e-16
}

/// Truth: the linear modes. The nonlinear arm is let go at rest, deflected in the shape of a mode;
/// damping 0.2 %, 60 cycles.
#[test]
fn ringing_from_a_shape_has_the_frequency_of_its_mode() {
    let (plant, tool) = plant(Damping::Modal(0.002), held());
    let still = linearise(&plant, &tool, &Wrench::zeros(), 0.0).expect("an equilibrium");
    let model = plant.model.clone();
    let mut data = Data::new(&model);
    let frequencies = plant.modes.frequencies_hz();
    // A start in the shape of one mode, 0.2 mm at the tool: the first three.
    for (j, truth) in frequencies.iter().take(3).enumerate() {
        let phi = plant.modes.shapes.column(j).into_owned();
        let motion = (&still.J * &phi).rows(0, 3).norm();
        let start = &still.equilibrium + phi * (2e-4 / motion);
        let mut system = ReducedArm::new(plant.clone());
        let settings = AlphaSettings { rho: 1.0, dispersion_correction: true };
        let rest = DVector::zeros(start.len());
        let h = 1.0 / (200.0 * truth);
        let mut alpha = GeneralizedAlpha::new(&mut system, 0.0, h, settings, start, rest).expect("starts");
        let (mut times, mut signal) = (Vec::new(), Vec::new());
        let cycles = 60;
        for step in 0..200 * cycles {
            if step % 8 == 0 {
                times.push(alpha.time());
                signal.push((position(&model, &mut data, &tool, &alpha.now.x) - still.X_WT.translation.vector).into());
            }
            alpha.step(&mut system).expect("steps");
        }
        let line = strongest_line(&times, &signal, Taper::FadeOut).expect("it rings");
        // The record resolves 1/60 of the frequency; the peak between its lines is found far within
        // that.
        let error = line.hz / truth - 1.0;
        eprintln!("mode {}: {truth:.4} Hz, ringing {:.4} Hz ({error:+.1e})", j + 1, line.hz);
        assert!(error.abs() < 2e-4); // measured 5.7e-5, which is 0.2 / 60²: what the taper does
    }
}

/// Truth: the linear modes within the resolution of the record. The arm is let go from where a
/// force of 400 N held it.
#[test]
fn ringing_after_release_from_a_load_has_the_frequency_of_a_mode() {
    let (plant, tool) = plant(Damping::Modal(0.01), held());
    let still = linearise(&plant, &tool, &Wrench::zeros(), 0.0).expect("an equilibrium");
    let model = plant.model.clone();
    let mut data = Data::new(&model);
    for direction in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let pull = Wrench::new(direction * 400.0, Vector3::zeros());
        let start = linearise(&plant, &tool, &pull, 0.0).expect("an equilibrium").equilibrium;
        let mut system = ReducedArm::new(plant.clone());
        let rest = DVector::zeros(start.len());
        let mut alpha =
            GeneralizedAlpha::new(&mut system, 0.0, 5e-4, AlphaSettings::default(), start, rest).expect("starts");
        let (mut times, mut signal) = (Vec::new(), Vec::new());
        let duration = 5.0;
        while alpha.time() < duration {
            let moved = position(&model, &mut data, &tool, &alpha.now.x) - still.X_WT.translation.vector;
            times.push(alpha.time());
            signal.push(moved.into());
            alpha.step(&mut system).expect("steps");
        }
        let line = strongest_line(&times, &signal, Taper::FadeOut).expect("it rings");
        let off = plant.modes.frequencies_hz().iter().map(|f| (f - line.hz).abs()).fold(f64::INFINITY, f64::min);
        eprintln!("let go along {:?}: {:.3} Hz, {off:.1e} Hz from a mode", direction.as_slice(), line.hz);
        assert!(off < 0.5 / duration); // measured 1.1e-3 Hz
    }
}

/// An arm with a harmonic force on its free coordinates, `B sin ωt`.
struct Shaken {
    arm: ReducedArm,
    B: DVector<f64>,
    omega: f64,
    M: DMatrix<f64>,
}

impl SecondOrderSystem for Shaken {
    fn dimension(&self) -> usize {
        self.arm.dimension()
    }
    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        self.arm.residual(t, x, v, a, r);
        r.axpy(-(self.omega * t).sin(), &self.B, 1.0);
    }
    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        self.arm.acceleration(t, x, v, a)?;
        let push = self.M.clone().cholesky().expect("masses").solve(&self.B);
        a.axpy((self.omega * t).sin(), &push, 1.0);
        Ok(())
    }
    fn mass(&mut self, M: &mut DMatrix<f64>) {
        self.arm.mass(M);
    }
    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, C: &mut DMatrix<f64>) {
        self.arm.damping_and_stiffness(c_D, c_K, C);
    }
    fn stiffness(&mut self, K: &mut DMatrix<f64>) {
        self.arm.stiffness(K);
    }
}

/// Truth: the nonlinear arm shaken by a force at the frequency of the two highest peaks of its
/// response until the start has died away: height and phase of the peak.
#[test]
fn a_force_at_a_resonance_shakes_the_tool_as_high_as_the_peak() {
    let robot = load("test/reference_arm");
    let request = ResponseRequest {
        inputs: vec!["force-z".into()],
        outputs: vec!["z".into()],
        to_hz: Some(60.0),
        ..ResponseRequest::default()
    };
    let found = robot
        .model(&Modelling::default())
        .expect("a response")
        .response(Some(&POSE[..]), &request)
        .expect("a response");
    let own = robot.model(&Modelling::default()).expect("a tree");
    let plant = own.plant(held()).expect("carries its weight");
    let tool = plant.model.frame("__tcp").expect("there").clone();
    let still = linearise(&plant, &tool, &Wrench::zeros(), 0.0).expect("an equilibrium");
    let model = plant.model.clone();
    let mut data = Data::new(&model);
    for peak in found.curves[0].peaks.iter().take(2) {
        let omega = TAU * peak.frequency_hz;
        let force = 1e-4 / peak.magnitude; // a tenth of a millimetre at the tool
        let B = still.J.row(2).transpose() * force;
        let mut state = State::zeros(&model);
        state.q.copy_from(&still.q);
        let M = mass_matrix(&model, &mut data, &state.q).view((6, 6), (B.len(), B.len())).clone_owned();
        let mut system = Shaken { arm: ReducedArm::new(plant.clone()), B, omega, M };
        let h = TAU / omega / 200.0;
        let settings = AlphaSettings { rho: 1.0, dispersion_correction: true };
        let rest = DVector::zeros(still.equilibrium.len());
        let start = still.equilibrium.clone();
        let mut alpha = GeneralizedAlpha::new(&mut system, 0.0, h, settings, start, rest).expect("starts");
        let mut samples = Vec::new();
        let periods = 80;
        for step in 0..200 * periods {
            if step >= 200 * (periods - 10) {
                samples.push((alpha.time(), position(&model, &mut data, &tool, &alpha.now.x).z));
            }
            alpha.step(&mut system).expect("steps");
        }
        let (amplitude, phase) = fitted(&samples, omega);
        let error = amplitude / (force * peak.magnitude) - 1.0;
        let turn = (phase - peak.phase_rad).rem_euclid(TAU);
        let turn = turn.min(TAU - turn);
        eprintln!("{:.3} Hz: height {error:+.1e}, phase {turn:.1e} rad", peak.frequency_hz);
        assert!(error.abs() < 1e-2 && turn < 1e-2); // measured 8e-5 and 8e-5
    }
}

/// The same for joint 2 as the shaker, whose acceleration drives the arm and which moves the tool
/// directly as well.
#[test]
fn a_joint_at_a_resonance_shakes_the_tool_as_high_as_the_peak() {
    let robot = load("test/reference_arm");
    let request = ResponseRequest {
        inputs: vec!["joint_2".into()],
        outputs: vec!["x".into(), "z".into()],
        to_hz: Some(60.0),
        ..ResponseRequest::default()
    };
    let found = robot
        .model(&Modelling::default())
        .expect("a response")
        .response(Some(&POSE[..]), &request)
        .expect("a response");
    for (curve, axis) in found.curves.iter().zip([0, 2]) {
        let peak = &curve.peaks[0];
        let omega = TAU * peak.frequency_hz;
        let size = 1e-4 / peak.magnitude;
        let motion = MotionFn(move |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
            q.copy_from_slice(&POSE);
            v.fill(0.0);
            a.fill(0.0);
            let (sine, cosine) = (omega * t).sin_cos();
            (q[1], v[1], a[1]) = (POSE[1] + size * sine, size * omega * cosine, -size * omega * omega * sine);
        });
        let own = robot.model(&Modelling::default()).expect("a tree");
        let plant = own.plant(Arc::new(motion)).expect("carries its weight");
        let tool = plant.model.frame("__tcp").expect("there").clone();
        let mut seen = Observation::new(&plant);
        let kind = StepperKind::GeneralizedAlpha(AlphaSettings { rho: 1.0, dispersion_correction: true });
        let mut stepper = new_stepper(kind, plant, TAU / omega / 200.0, Start::Equilibrium).expect("starts");
        let mut samples = Vec::new();
        let periods = 80;
        for step in 0..200 * periods {
            if step >= 200 * (periods - 10) {
                stepper.observe(&mut seen);
                samples.push((seen.t, (seen.X_WB[tool.body] * tool.X_BF).translation.vector[axis]));
            }
            stepper.step().expect("steps");
        }
        let (amplitude, phase) = fitted(&samples, omega);
        let error = amplitude / (size * peak.magnitude) - 1.0;
        let turn = (phase - peak.phase_rad).rem_euclid(TAU);
        let turn = turn.min(TAU - turn);
        eprintln!(
            "joint 2 to {}: {:.3} Hz, height {error:+.1e}, phase {turn:.1e} rad",
            curve.output, peak.frequency_hz
        );
        assert!(error.abs() < 1e-2 && turn < 1e-2); // measured 8e-5 and 3e-5
    }
}
