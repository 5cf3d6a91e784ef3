//! Figures and tables that a reduction and an import share.
//!
//! The structs are parts of the summaries; their JSON keys are stable. A is the proximal and B the
//! distal interface; SI units, link axes, linear first. Not here: what only one of both has
//! ([`crate::reduce`], [`crate::import`]).

use flexarm_fem::{ModalLink, ReducedLink, RigidPart};
use flexarm_settings::{Finding, Setting, gathered, written};
use nalgebra::{Matrix3, Matrix6};
use serde::Serialize;

use crate::{Stopwatch, stamp};

/// Mass and static stiffness of a link.
#[derive(Clone, Debug, Serialize)]
pub struct StaticFigures {
    /// Mass of the whole link.
    pub mass_kg: f64,
    /// Centre of mass.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass, 3×3 (kg m²).
    pub inertia: [[f64; 3]; 3],
    /// Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad).
    pub stiffness: [[f64; 6]; 6],
    /// Inverse of the stiffness: displacement of B per unit load at B.
    pub compliance: [[f64; 6]; 6],
    /// Position of the elastic joint between the two parts.
    pub split_m: [f64; 3],
    /// The two rigid parts, proximal first.
    pub parts: Vec<PartFigures>,
}

impl StaticFigures {
    /// Returns the figures of a link; `whole`: its mass properties without attached bodies.
    pub(crate) fn new(link: &ReducedLink, whole: &RigidPart) -> Self {
        Self {
            mass_kg: whole.mass,
            com_m: whole.com.into(),
            inertia: rows3(&whole.inertia),
            stiffness: rows6(&link.K_BB),
            compliance: link.tip_compliance().map_or([[f64::NAN; 6]; 6], |C| rows6(&C)),
            split_m: link.split.X_LS.translation.vector.into(),
            parts: vec![PartFigures::from(&link.proximal), PartFigures::from(&link.distal)],
        }
    }

    /// Returns the table of masses.
    ///
    /// * `whole`: name of the first row. `attached`: bodies listed after it.
    /// * `number`: text of a moment of inertia.
    pub(crate) fn mass_table(&self, whole: &str, attached: &[PartFigures], number: fn(f64) -> String) -> ReportTable {
        let row = |name: &str, mass: f64, com: &[f64; 3], I: &[[f64; 3]; 3]| {
            let moments = [I[0][0], I[1][1], I[2][2], I[0][1], I[0][2], I[1][2]].map(number);
            vec![name.to_owned(), format!("{mass:.4}"), triple(com), moments.join(", ")]
        };
        let part = |(name, part): (&str, &PartFigures)| row(name, part.mass_kg, &part.com_m, &part.inertia);
        let mut rows = vec![row(whole, self.mass_kg, &self.com_m, &self.inertia)];
        rows.extend(attached.iter().map(|body| part(("attached body", body))));
        rows.extend(["proximal part", "distal part"].into_iter().zip(&self.parts).map(part));
        rows.push(vec!["elastic joint".into(), String::new(), triple(&self.split_m), String::new()]);
        let header = ["", "mass [kg]", "centre of mass [m]", "ixx, iyy, izz, ixy, ixz, iyz about it [kg m2]"];
        ReportTable::new("mass", &header, rows)
    }

    /// Returns the table of the displacements of B under loads of familiar size, and those of the
    /// matrices.
    pub(crate) fn stiffness_tables(&self, number: fn(f64) -> String) -> [ReportTable; 3] {
        // 1 kN and mm, 1 kN m and mrad.
        let compliance = |k: usize| number(1e6 * self.compliance[k][k]);
        let rows = vec![
            vec!["displacement of B under 1 kN".into(), compliance(0), compliance(1), compliance(2), "mm".into()],
            vec!["rotation of B under 1 kN m".into(), compliance(3), compliance(4), compliance(5), "mrad".into()],
        ];
        [
            ReportTable::new("deflection of B along the load, A held", &["", "x", "y", "z", ""], rows),
            matrix_table("stiffness K_BB at B, A held (N/m, N/rad; N m/m, N m/rad)", &self.stiffness),
            matrix_table("compliance C_BB at B, A held (m/N, m/(N m); rad/N, rad/(N m))", &self.compliance),
        ]
    }
}

/// A rigid part.
#[derive(Clone, Debug, Serialize)]
pub struct PartFigures {
    /// Mass.
    pub mass_kg: f64,
    /// Centre of mass.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass, 3×3 (kg m²).
    pub inertia: [[f64; 3]; 3],
}

impl From<&RigidPart> for PartFigures {
    fn from(part: &RigidPart) -> Self {
        Self { mass_kg: part.mass, com_m: part.com.into(), inertia: rows3(&part.inertia) }
    }
}

/// Figures of a modal link: `model = "modal"` of a robot file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModalFigures {
    /// Number of generalised coordinates: six per interface except A, then modes.
    pub coordinates: usize,
    /// Interfaces except A, distal first.
    pub interfaces: Vec<String>,
    /// Mass, without attached bodies.
    pub mass_kg: f64,
    /// Whether the second-order integrals are known.
    pub second_order: bool,
    /// Whether the geometric stiffness is stored (`geometric_stiffening = true` of a robot file).
    pub geometric: bool,
    /// All natural frequencies with A held (Hz).
    pub frequencies_hz: Vec<f64>,
}

