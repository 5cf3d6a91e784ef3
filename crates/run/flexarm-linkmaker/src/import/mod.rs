//! Import of matrices of another FE program as a flexible link (`flexarm import`).
//!
//! An [`ImportJob`] has the files, their units, the rows of the interfaces and their frames. Data
//! that are in neither the job nor the files are requested in an error, with the text to type. Full
//! models are reduced here; then every link is checked, and its figures are in the
//! [`ImportSummary`].
//!
//! ```no_run
//! use flexarm_linkmaker::import::{ImportJob, ImportOutputs, import};
//!
//! let job = ImportJob {
//!     files: vec!["arm.pch".into()],
//!     units: Some("mm-t-s".parse().unwrap()),
//!     map: Some("A=1001,B=1002".parse().unwrap()),
//!     ..ImportJob::default()
//! };
//! let outputs = ImportOutputs { folder: Some("out/arm".into()), ..ImportOutputs::default() };
//! let summary = import(&job, Some(&outputs))?;
//! println!("{:.2} kg", summary.statics.mass_kg);
//! # Ok::<(), flexarm_linkmaker::LinkError>(())
//! ```
//!
//! Lengths in a job are in the unit of the files, masses in SI. Not here: parsers (`flexarm-fe-io`)
//! and reduction (`flexarm-fem`).

pub(crate) mod full;
mod sid;
mod summary;
mod words;

use std::path::{Path, PathBuf};

use flexarm_fe_io::exchange::{
    ImportedMatrices, InputFile, InterfaceMap, MatrixFormat, MatrixNames, MatrixRole, RowPick, assemble_interfaces,
    parse_matrices, propose_map_of, read_matrices, recognise,
};
use flexarm_fem::gate::check_matrix12;
use flexarm_fem::matrix_link::{MatrixPlan, MatrixReduction, link_from_superelement, turned};
use flexarm_fem::reduction::{InterfaceFrame, Superelement, stiffness12};
use flexarm_fem::{FemError, GateLimits, Pose, Provenance, UnitSystem, write_flex};
use flexarm_files::{check_apart, check_free, file_stem, write_all};
use flexarm_settings::{Caller, Setting};
use nalgebra::{DMatrix, Rotation3, Translation3, Vector3};

use crate::figures::CostFigures;
use crate::reduce::SplitChoice;
use crate::robot_entry::robot_entry;
use crate::{LinkError, Stopwatch, stamp};
use summary::Parts;

pub use flexarm_fe_io::exchange::MatrixNames as Names;
pub use flexarm_fem::matrix_link::PartMasses;
pub use flexarm_fem::{RigidPart, UnitSystem as UnitsOfFile};

pub use crate::reduce::ReduceOutputs as ImportOutputs;
pub use summary::{ImportChecks, ImportFiles, ImportInterface, ImportSummary, markdown, tables};
pub use words::{FrameAt, ImportFormat, ImportMap, NodePlane, parse_inertia, parse_part, triple};

/// Warning about a modal link without its second-order terms, used here and where a robot uses such
/// a link.
pub const SECOND_ORDER_UNKNOWN: &str = "second-order terms of the modal link are unknown, because a condensed mass \
                                        matrix has no mass distribution inside the link: the effect of rotation on \
                                        the deformation is neglected";

/// Default number of modes kept of a full model.
const MODES: usize = 10;

/// Matrices to import, with units, interfaces and masses.
#[derive(Clone, Debug)]
pub struct ImportJob {
    /// Files of one structure; companion files in the same folder are found.
    pub files: Vec<PathBuf>,
    /// Mass file, if its role does not follow from its name.
    pub mass_file: Option<PathBuf>,
    /// Expected format.
    pub format: ImportFormat,
    /// Names of the matrices in files that hold several.
    pub names: MatrixNames,
    /// Units of the files; `None`: those of the sidecar.
    pub units: Option<UnitSystem>,
    /// Rows or nodes of the interfaces, proximal first; `None`: those of the sidecar.
    pub map: Option<ImportMap>,
    /// Frames of interfaces; the others are taken from the files.
    pub at: Vec<FrameAt>,
    /// Rotation from matrix axes to link axes: roll, pitch, yaw (rad).
    pub axes_rpy: Vector3<f64>,
    /// Number of fixed-interface modes to keep of a full model.
    pub modes: Option<usize>,
    /// Masses of the parts (SI, link axes).
    pub masses: PartMasses,
    /// Position of the elastic joint; a point is in the unit of the files.
    pub split: SplitChoice,
    /// Name of the link; `None`: that of the first file.
    pub name: Option<String>,
}

