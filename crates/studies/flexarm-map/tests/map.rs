//! Maps compared with single results, symmetries and a manual search.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use flexarm_chatter::{CuttingPlace, CuttingTool, LobesError, LobesRequest, lobes};
use flexarm_map::{
    JointRange, KeptPoses, Map, MapError, MapRegion, MapRequest, ToolDirections, WorkspaceGrid, map, read_poses,
};
use flexarm_run::{Error, Fault, Modelling, Motion, Robot};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

fn robot(name: &str) -> Robot {
    Robot::load(root().join("robots").join(name)).unwrap()
}

fn taken(robot: &Robot, request: &MapRequest) -> Map {
    map(robot, request, &mut |_, _| ControlFlow::Continue(())).unwrap()
}

fn refused(robot: &Robot, request: &MapRequest) -> Error {
    map(robot, request, &mut |_, _| ControlFlow::Continue(())).unwrap_err()
}

fn joint(joint: &str, range: [f64; 2], points: usize) -> JointRange {
    JointRange { joint: joint.to_owned(), range, points }
}

fn over(ranges: Vec<JointRange>) -> MapRequest {
    MapRequest { region: MapRegion::Joints(ranges), ..MapRequest::default() }
}

fn grid(bounds: [[f64; 3]; 2], spacing_m: f64) -> WorkspaceGrid {
    WorkspaceGrid { bounds: Some(bounds), spacing_m: Some(spacing_m), ..WorkspaceGrid::default() }
}

/// Numbers of a row by name.
fn value(map: &Map, row: usize, name: &str) -> f64 {
    let k = map.table.columns.iter().position(|column| column.name == name).unwrap_or_else(|| panic!("{name}"));
    map.table.row(row)[k]
}

fn joints(map: &Map, row: usize) -> Vec<f64> {
    map.table.row(row)[6..][..map.joints.len()].to_vec()
}

const WRENCH: [f64; 6] = [300.0, -120.0, -800.0, 15.0, 40.0, -25.0];

#[test]
fn a_hundred_poses_of_a_map_are_those_of_statics_and_modes_to_the_last_bit() {
    for name in ["kr210", "kr210_identified", "palletiser"] {
        let robot = robot(name);
        let names: Vec<String> = robot.rigid_model().unwrap().coordinates().iter().map(|c| c.joint.clone()).collect();
        let ranges = names.iter().take(3).map(|name| joint(name, [-0.4, -0.1], 5)).collect();
        let request = MapRequest { wrench: WRENCH, frequencies: Some(4), ..over(ranges) };
        let found = taken(&robot, &request);
        assert_eq!((found.points, found.reachable, found.table.rows()), (125, 125, 125), "{name}");
        for row in (0..125).step_by(if name == "kr210" { 1 } else { 7 }) {
            let q = joints(&found, row);
            let weight = robot.model(&Modelling::default()).unwrap().statics(Some(&q), [0.0; 6]).unwrap();
            let loaded = robot.model(&Modelling::default()).unwrap().statics(Some(&q), WRENCH).unwrap();
            let hz =
                robot.model(&Modelling::default()).unwrap().modes(Some(&q), None, 4).unwrap().undamped_frequencies_hz;
            for (c, axis) in ["x", "y", "z"].iter().enumerate() {
                assert_eq!(value(&found, row, &format!("{axis}_m")), weight.tcp_position_m[c], "{name} {row}");
                assert_eq!(value(&found, row, &format!("sag_{axis}_m")), weight.tcp_displacement_m[c], "{name} {row}");
                assert_eq!(value(&found, row, &format!("sag_{axis}_m")), loaded.sag_m[c], "{name} {row}");
                assert_eq!(value(&found, row, &format!("error_{axis}_m")), loaded.tcp_displacement_m[c]);
                assert_eq!(value(&found, row, &format!("compliance_{axis}_m_per_n")), loaded.compliance[c][c]);
            }
            for (k, hz) in hz.iter().enumerate() {
                assert_eq!(value(&found, row, &format!("frequency_{}_hz", k + 1)), *hz, "{name} {row}");
            }
        }
    }
}

