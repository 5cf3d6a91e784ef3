//! `flexarm view` with shell scripts as viewers: which one is started, its arguments, and the
//! messages on failure.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::{Answer, Place};

/// Answers `--version`, otherwise logs its arguments and stays open.
const VIEWER: &str = r#"#!/bin/sh
case "$*" in *--version*) echo "rerun-cli 0.36.3 [rustc 1.95.0] x86_64 release-0.36.3"; exit 0 ;; esac
echo "$*" > "$NOTE"
exec /bin/sleep 20
"#;

/// A folder with recordings, and a folder `bin` that is the whole search path.
fn place(programs: &[(&str, &str)]) -> Place {
    let place = Place::new();
    std::fs::create_dir(place.path("bin")).unwrap();
    for (name, script) in programs {
        place.write(&format!("bin/{name}"), script);
        let all = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(place.path(&format!("bin/{name}")), all).unwrap();
    }
    for name in ["both/run.rrd", "both/run.mcap", "one/run.mcap", "report.html", "none/notes.txt"] {
        place.write(name, "content");
    }
    place
}

fn view(place: &Place, arguments: &[&str]) -> Answer {
    let mut command = place.command(&[&["view"], arguments].concat());
    Answer::of(command.env("PATH", place.path("bin")).env("NOTE", place.path("note")).output().unwrap())
}

/// Ends a viewer that a test left open, by its process id.
fn close(answer: &Answer) {
    let pid = answer.json()["pid"].as_u64().unwrap().to_string();
    assert!(std::process::Command::new("/bin/kill").arg(pid).status().unwrap().success(), "the viewer is gone already");
}

#[test]
fn a_run_folder_opens_its_rrd_and_the_command_returns_while_the_viewer_stays() {
    let place = place(&[("rerun", VIEWER)]);
    let begin = Instant::now();
    let answer = view(&place, &["both", "--json"]);
    assert_eq!((answer.code, answer.err.as_str()), (0, ""));
    assert!(begin.elapsed() < Duration::from_secs(15), "it waited for the viewer");
    let seen = answer.json();
    assert_eq!(seen["file"], "both/run.rrd");
    assert_eq!((&seen["viewer"], &seen["version"]), (&"rerun".into(), &"0.36.3".into()));
    assert_eq!(place.text("note"), "both/run.rrd\n");
    close(&answer);
}

/// Python takes nothing from the working folder, its variables or the folder of the user.
#[test]
fn without_a_viewer_on_the_path_that_of_python_is_used() {
    let place = place(&[("python3", VIEWER)]);
    let answer = view(&place, &["both", "--json"]);
    assert_eq!(answer.code, 0, "{}", answer.err);
    assert_eq!(answer.json()["viewer"], "python3 -I -m rerun");
    assert_eq!(place.text("note"), "-I -m rerun both/run.rrd\n");
    close(&answer);
}

/// A real Python, without the packages that are installed for it.
#[test]
fn a_module_of_that_name_in_the_working_folder_is_not_executed() {
    let python = "#!/bin/sh\nexec /usr/bin/python3 -S \"$@\"\n";
    let place = place(&[("python3", python)]);
    place.write("rerun.py", "open('note', 'w')\n");
    if Path::new("/usr/bin/python3").exists() {
        let answer = view(&place, &["both/run.rrd"]);
        assert_eq!(answer.code, 1, "{}", answer.err);
        assert!(!place.path("note").exists());
    }
}

#[cfg(not(feature = "rerun"))]
#[test]
fn a_run_without_rrd_needs_a_program_with_rerun_and_is_refused_with_its_command() {
    let place = place(&[("rerun", VIEWER)]);
    for given in ["one", "one/run.mcap"] {
        let words = ["cargo run --release --features rerun -- view one/run.mcap", "Foxglove", "PlotJuggler"];
        place.refused(&["view", given], &words);
    }
}

/// Truth: the name and the first bytes of the file that the viewer gets.
#[cfg(all(feature = "rerun", feature = "mcap"))]
#[test]
fn an_mcap_is_shown_by_a_recording_beside_it_or_a_temporary_one_and_nothing_is_overwritten() {
    let place = place(&[("rerun", &VIEWER.replace("exec /bin/sleep 20", "exit 0"))]);
    place.json(&["compare", "robot.toml", "swing.toml", "-o", "result"]);
    std::fs::rename(place.path("result/run.mcap"), place.path("one/run.mcap")).unwrap();
    for given in ["one", "one/run.mcap"] {
        assert_eq!(view(&place, &[given, "--json"]).json()["file"], "one/run.rrd");
        assert!(place.read("one/run.rrd").starts_with(b"RRF2"));
    }
    // A file of that name that is older than the recording stays, and another one is shown.
    place.write("one/run.rrd", "older");
    let old = std::fs::File::options().write(true).open(place.path("one/run.rrd")).unwrap();
    old.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    let shown = view(&place, &["one/run.mcap", "--json"]).json()["file"].as_str().unwrap().to_owned();
    assert_eq!(place.text("one/run.rrd"), "older");
    let shown = Path::new(&shown);
    assert!(std::fs::read(shown).unwrap().starts_with(b"RRF2") && shown.starts_with(std::env::temp_dir()));
    std::fs::remove_dir_all(shown.parent().unwrap()).unwrap();
}

