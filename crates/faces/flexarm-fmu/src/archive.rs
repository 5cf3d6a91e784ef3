//! The file of an FMU: robot and reduced links as resources, description, library.
//!
//! The robot in the resources is complete: its URDF is expanded, and no path leads out of the
//! folder. Meshes are left out unless masses are computed from them. The arm that is made from the
//! resources is compared with the original one before the FMU is written.

use std::fs;
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::caveat::{Finding, Use, warnings};
use flexarm::errors::FileError;
use flexarm::links::reduce::STRESS_FILE;
use flexarm::robots::{InertiaEstimate, ReadOptions};
use flexarm::settings::Words;
use flexarm::steppers::{StepperEntry, StepperOptions};
use flexarm::{Arm, DriveModel, LinkModel, LoadOptions, Modelling, Robot, RobotSource};
use serde::{Deserialize, Serialize};
use toml_edit::{DocumentMut, Item};
use twox_hash::XxHash64;
use zip::write::SimpleFileOptions;

use crate::description::{About, Fmi, MODEL_IDENTIFIER, description, page};
use crate::error::FmuError;
use crate::model::{FmuModel, FmuSettings, first_pose};
use crate::variables::Causality;

/// File with the settings of the plant in the resources.
const SETTINGS: &str = "plant.json";
/// Robot file in the resources.
const ROBOT: &str = "robot.toml";
/// Description of the robot in the resources.
const URDF: &str = "robot.urdf";

/// Settings of a plant as filed in the resources.
#[derive(Debug, Serialize, Deserialize)]
struct Filed {
    /// Version of this file.
    format: u32,
    token: String,
    links: Option<String>,
    drives: Option<String>,
    segments: Option<usize>,
    modes: Option<usize>,
    stepper: String,
    step_s: f64,
    pose: Vec<f64>,
    /// Link whose frame is the TCP, instead of that of the robot file.
    tcp: Option<String>,
}

/// An FMU to write.
#[derive(Clone, Debug)]
pub struct FmuJob {
    /// Robot file or URDF.
    pub robot: PathBuf,
    /// Settings of the plant.
    pub settings: FmuSettings,
    /// Version of the standard.
    pub fmi: Fmi,
    /// Library of this crate, for the platform of this program.
    pub library: PathBuf,
    /// File to write.
    pub output: PathBuf,
    /// Whether to replace an existing file.
    pub overwrite: bool,
}

/// Summary of the file.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct FmuSummary {
    /// The FMU.
    pub file: PathBuf,
    /// Size (bytes).
    pub bytes: u64,
    /// Version of the standard.
    pub fmi_version: &'static str,
    /// Platform of the library.
    pub platform: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Number of inputs.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Number of parameters.
    pub parameters: usize,
    /// Number of continuous states in model exchange; 0 if there is none.
    pub states: usize,
    /// Step size of the solver (s).
    pub step_s: f64,
    /// Meshes in the resources, because masses are computed from them.
    pub meshes: usize,
    /// Sentences of the caveats that are warnings.
    pub warnings: Vec<String>,
    /// Caveats about the robot, its pose and the step.
    pub caveats: Vec<Finding>,
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> FmuError + '_ {
    move |error| FmuError::File { path: path.to_owned(), what: error.to_string() }
}

