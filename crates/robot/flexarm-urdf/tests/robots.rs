//! Results for valid URDFs: frames, inertias, limits, mimic joints, shapes.

use crate::common::{INERTIAL, TestFolder, hinge, link, robot, with_joint};
use approx::assert_relative_eq;
use flexarm_kinematics::JointKind;
use flexarm_settings::{Finding, Severity};
use flexarm_urdf::{
    Geometry, InertiaEstimate, ReadOptions, UrdfRobot, check_urdf_text, default_tcp, parse_urdf, read_urdf,
};
use nalgebra::{Matrix3, Vector3, vector};

#[track_caller]
fn read(text: &str) -> UrdfRobot {
    parse_urdf(text, "robot.urdf", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn codes(findings: &[Finding]) -> Vec<(Severity, &'static str)> {
    // Tests compare with literals.
    findings.iter().map(|f| (f.severity, &*f.code.clone().leak())).collect()
}

/// The shoulder of a KUKA KR 210 R2700-2 (kroshu/kuka_robot_descriptions, Apache-2.0): principal
/// moments, here with an inertial frame rotated by a yaw.
fn kuka_link(rpy: [f64; 3]) -> String {
    let [r, p, y] = rpy;
    format!(
        "<link name=\"arm\"><inertial><origin xyz=\"0.1 -0.2 0.3\" rpy=\"{r} {p} {y}\"/><mass value=\"363.07\"/>\
         <inertia ixx=\"13.209\" iyy=\"31.495\" izz=\"33.884\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n"
    )
}

fn inertia_of(rpy: [f64; 3]) -> Matrix3<f64> {
    let text = robot(&[&link("base"), &kuka_link(rpy), &hinge("j", "base", "arm")]);
    let inertia = read(&text).mechanism.link("arm").unwrap().inertia.unwrap();
    assert_eq!(inertia.com, vector![0.1, -0.2, 0.3]);
    assert_eq!(inertia.mass, 363.07);
    inertia.inertia_com
}

/// Closed form for one angle: Ixx = Ix c² + Iy s², Iyy = Ix s² + Iy c², Ixy = (Ix - Iy) s c.
#[test]
fn principal_moments_are_turned_by_the_inertial_yaw() {
    let (s, c) = 0.3f64.sin_cos();
    let (Ix, Iy, Iz) = (13.209, 31.495, 33.884);
    let off = (Ix - Iy) * s * c;
    let expected = Matrix3::new(Ix * c * c + Iy * s * s, off, 0.0, off, Ix * s * s + Iy * c * c, 0.0, 0.0, 0.0, Iz);
    // measured 4e-15
    assert_relative_eq!(inertia_of([0.0, 0.0, 0.3]), expected, epsilon = 1e-12);
    assert_relative_eq!(inertia_of([0.0; 3]), Matrix3::from_diagonal(&vector![Ix, Iy, Iz]), epsilon = 1e-12);
}

/// Closed form for three angles: R as the explicit product Rz(yaw) Ry(pitch) Rx(roll), about the
/// fixed axes of URDF.
#[test]
fn three_angles_turn_about_fixed_axes_in_the_order_roll_pitch_yaw() {
    let [r, p, y] = [0.4, -1.1, 2.3];
    let ((sr, cr), (sp, cp), (sy, cy)) = (f64::sin_cos(r), f64::sin_cos(p), f64::sin_cos(y));
    let R_LI = Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    );
    let principal = Matrix3::from_diagonal(&vector![13.209, 31.495, 33.884]);
    // measured 7e-15
    assert_relative_eq!(inertia_of([r, p, y]), R_LI * principal * R_LI.transpose(), epsilon = 1e-12);

    let joint = hinge("j", "base", "arm").replace("<axis", &format!("<origin xyz='1 2 3' rpy='{r} {p} {y}'/><axis"));
    let X_PJ = read(&with_joint(&joint)).mechanism.joints[0].X_PJ;
    assert_relative_eq!(*X_PJ.rotation.matrix(), R_LI, epsilon = 1e-14);
    assert_eq!(X_PJ.translation.vector, vector![1.0, 2.0, 3.0]);
}

const ARM: &str = r#"<?xml version="1.0"?>
<!-- two fingers, one of which follows -->
<robot name="gripper">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <joint name="right" type="prismatic">
    <origin xyz="0 -0.05 0.1" rpy="0 0 3.141592653589793"/><parent link="hand"/><child link="right_finger"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.1"/>
    <mimic joint="left" multiplier="-0.5" offset="0.01"/><dynamics damping="1.5" friction="0.2"/>
  </joint>
  <joint name="left" type="prismatic">
    <origin xyz="0 0.05 0.1"/><parent link="hand"/><child link="left_finger"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="0" velocity="0"/>
  </joint>
  <joint name="turn" type="continuous"><parent link="base_link"/><child link="hand"/><axis xyz="0 0 2"/></joint>
  <joint name="tip" type="fixed"><parent link="hand"/><child link="tool0"/><origin xyz="0 0 0.2"/></joint>
  <joint name="bend" type="revolute"><parent link="hand"/><child link="lid"/><axis xyz="0.7071 0.7071 0"/>
    <limit lower="-1.5" upper="1.25" effort="7290" velocity="2.5"/></joint>
  <link name="base_link"/>
  <link name="hand">INERTIAL
    <visual name="palm"><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry><material name="grey"/></visual>
    <visual><geometry><cylinder radius="0.1" length="0.2"/></geometry><material name="own"><color rgba="1 0 0 0.5"/></material></visual>
    <collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <link name="left_finger">INERTIAL<visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <link name="right_finger">INERTIAL</link>
  <link name="lid">INERTIAL</link>
  <link name="tool0"/>
  <transmission name="t"><type>simple</type><joint name="turn"/><actuator name="m"><mechanicalReduction>-105</mechanicalReduction></actuator></transmission>
  <gazebo reference="hand"><anything/></gazebo>
</robot>"#;

fn arm() -> String {
    ARM.replace("INERTIAL", INERTIAL)
}

#[test]
fn a_branched_arm_keeps_its_frames_limits_and_followers() {
    let robot = read(&arm());
    let m = &robot.mechanism;
    let names: Vec<_> = m.links.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["base_link", "hand", "left_finger", "right_finger", "lid", "tool0"]);
    assert_eq!(m.link("tool0").unwrap().inertia, None);
    assert_eq!(default_tcp(m), Some("tool0"));
    assert_eq!(robot.tcp_candidates, ["tool0", "left_finger", "right_finger", "lid"]);

    let right = m.joint("right").unwrap();
    let mimic = right.mimic.as_ref().unwrap();
    assert_eq!((mimic.joint.as_str(), mimic.ratio, mimic.offset), ("left", -0.5, 0.01));
    assert_eq!(right.kind, JointKind::Prismatic(Vector3::y_axis()));
    assert_eq!((right.limits.lower, right.limits.upper, right.limits.effort), (0.0, 0.04, 20.0));
    let left = m.joint("left").unwrap();
    assert_eq!((left.limits.effort, left.limits.velocity), (f64::INFINITY, f64::INFINITY));
    assert_eq!(m.joint("turn").unwrap().kind, JointKind::Continuous(Vector3::z_axis()));
    assert_eq!(m.joint("turn").unwrap().limits.lower, f64::NEG_INFINITY);
    assert_eq!(m.joint("tip").unwrap().kind, JointKind::Fixed);
    let JointKind::Revolute(axis) = m.joint("bend").unwrap().kind else { panic!() };
    assert_relative_eq!(axis.norm(), 1.0, epsilon = 1e-15);

    let dynamics = &robot.dynamics;
    assert_eq!(dynamics.len(), 4);
    assert_eq!((dynamics[0].joint.as_str(), dynamics[0].damping, dynamics[0].friction), ("right", 1.5, 0.2));
    assert_eq!(robot.transmissions[0].joints, ["turn"]);
    assert_eq!(robot.transmissions[0].reduction, Some(-105.0));
    assert_eq!(robot.text, arm());
    assert_eq!(
        codes(&robot.warnings),
        [
            (Severity::Note, "unknown-effort"),
            (Severity::Note, "unknown-velocity"),
            (Severity::Warning, "axis-not-unit")
        ]
    );
    assert_eq!(robot.warnings[0].location, "robot.urdf:12:24");
}

