//! Files of a run as they would be written by hand: the edits that its values make in the texts.
//!
//! Start at `Workshop::run_files`. A value changes an entry, chooses a file, or sets the speed or
//! an option; edits of one file follow each other. Not here: reading the files
//! ([`super::prepare`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use flexarm_run::Error;

use super::{TextFile, Workshop};
use crate::error::SweepError;
use crate::file::Role;
use crate::options::StudyOptions;
use crate::path::{Segment, segments};
use crate::target::{Edit, Target, TargetFile};
use crate::value::ParameterValue;

/// Keys of a robot file that do not affect joint motions.
const NOT_OF_THE_MOTION: [&str; 7] =
    ["payload", "flexible_link", "drive", "gravity", "mounting", "balancer", "coupling"];

/// Files of a run as they would be written to disk.
#[derive(Clone, Debug, Default)]
pub(crate) struct RunFiles {
    pub(crate) robot: (PathBuf, String),
    /// Path and text; `None` for the robot's own motion, text `None` for an unchanged file.
    pub(crate) motion: Option<(PathBuf, Option<String>)>,
    pub(crate) loads: Option<(PathBuf, String)>,
    pub(crate) options: Vec<(String, ParameterValue)>,
    pub(crate) speed: Option<f64>,
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

impl Workshop {
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
    pub(crate) fn run_files(&self, values: &[ParameterValue]) -> Result<(RunFiles, StudyOptions, bool), Error> {
        let RunInputs { robot, motion, loads, options, given, speed } = self.chosen(values)?;
        let mut changes = self.changes(values, &robot, motion.as_deref(), loads.as_deref())?;
        self.reduce_again(&robot, &mut changes)?;
        let edits = |which: TargetFile| changes.get(&which).map_or(&[][..], Vec::as_slice);
        let moves = edits(TargetFile::Robot).iter().any(|edit| {
            let first = segments(&edit.place.name).and_then(|path| path.into_iter().next());
            first.is_none_or(|first| !matches!(first, Segment::Key(key) if NOT_OF_THE_MOTION.contains(&key.as_str())))
        });
        let text = self.changed(&robot, edits(TargetFile::Robot));
        let files = RunFiles {
            robot: (robot, text),
            motion: motion.map(|path| {
                let text =
                    (!edits(TargetFile::Motion).is_empty()).then(|| self.changed(&path, edits(TargetFile::Motion)));
                (path, text)
            }),
            loads: loads.map(|path| {
                let text = self.changed(&path, edits(TargetFile::Loads));
                (path, text)
            }),
            options: given,
            speed,
        };
        Ok((files, options, moves))
    }

    /// Returns the files and options of a run.
    fn chosen(&self, values: &[ParameterValue]) -> Result<RunInputs, Error> {
        // Start from what the study names; each value replaces a file, the speed or an option.
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
                        let failed = |error| Error::from(SweepError::Run(format!("{text}: {error}")));
                        options.set(key, value).map_err(failed)?;
                        given.retain(|(known, _)| known != key);
                        given.push((key.clone(), value.clone()));
                    }
                    _ => {}
                }
            }
        }
        // Paths of the files so chosen.
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
        let failed = |what: String| Error::from(SweepError::Run(what));
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
                let edits = self.entry_edits(file, path, text, *role, value, known);
                let edits = edits.map_err(|error| failed(error.to_string()))?;
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
            let edits = edits.map_err(|error| SweepError::Run(error.to_string()))?;
            changes.entry(TargetFile::Robot).or_default().extend(edits);
        }
        Ok(())
    }
}

/// Returns the index of a file in the list of robot, motion and loads.
fn word_place(which: TargetFile) -> usize {
    match which {
        TargetFile::Robot | TargetFile::Job(_) => 0,
        TargetFile::Motion => 1,
        TargetFile::Loads => 2,
    }
}
