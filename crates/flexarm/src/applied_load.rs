//! Loads as values: what programs apply where people write a file of loads.

use std::fmt;
use std::sync::Arc;

use flexarm_kinematics::{Model, Wrench};
use flexarm_stepping::{Load, LoadAxes};

use crate::disturbance::{frame_of, moving_links};
use crate::error::{Error, LoadError};

/// A wrench on a frame of the robot as a function of time.
#[derive(Clone)]
pub struct AppliedLoad {
    /// `tcp`, or a link that moves.
    pub frame: String,
    /// Whether its direction stays in the world or turns with the frame.
    pub axes: LoadAxes,
    /// Force (N) and moment (N m) at the frame's origin at time t (s).
    pub wrench: Arc<dyn Fn(f64) -> Wrench + Send + Sync>,
    /// Times at which it begins, ends, jumps or bends (s): steps end there.
    pub jumps_s: Vec<f64>,
    /// Shortest period in it (s), infinite without one.
    pub period_s: f64,
}

impl fmt::Debug for AppliedLoad {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AppliedLoad").field("frame", &self.frame).field("axes", &self.axes).finish_non_exhaustive()
    }
}

impl AppliedLoad {
    /// A wrench in world axes that stays the same from `start_s` to `end_s` (s) and is zero before and after.
    pub fn during(frame: &str, F_W: Wrench, start_s: f64, end_s: f64) -> Self {
        Self {
            frame: frame.to_owned(),
            axes: LoadAxes::World,
            wrench: Arc::new(move |t| if t >= start_s && t <= end_s { F_W } else { Wrench::zeros() }),
            jumps_s: vec![start_s, end_s],
            period_s: f64::INFINITY,
        }
    }

    /// A wrench in world axes that is linear between samples and zero before and after them.
    ///
    /// * `t`: n times (s), increasing; at least two.
    /// * `F`: n wrenches.
    ///
    /// # Errors
    /// [`Error::Load`] for fewer than two samples, other numbers of them, and times that do not increase.
    pub fn sampled(frame: &str, t: &[f64], F: &[Wrench]) -> Result<Self, Error> {
        if t.len() != F.len() || t.len() < 2 || t.windows(2).any(|pair| pair[1].is_nan() || pair[1] <= pair[0]) {
            return Err(LoadError::Samples { times: t.len(), wrenches: F.len() }.into());
        }
        let (times, F) = (t.to_vec(), F.to_vec());
        let wrench = {
            let times = times.clone();
            move |t: f64| match times.partition_point(|x| *x <= t) {
                0 => Wrench::zeros(),
                k if k < times.len() => {
                    let s = (t - times[k - 1]) / (times[k] - times[k - 1]);
                    F[k - 1] * (1.0 - s) + F[k] * s
                }
                k if t == times[k - 1] => F[k - 1],
                _ => Wrench::zeros(),
            }
        };
        let (frame, period_s) = (frame.to_owned(), f64::INFINITY);
        Ok(Self { frame, axes: LoadAxes::World, wrench: Arc::new(wrench), jumps_s: times, period_s })
    }

    /// On a model, up to the end of a run (s).
    pub(crate) fn on(&self, model: &Model, duration_s: f64) -> Result<Load, Error> {
        let frame =
            frame_of(&self.frame, model).filter(|frame| frame.body > 0).ok_or_else(|| LoadError::UnknownFrame {
                frame: self.frame.clone(),
                known: moving_links(model).into_iter().map(str::to_owned).collect(),
            })?;
        let jumps = self.jumps_s.iter().copied().filter(|t| *t <= duration_s).collect();
        let (axes, wrench, period) = (self.axes, self.wrench.clone(), self.period_s);
        Ok(Load { body: frame.body, X_BF: frame.X_BF, axes, wrench, jumps, period })
    }
}
