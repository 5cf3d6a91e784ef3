//! Writes a motion as `trajectory_msgs/JointTrajectory`, in YAML or JSON.
//!
//! Start at [`write_joint_trajectory`]; rad or m, times from the start of the motion in s and ns.
//! Not here: reading (`text.rs`), tables of samples (`flexarm-trajectory`).

use std::fmt::Write;

use flexarm_trajectory::{Trajectory, TrajectoryError};

/// Maximum number of points in a file.
const MAX_POINTS: u32 = 5_000_000;

/// Text format of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextFormat {
    /// YAML, as accepted by `ros2 topic pub`.
    Yaml,
    /// JSON.
    Json,
}

/// Writes a motion as points with positions, velocities and accelerations in SI units: one every
/// `1 / rate_hz` s, rounded to nanoseconds, and one at the end. Numbers are written in full
/// precision.
///
/// # Errors
/// [`TrajectoryError::Value`] if the rate is invalid or gives too many points.
pub fn write_joint_trajectory(
    trajectory: &Trajectory,
    rate_hz: f64,
    format: TextFormat,
) -> Result<String, TrajectoryError> {
    let (mut times, duration_s) = (trajectory.row_times(rate_hz, MAX_POINTS)?, trajectory.duration());
    let n = trajectory.joints().len();
    let (mut q, mut qdot, mut qddot) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let names: Vec<String> = trajectory.joints().iter().map(|joint| quoted(joint)).collect();
    let mut text = match format {
        TextFormat::Yaml => format!(
            "header:\n  stamp: {{sec: 0, nanosec: 0}}\n  frame_id: \"\"\njoint_names: [{}]\npoints:\n",
            names.join(", ")
        ),
        TextFormat::Json => format!(
            "{{\"header\": {{\"stamp\": {{\"sec\": 0, \"nanosec\": 0}}, \"frame_id\": \"\"}},\n\"joint_names\": [{}],\n\
             \"points\": [\n",
            names.join(", ")
        ),
    };
    while let Some(seconds) = times.next() {
        let ns = (seconds * 1e9).round() as i64;
        // Samples at the rounded time that is written.
        trajectory.sample((ns as f64 / 1e9).min(duration_s), &mut q, &mut qdot, &mut qddot);
        let (sec, nanosec) = (ns / 1_000_000_000, ns % 1_000_000_000);
        let (q, v, a) = (numbers(&q), numbers(&qdot), numbers(&qddot));
        // Writing to a string does not fail.
        let _ = match format {
            TextFormat::Yaml => writeln!(
                text,
                "- positions: [{q}]\n  velocities: [{v}]\n  accelerations: [{a}]\n  \
                 time_from_start: {{sec: {sec}, nanosec: {nanosec}}}"
            ),
            TextFormat::Json => writeln!(
                text,
                "{{\"positions\": [{q}], \"velocities\": [{v}], \"accelerations\": [{a}], \
                 \"time_from_start\": {{\"sec\": {sec}, \"nanosec\": {nanosec}}}}}{}",
                if times.len() == 0 { "" } else { "," }
            ),
        };
    }
    if format == TextFormat::Json {
        text += "]}\n";
    }
    Ok(text)
}

fn numbers(values: &[f64]) -> String {
    // The decimal point makes every YAML reader parse a float.
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
}

/// Quotes a name for both formats.
fn quoted(name: &str) -> String {
    let mut text = String::from("\"");
    for letter in name.chars() {
        match letter {
            '"' => text += "\\\"",
            '\\' => text += "\\\\",
            control if control.is_control() => {
                let _ = write!(text, "\\u{:04x}", u32::from(control));
            }
            other => text.push(other),
        }
    }
    text.push('"');
    text
}
