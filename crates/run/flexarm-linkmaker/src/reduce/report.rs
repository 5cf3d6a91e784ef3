//! Tables of a reduction, for the terminal and for a Markdown page.

use std::fmt::Write as _;

use flexarm_fem::MeshGate;
use flexarm_fem::order_check::OrderCheck;
use flexarm_settings::{gathered, written};

use super::summary::{ModalFigures, ModeFigures, ReduceSummary};

/// A table of text.
#[derive(Clone, Debug)]
pub struct ReportTable {
    /// Title, with units.
    pub title: &'static str,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Rows, each with the length of the header.
    pub rows: Vec<Vec<String>>,
    /// Whether the table is for the page only, because it is too wide for a terminal.
    pub page_only: bool,
}

impl ReportTable {
    pub(crate) fn new(title: &'static str, header: &[&str], rows: Vec<Vec<String>>) -> Self {
        let header = header.iter().map(|name| (*name).to_owned()).collect();
        Self { title, header, rows, page_only: false }
    }

    /// Returns the table in Markdown.
    pub(crate) fn markdown(&self) -> String {
        let rule = vec!["---"; self.header.len()];
        let rows: String = self.rows.iter().map(|cells| written::markdown_row(cells)).collect();
        written::markdown_row(&self.header) + &written::markdown_row(&rule) + &rows
    }

    pub(crate) fn on_page(self) -> Self {
        Self { page_only: true, ..self }
    }
}

/// Names of the six components at an interface.
const COMPONENTS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// Returns all tables of a reduction, in the order of interest.
pub fn tables(summary: &ReduceSummary) -> Vec<ReportTable> {
    let mut tables = vec![interfaces(summary), mass(summary), softness(summary)];
    tables.push(matrix_table("stiffness K_BB at B, A held (N/m, N/rad; N m/m, N m/rad)", &summary.stiffness));
    tables.push(matrix_table("compliance C_BB at B, A held (m/N, m/(N m); rad/N, rad/(N m))", &summary.compliance));
    tables.extend([checks(summary), frequencies(summary)]);
    if !summary.fixed_interface_hz.is_empty() {
        tables.push(kept(summary));
    }
    tables.extend(summary.modal.as_ref().map(modal_table));
    tables.push(cost(summary));
    tables
}

/// Returns the table of a modal link.
pub fn modal_table(modal: &ModalFigures) -> ReportTable {
    let (low, high) = (modal.frequencies_hz.first(), modal.frequencies_hz.last());
    let hz = |x: Option<&f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.1}"));
    let of = match modal.interfaces.as_slice() {
        [one] => format!("interface {one}"),
        several => format!("interfaces {}", several.join(", ")),
    };
    let rows = vec![
        vec!["coordinates".into(), format!("{}, {of}, {} Hz to {} Hz", modal.coordinates, hz(low), hz(high))],
        vec!["second-order integrals".into(), if modal.second_order { "known" } else { "unknown" }.into()],
        vec!["geometric stiffness".into(), if modal.geometric { "stored" } else { "not stored" }.into()],
    ];
    ReportTable::new("modal link, A held", &["", ""], rows)
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

/// Returns the warnings as a Markdown section; empty if there are none.
pub(crate) fn warning_list(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let items = gathered(warnings).into_iter().map(|warning| format!("- {}\n", written::markdown(&warning)));
    let items: String = items.collect();
    format!("\n## Warnings\n\n{items}")
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

/// Formats three numbers with `digits` decimals, without a negative zero.
fn triple(p: &[f64; 3], digits: usize) -> String {
    let smallest = 0.5 * 10f64.powi(-(digits as i32));
    p.map(|x| format!("{:.digits$}", if x.abs() < smallest { 0.0 } else { x })).join(", ")
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
            triple(&i.position_m, 4),
            triple(&i.centroid_m, 4),
            triple(&i.extent_m, 4),
        ]
    });
    let header = ["interface", "node selector", "nodes", "tie", "position", "centroid of nodes", "extent of nodes"];
    ReportTable::new("interfaces (m, link frame)", &header, rows.collect())
}

fn mass(summary: &ReduceSummary) -> ReportTable {
    let row = |name: &str, mass: f64, com: &[f64; 3], I: &[[f64; 3]; 3]| {
        let moments = [I[0][0], I[1][1], I[2][2], I[0][1], I[0][2], I[1][2]].map(significant);
        vec![name.to_owned(), format!("{mass:.4}"), triple(com, 4), moments.join(", ")]
    };
    let mut rows = vec![row("whole mesh", summary.mass_kg, &summary.com_m, &summary.inertia)];
    for part in &summary.attached {
        rows.push(row("attached body", part.mass_kg, &part.com_m, &part.inertia));
    }
    for (name, part) in ["proximal part", "distal part"].iter().zip(&summary.parts) {
        rows.push(row(name, part.mass_kg, &part.com_m, &part.inertia));
    }
    rows.push(vec!["elastic joint".into(), String::new(), triple(&summary.split_m, 4), String::new()]);
    let header = ["", "mass [kg]", "centre of mass [m]", "ixx, iyy, izz, ixy, ixz, iyz about it [kg m2]"];
    ReportTable::new("mass", &header, rows)
}

/// Returns the displacements of B under loads of familiar size.
fn softness(summary: &ReduceSummary) -> ReportTable {
    let C = &summary.compliance;
    // 1 kN and mm, 1 kN m and mrad.
    let of = |k: usize| significant(1e6 * C[k][k]);
    let rows = vec![
        vec!["displacement of B under 1 kN".into(), of(0), of(1), of(2), "mm".into()],
        vec!["rotation of B under 1 kN m".into(), of(3), of(4), of(5), "mrad".into()],
    ];
    ReportTable::new("deflection of B along the load, A held", &["", "x", "y", "z", ""], rows)
}

pub(crate) fn matrix_table(title: &'static str, M: &[[f64; 6]; 6]) -> ReportTable {
    let rows = M
        .iter()
        .zip(COMPONENTS)
        .map(|(row, name)| std::iter::once(name.to_owned()).chain(row.iter().map(|x| format!("{x:.6e}"))).collect());
    let header: Vec<&str> = std::iter::once("").chain(COMPONENTS).collect();
    ReportTable::new(title, &header, rows.collect()).on_page()
}

fn checks(summary: &ReduceSummary) -> ReportTable {
    let c = &summary.checks;
    let below = |name: &str, value: f64, limit: f64| {
        let mark = if value < limit { "ok" } else { "warn" };
        vec![name.to_owned(), format!("{value:.1e}"), format!("below {limit:.0e}"), mark.to_owned()]
    };
    let limits = flexarm_fem::GateLimits::default();
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
    let (p, s) = (&summary.phases, &summary.solver);
    let seconds = |x: f64| format!("{x:.2} s");
    let memory = summary.peak_rss_bytes.map_or_else(|| "-".into(), |b| format!("{:.0} MB", b as f64 / 1e6));
    let rows = vec![
        vec!["wall-clock / CPU time".into(), format!("{} / {}", seconds(summary.wall_s), seconds(summary.cpu_s))],
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