impl From<&ModalLink> for ModalFigures {
    fn from(link: &ModalLink) -> Self {
        Self {
            coordinates: link.coordinates(),
            interfaces: link.interfaces.iter().map(|interface| interface.name.clone()).collect(),
            mass_kg: link.mass,
            second_order: link.has_second_order(),
            geometric: link.geometric.is_some(),
            frequencies_hz: link.held_frequencies_hz(),
        }
    }
}

impl ModalFigures {
    /// Returns the table of the modal link.
    pub(crate) fn table(&self) -> ReportTable {
        let (low, high) = (self.frequencies_hz.first(), self.frequencies_hz.last());
        let hz = |x: Option<&f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.1}"));
        let of = match self.interfaces.as_slice() {
            [one] => format!("interface {one}"),
            several => format!("interfaces {}", several.join(", ")),
        };
        let rows = vec![
            vec!["coordinates".into(), format!("{}, {of}, {} Hz to {} Hz", self.coordinates, hz(low), hz(high))],
            vec!["second-order integrals".into(), if self.second_order { "known" } else { "unknown" }.into()],
            vec!["geometric stiffness".into(), if self.geometric { "stored" } else { "not stored" }.into()],
        ];
        ReportTable::new("modal link, A held", &["", ""], rows)
    }
}

/// Time and memory of a command.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct CostFigures {
    /// Wall-clock time, excluding the writing of files (s).
    pub wall_s: f64,
    /// Processor time, all threads (s).
    pub cpu_s: f64,
    /// Peak memory of the process so far; null where the system does not report it.
    pub peak_rss_bytes: Option<u64>,
}

impl CostFigures {
    pub(crate) fn since(start: &Stopwatch) -> Self {
        Self { wall_s: start.wall_s(), cpu_s: start.cpu_s(), peak_rss_bytes: stamp::peak_rss_bytes() }
    }
}

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

fn matrix_table(title: &'static str, M: &[[f64; 6]; 6]) -> ReportTable {
    let rows = M
        .iter()
        .zip(COMPONENTS)
        .map(|(row, name)| std::iter::once(name.to_owned()).chain(row.iter().map(|x| format!("{x:.6e}"))).collect());
    let header: Vec<&str> = std::iter::once("").chain(COMPONENTS).collect();
    ReportTable::new(title, &header, rows.collect()).on_page()
}

/// Formats a check with the limit below which its value usually is.
pub(crate) fn below(name: &str, value: f64, usual: f64) -> Vec<String> {
    let mark = if value <= usual { "ok" } else { "warn" };
    vec![name.to_owned(), format!("{value:.1e}"), format!("below {usual:.0e}"), mark.to_owned()]
}

/// Formats three numbers with four decimals, without a negative zero.
pub(crate) fn triple(p: &[f64; 3]) -> String {
    p.map(|x| format!("{:.4}", if x.abs() < 5e-5 { 0.0 } else { x })).join(", ")
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

/// Relative errors of the first frequency above which a model is reported as too coarse.
const COARSE_PARTS: f64 = 0.05;
const COARSE_MODES: f64 = 0.005;

/// Returns warnings about reduced models with an inaccurate first frequency.
///
/// * `source`: origin of the reference frequency: the mesh, or the matrices.
/// * `parts`, `modes`: relative errors of the two rigid parts and of the kept modes.
pub(crate) fn coarse(source: &str, parts: Option<f64>, modes: Option<f64>) -> Vec<Finding> {
    let off = |error: Option<f64>, bound: f64| error.filter(|error| error.abs() > bound);
    let parts = off(parts, COARSE_PARTS).map(|error| {
        let percent = 100.0 * error;
        let said = format!(
            "the first frequency with two rigid parts differs from that of {source} by {percent:+.1} %, as it will \
             in a simulation with them"
        );
        Finding::warning("coarse-parts", "", said, "").measured(error, COARSE_PARTS)
    });
    let modes = off(modes, COARSE_MODES).map(|error| {
        let percent = 100.0 * error;
        let setting = Setting::Modes;
        let said =
            format!("the first frequency with the kept modes differs by {percent:+.2} %: keep more modes ({setting})");
        Finding::warning("coarse-modes", "", said, "").measured(error, COARSE_MODES).mended_by(&[Setting::Modes])
    });
    parts.into_iter().chain(modes).collect()
}

/// Names the link in warnings about it.
pub(crate) fn about(link: &str, findings: Vec<Finding>) -> Vec<Finding> {
    findings.into_iter().map(|finding| Finding { location: link.into(), ..finding }).collect()
}

fn rows3(M: &Matrix3<f64>) -> [[f64; 3]; 3] {
    M.transpose().into()
}

fn rows6(M: &Matrix6<f64>) -> [[f64; 6]; 6] {
    M.transpose().into()
}
