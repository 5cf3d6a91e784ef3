//! What does a query for all solutions cost, by class, compared with the numerical iteration for
//! one?
#![allow(missing_docs, reason = "criterion's macros make public items")]
#![allow(non_snake_case, reason = "monogram notation")]

#[path = "../tests/arms/mod.rs"]
mod arms;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use flexarm_kinematics::*;
use flexarm_testkit::Draw;
use nalgebra::DVector;

fn queries(c: &mut Criterion) {
    let mut group = c.benchmark_group("all solutions");
    let mut arms = arms::known_arms();
    arms.retain(|a| ["KUKA KR 300 R2500", "Puma 560", "UR5"].contains(&a.name.as_str()));
    arms.extend(arms::random_arms(1));
    for arm in arms {
        let analytic = AnalyticArm::new(&arm.model, &arm.tool()).expect("of a class");
        let mut draw = Draw(1);
        let poses: Vec<Pose> = (0..64).map(|_| analytic.pose(&std::array::from_fn(|_| 3.0 * draw.signed()))).collect();
        let mut solutions = Solutions::default();
        let mut i = 0;
        group.bench_function(BenchmarkId::from_parameter(&arm.name), |b| {
            b.iter(|| {
                i = (i + 1) & 63;
                analytic.solve(black_box(&poses[i]), &mut solutions);
                solutions.len()
            })
        });
    }
    group.finish();
    let arm = arms::known_arms().swap_remove(0);
    let (frame, mut data) = (arm.tool(), Data::new(&arm.model));
    let q = DVector::from_vec(vec![0.4, -0.7, 0.9, 0.5, 0.8, 0.1]);
    forward_kinematics(&arm.model, &mut data, &q);
    let (X_WT, start) = (data.X_WF(&frame), q.add_scalar(0.05));
    let options = IkOptions::default();
    c.bench_function("one solution by iteration from 0.05 rad off", |b| {
        b.iter(|| inverse_kinematics(&arm.model, &mut data, &frame, &X_WT, black_box(&start), &options))
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_secs(1)).without_plots();
    targets = queries
}
criterion_main!(benches);
