//! Samples in a TOML motion file, for motions that are not made of moves from rest to rest.
//!
//! ```toml
//! format = 1
//! unit = "deg"
//! joints = ["joint_1", "joint_2"]
//!
//! [samples]
//! time = [0.0, 0.01, 0.02]                                # s
//! position = [[0.0, 0.0], [0.1, -0.2], [0.2, -0.4]]       # a row per time, a number per joint
//! velocity = [[0.0, 0.0], [10.0, -20.0], [0.0, 0.0]]      # optional, and `acceleration` with it
//! # cutoff_hz = 20.0                                      # smooths recorded positions
//! ```
//!
//! Equivalent to samples in CSV ([`crate::table`]): quintics between the rows.

use serde::Deserialize;
use toml::Spanned;

use crate::error::TrajectoryError;
use crate::spline::{JointSamples, Samples};
use crate::trajectory::Trajectory;
use crate::waypoints_check::{Located, bad_value, joint_names, scales};

/// Maximum number of rows written.
const MAX_ROWS: u32 = 5_000_000;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SamplesFileToml {
    pub(crate) format: Spanned<i64>,
    pub(crate) unit: Spanned<String>,
    #[serde(default)]
    pub(crate) metres: Vec<Spanned<String>>,
    pub(crate) joints: Spanned<Vec<Spanned<String>>>,
    samples: Spanned<SamplesToml>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SamplesToml {
    time: Spanned<Vec<f64>>,
    position: Spanned<Vec<Vec<f64>>>,
    velocity: Option<Spanned<Vec<Vec<f64>>>>,
    acceleration: Option<Spanned<Vec<Vec<f64>>>>,
    /// Cut-off of a smoothing of the positions (Hz).
    cutoff_hz: Option<f64>,
}

/// Whether the text holds samples instead of moves.
pub(crate) fn has_samples(text: &str) -> bool {
    text.lines().any(|line| line.split('#').next().is_some_and(|line| line.trim() == "[samples]"))
}

/// Converts and checks the file.
pub(crate) fn trajectory(file: &SamplesFileToml) -> Result<Trajectory, Located> {
    let names = joint_names(&file.joints)?;
    let scales = scales(&file.unit, &file.metres, &names)?;
    let SamplesToml { time, position, velocity, acceleration, cutoff_hz } = file.samples.get_ref();
    // Rows of the file to columns in SI units.
    let columns = |rows: &Spanned<Vec<Vec<f64>>>, key: &'static str| -> Result<Vec<Vec<f64>>, Located> {
        let (found, expected) = (rows.get_ref().len(), time.get_ref().len());
        if found != expected {
            return Err(bad_value(rows.span(), key, format!("{found} rows"), "a row for each time"));
        }
        if let Some(row) = rows.get_ref().iter().position(|row| row.len() != names.len()) {
            let found = format!("{} numbers in row {}", rows.get_ref()[row].len(), row + 1);
            return Err(bad_value(rows.span(), key, found, "a number for each joint in each row"));
        }
        let column = |k: usize| rows.get_ref().iter().map(|row| row[k] * scales[k]).collect();
        Ok((0..names.len()).map(column).collect())
    };
    let optional =
        |rows: &Option<Spanned<Vec<Vec<f64>>>>, key| rows.as_ref().map(|rows| columns(rows, key)).transpose();
    let position = columns(position, "samples.position")?;
    let velocity = optional(velocity, "samples.velocity")?;
    let acceleration = optional(acceleration, "samples.acceleration")?;
    let joint = |(k, name): (usize, &String)| JointSamples {
        name: name.clone(),
        position: position[k].clone(),
        velocity: velocity.as_ref().map(|columns| columns[k].clone()),
        acceleration: acceleration.as_ref().map(|columns| columns[k].clone()),
    };
    let samples = Samples { times: time.get_ref().clone(), joints: names.iter().enumerate().map(joint).collect() };
    let made = match cutoff_hz {
        Some(hz) => samples.smoothed(*hz).map_err(Into::into).and_then(|smooth| smooth.interpolate()),
        None => samples.interpolate(),
    };
    made.map_err(|error| Located { offset: Some(time.span().start), fault: error.into() })
}

impl Trajectory {
    /// Writes any motion as a motion file with positions, velocities and accelerations in SI units:
    /// one row every `1 / rate_hz` s from `t = 0`, and one at the end. Numbers are written in full
    /// precision.
    ///
    /// # Errors
    /// [`TrajectoryError::Value`].
    pub fn to_samples_toml(&self, rate_hz: f64) -> Result<String, TrajectoryError> {
        let n = self.joints().len();
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let (mut times, mut rows) = (Vec::new(), [String::new(), String::new(), String::new()]);
        for t in self.row_times(rate_hz, MAX_ROWS)? {
            self.sample(t, &mut q, &mut v, &mut a);
            times.push(t);
            for (rows, values) in rows.iter_mut().zip([&q, &v, &a]) {
                *rows += &format!("    {values:?},\n");
            }
        }
        let [position, velocity, acceleration] = rows;
        Ok(format!(
            "format = 1\nunit = \"rad\"\njoints = {:?}\n\n[samples]\ntime = {times:?}\nposition = [\n{position}]\n\
             velocity = [\n{velocity}]\nacceleration = [\n{acceleration}]\n",
            self.joints()
        ))
    }
}
