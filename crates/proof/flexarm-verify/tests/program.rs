//! The program: files, refusals, the check of a stored page, exit codes.

use std::path::{Path, PathBuf};
use std::process::Command;

const CASE: [&str; 2] = ["one-beam", "--quick"];

/// A temporary folder, removed at the end of its test. The program runs in it.
struct Place(PathBuf);

/// Exit code, standard output and standard error of a run.
struct Answer {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("flexarm-verify-{name}-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        Self(folder)
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.join(name)
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn run(&self, arguments: &[&str]) -> Answer {
        let mut command = Command::new(env!("CARGO_BIN_EXE_flexarm-verify"));
        let output = command.args(arguments).current_dir(&self.0).output().unwrap();
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        Answer { code: output.status.code(), out, err }
    }

    /// The program must exit with 2, mention every word, and print nothing on standard output.
    fn refused(&self, arguments: &[&str], words: &[&str]) {
        let Answer { code, out, err } = self.run(arguments);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
        assert!(words.iter().all(|word| err.contains(word)), "{words:?}: {err}");
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_case_is_written_once_and_then_checked() {
    let place = Place::new("page");
    let answer = place.run(&[&CASE[..], &["-o", "page", "--json"]].concat());
    assert_eq!((answer.code, answer.err.as_str()), (Some(0), "  0 %  one-beam\n"));
    let found: serde_json::Value = serde_json::from_str(&answer.out).unwrap();
    assert_eq!(found["passed"], true);
    assert!(found["wall_s"].as_f64().unwrap() > 0.0);
    let claims = found["claims"].as_array().unwrap();
    assert!(claims.len() > 20 && claims.iter().all(|c| c["case"] == "one-beam" && c["claim"]["holds"] == true));
    assert_eq!(found["file"], "page/verification.md");
    // The first page leads to that of the case, which refers to its pictures; they exist.
    let first = place.text("page/verification.md");
    assert!(
        first.contains("[1. One beam](verification/one-beam.md)") && first.contains("A part of the cases: one-beam")
    );
    let page = place.text("page/verification/one-beam.md");
    assert!(page.starts_with("# 1. One beam") && page.contains("## Claims"));
    let pictures: Vec<&str> =
        page.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()).filter(|p| p.ends_with(".svg")).collect();
    assert!(pictures.len() >= 4);
    for picture in pictures {
        assert!(place.text(&format!("page/verification/{picture}")).starts_with("<svg"), "{picture}");
    }
    let numbers: serde_json::Value = serde_json::from_str(&place.text("page/verification.json")).unwrap();
    assert_eq!(numbers["cases"][0]["name"], "one-beam");

    place.refused(&[&CASE[..], &["-o", "page"]].concat(), &["verification.md", "--force"]);

    // The program writes the same page; a changed number is reported with its location.
    let check = [&CASE[..], &["--check", "page/verification.md"]].concat();
    let same = place.run(&check);
    assert_eq!((same.code, same.out.contains("is what this program writes")), (Some(0), true), "{}", same.out);
    let line = page.lines().position(|line| line.contains("| F_y | 91.4286 |")).unwrap() + 1;
    let changed = page.replacen("| F_y | 91.4286 |", "| F_y | 95.4286 |", 1);
    std::fs::write(place.path("page/verification/one-beam.md"), changed).unwrap();
    let other = place.run(&check);
    assert_eq!(other.code, Some(1), "{}", other.out);
    assert!(
        other.out.contains(&format!("one-beam.md, line {line}\n")) && other.out.contains("95.4286"),
        "{}",
        other.out
    );

    // A missing picture is reported too.
    std::fs::write(place.path("page/verification/one-beam.md"), &page).unwrap();
    std::fs::remove_file(place.path("page/verification/one-beam-steps.svg")).unwrap();
    let gone = place.run(&check);
    assert_eq!((gone.code, gone.out.contains("one-beam-steps.svg")), (Some(1), true), "{}", gone.out);
}

#[test]
fn what_cannot_be_run_is_refused_with_what_can() {
    let place = Place::new("refused");
    place.refused(&["two-beams"], &["two-beams", "one-beam", "manipulator"]);
    place.refused(
        &["one-beam", "--data", "nowhere", "--no-files"],
        &["nowhere/robots/test/one_beam/robot.toml", "checkout"],
    );
    place.refused(&["one-beam", "--check", "no.md"], &["no.md", "cannot be read"]);
    place.refused(&["--no-files", "-o", "x"], &["--no-files"]);
    assert_eq!(std::fs::read_dir(place.path("")).unwrap().count(), 0);
}