/// Another program named `rerun`, and a python3 without the module.
#[test]
fn without_a_viewer_it_is_said_how_to_get_one() {
    let other = "#!/bin/sh\necho watching files 1.2.3\n";
    let no_module = "#!/bin/sh\necho No module named rerun >&2\nexit 1\n";
    for programs in [vec![], vec![("rerun", other), ("python3", no_module)]] {
        let answer = view(&place(&programs), &["both/run.rrd"]);
        assert_eq!((answer.code, answer.out.as_str()), (1, ""));
        answer.says(&["pip install \"rerun-sdk>=0.36.3\"", "cargo install rerun-cli", "Foxglove"]);
    }
}

#[test]
fn a_viewer_that_cannot_start_is_reported_with_what_it_said() {
    let script = VIEWER.replace("exec /bin/sleep 20", "echo no display >&2\nexit 7");
    let place = place(&[("rerun", &script)]);
    for extra in [None, Some("--wait")] {
        let answer = view(&place, &[&["both/run.rrd"], extra.as_slice()].concat());
        assert_eq!((answer.code, answer.out.as_str()), (1, ""));
        answer.says(&["rerun both/run.rrd", "7", "no display"]);
    }
}

/// A second viewer passes the file to the first and exits.
#[test]
fn a_viewer_that_ends_well_at_once_is_no_failure() {
    let place = place(&[("rerun", &VIEWER.replace("exec /bin/sleep 20", "exit 0"))]);
    let answer = view(&place, &["both/run.rrd"]);
    assert_eq!((answer.code, answer.err.as_str()), (0, ""));
    assert!(answer.out.contains("open already"), "{}", answer.out);
}

#[test]
fn waiting_lasts_as_long_as_the_viewer_and_ends_as_it_ends() {
    for (code, expected) in [(0, 0), (4, 1)] {
        let end = format!("/bin/sleep 1.5\necho closed >> \"$NOTE\"\nexit {code}");
        let place = place(&[("rerun", &VIEWER.replace("exec /bin/sleep 20", &end))]);
        let answer = view(&place, &["both", "--wait"]);
        assert_eq!(answer.code, expected, "{}", answer.err);
        assert!(place.text("note").ends_with("closed\n"));
    }
}

/// A viewer shows the `.rrd` files of older versions.
#[test]
fn a_viewer_older_than_the_files_gives_a_warning() {
    let place = |version: &str| {
        let script = VIEWER.replace("0.36.3", version).replace("exec /bin/sleep 20", "exit 0");
        self::place(&[("rerun", &script)])
    };
    for version in ["0.29.1", "0.36.2"] {
        let place = place(version);
        let answer = view(&place, &["both/run.rrd"]);
        assert_eq!(answer.code, 0);
        answer.says(&["warning", "0.36.3", version, "pip install \"rerun-sdk>=0.36.3\""]);
        assert_eq!(view(&place, &["both/run.rrd", "-q"]).err, "");
    }
    assert_eq!(view(&place("0.100.0"), &["both/run.rrd"]).err, "");
}

#[test]
fn what_cannot_be_viewed_is_refused_with_what_can() {
    let place = place(&[("rerun", VIEWER)]);
    for (file, word) in [("swing.toml", "cannot be viewed"), ("none", "no run.rrd"), ("missing.rrd", "no such file")] {
        place.refused(&["view", file], &[file, word, ".mcap"].map(|w| w.trim_start_matches('.')));
    }
}

#[test]
fn a_report_goes_to_the_browser_or_is_named() {
    let place = place(&[]);
    let answer = view(&place, &["report.html"]);
    assert_eq!(answer.code, 0);
    assert!(answer.out.contains("browser") && answer.out.contains("file:///"), "{}", answer.out);
    assert!(view(&place, &["report.html", "--json"]).json()["viewer"].is_null());
    // A folder with only a report shows that.
    place.write("pages/report.html", "content");
    assert_eq!(view(&place, &["pages", "--json"]).json()["file"], "pages/report.html");

    let opener = "#!/bin/sh\necho \"$*\" > \"$NOTE\"\n";
    if cfg!(target_os = "linux") {
        let place = self::place(&[("xdg-open", opener)]);
        assert_eq!(view(&place, &["report.html", "--json"]).json()["viewer"], "xdg-open");
        assert!(place.text("note").trim_end().ends_with("report.html"));
    }
}

#[test]
fn a_relative_entry_of_the_path_offers_no_viewer() {
    let place = place(&[("rerun", VIEWER)]);
    for path in ["bin", "bin:", "./bin:/none"] {
        let mut command = place.command(&["view", "both"]);
        let answer = Answer::of(command.env("PATH", path).env("NOTE", place.path("note")).output().unwrap());
        assert_eq!(answer.code, 1, "{path}: {}", answer.err);
        answer.says(&["there is no Rerun viewer"]);
        assert!(!place.path("note").exists(), "{path}");
    }
}
