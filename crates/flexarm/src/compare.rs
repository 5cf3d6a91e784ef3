//! The main job: rigid and flexible run along one motion, logged while it goes on, measured at the end.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use flexarm_analysis::{
    ContributionPeaks, ErrorSample, LongRecord, MetricSettings, PathFrame, TcpMetrics, engineering_strain, tcp_error,
};
use flexarm_kinematics::{
    AxisMotion, Data, Frame, JointMotion, Pose, State, forward_kinematics, kinetic_energy, potential_energy,
    rotation_vector,
};
use flexarm_log::{
    Attachment, BendInfo, ElasticSample, EnergySample, Event, EventKind, Recorder, RecorderSet, RunHeader, RunResult,
    Sample, Trace,
};
use flexarm_stepping::{FlexibleArm, Observation, Stepper, StepperKind};
use flexarm_trajectory::LimitViolation;
use nalgebra::{Matrix6, Vector3, Vector6};

use crate::bends::stations;
use crate::caveat::pose::Standing;
use crate::caveat::{self, Caveat, drives, kinds, validity};
use crate::energy_book::EnergyBook;
use crate::error::Error;
use crate::flexible::{FlexibleRobot, Owner};
use crate::headline::{self, Bending, ShareFigures};
use crate::magnification::Expected;
use crate::motion::Motion;
use crate::options::{Outputs, RunOptions};
use crate::prepare::{Checked, checked};
use crate::record::{header, link_frames, ordered_links, recorders, write_layouts};
use crate::robot::{Robot, TCP_FRAME};
use crate::static_part::StaticPart;
use crate::summary::{CURVE_PIECES, DriveFigures, Files, LinkFigures, StepperFigures, Summary, TcpFigures};
use crate::twin::RigidTwin;

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

/// Runs a motion, writes the recordings and returns the figures.
///
/// Everything about the input is checked before the first file is made. If the run stops early, the recordings are
/// closed so that every reader takes them.
///
/// # Errors
/// [`Error`]; see [`Error::exit_code`].
pub fn simulate(
    robot: &Robot,
    motion: &Motion,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    progress: &mut Progress<'_>,
) -> Result<Summary, Error> {
    simulate_traced(robot, motion, options, outputs, progress).map(|(summary, _)| summary)
}

/// As [`simulate`], and returns the curves of the run.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_traced(
    robot: &Robot,
    motion: &Motion,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    progress: &mut Progress<'_>,
) -> Result<(Summary, Trace), Error> {
    run_traced(robot, motion, options, outputs, Together::default(), progress)
}

/// Called with each logged sample of a run and what stays the same; breaking off stops it.
pub(crate) type Observer<'a> = dyn FnMut(&RunHeader, &Sample) -> ControlFlow<()> + 'a;

/// What a run shares with others that it is seen with, or gets from who prepared it.
#[derive(Default)]
pub(crate) struct Together<'a> {
    /// Recorders beside those of its own outputs.
    pub(crate) recorders: Vec<Box<dyn Recorder>>,
    /// Deflections of all of them, for a scale in common.
    pub(crate) expected: Option<Expected>,
    /// Who looks at the samples.
    pub(crate) observer: Option<&'a mut Observer<'a>>,
    /// The robot as it is to be modelled, if that has been done.
    pub(crate) prepared: Option<FlexibleRobot>,
}

