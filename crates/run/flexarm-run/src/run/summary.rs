//! Figures of a run: the contents of `summary.json`; the JSON keys are stable.
//!
//! Start at [`Summary`]. SI units, world axes; keys end in their units. Not here: their computation
//! (`figures`, `monitor`, `flexarm_analysis`), sentences about them (`headline`, `settling`,
//! `report`).

use std::collections::BTreeMap;

use flexarm_analysis::{ErrorParts, HoldMetrics, RepeatedPose, TcpMetrics};
use flexarm_log::RecordingFormat;
use flexarm_stepping::Counts;
use serde::{Deserialize, Serialize};

use crate::arm::options::RunOptions;
use crate::caveat::Finding;
use crate::run::headline::{Bending, ShareFigures};
use crate::run::monitor::tool_path::PathFigures;
use crate::run::settling::within;
use crate::run::stepper_settings::StepperSettings;

/// Result of `flexarm compare` and `flexarm run`. SI units.
///
/// `summary.json` can be read back with `serde_json`; keys missing in files of older versions take
/// their defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Summary {
    /// TCP error and its main causes in one sentence; empty if they are not known.
    pub headline: String,
    /// Name of the robot.
    pub robot: String,
    /// Name of the trajectory.
    pub trajectory: String,
    /// `rigid`, `lumped`, `modal` or `mixed`.
    pub links_model: String,
    /// Elastic parts of the robot; none if it is rigid.
    pub bends: Bending,
    /// `complete`, or the reason why the run stopped early.
    pub end: String,
    /// Simulated time (s).
    pub duration_s: f64,
    /// Stepper and its work.
    pub stepper: StepperFigures,
    /// Wall-clock time of the run, recordings included (s).
    pub wall_s: f64,
    /// Simulated over wall-clock time.
    pub real_time_factor: f64,
    /// Processor time, all threads (s).
    pub cpu_s: f64,
    /// Processor time per simulated second.
    pub cpu_s_per_simulated_s: f64,
    /// Flexible against rigid tool centre point; absent for runs without the twin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tcp: Option<TcpFigures>,
    /// Error across the path; absent unless the motion is given as a TCP path.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub path: Option<PathFigures>,
    /// Natural frequencies at the start pose, drives locked (Hz).
    pub frequencies_hz: Vec<f64>,
    /// Flexible links.
    pub links: Vec<LinkFigures>,
    /// Stress of the links whose stress fields are stored.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub stress: Vec<LinkStressFigures>,
    /// Elastic drives.
    pub elastic_drives: Vec<DriveFigures>,
    /// Energy balance.
    pub energy: EnergyFigures,
    /// Maximum torque or force of each drive (N m or N).
    pub drives: BTreeMap<String, f64>,
    /// Maximum torque of each motor that moves several joints, after its gear (N m or N), by the
    /// joint of its drive.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub motors: BTreeMap<String, f64>,
    /// Warnings among [`Summary::caveats`], as sentences.
    pub warnings: Vec<String>,
    /// Probable errors in the input, and limits of the result's validity.
    pub caveats: Vec<Finding>,
    /// Written files.
    pub files: Files,
    /// Label of the run in a study.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub label: Option<String>,
    /// Distance of its TCP from that of the first run of a study.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub difference: Option<DifferenceFigures>,
    /// The other runs of a study.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub with: Vec<Summary>,
    /// Start and end of each move (s).
    pub moves_s: Vec<[f64; 2]>,
    /// Maximum TCP error in each of [`CURVE_PIECES`] equal pieces of the run (m), for the terminal.
    #[serde(skip)]
    pub error_curve: Vec<f64>,
    /// Whether the summary was computed from curves only: energies, forces, frequencies, the
    /// stepper's work and the end of the run are then unknown, and of the moves only
    /// [`Summary::moves_s`] is known.
    #[serde(skip)]
    pub computed: bool,
}

/// Written files; null where none was written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Files {
    /// Recordings.
    #[serde(flatten)]
    pub recordings: RecordingFiles,
    /// Report: an HTML page with plots and pictures.
    pub report: Option<String>,
    /// Rerun recording of all runs of a study.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub study: Option<String>,
    /// Figures of the report as Markdown.
    pub report_md: Option<String>,
    /// Folder with figures for papers.
    pub figures: Option<String>,
    /// Picture of the stress of the links.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub stress: Option<String>,
    /// Foxglove layout for the MCAP recording.
    pub foxglove_layout: Option<String>,
    /// PlotJuggler layout for the MCAP recording.
    pub plotjuggler_layout: Option<String>,
}

