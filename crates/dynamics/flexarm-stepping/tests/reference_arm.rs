//! The reference arm against a converged solution of another tool (Pinocchio's recursions, scipy's
//! DOP853).

use std::sync::Arc;

use flexarm_kinematics::{Model, Wrench};
use flexarm_settings::Words;
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{follow_reference_motion, reference_arm};
use nalgebra::{DVector, Vector3};

const GOLDEN: &str = include_str!("../../../../tests/golden/reference_arm_mid.csv");

struct Golden {
    time: f64,
    rigid: Vector3<f64>,
    flexible: Vector3<f64>,
}

fn golden() -> Vec<Golden> {
    let rows = GOLDEN.lines().filter(|l| !l.starts_with(['#', 't']));
    rows.map(|l| {
        let x: Vec<f64> = l.split(',').map(|x| x.parse().expect("a number")).collect();
        Golden { time: x[0], rigid: Vector3::new(x[1], x[2], x[3]), flexible: Vector3::new(x[4], x[5], x[6]) }
    })
    .collect()
}

fn plant() -> Plant {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let damping = Damping::StiffnessProportional(reference.beta);
    let springs =
        vec![("lower".to_owned(), reference.K_S[0], damping), ("upper".to_owned(), reference.K_S[1], damping)];
    let motion = MotionFn(follow_reference_motion);
    Plant::new(model, springs, Arc::new(motion)).expect("valid")
}

/// Returns the maximum TCP difference to the golden curve relative to the peak deflection.
fn tcp_error(kind: StepperKind, h: f64) -> f64 {
    let golden = golden();
    let plant = plant();
    let tcp = plant.model.frame("tcp").expect("there").clone();
    let mut seen = Observation::new(&plant);
    let mut stepper = new_stepper(kind, plant, h, Start::Equilibrium).expect("starts");
    let (mut peak, mut worst, mut done) = (0.0f64, 0.0f64, 0u64);
    for row in &golden {
        peak = peak.max((row.flexible - row.rigid).norm());
        let steps = (row.time / h).round() as u64;
        if ((steps as f64) * h - row.time).abs() > 1e-9 {
            continue;
        }
        while done < steps {
            stepper.step().expect("steps");
            done += 1;
        }
        stepper.observe(&mut seen);
        let p = (seen.X_WB[tcp.body] * tcp.X_BF).translation.vector;
        worst = worst.max((p - row.flexible).norm());
    }
    eprintln!(
        "{:<18} h = {h:.1e}: {:.3e} of the peak deflection {peak:.6} m, {:?}",
        kind.name(),
        worst / peak,
        stepper.counts()
    );
    worst / peak
}

fn spook(form: ConstraintForm, preset: SpookPreset) -> StepperKind {
    StepperKind::Spook(SpookSettings { form, preset })
}

const ALPHA: StepperKind = StepperKind::GeneralizedAlpha(AlphaSettings { rho: 0.9, dispersion_correction: true });

/// Truth: Pinocchio's mass matrix and central differences of its gravity forces about the same
/// pose.
///
/// (Pinocchio's own derivative of gravity omits dS/dq of its ZYX joint: 9.0634 Hz instead of
/// 9.0660.)
#[test]
fn frequencies_and_static_pose_equal_those_of_the_other_tool() {
    let plant = plant();
    let found = plant.modes.frequencies_hz();
    let truth = [9.06600653, 11.77337488, 19.6421425, 36.51154171, 107.00642497, 114.55233058];
    for (f, truth) in found.iter().zip(truth) {
        assert!((f / truth - 1.0).abs() < 1e-8, "{f} {truth}"); // measured 1e-9, the digits given
    }
    assert!((found[11] / 596.29191711 - 1.0).abs() < 1e-8);
    assert!(plant.modes.residual < 1e-10); // measured 3e-13
    let e = static_equilibrium(&plant, 0.0).expect("stands");
    assert!((e[4] / 0.0007123926534315615 - 1.0).abs() < 1e-10); // measured 3e-15
    assert!((e[10] / 0.0002340045417227465 - 1.0).abs() < 1e-10);
}

