//! The main job: rigid and flexible run along one motion, logged while it goes on, measured at the end.
//!
//! The loop is [`Run::go`]: the stepper steps, the twin stands beside it, [`Monitors`] watch, and a sample goes to recorders,
//! curves and observer. Figures of what was seen are in `figures`, what happened when in `events`.

mod before;
mod events;
mod figures;
mod sampler;
mod shares;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use flexarm_analysis::{LongRecord, MetricSettings, PathFrame};
use flexarm_kinematics::Frame;
use flexarm_log::{Attachment, BendInfo, Event, EventKind, Recorder, RecorderSet, RunHeader, RunResult, Sample, Trace};
use flexarm_stepping::{FlexibleArm, Observation, Stepper};

use crate::bends::stations;
use crate::caveat::{self, Caveat};
use crate::error::Error;
use crate::flexible::{FlexibleRobot, Owner};
use crate::headline;
use crate::magnification::{Expected, fit_color_scale};
use crate::monitor::Monitors;
use crate::monitor::tool::ToolMonitor;
use crate::motion::Motion;
use crate::options::{Outputs, RunOptions};
use crate::prepare::{Checked, Prepared, checked};
use crate::record::{header, link_frames, names_of_signals, ordered_links, recorders, signals, write_layouts};
use crate::robot::Robot;
use crate::run::sampler::Sampler;
use crate::run::shares::AtPeak;
use crate::scenario::Scenario;
use crate::static_part::StaticPart;
use crate::summary::{Files, Summary};
use crate::twin::RigidTwin;

pub use before::BeforeRun;
pub use figures::static_sag;

/// What servos leave of the way to go, among the contributors to the TCP error.
const FOLLOWING_ERROR: &str = "following error";

/// Part of the first natural frequency at the start below which the arm does not ring anywhere on its way.
const RINGING_FROM: f64 = 0.5;

/// Coordinates times steps between two looks at the progress callback: a stop must not wait for many large steps.
const POLL_EVERY: usize = 2000;
/// Most steps between two looks.
const RAREST_POLL: usize = 64;

/// Called with simulated and total time; breaking off stops the run with readable files.
pub type Progress<'a> = dyn FnMut(f64, f64) -> ControlFlow<()> + 'a;

/// Runs a motion, or a motion with all else that happens, writes the recordings and returns the figures.
///
/// Everything about the input is checked before the first file is made. If the run stops early, the recordings are
/// closed so that every reader takes them.
///
/// # Errors
/// [`Error`]; see [`Error::fault`].
pub fn simulate(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    progress: &mut Progress<'_>,
) -> Result<Summary, Error> {
    let together = Together { wanted: Wanted::of(outputs), ..Together::default() };
    run_traced(robot, &scenario.into(), options, outputs, together, progress).map(|(summary, _)| summary)
}

/// As [`simulate`], of a robot that is modelled already.
///
/// * `flexible`: what [`Robot::modelled`] makes of the options' own modelling.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_modelled(
    robot: &Robot,
    flexible: FlexibleRobot,
    scenario: impl Into<Scenario>,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    progress: &mut Progress<'_>,
) -> Result<Summary, Error> {
    let prepared = Prepared::new(flexible);
    let together = Together { wanted: Wanted::of(outputs), prepared: Some(&prepared), ..Together::default() };
    run_traced(robot, &scenario.into(), options, outputs, together, progress).map(|(summary, _)| summary)
}

/// As [`simulate`], and returns the curves of the run, which are thinned if it is long ([`Trace`]). All samples are in the
/// recordings and in the columns of [`crate::Run`].
///
/// # Errors
/// As [`simulate`].
pub fn simulate_traced(
    robot: &Robot,
    scenario: impl Into<Scenario>,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    progress: &mut Progress<'_>,
) -> Result<(Summary, Trace), Error> {
    run_traced(robot, &scenario.into(), options, outputs, Together::default(), progress)
}

/// Called with each logged sample of a run and what stays the same; breaking off stops it.
pub(crate) type Observer<'a> = dyn FnMut(&RunHeader, &Sample) -> ControlFlow<()> + 'a;

/// What of a run is seen by others; each level has what is before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wanted {
    /// The summary alone.
    Figures,
    /// The signals of [`flexarm_log::Columns`].
    Columns,
    /// Whole samples.
    Samples,
    /// Curves, and all that recordings say of a run.
    #[default]
    Curves,
}

impl Wanted {
    /// Of a run that is seen by its files alone.
    fn of(outputs: Option<&Outputs>) -> Self {
        if outputs.is_some() { Self::Curves } else { Self::Figures }
    }
}

