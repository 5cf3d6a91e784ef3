//! An instance of an FMU: a plant with the phases of the standard, one text for both versions.
//!
//! Each function of FMI checks its phase and calls [`FmuModel`]; a function out of order is refused
//! and changes nothing. Not here: pointers and status codes (`ffi`), the arm (`model.rs`).

use std::path::Path;

use crate::archive::open_resources;
use crate::error::FmuError;
use crate::model::{FmuModel, FmuState};

/// Phase of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Instantiated,
    Initialisation,
    /// Co-simulation.
    Step,
    /// Model exchange, at an event.
    Event,
    /// Model exchange, while the importer integrates.
    Continuous,
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
            Self::Event => "in event mode",
            Self::Continuous => "in continuous-time mode",
            Self::Terminated => "after the end",
            Self::Failed => "after a step that failed; reset the instance",
        }
    }
}

/// Kind of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interface {
    CoSimulation,
    ModelExchange,
}

/// Phases in which a model exchange has states.
const EXCHANGE: [Phase; 2] = [Phase::Event, Phase::Continuous];

/// Phases in which parameters or inputs are set.
const SETTABLE: [Phase; 5] = [Phase::Instantiated, Phase::Initialisation, Phase::Step, Phase::Event, Phase::Continuous];

/// Values of continuous states that an importer reads.
#[derive(Clone, Copy, Debug)]
pub(crate) enum StateValues {
    States,
    Derivatives,
    Nominals,
}

/// An instance.
pub(crate) struct Instance {
    model: FmuModel,
    interface: Interface,
    phase: Phase,
    begin_s: f64,
}

/// State of an instance.
pub(crate) struct InstanceState {
    phase: Phase,
    begin_s: f64,
    /// `None` before the start.
    model: Option<FmuState>,
    values: Vec<f64>,
}

impl Instance {
    /// Makes an instance of the resources of an FMU.
    pub(crate) fn new(resources: &Path, token: &str, interface: Interface) -> Result<Self, FmuError> {
        let model = open_resources(resources, token)?;
        if interface == Interface::ModelExchange && !model.has_equations() {
            return Err(FmuError::NoEquations);
        }
        Ok(Self { model, interface, phase: Phase::Instantiated, begin_s: 0.0 })
    }

    fn expect(&self, function: &'static str, phases: &[Phase]) -> Result<(), FmuError> {
        match phases.contains(&self.phase) {
            true => Ok(()),
            false => Err(FmuError::Order { function, phase: self.phase.name() }),
        }
    }

    /// Sets the start time (s); FMI 2.0 does so on its own.
    pub(crate) fn set_begin(&mut self, begin_s: f64) -> Result<(), FmuError> {
        self.expect("the setup of the experiment", &[Phase::Instantiated])?;
        self.begin_s = begin_s;
        Ok(())
    }

    pub(crate) fn enter_initialisation(&mut self) -> Result<(), FmuError> {
        self.expect("the start of the initialisation", &[Phase::Instantiated])?;
        self.phase = Phase::Initialisation;
        Ok(())
    }

    pub(crate) fn exit_initialisation(&mut self) -> Result<(), FmuError> {
        self.expect("the end of the initialisation", &[Phase::Initialisation])?;
        match self.interface {
            Interface::CoSimulation => self.model.start(self.begin_s)?,
            Interface::ModelExchange => self.model.start_equations(self.begin_s)?,
        }
        self.phase = if self.interface == Interface::CoSimulation { Phase::Step } else { Phase::Event };
        Ok(())
    }

    pub(crate) fn enter_event_mode(&mut self) -> Result<(), FmuError> {
        self.expect("event mode", &EXCHANGE)?;
        self.phase = Phase::Event;
        Ok(())
    }

    pub(crate) fn enter_continuous_time_mode(&mut self) -> Result<(), FmuError> {
        self.expect("continuous-time mode", &EXCHANGE)?;
        self.phase = Phase::Continuous;
        Ok(())
    }

    /// Checks that an event is handled now; none changes the state.
    pub(crate) fn update_discrete_states(&mut self) -> Result<(), FmuError> {
        self.expect("an update of discrete states", &[Phase::Event])
    }

    /// Checks that the importer integrates; the end of its step changes nothing.
    pub(crate) fn complete_step(&mut self) -> Result<(), FmuError> {
        self.expect("the end of a step of the importer", &[Phase::Continuous])
    }