const fn plain(rho: f64) -> StepperKind {
    StepperKind::GeneralizedAlpha(AlphaSettings { rho, dispersion_correction: false })
}

/// Generalised-alpha with its dispersion correction; measured 4.0e-4, 2.6e-5, 1.6e-6 of the peak at
/// 4, 1, 0.25 ms.
#[test]
fn generalized_alpha_converges_to_the_reference_with_second_order() {
    let errors = [4e-3, 1e-3, 2.5e-4].map(|h| tcp_error(ALPHA, h));
    assert!(errors[0] < 2e-3);
    assert!(errors[1] < 1e-4);
    let order = (errors[1] / errors[2]).log2() / 2.0;
    assert!((order - 2.0).abs() < 0.1, "{order}"); // measured 2.00
}

/// Without the correction; measured 1.051e-2, 6.59e-4, 4.12e-5 of the peak at 4, 1, 0.25 ms.
///
/// The trapezoidal rule (rho = 1), which has the smallest error constant of all A-stable linear
/// multistep methods (Dahlquist's second barrier), gives 1.038e-2 at 4 ms: no plain member of the
/// family does better there.
#[test]
fn plain_generalized_alpha_is_bounded_by_the_trapezoidal_rule() {
    let errors = [4e-3, 1e-3, 2.5e-4].map(|h| tcp_error(plain(0.9), h));
    assert!(errors[0] < 1.06e-2);
    assert!(errors[1] < 1e-3);
    let order = (errors[1] / errors[2]).log2() / 2.0;
    assert!((order - 2.0).abs() < 0.05, "{order}"); // measured 2.000
    let trapezoidal = tcp_error(plain(1.0), 4e-3);
    assert!(trapezoidal < errors[0] && trapezoidal > 1.03e-2);
}

/// Newton's iteration may leave a fraction of its first correction if damping removes it: the path
/// then differs from that of fully converged iterations by less than the error of the step size.
/// Elastic coordinates every 20 ms for 2 s; measured 1/9 of the error at 5 ms and 1/20 at 1 ms,
/// with half the evaluations.
#[test]
fn what_a_quick_iteration_leaves_is_small_beside_the_error_of_its_step() {
    let path = |h: f64, left: Option<f64>| {
        let plant = plant();
        let e = static_equilibrium(&plant, 0.0).expect("stands");
        let mut system = ReducedArm::new(plant);
        let v = DVector::zeros(e.len());
        let alpha = GeneralizedAlpha::new(&mut system, 0.0, h, AlphaSettings::default(), e, v).expect("starts");
        let mut alpha = left.map_or(alpha.clone(), |left| alpha.leaving(left));
        let mut path = Vec::new();
        for _ in 0..100 {
            (0..(20e-3 / h).round() as usize).for_each(|_| alpha.step(&mut system).expect("steps"));
            path.push(alpha.now.x.clone());
        }
        (path, alpha.counts().evaluations)
    };
    // 10 ms is less than twelve steps per period of the first mode.
    for (h, part) in [(10e-3, 1e-3), (5e-3, 0.03), (1e-3, 0.03)] {
        let ((quick, few), (whole, many)) = (path(h, Some(part)), path(h, None));
        let (finer, _) = path(0.25 * h, None);
        let distance =
            |a: &[DVector<f64>], b: &[DVector<f64>]| a.iter().zip(b).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
        let (left, error) = (distance(&quick, &whole), distance(&whole, &finer));
        eprintln!("{h} s: {left:.1e} left, {error:.1e} in error; {few} and {many} evaluations");
        assert!(left < 0.3 * error && 10 * few < 6 * many, "{left} {error} {few} {many}");
    }
}

