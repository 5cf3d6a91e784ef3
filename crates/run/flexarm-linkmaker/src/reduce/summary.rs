//! Figures of a reduction; the JSON keys are stable.
//!
//! Start at [`ReduceSummary`]. A is the proximal and B the distal interface; SI units, link axes,
//! linear first; errors are relative to the mesh. Not here: figures shared with an import
//! ([`crate::figures`]), the tables of the figures (`report.rs`), the checks that compute them
//! (`flexarm_fem::mesh_gate`).

use flexarm_fe_io::mesh::MeshFile;
use flexarm_fem::chain::Chain;
use flexarm_fem::mesh_gate::ModeCheck;
use flexarm_fem::sparse::Ordering;
use flexarm_fem::{LinkPlan, Material, MeshGate, MeshReduction, ReducedLink, UnitSystem};
use flexarm_settings::finding::{self, Finding};
use serde::Serialize;

use super::JUDGED_MODES;
use super::interfaces::SelectedInterface;
use super::job::ReduceJob;
use super::prepare::quadrature_name;
use super::words::described;
use crate::figures::{CostFigures, ModalFigures, PartFigures, StaticFigures, about, coarse};
use crate::yardsticks;

/// Result of `flexarm reduce`.
#[derive(Clone, Debug, Serialize)]
pub struct ReduceSummary {
    /// Name of the link.
    pub link: String,
    /// The mesh file.
    pub mesh: String,
    /// Format of the mesh file.
    pub format: &'static str,
    /// Units of the mesh.
    pub units: String,
    /// Method: "guyan" or "craig-bampton, 10 modes".
    pub method: String,
    /// Quadrature: exact or calculix.
    pub quadrature: &'static str,
    /// Material of each region.
    pub materials: Vec<RegionFigures>,
    /// Number of nodes of the mesh.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// Number of degrees of freedom.
    pub dofs: usize,
    /// Interfaces, proximal first.
    pub interfaces: Vec<InterfaceFigures>,
    /// Mass of the mesh and stiffness of the link.
    #[serde(flatten)]
    pub statics: StaticFigures,
    /// Bodies attached to the link that are not in the mesh; included in `parts`, not in `mass_kg`.
    pub attached: Vec<PartFigures>,
    /// Chains of more parts in the link file.
    pub chains: Vec<ChainFigures>,
    /// Natural frequencies of the mesh with A held and B free (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Frequencies of the kept modes: those of the mesh with all interfaces held (Hz).
    pub fixed_interface_hz: Vec<f64>,
    /// Modal link in the link file.
    pub modal: Option<ModalFigures>,
    /// Modes with A held, of the mesh and of the reduced models.
    pub modes: Vec<ModeFigures>,
    /// Results of the checks.
    pub checks: CheckFigures,
    /// Figures of the linear solver.
    pub solver: SolverFigures,
    /// Time of each step (s).
    pub phases: PhaseFigures,
    /// Time and memory.
    #[serde(flatten)]
    pub cost: CostFigures,
    /// Warnings.
    pub warnings: Vec<String>,
    /// The same warnings with code, value and reference value.
    pub caveats: Vec<Finding>,
    /// Written files.
    pub files: ReduceFiles,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReduceFiles {
    /// Link file, for `reduced = "..."` of a robot file.
    pub flex: Option<String>,
    /// Stress at the nodes of the surface, beside the link file; null unless requested.
    pub stress: Option<String>,
    /// Entry for a robot file that uses the link, as TOML.
    pub entry: Option<String>,
    /// Complete job, to run it again.
    pub job: Option<String>,
    /// Summary file.
    pub summary: Option<String>,
    /// Report.
    pub report: Option<String>,
    /// Pictures of the ties, the deflections and the modes; empty without the feature `png`.
    pub pictures: Vec<String>,
}

/// An interface.
#[derive(Clone, Debug, Serialize)]
pub struct InterfaceFigures {
    /// Name.
    pub name: String,
    /// Selection of the nodes.
    pub selector: String,
    /// Number of nodes.
    pub nodes: usize,
    /// Tie: rigid or distributing.
    pub tie: &'static str,
    /// Position of the frame.
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw of the frame.
    pub rpy_rad: [f64; 3],
    /// Mean position of the nodes.
    pub centroid_m: [f64; 3],
    /// Size of the bounding box of the nodes.
    pub extent_m: [f64; 3],
}

impl From<&SelectedInterface> for InterfaceFigures {
    fn from(one: &SelectedInterface) -> Self {
        let X = &one.interface.X_LI;
        let (roll, pitch, yaw) = X.rotation.euler_angles();
        Self {
            name: one.interface.name.clone(),
            selector: one.selector.to_string(),
            nodes: one.interface.nodes.len(),
            tie: one.interface.tie.name(),
            position_m: X.translation.vector.into(),
            rpy_rad: [roll, pitch, yaw],
            centroid_m: one.centroid.into(),
            extent_m: one.extent.into(),
        }
    }
}

/// A region with the material in use.
#[derive(Clone, Debug, Serialize)]
pub struct RegionFigures {
    /// Name of the region.
    pub region: String,
    /// Material of the region.
    pub material: MaterialFigures,
    /// Source of the material: mesh or job.
    pub from: &'static str,
}

/// A material, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialFigures {
    /// Preset and constants as text.
    pub text: String,
    /// Young's modulus (Pa).
    #[serde(rename = "E")]
    pub young: f64,
    /// Poisson's ratio.
    pub nu: f64,
    /// Density (kg/m³).
    pub rho: f64,
}

