//! Error across the path, move by move, for a motion given as a TCP path.
//!
//! Terms as in ISO 9283, for one run instead of many: path accuracy is the maximum distance across
//! the path; corner overshoot is the TCP motion along the old direction after a corner. A workpiece
//! is often placed where the TCP actually is; the remaining error is bounded by half the diagonal
//! of the bounding box of the error vector.
//!
//! World axes, SI units. Not here: the plan of the path (`flexarm-path`), the error itself
//! (`tool`).

use std::sync::Arc;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::motions::tool_path::ToolPath;
use crate::run::monitor::tool::ToolError;

/// Speed below which the TCP has no direction, m/s.
const REST: f64 = 1e-5;
/// Maximum number of points kept for a picture.
const MAX_POINTS: usize = 8192;

/// Errors across the path of a motion given as a TCP path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PathFigures {
    /// Maximum distance from the path on TCP moves (m).
    pub across_peak_m: f64,
    /// Time of this maximum (s).
    pub t_across_peak_s: f64,
    /// Root mean square of the distance over the samples of those moves (m).
    pub across_rms_m: f64,
    /// Centre of the bounding box of the error on those moves: offset by which a workpiece would be
    /// moved (m, world axes).
    pub offset_m: [f64; 3],
    /// Bound on the error that remains after the offset (m): half the diagonal of the box.
    pub left_m: f64,
    /// Overshoot after a corner, beyond the static deflection (m); 0 without a corner.
    pub corner_overshoot_m: f64,
    /// Figures of each TCP move.
    pub moves: Vec<PathMoveFigures>,
    /// Up to a few thousand points of the path: position of the rigid TCP and the error there (m,
    /// world axes). Not written to files.
    #[serde(skip)]
    pub points: Vec<[f64; 6]>,
}

/// Figures of one TCP move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PathMoveFigures {
    /// Line number in the program or file.
    pub line: usize,
    /// Statement in that line.
    pub statement: String,
    /// Start and end time (s).
    pub span_s: [f64; 2],
    /// Maximum distance from the path (m).
    pub across_peak_m: f64,
    /// Root mean square of the distance (m).
    pub across_rms_m: f64,
    /// Overshoot along the direction of the previous move, beyond the static deflection (m).
    pub corner_overshoot_m: f64,
    /// Programmed speed (m/s).
    pub programmed_m_s: Option<f64>,
    /// Maximum speed (m/s).
    pub top_m_s: Option<f64>,
}

/// Sums over the samples of one move.
#[derive(Clone, Debug, Default)]
struct Sums {
    samples: usize,
    squares: f64,
    peak: f64,
    t_peak: f64,
    overshoot: f64,
}

/// Monitors the error across the path.
pub struct ToolPathMonitor {
    path: Arc<ToolPath>,
    sums: Vec<Sums>,
    /// Index of the current move, the first that has not ended.
    now: usize,
    /// Direction of the rigid TCP in the previous move, world axes.
    before: Vector3<f64>,
    direction: Vector3<f64>,
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Number of samples per stored point.
    every: usize,
    samples: usize,
    points: Vec<[f64; 6]>,
}

impl ToolPathMonitor {
    /// Follows the moves of this path.
    pub fn new(path: Arc<ToolPath>) -> Self {
        let sums = vec![Sums::default(); path.moves.len()];
        let (low, high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        Self {
            path,
            sums,
            now: 0,
            before: Vector3::zeros(),
            direction: Vector3::zeros(),
            low,
            high,
            every: 1,
            samples: 0,
            points: Vec::new(),
        }
    }

    /// Takes a sample at t (s).
    ///
    /// * `velocity`: of the rigid TCP (m/s, world axes).
    pub fn update(&mut self, t: f64, tool: &ToolError, velocity: &Vector3<f64>) {
        let moves = &self.path.moves;
        while self.now + 1 < moves.len() && t > moves[self.now].span_s[1] {
            self.now += 1;
            self.before = self.direction;
        }
        let Some(of) = moves.get(self.now) else { return };
        if velocity.norm() > REST {
            self.direction = velocity.normalize();
        }
        if of.top_m_s.is_none() || t < of.span_s[0] || t > of.span_s[1] {
            return;
        }
        let error = Vector3::from_row_slice(&tool.error[..3]);
        self.low = self.low.inf(&error);
        self.high = self.high.sup(&error);
        self.keep(tool.X_rigid.translation.vector, error);
        let sums = &mut self.sums[self.now];
        let across = tool.path_error[1].hypot(tool.path_error[2]);
        sums.samples += 1;
        sums.squares += across * across;
        if across > sums.peak {
            (sums.peak, sums.t_peak) = (across, t);
        }
        let swing = error - Vector3::from(tool.static_m);
        let on = swing.dot(&self.before);
        // Only for a change of direction: along the new direction it is a lead and not an
        // overshoot.
        let turned = 1.0 - self.before.dot(&self.direction).powi(2).min(1.0);
        if on.is_finite() && turned > 0.1 {
            sums.overshoot = sums.overshoot.max(on);
        }
    }

    /// Stores every `every`-th point; drops every second one when there are too many.
    fn keep(&mut self, p: Vector3<f64>, e: Vector3<f64>) {
        if self.samples.is_multiple_of(self.every) {
            self.points.push([p.x, p.y, p.z, e.x, e.y, e.z]);
        }
        self.samples += 1;
        if self.points.len() >= MAX_POINTS {
            let mut k = 0;
            self.points.retain(|_| {
                k += 1;
                k % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// Returns the figures so far; None without a sample on a TCP move.
    pub fn result(&self) -> Option<PathFigures> {
        let samples: usize = self.sums.iter().map(|sums| sums.samples).sum();
        let peak = self.sums.iter().max_by(|a, b| a.peak.total_cmp(&b.peak)).filter(|_| samples > 0)?;
        let squares: f64 = self.sums.iter().map(|sums| sums.squares).sum();
        let rms = |squares: f64, samples: usize| (squares / samples.max(1) as f64).sqrt();
        // Figures of a move, then those of all moves together.
        let figures = |(of, sums): (&flexarm_path::PlannedMove, &Sums)| PathMoveFigures {
            line: of.place.line.unwrap_or(0),
            statement: of.statement.clone(),
            span_s: of.span_s,
            across_peak_m: sums.peak,
            across_rms_m: rms(sums.squares, sums.samples),
            corner_overshoot_m: sums.overshoot,
            programmed_m_s: of.programmed_m_s,
            top_m_s: of.top_m_s,
        };
        let moves = self.path.moves.iter().zip(&self.sums).filter(|(_, sums)| sums.samples > 0);
        Some(PathFigures {
            across_peak_m: peak.peak,
            t_across_peak_s: peak.t_peak,
            across_rms_m: rms(squares, samples),
            offset_m: (0.5 * (self.low + self.high)).into(),
            left_m: 0.5 * (self.high - self.low).norm(),
            corner_overshoot_m: self.sums.iter().map(|sums| sums.overshoot).fold(0.0, f64::max),
            moves: moves.map(figures).collect(),
            points: self.points.clone(),
        })
    }
}
