//! Options of the runs of a study, with the names of `flexarm compare`, `_` in place of `-`.
//!
//! A key of `flexarm compare` that a study may set or vary has its case in `StudyOptions::set`.

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
    /// Message for an unknown option or a value of the wrong type.
    pub(super) fn set(&mut self, key: &str, value: &ParameterValue) -> Result<(), String> {
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
                let known = || STEPPERS.iter().map(|entry| entry.name).collect::<Vec<_>>();
                self.stepper = StepperEntry::named(word).ok_or_else(|| unknown_word(key, word, &known()))?;
            }
            "links" => self.modelling.links = choice(key, value)?,
            "drives" => self.modelling.drives = choice(key, value)?,
            "from_rest" => self.start = choice(key, value)?,
            "reference_method" => self.settings.reference.method = choice(key, value)?,
            _ => return Err(format!("there is no option {key:?}; options are {}", KEYS.join(", "))),
        }
        Ok(())
    }
}

fn number(key: &str, value: &ParameterValue) -> Result<f64, String> {
    value.number().ok_or_else(|| wrong_type(key, value, "a number"))
}

fn count(key: &str, value: &ParameterValue, least: usize) -> Result<usize, String> {
    let whole = value.number().filter(|x| x.fract() == 0.0 && (least as f64..=1e4).contains(x));
    let fail = || wrong_type(key, value, &format!("a whole number from {least}"));
    whole.map(|x| x as usize).ok_or_else(fail)
}

fn truth(key: &str, value: &ParameterValue) -> Result<bool, String> {
    match value {
        ParameterValue::Truth(truth) => Ok(*truth),
        _ => Err(wrong_type(key, value, "true or false")),
    }
}

fn word<'a>(key: &str, value: &'a ParameterValue) -> Result<&'a str, String> {
    match value {
        ParameterValue::Text(word) => Ok(word),
        _ => Err(wrong_type(key, value, "a string")),
    }
}

/// Reads a choice by its word.
fn choice<T: Words>(key: &str, value: &ParameterValue) -> Result<T, String> {
    let word = word(key, value)?;
    T::from_word(word).ok_or_else(|| unknown_word(key, word, &T::known()))
}

fn wrong_type(key: &str, value: &ParameterValue, expected: &str) -> String {
    format!("options.{key} = {value}: expected {expected}")
}

fn unknown_word(key: &str, word: &str, known: &[&str]) -> String {
    format!("options.{key} = {word:?} is not known; use {}", known.join(", "))
}
