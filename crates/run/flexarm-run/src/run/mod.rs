//! Runs the rigid and the flexible arm along one motion, logs the samples and computes the figures
//! at the end.
//!
//! Start at [`Arm::simulate`]. `RunLoop::go` steps the arm and its rigid twin, updates `Monitors`,
//! and passes samples to recorders, curves and observer. `figures` computes the figures from the
//! monitors, `events` the list of events. Poses in the world, SI units. Not here: steppers
//! (`flexarm-stepping`), formats of recordings (`flexarm-log`), the report (`report`).

pub(crate) mod comparison;
pub(crate) mod headline;
pub mod magnification;
pub(crate) mod monitor;
pub mod prepare;
pub mod record;
pub(crate) mod settling;
pub(crate) mod static_part;
pub(crate) mod stepper_settings;
pub(crate) mod study;
pub mod summary;
pub(crate) mod twin;

mod before;
mod events;
mod figures;
mod request;
mod sampler;
mod shares;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm_analysis::{LongRecord, MetricSettings, PathFrame};
use flexarm_files::check_apart;
use flexarm_kinematics::Frame;
use flexarm_linkmaker::Stopwatch;
use flexarm_log::{
    Attachment, BendInfo, Columns, Event, EventKind, Recorder, RecorderSet, RunHeader, RunResult, Sample, Trace,
};
use flexarm_stepping::{Observation, Plant, Stepper};

use rayon::prelude::*;

use crate::arm::bends::stations;
use crate::arm::options::{Outputs, RunOptions};
use crate::arm::{Arm, Owner};
use crate::caveat::{self, Finding};
use crate::error::Error;
use crate::motions::motion::Motion;
use crate::motions::scenario::Scenario;
use crate::robot::Robot;
use crate::run::magnification::{Expected, fit_color_scale};
use crate::run::monitor::Monitors;
use crate::run::monitor::stress::StressMonitor;
use crate::run::monitor::tool::ToolMonitor;
use crate::run::prepare::Checked;
use crate::run::record::{
    Recordings, STRESS_PICTURE, files_of_a_run, header, link_frames, names_of_signals, ordered_links, recorders,
    signals, write_bag_metadata, write_layouts,
};
use crate::run::sampler::Sampler;
pub(crate) use crate::run::sampler::link_side_angles;
use crate::run::shares::AtPeak;
use crate::run::static_part::StaticPart;
use crate::run::summary::{Files, Summary};
use crate::run::twin::RigidTwin;

pub use before::BeforeRun;
pub use figures::static_sag;
pub use request::{Keep, Progress, Run, RunRequest, SampleObserver};

use request::Detail;

/// Name of the servo following error among the contributors to the TCP error.
const FOLLOWING_ERROR: &str = "following error";

/// Fraction of the first natural frequency at the start; the arm is assumed to have no natural
/// frequency below it anywhere along the motion.
const RINGING_FROM: f64 = 0.5;

/// Coordinates times steps between two calls of the progress callback, so that large models react
/// to a stop soon.
const POLL_EVERY: usize = 2000;
/// Maximum number of steps between two calls.
const RAREST_POLL: usize = 64;

/// Number of samples above which the page is made after the recordings are closed, which saves
/// memory but takes a little longer.
const LONG_RUN: u64 = 100_000;

impl Arm {
    /// Runs a motion (`&motion`), or a motion with loads, payloads and a start condition
    /// (`&scenario`), and returns figures and columns.
    ///
    /// # Errors
    /// [`Error`]; [`Error::fault`] returns whether the input or the run is at fault.
    pub fn simulate(&self, scenario: impl Into<Scenario>, options: &RunOptions) -> Result<Run, Error> {
        self.simulate_with(scenario, options, RunRequest::default())
    }

    /// As [`Arm::simulate`], with recordings, an observer, progress or fewer signals kept,
    /// according to `request`.
    ///
    /// The whole input is checked before the first file is created. If the run stops early, the
    /// recordings are closed such that every reader accepts them.
    ///
    /// # Errors
    /// As [`Arm::simulate`]; [`Error::Interrupted`] if observer or progress breaks.
    pub fn simulate_with(
        &self,
        scenario: impl Into<Scenario>,
        options: &RunOptions,
        request: RunRequest<'_>,
    ) -> Result<Run, Error> {
        simulate(self, &scenario.into(), options, request)
    }

