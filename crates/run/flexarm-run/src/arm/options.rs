//! Options of models and runs, with usable defaults: plain data, checked where they are used.
//!
//! Not here: settings of single steppers (`run/stepper_settings.rs`), the motion and its loads
//! ([`crate::Scenario`]).

use std::collections::BTreeSet;
use std::path::PathBuf;

use flexarm_log::RecordingFormat;
use flexarm_settings::Words;
use flexarm_stepping::StepperKind;

/// Requested model of the links. The model of a link in the tree is a
/// [`flexarm_flexlink::LinkForm`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LinkModel {
    /// As in the robot file.
    #[default]
    AsFiled,
    /// All links rigid.
    Rigid,
    /// Flexible links as rigid parts with 6×6 springs.
    Lumped,
    /// Flexible links as modal bodies.
    Modal,
}

impl Words for LinkModel {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("rigid", Self::Rigid, "All links rigid"),
        ("lumped", Self::Lumped, "Rigid parts with coupled 6x6 springs"),
        ("modal", Self::Modal, "Modal bodies (floating frame, Craig-Bampton)"),
    ];
}

/// Model of the drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum DriveModel {
    /// As in the robot file.
    #[default]
    AsFiled,
    /// All joints follow the trajectory exactly, no springs.
    Rigid,
    /// Elastic gearboxes; motors follow the trajectory exactly.
    Elastic,
    /// All joints are driven by torque under servos; elastic gearboxes.
    Servo,
}

impl Words for DriveModel {
    const WORDS: &'static [(&'static str, Self, &'static str)] = &[
        ("rigid", Self::Rigid, "Every joint exactly along the trajectory, no springs"),
        ("elastic", Self::Elastic, "Elastic gearboxes, motors exactly on the trajectory"),
        ("servo", Self::Servo, "Motors by torque under servos"),
    ];
}

/// Models of links and drives that override the robot file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modelling {
    /// Model of the links.
    pub links: LinkModel,
    /// Model of the drives.
    pub drives: DriveModel,
    /// Number of rigid parts of lumped links, overrides the file.
    pub segments: Option<usize>,
    /// Number of fixed-interface modes of modal links, overrides the file.
    pub modes: Option<usize>,
}

/// Options for stepping, logging and measuring a run. The run itself is described by the
/// [`Scenario`](crate::Scenario).
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Time stepper.
    pub stepper: StepperKind,
    /// Step size (s).
    pub step_s: f64,
    /// Logged samples per second; rounded to a whole number of steps per sample.
    pub log_rate_hz: f64,
    /// Whether to run although the trajectory exceeds joint limits; violations become warnings.
    pub ignore_limits: bool,
    /// Whether to log the rigid twin and measure against it.
    pub with_twin: bool,
    /// Half width of the settling band (m).
    pub settling_band_m: f64,
    /// Magnification of deflections in recordings and pictures; chosen for the run by default.
    pub magnification: Option<f64>,
    /// Start of the run in recordings whose times have a date (ns since 1970);
    /// [`flexarm_log::START_NS`] by default.
    pub start_ns: Option<u64>,
    /// Whether to embed mesh files in the robot description of recordings, instead of referring to
    /// their location on this machine.
    pub embed_meshes: bool,
}

impl Default for RunOptions {
    fn default() -> Self {
        let stepper = StepperKind::default();
        Self {
            stepper,
            step_s: stepper.entry().default_step_s,
            log_rate_hz: 500.0,
            ignore_limits: false,
            with_twin: true,
            settling_band_m: 1e-4,
            magnification: None,
            start_ns: None,
            embed_meshes: false,
        }
    }
}

/// Output folder and formats of the recordings.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Output folder; created if it does not exist.
    pub folder: PathBuf,
    /// Whether existing files are overwritten.
    pub overwrite: bool,
    /// Formats of the recordings, one file each. This build must support each of them
    /// ([`RecordingFormat::is_built_in`]).
    pub recordings: BTreeSet<RecordingFormat>,
    /// Whether to write a folder `figures` with plots and pictures for papers.
    pub figures: bool,
}

impl Outputs {
    /// Returns the default outputs in a folder: every recording supported by this build except
    /// tables with the same content as the CSV; no figures for papers.
    pub fn everything(folder: impl Into<PathBuf>) -> Self {
        let usual = |format: &RecordingFormat| format.info().by_default && format.is_built_in();
        Self {
            folder: folder.into(),
            overwrite: false,
            recordings: RecordingFormat::ALL.into_iter().filter(usual).collect(),
            figures: false,
        }
    }

    /// Adds a recording of this format.
    #[must_use]
    pub fn with(mut self, format: RecordingFormat) -> Self {
        self.recordings.insert(format);
        self
    }

    /// Removes the recording of this format.
    #[must_use]
    pub fn without(mut self, format: RecordingFormat) -> Self {
        self.recordings.remove(&format);
        self
    }
}
