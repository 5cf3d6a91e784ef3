//! Preparation of a job: a mesh with materials and a plan, with all checks made before the work
//! starts.
//!
//! Start at [`prepare`]. All faults of a job are collected and reported together. M is the frame of
//! the mesh, L the link; SI after reading. Not here: the job's keys (`job.rs`), the reduction
//! (`flexarm_fem::reduce_mesh`).

use flexarm_fe_io::mesh::{MeshFile, ReadOptions};
use flexarm_fe_io::read_mesh;
use flexarm_fem::element::Quadrature;
use flexarm_fem::mesh_link::MeshLinkError;
use flexarm_fem::model::AssemblyOptions;
use flexarm_fem::reduction::{CondensationOptions, ReductionError, TieError};
use flexarm_fem::sparse::{ModesWanted, Ordering};
use flexarm_fem::{GateLimits, LinkPlan, Material, Provenance, UnitSystem, mass_properties};
use flexarm_settings::{Finding, Setting, Words};
use flexarm_spatial::Pose;

use super::interfaces::{MeshFrame, SelectedInterface, pose};
use super::job::ReduceJob;
use super::summary::{MaterialFigures, RegionFigures};
use super::urdf_link::UrdfLink;
use super::words::{MATERIAL_FORMS, OrderingChoice, QuadratureChoice, described};
use super::{JUDGED_MODES, MAX_MODES, MODES};
use crate::{LinkError, stamp};

/// Input of a reduction.
pub(super) struct Prepared {
    pub(super) plan: LinkPlan,
    /// Mesh in link axes, with the materials of the job.
    pub(super) file: MeshFile,
    pub(super) units: UnitSystem,
    pub(super) chosen: Vec<SelectedInterface>,
    pub(super) materials: Vec<RegionFigures>,
    pub(super) findings: Vec<Finding>,
}

/// Reads the mesh of a job in its own axes, SI, with its nodes merged as the job requests; also
/// returns its warnings.
pub(super) fn read(job: &ReduceJob) -> Result<(MeshFile, Vec<String>), LinkError> {
    let units = units_of(job);
    let mut file = read_mesh(&job.mesh, &ReadOptions { units, ..ReadOptions::default() }).map_err(Box::new)?;
    let mut warnings = std::mem::take(&mut file.warnings);
    if let Some(distance) = job.merge {
        merge(&mut file, distance, units, &mut warnings)?;
    }
    Ok((file, warnings))
}

/// Returns the units of the mesh; without units it is read as SI, so that messages can propose
/// some.
fn units_of(job: &ReduceJob) -> UnitSystem {
    job.units.unwrap_or(UnitSystem::SI)
}

/// Returns plan and mesh of a reduction, from a job and its mesh as [`read`] returns it.
///
/// # Errors
/// All faults of units, materials, names and interfaces together; those of the robot's link.
pub(super) fn prepare(
    job: &ReduceJob,
    (mut file, mut warnings): (MeshFile, Vec<String>),
    robot: Option<&UrdfLink>,
) -> Result<Prepared, LinkError> {
    if let Some(entry) = job.urdf.as_ref().filter(|_| robot.is_none()) {
        let what = "is the robot file of the job: its data for the link are required";
        return Err(LinkError::content(&entry.file, what));
    }
    let units = units_of(job);
    let X_LM = job.mesh_frame.map_or_else(Pose::identity, |frame| pose(&frame, units.length));

    // Faults of units, materials, names and interfaces, all in one error.
    let mut faults = Vec::new();
    if job.units.is_none() {
        faults.push(no_units(job, &file));
    }
    let materials = materials(job, &mut file, &mut faults, &mut warnings);
    if job.link_name().trim().is_empty() || job.link_name().contains(['/', '\\', '\n']) {
        faults.push(LinkError::Job(format!(
            "{:?} is not a valid link name: use one that can be part of a file name ({})",
            job.link_name(),
            Setting::Name
        )));
    }
    // The reader's warning about a deck without sections does not apply if the job has the
    // material.
    warnings.retain(|said| !said.contains("hence without a material") || materials.is_empty());
    let place = MeshFrame { mesh: &file.mesh, unit: units.length, X_LM };
    let chosen = place.choose(job, robot).unwrap_or_else(|more| {
        faults.extend(more);
        Vec::new()
    });
    if let [a, b, ..] = chosen.as_slice()
        && let size = file.mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).norm())
        && (a.interface.X_LI.translation.vector - b.interface.X_LI.translation.vector).norm() <= 1e-6 * size
    {
        let names = [&a.interface.name, &b.interface.name];
        let what = format!("interfaces {names:?} are at the same point; a link needs a length");
        faults.push(LinkError::content(&job.mesh, what));
    }
    if !faults.is_empty() {
        return Err(LinkError::of_all(faults));
    }
    // Findings, then the plan with the mesh in link axes.
    let finding = |code: &'static str| move |sentence: String| Finding::warning(code, "", sentence, "");
    let mut findings: Vec<Finding> = warnings.into_iter().map(finding("mesh-file")).collect();
    findings.extend(chosen.iter().flat_map(SelectedInterface::node_warnings).map(finding("interface-nodes")));
    findings.extend(place.findings(&chosen).into_iter().map(finding("interface-frame")));
    findings.extend(material_doubts(&file, units, &materials).into_iter().map(finding("material")));
    let mut plan = plan(job, &file, units, &chosen, &materials);
    plan.assembly.quadrature = quadrature(job, &file)?;
    file.mesh = file.mesh.transformed(&X_LM);
    attach_rest(job, &file, robot, &mut plan)?;
    Ok(Prepared { plan, file, units, chosen, materials, findings })
}