impl MaterialFigures {
    pub(super) fn new(material: &Material) -> Self {
        Self { text: described(material), young: material.E, nu: material.nu, rho: material.rho }
    }
}

/// A chain of rigid parts.
#[derive(Clone, Debug, Serialize)]
pub struct ChainFigures {
    /// Number of parts.
    pub parts: usize,
    /// Natural frequencies with A held and B free (Hz), at most as many as checked against the
    /// mesh.
    pub frequencies_hz: Vec<f64>,
}

impl ChainFigures {
    pub(super) fn new(chain: &Chain, modes: usize) -> Self {
        let mut frequencies_hz = chain.held_frequencies_hz();
        frequencies_hz.truncate(modes);
        Self { parts: chain.parts.len(), frequencies_hz }
    }
}

/// One mode with A held and B free; errors are relative to the mesh.
#[derive(Clone, Debug, Serialize)]
pub struct ModeFigures {
    /// Frequency of the mesh (Hz).
    pub mesh_hz: f64,
    /// Frequency of the reduced matrices with their modes, Craig-Bampton (Hz).
    pub reduced_hz: Option<f64>,
    /// Relative error of the Craig-Bampton frequency.
    pub reduced_error: Option<f64>,
    /// Frequency of the reduced matrices without modes, Guyan (Hz).
    pub guyan_hz: Option<f64>,
    /// Relative error of the Guyan frequency.
    pub guyan_error: Option<f64>,
    /// Frequency of the two rigid parts (Hz).
    pub lumped_hz: Option<f64>,
    /// Relative error of the frequency of the two parts.
    pub lumped_error: Option<f64>,
}

impl From<&ModeCheck> for ModeFigures {
    fn from(mode: &ModeCheck) -> Self {
        let error = |hz: Option<f64>| hz.map(|hz| hz / mode.mesh_hz - 1.0);
        Self {
            mesh_hz: mode.mesh_hz,
            reduced_hz: mode.reduced_hz,
            reduced_error: mode.reduced_error(),
            guyan_hz: mode.guyan_hz,
            guyan_error: error(mode.guyan_hz),
            lumped_hz: mode.lumped_hz,
            lumped_error: error(mode.lumped_hz),
        }
    }
}

