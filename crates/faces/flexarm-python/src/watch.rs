//! Long calls: they release the GIL, Ctrl-C stops them, and they report progress.
//!
//! Start at [`stoppable`]: the work runs without the GIL and asks now and then whether to stop.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Interval of signal checks.
const POLL_INTERVAL: Duration = Duration::from_millis(25);
/// Time to wait for work that was asked to stop.
const PATIENCE: Duration = Duration::from_millis(100);
/// Interval of calls of a progress function.
const TELL_EVERY: Duration = Duration::from_millis(50);

/// Checks signals and reports progress from within a run, on the calling thread.
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    polled: Instant,
    reported: Instant,
    /// Exception that stopped the run.
    pub(crate) raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        let now = Instant::now();
        Self { progress, polled: now, reported: now, raised: None }
    }

    /// Checks signals and reports `done` of `total`; breaks if the run must stop.
    pub(crate) fn poll(&mut self, done: f64, total: f64) -> ControlFlow<()> {
        let checks_signals = self.polled.elapsed() >= POLL_INTERVAL;
        let reports = self.progress.is_some() && self.reported.elapsed() >= TELL_EVERY;
        if !checks_signals && !reports {
            return ControlFlow::Continue(());
        }
        let result = Python::attach(|py| {
            py.check_signals()?;
            match (&self.progress, reports) {
                (Some(progress), true) => progress.call1(py, (done, total)).map(drop),
                _ => Ok(()),
            }
        });
        self.polled = Instant::now();
        if reports {
            self.reported = self.polled;
        }
        self.keep(result)
    }

    /// Continues unless an exception was raised.
    pub(crate) fn keep(&mut self, result: PyResult<()>) -> ControlFlow<()> {
        match result {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.raised = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// Reports the end.
    pub(crate) fn done(&mut self, total: f64) -> PyResult<()> {
        match self.progress.take() {
            Some(progress) => Python::attach(|py| progress.call1(py, (total, total)).map(drop)),
            None => Ok(()),
        }
    }
}

/// Runs work on a separate thread that polls a flag; meanwhile this thread checks signals.
///
/// After a signal the work has [`PATIENCE`] to end. Then it is abandoned: its result is lost, and
/// it writes no files.
///
/// # Errors
/// An exception raised by a signal handler.
pub(crate) fn stoppable<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T + Send + 'static,
) -> PyResult<T> {
    stoppable_telling(py, work, &mut |_| Ok(()))
}

/// Like [`stoppable`]; also calls `tell` repeatedly on this thread, and once at the end.
///
/// # Errors
/// An exception raised by a signal handler or by `tell`.
pub(crate) fn stoppable_telling<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&(dyn Fn() -> bool + Sync)) -> T + Send + 'static,
    tell: &mut dyn FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (asked, unwanted) = (stop.clone(), stop.clone());
    let (sender, receiver) = channel::<T>();
    let worker = std::thread::spawn(move || {
        let work = || work(&|| asked.load(Ordering::Relaxed));
        let found = flexarm::files::writing_unless(move || unwanted.load(Ordering::Relaxed), work);
        let _ = sender.send(found); // the receiver may be gone
    });
    let receiver = Mutex::new(receiver);
    let receive = |wait| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(wait);
    loop {
        match py.detach(|| receive(POLL_INTERVAL)) {
            Ok(value) => {
                tell(py)?;
                return Ok(value);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match worker.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => return Err(PyRuntimeError::new_err("the work ended without a result")),
            },
        }
        if let Err(raised) = py.check_signals().and_then(|()| tell(py)) {
            stop.store(true, Ordering::Relaxed);
            let _ = py.detach(|| receive(PATIENCE));
            return Err(raised);
        }
    }
}