/// What a run shares with others that it is seen with, or gets from who prepared it.
#[derive(Default)]
pub struct Together<'a> {
    /// Recorders beside those of its own outputs.
    pub(crate) recorders: Vec<Box<dyn Recorder>>,
    /// Deflections of all of them, for a scale in common.
    pub(crate) expected: Option<Expected>,
    /// What of it is seen; all if there are recorders.
    pub(crate) wanted: Wanted,
    /// [`Robot::caveats`], if they are known.
    pub(crate) robot_caveats: Option<Arc<[Caveat]>>,
    /// Who looks at the samples.
    pub(crate) observer: Option<&'a mut Observer<'a>>,
    /// The robot as it is to be modelled, if that has been done.
    pub(crate) prepared: Option<&'a Prepared>,
}

/// Samples from which on a run takes a little longer at its end, for less memory.
const LONG_RUN: u64 = 100_000;

/// As [`simulate_traced`], as one of several runs.
pub fn run_traced(
    robot: &Robot,
    scenario: &Scenario,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    together: Together<'_>,
    progress: &mut Progress<'_>,
) -> Result<(Summary, Trace), Error> {
    let started = Instant::now();
    let cpu = cpu_time::ProcessTime::now();
    let Checked { flexible, arm, stepper, load_caveats } = checked(robot, scenario, options, together.prepared)?;

    // Before the first file is made, so that a stop during the preparation leaves none.
    if progress(0.0, scenario.duration_s()).is_break() {
        return Err(Error::Interrupted { t: 0.0, partial: false });
    }
    let wanted = together.wanted;
    let own = || match wanted {
        Wanted::Curves => Expected::of(&arm, &flexible.tcp, scenario.duration_s(), scenario.start),
        // How far things are shown enlarged is asked by nobody but recordings.
        _ => Expected::default(),
    };
    let shares_scale = together.expected.is_some();
    let expected = together.expected.unwrap_or_else(own);
    let mut run = Run::new(robot, &scenario.motion, options, &flexible, arm, stepper, wanted);
    let mut files = recorders(outputs, !together.recorders.is_empty())?;
    files.set.extend(together.recorders);
    let mut head = match wanted {
        Wanted::Figures => RunHeader::default(),
        Wanted::Columns => names_of_signals(robot, &run.arm),
        Wanted::Samples => signals(robot, &run.arm),
        Wanted::Curves => header(robot, scenario, options, &run.arm, flexible.links_model()),
    };
    head.has_rigid = options.with_twin;
    head.bends.clone_from(&run.bends);
    head.contributors = run.contributors.iter().map(|c| c.name.clone()).collect();
    head.has_static = options.with_twin;
    head.color_scale_m = expected.color_scale_m();
    head.volume = expected.volume;
    head.magnification = options.magnification.unwrap_or_else(|| expected.magnification());
    files.begin(&head)?;
    write_layouts(&files.names, &head)?;
    files.set.on_threads();
    run.trace = match outputs {
        _ if wanted < Wanted::Curves => Trace::without_curves(head),
        Some(_) => Trace::for_page(head),
        None => Trace::new(head),
    };
    let end = run.go(&mut files.set, outputs.is_some(), progress, together.observer);
    if !shares_scale {
        fit_color_scale([&mut run.trace]);
    }

    let robot_caveats = together.robot_caveats.map_or_else(|| robot.caveats(), |known| known.to_vec());
    let (mut summary, mut events) = run.summary(robot_caveats);
    if let Err(error) = &end {
        events.push(Event { time_s: run.seen.t, kind: EventKind::Stopped, text: error.to_string() });
    }
    summary.caveats.extend(load_caveats);
    summary.caveats = caveat::once_each(std::mem::take(&mut summary.caveats));
    summary.warnings = caveat::warnings(&summary.caveats);
    summary.end = end.as_ref().map_or_else(ToString::to_string, |()| "complete".into());
    summary.wall_s = started.elapsed().as_secs_f64();
    summary.cpu_s = cpu.elapsed().as_secs_f64();
    summary.real_time_factor = summary.duration_s / summary.wall_s.max(1e-9);
    summary.cpu_s_per_simulated_s = summary.cpu_s / summary.duration_s.max(1e-9);
    summary.files = files.names.clone();
    run.trace.finish(if wanted < Wanted::Curves { RunResult::default() } else { result(&summary, events) });
    // The page is made while the recordings are closed, of long runs afterwards: each takes memory, the page what they leave.
    files.set.begin_to_finish(&run.trace.result);
    let make_page = || outputs.map(|_| crate::report::page(&summary, &run.trace));
    let early = if run.trace.samples() < LONG_RUN { make_page() } else { None };
    let closed = files.set.finish(&run.trace.result).map_err(Error::from);
    let page = early.or_else(make_page);
    let write = |(outputs, page): (_, String)| crate::report::write(outputs, &summary, &run.trace, &page);
    let reported = closed.and_then(|()| outputs.zip(page).map_or(Ok(()), write));
    how_it_ended(end, reported).map(|()| (summary, run.trace))
}