/// Truth: turning the whole arm about the direction of gravity changes only the direction of the
/// sag and of the softest force. Joint 1 of these arms is vertical.
#[test]
fn turning_the_arm_about_gravity_changes_no_size() {
    for name in ["kr210", "kr210_identified"] {
        let robot = robot(name);
        let at = Some(vec![0.0, -0.9, 1.1, 0.3, 0.7, -0.2]);
        let found = taken(&robot, &MapRequest { at, ..over(vec![joint("joint_1", [-2.5, 2.5], 41)]) });
        let mut worst = 0.0_f64;
        for quantity in ["sag_m", "sag_rad", "compliance_worst_m_per_n", "rotation_worst_rad_per_nm", "frequency_1_hz"]
        {
            let values = found.table.column(quantity).unwrap();
            worst = values.iter().map(|x| (x / values[0] - 1.0).abs()).fold(worst, f64::max);
        }
        // Measured: 2.0e-13.
        assert!(worst < 1e-11, "{name}: {worst:e}");
        let x = found.table.column("compliance_x_m_per_n").unwrap();
        assert!(x.iter().any(|c| (c / x[0] - 1.0).abs() > 0.1), "directions do change");
    }
}

/// Truth: the position of the rigid TCP at the joint values found.
#[test]
fn every_pose_of_a_workspace_map_has_its_tool_on_the_grid_within_the_limits() {
    let robot = robot("kr210");
    let tool = ToolDirections { cone_rad: 0.5, tilts: 4, rolls: 2, ..ToolDirections::default() };
    let region = MapRegion::Workspace(WorkspaceGrid { tool, ..grid([[1.2, -0.6, 0.4], [2.0, 0.6, 1.6]], 0.4) });
    let all = taken(&robot, &MapRequest { region: region.clone(), keep: KeptPoses::All, ..MapRequest::default() });
    let grid = all.grid.as_ref().unwrap();
    assert_eq!((grid.count, grid.directions, all.points), ([3, 4, 4], 8, 48));
    let model = robot.rigid_model().unwrap();
    let mut most_branches = 0.0_f64;
    for row in 0..all.table.rows() {
        let place = value(&all, row, "place") as usize;
        let index = [place % 3, place / 3 % 4, place / 12];
        for (c, k) in index.into_iter().enumerate() {
            let wanted = grid.lower_m[c] + 0.4 * k as f64;
            assert!((all.table.row(row)[c] - wanted).abs() < 1e-9);
        }
        for (q, coordinate) in joints(&all, row).iter().zip(model.coordinates()) {
            assert!(*q >= coordinate.limits.lower - 1e-9 && *q <= coordinate.limits.upper + 1e-9);
        }
        most_branches = most_branches.max(value(&all, row, "branch"));
    }
    assert!(most_branches >= 3.0, "an arm with a wrist has several branches, found {most_branches}");

    // The best and the worst pose of each position are among all of its poses.
    let kept = |keep| taken(&robot, &MapRequest { region: region.clone(), keep, ..MapRequest::default() });
    let (best, worst) = (kept(KeptPoses::Best), kept(KeptPoses::Worst));
    assert_eq!(best.reachable, all.reachable);
    let name = "compliance_worst_m_per_n";
    for row in 0..best.table.rows() {
        let place = value(&best, row, "place");
        let here = || (0..all.table.rows()).filter(|&k| value(&all, k, "place") == place).map(|k| value(&all, k, name));
        assert_eq!(value(&best, row, name), here().fold(f64::INFINITY, f64::min));
        assert_eq!(value(&worst, row, name), here().fold(f64::NEG_INFINITY, f64::max));
    }
    assert_eq!(best.best.value, best.table.column(name).unwrap().iter().copied().fold(f64::INFINITY, f64::min));
    assert_eq!(worst.worst.value, worst.quantities[name].max);
}

/// Truth: for a mirror-symmetric arm, the mirrored pose gives the mirrored result.
#[test]
fn an_arm_that_is_symmetric_has_a_symmetric_map() {
    let robot = robot("kr210_identified");
    let region = MapRegion::Workspace(grid([[1.4, -0.9, 0.6], [2.2, 0.9, 1.4]], 0.2));
    let found = taken(&robot, &MapRequest { region, ..MapRequest::default() });
    let [nx, ny, _] = found.grid.as_ref().unwrap().count;
    let rows: Vec<(usize, f64)> =
        (0..found.table.rows()).map(|k| (value(&found, k, "place") as usize, value(&found, k, "sag_m"))).collect();
    let mut worst = 0.0_f64;
    for (place, sag) in &rows {
        let (x, y, z) = (place % nx, place / nx % ny, place / (nx * ny));
        let mirrored = x + nx * ((ny - 1 - y) + ny * z);
        let other = rows.iter().find(|(place, _)| *place == mirrored).unwrap_or_else(|| panic!("{mirrored}")).1;
        worst = worst.max((sag / other - 1.0).abs());
    }
    assert!(rows.len() > 100);
    // Measured: 6.1e-6, from the products of inertia of the links.
    assert!(worst < 1e-4, "{worst:e}");
}

