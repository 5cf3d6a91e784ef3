//! Cost of one step of the moving reference arm with each stepper.
//!
//! The work-precision table (time against error) is printed by
//! `cargo test --release -p flexarm-stepping --test suite reference_arm -- --nocapture`; MuJoCo's step on
//! the same arm takes 4.3 to 6.4 microseconds.
#![allow(missing_docs, reason = "criterion's macros make public items")]
#![allow(non_snake_case, reason = "monogram notation")]

use std::sync::Arc;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use flexarm_kinematics::Model;
use flexarm_stepping::*;
use flexarm_testkit::{reference_arm, reference_motion};

fn plant() -> Plant {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let damping = Damping::StiffnessProportional(reference.beta);
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K, damping)).to_vec();
    let motion = MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        let (x, y, z) = reference_motion(t % 4.0);
        q.copy_from_slice(&x);
        v.copy_from_slice(&y);
        a.copy_from_slice(&z);
    });
    Plant::new(model, springs, Arc::new(motion)).expect("valid")
}

/// Cost per step, averaged over the whole motion of 4 s.
fn steps(c: &mut Criterion) {
    let kinds = [
        (StepperKind::GeneralizedAlpha(AlphaSettings::default()), 1e-3),
        (StepperKind::GeneralizedAlpha(AlphaSettings::default()), 4e-3),
        (StepperKind::Spook(SpookSettings::default()), 1e-3),
        (StepperKind::Rk4, 1e-4),
    ];
    let plant = plant();
    let mut group = c.benchmark_group("thousand_steps");
    group.sample_size(20);
    for (kind, h) in kinds {
        let name = BenchmarkId::new(kind.name(), format!("{h:e}"));
        group.bench_function(name, |b| {
            b.iter_batched(
                || new_stepper(kind, plant.clone(), h, Start::Equilibrium).expect("starts"),
                |mut stepper| {
                    for _ in 0..1000 {
                        stepper.step().expect("steps");
                    }
                    stepper.time()
                },
                BatchSize::LargeInput,
            )
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(500))
        .measurement_time(std::time::Duration::from_secs(2)).without_plots();
    targets = steps
}
criterion_main!(benches);