impl Default for ImportJob {
    fn default() -> Self {
        Self {
            files: Vec::new(),
            mass_file: None,
            format: ImportFormat::Auto,
            names: MatrixNames::default(),
            units: None,
            map: None,
            at: Vec::new(),
            axes_rpy: Vector3::zeros(),
            modes: None,
            masses: PartMasses::FromMatrix,
            split: SplitChoice::ElasticCentre,
            name: None,
        }
    }
}

impl ImportJob {
    /// Name of the link.
    pub fn link_name(&self) -> String {
        let from_file = || {
            let name = self.files.first().and_then(|path| path.file_name()).unwrap_or_default().to_string_lossy();
            let name = name.strip_suffix(".gz").unwrap_or(&name);
            name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned()
        };
        self.name.clone().unwrap_or_else(from_file)
    }
}

/// Reads matrices, makes a link of them and writes the files.
///
/// # Errors
/// [`LinkError`]; all missing data are listed in one error. See [`LinkError::fault`].
pub fn import(job: &ImportJob, outputs: Option<&ImportOutputs>) -> Result<ImportSummary, LinkError> {
    let stopwatch = Stopwatch::start();
    let name = job.link_name();
    let targets = outputs.map(|outputs| Targets::new(outputs, &name));
    if let Some(targets) = &targets {
        let inputs: Vec<&Path> = job.files.iter().chain(&job.mass_file).map(|path| &**path).collect();
        check_apart(&targets.all(), &inputs)?;
        check_free(&targets.all(), targets.overwrite)?;
    }
    // The first file shows the format: a modal body, or matrices.
    let first = job.files.first().ok_or_else(|| LinkError::Job("no file to import is given".into()))?;
    let head = InputFile::open(first).map_err(Box::new)?;
    let (reduction, parts) = if recognise(&head.bytes) == Some(MatrixFormat::Sid) {
        expect_format(job, MatrixFormat::Sid, &head.origin)?;
        sid::import(job, &head, &name)?
    } else {
        drop(head);
        matrices(job, &name)?
    };

    let mut summary = ImportSummary::new(&reduction, parts);
    summary.cost = CostFigures::since(&stopwatch);
    if let Some(targets) = targets {
        targets.write(&write_flex(&reduction.link), &mut summary)?;
    }
    Ok(summary)
}

fn expect_format(job: &ImportJob, found: MatrixFormat, origin: &str) -> Result<(), LinkError> {
    if job.format.covers(found) {
        return Ok(());
    }
    let what = format!(
        "is {} according to its content, but {} gives another format: omit it",
        found.name(),
        Setting::MatrixFormat
    );
    Err(LinkError::content(origin, what))
}

/// What an import needs beside the matrices, from the job or else from the files.
struct Layout {
    units: UnitSystem,
    map: ImportMap,
    placed: Vec<Placed>,
    /// Whether the matrices are those of a model that is not reduced yet.
    is_full: bool,
}