/// Closed form: c = 2 b + 1 and b = -3 a + 0.5 give c = -6 a + 2.
#[test]
fn a_follower_of_a_follower_follows_the_first() {
    let follower = |name: &str, child: &str, mimic: &str| {
        hinge(name, "base", child).replace("</joint>", &format!("<mimic {mimic}/></joint>"))
    };
    let c = follower("c", "l3", "joint='b' multiplier='2' offset='1'");
    let b = follower("b", "l2", "joint='a' multiplier='-3' offset='0.5'");
    let a = hinge("a", "base", "l1");
    let mechanism = read(&robot(&[&link("base"), &link("l1"), &link("l2"), &link("l3"), &c, &b, &a])).mechanism;
    let mimic = mechanism.joint("c").unwrap().mimic.clone().unwrap();
    assert_eq!((mimic.joint.as_str(), mimic.ratio, mimic.offset), ("a", -6.0, 2.0));
}

#[test]
fn visuals_have_pose_shape_and_colour() {
    let visuals = read(&arm()).visuals;
    assert_eq!(visuals.len(), 3);
    assert_eq!((visuals[0].link.as_str(), visuals[0].name.as_deref()), ("hand", Some("palm")));
    assert_eq!(visuals[0].X_LV.translation.vector, vector![0.0, 0.0, 0.05]);
    assert_eq!(visuals[0].geometry, Geometry::Box { size: vector![0.2, 0.2, 0.1] });
    assert_eq!(visuals[0].color, Some([0.5, 0.5, 0.5, 1.0]));
    assert_eq!(visuals[1].color, Some([1.0, 0.0, 0.0, 0.5]));
    assert_eq!(visuals[2].color, None);
    assert!(visuals.iter().all(|v| !v.geometry.triangles().unwrap().triangles.is_empty()));
}

