//! Messages that state how to fix something: the library gives the setting as a value, the program
//! prints its flag. One row per sentence, compared letter by letter.

use crate::common::{Place, ROBOT, SWING, URDF, flex};

/// Options, and the resulting sentence.
type Row<'a> = (&'a [&'a str], &'a str);

/// Each row after `command` must be refused with exactly its sentence.
fn refused(place: &Place, command: &[&str], rows: &[Row<'_>]) {
    for (options, sentence) in rows {
        let answer = place.refused(&[command, options].concat(), &[]);
        assert_eq!(answer.err, format!("error: {sentence}\n"), "{command:?} {options:?}");
    }
}

/// The lines of standard error of a command that succeeds.
fn told(place: &Place, arguments: &[&str], sentences: &[&str]) {
    let answer = place.flexarm(arguments);
    assert_eq!(answer.code, 0, "{arguments:?}: {}", answer.err);
    for sentence in sentences {
        let line = format!("warning: {sentence}");
        assert!(answer.err.lines().any(|l| l == line), "{arguments:?}: {line:?} is not in\n{}", answer.err);
    }
}

const COMPARE: [&str; 5] = ["compare", "robot.toml", "swing.toml", "-o", "result"];

#[test]
fn a_run_names_the_flags_that_mend_it() {
    let place = Place::new();
    let long = "a".repeat(120);
    let named = format!("step=2e-3,name={long}");
    let too_long =
        format!("the label {long:?} has 120 letters, at most 100 make a folder: give its --with a short name=...");
    let not_lumped = "3 segments are requested, but no link of the robot is lumped: add --links lumped";
    refused(
        &place,
        &COMPARE,
        &[
            (
                &["--stepper", "spook", "--links", "modal"],
                "spook works in maximal coordinates and does not support modal links (--links lumped would do): use \
             generalized-alpha",
            ),
            (&["--magnify", "0"], "--magnify: the factor of deflections must be positive, found 0 times"),
            (
                &["--magnify", "1e9"],
                "the factor of deflections (--magnify) is 1e9: expected one from 0.001 to 1000000, 1 shows them as they are",
            ),
            (&["--step", "2"], "the step (--step 2 s) is longer than the motion (1 s)"),
            (
                &["--step", "1e-10"],
                "1 s in steps of 1e-10 s make 1.0e10 steps, at most 1e9 are taken: raise --step or cut the trajectory",
            ),
            (&["--step", "-1"], "--step: the step must be positive, found -1 s"),
            (&["--log-rate", "-1"], "--log-rate: the log rate must be positive, found -1 Hz"),
            (&["--settling-band", "0"], "--settling-band: the settling band must be positive, found 0 m"),
            (
                &["--round-corners", "-1"],
                "corners are rounded within a time between 0 and that of the motion (1 s), found -1 s: try 0.02",
            ),
            (&["--links", "modal", "--segments", "3"], not_lumped),
            (
                &["--links", "lumped", "--modes", "3"],
                "3 modes are requested, but no link of the robot is modal: add --links modal",
            ),
            (
                &["--with", "step=2e-3,name=a", "--with", "step=3e-3,name=a"],
                "the label \"a\" names two runs of the study, or none: give each --with a name=... of its own",
            ),
            (
                &["--with", "step=2e-3,name=run.mcap"],
                "the label \"run.mcap\" is the name of a file of the study: give its --with another name=...",
            ),
            (&["--with", &named], &too_long),
            (
                &["--with", "step=5,name=a"],
                "run \"a\" of the study: the step (--step 5 s) is longer than the motion (1 s)",
            ),
            (&["--with", "links=modal,segments=3,name=b"], &format!("run \"b\" of the study: {not_lumped}")),
        ],
    );
    let unstable = place.refused(&[&COMPARE[..], &["--stepper", "rk4", "--step", "0.01"]].concat(), &[]);
    unstable.says(&["rk4 with step 1e-2 s is unstable here", "; use --step or --stepper generalized-alpha\n"]);
    place.write("fast.toml", SWING.replace("60.0", "175.0"));
    let fast = place.refused(&["compare", "robot.toml", "fast.toml", "-o", "result"], &[]);
    fast.says(&["\nslow it down, change it, or run it anyway with --ignore-limits\n"]);
    place.write("result/run.csv", "of an earlier run");
    let taken = "result/run.csv: exists already and is not overwritten: choose another folder with -o or give --force";
    refused(&place, &COMPARE, &[(&[], taken)]);
}

/// The summary, in the file and on standard output, has the same text as the terminal.
#[test]
fn caveats_of_a_run_name_the_flags_in_every_place() {
    let place = Place::new();
    let few = "20 logged samples a second are few for a first frequency of";
    let rest = "Hz: peaks between them are missed; raise --log-rate or lower --step";
    let summary = place.json(&[&COMPARE[..], &["--log-rate", "20"]].concat());
    let file: serde_json::Value = serde_json::from_slice(&place.read("result/summary.json")).unwrap();
    for summary in [&summary, &file] {
        let warning = summary["warnings"][0].as_str().unwrap();
        assert!(warning.starts_with(few) && warning.ends_with(rest), "{warning}");
        assert_eq!(summary["caveats"][0]["message"], warning);
        assert!(summary["caveats"][0].get("settings").is_none());
        let energy = summary["warnings"][1].as_str().unwrap();
        let end = "the samples are too far apart (--log-rate), the step too coarse (--step), or the stepper has numerical damping";
        assert!(energy.ends_with(end), "{energy}");
    }
    let coarse = place.flexarm(&[&COMPARE[..], &["--force", "--step", "0.02", "--log-rate", "50"]].concat());
    coarse.says(&["as the steps are long for this method: lower --step or choose another --stepper"]);
    place.write(
        "loads.toml",
        "format = 1\n[[load]]\nkind = \"sine\"\nframe = \"tcp\"\nforce = [9.0, 0.0, 0.0]\nfrequency = 500.0\n",
    );
    let fast = "a load of 500.0 Hz has 2.0 steps per period: it does not act as written; lower --step";
    told(&place, &[&COMPARE[..], &["--force", "--loads", "loads.toml"]].concat(), &[fast]);
}

#[test]
fn a_pose_names_its_flags() {
    let place = Place::new();
    refused(
        &place,
        &["modes", "robot.toml", "-o", "m"],
        &[
            (&["--seconds", "-1"], "--seconds must be positive and below 1000, found -1 s"),
            (&["--tool-motion", "0"], "--tool-motion must be positive and below 1000, found 0 m"),
            (&["--links", "rigid"], "the robot has no flexible link, so there are no modes to record"),
        ],
    );
    refused(
        &place,
        &["response", "robot.toml", "--no-files"],
        &[
            (&["--points", "1"], "--points must lie between 2 and 100000, found 1"),
            (&["--from", "0"], "--from must be positive (0 needs --spacing linear), found 0 Hz"),
            (&["--from", "-1", "--spacing", "linear"], "--from must be positive or zero, found -1 Hz"),
            (&["--from", "10", "--to", "5"], "--to must lie above --from (10 Hz) and below 1e6 Hz, found 5 Hz"),
            (
                &["--output", "out"],
                "output \"out\" is not known; outputs are [\"x\", \"y\", \"z\", \"rx\", \"ry\", \"rz\"] (the folder is -o)",
            ),
            (&["--output", "x,x"], "output \"x\" is given twice"),
        ],
    );
    refused(
        &place,
        &["inspect", "robot.toml"],
        &[(
            &["--tcp", "no"],
            "TCP frame \"no\" is not a link of the robot; its links are [\"base\", \"bar\", \"ball\"]",
        )],
    );
    place.write("robot.toml", format!("{ROBOT}geometric_stiffening = true\n"));
    let findings = place.json(&["check", "robot.toml", "swing.toml"]);
    assert_eq!(findings["findings"][0]["help"], "add model = \"modal\", or run with --links modal");
}

#[test]
fn a_recording_and_a_report_name_their_flags() {
    let place = Place::new();
    for name in ["a.xyz", "a.csv", "a.mcap", "figures"] {
        place.write(name, "time,x\n");
    }
    let endings = "expected one of .mcap, .rrd, .csv, .parquet: rename the file or give its format with";
    refused(
        &place,
        &["convert"],
        &[
            (&["a.xyz", "b.csv"], &format!("a.xyz: the name has the ending .xyz, {endings} --from")),
            (&["a.csv", "b.xyz"], &format!("b.xyz: the name has the ending .xyz, {endings} --to")),
            (
                &["a.mcap", "b.csv"],
                "a.mcap: found text, beginning \"time,x\"; expected a recording of flexarm in the format MCAP: it looks like a \
             table: name the file *.csv, or say --from csv",
            ),
        ],
    );
    refused(
        &place,
        &["report", "a.csv"],
        &[
            (&["-o", "a.csv"], "a.csv: is input and output: give the output another name or folder"),
            (
                &["--figures"],
                "figures: is a file, a folder with figures is to be written there: choose another place with -o",
            ),
        ],
    );
    let place = Place::new();
    place.write("a.csv", "time,x\n");
    place.write("figures/x", "");
    refused(
        &place,
        &["report", "a.csv", "--figures"],
        &[(&[], "figures: exists already and is not overwritten: choose another place with -o or give --force")],
    );
}

#[test]
fn a_robot_description_names_its_flags() {
    let place = Place::new();
    let xacro = |body: &str| format!("<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"x\">{body}</robot>");
    place.write("arg.xacro", xacro("<xacro:arg name=\"a\"/><link name=\"$(arg a)\"/>"));
    let answer = place.refused(&["inspect", "arg.xacro"], &[]);
    answer.says(&["\n  help: give it with --arg a=VALUE, or by args = { a = ... } in the robot file\n"]);
    place.write("find.xacro", xacro("<link name=\"$(find nowhere)\"/>"));
    let answer = place.refused(&["inspect", "find.xacro"], &[]);
    answer.says(&["\n  help: say where it is with --package nowhere=FOLDER, or by packages in the robot file\n"]);
    place.write("flat.urdf", URDF.replace("ixx=\"0.000288\"", "ixx=\"0.9\""));
    place.refused(&["inspect", "flat.urdf"], &[
        "if the model means it, waive the check by --waive-inertia LINK, or waive_inertia = [\"link\"] in the robot file\n",
    ]);
    let mesh = "<visual><geometry><mesh filename=\"package://nowhere/a.stl\"/></geometry></visual>";
    place.write("beam.urdf", URDF.replace("<link name=\"bar\">", &format!("<link name=\"bar\">{mesh}")));
    let findings = place.json(&["check", "robot.toml", "swing.toml"]);
    let help = "say where it is with --package nowhere=FOLDER, or put the URDF inside the package";
    assert_eq!(findings["findings"][0]["help"], help);
}

/// A bar of two bricks along x, in metres, with the sets A and B at its ends.
fn bar() -> String {
    let number = |i: usize, j: usize, k: usize| 1 + 4 * i + 2 * j + k;
    let (mut nodes, mut bricks) =
        (String::from("*NODE, NSET=NALL\n"), String::from("*ELEMENT, TYPE=C3D8, ELSET=BODY\n"));
    for (i, j, k) in (0..12).map(|n| (n / 4, n / 2 % 2, n % 2)) {
        nodes += &format!("{}, {}, {}, {}\n", number(i, j, k), 0.1 * i as f64, 0.02 * j as f64, 0.02 * k as f64);
    }
    for e in 0..2 {
        let face = |k: usize| [number(e, 0, k), number(e + 1, 0, k), number(e + 1, 1, k), number(e, 1, k)];
        let ids = [face(0), face(1)].concat().iter().map(ToString::to_string).collect::<Vec<_>>();
        bricks += &format!("{}, {}\n", e + 1, ids.join(", "));
    }
    nodes + &bricks + "*NSET, NSET=A\n1, 2, 3, 4\n*NSET, NSET=B\n9, 10, 11, 12\n"
}

#[test]
fn a_reduction_names_its_flags() {
    let place = Place::new();
    place.write("bar.inp", bar());
    let (units, material) = (["--units", "m-kg-s"], ["--material", "steel"]);
    let interfaces = ["--interface", "A=A", "--interface", "B=B"];
    let at = ["--at", "A=0,0.01,0.01", "--at", "B=0.2,0.01,0.01"];
    let all = [&units[..], &material, &interfaces, &at].concat();
    let with = |more: &[&'static str]| [&all[..], more].concat();
    let no_position = |name: &str, x: &str| {
        format!(
            "command line: interface {name:?}: it has no position: --at {name}={x},0.01,0.01 (that is the centroid of its 4 \
             nodes; link frame, in the unit of the mesh), --at {name}=centroid, or frames from a robot with --urdf FILE --link \
             NAME; in a job file xyz = [{x}, 0.01, 0.01], at = \"centroid\" or [urdf]"
        )
    };
    let needs_robot = "needs a robot: --urdf FILE --link NAME, or [urdf] in the job file";
    let sets = "node sets of the mesh: \"A\" (4 nodes), \"B\" (4 nodes), \"NALL\" (12 nodes)";
    let no_nodes = |name: &str| {
        format!("bar.inp: interface {name:?}: it has no nodes: --interface {name}=SELECTOR or select = \"...\"; {sets}")
    };
    refused(
        &place,
        &["reduce", "bar.inp", "--no-files"],
        &[
            (
                &[&material[..], &interfaces, &at].concat(),
                "bar.inp: the units of the mesh are not declared: --units LENGTH-MASS-TIME or units = \"...\"; the mesh is 0.200000 \
             long in its own unit, so 0.2000 m with m-kg-s (N, Pa) and 0.0002 m with mm-t-s (N, MPa)",
            ),
            (
                &[&units[..], &interfaces, &at].concat(),
                "bar.inp: no material for region [\"BODY\"]: --material MATERIAL for all, --material REGION=MATERIAL for one, or \
             material = ... in the job file, where MATERIAL is steel, aluminium, cast_iron, ductile_iron, or E,nu,rho in SI such \
             as 70e9,0.33,2700 (Pa, -, kg/m3)",
            ),
            (
                &[&units[..], &material, &interfaces].concat(),
                &format!("{}\n{}", no_position("A", "0"), no_position("B", "0.2")),
            ),
            (&[&units[..], &material, &at].concat(), &format!("{}\n{}", no_nodes("A"), no_nodes("B"))),
            (
                &[&units[..], &material, &interfaces, &["--at", "A=joint:x", "--at", "B=joint:y"]].concat(),
                &format!(
                    "command line: interface \"A\": joint \"x\" {needs_robot}\ncommand line: interface \"B\": joint \"y\" {needs_robot}"
                ),
            ),
            (
                &with(&["--name", "a/b"]),
                "\"a/b\" is not a valid link name: use one that can be part of a file name (--name)",
            ),
            (&with(&["--modes", "5000"]), "--modes 5000: at most 1000 modes can be kept"),
            (&with(&["--modes-up-to", "-1"]), "--modes-up-to -1: a positive frequency in Hz is expected"),
            (&with(&["--chains", "1"]), "--chains 1: a chain has 2 to 100 parts"),
            (&with(&["--merge", "-1"]), "merge = -1: a distance of zero or more, in the unit of the mesh"),
        ],
    );
}

#[test]
fn an_import_and_an_export_name_their_flags() {
    let place = Place::new();
    place.write("bar.flex", flex::text(&flex::stiffness_12()));
    let export = ["export", "bar.flex", "--format", "simscape", "--units", "m-kg-s", "-o"];
    assert_eq!(place.flexarm(&[&export[..], &["e"]].concat()).code, 0);
    let readme = place.text("e/bar_README.txt");
    for line in [
        "map for flexarm import: --map \"A=#1-6,B=#7-12\" --units m-kg-s\n",
        "\n  B: --at B=0.8,0,0\n",
        "\n  --part-a \"",
    ] {
        assert!(readme.contains(line), "{line:?} is not in\n{readme}");
    }
    refused(
        &place,
        &export,
        &[
            (
                &["f", "--nodes", "1,1"],
                "--nodes has [1, 1]; 2 distinct numbers between 1 and 99999999 are required, one per interface, proximal first",
            ),
            (&["e"], "e/bar_K.csv: exists already and is not overwritten: choose another place, or give --force"),
        ],
    );
    let (units, map, at) =
        (["--units", "m-kg-s"], ["--map", "A=#1-6,B=#7-12"], ["--at", "A=0,0,0", "--at", "B=0.8,0,0"]);
    let mass = ["--mass", "1.728", "--com", "0.4,0,0", "--inertia", "0.0003,0.0924,0.0922,0,0,0"];
    let with = |more: &[&'static str]| [&units[..], &map, &at, &mass, more].concat();
    let no_place = "e/bar_K.csv: the file does not contain the interface positions (unit of the file, link axes): the stiffness \
                    implies, relative to A: B at (0.800000, 0.000000, 0.000000); if A is the origin of the link: --at A=0,0,0 --at \
                    B=0.800000,0.000000,0.000000";
    let no_map = "e/bar_K.csv: the rows of interfaces A and B are not specified: if the proximal interface comes first: --map \
                  \"A=#1-6,B=#7-12\"";
    let no_units = "e/bar_K.csv: the units of the file are not declared: --units LENGTH-MASS-TIME, such as --units m-kg-s (N, Pa) \
                    or --units mm-t-s (N, MPa); matrix files do not contain them";
    refused(
        &place,
        &["import", "e/bar_K.csv", "--no-files"],
        &[
            (&[], &format!("{no_units}\n{no_map}\n{no_place}")),
            (&[&units[..], &map].concat(), no_place),
            (&with(&["--at", "X=0,0,0"]), "--at names interface \"X\", the map has [\"A\", \"B\"]"),
            (&with(&["--at", "A=0,0,0"]), "--at A=... is given twice"),
            (
                &with(&["--format", "dmig"]),
                "e/bar_K.csv: is comma-separated matrix according to its content, but --format gives another format: omit it",
            ),
            (
                &[&units[..], &map, &["--at", "A=0,0,0", "--at", "B=0,0,0"]].concat(),
                "interfaces \"A\" and \"B\" are at the same point; a link needs a length",
            ),
        ],
    );
    let modes = "--modes applies only to full models; these matrices are already reduced";
    told(&place, &[&["import", "e/bar_K.csv", "--no-files"], &with(&["--modes", "3"])[..]].concat(), &[modes]);
    // A sidecar file next to the matrices defines units and positions; options override it.
    let matrices = ["export", "bar.flex", "--format", "matrix-market", "--units", "m-kg-s", "-o", "m"];
    assert_eq!(place.flexarm(&matrices).code, 0);
    let otherwise = ["import", "m/bar_K.mtx", "--no-files", "--units", "cm-kg-s", "--at", "B=0.8,0,0.00001"];
    told(
        &place,
        &[&otherwise[..], &["--mass", "1.7", "--com", "0.004,0,0", "--inertia", "0.0003,0.09,0.09,0,0,0"]].concat(),
        &[
            "the units are m-kg-s in the sidecar and cm-kg-s from the command line; the latter are used",
            "interface B: its position in the sidecar is [0.8, 0.0, 0.0], --at gives [0.8, 0.0, 1e-5], which is used",
        ],
    );
}

#[test]
fn a_word_that_is_no_number_is_answered_with_how_numbers_are_written() {
    let place = Place::new();
    let float = "tip: numbers have a decimal point and no unit, such as 500, 0.002 or 2e-3";
    for (flag, found) in [("--log-rate", "fast"), ("--step", "1ms"), ("--settling-band", "0,1"), ("--magnify", "")] {
        place.refused(&[&COMPARE[..], &[flag, found]].concat(), &[flag, found, float]);
    }
    for found in ["two", "2.5"] {
        let whole = ["--segments", found, "tip: a whole number is expected, such as 8"];
        place.refused(&[&COMPARE[..], &["--segments", found]].concat(), &whole);
    }
}