/// The error to tell, if the run or the writing of its result failed. What stopped the run is the news: after a full disk,
/// closing fails again. But nobody must be told of a log that is not there.
fn how_it_ended(end: Result<(), Error>, reported: Result<(), Error>) -> Result<(), Error> {
    match (end, reported) {
        (Err(Error::Interrupted { .. }), Err(lost)) => Err(lost),
        (Err(Error::Step { source, .. }), Err(_)) => Err(Error::Step { source, partial: false }),
        (end, reported) => end.and(reported),
    }
}

/// What recordings are told at the end. Timings stay out of it: recordings of the same run are the same bytes.
fn result(summary: &Summary, events: Vec<Event>) -> RunResult {
    let timeless =
        Summary { wall_s: 0.0, cpu_s: 0.0, real_time_factor: 0.0, cpu_s_per_simulated_s: 0.0, ..summary.clone() };
    let timeless = Summary { files: Files::default(), ..timeless };
    let json = serde_json::to_string_pretty(&timeless).expect("plain numbers and strings") + "\n";
    RunResult {
        figures: summary.labelled(),
        readable: crate::report::timeless_rows(&timeless),
        events,
        attachments: vec![Attachment {
            name: "summary.json".into(),
            media_type: "application/json".into(),
            bytes: json.into_bytes(),
        }],
    }
}

/// Who moves the tool.
struct Contributor {
    /// Place among all displacements: links, then drives, then what servos leave.
    place: usize,
    name: String,
    kind: &'static str,
}

/// Flexible links, elastic drives and what servos leave.
fn contributors(robot: &Robot, flexible: &FlexibleRobot, arm: &FlexibleArm) -> Vec<Contributor> {
    let (n_links, n_drives) = (flexible.spans.len(), robot.drives.len());
    let drives = robot.drives.iter().enumerate().filter(|(k, _)| flexible.owners.contains(&Owner::Drive(*k)));
    let kind = |name: &str| if robot.stands_on(name) { headline::MOUNTING } else { headline::LINK };
    let links = flexible.spans.iter().enumerate().map(|(k, span)| (k, span.link.clone(), kind(&span.link)));
    let drives = drives.map(|(k, drive)| (n_links + k, drive.joint.clone(), headline::GEARBOX));
    let follows = !arm.torque_driven.is_empty();
    let following = follows.then(|| (n_links + n_drives, FOLLOWING_ERROR.to_owned(), headline::SERVO));
    let contributors = links.chain(drives).chain(following);
    contributors.map(|(place, name, kind)| Contributor { place, name, kind }).collect()
}

/// A run under way: the stepper with the arm, the twin beside it, and who watches.
struct Run<'a> {
    robot: &'a Robot,
    motion: &'a Motion,
    options: &'a RunOptions,
    flexible: &'a FlexibleRobot,
    /// The model is that of the last sample, with what it carries then.
    arm: Arc<FlexibleArm>,
    stepper: Box<dyn Stepper>,
    tcp: Frame,
    twin: RigidTwin,
    seen: Observation,
    monitors: Monitors,
    sampler: Sampler,
    sample: Sample,
    /// The curves so far, and the sample of the largest error.
    trace: Trace,
    bends: Vec<BendInfo>,
    contributors: Vec<Contributor>,
    at_peak: AtPeak,
    /// Largest torque per motor that moves several joints.
    motors: std::collections::BTreeMap<String, f64>,
    wanted: Wanted,
    /// Steps between two samples, and all.
    every: u64,
    last: u64,
}

impl<'a> Run<'a> {
    fn new(
        robot: &'a Robot,
        motion: &'a Motion,
        options: &'a RunOptions,
        flexible: &'a FlexibleRobot,
        arm: Arc<FlexibleArm>,
        stepper: Box<dyn Stepper>,
        wanted: Wanted,
    ) -> Self {
        let tcp = flexible.tcp.clone();
        let duration = motion.trajectory.duration();
        let last = (duration / options.step_s - 1e-9).ceil().max(0.0) as u64;
        let every = steps_per_sample(options);
        let mut twin = RigidTwin::new(&arm);
        let tool = tool_monitor(&arm, &tcp, &mut twin, motion, options, every as f64 * options.step_s);
        let (mut bends, mut places, mut frames) = Default::default();
        if wanted >= Wanted::Samples {
            (bends, places) = stations(&flexible.bends, &arm.model, &ordered_links(robot));
            frames = link_frames(robot, &arm.model);
        }
        Self {
            robot,
            motion,
            options,
            flexible,
            tcp,
            twin,
            seen: Observation::new(&arm),
            monitors: Monitors::new(&arm, flexible, robot.drives.len(), tool).along(motion.tool_path.clone()),
            sampler: Sampler::new(robot, flexible, frames, places),
            sample: Sample::default(),
            trace: Trace::default(),
            bends,
            contributors: contributors(robot, flexible, &arm),
            at_peak: AtPeak::default(),
            motors: Default::default(),
            wanted,
            every,
            last,
            arm,
            stepper,
        }
    }