#[test]
fn a_map_is_the_same_bytes_on_one_thread_and_on_several() {
    let robot = robot("kr210");
    let region = MapRegion::Workspace(grid([[0.8, -1.0, 0.2], [2.6, 1.0, 2.0]], 0.2));
    let request = MapRequest { region, wrench: WRENCH, ..MapRequest::default() };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| taken(&robot, &request)).table.values
    };
    let (one, three) = (on(1), on(3));
    assert!(one.len() > 1000);
    assert!(one.iter().zip(&three).all(|(a, b)| a.to_bits() == b.to_bits()) && one.len() == three.len());
}

/// Truth: to first order the displacements due to the elements add up to the total; the rest is of
/// second order.
#[test]
fn shares_of_the_elements_add_up_to_the_whole() {
    let robot = robot("kr210");
    let request =
        MapRequest { wrench: WRENCH, ..over(vec![joint("joint_2", [-1.6, -0.2], 9), joint("joint_3", [0.1, 1.8], 9)]) };
    let found = taken(&robot, &request);
    let shares: Vec<&str> =
        found.table.columns.iter().map(|c| c.name.as_str()).filter(|name| name.starts_with("share_")).collect();
    assert_eq!(shares.len(), 8);
    let mut worst = 0.0_f64;
    for row in 0..found.table.rows() {
        let sum: f64 = shares.iter().map(|name| value(&found, row, name)).sum();
        worst = worst.max((sum - 1.0).abs());
    }
    // Measured: 3.8e-4.
    assert!(worst < 2e-3, "{worst:e}");
}

#[test]
fn a_map_along_a_motion_is_at_the_motions_poses() {
    let robot = robot("kr210");
    let motion = Motion::load(root().join("trajectories/pick_and_place.toml"), &robot).unwrap();
    let end = motion.trajectory.duration();
    let trajectory = motion.trajectory.clone();
    let region = MapRegion::Along { motion: Box::new(motion), points: 11 };
    let found = taken(&robot, &MapRequest { region, ..MapRequest::default() });
    assert_eq!(found.table.rows(), 11);
    let (mut q, mut v, mut a) = (vec![0.0; 6], vec![0.0; 6], vec![0.0; 6]);
    for row in 0..11 {
        trajectory.sample(end * row as f64 / 10.0, &mut q, &mut v, &mut a);
        assert_eq!(joints(&found, row), q);
    }
}

/// Truth: the meshes of the KR 210; base and carriage reach 0.3 to 0.9 m from the axis of joint 1.
#[test]
fn by_default_no_place_of_a_workspace_is_inside_the_column_of_the_arm() {
    let robot = robot("kr210");
    let nearest = |grid: WorkspaceGrid| {
        let request = MapRequest { region: MapRegion::Workspace(grid), ..MapRequest::default() };
        let found = taken(&robot, &request);
        (0..found.table.rows())
            .map(|k| found.table.row(k)[0].hypot(found.table.row(k)[1]))
            .fold(f64::INFINITY, f64::min)
    };
    let usual = nearest(WorkspaceGrid { spacing_m: Some(0.3), ..WorkspaceGrid::default() });
    eprintln!("nearest place {usual:.3} m");
    assert!((0.3..1.2).contains(&usual), "{usual}");
    let all = WorkspaceGrid { spacing_m: Some(0.3), keep_out_m: Some(0.0), ..WorkspaceGrid::default() };
    assert!(nearest(all) < 0.3);
}

