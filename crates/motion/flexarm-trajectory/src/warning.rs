//! Warnings about a trajectory that can be used nevertheless.

use std::fmt;

use flexarm_settings::Setting;

use crate::curve::{Curve, QUIET_SPEED};
use crate::noise::Noise;

/// Jumps below this fraction of the peak acceleration are rounding errors.
const QUIET_JUMP: f64 = 1e-6;

/// A warning for the user; `Display` gives one line that includes the remedy.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The velocity jumps at `t = 0`.
    StartsMoving {
        /// Joint name.
        joint: String,
        /// Velocity at 0, rad/s or m/s.
        speed: f64,
    },
    /// The velocity jumps at the end.
    EndsMoving {
        /// Joint name.
        joint: String,
        /// Velocity at the end, rad/s or m/s.
        speed: f64,
    },
    /// The velocity jumps within the motion.
    VelocityJumps {
        /// Joint name.
        joint: String,
        /// Time of the largest jump, s.
        time_s: f64,
        /// Size of the jump, rad/s or m/s.
        jump: f64,
        /// Number of corners.
        count: usize,
    },
    /// The acceleration jumps within the motion, or at an end at which the velocity is continuous.
    AccelerationJumps {
        /// Joint name.
        joint: String,
        /// Time of the largest jump, s.
        time_s: f64,
        /// Size of the jump, rad/s² or m/s².
        jump: f64,
        /// Number of knots with a jump.
        count: usize,
    },
    /// A table does not state the unit of these joints.
    AssumedRadians {
        /// Names of the joints.
        joints: Vec<String>,
    },
    /// A table does not state the unit of its times.
    AssumedTime {
        /// Name of the column.
        column: String,
        /// Unit assumed.
        unit: &'static str,
    },
    /// Columns of a table that are not part of the motion.
    DroppedColumns {
        /// Their names.
        columns: Vec<String>,
    },
    /// Rows of a table that repeat the previous one, including the time.
    RepeatedRows {
        /// Number of repeated rows.
        count: usize,
    },
    /// Samples are missing in evenly sampled data.
    Gaps {
        /// Joints concerned.
        joints: Vec<String>,
        /// Number of gaps.
        count: usize,
        /// Number of the sample before the longest gap, counted from 1.
        sample: usize,
        /// Start of the longest gap, s.
        from_s: f64,
        /// End of the longest gap, s.
        to_s: f64,
        /// Usual sampling interval, s.
        usual_s: f64,
    },
    /// Noise of the positions makes a considerable part of the acceleration.
    Noise {
        /// Joint name.
        joint: String,
        /// The noise.
        noise: Noise,
    },
    /// Velocities that are not the slopes of the positions are not used.
    ForeignVelocities {
        /// Joint name.
        joint: String,
        /// RMS difference to the slopes, rad/s or m/s.
        miss: f64,
        /// RMS slope, rad/s or m/s.
        slope: f64,
    },
    /// The last row of a table is incomplete.
    CutRow {
        /// Line of the row.
        line: usize,
    },
    /// Lines above the header of a table that are not comments.
    Preamble {
        /// First line.
        first: usize,
        /// Last line.
        last: usize,
    },
    /// The positions are those of a run.
    PositionsOfRun,
    /// A limit in the file does not suit the others.
    OddLimit {
        /// Joint name.
        joint: String,
        /// Description of the ratio.
        what: &'static str,
        /// Ratio.
        value: f64,
        /// Usual range of the ratio.
        usual: [f64; 2],
    },
    /// The given duration makes a joint exceed an acceleration or jerk limit.
    ShorterThanLimitsAllow {
        /// Number of the move, counted from 1.
        number: usize,
        /// Joint name.
        joint: String,
        /// `"acceleration"` or `"jerk"`.
        quantity: &'static str,
        /// Peak in the move, SI.
        value: f64,
        /// The limit, SI.
        limit: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StartsMoving { joint, speed } => write!(
                f,
                "joint {joint:?} starts with a velocity of {speed:.3e} instead of 0, a blow that excites every mode: \
                 put a row with the same positions before the first one, or give its velocity as 0"
            ),
            Self::EndsMoving { joint, speed } => write!(
                f,
                "joint {joint:?} ends with a velocity of {speed:.3e} and is stopped at once: \
                 put a row with the same positions after the last one, or give its velocity as 0"
            ),
            Self::VelocityJumps { joint, time_s, jump, count } => write!(
                f,
                "the velocity of joint {joint:?} jumps at {count} {times}, most at t = {time_s:.4} s by {jump:.3e} rad/s \
                 (or m/s): no drive can do that, and the arm is struck with just this impulse; round the corners ({setting}), or \
                 give samples of a motion without them",
                times = if *count == 1 { "time" } else { "times" },
                setting = Setting::RoundCorners
            ),
            Self::AccelerationJumps { joint, time_s, jump, count } => write!(
                f,
                "the acceleration of joint {joint:?} jumps at {count} times, most at t = {time_s:.4} s by {jump:.3e}, \
                 which excites every mode: use `rounding`, another profile, or data with continuous accelerations"
            ),
            Self::AssumedRadians { joints } => write!(
                f,
                "the table does not state the unit of {}: taken as rad; name it in the header, as in joint_1[deg]",
                some(joints)
            ),
            Self::AssumedTime { column, unit } => write!(
                f,
                "the table does not state the unit of its column {column:?}: taken as {unit}; name it in the header, as in \
                 Time[ms]"
            ),
            Self::DroppedColumns { columns } => write!(
                f,
                "columns that are not of the motion are left out: {}; {} says which column is which joint",
                some(columns),
                Setting::Columns
            ),
            Self::RepeatedRows { count } => {
                write!(f, "{count} rows repeat the one before, time and all, and are left out")
            }
            Self::Gaps { joints, count, sample, from_s, to_s, usual_s } => {
                let more = if *count > 1 { format!(", the longest of {count} gaps") } else { String::new() };
                write!(
                    f,
                    "no sample of {} for {:.4} s, from t = {from_s:.4} s to {to_s:.4} s (samples {sample} and {}){more}; the usual step \
                     is {usual_s:.4} s: what the joints do there is a guess; record the motion again, or cut it there",
                    some(joints),
                    to_s - from_s,
                    sample + 1
                )
            }
            Self::Noise { joint, noise: Noise { rms, share, cutoff_hz } } => write!(
                f,
                "joint {joint:?} has noise of {rms:.1e} rad (or m) in its positions, which makes {:.0} % of its acceleration: \
                 smooth it with a cut-off in the file, such as `# cutoff: {cutoff_hz:.2} Hz` in a table or `cutoff_hz` in \
                 [samples]",
                100.0 * share
            ),
            Self::ForeignVelocities { joint, miss, slope } => write!(
                f,
                "the velocities of joint {joint:?} are not those of its positions (they differ by {miss:.3} of {slope:.3} \
                 rad/s or m/s) and are not used; check their sign and unit, or leave them out"
            ),
            Self::CutRow { line } => {
                write!(f, "the last row (line {line}) is not whole and is left out: the file was cut off")
            }
            Self::Preamble { first, last } => {
                write!(f, "the lines {first} to {last} above the header are passed over; what they say is not used")
            }
            Self::PositionsOfRun => f.write_str(
                "the positions are those of the flexible robot of a run: where its drives give way, they hold what the \
                 gearboxes twist; the motion file of the run has the commanded ones",
            ),
            Self::OddLimit { joint, what, value, usual: [low, high] } => write!(
                f,
                "limits of joint {joint:?}: {what} {value:.2e}, usual are {low} to {high}: are speed, acceleration and jerk in the \
                 unit of the file (deg or rad)?"
            ),
            Self::ShorterThanLimitsAllow { number, joint, quantity, value, limit } => write!(
                f,
                "move {number}: the given duration takes the {quantity} of joint {joint:?} to {value:.4}, over its \
                 limit of {limit:.4} (SI units): allow more time or drop the limit"
            ),
        }
    }
}