impl Layout {
    /// Collects the data; all missing ones are in one error.
    fn of(
        job: &ImportJob,
        imported: &ImportedMatrices,
        R_LM: &Rotation3<f64>,
        warnings: &mut Vec<String>,
    ) -> Result<Self, LinkError> {
        // The job goes before the sidecar.
        let sidecar = imported.sidecar.as_ref();
        let units = job.units.or(sidecar.map(|sidecar| sidecar.units));
        if let (Some(given), Some(sidecar)) = (job.units, sidecar)
            && given != sidecar.units
        {
            warnings.push(format!(
                "the units are {} in the sidecar and {given} from {Caller}; the latter are used",
                sidecar.units
            ));
        }
        let from_sidecar = || sidecar.map(|sidecar| ImportMap::Rows(sidecar.map()));
        let map = job.map.clone().or_else(from_sidecar).filter(|map| !map.entries().is_empty());
        let is_full =
            matches!(map, Some(ImportMap::Nodes(_))) || full::is_full(imported, map.as_ref().and_then(ImportMap::rows));

        // Requests for what is in neither, with the text to type.
        let mut faults = Vec::new();
        if units.is_none() {
            faults.push(file_error(imported, no_units()));
        }
        if map.is_none() {
            faults.push(file_error(imported, no_map(imported, is_full)));
        }
        let placed = map.as_ref().map(|map| place(job, imported, map, R_LM, warnings)).transpose();
        let placed = placed.unwrap_or_else(|fault| {
            faults.push(fault);
            None
        });
        if map.is_none() && imported.positions.is_empty() && imported.frames.is_empty() && job.at.is_empty() {
            let names = propose_map_of(&imported.stiffness).filter(|_| !is_full);
            let names = names.map_or_else(
                || vec!["A".into(), "B".into()],
                |map| map.interfaces.iter().map(|interface| interface.name.clone()).collect(),
            );
            faults.push(file_error(imported, no_place(imported, None, &names)));
        }
        match (units, map, placed) {
            (Some(units), Some(map), Some(placed)) if faults.is_empty() => Ok(Self { units, map, placed, is_full }),
            _ => Err(LinkError::of_all(faults)),
        }
    }

    /// Returns the link axes at each interface, in m.
    fn frames(&self) -> Vec<InterfaceFrame> {
        let frame = |p: &Placed| {
            let X_LI = Pose::from_parts(Translation3::from(p.xyz * self.units.length), p.rotation);
            InterfaceFrame { name: p.name.clone(), X_LI, tie: None }
        };
        self.placed.iter().map(frame).collect()
    }

    fn interfaces(&self) -> Vec<ImportInterface> {
        let interface = |(p, (_, rows)): (&Placed, (String, String))| ImportInterface {
            name: p.name.clone(),
            rows,
            position_m: (p.xyz * self.units.length).into(),
            rpy_rad: p.rotation.euler_angles().into(),
            from: p.from,
        };
        self.placed.iter().zip(self.map.entries()).map(interface).collect()
    }
}

/// Returns the request for the units.
fn no_units() -> String {
    format!(
        "the units of the file are not declared: {units} LENGTH-MASS-TIME, such as {units} m-kg-s (N, Pa) or {units} \
         mm-t-s (N, MPa); matrix files do not contain them",
        units = Setting::Units
    )
}

/// Returns the request for the rows of the interfaces, with those implied by the matrix itself.
fn no_map(imported: &ImportedMatrices, is_full: bool) -> String {
    let proposal = match propose_map_of(&imported.stiffness).filter(|_| !is_full) {
        Some(map) => {
            let rows = imported.stiffness.rows.len();
            let unnumbered = imported.stiffness.rows.iter().all(|label| label.node.is_none());
            let modal = match unnumbered && map.modal.is_empty() && map.interfaces.len() > 2 {
                true => {
                    format!(
                        ", or, if modes follow two interfaces, {} \"A=#1-6,B=#7-12,modal=#13-{rows}\"",
                        Setting::Map
                    )
                }
                false => String::new(),
            };
            format!("if the proximal interface comes first: {} \"{map}\"{modal}", Setting::Map)
        }
        None if is_full => full::propose(imported),
        None => format!("give {}, such as A=1001,B=1002 or A=#1-6,B=#7-12", Setting::Map),
    };
    format!("the rows of interfaces A and B are not specified: {proposal}")
}

/// Reduced matrices of a link.
struct Reduced {
    /// In matrix axes, with frames in link axes.
    element: Superelement,
    has_mass: bool,
    asymmetry: f64,
}

/// Reduces full matrices, or assembles reduced ones.
fn reduced(
    job: &ImportJob,
    imported: &ImportedMatrices,
    layout: &Layout,
    R_LM: &Rotation3<f64>,
    warnings: &mut Vec<String>,
) -> Result<Reduced, LinkError> {
    let (units, interfaces) = (layout.units, layout.frames());
    if layout.is_full {
        let modes = job.modes.unwrap_or(MODES);
        let target = full::Target { units, frames: interfaces, R_LM: R_LM.matrix(), modes };
        let element = full::reduce(imported, &layout.map, target)?;
        return Ok(Reduced { element, has_mass: true, asymmetry: imported.stiffness.asymmetry });
    }
    if job.modes.is_some() {
        let modes = Setting::Modes;
        warnings.push(format!("{modes} applies only to full models; these matrices are already reduced"));
    }
    // Matrices that are reduced already: rows of the interfaces, converted to SI.
    let reduced = assemble_interfaces(imported, layout.map.rows(), Some(&units)).map_err(Box::new)?;
    let (has_mass, n) = (reduced.M.is_some(), reduced.K.nrows());
    let M = reduced.M.unwrap_or_else(|| DMatrix::zeros(n, n));
    Ok(Reduced { element: Superelement { interfaces, K: reduced.K, M }, has_mass, asymmetry: reduced.asymmetry })
}