/// Results of the checks.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CheckFigures {
    /// Maximum relative asymmetry of the reduced stiffness as computed.
    pub symmetry: f64,
    /// Maximum relative force under rigid-body motion of all interfaces.
    pub rigid_body_residual: f64,
    /// Relative difference between the mass in the reduced matrix and that of the mesh.
    pub mass_error: f64,
    /// Difference of the centres of mass (m).
    pub com_error_m: f64,
    /// Relative difference of the inertias.
    pub inertia_error: f64,
    /// Residual of the identity between `K_AA`, `K_AB` and `K_BB`.
    pub block_identity: f64,
    /// Number of zero-frequency modes of the free reduced link; must be six.
    pub zero_modes: usize,
    /// Minimum eigenvalue of `K_BB`, scaled to a unit diagonal.
    pub min_eigenvalue: f64,
    /// Estimated condition number of the stiffness of the free nodes.
    pub condition: f64,
    /// Maximum residual of the kept modes.
    pub mode_residual: f64,
    /// Minimum Jacobian at an integration point, relative to the mean of its element.
    pub jacobian_at_points: f64,
    /// Minimum Jacobian at a node, relative to the mean of its element.
    pub jacobian_at_nodes: f64,
    /// Number in the file of the element with the minimum Jacobian at a node.
    pub worst_element: u64,
    /// Minimum volume of an element, relative to that of the best shape with edges of the same
    /// length.
    pub smallest_fullness: f64,
    /// Maximum distance of a mid-side node from the middle of its edge, relative to the length of
    /// the edge.
    pub largest_offset: f64,
    /// Ratio of the compliance at B with second-order elements to that of the mesh, for the
    /// component with the ratio farthest from one; null for second-order elements.
    pub order_ratio: Option<f64>,
    /// Ratios of all components, along x y z rx ry rz.
    pub order_ratios: Option<[f64; 6]>,
}

impl CheckFigures {
    fn of(gate: &MeshGate, link: &ReducedLink) -> Self {
        Self {
            symmetry: gate.asymmetry,
            rigid_body_residual: gate.rigid_body_residual,
            mass_error: gate.mass_error,
            com_error_m: gate.com_error_m,
            inertia_error: gate.inertia_error,
            block_identity: gate.block_identity,
            zero_modes: gate.zero_modes,
            min_eigenvalue: link.checks.min_eigenvalue,
            condition: gate.condition,
            mode_residual: gate.mode_residual,
            jacobian_at_points: gate.quality.smallest_at_points,
            jacobian_at_nodes: gate.quality.smallest_at_nodes,
            worst_element: gate.quality.worst_element,
            smallest_fullness: gate.quality.smallest_fullness,
            largest_offset: gate.quality.largest_offset,
            order_ratio: gate.order.map(|order| order.worst()),
            order_ratios: gate.order.map(|order| order.compliance_ratio),
        }
    }
}

/// Figures of the linear solver.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SolverFigures {
    /// Number of unknowns of the factorisation.
    pub unknowns: usize,
    /// Number of stored entries of the lower triangle of the matrix.
    pub matrix_entries: usize,
    /// Number of stored entries of the factor.
    pub factor_entries: usize,
    /// Ordering used: amd or nested.
    pub ordering: &'static str,
    /// Total number of right-hand sides solved.
    pub right_hand_sides: usize,
}

impl From<&MeshReduction> for SolverFigures {
    fn from(reduction: &MeshReduction) -> Self {
        let factor = reduction.solver.factor;
        Self {
            unknowns: factor.size,
            matrix_entries: factor.matrix_entries,
            factor_entries: factor.factor_entries,
            ordering: if factor.ordering == Ordering::MinimumDegree { "amd" } else { "nested" },
            right_hand_sides: reduction.solves,
        }
    }
}

/// Time of each step (s).
#[derive(Clone, Debug, Default, Serialize)]
pub struct PhaseFigures {
    /// Reading of the mesh and selection of nodes.
    pub read_s: f64,
    /// Element matrices and assembly.
    pub assembly_s: f64,
    /// Cholesky factorisation and static shapes.
    pub factorisation_s: f64,
    /// Fixed-interface modes, and those of the mesh with A held.
    pub modes_s: f64,
    /// Rigid parts, chains and checks.
    pub parts_s: f64,
}