    /// Runs all scenarios on all cores. Results are bitwise identical to [`Arm::simulate`], for any
    /// number of threads. Once `stop` returns true, unfinished runs end with
    /// [`Error::Interrupted`].
    ///
    /// Uses the thread pool of `rayon`. A failed run does not stop the others.
    pub fn simulate_batch(
        &self,
        scenarios: &[Scenario],
        options: &RunOptions,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Result<Run, Error>> {
        let one = |scenario| {
            let progress = &mut |_, _| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            self.simulate_with(scenario, options, RunRequest { progress: Some(progress), ..RunRequest::default() })
        };
        scenarios.par_iter().map(one).collect()
    }
}

/// Runs a scenario.
pub(crate) fn simulate(
    arm: &Arm,
    scenario: &Scenario,
    options: &RunOptions,
    request: RunRequest<'_>,
) -> Result<Run, Error> {
    let stopwatch = Stopwatch::start();
    let robot = arm.robot();
    let Checked { plant, stepper, load_caveats } = arm.checked(scenario, options)?;
    let detail = Detail::of(&request);
    let RunRequest { keep, outputs, mut observer, progress, recorders: more, expected } = request;
    let mut to_the_end = |_, _| ControlFlow::Continue(());
    let progress = progress.unwrap_or(&mut to_the_end);

    // Polls before the first file is created, so that a stop during preparation leaves no files.
    if progress(0.0, scenario.duration_s()).is_break() {
        return Err(Error::Interrupted { t: 0.0, partial: false });
    }
    let shares_scale = expected.is_some();
    let expected = expected.unwrap_or_else(|| detail.expected(&plant, &arm.tcp, scenario));
    let mut run = RunLoop::new(&scenario.motion, options, arm, plant, stepper, detail)?;
    let mut files = open_recordings(outputs, more, &[&robot.path, &robot.urdf_path, &scenario.motion.path])?;
    let head = run.header(scenario, &expected);
    files.begin(&head)?;
    write_layouts(outputs, &head)?;
    files.set.on_threads();
    let mut columns = (keep == Keep::Columns).then(|| Columns::new(&head));
    run.trace = detail.trace(outputs.is_some(), head);
    let mut watch = |sample: &Sample| {
        columns.iter_mut().for_each(|columns| columns.push(sample));
        observer.as_mut().map_or(ControlFlow::Continue(()), |observer| observer(sample))
    };
    let end = run.go(&mut files.set, outputs.is_some(), progress, &mut watch);
    if !shares_scale {
        fit_color_scale([&mut run.trace]);
    }

    let (mut summary, mut events) = run.summary(arm.robot_caveats().to_vec());
    let end = end.map_err(|error| events::beyond_model(error, &summary.caveats));
    if let Err(error) = &end {
        events.push(Event { time_s: run.observed.t, kind: EventKind::Stopped, text: error.to_string() });
    }
    complete(&mut summary, load_caveats, &end, &stopwatch);
    let stress = run.monitors.stress.as_ref();
    let picture = outputs.and_then(|_| stress.and_then(StressMonitor::picture));
    files.names.stress = outputs.zip(picture.as_ref()).map(|(outputs, png)| write_picture(outputs, png)).transpose()?;
    summary.files = files.names.clone();
    run.trace.finish(match detail {
        Detail::Curves => {
            let scenery = stress.map_or_else(Vec::new, StressMonitor::scenery);
            RunResult { scenery, ..result(&summary, events, picture) }
        }
        _ => RunResult::default(),
    });
    how_it_ended(end, write_results(&mut files, outputs, &summary, &run.trace))?;
    Ok(Run { summary, columns: columns.unwrap_or_default(), trace: run.trace })
}

/// Opens the recordings of a run, none of which may be a file of its input.
fn open_recordings(
    outputs: Option<&Outputs>,
    more: Vec<Box<dyn Recorder>>,
    input: &[&Path],
) -> Result<Recordings, Error> {
    if let Some(outputs) = outputs {
        let all: Vec<PathBuf> = files_of_a_run().map(|file| outputs.folder.join(file)).collect();
        check_apart(&all, input)?;
    }
    let mut files = recorders(outputs, !more.is_empty())?;
    files.set.extend(more);
    Ok(files)
}

/// Writes the picture of the stress; returns its path.
fn write_picture(outputs: &Outputs, png: &[u8]) -> Result<String, Error> {
    let path = outputs.folder.join(STRESS_PICTURE);
    let name = path.display().to_string();
    flexarm_files::write_all(&[(path, png)])?;
    Ok(name)
}

/// Closes the recordings and writes page and figures.
fn write_results(
    files: &mut Recordings,
    outputs: Option<&Outputs>,
    summary: &Summary,
    trace: &Trace,
) -> Result<(), Error> {
    // In short runs the page is made while the recordings are being closed, in long runs
    // afterwards, because both need memory.
    files.set.begin_to_finish(&trace.result);
    let make_page = || outputs.map(|_| crate::report::page(summary, trace));
    let early = if trace.samples() < LONG_RUN { make_page() } else { None };
    let closed = files.set.finish(&trace.result).map_err(Error::from);
    let closed = closed.and_then(|()| write_bag_metadata(outputs));
    let page = early.or_else(make_page);
    let write = |(outputs, page): (_, String)| crate::report::write(outputs, summary, trace, &page);
    closed.and_then(|()| outputs.zip(page).map_or(Ok(()), write))
}

/// Adds caveats about loads, how the run ended, and its times.
fn complete(summary: &mut Summary, load_caveats: Vec<Finding>, end: &Result<(), Error>, stopwatch: &Stopwatch) {
    summary.caveats.extend(load_caveats);
    summary.caveats = caveat::once_each(std::mem::take(&mut summary.caveats));
    summary.warnings = caveat::warnings(&summary.caveats);
    summary.end = end.as_ref().map_or_else(ToString::to_string, |()| "complete".into());
    summary.wall_s = stopwatch.wall_s();
    summary.cpu_s = stopwatch.cpu_s();
    summary.real_time_factor = summary.duration_s / summary.wall_s.max(1e-9);
    summary.cpu_s_per_simulated_s = summary.cpu_s / summary.duration_s.max(1e-9);
}

/// Chooses the error to return if the run or the writing of its results failed. The error that
/// stopped the run comes first, because after a full disk, closing fails as well; but it must not
/// refer to a log that does not exist.
fn how_it_ended(end: Result<(), Error>, reported: Result<(), Error>) -> Result<(), Error> {
    match (end, reported) {
        (Err(Error::Interrupted { .. }), Err(lost)) => Err(lost),
        (Err(Error::Step { source, .. }), Err(_)) => Err(Error::Step { source, partial: false }),
        (end, reported) => end.and(reported),
    }
}

/// Result for the recordings. It contains no timings, so recordings of the same run are identical
/// byte for byte.
fn result(summary: &Summary, events: Vec<Event>, picture: Option<Vec<u8>>) -> RunResult {
    let timeless =
        Summary { wall_s: 0.0, cpu_s: 0.0, real_time_factor: 0.0, cpu_s_per_simulated_s: 0.0, ..summary.clone() };
    let timeless = Summary { files: Files::default(), ..timeless };
    let json = serde_json::to_string_pretty(&timeless).expect("plain numbers and strings") + "\n";
    let headline = Some(("result".to_owned(), timeless.headline.clone())).filter(|(_, line)| !line.is_empty());
    let file =
        |name: &str, media_type: &str, bytes| Attachment { name: name.into(), media_type: media_type.into(), bytes };
    let picture = picture.map(|png| file(STRESS_PICTURE, "image/png", png));
    RunResult {
        figures: summary.labelled(),
        readable: headline.into_iter().chain(crate::report::timeless_rows(&timeless)).collect(),
        events,
        attachments: [file("summary.json", "application/json", json.into_bytes())].into_iter().chain(picture).collect(),
        scenery: Vec::new(),
    }
}

/// Part of the robot that contributes to the TCP error.
struct Contributor {
    /// Index among all displacements: links, then drives, then the following error.
    place: usize,
    name: String,
    kind: &'static str,
}

/// Lists the flexible links, the elastic drives and the following error of the servos.
fn contributors(robot: &Robot, arm: &Arm, plant: &Plant) -> Vec<Contributor> {
    let (n_links, n_drives) = (arm.spans.len(), robot.drives.len());
    let drives = robot.drives.iter().enumerate().filter(|(k, _)| arm.owners.contains(&Owner::Drive(*k)));
    let kind = |name: &str| if robot.stands_on(name) { headline::MOUNTING } else { headline::LINK };
    let links = arm.spans.iter().enumerate().map(|(k, span)| (k, span.link.clone(), kind(&span.link)));
    let drives = drives.map(|(k, drive)| (n_links + k, drive.joint.clone(), headline::GEARBOX));
    let follows = !plant.torque_driven.is_empty();
    let following = follows.then(|| (n_links + n_drives, FOLLOWING_ERROR.to_owned(), headline::SERVO));
    let contributors = links.chain(drives).chain(following);
    contributors.map(|(place, name, kind)| Contributor { place, name, kind }).collect()
}

/// State of a run in progress: the stepper with the arm, the rigid twin, and the monitors.
struct RunLoop<'a> {
    robot: &'a Robot,
    motion: &'a Motion,
    options: &'a RunOptions,
    arm: &'a Arm,
    /// Arm whose model is that of the last sample, including its current payload.
    plant: Arc<Plant>,
    stepper: Box<dyn Stepper>,
    tcp: Frame,
    twin: RigidTwin,
    observed: Observation,
    monitors: Monitors,
    sampler: Sampler,
    sample: Sample,
    /// Curves so far, and the sample with the maximum error.
    trace: Trace,
    bends: Vec<BendInfo>,
    contributors: Vec<Contributor>,
    at_peak: AtPeak,
    /// Maximum torque of each motor that moves several joints.
    motors: std::collections::BTreeMap<String, f64>,
    detail: Detail,
    /// Number of steps between two samples.
    every: u64,
    /// Total number of steps.
    last: u64,
}

