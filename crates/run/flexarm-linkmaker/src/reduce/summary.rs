//! Figures of a reduction; the JSON keys are stable. SI units, link axes.

use flexarm_fe_io::mesh::MeshFile;
use flexarm_fem::chain::Chain;
use flexarm_fem::mesh_gate::ModeCheck;
use flexarm_fem::sparse::Ordering;
use flexarm_fem::{Doubt, LinkPlan, Material, MeshReduction, ModalLink, RigidPart, UnitSystem};
use flexarm_settings::Setting;
use flexarm_settings::caveat::{self, Caveat};
use nalgebra::{Matrix3, Matrix6};
use serde::Serialize;

use super::JUDGED_MODES;
use super::interfaces::Chosen;
use super::job::ReduceJob;
use super::prepare::quadrature_name;
use super::words::described;
use crate::yardsticks;

/// Answer of `flexarm reduce`.
#[derive(Clone, Debug, Serialize)]
pub struct ReduceSummary {
    /// Name of the link.
    pub link: String,
    /// The mesh file.
    pub mesh: String,
    /// Its format.
    pub format: &'static str,
    /// Its units.
    pub units: String,
    /// How: "guyan" or "craig-bampton, 10 modes".
    pub method: String,
    /// exact or calculix.
    pub quadrature: &'static str,
    /// Material of each region.
    pub materials: Vec<RegionFigures>,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Its elements.
    pub elements: usize,
    /// Its degrees of freedom.
    pub dofs: usize,
    /// Interfaces, proximal first.
    pub interfaces: Vec<InterfaceFigures>,
    /// Mass of the whole link.
    pub mass_kg: f64,
    /// Its centre of mass.
    pub com_m: [f64; 3],
    /// Its inertia about the centre of mass, 3×3 (kg m²).
    pub inertia: [[f64; 3]; 3],
    /// Stiffness at B with A held, 6×6, linear first (N/m, N/rad; N m/m, N m/rad).
    pub stiffness: [[f64; 6]; 6],
    /// Its inverse: displacement of B per unit load at B.
    pub compliance: [[f64; 6]; 6],
    /// Where the elastic joint of the two parts sits.
    pub split_m: [f64; 3],
    /// The two rigid parts, proximal first.
    pub parts: Vec<PartFigures>,
    /// Bodies that ride on the link without being in the mesh; they are in `parts`, not in
    /// `mass_kg`.
    pub attached: Vec<PartFigures>,
    /// Chains of more parts that the link file holds.
    pub chains: Vec<ChainFigures>,
    /// Natural frequencies of the mesh with A held and B free (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Frequencies of the mesh with all interfaces held: the modes that were kept (Hz).
    pub fixed_interface_hz: Vec<f64>,
    /// The modal link in the link file.
    pub modal: Option<ModalFigures>,
    /// Modes with A held, of the mesh and of the reduced models.
    pub modes: Vec<ModeFigures>,
    /// What was checked.
    pub checks: CheckFigures,
    /// The linear algebra.
    pub solver: SolverFigures,
    /// Time of each step (s).
    pub phases: PhaseFigures,
    /// Wall-clock time without the writing of files (s).
    pub wall_s: f64,
    /// Processor time, all threads (s).
    pub cpu_s: f64,
    /// Largest memory of the process so far; null where the system does not tell.
    pub peak_rss_bytes: Option<u64>,
    /// Things worth telling.
    pub warnings: Vec<String>,
    /// The same with code, value and yardstick.
    pub caveats: Vec<Caveat>,
    /// Written files.
    pub files: ReduceFiles,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReduceFiles {
    /// The link file, for `reduced = "..."` of a robot file.
    pub flex: Option<String>,
    /// The entry of a robot file that uses it, as TOML.
    pub entry: Option<String>,
    /// The job, complete, to run again.
    pub job: Option<String>,
    /// These figures.
    pub summary: Option<String>,
    /// These figures for people.
    pub report: Option<String>,
    /// What is tied, how the link bends, its modes; empty without the feature `png`.
    pub pictures: Vec<String>,
}

/// An interface.
#[derive(Clone, Debug, Serialize)]
pub struct InterfaceFigures {
    /// Name.
    pub name: String,
    /// Which nodes were asked for.
    pub selector: String,
    /// How many these are.
    pub nodes: usize,
    /// rigid or distributing.
    pub tie: &'static str,
    /// Position of its frame.
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw of its frame.
    pub rpy_rad: [f64; 3],
    /// Mean of its nodes.
    pub centroid_m: [f64; 3],
    /// Size of the box around its nodes.
    pub extent_m: [f64; 3],
}

/// A region with the material that was used.
#[derive(Clone, Debug, Serialize)]
pub struct RegionFigures {
    /// Name of the region.
    pub region: String,
    /// Its material.
    pub material: MaterialFigures,
    /// mesh, or job.
    pub from: &'static str,
}

/// A material, SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialFigures {
    /// Preset and constants for people.
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

/// A chain of rigid parts.
#[derive(Clone, Debug, Serialize)]
pub struct ChainFigures {
    /// Number of parts.
    pub parts: usize,
    /// Natural frequencies with A held and B free (Hz), as many as the mesh's.
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
    /// Of the mesh (Hz).
    pub mesh_hz: f64,
    /// Of the reduced matrices with their modes, Craig-Bampton (Hz).
    pub reduced_hz: Option<f64>,
    /// Its error.
    pub reduced_error: Option<f64>,
    /// Of the reduced matrices without modes, Guyan (Hz).
    pub guyan_hz: Option<f64>,
    /// Its error.
    pub guyan_error: Option<f64>,
    /// Of the two rigid parts (Hz).
    pub lumped_hz: Option<f64>,
    /// Its error.
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

/// A modal link: `model = "modal"` of a robot file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModalFigures {
    /// Shape coordinates: six per interface but A, then modes.
    pub coordinates: usize,
    /// Interfaces but A, distal first.
    pub interfaces: Vec<String>,
    /// Mass, without bodies that ride on the link.
    pub mass_kg: f64,
    /// Whether the integrals of second order are known.
    pub second_order: bool,
    /// Whether stiffness by load is there (`geometric_stiffening = true` of a robot file).
    pub geometric: bool,
    /// Natural frequencies with A held, all of them (Hz).
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

/// What was checked.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CheckFigures {
    /// Largest relative asymmetry of the reduced stiffness as computed.
    pub symmetry: f64,
    /// Largest relative force under rigid motion of all interfaces.
    pub rigid_body_residual: f64,
    /// Relative difference of the mass in the reduced matrix from that of the mesh.
    pub mass_error: f64,
    /// The same of the centre of mass (m).
    pub com_error_m: f64,
    /// The same of the inertia, relative.
    pub inertia_error: f64,
    /// Disagreement of `K_AA`, `K_AB` with `K_BB`.
    pub block_identity: f64,
    /// Modes of the free reduced link without frequency; six are right.
    pub zero_modes: usize,
    /// Smallest eigenvalue of `K_BB`, scaled to a unit diagonal.
    pub min_eigenvalue: f64,
    /// Condition number of the stiffness of the free nodes, estimated.
    pub condition: f64,
    /// Largest residual of the kept modes.
    pub mode_residual: f64,
    /// Smallest Jacobian at an integration point over the mean of its element.
    pub jacobian_at_points: f64,
    /// Smallest Jacobian at a node over the mean of its element.
    pub jacobian_at_nodes: f64,
    /// Number in the file of the element with the latter.
    pub worst_element: u64,
    /// Smallest volume of an element over that of the best shape with edges of the same length.
    pub smallest_fullness: f64,
    /// Largest distance of a mid-side node from the middle of its edge, over the length of the
    /// edge.
    pub largest_offset: f64,
    /// Compliance at B with elements of second order over that of the mesh, the component farthest
    /// from one; null for elements of second order.
    pub order_ratio: Option<f64>,
    /// The same along x y z rx ry rz.
    pub order_ratios: Option<[f64; 6]>,
}

/// The linear algebra.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SolverFigures {
    /// Unknowns of the factor.
    pub unknowns: usize,
    /// Entries of the lower triangle of the matrix.
    pub matrix_entries: usize,
    /// Entries of its factor.
    pub factor_entries: usize,
    /// amd or nested: the order that was used.
    pub ordering: &'static str,
    /// Right-hand sides solved in all.
    pub right_hand_sides: usize,
}

