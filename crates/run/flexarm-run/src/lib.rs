//! A described robot becomes an arm, a motion becomes a run.
//!
//! ```no_run
//! use flexarm_run::{Modelling, Motion, Robot, RunOptions, Wrench};
//!
//! let robot = Robot::load("robots/kr210")?;
//! let motion = Motion::load("trajectories/pick_and_place.toml", &robot)?;
//! let arm = robot.flexible(Modelling::default())?; // substitution once
//! let run = arm.simulate(&motion, &RunOptions::default())?;
//! let (t, e) = (run.time_s(), run.error_world_m()); // n, and n x 3, row after row
//! println!("{} samples, first error {:?} m", t.len(), &e[..3]);
//!
//! let mut at = arm.operating_point()?; // a workspace
//! at.solve(&[0.0, -1.2, 1.5, 0.0, 0.4, 0.0], &Wrench::zeros())?;
//! println!("{} m/N down, {} Hz", at.compliance()[(2, 2)], at.frequencies_hz()[0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Build is apart from query: [`Robot::load`] reads, [`Robot::flexible`] puts links and drives in place, and the [`Arm`] that it
//! returns is asked with numbers, by any number of threads. [`Arm::simulate`] runs a [`Motion`], or a [`Scenario`] with loads and
//! payloads besides, and returns a [`Run`] with figures and columns; [`Arm::operating_point`] answers statics, compliance and
//! frequencies at thousands of poses without allocation.
//!
//! [`Arm::simulate_with`] writes recordings and a report as well. [`inspect()`] and [`check()`] look at what was loaded; [`statics()`],
//! [`modes()`] and [`response()`] answer one pose in full; [`mod@reduce`] makes a flexible link of a mesh.
//!
//! Examples, in rising order (`cargo run --release -p flexarm --no-default-features --example NAME`):
//!
//! | name | what it shows |
//! | --- | --- |
//! | `five_lines` | load, run, print |
//! | `operating_points` | an arm shared by threads, a workspace each: compliance and frequency at 10,000 poses |
//! | `stop_at_rest` | an observer that looks at every sample and ends the run |
//! | `servo_study` | a study: gains of the servos against settling time and overshoot |
//! | `study_report` | link models compared on one page for the browser |
//! | `sensitivity` | which number of the robot the error depends on most |
//! | `link_models` | every link model against a reference: accuracy and cost |
//!
//! What goes wrong is an [`Error`] by cause with its numbers, what is doubtful a [`Caveat`]. Both carry settings that mend them
//! as values ([`Setting`]); a face with names of its own for them gives these once ([`name_settings`]).
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

pub mod applied_load;
mod arm;
pub mod balancer;
mod balancer_entry;
mod beam_entry;
mod bends;
pub mod caveat;
mod check;
mod controller_entry;
mod convert;
mod deflections;
mod drive_entry;
mod error;
pub mod file_cache;
mod flexible;
mod gear_entry;
mod headline;
pub mod html_page;
pub mod inspect;
mod link_entry;
mod live;
mod load_jumps;
pub mod loads_file;
mod loop_entry;
pub mod loops;
pub mod magnification;
mod mode_recording;
mod modes;
mod monitor;
pub mod motion;
mod motion_formats;
pub mod motion_report;
mod mounting;
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
pub mod robot_file;
pub mod run;
mod scenario;
mod servo_gains;
mod settling;
mod static_part;
mod statics;
mod statics_picture;
mod stepper_settings;
mod study;
pub mod summary;
pub mod toml_file;
pub mod tool_path;
mod twin;

pub use applied_load::AppliedLoad;
pub use arm::{Arm, Run};
pub use balancer::{BalancerEnds, BalancerInfo, RobotBalancer};
pub use bends::Bend;
pub use caveat::{Caveat, Severity};
pub use check::{Finding, check, check_with_loads, check_with_motion};
pub use convert::{ConvertOptions, ConvertSummary, convert, convert_until, parse_recording_format, read_run};
pub use deflections::Variation;
pub use drive_entry::{Drive, DriveKind};
pub use error::{
    BalancerError, ChannelError, Error, ExternalError, Fault, LoadError, LoopError, ModellingError, PayloadError,
    PoseError, RecordingError, StudyError, ValueError,
};
pub use flexible::{FlexibleRobot, LinkChoices, Owner, RobotLink};
pub use gear_entry::{GearHysteresis, RobotCoupling};
pub use headline::{Bending, ShareFigures};
pub use inspect::{CouplingInfo, FlexibleInfo, Inspection, JointInfo, LinkInfo, MountingInfo, TcpInfo, inspect};
pub use live::Live;
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
};
pub use response::{
    PeakFigures, Response, ResponseCurve, ResponseFiles, ResponseOutputs, ResponseRequest, readable_unit, response,
};
pub use robot::{LoadOptions, Robot, TCP_FRAME};
pub use robot_file::RobotFileError;
pub use run::{Keep, Progress, RunRequest, SampleObserver};
pub use scenario::{Disturbances, Scenario};
pub use settling::Settling;
pub use statics::{ElementStatics, Statics, record_statics, statics};
pub use statics_picture::{StaticsFiles, StaticsOutputs};
pub use stepper_settings::{SettingValue, StepperSettings};
pub use study::{STUDY_NOTE, Variant, compare_study, study_rows};
pub use summary::{
    CURVE_PIECES, DifferenceFigures, Files, HoldFigures, LinkFigures, PoseFigures, RecordingFiles, StepperFigures,
    Summary, TcpFigures,
};
pub use tool_path::ToolPath;

pub use flexarm_analysis::{Quantity, Spacing};
pub use flexarm_files::{FileError, writing_unless};
pub use flexarm_flexlink::Mounting;
pub use flexarm_kinematics::{
    BalancerCurve, BalancerCurveError, BalancerLaw, Coordinate, GasLaw, LinkInertia, Model, Pose, Wrench,
};
pub use flexarm_linkmaker::{ImportError, JobError, LinkError, export, import};
#[cfg(feature = "arrow")]
pub use flexarm_log::arrow_stream;
pub use flexarm_log::{
    Column, Columns, CurveQuantity, DataColumn, DataTable, DataValues, FormatInfo, Holds, RecordingFormat, Sample,
    Trace, flat_columns,
};
pub use flexarm_motion_io::MotionError;
pub use flexarm_path::{PathError, PlannedMove, Slowed, SlowedBy};
pub use flexarm_settings::{Names, Setting, gathered, name_settings, written};
pub use flexarm_stepping::{
    AlphaSettings, Asked, ConstraintForm, InertiaChange, Linear, Load, LoadAxes, OperatingPoint, PoseAnswer,
    ReferenceMethod, ReferenceSettings, STEPPERS, SpookPreset, SpookSettings, Start, StepError, StepRule, StepperEntry,
    StepperKind, StepperOptions, StepperSetting, TimedWrench, ToolDeflection,
};
pub use flexarm_trajectory::{ColumnMap, ColumnMapError, Trajectory, TrajectoryError};
pub use flexarm_urdf::{InertiaEstimate, ReadOptions, closest, search_paths_from_environment};
