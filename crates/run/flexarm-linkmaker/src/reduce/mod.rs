//! Reduction of a mesh to a flexible link with its files (`flexarm reduce`).
//!
//! A [`ReduceJob`] comes from a file, from flags, or from both ([`ReduceJob::put_over`]).
//! [`Reduction::open`] checks it and reads the mesh; [`Reduction::finish`] reduces the mesh and
//! writes the link file, the complete job, the figures and a report. In between, a caller with a
//! robot provides its data of the link ([`UrdfLink`]). [`list_mesh`] lists the contents of a mesh,
//! for the choice of interfaces.
//!
//! ```no_run
//! use flexarm_linkmaker::reduce::{ReduceJob, ReduceOutputs, Reduction};
//!
//! let job = ReduceJob::load("lower_arm.reduce.toml".as_ref())?;
//! let outputs = ReduceOutputs { folder: Some("out/lower_arm".into()), ..ReduceOutputs::default() };
//! let summary = Reduction::open(&job, Some(&outputs), &mut |_| {})?.finish(None, &mut |_| {})?;
//! println!("{:.2} kg, first frequency {:.1} Hz", summary.statics.mass_kg, summary.frequencies_hz[0]);
//! # Ok::<(), flexarm_linkmaker::LinkError>(())
//! ```
//!
//! Units: SI, except lengths in a job, which are in the unit of its mesh. Positions of interfaces
//! are in the link frame; node selections are in the frame of the mesh, as a mesher shows them.
//!
//! Not here: the reduction itself (`flexarm-fem`), the robot file.

pub(crate) mod files;
mod interfaces;
pub(crate) mod job;
mod listing;
mod prepare;
mod report;
mod summary;
mod urdf_link;
mod words;

use flexarm_fe_io::mesh::{MeshFile, ReadOptions};
use flexarm_fe_io::read_mesh;
use flexarm_fem::mesh_link::ReductionStep;
use flexarm_fem::stress::write_stress;
use flexarm_fem::{UnitSystem, reduce_mesh, write_flex};
use flexarm_settings::Setting;
use flexarm_settings::finding::warnings;
use flexarm_spatial::Pose;

use crate::robot_entry::robot_entry;
use crate::{LinkError, Stopwatch};
use files::Paths;
use interfaces::MeshFrame;
use prepare::{Prepared, failed, prepare, read};
use summary::summary_of;

pub use crate::figures::{CostFigures, ModalFigures, PartFigures, ReportTable, StaticFigures};
pub use files::{ReduceOutputs, STRESS_FILE};
pub use flexarm_fem::reduction::Tie;
pub use flexarm_fem::{NodeSelector, UnitSystem as Units};
pub use job::{FrameEntry, InterfaceEntry, ReduceJob, UrdfEntry};
pub use listing::{MeshListing, RegionListing, SetListing};
pub use report::{headline, markdown, tables};
pub use summary::{
    ChainFigures, CheckFigures, InterfaceFigures, MaterialFigures, ModeFigures, PhaseFigures, ReduceFiles,
    ReduceSummary, RegionFigures, SolverFigures,
};
pub use urdf_link::{LinkJoint, UrdfLink};
pub use words::{At, MaterialChoice, OrderingChoice, QuadratureChoice, SplitChoice, numbers};

/// Default number of modes to keep.
const MODES: usize = 10;
/// Maximum number of modes; more are taken for a typing error.
const MAX_MODES: usize = 1000;
/// Number of modes with A held against which the reduced models are checked.
const JUDGED_MODES: usize = 10;

/// Start of a step.
#[derive(Clone, Copy, Debug)]
pub struct ReduceProgress {
    /// Name of the step.
    pub step: &'static str,
    /// Number of the step, from 1.
    pub number: usize,
    /// Number of steps.
    pub of: usize,
}

/// Number of steps of a reduction, including the reading of the mesh.
const STEPS: usize = ReductionStep::ALL.len() + 1;

/// A checked job with its mesh read and the paths of its results free.
#[derive(Debug)]
pub struct Reduction {
    /// Job with all defaults filled in.
    job: ReduceJob,
    paths: Option<Paths>,
    /// Mesh in its own axes, with its warnings.
    mesh: (MeshFile, Vec<String>),
    stopwatch: Stopwatch,
}

impl Reduction {
    /// Checks the numbers of a job and the paths of the results, then reads the mesh.
    ///
    /// # Errors
    /// [`LinkError::Job`] for invalid numbers, [`LinkError::Files`] for taken paths,
    /// [`LinkError::FeFile`] for an invalid mesh.
    pub fn open(
        job: &ReduceJob,
        outputs: Option<&ReduceOutputs>,
        progress: &mut dyn FnMut(ReduceProgress),
    ) -> Result<Self, LinkError> {
        let stopwatch = Stopwatch::start();
        progress(ReduceProgress { step: "reading the mesh", number: 1, of: STEPS });
        let job = with_defaults(job)?;
        let paths = outputs.map(|outputs| Paths::new(outputs, &job)).transpose()?;
        let mesh = read(&job)?;
        Ok(Self { job, paths, mesh, stopwatch })
    }

