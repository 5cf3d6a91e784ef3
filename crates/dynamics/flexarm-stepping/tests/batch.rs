//! Runs of one tree in parallel lanes against the same runs computed individually.

use std::sync::Arc;

use flexarm_kinematics::{Model, SpatialInertia, Wrench};
use flexarm_stepping::*;
use flexarm_testkit::{reference_arm, reference_motion};
use nalgebra::{Matrix3, Vector3};

/// Parameters that differ from run to run.
#[derive(Clone, Copy)]
struct Variation {
    speed: f64,
    stiffness: f64,
    damping: Damping,
    payload: f64,
    duration_s: f64,
}

const PLAIN: Variation = Variation {
    speed: 1.0,
    stiffness: 1.0,
    damping: Damping::StiffnessProportional(2e-4),
    payload: 0.0,
    duration_s: 1.0,
};

fn run(of: Variation) -> BatchRun {
    let reference = reference_arm(true);
    let model = Model::new(&reference.mechanism).unwrap();
    let body = model.frame("tcp").unwrap().body;
    let mut inertia = model.bodies()[body].inertia;
    inertia += SpatialInertia::from_com(of.payload, &Vector3::new(0.05, -0.02, 0.1), &Matrix3::zeros());
    let model = Arc::new(model.with_inertia(body, inertia));
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K * of.stiffness, of.damping)).to_vec();
    let motion = MotionFn(move |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        let (x, y, z) = reference_motion(of.speed * t);
        for k in 0..q.len() {
            (q[k], v[k], a[k]) = (x[k], of.speed * y[k], of.speed * of.speed * z[k]);
        }
    });
    let arm = FlexibleArm::new(model, springs, Arc::new(motion)).unwrap();
    BatchRun { arm, duration_s: of.duration_s }
}

fn batch(step_s: f64, runs: &[BatchRun]) -> Batch {
    Batch {
        step_s,
        stepper: StepperKind::default(),
        start: Start::Equilibrium,
        tool: runs[0].arm.model.frame("tcp").unwrap().clone(),
        keep_samples: true,
    }
}

fn bits(result: &ToolDeflection) -> Vec<u64> {
    let figures = [result.peak_m, result.t_peak_s, result.rms_m];
    figures.iter().chain(result.samples_m.as_flattened()).map(|x| x.to_bits()).collect()
}

fn assert_equal_alone(batch: &Batch, runs: &[BatchRun]) {
    let together = batch.run(runs);
    assert_eq!(together.len(), runs.len());
    for (k, (result, run)) in together.into_iter().zip(runs).enumerate() {
        let (result, alone) = (result.unwrap(), batch.run_alone(run).unwrap());
        assert_eq!(result.steps, alone.steps, "{k}");
        assert_eq!(result.samples_m.len() as u64, alone.steps + 1, "{k}");
        assert!(alone.peak_m > 1e-5, "{k}: an arm that does not move shows nothing");
        let first = result.samples_m.iter().zip(&alone.samples_m).position(|(a, b)| a != b);
        assert_eq!(bits(&result), bits(&alone), "run {k} parts at sample {first:?}");
    }
}

fn varied() -> Vec<BatchRun> {
    let variations = [
        PLAIN,
        Variation { speed: 1.7, payload: 5.0, duration_s: 0.6, ..PLAIN },
        Variation { stiffness: 0.3, payload: 12.0, ..PLAIN },
        Variation { speed: 2.5, damping: Damping::StiffnessProportional(2e-3), duration_s: 0.4, ..PLAIN },
        Variation { stiffness: 4.0, speed: 0.5, ..PLAIN },
        Variation { speed: 3.0, stiffness: 0.1, payload: 1.0, duration_s: 0.333, ..PLAIN },
    ];
    variations.map(run).to_vec()
}

/// Truth: the individual run. Payload, speed, stiffness, damping and duration differ, and the last
/// group is not full; at 20 ms all runs iterate to convergence, at 2 ms most steps take one
/// evaluation.
#[test]
fn a_run_side_by_side_with_others_has_the_bits_of_the_run_alone() {
    let runs = varied();
    for step_s in [2e-2, 5e-3, 2e-3] {
        assert_equal_alone(&batch(step_s, &runs), &runs);
    }
}

#[test]
fn damping_ratios_and_other_settings_have_the_bits_of_the_run_alone() {
    let modal =
        |zeta: f64, speed: f64| run(Variation { damping: Damping::Modal(zeta), speed, duration_s: 0.3, ..PLAIN });
    let runs = [modal(0.02, 1.0), modal(0.05, 2.0), modal(1e-5, 1.0), modal(0.01, 0.7)];
    for (rho, dispersion_correction) in [(0.9, true), (0.5, true), (0.0, false), (1.0, false)] {
        let settings = AlphaSettings { rho, dispersion_correction };
        for start in [Start::Equilibrium, Start::Undeformed] {
            let stepper = StepperKind::GeneralizedAlpha(settings);
            assert_equal_alone(&Batch { stepper, start, ..batch(2e-3, &runs) }, &runs);
        }
    }
}

/// A group with loads in one run, and one with different trees, is computed run by run.
#[test]
fn what_lanes_do_not_know_is_run_alone() {
    let mut runs = varied();
    let body = runs[1].arm.model.bodies().len() - 1;
    let load = vec![(body, Wrench::new(Vector3::new(30.0, 0.0, -20.0), Vector3::zeros()))];
    runs[1].arm = runs[1].arm.clone().with_loads(load).unwrap();
    let plain = batch(5e-3, &runs).run(&varied());
    let loaded = batch(5e-3, &runs).run(&runs);
    assert_eq!(plain[0], loaded[0]);
    assert_ne!(plain[1], loaded[1], "the load counts");
    assert_equal_alone(&batch(5e-3, &runs), &runs);
}

/// A fast change of velocity within a step subdivides the step of its own run only.
#[test]
fn a_step_that_is_cut_in_one_run_is_no_step_of_the_others() {
    let mut runs = varied();
    let blow = MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        // 1 rad/s within half a millisecond at 0.1 s.
        let s = ((t - 0.1) / 5e-4).clamp(0.0, 1.0);
        q.fill(0.0);
        v.fill(0.0);
        a.fill(0.0);
        q[0] = 5e-4 * 0.5 * s * s + (t - 0.1005).max(0.0);
        v[0] = s;
        a[0] = if s > 0.0 && s < 1.0 { 1.0 / 5e-4 } else { 0.0 };
    });
    runs[2].arm.motion = Arc::new(blow);
    assert_equal_alone(&batch(2e-3, &runs), &runs);
}

/// The square of a rounded root may be less than the number.
#[test]
fn a_peak_that_lasts_is_told_with_its_first_time() {
    for k in 1..200 {
        let deflection = Vector3::new(1e-3 * f64::from(k), 0.3e-3, -0.7e-3);
        let mut result = ToolDeflection::default();
        (0..3).for_each(|step| result.include(f64::from(step), deflection, false));
        assert_eq!(result.t_peak_s, 0.0, "{k}");
    }
}
