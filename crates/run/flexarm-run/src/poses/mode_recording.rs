//! Modes as a recording: each mode oscillates for a few seconds, one after another, slowly and with
//! a visible amplitude.
//!
//! Start at [`Arm::record_modes`]. World frame, SI units. Not here: the modes themselves (`modes`).

use std::sync::Arc;

use flexarm_analysis::{DampedMode, tcp_error};
use flexarm_kinematics::{Frame, forward_kinematics};
use flexarm_log::{Caption, ElasticSample, RunHeader, RunResult, Sample, TwinSample};
use flexarm_settings::Setting;
use flexarm_stepping::Linear;
use nalgebra::DVector;

use crate::arm::Arm;
use crate::arm::bends::stations;
use crate::arm::options::Outputs;
use crate::error::Error;
use crate::poses::modes::{ModeModel, ModeTable, modes_of, table};
use crate::poses::posed::Posed;
use crate::robot::Robot;
use crate::run::record::{link_frames, recorders, robot_header};
use flexarm_settings::written::markdown;

/// Oscillations per second on the screen, independent of the mode's frequency.
const SHOWN_HZ: f64 = 1.0;
/// Samples per second.
const RATE_HZ: f64 = 30.0;
/// Default TCP amplitude relative to the reach.
const PART_OF_REACH: f64 = 0.05;
/// Maximum displayed amplitude of an elastic coordinate (m, rad).
const LARGEST: f64 = 0.5;

/// Display options of modes.
#[derive(Clone, Debug)]
pub struct ModeMovie {
    /// Duration of each mode (s), rounded up to whole oscillations.
    pub seconds: f64,
    /// TCP amplitude in each mode (m); a twentieth of the arm's reach by default.
    pub tool_motion_m: Option<f64>,
}

impl Default for ModeMovie {
    fn default() -> Self {
        Self { seconds: 3.0, tool_motion_m: None }
    }
}

impl Arm {
    /// As [`Arm::modes`], and writes a recording in which the modes oscillate one after another
    /// about the static equilibrium, next to the rigid robot at rest.
    ///
    /// # Errors
    /// As [`Arm::modes`]; [`Error::Pose`] for a robot without modes, [`Error::Value`],
    /// [`Error::File`] and [`Error::Log`] for files.
    pub fn record_modes(
        self: &Arc<Self>,
        at: Option<&[f64]>,
        speeds: Option<&[f64]>,
        count: usize,
        movie: &ModeMovie,
        outputs: &Outputs,
    ) -> Result<ModeTable, Error> {
        let within = |x: f64, setting: Setting, unit: &str| match x > 0.0 && x < 1000.0 {
            true => Ok(()),
            false => Err(Error::Value(format!("{setting} must be positive and below 1000, found {x} {unit}"))),
        };
        within(movie.seconds, Setting::Seconds, "s")?;
        movie.tool_motion_m.map_or(Ok(()), |x| within(x, Setting::ToolMotion, "m"))?;

        // All modes; the lowest are shown.
        let posed = self.posed(at)?;
        let model = ModeModel::new(&posed, speeds)?;
        let linear = &model.linear;
        let all = modes_of(linear)?;
        if all.is_empty() {
            return Err(Error::Pose("the robot has no flexible link, so there are no modes to record".into()));
        }
        let shown = &all[..count.min(all.len())];
        let motion = movie.tool_motion_m.unwrap_or_else(|| PART_OF_REACH * reach(&posed));

        // Header: the arm, and when which mode is shown.
        let mut files = recorders(Some(outputs), false)?;
        (files.names.report, files.names.report_md) = (None, None);
        let mut header = robot_header(self.robot(), &posed.plant);
        let (bends, stations) = stations(&self.bends, &posed.plant.model, &header.links);
        header.bends = bends;
        header.color_scale_m = crate::run::magnification::round_up(motion);
        header.volume = Some(volume(&posed, motion));
        let swings = (movie.seconds * SHOWN_HZ).ceil();
        describe_modes(&mut header, shown, swings / SHOWN_HZ);
        files.begin(&header)?;

        // x(t) = x_0 + size Re(-i φ e^(iωt)), each mode for the same whole number of oscillations.
        let per_mode = (swings / SHOWN_HZ * RATE_HZ).round() as u64;
        let mut stage = Stage::new(self.robot(), &posed, linear, stations);
        for (k, mode) in shown.iter().enumerate() {
            let size = magnification(mode, linear, motion);
            let last = if k + 1 == shown.len() { per_mode } else { per_mode - 1 };
            for frame in 0..=last {
                let step = k as u64 * per_mode + frame;
                let (sine, cosine) = (std::f64::consts::TAU * SHOWN_HZ * frame as f64 / RATE_HZ).sin_cos();
                let shape = mode.shape.map(|x| size * (x.re * sine + x.im * cosine));
                files.set.record(stage.sample(step, &(&linear.equilibrium + shape)))?;
            }
        }
        let figures = vec![("modes".into(), shown.len().to_string())];
        files.set.finish(&RunResult { figures, ..RunResult::default() })?;
        let names = files.names.clone();
        let mut figures = table(&posed, &model, &all, count)?;
        figures.files = names;
        Ok(figures)
    }
}

