//! The plain text that `urdf_rs` reads.

use std::path::Path;

use flexarm_urdf::internals::{Lines, Report, lint};
use roxmltree::Document;

fn plain(text: &str) -> (String, Report) {
    let (document, mut report) = (Document::parse(text).unwrap(), Report::default());
    let plain = lint(document.root_element(), &Lines::new(Path::new("r.urdf"), text), &mut report).unwrap();
    (plain.text, report)
}

fn read(text: &str) -> Result<String, String> {
    urdf_rs::read_from_string(text).map(|robot| format!("{robot:?}")).map_err(|e| e.to_string())
}

/// Truth: the result of `urdf_rs` for the file itself.
#[test]
fn nothing_that_urdf_rs_reads_is_lost() {
    let robots = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../robots");
    let folders = ["", "test"].into_iter().flat_map(|place| std::fs::read_dir(robots.join(place)).unwrap().flatten());
    let files = folders.flat_map(|folder| std::fs::read_dir(folder.path()).into_iter().flatten().flatten());
    let paths = files.map(|file| file.path()).filter(|path| path.extension().is_some_and(|e| e == "urdf"));
    let texts: Vec<String> = paths.map(|path| std::fs::read_to_string(path).unwrap()).collect();
    assert!(texts.len() >= 10, "{}", texts.len());
    for text in texts.iter().map(String::as_str).chain([WHOLE]) {
        assert_eq!(read(&plain(text).0).unwrap(), read(text).unwrap());
    }
}

const WHOLE: &str = r#"<?xml version="1.0"?>
<robot name="r">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="a &lt;'1'&gt; &amp; &quot;&#xe9;&quot;"/>
  <link name=" b ">
    <inertial><origin xyz="0 0 1" rpy="0 1e-3 0"/><mass value=" 0.1"/><inertia ixx="1" ixy="2" ixz="3" iyy="4" iyz="5" izz="6"/></inertial>
    <visual name="v"><origin xyz="0.1 .2 3."/><geometry><box size="1 2 3"/></geometry><material name="grey"/></visual>
    <visual><geometry><mesh filename=" package://r/b.stl" scale="1 -1 1"/></geometry></visual>
    <collision><geometry><cylinder radius="1" length="2"/></geometry></collision>
    <collision name="c"><origin rpy="0 0 1"/><geometry><sphere radius="1"/></geometry></collision>
  </link>
  <joint name="ab" type="revolute">
    <parent link="a &lt;'1'&gt; &amp; &quot;&#xe9;&quot;"/><child link=" b "/><origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="inf" effort="10" velocity="2"/><dynamics damping="1" friction="2"/>
  </joint>
  <joint name="bc" type="prismatic">
    <parent link=" b "/><child link="c"/><limit velocity="1"/><mimic joint="ab" multiplier="2" offset="0.1"/>
  </joint>
</robot>
"#;

/// Truth: faults of real robots that `urdf_rs` rejects.
#[test]
fn what_urdf_rs_would_refuse_is_made_plain() {
    for (from, to) in [
        ("<limit velocity=\"1\"/>", "<limit/>"),
        ("<axis xyz=\"0 0 1\"/>", "<axis/>"),
        ("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 1\"/><axis xyz=\"1 0 0\"/>"),
        ("<material name=\"grey\"/>", "<material><color rgba=\"1 0 0 1\"/></material>"),
        ("<material name=\"grey\"/>", "<material name=\"grey\"><color/></material>"),
        ("<box size=\"1 2 3\"/>", "<cone/>"),
        ("<sphere radius=\"1\"/>", "<sphere/>"),
        ("<sphere radius=\"1\"/>", ""),
        ("<visual name=\"v\">", "<visual><geometry><sphere radius=\"1\"/></geometry></visual><inertial/><visual>"),
        ("<dynamics", "<safety_controller/><dynamics"),
    ] {
        let text = WHOLE.replacen(from, to, 1);
        assert!(text != WHOLE && read(&text).is_err(), "{from} {to}");
        let (plain, report) = plain(&text);
        assert!(report.issues.is_empty() && read(&plain).is_ok(), "{from} {to}: {plain}");
    }
}

/// The plain text has no extensions, and zeros in place of faults.
#[test]
fn the_text_is_shallow_and_whole_whatever_is_wrong() {
    let deep = format!("<link name='a'>{}{}</link>", "<visual><origin>".repeat(500), "</origin></visual>".repeat(500));
    let extensions = "<x:link xmlns:x='x' name='b' x:name='c'/><gazebo><link name='d'/></gazebo>";
    let joint = "<joint name='j'><child/><axis xyz='x'/><mimic/></joint>";
    let (text, report) = plain(&format!("<robot>{deep}{extensions}{joint}</robot>"));
    assert_eq!(
        text,
        "<robot name=\"\"><link name=\"a\"></link><link name=\"b\"></link><joint name=\"j\" type=\"floating\">\
         <parent link=\"\"></parent><child link=\"\"></child><axis xyz=\"0 0 0\"></axis><mimic joint=\"\"></mimic>\
         </joint></robot>"
    );
    assert!(read(&text).is_ok());
    // geometry, type, parent, link of the child, axis, joint of the mimic
    assert_eq!(report.issues.len(), 6);
}