/// Returns the figures of a finished reduction; times and memory are filled in later.
pub(super) fn summary_of(
    job: &ReduceJob,
    plan: &LinkPlan,
    file: &MeshFile,
    units: UnitSystem,
    chosen: &[SelectedInterface],
    materials: Vec<RegionFigures>,
    reduction: &MeshReduction,
) -> ReduceSummary {
    let link = &reduction.link;
    let details = link.details.as_deref();
    let gate = details.and_then(|details| details.gate.as_ref());
    let modes: Vec<_> = gate.map_or_else(Vec::new, |gate| gate.modes.iter().map(ModeFigures::from).collect());
    let caveats = caveats_of(reduction, modes.first(), chosen, file.mesh.nodes.len());
    let kept = reduction.fixed_modes.len();
    ReduceSummary {
        link: link.name.clone(),
        mesh: job.mesh.display().to_string(),
        format: file.format,
        units: units.name(),
        method: match kept {
            0 => "guyan".into(),
            1 => "craig-bampton, 1 mode".into(),
            _ => format!("craig-bampton, {kept} modes"),
        },
        quadrature: quadrature_name(job),
        materials,
        nodes: file.mesh.nodes.len(),
        elements: file.mesh.element_count(),
        dofs: reduction.solver.dofs,
        interfaces: chosen.iter().map(InterfaceFigures::from).collect(),
        statics: StaticFigures::new(link, &reduction.whole),
        attached: plan.attached.iter().map(PartFigures::from).collect(),
        // Chains of the mesh without attached bodies.
        chains: reduction.bare_chains.iter().map(|chain| ChainFigures::new(chain, JUDGED_MODES)).collect(),
        frequencies_hz: reduction.held_modes.frequencies_hz(),
        fixed_interface_hz: reduction.fixed_modes.frequencies_hz(),
        modal: details.and_then(|details| details.modal.as_ref()).map(ModalFigures::from),
        modes,
        checks: gate.map(|gate| CheckFigures::of(gate, link)).unwrap_or_default(),
        solver: SolverFigures::from(reduction),
        phases: PhaseFigures::default(),
        cost: CostFigures::default(),
        warnings: finding::warnings(&caveats),
        caveats,
        files: ReduceFiles::default(),
    }
}

/// Returns the caveats about a reduction; `nodes`: number of nodes of the mesh.
fn caveats_of(
    reduction: &MeshReduction,
    first_mode: Option<&ModeFigures>,
    chosen: &[SelectedInterface],
    nodes: usize,
) -> Vec<Finding> {
    let mut findings = reduction.caveats.clone();
    findings.extend(first_mode.iter().flat_map(|m| coarse("the mesh", m.lumped_error, m.reduced_error)));
    findings.extend(yardsticks::of_link(&reduction.link, &reduction.whole));
    findings.extend(spreads(chosen, nodes));
    findings.extend(chosen.iter().filter_map(|one| {
        let off = (one.interface.X_LI.translation.vector - one.centroid).norm();
        yardsticks::of_point(&one.interface.name, off, one.extent.norm())
    }));
    about(&reduction.link.name, findings)
}

/// Returns warnings about interfaces that extend over a large share of the distance between the two
/// farthest ones; `nodes` is the number of nodes of the mesh.
fn spreads(chosen: &[SelectedInterface], nodes: usize) -> Vec<Finding> {
    let place = |one: &SelectedInterface| one.interface.X_LI.translation.vector;
    let pairs = chosen.iter().enumerate().flat_map(|(k, a)| chosen[..k].iter().map(move |b| place(a) - place(b)));
    let Some(line) = pairs.max_by(|a, b| a.norm().total_cmp(&b.norm())) else { return Vec::new() };
    let length = line.norm();
    // Extent of the bounding box along the line; the edges of the box are along the axes.
    let along = |one: &SelectedInterface| one.extent.dot(&(line / length).abs());
    let share = |one: &SelectedInterface| one.interface.nodes.len() as f64 / nodes as f64;
    let judged =
        |one: &SelectedInterface| yardsticks::of_interface(&one.interface.name, along(one) / length, share(one));
    chosen.iter().filter_map(judged).collect()
}
