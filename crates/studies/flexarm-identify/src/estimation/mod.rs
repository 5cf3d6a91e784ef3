//! Parameters of flexible arms from measurements, with their uncertainties.
//!
//! A [`Plant`] is an arm as it is known, [`Parameter`]s say what of it is unknown, [`Measurements`]
//! what was read at the robot. [`MeasuredArm`] puts them together; [`identify`] finds the
//! parameters, says which of them the readings tell and how well, and which readings argue against
//! the model. [`plan`] chooses poses and loads that are worth measuring. Derivatives are in closed
//! form ([`tool_slopes`], [`compliance_slopes`], [`frequency_slopes`], [`structure_slopes`], and
//! [`error_slopes`] along a motion).
//!
//! Not here: files, units, robots by name (the facade).

mod coupled_gears;
mod encoders;
mod identify;
mod least_squares;
mod measurement;
mod parameter;
mod plan;
mod reading;
mod response;
mod sensitivity;
mod slips;
mod trajectory;

pub use coupled_gears::{CoupledOutput, coupled_gear_stiffness};
pub use encoders::{GearEstimate, GearRun, gear_stiffness};
pub use identify::{Found, HeldOut, Identified, IdentifyError, IdentifyOptions, identify};
pub use least_squares::{Loss, Residuals, Search, Solution, SolveError, solve};
pub use measurement::{MeasuredArm, NoAnswer};
pub use parameter::{Effect, Parameter, Place, Plant};
pub use plan::{Candidate, Plan, PlanOptions, plan};
pub use reading::{
    Component, Form, Instrument, LoadCase, MeasuredResponse, MeasuredShape, Measurements, Reading, ReadingKind, Row,
    Target,
};
pub use response::{Answer, Probe, ResponseSlopes, Structure, StructureSlopes, structure_slopes};
pub use sensitivity::{FrequencySlopes, compliance_slopes, frequency_slopes, tool_slopes};
pub use slips::{FoundSlip, Slip, likely_slip};
pub use trajectory::{RunParameter, error_slopes};
