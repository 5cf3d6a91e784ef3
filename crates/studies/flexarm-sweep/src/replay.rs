//! Files with which a single run of a study can be repeated.
//!
//! The robot file moves to another folder with its relative paths; unchanged files are named where
//! they are.

use std::path::{Path, PathBuf};

use flexarm_files::write_all;
use toml_edit::{DocumentMut, Item, Value};

use super::Sweep;
use super::value::ParameterValue;
use super::workshop::RunFiles;
use flexarm_identify::rewrite::moved_paths;
use flexarm_run::{Error, Motion, MotionOptions};

/// Sampling rate of a motion that is not given by waypoints (Hz).
const ROWS_HZ: f64 = 1000.0;

/// Files and options of a run, from which an interface builds a command.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Replay {
    /// Robot file.
    pub robot: String,
    /// Motion; `None` if the robot file names it.
    pub motion: Option<String>,
    /// File of loads.
    pub loads: Option<String>,
    /// Options by key.
    pub options: Vec<(String, ParameterValue)>,
}

impl Sweep {
    /// Writes the files of a run with given parameter values, as a user would write them; unchanged
    /// files are not written.
    ///
    /// # Errors
    /// [`Error::Write`], [`Error::Taken`]; the reason why the run cannot start.
    pub(super) fn write_replay(&self, values: &[ParameterValue], folder: &Path) -> Result<Replay, Error> {
        let (files, ..) = self.workshop.run_files(values)?;
        let mut written: Vec<(PathBuf, Vec<u8>)> = Vec::new();
        let robot = put(&mut written, folder, "robot.toml", &files.robot.0, Some(&files.robot.1), &|text| {
            moved(text, &files.robot.0, folder)
        });
        let motion = match (&files.motion, files.speed.filter(|speed| *speed != 1.0)) {
            (None, _) => None,
            (Some((path, text)), None) => {
                Some(put(&mut written, folder, "motion.toml", path, text.as_deref(), &str::to_owned))
            }
            (Some((path, _)), Some(speed)) => Some(self.faster(&files, path, speed, folder, &mut written)?),
        };
        let loads = files.loads.as_ref().map(|(path, text)| {
            put(&mut written, folder, "loads.toml", path, Some(text), &|text| with_whole_files(text, path))
        });
        write_all(&written)?;
        Ok(Replay { robot, motion, loads, options: files.options })
    }

    /// Writes the motion at another speed: waypoints with scaled durations if all of them have one,
    /// otherwise a table.
    fn faster(
        &self,
        files: &RunFiles,
        path: &Path,
        speed: f64,
        folder: &Path,
        written: &mut Vec<(PathBuf, Vec<u8>)>,
    ) -> Result<String, Error> {
        let (_, text) = files.motion.as_ref().map_or((path, None), |(path, text)| (path.as_path(), text.clone()));
        let text = text.unwrap_or_else(|| flexarm_files::read_text(path).unwrap_or_default());
        if let Some(faster) = faster_waypoints(&text, speed) {
            let place = folder.join("motion.toml");
            written.push((place.clone(), faster.into_bytes()));
            return Ok(place.display().to_string());
        }
        let robot = flexarm_run::Robot::load(&files.robot.0)?;
        let motion = Motion::load_text(path, Some(&text), &robot, &MotionOptions::default())?;
        let trajectory = motion.trajectory.scaled(1.0 / speed)?;
        let mut table = Vec::new();
        trajectory.to_csv(ROWS_HZ, &mut table)?;
        let place = folder.join("motion.csv");
        written.push((place.clone(), table));
        Ok(place.display().to_string())
    }
}

/// Returns the path of a file of the run: that of the original if its text is unchanged.
fn put(
    written: &mut Vec<(PathBuf, Vec<u8>)>,
    folder: &Path,
    name: &str,
    original: &Path,
    text: Option<&str>,
    change: &dyn Fn(&str) -> String,
) -> String {
    let old = flexarm_files::read_text(original).ok();
    match text.filter(|text| old.as_deref() != Some(*text)) {
        None => original.display().to_string(),
        Some(text) => {
            let place = folder.join(name);
            written.push((place.clone(), change(text).into_bytes()));
            place.display().to_string()
        }
    }
}

/// Rewrites a robot file for another folder.
fn moved(text: &str, home: &Path, to: &Path) -> String {
    let Ok(mut file) = text.parse::<DocumentMut>() else { return text.to_owned() };
    moved_paths(&mut file, home.parent().unwrap_or(Path::new(".")), to);
    file.to_string()
}

/// Rewrites loads with absolute paths of their tables.
fn with_whole_files(text: &str, home: &Path) -> String {
    let Ok(mut file) = text.parse::<DocumentMut>() else { return text.to_owned() };
    let folder = home.parent().unwrap_or(Path::new("."));
    if let Some(Item::ArrayOfTables(loads)) = file.get_mut("load") {
        for load in loads.iter_mut() {
            let Some(table) = load.get("file").and_then(Item::as_str).map(|table| folder.join(table)) else { continue };
            let whole = std::path::absolute(&table).unwrap_or(table);
            load.insert("file", toml_edit::value(whole.display().to_string()));
        }
    }
    file.to_string()
}

/// Scales the durations of waypoints; `None` unless every move has a duration.
pub fn faster_waypoints(text: &str, speed: f64) -> Option<String> {
    let mut file: DocumentMut = text.parse().ok()?;
    let Item::ArrayOfTables(moves) = file.get_mut("move")? else { return None };
    let number = |item: &Item| item.as_float().or_else(|| item.as_integer().map(|n| n as f64));
    for entry in moves.iter_mut() {
        let duration = number(entry.get("duration")?)?;
        // Profiles limited by velocity and acceleration do not scale with the duration.
        if entry.get("profile").is_some_and(|profile| profile.as_str() != Some("quintic")) {
            return None;
        }
        put_number(entry.get_mut("duration")?, duration / speed);
        if let Some(hold) = entry.get("hold").and_then(number) {
            put_number(entry.get_mut("hold")?, hold / speed);
        }
    }
    if file.get("profile").is_some_and(|profile| profile.as_str() != Some("quintic")) {
        return None;
    }
    Some(file.to_string())
}

fn put_number(item: &mut Item, number: f64) {
    if let Some(old) = item.as_value_mut() {
        let decor = old.decor().clone();
        *old = Value::from(number);
        *old.decor_mut() = decor;
    }
}