/// Truth: values that `urdf_rs` reads from the file itself. The reader passes it a text generated
/// from the file.
#[test]
fn the_numbers_are_those_that_urdf_rs_reads() {
    let text = arm();
    let (ours, theirs) = (read(&text).mechanism, urdf_rs::read_from_string(&text).unwrap());
    for (a, b) in ours.links.iter().zip(&theirs.links) {
        assert_eq!(a.name, b.name);
        assert_eq!(a.inertia.map_or(0.0, |i| i.mass), b.inertial.mass.value);
    }
    for (a, b) in ours.joints.iter().zip(&theirs.joints) {
        assert_eq!((&a.name, &a.parent, &a.child), (&b.name, &b.parent.link, &b.child.link));
        assert_eq!(a.X_PJ.translation.vector, Vector3::from(*b.origin.xyz));
        let (roll, pitch, yaw) = a.X_PJ.rotation.euler_angles();
        assert_relative_eq!(vector![roll, pitch, yaw], Vector3::from(*b.origin.rpy), epsilon = 1e-15);
        if let JointKind::Revolute(_) | JointKind::Prismatic(_) = a.kind {
            assert_eq!((a.limits.lower, a.limits.upper), (b.limit.lower, b.limit.upper));
        }
        let mimic = a.mimic.as_ref().map(|m| (Some(m.ratio), Some(m.offset)));
        assert_eq!(mimic, b.mimic.as_ref().map(|m| (m.multiplier, m.offset)));
    }
}

