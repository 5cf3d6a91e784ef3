//! Choices of a run, with defaults that work.

use std::collections::BTreeSet;
use std::path::PathBuf;

use flexarm_log::RecordingFormat;
use flexarm_stepping::StepperKind;

/// Requested model of the links. The result on the tree is a [`flexarm_flexlink::LinkForm`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LinkModel {
    /// As the robot file says.
    #[default]
    AsFiled,
    /// All rigid.
    Rigid,
    /// Flexible links as rigid parts with 6×6 springs.
    Lumped,
    /// Flexible links as bodies that bend in modes.
    Modal,
}

impl LinkModel {
    /// Choices: the word in robot files, on the command line and in recordings, and its meaning.
    pub const WORDS: [(&'static str, Self, &'static str); 3] = [
        ("rigid", Self::Rigid, "All links rigid"),
        ("lumped", Self::Lumped, "Rigid parts with coupled 6x6 springs"),
        ("modal", Self::Modal, "Modal bodies (floating frame, Craig-Bampton)"),
    ];

    /// The model of that word.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(known, ..)| *known == word).map(|(_, model, _)| *model)
    }

    /// Its word; none where the robot file decides.
    pub fn word(self) -> Option<&'static str> {
        Self::WORDS.iter().find(|(_, model, _)| *model == self).map(|(word, ..)| *word)
    }
}

/// Requested model of the drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum DriveModel {
    /// As the robot file says.
    #[default]
    AsFiled,
    /// All joints exactly along the trajectory, no springs.
    Rigid,
    /// Elastic gearboxes, motors exactly on the trajectory.
    Elastic,
    /// All joints driven by servo torques through elastic gearboxes.
    Servo,
}

impl DriveModel {
    /// Choices: the word on the command line and in recordings, and its meaning.
    pub const WORDS: [(&'static str, Self, &'static str); 3] = [
        ("rigid", Self::Rigid, "Every joint exactly along the trajectory, no springs"),
        ("elastic", Self::Elastic, "Elastic gearboxes, motors exactly on the trajectory"),
        ("servo", Self::Servo, "Motors by torque under servos"),
    ];

    /// Its word; none where the robot file decides.
    pub fn word(self) -> Option<&'static str> {
        Self::WORDS.iter().find(|(_, model, _)| *model == self).map(|(word, ..)| *word)
    }
}

/// Models of links and drives that differ from the robot file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modelling {
    /// Links.
    pub links: LinkModel,
    /// Drives.
    pub drives: DriveModel,
    /// Number of rigid parts of lumped links, instead of the file's.
    pub segments: Option<usize>,
    /// Number of fixed-interface modes of modal links, instead of the file's.
    pub modes: Option<usize>,
}

/// Choices of a run: how it is stepped, logged and measured. What happens in it is the
/// [`Scenario`](crate::Scenario).
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Time stepper.
    pub stepper: StepperKind,
    /// Step (s).
    pub step_s: f64,
    /// Link and drive models.
    pub modelling: Modelling,
    /// Logged samples per second; the nearest whole number of steps is used.
    pub log_rate_hz: f64,
    /// Run although the trajectory passes joint limits; they become warnings.
    pub ignore_limits: bool,
    /// Log and measure against the rigid twin.
    pub with_twin: bool,
    /// Band of the settling time (m).
    pub settling_band_m: f64,
    /// Factor by which recordings and pictures show deflections; chosen for the run without it.
    pub magnification: Option<f64>,
    /// When the run begins in recordings whose times have a date (ns since 1970);
    /// [`flexarm_log::START_NS`] without it.
    pub start_ns: Option<u64>,
    /// Put mesh files into the robot description of recordings, instead of where they are on this
    /// machine.
    pub embed_meshes: bool,
}

impl Default for RunOptions {
    fn default() -> Self {
        let stepper = StepperKind::default();
        Self {
            stepper,
            step_s: stepper.entry().default_step_s,
            modelling: Modelling::default(),
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

/// Recordings to write, and their folder.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Folder; made if it is not there.
    pub folder: PathBuf,
    /// Overwrite what is there.
    pub overwrite: bool,
    /// Formats of the recordings, one file each. Each must be one that this build can write
    /// ([`RecordingFormat::is_built_in`]).
    pub recordings: BTreeSet<RecordingFormat>,
    /// Write a folder `figures` with plots and pictures for papers.
    pub figures: bool,
}

impl Outputs {
    /// Into a folder, what a run writes without being asked to: every recording that this build can
    /// write, except tables with the content of the CSV; no figures for papers.
    pub fn everything(folder: impl Into<PathBuf>) -> Self {
        let usual = |format: &RecordingFormat| format.info().by_default && format.is_built_in();
        Self {
            folder: folder.into(),
            overwrite: false,
            recordings: RecordingFormat::ALL.into_iter().filter(usual).collect(),
            figures: false,
        }
    }

    /// The same with a recording of this format too.
    #[must_use]
    pub fn with(mut self, format: RecordingFormat) -> Self {
        self.recordings.insert(format);
        self
    }

    /// The same without a recording of this format.
    #[must_use]
    pub fn without(mut self, format: RecordingFormat) -> Self {
        self.recordings.remove(&format);
        self
    }
}
