//! `flexarm view` with shell scripts as viewers: which one is started, its arguments, and the
//! messages on failure.

use std::os::unix::fs::PermissionsExt;
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

#[test]
fn a_run_folder_without_rrd_opens_its_mcap_with_the_viewer_of_python() {
    let place = place(&[("python3", VIEWER)]);
    let answer = view(&place, &["one", "--json"]);
    assert_eq!(answer.code, 0, "{}", answer.err);
    assert_eq!(answer.json()["viewer"], "python3 -m rerun");
    assert_eq!(place.text("note"), "-m rerun one/run.mcap\n");
    close(&answer);
}

/// Another program named `rerun`, and a python3 without the module.
#[test]
fn without_a_viewer_it_is_said_how_to_get_one() {
    let other = "#!/bin/sh\necho watching files 1.2.3\n";
    let no_module = "#!/bin/sh\necho No module named rerun >&2\nexit 1\n";
    for programs in [vec![], vec![("rerun", other), ("python3", no_module)]] {
        let answer = view(&place(&programs), &["both/run.rrd"]);
        assert_eq!((answer.code, answer.out.as_str()), (1, ""));
        answer.says(&["pip install rerun-sdk==0.36.3", "cargo install rerun-cli --version 0.36.3", "Foxglove"]);
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
    let answer = view(&place, &["both/run.mcap"]);
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

/// `.rrd` files depend on the viewer version, `.mcap` files do not.
#[test]
fn another_version_of_the_viewer_gives_a_warning_for_rrd_only() {
    let script = VIEWER.replace("0.36.3", "0.29.1").replace("exec /bin/sleep 20", "exit 0");
    let place = place(&[("rerun", &script)]);
    let answer = view(&place, &["both/run.rrd"]);
    assert_eq!(answer.code, 0);
    answer.says(&["warning", "0.36", "0.29.1", "pip install rerun-sdk==0.36.3"]);
    assert_eq!(view(&place, &["both/run.rrd", "-q"]).err, "");
    assert_eq!(view(&place, &["both/run.mcap"]).err, "");
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
