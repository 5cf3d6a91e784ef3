//! Reads files into [`ImportedMatrices`]: recognises and parses each file, then selects stiffness
//! and mass.
//!
//! Start at [`read_matrices`], which also finds the files that belong together, or at
//! [`parse_matrices`] for bytes. Numbers remain in the units of the files.
//! Not here: the formats (a module each), interfaces and units ([`super::assemble`]).

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use flexarm_fem::input::read_file;
use flexarm_spatial::Pose;
use nalgebra::Vector3;

use super::matrix::{DofLabel, LabelledMatrix, MatrixRole, Storage, reordered};
use super::position::ErrorPosition;
use super::recognise::{MatrixFormat, is_hdf5, recognise};
use super::sidecar::Sidecar;
use super::text::{LARGEST_UNPACKED, Text};
use super::{abaqus_text, dmig, harwell_boeing, matrix_market, op4_binary, op4_text, sidecar, simscape, user_element};
use crate::FeFileError;
use crate::unpack::plain;

/// Names of the matrices to select in files with several (DMIG, OP4); `None`: by the letters K and
/// M.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MatrixNames {
    /// Name of the stiffness, such as `KAAX`.
    pub stiffness: Option<String>,
    /// Name of the mass, such as `MAAX`.
    pub mass: Option<String>,
}

/// Data of one structure from one or several files, in the units of the files.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedMatrices {
    /// Format of the file with the stiffness.
    pub format: MatrixFormat,
    /// Source of the data, for messages.
    pub origin: String,
    /// Stiffness matrix.
    pub stiffness: LabelledMatrix,
    /// Mass matrix, with the same order of rows.
    pub mass: Option<LabelledMatrix>,
    /// Positions of nodes, if the format has them.
    pub positions: BTreeMap<i64, Vector3<f64>>,
    /// Frames of the interfaces in the order of the rows, if the format has them.
    pub frames: Vec<Pose>,
    /// Units, interfaces and frames from the sidecar of Matrix Market files.
    pub sidecar: Option<Sidecar>,
    /// Warnings about accepted but suspicious input.
    pub warnings: Vec<String>,
}

/// File in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Path, or name in messages.
    pub origin: String,
    /// Contents, optionally compressed with gzip.
    pub bytes: Vec<u8>,
    /// Role of its matrix; `None`: by contents or file name.
    pub role: Option<MatrixRole>,
}

impl InputFile {
    /// Creates a file without a given role.
    pub fn new(origin: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { origin: origin.into(), bytes: bytes.into(), role: None }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, FeFileError> {
        let origin = path.as_ref().display().to_string();
        let refuse =
            |error: std::io::Error| ErrorPosition::file(&origin).fail("file", error.to_string(), "a readable file", "");
        let bytes = read_file(path.as_ref(), LARGEST_UNPACKED).map_err(refuse)?;
        Ok(Self { origin, bytes, role: None })
    }

    /// Sets the role.
    pub fn with_role(self, role: MatrixRole) -> Self {
        Self { role: Some(role), ..self }
    }
}

/// Matrix that may be the stiffness or the mass.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) format: MatrixFormat,
    pub(super) origin: String,
    pub(super) role: Option<MatrixRole>,
    pub(super) matrix: LabelledMatrix,
}

/// Combined contents of all files.
#[derive(Debug, Default)]
struct CombinedFiles {
    candidates: Vec<Candidate>,
    labels: Option<(String, Vec<DofLabel>)>,
    positions: BTreeMap<i64, Vector3<f64>>,
    frames: Vec<Pose>,
    sidecar: Option<Sidecar>,
    warnings: Vec<String>,
}

/// Reads files of one structure, such as `job.sti`, `job.mas`, `job.dof`.
///
/// Files that belong to a given one are read even if they are not given: `.mas` and `.dof` of a
/// `.sti`, the `.mapping` of a Harwell-Boeing file, the sidecar `.toml` of Matrix Market files and
/// the matrices named in a sidecar. A sidecar next to a single given file also counts if it names
/// that file. Next to a single file that is named as a stiffness (`arm_K.mtx`, `STIF1`,
/// `stiffness`) or as a mass, the other matrix is found by name, with a warning.
///
/// # Errors
/// [`FeFileError`] with file, line, element, value found and value expected.
pub fn read_matrices<P: AsRef<Path>>(paths: &[P], names: &MatrixNames) -> Result<ImportedMatrices, FeFileError> {
    let mut files = paths.iter().map(InputFile::open).collect::<Result<Vec<_>, _>>()?;
    companions(&mut files)?;
    let other = other_matrix(&files)?;
    files.extend(other.clone());
    let mut imported = parse_matrices(&files, names)?;
    if let Some(InputFile { origin, role: Some(role), .. }) = &other {
        imported
            .warnings
            .push(format!("{origin}, found beside the file that was given, is taken as its {}", role.name()));
    }
    Ok(imported)
}