    /// Steps to the end, logging on the way.
    fn go(
        &mut self,
        files: &mut RecorderSet,
        partial: bool,
        progress: &mut Progress<'_>,
        mut observer: Option<&mut Observer<'_>>,
    ) -> Result<(), Error> {
        let total = self.last as f64 * self.options.step_s;
        let poll_every = (POLL_EVERY / self.arm.model.nv().max(1)).clamp(1, RAREST_POLL) as u64;
        for step in 0..=self.last {
            if step % self.every == 0 || step == self.last {
                self.observe(step);
                files.record(&self.sample)?;
                self.trace.push(&self.sample);
                if let Some(observer) = &mut observer
                    && observer(&self.trace.header, &self.sample).is_break()
                {
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

    /// Compares with the twin, shows the monitors what there is, and fills the sample as far as it is wanted.
    fn observe(&mut self, step: u64) {
        self.stepper.observe(&mut self.seen);
        // The twin carries what the arm carries.
        if !Arc::ptr_eq(&self.arm.model, &self.seen.model) {
            Arc::make_mut(&mut self.arm).model.clone_from(&self.seen.model);
        }
        // What its drives must supply stands in samples alone.
        match self.wanted {
            Wanted::Figures => self.twin.place(&self.arm, &self.tcp, self.seen.t),
            _ => self.twin.update(&self.arm, &self.tcp, self.seen.t),
        }
        if self.arm.coupling.is_some() {
            for (motor, torque) in self.robot.motor_torques(&self.arm, self.seen.drive.as_slice()) {
                let peak = self.motors.entry(motor).or_default();
                *peak = peak.max(torque.abs());
            }
        }
        let tool = self.monitors.update(&self.seen, &self.twin, &self.arm, &self.tcp);
        self.at_peak.update(&tool.error, &self.seen, &self.twin);
        let sample = &mut self.sample;
        sample.error_world = tool.error;
        if self.wanted > Wanted::Figures {
            self.sampler.fill(sample, &self.seen, &self.twin, &tool);
            sampler::fill_elastic(sample, &self.seen, &self.arm);
        }
        let moved = self.monitors.contributions.moved();
        sample.contributions.clear();
        sample.contributions.extend(self.contributors.iter().map(|who| [0, 1, 2].map(|c| moved[who.place][c])));
        sample.step = step;
        let (iterations, correction) = self.stepper.last_iteration();
        sample.solver = [iterations as f64, correction];
    }
}

/// Steps from one logged sample to the next.
pub fn steps_per_sample(options: &RunOptions) -> u64 {
    ((1.0 / (options.log_rate_hz * options.step_s)).round() as u64).max(1)
}

/// For a run whose samples are `sample_s` apart (s).
fn tool_monitor(
    arm: &Arc<FlexibleArm>,
    tcp: &Frame,
    twin: &mut RigidTwin,
    motion: &Motion,
    options: &RunOptions,
    sample_s: f64,
) -> ToolMonitor {
    // Before the first motion the path axes are those of its beginning.
    let (trajectory, duration) = (&motion.trajectory, motion.trajectory.duration());
    let mut still_until = 0.0;
    let instants = (0..=1000).map(|k| duration * f64::from(k) * 1e-3).filter(|t| {
        if *t >= still_until {
            still_until = trajectory.still_until(*t);
        }
        *t >= still_until
    });
    let path = PathFrame::before(instants.map(|t| twin.rates(arm, tcp, t)));
    let static_part = options.with_twin.then(|| StaticPart::new(arm, tcp, moves(motion), duration, sample_s));
    // Stops come to rest where the static part is, unless servos bring the joints elsewhere or a load moves it.
    let rests_there = arm.torque_driven.is_empty() && arm.loads.is_empty();
    let first_hz = arm.modes.frequencies_hz().first().copied().unwrap_or(0.0);
    let settings = MetricSettings { settling_band_m: options.settling_band_m, lowest_hz: RINGING_FROM * first_hz };
    let record = LongRecord::new(moves(motion), rests_there, settings);
    ToolMonitor::new(path, static_part, record.with_room((duration / sample_s) as usize + 2))
}

/// Start and end of each move (s).
fn moves(motion: &Motion) -> Vec<(f64, f64)> {
    motion.trajectory.moves().iter().map(|m| (m.start, m.end)).collect()
}
