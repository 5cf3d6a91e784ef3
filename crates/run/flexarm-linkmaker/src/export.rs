//! Export of a flexible link as matrices for other FE programs (`flexarm export`).
//!
//! Stiffness and mass of the interfaces, with modes where the link has them, are converted to the
//! requested units, written, read back by the same code as every import, and compared. A text file
//! states the order of the rows and the units, which most formats do not hold. For a link without
//! superelement only its static stiffness is written.
//!
//! Not here: the formats (`flexarm-fe-io`).

use std::path::PathBuf;
use std::time::Instant;

use flexarm_fe_io::exchange::{
    DofLabel, InputFile, Interface, InterfaceMap, MatrixNames, RowPick, Sidecar, SidecarInterface, assemble_interfaces,
    parse_matrices, write_matrix_market, write_sidecar, write_simscape, write_user_element,
};
use flexarm_fem::reduction::{InterfaceFrame, Superelement};
use flexarm_fem::{Pose, ReducedLink, UnitSystem, read_flex};
use flexarm_files::{check_apart, check_free, file_stem, write_all};
use flexarm_settings::{Setting, Words};
use nalgebra::{DMatrix, Translation3};
use serde::Serialize;

use crate::{LinkError, stamp};

/// Tolerance of writing and reading back, relative to `sqrt(k_ii k_jj)`.
const DIGITS: f64 = 1e-12;

/// Formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Matrix Market with a sidecar of units and frames.
    MatrixMarket,
    /// `*USER ELEMENT` of CalculiX and Abaqus.
    UserElement,
    /// Comma-separated values and a script for Simscape.
    Simscape,
}

impl Words for ExportFormat {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("matrix-market", Self::MatrixMarket, "With a .toml of units and frames"),
        ("user-element", Self::UserElement, "CalculiX, Abaqus"),
        ("simscape", Self::Simscape, "Comma-separated values and a script"),
    ];
}

/// Link to export, format and output folder.
#[derive(Clone, Debug)]
pub struct ExportJob {
    /// The link file.
    pub link: PathBuf,
    /// Format.
    pub format: ExportFormat,
    /// Units of the files.
    pub units: UnitSystem,
    /// Node numbers of the interfaces; if empty, 1001, 1002, ...
    pub nodes: Vec<i64>,
    /// Output folder; created if missing.
    pub folder: PathBuf,
    /// Whether to overwrite existing files.
    pub overwrite: bool,
}

/// Result of `flexarm export`; SI units, link axes.
#[derive(Clone, Debug, Serialize)]
pub struct ExportSummary {
    /// Name of the link.
    pub link: String,
    /// Format.
    pub format: &'static str,
    /// Units of the files.
    pub units: String,
    /// Number of rows of the matrices.
    pub rows: usize,
    /// Number of modal coordinates among the rows.
    pub modes: usize,
    /// Map with which `flexarm import` reads the files.
    pub map: String,
    /// Mass of the whole link.
    pub mass_kg: f64,
    /// Centre of mass.
    pub com_m: [f64; 3],
    /// Inertia about the centre of mass, 3×3 (kg m²).
    pub inertia: [[f64; 3]; 3],
    /// Stiffness at B with A held, 6×6.
    pub stiffness: [[f64; 6]; 6],
    /// Natural frequencies of the matrices with A held (Hz); empty without mass.
    pub frequencies_hz: Vec<f64>,
    /// Results of the checks.
    pub checks: ExportChecks,
    /// Wall-clock time (s).
    pub wall_s: f64,
    /// Peak memory of the process so far; null where the system does not report it.
    pub peak_rss_bytes: Option<u64>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Written files.
    pub files: Vec<String>,
}

/// Differences between the link and the files read back, and the checks of the link itself.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ExportChecks {
    /// Asymmetry of the stiffness from which the link was made.
    pub symmetry: f64,
    /// Residual force under rigid-body motion; null where the source was a 6×6 matrix.
    pub rigid_body_residual: Option<f64>,
    /// Maximum difference of the mass, relative to `sqrt(m_ii m_jj)`; null without mass.
    pub mass_error: Option<f64>,
    /// Maximum difference of the stiffness, relative to `sqrt(k_ii k_jj)`.
    pub stiffness_error: f64,
}

