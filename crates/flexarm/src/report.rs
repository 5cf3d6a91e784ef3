//! The report of a run: a page of Markdown and the summary as JSON, beside the recordings.

use std::fmt::Write as _;

use crate::error::Error;
use crate::options::Outputs;
use crate::summary::Summary;

/// Writes `report.md` and `summary.json` into the output folder.
pub(crate) fn write(outputs: &Outputs, summary: &Summary) -> Result<(), Error> {
    let save = |name: &str, text: String| {
        let path = outputs.folder.join(name);
        std::fs::write(&path, text).map_err(|e| Error::File { path, what: format!("cannot be written: {e}") })
    };
    save("report.md", markdown(summary))?;
    let json = serde_json::to_string_pretty(summary).expect("plain numbers and strings");
    save("summary.json", json + "\n")
}

/// The summary as a page of Markdown.
pub fn markdown(summary: &Summary) -> String {
    let mut page = format!("# {} on {}\n\n", summary.robot, summary.trajectory);
    let mut row = |name: &str, value: String| {
        let _ = writeln!(page, "| {name} | {value} |");
    };
    row("figure", "value".into());
    row("---", "---".into());
    for (name, value) in rows(summary) {
        row(&name, value);
    }
    if !summary.warnings.is_empty() {
        page += "\n## Warnings\n\n";
        for warning in &summary.warnings {
            let _ = writeln!(page, "- {warning}");
        }
    }
    page
}

/// The figures that a person wants to see, with readable units.
pub fn rows(summary: &Summary) -> Vec<(String, String)> {
    let mm = |x: f64| format!("{:.4} mm", 1e3 * x);
    let mrad = |x: f64| format!("{:.4} mrad", 1e3 * x);
    let mut rows = Vec::new();
    if summary.end != "complete" {
        rows.push(("STOPPED EARLY".to_owned(), summary.end.clone()));
    }
    if let Some(tcp) = &summary.tcp {
        rows.push(("peak TCP error".to_owned(), format!("{} at {:.3} s", mm(tcp.peak_m), tcp.t_peak_s)));
        rows.push(("RMS TCP error".into(), mm(tcp.rms_m)));
        let [t, n, b] = tcp.path_peak_m.map(|x| format!("{:.4}", 1e3 * x));
        rows.push(("along / normal / binormal to the path".into(), format!("{t} / {n} / {b} mm")));
        rows.push(("static sag at the start".into(), mm(tcp.static_sag_m)));
        rows.push(("error at the end".into(), mm(tcp.end_m)));
        rows.push(("peak / RMS rotation".into(), format!("{} / {}", mrad(tcp.peak_rad), mrad(tcp.rms_rad))));
        rows.push(("overshoot after the last move".into(), mm(tcp.overshoot_m)));
        let settled = tcp.settling_s.map_or_else(|| "not within the recording".into(), |s| format!("{s:.3} s"));
        rows.push(("settling time".into(), settled));
        rows.push(("dominant frequency".into(), tcp.dominant_hz.map_or_else(|| "-".into(), |f| format!("{f:.2} Hz"))));
    }
    for link in &summary.links {
        let text = format!(
            "{} of TCP motion, strain {:.1e}, {}",
            mm(link.peak_contribution_m),
            link.engineering_strain,
            mrad(link.peak_rotation_rad)
        );
        rows.push((format!("link {}", link.name), text));
    }
    for drive in &summary.elastic_drives {
        let text = format!(
            "{} of TCP motion, gives way by {}",
            mm(drive.peak_contribution_m),
            mrad(drive.peak_deflection_rad)
        );
        rows.push((format!("drive {}", drive.joint), text));
    }
    let e = &summary.energy;
    if e.drives_j != 0.0 || e.loads_j != 0.0 {
        let mut loads = if e.loads_j == 0.0 { String::new() } else { format!(", by loads {:.3} J", e.loads_j) };
        if e.payload_j != 0.0 {
            loads += &format!(", with payloads {:.3} J", e.payload_j);
        }
        let text = format!(
            "by drives {:.3} J{loads}, dissipated {:.3} J, stored {:.3} J; balance open by {:.1e}",
            e.drives_j, e.dissipated_j, e.stored_j, e.imbalance
        );
        rows.push(("energy".into(), text));
    }
    if !summary.frequencies_hz.is_empty() {
        let first: Vec<String> = summary.frequencies_hz.iter().take(4).map(|f| format!("{f:.2}")).collect();
        rows.push(("first frequencies".into(), format!("{} Hz", first.join(", "))));
    }
    let s = &summary.stepper;
    rows.push((
        "stepper".into(),
        format!(
            "{}, {} ms, {} steps, {:.1} evaluations a step",
            s.name,
            1e3 * s.h_s,
            s.steps,
            s.evaluations as f64 / s.steps.max(1) as f64
        ),
    ));
    rows.push((
        "run".into(),
        format!(
            "{:.2} s simulated in {:.2} s ({:.0} times real time), {:.1} ms CPU per simulated second",
            summary.duration_s,
            summary.wall_s,
            summary.real_time_factor,
            1e3 * summary.cpu_s_per_simulated_s
        ),
    ));
    rows
}
