//! Tables and lines for people about robots, links and meshes; findings and warnings.
//!
//! Numbers are printed in the units of their heads (mm, deg, Hz). Not here: widths and line breaks
//! (`layout.rs`), figures of a run (`summary_table.rs`), tables of one command (beside it).

use std::io::Write as _;

use crate::layout::{filled, lines, table};
use crate::terminal::{Terminal, readable};
use flexarm::Finding;
use flexarm::links::reduce::{MeshListing, ReduceSummary, ReportTable, SetListing};
use flexarm::robots::{BalancerInfo, FlexibleInfo, Inspection, LoopInfo, RobotExport};
use flexarm::settings::gathered;
use flexarm::settings::written::{message, visible};

/// The text with zeros that were rounded from negative numbers written without their sign.
pub fn plain_zeros(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut before = ' ';
    for (k, c) in text.char_indices() {
        let number = || text[k + 1..].split(|c: char| !c.is_ascii_digit() && c != '.').next().unwrap_or_default();
        let starts = before.is_whitespace() || "[(,".contains(before);
        let is_zero = |number: &str| number.contains('.') && number.chars().all(|c| c == '0' || c == '.');
        // A minus sign becomes a blank where columns are aligned.
        match c == '-' && starts && is_zero(number()) && !text[k + 1 + number().len()..].starts_with('e') {
            true if out.ends_with("  ") => out.push(' '),
            true => {}
            false => out.push(c),
        }
        before = c;
    }
    out
}

fn limit(x: Option<f64>) -> String {
    x.map_or_else(|| "-".into(), |x| format!("{x:.4}"))
}

/// Describes a closed loop: its dependent joints, and its transmission angle.
fn loop_line(own: &LoopInfo) -> String {
    let joints: Vec<String> = own.dependent.iter().map(|joint| format!("{} at {:.4}", joint.name, joint.q)).collect();
    let least = own
        .smallest_transmission_angle
        .map(|angle| format!(", at least {:.1} deg over the joint ranges", angle.to_degrees()));
    format!(
        "loop: {}, dependent {}, transmission angle {:.1} deg{}\n",
        own.name,
        joints.join(" and "),
        own.transmission_angle.to_degrees(),
        least.unwrap_or_default()
    )
}

/// Formats what was loaded.
pub(crate) fn inspection(i: &Inspection) -> String {
    let mut out = format!("{}, {:.2} kg\n", i.robot, i.mass_kg);
    out += &joint_table(i);
    let mut t = table(&["link", "mass [kg]", "centre of mass [m]"]);
    for l in i.links.iter().filter(|l| l.mass_kg > 0.0) {
        t.add_row([l.name.clone(), format!("{:.3}", l.mass_kg), format!("{:.4?}", l.com_m)]);
    }
    out += &lines(&t);
    out.extend(i.balancers.iter().map(balancer_line));
    out.extend(i.loops.iter().map(loop_line));
    out.extend(i.flexible_links.iter().map(flexible_lines));
    // Coupled gears and springs of the base, if there are any.
    if let Some(c) = &i.coupling {
        let rows: Vec<String> = c.matrix.iter().map(|row| format!("{row:?}")).collect();
        out += &format!(
            "coupling: ({}) = [{}] times their motors behind the gears\n",
            c.joints.join(", "),
            rows.join(", ")
        );
    }
    if let Some(m) = &i.mounting {
        let k: Vec<String> = (0..6).map(|c| format!("{:.3e}", m.stiffness[c][c])).collect();
        let at = m.position_m;
        out += &format!(
            "mounting: {:?} on springs at {at:?} m of the base link, {} (N/m, N m/rad) on their diagonal{}; {:.2} kg ride on them\n",
            m.name,
            k.join(", "),
            if m.backlash.is_empty() { String::new() } else { format!(", play of {:?} (m, rad)", m.backlash) },
            m.mass_kg
        );
    }
    let tcp = format!(
        "TCP on {}: position {:.6?} m, quaternion wxyz {:.6?}",
        i.tcp.link, i.tcp.position_m, i.tcp.quaternion_wxyz
    );
    out + &tcp
}

/// Lists the joints with their limits, positions and torques at rest.
fn joint_table(i: &Inspection) -> String {
    // Without velocities the bias is the gravity torque.
    let moves = i.bias.iter().zip(&i.gravity_torque).any(|(bias, gravity)| bias != gravity);
    let mut head = vec!["joint", "type", "lower", "upper", "velocity", "effort", "at", "gravity"];
    head.extend(moves.then_some("bias"));
    let mut t = table(&head);
    for (k, j) in i.joints.iter().enumerate() {
        let mut row = vec![
            j.name.clone(),
            j.kind.into(),
            limit(j.lower),
            limit(j.upper),
            limit(j.velocity),
            j.effort.map_or_else(|| "-".into(), |effort| format!("{effort:.1}")),
            format!("{:.4}", i.q[k]),
            format!("{:.2}", i.gravity_torque[k]),
        ];
        row.extend(moves.then(|| format!("{:.2}", i.bias[k])));
        t.add_row(row);
    }
    let bounded = i.joints.iter().filter(|j| j.acceleration.or(j.jerk).is_some());
    let rates = bounded.map(|j| format!("{} {} and {}", j.name, limit(j.acceleration), limit(j.jerk)));
    let rates: Vec<String> = rates.collect();
    match rates.is_empty() {
        true => lines(&t),
        false => lines(&t) + &filled(&format!("limits of acceleration and jerk: {}\n", rates.join(", ")), 80),
    }
}