impl<'a> RunLoop<'a> {
    fn new(
        motion: &'a Motion,
        options: &'a RunOptions,
        arm: &'a Arm,
        plant: Arc<Plant>,
        stepper: Box<dyn Stepper>,
        detail: Detail,
    ) -> Result<Self, Error> {
        let (robot, tcp) = (arm.robot(), arm.tcp.clone());
        let duration = motion.trajectory.duration();
        let last = (duration / options.step_s - 1e-9).ceil().max(0.0) as u64;
        let every = steps_per_sample(options);
        let mut twin = RigidTwin::new(&plant);
        let tool = tool_monitor(&plant, &tcp, &mut twin, motion, options, every as f64 * options.step_s);
        let (n_drives, stress) = (robot.drives.len(), StressMonitor::new(arm, &plant)?);
        // Recordings and observers need the frames of the links; columns and figures do not.
        let (mut bends, mut places, mut frames) = Default::default();
        if detail >= Detail::Samples {
            (bends, places) = stations(&arm.bends, &plant.model, &ordered_links(robot));
            frames = link_frames(robot, &plant.model);
        }
        Ok(Self {
            robot,
            motion,
            options,
            arm,
            tcp,
            twin,
            observed: Observation::new(&plant),
            monitors: Monitors::new(&plant, arm, n_drives, tool, stress, motion.tool_path.clone()),
            sampler: Sampler::new(robot, arm, frames, places),
            sample: Sample::default(),
            trace: Trace::default(),
            bends,
            contributors: contributors(robot, arm, &plant),
            at_peak: AtPeak::default(),
            motors: Default::default(),
            detail,
            every,
            last,
            plant,
            stepper,
        })
    }

