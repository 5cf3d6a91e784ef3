//! Figures of an import; those shared with `flexarm reduce` have the same keys. SI units, link
//! axes.

use std::fmt::Write as _;

use flexarm_fem::matrix_link::MatrixReduction;
use flexarm_fem::reduction::Superelement;
use flexarm_fem::{GateLimits, ModalLink, ReducedLink};
use flexarm_settings::{Finding, written};
use nalgebra::DMatrix;
use serde::Serialize;

use super::SECOND_ORDER_UNKNOWN;
use crate::reduce::{
    ModalFigures, PartFigures, ReportTable, about, coarse, matrix_table, modal_table, rows3, rows6, warning_list,
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
    /// Mass of the whole link.
    pub mass_kg: f64,
    /// Centre of mass.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass, 3×3 (kg m²).
    pub inertia: [[f64; 3]; 3],
    /// Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad).
    pub stiffness: [[f64; 6]; 6],
    /// Inverse of the stiffness.
    pub compliance: [[f64; 6]; 6],
    /// Position of the elastic joint between the two parts.
    pub split_m: [f64; 3],
    /// The two rigid parts, proximal first.
    pub parts: Vec<PartFigures>,
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
    /// Wall-clock time, excluding the writing of files (s).
    pub wall_s: f64,
    /// Processor time, all threads (s).
    pub cpu_s: f64,
    /// Peak memory of the process so far; null where the system does not report it.
    pub peak_rss_bytes: Option<u64>,
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
            mass_kg: whole.mass,
            com_m: whole.com.into(),
            inertia: rows3(&whole.inertia),
            stiffness: rows6(&link.K_BB),
            compliance: link.tip_compliance().map_or([[f64::NAN; 6]; 6], |C| rows6(&C)),
            split_m: link.split.X_LS.translation.vector.into(),
            parts: vec![PartFigures::from(&link.proximal), PartFigures::from(&link.distal)],
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
            wall_s: 0.0,
            cpu_s: 0.0,
            peak_rss_bytes: None,
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
    let table = |title, header: &[&'static str], rows| ReportTable::new(title, header, rows);
    let vector = |p: &[f64; 3]| p.map(|x| format!("{:.4}", if x.abs() < 5e-5 { 0.0 } else { x })).join(", ");
    let interfaces = summary.interfaces.iter();
    let interfaces = interfaces
        .map(|i| vec![i.name.clone(), i.rows.clone(), vector(&i.position_m), vector(&i.rpy_rad), i.from.into()])
        .collect();
    let body = |name: &str, mass: f64, com: &[f64; 3], I: &[[f64; 3]; 3]| {
        let moments = [I[0][0], I[1][1], I[2][2], I[0][1], I[0][2], I[1][2]].map(|x| format!("{x:.4e}")).join(", ");
        vec![name.to_owned(), format!("{mass:.4}"), vector(com), moments]
    };
    let mut masses = vec![body("whole", summary.mass_kg, &summary.com_m, &summary.inertia)];
    for (name, part) in ["proximal part", "distal part"].iter().zip(&summary.parts) {
        masses.push(body(name, part.mass_kg, &part.com_m, &part.inertia));
    }
    masses.push(vec!["elastic joint".into(), String::new(), vector(&summary.split_m), String::new()]);
    let C = &summary.compliance;
    let soft = |k: usize| format!("{:.4e}", 1e6 * C[k][k]);
    let softness = vec![
        vec!["displacement of B under 1 kN".into(), soft(0), soft(1), soft(2), "mm".into()],
        vec!["rotation of B under 1 kN m".into(), soft(3), soft(4), soft(5), "mrad".into()],
    ];
    let count = summary.frequencies_hz.len().max(summary.lumped_frequencies_hz.len());
    let hz = |list: &[f64], k: usize| list.get(k).map_or_else(|| "-".into(), |x| format!("{x:.2}"));
    let frequencies = (0..count)
        .map(|k| vec![(k + 1).to_string(), hz(&summary.frequencies_hz, k), hz(&summary.lumped_frequencies_hz, k)])
        .collect();
    let mut tables = vec![
        table(
            "interfaces (m, rad, link frame)",
            &["interface", "rows", "position", "roll, pitch, yaw", "from"],
            interfaces,
        ),
        table(
            "mass",
            &["", "mass [kg]", "centre of mass [m]", "ixx, iyy, izz, ixy, ixz, iyz about it [kg m2]"],
            masses,
        ),
        table("deflection of B along the load, A held", &["", "x", "y", "z", ""], softness),
        matrix_table("stiffness K_BB at B, A held (N/m, N/rad; N m/m, N m/rad)", &summary.stiffness),
        matrix_table("compliance C_BB at B, A held (m/N, m/(N m); rad/N, rad/(N m))", &summary.compliance),
        table("checks", &["", "measured", "usual", ""], check_rows(&summary.checks)),
        table("natural frequencies, A held, B free (Hz)", &["mode", "matrices", "two parts"], frequencies),
    ];
    tables.extend(summary.modal.as_ref().map(modal_table));
    tables
}

/// Returns the checks with their usual values.
fn check_rows(c: &ImportChecks) -> Vec<Vec<String>> {
    let limits = GateLimits::default();
    let below = |name: &str, value: f64, usual: f64| {
        let mark = if value <= usual { "ok" } else { "warn" };
        vec![name.to_owned(), format!("{value:.1e}"), format!("below {usual:.0e}"), mark.into()]
    };
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
