//! Metrics of runs.

use flexarm_sweep::internals::{Metric, MetricError, SummaryFacts, Vocabulary};
use flexarm_sweep::{Better, ParameterValue};
use serde_json::{Value, json};

fn summary() -> Value {
    json!({ "tcp": { "peak_m": 2e-3, "settling_s": null, "settling": "after 0.1 s", "holds": [] },
            "links": [{ "name": "link_2", "peak_contribution_m": 1e-3 }], "frequencies_hz": [9.5, 20.0], "drives": { "joint_1": 4.0 } })
}

fn value(text: &str) -> Result<f64, MetricError> {
    let summary = summary();
    let parameters = [Some("payload.mass".to_owned()), None];
    let known = Vocabulary { parameters: &parameters, metrics: &[], summary: &summary };
    let metric = Metric::parse(text, &known)?;
    let facts = SummaryFacts { summary: summary.clone(), mass_kg: 100.0 };
    Ok(metric.value(&[ParameterValue::Whole(50), ParameterValue::Text("a".into())], &[], &facts))
}

#[test]
fn metrics_are_places_of_the_summary_parameters_and_expressions_of_them() {
    assert_eq!(value("tcp.peak_m").unwrap(), 2e-3);
    assert_eq!(value("mm = 1e3 * tcp.peak_m").unwrap(), 2.0);
    assert_eq!(value("links.link_2.peak_contribution_m + links[0].peak_contribution_m").unwrap(), 2e-3);
    assert_eq!(value("frequencies_hz.1 - frequencies_hz[0]").unwrap(), 10.5);
    assert_eq!(value("x = sqrt(drives.joint_1) * payload.mass - 1.5e+1").unwrap(), 85.0);
    assert_eq!(value("max(tcp.peak_m, 1e-2)").unwrap(), 1e-2);
    assert_eq!(value("robot.mass_kg / payload.mass").unwrap(), 2.0);
    assert_eq!(value("b = {links.link_2.peak_contribution_m} * 2").unwrap(), 2e-3);
    assert!(value("tcp.settling_s").unwrap().is_nan() && value("1 / (payload.mass - 50)").unwrap().is_nan());
}

#[test]
fn frequencies_and_what_falls_with_an_error_are_better_if_higher() {
    let (summary, parameters) = (summary(), [Some("payload.mass".to_owned()), Some("wall".to_owned())]);
    let mut metrics: Vec<Metric> = Vec::new();
    for (text, better) in [
        ("frequencies_hz.0", Some(Better::Higher)),
        ("peak_mm = 1e3 * tcp.peak_m", Some(Better::Lower)),
        ("margin_mm = 6 - peak_mm", Some(Better::Higher)),
        ("k = 9.81 * payload.mass / tcp.peak_m", Some(Better::Higher)),
        ("life_h = 2e4 * (300 / drives.joint_1)^3", Some(Better::Higher)),
        ("off = abs(frequencies_hz.0 - 12)", None),
        ("stiffness = wall^3", Some(Better::Higher)),
        ("x = 2 * wall", None),
    ] {
        let metric = Metric::parse(text, &Vocabulary { parameters: &parameters, metrics: &metrics, summary: &summary });
        metrics.push(metric.unwrap());
        assert_eq!(metrics[metrics.len() - 1].better, better, "{text}");
    }
}

#[test]
fn what_no_run_has_is_told_with_what_is_near() {
    let message = value("tcp.peak").unwrap_err().to_string();
    assert!(message.contains("\"tcp.peak\" is not in the summary") && message.contains("tcp.peak_m"), "{message}");
    assert!(value("tcp.settling").unwrap_err().to_string().contains("is a string"));
    assert!(value("tcp").unwrap_err().to_string().contains("several entries"));
    assert!(value("wall_s").unwrap_err().to_string().contains("depends on the machine"));
    assert!(value("tcp.peak_m +* 2").is_err() && value("= 2").is_err() && value("").is_err());
    assert!(value("payload.mass = tcp.peak_m").unwrap_err().to_string().contains("taken"));
}
