//! Tables of a reduction, for the terminal and for a Markdown page.
//!
//! Start at [`tables`]; [`markdown`] joins them to a page with the pictures. Not here: the figures
//! (`summary.rs`), tables shared with an import ([`crate::figures`]), the layout on a terminal.

use std::fmt::Write as _;

use flexarm_fem::order_check::OrderCheck;
use flexarm_fem::{GateLimits, MeshGate};
use flexarm_settings::written;

use super::summary::{ModeFigures, ReduceSummary};
use crate::figures::{ModalFigures, ReportTable, below, triple, warning_list};

/// Returns all tables of a reduction, in the order of interest.
pub fn tables(summary: &ReduceSummary) -> Vec<ReportTable> {
    let statics = &summary.statics;
    let mut tables = vec![interfaces(summary), statics.mass_table("whole mesh", &summary.attached, significant)];
    tables.extend(statics.stiffness_tables(significant));
    tables.extend([checks(summary), frequencies(summary)]);
    if !summary.fixed_interface_hz.is_empty() {
        tables.push(kept(summary));
    }
    tables.extend(summary.modal.as_ref().map(ModalFigures::table));
    tables.push(cost(summary));
    tables
}

/// Returns the figures as a Markdown page.
pub fn markdown(summary: &ReduceSummary) -> String {
    let headline: Vec<String> = headline(summary).lines().map(written::markdown).collect();
    let mut page = format!("# Link {}\n\n{}\n", written::markdown(&summary.link), headline.join("\n"));
    for table in tables(summary) {
        let _ = writeln!(page, "\n## {}\n", sentence(table.title));
        page += &table.markdown();
    }
    for path in &summary.files.pictures {
        let name = std::path::Path::new(path).file_name().unwrap_or_default().to_string_lossy();
        let _ = writeln!(page, "\n![{name}]({name})");
    }
    page + &warning_list(&summary.warnings)
}

/// Describes the mesh and the method in two lines.
pub fn headline(summary: &ReduceSummary) -> String {
    let materials: Vec<String> =
        summary.materials.iter().map(|m| format!("{}: {}", m.region, m.material.text)).collect();
    format!(
        "{} ({}, {}): {} nodes, {} elements, {} DoF\n{}; {}, {} quadrature",
        summary.mesh,
        summary.format,
        summary.units,
        summary.nodes,
        summary.elements,
        summary.dofs,
        materials.join("; "),
        summary.method,
        summary.quadrature
    )
}

