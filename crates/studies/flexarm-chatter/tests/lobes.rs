//! Chatter of a tool on an arm: classical cases as arms, an independent solution at three poses.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flexarm_chatter::{CuttingPlace, CuttingTool, Lobes, LobesRequest, lobes, rounded_down};
use flexarm_run::{DriveModel, Error, LinkModel, Modelling, Motion, Robot};
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).unwrap().to_owned()
}

fn golden(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(root().join("tests/golden").join(name)).unwrap()).unwrap()
}

fn kr210() -> Robot {
    Robot::load(root().join("robots/kr210")).unwrap()
}

fn shipped(tool: &str) -> CuttingTool {
    CuttingTool::load(root().join("robots/tools").join(format!("{tool}.toml"))).unwrap()
}

/// A folder that is removed when dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("flexarm-lobes-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn tool(&self, text: &str) -> Result<CuttingTool, Error> {
        let path = self.0.join("tool.toml");
        std::fs::write(&path, text).unwrap();
        CuttingTool::load(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn rigid() -> Modelling {
    Modelling { links: LinkModel::Rigid, drives: DriveModel::Rigid, ..Modelling::default() }
}

fn at(robot: &Robot, tool: &CuttingTool, pose: &[f64], request: &LobesRequest) -> Lobes {
    lobes(robot, tool, &CuttingPlace::At(Some(pose)), request, &|_, _| true).unwrap()
}

/// The tool of a classical case: its modes along the feed (x of the TCP) and across it. The axis of
/// the cut is that of the tool, reversed: y of the cut is `z × x` with z from the tip to the
/// spindle, so minus y of the TCP.
fn classical(case: &Value) -> String {
    let number = |key: &str| case[key].as_f64().unwrap();
    let mut text = format!(
        "format = 1\nlengths = \"mm\"\nangles = \"deg\"\npressures = \"N/mm2\"\ndeepest = {}\n[cutter]\nteeth = {}\ndiameter = 20.0\n\
         coefficients = {{ tangential = {}, radial = {} }}\n[engagement]\nkind = \"angles\"\nentry = {}\nexit = {}\n[tool]\nfeed = [1.0, 0.0, 0.0]\n",
        1e3 * number("searched_to_m"),
        case["teeth"],
        1e-6 * number("Kt_Pa"),
        1e-6 * number("Kn_Pa"),
        number("entry_rad").to_degrees(),
        number("exit_rad").to_degrees()
    );
    let rpm: Vec<String> = case["rows"].as_array().unwrap().iter().step_by(5).map(|r| r[0].to_string()).collect();
    let _ = writeln!(text, "[spindle]\nrpm = [{}]", rpm.join(", "));
    for mode in case["modes"].as_array().unwrap() {
        let direction = if mode["axis"] == "x" { "[1.0, 0.0, 0.0]" } else { "[0.0, -1.0, 0.0]" };
        let _ = writeln!(
            text,
            "[[mode]]\ndirection = {direction}\nfrequency = {}\ndamping = {}\nmass = {}",
            mode["frequency_Hz"], mode["damping_ratio"], mode["mass_kg"]
        );
    }
    text
}

/// Truth: limits of another program (0.2 %). The arm is rigid, the tool is the structure; units,
/// axes and files are tested as well.
#[test]
fn a_tool_on_a_rigid_arm_has_the_limits_of_the_classical_cases() {
    let (robot, folder) = (kr210(), Folder::new("classical"));
    let request = LobesRequest { modelling: rigid(), ..LobesRequest::default() };
    let mut worst: f64 = 0.0;
    for (name, case) in golden("milling_lobes.json")["cases"].as_object().unwrap() {
        let tool = folder.tool(&classical(case)).unwrap();
        let found = at(&robot, &tool, &[0.1, -1.0, 1.5, 0.3, 0.7, 0.2], &request);
        for (point, row) in found.points.iter().zip(case["rows"].as_array().unwrap().iter().step_by(5)) {
            assert_eq!(point.spindle_rpm, row[0].as_f64().unwrap());
            assert_eq!(point.depth_m.is_some(), row[1].is_number(), "{name} at {}", point.spindle_rpm);
            if let Some(depth) = point.depth_m {
                worst = worst.max((depth / row[1].as_f64().unwrap() - 1.0).abs());
                assert_eq!(point.kind.unwrap(), row[2]);
            }
        }
    }
    eprintln!("largest difference {:.3} %", 100.0 * worst);
    // measured 0.10 %
    assert!(worst < 0.005, "{worst}");
}

/// Truth: the multi-frequency solution of the exported frequency response, by a script that uses no
/// modes and no time steps.
#[test]
fn limits_follow_the_pose_as_the_exported_response_says() {
    let (robot, golden) = (kr210(), golden("kr210_lobes.json"));
    let mut worst: f64 = 0.0;
    for case in golden["cases"].as_array().unwrap() {
        let pose: Vec<f64> = case["at"].as_array().unwrap().iter().map(|q| q.as_f64().unwrap()).collect();
        let rows = case["rows"].as_array().unwrap();
        let rpm = rows.iter().map(|r| r[0].as_f64().unwrap()).collect();
        let tool = shipped(case["tool"].as_str().unwrap()).at_speeds(rpm);
        let found = at(&robot, &tool, &pose, &LobesRequest::default());
        for (point, row) in found.points.iter().zip(rows) {
            let (depth, truth) = (point.depth_m.unwrap(), row[1].as_f64().unwrap());
            eprintln!(
                "{:.0} 1/min: {:.4} mm, {:.4} mm, {:.1} Hz",
                point.spindle_rpm,
                1e3 * depth,
                1e3 * truth,
                point.chatter_hz.unwrap()
            );
            worst = worst.max((depth / truth - 1.0).abs());
        }
    }
    eprintln!("largest difference {worst:.1e}");
    // measured 2.8e-5; the truth had converged to 9e-5
    assert!(worst < 3e-4, "{worst:.1e}");
}

/// Identity: the limit along a motion is the minimum of those at its positions, each with its feed
/// along the motion.
#[test]
fn along_a_motion_the_limit_is_the_smallest_of_its_places() {
    let robot = kr210();
    let motion = Motion::load(root().join("trajectories/milling_square.toml"), &robot).unwrap();
    let folder = Folder::new("along");
    let text = std::fs::read_to_string(root().join("robots/tools/face_mill_63mm.toml")).unwrap();
    assert!(!text.contains("\nfeed = "), "the tool says no feed: it is along the motion");
    let tool = folder.tool(&text).unwrap().at_speeds(vec![2000.0, 5000.0]);
    let request = LobesRequest::default();
    let found = lobes(&robot, &tool, &CuttingPlace::Along(&motion, 8), &request, &|_, _| true).unwrap();
    assert!(found.poses.len() >= 4 && found.poses.len() + found.left_out == 8, "{}", found.poses.len());
    for (k, point) in found.points.iter().enumerate() {
        let smallest = found.poses.iter().filter_map(|p| p.depth_m[k]).fold(f64::INFINITY, f64::min);
        assert_eq!(point.depth_m, Some(smallest));
        assert_eq!(found.poses[point.pose].depth_m[k], Some(smallest));
    }
    // The sides of the square are along x and y of the world.
    for pose in &found.poses {
        let largest = pose.feed.iter().fold(0.0_f64, |top, x| top.max(x.abs()));
        assert!(largest > 0.99 || pose.feed[2].abs() < 0.02, "{:?}", pose.feed);
    }
    // The same at one of its positions, with that feed given.
    let pose = &found.poses[0];
    let [x, y, z] = pose.feed;
    let given = text.replace("[tool]\n", &format!("[tool]\nfeed = [{x}, {y}, {z}]\nfeed_axes = \"world\"\n"));
    let given = folder.tool(&given).unwrap().at_speeds(vec![2000.0, 5000.0]);
    let one = at(&robot, &given, &pose.at, &request);
    for (k, point) in one.points.iter().enumerate() {
        let difference = (point.depth_m.unwrap() / pose.depth_m[k].unwrap() - 1.0).abs();
        assert!(difference < 1e-6, "{difference:.1e}");
    }
}

/// Typical mistakes, reported with their location and the fix.
#[test]
fn a_wrong_tool_is_told_with_its_place() {
    let folder = Folder::new("wrong");
    let good = std::fs::read_to_string(root().join("robots/tools/endmill_20mm.toml")).unwrap();
    folder.tool(&good).unwrap();
    let cases = [
        ("format = 1\n", "format = 2\n", "this program reads format 1"),
        ("pressures = \"N/mm2\"", "pressures = \"bar\"", "use one of"),
        ("pressures = \"N/mm2\"", "pressures = \"N/m2\"", "is the unit right"),
        ("teeth = 3", "teeth = 0", "expected 1 to 1000"),
        ("diameter = 20.0", "diameter = -20.0", "expected a positive number"),
        ("helix = 30.0", "helix = 95.0", "expected 0 to 80"),
        ("kind = \"down\"", "kind = \"sideways\"", "use \"up\", \"down\""),
        ("ae = 5.0", "ae = 25.0", "above 0, at most 1"),
        ("ae = 5.0", "ap = 5.0", "unknown field"),
        ("from = 2000.0", "from = 20000.0", "to must be greater than from"),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 0.0]", "not all zero"),
        ("direction = \"radial\"", "direction = \"sideways\"", "use \"radial\""),
        ("stiffness = 1.5e7", "stiffness = 1.5e7\nmass = 2.0", "not both"),
        ("damping = 0.03", "damping = 0.0", "expected a positive number"),
        ("[[mode]]", "[measured]\nfile = \"frf.csv\"\n[[mode]]", "fit modes to the response"),
    ];
    for (old, new, words) in cases {
        assert!(good.contains(old), "{old}");
        let error = folder.tool(&good.replace(old, new)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("tool.toml:"), "{new}: {error}");
    }
    let robot = kr210();
    let fails = |text: &str, modelling: Modelling| {
        let request = LobesRequest { modelling, ..LobesRequest::default() };
        lobes(&robot, &folder.tool(text).unwrap(), &CuttingPlace::At(None), &request, &|_, _| true)
            .unwrap_err()
            .to_string()
    };
    let along = good.replace("feed = [1.0, 0.0, 0.0]", "feed = [0.0, 0.0, 1.0]");
    assert!(fails(&along, Modelling::default()).contains("parallel to the tool axis"));
    let bare = &good[..good.find("[[mode]]").unwrap()];
    assert!(fails(bare, rigid()).contains("nothing is elastic"));
    let stopped =
        lobes(&robot, &folder.tool(&good).unwrap(), &CuttingPlace::At(None), &LobesRequest::default(), &|_, _| false);
    assert!(matches!(stopped, Err(Error::Interrupted { .. })));
}