/// Names of the recordings of a run, by format. In JSON each has the file extension of its format
/// as key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingFiles(BTreeMap<RecordingFormat, String>);

/// Formats with a key in every summary, null if not written; other formats appear only if written.
const ALWAYS_LISTED: [RecordingFormat; 4] =
    [RecordingFormat::Mcap, RecordingFormat::Rrd, RecordingFormat::Csv, RecordingFormat::Parquet];

impl RecordingFiles {
    /// Returns the recording of this format.
    #[must_use]
    pub fn get(&self, format: RecordingFormat) -> Option<&str> {
        self.0.get(&format).map(String::as_str)
    }

    /// Returns all recordings, in the order of the formats.
    pub fn iter(&self) -> impl Iterator<Item = (RecordingFormat, &str)> {
        self.0.iter().map(|(format, file)| (*format, file.as_str()))
    }

    /// Adds the recording of a format.
    pub(crate) fn insert(&mut self, format: RecordingFormat, file: String) {
        self.0.insert(format, file);
    }
}

impl Serialize for RecordingFiles {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let listed = |format: &RecordingFormat| ALWAYS_LISTED.contains(format) || self.get(*format).is_some();
        let formats = RecordingFormat::ALL.into_iter().filter(listed);
        serializer.collect_map(formats.map(|format| (format.extension(), self.get(format))))
    }
}

impl<'de> Deserialize<'de> for RecordingFiles {
    /// Ignores keys that are not formats, such as those of other files.
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let keys = BTreeMap::<String, serde_json::Value>::deserialize(deserializer)?;
        let file = |format: RecordingFormat| Some((format, keys.get(format.extension())?.as_str()?.to_owned()));
        Ok(Self(RecordingFormat::ALL.into_iter().filter_map(file).collect()))
    }
}

/// Stepper and its work.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StepperFigures {
    /// Name on the command line.
    pub name: String,
    /// Step size (s).
    pub h_s: f64,
    /// Settings of the stepper, each under its key: `rho_inf`, `dispersion_correction`
    /// (generalised-alpha), `form`, `preset` (SPOOK), `rtol`, `method` (reference).
    #[serde(flatten)]
    pub settings: StepperSettings,
    /// Number of steps.
    pub steps: u64,
    /// Number of evaluations of the equations of motion.
    pub evaluations: u64,
    /// Number of factorisations.
    pub factorisations: u64,
}

impl StepperFigures {
    pub(crate) fn new(options: &RunOptions, counts: Counts) -> Self {
        let Counts { steps, evaluations, factorisations } = counts;
        let (name, h_s) = (options.stepper.name().to_owned(), options.step_s);
        let settings = StepperSettings::of(&options.stepper);
        Self { name, h_s, settings, steps, evaluations, factorisations }
    }
}

/// Figures of a flexible link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkFigures {
    /// Name of the link.
    pub name: String,
    /// Maximum TCP displacement caused by its deflection alone (m).
    pub peak_contribution_m: f64,
    /// Maximum change of the distance between its interfaces, relative to that distance.
    pub engineering_strain: f64,
    /// Maximum elastic rotation (rad).
    pub peak_rotation_rad: f64,
}

/// Stress of a flexible link during a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkStressFigures {
    /// Name of the link.
    pub name: String,
    /// Number of nodes of its surface.
    pub nodes: usize,
    /// Number of nodes that are not judged, because a rigid tie is near.
    pub left_out: usize,
    /// Distance from tied nodes that is left out (m).
    pub clear_of_ties_m: f64,
    /// Maximum von Mises stress (Pa).
    pub peak_pa: f64,
    /// The same over the yield strength; null for a material whose strength is not known.
    pub of_yield: Option<f64>,
    /// Maximum fatigue damage of one motion on the surface; null as above.
    pub damage: Option<f64>,
    /// Place of the largest damage; null as above.
    pub most_damaged: Option<StressPlaceFigures>,
    /// Places of the largest stress, the worst first.
    pub worst: Vec<StressPlaceFigures>,
    /// Stress points of the robot file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<StressPointFigures>,
    /// Strain gauges of the robot file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gauges: Vec<StrainGaugeFigures>,
    /// Section forces of a beam, from its near end to its far end.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub section_forces: Vec<SectionForceFigures>,
}

