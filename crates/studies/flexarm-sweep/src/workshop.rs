//! Preparation of the runs of a study: robot, motion, loads and options of each.
//!
//! Changes are made in the text of a file, which is then read like any other, so that a run equals
//! one from a file edited by hand. Everything that does not change (URDF, meshes, reduced links,
//! motions, arms from equal files) is read and built once and shared between threads.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use flexarm_files::read_text;
use toml_edit::DocumentMut;

use super::design::Column;
use super::file::{Role, StudyFile};
use super::options::StudyOptions;
use super::path::{Segment, places, segments};
use super::recent::Recent;
use super::target::{Edit, Target, TargetFile, edits};
use super::value::ParameterValue;
use super::{Finders, fingerprint};
use flexarm_run::Arm;
use flexarm_run::Error;
use flexarm_run::FlexibleRobot;
use flexarm_run::LoadOptions;
use flexarm_run::Modelling;
use flexarm_run::Motion;
use flexarm_run::MotionOptions;
use flexarm_run::Robot;
use flexarm_run::RobotFileError;
use flexarm_run::RunOptions;
use flexarm_run::Scenario;
use flexarm_run::file_cache::FileCache;
use flexarm_run::loads_file::parse_loads;
use flexarm_run::reduce::ReduceJob;
use flexarm_run::reduce::ReduceOptions;
use flexarm_run::reduce::ReduceOutputs;
use flexarm_run::reduce::reduce;

/// Keys of a robot file that do not affect joint motions.
const NOT_OF_THE_MOTION: [&str; 7] =
    ["payload", "flexible_link", "drive", "gravity", "mounting", "balancer", "coupling"];

/// File that a study changes or selects.
#[derive(Debug)]
pub(super) struct TextFile {
    pub(super) path: PathBuf,
    pub(super) text: String,
    /// Parsed content, if it is TOML.
    parsed: Option<(toml::Value, DocumentMut)>,
}

/// Flexible model of a robot.
pub(super) struct Built {
    pub(super) arm: Arm,
    /// Mass of all links without the payload (kg).
    pub(super) mass_kg: f64,
}

/// Run that is ready to simulate.
pub(super) struct PreparedRun {
    pub(super) built: Arc<Built>,
    pub(super) scenario: Scenario,
    pub(super) options: RunOptions,
}

/// Files of a run as they would be written to disk.
#[derive(Clone, Debug, Default)]
pub(super) struct RunFiles {
    pub(super) robot: (PathBuf, String),
    /// Path and text; `None` for the robot's own motion, text `None` for an unchanged file.
    pub(super) motion: Option<(PathBuf, Option<String>)>,
    pub(super) loads: Option<(PathBuf, String)>,
    pub(super) options: Vec<(String, ParameterValue)>,
    pub(super) speed: Option<f64>,
}

/// Files and options of a run.
struct RunInputs {
    robot: PathBuf,
    motion: Option<PathBuf>,
    loads: Option<PathBuf>,
    options: StudyOptions,
    given: Vec<(String, ParameterValue)>,
    speed: Option<f64>,
}

