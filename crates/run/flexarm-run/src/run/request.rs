//! Request of a run, and its result.
//!
//! Start at [`RunRequest`] and [`Run`]. Not here: options of the stepper and the log (`RunOptions`).

use std::ops::ControlFlow;

use flexarm_kinematics::Frame;
use flexarm_log::{Columns, Recorder, RunHeader, Sample, Trace};
use flexarm_stepping::Plant;

use crate::arm::options::Outputs;
use crate::motions::scenario::Scenario;
use crate::run::magnification::Expected;
use crate::run::summary::Summary;

/// Called with simulated and total time (s); breaking stops the run and leaves readable files.
pub type Progress<'a> = dyn FnMut(f64, f64) -> ControlFlow<()> + 'a;

/// Called with each logged sample; breaking stops the run.
pub type SampleObserver<'a> = dyn FnMut(&Sample) -> ControlFlow<()> + 'a;

/// Signals kept by a run in addition to its figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// None; fastest.
    Figures,
    /// All logged samples as columns.
    #[default]
    Columns,
    /// Curves of the report, thinned for long runs.
    Curves,
}

/// Requested results of a run, and callbacks during the run.
#[derive(Default)]
pub struct RunRequest<'a> {
    /// Signals to keep.
    pub keep: Keep,
    /// Recordings and report to write.
    pub outputs: Option<&'a Outputs>,
    /// Called with each logged sample.
    pub observer: Option<&'a mut SampleObserver<'a>>,
    /// Called at intervals during the run.
    pub progress: Option<&'a mut Progress<'a>>,
    /// Recorders in addition to those of `outputs`.
    pub recorders: Vec<Box<dyn Recorder>>,
    /// Expected deflections of all runs that are shown together, for a common magnification and
    /// colour scale.
    pub expected: Option<Expected>,
}

impl RunRequest<'_> {
    /// Returns a request that keeps these signals, without files or callbacks.
    pub fn keeping(keep: Keep) -> Self {
        Self { keep, ..Self::default() }
    }
}

/// Parts of a sample that are computed; each level includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Detail {
    /// Figures of the summary.
    Figures,
    /// Signals of [`flexarm_log::Columns`].
    Columns,
    /// Whole samples.
    Samples,
    /// Curves, and all contents of recordings.
    Curves,
}

impl Detail {
    pub(super) fn of(request: &RunRequest<'_>) -> Self {
        match request.keep {
            _ if request.outputs.is_some() || !request.recorders.is_empty() => Self::Curves,
            Keep::Curves => Self::Curves,
            _ if request.observer.is_some() => Self::Samples,
            Keep::Columns => Self::Columns,
            Keep::Figures => Self::Figures,
        }
    }

    /// Returns the deflections to expect; only recordings need the magnification.
    pub(super) fn expected(self, plant: &Plant, tcp: &Frame, scenario: &Scenario) -> Expected {
        match self {
            Self::Curves => Expected::of(plant, tcp, scenario.duration_s(), scenario.start),
            _ => Expected::default(),
        }
    }

    /// Returns an empty trace with the curves of this level.
    pub(super) fn trace(self, for_page: bool, head: RunHeader) -> Trace {
        match for_page {
            _ if self < Self::Curves => Trace::without_curves(head),
            true => Trace::for_page(head),
            false => Trace::new(head),
        }
    }
}

/// Results of a run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Figures, as in `summary.json`.
    pub summary: Summary,
    /// Signals; empty unless the request keeps [`Keep::Columns`].
    pub columns: Columns,
    /// Curves, thinned for long runs; empty unless the request keeps
    /// [`Keep::Curves`] or writes recordings.
    pub trace: Trace,
}

impl Run {
    /// Returns the times of the samples (s).
    pub fn time_s(&self) -> &[f64] {
        self.values("time")
    }

    /// Returns the TCP error, flexible minus rigid, world axes (m): three values per sample. Empty
    /// without the rigid twin.
    pub fn error_world_m(&self) -> &[f64] {
        self.values("error_world")
    }

    /// Returns the values of a signal, row by row; empty if there is no signal with this name.
    /// [`Columns::columns`] lists the names.
    pub fn values(&self, name: &str) -> &[f64] {
        self.columns.column(name).map_or(&[], |column| &column.values)
    }
}