#[test]
fn slips_that_leave_a_robot_are_warned_of() {
    let text = robot(&[
        &link("base"),
        "<link name='arm'>\n<inertal/>",
        INERTIAL,
        INERTIAL,
        "<visual><geometry><cone radius='1' length='1'/></geometry></visual>\n",
        "<visual><geometry><sphere radius='0'/></geometry></visual></link>\n",
        "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/><limit effort='1' velocity='1'/></joint>",
    ]);
    let findings = check_urdf_text(&text, "robot.urdf", &ReadOptions::default());
    let found = codes(&findings);
    for code in ["unknown-element", "second-inertial", "unknown-shape", "empty-shape", "no-range"] {
        assert!(found.contains(&(Severity::Warning, code)), "{code}: {found:?}");
    }
    assert!(found.contains(&(Severity::Note, "default-axis")));
    assert_eq!(findings.iter().find(|f| f.code == "unknown-element").unwrap().help, "did you mean <inertial>?");
}

/// Truth: the same description without the elements and attributes of the prefix.
#[test]
fn what_has_an_undeclared_prefix_is_ignored_with_a_warning() {
    let body = |own: &str, attribute: &str| {
        robot(&[
            &link("base"),
            &format!("<link name='arm'{attribute}>{INERTIAL}{own}</link>\n"),
            "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/></joint>",
        ])
    };
    let text = body("<!-- <other:x/> --><drake:proximity/>", " drake:acceleration='1' gz:x='drake:y'");
    let read = parse_urdf(&text, "robot.urdf", &ReadOptions::default()).unwrap();
    let plain = parse_urdf(&body("", ""), "robot.urdf", &ReadOptions::default()).unwrap();
    assert_eq!(read.mechanism, plain.mechanism);
    let warned: Vec<&str> = (read.warnings.iter().filter(|f| f.code == "undeclared-prefix"))
        .map(|f| f.message.split('"').nth(1).unwrap())
        .collect();
    assert_eq!(warned, ["drake", "gz"]);
}

#[test]
fn newer_urdf_has_quaternions_and_open_limits() {
    let joint = "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>\
                 <origin quat_xyzw='0 0 1 1'/><limit effort='1' velocity='1'/></joint>";
    let text = with_joint(joint).replace("name=\"r\"", "name=\"r\" version=\"1.2\"");
    let joint = read(&text).mechanism.joints.remove(0);
    assert_eq!((joint.limits.lower, joint.limits.upper), (f64::NEG_INFINITY, f64::INFINITY));
    assert_relative_eq!(joint.X_PJ.rotation * Vector3::x(), Vector3::y(), epsilon = 1e-15);
}

/// Truth: the attributes as written; without a deceleration the acceleration holds for both.
#[test]
fn bounds_of_acceleration_and_jerk_are_read_and_checked() {
    let joint = |limit: &str| {
        with_joint(&format!(
            "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>\n\
             <limit lower='-1' upper='1' effort='1' velocity='1' {limit}/></joint>"
        ))
    };
    let limits = |limit: &str| {
        let limits = read(&joint(limit)).mechanism.joints[0].limits;
        (limits.acceleration, limits.jerk)
    };
    assert_eq!(limits(""), (f64::INFINITY, f64::INFINITY));
    assert_eq!(limits("acceleration='4'"), (4.0, f64::INFINITY));
    assert_eq!(limits("acceleration='4' deceleration='3' jerk='50'"), (3.0, 50.0));
    assert_eq!(limits("deceleration='3'"), (3.0, f64::INFINITY));
    assert_eq!(limits("acceleration='0'"), (f64::INFINITY, f64::INFINITY), "0 is unknown, as for effort");
    let codes = |limit: &str| codes(&check_urdf_text(&joint(limit), "robot.urdf", &ReadOptions::default()));
    assert_eq!(codes("acceleration='4' deceleration='4' jerk='50'"), codes(""));
    assert!(codes("acceleration='4' deceleration='3'").contains(&(Severity::Note, "one-acceleration")));
    assert!(codes("acceleration='-4'").contains(&(Severity::Error, "negative-limit")));
    assert!(codes("jerk='fast'").contains(&(Severity::Error, "not-a-number")));
    assert!(codes("accelaration='4'").contains(&(Severity::Warning, "unknown-attribute")));
}

