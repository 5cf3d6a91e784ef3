//! What does one call of each recursion cost on the reference arm: rigid (6 coordinates), flexible
//! (18) and with three elastic joints per link (42)?
//!
//! `tools/pinocchio_bench.sh` runs Pinocchio's C++ and the example `recursion_times` alternately on
//! the same models.
#![allow(missing_docs, reason = "criterion's macros make public items")]
#![allow(non_snake_case, reason = "monogram notation")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use flexarm_kinematics::*;
use flexarm_testkit::{Draw, arm_of_parts, reference_arm};
use nalgebra::DVector;

struct Case {
    model: Model,
    data: Data,
    states: Vec<State>,
    qddot: Vec<DVector<f64>>,
}

/// 64 random states, as in the comparison benchmark.
fn case(mut tree: Mechanism) -> Case {
    for joint in &mut tree.joints {
        if let JointKind::Elastic(angles) = &mut joint.kind {
            *angles = ElasticAngles::RotationVector;
        }
    }
    let model = Model::new(&tree).expect("valid");
    let mut draw = Draw(1);
    let mut random = |n: usize| DVector::from_fn(n, |_, _| 0.5 * draw.signed());
    let n = model.nv();
    let states = (0..64).map(|_| State { q: random(n), qdot: random(n) }).collect();
    let qddot = (0..64).map(|_| random(n)).collect();
    Case { data: Data::new(&model), model, states, qddot }
}

fn recursions(c: &mut Criterion) {
    for tree in [reference_arm(false).mechanism, arm_of_parts(1), arm_of_parts(3)] {
        let Case { model, mut data, states, qddot } = case(tree);
        let n = model.nv();
        let mut i = 0;
        let mut next = move || {
            i = (i + 1) & 63;
            i
        };
        let mut group = c.benchmark_group("recursion");
        group.bench_function(BenchmarkId::new("forward_kinematics", n), |b| {
            b.iter(|| forward_kinematics(&model, &mut data, black_box(&states[next()].q)))
        });
        group.bench_function(BenchmarkId::new("rnea", n), |b| {
            b.iter(|| {
                let i = next();
                inverse_dynamics(&model, &mut data, black_box(&states[i]), &qddot[i])[0]
            })
        });
        group.bench_function(BenchmarkId::new("crba", n), |b| {
            b.iter(|| mass_matrix(&model, &mut data, black_box(&states[next()].q))[0])
        });
        let roles = Roles::all_free(&model);
        group.bench_function(BenchmarkId::new("aba", n), |b| {
            b.iter(|| {
                let i = next();
                forward_dynamics(&model, &mut data, black_box(&states[i]), &roles, &qddot[i])[0]
            })
        });
        if n > 6 {
            let roles = Roles::actuated_prescribed(&model);
            let (mut a, mut f) = (qddot[0].clone(), qddot[1].clone());
            group.bench_function(BenchmarkId::new("hybrid", n), |b| {
                b.iter(|| {
                    let i = next();
                    hybrid_dynamics(&model, &mut data, black_box(&states[i]), &roles, &mut a, &mut f);
                    a[6] *= 1e-9; // keeps the reused inputs bounded
                    f.fill(0.1);
                })
            });
        }
        group.finish();
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(500))
        .measurement_time(std::time::Duration::from_secs(2)).without_plots();
    targets = recursions
}
criterion_main!(benches);
