//! Writes a trajectory as a waypoint file that [`Trajectory::parse_toml`] reads.
//!
//! What was written is compared with the trajectory at many times before it is returned. Not here:
//! samples (`csv_write.rs`), reading (`waypoints_toml.rs`).

use std::fmt::Write;

use crate::error::TrajectoryError;
use crate::trajectory::{Move, Trajectory};

/// Maximum difference between the waypoints and the trajectory (rad or m), due to rounding of long
/// sums.
const SAME: f64 = 1e-9;
/// Number of times at which each move is compared.
const TIMES: usize = 200;
/// Minimum duration of a hold that is written (s).
const SHORTEST: f64 = 1e-9;

impl Trajectory {
    /// Writes the moves as quintics from rest to rest, in rad and m, with the holds between them.
    ///
    /// # Errors
    /// [`TrajectoryError::NotWaypoints`] for a motion that does not consist of such moves, such as
    /// one with samples or via points; it holds the difference.
    pub fn to_waypoints_toml(&self) -> Result<String, TrajectoryError> {
        let text = self.waypoints();
        // Reads the result back to detect motions that do not consist of such moves.
        let back = Self::parse_toml(&text, "waypoints", &[])?;
        let n = self.joints().len();
        let (mut q, mut p, mut rest) = (vec![0.0; n], vec![0.0; n], [vec![0.0; n], vec![0.0; n]]);
        let mut worst = (0.0, 0.0, 0);
        for span in self.moves() {
            for i in 0..=TIMES {
                let t = span.start + (span.end - span.start) * i as f64 / TIMES as f64;
                let [v, a] = &mut rest;
                self.sample(t, &mut q, v, a);
                back.sample(t, &mut p, v, a);
                for (k, (q, p)) in q.iter().zip(&p).enumerate() {
                    if (q - p).abs() > worst.0 {
                        worst = ((q - p).abs(), t, k);
                    }
                }
            }
        }
        let (difference, time_s, k) = worst;
        if difference > SAME || (back.duration() - self.duration()).abs() > 1e-9 * self.duration() {
            let joint = self.joints()[k].clone();
            return Err(TrajectoryError::NotWaypoints { joint, time_s, difference });
        }
        Ok(text)
    }

    fn waypoints(&self) -> String {
        let names: Vec<String> = self.joints().iter().map(|joint| format!("{joint:?}")).collect();
        let mut text =
            format!("format = 1\nunit = \"rad\"\njoints = [{}]\nstart = {}\n", names.join(", "), self.positions(0.0));
        let moves = self.moves();
        let first = moves.first().map_or(self.duration(), |span| span.start);
        let mut begin = 0.0;
        if first > SHORTEST {
            // Initial rest is written as a move to the current position and a hold.
            self.write_move(&mut text, &Move { start: 0.0, end: 0.5 * first }, first);
            begin = first;
        }
        for (i, span) in moves.iter().enumerate() {
            let next = moves.get(i + 1).map_or(self.duration(), |next| next.start);
            self.write_move(&mut text, &Move { start: begin.max(span.start), end: span.end }, next);
            begin = next;
        }
        text
    }

    fn write_move(&self, text: &mut String, span: &Move, next: f64) {
        // Writing to a string does not fail.
        let _ = write!(text, "\n[[move]]\nto = {}\nduration = {:?}\n", self.positions(span.end), span.end - span.start);
        if next - span.end > SHORTEST {
            let _ = writeln!(text, "hold = {:?}", next - span.end);
        }
    }

    fn positions(&self, t: f64) -> String {
        let n = self.joints().len();
        let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        self.sample(t, &mut q, &mut v, &mut a);
        format!("{q:?}")
    }
}
