//! Writes a trajectory as a CSV file that [`Trajectory::parse_csv`] reads.

use std::io::Write;

use flexarm_settings::written::csv_field;

use crate::error::TrajectoryError;
use crate::trajectory::Trajectory;

/// Maximum number of rows; more means a wrong rate.
const MAX_ROWS: u32 = 100_000_000;

impl Trajectory {
    /// Writes positions, velocities and accelerations in SI units: one row every `1 / rate_hz` s
    /// from `t = 0`, and one at the end. Numbers are written in full precision, so that reading
    /// returns the same values.
    ///
    /// # Errors
    /// [`TrajectoryError::Value`] or [`TrajectoryError::Write`].
    pub fn to_csv(&self, rate_hz: f64, mut out: impl Write) -> Result<(), TrajectoryError> {
        let times = self.row_times(rate_hz, MAX_ROWS)?;
        writeln!(out, "# unit: rad")?;
        writeln!(out, "# time: s")?;
        // Columns: time, positions, velocities, accelerations.
        let mut header = vec!["time".to_owned()];
        header.extend(self.joints().iter().cloned());
        header.extend(self.joints().iter().map(|joint| format!("{joint}.vel")));
        header.extend(self.joints().iter().map(|joint| format!("{joint}.acc")));
        writeln!(out, "{}", header.iter().map(|name| csv_field(name)).collect::<Vec<_>>().join(","))?;

        let n = self.joints().len();
        let (mut q, mut qdot, mut qddot) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for t in times {
            self.sample(t, &mut q, &mut qdot, &mut qddot);
            write!(out, "{}", number(t))?;
            for value in q.iter().chain(&qdot).chain(&qddot) {
                write!(out, ",{}", number(*value))?;
            }
            writeln!(out)?;
        }
        out.flush()?;
        Ok(())
    }
}

/// Shortest text that reads back as the same number.
fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 || (1e-4..1e15).contains(&magnitude) { format!("{value}") } else { format!("{value:e}") }
}
