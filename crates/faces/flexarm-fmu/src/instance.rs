//! An instance of an FMU: a plant with the phases of the standard, one text for both versions.

use std::path::Path;

use crate::archive::open_resources;
use crate::error::PlantError;
use crate::plant::{Plant, PlantState};

/// Phase of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Instantiated,
    Initialisation,
    Step,
    Terminated,
    /// A step failed.
    Failed,
}

impl Phase {
    fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "before the initialisation",
            Self::Initialisation => "during the initialisation",
            Self::Step => "between steps",
            Self::Terminated => "after the end",
            Self::Failed => "after a step that failed; reset the instance",
        }
    }
}

/// An instance.
pub(crate) struct Instance {
    plant: Plant,
    phase: Phase,
    begin_s: f64,
}

/// State of an instance.
pub(crate) struct InstanceState {
    phase: Phase,
    begin_s: f64,
    /// `None` before the start.
    plant: Option<PlantState>,
    values: Vec<f64>,
}

impl Instance {
    /// Makes an instance of the resources of an FMU.
    pub(crate) fn new(resources: &Path, token: &str) -> Result<Self, PlantError> {
        Ok(Self { plant: open_resources(resources, token)?, phase: Phase::Instantiated, begin_s: 0.0 })
    }

    fn expect(&self, function: &'static str, phases: &[Phase]) -> Result<(), PlantError> {
        match phases.contains(&self.phase) {
            true => Ok(()),
            false => Err(PlantError::Order { function, phase: self.phase.name() }),
        }
    }

    /// Sets the start time (s); FMI 2.0 does so on its own.
    pub(crate) fn set_begin(&mut self, begin_s: f64) -> Result<(), PlantError> {
        self.expect("the setup of the experiment", &[Phase::Instantiated])?;
        self.begin_s = begin_s;
        Ok(())
    }

    pub(crate) fn enter_initialisation(&mut self) -> Result<(), PlantError> {
        self.expect("the start of the initialisation", &[Phase::Instantiated])?;
        self.phase = Phase::Initialisation;
        Ok(())
    }

    pub(crate) fn exit_initialisation(&mut self) -> Result<(), PlantError> {
        self.expect("the end of the initialisation", &[Phase::Initialisation])?;
        self.plant.start(self.begin_s)?;
        self.phase = Phase::Step;
        Ok(())
    }

    pub(crate) fn step(&mut self, from_s: f64, length_s: f64) -> Result<(), PlantError> {
        self.expect("a step", &[Phase::Step])?;
        let done = self.plant.step(from_s, length_s);
        // A wrong call leaves the arm as it was.
        let kept = matches!(done, Ok(()) | Err(PlantError::Time { .. } | PlantError::Length(_)));
        if !kept && !matches!(&done, Err(PlantError::Robot(flexarm::Error::Value(_)))) {
            self.phase = Phase::Failed;
        }
        done
    }

    pub(crate) fn terminate(&mut self) -> Result<(), PlantError> {
        self.expect("the end", &[Phase::Step, Phase::Failed])?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    pub(crate) fn reset(&mut self) {
        self.plant.reset();
        (self.phase, self.begin_s) = (Phase::Instantiated, 0.0);
    }

    /// Returns the time (s).
    pub(crate) fn time_s(&self) -> f64 {
        self.plant.time_s()
    }

    pub(crate) fn get(&mut self, reference: u32) -> Result<f64, PlantError> {
        self.initial_outputs()?;
        self.plant.get(reference as usize)
    }

    pub(crate) fn get_flag(&mut self, reference: u32) -> Result<bool, PlantError> {
        self.plant.get_flag(reference as usize)
    }

    pub(crate) fn set(&mut self, reference: u32, value: f64) -> Result<(), PlantError> {
        self.expect("a setter", &[Phase::Instantiated, Phase::Initialisation, Phase::Step])?;
        self.plant.set(reference as usize, value)
    }

    pub(crate) fn set_flag(&mut self, reference: u32, value: bool) -> Result<(), PlantError> {
        self.expect("a setter", &[Phase::Instantiated, Phase::Initialisation, Phase::Step])?;
        self.plant.set_flag(reference as usize, value)
    }

    /// Computes the outputs of the initialisation, where parameters and inputs may still change.
    fn initial_outputs(&mut self) -> Result<(), PlantError> {
        match self.phase {
            Phase::Initialisation => self.plant.preview(self.begin_s),
            _ => Ok(()),
        }
    }

    pub(crate) fn state(&self) -> Result<InstanceState, PlantError> {
        let plant = self.plant.is_started().then(|| self.plant.state()).transpose()?;
        Ok(InstanceState { phase: self.phase, begin_s: self.begin_s, plant, values: self.plant.values().to_vec() })
    }

    pub(crate) fn restore(&mut self, state: &InstanceState) -> Result<(), PlantError> {
        match &state.plant {
            Some(plant) => self.plant.restore(plant)?,
            None => self.plant.return_to(&state.values),
        }
        (self.phase, self.begin_s) = (state.phase, state.begin_s);
        Ok(())
    }
}