/// Writes a link in another format and reads it back.
///
/// # Errors
/// [`LinkError`]; see [`LinkError::fault`].
pub fn export(job: &ExportJob) -> Result<ExportSummary, LinkError> {
    let started = Instant::now();
    let link = read_flex(&job.link).map_err(Box::new)?;
    let mut warnings = Vec::new();
    let (element, has_mass) = element_of(&link, &mut warnings);
    let nodes = nodes(job, element.interfaces.len())?;
    let content = Content { job, link: &link, element: &element, has_mass, nodes: &nodes };
    let texts: Vec<(PathBuf, String)> =
        content.files().into_iter().map(|(name, text)| (job.folder.join(name), text)).collect();
    let paths: Vec<PathBuf> = texts.iter().map(|(path, _)| path.clone()).collect();
    check_apart(&paths, &[&job.link])?;
    check_free(&paths, job.overwrite)?;

    // Read the texts back with the code of every import before writing any file: data that cannot
    // be read leave no file.
    let is_readable = |path: &PathBuf| path.extension().is_none_or(|ending| ending != "txt" && ending != "m");
    let readable = texts.iter().filter(|(path, _)| is_readable(path));
    let readable: Vec<InputFile> =
        readable.map(|(path, text)| InputFile::new(path.display().to_string(), text.as_bytes())).collect();
    let imported = parse_matrices(&readable, &MatrixNames::default()).map_err(Box::new)?;
    let map = content.map();
    let back = assemble_interfaces(&imported, Some(&map), Some(&job.units)).map_err(Box::new)?;
    let stiffness_error = difference(&element.K, &back.K);
    let mass_error = back.M.as_ref().filter(|_| has_mass).map(|M| difference(&element.M, M));
    for (what, error) in [("stiffness", Some(stiffness_error)), ("mass", mass_error)] {
        if error.is_some_and(|error| error.is_nan() || error > DIGITS) {
            let error = error.unwrap_or(f64::NAN);
            warnings.push(format!("the exported {what}, read back, differs by {error:.1e} (relative to its diagonal)"));
        }
    }
    write_all(&texts)?;
    let whole = link.rigid();
    Ok(ExportSummary {
        link: link.name.clone(),
        format: job.format.word().unwrap_or_default(),
        units: job.units.name(),
        rows: element.K.nrows(),
        modes: element.modes(),
        map: map.to_string(),
        mass_kg: whole.mass,
        com_m: whole.com.into(),
        inertia: whole.inertia.transpose().into(),
        stiffness: link.K_BB.transpose().into(),
        frequencies_hz: if has_mass { element.frequencies_hz(&[0]).into_iter().take(10).collect() } else { Vec::new() },
        checks: ExportChecks {
            symmetry: link.checks.asymmetry,
            rigid_body_residual: link.checks.rigid_body_residual,
            mass_error,
            stiffness_error,
        },
        wall_s: started.elapsed().as_secs_f64(),
        peak_rss_bytes: stamp::peak_rss_bytes(),
        warnings,
        files: paths.iter().map(|path| path.display().to_string()).collect(),
    })
}

/// Returns the superelement of the link, or its static stiffness with zero mass; also whether it
/// has mass.
fn element_of(link: &ReducedLink, warnings: &mut Vec<String>) -> (Superelement, bool) {
    if let Some(element) = link.details.as_ref().and_then(|details| details.superelement.clone()) {
        return (element, true);
    }
    warnings.push(
        "the link has no superelement: only its static stiffness is written, without mass and modes; the mass of \
         its two rigid parts is in the accompanying text file"
            .into(),
    );
    let frame = |name: &str, X_LI| InterfaceFrame { name: name.into(), X_LI, tie: None };
    let K = DMatrix::from_column_slice(12, 12, link.matrix12().as_slice());
    let interfaces = vec![frame("A", link.X_LA), frame("B", link.X_LB)];
    (Superelement { interfaces, K, M: DMatrix::zeros(12, 12) }, false)
}

