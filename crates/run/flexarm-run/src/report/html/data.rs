//! Data of the plots of the page, as JSON. Not here: the curves (`curves`), the plots
//! (`assets/report.js`).

use flexarm_log::EventKind;

use super::figures::lies_on_twin;
use super::number::{push_short, short};
use super::run::ReportRun;
use crate::report::curves::{Kind, Plot, overlays};
use flexarm_settings::written::markup;

/// Explains which samples the plots leave out, if any.
pub(super) fn thinning(runs: &[ReportRun<'_>], drawn: &[Vec<Plot>]) -> String {
    let mut sentences = Vec::new();
    let mut tables = drawn.iter().flatten().flat_map(|plot| &plot.views).flat_map(|view| &view.tables);
    if tables.any(|table| table.is_thinned) {
        sentences.push(
            "Plots of many samples are thinned: the minimum and the maximum of equal pieces of a curve are kept, so that peaks remain. Recordings have every sample."
                .to_owned(),
        );
    }
    for run in runs.iter().filter(|run| run.trace.samples_per_block() > 1) {
        let (size, all) = (run.trace.samples_per_block(), run.trace.samples());
        let label = markup(run.label);
        sentences.push(format!(
            "{label}: curves are the minimum and the maximum of each {size} of the run's {all} samples."
        ));
    }
    match sentences.is_empty() {
        true => String::new(),
        false => format!("<p id=\"thinning\" class=\"note\">{}</p>\n", sentences.join("<br>")),
    }
}

/// Returns the data of the plots as JSON that is safe inside a script element.
pub(super) fn data(runs: &[ReportRun<'_>], drawn: &[Vec<Plot>]) -> String {
    let list = |items: Vec<String>| format!("[{}]", items.join(","));
    let run = |(run, drawn): (&ReportRun<'_>, &Vec<Plot>)| {
        let still = lies_on_twin(run);
        let events = run.trace.result.events.iter().filter(|event| !(still && event.kind == EventKind::Peak));
        let events = events.map(|event| {
            let (kind, text) = (json_text(event.kind.word()), json_text(&event.text));
            format!("{{\"t\":{},\"kind\":{kind},\"text\":{text}}}", short(event.time_s, 7))
        });
        let plots = drawn.iter().map(json_plot).collect();
        format!(
            "{{\"label\":{},\"events\":{},\"plots\":{}}}",
            json_text(run.label),
            list(events.collect()),
            list(plots)
        )
    };
    let several: Vec<_> = runs.iter().map(|run| (run.label, run.summary, run.trace)).collect();
    let overlays = if runs.len() > 1 { overlays(&several) } else { Vec::new() };
    let overlays = list(overlays.iter().map(json_plot).collect());
    let json = format!("{{\"runs\":{},\"overlays\":{overlays}}}", list(runs.iter().zip(drawn).map(run).collect()));
    // Without `<`, no text can end the script element or begin a comment.
    json.replace('<', "\\u003c")
}

/// Formats text as JSON, and also escapes control characters that JSON leaves unescaped.
fn json_text(text: &str) -> String {
    let json = serde_json::to_string(text).expect("text is JSON");
    let escaped = |c: char| if c.is_control() { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    json.chars().map(escaped).collect()
}

/// Returns a plot as JSON; numbers are as short as their accuracy on the screen allows.
fn json_plot(plot: &Plot) -> String {
    let numbers = |values: &[f64], digits| {
        let mut text = String::with_capacity(8 * values.len());
        for (k, x) in values.iter().enumerate() {
            text.push_str(if k > 0 { "," } else { "" });
            push_short(&mut text, *x, digits);
        }
        text
    };
    // Views, their tables, and the curves of each.
    let views = plot.views.iter().map(|view| {
        let tables = view.tables.iter().map(|table| {
            let curves = table.curves.iter().map(|curve| {
                let kind = match curve.kind {
                    Kind::Plain | Kind::Part(_) => "",
                    Kind::Total => "total",
                    Kind::Dashed => "dashed",
                    Kind::Axis(k) => ["x", "y", "z"][k % 3],
                };
                let color = match curve.kind {
                    Kind::Part(number) => format!("\"color\":{number},"),
                    _ => String::new(),
                };
                let name = json_text(&curve.name);
                format!("{{\"name\":{name},\"kind\":\"{kind}\",{color}\"y\":[{}]}}", numbers(&curve.y, 5))
            });
            let curves = curves.collect::<Vec<_>>().join(",");
            format!("{{\"x\":[{}],\"curves\":[{curves}]}}", numbers(&table.x, 7))
        });
        let (name, unit) = (json_text(&view.name), json_text(view.y_unit));
        format!("{{\"name\":{name},\"unit\":{unit},\"tables\":[{}]}}", tables.collect::<Vec<_>>().join(","))
    });
    // Marks, texts and switches of the plot.
    let marks = plot.marks.iter().map(|(x, text)| format!("{{\"x\":{},\"text\":{}}}", short(*x, 6), json_text(text)));
    let texts = [
        ("id", plot.id),
        ("section", plot.section),
        ("title", plot.title),
        ("note", &plot.note),
        ("xLabel", plot.x_label),
        ("xUnit", plot.x_unit),
        ("yLabel", plot.y_label),
        ("yUnit", plot.y_unit),
    ];
    let texts: String = texts.iter().map(|(key, text)| format!("\"{key}\":{},", json_text(text))).collect();
    format!(
        "{{{texts}\"time\":{},\"log\":{},\"wide\":{},\"marks\":[{}],\"views\":[{}]}}",
        plot.over_time,
        plot.logarithmic,
        plot.wide,
        marks.collect::<Vec<_>>().join(","),
        views.collect::<Vec<_>>().join(",")
    )
}
