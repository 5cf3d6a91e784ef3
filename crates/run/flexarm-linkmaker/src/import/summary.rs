//! Figures of an import; those shared with `flexarm reduce` have the same keys.
//!
//! Start at [`ImportSummary`]. A is the proximal and B the distal interface; SI units, link axes,
//! linear first. Not here: figures and tables shared with a reduction ([`crate::figures`]), the
//! checks themselves (`flexarm_fem::gate`).

use std::fmt::Write as _;

use flexarm_fem::matrix_link::MatrixReduction;
use flexarm_fem::reduction::Superelement;
use flexarm_fem::{GateLimits, ModalLink, ReducedLink};
use flexarm_settings::{Finding, written};
use nalgebra::DMatrix;
use serde::Serialize;

use super::SECOND_ORDER_UNKNOWN;
use crate::figures::{
    CostFigures, ModalFigures, ReportTable, StaticFigures, about, below, coarse, triple, warning_list,
};

/// Result of `flexarm import`.
#[derive(Clone, Debug, Serialize)]
pub struct ImportSummary {
    /// Name of the link.
    pub link: String,
    /// Input files.
    pub sources: Vec<String>,
    /// Format of the files.
    pub format: String,
    /// Units of the files.
    pub units: String,
    /// Method: "reduced matrices", "craig-bampton, 10 modes", ...
    pub method: String,
    /// Number of rows of the stiffness in the file.
    pub rows: usize,
    /// Interfaces, proximal first.
    pub interfaces: Vec<ImportInterface>,
    /// Mass and stiffness of the link.
    #[serde(flatten)]
    pub statics: StaticFigures,
    /// Natural frequencies with A held and B free (Hz); empty without a mass matrix or modes.
    pub frequencies_hz: Vec<f64>,
    /// Natural frequencies of the two rigid parts with their joint (Hz).
    pub lumped_frequencies_hz: Vec<f64>,
    /// Frequencies of the fixed-interface modes in the matrices (Hz).
    pub fixed_interface_hz: Vec<f64>,
    /// Modal link in the file or computed from it; null where there is none.
    pub modal: Option<ModalFigures>,
    /// Results of the checks.
    pub checks: ImportChecks,
    /// Time and memory.
    #[serde(flatten)]
    pub cost: CostFigures,
    /// Warnings.
    pub warnings: Vec<String>,
    /// The same warnings with code, value and reference value.
    pub caveats: Vec<Finding>,
    /// Written files.
    pub files: ImportFiles,
}

/// An interface.
#[derive(Clone, Debug, Serialize)]
pub struct ImportInterface {
    /// Name.
    pub name: String,
    /// Rows or nodes in the file.
    pub rows: String,
    /// Position of the frame.
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw of the frame.
    pub rpy_rad: [f64; 3],
    /// Source of the frame.
    pub from: &'static str,
}

/// Results of the checks; relative unless the key has a unit.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ImportChecks {
    /// Maximum asymmetry of the matrices in the file.
    pub symmetry: f64,
    /// Residual force under rigid-body motion.
    pub rigid_body_residual: f64,
    /// Maximum relative difference between the masses along x, y, z and that of the link; null
    /// without a mass matrix.
    pub mass_error: Option<f64>,
    /// Residual of the identity between the blocks of the stiffness.
    pub block_identity: f64,
    /// Minimum eigenvalue of the stiffness, scaled to a unit diagonal.
    pub min_eigenvalue: f64,
    /// Condition number of the scaled stiffness.
    pub condition: f64,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ImportFiles {
    /// Link file, for `reduced = "..."` of a robot file.
    pub flex: Option<String>,
    /// Entry for a robot file that uses the link, as TOML.
    pub entry: Option<String>,
    /// Summary file.
    pub summary: Option<String>,
    /// Report.
    pub report: Option<String>,
}