/// Adds the mass of the robot's link beyond that of the mesh, fixed to the two parts, if the job
/// requests it.
fn attach_rest(
    job: &ReduceJob,
    file: &MeshFile,
    robot: Option<&UrdfLink>,
    plan: &mut LinkPlan,
) -> Result<(), LinkError> {
    let (Some(robot), Some(entry)) = (robot, job.urdf.as_ref().filter(|entry| entry.rest)) else { return Ok(()) };
    let densities: Vec<f64> = file.mesh.regions.iter().map(|r| r.material.map_or(0.0, |m| m.rho)).collect();
    let mesh =
        mass_properties(&file.mesh, &densities).map_err(|error| LinkError::content(&job.mesh, error.to_string()))?;
    let p_AoBo_L = plan.interfaces[1].X_LI.translation.vector - plan.interfaces[0].X_LI.translation.vector;
    plan.attached = robot.rest(&mesh, &p_AoBo_L).map_err(|what| LinkError::content(&entry.file, what))?.into();
    Ok(())
}

/// Merges coincident nodes.
fn merge(file: &mut MeshFile, distance: f64, units: UnitSystem, warnings: &mut Vec<String>) -> Result<(), LinkError> {
    if !(distance.is_finite() && distance >= 0.0) {
        let what = format!("merge = {distance}: a distance of zero or more, in the unit of the mesh");
        return Err(LinkError::Job(what));
    }
    let merged = file.mesh.merge_coincident(distance * units.length);
    let before = file.mesh.nodes.len();
    warnings.push(match merged {
        0 => format!("merge: no two of the {before} nodes are closer than {distance} (unit of the mesh)"),
        _ => format!("merge: {merged} of {before} nodes coincided with another node and were merged with it"),
    });
    Ok(())
}

/// Returns warnings about the materials in use, with the numbers as given.
fn material_doubts(file: &MeshFile, units: UnitSystem, figures: &[RegionFigures]) -> Vec<String> {
    let mut findings: Vec<(String, Vec<&str>)> = Vec::new();
    for figure in figures {
        let region = file.mesh.regions.iter().find(|region| region.name == figure.region);
        let Some(material) = region.and_then(|region| region.material) else { continue };
        // Materials of a job are in SI, independent of the units of the mesh.
        let written = if figure.from == "mesh" { units } else { UnitSystem::SI };
        for finding in material.warnings(&written) {
            match findings.iter_mut().find(|(known, _)| *known == finding) {
                Some((_, regions)) => regions.push(&figure.region),
                None => findings.push((finding, vec![&figure.region])),
            }
        }
    }
    findings.into_iter().map(|(finding, regions)| format!("material of {}: {finding}", regions.join(", "))).collect()
}