/// Finds the mass that belongs to a single stiffness, or vice versa, by its name.
fn other_matrix(files: &[InputFile]) -> Result<Option<InputFile>, FeFileError> {
    let is_matrix = |format| {
        matches!(
            format,
            MatrixFormat::MatrixMarket
                | MatrixFormat::LabelledText
                | MatrixFormat::CoordinateText
                | MatrixFormat::HarwellBoeing
                | MatrixFormat::Csv
        )
    };
    // A single file of a format that has one matrix per file.
    let format = |file: &InputFile| recognise(&file.bytes).filter(|format| is_matrix(*format));
    let mut matrices = files.iter().filter(|file| format(file).is_some());
    let (Some(only), None) = (matrices.next(), matrices.next()) else { return Ok(None) };
    let Some(role) = only.role.or_else(|| role_by_name(&only.origin)) else { return Ok(None) };
    // Usual names of the other matrix, in the same folder and format.
    let path = Path::new(&only.origin);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    for other in other_names(&name, role) {
        let place = path.with_file_name(&other);
        if !place.is_file() {
            continue;
        }
        let file = InputFile::open(&place)?;
        if format(&file) == format(only) {
            let role = if role == MatrixRole::Stiffness { MatrixRole::Mass } else { MatrixRole::Stiffness };
            return Ok(Some(file.with_role(role)));
        }
    }
    Ok(None)
}

/// Possible names of the other matrix: the last word for one role is replaced by that of the other.
pub fn other_names(name: &str, role: MatrixRole) -> Vec<String> {
    const WORDS: [(&str, &str); 9] = [
        ("stiffness", "mass"),
        ("Stiffness", "Mass"),
        ("STIFFNESS", "MASS"),
        ("stiff", "mass"),
        ("STIFF", "MASS"),
        ("stif", "mass"),
        ("STIF", "MASS"),
        ("k", "m"),
        ("K", "M"),
    ];
    let mut names = Vec::new();
    for (stiffness, mass) in WORDS {
        let (from, to) = if role == MatrixRole::Stiffness { (stiffness, mass) } else { (mass, stiffness) };
        // Whole words only, without adjacent letters.
        let is_word = |at: usize| {
            let letter = |c: Option<char>| c.is_some_and(char::is_alphabetic);
            !letter(name[..at].chars().next_back()) && !letter(name[at + from.len()..].chars().next())
        };
        if let Some((at, _)) = name.rmatch_indices(from).find(|(at, _)| is_word(*at)) {
            names.push(format!("{}{to}{}", &name[..at], &name[at + from.len()..]));
        }
    }
    names
}

/// Adds files in the same folder that belong to the given ones.
fn companions(files: &mut Vec<InputFile>) -> Result<(), FeFileError> {
    // Compare canonical paths, since a file may have several paths.
    let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let given = files.len();
    let mut known: Vec<PathBuf> = files.iter().map(|file| real(Path::new(&file.origin))).collect();
    let mut next = 0;
    while let Some(file) = files.get(next) {
        let mut wanted = wanted_by(file)?;
        wanted.retain(|(path, _)| path.exists());
        let is_given = |path: &Path| known[..given].contains(&real(path));
        // A sidecar found this way is used for the matrices only if it names the single given file:
        // other files may be meant to replace those that it names.
        if next >= given && !(given == 1 && wanted.iter().any(|(path, _)| is_given(path))) {
            wanted.clear();
        }
        for (path, role) in wanted {
            let place = known.iter().position(|known| *known == real(&path));
            let place = match place {
                Some(place) => place,
                None => {
                    files.push(InputFile::open(&path)?);
                    known.push(real(&path));
                    files.len() - 1
                }
            };
            files[place].role = files[place].role.or(role);
        }
        next += 1;
    }
    Ok(())
}

