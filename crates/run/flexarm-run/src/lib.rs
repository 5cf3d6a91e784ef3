//! From a robot file to a robot, an arm and a run.
//!
//! ```
//! use flexarm_run::{Modelling, Motion, Robot, RunOptions};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let robot = Robot::load("robots/kr210")?;
//! let motion = Motion::load("trajectories/point_to_point.toml", &robot)?;
//! let run = robot.model(&Modelling::default())?.simulate(&motion, &RunOptions::default())?;
//! println!("{}", run.summary.headline);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Robot::load`] reads, [`Robot::model`] models links and drives, [`Arm::simulate`] runs a
//! [`Motion`] or a [`Scenario`]. [`Arm::statics`], [`Arm::modes`] and [`Arm::response`] compute
//! results at one pose, [`Arm::operating_point`] at many; [`mod@reduce`] converts a mesh to a flexible link.
//! The study crates build on this crate; the crate `flexarm` re-exports all of them.
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

mod arm;
mod body_change;
pub mod caveat;
mod check;
mod error;
mod motions;
mod poses;
mod ranges;
pub mod reduce;
mod report;
pub mod robot;
mod robot_export;
pub mod run;

pub use arm::bends::Bend;
pub use arm::deflections::Variation;
pub use arm::live::{
    Command, ElasticCoordinate, EquationCommand, Equations, Live, LiveOptions, LiveState, Readings, Servos,
};
pub use arm::operating_points::OperatingPoints;
pub use arm::options::{DriveModel, LinkModel, Modelling, Outputs, RunOptions};
pub use arm::recursions::Recursions;
pub use arm::{Arm, Owner};
pub use caveat::{Finding, Severity};
pub use check::{check, check_with_loads, check_with_motion};
pub use error::{Error, ExternalError, Fault, RecordingError};
pub use flexarm_linkmaker::Stopwatch;
pub use motions::applied_load::AppliedLoad;
pub use motions::motion::{HeldJoint, Motion};
pub use motions::motion_formats::MotionOptions;
pub use motions::motion_report::{MotionCurve, MotionFiles, MotionPeak, MotionReport, MotionViolation, motion_report};
pub use motions::payload::PayloadChange;
pub use motions::scenario::{Disturbances, Scenario};
pub use motions::tool_path::ToolPath;
pub use motions::{applied_load, loads_file, motion, motion_report, tool_path};
pub use poses::inspect::{CouplingInfo, FlexibleInfo, Inspection, JointInfo, LinkInfo, MountingInfo, TcpInfo, inspect};
pub use poses::mode_recording::ModeMovie;
pub use poses::modes::{ModeFigures, ModeTable};
pub use poses::response::{
    PeakFigures, Response, ResponseCurve, ResponseFiles, ResponseOutputs, ResponseRequest, readable_unit,
};
pub use poses::statics::{ElementStatics, Statics};
pub use poses::statics_picture::{StaticsFiles, StaticsOutputs};
pub use poses::{inspect, posed, response};
pub use report::convert::{ConvertOptions, ConvertSummary, convert, convert_until, parse_recording_format, read_run};
pub use report::html_page;
pub use report::{
    Figure, FigureGroup, ReportFiles, ReportOptions, ReportRun, Weight, figure_groups, html, markdown, report, rows,
    stress_figures,
};
pub use robot::balancer::{BalancerEnds, BalancerInfo, RobotBalancer};
pub use robot::calibration_entry::Calibration;
pub use robot::drive_entry::{Drive, DriveKind};
pub use robot::gauge_entry::Gauge;
pub use robot::gear_entry::{GearHysteresis, RobotCoupling};
pub use robot::guide_entry::GuideTilt;
pub use robot::loops::{DependentInfo, LoopInfo, RobotLoop};
pub use robot::mounting::RobotMounting;
pub use robot::robot_file::RobotFileError;
pub use robot::robot_link::{LinkChoices, RobotLink, StressSource};
pub use robot::strength::Strength;
pub use robot::{Description, LoadOptions, Robot, RobotSource, TCP_FRAME};
pub use robot::{balancer, file_cache, loops, robot_file, toml_file};
pub use robot_export::{RobotExport, RobotFormat};
pub use run::comparison::{STUDY_NOTE, study_rows};
pub use run::headline::{Bending, ShareFigures};
pub use run::monitor::tool_path::{PathFigures, PathMoveFigures};
pub use run::settling::Settling;
pub use run::stepper_settings::{SettingValue, StepperSettings};
pub use run::study::{Variant, compare_study};
pub use run::summary::{
    CURVE_PIECES, DifferenceFigures, Files, HoldFigures, LinkFigures, LinkStressFigures, PoseFigures, RecordingFiles,
    SectionForceFigures, StepperFigures, StrainGaugeFigures, StressPlaceFigures, StressPointFigures, Summary,
    TcpFigures,
};
pub use run::{Keep, Progress, Run, RunRequest, SampleObserver};
pub use run::{magnification, prepare, record, summary};

/// Kernels that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::caveat::kinds::{EFFORT, FEW_SAMPLES};
    pub use crate::motions::tool_path::{Standard, Step};
    pub use crate::poses::mode_recording::describe_modes;
    pub use crate::report::{short, thinned};
    pub use crate::run::headline::rounded;
    pub use crate::run::monitor::deflection::Deflections;
    pub use crate::run::monitor::drive_load::{DriveLoad, DriveLoads};
    pub use crate::run::monitor::energy::Energy;
    pub use crate::run::monitor::strain::{LinkStrain, Strains};
    pub use crate::run::monitor::stress::signed_von_mises;
    pub use crate::run::monitor::tool::{ToolError, ToolMonitor};
    pub use crate::run::monitor::tool_path::ToolPathMonitor;
}