fn sentence(title: &str) -> String {
    let mut letters = title.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Formats a number with four significant digits.
fn significant(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let before = x.abs().log10().floor() as i32 + 1;
    if (-3..=6).contains(&before) { format!("{x:.*}", (4 - before).max(0) as usize) } else { format!("{x:.3e}") }
}

fn interfaces(summary: &ReduceSummary) -> ReportTable {
    let rows = summary.interfaces.iter().map(|i| {
        vec![
            i.name.clone(),
            i.selector.clone(),
            i.nodes.to_string(),
            i.tie.into(),
            triple(&i.position_m),
            triple(&i.centroid_m),
            triple(&i.extent_m),
        ]
    });
    let header = ["interface", "node selector", "nodes", "tie", "position", "centroid of nodes", "extent of nodes"];
    ReportTable::new("interfaces (m, link frame)", &header, rows.collect())
}

/// Table of the checks: measured value, usual range, judgement.
fn checks(summary: &ReduceSummary) -> ReportTable {
    let c = &summary.checks;
    let limits = GateLimits::default();
    let zero = if c.zero_modes == 6 { "ok" } else { "warn" };
    let shape = if c.jacobian_at_nodes < MeshGate::SMALLEST_JACOBIAN { "warn" } else { "ok" };
    let mut rows = vec![
        below("asymmetry of the stiffness", c.symmetry, limits.asymmetry),
        below("force under rigid-body motion", c.rigid_body_residual, MeshGate::RIGID_BODY_RESIDUAL),
        below("mismatch of the stiffness blocks", c.block_identity, limits.rigid_body_warning),
        vec!["zero-stiffness modes".into(), c.zero_modes.to_string(), "6".into(), zero.into()],
        below("mass, reduced against mesh", c.mass_error, MeshGate::MASS_ERROR),
        below("inertia, reduced against mesh", c.inertia_error, MeshGate::MASS_ERROR),
        below("residual of the kept modes", c.mode_residual, MeshGate::MODE_RESIDUAL),
        vec![
            format!("minimum Jacobian, element {}", c.worst_element),
            format!("{:.3}", c.jacobian_at_nodes),
            format!("above {}", MeshGate::SMALLEST_JACOBIAN),
            shape.into(),
        ],
    ];
    if let Some(ratio) = c.order_ratio {
        let close = (1.0 / OrderCheck::LARGEST_RATIO..OrderCheck::LARGEST_RATIO).contains(&ratio);
        let mark = if close { "ok" } else { "warn" };
        let usual = format!("below {}", OrderCheck::LARGEST_RATIO);
        rows.push(vec!["compliance ratio, quadratic elements".into(), format!("{ratio:.2} times"), usual, mark.into()]);
    }
    ReportTable::new("checks", &["", "measured", "usual", ""], rows)
}

fn frequencies(summary: &ReduceSummary) -> ReportTable {
    let percent = |hz: Option<f64>, error: Option<f64>| match hz.zip(error) {
        Some((hz, error)) => format!("{hz:.2} ({:+.2} %)", if error.abs() < 5e-5 { 0.0 } else { 100.0 * error }),
        None => "-".into(),
    };
    // Without kept modes there is only the static reduction.
    let kept = !summary.fixed_interface_hz.is_empty();
    let mut header = vec!["mode".to_owned(), "mesh".into()];
    header.extend(kept.then(|| "Craig-Bampton".to_owned()));
    header.extend(["Guyan".to_owned(), "two parts".into()]);
    header.extend(summary.chains.iter().map(|chain| format!("{} parts", chain.parts)));
    let row = |(k, mode): (usize, &ModeFigures)| {
        let mut cells = vec![(k + 1).to_string(), format!("{:.2}", mode.mesh_hz)];
        cells.extend(kept.then(|| percent(mode.reduced_hz, mode.reduced_error)));
        cells.push(percent(mode.guyan_hz, mode.guyan_error));
        cells.push(percent(mode.lumped_hz, mode.lumped_error));
        cells.extend(summary.chains.iter().map(|chain| {
            let hz = chain.frequencies_hz.get(k).copied();
            percent(hz, hz.map(|hz| hz / mode.mesh_hz - 1.0))
        }));
        cells
    };
    let rows = summary.modes.iter().enumerate().map(row).collect();
    let title = "natural frequencies, A held, B free (Hz; error against the mesh)";
    ReportTable { title, header, rows, page_only: false }
}

fn kept(summary: &ReduceSummary) -> ReportTable {
    let rows = summary.fixed_interface_hz.iter().enumerate();
    let rows = rows.map(|(k, hz)| vec![(k + 1).to_string(), format!("{hz:.2}")]).collect();
    ReportTable::new("kept modes, all interfaces held (Hz)", &["mode", "frequency"], rows).on_page()
}

fn cost(summary: &ReduceSummary) -> ReportTable {
    let (p, s, cost) = (&summary.phases, &summary.solver, &summary.cost);
    let seconds = |x: f64| format!("{x:.2} s");
    let memory = cost.peak_rss_bytes.map_or_else(|| "-".into(), |b| format!("{:.0} MB", b as f64 / 1e6));
    let rows = vec![
        vec!["wall-clock / CPU time".into(), format!("{} / {}", seconds(cost.wall_s), seconds(cost.cpu_s))],
        vec![
            "read, assemble, factorise".into(),
            format!("{}, {}, {}", seconds(p.read_s), seconds(p.assembly_s), seconds(p.factorisation_s)),
        ],
        vec!["modes (kept and reference), parts".into(), format!("{}, {}", seconds(p.modes_s), seconds(p.parts_s))],
        vec!["peak memory".into(), memory],
        vec![
            "factor".into(),
            format!(
                "{} unknowns, {:.2} million entries, order {}, {} right-hand sides",
                s.unknowns,
                1e-6 * s.factor_entries as f64,
                s.ordering,
                s.right_hand_sides
            ),
        ],
    ];
    ReportTable::new("cost", &["", ""], rows)
}