/// Steps of 10 ms, fewer than twelve per period of the first mode, with the settings of a run:
/// about two evaluations each, neither one, which is unstable for lightly damped arms, nor full
/// convergence. Measured difference to the fully converged run: 1.5e-3 of the largest elastic
/// coordinate in 2 s, independent of the iteration error, because a run subdivides the steps in
/// which the motion begins.
#[test]
fn coarse_steps_of_a_run_take_two_evaluations() {
    let h = 10e-3;
    let e = static_equilibrium(&plant(), 0.0).expect("stands");
    let v = DVector::zeros(e.len());
    let mut system = ReducedArm::new(plant());
    let mut whole = GeneralizedAlpha::new(&mut system, 0.0, h, AlphaSettings::default(), e, v).expect("starts");
    let mut run = new_stepper(ALPHA, plant(), h, Start::Equilibrium).expect("starts");
    let mut seen = Observation::new(&plant());
    let (mut apart, mut largest) = (0.0f64, 0.0f64);
    for _ in 0..200 {
        whole.step(&mut system).expect("steps");
        run.step().expect("steps");
        run.observe(&mut seen);
        apart = apart.max((seen.q.rows(6, 12) - &whole.now.x).amax());
        largest = largest.max(whole.now.x.amax());
    }
    let (few, many) = (run.counts().evaluations, whole.counts().evaluations);
    eprintln!("{:.1e} of the largest coordinate apart; {few} and {many} evaluations", apart / largest);
    assert!(apart < 3e-3 * largest, "{apart} {largest}");
    assert!(10 * few < 7 * many && few > 300, "{few} {many}"); // measured 425 and 771 in 200 steps
}

/// A load that grows to many times the weight adds a geometric stiffness that Newton's matrix does
/// not contain: the iteration error then has the same sign in every step. Truth: the stepper with
/// error control; measured 1.6e-4 of the deflection at 10 ms with 7 steps per period of the first
/// mode.
#[test]
fn what_the_matrix_does_not_know_feeds_no_mode() {
    let at_end = |kind: StepperKind| {
        let plant = plant();
        let tcp = plant.model.frame("tcp").expect("there").clone();
        let pull = TimedWrench::new(|t| Wrench::new(Vector3::new(15e3 * t, 0.0, -5e3 * t), Vector3::zeros()));
        let load = Load { body: tcp.body, X_BF: tcp.X_BF, wrench: pull };
        let plant = plant.with_timed_loads(vec![load]).expect("stands");
        let mut seen = Observation::new(&plant);
        let mut stepper = new_stepper(kind, plant, 10e-3, Start::Equilibrium).expect("starts");
        (0..200).for_each(|_| stepper.step().expect("steps"));
        stepper.observe(&mut seen);
        (seen.q.rows(6, 12).into_owned(), stepper.counts())
    };
    let (truth, _) = at_end(StepperKind::Reference(ReferenceSettings::new(1e-8)));
    let (found, counts) = at_end(ALPHA);
    let error = (&found - &truth).amax() / truth.amax();
    eprintln!("deflection {:.3}, error {error:.1e}, {counts:?}", truth.amax());
    assert!(error < 2e-3, "{error}");
}

/// Extrapolation of two second-order runs is at least of third order; measured 2.3e-5, 1.9e-6,
/// 3.9e-7 of the peak at 4, 2, 1 ms, where generalised-alpha with the half step has 1.0e-4, 2.6e-5,
/// 6.5e-6.
#[test]
fn extrapolation_takes_the_second_order_out_of_the_error() {
    let extrapolated = StepperKind::ExtrapolatedAlpha(ExtrapolatedAlpha::default());
    let alpha = StepperKind::default();
    let steps = [4e-3, 2e-3, 1e-3];
    let errors = steps.map(|h| tcp_error(extrapolated, h));
    let plain = steps.map(|h| tcp_error(alpha, 0.5 * h));
    for (error, plain) in errors.iter().zip(&plain) {
        assert!(*error < 0.3 * plain, "{error:e} {plain:e}");
    }
    let order = (errors[0] / errors[2]).log2() / 2.0;
    assert!(order > 2.8, "{order}"); // measured 2.94
}