/// Files are complete, readable, and not overwritten unless requested.
#[test]
fn table_diagram_page_and_figures_are_written_together() {
    let (robot, folder) = (kr210(), Folder::new("files"));
    let tool = shipped("endmill_20mm").at_speeds((6..14).map(|k| 1000.0 * f64::from(k)).collect());
    let request = LobesRequest { output: Some(folder.0.join("out")), ..LobesRequest::default() };
    let found = at(&robot, &tool, &[0.0, -1.0, 1.6, 0.0, 0.9, 0.0], &request);
    let csv = std::fs::read_to_string(found.file.as_ref().unwrap()).unwrap();
    let depth: f64 = csv.lines().nth(3).unwrap().split(',').nth(1).unwrap().parse().unwrap();
    assert_eq!(Some(depth), found.points[2].depth_m);
    let json: Value =
        serde_json::from_str(&std::fs::read_to_string(found.files.json.as_ref().unwrap()).unwrap()).unwrap();
    assert_eq!(json["points"][2]["depth_m"].as_f64(), found.points[2].depth_m);
    assert!(std::fs::read_to_string(found.files.plot.as_ref().unwrap()).unwrap().contains("depth of cut"));
    assert!(std::fs::read_to_string(found.files.page.as_ref().unwrap()).unwrap().contains("<svg"));
    let place = CuttingPlace::At(None);
    assert!(matches!(lobes(&robot, &tool, &place, &request, &|_, _| true), Err(Error::Taken { .. })));
}