    /// Returns the header of recordings and curves, as far as `detail` needs it.
    fn header(&self, scenario: &Scenario, expected: &Expected) -> RunHeader {
        let (robot, options, stress) = (self.robot, self.options, self.monitors.stress.as_ref());
        let head = match self.detail {
            Detail::Figures => RunHeader::default(),
            Detail::Columns => names_of_signals(robot, &self.plant),
            Detail::Samples => signals(robot, &self.plant),
            Detail::Curves => header(self.arm, scenario, options, &self.plant),
        };
        RunHeader {
            has_rigid: options.with_twin,
            bends: self.bends.clone(),
            contributors: self.contributors.iter().map(|c| c.name.clone()).collect(),
            gauges: stress.map_or_else(Vec::new, StressMonitor::channels),
            has_stress: stress.is_some(),
            has_static: options.with_twin,
            color_scale_m: expected.color_scale_m(),
            volume: expected.volume,
            magnification: options.magnification.unwrap_or_else(|| expected.magnification()),
            ..head
        }
    }

    /// Steps to the end and logs on the way.
    fn go(
        &mut self,
        files: &mut RecorderSet,
        partial: bool,
        progress: &mut Progress<'_>,
        observer: &mut SampleObserver<'_>,
    ) -> Result<(), Error> {
        let total = self.last as f64 * self.options.step_s;
        let poll_every = (POLL_EVERY / self.plant.model.nv().max(1)).clamp(1, RAREST_POLL) as u64;
        for step in 0..=self.last {
            if step % self.every == 0 || step == self.last {
                self.observe(step);
                files.record(&self.sample)?;
                self.trace.push(&self.sample);
                if observer(&self.sample).is_break() {
                    return Err(Error::Interrupted { t: self.stepper.time(), partial });
                }
            }
            if step % poll_every == 0 && progress(self.stepper.time(), total).is_break() {
                return Err(Error::Interrupted { t: self.stepper.time(), partial });
            }
            if step < self.last {
                self.stepper.step().map_err(|source| Error::Step { source, partial })?;
            }
        }
        Ok(())
    }

