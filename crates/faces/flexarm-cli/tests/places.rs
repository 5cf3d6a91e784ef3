//! Places of errors: an error in line k of a file is reported as `FILE:k`, whatever the format.

use crate::common::{Place, ROBOT, URDF, flex, with};

/// Marks the line with the error; it is removed before the file is written.
const MARK: char = '§';

/// Writes `text` to the last of `arguments` and requires an error at the marked line.
fn refused_at_mark(place: &Place, arguments: &[&str], file: &str, text: &str) {
    let at = text.find(MARK).unwrap_or_else(|| panic!("{file} has no mark"));
    let line = text[..at].matches('\n').count() + 1;
    place.write(file, text.replace(MARK, ""));
    let answer = place.refused(arguments, &[]);
    let here = format!("{file}:{line}");
    let found = answer.err.match_indices(&here).any(|(k, _)| {
        let next = answer.err[k + here.len()..].chars().next();
        next.is_some_and(|c| !c.is_ascii_digit())
    });
    assert!(found, "{here} is not in the message:\n{}", answer.err);
    let counted = |after: &str| after.starts_with(|c: char| c.is_ascii_digit());
    assert!(!answer.err.split("line ").skip(1).any(counted), "a second form of a place:\n{}", answer.err);
}

#[test]
fn an_error_in_line_k_of_a_robot_or_link_is_reported_as_file_colon_k() {
    let place = Place::new();
    let robot = ["inspect", "robot.toml"];
    refused_at_mark(&place, &robot, "beam.urdf", &with(URDF, "<mass value=\"1.728\"/>", "§<mass value=\"heavy\"/>"));
    place.write("beam.urdf", URDF);
    refused_at_mark(&place, &robot, "robot.toml", &with(ROBOT, "link =", "§lnik ="));
    place.write("robot.toml", flex::robot());
    refused_at_mark(&place, &robot, "bar.flex", "format = \"flexarm-reduced-link\"\n\n§version = x\n");

    let xacro = "<robot name=\"r\" xmlns:xacro=\"http://ros.org/wiki/xacro\">\n<link name=\"a\"/>\n";
    refused_at_mark(
        &place,
        &["inspect", "a.xacro"],
        "a.xacro",
        &format!("{xacro}<link name=\"§${{x}}\"/>\n</robot>\n"),
    );
    let sizes = format!(
        "{xacro}<xacro:property name=\"p\" value=\"${{xacro.load_yaml('sizes.yaml')}}\"/>\n\
                         <link name=\"${{p['a']}}\"/></robot>\n"
    );
    for text in ["a: 1\nb: 2\n§c: ]\n", "a: 1\nb:\n  - !inches 2\n§  - !inches wide\n", "a: 1\n§b: !furlongs 2\n"] {
        place.write("a.xacro", &sizes);
        refused_at_mark(&place, &["inspect", "a.xacro"], "sizes.yaml", text);
    }
}

#[test]
fn an_error_in_line_k_of_a_motion_is_reported_as_file_colon_k() {
    let place = Place::new();
    let point = "  - positions: [0.0]\n    time_from_start: ";
    let path = "format = 1\n[path]\nlengths = \"m\"\nangles = \"rad\"\n";
    for (file, text) in [
        ("moves.toml", "format = 1\nunit = \"rad\"\njoints = [\"swing\"]\nstart = [0.0]\n[[move]]\n§to = [1.0, 2.0]\n"),
        ("table.csv", "time,swing\n0,0\n§1,one\n"),
        ("table.txt", "t[s]\tswing[rad]\n0\t0\n§0\t1\n"),
        ("plan.yaml", &format!("joint_names: [swing]\npoints:\n{point}0.0\n{point}§soon\n")),
        ("broken.yaml", "joint_names: [swing]\npoints:\n§  - }\n"),
        ("plan.json", "{\"joint_names\": [\"swing\"],\n§\"points\": [{\"positions\": [0], \"time_from_start\": }]}"),
        ("path.toml", &format!("{path}[[move]]\njoints = [0.0]\n[[move]]\n§lien = [0.0]\n")),
        (
            "reach.toml",
            &format!("{path}[[move]]\njoints = [0.0]\n[[move]]\n§joints = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\n"),
        ),
        ("square.src", "DEF square()\nPTP {A1 0,A2 -60,A3 60,A4 0,A5 20,A6 0}\n§PTP {A1 0,\nEND\n"),
        ("square.mod", "MODULE m\nPROC main()\n§MoveJ nowhere, v100, fine, tool0;\nENDPROC\nENDMODULE\n"),
        ("square.script", "def square():\n  movej([0,0,0,0,0,0])\n§  movej([0,0\nend\n"),
        ("square.nc", "G21 F100\nG0 X0 Y0 Z0\n§G1 X1 Y(\n"),
    ] {
        refused_at_mark(&place, &["compare", "robot.toml", file, "--no-files"], file, text);
    }
    // Programs that the arm cannot follow.
    let home = "PTP {A1 0,A2 -60,A3 60,A4 0,A5 20,A6 0}";
    let far = "line = [9.5, 0.0, 0.1]\nrpy = [0.0, 0.0, 0.0]\n";
    for (file, text) in [
        ("far.src", &format!("DEF a()\n{home}\n§LIN {{X 9000,Y 0,Z 100,A 0,B 0,C 0}}\nEND\n")),
        ("far.toml", &format!("{path}[[move]]\njoints = [0, -0.5, 0.5, 0, 0.3, 0]\n§[[move]]\n{far}")),
        ("start.toml", &format!("{path}§[[move]]\n{far}")),
    ] {
        refused_at_mark(&place, &["motion", file, "kr210"], file, text);
    }
}

