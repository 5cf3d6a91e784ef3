//! Facade of the flexarm workspace: from a robot file and a trajectory to a result.
//!
//! ```
//! use flexarm::{Modelling, Motion, Robot, RunOptions, Wrench};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let robot = Robot::load("robots/kr210")?;
//! let motion = Motion::load("trajectories/point_to_point.toml", &robot)?;
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
//! examine what was loaded; [`poses`] gives complete results at
//! one pose; [`links::reduce`] creates a flexible link from a mesh. Names are sorted by subject into
//! modules; at the root are those that a first program needs.
//!
//! Examples, from simple to advanced
//! (`cargo run --release -p flexarm --no-default-features --example NAME`):
//!
//! | name | what it shows |
//! | --- | --- |
//! | `five_lines` | load, run, print |
//! | `operating_points` | an arm shared by threads, one workspace each: compliance and frequency at 10,000 poses |
//! | `many_runs` | a study of many runs of one arm on all cores |
//! | `prepared_runs` | processor time of a run of a prepared arm: set-up and steps |
//! | `stop_at_rest` | an observer that examines every sample and stops the run |
//! | `servo_study` | a study: servo gains against settling time and overshoot |
//! | `study_report` | link models compared on one page for the browser |
//! | `sensitivity` | the parameters of the robot with the strongest effect on the error |
//! | `link_models` | every link model against a reference: accuracy and cost |
//!
//! An [`Error`] states its cause with numbers; a [`Finding`] warns of a doubtful result. Both carry
//! the settings that would fix them as values ([`settings::Setting`]); a front end sets their names once
//! ([`settings::name_settings`]).
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
pub use flexarm_run::caveat;
#[doc(inline)]
pub use flexarm_sensitivity as sensitivity;
#[doc(inline)]
pub use flexarm_sweep as sweep;

pub use flexarm_kinematics::{Pose, Wrench};
pub use flexarm_run::{
    Arm, DriveModel, Error, Fault, Finding, Keep, LinkModel, LoadOptions, Modelling, Motion, Outputs, PayloadChange,
    Robot, RobotSource, Run, RunOptions, RunRequest, Scenario, Severity, Summary, check, inspect,
};
pub use flexarm_stepping::StepperKind;

/// An arm held at a pose: statics, natural modes, frequency response; thousands of poses.
///
/// ```no_run
/// use flexarm::{Modelling, Robot};
///
/// let arm = Robot::load("robots/kr210")?.model(&Modelling::default())?;
/// let sag_m = arm.statics(None, [0.0; 6])?.sag_m;
/// let hz = arm.modes(None, None, 3)?.frequencies_hz;
/// println!("{sag_m:?} m, {hz:?} Hz");
/// # Ok::<(), flexarm::Error>(())
/// ```
pub mod poses {
    pub use flexarm_analysis::{Quantity, Spacing};
    pub use flexarm_run::{
        ElementStatics, ModeFigures, ModeMovie, ModeTable, OperatingPoints, PeakFigures, Recursions, Response,
        ResponseCurve, ResponseFiles, ResponseOutputs, ResponseRequest, Statics, StaticsFiles, StaticsOutputs,
        readable_unit,
    };
    pub use flexarm_stepping::{Linear, OperatingPoint, PoseAnswer, PoseOutputs};
}

/// Contents of a robot file and its description, and findings about them.
///
/// ```no_run
/// use flexarm::Robot;
///
/// let robot = Robot::load("robots/kr210")?;
/// for link in &robot.flexible_links {
///     println!("{}: {} parts", link.flexible.link, link.choices.segments);
/// }
/// # Ok::<(), flexarm::Error>(())
/// ```
pub mod robots {
    pub use flexarm_flexlink::Mounting;
    pub use flexarm_kinematics::{BalancerCurve, BalancerLaw, Coordinate, GasLaw, LinkInertia, Model};
    pub use flexarm_new::{NewOptions, NewRobot, new_robot};
    pub use flexarm_run::{
        BalancerEnds, BalancerInfo, Bend, CouplingInfo, DependentInfo, Description, Drive, DriveKind, FlexibleInfo,
        GearHysteresis, Inspection, JointInfo, LinkChoices, LinkInfo, LoopInfo, MountingInfo, Owner, RobotBalancer,
        RobotCoupling, RobotExport, RobotFormat, RobotLink, RobotLoop, RobotMounting, StressSource, TCP_FRAME, TcpInfo,
        check_with_loads, check_with_motion,
    };
    pub use flexarm_settings::known_names;
    pub use flexarm_urdf::{InertiaEstimate, ReadOptions, closest, search_paths_from_environment};
}

