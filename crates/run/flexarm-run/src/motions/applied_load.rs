//! Loads as values, for programs that do not use a loads file.
//!
//! Wrenches act at the origin of a frame; N, N m, s. Not here: files of loads (`loads_file`), kinds
//! of curves in them.

use flexarm_kinematics::{Frame, Model, Wrench};
use flexarm_settings::{Quantity, known_names};
use flexarm_stepping::{Load, TimedWrench};

use crate::caveat::Finding;
use crate::error::Error;
use crate::motions::loads_file::LoadLocation;
use crate::robot::TCP_FRAME;

/// A wrench on a frame of the robot as a function of time.
#[derive(Clone, Debug)]
pub struct AppliedLoad {
    /// `tcp`, or a link that moves.
    pub frame: String,
    /// Wrench at the frame's origin.
    pub wrench: TimedWrench,
    /// Start time (s), if there is one.
    pub start_s: Option<f64>,
    /// Caveats about the load as written.
    pub(crate) findings: Vec<Finding>,
    /// Location in the file, if read from one.
    pub(crate) written: Option<LoadLocation>,
}

impl AppliedLoad {
    /// Returns a load with a wrench at the origin of a frame: `tcp`, or a link that moves.
    pub fn new(frame: &str, wrench: TimedWrench) -> Self {
        Self { frame: frame.to_owned(), wrench, start_s: None, findings: Vec::new(), written: None }
    }

    /// Sets the start time (s); a load that starts after the run gives a caveat.
    #[must_use]
    pub fn starting_at(self, start_s: f64) -> Self {
        Self { start_s: Some(start_s), ..self }
    }

    /// Returns a constant wrench in world axes from `start_s` to `end_s` (s), zero before and
    /// after.
    pub fn during(frame: &str, F_W: Wrench, start_s: f64, end_s: f64) -> Self {
        let wrench = TimedWrench::new(move |t| if t >= start_s && t <= end_s { F_W } else { Wrench::zeros() });
        Self::new(frame, wrench.with_jumps(vec![start_s, end_s])).starting_at(start_s)
    }

    /// Returns a wrench in world axes that is linear between samples and zero outside them.
    ///
    /// * `t`: n times (s), increasing; at least two.
    /// * `F`: n wrenches.
    ///
    /// # Errors
    /// [`Error::Load`] for fewer than two samples, different numbers of times and wrenches, and
    /// times that do not increase.
    pub fn sampled(frame: &str, t: &[f64], F: &[Wrench]) -> Result<Self, Error> {
        if t.len() != F.len() || t.len() < 2 || t.windows(2).any(|pair| pair[1].is_nan() || pair[1] <= pair[0]) {
            let message = format!(
                "a load needs at least two samples, one wrench for each time, and times that increase; found {} \
                 times and {} wrenches",
                t.len(),
                F.len()
            );
            return Err(Error::Load(message));
        }
        let wrench = interpolated(t.to_vec(), F.to_vec());
        Ok(Self::new(frame, TimedWrench::new(wrench).with_jumps(t.to_vec())).starting_at(t[0]))
    }

    /// Returns the load on a model, up to the end of a run (s).
    pub(crate) fn on(&self, model: &Model, duration_s: f64) -> Result<Load, Error> {
        let frame = frame_of(&self.frame, model).filter(|frame| frame.body > 0).ok_or_else(|| {
            let known: Vec<String> = moving_links(model).into_iter().map(str::to_owned).collect();
            LoadLocation::frame(self.written.as_ref(), unknown_frame(&self.frame, &known))
        })?;
        let jumps: Vec<f64> = self.wrench.jumps.iter().copied().filter(|t| *t <= duration_s).collect();
        for F in jumps.iter().map(|t| (self.wrench.value)(*t)) {
            let force = Quantity::FORCE.check_all("the force of a load", &F.force);
            let torque = Quantity::TORQUE.check_all("the torque of a load", &F.torque);
            force.and(torque).map_err(|cause| LoadLocation::entry(self.written.as_ref(), cause))?;
        }
        Ok(Load { body: frame.body, X_BF: frame.X_BF, wrench: self.wrench.clone().with_jumps(jumps) })
    }
}

/// Returns a wrench over time that is linear between samples and zero outside them; at least two.
pub(crate) fn interpolated(t: Vec<f64>, F: Vec<Wrench>) -> impl Fn(f64) -> Wrench + Send + Sync {
    move |at| {
        let last = t.len() - 1;
        if !(t[0]..=t[last]).contains(&at) {
            return Wrench::zeros();
        }
        let k = t.partition_point(|x| *x <= at).min(last);
        F[k - 1] + (F[k] - F[k - 1]) * ((at - t[k - 1]) / (t[k] - t[k - 1]))
    }
}

/// Returns the names of the links that move, for messages.
pub fn moving_links(model: &Model) -> Vec<&str> {
    let named = model.frames().iter().filter(|f| f.body > 0 && !f.name.starts_with("__"));
    named.map(|f| f.name.as_str()).collect()
}

/// Returns the frame with this name; `tcp` is the TCP frame.
pub(crate) fn frame_of<'m>(name: &str, model: &'m Model) -> Option<&'m Frame> {
    model.frame(if name == "tcp" { TCP_FRAME } else { name })
}

/// Text about a frame that is neither the TCP nor a link that moves.
pub(crate) fn unknown_frame(frame: &str, known: &[String]) -> String {
    format!("load on frame {frame:?}: expected \"tcp\" or a link that moves, of {}", known_names(frame, known))
}
