//! Information on the robot and the time in recordings, on this machine and on others.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flexarm_log::{RecordingFormat, RunHeader, START_NS, open_recording};
use flexarm_run::{Error, Keep, Modelling, Motion, Outputs, Robot, RunOptions, RunRequest};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The shipped arm, stopped as early as possible: its files exist by then.
fn recorded(name: &str, options: &RunOptions) -> (Folder, RunHeader) {
    let folder = Folder(std::env::temp_dir().join(format!("flexarm-recording-{}-{name}", std::process::id())));
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
    let robot = Robot::load(root.join("robots/kr210")).unwrap();
    let motion =
        Motion::load_for(&root.join("trajectories/pick_and_place.toml"), &robot.rigid_model().unwrap()).unwrap();
    let outputs = Outputs { recordings: [RecordingFormat::Mcap].into(), ..Outputs::everything(&folder.0) };
    let mut under_way = |t: f64, _: f64| if t > 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let request =
        RunRequest { outputs: Some(&outputs), progress: Some(&mut under_way), ..RunRequest::keeping(Keep::Figures) };
    let end = robot.model(&Modelling::default()).unwrap().simulate_with(&motion, options, request);
    assert!(matches!(end, Err(Error::Interrupted { .. })), "{end:?}");
    let header = open_recording(&folder.0.join("run.mcap"), RecordingFormat::Mcap).unwrap().header().clone();
    (folder, header)
}

fn mesh_references(urdf: &str) -> Vec<&str> {
    urdf.split("filename=\"").skip(1).map(|rest| rest.split_once('"').unwrap().0).collect()
}

/// Truth: the files in the robot's folder.
#[test]
fn collision_meshes_are_where_visual_ones_are_and_both_can_be_inside_the_file() {
    let (folder, header) = recorded("files", &RunOptions::default());
    let references = mesh_references(&header.urdf);
    assert!(header.urdf.contains("<collision>") && references.len() > 10, "{}", references.len());
    for reference in &references {
        let path = reference.strip_prefix("file://").unwrap_or_else(|| panic!("{reference}"));
        assert!(Path::new(path).is_file(), "{path}");
    }
    assert_eq!(header.start_ns, None, "the usual start: {START_NS}");
    for layout in ["run.foxglove.json", "run.plotjuggler.xml"] {
        assert!(folder.0.join(layout).is_file(), "{layout}");
    }

    let options = RunOptions { embed_meshes: true, start_ns: Some(1_700_000_000_000_000_000), ..RunOptions::default() };
    let (_folder, embedded) = recorded("embedded", &options);
    let inside = mesh_references(&embedded.urdf);
    assert_eq!(inside.len(), references.len());
    for (reference, file) in inside.iter().zip(&references) {
        let data = reference.strip_prefix("data:model/stl;base64,").unwrap_or_else(|| panic!("{:.60}", reference));
        let size = std::fs::metadata(file.trim_start_matches("file://")).unwrap().len();
        assert_eq!(data.len() as u64, size.div_ceil(3) * 4, "base64 has four letters for three bytes");
    }
    assert_eq!(embedded.start_ns, options.start_ns);
}
