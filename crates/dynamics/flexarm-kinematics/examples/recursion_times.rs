//! Time per call of the recursions, in ns, for comparison with Pinocchio in
//! `tools/pinocchio_bench.sh`: `cargo run --release --example recursion_times`
//!
//! 64 random states, 101 batches of 1000 calls; CSV columns
//! build,model,function,minimum_ns,median_ns.
#![allow(clippy::print_stdout, clippy::unwrap_used, non_snake_case, reason = "an example; monogram notation")]

use std::hint::black_box;
use std::time::Instant;

use flexarm_kinematics::*;
use flexarm_testkit::{Draw, arm_of_parts, reference_arm};
use nalgebra::DVector;

const STATES: usize = 64;
const BATCHES: usize = 101;
const CALLS: usize = 1000;

fn time_calls(model: &str, function: &str, mut call: impl FnMut(usize)) {
    let mut ns: Vec<f64> = (0..BATCHES)
        .map(|_| {
            let begin = Instant::now();
            (0..CALLS).for_each(|i| call(i % STATES));
            1e9 * begin.elapsed().as_secs_f64() / CALLS as f64
        })
        .collect();
    ns.sort_by(f64::total_cmp);
    println!("flexarm,{model},{function},{:.0},{:.0}", ns[0], ns[BATCHES / 2]);
}

fn main() {
    let arms =
        [("rigid6", reference_arm(false).mechanism), ("flexible18", arm_of_parts(1)), ("flexible42", arm_of_parts(3))];
    for (name, mut tree) in arms {
        for joint in &mut tree.joints {
            if let JointKind::Elastic(angles) = &mut joint.kind {
                *angles = ElasticAngles::RotationVector;
            }
        }
        let model = Model::new(&tree).unwrap();
        let mut draw = Draw(1);
        let mut random = || DVector::from_fn(model.nv(), |_, _| 0.5 * draw.signed());
        let states: Vec<State> = (0..STATES).map(|_| State { q: random(), qdot: random() }).collect();
        let a: Vec<_> = (0..STATES).map(|_| random()).collect();
        let mut data = Data::new(&model);
        time_calls(name, "forward_kinematics", |i| forward_kinematics(&model, &mut data, black_box(&states[i].q)));
        time_calls(name, "rnea", |i| {
            black_box(inverse_dynamics(&model, &mut data, black_box(&states[i]), &a[i]));
        });
        time_calls(name, "crba", |i| {
            black_box(mass_matrix(&model, &mut data, black_box(&states[i].q)));
        });
        let free = Roles::all_free(&model);
        time_calls(name, "aba", |i| {
            black_box(forward_dynamics(&model, &mut data, black_box(&states[i]), &free, &a[i]));
        });
        if model.nv() == model.n_actuated() {
            continue;
        }
        let prescribed = Roles::actuated_prescribed(&model);
        let (mut qddot, mut f) = (a[0].clone(), a[1].clone());
        time_calls(name, "hybrid", |i| {
            hybrid_dynamics(&model, &mut data, black_box(&states[i]), &prescribed, &mut qddot, &mut f);
            // Keeps the reused inputs bounded.
            qddot[6] *= 1e-9;
            f.fill(0.1);
        });
    }
}