#[test]
fn a_quaternion_before_urdf_1_1_is_not_ignored_in_silence() {
    let joint = "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/>\
                 <origin quat_xyzw='0 0 1 1'/></joint>";
    assert!(codes(&read(&with_joint(joint)).warnings).contains(&(Severity::Warning, "ignored-quaternion")));
}

/// An arm with an inertial and this visual.
fn with_visual(inertial: &str, visual: &str) -> String {
    let arm = format!("<link name='arm'>{inertial}<visual>{visual}</visual></link>\n");
    robot(&["<link name='base'/>\n", &arm, &hinge("j", "base", "arm")])
}

#[test]
fn inertia_that_does_not_fit_the_geometry_is_warned_of() {
    let warned = |size: &str, origin: &str| {
        let inertial = INERTIAL.replace("<mass", &format!("<origin xyz='{origin}'/><mass"));
        let text = with_visual(&inertial, &format!("<geometry><box size='{size}'/></geometry>"));
        codes(&read(&text).warnings)
    };
    // radius of gyration of INERTIAL: 0.1 m
    assert_eq!(warned("0.3 0.3 0.3", "0 0 0"), []);
    assert_eq!(warned("0.1 0.1 0.1", "0 0 0"), [(Severity::Warning, "inertia-too-large")]);
    assert_eq!(warned("3 3 4", "0 0 0"), [(Severity::Warning, "inertia-too-small")]);
    assert_eq!(warned("0.3 0.3 0.3", "0 0 0.5"), [(Severity::Warning, "com-outside")]);
    let huge = warned("300 300 400", "0 0 0");
    assert!(huge.contains(&(Severity::Warning, "huge-geometry")), "{huge:?}");
    let massless = with_visual("", "<geometry><box size='1 1 1'/></geometry>").replace(
        "<link name='base'/>",
        "<link name='base'><inertial><mass value='0'/><inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial>\
         <visual><geometry><box size='1 1 1'/></geometry></visual></link>",
    );
    let findings = check_urdf_text(&massless, "r.urdf", &ReadOptions::default());
    assert!(findings.iter().any(|f| f.code == "massless-shape"));
}

/// Closed form: a box of 0.2 × 0.4 × 0.6 m at 2700 kg/m³, displaced and rotated by a quarter turn
/// about z.
#[test]
fn inertia_is_estimated_from_shapes_on_request() {
    let visual = "<origin xyz='0 0 0.3' rpy='0 0 1.5707963267948966'/><geometry><box size='0.2 0.4 0.6'/></geometry>";
    let text = with_visual("", visual);
    let density = ReadOptions { inertia_from_mesh: Some(InertiaEstimate::Density(2700.0)), ..ReadOptions::default() };
    let robot = parse_urdf(&text, "r.urdf", &density).unwrap();
    let inertia = robot.mechanism.link("arm").unwrap().inertia.unwrap();
    let mass = 2700.0 * 0.2 * 0.4 * 0.6;
    assert_relative_eq!(inertia.mass, mass, max_relative = 1e-14);
    assert_relative_eq!(inertia.com, vector![0.0, 0.0, 0.3], epsilon = 1e-14);
    let turned = vector![0.04 + 0.36, 0.16 + 0.36, 0.04 + 0.16] * (mass / 12.0);
    assert_relative_eq!(inertia.inertia_com, Matrix3::from_diagonal(&turned), epsilon = 1e-12); // measured 2e-14
    assert_eq!(codes(&robot.warnings), [(Severity::Warning, "estimated-inertia")]);

    let total =
        |mass| ReadOptions { inertia_from_mesh: Some(InertiaEstimate::TotalMass(mass)), ..ReadOptions::default() };
    let with_base = text.replace(
        "<link name='base'/>",
        "<link name='base'><visual><geometry><box size='0.4 0.4 0.6'/></geometry></visual></link>",
    );
    let robot = parse_urdf(&with_base, "r.urdf", &total(30.0)).unwrap();
    assert_relative_eq!(robot.mechanism.link("arm").unwrap().inertia.unwrap().mass, 10.0, max_relative = 1e-14);
    assert_relative_eq!(robot.mechanism.link("base").unwrap().inertia.unwrap().mass, 20.0, max_relative = 1e-14);

    // Lengths four times too large make a density of a 64th.
    assert!(robot.warnings.iter().all(|found| found.code != "estimated-density"));
    let found = parse_urdf(&with_base, "r.urdf", &total(30.0 / 64.0)).unwrap().warnings;
    let told = found.iter().find(|found| found.code == "estimated-density").unwrap();
    assert!(told.message.contains("3.255 kg/m3") && told.severity == Severity::Warning, "{told:?}");

    for (text, options, code) in [
        (&text, total(-1.0), "bad-estimate"),
        (&text.replace("<visual>", "<collision>").replace("</visual>", "</collision>"), density, "missing-inertial"),
    ] {
        let error = parse_urdf(text, "r.urdf", &options).unwrap_err();
        assert_eq!(error.issues()[0].code, code);
    }
}