/// SDIRK of third order; measured 7.0e-4, 1.1e-5, 1.7e-7 of the peak at 4, 1, 0.25 ms.
#[test]
fn sdirk3_converges_to_the_reference_with_third_order() {
    let errors = [4e-3, 1e-3, 2.5e-4].map(|h| tcp_error(StepperKind::Sdirk3, h));
    assert!(errors[1] < 1e-4);
    let order = (errors[1] / errors[2]).log2() / 2.0;
    assert!((order - 3.0).abs() < 0.1, "{order}"); // measured 3.00
}

/// RK4 reaches the round-off of the stored curve (12 digits of metres); measured 1.7e-9 of the
/// peak, 8 pm.
#[test]
fn rk4_equals_the_reference_to_picometres() {
    assert!(tcp_error(StepperKind::Rk4, 1.25e-4) < 5e-9);
}

/// SPOOK, local form; measured 4.8e-3, 1.7e-3, 5.2e-4, 2.4e-4 of the peak at 1, 0.5, 0.2, 0.1 ms:
/// asymptotically first order.
#[test]
fn spook_converges_to_the_reference_with_first_order() {
    let errors = [1e-3, 5e-4, 2e-4, 1e-4].map(|h| tcp_error(spook(ConstraintForm::Local, SpookPreset::Exact), h));
    assert!(errors[0] < 1e-2 && errors[3] < 5e-4);
    let order = (errors[2] / errors[3]).log2();
    assert!(order > 0.9, "{order}"); // measured 1.15
}

/// The global form differs by terms of first order in the deflection; measured 1.4e-3 of the peak,
/// for any step size.
#[test]
fn global_constraints_differ_from_local_ones_by_the_size_of_the_deflection() {
    let local = tcp_error(spook(ConstraintForm::Local, SpookPreset::Exact), 1e-4);
    let global = tcp_error(spook(ConstraintForm::Global, SpookPreset::Exact), 1e-4);
    // largest elastic rotation of the run: 1.6e-3 rad
    assert!(global - local < 2.0 * 1.6e-3, "{global} {local}");
    assert!(global > local);
}

/// The source preset damps with tau = 2h instead of the physical time: its error does not vanish
/// with the step size. Measured 3.4e-2 at 1 ms (tau = 2 ms is near the physical 1.05 ms) and 1.6e-1
/// at 0.1 ms (almost undamped).
#[test]
fn source_preset_ties_the_damping_to_the_step() {
    let kind = spook(ConstraintForm::Local, SpookPreset::Source);
    let errors = [1e-3, 1e-4].map(|h| tcp_error(kind, h));
    assert!(errors[0] > 1e-2 && errors[0] < 6e-2);
    assert!(errors[1] > 2.0 * errors[0]);
}

const fn reference(method: ReferenceMethod, rtol: f64) -> StepperKind {
    StepperKind::Reference(ReferenceSettings { rtol, atol: 1e-3 * rtol, method })
}

