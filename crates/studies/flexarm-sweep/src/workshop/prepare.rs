//! Robot, motion, loads and reduced links of a run, built from its files or shared with other runs.
//!
//! Start at `Workshop::ready`. Robots and motions are cached by the text that determines them, so
//! that runs with equal files share them.

use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};

use flexarm_run::loads_file::parse_loads;
use flexarm_run::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
use flexarm_run::robot::PAYLOAD_LINK;
use flexarm_run::{Error, LoadOptions, Modelling, Motion, MotionOptions, Robot, RobotSource, RunOptions, Scenario};

use super::run_files::RunFiles;
use super::{Built, Workshop};
use crate::error::SweepError;
use crate::fingerprint;
use crate::options::StudyOptions;
use crate::value::ParameterValue;

/// Run that is ready to simulate.
pub(crate) struct PreparedRun {
    pub(crate) built: Arc<Built>,
    pub(crate) scenario: Scenario,
    pub(crate) options: RunOptions,
}

impl Workshop {
    /// Prepares a run.
    ///
    /// # Errors
    /// The reason why it cannot start: values that are invalid for a robot, a missing motion.
    pub(crate) fn ready(&self, values: &[ParameterValue]) -> Result<PreparedRun, Error> {
        let (files, options, robot_moves) = self.run_files(values)?;
        let run = options.run();
        let built = self.built(&files.robot, options.modelling)?;
        let motion = self.motion_of(&files, &options, &built, robot_moves)?;
        let mut scenario = Scenario::new(motion).with_start(options.start);
        if let Some((path, text)) = &files.loads {
            let (loads, payloads) = parse_loads(text, path, scenario.duration_s())?;
            (scenario.loads, scenario.payloads, scenario.loads_file) = (loads, payloads, Some(path.clone()));
        }
        Ok(PreparedRun { built, scenario, options: run })
    }

    pub(super) fn robot_of(&self, path: &Path, text: &str) -> Result<Robot, Error> {
        match path.extension().is_some_and(|ending| ending == "toml") {
            true => RobotSource {
                text: Some(text),
                files: Some(&self.files),
                ..RobotSource::new(path, &LoadOptions::default())
            }
            .load()
            .map(|arm| arm.robot().clone()),
            false => Robot::load(path),
        }
    }

    fn built(&self, (path, text): &(PathBuf, String), modelling: Modelling) -> Result<Arc<Built>, Error> {
        let key = format!("{}\n{modelling:?}\n{text}", path.display());
        if let Some(known) = self.arms.get(&key) {
            return Ok(known);
        }
        let robot = self.robot_of(path, text)?;
        let arm = robot.model(&modelling)?;
        let mass_kg = mass(&robot);
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
        let Some((path, text)) = &files.motion else { return Err(SweepError::NoMotion.into()) };
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
        let model = &built.arm.rigid;
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
    pub(super) fn reduced_link(&self, link: &str, job: &Path, text: &str) -> Result<PathBuf, Error> {
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

/// Mass of all links without the payload (kg).
fn mass(robot: &Robot) -> f64 {
    let own = robot.rigid.links.iter().filter(|link| link.name != PAYLOAD_LINK);
    own.filter_map(|link| link.inertia).map(|inertia| inertia.mass).sum()
}
