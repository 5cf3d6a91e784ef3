//! Names with control characters, markup and formulas: no output interprets them.

use crate::common::Place;

/// A name that colours a terminal, opens a tag, ends a cell and is a formula.
const NAME: &str = "=1+1|\u{9b}31m\u{1b}]0;x\u{7}<b>x</b>";
/// The same within XML, which cannot hold most control characters.
const XML: &str = "=1+1|&#x9b;31m&lt;b&gt;x&lt;/b&gt;";
const TOML: &str = r#""=1+1|\u009B31m<b>x</b>""#;

/// A bar on a horizontal axis.
fn bar() -> String {
    format!(
        r#"<robot name="{XML}"><link name="base"/>
  <link name="{XML}">
    <inertial><origin xyz="0.25 0 0"/><mass value="6"/><inertia ixx="0.02" iyy="0.13" izz="0.13" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></visual>
  </link>
  <link name="tool0"/>
  <joint name="{XML}" type="revolute"><parent link="base"/><child link="{XML}"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="200" velocity="2"/></joint>
  <joint name="flange" type="fixed"><parent link="{XML}"/><child link="tool0"/><origin xyz="0.5 0 0"/></joint>
</robot>"#
    )
}

fn robot() -> String {
    format!(
        "format = 1\nname = {TOML}\nurdf = \"bar.urdf\"\n[[drive]]\njoint = {TOML}\nkind = \"gearbox\"\ngearbox = {{ stiffness = 1e4 }}\n"
    )
}

fn motion() -> String {
    format!("format = 1\nunit = \"deg\"\njoints = [{TOML}]\nstart = [0.0]\n[[move]]\nto = [20.0]\nduration = 0.5\n")
}

/// The first control character of a text other than line ends and tabs.
fn obeyed(text: &str) -> Option<char> {
    text.chars().find(|c| c.is_control() && !"\n\r\t".contains(*c))
}

#[test]
fn names_of_a_robot_are_shown_and_not_obeyed_in_every_file_of_a_run() {
    let place = Place::new();
    place.write("bar.urdf", bar());
    place.write("robot.toml", robot());
    place.write("swing.toml", motion());
    let run = place.flexarm(&["compare", "robot.toml", "swing.toml", "-o", "out", "--figures"]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert_eq!((obeyed(&run.out), obeyed(&run.err)), (None, None), "{} {}", run.out, run.err);
    let json = place.flexarm(&["compare", "robot.toml", "swing.toml", "--no-files", "--json"]);
    assert_eq!((json.code, obeyed(&json.out)), (0, None), "{}", json.out);
    assert!(serde_json::from_str::<serde_json::Value>(&json.out).unwrap().to_string().contains('\u{9b}'));
    let mut seen = 0;
    let mut folders = vec![place.path("out")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let kind = path.extension().unwrap().to_str().unwrap().to_owned();
            let Ok(text) = std::fs::read_to_string(&path) else { continue };
            if ["md", "html", "svg", "csv"].contains(&kind.as_str()) {
                seen += 1;
                assert_eq!(obeyed(&text).filter(|_| kind != "csv"), None, "{}", path.display());
            }
            match kind.as_str() {
                "md" | "html" | "svg" => assert!(!text.contains("<b>x"), "{}", path.display()),
                "csv" => {
                    for cell in text.lines().next().unwrap().split(',') {
                        let first = cell.trim_start_matches('"').chars().next();
                        assert!(!first.is_some_and(|c| "=+-@".contains(c)), "{}: {cell}", path.display());
                    }
                }
                _ => {}
            }
        }
    }
    assert!(seen >= 4, "{seen} files");
    // The program reads its own table back.
    let again = place.flexarm(&["report", "out/run.csv", "-o", "again.html"]);
    assert_eq!(again.code, 0, "{}", again.err);
    let again = std::fs::read_to_string(place.path("again.html")).unwrap();
    assert!(again.contains("=1+1|") && !again.contains("&#39;=1+1") && !again.contains("'=1+1"));
}