/// Error control: the error (m) decreases with the tolerance, at 1e-9 to about a nanometre.
/// Measured:
///
/// | rtol | bdf | evaluations | esdirk34 | evaluations | tsit45 | evaluations |
/// | --- | --- | --- | --- | --- | --- | --- |
/// | 1e-6 | 4.4e-7 | 7740 | 8.5e-7 | 13984 | | |
/// | 1e-7 | 7.4e-8 | 8493 | 1.6e-7 | 21388 | | |
/// | 1e-8 | 9.8e-9 | 9707 | 3.1e-8 | 35972 | | |
/// | 1e-9 | 1.1e-9 | 11659 | | | 4.8e-10 | 106927 |
/// | 1e-10 | 2.5e-10 | 14989 | | | 7.3e-11 | 104941 |
/// | 1e-11 | 4.8e-11 | 20500 | | | 1.0e-11 | 117997 |
///
/// RK4 at 0.125 ms takes 128000 evaluations; it is unstable at 0.25 ms. The explicit pair also
/// works at its stability limit. The stored curve itself is accurate to 8e-12.
#[test]
fn reference_stepper_converges_with_its_tolerance() {
    use ReferenceMethod::{Bdf, Esdirk34, Tsit45};
    let cases = [
        (Bdf, &[(1e-6, 2e-6), (1e-8, 4e-8), (1e-9, 2e-9), (1e-11, 2e-10)][..]),
        (Esdirk34, &[(1e-6, 4e-6), (1e-8, 2e-7)]),
        (Tsit45, &[(1e-9, 2e-9), (1e-11, 4e-11)]),
    ];
    for (method, tolerances) in cases {
        for (rtol, bound) in tolerances {
            let error = tcp_error(reference(method, *rtol), 1e-3) * 4.836e-3;
            eprintln!("  {} rtol {rtol:.0e}: {error:.2e} m", method.word().unwrap_or_default());
            assert!(error < *bound, "{method:?} {rtol}: {error}");
        }
    }
}

/// Second algorithm: the two methods share only the right-hand side; modal damping of 3 % as in
/// most robot files.
///
/// Maximum difference of an elastic coordinate over 4 s; measured 2.2e-12 (explicit) and 4.5e-12
/// (BDF) m or rad.
#[test]
fn reference_stepper_agrees_with_rk4() {
    let reference_arm = reference_arm(true);
    let model = Arc::new(Model::new(&reference_arm.mechanism).expect("valid"));
    let springs = reference_arm.K_S.map(|K| ("spring".to_owned(), K, Damping::Modal(0.03))).to_vec();
    let plant = Plant::new(model, springs, plant().motion).expect("valid");
    let run = |kind: StepperKind, h: f64| {
        let mut seen = Observation::new(&plant);
        let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).expect("starts");
        let mut curve = Vec::new();
        for _ in 0..1000 {
            (0..(4e-3 / h).round() as usize).for_each(|_| stepper.step().expect("steps"));
            stepper.observe(&mut seen);
            curve.push(seen.q.clone());
        }
        (curve, stepper.counts())
    };
    let (truth, _) = run(StepperKind::Rk4, 1.25e-4);
    for method in [ReferenceMethod::Bdf, ReferenceMethod::Tsit45] {
        let (found, counts) = run(reference(method, 1e-11), 1e-3);
        let difference = truth.iter().zip(&found).map(|(a, b)| (a - b).amax()).fold(0.0f64, f64::max);
        eprintln!("{} against rk4: {difference:.1e}, {counts:?}", method.word().unwrap_or_default());
        assert!(difference < 1e-10, "{method:?} {difference:e}");
    }
}

/// No stepper of the registry allocates in its steps, except those that declare it because their
/// solver is another library's.
#[test]
fn steps_do_not_allocate() {
    for entry in STEPPERS.into_iter().filter(|entry| !entry.allocates) {
        let kind = (entry.with)(&StepperOptions::default());
        let mut stepper = new_stepper(kind, plant(), 1e-4, Start::Equilibrium).expect("starts");
        stepper.step().expect("first");
        let allocations = count_allocations(|| {
            for _ in 0..50 {
                stepper.step().expect("steps");
            }
        });
        assert_eq!(allocations, 0, "{}", kind.name());
    }
}

