//! A synthetic robot with three links and a motion of two seconds: input for recorders, not
//! physics.
//!
//! The upper arm deflects like a damped oscillator driven by the motion's acceleration, so that the
//! files look like real ones: an error during acceleration and deceleration, and ringing
//! afterwards.
#![allow(non_snake_case, reason = "monogram notation: X_WL, pose of L in W")]
#![allow(dead_code, reason = "every test and the example use their own part")]

use std::f64::consts::TAU;
use std::path::PathBuf;

use flexarm_kinematics::Pose;
use flexarm_log::{
    Attachment, BendInfo, ElasticSample, EnergySample, Event, EventKind, LinkInfo, LinkMesh, RunHeader, RunResult,
    Sample, TwinSample,
};
use nalgebra::{Rotation3, Translation3, Vector3};

/// Sampling rate (Hz).
pub(crate) const RATE_HZ: f64 = 500.0;
/// Step size of the fictitious stepper (s).
pub(crate) const STEP_S: f64 = 1e-4;
/// Number of samples of the whole run: two seconds, including both ends.
pub(crate) const SAMPLES: u64 = 1001;

const BASE_HEIGHT: f64 = 0.4;
const UPPER_ARM: f64 = 0.8;
const FOREARM: f64 = 0.6;

/// Header of the run, with meshes and metadata.
pub(crate) fn header() -> RunHeader {
    let link = |name: &str, parent, fixed| LinkInfo { name: name.into(), parent, fixed };
    let links = vec![
        link("base_link", None, true),
        link("column", Some(0), false),
        link("upper_arm", Some(1), false),
        link("forearm", Some(2), false),
        link("tool0", Some(3), true),
    ];
    let grey = [0.35, 0.36, 0.38, 1.0];
    let orange = [0.93, 0.46, 0.10, 1.0];
    let meshes = vec![
        box_mesh(0, [0.0, 0.0, 0.04], [0.5, 0.5, 0.08], grey),
        box_mesh(1, [0.0, 0.0, 0.20], [0.22, 0.22, 0.36], orange),
        box_mesh(2, [UPPER_ARM / 2.0, 0.0, 0.0], [UPPER_ARM, 0.14, 0.16], orange),
        box_mesh(3, [FOREARM / 2.0, 0.0, 0.0], [FOREARM, 0.10, 0.11], orange),
        box_mesh(4, [0.02, 0.0, 0.0], [0.04, 0.07, 0.07], grey),
    ];
    RunHeader {
        robot: "synthetic".into(),
        trajectory: "swing".into(),
        urdf: urdf(),
        joints: ["joint_1", "joint_2", "joint_3"].map(str::to_owned).into(),
        prismatic: Vec::new(),
        links,
        elements: vec!["upper_arm".into()],
        meshes,
        tcp: "tool0".into(),
        scenery: Vec::new(),
        metadata: vec![("flexarm.run".into(), vec![("stepper".into(), "none".into()), ("seed".into(), "0".into())])],
        attachments: vec![Attachment {
            name: "notes.json".into(),
            media_type: "application/json".into(),
            bytes: b"{\"robot\": \"synthetic\"}".into(),
        }],
        description: "# synthetic, swing\n\nThree links, the upper arm bends. *Made-up numbers.*".into(),
        has_rigid: true,
        has_static: true,
        has_stress: false,
        log_rate_hz: RATE_HZ,
        step_s: STEP_S,
        start_ns: None,
        bends: vec![BendInfo {
            link: 2,
            X_LS: vec![Pose::identity(), Pose::from(Translation3::new(UPPER_ARM, 0.0, 0.0))],
            carries: vec![(3, 1)],
        }],
        contributors: vec!["upper_arm".into()],
        gauges: ["top_strain", "eye_von_mises_pa", "eye_principal_1_pa", "eye_principal_3_pa"]
            .map(str::to_owned)
            .into(),
        captions: Vec::new(),
        magnification: 50.0,
        color_scale_m: 2.5e-3,
        volume: Some([[-1.4, -1.4, 0.0], [1.4, 1.4, 1.6]]),
    }
}