fn balancer_line(b: &BalancerInfo) -> String {
    let torque: Vec<String> = b.torque.iter().map(|torque| format!("{torque:.1}")).collect();
    let (length, pull) = match b.kind {
        "line" => ("length", "pull"),
        _ => ("joint at", "torque against it"),
    };
    format!(
        "balancer: {}, {length} {:.4}, {pull} {:.1}, stiffness {:.4e}, on the joints {}\n",
        b.name,
        b.length,
        b.tension,
        b.stiffness,
        torque.join(" ")
    )
}

/// Describes a flexible link, and the natural frequencies of its modes if it has any.
fn flexible_lines(f: &FlexibleInfo) -> String {
    let line = format!(
        "flexible: {} ({}), {:.4} m, parts {} kg; {}, {} coordinates",
        f.name,
        f.method,
        f.length_m,
        f.parts_kg.iter().map(|m| format!("{m:.2}")).collect::<Vec<_>>().join(" + "),
        f.model,
        f.coordinates
    );
    let mut out = line + "\n";
    if let Some(hz) = &f.modal_frequencies_hz {
        let first: Vec<String> = hz.iter().take(6).map(|hz| format!("{hz:.1}")).collect();
        let more = if hz.len() > 6 { hz.last().map(|hz| format!(", ... {hz:.0}")) } else { None };
        out += &format!("  near joint held: {}{} Hz\n", first.join(", "), more.unwrap_or_default());
    }
    out
}

/// Lists all findings.
pub(crate) fn findings(findings: &[Finding]) -> String {
    if findings.is_empty() {
        return "nothing found\n".into();
    }
    let line = |f: &Finding| format!("{}[{}] {}: {}", f.severity.word(), f.code, f.location, f.message);
    let lines: Vec<String> = findings.iter().map(line).collect();
    let mut out = String::new();
    for line_text in gathered(&lines) {
        out += &format!("{}\n", message(&line_text));
        let first = lines.iter().position(|line| line_text.starts_with(line.as_str()));
        if let Some(help) = first.map(|k| &findings[k].help).filter(|help| !help.is_empty()) {
            out += &format!("    help: {}\n", message(help));
        }
    }
    let count = |severity: &str| match findings.iter().filter(|f| f.severity.word() == severity).count() {
        1 => format!("1 {severity}"),
        n => format!("{n} {severity}s"),
    };
    out += &format!("{}, {}, {}\n", count("error"), count("warning"), count("note"));
    out
}

fn report_table(report: &ReportTable) -> String {
    let mut t = table(&report.header);
    for row in &report.rows {
        t.add_row(row);
    }
    format!("\n{}\n{}", report.title, lines(&t))
}

/// Lists the files that were written, their names `width` columns wide.
pub(crate) fn file_lines(width: usize, files: &[(&str, &Option<String>)]) -> String {
    let written = files.iter().filter_map(|(what, path)| path.as_ref().map(|path| (what, path)));
    written.map(|(what, path)| format!("{what:<width$} {path}\n")).collect()
}

/// Formats the figures of a reduction.
pub(crate) fn reduction(summary: &ReduceSummary) -> String {
    let mut out = format!("link {}\n{}\n", summary.link, flexarm::links::reduce::headline(summary));
    for report in flexarm::links::reduce::tables(summary).iter().filter(|report| !report.page_only) {
        out += &report_table(report);
    }
    let f = &summary.files;
    let files = [("link", &f.flex), ("job", &f.job), ("figures", &f.summary), ("report", &f.report)];
    let files = file_lines(8, &files);
    if !files.is_empty() {
        out += &format!("\n{files}");
    }
    for path in &f.pictures {
        out += &format!("picture  {path}\n");
    }
    readable(&out) + &pasted(f.entry.as_deref())
}

/// Formats an entry of a robot file.
fn pasted(entry: Option<&str>) -> String {
    entry.map_or_else(String::new, |entry| format!("\nto be pasted into a robot file:\n{}", visible(entry)))
}

/// Formats the figures of an import.
pub(crate) fn imported(summary: &flexarm::links::import::ImportSummary) -> String {
    let mut out = format!(
        "link {}\n{}: {}, {}, {} rows; {}\n",
        summary.link,
        summary.sources.join(", "),
        summary.format,
        summary.units,
        summary.rows,
        summary.method
    );
    for report in flexarm::links::import::tables(summary).iter().filter(|report| !report.page_only) {
        out += &report_table(report);
    }
    let f = &summary.files;
    let files = [("link", &f.flex), ("figures", &f.summary), ("report", &f.report)];
    let files = file_lines(8, &files);
    if !files.is_empty() {
        out += &format!("\n{files}");
    }
    readable(&out) + &pasted(f.entry.as_deref())
}