/// Energy balance of the run: work of the drives = gain of kinetic, potential and elastic energy +
/// dissipation.
///
/// Truth: the first law; work and dissipation by Simpson's rule from the sampled powers, drives'
/// power `τᵀ q̇`, dampers' `ėᵀ D ė`. Measured 1.0e-11 of the largest change of stored energy for
/// RK4, 1.2e-6 for generalised-alpha and 4.0e-9 for SDIRK at 0.5 ms.
#[test]
fn work_of_the_drives_is_stored_or_dissipated() {
    let reference = reference(ReferenceMethod::Bdf, 1e-10);
    for (kind, h, bound) in [
        (StepperKind::Rk4, 1.25e-4, 1e-9),
        (ALPHA, 5e-4, 1e-5),
        (reference, 2.5e-4, 1e-6),
        (StepperKind::Sdirk3, 5e-4, 1e-7),
    ] {
        let plant = plant();
        let n = plant.model.n_actuated();
        let mut seen = Observation::new(&plant);
        let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).expect("starts");
        let mut powers = Vec::new();
        let mut energies = Vec::new();
        let steps = 2 * (0.6 / h).round() as usize; // the first move, without the kink at its end
        for step in 0..=steps {
            stepper.observe(&mut seen);
            let drive = seen.drive.dot(&seen.qdot.rows(0, n));
            let rates = seen.qdot.rows(n, plant.model.n_elastic()).clone_owned();
            powers.push(drive - rates.dot(&(&plant.D * &rates)));
            energies.push(seen.energy.iter().sum::<f64>());
            if step < steps {
                stepper.step().expect("steps");
            }
        }
        let simpson = |k: usize| h / 3.0 * (powers[k - 2] + 4.0 * powers[k - 1] + powers[k]);
        let (mut supplied, mut worst) = (0.0, 0.0f64);
        for k in (2..=steps).step_by(2) {
            supplied += simpson(k);
            worst = worst.max((energies[k] - energies[0] - supplied).abs());
        }
        let swing = energies.iter().fold(0.0f64, |m, e| m.max((e - energies[0]).abs()));
        eprintln!("{}: energy balance closes to {:.1e} of {swing:.1} J", kind.name(), worst / swing);
        assert!(worst < bound * swing, "{}: {:e}", kind.name(), worst / swing);
    }
}

/// Newton's method converges as fast when the damping of the links differs, and the run agrees with
/// RK4.
///
/// Regression: the corrected iteration matrix is then not symmetric; it was factorised as if it
/// were, and such runs diverged.
#[test]
fn unlike_damping_of_the_links_costs_no_more_iterations() {
    let reference = reference_arm(true);
    let cases = [
        [Damping::StiffnessProportional(0.0), Damping::StiffnessProportional(1e-2)],
        [Damping::StiffnessProportional(5e-2), Damping::StiffnessProportional(1e-4)],
        [Damping::Modal(0.05), Damping::StiffnessProportional(3e-3)],
    ];
    for damping in cases {
        let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
        let springs = (0..2).map(|k| (format!("link {k}"), reference.K_S[k], damping[k])).collect();
        let motion = MotionFn(follow_reference_motion);
        let plant = Plant::new(model, springs, Arc::new(motion)).expect("valid");
        let run = |kind: StepperKind, h: f64| {
            let mut seen = Observation::new(&plant);
            let mut stepper = new_stepper(kind, plant.clone(), h, Start::Undeformed).expect("starts");
            for _ in 0..(0.5 / h).round() as usize {
                stepper.step().expect("steps");
            }
            stepper.observe(&mut seen);
            (seen.q.rows(6, 12).clone_owned(), stepper.counts())
        };
        let (plain, count) = run(plain(0.9), 1e-3);
        let (corrected, counts) = run(ALPHA, 1e-3);
        let (fine, _) = run(ALPHA, 1e-4);
        let error = (&corrected - &fine).amax() / fine.amax();
        let plain_error = (&plain - &fine).amax() / fine.amax();
        eprintln!("{damping:?}: {counts:?} (plain {count:?}), error {error:.1e} (plain {plain_error:.1e})");
        assert!(counts.evaluations < 2 * count.evaluations);
        assert!(counts.factorisations < 4 * count.factorisations + 20);
        // The correction does not account for damping: for overdamped modes it gains nothing, and
        // their error is small anyway.
        assert!(error < plain_error.max(1e-5));
    }
}
