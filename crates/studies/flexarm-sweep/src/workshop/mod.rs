//! Preparation of the runs of a study: robot, motion, loads and options of each.
//!
//! Changes are made in the text of a file, which is then read like any other, so that a run equals
//! one from a file edited by hand. Everything that does not change (URDF, meshes, reduced links,
//! motions, arms from equal files) is read and built once and shared between threads.

mod prepare;
mod run_files;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use flexarm_files::read_text;
use flexarm_run::file_cache::FileCache;
use flexarm_run::{Arm, Error, Modelling, Motion, Robot, RobotFileError};
use toml_edit::DocumentMut;

use crate::design::Column;
use crate::file::{Role, StudyFile, Values};
use crate::options::StudyOptions;
use crate::path::{Segment, places};
use crate::recent::Recent;
use crate::target::{Edit, Target, TargetFile, edits};
use crate::value::ParameterValue;
use crate::{Finders, fingerprint};

pub(crate) use self::prepare::PreparedRun;
pub(crate) use self::run_files::RunFiles;

/// File that a study changes or selects.
#[derive(Debug)]
struct TextFile {
    path: PathBuf,
    text: String,
    /// Parsed content, if it is TOML.
    parsed: Option<(toml::Value, DocumentMut)>,
}

/// Flexible model of a robot.
pub(crate) struct Built {
    pub(crate) arm: Arc<Arm>,
    /// Mass of all links without the payload (kg).
    pub(crate) mass_kg: f64,
}

/// Preparation of runs.
pub(crate) struct Workshop {
    files: FileCache,
    texts: BTreeMap<PathBuf, TextFile>,
    /// Paths of the files that the study refers to by name.
    called: BTreeMap<(TargetFile, String), PathBuf>,
    robot: String,
    motion: Option<String>,
    loads: Option<String>,
    jobs: Vec<(String, PathBuf)>,
    options: StudyOptions,
    given_options: Vec<(String, ParameterValue)>,
    /// Targets of each column.
    targets: Vec<Vec<(Target, String)>>,
    roles: Vec<Role>,
    arms: Recent<Arc<Built>>,
    motions: Recent<Motion>,
    /// Reduced links computed so far, by the text of their job.
    reduced: Mutex<BTreeMap<String, PathBuf>>,
    /// Folder of reduced links.
    links_folder: PathBuf,
}

impl Workshop {
    /// Reads all files that the study names.
    ///
    /// # Errors
    /// With the place in the study: missing files, unknown options and paths.
    pub(crate) fn new(file: &StudyFile, finders: &Finders) -> Result<Self, Error> {
        let mut options = StudyOptions::default();
        for (key, value, place) in &file.options {
            options.set(key, value).map_err(|message| RobotFileError { message, ..place.clone() })?;
        }
        let mut shop = Self {
            files: FileCache::default(),
            texts: BTreeMap::new(),
            called: BTreeMap::new(),
            robot: file.robot.text.clone(),
            motion: file.motion.as_ref().map(|motion| motion.text.clone()),
            loads: file.loads.as_ref().map(|loads| loads.text.clone()),
            jobs: file.reduce.iter().map(|(link, path, _)| (link.clone(), path.clone())).collect(),
            options,
            given_options: file.options.iter().map(|(key, value, _)| (key.clone(), value.clone())).collect(),
            targets: Vec::new(),
            roles: Vec::new(),
            arms: Recent::default(),
            motions: Recent::default(),
            reduced: Mutex::default(),
            links_folder: PathBuf::from("links"),
        };
        // Files that the study names, and the jobs of reduced links.
        let named = [
            (TargetFile::Robot, Some(&file.robot)),
            (TargetFile::Motion, file.motion.as_ref()),
            (TargetFile::Loads, file.loads.as_ref()),
        ];
        for (which, named) in named {
            if let Some(named) = named {
                shop.call(which, &named.text, file, finders, &named.place)?;
            }
        }
        for (_, path, place) in &file.reduce {
            shop.read(path, place)?;
        }
        Ok(shop)
    }

    /// Sets the results folder in which reduced links are stored.
    pub(crate) fn put_links_into(&mut self, folder: &Path) {
        self.links_folder = folder.join("links");
    }