/// Writes an FMU.
///
/// # Errors
/// [`FmuError::Robot`] if the robot cannot be loaded, [`FmuError::File`] if a file cannot be
/// read or written, exists, or if the arm of the resources is not the original one.
pub fn export_fmu(job: &FmuJob) -> Result<FmuSummary, FmuError> {
    // All that can be refused is refused before the arm is compared with its resources.
    flexarm::files::check_free(std::slice::from_ref(&job.output), job.overwrite)?;
    let library = fs::read(&job.library).map_err(failed(&job.library))?;
    let model = FmuModel::new(&job.robot, &job.settings)?;
    let robot = model.arm().robot();
    let meshes = robot.urdf.mesh_files.iter().map(|(_, path)| &**path);
    let read = meshes.chain([&*robot.path, &*robot.urdf_path, &*job.library]);
    flexarm::files::check_apart(std::slice::from_ref(&job.output), &read.collect::<Vec<_>>())?;
    let (files, meshes) = resources(&model, &job.settings)?;

    // Description and resources are tied together by a token of the resources' bytes.
    let about_step = model.variables().iter().find(|variable| variable.name == "step").and_then(|step| step.start);
    let step_s = about_step.unwrap_or_default();
    let token = token(&files);
    let about = About { name: &model.arm().robot().name, token: &token, step_s };
    let xml = description(job.fmi, &about, model.variables()).map_err(failed(&job.output))?;
    let html = page(&about, model.variables()).map_err(failed(&job.output))?;
    // The entries of the zip file.
    let platform = platform(job.fmi);
    let binary = format!("binaries/{platform}/{MODEL_IDENTIFIER}.{}", std::env::consts::DLL_EXTENSION);
    let mut entries = vec![("modelDescription.xml".to_owned(), xml), (binary, library)];
    entries.push(("documentation/index.html".to_owned(), html));
    let filed =
        serde_json::to_vec_pretty(&filed(&model, &job.settings, &token, step_s)).expect("plain numbers and words");
    entries.push((format!("resources/{SETTINGS}"), filed));
    entries.extend(files.into_iter().map(|(name, bytes)| (format!("resources/{name}"), bytes)));
    let bytes = zipped(&entries).map_err(failed(&job.output))?;
    flexarm::files::write_all(&[(job.output.clone(), &bytes)])?;
    let arm = model.arm();
    let pose = first_pose(arm, &job.settings);
    let caveats = arm.caveats(Use::Commanded(&pose, job.settings.stepper, step_s));
    let count = |causality| model.variables().iter().filter(|variable| variable.causality == causality).count();
    Ok(FmuSummary {
        file: job.output.clone(),
        bytes: bytes.len() as u64,
        fmi_version: if job.fmi == Fmi::V2 { "2.0" } else { "3.0" },
        platform,
        robot: model.arm().robot().name.clone(),
        inputs: count(Causality::Input),
        outputs: count(Causality::Output),
        parameters: count(Causality::Parameter),
        states: model.state_references().len(),
        step_s,
        meshes,
        warnings: warnings(&caveats),
        caveats,
    })
}

/// Returns the folder of the library.
fn platform(fmi: Fmi) -> &'static str {
    use std::env::consts::{ARCH, OS};
    match (fmi, OS, ARCH) {
        (Fmi::V2, "linux", _) => "linux64",
        (Fmi::V2, "macos", _) => "darwin64",
        (Fmi::V2, ..) => "win64",
        (Fmi::V3, "linux", "aarch64") => "aarch64-linux",
        (Fmi::V3, "linux", _) => "x86_64-linux",
        (Fmi::V3, "macos", "aarch64") => "aarch64-darwin",
        (Fmi::V3, "macos", _) => "x86_64-darwin",
        (Fmi::V3, ..) => "x86_64-windows",
    }
}

/// Files with names relative to the resources.
type NamedFiles = Vec<(String, Vec<u8>)>;

/// Returns the files of the robot and the number of meshes among them.
fn resources(model: &FmuModel, settings: &FmuSettings) -> Result<(NamedFiles, usize), FmuError> {
    let robot = model.arm().robot();
    let without = robot_files(robot, settings, &[])?;
    if same_arm(&without, model.arm(), settings).unwrap_or(false) {
        return Ok((without, 0));
    }
    let mut meshes = Vec::new();
    for (number, (reference, path)) in robot.urdf.mesh_files.iter().enumerate() {
        let ending = path.extension().map_or_else(String::new, |ending| format!(".{}", ending.to_string_lossy()));
        meshes.push((reference.clone(), format!("meshes/{number}{ending}"), path.clone()));
    }
    let with = robot_files(robot, settings, &meshes)?;
    if same_arm(&with, model.arm(), settings)? {
        return Ok((with, meshes.len()));
    }
    let what = "the arm that is made from the resources of the FMU is not the arm of this file".into();
    Err(FmuError::File { path: robot.path.clone(), what })
}