/// As [`simulate_traced`], as one of several runs.
pub(crate) fn run_traced(
    robot: &Robot,
    motion: &Motion,
    options: &RunOptions,
    outputs: Option<&Outputs>,
    together: Together<'_>,
    progress: &mut Progress<'_>,
) -> Result<(Summary, Trace), Error> {
    let started = Instant::now();
    let cpu = cpu_time::ProcessTime::now();
    let Checked { flexible, arm, stepper, load_caveats } = checked(robot, motion, options, together.prepared)?;

    // Before the first file is made, so that a stop during the preparation leaves none.
    if progress(0.0, motion.trajectory.duration()).is_break() {
        return Err(Error::Interrupted { t: 0.0, partial: false });
    }
    let own = || Expected::of(&arm, &tool_frame(&arm), motion.trajectory.duration(), options.start);
    let expected = together.expected.unwrap_or_else(own);
    let mut run = Run::new(robot, motion, options, &flexible, arm, stepper);
    let mut files = recorders(outputs, !together.recorders.is_empty())?;
    files.set.extend(together.recorders);
    let mut head = header(robot, motion, options, &run.arm, flexible.links_model());
    head.bends.clone_from(&run.bends);
    head.contributors = run.contributors.iter().map(|c| c.name.clone()).collect();
    head.has_static = options.with_twin;
    head.color_scale_m = expected.color_scale_m();
    head.volume = expected.volume;
    head.magnification = options.magnification.unwrap_or_else(|| expected.magnification());
    files.begin(&head)?;
    write_layouts(&files.names, &head)?;
    run.trace = Trace::new(head);
    let end = run.go(&mut files.set, outputs.is_some(), progress, together.observer);

    let (mut summary, mut events) = run.summary(robot, motion, options);
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
    run.trace.finish(result(&summary, events));
    let closed = files.set.finish(&run.trace.result).map_err(Error::from);
    let reported =
        closed.and_then(|()| outputs.map_or(Ok(()), |outputs| crate::report::write(outputs, &summary, &run.trace)));
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

pub(crate) fn tool_frame(arm: &FlexibleArm) -> Frame {
    arm.model.frame(TCP_FRAME).expect("added when the robot was loaded").clone()
}

/// Who moves the tool.
struct Contributor {
    /// Place among all displacements: links, then drives, then what servos leave.
    place: usize,
    name: String,
    kind: &'static str,
}

/// A run under way, with what has been seen of it.
struct Run<'a> {
    motion: &'a Motion,
    options: &'a RunOptions,
    flexible: &'a FlexibleRobot,
    arm: FlexibleArm,
    stepper: Box<dyn Stepper>,
    tcp: Frame,
    link_frames: Vec<Frame>,
    bends: Vec<BendInfo>,
    stations: Vec<Frame>,
    /// Flexible links, elastic drives and what servos leave.
    contributors: Vec<Contributor>,
    static_part: StaticPart,
    /// Static part of the error per sample (m).
    trace: Trace,
    /// When the force of a drive first passed its limit.
    overloaded: Vec<Option<f64>>,
    payload_times: Vec<f64>,
    twin: RigidTwin,
    seen: Observation,
    path: PathFrame,
    sample: Sample,
    record: LongRecord,
    contributions: ContributionPeaks,
    /// Largest engineering strain and rotation of the far end, per flexible link.
    strains: Vec<f64>,
    rotations: Vec<f64>,
    /// Largest deflection per elastic drive.
    give: Vec<f64>,
    /// Ends of the flexible links: frames of the link and of its far part.
    ends: Vec<(Frame, Frame)>,
    /// Link-side angle of a joint: actuated coordinate, elastic coordinate, weight.
    angles: Vec<(usize, usize, f64)>,
    energy: EnergyBook,
    peak_drive: Vec<f64>,
    /// Samples in which a servo was at its limit, per actuated coordinate.
    at_limit: Vec<usize>,
    every: u64,
    last: u64,
}

