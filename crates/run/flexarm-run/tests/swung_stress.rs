//! Stress of a beam of solid elements that is swung, against a dynamic finite element run.
//!
//! Truth: CalculiX 2.20 with large rotations, `tools/crosscheck/swing_stress_calculix.py`. Both take
//! the same mesh and ties; neither has damping or gravity.

use std::path::{Path, PathBuf};

use flexarm_run::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
use flexarm_run::{LinkModel, Modelling, Motion, Robot, RunOptions, Scenario};

#[derive(serde::Deserialize)]
struct Truth {
    angle_rad: f64,
    turn_s: f64,
    positions_m: Vec<[f64; 3]>,
    nodes: Vec<u64>,
    t_s: Vec<f64>,
    von_mises_pa: Vec<Vec<f64>>,
}

const URDF: &str = r#"<robot name="swing">
  <link name="base"/>
  <joint name="joint_1" type="continuous">
    <parent link="base"/><child link="beam_3"/><axis xyz="0 0 1"/>
  </joint>
  <link name="beam_3">
    <inertial>
      <origin xyz="0.2 0 0"/><mass value="0.648"/>
      <inertia ixx="7.02e-05" ixy="0" ixz="0" iyy="0.0086616" iyz="0" izz="0.0086886"/>
    </inertial>
  </link>
  <joint name="end" type="fixed"><parent link="beam_3"/><child link="tip"/><origin xyz="0.4 0 0"/></joint>
  <link name="tip">
    <inertial>
      <mass value="1"/><inertia ixx="0.00036" ixy="0" ixz="0" iyy="0.00036" iyz="0" izz="0.00036"/>
    </inertial>
  </link>
</robot>"#;

/// Reduces the mesh of the shipped beam with its stress, into a folder with a robot that swings it.
fn robot(truth: &Truth, shipped: &Path, folder: &Path) -> Robot {
    let job = ReduceJob::load(&shipped.join("robots/test/three_beams/fe/beam_3.reduce.toml")).unwrap();
    let outputs = ReduceOutputs { flex: Some(folder.join("beam_3.flex")), ..ReduceOutputs::default() };
    let job = ReduceJob { stress: Some(true), ..job };
    reduce(&job, &ReduceOptions::default(), Some(&outputs), &mut |_| {}).unwrap();
    std::fs::write(folder.join("swing.urdf"), URDF).unwrap();
    let points = truth.positions_m.iter().zip(&truth.nodes).map(|([x, y, z], node)| {
        format!("[[stress_point]]\nname = \"node_{node}\"\nlink = \"beam_3\"\nat = [{x}, {y}, {z}]\n")
    });
    let text = format!(
        "format = 1\nname = \"swing\"\nurdf = \"swing.urdf\"\ntcp = {{ link = \"tip\" }}\ngravity = [0.0, 0.0, 0.0]\n\
         [[flexible_link]]\nlink = \"beam_3\"\nreduced = \"beam_3.flex\"\ndamping = {{ modal = 0.0 }}\n{}",
        points.collect::<String>()
    );
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    Robot::load(folder).unwrap()
}

#[test]
fn a_swung_beam_has_the_stress_of_a_dynamic_finite_element_run() {
    let top: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().into();
    let truth = std::fs::read_to_string(top.join("tests/verification/swing_stress_calculix.json")).unwrap();
    let truth: Truth = serde_json::from_str(&truth).unwrap();
    let folder = std::env::temp_dir().join(format!("flexarm swung stress {}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let robot = robot(&truth, &top, &folder);
    let times: Vec<f64> = (0..=5000).map(|k| 2e-5 * f64::from(k)).collect();
    let turned = std::f64::consts::TAU;
    let angle = |t: &f64| {
        let s = (t / truth.turn_s).min(1.0);
        truth.angle_rad * (s - (turned * s).sin() / turned)
    };
    let angles: Vec<f64> = times.iter().map(angle).collect();
    let motion = Motion::from_samples(&times, &angles, &robot).unwrap();
    let peak = truth.von_mises_pa.iter().flatten().fold(0.0_f64, |most, stress| most.max(*stress));

    let lumped = |segments| Modelling { links: LinkModel::Lumped, segments: Some(segments), ..Modelling::default() };
    let modal = Modelling { links: LinkModel::Modal, modes: Some(10), ..Modelling::default() };
    // Measured 3.3e-2, 3.8e-3 and 9.1e-4.
    let models = [("two parts", lumped(2), 0.04), ("five parts", lumped(5), 5e-3), ("ten modes", modal, 1.5e-3)];
    for (name, modelling, bound) in models {
        let options = RunOptions { step_s: 1e-4, log_rate_hz: 1e4, ..RunOptions::default() };
        let run = robot.model(&modelling).unwrap().simulate(Scenario::new(motion.clone()), &options).unwrap();
        let gauge = run.columns.column("gauge").unwrap();
        let width = run.columns.gauges.len();
        let mut off = 0.0_f64;
        for (t, stress) in truth.t_s.iter().zip(&truth.von_mises_pa) {
            let row = run.time_s().iter().position(|own| (own - t).abs() < 1e-9).unwrap();
            for (k, truth) in stress.iter().enumerate() {
                // Signed von Mises, largest and smallest principal stress of each point.
                off = off.max((gauge.values[width * row + 3 * k].abs() - truth).abs());
            }
        }
        println!("{name}: {:.2e} of the peak of {:.2} MPa", off / peak, 1e-6 * peak);
        assert!(off < bound * peak, "{name}: {:e}", off / peak);
    }
    let _ = std::fs::remove_dir_all(&folder);
}