/// Extremes of the section forces at a plane across a beam: `N V_y V_z T M_y M_z`, in beam axes
/// about the axis of the beam (N, N m), of the far side on the near side, so that tension is
/// positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SectionForceFigures {
    /// Position along the beam from its near end (m).
    pub at_m: f64,
    /// Minima over the run.
    pub lowest: [f64; 6],
    /// Maxima over the run.
    pub highest: [f64; 6],
}

/// Maximum stress at a stress point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StressPointFigures {
    /// Name of the point.
    pub name: String,
    /// Its node and maximum.
    pub place: StressPlaceFigures,
}

/// Extremes of a strain gauge.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StrainGaugeFigures {
    /// Name of the gauge.
    pub name: String,
    /// Number of its node in the mesh.
    pub node: u64,
    /// Position of the node in the link frame (m).
    pub position_m: [f64; 3],
    /// Minimum strain (m/m).
    pub lowest: f64,
    /// Maximum strain (m/m).
    pub highest: f64,
}

/// Maximum stress at a node of the surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StressPlaceFigures {
    /// Number of the node in the mesh.
    pub node: u64,
    /// Its position in the link frame (m).
    pub position_m: [f64; 3],
    /// Time of the maximum (s).
    pub t_s: f64,
    /// Von Mises stress (Pa).
    pub von_mises_pa: f64,
    /// Stress over yield strength; null for a material whose strength is not known.
    pub of_yield: Option<f64>,
    /// Material with its class; null if it is none of the presets.
    pub material: Option<String>,
    /// Fatigue damage of the motion if it is repeated without end; the life is 1 over it in
    /// motions. 1 if the link does not survive the first motion, null for an unknown material.
    pub damage: Option<f64>,
}

/// Figures of an elastic drive.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DriveFigures {
    /// Name of the joint.
    pub joint: String,
    /// Maximum TCP displacement caused by its deflection alone (m).
    pub peak_contribution_m: f64,
    /// Maximum deflection between motor and link (rad; m if the joint is prismatic).
    pub peak_deflection_rad: f64,
    /// Whether the joint is prismatic.
    pub slides: bool,
}

impl DriveFigures {
    /// Unit of the maximum deflection as reports show it, in thousandths of the stored one.
    pub(crate) fn shown_unit(&self) -> &'static str {
        if self.slides { "mm" } else { "mrad" }
    }
}

/// Energy balance of the run, from the logged samples (trapezoidal rule: a low log rate causes an
/// imbalance).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EnergyFigures {
    /// Net work of the drives: [`EnergyFigures::drives_positive_j`] minus
    /// [`EnergyFigures::drives_negative_j`] (J).
    pub drives_j: f64,
    /// Work of each drive while its power is positive, summed (J).
    pub drives_positive_j: f64,
    /// Work absorbed by each drive while its power is negative, summed, as a positive number (J).
    pub drives_negative_j: f64,
    /// Work of the external loads (J).
    pub loads_j: f64,
    /// Energy dissipated by dampers and friction (J).
    pub dissipated_j: f64,
    /// Part of the dissipated energy due to gear hysteresis (J).
    #[serde(skip_serializing_if = "is_zero")]
    pub hysteresis_j: f64,
    /// Energy added with payloads picked up, less that removed with payloads dropped (J).
    pub payload_j: f64,
    /// Increase of kinetic, gravitational and elastic energy (J).
    pub stored_j: f64,
    /// Maximum error of the balance relative to the largest energy in it.
    pub imbalance: f64,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Distance of one run's flexible TCP from another's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DifferenceFigures {
    /// Maximum distance (m).
    pub peak_m: f64,
    /// Time of the maximum (s).
    pub t_peak_s: f64,
    /// Root mean square of the distance (m).
    pub rms_m: f64,
    /// Maximum distance relative to the first run's maximum TCP error.
    pub of_peak_error: Option<f64>,
}