/// Returns robot file, URDF and reduced links, with the meshes: reference, name, path.
fn robot_files(
    robot: &Robot,
    settings: &FmuSettings,
    meshes: &[(String, String, PathBuf)],
) -> Result<NamedFiles, FmuError> {
    let folder = robot.path.parent().unwrap_or(Path::new("."));
    let is_file = robot.path.extension().is_some_and(|ending| ending == "toml");
    let text = match is_file {
        true => fs::read_to_string(&robot.path).map_err(failed(&robot.path))?,
        false => "format = 1\n".to_owned(),
    };
    let mut document: DocumentMut = text
        .parse()
        .map_err(|error: toml_edit::TomlError| FmuError::File { path: robot.path.clone(), what: error.to_string() })?;
    document["urdf"] = toml_edit::value(URDF);
    document["name"] = toml_edit::value(&*robot.name);
    take_over_urdf_settings(&mut document, &settings.load.urdf);
    let mut files = move_links(&mut document, folder, !robot.gauges.is_empty())?;
    let mut urdf = robot.urdf.text.clone();
    for (reference, name, path) in meshes {
        for quote in ['"', '\''] {
            urdf = urdf.replace(&format!("{quote}{reference}{quote}"), &format!("{quote}{name}{quote}"));
        }
        files.push((name.clone(), fs::read(path).map_err(failed(path))?));
    }
    files.push((URDF.into(), urdf.into_bytes()));
    files.push((ROBOT.into(), document.to_string().into_bytes()));
    Ok(files)
}

/// Writes the settings with which the URDF was read into the robot file.
fn take_over_urdf_settings(document: &mut DocumentMut, urdf: &ReadOptions) {
    for key in ["default_trajectory", "packages", "args"] {
        document.remove(key);
    }
    for (key, links) in [("waive_inertia", &urdf.waive), ("discard_inertia", &urdf.discard)] {
        if !links.is_empty() {
            let list = document.entry(key).or_insert(toml_edit::array());
            list.as_array_mut().into_iter().for_each(|list| list.extend(links));
        }
    }
    match urdf.inertia_from_mesh {
        Some(InertiaEstimate::Density(density)) => document["inertia_from_density"] = toml_edit::value(density),
        Some(InertiaEstimate::TotalMass(mass)) => document["inertia_from_total_mass"] = toml_edit::value(mass),
        None => {}
    }
}

/// Makes the robot file refer to copies of the reduced links and of their stress, if it is needed;
/// returns the copies.
fn move_links(document: &mut DocumentMut, folder: &Path, with_stress: bool) -> Result<NamedFiles, FmuError> {
    let mut files = NamedFiles::new();
    let mut take = |entry: &mut dyn toml_edit::TableLike| -> Result<(), FmuError> {
        let Some(given) = entry.get("reduced").and_then(Item::as_str).map(|path| folder.join(path)) else {
            return Ok(());
        };
        let number = files.len() + 1;
        let name = format!("link_{number}.flex");
        files.push((name.clone(), fs::read(&given).map_err(failed(&given))?));
        let stress = given.with_extension(STRESS_FILE);
        if with_stress && stress.is_file() {
            files.push((format!("link_{number}.{STRESS_FILE}"), fs::read(&stress).map_err(failed(&stress))?));
        }
        entry.insert("reduced", toml_edit::value(name));
        Ok(())
    };
    match document.get_mut("flexible_link") {
        Some(Item::ArrayOfTables(links)) => links.iter_mut().try_for_each(|link| take(link))?,
        Some(Item::Value(toml_edit::Value::Array(links))) => {
            links.iter_mut().filter_map(|link| link.as_inline_table_mut()).try_for_each(|link| take(link))?;
        }
        _ => {}
    }
    if let Some(mounting) = document.get_mut("mounting").and_then(Item::as_table_like_mut) {
        take(mounting)?;
    }
    Ok(files)
}