/// Paths of the files that may belong to a file, with their roles according to a sidecar.
fn wanted_by(file: &InputFile) -> Result<Vec<(PathBuf, Option<MatrixRole>)>, FeFileError> {
    let path = Path::new(&file.origin);
    let folder = path.parent().unwrap_or(Path::new(""));
    let full = path.file_name().unwrap_or_default().to_string_lossy();
    let name = full.strip_suffix(".gz").unwrap_or(&full);
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    let beside = |name: &str| {
        let plain = folder.join(name);
        if plain.exists() { plain } else { folder.join(format!("{name}.gz")) }
    };
    // Files with what the format lacks: labels of rows, the mass, units and interfaces.
    let mut wanted = Vec::new();
    match recognise(&file.bytes) {
        Some(MatrixFormat::CoordinateText) if ending == "sti" => {
            wanted.extend(["mas", "dof"].map(|ending| (beside(&format!("{stem}.{ending}")), None)));
        }
        Some(MatrixFormat::HarwellBoeing) => wanted.push((folder.join(format!("{stem}.mapping")), None)),
        Some(MatrixFormat::MatrixMarket) => {
            let shorter = stem.rsplit_once('_').map_or(stem, |(head, _)| head);
            let sidecars = [stem, shorter].map(|stem| folder.join(format!("{stem}.toml")));
            let is_ours = |path: &PathBuf| {
                read_file(path, LARGEST_UNPACKED).is_ok_and(|bytes| recognise(&bytes) == Some(MatrixFormat::Sidecar))
            };
            wanted.extend(sidecars.into_iter().find(is_ours).map(|path| (path, None)));
        }
        Some(MatrixFormat::Sidecar) => {
            let sidecar = sidecar::parse(Text::new(&String::from_utf8_lossy(&file.bytes), &file.origin))?;
            wanted.push((beside(&sidecar.stiffness), Some(MatrixRole::Stiffness)));
            wanted.extend(sidecar.mass.map(|mass| (beside(&mass), Some(MatrixRole::Mass))));
        }
        _ => {}
    }
    Ok(wanted)
}

/// Parses files of one structure from memory. Never panics.
///
/// # Errors
/// As [`read_matrices`].
pub fn parse_matrices(files: &[InputFile], names: &MatrixNames) -> Result<ImportedMatrices, FeFileError> {
    let mut found = CombinedFiles::default();
    for file in files {
        parse_file(file, &mut found)?;
    }
    let origin = files.first().map_or("no files", |file| file.origin.as_str());
    choose(found, names, origin)
}

/// Parses a file by its format, and adds what it has to `found`.
fn parse_file(file: &InputFile, found: &mut CombinedFiles) -> Result<(), FeFileError> {
    let origin = file.origin.as_str();
    let Some(format) = recognise(&file.bytes) else {
        let (found, help) = if is_hdf5(&file.bytes) {
            let help = "HDF5 is not read: save the matrices as Matrix Market (in Python: \
                        scipy.io.mmwrite(\"arm_K.mtx\", K), arm_M.mtx likewise), or as DMIG with GRID entries, which have \
                        the positions of the nodes";
            ("HDF5", help)
        } else {
            let help = ".mtx of Adams and Altair, .mnf, .sub, .h3d and .npz cannot be read: export text, such as DMIG \
                        or Matrix Market";
            ("an unknown format", help)
        };
        let expected = "Matrix Market, CalculiX or Abaqus matrices, DMIG, OP4, Harwell-Boeing, CSV";
        let place = ErrorPosition::file(origin);
        return Err(place.fail("file", found, expected, help));
    };
    let bytes = plain(&file.bytes, origin, LARGEST_UNPACKED)?;
    let mut matrices = parse_format(format, &bytes, file, found)?;
    // A role given by the user takes precedence; if the file has several matrices, those with that
    // role are kept.
    match (&mut matrices[..], file.role) {
        ([(role, _)], Some(said)) => *role = Some(said),
        (several, Some(said)) => several.iter_mut().for_each(|(role, _)| *role = role.filter(|role| *role == said)),
        (_, None) => {}
    }
    let candidate = |(role, matrix)| Candidate { format, origin: origin.into(), role, matrix };
    found.candidates.extend(matrices.into_iter().map(candidate));
    Ok(())
}

/// A matrix with its role, if that is known.
type MatrixWithRole = (Option<MatrixRole>, LabelledMatrix);