/// Flexible against rigid tool centre point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TcpFigures {
    /// Maximum distance (m).
    pub peak_m: f64,
    /// Time of the maximum (s).
    pub t_peak_s: f64,
    /// Root mean square of the distance (m).
    pub rms_m: f64,
    /// Distance at the end (m).
    pub end_m: f64,
    /// Static deflection at the start (m).
    pub static_sag_m: f64,
    /// Static part of `peak_m`, along the direction of the error (m): deflection at rest in that
    /// pose under gravity and the loads at that time; null if the arm has no equilibrium somewhere
    /// on its path.
    pub static_at_peak_m: Option<f64>,
    /// Dynamic part of `peak_m`, from inertia and vibration (m); negative where the motion unloads
    /// the arm.
    pub dynamic_at_peak_m: Option<f64>,
    /// Maximum static part (m).
    pub static_peak_m: Option<f64>,
    /// Maximum dynamic part: error minus static part (m).
    pub dynamic_peak_m: Option<f64>,
    /// Time of the maximum dynamic part (s).
    pub t_dynamic_peak_s: Option<f64>,
    /// Root mean square of the dynamic part (m).
    pub dynamic_rms_m: Option<f64>,
    /// Contributions to the maximum error along its direction, in the order of the recordings.
    pub shares_at_peak: Vec<ShareFigures>,
    /// Maximum rotation error (rad).
    pub peak_rad: f64,
    /// Root mean square of the rotation error (rad).
    pub rms_rad: f64,
    /// Settling time (s): time from the end of a move until the error stays within the band around
    /// its final value, at the slowest stop; null if the TCP does not settle at some stop.
    pub settling_s: Option<f64>,
    /// Settling in words: the settling time, or the stops at which the TCP has not settled.
    pub settling: String,
    /// Half width of the settling band (m).
    pub settling_band_m: Option<f64>,
    /// Maximum overshoot beyond the final value after a move (m).
    pub overshoot_m: f64,
    /// Dominant frequency of the error (Hz).
    pub dominant_hz: Option<f64>,
    /// Maximum components along, across and out of the path (m).
    pub path_peak_m: [f64; 3],
    /// Maximum distance from the path while the robot moves (m), combining the components across
    /// and out of the path.
    pub path_accuracy_m: f64,
    /// Root mean square of the distance from the path over the moves (m).
    pub path_rms_m: f64,
    /// Figures of each stop.
    pub holds: Vec<HoldFigures>,
    /// Poses at which the TCP stops more than once.
    pub poses: Vec<PoseFigures>,
}

/// Accuracy and repeatability at a pose, as defined in ISO 9283.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PoseFigures {
    /// TCP position of the rigid robot, world axes (m).
    pub place_m: [f64; 3],
    /// Number of stops there.
    pub visits: usize,
    /// Distance of the mean position at the end of the stops from the rigid robot's (m): AP.
    pub accuracy_m: f64,
    /// Mean distance of the positions from their mean plus three standard deviations (m): RP.
    pub repeatability_m: f64,
}

impl From<&RepeatedPose> for PoseFigures {
    fn from(pose: &RepeatedPose) -> Self {
        let RepeatedPose { place_m, visits, accuracy_m, repeatability_m } = *pose;
        Self { place_m, visits, accuracy_m, repeatability_m }
    }
}

/// A stop: from the end of a move to the start of the next one, or to the end of the run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct HoldFigures {
    /// Start (s).
    pub start_s: f64,
    /// End (s).
    pub end_s: f64,
    /// Error when the TCP comes to rest (m).
    pub final_m: f64,
    /// Time from the start of the stop until the error stays within the band around its final value
    /// (s).
    pub settling_s: Option<f64>,
    /// Maximum overshoot beyond the final value (m).
    pub overshoot_m: f64,
    /// Dominant frequency (Hz).
    pub ringing_hz: Option<f64>,
}

impl From<&HoldMetrics> for HoldFigures {
    fn from(m: &HoldMetrics) -> Self {
        Self {
            start_s: m.start_s,
            end_s: m.end_s,
            final_m: m.final_error_m.iter().map(|x| x * x).sum::<f64>().sqrt(),
            settling_s: m.settling_s,
            overshoot_m: m.overshoot_m,
            ringing_hz: m.line.map(|line| line.hz),
        }
    }
}

