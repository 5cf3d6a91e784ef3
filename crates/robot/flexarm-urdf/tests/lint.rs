//! Values and faults of single elements.

use std::path::Path;

use crate::common::problems;
use flexarm_kinematics::JointKind;
use flexarm_urdf::{Geometry, ReadOptions, parse_urdf};
use nalgebra::{Matrix3, Vector3};

/// Compares what is read with what `urdf_rs` reads.
fn compare(text: &str) {
    let theirs = urdf_rs::read_from_string(text).unwrap();
    let waive = theirs.links.iter().map(|link| link.name.clone()).collect();
    let ours = parse_urdf(text, "r.urdf", &ReadOptions { waive, ..ReadOptions::default() }).unwrap();
    assert_eq!(ours.mechanism.links.len(), theirs.links.len());
    for (a, b) in ours.mechanism.links.iter().zip(&theirs.links) {
        assert_eq!(a.name, b.name);
        assert_eq!(a.inertia.map_or(0.0, |i| i.mass), b.inertial.mass.value);
        let (i, [r, p, y]) = (&b.inertial.inertia, *b.inertial.origin.rpy);
        let R_LI = nalgebra::Rotation3::from_euler_angles(r, p, y);
        let inertia_L =
            R_LI * Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz) * R_LI.inverse();
        let difference = a.inertia.map_or(Matrix3::zeros(), |i| i.inertia_com) - inertia_L;
        assert!(difference.norm() <= 1e-12 * inertia_L.norm(), "{}: {difference}", a.name);
        assert_eq!(a.inertia.map_or(Vector3::zeros(), |i| i.com), Vector3::from(*b.inertial.origin.xyz));
    }
    assert_eq!(ours.mechanism.joints.len(), theirs.joints.len());
    for (a, b) in ours.mechanism.joints.iter().zip(&theirs.joints) {
        assert_eq!((&a.name, &a.parent, &a.child), (&b.name, &b.parent.link, &b.child.link));
        assert_eq!(a.X_PJ.translation.vector, Vector3::from(*b.origin.xyz));
        let [roll, pitch, yaw] = *b.origin.rpy;
        assert_eq!(a.X_PJ.rotation, nalgebra::Rotation3::from_euler_angles(roll, pitch, yaw));
        if let JointKind::Revolute(axis) | JointKind::Prismatic(axis) = a.kind {
            assert_eq!(*axis, Vector3::from(*b.axis.xyz).normalize());
            assert_eq!((a.limits.lower, a.limits.upper), (b.limit.lower, b.limit.upper));
            let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
            assert_eq!([a.limits.effort, a.limits.velocity].map(finite), [b.limit.effort, b.limit.velocity]);
        }
        let mimic = a.mimic.as_ref().map(|m| (&m.joint, Some(m.ratio), Some(m.offset)));
        assert_eq!(mimic, b.mimic.as_ref().map(|m| (&m.joint, m.multiplier, m.offset)));
    }
    let theirs: Vec<_> = theirs.links.iter().flat_map(|link| &link.visual).collect();
    assert_eq!(ours.visuals.len(), theirs.len());
    for (a, b) in ours.visuals.iter().zip(theirs) {
        assert_eq!((&a.name, a.X_LV.translation.vector), (&b.name, Vector3::from(*b.origin.xyz)));
        match (&a.geometry, &b.geometry) {
            (Geometry::Mesh { uri, scale, .. }, urdf_rs::Geometry::Mesh { filename, scale: theirs }) => {
                let theirs = theirs.map_or(Vector3::repeat(1.0), |scale| Vector3::from(*scale));
                assert_eq!((uri.as_str(), *scale), (filename.trim(), theirs));
            }
            (Geometry::Box { size }, urdf_rs::Geometry::Box { size: theirs }) => {
                assert_eq!(*size, Vector3::from(**theirs));
            }
            (Geometry::Cylinder { radius, length }, urdf_rs::Geometry::Cylinder { radius: r, length: l }) => {
                assert_eq!((radius, length), (r, l));
            }
            (Geometry::Sphere { radius }, urdf_rs::Geometry::Sphere { radius: r }) => assert_eq!(radius, r),
            (ours, theirs) => panic!("{ours:?} {theirs:?}"),
        }
    }
}