    /// Returns all files that were read, with a fingerprint of each.
    pub(crate) fn inputs(&self) -> Vec<(String, String)> {
        let mut found: Vec<(String, String)> = self
            .texts
            .values()
            .map(|file| {
                (
                    file.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                    fingerprint(file.text.as_bytes()),
                )
            })
            .collect();
        found.sort();
        found
    }

    /// Returns the reason why a run failed, with file names in place of paths, which depend on the
    /// machine.
    pub(crate) fn reason(&self, error: &Error) -> String {
        self.plain(error.to_string())
    }

    /// Replaces paths by file names in a text.
    pub(crate) fn plain(&self, text: String) -> String {
        self.texts.keys().fold(text, |text, path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            text.replace(&path.display().to_string(), &name)
        })
    }

    /// Returns the robot that the study names.
    pub(crate) fn base_robot(&self) -> Result<Robot, Error> {
        let path = &self.called[&(TargetFile::Robot, self.robot.clone())];
        let text = &self.texts[path].text;
        self.robot_of(path, text)
    }

    /// Returns the modelling of links and drives for runs without options of their own.
    pub(crate) fn base_modelling(&self) -> Modelling {
        self.options.modelling
    }

    /// Finds a file that the study refers to by name, and reads it.
    fn call(
        &mut self,
        which: TargetFile,
        word: &str,
        file: &StudyFile,
        finders: &Finders,
        place: &RobotFileError,
    ) -> Result<(), Error> {
        let beside = file.path.parent().unwrap_or(Path::new(".")).join(word);
        let mut path = match (beside.exists(), which) {
            (true, _) => beside,
            (false, TargetFile::Robot) => (finders.robot)(Path::new(word)),
            (false, _) => (finders.motion)(Path::new(word)),
        };
        if path.is_dir() && which == TargetFile::Robot {
            path = path.join("robot.toml");
        }
        if !path.exists() {
            let message =
                format!("there is no file {word:?} in the folder of the study, and no shipped file with this name");
            return Err(RobotFileError { message, ..place.clone() }.into());
        }
        self.read(&path, place)?;
        if let (TargetFile::Robot, None, Some(own)) = (which, &self.motion, self.own_motion(&path)) {
            self.read(&own, place)?;
        }
        self.called.insert((which, word.to_owned()), path);
        Ok(())
    }

    /// Returns the motion that a robot file names.
    fn own_motion(&self, robot: &Path) -> Option<PathBuf> {
        let (root, _) = self.texts.get(robot)?.parsed.as_ref()?;
        let own = root.get("default_trajectory")?.as_str()?;
        Some(robot.parent().unwrap_or(Path::new(".")).join(own))
    }

    /// Reads a file once.
    fn read(&mut self, path: &Path, place: &RobotFileError) -> Result<(), Error> {
        if self.texts.contains_key(path) {
            return Ok(());
        }
        // Binary motions such as bags have no text; their content is not part of the study's
        // fingerprint.
        let text = match read_text(path) {
            Ok(text) => text,
            Err(_) if path.exists() => String::new(),
            Err(error) => {
                let message = error.to_string();
                return Err(RobotFileError { message, ..place.clone() }.into());
            }
        };
        let is_toml = path.extension().is_some_and(|ending| ending == "toml");
        let parsed = if is_toml { toml::from_str(&text).ok().zip(text.parse().ok()) } else { None };
        self.texts.insert(path.to_owned(), TextFile { path: path.to_owned(), text, parsed });
        Ok(())
    }

    /// Sets the columns of the design.
    ///
    /// # Errors
    /// With the place in the study: invalid paths, missing files, invalid values of options.
    pub(crate) fn vary(&mut self, columns: &[Column], file: &StudyFile, finders: &Finders) -> Result<(), Error> {
        let jobs: Vec<String> = self.jobs.iter().map(|(link, _)| link.clone()).collect();
        for column in columns {
            let fail = |error: String| RobotFileError { message: format!("parameter {error}"), ..column.place.clone() };
            let targets = column.paths.iter().map(|path| Ok((Target::parse(path, &jobs).map_err(fail)?, path.clone())));
            let targets = targets.collect::<Result<Vec<_>, RobotFileError>>()?;
            for (target, text) in &targets {
                self.check_target(target, text, column, file, finders)?;
            }
            self.targets.push(targets);
            self.roles.push(column.role);
        }
        Ok(())
    }

    /// Checks that all listed values of a parameter fit one of its targets, and reads the files they name.
    fn check_target(
        &mut self,
        target: &Target,
        text: &str,
        column: &Column,
        file: &StudyFile,
        finders: &Finders,
    ) -> Result<(), Error> {
        let fail = |message: String| RobotFileError { message: format!("parameter {message}"), ..column.place.clone() };
        let listed: Vec<ParameterValue> = match &column.values {
            Values::Levels(list) | Values::Choice(list) => list.clone(),
            Values::Spread(distribution) => vec![ParameterValue::Number(distribution.quantile(0.5))],
            Values::Derived(_) => vec![ParameterValue::Number(1.0)],
        };
        // A distribution is checked at its median, an expression at any number.
        for value in &listed {
            match target {
                Target::File(which) => match value {
                    ParameterValue::Text(word) => self.call(*which, word, file, finders, &column.place)?,
                    other => return Err(fail(format!("{text:?}: {other} is not a file name")).into()),
                },
                Target::Speed if !value.number().is_some_and(|x| x > 0.0) => {
                    return Err(fail(format!("{text:?}: speed {value}, expected a positive number")).into());
                }
                Target::Speed => {}
                Target::Option(key) => {
                    if column.role != Role::Value {
                        return Err(fail(format!("{text:?}: an option takes a value, not a factor or offset")).into());
                    }
                    self.options.clone().set(key, value).map_err(|error| fail(format!("{text:?}: {error}")))?;
                }
                Target::Entry(which, path) => {
                    let no_file = || fail(no_file(text));
                    let path_of_file = self.base_path(*which).ok_or_else(no_file)?;
                    self.entry_edits(&path_of_file, path, text, column.role, value, &[]).map_err(fail)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the path of a file that the study names.
    pub(crate) fn base_path(&self, which: TargetFile) -> Option<PathBuf> {
        let word = match which {
            TargetFile::Robot => Some(&self.robot),
            TargetFile::Motion => self.motion.as_ref(),
            TargetFile::Loads => self.loads.as_ref(),
            TargetFile::Job(number) => return Some(self.jobs[number].1.clone()),
        };
        match (which, word) {
            (TargetFile::Motion, None) => self.own_motion(self.called.get(&(TargetFile::Robot, self.robot.clone()))?),
            (_, word) => self.called.get(&(which, word?.clone())).cloned(),
        }
    }

    /// Returns the names of all entries that a path matches in the robot file or another file of
    /// the study, for one parameter each.
    pub(crate) fn expanded(&self, text: &str) -> Result<Vec<String>, String> {
        let jobs: Vec<String> = self.jobs.iter().map(|(link, _)| link.clone()).collect();
        let Target::Entry(which, path) = Target::parse(text, &jobs)? else { return Ok(vec![text.to_owned()]) };
        let before = match which {
            TargetFile::Robot => String::new(),
            TargetFile::Motion => "motion.".into(),
            TargetFile::Loads => "loads.".into(),
            TargetFile::Job(number) => format!("reduce.{}.", self.jobs[number].0),
        };
        let file = self.base_path(which).ok_or_else(|| no_file(text))?;
        let Some((root, _)) = &self.texts[&file].parsed else { return Ok(vec![text.to_owned()]) };
        let named =
            |name: String| name.strip_prefix("flexible_link.").map_or(name.clone(), |rest| format!("link.{rest}"));
        let found = places(root, &path).into_iter().map(|place| format!("{before}{}", named(place.name)));
        Ok(found.collect())
    }

    /// Returns the edits that a value makes in a file, given earlier edits.
    fn entry_edits(
        &self,
        file: &Path,
        path: &[Segment],
        text: &str,
        role: Role,
        value: &ParameterValue,
        known: &[Edit],
    ) -> Result<Vec<Edit>, String> {
        match self.texts.get(file).and_then(|file| file.parsed.as_ref()) {
            Some((root, _)) => edits(root, path, text, role, value, known),
            None => Err(format!("{text:?}: {} is not a TOML file and has no keys", file.display())),
        }
    }
}

/// Returns the message about a path into a file that the study does not name.
fn no_file(path: &str) -> String {
    format!("{path:?}: the study names no file of this kind")
}
