//! Options of the runs of a study, with the names of `flexarm compare`, `_` in place of `-`.

use flexarm_stepping::{ReferenceMethod, STEPPERS, Start, StepperOptions};

use super::value::ParameterValue;
use flexarm_run::DriveModel;
use flexarm_run::LinkModel;
use flexarm_run::RunOptions;

/// Names of all options.
const KEYS: [&str; 15] = [
    "step",
    "stepper",
    "links",
    "drives",
    "segments",
    "modes",
    "log_rate",
    "settling_band",
    "ignore_limits",
    "from_rest",
    "rho_inf",
    "dispersion_correction",
    "rtol",
    "reference_method",
    "round_corners",
];

/// Options of time integration and evaluation of runs.
#[derive(Clone, Debug)]
pub(super) struct StudyOptions {
    stepper: usize,
    /// Step size (s); the stepper's default if absent.
    step_s: Option<f64>,
    settings: StepperOptions,
    run: RunOptions,
    pub(super) start: Start,
    /// Duration over which corners of motions are rounded (s).
    pub(super) round_corners: Option<f64>,
}

impl Default for StudyOptions {
    fn default() -> Self {
        let (settings, run, start) = (StepperOptions::default(), RunOptions::default(), Start::default());
        Self { stepper: 0, step_s: None, settings, run, start, round_corners: None }
    }
}

impl StudyOptions {
    /// Returns the options in the form for a run.
    pub(super) fn run(&self) -> RunOptions {
        let entry = STEPPERS[self.stepper];
        let step_s = self.step_s.unwrap_or(entry.default_step_s);
        RunOptions { stepper: (entry.with)(&self.settings), step_s, ..self.run.clone() }
    }

    /// Sets an option.
    ///
    /// # Errors
    /// A sentence about an unknown option or a value of the wrong type.
    pub(super) fn set(&mut self, key: &str, value: &ParameterValue) -> Result<(), String> {
        match key {
            "step" => self.step_s = Some(number(key, value)?),
            "log_rate" => self.run.log_rate_hz = number(key, value)?,
            "settling_band" => self.run.settling_band_m = number(key, value)?,
            "rho_inf" => self.settings.alpha.rho = number(key, value)?,
            "rtol" => self.settings.reference.rtol = number(key, value)?,
            "round_corners" => self.round_corners = Some(number(key, value)?),
            "segments" => self.run.modelling.segments = Some(count(key, value, 2)?),
            "modes" => self.run.modelling.modes = Some(count(key, value, 0)?),
            "ignore_limits" => self.run.ignore_limits = truth(key, value)?,
            "dispersion_correction" => self.settings.alpha.dispersion_correction = truth(key, value)?,
            "stepper" => {
                let known: Vec<&str> = STEPPERS.iter().map(|entry| entry.name).collect();
                let word = word(key, value)?;
                let is_it =
                    |entry: &&&flexarm_stepping::StepperEntry| entry.name == word || entry.aliases.contains(&word);
                let place = STEPPERS.iter().position(|entry| is_it(&entry));
                self.stepper = place.ok_or_else(|| unknown(key, word, &known))?;
            }
            "links" => {
                let word = word(key, value)?;
                let known = LinkModel::WORDS.map(|(word, ..)| word);
                self.run.modelling.links = LinkModel::from_word(word).ok_or_else(|| unknown(key, word, &known))?;
            }
            "drives" => {
                let word = word(key, value)?;
                let known = DriveModel::WORDS.map(|(word, ..)| word);
                let found = DriveModel::WORDS.iter().find(|(known, ..)| *known == word);
                self.run.modelling.drives =
                    found.map(|(_, model, _)| *model).ok_or_else(|| unknown(key, word, &known))?;
            }
            "from_rest" => {
                self.start = match word(key, value)? {
                    "equilibrium" => Start::Equilibrium,
                    "undeformed" => Start::Undeformed,
                    other => return Err(unknown(key, other, &["equilibrium", "undeformed"])),
                };
            }
            "reference_method" => {
                self.settings.reference.method = match word(key, value)? {
                    "bdf" => ReferenceMethod::Bdf,
                    "esdirk34" => ReferenceMethod::Esdirk34,
                    "tsit45" => ReferenceMethod::Tsit45,
                    other => return Err(unknown(key, other, &["bdf", "esdirk34", "tsit45"])),
                };
            }
            _ => return Err(format!("there is no option {key:?}; options are {}", KEYS.join(", "))),
        }
        Ok(())
    }
}

fn number(key: &str, value: &ParameterValue) -> Result<f64, String> {
    value.number().ok_or_else(|| format!("options.{key} = {value}: expected a number"))
}

fn count(key: &str, value: &ParameterValue, least: usize) -> Result<usize, String> {
    let whole = value.number().filter(|x| x.fract() == 0.0 && (least as f64..=1e4).contains(x));
    whole.map(|x| x as usize).ok_or_else(|| format!("options.{key} = {value}: expected a whole number from {least}"))
}

fn truth(key: &str, value: &ParameterValue) -> Result<bool, String> {
    match value {
        ParameterValue::Truth(truth) => Ok(*truth),
        _ => Err(format!("options.{key} = {value}: expected true or false")),
    }
}

fn word<'a>(key: &str, value: &'a ParameterValue) -> Result<&'a str, String> {
    match value {
        ParameterValue::Text(word) => Ok(word),
        _ => Err(format!("options.{key} = {value}: expected a string")),
    }
}

fn unknown(key: &str, word: &str, known: &[&str]) -> String {
    format!("options.{key} = {word:?} is not known; use {}", known.join(", "))
}