impl<'a> Run<'a> {
    fn new(
        robot: &Robot,
        motion: &'a Motion,
        options: &'a RunOptions,
        flexible: &'a FlexibleRobot,
        arm: FlexibleArm,
        stepper: Box<dyn Stepper>,
    ) -> Self {
        let (n_links, n_drives) = (flexible.spans.len(), robot.drives.len());
        let frame = |name: &str| arm.model.frame(name).expect("a link of the substitution").clone();
        let ends = flexible.spans.iter().map(|s| (frame(&s.link), frame(&s.distal_link))).collect();
        let tcp = tool_frame(&arm);
        let (bends, stations) = stations(&flexible.bends, &arm.model, &ordered_links(robot));
        let drives = robot.drives.iter().enumerate().filter(|(k, _)| flexible.owners.contains(&Owner::Drive(*k)));
        let links = flexible.spans.iter().enumerate().map(|(k, span)| (k, span.link.clone(), headline::LINK));
        let drives = drives.map(|(k, drive)| (n_links + k, drive.joint.clone(), headline::GEARBOX));
        let follows = !arm.torque_driven.is_empty();
        let following = follows.then(|| (n_links + n_drives, FOLLOWING_ERROR.to_owned(), headline::SERVO));
        let contributors = links.chain(drives).chain(following);
        let contributors = contributors.map(|(place, name, kind)| Contributor { place, name, kind });
        let mut twin = RigidTwin::new(&arm);
        // Before the first motion the path axes are those of its beginning.
        let duration = motion.trajectory.duration();
        let path = PathFrame::before((0..=1000).map(|k| {
            twin.update(&arm, &tcp, duration * f64::from(k) * 1e-3);
            [twin.velocity, twin.acceleration]
        }));
        let last = (motion.trajectory.duration() / options.step_s - 1e-9).ceil().max(0.0) as u64;
        let every = ((1.0 / (options.log_rate_hz * options.step_s)).round() as u64).max(1);
        let static_part = StaticPart::new(&arm, &tcp, moves(motion), duration, every as f64 * options.step_s);
        // Stops come to rest where the static part is, unless servos bring the joints elsewhere or a load moves it.
        let rests_there = arm.torque_driven.is_empty() && arm.loads.is_empty();
        let first_hz = arm.modes.frequencies_hz().first().copied().unwrap_or(0.0);
        let settings = MetricSettings { settling_band_m: options.settling_band_m, lowest_hz: RINGING_FROM * first_hz };
        Self {
            motion,
            options,
            flexible,
            tcp,
            link_frames: link_frames(robot, &arm.model),
            bends,
            stations,
            contributors: contributors.collect(),
            static_part,
            trace: Trace::default(),
            overloaded: vec![None; arm.model.n_actuated()],
            payload_times: arm.inertia_changes.iter().map(|change| change.t).collect(),
            twin,
            seen: Observation::new(&arm),
            path,
            sample: Sample::default(),
            record: LongRecord::new(moves(motion), rests_there, settings),
            contributions: ContributionPeaks::new(n_links + n_drives + 1),
            strains: vec![0.0; n_links],
            rotations: vec![0.0; n_links],
            give: vec![0.0; n_drives],
            ends,
            angles: link_side_angles(robot, flexible),
            energy: EnergyBook::default(),
            peak_drive: vec![0.0; arm.model.n_actuated()],
            at_limit: vec![0; arm.model.n_actuated()],
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

    /// Compares with the twin and fills the sample.
    fn observe(&mut self, step: u64) {
        let n = self.arm.model.n_actuated();
        self.stepper.observe(&mut self.seen);
        let t = self.seen.t;
        // The twin carries what the arm carries.
        let due = self.arm.inertia_changes.first().is_some_and(|change| change.t <= t + 1e-9);
        let before = if due { self.energy_with_payload() } else { 0.0 };
        while let Some(change) = self.arm.inertia_changes.first()
            && change.t <= t + 1e-9
        {
            let change = self.arm.inertia_changes.remove(0);
            self.arm.model = Arc::new(self.arm.model.with_inertia(change.body, change.inertia));
        }
        if due {
            // At the start the arm carries it already.
            self.energy.exchanged += if step > 0 { self.energy_with_payload() - before } else { 0.0 };
        }
        self.twin.update(&self.arm, &self.tcp, t);
        let X_rigid = self.twin.data.X_WF(&self.tcp);
        let X_flexible = self.seen.X_WB[self.tcp.body] * self.tcp.X_BF;
        let error = tcp_error(&X_rigid, &X_flexible);
        self.path = self.path.next(&self.twin.velocity);
        let [x, y, z, rx, ry, rz] = error;
        let [along, normal, binormal] = self.path.components(&Vector3::new(x, y, z));
        let [r_along, r_normal, r_binormal] = self.path.components(&Vector3::new(rx, ry, rz));
        let path_error = [along, normal, binormal, r_along, r_normal, r_binormal];
        for (k, drive) in self.seen.drive.iter().enumerate() {
            self.peak_drive[k] = self.peak_drive[k].max(drive.abs());
            if drive.abs() > self.arm.model.coordinates()[k].limits.effort {
                self.overloaded[k].get_or_insert(t);
            }
        }
        for axis in self.arm.servo.iter().flat_map(|servo| &servo.axes) {
            self.at_limit[axis.coordinate] += usize::from(self.seen.drive[axis.coordinate].abs() >= axis.limit);
        }

        let known = self.options.with_twin.then(|| self.static_part.at(t)).flatten();
        self.sample.static_m = known.unwrap_or([f64::NAN; 3]);
        self.record.push(&ErrorSample {
            time_s: t,
            error,
            path_error: [along, normal, binormal],
            rigid_position: X_rigid.translation.vector.into(),
            static_m: self.sample.static_m,
        });
        self.look_at_elements(t);
        let sample = &mut self.sample;
        sample.time_s = t;
        sample.step = step;
        sample.error_world = error;
        sample.error_path = path_error;
        let [kinetic, potential, elastic] = self.seen.energy;
        sample.energy = EnergySample { kinetic, potential, elastic };
        let (iterations, correction) = self.stepper.last_iteration();
        sample.solver = [iterations as f64, correction];

        let flexible = &mut sample.flexible;
        flexible.q.clear();
        flexible.q.extend_from_slice(&self.seen.q.as_slice()[..n]);
        flexible.qdot.clear();
        flexible.qdot.extend_from_slice(&self.seen.qdot.as_slice()[..n]);
        for &(k, e, weight) in &self.angles {
            flexible.q[k] += weight * self.seen.q[e];
            flexible.qdot[k] += weight * self.seen.qdot[e];
        }
        flexible.effort.clear();
        flexible.effort.extend_from_slice(self.seen.drive.as_slice());
        flexible.X_WL.clear();
        flexible.X_WL.extend(self.link_frames.iter().map(|f| self.seen.X_WB[f.body] * f.X_BF));
        flexible.X_WT = X_flexible;
        flexible.X_WS.clear();
        flexible.X_WS.extend(self.stations.iter().map(|f| self.seen.X_WB[f.body] * f.X_BF));

        let rigid = &mut sample.rigid;
        rigid.q.clear();
        rigid.q.extend_from_slice(&self.twin.state.q.as_slice()[..n]);
        rigid.qdot.clear();
        rigid.qdot.extend_from_slice(&self.twin.state.qdot.as_slice()[..n]);
        rigid.effort.clear();
        rigid.effort.extend_from_slice(&self.twin.data.tau.as_slice()[..n]);
        rigid.X_WL.clear();
        rigid.X_WL.extend(self.link_frames.iter().map(|f| self.twin.data.X_WF(f)));
        rigid.X_WT = X_rigid;
    }

    /// Kinetic and gravitational energy (J) of the last state seen, with what the arm carries now.
    fn energy_with_payload(&self) -> f64 {
        let mut data = Data::new(&self.arm.model);
        let state = State { q: self.seen.q.clone(), qdot: self.seen.qdot.clone() };
        let kinetic = kinetic_energy(&self.arm.model, &mut data, &state);
        kinetic + potential_energy(&self.arm.model, &mut data, &state.q)
    }

    /// Deflections and loads of the elements, what they do to the tool, how far the links are strained.
    fn look_at_elements(&mut self, t: f64) {
        let columns = self.flexible.spans.len();
        let mut moved = vec![Vector6::zeros(); columns + self.give.len() + 1];
        self.sample.elastic.resize(self.arm.elements.len(), ElasticSample::default());
        for (k, element) in self.arm.elements.iter().enumerate() {
            let range = (element.coordinate, element.size);
            let e = self.seen.q.rows(range.0, range.1);
            let displacement: Vector6<f64> = self.twin.J.columns(range.0, range.1) * e;
            match self.flexible.owners[k] {
                Owner::Link(link) => moved[link] += displacement,
                Owner::Drive(drive) => {
                    moved[columns + drive] += displacement;
                    let rotation = if element.size == 6 { e.rows(3, 3).norm() } else { e.norm() };
                    self.give[drive] = self.give[drive].max(rotation);
                }
            }
            let body = &self.arm.model.bodies()[element.body];
            let (mut deflection, mut load) = ([0.0; 6], self.seen.load[k].into());
            match (element.size, body.motion) {
                (1, JointMotion::Axis(motion)) => place(&mut deflection, &mut load, motion, e[0]),
                (n, _) => (0..n.min(6)).for_each(|c| deflection[c] = e[c]),
            }
            self.sample.elastic[k] = ElasticSample { deflection, load };
        }
        // Motors under servos are not where the trajectory wants them.
        let following = &mut moved[columns + self.give.len()];
        for &k in &self.arm.torque_driven {
            *following += self.twin.J.column(k) * (self.seen.q[k] - self.twin.state.q[k]);
        }
        let contributions = self.contributors.iter().map(|who| [0, 1, 2].map(|c| moved[who.place][c]));
        self.sample.contributions.clear();
        self.sample.contributions.extend(contributions);
        for (k, displacement) in moved.iter().enumerate() {
            self.contributions.update(k, t, &Matrix6::identity(), displacement);
        }
        for (k, (span, (near, far))) in self.flexible.spans.iter().zip(&self.ends).enumerate() {
            let pose = |frame: &Frame, X: &Pose| self.seen.X_WB[frame.body] * frame.X_BF * *X;
            let (X_WA, X_WB) = (pose(near, &span.X_LA), pose(far, &span.X_DB));
            let distance = (X_WB.translation.vector - X_WA.translation.vector).norm();
            let strain = engineering_strain(distance - span.length, span.length).map_or(0.0, f64::abs);
            // Both ends have the attitude that they have undeformed, up to the bending.
            let undeformed = |frame: &Frame, X: &Pose| self.twin.data.X_WB[frame.body] * frame.X_BF * *X;
            let (U_WA, U_WB) = (undeformed(near, &span.X_LA), undeformed(far, &span.X_DB));
            let turn = (U_WA.rotation.inverse() * U_WB.rotation).inverse() * (X_WA.rotation.inverse() * X_WB.rotation);
            self.strains[k] = self.strains[k].max(strain);
            self.rotations[k] = self.rotations[k].max(rotation_vector(turn.matrix()).norm());
        }
        let drives = self.seen.drive.iter().zip(self.seen.qdot.iter()).map(|(force, rate)| force * rate);
        self.energy.add(t, self.seen.energy, self.seen.power, self.seen.impulse_work, drives);
    }

    /// Figures of what was seen so far.
    fn summary(&self, robot: &Robot, motion: &Motion, options: &RunOptions) -> (Summary, Vec<Event>) {
        // A run that stopped at once has nothing to measure.
        let metrics = self.record.metrics().ok();
        let peaks = self.contributions.peaks();
        let links: Vec<LinkFigures> = (self.flexible.spans.iter().enumerate())
            .map(|(k, span)| LinkFigures {
                name: span.link.clone(),
                peak_contribution_m: peaks[k].peak_m,
                engineering_strain: self.strains[k],
                peak_rotation_rad: self.rotations[k],
            })
            .collect();
        let elastic_drives: Vec<DriveFigures> = (robot.drives.iter().enumerate())
            .filter(|(k, _)| self.flexible.owners.contains(&Owner::Drive(*k)))
            .map(|(k, drive)| DriveFigures {
                joint: drive.joint.clone(),
                peak_contribution_m: peaks[links.len() + k].peak_m,
                peak_deflection_rad: self.give[k],
            })
            .collect();
        let mut caveats = robot.caveats();
        caveats.extend(self.flexible.caveats());
        caveats.extend(motion.caveats());
        let passed = |v: &LimitViolation| Caveat::said("joint-limit", &v.joint, format!("joint limit: {v}"), "");
        caveats.extend(motion.violations.iter().map(passed));
        caveats.extend(self.caveats(robot, &links));
        let events = self.events(metrics.as_ref().filter(|_| options.with_twin));
        let bends = Bending {
            links: links.iter().map(|link| link.name.clone()).collect(),
            gearboxes: elastic_drives.iter().map(|drive| drive.joint.clone()).collect(),
        };
        let by_choice = !robot.flexible.is_empty() || robot.drives.iter().any(|drive| drive.gearbox.is_some());
        let mut summary = Summary {
            bends,
            robot: robot.name.clone(),
            trajectory: motion.name.clone(),
            links_model: self.flexible.links_model().into(),
            duration_s: self.record.last_time_s().unwrap_or(0.0),
            stepper: StepperFigures::new(options, self.stepper.counts()),
            tcp: metrics.as_ref().filter(|_| options.with_twin).map(|m| self.tool_figures(m)),
            frequencies_hz: self.arm.modes.frequencies_hz(),
            links,
            elastic_drives,
            energy: self.energy.figures(),
            drives: self
                .arm
                .model
                .coordinates()
                .iter()
                .zip(&self.peak_drive)
                .map(|(c, peak)| (c.joint.clone(), *peak))
                .collect(),
            moves_s: moves(motion).iter().map(|&(start, end)| [start, end]).collect(),
            error_curve: self.record.largest_errors(CURVE_PIECES),
            caveats,
            ..Summary::default()
        };
        summary.headline = headline::headline(&summary, by_choice);
        (summary, events)
    }

    fn tool_figures(&self, metrics: &TcpMetrics) -> TcpFigures {
        let figures = TcpFigures {
            static_sag_m: self.static_sag(),
            shares_at_peak: self.shares_at_peak(),
            ..TcpFigures::from(metrics).with_band(self.options.settling_band_m)
        };
        match self.record.parts() {
            Ok(parts) => figures.with_parts(&parts),
            Err(_) => figures,
        }
    }

    /// What each contributor has in the largest error, along its direction.
    fn shares_at_peak(&self) -> Vec<ShareFigures> {
        let peak = &self.trace.peak;
        let error = Vector3::from_row_slice(&peak.error_world[..3]);
        let along = error.try_normalize(0.0).unwrap_or_default();
        let shares = self.contributors.iter().zip(&peak.contributions).map(|(who, moved)| ShareFigures {
            name: who.name.clone(),
            kind: who.kind.into(),
            along_m: along.dot(&Vector3::from(*moved)),
        });
        shares.collect()
    }

    /// What happened when, in order of time, as far as the run came.
    fn events(&self, metrics: Option<&TcpMetrics>) -> Vec<Event> {
        let mut events = Vec::new();
        let mut add = |time_s: f64, kind: EventKind, text: String| events.push(Event { time_s, kind, text });
        for (k, m) in self.motion.trajectory.moves().iter().enumerate() {
            add(m.start, EventKind::MoveStart, format!("move {} begins", k + 1));
            add(m.end, EventKind::MoveEnd, format!("move {} ends", k + 1));
        }
        if let Some(metrics) = metrics {
            add(metrics.t_peak_s, EventKind::Peak, format!("largest TCP error: {:.3} mm", 1e3 * metrics.peak_m));
            for hold in &metrics.holds {
                if let Some(settling) = hold.settling_s {
                    let band = 1e3 * self.options.settling_band_m;
                    let text = format!("settled to within {band} mm, {settling:.3} s after the move");
                    add(hold.start_s + settling, EventKind::Settled, text);
                }
            }
        }
        for v in &self.motion.violations {
            add(v.since_s, EventKind::Limit, v.to_string());
        }
        for (c, since) in self.arm.model.coordinates().iter().zip(&self.overloaded) {
            if let Some(since) = since {
                let text =
                    format!("joint {:?} needs more than its limit of {:.0} N m (or N)", c.joint, c.limits.effort);
                add(*since, EventKind::Limit, text);
            }
        }
        let mut jumps: Vec<f64> = self.arm.loads.iter().flat_map(|load| load.jumps.iter().copied()).collect();
        jumps.sort_by(f64::total_cmp);
        jumps.dedup();
        // A table or a milling load has a corner at every row; a list of those tells nobody anything.
        const MOST_JUMPS: usize = 20;
        for t in jumps.iter().take(if jumps.len() <= MOST_JUMPS { MOST_JUMPS } else { 1 }) {
            add(*t, EventKind::Load, "an external load changes".into());
        }
        for t in &self.payload_times {
            add(*t, EventKind::Load, "the payload changes".into());
        }
        let reached = self.record.last_time_s().unwrap_or(0.0);
        events.retain(|event| event.time_s <= reached + 1e-9);
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s).then(a.kind.cmp(&b.kind)));
        events
    }

