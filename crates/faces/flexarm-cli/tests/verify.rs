//! `flexarm verify`: files, refusals, the check of a stored page, exit codes.

use crate::common::{self, Place};

const CASE: [&str; 3] = ["verify", "one-beam", "--quick"];

#[test]
fn a_case_is_written_once_and_then_checked() {
    let place = Place::new();
    let found = place.json(&[&CASE[..], &["-o", "page"]].concat());
    assert_eq!(found["passed"], true);
    assert!(found["wall_s"].as_f64().unwrap() > 0.0);
    let claims = found["claims"].as_array().unwrap();
    assert!(claims.len() > 20 && claims.iter().all(|c| c["case"] == "one-beam" && c["claim"]["holds"] == true));
    assert_eq!(found["file"], "page/verification.md");
    // The page refers to its pictures and they exist.
    let page = place.text("page/verification.md");
    assert!(
        page.contains("## 1. One beam")
            && page.contains("| --- |")
            && page.contains("part of the page: one-beam, quick")
    );
    let pictures: Vec<&str> =
        page.split("](verification/").skip(1).map(|rest| rest.split(')').next().unwrap()).collect();
    assert!(pictures.len() >= 4);
    for picture in pictures {
        assert!(place.text(&format!("page/verification/{picture}")).starts_with("<svg"), "{picture}");
    }
    let numbers: serde_json::Value = serde_json::from_slice(&place.read("page/verification.json")).unwrap();
    assert_eq!(numbers["cases"][0]["name"], "one-beam");

    place.refused(&[&CASE[..], &["-o", "page"]].concat(), &["verification.md", "--force"]);

    // The command prints the same page; a changed number is reported with its location.
    let check = [&CASE[..], &["--check", "page/verification.md"]].concat();
    let same = place.flexarm(&check);
    assert_eq!((same.code, same.out.contains("is what this command prints")), (0, true), "{}", same.out);
    let line = page.lines().position(|line| line.contains("| F_y | 91.4286 |")).unwrap() + 1;
    place.write("page/verification.md", page.replacen("| F_y | 91.4286 |", "| F_y | 95.4286 |", 1));
    let other = place.flexarm(&check);
    assert_eq!(other.code, 1, "{}", other.out);
    assert!(other.out.contains(&format!("line {line}\n")) && other.out.contains("95.4286"), "{}", other.out);

    // A missing picture is reported too.
    place.write("page/verification.md", &page);
    std::fs::remove_file(place.path("page/verification/one-beam-steps.svg")).unwrap();
    let gone = place.flexarm(&check);
    assert_eq!((gone.code, gone.out.contains("one-beam-steps.svg")), (1, true), "{}", gone.out);
}

/// Ctrl-C within a long case stops at once, and leaves nothing behind.
#[cfg(unix)]
#[test]
fn a_stopped_verification_leaves_nothing() {
    let place = Place::new();
    let before = place.snapshot();
    let mut command = place.command(&["verify", "manipulator", "-o", "page"]);
    let mut child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_secs(4));
    let pid = child.id().to_string();
    assert!(std::process::Command::new("/bin/kill").args([common::stop_signal(), &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert!(place.snapshot() == before);
}

#[test]
fn what_cannot_be_run_is_refused_with_what_can() {
    let place = Place::new();
    place.refused(&["verify", "two-beams"], &["two-beams", "one-beam", "manipulator"]);
    place.refused(
        &["verify", "one-beam", "--data", "nowhere", "--no-files", "-q"],
        &["nowhere/robots/one_beam/robot.toml"],
    );
    place.refused(&["verify", "one-beam", "--check", "no.md"], &["no.md", "cannot be read"]);
    place.refused(&["verify", "--no-files", "-o", "x"], &["--no-files"]);
}