/// Adds captions and tables of the modes to the header; each is shown for `seconds` (s).
pub fn describe_modes(header: &mut RunHeader, shown: &[DampedMode], seconds: f64) {
    header.trajectory = "modes".into();
    header.has_rigid = true;
    header.log_rate_hz = RATE_HZ;
    let start = |k: usize| k as f64 * seconds;
    let caption = |(k, mode): (usize, &DampedMode)| Caption { from_s: start(k), text: name(k, mode) };
    header.captions = shown.iter().enumerate().map(caption).collect();
    header.description = list(&header.robot, shown, start);
    let row = |(k, mode): (usize, &DampedMode)| {
        (format!("mode {}", k + 1), format!("{:.4} Hz, from {} s", mode.frequency_hz(), start(k)))
    };
    header.metadata = vec![("flexarm.modes".into(), shown.iter().enumerate().map(row).collect())];
}

/// Caption of a mode.
fn name(k: usize, mode: &DampedMode) -> String {
    format!("mode {}: {:.2} Hz", k + 1, mode.frequency_hz())
}

/// Markdown table of the modes.
fn list(robot: &str, shown: &[DampedMode], start: impl Fn(usize) -> f64) -> String {
    let robot = markdown(robot);
    let mut text = format!(
        "# Modes of {robot}\n\nShapes have no amplitude: each is scaled to be visible and oscillates once a second, independent of its frequency. The ghost is the rigid robot.\n\n| mode | frequency | damping | shown from |\n| --- | --- | --- | --- |\n"
    );
    for (k, mode) in shown.iter().enumerate() {
        let (hz, damping) = (mode.frequency_hz(), 100.0 * mode.damping_ratio());
        text += &format!("| {} | {hz:.3} Hz | {damping:.2} % | {} s |\n", k + 1, start(k));
    }
    text
}

/// Bounding box of all bodies and the TCP, enlarged by the TCP amplitude (m).
fn volume(posed: &Posed, motion_m: f64) -> [[f64; 3]; 2] {
    let (mut data, state) = posed.undeformed();
    forward_kinematics(&posed.plant.model, &mut data, &state.q);
    let places = data.X_WB.iter().map(|X| X.translation.vector).chain([data.X_WF(&posed.tool).translation.vector]);
    places.fold([[f64::MAX; 3], [f64::MIN; 3]], |[low, high], p| {
        let corner = |c: usize| (low[c].min(p[c] - motion_m), high[c].max(p[c] + motion_m));
        let [x, y, z] = [0, 1, 2].map(corner);
        [[x.0, y.0, z.0], [x.1, y.1, z.1]]
    })
}