    /// TCP error with the drives at rest in their first position, also for runs that start undeformed (m).
    fn static_sag(&self) -> f64 {
        let model = &self.arm.model;
        let (mut data, mut state) = (Data::new(model), State::zeros(model));
        self.arm.prescribed_state(0.0, &mut state, &mut nalgebra::DVector::zeros(model.nv()));
        forward_kinematics(model, &mut data, &state.q);
        let rigid = data.X_WF(&self.tcp).translation.vector;
        let n = model.n_actuated();
        state.q.rows_mut(n, model.nv() - n).copy_from(&self.arm.modes.equilibrium);
        forward_kinematics(model, &mut data, &state.q);
        (data.X_WF(&self.tcp).translation.vector - rigid).norm()
    }

    /// Whether the models held in what was seen so far.
    fn caveats(&self, robot: &Robot, links: &[LinkFigures]) -> Vec<Caveat> {
        let (arm, flexible, coordinates) = (&self.arm, self.flexible, self.arm.model.coordinates());
        let elastic = arm.modes.equilibrium.as_slice();
        let mut caveats = Standing { robot, flexible, arm, elastic, sag_m: self.static_sag() }.caveats();
        for (k, drive) in robot.drives.iter().enumerate().filter(|(k, _)| flexible.owners.contains(&Owner::Drive(*k))) {
            let joint = coordinates.iter().find(|c| c.joint == drive.joint);
            let slides = joint.is_some_and(|c| c.kind == "prismatic");
            let [turned, moved] = if slides { [0.0, self.give[k]] } else { [self.give[k], 0.0] };
            let effort = joint.map_or(f64::INFINITY, |c| c.limits.effort);
            caveats.extend(drives::give(drive, effort, (turned - drive.backlash).max(0.0), moved, 2.0));
        }
        if let Some(first) = self.arm.modes.frequencies_hz().first() {
            let logged_hz = 1.0 / (self.every as f64 * self.options.step_s);
            caveats.extend(validity::sampling(*first, self.options.step_s, logged_hz));
        }
        for link in links {
            caveats.extend(validity::link(&link.name, link.peak_rotation_rad, link.engineering_strain));
        }
        caveats.extend(validity::energy(self.energy.figures().imbalance));
        caveats.extend(validity::efforts(&kinds::EFFORT, coordinates, &self.peak_drive));
        for (c, count) in coordinates.iter().zip(&self.at_limit).filter(|(_, count)| **count > 0) {
            let share = 100.0 * *count as f64 / self.record.len() as f64;
            caveats.push(kinds::SERVO_LIMIT.found(format!("joint {:?}", c.joint), share, 0.0));
        }
        if matches!(self.options.stepper, StepperKind::Spook(_)) && !self.arm.proportional {
            let betas: Vec<String> = self.arm.tau.iter().map(|b| format!("{b:.2e}")).collect();
            let message = format!(
                "spook damps each spring in proportion to its stiffness: modal damping became D = beta K with beta = {} s, \
                 exact for the first mode",
                betas.join(", ")
            );
            caveats.push(Caveat::said("spook-damping", "run", message, ""));
        }
        if self.motion.trajectory.initial_speed() > 1e-6 {
            let message = "the motion starts at speed: the first ringing is an artefact of the sudden start";
            caveats.push(Caveat::said("starts-moving", "run", message, ""));
        }
        caveats
    }
}