    /// Reduces the mesh to a link and writes the files.
    ///
    /// * `robot`: data of the link from the robot of the job ([`ReduceJob::urdf`]); `None` if the
    ///   job has none.
    ///
    /// All checks that do not need the reduction are made first; nothing is written if it fails.
    ///
    /// # Errors
    /// [`LinkError`]; several errors of a job are reported together. See [`LinkError::fault`].
    pub fn finish(
        self,
        robot: Option<&UrdfLink>,
        progress: &mut dyn FnMut(ReduceProgress),
    ) -> Result<ReduceSummary, LinkError> {
        let Self { job, paths, mesh, stopwatch } = self;
        let Prepared { plan, file, units, chosen, materials, findings } = prepare(&job, mesh, robot)?;
        let read_s = stopwatch.wall_s();

        let mut starts = Vec::new();
        let reduction = reduce_mesh(&file.mesh, &plan, &mut |step| {
            starts.push(stopwatch.wall_s());
            let number = starts.len() + 1;
            progress(ReduceProgress { step: step.name(), number, of: STEPS });
        });
        let reduction = reduction.map_err(|source| failed(&job, &file, units, source))?;
        starts.push(stopwatch.wall_s());

        let mut summary = summary_of(&job, &plan, &file, units, &chosen, materials, &reduction);
        let before = crate::figures::about(&summary.link, findings);
        summary.caveats.splice(0..0, before);
        summary.warnings = warnings(&summary.caveats);
        summary.phases = phases(read_s, &starts);
        summary.cost = CostFigures::since(&stopwatch);
        if let Some(paths) = paths {
            let pictures = if paths.folder.is_some() { pictures(&file.mesh, &plan, &reduction)? } else { Vec::new() };
            let stress = reduction.stress.as_ref().map(write_stress);
            let contents =
                Contents { flex: &write_flex(&reduction.link), stress: stress.as_deref(), pictures: &pictures };
            write(&job, &paths, &contents, &mut summary)?;
            // Set after writing: the files must not depend on their location.
            let distal = robot.and_then(UrdfLink::distal_joint);
            let link = robot.map_or(&summary.link, |robot| &robot.name);
            summary.files.entry = paths.flex().map(|flex| robot_entry(flex, link, distal));
        }
        Ok(summary)
    }
}

/// Lists the contents of a job's mesh. Units, materials and positions may be missing.
///
/// # Errors
/// [`LinkError::FeFile`], or [`LinkError::Interface`] for interfaces that select no nodes.
pub fn list_mesh(job: &ReduceJob) -> Result<MeshListing, LinkError> {
    let read = ReadOptions { units: job.units.unwrap_or(UnitSystem::SI), ..ReadOptions::default() };
    let file = read_mesh(&job.mesh, &read).map_err(Box::new)?;
    let unit = read.units.length;
    let X_LM = job.mesh_frame.map_or_else(Pose::identity, |frame| interfaces::pose(&frame, unit));
    let place = MeshFrame { mesh: &file.mesh, unit, X_LM };
    let mut listing = MeshListing::new(&job.mesh, &file, job.units.map(|units| units.name()), &place);
    for entry in &job.interface {
        let Some(selector) = &entry.select else { continue };
        let interface = entry.name.clone().unwrap_or_default();
        let nodes = flexarm_fem::mesh::select(&file.mesh, selector, unit).map_err(|source| LinkError::Interface {
            place: if entry.place.is_empty() { listing.mesh.clone() } else { entry.place.clone() },
            interface: interface.clone(),
            what: source.to_string(),
        })?;
        listing.interfaces.push(SetListing::new(&interface, &nodes, &place));
    }
    Ok(listing)
}