/// Data of an import other than the reduction.
pub(super) struct Parts {
    pub(super) files: Vec<String>,
    pub(super) format: String,
    pub(super) units: String,
    pub(super) method: String,
    pub(super) rows: usize,
    pub(super) interfaces: Vec<ImportInterface>,
    pub(super) asymmetry: f64,
    /// With its mass, in link axes.
    pub(super) element: Option<Superelement>,
    pub(super) warnings: Vec<String>,
}

/// Relative difference of masses above which a warning is given.
const MASS_ERROR: f64 = 1e-6;

impl ImportSummary {
    pub(super) fn new(reduction: &MatrixReduction, parts: Parts) -> Self {
        let MatrixReduction { link, whole, held_frequencies_hz, lumped_frequencies_hz, .. } = reduction;
        // Mass matrix against the link, which may have other masses; findings; modal link.
        let gate = &link.checks;
        let masses = parts.element.as_ref().map(masses_along_axes);
        let mass_error = masses.map(|m| m.iter().map(|m| (m / whole.mass - 1.0).abs()).fold(0.0, f64::max));
        let mut all = findings(reduction, &parts.warnings, mass_error.zip(masses));
        let modal = modal_figures(link, &mut all);
        Self {
            link: link.name.clone(),
            sources: parts.files,
            format: parts.format,
            units: parts.units,
            method: parts.method,
            rows: parts.rows,
            interfaces: parts.interfaces,
            statics: StaticFigures::new(link, whole),
            frequencies_hz: held_frequencies_hz.iter().copied().take(10).collect(),
            lumped_frequencies_hz: lumped_frequencies_hz.clone(),
            fixed_interface_hz: parts.element.as_ref().map_or_else(Vec::new, Superelement::fixed_frequencies_hz),
            modal,
            checks: ImportChecks {
                symmetry: gate.asymmetry.max(parts.asymmetry),
                rigid_body_residual: gate.rigid_body_residual.unwrap_or(0.0),
                mass_error,
                block_identity: gate.block_identity.unwrap_or(0.0),
                min_eigenvalue: gate.min_eigenvalue,
                condition: gate.condition,
            },
            cost: CostFigures::default(),
            warnings: all.iter().map(|finding| finding.message.clone()).collect(),
            caveats: about(&link.name, all),
            files: ImportFiles::default(),
        }
    }
}

/// Returns the findings about the files and the link.
///
/// * `mass`: relative error of the masses along x, y, z, and the masses (kg).
fn findings(reduction: &MatrixReduction, warnings: &[String], mass: Option<(f64, [f64; 3])>) -> Vec<Finding> {
    let MatrixReduction { link, whole, held_frequencies_hz, lumped_frequencies_hz, caveats } = reduction;
    let mut all: Vec<Finding> =
        warnings.iter().map(|sentence| Finding::warning("matrix-file", "", sentence, "")).collect();
    all.extend(caveats.iter().cloned());
    if let Some((error, m)) = mass.filter(|(error, _)| error.is_nan() || *error > MASS_ERROR) {
        let sentence = format!("the mass matrix has {:.6}, {:.6}, {:.6} kg along x, y, z", m[0], m[1], m[2]);
        all.push(Finding::warning("mass", "", sentence, "").measured(error, MASS_ERROR));
    }
    all.extend(crate::yardsticks::of_link(link, whole));
    let first = held_frequencies_hz.first().zip(lumped_frequencies_hz.first());
    all.extend(coarse("the matrices", first.map(|(hz, lumped)| lumped / hz - 1.0), None));
    all
}

/// Returns the figures of the modal link, stored or made of the superelement; adds a finding about
/// the latter if its second-order terms are unknown.
fn modal_figures(link: &ReducedLink, findings: &mut Vec<Finding>) -> Option<ModalFigures> {
    let details = link.details.as_deref()?;
    if let Some(stored) = &details.modal {
        return Some(ModalFigures::from(stored));
    }
    let modal = ModalLink::from_superelement(&link.name, details.superelement.as_ref()?).ok()?;
    if !modal.has_second_order() {
        findings.push(Finding::warning("second-order", "", SECOND_ORDER_UNKNOWN, ""));
    }
    Some(ModalFigures::from(&modal))
}

