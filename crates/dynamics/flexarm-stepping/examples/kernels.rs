//! Repeats one kernel, to count its instructions: `tools/instruction_counts.py`.
//!
//! ```text
//! cargo run --release --example kernels KERNEL TIMES
//! cargo run --release --example kernels               # lists the names
//! ```
#![allow(non_snake_case, reason = "monogram notation")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::hint::black_box;
use std::sync::Arc;

use flexarm_kinematics::*;
use flexarm_stepping::*;
use flexarm_testkit::{chain_arm, follow_reference_motion, reference_arm};
use nalgebra::DVector;

/// A kernel; its argument is the number of repetitions.
type Kernel = fn(usize);

const KERNELS: [(&str, Kernel); 11] = [
    ("inverse_dynamics", |times| {
        recursion(times, |c| {
            inverse_dynamics(&c.model, &mut c.data, &c.state, &c.a);
        });
    }),
    ("mass_matrix", |times| {
        recursion(times, |c| {
            mass_matrix(&c.model, &mut c.data, &c.state.q);
        });
    }),
    ("forward_dynamics", |times| {
        recursion(times, |c| {
            forward_dynamics(&c.model, &mut c.data, &c.state, &c.free, &c.f);
        });
    }),
    ("hybrid_dynamics", |times| {
        recursion(times, |c| {
            hybrid_dynamics(&c.model, &mut c.data, &c.state, &c.prescribed, &mut c.a, &mut c.f);
            c.a.rows_mut(6, 12).fill(0.0);
            c.f.fill(0.1);
        });
    }),
    ("pose", |times| {
        let (mut at, poses) = poses(times);
        for q in poses.chunks_exact(6) {
            at.solve(q, &Wrench::zeros()).unwrap();
            black_box((at.compliance(), at.frequencies_hz()));
        }
    }),
    ("pose_among_many", |times| {
        let (mut at, poses) = poses(times);
        let asked = PoseOutputs { compliance: true, frequencies: true, jacobian: false };
        at.solve_each(&poses, &Wrench::zeros(), asked, |_, answer| {
            black_box(answer.unwrap());
        });
    }),
    ("step_generalized_alpha", |times| {
        steps(times, beams(), StepperKind::GeneralizedAlpha(AlphaSettings::default()), 1e-3)
    }),
    ("step_sdirk3", |times| steps(times, beams(), StepperKind::Sdirk3, 1e-3)),
    ("step_spook", |times| steps(times, beams(), StepperKind::Spook(SpookSettings::default()), 1e-4)),
    ("step_rk4", |times| steps(times, beams(), StepperKind::Rk4, 1e-4)),
    ("step_along_a_tree", |times| {
        steps(times, chains(), StepperKind::GeneralizedAlpha(AlphaSettings::default()), 1e-3);
    }),
];

/// The reference arm at one state of motion.
struct Case {
    model: Model,
    data: Data,
    state: State,
    a: DVector<f64>,
    f: DVector<f64>,
    free: Roles,
    prescribed: Roles,
}

fn recursion(times: usize, mut call: impl FnMut(&mut Case)) {
    let model = Model::new(&reference_arm(true).mechanism).unwrap();
    let wave = |phase: f64| DVector::from_fn(model.nv(), |k, _| 0.3 * (k as f64 + phase).sin());
    let state = State { q: wave(0.0), qdot: wave(1.0) };
    let (free, prescribed) = (Roles::all_free(&model), Roles::actuated_prescribed(&model));
    let (a, f) = (wave(2.0), wave(3.0));
    let mut case = Case { data: Data::new(&model), state, a, f, free, prescribed, model };
    for _ in 0..times {
        call(black_box(&mut case));
    }
}

fn steps(times: usize, plant: Plant, kind: StepperKind, h: f64) {
    let mut stepper = new_stepper(kind, plant, h, Start::Equilibrium).unwrap();
    for _ in 0..times {
        stepper.step().unwrap();
    }
    black_box(stepper.time());
}

/// Returns the reference arm and `times` poses.
fn poses(times: usize) -> (OperatingPoint, Vec<f64>) {
    let plant = beams();
    let tool = plant.model.frame("tcp").unwrap().clone();
    let poses = (0..6 * times).map(|k| 2.0 * (k as f64 * 0.618_034).fract() - 1.0).collect();
    (OperatingPoint::new(plant, tool), poses)
}

/// Returns the reference arm on its motion.
fn beams() -> Plant {
    let reference = reference_arm(true);
    let damping = Damping::StiffnessProportional(reference.beta);
    let springs = reference.K_S.map(|K| ("spring".to_owned(), K, damping)).to_vec();
    let motion = MotionFn(follow_reference_motion);
    Plant::new(Arc::new(Model::new(&reference.mechanism).unwrap()), springs, Arc::new(motion)).unwrap()
}

/// Returns an arm with two links of four elastic joints each.
fn chains() -> Plant {
    let chains = chain_arm(4, 0, ElasticAngles::EulerZyx);
    let damping = Damping::StiffnessProportional(1e-3);
    let springs: Vec<_> = chains.K.iter().map(|K| ("spring".to_owned(), *K, damping)).collect();
    let motion = MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        for (k, q) in q.iter_mut().enumerate() {
            let (size, w) = (0.2 + 0.3 * k as f64, 3.0 + k as f64);
            let (s, c) = (w * t).sin_cos();
            (*q, v[k], a[k]) = (size * (w * t - s), size * w * (1.0 - c), size * w * w * s);
        }
    });
    Plant::new(Arc::new(Model::new(&chains.mechanism).unwrap()), springs, Arc::new(motion)).unwrap()
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, times] = words.as_slice() else {
        KERNELS.iter().for_each(|(name, _)| println!("{name}"));
        return;
    };
    let (_, kernel) = KERNELS.iter().find(|(known, _)| known == name).unwrap();
    kernel(times.parse().unwrap());
}