/// Formats the figures of an export.
pub(crate) fn exported(summary: &flexarm::links::export::ExportSummary) -> String {
    let mut out = format!(
        "link {} as {} in {}: {} rows, {} of them modes\n",
        summary.link, summary.format, summary.units, summary.rows, summary.modes
    );
    let c = &summary.checks;
    out += &format!("read back: stiffness differs by {:.1e}", c.stiffness_error);
    out += &c.mass_error.map_or_else(|| ", no mass".into(), |error| format!(", mass by {error:.1e}"));
    out += " (relative to the diagonal)\n";
    for file in &summary.files {
        out += &format!("{file}\n");
    }
    out += &format!("map for flexarm import: --map \"{}\"\n", summary.map);
    out
}

pub(crate) fn exported_robot(export: &RobotExport, files: &[String]) -> String {
    let mut out = files.iter().take(2).map(|file| format!("{file}\n")).collect::<String>();
    out += &format!("{} meshes\n", files.len().saturating_sub(2));
    out += &export.step_s.map_or_else(String::new, |step| format!("step for MuJoCo: {step:?} s\n"));
    export.left_out.iter().for_each(|what| out += &format!("left out: {what}\n"));
    out
}

/// Lists the contents of a mesh.
pub(crate) fn listing(l: &MeshListing) -> String {
    let units = l.units.as_deref().unwrap_or("units not declared");
    let mut out = format!("{} ({}, {units}): {} nodes, {} elements\n", l.mesh, l.format, l.nodes, l.elements);
    let kinds: Vec<String> = l.element_kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    out += &format!("elements: {}\n", kinds.join(", "));
    out += &format!("from {:?} to {:?} in the unit of the mesh", l.min, l.max);
    out += &l.size_m.map_or_else(|| "\n".into(), |size| format!("; {size:.4} m at most\n"));
    let mut t = table(&["region", "elements", "material"]);
    for region in &l.regions {
        let material = match &region.material {
            Some(material) => material.text.clone(),
            None if region.has_material => "in the file, in its own units".into(),
            None => "none: --material".into(),
        };
        t.add_row([region.name.clone(), region.elements.to_string(), material]);
    }
    out += &format!("\nregions\n{}", lines(&t));
    out += &sets("node sets", &l.sets);
    if !l.interfaces.is_empty() {
        out += &sets("interfaces", &l.interfaces);
    }
    for warning in gathered(&l.warnings) {
        out += &format!("warning: {}\n", message(&warning));
    }
    out
}

fn sets(title: &str, sets: &[SetListing]) -> String {
    if sets.is_empty() {
        return format!("\n{title}: none; choose nodes by place, such as plane(x,y,z; nx,ny,nz)\n");
    }
    let mut t = table(&["name", "nodes", "centroid (as for --at)", "extent"]);
    for set in sets {
        let [x, y, z] = set.extent.map(|x| format!("{x:.6}"));
        t.add_row([set.name.clone(), set.nodes.to_string(), set.at.clone(), format!("{x}, {y}, {z}")]);
    }
    format!("\n{title} (unit of the mesh)\n{}", lines(&t))
}

/// Prints a warning to standard error.
pub(crate) fn warning(text: &str) {
    let yellow = anstyle::AnsiColor::Yellow.on_default().bold();
    say(&format!("{yellow}warning:{yellow:#} {}", message(text)));
}

/// Prints an error, or another line with its own first word, to standard error.
pub(crate) fn complaint(word: &str, text: &str) {
    say(&format!("{word}: {}", message(text)));
}

/// Prints a line to standard error. A closed pipe or a full disk there loses the line, not the
/// results: the exit code still says how the command ended.
pub(crate) fn say(line: &str) {
    let _ = writeln!(anstream::stderr(), "{line}");
}

/// Prints warnings to standard error, those of one kind merged, unless `--quiet` is set.
pub(crate) fn warnings(terminal: &Terminal, texts: &[String]) {
    if !terminal.quiet {
        gathered(texts).iter().for_each(|text| warning(text));
    }
}

/// Prints the warnings among the caveats. Those of the robot description are summarised in one
/// line; `check` and `new` list them in full.
pub(crate) fn caveats(terminal: &Terminal, caveats: &[Finding]) {
    let (of_description, own): (Vec<&Finding>, Vec<&Finding>) =
        caveats.iter().filter(|caveat| caveat.warns()).partition(|caveat| caveat.of_description);
    let mut texts: Vec<String> = own.into_iter().map(|caveat| caveat.message.clone()).collect();
    match of_description.as_slice() {
        [] => {}
        [one] => texts.insert(0, one.message.clone()),
        [first, others @ ..] => {
            let text = format!("{} (and {} more of the description: flexarm check)", first.message, others.len());
            texts.insert(0, text);
        }
    }
    warnings(terminal, &texts);
}

/// Returns a number with its noun: `1 joint`, `2 joints`.
pub(crate) fn counted(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}