/// Maximum distance of the TCP from a joint (m).
fn reach(posed: &Posed) -> f64 {
    let (mut data, state) = posed.undeformed();
    forward_kinematics(&posed.plant.model, &mut data, &state.q);
    let tool = data.X_WF(&posed.tool).translation.vector;
    data.X_WB.iter().skip(1).map(|X| (X.translation.vector - tool).norm()).fold(0.0, f64::max)
}

/// Factor on the shape of unit modal mass for the requested TCP amplitude, limited by [`LARGEST`].
fn magnification(mode: &DampedMode, linear: &Linear, motion_m: f64) -> f64 {
    let tool = flexarm_analysis::mode_outputs(mode, &crate::poses::modes::tool_map(linear));
    let tool = tool.rows(0, 3).iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
    let largest = mode.shape.iter().map(|x| x.norm()).fold(0.0, f64::max);
    (motion_m / tool).min(LARGEST / largest)
}

/// Produces samples of the robot for given elastic coordinates.
struct Stage<'a> {
    posed: &'a Posed,
    linear: &'a Linear,
    data: flexarm_kinematics::Data,
    q: DVector<f64>,
    frames: Vec<Frame>,
    stations: Vec<Frame>,
    sample: Sample,
}

impl<'a> Stage<'a> {
    fn new(robot: &Robot, posed: &'a Posed, linear: &'a Linear, stations: Vec<Frame>) -> Self {
        let (mut data, state) = posed.undeformed();
        let model = &posed.plant.model;
        forward_kinematics(model, &mut data, &state.q);
        let frames = link_frames(robot, model);
        let zero = vec![0.0; posed.at.len()];
        let rigid = TwinSample {
            q: posed.at.clone(),
            qdot: zero.clone(),
            effort: zero,
            X_WL: frames.iter().map(|f| data.X_WF(f)).collect(),
            X_WT: data.X_WF(&posed.tool),
            X_WS: Vec::new(),
        };
        let elastic = vec![ElasticSample::default(); linear.elements.len()];
        let sample = Sample { flexible: rigid.clone(), rigid, elastic, ..Sample::default() };
        Self { posed, linear, data, q: state.q, frames, stations, sample }
    }

    /// Fills the sample of a step with the free coordinates `x`: motors under servos, then springs.
    fn sample(&mut self, step: u64, x: &DVector<f64>) -> &Sample {
        let driven = &self.posed.plant.torque_driven;
        // Motors driven by torque, then elastic coordinates.
        for (value, &k) in x.iter().zip(driven) {
            self.q[k] = *value;
        }
        let (first, ne) = (self.q.len() + driven.len() - x.len(), x.len() - driven.len());
        self.q.rows_mut(first, ne).copy_from(&x.rows(driven.len(), ne));
        forward_kinematics(&self.posed.plant.model, &mut self.data, &self.q);
        // Poses of links and stations, and the difference of the tool from the undeformed arm.
        let sample = &mut self.sample;
        sample.time_s = step as f64 / RATE_HZ;
        sample.step = step;
        sample.flexible.X_WL.clear();
        sample.flexible.X_WL.extend(self.frames.iter().map(|f| self.data.X_WF(f)));
        sample.flexible.X_WS.clear();
        sample.flexible.X_WS.extend(self.stations.iter().map(|f| self.data.X_WF(f)));
        sample.flexible.X_WT = self.data.X_WF(&self.posed.tool);
        sample.error_world = tcp_error(&sample.rigid.X_WT, &sample.flexible.X_WT);
        // Deflections, and the loads of linear springs.
        for (elastic, (_, range)) in sample.elastic.iter_mut().zip(&self.linear.elements) {
            let n = range.len();
            let deflection = x.rows(range.start, n);
            let load = self.linear.springs.view((range.start, range.start), (n, n)) * deflection;
            for (to, value) in elastic.deflection.iter_mut().zip(&deflection) {
                *to = *value;
            }
            for (to, value) in elastic.load.iter_mut().zip(&load) {
                *to = *value;
            }
        }
        sample
    }
}
