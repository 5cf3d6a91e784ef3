//! Facade of the flexarm workspace: from a robot file and a trajectory to a result.
//!
//! ```no_run
//! use flexarm::{Modelling, Motion, Robot, RunOptions, Wrench};
//!
//! let robot = Robot::load("robots/kr210")?;
//! let motion = Motion::load("trajectories/pick_and_place.toml", &robot)?;
//! let arm = robot.model(&Modelling::default())?; // substitution once
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
//! [`Robot::load`] reads a robot, [`Robot::model`] models links and drives and returns an [`Arm`],
//! which threads may share. [`Arm::simulate`] runs a [`Motion`], or a [`Scenario`] with loads and
//! payloads, and returns a [`Run`] with figures and columns; [`Arm::operating_point`] computes
//! statics, compliance and frequencies at thousands of poses without allocation.
//!
//! [`Arm::simulate_with`] also writes recordings and a report. [`inspect()`] and [`check()`]
//! examine what was loaded; [`statics()`], [`modes()`] and [`response()`] give complete results at
//! one pose; [`mod@reduce`] creates a flexible link from a mesh.
//!
//! Examples, from simple to advanced
//! (`cargo run --release -p flexarm --no-default-features --example NAME`):
//!
//! | name | what it shows |
//! | --- | --- |
//! | `five_lines` | load, run, print |
//! | `operating_points` | an arm shared by threads, one workspace each: compliance and frequency at 10,000 poses |
//! | `stop_at_rest` | an observer that examines every sample and stops the run |
//! | `servo_study` | a study: servo gains against settling time and overshoot |
//! | `study_report` | link models compared on one page for the browser |
//! | `sensitivity` | the parameters of the robot with the strongest effect on the error |
//! | `link_models` | every link model against a reference: accuracy and cost |
//!
//! An [`Error`] states its cause with numbers; a [`Caveat`] warns of a doubtful result. Both carry
//! the settings that would fix them as values ([`Setting`]); a front end sets their names once
//! ([`name_settings`]).
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

#[doc(inline)]
pub use flexarm_chatter as lobes;
#[doc(inline)]
pub use flexarm_compensate as compensate;
#[doc(inline)]
pub use flexarm_identify as identify;
#[doc(inline)]
pub use flexarm_map as map;
#[doc(inline)]
pub use flexarm_new as new;
#[doc(inline)]
pub use flexarm_run::{caveat, reduce};
#[doc(inline)]
pub use flexarm_sensitivity as sensitivity;
#[doc(inline)]
pub use flexarm_sweep as sweep;

pub use flexarm_new::{NewError, NewOptions, NewRobot, new_robot};
pub use flexarm_run::{
    AppliedLoad, Arm, BalancerEnds, BalancerError, BalancerInfo, Bend, Bending, CURVE_PIECES, Caveat, ChannelError,
    Command, ConvertOptions, ConvertSummary, CouplingInfo, DependentInfo, Description, DifferenceFigures, Disturbances,
    Drive, DriveKind, DriveModel, ElasticCoordinate, ElementStatics, EquationCommand, Equations, Error, Fault, Figure,
    FigureGroup, Files, Finding, FlexibleInfo, GearHysteresis, HeldJoint, HoldFigures, Inspection, JointInfo, Keep,
    LinkChoices, LinkFigures, LinkFormError, LinkInfo, LinkModel, LinkStressFigures, Live, LiveOptions, LiveState,
    LoadError, LoadOptions, LoopError, LoopInfo, ModeFigures, ModeMovie, ModeTable, Modelling, ModellingError, Motion,
    MotionCurve, MotionFiles, MotionOptions, MotionPeak, MotionReport, MotionViolation, MountingInfo, OperatingPoints,
    Outputs, Owner, PathFigures, PathMoveFigures, PayloadChange, PayloadError, PeakFigures, PoseError, PoseFigures,
    Progress, Readings, RecordingError, RecordingFiles, Recursions, ReportFiles, ReportOptions, ReportRun, Response,
    ResponseCurve, ResponseFiles, ResponseOutputs, ResponseRequest, Robot, RobotBalancer, RobotCoupling, RobotExport,
    RobotFileError, RobotFormat, RobotLink, RobotLoop, RobotMounting, RobotSource, Run, RunOptions, RunRequest,
    STUDY_NOTE, SampleObserver, Scenario, SectionForceFigures, Servos, SettingValue, Settling, Severity, ShareFigures,
    Statics, StaticsFiles, StaticsOutputs, StepperFigures, StepperSettings, StrainGaugeFigures, StressPlaceFigures,
    StressPointFigures, StressSource, StudyError, Summary, TCP_FRAME, TcpFigures, TcpInfo, ToolPath, ValueError,
    Variant, Variation, Weight, check, check_with_loads, check_with_motion, compare_study, convert, convert_until,
    figure_groups, html, inspect, markdown, modes, motion_report, parse_recording_format, read_run, readable_unit,
    record_modes, record_statics, report, response, rows, statics, stress_figures, study_rows,
};

pub use flexarm_analysis::{Quantity, Spacing};
pub use flexarm_files::{FileError, check_apart, check_free, private_folder, write_all, writing_unless};
pub use flexarm_flexlink::Mounting;
pub use flexarm_kinematics::{
    BalancerCurve, BalancerCurveError, BalancerLaw, Coordinate, GasLaw, LinkInertia, Model, Pose, Wrench,
};
pub use flexarm_linkmaker::{ImportError, JobError, LinkError, WordError, export, import};
#[cfg(feature = "arrow")]
pub use flexarm_log::arrow_stream;
pub use flexarm_log::{
    Column, Columns, CurveQuantity, DataColumn, DataTable, DataValues, FormatInfo, Holds, RecordingFormat, Sample,
    Trace, flat_columns,
};
pub use flexarm_motion_io::MotionError;
pub use flexarm_path::{PathError, PlannedMove, Slowed, SlowedBy};
pub use flexarm_settings::known_names;
pub use flexarm_settings::{Names, Setting, Words, gathered, name_settings, written};
pub use flexarm_stepping::{
    AlphaSettings, ConstraintForm, InertiaChange, Linear, Load, LoadAxes, OperatingPoint, PoseAnswer, PoseOutputs,
    ReferenceMethod, ReferenceSettings, STEPPERS, SpookPreset, SpookSettings, Start, StepError, StepRule, StepperEntry,
    StepperKind, StepperOptions, StepperSetting, TimedWrench, ToolDeflection,
};
pub use flexarm_trajectory::{ColumnMap, ColumnMapError, Trajectory, TrajectoryError};
pub use flexarm_urdf::{InertiaEstimate, ReadOptions, closest, search_paths_from_environment};