/// Imports all formats that have a stiffness over physical coordinates.
fn matrices(job: &ImportJob, name: &str) -> Result<(MatrixReduction, Parts), LinkError> {
    // Matrices over the interfaces, in link axes.
    let imported = read(job).map_err(Box::new)?;
    expect_format(job, imported.format, &imported.origin)?;
    let mut warnings = imported.warnings.clone();
    let R_LM = rotation(&job.axes_rpy);
    let layout = Layout::of(job, &imported, &R_LM, &mut warnings)?;
    let Reduced { element, has_mass, asymmetry } = reduced(job, &imported, &layout, &R_LM, &mut warnings)?;
    let element = turned(element, R_LM.matrix());
    let modes = element.modes();
    let method = match (layout.is_full, modes) {
        (true, 0) => "guyan".into(),
        (true, _) => format!("craig-bampton, {modes} modes"),
        (false, 0) => "reduced matrices".into(),
        (false, _) => format!("reduced matrices with {modes} modes"),
    };
    // The link of two parts, with what its summary says about the files.
    let plan = plan(job, name, layout.units, &imported.origin, &format!("{method}, {}", imported.format.name()));
    let checked = if has_mass { Some(element.clone()) } else { None };
    let reduction = link_from_superelement(element, has_mass, &plan).map_err(|source| {
        let path = imported.origin.clone().into();
        LinkError::Import { path, source: Box::new(source) }
    })?;
    let parts = Parts {
        files: job.files.iter().chain(&job.mass_file).map(|path| path.display().to_string()).collect(),
        format: imported.format.name().to_string(),
        units: layout.units.name(),
        method,
        rows: imported.stiffness.size(),
        interfaces: layout.interfaces(),
        asymmetry,
        element: checked,
        warnings,
    };
    Ok((reduction, parts))
}

fn plan(job: &ImportJob, name: &str, units: UnitSystem, source: &str, method: &str) -> MatrixPlan {
    MatrixPlan {
        name: name.to_owned(),
        masses: job.masses.clone(),
        split: job.split.at(units.length),
        limits: GateLimits::default(),
        provenance: Provenance {
            source: source.to_owned(),
            method: method.to_owned(),
            tie: String::new(),
            units: units.name(),
            date: stamp::today(),
            note: String::new(),
        },
    }
}

fn read(job: &ImportJob) -> Result<ImportedMatrices, flexarm_fe_io::FeFileError> {
    let Some(mass) = &job.mass_file else {
        let imported = read_matrices(&job.files, &job.names)?;
        // A sidecar found next to the stiffness names the mass file.
        let named = imported.sidecar.as_ref().filter(|_| imported.mass.is_none()).and_then(|s| s.mass.as_ref());
        let path = named.zip(job.files.first()).map(|(name, first)| first.with_file_name(name));
        let Some(path) = path.filter(|path| path.exists()) else { return Ok(imported) };
        let files: Vec<PathBuf> = job.files.iter().cloned().chain([path]).collect();
        return read_matrices(&files, &job.names);
    };
    let mut files = job.files.iter().map(InputFile::open).collect::<Result<Vec<_>, _>>()?;
    if let [only] = &mut files[..] {
        only.role = Some(MatrixRole::Stiffness);
    }
    files.push(InputFile::open(mass)?.with_role(MatrixRole::Mass));
    parse_matrices(&files, &job.names)
}

fn rotation(rpy: &Vector3<f64>) -> Rotation3<f64> {
    Rotation3::from_euler_angles(rpy.x, rpy.y, rpy.z)
}

fn file_error(imported: &ImportedMatrices, what: impl std::fmt::Display) -> LinkError {
    LinkError::content(&imported.origin, what)
}