/// Result of the run for `finish`.
pub(crate) fn result() -> RunResult {
    let event = |time_s, kind, text: &str| Event { time_s, kind, text: text.into() };
    RunResult {
        figures: vec![("tcp.peak_m".into(), "0.00211".into()), ("tcp.end_m".into(), "0.00130".into())],
        readable: vec![("peak TCP error".into(), "2.110 mm".into())],
        events: vec![
            event(0.0, EventKind::MoveStart, "move 1 begins"),
            event(1.2, EventKind::MoveEnd, "move 1 ends"),
            event(1.25, EventKind::Peak, "largest TCP error: 2.110 mm"),
        ],
        attachments: vec![Attachment {
            name: "summary.json".into(),
            media_type: "application/json".into(),
            bytes: b"{\"end\": \"complete\"}".into(),
        }],
        scenery: Vec::new(),
    }
}

/// One sample of the motion.
pub(crate) fn sample(step: u64) -> Sample {
    let time_s = (20 * step) as f64 * STEP_S;
    let (s, v, a) = swing(time_s);
    let q = [1.2 * s - 0.6, -0.9 + 0.7 * s, 1.2 - 0.5 * s];
    let qdot = [1.2 * v, 0.7 * v, -0.5 * v];

    // Bending about y from gravity and motion, about z from the turning column; ringing after the
    // stop.
    let since_stop = (time_s - 1.2).max(0.0);
    let ringing = if time_s > 1.2 { (-4.0 * since_stop).exp() * (TAU * 9.0 * since_stop).sin() } else { 0.0 };
    let about_y = 1.5e-3 + 2.0e-4 * a + 8.0e-4 * ringing;
    let about_z = -3.0e-4 * a - 1.5e-3 * ringing;
    let deflection = [0.0, 0.3 * about_z, -0.3 * about_y, 2.0e-4 * ringing, about_y, about_z];

    let rigid = twin(q, qdot, [0.0; 6]);
    let flexible = twin(q, qdot, deflection);
    let difference = flexible.X_WT.translation.vector - rigid.X_WT.translation.vector;
    let turn = (flexible.X_WT.rotation * rigid.X_WT.rotation.inverse()).scaled_axis();
    let error = |d: Vector3<f64>| [d.x, d.y, d.z, turn.x, turn.y, turn.z];
    Sample {
        time_s,
        step: 20 * step,
        error_world: error(difference),
        error_path: error(rigid.X_WT.rotation.inverse() * difference),
        static_m: [2.0e-4 * s, -1.0e-4, -1.1e-3],
        elastic: vec![ElasticSample { deflection, load: deflection.map(|part| 4.0e5 * part) }],
        contributions: vec![difference.into()],
        gauges: vec![0.2 * about_y, 3e10 * about_y, 3.1e10 * about_y, -1e9 * about_y],
        energy: EnergySample { kinetic: 40.0 * v * v, potential: 120.0 + 30.0 * s, elastic: 1e5 * about_y.powi(2) },
        solver: [2.0, 1e-11 * (1.0 + v)],
        flexible,
        rigid,
    }
}

/// The samples among the first `count` whose poses are written: every 6 ms at 500 samples per
/// second, those with a larger error than all before, and the last.
pub(crate) fn samples_with_poses(count: u64) -> Vec<u64> {
    let error = |step: u64| sample(step).error_world[..3].iter().map(|part| part * part).sum::<f64>().sqrt();
    let mut largest = -1.0;
    let mut has_poses = |step: u64| {
        let error = error(step);
        let is_peak = error > largest;
        largest = error.max(largest);
        is_peak || step.is_multiple_of(3) || step + 1 == count
    };
    (0..count).filter(|step| has_poses(*step)).collect()
}

/// Returns a path for a test's file, with nothing there.
pub(crate) fn scratch(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("flexarm-log-{}-{name}", std::process::id()));
    std::fs::remove_file(&path).ok();
    path
}