/// Motions of the joints, paths of the TCP, loads and payloads.
///
/// ```no_run
/// use flexarm::{Motion, Robot};
///
/// let robot = Robot::load("robots/kr210")?;
/// let motion = Motion::load("trajectories/pick_and_place.toml", &robot)?;
/// println!("{} s", motion.trajectory.duration());
/// # Ok::<(), flexarm::Error>(())
/// ```
pub mod motions {
    pub use flexarm_path::{PlannedMove, Slowed, SlowedBy};
    pub use flexarm_run::{
        AppliedLoad, Disturbances, HeldJoint, MotionCurve, MotionFiles, MotionOptions, MotionPeak, MotionReport,
        MotionViolation, PathFigures, PathMoveFigures, ToolPath, motion_report,
    };
    pub use flexarm_stepping::{InertiaChange, Load, LoadAxes, TimedWrench};
    pub use flexarm_trajectory::{ColumnMap, Trajectory};
}

/// Studies of several runs, and the figures of a run.
pub mod runs {
    pub use flexarm_run::{
        Bending, DifferenceFigures, Files, HoldFigures, LinkFigures, LinkStressFigures, PoseFigures, Progress,
        RecordingFiles, STUDY_NOTE, SampleObserver, SectionForceFigures, SettingValue, Settling, ShareFigures,
        StepperFigures, StepperSettings, StrainGaugeFigures, StressPlaceFigures, StressPointFigures, TcpFigures,
        Variant, Variation, compare_study, study_rows,
    };
    pub use flexarm_stepping::ToolDeflection;
}

/// An arm that is commanded period by period, and its equations of motion.
///
/// ```no_run
/// use flexarm::{Modelling, Robot, RunOptions};
///
/// let arm = Robot::load("robots/kr210")?.model(&Modelling::default())?;
/// let live = arm.live(None, 1e-3, &RunOptions::default())?;
/// println!("{} s", live.time_s());
/// # Ok::<(), flexarm::Error>(())
/// ```
pub mod live {
    pub use flexarm_run::{
        Command, ElasticCoordinate, EquationCommand, Equations, Live, LiveOptions, LiveState, Readings, Servos,
    };
}

/// Time steppers and their settings.
///
/// ```no_run
/// use flexarm::steppers::STEPPERS;
///
/// for entry in STEPPERS {
///     println!("{}: {} s", entry.name, entry.default_step_s);
/// }
/// # Ok::<(), flexarm::Error>(())
/// ```
pub mod steppers {
    pub use flexarm_stepping::{
        AlphaSettings, ConstraintForm, ReferenceMethod, ReferenceSettings, STEPPERS, SpookPreset, SpookSettings, Start,
        StepRule, StepperEntry, StepperOptions, StepperSetting,
    };
}

/// Reports of runs: a page for the browser, Markdown, rows of a table.
pub mod report {
    pub use flexarm_run::{
        Figure, FigureGroup, ReportFiles, ReportOptions, ReportRun, Weight, figure_groups, html, markdown, report,
        rows, stress_figures,
    };
}

/// Recordings of runs: formats, columns, conversion.
pub mod recordings {
    pub use flexarm_log::{
        Column, Columns, ContentLevel, CurveQuantity, DataColumn, DataTable, DataValues, FormatInfo, RecordingFormat,
        Sample, Trace, flat_columns,
    };
    pub use flexarm_run::{ConvertOptions, ConvertSummary, convert, convert_until, parse_recording_format};
}

/// Flexible links from meshes and from matrices of other programs.
pub mod links {
    pub use flexarm_linkmaker::{LinkError, WordError, export, import};
    pub use flexarm_run::reduce;
}

/// Results that are written as a whole or not at all.
pub mod files {
    pub use flexarm_files::{check_apart, check_free, private_folder, write_all, writing_unless};
}

/// Causes of an error of the library.
pub mod errors {
    pub use flexarm_files::FileError;
    pub use flexarm_kinematics::BalancerCurveError;
    pub use flexarm_new::NewError;
    pub use flexarm_run::{RecordingError, RobotFileError};
    pub use flexarm_stepping::StepError;
    pub use flexarm_trajectory::{ColumnMapError, TrajectoryError};
}

/// Settings that messages name; a front end sets their names once.
pub mod settings {
    pub use flexarm_settings::{Names, Setting, Words, gathered, name_settings, written};
}