/// Returns the matrices of a file with their roles, as far as known; keeps other data in `found`.
fn parse_format(
    format: MatrixFormat,
    bytes: &[u8],
    file: &InputFile,
    found: &mut CombinedFiles,
) -> Result<Vec<MatrixWithRole>, FeFileError> {
    let origin = file.origin.as_str();
    let lossy = String::from_utf8_lossy(if format == MatrixFormat::Op4Binary { b"" } else { bytes });
    let text = Text::new(&lossy, origin);
    let by_file = file.role.or_else(|| role_by_name(origin));
    let one = |matrix| vec![(by_file, matrix)];
    let several = |list: Vec<LabelledMatrix>| list.into_iter().map(|m| (role_by_letter(&m.name), m)).collect();

    Ok(match format {
        // Matrices; data of the whole file, such as labels and positions, go to `found`.
        MatrixFormat::MatrixMarket => one(matrix_market::parse(text)?),
        MatrixFormat::UserElement => user_element::parse(text)?.into_iter().map(|(role, m)| (Some(role), m)).collect(),
        MatrixFormat::LabelledText => {
            let (matrix, warning) = abaqus_text::parse_labelled(text)?;
            found.warnings.extend(warning.map(|warning| format!("{origin}: {warning}")));
            one(matrix)
        }
        MatrixFormat::CoordinateText => one(abaqus_text::parse_coordinate(text, storage_by_name(origin))?),
        // Files without a matrix.
        MatrixFormat::DofList => {
            found.labels = Some((origin.into(), abaqus_text::parse_dof_list(text)?));
            Vec::new()
        }
        MatrixFormat::EquationMapping => {
            found.labels = Some((origin.into(), abaqus_text::parse_equation_mapping(text)?));
            Vec::new()
        }
        MatrixFormat::Dmig => {
            let dmig = dmig::parse(text)?;
            found.positions.extend(dmig.positions);
            found.warnings.extend(dmig.warnings.into_iter().map(|warning| format!("{origin}: {warning}")));
            several(dmig.matrices)
        }
        MatrixFormat::Op4Text => several(op4_text::parse(text)?),
        MatrixFormat::Op4Binary => several(op4_binary::parse(bytes, origin)?),
        MatrixFormat::HarwellBoeing => one(harwell_boeing::parse(text)?),
        MatrixFormat::Csv => one(simscape::parse_matrix(text)?),
        MatrixFormat::CsvFrames => {
            found.frames = simscape::parse_frames(text)?;
            Vec::new()
        }
        MatrixFormat::Sidecar => {
            found.sidecar = Some(sidecar::parse(text)?);
            Vec::new()
        }
        MatrixFormat::Sid => {
            let (found, expected) = ("a modal body (SID)", "stiffness and mass of interfaces");
            return Err(ErrorPosition::file(origin).fail("file", found, expected, "read it with parse_sid"));
        }
    })
}

/// Full models (`.sti`, `.mas`) are stored sparse, other files by size.
fn storage_by_name(origin: &str) -> Storage {
    let name = origin.strip_suffix(".gz").unwrap_or(origin);
    if name.ends_with(".sti") || name.ends_with(".mas") { Storage::Sparse } else { Storage::BySize }
}

/// Role by the extension (`.sti`, `.mas`) or the last word of the name: `arm_K.mtx`,
/// `job_MASS1.mtx`.
fn role_by_name(origin: &str) -> Option<MatrixRole> {
    let name = origin.rsplit(['/', '\\']).next()?.to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    match ending {
        "sti" => return Some(MatrixRole::Stiffness),
        "mas" => return Some(MatrixRole::Mass),
        _ => {}
    }
    let word = stem.rsplit(['_', '-', '.', ' ']).next()?;
    let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
    match letters {
        "k" | "stif" | "stiff" | "stiffness" => Some(MatrixRole::Stiffness),
        "m" | "mass" => Some(MatrixRole::Mass),
        _ => None,
    }
}

/// Role by the first letter of Nastran names: `KAAX`, `K2GG`, `MAAX`; `K4...` is structural
/// damping.
fn role_by_letter(name: &str) -> Option<MatrixRole> {
    match name.bytes().next()?.to_ascii_uppercase() {
        b'K' if !name.starts_with("K4") => Some(MatrixRole::Stiffness),
        b'M' => Some(MatrixRole::Mass),
        _ => None,
    }
}