/// Truth: the values that `urdf_rs` reads.
#[test]
fn the_values_are_those_that_urdf_rs_reads() {
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots");
    let folders = ["", "test"].into_iter().flat_map(|place| std::fs::read_dir(robots.join(place)).unwrap().flatten());
    let files = folders.flat_map(|folder| std::fs::read_dir(folder.path()).into_iter().flatten().flatten());
    let paths = files.map(|file| file.path()).filter(|path| path.extension().is_some_and(|e| e == "urdf"));
    let texts: Vec<String> = paths.map(|path| std::fs::read_to_string(path).unwrap()).collect();
    assert!(texts.len() >= 10, "{}", texts.len());
    texts.iter().map(String::as_str).chain([WHOLE]).for_each(compare);
}

const WHOLE: &str = r#"<?xml version="1.0"?>
<robot name="r">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="a &lt;'1'&gt; &amp; &quot;&#xe9;&quot;"/>
  <link name=" b ">
    <inertial><origin xyz="0 0 1" rpy="0 1e-3 0"/><mass value=" 0.1"/><inertia ixx="1" ixy=".1" ixz="-2e-1" iyy="1.2" iyz="0.3" izz="+1.5"/></inertial>
    <visual name="v"><origin xyz="0.1 .2 3."/><geometry><box size="1 2 3"/></geometry><material name="grey"/></visual>
    <visual><geometry><mesh filename=" package://r/b.stl" scale="1 -1 1"/></geometry></visual>
    <collision><geometry><cylinder radius="1" length="2"/></geometry></collision>
    <collision name="c"><origin rpy="0 0 1"/><geometry><sphere radius="1"/></geometry></collision>
  </link>
  <link name="c"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="ab" type="revolute">
    <parent link="a &lt;'1'&gt; &amp; &quot;&#xe9;&quot;"/><child link=" b "/><origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="inf" effort="10" velocity="2"/><dynamics damping="1" friction="2"/>
  </joint>
  <joint name="bc" type="prismatic">
    <parent link=" b "/><child link="c"/><limit lower="0" upper="1" velocity="1"/><mimic joint="ab" multiplier="2" offset="0.1"/>
  </joint>
</robot>
"#;

/// Truth: faults of real robots that `urdf_rs` rejects.
#[test]
fn what_urdf_rs_would_refuse_is_read() {
    for (from, to) in [
        ("<axis xyz=\"0 0 1\"/>", "<axis/>"),
        ("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 1\"/><axis xyz=\"1 0 0\"/>"),
        ("upper=\"1\" velocity=\"1\"/>", "upper=\"1\"/>"),
        ("<material name=\"grey\"/>", "<material><color rgba=\"1 0 0 1\"/></material>"),
        ("<material name=\"grey\"/>", "<material name=\"grey\"><color/></material>"),
        ("<box size=\"1 2 3\"/>", "<cone/>"),
        ("<sphere radius=\"1\"/>", "<sphere/>"),
        ("<sphere radius=\"1\"/>", ""),
        ("</inertial>", "</inertial><visual><geometry><sphere radius=\"1\"/></geometry></visual><inertial/>"),
        ("<dynamics", "<safety_controller/><dynamics"),
    ] {
        let text = WHOLE.replacen(from, to, 1);
        assert!(text != WHOLE && urdf_rs::read_from_string(&text).is_err(), "{from} {to}");
        assert!(problems(&text).is_empty(), "{from} {to}: {:?}", problems(&text));
    }
}

/// Extensions are ignored, and reading continues after a fault.
#[test]
fn all_faults_are_reported_together() {
    let deep = format!("<link name='a'>{}{}</link>", "<visual><origin>".repeat(500), "</origin></visual>".repeat(500));
    let extensions = "<x:link xmlns:x='x' name='b' x:name='c'/><gazebo><link name='d'/></gazebo>";
    let joint = "<joint name='j'><child/><axis xyz='x'/><mimic/></joint>";
    // geometry, type, parent, link of the child, axis, joint of the mimic
    assert_eq!(problems(&format!("<robot>{deep}{extensions}{joint}</robot>")).len(), 6);
}