/// A tetrahedron with legs of 1 m, scaled; one face may be missing.
fn obj(closed: bool) -> String {
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\n";
    format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{faces}{}", if closed { "f 2 3 4\n" } else { "" })
}

#[test]
fn meshes_are_found_by_package_path_and_neighbourhood() {
    let folder = TestFolder::new();
    let mesh = folder.write("work/arm_description/meshes/arm.obj", obj(true));
    folder.write("work/other_name/package.xml", "<package><name>named_inside</name></package>");
    folder.write("work/other_name/m.obj", obj(true));
    folder.write("install/share/installed/m.obj", obj(true));
    folder.write("src/repository/deep/m.obj", obj(true));
    let urdf = folder.0.join("work/other_name/urdf/arm.urdf");
    let read_with = |uri: &str, options: &ReadOptions| {
        let visual = format!("<geometry><mesh filename='{uri}' scale='0.3 0.3 0.3'/></geometry>");
        folder.write("work/other_name/urdf/arm.urdf", with_visual(INERTIAL, &visual));
        let robot = read_urdf(&urdf, options).unwrap();
        let Geometry::Mesh { path, scale, .. } = &robot.visuals[0].geometry else { panic!() };
        assert_eq!(*scale, Vector3::repeat(0.3));
        (path.clone(), robot.warnings)
    };
    let options = ReadOptions {
        packages: vec![("mapped".into(), folder.0.join("work/arm_description"))],
        search_paths: vec![folder.0.join("install"), folder.0.join("src")],
        ..ReadOptions::default()
    };
    for uri in [
        "package://mapped/meshes/arm.obj",
        "package://arm_description/meshes/arm.obj",
        "package://named_inside/m.obj",
        "package://installed/m.obj",
        "package://deep/m.obj",
        "../m.obj",
        &format!("file://{}", mesh.display()),
        mesh.to_str().unwrap(),
    ] {
        let (path, warnings) = read_with(uri, &options);
        assert!(path.unwrap().is_file(), "{uri}");
        assert_eq!(codes(&warnings), [], "{uri}");
    }
    for (uri, part) in [
        ("package://unknown/m.obj", "packages unknown=FOLDER"),
        ("package://mapped/meshes/ARM.OBJ", "the case of letters differs"),
        ("package://mapped/none.obj", "complete"),
        ("none.obj", "relative to the URDF"),
        ("https://example.org/m.obj", "download"),
    ] {
        let (path, warnings) = read_with(uri, &options);
        assert_eq!((path, codes(&warnings)), (None, vec![(Severity::Warning, "missing-mesh")]), "{uri}");
        assert!(warnings[0].help.contains(part), "{}", warnings[0].help);
    }
    folder.write("work/other_name/broken.stl", "no mesh");
    let (_, warnings) = read_with("../broken.stl", &options);
    assert_eq!(codes(&warnings), [(Severity::Warning, "unreadable-mesh")]);
    let blind = ReadOptions { inspect_meshes: false, ..options };
    assert_eq!(read_with("../broken.stl", &blind).1, []);
}

