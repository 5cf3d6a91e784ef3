//! Caveats of the runs of a study, stored with each result, and merged over all runs.
//!
//! Start at [`figures`], the merge. Caveats are equal in kind and place, not in their numbers: the
//! worst number represents them all. Not here: the caveats themselves (`flexarm_run::caveat`).

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use serde::Serialize;

use super::evaluate::Answer;
use flexarm_run::caveat::once_each;
use flexarm_run::{Finding, Severity};

/// Caveats of a run as JSON; `None` if there are none. Runs with equal caveats share one text.
pub(super) type CaveatText = Option<Arc<str>>;

/// Finding with the runs it concerns, represented by the worst of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaveatFigures {
    /// Finding with the worst value.
    #[serde(flatten)]
    pub caveat: Finding,
    /// Number of runs with this caveat.
    pub runs: usize,
    /// Number of the run with the worst value.
    pub worst_run: usize,
}

/// Serialises the caveats of a run; `plain` removes parts of a text that depend on the machine.
pub fn stored_caveats(caveats: Vec<Finding>, plain: &dyn Fn(String) -> String) -> CaveatText {
    if caveats.is_empty() {
        return None;
    }
    let plain =
        |caveat: Finding| Finding { location: plain(caveat.location), message: plain(caveat.message), ..caveat };
    let caveats: Vec<Finding> = once_each(caveats).into_iter().map(plain).collect();
    serde_json::to_string(&caveats).ok().map(Arc::from)
}

/// Merges the caveats of all runs, warnings first.
pub fn figures<'a>(answers: impl Iterator<Item = &'a Answer>) -> Vec<CaveatFigures> {
    let mut read: HashMap<&str, Vec<Finding>> = HashMap::new();
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
fn key(caveat: &Finding) -> (String, String, String) {
    let words = match caveat.value {
        Some(_) => String::new(),
        None => caveat.message.chars().filter(|c| !c.is_ascii_digit()).collect(),
    };
    (caveat.code.clone(), caveat.location.clone(), words)
}

/// Returns the severity of a caveat's value among others of its kind: its distance from the
/// yardstick.
fn badness(caveat: &Finding) -> f64 {
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
pub fn warnings(caveats: &[CaveatFigures], runs: usize) -> Vec<String> {
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
