//! `new_robot`: its robots can be loaded, moved and checked, whatever the description lacks.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use flexarm_new::{NewOptions, NewRobot, new_robot};
use flexarm_run::{Error, Motion, Robot, check};
use flexarm_urdf::InertiaEstimate;

/// A folder that is removed with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("flexarm-new-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Features of a generated arm.
#[derive(Clone)]
struct Arm {
    /// Prefix of the names of all links and joints.
    prefix: &'static str,
    masses: bool,
    /// Attributes of `<limit>`; without them the joints are continuous.
    limit: Option<&'static str>,
    /// Element with the shapes: visual or collision.
    shapes: &'static str,
    /// Shape instead of the box of the upper arm.
    upper_shape: Option<String>,
    /// Factor on the moments of inertia about x.
    odd: f64,
}

const ARM: Arm = Arm {
    prefix: "",
    masses: true,
    limit: Some(r#"lower="-2.5" upper="2.5" effort="900" velocity="2""#),
    shapes: "visual",
    upper_shape: None,
    odd: 1.0,
};

/// Wall, width (y), height (z), length and density of the upper arm.
const UPPER: (f64, f64, f64, f64, f64) = (0.006, 0.14, 0.18, 0.8, 2700.0);

fn upper_mass() -> f64 {
    let (wall, w, h, length, rho) = UPPER;
    rho * length * (w * h - (w - 2.0 * wall) * (h - 2.0 * wall))
}

impl Arm {
    /// Three joints: one about z, then two about y; links along x.
    fn elements(&self, parent: &str) -> String {
        let p = self.prefix;
        let mut t = String::new();
        let (_, w, h, length, _) = UPPER;
        let upper = self.upper_shape.clone().unwrap_or(format!(r#"<box size="{length} {w} {h}"/>"#));
        let at_origin = self.upper_shape.is_some();
        let links = [
            ("turret", 30.0, [0.0, 0.0, 0.2], r#"<cylinder radius="0.15" length="0.4"/>"#.to_owned(), [0.0, 0.0, 0.2]),
            (
                "upper",
                upper_mass(),
                [length / 2.0, 0.0, 0.0],
                upper,
                [if at_origin { 0.0 } else { length / 2.0 }, 0.0, 0.0],
            ),
            ("fore", 6.0, [0.3, 0.0, 0.0], r#"<box size="0.6 0.1 0.1"/>"#.to_owned(), [0.3, 0.0, 0.0]),
        ];
        for (name, mass, com, shape, place) in links {
            write!(t, r#"<link name="{p}{name}">"#).unwrap();
            if self.masses {
                // Inertia of a box of 0.3 m.
                let i = mass * 0.09 / 6.0;
                write!(
                    t,
                    r#"<inertial><origin xyz="{} {} {}"/><mass value="{mass}"/><inertia ixx="{}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>"#,
                    com[0], com[1], com[2], i * self.odd
                )
                .unwrap();
            }
            let [x, y, z] = place;
            let kind = self.shapes;
            write!(t, r#"<{kind}><origin xyz="{x} {y} {z}"/><geometry>{shape}</geometry></{kind}></link>"#).unwrap();
        }
        let joints = [
            ("a1", parent.to_owned(), "turret", "0 0 0.1", "0 0 1"),
            ("a2", format!("{p}turret"), "upper", "0 0 0.4", "0 1 0"),
            ("a3", format!("{p}upper"), "fore", "0.8 0 0", "0 1 0"),
        ];
        for (name, parent, child, xyz, axis) in joints {
            let kind = if self.limit.is_some() { "revolute" } else { "continuous" };
            let limit = self.limit.map_or_else(String::new, |limit| format!("<limit {limit}/>"));
            write!(
                t,
                r#"<joint name="{p}{name}" type="{kind}"><parent link="{parent}"/><child link="{p}{child}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>"#
            )
            .unwrap();
        }
        write!(
            t,
            r#"<link name="{p}tool0"/><joint name="{p}weld" type="fixed"><parent link="{p}fore"/><child link="{p}tool0"/><origin xyz="0.6 0 0"/></joint>"#
        )
        .unwrap();
        t
    }

    fn urdf(&self, more: &str) -> String {
        format!(r#"<robot name="arm"><link name="base"/>{}{more}</robot>"#, self.elements("base"))
    }
}

fn made(folder: &Folder, urdf: &str, options: &NewOptions) -> NewRobot {
    let path = folder.write("urdf/arm.urdf", urdf);
    new_robot(&path, &folder.0.join("far/away/made"), false, options).unwrap()
}

/// Checks requirements on all generated robots; returns the codes of findings except notes.
fn codes(made: &NewRobot) -> Vec<String> {
    let robot = Robot::load(&made.robot).unwrap();
    let motion = Motion::load(&made.motion, &robot).unwrap();
    assert!(motion.violations.is_empty(), "{:?}", motion.violations);
    assert!(made.joints.iter().all(|joint| motion.trajectory.joints().contains(&joint.name)));
    let findings = check(Path::new(&made.robot), None, &flexarm_run::LoadOptions::default());
    let bad: Vec<_> = findings.into_iter().filter(|f| f.severity != flexarm_run::Severity::Note).collect();
    assert!(bad.iter().all(|f| !f.is_error()), "{bad:?}");
    bad.into_iter().map(|f| f.code).collect()
}

/// Truth: the box, its wall and its density, from which the description was made. Bound 1e-3, the
/// precision in the file.
#[test]
fn an_arm_of_known_sections_is_found_with_its_sections_and_is_clean() {
    let folder = Folder::new("known");
    let made = made(&folder, &ARM.urdf(""), &NewOptions::default());
    assert_eq!(codes(&made), [""; 0]);
    assert_eq!((made.base.as_str(), made.tool.as_str()), ("base", "tool0"));
    assert_eq!(made.joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>(), ["a1", "a2", "a3"]);
    let upper = made.links.iter().find(|l| l.name == "upper").unwrap();
    let (wall, w, h, ..) = UPPER;
    let mut sizes = [upper.width.unwrap(), upper.height.unwrap()];
    sizes.sort_by(f64::total_cmp);
    let errors = [sizes[0] / w - 1.0, sizes[1] / h - 1.0, upper.wall.unwrap() / wall - 1.0];
    eprintln!("upper arm: width, height, wall off by {errors:?}, bound 1e-3");
    assert!(errors.iter().all(|e| e.abs() < 1e-3), "{errors:?}");
    assert!(upper.assumed && upper.material == Some("aluminium"));
    let robot = Robot::load(&made.robot).unwrap();
    assert!(robot.flexible_links.iter().any(|link| link.flexible.link == "upper"));
    assert_eq!(robot.drives.len(), 3);
    assert!(made.assumptions.iter().any(|a| a.about == "payload"));
    // The motion covers a good part of the ranges.
    for peak in &made.peaks {
        assert!(peak.upper - peak.lower > 0.5, "{}: {} to {}", peak.joint, peak.lower, peak.upper);
        assert!(peak.speed.abs() <= 0.61 * 2.0 && peak.torque.unwrap().abs() <= 900.0);
    }
}

/// Truth: weight times lever of the outstretched arm, by hand: 9.81 (m2 0.4 + m3 1.1 + p 1.4).
#[test]
fn the_torque_of_weight_is_that_of_the_stretched_arm() {
    let folder = Folder::new("torque");
    let options = NewOptions { payload_kg: Some(10.0), ..NewOptions::default() };
    let made = made(&folder, &ARM.urdf(""), &options);
    let truth = 9.81 * (upper_mass() * 0.4 + 6.0 * 1.1 + 10.0 * 1.4);
    let found = made.joints[1].weight_torque;
    eprintln!("a2: {found:.2} N m over the poses, {truth:.2} N m stretched");
    assert!(found <= truth * (1.0 + 1e-9) && found > 0.97 * truth);
    assert!(!made.payload.assumed && made.payload.mass == 10.0);
    assert!(made.joints[1].effort_fault.is_none());
}

#[test]
fn a_copied_folder_has_its_meshes_and_can_be_moved() {
    let folder = Folder::new("copied");
    // A box as ASCII STL; two links share the file name in different folders.
    let stl = |[x, y, z]: [f64; 3]| {
        let corner = |k: usize| {
            let side = |bit: usize, size: f64| if k >> bit & 1 == 1 { size } else { -size };
            [if k & 1 == 1 { x } else { 0.0 }, side(1, y / 2.0), side(2, z / 2.0)]
        };
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let mut text = "solid box\n".to_owned();
        for [a, b, c, d] in faces {
            for triangle in [[a, b, c], [a, c, d]] {
                text += "facet normal 0 0 0\nouter loop\n";
                for [x, y, z] in triangle.map(corner) {
                    text += &format!("vertex {x} {y} {z}\n");
                }
                text += "endloop\nendfacet\n";
            }
        }
        text + "endsolid box\n"
    };
    let (_, w, h, length, _) = UPPER;
    folder.write("meshes/visual/link.stl", stl([length, w, h]));
    folder.write("meshes/other/link.stl", stl([0.1, 0.1, 0.1]));
    let upper = Some(r#"<mesh filename="../meshes/visual/link.stl"/>"#.to_owned());
    let hand = r#"<link name="cam"><visual><geometry><mesh filename='../meshes/other/link.stl'/></geometry></visual></link>
        <joint name="cam_weld" type="fixed"><parent link="turret"/><child link="cam"/></joint>"#;
    let made = made(&folder, &Arm { upper_shape: upper, ..ARM }.urdf(hand), &NewOptions::default());
    assert_eq!(codes(&made), [""; 0]);
    assert!(made.placed.contains("copied"), "{}", made.placed);
    assert!(made.links.iter().any(|l| l.name == "upper" && l.section == Some("box")), "{:?}", made.links);
    std::fs::remove_dir_all(folder.0.join("urdf")).unwrap();
    std::fs::remove_dir_all(folder.0.join("meshes")).unwrap();
    let moved = folder.0.join("moved");
    std::fs::rename(folder.0.join("far/away/made"), &moved).unwrap();
    let robot = Robot::load(&moved).unwrap();
    assert!(robot.urdf.warnings_only().next().is_none(), "{:?}", robot.urdf.warnings);
    assert!(Motion::load(moved.join("motion.toml"), &robot).is_ok());
}

#[test]
fn a_description_beside_the_new_folder_is_referred_to_with_its_arguments() {
    let folder = Folder::new("beside");
    let arm = Arm { limit: Some(r#"lower="-2" upper="2" effort="900" velocity="${speed}""#), ..ARM };
    let text = arm.urdf("").replacen(
        r#"<robot name="arm">"#,
        r#"<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="size" default=""/><xacro:property name="speed" value="$(arg size)"/>"#,
        1,
    );
    let path = folder.write("urdf/arm.urdf.xacro", text);
    let mut options = NewOptions::default();
    options.urdf.arguments = vec![("size".into(), "1.5".into())];
    let made = new_robot(&path, &folder.0.join("made"), false, &options).unwrap();
    assert_eq!(codes(&made), [""; 0]);
    assert!(made.urdf.ends_with("made/../urdf/arm.urdf.xacro"), "{}", made.urdf);
    assert!(made.joints.iter().all(|j| j.velocity == Some(1.5)));
    let again = new_robot(&path, &folder.0.join("made"), false, &options).unwrap_err();
    assert!(matches!(again, Error::Taken { .. }), "{again}");
    assert!(new_robot(&path, &folder.0.join("made"), true, &options).is_ok());
}

#[test]
fn an_arm_without_any_mass_is_refused_until_its_mass_is_given() {
    let folder = Folder::new("massless");
    let urdf = Arm { masses: false, ..ARM }.urdf("");
    let path = folder.write("urdf/arm.urdf", &urdf);
    let error = new_robot(&path, &folder.0.join("made"), false, &NewOptions::default()).unwrap_err();
    assert!(error.to_string().contains("no link of the arm has a mass"), "{error}");
    assert!(!folder.0.join("made").exists());
    let mut options = NewOptions::default();
    options.urdf.inertia_from_mesh = Some(InertiaEstimate::TotalMass(60.0));
    let made = made(&folder, &urdf, &options);
    let found = codes(&made);
    assert!(found.iter().all(|code| code == "estimated-inertia"), "{found:?}");
    assert!((made.moving_mass_kg / 60.0 - 1.0).abs() < 1e-9, "{}", made.moving_mass_kg);
    assert!(made.assumptions.iter().any(|a| a.about == "masses" && a.text.contains("60 kg in total")));
}

/// Five links in a row with the same mass (kg), with or without shapes.
fn equal_masses(mass: f64, lengths: [f64; 5], shapes: bool) -> String {
    let mut t = r#"<robot name="row"><link name="base"/>"#.to_owned();
    let mut before = ("base".to_owned(), 0.1);
    for (k, length) in lengths.into_iter().enumerate() {
        let shape = format!(
            r#"<visual><origin xyz="{} 0 0"/><geometry><box size="{length} 0.1 0.1"/></geometry></visual>"#,
            length / 2.0
        );
        let shape = if shapes { shape } else { String::new() };
        let axis = if k == 0 { "0 0 1" } else { "0 1 0" };
        let (parent, at) = before;
        write!(
            t,
            r#"<link name="l{k}"><inertial><mass value="{mass}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>{shape}</link>
            <joint name="j{k}" type="revolute"><parent link="{parent}"/><child link="l{k}"/><origin xyz="{at} 0 0"/><axis xyz="{axis}"/>
            <limit lower="-2" upper="2" effort="900" velocity="2"/></joint>"#
        )
        .unwrap();
        before = (format!("l{k}"), length);
    }
    let (parent, at) = before;
    t + &format!(
        r#"<link name="tool0"/><joint name="weld" type="fixed"><parent link="{parent}"/><child link="tool0"/><origin xyz="{at} 0 0"/></joint></robot>"#
    )
}

/// Truth: the share of each link in the volume of all boxes of one section, or in the length of all
/// links including the base's 0.1 m: its length over theirs.
#[test]
fn one_mass_for_all_links_is_told_and_a_total_mass_is_spread_by_volume_or_length() {
    let lengths = [0.2, 0.6, 0.5, 0.3, 0.1];
    for shapes in [true, false] {
        let folder = Folder::new(&format!("placeholder-{shapes}"));
        let urdf = equal_masses(2.0, lengths, shapes);
        let told = made(&folder, &urdf, &NewOptions::default());
        let finding = told.assumptions.iter().find(|a| a.about == "masses").unwrap();
        assert!(finding.text.contains("5 links have 2 kg each"), "{}", finding.text);
        assert!(finding.mend.contains("inertia_from_total_mass"), "{}", finding.mend);
        let mut options = NewOptions::default();
        options.urdf.inertia_from_mesh = Some(InertiaEstimate::TotalMass(34.0));
        let folder = Folder::new(&format!("spread-{shapes}"));
        let made = made(&folder, &urdf, &options);
        let robot = Robot::load(&made.robot).unwrap();
        let base = if shapes { 0.0 } else { 0.1 };
        let all: f64 = lengths.iter().sum::<f64>() + base;
        for (k, length) in lengths.iter().enumerate() {
            let mass = robot.urdf.mechanism.link(&format!("l{k}")).unwrap().inertia.unwrap().mass;
            let error = mass / (34.0 * length / all) - 1.0;
            eprintln!("link {k}, shapes {shapes}: mass off by {error:.1e}, bound 1e-9");
            assert!(error.abs() < 1e-9, "link {k}: {error:.1e}");
        }
    }
    let own = made(&Folder::new("own-masses"), &ARM.urdf(""), &NewOptions::default());
    assert!(own.assumptions.iter().all(|a| a.about != "masses"));
}

#[test]
fn a_payload_of_nothing_needs_no_centre_of_mass_and_another_one_does() {
    let folder = Folder::new("nothing");
    let made = made(&folder, &ARM.urdf(""), &NewOptions { payload_kg: Some(0.0), ..NewOptions::default() });
    let text = std::fs::read_to_string(&made.robot).unwrap();
    let with = |mass: &str| {
        let payload = format!("format = 1\npayload = {{ link = \"tool0\", mass = {mass} }}");
        std::fs::write(&made.robot, text.replacen("format = 1", &payload, 1)).unwrap();
        Robot::load(&made.robot).map(drop)
    };
    with("0").unwrap();
    let error = with("2.0").unwrap_err().to_string();
    assert!(error.contains("robot.toml:4:11: payload has no com"), "{error}");
}

/// Truth: the upper arm with its original frames; the wall of the box is identified again if both
/// its frames are at its far end and the first joint turns about it. Bound 1e-3, the precision in
/// the file.
#[test]
fn a_link_whose_frames_sit_at_its_far_end_bends_as_the_same_link_with_frames_at_both_ends() {
    let (wall, w, h, length, _) = UPPER;
    let folder = Folder::new("far-frames");
    let box_at = |x: f64| {
        format!(r#"<visual><origin xyz="{x} 0 0"/><geometry><box size="{length} {w} {h}"/></geometry></visual>"#)
    };
    let plain = ARM.urdf("");
    // The frame of the upper arm moves to its far end, and its joint turns about the arm.
    let moved = plain
        .replace(
            r#"<origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>"#,
            &format!(r#"<origin xyz="{length} 0 0.4"/><axis xyz="1 0 0"/>"#),
        )
        .replace(&box_at(length / 2.0), &box_at(-length / 2.0))
        .replace(
            &format!(r#"<origin xyz="{} 0 0"/><mass"#, length / 2.0),
            &format!(r#"<origin xyz="{} 0 0"/><mass"#, -length / 2.0),
        )
        .replace(r#"<origin xyz="0.8 0 0"/><axis"#, r#"<origin xyz="0 0 0"/><axis"#);
    assert_ne!(moved, plain);
    let made = made(&folder, &moved, &NewOptions::default());
    let upper = made.links.iter().find(|l| l.name == "upper").unwrap();
    let [from, to] = upper.ends.expect("ends of its own");
    let mut sizes = [upper.width.unwrap(), upper.height.unwrap()];
    sizes.sort_by(f64::total_cmp);
    let errors = [
        sizes[0] / w - 1.0,
        sizes[1] / h - 1.0,
        upper.wall.unwrap() / wall - 1.0,
        upper.length / length - 1.0,
        from[0] + length,
        to[0],
    ];
    eprintln!("width, height, wall, length, ends off by {errors:?}, bound 1e-3");
    assert!(errors.iter().all(|e| e.abs() < 1e-3), "{errors:?} {upper:?}");
    let robot = Robot::load(&made.robot).unwrap();
    assert!(robot.flexible_links.iter().any(|link| link.flexible.link == "upper"));
    assert_eq!(codes(&made), [""; 0]);
}

#[test]
fn fingers_are_held_and_of_two_arms_one_moves() {
    let folder = Folder::new("hands");
    let fingers = r#"
        <link name="left_finger"/><link name="right_finger"/>
        <joint name="left" type="prismatic"><parent link="tool0"/><child link="left_finger"/><axis xyz="0 1 0"/>
          <limit lower="0.01" upper="0.04" effort="20" velocity="0.2"/></joint>
        <joint name="right" type="prismatic"><parent link="tool0"/><child link="right_finger"/><axis xyz="0 -1 0"/>
          <limit lower="0.01" upper="0.04" effort="20" velocity="0.2"/><mimic joint="left"/></joint>"#;
    let with_hand = made(&folder, &ARM.urdf(fingers), &NewOptions::default());
    let found = codes(&with_hand);
    assert!(found.iter().all(|code| code == "missing-inertial"), "{found:?}");
    assert_eq!(with_hand.joints.len(), 3);
    let held: Vec<_> = with_hand.held.iter().map(|h| (h.joint.as_str(), h.at)).collect();
    assert_eq!(held, [("left", 0.01)]);
    let folder = Folder::new("two-arms");
    let other = Arm { prefix: "right_", ..ARM }.elements("base");
    let two = made(&folder, &Arm { prefix: "left_", ..ARM }.urdf(&other), &NewOptions::default());
    assert_eq!(codes(&two), [""; 0]);
    assert_eq!((two.tool.as_str(), two.held.len()), ("left_tool0", 3));
    assert!(two.assumptions[0].text.contains("right_tool0"), "{:?}", two.assumptions[0]);
    // The mass of the other arm is not part of the moving mass.
    assert!((two.moving_mass_kg / (36.0 + upper_mass()) - 1.0).abs() < 1e-9);
}

/// Limits of acceleration and jerk of a URDF 1.2, as of the UR5e of `airo-models`.
#[test]
fn the_sample_motion_keeps_limits_of_acceleration_and_jerk() {
    for more in ["", r#" acceleration="2.5""#, r#" acceleration="2.5" jerk="8""#, r#" acceleration="0.3" jerk="0.5""#] {
        let folder = Folder::new(&format!("acceleration-{}", more.len()));
        let limit = format!(r#"lower="-3" upper="3" effort="1500" velocity="3"{more}"#);
        let urdf = Arm { limit: Some("LIMIT"), ..ARM }.urdf("").replace("LIMIT", &limit);
        let urdf = urdf.replace(r#"<robot name="arm""#, r#"<robot name="arm" version="1.2""#);
        let made = made(&folder, &urdf, &NewOptions::default());
        // `codes` finds violations of the motion.
        let found = codes(&made);
        let of_motion = ["trajectory", "joint-limit", "short-duration", "motion-limits"];
        assert!(!found.iter().any(|code| of_motion.contains(&&**code)), "{more}: {found:?}");
    }
}

#[test]
fn missing_and_senseless_limits_are_told_and_the_motion_keeps_what_it_can() {
    let limits: [(&str, Option<&'static str>, &str); 6] = [
        ("none", None, "is missing"),
        ("zeros", Some(r#"lower="-3" upper="3" effort="0" velocity="0""#), "is missing"),
        ("endless", Some(r#"lower="-3" upper="3" effort="1e30" velocity="2""#), "is far above"),
        (
            "one for all",
            Some(r#"lower="-3" upper="3" effort="2000" velocity="2""#),
            "is the same for all joints and far",
        ),
        ("huge", Some(r#"lower="-3" upper="3" effort="1000000" velocity="2""#), "is far above"),
        ("weak", Some(r#"lower="-3" upper="3" effort="20" velocity="2""#), "is the same for all joints and below"),
    ];
    for (name, limit, fault) in limits {
        let folder = Folder::new(&format!("limits-{name}"));
        let made = made(&folder, &Arm { limit, ..ARM }.urdf(""), &NewOptions::default());
        let found = codes(&made);
        // The proposal is not checked against meaningless limits.
        assert_eq!(found, [""; 0], "{name}");
        let first = Robot::load(&made.robot).unwrap().rigid_model().unwrap().coordinates()[1].limits.effort;
        assert_eq!(first, f64::INFINITY, "{name}");
        assert!(made.joints[1].effort_fault.unwrap().starts_with(fault), "{name}: {:?}", made.joints[1]);
        let speeds = made.assumptions.iter().filter(|a| a.text.contains("speed limit")).count();
        assert_eq!(speeds, if matches!(name, "none" | "zeros") { 3 } else { 0 }, "{name}");
        // The class of the reducers is derived from the weight, not from the limit.
        let drive = &made.drives[1];
        assert!((1e4..1e7).contains(&drive.stiffness) && drive.low < drive.stiffness && drive.stiffness < drive.high);
    }
}

#[test]
fn shapes_for_collisions_serve_where_there_are_no_others() {
    let folder = Folder::new("collisions");
    let made = made(&folder, &Arm { shapes: "collision", ..ARM }.urdf(""), &NewOptions::default());
    assert_eq!(codes(&made), [""; 0]);
    assert!(made.links.iter().any(|l| l.name == "upper" && l.section == Some("box")), "{:?}", made.links);
    let text = std::fs::read_to_string(&made.robot).unwrap();
    assert!(text.contains("collision geometry"));
    let folder = Folder::new("no-shapes");
    let bare = ARM.urdf("").replace("visual", "sensor");
    let bare = self::made(&folder, &bare, &NewOptions::default());
    assert_eq!(codes(&bare), [""; 0]);
    assert!(
        bare.links
            .iter()
            .all(|l| l.reason.as_ref().is_some_and(|r| r.contains("no readable geometry") || r.contains("short")))
    );
}

#[test]
fn inertias_that_no_body_has_are_taken_as_they_are_and_told() {
    let folder = Folder::new("odd");
    let made = made(&folder, &Arm { odd: 2.5, ..ARM }.urdf(""), &NewOptions::default());
    codes(&made);
    assert!(made.assumptions.iter().any(|a| a.text.contains("physically impossible")), "{:?}", made.assumptions);
    assert!(std::fs::read_to_string(&made.robot).unwrap().contains("waive_inertia = ["));
}

#[test]
fn names_with_any_letters_come_through_every_file() {
    let folder = Folder::new("names");
    let odd = "a\\ &quot;1&apos; #]= ü\u{7f}";
    let urdf = ARM
        .urdf("")
        .replace("\"a2\"", &format!("\"{odd}\""))
        .replace("upper", "up [x]\"".replace('"', "&quot;").as_str());
    let urdf = urdf.replace("robot name=\"arm\"", "robot name=\"= #1 &quot;arm&quot;\"");
    // The attribute of <limit> contains a word that was replaced.
    let urdf = urdf.replace("up [x]&quot;=", "upper=");
    let made = made(&folder, &urdf, &NewOptions::default());
    assert_eq!(codes(&made), [""; 0]);
    assert_eq!(made.joints[1].name, "a\\ \"1' #]= ü\u{7f}");
    assert!(made.links.iter().any(|l| l.name == "up [x]\""));
}

#[test]
fn what_is_no_robot_description_is_named_with_what_to_do() {
    let folder = Folder::new("others");
    let cases = [
        ("a.sdf", "<?xml version=\"1.0\"?><sdf version=\"1.7\"><model name=\"m\"/></sdf>", "an SDF file"),
        ("a.xml", "<mujoco model=\"m\"><worldbody/></mujoco>", "an MJCF file"),
        ("a.usda", "#usda 1.0\ndef Xform \"robot\" {}", "a USD file"),
        ("a.usd", "PXR-USDC\0\0\0", "a USD file"),
        ("robot.toml", "format = 1", "already a robot file"),
        ("a.stl", "solid x\nendsolid x", "a mesh"),
    ];
    for (name, text, what) in cases {
        let path = folder.write(name, text);
        let error = new_robot(&path, &folder.0.join("made"), false, &NewOptions::default()).unwrap_err();
        assert!(error.to_string().contains("a URDF or xacro file is required"), "{name}: {error}");
        assert!(error.to_string().contains(what), "{name}: {error}");
    }
    let of = |text: &str, options: NewOptions| {
        let path = folder.write("x.urdf", text);
        new_robot(&path, &folder.0.join("made"), false, &options).unwrap_err()
    };
    let still = ARM.urdf("").replace("revolute", "fixed");
    let error = of(&still, NewOptions::default());
    assert!(error.to_string().contains("has no joint that moves"), "{error}");
    let error = of(&ARM.urdf(""), NewOptions { tool: Some("tool1".into()), ..NewOptions::default() });
    assert!(error.to_string().contains("did you mean \"tool0\"?"), "{error}");
    let error = of(&ARM.urdf(""), NewOptions { joints: Some(vec!["a2".into(), "a9".into()]), ..NewOptions::default() });
    assert!(error.to_string().contains("that moves independently"), "{error}");
    let error = of(&ARM.urdf(""), NewOptions { payload_kg: Some(-1.0), ..NewOptions::default() });
    assert!(error.to_string().contains("expected a mass in kg"), "{error}");
    let error = new_robot(&folder.0, &folder.0.join("made"), false, &NewOptions::default()).unwrap_err();
    assert!(error.to_string().contains("a folder"), "{error}");
    assert!(!folder.0.join("made").exists());
}

#[test]
fn a_tool_on_the_axis_of_the_only_joint_gets_a_motion_that_moves_and_a_note() {
    let folder = Folder::new("on_axis");
    let urdf = r#"<robot name="turret"><link name="base"/><link name="table">
        <inertial><mass value="20"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><link name="tool0"/>
        <joint name="slew" type="revolute"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/>
        <limit lower="-2" upper="2" effort="500" velocity="2"/></joint>
        <joint name="weld" type="fixed"><parent link="table"/><child link="tool0"/><origin xyz="0 0 0.5"/></joint></robot>"#;
    let made = made(&folder, urdf, &NewOptions::default());
    let peak = &made.peaks[0];
    assert!(peak.upper - peak.lower > 0.5, "{} to {}", peak.lower, peak.upper);
    assert!(made.assumptions.iter().any(|a| a.text.contains("turns in place")), "{:?}", made.assumptions);
}

/// Truth: the description. The centre of mass of the upper arm is near its first joint, where two
/// parts of positive mass at the middles of its halves cannot have it.
#[test]
fn a_link_that_is_heavy_at_one_end_keeps_its_body() {
    let folder = Folder::new("heavy");
    let at = upper_mass();
    let urdf = ARM.urdf("").replace(
        &format!(r#"<origin xyz="0.4 0 0"/><mass value="{at}"/>"#),
        &format!(r#"<origin xyz="0.05 0.01 0"/><mass value="{at}"/>"#),
    );
    assert!(urdf.contains("0.05 0.01 0"));
    let made = made(&folder, &urdf, &NewOptions { payload_kg: Some(0.0), ..NewOptions::default() });
    assert!(!codes(&made).iter().any(|code| code == "uniform-mass"));
    let robot = Robot::load(&made.robot).unwrap();
    let arm = robot.model(&flexarm_run::Modelling::default()).unwrap();
    let (rigid, flexible) = (&arm.rigid, &arm.model);
    let torque = |model: &flexarm_kinematics::Model| {
        let q = nalgebra::DVector::from_fn(model.nv(), |k, _| if k < 3 { 0.1 * k as f64 } else { 0.0 });
        flexarm_kinematics::gravity_forces(model, &mut flexarm_kinematics::Data::new(model), &q)[1]
    };
    let (own, parts) = (torque(rigid), torque(flexible));
    assert!((parts / own - 1.0).abs() < 1e-12, "{own} {parts}");
    assert!(arm.spans.iter().any(|span| span.link == "upper"));
}