#[test]
fn a_workpiece_goes_where_its_worst_place_is_best() {
    let robot = robot("kr210");
    let region =
        MapRegion::Workspace(WorkspaceGrid { keep_out_m: Some(0.9), ..grid([[0.6, -1.0, 0.4], [2.2, 1.0, 1.6]], 0.2) });
    let request = MapRequest { region, workpiece_m: Some([0.4, 0.6, 0.2]), ..MapRequest::default() };
    let found = taken(&robot, &request);
    let placement = found.placement.as_ref().unwrap();
    let inside = |row: usize| {
        (0..3).all(|c| {
            let x = found.table.row(row)[c];
            x > placement.lower_m[c] - 1e-6 && x < placement.upper_m[c] + 1e-6
        })
    };
    let values: Vec<f64> =
        (0..found.table.rows()).filter(|&k| inside(k)).map(|k| value(&found, k, "compliance_worst_m_per_n")).collect();
    assert_eq!(values.len(), placement.points);
    assert_eq!(placement.points, 3 * 4 * 2);
    assert_eq!(values.iter().copied().fold(0.0, f64::max), placement.worst);
    // Nothing is mapped at the position of the arm itself.
    assert!((0..found.table.rows()).all(|k| found.table.row(k)[0].hypot(found.table.row(k)[1]) > 0.9 - 1e-9));
    let huge = MapRequest { workpiece_m: Some([3.0, 3.0, 3.0]), ..request };
    let found = taken(&robot, &huge);
    assert!(found.placement.is_none() && found.caveats.iter().any(|c| c.code == "no-placement"));
}