    /// Compares with the twin, updates the monitors, and fills the sample to the requested level of
    /// detail.
    fn observe(&mut self, step: u64) {
        self.stepper.observe(&mut self.observed);
        // The twin carries the same payload as the arm.
        if !Arc::ptr_eq(&self.plant.model, &self.observed.model) {
            Arc::make_mut(&mut self.plant).model.clone_from(&self.observed.model);
        }
        // The torques of the twin are needed only in samples.
        match self.detail {
            Detail::Figures => self.twin.place(&self.plant, &self.tcp, self.observed.t),
            _ => self.twin.update(&self.plant, &self.tcp, self.observed.t),
        }
        if self.plant.coupling.is_some() {
            for (motor, torque) in self.robot.motor_torques(&self.plant, self.observed.drive.as_slice()) {
                let peak = self.motors.entry(motor).or_default();
                *peak = peak.max(torque.abs());
            }
        }
        let tool = self.monitors.update(&self.observed, &self.twin, &self.plant, &self.tcp);
        self.at_peak.update(&tool.error, &self.observed, &self.twin);
        let sample = &mut self.sample;
        sample.error_world = tool.error;
        if self.detail > Detail::Figures {
            self.sampler.fill(sample, &self.observed, &self.twin, &tool);
            sampler::fill_elastic(sample, &self.observed, &self.plant);
        }
        let moved = self.monitors.contributions.moved();
        sample.contributions.clear();
        sample.contributions.extend(self.contributors.iter().map(|who| [0, 1, 2].map(|c| moved[who.place][c])));
        if let Some(stress) = &self.monitors.stress {
            stress.read_gauges(&self.observed, &mut sample.gauges);
        }
        sample.step = step;
        let (iterations, correction) = self.stepper.last_iteration();
        sample.solver = [iterations as f64, correction];
    }
}

/// Returns the number of steps between two logged samples.
pub fn steps_per_sample(options: &RunOptions) -> u64 {
    ((1.0 / (options.log_rate_hz * options.step_s)).round() as u64).max(1)
}

/// Builds the TCP monitor of a run with sampling interval `sample_s` (s).
fn tool_monitor(
    plant: &Arc<Plant>,
    tcp: &Frame,
    twin: &mut RigidTwin,
    motion: &Motion,
    options: &RunOptions,
    sample_s: f64,
) -> ToolMonitor {
    // Before the first motion, the path axes are those at its start.
    let (trajectory, duration) = (&motion.trajectory, motion.trajectory.duration());
    let mut still_until = 0.0;
    let instants = (0..=1000).map(|k| duration * f64::from(k) * 1e-3).filter(|t| {
        if *t >= still_until {
            still_until = trajectory.still_until(*t);
        }
        *t >= still_until
    });
    let path = PathFrame::before(instants.map(|t| twin.rates(plant, tcp, t)));
    let static_part = options.with_twin.then(|| StaticPart::new(plant, tcp, moves(motion), duration, sample_s));
    // The arm settles at the static part, unless servos move the joints or loads act.
    let rests_there = plant.torque_driven.is_empty() && plant.loads.is_empty();
    let first_hz = plant.modes.frequencies_hz().first().copied().unwrap_or(0.0);
    let settings = MetricSettings { settling_band_m: options.settling_band_m, lowest_hz: RINGING_FROM * first_hz };
    let record = LongRecord::new(moves(motion), rests_there, settings);
    ToolMonitor::new(path, static_part, record.with_capacity((duration / sample_s) as usize + 2))
}

/// Returns the start and end of each move (s).
fn moves(motion: &Motion) -> Vec<(f64, f64)> {
    motion.trajectory.moves().iter().map(|m| (m.start, m.end)).collect()
}
