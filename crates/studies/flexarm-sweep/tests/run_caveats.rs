//! Caveats of many runs, said once.

use flexarm_run::Finding;
use flexarm_run::caveat::FindingKind;
use flexarm_sweep::internals::{Answer, figures, stored_caveats, warnings};

const EFFORT: FindingKind =
    FindingKind::warning("effort", "{where} needs {value}, its limit is {yardstick}", "N m", "");
const SLOW_MODE: FindingKind = FindingKind::warning("first-frequency", "{where}: {value}, {yardstick}", "Hz", "");
const SAG: FindingKind = FindingKind::warning("sag", "{where} sags by {value}, {yardstick}", "m", "");

fn answer(run: usize, caveats: Vec<Finding>) -> Answer {
    Answer { run, result: Ok(Vec::new()), stored: stored_caveats(caveats, &|text| text.replace("/home/me/", "")) }
}

#[test]
fn a_caveat_of_many_runs_is_said_once_with_its_worst_value_and_how_often() {
    let effort = |x: f64| EFFORT.found("joint 2", x, 100.0);
    let slow = |hz: f64| SLOW_MODE.found("the arm", hz, 3.0).as_note();
    let file =
        |n: u32| Finding::warning("trajectory", "/home/me/a.csv", format!("/home/me/a.csv: {n} rows repeat"), "");
    let answers = [
        answer(0, vec![effort(120.0), slow(2.0)]),
        answer(1, vec![effort(150.0), slow(1.0), file(2)]),
        answer(2, vec![effort(130.0), SAG.found("the TCP", 0.3, 2.0)]),
        answer(3, vec![SAG.found("the TCP", 0.5, 2.0), SAG.found("the TCP", 0.4, 2.0), file(3)]),
        answer(4, vec![]),
    ];
    let found = figures(answers.iter());
    let shown: Vec<_> = found.iter().map(|f| (f.caveat.code.as_str(), f.runs, f.worst_run, f.caveat.value)).collect();
    assert_eq!(shown[..2], [("effort", 3, 1, Some(150.0)), ("sag", 2, 3, Some(0.4))]);
    assert_eq!(shown[2..], [("trajectory", 2, 1, None), ("first-frequency", 2, 1, Some(1.0))]);
    let said = warnings(&found, 5);
    assert_eq!(said.len(), 3);
    assert!(said[0].ends_with("(3 of 5 runs; worst in run 1)") && said[0].contains("150"), "{said:?}");
    assert_eq!(said[2], "a.csv: 2 rows repeat (2 of 5 runs, the first is run 1)");
    assert_eq!(answers[4].stored, None);
}

#[test]
fn a_warning_of_some_runs_goes_before_a_note_of_many() {
    let sag = |x: f64| SAG.found("the TCP", x, 2.0);
    let found = figures([answer(0, vec![sag(0.1).as_note()]), answer(1, vec![sag(0.3)])].iter());
    assert_eq!((found.len(), found[0].runs, found[0].worst_run, found[0].caveat.warns()), (1, 1, 1, true));
}