/// Selects stiffness and mass and gives them the same rows.
fn choose(mut found: CombinedFiles, names: &MatrixNames, origin: &str) -> Result<ImportedMatrices, FeFileError> {
    for (name, role) in [(&names.stiffness, MatrixRole::Stiffness), (&names.mass, MatrixRole::Mass)] {
        let Some(name) = name else { continue };
        let is_named = |candidate: &Candidate| candidate.matrix.name.eq_ignore_ascii_case(name);
        if !found.candidates.iter().any(is_named) {
            let (found, expected) = (format!("{name:?}"), format!("one of {}", list(&found.candidates)));
            let element = format!("name of the {}", role.name());
            return Err(ErrorPosition::file(origin).fail(element, found, expected, ""));
        }
        for candidate in &mut found.candidates {
            if is_named(candidate) {
                candidate.role = Some(role);
            } else if candidate.role == Some(role) {
                candidate.role = None;
            }
        }
    }
    // A single matrix without a role is the stiffness.
    if let [only] = &mut found.candidates[..] {
        only.role = only.role.or(Some(MatrixRole::Stiffness));
    }
    let all = list(&found.candidates);
    let mut take = |role: MatrixRole| -> Result<Option<Candidate>, FeFileError> {
        let fits = |candidate: &&Candidate| candidate.role == Some(role);
        if found.candidates.iter().filter(fits).count() > 1 {
            let help = format!("name the {}, or give its file alone", role.name());
            return Err(ErrorPosition::file(origin).fail(role.name(), all.clone(), "one matrix", help));
        }
        let place = found.candidates.iter().position(|candidate| candidate.role == Some(role));
        Ok(place.map(|i| found.candidates.swap_remove(i)))
    };
    let (stiffness, mass) = (take(MatrixRole::Stiffness)?, take(MatrixRole::Mass)?);
    let Some(stiffness) = stiffness else {
        let help = "say which matrix is the stiffness";
        let nothing = if all.is_empty() { "no matrix".to_owned() } else { all };
        return Err(ErrorPosition::file(origin).fail("stiffness", nothing, "a stiffness", help));
    };

    // Labels from a separate file, then the same order of rows.
    let Candidate { format, origin, matrix: mut K, .. } = stiffness;
    let mut M = mass.map(|mass| mass.matrix);
    if let Some((from, labels)) = found.labels {
        for matrix in [Some(&mut K), M.as_mut()].into_iter().flatten().filter(|matrix| !matrix.is_labelled()) {
            apply_labels(matrix, &labels, &from)?;
        }
    }
    if let Some(mass) = &M {
        let (aligned_K, aligned_M) = aligned(&K, mass, &origin)?;
        (K, M) = (aligned_K, Some(aligned_M));
    }
    let CombinedFiles { positions, frames, sidecar, warnings, .. } = found;
    Ok(ImportedMatrices { format, origin, stiffness: K, mass: M, positions, frames, sidecar, warnings })
}

fn list(candidates: &[Candidate]) -> String {
    let text = |c: &Candidate| format!("{} ({}, {} rows)", c.matrix.name, c.origin, c.matrix.size());
    candidates.iter().map(text).collect::<Vec<_>>().join(", ")
}

fn apply_labels(matrix: &mut LabelledMatrix, labels: &[DofLabel], from: &str) -> Result<(), FeFileError> {
    if labels.len() != matrix.size() {
        let (found, expected) = (format!("{} rows", labels.len()), format!("{}, as the matrix has", matrix.size()));
        let help = "do the files belong to the same calculation?";
        return Err(ErrorPosition::file(from).fail("list of rows", found, expected, help));
    }
    matrix.rows = labels.to_vec();
    Ok(())
}

/// Brings both matrices to the same rows; a file may omit rows without mass or without stiffness.
fn aligned(
    K: &LabelledMatrix,
    M: &LabelledMatrix,
    origin: &str,
) -> Result<(LabelledMatrix, LabelledMatrix), FeFileError> {
    if K.rows == M.rows {
        return Ok((K.clone(), M.clone()));
    }
    let refuse = || {
        let found = format!("{} rows of stiffness, {} rows of mass", K.size(), M.size());
        let help = "do the files belong to the same calculation?";
        ErrorPosition::file(origin).fail("rows", found, "the same rows", help)
    };
    let unique = |matrix: &LabelledMatrix| {
        matrix.is_labelled() && matrix.rows.iter().collect::<HashSet<_>>().len() == matrix.size()
    };
    if !unique(K) || !unique(M) {
        return Err(refuse());
    }
    // Rows of the stiffness, then those that only the mass has.
    let in_K: HashSet<&DofLabel> = K.rows.iter().collect();
    let only_M = M.rows.iter().filter(|label| !in_K.contains(label));
    let rows: Vec<DofLabel> = K.rows.iter().chain(only_M).copied().collect();
    match (reordered(K, &rows), reordered(M, &rows)) {
        (Some(K), Some(M)) => Ok((K, M)),
        _ => Err(refuse()),
    }
}
