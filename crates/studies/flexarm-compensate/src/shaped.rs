//! Input shaping of a motion.
//!
//! Start at [`shaped`]: the modes at the end of the motion, a shaper for them, the motion as the
//! sum of its delayed copies. Not here: the design of shapers ([`flexarm_analysis::Shaper`]).

use std::sync::Arc;

use flexarm_analysis::{DampedMode, Node, ShapedMode, Shaper, ShaperKind, damped_modes, vibration_left};
use flexarm_kinematics::Wrench;
use flexarm_stepping::{Held, Plant, linearise};
use flexarm_trajectory::{JointKnots, Trajectory};
use nalgebra::DMatrix;
use serde::Serialize;

use super::{CompensateError, SAMPLE_S};
use flexarm_run::{Arm, Error, Motion, Scenario};

/// Damping ratio above which a mode hardly oscillates.
const SWINGS: f64 = 0.4;
/// Fraction of the maximum acceleration below which commands are at rest.
const RESTS: f64 = 1e-9;
/// Fraction of the maximum vibration below which a mode is ignored.
const SMALL: f64 = 1e-3;
/// Maximum number of modes, and of periods of a mode within the delay.
const MAX: (usize, f64) = (8, 20.0);
/// Offsets, in units of the band, of the frequencies at which the spectrum of a motion is
/// evaluated.
const IN_BAND: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// Choice of the input shaper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shaping {
    /// Closed-form shaper for the first mode at the end of the motion.
    Mode(ShaperKind),
    /// Shaper with the minimum residual vibration of all modes at the end of the motion, for a
    /// given delay.
    Optimal {
        /// Maximum delay (s); default: a period of the first mode.
        delay_s: Option<f64>,
        /// Relative uncertainty of each frequency to either side.
        band: f64,
    },
}

impl Shaping {
    /// Default of the relative uncertainty of frequencies.
    pub const BAND: f64 = 0.1;
}

impl From<ShaperKind> for Shaping {
    fn from(kind: ShaperKind) -> Self {
        Self::Mode(kind)
    }
}

/// Figures of a shaper in use.
#[derive(Clone, Debug, Serialize)]
pub struct ShaperFigures {
    /// `zv`, `zvd` or `optimal`.
    pub kind: &'static str,
    /// Delay (s) and amplitude of each copy of the motion.
    pub copies: Vec<[f64; 2]>,
    /// Modes at the end of the motion for which the shaper was designed, in order of decreasing
    /// vibration.
    pub modes: Vec<ShapedModeFigures>,
}

/// A mode with its residual vibration.
#[derive(Clone, Debug, Serialize)]
pub struct ShapedModeFigures {
    /// Natural frequency (Hz).
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Residual vibration of the TCP without shaper, maximum within the band of the frequency (m).
    pub before_m: f64,
    /// Residual vibration with the shaper (m).
    pub after_m: f64,
}

/// Returns the motion of a scenario through a shaper.
pub(super) fn shaped(arm: &Arc<Arm>, scenario: &Scenario, shaping: Shaping) -> Result<(Motion, ShaperFigures), Error> {
    // Shaper for the modes at the end of the motion.
    let motion = &scenario.motion;
    let end = AtEnd::of(arm, scenario)?;
    let Some(first) = end.modes.first() else { return Err(CompensateError::nothing_yields().into()) };
    let (hz, ratio) = (first.frequency_hz(), first.damping_ratio());
    let (kind, shaper, band, modes) = match shaping {
        Shaping::Mode(kind) => {
            let name = if kind == ShaperKind::Zv { "zv" } else { "zvd" };
            (name, Shaper::new(kind, hz, ratio), 0.0, end.vibrations(0.0, f64::INFINITY))
        }
        Shaping::Optimal { delay_s, band } => {
            let delay_s = delay_s.unwrap_or_else(|| 1.0 / first.damped_frequency_hz());
            let modes = end.vibrations(band, MAX.1 / delay_s);
            let found = Shaper::optimal(&modes, delay_s, band).map_err(CompensateError::from)?;
            ("optimal", found.shaper, band, modes)
        }
    };
    // Residual vibration of each mode within its band, without and with the shaper.
    let left = |mode: &ShapedMode| {
        let at = |part: &f64| shaper.residual((1.0 + band * part) * mode.hz, mode.ratio);
        ShapedModeFigures {
            frequency_hz: mode.hz,
            damping_ratio: mode.ratio,
            before_m: mode.vibration,
            after_m: mode.vibration * IN_BAND.iter().map(at).fold(0.0, f64::max),
        }
    };
    let figures = ShaperFigures {
        kind,
        copies: shaper.copies.iter().map(|(delay, part)| [*delay, *part]).collect(),
        modes: modes.iter().map(left).collect(),
    };
    let trajectory = through(&shaper, &motion.trajectory)?;
    Ok((Motion::along(trajectory, &format!("{}_shaped", motion.name), arm.robot())?, figures))
}

