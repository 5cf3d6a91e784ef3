//! From a robot file to a robot, an arm and a run.
//!
//! ```no_run
//! use flexarm_run::{Modelling, Motion, Robot, RunOptions};
//!
//! let robot = Robot::load("robots/kr210")?;
//! let motion = Motion::load("trajectories/pick_and_place.toml", &robot)?;
//! let run = robot.model(&Modelling::default())?.simulate(&motion, &RunOptions::default())?;
//! println!("{}", run.summary.headline);
//! # Ok::<(), flexarm_run::Error>(())
//! ```
//!
//! [`Robot::load`] reads, [`Robot::model`] models links and drives, [`Arm::simulate`] runs a
//! [`Motion`] or a [`Scenario`]. [`statics()`], [`modes()`] and [`response()`] compute results at
//! one pose, [`Arm::operating_point`] at many; [`mod@reduce`] converts a mesh to a flexible link.
//! The study crates build on this crate; the crate `flexarm` re-exports all of them.
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

pub mod applied_load;
mod arm;
pub mod balancer;
mod balancer_entry;
mod beam_entry;
mod bends;
mod body_change;
mod calibration_entry;
pub mod caveat;
mod check;
mod comparison;
mod controller_entry;
mod convert;
mod coupling_entry;
mod deflections;
mod drive_entry;
mod entry_checks;
mod error;
pub mod file_cache;
mod gauge_entry;
mod gear_entry;
mod gearbox_entry;
mod guide_entry;
mod headline;
pub mod html_page;
pub mod inspect;
mod joint_values;
mod link_entry;
mod live;
mod load_jumps;
pub mod loads_file;
mod loop_entry;
pub mod loops;
pub mod magnification;
mod mode_recording;
mod modelled;
mod modes;
mod monitor;
pub mod motion;
mod motion_formats;
pub mod motion_report;
mod mounting;
mod mounting_entry;
mod operating_points;
mod options;
mod payload;
pub mod posed;
pub mod prepare;
mod ranges;
pub mod record;
mod recursions;
pub mod reduce;
mod report;
pub mod response;
pub mod robot;
mod robot_export;
pub mod robot_file;
mod robot_link;
pub mod run;
mod scenario;
mod servo_gains;
mod settling;
mod static_part;
mod statics;
mod statics_picture;
mod stepper_settings;
mod strength;
mod study;
pub mod summary;
pub mod toml_file;
pub mod tool_path;
mod twin;

pub use applied_load::AppliedLoad;
pub use arm::{Arm, Owner};
pub use balancer::{BalancerEnds, BalancerInfo, RobotBalancer};
pub use bends::Bend;
pub use calibration_entry::Calibration;
pub use caveat::{Caveat, Severity};
pub use check::{Finding, check, check_with_loads, check_with_motion};
pub use comparison::{STUDY_NOTE, study_rows};
pub use convert::{ConvertOptions, ConvertSummary, convert, convert_until, parse_recording_format, read_run};
pub use deflections::Variation;
pub use drive_entry::{Drive, DriveKind};
pub use error::{
    BalancerError, ChannelError, Error, ExternalError, Fault, LinkFormError, LoadError, LoopError, ModellingError,
    PayloadError, PoseError, RecordingError, StudyError, ValueError,
};
pub use flexarm_linkmaker::Stopwatch;
pub use gauge_entry::Gauge;
pub use gear_entry::{GearHysteresis, RobotCoupling};
pub use guide_entry::GuideTilt;
pub use headline::{Bending, ShareFigures};
pub use inspect::{CouplingInfo, FlexibleInfo, Inspection, JointInfo, LinkInfo, MountingInfo, TcpInfo, inspect};
pub use live::{
    Command, ElasticCoordinate, EquationCommand, Equations, Live, LiveOptions, LiveState, Readings, Servos,
};
pub use loops::{DependentInfo, LoopInfo, RobotLoop};
pub use mode_recording::{ModeMovie, record_modes};
pub use modes::{ModeFigures, ModeTable, modes};
pub use monitor::tool_path::{PathFigures, PathMoveFigures};
pub use motion::{HeldJoint, Motion};
pub use motion_formats::MotionOptions;
pub use motion_report::{MotionCurve, MotionFiles, MotionPeak, MotionReport, MotionViolation, motion_report};
pub use mounting::RobotMounting;
pub use operating_points::OperatingPoints;
pub use options::{DriveModel, LinkModel, Modelling, Outputs, RunOptions};
pub use payload::PayloadChange;
pub use recursions::Recursions;
pub use report::{
    Figure, FigureGroup, ReportFiles, ReportOptions, ReportRun, Weight, figure_groups, html, markdown, report, rows,
    stress_figures,
};
pub use response::{
    PeakFigures, Response, ResponseCurve, ResponseFiles, ResponseOutputs, ResponseRequest, readable_unit, response,
};
pub use robot::{Description, LoadOptions, Robot, RobotSource, TCP_FRAME};
pub use robot_export::{RobotExport, RobotFormat};
pub use robot_file::RobotFileError;
pub use robot_link::{LinkChoices, RobotLink, StressSource};
pub use run::{Keep, Progress, Run, RunRequest, SampleObserver};
pub use scenario::{Disturbances, Scenario};
pub use settling::Settling;
pub use statics::{ElementStatics, Statics, record_statics, statics};
pub use statics_picture::{StaticsFiles, StaticsOutputs};
pub use stepper_settings::{SettingValue, StepperSettings};
pub use strength::Strength;
pub use study::{Variant, compare_study};
pub use summary::{
    CURVE_PIECES, DifferenceFigures, Files, HoldFigures, LinkFigures, LinkStressFigures, PoseFigures, RecordingFiles,
    SectionForceFigures, StepperFigures, StrainGaugeFigures, StressPlaceFigures, StressPointFigures, Summary,
    TcpFigures,
};
pub use tool_path::ToolPath;

/// Kernels that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::caveat::kinds::{EFFORT, FEW_SAMPLES};
    pub use crate::headline::rounded;
    pub use crate::mode_recording::describe_modes;
    pub use crate::monitor::deflection::Deflections;
    pub use crate::monitor::drive_load::{DriveLoad, DriveLoads};
    pub use crate::monitor::energy::Energy;
    pub use crate::monitor::strain::{LinkStrain, Strains};
    pub use crate::monitor::stress::signed_von_mises;
    pub use crate::monitor::tool::{ToolError, ToolMonitor};
    pub use crate::monitor::tool_path::ToolPathMonitor;
    pub use crate::report::{short, thinned};
    pub use crate::tool_path::{Standard, Step};
}