/// Preparation of runs.
pub(super) struct Workshop {
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
    pub(super) fn new(file: &StudyFile, finders: &Finders) -> Result<Self, Error> {
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
    pub(super) fn put_links_into(&mut self, folder: &Path) {
        self.links_folder = folder.join("links");
    }

    /// Returns all files that were read, with a fingerprint of each.
    pub(super) fn inputs(&self) -> Vec<(String, String)> {
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
    pub(super) fn reason(&self, error: &Error) -> String {
        self.plain(error.to_string())
    }

    /// Replaces paths by file names in a text.
    pub(super) fn plain(&self, text: String) -> String {
        self.texts.keys().fold(text, |text, path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            text.replace(&path.display().to_string(), &name)
        })
    }

    /// Returns the robot that the study names.
    pub(super) fn base_robot(&self) -> Result<Robot, Error> {
        let path = &self.called[&(TargetFile::Robot, self.robot.clone())];
        let text = &self.texts[path].text;
        self.robot_of(path, text)
    }

    /// Returns the modelling of links and drives for runs without options of their own.
    pub(super) fn base_modelling(&self) -> Modelling {
        self.options.run().modelling
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
    pub(super) fn vary(&mut self, columns: &[Column], file: &StudyFile, finders: &Finders) -> Result<(), Error> {
        let jobs: Vec<String> = self.jobs.iter().map(|(link, _)| link.clone()).collect();
        for column in columns {
            let fail =
                |message: String| RobotFileError { message: format!("parameter {message}"), ..column.place.clone() };
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

    fn check_target(
        &mut self,
        target: &Target,
        text: &str,
        column: &Column,
        file: &StudyFile,
        finders: &Finders,
    ) -> Result<(), Error> {
        use super::file::Values;
        let fail = |message: String| RobotFileError { message: format!("parameter {message}"), ..column.place.clone() };
        let listed: Vec<ParameterValue> = match &column.values {
            Values::Levels(list) | Values::Choice(list) => list.clone(),
            Values::Spread(distribution) => vec![ParameterValue::Number(distribution.quantile(0.5))],
            Values::Derived(_) => vec![ParameterValue::Number(1.0)],
        };
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
                    self.options.clone().set(key, value).map_err(|message| fail(format!("{text:?}: {message}")))?;
                }
                Target::Entry(which, path) => {
                    let path_of_file = self
                        .base_path(*which)
                        .ok_or_else(|| fail(format!("{text:?}: the study names no file of this kind")))?;
                    self.entry_edits(&path_of_file, path, text, column.role, value, &[]).map_err(fail)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the path of a file that the study names.
    pub(super) fn base_path(&self, which: TargetFile) -> Option<PathBuf> {
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
    pub(super) fn expanded(&self, text: &str) -> Result<Vec<String>, String> {
        let jobs: Vec<String> = self.jobs.iter().map(|(link, _)| link.clone()).collect();
        let Target::Entry(which, path) = Target::parse(text, &jobs)? else { return Ok(vec![text.to_owned()]) };
        let before = match which {
            TargetFile::Robot => String::new(),
            TargetFile::Motion => "motion.".into(),
            TargetFile::Loads => "loads.".into(),
            TargetFile::Job(number) => format!("reduce.{}.", self.jobs[number].0),
        };
        let file = self.base_path(which).ok_or_else(|| format!("{text:?}: the study names no file of this kind"))?;
        let Some((root, _)) = &self.texts[&file].parsed else { return Ok(vec![text.to_owned()]) };
        let named =
            |name: String| name.strip_prefix("flexible_link.").map_or(name.clone(), |rest| format!("link.{rest}"));
        let found = places(root, &path).into_iter().map(|place| format!("{before}{}", named(place.name)));
        Ok(found.collect())
    }

    /// Returns the present value of a parameter: the number in the file, or the neutral value of a
    /// factor or offset.
    pub(super) fn current(&self, column: usize) -> Option<f64> {
        let (target, _) = self.targets[column].first()?;
        match (self.roles[column], target) {
            (Role::Factor, _) | (_, Target::Speed) => Some(1.0),
            (Role::Offset, _) => Some(0.0),
            (Role::Value, Target::Entry(which, path)) => {
                let (root, _) = self.texts.get(&self.base_path(*which)?)?.parsed.as_ref()?;
                let found = places(root, path);
                match found.first()?.value(root)? {
                    toml::Value::Float(x) => Some(*x),
                    toml::Value::Integer(n) => Some(*n as f64),
                    _ => None,
                }
            }
            _ => None,
        }
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

    /// Returns the text of a file with edits.
    fn changed(&self, file: &Path, edits: &[Edit]) -> String {
        match self.texts.get(file) {
            Some(TextFile { parsed: Some((_, document)), .. }) if !edits.is_empty() => {
                let mut document = document.clone();
                for edit in edits {
                    edit.place.put(&mut document, edit.value.clone());
                }
                document.to_string()
            }
            Some(file) => file.text.clone(),
            None => String::new(),
        }
    }

    /// Returns the files of a run as they would be written by hand. Recomputes the reduced links
    /// that the run changes.
    ///
    /// # Errors
    /// The reason why the run cannot start.
    pub(super) fn run_files(&self, values: &[ParameterValue]) -> Result<(RunFiles, StudyOptions, bool), Error> {
        let RunInputs { robot, motion, loads, options, given, speed } = self.chosen(values)?;
        let mut changes = self.changes(values, &robot, motion.as_deref(), loads.as_deref())?;
        self.reduce_again(&robot, &mut changes)?;
        let of = |which: TargetFile| changes.get(&which).map_or(&[][..], Vec::as_slice);
        let moves = of(TargetFile::Robot).iter().any(|edit| {
            let first = segments(&edit.place.name).and_then(|path| path.into_iter().next());
            first.is_none_or(|first| !matches!(first, Segment::Key(key) if NOT_OF_THE_MOTION.contains(&key.as_str())))
        });
        let text = self.changed(&robot, of(TargetFile::Robot));
        let files = RunFiles {
            robot: (robot, text),
            motion: motion.map(|path| {
                let text = (!of(TargetFile::Motion).is_empty()).then(|| self.changed(&path, of(TargetFile::Motion)));
                (path, text)
            }),
            loads: loads.map(|path| {
                let text = self.changed(&path, of(TargetFile::Loads));
                (path, text)
            }),
            options: given,
            speed,
        };
        Ok((files, options, moves))
    }

    /// Returns the files and options of a run.
    fn chosen(&self, values: &[ParameterValue]) -> Result<RunInputs, Error> {
        let mut words = [Some(self.robot.clone()), self.motion.clone(), self.loads.clone()];
        let (mut options, mut given) = (self.options.clone(), self.given_options.clone());
        let mut speed: Option<f64> = None;
        for ((targets, role), value) in self.targets.iter().zip(&self.roles).zip(values) {
            for (target, text) in targets {
                match (target, value) {
                    (Target::File(which), ParameterValue::Text(word)) => words[word_place(*which)] = Some(word.clone()),
                    (Target::Speed, _) => {
                        let (x, before) = (value.number().unwrap_or(f64::NAN), speed.unwrap_or(1.0));
                        speed = Some(match role {
                            Role::Value => x,
                            Role::Factor => before * x,
                            Role::Offset => before + x,
                        });
                    }
                    (Target::Option(key), _) => {
                        let failed = |message| Error::from(super::SweepError::Run(format!("{text}: {message}")));
                        options.set(key, value).map_err(failed)?;
                        given.retain(|(known, _)| known != key);
                        given.push((key.clone(), value.clone()));
                    }
                    _ => {}
                }
            }
        }
        let path_of = |which: TargetFile| {
            let word = words[word_place(which)].clone()?;
            self.called.get(&(which, word)).cloned()
        };
        let robot = path_of(TargetFile::Robot).unwrap_or_default();
        let motion = path_of(TargetFile::Motion).or_else(|| self.own_motion(&robot));
        Ok(RunInputs { motion, loads: path_of(TargetFile::Loads), robot, options, given, speed })
    }

    /// Returns the edits that the values make in each file.
    fn changes(
        &self,
        values: &[ParameterValue],
        robot: &Path,
        motion: Option<&Path>,
        loads: Option<&Path>,
    ) -> Result<BTreeMap<TargetFile, Vec<Edit>>, Error> {
        let failed = |what: String| Error::from(super::SweepError::Run(what));
        let mut changes: BTreeMap<TargetFile, Vec<Edit>> = BTreeMap::new();
        for ((targets, role), value) in self.targets.iter().zip(&self.roles).zip(values) {
            for (target, text) in targets {
                let Target::Entry(which, path) = target else { continue };
                let file = match which {
                    TargetFile::Robot => Some(robot),
                    TargetFile::Motion => motion,
                    TargetFile::Loads => loads,
                    TargetFile::Job(number) => Some(self.jobs[*number].1.as_path()),
                };
                let file = file.ok_or_else(|| failed(format!("{text}: the run has no such file")))?;
                let known = changes.entry(*which).or_default();
                let edits = self.entry_edits(file, path, text, *role, value, known).map_err(failed)?;
                known.extend(edits);
            }
        }
        Ok(changes)
    }

    /// Recomputes the reduced links whose jobs changed, and refers to them in the robot file.
    fn reduce_again(&self, robot: &Path, changes: &mut BTreeMap<TargetFile, Vec<Edit>>) -> Result<(), Error> {
        for (number, (link, job)) in self.jobs.iter().enumerate() {
            let Some(edits) = changes.remove(&TargetFile::Job(number)) else { continue };
            let flex = self.reduced_link(link, job, &self.changed(job, &edits))?;
            let path = ["flexible_link", link, "reduced"].map(|key| Segment::Key(key.to_owned()));
            let value = ParameterValue::Text(flex.display().to_string());
            let edits = self.entry_edits(robot, &path, &format!("link.{link}.reduced"), Role::Value, &value, &[]);
            let edits = edits.map_err(super::SweepError::Run)?;
            changes.entry(TargetFile::Robot).or_default().extend(edits);
        }
        Ok(())
    }

    /// Prepares a run.
    ///
    /// # Errors
    /// The reason why it cannot start: values that are invalid for a robot, a missing motion.
    pub(super) fn ready(&self, values: &[ParameterValue]) -> Result<PreparedRun, Error> {
        let (files, options, robot_moves) = self.run_files(values)?;
        let run = options.run();
        let built = self.built(&files.robot, run.modelling)?;
        let motion = self.motion_of(&files, &options, &built, robot_moves)?;
        let mut scenario = Scenario::new(motion).with_start(options.start);
        if let Some((path, text)) = &files.loads {
            let (loads, payloads) = parse_loads(text, path, scenario.duration_s())?;
            (scenario.loads, scenario.payloads, scenario.loads_file) = (loads, payloads, Some(path.clone()));
        }
        Ok(PreparedRun { built, scenario, options: run })
    }

    fn robot_of(&self, path: &Path, text: &str) -> Result<Robot, Error> {
        match path.extension().is_some_and(|ending| ending == "toml") {
            true => Robot::of_text(path, text, &LoadOptions::default(), &self.files),
            false => Robot::load(path),
        }
    }

    fn built(&self, (path, text): &(PathBuf, String), modelling: Modelling) -> Result<Arc<Built>, Error> {
        let key = format!("{}\n{modelling:?}\n{text}", path.display());
        if let Some(known) = self.arms.get(&key) {
            return Ok(known);
        }
        let robot = self.robot_of(path, text)?;
        let arm = robot.flexible(modelling)?;
        let mass_kg = mass(&robot, arm.flexible());
        let built = Arc::new(Built { arm, mass_kg });
        self.arms.put(key, built.clone());
        Ok(built)
    }

    fn motion_of(
        &self,
        files: &RunFiles,
        options: &StudyOptions,
        built: &Built,
        robot_moves: bool,
    ) -> Result<Motion, Error> {
        let Some((path, text)) = &files.motion else { return Err(super::SweepError::NoMotion.into()) };
        // A TCP path depends on the whole robot, a joint motion only on a few of its keys.
        let of_joints = self
            .texts
            .get(path)
            .and_then(|file| file.parsed.as_ref())
            .is_some_and(|(root, _)| root.get("path").is_none());
        let robot = if robot_moves || !of_joints { files.robot.1.as_str() } else { "" };
        let (speed, round) = (files.speed, options.round_corners);
        let name = files.robot.0.display();
        let key =
            format!("{} {name} {speed:?} {round:?}\n{}\n{robot}", path.display(), text.as_deref().unwrap_or_default());
        if let Some(known) = self.motions.get(&key) {
            return Ok(known);
        }
        let motion = Motion::load_text(path, text.as_deref(), built.arm.robot(), &MotionOptions::default())?;
        let model = &built.arm.flexible().rigid;
        let motion = match round {
            Some(seconds) => motion.with_rounded_corners(seconds, model)?,
            None => motion,
        };
        let motion = match speed {
            Some(speed) => motion.scaled(1.0 / speed, model)?,
            None => motion,
        };
        self.motions.put(key, motion.clone());
        Ok(motion)
    }

    /// Returns the path of the reduced link from a job.
    fn reduced_link(&self, link: &str, job: &Path, text: &str) -> Result<PathBuf, Error> {
        // One at a time, because a reduction uses all cores.
        let mut made = self.reduced.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = made.get(text) {
            return Ok(known.clone());
        }
        let name = format!("{}-{}.flex", flexarm_files::file_stem(link), fingerprint(text.as_bytes()));
        let path = std::path::absolute(self.links_folder.join(name))
            .map_err(|source| Error::Write { path: job.into(), source })?;
        if !path.exists() {
            let outputs = ReduceOutputs { flex: Some(path.clone()), overwrite: true, ..ReduceOutputs::default() };
            let job = ReduceJob::parse(text, job)?;
            reduce(&job, &ReduceOptions::default(), Some(&outputs), &mut |_| {})?;
        }
        made.insert(text.to_owned(), path.clone());
        Ok(path)
    }
}

/// Mass of all links, including the parts of flexible links, without the payload (kg).
fn mass(robot: &Robot, flexible: &FlexibleRobot) -> f64 {
    let own = robot.rigid.links.iter().filter(|link| link.name != flexarm_run::robot::PAYLOAD_LINK);
    let own: f64 = own.filter_map(|link| link.inertia).map(|inertia| inertia.mass).sum();
    let parts = flexible.spans.iter().map(|span| span.part_masses.iter().sum::<f64>() - span.own_mass);
    own + parts.sum::<f64>()
}

/// Returns the index of a file in the list of robot, motion and loads.
fn word_place(which: TargetFile) -> usize {
    match which {
        TargetFile::Robot | TargetFile::Job(_) => 0,
        TargetFile::Motion => 1,
        TargetFile::Loads => 2,
    }
}