/// Truth: the position of the rigid TCP; the arm is the shipped one with joint 5 tilted by 8
/// degrees, which belongs to no known class.
#[test]
fn an_arm_without_a_closed_form_is_searched_and_lands_on_the_grid() {
    let folder = std::env::temp_dir().join(format!("flexarm-map-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = std::fs::read_to_string(root().join("robots/kr210/kr210.urdf")).unwrap();
    let skew = text.replace(
        "xyz=\"0 0.096 -0.392\" rpy=\"0 1.5707963267948966 1.5707963267948966\"",
        "xyz=\"0.03 0.096 -0.392\" rpy=\"0.1 1.43 1.5707963267948966\"",
    );
    assert_ne!(skew, text);
    std::fs::write(folder.join("skew.urdf"), skew).unwrap();
    let robot = Robot::load(folder.join("skew.urdf")).unwrap();
    let region = MapRegion::Workspace(grid([[1.6, -0.2, 0.8], [1.6, 0.2, 1.2]], 0.4));
    let found = taken(&robot, &MapRequest { region, keep: KeptPoses::All, ..MapRequest::default() });
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(found.caveats.iter().any(|c| c.code == "searched-poses"));
    assert_eq!((found.points, found.reachable), (4, 4));
    for row in 0..found.table.rows() {
        let place = value(&found, row, "place") as usize;
        let wanted = [1.6, -0.2 + 0.4 * (place % 2) as f64, 0.8 + 0.4 * (place / 2) as f64];
        assert!((0..3).all(|c| (found.table.row(row)[c] - wanted[c]).abs() < 1e-9));
    }
}

#[test]
fn what_cannot_be_mapped_is_refused_with_its_cause() {
    let robot = robot("kr210");
    let error = |request: &MapRequest| {
        let error = refused(&robot, request);
        assert!(matches!(error.external(), Some(MapError::Input(_))), "{error}");
        error.to_string()
    };
    assert!(error(&over(vec![joint("joint_9", [0.0, 1.0], 3)])).contains("there is no joint \"joint_9\" to vary"));
    assert!(error(&over(vec![])).contains("no joint is given"));
    let twice = vec![joint("joint_1", [0.0, 1.0], 3), joint("joint_1", [0.0, 1.0], 3)];
    assert!(error(&over(twice)).contains("is named twice"));
    assert!(error(&over(vec![joint("joint_1", [0.0, f64::NAN], 3)])).contains("has a range from 0 to NaN"));
    let many = ["joint_1", "joint_2", "joint_3"].map(|name| joint(name, [-1.0, -0.5], 1000)).to_vec();
    assert!(error(&over(many)).contains("at most 5e6 are held in memory"));
    let workspace = |workspace| MapRequest { region: MapRegion::Workspace(workspace), ..MapRequest::default() };
    assert!(error(&workspace(grid([[1.0; 3], [0.0; 3]], 0.1))).contains("must have its lower corner first"));
    assert!(error(&workspace(grid([[0.0; 3], [1.0; 3]], 0.0))).contains("must be positive, found 0 m"));
    assert!(error(&workspace(grid([[0.0; 3], [1.0; 3]], 1e-6))).contains("at most 5e6 are held in memory"));
    assert!(error(&workspace(grid([[9.0; 3], [9.5; 3]], 0.1))).contains("is within reach"));
    let tool = ToolDirections { axis: [0.0; 3], ..ToolDirections::default() };
    assert!(
        error(&workspace(WorkspaceGrid { tool, ..WorkspaceGrid::default() })).contains("must be finite and non-zero")
    );
    let by = MapRequest { by: Some("sagg_m".into()), ..MapRequest::default() };
    assert!(error(&by).contains("sag_m"));
    let piece = MapRequest { workpiece_m: Some([0.1; 3]), ..over(vec![joint("joint_1", [0.0, 1.0], 3)]) };
    assert!(error(&piece).contains("a workpiece requires a grid"));
    let stopped = map(&robot, &MapRequest::default(), &mut |_, _| ControlFlow::Break(())).unwrap_err();
    assert_eq!(stopped.fault(), Fault::Run);
    let planar = Robot::load(root().join("robots/palletiser")).unwrap();
    assert!(refused(&planar, &MapRequest::default()).to_string().contains("reaching a TCP pose requires six"));
}

fn end_mill() -> CuttingTool {
    CuttingTool::load(root().join("robots/tools/endmill_20mm.toml")).unwrap().at_speeds(vec![8000.0])
}

#[test]
fn limits_of_depth_of_a_map_are_those_of_lobes_to_the_last_bit() {
    let (robot, tool) = (robot("kr210"), end_mill());
    let ranges = vec![joint("joint_2", [-1.2, -0.8], 2), joint("joint_3", [1.2, 1.6], 2)];
    let at = Some(vec![0.3, 0.0, 0.0, 0.2, 0.9, -0.1]);
    let request = MapRequest { tool: Some(tool.clone()), at, ..over(ranges) };
    let found = taken(&robot, &request);
    assert_eq!((found.by.as_str(), found.table.rows()), ("depth_m", 4));
    let mut depths = Vec::new();
    for row in 0..4 {
        let q = joints(&found, row);
        let request = LobesRequest::default();
        let alone = lobes(&robot, &tool, &CuttingPlace::At(Some(&q)), &request, &|_, _| true).unwrap();
        assert_eq!(value(&found, row, "depth_m"), alone.stable_below_m.unwrap());
        depths.push(value(&found, row, "depth_m"));
    }
    assert!(depths.iter().all(|d| found.best.value >= *d && found.worst.value <= *d));
    assert!(found.best.value > 1.05 * found.worst.value, "{depths:?}");
}

/// Truth: with the feed in tool axes, turning the whole arm about the direction of gravity changes
/// nothing.
#[test]
fn turning_the_arm_about_gravity_changes_no_limit_of_depth() {
    let robot = robot("kr210");
    let at = Some(vec![0.0, -1.0, 1.4, 0.2, 0.9, -0.1]);
    let request = MapRequest { at, tool: Some(end_mill()), ..over(vec![joint("joint_1", [-2.0, 2.0], 3)]) };
    let depths = taken(&robot, &request).table.column("depth_m").unwrap();
    let worst = depths.iter().map(|d| (d / depths[0] - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst:e} of {depths:?}"); // measured 3.5e-14
}

#[test]
fn a_tool_that_cannot_be_judged_is_refused_before_the_map_is_taken() {
    let robot = robot("kr210");
    let region = MapRegion::Workspace(grid([[1.6, 0.0, 0.6], [1.6, 0.0, 0.6]], 0.5));
    let request = |rpm| MapRequest {
        tool: Some(end_mill().at_speeds(vec![rpm])),
        region: region.clone(),
        ..MapRequest::default()
    };
    for (rpm, speed) in [(-1.0, true), (f64::NAN, true)] {
        let error = refused(&robot, &request(rpm));
        assert_eq!(matches!(error.external(), Some(LobesError::Speed { .. })), speed, "{error}");
    }
    // A feed along the tool, which points down there: no pose has a limit.
    let folder = std::env::temp_dir().join(format!("flexarm-map-tool-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let text = std::fs::read_to_string(root().join("robots/tools/endmill_20mm.toml")).unwrap();
    let path = folder.join("tool.toml");
    let upright = text.replace("feed = [1.0, 0.0, 0.0]", "feed_axes = \"world\"\nfeed = [0.0, 0.0, 1.0]");
    assert_ne!(upright, text);
    std::fs::write(&path, upright).unwrap();
    let tool = Some(CuttingTool::load(&path).unwrap().at_speeds(vec![8000.0]));
    let error = refused(&robot, &MapRequest { tool, region, ..MapRequest::default() });
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(error.to_string().contains("none of the poses has a depth_m"), "{error}");
    assert!(error.to_string().contains("feed"), "{error}");
}

/// Truth: statics at each pose; the file is read in three forms.
#[test]
fn a_map_of_listed_poses_has_the_compliance_of_statics_at_each() {
    let robot = robot("kr210");
    let folder = std::env::temp_dir().join(format!("flexarm-poses-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let poses = [[0.1, -1.0, 1.5, 0.3, 0.7, 0.2], [-0.4, -0.8, 1.2, 0.0, -0.5, 0.9], [0.0, -1.2, 1.9, 1.0, 0.3, 0.0]];
    let written = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        read_poses(&path, &robot, Some(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.25]))
    };
    let row = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let table: String = poses.iter().map(|pose| row(pose) + "\n").collect();
    let read = written("a.csv", format!("joint_1,joint_2,joint_3,joint_4,joint_5,joint_6\n{table}")).unwrap();
    assert_eq!(read, poses);
    let listed: Vec<String> = poses.iter().map(|pose| format!("[{}]", row(pose))).collect();
    assert_eq!(written("b.toml", format!("format = 1\nposes = [{}]\n", listed.join(", "))).unwrap(), poses);
    let named = written("c.csv", "joint_2_deg;joint_1_rad\n-90;0,5\n".into()).unwrap();
    assert_eq!(named, [[0.5, (-90.0_f64).to_radians(), 0.0, 0.0, 0.0, 0.25]]);
    for (name, text, words) in [
        ("d.csv", "joint_9\n1\n", "joint_9"),
        ("e.csv", "joint_1,joint_2\n1,1e9\n", "e.csv:2:1: "),
        ("f.csv", "joint_1\n", "no pose"),
        ("g.toml", "format = 1\nposes = [[1.0]]\n", "expected 6"),
    ] {
        let error = written(name, text.into()).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains(name), "{error}");
    }

    let request = MapRequest { region: MapRegion::Poses(read), wrench: WRENCH, ..MapRequest::default() };
    let found = taken(&robot, &request);
    assert_eq!((found.points, found.table.rows()), (3, 3));
    let entries =
        ["x", "y", "z", "rx", "ry", "rz"].map(|a| ["fx", "fy", "fz", "tx", "ty", "tz"].map(|b| format!("c_{a}_{b}_")));
    for (k, pose) in poses.iter().enumerate() {
        let truth = robot.model(&Modelling::default()).unwrap().statics(Some(pose), WRENCH).unwrap();
        for (i, line) in entries.iter().enumerate() {
            for (j, name) in line.iter().enumerate() {
                let column = found.table.columns.iter().position(|column| column.name.starts_with(name)).unwrap();
                assert_eq!(found.table.row(k)[column], truth.compliance[i][j], "{name}");
            }
        }
    }
    assert!(!found.caveats.iter().any(|caveat| caveat.code == "one-place"));
    let one = MapRequest { region: MapRegion::Poses(vec![poses[0].to_vec()]), ..MapRequest::default() };
    assert!(taken(&robot, &one).caveats.iter().any(|caveat| caveat.code == "one-place"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_map_with_a_tool_that_is_stopped_within_a_pose_keeps_the_places_done() {
    let (robot, tool) = (robot("kr210"), end_mill().at_speeds(vec![8000.0, 9000.0]));
    let at = Some(vec![0.3, 0.0, 0.0, 0.2, 0.9, -0.1]);
    let folder = std::env::temp_dir().join(format!("flexarm-map-stopped-{}", std::process::id()));
    let ranges = vec![joint("joint_2", [-1.2, -0.8], 4)];
    let request = MapRequest { tool: Some(tool), at, output: Some(folder.clone()), ..over(ranges) };
    let mut looks = 0;
    let stopped = map(&robot, &request, &mut |done, all| {
        assert_eq!(all, 4.0);
        looks += usize::from(done >= 1.0);
        // The second look after the first place is within the second one.
        if looks > 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let error = stopped.unwrap_err();
    assert_eq!(error.fault(), Fault::Run);
    let Some(&MapError::Interrupted { done, places: 4, .. }) = error.external() else { panic!("{error}") };
    assert!((1..4).contains(&done), "{done}");
    assert!(error.to_string().contains(&format!("their results are in {}", folder.display())), "{error}");
    let json = std::fs::read_to_string(folder.join("map.json")).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((found["reachable"].as_u64(), found["points"].as_u64()), (Some(done as u64), Some(4)));
    assert!(found["warnings"].to_string().contains(&format!("{done} of 4 places")), "{}", found["warnings"]);
}