/// Returns the mass under a translation of all interfaces along x, y, z.
fn masses_along_axes(element: &Superelement) -> [f64; 3] {
    let n = element.boundary();
    let M: DMatrix<f64> = element.M.view((0, 0), (n, n)).into_owned();
    let along = |axis: usize| {
        let rows = || (axis..n).step_by(6);
        rows().flat_map(|i| rows().map(move |j| (i, j))).map(|place| M[place]).sum()
    };
    [along(0), along(1), along(2)]
}

/// Returns all tables of an import.
pub fn tables(summary: &ImportSummary) -> Vec<ReportTable> {
    let interfaces = summary.interfaces.iter();
    let interfaces = interfaces
        .map(|i| vec![i.name.clone(), i.rows.clone(), triple(&i.position_m), triple(&i.rpy_rad), i.from.into()]);
    let header = ["interface", "rows", "position", "roll, pitch, yaw", "from"];
    let number = |x: f64| format!("{x:.4e}");
    let mut tables = vec![
        ReportTable::new("interfaces (m, rad, link frame)", &header, interfaces.collect()),
        summary.statics.mass_table("whole", &[], number),
    ];
    tables.extend(summary.statics.stiffness_tables(number));

    let count = summary.frequencies_hz.len().max(summary.lumped_frequencies_hz.len());
    let hz = |list: &[f64], k: usize| list.get(k).map_or_else(|| "-".into(), |x| format!("{x:.2}"));
    let mode =
        |k: usize| vec![(k + 1).to_string(), hz(&summary.frequencies_hz, k), hz(&summary.lumped_frequencies_hz, k)];
    let (title, frequencies) = ("natural frequencies, A held, B free (Hz)", (0..count).map(mode).collect());
    tables.push(ReportTable::new("checks", &["", "measured", "usual", ""], check_rows(&summary.checks)));
    tables.push(ReportTable::new(title, &["mode", "matrices", "two parts"], frequencies));
    tables.extend(summary.modal.as_ref().map(ModalFigures::table));
    tables
}

/// Returns the checks with their usual values.
fn check_rows(c: &ImportChecks) -> Vec<Vec<String>> {
    let limits = GateLimits::default();
    let mut checks = vec![
        // A DMIG has nine decimals.
        below("asymmetry of the stiffness", c.symmetry, 1e-8),
        below("force under rigid-body motion", c.rigid_body_residual, limits.rigid_body_warning),
        below("mismatch of the stiffness blocks", c.block_identity, limits.rigid_body_warning),
    ];
    let least = if c.min_eigenvalue > limits.min_eigenvalue { "ok" } else { "warn" };
    let usual = format!("above {:.0e}", limits.min_eigenvalue);
    checks.push(vec!["minimum eigenvalue".into(), format!("{:.1e}", c.min_eigenvalue), usual, least.into()]);
    checks.push(match c.mass_error {
        Some(error) => below("mass along x, y, z against the link", error, MASS_ERROR),
        None => vec!["mass".into(), "-".into(), "no mass matrix".into(), "-".into()],
    });
    checks
}

/// Returns the figures as a Markdown page.
pub fn markdown(summary: &ImportSummary) -> String {
    let mut page = format!(
        "# Link {}\n\n{}: {}, {}, {} rows; {}\n",
        written::markdown(&summary.link),
        written::markdown(&summary.sources.join(", ")),
        summary.format,
        written::markdown(&summary.units),
        summary.rows,
        written::markdown(&summary.method)
    );
    for table in tables(summary) {
        let _ = writeln!(page, "\n## {}\n", table.title);
        page += &table.markdown();
    }
    page += &warning_list(&summary.warnings);
    page
}