/// Start and end of each move (s).
fn moves(motion: &Motion) -> Vec<(f64, f64)> {
    motion.trajectory.moves().iter().map(|m| (m.start, m.end)).collect()
}

/// Puts one deflection and its load along the axis of its joint.
fn place(deflection: &mut [f64; 6], load: &mut [f64; 6], motion: AxisMotion, e: f64) {
    let (torque, axis, first) = (load[0], motion.axis(), if motion.slides() { 0 } else { 3 });
    let slides_as_it_turns = !motion.slides() && motion.travel() > 0.0;
    let S = motion.column();
    *load = [0.0; 6];
    for c in 0..3 {
        deflection[first + c] = e * axis[c];
        load[first + c] = torque * axis[c];
        if slides_as_it_turns {
            deflection[c] = e * S[c];
        }
    }
}

/// What the springs of gearboxes add to the motor's angle at the link.
fn link_side_angles(robot: &Robot, flexible: &FlexibleRobot) -> Vec<(usize, usize, f64)> {
    let mut angles = Vec::new();
    for (group, owner) in flexible.model.elastic().iter().zip(&flexible.owners) {
        let Owner::Drive(drive) = owner else { continue };
        let joint = &robot.drives[*drive].joint;
        let actuated = &flexible.model.coordinates()[..flexible.model.n_actuated()];
        let Some(k) = actuated.iter().position(|c| c.joint == *joint) else { continue };
        let motor = &flexible.model.bodies()[actuated[k].body];
        let JointMotion::Axis(motion) = motor.motion else { continue };
        let axis = motion.axis();
        match flexible.model.bodies()[group.body].motion {
            JointMotion::Axis(own) => {
                angles.push((k, group.coordinate, axis.dot(&own.axis())));
            }
            _ => {
                let first = group.coordinate + if motion.slides() { 0 } else { 3 };
                angles.extend((0..3).map(|c| (k, first + c, axis[c])));
            }
        }
    }
    angles
}