/// Returns whether the arm made from files is the given one: same masses, springs and frames, bit
/// for bit.
fn same_arm(files: &NamedFiles, arm: &Arc<Arm>, settings: &FmuSettings) -> Result<bool, FmuError> {
    let parent = std::env::temp_dir();
    let folder =
        flexarm::files::private_folder(&parent).map_err(|source| FileError::Write { path: parent.clone(), source })?;
    let checked = (|| {
        for (name, bytes) in files {
            let path = folder.join(name);
            let written = fs::create_dir_all(path.parent().unwrap_or(&folder)).and_then(|()| fs::write(&path, bytes));
            written.map_err(|source| FileError::Write { path, source })?;
        }
        let load = LoadOptions { tcp: settings.load.tcp.clone(), ..LoadOptions::default() };
        let filed = RobotSource::new(&folder.join(ROBOT), &load).load()?;
        let own = filed.robot().model(&settings.modelling)?;
        // Without a given pose the arms would be posed differently: the resources have no motion.
        let pose = first_pose(arm, settings);
        let [own, given] = [&own, arm].map(|arm| arm.linearise(Some(&pose), [0.0; 6]));
        let (own, given) = (own?, given?);
        Ok(own.M == given.M && own.K == given.K && own.D == given.D && own.J == given.J && own.X_WT == given.X_WT)
    })();
    let _ = fs::remove_dir_all(&folder);
    checked
}

fn filed(model: &FmuModel, settings: &FmuSettings, token: &str, step_s: f64) -> Filed {
    let modelling = settings.modelling;
    Filed {
        format: 1,
        token: token.to_owned(),
        links: modelling.links.word().map(str::to_owned),
        drives: modelling.drives.word().map(str::to_owned),
        segments: modelling.segments,
        modes: modelling.modes,
        stepper: settings.stepper.name().to_owned(),
        step_s,
        pose: first_pose(model.arm(), settings),
        tcp: settings.load.tcp.clone(),
    }
}

/// Returns a token that depends on all resources, as a UUID.
fn token(files: &NamedFiles) -> String {
    let mut all = env!("CARGO_PKG_VERSION").as_bytes().to_vec();
    for (name, bytes) in files {
        all.extend(name.bytes().chain(bytes.iter().copied()));
    }
    let hash = [0, 1].map(|seed| format!("{:016x}", XxHash64::oneshot(seed, &all))).concat();
    format!("{{{}-{}-{}-{}-{}}}", &hash[..8], &hash[8..12], &hash[12..16], &hash[16..20], &hash[20..])
}

/// Returns the entries as a zip file; equal entries give equal bytes.
fn zipped(entries: &NamedFiles) -> std::io::Result<Vec<u8>> {
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(name, options)?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// Makes the plant of the resources of an FMU.
///
/// * `token`: that of the importer, from the description.
///
/// # Errors
/// [`FmuError::File`] for resources that are missing, damaged or of another FMU,
/// [`FmuError::Robot`].
pub fn open_resources(folder: &Path, token: &str) -> Result<FmuModel, FmuError> {
    let path = folder.join(SETTINGS);
    let text = fs::read_to_string(&path).map_err(failed(&path))?;
    let damaged = |what: String| FmuError::File { path: path.clone(), what };
    let filed: Filed = serde_json::from_str(&text).map_err(|error| damaged(error.to_string()))?;
    if filed.format != 1 {
        return Err(damaged(format!("format = {}: this library reads format 1", filed.format)));
    }
    if filed.token != token {
        let what = format!("the token {token:?} is not that of this FMU, {:?}", filed.token);
        return Err(damaged(format!("{what}: its description and its resources do not belong together")));
    }
    // Words of the file to settings.
    let stepper = StepperEntry::named(&filed.stepper);
    let stepper = stepper.ok_or_else(|| damaged(format!("stepper = {:?}: there is no such stepper", filed.stepper)))?;
    let word = |what: &str, word: &str| damaged(format!("{what} = {word:?}: there is no such model"));
    let links = match &filed.links {
        None => LinkModel::AsFiled,
        Some(name) => LinkModel::from_word(name).ok_or_else(|| word("links", name))?,
    };
    let drives = match &filed.drives {
        None => DriveModel::AsFiled,
        Some(name) => DriveModel::from_word(name).ok_or_else(|| word("drives", name))?,
    };
    let settings = FmuSettings {
        load: LoadOptions { tcp: filed.tcp, ..LoadOptions::default() },
        modelling: Modelling { links, drives, segments: filed.segments, modes: filed.modes },
        stepper: (stepper.with)(&StepperOptions::default()),
        step_s: Some(filed.step_s),
        pose: Some(filed.pose),
    };
    FmuModel::new(&folder.join(ROBOT), &settings)
}
