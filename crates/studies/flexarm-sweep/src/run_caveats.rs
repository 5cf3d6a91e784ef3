//! Caveats of the runs of a study, stored with each result, and merged over all runs.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use serde::Serialize;

use super::evaluate::Answer;
use flexarm_run::Caveat;
use flexarm_run::Severity;
use flexarm_run::caveat::once_each;

/// Caveats of a run as JSON; `None` if there are none. Runs with equal caveats share one text.
pub(super) type CaveatText = Option<Arc<str>>;

/// Caveat with the runs it concerns, represented by the worst of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaveatFigures {
    /// Caveat with the worst value.
    #[serde(flatten)]
    pub caveat: Caveat,
    /// Number of runs with this caveat.
    pub runs: usize,
    /// Number of the run with the worst value.
    pub worst_run: usize,
}

/// Serialises the caveats of a run; `plain` removes parts of a text that depend on the machine.
pub(super) fn stored_caveats(caveats: Vec<Caveat>, plain: &dyn Fn(String) -> String) -> CaveatText {
    if caveats.is_empty() {
        return None;
    }
    let plain = |caveat: Caveat| Caveat { location: plain(caveat.location), message: plain(caveat.message), ..caveat };
    let caveats: Vec<Caveat> = once_each(caveats).into_iter().map(plain).collect();
    serde_json::to_string(&caveats).ok().map(Arc::from)
}

/// Merges the caveats of all runs, warnings first.
pub(super) fn figures<'a>(answers: impl Iterator<Item = &'a Answer>) -> Vec<CaveatFigures> {
    let mut read: HashMap<&str, Vec<Caveat>> = HashMap::new();
    let mut found: BTreeMap<(String, String, String), CaveatFigures> = BTreeMap::new();
    for answer in answers {
        let Some(text) = &answer.stored else { continue };
        let caveats = read.entry(text).or_insert_with(|| serde_json::from_str(text).unwrap_or_default());
        for caveat in caveats.iter() {
            let new = || CaveatFigures { caveat: caveat.clone(), runs: 0, worst_run: answer.run };
            let known = found.entry(key(caveat)).or_insert_with(new);
            if caveat.severity < known.caveat.severity {
                *known = new();
            }
            if caveat.severity == known.caveat.severity {
                known.runs += 1;
                if badness(caveat) > badness(&known.caveat) {
                    (known.caveat, known.worst_run) = (caveat.clone(), answer.run);
                }
            }
        }
    }
    let mut found: Vec<CaveatFigures> = found.into_values().collect();
    found.sort_by(|a, b| a.caveat.severity.cmp(&b.caveat.severity).then(b.runs.cmp(&a.runs)));
    found
}

/// Returns the key of caveats to merge: kind and location, and for caveats without a value also the
/// message without its digits.
fn key(caveat: &Caveat) -> (String, String, String) {
    let words = match caveat.value {
        Some(_) => String::new(),
        None => caveat.message.chars().filter(|c| !c.is_ascii_digit()).collect(),
    };
    (caveat.code.clone(), caveat.location.clone(), words)
}

/// Returns the severity of a caveat's value among others of its kind: its distance from the
/// yardstick.
fn badness(caveat: &Caveat) -> f64 {
    let (Some(value), Some(yardstick)) = (caveat.value, caveat.yardstick) else { return 0.0 };
    match caveat.code.as_str() {
        // These yardsticks are not limits: the reach of the arm, critical damping, the frequency
        // that needs ten samples.
        "sag" | "damped-mode" => value / yardstick,
        "few-samples" => yardstick / value,
        _ if value > 0.0 && yardstick > 0.0 => (value / yardstick).ln().abs(),
        _ => (value - yardstick).abs(),
    }
}

/// Returns the sentences of the warnings, with the number of runs they concern.
pub(super) fn warnings(caveats: &[CaveatFigures], runs: usize) -> Vec<String> {
    let stored = |figures: &CaveatFigures| {
        let CaveatFigures { caveat, runs: own, worst_run } = figures;
        let all = own == &runs;
        let which = match (all, caveat.value) {
            (true, None) => format!("all {runs} runs"),
            (true, Some(_)) => format!("all {runs} runs; worst in run {worst_run}"),
            (false, None) => format!("{own} of {runs} runs, the first is run {worst_run}"),
            (false, Some(_)) => format!("{own} of {runs} runs; worst in run {worst_run}"),
        };
        format!("{} ({which})", caveat.message)
    };
    caveats.iter().filter(|figures| figures.caveat.severity == Severity::Warning).map(stored).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexarm_run::caveat::CaveatKind;

    const EFFORT: CaveatKind =
        CaveatKind::warning("effort", "{where} needs {value}, its limit is {yardstick}", "N m", "");
    const SLOW_MODE: CaveatKind = CaveatKind::warning("first-frequency", "{where}: {value}, {yardstick}", "Hz", "");
    const SAG: CaveatKind = CaveatKind::warning("sag", "{where} sags by {value}, {yardstick}", "m", "");

    fn answer(run: usize, caveats: Vec<Caveat>) -> Answer {
        Answer { run, result: Ok(Vec::new()), stored: stored_caveats(caveats, &|text| text.replace("/home/me/", "")) }
    }

    #[test]
    fn a_caveat_of_many_runs_is_said_once_with_its_worst_value_and_how_often() {
        let effort = |x: f64| EFFORT.found("joint 2", x, 100.0);
        let slow = |hz: f64| SLOW_MODE.found("the arm", hz, 3.0).as_note();
        let file = |n: u32| {
            Caveat::from_message("trajectory", "/home/me/a.csv", format!("/home/me/a.csv: {n} rows repeat"), "")
        };
        let answers = [
            answer(0, vec![effort(120.0), slow(2.0)]),
            answer(1, vec![effort(150.0), slow(1.0), file(2)]),
            answer(2, vec![effort(130.0), SAG.found("the TCP", 0.3, 2.0)]),
            answer(3, vec![SAG.found("the TCP", 0.5, 2.0), SAG.found("the TCP", 0.4, 2.0), file(3)]),
            answer(4, vec![]),
        ];
        let found = figures(answers.iter());
        let shown: Vec<_> =
            found.iter().map(|f| (f.caveat.code.as_str(), f.runs, f.worst_run, f.caveat.value)).collect();
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
}