/// Closed form of the tetrahedron with legs a: V = a³/6, centroid a/4 (1, 1, 1).
#[test]
fn inertia_from_a_mesh_file_needs_it_closed() {
    let folder = TestFolder::new();
    folder.write("closed.obj", obj(true));
    folder.write("open.obj", obj(false));
    let read_mesh = |name: &str| {
        let text = with_visual("", &format!("<geometry><mesh filename='{name}' scale='0.6 0.6 0.6'/></geometry>"));
        let options =
            ReadOptions { inertia_from_mesh: Some(InertiaEstimate::Density(1000.0)), ..ReadOptions::default() };
        parse_urdf(&text, folder.0.join("r.urdf"), &options)
    };
    let robot = read_mesh("closed.obj").unwrap();
    let inertia = robot.mechanism.link("arm").unwrap().inertia.unwrap();
    assert_relative_eq!(inertia.mass, 36.0, max_relative = 1e-6); // 0.6 is rounded to single precision
    assert_relative_eq!(inertia.com, Vector3::repeat(0.15), max_relative = 1e-6);
    assert_eq!(codes(&robot.warnings), [(Severity::Warning, "estimated-inertia")]);
    let open = read_mesh("open.obj").unwrap();
    assert!(codes(&open.warnings).contains(&(Severity::Warning, "open-mesh")));
    let error = read_mesh("none.obj").unwrap_err();
    assert!(error.to_string().contains("could not be estimated: the mesh \"none.obj\" was not found"), "{error}");
}

/// Every bundled arm with six joints: the class from the axes of its file, and joint values
/// recovered from the pose.
#[test]
fn inverse_kinematics_of_the_shipped_arms_has_a_closed_form() {
    use flexarm_kinematics::{AnalyticArm, ArmClass, Data, Model, PositionForm, Solutions, forward_kinematics};
    let arms = [
        ("kr210", "tool0"),
        ("kr210_identified", "tool0"),
        ("kr500_identified", "tool0"),
        ("manutec_r3", "link_6"),
        ("test/reference_arm", "link_6"),
        ("test/reference_arm_coupled", "link_6"),
    ];
    for (name, link) in arms {
        let file = name.trim_start_matches("test/");
        let path = format!("{}/../../../robots/{name}/{file}.urdf", env!("CARGO_MANIFEST_DIR"));
        let options = ReadOptions { waive: vec!["link_1".into()], ..ReadOptions::default() };
        let robot = read_urdf(path, &options).unwrap();
        let model = Model::new(&robot.mechanism).unwrap();
        let (frame, mut data) = (model.frame(link).unwrap(), Data::new(&model));
        let arm = AnalyticArm::new(&model, frame).unwrap();
        assert_eq!(arm.class(), ArmClass::SphericalWrist(PositionForm::Parallel23), "{name}");
        let mut solutions = Solutions::default();
        for k in 0..200 {
            // Joint values distributed evenly within the limits.
            let q: [f64; 6] = std::array::from_fn(|j| {
                let (low, high) = arm.limits()[j];
                low + (high - low) * (0.5 + f64::from(k) * [0.618, 0.382, 0.755, 0.570, 0.819, 0.671][j]).fract()
            });
            forward_kinematics(&model, &mut data, &nalgebra::DVector::from_column_slice(&q));
            arm.solve(&data.X_WF(frame), &mut solutions);
            let mut error = f64::INFINITY;
            for s in solutions.iter() {
                arm.copies_within_limits(&s.q, |copy| {
                    error = error.min(copy.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
                });
            }
            assert!(error < 1e-9, "{name} {q:?}: {error:.1e}");
        }
    }
}