    pub(crate) fn set_time(&mut self, time_s: f64) -> Result<(), FmuError> {
        self.expect("the time", &EXCHANGE)?;
        self.model.set_time(time_s)
    }

    pub(crate) fn set_states(&mut self, states: &[f64]) -> Result<(), FmuError> {
        self.expect("setting states", &EXCHANGE)?;
        self.model.set_states(states)
    }

    /// Writes values of all continuous states.
    pub(crate) fn write_states(&mut self, what: StateValues, to: &mut [f64]) -> Result<(), FmuError> {
        let phases = [Phase::Initialisation, Phase::Event, Phase::Continuous];
        self.expect("reading states", &phases)?;
        FmuError::check_length("continuous states", to.len(), self.n_states())?;
        self.current_outputs()?;
        let values = match what {
            StateValues::States => self.model.states(),
            StateValues::Derivatives => self.model.derivatives()?,
            StateValues::Nominals => self.model.nominals(),
        };
        to.copy_from_slice(&values);
        Ok(())
    }

    pub(crate) fn n_states(&self) -> usize {
        self.model.state_references().len()
    }

    pub(crate) fn directional_derivative(
        &mut self,
        [unknowns, knowns]: [&[u32]; 2],
        seed: &[f64],
        to: &mut [f64],
    ) -> Result<(), FmuError> {
        self.expect("a directional derivative", &EXCHANGE)?;
        FmuError::check_length("directional derivative", to.len(), unknowns.len())?;
        let [unknowns, knowns] = [unknowns, knowns].map(|own| own.iter().map(|k| *k as usize).collect::<Vec<_>>());
        to.copy_from_slice(&self.model.directional_derivative(&unknowns, &knowns, seed)?);
        Ok(())
    }

    pub(crate) fn step(&mut self, from_s: f64, length_s: f64) -> Result<(), FmuError> {
        self.expect("a step", &[Phase::Step])?;
        let done = self.model.step(from_s, length_s);
        // A wrong call leaves the arm as it was.
        let kept = matches!(done, Ok(()) | Err(FmuError::Step(_)));
        if !kept && !matches!(&done, Err(FmuError::Robot(flexarm::Error::Value(_)))) {
            self.phase = Phase::Failed;
        }
        done
    }

    pub(crate) fn terminate(&mut self) -> Result<(), FmuError> {
        self.expect("the end", &[Phase::Step, Phase::Event, Phase::Continuous, Phase::Failed])?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    pub(crate) fn reset(&mut self) {
        self.model.reset();
        (self.phase, self.begin_s) = (Phase::Instantiated, 0.0);
    }

    /// Returns the time (s).
    pub(crate) fn time_s(&self) -> f64 {
        self.model.time_s()
    }

    pub(crate) fn get(&mut self, reference: u32) -> Result<f64, FmuError> {
        self.current_outputs()?;
        self.model.get(reference as usize)
    }

    pub(crate) fn get_flag(&mut self, reference: u32) -> Result<bool, FmuError> {
        self.model.get_flag(reference as usize)
    }

    pub(crate) fn set(&mut self, reference: u32, value: f64) -> Result<(), FmuError> {
        self.expect("a setter", &SETTABLE)?;
        self.model.set(reference as usize, value)
    }

    pub(crate) fn set_flag(&mut self, reference: u32, value: bool) -> Result<(), FmuError> {
        self.expect("a setter", &SETTABLE)?;
        self.model.set_flag(reference as usize, value)
    }

    /// Computes the outputs of the initialisation, where parameters and inputs may still change,
    /// and those of model exchange.
    fn current_outputs(&mut self) -> Result<(), FmuError> {
        match self.phase {
            Phase::Initialisation => self.model.preview(self.begin_s),
            _ => self.model.evaluate(),
        }
    }

    pub(crate) fn state(&self) -> Result<InstanceState, FmuError> {
        let model = self.model.is_started().then(|| self.model.state()).transpose()?;
        Ok(InstanceState { phase: self.phase, begin_s: self.begin_s, model, values: self.model.values.clone() })
    }

    pub(crate) fn restore(&mut self, state: &InstanceState) -> Result<(), FmuError> {
        match &state.model {
            Some(model) => self.model.restore(model)?,
            None => self.model.return_to(&state.values),
        }
        (self.phase, self.begin_s) = (state.phase, state.begin_s);
        Ok(())
    }
}