/// Frame of an interface, in the unit of the file.
struct Placed {
    name: String,
    xyz: Vector3<f64>,
    rotation: Rotation3<f64>,
    from: &'static str,
}

/// Returns the frame of each interface, from the job or else from the file.
fn place(
    job: &ImportJob,
    imported: &ImportedMatrices,
    map: &ImportMap,
    R_LM: &Rotation3<f64>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Placed>, LinkError> {
    // Names of the job must be those of the map.
    let entries = map.entries();
    let names: Vec<String> = entries.iter().map(|(name, _)| name.clone()).collect();
    if names.len() < 2 {
        let what = format!("the map names {names:?}; a link needs two interfaces, the proximal one first");
        return Err(file_error(imported, what));
    }
    for (k, at) in job.at.iter().enumerate() {
        if !names.contains(&at.name) {
            let what = format!("{} names interface {:?}, the map has {names:?}", Setting::At, at.name);
            return Err(LinkError::Job(what));
        }
        if job.at[..k].iter().any(|other| other.name == at.name) {
            return Err(LinkError::Job(format!("{} {}=... is given twice", Setting::At, at.name)));
        }
    }
    // A frame of the job goes before that of the file, with a warning if they differ.
    let mut placed = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let found =
            in_file(imported, map, k).map_err(|error| file_error(imported, format!("interface {name}: {error}")))?;
        let found = found.map(|(X, from)| (R_LM * X.translation.vector, R_LM * X.rotation, from));
        let given = job.at.iter().find(|at| at.name == *name);
        let one = match (given, found) {
            (Some(at), found) => {
                if let Some((p, _, from)) = found
                    && (p - at.xyz).norm() > 1e-6 * p.norm().max(at.xyz.norm())
                {
                    let (p, q): ([f64; 3], [f64; 3]) = (p.into(), at.xyz.into());
                    warnings
                        .push(format!("interface {name}: {from} is {p:?}, {} gives {q:?}, which is used", Setting::At));
                }
                Placed { name: name.clone(), xyz: at.xyz, rotation: rotation(&at.rpy), from: "given" }
            }
            (None, Some((xyz, rotation, from))) => Placed { name: name.clone(), xyz, rotation, from },
            (None, None) => return Err(file_error(imported, no_place(imported, Some(map), &names))),
        };
        placed.push(one);
    }
    if (placed[0].xyz - placed[1].xyz).norm() == 0.0 {
        let [first, second] = [0, 1].map(|k| &names[k]);
        let what = format!("interfaces {first:?} and {second:?} are at the same point; a link needs a length");
        return Err(LinkError::Job(what));
    }
    Ok(placed)
}

/// Returns the frame of interface `k` according to the file: matrix axes, unit of the file.
fn in_file(
    imported: &ImportedMatrices,
    map: &ImportMap,
    k: usize,
) -> Result<Option<(Pose, &'static str)>, full::NoNodes> {
    let at = |p: Vector3<f64>| Pose::from_parts(Translation3::from(p), Rotation3::identity());
    let map = match map {
        ImportMap::Rows(map) => map,
        ImportMap::Nodes(list) => {
            let nodes = full::nodes_on(imported, &list[k].1)?;
            let points: Vec<_> = nodes.iter().filter_map(|node| imported.positions.get(node)).collect();
            let sum: Vector3<f64> = points.iter().copied().sum();
            return Ok((!points.is_empty()).then(|| (at(sum / points.len() as f64), "the centroid of its nodes")));
        }
    };
    // Sources in this order: sidecar, node of the interface, frames of the file.
    let interface = &map.interfaces[k];
    if let Some(side) = imported.sidecar.as_ref().and_then(|s| s.interfaces.iter().find(|i| i.interface == *interface))
    {
        return Ok(Some((side.frame, "its position in the sidecar")));
    }
    if let Some(RowPick::Node { node, .. }) = interface.picks.first()
        && let Some(p) = imported.positions.get(node)
    {
        return Ok(Some((at(*p), "the position of its node")));
    }
    Ok(imported.frames.get(k).map(|X| (*X, "its frame in the file")))
}