/// Quintic from 0 to 1 within 1.2 s, with velocity and acceleration.
fn swing(time_s: f64) -> (f64, f64, f64) {
    const DURATION: f64 = 1.2;
    let x = (time_s / DURATION).min(1.0);
    let s = x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
    let v = 30.0 * x * x * (1.0 - x).powi(2) / DURATION;
    let a = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / DURATION.powi(2);
    (s, v, a)
}

/// Forward kinematics with the upper arm's distal end displaced by `deflection`.
fn twin(q: [f64; 3], qdot: [f64; 3], deflection: [f64; 6]) -> TwinSample {
    let [x, y, z, rx, ry, rz] = deflection;
    let move_by = |x, y, z| Pose::from_parts(Translation3::new(x, y, z), Rotation3::identity());
    let turn = |axis: Vector3<f64>| Pose::from_parts(Translation3::identity(), Rotation3::new(axis));

    let X_WB = Pose::identity();
    let X_WC = X_WB * turn(Vector3::z() * q[0]);
    let X_WU = X_WC * move_by(0.0, 0.0, BASE_HEIGHT) * turn(Vector3::y() * q[1]);
    let bend = move_by(x, y, z) * turn(Vector3::new(rx, ry, rz));
    let X_WF = X_WU * move_by(UPPER_ARM, 0.0, 0.0) * bend * turn(Vector3::y() * q[2]);
    let X_WS = vec![X_WU, X_WU * move_by(UPPER_ARM, 0.0, 0.0) * bend];
    let X_WT = X_WF * move_by(FOREARM, 0.0, 0.0);
    let effort = vec![8.0 * qdot[0], 90.0 * q[1].cos(), 25.0 * (q[1] + q[2]).cos()];
    TwinSample { q: q.into(), qdot: qdot.into(), effort, X_WL: vec![X_WB, X_WC, X_WU, X_WF, X_WT], X_WT, X_WS }
}

fn box_mesh(link: usize, center: [f64; 3], size: [f64; 3], color: [f32; 4]) -> LinkMesh {
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let first = positions.len() as u32;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut corner = [0.0_f32; 3];
                corner[axis] = (center[axis] + sign * size[axis] / 2.0) as f32;
                corner[u] = (center[u] + sign * a * size[u] / 2.0) as f32;
                corner[v] = (center[v] + b * size[v] / 2.0) as f32;
                positions.push(corner);
                let mut normal = [0.0; 3];
                normal[axis] = sign as f32;
                normals.push(normal);
            }
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    LinkMesh { link, name: "box".into(), positions, normals, triangles, color, file: None }
}

fn urdf() -> String {
    let link = |name: &str, [x, y, z]: [f64; 3], [a, b, c]: [f64; 3]| {
        format!(
            r#"  <link name="{name}"><visual><origin xyz="{x} {y} {z}"/><geometry><box size="{a} {b} {c}"/></geometry></visual></link>"#
        )
    };
    let joint = |name: &str, kind: &str, parent: &str, child: &str, xyz: String, axis: &str| {
        format!(
            r#"  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>"#
        )
    };
    [
        r#"<robot name="synthetic">"#.to_owned(),
        link("base_link", [0.0, 0.0, 0.04], [0.5, 0.5, 0.08]),
        link("column", [0.0, 0.0, 0.20], [0.22, 0.22, 0.36]),
        link("upper_arm", [UPPER_ARM / 2.0, 0.0, 0.0], [UPPER_ARM, 0.14, 0.16]),
        link("forearm", [FOREARM / 2.0, 0.0, 0.0], [FOREARM, 0.10, 0.11]),
        link("tool0", [0.02, 0.0, 0.0], [0.04, 0.07, 0.07]),
        joint("joint_1", "continuous", "base_link", "column", "0 0 0".into(), "0 0 1"),
        joint("joint_2", "continuous", "column", "upper_arm", format!("0 0 {BASE_HEIGHT}"), "0 1 0"),
        joint("joint_3", "continuous", "upper_arm", "forearm", format!("{UPPER_ARM} 0 0"), "0 1 0"),
        joint("flange", "fixed", "forearm", "tool0", format!("{FOREARM} 0 0"), "1 0 0"),
        "</robot>\n".to_owned(),
    ]
    .join("\n")
}