fn no_units(job: &ReduceJob, file: &MeshFile) -> LinkError {
    let size = file.mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).amax());
    let what = format!(
        "the units of the mesh are not declared: {setting} LENGTH-MASS-TIME or units = \"...\"; the mesh is {size:.6} long in \
         its own unit, so {size:.4} m with m-kg-s (N, Pa) and {:.4} m with mm-t-s (N, MPa)",
        1e-3 * size,
        setting = Setting::Units
    );
    LinkError::content(&job.mesh, what)
}

/// Assigns the materials of the job to the mesh; returns the material of each region.
fn materials(
    job: &ReduceJob,
    file: &mut MeshFile,
    faults: &mut Vec<LinkError>,
    warnings: &mut Vec<String>,
) -> Vec<RegionFigures> {
    let fault = |what: String| LinkError::content(&job.mesh, what);
    let mesh = &mut file.mesh;
    let names: Vec<&str> = mesh.regions.iter().map(|region| region.name.as_str()).collect();
    for name in job.materials.keys().filter(|name| !names.contains(&name.as_str())) {
        faults.push(fault(format!("a material is given for region {name:?}; the mesh has the regions {names:?}")));
    }
    let used: Vec<bool> = (0..mesh.regions.len())
        .map(|index| mesh.blocks.iter().any(|block| block.region == index && !block.is_empty()))
        .collect();
    let (mut figures, mut missing) = (Vec::new(), Vec::new());
    for (region, _) in mesh.regions.iter_mut().zip(used).filter(|(_, used)| *used) {
        let given = job.materials.get(&region.name).or(job.material.as_ref());
        let (material, from) = match (given, region.material) {
            (Some(given), own) => {
                // The two can only be compared if the units are known.
                if let Some(own) = own.filter(|own| job.units.is_some() && differ(own, &given.material)) {
                    warnings.push(format!(
                        "region {:?}: the material of the job, {given}, replaces that of the mesh, {}",
                        region.name,
                        described(&own)
                    ));
                }
                (given.material, "job")
            }
            (None, Some(own)) => (own, "mesh"),
            (None, None) => {
                missing.push(region.name.as_str());
                continue;
            }
        };
        region.material = Some(material);
        figures.push(RegionFigures { region: region.name.clone(), material: MaterialFigures::new(&material), from });
    }
    if !missing.is_empty() {
        faults.push(fault(format!(
            "no material for {} {missing:?}: {setting} MATERIAL for all, {setting} REGION=MATERIAL for one, or \
             material = ... in the job file, where MATERIAL is {}",
            if missing.len() == 1 { "region" } else { "regions" },
            MATERIAL_FORMS,
            setting = Setting::Material
        )));
    }
    figures
}

/// Whether two materials differ in E, ν or ρ by more than 1e-6, relative.
fn differ(a: &Material, b: &Material) -> bool {
    [(a.E, b.E), (a.nu, b.nu), (a.rho, b.rho)].into_iter().any(|(a, b)| (a - b).abs() > 1e-6 * a.abs().max(b.abs()))
}

fn wanted_modes(job: &ReduceJob) -> ModesWanted {
    match (job.modes, job.modes_up_to_hz) {
        (_, Some(hz)) => ModesWanted::Below { omega2: (std::f64::consts::TAU * hz).powi(2), at_most: MAX_MODES },
        (modes, None) => ModesWanted::Count(modes.unwrap_or(MODES)),
    }
}

/// Collects the settings of the reduction from the job and the mesh, with their defaults.
fn plan(
    job: &ReduceJob,
    file: &MeshFile,
    units: UnitSystem,
    chosen: &[SelectedInterface],
    materials: &[RegionFigures],
) -> LinkPlan {
    let split = job.split.unwrap_or_default().at(units.length);
    let ordering = match job.ordering.unwrap_or_default() {
        OrderingChoice::Auto => Ordering::Auto,
        OrderingChoice::Amd => Ordering::MinimumDegree,
        OrderingChoice::Nested => Ordering::NestedDissection,
    };
    LinkPlan {
        name: job.link_name(),
        interfaces: chosen.iter().map(|one| one.interface.clone()).collect(),
        assembly: AssemblyOptions::default(),
        condensation: CondensationOptions { ordering },
        modes: wanted_modes(job),
        split,
        chains: job.chains.clone().unwrap_or_default(),
        attached: Vec::new(),
        geometric: job.geometric.unwrap_or(false),
        stress: job.stress.unwrap_or(false),
        judged_modes: JUDGED_MODES,
        limits: GateLimits::default(),
        provenance: provenance(job, file, units, chosen, materials),
    }
}