#[test]
fn a_command_line_and_a_file_are_echoed_without_control_characters_and_not_whole() {
    let place = Place::new();
    place.write("bar.urdf", bar());
    place.write("robot.toml", robot());
    let long = "x".repeat(1_000_000);
    for (name, text) in [
        ("cell.csv", format!("time,{}\n0,{NAME}\n1,{long}\n", "joint")),
        ("name.csv", format!("time,{long}\n0,1\n1,2\n")),
        ("program.src", format!("DEF \u{1b}[31mx()\n{NAME}\nPTP {{A1 {long}}}\nEND\n")),
        ("key.toml", format!("format = 1\n\"{long}\" = 1\n")),
        ("value.toml", format!("format = 1\nunit = \"{long}\"\n")),
    ] {
        place.write(name, text);
        let run = place.flexarm(&["motion", name, "robot.toml"]);
        assert_eq!(run.code, 2, "{name}: {:.500}", run.err);
        let both = format!("{}{}", run.out, run.err);
        assert_eq!(obeyed(&both), None, "{name}: {both:.500}");
        assert!(both.len() < 20_000, "{name}: {} bytes", both.len());
    }
    for line in [&["check", NAME][..], &[NAME], &["check", "robot.toml", NAME], &["motion", "--topic", NAME, NAME]] {
        let run = place.flexarm(line);
        assert_eq!(obeyed(&(run.out.clone() + &run.err)), None, "{line:?}: {}", run.err);
    }
}

#[test]
fn warnings_of_one_kind_are_one_line_with_their_count_and_each_description_warns_once() {
    let place = Place::new();
    let mut urdf = String::from(r#"<robot name="r"><link name="l0"/>"#);
    for k in 1..=12 {
        let before = k - 1;
        urdf += &format!(
            r#"
<link name="l{k}"><inertial><origin xyz="5 0 0"/><mass value="{k}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0.05 0 0"/><geometry><box size="0.1 0.05 0.05"/></geometry></visual></link>
<joint name="j{k}" type="revolute"><parent link="l{before}"/><child link="l{k}"/><origin xyz="0.1 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="90000" velocity="2"/></joint>"#
        );
    }
    place.write("r.urdf", urdf + "</robot>");
    place.write("r.toml", "format = 1\nurdf = \"r.urdf\"\n");
    let joints: Vec<String> = (1..=12).map(|k| format!("\"j{k}\"")).collect();
    let zeros = ["0.0"; 12].join(", ");
    let to = ["1.0"; 12].join(", ");
    let joints = joints.join(", ");
    place.write(
        "m.toml",
        format!("format = 1\nunit = \"deg\"\njoints = [{joints}]\nstart = [{zeros}]\n[[move]]\nto = [{to}]\nduration = 0.2\n"),
    );
    let outside = |text: &str| text.lines().filter(|line| line.contains("lies outside its geometry")).count();
    let check = place.flexarm(&["check", "r.toml"]);
    assert_eq!(outside(&check.out), 1, "{}", check.out);
    assert!(check.out.contains("(and 11 more of this kind: l2, l3, l4, ...)"), "{}", check.out);
    for line in [
        &["compare", "r.toml", "m.toml", "--no-files"][..],
        &["compare", "r.toml", "m.toml", "--no-files", "--with", "step=0.002", "--with", "step=0.004"],
    ] {
        let run = place.flexarm(line);
        assert_eq!(run.code, 0, "{}", run.err);
        // One line for all findings of the description: twelve outside places and two others.
        let of_description = run.err.lines().filter(|line| line.contains("of the description: flexarm check)")).count();
        assert!(of_description == 1 && outside(&run.err) <= 1, "{}", run.err);
        assert!(run.err.contains("(and 13 more of the description: flexarm check)"), "{}", run.err);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_name_is_not_text_gets_the_files_of_any_other() {
    use std::os::unix::ffi::OsStrExt as _;
    let place = Place::new();
    let files = |folder: &std::path::Path| {
        let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let odd = std::ffi::OsStr::from_bytes(b"n\xff\xfe");
    for folder in [std::ffi::OsStr::new("plain"), odd] {
        let mut command = place.command(&["compare", "robot.toml", "swing.toml", "-o"]);
        assert!(command.arg(folder).output().unwrap().status.success());
    }
    assert_eq!(files(&place.path("plain")), files(&place.path("").join(odd)));
    let others = files(&place.path("")).into_iter().filter(|name| name.to_string_lossy().starts_with('n')).count();
    assert_eq!(others, 1, "a folder of another name");
}
