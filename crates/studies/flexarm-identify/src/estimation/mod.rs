//! Parameters of flexible arms estimated from measurements, with their uncertainties.
//!
//! A [`NominalArm`] is the nominal arm, [`Parameter`]s are its unknowns, and [`Measurements`] the
//! readings taken at the robot. [`MeasuredArm`] combines them; [`identify`] estimates the
//! parameters with their uncertainties, and reports which of them the readings determine and which
//! readings contradict the model. [`plan`] chooses poses and loads to measure. Derivatives are in
//! closed form ([`tool_slopes`], [`compliance_slopes`], [`frequency_slopes`],
//! [`structure_slopes`]).
//!
//! Not here: files, units, robots by name (the crate root).

pub(crate) mod bounded;
mod encoders;
mod identified;
pub(crate) mod identify;
pub(crate) mod least_squares;
mod measurement;
pub(crate) mod parameter;
pub(crate) mod placement;
mod plan;
mod reading;
mod response;
mod sensitivity;
mod slips;

pub use encoders::{GearEstimate, GearOutput, gear_stiffness};
pub use identified::{FittedParameter, HeldOut, Identified, IdentifyError, ModelError};
pub use identify::{IdentifyOptions, identify};
pub use least_squares::{Loss, Noise, Progress, Residuals, Search, Solution, SolveError, Unknown, solve};
pub use measurement::{MeasuredArm, NoAnswer};
pub use parameter::{Effect, LinkPart, NominalArm, Parameter, SpringPart};
pub use plan::{Plan, PlanOptions, plan};
pub use reading::{
    Component, Form, Instrument, LoadCase, MeasuredResponse, MeasuredShape, Measurements, Reading, ReadingKind, Row,
    Target,
};
pub use response::{Answer, Probe, ResponseSlopes, Structure, StructureSlopes, structure_slopes};
pub use sensitivity::{FrequencySlopes, compliance_slopes, frequency_slopes, tool_slopes};
pub use slips::{FoundSlip, Slip, likely_slip};