fn provenance(
    job: &ReduceJob,
    file: &MeshFile,
    units: UnitSystem,
    chosen: &[SelectedInterface],
    materials: &[RegionFigures],
) -> Provenance {
    // One tie for all, or that of each interface.
    let ties: Vec<&str> = chosen.iter().map(|one| one.interface.tie.name()).collect();
    let tie = match ties.as_slice() {
        [first, rest @ ..] if rest.iter().all(|tie| tie == first) => (*first).to_owned(),
        _ => chosen
            .iter()
            .map(|one| format!("{} {}", one.interface.name, one.interface.tie.name()))
            .collect::<Vec<_>>()
            .join(", "),
    };
    let materials: Vec<String> = materials.iter().map(|m| format!("{}: {}", m.region, m.material.text)).collect();
    let mesh = job.mesh.file_name().unwrap_or_default().to_string_lossy();
    Provenance {
        source: format!("{mesh} ({})", file.format),
        method: match wanted_modes(job) {
            ModesWanted::Count(0) => "guyan".into(),
            _ => "craig-bampton".into(),
        },
        tie,
        units: units.name(),
        date: stamp::today(),
        note: format!(
            "flexarm {}; {}; {} quadrature{}",
            env!("CARGO_PKG_VERSION"),
            materials.join("; "),
            quadrature_name(job),
            if job.geometric == Some(true) { "; geometric stiffness" } else { "" }
        ),
    }
}

/// Returns the quadrature of a job; that of CalculiX with incompatible modes if the deck has C3D8I.
fn quadrature(job: &ReduceJob, file: &MeshFile) -> Result<Quadrature, LinkError> {
    let has = |name: &str| file.element_types.contains(name);
    match job.quadrature.unwrap_or_default() {
        QuadratureChoice::Exact => Ok(Quadrature::Exact),
        QuadratureChoice::Calculix if has("C3D8I") && (has("C3D8") || has("C3D8R")) => {
            let what = "the deck has C3D8I as well as C3D8 or C3D8R; the rules of CalculiX are available for \
                        bricks of one type only: use one type for all bricks, or omit quadrature, which gives all \
                        bricks incompatible modes";
            Err(LinkError::content(&job.mesh, what))
        }
        QuadratureChoice::Calculix if has("C3D8I") => Ok(Quadrature::CalculixModes),
        QuadratureChoice::Calculix => Ok(Quadrature::Calculix),
    }
}

pub(super) fn quadrature_name(job: &ReduceJob) -> &'static str {
    job.quadrature.unwrap_or_default().word().unwrap_or_default()
}

/// Adds to an error the number and the position of the node in the file; to one about modes the size
/// of the mesh, because wrong units are the usual cause.
pub(super) fn failed(job: &ReduceJob, file: &MeshFile, units: UnitSystem, source: MeshLinkError) -> LinkError {
    let node = match &source {
        MeshLinkError::Reduction(ReductionError::Tie(TieError::Overlap { node, .. })) => Some(*node as usize),
        MeshLinkError::Reduction(ReductionError::Loose { node, .. })
        | MeshLinkError::Hinge { source: ReductionError::Loose { node, .. }, .. } => Some(*node),
        _ => None,
    };
    let described = node.and_then(|node| {
        let (id, p) = (file.mesh.node_ids.get(node)?, file.mesh.nodes.get(node)? / units.length);
        Some(format!("; in the file this is node {id}, at {:.6}, {:.6}, {:.6} in the unit of the mesh", p.x, p.y, p.z))
    });
    let mut note = described.unwrap_or_default();
    if let MeshLinkError::Modes(_) | MeshLinkError::Reduction(ReductionError::Modes(_)) = source
        && let Some((low, high)) = file.mesh.bounding_box()
    {
        let (size, units) = ((high - low).amax(), units.name());
        note = format!("; with units {units} the largest dimension of the mesh is {size:.3e} m: are they its units?");
    }
    LinkError::Reduction { path: job.mesh.clone(), note, source: Box::new(source) }
}
