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
    plant: Plant,
    interface: Interface,
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
    pub(crate) fn new(resources: &Path, token: &str, interface: Interface) -> Result<Self, PlantError> {
        let plant = open_resources(resources, token)?;
        if interface == Interface::ModelExchange && !plant.has_equations() {
            return Err(PlantError::NoEquations);
        }
        Ok(Self { plant, interface, phase: Phase::Instantiated, begin_s: 0.0 })
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
        match self.interface {
            Interface::CoSimulation => self.plant.start(self.begin_s)?,
            Interface::ModelExchange => self.plant.start_equations(self.begin_s)?,
        }
        self.phase = if self.interface == Interface::CoSimulation { Phase::Step } else { Phase::Event };
        Ok(())
    }

    pub(crate) fn enter_event_mode(&mut self) -> Result<(), PlantError> {
        self.expect("event mode", &EXCHANGE)?;
        self.phase = Phase::Event;
        Ok(())
    }

    pub(crate) fn enter_continuous_time_mode(&mut self) -> Result<(), PlantError> {
        self.expect("continuous-time mode", &EXCHANGE)?;
        self.phase = Phase::Continuous;
        Ok(())
    }

    /// Checks that an event is handled now; none changes the state.
    pub(crate) fn update_discrete_states(&mut self) -> Result<(), PlantError> {
        self.expect("an update of discrete states", &[Phase::Event])
    }

    /// Checks that the importer integrates; the end of its step changes nothing.
    pub(crate) fn complete_step(&mut self) -> Result<(), PlantError> {
        self.expect("the end of a step of the importer", &[Phase::Continuous])
    }

    pub(crate) fn set_time(&mut self, time_s: f64) -> Result<(), PlantError> {
        self.expect("the time", &EXCHANGE)?;
        self.plant.set_time(time_s)
    }

    pub(crate) fn set_states(&mut self, states: &[f64]) -> Result<(), PlantError> {
        self.expect("setting states", &EXCHANGE)?;
        self.check_count(states.len())?;
        self.plant.set_states(states)
    }

    /// Writes values of all continuous states.
    pub(crate) fn write_states(&mut self, what: StateValues, to: &mut [f64]) -> Result<(), PlantError> {
        let phases = [Phase::Initialisation, Phase::Event, Phase::Continuous];
        self.expect("reading states", &phases)?;
        self.check_count(to.len())?;
        self.current_outputs()?;
        let values = match what {
            StateValues::States => self.plant.states(),
            StateValues::Derivatives => self.plant.derivatives()?,
            StateValues::Nominals => self.plant.nominals(),
        };
        to.copy_from_slice(&values);
        Ok(())
    }

    fn check_count(&self, count: usize) -> Result<(), PlantError> {
        match count == self.n_states() {
            true => Ok(()),
            false => {
                Err(PlantError::Order { function: "a function of states", phase: "with another number of states" })
            }
        }
    }

    pub(crate) fn n_states(&self) -> usize {
        self.plant.state_references().len()
    }

    pub(crate) fn directional_derivative(
        &mut self,
        [unknowns, knowns]: [&[u32]; 2],
        seed: &[f64],
        to: &mut [f64],
    ) -> Result<(), PlantError> {
        self.expect("a directional derivative", &EXCHANGE)?;
        if seed.len() != knowns.len() || to.len() != unknowns.len() {
            return Err(PlantError::Order { function: "a directional derivative", phase: "with other lengths" });
        }
        let [unknowns, knowns] = [unknowns, knowns].map(|own| own.iter().map(|k| *k as usize).collect::<Vec<_>>());
        to.copy_from_slice(&self.plant.directional_derivative(&unknowns, &knowns, seed)?);
        Ok(())
    }

    pub(crate) fn step(&mut self, from_s: f64, length_s: f64) -> Result<(), PlantError> {
        self.expect("a step", &[Phase::Step])?;
        let done = self.plant.step(from_s, length_s);
        // A wrong call leaves the arm as it was.
        let kept =
            matches!(done, Ok(()) | Err(PlantError::Time { .. } | PlantError::Length(_) | PlantError::Short { .. }));
        if !kept && !matches!(&done, Err(PlantError::Robot(flexarm::Error::Value(_)))) {
            self.phase = Phase::Failed;
        }
        done
    }

    pub(crate) fn terminate(&mut self) -> Result<(), PlantError> {
        self.expect("the end", &[Phase::Step, Phase::Event, Phase::Continuous, Phase::Failed])?;
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
        self.current_outputs()?;
        self.plant.get(reference as usize)
    }

    pub(crate) fn get_flag(&mut self, reference: u32) -> Result<bool, PlantError> {
        self.plant.get_flag(reference as usize)
    }

    pub(crate) fn set(&mut self, reference: u32, value: f64) -> Result<(), PlantError> {
        self.expect("a setter", &SETTABLE)?;
        self.plant.set(reference as usize, value)
    }

    pub(crate) fn set_flag(&mut self, reference: u32, value: bool) -> Result<(), PlantError> {
        self.expect("a setter", &SETTABLE)?;
        self.plant.set_flag(reference as usize, value)
    }

    /// Computes the outputs of the initialisation, where parameters and inputs may still change,
    /// and those of model exchange.
    fn current_outputs(&mut self) -> Result<(), PlantError> {
        match self.phase {
            Phase::Initialisation => self.plant.preview(self.begin_s),
            _ => self.plant.evaluate(),
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