/// Lists the first few names.
fn some(names: &[String]) -> String {
    const MAX: usize = 8;
    let mut shown: Vec<String> = names.iter().take(MAX).map(|name| format!("{name:?}")).collect();
    if names.len() > MAX {
        shown.push(format!("... ({} in all)", names.len()));
    }
    shown.join(", ")
}

impl Warning {
    /// Whether time scaling makes this warning invalid.
    pub(crate) fn depends_on_time(&self) -> bool {
        matches!(self, Self::ShorterThanLimitsAllow { .. })
    }

    /// The same warning for a motion with times `start + factor t`.
    pub(crate) fn at_times(mut self, start: f64, factor: f64) -> Self {
        if let Self::Gaps { from_s, to_s, usual_s, .. } = &mut self {
            (*from_s, *to_s, *usual_s) = (start + factor * *from_s, start + factor * *to_s, factor * *usual_s);
        }
        self
    }

    /// Warnings about the curve of one joint.
    pub(crate) fn of_curve(joint: &str, curve: &Curve) -> Vec<Self> {
        let mut warnings = Vec::new();
        let (start, end) = (curve.start()[1], curve.end()[1]);
        if start.abs() > QUIET_SPEED {
            warnings.push(Self::StartsMoving { joint: joint.to_owned(), speed: start });
        }
        if end.abs() > QUIET_SPEED {
            warnings.push(Self::EndsMoving { joint: joint.to_owned(), speed: end });
        }

        let last = curve.knots[curve.knots.len() - 1];
        let inside = |time_s: f64| time_s > curve.knots[0] && time_s < last;
        let corners: Vec<_> =
            curve.jumps().filter(|jump| inside(jump.time_s) && jump.exceeds(1, QUIET_SPEED)).collect();
        if let Some(most) = corners.iter().max_by(|a, b| a.size[1].abs().total_cmp(&b.size[1].abs())) {
            let (joint, count) = (joint.to_owned(), corners.len());
            warnings.push(Self::VelocityJumps { joint, time_s: most.time_s, jump: most.size[1], count });
        }

        // Acceleration jumps at velocity jumps are not reported separately.
        let level = QUIET_JUMP * curve.largest(2);
        let jumps: Vec<_> =
            curve.jumps().filter(|jump| !jump.exceeds(1, QUIET_SPEED) && jump.exceeds(2, level)).collect();
        if let Some(most) = jumps.iter().max_by(|a, b| a.size[2].abs().total_cmp(&b.size[2].abs())) {
            let (joint, count) = (joint.to_owned(), jumps.len());
            warnings.push(Self::AccelerationJumps { joint, time_s: most.time_s, jump: most.size[2], count });
        }
        warnings
    }
}