/// Returns a motion as the sum of its copies.
fn through(shaper: &Shaper, motion: &Trajectory) -> Result<Trajectory, Error> {
    let m = motion.joints().len();
    let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
    // Instants from the start to the end of the last copy.
    let total = motion.duration() + shaper.delay_s();
    let n = (total / SAMPLE_S).ceil() as usize;
    let times: Vec<f64> = (0..=n).map(|k| total * k as f64 / n as f64).collect();
    let mut joints: Vec<JointKnots> =
        motion.joints().iter().map(|name| JointKnots { name: name.clone(), ..JointKnots::default() }).collect();
    // Weighted sum of the delayed motions at each instant.
    for t in &times {
        let mut sum = vec![[0.0; 3]; m];
        for (delay, part) in &shaper.copies {
            motion.sample(t - delay, &mut q, &mut v, &mut a);
            for k in 0..m {
                sum[k][0] += part * q[k];
                sum[k][1] += part * v[k];
                sum[k][2] += part * a[k];
            }
        }
        for (joint, [q, v, a]) in joints.iter_mut().zip(sum) {
            joint.position.push(q);
            joint.velocity.push(v);
            joint.acceleration.push([a; 2]);
        }
    }
    Ok(Trajectory::through_knots(&times, &joints)?)
}

/// The linearised arm at the end of a motion, under its servos and with its payload there.
struct AtEnd {
    node: Node,
    /// Oscillating modes, by frequency.
    modes: Vec<DampedMode>,
    /// Accelerations of the motion until it is at rest, m×N.
    accelerations: DMatrix<f64>,
    step_s: f64,
}

impl AtEnd {
    /// Linearises the arm at the end of a motion.
    fn of(arm: &Arc<Arm>, scenario: &Scenario) -> Result<Self, Error> {
        let motion = &scenario.motion.trajectory;
        let (m, duration) = (motion.joints().len(), motion.duration());
        let count = (duration / SAMPLE_S).ceil().max(1.0) as usize;
        let step_s = duration / count as f64;
        let mut accelerations = DMatrix::zeros(m, count + 1);
        let (mut q, mut v, mut a) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        let start = {
            motion.sample(0.0, &mut q, &mut v, &mut a);
            arm.plant(Arc::new(Held(q.clone()))).map_err(|error| arm.explained(error))?
        };
        for (k, mut column) in accelerations.column_iter_mut().enumerate() {
            motion.sample(step_s * k as f64, &mut q, &mut v, &mut a);
            column.copy_from_slice(&a);
        }
        // Up to the time at which the commands are at rest; the vibration from then on is to be
        // minimised.
        let moving = accelerations.column_iter().rposition(|column| column.amax() > RESTS * accelerations.amax());
        let accelerations = accelerations.columns(0, (moving.unwrap_or(0) + 2).min(count + 1)).into_owned();
        // Servo gains and damping are those of the start, as in a run.
        let mut at_rest: Plant = start.along(Arc::new(Held(q)));
        for change in scenario.acting_on(arm.robot(), &at_rest.model)?.changes {
            at_rest = at_rest.with_inertia(change.body, change.inertia);
        }
        let at = linearise(&at_rest, &arm.tcp, &Wrench::zeros(), 0.0).map_err(|error| arm.explained(error))?;
        let symmetric = (&at.K + at.K.transpose()) * 0.5;
        let modes = damped_modes(&at.M, &at.D, &symmetric).map_err(CompensateError::from)?;
        let swings = |mode: &DampedMode| mode.eigenvalue.im > 0.0 && (0.0..SWINGS).contains(&mode.damping_ratio());
        let six = |A: &nalgebra::Matrix6xX<f64>| DMatrix::from_fn(6, A.ncols(), |i, j| A[(i, j)]);
        let (J, J_a) = (six(&at.J), six(&at.J_a));
        let node = Node { M: at.M, D: at.D, K: at.K, M_a: at.M_a, D_a: at.D_a, K_a: at.K_a, J, J_a, servo: None };
        Ok(Self { node, modes: modes.into_iter().filter(swings).collect(), accelerations, step_s })
    }

    /// Returns the modes that the motion excites, up to a frequency (the first mode in any case),
    /// in order of decreasing vibration.
    fn vibrations(&self, band: f64, up_to_hz: f64) -> Vec<ShapedMode> {
        let shaped_mode = |mode: &DampedMode| {
            let at = |part: &f64| vibration_left(&self.node, mode, &self.accelerations, self.step_s, 1.0 + band * part);
            let vibration = IN_BAND.iter().map(at).fold(f64::MIN_POSITIVE, f64::max);
            ShapedMode { hz: mode.frequency_hz(), ratio: mode.damping_ratio(), vibration }
        };
        let near = self.modes.iter().enumerate().filter(|(k, mode)| *k == 0 || mode.frequency_hz() <= up_to_hz);
        let mut all: Vec<ShapedMode> = near.map(|(_, mode)| shaped_mode(mode)).collect();
        all.sort_by(|a, b| b.vibration.total_cmp(&a.vibration));
        let most = all.first().map_or(0.0, |mode| mode.vibration);
        all.retain(|mode| mode.vibration >= SMALL * most);
        all.truncate(MAX.0);
        all
    }
}