fn nodes(job: &ExportJob, interfaces: usize) -> Result<Vec<i64>, LinkError> {
    if job.nodes.is_empty() {
        return Ok((1001..1001 + interfaces as i64).collect());
    }
    let distinct = job.nodes.iter().collect::<std::collections::BTreeSet<_>>().len() == job.nodes.len();
    if job.nodes.len() != interfaces || !distinct || job.nodes.iter().any(|node| !(1..=99_999_999).contains(node)) {
        return Err(LinkError::Job(format!(
            "{} has {:?}; {interfaces} distinct numbers between 1 and 99999999 are required, one per interface, \
             proximal first",
            Setting::Nodes,
            job.nodes
        )));
    }
    Ok(job.nodes.clone())
}

/// Maximum difference, relative to the diagonal.
fn difference(A: &DMatrix<f64>, B: &DMatrix<f64>) -> f64 {
    if A.shape() != B.shape() {
        return f64::INFINITY;
    }
    let scale = A.diagonal().map(|a| a.abs().sqrt());
    let place = |(i, j): (usize, usize)| (A[(i, j)] - B[(i, j)]).abs() / (scale[i] * scale[j]).max(f64::MIN_POSITIVE);
    let all = (0..A.nrows()).flat_map(|i| (0..=i).map(move |j| (i, j)));
    all.map(place).fold(0.0, f64::max)
}

/// Data of the exported files.
struct Content<'a> {
    job: &'a ExportJob,
    link: &'a ReducedLink,
    element: &'a Superelement,
    has_mass: bool,
    nodes: &'a [i64],
}