/// Time of each step (s).
#[derive(Clone, Debug, Default, Serialize)]
pub struct PhaseFigures {
    /// Reading the mesh, choosing nodes.
    pub read_s: f64,
    /// Element matrices.
    pub assembly_s: f64,
    /// Cholesky factor and static shapes.
    pub factorisation_s: f64,
    /// Fixed-interface modes, and those of the mesh with A held.
    pub modes_s: f64,
    /// Parts, chains, checks.
    pub parts_s: f64,
}

/// The figures of a finished reduction; those of the machine come later.
pub(super) fn summary_of(
    job: &ReduceJob,
    plan: &LinkPlan,
    file: &MeshFile,
    units: UnitSystem,
    chosen: &[Chosen],
    materials: Vec<RegionFigures>,
    reduction: &MeshReduction,
) -> ReduceSummary {
    let link = &reduction.link;
    let details = link.details.as_deref();
    let gate = details.and_then(|details| details.gate.as_ref());
    let interface = |one: &Chosen| {
        let X = &one.interface.X_LI;
        let (roll, pitch, yaw) = X.rotation.euler_angles();
        InterfaceFigures {
            name: one.interface.name.clone(),
            selector: one.selector.to_string(),
            nodes: one.interface.nodes.len(),
            tie: one.interface.tie.name(),
            position_m: X.translation.vector.into(),
            rpy_rad: [roll, pitch, yaw],
            centroid_m: one.centroid.into(),
            extent_m: one.extent.into(),
        }
    };
    let checks = gate.map_or_else(CheckFigures::default, |gate| CheckFigures {
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
    });
    let modes: Vec<_> = gate.map_or_else(Vec::new, |gate| gate.modes.iter().map(ModeFigures::from).collect());
    let coarse =
        modes.first().map_or_else(Vec::new, |first| coarse("the mesh", first.lumped_error, first.reduced_error));
    let own = yardsticks::of_link(link, &reduction.whole);
    let doubts =
        reduction.doubts.iter().cloned().chain(coarse).chain(own).chain(spreads(chosen, file.mesh.nodes.len()));
    let caveats: Vec<Caveat> = doubts.map(|doubt| doubted(&link.name, doubt)).collect();
    let kept = reduction.fixed_modes.len();
    let factor = reduction.solver.factor;
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
        interfaces: chosen.iter().map(interface).collect(),
        mass_kg: reduction.whole.mass,
        com_m: reduction.whole.com.into(),
        inertia: rows3(&reduction.whole.inertia),
        stiffness: rows6(&link.K_BB),
        compliance: link.tip_compliance().map_or([[f64::NAN; 6]; 6], |C| rows6(&C)),
        split_m: link.split.X_LS.translation.vector.into(),
        parts: vec![PartFigures::from(&link.proximal), PartFigures::from(&link.distal)],
        attached: plan.attached.iter().map(PartFigures::from).collect(),
        // As the mesh is: without what rides on it.
        chains: reduction.bare_chains.iter().map(|chain| ChainFigures::new(chain, JUDGED_MODES)).collect(),
        frequencies_hz: reduction.held_modes.frequencies_hz(),
        fixed_interface_hz: reduction.fixed_modes.frequencies_hz(),
        modal: details.and_then(|details| details.modal.as_ref()).map(ModalFigures::from),
        modes,
        checks,
        solver: SolverFigures {
            unknowns: factor.size,
            matrix_entries: factor.matrix_entries,
            factor_entries: factor.factor_entries,
            ordering: if factor.ordering == Ordering::MinimumDegree { "amd" } else { "nested" },
            right_hand_sides: reduction.solves,
        },
        phases: PhaseFigures::default(),
        wall_s: 0.0,
        cpu_s: 0.0,
        peak_rss_bytes: None,
        warnings: caveat::warnings(&caveats),
        caveats,
        files: ReduceFiles::default(),
    }
}

