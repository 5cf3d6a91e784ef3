//! What is better: more of a metric or less.

use flexarm_sweep::Better;
use flexarm_sweep::internals::{Metric, Vocabulary};
use serde_json::json;

/// Returns the preferred direction of the last of some metrics of a parameter without one.
fn better(texts: &[&str]) -> Option<Better> {
    let summary = json!({ "tcp": { "peak_m": 2e-3 }, "frequencies_hz": [9.5, 20.0] });
    let parameters = [Some("wall".to_owned())];
    let mut metrics: Vec<Metric> = Vec::new();
    for text in texts {
        let known = Vocabulary { parameters: &parameters, metrics: &metrics, summary: &summary };
        metrics.push(Metric::parse(text, &known).unwrap());
    }
    metrics[metrics.len() - 1].better
}

#[test]
fn names_tell_what_is_better_where_they_have_a_word_for_it() {
    for (name, expected) in [
        ("f1_hz", Some(Better::Higher)),
        ("bearing life (h)", Some(Better::Higher)),
        ("payload.mass", Some(Better::Higher)),
        ("drive.joint_2.gearbox.stiffness", Some(Better::Higher)),
        ("peak-error", Some(Better::Lower)),
        ("mass_kg", Some(Better::Lower)),
        ("life_error", None),
        ("massive", None),
        ("k", None),
    ] {
        assert_eq!(better(&[&format!("{name} = 2 * wall")]), expected, "{name}");
    }
}

#[test]
fn an_expression_turns_the_direction_over_where_it_falls() {
    // The names have no direction: a is an error, b a frequency, c neither.
    let of = |text: &str| better(&["a = tcp.peak_m", "b = frequencies_hz.0", "c = wall", &format!("x = {text}")]);
    assert_eq!(of("1000 * a"), Some(Better::Lower));
    assert_eq!(of("0.006 - a"), Some(Better::Higher));
    assert_eq!(of("9.81 * b / a"), Some(Better::Higher));
    assert_eq!(of("a + c"), Some(Better::Lower));
    assert_eq!(of("a + b"), None);
    assert_eq!(of("abs(a - 2)"), None);
    assert_eq!(of("c"), None);
}