/// Returns the request for the interface positions, with those implied by the matrix itself.
fn no_place(imported: &ImportedMatrices, map: Option<&ImportMap>, names: &[String]) -> String {
    let proposed = match map {
        Some(ImportMap::Rows(map)) => Some(map.clone()),
        Some(ImportMap::Nodes(_)) => None,
        None => propose_map_of(&imported.stiffness),
    };
    // Evaluate from the first interface to each other one, swapped into second place.
    let implied = proposed.and_then(|map| {
        let to = |k: usize| {
            let mut map = map.clone();
            map.interfaces.swap(1, k);
            implied_distance(imported, &map)
        };
        (1..names.len().min(map.interfaces.len())).map(to).collect::<Option<Vec<_>>>()
    });
    let a = &names[0];
    let text = match implied {
        Some(places) if places.len() + 1 == names.len() => {
            let place = |(name, p): (&String, &Vector3<f64>)| {
                let [x, y, z] = <[f64; 3]>::from(*p).map(|x| if x.abs() < 1e-9 * p.norm() { 0.0 } else { x });
                (format!("{name} at ({x:.6}, {y:.6}, {z:.6})"), format!(" {} {name}={x:.6},{y:.6},{z:.6}", Setting::At))
            };
            let (where_they_are, flags): (Vec<String>, Vec<String>) = names[1..].iter().zip(&places).map(place).unzip();
            format!(
                "the stiffness implies, relative to {a}: {}; if {a} is the origin of the link: {} {a}=0,0,0{}",
                where_they_are.join(", "),
                Setting::At,
                flags.concat()
            )
        }
        _ => {
            let flags: Vec<String> = names.iter().map(|name| format!("{} {name}=x,y,z", Setting::At)).collect();
            format!("give {}", flags.join(" "))
        }
    };
    format!("the file does not contain the interface positions (unit of the file, link axes): {text}")
}

/// Returns the vector from A to B implied by the blocks of the stiffness, in the unit of the file.
fn implied_distance(imported: &ImportedMatrices, map: &InterfaceMap) -> Option<Vector3<f64>> {
    let reduced = assemble_interfaces(imported, Some(map), Some(&UnitSystem::SI)).ok()?;
    let M = DMatrix::zeros(reduced.K.nrows(), reduced.K.nrows());
    let frame = |name: &String| InterfaceFrame { name: name.clone(), X_LI: Pose::identity(), tie: None };
    let element = Superelement { interfaces: reduced.names.iter().map(frame).collect(), K: reduced.K, M };
    match check_matrix12(&stiffness12(&element)?, &Vector3::zeros(), &GateLimits::default()) {
        Err(FemError::MovesUnderRigidMotion { implied_p_AB, .. }) => implied_p_AB,
        _ => None,
    }
}

/// Paths of the results.
struct Targets {
    folder: Option<[PathBuf; 3]>,
    flex: Option<PathBuf>,
    overwrite: bool,
}

impl Targets {
    fn new(outputs: &ImportOutputs, link: &str) -> Self {
        let stem = file_stem(link);
        let in_folder = |f: &PathBuf| [f.join(format!("{stem}.flex")), f.join("summary.json"), f.join("report.md")];
        let folder = outputs.folder.as_ref().map(in_folder);
        Self { folder, flex: outputs.flex.clone(), overwrite: outputs.overwrite }
    }

    fn all(&self) -> Vec<PathBuf> {
        self.folder.iter().flatten().chain(&self.flex).cloned().collect()
    }

    fn write(&self, flex: &str, summary: &mut ImportSummary) -> Result<(), LinkError> {
        let text = |path: &PathBuf| Some(path.display().to_string());
        let link_file = self.flex.as_ref().or(self.folder.as_ref().map(|f| &f[0]));
        summary.files.flex = link_file.and_then(text);
        let mut contents = Vec::new();
        if let Some([link, figures, report]) = &self.folder {
            summary.files.summary = text(figures);
            summary.files.report = text(report);
            let json = serde_json::to_string_pretty(&summary).expect("plain numbers and strings") + "\n";
            contents.push((link.clone(), flex.to_owned()));
            contents.push((figures.clone(), json));
            contents.push((report.clone(), markdown(summary)));
        }
        contents.extend(self.flex.iter().map(|path| (path.clone(), flex.to_owned())));
        check_free(&self.all(), self.overwrite)?;
        write_all(&contents)?;
        // Set after writing: the files must not depend on their location.
        summary.files.entry = link_file.map(|flex| robot_entry(flex, &summary.link, None));
        Ok(())
    }
}