impl From<&TcpMetrics> for TcpFigures {
    fn from(m: &TcpMetrics) -> Self {
        Self {
            peak_m: m.peak_m,
            t_peak_s: m.t_peak_s,
            rms_m: m.rms_m,
            end_m: m.end_m,
            static_sag_m: m.static_sag_m,
            peak_rad: m.peak_rad,
            rms_rad: m.rms_rad,
            settling_s: m.settling_s,
            overshoot_m: m.overshoot_m,
            dominant_hz: m.dominant_hz,
            path_peak_m: [m.tangential_peak_m, m.normal_peak_m, m.binormal_peak_m],
            path_accuracy_m: m.path_accuracy_m,
            path_rms_m: m.path_rms_m,
            holds: m.holds.iter().map(HoldFigures::from).collect(),
            poses: m.repeated.iter().map(PoseFigures::from).collect(),
            ..Self::default()
        }
    }
}

impl TcpFigures {
    /// Adds the text about settling into a band (m).
    pub(crate) fn with_band(mut self, band_m: f64) -> Self {
        self.settling = self.settling_state().words(&within(band_m));
        self.settling_band_m = Some(band_m);
        self
    }

    /// Returns the reason why there is no dominant frequency.
    pub(crate) fn no_line(&self) -> &'static str {
        /// Errors below this are round-off (m).
        const NOTHING_M: f64 = 1e-9;
        match self.dynamic_peak_m.unwrap_or(self.peak_m) < NOTHING_M {
            true => "nothing oscillates",
            false => "no dominant line in the spectrum",
        }
    }

    /// Adds static and dynamic part.
    pub(crate) fn with_parts(self, parts: &ErrorParts) -> Self {
        Self {
            static_at_peak_m: Some(parts.static_at_peak_m),
            dynamic_at_peak_m: Some(parts.dynamic_at_peak_m),
            static_peak_m: Some(parts.static_peak_m),
            dynamic_peak_m: Some(parts.dynamic_peak_m),
            t_dynamic_peak_s: Some(parts.t_dynamic_peak_s),
            dynamic_rms_m: Some(parts.dynamic_rms_m),
            ..self
        }
    }
}

impl Summary {
    /// Returns whether figures about moves and stops are available.
    pub(crate) fn knows_moves(&self) -> bool {
        !self.computed || !self.moves_s.is_empty()
    }

    /// Returns pairs of label and value for recordings; values in SI units.
    pub fn labelled(&self) -> Vec<(String, String)> {
        let optional = |x: Option<f64>| x.map_or_else(|| "none".to_owned(), |x| x.to_string());
        let mut rows = Vec::new();
        let mut add = |label: &str, value: String| rows.push((label.to_owned(), value));
        add("robot", self.robot.clone());
        add("trajectory", self.trajectory.clone());
        add("end", self.end.clone());
        add("duration_s", self.duration_s.to_string());
        add("stepper", format!("{} h = {} s", self.stepper.name, self.stepper.h_s));
        add("headline", self.headline.clone());
        // Only with the rigid twin.
        if let Some(tcp) = &self.tcp {
            add("tcp.peak_m", tcp.peak_m.to_string());
            add("tcp.rms_m", tcp.rms_m.to_string());
            add("tcp.end_m", tcp.end_m.to_string());
            add("tcp.static_sag_m", tcp.static_sag_m.to_string());
            add("tcp.static_at_peak_m", optional(tcp.static_at_peak_m));
            add("tcp.dynamic_at_peak_m", optional(tcp.dynamic_at_peak_m));
            add("tcp.dynamic_peak_m", optional(tcp.dynamic_peak_m));
            add("tcp.peak_rad", tcp.peak_rad.to_string());
            add("tcp.rms_rad", tcp.rms_rad.to_string());
            add("tcp.settling_s", optional(tcp.settling_s));
            add("tcp.settling", tcp.settling.clone());
            add("tcp.overshoot_m", tcp.overshoot_m.to_string());
            add("tcp.dominant_hz", optional(tcp.dominant_hz));
        }
        for link in &self.links {
            add(&format!("link.{}.peak_contribution_m", link.name), link.peak_contribution_m.to_string());
        }
        if let Some(f) = self.frequencies_hz.first() {
            add("first_frequency_hz", f.to_string());
        }
        rows
    }
}

/// Number of pieces of [`Summary::error_curve`]; fewer if the run has fewer samples.
pub const CURVE_PIECES: usize = 240;
