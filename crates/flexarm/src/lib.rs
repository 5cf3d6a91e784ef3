//! From a robot file and a trajectory to a result: the facade of the flexarm workspace.
//!
//! Data path: robot file → rigid model → substitution → system → stepper → recorder → metrics. [`Robot::load`] does
//! the first three, [`Motion::load`] reads the trajectory, [`simulate`] runs both robots and returns a [`Summary`].
//! [`inspect()`] and [`check()`] look at what was loaded; [`statics()`], [`modes()`] and [`response()`] hold it at a pose; [`mod@reduce`] makes a flexible link of a mesh. Both faces (command line, Python) use this crate alone.
//!
//! ```no_run
//! use std::ops::ControlFlow;
//! use flexarm::{LoadOptions, Motion, Outputs, Robot, RunOptions, simulate};
//!
//! let robot = Robot::load("robots/kr210".as_ref(), &LoadOptions::default())?;
//! let motion = Motion::load("trajectories/pick_and_place.toml".as_ref(), &*robot.rigid_model()?)?;
//! let outputs = Outputs::everything("out/first");
//! let options = RunOptions::default();
//! let summary = simulate(&robot, &motion, &options, Some(&outputs), &mut |_, _| ControlFlow::Continue(()))?;
//! println!("peak TCP error {:.3} mm", 1e3 * summary.tcp.unwrap().peak_m);
//! # Ok::<(), flexarm::Error>(())
//! ```
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a failed unwrap fails the test"))]

mod beam_entry;
mod bends;
pub mod caveat;
mod check;
mod compare;
mod convert;
mod disturbance;
mod drive_entry;
mod energy_book;
mod error;
pub mod export;
mod flexible;
mod headline;
pub mod import;
mod input;
mod inspect;
mod link_entry;
mod load_jumps;
mod magnification;
mod mode_recording;
mod modes;
mod motion;
mod options;
mod posed;
mod prepare;
mod record;
pub mod reduce;
mod report;
mod response;
pub mod result_files;
mod robot;
pub mod robot_file;
mod settling;
mod stamp;
mod static_part;
mod statics;
mod statics_picture;
mod study;
mod summary;
mod twin;

pub use bends::Bend;
pub use caveat::Caveat;
pub use check::{Finding, check, check_with_loads};
pub use compare::{Progress, simulate, simulate_traced};
pub use convert::{ConvertOptions, ConvertSummary, convert, convert_until, parse_recording_format, read_run};
pub use disturbance::Disturbances;
pub use drive_entry::{Drive, DriveKind};
pub use error::Error;
pub use flexible::{FlexibleRobot, LinkChoices, Owner, RobotLink};
pub use headline::{Bending, ShareFigures};
pub use inspect::{FlexibleInfo, Inspection, JointInfo, LinkInfo, TcpInfo, inspect, parse_joint_values};
pub use mode_recording::{ModeMovie, record_modes};
pub use modes::{ModeFigures, ModeTable, modes};
pub use motion::{HeldJoint, Motion};
pub use options::{DriveModel, LinkModel, Modelling, Outputs, RunOptions};
pub use report::{
    Figure, FigureGroup, ReportFiles, ReportOptions, ReportRun, Weight, figure_groups, html, markdown, report, rows,
};
pub use response::{
    PeakFigures, Response, ResponseCurve, ResponseFiles, ResponseOutputs, ResponseRequest, readable_unit, response,
};
pub use robot::{LoadOptions, Robot, TCP_FRAME};
pub use settling::Settling;
pub use statics::{ElementStatics, Statics, parse_wrench, record_statics, statics};
pub use statics_picture::{StaticsFiles, StaticsOutputs};
pub use study::{STUDY_NOTE, Variant, compare_study, study_rows};
pub use summary::{
    CURVE_PIECES, DifferenceFigures, Files, HoldFigures, LinkFigures, StepperFigures, Summary, TcpFigures,
};

pub use flexarm_analysis::{Quantity, Spacing};
pub use flexarm_log::{RecordingFormat, Trace};
pub use flexarm_stepping::{
    AlphaSettings, ConstraintForm, ReferenceMethod, ReferenceSettings, SpookPreset, SpookSettings, Start, StepError,
    StepperKind,
};
pub use flexarm_trajectory::TrajectoryError;
pub use flexarm_urdf::{InertiaEstimate, ReadOptions, closest, search_paths_from_environment};