/// Returns the job with all defaults filled in.
fn with_defaults(job: &ReduceJob) -> Result<ReduceJob, LinkError> {
    let mut job = job.clone();
    job.put_over(ReduceJob::default()); // names the interfaces
    job.link = Some(job.link_name());
    match (job.modes, job.modes_up_to_hz) {
        (None, None) => job.modes = Some(MODES),
        (Some(_), Some(_)) => {
            let what = "modes and modes_up_to_hz exclude each other: give one of them";
            return Err(LinkError::Job(what.into()));
        }
        (Some(modes), None) if modes > MAX_MODES => {
            let what = format!("{} {modes}: at most {MAX_MODES} modes can be kept", Setting::Modes);
            return Err(LinkError::Job(what));
        }
        (None, Some(hz)) if !(hz.is_finite() && hz > 0.0) => {
            let what = format!("{} {hz}: a positive frequency in Hz is expected", Setting::ModesUpTo);
            return Err(LinkError::Job(what));
        }
        _ => {}
    }
    let chains = job.chains.get_or_insert_with(Vec::new);
    chains.sort_unstable();
    chains.dedup();
    if let Some(parts) = chains.iter().find(|parts| !(2..=100).contains(*parts)) {
        return Err(LinkError::Job(format!("{} {parts}: a chain has 2 to 100 parts", Setting::Chains)));
    }
    job.geometric.get_or_insert(false);
    job.stress.get_or_insert(false);
    job.tie.get_or_insert(Tie::Rigid);
    job.split.get_or_insert(SplitChoice::ElasticCentre);
    job.quadrature.get_or_insert(QuadratureChoice::Exact);
    job.ordering.get_or_insert(OrderingChoice::Auto);
    Ok(job)
}

fn phases(read_s: f64, starts: &[f64]) -> PhaseFigures {
    let step = |k: usize| match starts.get(k..k + 2) {
        Some([from, to]) => to - from,
        _ => 0.0,
    };
    let [assembly_s, factorisation_s, modes_s, parts_s] = [0, 1, 2, 3].map(step);
    PhaseFigures { read_s, assembly_s, factorisation_s, modes_s, parts_s }
}

/// Draws the pictures, as PNG with their file names; none without the feature `png`.
#[cfg(feature = "png")]
fn pictures(
    mesh: &flexarm_fem::Mesh,
    plan: &flexarm_fem::LinkPlan,
    reduction: &flexarm_fem::MeshReduction,
) -> Result<Vec<(&'static str, Vec<u8>)>, LinkError> {
    use flexarm_draw::mesh_picture::MeshPictures;
    fn failed(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> LinkError {
        LinkError::Pictures(error.into())
    }
    let sheets = MeshPictures::new(mesh, &plan.interfaces, reduction).map_err(failed)?;
    let mut all = vec![("interfaces.png", sheets.render_interfaces()), ("unit_loads.png", sheets.render_unit_loads())];
    if !reduction.held_modes.is_empty() {
        all.push(("modes.png", sheets.render_modes().map_err(failed)?));
    }
    all.into_iter().map(|(name, image)| Ok((name, image.to_png().map_err(failed)?))).collect()
}

#[cfg(not(feature = "png"))]
#[allow(clippy::unnecessary_wraps, reason = "with the feature `png` it can fail")]
fn pictures(
    _: &flexarm_fem::Mesh,
    _: &flexarm_fem::LinkPlan,
    _: &flexarm_fem::MeshReduction,
) -> Result<Vec<(&'static str, Vec<u8>)>, LinkError> {
    Ok(Vec::new())
}

/// Contents of files made of the link.
struct Contents<'a> {
    flex: &'a str,
    stress: Option<&'a [u8]>,
    pictures: &'a [(&'static str, Vec<u8>)],
}

fn write(
    job: &ReduceJob,
    paths: &Paths,
    contents: &Contents<'_>,
    summary: &mut ReduceSummary,
) -> Result<(), LinkError> {
    // Paths, then texts, which contain the paths.
    let Contents { flex, stress, pictures } = *contents;
    let text = |path: &std::path::Path| Some(path.display().to_string());
    summary.files.flex = paths.flex().and_then(text);
    summary.files.stress = paths.stress().first().and_then(|path| text(path));
    let (mut job_text, mut json, mut page) = (String::new(), String::new(), String::new());
    if let Some(folder) = &paths.folder {
        summary.files.job = text(&folder.job);
        summary.files.summary = text(&folder.summary);
        summary.files.report = text(&folder.report);
        summary.files.pictures =
            pictures.iter().map(|(name, _)| folder.path.join(name).display().to_string()).collect();
        job_text = files::job_file(job, &folder.path);
        json = serde_json::to_string_pretty(&summary).expect("plain numbers and strings") + "\n";
        page = markdown(summary);
    }
    // All files at once: either all are written or none.
    let mut files: Vec<(std::path::PathBuf, &[u8])> = Vec::new();
    if let Some(folder) = &paths.folder {
        files.extend([
            (folder.flex.clone(), flex.as_bytes()),
            (folder.job.clone(), job_text.as_bytes()),
            (folder.summary.clone(), json.as_bytes()),
            (folder.report.clone(), page.as_bytes()),
        ]);
        files.extend(pictures.iter().map(|(name, png)| (folder.path.join(name), png.as_slice())));
    }
    files.extend(paths.flex.clone().map(|path| (path, flex.as_bytes())));
    files.extend(stress.iter().flat_map(|stress| paths.stress().into_iter().map(|path| (path, *stress))));
    Ok(paths.write(&files)?)
}