#[test]
fn an_error_in_line_k_of_loads_and_of_a_table_is_reported_as_file_colon_k() {
    let place = Place::new();
    let run = ["compare", "robot.toml", "swing.toml", "--no-files", "--loads", "loads.toml"];
    refused_at_mark(&place, &run, "loads.toml", "format = 1\n[[load]]\n§kind = \"stpe\"\n");
    place.write("loads.toml", "format = 1\n[[load]]\nkind = \"table\"\nfile = \"force.csv\"\n");
    for text in [
        "# N\n§t,fx\n0,1\n1,1\n",
        "time,fx\n0,1\n§1,one\n",
        "time,fx\n0,1\n§1\n",
        "time,fx\n0,1\n§0,2\n",
        "time,fx\n0,1\n§1,\n",
        "§time,fx\n0,1\n",
        "§time,fx,fx\n0,1,1\n1,1,1\n",
    ] {
        refused_at_mark(&place, &run, "force.csv", text);
    }
    let map = ["map", "robot.toml", "--poses"];
    for (file, text) in [
        ("poses.csv", "swing\n0.0\n§9e9\n"),
        ("names.csv", "# rad\n§jonit\n0.0\n"),
        ("poses.toml", "format = 1\nposes = [\n  [0.0],\n§  [0.0, 0.0],\n]\n"),
    ] {
        refused_at_mark(&place, &[&map[..], &[file]].concat(), file, text);
    }
    place.write("study.toml", "format = 1\nrobot = \"robot.toml\"\nmotion = \"swing.toml\"\ntable = \"runs.csv\"\n");
    refused_at_mark(
        &place,
        &["sweep", "study.toml"],
        "study.toml",
        "format = 1\nrobot = \"robot.toml\"\n§motoin = 1\n",
    );
}

#[test]
fn an_error_in_line_k_of_a_file_of_a_finite_element_program_is_reported_as_file_colon_k() {
    let place = Place::new();
    refused_at_mark(&place, &["reduce", "job.toml"], "job.toml", "mesh = \"beam.inp\"\n§mehs = 1\n");
    for (file, text) in [
        ("beam.inp", "*NODE\n1, 0., 0., 0.\n§2, one, 0., 0.\n"),
        ("beam.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n§1 one 1 1\n"),
    ] {
        refused_at_mark(&place, &["reduce", file, "--list"], file, text);
    }
    for (file, text) in [
        ("bar.mtx", "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1.0\n§2 2 one\n"),
        (
            "bar.pch",
            "DMIG    KAAX           0       6       1       0\n§DMIG*   KAAX                           one               1\n",
        ),
    ] {
        refused_at_mark(&place, &["import", file, "--units", "m-kg-s"], file, text);
    }
}

/// A mesh of a robot that cannot be read is a warning, as the arm moves without it.
#[test]
fn an_error_in_line_k_of_a_mesh_is_reported_as_file_colon_k() {
    let place = Place::new();
    let visual = "<visual><geometry><mesh filename=\"part.dae\"/></geometry></visual>\n";
    place.write("beam.urdf", with(URDF, "<inertial>", &format!("{visual}<inertial>")));
    for (text, line) in [
        ("<?xml version=\"1.0\"?>\n<COLLADA>\n<library>\n</COLLADA>\n", 4),
        (
            "<COLLADA>\n<scene>\n<instance_visual_scene url=\"#s\"/>\n</scene>\n<library_visual_scenes>\n<visual_scene id=\"s\"><node>\n<instance_geometry url=\"#g\"/>\n</node></visual_scene></library_visual_scenes></COLLADA>\n",
            7,
        ),
    ] {
        place.write("part.dae", text);
        let answer = place.flexarm(&["check", "robot.toml"]);
        let said = answer.out + &answer.err;
        assert!(said.contains(&format!("part.dae:{line}:")) && !said.contains("line "), "{said}");
    }
}