/// Interfaces that take much of the link between the two that are farthest apart; `nodes`: of the
/// mesh.
fn spreads(chosen: &[Chosen], nodes: usize) -> Vec<Doubt> {
    let place = |one: &Chosen| one.interface.X_LI.translation.vector;
    let pairs = chosen.iter().enumerate().flat_map(|(k, a)| chosen[..k].iter().map(move |b| place(a) - place(b)));
    let Some(line) = pairs.max_by(|a, b| a.norm().total_cmp(&b.norm())) else { return Vec::new() };
    let length = line.norm();
    // Of a box of nodes the extent along the line; its edges are along the axes.
    let along = |one: &Chosen| one.extent.dot(&(line / length).abs());
    let share = |one: &Chosen| one.interface.nodes.len() as f64 / nodes as f64;
    let judged = |one: &Chosen| yardsticks::of_interface(&one.interface.name, along(one) / length, share(one));
    chosen.iter().filter_map(judged).collect()
}

/// Errors of the first frequency beyond which a model is called too coarse.
const COARSE_PARTS: f64 = 0.05;
const MODES_MISS: f64 = 0.005;
/// Code of the caveat that the kept modes miss it.
const COARSE_MODES: &str = "coarse-modes";

/// Sentences about reduced models that miss the first frequency.
///
/// * `source`: whose frequency it is: that of the mesh, or of the matrices.
/// * `parts`, `modes`: relative errors of the two rigid parts and of the kept modes.
pub(crate) fn coarse(source: &str, parts: Option<f64>, modes: Option<f64>) -> Vec<Doubt> {
    let off = |error: Option<f64>, bound: f64| error.filter(|error| error.abs() > bound);
    let parts = off(parts, COARSE_PARTS).map(|error| {
        let percent = 100.0 * error;
        let said = format!(
            "two rigid parts miss the first frequency of {source} by {percent:+.1} %: so will a simulation with them"
        );
        Doubt::found("coarse-parts", error, COARSE_PARTS, said)
    });
    let modes = off(modes, MODES_MISS).map(|error| {
        let percent = 100.0 * error;
        let setting = Setting::Modes;
        let said = format!("the kept modes miss the first frequency by {percent:+.2} %: keep more of them ({setting})");
        Doubt::found(COARSE_MODES, error, MODES_MISS, said)
    });
    parts.into_iter().chain(modes).collect()
}

/// A doubt about a link as a caveat.
pub(crate) fn doubted(link: &str, doubt: Doubt) -> Caveat {
    let Doubt { code, message, value, yardstick } = doubt;
    let finite = |x: Option<f64>| x.filter(|x| x.is_finite());
    let settings = if code == COARSE_MODES { vec![Setting::Modes] } else { Vec::new() };
    Caveat { value: finite(value), yardstick: finite(yardstick), settings, ..Caveat::said(code, link, message, "") }
}

fn rows3(M: &Matrix3<f64>) -> [[f64; 3]; 3] {
    M.transpose().into()
}

fn rows6(M: &Matrix6<f64>) -> [[f64; 6]; 6] {
    M.transpose().into()
}
