//! Options of the runs of a study, with the names of `flexarm compare`, `_` in place of `-`.

use flexarm_settings::Words;
use flexarm_stepping::{STEPPERS, Start, StepperEntry, StepperOptions};

use super::value::ParameterValue;
use flexarm_run::{Modelling, RunOptions};

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

/// Reason why an option cannot be set.
#[derive(Debug, thiserror::Error)]
pub(super) enum OptionError {
    #[error("there is no option {key:?}; options are {}", KEYS.join(", "))]
    Unknown { key: String },
    #[error("options.{key} = {value}: expected {expected}")]
    Type { key: String, value: ParameterValue, expected: &'static str },
    #[error("options.{key} = {value}: expected a whole number from {least}")]
    NotWhole { key: String, value: ParameterValue, least: usize },
    #[error("options.{key} = {word:?} is not known; use {}", known.join(", "))]
    Word { key: String, word: String, known: Vec<&'static str> },
}

impl OptionError {
    fn of_type(key: &str, value: &ParameterValue, expected: &'static str) -> Self {
        Self::Type { key: key.to_owned(), value: value.clone(), expected }
    }

    fn of_word(key: &str, word: &str, known: Vec<&'static str>) -> Self {
        Self::Word { key: key.to_owned(), word: word.to_owned(), known }
    }
}

/// Options of time integration and evaluation of runs.
#[derive(Clone, Debug)]
pub(super) struct StudyOptions {
    stepper: &'static StepperEntry,
    /// Step size (s); the stepper's default if absent.
    step_s: Option<f64>,
    settings: StepperOptions,
    run: RunOptions,
    pub(super) modelling: Modelling,
    pub(super) start: Start,
    /// Duration over which corners of motions are rounded (s).
    pub(super) round_corners: Option<f64>,
}

impl Default for StudyOptions {
    fn default() -> Self {
        Self {
            stepper: STEPPERS[0],
            step_s: None,
            settings: StepperOptions::default(),
            run: RunOptions::default(),
            modelling: Modelling::default(),
            start: Start::default(),
            round_corners: None,
        }
    }
}

impl StudyOptions {
    /// Returns the options in the form for a run.
    pub(super) fn run(&self) -> RunOptions {
        let entry = self.stepper;
        let step_s = self.step_s.unwrap_or(entry.default_step_s);
        RunOptions { stepper: (entry.with)(&self.settings), step_s, ..self.run.clone() }
    }

    /// Sets an option.
    ///
    /// # Errors
    /// [`OptionError`] for an unknown option or a value of the wrong type.
    pub(super) fn set(&mut self, key: &str, value: &ParameterValue) -> Result<(), OptionError> {
        match key {
            "step" => self.step_s = Some(number(key, value)?),
            "log_rate" => self.run.log_rate_hz = number(key, value)?,
            "settling_band" => self.run.settling_band_m = number(key, value)?,
            "rho_inf" => self.settings.alpha.rho = number(key, value)?,
            "rtol" => self.settings.reference.rtol = number(key, value)?,
            "round_corners" => self.round_corners = Some(number(key, value)?),
            "segments" => self.modelling.segments = Some(count(key, value, 2)?),
            "modes" => self.modelling.modes = Some(count(key, value, 0)?),
            "ignore_limits" => self.run.ignore_limits = truth(key, value)?,
            "dispersion_correction" => self.settings.alpha.dispersion_correction = truth(key, value)?,
            "stepper" => {
                let word = word(key, value)?;
                let known = || STEPPERS.iter().map(|entry| entry.name).collect();
                self.stepper = StepperEntry::named(word).ok_or_else(|| OptionError::of_word(key, word, known()))?;
            }
            "links" => self.modelling.links = choice(key, value)?,
            "drives" => self.modelling.drives = choice(key, value)?,
            "from_rest" => self.start = choice(key, value)?,
            "reference_method" => self.settings.reference.method = choice(key, value)?,
            _ => return Err(OptionError::Unknown { key: key.to_owned() }),
        }
        Ok(())
    }
}

fn number(key: &str, value: &ParameterValue) -> Result<f64, OptionError> {
    value.number().ok_or_else(|| OptionError::of_type(key, value, "a number"))
}

fn count(key: &str, value: &ParameterValue, least: usize) -> Result<usize, OptionError> {
    let whole = value.number().filter(|x| x.fract() == 0.0 && (least as f64..=1e4).contains(x));
    let fail = || OptionError::NotWhole { key: key.to_owned(), value: value.clone(), least };
    whole.map(|x| x as usize).ok_or_else(fail)
}

fn truth(key: &str, value: &ParameterValue) -> Result<bool, OptionError> {
    match value {
        ParameterValue::Truth(truth) => Ok(*truth),
        _ => Err(OptionError::of_type(key, value, "true or false")),
    }
}

fn word<'a>(key: &str, value: &'a ParameterValue) -> Result<&'a str, OptionError> {
    match value {
        ParameterValue::Text(word) => Ok(word),
        _ => Err(OptionError::of_type(key, value, "a string")),
    }
}

/// Reads a choice by its word.
fn choice<T: Words>(key: &str, value: &ParameterValue) -> Result<T, OptionError> {
    let word = word(key, value)?;
    T::from_word(word).ok_or_else(|| OptionError::of_word(key, word, T::known()))
}