impl Content<'_> {
    /// Whether rows have node numbers.
    fn is_labelled(&self) -> bool {
        self.job.format == ExportFormat::UserElement
    }

    fn map(&self) -> InterfaceMap {
        let pick = |k: usize| match self.is_labelled() {
            true => RowPick::Node { node: self.nodes[k], first: 1, last: 6 },
            false => RowPick::Rows { first: 6 * k + 1, last: 6 * k + 6 },
        };
        let names = self.element.interfaces.iter().enumerate();
        let interfaces = names.map(|(k, i)| Interface { name: i.name.clone(), picks: vec![pick(k)] }).collect();
        InterfaceMap { interfaces, modal: Vec::new() }
    }

    /// Returns the matrices in the units of the files; inverse of `assemble_interfaces`.
    fn matrices(&self) -> (DMatrix<f64>, Option<DMatrix<f64>>) {
        let units = &self.job.units;
        let boundary = self.element.boundary(); // rows of the interfaces; modes follow
        // Unit of each coordinate: u_SI = diag(d) u_file.
        let d: Vec<f64> = (0..self.element.K.nrows())
            .map(|i| match i {
                i if i >= boundary => units.mass.sqrt() * units.length,
                i if i % 6 < 3 => units.length,
                _ => 1.0,
            })
            .collect();
        // K_file = diag(d) K diag(d) / energy, and M likewise with the unit of inertia.
        let energy = units.force() * units.length;
        let inertia = units.mass * units.length * units.length;
        let convert =
            |A: &DMatrix<f64>, unit: f64| DMatrix::from_fn(d.len(), d.len(), |i, j| A[(i, j)] * (d[i] * d[j] / unit));
        (convert(&self.element.K, energy), self.has_mass.then(|| convert(&self.element.M, inertia)))
    }

    fn frames(&self) -> Vec<Pose> {
        let scaled =
            |X: &Pose| Pose::from_parts(Translation3::from(X.translation.vector / self.job.units.length), X.rotation);
        self.element.interfaces.iter().map(|interface| scaled(&interface.X_LI)).collect()
    }

    fn rows(&self) -> Vec<DofLabel> {
        let physical = self.nodes.iter().flat_map(|node| (1..=6).map(|dof| DofLabel::new(*node, dof)));
        let next = self.nodes.iter().max().copied().unwrap_or(0) + 1000;
        physical.chain((0..self.element.modes() as i64).map(|k| DofLabel::new(next + k, 0))).collect()
    }

    /// Returns the names and texts of the files.
    fn files(&self) -> Vec<(String, String)> {
        // Matrices in the units of the files, with their rows and units in words.
        let stem = file_stem(&self.link.name);
        let (K, M) = self.matrices();
        let said = format!("{}: {}; rows {}", self.link.name, self.job.units, self.row_order());
        let mut files = match self.job.format {
            ExportFormat::MatrixMarket => {
                let (k, m) = (format!("{stem}_K.mtx"), format!("{stem}_M.mtx"));
                let interfaces = self.map().interfaces.into_iter().zip(self.frames());
                let sidecar = Sidecar {
                    stiffness: k.clone(),
                    mass: M.as_ref().map(|_| m.clone()),
                    units: self.job.units,
                    interfaces: interfaces.map(|(interface, frame)| SidecarInterface { interface, frame }).collect(),
                };
                let mut files = vec![(k, write_matrix_market(&K, &["stiffness", &said]))];
                files.extend(M.map(|M| (m, write_matrix_market(&M, &["mass", &said]))));
                files.push((format!("{stem}.toml"), write_sidecar(&sidecar)));
                files
            }
            ExportFormat::UserElement => {
                vec![(format!("{stem}.mtx"), write_user_element(&K, M.as_ref(), &self.rows()))]
            }
            ExportFormat::Simscape => {
                let zero = DMatrix::zeros(K.nrows(), K.nrows());
                let simscape = write_simscape(&stem, &K, M.as_ref().unwrap_or(&zero), &self.frames());
                let mut files = vec![
                    (format!("{stem}_K.csv"), simscape.stiffness),
                    (format!("{stem}_frames.csv"), simscape.frames),
                    (format!("{stem}_load.m"), simscape.script),
                ];
                if self.has_mass {
                    files.push((format!("{stem}_M.csv"), simscape.mass));
                }
                files
            }
        };
        files.push((format!("{stem}_README.txt"), self.readme()));
        files
    }

    fn row_order(&self) -> String {
        let names: Vec<String> = self.element.interfaces.iter().map(|i| i.name.clone()).collect();
        let modes = match self.element.modes() {
            0 => String::new(),
            n => format!(", then {n} mass-normalised fixed-interface modes"),
        };
        format!("ux uy uz rx ry rz of interface {}{modes}", names.join(", then "))
    }

    /// Returns the text with rows, axes, units and interfaces, which the format does not hold.
    fn readme(&self) -> String {
        let units = &self.job.units;
        let mut text = format!(
            "Link {}, written by flexarm export as {}\n\nrows: {}\naxes: parallel to the link frame at every \
             interface\nunits: {units} (length-mass-time; derived unit of force = {} N); angles in rad\n\nmap for \
             flexarm import: {} \"{}\" {} {units}\n\ninterfaces (position in the unit of length, link axes):\n",
            self.link.name,
            self.job.format.word().unwrap_or_default(),
            self.row_order(),
            units.force(),
            Setting::Map,
            self.map(),
            Setting::Units
        );
        for ((interface, X), node) in self.element.interfaces.iter().zip(self.frames()).zip(self.nodes) {
            let p = X.translation.vector;
            let node = if self.is_labelled() { format!(", node {node}") } else { String::new() };
            let (name, at) = (&interface.name, Setting::At);
            text += &format!("  {name}{node}: {at} {name}={},{},{}\n", p.x, p.y, p.z);
        }
        text += &part_lines(self.link);
        text
    }
}

/// Returns the rigid parts in the notation of `flexarm import`.
fn part_lines(link: &ReducedLink) -> String {
    let mut text =
        String::from("\nrigid parts (kg; m; kg m2: ixx,iyy,izz,ixy,ixz,iyz about the centre of mass, link axes):\n");
    for (setting, part) in [(Setting::PartA, &link.proximal), (Setting::PartB, &link.distal)] {
        let (c, I) = (part.com, part.inertia);
        text += &format!(
            "  {setting} \"{};{},{},{};{},{},{},{},{},{}\"\n",
            part.mass,
            c.x,
            c.y,
            c.z,
            I[(0, 0)],
            I[(1, 1)],
            I[(2, 2)],
            I[(0, 1)],
            I[(0, 2)],
            I[(1, 2)]
        );
    }
    text
}