/// Truth: the same direction in other axes. The tool's axis at the pose comes from a run with TCP
/// axes.
#[test]
fn a_tool_axis_in_world_axes_is_the_same_axis() {
    let (robot, folder) = (kr210(), Folder::new("axis"));
    let pose = [0.2, -1.0, 1.6, 0.4, 0.9, -0.3];
    let text = std::fs::read_to_string(root().join("robots/tools/face_mill_63mm.toml")).unwrap();
    let request = LobesRequest::default();
    let own = folder.tool(&text).unwrap().at_speeds(vec![2000.0, 5000.0]);
    let found = at(&robot, &own, &pose, &request);
    let ([x, y, z], [fx, fy, fz]) = (found.poses[0].axis, found.poses[0].feed);
    let lines = text
        .lines()
        .filter(|line| !line.starts_with("axis") && !line.starts_with("feed =") && !line.starts_with("feed_axes"));
    let world = lines.collect::<Vec<_>>().join("\n").replace(
        "[tool]",
        &format!(
            "[tool]\naxis = [{x}, {y}, {z}]\naxis_axes = \"world\"\nfeed = [{fx}, {fy}, {fz}]\nfeed_axes = \"world\"\n#"
        ),
    );
    let world = folder.tool(&world).unwrap().at_speeds(vec![2000.0, 5000.0]);
    for (a, b) in at(&robot, &world, &pose, &request).points.iter().zip(&found.points) {
        let (a, b) = (a.depth_m.unwrap(), b.depth_m.unwrap());
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    let alone = folder.tool(&text.replace("axis = [0.0, 0.0, 1.0]", "axis_axes = \"world\"")).map(|_| ());
    let error = alone.unwrap_err().to_string();
    assert!(error.contains("axis_axes") && error.contains("tool.toml:"), "{error}");
}

#[test]
fn what_no_tool_has_is_refused_and_what_few_have_is_told_with_its_slip() {
    let folder = Folder::new("slips");
    let good = std::fs::read_to_string(root().join("robots/tools/endmill_20mm.toml")).unwrap();
    for (old, new, words) in [
        ("damping = 0.03", "damping = 30000.0", "damping is 30000"),
        ("damping = 0.03", "damping = nan", "finite"),
        ("stiffness = 1.5e7", "stiffness = 1e300", "stiffness is 1e300"),
        ("frequency = 1200.0", "frequency = 1e-300", "frequency is"),
        ("frequency = 1200.0", "frequency = 1e12", "frequency is"),
        ("diameter = 20.0", "diameter = 20000.0", "diameter is 20 m"),
        ("deepest = 20.0", "deepest = 1e40", "deepest is"),
        ("to = 18000.0", "to = 1e12", "to is 1e12 1/min"),
    ] {
        assert!(good.contains(old), "{old}");
        let error = folder.tool(&good.replace(old, new)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("tool.toml:"), "{new}: {error}");
    }
    let rigid = LobesRequest { modelling: rigid(), ..LobesRequest::default() };
    for (old, new, code, slip) in [
        ("damping = 0.03", "damping = 3.0", "tool-damping", "per cent"),
        ("stiffness = 1.5e7", "stiffness = 15.0", "tool-stiffness", "N/um"),
        ("frequency = 1200.0", "frequency = 1.2", "tool-frequency", "kHz"),
        ("diameter = 20.0", "diameter = 600.0", "tool-diameter", ""),
        ("frequency = 1200.0", "frequency = 7540.0", "tool-mass", "rad/s"),
        ("helix = 30.0", "helix = 0.5236", "unusual", "radians"),
        ("helix = 30.0", "helix = 30.0\nlead = 1.5708", "unusual", "radians"),
        ("radial = 250.0", "radial = -250.0", "unusual", ""),
        ("radial = 250.0", "radial = 8000.0", "unusual", ""),
        ("[tool]", "[tool]\ntip = [0.0, 0.0, 300000.0]", "unusual", "millimetres"),
        ("deepest = 20.0", "deepest = 0.02", "tool-deepest", "millimetres"),
    ] {
        assert!(good.contains(old), "{old}");
        let tool = folder.tool(&good.replace(old, new)).unwrap().at_speeds(vec![6000.0]);
        let found = at(&kr210(), &tool, &[0.0, -1.0, 1.6, 0.0, 0.9, 0.0], &rigid);
        let caveat = found.caveats.iter().find(|caveat| caveat.code == code).unwrap();
        assert!(caveat.likely.contains(slip) && caveat.value.is_some(), "{caveat:?}");
        assert!(found.warnings.contains(&caveat.message));
    }
    let usual =
        at(&kr210(), &folder.tool(&good).unwrap().at_speeds(vec![6000.0]), &[0.0, -1.0, 1.6, 0.0, 0.9, 0.0], &rigid);
    let findings = |code: &str| code.starts_with("tool-") || code == "unusual";
    assert!(!usual.caveats.iter().any(|caveat| findings(&caveat.code)), "{:?}", usual.caveats);
    // Small cutters have light modes.
    let small = good.replace("diameter = 20.0", "diameter = 1.0").replace("ae = 5.0", "ae = 0.3");
    let small = small.replace("1200.0", "6000.0").replace("1.5e7", "1e6").replace("deepest = 20.0", "deepest = 2.0");
    let small = folder.tool(&small).unwrap().at_speeds(vec![40000.0]);
    let usual = at(&kr210(), &small, &[0.0, -1.0, 1.6, 0.0, 0.9, 0.0], &rigid);
    assert!(!usual.caveats.iter().any(|caveat| findings(&caveat.code)), "{:?}", usual.caveats);
}

/// A path in mm/min where mm/s are expected moves the tool by millimetres from tooth to tooth.
#[test]
fn a_feed_per_tooth_that_no_cutter_takes_is_told_along_a_motion() {
    let folder = Folder::new("feed");
    let good = std::fs::read_to_string(root().join("robots/tools/endmill_20mm.toml")).unwrap();
    let motion = Motion::load(root().join("trajectories/milling_square.toml"), &kr210()).unwrap();
    let told = |rpm: f64| {
        let tool = folder.tool(&good).unwrap().at_speeds(vec![rpm]);
        // The feed does not depend on the depth; a small one is quickly examined.
        let request = LobesRequest { modelling: rigid(), deepest_m: Some(1e-4), ..LobesRequest::default() };
        let place = CuttingPlace::Along(&motion, 4);
        let found = lobes(&kr210(), &tool, &place, &request, &|_, _| true).unwrap();
        let named = found.caveats.iter().find(|caveat| caveat.message.contains("feed per tooth"));
        named.map(|caveat| (caveat.value.unwrap(), caveat.likely.clone()))
    };
    // 250 mm/s at 8000/min with three teeth: 0.63 mm; at 400/min 12.5 mm.
    assert_eq!(told(8000.0), None);
    let (feed, likely) = told(400.0).unwrap();
    eprintln!("{feed} m a tooth, {likely}");
    assert!((feed / 12.5e-3 - 1.0).abs() < 0.01 && likely.contains("mm/min"), "{feed} {likely}");
}

#[test]
fn a_limit_for_people_is_never_above_the_limit() {
    assert_eq!(rounded_down(0.02974, 3), "0.029");
    assert_eq!(rounded_down(2.0, 3), "2.000");
    assert_eq!(rounded_down(0.000_297, 3), "0.00029");
    for k in 1..20_000 {
        let x = 1.7e-5 * f64::from(k);
        let shown: f64 = rounded_down(x, 3).parse().unwrap();
        assert!(shown <= x && x - shown < 1.001e-3 && shown > 0.9 * x, "{x} {shown}");
    }
}
