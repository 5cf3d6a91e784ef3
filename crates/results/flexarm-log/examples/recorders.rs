//! Cost of a sample in each format: processor time and bytes.
//!
//! ```sh
//! cargo run --release -p flexarm-log --example recorders [SAMPLES [FORMAT ...]]
//! ```
//!
//! The samples have the size of those of `robots/kr210` with six gearboxes and two flexible links,
//! at 1 kHz; their values are synthetic.
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]
#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::time::Instant;

use flexarm_kinematics::Pose;
use flexarm_log::{
    BendInfo, CreateOptions, ElasticSample, EnergySample, LinkInfo, RecordingFormat, RunHeader, RunResult, Sample,
    TwinSample,
};
use nalgebra::{Rotation3, Translation3, Vector3};

const JOINTS: usize = 6;
const STEP_S: f64 = 1e-3;
/// Flexible links, and their length (m).
const BENT: [usize; 2] = [2, 3];
const LENGTH_M: f64 = 1.1;

fn header() -> RunHeader {
    let link = |k: usize| LinkInfo { name: format!("link_{k}"), parent: k.checked_sub(1), fixed: k == 0 || k > JOINTS };
    let joints: Vec<String> = (1..=JOINTS).map(|k| format!("joint_{k}")).collect();
    let bent = BENT.map(|k| format!("link_{k}"));
    let elements: Vec<String> = bent.into_iter().chain(joints.clone()).collect();
    let far = Pose::from(Translation3::new(0.0, 0.0, LENGTH_M));
    let bend = |link| BendInfo { link, X_LS: vec![Pose::identity(), far], carries: vec![(link + 1, 1)] };
    RunHeader {
        robot: "arm".into(),
        trajectory: "waves".into(),
        joints,
        links: (0..JOINTS + 2).map(link).collect(),
        contributors: elements.clone(),
        elements,
        tcp: format!("link_{}", JOINTS + 1),
        has_rigid: true,
        has_static: true,
        log_rate_hz: 1.0 / STEP_S,
        step_s: STEP_S,
        bends: BENT.map(bend).into(),
        magnification: 50.0,
        color_scale_m: 6e-3,
        volume: Some([[-3.0, -3.0, 0.0], [3.0, 3.0, 3.0]]),
        ..RunHeader::default()
    }
}

/// Chain of links with each joint turned by `q` and each flexible link displaced at its end.
fn twin(q: [f64; JOINTS], qdot: [f64; JOINTS], bends: [[f64; 6]; 2]) -> TwinSample {
    let along = |z| Pose::from(Translation3::new(0.0, 0.0, z));
    let mut X_WL = vec![Pose::identity()];
    let mut X_WS = Vec::new();
    for k in 1..=JOINTS {
        let axis = if [1, 4, 6].contains(&k) { Vector3::z() } else { Vector3::y() };
        let turn = Pose::from_parts(Translation3::identity(), Rotation3::new(axis * q[k - 1]));
        let X = X_WL[k - 1] * along(0.3) * turn;
        X_WL.push(X);
        if let Some(bent) = BENT.iter().position(|link| *link == k) {
            let [x, y, z, rx, ry, rz] = bends[bent];
            let bend = Pose::from_parts(Translation3::new(x, y, z), Rotation3::new(Vector3::new(rx, ry, rz)));
            X_WS.extend([X, X * along(LENGTH_M) * bend]);
            X_WL[k] = X;
        }
    }
    let X_WT = X_WL[JOINTS] * along(0.35);
    X_WL.push(X_WT);
    let effort = (0..JOINTS).map(|k| 900.0 * q[k].cos() + 31.0 * qdot[k]).collect();
    TwinSample { q: q.into(), qdot: qdot.into(), effort, X_WL, X_WT, X_WS }
}

fn sample(step: u64) -> Sample {
    let t = step as f64 * STEP_S;
    let wave = |k: usize, hz: f64| (hz * std::f64::consts::TAU * t + k as f64).sin();
    let q: [f64; JOINTS] = std::array::from_fn(|k| 0.8 * wave(k, 0.21 + 0.05 * k as f64));
    let qdot: [f64; JOINTS] = std::array::from_fn(|k| 1.1 * wave(k + 2, 0.21 + 0.05 * k as f64));
    let ringing = |k: usize| 1.0 + 0.2 * wave(k, 7.3 + 1.7 * k as f64);
    let bend: [[f64; 6]; 2] = std::array::from_fn(|link| std::array::from_fn(|c| 3e-4 * ringing(6 * link + c)));
    let gear = |k: usize| {
        let mut element = ElasticSample::default();
        element.deflection[5] = 4e-4 * ringing(k + 20);
        element.load = std::array::from_fn(|c| 700.0 * ringing(k + 30 + c));
        element
    };
    let turned: [f64; JOINTS] = std::array::from_fn(|k| q[k] + gear(k).deflection[5]);
    let (rigid, flexible) = (twin(q, qdot, [[0.0; 6]; 2]), twin(turned, qdot, bend));
    let moved = flexible.X_WT.translation.vector - rigid.X_WT.translation.vector;
    let turn = (flexible.X_WT.rotation * rigid.X_WT.rotation.inverse()).scaled_axis();
    let links = bend.map(|deflection| ElasticSample { deflection, load: deflection.map(|part| 4.1e6 * part) });
    let along = rigid.X_WT.rotation.inverse() * moved;
    Sample {
        time_s: t,
        step,
        error_world: [moved.x, moved.y, moved.z, turn.x, turn.y, turn.z],
        error_path: [along.x, along.y, along.z, turn.z, turn.x, turn.y],
        static_m: [0, 1, 2].map(|c| 0.8 * moved[c]),
        elastic: links.into_iter().chain((0..JOINTS).map(gear)).collect(),
        contributions: (0..8).map(|k| [0, 1, 2].map(|c| moved[c] * (0.1 + 0.01 * k as f64))).collect(),
        gauges: Vec::new(),
        energy: EnergySample { kinetic: 40.0 * ringing(1), potential: 900.0 * ringing(2), elastic: 3.0 * ringing(3) },
        solver: [1.0 + (step % 24 / 23) as f64, 1e-7 * ringing(4)],
        flexible,
        rigid,
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let count: u64 = arguments.next().and_then(|text| text.parse().ok()).unwrap_or(20_000);
    let wanted: Vec<String> = arguments.collect();
    let header = header();
    // Created first, so that this is not measured.
    let samples: Vec<Sample> = (0..count).map(sample).collect();
    println!("format     us a sample   bytes a sample");
    for format in RecordingFormat::ALL {
        let name = format.to_string();
        let path = std::env::temp_dir().join(format!("flexarm-recorders-{}.{name}", std::process::id()));
        let recorder = format.recorder(&path, CreateOptions::default().with_overwrite(true));
        let Some(mut recorder) = recorder.filter(|_| wanted.is_empty() || wanted.contains(&name)) else { continue };
        let started = Instant::now();
        let mut write = || {
            recorder.begin(&header)?;
            samples.iter().try_for_each(|sample| recorder.record(sample))?;
            recorder.finish(&RunResult::default())
        };
        write().expect("the temporary folder takes the recording");
        let time = started.elapsed().as_secs_f64() * 1e6 / count as f64;
        let size = path.metadata().map_or(0, |file| file.len()) as f64 / count as f64;
        println!("{name:10} {time:11.2}   {size:14.0}");
        let _ = std::fs::remove_file(&path);
    }
}
