//! A quick subset of the case studies: every claim holds, and repeating the command gives identical
//! bytes.

use std::path::Path;

use flexarm_verify::bench::Bench;
use flexarm_verify::{Verification, case_names, verify};

fn bench() -> Bench {
    Bench { root: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.."), scratch: std::env::temp_dir(), quick: true }
}

fn quick(names: &[&str]) -> Verification {
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    verify(&bench(), &names, &mut |_, _| ()).expect("the checkout has what the cases need")
}

/// Truths: those of the claims themselves (closed forms, CalculiX, NGSolve, Pinocchio, the stepper
/// with error control).
#[test]
fn every_claim_of_the_quick_cases_holds() {
    let found = quick(&[]);
    let broken: Vec<String> = found
        .cases
        .iter()
        .flat_map(|case| case.claims())
        .filter(|claim| !claim.holds)
        .map(|claim| format!("{}: {} {}", claim.text, claim.found(), claim.limit()))
        .collect();
    assert!(found.passed && broken.is_empty(), "{broken:#?}");
    // No case was left out.
    assert_eq!(found.cases.len(), case_names().len());
    assert!(found.cases.iter().all(|case| case.claims().count() >= 3));
}

#[test]
fn the_same_case_gives_the_same_bytes() {
    let [a, b] = [(); 2].map(|()| quick(&["one-beam"]));
    assert_eq!(a.pages(), b.pages());
    assert_eq!(a.json(), b.json());
    assert_eq!(a.pictures().expect("drawn"), b.pictures().expect("drawn"));
}

/// A stiffness error of 1e-5 must not pass: the claims are able to fail.
#[test]
fn a_link_that_is_slightly_wrong_breaks_claims() {
    let folder = std::env::temp_dir().join(format!("flexarm-verify-{}", std::process::id()));
    copy(&bench().root.join("robots/test/one_beam"), &folder.join("robots/test/one_beam"));
    copy(&bench().root.join("tests/verification"), &folder.join("tests/verification"));
    let file = folder.join("robots/test/one_beam/robot.toml");
    let text = std::fs::read_to_string(&file).expect("copied");
    assert!(text.contains("height = 0.04,"));
    std::fs::write(&file, text.replace("height = 0.04,", "height = 0.0400002,")).expect("written");
    let wrong = Bench { root: folder.clone(), ..bench() };
    let found = verify(&wrong, &["one-beam".to_owned()], &mut |_, _| ()).expect("runs");
    let broken = found.cases[0].claims().filter(|claim| !claim.holds && claim.text.starts_with("end loads")).count();
    assert!(!found.passed && broken >= 5, "{broken} claims broke");
    std::fs::remove_dir_all(&folder).expect("removed");
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("made");
    for entry in std::fs::read_dir(from).expect("there") {
        let path = entry.expect("readable").path();
        let target = to.join(path.file_name().expect("named"));
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).expect("copied");
        }
    }
}

/// Progress grows from 0 to at most 1.
#[test]
fn a_run_tells_how_far_it_is() {
    let mut shares: Vec<(f64, String)> = Vec::new();
    let found = verify(&bench(), &["one-beam".into(), "manipulator".into()], &mut |share, name| {
        shares.push((share, name.to_owned()));
    });
    assert!(found.expect("runs").passed);
    assert!(shares.windows(2).all(|pair| pair[0].0 <= pair[1].0 + 1e-12) && shares[0].0 == 0.0);
    let last = &shares[shares.len() - 1];
    assert!(last.1 == "manipulator" && (0.5..=1.0).contains(&last.0), "{last:?}");
}

#[test]
fn unknown_cases_and_missing_files_are_named() {
    let mut go = |_: f64, _: &str| ();
    let error = verify(&bench(), &["no-beam".to_owned()], &mut go).expect_err("unknown").to_string();
    assert!(error.contains("no-beam") && error.contains("one-beam") && error.contains("manipulator"), "{error}");
    let nowhere = Bench { root: "/nowhere".into(), ..bench() };
    let error = verify(&nowhere, &["one-beam".to_owned()], &mut go).expect_err("missing").to_string();
    assert!(error.contains("/nowhere/robots/test/one_beam/robot.toml"), "{error}");
}
